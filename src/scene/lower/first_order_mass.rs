//! The mass of rods that is followed to first order, in units of the rod.

use crate::assembly::{Attachment, Joint, LightRod, Link};
use crate::error::{Error, Quantity, Result};
use crate::full_mass::held_vibrations::Massive;
use crate::rod::{SectionMass, Wrench};
use crate::scene::{Rod, Scales, Scene, Section};
use nalgebra::{Isometry3, Vector3};

/// Tolerance of the integration along a rod.
const ALONG: f64 = 1e-13;

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

/// A rod of a scene of statics as the library has it, in units of its length, stiffness and own mass.
pub(crate) struct StandingRod {
    /// The rod with its mass.
    pub massive: Massive,
    /// The rod from its clamp to where its end is, held there.
    pub link: Link,
    /// Its chart point.
    pub chart: Wrench,
    /// Its units in those of the scene.
    pub scales: Scales,
}

impl Scene {
    /// The rod of a scene of statics under this base wrench, its end held where it is: free to turn there if nothing turns it, and no couple acts on
    /// it. None where its mass is not known.
    ///
    /// # Errors
    /// As [`Scene::problem`].
    pub(crate) fn standing_rod(&self, base: &Wrench) -> Result<Option<StandingRod>> {
        let (Some(mass), problem) = (self.rod.mass(), self.problem()?) else {
            return Ok(None);
        };
        let scales = Scales::new(self.rod.length, problem.rod().reference_stiffness(), mass);
        let rod = problem.rod().measured(scales.measures());
        let Some(massive) = self.rod.massive(&rod, &scales)? else {
            return Ok(None);
        };
        let end = self.end()?;
        let turns = end.orientation.is_none() && end.applied_couple() == [0.0; 3];
        let joint = if turns { Joint::Ball } else { Joint::Weld };
        let chart = problem.rod().inward(base);
        let ground = Attachment::ground(Isometry3::identity());
        let load = match self.is_loaded_along() {
            false => None,
            true => {
                let back = problem.rod().clamp_pose().rotation.inverse();
                let unit = scales.inward(Quantity::Distributed, 1.0);
                Some(self.load_along()?.mapped(|f| back * f * unit))
            }
        };
        let tied = |to: Isometry3<f64>| -> Result<Link> {
            let link = Link::new(rod.clone(), ground.clone(), Attachment::ground(to), joint);
            match &load {
                Some(load) => link.with_distributed(load.clone()),
                None => Ok(link),
            }
        };
        let pose = tied(Isometry3::identity())?.end(&chart, ALONG)?.pose;
        Ok(Some(StandingRod {
            massive,
            link: tied(pose)?,
            chart,
            scales,
        }))
    }
}
