//! Small motions of rods without mass and their bodies in space.

use super::found::{Coordinates, FoundMode, FoundMotions};
use super::{BALANCED, INTERVALS, NUDGE, RelaxationRates, SmallMotions, Station, ToSceneUnits};
use crate::assembly::{Assembly, AssemblyRoute, Body, Configuration};
use crate::error::Result;
use crate::motion::viscoelastic::{AlongRod, SmallCreep, small_in_space};
use crate::scene::{AssemblySetup, ElasticSpace, InitialShape, Scales, Scene};
use crate::section::Strain;
use crate::study::neglected_mass::RodsAtRest;
use nalgebra::{Complex, DVector, Isometry3, Vector6};

/// Tolerances of the equilibrium and of the integration along the rods.
const EQUILIBRIUM: f64 = 1e-11;
pub(super) const ALONG: f64 = 1e-13;

/// A rod in space at rest with its body.
pub(in crate::study) struct AtRest {
    model: ElasticSpace,
    /// Assembly and equilibrium in the frame of the clamp and units of the rod.
    pub at: (Assembly, Configuration),
    /// True if [start] is the equilibrium.
    pub of_start: bool,
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
            described(&assembly, &now, clamp, scales, Some(damped))?
        }
    };
    if motions.stable && creeping.rod.mass().is_some() {
        let scales = *scales;
        let resting = RodsAtRest::new(creeping, assembly, now, &scales)?;
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
        .law_in_units(model.common.scales.measures());
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
    let along = AlongRod {
        dead: link.distributed().cloned(),
        turning: link.turning().cloned(),
        law_in_time: None,
    };
    small_in_space(
        section,
        scene.moving()?,
        along,
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
        let resting = RodsAtRest::new(scene, setup.assembly, now, &setup.scales)?;
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
    described(assembly, now, clamp, scales, None)
}

/// Small motions about an equilibrium; `damped`: eigenvalues of a rod with friction.
fn described(
    assembly: &Assembly,
    now: &Configuration,
    clamp: &Isometry3<f64>,
    scales: &Scales,
    damped: Option<SmallCreep>,
) -> Result<SmallMotions> {
    let modes = assembly.modes(now, ALONG)?;
    let followed = assembly.is_followed(0.0);
    // Stiffness below the tolerance of the equilibrium counts as neutral. Without a potential there is no index.
    let turned = assembly.has_turning();
    let index = if turned {
        0
    } else {
        assembly.index(0.0, now, EQUILIBRIUM)?
    };
    let conservative = assembly.is_conservative(0.0);
    let creep = damped
        .as_ref()
        .map(|damped| RelaxationRates::new(damped, scales));
    let eigenvalues = match (damped, assembly.solids().iter().all(is_simple)) {
        (Some(damped), _) => Some(damped.rates.body),
        (None, true) if !turned => None,
        (None, _) => Some(assembly.eigenvalues(now, ALONG)?),
    };
    let held = || -> Result<usize> {
        let points = assembly.points(0.0, &now.bodies, &now.charts, ALONG)?;
        let rods = assembly.links().iter().zip(&now.charts).zip(&points);
        rods.map(|((link, q), point)| {
            let seen = link.with_base_rotation(&point.base.pose.rotation);
            seen.index(q, &point.held(), ALONG)
        })
        .sum()
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
    // With follower loads only eigenvalues describe the motions, so no modes are made.
    let shown = (0..modes.squares.len()).filter(|_| !followed);
    let mode = |k: usize| -> Result<FoundMode> {
        let [charts, shape] = [&modes.charts, &modes.shapes].map(|of| of.column(k));
        let step = NUDGE / charts.amax().max(shape.amax());
        let at = |by: f64| {
            let moved = modes.displaced(assembly, now, k, by)?;
            stations(&moved)
        };
        Ok(FoundMode {
            square: modes.squares[k],
            twists: twists(assembly, now, shape.as_slice()),
            rods: [at(-step)?, at(step)?],
            apart: 2.0 * step,
        })
    };
    let found = FoundMotions {
        coordinates: Coordinates::in_space(assembly.solids()),
        index,
        conservative,
        followed,
        held_stable: !followed || turned || held()? == 0,
        neutral: modes.neutral,
        modes: shown.map(mode).collect::<Result<_>>()?,
        rigid: assembly.massive().len() - modes.squares.len(),
        change: 0.0,
        eigenvalues: eigenvalues.map(cleaned),
        creep,
        rods: stations(now)?,
    };
    Ok(found.described(&outward))
}

/// Eigenvalues with Im s >= 0; parts that are rounding beside the fastest are 0.
fn cleaned(all: Vec<Complex<f64>>) -> Vec<Complex<f64>> {
    let fastest = all.iter().fold(0.0, |a: f64, s| a.max(s.norm()));
    let zero = |x: f64| if x.abs() <= 1e-14 * fastest { 0.0 } else { x };
    let all = all
        .into_iter()
        .map(|s| Complex::new(zero(s.re), zero(s.im)));
    all.filter(|s| s.im >= 0.0).collect()
}

/// True if only inertia and forces with a potential act on the body.
pub(super) fn is_simple(carrier: &Body) -> bool {
    carrier.is_conservative(0.0) && !carrier.mass().is_damped() && !carrier.mass().has_rotor()
}

/// Twists of the bodies for a shape in their velocities.
fn twists(assembly: &Assembly, now: &Configuration, shape: &[f64]) -> Vec<Vector6<f64>> {
    let (starts, _) = assembly.freedoms();
    let own = assembly.own_twists(&now.bodies);
    let twists = own
        .iter()
        .zip(starts)
        .map(|(own, start)| own * DVector::from_column_slice(&shape[start..start + own.ncols()]));
    twists.collect()
}
