//! The bodies of an assembly: rigid ones, and point masses.

use crate::body::{Body, EndBody, EndMotion, RigidBody};
use crate::math::se3::{joined, spin, unit};
use nalgebra::{DMatrix, Isometry3, Matrix6, UnitQuaternion, Vector3, Vector6};

/// A body of an assembly.
#[derive(Debug, Clone)]
pub enum Carrier {
    /// A rigid body; the point by which its place is told need not be its centre of mass.
    Rigid(Box<RigidBody>),
    /// A point mass, which has no directors: rods end in it on ball joints.
    Point(Box<Body<3>>),
}

/// Where a body is and how it moves: pose, and (angular velocity, velocity of the reference point), in the world.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Place {
    /// Pose of the body's frame; a point mass does not turn.
    pub pose: Isometry3<f64>,
    /// (angular velocity, velocity).
    pub twist: Vector6<f64>,
}

impl Place {
    /// At rest.
    pub fn at_rest(pose: Isometry3<f64>) -> Self {
        Self {
            pose,
            twist: Vector6::zeros(),
        }
    }
}

impl Carrier {
    /// A rigid body.
    pub fn rigid(body: RigidBody) -> Self {
        Self::Rigid(Box::new(body))
    }

    /// A point mass.
    pub fn point(body: Body<3>) -> Self {
        Self::Point(Box::new(body))
    }

    /// How many velocities it has: 6, or 3.
    pub fn freedoms(&self) -> usize {
        match self {
            Self::Rigid(_) => 6,
            Self::Point(_) => 3,
        }
    }

    /// How many numbers hold its place and its velocity in a state: quaternion (w, x, y, z) and position, or position.
    pub fn numbers(&self) -> usize {
        2 * self.freedoms() + usize::from(matches!(self, Self::Rigid(_)))
    }

    /// The place that a part of a state holds.
    pub fn read(&self, state: &[f64]) -> Place {
        match (self, state) {
            (Self::Rigid(_), [w, x, y, z, r @ .., _, _, _, _, _, _]) => Place {
                pose: Isometry3::from_parts(
                    Vector3::from_column_slice(r).into(),
                    unit(&[*w, *x, *y, *z].into()),
                ),
                twist: Vector6::from_column_slice(&state[7..]),
            },
            _ => Place {
                pose: Isometry3::translation(state[0], state[1], state[2]),
                twist: joined(&Vector3::zeros(), &Vector3::from_column_slice(&state[3..6])),
            },
        }
    }

    /// Writes a place into a state.
    pub fn write(&self, place: &Place, state: &mut [f64]) {
        let r = &place.pose.translation.vector;
        match self {
            Self::Rigid(_) => {
                let p = place.pose.rotation.quaternion();
                state[..4].copy_from_slice(&[p.w, p.i, p.j, p.k]);
                state[4..7].copy_from_slice(r.as_slice());
                state[7..13].copy_from_slice(place.twist.as_slice());
            }
            Self::Point(_) => {
                state[..3].copy_from_slice(r.as_slice());
                state[3..6].copy_from_slice(&place.twist.as_slice()[3..]);
            }
        }
    }

    /// Writes the rates of its part `state` of a state into `out`, times `rate`.
    pub fn write_rates(&self, state: &[f64], motion: &EndMotion<6>, rate: f64, out: &mut [f64]) {
        match self {
            Self::Rigid(_) => {
                let p = nalgebra::Vector4::from_column_slice(&state[..4]);
                let omega = Vector3::from_column_slice(&state[7..10]);
                // p_t = p (body omega)/2, the body's being that of the world seen along its own axes.
                let turned = unit(&p).inverse() * omega;
                out[..4].copy_from_slice((spin(&p, &turned) * rate).as_slice());
                for i in 0..3 {
                    out[4 + i] = state[10 + i] * rate;
                }
                for i in 0..6 {
                    out[7 + i] = motion.acceleration[i] * rate;
                }
            }
            Self::Point(_) => {
                for i in 0..3 {
                    out[i] = state[3 + i] * rate;
                    out[3 + i] = motion.acceleration[3 + i] * rate;
                }
            }
        }
    }

    /// How it moves under the wrench of its rods, about its reference point in the world.
    pub fn motion(&self, t: f64, place: &Place, wrench: &Vector6<f64>) -> EndMotion<6> {
        match self {
            Self::Rigid(body) => body.motion(t, &place.pose, &place.twist, wrench),
            Self::Point(body) => {
                let half = |pair: &Vector6<f64>| pair.fixed_rows::<3>(3).into_owned();
                let motion =
                    EndBody::motion(&**body, t, &place.pose, &half(&place.twist), &half(wrench));
                EndMotion {
                    acceleration: joined(&Vector3::zeros(), &motion.acceleration),
                    power: motion.power,
                    loss: motion.loss,
                }
            }
        }
    }

    /// Derivatives of the acceleration at rest by pose and by velocity, and the inverse of the mass matrix, as matrices of the
    /// body's own size.
    pub fn linear(
        &self,
        t: f64,
        pose: &Isometry3<f64>,
        wrench: &Vector6<f64>,
    ) -> [DMatrix<f64>; 3] {
        match self {
            Self::Rigid(body) => {
                let linear = body.linearised(t, pose, &Vector6::zeros(), wrench);
                let copy = |m: &Matrix6<f64>| DMatrix::from_column_slice(6, 6, m.as_slice());
                [
                    copy(&linear.by_pose),
                    copy(&linear.by_velocity),
                    copy(&linear.by_wrench),
                ]
            }
            Self::Point(body) => {
                let n = wrench.fixed_rows::<3>(3).into_owned();
                let linear = body.linearised(t, pose, &Vector3::zeros(), &n);
                let copy =
                    |m: &nalgebra::Matrix3<f64>| DMatrix::from_column_slice(3, 3, m.as_slice());
                [
                    copy(&linear.by_pose),
                    copy(&linear.by_velocity),
                    copy(&linear.by_wrench),
                ]
            }
        }
    }

    /// The wrench of the loads about the reference point, at rest.
    pub fn load(&self, t: f64, pose: &Isometry3<f64>) -> Vector6<f64> {
        match self {
            Self::Rigid(body) => body.load(t, pose),
            Self::Point(body) => joined(&Vector3::zeros(), &body.load(t)),
        }
    }

    /// Force and centre of mass from the reference point in the world, of which [`Carrier::load`] is made at rest.
    pub(super) fn dead(&self, t: f64, pose: &Isometry3<f64>) -> (Vector3<f64>, Vector3<f64>) {
        match self {
            Self::Rigid(body) => (body.centre().load(t), pose.rotation * body.offset()),
            Self::Point(body) => (body.load(t), Vector3::zeros()),
        }
    }

    /// Kinetic energy.
    pub fn kinetic(&self, t: f64, place: &Place) -> f64 {
        match self {
            Self::Rigid(body) => EndBody::kinetic(&**body, t, &place.pose, &place.twist),
            Self::Point(body) => {
                let v = place.twist.fixed_rows::<3>(3).into_owned();
                body.kinetic(t, &place.pose.translation.vector, &v)
            }
        }
    }

    /// Potential of the constant forces.
    pub fn potential(&self, t: f64, pose: &Isometry3<f64>) -> f64 {
        match self {
            Self::Rigid(body) => EndBody::potential(&**body, t, pose),
            Self::Point(body) => body.potential(t, &pose.translation.vector),
        }
    }

    /// The first break of its loads after `t`.
    pub fn next_break(&self, t: f64) -> f64 {
        match self {
            Self::Rigid(body) => EndBody::next_break(&**body, t),
            Self::Point(body) => body.next_break(t),
        }
    }

    /// The pose moved by a small twist of the world: turned about the reference point, then shifted.
    pub fn moved(&self, pose: &Isometry3<f64>, twist: &[f64]) -> Isometry3<f64> {
        let mut moved = *pose;
        let shift = &twist[self.freedoms() - 3..];
        moved.translation.vector += Vector3::from_column_slice(shift);
        if let Self::Rigid(_) = self {
            let turn = UnitQuaternion::from_scaled_axis(Vector3::from_column_slice(&twist[..3]));
            moved.rotation = turn * moved.rotation;
            moved.rotation.renormalize();
        }
        moved
    }
}
