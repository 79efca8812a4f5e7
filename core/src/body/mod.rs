//! Bodies and the loads on them: point masses, rigid bodies, moving supports, grooves, histories in time, functions.

mod end_body;
mod groove;
mod load_function;
mod mass;
mod point_mass;
mod point_mass8;
mod rigid;
mod support;

pub use crate::math::frame::Frame;
pub use crate::math::history::{Block, Custom, History, Pulse, Ramp, Sine};
pub use end_body::{EndBody, EndLinear, EndMotion, EndPose, FreeEnd};
pub use groove::Groove;
pub use load_function::{BodyState, BodyWrench, LoadFunction};
pub use mass::{Mass, MassLinear};
pub use point_mass::PointMass;
pub use point_mass8::EightMotion;
pub use rigid::RigidBody;
pub use support::Support;

use crate::error::{Error, Result};
use nalgebra::SVector;

/// A force or a couple that depends on time alone: direction x history(t), in the world frame.
#[derive(Debug, Clone)]
pub struct TimeLoad<const N: usize> {
    direction: SVector<f64, N>,
    history: History,
}

impl<const N: usize> TimeLoad<N> {
    /// The load direction x history(t).
    ///
    /// # Errors
    /// A component or a number of the history that is not finite; times that do not grow.
    pub fn new(direction: SVector<f64, N>, history: History) -> Result<Self> {
        if !direction.iter().all(|x| x.is_finite()) {
            return Err(Error::domain(format!(
                "the direction {} of a load in time must be finite",
                crate::error::named(&crate::error::AXES, direction.as_slice())
            )));
        }
        let history = history.checked()?;
        Ok(Self { direction, history })
    }

    /// The load amplitude sin(angular_frequency t + phase).
    ///
    /// # Errors
    /// A number that is not finite.
    pub fn sine(amplitude: SVector<f64, N>, angular_frequency: f64, phase: f64) -> Result<Self> {
        Self::new(amplitude, History::sine(1.0, angular_frequency, phase))
    }

    /// The load at time `t`.
    pub fn at(&self, t: f64) -> SVector<f64, N> {
        self.direction * self.history.at(t)
    }

    /// The first break of the history after `t`; infinite if none is left.
    pub fn next_break(&self, t: f64) -> f64 {
        self.history.next_break(t)
    }
}

/// The sum of loads in time at `t`.
fn sum_at<const N: usize>(loads: &[TimeLoad<N>], t: f64) -> SVector<f64, N> {
    loads
        .iter()
        .fold(SVector::zeros(), |sum, load| sum + load.at(t))
}

/// The first break of the loads after `t`.
fn first_break<const N: usize>(loads: &[TimeLoad<N>], t: f64) -> f64 {
    let breaks = loads.iter().map(|load| load.next_break(t));
    breaks.fold(f64::INFINITY, f64::min)
}

/// Checks that a drag is finite and >= 0.
fn check_drag(what: &str, drag: f64) -> Result<f64> {
    if (0.0..f64::INFINITY).contains(&drag) {
        return Ok(drag);
    }
    Err(Error::domain(format!(
        "{what} = {drag} must be finite and >= 0"
    )))
}

/// Checks that a vector is finite.
fn check_vector<const N: usize>(what: &str, v: SVector<f64, N>) -> Result<SVector<f64, N>> {
    if v.iter().all(|x| x.is_finite()) {
        return Ok(v);
    }
    Err(Error::domain(format!(
        "{what} with the components {} must be finite",
        crate::error::named(&crate::error::AXES, v.as_slice())
    )))
}
