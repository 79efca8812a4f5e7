//! The mass of a light rod, as the body at its end feels it.

use super::ManifoldPoint;
use crate::math::frame::Frame;
use nalgebra::{SMatrix, SVector};
use std::fmt::Debug;

/// A rod of small mass that stays on its equilibria (theory 2.9): an error of second order in its mass, while it is away from folds.
///
/// Places, velocities and forces are seen from the clamp, along its axes; `frame` is the clamp, where it is not at rest at the origin along the
/// axes of the world.
pub trait RodMass<const N: usize>: Debug + Send + Sync {
    /// Mass of the whole rod.
    fn mass(&self) -> f64;

    /// Gravity, in the world.
    fn gravity(&self) -> SVector<f64, N>;

    /// What the end feels of the rod at the point q of the chart and the end's velocity v, `at` = [q, v]; None outside the chart and at folds. `point` is
    /// what the chart gives there; the mass may be off by `error`.
    fn added(
        &self,
        frame: Option<&Frame<N>>,
        at: [&SVector<f64, N>; 2],
        point: &ManifoldPoint<N>,
        error: f64,
    ) -> Option<Felt<N>>;

    /// The same of the deflection alone, where the rod holds its end along a line and bends across it ([`Held`](super::Held)), and the chart has collapsed;
    /// None beyond what is served, and in models without such a state.
    fn beside(&self, _frame: Option<&Frame<N>>, _at: &Deflected) -> Option<Across> {
        None
    }

    /// Kinetic energy of the rod in the world, and its potential, at the point and the velocity `at`; its mass may be off by `error`.
    fn energies(
        &self,
        frame: Option<&Frame<N>>,
        at: [&SVector<f64, N>; 2],
        error: f64,
    ) -> Option<[f64; 2]>;

    /// Positive where the rod's mass should be followed: no fold is so near that the rod cannot stay on its equilibria, and it is not
    /// so straight that its sections move far faster than its end. It falls to 0 steadily towards where that ends, from values of 1 and more where that is far away. `followed` tells whether it is followed now: the
    /// decision has hysteresis.
    fn room(&self, q: &SVector<f64, N>, v: &SVector<f64, N>, followed: bool) -> f64;
}

/// What the end feels of the mass of a rod.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Felt<const N: usize> {
    /// The mass that the rod adds to the body's.
    pub mass: SMatrix<f64, N, N>,
    /// The force that its weight and its motion put on the end.
    pub force: SVector<f64, N>,
    /// What the clamp does on the rod's inertia, beside what the end bears of it: `pull` times the acceleration of the end, and `power`.
    pub pull: SVector<f64, N>,
    /// See above.
    pub power: f64,
}

/// A rod that is all but straight.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Deflected {
    /// Its pull, and the rate of that.
    pub pull: f64,
    /// See above.
    pub tightening: f64,
    /// Deflection of its end, and the rate of that.
    pub height: f64,
    /// See above.
    pub speed: f64,
}

/// What the deflection of the end feels of the mass of a rod that is all but straight: its pull is that of the body alone (theory 2.9).
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Across {
    /// The mass that the rod adds to the body's.
    pub mass: f64,
    /// The force that its weight and its motion put on the end.
    pub force: f64,
    /// What the clamp does on the rod's inertia: `pull` times the acceleration of the deflection, and `power`.
    pub pull: f64,
    /// See above.
    pub power: f64,
    /// What of it bends the rod away from the beam under the pull.
    pub bending: Bending,
    /// Kinetic energy in the world, and potential.
    pub energies: [f64; 2],
}

/// The rod's inertia and weight as they bend it while its end is held: along w_N, the change of its shape with the pull.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Bending {
    /// m int w w_N ds, which counts by the acceleration of the deflection.
    pub by_rise: f64,
    /// m int w_N e ds, e the acceleration less gravity of the sections while that of the end is zero.
    pub rest: f64,
    /// m int w_N^2 ds.
    pub inertia: f64,
}
