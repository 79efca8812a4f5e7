//! Rod from its base wrench under the forces of its touches: the initial-value problem of `ivp` with jumps.
//!
//! At a touch at s_i the force falls by F = R nu(r(s_i)), nu the obstacle's normal at the centreline; frame, couple and
//! centreline are continuous. With m(s) = m_c - r x n(s) - w(s) the constants of the flow change to
//!
//! ```text
//! n_c+ = n_c - F,   m_c+ = m_c - r x F,
//! dF = nu dR + R H (rho + r' ds_i),   dn_c+ = dn_c - dF,   dm_c+ = dm_c - (rho + r' ds_i) x F - r x dF.
//! ```
//!
//! Frame and centreline have no saltation of their own: their slopes are the same on both sides of s_i, because the
//! couple is continuous and the section does not shear. Columns run over all unknowns. Between two touches the rod is
//! integrated with nine columns: six for the constants, three for the turn of the start. The columns of the unknowns
//! are their combinations.

use super::super::distributed_load::{LoadMoment, LoadState, ScaledLoad};
use super::super::ivp::{LineState, Wrench, integrate, unit_columns};
use super::super::scaled_law::ScaledLaw;
use super::Touch;
use crate::error::Result;
use crate::math::se3::{halves, join};
use crate::obstacle::Gap;
use crate::section::Compliance;
use crate::solve::dop853::Step;
use nalgebra::{Matrix3, Matrix3xX, SMatrix, Vector3, Vector6};

/// Columns of one stretch: couple and force at its start, and the turn of the start.
pub(super) const COLUMNS: usize = 9;
/// Stretches shorter than this are none.
pub(super) const SAME_PLACE: f64 = 1e-12;

/// State along a stretch, with `K` columns of its tangent.
pub(super) type Moving<const K: usize> = LineState<K, LoadMoment<K>>;

/// One stretch of the rod, from a touch to the next.
pub(super) struct Stretch<const K: usize> {
    /// The constants (m_c, n_c) of the flow.
    pub(super) constants: Wrench,
    /// The section at the start, beyond the touch of the start.
    pub(super) start: Section,
    pub(super) end: Moving<K>,
    /// int f of the load.
    pub(super) load: Vector3<f64>,
    /// The steps of the integration; left out where a tangent goes along.
    pub(super) steps: Vec<Step<Moving<K>>>,
}

/// A rod with the loads along the rod, in units of the rod and in the clamp's frame.
#[derive(Clone, Copy)]
pub(super) struct LoadedRod<'a> {
    pub(super) law: &'a ScaledLaw,
    pub(super) load: &'a ScaledLoad,
    pub(super) tolerance: f64,
}

/// Variations by columns at one section: rotation, place, and the constants m_c and n_c of the flow.
#[derive(Debug, Clone)]
pub(super) struct Varied {
    pub(super) phi: Matrix3xX<f64>,
    pub(super) rho: Matrix3xX<f64>,
    pub(super) dm: Matrix3xX<f64>,
    pub(super) dn: Matrix3xX<f64>,
}

impl Varied {
    /// The clamp, with unit columns of the base wrench and `more` columns of other unknowns.
    pub(super) fn clamp(more: usize) -> Self {
        let zero = Matrix3xX::zeros(6 + more);
        let mut varied = Self {
            phi: zero.clone(),
            rho: zero.clone(),
            dm: zero.clone(),
            dn: zero,
        };
        for i in 0..3 {
            varied.dm[(i, i)] = 1.0;
            varied.dn[(i, 3 + i)] = 1.0;
        }
        varied
    }
}

/// A section of the rod with its strains and resultants, just before a touch if there is one.
#[derive(Debug, Clone, Copy)]
pub(super) struct Section {
    pub(super) r: Vector3<f64>,
    /// Directors as columns.
    pub(super) rotation: Matrix3<f64>,
    pub(super) m: Vector3<f64>,
    pub(super) n: Vector3<f64>,
    /// Curvature and twist in the frame of the clamp.
    pub(super) turn: Vector3<f64>,
    /// Stretch |r'|; r' is along d3, since the section does not shear.
    pub(super) stretch: f64,
}

impl Section {
    pub(super) fn new<const K: usize, C: LoadState<K>>(
        law: &ScaledLaw,
        load: &C::Load,
        at: &LineState<K, C>,
        b: &Wrench,
    ) -> Result<Self> {
        let rotation = at.rotation();
        let (m, n) = at.resultants(b, load);
        let back = rotation.transpose();
        let strain = law.inverse(at.s, &join(&(back * m), &(back * n)))?.strain;
        Ok(Self {
            r: at.position(),
            rotation,
            m,
            n,
            turn: rotation * strain.fixed_rows::<3>(0),
            stretch: strain[5],
        })
    }

    /// The tangent d3.
    pub(super) fn tangent(&self) -> Vector3<f64> {
        self.rotation.column(2).into_owned()
    }

    /// r' = stretch d3.
    pub(super) fn along(&self) -> Vector3<f64> {
        self.tangent() * self.stretch
    }

    /// Slope h' of a gap along the rod.
    pub(super) fn slope(&self, gap: &Gap) -> f64 {
        gap.normal.dot(&self.along())
    }

    /// Relative curvature h'' = r'.H r' + nu.r'' where h' = 0: there a change of the stretch does not count.
    pub(super) fn relative_curvature(&self, gap: &Gap) -> f64 {
        let along = self.along();
        along.dot(&(gap.hessian * along)) + gap.normal.dot(&self.turn.cross(&along))
    }
}

/// Transfer over one stretch of the rod: its end by couple and force at its start, and by the turn of the start.
#[derive(Debug, Clone)]
pub(super) struct Transfer {
    /// Rows phi, rho; columns m_c, n_c, turn.
    pub(super) tangent: SMatrix<f64, 6, COLUMNS>,
    /// dw of the load by the same columns.
    pub(super) dw: SMatrix<f64, 3, COLUMNS>,
    /// int f of the load.
    pub(super) load: Vector3<f64>,
}

impl From<&Stretch<COLUMNS>> for Transfer {
    fn from(stretch: &Stretch<COLUMNS>) -> Self {
        let end = &stretch.end;
        let mut taken = [[0.0; COLUMNS]; 3];
        end.carried.take_columns(&mut taken);
        Self {
            tangent: SMatrix::from_fn(|i, j| end.tangent[i][j]),
            dw: SMatrix::from_fn(|i, j| -taken[i][j]),
            load: stretch.load,
        }
    }
}

impl Transfer {
    /// Takes the variations over the stretch; `n` is the force at its start. A displacement of the start acts as the
    /// couple n x rho.
    fn take(&self, at: &mut Varied, n: &Vector3<f64>) {
        let given = &at.dm + n.cross_matrix() * &at.rho;
        let over = |matrix: &dyn Fn(usize) -> Matrix3<f64>| {
            matrix(0) * &given + matrix(3) * &at.dn + matrix(6) * &at.phi
        };
        let block = |row: usize| {
            move |column: usize| self.tangent.fixed_view::<3, 3>(row, column).into_owned()
        };
        let phi = over(&block(0));
        let rho = over(&block(3)) + &at.rho;
        let dw = over(&|column| self.dw.fixed_view::<3, 3>(0, column).into_owned())
            - self.load.cross_matrix() * &at.rho;
        at.dm -= dw;
        at.phi = phi;
        at.rho = rho;
    }
}

/// Sections of the rod at touches and at the end, with variations.
pub(super) struct TouchedRod {
    /// Section and variations at each touch, in the order of the touches given.
    pub(super) touches: Vec<(Section, Varied)>,
    /// The end beyond a touch there, with the variations of m_c and n_c.
    pub(super) end: Section,
    pub(super) varied: Varied,
}

impl<'a> LoadedRod<'a> {
    /// Integrates one stretch.
    fn stretch<const K: usize>(
        &self,
        at: &Moving<K>,
        start: Section,
        constants: Wrench,
        to: f64,
    ) -> Result<Stretch<K>> {
        let law = self.law.between(at.s, to);
        let first = (at.as_start(), unit_columns());
        let mut steps = Vec::new();
        let (mut end, _) = integrate(
            &law,
            self.load,
            &constants,
            first,
            self.tolerance,
            |step, _| {
                if K == 0 {
                    steps.push(step.clone());
                }
            },
        )?;
        end.s = to;
        Ok(Stretch {
            constants,
            start,
            end,
            load: self.load.integral_to(to) - self.load.integral_to(at.s),
            steps,
        })
    }

    /// Visits the sections `stops` in growing order from the clamp: `visit` returns the force F that acts on the rod
    /// there. The stretches between are shown to `over`.
    pub(super) fn walk<const K: usize>(
        &self,
        b: &Wrench,
        stops: &[f64],
        mut over: impl FnMut(Stretch<K>),
        mut visit: impl FnMut(usize, &Section) -> Vector3<f64>,
    ) -> Result<()> {
        let (mut m, mut n) = halves(b);
        let mut at = Moving::<K>::clamp();
        let mut here = Section::new(self.law, self.load, &at, b)?;
        for (k, &stop) in stops.iter().enumerate() {
            if stop - at.s > SAME_PLACE {
                let stretch = self.stretch(&at, here, join(&m, &n), stop)?;
                here = Section::new(self.law, self.load, &stretch.end, &stretch.constants)?;
                // The couple w of the load becomes a part of the constant.
                m = here.m + here.r.cross(&here.n);
                at = stretch.end.as_start();
                over(stretch);
            }
            let force = visit(k, &here);
            m -= here.r.cross(&force);
            n -= force;
            here.n -= force;
        }
        Ok(())
    }

    /// The rod under a base wrench and the forces of its touches, with the variations by all unknowns: the base wrench,
    /// and for each touch its reaction and, if it is not at the end, its place.
    pub(super) fn touched(
        &self,
        b: &Wrench,
        touches: &[Touch],
        gap: impl Fn(usize, &Vector3<f64>) -> Gap,
    ) -> Result<TouchedRod> {
        let mut order: Vec<usize> = (0..touches.len()).collect();
        order.sort_by(|i, j| touches[*i].s.total_cmp(&touches[*j].s));
        let mut stops: Vec<f64> = order.iter().map(|i| touches[*i].s).collect();
        stops.push(1.0);
        let columns = first_columns(touches);
        let more = touches.iter().map(Touch::unknowns).sum();
        let varied = std::cell::RefCell::new(Varied::clamp(more));
        let mut found: Vec<Option<(Section, Varied)>> = vec![None; touches.len()];
        let mut end = None;
        self.walk::<COLUMNS>(
            b,
            &stops,
            |stretch| Transfer::from(&stretch).take(&mut varied.borrow_mut(), &stretch.start.n),
            |k, here| {
                let Some(&i) = order.get(k) else {
                    end = Some(*here);
                    return Vector3::zeros();
                };
                let touch = &touches[i];
                let mut varied = varied.borrow_mut();
                found[i] = Some((*here, varied.clone()));
                let gap = gap(touch.surface, &here.r);
                let force = gap.normal * touch.reaction;
                let mut moved = varied.rho.clone();
                if !touch.at_end {
                    let place = columns[i] + 1;
                    let column = moved.column(place) + here.along();
                    moved.set_column(place, &column);
                }
                let mut change = gap.hessian * &moved * touch.reaction;
                let column = change.column(columns[i]) + gap.normal;
                change.set_column(columns[i], &column);
                varied.dm += force.cross_matrix() * &moved - here.r.cross_matrix() * &change;
                varied.dn -= change;
                force
            },
        )?;
        let touches = found.into_iter().flatten().collect();
        let end: Section = end.expect("the walk ends at s = 1");
        Ok(TouchedRod {
            touches,
            end,
            varied: varied.into_inner(),
        })
    }
}

/// The column of each touch's reaction; the place follows it, if the touch is not at the end.
pub(super) fn first_columns(touches: &[Touch]) -> Vec<usize> {
    let mut next = 6;
    let column = |touch: &Touch| {
        let here = next;
        next += touch.unknowns();
        here
    };
    touches.iter().map(column).collect()
}

/// True if the section can shear, or has a shear at rest: a touch at a point then has a kink.
pub(super) fn shears(law: &ScaledLaw) -> Result<bool> {
    for s in [0.0, 0.5, 1.0] {
        let unloaded = law.inverse(s, &Vector6::zeros())?;
        let across = match &*unloaded.compliance {
            Compliance::Diagonal(c) => c[3] != 0.0 || c[4] != 0.0,
            Compliance::Full(c) => c.rows(3, 2).iter().any(|c| *c != 0.0),
        };
        if across || unloaded.strain[3] != 0.0 || unloaded.strain[4] != 0.0 {
            return Ok(true);
        }
    }
    Ok(false)
}
