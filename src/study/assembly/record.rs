//! Record of the run of an assembly, in the units of the scene.

use super::equilibrium::pose_json;
use crate::assembly::Contact;
use crate::math::se3::halves;
use crate::motion::{
    Bounce, Ledger, LedgerClosure, LightSnap, Outcome, Resolution, Snap, SnapEnd, UnknownInterval,
};
use crate::scene::{Inertia, RodMassNote, Scales, Units};
use crate::solve::cost::Cost;
use crate::study::Solid;
use crate::study::light_rod_reference;
use crate::study::neglected_mass::{FoldPassed, Validity};
use crate::study::run::bounces::bounce_json;
use crate::study::run::record::at_time;
use crate::study::run::recorder::{outcome_key, resolution_warning, total_time};
use crate::study::run::summary::{choice, elastic_cost, object};
use crate::study::run::trajectory_name;
use crate::study::run::tree::BranchOrigin;
use crate::study::run::{Bounces, Bounds};
use nalgebra::{Isometry3, Vector3, Vector6};
use serde_json::{Map, Value, json};

/// Record of a completed run of an assembly, with all branches under landing = "all".
#[derive(Debug, Clone)]
pub struct AssemblyRunRecord {
    /// The scene's units.
    pub units: Units,
    /// Scales from units of the first rod and body to units of the scene.
    pub scales: Scales,
    /// The scene, with its defaults.
    pub scene: Value,
    /// Names of the bodies, in order.
    pub bodies: Vec<String>,
    /// Names of the rods that are held at both ends, in order.
    pub rods: Vec<String>,
    /// Names of the rods with a free end, in order.
    pub free: Vec<String>,
    /// Diameters of the rods for contact; `None` for rods without contact detection.
    pub thickness: Vec<Option<f64>>,
    /// The bodies as figures show them, in order.
    pub solids: Vec<Solid>,
    /// Requested end of time.
    pub duration: f64,
    /// The bounds of the scene.
    pub bounds: Bounds,
    /// Branches, each after its parent; the first is the trunk.
    pub branches: Vec<AssemblyRunBranch>,
    /// Number of snaps whose branches were not followed because the bound was reached.
    pub cut: usize,
    /// Morse index, with the bodies free, of the equilibrium at the start; `None` if unknown or not in equilibrium.
    pub start_index: Option<usize>,
    /// Treatment of the mass of each rod of known mass.
    pub masses: Vec<RodMassNote>,
    /// Folds passed by rods of known mass.
    pub folds: Vec<FoldPassed>,
    /// Validity of neglecting the mass of rods, where a mass is known and not followed in full.
    pub validity: Option<Validity>,
}

/// One run of an assembly: the trunk, or the continuation from a snap.
#[derive(Debug, Clone)]
pub struct AssemblyRunBranch {
    /// Origin of the branch; snaps in the units of the rod.
    pub stem: BranchOrigin,
    /// The first state.
    pub first: AssemblyMoment,
    /// The last state.
    pub last: AssemblyMoment,
    /// Every rod at the first state, those with a free end last: poses of sections from base to end.
    pub first_shapes: Vec<Vec<Isometry3<f64>>>,
    /// Every rod at the last state, those with a free end last: poses of sections from base to end.
    pub last_shapes: Vec<Vec<Isometry3<f64>>>,
    /// Samples for figures, thinned.
    pub track: Vec<AssemblyMoment>,
    /// Outcome of the run; times in the units of the rod.
    pub outcome: Outcome,
    /// Contact at the end of the run, if rods touch: arclengths from each rod's `from`, in the units of the scene.
    pub touching: Option<Contact>,
    /// Computational cost.
    pub cost: Cost,
    /// Time during which the mass of a light rod was inactive, in the units of the scene.
    pub unfelt: f64,
    /// Resolution of the strains of rods with mass.
    pub resolution: Option<Resolution>,
    /// Snaps of this branch, in the units of the rod.
    pub snaps: Vec<Snap>,
    /// Bounces of taut rods; positions of ends along the directors of the base.
    pub bounces: Bounces,
    /// Wrenches (couple, force) at the base of the rod before and after each of [`AssemblyRunBranch::all_snaps`],
    /// along the directors of the base, in the units of the scene.
    pub snap_wrenches: Vec<[Vector6<f64>; 2]>,
    /// Folds passed by the light rods that accompany rods with mass, in the units of the rod.
    pub crossed: Vec<LightSnap>,
    /// Wrenches at the folds in `crossed`, as in `snap_wrenches`.
    pub crossed_wrenches: Vec<[Vector6<f64>; 2]>,
    /// Intervals without light rods, in the units of the rod.
    pub lost: Vec<UnknownInterval>,
    /// Closure of the energy ledger, in the units of the scene.
    pub closing: LedgerClosure,
}

impl AssemblyRunBranch {
    /// The snap at which the branch begins, if any, and the snaps within the branch.
    pub fn all_snaps(&self) -> impl Iterator<Item = &Snap> {
        self.stem.entered.iter().chain(&self.snaps)
    }
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
    /// Conserved total: [`Ledger::total`].
    pub total: f64,
    /// Sum of the Morse indices of the rods with their ends held.
    pub index: Option<usize>,
}

/// Pose and velocity of a body.
#[derive(Debug, Clone, PartialEq)]
pub struct BodyMoment {
    /// Pose of the body frame.
    pub pose: Isometry3<f64>,
    /// Velocity of the origin of the body frame.
    pub velocity: Vector3<f64>,
    /// Angular velocity.
    pub angular_velocity: Vector3<f64>,
    /// Force of a groove on the body.
    pub groove: Option<Vector3<f64>>,
}

impl BodyMoment {
    /// Position, quaternion (w, x, y, z), velocity, angular velocity, force of the groove if there is one.
    pub(super) fn numbers(&self) -> impl Iterator<Item = f64> {
        let (r, q) = (self.pose.translation.vector, self.pose.rotation);
        let (v, w) = (self.velocity, self.angular_velocity);
        let parts = [q.w, q.i, q.j, q.k].into_iter();
        [r.x, r.y, r.z]
            .into_iter()
            .chain(parts)
            .chain([v.x, v.y, v.z, w.x, w.y, w.z])
            .chain(self.groove.iter().flat_map(|f| [f.x, f.y, f.z]))
    }
}

impl AssemblyRunRecord {
    /// The branch that ran last.
    pub fn last(&self) -> &AssemblyRunBranch {
        // Every record has a branch.
        &self.branches[self.branches.len() - 1]
    }

    /// Stable key of the outcome: [`Outcome::key`] of the first branch that ended early, branch_limit, or
    /// end_of_time.
    pub fn outcome(&self) -> &'static str {
        outcome_key(self.cut, self.branches.iter().map(|b| &b.outcome))
    }

    /// Reason for an early end, in the units of the scene; `None` for a complete run.
    pub fn reason(&self) -> Option<String> {
        if self.cut > 0 {
            return Some(self.bounds.cut(self.cut));
        }
        let branch = self.short()?;
        let name = |names: &[String], k: usize| names.get(k).cloned().unwrap_or_default();
        let why = match (&branch.outcome, &branch.touching) {
            (_, Some(touching)) => {
                let [a, b] = touching.rods.map(|k| name(&self.rods, k));
                Bounds::touching([&a, &b], touching.at, self.units)
            }
            (Outcome::GrooveEnd(body), _) => {
                let body = name(&self.bodies, *body);
                format!(
                    "{body} has come to the end of its groove; make the groove longer, or close it"
                )
            }
            (outcome, _) => self.bounds.reason(outcome, &self.scales, self.units),
        };
        Some(at_time(branch.last.t, self.units, "", &why))
    }

    fn short(&self) -> Option<&AssemblyRunBranch> {
        self.branches.iter().find(|b| !b.outcome.is_complete())
    }

    /// Warning about unresolved strain rates, energies beyond the tolerance, or an unstable start.
    pub fn warning(&self) -> Option<String> {
        let branches = self.branches.iter();
        let told = branches.map(|b| (&b.closing, b.resolution.and_then(|r| r.rate_tail)));
        resolution_warning(told, (self.scales.energy, self.units), &self.bounds)
            .or_else(|| self.unstable())
    }

    fn unstable(&self) -> Option<String> {
        let index = self.start_index.filter(|index| *index > 0)?;
        Some(format!(
            "the equilibrium at the start has Morse index {index}: it is unstable, and rounding or velocities decide how the bodies leave \
             it; give the bodies a `guess` near a stable one"
        ))
    }

    /// Times and reasons of missing folds of light rods; `None` if all are known, or there are no light rods.
    pub fn untold(&self) -> Option<String> {
        let lost: Vec<&UnknownInterval> = self.branches.iter().flat_map(|b| &b.lost).collect();
        light_rod_reference::note(&lost, &self.rods, (&self.scales, self.units))
    }

    /// Time during which the mass of a light rod was inactive, over all branches; `None` if it never was.
    pub fn unfelt(&self) -> Option<f64> {
        total_time(self.branches.iter().map(|branch| branch.unfelt))
    }

    /// Content of summary.json.
    pub fn summary(&self) -> Value {
        let (k, reason, last) = (&self.scales, self.reason(), self.last());
        let worst = |error: fn(&LedgerClosure) -> f64| {
            let each = self.branches.iter().map(|branch| error(&branch.closing));
            each.fold(0.0, f64::max)
        };
        let snaps = |b: &AssemblyRunBranch| b.all_snaps().count();
        let cost = self.branches.iter().map(|branch| branch.cost);
        let cost = cost.fold(Cost::default(), |sum, cost| sum + cost);
        let mut summary = object(json!({
            "outcome": self.outcome(),
            "complete": reason.is_none(),
            "reason": reason,
            "units": self.units,
            "start": self.state(&self.branches[0].first, &self.branches[0].first_shapes),
            "end": self.state(&last.last, &last.last_shapes),
            "energy_error": { "absolute": worst(|c| c.error), "relative": worst(LedgerClosure::relative) },
            "drift": worst(|c| c.drift),
            "snaps": self.branches.iter().map(snaps).sum::<usize>(),
            "start_index": self.start_index,
            // null: no contact detection for this rod.
            "contact_diameters": self.thickness,
            "work": elastic_cost(&cost),
            "scales": { "length": k.length, "force": k.force, "energy": k.energy, "time": k.time },
            "versions": { "snaprod": env!("CARGO_PKG_VERSION") },
            "scene": self.scene,
        }));
        if !self.masses.is_empty() {
            let masses: Vec<Value> = self.masses.iter().map(RodMassNote::json).collect();
            summary.insert("rod_masses".to_owned(), json!(masses));
        }
        if let Some(validity) = &self.validity {
            summary.insert("validity".to_owned(), validity.json());
        }
        let bounces = self.branches.iter().map(|branch| &branch.bounces);
        if let Some(bounces) = Bounces::json(bounces, |bounce| self.bounce(bounce)) {
            summary.insert("bounces".to_owned(), bounces);
        }
        if let Some(nodes) = last.resolution {
            let nodes = json!({ "most": nodes.most_nodes, "tail": nodes.tail, "rate_tail": nodes.rate_tail });
            summary.insert("nodes".to_owned(), nodes);
        }
        if let Some(warning) = self.warning() {
            summary.insert("warning".to_owned(), json!(warning));
        }
        if let Some(time) = self.unfelt() {
            summary.insert("rod_unfelt".to_owned(), json!(time));
        }
        if let Some(untold) = self.untold() {
            summary.insert("light_rod_lost".to_owned(), json!(untold));
        }
        if self.branches.len() > 1 {
            let branches: Vec<Value> = self.branches.iter().map(|b| self.branch(b)).collect();
            summary.insert("branches".to_owned(), json!(branches));
        }
        Value::Object(summary)
    }

    /// Remark on the bounces of the rods; `None` without bounces.
    pub fn bounces(&self) -> Option<String> {
        let all = self.branches.iter().map(|branch| &branch.bounces);
        Bounces::text(all, (&self.scales, self.units), false)
    }

    fn bounce(&self, bounce: &Bounce) -> Value {
        let rod = object(json!({ "rod": self.rods.get(bounce.rod) }));
        Value::Object(bounce_json(bounce, &self.scales, rod))
    }

    fn branch(&self, branch: &AssemblyRunBranch) -> Value {
        json!({
            "branch": branch.stem.id,
            "parent": branch.stem.parent,
            "outcome": branch.outcome.key(),
            "from": branch.first.t,
            "end": self.state(&branch.last, &branch.last_shapes),
            "reached": branch.stem.entered.as_ref().map(|snap| snap.reached),
            "trajectory": trajectory_name(branch.stem.id) + ".csv",
        })
    }

    /// Snaps, in the order of time along each branch.
    pub fn events(&self) -> Vec<Value> {
        let several = self.branches.len() > 1;
        let mut events = Vec::new();
        for branch in &self.branches {
            for (snap, wrenches) in branch.all_snaps().zip(&branch.snap_wrenches) {
                let mut event = object(self.snap(snap, wrenches));
                if let Some(fold) = self.fold_of(snap, branch) {
                    event.insert("mass".to_owned(), fold.json());
                }
                event.extend(choice(snap));
                if several {
                    event.insert("branch".to_owned(), json!(branch.stem.id));
                    event.insert("parent".to_owned(), json!(branch.stem.parent));
                }
                events.push(Value::Object(event));
            }
            events.extend(self.passages_of(branch));
            if let Some(touching) = &branch.touching {
                events.push(json!({
                    "kind": "self_contact",
                    "t": branch.last.t,
                    "rods": touching.rods.map(|k| self.rods.get(k)),
                    "s": touching.at,
                }));
            }
        }
        events
    }

    fn fold_of(&self, snap: &Snap, branch: &AssemblyRunBranch) -> Option<&FoldPassed> {
        let (t, rod) = (snap.t * self.scales.time, self.rods.get(snap.rod));
        let mut here = self.folds.iter().filter(|f| f.branch == branch.stem.id);
        here.find(|fold| fold.t == t && fold.rod.as_ref() == rod)
    }

    /// Folds of light rods that rods with mass passed without a jump, and intervals without light rods, in the order
    /// of time.
    fn passages_of(&self, branch: &AssemblyRunBranch) -> Vec<Value> {
        let k = &self.scales;
        let lost = branch.lost.iter();
        let lost = lost.map(|l| {
            (
                l.from * k.time,
                light_rod_reference::event(l, &self.rods, k),
            )
        });
        let mut all: Vec<(f64, Value)> = lost.collect();
        for (LightSnap { snap, .. }, wrenches) in
            branch.crossed.iter().zip(&branch.crossed_wrenches)
        {
            let fold = self.fold_of(snap, branch);
            all.push((
                snap.t * k.time,
                FoldPassed::event(fold, self.snap(snap, wrenches)),
            ));
        }
        all.sort_by(|a, b| a.0.total_cmp(&b.0));
        all.into_iter().map(|(_, event)| event).collect()
    }

    fn snap(&self, snap: &Snap, [before, after]: &[Vector6<f64>; 2]) -> Value {
        let k = &self.scales;
        let end = |end: &SnapEnd, wrench: &Vector6<f64>| {
            let (couple, force) = halves(wrench);
            json!({
                "couple": couple.as_slice(),
                "force": force.as_slice(),
                "index": end.index,
                "elastic": end.elastic * k.energy,
            })
        };
        json!({
            "kind": "snap",
            "t": snap.t * k.time,
            "rod": self.rods.get(snap.rod),
            "from": end(&snap.from, before),
            "to": end(&snap.to, after),
            "released": snap.released * k.energy,
            "time_error": snap.time_error * k.time,
        })
    }

    fn state(&self, at: &AssemblyMoment, shapes: &[Vec<Isometry3<f64>>]) -> Value {
        let bodies = self.bodies.iter().zip(&at.bodies).map(|(name, body)| {
            let q = body.pose.rotation;
            let mut described = object(json!({
                "position": body.pose.translation.vector.as_slice(),
                "quaternion": [q.w, q.i, q.j, q.k],
                "velocity": body.velocity.as_slice(),
                "angular_velocity": body.angular_velocity.as_slice(),
            }));
            if let Some(force) = body.groove {
                described.insert("groove_force".to_owned(), json!(force.as_slice()));
            }
            (name.clone(), Value::Object(described))
        });
        let ledger = &at.ledger;
        let mut state = object(json!({
            "t": at.t,
            "bodies": bodies.collect::<Map<_, _>>(),
            "kinetic": ledger.kinetic,
            "elastic": ledger.elastic,
            "potential": ledger.potential,
            "dissipated": ledger.dissipated,
            "work": ledger.work,
            "total": at.total,
            "index": at.index,
        }));
        if follows(&self.masses) || self.last().resolution.is_some() {
            state.insert("rod_kinetic".to_owned(), json!(ledger.rod_kinetic));
        }
        if !self.free.is_empty() {
            let shapes = shapes.iter().skip(self.rods.len());
            let ends = self.free.iter().zip(shapes).map(|(name, shape)| {
                let end = shape.last().map(pose_json);
                (name.clone(), json!(end))
            });
            state.insert("free_ends".to_owned(), Value::Object(ends.collect()));
        }
        Value::Object(state)
    }
}

/// True if the mass of a rod is followed.
pub(super) fn follows(masses: &[RodMassNote]) -> bool {
    masses
        .iter()
        .any(|mass| mass.inertia == Inertia::FirstOrder)
}
