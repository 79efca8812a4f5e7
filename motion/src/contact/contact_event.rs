//! Events of contacts: impacts, accumulation of impacts, slip, stick, reversal, release.

use super::bodies::ContactId;
use nalgebra::Vector3;
use snaprod_systems::contact::ImpactLaw;

/// An event of one contact.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum ContactEvent {
    /// An impact.
    Impact(ImpactRecord),
    /// An infinite sequence of ever smaller impacts came to its end; the contact is closed.
    Accumulation(ContactChange),
    /// Surfaces that stuck begin to slip.
    Slip(ContactChange),
    /// Surfaces that slipped stick.
    Stick(ContactChange),
    /// The slip came to rest and goes on the other way.
    Reverse(ContactChange),
    /// The contact force came to zero, and the surfaces part.
    Release(ContactChange),
}

/// The rule that gave the impulse of an impact.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum RuleOfImpact {
    /// The law of the surfaces, at one contact alone.
    Law(ImpactLaw),
    /// Poisson's law for several contacts at once, whatever the law of the surfaces: compression of all contacts ends
    /// together, and each gives back its restitution times its impulse.
    Simultaneous,
}

impl RuleOfImpact {
    /// A stable key: stronge, poisson, newton, simultaneous.
    pub fn key(self) -> &'static str {
        match self {
            Self::Law(law) => law.key(),
            Self::Simultaneous => "simultaneous",
        }
    }
}

/// An impact at one contact. Vectors are in the world.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct ImpactRecord {
    /// The contact.
    pub contact: ContactId,
    /// The time.
    pub t: f64,
    /// The place.
    pub point: Vector3<f64>,
    /// Unit normal, from the partner to the body.
    pub normal: Vector3<f64>,
    /// Velocity of the body relative to the partner, at the place, before.
    pub before: Vector3<f64>,
    /// Relative velocity after.
    pub after: Vector3<f64>,
    /// Impulse on the body.
    pub impulse: Vector3<f64>,
    /// Kinetic energy lost.
    pub lost: f64,
    /// The rule that gave the impulse.
    pub rule: RuleOfImpact,
    /// True if the surfaces stick at the end of the impact.
    pub sticks: bool,
}

/// The state of a contact at an event other than an impact. Vectors are in the world.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct ContactChange {
    /// The contact.
    pub contact: ContactId,
    /// The time.
    pub t: f64,
    /// The place.
    pub point: Vector3<f64>,
    /// Velocity of the body relative to the partner, at the place.
    pub slip: Vector3<f64>,
    /// Normal force on the body, after the event.
    pub normal_force: f64,
    /// Friction on the body, after the event.
    pub friction: Vector3<f64>,
}

impl ContactEvent {
    /// A stable key: impact, accumulation, slip, stick, reverse, release.
    pub fn key(&self) -> &'static str {
        match self {
            Self::Impact(_) => "impact",
            Self::Accumulation(_) => "accumulation",
            Self::Slip(_) => "slip",
            Self::Stick(_) => "stick",
            Self::Reverse(_) => "reverse",
            Self::Release(_) => "release",
        }
    }

    /// The time.
    pub fn time(&self) -> f64 {
        match self {
            Self::Impact(record) => record.t,
            Self::Accumulation(change)
            | Self::Slip(change)
            | Self::Stick(change)
            | Self::Reverse(change)
            | Self::Release(change) => change.t,
        }
    }

    /// The contact.
    pub fn contact(&self) -> ContactId {
        match self {
            Self::Impact(record) => record.contact,
            Self::Accumulation(change)
            | Self::Slip(change)
            | Self::Stick(change)
            | Self::Reverse(change)
            | Self::Release(change) => change.contact,
        }
    }
}
