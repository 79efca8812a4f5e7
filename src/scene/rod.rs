//! The rod of a scene: its section, friction and memory.

use super::{Drive, RodLoad, Section, Tendon, section::flattened};
use crate::section::rate::{Damping, Maxwell, StrainMatrix};
use crate::section::{Centreline, Diagonal, MassAlong, Rest, Stiffness};
use crate::{Error, Result};
use serde::Serialize;

/// A rod, clamped at its base; without inertia unless the scene asks for inertia.
///
/// In the plane ([`Model::Elastica`]) the rod neither shears nor stretches and is straight when unloaded, along +x of
/// its clamp. In space ([`Model::Cosserat`]) it has directors d1, d2, d3; unloaded, without rest strains, it runs along
/// d3.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct Rod {
    /// The rod model.
    pub model: Model,
    /// Length L > 0 of the unloaded rod.
    pub length: f64,
    /// Material of a section that is a [`Section::Outline`].
    #[serde(skip_serializing_if = "Option::is_none")]
    pub material: Option<Material>,
    /// Bending direction of a rectangle in the plane; default [`Bends::Weak`].
    #[serde(skip_serializing_if = "Bends::is_weak")]
    pub bends: Bends,
    /// Section law; with Maxwell branches, the long-time law.
    #[serde(flatten, serialize_with = "flattened")]
    pub section: Section,
    /// `[rod.rest]`: strains without load; only in space.
    pub rest: Rest,
    /// The curve through points that gave the rest shape, if any.
    #[serde(skip)]
    pub centreline: Option<Centreline>,
    /// `[rod.drive]`: what is added to the rest strains; only in space, in statics.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub drive: Option<Drive>,
    /// `[[rod.tendon]]`: tendons, at most 16, only in space; default none.
    #[serde(rename = "tendon", skip_serializing_if = "Vec::is_empty")]
    pub tendons: Vec<Tendon>,
    /// Loads of `[[load]]` on the rod; default none.
    #[serde(skip)]
    pub loads: Vec<RodLoad>,
    /// Internal friction; `None`: elastic.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub damping: Option<Damping>,
    /// Maxwell branches (Prony series), at most 32, only with damping; default none.
    #[serde(skip_serializing_if = "Vec::is_empty")]
    pub relaxation: Vec<Maxwell<StrainMatrix>>,
    /// Fixed number of strain nodes, 4..=400, only with damping or [`Inertia::Full`]; by default chosen and adapted by
    /// the program.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub nodes: Option<usize>,
    /// Mass > 0 of the whole rod; `None`: from material and section, see [`Rod::mass`].
    #[serde(skip_serializing_if = "Option::is_none")]
    pub mass: Option<f64>,
    /// Treatment of the mass in a motion. `None`: without inertia. A light elastic rod has [`Inertia::FirstOrder`] by
    /// default where possible.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub inertia: Option<Inertia>,
    /// True if the scene left `inertia` open and the program chose it.
    #[serde(skip)]
    pub inertia_chosen: bool,
    /// Inertia > 0 of the sections per length about d1, d2, d3, in space; `None`: from the shape or the axial
    /// stiffness.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub section_inertia: Option<[f64; 3]>,
    /// Diameter >= 0 of the rod for contacts with itself or another rod, in elastic motions in space. 0: contacts are
    /// not sought. `None`: from the section's shape.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub contact_diameter: Option<f64>,
}

impl Rod {
    /// The unit of lengths and forces of bodies without rods: a rod of the length 1 and the stiffness 1.
    pub(super) fn unit() -> Self {
        Self {
            model: Model::Cosserat,
            length: 1.0,
            material: None,
            bends: Bends::default(),
            section: Section::Diagonal(Diagonal {
                bending: [1.0.into(), 1.0.into()],
                torsion: 1.0.into(),
                shear: Stiffness::Rigid,
                axial: Stiffness::Rigid,
            }),
            rest: Rest::default(),
            centreline: None,
            drive: None,
            tendons: Vec::new(),
            loads: Vec::new(),
            damping: None,
            relaxation: Vec::new(),
            nodes: None,
            mass: None,
            inertia: None,
            inertia_chosen: false,
            section_inertia: None,
            contact_diameter: None,
        }
    }

    /// EI of a rod in the plane.
    ///
    /// # Errors
    /// A rod in space.
    pub fn bending_stiffness(&self) -> Result<f64> {
        match (&self.section, self.material) {
            (Section::Bending(stiffness), _) => Ok(*stiffness),
            (Section::Outline(outline), Some(material)) if self.model == Model::Elastica => {
                let shape = outline.shape.uniform().ok_or_else(|| {
                    Error::domain("the shape of a planar rod is the same all along the rod")
                })?;
                let [a, b] = shape.second_moments();
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

    /// Diameter for contacts: the contact diameter, or the smallest size of the section's shape along the rod; `None`
    /// if contacts are not sought.
    pub fn thickness(&self) -> Option<f64> {
        let shape = self.section.shape();
        let thickness = self
            .contact_diameter
            .or(shape.map(|shape| shape.thickness(self.length)));
        thickness.filter(|d| *d > 0.0)
    }

    /// Variation of mass and rotary inertia along the rod; `None` for a rod without a shape, or of one shape.
    pub fn mass_along(&self) -> Option<MassAlong> {
        let shape = self.section.shape().filter(|s| s.uniform().is_none())?;
        Some(MassAlong::new(shape, self.length))
    }

    /// Mass of the rod: the given one, or density times volume if the material has a density and the section a shape.
    pub fn mass(&self) -> Option<f64> {
        self.mass.or_else(|| self.mass_of_material())
    }

    /// True if a motion includes the full mass of the rod.
    pub fn is_heavy(&self) -> bool {
        self.inertia == Some(Inertia::Full)
    }

    /// True if a motion includes the mass of the rod to first order.
    pub fn is_light(&self) -> bool {
        self.inertia == Some(Inertia::FirstOrder)
    }

    fn mass_of_material(&self) -> Option<f64> {
        let Section::Outline(outline) = &self.section else {
            return None;
        };
        let area = outline.shape.area(self.length).integral();
        Some(self.material?.density? * area * self.length)
    }
}

/// An isotropic elastic material. In addition to [`section::Material`](crate::section::Material) it has a density; in
/// the plane the second elastic constant is optional.
#[derive(Debug, Clone, Copy, PartialEq, Serialize)]
pub struct Material {
    /// Young's modulus > 0, force per area.
    #[serde(rename = "E")]
    pub young: f64,
    /// Poisson's ratio in (-1, 0.5].
    #[serde(rename = "nu", skip_serializing_if = "Option::is_none")]
    pub poisson: Option<f64>,
    /// Shear modulus > 0, force per area. A rod in space needs the shear modulus or Poisson's ratio.
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

/// Treatment of the mass of a rod in a motion.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize)]
#[serde(rename_all = "kebab-case")]
pub enum Inertia {
    /// None: the rod moves as one without mass.
    None,
    /// Full: the rod is a continuum with kinetic energy and weight, and vibrates.
    Full,
    /// First order: kinetic energy and weight of the rod in equilibrium with its end (theory 2.9, 3.9).
    FirstOrder,
}

/// Bending direction of the rectangular section of a planar rod.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default, Serialize)]
#[serde(rename_all = "lowercase")]
pub enum Bends {
    /// About the longer side: a strip lying flat.
    #[default]
    Weak,
    /// About the shorter side.
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
