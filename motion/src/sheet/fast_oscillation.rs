//! The shaking of a body next to the straight rod: when many turns are made at once, and what is done if it does not shake.

use super::multi_period::{FEWEST, LONGEST, Strides, Turns};
use super::slow_beam::{Glide, Gliding};
use super::{OnSheet, Phase, Progress, locate};
use snaprod_systems::manifold::{Multivalued, Patch};
use snaprod_systems::solve::cost::Cost;
use snaprod_systems::solve::stepper::{Inside, Taken};

/// Turns made one by one after a stride that failed; each further failure doubles them, up to the second number.
const PATIENCE: (u32, u32) = (16, 1024);

/// What a motion knows of its shaking.
pub(super) struct Shaking<const N: usize> {
    /// Its last turning point.
    turned: Option<Phase<N>>,
    /// Turns to be made one by one before strides are tried again, and how many the next failure costs.
    patience: (u32, u32),
    /// While many turns are made at once.
    strides: Option<Strides<N>>,
    /// While it glides by without shaking.
    glide: Option<Glide<N>>,
    /// What the last step was.
    last: Kind,
}

/// What a step is.
#[derive(Debug, Clone, Copy, PartialEq)]
enum Kind {
    /// One in a chart.
    Single,
    /// Many turns.
    Stride,
    /// Of a motion that does not shake.
    Glide,
}

impl<const N: usize> Default for Shaking<N> {
    fn default() -> Self {
        Self {
            turned: None,
            patience: (0, PATIENCE.0),
            strides: None,
            glide: None,
            last: Kind::Single,
        }
    }
}

impl<const N: usize> Shaking<N> {
    /// True if the last step made many turns.
    pub fn strode(&self) -> bool {
        self.last == Kind::Stride
    }

    /// True if the last step was one of a motion that does not shake.
    pub fn glides(&self) -> bool {
        self.last == Kind::Glide
    }

    /// True if the last step was one in a chart.
    pub fn single(&self) -> bool {
        self.last == Kind::Single
    }

    /// Goes on without shaking.
    pub fn glide_by(&mut self, glide: Glide<N>) {
        *self = Self {
            glide: Some(glide),
            last: Kind::Glide,
            ..Self::default()
        };
    }

    /// While it does not shake.
    pub fn glide(&self) -> Option<&Glide<N>> {
        self.glide.as_ref()
    }

    /// Turning points of another chart are none of this.
    pub fn forget(&mut self) {
        self.turned = None;
    }
}

impl<'a, M: Multivalued<N>, const N: usize> OnSheet<'a, M, N> {
    /// Where many turns of a shaking may be made at once.
    fn turns(&self) -> Option<Turns<'a, M, N>> {
        Some(Turns {
            manifold: self.manifold,
            body: self.body,
            patch: self.patch,
            orientation: self.orientation,
            along: self.manifold.shaking(self.patch)?,
        })
    }

    /// Makes many turns at once, if that is what the motion does; false if they are to be made one by one.
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
        self.last = Some(Taken::Explicit(step));
        self.shaking.last = Kind::Stride;
        self.shaking.patience = (0, PATIENCE.0);
        self.shaking.strides = Some(strides);
        true
    }

    /// Looks whether the last step ended a turn of a shaking, and if strides over many turns pay, ends it at the turning point and
    /// begins them.
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

    /// The state at a time within the last step, which made many turns.
    pub(super) fn at_turn(&mut self, t: f64) -> Option<Phase<N>> {
        let turns = self.turns()?;
        let strides = self.shaking.strides.as_ref()?;
        let Some(Taken::Explicit(step)) = self.last.as_mut() else {
            return None;
        };
        let mut cost = Cost::default();
        if self.dense.is_none() {
            let dense = strides.dense(&turns, step, &mut cost);
            self.dense = dense.map(Inside::Explicit);
        }
        let Some(Inside::Explicit(dense)) = &self.dense else {
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

    /// A step of a motion that does not shake; None if it does.
    pub fn glide(&mut self, end: f64) -> Option<Progress> {
        self.shaking.last = Kind::Single;
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
        self.shaking.last = Kind::Glide;
        self.last = None;
        Some(if charted.t >= end {
            Progress::Arrived
        } else {
            Progress::Moved
        })
    }

    /// The state at a time within the last step, of a motion that does not shake.
    pub(super) fn at_glide(&mut self, t: f64) -> Option<Phase<N>> {
        if t == self.time() {
            return Some(self.phase());
        }
        let gliding = self.gliding();
        let (patch, at) = self.shaking.glide.as_mut()?.at(&gliding, t)?;
        Some(Phase {
            q: self.manifold.carried(&at.q, patch, Patch::Global),
            ..at
        })
    }
}
