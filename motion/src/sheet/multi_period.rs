//! Strides over many turns of a fast oscillation.
//!
//! A mass at the small distance d from the straight rod shakes along the rod with a period of order d. Everything
//! else changes in times of order 1 (theory 2.3). At an inner turning point of the shaking the mass has no velocity
//! along the rod and starts outwards. The map M from one inner turning point to the next differs from the identity by
//! terms of order d. Up to terms exponentially small in 1/d it is the flow of a field, `M^n = exp(n F)`. F is slow,
//! and is found from the turns before and after by central differences,
//! ```text
//! F = (M - 1/M)/2 + O(d^3),     F = (8 (M - 1/M) - (M^2 - 1/M^2))/12 + O(d^5)
//! ```
//! The motion is integrated over the number n of turns, as smooth as if nothing shook. By differences no turn is
//! averaged: at every whole n the state is that of the motion itself, phase included, and each sampled turn is
//! integrated in full. Where a turn changes so little that differences lose its digits, F comes from averages over a
//! turn.

use super::{Phase, slope};
use crate::locate::{Guess, locate};
use nalgebra::SVector;
use snaprod_systems::body::PointMass;
use snaprod_systems::manifold::{Multivalued, Patch, adjugate_times};
use snaprod_systems::solve::cost::Cost;
use snaprod_systems::solve::dop853::{Dense, Dop853, State, Step};
use snaprod_systems::solve::roots::chandrupatla;
use snaprod_systems::solve::stepper::AcceptedStep;

/// Least number of turns of a stride; shorter ones do not repay their cost, of some fifty turns.
pub(super) const FEWEST: f64 = 100.0;
/// Turns left out before a break of the loads, before the end, and after the last break: the differences
/// reach over two turns on either side.
const MARGIN: f64 = 4.0;
/// Change in a turn up to which the short differences are used: their error is of its third power.
const SHORT: f64 = 1e-6;
/// Change in a turn above which strides are too short.
pub(super) const LONGEST: f64 = 1e-3;
/// Bound of the local error of the steps within a turn. Differences of turns enlarge the error by one over the
/// change in a turn.
const WITHIN: f64 = 1e-14;
/// Relative rounding error of a turn; the slow field is known to this over the change in a turn.
const NOISE: f64 = 1e-13;
/// Most steps of a turn, which takes some hundred.
const MOST_STEPS: usize = 5000;
/// Change in a turn up to which strides begin with averages over the turn, and up to which they keep them.
/// Averages leave out terms of its square, differences of turns lose the digits of their change.
const AVERAGED: [f64; 2] = [3e-7, 6e-7];
/// Time increment of the difference that gives the rate of the load along the rod.
const BRIEF: f64 = 1e-5;
/// First stride, as a part of the time in which the state changes by its own size.
const FIRST: f64 = 0.05;

/// The oscillation in one chart, with the direction of the shaking.
#[derive(Clone, Copy)]
pub(super) struct TurnMap<'a, M, const N: usize> {
    pub manifold: &'a M,
    pub body: &'a PointMass<N>,
    pub patch: Patch,
    pub orientation: f64,
    /// The direction of the shaking, outward.
    pub along: SVector<f64, N>,
}

/// Scales of the errors of a motion next to the straight rod.
#[derive(Debug, Clone, Copy)]
struct ErrorScales {
    /// Of velocities: the speed that holds all the energy of the motion.
    speed: f64,
    /// Of energies.
    energy: f64,
    /// Of times.
    time: f64,
}

impl ErrorScales {
    fn mean_square<const N: usize>(&self, error: &Phase<N>, at: &Phase<N>) -> f64 {
        let energies = error.work * error.work + error.drag_loss * error.drag_loss;
        // The pull is enormous at the outer turning points.
        let chart = |i: usize| (error.q[i] / (1.0 + at.q[i].abs())).powi(2);
        let sum = (0..N).map(chart).sum::<f64>()
            + error.v.norm_squared() / (self.speed * self.speed)
            + energies / (self.energy * self.energy)
            + (error.t / self.time).powi(2);
        sum / (2 * N + 1) as f64
    }
}

/// Source of the slow field F.
#[derive(Debug, Clone, Copy, PartialEq)]
enum FieldSource {
    /// Averages over a turn.
    Averaged,
    /// Differences over one turn before and after.
    Near,
    /// Differences over two turns before and after.
    Far,
}

/// A motion integrated in strides over turns.
pub(super) struct Strides<const N: usize> {
    solver: Dop853<Phase<N>>,
    sizes: ErrorScales,
    field: FieldSource,
}

impl<M: Multivalued<N>, const N: usize> TurnMap<'_, M, N> {
    /// True if the velocity along the rod turns from inward to outward between two states.
    pub fn turned(&self, from: &Phase<N>, to: &Phase<N>) -> bool {
        from.v.dot(&self.along) < 0.0 && to.v.dot(&self.along) >= 0.0
    }

    /// Guess of the step length, from a linear interpolation, at which a step ends at its turning point.
    pub fn guess(&self, step: &AcceptedStep<Phase<N>>) -> Guess {
        let (from, to) = (step.from(), step.to());
        let [a, b] = [from, to].map(|at| at.v.dot(&self.along));
        let share = if a == b { 1.0 } else { a / (a - b) };
        Guess {
            h: step.h() * share,
            rate: (b - a) / step.h(),
            t: from.t + share * (to.t - from.t),
        }
    }

    /// Change of everything but time from one turning point to the next, relative to its size.
    pub fn change(&self, from: &Phase<N>, to: &Phase<N>) -> Option<f64> {
        let sizes = self.sizes(to, 1.0)?;
        let v = (to.v - from.v) - self.along * (to.v - from.v).dot(&self.along);
        let change = (to.q - from.q).norm() + v.norm() / sizes.speed;
        Some(change.max(to.t - from.t))
    }

    fn sizes(&self, at: &Phase<N>, time: f64) -> Option<ErrorScales> {
        let stored = self.manifold.point_in(self.patch, &at.q)?.energy;
        let speed = (at.v.norm_squared() + 2.0 * stored / self.body.mass()).sqrt();
        Some(ErrorScales {
            speed,
            energy: 10.0 * self.body.mass() * speed * speed,
            time,
        })
    }

    /// Slope at the time `clock` + t, forward or (sense < 0) backward; None at a fold.
    fn slope(&self, clock: f64, sense: f64, y: &Phase<N>) -> Option<Phase<N>> {
        let now = Phase {
            t: clock + y.t,
            ..*y
        };
        let slope = slope(
            self.manifold,
            self.patch,
            self.body,
            None,
            None,
            self.orientation,
            &now,
        )?;
        let stays = slope.t > 0.0 && self.manifold.better_patch(self.patch, &y.q) == self.patch;
        let mut directed = slope;
        directed.axpy(sense - 1.0, &slope);
        stays.then_some(directed)
    }

    /// Integrates from `from` until `event` grows through zero. Times and energies of `from` count from 0 at
    /// the time `clock`.
    fn until(
        &self,
        from: &Phase<N>,
        clock: f64,
        sense: f64,
        sizes: ErrorScales,
        event: impl Fn(&Phase<N>) -> f64,
        cost: &mut Cost,
    ) -> Option<Phase<N>> {
        let f = |y: &Phase<N>| self.slope(clock, sense, y);
        let first = f(from)?;
        let rate = sizes.mean_square(&first, from).sqrt();
        let mut solver = Dop853::new(*from, first, 0.3 * WITHIN.powf(0.125) / rate, WITHIN);
        let mut step = solver.blank();
        let mut found = None;
        for _ in 0..MOST_STEPS {
            let written = |y: &Phase<N>, out: &mut Phase<N>| {
                *out = f(y)?;
                Some(())
            };
            let measure = |error: &Phase<N>, _: &_, to: &_| sizes.mean_square(error, to);
            if solver
                .step_measured(written, measure, f64::INFINITY, &mut step)
                .is_err()
            {
                break;
            }
            let (a, b) = (event(&step.from), event(&step.to));
            if a < 0.0 && b >= 0.0 {
                let share = a / (a - b);
                let guess = Guess {
                    h: step.h * share,
                    rate: (b - a) / step.h,
                    t: step.from.t + share * (step.to.t - step.from.t),
                };
                let step = AcceptedStep::Explicit(step);
                found = locate(&step, &mut { f }, guess, |at, _| event(at), cost)
                    .map(|at| *at.step.to());
                break;
            }
        }
        cost.evaluations += solver.cost().evaluations;
        found
    }

    /// The next turning point after (sense > 0) or before the turning point `from`.
    fn turn(
        &self,
        from: &Phase<N>,
        clock: f64,
        sense: f64,
        sizes: ErrorScales,
        cost: &mut Cost,
    ) -> Option<Phase<N>> {
        let event = |at: &Phase<N>| sense * at.v.dot(&self.along);
        let to = self.until(from, clock, sense, sizes, event, cost)?;
        Some(self.still(&to))
    }

    /// The turning point `at` with the rounding error removed from its velocity of shaking, whose sign would
    /// otherwise be mistaken.
    fn still(&self, at: &Phase<N>) -> Phase<N> {
        Phase {
            v: at.v - self.along * at.v.dot(&self.along),
            ..*at
        }
    }

    /// F at the turning point `at`, from averages over a turn that changes everything by less than `most`.
    /// The averages are dy = v T and dv = (f_y - <k> y) T/m. dE = <dE/dy> dy + <1 - x> df - loss gives the
    /// change of 1 - x. None where there are no averages.
    fn averaged(&self, at: &Phase<N>, most: f64) -> Option<Phase<N>> {
        let (body, mass) = (self.body, self.body.mass());
        if body.has_functions() {
            // The averages know the loss to drag along the rod, not that to a function of the motion.
            return None;
        }
        let across = self.manifold.axial_constraint(0.0)?.across;
        let point = self.manifold.point_in(self.patch, &at.q)?;
        let speed = at.v.dot(&across);
        let free = |t: f64| body.action(t, &point.pose, &(across * speed), &SVector::zeros());
        let load = |t: f64| mass * free(t).acceleration.dot(&self.along);
        let pulled = load(at.t);
        let turn = self.manifold.shaking_turn(self.patch, &at.q, pulled)?;
        let (height, period) = (turn.height, turn.period * mass.sqrt());
        let reach = turn.inner_shortening.sqrt().max(1.0) * height.abs();
        if !(period * (1.0 + speed.abs() / reach) < most) {
            return None;
        }
        let ahead = if body.next_break(at.t) > at.t + BRIEF {
            BRIEF
        } else {
            -BRIEF
        };
        let loading = (load(at.t + ahead) - pulled) / ahead;
        let loss = body.drag() / mass * turn.kinetic * height * height;
        let bent = height * speed * (turn.stiffness - turn.inner_stiffness);
        let moved = height * height * (turn.shortening - turn.inner_shortening) * loading;
        let inward = (bent + moved - loss) / (pulled - turn.inner_pull);
        let change = across * speed - self.along * inward;
        let (det, scaled) = adjugate_times(&point.jacobian, &change);
        let action = free(at.t);
        let rise = action.acceleration.dot(&across) - turn.stiffness * height / mass;
        Some(Phase {
            q: scaled * (period / det),
            v: across * (rise * period),
            t: period,
            work: action.power * period,
            drag_loss: (action.loss + loss) * period,
        })
    }

    /// F at the turning point `at`: the change in a turn.
    fn change_by_turn(
        &self,
        at: &Phase<N>,
        sizes: ErrorScales,
        field: FieldSource,
        cost: &mut Cost,
    ) -> Option<Phase<N>> {
        if field == FieldSource::Averaged {
            cost.evaluations += 1;
            return self.averaged(at, AVERAGED[1]);
        }
        let zero = Phase {
            t: 0.0,
            work: 0.0,
            drag_loss: 0.0,
            ..*at
        };
        let mut both = |of: [&Phase<N>; 2]| {
            let [ahead, behind] = [(of[0], 1.0), (of[1], -1.0)]
                .map(|(from, sense)| self.turn(from, at.t, sense, sizes, cost));
            Some([ahead?, behind?])
        };
        let [ahead, behind] = both([&zero, &zero])?;
        let mut change = ahead;
        change.axpy(-1.0, &behind);
        if field == FieldSource::Near {
            let whole = change;
            change.axpy(-0.5, &whole);
            return Some(change);
        }
        let [farther, far_behind] = both([&ahead, &behind])?;
        let nearer = change;
        change.axpy(8.0 / 12.0 - 1.0, &nearer);
        change.axpy(-1.0 / 12.0, &farther);
        change.axpy(1.0 / 12.0, &far_behind);
        Some(change)
    }
}

impl<const N: usize> Strides<N> {
    /// Begins strides at the turning point `at`, with turns of about `period`; None if strides do not pay.
    pub fn begin<M: Multivalued<N>>(
        turns: &TurnMap<'_, M, N>,
        at: &Phase<N>,
        period: f64,
        tolerance: f64,
        cost: &mut Cost,
    ) -> Option<Self> {
        let sizes = turns.sizes(at, period)?;
        let at = &turns.still(at);
        let size = |change: &Phase<N>| {
            let slow = Phase {
                t: 0.0,
                work: 0.0,
                drag_loss: 0.0,
                ..*change
            };
            sizes.mean_square(&slow, at).sqrt().max(change.t)
        };
        let mut field = FieldSource::Averaged;
        let (first, noise) = match turns.averaged(at, AVERAGED[0]) {
            Some(first) => (first, NOISE),
            None => {
                field = FieldSource::Near;
                let mut first = turns.change_by_turn(at, sizes, field, cost)?;
                if !(size(&first) < SHORT) {
                    field = FieldSource::Far;
                    first = turns.change_by_turn(at, sizes, field, cost)?;
                }
                (first, NOISE / size(&first))
            }
        };
        Some(Self {
            solver: Dop853::new(*at, first, FIRST / size(&first), tolerance.max(noise)),
            sizes,
            field,
        })
    }

    /// One stride of a whole number of turns, at most to a few turns before `end`; None if it would be too short.
    pub fn stride<M: Multivalued<N>>(
        &mut self,
        turns: &TurnMap<'_, M, N>,
        end: f64,
        cost: &mut Cost,
    ) -> Option<Step<Phase<N>>> {
        let now = *self.solver.state();
        let period = self.solver.slope().t;
        let end = end.min(turns.body.next_break(now.t - MARGIN * period));
        let mut most = ((end - now.t) / period - MARGIN).floor();
        let sizes = self.sizes;
        let slow = ErrorScales { time: 1.0, ..sizes };
        loop {
            most = most.min(self.solver.next_step().floor());
            if !(most >= FEWEST) {
                return None;
            }
            let mut f = |y: &Phase<N>| turns.change_by_turn(y, sizes, self.field, cost);
            let mut step = self.solver.blank();
            let before = *self.solver.slope();
            let written = |y: &Phase<N>, out: &mut Phase<N>| {
                *out = f(y)?;
                Some(())
            };
            let measure = |error: &Phase<N>, _: &_, to: &_| slow.mean_square(error, to);
            self.solver
                .step_measured(written, measure, most, &mut step)
                .ok()?;
            if step.h.fract() != 0.0 {
                // The error control shortened the step.
                if step.h < FEWEST {
                    self.solver.rewind(now, before);
                    return None;
                }
                let mut again = Cost::default();
                let Some(whole) = step.redo(&mut f, step.h.floor(), &mut again) else {
                    self.solver.rewind(now, before);
                    return None;
                };
                step = whole;
            }
            let slope = *step.end_slope();
            if step.to.t + MARGIN * slope.t < end {
                self.solver.rewind(step.to, slope);
                self.sizes.time = slope.t;
                if let Some(sizes) = turns.sizes(&step.to, slope.t) {
                    self.sizes = sizes;
                }
                return Some(step);
            }
            self.solver.rewind(now, before);
            most = (0.9 * step.h * (end - now.t) / (step.to.t - now.t)).floor();
        }
    }

    /// Interpolates the turning points of `step`.
    pub fn dense<M: Multivalued<N>>(
        &self,
        turns: &TurnMap<'_, M, N>,
        step: &mut Step<Phase<N>>,
        cost: &mut Cost,
    ) -> Option<Dense<Phase<N>>> {
        let (sizes, field) = (self.sizes, self.field);
        let mut inner = Cost::default();
        let dense = step.dense(|y| turns.change_by_turn(y, sizes, field, cost), &mut inner);
        cost.samples += inner.samples;
        dense
    }

    /// The state at the time `t` within `step`, integrated from the last turning point before `t`.
    pub fn at<M: Multivalued<N>>(
        &self,
        turns: &TurnMap<'_, M, N>,
        step: &Step<Phase<N>>,
        dense: &Dense<Phase<N>>,
        t: f64,
        cost: &mut Cost,
    ) -> Option<Phase<N>> {
        let (from, to) = (step.from.t, step.to.t);
        let x = chandrupatla(|x| dense.at(x).t - t, (0.0, from - t), (1.0, to - t), 0.0)?;
        let mut whole = (x * step.h).floor();
        let mut before = dense.at(whole / step.h);
        if before.t > t && whole > 0.0 {
            whole -= 1.0;
            before = dense.at(whole / step.h);
        }
        let before = turns.still(&before);
        let since = t - before.t;
        if !(since > 0.0) {
            return Some(Phase { t, ..before });
        }
        let start = Phase {
            t: 0.0,
            work: 0.0,
            drag_loss: 0.0,
            ..before
        };
        let reached = turns.until(&start, before.t, 1.0, self.sizes, |at| at.t - since, cost)?;
        Some(Phase {
            t,
            work: before.work + reached.work,
            drag_loss: before.drag_loss + reached.drag_loss,
            ..reached
        })
    }
}
