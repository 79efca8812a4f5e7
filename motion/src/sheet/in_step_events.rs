//! Interpolated states inside the last step: at a time, at the largest stored energy, at a new end of the step.

use super::sheet8::OneOrEight;
use super::{OnSheet, Phase};
use crate::locate::{Guess, at_time, locate, shorten_step};
use snaprod_systems::manifold::{Multivalued, Patch};
use snaprod_systems::solve::cost::Cost;
use snaprod_systems::solve::roots::chandrupatla;
use snaprod_systems::solve::stepper::AcceptedStep;

/// Rate of time, as a part of the largest one in a step, below which time stands.
const STANDS: f64 = 1e-3;

/// The last step of a motion.
#[derive(Debug, Clone, Copy)]
pub struct LastStep<const N: usize> {
    /// Start of the step, in the global chart.
    pub from: Phase<N>,
    /// End of the step.
    pub to: Phase<N>,
    /// Bound of the acceleration of the body.
    pub acceleration: f64,
}

impl<'a, M: Multivalued<N>, const N: usize> OnSheet<'a, M, N> {
    /// The states inside the last step, as a function of the fraction of the step. None after a step without
    /// interpolant, as a stride over many turns of a shaking.
    pub fn inside(&mut self) -> Option<impl Fn(f64) -> Phase<N> + use<'a, M, N>> {
        if !self.shaking.single() {
            return None;
        }
        let mut step = self.last.clone()?;
        let (f, mut cost) = (self.right_hand_side(), Cost::default());
        let dense = step.interpolant(&mut self.both(f), &mut cost);
        let total = self.solver.cost_mut();
        *total = *total + cost;
        let (dense, manifold, patch) = (dense?, self.manifold, self.patch);
        Some(move |x| {
            let there = dense.at(x);
            let q = manifold.change_patch(&there.q, patch, Patch::Global);
            Phase { q, ..there }
        })
    }

    /// Ends the last step after this fraction of it. False, with the step unchanged, if the shorter step fails.
    pub fn end_after(&mut self, fraction: f64) -> bool {
        let Some(step) = self.last.clone() else {
            return false;
        };
        let (f, mut cost) = (self.right_hand_side(), Cost::default());
        let part = shorten_step(&step, &mut self.both(f), fraction, &mut cost);
        let total = self.solver.cost_mut();
        *total = *total + cost;
        let Some(part) = part else {
            return false;
        };
        self.dense = None;
        self.rewind(part);
        true
    }

    /// The last step: its ends, and a bound of the body's acceleration, seen from the clamp, by those at its stages.
    /// None after a step without interpolant.
    pub fn last_step(&self) -> Option<LastStep<N>> {
        let step = self.last.as_ref().filter(|_| self.shaking.single())?;
        let rates = step.stage_slopes().iter().map(|slope| slope.t);
        let least = STANDS * rates.fold(0.0, f64::max);
        let moving = (step.stage_slopes().iter()).filter(|slope| slope.t > least);
        let accelerations = moving.map(|slope| (slope.v / slope.t).norm());
        Some(LastStep {
            from: self.global(*step.from()),
            to: self.global(*step.to()),
            acceleration: accelerations.fold(0.0, f64::max),
        })
    }

    /// Ends the last step about the time `t`, where `event`, whose rate in time is `rate`, vanishes. False, with the
    /// step unchanged, if that fails.
    pub fn end_where(&mut self, t: f64, rate: f64, event: impl Fn(&Phase<N>) -> f64) -> bool {
        let Some(mut step) = self.last.clone() else {
            return false;
        };
        let (f, mut cost) = (self.right_hand_side(), Cost::default());
        let both = &mut self.both(f);
        let found = step.interpolant(both, &mut cost).and_then(|dense| {
            let left = |x: f64| dense.at(x).t - t;
            let (from, to) = (step.from().t - t, step.to().t - t);
            let x = chandrupatla(left, (0.0, from), (1.0, to), 0.0)?;
            let guess = Guess {
                h: x * step.h(),
                rate: rate * f(&dense.at(x))?.t,
                t,
            };
            Some(guess)
        });
        let (manifold, patch) = (self.manifold, self.patch);
        let event = |state: &Phase<N>, _: &Phase<N>| {
            let q = manifold.change_patch(&state.q, patch, Patch::Global);
            event(&Phase { q, ..*state })
        };
        let both = &mut self.both(f);
        let located = found.and_then(|guess| locate(&step, both, guess, event, &mut cost));
        let total = self.solver.cost_mut();
        *total = *total + cost;
        let Some(located) = located else {
            return false;
        };
        self.dense = None;
        self.rewind(located.step);
        true
    }

    /// Ends the last step about the time `t`. False, with the step unchanged, if that fails.
    pub fn end_at(&mut self, t: f64) -> bool {
        self.end_where(t, 1.0, |at| at.t - t)
    }

    /// Takes the last step back.
    pub fn take_back(&mut self) {
        if let Some(step) = self.last.take() {
            self.dense = None;
            self.solver.rewind(*step.from(), *step.start_slope());
        }
    }

    /// Corrects the current state, by amounts near rounding. False if the motion is not defined there.
    pub fn correct(&mut self, phase: Phase<N>) -> bool {
        let own = Phase {
            q: (self.manifold).change_patch(&phase.q, Patch::Global, self.patch),
            ..phase
        };
        let slope = self.right_hand_side()(&own);
        self.solver.cost_mut().evaluations += 1;
        slope.is_some_and(|slope| {
            self.solver.rewind(own, slope);
            true
        })
    }

    /// The state within the last step at which the stored energy is largest: the power on the rod changes
    /// from positive to negative. Evaluations are not counted as cost.
    pub fn at_largest_energy(&mut self) -> Option<Phase<N>> {
        if !self.shaking.single() {
            return None;
        }
        let mut step = self.last.clone()?;
        let (manifold, patch) = (self.manifold, self.patch);
        let power = |phase: &Phase<N>| {
            let at = manifold.point_in(patch, &phase.q);
            at.map_or(f64::NAN, |at| at.force.dot(&phase.v))
        };
        let f = self.right_hand_side();
        let both = &mut self.both(f);
        let cost = &mut Cost::default();
        let dense = step.interpolant(both, cost)?;
        let [before, after] = [step.from(), step.to()].map(power);
        let ends = ((0.0, before), (1.0, after));
        let x = chandrupatla(|x| power(&dense.at(x)), ends.0, ends.1, 0.0)?;
        if !matches!(step, AcceptedStep::Symmetric(_)) {
            return Some(self.global(dense.at(x)));
        }
        // On a long step the polynomial gives the fraction only; the state comes from an integrated step to it.
        let guess = Guess {
            h: x * step.h(),
            rate: (after - before) / step.h(),
            t: dense.at(x).t,
        };
        let found = locate(&step, both, guess, |state, _| power(state), cost)?;
        Some(self.global(*found.step.to()))
    }

    /// The state at the time `t` within the last step, as accurate as the steps are.
    pub fn at(&mut self, t: f64) -> Option<Phase<N>> {
        let f = self.right_hand_side();
        if self.shaking.glides() {
            return self.at_glide(t);
        }
        if self.shaking.strode()
            && let Some(step) = &self.last
            && step.from().t < t
            && t < step.to().t
        {
            return self.at_turn(t);
        }
        let mut cost = Cost::default();
        let eight = self.eight.as_mut().map(|eight| &mut eight.motion);
        let both = &mut OneOrEight { one: f, eight };
        let found = at_time(self.last.as_mut()?, &mut self.dense, both, t, &mut cost);
        let total = self.solver.cost_mut();
        *total = *total + cost;
        Some(Phase {
            t,
            ..self.global(found?)
        })
    }
}
