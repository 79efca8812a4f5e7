//! Record of the run of a bar, in the units of the scene.

use super::{BarPrepared, ShockTrack, thinned};
use crate::bar::breaking::Breaking;
use crate::bar::{EndState, Extremes, Ledger, Snapshot};
use crate::error::Stuck;
use crate::scene::Units;
use crate::study::exact;
use serde_json::{Value, json};

/// The ends and the ledger of a bar at one time.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct BarMoment {
    /// The time.
    pub time: f64,
    /// The states of the ends X = 0 and X = length.
    pub ends: [EndState; 2],
    /// Energies and momenta.
    pub ledger: Ledger,
}

/// The run of a bar.
#[derive(Debug, Clone)]
pub struct BarRecord {
    /// The scene's units.
    pub units: Units,
    /// The scene, with its defaults.
    pub scene: Value,
    /// Requested end of time.
    pub duration: f64,
    /// The undeformed length.
    pub length: f64,
    /// The name of the scheme.
    pub scheme: &'static str,
    /// Mass of the bar, and its ratio to the mass of a body at the end, if any.
    pub mass: (f64, Option<f64>),
    /// The samples.
    pub moments: Vec<BarMoment>,
    /// Times of the stored field.
    pub times: Vec<f64>,
    /// Material coordinates of the stored field.
    pub x: Vec<f64>,
    /// Stress at each time and place.
    pub field: Vec<Vec<f64>>,
    /// Stretch at each time and place.
    pub stretches: Vec<Vec<f64>>,
    /// Characteristics, as points (t, X).
    pub rays: Vec<Vec<[f64; 2]>>,
    /// Time and place of the first wave breaking, from the envelope of the characteristics of the loaded end.
    pub breaking: Option<Breaking>,
    /// The detected shocks.
    pub shocks: Vec<ShockTrack>,
    /// Bounds of the stress at X = 0.
    pub wall: Extremes,
    /// Bounds of the stress at X = length.
    pub tip: Extremes,
    /// Reason for an early end.
    pub stuck: Option<Stuck>,
    /// True if it was interrupted.
    pub interrupted: bool,
}

impl BarRecord {
    pub(super) fn new(prepared: &BarPrepared, start: &Snapshot) -> Self {
        let (bar, given) = (&prepared.bar, &prepared.given);
        let none = Extremes {
            min: f64::NAN,
            min_time: f64::NAN,
            max: f64::NAN,
            max_time: f64::NAN,
        };
        Self {
            units: prepared.units,
            scene: prepared.scene.clone(),
            duration: given.duration,
            length: given.length,
            scheme: given.scheme.name(),
            mass: (bar.mass(), given.mass.map(|mass| bar.mass() / mass)),
            moments: Vec::new(),
            times: Vec::new(),
            x: thinned(start.x.len()).map(|i| start.x[i]).collect(),
            field: Vec::new(),
            stretches: Vec::new(),
            rays: Vec::new(),
            breaking: None,
            shocks: Vec::new(),
            wall: none,
            tip: none,
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

    /// The greatest gap of momentum and impulse, relative to the greatest momentum.
    pub fn momentum_error(&self) -> f64 {
        let ledgers = self.moments.iter().map(|at| at.ledger);
        let (gap, most) = ledgers.fold((0.0f64, 0.0f64), |(gap, most), l| {
            (
                gap.max((l.momentum - l.impulse).abs()),
                most.max(l.momentum.abs()),
            )
        });
        if gap == 0.0 { 0.0 } else { gap / most }
    }

    /// The last sample.
    pub fn last(&self) -> Option<&BarMoment> {
        self.moments.last()
    }

    /// Content of summary.json.
    pub fn summary(&self) -> Value {
        let extremes = |at: &Extremes| json!({ "min": at.min, "min_time": at.min_time, "max": at.max, "max_time": at.max_time });
        let mut shocks: Vec<Value> = Vec::new();
        for (track, shock) in self.shocks.iter().enumerate() {
            shocks.extend(shock.points.iter().map(|point| {
                json!({
                    "time": point.time, "position": point.position, "speed": point.speed, "loss_rate": point.loss_rate,
                    "ahead": point.ahead, "behind": point.behind, "track": track,
                })
            }));
        }
        let time = |value: &Value| value["time"].as_f64().unwrap_or(f64::NAN);
        shocks.sort_by(|a, b| time(a).total_cmp(&time(b)));
        let breaking = self.breaking.map(|first| {
            json!({ "time": first.time, "position": first.position, "emitted": first.emitted })
        });
        json!({
            "scene": self.scene,
            "outcome": self.outcome(),
            "reason": self.reason(),
            "scheme": self.scheme,
            "bar_mass": self.mass.0,
            "eps": self.mass.1,
            "end": self.last().map(|at| {
                let ends = at.ends.map(|end| json!({ "x": end.position, "v": end.velocity, "stress": end.stress }));
                let l = &at.ledger;
                json!({
                    "t": at.time, "base": ends[0], "tip": ends[1],
                    "ledger": {
                        "kinetic": l.kinetic, "elastic": l.strain, "work": l.work, "dissipated": l.lost,
                        "dissipated_by_faces": l.dissipated, "momentum": l.momentum, "impulse": l.impulse,
                    },
                })
            }),
            "momentum_error": { "relative": self.momentum_error() },
            "breaking": breaking,
            "shocks": shocks,
            "wall": extremes(&self.wall),
            "tip": extremes(&self.tip),
        })
    }

    /// The breaking, and birth and end of every detected shock, in the order of time.
    pub fn events(&self) -> Vec<Value> {
        let mut events = Vec::new();
        if let Some(first) = &self.breaking {
            events.push(json!({ "kind": "breaking", "t": first.time, "X": first.position }));
        }
        for (track, shock) in self.shocks.iter().enumerate() {
            if let (Some(from), Some(to)) = (shock.points.first(), shock.points.last()) {
                events.push(json!({ "kind": "shock", "t": from.time, "X": from.position, "track": track, "from": from, "to": to }));
            }
        }
        let time = |value: &Value| value["t"].as_f64().unwrap_or(f64::NAN);
        events.sort_by(|a, b| time(a).total_cmp(&time(b)));
        events
    }
}
