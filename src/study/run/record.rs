//! What a run leaves behind, in the scene's units.

use super::ModelKind;
use super::bounces::Bounces;
use super::recorder::{doubts, outcome_key, spent};
use super::spring::Spring;
use crate::motion::full_mass::SPILL;
use crate::motion::viscoelastic::Layer;
use crate::motion::{Closing, Crossed, Labels, Ledger, Lost, Motion, Outcome, Resolution, Snap};
use crate::scene::{RodMassNote, Scales, Units};
use crate::solve::cost::Cost;
use crate::study::neglected_mass::{FoldPassed, Validity};
use crate::study::{Solid, light_rod_reference};
use nalgebra::{Isometry3, Vector3};

/// A run that has ended, or, under landing = "all", the runs into which it branched.
#[derive(Debug, Clone)]
pub struct RunRecord {
    /// What kind of rod ran.
    pub kind: ModelKind,
    /// The scene's units.
    pub units: Units,
    /// The units of the rod in those of the scene.
    pub scales: Scales,
    /// The scene, with its defaults.
    pub scene: serde_json::Value,
    /// The end of time that was asked for.
    pub duration: f64,
    /// The body as figures show it.
    pub solid: Solid,
    /// The period at which the samples are taken, if the scene gives one.
    pub strobe: Option<f64>,
    /// The bounds max_steps, max_snaps and branches of the scene.
    pub bounds: Bounds,
    /// Each after its parent; the first is the trunk.
    pub branches: Vec<RunBranch>,
    /// Snaps whose branches were not followed because the bound was reached.
    pub cut: usize,
    /// True if forces in time do work on the body.
    pub driven: bool,
    /// True if the rod has mass.
    pub heavy: bool,
    /// True if its weight, or another load along it, bends the rod, so that no sheet of the light elastica is its own.
    pub loaded: bool,
    /// What is done with the mass of an elastic rod, if it is known.
    pub mass: Option<RodMassNote>,
    /// The folds that a rod of known mass passed.
    pub folds: Vec<FoldPassed>,
    /// Whether leaving out the mass of the rod was right, where that mass is known and not all of it was followed.
    pub validity: Option<Validity>,
    /// The Morse index of the equilibrium at the start, if it is one and known.
    pub start_index: Option<usize>,
    /// The spring and dashpot that the rod is exactly, or why it is none; None where the question does not arise.
    pub spring: Option<Result<Spring, String>>,
    /// The viscosity of a planar rod.
    pub viscosity: Option<f64>,
    /// How thick the rod is where it touches itself; None where that is not looked for.
    pub thickness: Option<f64>,
    /// The strains that the track holds: names, and places among (u1, .. v3).
    pub strains: Vec<(&'static str, usize)>,
    /// What part of the samples the strain table holds: one in so many; None if there is no such table.
    pub strain_stride: Option<usize>,
}

/// Bounds of a run.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Bounds {
    /// The tolerance of the steps.
    pub tolerance: f64,
    /// Most steps.
    pub steps: usize,
    /// Most snaps.
    pub snaps: usize,
    /// Most branches.
    pub branches: usize,
    /// True if the scene fixes the strain nodes.
    pub fixed_nodes: bool,
}

impl Bounds {
    /// What is to be said of so many branches that were not followed.
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

    /// What is to be said of rods that touch; `name` and `at` tell rods and arclengths in the scene's units.
    pub(in crate::study) fn touching(names: [&str; 2], at: [f64; 2], units: Units) -> String {
        let place = |s: f64| format!("s = {s:.6}{}", Units::behind(units.length()));
        let (s, to) = (place(at[0]), place(at[1]));
        let where_ = match names[0] == names[1] {
            true => format!("{} touches itself at {s} and {to}", names[0]),
            false => format!("{} at {s} touches {} at {to}", names[0], names[1]),
        };
        format!(
            "{where_}, and what contact does is not followed; where that does not matter, set contact_diameter = 0 in the rod"
        )
    }

    /// Why a run ended short, without its place.
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

/// Time, place and reason of an end.
pub(in crate::study) fn at_time(t: f64, units: Units, place: &str, why: &str) -> String {
    let t = crate::study::exact(t);
    let t = t.strip_suffix(".0").unwrap_or(&t);
    format!("at t = {t}{}{place}: {why}", Units::behind(units.time()))
}

/// One run: the trunk, or what follows from a snap.
#[derive(Debug, Clone)]
pub struct RunBranch {
    /// Number, in the order in which the branches are run; 0 is the trunk.
    pub id: usize,
    /// The branch it forks from.
    pub parent: Option<usize>,
    /// The snap by which it was entered, in the units of the rod.
    pub entered: Option<Snap>,
    /// Its first state.
    pub first: Moment,
    /// Its last state.
    pub last: Moment,
    /// How it ended; times in the units of the rod.
    pub outcome: Outcome,
    /// Its cost.
    pub cost: Cost,
    /// For how long the mass of a light rod was not felt, in the scene's units.
    pub unfelt: f64,
    /// How the strains were resolved, if the rod has any of its own.
    pub resolution: Option<Resolution>,
    /// Its own snaps, in the units of the rod.
    pub snaps: Vec<Snap>,
    /// Passages far from equilibrium, in the scene's units.
    pub layers: Vec<Layer>,
    /// Folds that the light rod beside a rod with friction or mass passes, in the units of the rod.
    pub crossed: Vec<Crossed>,
    /// When that rod was not known, in the units of the rod.
    pub lost: Vec<Lost>,
    /// Bounces of a taut rod.
    pub bounces: Bounces,
    /// How well its ledger closes, in the scene's units.
    pub closing: Closing,
    /// Moments of the motion for figures, in the order of time, with both sides of every snap: of every step where figures are drawn, else the
    /// samples. Thinned.
    pub way: Vec<Moment>,
    /// Samples with their strains, likewise; none of an elastic rod in the plane.
    pub track: Vec<Frame>,
    /// Ends of the steps of the passages through which a planar rod dissipated most, thinned; that of the largest loss is the first.
    pub passages: Vec<Vec<Frame>>,
    /// Time and axis of a few samples of a rod in space.
    pub axes: Vec<(f64, Vec<Isometry3<f64>>)>,
}

impl RunBranch {
    /// A branch of which nothing was recorded yet but its ends and its cost.
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
            closing: Closing::new(first.ledger.total()),
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

    /// The Morse index of its first state, if that is named.
    pub(super) fn index_of_start(&self) -> Option<usize> {
        self.first.labels.map(|labels| labels.index)
    }
}

/// A state in the world frame and the scene's units.
#[derive(Debug, Clone, PartialEq)]
pub struct Moment {
    /// Time.
    pub t: f64,
    /// The frame of the clamp, in which the coordinates of a planar equilibrium are meant.
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
    /// What should not change: [`Ledger::total`].
    pub total: f64,
    /// Energy dissipated by friction in the rod so far.
    pub friction: f64,
    /// The equilibrium of the elastica that the rod is in, or near.
    pub labels: Option<Labels>,
    /// The Morse index of the rod with its end held; None off equilibrium.
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
    /// Each strain that moves, at the places of the strain field; empty for an elastic rod.
    pub strains: Vec<Vec<f64>>,
    /// Dissipation per length and time, at the same places.
    pub dissipation: Vec<f64>,
    /// The axis of a planar rod with strains.
    pub axis: Vec<[f64; 2]>,
}

/// What a passage releases, of the largest energy of the run, at least.
const RELEASED: f64 = 1e-9;

/// What is to be said of strain rates that the nodes do not hold, from what the last coefficients of each branch carry of them; `fixed` if the scene
/// says how many nodes there are.
pub(super) fn unresolved(rate_tails: impl Iterator<Item = f64>, fixed: bool) -> Option<String> {
    let worst = rate_tails.fold(0.0, f64::max);
    let first = if fixed {
        "leave out rod.nodes, or "
    } else {
        ""
    };
    (worst > SPILL).then(|| {
        format!(
            "the last coefficients of the strain rates carry {worst:.1e} of them, more than {SPILL:.0e}: waves in the rod are shorter than \
             its nodes; {first}give the rod damping, which they meet first; a lower tolerance resolves more of them, as far as rounding lets them be followed"
        )
    })
}

impl RunRecord {
    /// The branch that ran last.
    pub fn last(&self) -> &RunBranch {
        // A record is made of one branch at least.
        &self.branches[self.branches.len() - 1]
    }

    /// A stable key of how the run ended: that of [`Outcome::key`] of the first branch that fell short, branch_limit, or
    /// end_of_time.
    pub fn outcome(&self) -> &'static str {
        outcome_key(self.cut, self.branches.iter().map(|b| &b.outcome))
    }

    /// Why the run fell short of what was asked, in the scene's units; None if it did not.
    pub fn reason(&self) -> Option<String> {
        if self.cut > 0 {
            return Some(self.bounds.cut(self.cut));
        }
        self.short().map(|branch| self.why(branch))
    }

    fn short(&self) -> Option<&RunBranch> {
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
                Units::behind(self.units.length())
            ),
            _ => String::new(),
        };
        at_time(end.t, self.units, &at, &why)
    }

    /// The largest change of a ledger's total, and the largest one relative to its ledger's largest term.
    pub fn energy_error(&self) -> (f64, f64) {
        self.branches.iter().fold((0.0, 0.0), |(a, b), branch| {
            let closing = &branch.closing;
            (closing.error.max(a), closing.relative().max(b))
        })
    }

    /// What is to be said of strain rates that the nodes do not hold, of energies that the tolerance does not hold, or of an unstable start.
    pub fn warning(&self) -> Option<String> {
        let branches = self.branches.iter();
        let told = branches.map(|b| (&b.closing, b.resolution.and_then(|r| r.rate_tail)));
        doubts(told, (self.scales.energy, self.units), &self.bounds).or_else(|| self.unstable())
    }

    /// When and why folds that the light rod passes are not told; None where all are, or there is none.
    pub fn untold(&self) -> Option<String> {
        let lost: Vec<&Lost> = self.branches.iter().flat_map(|b| &b.lost).collect();
        light_rod_reference::note(&lost, &[], (&self.scales, self.units))
    }

    /// For how long a light rod whose mass is followed was without it, in all branches; None if it never was.
    pub fn unfelt(&self) -> Option<f64> {
        spent(self.branches.iter().map(|branch| branch.unfelt))
    }

    fn unstable(&self) -> Option<String> {
        let index = self.start_index.filter(|index| *index > 0)?;
        Some(match self.kind {
            ModelKind::Space => format!(
                "the equilibrium at the start has Morse index {index}: it is not stable, and the rod leaves it as rounding or loads will"
            ),
            ModelKind::Sheet | ModelKind::Planar | ModelKind::ElasticSpace => format!(
                "the start has Morse index {index}: it is not stable, a real rod would leave it at once; the run follows the sheet as asked"
            ),
        })
    }

    /// What is to be said of the bounces of an elastic rod; None where there was none.
    pub fn bounces(&self) -> Option<String> {
        let planar = self.kind == ModelKind::Sheet;
        let all = self.branches.iter().map(|b| &b.bounces);
        Bounces::text(all, (&self.scales, self.units), planar)
    }

    /// Layers that ended next to equilibrium with less elastic energy, by more than a rod at rest loses by rounding: the snaps of a rod with friction.
    pub fn passages(&self) -> impl Iterator<Item = &Layer> {
        self.branches.iter().flat_map(|branch| {
            let least = RELEASED * branch.closing.largest;
            let layers = branch.layers.iter();
            layers.filter(move |layer| layer.whole && layer.elastic_from - layer.elastic_to > least)
        })
    }
}
