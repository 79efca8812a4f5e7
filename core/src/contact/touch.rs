//! The state of one possible contact: gap, normal, place, and their rates.

use super::RigidMotion;
use nalgebra::{Matrix3, Matrix3x6, Vector3, Vector6};

/// Geometry of one possible contact of two rigid frames a and b at one moment.
///
/// With v_a, v_b the velocities of the material points at the place, u = v_a - v_b is the slip velocity, and
/// ```text
/// gap' = n . u,     gap'' = n' . u + n . u'.
/// ```
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Touch {
    /// Signed distance of the surfaces; negative if they overlap.
    pub gap: f64,
    /// Unit normal n from b to a.
    pub normal: Vector3<f64>,
    /// The place of the contact in the world.
    pub point: Vector3<f64>,
    /// Rate of the normal.
    pub normal_rate: Vector3<f64>,
    /// Velocity with which the place moves in the world; the place moves along both bodies where one rolls.
    pub point_rate: Vector3<f64>,
    /// The reason why no single point carries the contact, if there is one.
    pub spread: Option<Spread>,
}

/// The reason why no single point carries a contact.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Spread {
    /// A cylinder stands on its flat end.
    FlatEnd,
    /// Two axes are parallel: the contact is a line.
    ParallelAxes,
}

impl std::fmt::Display for Spread {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        f.write_str(match self {
            Self::FlatEnd => "a cylinder touches a plane with the whole rim of its flat end",
            Self::ParallelAxes => "two parallel axes touch along a line",
        })
    }
}

/// Two frames with their accelerations (angular acceleration, acceleration of the origin).
#[derive(Debug, Clone, Copy)]
pub struct Accelerated<'a> {
    /// The frame.
    pub motion: &'a RigidMotion,
    /// The acceleration of the frame.
    pub acceleration: &'a Vector6<f64>,
}

impl Touch {
    /// The slip velocity u in the world.
    pub fn slip(&self, a: &RigidMotion, b: &RigidMotion) -> Vector3<f64> {
        a.velocity_at(&self.point) - b.velocity_at(&self.point)
    }

    /// The rate u' of the slip velocity in the world.
    pub fn slip_rate(&self, a: Accelerated<'_>, b: Accelerated<'_>) -> Vector3<f64> {
        let rate = |of: Accelerated<'_>| {
            (of.motion).velocity_rate_at(of.acceleration, &self.point, &self.point_rate)
        };
        rate(a) - rate(b)
    }

    /// Axes of the contact as columns: the normal, and two tangents. The first tangent lies along `along`, as far as
    /// that is tangential.
    pub fn axes(&self, along: &Vector3<f64>) -> Matrix3<f64> {
        let n = self.normal;
        let tangential = along - n * n.dot(along);
        let first = if tangential.norm() > 1e-12 * along.norm() && tangential.norm() > 0.0 {
            tangential.normalize()
        } else {
            let mut other = Vector3::zeros();
            other[n.iamin()] = 1.0;
            (other - n * n.dot(&other)).normalize()
        };
        Matrix3::from_columns(&[n, first, n.cross(&first)])
    }

    /// The velocity of the material point of `body` at the place, per twist: rows along `axes`.
    pub fn rows(&self, body: &RigidMotion, axes: &Matrix3<f64>) -> Matrix3x6<f64> {
        let mut rows = Matrix3x6::zeros();
        let by_spin = -axes.tr_mul(&body.lever(&self.point).cross_matrix());
        rows.fixed_columns_mut::<3>(0).copy_from(&by_spin);
        rows.fixed_columns_mut::<3>(3).copy_from(&axes.transpose());
        rows
    }

    /// The contact seen with the roles of a and b changed.
    pub(super) fn turned_round(self) -> Self {
        Self {
            normal: -self.normal,
            normal_rate: -self.normal_rate,
            ..self
        }
    }
}
