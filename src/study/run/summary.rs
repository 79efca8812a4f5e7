//! A run's record as JSON: summary.json and events.json.

use super::bounces::Bounces;
use super::header::RunHeader;
use super::moment::{BodyMoment, Moment, ShapesAt};
use super::outward::RunBounce;
use super::record::{RunBranch, RunRecord};
use super::table::trajectory_name;
use crate::elastica::Equilibrium;
use crate::error::Quantity;
use crate::motion::viscoelastic::Layer;
use crate::motion::{LightSnap, Outcome, Snap, SnapEnd};
use crate::scene::RodMassNote;
use crate::solve::cost::Cost;
use crate::study::assembly::pose_json;
use crate::study::light_rod_reference;
use crate::study::neglected_mass::FoldPassed;
use nalgebra::DVector;
use serde_json::{Map, Value, json};

impl RunRecord {
    /// Content of summary.json: outcome, first and last state, errors, cost, scales, the resolved scene.
    pub fn summary(&self) -> Value {
        let (header, root, last) = (&self.header, &self.branches[0], self.last());
        let (k, reason) = (&header.scales, self.reason());
        let (absolute, relative) = self.energy_error();
        let mut summary = object(json!({
            "outcome": self.outcome(),
            "complete": reason.is_none(),
            "reason": reason,
            "units": header.units,
            "start": self.state(&root.first, root.shapes.first()),
            "end": self.state(&last.last, last.shapes.last()),
            "energy_error": { "absolute": absolute, "relative": relative },
            "work": self.cost(),
            "scales": { "length": k.length, "force": k.force, "energy": k.energy, "time": k.time },
            "versions": { "snaprod": env!("CARGO_PKG_VERSION") },
            "scene": header.scene,
        }));
        let mut add = |key: &str, value: Value| summary.insert(key.to_owned(), value);
        if header.is_elastic() || header.is_assembly() {
            let snaps = self.branches.iter().map(|b| b.all_snaps().count());
            add("snaps", json!(snaps.sum::<usize>()));
            add("start_index", json!(self.start_index));
            if header.in_space() {
                add("drift", json!(self.worst(|closing| closing.drift)));
            }
        } else {
            let layers = self.branches.iter().map(|b| b.layers.len());
            add("layers", json!(layers.sum::<usize>()));
        }
        if let Some(nodes) = last.resolution {
            let mut found = object(json!({ "most": nodes.most_nodes, "tail": nodes.tail }));
            let rate = nodes
                .rate_tail
                .map(|rate| ("rate_tail".to_owned(), json!(rate)));
            found.extend(rate);
            let why = last.why_no_elements.as_ref();
            found.extend(why.map(|why| ("no_elements".to_owned(), json!(why))));
            add("nodes", Value::Object(found));
        }
        // null: no contact detection.
        let mut contact = header.held().map(|rod| rod.thickness);
        if header.is_assembly() {
            add("contact_diameters", json!(contact.collect::<Vec<_>>()));
        } else if header.in_space() {
            add("contact_diameter", json!(contact.next().flatten()));
        }
        if let Some(spring) = &self.spring {
            add("reduction", json!(spring.as_ref().ok()));
            add("not_reduced", json!(spring.as_ref().err()));
            if self.start_index.is_some() {
                add("start_index", json!(self.start_index));
            }
        }
        let masses: Vec<Value> = header.masses.iter().map(RodMassNote::json).collect();
        match masses.as_slice() {
            [] => {}
            _ if header.is_assembly() => drop(add("rod_masses", json!(masses))),
            [mass, ..] => drop(add("rod_mass", mass.clone())),
        }
        let branches = || self.branches.iter().map(|b| self.branch(b)).collect();
        let several = self.branches.len() > 1;
        let known = [
            ("validity", self.validity.as_ref().map(|found| found.json())),
            ("warning", self.warning().map(Value::String)),
            ("rod_unfelt", self.time_without_mass().map(|t| json!(t))),
            (
                "light_rod_lost",
                self.missing_folds_note().map(Value::String),
            ),
            ("bounces", self.all_bounces()),
            ("contact", self.contact_summary()),
            ("branches", several.then(|| Value::Array(branches()))),
        ];
        for (key, value) in known {
            summary.extend(value.map(|value| (key.to_owned(), value)));
        }
        Value::Object(summary)
    }

    /// Snaps, or layers, in the order of time along each branch.
    pub fn events(&self) -> Vec<Value> {
        let several = self.branches.len() > 1;
        let mut events = Vec::new();
        for branch in &self.branches {
            let before = events.len();
            for snap in branch.all_snaps() {
                let mut event = self.header.snap(snap);
                if let Some(fold) = self.fold_of(snap, branch) {
                    event.insert("mass".to_owned(), fold.json());
                }
                if several {
                    event.insert("branch".to_owned(), json!(branch.id));
                    event.insert("parent".to_owned(), json!(branch.parent));
                }
                events.push(Value::Object(event));
            }
            events.extend(self.passages_of(branch));
            if branch.contacts.is_some() {
                let mut all: Vec<(f64, Value)> = events
                    .split_off(before)
                    .into_iter()
                    .map(|event| (event["t"].as_f64().unwrap_or(f64::NAN), event))
                    .chain(self.contact_events(branch))
                    .collect();
                all.sort_by(|a, b| a.0.total_cmp(&b.0));
                events.extend(all.into_iter().map(|(_, event)| event));
            }
            if let Outcome::RodTouch(touch) = &branch.outcome {
                let header = &self.header;
                events.push(json!({
                    "kind": touch.bound.key(),
                    "t": branch.last.t,
                    "a": header.rod_name(touch.rod).unwrap_or("rod"),
                    "b": header.obstacles.get(touch.obstacle).map(|obstacle| &obstacle.name),
                    "s": header.scales.outward(Quantity::Length, touch.s),
                }));
            }
            if let Outcome::SelfContact(contact) = &branch.outcome {
                let mut event =
                    json!({ "kind": "self_contact", "t": branch.last.t, "s": contact.at });
                if self.header.is_assembly() {
                    event["rods"] = json!(contact.rods.map(|k| self.header.rod_name(k)));
                }
                events.push(event);
            }
        }
        events
    }

    /// The fold of a rod of known mass at a snap of a branch.
    fn fold_of(&self, snap: &Snap, branch: &RunBranch) -> Option<&FoldPassed> {
        let rod = self.header.rod_name(snap.rod);
        let mut here = self.folds.iter().filter(|fold| fold.branch == branch.id);
        here.find(|fold| fold.t == snap.t && fold.rod.as_deref() == rod)
    }

    /// Layers, folds of light rods passed without a jump, and intervals without light rods, in the order of time.
    fn passages_of(&self, branch: &RunBranch) -> Vec<Value> {
        let layers = branch.layers.iter().map(|l| (l.from, layer(l)));
        let crossed = branch.crossed.iter().map(|LightSnap { snap, .. }| {
            let fold = self.fold_of(snap, branch);
            let event = Value::Object(self.header.snap(snap));
            (snap.t, FoldPassed::event(fold, event))
        });
        let lost = branch.lost.iter();
        let lost = lost.map(|l| (l.from, light_rod_reference::event(l, &self.header)));
        let mut all: Vec<(f64, Value)> = layers.chain(crossed).chain(lost).collect();
        all.sort_by(|a, b| a.0.total_cmp(&b.0));
        all.into_iter().map(|(_, event)| event).collect()
    }

    fn branch(&self, branch: &RunBranch) -> Value {
        json!({
            "branch": branch.id,
            "parent": branch.parent,
            "outcome": branch.outcome.key(),
            "from": branch.first.t,
            "end": self.state(&branch.last, branch.shapes.last()),
            "reached": branch.entered.as_ref().map(|snap| snap.reached),
            "trajectory": trajectory_name(branch.id) + ".csv",
        })
    }

    /// A state; `shapes` of the rods for the free ends of an assembly.
    fn state(&self, at: &Moment, shapes: Option<&ShapesAt>) -> Value {
        let (header, ledger) = (&self.header, &at.ledger);
        let mut state = object(json!({
            "t": at.t,
            "kinetic": ledger.kinetic,
            "elastic": ledger.elastic,
            "potential": ledger.potential,
            "dissipated": ledger.dissipated,
            "work": ledger.work,
            "total": at.total,
        }));
        if header.heavy {
            state.insert("rod_kinetic".to_owned(), json!(ledger.rod_kinetic));
            state.insert("numerical_loss".to_owned(), json!(at.numerical_loss));
        }
        if header.in_space() && (header.is_elastic() || header.is_assembly()) {
            state.insert("index".to_owned(), json!(at.index));
        }
        if header.is_assembly() {
            let named = header.bodies.iter().zip(&at.bodies);
            let bodies: Map<String, Value> = named
                .map(|(body, at)| (body.name.clone(), body_json(at)))
                .collect();
            state.insert("bodies".to_owned(), json!(bodies));
            let rods = header
                .rods
                .iter()
                .zip(shapes.into_iter().flat_map(|at| &at.rods));
            let free = rods.filter(|(rod, _)| rod.free);
            let ends: Map<String, Value> = free
                .map(|(rod, shape)| (rod.name.clone(), json!(shape.last().map(pose_json))))
                .collect();
            if !ends.is_empty() {
                state.insert("free_ends".to_owned(), json!(ends));
            }
        } else {
            state.extend(self.end_json(at));
        }
        Value::Object(state)
    }

    /// The end of one rod; in the plane with the labels of the equilibrium.
    fn end_json(&self, at: &Moment) -> Map<String, Value> {
        let (end, r) = (at.end(), at.position());
        let (q, v, w) = (end.pose.rotation, end.velocity, end.angular_velocity);
        let action = end.action.unwrap_or_default();
        let (f, m) = (action.force, action.couple);
        let mut state = object(json!({
            "x": r.x, "y": r.y,
            "vx": v.x, "vy": v.y,
            "fx": f.x, "fy": f.y,
        }));
        let labels = at.labels.as_ref();
        state.extend(object(if self.header.in_space() {
            json!({
                "z": r.z, "vz": v.z, "fz": f.z,
                "qw": q.w, "qx": q.i, "qy": q.j, "qz": q.k,
                "wx": w.x, "wy": w.y, "wz": w.z,
                "mx": m.x, "my": m.y, "mz": m.z,
            })
        } else {
            json!({
                "lam": labels.map(|l| l.lambda()),
                "p": labels.map(|l| l.p),
                "w": labels.map(|l| l.w),
                "mode": labels.map(|l| l.sheet.mode),
                "sign": labels.map(|l| l.sheet.sign.as_str()),
                "index": labels.map(|l| l.index),
            })
        }));
        state
    }

    /// Bounces of all branches; `None` without bounces.
    fn all_bounces(&self) -> Option<Value> {
        let branches = self.branches.iter().map(|branch| &branch.bounces);
        let (count, hardest) = Bounces::of(branches.clone())?;
        let first = branches
            .flat_map(|b| &b.first)
            .map(|b| self.header.bounce(b));
        let first: Vec<Value> = first.collect();
        Some(json!({ "count": count, "hardest": self.header.bounce(hardest), "first": first }))
    }

    fn cost(&self) -> Value {
        let each = self.branches.iter().map(|b| b.cost);
        let all = each.fold(Cost::default(), |sum, cost| sum + cost);
        let mut cost = object(json!({
            "evaluations": all.evaluations,
            "steps": all.steps,
            "rejected": all.rejected,
        }));
        cost.extend(object(
            if self.header.is_elastic() || self.header.is_assembly() {
                json!({ "dense": all.samples })
            } else {
                json!({
                    "implicit_steps": all.implicit_steps,
                    "jacobians": all.jacobians,
                    "factorisations": all.factorisations,
                    "iterations": all.iterations,
                })
            },
        ));
        Value::Object(cost)
    }
}

impl RunHeader {
    /// A snap.
    pub(super) fn snap(&self, snap: &Snap) -> Map<String, Value> {
        let end = |e: &SnapEnd| {
            let mut end = match e.sheet {
                Some(sheet) => object(json!({
                    "lam": Equilibrium::new(e.q[0], e.q[1]).ok().map(|e| e.lambda),
                    "p": e.q[0],
                    "w": e.q[1],
                    "mode": sheet.mode,
                    "sign": sheet.sign.as_str(),
                })),
                None => object(json!({
                    "couple": e.q.rows(0, 3).as_slice(),
                    "force": e.q.rows(3, 3).as_slice(),
                })),
            };
            end.extend(object(json!({ "index": e.index, "elastic": e.elastic })));
            Value::Object(end)
        };
        let mut event = object(json!({
            "kind": "snap",
            "t": snap.t,
            "from": end(&snap.from),
            "to": end(&snap.to),
            "released": snap.released,
            "time_error": snap.time_error,
        }));
        event.extend(self.place(snap.rod, &snap.pose, &snap.velocity));
        if let Some(choices) = snap.choices {
            // Landings among which a rule chose, and whether the viscous flow leads to the chosen one.
            event.extend(object(
                json!({ "choices": choices, "reached": snap.reached }),
            ));
        }
        event
    }

    /// Place of an event: name of the rod in an assembly; of one rod position and velocity of the end, in two or three
    /// components.
    fn place(
        &self,
        rod: usize,
        pose: &DVector<f64>,
        velocity: &DVector<f64>,
    ) -> Map<String, Value> {
        if self.is_assembly() {
            return object(json!({ "rod": self.rod_name(rod) }));
        }
        let r = ["x", "y", "z"].into_iter().zip(pose.iter());
        let v = ["vx", "vy", "vz"].into_iter().zip(velocity.iter());
        r.chain(v)
            .map(|(name, x)| (name.to_owned(), json!(x)))
            .collect()
    }

    /// A bounce.
    pub(super) fn bounce(&self, bounce: &RunBounce) -> Value {
        let mut told = object(json!({
            "kind": "bounce",
            "t": bounce.t,
            "tension": bounce.tension,
            "lam": bounce.lambda,
            "elastic": bounce.elastic,
            "friction_time": bounce.friction_time,
        }));
        told.extend(self.place(bounce.rod, &bounce.pose, &bounce.velocity));
        if self.is_sheet() {
            told.insert("viscosity".to_owned(), json!(bounce.viscosity));
        }
        Value::Object(told)
    }
}

/// A body of an assembly.
fn body_json(at: &BodyMoment) -> Value {
    let q = at.pose.rotation;
    let mut body = object(json!({
        "position": at.pose.translation.vector.as_slice(),
        "quaternion": [q.w, q.i, q.j, q.k],
        "velocity": at.velocity.as_slice(),
        "angular_velocity": at.angular_velocity.as_slice(),
    }));
    if let Some(force) = at.groove {
        body.insert("groove_force".to_owned(), json!(force.as_slice()));
    }
    Value::Object(body)
}

/// A layer.
pub(super) fn layer(layer: &Layer) -> Value {
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

/// The entries of a JSON object.
pub(in crate::study) fn object(value: Value) -> Map<String, Value> {
    match value {
        Value::Object(map) => map,
        _ => Map::new(),
    }
}
