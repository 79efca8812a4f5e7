//! Bodies as figures show them.

use crate::body::RigidBody;
use nalgebra::{Isometry3, Matrix3, Vector3};

/// A body in the scene's units: the homogeneous box of its mass and inertia about its centre of mass.
#[derive(Debug, Clone, PartialEq)]
pub struct Solid {
    /// Centre of mass in the frame of the body.
    pub offset: Vector3<f64>,
    /// From the centre to the middles of three faces, by columns, in the same frame; 0 for a point mass.
    pub half_edges: Matrix3<f64>,
}

impl Solid {
    pub(super) fn point() -> Self {
        Self {
            offset: Vector3::zeros(),
            half_edges: Matrix3::zeros(),
        }
    }

    pub(super) fn new(mass: f64, inertia: &[[f64; 3]; 3], offset: &[f64; 3]) -> Self {
        let inertia = Matrix3::from_fn(|i, j| inertia[i][j]);
        let half_edges = RigidBody::new(mass, inertia).map(|body| body.equal_box());
        Self {
            offset: Vector3::from(*offset),
            half_edges: half_edges.unwrap_or_default(),
        }
    }

    /// The centre of mass where the body has this pose.
    pub fn centre(&self, pose: &Isometry3<f64>) -> Vector3<f64> {
        pose.translation.vector + pose.rotation * self.offset
    }
}
