//! The mass of a light rod, as the body at its end feels it.

use nalgebra::{SMatrix, SVector};
use std::fmt::Debug;

/// A rod of small mass that stays on its equilibria (theory 2.9): an error of second order in its mass, while it is away from folds.
pub trait RodMass<const N: usize>: Debug + Send + Sync {
    /// The mass that the rod adds to the body's, and the force that its weight and its motion put on the end, at the point `q` of the
    /// chart and the end's velocity `v`; None outside the chart and at folds. `force` is that of the rod on its end there; the mass may be off by
    /// `error`.
    fn added(
        &self,
        q: &SVector<f64, N>,
        v: &SVector<f64, N>,
        force: &SVector<f64, N>,
        error: f64,
    ) -> Option<(SMatrix<f64, N, N>, SVector<f64, N>)>;

    /// Kinetic energy of the rod, and its potential; its mass may be off by `error`.
    fn energies(&self, q: &SVector<f64, N>, v: &SVector<f64, N>, error: f64) -> Option<[f64; 2]>;

    /// Whether the rod's mass should be followed here: no fold is so near that the rod cannot stay on its equilibria, and it is not
    /// so taut that it vibrates faster than it bounces. `followed` tells whether it is now: the decision has hysteresis.
    fn holds(&self, q: &SVector<f64, N>, v: &SVector<f64, N>, followed: bool) -> bool;
}
