//! States of a run in the world frame and the units of the scene.

use crate::elastica::Equilibrium;
use crate::error::Result;
use crate::motion::contact::ContactSample;
use crate::motion::{Labels, Ledger};
use nalgebra::{Isometry3, Point3, Vector3};

/// A state of a run, in the world frame and the scene's units.
#[derive(Debug, Clone, PartialEq)]
pub struct Moment {
    /// Time.
    pub t: f64,
    /// Frame of the clamp, to which the coordinates of a planar equilibrium refer.
    pub clamp: Isometry3<f64>,
    /// Bodies, in order; for one rod, its end.
    pub bodies: Vec<BodyMoment>,
    /// Energies.
    pub ledger: Ledger,
    /// Conserved total: [`Ledger::total`].
    pub total: f64,
    /// Energy dissipated by friction in the rod so far.
    pub friction: f64,
    /// Energy of unresolved waves that the method has taken out so far, part of the dissipated energy.
    pub numerical_loss: f64,
    /// Contacts with obstacles; `None` without obstacles.
    pub contact: Option<ContactSample>,
    /// Labels of the equilibrium of the elastica that a planar rod is in, or near; `None` without one.
    pub labels: Option<Labels>,
    /// Axis of a planar elastic rod that touches obstacles, which no labels tell: x and y in the frame of the clamp and
    /// in lengths of the rod. Empty for other rods.
    pub axis: Vec<[f64; 2]>,
    /// Morse index of the rod with its end held, in an assembly the sum over the rods; `None` off equilibrium.
    pub index: Option<usize>,
}

/// Pose, velocity and forces of a body, or of the end of one rod.
#[derive(Debug, Clone, PartialEq)]
pub struct BodyMoment {
    /// Pose of the body frame, or of the end of the rod.
    pub pose: Isometry3<f64>,
    /// Velocity of the origin of the frame.
    pub velocity: Vector3<f64>,
    /// Angular velocity.
    pub angular_velocity: Vector3<f64>,
    /// Wrench of the one rod on its body; `None` in an assembly.
    pub action: Option<EndAction>,
    /// Force of a groove on the body, if it slides in one.
    pub groove: Option<Vector3<f64>>,
}

/// Force and couple of a rod on the body at its end.
#[derive(Debug, Clone, Copy, Default, PartialEq)]
pub struct EndAction {
    /// Force.
    pub force: Vector3<f64>,
    /// Couple about the end of the rod.
    pub couple: Vector3<f64>,
}

/// A state as figures show it.
#[derive(Debug, Clone)]
pub struct FigureState {
    /// The state.
    pub moment: Moment,
    /// Moving strains at the places of the strain field; empty for an elastic rod.
    pub strains: Vec<Vec<f64>>,
    /// Dissipation per length and time, at the same places.
    pub dissipation: Vec<f64>,
    /// The axis of a planar rod with strains.
    pub axis: Vec<[f64; 2]>,
}

/// Sections of all rods at one time: poses from base to end.
#[derive(Debug, Clone)]
pub struct ShapesAt {
    /// Time.
    pub t: f64,
    /// The rods, in order, those with a free end last.
    pub rods: Vec<Vec<Isometry3<f64>>>,
}

impl Moment {
    /// The first body; for one rod, its end.
    pub fn end(&self) -> &BodyMoment {
        // Every run of one rod has a body.
        &self.bodies[0]
    }

    /// Position of the first body; for one rod, of its end. The origin in an assembly without bodies.
    pub fn position(&self) -> Vector3<f64> {
        let first = self.bodies.first();
        first.map_or(Vector3::zeros(), |body| body.pose.translation.vector)
    }

    /// Position of the end in the plane.
    pub fn place(&self) -> [f64; 2] {
        let r = self.position();
        [r.x, r.y]
    }

    /// World coordinates of a point (x, y) given along and across the clamp's tangent.
    pub fn placed(&self, [x, y]: [f64; 2]) -> [f64; 2] {
        let at = self.clamp * Point3::new(x, y, 0.0);
        [at.x, at.y]
    }

    /// The elastica in which a planar rod is, or to which it is near.
    ///
    /// # Errors
    /// A moment without labels.
    pub fn elastica(&self) -> Result<Equilibrium> {
        let named = self.labels.map(|labels| (labels.p, labels.w));
        let (p, w) = named.unwrap_or((f64::NAN, f64::NAN));
        Equilibrium::new(p, w)
    }
}

impl BodyMoment {
    /// Position, quaternion (w, x, y, z), velocity, angular velocity, then, if known, force and couple of the rod, and
    /// force of the groove.
    pub(super) fn numbers(&self) -> impl Iterator<Item = f64> {
        let (r, q) = (self.pose.translation.vector, self.pose.rotation);
        let moving = [self.velocity, self.angular_velocity].into_iter();
        let action = self.action.into_iter();
        let vectors = moving
            .chain(action.flat_map(|action| [action.force, action.couple]))
            .chain(self.groove);
        [r.x, r.y, r.z, q.w, q.i, q.j, q.k]
            .into_iter()
            .chain(vectors.flat_map(|v| [v.x, v.y, v.z]))
    }
}
