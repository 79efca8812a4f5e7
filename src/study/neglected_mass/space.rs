//! Mass effects of rods in space at rest, single or in assemblies.

use super::{BouncePassed, BouncingRod, MassEffect, PassedFold, RodMass};
use crate::assembly::{Assembly, Configuration, Link};
use crate::error::{Quantity, Result};
use crate::full_mass::held_vibrations::{Massive, fold_form, held_modes};
use crate::motion::{Bounce, LightInSpace, Snap};
use crate::rod::Wrench;
use crate::scene::{AssemblySetup, Scales, Scene};
use crate::study::modes::resting;

/// Tolerance of the integration along the rods.
pub(super) const ALONG: f64 = 1e-13;

/// A rod of known mass.
#[derive(Debug, Clone)]
struct NeglectedRod {
    massive: Massive,
    /// Entry of the record, without its numbers.
    told: RodMass,
}

/// Rods of known mass in equilibrium under the loads at t = 0.
#[derive(Debug, Clone)]
pub(in crate::study) struct RodsAtRest {
    assembly: Assembly,
    now: Configuration,
    /// By index of the rod; `None` for unknown mass.
    rods: Vec<Option<NeglectedRod>>,
    time: f64,
    /// Mass effects of the rods.
    pub mass: MassEffect,
}

/// Mass effects of the rod of a static scene under this base wrench, with its end fixed. `None` if the mass is
/// unknown, or no vibrations are found.
pub(in crate::study) fn standing(scene: &Scene, base: &Wrench) -> Option<MassEffect> {
    let rod = scene.standing_rod(base).ok()??;
    let point = rod.link.point(0.0, &[], &rod.chart, ALONG).ok()?;
    let modes = held_modes(&rod.massive, &rod.link, &rod.chart, &point, 1).ok()?;
    let mode = modes.first()?;
    Some(MassEffect {
        frequency_shift: None,
        rods: vec![RodMass {
            rod: None,
            eps: None,
            frequency: mode
                .frequency()
                .map(|omega| rod.scales.outward(Quantity::Rate, omega)),
            decay: Some(rod.scales.outward(Quantity::Rate, mode.decay)),
            followed: false,
        }],
    })
}

impl RodsAtRest {
    /// The rod of a scene in space; `None` if its mass is unknown, its clamp moves, or no equilibrium is found.
    pub fn single(scene: &Scene) -> Option<Self> {
        if scene.clamp.motion.is_some() || scene.rod.mass().is_none() {
            return None;
        }
        let found = resting(&scene.frozen_at_start().ok()?).ok()?;
        let (assembly, now) = found.at;
        Self::new(scene, assembly, now, &scene.scales().ok()?).ok()
    }

    /// The rods of an assembly; `None` if no mass is known, or no equilibrium is found.
    pub fn assembly(scene: &Scene, setup: &AssemblySetup) -> Option<Self> {
        let given = scene.assembly()?;
        if given.rods.iter().all(|rod| rod.rod.mass().is_none()) {
            return None;
        }
        let now = setup.equilibrium().ok()?.now;
        Self::new(scene, setup.assembly.clone(), now, &setup.scales).ok()
    }

    /// Mass effects about an equilibrium in library units; `scales` lead to the units of the scene.
    pub fn new(
        scene: &Scene,
        assembly: Assembly,
        now: Configuration,
        scales: &Scales,
    ) -> Result<Self> {
        let rods: Vec<Option<NeglectedRod>> = (0..assembly.links().len())
            .map(|k| {
                // Joints with axes change the vibrations of a rod.
                if assembly.is_jointed(k) {
                    return Ok(None);
                }
                let rod = scene.rod_of(k);
                let Some(massive) = rod.massive(assembly.links()[k].rod(), scales)? else {
                    return Ok(None);
                };
                Ok(Some(NeglectedRod {
                    massive,
                    told: RodMass {
                        rod: assembly.name_of_rod(k).map(str::to_owned),
                        eps: scene.mass_over_lightest_body(k),
                        frequency: None,
                        decay: None,
                        followed: rod.is_light(),
                    },
                }))
            })
            .collect::<Result<_>>()?;
        let mut resting = Self {
            mass: MassEffect {
                frequency_shift: None,
                rods: Vec::new(),
            },
            assembly,
            now,
            rods,
            time: scales.time,
        };
        resting.mass = MassEffect {
            frequency_shift: resting.shift(),
            rods: (0..resting.rods.len())
                .filter_map(|k| resting.held(k))
                .collect(),
        };
        Ok(resting)
    }

    /// The single rod, as a light rod whose equilibria are followed; `None` under loads without a potential, and for a
    /// section law in time.
    pub fn light(&self) -> Option<LightInSpace> {
        match self.assembly.links() {
            [link] if !(link.has_turning() || link.varies_in_time()) => {
                Some(LightInSpace::new(link))
            }
            _ => None,
        }
    }

    /// Relative change of the lowest frequency.
    fn shift(&self) -> Option<f64> {
        let (assembly, now) = (&self.assembly, &self.now);
        let left_out = assembly.is_followed(0.0) || assembly.has_joints();
        if left_out || assembly.index(0.0, now, ALONG).ok()? > 0 {
            return None;
        }
        let modes = assembly.modes(now, ALONG).ok()?;
        let rods = self.rods.iter();
        let masses: Vec<_> = rods
            .map(|rod| rod.as_ref().map(|rod| rod.massive.sections))
            .collect();
        modes.shift_by_rods(assembly, now, &masses, ALONG)
    }

    /// Vibration of rod `k` with fixed ends.
    fn held(&self, k: usize) -> Option<RodMass> {
        let rod = self.rods[k].as_ref()?;
        let (link, q) = (&self.assembly.links()[k], &self.now.charts[k]);
        let point = link.point(0.0, &self.now.bodies, q, ALONG).ok();
        let modes = point.and_then(|point| held_modes(&rod.massive, link, q, &point, 1).ok());
        let mode = modes.and_then(|modes| modes.first().copied());
        Some(RodMass {
            frequency: mode.and_then(|mode| Some(mode.frequency()? / self.time)),
            decay: mode.map(|mode| mode.decay / self.time),
            ..rod.told.clone()
        })
    }

    /// Normal form at a snap, or at a fold passed by a rod with friction or mass. `None` if the mass of the rod is
    /// unknown, or the fold has no normal form.
    pub fn passed(&self, snap: &Snap) -> Option<PassedFold> {
        let now = snap.moving.as_ref()?;
        let link = self.assembly.links().get(snap.rod)?;
        self.form(snap, now, link, now.charts.get(snap.rod)?)
    }

    /// Bounce of a rod; `None` if its mass is unknown.
    pub fn bounced(&self, bounce: &Bounce) -> Option<BouncePassed> {
        let rod = self.rods.get(bounce.rod)?.as_ref()?;
        let of = BouncingRod {
            name: rod.told.rod.clone(),
            mass: rod.massive.sections.mass,
            length: self.assembly.links()[bounce.rod].rod().length(),
            // Rods that bounce have no friction.
            eta: 0.0,
        };
        Some(BouncePassed::new(bounce, of, self.time))
    }

    /// Normal form at a fold of the light rod that accompanies one of an assembly ([`LightInSpace::in_assembly`]).
    pub fn passed_alone(&self, snap: &Snap) -> Option<PassedFold> {
        let now = snap.moving.as_ref()?;
        let link = self.assembly.links().get(snap.rod)?.alone();
        self.form(snap, now, &link, now.charts.first()?)
    }

    fn form(
        &self,
        snap: &Snap,
        now: &Configuration,
        link: &Link,
        q: &Wrench,
    ) -> Option<PassedFold> {
        let rod = self.rods.get(snap.rod)?.as_ref()?;
        let point = link.point(snap.t, &now.bodies, q, ALONG).ok()?;
        let (form, eta) = fold_form(&rod.massive, link, q, &point).ok()?;
        Some(PassedFold {
            rod: rod.told.rod.clone(),
            form,
            eta,
            eps: rod.massive.sections.mass,
        })
    }
}
