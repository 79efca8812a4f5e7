//! First-order mass of rods, in units of the rod.

use crate::assembly::{Attachment, Joint, LightRod, Link};
use crate::error::{Quantity, Result};
use crate::full_mass::held_vibrations::Massive;
use crate::rod::{SectionMass, Wrench};
use crate::scene::{Rod, Scales, Scene};
use nalgebra::{Isometry3, Vector3};

/// Tolerance of the integration along a rod.
const ALONG: f64 = 1e-13;

impl Rod {
    /// Mean along the rod of the rotary inertia of the sections per length, about their centres and along their
    /// directors, in the scene's units. The source is the given value, the shape, or the stiffnesses of a homogeneous
    /// section; `None` if there is no source.
    ///
    /// # Errors
    /// A rod whose section law cannot be made.
    pub fn rotary_inertia(&self) -> Result<Option<[f64; 3]>> {
        let per_length = self.mass().unwrap_or(f64::NAN) / self.length;
        let both = |[a, b]: [f64; 2]| [a, b, a + b].map(|x| x * per_length);
        Ok(match (self.section_inertia, self.section.shape()) {
            (Some(given), _) => Some(given),
            (None, Some(shape)) => {
                let area = shape.area(self.length).integral();
                let moments = shape.second_moments(self.length);
                Some(both(moments.map(|moment| moment.integral() / area)))
            }
            (None, None) => {
                let law = self.backbone()?.law().clone();
                let rigid = law.rigid();
                let tangent = law.free(0.0, &law.unloaded(0.0)?)?.tangent;
                let known = !(rigid[0] || rigid[1] || rigid[5]);
                known.then(|| both([0, 1].map(|k| tangent[(k, k)] / tangent[(5, 5)])))
            }
        })
    }

    /// [`Rod::rotary_inertia`] in the library's units.
    ///
    /// # Errors
    /// A rod whose section law cannot be made.
    pub(super) fn rotary_over_unit(&self, scales: &Scales) -> Result<Option<Vector3<f64>>> {
        let found = self.rotary_inertia()?;
        Ok(found.map(|rotary| Vector3::from(rotary) / (scales.mass * scales.length)))
    }
}

/// Mass and rotary inertia of the sections, in the library's units. An unknown rotary inertia counts as zero.
///
/// # Errors
/// A rod whose section law cannot be made.
fn sections(rod: &Rod, mass: f64, scales: &Scales) -> Result<SectionMass> {
    let rotary = rod.rotary_over_unit(scales)?.unwrap_or_default();
    Ok(SectionMass { mass, rotary })
}

/// The section masses of a rod with first-order inertia, in the library's units; `None` for every other rod.
///
/// # Errors
/// A rod whose mass is not known.
pub(super) fn first_order_rod(rod: &Rod, scales: &Scales) -> Result<Option<LightRod>> {
    if !rod.is_light() {
        return Ok(None);
    }
    Ok(Some(LightRod {
        sections: sections(rod, rod.known_mass_over_unit(scales)?, scales)?,
        followed: false,
    }))
}

impl Rod {
    /// The rod with its mass and friction, where `rod` is its form in the library; `None` if the mass is unknown.
    ///
    /// # Errors
    /// As [`Rod::viscoelastic`].
    pub(crate) fn massive(
        &self,
        rod: &crate::rod::Rod,
        scales: &Scales,
    ) -> Result<Option<Massive>> {
        let Some(mass) = self.mass_over_unit(scales) else {
            return Ok(None);
        };
        let friction = match &self.damping {
            None => None,
            Some(_) => Some(self.viscoelastic()?.law_in_units(scales.measures()).rate),
        };
        let sections = sections(self, mass, scales)?;
        // A rod of a motion or of an assembly already has the variation of its mass, seen from the base of the rod.
        let along = rod.mass_along().cloned().or_else(|| self.mass_along());
        let rod = rod.clone().with_mass_along(along);
        Massive::new(&rod, friction, sections).map(Some)
    }
}

/// The rod of a scene of statics, in units of its length, stiffness and own mass.
pub(crate) struct StaticRod {
    /// The rod with its mass.
    pub massive: Massive,
    /// The rod between its clamp and its end, held in the equilibrium pose.
    pub link: Link,
    /// Chart point of the equilibrium.
    pub chart: Wrench,
    /// The units, measured in the scene's.
    pub scales: Scales,
}

impl Scene {
    /// The rod of a scene of statics under this base wrench, its end held in place. The end is free to turn if its
    /// orientation is free and no couple acts. `None` if the mass is unknown.
    ///
    /// # Errors
    /// As [`Scene::problem`].
    pub(crate) fn standing_rod(&self, base: &Wrench) -> Result<Option<StaticRod>> {
        let (Some(mass), problem) = (self.rod.mass(), self.problem()?) else {
            return Ok(None);
        };
        let scales = Scales::new(self.rod.length, problem.rod().reference_stiffness(), mass);
        let rod = problem.rod().measured(scales.measures());
        let rod = rod.with_mass_along(self.rod.mass_along());
        let Some(massive) = self.rod.massive(&rod, &scales)? else {
            return Ok(None);
        };
        let end = self.end()?;
        let turns = end.orientation.is_none() && end.applied_couple() == [0.0; 3];
        let joint = if turns { Joint::Ball } else { Joint::Weld };
        let chart = problem.rod().inward(base);
        let ground = Attachment::ground(Isometry3::identity());
        let load = if !self.is_loaded_along() {
            None
        } else {
            let back = problem.rod().clamp_pose().rotation.inverse();
            let unit = scales.inward(Quantity::Distributed, 1.0);
            Some(self.load_along()?.mapped(|f| back * f * unit))
        };
        let tied = |to: Isometry3<f64>| -> Result<Link> {
            let link = Link::new(rod.clone(), ground.clone(), Attachment::ground(to), joint);
            match &load {
                Some(load) => link.with_distributed(load.clone()),
                None => Ok(link),
            }
        };
        let pose = tied(Isometry3::identity())?.end(&chart, ALONG)?.pose;
        Ok(Some(StaticRod {
            massive,
            link: tied(pose)?,
            chart,
            scales,
        }))
    }
}
