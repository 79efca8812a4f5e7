//! Small motions of rods without mass and their bodies in space.

use super::{
    BALANCED, INTERVALS, Mode, NUDGE, RelaxationRates, SmallMotions, Station, ToSceneUnits,
    frequencies,
};
use crate::assembly::{Assembly, AssemblyRoute, Configuration, HeavyBody, Mass};
use crate::error::Result;
use crate::math::se3::halves;
use crate::motion::viscoelastic::{SmallCreep, small_in_space};
use crate::scene::{AssemblySetup, ElasticSpace, InitialShape, Scales, Scene};
use crate::section::Strain;
use crate::study::neglected_mass::RodsAtRest;
use nalgebra::{Complex, DVector, Isometry3, Vector3, Vector6};

/// Tolerances of the equilibrium and of the integration along the rods.
const EQUILIBRIUM: f64 = 1e-11;
const ALONG: f64 = 1e-13;

/// A rod in space at rest with its body.
pub(in crate::study) struct AtRest {
    model: ElasticSpace,
    /// Assembly and equilibrium in the frame of the clamp and units of the rod.
    pub at: (Assembly, Configuration),
    /// True if [start] is the equilibrium.
    of_start: bool,
}

/// Equilibrium of a scene on a clamp at rest: [start] if it is an equilibrium, otherwise the one under the loads at t
/// = 0.
///
/// # Errors
/// No equilibrium found.
pub(in crate::study) fn resting(scene: &Scene) -> Result<AtRest> {
    // Two starts are no equilibria: given strains of a rod with friction, and unloaded strains under a distributed
    // load.
    let never = match &scene.start.place {
        InitialShape::Strain { strain } => !strain.is_unloaded() || scene.is_loaded_along(),
        InitialShape::Rest { .. } => scene.is_loaded_along(),
        _ => false,
    };
    let mut start = None;
    if !never {
        let model = ElasticSpace::new(scene)?;
        let (assembly, now) = model.assembly()?;
        let settles = matches!(scene.start.place, InitialShape::Settled { .. });
        start = (settles || balanced(&assembly, &now)?).then_some((model, assembly, now));
    }
    let of_start = start.is_some();
    let (model, assembly, mut now) = match start {
        Some(start) => start,
        None => {
            let mut settled = scene.clone();
            settled.start.place = InitialShape::Settled { settled: true };
            let model = ElasticSpace::new(&settled).map_err(|why| {
                why.context("[start] is no equilibrium under the loads at t = 0, and of theirs")
            })?;
            let (assembly, now) = model.assembly()?;
            (model, assembly, now)
        }
    };
    // Accept Newton's method only if it converges straight from the guess.
    if let Ok(found) = assembly.equilibrium(Some(&now), EQUILIBRIUM)
        && found.route == AssemblyRoute::Guess
    {
        now = found.now;
    }
    Ok(AtRest {
        model,
        at: (assembly, now),
        of_start,
    })
}

/// Small motions of a scene on a fixed clamp; `creeping` is the same scene with the friction of the rod.
pub(super) fn modes(scene: &Scene, creeping: &Scene) -> Result<(SmallMotions, bool)> {
    let AtRest {
        model,
        at: (assembly, now),
        of_start,
    } = resting(scene)?;
    let (clamp, scales) = (&model.common.clamp, &model.common.scales);
    let mut motions = match creeping.rod.damping {
        None => small_motions(&assembly, &now, clamp, scales)?,
        Some(_) => {
            let damped = with_friction(creeping, &model, &assembly, &now)?;
            described(&assembly, &now, (clamp, scales), Some(damped))?
        }
    };
    if motions.stable && creeping.rod.mass().is_some() {
        let scales = *scales;
        let resting = RodsAtRest::new(creeping, (assembly, now), &scales)?;
        motions.mass = Some(resting.mass);
    }
    Ok((motions, of_start))
}

/// Eigenvalues with the friction of the rod.
fn with_friction(
    scene: &Scene,
    model: &ElasticSpace,
    assembly: &Assembly,
    now: &Configuration,
) -> Result<SmallCreep> {
    let section = scene
        .viscoelastic()?
        .measured(model.common.scales.measures());
    let (link, q) = (&assembly.links()[0], &now.charts[0]);
    let point = link.point(0.0, &now.bodies, q, ALONG)?;
    let (link, held) = (
        link.with_base_rotation(&point.base.pose.rotation),
        point.held(),
    );
    let strains = |places: &[f64]| -> Result<Vec<Strain>> {
        let length = link.rod().length();
        let at: Vec<f64> = places.iter().map(|s| s * length).collect();
        let sections = link.shape(q, &held, &at, ALONG)?;
        Ok(sections.iter().map(|section| section.strain).collect())
    };
    let load = link.distributed();
    small_in_space(
        section,
        (scene.moving()?, load),
        &model.common.carried,
        &strains,
    )
}

/// Small motions of an assembly about its equilibrium under the loads at t = 0.
pub(super) fn of_assembly(scene: &Scene) -> Result<(SmallMotions, bool)> {
    let setup = AssemblySetup::new(scene)?;
    let now = setup.start_equilibrium()?.now;
    let world = Isometry3::identity();
    let mut motions = small_motions(&setup.assembly, &now, &world, &setup.scales)?;
    if motions.stable && !setup.is_heavy() {
        let resting = RodsAtRest::new(scene, (setup.assembly, now), &setup.scales)?;
        motions.mass = Some(resting.mass).filter(|mass| !mass.rods.is_empty());
    }
    // Bodies settle at the equilibrium unless [start] asks for unloaded rods.
    Ok((
        motions,
        !matches!(scene.start.place, InitialShape::Rest { .. }),
    ))
}

/// True if the rods' wrenches on the bodies balance the loads.
fn balanced(assembly: &Assembly, now: &Configuration) -> Result<bool> {
    let points = assembly.points(0.0, &now.bodies, &now.charts, ALONG)?;
    let left = assembly.balance(0.0, &now.bodies, &points).norm();
    let wrenches = assembly.wrenches(&now.bodies, &points);
    let all: f64 = wrenches.iter().map(|wrench| wrench.norm()).sum();
    let loads = assembly.carriers().iter().zip(&now.bodies);
    let loads: f64 = loads
        .map(|(carrier, place)| carrier.load(0.0, &place.pose).norm())
        .sum();
    Ok(left <= BALANCED * (all + loads) || left <= f64::EPSILON)
}

/// Small motions of an assembly about an equilibrium at t = 0. `clamp` maps its frame to the world, `scales` its
/// units to those of the record.
///
/// # Errors
/// As [`Assembly::modes`] and [`Assembly::eigenvalues`].
pub fn small_motions(
    assembly: &Assembly,
    now: &Configuration,
    clamp: &Isometry3<f64>,
    scales: &Scales,
) -> Result<SmallMotions> {
    described(assembly, now, (clamp, scales), None)
}

/// Small motions about an equilibrium; `damped`: eigenvalues of a rod with friction.
fn described(
    assembly: &Assembly,
    now: &Configuration,
    (clamp, scales): (&Isometry3<f64>, &Scales),
    damped: Option<SmallCreep>,
) -> Result<SmallMotions> {
    let modes = assembly.modes(now, ALONG)?;
    let followed = assembly.is_followed(0.0);
    // Stiffness below the tolerance of the equilibrium counts as neutral.
    let index = assembly.index(0.0, now, EQUILIBRIUM)?;
    let conservative = assembly.is_conservative(0.0);
    let creep = damped
        .as_ref()
        .map(|damped| RelaxationRates::new(damped, scales));
    let eigenvalues = match (damped, assembly.carriers().iter().all(is_simple)) {
        (Some(damped), _) => Some(damped.rates.body),
        (None, true) => None,
        (None, false) => Some(assembly.eigenvalues(now, ALONG)?),
    };
    let fastest = eigenvalues
        .iter()
        .flatten()
        .fold(0.0, |a: f64, s| a.max(s.norm()));
    let decaying = |s: &Complex<f64>| s.re <= 1e-8 * fastest;
    let held = || -> Result<usize> {
        let points = assembly.points(0.0, &now.bodies, &now.charts, ALONG)?;
        let rods = assembly.links().iter().zip(&now.charts).zip(&points);
        rods.map(|((link, q), point)| {
            let seen = link.with_base_rotation(&point.base.pose.rotation);
            seen.index(q, &point.held(), ALONG)
        })
        .sum()
    };
    let stable = match &eigenvalues {
        // With follower loads the symmetric part of the stiffness does not decide stability.
        Some(all) if followed => held()? == 0 && all.iter().all(decaying),
        Some(all) if !conservative => index == 0 && all.iter().all(decaying),
        _ => index == 0,
    };
    let outward = ToSceneUnits {
        clamp: *clamp,
        scales,
    };
    let stations = |now: &Configuration| -> Result<Vec<Vec<Station>>> {
        let rods = assembly.shapes(0.0, now, INTERVALS, ALONG)?;
        let rod = |rod: &Vec<crate::rod::RodSection>| {
            let each = rod.iter().map(|section| Station {
                position: section.position,
                directors: section.directors,
            });
            each.collect()
        };
        Ok(rods.iter().map(rod).collect())
    };
    let omegas = frequencies(&modes.squares, modes.neutral, index == 0);
    let mut list = Vec::new();
    // With follower loads only eigenvalues describe the motions, so no modes are made.
    let omegas = omegas.into_iter().enumerate();
    for (k, omega) in omegas.filter(|_| !followed) {
        let size = modes
            .charts
            .column(k)
            .amax()
            .max(modes.shapes.column(k).amax());
        let step = NUDGE / size;
        let at = |by: f64| {
            modes
                .displaced(assembly, now, k, by)
                .and_then(|now| stations(&now))
        };
        let (before, after) = (at(-step)?, at(step)?);
        let rods = before.iter().zip(&after).map(|(before, after)| {
            let pairs = before.iter().zip(after);
            pairs
                .map(|(a, b)| outward.rate([a, b], 2.0 * step))
                .collect()
        });
        let mode = Mode {
            angular_frequency: omega / scales.time,
            shape: in_world(assembly, now, modes.shapes.column(k).as_slice(), &outward),
            rods: rods.collect(),
        };
        list.push(mode.oriented());
    }
    Ok(SmallMotions {
        mass: None,
        index,
        stable,
        conservative,
        coordinates: coordinates(assembly.carriers()),
        rigid: assembly.freedoms().1 - modes.squares.len(),
        change: 0.0,
        modes: list,
        creep,
        eigenvalues: eigenvalues.map(|all| {
            // Treat rounding as zero.
            let zero = |x: f64| if x.abs() <= 1e-14 * fastest { 0.0 } else { x };
            let all = all
                .into_iter()
                .map(|s| Complex::new(zero(s.re), zero(s.im)));
            let upper = all.filter(|s| s.im >= 0.0);
            upper.map(|s| s / scales.time).collect()
        }),
        rods: stations(now)?
            .iter()
            .map(|rod| rod.iter().map(|at| outward.station(at)).collect())
            .collect(),
    })
}

/// True if only inertia and forces with a potential act on the body.
pub(super) fn is_simple(carrier: &HeavyBody) -> bool {
    carrier.is_conservative(0.0)
        && match carrier.mass() {
            Mass::Rigid(body) => !body.is_damped() && *body.rotor() == Vector3::zeros(),
            Mass::Point(body) => !body.is_damped(),
        }
}

/// Component names of a shape, prefixed by the name or number of the body if there are several.
pub(super) fn coordinates(carriers: &[HeavyBody]) -> Vec<String> {
    let several = carriers.len() > 1;
    let of = |(body, carrier): (usize, &HeavyBody)| {
        let prefix = match (carrier.name(), several) {
            (Some(name), _) => format!("{name}."),
            (None, true) => format!("body{body}_"),
            (None, false) => String::new(),
        };
        let names = ["rx", "ry", "rz", "dx", "dy", "dz"];
        let names = &names[if carrier.turns() { 0 } else { 3 }..];
        names
            .iter()
            .map(|name| format!("{prefix}{name}"))
            .collect::<Vec<_>>()
    };
    carriers.iter().enumerate().flat_map(of).collect()
}

/// A shape in the world frame and the units of the scene.
fn in_world(
    assembly: &Assembly,
    now: &Configuration,
    shape: &[f64],
    outward: &ToSceneUnits,
) -> Vec<f64> {
    let (starts, _) = assembly.freedoms();
    let bodies = assembly.carriers().iter().zip(&now.bodies);
    let twists = bodies.zip(starts).map(|((carrier, place), start)| {
        let own = DVector::from_column_slice(&shape[start..start + carrier.freedoms()]);
        carrier.own_twists(&place.pose) * own
    });
    of_twists(assembly.carriers(), &twists.collect::<Vec<_>>(), outward)
}

/// A shape in the world frame and the units of the scene, from the twists of the bodies.
pub(super) fn of_twists(
    carriers: &[HeavyBody],
    twists: &[Vector6<f64>],
    outward: &ToSceneUnits,
) -> Vec<f64> {
    let per = 1.0 / outward.scales.mass.sqrt();
    let mut world = Vec::new();
    for (carrier, twist) in carriers.iter().zip(twists) {
        let (turn, shift) = halves(twist);
        if carrier.turns() {
            let turn = outward.clamp.rotation * turn * (per / outward.scales.length);
            world.extend(turn.iter());
        }
        world.extend((outward.clamp.rotation * shift * per).iter());
    }
    world
}
