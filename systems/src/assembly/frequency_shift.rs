//! First-order effect of the mass of rods on an assembly: frequency shifts and folds (theory 3.9).

use super::configuration::Configuration;
use super::light_rod::LightRodAt;
use super::modes::Modes;
use super::network::Assembly;
use super::rod_element::{EndKind, Link, LinkPoint};
use super::stiffness::carried;
use crate::error::{Error, Result};
use crate::math::se3::halves;
use crate::rod::{Rates, RodRates, SectionMass, Wrench};
use crate::solve::normal_form::{normal_form, null_vectors};
use crate::solve::parametrised_problem::{Family, Linearised};
use nalgebra::{DMatrix, DVector, Isometry3, Matrix6, SVector, Vector3, Vector6};

/// Newton steps towards a fold, the step of their derivatives, and the largest distance of the fold, relative to
/// 1 + |q|.
const NEARER: usize = 2;
const ASIDE: f64 = 1e-3;
const NEAR: f64 = 0.1;
/// Relative difference of squared frequencies below which they count as equal: the mass of the rods decides how they
/// mix.
const ONE: f64 = 1e-6;

/// A fold of a rod with its ends held, reached as the ends move. The critical direction has length 1 in the chart.
#[derive(Debug, Clone, PartialEq)]
pub struct HeldFold {
    /// Chart at the fold.
    pub at: Wrench,
    /// z.
    pub along: Wrench,
    /// A, a power.
    pub drive: f64,
    /// B, an energy.
    pub bend: f64,
}

/// Equations of a rod's chart while its ends are held, with time as the parameter.
struct HeldChart<'a> {
    link: &'a Link,
    held: Isometry3<f64>,
    scale: Matrix6<f64>,
    drive: Vector6<f64>,
    tolerance: f64,
}

impl Family for HeldChart<'_> {
    fn size(&self) -> usize {
        6
    }

    fn linearised(&self, x: &DVector<f64>, _: f64) -> Result<Linearised> {
        let q = Wrench::from_column_slice(x.as_slice());
        let end = self.link.held(&q, &self.held, self.tolerance)?;
        let gap = self.scale * end.gap(&self.held);
        let jacobian = self.scale * end.jacobian;
        Ok(Linearised {
            residual: DVector::from_column_slice((-gap).as_slice()),
            jacobian: DMatrix::from_column_slice(6, 6, jacobian.as_slice()),
            slope: DVector::from_column_slice((-self.drive).as_slice()),
        })
    }
}

impl Link {
    /// Fold next to `q` of the rod with its ends held, for the attachments' motion in `point` (theory 2.8, 3.9), in
    /// any kind of chart. The equations of the chart are J q' = drive: l . J = 0, J z = 0. The length of l makes it
    /// dual to them by the force (and couple, at a weld) that z makes on the end.
    ///
    /// # Errors
    /// As [`Link::held`]; a rod that is at no fold, or at one without a normal form.
    pub fn fold(&self, q: &Wrench, point: &LinkPoint, tolerance: f64) -> Result<HeldFold> {
        let seen = self.with_base_rotation(&point.base.pose.rotation);
        let scale = self.gap_scale(&point.end);
        let drive = scale * point.drive();
        let family = HeldChart {
            link: &seen,
            held: point.held(),
            scale,
            drive,
            tolerance,
        };
        let mut x = DVector::from_column_slice(q.as_slice());
        let [mut l, mut z] = null_vectors(&family.linearised(&x, 0.0)?.jacobian)?;
        for _ in 0..NEARER {
            // l . J z grows by 2 B a along z.
            let there = |far: f64| -> Result<f64> {
                let jacobian = family.linearised(&(&x + &z * far), 0.0)?.jacobian;
                Ok(l.dot(&(jacobian * &z)))
            };
            let step = ASIDE * (1.0 + x.norm());
            let (now, slope) = (there(0.0)?, (there(step)? - there(-step)?) / (2.0 * step));
            let way = -now / slope;
            if !(way.abs() <= NEAR * (1.0 + x.norm())) {
                return Err(Error::domain("the rod is at no fold"));
            }
            x += &z * way;
            [l, z] = null_vectors(&family.linearised(&x, 0.0)?.jacobian)?;
        }
        let at = Wrench::from_column_slice(x.as_slice());
        let end = seen.held(&at, &family.held, tolerance)?;
        let by = end.resultants * Wrench::from_column_slice(z.as_slice());
        let given = scale * Wrench::from_column_slice(l.as_slice());
        let (couple, force) = halves(&given);
        let forces = by.fixed_rows::<3>(3);
        let (work, size) = match &end.kind {
            EndKind::Welded { .. } => (
                forces.dot(&force) + by.fixed_rows::<3>(6).dot(&couple),
                given.norm_squared(),
            ),
            EndKind::Pinned { chord, .. } => (forces.dot(chord), force.dot(chord)),
            EndKind::OnBall { .. } | EndKind::Taut { .. } => {
                (forces.dot(&force), force.norm_squared())
            }
        };
        let dual = work / size;
        if !dual.is_finite() {
            return Err(Error::domain("paths of equilibria cross here"));
        }
        let [drive, bend] = normal_form(&family, &x, 0.0, &(l * dual), &z)?;
        Ok(HeldFold {
            at,
            along: Wrench::from_column_slice(z.as_slice()),
            drive: drive.abs(),
            bend: bend.abs(),
        })
    }
}

impl LightRodAt<'_> {
    /// Twice the kinetic energy x^T N y of two small motions of the rod, for every pair of `motions`: the twists of
    /// base and end in the world and the rates of the chart. Between two ball joints the rod spins freely about its
    /// chord.
    fn metric(&self, motions: &[(SVector<f64, 12>, Wrench)]) -> Option<DMatrix<f64>> {
        let still = RodRates {
            rate: Wrench::zeros(),
            spin: Vector3::zeros(),
        };
        let found = self.inertia(&still, Rates::End)?;
        let matrix = match self.freedom(&found.matrix) {
            None => found.matrix,
            Some(free) => free.eliminated(&found.matrix),
        };
        let swept = motions
            .iter()
            .map(|(twists, rates)| self.base_motion(twists, rates));
        let columns: Vec<SVector<f64, 12>> = swept.collect();
        let count = columns.len();
        Some(DMatrix::from_fn(count, count, |i, j| {
            columns[i].dot(&(matrix * columns[j]))
        }))
    }
}

impl Modes {
    /// Relative change of the lowest frequency by the mass of the rods, `masses` in the order of the
    /// links: -1/2 x^T N x for x^T M x = 1, to first order. For a multiple lowest frequency, the largest change. None
    /// if no frequency is above zero.
    pub fn shift_by_rods(
        &self,
        assembly: &Assembly,
        now: &Configuration,
        masses: &[Option<SectionMass>],
        tolerance: f64,
    ) -> Option<f64> {
        let lowest = self.squares.iter().copied().find(|x| *x > self.neutral)?;
        let alike: Vec<usize> = (0..self.squares.len())
            .filter(|k| (self.squares[*k] - lowest).abs() <= ONE * lowest)
            .collect();
        let points = (assembly.points(0.0, &now.bodies, &now.charts, tolerance)).ok()?;
        let (starts, _) = assembly.freedoms();
        let own = assembly.own_twists(&now.bodies);
        let mut sum = DMatrix::zeros(alike.len(), alike.len());
        for (k, sections) in masses.iter().enumerate() {
            let Some(sections) = sections else { continue };
            let link = assembly.links.get(k)?;
            let levers = link.levers(&now.bodies);
            let motions = alike.iter().map(|mode| {
                let shape = self.shapes.column(*mode);
                let mut twists = SVector::<f64, 12>::zeros();
                for (i, lever) in levers.iter().enumerate() {
                    let Some((body, arm)) = lever else { continue };
                    let rows = shape.rows(starts[*body], assembly.carriers[*body].freedoms());
                    let twist = carried(arm) * (&own[*body] * rows);
                    twists.fixed_rows_mut::<6>(6 * i).copy_from(&twist);
                }
                let rates = self.charts.column(*mode);
                (twists, rates.fixed_rows::<6>(6 * k).into_owned())
            });
            let motions: Vec<(SVector<f64, 12>, Wrench)> = motions.collect();
            let rod = LightRodAt {
                link,
                sections,
                q: &now.charts[k],
                point: &points[k],
                tolerance,
            };
            sum += rod.metric(&motions)?;
        }
        let most = sum.symmetric_eigenvalues().max();
        most.is_finite().then_some(-0.5 * most)
    }
}
