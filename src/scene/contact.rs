//! Rules of contact: friction, restitution, the law of impact, what is looked for.

use crate::contact::ImpactLaw;
use serde::{Serialize, Serializer};

/// `[contact]`: rules of contact for all obstacles without rules of their own.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Default)]
pub struct ContactRules {
    /// Coefficient of friction >= 0; default 0.
    pub friction: f64,
    /// Restitution of impacts, in [0, 1]; default 0.
    pub restitution: f64,
    /// Law of impact.
    #[serde(serialize_with = "key_of_law")]
    pub law: ImpactLaw,
    /// The rods that are looked for.
    pub rods: RodsInContact,
    /// Normal speed after an impact below which bounces are summed up; `None`: 1e-6 of the unit of speed of the rod.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub settle_speed: Option<f64>,
}

impl ContactRules {
    /// True for the rules of a scene without `[contact]`.
    pub fn are_default(&self) -> bool {
        *self == Self::default()
    }
}

fn key_of_law<S: Serializer>(law: &ImpactLaw, serializer: S) -> Result<S::Ok, S::Error> {
    law.key().serialize(serializer)
}

/// The rods that are looked for at obstacles.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Default)]
#[serde(rename_all = "lowercase")]
pub enum RodsInContact {
    /// All: where a rod touches an obstacle, the run ends.
    #[default]
    All,
    /// None: rods pass through obstacles, and bodies alone hit them.
    None,
}

/// The shape of a body where it touches others.
#[derive(Debug, Clone, Copy, PartialEq, Serialize)]
#[serde(rename_all = "lowercase")]
pub enum BodyShape {
    /// A point.
    Point,
    /// A ball of this diameter about the reference point.
    Ball(f64),
}
