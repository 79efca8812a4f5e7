//! Poses and velocities of rigid frames: bodies, and obstacles that may move.

use super::Obstacle;
use crate::body::Support;
use crate::math::se3::halves;
use nalgebra::{Isometry3, Matrix3, Vector3, Vector6};

/// Pose and velocity of a rigid frame in the world at one moment.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct RigidMotion {
    /// The pose.
    pub pose: Isometry3<f64>,
    /// The angular velocity.
    pub spin: Vector3<f64>,
    /// The velocity of the origin of the frame.
    pub velocity: Vector3<f64>,
}

impl RigidMotion {
    /// A frame with a pose and a twist (angular velocity, velocity of the origin).
    pub fn new(pose: Isometry3<f64>, twist: &Vector6<f64>) -> Self {
        let (spin, velocity) = halves(twist);
        Self {
            pose,
            spin,
            velocity,
        }
    }

    /// A frame at rest.
    pub fn at_rest(pose: Isometry3<f64>) -> Self {
        Self::new(pose, &Vector6::zeros())
    }

    /// The vector from the origin of the frame to a place in the world.
    pub fn lever(&self, x: &Vector3<f64>) -> Vector3<f64> {
        x - self.pose.translation.vector
    }

    /// The place in the world of a point fixed in the frame.
    pub fn place(&self, point: &Vector3<f64>) -> Vector3<f64> {
        self.pose.translation.vector + self.pose.rotation * point
    }

    /// The place of a point of the world as seen from the frame.
    pub fn seen(&self, x: &Vector3<f64>) -> Vector3<f64> {
        self.pose.rotation.inverse() * self.lever(x)
    }

    /// The velocity of the material point at the place `x`.
    pub fn velocity_at(&self, x: &Vector3<f64>) -> Vector3<f64> {
        self.velocity + self.spin.cross(&self.lever(x))
    }

    /// The rate of [`RigidMotion::velocity_at`] at a place that moves with the velocity `x_rate`, for a frame with
    /// this acceleration (angular acceleration, acceleration of the origin).
    pub fn velocity_rate_at(
        &self,
        acceleration: &Vector6<f64>,
        x: &Vector3<f64>,
        x_rate: &Vector3<f64>,
    ) -> Vector3<f64> {
        let (spin_rate, velocity_rate) = halves(acceleration);
        velocity_rate + spin_rate.cross(&self.lever(x)) + self.spin.cross(&(x_rate - self.velocity))
    }
}

/// An obstacle in a frame that stands or moves in a given way.
#[derive(Debug, Clone)]
pub struct MovingObstacle {
    obstacle: Obstacle,
    support: Option<Support<3>>,
}

impl From<Obstacle> for MovingObstacle {
    fn from(obstacle: Obstacle) -> Self {
        Self {
            obstacle,
            support: None,
        }
    }
}

impl MovingObstacle {
    /// An obstacle on a support, given in the frame of the support.
    pub fn carried(obstacle: Obstacle, support: Support<3>) -> Self {
        Self {
            obstacle,
            support: Some(support),
        }
    }

    /// The obstacle in its own frame.
    pub fn obstacle(&self) -> &Obstacle {
        &self.obstacle
    }

    /// Pose and velocity of the frame at time `t`, and its acceleration (angular acceleration, acceleration of the
    /// origin).
    pub fn motion(&self, t: f64) -> (RigidMotion, Vector6<f64>) {
        let Some(support) = &self.support else {
            return (
                RigidMotion::at_rest(Isometry3::identity()),
                Vector6::zeros(),
            );
        };
        let frame = support.at(t);
        let vector = |m: &Matrix3<f64>| Vector3::new(m.m32, m.m13, m.m21);
        let spin_rate = frame.centrifugal - frame.spin * frame.spin;
        let motion = RigidMotion {
            pose: frame.pose(),
            spin: frame.turn * vector(&frame.spin),
            velocity: frame.turn * frame.velocity,
        };
        let angular = frame.turn * vector(&spin_rate);
        let linear = frame.turn * frame.acceleration;
        (motion, crate::math::se3::join(&angular, &linear))
    }

    /// True if the obstacle moves.
    pub fn moves(&self) -> bool {
        self.support.as_ref().is_some_and(|s| !s.is_fixed())
    }

    /// The first time after `t` at which the motion is not smooth; infinite if none is left.
    pub fn next_break(&self, t: f64) -> f64 {
        let support = self.support.as_ref();
        support.map_or(f64::INFINITY, |support| support.next_break(t))
    }
}
