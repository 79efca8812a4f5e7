//! Record of the run of a flow, in the units of the scene.

use super::FlowPrepared;
use crate::error::Stuck;
use crate::flow::FlowLedger;
use crate::flow::starling::{Cycle, HopfPoint};
use crate::scene::Units;
use crate::study::bar::ShockTrack;
use crate::study::exact;
use serde_json::{Value, json};

/// The numbers of a flow at one time.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct FlowMoment {
    /// The time.
    pub time: f64,
    /// Least area over A0, with its place; the area of a lumped tube.
    pub least: (f64, f64),
    /// Flow into the tube, and out of it.
    pub flows: [f64; 2],
    /// Pressures at the two ends; of a lumped tube the one inside, twice.
    pub pressures: [f64; 2],
    /// Greatest speed index S, with its place.
    pub index: (f64, f64),
    /// Energies; zero for a lumped tube.
    pub ledger: FlowLedger,
}

/// The run of a flow.
#[derive(Debug, Clone)]
pub struct FlowRecord {
    /// The scene's units.
    pub units: Units,
    /// The scene, with its defaults.
    pub scene: Value,
    /// Requested end of time.
    pub duration: f64,
    /// Length of the tube; 0 for a lumped one.
    pub length: f64,
    /// The samples.
    pub moments: Vec<FlowMoment>,
    /// Times of the stored field.
    pub times: Vec<f64>,
    /// Places of the stored field.
    pub x: Vec<f64>,
    /// Area over A0 at each time and place.
    pub areas: Vec<Vec<f64>>,
    /// The detected elastic jumps.
    pub jumps: Vec<ShockTrack>,
    /// Events in the order of time.
    pub events: Vec<Value>,
    /// The limit cycle that was reached, if any.
    pub cycle: Option<Cycle>,
    /// The point of Hopf's bifurcation of a lumped tube below the pressure of the scene, if any.
    pub hopf: Option<HopfPoint>,
    /// Reason for an early end.
    pub stuck: Option<Stuck>,
    /// True if it was interrupted.
    pub interrupted: bool,
}

impl FlowRecord {
    pub(super) fn new(prepared: &FlowPrepared) -> Self {
        Self {
            units: prepared.units,
            scene: prepared.scene.clone(),
            duration: prepared.given.duration,
            length: prepared.length(),
            moments: Vec::new(),
            times: Vec::new(),
            x: Vec::new(),
            areas: Vec::new(),
            jumps: Vec::new(),
            events: Vec::new(),
            cycle: None,
            hopf: None,
            stuck: None,
            interrupted: false,
        }
    }

    /// Stable key of the outcome.
    pub fn outcome(&self) -> &'static str {
        match (&self.stuck, self.interrupted) {
            (Some(_), _) => "stuck",
            (None, true) => "interrupted",
            (None, false) => "end_of_time",
        }
    }

    /// Reason for an early end, if any.
    pub fn reason(&self) -> Option<String> {
        if let Some(stuck) = &self.stuck {
            return Some(format!("at t = {}: {}", exact(stuck.at), stuck.message()));
        }
        self.interrupted.then(|| "it was interrupted".to_owned())
    }

    /// The last sample.
    pub fn last(&self) -> Option<&FlowMoment> {
        self.moments.last()
    }

    /// True for a lumped tube.
    pub fn is_lumped(&self) -> bool {
        self.length == 0.0
    }

    /// Content of summary.json.
    pub fn summary(&self) -> Value {
        let mut summary = json!({
            "scene": self.scene,
            "outcome": self.outcome(),
            "reason": self.reason(),
        });
        if self.is_lumped() {
            summary["end"] = json!(self.last().map(|at| json!({
                "t": at.time, "area": at.least.0, "Q1": at.flows[0], "Q2": at.flows[1],
                "pressure": at.pressures[0], "S": at.index.0,
            })));
            summary["cycle"] = json!(self.cycle.map(|cycle| json!({
                "period": cycle.period, "maxima": cycle.lag, "min": cycle.min, "max": cycle.max,
            })));
            summary["hopf"] = json!(self.hopf.map(|hopf| json!({
                "pressure": hopf.pressure, "area": hopf.state.area, "flow": hopf.state.inflow, "period": hopf.period,
            })));
            return summary;
        }
        summary["end"] = json!(self.last().map(|at| {
            let l = &at.ledger;
            json!({
                "t": at.time,
                "least_area": at.least.0, "inflow": at.flows[0], "outflow": at.flows[1],
                "upstream_pressure": at.pressures[0], "downstream_pressure": at.pressures[1],
                "S": at.index.0,
                "ledger": {
                    "kinetic": l.kinetic, "wall": l.wall, "work": l.work, "outside": l.outside,
                    "friction": l.friction, "jumps": l.jumps, "error": l.error,
                },
            })
        }));
        summary["jumps"] = json!(self.jumps);
        summary
    }
}
