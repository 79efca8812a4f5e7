//! Derivatives of smooth functions by extrapolated central differences, right to ten digits of a function with a noise
//! of 1e-13.
//!
//! C. J. F. Ridders, *Accurate computation of F'(x) and F'(x) F''(x)*, Adv. Eng. Software 4 (1982) 75-76: central
//! differences over shrinking steps are extrapolated to the step 0 by Neville's scheme in the square of the step. Each
//! component takes the entry of the scheme that differs least from its neighbours.

use crate::error::Result;
use nalgebra::DVector;

/// Ratio of successive steps.
const SHRINK: f64 = 0.6;
/// Most steps.
const LEVELS: usize = 8;
/// Factor by which the first step is shortened where the function is not defined, and the most such cuts.
const CUT: f64 = 0.2;
const CUTS: usize = 8;
/// Relative error at which no further step is taken.
const EXACT: f64 = 1e-13;
/// First step relative to the argument, and the first step at 0.
const PART: f64 = 0.02;
const AT_ZERO: f64 = 1e-3;
/// Least and largest change of a function over its first step.
const CHANGE: [f64; 2] = [1e-3, 5e-2];
/// Largest factor from one first step to the next, and the most trials.
const GROWTH: f64 = 30.0;
const TRIALS: usize = 12;

/// A derivative with the estimated error of each component.
#[derive(Debug, Clone, PartialEq)]
pub struct Slope {
    /// The derivative.
    pub value: DVector<f64>,
    /// Estimated errors, >= 0.
    pub error: DVector<f64>,
}

/// Differences over one step: central, or one-sided with the sign of the step.
#[derive(Clone, Copy, PartialEq)]
enum Sides {
    Both,
    One(f64),
}

impl Slope {
    /// Derivative of `f` at 0, from differences over `first` and shorter steps. They are one-sided, and less exact,
    /// where one side is outside of the domain.
    ///
    /// # Errors
    /// Those of `f` at 0, or on both sides of 0.
    pub fn at(first: f64, f: &mut dyn FnMut(f64) -> Result<DVector<f64>>) -> Result<Self> {
        let mut step = first;
        let mut last = None;
        for _ in 0..CUTS {
            match (f(step), f(-step)) {
                (Ok(above), Ok(below)) => {
                    let start = (above - below) / (2.0 * step);
                    return Self::extrapolated(start, step, Sides::Both, f);
                }
                (above, below) => last = Some((above, below)),
            }
            step *= CUT;
        }
        let (sign, beside) = match last {
            Some((Ok(above), _)) => (1.0, above),
            Some((_, Ok(below))) => (-1.0, below),
            Some((Err(why), _)) => return Err(why),
            None => (1.0, f(first)?),
        };
        let step = step / CUT;
        let start = (beside - f(0.0)?) / (sign * step);
        Self::extrapolated(start, step, Sides::One(sign), f)
    }

    fn extrapolated(
        start: DVector<f64>,
        mut step: f64,
        sides: Sides,
        f: &mut dyn FnMut(f64) -> Result<DVector<f64>>,
    ) -> Result<Self> {
        let power = if sides == Sides::Both { 2 } else { 1 };
        let here = match sides {
            Sides::Both => None,
            Sides::One(_) => Some(f(0.0)?),
        };
        let size = start.len();
        let mut best = Self {
            value: start.clone(),
            error: DVector::repeat(size, f64::INFINITY),
        };
        let mut row = vec![start];
        for _ in 1..LEVELS {
            step *= SHRINK;
            let first = match (&here, sides) {
                (Some(here), Sides::One(sign)) => (f(sign * step)? - here) / (sign * step),
                _ => (f(step)? - f(-step)?) / (2.0 * step),
            };
            let mut next = vec![first];
            let mut factor = 1.0;
            for k in 0..row.len() {
                factor /= SHRINK.powi(power);
                let better = (&next[k] * factor - &row[k]) / (factor - 1.0);
                for i in 0..size {
                    let error = (better[i] - next[k][i])
                        .abs()
                        .max((better[i] - row[k][i]).abs());
                    if error < best.error[i] {
                        (best.error[i], best.value[i]) = (error, better[i]);
                    }
                }
                next.push(better);
            }
            row = next;
            let exact = |i: usize| best.error[i] <= EXACT * best.value[i].abs();
            if (0..size).all(exact) {
                break;
            }
        }
        Ok(best)
    }
}

/// First step for the derivative of `f` at the argument `at`: a part of the argument, or so long that `f` changes
/// beyond its noise.
///
/// # Errors
/// Those of `f` at the argument.
pub fn first_step(at: f64, f: &mut dyn FnMut(f64) -> Result<DVector<f64>>) -> Result<f64> {
    let here = f(at)?;
    let mut step = if at == 0.0 { AT_ZERO } else { PART * at.abs() };
    let mut good = step;
    for _ in 0..TRIALS {
        let (Ok(above), Ok(_)) = (f(at + step), f(at - step)) else {
            break;
        };
        good = step;
        let change = (above - &here).norm();
        step *= match change {
            0.0 => break,
            change if change < CHANGE[0] => (2.0 * CHANGE[0] / change).min(GROWTH),
            change if change > CHANGE[1] => (0.5 * CHANGE[1] / change).max(1.0 / GROWTH),
            _ => break,
        };
    }
    Ok(good)
}
