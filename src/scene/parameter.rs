//! Parameters of a scene: dotted paths to its numbers.

use super::{Component, Orientation, Scene, Section, Stiffness, Units};
use crate::error::Error;
use serde::{Serialize, Serializer};
use std::fmt;
use std::str::FromStr;

/// A number of a scene by its path, which `Display` and [`FromStr`] write and read.
///
/// An index counts from 0; of three components it may also be written as a letter, `end.force.z` for
/// `end.force[2]`. Indices that a scene does not have name nothing.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash)]
pub enum Parameter {
    /// `end.force[i]`, i in 0..3.
    EndForce(usize),
    /// `end.couple[i]`, i in 0..3.
    EndCouple(usize),
    /// `end.load` (or `load`): the common factor of force and couple.
    EndLoad,
    /// `end.position[i]`, i in 0..3.
    EndPosition(usize),
    /// `end.rotation.angle`, radians.
    EndAngle,
    /// `clamp.position[i]`, i in 0..3.
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
}

use Parameter::*;

impl Parameter {
    /// Every parameter that some scene has.
    pub const ALL: [Self; 25] = [
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
    ];

    /// True if its values must be > 0.
    pub fn is_positive(self) -> bool {
        matches!(self, Length | Bending(_) | Torsion | Shear(_) | Axial)
    }

    /// True if the rod itself depends on it, not only its ends.
    pub fn changes_rod(self) -> bool {
        self.is_positive() || matches!(self, Curvature(_) | Twist)
    }

    /// Its unit's symbol.
    pub fn unit(self, units: Units) -> &'static str {
        match self {
            // An angle is in radians whatever the other units are.
            EndAngle | ClampAngle => "rad",
            EndLoad => "",
            EndForce(_) | Shear(_) | Axial => units.force(),
            EndCouple(_) => units.couple(),
            EndPosition(_) | ClampPosition(_) | Length => units.length(),
            Bending(_) | Torsion => units.flexural(),
            Curvature(_) | Twist => units.curvature(),
        }
    }

    /// Its path with its unit, for the axes of figures.
    pub fn label(self, units: Units) -> String {
        Units::label(&self.to_string(), self.unit(units))
    }
}

impl fmt::Display for Parameter {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            EndForce(i) => write!(f, "end.force[{i}]"),
            EndCouple(i) => write!(f, "end.couple[{i}]"),
            EndLoad => f.write_str("end.load"),
            EndPosition(i) => write!(f, "end.position[{i}]"),
            EndAngle => f.write_str("end.rotation.angle"),
            ClampPosition(i) => write!(f, "clamp.position[{i}]"),
            ClampAngle => f.write_str("clamp.rotation.angle"),
            Length => f.write_str("rod.length"),
            Bending(i) => write!(f, "rod.section.bending[{i}]"),
            Torsion => f.write_str("rod.section.torsion"),
            Shear(i) => write!(f, "rod.section.shear[{i}]"),
            Axial => f.write_str("rod.section.axial"),
            Curvature(i) => write!(f, "rod.rest.curvature[{i}]"),
            Twist => f.write_str("rod.rest.twist"),
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
        let same = |parameter: &&Self| {
            let name = parameter.to_string();
            let letter = || {
                let (stem, index) = name.strip_suffix(']')?.split_once('[')?;
                let three = matches!(
                    parameter,
                    EndForce(_) | EndCouple(_) | EndPosition(_) | ClampPosition(_)
                );
                let letter = ["x", "y", "z"].get(index.parse::<usize>().ok()?)?;
                Some(three && path == format!("{stem}.{letter}"))
            };
            path == name || letter() == Some(true)
        };
        Self::ALL.iter().find(same).copied().ok_or_else(|| {
            Error::domain(format!(
                "parameter = {path:?}: must be the path of a number of the scene, such as \"end.force[2]\""
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
    /// The value of a parameter; NaN where the scene has no such number ([`Scene::has`]).
    pub fn value(&self, parameter: &Parameter) -> f64 {
        let mut scene = self.clone();
        scene.slot(parameter).map_or(f64::NAN, |slot| *slot)
    }

    /// The scene with another value of a parameter, which is not checked; the same scene where it has no such
    /// number ([`Scene::has`]).
    #[must_use]
    pub fn with(&self, parameter: &Parameter, value: f64) -> Self {
        let mut scene = self.clone();
        if let Some(slot) = scene.slot(parameter) {
            *slot = value;
        }
        scene
    }

    /// True if the parameter is a number of this scene: present, not rigid, not free, and the same all along the
    /// rod.
    pub fn has(&self, parameter: &Parameter) -> bool {
        self.clone().slot(parameter).is_some()
    }

    /// Every parameter of this scene.
    pub fn parameters(&self) -> Vec<Parameter> {
        let mut scene = self.clone();
        let has = |parameter: &Parameter| scene.slot(parameter).is_some();
        Parameter::ALL.into_iter().filter(has).collect()
    }

    /// Where the number is.
    fn slot(&mut self, parameter: &Parameter) -> Option<&mut f64> {
        let (end, clamp, rod) = (self.end.as_mut(), &mut self.clamp, &mut self.rod);
        let linear = match &mut rod.section {
            Section::Diagonal(linear) => Some(linear),
            Section::Barrier(law) => Some(&mut law.linear),
            _ => None,
        };
        let angle = |orientation| match orientation {
            Some(&mut Orientation::Rotation(ref mut rotation)) => Some(&mut rotation.angle),
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
            // A factor of nothing is no parameter.
            EndLoad => {
                let end = end?;
                let mut loads = end.force.iter().chain(&end.couple);
                let any = loads.any(|x| *x != 0.0);
                any.then_some(&mut end.load)
            }
            EndPosition(i) => match end?.position.get_mut(i)? {
                Component::Held(x) => Some(x),
                Component::Free => None,
            },
            EndAngle => angle(end?.orientation.as_mut()),
            ClampPosition(i) => clamp.position.get_mut(i),
            ClampAngle => angle(Some(&mut clamp.orientation)),
            Length => {
                // Tables hold arclengths, which end at the length.
                let stiffness = linear.iter().flat_map(|linear| linear.named());
                let mut all = stiffness.map(|(_, along)| along).chain(rod.rest.all());
                let tables = all.any(|along| !along.nodes().is_empty());
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
        }
    }
}
