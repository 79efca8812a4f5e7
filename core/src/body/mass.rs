//! A body with its loads, a point mass or a rigid body, under one set of operations.

use super::{EndBody, EndLinear, EndMotion, PointMass, RigidBody, Support};
use crate::math::se3::{halves, join};
use nalgebra::{DMatrix, Isometry3, Matrix3, Matrix6, UnitQuaternion, Vector3, Vector6};

/// A body with its loads. It moves with a section of a rod, at an end or between the ends.
///
/// Twists (angular velocity, velocity) and wrenches (couple, force) are of the reference point. Those of a point mass
/// have no rotational part.
#[derive(Debug, Clone)]
#[allow(clippy::large_enum_variant)] // The bodies of one list are mostly of one variant.
pub enum Mass {
    /// A point mass without directors: rods end in it on ball joints.
    Point(PointMass<3>),
    /// A rigid body that turns with the section; the reference point need not be the centre of mass.
    Rigid(RigidBody),
}

/// Derivatives of the wrench that a body requires ([`Mass::wrench`]).
#[derive(Debug, Clone)]
pub struct MassLinear {
    /// By the acceleration: the mass matrix, symmetric.
    pub by_acceleration: Matrix6<f64>,
    /// By a twist of the section.
    pub by_pose: Matrix6<f64>,
    /// By the velocity of the section.
    pub by_velocity: Matrix6<f64>,
}

/// A matrix on displacements as one on twists.
fn lifted(m: &Matrix3<f64>) -> Matrix6<f64> {
    let mut all = Matrix6::zeros();
    all.fixed_view_mut::<3, 3>(3, 3).copy_from(m);
    all
}

/// A force as a wrench, or an acceleration as that of a twist.
fn without_turn(force: &Vector3<f64>) -> Vector6<f64> {
    join(&Vector3::zeros(), force)
}

impl Mass {
    /// The body on a clamp fixed at the clamp's pose of time `t`.
    #[must_use]
    pub fn standing_at(self, t: f64) -> Self {
        match self {
            Self::Point(body) => Self::Point(body.standing_at(t)),
            Self::Rigid(body) => Self::Rigid(body.standing_at(t)),
        }
    }

    /// The clamp from which the body is seen, if it is not fixed at the origin along the axes of the world.
    pub fn support(&self) -> Option<&Support<3>> {
        match self {
            Self::Point(body) => body.support(),
            Self::Rigid(body) => body.support(),
        }
    }

    /// The mass.
    pub fn mass(&self) -> f64 {
        match self {
            Self::Point(body) => body.mass(),
            Self::Rigid(body) => body.mass(),
        }
    }

    /// True for a rigid body: the section turns the body.
    pub fn turns(&self) -> bool {
        matches!(self, Self::Rigid(_))
    }

    /// The rigid body; None for a point mass.
    pub fn as_rigid(&self) -> Option<&RigidBody> {
        match self {
            Self::Point(_) => None,
            Self::Rigid(body) => Some(body),
        }
    }

    /// True if a load without a potential, or a moving clamp, can do work.
    pub fn is_driven(&self) -> bool {
        match self {
            Self::Point(body) => body.is_driven(),
            Self::Rigid(body) => body.is_driven(),
        }
    }

    /// True if a load is a function of the motion.
    pub fn has_functions(&self) -> bool {
        match self {
            Self::Point(body) => body.has_functions(),
            Self::Rigid(body) => body.has_functions(),
        }
    }

    /// True if drag dissipates.
    pub fn is_damped(&self) -> bool {
        match self {
            Self::Point(body) => body.is_damped(),
            Self::Rigid(body) => body.is_damped(),
        }
    }

    /// True if the body has a rotor, whose couples are gyroscopic.
    pub fn has_rotor(&self) -> bool {
        self.as_rigid()
            .is_some_and(|body| *body.rotor() != Vector3::zeros())
    }

    /// True if a load at time `t` turns with the body.
    pub fn is_followed(&self, t: f64) -> bool {
        self.as_rigid().is_some_and(|body| body.is_followed(t))
    }

    /// True if the loads at time `t`, held as they are then, have a potential.
    pub fn is_conservative(&self, t: f64) -> bool {
        self.as_rigid().is_none_or(|body| body.is_conservative(t))
    }

    /// Wrench of the loads about the reference point, for a body at rest.
    pub fn load(&self, t: f64, pose: &Isometry3<f64>) -> Vector6<f64> {
        match self {
            Self::Point(body) => without_turn(&body.load(t)),
            Self::Rigid(body) => body.load(t, pose),
        }
    }

    /// Derivative of [`Mass::load`] (couple, and force) by a rotation of the body about its reference point.
    pub fn load_by_turn(&self, t: f64, pose: &Isometry3<f64>) -> [Matrix3<f64>; 2] {
        match self {
            Self::Point(_) => [Matrix3::zeros(); 2],
            Self::Rigid(body) => body.load_by_turn(t, pose),
        }
    }

    /// Motion under the wrench `rod` of the rods.
    pub fn motion(
        &self,
        t: f64,
        pose: &Isometry3<f64>,
        v: &Vector6<f64>,
        rod: &Vector6<f64>,
    ) -> EndMotion<6> {
        match self {
            Self::Point(body) => {
                let motion = body.action(t, &pose.translation.vector, &halves(v).1, &halves(rod).1);
                EndMotion {
                    acceleration: without_turn(&motion.acceleration),
                    power: motion.power,
                    loss: motion.loss,
                }
            }
            Self::Rigid(body) => body.motion(t, pose, v, rod),
        }
    }

    /// Derivatives of the acceleration. By the wrench, that of a point mass is singular: its rows of rotation are 0.
    pub fn linearised(
        &self,
        t: f64,
        pose: &Isometry3<f64>,
        v: &Vector6<f64>,
        rod: &Vector6<f64>,
    ) -> EndLinear<6> {
        match self {
            Self::Point(body) => {
                let linear = body.linearised(t, pose, &halves(v).1, &halves(rod).1);
                EndLinear {
                    by_pose: lifted(&linear.by_pose),
                    by_velocity: lifted(&linear.by_velocity),
                    by_wrench: lifted(&linear.by_wrench),
                }
            }
            Self::Rigid(body) => body.linearised(t, pose, v, rod),
        }
    }

    /// Derivatives of the acceleration at rest by pose, by velocity, and by the wrench of the rods, as twists and
    /// wrenches; for a point mass the last three components of these.
    pub fn linear_at_rest(
        &self,
        t: f64,
        pose: &Isometry3<f64>,
        rod: &Vector6<f64>,
    ) -> [DMatrix<f64>; 3] {
        match self {
            Self::Point(body) => {
                let linear = body.linearised(t, pose, &Vector3::zeros(), &halves(rod).1);
                [linear.by_pose, linear.by_velocity, linear.by_wrench]
                    .map(|m| DMatrix::from_column_slice(3, 3, m.as_slice()))
            }
            Self::Rigid(body) => {
                let linear = body.linearised(t, pose, &Vector6::zeros(), rod);
                [linear.by_pose, linear.by_velocity, linear.by_wrench]
                    .map(|m| DMatrix::from_column_slice(6, 6, m.as_slice()))
            }
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
                Some(without_turn(&force))
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

    /// Mass matrix about the reference point of a body with this rotation, in the world.
    pub fn matrix(&self, rotation: &UnitQuaternion<f64>) -> Matrix6<f64> {
        match self {
            Self::Point(body) => lifted(&(Matrix3::identity() * body.mass())),
            Self::Rigid(body) => {
                let mut matrix = lifted(&(Matrix3::identity() * body.mass()));
                let turn = rotation.to_rotation_matrix();
                let c = (turn * body.offset()).cross_matrix();
                let own = turn.matrix() * body.inertia() * turn.matrix().transpose();
                for (row, column, block) in [
                    (0, 0, own - c * c * body.mass()),
                    (0, 3, c * body.mass()),
                    (3, 0, -c * body.mass()),
                ] {
                    matrix.fixed_view_mut::<3, 3>(row, column).copy_from(&block);
                }
                matrix
            }
        }
    }

    /// Velocity of the reference point, and spin, per unit impulse at the reference point of a body with this
    /// rotation.
    pub fn by_impulse(&self, rotation: &UnitQuaternion<f64>) -> [Matrix3<f64>; 2] {
        let identity = Matrix3::identity();
        match self {
            Self::Point(body) => [identity / body.mass(), Matrix3::zeros()],
            Self::Rigid(body) => {
                let r = rotation.to_rotation_matrix();
                let c = (r * body.offset()).cross_matrix();
                let inverse = r.matrix() * body.inverse_inertia() * r.matrix().transpose();
                [identity / body.mass() - c * inverse * c, -inverse * c]
            }
        }
    }

    /// Inverse of [`Mass::matrix`]: the twist that an impulse (angular, linear) at the reference point gives. A point
    /// mass does not turn.
    pub fn inverse_matrix(&self, rotation: &UnitQuaternion<f64>) -> Matrix6<f64> {
        let Self::Rigid(body) = self else {
            return lifted(&(Matrix3::identity() / self.mass()));
        };
        let turn = rotation.to_rotation_matrix();
        let c = (turn * body.offset()).cross_matrix();
        let inverse = turn.matrix() * body.inverse_inertia() * turn.matrix().transpose();
        let mut matrix = lifted(&(Matrix3::identity() / body.mass() - c * inverse * c));
        for (row, column, block) in [(0, 0, inverse), (0, 3, -inverse * c), (3, 0, c * inverse)] {
            matrix.fixed_view_mut::<3, 3>(row, column).copy_from(&block);
        }
        matrix
    }

    /// Kinetic energy.
    pub fn kinetic(&self, t: f64, pose: &Isometry3<f64>, v: &Vector6<f64>) -> f64 {
        match self {
            Self::Point(body) => body.kinetic(t, &pose.translation.vector, &halves(v).1),
            Self::Rigid(body) => body.kinetic(t, pose, v),
        }
    }

    /// Potential of the constant forces.
    pub fn potential(&self, t: f64, pose: &Isometry3<f64>) -> f64 {
        match self {
            Self::Point(body) => body.potential(t, &pose.translation.vector),
            Self::Rigid(body) => body.potential(t, pose),
        }
    }

    /// First time after `t` at which a load or the motion of the clamp is not smooth; infinite if none is left.
    pub fn next_break(&self, t: f64) -> f64 {
        match self {
            Self::Point(body) => body.next_break(t),
            Self::Rigid(body) => body.next_break(t),
        }
    }
}
