//! Spin about the chord of rods with mass between two ball joints (theory 3.9).
//!
//! The joints leave the rotation of such a rod about its chord free; without mass the rotation has no effect. With
//! mass it is a coordinate: the directors Q of the base and the rate omega = Omega . c about the chord c are in the
//! state. No couple acts along c. By d'Alembert's principle, with s = (0, c x b, c) the spin about the chord in
//! (V, b', Omega),
//! ```text
//! s . (N a + h) = 0,          a = by x + s omega_t + (terms of the present motion)
//! ```
//! Here x are the accelerations of the attachments. The spin is eliminated: the inertia on base and end is
//! N - (N s)(N s)^T/(s . N s) in place of N, and omega_t follows. A straight rod whose sections have no rotary
//! inertia has no inertia against its spin; the spin then stays constant.

use super::configuration::Spin;
use super::rod_element::{LinkEnd, LinkPoint};
use crate::math::se3::halves;
use crate::rod::{RodRates, Wrench};
use nalgebra::{Matrix3, SMatrix, SVector, Vector3};

/// Inertia against a spin, over m L^2, below which the rod counts as straight and has none: a rod bent by less than a
/// millionth.
const STRAIGHT: f64 = 1e-12;

/// Free motion of a rod between its attachments: the spin about the chord.
pub(super) struct Free {
    /// s in (V, b', Omega).
    pub along: SVector<f64, 12>,
    /// N s, and s . N s.
    pub momentum: SVector<f64, 12>,
    pub inertia: f64,
}

impl Free {
    /// Inertia N with the free motion eliminated: N - (N s)(N s)^T/(s . N s).
    pub fn eliminated(&self, matrix: &SMatrix<f64, 12, 12>) -> SMatrix<f64, 12, 12> {
        matrix - self.momentum * self.momentum.transpose() / self.inertia
    }

    /// Change of the spin rate after which the angular momentum about the chord vanishes, for the motion `now` in
    /// (V, b', Omega).
    pub fn idle(&self, now: &SVector<f64, 12>) -> f64 {
        -self.momentum.dot(now) / self.inertia
    }
}

impl LinkEnd {
    /// Angular velocity across the chord per relative velocity of the ends.
    fn across_chord(&self) -> Matrix3<f64> {
        let r = self.pose.translation.vector;
        r.cross_matrix() / r.norm_squared()
    }
}

impl LinkPoint {
    /// The rod with the base directors and rate of `spin`, aligned with the chord.
    pub(super) fn spinning(mut self, spin: &Spin) -> Self {
        self.base.pose.rotation = spin.turn;
        self.align();
        self.spin = spin.rate;
        self
    }

    /// Omega along the directors of the base. Rod between two ball joints: from the relative velocity of its ends and
    /// the rates of its chart, without a spin about the chord. Any other rod: the spin of its base.
    fn base_turn<const C: usize>(
        &self,
        spin: &SMatrix<f64, 3, C>,
        parting: &SMatrix<f64, 3, C>,
        rates: &SMatrix<f64, 6, C>,
    ) -> SMatrix<f64, 3, C> {
        match self.end.chord() {
            None => *spin,
            Some(_) => {
                let own = self.end.tangent.fixed_rows::<3>(3) * rates;
                self.end.across_chord() * (parting - own)
            }
        }
    }

    /// (V, b', Omega) along the directors of the base, from twists (base, end) of the attachments in the world and
    /// rates of the chart q. Without a spin about the chord of a rod between two ball joints.
    pub(super) fn base_motion<const C: usize>(
        &self,
        q: &Wrench,
        twists: &SMatrix<f64, 12, C>,
        rates: &SMatrix<f64, 6, C>,
    ) -> SMatrix<f64, 12, C> {
        let turn = self.base.pose.rotation.to_rotation_matrix();
        let seen = |row: usize| turn.matrix().tr_mul(&twists.fixed_rows::<3>(row));
        let velocity = seen(3);
        let spin = self.base_turn(&seen(0), &(seen(9) - velocity), rates);
        let mut moved = SMatrix::<f64, 12, C>::zeros();
        moved.fixed_rows_mut::<3>(0).copy_from(&velocity);
        let mut rest = moved.fixed_rows_mut::<9>(3);
        rest.copy_from(&in_world(q, rates, &spin));
        moved
    }

    /// b'' and Omega_t, in the rows of (V, b', Omega), of a rod in `motion`. `rates` are the second derivatives of
    /// the chart, and `second` is an additional acceleration of the end.
    pub(super) fn bent(
        &self,
        q: &Wrench,
        mut rates: Wrench,
        motion: &RodRates,
        second: &Vector3<f64>,
    ) -> SVector<f64, 12> {
        if let Some(turn) = self.end.own_turn() {
            // The chart holds the direction `turn`, and b'' = q'' + Omega_t x b + 2 Omega x b' -
            // Omega x (Omega x b).
            let (n, rate) = (halves(q).1, halves(&motion.rate).1);
            let turned = motion.spin.cross(&(rate * 2.0 - motion.spin.cross(&n)));
            let mut force = rates.fixed_rows_mut::<3>(3);
            force += turn * turn.dot(&turned);
        }
        let turned = self.base_turn(&Vector3::zeros(), &-second, &rates);
        let mut bent = SVector::<f64, 12>::zeros();
        bent.fixed_rows_mut::<9>(3)
            .copy_from(&in_world(q, &rates, &turned));
        bent
    }

    /// Spin about the chord in (V, b', Omega); None unless both ends are on ball joints.
    pub(super) fn free_spin(&self, q: &Wrench) -> Option<SVector<f64, 12>> {
        let mut along = SVector::<f64, 12>::zeros();
        let turned = in_world(q, &Wrench::zeros(), self.end.chord()?);
        along.fixed_rows_mut::<9>(3).copy_from(&turned);
        Some(along)
    }

    /// Free spin of a rod of this mass and length with generalized inertia `matrix`; None if its attachments hold the
    /// rod or the spin has no inertia.
    pub(super) fn freedom(
        &self,
        q: &Wrench,
        matrix: &SMatrix<f64, 12, 12>,
        mass: f64,
        length: f64,
    ) -> Option<Free> {
        let along = self.free_spin(q)?;
        let momentum = matrix * along;
        let inertia = along.dot(&momentum);
        (inertia > STRAIGHT * mass * length * length).then_some(Free {
            along,
            momentum,
            inertia,
        })
    }

    /// Rate of the spin due to the turning of the chord: Omega . c'.
    pub(super) fn chord_turns(&self, spin: &Vector3<f64>) -> f64 {
        let Some(along) = self.end.chord() else {
            return 0.0;
        };
        let back = self.base.pose.rotation.inverse();
        let parting = back * (halves(&self.tip.twist).1 - halves(&self.base.twist).1);
        let across = parting - along * along.dot(&parting);
        spin.dot(&across) / self.end.pose.translation.vector.norm()
    }

    /// Omega in the world times `pace`, with chart rates `rates` already times `pace`.
    pub(super) fn turning(&self, rates: &Wrench, pace: f64) -> Vector3<f64> {
        let turn = self.base.pose.rotation;
        let parting = halves(&self.tip.twist).1 - halves(&self.base.twist).1;
        let parting = turn.inverse() * parting * pace;
        let across = self.base_turn(&Vector3::zeros(), &parting, rates);
        let along = self.end.chord().map_or_else(Vector3::z, |chord| *chord) * (self.spin * pace);
        turn * (across + along)
    }
}

/// (b', Omega) from the rates of a chart q on a rotating base, whose wrench turns along.
fn in_world<const C: usize>(
    q: &Wrench,
    rates: &SMatrix<f64, 6, C>,
    spin: &SMatrix<f64, 3, C>,
) -> SMatrix<f64, 9, C> {
    let (m, n) = halves(q);
    let mut all = SMatrix::<f64, 9, C>::zeros();
    for (row, half) in [(0, m), (3, n)] {
        let moved = rates.fixed_rows::<3>(row) - half.cross_matrix() * spin;
        all.fixed_rows_mut::<3>(row).copy_from(&moved);
    }
    all.fixed_rows_mut::<3>(6).copy_from(spin);
    all
}
