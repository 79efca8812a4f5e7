//! Contacts of a rod with obstacles and rods, which exchange no impulse: the state of one, and events.

use nalgebra::Vector3;

/// Part of the largest friction by which the friction of sticking surfaces is smaller.
pub const SLIPPING: f64 = 1e-6;

/// The partner of a rod at a contact.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum RodPartner {
    /// The obstacle of this number.
    Obstacle(usize),
    /// A rod, or another stretch of the rod.
    Rod {
        /// The rod, by its number in an assembly.
        rod: usize,
        /// The arclength from the base of this rod.
        s: f64,
        /// The stretch that is pushed, as arclengths.
        stretch: [f64; 2],
    },
}

impl RodPartner {
    /// The arclength along the other rod; `None` at an obstacle.
    pub fn s(&self) -> Option<f64> {
        match self {
            Self::Obstacle(_) => None,
            Self::Rod { s, .. } => Some(*s),
        }
    }

    /// True for the obstacle or the rod of `other`, wherever along the rod.
    pub fn is(&self, other: &Self) -> bool {
        match (self, other) {
            (Self::Obstacle(a), Self::Obstacle(b)) => a == b,
            (Self::Rod { rod: a, .. }, Self::Rod { rod: b, .. }) => a == b,
            _ => false,
        }
    }
}

/// A place at which a rod touches an obstacle or a rod at a moment. Vectors are in the world.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct RodContactNow {
    /// The rod, by its number in an assembly.
    pub rod: usize,
    /// The obstacle or the rod that is touched.
    pub partner: RodPartner,
    /// The arclength from the base of the rod.
    pub s: f64,
    /// The place of the centreline.
    pub point: Vector3<f64>,
    /// Unit normal, from the partner to the rod.
    pub normal: Vector3<f64>,
    /// Reaction on the rod, along the normal.
    pub normal_force: f64,
    /// The stretch of the rod that is pushed, as arclengths: both are `s` for a point.
    pub stretch: [f64; 2],
    /// Friction on the rod.
    pub rubbing: Rubbing,
}

/// Friction at the contact of a rod. The default is that of smooth surfaces.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub struct Rubbing {
    /// Coefficient of friction.
    pub coefficient: f64,
    /// Friction on the rod, in the world.
    pub friction: Vector3<f64>,
    /// Velocity of the rod at the place, seen from another rod that moves; `None` where it is not known.
    pub slip: Option<Vector3<f64>>,
}

impl RodContactNow {
    /// True if the surfaces stick.
    pub fn sticks(&self) -> bool {
        let most = self.rubbing.coefficient * self.normal_force;
        self.rubbing.friction.norm() < most * (1.0 - SLIPPING)
    }
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
