//! The section of a rod as a scene gives it: its law, and its strains without load.

use serde::Serialize;
use serde::ser::{SerializeMap, Serializer};

/// A section law.
#[derive(Debug, Clone, PartialEq, Serialize)]
#[serde(untagged)]
pub enum Section {
    /// The bending stiffness EI > 0 of a planar rod, force times length squared: `rod.bending_stiffness`.
    Bending(f64),
    /// Stiffnesses of each strain by itself.
    Diagonal(Diagonal),
    /// A full matrix of stiffnesses.
    Full(Full),
    /// From the shape of the cross-section and the material.
    Shaped(Shaped),
    /// From the shape of the cross-section and `rod.material`.
    Profile(Profile),
    /// [`Diagonal`] with a barrier against total compression.
    Barrier(Barrier),
}

impl Section {
    /// True if neither shear nor stretch is possible: the arclength is that of the unloaded rod.
    pub fn is_inextensible(&self) -> bool {
        self.rigid()[3..].iter().all(|rigid| *rigid)
    }

    /// Which strains, in the order of [`StrainName`], are held at their rest values.
    pub fn rigid(&self) -> [bool; 6] {
        let held = |shear: bool, axial: bool| [false, false, false, shear, shear, axial];
        let diagonal =
            |d: &Diagonal| held(d.shear == Stiffness::Rigid, d.axial == Stiffness::Rigid);
        match self {
            Self::Bending(_) => held(true, true),
            Self::Diagonal(law) => diagonal(law),
            Self::Full(full) => StrainName::ALL.map(|name| full.rigid.contains(&name)),
            Self::Shaped(shaped) => held(shaped.shear.is_some(), shaped.axial.is_some()),
            Self::Profile(profile) => held(profile.shear.is_some(), profile.axial.is_some()),
            Self::Barrier(law) => diagonal(&law.linear),
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

/// A number that is the same all along the rod, or varies with s.
#[derive(Debug, Clone, PartialEq, Serialize)]
#[serde(untagged)]
pub enum Along {
    /// Everywhere the same.
    Constant(f64),
    /// Piecewise linear.
    Table {
        /// Arclengths of the unloaded rod, growing, from 0 to L; at least 2.
        s: Vec<f64>,
        /// The value at each.
        values: Vec<f64>,
    },
    /// c0 + c1 x + c2 x^2 + ..., x = s/L.
    Polynomial {
        /// c0, c1, ...; from 1 to 16 of them.
        polynomial: Vec<f64>,
    },
}

impl Along {
    /// The value at arclength `s` of a rod of this length.
    pub fn at(&self, s: f64, length: f64) -> f64 {
        match self {
            Self::Constant(value) => *value,
            Self::Polynomial { polynomial } => {
                let x = s / length;
                polynomial.iter().rev().fold(0.0, |sum, c| sum * x + c)
            }
            Self::Table { s: nodes, values } => {
                let last = nodes.len().min(values.len()).saturating_sub(1);
                if last == 0 {
                    return values.first().copied().unwrap_or(f64::NAN);
                }
                let i = nodes.partition_point(|node| *node <= s).clamp(1, last);
                let part = (s - nodes[i - 1]) / (nodes[i] - nodes[i - 1]);
                (1.0 - part) * values[i - 1] + part * values[i]
            }
        }
    }

    fn is_table(&self) -> bool {
        matches!(self, Self::Table { .. })
    }

    /// The number, if it is the same all along the rod.
    pub fn constant(&self) -> Option<f64> {
        match self {
            Self::Constant(value) => Some(*value),
            _ => None,
        }
    }
}

/// A stiffness, or none: the strain is held at its rest value.
#[derive(Debug, Clone, PartialEq, Serialize)]
#[serde(rename_all = "lowercase")]
pub enum Stiffness<T> {
    /// Held.
    Rigid,
    /// Elastic.
    #[serde(untagged)]
    Elastic(T),
}

/// Stiffnesses of each strain by itself. Every number is > 0.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct Diagonal {
    /// Couple per flexure about d1 and d2, force times length squared.
    pub bending: [Along; 2],
    /// Couple per twist, force times length squared.
    pub torsion: Along,
    /// Force per shear along d1 and d2; default rigid (unshearable).
    pub shear: Stiffness<[Along; 2]>,
    /// Force per stretch; default rigid (inextensible).
    pub axial: Stiffness<Along>,
}

impl Diagonal {
    /// True if a stiffness is given by a table in s.
    pub(super) fn has_tables(&self) -> bool {
        let shear = match &self.shear {
            Stiffness::Elastic(shear) => shear.iter().any(Along::is_table),
            Stiffness::Rigid => false,
        };
        let axial = match &self.axial {
            Stiffness::Elastic(axial) => axial.is_table(),
            Stiffness::Rigid => false,
        };
        self.bending.iter().any(Along::is_table) || self.torsion.is_table() || shear || axial
    }
}

/// A full law, w = K (e - rest).
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct Full {
    /// K by rows, in the order of [`StrainName`]. Symmetric; positive definite in the strains that are not
    /// rigid. Rows and columns of rigid strains have no effect.
    pub stiffness: [[f64; 6]; 6],
    /// Strains held at their rest values, each once, in growing order; not all six.
    pub rigid: Vec<StrainName>,
}

/// The strains.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord, Serialize)]
#[serde(rename_all = "lowercase")]
pub enum StrainName {
    /// Flexure about d1.
    U1,
    /// Flexure about d2.
    U2,
    /// Twist.
    U3,
    /// Shear along d1.
    V1,
    /// Shear along d2.
    V2,
    /// Stretch.
    V3,
}

impl StrainName {
    /// All six, in order: `name as usize` is the place in (u1, u2, u3, v1, v2, v3).
    pub const ALL: [Self; 6] = [Self::U1, Self::U2, Self::U3, Self::V1, Self::V2, Self::V3];

    /// As it is written in a scene.
    pub fn as_str(self) -> &'static str {
        ["u1", "u2", "u3", "v1", "v2", "v3"][self as usize]
    }
}

/// A cross-section of a homogeneous isotropic material.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct Shaped {
    /// Its shape.
    #[serde(flatten)]
    pub shape: Shape,
    /// Young's modulus E > 0, force per area.
    pub young: f64,
    /// The other elastic constant.
    #[serde(flatten)]
    pub transverse: Transverse,
    /// Shear stiffness = factor * G * area, in (0, 1]; without it, that of the shape.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub shear_factor: Option<f64>,
    /// Torsional stiffness = G * constant, > 0, length to the fourth; without it, that of St Venant.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub torsion_constant: Option<f64>,
    /// `"rigid"`: unshearable.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub shear: Option<Rigid>,
    /// `"rigid"`: inextensible.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub axial: Option<Rigid>,
}

/// The word `"rigid"`.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize)]
#[serde(rename_all = "lowercase")]
pub enum Rigid {
    /// Held at its rest value.
    Rigid,
}

/// Shapes of a cross-section; every length > 0.
#[derive(Debug, Clone, PartialEq, Serialize)]
#[serde(tag = "shape", rename_all = "lowercase")]
pub enum Shape {
    /// A solid circle.
    Circle {
        /// Its radius.
        radius: f64,
    },
    /// A solid rectangle.
    Rectangle {
        /// Side along d1.
        width: f64,
        /// Side along d2.
        height: f64,
    },
    /// A round tube.
    Tube {
        /// Outer radius.
        outer_radius: f64,
        /// Thickness of the wall, < outer radius.
        thickness: f64,
    },
}

/// A cross-section of `rod.material`: in the plane its shape alone counts.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct Profile {
    /// Its shape.
    #[serde(flatten)]
    pub outline: Outline,
    /// As [`Shaped::shear_factor`].
    #[serde(skip_serializing_if = "Option::is_none")]
    pub shear_factor: Option<f64>,
    /// As [`Shaped::torsion_constant`].
    #[serde(skip_serializing_if = "Option::is_none")]
    pub torsion_constant: Option<f64>,
    /// `"rigid"`: unshearable.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub shear: Option<Rigid>,
    /// `"rigid"`: inextensible.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub axial: Option<Rigid>,
}

/// The shape of a cross-section by the sizes one measures; every length > 0.
#[derive(Debug, Clone, Copy, PartialEq, Serialize)]
#[serde(rename_all = "lowercase")]
pub enum Outline {
    /// A solid circle.
    Circle {
        /// Its diameter.
        diameter: f64,
    },
    /// A round tube.
    Tube {
        /// Outer diameter.
        diameter: f64,
        /// Thickness of the wall, less than half the diameter.
        thickness: f64,
    },
    /// A solid rectangle.
    Rectangle {
        /// Side along d1.
        width: f64,
        /// Side along d2.
        thickness: f64,
    },
}

impl Outline {
    /// As the library has it.
    pub fn shape(self) -> crate::section::Shape {
        use crate::section::Shape;
        match self {
            Self::Circle { diameter } => Shape::Circle {
                radius: 0.5 * diameter,
            },
            Self::Tube {
                diameter,
                thickness,
            } => Shape::Tube {
                outer: 0.5 * diameter,
                inner: 0.5 * diameter - thickness,
            },
            Self::Rectangle { width, thickness } => Shape::Rectangle {
                width,
                height: thickness,
            },
        }
    }
}

/// The elastic constant beside Young's modulus.
#[derive(Debug, Clone, Copy, PartialEq, Serialize)]
#[serde(rename_all = "snake_case")]
pub enum Transverse {
    /// Shear modulus G > 0, force per area.
    ShearModulus(f64),
    /// Poisson's ratio in (-1, 0.5].
    Poisson(f64),
}

impl Transverse {
    /// Shear modulus G: E / (2 (1 + nu)) if Poisson's ratio is given.
    pub fn shear_modulus(self, young: f64) -> f64 {
        match self {
            Self::ShearModulus(modulus) => modulus,
            Self::Poisson(ratio) => young / (2.0 * (1.0 + ratio)),
        }
    }
}

/// The law with a barrier: its energy tends to infinity as the rod is compressed so much that the inner side of
/// a bent section shrinks to nothing (AMV (2.7), (2.26)).
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct Barrier {
    /// [`LawName::Barrier`].
    pub law: LawName,
    /// The linear part.
    #[serde(flatten)]
    pub linear: Diagonal,
    /// The barrier.
    pub barrier: BarrierTerm,
}

/// Laws by name.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize)]
#[serde(rename_all = "lowercase")]
pub enum LawName {
    /// [`Barrier`].
    Barrier,
}

/// The barrier of [`Barrier`].
#[derive(Debug, Clone, Copy, PartialEq, Serialize)]
pub struct BarrierTerm {
    /// Size of its energy per length, a force > 0.
    pub strength: f64,
    /// Half widths of the cross-section along d1 and d2, >= 0.
    pub half_widths: [f64; 2],
}

/// Strains without load; all default to 0.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct Rest {
    /// Flexures about d1 and d2, per length.
    pub curvature: [Along; 2],
    /// Twist, radians per length.
    pub twist: Along,
}

impl Rest {
    /// True if a strain is given by a table in s.
    pub(super) fn has_tables(&self) -> bool {
        self.curvature.iter().any(Along::is_table) || self.twist.is_table()
    }
}

impl Default for Rest {
    fn default() -> Self {
        Self {
            curvature: [Along::Constant(0.0), Along::Constant(0.0)],
            twist: Along::Constant(0.0),
        }
    }
}
