//! A motion of bodies with contact from event to event.

use super::bodies::{
    Bodies, DRAG, FRICTION, IMPACTS, OBSTACLES, PER_BODY, SUMS, WORK, place_of, read_motion,
    write_motion,
};
use super::body_ledger::BodyLedger;
use super::body_options::BodyOptions;
use super::contact_dynamics::ContactDynamics;
use super::contact_forces::{AccelerationBound, Closed, Moment};
use super::contact_set::{ContactNow, ContactSet, Found};
use crate::event::{Event, Outcome};
use nalgebra::{DVector, UnitQuaternion, Vector6};
use snaprod_systems::contact::RigidMotion;
use snaprod_systems::error::{Cause, Error, Result};
use snaprod_systems::math::se3::{join, spin};
use snaprod_systems::solve::cost::Cost;
use snaprod_systems::solve::dop853::{Dense, Dop853, Step};

/// The bodies at one moment.
#[derive(Debug, Clone, PartialEq)]
pub struct BodiesSample {
    /// The time.
    pub t: f64,
    /// Pose and velocity of each body, in the world, at its reference point.
    pub motions: Vec<RigidMotion>,
    /// The contacts that carry forces.
    pub contacts: Vec<ContactNow>,
    /// The least gap of all possible contacts; infinite without any.
    pub least_gap: f64,
    /// Energies.
    pub ledger: BodyLedger,
}

/// The last step with its closed contacts.
struct LastStep {
    step: Step<DVector<f64>>,
    closed: Vec<Closed>,
    until: f64,
}

/// Most events in a row between which no time passes.
pub(super) const AT_ONCE: u32 = 100;
/// Most corrections of the time of an event.
const CORRECTIONS: usize = 6;

/// Bodies without rods, with loads and obstacles where they are no later than a time.
#[derive(Clone, Copy)]
struct FreeBodies<'a> {
    system: &'a Bodies,
    /// The latest time at which loads are evaluated: just before the next break of a load.
    until: f64,
}

/// Powers of the loads on bodies.
#[derive(Default)]
struct LoadPower {
    work: f64,
    loss: f64,
}

impl<'a> FreeBodies<'a> {
    fn at(&self, y: &DVector<f64>) -> Moment<'a> {
        let numbers = y.as_slice();
        let motions = (0..self.system.bodies.len())
            .map(|k| read_motion(&numbers[place_of(k)..][..PER_BODY]))
            .collect();
        Moment::new(self.system, y[0].min(self.until), motions)
    }

    fn loaded(&self, y: &DVector<f64>) -> (Moment<'a>, LoadPower) {
        let mut now = self.at(y);
        let t = y[0].min(self.until);
        let mut power = LoadPower::default();
        let mut wrenches = vec![Vector6::zeros(); now.motions.len()];
        if let Some(forces) = &self.system.forces {
            forces(t, &now.motions, &mut wrenches);
            let each = wrenches.iter().zip(&now.motions);
            power.work = each.map(|(w, m)| w.dot(&join(&m.spin, &m.velocity))).sum();
        }
        for (k, body) in self.system.bodies.iter().enumerate() {
            let motion = &now.motions[k];
            let twist = join(&motion.spin, &motion.velocity);
            let free = body.mass.motion(t, &motion.pose, &twist, &wrenches[k]);
            now.accelerations[k] = free.acceleration;
            power.work += free.power;
            power.loss += free.loss;
        }
        (now, power)
    }

    /// The slope of the state with these closed contacts; None without finite accelerations.
    fn slope(&self, y: &DVector<f64>, closed: &[Closed]) -> Option<DVector<f64>> {
        let mut slope = DVector::zeros(y.len());
        let (mut now, power) = self.loaded(y);
        let contact = now.act(closed)?;
        slope[0] = 1.0;
        slope[WORK] = power.work;
        slope[DRAG] = power.loss;
        slope[FRICTION] = contact.loss;
        slope[OBSTACLES] = contact.work;
        for (k, motion) in now.motions.iter().enumerate() {
            let at = place_of(k);
            // The quaternion turns with the spin along the body's axes, whatever its norm.
            let turn = nalgebra::Vector4::from_column_slice(&y.as_slice()[at..at + 4]);
            let seen = motion.pose.rotation.inverse() * motion.spin;
            slope.fixed_rows_mut::<4>(at).copy_from(&spin(&turn, &seen));
            slope
                .fixed_rows_mut::<3>(at + 4)
                .copy_from(&motion.velocity);
            let acceleration = now.accelerations[k] + contact.accelerations[k];
            slope.fixed_rows_mut::<6>(at + 7).copy_from(&acceleration);
        }
        slope.iter().all(|x| x.is_finite()).then_some(slope)
    }

    /// Bounds of the accelerations of all bodies over a step, from the slopes at its stages.
    fn bounds(&self, slopes: &[DVector<f64>]) -> Vec<AccelerationBound> {
        let of = |k: usize| {
            let each = slopes.iter().map(|slope| {
                AccelerationBound::of(&slope.fixed_rows::<6>(place_of(k) + 7).into_owned())
            });
            each.fold(AccelerationBound::default(), AccelerationBound::max)
        };
        (0..self.system.len()).map(of).collect()
    }
}

impl ContactDynamics for FreeBodies<'_> {
    type State = DVector<f64>;

    fn time(&self, y: &DVector<f64>) -> f64 {
        y[0]
    }

    fn places(&self, y: &DVector<f64>) -> Moment<'_> {
        self.at(y)
    }

    fn moment(&self, y: &DVector<f64>) -> Moment<'_> {
        self.loaded(y).0
    }

    fn add_twists(&self, y: &mut DVector<f64>, changes: &[Vector6<f64>]) {
        for (k, change) in changes.iter().enumerate() {
            let mut twist = y.fixed_rows_mut::<6>(place_of(k) + 7);
            twist += change;
        }
    }

    fn shift(&self, y: &mut DVector<f64>, changes: &[Vector6<f64>]) {
        for (k, change) in changes.iter().enumerate() {
            let at = place_of(k);
            let mut motion = read_motion(&y.as_slice()[at..]);
            let turn = change.fixed_rows::<3>(0).into_owned();
            motion.pose.translation.vector += change.fixed_rows::<3>(3);
            motion.pose.rotation = UnitQuaternion::from_scaled_axis(turn) * motion.pose.rotation;
            write_motion(&motion, &mut y.as_mut_slice()[at..]);
        }
    }

    fn book_impact(&self, y: &mut DVector<f64>, loss: f64, work: f64) {
        y[IMPACTS] += loss;
        y[OBSTACLES] += work;
    }
}

/// A motion of bodies with contact in progress.
pub struct BodyMotion<'a> {
    bodies: FreeBodies<'a>,
    options: BodyOptions,
    contacts: ContactSet<'a>,
    solver: Dop853<DVector<f64>>,
    last: Option<LastStep>,
    /// Events in a row between which no time passed.
    at_once: u32,
    stopped: bool,
    interrupted: bool,
}

impl<'a> BodyMotion<'a> {
    /// A motion that starts at time 0 with these poses and velocities of the bodies.
    ///
    /// # Errors
    /// Another number of bodies; a pair without a closed form; a number that is not finite; a start inside an obstacle
    /// or another body; contact forces without a solution.
    pub fn new(system: &'a Bodies, start: &[RigidMotion], options: BodyOptions) -> Result<Self> {
        if start.len() != system.len() {
            return Err(Error::domain(format!(
                "{} poses were given for {} bodies",
                start.len(),
                system.len()
            )));
        }
        let mut y = DVector::zeros(SUMS + PER_BODY * start.len());
        for (k, motion) in start.iter().enumerate() {
            write_motion(motion, &mut y.as_mut_slice()[place_of(k)..][..PER_BODY]);
        }
        if !y.iter().all(|x| x.is_finite()) {
            return Err(Error::domain(
                "the poses and velocities at the start must be finite",
            ));
        }
        let until = system.next_break(0.0).next_down();
        let bodies = FreeBodies { system, until };
        let mut contacts = ContactSet::new(system, options.resting_speed);
        contacts.open(&bodies, &mut y)?;
        let slope = bodies.slope(&y, &contacts.closed).ok_or_else(|| {
            Error::domain(
                "the accelerations at the start are not finite, or no contact forces exist",
            )
        })?;
        let h = 1e-2 * options.duration;
        Ok(Self {
            bodies,
            options,
            contacts,
            solver: Dop853::new(y, slope, h, options.tolerance),
            last: None,
            at_once: 0,
            stopped: false,
            interrupted: false,
        })
    }

    /// Time now.
    pub fn time(&self) -> f64 {
        self.solver.state()[0]
    }

    /// The state now.
    pub fn now(&self) -> BodiesSample {
        Self::describe(&self.bodies, self.solver.state(), &self.contacts.closed)
    }

    /// The state at a time within the last step; None outside it.
    pub fn sample(&mut self, t: f64) -> Option<BodiesSample> {
        if t == self.time() {
            return Some(self.now());
        }
        let last = self.last.as_ref()?;
        if !(last.step.from[0] <= t && t <= last.step.to[0]) {
            return None;
        }
        // The time at the end is a sum with rounding of its own.
        let h = (t - last.step.from[0]).min(last.step.h);
        let (closed, bodies) = (
            &last.closed,
            FreeBodies {
                until: last.until,
                ..self.bodies
            },
        );
        let f = |y: &DVector<f64>| bodies.slope(y, closed);
        let mut cost = Cost::default();
        let y = if h == 0.0 {
            last.step.from.clone()
        } else {
            last.step.redo(f, h, &mut cost)?.to
        };
        Some(Self::describe(&bodies, &y, closed))
    }

    /// End of time.
    pub fn duration(&self) -> f64 {
        self.options.duration
    }

    /// Impacts so far.
    pub fn impacts(&self) -> u64 {
        self.contacts.impacts
    }

    /// Cost so far.
    pub fn cost(&self) -> Cost {
        self.solver.cost()
    }

    /// Ends the motion at its next step, with [`Outcome::Interrupted`].
    pub fn interrupt(&mut self) {
        self.interrupted = true;
    }

    fn describe(bodies: &FreeBodies<'_>, y: &DVector<f64>, closed: &[Closed]) -> BodiesSample {
        let mut now = bodies.moment(y);
        let [kinetic, potential] = now.energies(y[0]);
        BodiesSample {
            t: y[0],
            contacts: now.contacts_now(closed),
            least_gap: now.least_gap(),
            motions: now.motions,
            ledger: BodyLedger {
                kinetic,
                potential,
                impact_loss: y[IMPACTS],
                friction_loss: y[FRICTION],
                drag_loss: y[DRAG],
                work: y[WORK],
                obstacle_work: y[OBSTACLES],
            },
        }
    }

    fn stop(&mut self, outcome: Outcome) -> Event {
        self.stopped = true;
        Event::Stop(outcome)
    }

    fn stuck(&mut self, why: Error) -> Event {
        let remedy = "change the shapes, the start or the friction a little";
        let outcome = Outcome::stuck(self.time(), Cause::Failed(why), remedy);
        self.stop(outcome)
    }

    /// Advances to the next event: a step, a contact event, or the stop. None after the stop.
    pub fn advance(&mut self) -> Option<Event> {
        if self.stopped {
            return None;
        }
        if !self.contacts.events.is_empty() {
            return Some(Event::Contact(self.contacts.events.remove(0)));
        }
        let from = self.time();
        if self.interrupted {
            return Some(self.stop(Outcome::Interrupted));
        }
        if from >= self.options.duration {
            return Some(self.stop(Outcome::EndOfTime));
        }
        if self.contacts.impacts >= self.options.max_impacts {
            return Some(self.stop(Outcome::ImpactLimit));
        }
        if self.solver.cost().steps >= self.options.max_steps {
            return Some(self.stop(Outcome::StepLimit));
        }
        if let Err(why) = self.step() {
            return Some(self.stuck(why));
        }
        let to = self.time();
        Some(Event::Step { from, to })
    }

    /// One step, at most to the next event.
    fn step(&mut self) -> Result<()> {
        let from = self.time();
        let system = self.bodies.system;
        let until = system.next_break(from);
        if until.next_down() != self.bodies.until {
            self.bodies.until = until.next_down();
            self.restart(self.solver.state().clone(), self.solver.next_step())?;
        }
        let ends = self.contacts.pending.iter().map(|pending| pending.t);
        let end = ends.fold(until.min(self.options.duration), f64::min);
        let (bodies, closed) = (self.bodies, self.contacts.closed.clone());
        let f = |y: &DVector<f64>| bodies.slope(y, &closed);
        let mut state = self.solver.state().clone();
        let mut found = None;
        if end > from {
            let collapsed = |_| Error::no_convergence("the step size collapsed");
            let mut step = self.solver.step(f, end - from).map_err(collapsed)?;
            let arrives = step.h >= end - from;
            let mut cost = Cost::default();
            found = self.find(&mut step, f, &mut cost);
            if let Some((h, _)) = found {
                let redone = step.redo(f, h, &mut cost);
                step = redone.ok_or_else(|| Error::no_convergence("an event was lost"))?;
            }
            state = step.to.clone();
            if found.is_none() && arrives {
                state[0] = end;
            }
            let total = self.solver.cost_mut();
            *total = *total + cost;
            self.last = Some(LastStep {
                step,
                closed,
                until: bodies.until,
            });
        }
        let reached = state.clone();
        let mut changed = self.contacts.keep(&bodies, &mut state);
        let found = found.map(|(_, found)| found);
        match self.contacts.happen(&bodies, &mut state, found) {
            Ok(happened) => changed |= happened,
            Err(why) => {
                // The motion ends at the event, and not at the end of the whole step.
                let slope = self.solver.slope().clone();
                self.solver.rewind(reached, slope);
                return Err(why);
            }
        }
        let passes = state[0] > from + f64::EPSILON * from.abs();
        self.at_once = if passes { 0 } else { self.at_once + 1 };
        if self.at_once > AT_ONCE {
            return Err(Error::no_convergence(
                "contacts open, close, slip or stick again and again at one moment",
            ));
        }
        if changed {
            self.restart(state, self.solver.next_step())?;
        } else if state != *self.solver.state() {
            let slope = self.solver.slope().clone();
            self.solver.rewind(state, slope);
        }
        Ok(())
    }

    fn restart(&mut self, state: DVector<f64>, h: f64) -> Result<()> {
        let lost = || Error::no_convergence("accelerations or contact forces do not exist here");
        let slope = (self.bodies).slope(&state, &self.contacts.closed);
        self.solver.cost_mut().evaluations += 1;
        self.solver.restart(state, slope.ok_or_else(lost)?, h);
        Ok(())
    }

    /// The first event within a step, with the length of the step to it.
    fn find(
        &self,
        step: &mut Step<DVector<f64>>,
        f: impl Fn(&DVector<f64>) -> Option<DVector<f64>> + Copy,
        cost: &mut Cost,
    ) -> Option<(f64, Found)> {
        let bodies = self.bodies;
        let mut dense: Option<Dense<DVector<f64>>> = None;
        let ends = [&step.from, &step.to].map(|y| bodies.at(y));
        let bounds = bodies.bounds(step.stage_slopes());
        let length = step.h;
        let touch = (self.contacts).first_touch([&ends[0], &ends[1]], length, &bounds, |t| {
            if dense.is_none() {
                dense = step.dense(f, cost);
            }
            Some(bodies.at(&dense.as_ref()?.at(t / length)))
        });
        let mut first = touch.map(|(t, k)| (self.refine(step, f, cost, k, t), Found::Touch(k)));
        if !self.contacts.holds() {
            return first;
        }
        if dense.is_none() {
            dense = step.dense(f, cost);
        }
        let dense = dense.as_ref()?;
        let turn = self.contacts.first_turn(|x| {
            Some(match x {
                1.0 => bodies.loaded(&step.to).0,
                x => bodies.loaded(&dense.at(x)).0,
            })
        });
        if let Some((x, watch)) = turn
            && first.is_none_or(|(earlier, _)| x * length < earlier)
        {
            first = Some((x * length, Found::Turn(watch)));
        }
        first
    }

    /// The length of the step to the touch of a candidate, corrected by repetition of the step.
    fn refine(
        &self,
        step: &Step<DVector<f64>>,
        f: impl Fn(&DVector<f64>) -> Option<DVector<f64>> + Copy,
        cost: &mut Cost,
        candidate: usize,
        mut h: f64,
    ) -> f64 {
        for _ in 0..CORRECTIONS {
            let Some(redone) = step.redo(f, h, cost) else {
                return h;
            };
            let (touch, slip) = self.bodies.at(&redone.to).touch(candidate);
            let correction = -touch.gap / touch.normal.dot(&slip);
            let next = h + correction;
            if !(correction.abs() < 0.1 * h && next > 0.0 && next <= step.h) {
                return h;
            }
            h = next;
            if correction.abs() <= 4.0 * f64::EPSILON * (h + step.from[0].abs()) {
                return h;
            }
        }
        h
    }
}
