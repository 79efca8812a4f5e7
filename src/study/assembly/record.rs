//! What the run of an assembly leaves behind, in the scene's units.

use crate::motion::{Closing, Ledger, Outcome, Snap};
use crate::scene::{Scales, Units};
use crate::solve::cost::Cost;
use crate::study::run::Bounds;
use crate::study::run::record::at_time;
use crate::study::run::summary::{elastic_cost, object};
use nalgebra::{Isometry3, Vector3};
use serde_json::{Map, Value, json};

/// The run of an assembly that has ended.
#[derive(Debug, Clone)]
pub struct AssemblyRunRecord {
    /// The scene's units.
    pub units: Units,
    /// The units of the first rod and body in those of the scene.
    pub scales: Scales,
    /// The scene, with its defaults.
    pub scene: Value,
    /// Names of the bodies, in order.
    pub bodies: Vec<String>,
    /// Names of the rods, in order.
    pub rods: Vec<String>,
    /// The end of time that was asked for.
    pub duration: f64,
    /// The bounds of the scene.
    pub bounds: Bounds,
    /// The first state.
    pub first: AssemblyMoment,
    /// The last state.
    pub last: AssemblyMoment,
    /// Every rod at the first state: poses of sections from base to end.
    pub first_shapes: Vec<Vec<Isometry3<f64>>>,
    /// The same at the last.
    pub last_shapes: Vec<Vec<Isometry3<f64>>>,
    /// The Morse index, with the bodies free, of the equilibrium at the start, if it is one.
    pub start_index: Option<usize>,
    /// How it ended; times in the units of the rod.
    pub outcome: Outcome,
    /// Its cost.
    pub cost: Cost,
    /// Its snaps, in the units of the rod.
    pub snaps: Vec<Snap>,
    /// How well its ledger closes, in the scene's units.
    pub closing: Closing,
}

/// A state in the world and the scene's units.
#[derive(Debug, Clone, PartialEq)]
pub struct AssemblyMoment {
    /// Time.
    pub t: f64,
    /// The bodies, in order.
    pub bodies: Vec<BodyMoment>,
    /// Energies.
    pub ledger: Ledger,
    /// What should not change: [`Ledger::total`].
    pub total: f64,
    /// The Morse indices of the rods with their ends held, added up.
    pub index: Option<usize>,
}

/// Where a body is and how it moves.
#[derive(Debug, Clone, PartialEq)]
pub struct BodyMoment {
    /// Pose of its frame.
    pub pose: Isometry3<f64>,
    /// Velocity of the origin of its frame.
    pub velocity: Vector3<f64>,
    /// Angular velocity.
    pub angular_velocity: Vector3<f64>,
}

impl BodyMoment {
    /// Position, quaternion (w, x, y, z), velocity, angular velocity.
    pub(super) fn numbers(&self) -> impl Iterator<Item = f64> {
        let (r, q) = (self.pose.translation.vector, self.pose.rotation);
        let (v, w) = (self.velocity, self.angular_velocity);
        let parts = [q.w, q.i, q.j, q.k].into_iter();
        [r.x, r.y, r.z]
            .into_iter()
            .chain(parts)
            .chain([v.x, v.y, v.z, w.x, w.y, w.z])
    }
}

impl AssemblyRunRecord {
    /// A stable key of how the run ended: [`Outcome::key`].
    pub fn outcome(&self) -> &'static str {
        self.outcome.key()
    }

    /// Why the run fell short of what was asked, in the scene's units; None if it did not.
    pub fn reason(&self) -> Option<String> {
        if self.outcome.is_complete() {
            return None;
        }
        let why = self.bounds.reason(&self.outcome, &self.scales, self.units);
        Some(at_time(self.last.t, self.units, "", &why))
    }

    /// What is to be said of an unstable start.
    pub fn warning(&self) -> Option<String> {
        let index = self.start_index.filter(|index| *index > 0)?;
        Some(format!(
            "the equilibrium at the start has Morse index {index}: it is not stable, and the bodies leave it as rounding or velocities \
             will; give the bodies a `guess` near a stable one"
        ))
    }

    /// What came of the run.
    pub fn summary(&self) -> Value {
        let (k, reason) = (&self.scales, self.reason());
        let mut summary = object(json!({
            "outcome": self.outcome(),
            "complete": reason.is_none(),
            "reason": reason,
            "units": self.units,
            "start": self.state(&self.first),
            "end": self.state(&self.last),
            "energy_error": { "absolute": self.closing.error, "relative": self.closing.relative() },
            "snaps": self.snaps.len(),
            "start_index": self.start_index,
            "work": elastic_cost(&self.cost),
            "scales": { "length": k.length, "force": k.force, "energy": k.energy, "time": k.time },
            "versions": { "snaprod": env!("CARGO_PKG_VERSION") },
            "scene": self.scene,
        }));
        if let Some(warning) = self.warning() {
            summary.insert("warning".to_owned(), json!(warning));
        }
        Value::Object(summary)
    }

    /// Snaps, in the order of time.
    pub fn events(&self) -> Vec<Value> {
        let k = &self.scales;
        let event = |snap: &Snap| {
            json!({
                "kind": "snap",
                "t": snap.t * k.time,
                "rod": self.rods.get(snap.rod),
                "from": { "index": snap.from.index, "elastic": snap.from.elastic * k.energy },
                "to": { "index": snap.to.index, "elastic": snap.to.elastic * k.energy },
                "released": snap.released * k.energy,
                "time_error": snap.time_error * k.time,
            })
        };
        self.snaps.iter().map(event).collect()
    }

    fn state(&self, at: &AssemblyMoment) -> Value {
        let bodies = self.bodies.iter().zip(&at.bodies).map(|(name, body)| {
            let q = body.pose.rotation;
            let described = json!({
                "position": body.pose.translation.vector.as_slice(),
                "quaternion": [q.w, q.i, q.j, q.k],
                "velocity": body.velocity.as_slice(),
                "angular_velocity": body.angular_velocity.as_slice(),
            });
            (name.clone(), described)
        });
        let ledger = &at.ledger;
        json!({
            "t": at.t,
            "bodies": bodies.collect::<Map<_, _>>(),
            "kinetic": ledger.kinetic,
            "elastic": ledger.elastic,
            "potential": ledger.potential,
            "dissipated": ledger.dissipated,
            "work": ledger.work,
            "total": at.total,
            "index": at.index,
        })
    }
}
