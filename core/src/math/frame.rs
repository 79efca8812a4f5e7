//! Moving frames: positions, velocities and accelerations in the frame and in the world.

use super::se3::join;
use nalgebra::{
    Isometry3, Matrix2, Matrix3, Rotation3, SMatrix, SVector, Translation3, UnitQuaternion,
    Vector2, Vector3,
};

/// Moving frame at one moment, for quantities of `D` components. Positions x, velocities v and forces f are seen from
/// the frame, along its axes.
///
/// In the world they are c + T x, V = T (v + A x + d) and T f, and accelerations obey
/// ```text
/// T^T V' = v' + B x + C v + e,     A = T^T T',  d = T^T c',  e = T^T c'',  B = A' + A^2,  C = 2 A.
/// ```
/// The 6 velocities (omega, r') of a pose obey the same law with x = (0, r) and suitable blocks
/// ([`Frame::of_poses`]).
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Frame<const D: usize> {
    pub(crate) turn: SMatrix<f64, D, D>,
    pub(crate) origin: SVector<f64, D>,
    pub(crate) spin: SMatrix<f64, D, D>,
    pub(crate) velocity: SVector<f64, D>,
    pub(crate) centrifugal: SMatrix<f64, D, D>,
    pub(crate) coriolis: SMatrix<f64, D, D>,
    pub(crate) acceleration: SVector<f64, D>,
}

impl<const D: usize> Frame<D> {
    /// Frame of the world.
    pub fn at_rest() -> Self {
        Self {
            turn: SMatrix::identity(),
            origin: SVector::zeros(),
            spin: SMatrix::zeros(),
            velocity: SVector::zeros(),
            centrifugal: SMatrix::zeros(),
            coriolis: SMatrix::zeros(),
            acceleration: SVector::zeros(),
        }
    }

    /// Position in the world.
    pub fn place(&self, x: &SVector<f64, D>) -> SVector<f64, D> {
        self.origin + self.turn * x
    }

    /// Components of a vector along the axes of the world.
    pub fn outward(&self, f: &SVector<f64, D>) -> SVector<f64, D> {
        self.turn * f
    }

    /// Components of a vector along the axes of the frame.
    pub fn inward(&self, f: &SVector<f64, D>) -> SVector<f64, D> {
        self.turn.tr_mul(f)
    }

    /// Largest component of the frame's angular velocity.
    pub fn spin_rate(&self) -> f64 {
        self.spin.amax()
    }

    /// True if the frame is at rest and stays at rest: no velocity, spin or acceleration.
    pub fn stands(&self) -> bool {
        let rates = self.velocity.iter().chain(&self.acceleration);
        let turning = self.spin.iter().chain(&self.centrifugal);
        rates.chain(turning).all(|x| *x == 0.0)
    }

    /// Velocity of the frame itself at the position x, along its axes.
    pub fn velocity_of_fixed_point(&self, x: &SVector<f64, D>) -> SVector<f64, D> {
        self.spin * x + self.velocity
    }

    /// Velocity in the world of a point that moves at `v` as seen from the frame.
    pub fn absolute_velocity(&self, x: &SVector<f64, D>, v: &SVector<f64, D>) -> SVector<f64, D> {
        self.turn * (v + self.velocity_of_fixed_point(x))
    }

    /// Acceleration in the world of a point fixed in the frame.
    pub fn acceleration_of_fixed_point(&self, x: &SVector<f64, D>) -> SVector<f64, D> {
        self.turn * self.acceleration_at_constant_velocity(x, &SVector::zeros())
    }

    /// Acceleration in the world, along the axes of the frame, of a point that moves at constant `v` as seen from the
    /// frame.
    pub fn acceleration_at_constant_velocity(
        &self,
        x: &SVector<f64, D>,
        v: &SVector<f64, D>,
    ) -> SVector<f64, D> {
        self.centrifugal * x + self.coriolis * v + self.acceleration
    }

    /// Velocity seen from the frame of a point that moves at `v` in the world.
    pub fn relative(&self, x: &SVector<f64, D>, v: &SVector<f64, D>) -> SVector<f64, D> {
        self.turn.tr_mul(v) - self.velocity_of_fixed_point(x)
    }
}

impl Frame<2> {
    /// Turning rate of the frame, and angular acceleration.
    pub fn turning(&self) -> [f64; 2] {
        [self.spin.m21, self.centrifugal.m21]
    }

    /// Frame in space whose x-y plane is the plane of `self`.
    pub fn in_space(&self) -> Frame<3> {
        let matrix = |m: &Matrix2<f64>, normal: f64| {
            let mut lifted = Matrix3::zeros();
            lifted.fixed_view_mut::<2, 2>(0, 0).copy_from(m);
            lifted[(2, 2)] = normal;
            lifted
        };
        let vector = |v: &Vector2<f64>| Vector3::new(v.x, v.y, 0.0);
        Frame {
            turn: matrix(&self.turn, 1.0),
            origin: vector(&self.origin),
            spin: matrix(&self.spin, 0.0),
            velocity: vector(&self.velocity),
            centrifugal: matrix(&self.centrifugal, 0.0),
            coriolis: matrix(&self.coriolis, 0.0),
            acceleration: vector(&self.acceleration),
        }
    }
}

impl Frame<3> {
    /// Frame at rest.
    pub fn standing(pose: &Isometry3<f64>) -> Self {
        Self {
            turn: pose.rotation.to_rotation_matrix().into_inner(),
            origin: pose.translation.vector,
            spin: Matrix3::zeros(),
            velocity: Vector3::zeros(),
            centrifugal: Matrix3::zeros(),
            coriolis: Matrix3::zeros(),
            acceleration: Vector3::zeros(),
        }
    }

    /// Pose of the frame in the world.
    pub fn pose(&self) -> Isometry3<f64> {
        let turn = Rotation3::from_matrix_unchecked(self.turn);
        Isometry3::from_parts(
            Translation3::from(self.origin),
            UnitQuaternion::from_rotation_matrix(&turn),
        )
    }

    /// Frame for poses: rotations, then positions.
    ///
    /// With Omega the spin vector, omega = T (omega_seen + Omega), and T^T omega' = omega_seen' + Omega x
    /// omega_seen + Omega'.
    pub fn of_poses(&self) -> Frame<6> {
        let blocks = |rotation: &Matrix3<f64>, place: &Matrix3<f64>| {
            let mut m = SMatrix::<f64, 6, 6>::zeros();
            m.fixed_view_mut::<3, 3>(0, 0).copy_from(rotation);
            m.fixed_view_mut::<3, 3>(3, 3).copy_from(place);
            m
        };
        let vector = |m: &Matrix3<f64>| Vector3::new(m.m32, m.m13, m.m21);
        let none = Matrix3::zeros();
        let spin_rate = self.centrifugal - self.spin * self.spin;
        Frame {
            turn: blocks(&self.turn, &self.turn),
            origin: join(&Vector3::zeros(), &self.origin),
            spin: blocks(&none, &self.spin),
            velocity: join(&vector(&self.spin), &self.velocity),
            centrifugal: blocks(&none, &self.centrifugal),
            coriolis: blocks(&self.spin, &self.coriolis),
            acceleration: join(&vector(&spin_rate), &self.acceleration),
        }
    }
}
