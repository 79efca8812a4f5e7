//! Implicit Runge-Kutta stepping (Radau IIA: 3 stages, order 5, or 5 or 7 stages, orders 9 and 13) for stiff systems
//! of any dimension.
//!
//! Hairer, Wanner: *Solving Ordinary Differential Equations II*, 2nd ed., Sec. IV.8. Stiffly accurate and L-stable:
//! the end of a step is its last stage, and components much faster than the step are slaved to the slow ones.

use super::approximate_jacobian::RoughJacobianPolicy;
use super::cost::Cost;
use super::dop853::StepTooSmall;
use super::order_selection::Orders;
use super::radau_stages::{Factors, Newton, Order, Outcome, Stages};
use super::system::{AnyLinearised, AnySystem};
use nalgebra::DVector;

const SAFETY: f64 = 0.9;
/// Bounds of a change of step size: internal layers are entered and left within a few steps.
const SHRINK: f64 = 0.01;
const GROW: f64 = 8.0;
/// A growth of the step up to this factor is forgone to keep the factors.
const KEPT: f64 = 1.2;
/// The Jacobian is kept while Newton contracts by this per iteration.
const FAST: f64 = 0.02;
/// Largest predicted contraction of Newton's iteration at which a step is tried. The contraction grows in proportion
/// to the step, along which the Jacobian changes.
const CONTRACTING: f64 = 0.3;
/// Cost of the factors, in evaluations for each stage.
const FACTORS: f64 = 3.0;
/// A step below this multiple of the largest step up to now has stalled.
const STALL: f64 = 1e-14;
/// Longest step. Steps of a motion at rest grow for ever, but squares of 1/h must not underflow, for complex division
/// by them.
const LONGEST: f64 = 1e140;
/// With s stages the estimated error is of order h^(s+1), the true one of order h^(2s) if the solution is smooth. To
/// bound the true one by the tolerance the estimate is held to ESTIMATE tolerance^(2/3), as in the authors' program
/// for s = 3. For s = 5 they allow tolerance^(3/5): stiffness then reduces the order, and errors of up to a hundred
/// tolerances were seen.
const ESTIMATE: f64 = 0.1;
/// Largest error of Newton's iteration, in parts of the tolerance.
const NEWTON: f64 = 0.1;
/// Size of increments of the stages that are rounding, in units of the state's scale.
const ROUNDING: f64 = 1e-13;

/// The bound of the error estimate that keeps the error of a step near `tolerance`.
pub(super) fn estimate_bound(tolerance: f64) -> f64 {
    ESTIMATE * tolerance.powf(2.0 / 3.0)
}

/// Last accepted step, for the step-size controller.
#[derive(Debug, Clone, Copy)]
struct Accepted {
    h: f64,
    error: f64,
}

/// An integration in progress.
pub struct Radau {
    tolerance: f64,
    bound: f64,
    orders: Orders,
    h: f64,
    largest: f64,
    state: DVector<f64>,
    slope: DVector<f64>,
    from: DVector<f64>,
    /// Length of the last step; 0 before the first.
    span: f64,
    stages: Stages,
    newton: Newton,
    accepted: Option<Accepted>,
    jacobian: Option<Box<dyn AnyLinearised>>,
    /// True if the Jacobian is that at the current state.
    fresh: bool,
    /// True if the Jacobian is that at the predicted middle of the next step.
    foreseen: bool,
    /// True if the Jacobian must be evaluated again before the next step.
    worn: bool,
    rough: RoughJacobianPolicy,
    factors: Option<Factors>,
    cost: Cost,
}

impl Radau {
    /// Starts at `state`, settled, with its `slope` in the form of [`AnySystem::balance`]; the error control corrects
    /// the first step `h`. The error of each step is kept near `tolerance`, in units of the root of
    /// [`AnySystem::mean_square`]; 1e-13 is the finest that makes sense.
    pub fn new(state: DVector<f64>, slope: DVector<f64>, h: f64, tolerance: f64) -> Self {
        let newton = NEWTON * tolerance.min(estimate_bound(tolerance));
        Self {
            tolerance,
            bound: estimate_bound(tolerance),
            orders: Orders::for_tolerance(tolerance),
            h,
            largest: h,
            from: state.clone(),
            state,
            slope,
            span: 0.0,
            stages: Stages::new(),
            newton: Newton::new(
                newton.max(10.0 * f64::EPSILON),
                ROUNDING.max(0.1 * tolerance),
            ),
            accepted: None,
            jacobian: None,
            fresh: false,
            foreseen: false,
            worn: false,
            rough: RoughJacobianPolicy::HOPED,
            factors: None,
            cost: Cost::default(),
        }
    }

    /// Restricts steps to the order that suits the tolerance.
    pub fn keep_order(&mut self) {
        self.orders.fix_order();
    }

    /// Starts anew at another state, of any dimension. The cost counters and the largest step, which defines a stall,
    /// carry over.
    pub fn restart(&mut self, state: DVector<f64>, slope: DVector<f64>, h: f64) {
        *self = Self {
            largest: self.largest.max(h),
            orders: self.orders,
            rough: self.rough.restarted(),
            cost: self.cost,
            ..Self::new(state, slope, h, self.tolerance)
        };
    }

    /// Cost counters.
    pub fn cost(&self) -> Cost {
        self.cost
    }

    /// The current state.
    pub fn state(&self) -> &DVector<f64> {
        &self.state
    }

    /// The slope at the current state.
    pub fn slope(&self) -> &DVector<f64> {
        &self.slope
    }

    /// The state at the start of the last step.
    pub fn from(&self) -> &DVector<f64> {
        &self.from
    }

    /// Length of the last step; 0 before the first.
    pub fn span(&self) -> f64 {
        self.span
    }

    /// Length of the next trial step.
    pub fn next_step(&self) -> f64 {
        self.h
    }

    /// The Jacobian in use.
    pub fn jacobian(&self) -> Option<&dyn AnyLinearised> {
        self.jacobian.as_deref()
    }

    /// Evaluates the Jacobian at the current state; None if it is undefined.
    pub fn refresh(&mut self, system: &dyn AnySystem) -> Option<()> {
        if !self.fresh {
            self.cost.jacobians += 1;
            self.jacobian = Some(system.linearised(&self.state)?);
            self.factors = None;
            (self.fresh, self.rough.used) = (true, false);
        }
        (self.foreseen, self.worn) = (false, false);
        Some(())
    }

    /// Evaluates the Jacobian at the predicted middle of a step of length `h`, as representative of the whole step. A
    /// rough Jacobian is used if these served up to now; the current state is used if there is no Jacobian at the
    /// middle.
    fn evaluate_at_middle(&mut self, system: &dyn AnySystem, h: f64) -> Option<()> {
        let middle = &self.state + self.change_from_end(1.0 + (0.5 * h / self.span).min(1.0));
        let rough = if self.rough.is_due() {
            system.roughly_linearised(&middle)
        } else {
            None
        };
        self.rough.used = rough.is_some();
        let Some(jacobian) = rough.or_else(|| system.linearised(&middle)) else {
            return self.refresh(system);
        };
        self.cost.jacobians += 1;
        self.jacobian = Some(jacobian);
        self.factors = None;
        (self.foreseen, self.worn) = (true, false);
        Some(())
    }

    /// Takes one step of at most `h_max`.
    ///
    /// # Errors
    /// [`StepTooSmall`] if no step of a size worth taking meets the tolerance, or if the Jacobian is undefined.
    pub fn step(&mut self, system: &dyn AnySystem, h_max: f64) -> Result<(), StepTooSmall> {
        if let Some(h) = self.orders.choose(self.h) {
            (self.h, self.factors) = (h, None);
            if let Some(before) = &mut self.accepted {
                // The error of another order does not predict the growth of errors.
                before.error = f64::INFINITY;
            }
        }
        let spent = self.spent();
        let mut rejected = false;
        let mut extrapolate = self.span > 0.0;
        let mut foresee = self.span > 0.0;
        loop {
            self.h = self.h.min(LONGEST);
            let h = self.h.min(h_max);
            if !(h > STALL * self.largest.min(h_max)) {
                return Err(StepTooSmall);
            }
            if self.worn || self.jacobian.is_none() {
                let taken = if foresee && !self.fresh {
                    self.evaluate_at_middle(system, h)
                } else {
                    self.refresh(system)
                };
                taken.ok_or(StepTooSmall)?;
            }
            if !self.factor(h) {
                if std::mem::take(&mut self.rough.used) {
                    self.refresh(system).ok_or(StepTooSmall)?;
                    continue;
                }
                rejected = true;
                self.cost.rejected += 1;
                self.h = 0.5 * h;
                continue;
            }
            let Some(factors) = &self.factors else {
                return Err(StepTooSmall);
            };
            let mut z = if extrapolate {
                self.extrapolated(h)
            } else {
                vec![DVector::zeros(self.state.len()); self.orders.now().tableau().stages()]
            };
            let evaluations = &mut self.cost.evaluations;
            let outcome = self
                .newton
                .solve(system, &self.state, factors, &mut z, evaluations);
            self.cost.iterations += self.newton.iterations;
            let shrink = match outcome {
                Outcome::Solved => None,
                Outcome::Outside(0) if extrapolate => {
                    extrapolate = false;
                    continue;
                }
                // Try the step again with another Jacobian before shortening it.
                Outcome::Slow(_) if !self.fresh && !self.foreseen => {
                    self.worn = true;
                    continue;
                }
                Outcome::Slow(factor) => Some(factor.clamp(0.1, 0.8)),
                Outcome::Outside(_) => Some(0.3),
            };
            if let Some(factor) = shrink {
                self.orders.record_failure();
                if self.rough.used {
                    self.rough.record_contraction(1.0);
                }
                // The prediction of the middle may be wrong: after a second failure use the Jacobian of the current
                // state.
                if rejected && !self.fresh {
                    (foresee, self.worn) = (false, true);
                }
                rejected = true;
                self.cost.rejected += 1;
                self.h = factor * h;
                continue;
            }
            let to = &self.state + &z[z.len() - 1];
            let error = self.error(system, &z, &to, rejected || self.accepted.is_none());
            // The more iterations this step took, the more cautious the next one.
            let most = 2.0 * f64::from(Newton::max_iterations(self.orders.now()));
            let power = 1.0 / (z.len() + 1) as f64;
            let safety = SAFETY * (1.0 + most) / (self.newton.iterations as f64 + most);
            let mut factor = safety * error.max(1e-10).powf(-power);
            if error < 1.0 {
                // Gustafsson's predictive controller extrapolates the growth of the error from step to step.
                if let Some(before) = self.accepted {
                    let change = before.error.max(0.01) / (error * error).max(1e-20);
                    factor = factor.min(SAFETY * h / before.h * change.powf(power));
                }
                factor = factor.clamp(SHRINK, if rejected { 1.0 } else { GROW });
                if self.newton.contraction > 0.0 {
                    factor = factor.min((CONTRACTING / self.newton.contraction).max(1.0));
                }
                let clipped = h < self.h;
                let slope = self.end_slope(system, &z, &to, h, h_max);
                self.accept(z, to, slope, Accepted { h, error });
                self.worn = self.newton.contraction > FAST;
                self.rough.record_contraction(self.newton.contraction);
                let work = self.spent() - spent;
                self.orders.record_step(self.newton.contraction, work, h);
                self.h = if clipped {
                    self.h.max(h * factor)
                } else if !self.worn && (1.0..=KEPT).contains(&factor) {
                    h
                } else {
                    h * factor
                };
                return Ok(());
            }
            self.cost.rejected += 1;
            rejected = true;
            self.worn = !self.fresh && !self.foreseen && self.newton.contraction > FAST;
            self.h = h * if self.accepted.is_none() {
                factor.clamp(SHRINK, 0.1)
            } else {
                factor.clamp(SHRINK, SAFETY)
            };
        }
    }

    /// Slope at the end of a step of length `h`: that of the collocation polynomial, since the end is its last stage
    /// and satisfies the equations. A step of the length `h_max` may have ended at a break of the loads, beyond which
    /// the slope differs.
    fn end_slope(
        &mut self,
        system: &dyn AnySystem,
        z: &[DVector<f64>],
        to: &DVector<f64>,
        h: f64,
        h_max: f64,
    ) -> DVector<f64> {
        if h == h_max {
            let mut slope = DVector::zeros(to.len());
            self.cost.evaluations += 1;
            if system.balance(to, &mut slope).is_some() {
                return slope;
            }
        }
        let mut slope = self.orders.now().tableau().end_slope(h, z);
        let algebraic = system.algebraic();
        slope.rows_mut(to.len() - algebraic, algebraic).fill(0.0);
        slope
    }

    /// Cost up to now, in evaluations.
    fn spent(&self) -> f64 {
        let stages = self.orders.now().tableau().stages() as f64;
        self.cost.evaluations as f64 + FACTORS * stages * self.cost.factorisations as f64
    }

    fn accept(&mut self, z: Stages, to: DVector<f64>, slope: DVector<f64>, step: Accepted) {
        self.from = std::mem::replace(&mut self.state, to);
        self.slope = slope;
        self.stages = z;
        self.span = step.h;
        self.largest = self.largest.max(step.h);
        self.accepted = Some(step);
        (self.fresh, self.foreseen) = (false, false);
        self.cost.steps += 1;
        self.cost.implicit_steps += 1;
    }

    /// Updates the factors to the step size `h`; false if a matrix is singular.
    fn factor(&mut self, h: f64) -> bool {
        if self.factors.as_ref().is_some_and(|f| f.h == h) {
            return true;
        }
        self.cost.factorisations += 1;
        self.factors = self
            .jacobian
            .as_deref()
            .and_then(|j| Factors::new(j, self.orders.now(), h));
        self.factors.is_some()
    }

    /// Guess of the stages of a next step of length `h`, from the last step's polynomial.
    fn extrapolated(&self, h: f64) -> Stages {
        let nodes = self.orders.now().tableau().nodes().iter();
        nodes
            .map(|c| self.change_from_end(1.0 + c * h / self.span))
            .collect()
    }

    /// Polynomial of the last step at the fraction `x`, less the state at its start. The order of the last step may
    /// differ from that of the next.
    fn change_from_start(&self, x: f64) -> DVector<f64> {
        let last = Order::of_stages(self.stages.len());
        last.tableau().polynomial(x, &self.stages)
    }

    /// Polynomial of the last step at the fraction `x` > 1, less the state at its end.
    fn change_from_end(&self, x: f64) -> DVector<f64> {
        let polynomial = self.change_from_start(x);
        match self.stages.last() {
            Some(end) => polynomial - end,
            None => polynomial,
        }
    }

    /// Error estimate of a step in units of its bound; infinite if undefined. `careful`: an estimate too large is
    /// filtered again, for a state off the slow manifold overrates it.
    fn error(
        &mut self,
        system: &dyn AnySystem,
        z: &[DVector<f64>],
        to: &DVector<f64>,
        careful: bool,
    ) -> f64 {
        let Some(factors) = &self.factors else {
            return f64::INFINITY;
        };
        let measured = |error: Option<&DVector<f64>>| {
            let square = error.map_or(f64::NAN, |e| system.mean_square(e, &self.state, to));
            let error = square.sqrt() / self.bound;
            if error.is_nan() { f64::INFINITY } else { error }
        };
        let error = factors.error(&self.slope, z, system.algebraic());
        let size = measured(error.as_ref());
        if let Some(error) = error
            && careful
            && size >= 1.0
        {
            let mut slope = DVector::zeros(to.len());
            self.cost.evaluations += 1;
            if system.balance(&(&self.state + error), &mut slope).is_some() {
                return measured(factors.error(&slope, z, system.algebraic()).as_ref());
            }
        }
        size
    }

    /// State at the fraction `x` in [0, 1] of the last step by a separate step of that length: as accurate as the
    /// steps, at the cost of new factors and an iteration or two. None if that step cannot be solved.
    pub fn state_by_step(&mut self, system: &dyn AnySystem, x: f64) -> Option<DVector<f64>> {
        if x == 1.0 || self.span == 0.0 {
            return Some(self.state.clone());
        }
        if x == 0.0 {
            return Some(self.from.clone());
        }
        self.cost.samples += 1;
        let h = x * self.span;
        let mut newton = self.newton.clone();
        let mut again = None;
        loop {
            let jacobian = again.as_deref().or(self.jacobian.as_deref())?;
            self.cost.factorisations += 1;
            let factors = Factors::new(jacobian, self.orders.now(), h)?;
            let nodes = self.orders.now().tableau().nodes().iter();
            let mut z: Stages = nodes.map(|c| self.change_from_start(c * x)).collect();
            let evaluations = &mut self.cost.evaluations;
            let outcome = newton.solve(system, &self.from, &factors, &mut z, evaluations);
            self.cost.iterations += newton.iterations;
            match outcome {
                Outcome::Solved => return Some(&self.from + &z[z.len() - 1]),
                _ if again.is_none() => {
                    self.cost.jacobians += 1;
                    again = Some(system.linearised(&self.from)?);
                    newton.loosen();
                }
                _ => return None,
            }
        }
    }
}

#[cfg(test)]
mod tests;
