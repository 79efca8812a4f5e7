//! A run's record as JSON: summary.json and events.json.

use super::ModelKind;
use super::bounces::{Bounces, bounce_json};
use super::record::{Moment, RunBranch, RunRecord};
use super::table::trajectory_name;
use crate::elastica::Equilibrium;
use crate::motion::viscoelastic::Layer;
use crate::motion::{Bounce, Outcome, Snap, SnapEnd};
use crate::solve::cost::Cost;
use crate::study::light_rod_reference;
use crate::study::neglected_mass::FoldPassed;
use nalgebra::DVector;
use serde_json::{Map, Value, json};

impl RunRecord {
    /// Content of summary.json: outcome, first and last state, errors, cost, scales, the resolved scene.
    pub fn summary(&self) -> Value {
        let k = &self.scales;
        let (root, last) = (&self.branches[0], self.last());
        let reason = self.reason();
        let (absolute, relative) = self.energy_error();
        let mut summary = object(json!({
            "outcome": self.outcome(),
            "complete": reason.is_none(),
            "reason": reason,
            "units": self.units,
            "start": self.state(&root.first),
            "end": self.state(&last.last),
            "energy_error": { "absolute": absolute, "relative": relative },
            "work": self.cost(),
            "scales": { "length": k.length, "force": k.force, "energy": k.energy, "time": k.time },
            "versions": { "snaprod": env!("CARGO_PKG_VERSION") },
            "scene": self.scene,
        }));
        let mut add = |key: &str, value: Value| summary.insert(key.to_owned(), value);
        match self.kind {
            ModelKind::Sheet | ModelKind::ElasticSpace => {
                let snaps = |b: &RunBranch| b.snaps.len() + usize::from(b.entered.is_some());
                add(
                    "snaps",
                    json!(self.branches.iter().map(snaps).sum::<usize>()),
                );
                add("start_index", json!(self.start_index));
            }
            ModelKind::Planar | ModelKind::Space => {
                let layers = self.branches.iter().map(|b| b.layers.len());
                add("layers", json!(layers.sum::<usize>()));
                let nodes = last.resolution;
                add(
                    "nodes",
                    json!(nodes.map(|n| match n.rate_tail {
                        None => json!({ "most": n.most_nodes, "tail": n.tail }),
                        Some(rate) =>
                            json!({ "most": n.most_nodes, "tail": n.tail, "rate_tail": rate }),
                    })),
                );
            }
        }
        if self.kind == ModelKind::ElasticSpace {
            let drift = self.branches.iter().map(|b| b.closing.drift);
            add("drift", json!(drift.fold(0.0, f64::max)));
        }
        if self.kind.in_space() {
            // null: no contact detection.
            add("contact_diameter", json!(self.thickness));
        }
        if let Some(spring) = &self.spring {
            add("reduction", json!(spring.as_ref().ok()));
            add("not_reduced", json!(spring.as_ref().err()));
            if self.start_index.is_some() {
                add("start_index", json!(self.start_index));
            }
        }
        if let Some(mass) = &self.mass {
            add("rod_mass", mass.json());
        }
        if let Some(validity) = &self.validity {
            add("validity", validity.json());
        }
        if let Some(warning) = self.warning() {
            add("warning", json!(warning));
        }
        if let Some(time) = self.time_without_mass() {
            add("rod_unfelt", json!(time));
        }
        if let Some(untold) = self.missing_folds_note() {
            add("light_rod_lost", json!(untold));
        }
        let bounces = self.branches.iter().map(|branch| &branch.bounces);
        if let Some(bounces) = Bounces::json(bounces, |bounce| self.bounce(bounce)) {
            add("bounces", bounces);
        }
        if self.branches.len() > 1 {
            let branches: Vec<Value> = self.branches.iter().map(|b| self.branch(b)).collect();
            add("branches", json!(branches));
        }
        Value::Object(summary)
    }

    /// Snaps, or layers, in the order of time along each branch.
    pub fn events(&self) -> Vec<Value> {
        let several = self.branches.len() > 1;
        let mut events = Vec::new();
        for branch in &self.branches {
            for snap in branch.entered.iter().chain(&branch.snaps) {
                let mut event = object(self.snap(snap));
                let t = snap.t * self.scales.time;
                let mut passed = self.passed(branch.id);
                if let Some(fold) = passed.find(|fold| fold.t == t) {
                    event.insert("mass".to_owned(), fold.json());
                }
                if several {
                    event.insert("branch".to_owned(), json!(branch.id));
                    event.insert("parent".to_owned(), json!(branch.parent));
                }
                events.push(Value::Object(event));
            }
            events.extend(self.passages_of(branch));
            if let Outcome::SelfContact(contact) = &branch.outcome {
                let at = contact.at.map(|s| s * self.scales.length);
                events.push(json!({ "kind": "self_contact", "t": branch.last.t, "s": at }));
            }
        }
        events
    }

    fn passed(&self, branch: usize) -> impl Iterator<Item = &FoldPassed> {
        let of = move |fold: &&FoldPassed| fold.branch == branch;
        self.folds.iter().filter(of)
    }

    /// Layers and folds of the light rod passed without a jump, in the order of time.
    fn passages_of(&self, branch: &RunBranch) -> Vec<Value> {
        let mut all: Vec<(f64, Value)> = branch.layers.iter().map(|l| (l.from, layer(l))).collect();
        for crossed in &branch.crossed {
            let t = crossed.snap.t * self.scales.time;
            let fold = self.passed(branch.id).find(|fold| fold.t == t);
            all.push((t, FoldPassed::event(fold, self.snap(&crossed.snap))));
        }
        let lost = branch.lost.iter();
        all.extend(lost.map(|l| {
            (
                l.from * self.scales.time,
                light_rod_reference::event(l, &[], &self.scales),
            )
        }));
        all.sort_by(|a, b| a.0.total_cmp(&b.0));
        all.into_iter().map(|(_, event)| event).collect()
    }

    fn branch(&self, branch: &RunBranch) -> Value {
        json!({
            "branch": branch.id,
            "parent": branch.parent,
            "outcome": branch.outcome.key(),
            "from": branch.first.t,
            "end": self.state(&branch.last),
            "reached": branch.entered.as_ref().map(|snap| snap.reached),
            "trajectory": trajectory_name(branch.id) + ".csv",
        })
    }

    fn state(&self, at: &Moment) -> Value {
        let (r, v, f) = (at.position(), at.velocity, at.force);
        let ledger = &at.ledger;
        let mut state = object(json!({
            "t": at.t,
            "x": r.x, "y": r.y,
            "vx": v.x, "vy": v.y,
            "fx": f.x, "fy": f.y,
            "kinetic": ledger.kinetic,
            "elastic": ledger.elastic,
            "potential": ledger.potential,
            "dissipated": ledger.dissipated,
            "work": ledger.work,
            "total": at.total,
        }));
        if self.heavy {
            state.insert("rod_kinetic".to_owned(), json!(ledger.rod_kinetic));
        }
        let labels = at.labels.as_ref();
        let (q, w, m) = (at.pose.rotation, at.angular_velocity, at.couple);
        state.extend(object(match self.kind {
            ModelKind::ElasticSpace | ModelKind::Space => json!({
                "z": r.z, "vz": v.z, "fz": f.z,
                "qw": q.w, "qx": q.i, "qy": q.j, "qz": q.k,
                "wx": w.x, "wy": w.y, "wz": w.z,
                "mx": m.x, "my": m.y, "mz": m.z,
            }),
            ModelKind::Sheet | ModelKind::Planar => json!({
                "lam": labels.map(|l| l.lambda()),
                "p": labels.map(|l| l.p),
                "w": labels.map(|l| l.w),
                "mode": labels.map(|l| l.sheet.mode),
                "sign": labels.map(|l| l.sheet.sign.as_str()),
                "index": labels.map(|l| l.index),
            }),
        }));
        if self.kind == ModelKind::ElasticSpace {
            state.insert("index".to_owned(), json!(at.index));
        }
        Value::Object(state)
    }

    fn snap(&self, snap: &Snap) -> Value {
        let k = &self.scales;
        let end = |e: &SnapEnd| {
            let mut end = match e.sheet {
                Some(sheet) => object(json!({
                    "lam": Equilibrium::new(e.q[0], e.q[1]).ok().map(|e| e.lambda),
                    "p": e.q[0],
                    "w": e.q[1],
                    "mode": sheet.mode,
                    "sign": sheet.sign.as_str(),
                })),
                // The base wrench along the directors of the clamp.
                None => object(json!({
                    "couple": e.q.rows(0, 3).iter().map(|m| m * k.energy).collect::<Vec<_>>(),
                    "force": e.q.rows(3, 3).iter().map(|n| n * k.energy / k.length).collect::<Vec<_>>(),
                })),
            };
            end.extend(object(
                json!({ "index": e.index, "elastic": e.elastic * k.energy }),
            ));
            Value::Object(end)
        };
        let mut event = object(json!({ "kind": "snap", "t": snap.t * k.time }));
        event.extend(self.place(&snap.pose, &snap.velocity));
        event.extend(object(json!({
            "from": end(&snap.from),
            "to": end(&snap.to),
            "released": snap.released * k.energy,
            "time_error": snap.time_error * k.time,
        })));
        event.extend(choice(snap));
        Value::Object(event)
    }

    /// Position and velocity of the end, in two or three components.
    fn place(&self, pose: &DVector<f64>, velocity: &DVector<f64>) -> Map<String, Value> {
        let k = &self.scales;
        let named = |names: [&'static str; 3], values: &DVector<f64>, unit: f64| {
            let values: Vec<f64> = values.iter().map(|x| x * unit).collect();
            let named = names.into_iter().zip(values);
            named.map(|(name, x)| (name.to_owned(), json!(x)))
        };
        named(["x", "y", "z"], pose, k.length)
            .chain(named(["vx", "vy", "vz"], velocity, k.velocity))
            .collect()
    }

    fn bounce(&self, bounce: &Bounce) -> Value {
        let k = &self.scales;
        let mut told = bounce_json(bounce, k, self.place(&bounce.pose, &bounce.velocity));
        if self.kind == ModelKind::Sheet {
            told.insert(
                "viscosity".to_owned(),
                json!(bounce.viscosity() * k.viscosity()),
            );
        }
        Value::Object(told)
    }

    fn cost(&self) -> Value {
        let each = self.branches.iter().map(|b| b.cost);
        let all = each.fold(Cost::default(), |sum, cost| sum + cost);
        match self.kind {
            ModelKind::Sheet | ModelKind::ElasticSpace => elastic_cost(&all),
            ModelKind::Planar | ModelKind::Space => json!({
                "evaluations": all.evaluations,
                "steps": all.steps,
                "implicit_steps": all.implicit_steps,
                "rejected": all.rejected,
                "jacobians": all.jacobians,
                "factorisations": all.factorisations,
                "iterations": all.iterations,
            }),
        }
    }
}

/// Cost of an elastic run.
pub(in crate::study) fn elastic_cost(cost: &Cost) -> Value {
    json!({
        "evaluations": cost.evaluations,
        "steps": cost.steps,
        "rejected": cost.rejected,
        "dense": cost.samples,
    })
}

fn layer(layer: &Layer) -> Value {
    json!({
        "kind": "layer",
        "from": layer.from,
        "to": layer.to,
        "peak": layer.peak,
        "elastic_from": layer.elastic_from,
        "elastic_to": layer.elastic_to,
        "released": layer.elastic_from - layer.elastic_to,
        "dissipated": layer.dissipated,
        "whole": layer.whole,
    })
}

/// Landings among which a rule chose, and whether the viscous flow leads to the chosen one; empty without such a
/// rule.
pub(in crate::study) fn choice(snap: &Snap) -> Map<String, Value> {
    snap.choices.map_or_else(Map::new, |choices| {
        object(json!({ "choices": choices, "reached": snap.reached }))
    })
}

/// The entries of a JSON object.
pub(in crate::study) fn object(value: Value) -> Map<String, Value> {
    match value {
        Value::Object(map) => map,
        _ => Map::new(),
    }
}
