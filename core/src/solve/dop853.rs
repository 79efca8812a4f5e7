//! Explicit Runge-Kutta stepping of order 8 (DOP853) for autonomous systems.
//!
//! One struct, one step at a time; the caller loops, and looks between the stages for events. No crate tried locates
//! a directional event to 1e-12 or has a reliable dense output, hence our own. The coefficients are Hairer's;
//! `ode_solvers` is the oracle in the tests.

use super::cost::Cost;
use super::dop853_tableau::{DENSE, ERROR3, ERROR5, EXTRA, STAGES, STEP};
use nalgebra::{DVector, SVector};

/// State space of a Runge-Kutta method.
pub trait State: Clone {
    /// self += a x.
    fn axpy(&mut self, a: f64, x: &Self);

    /// Mean over the components of (self_i / scale_i)^2, scale_i = 1 + max(|from_i|, |to_i|), unless the state has a
    /// better scale.
    fn mean_square(&self, from: &Self, to: &Self) -> f64;
}

impl<const D: usize> State for SVector<f64, D> {
    fn axpy(&mut self, a: f64, x: &Self) {
        *self += a * x;
    }

    fn mean_square(&self, from: &Self, to: &Self) -> f64 {
        (0..D)
            .map(|i| (self[i] / (1.0 + from[i].abs().max(to[i].abs()))).powi(2))
            .sum::<f64>()
            / D as f64
    }
}

impl State for DVector<f64> {
    fn axpy(&mut self, a: f64, x: &Self) {
        DVector::axpy(self, a, x, 1.0);
    }

    fn mean_square(&self, from: &Self, to: &Self) -> f64 {
        let terms = self.iter().zip(from.iter().zip(to.iter()));
        let sum: f64 = terms
            .map(|(e, (a, b))| (e / (1.0 + a.abs().max(b.abs()))).powi(2))
            .sum();
        sum / self.len().max(1) as f64
    }
}

/// Error: no step could be taken.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct StepTooSmall;

/// Safety factor and bounds of a change of step size.
const SAFETY: f64 = 0.9;
const SHRINK: f64 = 0.2;
const GROW: f64 = 6.0;
/// Exponents of the controller err^-ALPHA err_old^BETA: a little memory halves the rejections.
const BETA: f64 = 0.04;
const ALPHA: f64 = 0.125 - 0.75 * BETA;
/// A step below this multiple of the largest step up to now has stalled.
const STALL: f64 = 1e-14;

/// An integration in progress: the state, its slope and the next step size.
#[derive(Debug, Clone)]
pub struct Dop853<S> {
    tolerance: f64,
    h: f64,
    largest: f64,
    last_error: f64,
    state: S,
    slope: S,
    cost: Cost,
}

/// An accepted step, with all data for repetition at another length and for interpolation.
#[derive(Debug, Clone)]
pub struct Step<S> {
    /// State at the start.
    pub from: S,
    /// State at the end.
    pub to: S,
    /// Length in the independent variable.
    pub h: f64,
    /// Slopes: 0 .. 11 the stages, 12 at the end, 13 .. 15 only for the dense output.
    slopes: [S; 16],
}

impl<S: State> Dop853<S> {
    /// Starts at `state` with its `slope`; the error control corrects the first step `h`.
    pub fn new(state: S, slope: S, h: f64, tolerance: f64) -> Self {
        Self {
            tolerance,
            h,
            largest: h,
            last_error: 1.0,
            state,
            slope,
            cost: Cost::default(),
        }
    }

    /// Starts anew at another state, of any dimension. The cost counters and the largest step, which defines a stall,
    /// carry over.
    pub fn restart(&mut self, state: S, slope: S, h: f64) {
        *self = Self {
            largest: self.largest.max(h),
            cost: self.cost,
            ..Self::new(state, slope, h, self.tolerance)
        };
    }

    /// Cost counters.
    pub fn cost(&self) -> Cost {
        self.cost
    }

    /// Cost counters, to be increased by the caller for evaluations made outside the steps.
    pub fn cost_mut(&mut self) -> &mut Cost {
        &mut self.cost
    }

    /// The current state.
    pub fn state(&self) -> &S {
        &self.state
    }

    /// The slope at the current state.
    pub fn slope(&self) -> &S {
        &self.slope
    }

    /// Length of the next trial step.
    pub fn next_step(&self) -> f64 {
        self.h
    }

    /// Takes one step of at most `h_max`. `f` is the right-hand side; None means outside its domain and shortens the
    /// step.
    pub fn step(
        &mut self,
        f: impl FnMut(&S) -> Option<S>,
        h_max: f64,
    ) -> Result<Step<S>, StepTooSmall> {
        let mut step = self.blank();
        self.step_into(writes_slope(f), h_max, &mut step)?;
        Ok(step)
    }

    /// An empty step for [`Dop853::step_into`] to fill.
    pub fn blank(&self) -> Step<S> {
        Step::blank(&self.state, &self.slope)
    }

    /// As [`Dop853::step`] for large states, which are costly to copy: the step is reused, and `f` writes the slope
    /// into its second argument (None: undefined).
    pub fn step_into(
        &mut self,
        f: impl FnMut(&S, &mut S) -> Option<()>,
        h_max: f64,
        step: &mut Step<S>,
    ) -> Result<(), StepTooSmall> {
        self.step_measured(f, S::mean_square, h_max, step)
    }

    /// As [`Dop853::step_into`], with errors measured by `mean_square(error, from, to)` instead of the state's own.
    pub fn step_measured(
        &mut self,
        mut f: impl FnMut(&S, &mut S) -> Option<()>,
        mean_square: impl Fn(&S, &S, &S) -> f64,
        h_max: f64,
        step: &mut Step<S>,
    ) -> Result<(), StepTooSmall> {
        let mut rejected = false;
        step.from.clone_from(&self.state);
        step.slopes[0].clone_from(&self.slope);
        loop {
            let h = self.h.min(h_max);
            if !(h > STALL * self.largest.min(h_max)) {
                return Err(StepTooSmall);
            }
            let error = match step.attempt(h, &mut f, &mut self.cost) {
                Some(()) => step.error(&mean_square) / self.tolerance,
                None => f64::INFINITY,
            };
            if error <= 1.0 {
                let mut factor =
                    SAFETY * error.max(1e-10).powf(-ALPHA) * self.last_error.max(1e-4).powf(BETA);
                factor = factor.clamp(SHRINK, if rejected { 1.0 } else { GROW });
                // A step cut short by `h_max` says little about the step that the error allows.
                self.h = if h < self.h {
                    self.h.max(h * factor)
                } else {
                    h * factor
                };
                self.largest = self.largest.max(h);
                self.last_error = error;
                self.cost.steps += 1;
                self.state.clone_from(&step.to);
                self.slope.clone_from(&step.slopes[12]);
                return Ok(());
            }
            rejected = true;
            self.cost.rejected += 1;
            let factor = SAFETY * error.powf(-0.125);
            self.h = h * if factor > SHRINK { factor } else { SHRINK };
        }
    }

    /// Moves the state back inside the last step, to a located event.
    pub fn rewind(&mut self, state: S, slope: S) {
        self.state = state;
        self.slope = slope;
    }
}

/// Number of stages of a step: the start included, the end not.
pub const COUNT: usize = 12;

/// Repeats a step of the length `h` for a quantity driven by the state without acting on it.
/// `slope(i, value, weight)` is the slope of the quantity at stage i; `weight` = h b_i (0 for most stages) serves to
/// sum integrals. Stages are those of [`Dop853::step_into`]: the start, and the eleven states at which the right-hand
/// side is evaluated before the end.
pub fn integrate_alongside<const D: usize>(
    from: &SVector<f64, D>,
    h: f64,
    mut slope: impl FnMut(usize, &SVector<f64, D>, f64) -> Option<SVector<f64, D>>,
) -> Option<SVector<f64, D>> {
    let mut slopes = [SVector::<f64, D>::zeros(); COUNT];
    let mut weights = [0.0; COUNT];
    for (i, a) in STEP {
        weights[*i] = h * a;
    }
    slopes[0] = slope(0, from, weights[0])?;
    for (i, row) in STAGES.iter().enumerate() {
        let at = row
            .iter()
            .fold(*from, |at, (j, a)| at + slopes[*j] * (h * a));
        slopes[i + 1] = slope(i + 1, &at, weights[i + 1])?;
    }
    let sum = weights.iter().zip(&slopes);
    Some(sum.fold(*from, |sum, (weight, slope)| sum + slope * *weight))
}

/// Converts a right-hand side with a returned slope to one with a written slope.
fn writes_slope<S>(mut f: impl FnMut(&S) -> Option<S>) -> impl FnMut(&S, &mut S) -> Option<()> {
    move |at, slope| {
        *slope = f(at)?;
        Some(())
    }
}

/// from + h sum_j a_j k_j.
#[inline]
fn combine<S: State>(from: &S, h: f64, row: &[(usize, f64)], slopes: &[S; 16]) -> S {
    let mut y = from.clone();
    for &(j, a) in row {
        y.axpy(h * a, &slopes[j]);
    }
    y
}

/// State inside a step of length `h`, from the integrals of the polynomials of the slopes.
pub(super) fn integrate_polynomial<S: State>(
    from: &S,
    h: f64,
    integrals: &[f64],
    slopes: &[S],
) -> S {
    let mut state = from.clone();
    for (integral, slope) in integrals.iter().zip(slopes) {
        state.axpy(h * integral, slope);
    }
    state
}

/// sum_j a_j k_j.
#[inline]
fn weighted_sum<S: State>(row: &[(usize, f64)], slopes: &[S; 16]) -> S {
    let (first, a) = row[0];
    let mut y = slopes[first].clone();
    y.axpy(a - 1.0, &slopes[first]);
    for &(j, a) in &row[1..] {
        y.axpy(a, &slopes[j]);
    }
    y
}

impl<S: State> Step<S> {
    fn blank(from: &S, slope: &S) -> Self {
        Self {
            from: from.clone(),
            to: from.clone(),
            h: 0.0,
            slopes: std::array::from_fn(|_| slope.clone()),
        }
    }

    /// All stages of a step of length `h` from the start of this one; None if the right-hand side is undefined.
    fn attempt(
        &mut self,
        h: f64,
        f: &mut impl FnMut(&S, &mut S) -> Option<()>,
        cost: &mut Cost,
    ) -> Option<()> {
        self.h = h;
        for (i, row) in STAGES.iter().enumerate() {
            cost.evaluations += 1;
            f(
                &combine(&self.from, h, row, &self.slopes),
                &mut self.slopes[i + 1],
            )?;
        }
        self.to = combine(&self.from, h, STEP, &self.slopes);
        cost.evaluations += 1;
        f(&self.to, &mut self.slopes[12])
    }

    /// Hairer's error estimate: h e5^2 / sqrt(e5^2 + 0.01 e3^2), in units of the state's scale.
    fn error(&self, mean_square: impl Fn(&S, &S, &S) -> f64) -> f64 {
        let [e5, e3] = [ERROR5, ERROR3]
            .map(|row| mean_square(&weighted_sum(row, &self.slopes), &self.from, &self.to));
        if e5 == 0.0 {
            return 0.0;
        }
        let error = self.h * e5 / (e5 + 0.01 * e3).sqrt();
        if error.is_nan() { f64::INFINITY } else { error }
    }

    /// Slopes at the stages of the step, first the start and last the end; available without evaluations.
    pub fn stage_slopes(&self) -> &[S] {
        &self.slopes[..13]
    }

    /// The slope at the end.
    pub fn end_slope(&self) -> &S {
        &self.slopes[12]
    }

    /// Step times the dominant eigenvalue, estimated by the last two stages: about 6.1 if stability and not accuracy
    /// limits the step (Hairer's test). None if the two stages coincide to rounding.
    pub fn stiffness(&self, mean_square: impl Fn(&S, &S, &S) -> f64) -> Option<f64> {
        let last = STAGES.len();
        let mut apart = combine(&self.from, self.h, STAGES[last - 1], &self.slopes);
        apart.axpy(-1.0, &self.to);
        let mut slopes = self.slopes[last].clone();
        slopes.axpy(-1.0, &self.slopes[last + 1]);
        let [apart, slopes] = [apart, slopes].map(|x| mean_square(&x, &self.from, &self.to).sqrt());
        (apart > f64::EPSILON).then(|| self.h * slopes / apart)
    }

    /// This step with another length, at full order: 12 evaluations. Events are thus located to the accuracy of the
    /// integration instead of that of an interpolant.
    pub fn redo(&self, f: impl FnMut(&S) -> Option<S>, h: f64, cost: &mut Cost) -> Option<Step<S>> {
        let mut step = Self::blank(&self.from, &self.slopes[0]);
        step.attempt(h, &mut writes_slope(f), cost)?;
        Some(step)
    }

    /// The interpolant of order 7 over this step: 3 evaluations.
    pub fn dense(
        &mut self,
        mut f: impl FnMut(&S) -> Option<S>,
        cost: &mut Cost,
    ) -> Option<Dense<S>> {
        for (i, row) in EXTRA.iter().enumerate() {
            cost.evaluations += 1;
            self.slopes[13 + i] = f(&combine(&self.from, self.h, row, &self.slopes))?;
        }
        cost.samples += 1;
        let h = self.h;
        let mut difference = self.to.clone();
        difference.axpy(-1.0, &self.from);
        // F1 = h k0 - dy, F2 = 2 dy - h (k0 + k12), then the tableau's four.
        let mut f1 = difference.clone();
        f1.axpy(-2.0, &difference);
        f1.axpy(h, &self.slopes[0]);
        let mut f2 = difference.clone();
        f2.axpy(1.0, &difference);
        f2.axpy(-h, &self.slopes[0]);
        f2.axpy(-h, &self.slopes[12]);
        let high = DENSE.map(|row| weighted_sum(row, &self.slopes));
        Some(Dense {
            from: self.from.clone(),
            h,
            low: [difference, f1, f2],
            high,
        })
    }
}

/// A polynomial of degree 7 over one step.
#[derive(Debug, Clone)]
pub struct Dense<S> {
    from: S,
    h: f64,
    low: [S; 3],
    high: [S; 4],
}

impl<S: State> Dense<S> {
    /// The state at the fraction `x` in [0, 1] of the step.
    pub fn at(&self, x: f64) -> S {
        let y = 1.0 - x;
        let mut state = self.from.clone();
        // y0 + x (dy + y (F1 + x (F2 + y (F3 + x (F4 + y (F5 + x F6)))))), expanded.
        let mut weight = x;
        for (i, term) in self.low.iter().enumerate() {
            state.axpy(weight, term);
            weight *= if i % 2 == 0 { y } else { x };
        }
        for (i, term) in self.high.iter().enumerate() {
            state.axpy(weight * self.h, term);
            weight *= if i % 2 == 0 { x } else { y };
        }
        state
    }
}
