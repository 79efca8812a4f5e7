//! Assemblies of several rods and bodies: `[[rod]]` and `[[body]]`.

use super::ends::is_none;
use super::{BodyShape, ClampMotion, Groove, Load, LoadAlong, Loads, Orientation, Rod, SiteJoint};
use crate::assembly::Joint;
use crate::body::LoadFunction;
use serde::{Serialize, Serializer};

/// Rods between bodies and the ground, in space. Names identify rods and bodies; the two lists have separate names.
#[derive(Debug, Clone, PartialEq)]
pub struct AssemblyScene {
    /// Normal of the plane in which bodies and rods stay; `None`: in space.
    pub plane: Option<[f64; 3]>,
    /// Rods held at both ends; at least one, unless no rod holds any of the bodies.
    pub rods: Vec<AssemblyRod>,
    /// Rods with a free end; a written scene lists them after `rods`.
    pub free: Vec<FreeRod>,
    /// The bodies; at least one in a motion. Either every body is joined to the ground by a chain of rods, or none is.
    pub bodies: Vec<AssemblyBody>,
}

impl Serialize for AssemblyScene {
    /// Serialised as `[[rod]]` and `[[body]]`.
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
        struct AssemblyTables<'a> {
            #[serde(skip_serializing_if = "Option::is_none")]
            plane: Option<[f64; 3]>,
            #[serde(skip_serializing_if = "Vec::is_empty")]
            rod: Vec<Any<'a>>,
            #[serde(skip_serializing_if = "Vec::is_empty")]
            body: Vec<&'a AssemblyBody>,
        }
        let free = self.free.iter().map(|rod| Any::Free { rod, to: "free" });
        let tables = AssemblyTables {
            plane: self.plane,
            rod: self.rods.iter().map(Any::Held).chain(free).collect(),
            body: self.bodies.iter().collect(),
        };
        tables.serialize(serializer)
    }
}

/// An elastic rod and the attachments of its ends.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct AssemblyRod {
    /// Name of the rod.
    pub name: String,
    /// Length, section and rest strains; no friction.
    #[serde(flatten)]
    pub rod: Rod,
    /// Dead force per length along the rod, without its weight.
    #[serde(skip_serializing_if = "LoadAlong::is_zero")]
    pub distributed: LoadAlong,
    /// Attachment of the base, s = 0.
    pub from: Site,
    /// Attachment of the end, s = length.
    pub to: Site,
}

impl AssemblyRod {
    /// True if a joint at an end has axes of its own.
    pub fn has_joint_axes(&self) -> bool {
        [&self.from, &self.to]
            .iter()
            .any(|end| end.joint.is_guided())
    }
}

/// A rod with a free end: without load it keeps its rest shape and moves rigidly with its base.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct FreeRod {
    /// Name of the rod.
    pub name: String,
    /// Length, section and rest strains; no friction and no contact diameter.
    #[serde(flatten)]
    pub rod: Rod,
    /// Attachment of the base, s = 0: a weld.
    pub from: Site,
}

/// An attachment of a rod: its place, directors and joint.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct Site {
    /// Name of the body that holds the rod; `None`: the ground.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub body: Option<String>,
    /// Place in the frame of the body, or in the world.
    pub position: [f64; 3],
    /// Directors of the attachment in the same frame.
    #[serde(flatten)]
    pub orientation: Orientation,
    /// Joint of the rod's directors to those of the attachment; always [`SiteJoint::Ball`] on a point mass.
    #[serde(flatten)]
    pub joint: SiteJoint,
    /// Prescribed motion of an attachment on the ground; `None`: at rest.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub motion: Option<ClampMotion>,
}

/// A body of an assembly.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct AssemblyBody {
    /// Name of the body.
    pub name: String,
    /// Mass > 0; 0 for a node without mass, at rest.
    #[serde(skip_serializing_if = "is_zero")]
    pub mass: f64,
    /// Inertia and centre of mass; `None`: a point mass.
    #[serde(flatten, skip_serializing_if = "Extent::is_none")]
    pub extent: Option<Extent>,
    /// Force at the centre of mass; default 0.
    pub force: Load,
    /// Couple; default 0, and always 0 for a point mass.
    #[serde(skip_serializing_if = "Load::is_none")]
    pub couple: Load,
    /// Drag coefficient >= 0 of the centre of mass; default 0.
    #[serde(skip_serializing_if = "is_zero")]
    pub drag: f64,
    /// Rotational drag >= 0; default 0, and 0 for a point mass.
    #[serde(skip_serializing_if = "is_zero")]
    pub rotational_drag: f64,
    /// Pose near which the equilibrium is sought; given for all bodies or for none.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub guess: Option<Guess>,
    /// Pose at the start of a motion, of a body that no rod holds; `None`: rods hold the body.
    #[serde(flatten, skip_serializing_if = "Option::is_none")]
    pub place: Option<Guess>,
    /// Groove in which the origin of the body's frame slides; `None`: no groove.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub groove: Option<Groove>,
    /// Shape where the body touches obstacles and other bodies; `None`: a point.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub shape: Option<BodyShape>,
    /// Initial velocity of the origin of the body's frame, in the world; default 0.
    #[serde(skip_serializing_if = "is_none")]
    pub velocity: [f64; 3],
    /// Initial angular velocity in the world; default 0, and 0 for a point mass.
    #[serde(skip_serializing_if = "is_none")]
    pub angular_velocity: [f64; 3],
    /// Functions of time and of the motion: [`Scene::act`](super::Scene::act).
    #[serde(skip)]
    pub functions: Vec<LoadFunction>,
}

/// Mass of a body of mass 0, over that of the lightest rod; a body below the second bound gives no unit of mass.
const FILLED: f64 = 1e-9;
const MASSLESS: f64 = 1e-6;

/// True for zero drag or mass, which is left out of a written scene: a scene of statics has no such field.
fn is_zero(x: &f64) -> bool {
    *x == 0.0
}

/// Inertia of a rigid body, absent for a point mass. Components are along the axes of the body's frame.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct Extent {
    /// Inertia about the centre of mass: symmetric positive definite, each principal moment at most the sum of the
    /// others.
    pub inertia: [[f64; 3]; 3],
    /// Centre of mass from the origin of the frame; default 0.
    pub offset: [f64; 3],
    /// Angular momentum of a symmetric rotor inside, relative to the body; default 0.
    #[serde(skip_serializing_if = "is_none")]
    pub rotor: [f64; 3],
}

/// Pose of a body at the start: approximate where the body starts in equilibrium.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct Guess {
    /// Position of the origin of the body's frame.
    pub position: [f64; 3],
    /// Orientation of the body's frame; meaningless for a point mass.
    #[serde(flatten)]
    pub orientation: Orientation,
}

impl Extent {
    /// True for a point mass, and for a node, which has no inertia.
    fn is_none(extent: &Option<Self>) -> bool {
        extent
            .as_ref()
            .is_none_or(|extent| extent.inertia == [[0.0; 3]; 3])
    }
}

impl AssemblyBody {
    /// True for a node without mass.
    pub fn is_massless(&self) -> bool {
        self.mass == 0.0
    }

    /// All loads on the body except the forces of the rods.
    pub fn loads(&self, gravity: [f64; 3]) -> Loads {
        Loads {
            gravity,
            dead: self.force.constant(),
            distributed: LoadAlong::default(),
            follower: LoadAlong::default(),
            load: 1.0,
            couple: self.couple.clone(),
            drag: self.drag,
            rotational_drag: self.rotational_drag,
            force: self.force.in_time().to_vec(),
            functions: self.functions.clone(),
        }
    }
}

impl AssemblyScene {
    /// Mass of the first body that has one, the unit of mass; that of the first rod if no body has, or 1.
    pub fn mass(&self) -> f64 {
        let massive = self.bodies.iter().find(|body| !body.is_massless());
        let body = massive.map(|body| body.mass);
        let rods = self.every_rod().filter_map(Rod::mass);
        let rod = rods.into_iter().next().filter(|_| self.is_heavy());
        match (body, rod) {
            (Some(body), Some(rod)) if body < MASSLESS * rod => rod,
            (Some(body), _) => body,
            (None, rod) => rod.unwrap_or(1.0),
        }
    }

    /// All rods, those with a free end last.
    pub fn every_rod(&self) -> impl Iterator<Item = &Rod> {
        let held = self.rods.iter().map(|rod| &rod.rod);
        held.chain(self.free.iter().map(|rod| &rod.rod))
    }

    /// True if a motion includes the full mass of the rods.
    pub fn is_heavy(&self) -> bool {
        self.every_rod().any(Rod::is_heavy)
    }

    /// True for a body whose mass does not count beside that of rods with full mass: a point where rods meet.
    pub fn is_negligible(&self, body: &AssemblyBody) -> bool {
        let rods = self.every_rod().filter_map(Rod::mass);
        self.is_heavy() && body.mass < MASSLESS * rods.fold(f64::INFINITY, f64::min)
    }

    /// Gives bodies of mass 0, which are points of the rods with full mass that they join, a mass that does not count.
    pub(super) fn fill_massless(&mut self) {
        let least = self
            .every_rod()
            .filter_map(Rod::mass)
            .fold(f64::INFINITY, f64::min);
        let length = self
            .every_rod()
            .map(|rod| rod.length)
            .fold(f64::INFINITY, f64::min);
        for body in self.bodies.iter_mut().filter(|body| body.mass == 0.0) {
            body.mass = FILLED * least;
            let moment = FILLED * least * length * length;
            let moments =
                std::array::from_fn(|i| std::array::from_fn(|j| if i == j { moment } else { 0.0 }));
            body.extent = Some(Extent {
                inertia: moments,
                offset: [0.0; 3],
                rotor: [0.0; 3],
            });
        }
    }

    /// The assembly without the bodies that no rod holds.
    pub(super) fn without_free_bodies(&self) -> Self {
        let mut held = self.clone();
        held.bodies.retain(|body| body.place.is_none());
        held
    }

    /// True if nothing holds the bodies: every load-bearing rod joins two bodies, and no body slides in a groove.
    pub fn floats(&self) -> bool {
        if self.rods.is_empty() && self.free.iter().any(|rod| rod.from.body.is_none()) {
            return false;
        }
        let on_bodies = |rod: &AssemblyRod| rod.from.body.is_some() && rod.to.body.is_some();
        self.rods.iter().all(on_bodies) && self.bodies.iter().all(|body| body.groove.is_none())
    }

    /// Joints of the base and the end of every rod to the ground, rods with a free end last. `None` at a body, and at a
    /// free end.
    pub fn grounds(&self) -> Vec<[Option<Joint>; 2]> {
        let joint = |site: &Site| site.body.is_none().then_some(site.joint.shown());
        let held = self.rods.iter();
        let held = held.map(|rod| [joint(&rod.from), joint(&rod.to)]);
        let free = self.free.iter().map(|rod| [joint(&rod.from), None]);
        held.chain(free).collect()
    }

    /// Index of the body at this end of a rod; `None` on the ground.
    pub fn holder(&self, site: &Site) -> Option<usize> {
        let name = site.body.as_ref()?;
        self.bodies.iter().position(|body| body.name == *name)
    }
}
