//! Moving frames: places, velocities and accelerations seen from one, and in the world.

use super::se3::joined;
use nalgebra::{
    Isometry3, Matrix2, Matrix3, Rotation3, SMatrix, SVector, Translation3, UnitQuaternion,
    Vector2, Vector3,
};

/// A moving frame at one moment, for quantities of `D` components: places x, velocities v and forces seen from it, along
/// its axes.
///
/// In the world they are c + T x, V = T (v + A x + d), T f, and accelerations are
/// ```text
/// T^T V' = v' + B x + C v + e,     A = T^T T',  d = T^T c',  e = T^T c'',  B = A' + A^2,  C = 2 A.
/// ```
/// For the 6 velocities (omega, r') of a pose the same holds with x = (0, r) and blocks made for it ([`Frame::of_poses`]).
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
    /// The frame of the world.
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

    /// The place in the world.
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

    /// The largest component of its angular velocity.
    pub fn spin_rate(&self) -> f64 {
        self.spin.amax()
    }

    /// True if it is at rest, and stays so.
    pub fn stands(&self) -> bool {
        let rates = self.velocity.iter().chain(&self.acceleration);
        let turning = self.spin.iter().chain(&self.centrifugal);
        rates.chain(turning).all(|x| *x == 0.0)
    }

    /// Velocity of the frame itself at a place, along its axes.
    pub fn carried(&self, x: &SVector<f64, D>) -> SVector<f64, D> {
        self.spin * x + self.velocity
    }

    /// The velocity in the world of what moves at `v` as seen from the frame.
    pub fn absolute(&self, x: &SVector<f64, D>, v: &SVector<f64, D>) -> SVector<f64, D> {
        self.turn * (v + self.carried(x))
    }

    /// The acceleration in the world of what stands at a place in the frame.
    pub fn drawn(&self, x: &SVector<f64, D>) -> SVector<f64, D> {
        self.turn * self.swept(x, &SVector::zeros())
    }

    /// The acceleration in the world, along the axes of the frame, of what moves steadily at `v` as seen from it.
    pub fn swept(&self, x: &SVector<f64, D>, v: &SVector<f64, D>) -> SVector<f64, D> {
        self.centrifugal * x + self.coriolis * v + self.acceleration
    }

    /// The velocity seen from the frame of what moves at `v` in the world.
    pub fn relative(&self, x: &SVector<f64, D>, v: &SVector<f64, D>) -> SVector<f64, D> {
        self.turn.tr_mul(v) - self.carried(x)
    }
}

impl Frame<2> {
    /// The rate at which the frame turns, and the rate of that.
    pub fn turning(&self) -> [f64; 2] {
        [self.spin.m21, self.centrifugal.m21]
    }

    /// The same in space, whose x and y are the plane's.
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
    /// A frame that stands.
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

    /// The frame's pose in the world.
    pub fn pose(&self) -> Isometry3<f64> {
        let turn = Rotation3::from_matrix_unchecked(self.turn);
        Isometry3::from_parts(
            Translation3::from(self.origin),
            UnitQuaternion::from_rotation_matrix(&turn),
        )
    }

    /// The frame for poses: rotations, then places.
    ///
    /// With Omega the spin vector, omega = T (omega_seen + Omega), and T^T omega' = omega_seen' + Omega x omega_seen + Omega'.
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
            origin: joined(&Vector3::zeros(), &self.origin),
            spin: blocks(&none, &self.spin),
            velocity: joined(&vector(&self.spin), &self.velocity),
            centrifugal: blocks(&none, &self.centrifugal),
            coriolis: blocks(&self.spin, &self.coriolis),
            acceleration: joined(&vector(&spin_rate), &self.acceleration),
        }
    }
}
