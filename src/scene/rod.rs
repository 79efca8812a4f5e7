//! The rod of a scene: its section, friction and memory.

use super::{Section, section::flattened};
use crate::section::Rest;
use crate::section::rate::{Damping, Maxwell, StrainMatrix};
use crate::{Error, Result};
use serde::Serialize;

/// A rod, clamped at its base; without inertia unless it is asked for.
///
/// In the plane ([`Model::Elastica`]) it neither shears nor stretches and is straight when unloaded, along +x of its clamp. In
/// space ([`Model::Cosserat`]) it has directors d1, d2, d3; unloaded, without rest strains, it runs along d3.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct Rod {
    /// The rod model.
    pub model: Model,
    /// Length L > 0 of the unloaded rod.
    pub length: f64,
    /// What it is made of, if the section is a [`Section::Outline`].
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
    pub relaxation: Vec<Maxwell<StrainMatrix>>,
    /// A fixed number of strain nodes, 4..=400, only with damping; default chosen and adapted by the program.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub nodes: Option<usize>,
    /// Mass > 0 of the whole rod; `None`: as material and section have it, see [`Rod::mass`].
    #[serde(skip_serializing_if = "Option::is_none")]
    pub mass: Option<f64>,
    /// What its mass does in a motion; by default [`Inertia::FirstOrder`] of a light elastic rod where that can be followed, else nothing,
    /// which is `None`.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub inertia: Option<Inertia>,
    /// True if the scene left that open, and it was chosen.
    #[serde(skip)]
    pub inertia_chosen: bool,
    /// Inertia > 0 of the sections per length about d1, d2, d3, in space; `None`: as shape, or axial stiffness, have it.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub section_inertia: Option<[f64; 3]>,
    /// How thick the rod is where it touches itself or another, >= 0, in elastic motions in space; 0: contacts are not looked for.
    /// `None`: as its section's shape has it.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub contact_diameter: Option<f64>,
}

impl Rod {
    /// EI of a rod in the plane.
    ///
    /// # Errors
    /// A rod in space.
    pub fn bending_stiffness(&self) -> Result<f64> {
        match (&self.section, self.material) {
            (Section::Bending(stiffness), _) => Ok(*stiffness),
            (Section::Outline(outline), Some(material)) if self.model == Model::Elastica => {
                let [a, b] = outline.shape.second_moments();
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

    /// How thick it is where it touches itself or another: the contact diameter, or the smallest size of the section's shape; `None`
    /// where contacts are not looked for.
    pub fn thickness(&self) -> Option<f64> {
        let shape = match &self.section {
            Section::Outline(outline) => Some(outline.shape),
            Section::Profile(profile) => Some(profile.shape),
            _ => None,
        };
        let thickness = self
            .contact_diameter
            .or(shape.map(|shape| shape.thickness()));
        thickness.filter(|d| *d > 0.0)
    }

    /// The mass of the rod: as it is given, or if its material has a density and its section a shape.
    pub fn mass(&self) -> Option<f64> {
        self.mass.or_else(|| self.mass_of_material())
    }

    /// True if all of its mass counts in a motion.
    pub fn is_heavy(&self) -> bool {
        self.inertia == Some(Inertia::Full)
    }

    /// True if its mass is followed to first order in a motion.
    pub fn is_light(&self) -> bool {
        self.inertia == Some(Inertia::FirstOrder)
    }

    fn mass_of_material(&self) -> Option<f64> {
        let Section::Outline(outline) = &self.section else {
            return None;
        };
        Some(self.material?.density? * outline.shape.area() * self.length)
    }
}

/// What a rod is made of: an isotropic elastic material. Beside [`section::Material`](crate::section::Material) it has a
/// density, and in the plane it may lack the second constant.
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

/// What the mass of a rod does in a motion.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize)]
#[serde(rename_all = "kebab-case")]
pub enum Inertia {
    /// Nothing: the rod is as light as one without mass.
    None,
    /// All of it: the rod is a continuum with kinetic energy and weight, and has vibrations of its own.
    Full,
    /// Kinetic energy and weight of the rod in equilibrium with its end (theory 2.9, 3.9).
    FirstOrder,
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
    /// A bar with mass in longitudinal motion.
    Bar,
}
