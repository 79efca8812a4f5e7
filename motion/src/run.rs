//! Runs of an elastic rod as an iterator: motion on a sheet, snap at the fold, motion on the next sheet.

mod contacts;
mod elastica;
mod first_order_mass;
mod rod_gap;
mod saved;
mod touched_sample;
mod touching;

pub use contacts::{AmongObstacles, RodBound, RodTouch};
pub use elastica::on_elastica;

use super::contact::ContactSample;
use super::drive::{Motion, StateVariables};
use super::event::{Bounce, Event, Outcome};
use super::ledger::Ledger;
use super::options::Options;
use super::saved_state::SavedState;
use super::sheet::{OnSheet, Phase, Progress};
use super::snap::{LandingRule, Snap, SnapEnd, landings, orientation};
use super::start::{Departure, depart};
use super::state::{State, StateRef};
use nalgebra::{DVector, SVector, UnitQuaternion};
use snaprod_systems::body::PointMass;
use snaprod_systems::error::{Cause, Error, Result};
use snaprod_systems::manifold::{Multivalued, Patch, Sheet};
use snaprod_systems::solve::cost::Cost;

/// The state of a run at one moment.
#[derive(Debug, Clone, PartialEq)]
pub struct Sample<const N: usize> {
    /// Time, chart point, velocity.
    pub phase: Phase<N>,
    /// Pose.
    pub pose: SVector<f64, N>,
    /// Force of the rod on the body.
    pub force: SVector<f64, N>,
    /// Sheet.
    pub sheet: Sheet,
    /// Morse index.
    pub index: usize,
    /// Ledger.
    pub ledger: Ledger,
    /// Contacts; None without obstacles.
    pub contact: Option<ContactSample>,
}

/// Steps between two estimates of the remaining number of steps.
const STRETCH: u64 = 50_000;
/// Number of estimates in a row, each above twice the step limit, that end a run: a mass that passes the straight rod
/// takes up to a million steps for the passage.
const PATIENCE: u32 = 30;

/// The state at a time before the start of the integration, with kinetic and potential energy of the rod.
type Early<'a, const N: usize> = Box<dyn Fn(f64) -> Option<(Phase<N>, [f64; 2])> + 'a>;

/// A run in progress.
pub struct Run<'a, M, const N: usize> {
    manifold: &'a M,
    body: &'a PointMass<N>,
    options: Options,
    motion: OnSheet<'a, M, N>,
    /// Contacts with obstacles; None without obstacles.
    contacts: Option<contacts::RunContacts<'a, N>>,
    /// True while the motion feels the mass of the rod.
    followed: bool,
    /// Value of `followed` from the end of the last step on, if known.
    due: Option<bool>,
    /// Margin of the criterion for `followed` at the end of the last step, if known.
    room: Option<f64>,
    /// Total time without the rod's mass, for a rod that has one.
    unfelt: f64,
    /// True while the end shakes next to the straight rod, so hard that the mass of the rod is left out.
    shakes: bool,
    /// True if the last step was ended at the edge of the neighbourhood of the straight rod.
    at_edge: bool,
    index: usize,
    snapped: f64,
    snaps: u64,
    past: Cost,
    pending: Option<f64>,
    /// True while the body moves outward against the pull; None if the rod is not taut.
    outward: Option<bool>,
    /// Energy at the start of a motion next to the straight rod, less the loss counted in `snapped`. The change over
    /// that motion, of the order of the rod's mass times the deflection, goes to vibrations of the rod.
    straight: Option<f64>,
    /// An event of the last step that is still to be reported.
    found: Option<Event>,
    /// The state just before the last snap.
    before_snap: Option<Sample<N>>,
    stopped: bool,
    interrupted: bool,
    /// The initial state as given.
    given: Phase<N>,
    /// Initial pose and energies of the rod, if the chart has them only to rounding: those of the straight rod.
    given_pose: Option<(SVector<f64, N>, [f64; 2])>,
    /// States from the given time to the start of the integration: see [`Run::straight`].
    early: Option<Early<'a, N>>,
    /// True once the step over the early states was reported.
    announced: bool,
    /// Steps and time at the last estimate.
    milestone: (u64, f64),
    /// Number of estimates in a row at which the end was out of reach.
    slow_looks: u32,
}

impl<'a, M: Multivalued<N>, const N: usize> Run<'a, M, N> {
    /// A run from the chart point `q` with velocity `v` at time 0. A start on a fold moves off to the stable
    /// side if it can, and snaps at once otherwise.
    ///
    /// # Errors
    /// A start outside the chart, or a velocity that is not finite.
    pub fn new(
        manifold: &'a M,
        body: &'a PointMass<N>,
        q: SVector<f64, N>,
        v: SVector<f64, N>,
        options: Options,
    ) -> Result<Self> {
        let zero = Phase {
            q,
            v,
            t: 0.0,
            work: 0.0,
            drag_loss: 0.0,
        };
        Self::start(manifold, body, zero, options, 0.0, 0)
    }

    fn start(
        manifold: &'a M,
        body: &'a PointMass<N>,
        phase: Phase<N>,
        options: Options,
        snapped: f64,
        snaps: u64,
    ) -> Result<Self> {
        if !phase.v.iter().all(|v| v.is_finite()) {
            return Err(Error::domain(format!(
                "the velocity {} must be finite",
                snaprod_systems::error::named(&snaprod_systems::error::AXES, phase.v.as_slice())
            )));
        }
        manifold.check_resolution(&phase.q)?;
        let given = phase;
        let departure = depart(manifold, body, &phase)?;
        let (phase, orientation, index, pending) = match departure {
            Departure::Regular { orientation } => {
                (phase, orientation, manifold.index(&phase.q)?, None)
            }
            Departure::FromFold {
                phase,
                orientation,
                index,
            } => (phase, orientation, index, None),
            Departure::Snap { index } => {
                (phase, orientation(manifold, &phase.q)?, index, Some(0.0))
            }
        };
        let rod = (body.rod()).filter(|rod| rod.validity_margin(&phase.q, &phase.v, true) > 0.0);
        let mut run = Self {
            manifold,
            body,
            options,
            motion: OnSheet::new(manifold, body, phase, orientation, rod, &options)?,
            contacts: None,
            followed: rod.is_some(),
            due: None,
            room: None,
            shakes: false,
            at_edge: false,
            unfelt: 0.0,
            index,
            snapped,
            snaps,
            past: Cost::default(),
            pending,
            outward: None,
            straight: None,
            found: None,
            before_snap: None,
            stopped: false,
            interrupted: false,
            given,
            given_pose: None,
            early: None,
            announced: false,
            milestone: (0, phase.t),
            slow_looks: 0,
        };
        run.outward = run.motion.moves_outward();
        Ok(run)
    }

    /// The run that follows from `snap`, one of those of [`Outcome::Branched`].
    ///
    /// # Errors
    /// A snap whose landing is no chart point of the manifold of the run; a run among obstacles.
    pub fn branch(&self, snap: &Snap) -> Result<Self> {
        if self.contacts.is_some() {
            return Err(Error::domain(
                "a run among obstacles does not branch: choose one landing",
            ));
        }
        if snap.to.q.len() != N {
            return Err(Error::domain(format!(
                "the snap lands at a chart point of {} numbers; this manifold has {N}",
                snap.to.q.len()
            )));
        }
        let phase = Phase {
            q: SVector::from_column_slice(snap.to.q.as_slice()),
            ..self.motion.phase()
        };
        let mut run = Self::start(
            self.manifold,
            self.body,
            phase,
            self.options,
            self.snapped + snap.released,
            self.snaps + 1,
        )?;
        if run.followed {
            run.snapped -= run.of_rod(&phase).iter().sum::<f64>();
        }
        Ok(run)
    }

    /// The state now.
    pub fn now(&self) -> Sample<N> {
        self.describe(self.motion.phase())
    }

    /// The state at a time within the last step; None outside it.
    pub fn sample(&mut self, t: f64) -> Option<Sample<N>> {
        Some(match &self.early {
            Some(early) => {
                let (phase, of_rod) = early(t)?;
                self.with_energies(phase, of_rod)
            }
            None => {
                let phase = self.motion.at(t)?;
                self.describe(phase)
            }
        })
    }

    /// The initial state as given; it may lie a first small step before the motion. See [`Run::new`] on
    /// starts at folds.
    pub fn given(&self) -> Sample<N> {
        let Some((pose, of_rod)) = self.given_pose else {
            return self.describe(self.given);
        };
        Sample {
            pose,
            ..self.with_energies(self.given, of_rod)
        }
    }

    /// Time now.
    pub fn time(&self) -> f64 {
        self.motion.time()
    }

    /// End of time.
    pub fn duration(&self) -> f64 {
        self.options.duration
    }

    /// Ends the run at its next step, with [`Outcome::Interrupted`].
    pub fn interrupt(&mut self) {
        self.interrupted = true;
    }

    /// Cost so far.
    pub fn cost(&self) -> Cost {
        self.past + self.motion.cost()
    }

    /// Sees anew the loads at the end of the last step ([`Motion::renew`]).
    fn see_loads_anew(&mut self) -> Result<()> {
        self.motion.look_anew();
        self.settle_contacts()
    }

    /// Snaps so far.
    pub fn snaps(&self) -> u64 {
        self.snaps
    }

    fn describe(&self, phase: Phase<N>) -> Sample<N> {
        if let Some((phase, of_rod)) = self.early.as_ref().and_then(|early| early(phase.t)) {
            return self.with_energies(phase, of_rod);
        }
        let mut state = self.with_mass(phase);
        if let Some(total) = self.straight {
            state.ledger.dissipated += total + self.snapped - state.ledger.total();
        }
        state
    }

    /// The state, with kinetic and potential energy of the rod.
    fn with_energies(&self, phase: Phase<N>, [kinetic, potential]: [f64; 2]) -> Sample<N> {
        let at = self
            .manifold
            .point(&phase.q)
            .expect("every state of a run lies in the chart");
        let mut ledger = Ledger::new(self.body, &at, &phase, self.snapped);
        ledger.rod_kinetic = kinetic;
        ledger.potential += potential;
        let [lost, struck] = self.of_impacts();
        ledger.dissipated += lost;
        ledger.work += struck;
        Sample {
            contact: self.contact_sample(&phase),
            phase,
            pose: at.pose,
            force: at.force,
            sheet: self.manifold.sheet(&phase.q),
            index: self.index,
            ledger,
        }
    }

    /// Number of further steps the run would take at the rate of the last stretch, if hopeless for
    /// [`PATIENCE`] estimates in a row. A mass close to the straight rod shakes along it ever faster, without
    /// bound; one that only passes gets slower again.
    fn steps_out_of_reach(&mut self, steps: u64) -> Option<f64> {
        let (before, since) = self.milestone;
        let time = self.time();
        self.milestone = (steps, time);
        let per_time = (steps - before) as f64 / (time - since);
        let needed = per_time * (self.options.duration - time);
        let most = self.options.max_steps as f64;
        if needed <= 2.0 * most {
            self.slow_looks = 0;
            return None;
        }
        self.slow_looks += 1;
        (self.slow_looks >= PATIENCE).then_some(needed)
    }

    /// The bounce within the last step: the stored energy of a taut rod went through a maximum. None if there
    /// was none.
    fn bounce(&mut self) -> Option<Bounce> {
        let now = self.motion.moves_outward();
        let turned = match (self.outward, now) {
            (Some(true), Some(false) | None) | (None, Some(false)) => true,
            (Some(false) | None, _) | (Some(true), Some(true)) => false,
        };
        self.outward = now;
        if !turned {
            return None;
        }
        let there = self.motion.at_largest_energy()?;
        let lambda = self.manifold.tautness(Patch::Global, &there.q)?;
        let at = self.manifold.point(&there.q)?;
        Some(Bounce {
            rod: 0,
            t: there.t,
            pose: dynamic(&at.pose),
            velocity: dynamic(&there.v),
            tension: lambda * lambda,
            lambda,
            elastic: at.energy,
            mass: self.body.mass(),
        })
    }

    fn stop(&mut self, outcome: Outcome) -> Event {
        self.stopped = true;
        Event::Stop(outcome)
    }

    fn stuck(&mut self, cause: Cause, remedy: &str) -> Event {
        let outcome = Outcome::stuck(self.time(), cause, remedy);
        self.stop(outcome)
    }

    /// At a fold: finds the landings and, unless the run branches, goes on from the chosen one.
    fn snap(&mut self, time_error: f64) -> Result<Event> {
        if self.snaps >= self.options.max_snaps {
            return Ok(self.stop(Outcome::SnapLimit));
        }
        let phase = self.motion.phase();
        let here = self.describe(phase);
        let landed = landings(self.manifold, &phase.q, self.options.landing)?;
        let mut snaps = Vec::with_capacity(landed.at.len());
        for &(q, reached) in &landed.at {
            let elastic = self
                .manifold
                .point(&q)
                .ok_or_else(|| Error::domain("a landing outside the chart"))?
                .energy;
            snaps.push(Snap {
                base: UnitQuaternion::identity(),
                t: phase.t,
                time_error,
                pose: dynamic(&here.pose),
                velocity: dynamic(&phase.v),
                from: SnapEnd {
                    q: dynamic(&phase.q),
                    sheet: Some(here.sheet),
                    index: self.index,
                    elastic: here.ledger.elastic,
                },
                to: SnapEnd {
                    q: dynamic(&q),
                    sheet: Some(self.manifold.sheet(&q)),
                    index: self.manifold.index(&q)?,
                    elastic,
                },
                released: here.ledger.elastic - elastic,
                rod: 0,
                joints: Vec::new(),
                choices: landed.choices,
                reached,
                moving: None,
            });
        }
        if snaps.is_empty() {
            return Ok(self.stop(Outcome::NoStableEquilibrium));
        }
        if self.options.landing == LandingRule::All {
            return Ok(self.stop(Outcome::Branched(snaps)));
        }
        let (snap, (q, _)) = (snaps.swap_remove(0), landed.at[0]);
        self.before_snap = Some(here);
        self.past = self.cost();
        (self.due, self.room) = (None, None);
        self.snapped += snap.released;
        self.snaps += 1;
        self.index = snap.to.index;
        self.motion = OnSheet::new(
            self.manifold,
            self.body,
            Phase { q, ..phase },
            orientation(self.manifold, &q)?,
            None,
            &self.options,
        )?;
        self.outward = self.motion.moves_outward();
        self.settle_contacts()?;
        Ok(Event::Snap(snap))
    }
}

fn dynamic<const N: usize>(v: &SVector<f64, N>) -> DVector<f64> {
    DVector::from_column_slice(v.as_slice())
}

impl<M: Multivalued<N>, const N: usize> Iterator for Run<'_, M, N> {
    type Item = Event;

    fn next(&mut self) -> Option<Event> {
        if self.stopped {
            return None;
        }
        match self.found.take() {
            Some(Event::Stop(outcome)) => return Some(self.stop(outcome)),
            Some(event) => return Some(event),
            None => {}
        }
        if self.interrupted {
            return Some(self.stop(Outcome::Interrupted));
        }
        if let Some(time_error) = self.pending.take() {
            return Some(self.snap(time_error).unwrap_or_else(|e| {
                self.stuck(
                    Cause::Failed(e.context("the snap")),
                    "change the start a little, or the landing rule",
                )
            }));
        }
        match self.contact_event() {
            Some(Ok(event)) => return Some(event),
            Some(Err(why)) => {
                return Some(self.stuck(
                    Cause::Failed(why),
                    "change the obstacles, the start or the friction a little",
                ));
            }
            None => {}
        }
        let from = self.time();
        if self.early.is_some() && !self.announced {
            self.announced = true;
            return Some(Event::Step {
                from: self.given.t,
                to: from,
            });
        }
        // Energy of the rod at the end of the opening goes to its own vibrations, except the part with which
        // the motion continues.
        if let Some((phase, of_rod)) = self.early.as_ref().and_then(|early| early(from)) {
            let before = self.with_energies(phase, of_rod).ledger.total();
            self.early = None;
            self.snapped += before - self.now().ledger.total();
        }
        self.early = None;
        if from >= self.options.duration {
            return Some(self.stop(Outcome::EndOfTime));
        }
        if let Err(why) = self.motion.resolved() {
            return Some(self.stuck(
                Cause::Failed(why),
                "start with a smaller |p|, less load or less speed",
            ));
        }
        let steps = self.cost().steps;
        if steps >= self.options.max_steps {
            return Some(self.stop(Outcome::StepLimit));
        }
        if self.options.max_steps > 20 * STRETCH
            && steps >= self.milestone.0 + STRETCH
            && let Some(steps) = self.steps_out_of_reach(steps)
        {
            return Some(self.stuck(
                Cause::TooSlow { steps },
                "the motion's own time has become too short for the time asked: a mass under an enormous load shakes so, and one next to the \
                 straight rod, along the rod, if loads break or change while it turns round a few hundred times: lower the load, or make it \
                 change less often; or end earlier, or raise max_steps",
            ));
        }
        let progress = match self.step() {
            Ok(progress) => progress,
            Err(why) => {
                return Some(self.stuck(
                    Cause::Failed(why),
                    "leave out the rod's mass: inertia = \"none\"",
                ));
            }
        };
        let Some(progress) = progress else {
            let cause = Cause::StepCollapsed {
                next: self.motion.next_step(),
                tolerance: self.options.tolerance,
            };
            return Some(self.stuck(
                cause,
                "the motion runs into a point that the model does not lead through (for the elastica: straight, at full reach, and so fast \
                 that the force has no bound): start with less speed, or a little beside it (kappa in [start])",
            ));
        };
        let progress = match self.look_for_contact(progress) {
            Ok(progress) => progress,
            Err(why) => {
                return Some(self.stuck(
                    Cause::Failed(why),
                    "change the obstacles, the start or the friction a little",
                ));
            }
        };
        if let Progress::Fold { time_error } = progress {
            self.pending = Some(time_error);
        }
        if self.found.is_none() {
            self.found = self.bounce().map(Event::Bounce);
        }
        Some(Event::Step {
            from,
            to: self.time(),
        })
    }
}

impl<'a, M: Multivalued<N>, const N: usize> Motion<'a> for Run<'a, M, N>
where
    Sample<N>: State,
{
    fn advance(&mut self) -> Option<Event> {
        self.next()
    }

    fn given(&self) -> StateRef<'_> {
        StateRef::Made(Box::new(self.given()))
    }

    fn now(&self) -> StateRef<'_> {
        StateRef::Made(Box::new(self.now()))
    }

    fn before_snap(&self) -> Option<StateRef<'_>> {
        self.before_snap.as_ref().map(|state| StateRef::Kept(state))
    }

    fn sample(&mut self, t: f64) -> Option<StateRef<'_>> {
        Some(StateRef::Made(Box::new(self.sample(t)?)))
    }

    fn save(&mut self, t: f64) -> Result<SavedState> {
        self.save(t)
    }

    fn restore(&mut self, saved: &SavedState) -> Result<()> {
        self.restore(saved)
    }

    fn renew(&mut self) -> Result<()> {
        self.see_loads_anew()
    }

    fn duration(&self) -> f64 {
        self.duration()
    }

    fn interrupt(&mut self) {
        self.interrupt();
    }

    fn cost(&self) -> Cost {
        self.cost()
    }

    fn time_without_mass(&self) -> f64 {
        self.unfelt
    }

    fn carries(&self) -> Vec<StateVariables> {
        StateVariables::some([
            ("chart of the sheet", N),
            ("velocity of the body", N),
            ("time, work and loss to drag", 3),
        ])
    }

    fn branch(&self, snap: &Snap) -> Result<Box<dyn Motion<'a> + 'a>> {
        Ok(Box::new(self.branch(snap)?))
    }
}
