//! Options of a motion of bodies with contact.

use snaprod_systems::error::{Error, Result};

/// Options of a motion of bodies with contact.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct BodyOptions {
    /// End of time.
    pub duration: f64,
    /// Bound of the local error of a step, relative to 1 + size. Default 1e-12.
    pub tolerance: f64,
    /// Normal speed after an impact below which bounces are summed up: the contact closes, and the event
    /// `accumulation` has the time at which the infinite sequence of bounces would end. Default 1e-6.
    pub resting_speed: f64,
    /// Most impacts. Default 1e5.
    pub max_impacts: u64,
    /// Most steps. Default 1e7.
    pub max_steps: u64,
}

impl BodyOptions {
    /// Options with defaults, up to the time `duration`.
    ///
    /// # Errors
    /// A duration that is not positive and finite.
    pub fn new(duration: f64) -> Result<Self> {
        if !(0.0 < duration && duration < f64::INFINITY) {
            return Err(Error::domain(format!(
                "duration = {duration} must be finite and > 0"
            )));
        }
        Ok(Self {
            duration,
            tolerance: 1e-12,
            resting_speed: 1e-6,
            max_impacts: 100_000,
            max_steps: 10_000_000,
        })
    }

    /// Sets the tolerance.
    ///
    /// # Errors
    /// A tolerance outside [1e-14, 1e-2].
    pub fn with_tolerance(self, tolerance: f64) -> Result<Self> {
        if !(1e-14..=1e-2).contains(&tolerance) {
            return Err(Error::domain(format!(
                "tolerance = {tolerance} must lie in [1e-14, 1e-2]"
            )));
        }
        Ok(Self { tolerance, ..self })
    }

    /// Sets the speed below which bounces are summed up.
    ///
    /// # Errors
    /// A speed that is not finite and positive.
    pub fn with_resting_speed(self, resting_speed: f64) -> Result<Self> {
        if !(0.0 < resting_speed && resting_speed < f64::INFINITY) {
            return Err(Error::domain(format!(
                "resting_speed = {resting_speed} must be finite and > 0"
            )));
        }
        Ok(Self {
            resting_speed,
            ..self
        })
    }
}
