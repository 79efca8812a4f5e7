//! Rods between two ball joints: springs along their chords.
//!
//! Without couples at both ends the force is along the chord, r(1) x n = 0. The force n, along the directors of the
//! base, charts the rod with its length: in the six numbers of the chart
//! ```text
//! dm(0) = 0,       (r^ r^T) dr(1) + (L/couple) dm(1) = r^ dl,
//! ```
//! r^ the direction of the chord, l its length; dm(1) is across r^ where m(0) = 0. The directors of the base follow
//! the chord except for a spin about it, on which only the rod's own mass acts (`chord_spin`). The curve of a buckled
//! round rod can also spin about its own d3, n' = d3 x n: that direction is held.

use super::attachment::Joint;
use super::rod_element::{EndKind, Link, LinkEnd, LinkPoint};
use crate::error::{Error, Result};
use crate::math::se3::{halves, join};
use crate::rod::{RodSection, Wrench};
use crate::solve::deflation::{self, find_further};
use crate::solve::newton;
use crate::solve::parametrised_problem::{Family, Linearised};
use nalgebra::{
    DMatrix, DVector, Isometry3, Matrix3, Matrix6, Quaternion, SMatrix, Unit, UnitQuaternion,
    Vector3, Vector6,
};

/// Relative residual, against other directions, up to which a rotation counts as neutral.
const NEUTRAL: f64 = 1e-8;
/// 1 + the cosine of the angle between directions that count as opposite.
const OPPOSITE: f64 = 1e-14;
/// Relative transverse force below which a force counts as along d3.
const STRAIGHT: f64 = 1e-12;
/// Eigenvalues of the stiffness of a base above minus this part of the largest are not negative.
const ZERO: f64 = 1e-7;
/// A neutral direction with less than this part along the chord is neutral for any motion of the chord.
const ACROSS: f64 = 1e-7;
/// Forces, in B/L^2, of starts for other equilibria: near the first two buckling loads of a column.
const TYPICAL: [f64; 2] = [10.0, 40.0];
/// Largest number of Newton steps from such a start.
const PATIENCE: usize = 40;

/// Family in the force of a rod between two ball joints at a given distance.
struct ChordFamily<'a> {
    link: &'a Link,
    held: &'a Isometry3<f64>,
    tolerance: f64,
}

impl Family for ChordFamily<'_> {
    fn size(&self) -> usize {
        3
    }

    fn linearised(&self, x: &DVector<f64>, _: f64) -> Result<Linearised> {
        let q = join(&Vector3::zeros(), &Vector3::from_column_slice(x.as_slice()));
        let end = self.link.end(&q, self.tolerance)?;
        let length = self.link.rod().length();
        let gap = halves(&end.gap(self.held)).1 / length;
        let jacobian = end.jacobian.fixed_view::<3, 3>(3, 3) / length;
        Ok(Linearised {
            residual: DVector::from_column_slice((-gap).as_slice()),
            jacobian: DMatrix::from_column_slice(3, 3, jacobian.as_slice()),
            slope: DVector::zeros(3),
        })
    }
}

impl LinkEnd {
    /// Neutral rotation of the force of a round rod about its base while the curve turns in itself; None for any
    /// other rod. The chart holds this direction.
    pub(super) fn own_turn(&self) -> Option<Vector3<f64>> {
        let EndKind::Pinned {
            chord, per_couple, ..
        } = &self.kind
        else {
            return None;
        };
        let couple = self.resultants.fixed_rows::<3>(6).into_owned();
        let rows = chord_rows(&self.tangent, &couple, chord, *per_couple);
        let by_force = rows.fixed_columns::<3>(3).into_owned();
        own_turn(&by_force, &self.force, &(self.couple * *per_couple))
    }
}

/// Derivatives by the chart of the chord, and of m(1) in lengths.
fn chord_rows(
    tangent: &Matrix6<f64>,
    couple: &SMatrix<f64, 3, 6>,
    along: &Vector3<f64>,
    per_couple: f64,
) -> SMatrix<f64, 3, 6> {
    along * along.transpose() * tangent.fixed_rows::<3>(3) + couple * per_couple
}

/// Direction in which the force turns about d3, if the end of the rod, and its m(1) in lengths, turn along.
fn own_turn(
    by_force: &Matrix3<f64>,
    force: &Vector3<f64>,
    couple: &Vector3<f64>,
) -> Option<Vector3<f64>> {
    let z = Vector3::z();
    let turn = z.cross(force);
    let size = turn.norm();
    let apart = by_force * turn - z.cross(couple);
    let is_round =
        size > STRAIGHT * force.norm() && apart.norm() <= NEUTRAL * by_force.norm() * size;
    is_round.then(|| turn / size)
}

impl Link {
    /// Matrices jacobian and drive of [`LinkEnd`], from the derivatives of the end and of m(1) by the chart.
    pub(super) fn along_chord(
        &self,
        tangent: &Matrix6<f64>,
        couple: &SMatrix<f64, 3, 6>,
        section: &RodSection,
        along: &Vector3<f64>,
    ) -> (Matrix6<f64>, Matrix6<f64>) {
        let units = self.units();
        let line = along * along.transpose();
        let mut jacobian = Matrix6::zeros();
        jacobian
            .fixed_view_mut::<3, 3>(0, 0)
            .fill_diagonal(units[0]);
        let per_couple = self.rod.length() / units[0];
        let below = chord_rows(tangent, couple, along, per_couple);
        jacobian.fixed_rows_mut::<3>(3).copy_from(&below);
        // Derivative by n alone.
        let by_force: Matrix3<f64> = below.fixed_columns::<3>(3).into_owned();
        if let Some(turn) = own_turn(&by_force, &section.force, &(section.couple * per_couple))
            && let Some(across) = turn.cross(along).try_normalize(f64::MIN_POSITIVE)
        {
            // Replaces the row of motion across the chord in the plane of the rod, which is zero.
            let held = turn.transpose() * by_force.norm() - across.transpose() * by_force;
            let mut block = jacobian.fixed_view_mut::<3, 3>(3, 3);
            block += across * held;
        }
        let mut drive = Matrix6::zeros();
        drive.fixed_view_mut::<3, 3>(3, 3).copy_from(&line);
        (jacobian, drive)
    }

    /// Number of neutral directions of the rod without a fold. Paths of equilibria cross there, as those of a column
    /// at Euler's load, and the chord varies along each of them. Neutral means singular values of the Jacobian below
    /// `within`, in rod lengths. None if the Jacobian is regular, at a fold, and for a rod that is not between two
    /// ball joints.
    pub fn crossing(&self, end: &LinkEnd, within: f64) -> Option<usize> {
        let along = end.chord()?;
        let svd = end.jacobian.fixed_view::<3, 3>(3, 3).svd(true, false);
        let (u, sizes) = (svd.u?, svd.singular_values / self.rod.length());
        let is_across = |k: &usize| sizes[*k] <= within && u.column(*k).dot(along).abs() <= ACROSS;
        let count = (0..3).filter(is_across).count();
        (count > 0).then_some(count)
    }

    /// Morse index of the rod with its ends in place: that with the base clamped, plus the negative eigenvalues of
    /// the stiffness of the base against rotation about its point (Haynsworth).
    pub(super) fn pinned_index(
        &self,
        q: &Wrench,
        held: &Isometry3<f64>,
        tolerance: f64,
    ) -> Result<usize> {
        let mut ball = self.clone();
        ball.joints = [Joint::Weld, Joint::Ball];
        let end = ball.end(q, tolerance)?;
        let factors = ball.regular(&end).ok_or_else(|| {
            Error::ill_conditioned(
                "a rod between two ball joints has no index where it is straight and cannot be stretched: give it an axial stiffness",
            )
        })?;
        // A rotation phi of the base moves the end, relative to the base, by r x phi; the couple on the base is
        // dm(0).
        let mut moved = SMatrix::<f64, 6, 3>::zeros();
        let r = end.pose.translation.vector.cross_matrix();
        moved.fixed_rows_mut::<3>(3).copy_from(&r);
        let change = factors
            .solve(&(ball.gap_scale(&end) * moved))
            .ok_or_else(|| Error::ill_conditioned("a rod exactly at a fold has no index"))?;
        let stiffness: Matrix3<f64> = -(end.resultants.fixed_rows::<3>(0) * change);
        let values = ((stiffness + stiffness.transpose()) * 0.5).symmetric_eigenvalues();
        let zero = ZERO * values.amax();
        let turning = values.iter().filter(|x| **x < -zero).count();
        Ok(ball.index(q, held, tolerance)? + turning)
    }

    /// Charts of further equilibria at the given distance of the ends: by deflation from the known ones, from the
    /// unloaded rod and from forces along the axes of the base and between them.
    pub(super) fn other_spans(
        &self,
        known: &[Wrench],
        held: &Isometry3<f64>,
        tolerance: f64,
    ) -> Vec<Wrench> {
        let known = known
            .iter()
            .map(|q| DVector::from_column_slice(&q.as_slice()[3..]));
        let known: Vec<DVector<f64>> = known.collect();
        let mut guesses = known.clone();
        guesses.push(DVector::zeros(3));
        for size in TYPICAL {
            for at in 0..27 {
                let n = [at / 9, at / 3 % 3, at % 3].map(|k| f64::from(k - 1));
                if let Some(along) = Vector3::from(n).try_normalize(0.5) {
                    guesses.push(DVector::from_column_slice((along * size).as_slice()));
                }
            }
        }
        let asked = deflation::Options {
            newton: newton::Options {
                tolerance,
                max_iterations: PATIENCE,
                ..newton::Options::default()
            },
            ..deflation::Options::default()
        };
        let spanned = ChordFamily {
            link: self,
            held,
            tolerance: 0.01 * tolerance,
        };
        let found = find_further(&spanned, 0.0, &known, &guesses, &asked);
        let found = found.map_or_else(|_| Vec::new(), |search| search.solutions);
        let charts = found.iter().map(|at| {
            join(
                &Vector3::zeros(),
                &Vector3::from_column_slice(at.x.as_slice()),
            )
        });
        charts.collect()
    }

    /// Chart of the rod with its end at distance |`held`| from the base, found from the unloaded rod; for starts. None
    /// without convergence.
    pub(super) fn spanning(&self, held: &Isometry3<f64>, tolerance: f64) -> Option<Wrench> {
        self.polished(&Vector6::zeros(), held, tolerance).ok()
    }
}

impl LinkPoint {
    /// Turns the base of a rod between two ball joints along its chord.
    pub(super) fn align(&mut self) {
        if let Some(chord) = self.end.chord() {
            self.base.pose.rotation = turned_to_chord(&self.base.pose, &self.tip.pose, chord);
        }
    }
}

/// Rotation of least angle from `base` that takes the chord of a rod, along the directors of its base, to that
/// between its attachments. The spin about the chord is free.
fn turned_to_chord(
    base: &Isometry3<f64>,
    tip: &Isometry3<f64>,
    chord: &Vector3<f64>,
) -> UnitQuaternion<f64> {
    let wanted = tip.translation.vector - base.translation.vector;
    let now = base.rotation * chord;
    let ahead = wanted.norm() + now.dot(&wanted);
    let turn = if ahead > OPPOSITE * wanted.norm() {
        // Accurate for small angles, unlike an arc cosine.
        UnitQuaternion::from_quaternion(Quaternion::from_parts(ahead, now.cross(&wanted)))
    } else {
        // Half a turn about any axis across.
        let across = now.cross(&now.zxy());
        UnitQuaternion::from_axis_angle(&Unit::new_normalize(across), std::f64::consts::PI)
    };
    turn * base.rotation
}
