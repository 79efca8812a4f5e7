//! Motion of bodies on elastic rods in space: AMV (4.7)-(4.9), several rods and bodies, through folds (theory 3.3).
//!
//! Away from folds steps advance in time. A rod that nears its fold slows time (see
//! [`crate::assembly::SlowedTime`]): the fold is then an ordinary root of t', found to the accuracy of the
//! integration. At the fold that rod settles with its ends held, and the others stay as they are.
//!
//! Steps are explicit, symmetric, or implicit where a rod is stiff (`implicit`). Near a fold implicit steps
//! give way to explicit ones.

mod bounce;
mod branching;
mod chart_switching;
mod contacts;
mod events;
mod first_order_mass;
mod implicit;
mod joints;
mod rod_gap;
mod sample;
mod saved;
mod step;

use branching::Crossing;
use contacts::AssemblyContacts;
use implicit::Implicit;
pub use sample::AssemblySample;

use super::event::{Bounce, Event, Outcome};
use super::ledger::LedgerClosure;
use super::locate::Timed;
use super::options::{FINEST, Options};
use super::run::RodTouch;
use super::snap::{LandingRule, Landings, Snap, SnapEnd};
use nalgebra::DVector;
use snaprod_systems::assembly::{
    Assembly, Body, Configuration, Evaluated, Integrals, Link, Nearness, RodChart, RodMonitor,
    SlowedTime,
};
use snaprod_systems::error::{Cause, Error, Result};
use snaprod_systems::rod::Wrench;
use snaprod_systems::solve::cost::Cost;
use snaprod_systems::solve::dop853::State;
use snaprod_systems::solve::gauss::Reversible;
use snaprod_systems::solve::integrator::Method;
use snaprod_systems::solve::stepper::{AcceptedStep, StepInterpolant, Stepper};
use std::borrow::Cow;
use std::collections::VecDeque;
use std::sync::Arc;

/// Ratio of distances from the folds, by det J over its largest value, up to which time is slowed for other rods too.
const COMPANY: f64 = 10.0;
/// Error of the integration along a rod, as a part of the step's error: slopes must be smooth to that level.
const ALONG: f64 = 0.1;
/// Largest gap between rod ends and attachments at the start, in tolerances.
const APART: f64 = 1e4;
/// First step over tolerance^(1/8), in units of the time in which a state changes by its scale.
const FIRST: f64 = 0.3;
/// Tolerance above which rods may be led to other equilibria: the message of a run that ends early then advises a
/// lower one.
const COARSE: f64 = 1e-4;
/// Value of det J, relative to the initial one, below which symmetric steps become shorter in time.
const FOLDING: f64 = 0.3;

/// State vector; time is third from the end.
#[derive(Debug, Clone)]
struct StateVector(DVector<f64>);

impl State for StateVector {
    fn axpy(&mut self, a: f64, x: &Self) {
        State::axpy(&mut self.0, a, &x.0);
    }

    fn mean_square(&self, from: &Self, to: &Self) -> f64 {
        self.0.mean_square(&from.0, &to.0)
    }
}

impl Reversible for StateVector {
    /// sigma runs like time while det J is of its initial size: for t' = det J/d, dt/dsigma = t'/Q.
    fn pace_squared(&self, _at: &Self) -> f64 {
        self.time().powi(2) + FOLDING * FOLDING
    }
}

impl Timed for StateVector {
    fn time(&self) -> f64 {
        self.0[self.0.len() - 3]
    }
}

impl StateVector {
    fn at_time(mut self, t: f64) -> Self {
        let slot = self.0.len() - 3;
        self.0[slot] = t;
        self
    }

    /// The state with its time reduced to at most `until`.
    fn seen(&self, until: f64) -> Cow<'_, Self> {
        if self.time() > until {
            Cow::Owned(self.clone().at_time(until))
        } else {
            Cow::Borrowed(self)
        }
    }
}

/// Event that follows the last reported step.
#[derive(Debug, Clone)]
enum AssemblyPending {
    /// Folds, with the uncertainty of their time; or a branch point of one rod.
    Fold(f64, Option<Crossing>),
    /// End of the run.
    Stop(Outcome),
}

/// A motion of an assembly in progress.
#[derive(Clone)]
pub struct AssemblyRun<'a> {
    assembly: Arc<Assembly>,
    options: Options,
    solver: Stepper<StateVector>,
    implicit: Implicit,
    step: Option<AcceptedStep<StateVector>>,
    dense: Option<StepInterpolant<StateVector>>,
    slowed: Option<SlowedTime>,
    /// Latest time at which loads and supports are evaluated, just before the next break.
    until: f64,
    /// Time at which the clock last changed, with det J of all rods then.
    since: (f64, Vec<f64>),
    /// Largest det J of every rod on its present sheet, over the starts of steps.
    largest: Vec<f64>,
    /// Charts and clock of the last step; both may change at its end.
    taken_by: (Arc<Assembly>, Option<SlowedTime>),
    /// Observed quantities of the rods at the present state.
    watch: Vec<RodMonitor>,
    /// Morse index of every rod with its ends held, on the present sheet.
    indices: Vec<usize>,
    /// Cost outside the steps.
    extra: Cost,
    released: f64,
    /// Part of `released` that was booked after the last step, and belongs to the next one.
    booked: f64,
    snaps: u64,
    /// Rods at their folds that have not snapped yet, each with its det J where time began to be slowed for
    /// it. In a symmetric assembly several fold at one instant. The bodies stand while rods snap, so the
    /// order does not matter.
    folded: Vec<(usize, f64)>,
    /// Rods on the way to a branch point without a push. Time is not slowed for these rods.
    unpushed: Vec<usize>,
    /// Event that the last step has led to.
    pending: Option<AssemblyPending>,
    /// Rods whose mass begins (true) or ceases to act at the end of the last step, if known.
    due: Option<Vec<(usize, bool)>>,
    /// Margin of the criteria for an acting mass at the end of the last step, if known.
    room: Option<f64>,
    /// True for rods whose mass could not be followed to the present state; reset at a landing.
    unfit: Vec<bool>,
    /// Total time in which the mass of a rod did not act on the motion.
    unfelt: f64,
    /// Distances between rods.
    near: Nearness,
    first: AssemblySample,
    /// Sample at the end of the last step, kept if a rod is taut.
    seen: Option<AssemblySample>,
    /// For every rod, while any is taut: whether its ends move apart against the pull. Empty otherwise.
    parting: Vec<Option<bool>>,
    /// Bounces still to be reported.
    bounces: VecDeque<Bounce>,
    before_snap: Option<AssemblySample>,
    /// The rod of the last snap, in its state at the fold.
    folding: Option<Link>,
    /// Contacts with obstacles; None without obstacles.
    contacts: Option<AssemblyContacts<'a>>,
    stopped: bool,
    interrupted: bool,
}

impl<'a> AssemblyRun<'a> {
    /// A run from `start` at time 0. Poses and charts must agree.
    ///
    /// # Errors
    /// Rods whose ends are off their attachments, or that stand at a fold; a landing on a sheet of the plane.
    pub fn new(assembly: Assembly, start: &Configuration, options: Options) -> Result<Self> {
        Self::begin(assembly, start, Integrals::default(), options)
    }

    /// A run from `start` at the time and with the sums of `integrals`.
    fn begin(
        assembly: Assembly,
        start: &Configuration,
        integrals: Integrals,
        options: Options,
    ) -> Result<Self> {
        if let LandingRule::Named(_) = options.landing {
            return Err(Error::domain(
                "landing: equilibria have names of sheets in the plane alone, and there under no load along the rod, its weight or another; tell them by \
                 their energy, landing = \"lowest\", or follow them all, landing = \"all\"",
            ));
        }
        first_order_mass::check(&assembly, &options)?;
        joints::check(&assembly, &options)?;
        one_drive(&assembly)?;
        Body::start_in_grooves(assembly.carriers(), &start.bodies)?;
        let mut assembly = Arc::new(assembly);
        let local = options.local_tolerance();
        let along = (ALONG * local).max(FINEST);
        let start = &assembly.complete_spins(start, along)?;
        let state = assembly.state(start, &integrals);
        let followed = |assembly: &Assembly, state: &DVector<f64>| {
            assembly.evaluated(state, along).ok_or_else(|| {
                Error::domain("the rods cannot be followed under the wrenches of the start")
            })
        };
        let mut at = followed(&assembly, &state)?;
        // From here on charts change only between steps.
        for (k, (point, q)) in at.points.iter().zip(&at.now.charts).enumerate() {
            let chart = if assembly.links()[k].suits_taut(q, point) {
                RodChart::Taut { spring: 0.0 }
            } else {
                RodChart::BaseWrench
            };
            let felt = assembly.should_feel(k, &at, along);
            let assembly = Arc::make_mut(&mut assembly);
            assembly.set_chart(k, chart);
            assembly.set_inertia(k, felt);
        }
        let apart = assembly.drift(&at);
        if !(apart <= APART * options.tolerance) {
            return Err(Error::domain(format!(
                "the ends of the rods are {apart:.1e} of their length away from their attachments at the start"
            )));
        }
        let links = assembly.links().len();
        let mut numbers = StateVector(state);
        let mut slope = numbers.clone();
        let mut watch = vec![RodMonitor::default(); links];
        let mut begin = |assembly: &Assembly, numbers: &StateVector| {
            let see = |k: usize, sight| watch[k] = sight;
            assembly.write_slope(&numbers.0, None, along, &mut slope.0, see)
        };
        let mut defined = begin(&assembly, &numbers);
        if defined.is_some() && Arc::make_mut(&mut assembly).allow_sliding(options.tolerance, &at) {
            let ends = followed(&assembly, &numbers.0)?;
            numbers = StateVector(assembly.slide_bodies(numbers.0, &ends));
            at = followed(&assembly, &numbers.0)?;
            defined = begin(&assembly, &numbers);
        }
        defined.ok_or_else(|| {
                let nearest = |a: &usize, b: &usize| watch[*a].det.abs().total_cmp(&watch[*b].det.abs());
                let rod = (0..links).min_by(nearest).unwrap_or(0);
                Error::ill_conditioned(format!(
                    "{} stands exactly at a fold at the start, as a straight rod that cannot stretch does, or hangs so slack that its end says \
                     too little of its forces; let it stretch (an axial stiffness), start it bent, give it its mass in full (inertia = \"full\"), or \
                     friction (damping)",
                    assembly.rod_name(rod)
                ))
            })?;
        let leaves = assembly.leaves_groove(&numbers.0, &slope.0, options.tolerance);
        let near = if assembly.looks_for_contacts() {
            Nearness::at(&assembly, integrals.time, start)
        } else {
            Nearness::default()
        };
        if let Some(contact) = near.contact.filter(|contact| contact.gap < 0.0) {
            return Err(contact.at_start(|rod| assembly.rod_name(rod)));
        }
        let h = first_step(&numbers, &slope, options.tolerance);
        // The first implicit step follows the rate of the bodies: charts may be fast.
        let bodies = assembly.chart_slots(0).start;
        let rate = slope.0.rows(0, bodies).norm() / (bodies as f64).sqrt();
        let slow = FIRST * local.powf(0.125) / rate.max(0.1);
        let indices = indices(&assembly, &at, along)?;
        let first = AssemblySample::new(assembly.observer_copy(), at, 0.0, &indices);
        let begun = numbers.clone();
        let symmetric = options.method == Method::Symmetric;
        let solver = Stepper::new(symmetric, numbers, slope, h, local)
            .ok_or_else(|| Error::domain("the motion is not defined at the start"))?;
        let mut run = Self {
            step: None,
            solver,
            implicit: Implicit::new(joints::method(&assembly, options.method), slow),
            assembly: assembly.clone(),
            options,
            dense: None,
            slowed: None,
            until: assembly.next_break(integrals.time).next_down(),
            since: (integrals.time, watch.iter().map(|rod| rod.det).collect()),
            largest: vec![0.0; links],
            taken_by: (assembly, None),
            watch,
            indices,
            extra: Cost::default(),
            released: 0.0,
            booked: 0.0,
            snaps: 0,
            folded: Vec::new(),
            unpushed: Vec::new(),
            pending: leaves.map(|body| AssemblyPending::Stop(Outcome::GrooveEnd(body))),
            due: None,
            room: None,
            unfit: vec![false; links],
            unfelt: 0.0,
            near,
            first,
            seen: None,
            parting: Vec::new(),
            bounces: VecDeque::new(),
            before_snap: None,
            folding: None,
            contacts: None,
            stopped: false,
            interrupted: false,
        };
        if symmetric {
            let undefined = || Error::domain("the motion is not defined at the start");
            run.resume(begun, None, h).ok_or_else(undefined)?;
        }
        Ok(run)
    }

    fn local(&self) -> f64 {
        self.options.local_tolerance()
    }

    /// Error of the integration along the rods.
    fn along(&self) -> f64 {
        (ALONG * self.local()).max(FINEST)
    }

    /// The sample of a state; None if a rod cannot be integrated under its wrench.
    fn describe(&self, assembly: &Arc<Assembly>, state: &DVector<f64>) -> Option<AssemblySample> {
        let assembly = assembly.observer_copy();
        let at = assembly.evaluated(state, self.along())?;
        let sample = AssemblySample::new(assembly, at, self.released, &self.indices);
        Some(self.with_contacts(sample))
    }

    /// The state at a time within the last step; None outside it.
    pub fn state_at(&mut self, t: f64) -> Option<AssemblySample> {
        if Arc::ptr_eq(&self.taken_by.0, &self.assembly) {
            self.taken_by.0 = self.assembly.observer_copy();
        }
        let state = self.inside(t)?;
        let assembly = &self.taken_by.0;
        let mut sample = self.describe(assembly, &state)?;
        sample.ledger.dissipated -= self.booked;
        // Interpolation errors of the order of the tolerance separate charts from poses, and the ledger would open.
        if sample.drift() <= self.drifted() {
            return Some(sample);
        }
        let held = assembly.close_gaps(state, &sample.at);
        let again = held.and_then(|state| self.describe(assembly, &state));
        Some(again.map_or(sample, |mut again| {
            again.ledger.dissipated -= self.booked;
            again
        }))
    }

    /// The present state. The chart of a tight rod near its fold can be found only from a neighbouring state,
    /// and not at all once steps have failed: then the sample at the end of the last step stands for it.
    pub fn sample_now(&self) -> AssemblySample {
        self.describe(&self.assembly, &self.solver.state().0)
            .or_else(|| self.seen.clone())
            .unwrap_or_else(|| self.first.clone())
    }

    /// Continues from `state` with the clock `slowed` and a first step of the length `h`. Symmetric steps have a
    /// clock of their own and are always slowed for a rod: the slowing is smooth, and harmless away from folds.
    fn resume(&mut self, state: StateVector, slowed: Option<SlowedTime>, h: f64) -> Option<()> {
        let is_slowed = slowed.is_some();
        self.go_on(state.clone(), slowed, h)?;
        if is_slowed || !self.solver.is_symmetric() {
            return Some(());
        }
        let size = |k: &usize| self.watch[*k].det.abs();
        let link = (0..self.watch.len()).min_by(|a, b| size(a).total_cmp(&size(b)))?;
        let scale = self.watch[link].det;
        self.go_on(state, Some(SlowedTime::one(link, scale)), h)
    }

    fn go_on(&mut self, state: StateVector, slowed: Option<SlowedTime>, h: f64) -> Option<()> {
        let along = self.along();
        let mut slope = state.clone();
        let held = self.held_contacts();
        let watch = &mut self.watch;
        self.assembly.write_slope_under(
            held.as_ref().map(|held| held as _),
            &state.seen(self.until).0,
            slowed.as_ref(),
            along,
            &mut slope.0,
            |k, sight| watch[k] = sight,
        )?;
        self.extra.evaluations += 1;
        let dets = self.watch.iter().map(|rod| rod.det);
        self.since = (state.time(), dets.collect());
        self.slowed = slowed;
        self.implicit.forget();
        self.solver.restart(state, slope, h)
    }

    /// Slows time for rod `link`, from a state with determinants `dets`, and for all rods about as near their
    /// folds. By the clock of one rod, the slopes of another that folds with it would be 0/0.
    fn slow(&mut self, state: StateVector, link: usize, dets: &[f64]) -> Option<()> {
        let near = |k: usize| (dets[k] / self.largest[k]).abs();
        let others = (0..dets.len()).filter(|k| {
            *k != link && !self.unpushed.contains(k) && near(*k) < COMPANY * near(link)
        });
        let rods = std::iter::once(link).chain(others);
        let slowed = SlowedTime {
            rods: rods.map(|k| (k, dets[k])).collect(),
        };
        let h = self.solver.next_step();
        self.resume(state, Some(slowed), h)
    }

    fn stop(&mut self, outcome: Outcome) -> Event {
        self.stopped = true;
        Event::Stop(outcome)
    }

    fn stuck(&mut self, cause: Cause, remedy: &str) -> Event {
        let coarse = if self.options.tolerance > COARSE {
            "lower run.tolerance, which is coarse; else "
        } else {
            ""
        };
        let remedy = format!("{coarse}{remedy}");
        let outcome = Outcome::stuck(self.solver.state().time(), cause, remedy);
        self.stop(outcome)
    }

    /// At the fold of a rod, or a branch point: finds its landings and, unless the run branches, goes on from
    /// the chosen one.
    fn snap(&mut self, time_error: f64, crossing: Option<Crossing>) -> Result<Event> {
        let link = self.folded[0].0;
        if self.snaps >= self.options.max_snaps {
            return Ok(self.stop(Outcome::SnapLimit));
        }
        if self.assembly.links()[link].has_turning() {
            return Ok(self.turned_over(link));
        }
        let along = self.along();
        let here = self.sample_now();
        let mut closing = LedgerClosure::new(self.first.ledger.total());
        closing.look(&self.first.ledger);
        closing.look(&here.ledger);
        if closing.is_lost() {
            let relative = closing.relative();
            let remedy = "what seems to be a fold is an error; lower run.tolerance";
            return Ok(self.stuck(Cause::Ledger { relative }, remedy));
        }
        if self.assembly.is_jointed(link) {
            return self.snap_with_joints(link, time_error, here);
        }
        let (point, fold) = (&here.at.points[link], here.at.now.charts[link]);
        let time = here.at.integrals.time;
        let rod = self.assembly.links()[link].seen_at(time, &point.base.pose.rotation)?;
        let held = point.held();
        let folding = rod.clone().into_owned();
        if let Some(crossing) = crossing
            && (crossing == Crossing::AllRound || !rod.falls(&fold, &held, along))
        {
            return Ok(self.stay(link, point, crossing));
        }
        let landed = match self.options.landing {
            LandingRule::Viscous => Landings::viscous(rod.settle(&fold, &held, along)?),
            rule => {
                let all = rod.landings(&fold, &held, along)?.into_iter();
                let all = all.map(|landing| (landing.chart, landing.reached));
                Landings::chosen(rule, all.collect(), |_| None)
            }
        };
        let end = |q: &Wrench, index, elastic| SnapEnd {
            q: DVector::from_column_slice(q.as_slice()),
            sheet: None,
            index,
            elastic,
        };
        let from = end(&fold, self.indices[link], point.end.energy);
        let snaps = landed.at.iter().map(|(q, reached)| {
            let landing = rod.held(q, &held, along)?;
            let to = end(q, rod.index(q, &held, along)?, landing.energy);
            Ok(Snap {
                t: here.at.integrals.time,
                time_error,
                pose: DVector::from_column_slice(held.translation.vector.as_slice()),
                velocity: DVector::from_column_slice(&point.relative_twist().as_slice()[3..]),
                released: point.end.whole_energy() - landing.whole_energy(),
                from: from.clone(),
                to,
                rod: link,
                joints: Vec::new(),
                base: point.base.pose.rotation,
                choices: landed.choices,
                reached: *reached,
                moving: Some(Box::new(here.at.now.clone())),
            })
        });
        let mut snaps = snaps.collect::<Result<Vec<Snap>>>()?;
        if snaps.is_empty() {
            return Ok(self.stop(Outcome::NoStableEquilibrium));
        }
        if self.options.landing == LandingRule::All {
            return Ok(self.stop(Outcome::Branched(snaps)));
        }
        let snap = snaps.swap_remove(0);
        self.land(&snap)?;
        (self.before_snap, self.folding) = (Some(here), Some(folding));
        Ok(Event::Snap(snap))
    }

    /// End of a run at the fold of a rod under loads that turn with the rod.
    fn turned_over(&mut self, link: usize) -> Event {
        let rod = self.assembly.rod_name(link);
        let why = Error::domain(format!(
            "{rod} has come to a fold under loads that turn with it: they have no potential, so that the energy of a snap depends on \
             the way of its fall, which a rod without friction and mass does not have"
        ));
        let remedy = "give the rod friction (damping) or its mass in full (inertia = \"full\"), or end before the fold";
        self.stuck(Cause::Failed(why), remedy)
    }

    /// Continues from the landing of a snap.
    fn land(&mut self, snap: &Snap) -> Result<()> {
        let state = self.solver.state().0.clone();
        let q = Wrench::from_column_slice(snap.to.q.as_slice());
        let state = self.assembly.with_chart(state, snap.rod, &q);
        let state = self.assembly.with_joints_of(state, snap.rod, &snap.joints);
        let state = StateVector(self.assembly.align_spins(state, self.along()));
        self.see_anew(&state, snap.rod)?;
        self.released += snap.released;
        self.snaps += 1;
        self.indices[snap.rod] = snap.to.index;
        self.largest[snap.rod] = 0.0;
        self.unfit[snap.rod] = false;
        (self.due, self.room) = (None, None);
        self.unpushed.clear();
        let h = self.solver.next_step();
        self.folded.retain(|(link, _)| *link != snap.rod);
        let rods = self.folded.clone();
        let others = (!rods.is_empty()).then_some(SlowedTime { rods });
        self.pending = others
            .is_some()
            .then_some(AssemblyPending::Fold(snap.time_error, None));
        self.resume(state, others, h)
            .ok_or_else(|| Error::no_convergence("the motion cannot leave its landing"))?;
        self.solver.refit();
        self.step = None;
        self.dense = None;
        self.settle_contacts()?;
        if let Some(touch) = self.mark_rods().filter(RodTouch::is_one) {
            self.pending = Some(AssemblyPending::Stop(Outcome::RodTouch(touch)));
        }
        if self.assembly.looks_for_contacts() {
            let state = self.solver.state();
            let now = self.assembly.configuration(&state.0);
            self.near = Nearness::at(&self.assembly, state.time(), &now);
            let touching = self.near.contact.filter(|contact| contact.gap < 0.0);
            if let Some(contact) = touching {
                self.pending = Some(AssemblyPending::Stop(Outcome::SelfContact(contact)));
            }
        }
        Ok(())
    }
}

/// Refuses a rod whose section law varies in time under loads without a potential: their power would count the motion
/// of the sections at a fixed chart.
fn one_drive(assembly: &Assembly) -> Result<()> {
    let mut links = assembly.links().iter().enumerate();
    match links.find(|(_, link)| link.varies_in_time() && link.has_turning()) {
        None => Ok(()),
        Some((k, _)) => Err(Error::domain(format!(
            "{} has a section law in time and bears loads that turn with it, or couples along it: a motion follows one of the two",
            assembly.rod_name(k)
        ))),
    }
}

/// Length of the first step.
fn first_step(state: &StateVector, slope: &StateVector, tolerance: f64) -> f64 {
    let rate = slope.mean_square(state, state).sqrt();
    FIRST * tolerance.powf(0.125) / rate.max(0.1)
}

fn indices(assembly: &Assembly, at: &Evaluated, tolerance: f64) -> Result<Vec<usize>> {
    let links = assembly.links().iter().enumerate();
    links
        .map(|(k, link)| {
            if link.has_turning() {
                Ok(0)
            } else {
                assembly.index_of_rod(k, at, tolerance)
            }
        })
        .collect()
}
