//! Derivatives of a motion of a point mass on the planar elastica by a parameter, through its snaps.
//!
//! In the desingularised time tau of `sheet` the state y = (q, v, t, ..) obeys y' = f(y, p), smooth through
//! folds. Its derivative d by p at fixed tau obeys
//! ```text
//! d' = f_y d + f_p.
//! ```
//! Both are integrated together. The products f_y d and f_p are central differences of f of the fourth order, f being
//! known to rounding: no solution is differenced. At a fixed time the derivative is d - y' d_t/t'.
//!
//! At a fold t' = 0, so that d_t is the derivative of the time of the snap. Place r and velocity of the body pass
//! through the snap. The place depends on the chart point by the Jacobian Dg, and Dg y'_q vanishes at the fold. The
//! chart point of the landing therefore has the derivative Dg_to^-1 Dg_from d_q.

use super::sheet::{Phase, slope_at};
use super::snap::orientation;
use nalgebra::{SVector, Vector2};
use snaprod_systems::body::PointMass;
use snaprod_systems::elastica::Elastica;
use snaprod_systems::error::{Error, Result};
use snaprod_systems::manifold::{EquilibriumManifold, Multivalued, Patch};
use snaprod_systems::solve::cost::Cost;
use snaprod_systems::solve::dop853::{Dop853, State, Step};
use snaprod_systems::solve::roots::chandrupatla;

/// Places of differences of the fourth order, in steps.
pub const BESIDE: [f64; 4] = [1.0, -1.0, 2.0, -2.0];
/// Weights of the values there.
const WEIGHTS: [f64; 4] = [8.0 / 12.0, -8.0 / 12.0, -1.0 / 12.0, 1.0 / 12.0];
/// Step along the derivative of the state. Rounding enters divided by the step, truncation with the fourth power of
/// the step. Next to folds 1e-4 leaves ten times, 3e-3 a hundred times the error.
const ALONG: f64 = 1e-3;
/// Most steps.
const STEPS: usize = 1_000_000;
/// Newton steps that bring the landing to the place of the fold.
const POLISH: usize = 2;

/// Derivative of a linear quantity from its values at [`BESIDE`] times the step.
pub fn difference<S: State>(values: &[S; 4], zero: S, step: f64) -> S {
    let mut sum = zero;
    for (value, weight) in values.iter().zip(WEIGHTS) {
        sum.axpy(weight / step, value);
    }
    sum
}

/// The body of a motion at a value of the parameter, and at [`BESIDE`] times a step from there.
#[derive(Debug, Clone)]
pub struct VariedBody {
    /// At the value.
    pub body: PointMass<2>,
    /// Beside the value.
    pub beside: [PointMass<2>; 4],
    /// The step.
    pub step: f64,
}

/// A state with its derivative by the parameter at fixed tau.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Tangent {
    /// The state.
    pub at: Phase<2>,
    /// Derivative of the state.
    pub by: Phase<2>,
}

impl State for Tangent {
    fn axpy(&mut self, a: f64, x: &Self) {
        self.at.axpy(a, &x.at);
        self.by.axpy(a, &x.by);
    }

    fn mean_square(&self, from: &Self, to: &Self) -> f64 {
        let state = self.at.mean_square(&from.at, &to.at);
        // Times are judged absolutely, times of the derivative relative to their size.
        let scale = 1.0 + from.by.t.abs().max(to.by.t.abs());
        let mut by = self.by;
        by.t /= scale;
        0.5 * (state + by.mean_square(&from.by, &to.by))
    }
}

impl<const N: usize> Phase<N> {
    /// The state 0.
    pub(crate) fn zero() -> Self {
        Self {
            q: SVector::zeros(),
            v: SVector::zeros(),
            t: 0.0,
            work: 0.0,
            drag_loss: 0.0,
        }
    }

    /// Largest number of chart point, velocity and time.
    pub fn largest(&self) -> f64 {
        let all = self.q.iter().chain(&self.v).chain([&self.t]);
        all.fold(0.0, |most: f64, x| most.max(x.abs()))
    }

    /// The state moved by a times another.
    pub fn moved(&self, a: f64, by: &Self) -> Self {
        let mut moved = *self;
        moved.axpy(a, by);
        moved
    }
}

/// A state at a time.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct TimedTangent {
    /// The state.
    pub at: Phase<2>,
    /// Derivative of the state by the parameter at the fixed time.
    pub by: Phase<2>,
    /// Rate of change of the state in time.
    pub rate: Phase<2>,
}

/// End of an advance.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum Reached {
    /// The time asked for.
    Time(TimedTangent),
    /// A fold before it. The derivative is at fixed tau: that of t is the derivative of the time of the fold.
    Fold(Tangent),
}

/// A motion with its derivative by a parameter.
pub struct Sensitivity<'a> {
    bodies: &'a VariedBody,
    orientation: f64,
    tolerance: f64,
    solver: Dop853<Tangent>,
}

impl<'a> Sensitivity<'a> {
    /// A motion from `start` in the global chart. `tolerance` is that of the state and of its derivative.
    ///
    /// # Errors
    /// A start outside of the chart, or on a fold.
    pub fn new(bodies: &'a VariedBody, start: Tangent, tolerance: f64) -> Result<Self> {
        let orientation = orientation(&Elastica, &start.at.q)?;
        let first = tangent_slope(bodies, orientation, &start);
        let first = first.ok_or_else(|| Error::domain("the start lies outside the chart"))?;
        let rate = first.mean_square(&start, &start).sqrt();
        let h = 0.3 * tolerance.powf(0.125) / rate.max(0.1);
        Ok(Self {
            bodies,
            orientation,
            tolerance,
            solver: Dop853::new(start, first, h, tolerance),
        })
    }

    /// The motion up to the time `t`, or to the fold before.
    ///
    /// # Errors
    /// A state next to the straight rod, or a motion that is not resolved.
    pub fn advance(&mut self, t: f64) -> Result<Reached> {
        let (bodies, orientation) = (self.bodies, self.orientation);
        let f = |y: &Tangent| tangent_slope(bodies, orientation, y);
        let lost = || Error::no_convergence("the derivative of the motion is not resolved");
        for _ in 0..STEPS {
            let (state, first) = (*self.solver.state(), *self.solver.slope());
            if Elastica.better_patch(Patch::Global, &state.at.q) != Patch::Global {
                return Err(Error::ill_conditioned(
                    "the motion passes next to the straight rod, where its derivative is not followed; start it farther from there",
                ));
            }
            if state.at.t >= t {
                return Ok(Reached::Time(timed(&state, &first.at)));
            }
            let h_max = 4.0 * (t - state.at.t) / first.at.t.max(f64::MIN_POSITIVE);
            let mut step = self.solver.step(f, h_max).map_err(|_| lost())?;
            let (start, end) = (first.at.t, step.end_slope().at.t);
            if !(end > 0.0) {
                let fold = hit(&step, f, (start, end), |step| step.end_slope().at.t);
                step = fold.ok_or_else(lost)?;
                if step.to.at.t <= t {
                    return Ok(Reached::Fold(step.to));
                }
            }
            if step.to.at.t >= t {
                let ends = (state.at.t - t, step.to.at.t - t);
                let end = hit(&step, f, ends, |step| step.to.at.t - t).ok_or_else(lost)?;
                self.solver.rewind(end.to, *end.end_slope());
                return Ok(Reached::Time(timed(&end.to, &end.end_slope().at)));
            }
        }
        Err(lost())
    }

    /// Goes on from a fold at its landing near the chart point `q`; gives the derivative of the place there.
    ///
    /// # Errors
    /// A landing outside of the chart, or on a fold.
    pub fn land(&mut self, fold: &Tangent, q: &Vector2<f64>) -> Result<Vector2<f64>> {
        let outside = || Error::domain("a landing outside of the chart");
        let from = Elastica.point(&fold.at.q).ok_or_else(outside)?;
        let by_place = from.jacobian * fold.by.q;
        let mut to = *q;
        for _ in 0..POLISH {
            let there = Elastica.point(&to).ok_or_else(outside)?;
            let inverse = there.jacobian.try_inverse().ok_or_else(outside)?;
            to += inverse * (from.pose - there.pose);
        }
        let there = Elastica.point(&to).ok_or_else(outside)?;
        let inverse = there.jacobian.try_inverse().ok_or_else(outside)?;
        let landed = Tangent {
            at: Phase { q: to, ..fold.at },
            by: Phase {
                q: inverse * by_place,
                ..fold.by
            },
        };
        *self = Self::new(self.bodies, landed, self.tolerance)?;
        Ok(by_place)
    }
}

/// State and derivative at the fixed time, from those at fixed tau.
fn timed(y: &Tangent, slope: &Phase<2>) -> TimedTangent {
    let rate = Phase::zero().moved(1.0 / slope.t, slope);
    TimedTangent {
        at: y.at,
        by: y.by.moved(-y.by.t, &rate),
        rate,
    }
}

/// The step ended where `of` vanishes; `ends` are its values at both ends.
fn hit(
    step: &Step<Tangent>,
    f: impl Fn(&Tangent) -> Option<Tangent> + Copy,
    ends: (f64, f64),
    of: impl Fn(&Step<Tangent>) -> f64,
) -> Option<Step<Tangent>> {
    let mut cost = Cost::default();
    let mut redone = |h: f64| step.redo(f, h, &mut cost);
    let value = |h: f64| redone(h).map_or(f64::NAN, |step| of(&step));
    let h = chandrupatla(value, (0.0, ends.0), (step.h, ends.1), 0.0)?;
    step.redo(f, h, &mut Cost::default())
}

/// The right-hand side of state and derivative. The bodies beside share the equilibrium of the rod.
fn tangent_slope(bodies: &VariedBody, orientation: f64, y: &Tangent) -> Option<Tangent> {
    let point = Elastica.point_in(Patch::Global, &y.at.q)?;
    let f = |body: &PointMass<2>| slope_at(&point, body, None, None, orientation, &y.at);
    let at = f(&bodies.body)?;
    let zero = Phase::zero();
    let mut beside = [zero; 4];
    for (value, body) in beside.iter_mut().zip(&bodies.beside) {
        *value = f(body)?;
    }
    let mut by = difference(&beside, zero, bodies.step);
    let size = y.by.largest();
    if size > 0.0 {
        let h = ALONG / size;
        for (value, place) in beside.iter_mut().zip(BESIDE) {
            let moved = y.at.moved(place * h, &y.by);
            let point = Elastica.point_in(Patch::Global, &moved.q)?;
            *value = slope_at(&point, &bodies.body, None, None, orientation, &moved)?;
        }
        by.axpy(1.0, &difference(&beside, zero, h));
    }
    Some(Tangent { at, by })
}
