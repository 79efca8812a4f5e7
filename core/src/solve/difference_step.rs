//! Steps of difference quotients: long enough to exceed noise, short enough to give the derivative.

use crate::error::Result;

/// Ratio of successive steps.
const SHORTER: f64 = 0.25;
/// Largest relative difference of neighbouring steps at which a derivative still exists.
const ROUGH: f64 = 1e-4;

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
