//! Small motions of rods with mass and of their bodies, including vibrations of the rods.

use super::assembled::is_simple;
use super::found::{Coordinates, FoundMode, FoundMotions};
use super::{BALANCED, INTERVALS, NUDGE, SmallMotions, Station, ToSceneUnits};
use crate::error::{Error, Result};
use crate::full_mass::assembly::{HeavyAssembly, HeavyLink};
use crate::full_mass::frames::{Curve, Sections};
use crate::full_mass::rod::HeavyRod;
use crate::full_mass::vibration::Vibration;
use crate::motion::full_mass::HeavyStart;
use crate::scene::{AssemblySetup, HeavyPlane, HeavySpace, InitialShape, MotionModel, Scene};
use crate::section::Strain;
use crate::viscoelastic::grid::{Grid, more};
use nalgebra::{DVector, Isometry3, Matrix3, Vector6};

/// Number of vibrations in the record.
const COUNT: usize = 8;
/// Largest number of rigid motions of each body.
const RIGID: usize = 6;
/// First number of nodes, and largest number of coordinates in a refinement.
const FIRST_NODES: usize = 16;
const MAX_COORDINATES: usize = 200;
/// First number of nodes if finer grids have too many coordinates: [`FIRST_NODES`] is then the single refinement and
/// yields the error.
const COARSE: usize = 11;
/// Refinement ends when squares of the frequencies change by less than this relative amount.
const CONVERGED: f64 = 1e-9;

/// The equilibrium of small motions.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
enum ModesAtRest {
    /// The one near the start under the loads.
    Settled,
    /// The start if in equilibrium, stable or not; otherwise the settled state.
    StartOrSettled,
    /// The start: unloaded rods of a free assembly, or of a rod that nothing holds.
    Unloaded,
}

/// Rods with the start for their small motions.
struct Task<'a> {
    given: HeavyAssembly,
    start: HeavyStart<'a>,
    rest: ModesAtRest,
    /// Frame of the rods in the world, and their units.
    outward: ToSceneUnits<'a>,
}

/// Rods at rest, with their vibrations.
struct HeavyModes {
    assembly: HeavyAssembly,
    y: DVector<f64>,
    /// True if the equilibrium is that of the start.
    of_start: bool,
    modes: Vec<Vibration>,
}

/// Small motions of one rod on a fixed clamp, and whether its start is the equilibrium.
pub(super) fn of_rod(scene: &Scene) -> Result<(SmallMotions, bool)> {
    let mut still = scene.frozen_at_start()?;
    still.start.rate = None;
    // Friction makes the vibrations decay.
    still.rod.damping.clone_from(&scene.rod.damping);
    still.rod.relaxation.clone_from(&scene.rod.relaxation);
    let scales = still.scales()?;
    let rest = match still.start.place {
        _ if scene.clamp.free => ModesAtRest::Unloaded,
        InitialShape::Settled { .. } => ModesAtRest::Settled,
        // Without a start the rod is let go, as an assembly is.
        InitialShape::Strain { ref strain } if strain.is_unloaded() => ModesAtRest::Settled,
        _ => ModesAtRest::StartOrSettled,
    };
    let described = |given, start, mut clamp: Isometry3<f64>| {
        clamp.translation.vector *= scales.length;
        let outward = ToSceneUnits {
            clamp,
            scales: &scales,
        };
        let task = Task {
            given,
            start,
            rest,
            outward,
        };
        task.described()
    };
    if still.is_planar() {
        let model = HeavyPlane::new(&still)?;
        described(model.assembly()?, model.start(), model.clamp(0.0).pose())
    } else {
        let model = HeavySpace::new(&still)?;
        described(model.assembly()?, model.start()?, model.clamp(0.0).pose())
    }
}

/// Small motions of an assembly about the equilibrium under the loads at t = 0, and whether bodies settle there. A
/// free assembly that starts from unloaded rods is linearised about these.
pub(super) fn of_assembly(scene: &Scene) -> Result<(SmallMotions, bool)> {
    let setup = AssemblySetup::new(scene)?;
    let given = setup
        .heavy()
        .ok_or_else(|| Error::domain("the rods have no inertia = \"full\""))?
        .standing_at(0.0);
    let unloaded = matches!(scene.start.place, InitialShape::Rest { .. });
    // A free assembly started from unloaded rods rests in this shape.
    let settled = setup.assembly.is_held() || !unloaded;
    let mut now = if settled {
        setup.start_equilibrium()?.now
    } else {
        setup.start()?.0
    };
    for body in &mut now.bodies {
        body.twist = Vector6::zeros();
    }
    let task = Task {
        start: setup.heavy_start(&now)?,
        given,
        rest: if settled {
            ModesAtRest::Settled
        } else {
            ModesAtRest::Unloaded
        },
        outward: ToSceneUnits {
            clamp: Isometry3::identity(),
            scales: &setup.scales,
        },
    };
    let (motions, _) = task.described()?;
    Ok((motions, !settled || !unloaded))
}

impl Task<'_> {
    /// Small motions, and whether the equilibrium is that of the start.
    fn described(mut self) -> Result<(SmallMotions, bool)> {
        (self.start.settled, self.start.following) = (false, false);
        let Self { given, outward, .. } = &self;
        let rods = given.links.iter().map(|link| &link.rod.given);
        let width = rods.map(|rod| (rod.breaks().len() + 1) * rod.law.active().len());
        let (found, change) = self.converged(width.sum())?;
        let HeavyModes {
            assembly, y, modes, ..
        } = &found;
        if self.rest == ModesAtRest::Unloaded {
            rests(&found)?;
        }
        let bodies = assembly.bodies();
        let mut laws = assembly.links.iter().map(|link| &link.rod.given.law);
        // Loads that turn with rods have no potential: small motions under such loads have eigenvalues.
        let mut rods = assembly.links.iter().map(|link| &link.rod.given);
        let turning = rods.any(|rod| rod.turning.is_some());
        let lossy = turning
            || laws.any(|law| law.is_damped())
            || assembly.has_friction_in_joints()
            || !bodies.iter().all(is_simple);
        let followed = turning || bodies.iter().any(|body| body.is_followed(0.0));
        let mode = |mode: &Vibration| -> Result<FoundMode> {
            let step = NUDGE / mode.shape.amax();
            let at = |by: f64| stations(assembly, &assembly.displaced(y, &mode.shape, by));
            Ok(FoundMode {
                square: mode.square,
                twists: assembly.twists(y, &mode.shape).ok_or_else(shapeless)?,
                rods: [at(-step)?, at(step)?],
                apart: 2.0 * step,
            })
        };
        let shown = modes.iter().filter(|_| !followed);
        let planar = |link: &HeavyLink| link.rod.given.curve == Curve::Plane;
        let motions = FoundMotions {
            coordinates: if assembly.links.iter().all(planar) {
                Coordinates::in_plane()
            } else {
                Coordinates::in_space(&bodies)
            },
            index: modes.iter().filter(|mode| mode.square < 0.0).count(),
            conservative: assembly.is_conservative(),
            followed,
            // The rods' own motions are among the eigenvalues.
            held_stable: true,
            neutral: 0.0,
            modes: shown.map(mode).collect::<Result<_>>()?,
            rigid: 0,
            change,
            eigenvalues: if lossy {
                Some(assembly.decaying(y, COUNT)?)
            } else {
                None
            },
            creep: None,
            rods: stations(assembly, y)?,
        };
        Ok((motions.described(outward), found.of_start))
    }

    /// Vibrations on the first grid of nodes that resolves them, with the last change of a squared frequency
    /// ([`SmallMotions::change`]). There are `width` coordinates per node.
    fn converged(&self, width: usize) -> Result<(HeavyModes, f64)> {
        let most = MAX_COORDINATES;
        let mut nodes = if more(FIRST_NODES) * width > most {
            COARSE
        } else {
            FIRST_NODES
        };
        let mut last = self.at_nodes(nodes)?;
        loop {
            nodes = more(nodes);
            let found = self.at_nodes(nodes)?;
            let pairs = last.modes.iter().zip(&found.modes);
            let changes = pairs.map(|(a, b)| (a.square - b.square).abs() / (1.0 + b.square.abs()));
            let change = changes.fold(0.0, f64::max);
            if change < CONVERGED || more(nodes) * width > most {
                return Ok((found, change));
            }
            last = found;
        }
    }

    fn at_nodes(&self, nodes: usize) -> Result<HeavyModes> {
        let elements = self.given.links.iter();
        let elements = elements.map(|link| link.rod.given.breaks().len() + 1);
        let counts = vec![nodes; elements.sum()];
        let (assembly, mut y) = self.start.at_nodes(&self.given, &counts)?;
        let mut of_start = true;
        if self.rest != ModesAtRest::Unloaded {
            let left = assembly.unbalanced(&y).ok_or_else(|| {
                Error::domain("[start]: the strains are outside the law's domain")
            })?;
            let settles = self.rest == ModesAtRest::Settled;
            of_start = settles || left <= BALANCED;
            if settles || left > 1e-3 * BALANCED {
                y = assembly.settled(&y).map_err(|why| why.context("[start]"))?;
            }
        }
        let mut modes = assembly.vibrations(&y, COUNT + RIGID * assembly.carriers.len())?;
        let free = modes.iter().filter(|mode| mode.square == 0.0).count();
        modes.truncate(COUNT + free);
        Ok(HeavyModes {
            assembly,
            y,
            of_start,
            modes,
        })
    }
}

/// Error if the loads strain the unloaded rods of a free assembly.
fn rests(found: &HeavyModes) -> Result<()> {
    let strains = found.assembly.strained(&found.y, &found.modes)?;
    if strains <= BALANCED {
        Ok(())
    } else {
        Err(Error::domain(
            "nothing holds the rods, and the loads strain them as they are at the start, so that this is no equilibrium to have small motions about: \
             leave out loads other than gravity, and start from unloaded rods; in an assembly leave rest = \"straight\" out, and the equilibrium \
             under the loads is looked for",
        ))
    }
}

/// Sections along all rods in a state.
fn stations(assembly: &HeavyAssembly, y: &DVector<f64>) -> Result<Vec<Vec<Station>>> {
    let at = assembly.at(y).ok_or_else(shapeless)?;
    let rods = assembly.links.iter().zip(&at.rods).enumerate();
    rods.map(|(k, (link, moving))| stations_from(&link.rod, &at.base(k), &moving.strains))
        .collect()
}

/// Sections along a rod, from base to end, for given strains at its nodes.
fn stations_from(
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
        .ok_or_else(shapeless)?;
    let station = |position, directors| Station {
        position,
        directors: match curve {
            Curve::Plane => Matrix3::zeros(),
            Curve::Space => directors,
        },
    };
    let turn = base.rotation.to_rotation_matrix().into_inner();
    let first = station(base.translation.vector, turn);
    let sections = shape.positions.iter().zip(&shape.directors);
    let sections = sections.map(|(position, directors)| station(*position, *directors));
    Ok(std::iter::once(first).chain(sections).collect())
}

fn shapeless() -> Error {
    Error::domain("the equilibrium has no shape")
}
