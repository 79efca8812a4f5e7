//! Steps of difference quotients: long enough to exceed noise, short enough to give the derivative.

use crate::error::Result;
use nalgebra::DVector;

/// Ratio of successive steps.
const SHORTER: f64 = 0.25;
/// Largest relative difference of neighbouring steps at which a derivative still exists.
const ROUGH: f64 = 1e-4;

/// Part of a step of a derivative by a parameter below which the step is shortened, and the shortest step over the
/// first.
const FITTING: f64 = 0.9;
const SHORTEST: f64 = 1e-6;

/// Derivative at `p`: a central difference over `step`, one-sided if one side is out of reach. The step is shortened if
/// the value changes by more than `change` over the step. Long steps give wrong derivatives: an error at the base of a
/// long rod grows as exp(lam), and a rod that is solved from both ends has other equations beside another spring.
///
/// # Errors
/// Those of `at`.
pub fn derivative(
    p: f64,
    step: f64,
    change: f64,
    at: &dyn Fn(f64) -> Result<DVector<f64>>,
) -> Result<DVector<f64>> {
    let over = |h: f64| match (at(p + h), at(p - h)) {
        (Ok(after), Ok(before)) => Ok((after - before) / (2.0 * h)),
        (Ok(after), Err(_)) => Ok((after - at(p)?) / h),
        (Err(_), Ok(before)) => Ok((at(p)? - before) / h),
        (Err(why), Err(_)) => Err(why),
    };
    let mut h = step;
    loop {
        let slope = over(h)?;
        let part = change / (slope.norm() * h);
        if !(part < FITTING) || h <= SHORTEST * step {
            return Ok(slope);
        }
        // A change as large as the rod itself does not show how large the derivative is: the next step shows it.
        h = (h * part).max(SHORTEST * step);
    }
}

/// Sequence of trial steps.
#[derive(Debug, Clone, Copy)]
pub struct Steps {
    /// The first one.
    pub first: f64,
    /// Most steps.
    pub most: usize,
    /// Relative difference at which two steps agree.
    pub same: f64,
}

impl Steps {
    /// The longest step that agrees with the one before, or else the best, with the value of `at`; `apart` is the
    /// relative difference of two values. None if no two agree to 1e-4.
    ///
    /// # Errors
    /// Those of `at`.
    pub fn best_step<T: Clone>(
        &self,
        mut at: impl FnMut(f64) -> Result<T>,
        apart: impl Fn(&T, &T) -> f64,
    ) -> Result<Option<(f64, T)>> {
        let mut step = self.first;
        let mut last = at(step)?;
        let (mut nearest, mut best) = (f64::INFINITY, None);
        for _ in 1..self.most {
            step *= SHORTER;
            let found = at(step)?;
            let off = apart(&last, &found);
            if off < nearest {
                (nearest, best) = (off, Some((step, found.clone())));
            }
            if nearest <= self.same {
                break;
            }
            last = found;
        }
        Ok(best.filter(|_| nearest <= ROUGH))
    }
}
