//! Rods between two ball joints: springs along their chords.
//!
//! Without couples at both ends the force is along the chord, r(1) x n = 0, and n, along the directors of the base, charts the rod
//! with its length: in the six numbers of the chart
//! ```text
//! dm(0) = 0,       (r^ r^T) dr(1) + (L/couple) dm(1) = r^ dl,
//! ```
//! r^ the direction of the chord, l its length; dm(1) is across r^ where m(0) = 0. The directors of the base follow the chord, but for a
//! spin about it, which nothing feels. A round straight rod that has buckled can spin in its own curve as well, n' = d3 x n: that
//! direction is held.

use super::{Joint, Link, LinkEnd};
use crate::error::{Error, Result};
use crate::rod::Wrench;
use nalgebra::{Isometry3, Matrix3, Matrix6, SMatrix, Vector3, Vector6};

/// What a neutral spin may change, relative to what other directions do.
const NEUTRAL: f64 = 1e-8;
/// Eigenvalues of the stiffness of a base above minus this part of the largest are not negative.
const ZERO: f64 = 1e-7;

impl LinkEnd {
    /// The direction of the chord.
    pub(super) fn along(&self) -> Vector3<f64> {
        self.chord.unwrap_or_else(Vector3::z)
    }
}

impl Link {
    /// The matrices jacobian and drive of [`LinkEnd`], from the derivatives of the end and of m(1) by the chart.
    pub(super) fn pins(
        &self,
        tangent: &Matrix6<f64>,
        couple: &SMatrix<f64, 3, 6>,
        force: &Vector3<f64>,
        along: &Vector3<f64>,
    ) -> (Matrix6<f64>, Matrix6<f64>) {
        let units = self.units();
        let (length, line) = (self.rod.length(), along * along.transpose());
        let mut jacobian = Matrix6::zeros();
        jacobian
            .fixed_view_mut::<3, 3>(0, 0)
            .fill_diagonal(units[0]);
        let below = line * tangent.fixed_rows::<3>(3) + couple * (length / units[0]);
        jacobian.fixed_rows_mut::<3>(3).copy_from(&below);
        // By n alone.
        let by_force: Matrix3<f64> = below.fixed_columns::<3>(3).into_owned();
        if let Some(spin) = Vector3::z()
            .cross(force)
            .try_normalize(1e-12 * force.norm())
            && (by_force * spin).norm() <= NEUTRAL * by_force.norm()
            && let Some(across) = spin.cross(along).try_normalize(f64::MIN_POSITIVE)
        {
            let held = across * spin.transpose() * by_force.norm();
            let mut block = jacobian.fixed_view_mut::<3, 3>(3, 3);
            block += held;
        }
        let mut drive = Matrix6::zeros();
        drive.fixed_view_mut::<3, 3>(3, 3).copy_from(&line);
        (jacobian, drive)
    }

    /// The index of the rod with its ends where they are: that with the base held too, and the negative eigenvalues of the stiffness of
    /// the base against turning about the point where it is (Haynsworth).
    pub(super) fn pinned_index(
        &self,
        q: &Wrench,
        held: &Isometry3<f64>,
        tolerance: f64,
    ) -> Result<usize> {
        let mut ball = self.clone();
        ball.joint = Joint::Ball;
        let end = ball.end(q, tolerance)?;
        let factors = ball.regular(&end).ok_or_else(|| {
            Error::ill_conditioned(
                "a rod between two ball joints has no index where it is straight and cannot be stretched: give it an axial stiffness",
            )
        })?;
        // The base turns by phi: seen from there the end moves by r x phi, and the couple on the base is dm(0).
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

    /// The chart of the rod near `q` with its ends so far apart, seen from the base; for starts.
    pub(super) fn spanning(&self, held: &Isometry3<f64>, tolerance: f64) -> Option<Wrench> {
        self.polished(&Vector6::zeros(), held, tolerance).ok()
    }
}
