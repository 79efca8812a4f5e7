//! Damped Newton iteration with the natural monotonicity test (Deuflhard), which reports what it did; and deflation.

use crate::error::{Error, Result};
use nalgebra::{DMatrix, DVector};

/// How an iteration ended, and how it got there.
#[derive(Debug, Clone, PartialEq)]
pub struct Solved {
    /// The solution.
    pub x: DVector<f64>,
    /// |F| there.
    pub residual: f64,
    /// Size of the last correction: an estimate of the error of x.
    pub correction: f64,
    /// Newton steps taken.
    pub iterations: usize,
    /// Evaluations of F and its Jacobian.
    pub evaluations: usize,
    /// The smallest damping factor used; 1 if the iteration was never damped.
    pub damping: f64,
}

/// Newton steps after which an iteration is given up, where nothing else is asked for.
pub const LIMIT: usize = 60;
/// The smallest damping factor.
const SMALLEST: f64 = 1e-5;

/// Solves F(x) = 0 for `f` = (F, dF/dx), to a correction of at most `tolerance` (1 + |x|), in at most `limit` steps.
///
/// # Errors
/// `f` refuses the start; a singular Jacobian; no progress. The message says where the iteration stood.
pub fn newton(
    f: impl FnMut(&DVector<f64>) -> Result<(DVector<f64>, DMatrix<f64>)>,
    start: &DVector<f64>,
    tolerance: f64,
    limit: usize,
) -> Result<Solved> {
    deflated(f, start, &[], tolerance, limit)
}

/// As [`newton`], for a solution that is none of `known`: F is multiplied by prod (1 + 1/|x - x_i|^2), which keeps
/// the iteration away from them (Farrell, Birkisson, Funke 2015). The factor only rescales the Newton step.
///
/// # Errors
/// As [`newton`].
pub fn deflated(
    mut f: impl FnMut(&DVector<f64>) -> Result<(DVector<f64>, DMatrix<f64>)>,
    start: &DVector<f64>,
    known: &[DVector<f64>],
    tolerance: f64,
    limit: usize,
) -> Result<Solved> {
    let mut x = start.clone();
    let (mut value, mut jacobian) = f(&x)?;
    let (mut evaluations, mut damping, mut fraction) = (1, 1.0_f64, 1.0_f64);
    for iterations in 0..limit {
        let factor = jacobian.clone().lu();
        let singular = || {
            Error::no_convergence(format!(
                "the Jacobian is singular at x = {:?} after {iterations} Newton steps: a fold or a branch point is near",
                x.as_slice()
            ))
        };
        let newton = -factor.solve(&value).ok_or_else(singular)?;
        let step = &newton * deflation_scale(&x, &newton, known);
        let size = step.norm();
        if !size.is_finite() {
            return Err(singular());
        }
        if newton.norm() <= tolerance * (1.0 + x.norm()) {
            return Ok(Solved {
                residual: value.norm(),
                correction: newton.norm(),
                x,
                iterations,
                evaluations,
                damping,
            });
        }
        fraction = if known.is_empty() { fraction } else { 1.0 };
        loop {
            let trial = &x + &step * fraction;
            evaluations += 1;
            let outcome = f(&trial)
                .ok()
                .filter(|(v, _)| v.iter().all(|c| c.is_finite()));
            if let Some((there, matrix)) = outcome {
                let simplified = factor.solve(&there).map_or(f64::INFINITY, |s| s.norm());
                // A deflated residual may grow on its way around a known solution.
                let bound = if known.is_empty() {
                    1.0 - 0.25 * fraction
                } else {
                    1e6
                };
                if simplified <= bound * newton.norm()
                    || simplified <= tolerance * (1.0 + trial.norm())
                {
                    let theta = simplified / newton.norm();
                    (x, value, jacobian) = (trial, there, matrix);
                    damping = damping.min(fraction);
                    fraction = if theta < 0.5 {
                        1.0
                    } else {
                        (2.0 * fraction).min(1.0)
                    };
                    break;
                }
            }
            fraction *= 0.5;
            if fraction < SMALLEST {
                return Err(Error::no_convergence(format!(
                    "Newton's iteration makes no progress at x = {:?} (residual {:.2e}, correction {size:.2e}) after {iterations} steps; \
                     start nearer, or by continuation",
                    x.as_slice(),
                    value.norm()
                )));
            }
        }
    }
    Err(Error::no_convergence(format!(
        "no convergence within {limit} Newton steps (residual {:.2e}); start nearer, or by continuation",
        value.norm()
    )))
}

/// The factor by which deflation stretches the Newton step d: 1/(1 - grad(ln M).d).
fn deflation_scale(x: &DVector<f64>, d: &DVector<f64>, known: &[DVector<f64>]) -> f64 {
    let slope: f64 = known
        .iter()
        .map(|other| {
            let away = x - other;
            let square = away.norm_squared().max(1e-300);
            -2.0 * away.dot(d) / (square * (1.0 + square))
        })
        .sum();
    let scale = 1.0 / (1.0 - slope);
    if scale.is_finite() {
        scale.clamp(-10.0, 10.0)
    } else {
        1.0
    }
}
