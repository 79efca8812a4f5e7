//! First-order inertia of a light rod at its end: interface to the motion of the body.

use super::ManifoldPoint;
use crate::math::frame::Frame;
use nalgebra::{SMatrix, SVector};
use std::fmt::Debug;

/// Rod of small mass that stays on its equilibria (theory 2.9). Away from folds the error is of second order in its
/// mass.
///
/// Positions, velocities and forces are seen from the clamp, in its axes. `frame` is the clamp in the world; `None`
/// stands for a clamp at rest at the origin, along the axes of the world.
pub trait FirstOrderInertia<const N: usize>: Debug + Send + Sync {
    /// Mass of the whole rod.
    fn mass(&self) -> f64;

    /// Gravity, in the axes of the world.
    fn gravity(&self) -> SVector<f64, N>;

    /// Inertia felt at the end, `at` = [q, v] with q the chart point and v the velocity of the end; `None` outside
    /// the chart and at folds. `point`: the manifold at q. `error`: allowed error of the mass.
    fn end_inertia(
        &self,
        frame: Option<&Frame<N>>,
        at: [&SVector<f64, N>; 2],
        point: &ManifoldPoint<N>,
        error: f64,
    ) -> Option<EndInertia<N>>;

    /// Inertia felt by the deflection of a nearly straight rod, which holds its end along a line and bends across it
    /// ([`AxialConstraint`](super::AxialConstraint)); the chart has collapsed there. `None` outside the range of the
    /// model, and in models without such a state.
    fn deflection_inertia(
        &self,
        _frame: Option<&Frame<N>>,
        _at: &DeflectionState,
    ) -> Option<DeflectionInertia> {
        None
    }

    /// Kinetic energy of the rod in the world, and potential energy, at `at` = [q, v]; `error`: allowed error of the
    /// mass.
    fn energies(
        &self,
        frame: Option<&Frame<N>>,
        at: [&SVector<f64, N>; 2],
        error: f64,
    ) -> Option<[f64; 2]>;

    /// Distance from the limits of the first-order model: positive where the rod's mass should be followed. The
    /// limits are folds too near for the rod to stay on its equilibria, and shapes so straight that sections move far
    /// faster than the end. Values of 1 and more are far from both; towards a limit the value falls steadily to 0.
    /// `followed`: the mass is followed now; the decision has hysteresis.
    fn validity_margin(&self, q: &SVector<f64, N>, v: &SVector<f64, N>, followed: bool) -> f64;
}

/// First-order inertia of a rod, as felt at its end.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct EndInertia<const N: usize> {
    /// Mass added to that of the body.
    pub mass: SMatrix<f64, N, N>,
    /// Force of the rod's weight and motion on the end.
    pub force: SVector<f64, N>,
    /// Power of the clamp on the rod's inertia, besides that of the force at the end: `pull` .
    /// (acceleration of the end) + `power`.
    pub pull: SVector<f64, N>,
    /// Term of the clamp's power without acceleration.
    pub power: f64,
}

/// State of a nearly straight rod.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct DeflectionState {
    /// Pull.
    pub pull: f64,
    /// Rate of the pull.
    pub tightening: f64,
    /// Deflection of the end.
    pub height: f64,
    /// Rate of the deflection.
    pub speed: f64,
}

/// First-order inertia of a nearly straight rod, as felt by the deflection of its end. The pull is that of the body
/// alone (theory 2.9).
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct DeflectionInertia {
    /// Mass added to that of the body.
    pub mass: f64,
    /// Force of the rod's weight and motion on the deflection.
    pub force: f64,
    /// Power of the clamp on the rod's inertia: `pull` times the acceleration of the deflection, plus `power`.
    pub pull: f64,
    /// Term of the clamp's power without acceleration.
    pub power: f64,
    /// Part of inertia and weight that bends the rod away from the beam under the pull.
    pub bending: BendingLoad,
    /// Kinetic energy in the world, and potential.
    pub energies: [f64; 2],
}

/// Inertia and weight of the rod, projected on w_N, the change of the beam's shape with the pull: they bend the rod
/// while its end is held.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct BendingLoad {
    /// Coefficient m int w w_N ds of the acceleration of the deflection.
    pub by_rise: f64,
    /// Constant m int w_N e ds, with e the acceleration of the sections less gravity at zero acceleration of the end.
    pub rest: f64,
    /// Inertia m int w_N^2 ds.
    pub inertia: f64,
}
