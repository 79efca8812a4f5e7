//! Bodies as drawn in figures.

use crate::body::{Groove, RigidBody};
use crate::scene::{self, AssemblyBody};
use nalgebra::{Isometry3, Matrix3, Vector3};

/// A body in the scene's units: the homogeneous box of its mass and inertia about its centre of mass.
#[derive(Debug, Clone)]
pub struct Solid {
    /// Centre of mass in the frame of the body.
    pub offset: Vector3<f64>,
    /// Vectors from the centre to the middles of three faces, by columns, in the body frame; 0 for a point mass.
    pub half_edges: Matrix3<f64>,
    /// Groove in which the origin of the body frame slides.
    pub groove: Option<Groove>,
}

/// Largest number of points of a path for the search of the groove.
const POINTS: usize = 200;
/// Length of the drawn groove beyond the path, as a fraction of the extent of the path.
const BEYOND: f64 = 0.03;

impl Solid {
    pub(super) fn point() -> Self {
        Self {
            offset: Vector3::zeros(),
            half_edges: Matrix3::zeros(),
            groove: None,
        }
    }

    pub(super) fn new(mass: f64, inertia: &[[f64; 3]; 3], offset: &[f64; 3]) -> Self {
        let inertia = Matrix3::from_fn(|i, j| inertia[i][j]);
        let half_edges = RigidBody::new(mass, inertia).map(|body| body.equal_box());
        Self {
            offset: Vector3::from(*offset),
            half_edges: half_edges.unwrap_or_default(),
            groove: None,
        }
    }

    /// A body of an assembly.
    pub(super) fn of(body: &AssemblyBody) -> Self {
        let solid = match &body.extent {
            None => Self::point(),
            Some(extent) => Self::new(body.mass, &extent.inertia, &extent.offset),
        };
        solid.within(body.groove.as_ref())
    }

    /// Places the body in a groove of the scene, if any.
    pub(super) fn within(self, groove: Option<&scene::Groove>) -> Self {
        Self {
            // An invalid curve is refused when the motion is built.
            groove: groove.and_then(|groove| groove.curve().ok()),
            ..self
        }
    }

    /// Groove of a body along its path of `poses`, up to half of `length` beyond the path.
    pub fn groove_around<'a>(
        &self,
        poses: impl ExactSizeIterator<Item = &'a Isometry3<f64>>,
        length: f64,
    ) -> Vec<[f64; 3]> {
        self.groove_beside(poses, |_| 0.5 * length)
    }

    /// Groove along the path, and a little beyond it.
    pub fn groove_along<'a>(
        &self,
        poses: impl ExactSizeIterator<Item = &'a Isometry3<f64>>,
    ) -> Vec<[f64; 3]> {
        self.groove_beside(poses, |way| {
            let far = way.iter().map(|at| (at - way[0]).norm());
            BEYOND * far.fold(0.0, f64::max)
        })
    }

    fn groove_beside<'a>(
        &self,
        poses: impl ExactSizeIterator<Item = &'a Isometry3<f64>>,
        beyond: impl FnOnce(&[Vector3<f64>]) -> f64,
    ) -> Vec<[f64; 3]> {
        let Some(groove) = &self.groove else {
            return Vec::new();
        };
        let every = poses.len().div_ceil(POINTS).max(1);
        let way = poses.map(|pose| pose.translation.vector).step_by(every);
        let way: Vec<Vector3<f64>> = way.collect();
        let points = groove.points_along(&way, beyond(&way));
        points.into_iter().map(Into::into).collect()
    }

    /// Centre of mass for a pose of the body.
    pub fn centre(&self, pose: &Isometry3<f64>) -> Vector3<f64> {
        pose.translation.vector + pose.rotation * self.offset
    }
}
