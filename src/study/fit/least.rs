//! Levenberg-Marquardt least squares in a box, with steps that stay inside.

use super::noise::{CERTAIN, SEEN};
use crate::error::{Error, Result};
use nalgebra::{DMatrix, DVector};

/// Step of the central differences, as a fraction of the range. It yields derivatives to 1e-5 from a model right to
/// 1e-9, and from one with third derivatives up to 1e3.
const DIFFERENCE: f64 = 1e-4;
/// Largest number of steps.
const STEPS: usize = 100;
/// Convergence bounds: step, as a fraction of the ranges, and relative gain of the sum of squares.
const STEP: f64 = 1e-9;
const GAIN: f64 = 1e-12;
/// Initial damping relative to the squared column norms, and the damping at which the search gives up.
const DAMPING: f64 = 1e-3;
const MOST_DAMPING: f64 = 1e12;

/// Residuals over the box [0, 1]^n.
pub(super) trait Model {
    /// Residuals at a point; `None` where the model fails.
    ///
    /// # Errors
    /// An end of the search, such as an interrupt.
    fn residuals(&mut self, at: &[f64]) -> Result<Option<DVector<f64>>>;

    /// Derivatives of the residuals by the coordinates, with their estimated errors; `None` where the model does not
    /// have them, and differences serve.
    ///
    /// # Errors
    /// An end of the search, such as an interrupt.
    fn slopes(&mut self, _at: &[f64]) -> Result<Option<[DMatrix<f64>; 2]>> {
        Ok(None)
    }
}

/// A local minimum of the sum of squares.
#[derive(Debug, Clone)]
pub(super) struct LocalMinimum {
    pub at: Vec<f64>,
    pub residuals: DVector<f64>,
    /// Derivatives of the residuals by the coordinates of the box.
    pub slopes: DMatrix<f64>,
    /// Estimated errors of the model's own derivatives. For differences: the change of the derivatives when the step
    /// is halved, which exceeds their errors from the step, from rounding and from the tolerance of the model.
    pub doubts: DMatrix<f64>,
    /// False if the search ended before convergence.
    pub settled: bool,
}

impl LocalMinimum {
    /// Minimises from a point of the box; `None` if the model fails there.
    ///
    /// # Errors
    /// Those of the residuals.
    pub fn from(start: &[f64], of: &mut dyn Model) -> Result<Option<Self>> {
        let Some(residuals) = of.residuals(start)? else {
            return Ok(None);
        };
        let empty = DMatrix::zeros(0, 0);
        let mut here = Self {
            at: start.to_vec(),
            residuals,
            doubts: empty.clone(),
            slopes: empty,
            settled: false,
        };
        let mut own = here.linearise(of)?;
        let mut damping = DAMPING;
        for _ in 0..STEPS {
            let before = here.at.clone();
            let goes_on = here.step(&mut damping, of)?;
            if here.at != before {
                own = here.linearise(of)?;
            }
            if !goes_on {
                here.settled = true;
                break;
            }
        }
        if !own {
            here.doubts =
                &here.slopes - derivatives(&here.at, &here.residuals, 0.5 * DIFFERENCE, of)?;
        }
        Ok(Some(here))
    }

    /// Sets the derivatives at the point; true for the model's own derivatives with errors.
    fn linearise(&mut self, of: &mut dyn Model) -> Result<bool> {
        if let Some([slopes, doubts]) = of.slopes(&self.at)? {
            (self.slopes, self.doubts) = (slopes, doubts);
            return Ok(true);
        }
        self.slopes = derivatives(&self.at, &self.residuals, DIFFERENCE, of)?;
        Ok(false)
    }

    /// The sum of squares.
    pub fn square(&self) -> f64 {
        self.residuals.norm_squared()
    }

    /// One step that reduces the sum of squares; false if none is found, or if the gain is rounding. Derivatives stay
    /// those of the point before.
    fn step(&mut self, damping: &mut f64, of: &mut dyn Model) -> Result<bool> {
        let gradient = self.slopes.tr_mul(&self.residuals);
        let seen = is_seen(&self.slopes);
        // Coordinates are fixed on a wall if the sum decreases outwards, and where the residuals do not depend on
        // them (rounding would move these).
        let free: Vec<usize> = (0..self.at.len())
            .filter(|&i| {
                let (x, down) = (self.at[i], -gradient[i]);
                seen[i] && down != 0.0 && !(x <= 0.0 && down < 0.0 || x >= 1.0 && down > 0.0)
            })
            .collect();
        if free.is_empty() {
            return Ok(false);
        }
        let slopes = self.slopes.select_columns(&free);
        let sizes: Vec<f64> = slopes.column_iter().map(|column| column.norm()).collect();
        let mut growth = 2.0;
        while *damping < MOST_DAMPING {
            // The damped problem as a least-squares problem: normal equations would square the condition number.
            let (rows, columns) = slopes.shape();
            let mut matrix = DMatrix::zeros(rows + columns, columns);
            matrix.rows_mut(0, rows).copy_from(&slopes);
            for (j, size) in sizes.iter().enumerate() {
                matrix[(rows + j, j)] = damping.sqrt() * size;
            }
            let mut right = DVector::zeros(rows + columns);
            right.rows_mut(0, rows).copy_from(&-&self.residuals);
            let qr = matrix.qr();
            let step = qr.r().solve_upper_triangular(&qr.q().tr_mul(&right));
            let Some(step) = step.filter(|step| step.iter().all(|x| x.is_finite())) else {
                *damping *= growth;
                growth *= 2.0;
                continue;
            };
            let mut trial = self.at.clone();
            for (i, x) in free.iter().zip(step.iter()) {
                trial[*i] = (trial[*i] + x).clamp(0.0, 1.0);
            }
            let moved = (0..trial.len()).map(|i| trial[i] - self.at[i]);
            let moved = DVector::from_iterator(trial.len(), moved);
            if moved.amax() < STEP {
                return Ok(false);
            }
            let promised = self.square() - (&self.residuals + &self.slopes * &moved).norm_squared();
            if let Some(residuals) = of.residuals(&trial)?
                && residuals.norm_squared() < self.square()
            {
                let gain = self.square() - residuals.norm_squared();
                let done = gain < GAIN * self.square();
                // Nielsen's rule: the larger the gain over the promised one, the less damping.
                let held = (gain / promised.max(f64::MIN_POSITIVE)).min(2.0);
                *damping *= (1.0 - (2.0 * held - 1.0).powi(3)).max(1.0 / 3.0);
                *damping = damping.max(1e-14);
                self.at = trial;
                self.residuals = residuals;
                return Ok(!done);
            }
            // A step cut off at a wall may promise a loss; a shorter one does not.
            if (0.0..GAIN * self.square()).contains(&promised) {
                return Ok(false);
            }
            *damping *= growth;
            growth *= 2.0;
        }
        Ok(false)
    }
}

/// True for each derivative column above rounding, relative to the largest.
pub(super) fn is_seen(slopes: &DMatrix<f64>) -> Vec<bool> {
    let sizes: Vec<f64> = slopes.column_iter().map(|column| column.norm()).collect();
    let largest = sizes.iter().copied().fold(0.0, f64::max);
    sizes.iter().map(|size| *size > SEEN * largest).collect()
}

/// True for each derivative column above its doubts. Smaller ones only show the tolerance of the model, or the step.
pub(super) fn is_certain(least: &LocalMinimum) -> Vec<bool> {
    let each = least.slopes.column_iter().zip(least.doubts.column_iter());
    each.map(|(slope, doubt)| slope.norm() > CERTAIN * doubt.norm())
        .collect()
}

/// Central differences with this step, one-sided at the walls of the box.
fn derivatives(
    at: &[f64],
    here: &DVector<f64>,
    step: f64,
    of: &mut dyn Model,
) -> Result<DMatrix<f64>> {
    let mut slopes = DMatrix::zeros(here.len(), at.len());
    for j in 0..at.len() {
        let mut side = |x: f64| -> Result<Option<(f64, DVector<f64>)>> {
            let mut there = at.to_vec();
            there[j] = x.clamp(0.0, 1.0);
            Ok(of.residuals(&there)?.map(|residuals| (there[j], residuals)))
        };
        let own = || (at[j], here.clone());
        let (low, below) = side(at[j] - step)?.unwrap_or_else(own);
        let (high, above) = side(at[j] + step)?.unwrap_or_else(own);
        if high == low {
            return Err(Error::domain(
                "on both sides of a value that is searched the scene cannot be run",
            ));
        }
        slopes.set_column(j, &((above - below) / (high - low)));
    }
    Ok(slopes)
}
