//! The contacts of bodies with obstacles and each other: which are closed, which close or change next.

use super::bodies::{Bodies, ContactId};
use super::contact_dynamics::ContactDynamics;
use super::contact_event::ContactEvent;
use super::contact_forces::{AccelerationBound, Closed, Grip, Moment};
use super::first_touch::{DEPTH, GapAt, first_touch};
use super::rest::{RestWatch, STILL};
use nalgebra::Vector3;
use snaprod_systems::error::{Error, Result};
use snaprod_systems::solve::roots::chandrupatla;

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
    /// Velocity of the body relative to the partner, at the place.
    pub slip: Vector3<f64>,
    /// Coefficient of friction.
    pub coefficient: f64,
    /// True if the surfaces stick.
    pub sticks: bool,
}

/// The end of a sequence of impacts that is still to be reported.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) struct Pending {
    pub candidate: usize,
    pub t: f64,
}

/// The cause of an event within a step.
#[derive(Debug, Clone, Copy)]
pub(crate) enum Found {
    /// The surfaces of a candidate touch.
    Touch(usize),
    /// A quantity of a closed contact comes to zero.
    Turn(RestWatch),
}

/// Overlap at the start that is refused.
pub(super) const OVERLAP: f64 = 1e-9;
/// Safety factor of the bound on accelerations of gaps.
const FALL: f64 = 2.0;
/// Places within a step at which watched quantities are looked at.
const LOOKS: usize = 8;
/// Relative depth below zero at which a watched quantity has fallen through zero.
const BELOW: f64 = 1e-13;
/// Part of a step after which an event at the start of the step is taken.
pub(crate) const AT_START: f64 = 1e-15;

/// The contacts of a motion in progress.
#[derive(Clone)]
pub(crate) struct ContactSet<'a> {
    pub system: &'a Bodies,
    /// Normal speed after an impact below which bounces are summed up.
    pub resting_speed: f64,
    pub closed: Vec<Closed>,
    pub pending: Vec<Pending>,
    /// Impacts so far.
    pub impacts: u64,
    /// Events that are still to be reported.
    pub events: Vec<ContactEvent>,
}

impl<'a> ContactSet<'a> {
    /// Contacts of which none is closed.
    pub fn new(system: &'a Bodies, resting_speed: f64) -> Self {
        Self {
            system,
            resting_speed,
            closed: Vec::new(),
            pending: Vec::new(),
            impacts: 0,
            events: Vec::new(),
        }
    }

    pub(super) fn report(&mut self, event: ContactEvent) {
        self.events.push(event);
    }

    /// True if a closed contact carries a force.
    pub fn holds(&self) -> bool {
        self.closed.iter().any(|closed| closed.grip != Grip::Idle)
    }

    /// The start: refuses overlaps, and lets contacts that are closed hit or settle.
    ///
    /// # Errors
    /// A pair without a closed form; a start inside an obstacle or another body; contact forces without a solution.
    pub fn open<D: ContactDynamics>(&mut self, dynamics: &D, y: &mut D::State) -> Result<()> {
        self.system.check()?;
        let now = dynamics.places(y);
        let mut settles = Vec::new();
        let mut hits = Vec::new();
        for (k, candidate) in self.system.candidates.iter().enumerate() {
            let (touch, slip) = now.touch(k);
            if !(touch.gap >= -OVERLAP) {
                return Err(Error::domain(format!(
                    "{} starts inside {} by {:.3e}, at {:.6}, {:.6}, {:.6}; move it outwards",
                    self.system.body_name(candidate.id.body),
                    self.system.partner_name(candidate.id.partner),
                    -touch.gap,
                    touch.point.x,
                    touch.point.y,
                    touch.point.z
                )));
            }
            let rate = touch.normal.dot(&slip);
            if touch.gap > OVERLAP || rate > STILL * self.resting_speed {
                continue;
            }
            if rate < -STILL * self.resting_speed {
                hits.push(k);
            } else if let Some(spread) = touch.spread {
                return Err(Error::domain(format!(
                    "{spread} at the start: such a contact has no single point"
                )));
            } else {
                settles.push((k, 0.0));
            }
        }
        drop(now);
        self.settle(dynamics, y, &settles)?;
        self.hit_all(dynamics, y, &hits)
    }

    /// Lets candidates hit one after the other, as far as the surfaces still approach.
    fn hit_all<D: ContactDynamics>(
        &mut self,
        dynamics: &D,
        y: &mut D::State,
        hits: &[usize],
    ) -> Result<()> {
        for &k in hits {
            let (touch, slip) = dynamics.places(y).touch(k);
            if touch.normal.dot(&slip) < 0.0 {
                let may_close = self.impact(dynamics, y, k)?;
                self.settle(dynamics, y, &may_close)?;
            }
        }
        Ok(())
    }

    /// Lets the event at the end of a step happen. Returns true if the contacts changed.
    ///
    /// # Errors
    /// Contact forces or impulses without a solution.
    pub fn happen<D: ContactDynamics>(
        &mut self,
        dynamics: &D,
        y: &mut D::State,
        found: Option<Found>,
    ) -> Result<bool> {
        self.end_bounces(dynamics, y);
        match found {
            Some(Found::Touch(k)) => {
                let (touch, slip) = dynamics.places(y).touch(k);
                let rate = touch.normal.dot(&slip);
                // Surfaces that no longer approach only graze each other.
                let may_close = if rate < 0.0 {
                    self.impact(dynamics, y, k)?
                } else {
                    vec![(k, rate)]
                };
                self.settle(dynamics, y, &may_close)?;
            }
            Some(Found::Turn(watch)) => self.turn(dynamics, y, watch)?,
            None => {}
        }
        // Bounces that begin now may last less than the rounding of time.
        self.end_bounces(dynamics, y);
        Ok(found.is_some() | self.look_at_idle(dynamics, y)?)
    }

    /// Reports the sequences of bounces that are over.
    fn end_bounces<D: ContactDynamics>(&mut self, dynamics: &D, y: &D::State) {
        let t = dynamics.time(y);
        let over: Vec<Pending> = (self.pending.iter().copied())
            .filter(|pending| pending.t <= t)
            .collect();
        self.pending.retain(|pending| pending.t > t);
        for pending in over {
            let change = self.change(dynamics, y, pending.candidate, &self.closed);
            self.report(ContactEvent::Accumulation(change));
        }
    }

    /// Contacts that carried no force may have opened, or close anew. Returns true if one did.
    fn look_at_idle<D: ContactDynamics>(&mut self, dynamics: &D, y: &mut D::State) -> Result<bool> {
        if self.closed.iter().all(|closed| closed.grip != Grip::Idle) {
            return Ok(false);
        }
        let (mut opened, mut hits) = (Vec::new(), Vec::new());
        let now = dynamics.places(y);
        for closed in self.closed.iter().filter(|c| c.grip == Grip::Idle) {
            let (touch, slip) = now.touch(closed.candidate);
            let rate = touch.normal.dot(&slip);
            if rate > self.resting_speed || touch.gap > OVERLAP {
                opened.push(closed.candidate);
            } else if rate < -self.resting_speed {
                hits.push(closed.candidate);
            }
        }
        drop(now);
        self.closed.retain(|c| !opened.contains(&c.candidate));
        self.hit_all(dynamics, y, &hits)?;
        Ok(!opened.is_empty() || !hits.is_empty())
    }

    /// The first touch of an open candidate within a step of the duration `length`: its time from the start of the
    /// step, and the candidate. `ends` are the ends of the step, `bounds` bound the accelerations of the bodies.
    pub fn first_touch<'m>(
        &self,
        ends: [&Moment<'_>; 2],
        length: f64,
        bounds: &[AccelerationBound],
        mut inside: impl FnMut(f64) -> Option<Moment<'m>>,
    ) -> Option<(f64, usize)> {
        let mut first: Option<(f64, usize)> = None;
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
            let [from, to] = [at(ends[0], 0.0), at(ends[1], length)];
            let falls = ends.iter().map(|end| end.largest_fall(k, bounds));
            let fall = FALL * falls.fold(0.0, f64::max);
            let mut inside = |t: f64| Some(at(&inside(t)?, t));
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
            if first.is_none_or(|(earlier, _)| t < earlier) {
                first = Some((t, k));
            }
        }
        first
    }

    /// The first fall of a watched quantity below zero within a step: the fraction of the step, and the quantity.
    /// `inside` gives the moment at a fraction.
    pub fn first_turn<'m>(
        &self,
        inside: impl Fn(f64) -> Option<Moment<'m>>,
    ) -> Option<(f64, RestWatch)> {
        if !self.holds() {
            return None;
        }
        let values = |x: f64| inside(x)?.watch(&self.closed);
        let mut before = values(0.0)?;
        for look in 1..=LOOKS {
            let (x0, x1) = ((look - 1) as f64 / LOOKS as f64, look as f64 / LOOKS as f64);
            let after = values(x1)?;
            let size = after.iter().fold(1.0_f64, |most, (_, v)| most.max(v.abs()));
            let mut earliest: Option<(f64, RestWatch)> = None;
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
                return Some((x.max(AT_START), watch));
            }
            before = after;
        }
        None
    }
}

impl Moment<'_> {
    /// The closed contacts that carry a force.
    pub fn contacts_now(&mut self, closed: &[Closed]) -> Vec<ContactNow> {
        let held = closed.iter().filter(|closed| closed.grip != Grip::Idle);
        let Some((rows, solution)) = self.forces(closed) else {
            return Vec::new();
        };
        let each = rows.iter().zip(held).enumerate();
        each.map(|(i, (row, closed))| {
            let force: Vector3<f64> = solution.forces.fixed_rows::<3>(3 * i).into_owned();
            ContactNow {
                contact: self.system.candidates[row.candidate].id,
                point: row.touch.point,
                normal: row.touch.normal,
                normal_force: force.x,
                friction: row.axes * Vector3::new(0.0, force.y, force.z),
                slip: row.slip,
                coefficient: self.system.candidates[row.candidate].surface.friction(),
                sticks: closed.grip == Grip::Stick,
            }
        })
        .collect()
    }

    /// The least gap of all possible contacts; infinite without any.
    pub fn least_gap(&self) -> f64 {
        let gaps = (0..self.system.candidates.len()).map(|k| self.touch(k).0.gap);
        gaps.fold(f64::INFINITY, f64::min)
    }
}

/// Depth of the touches that are looked for; a deeper overlap is an impact.
const _: () = assert!(DEPTH < OVERLAP);
