//! Scalar histories f(t) for loads in time and motions of the clamp.

use super::rest_spline::RestSpline;
use crate::error::{Error, Result};
use std::f64::consts::{PI, TAU};
use std::fmt;
use std::sync::Arc;

/// A scalar function of time, with its first two derivatives and its breaks.
///
/// A break is a time at which some derivative jumps, or near which the function has a feature that a long step would
/// miss. Runs end a step at every break, so that no kink lies inside a step and no pulse is skipped.
///
/// The data are plain, as in scenes. Loads in time and supports refuse numbers that do not define a function.
#[derive(Debug, Clone, PartialEq)]
#[cfg_attr(
    feature = "serde",
    derive(serde::Serialize),
    serde(rename_all = "lowercase")
)]
pub enum History {
    /// Constant f.
    Constant(f64),
    /// A linear growth.
    Ramp(Ramp),
    /// A raised cosine.
    Pulse(Pulse),
    /// Constant for an interval and zero otherwise, with jumps.
    Block(Block),
    /// Rows \[t, f\] of growing times, at least one: linear between them, constant before the first and after the last.
    Table(Vec<[f64; 2]>),
    /// Any function.
    #[cfg_attr(feature = "serde", serde(skip))]
    Custom(Custom),
    /// Growth in proportion to time, f = rate t.
    #[cfg_attr(feature = "serde", serde(untagged))]
    Rate {
        /// The rate.
        rate: f64,
    },
    /// A sine.
    #[cfg_attr(feature = "serde", serde(untagged))]
    Sine(Sine),
}

/// mean + amplitude sin(2 pi frequency t + phase).
#[derive(Debug, Clone, Copy, PartialEq)]
#[cfg_attr(feature = "serde", derive(serde::Serialize))]
pub struct Sine {
    /// Mean.
    #[cfg_attr(feature = "serde", serde(skip_serializing_if = "vanishes"))]
    pub mean: f64,
    /// Amplitude, of either sign.
    pub amplitude: f64,
    /// Frequency, cycles per time. At 0 the value is constant, amplitude sin(phase).
    pub frequency: f64,
    /// Phase in radians.
    pub phase: f64,
}

#[cfg(feature = "serde")]
#[allow(clippy::trivially_copy_pass_by_ref)] // serde passes a reference.
fn vanishes(x: &f64) -> bool {
    *x == 0.0
}

/// Growth from `from` before `start` to `to` after `until`. Kinks at both times.
#[derive(Debug, Clone, Copy, PartialEq)]
#[cfg_attr(feature = "serde", derive(serde::Serialize))]
pub struct Ramp {
    /// Value before.
    pub from: f64,
    /// Value after.
    pub to: f64,
    /// Start of the growth.
    pub start: f64,
    /// End of the growth, > `start`.
    pub until: f64,
}

/// A pulse amplitude (1 + cos(2 pi (t - at)/width))/2, |t - at| <= width/2. Its integral is amplitude width/2. f and
/// f' are continuous, f'' jumps at its start and end.
#[derive(Debug, Clone, Copy, PartialEq)]
#[cfg_attr(feature = "serde", derive(serde::Serialize))]
pub struct Pulse {
    /// Time of the middle of the pulse.
    pub at: f64,
    /// Duration, > 0.
    pub width: f64,
    /// Height of the pulse.
    pub amplitude: f64,
}

/// `size` between `start` and `until`, zero otherwise. A step of a run that ends at a jump uses the value before the
/// jump.
#[derive(Debug, Clone, Copy, PartialEq)]
#[cfg_attr(feature = "serde", derive(serde::Serialize))]
pub struct Block {
    /// Value between `start` and `until`.
    pub size: f64,
    /// Start of the block.
    pub start: f64,
    /// End of the block, > `start`.
    pub until: f64,
}

impl Pulse {
    /// Start and end of the pulse.
    fn times(&self) -> [f64; 2] {
        [self.at - 0.5 * self.width, self.at + 0.5 * self.width]
    }
}

/// A custom function and the times of its breaks: [`History::custom`].
#[derive(Clone)]
pub struct Custom {
    f: Arc<dyn Fn(f64) -> [f64; 3] + Send + Sync>,
    breaks: Vec<f64>,
}

impl PartialEq for Custom {
    fn eq(&self, other: &Self) -> bool {
        Arc::ptr_eq(&self.f, &other.f) && self.breaks == other.breaks
    }
}

impl fmt::Debug for Custom {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.debug_list().entries(&self.breaks).finish()
    }
}

impl History {
    /// amplitude sin(angular_frequency t + phase); the angular frequency in radians per unit of time.
    pub fn sine(amplitude: f64, angular_frequency: f64, phase: f64) -> Self {
        Self::Sine(Sine {
            mean: 0.0,
            amplitude,
            frequency: angular_frequency / TAU,
            phase,
        })
    }

    /// The spline through the points \[t, f\] with four continuous derivatives, at rest before the first and after
    /// the last.
    ///
    /// It has degree 5, with f' = f'' = 0 at both ends: f'' is continuous everywhere, as motions of a clamp need.
    ///
    /// # Errors
    /// No point; times that do not grow; a number that is not finite.
    pub fn smooth(points: &[[f64; 2]]) -> Result<Self> {
        check_table(points)?;
        let spline = RestSpline::new(points).ok_or_else(|| {
            Error::domain("a table's times lie too unevenly for a smooth curve: thin them out")
        })?;
        let breaks = points.iter().map(|point| point[0]).collect();
        Ok(Self::custom(move |t| spline.at(t), breaks))
    }

    /// Any function that returns \[f, f', f''\]; loads use f alone. `breaks` are the times, in growing order, at
    /// which the function is not smooth or varies fast. Without them a function that is flat except between two
    /// distant steps of the motion would be missed.
    pub fn custom(f: impl Fn(f64) -> [f64; 3] + Send + Sync + 'static, breaks: Vec<f64>) -> Self {
        let f = Arc::new(f);
        Self::Custom(Custom { f, breaks })
    }

    /// Checks that numbers are finite and times grow.
    pub fn checked(self) -> Result<Self> {
        match &self {
            Self::Constant(value) => check_numbers(&[("constant", *value)]),
            Self::Rate { rate } => check_numbers(&[("rate", *rate)]),
            Self::Sine(sine) => check_numbers(&[
                ("mean", sine.mean),
                ("amplitude", sine.amplitude),
                ("frequency", sine.frequency),
                ("phase", sine.phase),
            ]),
            Self::Ramp(ramp) => check_numbers(&[("from", ramp.from), ("to", ramp.to)])
                .and_then(|()| check_growing("a ramp", &[ramp.start, ramp.until])),
            Self::Pulse(pulse) => check_numbers(&[("amplitude", pulse.amplitude)])
                .and_then(|()| check_growing("a pulse", &pulse.times())),
            Self::Block(block) => check_numbers(&[("size", block.size)])
                .and_then(|()| check_growing("a block", &[block.start, block.until])),
            Self::Table(rows) => check_table(rows),
            Self::Custom(custom) => check_growing("breaks", &custom.breaks),
        }?;
        Ok(self)
    }

    /// Value f(t).
    #[inline]
    pub fn at(&self, t: f64) -> f64 {
        match self {
            Self::Sine(sine) => {
                sine.mean + sine.amplitude * (TAU * sine.frequency * t + sine.phase).sin()
            }
            _ => self.with_rates(t)[0],
        }
    }

    /// \[f, f', f''\] at t; one-sided at breaks.
    pub fn with_rates(&self, t: f64) -> [f64; 3] {
        match self {
            Self::Constant(value) => [*value, 0.0, 0.0],
            Self::Rate { rate } => [*rate * t, *rate, 0.0],
            Self::Sine(sine) => {
                let (a, w) = (sine.amplitude, TAU * sine.frequency);
                let (sin, cos) = (w * t + sine.phase).sin_cos();
                [sine.mean + a * sin, a * w * cos, -a * w * w * sin]
            }
            Self::Ramp(ramp) => line(t, &[[ramp.start, ramp.from], [ramp.until, ramp.to]]),
            Self::Pulse(pulse) => {
                let [start, end] = pulse.times();
                if !(start < t && t < end) {
                    return [0.0; 3];
                }
                let (a, w) = (pulse.amplitude, 2.0 * PI / (end - start));
                let half = (0.5 * w * (t - start)).sin();
                let (sin, cos) = (w * (t - start)).sin_cos();
                [a * half * half, 0.5 * a * w * sin, 0.5 * a * w * w * cos]
            }
            Self::Block(block) => {
                let inside = (block.start..block.until).contains(&t);
                [if inside { block.size } else { 0.0 }, 0.0, 0.0]
            }
            Self::Table(rows) => line(t, rows),
            Self::Custom(custom) => (custom.f)(t),
        }
    }

    /// The first break after `t`; infinite if none is left.
    pub fn next_break(&self, t: f64) -> f64 {
        let first = |times: &[f64]| {
            let next = times.partition_point(|s| *s <= t);
            times.get(next).copied().unwrap_or(f64::INFINITY)
        };
        match self {
            Self::Constant(_) | Self::Rate { .. } | Self::Sine(_) => f64::INFINITY,
            Self::Ramp(ramp) => first(&[ramp.start, ramp.until]),
            Self::Pulse(pulse) => {
                let [start, end] = pulse.times();
                first(&[start, pulse.at, end])
            }
            Self::Block(block) => first(&[block.start, block.until]),
            Self::Table(rows) => {
                let next = rows.partition_point(|row| row[0] <= t);
                rows.get(next).map_or(f64::INFINITY, |row| row[0])
            }
            Self::Custom(custom) => first(&custom.breaks),
        }
    }

    /// True if f'' is continuous after the start, as the motion of a clamp must be: a jump of f' would be an impact.
    /// A custom function is trusted.
    pub fn is_smooth(&self) -> bool {
        !matches!(
            self,
            Self::Ramp(_) | Self::Pulse(_) | Self::Block(_) | Self::Table(_)
        )
    }
}

/// Linear interpolation between rows of growing times, constant before and after.
fn line(t: f64, rows: &[[f64; 2]]) -> [f64; 3] {
    let after = rows.partition_point(|row| row[0] <= t);
    match (rows.get(after.wrapping_sub(1)), rows.get(after)) {
        (Some(a), Some(b)) => {
            let slope = (b[1] - a[1]) / (b[0] - a[0]);
            [a[1] + slope * (t - a[0]), slope, 0.0]
        }
        (Some(end), None) | (None, Some(end)) => [end[1], 0.0, 0.0],
        (None, None) => [0.0; 3],
    }
}

fn check_numbers(numbers: &[(&str, f64)]) -> Result<()> {
    match numbers.iter().find(|(_, x)| !x.is_finite()) {
        Some((name, x)) => Err(Error::domain(format!(
            "{name} = {x} of a history in time must be finite"
        ))),
        None => Ok(()),
    }
}

fn check_growing(what: &str, times: &[f64]) -> Result<()> {
    let sound = times.iter().all(|t| t.is_finite()) && times.is_sorted_by(|a, b| a < b);
    if sound {
        return Ok(());
    }
    Err(Error::domain(format!(
        "the times {times:?} of {what} must be finite, each later than the one before"
    )))
}

fn check_table(points: &[[f64; 2]]) -> Result<()> {
    if points.is_empty() {
        return Err(Error::domain("a table needs at least one point [t, f]"));
    }
    for pair in points.windows(2) {
        check_growing("a table", &[pair[0][0], pair[1][0]])?;
    }
    for point in points {
        check_numbers(&[("time", point[0]), ("value", point[1])])?;
    }
    Ok(())
}
