//! Small motions about an equilibrium of a scene of motion: natural frequencies and mode shapes.

mod assembled;
mod derivatives;
mod found;
mod heavy;
mod planar;

pub(in crate::study) use assembled::resting;
pub use assembled::small_motions;
pub use derivatives::derivatives;

use super::neglected_mass::MassEffect;
use super::record::{Cell, Column, Table};
use crate::error::Result;
use crate::motion::viscoelastic::SmallCreep;
use crate::scene::{Force, Scales, Scene, Units};
use nalgebra::{Complex, Isometry3, Matrix3, Vector3};
use serde_json::{Map, Value, json};
use std::f64::consts::TAU;

/// Natural frequencies and mode shapes of a scene about an equilibrium, in its units.
#[derive(Debug, Clone, PartialEq)]
pub struct ModesRecord {
    /// The units of every quantity.
    pub units: Units,
    /// True if the rod moves in a plane.
    pub planar: bool,
    /// True if the start of the scene is the equilibrium. Otherwise the forces on the body do not balance at the
    /// start, and the equilibrium is the one under the loads at t = 0.
    pub of_start: bool,
    /// The names of the rods of an assembly, those with a free end last.
    pub names: Vec<String>,
    /// The motions.
    pub motions: SmallMotions,
    /// Remarks on neglected effects and on the choice of the equilibrium.
    pub remarks: Vec<String>,
}

/// Small motions about an equilibrium.
#[derive(Debug, Clone, PartialEq)]
pub struct SmallMotions {
    /// The Morse index, the bodies being free; 0 is stable.
    pub index: usize,
    /// True if no small motion grows: at index 0, or, under a couple, which has no potential, by the eigenvalues.
    pub stable: bool,
    /// True if all loads have a potential. The modes are those of the symmetric part of the stiffness.
    pub conservative: bool,
    /// Names of the components of a shape.
    pub coordinates: Vec<String>,
    /// By rising angular frequency; none under loads that turn with bodies.
    pub modes: Vec<Mode>,
    /// Directions in which straight inextensible rods do not let the bodies move: they have no mode.
    pub rigid: usize,
    /// Change of a squared frequency by the last refinement of rods with mass, in units of the square plus 1; 0
    /// without refinement.
    pub change: f64,
    /// With drag, friction of the rod, rotors or couples: eigenvalues s of motions exp(s t), Im s >= 0, by Im s.
    pub eigenvalues: Option<Vec<Complex<f64>>>,
    /// With friction of the rod: its relaxation rates, compared with the eigenvalues.
    pub creep: Option<RelaxationRates>,
    /// Effect of the mass of elastic or viscous rods about a stable equilibrium, where the mass is known and not
    /// followed in full.
    pub mass: Option<MassEffect>,
    /// The rods in equilibrium, in the world: evenly spaced sections.
    pub rods: Vec<Vec<Station>>,
}

/// Relaxation rates of a rod with friction, for comparison with the eigenvalues.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct RelaxationRates {
    /// Fastest and slowest relaxation rate of the rod with its end held, of those felt at the end. `None` if the end
    /// force has no memory.
    pub held: Option<[f64; 2]>,
    /// Number of overdamped rates between these, left out because none is a motion of the body alone.
    pub among: usize,
    /// By how much, relatively, the last refinement of the strains changed the eigenvalues.
    pub change: f64,
}

impl RelaxationRates {
    fn new(found: &SmallCreep, scales: &Scales) -> Self {
        Self {
            held: found.rates.held.map(|both| both.map(|s| -s / scales.time)),
            among: found.rates.among,
            change: found.change,
        }
    }
}

/// A mode.
#[derive(Debug, Clone, PartialEq)]
pub struct Mode {
    /// Angular frequency; for an instability, minus the growth rate.
    pub angular_frequency: f64,
    /// The displacements x of the bodies, in the world, with x^T M x = 1: translations in 1/sqrt(mass), rotations in
    /// 1/(length sqrt(mass)).
    pub shape: Vec<f64>,
    /// Motion of the rods in the mode: derivatives of the stations.
    pub rods: Vec<Vec<Station>>,
}

/// A section of a rod, or the velocity of a section.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Station {
    /// Position.
    pub position: Vector3<f64>,
    /// Directors, by columns; zero in the plane.
    pub directors: Matrix3<f64>,
}

/// Intervals between the stations of a rod.
const INTERVALS: usize = 100;
/// Step of the charts for the difference quotients of stations, which serve figures only.
const NUDGE: f64 = 1e-4;
/// Relative change of eigenvalues by the last refinement of a rod with friction, above which a remark is made.
const RESOLVED: f64 = 1e-6;
/// Largest residual of the eigenvalue equation, relative to the squared frequency, at which an eigenvalue belongs to
/// a mode.
const ACROSS: f64 = 1e-6;
/// The largest residual force of a start that is an equilibrium, relative to the forces.
const BALANCED: f64 = 1e-6;

/// Natural frequencies and mode shapes about the start of the scene if it is an equilibrium, otherwise about the
/// equilibrium under the loads at t = 0. The clamp is fixed in its pose at t = 0, and time-dependent loads have their
/// value at t = 0. Modes are undamped; with `damping` of the rod the eigenvalues contain its friction, linearised at
/// rest.
///
/// For rods with mass (inertia = "full") the modes include vibrations of the rods: the eight slowest motions in all,
/// beside the rigid ones. Friction makes them decay.
///
/// ```
/// use snaprod::{scene::Scene, study::modes};
/// let scene = Scene::parse(
///     r#"
///     [rod]
///     model = "elastica"
///     length = 2.0
///     bending_stiffness = 5.0
///     [body]
///     mass = 0.5
///     [start]
///     rest = "straight"
///     [run]
///     duration = 1.0
///     "#,
/// )?;
/// let record = modes(&scene)?;
/// let across = record.motions.modes[0].angular_frequency;
/// assert!((across * across - 3.0 * 5.0 / (0.5 * 8.0)).abs() < 1e-14); // 3 EI/(m L^3)
/// # Ok::<(), Box<dyn std::error::Error>>(())
/// ```
///
/// # Errors
/// A scene of statics; a start that cannot be evaluated; no equilibrium found; an equilibrium at a fold, where the
/// rod is infinitely stiff.
pub fn modes(scene: &Scene) -> Result<ModesRecord> {
    scene.refuse_functions("frequencies")?;
    scene.has_no_obstacles()?;
    let heavy = scene.rod.is_heavy();
    let found = match (scene.assembly(), scene.is_planar()) {
        (Some(_), _) if heavy => heavy::of_assembly(scene),
        (Some(_), _) => assembled::of_assembly(scene),
        (None, _) if heavy => heavy::of_rod(scene),
        (None, true) => match scene.lifted_for_modes() {
            Err(why) => Err(why),
            Ok(Some(lifted)) => lifted
                .frozen_at_start()
                .and_then(|still| assembled::modes(&still, &lifted))
                .map(|(motions, of_start)| (in_plane(motions, scene), of_start)),
            Ok(None) => planar::modes(&scene.frozen_at_start()?, scene),
        },
        (None, false) => assembled::modes(&scene.frozen_at_start()?, scene),
    };
    let (motions, of_start) = found.map_err(|e| scene.in_own_units(e))?;
    let given = scene.assembly().into_iter();
    let held = given.clone().flat_map(|given| &given.rods);
    let free = given.flat_map(|given| &given.free);
    let names = held.map(|rod| &rod.name).chain(free.map(|rod| &rod.name));
    let mut record = ModesRecord {
        units: scene.units,
        names: names.cloned().collect(),
        planar: scene.is_planar(),
        remarks: Vec::new(),
        of_start,
        motions,
    };
    let motions = &record.motions;
    let mut remarks = Vec::new();
    let mut remark = |holds: bool, words: &str| {
        if holds {
            remarks.push(words.to_owned());
        }
    };
    remark(
        !of_start,
        "[start] is not an equilibrium: the forces on the body do not balance there; the modes are those of the equilibrium under the loads at t = 0",
    );
    remark(
        scene.rod.damping.is_some(),
        "the modes leave friction out; the eigenvalues include it, linearised at rest",
    );
    remark(
        !scene.rod.relaxation.is_empty(),
        "the modes are those of the fully relaxed section; the eigenvalues include its relaxation",
    );
    if let Some(creep) = &motions.creep {
        let [fast, slow] = creep.held.unwrap_or_default();
        remark(
            creep.among > 0,
            &format!(
                "overdamped motions have {} more rates, among those with which the rod relaxes with its end held, {slow:.4e} to {fast:.4e}: there \
                 rod and body are one motion",
                creep.among,
            ),
        );
        remark(
            !(creep.change <= RESOLVED),
            &format!(
                "the eigenvalues are not converged: the last refinement of the rod changed one by {:.0e} (relative)",
                creep.change
            ),
        );
    }
    remark(
        !(motions.change <= RESOLVED),
        &format!(
            "the frequencies are not converged: the last refinement of the rods changed the square of one by {:.0e} (relative)",
            motions.change
        ),
    );
    remark(
        scene.clamp.motion.is_some(),
        "the moving clamp is fixed at its position at t = 0",
    );
    let rods = scene.assembly().into_iter().flat_map(|given| &given.rods);
    let mut sites = rods.flat_map(|rod| [&rod.from, &rod.to]);
    remark(
        sites.any(|site| site.motion.is_some()),
        "moving supports are fixed at their positions at t = 0",
    );
    let bodies = scene.assembly().into_iter().flat_map(|given| &given.bodies);
    let mut loads =
        bodies.flat_map(|body| body.force.in_time().iter().chain(body.couple.in_time()));
    remark(
        motions.modes.is_empty() && motions.eigenvalues.is_some(),
        "loads turn with the body, so there are no mode shapes: the frequencies are those of the eigenvalues",
    );
    let mut light = scene.assembly().into_iter().flat_map(|given| &given.rods);
    remark(
        motions.eigenvalues.is_some()
            && (scene.rod.is_light() || light.any(|given| given.rod.is_light())),
        "the eigenvalues are those of massless rods: they ignore inertia = \"first-order\"; set inertia = \"full\" to include the mass",
    );
    remark(
        scene.loads.vary() || loads.any(Force::varies),
        "time-dependent loads have their values at t = 0",
    );
    let growing = motions
        .modes
        .iter()
        .filter(|mode| mode.angular_frequency < 0.0);
    remark(
        motions.conservative && motions.index > growing.count() && !heavy,
        "the rod is unstable with its end held: it snaps before the body moves",
    );
    record.remarks = remarks;
    Ok(record)
}

/// Small motions of a planar rod that was lifted into space, without the motion out of the plane, which is stiff.
fn in_plane(mut motions: SmallMotions, scene: &Scene) -> SmallMotions {
    let across = |mode: &Mode| mode.shape[2].abs() > mode.shape[0].hypot(mode.shape[1]);
    let drag = scene
        .body()
        .map_or(0.0, |body| scene.loads.drag / body.mass);
    for mode in motions.modes.iter().filter(|mode| across(mode)) {
        let square = mode.angular_frequency * mode.angular_frequency;
        let own = |s: &Complex<f64>| (s * s + s * drag + square).norm() <= ACROSS * square;
        if let Some(eigenvalues) = &mut motions.eigenvalues {
            eigenvalues.retain(|s| !own(s));
        }
    }
    motions.modes.retain(|mode| !across(mode));
    for mode in &mut motions.modes {
        mode.shape.truncate(2);
    }
    motions.coordinates.truncate(2);
    motions
}

/// Map from the frame of the clamp and units of the rod to the world and units of the scene.
struct ToSceneUnits<'a> {
    clamp: Isometry3<f64>,
    scales: &'a Scales,
}

impl ToSceneUnits<'_> {
    fn station(&self, at: &Station) -> Station {
        Station {
            position: self.clamp * nalgebra::Point3::from(at.position * self.scales.length)
                - nalgebra::Point3::origin(),
            directors: self.clamp.rotation.to_rotation_matrix() * at.directors,
        }
    }

    fn stations(&self, rods: &[Vec<Station>]) -> Vec<Vec<Station>> {
        let rods = rods.iter();
        rods.map(|rod| rod.iter().map(|at| self.station(at)).collect())
            .collect()
    }

    /// [`ToSceneUnits::rate`] of all stations of rods.
    fn rates(&self, [before, after]: [&[Vec<Station>]; 2], apart: f64) -> Vec<Vec<Station>> {
        let rods = before.iter().zip(after).map(|(before, after)| {
            let pairs = before.iter().zip(after);
            pairs.map(|(a, b)| self.rate([a, b], apart)).collect()
        });
        rods.collect()
    }

    /// Velocity of a station in a mode of the scale of [`Mode::shape`], from two positions `apart` in units of the
    /// rod.
    fn rate(&self, [a, b]: [&Station; 2], apart: f64) -> Station {
        let turn = self.clamp.rotation.to_rotation_matrix();
        let per = 1.0 / (apart * self.scales.mass.sqrt());
        Station {
            position: turn * (b.position - a.position) * per,
            directors: turn * (b.directors - a.directors) * (per / self.scales.length),
        }
    }
}

impl SmallMotions {
    /// Angular frequencies, ascending; for an instability without oscillation, minus the growth rate. They belong to
    /// the modes without drag and rotors. With follower loads they belong to the eigenvalues, where growing
    /// oscillations have negative decay rates.
    pub fn angular_frequencies(&self) -> Vec<f64> {
        let Some(all) = self.eigenvalues.as_ref().filter(|_| self.modes.is_empty()) else {
            return self
                .modes
                .iter()
                .map(|mode| mode.angular_frequency)
                .collect();
        };
        let moving = all.iter().filter(|s| s.im > 0.0).map(|s| s.im);
        let growing = all
            .iter()
            .filter(|s| s.im == 0.0 && s.re > 0.0)
            .map(|s| -s.re);
        let mut list: Vec<f64> = growing.chain(moving).collect();
        list.sort_by(f64::total_cmp);
        list
    }
}

impl Mode {
    /// The mode with its sign fixed: the largest component (the first of equal ones) is positive.
    fn oriented(mut self) -> Self {
        let largest = self.shape.iter().fold(0.0, |a: f64, x| {
            if x.abs() > a.abs() * (1.0 + 1e-9) {
                *x
            } else {
                a
            }
        });
        if largest < 0.0 {
            self.shape.iter_mut().for_each(|x| *x = -*x);
            for at in self.rods.iter_mut().flatten() {
                (at.position, at.directors) = (-at.position, -at.directors);
            }
        }
        self
    }

    /// Period; `None` for an instability or a neutral mode.
    pub fn period(&self) -> Option<f64> {
        (self.angular_frequency > 0.0).then(|| TAU / self.angular_frequency)
    }
}

impl ModesRecord {
    /// The modes: a row for each.
    ///
    /// # Errors
    /// None that is known of.
    pub fn table(&self) -> Result<Table> {
        let time = self.units.time();
        let rate = match time {
            "" => String::new(),
            time => format!("rad/{time}"),
        };
        let mut columns = vec![
            Column::integers("mode", "number of the mode, by rising frequency"),
            Column::reals(
                "angular_frequency",
                rate,
                "angular frequency; of an instability, minus its rate of growth",
            ),
            Column::reals("period", time, "period; none of an instability"),
        ];
        for name in &self.motions.coordinates {
            let turns = name.trim_end_matches(['x', 'y', 'z']).ends_with('r');
            let (unit, what) = match (turns, self.units) {
                (true, Units::Si) => ("1/(m kg^(1/2))", "rotation"),
                (false, Units::Si) => ("1/kg^(1/2)", "displacement"),
                (true, _) => ("", "rotation"),
                (false, _) => ("", "displacement"),
            };
            let meaning = format!("{what} in the mode, in the world; the mode has x^T M x = 1");
            columns.push(Column::reals(name.clone(), unit, meaning));
        }
        let mut table = Table::new("modes", columns);
        for (i, mode) in self.motions.modes.iter().enumerate() {
            let mut row: Vec<Cell> = vec![
                (i + 1).into(),
                mode.angular_frequency.into(),
                mode.period().into(),
            ];
            row.extend(mode.shape.iter().map(|x| Cell::Real(*x)));
            table.push(&row)?;
        }
        Ok(table)
    }

    /// Everything but the rods, as JSON.
    pub fn summary(&self) -> Value {
        let motions = &self.motions;
        let modes = || motions.modes.iter();
        let shape = |mode: &Mode| {
            let parts = motions.coordinates.iter().zip(&mode.shape);
            parts
                .map(|(name, x)| (name.clone(), (*x).into()))
                .collect::<Map<_, _>>()
        };
        let ends = motions.rods.iter().filter_map(|rod| rod.last());
        let eigenvalues = motions.eigenvalues.as_ref();
        json!({
            "angular_frequencies": motions.angular_frequencies(),
            "periods": modes().map(Mode::period).collect::<Vec<_>>(),
            "shapes": modes().map(shape).collect::<Vec<_>>(),
            "rigid_directions": motions.rigid,
            "stable": motions.stable,
            "index": motions.index,
            "conservative": motions.conservative,
            "damped_angular_frequencies": eigenvalues.map(|all| all.iter().map(|s| s.im).collect::<Vec<_>>()),
            "held_rates": motions.creep.and_then(|creep| creep.held).map(|[fast, slow]| [slow, fast]),
            "decay_rates": eigenvalues.map(|all| all.iter().map(|s| 0.0 - s.re).collect::<Vec<_>>()),
            "eigenvalues": eigenvalues.map(|all| all.iter().map(|s| [s.re, s.im]).collect::<Vec<_>>()),
            "equilibrium": if self.of_start { "start" } else { "loads" },
            "ends": ends.map(|end| end.position.as_slice().to_vec()).collect::<Vec<_>>(),
            "mass": motions.mass.as_ref().map(MassEffect::json),
            "remarks": self.remarks,
        })
    }
}
