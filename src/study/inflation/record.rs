//! Record of the run of a membrane in motion, in the units of the scene.

use crate::membrane::rings::{Collapse, Height};
use crate::motion::{Ledger, LedgerClosure, Outcome};
use crate::scene::{InflationScene, Units};
use crate::study::{Cell, exact};
use serde_json::{Value, json};

/// Error of the ledger, over the largest term, above which the energies are doubted.
const OPEN: f64 = 1e-3;

/// The numbers of a membrane in motion at one time.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct InflationMoment {
    /// The time.
    pub time: f64,
    /// Height of the pole of a disc over the edge, or radius of a sphere.
    pub height: f64,
    /// Stretch at the pole.
    pub stretch: f64,
    /// Volume inside.
    pub volume: f64,
    /// Pressure inside less outside.
    pub pressure: f64,
    /// Place of a piston in the vessel.
    pub piston: Option<f64>,
    /// Velocity of the piston into the vessel, or rate of the height without a piston.
    pub velocity: f64,
    /// Energies. The potential is that of the gas and of the air outside, 0 at the start.
    pub ledger: Ledger,
}

/// Why a membrane does not go on.
#[derive(Debug, Clone, PartialEq)]
pub enum InflationEnd {
    /// A sphere grew past the stretch 30, at this time.
    Burst(f64),
    /// A sphere fell to the stretch 0.1, at this time.
    Implosion(f64),
    /// A ring of a disc collapsed.
    Collapse(Collapse),
    /// A piston drew the balloon slack, at this time.
    Slack(f64),
    /// A piston came to the bottom of the vessel, at this time.
    Bottom(f64),
    /// The computation stopped at this time, with a reason.
    Stuck(f64, String),
    /// A bound on the run of a piston, at this time.
    Stopped(f64, Outcome),
}

impl InflationEnd {
    /// A stable key.
    pub fn key(&self) -> &'static str {
        match self {
            Self::Burst(_) => "burst",
            Self::Implosion(_) | Self::Collapse(_) => "collapse",
            Self::Slack(_) => "slack",
            Self::Bottom(_) => "bottom",
            Self::Stuck(..) => "stuck",
            Self::Stopped(_, outcome) => outcome.key(),
        }
    }

    /// Time of the end.
    pub fn time(&self) -> f64 {
        match self {
            Self::Collapse(collapse) => collapse.at.time,
            Self::Burst(t)
            | Self::Implosion(t)
            | Self::Slack(t)
            | Self::Bottom(t)
            | Self::Stuck(t, _)
            | Self::Stopped(t, _) => *t,
        }
    }

    /// The end in words, with a way out.
    fn words(&self) -> String {
        match self {
            Self::Burst(_) => "the stretch has grown past 30, and rubber tears far below: lower the pressure, or end the run earlier".to_owned(),
            Self::Implosion(_) => "the stretch has fallen to 0.1, and the sphere has wrinkled before: give it more pressure, or end the run earlier".to_owned(),
            Self::Collapse(Collapse { at, stretch }) => format!(
                "ring {} from the pole has collapsed to the stretch {} along its {}, and a sheet wrinkles before: load it more gently, or end the \
                 run earlier",
                at.ring,
                exact(*stretch),
                at.direction
            ),
            Self::Slack(_) => "the piston has drawn the balloon slack, and a slack balloon wrinkles: start with less speed, or push more".to_owned(),
            Self::Bottom(_) => "the piston has come to the bottom of the vessel, and all gas is in the balloon: give more gas, or push less".to_owned(),
            Self::Stuck(_, why) => why.clone(),
            Self::Stopped(_, outcome) => format!("{outcome}: end the run earlier, or make the piston heavier"),
        }
    }

    /// The end as an event, if it is one of the membrane.
    pub(super) fn event(&self) -> Option<Value> {
        match self {
            Self::Stuck(..) | Self::Stopped(..) => None,
            Self::Collapse(Collapse { at, stretch }) => Some(json!({
                "kind": "collapse", "t": at.time, "ring": at.ring, "direction": at.direction.to_string(), "stretch": stretch,
            })),
            other => Some(json!({ "kind": other.key(), "t": other.time() })),
        }
    }
}

/// A periodic motion of a sphere.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Oscillation {
    /// Period.
    pub period: f64,
    /// Least stretch.
    pub min: f64,
    /// Greatest stretch.
    pub max: f64,
}

/// A pressure at which a sphere snaps, and the stretch of the sphere.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct SnapPressure {
    /// Pressure inside less outside.
    pub pressure: f64,
    /// Stretch.
    pub stretch: f64,
}

impl SnapPressure {
    fn json(&self) -> Value {
        json!({ "pressure": self.pressure, "stretch": self.stretch })
    }
}

/// The run of a membrane in motion.
#[derive(Debug, Clone)]
pub struct InflationRecord {
    /// The scene's units.
    pub units: Units,
    /// The scene, with its defaults.
    pub scene: Value,
    /// Requested end of time.
    pub duration: f64,
    /// The samples.
    pub moments: Vec<InflationMoment>,
    /// Profiles of a disc, places [r, z] from the pole to the edge, each with its time.
    pub profiles: Vec<(f64, Vec<[f64; 2]>)>,
    /// Events in the order of time.
    pub events: Vec<Value>,
    /// The greatest height, also between samples.
    pub max_height: Height,
    /// The periodic motion of a sphere whose last turns repeat.
    pub oscillation: Option<Oscillation>,
    /// Of a sphere under a pressure: the step from rest at which it snaps, and its first limit point.
    pub snaps_at: Option<[Option<SnapPressure>; 2]>,
    /// Steps and right-hand sides.
    pub work: [u64; 2],
    /// Closure of the ledger over the samples.
    pub closing: LedgerClosure,
    /// Reason for an early end.
    pub end: Option<InflationEnd>,
    /// True if it was interrupted.
    pub interrupted: bool,
    /// Sum of the ledger at the start.
    total: f64,
}

impl InflationRecord {
    pub(super) fn new(
        units: Units,
        scene: Value,
        given: &InflationScene,
        start: InflationMoment,
    ) -> Self {
        let total = start.ledger.total();
        Self {
            units,
            scene,
            duration: given.duration,
            moments: Vec::new(),
            profiles: Vec::new(),
            events: Vec::new(),
            max_height: Height {
                value: start.height,
                time: 0.0,
            },
            oscillation: None,
            snaps_at: None,
            work: [0, 0],
            closing: LedgerClosure::new(total),
            end: None,
            interrupted: false,
            total,
        }
    }

    /// Adds a sample; returns its row.
    pub(super) fn look(&mut self, at: InflationMoment) -> Vec<Cell> {
        let l = at.ledger;
        self.closing.look(&l);
        self.moments.push(at);
        let places = [at.time, at.height, at.stretch, at.volume, at.pressure];
        let energies = [
            at.velocity,
            l.kinetic,
            l.elastic,
            l.potential,
            l.dissipated,
            l.work,
            l.total() - self.total,
        ];
        let numbers = places.into_iter().chain(at.piston).chain(energies);
        numbers.map(Cell::Real).collect()
    }

    /// Stable key of the outcome.
    pub fn outcome(&self) -> &'static str {
        match (&self.end, self.interrupted) {
            (Some(end), _) => end.key(),
            (None, true) => "interrupted",
            (None, false) => "end_of_time",
        }
    }

    /// Reason for an early end, if any.
    pub fn reason(&self) -> Option<String> {
        if let Some(end) = &self.end {
            return Some(format!("at t = {}: {}", exact(end.time()), end.words()));
        }
        self.interrupted.then(|| "it was interrupted".to_owned())
    }

    /// Warning about energies that do not balance.
    pub fn warning(&self) -> Option<String> {
        let open = self.closing.relative();
        // NaN is open.
        (!(open <= OPEN)).then(|| {
            format!(
                "the ledger is open by {open:.0e} of its largest term, and the energies cannot be trusted: the motion is small beside the numbers of \
                 its energies, or the disc needs more elements"
            )
        })
    }

    /// The last sample.
    pub fn last(&self) -> Option<&InflationMoment> {
        self.moments.last()
    }

    /// Times of the snaps of a piston.
    pub fn snap_times(&self) -> Vec<f64> {
        let snaps = self.events.iter().filter(|event| event["kind"] == "snap");
        snaps.filter_map(|event| event["t"].as_f64()).collect()
    }

    /// Content of summary.json.
    pub fn summary(&self) -> Value {
        let mut summary = json!({
            "scene": self.scene,
            "outcome": self.outcome(),
            "reason": self.reason(),
            "warning": self.warning(),
            "max_height": { "value": self.max_height.value, "at": self.max_height.time },
            "energy_error": { "absolute": self.closing.error, "relative": self.closing.relative() },
            "work": { "steps": self.work[0], "evaluations": self.work[1] },
            "end": self.last().map(|at| {
                let l = &at.ledger;
                json!({
                    "t": at.time, "height": at.height, "stretch": at.stretch, "volume": at.volume, "pressure": at.pressure,
                    "piston": at.piston, "velocity": at.velocity,
                    "kinetic": l.kinetic, "elastic": l.elastic, "gas": l.potential, "dissipated": l.dissipated, "work": l.work,
                })
            }),
            "oscillation": self.oscillation.map(|found| json!({
                "period": found.period, "min": found.min, "max": found.max,
            })),
        });
        if let Some([dynamic, at_rest]) = &self.snaps_at {
            summary["dynamic_snap"] = json!(dynamic.as_ref().map(SnapPressure::json));
            summary["limit_point"] = json!(at_rest.as_ref().map(SnapPressure::json));
        }
        summary
    }
}
