//! Steps of an assembly: plain ones, slowed ones near a fold, and their ends at events.

use super::branching::Crossing;
use super::{AssemblyRun, StateVector, first_step};
use crate::event::Outcome;
use crate::groove_turning_points::turning_fraction;
use crate::locate::{Guess, Located, Timed, at_time, end_at_zero, first_fold, locate, seen_inside};
use nalgebra::DVector;
use snaprod_systems::assembly::{Contact, Nearness, RodMonitor, SlowedTime};
use snaprod_systems::body::Groove;
use snaprod_systems::solve::cost::Cost;
use snaprod_systems::solve::stepper::AcceptedStep;

/// Number of steps until det J of a rod would vanish, at its present rate, below which time is slowed for the rod.
const NEAR: f64 = 8.0;
/// Ratio of det J to its value at the start of slowed time, above which time runs plainly again.
const FAR: f64 = 4.0;
/// Tolerance of the end of a slowed step in time, relative to 1 + the time.
const ON_TIME: f64 = 1e-12;
/// Tolerance of the end of a plain step in time: a pulse may be short enough for 1e-12 to count.
const ROUNDING: f64 = 4.0 * f64::EPSILON;
/// det J, relative to its value where time began to be slowed, above which the end of a rod determines its
/// chart well.
const CLEAR: f64 = 0.1;
/// Drift of rod ends, in local tolerances, at which charts are brought back to the poses of the bodies.
const DRIFTED: f64 = 3.0;
/// Gap, in tolerances, beyond which a rod is too taut for the chart of the base wrench.
pub(super) const LOOSE: f64 = 1e3;

/// Outcome of a step.
pub(super) enum StepProgress {
    Moved,
    Arrived,
    /// At the folds of these rods.
    Fold {
        rods: Vec<(usize, f64)>,
        time_error: f64,
        /// The kind of branch point, if the rod is at one, where nothing pushes it.
        crossing: Option<Crossing>,
    },
    /// At an end of the run.
    End(Outcome),
}

impl<'a> AssemblyRun<'a> {
    /// Takes one step of at most `h_max`; it is kept for interpolation.
    fn take_step(&mut self, h_max: f64) -> Option<AcceptedStep<StateVector>> {
        let (assembly, along, slowed) = (&self.assembly, self.along(), self.slowed.as_ref());
        let held = self.held_contacts();
        let (watch, until) = (&mut self.watch, self.until);
        let f = |y: &StateVector, out: &mut StateVector| {
            let y = y.seen(until);
            let reactions = held.as_ref().map(|held| held as _);
            let see = |k: usize, sight| watch[k] = sight;
            assembly.write_slope_under(reactions, &y.0, slowed, along, &mut out.0, see)
        };
        self.dense = None;
        self.taken_by = (self.assembly.clone(), self.slowed.clone());
        self.solver.step(f, h_max).ok()
    }

    /// Sets the latest time at which loads and supports are evaluated. In slowed time the stages of a step may lie
    /// behind the break at which the step is to end, where loads jump. They take the values just before the break.
    pub(super) fn look_until(&mut self, until: f64) -> Option<()> {
        if until == self.until {
            return Some(());
        }
        self.until = until;
        self.see()
    }

    /// Evaluates the rods at the solver's state: the last evaluation may lie behind the moment to which a
    /// step was shortened.
    fn see(&mut self) -> Option<()> {
        let state = self.solver.state().clone();
        let mut slope = state.clone();
        let held = self.held_contacts();
        let (slowed, along, watch) = (self.slowed.as_ref(), self.along(), &mut self.watch);
        let seen = state.seen(self.until);
        let reactions = held.as_ref().map(|held| held as _);
        let see = |k: usize, sight| watch[k] = sight;
        self.assembly
            .write_slope_under(reactions, &seen.0, slowed, along, &mut slope.0, see)?;
        self.extra.evaluations += 1;
        self.solver.rewind(state, slope);
        Some(())
    }

    /// One step, at most to time `end`, or to a fold if that comes first. None: the step size has collapsed.
    pub(super) fn advance_to(&mut self, end: f64) -> Option<StepProgress> {
        self.booked = 0.0;
        let watched = self.watch.clone();
        let before: Vec<f64> = watched.iter().map(|rod| rod.det).collect();
        let from = self.solver.state().clone();
        let left = end - from.time();
        let implicit = if self.is_implicit() {
            self.implicit_step(left)
        } else {
            None
        };
        let is_implicit = implicit.is_some();
        if self.slowed.is_some() {
            return self.slow_step(end);
        }
        let Some(mut step) = implicit.or_else(|| self.take_step(left)) else {
            // A fold may be too near for plain steps: slow the rod whose det J fell most.
            let nearest = (0..before.len()).max_by(|a, b| {
                let fall = |k: &usize| (1.0 - self.watch[*k].det / before[*k]).abs();
                fall(a).total_cmp(&fall(b))
            })?;
            self.slow(from, nearest, &before)?;
            return self.slow_step(end);
        };
        let branching = self.branch_point(&mut step, &watched);
        let crossed = (0..before.len()).find(|k| self.watch[*k].det * before[*k] <= 0.0);
        if let Some(link) = crossed.filter(|_| branching.is_none()) {
            self.slow(from, link, &before)?;
            return self.slow_step(end);
        }
        self.judge(&step, 1.0);
        let h = step.h();
        let arrived = branching.is_none()
            && (h >= left || (end - step.to().time()).abs() <= ROUNDING * (1.0 + end));
        if arrived {
            *step.to_mut() = step.to().clone().at_time(end);
        }
        if let Some(progress) = self.cut(&mut step) {
            self.step = Some(step);
            self.implicit.forget();
            self.see();
            return progress;
        }
        if arrived {
            self.solver
                .rewind(step.to().clone(), step.end_slope().clone());
        }
        let to = step.to().clone();
        self.step = Some(step);
        if branching.is_some() {
            return branching;
        }
        self.hold()?;
        if !self.update_charts() && !is_implicit {
            let near = NEAR * self.solver.next_step() / h;
            let falling = self.falling(&watched, near);
            if let Some(link) = falling.into_iter().find(|k| !self.unpushed.contains(k)) {
                let dets: Vec<f64> = self.watch.iter().map(|rod| rod.det).collect();
                self.slow(to, link, &dets)?;
            } else if self.solver.is_symmetric() && self.unpushed.is_empty() {
                self.resume(to, None, h)?;
            }
        }
        Some(if arrived {
            StepProgress::Arrived
        } else {
            StepProgress::Moved
        })
    }

    /// Largest drift of rod ends that is not corrected.
    pub(super) fn drifted(&self) -> f64 {
        DRIFTED * self.local()
    }

    /// Brings the charts back to the poses of the bodies after a drift.
    fn hold(&mut self) -> Option<()> {
        if !self.watch.iter().any(|rod| rod.gap > self.drifted()) {
            return Some(());
        }
        let state = self.solver.state().clone();
        let at = self.assembly.evaluated(&state.0, self.along())?;
        self.extra.evaluations += 1;
        let held = self.assembly.close_gaps(state.0, &at)?;
        let h = self.solver.next_step();
        self.resume(StateVector(held), self.slowed.clone(), h)
    }

    /// The rod whose end cannot be held, if there is one: its number, its gap, and sqrt(F L^2/B).
    pub(super) fn loose(&self) -> Option<(usize, f64, f64)> {
        let off = |rod: &RodMonitor| rod.gap > LOOSE * self.options.tolerance;
        let link = self.watch.iter().position(off)?;
        let slots = self.assembly.chart_slots(link);
        let force = self.solver.state().0.rows(slots.start + 3, 3).norm();
        Some((link, self.watch[link].gap, force.sqrt()))
    }

    /// One step in time slowed for the rods near a fold.
    fn slow_step(&mut self, end: f64) -> Option<StepProgress> {
        self.taken_by = (self.assembly.clone(), self.slowed.clone());
        let f = &self.right_hand_side();
        let remaining = end - self.solver.state().time();
        let mut h_max = 4.0 * remaining / self.solver.slope().time().max(1e-3);
        let watched = self.watch.clone();
        let before: Vec<f64> = watched.iter().map(|rod| rod.det).collect();
        let mut cost = Cost::default();
        let (mut step, fold) = loop {
            let Some(mut step) = self.take_step(h_max) else {
                let state = self.solver.state().clone();
                let rods = self.at_folds(&state, false)?;
                if rods.is_empty() {
                    return None;
                }
                let time_error = ON_TIME * (1.0 + state.time());
                let h = first_step(&state, self.solver.slope(), self.options.tolerance);
                self.resume(state, self.slowed.clone(), h)?;
                return Some(StepProgress::Fold {
                    rods,
                    time_error,
                    crossing: None,
                });
            };
            let fold = first_fold(&mut step, &mut { f }, &mut cost).and_then(|guess| {
                locate(&step, &mut { f }, guess, |_, slope| slope.time(), &mut cost)
            });
            if fold.is_some() || step.end_slope().time() > 0.0 {
                break (step, fold);
            }
            // Time turned back and the fold was not found: it must be in a shorter step.
            self.solver
                .rewind(step.from().clone(), step.start_slope().clone());
            h_max = 0.5 * step.h();
        };
        // Behind a fold time runs backward: `end` is sought before the fold.
        let folded = fold.map(|fold| {
            step = fold.step;
            fold.time_error
        });
        let mut progress = StepProgress::Moved;
        if step.to().time() >= end {
            let passed = step.to().time() - step.from().time();
            let guess = Guess {
                h: step.h() * remaining / passed,
                rate: passed / step.h(),
                t: end,
            };
            let missing = |state: &StateVector, _: &StateVector| state.time() - end;
            let found = locate(&step, &mut { f }, guess, missing, &mut cost);
            let near = ON_TIME * (1.0 + end);
            let hit = |found: &Located<StateVector>| (found.step.to().time() - end).abs() <= near;
            let Some(found) = found.filter(hit) else {
                // The state is unchanged.
                self.solver
                    .rewind(step.from().clone(), step.start_slope().clone());
                self.see();
                return None;
            };
            step = found.step;
            *step.to_mut() = step.to().clone().at_time(end);
            progress = StepProgress::Arrived;
        } else if let Some(time_error) = folded {
            progress = StepProgress::Fold {
                rods: self.at_folds(step.to(), true)?,
                time_error,
                crossing: None,
            };
        }
        self.extra.evaluations += cost.evaluations;
        self.extra.samples += cost.samples;
        let whole = matches!(progress, StepProgress::Moved);
        if !whole {
            self.solver
                .rewind(step.to().clone(), step.end_slope().clone());
            self.see()?;
        }
        let branching = self.branch_point(&mut step, &watched);
        if let Some(ended) = self.cut(&mut step) {
            self.step = Some(step);
            self.see();
            return ended;
        }
        if branching.is_some() {
            self.step = Some(step);
            return branching;
        }
        let (cause, scale) = self.slowed.as_ref()?.rods[0];
        let rate = self.watch[cause].det / scale;
        self.judge(&step, rate.abs());
        self.step = Some(step);
        if whole {
            self.falling(&watched, NEAR);
            self.leave_to_branch_points()?;
        }
        if whole && rate > CLEAR {
            self.hold()?;
            self.update_charts();
        }
        self.reconsider(&before, rate)?;
        Some(progress)
    }

    /// Chooses the rods for which time is slowed; none once explicit steps do without.
    fn reconsider(&mut self, before: &[f64], rate: f64) -> Option<()> {
        let Some(slowed) = &self.slowed else {
            return Some(());
        };
        let state = self.solver.state().clone();
        let h = self.solver.next_step();
        if !self.solver.is_symmetric() {
            return if rate > FAR {
                self.resume(state, None, rate * h)
            } else {
                Some(())
            };
        }
        // Number of steps until det J vanishes, at its present rate.
        let left = |k: usize| match self.watch[k].det / (before[k] - self.watch[k].det) {
            left if left > 0.0 => left,
            _ => f64::INFINITY,
        };
        let among = |k: usize| slowed.rods.iter().any(|(rod, _)| *rod == k);
        let all = (0..before.len()).filter(|k| !among(*k));
        let Some(next) = all.min_by(|a, b| left(*a).total_cmp(&left(*b))) else {
            return Some(());
        };
        let soonest = slowed.rods.iter().map(|(rod, _)| left(*rod));
        if left(next) < soonest.fold(NEAR, f64::min) {
            let scale = self.watch[next].det;
            return self.resume(state, Some(SlowedTime::one(next, scale)), h);
        }
        Some(())
    }

    /// det J of all rods in a state.
    fn determinants(&mut self, state: &StateVector) -> Option<Vec<f64>> {
        let at = self.assembly.evaluated(&state.0, self.along())?;
        self.extra.evaluations += 1;
        Some(self.assembly.fold_determinants(&at))
    }

    /// The rods at their folds in a state, each with its det J when time was last slowed. If time `stands`,
    /// the rod that makes it do so is one; others count if their folds differ in time by less than rounding.
    /// On the way to a fold det J goes with the root of the time left.
    fn at_folds(&mut self, to: &StateVector, stands: bool) -> Option<Vec<(usize, f64)>> {
        let after = self.determinants(to)?;
        let x = |(k, scale): &(usize, f64)| (after[*k] / scale).abs();
        let clock = self.slowed.iter().flat_map(|slowed| &slowed.rods);
        let least = clock.min_by(|a, b| x(a).total_cmp(&x(b)));
        let least = least.filter(|_| stands).map(|rod| rod.0);
        let (from, before) = &self.since;
        let now = |k: &usize| {
            let (was, is) = (before[*k] * before[*k], after[*k] * after[*k]);
            let left = is * (to.time() - from) / (was - is);
            let passed = after[*k] * before[*k] <= 0.0;
            let soon = is < 0.25 * was && left <= ON_TIME * (1.0 + to.time());
            Some(*k) == least || passed || soon
        };
        let rods = (0..after.len()).filter(now);
        Some(rods.map(|k| (k, before[k])).collect())
    }

    /// Shortens the step to its first event: a break or end of a groove, or a contact.
    fn cut(&mut self, step: &mut AcceptedStep<StateVector>) -> Option<Option<StepProgress>> {
        let knot = self.knot(step);
        if let Some(None) = knot {
            return knot;
        }
        let ended = self.touch(step).or(knot);
        if let Some(None) = ended {
            return ended;
        }
        self.hit(step).or(ended)
    }

    /// Shortens the step to the first event of a contact with an obstacle, or to the first touch of a rod.
    fn hit(&mut self, step: &mut AcceptedStep<StateVector>) -> Option<Option<StepProgress>> {
        self.among()?;
        let found = self.contact_in_step(step);
        if let Some(None) = found {
            return Some(None);
        }
        match self.rod_touch(step) {
            Some(touch) => Some(touch.map(StepProgress::End)),
            None => found.map(|_| Some(StepProgress::Moved)),
        }
    }

    /// Shortens the step to the first contact of rods.
    fn touch(&mut self, step: &mut AcceptedStep<StateVector>) -> Option<Option<StepProgress>> {
        if !self.assembly.looks_for_contacts() {
            return None;
        }
        let assembly = self.assembly.clone();
        let nearness = |state: &StateVector| {
            Nearness::at(&assembly, state.time(), &assembly.configuration(&state.0))
        };
        let after = nearness(step.to());
        let before = std::mem::replace(&mut self.near, after.clone());
        let touches = |contact: &Contact| contact.gap <= 0.0;
        let mut found = after.contact.filter(touches).map(|contact| (1.0, contact));
        let mut cost = Cost::default();
        // Within a step the gap falls below its end values by at most the distance moved by the rods.
        if before.gap().min(after.gap()) < before.moved(&after) {
            let f = self.right_hand_side();
            let look = |state: &StateVector| nearness(state).contact.filter(touches);
            let inside = seen_inside(step, &mut { f }, look, &mut cost);
            self.extra.evaluations += std::mem::take(&mut cost.evaluations);
            found = inside?.or(found);
        }
        let (part, contact) = found?;
        let gap = |state: &StateVector| {
            let now = assembly.configuration(&state.0);
            let there = contact.at(&assembly, state.time(), &now);
            there.map_or(1.0, |contact| contact.gap)
        };
        let f = self.right_hand_side();
        let shorter = end_at_zero(step, &mut { f }, (part, contact.gap), gap, &mut cost);
        self.extra.evaluations += cost.evaluations;
        let Some(shorter) = shorter else {
            return Some(None);
        };
        *step = shorter;
        self.solver
            .rewind(step.to().clone(), step.end_slope().clone());
        let now = assembly.configuration(&step.to().0);
        let there = contact.at(&assembly, step.to().time(), &now);
        let outcome = Outcome::SelfContact(there.unwrap_or(contact));
        Some(Some(StepProgress::End(outcome)))
    }

    /// The step shortened to the moment at which a body first turns back beyond the end of its groove; None
    /// if no body does.
    fn turned(
        &mut self,
        step: &mut AcceptedStep<StateVector>,
    ) -> Option<AcceptedStep<StateVector>> {
        let [from, to] =
            [step.from(), step.to()].map(|state| self.assembly.along_grooves(&state.0));
        let span = step.to().time() - step.from().time();
        let (assembly, f) = (&self.assembly, &self.right_hand_side());
        let mut cost = Cost::default();
        let mut dense = None;
        let turns = from.iter().zip(&to).enumerate();
        let turns = turns.filter_map(|(k, ((body, from), (_, to)))| {
            let ends = assembly.carriers()[*body].groove()?.ends()?;
            turning_fraction([*from, *to], span, ends, |x| {
                if dense.is_none() {
                    dense = step.interpolant(&mut { f }, &mut cost);
                }
                Some(assembly.along_grooves(&dense.as_ref()?.at(x).0)[k].1)
            })
        });
        let part = turns.reduce(f64::min);
        let shorter = part.and_then(|part| step.redo(&mut { f }, part * step.h(), &mut cost));
        self.extra.evaluations += cost.evaluations;
        shorter
    }

    /// First passage of a body over a break or an end of its groove in a step: the body, the parameter, the
    /// fraction of the step and the rate by h.
    fn passed(&self, step: &AcceptedStep<StateVector>) -> Option<(usize, f64, f64, f64)> {
        let [from, to] =
            [step.from(), step.to()].map(|state| self.assembly.along_grooves(&state.0));
        let passed = from
            .iter()
            .zip(&to)
            .filter_map(|((body, [a, _]), (_, [b, _]))| {
                let groove = self.assembly.carriers()[*body].groove()?;
                let left = groove.end_left(*a, *b);
                let knot = left.or_else(|| groove.first_break(*a, *b))?;
                // From an end a step may first lead inward; the passage is then its return.
                let part = match groove.way_out(*a) {
                    Some(way) if groove.way_out(knot) == Some(way) => 1.0,
                    _ => (knot - a) / (b - a),
                };
                Some((*body, knot, part, (b - a) / step.h()))
            });
        passed.min_by(|x, y| x.2.total_cmp(&y.2))
    }

    /// Shortens the step to the first passage of a break or an end of a groove.
    fn knot(&mut self, step: &mut AcceptedStep<StateVector>) -> Option<Option<StepProgress>> {
        if self.assembly.along_grooves(&step.from().0).is_empty() {
            return None;
        }
        let turned = self.turned(step);
        let back = turned
            .as_ref()
            .and_then(|part| Some((part, self.passed(part)?)));
        let (within, (body, knot, part, rate)) = match back {
            Some(back) => back,
            None => (&*step, self.passed(step)?),
        };
        let assembly = self.assembly.clone();
        let along = |state: &StateVector| {
            let all = assembly.along_grooves(&state.0);
            all.iter().find(|(b, _)| *b == body).map_or(0.0, |x| x.1[0])
        };
        let guess = Guess {
            h: part * within.h(),
            rate,
            t: step.from().time(),
        };
        let f = self.right_hand_side();
        let mut cost = Cost::default();
        let found = locate(
            within,
            &mut { f },
            guess,
            |state, _| along(state) - knot,
            &mut cost,
        );
        self.extra.evaluations += cost.evaluations;
        let Some(found) = found else {
            return Some(None);
        };
        *step = found.step;
        self.solver
            .rewind(step.to().clone(), step.end_slope().clone());
        let groove = self.assembly.carriers()[body].groove();
        let ends = groove.and_then(Groove::ends);
        let at_end = ends.is_some_and(|[a, b]| knot == a || knot == b);
        Some(Some(if at_end {
            StepProgress::End(Outcome::GrooveEnd(body))
        } else {
            StepProgress::Moved
        }))
    }

    /// The right-hand side of the last step.
    pub(super) fn right_hand_side(&self) -> impl Fn(&StateVector) -> Option<StateVector> + use<'a> {
        let ((assembly, slowed), along) = (self.taken_by.clone(), self.along());
        let (until, held) = (self.until, self.held_contacts());
        move |y: &StateVector| {
            let mut out = y.clone();
            assembly.write_slope_under(
                held.as_ref().map(|held| held as _),
                &y.seen(until).0,
                slowed.as_ref(),
                along,
                &mut out.0,
                |_, _| (),
            )?;
            Some(out)
        }
    }

    /// The state at a time within the last step.
    pub(super) fn inside(&mut self, t: f64) -> Option<DVector<f64>> {
        let f = self.right_hand_side();
        let mut cost = Cost::default();
        let found = at_time(
            self.step.as_mut()?,
            &mut self.dense,
            &mut { f },
            t,
            &mut cost,
        );
        self.extra.evaluations += cost.evaluations;
        self.extra.samples += cost.samples;
        Some(found?.at_time(t).0)
    }
}
