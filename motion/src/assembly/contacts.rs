//! Bodies of an assembly that hit obstacles and each other: an event of a contact ends the step, and the run goes on.
//!
//! Contact forces act on the bodies beside the wrenches of the rods ([`Reactions`]). An impact changes velocities
//! alone, so the charts of the rods stay.

use super::{AssemblyRun, AssemblySample, StateVector};
use crate::contact::{
    AccelerationBound, Bodies, Closed, ContactBooks, ContactDynamics, Found, Marks, Moment, Sums,
};
use crate::event::{Event, Outcome};
use crate::locate::{Guess, Timed, at_time, locate, shorten_step};
use crate::run::{AmongObstacles, RodTouch};
use crate::snap::LandingRule;
use nalgebra::{DVector, Vector6};
use snaprod_systems::assembly::{
    Assembly, BodyMotion, Configuration, Evaluated, Integrals, ReactionPower, Reactions,
};
use snaprod_systems::contact::RigidMotion;
use snaprod_systems::error::{Error, Result};
use snaprod_systems::solve::cost::Cost;
use snaprod_systems::solve::integrator::Method;
use snaprod_systems::solve::stepper::AcceptedStep;
use std::sync::Arc;

/// Part of a step at whose start an event is one of the start.
const AT_START: f64 = 1e-12;
/// Rate of slowed time, relative to the largest in a step, below which a stage gives no acceleration.
const STANDS: f64 = 1e-3;

/// Closed contacts, which act on the bodies within steps.
#[derive(Clone)]
pub(super) struct HeldContacts<'a> {
    system: &'a Bodies,
    closed: Vec<Closed>,
}

impl Reactions for HeldContacts<'_> {
    fn react(
        &self,
        at: &Evaluated,
        free: &[Vector6<f64>],
        wrenches: &mut [Vector6<f64>],
    ) -> Option<ReactionPower> {
        let mut now = moment(self.system, at.integrals.time, &at.now);
        now.accelerations = free.to_vec();
        let action = now.act(&self.closed)?;
        for (sum, wrench) in wrenches.iter_mut().zip(&action.wrenches) {
            *sum += wrench;
        }
        Some(ReactionPower {
            power: action.work,
            loss: action.loss,
        })
    }
}

fn moment<'a>(system: &'a Bodies, t: f64, now: &Configuration) -> Moment<'a> {
    let bodies = now.bodies.iter().take(system.len());
    let motion = |place: &BodyMotion| RigidMotion::new(place.pose, &place.twist);
    Moment::new(system, t, bodies.map(motion).collect())
}

/// The contacts of a run in progress.
#[derive(Clone)]
pub(super) struct AssemblyContacts<'a> {
    books: ContactBooks<'a>,
    /// True if the run ends where a rod touches an obstacle.
    pub rods_touch: bool,
    /// Places of the rods at the end of the last step.
    pub marks: Vec<Marks>,
    /// True if the integral of losses has more than friction at contacts.
    damped: bool,
    /// True if the integral of work has more than the work of obstacles.
    driven: bool,
}

/// A state with the losses of the last impacts.
struct StruckState {
    state: DVector<f64>,
    lost: f64,
    work: f64,
}

impl StruckState {
    fn new(state: &StateVector) -> Self {
        Self {
            state: state.0.clone(),
            lost: 0.0,
            work: 0.0,
        }
    }
}

/// The equations of motion of the bodies with their rods.
struct RodBodies<'a> {
    assembly: Arc<Assembly>,
    system: &'a Bodies,
    along: f64,
    /// Latest time at which loads and obstacles are evaluated.
    until: f64,
}

impl<'a> RodBodies<'a> {
    /// Places and velocities of the bodies, and the obstacles.
    fn at(&self, state: &DVector<f64>) -> Moment<'a> {
        let t = self.assembly.integrals(state).time.min(self.until);
        moment(self.system, t, &self.assembly.configuration(state))
    }

    /// [`RodBodies::at`] with the accelerations without contact forces, NaN where a rod has none.
    fn loaded(&self, state: &DVector<f64>) -> Moment<'a> {
        let mut now = self.at(state);
        let seen = StateVector(state.clone());
        let at = (self.assembly).evaluated(&seen.seen(self.until).0, self.along);
        now.accelerations = match at {
            Some(at) => self.assembly.accelerations(&at),
            None => vec![Vector6::repeat(f64::NAN); now.motions.len()],
        };
        now
    }
}

impl ContactDynamics for RodBodies<'_> {
    type State = StruckState;

    fn time(&self, y: &StruckState) -> f64 {
        self.assembly.integrals(&y.state).time
    }

    fn places(&self, y: &StruckState) -> Moment<'_> {
        self.at(&y.state)
    }

    fn moment(&self, y: &StruckState) -> Moment<'_> {
        self.loaded(&y.state)
    }

    fn add_twists(&self, y: &mut StruckState, changes: &[Vector6<f64>]) {
        self.assembly.add_twists(&mut y.state, changes);
    }

    fn shift(&self, y: &mut StruckState, changes: &[Vector6<f64>]) {
        self.assembly.shift_bodies(&mut y.state, changes);
    }

    fn book_impact(&self, y: &mut StruckState, loss: f64, work: f64) {
        y.lost += loss;
        y.work += work;
    }
}

impl<'a> AssemblyRun<'a> {
    /// The run among obstacles, with the bodies of the assembly in the order of the assembly.
    ///
    /// # Errors
    /// Another number of bodies; a start inside an obstacle; contact forces without a solution; a body in a groove; a
    /// rod whose mass acts to first order; symmetric steps; landings that branch.
    pub fn among_obstacles(mut self, obstacles: AmongObstacles<'a>) -> Result<Self> {
        let solids = self.assembly.solids();
        let refuse = |why: &str| Err(Error::domain(why));
        if obstacles.bodies.len() != solids.len() {
            return refuse("every body of the assembly has a shape, and no other body has one");
        }
        if self.assembly.light_rods().next().is_some() {
            return refuse(
                "contact is not followed together with the mass of the rod: inertia = \"none\" leaves it out",
            );
        }
        if solids.iter().any(|body| body.groove().is_some()) {
            return refuse(
                "bodies in grooves hit no obstacles: leave out the groove or the obstacles",
            );
        }
        if solids.iter().any(|body| body.guide().is_some()) {
            return refuse(
                "bodies on guides hit no obstacles: leave out the guide or the obstacles",
            );
        }
        if self.solver.is_symmetric() {
            return refuse("impacts are not reversible: symmetric steps have no obstacles");
        }
        if self.options.method == Method::Implicit {
            return refuse(
                "steps of elastic rods among obstacles are explicit: leave out the method",
            );
        }
        if self.options.landing == LandingRule::All {
            return refuse("a run among obstacles follows one landing");
        }
        let mut contacts = AssemblyContacts {
            books: ContactBooks::new(&obstacles),
            rods_touch: obstacles.rod_touches,
            marks: Vec::new(),
            damped: self.assembly.is_damped(),
            driven: self.assembly.is_driven(),
        };
        let mut state = StruckState::new(self.solver.state());
        let bodies = self.rod_bodies(obstacles.bodies);
        contacts.books.set.open(&bodies, &mut state)?;
        self.contacts = Some(contacts);
        self.until = self.next_break(0.0).next_down();
        if let Some(touch) = self.mark_rods().filter(RodTouch::is_one) {
            return Err(touch.at_start(&self.assembly.rod_name(touch.rod), obstacles.bodies));
        }
        self.first = self.sample_now();
        self.go_on_from(state)?;
        Ok(self)
    }

    fn rod_bodies(&self, system: &'a Bodies) -> RodBodies<'a> {
        RodBodies {
            assembly: self.assembly.observer_copy(),
            system,
            along: self.along(),
            until: self.until,
        }
    }

    /// Obstacles of the run, and bodies that hit obstacles.
    pub(super) fn among(&self) -> Option<&'a Bodies> {
        self.contacts
            .as_ref()
            .map(|contacts| contacts.books.set.system)
    }

    /// The contacts that act now; None without any.
    pub(super) fn held_contacts(&self) -> Option<HeldContacts<'a>> {
        let contacts = self.contacts.as_ref().filter(|all| all.books.set.holds())?;
        Some(HeldContacts {
            system: contacts.books.set.system,
            closed: contacts.books.set.closed.clone(),
        })
    }

    /// True if a contact acts on a body.
    pub(super) fn is_held_by_contacts(&self) -> bool {
        self.contacts
            .as_ref()
            .is_some_and(|all| all.books.set.holds())
    }

    /// First time after `t` at which a load, or the motion of a support or an obstacle is not smooth.
    pub(super) fn next_break(&self, t: f64) -> f64 {
        let obstacles = self.among().map_or(f64::INFINITY, |all| all.next_break(t));
        self.assembly.next_break(t).min(obstacles)
    }

    /// The time up to which the next step may lead: the end of the run, or of a sequence of bounces.
    pub(super) fn end_of_step(&self) -> f64 {
        let duration = self.options.duration;
        let contacts = self.contacts.as_ref();
        contacts.map_or(duration, |all| all.books.end_of_step(duration))
    }

    /// Continues from a state with the contacts as they are now.
    fn go_on_from(&mut self, state: StruckState) -> Result<()> {
        let sums = sums_of(&self.assembly.integrals(&state.state));
        if let Some(contacts) = &mut self.contacts {
            contacts.books.book(state.lost, state.work, sums);
        }
        let (slowed, h) = (self.slowed.clone(), self.solver.next_step());
        self.resume(StateVector(state.state), slowed, h)
            .ok_or_else(|| Error::no_convergence("no motion follows from an event of a contact"))
    }

    /// Ends the step at the first event of a contact. The outer None: no event; the inner None: it was lost.
    pub(super) fn contact_in_step(
        &mut self,
        step: &mut AcceptedStep<StateVector>,
    ) -> Option<Option<()>> {
        let contacts = self.contacts.as_ref()?;
        let (set, system) = (&contacts.books.set, contacts.books.set.system);
        let bodies = self.rod_bodies(system);
        let f = self.right_hand_side();
        let mut cost = Cost::default();
        let mut dense = None;
        let from = step.from().time();
        let length = step.to().time() - from;
        let ends = [step.from(), step.to()].map(|state| bodies.at(&state.0));
        let bounds = self.bounds_of(step);
        let touch = set.first_touch([&ends[0], &ends[1]], length, &bounds, |t| {
            let state = at_time(step, &mut dense, &mut { &f }, from + t, &mut cost)?;
            Some(bodies.at(&state.0))
        });
        // Fractions of the step, in its own variable.
        let mut first = None;
        if let Some((t, k)) = touch {
            let state = at_time(step, &mut dense, &mut { &f }, from + t, &mut cost);
            let rate = state.map(|state| {
                let (touch, slip) = bodies.at(&state.0).touch(k);
                touch.normal.dot(&slip)
            });
            first = Some((t / length, Found::Touch(k), rate.unwrap_or(f64::NAN)));
        }
        if set.holds() {
            if dense.is_none() {
                dense = step.interpolant(&mut { &f }, &mut cost);
            }
            let turn = dense.as_ref().and_then(|dense| {
                set.first_turn(|x| {
                    Some(match x {
                        1.0 => bodies.loaded(&step.to().0),
                        x => bodies.loaded(&dense.at(x).0),
                    })
                })
            });
            if let (Some((x, watch)), Some(dense)) = (turn, &dense) {
                let part = (dense.at(x).time() - from) / length;
                if first.is_none_or(|(earlier, ..)| part < earlier) {
                    first = Some((x, Found::Turn(watch), f64::NAN));
                }
            }
        }
        let found = first.map(|(part, found, rate)| {
            if part <= AT_START {
                let start = (step.from().clone(), step.start_slope().clone());
                return Some((found, None, start));
            }
            let shorter = match found {
                Found::Touch(k) => {
                    let gap =
                        |state: &StateVector, _: &StateVector| bodies.at(&state.0).touch(k).0.gap;
                    let h = part * step.h();
                    let guess = Guess {
                        h,
                        rate: rate * length / step.h(),
                        t: from + part * length,
                    };
                    locate(step, &mut { &f }, guess, gap, &mut cost).map(|found| found.step)
                }
                Found::Turn(_) => shorten_step(step, &mut { &f }, part, &mut cost),
            };
            let shorter = shorter?;
            let end = (shorter.to().clone(), shorter.end_slope().clone());
            Some((found, Some(shorter), end))
        });
        self.extra.evaluations += cost.evaluations;
        self.extra.samples += cost.samples;
        Some(found?.map(|(found, shorter, (state, slope))| {
            if let Some(shorter) = shorter {
                *step = shorter;
            }
            self.solver.rewind(state, slope);
            if let Some(contacts) = &mut self.contacts {
                contacts.books.due = Some(Some(found));
            }
        }))
    }

    /// Bounds of the accelerations of the bodies over a step, from the slopes at its stages.
    fn bounds_of(&self, step: &AcceptedStep<StateVector>) -> Vec<AccelerationBound> {
        let slopes = step.stage_slopes();
        let fastest = slopes.iter().map(Timed::time).fold(0.0, f64::max);
        let moving = slopes
            .iter()
            .filter(|slope| slope.time() > STANDS * fastest);
        let none = vec![AccelerationBound::default(); self.assembly.solids().len()];
        moving.fold(none, |most, slope| {
            let rates = self.assembly.twist_rates(&slope.0);
            let each = most.into_iter().zip(rates);
            each.map(|(most, rate)| most.max(AccelerationBound::of(&(rate / slope.time()))))
                .collect()
        })
    }

    /// After a step: keeps the closed contacts, and tells friction from other losses.
    pub(super) fn keep_contacts(&mut self) {
        let Some(system) = self.among() else {
            return;
        };
        if self.is_held_by_contacts() {
            self.divide_sums();
            let bodies = self.rod_bodies(system);
            let mut kept = StruckState::new(self.solver.state());
            let contacts = self.contacts.as_mut();
            if contacts.is_some_and(|all| all.books.set.keep(&bodies, &mut kept)) {
                let slope = self.solver.slope().clone();
                self.solver.rewind(StateVector(kept.state), slope);
            }
        }
        if let Some(contacts) = self
            .contacts
            .as_mut()
            .filter(|all| !all.books.set.closed.is_empty())
        {
            contacts.books.due.get_or_insert(None);
        }
    }

    /// Tells friction from drag, and the work of obstacles from that of loads, in the step just taken.
    fn divide_sums(&mut self) {
        let contacts = self.contacts.as_ref();
        let contacts = contacts.filter(|contacts| contacts.damped || contacts.driven);
        let (Some(step), Some(contacts)) = (&self.step, contacts) else {
            return;
        };
        let mut books = contacts.books.clone();
        let [from, to] =
            [&step.from().0, &self.solver.state().0].map(|state| self.assembly.integrals(state));
        let span = to.time - from.time;
        let bodies = self.rod_bodies(books.set.system);
        books.divide([sums_of(&from), sums_of(&to)], span, |x| {
            Some(bodies.loaded(&self.inside(from.time + x * span)?))
        });
        if let Some(contacts) = &mut self.contacts {
            contacts.books = books;
        }
    }

    /// Lets what is due at the end of the last step happen, and returns the first event that is still to be reported.
    pub(super) fn contact_event(&mut self) -> Option<Result<Event>> {
        if self.contacts.as_ref()?.books.due.is_some()
            && let Err(why) = self.happen()
        {
            return Some(Err(why));
        }
        let books = &mut self.contacts.as_mut()?.books;
        match books.next_event() {
            Some(event) => Some(Ok(Event::Contact(event))),
            None => books
                .are_spent()
                .then(|| Ok(self.stop(Outcome::ImpactLimit))),
        }
    }

    fn happen(&mut self) -> Result<()> {
        let mut state = StruckState::new(self.solver.state());
        let bodies = self.among().map(|system| self.rod_bodies(system));
        let (Some(bodies), Some(contacts)) = (bodies, &mut self.contacts) else {
            return Ok(());
        };
        if contacts.books.happen(&bodies, &mut state)? {
            self.go_on_from(state)?;
        }
        Ok(())
    }

    /// After a landing: closed contacts stay closed, or open under the new forces of the rod.
    pub(super) fn settle_contacts(&mut self) -> Result<()> {
        let Some(system) = self.among() else {
            return Ok(());
        };
        let bodies = self.rod_bodies(system);
        let mut state = StruckState::new(self.solver.state());
        if let Some(contacts) = &mut self.contacts {
            contacts.books.set.settle(&bodies, &mut state, &[])?;
            contacts.books.due = None;
        }
        self.go_on_from(state)
    }

    /// Adds the contacts, and the energies that contacts have taken and given, to a sample.
    pub(super) fn with_contacts(&self, mut sample: AssemblySample) -> AssemblySample {
        let Some(contacts) = &self.contacts else {
            return sample;
        };
        let sums = sample.at.integrals;
        let mut now = moment(
            contacts.books.set.system,
            sums.time.min(self.until),
            &sample.at.now,
        );
        now.accelerations = self.assembly.accelerations(&sample.at);
        sample.contact = Some(contacts.books.sample(now, sums_of(&sums)));
        sample.ledger.dissipated += contacts.books.lost;
        sample.ledger.work += contacts.books.struck;
        sample
    }
}

fn sums_of(sums: &Integrals) -> Sums {
    Sums {
        drag: sums.drag,
        work: sums.work,
    }
}
