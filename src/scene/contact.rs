//! Rules of contact: friction, restitution, the law of impact, what is looked for.

use super::{AssemblyBody, Method, Rod, Run, Scene};
use crate::Result;
use crate::contact::{ImpactLaw, Shape};
use nalgebra::Vector3;
use serde::{Serialize, Serializer};

/// Width of a barrier, in lengths of the shortest rod.
const GAP: f64 = 1e-4;
/// Least tolerance of runs in elements, in which rods touch each other.
const COARSE: f64 = 0.99e-5;

/// `[contact]`: rules of contact for all obstacles without rules of their own.
#[derive(Debug, Clone, PartialEq, Serialize, Default)]
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
    /// The method by which contacts are followed.
    #[serde(skip_serializing_if = "ContactMethod::is_auto")]
    pub method: ContactMethod,
    /// Width of the barrier, in lengths of the shortest rod; `None`: 1e-4.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub gap: Option<f64>,
    /// Displacement at which friction has its full size, in lengths of the shortest rod; `None`: a hundredth of `gap`.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub stick: Option<f64>,
    /// True: a run with a barrier is repeated with half the gap, and the change is reported.
    #[serde(skip_serializing_if = "is_false")]
    pub halve: bool,
    /// Normal speed after an impact below which bounces are summed up; `None`: 1e-6 of the unit of speed of the rod.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub settle_speed: Option<f64>,
    /// Surfaces of single pairs.
    #[serde(skip_serializing_if = "Vec::is_empty")]
    pub pairs: Vec<ContactPair>,
}

/// The surfaces of one pair: of a body with an obstacle, or of two bodies.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct ContactPair {
    /// Names of the two.
    pub between: [String; 2],
    /// Coefficient of friction; `None`: that of the obstacle, or of [`ContactRules`].
    #[serde(skip_serializing_if = "Option::is_none")]
    pub friction: Option<f64>,
    /// Restitution of impacts; `None`: that of the obstacle, or of [`ContactRules`].
    #[serde(skip_serializing_if = "Option::is_none")]
    pub restitution: Option<f64>,
    /// True if the two pass through each other.
    pub apart: bool,
}

impl ContactRules {
    /// True for the rules of a scene without `[contact]`.
    pub fn are_default(&self) -> bool {
        *self == Self::default()
    }
}

impl Scene {
    /// True if bodies may hit obstacles or each other: there are obstacles, or bodies of an assembly that have a shape
    /// or that no rod holds.
    pub fn has_contact(&self) -> bool {
        let mut bodies = self.assembly().into_iter().flat_map(|given| &given.bodies);
        let hits = |body: &AssemblyBody| body.shape.is_some() || body.place.is_some();
        !self.obstacles.is_empty() || bodies.any(hits)
    }

    /// Width of the barrier through which rods with all of their mass touch obstacles and each other, in lengths of the
    /// shortest rod; `None` where contacts are exact.
    pub fn barrier_gap(&self) -> Option<f64> {
        let heavy = self.every_rod().iter().any(|rod| rod.is_heavy());
        let moves = self.is_motion() && !self.obstacles.is_empty();
        (heavy && moves || self.rods_meet()).then(|| self.contact.gap.unwrap_or(GAP))
    }

    /// True if rods with all of their mass touch each other or themselves in a motion.
    pub fn rods_meet(&self) -> bool {
        let coarse = |run: &Run| run.method == Method::Auto && run.tolerance >= COARSE;
        self.rods_could_meet() && self.run.as_ref().is_some_and(coarse)
    }

    /// True for rods with all of their mass and a thickness, which touch each other at a coarse tolerance.
    pub(super) fn rods_could_meet(&self) -> bool {
        let rods = self.every_rod();
        let follows =
            |rod: &&Rod| rod.is_heavy() && rod.relaxation.is_empty() && rod.nodes.is_none();
        let thick = |rod: &&Rod| rod.thickness().is_some_and(|diameter| diameter > 0.0);
        self.is_motion()
            && !self.is_planar()
            && !self.has_groove()
            && matches!(
                self.contact.rods,
                RodsInContact::All | RodsInContact::Others
            )
            && rods.iter().all(follows)
            && rods.iter().any(thick)
    }

    /// The scene with half the gap of the barrier; `None` without a barrier, or unless the scene asks for it.
    pub fn at_half_gap(&self) -> Option<Self> {
        let gap = self.barrier_gap().filter(|_| self.contact.halve)?;
        let mut half = self.clone();
        half.contact.gap = Some(0.5 * gap);
        half.contact.halve = false;
        Some(half)
    }

    /// Names of the bodies, and of the rods, in contacts.
    pub(super) fn names_in_contact(&self) -> (Vec<String>, Vec<String>) {
        match self.assembly() {
            None => (vec!["body".to_owned()], vec!["rod".to_owned()]),
            Some(given) => (
                given.bodies.iter().map(|body| body.name.clone()).collect(),
                (given.rods.iter().map(|rod| &rod.name))
                    .chain(given.free.iter().map(|rod| &rod.name))
                    .cloned()
                    .collect(),
            ),
        }
    }

    /// All rods of the scene.
    pub(super) fn every_rod(&self) -> Vec<&Rod> {
        match self.assembly() {
            Some(given) => given.every_rod().collect(),
            None => vec![&self.rod],
        }
    }

    /// True if a body slides in a groove.
    pub(super) fn has_groove(&self) -> bool {
        let mut bodies = self.assembly().into_iter().flat_map(|given| &given.bodies);
        self.groove().is_some() || bodies.any(|body| body.groove.is_some())
    }

    /// Shapes of the point masses, as far as they are given.
    pub(super) fn shapes_of_points(&self) -> impl Iterator<Item = BodyShape> {
        let one = self.body.iter().filter(|body| !body.joint.is_weld());
        let all = self.assembly().into_iter().flat_map(|given| &given.bodies);
        let points = all.filter(|body| body.extent.is_none());
        let one = one.filter_map(|body| body.shape);
        one.chain(points.filter_map(|body| body.shape))
    }
}

fn key_of_law<S: Serializer>(
    law: &ImpactLaw,
    serializer: S,
) -> std::result::Result<S::Ok, S::Error> {
    law.key().serialize(serializer)
}

fn is_false(flag: &bool) -> bool {
    !flag
}

/// The method by which contacts are followed.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Default)]
#[serde(rename_all = "lowercase")]
pub enum ContactMethod {
    /// Exactly, but through a barrier where rods have all of their mass.
    #[default]
    Auto,
    /// Exactly.
    Exact,
    /// Through a barrier of small width.
    Barrier,
}

impl ContactMethod {
    fn is_auto(&self) -> bool {
        *self == Self::Auto
    }
}

/// The rods that are looked for at obstacles and at rods.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Default)]
#[serde(rename_all = "lowercase")]
pub enum RodsInContact {
    /// All: where a rod touches an obstacle, the run ends.
    #[default]
    All,
    /// None: rods pass through obstacles, and bodies alone hit them.
    None,
    /// Rods touch obstacles, and not each other.
    Obstacles,
    /// Rods touch obstacles and other rods, and not themselves.
    Others,
}

/// The shape of a body where it touches others. Its middle is the centre of mass, its axes are those of the body.
#[derive(Debug, Clone, Copy, PartialEq, Serialize)]
#[serde(rename_all = "lowercase")]
pub enum BodyShape {
    /// A point.
    Point,
    /// A ball of this diameter.
    Ball(f64),
    /// A cylinder between two half balls, along the third axis: diameter, and distance of the half balls' centres.
    Capsule([f64; 2]),
    /// A cylinder with flat ends, along the third axis: diameter and length.
    Cylinder([f64; 2]),
    /// A box with these sides along the axes.
    Box([f64; 3]),
}

impl BodyShape {
    /// Every length of the shape by its field, with the index of the component.
    pub(super) fn lengths_mut(&mut self) -> Vec<(&'static str, usize, &mut f64)> {
        let (field, lengths): (_, &mut [f64]) = match self {
            Self::Point => return Vec::new(),
            Self::Ball(diameter) => ("shape.ball", std::slice::from_mut(diameter)),
            Self::Capsule(sizes) => ("shape.capsule[]", sizes),
            Self::Cylinder(sizes) => ("shape.cylinder[]", sizes),
            Self::Box(sides) => ("shape.box[]", sides),
        };
        let each = lengths.iter_mut().enumerate();
        each.map(|(i, x)| (field, i, x)).collect()
    }

    /// The shape in units of `length`.
    ///
    /// # Errors
    /// As the constructors of [`Shape`].
    pub(crate) fn in_units(&self, length: f64) -> Result<Shape> {
        match *self {
            Self::Point => Ok(Shape::Point),
            Self::Ball(diameter) => Shape::ball(0.5 * diameter / length),
            Self::Capsule([diameter, way]) => Shape::capsule(way / length, 0.5 * diameter / length),
            Self::Cylinder([diameter, way]) => {
                Shape::cylinder(way / length, 0.5 * diameter / length)
            }
            Self::Box(sides) => Shape::cuboid(Vector3::from(sides) / length),
        }
    }
}
