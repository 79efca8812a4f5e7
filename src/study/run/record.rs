//! Record of a run, in the units of the scene.

use super::ModelKind;
use super::bounces::Bounces;
use super::recorder::{outcome_key, resolution_warning, total_time};
use super::spring::Spring;
use crate::motion::full_mass::SPILL;
use crate::motion::viscoelastic::Layer;
use crate::motion::{
    Labels, Ledger, LedgerClosure, LightSnap, Motion, Outcome, Resolution, Snap, UnknownInterval,
};
use crate::scene::{RodMassNote, Scales, Units};
use crate::solve::cost::Cost;
use crate::study::neglected_mass::{FoldPassed, Validity};
use crate::study::{Solid, light_rod_reference};
use nalgebra::{Isometry3, Vector3};

/// Record of a completed run, with all branches under landing = "all".
#[derive(Debug, Clone)]
pub struct RunRecord {
    /// Model of the rod.
    pub kind: ModelKind,
    /// The scene's units.
    pub units: Units,
    /// Scales from units of the rod to units of the scene.
    pub scales: Scales,
    /// The scene, with its defaults.
    pub scene: serde_json::Value,
    /// Requested end of time.
    pub duration: f64,
    /// The body as figures show it.
    pub solid: Solid,
    /// The period at which the samples are taken, if the scene gives one.
    pub strobe: Option<f64>,
    /// The bounds max_steps, max_snaps and branches of the scene.
    pub bounds: Bounds,
    /// Branches, each after its parent; the first is the trunk.
    pub branches: Vec<RunBranch>,
    /// Number of snaps whose branches were not followed because the bound was reached.
    pub cut: usize,
    /// True if forces in time do work on the body.
    pub driven: bool,
    /// True if the rod has mass.
    pub heavy: bool,
    /// True if its weight, or another load along it, bends the rod: the sheets of the light elastica do not apply.
    pub loaded: bool,
    /// Treatment of the mass of an elastic rod, if known.
    pub mass: Option<RodMassNote>,
    /// Folds passed by a rod of known mass.
    pub folds: Vec<FoldPassed>,
    /// Validity of neglecting the rod's mass, where the mass is known and not followed in full.
    pub validity: Option<Validity>,
    /// Morse index of the equilibrium at the start; `None` if unknown or not in equilibrium.
    pub start_index: Option<usize>,
    /// The exactly equivalent spring and dashpot, or the reason why there is none; `None` for models without this
    /// equivalence.
    pub spring: Option<Result<Spring, String>>,
    /// The viscosity of a planar rod.
    pub viscosity: Option<f64>,
    /// Diameter of the rod for self-contact; `None` without contact detection.
    pub thickness: Option<f64>,
    /// Moving strains of the track: names, and indices in (u1, .. v3).
    pub strains: Vec<(&'static str, usize)>,
    /// Stride of the samples in the strain table; `None` without such a table.
    pub strain_stride: Option<usize>,
}

/// Bounds of a run.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Bounds {
    /// The tolerance of the steps.
    pub tolerance: f64,
    /// Largest number of steps.
    pub steps: usize,
    /// Largest number of snaps.
    pub snaps: usize,
    /// Largest number of branches.
    pub branches: usize,
    /// True if the scene fixes the strain nodes.
    pub fixed_nodes: bool,
}

impl Bounds {
    /// Message for `cut` branches that were not followed.
    pub(in crate::study) fn cut(&self, cut: usize) -> String {
        let were = if cut == 1 {
            "branch was"
        } else {
            "branches were"
        };
        format!(
            "{cut} {were} not followed: the bound branches = {} was reached; raise it in [run]",
            self.branches
        )
    }

    /// Message for a contact of rods: `names` of the rods and arclengths `at`, in the units of the scene.
    pub(in crate::study) fn touching(names: [&str; 2], at: [f64; 2], units: Units) -> String {
        let place = |s: f64| format!("s = {s:.6}{}", Units::suffix(units.length()));
        let (s, to) = (place(at[0]), place(at[1]));
        let where_ = if names[0] == names[1] {
            format!("{} touches itself at {s} and {to}", names[0])
        } else {
            format!("{} at {s} touches {} at {to}", names[0], names[1])
        };
        format!(
            "{where_}; contact forces are not modelled; to ignore contact, set contact_diameter = 0 in the rod"
        )
    }

    /// Reason for an early end, without its time.
    pub(in crate::study) fn reason(
        &self,
        outcome: &Outcome,
        scales: &Scales,
        units: Units,
    ) -> String {
        match outcome {
            Outcome::StepLimit => format!(
                "the bound max_steps = {} was reached; raise it in [run]",
                self.steps
            ),
            Outcome::SnapLimit => format!(
                "the bound max_snaps = {} was reached; raise it in [run]",
                self.snaps
            ),
            Outcome::Stuck(stuck) => stuck
                .message()
                .in_units(&scales.of_messages(units))
                .to_string(),
            Outcome::SelfContact(contact) => {
                let at = contact.at.map(|s| s * scales.length);
                Self::touching(["the rod"; 2], at, units)
            }
            outcome => outcome.to_string(),
        }
    }
}

/// Message of an early end: time, place and reason.
pub(in crate::study) fn at_time(t: f64, units: Units, place: &str, why: &str) -> String {
    let t = crate::study::exact(t);
    let t = t.strip_suffix(".0").unwrap_or(&t);
    format!("at t = {t}{}{place}: {why}", Units::suffix(units.time()))
}

/// One run: the trunk, or the continuation from a snap.
#[derive(Debug, Clone)]
pub struct RunBranch {
    /// Number, in the order in which the branches are run; 0 is the trunk.
    pub id: usize,
    /// Number of the parent branch.
    pub parent: Option<usize>,
    /// Snap at which the branch begins, in the units of the rod.
    pub entered: Option<Snap>,
    /// First state.
    pub first: Moment,
    /// Last state.
    pub last: Moment,
    /// Outcome of the run; times in the units of the rod.
    pub outcome: Outcome,
    /// Computational cost.
    pub cost: Cost,
    /// Time during which the mass of a light rod was inactive, in the units of the scene.
    pub unfelt: f64,
    /// Resolution of the strains, for rods with strain unknowns.
    pub resolution: Option<Resolution>,
    /// Snaps of this branch, in the units of the rod.
    pub snaps: Vec<Snap>,
    /// Passages far from equilibrium, in the scene's units.
    pub layers: Vec<Layer>,
    /// Folds passed by the light rod that accompanies a rod with friction or mass, in the units of the rod.
    pub crossed: Vec<LightSnap>,
    /// Intervals without a light rod, in the units of the rod.
    pub lost: Vec<UnknownInterval>,
    /// Bounces of a taut rod.
    pub bounces: Bounces,
    /// Closure of the energy ledger, in the units of the scene.
    pub closing: LedgerClosure,
    /// Moments of the motion for figures, in the order of time, with both sides of every snap; thinned. They are ends
    /// of steps and moments within steps where figures are drawn, otherwise samples.
    pub way: Vec<Moment>,
    /// Samples with their strains, thinned; empty for a planar elastic rod.
    pub track: Vec<Frame>,
    /// Ends of steps in the passages with the largest dissipation of a planar rod, thinned; the largest loss comes
    /// first.
    pub passages: Vec<Vec<Frame>>,
    /// Times and axes of a few samples of a rod in space.
    pub axes: Vec<(f64, Vec<Isometry3<f64>>)>,
}

impl RunBranch {
    /// A branch before the recorder adds data.
    pub(super) fn new(
        id: usize,
        parent: Option<usize>,
        entered: Option<Snap>,
        (first, last): (Moment, Moment),
        outcome: Outcome,
        motion: &dyn Motion<'_>,
    ) -> Self {
        Self {
            id,
            parent,
            entered,
            closing: LedgerClosure::new(first.ledger.total()),
            first,
            last,
            outcome,
            cost: motion.cost(),
            unfelt: 0.0,
            resolution: motion.resolution(),
            snaps: Vec::new(),
            layers: Vec::new(),
            crossed: Vec::new(),
            lost: Vec::new(),
            bounces: Bounces::default(),
            way: Vec::new(),
            track: Vec::new(),
            passages: Vec::new(),
            axes: Vec::new(),
        }
    }

    /// Morse index of the first state, if labelled.
    pub(super) fn index_of_start(&self) -> Option<usize> {
        self.first.labels.map(|labels| labels.index)
    }
}

/// A state in the world frame and the scene's units.
#[derive(Debug, Clone, PartialEq)]
pub struct Moment {
    /// Time.
    pub t: f64,
    /// Frame of the clamp, to which the coordinates of a planar equilibrium refer.
    pub clamp: Isometry3<f64>,
    /// Pose of the end of the rod.
    pub pose: Isometry3<f64>,
    /// Velocity of the end.
    pub velocity: Vector3<f64>,
    /// Angular velocity of the end's directors.
    pub angular_velocity: Vector3<f64>,
    /// Force of the rod on the body.
    pub force: Vector3<f64>,
    /// Couple of the rod on the body, about the end.
    pub couple: Vector3<f64>,
    /// Force of the groove on the body, if it slides in one.
    pub groove: Option<Vector3<f64>>,
    /// Energies.
    pub ledger: Ledger,
    /// Conserved total: [`Ledger::total`].
    pub total: f64,
    /// Energy dissipated by friction in the rod so far.
    pub friction: f64,
    /// Labels of the equilibrium of the elastica that a planar rod is in, or near; `None` without one.
    pub labels: Option<Labels>,
    /// Morse index of the rod with its end held; `None` off equilibrium.
    pub index: Option<usize>,
}

impl Moment {
    /// Position of the end.
    pub fn position(&self) -> Vector3<f64> {
        self.pose.translation.vector
    }
}

/// A state as figures show it, in the scene's units.
#[derive(Debug, Clone)]
pub struct Frame {
    /// The state.
    pub moment: Moment,
    /// Moving strains at the places of the strain field; empty for an elastic rod.
    pub strains: Vec<Vec<f64>>,
    /// Dissipation per length and time, at the same places.
    pub dissipation: Vec<f64>,
    /// The axis of a planar rod with strains.
    pub axis: Vec<[f64; 2]>,
}

/// Smallest energy release of a passage, relative to the largest energy of the run.
const RELEASED: f64 = 1e-9;

/// Warning about strain rates that the nodes do not resolve, from the last coefficients of each branch; `fixed`: the
/// scene sets the number of nodes.
pub(super) fn unresolved(rate_tails: impl Iterator<Item = f64>, fixed: bool) -> Option<String> {
    let worst = rate_tails.fold(0.0, f64::max);
    let first = if fixed { "leave out rod.nodes, " } else { "" };
    (worst > SPILL).then(|| {
        format!(
            "the last coefficients of the strain rates carry {worst:.1e} of the total, more than {SPILL:.0e}: waves in the rod are shorter than \
             the node spacing; {first}give the rod damping, which damps the shortest waves first, or lower run.tolerance to resolve more of them"
        )
    })
}

impl RunRecord {
    /// The branch that ran last.
    pub fn last(&self) -> &RunBranch {
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
        self.first_incomplete_branch()
            .map(|branch| self.why(branch))
    }

    fn first_incomplete_branch(&self) -> Option<&RunBranch> {
        self.branches.iter().find(|b| !b.outcome.is_complete())
    }

    fn why(&self, branch: &RunBranch) -> String {
        let why = self
            .bounds
            .reason(&branch.outcome, &self.scales, self.units);
        let end = &branch.last;
        let place: Vec<String> = end.position().iter().map(|x| format!("{x:.6}")).collect();
        let axes = if self.kind.in_space() { 3 } else { 2 };
        let at = match branch.outcome {
            Outcome::Stuck(_) => format!(
                ", end of the rod at ({}){}",
                place[..axes].join(", "),
                Units::suffix(self.units.length())
            ),
            _ => String::new(),
        };
        at_time(end.t, self.units, &at, &why)
    }

    /// Largest change of a ledger's total, absolute and relative to the ledger's largest term.
    pub fn energy_error(&self) -> (f64, f64) {
        self.branches.iter().fold((0.0, 0.0), |(a, b), branch| {
            let closing = &branch.closing;
            (closing.error.max(a), closing.relative().max(b))
        })
    }

    /// Warning about unresolved strain rates, energies beyond the tolerance, or an unstable start.
    pub fn warning(&self) -> Option<String> {
        let branches = self.branches.iter();
        let told = branches.map(|b| (&b.closing, b.resolution.and_then(|r| r.rate_tail)));
        resolution_warning(told, (self.scales.energy, self.units), &self.bounds)
            .or_else(|| self.unstable())
    }

    /// Times and reasons of missing folds of the light rod; `None` if all are known, or there is no light rod.
    pub fn missing_folds_note(&self) -> Option<String> {
        let lost: Vec<&UnknownInterval> = self.branches.iter().flat_map(|b| &b.lost).collect();
        light_rod_reference::note(&lost, &[], (&self.scales, self.units))
    }

    /// Time during which the mass of a light rod was inactive, over all branches; `None` if it never was.
    pub fn time_without_mass(&self) -> Option<f64> {
        total_time(self.branches.iter().map(|branch| branch.unfelt))
    }

    fn unstable(&self) -> Option<String> {
        let index = self.start_index.filter(|index| *index > 0)?;
        Some(match self.kind {
            ModelKind::Space => format!(
                "the equilibrium at the start has Morse index {index}: it is unstable, and rounding or loads decide how the rod leaves it"
            ),
            ModelKind::Sheet | ModelKind::Planar | ModelKind::ElasticSpace => format!(
                "the start has Morse index {index}: it is unstable, and a real rod would leave it at once; the run stays on this unstable sheet"
            ),
        })
    }

    /// Remark on the bounces of an elastic rod; `None` without bounces.
    pub fn bounces(&self) -> Option<String> {
        let planar = self.kind == ModelKind::Sheet;
        let all = self.branches.iter().map(|b| &b.bounces);
        Bounces::text(all, (&self.scales, self.units), planar)
    }

    /// Layers that end near equilibrium with an energy release above rounding: the snaps of a rod with friction.
    pub fn passages(&self) -> impl Iterator<Item = &Layer> {
        self.branches.iter().flat_map(|branch| {
            let least = RELEASED * branch.closing.largest;
            let layers = branch.layers.iter();
            layers.filter(move |layer| layer.whole && layer.elastic_from - layer.elastic_to > least)
        })
    }
}
