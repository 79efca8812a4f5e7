//! The body's motion on one sheet, in desingularised time.
//!
//! dq/dt = (Dg)^-1 v is singular at a fold and stiff at the taut wall. With the signed time
//! dt = s det / sqrt(det^2 + pace^2) dtau (theory 2.5), s the sign of det on the sheet,
//! ```text
//! q' = s adj(Dg) v / sqrt(..),   v' = t' (F(q)/mu + loads),   t' = s det / sqrt(..)
//! ```
//! is smooth through det = 0: the fold is where t stops growing, an ordinary root. Away from folds
//! and walls tau runs like t.

mod beam_with_mass;
mod contacts;
mod fast_oscillation;
mod in_step_events;
mod multi_period;
mod sheet8;
mod slow_beam;

use super::body_with_rod::{FollowedMass, rod_error, with_rod};
use super::locate::{Guess, Located, Timed, first_fold, locate};
use super::options::Options;
pub use beam_with_mass::{MassNow, MassTreatment};
pub use contacts::{HeldContacts, SheetBody, Struck};
use fast_oscillation::Shaking;
pub use in_step_events::LastStep;
use nalgebra::SVector;
use sheet8::{EightfoldSteps, OneOrEight};
pub use slow_beam::Glide;
use snaprod_systems::body::PointMass;
use snaprod_systems::error::{Error, Result};
use snaprod_systems::manifold::{
    FirstOrderInertia, ManifoldPoint, Multivalued, Patch, adjugate_times,
};
use snaprod_systems::solve::cost::Cost;
use snaprod_systems::solve::dop853::State;
use snaprod_systems::solve::gauss::Reversible;
use snaprod_systems::solve::integrator::Method;
use snaprod_systems::solve::roots::chandrupatla;
use snaprod_systems::solve::stepper::{AcceptedStep, StepInterpolant, Stepper};

/// State of a motion: chart point, velocity, time, and the integrals of the energy ledger.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Phase<const N: usize> {
    /// Chart point.
    pub q: SVector<f64, N>,
    /// Velocity of the body, seen from the clamp.
    pub v: SVector<f64, N>,
    /// Time.
    pub t: f64,
    /// Work done by the forces in time and by the clamp.
    pub work: f64,
    /// Energy lost to drag.
    pub drag_loss: f64,
}

impl<const N: usize> State for Phase<N> {
    #[inline]
    fn axpy(&mut self, a: f64, x: &Self) {
        self.q += x.q * a;
        self.v += x.v * a;
        self.t += x.t * a;
        self.work += x.work * a;
        self.drag_loss += x.drag_loss * a;
    }

    /// Chart, velocity and energies are judged relative to 1 + their size, time absolutely.
    fn mean_square(&self, from: &Self, to: &Self) -> f64 {
        let part = |e: f64, a: f64, b: f64| (e / (1.0 + a.abs().max(b.abs()))).powi(2);
        let mut sum = self.t * self.t
            + part(self.work, from.work, to.work)
            + part(self.drag_loss, from.drag_loss, to.drag_loss);
        for i in 0..N {
            sum += part(self.q[i], from.q[i], to.q[i]) + part(self.v[i], from.v[i], to.v[i]);
        }
        sum / (2 * N + 1) as f64
    }
}

impl<const N: usize> Reversible for Phase<N> {
    /// Constant: steps in tau are already short in time where the motion is fast.
    fn pace_squared(&self, _at: &Self) -> f64 {
        1.0
    }
}

impl<const N: usize> Timed for Phase<N> {
    #[inline]
    fn time(&self) -> f64 {
        self.t
    }
}

/// Outcome of a step.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum Progress {
    /// Inside the sheet, before the end.
    Moved,
    /// At the end of time.
    Arrived,
    /// At a fold. `time_error` is the uncertainty of its location in time; the integration's error comes on top.
    Fold {
        /// Change of the fold's time in the last correction.
        time_error: f64,
    },
}

/// A motion on one sheet, step by step.
pub struct OnSheet<'a, M, const N: usize> {
    manifold: &'a M,
    body: &'a PointMass<N>,
    /// The mass of the rod; None if it is not followed.
    rod: Option<FollowedMass<'a, N>>,
    /// Contacts with obstacles; None in a scene without obstacles.
    contacts: Option<HeldContacts<'a>>,
    /// The chart of the solver's states.
    patch: Patch,
    orientation: f64,
    tolerance: f64,
    /// Latest time at which loads and clamp are evaluated, just before the next break.
    until: f64,
    solver: Stepper<Phase<N>>,
    /// Steps with slopes at eight places at once; None for symmetric steps, with a rod's mass, or without such slopes.
    eight: Option<EightfoldSteps<'a, N>>,
    last: Option<AcceptedStep<Phase<N>>>,
    dense: Option<StepInterpolant<Phase<N>>>,
    /// State of the search for strides and glides next to the straight rod.
    shaking: Shaking<N>,
}

/// Ratio of the lengths of collocation steps and DOP853 steps.
const LONGER: f64 = 3.0;
/// Largest distance to the end of time, relative to 1 + the time, at which a state has arrived.
const ON_TIME: f64 = 1e-12;
/// Most halvings of a step in which no fold is found where time turns back, or whose end is not hit. Then the step
/// fails.
const HALVINGS: u32 = 60;

impl<'a, M: Multivalued<N>, const N: usize> OnSheet<'a, M, N> {
    /// Starts a motion at `start` on the sheet where s det > 0, s = `orientation` = +-1. Tolerance and method
    /// come from `options`: steps are explicit unless symmetric ones are asked for. `rod`: its mass, if the
    /// motion is to feel it.
    ///
    /// # Errors
    /// A start outside the chart.
    pub fn new(
        manifold: &'a M,
        body: &'a PointMass<N>,
        start: Phase<N>,
        orientation: f64,
        rod: Option<&'a dyn FirstOrderInertia<N>>,
        options: &Options,
    ) -> Result<Self> {
        Self::with(manifold, body, start, orientation, (rod, None), options)
    }

    /// Starts a motion as [`OnSheet::new`] among obstacles. `contacts` are those that are closed.
    ///
    /// # Errors
    /// A start outside the chart, or without contact forces.
    pub fn among_obstacles(
        manifold: &'a M,
        body: &'a PointMass<N>,
        start: Phase<N>,
        orientation: f64,
        contacts: HeldContacts<'a>,
        options: &Options,
    ) -> Result<Self> {
        let parts = (None, Some(contacts));
        Self::with(manifold, body, start, orientation, parts, options)
    }

    fn with(
        manifold: &'a M,
        body: &'a PointMass<N>,
        start: Phase<N>,
        orientation: f64,
        (rod, contacts): (
            Option<&'a dyn FirstOrderInertia<N>>,
            Option<HeldContacts<'a>>,
        ),
        options: &Options,
    ) -> Result<Self> {
        let tolerance = options.tolerance;
        let rod = rod.map(|rod| FollowedMass {
            rod,
            error: rod_error(body, tolerance),
        });
        let patch = match rod {
            Some(_) => Patch::Global,
            None => manifold.better_patch(Patch::Global, &start.q),
        };
        let outside = || {
            Error::domain(format!(
                "the start {} lies outside the chart",
                snaprod_systems::error::named(&["q1", "q2"], start.q.as_slice())
            ))
        };
        let start = Phase {
            q: manifold.change_patch(&start.q, Patch::Global, patch),
            ..start
        };
        let held = contacts.filter(HeldContacts::hold);
        let slope = slope(
            manifold,
            patch,
            body,
            rod,
            held.as_ref(),
            orientation,
            &start,
        )
        .ok_or_else(outside)?;
        let rate = slope.mean_square(&start, &start).sqrt();
        let h = 0.3 * tolerance.powf(0.125) / rate.max(0.1);
        let local = options.local_tolerance();
        let symmetric = options.method == Method::Symmetric;
        let eight = if symmetric || rod.is_some() || held.is_some() {
            None
        } else {
            EightfoldSteps::new(manifold, body, orientation, h, local)
        };
        Ok(Self {
            eight,
            manifold,
            body,
            rod,
            contacts,
            patch,
            orientation,
            tolerance: local,
            until: f64::MAX,
            solver: Stepper::new(symmetric, start, slope, h, local).ok_or_else(outside)?,
            last: None,
            dense: None,
            shaking: Shaking::default(),
        })
    }

    /// The current state.
    pub fn phase(&self) -> Phase<N> {
        self.global(*self.solver.state())
    }

    /// Latest time at which loads and obstacles are evaluated.
    pub fn until(&self) -> f64 {
        self.until
    }

    /// The sign s of det on the sheet.
    pub fn orientation(&self) -> f64 {
        self.orientation
    }

    /// Time now.
    pub fn time(&self) -> f64 {
        self.solver.state().t
    }

    /// `phase`, given in the chart of the solver's states, in the global one.
    fn global(&self, phase: Phase<N>) -> Phase<N> {
        Phase {
            q: (self.manifold).change_patch(&phase.q, self.patch, Patch::Global),
            ..phase
        }
    }

    /// Checks that double precision resolves the motion at the current state.
    ///
    /// # Errors
    /// The chart point is not resolved; the error says why.
    pub fn resolved(&self) -> Result<()> {
        match self.patch {
            Patch::Global => self.manifold.check_resolution(&self.solver.state().q),
            Patch::Near(_) => Ok(()),
        }
    }

    /// True if the body moves against the pull of a taut rod; None if the rod is not taut.
    pub fn moves_outward(&self) -> Option<bool> {
        let now = self.solver.state();
        self.manifold.tautness(self.patch, &now.q)?;
        let at = self.manifold.point_in(self.patch, &now.q)?;
        Some(at.force.dot(&now.v) < 0.0)
    }

    /// Renews the directions in which closed contacts slip: the same contacts act in the next steps.
    pub fn renew_contacts(&mut self, contacts: HeldContacts<'a>) {
        self.contacts = Some(contacts);
    }

    /// The closed contacts, if one of them carries a force.
    fn held(&self) -> Option<HeldContacts<'a>> {
        self.contacts.filter(HeldContacts::hold)
    }

    /// Changes to a better chart, if there is one.
    fn change_patch(&mut self) {
        if self.rod.is_some() {
            return;
        }
        let (now, before) = (*self.solver.state(), *self.solver.slope());
        let patch = self.manifold.better_patch(self.patch, &now.q);
        if patch == self.patch {
            return;
        }
        let carried = Phase {
            q: self.manifold.change_patch(&now.q, self.patch, patch),
            ..now
        };
        let Some(slope) = slope(
            self.manifold,
            patch,
            self.body,
            None,
            self.held().as_ref(),
            self.orientation,
            &carried,
        ) else {
            return;
        };
        // The same step in time, at first.
        let h = self.solver.next_step() * before.t / slope.t;
        if self.solver.restart(carried, slope, h).is_none() {
            return;
        }
        self.solver.cost_mut().evaluations += 1;
        self.patch = patch;
        self.last = None;
        self.shaking.forget();
    }

    /// Cost so far.
    pub fn cost(&self) -> Cost {
        self.solver.cost()
    }

    /// Duration of the next step at the present rate t' of time.
    pub fn next_step(&self) -> f64 {
        let eight = self.eight.as_ref().filter(|_| self.patch == Patch::Global);
        let h = eight.and_then(|eight| eight.steps.next_step());
        h.unwrap_or_else(|| self.solver.next_step()) * self.solver.slope().t.abs()
    }

    /// One step, at most to time `end`, to the next break of the loads, or to the fold if that comes first.
    /// None: the step size has collapsed; the state is unchanged.
    pub fn step(&mut self, end: f64) -> Option<Progress> {
        self.change_patch();
        // Symmetric steps integrate every turn: the strides over many turns are not reversible.
        // Among obstacles every turn is looked at.
        let strides = !self.solver.is_symmetric() && self.contacts.is_none();
        if strides && let Some(progress) = self.glide(end) {
            return Some(progress);
        }
        if strides && self.stride(end) {
            return Some(Progress::Moved);
        }
        let moves = self
            .contacts
            .map_or(f64::INFINITY, |contacts| contacts.next_break(self.time()));
        let next = self.body.next_break(self.time()).min(moves);
        self.look_until(next.next_down())?;
        let progress = match self.step_to(next.min(end))? {
            Progress::Arrived if next < end => Progress::Moved,
            progress => progress,
        };
        if strides && progress == Progress::Moved {
            self.look_for_turns(end);
        }
        Some(progress)
    }

    /// Lets the next step look anew at the loads, one of which has changed at the present state.
    pub fn look_anew(&mut self) {
        self.until = f64::NAN;
        self.shaking.forget();
    }

    /// Sets the latest time at which loads and clamp are evaluated. Time is an integrated variable, so the
    /// stages of a step may lie behind the break at which the step is to end, where loads jump. They take the
    /// values just before the break.
    fn look_until(&mut self, until: f64) -> Option<()> {
        if until == self.until {
            return Some(());
        }
        self.until = until;
        if let Some(eight) = self.eight.as_mut() {
            eight.motion.until = until;
        }
        let now = *self.solver.state();
        let slope = self.right_hand_side()(&now)?;
        self.solver.cost_mut().evaluations += 1;
        self.solver.rewind(now, slope);
        Some(())
    }

    fn step_to(&mut self, end: f64) -> Option<Progress> {
        let f = self.right_hand_side();
        self.dense = None;
        // Stages far past the end would be wasted, and t' only changes smoothly.
        let remaining = end - self.time();
        // The floor is for starts on a fold, where t' = 0; next to the straight rod t' goes like 1 - x.
        let mut h_max = 4.0 * remaining / self.solver.slope().t.max(f64::MIN_POSITIVE);
        let mut cost = Cost::default();
        let mut halvings = 0;
        let progress = loop {
            let mut step = self.one_step(h_max)?;
            let h = step.h();
            let both = &mut self.both(f);
            let fold = first_fold(&mut step, both, &mut cost)
                .and_then(|guess| locate(&step, both, guess, |_, slope| slope.t, &mut cost));
            let progress = match fold {
                // Time turned back and the fold was not found: it must be in a shorter step.
                None if !(step.end_slope().t > 0.0) => {
                    self.solver.rewind(*step.from(), *step.start_slope());
                    None
                }
                // A fold at the end of time counts too: no step can start from a fold.
                Some(mut fold) if fold.step.to().t <= end + ON_TIME * (1.0 + end) => {
                    let to = fold.step.to_mut();
                    to.t = to.t.min(end);
                    self.rewind(fold.step);
                    Some(Progress::Fold {
                        time_error: fold.time_error,
                    })
                }
                Some(fold) => self.finish(fold.step, end, f, &mut cost),
                None if step.to().t >= end => self.finish(step, end, f, &mut cost),
                None => {
                    self.last = Some(step);
                    Some(Progress::Moved)
                }
            };
            if let Some(progress) = progress {
                break progress;
            }
            // Noise of the slopes may hide the end in a long step, as of a body at rest: a shorter one comes nearer.
            halvings += 1;
            if halvings > HALVINGS {
                return None;
            }
            h_max = 0.5 * h;
        };
        let total = self.solver.cost_mut();
        *total = *total + cost;
        Some(progress)
    }

    fn one_step(&mut self, h_max: f64) -> Option<AcceptedStep<Phase<N>>> {
        match self.step_at_eight(h_max) {
            Some(step) => Some(step),
            None => self.step_at_one(h_max),
        }
    }

    /// A step with slopes at eight places at once; None outside the global chart, without such steps, or on failure.
    fn step_at_eight(&mut self, h_max: f64) -> Option<AcceptedStep<Phase<N>>> {
        if self.patch != Patch::Global {
            return None;
        }
        let eight = self.eight.as_mut()?;
        let (from, slope) = (self.solver.state(), self.solver.slope());
        let mut cost = Cost::default();
        let step = (eight.steps).step(from, slope, &mut eight.motion, h_max, &mut cost);
        *self.solver.cost_mut() = self.solver.cost() + cost;
        let step = step?;
        self.solver.rewind(step.to, *step.end_slope());
        Some(AcceptedStep::Collocated(step))
    }

    /// A step with slopes one by one. Its length follows from that of a preceding collocation step, and vice versa.
    fn step_at_one(&mut self, h_max: f64) -> Option<AcceptedStep<Phase<N>>> {
        if let (Some(AcceptedStep::Collocated(step)), Stepper::Explicit(solver)) =
            (&self.last, &mut self.solver)
        {
            let (state, slope) = (*solver.state(), *solver.slope());
            solver.restart(state, slope, step.h / LONGER);
        }
        let f = self.right_hand_side();
        let step = self.solver.step(written(f), h_max).ok()?;
        if let Some(eight) = self.eight.as_mut() {
            eight.steps.resume(LONGER * self.solver.next_step());
        }
        Some(step)
    }

    /// The right-hand side, with the eightfold version if the chart has one.
    fn both<F>(&mut self, one: F) -> OneOrEight<'_, 'a, F, N> {
        let eight = self.eight.as_mut().map(|eight| &mut eight.motion);
        OneOrEight { one, eight }
    }

    /// Ends `step`, which reaches or passes `end`, exactly at `end`. None, with the state back at its start,
    /// if that moment cannot be hit.
    fn finish(
        &mut self,
        mut step: AcceptedStep<Phase<N>>,
        end: f64,
        f: impl Fn(&Phase<N>) -> Option<Phase<N>> + Copy,
        cost: &mut Cost,
    ) -> Option<Progress> {
        let (from, to) = (step.from().t, step.to().t);
        let guess = Guess {
            h: step.h() * (end - from) / (to - from),
            rate: (to - from) / step.h(),
            t: end,
        };
        let hit =
            |ended: &Located<Phase<N>>| (ended.step.to().t - end).abs() <= ON_TIME * (1.0 + end);
        let missing = |state: &Phase<N>, _: &Phase<N>| state.t - end;
        let both = &mut self.both(f);
        let mut ended = locate(&step, both, guess, missing, cost).filter(hit);
        if ended.is_none() {
            // Next to a fold time nearly stands still: the interpolant of the step gives the fraction and the
            // rate of time at `end`.
            let guess = step.interpolant(both, cost).and_then(|dense| {
                let left = |x: f64| dense.at(x).t - end;
                let x = chandrupatla(left, (0.0, from - end), (1.0, to - end), 0.0)?;
                let rate = f(&dense.at(x))?.t;
                let h = x * step.h();
                (rate > 0.0).then_some(Guess { h, rate, t: end })
            });
            ended = guess.and_then(|guess| locate(&step, both, guess, missing, cost).filter(hit));
        }
        match ended {
            Some(mut ended) => {
                ended.step.to_mut().t = end;
                self.rewind(ended.step);
                Some(Progress::Arrived)
            }
            None => {
                self.solver.rewind(*step.from(), *step.start_slope());
                None
            }
        }
    }

    fn rewind(&mut self, step: AcceptedStep<Phase<N>>) {
        self.solver.rewind(*step.to(), *step.end_slope());
        self.last = Some(step);
    }

    /// The right-hand side of the motion in the present chart.
    fn right_hand_side(&self) -> impl Fn(&Phase<N>) -> Option<Phase<N>> + Copy + use<'a, M, N> {
        let (manifold, patch, body) = (self.manifold, self.patch, self.body);
        let (rod, orientation, until) = (self.rod, self.orientation, self.until);
        let held = self.held();
        move |y| {
            let seen = Phase {
                t: y.t.min(until),
                ..*y
            };
            slope(
                manifold,
                patch,
                body,
                rod,
                held.as_ref(),
                orientation,
                &seen,
            )
        }
    }
}

/// Adapts a right-hand side from returning the slope to writing the slope.
fn written<S>(f: impl Fn(&S) -> Option<S>) -> impl Fn(&S, &mut S) -> Option<()> {
    move |at, slope| {
        *slope = f(at)?;
        Some(())
    }
}

/// The right-hand side of the motion.
#[inline]
pub(crate) fn slope<M: Multivalued<N>, const N: usize>(
    manifold: &M,
    patch: Patch,
    body: &PointMass<N>,
    rod: Option<FollowedMass<N>>,
    contacts: Option<&HeldContacts<'_>>,
    orientation: f64,
    y: &Phase<N>,
) -> Option<Phase<N>> {
    let point = manifold.point_in(patch, &y.q)?;
    slope_at(&point, body, rod, contacts, orientation, y)
}

/// The right-hand side of the motion, with the equilibrium `point` of the rod at the state.
#[inline]
pub(crate) fn slope_at<const N: usize>(
    point: &ManifoldPoint<N>,
    body: &PointMass<N>,
    rod: Option<FollowedMass<N>>,
    contacts: Option<&HeldContacts<'_>>,
    orientation: f64,
    y: &Phase<N>,
) -> Option<Phase<N>> {
    let (det, along) = adjugate_times(&point.jacobian, &y.v);
    let slow = orientation / (det * det + point.pace * point.pace).sqrt();
    let rate = slow * det;
    let mut action = body.action(y.t, &point.pose, &y.v, &point.force);
    if let Some(rod) = rod {
        with_rod(rod, body, y, point, &mut action)?;
    }
    if let Some(contacts) = contacts {
        contacts.act(body, y, &point.pose, &mut action)?;
    }
    Some(Phase {
        q: along * slow,
        v: action.acceleration * rate,
        t: rate,
        work: action.power * rate,
        drag_loss: action.loss * rate,
    })
}
