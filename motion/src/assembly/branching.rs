//! Branch points: a straight or symmetric rod buckles to either side alike (theory 3.3).
//!
//! At a fold the motion of the ends pushes a neutral rod. At a branch point nothing pushes it: u . xi = 0 for the
//! left null vector u of J. So q' = J^-1 xi stays finite, and the motion is smooth through det J = 0, where t' = det
//! J/d and the slopes by it would both vanish. Steps go there in plain time. Where the rod is neutral all round, det
//! J touches 0 without a change of sign, so the resistance in the neutral direction is watched instead.

use super::step::StepProgress;
use super::{AssemblyRun, StateVector};
use crate::event::{Event, Outcome};
use crate::locate::{Guess, Timed, locate};
use snaprod_systems::assembly::{LinkPoint, NeutralApproach, RodMonitor, SlowedTime};
use snaprod_systems::error::{Cause, Error, Message, Quantity};
use snaprod_systems::solve::cost::Cost;
use snaprod_systems::solve::stepper::AcceptedStep;

/// Largest push that counts as rounding. Pushes of small imperfections, such as an offset of the body of
/// 1e-6, are larger, and followed.
const ROUNDING: f64 = 1e-14;
/// Resistance that counts as zero, relative to the value at the start of the step.
const ZERO_RESISTANCE: f64 = 1e-6;
/// Singular values of J, in radians and lengths of the rod, that count as 0 next to the vanishing one.
const ALL_ROUND: f64 = 1e-6;

/// Directions in which a rod is neutral at a branch point.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) enum Crossing {
    /// One direction: the rod may buckle to either side.
    Sides,
    /// Two directions, as for a round column.
    AllRound,
}

impl AssemblyRun<'_> {
    /// The rods whose det J would vanish within `near` steps, at the rates of the last step from `before`.
    /// Rods without a push are added to `unpushed`.
    pub(super) fn falling(&mut self, before: &[RodMonitor], near: f64) -> Vec<usize> {
        let falling = |k: &usize| {
            let left = self.watch[*k].det / (before[*k].det - self.watch[*k].det);
            0.0 < left && left < near
        };
        let falling: Vec<usize> = (0..before.len()).filter(falling).collect();
        let unpushed = falling.iter().copied();
        self.unpushed = unpushed
            .filter(|k| self.unpushed(*k, before).is_some())
            .collect();
        falling
    }

    /// The next neutral direction of rod `k`, at the rates of the last step; None if the motion pushes the rod.
    fn unpushed(&self, k: usize, before: &[RodMonitor]) -> Option<NeutralApproach> {
        let next = self.watch[k].neutral_next(&before[k]);
        next.filter(|next| next.push <= ROUNDING)
    }

    /// Stops slowing time for rods without a push.
    pub(super) fn leave_to_branch_points(&mut self) -> Option<()> {
        let Some(slowed) = &self.slowed else {
            return Some(());
        };
        let rods = slowed.rods.iter().copied();
        let rods: Vec<_> = rods.filter(|(k, _)| !self.unpushed.contains(k)).collect();
        if rods.len() == slowed.rods.len() {
            return Some(());
        }
        let h = self.solver.next_step();
        let state = self.solver.state().clone();
        if rods.is_empty() {
            self.go_on(state, None, h * self.solver.slope().time())
        } else {
            self.go_on(state, Some(SlowedTime { rods }), h)
        }
    }

    /// Ends the step at the branch point of a rod without a push, if the step passed one. `before`: the rods
    /// at the start of the step.
    pub(super) fn branch_point(
        &mut self,
        step: &mut AcceptedStep<StateVector>,
        before: &[RodMonitor],
    ) -> Option<StepProgress> {
        let span = step.to().time() - step.from().time();
        let suspect =
            |k: &usize| self.unpushed.contains(k) || self.watch[*k].det * before[*k].det <= 0.0;
        let passed = (0..before.len()).filter(suspect).filter_map(|k| {
            let next = self.unpushed(k, before)?;
            (next.left <= 0.0).then_some((k, next))
        });
        let (k, next) = passed.min_by(|a, b| a.1.left.total_cmp(&b.1.left))?;
        let (assembly, along) = (self.taken_by.0.clone(), self.along());
        let seen = |state: &StateVector| {
            let mut sight = None;
            let mut slope = state.0.clone();
            let slowed = None;
            assembly.write_slope(&state.0, slowed, along, &mut slope, |rod, seen| {
                if rod == k {
                    sight = Some(seen);
                }
            });
            sight
        };
        let was = next.resistance(&before[k].jacobian);
        let resistance = |state: &StateVector, _: &StateVector| {
            seen(state).map_or(f64::NAN, |sight| next.resistance(&sight.jacobian) / was)
        };
        let h = (1.0 + next.left) * step.h();
        let guess = Guess {
            h,
            rate: -1.0 / h,
            t: step.from().time() + (1.0 + next.left) * span,
        };
        let mut cost = Cost::default();
        let found = locate(
            step,
            &mut { self.right_hand_side() },
            guess,
            resistance,
            &mut cost,
        );
        self.extra.evaluations += cost.evaluations;
        let found = found?;
        let to = found.step.to();
        let there = seen(to).filter(|_| resistance(to, to).abs() <= ZERO_RESISTANCE)?;
        *step = found.step;
        self.solver
            .rewind(step.to().clone(), step.end_slope().clone());
        self.watch[k] = there;
        Some(StepProgress::Fold {
            rods: vec![(k, before[k].det)],
            time_error: found.time_error,
            crossing: Some(if there.is_neutral_all_round(ALL_ROUND) {
                Crossing::AllRound
            } else {
                Crossing::Sides
            }),
        })
    }

    /// End of the run at the branch point of a rod that keeps to the unstable branch.
    pub(super) fn stay(&mut self, link: usize, point: &LinkPoint, crossing: Crossing) -> Event {
        let way = match crossing {
            Crossing::Sides => "to either side",
            Crossing::AllRound => "any way round",
        };
        let why = Message::from(self.assembly.rod_name(link).to_string())
            .words(" has come to its buckling load, a force of ")
            .number(point.end.force.norm(), Quantity::Force)
            .words(" and a couple of ")
            .number(point.end.base_couple.norm(), Quantity::Couple)
            .words(format!(
                " at its base: the rod is straight or symmetric and can buckle {way} alike here, so its direction of buckling is undetermined"
            ));
        let remedy = "add a small rest curvature, or a small offset of the body, in the plane of buckling: for a straight rod the plane in which it \
                      bends most easily";
        let at = self.solver.state().time();
        self.stop(Outcome::stuck(
            at,
            Cause::Failed(Error::domain(why)),
            remedy,
        ))
    }
}
