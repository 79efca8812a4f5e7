//! Interface of the body at the end of a massless rod.

use super::load_function::LoadSlopes;
use super::{BodyState, PointMass};
use nalgebra::{Isometry3, Matrix6, SMatrix, SVector, Vector2, Vector3};

/// A body at the rod's end, which shares its `D` velocities V.
///
/// Poses, velocities and wrenches are seen from the clamp, along its axes. These are the axes of the world if the
/// clamp stands at the origin and is not turned.
pub trait EndBody<const D: usize> {
    /// Pose of the rod's end.
    type Pose: EndPose;

    /// Motion of the body at time `t` under the wrench `rod` of the rod on the body: `rod` = -w1, with w1 the end
    /// wrench on the rod.
    ///
    /// `rod` has the power rod . v, in addition to that of a moving clamp.
    fn motion(
        &self,
        t: f64,
        pose: &Self::Pose,
        v: &SVector<f64, D>,
        rod: &SVector<f64, D>,
    ) -> EndMotion<D>;

    /// Derivatives of the acceleration: exact, those of functions by differences.
    fn linearised(
        &self,
        t: f64,
        pose: &Self::Pose,
        v: &SVector<f64, D>,
        rod: &SVector<f64, D>,
    ) -> EndLinear<D>;

    /// Kinetic energy.
    fn kinetic(&self, t: f64, pose: &Self::Pose, v: &SVector<f64, D>) -> f64;

    /// Potential of the constant forces: d(kinetic + potential)/dt = rod . v + power - loss.
    fn potential(&self, t: f64, pose: &Self::Pose) -> f64;

    /// The first time after `t` at which a load or the motion of the clamp is not smooth, or which a step must not
    /// skip; infinite if none is left.
    fn next_break(&self, t: f64) -> f64;
}

/// Motion of the body at the rod's end.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct EndMotion<const D: usize> {
    /// dV/dt.
    pub acceleration: SVector<f64, D>,
    /// Power of the loads without a potential, and of the clamp.
    pub power: f64,
    /// Power lost to drag, >= 0.
    pub loss: f64,
}

/// Derivatives of the acceleration of the body at the rod's end.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct EndLinear<const D: usize> {
    /// By a twist of the end: (dphi, dr) for D = 6, dr for D = 2, 3, at constant wrench and V.
    pub by_pose: SMatrix<f64, D, D>,
    /// By V.
    pub by_velocity: SMatrix<f64, D, D>,
    /// By the wrench of the rod: the inverse of the mass matrix, symmetric positive definite. A body that contacts hold
    /// has a singular one.
    pub by_wrench: SMatrix<f64, D, D>,
}

/// Poses of a rod's end, seen as poses in space.
pub trait EndPose {
    /// The pose in space. A pose in the plane does not turn.
    fn in_space(&self) -> Isometry3<f64>;
}

impl EndPose for Vector2<f64> {
    fn in_space(&self) -> Isometry3<f64> {
        Isometry3::translation(self.x, self.y, 0.0)
    }
}

impl EndPose for Isometry3<f64> {
    fn in_space(&self) -> Isometry3<f64> {
        *self
    }
}

/// A borrowed body.
impl<const D: usize, B: EndBody<D>> EndBody<D> for &B {
    type Pose = B::Pose;

    fn motion(
        &self,
        t: f64,
        pose: &Self::Pose,
        v: &SVector<f64, D>,
        rod: &SVector<f64, D>,
    ) -> EndMotion<D> {
        (**self).motion(t, pose, v, rod)
    }

    fn linearised(
        &self,
        t: f64,
        pose: &Self::Pose,
        v: &SVector<f64, D>,
        rod: &SVector<f64, D>,
    ) -> EndLinear<D> {
        (**self).linearised(t, pose, v, rod)
    }

    fn kinetic(&self, t: f64, pose: &Self::Pose, v: &SVector<f64, D>) -> f64 {
        (**self).kinetic(t, pose, v)
    }

    fn potential(&self, t: f64, pose: &Self::Pose) -> f64 {
        (**self).potential(t, pose)
    }

    fn next_break(&self, t: f64) -> f64 {
        (**self).next_break(t)
    }
}

/// Poses of a rod's end that is free to turn: a point mass feels the place alone.
pub trait FreeEnd<const D: usize> {
    /// Pose of the rod's end.
    type Pose: EndPose;

    /// Place of the rod's end.
    fn place(pose: &Self::Pose) -> &SVector<f64, D>;
}

/// The plane: the place is the pose.
impl FreeEnd<2> for PointMass<2> {
    type Pose = Vector2<f64>;

    fn place(pose: &Vector2<f64>) -> &Vector2<f64> {
        pose
    }
}

/// Space: the end is on a ball joint, m(1) = 0.
impl FreeEnd<3> for PointMass<3> {
    type Pose = Isometry3<f64>;

    fn place(pose: &Isometry3<f64>) -> &Vector3<f64> {
        &pose.translation.vector
    }
}

impl<const D: usize> EndBody<D> for PointMass<D>
where
    Self: FreeEnd<D>,
{
    type Pose = <Self as FreeEnd<D>>::Pose;

    fn motion(
        &self,
        t: f64,
        pose: &Self::Pose,
        v: &SVector<f64, D>,
        rod: &SVector<f64, D>,
    ) -> EndMotion<D> {
        self.action(t, Self::place(pose), v, rod)
    }

    fn linearised(
        &self,
        t: f64,
        pose: &Self::Pose,
        v: &SVector<f64, D>,
        _: &SVector<f64, D>,
    ) -> EndLinear<D> {
        let mut world = EndLinear {
            by_pose: SMatrix::zeros(),
            by_velocity: SMatrix::from_diagonal_element(-self.drag / self.mass),
            by_wrench: SMatrix::from_diagonal_element(1.0 / self.mass),
        };
        let frame = self.support.as_ref().map(|support| support.at(t));
        if self.has_functions() {
            let seen = Self::place(pose);
            let (place, v) = match &frame {
                None => (*seen, *v),
                Some(frame) => (frame.place(seen), frame.absolute_velocity(seen, v)),
            };
            let state = BodyState::of_point(t, place.as_slice(), v.as_slice());
            let slopes = LoadSlopes::of(&self.functions, &state);
            let force = |m: &Matrix6<f64>| SMatrix::from_fn(|i, j| m[(3 + i, 3 + j)] / self.mass);
            world.by_pose += force(&slopes.by_pose);
            world.by_velocity += force(&slopes.by_velocity);
        }
        frame.map_or(world, |frame| frame.linear(&world))
    }

    fn kinetic(&self, t: f64, pose: &Self::Pose, v: &SVector<f64, D>) -> f64 {
        self.kinetic(t, Self::place(pose), v)
    }

    fn potential(&self, t: f64, pose: &Self::Pose) -> f64 {
        self.potential(t, Self::place(pose))
    }

    fn next_break(&self, t: f64) -> f64 {
        self.next_break(t)
    }
}
