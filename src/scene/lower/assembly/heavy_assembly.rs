//! Assemblies with the full mass of their rods.

use super::super::heavy::{heavy_law_in_space, turning_on, unit_point_mass};
use super::{AssemblySetup, GUESS_TOLERANCE, attachment, guide, vector};
use crate::assembly::{Body, Configuration};
use crate::error::{Error, Quantity, Result};
use crate::full_mass::assembly::{HeavyAssembly, HeavyLink, Tie};
use crate::full_mass::frames::Curve;
use crate::full_mass::rod::{HeavyRod, RodDescription};
use crate::motion::full_mass::{HeavyStart, RodStart, heavy_motion};
use crate::motion::{Motion, Nodes, Options};
use crate::scene::{AssemblyScene, LoadAlong, Rod, Scales, Scene, Site};
use crate::section::Strain;
use nalgebra::UnitQuaternion;

/// The assembly with the full mass of its rods, those with a free end last; `None` if no mass counts in full.
pub(super) fn heavy(
    scene: &Scene,
    given: &AssemblyScene,
    scales: &Scales,
    carriers: &[Body],
) -> Result<Option<HeavyAssembly>> {
    if !scene.rod.is_heavy() {
        return Ok(None);
    }
    let gravity = vector(scales, Quantity::Acceleration, &scene.loads.gravity);
    let unit = scales.inward(Quantity::Distributed, 1.0);
    let link = |name: &str,
                rod: &Rod,
                load: Option<&LoadAlong>,
                (from, to): (&Site, Option<&Site>)|
     -> Result<HeavyLink> {
        let tie = |site: &Site| -> Result<Tie> {
            let on = attachment(given, site, scales)?;
            let guide = guide(&site.joint, on.clone(), scales)?;
            Ok(Tie {
                on,
                joint: site.joint.of_rod(),
                axes: guide.map_or(Vec::new(), |guide| guide.free_axes()),
            })
        };
        let made = || {
            let (law, mass, rotary) = heavy_law_in_space(rod, scales)?;
            let given = RodDescription {
                law: law.along(scales.inward(Quantity::Length, rod.length)),
                curve: Curve::Space,
                mass,
                rotary,
                along: rod.mass_along(),
                grain: unit_point_mass(gravity, None)?,
                distributed: {
                    let listed = rod.dead_forces()?;
                    let whole = match load {
                        Some(load) => load.on(rod.length)?.plus(&listed)?,
                        None => listed,
                    };
                    Some(whole.mapped(|f| f * unit)).filter(|load| !load.is_zero())
                },
                turning: turning_on(rod, scales, |couple| couple)?,
                body: None,
                diameter: rod.thickness().map(|d| scales.inward(Quantity::Length, d)),
            };
            Ok(HeavyLink {
                rod: HeavyRod::coarse(given)?,
                from: tie(from)?,
                to: to.map(tie).transpose()?,
            })
        };
        made().map_err(|why: Error| why.context(format!("the rod {name:?}")))
    };
    let held = given.rods.iter();
    let held = held.map(|rod| {
        let along = Some(&rod.distributed);
        link(&rod.name, &rod.rod, along, (&rod.from, Some(&rod.to)))
    });
    let free = given.free.iter();
    let free = free.map(|rod| link(&rod.name, &rod.rod, None, (&rod.from, None)));
    let links = held.chain(free).collect::<Result<_>>()?;
    let held = given.rods.iter().map(|rod| rod.name.clone());
    let free = given.free.iter().map(|rod| rod.name.clone());
    let names = held.chain(free).collect();
    HeavyAssembly::new(carriers.to_vec(), links).map(|made| Some(made.with_names(names)))
}

impl AssemblySetup {
    /// A run with the full mass of the rods, started from the configuration `start` of the massless rods.
    pub(super) fn heavy_motion<'a>(
        &self,
        heavy: &HeavyAssembly,
        start: &Configuration,
        scene: &Scene,
        mut options: Options,
    ) -> Result<Box<dyn Motion<'a> + 'a>> {
        if let Some(nodes) = scene.rod.nodes {
            options.nodes = Nodes::Fixed(nodes);
        }
        heavy_motion(heavy, &self.heavy_start(start)?, options)
    }

    /// Start of heavy rods from a configuration of massless ones: heavy rods settle to equilibrium, except when
    /// unloaded rods are let go.
    ///
    /// # Errors
    /// As [`AssemblySetup::shapes`].
    pub fn heavy_start<'a>(&'a self, start: &'a Configuration) -> Result<HeavyStart<'a>> {
        let bases = self.shapes(0.0, start, 1)?;
        let rods = bases.iter().enumerate().map(|(k, sections)| RodStart {
            base: sections
                .first()
                .map_or_else(UnitQuaternion::identity, |(_, pose)| pose.rotation),
            strain: Box::new(move |s| {
                let strain = self.strain_of(k, start, s);
                strain.unwrap_or(Strain::repeat(f64::NAN))
            }),
            relaxed: None,
            rate: Box::new(|_| Strain::zeros()),
            velocity: None,
        });
        let solids = self.assembly.solids().len();
        let joints = self.assembly.carriers().iter().zip(&start.bodies);
        let joints = joints.filter_map(|(carrier, place)| Some((carrier.joint()?, place)));
        let joints = joints.flat_map(|(joint, place)| joint.along_axes(&start.bodies, &place.pose));
        Ok(HeavyStart {
            bodies: start.bodies[..solids].to_vec(),
            rods: rods.collect(),
            joints: joints.collect(),
            settled: !self.unloaded,
            following: true,
        })
    }

    /// Strains of the massless rod k at s in [0, 1] from its `from`, in the assembly's units.
    fn strain_of(&self, k: usize, now: &Configuration, s: f64) -> Result<Strain> {
        let Some(link) = self.assembly.links().get(k) else {
            let rod = &self.assembly.free()[k - self.assembly.links().len()].rod();
            return rod.law().unloaded(s * rod.length());
        };
        let point = link.point(0.0, &now.bodies, &now.charts[k], GUESS_TOLERANCE)?;
        let s = if self.reversed[k] { 1.0 - s } else { s };
        let at = [s * link.rod().length()];
        let seen = link.with_base_rotation(&point.base.pose.rotation);
        let sections = seen.shape(&now.charts[k], &point.held(), &at, GUESS_TOLERANCE)?;
        let mut strain = sections
            .last()
            .map(|section| section.strain)
            .unwrap_or_default();
        if self.reversed[k] && !link.is_pinned() {
            strain[0] = -strain[0];
            strain[3] = -strain[3];
        }
        Ok(strain)
    }
}
