//! The books of contacts in a run of rods: what happens next, and the energies that contacts have taken and given.

use super::body_motion::AT_ONCE;
use super::contact_dynamics::ContactDynamics;
use super::contact_event::ContactEvent;
use super::contact_forces::Moment;
use super::contact_sample::{ContactSample, PartOfSum};
use super::contact_set::{ContactSet, Found};
use crate::run::AmongObstacles;
use snaprod_systems::error::{Error, Result};
use snaprod_systems::math::gauss::Rule;

/// Nodes of the integral of friction over a step, where there are other losses too.
const NODES: usize = 8;

/// The sums that a run integrates: what drag and friction have taken, and the work of loads and obstacles.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Sums {
    pub drag: f64,
    pub work: f64,
}

/// The contacts of a run of rods in progress.
#[derive(Clone)]
pub(crate) struct ContactBooks<'a> {
    pub set: ContactSet<'a>,
    /// Kinetic energy lost in impacts, and work of obstacles in impacts.
    pub lost: f64,
    pub struck: f64,
    /// The event at the end of the last step, while it has not happened; the inner None is the end of a step alone.
    pub due: Option<Option<Found>>,
    max_impacts: u64,
    /// Friction at contacts as a part of the losses, and work of obstacles as a part of the work.
    friction: PartOfSum,
    obstacles: PartOfSum,
    /// Time of the last event, and events at that time.
    at_once: (f64, u32),
}

impl<'a> ContactBooks<'a> {
    pub fn new(obstacles: &AmongObstacles<'a>) -> Self {
        Self {
            set: ContactSet::new(obstacles.bodies, obstacles.resting_speed),
            lost: 0.0,
            struck: 0.0,
            due: None,
            max_impacts: obstacles.max_impacts,
            friction: PartOfSum::default(),
            obstacles: PartOfSum::default(),
            at_once: (f64::NEG_INFINITY, 0),
        }
    }

    /// The time up to which the next step may lead: the end of the run, or of a sequence of bounces.
    pub fn end_of_step(&self, duration: f64) -> f64 {
        let ends = self.set.pending.iter().map(|pending| pending.t);
        ends.fold(duration, f64::min)
    }

    /// Books an event: what it has lost and what work was done. From there on all losses are those of contacts that
    /// hold, if any does.
    pub fn book(&mut self, lost: f64, work: f64, sums: Sums) {
        self.lost += lost;
        self.struck += work;
        let share = f64::from(u8::from(self.set.holds()));
        self.friction.go_on(sums.drag, share);
        self.obstacles.go_on(sums.work, share);
    }

    /// Tells friction from drag, and the work of obstacles from that of loads, in a step of length `span`. `loaded`:
    /// the bodies with their accelerations at a fraction of the step.
    pub fn divide<'m>(
        &mut self,
        [from, to]: [Sums; 2],
        span: f64,
        mut loaded: impl FnMut(f64) -> Option<Moment<'m>>,
    ) {
        let rule = Rule::new(NODES);
        let mut sums = [0.0; 2];
        for (x, weight) in rule.nodes.iter().zip(&rule.weights) {
            if let Some(action) = loaded(*x).and_then(|mut now| now.act(&self.set.closed)) {
                sums[0] += action.loss * weight * span;
                sums[1] += action.work * weight * span;
            }
        }
        let share = |part: f64, sum: f64| if sum == 0.0 { 0.0 } else { part / sum };
        self.friction
            .go_on(from.drag, share(sums[0], to.drag - from.drag));
        self.obstacles
            .go_on(from.work, share(sums[1], to.work - from.work));
    }

    /// Lets what is due at the end of a step happen. True if the state or the contacts have changed.
    ///
    /// # Errors
    /// Contact forces without a solution; contacts that change without end at one moment.
    pub fn happen<D: ContactDynamics>(&mut self, bodies: &D, state: &mut D::State) -> Result<bool> {
        let Some(found) = self.due.take() else {
            return Ok(false);
        };
        if !self.set.happen(bodies, state, found)? {
            return Ok(false);
        }
        let now = bodies.time(state);
        let (t, count) = self.at_once;
        let stands = now <= t + f64::EPSILON * t.abs();
        self.at_once = if stands { (t, count + 1) } else { (now, 0) };
        if self.at_once.1 > AT_ONCE {
            return Err(Error::no_convergence(
                "contacts open, close, slip or stick again and again at one moment",
            ));
        }
        Ok(true)
    }

    /// The first event that is still to be reported.
    pub fn next_event(&mut self) -> Option<ContactEvent> {
        (!self.set.events.is_empty()).then(|| self.set.events.remove(0))
    }

    /// True if as many impacts have happened as the run may have.
    pub fn are_spent(&self) -> bool {
        self.set.impacts >= self.max_impacts
    }

    /// The contacts at a state with these sums.
    pub fn sample(&self, mut now: Moment<'_>, sums: Sums) -> ContactSample {
        ContactSample {
            impact_lost: self.lost,
            closing_lost: 0.0,
            barrier: 0.0,
            friction_lost: self.friction.at(sums.drag),
            obstacle_work: self.struck + self.obstacles.at(sums.work),
            least_gap: now.least_gap(),
            contacts: now.contacts_now(&self.set.closed),
            rods: Vec::new(),
        }
    }
}
