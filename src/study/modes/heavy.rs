//! Small motions of a rod with mass and its body, including vibrations of the rod.

use super::{INTERVALS, Mode, NUDGE, SmallMotions, Station, ToSceneUnits, frequencies};
use crate::error::{Error, Result};
use crate::full_mass::frames::{Curve, Sections};
use crate::full_mass::mass::Mass;
use crate::full_mass::rod::{HeavyRod, RodDescription};
use crate::full_mass::statics::Vibration;
use crate::scene::{HeavyPlane, HeavySpace, InitialShape, MotionModel, Scene};
use crate::section::Strain;
use crate::viscoelastic::grid::{Grid, more};
use nalgebra::{Complex, DVector, Isometry3, Matrix3, Vector3};

/// Number of vibrations in the record.
pub(super) const COUNT: usize = 8;
/// First number of nodes, and largest number of coordinates in a refinement.
const FIRST_NODES: usize = 16;
const MAX_COORDINATES: usize = 200;
/// First number of nodes if finer grids have too many coordinates: [`FIRST_NODES`] is then the single refinement and
/// yields the error.
const COARSE: usize = 11;
/// Refinement ends when squares of the frequencies change by less than this relative amount.
const CONVERGED: f64 = 1e-9;

/// A rod with mass at rest, with its vibrations.
struct RodVibrations {
    rod: HeavyRod,
    q: Vec<f64>,
    of_start: bool,
    modes: Vec<Vibration>,
}

pub(super) fn modes(scene: &Scene) -> Result<(SmallMotions, bool)> {
    let mut still = scene.frozen_at_start()?;
    still.start.rate = None;
    // Friction makes the vibrations decay.
    still.rod.damping.clone_from(&scene.rod.damping);
    still.rod.relaxation.clone_from(&scene.rod.relaxation);
    let scales = still.scales()?;
    let settles = matches!(still.start.place, InitialShape::Settled { .. });
    let (given, clamp, strain): (RodDescription, _, Box<dyn Fn(f64) -> Strain>) =
        if still.is_planar() {
            let model = HeavyPlane::new(&still)?;
            let clamp = model.clamp(0.0).pose();
            let field = model.curvature.clone();
            let strain = move |s: f64| Strain::new(field.at(s)[0], 0.0, 0.0, 0.0, 0.0, 1.0);
            (model.given, clamp, Box::new(strain))
        } else {
            let model = HeavySpace::new(&still)?;
            let clamp = model.clamp(0.0).pose();
            let outward = ToSceneUnits {
                clamp: model.common.clamp,
                scales: &scales,
            };
            if let Some(found) = super::heavy_assembly::in_groove(&model, outward)? {
                return Ok(found);
            }
            let (field, measures) = (model.common.strain.clone(), scales.measures());
            let strain = move |s: f64| {
                let strain = field.at(s).map(|e| measures.strain_in(&e));
                strain.unwrap_or(Strain::repeat(f64::NAN))
            };
            (model.given, clamp, Box::new(strain))
        };
    let width = (given.breaks().len() + 1) * given.law.active().len();
    let (found, change) = converged(
        (width, MAX_COORDINATES),
        |nodes| at_nodes(&given, (&*strain, settles), nodes),
        |found| &found.modes,
    )?;
    let rod = &found.rod;
    let turns = given.body.as_ref().is_some_and(Mass::turns);
    let planar = given.curve == Curve::Plane;
    let mut clamp = clamp;
    clamp.translation.vector *= scales.length;
    let outward = ToSceneUnits {
        clamp,
        scales: &scales,
    };
    let (mut conservative, mut followed) = (true, false);
    if let Some(Mass::Rigid(body)) = &given.body {
        (conservative, followed) = (body.is_conservative(0.0), body.is_followed(0.0));
    }
    let lossy =
        given.law.is_damped() || !conservative || given.body.as_ref().is_some_and(is_damped);
    let eigenvalues = if lossy {
        Some(rod.decaying(0.0, &found.q, COUNT)?)
    } else {
        None
    };
    let judged =
        StabilityVerdict::new(&found.modes, eigenvalues.as_deref(), conservative, followed);
    let here = stations(rod, &found.q)?;
    let mut list = Vec::new();
    for (mode, omega) in found.modes.iter().zip(&judged.frequencies) {
        let step = NUDGE / mode.shape.amax();
        let moved = |by: f64| {
            let q: Vec<f64> = found
                .q
                .iter()
                .zip(mode.shape.iter())
                .map(|(q, x)| q + by * x)
                .collect();
            stations(rod, &q)
        };
        let (before, after) = (moved(-step)?, moved(step)?);
        let pairs = before.iter().zip(&after);
        let rates: Vec<Station> = pairs
            .map(|(a, b)| outward.rate([a, b], 2.0 * step))
            .collect();
        let shape = end_of(rod, &found.q, &mode.shape)?;
        let root = scales.mass.sqrt();
        let (turn, shift) = (
            clamp.rotation * shape[0] / (root * scales.length),
            clamp.rotation * shape[1] / root,
        );
        let whole: Vec<f64> = match (planar, turns) {
            (true, _) => vec![shift.x, shift.y],
            (false, true) => turn.iter().chain(shift.iter()).copied().collect(),
            (false, false) => shift.iter().copied().collect(),
        };
        let rates = rates.into_iter().map(|at| {
            if planar {
                Station {
                    directors: Matrix3::zeros(),
                    ..at
                }
            } else {
                at
            }
        });
        list.push(
            Mode {
                angular_frequency: omega / scales.time,
                shape: whole,
                rods: vec![rates.collect()],
            }
            .oriented(),
        );
    }
    let names = match (planar, turns) {
        (true, _) => &["dx", "dy"][..],
        (false, true) => &["rx", "ry", "rz", "dx", "dy", "dz"],
        (false, false) => &["dx", "dy", "dz"],
    };
    let motions = SmallMotions {
        mass: None,
        index: judged.index,
        stable: judged.stable,
        conservative: judged.conservative,
        coordinates: names.iter().map(|name| (*name).to_owned()).collect(),
        modes: list,
        rigid: 0,
        change,
        eigenvalues: eigenvalues.map(|all| all.iter().map(|s| s / scales.time).collect()),
        creep: None,
        rods: vec![
            here.iter()
                .map(|at| {
                    let at = outward.station(at);
                    if planar {
                        Station {
                            directors: Matrix3::zeros(),
                            ..at
                        }
                    } else {
                        at
                    }
                })
                .collect(),
        ],
    };
    Ok((motions, found.of_start))
}

fn is_damped(body: &Mass) -> bool {
    match body {
        Mass::Point(body) => body.is_damped(),
        Mass::Rigid(body) => body.is_damped() || *body.rotor() != Vector3::zeros(),
    }
}

/// Stability and frequencies of an equilibrium, from its vibrations and eigenvalues.
pub(super) struct StabilityVerdict {
    pub index: usize,
    pub stable: bool,
    pub conservative: bool,
    /// Frequencies of the vibrations, as [`frequencies`]. Empty with follower loads, where only eigenvalues describe
    /// the motions.
    pub frequencies: Vec<f64>,
}

impl StabilityVerdict {
    /// `conservative`: all loads have a potential; `followed`: some turn with bodies.
    pub(super) fn new(
        modes: &[Vibration],
        eigenvalues: Option<&[Complex<f64>]>,
        conservative: bool,
        followed: bool,
    ) -> Self {
        let squares: Vec<f64> = modes.iter().map(|mode| mode.square).collect();
        let index = squares.iter().filter(|square| **square < 0.0).count();
        let all = eigenvalues.unwrap_or_default();
        let fastest = all.iter().fold(0.0, |a: f64, s| a.max(s.norm()));
        let decaying = |s: &Complex<f64>| s.re <= 1e-8 * fastest;
        Self {
            index,
            // With follower loads the index of the symmetric part of the stiffness does not decide stability.
            stable: (followed || index == 0) && (conservative || all.iter().all(decaying)),
            conservative,
            frequencies: if followed {
                Vec::new()
            } else {
                frequencies(&squares, 0.0, index == 0)
            },
        }
    }
}

/// Result on the first grid of nodes that resolves the vibrations, with the last change of a squared frequency
/// ([`SmallMotions::change`]). There are `width` coordinates per node, at most `most` in all.
pub(super) fn converged<F>(
    (width, most): (usize, usize),
    at_nodes: impl Fn(usize) -> Result<F>,
    vibrations: impl Fn(&F) -> &[Vibration],
) -> Result<(F, f64)> {
    let mut nodes = if more(FIRST_NODES) * width > most {
        COARSE
    } else {
        FIRST_NODES
    };
    let mut last = at_nodes(nodes)?;
    loop {
        nodes = more(nodes);
        let found = at_nodes(nodes)?;
        let pairs = vibrations(&last).iter().zip(vibrations(&found));
        let changes = pairs.map(|(a, b)| (a.square - b.square).abs() / (1.0 + b.square.abs()));
        let change = changes.fold(0.0, f64::max);
        if change < CONVERGED || more(nodes) * width > most {
            return Ok((found, change));
        }
        last = found;
    }
}

/// Small motions about the equilibrium near these strains. The body settles from them, or they are those of the
/// start.
fn at_nodes(
    given: &RodDescription,
    (strain, settles): (&dyn Fn(f64) -> Strain, bool),
    nodes: usize,
) -> Result<RodVibrations> {
    let breaks = given.breaks();
    let grid = Grid::new(&breaks, &vec![nodes; breaks.len() + 1]);
    let strains: Vec<Strain> = grid.nodes().iter().map(|s| strain(*s)).collect();
    let rod = HeavyRod::new(given.clone(), grid)?;
    let start = rod.coordinates(&strains);
    let none = vec![0.0; rod.size()];
    let balance = rod
        .moving(&start, &none)
        .and_then(|at| rod.balance(0.0, &at, &none))
        .ok_or_else(|| Error::domain("[start]: the strains are outside the law's domain"))?;
    let weights = rod.sections.grid.weights();
    let count = given.law.active().len();
    let each = balance.residual.iter().enumerate();
    let left = each.fold(0.0_f64, |left, (i, r)| {
        left.max(r.abs() / weights[i / count])
    });
    let of_start = settles || left <= super::BALANCED;
    // Without settling, a start in equilibrium is kept, stable or not.
    let q = if !settles && left <= 1e-3 * super::BALANCED {
        start
    } else {
        rod.settled(0.0, &start)
            .map_err(|why| why.context("[start]"))?
    };
    let modes = rod.vibrations(0.0, &q, COUNT)?;
    Ok(RodVibrations {
        rod,
        q,
        of_start,
        modes,
    })
}

/// Rotation and displacement of the end for a change of the coordinates.
fn end_of(rod: &HeavyRod, q: &[f64], shape: &DVector<f64>) -> Result<[Vector3<f64>; 2]> {
    let at = rod
        .moving(q, shape.as_slice())
        .ok_or_else(|| Error::domain("the equilibrium has no shape"))?;
    let [spins, velocities] = [&at.flow.spins, &at.flow.velocities];
    Ok([spins, velocities].map(|list| list.last().copied().unwrap_or_default()))
}

fn stations(rod: &HeavyRod, q: &[f64]) -> Result<Vec<Station>> {
    stations_from(rod, &Isometry3::identity(), &rod.strains(q))
}

/// Sections along a rod, from base to end, for given strains at its nodes.
pub(super) fn stations_from(
    rod: &HeavyRod,
    base: &Isometry3<f64>,
    strains: &[Strain],
) -> Result<Vec<Station>> {
    let grid = &rod.sections.grid;
    let fine = Grid::clone(&grid.finer(INTERVALS));
    let strains = grid.carried(strains, &fine);
    let curve = rod.given.curve;
    let shape = Sections::new(fine, rod.given.law.active(), curve, rod.given.law.length())
        .shape(base, &strains)
        .ok_or_else(|| Error::domain("the equilibrium has no shape"))?;
    let at = |i: usize| Station {
        position: shape.positions[i],
        directors: shape.directors[i],
    };
    let first = Station {
        position: base.translation.vector,
        directors: match curve {
            Curve::Plane => Matrix3::zeros(),
            Curve::Space => base.rotation.to_rotation_matrix().into_inner(),
        },
    };
    Ok(std::iter::once(first)
        .chain((0..shape.positions.len()).map(at))
        .collect())
}
