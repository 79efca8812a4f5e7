//! Section of a rod in a scene: section law and rest strains.

use crate::body::History;
use crate::section::{
    Along, BarrierTerm, Diagonal, Profile, RestDrive, Shape, ShapeSettings, StrainName,
};
use serde::Serialize;
use serde::ser::{SerializeMap, Serializer};
use std::collections::BTreeMap;

/// A section law.
#[derive(Debug, Clone, PartialEq, Serialize)]
#[serde(untagged)]
pub enum Section {
    /// The bending stiffness EI > 0 of a planar rod, force times length squared: `rod.bending_stiffness`.
    Bending(f64),
    /// One stiffness per strain.
    Diagonal(Diagonal),
    /// A full matrix of stiffnesses.
    Full(Full),
    /// Shape of the cross-section and its own material.
    Profile(Profile<Along>),
    /// Shape of the cross-section; the material is `rod.material`.
    Outline(Outline),
    /// [`Diagonal`] with a barrier against total compression.
    Barrier(Barrier),
}

impl Section {
    /// True if shear and stretch are rigid: the arclength is that of the unloaded rod.
    pub fn is_inextensible(&self) -> bool {
        self.rigid()[3..].iter().all(|rigid| *rigid)
    }

    /// Shape of the section, if it has one.
    pub fn shape(&self) -> Option<&Shape<Along>> {
        match self {
            Self::Outline(outline) => Some(&outline.shape),
            Self::Profile(profile) => Some(&profile.shape),
            _ => None,
        }
    }

    /// Flags, in the order of [`StrainName`], of the strains held at their rest values.
    pub fn rigid(&self) -> [bool; 6] {
        match self {
            Self::Bending(_) => [false, false, false, true, true, true],
            Self::Diagonal(law) => law.rigid(),
            Self::Full(full) => StrainName::ALL.map(|name| full.rigid.contains(&name)),
            Self::Profile(Profile { set, .. }) | Self::Outline(Outline { set, .. }) => set.rigid(),
            Self::Barrier(law) => law.linear.rigid(),
        }
    }
}

/// Writes the section as `section`, or as `bending_stiffness` of a planar rod.
pub(super) fn flattened<S: Serializer>(
    section: &Section,
    serializer: S,
) -> Result<S::Ok, S::Error> {
    let name = match section {
        Section::Bending(_) => "bending_stiffness",
        _ => "section",
    };
    let mut table = serializer.serialize_map(Some(1))?;
    table.serialize_entry(name, section)?;
    table.end()
}

/// A full law, w = K (e - rest).
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct Full {
    /// K by rows, in the order of [`StrainName`]. Symmetric; positive definite in the strains that are not
    /// rigid. Rows and columns of rigid strains have no effect.
    pub stiffness: [[f64; 6]; 6],
    /// Strains held at their rest values, without repetition, in increasing order; neither both flexures nor all six.
    pub rigid: Vec<StrainName>,
}

/// A cross-section of `rod.material`; in the plane only the shape counts.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct Outline {
    /// Shape of the cross-section.
    #[serde(flatten, serialize_with = "measured")]
    pub shape: Shape<Along>,
    /// Shear factor, torsion constant and rigid strains that override those of the shape.
    #[serde(flatten)]
    pub set: ShapeSettings,
}

/// Writes a shape with the sizes that one measures: `circle = { diameter = .. }`.
fn measured<S: Serializer>(shape: &Shape<Along>, serializer: S) -> Result<S::Ok, S::Error> {
    let (name, sizes) = match shape.clone() {
        Shape::Circle { radius } => ("circle", vec![("diameter", radius.times(2.0))]),
        Shape::Tube {
            outer_radius,
            thickness,
        } => (
            "tube",
            vec![
                ("diameter", outer_radius.times(2.0)),
                ("thickness", thickness),
            ],
        ),
        Shape::Rectangle { width, height } => {
            ("rectangle", vec![("width", width), ("thickness", height)])
        }
    };
    let mut table = serializer.serialize_map(Some(1))?;
    table.serialize_entry(name, &sizes.into_iter().collect::<BTreeMap<_, _>>())?;
    table.end()
}

/// Section law with a barrier against total compression, see [`section::Barrier`](crate::section::Barrier). Its energy
/// tends to infinity as the inner side of a compressed, bent section shrinks to nothing (AMV (2.7), (2.26)).
#[derive(Debug, Clone, PartialEq, Serialize)]
#[serde(tag = "law", rename = "barrier")]
pub struct Barrier {
    /// The linear part.
    #[serde(flatten)]
    pub linear: Diagonal,
    /// The barrier.
    pub barrier: BarrierTerm,
}

/// Rest strains that are driven, as of muscles or a swelling rod: a shape along the rod times an amplitude.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct Drive {
    /// Strains per unit of amplitude.
    #[serde(flatten)]
    pub shape: RestDrive,
    /// The amplitude; default 1.
    #[serde(serialize_with = "super::tendon::number_or_table")]
    pub amplitude: History,
}
