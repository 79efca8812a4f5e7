//! Run of a bar in longitudinal motion: waves, shocks and dissipation.

mod record;
mod track;

pub use record::{BarMoment, BarRecord};
pub use track::{ShockPoint, ShockTrack};

use super::{Cell, Column, Hooks, Sink, Table, Trajectory, tell};
use crate::bar::breaking::{self, Breaking};
use crate::bar::{Bar, End, Law1d, Scheme, Snapshot, motion, shocks};
use crate::error::{Error, Result};
use crate::scene::{BarScene, Scene, Units};
pub(in crate::study) use track::Tracker;

/// Largest number of times and places in the stored field.
const FIELD_TIMES: usize = 400;
const FIELD_PLACES: usize = 300;
/// Number of steps between two checks for an interrupt.
const STRETCH: usize = 10_000;
/// Number of drawn characteristics.
const RAYS: usize = 16;

/// A scene of a bar ready to run.
pub struct BarPrepared {
    scene: serde_json::Value,
    given: BarScene,
    units: Units,
    bar: Bar,
}

impl BarPrepared {
    /// The bar of a scene.
    ///
    /// # Errors
    /// A scene of another kind; invalid data of a bar.
    pub fn new(scene: &Scene) -> Result<Self> {
        let other = || Error::domain("this is no bar: its [rod] has not model = \"bar\"");
        let given = scene.bar().cloned().ok_or_else(other)?;
        Ok(Self {
            scene: serde_json::to_value(scene)
                .map_err(|e| Error::io("the scene cannot be written").caused_by(e))?,
            units: scene.units,
            bar: given.bar()?,
            given,
        })
    }

    /// The scene of the bar.
    pub(in crate::study) fn given(&self) -> &BarScene {
        &self.given
    }

    /// The bar.
    pub fn bar(&self) -> &Bar {
        &self.bar
    }

    /// Time and place of the first wave breaking, from the envelope of the characteristics of the loaded end.
    pub fn breaking(&self) -> Option<Breaking> {
        breaking::first(&self.bar, self.given.duration)
    }
}

/// Runs a bar to its end. Rows of the tables `trajectory` and `waves` go to `sink` as the run goes on. A run that
/// ends early is no error: [`BarRecord::reason`] says why.
///
/// ```
/// use snaprod::scene::Scene;
/// use snaprod::study::{Silent, Table, bar};
/// let scene = Scene::parse(
///     r#"
///     [rod]
///     model = "bar"
///     length = 3.0
///     area = 0.0314
///     density = 1e-4
///     law = { mooney = [24.0, 1.5] }
///     cells = 150
///     [loads]
///     force = { block = { size = 2.0, until = 0.002 } }
///     [run]
///     duration = 0.003
///     samples = 31
///     "#,
/// )?;
/// let mut tables: Vec<Table> = Vec::new();
/// let record = bar::run(&bar::BarPrepared::new(&scene)?, &mut tables, &mut Silent)?;
/// let shock = record.shocks.last().unwrap().points.last().unwrap();
/// assert!((shock.speed + 992.144).abs() < 1.0); // by theory
/// # Ok::<(), Box<dyn std::error::Error>>(())
/// ```
///
/// # Errors
/// A bar beyond the capability of the scheme; rows refused by the sink.
pub fn run(
    prepared: &BarPrepared,
    sink: &mut dyn Sink,
    hooks: &mut dyn Hooks,
) -> Result<BarRecord> {
    let (given, bar, u) = (&prepared.given, &prepared.bar, prepared.units);
    let mut motion = motion(
        bar,
        given.scheme,
        given.cells,
        given.time_step,
        given.unstable,
    )?;
    let trajectory = Trajectory::begin(trajectory(u), sink)?;
    let waves = sink.begin(waves(u))?;
    let mut record = BarRecord::new(prepared, &motion.snapshot());
    let mut tracker = Tracker::default();
    let rows = given.samples - 1;
    let stride = given.samples.div_ceil(FIELD_TIMES);
    for i in 0..=rows {
        let t = given.duration * i as f64 / rows as f64;
        let gone = loop {
            let gone = motion.go(t, STRETCH);
            hooks.progress(motion.time() / given.duration, motion.time());
            if gone.is_err() || motion.time() >= t || hooks.interrupted() {
                break gone;
            }
        };
        if let Err(stuck) = gone {
            record.stuck = Some(stuck);
            break;
        }
        if motion.time() < t {
            record.interrupted = true;
            break;
        }
        let (now, ledger) = (motion.snapshot(), motion.ledger());
        let found = match given.scheme {
            Scheme::FiniteVolume => shocks(bar, &now),
            _ => Vec::new(),
        };
        tracker.look(t, &found, bar.length() / given.cells as f64);
        let [base, tip] = now.ends;
        let loss: f64 = found.iter().map(|shock| shock.loss_rate).sum();
        let row = [
            t,
            tip.position,
            tip.velocity,
            tip.stress,
            base.position,
            base.velocity,
            base.stress,
            ledger.kinetic,
            ledger.strain,
            ledger.work,
            ledger.lost,
            ledger.momentum,
            ledger.impulse,
            loss,
        ]
        .map(Cell::Real);
        trajectory.row(&row, sink, hooks)?;
        if i % stride == 0 || i == rows {
            for k in thinned(now.x.len()) {
                let row = [t, now.x[k], now.stretch[k], now.velocity[k], now.stress[k]];
                sink.row(waves, &row.map(Cell::Real))?;
            }
            record.see(&now);
        }
        record.moments.push(BarMoment {
            time: t,
            ends: now.ends,
            ledger,
        });
        if hooks.interrupted() {
            record.interrupted = i < rows;
            break;
        }
    }
    record.wall = motion.extremes()[0];
    record.tip = motion.extremes()[1];
    record.shocks = tracker.finish();
    record.breaking = prepared.breaking();
    record.rays = rays(bar, &record);
    tell(record.events(), hooks);
    Ok(record)
}

/// Indices of evenly spaced places, the last included.
fn thinned(count: usize) -> impl Iterator<Item = usize> {
    let stride = count.div_ceil(FIELD_PLACES);
    (0..count).filter(move |i| i % stride == 0 || i + 1 == count)
}

/// Trajectory table of a bar without rows: names, units and meanings of the columns.
pub fn columns(scene: &Scene) -> Table {
    trajectory(scene.units)
}

fn trajectory(u: Units) -> Table {
    let momentum = if u == Units::Si { "N s" } else { "" };
    Table::new(
        "trajectory",
        vec![
            Column::reals("t", u.time(), "time"),
            Column::reals("x", u.length(), "place of the end X = length"),
            Column::reals("v", u.velocity(), "velocity of that end"),
            Column::reals("tip_stress", u.stress(), "stress in the bar there"),
            Column::reals("base_x", u.length(), "place of the end X = 0"),
            Column::reals("base_v", u.velocity(), "velocity of that end"),
            Column::reals("base_stress", u.stress(), "stress in the bar there"),
            Column::reals("kinetic", u.energy(), "kinetic energy of bar and body"),
            Column::reals("elastic", u.energy(), "strain energy"),
            Column::reals("work", u.energy(), "work of the load since the start"),
            Column::reals(
                "dissipated",
                u.energy(),
                "energy lost, in shocks or by the scheme",
            ),
            Column::reals("momentum", momentum, "momentum gained along +X"),
            Column::reals(
                "impulse",
                momentum,
                "impulse of load and walls since the start",
            ),
            Column::reals(
                "shock_power",
                u.power(),
                "power lost in the shocks seen, by their states",
            ),
        ],
    )
}

fn waves(u: Units) -> Table {
    Table::new(
        "waves",
        vec![
            Column::reals("t", u.time(), "time"),
            Column::reals("X", u.length(), "material coordinate"),
            Column::reals("stretch", "", "stretch"),
            Column::reals("velocity", u.velocity(), "velocity"),
            Column::reals("stress", u.stress(), "force per undeformed area"),
        ],
    )
}

/// Characteristics through the stored field, reflected at the ends. They start at even times from a loaded or heavy
/// end, otherwise from the middle at the start.
fn rays(bar: &Bar, record: &BarRecord) -> Vec<Vec<[f64; 2]>> {
    let Some(last) = record.times.last() else {
        return Vec::new();
    };
    let driven = |side: usize| bar.ends()[side] != End::Wall;
    let (from, way) = if driven(1) {
        (bar.length(), -1.0)
    } else {
        (0.0, 1.0)
    };
    let one = |k: usize| {
        let (mut t, mut x, mut way) = (last * k as f64 / RAYS as f64, from, way);
        let mut ray = vec![[t, x]];
        let dt = last / 2000.0;
        while t < *last {
            // Heun's step.
            let c = record.speed_at(bar, t, x);
            let ahead = (x + way * c * dt).clamp(0.0, bar.length());
            x += 0.5 * way * dt * (c + record.speed_at(bar, t + dt, ahead));
            t += dt;
            if !(x > 0.0 && x < bar.length()) {
                x = x.clamp(0.0, bar.length());
                way = -way;
            }
            ray.push([t, x]);
        }
        ray
    };
    (0..RAYS).map(one).collect()
}

/// Storage of states as fields.
impl BarRecord {
    fn see(&mut self, now: &Snapshot) {
        self.times.push(now.time);
        self.field
            .push(thinned(now.x.len()).map(|i| now.stress[i]).collect());
        self.stretches
            .push(thinned(now.x.len()).map(|i| now.stretch[i]).collect());
    }

    /// Wave speed at a time and a place, bilinear in the stretch.
    fn speed_at(&self, bar: &Bar, t: f64, x: f64) -> f64 {
        let (i, a) = cell(&self.times, t);
        let (j, b) = cell(&self.x, x);
        let at = |i: usize| {
            let row = &self.stretches[i.min(self.stretches.len() - 1)];
            row[j] + b * (row[(j + 1).min(row.len() - 1)] - row[j])
        };
        bar.material().speed(at(i) + a * (at(i + 1) - at(i)))
    }
}

/// Interval of an ascending list that contains a value, and the fraction of the interval before the value.
fn cell(list: &[f64], value: f64) -> (usize, f64) {
    let after = list
        .partition_point(|x| *x <= value)
        .clamp(1, list.len().max(2) - 1);
    match (list.get(after - 1), list.get(after)) {
        (Some(a), Some(b)) => (after - 1, ((value - a) / (b - a)).clamp(0.0, 1.0)),
        _ => (0, 0.0),
    }
}
