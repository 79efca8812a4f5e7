//! Run of a membrane in motion: greatest height, folds, snaps, wrinkles, the balance of energy.

mod membrane;
mod piston;
mod record;

pub use record::{InflationEnd, InflationMoment, InflationRecord, Oscillation, SnapPressure};

use super::{Cell, Column, Hooks, Sink, Table, Trajectory, sample_times, tell};
use crate::error::{Error, Result};
use crate::membrane::Shape;
use crate::scene::{InflationScene, InflationStart, Mover, Scene, Units};
use piston::PistonMotion;
use serde_json::Value;

/// Largest number of stored profiles of a disc.
const PROFILES: usize = 400;
/// Number of steps between two checks for an interrupt.
const STRETCH: usize = 2_000;

/// The end of a motion without a step that is short enough.
const NO_STEP: &str = "no step is short enough for so fast a motion: look at the units of masses, pressures and forces";

/// A scene of a membrane in motion, ready to run.
pub struct InflationPrepared {
    scene: Value,
    given: InflationScene,
    units: Units,
    start: InflationStart,
}

impl InflationPrepared {
    /// The membrane of a scene at its start.
    ///
    /// # Errors
    /// A scene of another kind; a start without a motion.
    pub fn new(scene: &Scene) -> Result<Self> {
        let other =
            || Error::domain("this is no membrane in motion: it has no [membrane] with [run]");
        let given = scene.inflation().cloned().ok_or_else(other)?;
        Ok(Self {
            scene: serde_json::to_value(scene)
                .map_err(|e| Error::io("the scene cannot be written").caused_by(e))?,
            units: scene.units,
            start: given.start()?,
            given,
        })
    }
}

/// A membrane or a piston that moves, in the units of the scene.
trait Moving {
    /// Goes on to the time `t`, or by so many steps.
    fn go(&mut self, t: f64, steps: usize) -> std::result::Result<(), InflationEnd>;

    /// The time that was reached.
    fn time(&self) -> f64;

    /// The state at the time `t`, which has been reached just now.
    fn moment(&mut self, t: f64) -> Result<InflationMoment>;

    /// States before and after jumps since the last sample.
    fn jumps(&mut self) -> Vec<InflationMoment> {
        Vec::new()
    }

    /// Rows [unloaded radius, r, z] of the profile of a disc; empty for others.
    fn profile(&self) -> Vec<[f64; 3]> {
        Vec::new()
    }

    /// Adds what is known at the end.
    fn finish(&self, record: &mut InflationRecord);
}

/// Runs a membrane to its end. Rows of the table `trajectory`, and of the table `fields` of a disc, go to `sink` as the
/// run goes on. A run that ends early is no error: [`InflationRecord::reason`] says why.
///
/// ```
/// use snaprod::scene::Scene;
/// use snaprod::study::{Silent, Table, inflation};
/// let scene = Scene::parse(
///     r#"
///     [membrane]
///     shape = "sphere"
///     radius = 1.0
///     thickness = 1.0
///     law = { neo_hookean = 1.0 }
///     density = 1.0
///     [loads]
///     pressure = 2.2
///     [run]
///     duration = 20.0
///     "#,
/// )?;
/// let mut tables: Vec<Table> = Vec::new();
/// let prepared = inflation::InflationPrepared::new(&scene)?;
/// let record = inflation::run(&prepared, &mut tables, &mut Silent)?;
/// // The sphere snaps dynamically at 2.22426, below the limit point at 2.47893.
/// assert!(record.outcome() == "end_of_time" && record.max_height.value < 1.7316535915);
/// # Ok::<(), Box<dyn std::error::Error>>(())
/// ```
///
/// # Errors
/// Rows refused by the sink; a state without an equilibrium below a piston.
pub fn run(
    prepared: &InflationPrepared,
    sink: &mut dyn Sink,
    hooks: &mut dyn Hooks,
) -> Result<InflationRecord> {
    let given = &prepared.given;
    let mut motion: Box<dyn Moving + '_> = match (&prepared.start, &given.mover) {
        (InflationStart::Sphere(sphere), _) => sphere.clone(),
        (InflationStart::Disc(disc), _) => disc.clone(),
        (InflationStart::Piston(start), Mover::Piston(piston)) => {
            Box::new(PistonMotion::new(start, piston, given)?)
        }
        _ => return Err(Error::domain("a piston starts from the scene of a piston")),
    };
    let trajectory = Trajectory::begin(columns(prepared.units, given), sink)?;
    let fields = match &prepared.start {
        InflationStart::Disc(_) => Some(sink.begin(field_columns(prepared.units))?),
        _ => None,
    };
    let mut record = InflationRecord::new(
        prepared.units,
        prepared.scene.clone(),
        given,
        motion.moment(0.0)?,
    );
    let stride = given.samples.div_ceil(PROFILES);
    let last = given.samples - 1;
    for (i, t) in sample_times(given.duration, given.samples).enumerate() {
        let gone = loop {
            let gone = motion.go(t, STRETCH);
            let reached = motion.time() >= t;
            hooks.progress(
                (motion.time() / given.duration).min(1.0),
                motion.time().min(t),
            );
            if gone.is_err() || reached || hooks.interrupted() {
                break gone.map(|()| reached);
            }
        };
        match gone {
            Err(end) => {
                record.end = Some(end);
                break;
            }
            Ok(false) => {
                record.interrupted = true;
                break;
            }
            Ok(true) => {}
        }
        for moment in motion.jumps().into_iter().chain([motion.moment(t)?]) {
            let row = record.look(moment);
            trajectory.row(&row, sink, hooks)?;
        }
        if let (Some(fields), true) = (fields, i % stride == 0 || i == last) {
            let profile = motion.profile();
            for [s, r, z] in &profile {
                sink.row(fields, &[t, *s, *r, *z].map(Cell::Real))?;
            }
            let places = profile.into_iter().map(|[_, r, z]| [r, z]);
            record.profiles.push((t, places.collect()));
        }
        if hooks.interrupted() {
            record.interrupted = i < last;
            break;
        }
    }
    motion.finish(&mut record);
    record
        .events
        .extend(record.end.as_ref().and_then(InflationEnd::event));
    let time = |value: &Value| value["t"].as_f64().unwrap_or(f64::NAN);
    record.events.sort_by(|a, b| time(a).total_cmp(&time(b)));
    tell(record.events.clone(), hooks);
    Ok(record)
}

/// Trajectory table of a membrane without rows: names, units and meanings of the columns.
pub fn columns(u: Units, given: &InflationScene) -> Table {
    let height = match given.membrane.shape {
        Shape::Sphere => "radius of the sphere",
        Shape::Disc => "height of the pole over the edge",
    };
    let mut columns = vec![
        Column::reals("t", u.time(), "time"),
        Column::reals("height", u.length(), height),
        Column::reals("stretch", "", "stretch at the pole"),
        Column::reals("volume", u.volume(), "volume inside"),
        Column::reals("pressure", u.stress(), "pressure inside less outside"),
    ];
    if matches!(given.mover, Mover::Piston(_)) {
        columns.extend([
            Column::reals("piston", u.length(), "place of the piston in the vessel"),
            Column::reals("velocity", u.velocity(), "its velocity into the vessel"),
        ]);
    } else {
        columns.push(Column::reals(
            "velocity",
            u.velocity(),
            "rate of the height",
        ));
    }
    columns.extend([
        Column::reals("kinetic", u.energy(), "kinetic energy"),
        Column::reals("elastic", u.energy(), "energy stored in the membrane"),
        Column::reals(
            "gas",
            u.energy(),
            "energy of the gas and of what is outside, less that at the start",
        ),
        Column::reals("dissipated", u.energy(), "energy lost in snaps so far"),
        Column::reals(
            "work",
            u.energy(),
            "work so far of a pressure over time, or of the force on a piston",
        ),
        Column::reals("error", u.energy(), "error of the balance"),
    ]);
    Table::new("trajectory", columns)
}

fn field_columns(u: Units) -> Table {
    let columns = vec![
        Column::reals("t", u.time(), "time"),
        Column::reals("s", u.length(), "radius of a rim of the unloaded disc"),
        Column::reals("r", u.length(), "its distance from the axis"),
        Column::reals("z", u.length(), "its height over the edge"),
    ];
    Table::new("fields", columns)
}
