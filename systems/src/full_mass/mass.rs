//! Masses carried by a section of a rod: a piece of the rod itself, or the body at the end.

use super::frames::Triple;
use crate::body::{Body, EndBody, EndMotion, RigidBody};
use crate::math::se3::{halves, joined};
use nalgebra::{DMatrix, Isometry3, Matrix3, Matrix6, Vector3, Vector6};

/// A mass that moves with a section of a rod.
#[derive(Debug, Clone)]
#[allow(clippy::large_enum_variant)] // The masses of a rod are all of one variant.
pub enum Mass {
    /// A point: the section is free to turn.
    Point(Body<3>),
    /// A rigid body that turns with the section.
    Rigid(RigidBody),
}

/// Derivatives of the wrench that a mass requires.
#[derive(Debug, Clone)]
pub struct MassLinear {
    /// By the acceleration: the mass matrix, symmetric.
    pub by_acceleration: Matrix6<f64>,
    /// By a twist of the section.
    pub by_pose: Matrix6<f64>,
    /// By the velocity of the section.
    pub by_velocity: Matrix6<f64>,
}

fn lifted(m: &Matrix3<f64>) -> Matrix6<f64> {
    let mut all = Matrix6::zeros();
    all.fixed_view_mut::<3, 3>(3, 3).copy_from(m);
    all
}

/// Couples of wrenches (from component 0), or forces (from component 3).
pub(super) fn parts(wrenches: &[Vector6<f64>], first: usize) -> Vec<Vector3<f64>> {
    let each = wrenches.iter();
    each.map(|w| w.fixed_rows::<3>(first).into_owned())
        .collect()
}

impl Mass {
    /// The mass on a clamp fixed at the clamp's pose of time `t`.
    pub(super) fn standing_at(self, t: f64) -> Self {
        match self {
            Self::Point(body) => Self::Point(body.standing_at(t)),
            Self::Rigid(body) => Self::Rigid(body.standing_at(t)),
        }
    }

    /// The (couple, force) that the rod must exert for an acceleration of the section, in the frame of the clamp.
    pub fn wrench(
        &self,
        t: f64,
        pose: &Isometry3<f64>,
        v: &Vector6<f64>,
        acceleration: &Vector6<f64>,
    ) -> Option<Vector6<f64>> {
        match self {
            Self::Point(body) => {
                let (v, acceleration) = (halves(v).1, halves(acceleration).1);
                let free = body.action(t, &pose.translation.vector, &v, &Vector3::zeros());
                let force = (acceleration - free.acceleration) * body.mass();
                Some(joined(&Vector3::zeros(), &force))
            }
            Self::Rigid(body) => {
                let none = Vector6::zeros();
                let free = body.motion(t, pose, v, &none).acceleration;
                let give = body.linearised(t, pose, v, &none).by_wrench;
                Some(give.try_inverse()? * (acceleration - free))
            }
        }
    }

    /// Derivatives of [`Mass::wrench`] at a state with the value `wrench`.
    pub fn linear(
        &self,
        t: f64,
        pose: &Isometry3<f64>,
        v: &Vector6<f64>,
        wrench: &Vector6<f64>,
    ) -> Option<MassLinear> {
        Some(match self {
            Self::Point(body) => {
                let (v, force) = (halves(v).1, halves(wrench).1);
                let there = body.linearised(t, pose, &v, &force);
                MassLinear {
                    by_acceleration: lifted(&Matrix3::from_diagonal_element(body.mass())),
                    by_pose: lifted(&(there.by_pose * -body.mass())),
                    by_velocity: lifted(&(there.by_velocity * -body.mass())),
                }
            }
            Self::Rigid(body) => {
                let there = body.linearised(t, pose, v, wrench);
                let mass = there.by_wrench.try_inverse()?;
                let mass = (mass + mass.transpose()) * 0.5;
                MassLinear {
                    by_acceleration: mass,
                    by_pose: -mass * there.by_pose,
                    by_velocity: -mass * there.by_velocity,
                }
            }
        })
    }

    /// Power and loss under the wrench of the rod.
    pub fn motion(
        &self,
        t: f64,
        pose: &Isometry3<f64>,
        v: &Vector6<f64>,
        wrench: &Vector6<f64>,
    ) -> [f64; 2] {
        match self {
            Self::Point(body) => {
                let EndMotion { power, loss, .. } =
                    body.action(t, &pose.translation.vector, &halves(v).1, &halves(wrench).1);
                [power, loss]
            }
            Self::Rigid(body) => {
                let EndMotion { power, loss, .. } = body.motion(t, pose, v, wrench);
                [power, loss]
            }
        }
    }

    /// Kinetic energy.
    pub fn kinetic(&self, t: f64, pose: &Isometry3<f64>, v: &Vector6<f64>) -> f64 {
        match self {
            Self::Point(body) => body.kinetic(t, &pose.translation.vector, &halves(v).1),
            Self::Rigid(body) => EndBody::kinetic(body, t, pose, v),
        }
    }

    /// Potential of the constant loads.
    pub fn potential(&self, t: f64, pose: &Isometry3<f64>) -> f64 {
        match self {
            Self::Point(body) => body.potential(t, &pose.translation.vector),
            Self::Rigid(body) => EndBody::potential(body, t, pose),
        }
    }

    /// First time after `t` at which a load or the motion of the clamp is not smooth.
    pub fn next_break(&self, t: f64) -> f64 {
        match self {
            Self::Point(body) => body.next_break(t),
            Self::Rigid(body) => EndBody::next_break(body, t),
        }
    }

    /// The mass.
    pub fn mass(&self) -> f64 {
        match self {
            Self::Point(body) => body.mass(),
            Self::Rigid(body) => body.mass(),
        }
    }

    /// True if the mass turns with the section.
    pub fn turns(&self) -> bool {
        matches!(self, Self::Rigid(_))
    }
}

impl MassLinear {
    /// Adds J^T (matrix x) for row `i` of the sections to `out`, where `left` and `right` hold the twists
    /// (turn, move) of all of them.
    pub fn add(
        out: &mut DMatrix<f64>,
        i: usize,
        matrix: &Matrix6<f64>,
        left: [&Triple; 2],
        right: [&Triple; 2],
    ) {
        let row = |of: [&Triple; 2], k: usize| of[k / 3][k % 3].row(i).transpose();
        for k in 0..6 {
            if matrix.row(k).iter().all(|x| *x == 0.0) {
                continue;
            }
            let mut sum = row(right, 0) * matrix[(k, 0)];
            for l in 1..6 {
                if matrix[(k, l)] != 0.0 {
                    sum.axpy(matrix[(k, l)], &row(right, l), 1.0);
                }
            }
            out.ger(1.0, &row(left, k), &sum, 1.0);
        }
    }
}
