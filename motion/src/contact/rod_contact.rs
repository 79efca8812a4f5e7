//! Contacts of a rod with obstacles, which exchange no impulse: the state of one, and events.

use nalgebra::Vector3;

/// A place at which a rod touches an obstacle at a moment. Vectors are in the world.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct RodContactNow {
    /// The rod, by its number in an assembly.
    pub rod: usize,
    /// The obstacle.
    pub obstacle: usize,
    /// The arclength from the base of the rod.
    pub s: f64,
    /// The place of the centreline.
    pub point: Vector3<f64>,
    /// Unit normal, from the obstacle to the rod.
    pub normal: Vector3<f64>,
    /// Reaction on the rod, along the normal.
    pub normal_force: f64,
}

/// The change of the contact of a rod with an obstacle.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum RodContactChange {
    /// The rod comes to touch the obstacle.
    Touch,
    /// The reaction came to zero, and the rod leaves the obstacle.
    Release,
}

/// An event of the contact of a rod with an obstacle.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct RodContactEvent {
    /// The time.
    pub t: f64,
    /// The change.
    pub change: RodContactChange,
    /// The contact at the time of the event. The contact force is zero, up to rounding.
    pub at: RodContactNow,
}

impl RodContactEvent {
    /// A stable key: touch, release.
    pub fn key(&self) -> &'static str {
        match self.change {
            RodContactChange::Touch => "touch",
            RodContactChange::Release => "release",
        }
    }
}
