//! Several rods and bodies: `[[rod]]` and `[[body]]`.

use super::ends::is_none;
use super::{ClampMotion, Groove, Load, LoadAlong, Loads, Orientation, Rod};
use crate::assembly::Joint;
use serde::{Serialize, Serializer};

/// Rods between bodies and the ground, in space. Rods and bodies are known by their names, each list has names of its own.
#[derive(Debug, Clone, PartialEq)]
pub struct AssemblyScene {
    /// The rods that are held at both ends; at least one.
    pub rods: Vec<AssemblyRod>,
    /// Those with a free end; a scene has them after the others.
    pub free: Vec<FreeRod>,
    /// The bodies; at least one. Every one is joined to the ground by a chain of rods, or none is.
    pub bodies: Vec<AssemblyBody>,
}

impl Serialize for AssemblyScene {
    /// As `[[rod]]` and `[[body]]`.
    fn serialize<S: Serializer>(&self, serializer: S) -> Result<S::Ok, S::Error> {
        #[derive(Serialize)]
        #[serde(untagged)]
        enum Any<'a> {
            Held(&'a AssemblyRod),
            Free {
                #[serde(flatten)]
                rod: &'a FreeRod,
                to: &'static str,
            },
        }
        #[derive(Serialize)]
        struct Tables<'a> {
            rod: Vec<Any<'a>>,
            body: &'a [AssemblyBody],
        }
        let free = self.free.iter().map(|rod| Any::Free { rod, to: "free" });
        let tables = Tables {
            rod: self.rods.iter().map(Any::Held).chain(free).collect(),
            body: &self.bodies,
        };
        tables.serialize(serializer)
    }
}

/// An elastic rod and what holds its ends.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct AssemblyRod {
    /// Its name.
    pub name: String,
    /// Its length, section and rest strains; without friction.
    #[serde(flatten)]
    pub rod: Rod,
    /// Dead force per length along it, beside its weight.
    #[serde(skip_serializing_if = "LoadAlong::is_zero")]
    pub distributed: LoadAlong,
    /// What holds its base, s = 0.
    pub from: Site,
    /// What holds its end, s = length.
    pub to: Site,
}

/// A rod with a free end: it bears nothing, keeps its shape without load and rides on its base.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct FreeRod {
    /// Its name.
    pub name: String,
    /// Its length, section and rest strains; without friction and contact diameter.
    #[serde(flatten)]
    pub rod: Rod,
    /// What holds its base, s = 0, by a weld.
    pub from: Site,
}

/// Where a rod is attached, and how.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct Site {
    /// The name of the body that holds the rod; `None`: the ground.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub body: Option<String>,
    /// Place in the frame of the body, or in the world.
    pub position: [f64; 3],
    /// Directors in the same frame.
    #[serde(flatten)]
    pub orientation: Orientation,
    /// Whether the rod's directors turn with these; on a point mass [`Joint::Ball`].
    pub joint: Joint,
    /// On the ground: how the place moves; `None`: it stands.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub motion: Option<ClampMotion>,
}

/// A body of an assembly.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct AssemblyBody {
    /// Its name.
    pub name: String,
    /// Mass > 0.
    pub mass: f64,
    /// Inertia and centre of mass; `None`: a point mass.
    #[serde(flatten)]
    pub extent: Option<Extent>,
    /// Force at the centre of mass; default 0.
    pub force: Load,
    /// Couple; default 0, and 0 for a point mass, which has no such field.
    #[serde(skip_serializing_if = "Load::is_none")]
    pub couple: Load,
    /// Drag coefficient >= 0 of the centre of mass; default 0.
    #[serde(skip_serializing_if = "is_zero")]
    pub drag: f64,
    /// Rotational drag >= 0; default 0, and 0 for a point mass.
    #[serde(skip_serializing_if = "is_zero")]
    pub rotational_drag: f64,
    /// Near where the equilibrium is looked for; of all bodies or of none.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub guess: Option<Guess>,
    /// The groove that the origin of its frame slides in; `None`: it is free.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub groove: Option<Groove>,
    /// Velocity of the origin of its frame at the start of a motion, in the world; default 0.
    #[serde(skip_serializing_if = "is_none")]
    pub velocity: [f64; 3],
    /// Angular velocity at the start of a motion, in the world; default 0, and 0 for a point mass.
    #[serde(skip_serializing_if = "is_none")]
    pub angular_velocity: [f64; 3],
}

/// A scene at rest has no field that only a motion asks.
fn is_zero(x: &f64) -> bool {
    *x == 0.0
}

/// What makes a rigid body of a point mass. Components are along the axes of the body's frame.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct Extent {
    /// Inertia about the centre of mass: symmetric positive definite, each principal moment at most the sum of the others.
    pub inertia: [[f64; 3]; 3],
    /// Centre of mass from the origin of the frame; default 0.
    pub offset: [f64; 3],
    /// Angular momentum relative to the body of a symmetric rotor inside; default 0.
    #[serde(skip_serializing_if = "is_none")]
    pub rotor: [f64; 3],
}

/// The pose of a body near an equilibrium.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct Guess {
    /// Position of the origin of its frame.
    pub position: [f64; 3],
    /// Orientation of its frame; of no meaning for a point mass.
    #[serde(flatten)]
    pub orientation: Orientation,
}

impl AssemblyBody {
    /// All that acts on it beside its rods.
    pub fn loads(&self, gravity: [f64; 3]) -> Loads {
        Loads {
            gravity,
            dead: self.force.constant(),
            distributed: LoadAlong::default(),
            load: 1.0,
            couple: self.couple.clone(),
            drag: self.drag,
            rotational_drag: self.rotational_drag,
            force: self.force.in_time().to_vec(),
        }
    }
}

impl AssemblyScene {
    /// The mass of the first body, by which masses are measured.
    pub fn mass(&self) -> f64 {
        self.bodies.first().map_or(f64::NAN, |body| body.mass)
    }

    /// True if nothing holds the bodies: every rod that carries has its ends on two of them, and none slides in a groove.
    pub fn floats(&self) -> bool {
        let on_bodies = |rod: &AssemblyRod| rod.from.body.is_some() && rod.to.body.is_some();
        self.rods.iter().all(on_bodies) && self.bodies.iter().all(|body| body.groove.is_none())
    }

    /// How the base and the end of every rod are joined to the ground, those with a free end last; None at a body, and at a free end.
    pub fn grounds(&self) -> Vec<[Option<Joint>; 2]> {
        let joint = |site: &Site| site.body.is_none().then_some(site.joint);
        let held = self.rods.iter();
        let held = held.map(|rod| [joint(&rod.from), joint(&rod.to)]);
        let free = self.free.iter().map(|rod| [joint(&rod.from), None]);
        held.chain(free).collect()
    }

    /// The number of the body that holds this end of a rod; None on the ground.
    pub fn holder(&self, site: &Site) -> Option<usize> {
        let name = site.body.as_ref()?;
        self.bodies.iter().position(|body| body.name == *name)
    }
}
