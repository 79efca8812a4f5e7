//! The step of a difference: long enough that noise is no part of it, short enough that it is the derivative.

use crate::error::Result;

/// Each step over the one before it.
const SHORTER: f64 = 0.25;
/// Where no two steps next to each other give the same to this part, there is no derivative.
const ROUGH: f64 = 1e-4;

/// The steps that are tried.
#[derive(Debug, Clone, Copy)]
pub struct Steps {
    /// The first one.
    pub first: f64,
    /// How many at most.
    pub most: usize,
    /// The part to which two give the same that are good.
    pub same: f64,
}

impl Steps {
    /// The longest step that gives the same as the one before it, or that which comes nearest to it, with what `at`
    /// finds there; `apart` is by what part two of them differ. None where no two agree to 1e-4.
    ///
    /// # Errors
    /// Those of `at`.
    pub fn settled<T: Clone>(
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
