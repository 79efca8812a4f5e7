//! The rod of a scene: its section, friction and memory.

use super::{Section, section::flattened};
use crate::section::{BarrierTerm, Rest};
use crate::{Error, Result};
use serde::Serialize;
use serde::ser::{SerializeMap, Serializer};

/// A rod without mass, clamped at its base.
///
/// In the plane ([`Model::Elastica`]) it neither shears nor stretches and is straight when unloaded, along +x of its clamp. In
/// space ([`Model::Cosserat`]) it has directors d1, d2, d3; unloaded, without rest strains, it runs along d3.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct Rod {
    /// The rod model.
    pub model: Model,
    /// Length L > 0 of the unloaded rod.
    pub length: f64,
    /// What it is made of, if the section is a [`Section::Profile`].
    #[serde(skip_serializing_if = "Option::is_none")]
    pub material: Option<Material>,
    /// Which way a rectangle bends in the plane; default [`Bends::Weak`].
    #[serde(skip_serializing_if = "Bends::is_weak")]
    pub bends: Bends,
    /// The section law; with Maxwell branches that after a long time.
    #[serde(flatten, serialize_with = "flattened")]
    pub section: Section,
    /// `[rod.rest]`: strains without load; only in space.
    pub rest: Rest,
    /// Internal friction; `None`: elastic.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub damping: Option<Damping>,
    /// Maxwell branches (Prony series), at most 32, only with damping; default none.
    #[serde(skip_serializing_if = "Vec::is_empty")]
    pub relaxation: Vec<Maxwell>,
    /// A fixed number of strain nodes, 4..=400, only with damping; default chosen and adapted by the program.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub nodes: Option<usize>,
}

impl Rod {
    /// EI of a rod in the plane.
    ///
    /// # Errors
    /// A rod in space.
    pub fn bending_stiffness(&self) -> Result<f64> {
        match (&self.section, self.material) {
            (Section::Bending(stiffness), _) => Ok(*stiffness),
            (Section::Profile(profile), Some(material)) if self.model == Model::Elastica => {
                let [a, b] = profile.shape.second_moments();
                Ok(material.young
                    * match self.bends {
                        Bends::Weak => a.min(b),
                        Bends::Strong => a.max(b),
                    })
            }
            _ => Err(Error::domain(
                "a rod in space has no single bending stiffness; one in the plane is model = \"elastica\"",
            )),
        }
    }

    /// The mass of the rod, if its material has a density and its section a shape.
    pub fn mass(&self) -> Option<f64> {
        let Section::Profile(profile) = &self.section else {
            return None;
        };
        Some(self.material?.density? * profile.shape.area() * self.length)
    }
}

/// What a rod is made of: an isotropic elastic material.
#[derive(Debug, Clone, Copy, PartialEq, Serialize)]
pub struct Material {
    /// Young's modulus > 0, force per area.
    #[serde(rename = "E")]
    pub young: f64,
    /// Poisson's ratio in (-1, 0.5].
    #[serde(rename = "nu", skip_serializing_if = "Option::is_none")]
    pub poisson: Option<f64>,
    /// Shear modulus > 0, force per area. In space this or Poisson's ratio is given.
    #[serde(rename = "G", skip_serializing_if = "Option::is_none")]
    pub shear: Option<f64>,
    /// Density > 0, mass per volume.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub density: Option<f64>,
}

impl Material {
    /// Spring steel: E = 200 GPa, nu = 0.30, 7850 kg/m^3.
    pub const STEEL: Self = Self::named(200e9, 0.30, 7850.0);
    /// Aluminium alloys: E = 70 GPa, nu = 0.33, 2700 kg/m^3.
    pub const ALUMINIUM: Self = Self::named(70e9, 0.33, 2700.0);
    /// Nitinol while austenitic: E = 75 GPa, nu = 0.33, 6450 kg/m^3.
    pub const NITINOL: Self = Self::named(75e9, 0.33, 6450.0);
    /// PET film: E = 2.8 GPa, nu = 0.40, 1380 kg/m^3.
    pub const PET: Self = Self::named(2.8e9, 0.40, 1380.0);
    /// A silicone rubber: E = 1 MPa, nu = 0.49, 1100 kg/m^3.
    pub const SILICONE: Self = Self::named(1e6, 0.49, 1100.0);

    const fn named(young: f64, poisson: f64, density: f64) -> Self {
        Self {
            young,
            poisson: Some(poisson),
            shear: None,
            density: Some(density),
        }
    }
}

/// Which way the rectangle of a planar rod bends.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default, Serialize)]
#[serde(rename_all = "lowercase")]
pub enum Bends {
    /// About its longer side: a strip that lies flat.
    #[default]
    Weak,
    /// About its shorter side.
    Strong,
}

impl Bends {
    fn is_weak(&self) -> bool {
        *self == Self::Weak
    }
}

/// The rod models.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize)]
#[serde(rename_all = "lowercase")]
pub enum Model {
    /// The planar elastica; at rest and without friction in closed form.
    Elastica,
    /// The Cosserat rod in space.
    Cosserat,
}

/// Numbers over the strains (u1, u2, u3, v1, v2, v3): a symmetric matrix. Rows and columns of strains that the section
/// holds rigid have no effect.
#[derive(Debug, Clone, PartialEq)]
pub enum StrainMatrix {
    /// That of bending in the plane alone: a number; only in the plane.
    Bending(f64),
    /// Its diagonal: an array of six numbers.
    Diagonal([f64; 6]),
    /// By rows: an array of six arrays.
    Full(Box<[[f64; 6]; 6]>),
    /// So many times the stiffness of the section at its unloaded strains: `{ proportional = factor }`.
    Proportional(f64),
}

impl StrainMatrix {
    /// The rows; `None` if it is in proportion to the section.
    pub fn rows(&self) -> Option<[[f64; 6]; 6]> {
        let mut rows = [[0.0; 6]; 6];
        match self {
            Self::Bending(x) => rows[0][0] = *x,
            Self::Diagonal(diagonal) => (0..6).for_each(|i| rows[i][i] = diagonal[i]),
            Self::Full(full) => rows = **full,
            Self::Proportional(_) => return None,
        }
        Some(rows)
    }

    /// Every entry (i, j) times `entry(i, j)`, a factor of proportionality times `factor`.
    pub(super) fn scaled(&self, entry: impl Fn(usize, usize) -> f64, factor: f64) -> Self {
        match self {
            Self::Bending(x) => Self::Bending(x * entry(0, 0)),
            Self::Diagonal(diagonal) => {
                Self::Diagonal(std::array::from_fn(|i| diagonal[i] * entry(i, i)))
            }
            Self::Full(rows) => {
                let row = |i: usize| std::array::from_fn(|j| rows[i][j] * entry(i, j));
                Self::Full(Box::new(std::array::from_fn(row)))
            }
            Self::Proportional(x) => Self::Proportional(x * factor),
        }
    }

    /// Every number of it.
    pub(super) fn numbers(&self) -> Vec<f64> {
        match self {
            Self::Diagonal(diagonal) => diagonal.to_vec(),
            Self::Full(rows) => rows.as_flattened().to_vec(),
            Self::Bending(x) | Self::Proportional(x) => vec![*x],
        }
    }
}

impl Serialize for StrainMatrix {
    fn serialize<S: Serializer>(&self, serializer: S) -> std::result::Result<S::Ok, S::Error> {
        match self {
            Self::Bending(x) => x.serialize(serializer),
            Self::Diagonal(diagonal) => diagonal.serialize(serializer),
            Self::Full(rows) => rows.serialize(serializer),
            Self::Proportional(factor) => {
                let mut table = serializer.serialize_map(Some(1))?;
                table.serialize_entry("proportional", factor)?;
                table.end()
            }
        }
    }
}

/// Internal friction, w = dW/de + D(e, e_t) (AMV (2.20)); in the plane of the couple alone, m = EI theta' + D(theta'_t).
///
/// In a scene the matrix H alone, or a table: `{ proportional = 0.05, exponent = 0.5, rate = 1.0 }`,
/// `{ proportional = 0.05, barrier = { strength = 0.1, half_widths = [0.05, 0.05] } }`; with `viscosity` in place of
/// `proportional`, H is any matrix, in the plane a number.
#[derive(Debug, Clone, PartialEq)]
pub struct Damping {
    /// H, stiffness times time, positive definite in the strains that are not rigid;
    /// [`StrainMatrix::Proportional`] is a time > 0.
    pub viscosity: StrainMatrix,
    /// How D follows from H.
    pub law: FrictionLaw,
}

impl Damping {
    /// eta, stiffness times time, of a planar rod of this bending stiffness; NaN in space.
    pub fn viscosity(&self, bending_stiffness: f64) -> f64 {
        match self.viscosity {
            StrainMatrix::Bending(viscosity) => viscosity,
            StrainMatrix::Proportional(time) => time * bending_stiffness,
            StrainMatrix::Diagonal(_) | StrainMatrix::Full(_) => f64::NAN,
        }
    }
}

/// How friction depends on strains and rates.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum FrictionLaw {
    /// Kelvin-Voigt, D = H e_t.
    Linear,
    /// D = H e_t (1 + e_t.K e_t/(B rate^2))^((exponent - 1)/2), H in proportion to K, the stiffness of the section at its
    /// unloaded strains, and B the reference bending stiffness of the rod
    /// ([`Rod::reference_stiffness`](crate::rod::Rod::reference_stiffness)); for flexure alone
    /// eta u_t (1 + (u_t/rate)^2)^((exponent - 1)/2).
    Power(PowerLaw),
    /// D = H e_t and friction that is infinite at total compression (AMV (2.40), (2.41)); only in space.
    Barrier(BarrierTerm),
}

/// Friction that grows with a power of the rate: linear below `rate`, as rate^exponent above it.
#[derive(Debug, Clone, Copy, PartialEq, Serialize)]
pub struct PowerLaw {
    /// In [0.1, 10]; 1 is Kelvin-Voigt, less is shear thinning.
    pub exponent: f64,
    /// Rate of the curvature > 0 at which the power sets in, 1/(length times time).
    pub rate: f64,
}

impl Serialize for Damping {
    fn serialize<S: Serializer>(&self, serializer: S) -> std::result::Result<S::Ok, S::Error> {
        if self.law == FrictionLaw::Linear {
            return self.viscosity.serialize(serializer);
        }
        let mut table = serializer.serialize_map(None)?;
        match &self.viscosity {
            StrainMatrix::Proportional(time) => table.serialize_entry("proportional", time)?,
            matrix => table.serialize_entry("viscosity", matrix)?,
        }
        match self.law {
            FrictionLaw::Linear => {}
            FrictionLaw::Power(PowerLaw { exponent, rate }) => {
                table.serialize_entry("exponent", &exponent)?;
                table.serialize_entry("rate", &rate)?;
            }
            FrictionLaw::Barrier(barrier) => table.serialize_entry("barrier", &barrier)?,
        }
        table.end()
    }
}

/// A Maxwell branch, a spring in series with a dashpot beside the section: with z the strain of its dashpot it adds
/// E (e - z) to the resultants.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct Maxwell {
    /// E, positive semidefinite in the strains that are not rigid; [`StrainMatrix::Proportional`] is a number >= 0.
    pub stiffness: StrainMatrix,
    /// Its relaxation time > 0.
    pub time: f64,
}
