//! Run of a flow in a tube: areas, jumps, choking, limit cycles.

mod record;

pub use record::{FlowMoment, FlowRecord};

use super::bar::Tracker;
use super::{Cell, Column, Hooks, Sink, Table, Trajectory, sample_times, tell};
use crate::bar::Shock;
use crate::error::{Error, Result};
use crate::flow::starling::{Starling, StarlingState};
use crate::flow::{FlowTube, FlowVolumes};
use crate::scene::{FlowMedium, FlowScene, Scene, Units};
use serde_json::{Value, json};

/// Largest number of times and places in the stored field.
const FIELD_TIMES: usize = 400;
const FIELD_PLACES: usize = 300;
/// Number of steps between two checks for an interrupt.
const STRETCH: usize = 2_000;
/// Part by which a lumped tube starts off the equilibrium, in the inflow.
const OFF: f64 = 0.02;

/// A scene of a flow ready to run.
pub struct FlowPrepared {
    scene: Value,
    given: FlowScene,
    units: Units,
    medium: Medium,
}

/// The medium in the form of the library.
enum Medium {
    Tube(Box<FlowTube>),
    Lumped(Box<Starling>),
}

impl FlowPrepared {
    /// The flow of a scene.
    ///
    /// # Errors
    /// A scene of another kind; a wall law without a flow.
    pub fn new(scene: &Scene) -> Result<Self> {
        let other = || Error::domain("this is no flow: it has no [tube] with [run]");
        let given = scene.flow().cloned().ok_or_else(other)?;
        let medium = match (given.tube()?, given.resistor()?) {
            (Some(tube), _) => Medium::Tube(Box::new(tube)),
            (None, Some(resistor)) => Medium::Lumped(Box::new(resistor)),
            (None, None) => return Err(other()),
        };
        Ok(Self {
            scene: serde_json::to_value(scene)
                .map_err(|e| Error::io("the scene cannot be written").caused_by(e))?,
            units: scene.units,
            given,
            medium,
        })
    }

    /// Length of the tube; 0 for a lumped one.
    fn length(&self) -> f64 {
        match &self.medium {
            Medium::Tube(tube) => tube.length,
            Medium::Lumped(_) => 0.0,
        }
    }
}

/// Runs a flow to its end. Rows of the tables `trajectory` and `fields` go to `sink` as the run goes on; a lumped tube
/// has no fields. A run that ends early is no error: [`FlowRecord::reason`] says why.
///
/// # Errors
/// A start that the scheme cannot compute; rows refused by the sink.
pub fn run(
    prepared: &FlowPrepared,
    sink: &mut dyn Sink,
    hooks: &mut dyn Hooks,
) -> Result<FlowRecord> {
    match (&prepared.medium, &prepared.given.medium) {
        (Medium::Lumped(resistor), FlowMedium::Lumped(given)) => {
            run_lumped(prepared, resistor, given.area, sink, hooks)
        }
        (Medium::Tube(tube), FlowMedium::Tube(given)) => {
            run_tube(prepared, tube, given.cells, sink, hooks)
        }
        _ => Err(Error::domain("a flow is of a tube or of a lumped one")),
    }
}

fn run_tube(
    prepared: &FlowPrepared,
    tube: &FlowTube,
    cells: usize,
    sink: &mut dyn Sink,
    hooks: &mut dyn Hooks,
) -> Result<FlowRecord> {
    let given = &prepared.given;
    let mut flow = FlowVolumes::new(tube, cells)?.bounded(given.time_step);
    let trajectory = Trajectory::begin(columns(prepared.units, given), sink)?;
    let fields = sink.begin(field_columns(prepared.units))?;
    let mut record = FlowRecord::new(prepared);
    let mut tracker = Tracker::of_standing();
    let mut watch = Watch::new(&flow);
    let stride = given.samples.div_ceil(FIELD_TIMES);
    let last = given.samples - 1;
    for (i, t) in sample_times(given.duration, given.samples).enumerate() {
        let gone = loop {
            let mut gone = Ok(());
            for _ in 0..STRETCH {
                if flow.time() >= t || gone.is_err() {
                    break;
                }
                gone = flow.step(t);
                watch.look(&flow, &mut record.events);
            }
            hooks.progress(flow.time() / given.duration, flow.time());
            if gone.is_err() || flow.time() >= t || hooks.interrupted() {
                break gone;
            }
        };
        // The ends at this time.
        let gone = gone.and_then(|()| flow.advance(flow.time()));
        if let Err(stuck) = gone {
            record.stuck = Some(stuck);
            break;
        }
        if flow.time() < t {
            record.interrupted = true;
            break;
        }
        let now = flow.snapshot();
        let found: Vec<Shock> = (flow.jumps().iter())
            .map(|jump| Shock {
                position: jump.position,
                speed: jump.speed,
                ahead: jump.ahead,
                behind: jump.behind,
                loss_rate: jump.loss_rate,
            })
            .collect();
        tracker.look(t, &found, tube.length / cells as f64);
        let [upstream, downstream] = now.ends;
        let moment = FlowMoment {
            time: t,
            least: flow.narrowest(),
            flows: [upstream.flow, downstream.flow],
            pressures: [upstream.pressure, downstream.pressure],
            index: flow.fastest(),
            ledger: flow.ledger(),
        };
        let l = moment.ledger;
        let row = [
            t,
            upstream.pressure,
            upstream.flow,
            downstream.pressure,
            downstream.flow,
            moment.least.0,
            moment.least.1,
            moment.index.0,
            moment.index.1,
            l.kinetic,
            l.wall,
            l.work,
            l.outside,
            l.friction,
            l.jumps,
            l.error,
        ];
        trajectory.row(&row.map(Cell::Real), sink, hooks)?;
        if i % stride == 0 || i == last {
            let ratios: Vec<f64> = (now.x.iter().zip(&now.area))
                .map(|(x, area)| area / (tube.places)(*x).area)
                .collect();
            let kept = || thinned(now.x.len());
            for k in kept() {
                let row = [
                    t,
                    now.x[k],
                    ratios[k],
                    now.velocity[k],
                    now.pressure[k],
                    now.index[k],
                ];
                sink.row(fields, &row.map(Cell::Real))?;
            }
            record.times.push(t);
            record.areas.push(kept().map(|k| ratios[k]).collect());
            record.x = kept().map(|k| now.x[k]).collect();
        }
        record.moments.push(moment);
        if hooks.interrupted() {
            record.interrupted = i < last;
            break;
        }
    }
    record.jumps = tracker.finish();
    let tracks = record.jumps.iter().enumerate();
    let births = tracks.filter_map(|(track, jump)| {
        let (from, to) = (jump.points.first()?, jump.points.last()?);
        Some(json!({
            "kind": "jump", "t": from.time, "x": from.position, "speed": from.speed, "track": track,
            "from": from, "to": to,
        }))
    });
    let births: Vec<Value> = births.collect();
    record.events.extend(births);
    let time = |value: &Value| value["t"].as_f64().unwrap_or(f64::NAN);
    record.events.sort_by(|a, b| time(a).total_cmp(&time(b)));
    tell(record.events.clone(), hooks);
    Ok(record)
}

/// Watch for the first time at which a flow is choked somewhere, and at which the wall touches itself.
struct Watch {
    /// Areas of contact, and the words of their events.
    contacts: Vec<(f64, &'static str)>,
    least: f64,
    index: f64,
    time: f64,
}

impl Watch {
    fn new(flow: &FlowVolumes) -> Self {
        let words = ["touch", "line"];
        Self {
            contacts: flow.tube().law.contacts().into_iter().zip(words).collect(),
            least: flow.narrowest().0,
            index: flow.fastest().0,
            time: flow.time(),
        }
    }

    /// Adds the events between the last look and now; times are by linear interpolation in the step.
    fn look(&mut self, flow: &FlowVolumes, events: &mut Vec<Value>) {
        let (least, at) = flow.narrowest();
        let (index, place) = flow.fastest();
        let time = flow.time();
        let moment = |before: f64, level: f64, now: f64| {
            self.time + (time - self.time) * (level - before) / (now - before)
        };
        let mut add = |kind: &str, t: f64, x: f64| {
            events.push(json!({ "kind": kind, "t": t, "x": x, "speed": flow.velocity_at(x) }));
        };
        for (level, word) in &self.contacts {
            if self.least > *level && least <= *level {
                add(word, moment(self.least, *level, least), at);
            }
        }
        if self.index < 1.0 && index >= 1.0 {
            add("choke", moment(self.index, 1.0, index), place);
        }
        (self.least, self.index, self.time) = (least, index, time);
    }
}

fn run_lumped(
    prepared: &FlowPrepared,
    resistor: &Starling,
    area: Option<f64>,
    sink: &mut dyn Sink,
    hooks: &mut dyn Hooks,
) -> Result<FlowRecord> {
    let given = &prepared.given;
    let equilibrium = resistor.equilibrium()?;
    let start = match area {
        Some(area) => StarlingState {
            area,
            ..equilibrium
        },
        None => StarlingState {
            inflow: equilibrium.inflow * (1.0 + OFF),
            ..equilibrium
        },
    };
    let mut motion = resistor.motion(start)?;
    let trajectory = Trajectory::begin(columns(prepared.units, given), sink)?;
    let mut record = FlowRecord::new(prepared);
    record.hopf = (resistor.pressure[1] < resistor.pressure[0])
        .then(|| {
            resistor
                .hopf(resistor.pressure[1], resistor.pressure[0])
                .ok()
                .flatten()
        })
        .flatten();
    for (i, t) in sample_times(given.duration, given.samples).enumerate() {
        if let Err(stuck) = motion.advance(t) {
            record.stuck = Some(stuck);
            break;
        }
        hooks.progress(t / given.duration, t);
        let now = motion.state();
        let inside = resistor.law.at(now.area).pressure + resistor.outside;
        let index = resistor.index(now);
        let row = [t, now.inflow, now.area, now.outflow, inside, index];
        trajectory.row(&row.map(Cell::Real), sink, hooks)?;
        record.moments.push(FlowMoment {
            time: t,
            least: (now.area, 0.0),
            flows: [now.inflow, now.outflow],
            pressures: [inside; 2],
            index: (index, 0.0),
            ledger: Default::default(),
        });
        if hooks.interrupted() {
            record.interrupted = i + 1 < given.samples;
            break;
        }
    }
    record.cycle = motion.cycle();
    Ok(record)
}

/// Indices of evenly spaced places, the last included.
fn thinned(count: usize) -> impl Iterator<Item = usize> {
    let stride = count.div_ceil(FIELD_PLACES);
    (0..count).filter(move |i| i % stride == 0 || i + 1 == count)
}

/// Trajectory table of a flow without rows: names, units and meanings of the columns.
pub fn columns(u: Units, given: &FlowScene) -> Table {
    let flow = if u == Units::Si { "m³/s" } else { "" };
    if let FlowMedium::Lumped(_) = given.medium {
        let columns = vec![
            Column::reals("t", "", "time"),
            Column::reals("Q1", "", "flow into the collapsible part"),
            Column::reals("area", "", "its area over A0"),
            Column::reals("Q2", "", "flow out of it"),
            Column::reals("pressure", "", "pressure in it"),
            Column::reals("S", "", "speed index u/c of the inflow"),
        ];
        return Table::new("trajectory", columns);
    }
    Table::new(
        "trajectory",
        vec![
            Column::reals("t", u.time(), "time"),
            Column::reals(
                "upstream_pressure",
                u.stress(),
                "pressure in the tube at x = 0",
            ),
            Column::reals("inflow", flow, "flow into the tube at x = 0"),
            Column::reals(
                "downstream_pressure",
                u.stress(),
                "pressure in the tube at x = length",
            ),
            Column::reals("outflow", flow, "flow out of the tube at x = length"),
            Column::reals("least_area", "", "least area A/A0"),
            Column::reals("least_area_x", u.length(), "its place"),
            Column::reals("S", "", "greatest speed index |u|/c"),
            Column::reals("S_x", u.length(), "its place"),
            Column::reals("kinetic", u.energy(), "kinetic energy of the fluid"),
            Column::reals("wall", u.energy(), "energy stored in the wall"),
            Column::reals(
                "work",
                u.energy(),
                "work at the ends on the fluid since the start",
            ),
            Column::reals(
                "outside",
                u.energy(),
                "work of the pressure outside since the start",
            ),
            Column::reals("friction", u.energy(), "energy lost to friction"),
            Column::reals(
                "jumps",
                u.energy(),
                "energy lost in elastic jumps, or by the scheme",
            ),
            Column::reals(
                "error",
                u.energy(),
                "error of the balance by the steps in time",
            ),
        ],
    )
}

fn field_columns(u: Units) -> Table {
    Table::new(
        "fields",
        vec![
            Column::reals("t", u.time(), "time"),
            Column::reals("x", u.length(), "place"),
            Column::reals("area", "", "area A/A0"),
            Column::reals("velocity", u.velocity(), "mean velocity of the fluid"),
            Column::reals("pressure", u.stress(), "pressure inside"),
            Column::reals("S", "", "speed index u/c"),
        ],
    )
}
