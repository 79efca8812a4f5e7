//! Damped Newton for dense square systems, globalised by the natural monotonicity test.
//!
//! Deuflhard, Newton Methods for Nonlinear Problems (2004), Sec. 3.3 (algorithm NLEQ-ERR): a step is judged by the
//! next simplified correction, J_k^-1 F(x_k + damping dx), not by |F|. The iteration therefore does not depend on the
//! scaling of the equations. Damping factors are predicted from the curvature of the preceding steps.

use super::elimination::Elimination;
use super::newton_on_branch::MAX_ROUNDING_CORRECTION;
use super::rounding::AtRoot;
use crate::error::{Error, Result};
use nalgebra::{DMatrix, DVector};
use std::cell::Cell;

/// Tolerance and limits of the iteration.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Options {
    /// A correction below tolerance (1 + |x|) counts as converged. In (0, 1).
    pub tolerance: f64,
    /// Most Newton steps, >= 1.
    pub max_iterations: usize,
    /// Smallest damping factor; below, the iteration gives up. In (0, 1).
    pub min_damping: f64,
}

impl Default for Options {
    /// 1e-10, 50 steps, 1e-5.
    fn default() -> Self {
        Self {
            tolerance: 1e-10,
            max_iterations: 50,
            min_damping: 1e-5,
        }
    }
}

impl Options {
    pub(super) fn check(&self) -> Result<()> {
        for (name, value) in [
            ("tolerance", self.tolerance),
            ("min_damping", self.min_damping),
        ] {
            if !(0.0 < value && value < 1.0) {
                return Err(Error::domain(format!(
                    "Newton's {name} = {value} must lie between 0 and 1"
                )));
            }
        }
        if self.max_iterations == 0 {
            return Err(Error::domain(
                "Newton's max_iterations = 0 must be at least 1",
            ));
        }
        Ok(())
    }
}

/// Reason for the end of a converged iteration.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Reason {
    /// The next correction would be below rounding.
    Rounding,
    /// Corrections below the tolerance, or at the level of rounding of F, no longer shrink: the noise of F is
    /// reached.
    Noise,
}

/// A solution with the record of the iteration.
#[derive(Debug, Clone, PartialEq)]
pub struct Solution {
    /// x with F(x) = 0.
    pub x: DVector<f64>,
    /// Newton steps taken.
    pub iterations: usize,
    /// Evaluations of F with its Jacobian.
    pub evaluations: usize,
    /// The smallest damping factor of an accepted step; 1 if no step was damped.
    pub damping: f64,
    /// |F| at the last evaluation (one correction before `x`).
    pub residual: f64,
    /// Length of the last correction.
    pub correction: f64,
    /// Reason for the end.
    pub reason: Reason,
}

/// Solves F(x) = 0 from `start`; `system` gives F and dF/dx.
///
/// Converges to rounding, or to the noise of F if that lies below the tolerance. The error of x is about the last
/// `correction` or the noise, whichever is larger.
///
/// # Errors
/// Options outside their sets; F undefined at `start`; no convergence: the message gives the point, the reason and a
/// remedy.
pub fn solve(
    system: impl Fn(&DVector<f64>) -> Result<(DVector<f64>, DMatrix<f64>)>,
    start: &DVector<f64>,
    options: &Options,
) -> Result<Solution> {
    attempt(system, start, options).map_err(Error::from)
}

/// As [`solve`], with an error type for callers that can name the unknowns.
pub(crate) fn attempt(
    system: impl Fn(&DVector<f64>) -> Result<(DVector<f64>, DMatrix<f64>)>,
    start: &DVector<f64>,
    options: &Options,
) -> Result<Solution, Failure> {
    iterate(&system, start, options)
}

/// Reason for a missing solution.
pub(crate) enum Failure {
    /// Invalid options, or F undefined at the start: no iteration was made.
    Refused(Error),
    /// The iteration stopped.
    Stopped {
        /// Last iterate.
        x: DVector<f64>,
        /// |F| at the last iterate.
        residual: f64,
        /// Evaluations of F.
        evaluations: usize,
        /// Reason for the stop.
        why: String,
    },
}

impl From<Error> for Failure {
    fn from(e: Error) -> Self {
        Self::Refused(e)
    }
}

impl From<Failure> for Error {
    fn from(failure: Failure) -> Self {
        match failure {
            Failure::Refused(e) => e,
            Failure::Stopped {
                x,
                residual,
                evaluations,
                why,
            } => Self::no_convergence(format!(
                "Newton's method stopped after {evaluations} evaluations: {why}; the largest of {} unknowns is {:.3e}, and the equations are \
                 off by {residual:.1e}; {REMEDY}",
                x.len(),
                x.amax()
            )),
        }
    }
}

/// Remedy for a failed iteration: a part of messages.
pub(crate) const REMEDY: &str =
    "start nearer to a solution, or follow a branch from a solved problem to this one";

type SystemOf<'a> = &'a dyn Fn(&DVector<f64>) -> Result<(DVector<f64>, DMatrix<f64>)>;

/// Takes a trait object: compiled once, not for every system.
fn iterate(
    system: SystemOf<'_>,
    start: &DVector<f64>,
    options: &Options,
) -> Result<Solution, Failure> {
    options.check()?;
    let count = Cell::new(0);
    let evaluate = |x: &DVector<f64>| {
        count.set(count.get() + 1);
        let (f, jacobian) = system(x)?;
        let n = x.len();
        if f.len() != n || jacobian.shape() != (n, n) {
            return Err(Error::domain(format!(
                "F has {} equations and its Jacobian {} x {} entries, for {n} unknowns; there must be as many of each",
                f.len(),
                jacobian.nrows(),
                jacobian.ncols()
            )));
        }
        if f.iter().chain(jacobian.iter()).all(|v| v.is_finite()) {
            Ok((f, jacobian))
        } else {
            Err(Error::domain("F or its Jacobian is not finite"))
        }
    };
    // True if a correction may be mere rounding of F.
    let is_rounding = |x: &DVector<f64>, f: &DVector<f64>, factors: &Elimination, length: f64| {
        let at_root = AtRoot {
            z: x,
            value: f,
            phi: |x: &DVector<f64>| Some(evaluate(x).ok()?.0),
            solve: |off: &DVector<f64>| Some(factors.solve(off).x),
        };
        length <= MAX_ROUNDING_CORRECTION * (1.0 + x.norm()) && at_root.explains(length)
    };
    let factorise = |jacobian| Elimination::new(&jacobian, &DVector::zeros(start.len()));
    let mut x = start.clone();
    let (mut f, jacobian) = evaluate(&x).map_err(|e| e.context("Newton's first guess"))?;
    let mut factors = factorise(jacobian);
    let mut smallest = 1.0_f64;
    // (correction, simplified correction, damping) of the last step, for the prediction.
    let mut last: Option<(f64, DVector<f64>, f64)> = None;
    let mut scale = 1.0 + x.norm();
    let mut why = "the iterations were used up".to_string();
    for iteration in 1..=options.max_iterations {
        if f.norm() == 0.0 {
            return Ok(Solution {
                x,
                iterations: iteration - 1,
                evaluations: count.get(),
                damping: smallest,
                residual: 0.0,
                correction: 0.0,
                reason: Reason::Rounding,
            });
        }
        if factors.regularity() < 1e-15 {
            why = "the Jacobian is singular".into();
            break;
        }
        let step = factors.solve(&-&f).x;
        let length = step.norm();
        let mut damping = match &last {
            Some((before, simplified, used)) => {
                let bend = (simplified - &step).norm() * length;
                (before * simplified.norm() / bend * used).min(1.0)
            }
            None => 1.0,
        };
        if !(damping > options.min_damping) {
            damping = options.min_damping;
        }
        // Below the tolerance nothing is damped, and noise may stop the shrinking.
        let small = length <= options.tolerance * scale;
        let done = |x, reason| Solution {
            x,
            iterations: iteration,
            evaluations: count.get(),
            damping: smallest,
            residual: f.norm(),
            correction: length,
            reason,
        };
        if small {
            damping = 1.0;
            let before = last.as_ref().map_or(f64::INFINITY, |l| l.0);
            let next = length * (length / before).powi(2);
            if length <= 4.0 * f64::EPSILON * scale
                || before.is_finite() && next <= f64::EPSILON * scale
            {
                return Ok(done(x + &step, Reason::Rounding));
            }
            if length > 0.5 * before {
                return Ok(done(x + &step, Reason::Noise));
            }
        }
        let mut raised = false;
        let accepted = loop {
            let trial = &x + &step * damping;
            let outcome = evaluate(&trial);
            let refused = match outcome {
                Ok((value, jacobian)) => {
                    let simplified = factors.solve(&-&value).x;
                    let size = simplified.norm();
                    let bend = (&simplified - &step * (1.0 - damping)).norm();
                    let better = if bend > 0.0 {
                        0.5 * length * damping * damping / bend
                    } else {
                        1.0
                    };
                    if small || size < length {
                        let next = better.min(1.0);
                        if !raised && !small && damping < 1.0 && next >= 4.0 * damping {
                            raised = true;
                            damping = next;
                            continue;
                        }
                        break Some((trial, value, jacobian, simplified));
                    }
                    // A tolerance below rounding cannot be met: corrections stay at the level of rounding.
                    if damping == 1.0 && is_rounding(&x, &f, &factors, length) {
                        return Ok(done(x + &step, Reason::Noise));
                    }
                    better.min(0.5 * damping)
                }
                Err(e) if damping <= options.min_damping => {
                    why = format!("F is undefined nearby ({e})");
                    break None;
                }
                Err(_) => 0.25 * damping,
            };
            if damping <= options.min_damping {
                why = format!("the damping factor fell below {:e}", options.min_damping);
                break None;
            }
            damping = refused.max(options.min_damping);
            raised = true;
        };
        let Some((trial, value, jacobian, simplified)) = accepted else {
            break;
        };
        smallest = smallest.min(damping);
        last = Some((length, simplified, damping));
        (x, f, factors) = (trial, value, factorise(jacobian));
        scale = 1.0 + x.norm();
    }
    Err(Failure::Stopped {
        x,
        residual: f.norm(),
        evaluations: count.get(),
        why,
    })
}
