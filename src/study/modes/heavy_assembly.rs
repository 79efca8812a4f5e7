//! Small motions of several rods with mass and of their bodies.

use super::assembled::{coordinates, is_simple, of_twists};
use super::heavy::{COUNT, StabilityVerdict, converged, stations_from};
use super::{BALANCED, Mode, NUDGE, SmallMotions, Station, ToSceneUnits};
use crate::error::{Error, Result};
use crate::full_mass::assembly::HeavyAssembly;
use crate::full_mass::statics::Vibration;
use crate::motion::full_mass::HeavyAssemblyStart;
use crate::scene::{AssemblySetup, HeavySpace, InitialShape, Scene};
use nalgebra::{DVector, Isometry3, Vector6};

/// Largest number of coordinates in a refinement.
const MOST: usize = 200;
/// Largest number of rigid motions of each body.
const RIGID: usize = 6;

/// An assembly with the start for its small motions.
struct AssemblyTask<'a> {
    given: HeavyAssembly,
    start: HeavyAssemblyStart<'a>,
    /// True if the start is the equilibrium under the loads.
    settled: bool,
    /// Frame of the assembly in the world, and its units.
    outward: ToSceneUnits<'a>,
    coordinates: Vec<String>,
}

/// The assembly at rest, with its vibrations.
struct AssemblyVibrations {
    assembly: HeavyAssembly,
    y: DVector<f64>,
    modes: Vec<Vibration>,
}

/// Small motions about the equilibrium under the loads at t = 0. A free assembly that starts from unloaded rods is
/// linearised about these.
pub(super) fn modes(scene: &Scene) -> Result<(SmallMotions, bool)> {
    let setup = AssemblySetup::new(scene)?;
    let given = setup
        .heavy()
        .ok_or_else(|| Error::domain("the rods have no inertia = \"full\""))?
        .standing_at(0.0);
    let light = &setup.assembly;
    let unloaded = matches!(scene.start.place, InitialShape::Rest { .. });
    // A free assembly started from unloaded rods rests in this shape.
    let settled = light.is_held() || !unloaded;
    let mut now = if settled {
        setup.start_equilibrium()?.now
    } else {
        setup.start()?.0
    };
    for body in &mut now.bodies {
        body.twist = Vector6::zeros();
    }
    let asked = AssemblyTask {
        start: HeavyAssemblyStart {
            settled,
            following: false,
            ..setup.heavy_start(&now)?
        },
        coordinates: coordinates(&given.carriers),
        given,
        settled,
        outward: ToSceneUnits {
            clamp: Isometry3::identity(),
            scales: &setup.scales,
        },
    };
    let (motions, _) = asked.described()?;
    Ok((motions, !settled || !unloaded))
}

/// Small motions of one rod on a fixed clamp whose body slides in a groove.
pub(super) fn in_groove(
    model: &HeavySpace,
    outward: ToSceneUnits<'_>,
) -> Result<Option<(SmallMotions, bool)>> {
    let Some(given) = model.assembly()? else {
        return Ok(None);
    };
    let asked = AssemblyTask {
        start: HeavyAssemblyStart {
            settled: true,
            following: false,
            ..model.assembly_start()?
        },
        coordinates: coordinates(&given.carriers),
        given,
        settled: true,
        outward,
    };
    let (motions, moved) = asked.described()?;
    Ok(Some((motions, model.settled || moved <= BALANCED)))
}

impl AssemblyTask<'_> {
    /// Small motions, and the distance of the strains at rest from the strains of the start.
    fn described(&self) -> Result<(SmallMotions, f64)> {
        let Self {
            given,
            start,
            settled,
            outward,
            ..
        } = self;
        let rods = given.links.iter().map(|link| &link.rod.given);
        let width = rods.map(|rod| (rod.breaks().len() + 1) * rod.law.active().len());
        let (found, change) = converged(
            (width.sum(), MOST),
            |nodes| at_nodes(given, start, nodes),
            |found| &found.modes,
        )?;
        let AssemblyVibrations { assembly, y, modes } = &found;
        if !*settled {
            rests(&found)?;
        }
        let scales = outward.scales;
        let carriers = &assembly.carriers;
        let conservative = carriers.iter().all(|body| body.is_conservative(0.0));
        let followed = carriers.iter().any(|body| body.is_followed(0.0));
        let damped = |link: &crate::full_mass::assembly::HeavyLink| link.rod.given.law.is_damped();
        let lossy = assembly.links.iter().any(damped) || !carriers.iter().all(is_simple);
        let eigenvalues = if lossy {
            Some(assembly.decaying(y, COUNT)?)
        } else {
            None
        };
        let judged = StabilityVerdict::new(modes, eigenvalues.as_deref(), conservative, followed);
        let mut list = Vec::new();
        for (mode, omega) in modes.iter().zip(&judged.frequencies) {
            let step = NUDGE / mode.shape.amax();
            let at = |by: f64| stations(assembly, &assembly.displaced(y, &mode.shape, by));
            let (before, after) = (at(-step)?, at(step)?);
            let rods = before.iter().zip(&after).map(|(before, after)| {
                let pairs = before.iter().zip(after);
                pairs
                    .map(|(a, b)| outward.rate([a, b], 2.0 * step))
                    .collect()
            });
            let twists = assembly.twists(y, &mode.shape).ok_or_else(shapeless)?;
            let mode = Mode {
                angular_frequency: omega / scales.time,
                shape: of_twists(carriers, &twists, outward),
                rods: rods.collect(),
            };
            list.push(mode.oriented());
        }
        let rods = stations(assembly, y)?;
        let rods = rods.iter();
        let motions = SmallMotions {
            mass: None,
            index: judged.index,
            stable: judged.stable,
            conservative: judged.conservative,
            coordinates: self.coordinates.clone(),
            modes: list,
            rigid: 0,
            change,
            eigenvalues: eigenvalues.map(|all| all.iter().map(|s| s / scales.time).collect()),
            creep: None,
            rods: rods
                .map(|rod| rod.iter().map(|at| outward.station(at)).collect())
                .collect(),
        };
        Ok((motions, self.moved(&found)))
    }

    fn moved(&self, found: &AssemblyVibrations) -> f64 {
        let rods = found.assembly.links.iter().zip(&self.start.rods);
        let each = rods.enumerate().map(|(k, (link, start))| {
            let nodes = link.rod.sections.grid.nodes().iter();
            let begun: Vec<_> = nodes.map(|s| (start.strain)(*s)).collect();
            let begun = link.rod.coordinates(&begun);
            let pairs = begun.iter().zip(found.assembly.strains(&found.y, k));
            pairs.fold(0.0, |most: f64, (a, b)| {
                most.max((a - b).abs() / (1.0 + b.abs()))
            })
        });
        each.fold(0.0, f64::max)
    }
}

fn at_nodes(
    given: &HeavyAssembly,
    start: &HeavyAssemblyStart<'_>,
    nodes: usize,
) -> Result<AssemblyVibrations> {
    let elements = given.links.iter();
    let elements = elements.map(|link| link.rod.given.breaks().len() + 1);
    let (assembly, y) = start.at_nodes(given, &vec![nodes; elements.sum()])?;
    let mut modes = assembly.vibrations(&y, COUNT + RIGID * given.carriers.len())?;
    let free = modes.iter().filter(|mode| mode.square == 0.0).count();
    modes.truncate(COUNT + free);
    Ok(AssemblyVibrations { assembly, y, modes })
}

/// Error if the loads strain the unloaded rods of a free assembly.
fn rests(found: &AssemblyVibrations) -> Result<()> {
    let strains = found.assembly.strained(&found.y, &found.modes)?;
    if strains <= BALANCED {
        Ok(())
    } else {
        Err(Error::domain(
            "nothing holds the bodies, and the loads strain the unloaded rods, so that these are no equilibrium to have small motions about: leave \
         rest = \"straight\" out, and the equilibrium under the loads is looked for; or leave out loads other than gravity",
        ))
    }
}

fn stations(assembly: &HeavyAssembly, y: &DVector<f64>) -> Result<Vec<Vec<Station>>> {
    let at = assembly.at(y).ok_or_else(shapeless)?;
    let rods = assembly.links.iter().zip(&at.rods).enumerate();
    rods.map(|(k, (link, moving))| stations_from(&link.rod, &at.base(k), &moving.strains))
        .collect()
}

fn shapeless() -> Error {
    Error::domain("the equilibrium has no shape")
}
