//! Scalar histories f(t), from which loads in time and motions of the clamp are made.

use super::spline::RestSpline;
use crate::error::{Error, Result};
use std::f64::consts::PI;
use std::fmt;
use std::sync::Arc;

/// A scalar function of time, with its first two derivatives and its breaks.
///
/// A break is a time at which some derivative jumps, or near which the function does something that a long step would not
/// see. Runs end a step at every break, so that no kink lies inside a step and no pulse is passed over.
#[derive(Clone)]
pub struct History(Form);

#[derive(Clone)]
enum Form {
    Constant(f64),
    Rate(f64),
    Sine {
        amplitude: f64,
        angular_frequency: f64,
        phase: f64,
    },
    Ramp {
        times: [f64; 2],
        values: [f64; 2],
    },
    Pulse {
        times: [f64; 2],
        height: f64,
    },
    Table(Vec<[f64; 2]>),
    Smooth(RestSpline),
    Custom {
        f: Arc<dyn Fn(f64) -> [f64; 3] + Send + Sync>,
        breaks: Vec<f64>,
    },
}

impl History {
    /// f = value.
    ///
    /// # Errors
    /// A value that is not finite.
    pub fn constant(value: f64) -> Result<Self> {
        finite(&[("value", value)])?;
        Ok(Self(Form::Constant(value)))
    }

    /// f = rate t.
    ///
    /// # Errors
    /// A rate that is not finite.
    pub fn rate(rate: f64) -> Result<Self> {
        finite(&[("rate", rate)])?;
        Ok(Self(Form::Rate(rate)))
    }

    /// f = amplitude sin(angular_frequency t + phase); the angular frequency in radians per unit of time.
    ///
    /// # Errors
    /// A number that is not finite.
    pub fn sine(amplitude: f64, angular_frequency: f64, phase: f64) -> Result<Self> {
        finite(&[
            ("amplitude", amplitude),
            ("angular_frequency", angular_frequency),
            ("phase", phase),
        ])?;
        Ok(Self(Form::Sine {
            amplitude,
            angular_frequency,
            phase,
        }))
    }

    /// f = values\[0\] before times\[0\], values\[1\] after times\[1\], linear in between. Kinks at both times.
    ///
    /// # Errors
    /// Times that do not grow; a number that is not finite.
    pub fn ramp(times: [f64; 2], values: [f64; 2]) -> Result<Self> {
        finite(&[("value", values[0]), ("value", values[1])])?;
        growing("a ramp", &times)?;
        Ok(Self(Form::Ramp { times, values }))
    }

    /// A raised cosine: f = height (1 - cos(2 pi (t - times\[0\])/(times\[1\] - times\[0\])))/2 between the times, 0 outside.
    ///
    /// Its integral is height (times\[1\] - times\[0\])/2. f and f' are continuous, f'' jumps at both times.
    ///
    /// # Errors
    /// Times that do not grow; a number that is not finite.
    pub fn pulse(times: [f64; 2], height: f64) -> Result<Self> {
        finite(&[("height", height)])?;
        growing("a pulse", &times)?;
        Ok(Self(Form::Pulse { times, height }))
    }

    /// Through the points \[t, f\], linear between them, constant before the first and after the last: f' jumps at each.
    ///
    /// # Errors
    /// No point; times that do not grow; a number that is not finite.
    pub fn table(points: Vec<[f64; 2]>) -> Result<Self> {
        listed("a table", &points)?;
        Ok(Self(Form::Table(points)))
    }

    /// Through the points \[t, f\] with four continuous derivatives, at rest before the first and after the last.
    ///
    /// It is the spline of degree 5 with f' = f'' = 0 at both ends: f'' is continuous everywhere, as motions of a clamp need.
    ///
    /// # Errors
    /// No point; times that do not grow; a number that is not finite.
    pub fn smooth(points: &[[f64; 2]]) -> Result<Self> {
        listed("a table", points)?;
        RestSpline::new(points)
            .map(|spline| Self(Form::Smooth(spline)))
            .ok_or_else(|| {
                Error::domain("a table's times lie too unevenly for a smooth curve: thin them out")
            })
    }

    /// Any function, which gives \[f, f', f''\]; loads use f alone. `breaks` are the times, in growing order, at which it is
    /// not smooth, and others that mark where it varies fast: a function that is flat except between two distant steps of the
    /// motion would else go unseen.
    ///
    /// # Errors
    /// Breaks that do not grow.
    pub fn custom(
        f: impl Fn(f64) -> [f64; 3] + Send + Sync + 'static,
        breaks: Vec<f64>,
    ) -> Result<Self> {
        growing("breaks", &breaks)?;
        let f = Arc::new(f);
        Ok(Self(Form::Custom { f, breaks }))
    }

    /// f(t).
    #[inline]
    pub fn at(&self, t: f64) -> f64 {
        match &self.0 {
            Form::Sine {
                amplitude,
                angular_frequency,
                phase,
            } => amplitude * (angular_frequency * t + phase).sin(),
            _ => self.with_rates(t)[0],
        }
    }

    /// \[f, f', f''\] at t; at a break where they jump, from one side.
    pub fn with_rates(&self, t: f64) -> [f64; 3] {
        match &self.0 {
            Form::Constant(value) => [*value, 0.0, 0.0],
            Form::Rate(rate) => [rate * t, *rate, 0.0],
            Form::Sine {
                amplitude,
                angular_frequency: w,
                phase,
            } => {
                let (sin, cos) = (w * t + phase).sin_cos();
                [
                    amplitude * sin,
                    amplitude * w * cos,
                    -amplitude * w * w * sin,
                ]
            }
            Form::Ramp { times, values } => line(t, &[times[0], values[0]], &[times[1], values[1]]),
            Form::Pulse { times, height } => {
                if !(times[0] < t && t < times[1]) {
                    return [0.0; 3];
                }
                let w = 2.0 * PI / (times[1] - times[0]);
                let (half, cos) = ((0.5 * w * (t - times[0])).sin(), (w * (t - times[0])).cos());
                [
                    height * half * half,
                    0.5 * height * w * (w * (t - times[0])).sin(),
                    0.5 * height * w * w * cos,
                ]
            }
            Form::Table(points) => {
                let after = points.partition_point(|p| p[0] <= t);
                let before = after.saturating_sub(1);
                line(t, &points[before], &points[after.min(points.len() - 1)])
            }
            Form::Smooth(spline) => spline.at(t),
            Form::Custom { f, .. } => f(t),
        }
    }

    /// The first break after `t`; infinite if none is left.
    pub fn next_break(&self, t: f64) -> f64 {
        let first = |times: &[f64]| {
            let next = times.partition_point(|s| *s <= t);
            times.get(next).copied().unwrap_or(f64::INFINITY)
        };
        match &self.0 {
            Form::Constant(_) | Form::Rate(_) | Form::Sine { .. } => f64::INFINITY,
            Form::Ramp { times, .. } => first(times),
            Form::Pulse { times: [a, b], .. } => first(&[*a, 0.5 * (a + b), *b]),
            Form::Table(points) => {
                let next = points.partition_point(|p| p[0] <= t);
                points.get(next).map_or(f64::INFINITY, |p| p[0])
            }
            Form::Smooth(spline) => first(spline.times()),
            Form::Custom { breaks, .. } => first(breaks),
        }
    }

    /// True if f'' is continuous after the start, as the motion of a clamp must be: a jump of f' would be a blow. A custom
    /// function is trusted.
    pub fn is_smooth(&self) -> bool {
        !matches!(
            self.0,
            Form::Ramp { .. } | Form::Pulse { .. } | Form::Table(_)
        )
    }
}

impl fmt::Debug for History {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match &self.0 {
            Form::Constant(value) => write!(f, "Constant({value})"),
            Form::Rate(rate) => write!(f, "Rate({rate})"),
            Form::Sine {
                amplitude,
                angular_frequency,
                phase,
            } => write!(f, "Sine({amplitude}, {angular_frequency}, {phase})"),
            Form::Ramp { times, values } => write!(f, "Ramp({times:?}, {values:?})"),
            Form::Pulse { times, height } => write!(f, "Pulse({times:?}, {height})"),
            Form::Table(points) => write!(f, "Table({points:?})"),
            Form::Smooth(spline) => write!(f, "Smooth({:?})", spline.times()),
            Form::Custom { breaks, .. } => write!(f, "Custom(.., {breaks:?})"),
        }
    }
}

/// The line from a to b with its rates, constant outside.
fn line(t: f64, a: &[f64; 2], b: &[f64; 2]) -> [f64; 3] {
    if t <= a[0] {
        return [a[1], 0.0, 0.0];
    }
    if t >= b[0] {
        return [b[1], 0.0, 0.0];
    }
    let slope = (b[1] - a[1]) / (b[0] - a[0]);
    [a[1] + slope * (t - a[0]), slope, 0.0]
}

fn finite(numbers: &[(&str, f64)]) -> Result<()> {
    match numbers.iter().find(|(_, x)| !x.is_finite()) {
        Some((name, x)) => Err(Error::domain(format!(
            "{name} = {x} of a history in time must be finite"
        ))),
        None => Ok(()),
    }
}

fn growing(what: &str, times: &[f64]) -> Result<()> {
    let sound = times.iter().all(|t| t.is_finite()) && times.is_sorted_by(|a, b| a < b);
    if sound {
        return Ok(());
    }
    Err(Error::domain(format!(
        "the times {times:?} of {what} must be finite, each later than the one before"
    )))
}

fn listed(what: &str, points: &[[f64; 2]]) -> Result<()> {
    if points.is_empty() {
        return Err(Error::domain(format!(
            "{what} needs at least one point [t, f]"
        )));
    }
    for pair in points.windows(2) {
        growing(what, &[pair[0][0], pair[1][0]])?;
    }
    for point in points {
        finite(&[("time", point[0]), ("value", point[1])])?;
    }
    Ok(())
}
