//! A motion of bodies with contact from event to event.

use super::bodies::{
    Bodies, ContactId, DRAG, FRICTION, IMPACTS, OBSTACLES, PER_BODY, SUMS, WORK, place_of,
    write_motion,
};
use super::body_ledger::BodyLedger;
use super::body_options::BodyOptions;
use super::contact_event::ContactEvent;
use super::contact_forces::{AccelerationBound, Closed, Grip, Moment};
use super::first_touch::{DEPTH, GapAt, first_touch};
use super::rest::{STILL, Watch};
use crate::event::{Event, Outcome};
use nalgebra::{DVector, Vector3};
use snaprod_systems::contact::RigidMotion;
use snaprod_systems::error::{Cause, Error, Result};
use snaprod_systems::solve::cost::Cost;
use snaprod_systems::solve::dop853::{Dense, Dop853, Step};
use snaprod_systems::solve::roots::chandrupatla;
use std::collections::VecDeque;

/// A contact that carries a force at one moment.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct ContactNow {
    /// The contact.
    pub contact: ContactId,
    /// The place in the world.
    pub point: Vector3<f64>,
    /// Unit normal, from the partner to the body.
    pub normal: Vector3<f64>,
    /// Normal force on the body.
    pub normal_force: f64,
    /// Friction on the body, in the world.
    pub friction: Vector3<f64>,
    /// True if the surfaces stick.
    pub sticks: bool,
}

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

/// The end of a sequence of impacts that is still to be reported.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) struct Pending {
    pub candidate: usize,
    pub t: f64,
}

/// The last step with its closed contacts.
struct LastStep {
    step: Step<DVector<f64>>,
    closed: Vec<Closed>,
    until: f64,
}

/// The cause of an event within a step.
#[derive(Debug, Clone, Copy)]
enum Found {
    Touch(usize),
    Turn(Watch),
}

/// Overlap at the start that is refused.
const OVERLAP: f64 = 1e-9;
/// Safety factor of the bound on accelerations of gaps.
const FALL: f64 = 2.0;
/// Places within a step at which watched quantities are looked at.
const LOOKS: usize = 8;
/// Relative depth below zero at which a watched quantity has fallen through zero.
const BELOW: f64 = 1e-13;
/// Part of a step after which an event at the start of the step is taken.
const AT_START: f64 = 1e-15;
/// Most events in a row between which no time passes.
const AT_ONCE: u32 = 100;
/// Most corrections of the time of an event.
const CORRECTIONS: usize = 6;

/// A motion of bodies with contact in progress.
pub struct BodyMotion<'a> {
    pub(super) system: &'a Bodies,
    pub(super) options: BodyOptions,
    pub(super) closed: Vec<Closed>,
    /// The latest time at which loads are evaluated: just before the next break of a load.
    pub(super) until: f64,
    pub(super) impacts: u64,
    pub(super) pending: Vec<Pending>,
    solver: Dop853<DVector<f64>>,
    last: Option<LastStep>,
    events: VecDeque<Event>,
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
        system.check()?;
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
        let solver = Dop853::new(y.clone(), y.clone(), 1.0, options.tolerance);
        let mut motion = Self {
            system,
            options,
            closed: Vec::new(),
            until,
            impacts: 0,
            pending: Vec::new(),
            solver,
            last: None,
            events: VecDeque::new(),
            at_once: 0,
            stopped: false,
            interrupted: false,
        };
        motion.open(&mut y)?;
        let slope = motion.slope(&y).ok_or_else(|| {
            Error::domain(
                "the accelerations at the start are not finite, or no contact forces exist",
            )
        })?;
        let h = 1e-2 * options.duration;
        motion.solver = Dop853::new(y, slope, h, options.tolerance);
        Ok(motion)
    }

    /// The start: refuses overlaps, and lets contacts that are closed hit or settle.
    fn open(&mut self, y: &mut DVector<f64>) -> Result<()> {
        let now = Moment::without_loads(self.system, y, self.until);
        let mut settles = Vec::new();
        let mut hits = Vec::new();
        for (k, candidate) in self.system.candidates.iter().enumerate() {
            let (touch, slip) = now.touch(k);
            if !(touch.gap >= -OVERLAP) {
                return Err(Error::domain(format!(
                    "body {} starts inside {:?} by {:.3e}, at {:.6}, {:.6}, {:.6}; move it outwards",
                    candidate.id.body,
                    candidate.id.partner,
                    -touch.gap,
                    touch.point.x,
                    touch.point.y,
                    touch.point.z
                )));
            }
            let rate = touch.normal.dot(&slip);
            if touch.gap > OVERLAP || rate > STILL * self.options.resting_speed {
                continue;
            }
            if rate < -STILL * self.options.resting_speed {
                hits.push(k);
            } else if let Some(spread) = touch.spread {
                return Err(Error::domain(format!(
                    "{spread} at the start: such a contact has no single point"
                )));
            } else {
                settles.push((k, 0.0));
            }
        }
        self.settle(y, &settles)?;
        self.hit_all(y, &hits)
    }

    /// Lets candidates hit one after the other, as far as the surfaces still approach.
    fn hit_all(&mut self, y: &mut DVector<f64>, hits: &[usize]) -> Result<()> {
        for &k in hits {
            let (touch, slip) = Moment::without_loads(self.system, y, self.until).touch(k);
            if touch.normal.dot(&slip) < 0.0 {
                let may_close = self.impact(y, k)?;
                self.settle(y, &may_close)?;
            }
        }
        Ok(())
    }

    fn slope(&self, y: &DVector<f64>) -> Option<DVector<f64>> {
        Moment::new(self.system, y, self.until).slope(y, &self.closed)
    }

    pub(super) fn report(&mut self, event: ContactEvent) {
        self.events.push_back(Event::Contact(event));
    }

    /// Time now.
    pub fn time(&self) -> f64 {
        self.solver.state()[0]
    }

    /// The state now.
    pub fn now(&self) -> BodiesSample {
        self.describe(self.solver.state(), &self.closed, self.until)
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
        let (system, closed, until) = (self.system, &last.closed, last.until);
        let f = |y: &DVector<f64>| Moment::new(system, y, until).slope(y, closed);
        let mut cost = Cost::default();
        let y = if h == 0.0 {
            last.step.from.clone()
        } else {
            last.step.redo(f, h, &mut cost)?.to
        };
        Some(self.describe(&y, closed, until))
    }

    /// End of time.
    pub fn duration(&self) -> f64 {
        self.options.duration
    }

    /// Impacts so far.
    pub fn impacts(&self) -> u64 {
        self.impacts
    }

    /// Cost so far.
    pub fn cost(&self) -> Cost {
        self.solver.cost()
    }

    /// Ends the motion at its next step, with [`Outcome::Interrupted`].
    pub fn interrupt(&mut self) {
        self.interrupted = true;
    }

    fn describe(&self, y: &DVector<f64>, closed: &[Closed], until: f64) -> BodiesSample {
        let mut now = Moment::new(self.system, y, until);
        let [kinetic, potential] = now.energies(y[0]);
        let gaps = (0..self.system.candidates.len()).map(|k| now.touch(k).0.gap);
        let least_gap = gaps.fold(f64::INFINITY, f64::min);
        let held = closed.iter().filter(|closed| closed.grip != Grip::Idle);
        let mut contacts = Vec::new();
        if let Some((rows, solution)) = now.forces(closed) {
            for (i, (row, closed)) in rows.iter().zip(held).enumerate() {
                let force: Vector3<f64> = solution.forces.fixed_rows::<3>(3 * i).into_owned();
                contacts.push(ContactNow {
                    contact: self.system.candidates[row.candidate].id,
                    point: row.touch.point,
                    normal: row.touch.normal,
                    normal_force: force.x,
                    friction: row.axes * Vector3::new(0.0, force.y, force.z),
                    sticks: closed.grip == Grip::Stick,
                });
            }
        }
        BodiesSample {
            t: y[0],
            motions: now.motions,
            contacts,
            least_gap,
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
        if let Some(event) = self.events.pop_front() {
            return Some(event);
        }
        let from = self.time();
        if self.interrupted {
            return Some(self.stop(Outcome::Interrupted));
        }
        if from >= self.options.duration {
            return Some(self.stop(Outcome::EndOfTime));
        }
        if self.impacts >= self.options.max_impacts {
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
        let until = self.system.next_break(from);
        if until.next_down() != self.until {
            self.until = until.next_down();
            self.restart(self.solver.state().clone(), self.solver.next_step())?;
        }
        let ends = self.pending.iter().map(|pending| pending.t);
        let end = ends.fold(until.min(self.options.duration), f64::min);
        let (system, closed, until) = (self.system, self.closed.clone(), self.until);
        let f = |y: &DVector<f64>| Moment::new(system, y, until).slope(y, &closed);
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
                until,
            });
        }
        let mut changed = self.keep(&mut state);
        let over: Vec<Pending> = (self.pending.iter().copied())
            .filter(|pending| pending.t <= state[0])
            .collect();
        self.pending.retain(|pending| pending.t > state[0]);
        for pending in over {
            let change = self.change(&state, pending.candidate, &self.closed);
            self.report(ContactEvent::Accumulation(change));
        }
        match found {
            Some((_, Found::Touch(k))) => {
                let may_close = self.impact(&mut state, k)?;
                self.settle(&mut state, &may_close)?;
            }
            Some((_, Found::Turn(watch))) => self.turn(&mut state, watch)?,
            None => {}
        }
        changed |= found.is_some() | self.look_at_idle(&mut state)?;
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
        let slope = self.slope(&state).ok_or_else(lost)?;
        self.solver.cost_mut().evaluations += 1;
        self.solver.restart(state, slope, h);
        Ok(())
    }

    /// Contacts that carried no force may have opened, or close anew. Returns true if one did.
    fn look_at_idle(&mut self, y: &mut DVector<f64>) -> Result<bool> {
        let (mut opened, mut hits) = (Vec::new(), Vec::new());
        let now = Moment::without_loads(self.system, y, self.until);
        for closed in self.closed.iter().filter(|c| c.grip == Grip::Idle) {
            let (touch, slip) = now.touch(closed.candidate);
            let rate = touch.normal.dot(&slip);
            if rate > self.options.resting_speed || touch.gap > OVERLAP {
                opened.push(closed.candidate);
            } else if rate < -self.options.resting_speed {
                hits.push(closed.candidate);
            }
        }
        self.closed.retain(|c| !opened.contains(&c.candidate));
        self.hit_all(y, &hits)?;
        Ok(!opened.is_empty() || !hits.is_empty())
    }

    /// The first event within a step, with the length of the step to it.
    fn find(
        &self,
        step: &mut Step<DVector<f64>>,
        f: impl Fn(&DVector<f64>) -> Option<DVector<f64>> + Copy,
        cost: &mut Cost,
    ) -> Option<(f64, Found)> {
        let mut dense: Option<Dense<DVector<f64>>> = None;
        let mut first: Option<(f64, Found)> = None;
        let ends =
            [&step.from, &step.to].map(|y| Moment::without_loads(self.system, y, self.until));
        let bounds = AccelerationBound::over(step.stage_slopes(), self.system.len());
        for k in 0..self.system.candidates.len() {
            if self.closed.iter().any(|closed| closed.candidate == k) {
                continue;
            }
            let at = |moment: &Moment<'_>, t: f64| {
                let (touch, slip) = moment.touch(k);
                GapAt {
                    t,
                    gap: touch.gap,
                    rate: touch.normal.dot(&slip),
                }
            };
            let [from, to] = [at(&ends[0], 0.0), at(&ends[1], step.h)];
            let falls = ends.iter().map(|end| end.largest_fall(k, &bounds));
            let fall = FALL * falls.fold(0.0, f64::max);
            let length = step.h;
            let mut inside = |t: f64| {
                if dense.is_none() {
                    dense = step.dense(f, cost);
                }
                let y = dense.as_ref()?.at(t / length);
                let moment = Moment::without_loads(self.system, &y, self.until);
                Some(at(&moment, t))
            };
            let Some(touch) = first_touch(from, to, fall, &mut inside) else {
                continue;
            };
            // Newton from behind, on the interpolant.
            let mut t = touch.t;
            let mut here = Some(touch);
            while let Some(now) = here.filter(|now| now.gap < 0.0) {
                let next = t - now.gap / now.rate;
                if !(next > 0.0) {
                    // Surfaces that touch at the start.
                    t = AT_START * length;
                    break;
                }
                if next >= t {
                    break;
                }
                t = next;
                here = inside(t);
            }
            if first.is_none_or(|(h, _)| t < h) {
                first = Some((self.refine(step, f, cost, k, t), Found::Touch(k)));
            }
        }
        if self.closed.iter().any(|closed| closed.grip != Grip::Idle)
            && let Some((h, watch)) = self.first_turn(step, &mut dense, f, cost)
            && first.is_none_or(|(earlier, _)| h < earlier)
        {
            first = Some((h, Found::Turn(watch)));
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
            let moment = Moment::without_loads(self.system, &redone.to, self.until);
            let (touch, slip) = moment.touch(candidate);
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

    /// The first fall of a watched quantity below zero.
    fn first_turn(
        &self,
        step: &mut Step<DVector<f64>>,
        dense: &mut Option<Dense<DVector<f64>>>,
        f: impl Fn(&DVector<f64>) -> Option<DVector<f64>> + Copy,
        cost: &mut Cost,
    ) -> Option<(f64, Watch)> {
        if dense.is_none() {
            *dense = step.dense(f, cost);
        }
        let dense = dense.as_ref()?;
        let values = |x: f64| {
            let y = if x == 1.0 {
                step.to.clone()
            } else {
                dense.at(x)
            };
            Moment::new(self.system, &y, self.until).watch(&self.closed)
        };
        let mut before = values(0.0)?;
        for look in 1..=LOOKS {
            let (x0, x1) = ((look - 1) as f64 / LOOKS as f64, look as f64 / LOOKS as f64);
            let after = values(x1)?;
            let size = after.iter().fold(1.0_f64, |most, (_, v)| most.max(v.abs()));
            let mut earliest: Option<(f64, Watch)> = None;
            for (i, (watch, value)) in after.iter().enumerate() {
                if *value >= -BELOW * size {
                    continue;
                }
                let at = |x: f64| values(x).map_or(f64::NAN, |values| values[i].1);
                let start = before[i].1;
                let x = if start > 0.0 {
                    chandrupatla(at, (x0, start), (x1, *value), 1e-14).unwrap_or(x1)
                } else {
                    x0
                };
                if earliest.is_none_or(|(other, _)| x < other) {
                    earliest = Some((x, *watch));
                }
            }
            if let Some((x, watch)) = earliest {
                return Some((x.max(AT_START) * step.h, watch));
            }
            before = after;
        }
        None
    }
}

/// Depth of the touches that are looked for; a deeper overlap is an impact.
const _: () = assert!(DEPTH < OVERLAP);
