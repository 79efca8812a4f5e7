//! What a rod that has no inertia asks of the body at its end.

use super::{Action, Body};
use nalgebra::{Isometry3, SMatrix, SVector, Vector2};

/// A body at the rod's end, whose `D` velocities V it shares.
pub trait EndBody<const D: usize> {
    /// Pose of the rod's end, in the world frame.
    type Pose;

    /// How the body moves at time `t` when the rod acts on it with `rod`, minus the end wrench w1 on the rod.
    ///
    /// `v` and `rod` are in the world frame; `rod` has power rod . v.
    fn motion(
        &self,
        t: f64,
        pose: &Self::Pose,
        v: &SVector<f64, D>,
        rod: &SVector<f64, D>,
    ) -> EndMotion<D>;

    /// Derivatives of the acceleration, exact.
    fn linearised(
        &self,
        t: f64,
        pose: &Self::Pose,
        v: &SVector<f64, D>,
        rod: &SVector<f64, D>,
    ) -> EndLinear<D>;

    /// Kinetic energy.
    fn kinetic(&self, pose: &Self::Pose, v: &SVector<f64, D>) -> f64;

    /// Potential of the constant forces: d(kinetic + potential)/dt = rod . v + power - loss.
    fn potential(&self, pose: &Self::Pose) -> f64;
}

/// Motion of the body at the rod's end.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct EndMotion<const D: usize> {
    /// dV/dt in the world frame.
    pub acceleration: SVector<f64, D>,
    /// Power of the loads that have no potential.
    pub power: f64,
    /// Power lost to drag, >= 0.
    pub loss: f64,
}

/// Derivatives of the acceleration of the body at the rod's end.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct EndLinear<const D: usize> {
    /// By a twist of the end in the world frame: (dphi, dr) for D = 6, dr for D = 2, 3. The wrench and V stay.
    pub by_pose: SMatrix<f64, D, D>,
    /// By V.
    pub by_velocity: SMatrix<f64, D, D>,
    /// By the wrench of the rod: the inverse of the mass matrix, symmetric positive definite.
    pub by_wrench: SMatrix<f64, D, D>,
}

impl<const D: usize> From<Action<D>> for EndMotion<D> {
    fn from(action: Action<D>) -> Self {
        Self {
            acceleration: action.acceleration,
            power: action.power,
            loss: action.loss,
        }
    }
}

impl<const D: usize> Body<D> {
    fn end_linear(&self) -> EndLinear<D> {
        EndLinear {
            by_pose: SMatrix::zeros(),
            by_velocity: SMatrix::from_diagonal_element(-self.drag / self.mass),
            by_wrench: SMatrix::from_diagonal_element(1.0 / self.mass),
        }
    }
}

/// A point mass on the end of a rod in the plane; the end is free to turn.
impl EndBody<2> for Body<2> {
    type Pose = Vector2<f64>;

    fn motion(
        &self,
        t: f64,
        _: &Vector2<f64>,
        v: &Vector2<f64>,
        rod: &Vector2<f64>,
    ) -> EndMotion<2> {
        self.action(t, v, rod).into()
    }

    fn linearised(
        &self,
        _: f64,
        _: &Vector2<f64>,
        _: &Vector2<f64>,
        _: &Vector2<f64>,
    ) -> EndLinear<2> {
        self.end_linear()
    }

    fn kinetic(&self, _: &Vector2<f64>, v: &Vector2<f64>) -> f64 {
        self.kinetic(v)
    }

    fn potential(&self, pose: &Vector2<f64>) -> f64 {
        self.potential(pose)
    }
}

/// A point mass on a ball joint at the end of a rod in space: m(1) = 0 and only the position of the end matters.
impl EndBody<3> for Body<3> {
    type Pose = Isometry3<f64>;

    fn motion(
        &self,
        t: f64,
        _: &Isometry3<f64>,
        v: &SVector<f64, 3>,
        rod: &SVector<f64, 3>,
    ) -> EndMotion<3> {
        self.action(t, v, rod).into()
    }

    fn linearised(
        &self,
        _: f64,
        _: &Isometry3<f64>,
        _: &SVector<f64, 3>,
        _: &SVector<f64, 3>,
    ) -> EndLinear<3> {
        self.end_linear()
    }

    fn kinetic(&self, _: &Isometry3<f64>, v: &SVector<f64, 3>) -> f64 {
        self.kinetic(v)
    }

    fn potential(&self, pose: &Isometry3<f64>) -> f64 {
        self.potential(&pose.translation.vector)
    }
}
