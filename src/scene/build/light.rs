//! The mass of rods that is followed to first order, in units of the rod.

use crate::assembly::LightRod;
use crate::error::{Error, Quantity, Result};
use crate::inertia::held::Massive;
use crate::rod::SectionMass;
use crate::scene::{Rod, Scales, Section};
use nalgebra::Vector3;

impl Rod {
    /// Inertia of the sections per length about their middle, along their directors, in the scene's units: as it is given, as the shape
    /// has it, or as the stiffnesses of a homogeneous section tell; None where nothing tells it.
    ///
    /// # Errors
    /// A rod whose section law cannot be made.
    pub fn rotary_inertia(&self) -> Result<Option<[f64; 3]>> {
        let per_length = self.mass().unwrap_or(f64::NAN) / self.length;
        let both = |[a, b]: [f64; 2]| [a, b, a + b].map(|x| x * per_length);
        let shape = match &self.section {
            Section::Outline(outline) => Some(outline.shape),
            Section::Profile(profile) => Some(profile.shape),
            _ => None,
        };
        Ok(match (self.section_inertia, shape) {
            (Some(given), _) => Some(given),
            (None, Some(shape)) => Some(both(shape.second_moments().map(|i| i / shape.area()))),
            (None, None) => {
                let law = self.unclamped()?.law().clone();
                let axial = law.rigid()[2];
                let tangent = law.free(0.0, &law.unloaded(0.0)?)?.tangent;
                (!axial).then(|| both([0, 1].map(|k| tangent[(k, k)] / tangent[(5, 5)])))
            }
        })
    }
}

/// What the sections of the rod weigh, in the library's units; None where its mass is not known. Sections of which nothing tells how they turn
/// have no inertia against that.
///
/// # Errors
/// A rod whose section law cannot be made.
fn sections(rod: &Rod, scales: &Scales) -> Result<Option<SectionMass>> {
    let Some(mass) = rod.mass() else {
        return Ok(None);
    };
    let rotary = rod.rotary_inertia()?.unwrap_or_default();
    let per_length = scales.unit(Quantity::Inertia) / scales.length;
    Ok(Some(SectionMass {
        mass: mass / scales.mass,
        rotary: Vector3::from(rotary) / per_length,
    }))
}

/// The rod, if its mass is to be followed, in the library's units.
///
/// # Errors
/// A rod whose mass is not known.
pub(super) fn light(rod: &Rod, scales: &Scales) -> Result<Option<LightRod>> {
    if !rod.is_light() {
        return Ok(None);
    }
    let sections = sections(rod, scales)?.ok_or_else(|| {
        Error::domain("rod.mass is missing: give it, or a material with a density and a shape")
    })?;
    Ok(Some(LightRod {
        sections,
        followed: false,
    }))
}

impl Rod {
    /// The rod with its mass and its friction, as the library has it in `rod`; None where its mass is not known.
    ///
    /// # Errors
    /// As [`Rod::viscoelastic`].
    pub(crate) fn massive(
        &self,
        rod: &crate::rod::Rod,
        scales: &Scales,
    ) -> Result<Option<Massive>> {
        let Some(sections) = sections(self, scales)? else {
            return Ok(None);
        };
        let friction = match &self.damping {
            None => None,
            Some(_) => Some(self.viscoelastic()?.measured(scales.measures()).rate),
        };
        Massive::new(rod, friction, sections).map(Some)
    }
}
