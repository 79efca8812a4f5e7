//! Parameters: numbers of a scene by dotted paths, with the rule what a branch may vary.

use super::read::TENDONS;
use super::{Scene, Units};
use crate::error::{Error, Quantity};
use serde::{Serialize, Serializer};
use std::fmt;
use std::str::FromStr;

/// A number of a scene, identified by its path. `Display` writes the path and [`FromStr`] reads it.
///
/// Components along the axes of space have letters, `end.force.z`; indices count from 0, as in
/// `rod.section.bending[0]`; `end.force[2]` is read, too. An index beyond those of the scene names nothing. Bodies and
/// rods of an assembly are numbered here; [`Scene::name_of`] writes their names in the scene.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash)]
pub struct Parameter {
    /// Table of the number; `[]` is the place of its index.
    table: &'static str,
    /// Field of the table; `[]` or `.xyz` is the place of the index of a component.
    field: &'static str,
    /// Indices of the table and of the component.
    at: [usize; 2],
}

/// Numbers that a branch may vary.
pub(super) struct Variable {
    pub table: &'static str,
    pub field: &'static str,
    /// Quantity of the numbers.
    pub of: Quantity,
    /// Part of the problem that depends on the numbers.
    pub role: Role,
    /// Reason why a scene may lack the numbers, with advice.
    absence: &'static str,
}

/// Part of the problem that depends on a parameter.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) enum Role {
    /// Supports and loads of ends and bodies.
    Ends,
    /// The load along the rod.
    Along,
    /// The length or a stiffness of the rod, > 0.
    Rod,
    /// A strain of the unloaded rod.
    Rest,
    /// The tension of a tendon, >= 0.
    Tendon,
    /// The place of an obstacle.
    Obstacle,
    /// A size of an obstacle, > 0.
    Size,
}

/// Defines the constants and the list of all of them.
macro_rules! variables {
    ($($name:ident = $table:literal $field:literal $of:expr, $role:ident, $absence:expr;)*) => {
        $(pub(super) const $name: Variable =
            Variable { table: $table, field: $field, of: $of, role: Role::$role, absence: $absence };)*
        const VARIABLES: &[&Variable] = &[$(&$name),*];
    };
}

const TURN: &str = "write the orientation as rotation = { axis = [0.0, 1.0, 0.0], angle = 0.0 }";
const FREE: &str = "something of the end is held, or end.follower is true";
const SECTION: &str =
    "in this scene it is rigid, varies along the rod, or is no number of the section law";
const REST: &str = "it varies along the rod in this scene";
const TENDON: &str = "the rod has no such tendon, or its length is given";
const LISTED: &str = "there is no such [[load]] on a rod; one along a part of the rod varies by its `factor`, one on a body as body.NAME.force.z";
const BODY: &str =
    "there is no such body, its load is in time, or it is a point mass, which takes no couple";
const SITE: &str =
    "there is no such rod, or this end of it is on a body; a place on the ground can move";
const JOINT: &str = "there is no such rod, or this end of it has no hinge or universal joint (couple), no slider or roller (force)";
const OBSTACLE: &str = "there is no such obstacle, or its shape is another";
const SITE_TURN: &str =
    "of an end on the ground, written as rotation = { axis = [0.0, 1.0, 0.0], angle = 0.0 }";

#[rustfmt::skip]
variables! {
    END_FORCE = "end" "force.xyz" Quantity::Force, Ends,
        "this component of the end is held, and its force part of the solution";
    END_COUPLE = "end" "couple.xyz" Quantity::Couple, Ends,
        "the orientation of the end is held, and its couple part of the solution";
    END_FOLLOWER_FORCE = "end" "follower_force.xyz" Quantity::Force, Ends, FREE;
    END_FOLLOWER_COUPLE = "end" "follower_couple.xyz" Quantity::Couple, Ends, FREE;
    END_LOAD = "end" "load" Quantity::Ratio, Ends,
        "it is the common factor of the forces and couples of [end], which are 0 in this scene";
    END_POSITION = "end" "position.xyz" Quantity::Length, Ends,
        "this component of the end is not held: write end.position with a number for it";
    END_ANGLE = "end" "rotation.angle" Quantity::Ratio, Ends, TURN;
    CLAMP_POSITION = "clamp" "position.xyz" Quantity::Length, Ends, SECTION;
    CLAMP_ANGLE = "clamp" "rotation.angle" Quantity::Ratio, Ends, TURN;
    LENGTH = "rod" "length" Quantity::Length, Rod,
        "a table in s ends at the length; write { polynomial = [..] }, in s / length";
    BENDING = "rod.section" "bending[]" Quantity::Stiffness(0, 0), Rod, SECTION;
    TORSION = "rod.section" "torsion" Quantity::Stiffness(2, 2), Rod, SECTION;
    SHEAR = "rod.section" "shear[]" Quantity::Stiffness(3, 3), Rod, SECTION;
    AXIAL = "rod.section" "axial" Quantity::Stiffness(5, 5), Rod, SECTION;
    CURVATURE = "rod.rest" "curvature[]" Quantity::Curvature, Rest, REST;
    TWIST = "rod.rest" "twist" Quantity::Curvature, Rest, REST;
    DRIVE = "rod.drive" "amplitude" Quantity::Ratio, Rest, "there is no [rod.drive], whose amplitude it is";
    TENSION = "rod" "tendon[].tension" Quantity::Force, Tendon, TENDON;
    TENSION_OF = "rod[]" "tendon[].tension" Quantity::Force, Tendon, TENDON;
    GRAVITY = "loads" "gravity.xyz" Quantity::Acceleration, Along,
        "the rod has no mass that gravity could act on: write mass = 0.02 in [rod], or give its material a density";
    DISTRIBUTED = "loads" "distributed.xyz" Quantity::Distributed, Along,
        "it varies along the rod in this scene: vary loads.load, the common factor of gravity and distributed";
    FOLLOWER = "loads" "follower.xyz" Quantity::Distributed, Along,
        "it varies along the rod in this scene: vary loads.load, the common factor of the loads along the rod";
    LOADS_LOAD = "loads" "load" Quantity::Ratio, Along,
        "it is the common factor of loads.gravity, loads.distributed and loads.follower, which are 0 in this scene";
    LISTED_FORCE = "load[]" "force.xyz" Quantity::Force, Along, LISTED;
    LISTED_COUPLE = "load[]" "couple.xyz" Quantity::Couple, Along, LISTED;
    LISTED_FACTOR = "load[]" "factor" Quantity::Ratio, Along, LISTED;
    BODY_FORCE = "body[]" "force.xyz" Quantity::Force, Ends, BODY;
    BODY_COUPLE = "body[]" "couple.xyz" Quantity::Couple, Ends, BODY;
    FROM_POSITION = "rod[]" "from.position.xyz" Quantity::Length, Ends, SITE;
    TO_POSITION = "rod[]" "to.position.xyz" Quantity::Length, Ends, SITE;
    FROM_COUPLE = "rod[]" "from.couple" Quantity::Couple, Ends, JOINT;
    TO_COUPLE = "rod[]" "to.couple" Quantity::Couple, Ends, JOINT;
    FROM_FORCE = "rod[]" "from.force" Quantity::Force, Ends, JOINT;
    TO_FORCE = "rod[]" "to.force" Quantity::Force, Ends, JOINT;
    FROM_ANGLE = "rod[]" "from.rotation.angle" Quantity::Ratio, Ends, SITE_TURN;
    TO_ANGLE = "rod[]" "to.rotation.angle" Quantity::Ratio, Ends, SITE_TURN;
    PLANE_POINT = "obstacle[]" "plane.point.xyz" Quantity::Length, Obstacle, OBSTACLE;
    CYLINDER_POINT = "obstacle[]" "cylinder.point.xyz" Quantity::Length, Obstacle, OBSTACLE;
    CYLINDER_RADIUS = "obstacle[]" "cylinder.radius" Quantity::Length, Size, OBSTACLE;
    SPHERE_CENTRE = "obstacle[]" "sphere.centre.xyz" Quantity::Length, Obstacle, OBSTACLE;
    SPHERE_RADIUS = "obstacle[]" "sphere.radius" Quantity::Length, Size, OBSTACLE;
    CAPSULE_FROM = "obstacle[]" "capsule.from.xyz" Quantity::Length, Obstacle, OBSTACLE;
    CAPSULE_TO = "obstacle[]" "capsule.to.xyz" Quantity::Length, Obstacle, OBSTACLE;
    CAPSULE_RADIUS = "obstacle[]" "capsule.radius" Quantity::Length, Size, OBSTACLE;
    BOX_CENTRE = "obstacle[]" "box.centre.xyz" Quantity::Length, Obstacle, OBSTACLE;
    BOX_SIDES = "obstacle[]" "box.sides.xyz" Quantity::Length, Size, OBSTACLE;
}

/// Letters of the components in space.
const AXES: [&str; 3] = ["x", "y", "z"];

/// Names of component i of a field: `force.z` and `force[2]`, `tendon[0].tension` and `tendon.0.tension`.
fn names(field: &str, i: usize) -> [String; 2] {
    match field.strip_suffix(".xyz") {
        Some(stem) => [format!("{stem}.{}", AXES[i % 3]), format!("{stem}[{i}]")],
        None => [format!("[{i}]"), format!(".{i}")].map(|at| field.replace("[]", &at)),
    }
}

impl Variable {
    /// Path of component i in table k.
    fn path(&self, k: usize, i: usize) -> Parameter {
        Parameter::new(self.table, k, self.field, i)
    }

    /// Number of components.
    fn len(&self) -> usize {
        match self.field {
            field if field.ends_with(".xyz") => 3,
            field if field.starts_with("tendon") => TENDONS,
            field if field.ends_with("[]") => 2,
            _ => 1,
        }
    }

    /// Index of the component with this name.
    fn component(&self, name: &str) -> Option<usize> {
        (0..self.len()).find(|i| names(self.field, *i).iter().any(|known| known == name))
    }

    /// Parses a path to one of these numbers.
    fn parse(&self, path: &str) -> Option<Parameter> {
        match self.table.strip_suffix("[]") {
            None => {
                let field = path.strip_prefix(self.table)?.strip_prefix('.')?;
                Some(self.path(0, self.component(field)?))
            }
            Some(list) => {
                let (k, field) = path
                    .strip_prefix(list)?
                    .strip_prefix('[')?
                    .split_once("].")?;
                Some(self.path(k.parse().ok()?, self.component(field)?))
            }
        }
    }
}

impl Parameter {
    /// The number of component i of a field in table k.
    pub(super) const fn new(table: &'static str, k: usize, field: &'static str, i: usize) -> Self {
        let at = [k, i];
        Self { table, field, at }
    }

    /// Every parameter that some scene of a single rod has.
    pub fn all() -> Vec<Self> {
        let of_one = VARIABLES.iter().filter(|of| !of.table.ends_with("[]"));
        // One tendon stands for all.
        let count = |of: &Variable| if of.role == Role::Tendon { 1 } else { of.len() };
        of_one
            .flat_map(|of| (0..count(of)).map(|i| of.path(0, i)))
            .collect()
    }

    /// Entry of the number among the variables of branches; `None` for a fixed number.
    pub(super) fn variable(self) -> Option<&'static Variable> {
        let same = |of: &&&Variable| (of.table, of.field) == (self.table, self.field);
        VARIABLES.iter().find(same).copied()
    }

    fn is(self, role: Role) -> bool {
        self.variable().is_some_and(|of| of.role == role)
    }

    /// True if every value must be > 0.
    pub fn is_positive(self) -> bool {
        self.is(Role::Rod) || self.is(Role::Size)
    }

    /// True if every value must be >= 0.
    pub fn is_non_negative(self) -> bool {
        self.is(Role::Tendon)
    }

    /// True if the rod or the load along it depends on the parameter; false if only the ends do.
    pub fn changes_rod(self) -> bool {
        !(self.is(Role::Ends) || self.is_of_obstacle())
    }

    /// True for a place or a size of an obstacle.
    pub fn is_of_obstacle(self) -> bool {
        self.is(Role::Obstacle) || self.is(Role::Size)
    }

    /// True for a parameter of the dead load along the rod.
    pub fn is_along(self) -> bool {
        self.is(Role::Along)
            && !self.is_follower_along()
            && !self.is_factor_along()
            && !self.is_listed_couple()
    }

    /// True for the common factor of the loads along the rod.
    pub fn is_factor_along(self) -> bool {
        (self.table, self.field) == (LOADS_LOAD.table, LOADS_LOAD.field)
    }

    /// True for a parameter of the follower load along the rod.
    pub fn is_follower_along(self) -> bool {
        self.field == FOLLOWER.field
    }

    /// True for a couple of the list of loads.
    pub fn is_listed_couple(self) -> bool {
        (self.table, self.field) == (LISTED_COUPLE.table, LISTED_COUPLE.field)
    }

    /// Symbol of the parameter's unit.
    pub fn unit(self, units: Units) -> &'static str {
        // Angles are in radians in every system of units.
        if self.field.ends_with("angle") {
            "rad"
        } else {
            self.variable().map_or("", |of| units.symbol(of.of))
        }
    }

    /// Reason why a scene may lack the parameter, with advice.
    pub(super) fn absence(self) -> &'static str {
        self.variable().map_or("", |of| of.absence)
    }

    /// Component along an axis of space of a force or couple: on the end of a rod, or on a body of this index.
    pub fn load(self, name: &str) -> Option<(Option<usize>, usize)> {
        let [k, i] = self.at;
        let body = match self.table {
            "end" => None,
            "body[]" => Some(k),
            _ => return None,
        };
        (self.field.strip_suffix(".xyz")? == name).then_some((body, i))
    }
}

impl fmt::Display for Parameter {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let [k, i] = self.at;
        let table = self.table.replace("[]", &format!("[{k}]"));
        let [field, _] = names(self.field, i);
        write!(f, "{table}.{field}")
    }
}

impl FromStr for Parameter {
    type Err = Error;

    /// # Errors
    /// A path that no scene has.
    fn from_str(path: &str) -> Result<Self, Error> {
        let path = if path == "load" { "end.load" } else { path };
        let found = VARIABLES.iter().find_map(|of| of.parse(path));
        found.ok_or_else(|| {
            Error::domain(format!(
                "parameter = {path:?}: must be the path of a number of the scene, such as \"end.force.z\""
            ))
        })
    }
}

impl Serialize for Parameter {
    fn serialize<S: Serializer>(&self, serializer: S) -> Result<S::Ok, S::Error> {
        serializer.collect_str(self)
    }
}

impl Scene {
    /// Path of a parameter with the scene's names for its bodies and rods: `body.crown.force.z`.
    pub fn name_of(&self, parameter: &Parameter) -> String {
        let [k, _] = parameter.at;
        let of_assembly = self.assembly().and_then(|assembly| match parameter.table {
            "body[]" => Some(&assembly.bodies.get(k)?.name),
            "rod[]" => Some(&assembly.rods.get(k)?.name),
            _ => None,
        });
        let obstacle = self.obstacles.get(k).map(|obstacle| &obstacle.name);
        let name = of_assembly.or(obstacle.filter(|_| parameter.table == "obstacle[]"));
        let path = parameter.to_string();
        match name {
            Some(name) => path.replacen(&format!("[{k}]"), &format!(".{name}"), 1),
            None => path,
        }
    }

    /// Value of a parameter; NaN if the scene has no such number ([`Scene::has`]).
    pub fn value(&self, parameter: &Parameter) -> f64 {
        let mut scene = self.clone();
        scene.number_mut(parameter).map_or(f64::NAN, |slot| *slot)
    }

    /// The scene with another value of a parameter, not checked. Unchanged if the scene has no such number
    /// ([`Scene::has`]).
    #[must_use]
    pub fn with(&self, parameter: &Parameter, value: f64) -> Self {
        let mut scene = self.clone();
        if let Some(slot) = scene.number_mut(parameter) {
            *slot = value;
        }
        scene
    }

    /// True if the parameter is a number of this scene: present, not rigid, not free, and uniform along the rod.
    pub fn has(&self, parameter: &Parameter) -> bool {
        self.clone().number_mut(parameter).is_some()
    }

    /// Every parameter of this scene.
    pub fn parameters(&self) -> Vec<Parameter> {
        let mut scene = self.clone();
        let paths = scene.numbers().into_iter().map(|number| number.path);
        paths.filter(|path| path.variable().is_some()).collect()
    }

    /// Reference to the number in the scene; `None` if the scene has no such number.
    fn number_mut(&mut self, parameter: &Parameter) -> Option<&mut f64> {
        let mut numbers = self.numbers().into_iter();
        Some(numbers.find(|number| number.path == *parameter)?.slot)
    }
}
