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
use super::ScaledTouch;
use super::lying::Lying;
use crate::error::{Error, Result};
use crate::math::se3::{halves, join};
use crate::obstacle::Gap;
use crate::section::Compliance;
use crate::solve::dop853::Step;
use nalgebra::{Matrix3, Matrix3xX, RowDVector, SMatrix, Vector3, Vector6};

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
    pub(super) start: TouchedSection,
    pub(super) end: Moving<K>,
    /// int f of the load.
    pub(super) load: Vector3<f64>,
    /// The steps of the integration; left out where a tangent goes along.
    pub(super) steps: Vec<Step<Moving<K>>>,
}

/// A part of the rod between two stops.
pub(super) enum Piece<const K: usize> {
    Free(Box<Stretch<K>>),
    Lying(Box<Lying>),
}

impl<const K: usize> Piece<K> {
    /// The place at which the part ends.
    pub(super) fn end(&self) -> f64 {
        match self {
            Self::Free(stretch) => stretch.end.s,
            Self::Lying(lying) => lying.to,
        }
    }
}

/// Continuation of the rod behind a stop.
pub(super) enum Onward {
    /// A free stretch, behind a force on the rod.
    Free(Vector3<f64>),
    /// A stretch that lies on a surface.
    Lies(Box<Lying>),
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
pub(super) struct TouchedSection {
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

impl TouchedSection {
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
    pub(super) touches: Vec<(TouchedSection, Varied)>,
    /// The end beyond a touch there, with the variations of m_c and n_c.
    pub(super) end: TouchedSection,
    pub(super) varied: Varied,
}

impl<'a> LoadedRod<'a> {
    /// Integrates one stretch.
    fn stretch<const K: usize>(
        &self,
        at: &Moving<K>,
        start: TouchedSection,
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

    /// The section at the clamp.
    pub(super) fn clamp(&self, b: &Wrench) -> Result<TouchedSection> {
        TouchedSection::new(self.law, self.load, &Moving::<0>::clamp(), b)
    }

    /// Visits the sections `stops` in growing order from the clamp: `visit` returns what follows. The stretches between
    /// are shown to `over`.
    pub(super) fn walk<const K: usize>(
        &self,
        b: &Wrench,
        stops: &[f64],
        mut over: impl FnMut(Piece<K>),
        mut visit: impl FnMut(usize, &TouchedSection, f64) -> Result<Onward>,
    ) -> Result<()> {
        let (mut m, mut n) = halves(b);
        let mut at = Moving::<K>::clamp();
        let mut here = TouchedSection::new(self.law, self.load, &at, b)?;
        let mut lies: Option<Box<Lying>> = None;
        for (k, &stop) in stops.iter().enumerate() {
            if let Some(lying) = lies.take() {
                here = lying.section(self.load, stop);
                let (state, constants) = lying.state(self.load, stop);
                (m, n) = halves(&constants);
                at = state;
                over(Piece::Lying(lying));
            } else if stop - at.s > SAME_PLACE {
                let stretch = self.stretch(&at, here, join(&m, &n), stop)?;
                here = TouchedSection::new(self.law, self.load, &stretch.end, &stretch.constants)?;
                // The couple w of the load becomes a part of the constant.
                m = here.m + here.r.cross(&here.n);
                at = stretch.end.as_start();
                over(Piece::Free(Box::new(stretch)));
            }
            match visit(k, &here, at.energy())? {
                Onward::Free(force) => {
                    m -= here.r.cross(&force);
                    n -= force;
                    here.n -= force;
                }
                Onward::Lies(lying) => lies = Some(lying),
            }
        }
        Ok(())
    }

    /// The rod under a base wrench and the forces of its touches, with the variations by all unknowns: the base wrench,
    /// and for each touch its own. `plane` is the normal of the plane, if the rod is planar.
    pub(super) fn touched(
        &self,
        b: &Wrench,
        touches: &[ScaledTouch],
        plane: Option<&Vector3<f64>>,
        gap: impl Fn(usize, &Vector3<f64>) -> Gap,
    ) -> Result<TouchedRod> {
        let stops = stops(touches);
        let columns = first_columns(touches);
        let more = touches.iter().map(ScaledTouch::unknowns).sum();
        let varied = std::cell::RefCell::new(Varied::clamp(more));
        let lies = std::cell::RefCell::new(None);
        let mut found: Vec<Option<(TouchedSection, Varied)>> = vec![None; touches.len()];
        let mut end = None;
        let places: Vec<f64> = stops.iter().map(Stop::place).collect();
        self.walk::<COLUMNS>(
            b,
            &places,
            |piece| match piece {
                Piece::Free(stretch) => {
                    Transfer::from(&*stretch).take(&mut varied.borrow_mut(), &stretch.start.n);
                }
                Piece::Lying(lying) => *lies.borrow_mut() = Some(lying),
            },
            |k, here, energy| {
                let (i, touch) = match stops[k] {
                    Stop::End => {
                        end = Some(*here);
                        return Ok(Onward::Free(Vector3::zeros()));
                    }
                    Stop::Touch(i, _) | Stop::Lift(i, _) => (i, &touches[i]),
                };
                let mut varied = varied.borrow_mut();
                let here_gap = gap(touch.surface, &here.r);
                if let (Some(lying), Some((before, at_start))) = (lies.take(), &found[i]) {
                    let unit = |column: usize| {
                        let mut row = RowDVector::zeros(6 + more);
                        row[column] = 1.0;
                        row
                    };
                    let none = || RowDVector::zeros(6 + more);
                    let [push, place, length] = touch.columns(columns[i]);
                    let at_from = place.map_or_else(none, unit);
                    let at_to = &at_from + length.map_or_else(none, unit);
                    let moves = [at_from, at_to, push.map_or_else(none, unit)];
                    *varied = lying.carry(self.load, at_start, &before.n, touch.reaction, &moves);
                    return Ok(Onward::Free(here_gap.normal * touch.reaction));
                }
                found[i] = Some((*here, varied.clone()));
                if touch.line.is_some() {
                    let lying = self.lying(touch, (here, energy), &gap, plane)?;
                    return Ok(Onward::Lies(Box::new(lying)));
                }
                let gap = here_gap;
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
                Ok(Onward::Free(force))
            },
        )?;
        let touches = found.into_iter().flatten().collect();
        let end: TouchedSection = end.expect("the walk ends at s = 1");
        Ok(TouchedRod {
            touches,
            end,
            varied: varied.into_inner(),
        })
    }

    /// The stretch of a line that begins at a section, with the energy up to the section.
    pub(super) fn lying(
        &self,
        touch: &ScaledTouch,
        (here, energy): (&TouchedSection, f64),
        gap: impl Fn(usize, &Vector3<f64>) -> Gap,
        plane: Option<&Vector3<f64>>,
    ) -> Result<Lying> {
        let plane = plane.ok_or_else(|| {
            Error::unreachable(
                "line contact: the rod lies along an obstacle outside of a plane of symmetry; only rods in a plane lie on \
                 obstacles",
            )
        })?;
        // The start is put onto the surface: what the section misses there is for the equations alone.
        let off = gap(touch.surface, &here.r);
        let r = here.r - off.normal * off.value;
        let section = TouchedSection { r, ..*here };
        let on = gap(touch.surface, &r);
        Lying::new(
            (self.law, self.load),
            (touch.s, touch.to()),
            (&section, energy),
            &on,
            plane,
        )
    }
}

/// A stop of the walk along the rod.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) enum Stop {
    /// A touch, or the start of a line, by its number and place.
    Touch(usize, f64),
    /// The end of a line, by its number and place.
    Lift(usize, f64),
    End,
}

impl Stop {
    pub(super) fn place(&self) -> f64 {
        match self {
            Self::Touch(_, s) | Self::Lift(_, s) => *s,
            Self::End => 1.0,
        }
    }
}

/// The touches and the ends of lines in the order of their places, then the end of the rod.
pub(super) fn stops(touches: &[ScaledTouch]) -> Vec<Stop> {
    let mut stops: Vec<Stop> = Vec::new();
    for (i, touch) in touches.iter().enumerate() {
        stops.push(Stop::Touch(i, touch.s));
        if touch.line.is_some() {
            stops.push(Stop::Lift(i, touch.to()));
        }
    }
    // A stable order: the start of a line stands before its end, also where the line shrinks below zero.
    let order = |stop: &Stop| match stop {
        Stop::Lift(i, s) => s.max(touches[*i].s),
        other => other.place(),
    };
    stops.sort_by(|a, b| order(a).total_cmp(&order(b)));
    stops.push(Stop::End);
    stops
}

impl ScaledTouch {
    /// Columns of reaction, place and length, if `first` is the first column of the touch.
    pub(super) fn columns(&self, first: usize) -> [Option<usize>; 3] {
        let mut next = first;
        self.has().map(|has| {
            has.then(|| {
                next += 1;
                next - 1
            })
        })
    }
}

/// The column of each touch's reaction; the place follows it, if the touch is not at the end.
pub(super) fn first_columns(touches: &[ScaledTouch]) -> Vec<usize> {
    let mut next = 6;
    let column = |touch: &ScaledTouch| {
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
