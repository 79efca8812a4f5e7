//! Runs among obstacles: an event of a contact ends the step, an impact changes the velocity, and the run goes on.

use super::{Event, OnSheet, Outcome, Phase, Progress, Run};
use crate::contact::{AccelerationBound, Bodies, ContactBooks, ContactSample, Found, Sums};
use crate::locate::first_change;
use crate::options::Options;
use crate::sheet::{HeldContacts, LastStep, SheetBody, Struck};
use snaprod_systems::body::PointMass;
use snaprod_systems::error::{Error, Message, Quantity, Result};
use snaprod_systems::manifold::Multivalued;
use snaprod_systems::rod::contact::Bound;
use snaprod_systems::solve::cost::Cost;

/// Obstacles of a run, with the bounds of its impacts.
#[derive(Clone, Copy)]
pub struct AmongObstacles<'a> {
    /// The body at the end of the rod, with its mass and its shape but without loads, and the obstacles.
    pub bodies: &'a Bodies,
    /// Normal speed after an impact below which bounces are summed up.
    pub resting_speed: f64,
    /// Most impacts.
    pub max_impacts: u64,
    /// True if the run ends where the rod itself touches an obstacle; false if the rod passes through.
    pub rod_touches: bool,
}

/// A bound of the equilibria of a rod among obstacles, at which their force on the body has a kink or ends.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum RodBound {
    /// The rod comes to touch an obstacle.
    Touch,
    /// A touch would have to pull: the rod leaves the obstacle.
    Release,
    /// The rod begins to lie along the obstacle.
    Line,
    /// A touch slides to an end of the rod.
    End,
    /// The rod comes to touch an obstacle where equilibria with the touch lie before the touch: a corner fold.
    Corner,
    /// A snap would lead through the obstacle, or end inside.
    Landing,
}

impl RodBound {
    /// A stable key of the event that ends a run: rod_touch, rod_release, rod_line, rod_end, rod_corner, rod_landing.
    pub fn key(self) -> &'static str {
        match self {
            Self::Touch => "rod_touch",
            Self::Release => "rod_release",
            Self::Line => "rod_line",
            Self::End => "rod_end",
            Self::Corner => "rod_corner",
            Self::Landing => "rod_landing",
        }
    }

    /// A verb for the rod and the obstacle at the bound.
    pub fn verb(self) -> &'static str {
        match self {
            Self::Touch | Self::Corner => "touches",
            Self::Release => "leaves",
            Self::Line => "begins to lie along",
            Self::End => "slides off",
            Self::Landing => "would snap into",
        }
    }

    /// Why a run ends at the bound, and what to do.
    pub fn why(self) -> &'static str {
        match self {
            Self::Touch => {
                "in motion planar elastic rods alone touch obstacles: fixed ones, without friction and without sharp edges, at four places at \
                 most; write rods = \"none\" in [contact] to let rods pass through obstacles"
            }
            Self::Release => {
                "the equilibrium without this touch was not found; change the start or the obstacles a little"
            }
            Self::Line => {
                "in motion a rod touches obstacles at points; a smaller thrust, or a rounder obstacle, keeps the touch a point"
            }
            Self::End => {
                "a touch that comes to an end of the rod is not followed; move the obstacle, or make the rod longer"
            }
            Self::Corner => {
                "there the rod has no equilibrium to go on (a corner fold), and snaps against obstacles are not followed; move the obstacle"
            }
            Self::Landing => {
                "snaps onto obstacles are not followed; move the obstacle, or write rods = \"none\" in [contact] to let rods pass through"
            }
        }
    }
}

impl From<Bound> for RodBound {
    fn from(bound: Bound) -> Self {
        match bound {
            Bound::Touch => Self::Touch,
            Bound::Release => Self::Release,
            Bound::Line => Self::Line,
            Bound::End => Self::End,
        }
    }
}

/// A place of a rod that is near an obstacle, or touches one.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct RodTouch {
    /// The bound that the place is near.
    pub bound: RodBound,
    /// The rod, by its number in an assembly.
    pub rod: usize,
    /// The obstacle.
    pub obstacle: usize,
    /// The arc length, in units of the length of the motion.
    pub s: f64,
    /// The room up to the bound, in these units: a distance, a reaction or a curvature.
    pub gap: f64,
}

impl RodTouch {
    /// True if the rod touches the obstacle.
    pub(crate) fn is_one(&self) -> bool {
        self.gap <= TOUCHES
    }

    /// The refusal of a start in which `rod` lies inside an obstacle.
    pub(crate) fn at_start(&self, rod: &str, bodies: &Bodies) -> Error {
        let told = Message::from(format!("{rod} starts "))
            .size(-self.gap, Quantity::Length)
            .words(format!(" inside {}, deepest at s = ", bodies.obstacle_name(self.obstacle)))
            .number(self.s, Quantity::Length)
            .words("; move the obstacle or the start, or write rods = \"none\" in [contact] to let rods pass through obstacles");
        Error::domain(told)
    }
}

/// The least room of the rod among the obstacles at a state. A lower bound by its reach is cheap.
pub(super) type RodGap<'a, const N: usize> = Box<dyn Fn(&Phase<N>, GapBy) -> RodTouch + 'a>;

/// The way in which the room of the rod is found.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) enum GapBy {
    /// A lower bound by the reach of the rod.
    Reach,
    /// The shape of the rod, for all bounds.
    Shape,
    /// The shape of the rod, for one bound with the obstacle of this number.
    Bound(RodBound, usize),
}

impl GapBy {
    /// True if a bound with an obstacle is looked at.
    pub(super) fn looks_at(self, bound: RodBound, obstacle: usize) -> bool {
        match self {
            Self::Reach | Self::Shape => true,
            Self::Bound(one, other) => one == bound && other == obstacle,
        }
    }
}

/// Room at which a bound is passed: negative beyond rounding.
pub(super) const TOUCHES: f64 = -1e-9;
/// Part of a step over which the rate of a room is taken.
const BESIDE: f64 = 1e-4;
/// Samples of a step in the search for touches of the rod.
const PLACES: u32 = 8;
/// Part of a step at whose start an event is one of the start.
const AT_START: f64 = 1e-12;

/// The contacts of a run in progress.
pub(super) struct RunContacts<'a, const N: usize> {
    books: ContactBooks<'a>,
    rod: Option<RodGap<'a, N>>,
    clearance: Clearance,
}

/// Contacts, sums and cost, handed from a run to the run on the next sheet.
pub(super) struct HandedOver<'a, const N: usize> {
    contacts: Option<RunContacts<'a, N>>,
    snapped: f64,
    snaps: u64,
    past: Cost,
}

/// Distances from obstacles when they were last looked at, and the way of the body since: most steps need no more.
#[derive(Debug, Clone, Copy, Default)]
struct Clearance {
    body: f64,
    rod: f64,
    travelled: f64,
}

impl Clearance {
    /// Distance that an end of a rod within reach must have for a way of this length. The ellipse of the places that a
    /// rod reaches widens with the root of what its chord gets shorter by.
    fn of_rod(way: f64) -> f64 {
        way + (0.5 * way).sqrt()
    }

    /// True if nothing can have been reached.
    fn is_left(&self) -> bool {
        self.travelled < self.body && Self::of_rod(self.travelled) < self.rod
    }
}

impl<'a, M: Multivalued<N>, const N: usize> Run<'a, M, N> {
    /// The run among obstacles. The clamp must stand. `rod`: distance of the rod from the obstacles; None if the rod
    /// is not looked for.
    ///
    /// # Errors
    /// A start inside an obstacle; contact forces without a solution; a rod with mass.
    pub(super) fn among(
        mut self,
        obstacles: AmongObstacles<'a>,
        rod: Option<RodGap<'a, N>>,
    ) -> Result<Self> {
        if self.body.rod().is_some() {
            return Err(Error::domain(
                "contact is not followed together with the mass of the rod: inertia = \"none\" leaves it out",
            ));
        }
        let mut contacts = RunContacts {
            books: ContactBooks::new(&obstacles),
            rod,
            clearance: Clearance::default(),
        };
        let phase = self.motion.phase();
        if self.early.is_some() {
            let moved = (self.given().pose - self.now().pose).norm();
            let gap = self.struck_body(&contacts).at(&phase).least_gap();
            if !(gap > 2.0 * moved) {
                return Err(Error::domain(format!(
                    "a start from the straight rod needs room: its first step moves the body by {moved:.3e} lengths of the rod, and an obstacle is \
                     {gap:.3e} away; move the obstacle, or start the rod a little bent"
                )));
            }
        }
        let mut state = Struck {
            phase,
            lost: 0.0,
            work: 0.0,
        };
        contacts
            .books
            .set
            .open(&self.struck_body(&contacts), &mut state)?;
        let start = contacts.rod.as_ref().map(|rod| rod(&phase, GapBy::Shape));
        if let Some(touch) = start.filter(RodTouch::is_one) {
            return Err(touch.at_start("the rod", obstacles.bodies));
        }
        self.contacts = Some(contacts);
        self.go_on_from(state)?;
        Ok(self)
    }

    /// Gives contacts, sums and cost to the run on the next sheet.
    pub(super) fn hand_over(&mut self) -> HandedOver<'a, N> {
        HandedOver {
            contacts: self.contacts.take(),
            snapped: self.snapped,
            snaps: self.snaps,
            past: self.cost(),
        }
    }

    /// A run on another sheet from a state of an earlier run. `rod`: the room of the rod on this sheet.
    ///
    /// # Errors
    /// A state outside the chart.
    pub(super) fn taken_over(
        manifold: &'a M,
        body: &'a PointMass<N>,
        phase: Phase<N>,
        options: Options,
        from: HandedOver<'a, N>,
        rod: RodGap<'a, N>,
    ) -> Result<Self> {
        let HandedOver {
            contacts,
            snapped,
            snaps,
            past,
        } = from;
        let mut run = Self::start(manifold, body, phase, options, snapped, snaps)?;
        run.contacts = contacts.map(|contacts| RunContacts {
            rod: Some(rod),
            clearance: Clearance::default(),
            ..contacts
        });
        run.go_on_from(Struck {
            phase,
            lost: 0.0,
            work: 0.0,
        })?;
        run.past = past;
        Ok(run)
    }

    fn struck_body(&self, contacts: &RunContacts<'a, N>) -> SheetBody<'a, 'a, M, N> {
        SheetBody {
            manifold: self.manifold,
            body: self.body,
            system: contacts.books.set.system,
            until: self.motion.until(),
        }
    }

    /// Continues on the sheet from a state with the contacts as they are now.
    fn go_on_from(&mut self, state: Struck<N>) -> Result<()> {
        let Some(contacts) = &mut self.contacts else {
            return Ok(());
        };
        let sums = sums_of(&state.phase);
        contacts.books.book(state.lost, state.work, sums);
        let held = HeldContacts::new(contacts.books.set.system, &contacts.books.set.closed);
        let orientation = self.motion.orientation();
        self.past = self.cost();
        self.motion = OnSheet::among_obstacles(
            self.manifold,
            self.body,
            state.phase,
            orientation,
            held,
            &self.options,
        )?;
        self.outward = self.motion.moves_outward();
        Ok(())
    }

    /// The time up to which the next step may lead: the end of the run, or of a sequence of bounces.
    pub(super) fn end_of_step(&self) -> f64 {
        let duration = self.options.duration;
        let contacts = self.contacts.as_ref();
        contacts.map_or(duration, |all| all.books.end_of_step(duration))
    }

    /// Looks for contact in the step just taken, and ends the step at the first event.
    pub(super) fn look_for_contact(&mut self, progress: Progress) -> Result<Progress> {
        let Some(mut contacts) = self.contacts.take() else {
            return Ok(progress);
        };
        let ended = self.look(&mut contacts, progress);
        self.contacts = Some(contacts);
        ended
    }

    fn look(
        &mut self,
        contacts: &mut RunContacts<'a, N>,
        mut progress: Progress,
    ) -> Result<Progress> {
        let lost = || Error::no_convergence("a step among obstacles has no interpolant");
        let step = self.motion.last_step().ok_or_else(lost)?;
        let body = self.struck_body(contacts);
        let length = step.to.t - step.from.t;
        let way = (step.from.v.norm() + 0.5 * step.acceleration * length) * length;
        contacts.clearance.travelled += way;
        let stands = contacts.books.set.closed.is_empty() && !contacts.books.set.system.moves();
        if stands && contacts.clearance.is_left() {
            return Ok(progress);
        }
        if let Some((t, found)) = self.first_event(contacts, &body, &step) {
            progress = Progress::Moved;
            contacts.books.due = Some(Some(found));
            let ended = match found {
                _ if t <= AT_START * length => {
                    self.motion.take_back();
                    true
                }
                Found::Touch(k) => {
                    let gap = |at: &Phase<N>| body.at(at).touch(k).0.gap;
                    let place = self.motion.at(step.from.t + t).ok_or_else(lost)?;
                    let (touch, slip) = body.at(&place).touch(k);
                    let rate = touch.normal.dot(&slip);
                    self.motion.end_where(step.from.t + t, rate, gap)
                }
                Found::Turn(_) => self.motion.end_at(step.from.t + t),
            };
            if !ended {
                return Err(Error::no_convergence("an event of a contact was lost"));
            }
        }
        if let Some(touch) = self.rod_touch(contacts) {
            self.found = Some(Event::Stop(Outcome::RodTouch(touch)));
            progress = Progress::Moved;
            contacts.books.due = None;
        }
        if contacts.books.set.holds() {
            self.divide_sums(contacts, &body, &step);
            let mut state = self.struck_state();
            let kept = contacts.books.set.keep(&body, &mut state);
            let held = HeldContacts::new(contacts.books.set.system, &contacts.books.set.closed);
            self.motion.renew_contacts(held);
            if kept && progress == Progress::Moved {
                self.motion.correct(state.phase);
            }
        }
        // Contacts without a force may close anew.
        if !contacts.books.set.closed.is_empty() {
            contacts.books.due.get_or_insert(None);
        }
        let now = self.motion.phase();
        let rod = contacts.rod.as_ref();
        contacts.clearance = Clearance {
            body: body.at(&now).least_gap(),
            rod: rod.map_or(f64::INFINITY, |rod| rod(&now, GapBy::Reach).gap),
            travelled: 0.0,
        };
        Ok(progress)
    }

    /// The first event of a contact in a step: its time from the start of the step.
    fn first_event(
        &mut self,
        contacts: &RunContacts<'a, N>,
        body: &SheetBody<'a, 'a, M, N>,
        step: &LastStep<N>,
    ) -> Option<(f64, Found)> {
        let length = step.to.t - step.from.t;
        let ends = [body.at(&step.from), body.at(&step.to)];
        let bounds = [AccelerationBound::linear(step.acceleration)];
        let motion = &mut self.motion;
        let touch = (contacts.books.set).first_touch([&ends[0], &ends[1]], length, &bounds, |t| {
            Some(body.at(&motion.at(step.from.t + t)?))
        });
        let mut first = touch.map(|(t, k)| (t, Found::Touch(k)));
        if contacts.books.set.holds() {
            let inside = self.motion.inside()?;
            let turn = (contacts.books.set)
                .first_turn(|x| Some(body.loaded(&if x == 1.0 { step.to } else { inside(x) })));
            if let Some((x, watch)) = turn {
                let t = inside(x).t - step.from.t;
                if first.is_none_or(|(earlier, _)| t < earlier) {
                    first = Some((t, Found::Turn(watch)));
                }
            }
        }
        first
    }

    /// The first bound that the rod passes within the last step. The step then ends at the bound.
    fn rod_touch(&mut self, contacts: &RunContacts<'a, N>) -> Option<RodTouch> {
        let rod = contacts.rod.as_ref()?;
        let step = self.motion.last_step()?;
        let speed = step.from.v.norm().max(step.to.v.norm());
        let moved = speed * (step.to.t - step.from.t);
        let reach = |at: &Phase<N>| rod(at, GapBy::Reach).gap;
        if reach(&step.from).min(reach(&step.to)) > Clearance::of_rod(moved) {
            return None;
        }
        let room = |at: &Phase<N>| rod(at, GapBy::Shape).gap - TOUCHES;
        let inside = self.motion.inside()?;
        let fraction = first_change(&inside, PLACES, room)?;
        let there = inside(fraction);
        let touch = rod(&there, GapBy::Shape);
        let own = |at: &Phase<N>| rod(at, GapBy::Bound(touch.bound, touch.obstacle)).gap;
        let before = inside(fraction * (1.0 - BESIDE));
        let rate = (own(&there) - own(&before)) / (there.t - before.t);
        // A step without a root of the room, as at its start, ends at the place found before.
        let ended = rate < 0.0 && self.motion.end_where(there.t, rate, own);
        if !ended {
            self.motion.end_after(fraction);
        }
        let found = rod(
            &self.motion.phase(),
            GapBy::Bound(touch.bound, touch.obstacle),
        );
        Some(if found.gap.is_finite() { found } else { touch })
    }

    /// Tells friction from drag, and the work of obstacles from that of loads, in the step just taken.
    fn divide_sums(
        &mut self,
        contacts: &mut RunContacts<'a, N>,
        body: &SheetBody<'a, 'a, M, N>,
        step: &LastStep<N>,
    ) {
        let damped = self.body.is_damped();
        if !damped && !self.body.is_driven() {
            return;
        }
        let to = self.motion.phase();
        let span = to.t - step.from.t;
        let ends = [&step.from, &to].map(sums_of);
        contacts.books.divide(ends, span, |x| {
            Some(body.loaded(&self.motion.at(step.from.t + x * span)?))
        });
    }

    /// Lets what is due at the end of the last step happen, and returns the first event that is still to be reported.
    pub(super) fn contact_event(&mut self) -> Option<Result<Event>> {
        let mut contacts = self.contacts.take()?;
        let mut state = self.struck_state();
        let body = self.struck_body(&contacts);
        let happened = contacts.books.happen(&body, &mut state);
        let event = contacts.books.next_event();
        let spent = contacts.books.are_spent();
        self.contacts = Some(contacts);
        let going = happened.and_then(|changed| {
            if changed {
                self.go_on_from(state)
            } else {
                Ok(())
            }
        });
        if let Err(why) = going {
            return Some(Err(why));
        }
        match event {
            Some(event) => Some(Ok(Event::Contact(event))),
            None => spent.then(|| Ok(self.stop(Outcome::ImpactLimit))),
        }
    }

    /// The present state, without losses.
    fn struck_state(&self) -> Struck<N> {
        Struck {
            phase: self.motion.phase(),
            lost: 0.0,
            work: 0.0,
        }
    }

    /// After a snap: closed contacts stay closed, or open under the new force of the rod.
    pub(super) fn settle_contacts(&mut self) -> Result<()> {
        let Some(mut contacts) = self.contacts.take() else {
            return Ok(());
        };
        let mut state = self.struck_state();
        let body = self.struck_body(&contacts);
        let settled = contacts.books.set.settle(&body, &mut state, &[]);
        contacts.books.due = None;
        let inside = contacts
            .rod
            .as_ref()
            .map(|rod| rod(&state.phase, GapBy::Shape));
        self.contacts = Some(contacts);
        settled?;
        self.go_on_from(state)?;
        if let Some(touch) = inside.filter(RodTouch::is_one) {
            self.found = Some(Event::Stop(Outcome::RodTouch(RodTouch {
                bound: RodBound::Landing,
                ..touch
            })));
        }
        Ok(())
    }

    /// The contacts at a state within the last step, or now; None without obstacles.
    pub(super) fn contact_sample(&self, phase: &Phase<N>) -> Option<ContactSample> {
        let contacts = self.contacts.as_ref()?;
        let now = self.struck_body(contacts).loaded(phase);
        Some(contacts.books.sample(now, sums_of(phase)))
    }

    /// Energy lost in impacts, and work of obstacles in them.
    pub(super) fn of_impacts(&self) -> [f64; 2] {
        let contacts = self.contacts.as_ref();
        contacts.map_or([0.0; 2], |all| [all.books.lost, all.books.struck])
    }
}

fn sums_of<const N: usize>(phase: &Phase<N>) -> Sums {
    Sums {
        drag: phase.drag_loss,
        work: phase.work,
    }
}
