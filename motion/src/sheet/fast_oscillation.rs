//! Longitudinal oscillation of a body next to the straight rod: strides over many turns, and glides without
//! oscillation.

use super::multi_period::{FEWEST, LONGEST, Strides, TurnMap};
use super::slow_beam::{Glide, Gliding};
use super::{OnSheet, Phase, Progress, locate};
use snaprod_systems::manifold::{Multivalued, Patch};
use snaprod_systems::solve::cost::Cost;
use snaprod_systems::solve::stepper::{AcceptedStep, StepInterpolant};

/// Turns integrated one by one after a failed stride; each further failure doubles the number, up to the second.
const PATIENCE: (u32, u32) = (16, 1024);

/// State of the search for strides and glides.
pub(super) struct Shaking<const N: usize> {
    /// The last turning point.
    turned: Option<Phase<N>>,
    /// Turns to integrate one by one before the next try of a stride, and the number after the next failure.
    patience: (u32, u32),
    /// Present during strides over many turns.
    strides: Option<Strides<N>>,
    /// Present during a glide, a motion without oscillation along the rod.
    glide: Option<Glide<N>>,
    /// Kind of the last step.
    last: StepKind,
}

/// Kind of a step.
#[derive(Debug, Clone, Copy, PartialEq)]
enum StepKind {
    /// A step in a chart.
    Single,
    /// A stride over many turns.
    Stride,
    /// A step of a glide, which does not oscillate along the rod.
    Glide,
}

impl<const N: usize> Default for Shaking<N> {
    fn default() -> Self {
        Self {
            turned: None,
            patience: (0, PATIENCE.0),
            strides: None,
            glide: None,
            last: StepKind::Single,
        }
    }
}

impl<const N: usize> Shaking<N> {
    /// True if the last step was a stride over many turns.
    pub fn strode(&self) -> bool {
        self.last == StepKind::Stride
    }

    /// True if the last step was one of a glide.
    pub fn glides(&self) -> bool {
        self.last == StepKind::Glide
    }

    /// True if the last step was one in a chart.
    pub fn single(&self) -> bool {
        self.last == StepKind::Single
    }

    /// Continues with `glide`.
    pub fn glide_by(&mut self, glide: Glide<N>) {
        *self = Self {
            glide: Some(glide),
            last: StepKind::Glide,
            ..Self::default()
        };
    }

    /// The current glide; None during other motions.
    pub fn glide(&self) -> Option<&Glide<N>> {
        self.glide.as_ref()
    }

    /// Drops the last turning point: it belongs to another chart.
    pub fn forget(&mut self) {
        self.turned = None;
    }
}

impl<'a, M: Multivalued<N>, const N: usize> OnSheet<'a, M, N> {
    /// The map over turns in the present chart; None if the chart has no shaking direction.
    fn turns(&self) -> Option<TurnMap<'a, M, N>> {
        Some(TurnMap {
            manifold: self.manifold,
            body: self.body,
            patch: self.patch,
            orientation: self.orientation,
            along: self.manifold.shaking_direction(self.patch)?,
        })
    }

    /// Takes one stride over many turns if strides are under way; false if turns are to be integrated one by one.
    pub(super) fn stride(&mut self, end: f64) -> bool {
        let Some(mut strides) = self.shaking.strides.take() else {
            return false;
        };
        let Some(turns) = self.turns() else {
            return false;
        };
        let mut cost = Cost::default();
        let step = strides.stride(&turns, end, &mut cost);
        self.solver.cost_mut().evaluations += cost.evaluations;
        let slope = (step.as_ref()).and_then(|step| self.right_hand_side()(&step.to));
        let (Some(step), Some(slope)) = (step, slope) else {
            return false;
        };
        self.solver.cost_mut().steps += 1;
        self.solver.rewind(step.to, slope);
        self.dense = None;
        self.last = Some(AcceptedStep::Explicit(step));
        self.shaking.last = StepKind::Stride;
        self.shaking.patience = (0, PATIENCE.0);
        self.shaking.strides = Some(strides);
        true
    }

    /// Detects the end of a turn of a shaking in the last step. If strides over many turns pay, the step is
    /// ended at the turning point and the strides begin.
    pub(super) fn look_for_turns(&mut self, end: f64) {
        let Some(turns) = self.turns() else {
            return;
        };
        let Some(step) = self.last.as_ref() else {
            return;
        };
        if !turns.turned(step.from(), step.to()) {
            return;
        }
        let guess = turns.guess(step);
        let f = self.right_hand_side();
        let mut cost = Cost::default();
        let along = |at: &Phase<N>| at.v.dot(&turns.along);
        let located = locate(step, &mut { f }, guess, |at, _| along(at), &mut cost);
        *self.solver.cost_mut() = self.solver.cost() + cost;
        let Some(located) = located else {
            return;
        };
        let here = *located.step.to();
        let Some(before) = self.shaking.turned.replace(here) else {
            return;
        };
        if self.shaking.patience.0 > 0 {
            self.shaking.patience.0 -= 1;
            return;
        }
        let period = here.t - before.t;
        let far = end.min(self.body.next_break(here.t)) - here.t > 2.0 * FEWEST * period;
        let slow = turns
            .change(&before, &here)
            .is_some_and(|change| change < LONGEST);
        if !(far && slow) {
            return;
        }
        self.rewind(located.step);
        let mut cost = Cost::default();
        self.shaking.strides = Strides::begin(&turns, &here, period, self.tolerance, &mut cost);
        self.solver.cost_mut().evaluations += cost.evaluations;
        self.shaking.patience = (
            self.shaking.patience.1,
            (2 * self.shaking.patience.1).min(PATIENCE.1),
        );
    }

    /// The state at the time `t` within the last step, a stride over many turns.
    pub(super) fn at_turn(&mut self, t: f64) -> Option<Phase<N>> {
        let turns = self.turns()?;
        let strides = self.shaking.strides.as_ref()?;
        let Some(AcceptedStep::Explicit(step)) = self.last.as_mut() else {
            return None;
        };
        let mut cost = Cost::default();
        if self.dense.is_none() {
            let dense = strides.dense(&turns, step, &mut cost);
            self.dense = dense.map(StepInterpolant::Explicit);
        }
        let Some(StepInterpolant::Explicit(dense)) = &self.dense else {
            return None;
        };
        let at = strides.at(&turns, step, dense, t, &mut cost);
        *self.solver.cost_mut() = self.solver.cost() + cost;
        at.map(|at| self.global(at))
    }

    pub(super) fn gliding(&self) -> Gliding<'a, M, N> {
        Gliding {
            manifold: self.manifold,
            body: self.body,
            rod: self.rod.map(|rod| rod.rod),
        }
    }

    /// One step of a glide; None if the motion oscillates along the rod.
    pub fn glide(&mut self, end: f64) -> Option<Progress> {
        self.shaking.last = StepKind::Single;
        if self.patch == Patch::Global {
            return None;
        }
        let (gliding, now) = (self.gliding(), self.solver.state());
        let mut glide = match self.shaking.glide.take() {
            Some(glide) => glide,
            None if self.rod.is_some() => return None,
            None => gliding.begin(self.patch, now, self.tolerance)?,
        };
        let before = glide.evaluations();
        let limit = end.min(self.body.next_break(self.time()));
        let (patch, charted) = glide.step(&gliding, limit)?;
        let slope = super::slope(
            self.manifold,
            patch,
            self.body,
            None,
            None,
            self.orientation,
            &charted,
        )?;
        self.patch = patch;
        self.solver.rewind(charted, slope);
        let cost = self.solver.cost_mut();
        cost.evaluations += glide.evaluations() - before;
        cost.steps += 1;
        self.shaking.forget();
        self.shaking.strides = None;
        self.shaking.glide = Some(glide);
        self.shaking.last = StepKind::Glide;
        self.last = None;
        Some(if charted.t >= end {
            Progress::Arrived
        } else {
            Progress::Moved
        })
    }

    /// The state at the time `t` within the last step, one of a glide.
    pub(super) fn at_glide(&mut self, t: f64) -> Option<Phase<N>> {
        if t == self.time() {
            return Some(self.phase());
        }
        let gliding = self.gliding();
        let (patch, at) = self.shaking.glide.as_mut()?.at(&gliding, t)?;
        Some(Phase {
            q: self.manifold.change_patch(&at.q, patch, Patch::Global),
            ..at
        })
    }
}
