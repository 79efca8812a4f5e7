//! Record of a run, in the units of the scene: branches, reason of an early end, warnings.

use super::bounces::Bounces;
use super::contacts::BranchContacts;
use super::header::RunHeader;
use super::moment::{FigureState, Moment, ShapesAt};
use super::simulation::SimulationState;
use super::spring::Spring;
use crate::motion::full_mass::SPILL;
use crate::motion::viscoelastic::Layer;
use crate::motion::{LedgerClosure, LightSnap, Outcome, Resolution, Snap, UnknownInterval};
use crate::scene::Units;
use crate::solve::cost::Cost;
use crate::study::light_rod_reference;
use crate::study::neglected_mass::{FoldPassed, Validity};

/// Record of a completed run, with all branches under landing = "all".
#[derive(Debug, Clone)]
pub struct RunRecord {
    /// Facts that were known before the start.
    pub header: RunHeader,
    /// Branches, each after its parent; the first is the trunk.
    pub branches: Vec<RunBranch>,
    /// Number of snaps whose branches were not followed because the bound was reached.
    pub cut: usize,
    /// The last state, from which another run goes on; or the reason why a run of this kind saves no state.
    pub state: std::result::Result<SimulationState, String>,
    /// Folds passed by rods of known mass.
    pub folds: Vec<FoldPassed>,
    /// Validity of neglecting the mass of rods, where a mass is known and not followed in full.
    pub validity: Option<Validity>,
    /// Morse index of the equilibrium at the start, in an assembly with the bodies free; `None` if unknown or not in
    /// equilibrium.
    pub start_index: Option<usize>,
    /// The exactly equivalent spring and dashpot, or the reason why there is none; `None` for models without this
    /// equivalence.
    pub spring: Option<Result<Spring, String>>,
    /// Largest change of the places of the bodies at the end by half the gap of the barrier; `None` where that was not
    /// asked for.
    pub change_at_half_gap: Option<f64>,
    /// Stride of the samples in the strain table; `None` without such a table.
    pub strain_stride: Option<usize>,
}

/// One run: the trunk, or the continuation from a snap.
#[derive(Debug, Clone)]
pub struct RunBranch {
    /// Number, in the order in which the branches are run; 0 is the trunk.
    pub id: usize,
    /// Number of the parent branch.
    pub parent: Option<usize>,
    /// Number of the branch among the branches of the parent.
    pub fork: usize,
    /// Snap at which the branch begins.
    pub entered: Option<Snap>,
    /// First state.
    pub first: Moment,
    /// Last state.
    pub last: Moment,
    /// Outcome of the run. Numbers of a message are converted where the message is written.
    pub outcome: Outcome,
    /// Computational cost.
    pub cost: Cost,
    /// Time during which the mass of a light rod was inactive.
    pub unfelt: f64,
    /// Resolution of the strains, for rods with strain unknowns.
    pub resolution: Option<Resolution>,
    /// Why strains at nodes follow rods with mass where elements do by default.
    pub why_no_elements: Option<String>,
    /// Snaps of this branch. The chart point of a rod in space is the wrench (couple, force) at its base, along the
    /// directors there.
    pub snaps: Vec<Snap>,
    /// Passages far from equilibrium.
    pub layers: Vec<Layer>,
    /// Folds passed by the light rods that accompany rods with friction or mass.
    pub crossed: Vec<LightSnap>,
    /// Intervals without a light rod.
    pub lost: Vec<UnknownInterval>,
    /// Bounces of taut rods.
    pub bounces: Bounces,
    /// Contacts with obstacles; `None` without obstacles.
    pub contacts: Option<BranchContacts>,
    /// Closure of the energy ledger.
    pub closing: LedgerClosure,
    /// Moments of the motion for figures, in the order of time, with both sides of every snap; thinned. They are ends
    /// of steps and moments within steps where figures are drawn, otherwise samples.
    pub way: Vec<Moment>,
    /// Samples with their strains, thinned; empty for a planar elastic rod and for an assembly.
    pub track: Vec<FigureState>,
    /// Ends of steps in the passages with the largest dissipation of a planar rod, thinned; the largest loss comes
    /// first.
    pub passages: Vec<Vec<FigureState>>,
    /// Rods at some times, the last among them, in an assembly also the first; empty in a plane.
    pub shapes: Vec<ShapesAt>,
}

impl RunBranch {
    /// The snap at which the branch begins, if any, and the snaps within the branch.
    pub fn all_snaps(&self) -> impl Iterator<Item = &Snap> {
        self.entered.iter().chain(&self.snaps)
    }

    /// Layers that end near equilibrium with an energy release above rounding: the snaps of a rod with friction.
    pub fn snap_layers(&self) -> impl Iterator<Item = &Layer> {
        let least = RELEASED * self.closing.largest;
        let layers = self.layers.iter();
        layers.filter(move |layer| layer.whole && layer.elastic_from - layer.elastic_to > least)
    }
}

/// Smallest energy release of a passage, relative to the largest energy of the run.
const RELEASED: f64 = 1e-9;
/// Least speed of a resolved motion in units of the rod, as a multiple of the tolerance.
const RESOLVED: f64 = 1e3;

impl RunRecord {
    /// The branch that ran last.
    pub fn last(&self) -> &RunBranch {
        // Every record has a branch.
        &self.branches[self.branches.len() - 1]
    }

    fn first_incomplete_branch(&self) -> Option<&RunBranch> {
        self.branches.iter().find(|b| !b.outcome.is_complete())
    }

    /// Stable key of the outcome: [`Outcome::key`] of the first branch that ended early, branch_limit, or
    /// end_of_time.
    pub fn outcome(&self) -> &'static str {
        if self.cut > 0 {
            return "branch_limit";
        }
        let short = self.first_incomplete_branch();
        short.map_or("end_of_time", |branch| branch.outcome.key())
    }

    /// Reason for an early end, in the units of the scene; `None` for a complete run.
    pub fn reason(&self) -> Option<String> {
        let header = &self.header;
        if self.cut > 0 {
            return Some(header.cut(self.cut));
        }
        let branch = self.first_incomplete_branch()?;
        let units = header.units;
        let t = crate::study::exact(branch.last.t);
        let t = t.strip_suffix(".0").unwrap_or(&t);
        let end = match branch.outcome {
            Outcome::Stuck(_) if !header.is_assembly() => {
                let place = branch.last.position();
                let place: Vec<String> = place.iter().map(|x| format!("{x:.6}")).collect();
                let axes = if header.in_space() { 3 } else { 2 };
                let unit = Units::suffix(units.length());
                format!(", end of the rod at ({}){unit}", place[..axes].join(", "))
            }
            _ => String::new(),
        };
        let why = header.reason(&branch.outcome);
        Some(format!(
            "at t = {t}{}{end}: {why}",
            Units::suffix(units.time())
        ))
    }

    /// Largest change of a ledger's total, absolute and relative to the ledger's largest term.
    pub fn energy_error(&self) -> (f64, f64) {
        let absolute = self.worst(|closing| closing.error);
        (absolute, self.worst(LedgerClosure::relative))
    }

    /// Largest value of an error of the ledger over the branches.
    pub(super) fn worst(&self, error: fn(&LedgerClosure) -> f64) -> f64 {
        let each = self.branches.iter().map(|branch| error(&branch.closing));
        each.fold(0.0, f64::max)
    }

    /// Warning about unresolved strain rates, energies beyond the tolerance, or an unstable start.
    pub fn warning(&self) -> Option<String> {
        self.unresolved()
            .or_else(|| self.untrusted())
            .or_else(|| self.unstable())
    }

    /// Warning about strain rates that the nodes do not resolve, from the last coefficients of each branch.
    fn unresolved(&self) -> Option<String> {
        let rates = self.branches.iter();
        let rates = rates.filter_map(|branch| branch.resolution?.rate_tail);
        let worst = rates.fold(0.0, f64::max);
        let first = if self.header.fixed_nodes {
            "leave out rod.nodes, "
        } else {
            ""
        };
        (worst > SPILL).then(|| {
            format!(
                "the last coefficients of the strain rates carry {worst:.1e} of the total, more than {SPILL:.0e}: waves in the rod are shorter than \
                 the node spacing; {first}give the rod damping, which damps the shortest waves first, or lower run.tolerance to resolve more of them"
            )
        })
    }

    /// Warning about motions with energies below the resolution of the tolerance.
    fn untrusted(&self) -> Option<String> {
        let (energy, units) = (self.header.scales.energy, self.header.units);
        let mut closings = self.branches.iter().map(|branch| &branch.closing);
        let closing =
            closings.find(|closing| closing.is_open(energy, self.header.run.tolerance))?;
        // Speed of a unit mass.
        let speed = (2.0 * closing.largest / energy).sqrt();
        let off = format!(
            "the energy balance error is {:.1e} of the largest energy, {:.1e}{}",
            closing.relative(),
            closing.largest,
            Units::suffix(units.energy())
        );
        Some(if RESOLVED * self.header.run.tolerance > speed {
            format!(
                "the motion is too small for run.tolerance, which is relative to 1 + size in units of the rod: speeds in these units are about {speed:.1e}, and \
             {off}; lower run.tolerance to a thousandth of these speeds, or rely on no more than that the motion is small"
            )
        } else {
            format!(
                "{off}: lower run.tolerance, or discard the motion from where column total of the trajectory drifts"
            )
        })
    }

    fn unstable(&self) -> Option<String> {
        let index = self.start_index.filter(|index| *index > 0)?;
        let header = &self.header;
        Some(if header.is_assembly() {
            format!(
                "the equilibrium at the start has Morse index {index}: it is unstable, and rounding or velocities decide how the bodies leave \
                 it; give the bodies a `guess` near a stable one"
            )
        } else if header.in_space() && !header.is_elastic() {
            format!(
                "the equilibrium at the start has Morse index {index}: it is unstable, and rounding or loads decide how the rod leaves it"
            )
        } else {
            format!(
                "the start has Morse index {index}: it is unstable, and a real rod would leave it at once; the run stays on this unstable sheet"
            )
        })
    }

    /// Times and reasons of missing folds of light rods; `None` if all are known, or there is no light rod.
    pub fn missing_folds_note(&self) -> Option<String> {
        let lost: Vec<&UnknownInterval> = self.branches.iter().flat_map(|b| &b.lost).collect();
        light_rod_reference::note(&lost, &self.header)
    }

    /// Time during which the mass of a light rod was inactive, over all branches; `None` if it never was.
    pub fn time_without_mass(&self) -> Option<f64> {
        let time: f64 = self.branches.iter().map(|branch| branch.unfelt).sum();
        (time > 0.0).then_some(time)
    }

    /// Remark on the bounces of elastic rods; `None` without bounces.
    pub fn bounces(&self) -> Option<String> {
        let all = self.branches.iter().map(|branch| &branch.bounces);
        Bounces::text(all, self.header.units, self.header.is_sheet())
    }

    /// Passages of all branches.
    pub fn passages(&self) -> impl Iterator<Item = &Layer> {
        self.branches.iter().flat_map(RunBranch::snap_layers)
    }
}
