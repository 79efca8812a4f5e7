//! A body on a rod with friction that hits obstacles: an event of a contact ends the step, and the run goes on.
//!
//! Such a rod exchanges no impulse with the body. A jump of the body's velocity changes the rates of the strains, and
//! with them the force of the rod, by finite amounts. Contact forces act on the body within steps ([`BodyAtEnd`]).

use super::run::ViscousRun;
use super::sample::ViscousSample;
use crate::contact::{
    AccelerationBound, BodyAtEnd, ContactBooks, ContactDynamics, EndContacts, Found, Mark, Marks,
    Moment, Sums, nearest_place, way_of,
};
use crate::event::{Event, Outcome};
use crate::run::{AmongObstacles, RodBound, RodTouch};
use nalgebra::{DVector, Isometry3, Vector6};
use snaprod_systems::body::{EndBody, EndPose};
use snaprod_systems::error::{Error, Result};
use snaprod_systems::solve::integrator::Method;
use snaprod_systems::viscoelastic::kinematics::{AtEnd, Kinematics};
use snaprod_systems::viscoelastic::system::ViscousSystem;
use std::cell::{Cell, RefCell};

/// Obstacles about a rod with friction and the body on its end.
#[derive(Clone, Copy)]
pub struct AroundRod<'a> {
    /// The obstacles, and the body as obstacles see it, in the world.
    pub obstacles: AmongObstacles<'a>,
    /// The clamp in the world, which stands.
    pub clamp: Isometry3<f64>,
    /// Contact diameter of the rod, in lengths of the rod.
    pub diameter: f64,
}

/// The contacts of a run in progress.
pub(super) struct ViscousContacts<'a> {
    books: ContactBooks<'a>,
    around: AroundRod<'a>,
    /// Places of the rod at the end of the last step; none if the rod passes through obstacles.
    marks: Marks,
    /// True if the sums of losses and work have more than those of contacts.
    shared: bool,
}

/// Part of a step at whose start an event is one of the start.
const AT_START: f64 = 1e-12;
/// Most corrections of the length of a step that ends at a touch.
const CORRECTIONS: usize = 8;
/// Change of a state, as a part of the tolerance, below which closed contacts need no correction.
const KEEPS: f64 = 0.01;
/// Intervals of a rod in the search for its place nearest to an obstacle.
const INTERVALS: usize = 32;
/// Gap below which a rod touches: negative beyond rounding.
const TOUCHES: f64 = -1e-9;
/// Fractions of a step at which the rod is looked at.
const INSIDE: [f64; 4] = [0.2, 0.4, 0.6, 0.8];
/// Halvings of the part of a step after which the rod touches.
const HALVINGS: usize = 36;

/// A state with the losses of the last impacts.
struct StruckState {
    y: DVector<f64>,
    lost: f64,
    work: f64,
}

/// The equations of motion of the body on its rod.
struct RodEnd<'s, 'a, K: Kinematics<M, D>, B, const M: usize, const D: usize> {
    system: &'s ViscousSystem<K, BodyAtEnd<'a, B>, M, D>,
    contacts: &'s EndContacts<'a>,
    /// True for a state of an implicit step, which holds the wrench.
    reached: bool,
}

impl<'a, K, B, const M: usize, const D: usize> RodEnd<'_, 'a, K, B, M, D>
where
    K: Kinematics<M, D>,
    B: EndBody<D, Pose = K::Pose>,
{
    /// Place and velocity of the body, and the obstacles.
    fn at(&self, y: &DVector<f64>) -> Moment<'a> {
        let (system, rod) = (self.system, &self.system.rod);
        let shape = rod.kinematics.shape(&rod.grid, &system.strains(y));
        let pose = shape.map(|shape| rod.kinematics.pose(&shape).in_space());
        let pose = pose.unwrap_or_else(|| Isometry3::translation(f64::NAN, f64::NAN, f64::NAN));
        let t = y[system.layout().time()];
        self.contacts.moment(t, &pose, &system.velocity(y))
    }

    /// [`RodEnd::at`] with the acceleration without contact forces.
    fn loaded(&self, y: &DVector<f64>) -> Moment<'a> {
        let system = self.system;
        let found = if self.reached {
            system.reached(y)
        } else {
            system.at(y)
        };
        let Some((at, flow)) = found else {
            return self.at(y);
        };
        let (t, v) = (y[system.layout().time()], system.velocity(y));
        let pose = system.rod.kinematics.pose(&at.shape);
        let free = system.body.free.motion(t, &pose, &v, &-flow.wrench);
        let mut now = self.contacts.moment(t, &pose.in_space(), &v);
        now.accelerations[0] = self.contacts.outward(&free.acceleration);
        now
    }
}

impl<K, B, const M: usize, const D: usize> ContactDynamics for RodEnd<'_, '_, K, B, M, D>
where
    K: Kinematics<M, D>,
    B: EndBody<D, Pose = K::Pose>,
{
    type State = StruckState;

    fn time(&self, state: &StruckState) -> f64 {
        state.y[self.system.layout().time()]
    }

    fn places(&self, state: &StruckState) -> Moment<'_> {
        self.at(&state.y)
    }

    fn moment(&self, state: &StruckState) -> Moment<'_> {
        self.loaded(&state.y)
    }

    fn add_twists(&self, state: &mut StruckState, changes: &[Vector6<f64>]) {
        let mut v = state.y.fixed_rows_mut::<D>(self.system.layout().velocity());
        v += self.contacts.inward::<D>(&changes[0]);
    }

    fn shift(&self, state: &mut StruckState, changes: &[Vector6<f64>]) {
        let mut shifted = state.y.clone();
        let by = self.contacts.inward::<D>(&changes[0]);
        // A rod that cannot move by `by` keeps its state.
        if self.system.shift_end(&mut shifted, &by).is_some() {
            state.y = shifted;
        }
    }

    fn book_impact(&self, state: &mut StruckState, loss: f64, work: f64) {
        state.lost += loss;
        state.work += work;
    }
}

impl<'a, K, B, const M: usize, const D: usize> ViscousRun<'a, K, B, M, D>
where
    K: Kinematics<M, D>,
    B: EndBody<D, Pose = K::Pose>,
{
    /// The run among obstacles. `shared`: true if drag, loads in time or a section in time take part in the sums of
    /// losses and work.
    ///
    /// # Errors
    /// Another number of bodies than one; a start inside an obstacle; contact forces without a solution.
    pub fn among_obstacles(mut self, around: AroundRod<'a>, shared: bool) -> Result<Self> {
        let obstacles = around.obstacles;
        if obstacles.bodies.len() != 1 {
            return Err(Error::domain(
                "one body, that at the end of the rod, hits obstacles",
            ));
        }
        let mut contacts = ViscousContacts {
            books: ContactBooks::new(&obstacles),
            around,
            marks: Marks::new(),
            shared,
        };
        self.system.body.contacts = Some(EndContacts::new(obstacles.bodies, around.clamp));
        self.look_until();
        let mut state = self.unstruck();
        if let Some(bodies) = self.rod_end(false) {
            contacts.books.set.open(&bodies, &mut state)?;
        }
        if obstacles.rod_touches {
            let (marks, near) = self.look_at_rod(self.integrator.state(), &around)?;
            if let Some(touch) = near.filter(|near| near.gap <= TOUCHES) {
                return Err(touch.at_start("the rod", obstacles.bodies));
            }
            contacts.marks = marks;
        }
        self.go_on_from(&mut contacts, state)?;
        self.contacts = Some(contacts);
        self.see();
        self.first = self.current.clone();
        Ok(self)
    }

    fn rod_end(&self, reached: bool) -> Option<RodEnd<'_, 'a, K, B, M, D>> {
        Some(RodEnd {
            system: &self.system,
            contacts: self.system.body.contacts.as_ref()?,
            reached,
        })
    }

    /// The present state, without losses.
    fn unstruck(&self) -> StruckState {
        StruckState {
            y: self.integrator.state().clone(),
            lost: 0.0,
            work: 0.0,
        }
    }

    fn sums(&self, y: &DVector<f64>) -> Sums {
        let time = self.system.layout().time();
        Sums {
            drag: y[time + 3],
            work: y[time + 2],
        }
    }

    /// Sets the latest time at which obstacles are evaluated: just before the next break.
    pub(super) fn look_until(&mut self) {
        let next = self.system.next_break(self.time());
        if let Some(contacts) = &mut self.system.body.contacts {
            contacts.until = next.next_down();
        }
    }

    /// The time up to which the next step may lead: the end of the run, or of a sequence of bounces.
    pub(super) fn end_of_step(&self) -> f64 {
        let duration = self.options.duration;
        let contacts = self.contacts.as_ref();
        contacts.map_or(duration, |all| all.books.end_of_step(duration))
    }

    /// Continues from a state with the contacts as they are now.
    fn go_on_from(&mut self, contacts: &mut ViscousContacts<'a>, state: StruckState) -> Result<()> {
        let sums = self.sums(&state.y);
        contacts.books.book(state.lost, state.work, sums);
        if let Some(held) = &mut self.system.body.contacts {
            held.hold(&contacts.books.set.closed);
        }
        self.integrator
            .restart(&self.system, state.y, None)
            .ok_or_else(|| Error::no_convergence("no motion follows from an event of a contact"))
    }

    /// Lets what is due at the end of the last step happen, and returns the first event that is still to be reported.
    pub(super) fn contact_event(&mut self) -> Option<Result<Event>> {
        let mut contacts = self.contacts.take()?;
        let happened = self.happen(&mut contacts);
        let event = contacts.books.next_event();
        let spent = contacts.books.are_spent();
        self.contacts = Some(contacts);
        match happened {
            Err(why) => return Some(Err(why)),
            Ok(true) => self.see(),
            Ok(false) => {}
        }
        match event {
            Some(event) => Some(Ok(Event::Contact(event))),
            None => spent.then(|| Ok(self.stop(Outcome::ImpactLimit))),
        }
    }

    /// True if the state has changed.
    fn happen(&mut self, contacts: &mut ViscousContacts<'a>) -> Result<bool> {
        if contacts.books.due.is_none() {
            return Ok(false);
        }
        let before = self.unstruck();
        let mut state = self.unstruck();
        let Some(bodies) = self.rod_end(false) else {
            return Ok(false);
        };
        let mut changed = false;
        if contacts.books.set.holds() && contacts.books.set.keep(&bodies, &mut state) {
            // Each correction starts the integration anew: corrections far below its error are left out.
            changed = !((&state.y - &before.y).amax() <= KEEPS * self.options.local_tolerance());
            if !changed {
                state = before;
            }
        }
        changed |= contacts.books.happen(&bodies, &mut state)?;
        if changed {
            self.go_on_from(contacts, state)?;
        } else if let Some(held) = &mut self.system.body.contacts {
            held.hold(&contacts.books.set.closed);
        }
        Ok(changed)
    }

    /// Lets closed contacts stay closed, or open, under loads that have changed.
    pub(super) fn settle_contacts(&mut self) -> Result<()> {
        let Some(mut contacts) = self.contacts.take() else {
            return Ok(());
        };
        let mut state = self.unstruck();
        let settled = match self.rod_end(false) {
            Some(bodies) => contacts.books.set.settle(&bodies, &mut state, &[]),
            None => Ok(()),
        };
        contacts.books.due = None;
        let going = settled.and_then(|()| self.go_on_from(&mut contacts, state));
        self.contacts = Some(contacts);
        going
    }

    /// Looks for contact in the step just taken, and ends the step at the first event. `before` is the acceleration of
    /// the end at the start of the step.
    ///
    /// # Errors
    /// An event that the steps do not reach.
    pub(super) fn look_for_contact(&mut self, before: &AtEnd<D>) -> Result<()> {
        let Some(mut contacts) = self.contacts.take() else {
            return Ok(());
        };
        let looked = self.look(&mut contacts, before);
        self.contacts = Some(contacts);
        looked
    }

    fn look(&mut self, contacts: &mut ViscousContacts<'a>, before: &AtEnd<D>) -> Result<()> {
        let lost = || Error::no_convergence("an event of a contact was lost");
        if let Some((part, found)) = self.first_event(contacts, before)? {
            let ends_there = self.end_step(part, Some(found)).ok_or_else(lost)?;
            contacts.books.due = ends_there.then_some(Some(found));
        }
        if contacts.around.obstacles.rod_touches
            && let Some((part, touch)) = self.rod_touch(contacts)?
            && self.end_step(part, None).ok_or_else(lost)?
        {
            contacts.books.due = None;
            self.found = Some(Event::Stop(Outcome::RodTouch(touch)));
        }
        if contacts.books.set.holds() && contacts.shared {
            self.divide_sums(contacts);
        }
        // Contacts without a force may close anew.
        if !contacts.books.set.closed.is_empty() && self.found.is_none() {
            contacts.books.due.get_or_insert(None);
        }
        Ok(())
    }

    /// The acceleration of the end at the present state.
    pub(super) fn acceleration(&self) -> AtEnd<D> {
        let at = self.system.layout().velocity();
        self.integrator.slope().fixed_rows::<D>(at).into_owned()
    }

    /// The first event of a contact in a step, with the fraction of the step at which the event happens.
    ///
    /// # Errors
    /// A state within the step that is not found.
    fn first_event(
        &mut self,
        contacts: &ViscousContacts<'a>,
        before: &AtEnd<D>,
    ) -> Result<Option<(f64, Found)>> {
        let after = self.acceleration();
        let system = &self.system;
        let Some(end) = &system.body.contacts else {
            return Ok(None);
        };
        let bodies = RodEnd {
            system,
            contacts: end,
            reached: self.integrator.method_now() == Method::Implicit,
        };
        let [from, to] = [self.integrator.from(), self.integrator.state()].map(Clone::clone);
        let time = system.layout().time();
        let length = to[time] - from[time];
        // The mean stands for accelerations between the ends.
        let mean = (system.velocity(&to) - system.velocity(&from)) / length;
        let bound = [before, &after, &mean]
            .map(|a| AccelerationBound::of(&bodies.contacts.outward(a)))
            .into_iter()
            .fold(AccelerationBound::default(), AccelerationBound::max);
        let ends = [bodies.at(&from), bodies.at(&to)];
        let set = &contacts.books.set;
        let (integrator, lost) = (RefCell::new(&mut self.integrator), Cell::new(false));
        let inside = |x: f64| {
            let y = integrator.borrow_mut().at(system, x);
            lost.set(lost.get() || y.is_none());
            y
        };
        let touch = set.first_touch([&ends[0], &ends[1]], length, &[bound], |t| {
            Some(bodies.at(&inside(t / length)?))
        });
        let touch = touch.map(|(t, k)| (t / length, Found::Touch(k)));
        let turn = set.first_turn(|x| Some(bodies.loaded(&inside(x)?)));
        let turn = turn.map(|(x, watch)| (x, Found::Turn(watch)));
        if lost.get() {
            return Err(no_inside());
        }
        let events = touch.into_iter().chain(turn);
        Ok(events.min_by(|a, b| a.0.total_cmp(&b.0)))
    }

    /// Takes the last step again, to end at the fraction `part` of its length. A touch is found to rounding. False if
    /// the integration takes a step that does not reach so far. None if the step fails.
    fn end_step(&mut self, part: f64, found: Option<Found>) -> Option<bool> {
        let from = self.integrator.from().clone();
        let (next, span) = (self.integrator.next_step(), self.integrator.span());
        if part <= AT_START {
            self.integrator.restart(&self.system, from, Some(next))?;
            return Some(true);
        }
        let mut h = part * span;
        for _ in 0..CORRECTIONS {
            self.integrator
                .restart(&self.system, from.clone(), Some(h))?;
            self.integrator.step(&self.system, h).ok()?;
            if self.integrator.span() < (1.0 - AT_START) * h {
                return Some(false);
            }
            let Some(Found::Touch(k)) = found else {
                break;
            };
            let (touch, slip) = self.rod_end(true)?.at(self.integrator.state()).touch(k);
            let correction = -touch.gap / touch.normal.dot(&slip);
            let reached = correction.abs() <= 4.0 * f64::EPSILON * h;
            if reached || !(0.0 < h + correction && h + correction <= span) {
                break;
            }
            h += correction;
        }
        Some(true)
    }

    /// Tells friction from drag, and the work of obstacles from that of loads, in the step just taken.
    fn divide_sums(&mut self, contacts: &mut ViscousContacts<'a>) {
        let ends = [self.integrator.from(), self.integrator.state()].map(|y| self.sums(y));
        let system = &self.system;
        let Some(end) = system.body.contacts.as_ref() else {
            return;
        };
        let bodies = RodEnd {
            system,
            contacts: end,
            reached: self.integrator.method_now() == Method::Implicit,
        };
        let (span, integrator) = (self.integrator.span(), &mut self.integrator);
        contacts.books.divide(ends, span, |x| {
            Some(bodies.loaded(&integrator.at(system, x)?))
        });
    }

    /// Places of the rod in a state, and the one that is nearest to an obstacle.
    fn look_at_rod(
        &self,
        y: &DVector<f64>,
        around: &AroundRod<'a>,
    ) -> Result<(Marks, Option<RodTouch>)> {
        let lost = || Error::no_convergence("the rod has no shape among the obstacles");
        let (system, rod) = (&self.system, &self.system.rod);
        let end = system.body.contacts.as_ref().ok_or_else(lost)?;
        let strains = system.strains(y);
        let shape = rod.kinematics.shape(&rod.grid, &strains).ok_or_else(lost)?;
        let places: Vec<f64> = (0..=INTERVALS)
            .map(|i| i as f64 / INTERVALS as f64)
            .collect();
        let axis = rod.kinematics.axis(&rod.grid, &shape, &strains, &places);
        let marks = places.iter().zip(axis).map(|(s, [x, along])| Mark {
            s: *s,
            x: end.place(&x),
            along: end.direction(&along),
        });
        let marks: Marks = marks.collect();
        let t = y[system.layout().time()].min(end.until);
        let gaps = around.obstacles.bodies.gaps_of_rod(0, t);
        // Other things hold the rod at its ends.
        let found = nearest_place(&marks, gaps, [around.diameter, 1.0 - around.diameter]);
        let touch = found.map(|near| RodTouch {
            bound: RodBound::Touch,
            rod: 0,
            obstacle: near.obstacle,
            s: near.s,
            gap: near.gap - 0.5 * around.diameter,
        });
        Ok((marks, touch))
    }

    /// The first touch of the rod in the last step, with the fraction of the step.
    fn rod_touch(&mut self, contacts: &mut ViscousContacts<'a>) -> Result<Option<(f64, RodTouch)>> {
        let around = contacts.around;
        let (marks, near) = self.look_at_rod(self.integrator.state(), &around)?;
        let way = way_of(&contacts.marks, &marks);
        contacts.marks = marks;
        let touches = |near: &RodTouch| near.gap <= TOUCHES;
        let mut found = near.filter(touches).map(|touch| (1.0, touch));
        if found.is_none() && near.is_none_or(|near| near.gap > way) {
            return Ok(None);
        }
        let mut look = |part: f64| -> Result<Option<RodTouch>> {
            let y = self.integrator.at(&self.system, part);
            let y = y.ok_or_else(no_inside)?;
            Ok(self.look_at_rod(&y, &around)?.1.filter(touches))
        };
        let mut free = 0.0;
        for part in INSIDE {
            match look(part)? {
                Some(touch) => {
                    found = Some((part, touch));
                    break;
                }
                None => free = part,
            }
        }
        let Some((mut part, mut touch)) = found else {
            return Ok(None);
        };
        for _ in 0..HALVINGS {
            let middle = 0.5 * (free + part);
            match look(middle)? {
                Some(there) => (part, touch) = (middle, there),
                None => free = middle,
            }
        }
        Ok(Some((part, touch)))
    }

    /// Adds the contacts, and the energies that contacts have taken and given, to the sample of a state.
    pub(super) fn with_contacts(
        &self,
        mut sample: ViscousSample<K, M, D>,
        y: &DVector<f64>,
    ) -> ViscousSample<K, M, D> {
        let (Some(contacts), Some(end)) = (&self.contacts, &self.system.body.contacts) else {
            return sample;
        };
        let (body, v) = (self.system.body.free, &sample.velocity);
        let free = body.motion(sample.t, &sample.pose, v, &-sample.flow.wrench);
        let mut now = end.moment(sample.t, &sample.pose.in_space(), v);
        now.accelerations[0] = end.outward(&free.acceleration);
        sample.contact = Some(contacts.books.sample(now, self.sums(y)));
        sample.ledger.dissipated += contacts.books.lost;
        sample.ledger.work += contacts.books.struck;
        sample
    }
}

fn no_inside() -> Error {
    Error::no_convergence("a state within a step among obstacles was not found")
}
