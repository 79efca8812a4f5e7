//! Checks of numbers. A message names the number, the value and the allowed values.

use super::{Error, Result};

/// Error unless the number is finite and > 0.
pub(crate) fn check_positive(name: &str, value: f64) -> Result<()> {
    if 0.0 < value && value < f64::INFINITY {
        return Ok(());
    }
    Err(Error::domain(format!(
        "{name} = {value} must be finite and > 0"
    )))
}

/// Error unless all of these numbers are finite.
pub(crate) fn check_finite(name: &str, values: &[f64]) -> Result<()> {
    if values.iter().all(|x| x.is_finite()) {
        return Ok(());
    }
    Err(Error::domain(format!("{name} {values:?} must be finite")))
}
