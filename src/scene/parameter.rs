//! Parameters of a scene: dotted paths to its numbers.

use super::{
    AssemblyScene, Component, Load, LoadAlong, Orientation, Scene, SceneKind, Section, Site,
    Stiffness, Units,
};
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
pub enum Parameter {
    /// `end.force`, component i in 0..3.
    EndForce(usize),
    /// `end.couple`, component i in 0..3.
    EndCouple(usize),
    /// `end.load` (or `load`): the common factor of force and couple.
    EndLoad,
    /// `end.position`, component i in 0..3.
    EndPosition(usize),
    /// `end.rotation.angle`, radians.
    EndAngle,
    /// `clamp.position`, component i in 0..3.
    ClampPosition(usize),
    /// `clamp.rotation.angle`, radians.
    ClampAngle,
    /// `rod.length`.
    Length,
    /// `rod.section.bending[i]`, i in 0..2.
    Bending(usize),
    /// `rod.section.torsion`.
    Torsion,
    /// `rod.section.shear[i]`, i in 0..2.
    Shear(usize),
    /// `rod.section.axial`.
    Axial,
    /// `rod.rest.curvature[i]`, i in 0..2.
    Curvature(usize),
    /// `rod.rest.twist`.
    Twist,
    /// `body[k].force` of an assembly, component i of a constant force.
    BodyForce(usize, usize),
    /// `body[k].couple` of an assembly, component i of a constant couple.
    BodyCouple(usize, usize),
    /// `loads.gravity`, of an assembly or of a rod with mass, component i in 0..3.
    Gravity(usize),
    /// `loads.distributed`, component i in 0..3.
    Distributed(usize),
    /// `loads.load`: the common factor of gravity and distributed.
    LoadsLoad,
    /// `rod[k].from.position` on the ground, component i.
    FromPosition(usize, usize),
    /// `rod[k].to.position` on the ground, component i.
    ToPosition(usize, usize),
    /// `rod[k].from.rotation.angle` on the ground, radians.
    FromAngle(usize),
    /// `rod[k].to.rotation.angle` on the ground, radians.
    ToAngle(usize),
}

use Parameter::*;

/// Letters of the components in space.
const AXES: [&str; 3] = ["x", "y", "z"];

impl Parameter {
    /// Every parameter that some scene of a single rod has.
    pub const ALL: [Self; 32] = [
        EndForce(0),
        EndForce(1),
        EndForce(2),
        EndCouple(0),
        EndCouple(1),
        EndCouple(2),
        EndLoad,
        EndPosition(0),
        EndPosition(1),
        EndPosition(2),
        EndAngle,
        ClampPosition(0),
        ClampPosition(1),
        ClampPosition(2),
        ClampAngle,
        Length,
        Bending(0),
        Bending(1),
        Torsion,
        Shear(0),
        Shear(1),
        Axial,
        Curvature(0),
        Curvature(1),
        Twist,
        Gravity(0),
        Gravity(1),
        Gravity(2),
        Distributed(0),
        Distributed(1),
        Distributed(2),
        LoadsLoad,
    ];

    /// True if every value must be > 0.
    pub fn is_positive(self) -> bool {
        matches!(self, Length | Bending(_) | Torsion | Shear(_) | Axial)
    }

    /// True if the rod or the load along it depends on the parameter; false if only the ends do.
    pub fn changes_rod(self) -> bool {
        self.is_positive() || self.is_along() || matches!(self, Curvature(_) | Twist)
    }

    /// True for a parameter of the load along the rod.
    pub fn is_along(self) -> bool {
        matches!(self, Gravity(_) | Distributed(_) | LoadsLoad)
    }

    /// Symbol of the parameter's unit.
    pub fn unit(self, units: Units) -> &'static str {
        match self {
            // Angles are in radians in every system of units.
            EndAngle | ClampAngle | FromAngle(_) | ToAngle(_) => "rad",
            EndLoad | LoadsLoad => "",
            EndForce(_) | Shear(_) | Axial | BodyForce(..) => units.force(),
            Gravity(_) => units.symbol(Quantity::Acceleration),
            Distributed(_) => units.symbol(Quantity::Distributed),
            EndCouple(_) | BodyCouple(..) => units.couple(),
            EndPosition(_) | ClampPosition(_) | FromPosition(..) | ToPosition(..) | Length => {
                units.length()
            }
            Bending(_) | Torsion => units.flexural(),
            Curvature(_) | Twist => units.curvature(),
        }
    }
}

impl fmt::Display for Parameter {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            EndForce(i) => write!(f, "end.force.{}", AXES[*i]),
            EndCouple(i) => write!(f, "end.couple.{}", AXES[*i]),
            EndLoad => f.write_str("end.load"),
            EndPosition(i) => write!(f, "end.position.{}", AXES[*i]),
            EndAngle => f.write_str("end.rotation.angle"),
            ClampPosition(i) => write!(f, "clamp.position.{}", AXES[*i]),
            ClampAngle => f.write_str("clamp.rotation.angle"),
            Length => f.write_str("rod.length"),
            Bending(i) => write!(f, "rod.section.bending[{i}]"),
            Torsion => f.write_str("rod.section.torsion"),
            Shear(i) => write!(f, "rod.section.shear[{i}]"),
            Axial => f.write_str("rod.section.axial"),
            Curvature(i) => write!(f, "rod.rest.curvature[{i}]"),
            Twist => f.write_str("rod.rest.twist"),
            BodyForce(k, i) => write!(f, "body[{k}].force.{}", AXES[*i]),
            BodyCouple(k, i) => write!(f, "body[{k}].couple.{}", AXES[*i]),
            Gravity(i) => write!(f, "loads.gravity.{}", AXES[*i]),
            Distributed(i) => write!(f, "loads.distributed.{}", AXES[*i]),
            LoadsLoad => f.write_str("loads.load"),
            FromPosition(k, i) => write!(f, "rod[{k}].from.position.{}", AXES[*i]),
            ToPosition(k, i) => write!(f, "rod[{k}].to.position.{}", AXES[*i]),
            FromAngle(k) => write!(f, "rod[{k}].from.rotation.angle"),
            ToAngle(k) => write!(f, "rod[{k}].to.rotation.angle"),
        }
    }
}

impl FromStr for Parameter {
    type Err = Error;

    /// # Errors
    /// A path that no scene has.
    fn from_str(path: &str) -> Result<Self, Error> {
        if path == "load" {
            return Ok(EndLoad);
        }
        // `end.force[2]` means `end.force.z`.
        let lettered = || {
            let (stem, index) = path.strip_suffix(']')?.split_once('[')?;
            Some(format!(
                "{stem}.{}",
                AXES.iter()
                    .zip(0..)
                    .find(|(_, k)| k.to_string() == index)?
                    .0
            ))
        };
        let lettered = lettered();
        let same = |parameter: &&Self| {
            let name = parameter.to_string();
            path == name || lettered.as_ref() == Some(&name)
        };
        let known = Self::ALL.iter().find(same).copied();
        known.or_else(|| of_assembly(path)).ok_or_else(|| {
            Error::domain(format!(
                "parameter = {path:?}: must be the path of a number of the scene, such as \"end.force.z\""
            ))
        })
    }
}

/// Parses the path of a parameter of an assembly.
fn of_assembly(path: &str) -> Option<Parameter> {
    // Index 0..3 of a component written by number or letter.
    let component = |field: &str, name: &str| -> Option<usize> {
        let rest = field.strip_prefix(name)?;
        let index = ["[0]", "[1]", "[2]"].iter().position(|i| *i == rest);
        index.or_else(|| {
            AXES.iter()
                .position(|axis| rest.strip_prefix('.') == Some(axis))
        })
    };
    let (list, rest) = path.split_once('[')?;
    let (number, field) = rest.split_once("].")?;
    let k: usize = number.parse().ok()?;
    let of = |name: &str| component(field, name);
    match list {
        "body" => of("force")
            .map(|i| BodyForce(k, i))
            .or_else(|| of("couple").map(|i| BodyCouple(k, i))),
        "rod" if field == "from.rotation.angle" => Some(FromAngle(k)),
        "rod" if field == "to.rotation.angle" => Some(ToAngle(k)),
        "rod" => of("from.position")
            .map(|i| FromPosition(k, i))
            .or_else(|| of("to.position").map(|i| ToPosition(k, i))),
        _ => None,
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
        let path = parameter.to_string();
        let named = || {
            let assembly = self.assembly()?;
            let (list, rest) = path.split_once('[')?;
            let (number, field) = rest.split_once("].")?;
            let k: usize = number.parse().ok()?;
            let name = match list {
                "body" => &assembly.bodies.get(k)?.name,
                _ => &assembly.rods.get(k)?.name,
            };
            Some(format!("{list}.{name}.{field}"))
        };
        named().unwrap_or(path)
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
        let mut all = Parameter::ALL.to_vec();
        if let Some(assembly) = self.assembly() {
            let three = || 0..3;
            all = three().map(Gravity).collect();
            for k in 0..assembly.bodies.len() {
                all.extend(three().map(|i| BodyForce(k, i)));
                all.extend(three().map(|i| BodyCouple(k, i)));
            }
            for k in 0..assembly.rods.len() {
                all.extend(three().map(|i| FromPosition(k, i)));
                all.extend(three().map(|i| ToPosition(k, i)));
                all.extend([FromAngle(k), ToAngle(k)]);
            }
        }
        let has = |parameter: &Parameter| scene.number_mut(parameter).is_some();
        all.into_iter().filter(has).collect()
    }

    /// Reference to the number in the scene; `None` if the scene has no such number.
    fn number_mut(&mut self, parameter: &Parameter) -> Option<&mut f64> {
        if let SceneKind::Assembly(assembly) = &mut self.kind {
            return match *parameter {
                Gravity(i) => self.loads.gravity.get_mut(i),
                _ => assembly.number_mut(parameter),
            };
        }
        let has_mass = self.rod.mass().is_some();
        let loads = &mut self.loads;
        let (end, clamp, rod) = (self.end.as_mut(), &mut self.clamp, &mut self.rod);
        let linear = match &mut rod.section {
            Section::Diagonal(linear) => Some(linear),
            Section::Barrier(law) => Some(&mut law.linear),
            _ => None,
        };
        match *parameter {
            EndForce(i) => {
                let end = end?;
                let free = *end.position.get(i)? == Component::Free;
                free.then(|| end.force.get_mut(i)).flatten()
            }
            EndCouple(i) => {
                let end = end.filter(|end| end.orientation.is_none())?;
                end.couple.get_mut(i)
            }
            // A load factor without loads is no parameter.
            EndLoad => {
                let end = end?;
                let mut loads = end.force.iter().chain(&end.couple);
                let any = loads.any(|x| *x != 0.0);
                any.then_some(&mut end.load)
            }
            Gravity(i) => {
                end.filter(|_| has_mass)?;
                loads.gravity.get_mut(i)
            }
            Distributed(i) => {
                end?;
                loads.distributed.component_mut(i)
            }
            LoadsLoad => {
                end?;
                let any = loads.gravity != [0.0; 3] || !loads.distributed.is_zero();
                any.then_some(&mut loads.load)
            }
            EndPosition(i) => match end?.position.get_mut(i)? {
                Component::Held(x) => Some(x),
                Component::Free => None,
            },
            EndAngle => end?.orientation.as_mut()?.angle_mut(),
            ClampPosition(i) => clamp.position.get_mut(i),
            ClampAngle => clamp.orientation.angle_mut(),
            Length => {
                // Tables hold arclengths up to the length, so the length cannot vary alone.
                let stiffness = linear.iter().flat_map(|linear| linear.named());
                let mut all = stiffness.map(|(_, along)| along).chain(rod.rest.all());
                let tables = all.any(|along| !along.nodes().is_empty())
                    || matches!(loads.distributed, LoadAlong::Table { .. });
                (!tables).then_some(&mut rod.length)
            }
            Bending(i) => linear?.bending.get_mut(i)?.constant_mut(),
            Torsion => linear?.torsion.constant_mut(),
            Shear(i) => match &mut linear?.shear {
                Stiffness::Elastic(shear) => shear.get_mut(i)?.constant_mut(),
                Stiffness::Rigid => None,
            },
            Axial => match &mut linear?.axial {
                Stiffness::Elastic(axial) => axial.constant_mut(),
                Stiffness::Rigid => None,
            },
            Curvature(i) => rod.rest.curvature.get_mut(i)?.constant_mut(),
            Twist => rod.rest.twist.constant_mut(),
            _ => None,
        }
    }
}

impl AssemblyScene {
    fn number_mut(&mut self, parameter: &Parameter) -> Option<&mut f64> {
        match *parameter {
            BodyForce(k, i) => self.bodies.get_mut(k)?.force.component_mut(i),
            BodyCouple(k, i) => {
                let body = self.bodies.get_mut(k)?;
                body.extent.as_ref()?;
                body.couple.component_mut(i)
            }
            FromPosition(k, i) => self.rods.get_mut(k)?.from.on_ground()?.position.get_mut(i),
            ToPosition(k, i) => self.rods.get_mut(k)?.to.on_ground()?.position.get_mut(i),
            FromAngle(k) => self
                .rods
                .get_mut(k)?
                .from
                .on_ground()?
                .orientation
                .angle_mut(),
            ToAngle(k) => self
                .rods
                .get_mut(k)?
                .to
                .on_ground()?
                .orientation
                .angle_mut(),
            _ => None,
        }
    }
}

impl Load {
    fn component_mut(&mut self, i: usize) -> Option<&mut f64> {
        match self {
            Self::Constant(vector) => vector.get_mut(i),
            Self::InTime(_) => None,
        }
    }
}

impl Site {
    fn on_ground(&mut self) -> Option<&mut Self> {
        self.body.is_none().then_some(self)
    }
}

impl Orientation {
    fn angle_mut(&mut self) -> Option<&mut f64> {
        match self {
            Self::Rotation(rotation) => Some(&mut rotation.angle),
            _ => None,
        }
    }
}
