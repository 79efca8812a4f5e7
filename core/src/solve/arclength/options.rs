//! Options of a continuation: range, steps, tolerances.

use crate::error::{Error, Result};

/// Direction along the branch at the start.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Direction {
    /// p moves from `from` towards `to` at first.
    Forward,
    /// p moves away from `to` at first.
    Backward,
}

/// Predictor of the next point.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Predictor {
    /// Along the tangent: error of second order in the step.
    Tangent,
    /// Along the cubic through the last two points and tangents: fourth order.
    Cubic,
}

/// Options of a continuation. Lengths are arclengths: sqrt(|dx|^2 + weight^2 dp^2).
#[derive(Debug, Clone, PartialEq)]
pub struct Options {
    /// One end of the range of p; the branch ends where p leaves the range between `from` and `to` (either may be
    /// infinite), and its last point lies exactly on the end.
    pub from: f64,
    /// Second end of the range of p, see `from`.
    pub to: f64,
    /// Values of p to be hit exactly on the way, each time the branch passes one (a value
    /// so near a fold that rounding hides it may be left out).
    pub at: Vec<f64>,
    /// Direction at the start; forward is towards `to`.
    pub direction: Direction,
    /// The first step, within [`min_step`, `max_step`].
    pub initial_step: f64,
    /// Smallest step; the branch stops if a smaller one is needed; > 0.
    pub min_step: f64,
    /// Largest step, and so the largest distance of points, for drawing.
    pub max_step: f64,
    /// Distance of points from the branch, relative to 1 + |(x, weight p)|; in (0, 1e-2).
    pub tolerance: f64,
    /// The weight of p against x in lengths and angles; > 0. Rounded to a power of two, so that no
    /// digit of p is lost.
    pub weight: f64,
    /// The largest angle between neighbouring tangents, in radians; in (0, 1.5).
    pub max_angle: f64,
    /// Most corrections per point, >= 2.
    pub max_corrections: usize,
    /// Most points, >= 1.
    pub max_points: usize,
    /// See [`Predictor`].
    pub predictor: Predictor,
    /// True if special points are to be located.
    pub special: bool,
}

impl Options {
    /// p between `from` and `to`, other options at their defaults: steps 0.02, 1e-7 to 0.2; tolerance
    /// 1e-10; weight 1; angle 0.4; 7 corrections; 2000 points; cubic prediction.
    pub fn between(from: f64, to: f64) -> Self {
        Self {
            from,
            to,
            at: Vec::new(),
            direction: Direction::Forward,
            initial_step: 0.02,
            min_step: 1e-7,
            max_step: 0.2,
            tolerance: 1e-10,
            weight: 1.0,
            max_angle: 0.4,
            max_corrections: 7,
            max_points: 2000,
            predictor: Predictor::Cubic,
            special: true,
        }
    }

    /// Checks the values.
    ///
    /// # Errors
    /// A value outside its set; the message names the option.
    pub fn check(&self) -> Result<()> {
        let refuse = |name: &str, value: f64, allowed: &str| {
            Err(Error::domain(format!(
                "continuation: {name} = {value} must be {allowed}"
            )))
        };
        if self.from.is_nan() || self.to.is_nan() || self.from == self.to {
            return refuse(
                "to",
                self.to,
                "different from `from`, and neither of them NaN",
            );
        }
        if let Some(&value) = self.at.iter().find(|v| !v.is_finite()) {
            return refuse("at", value, "finite");
        }
        let positive = 0.0..f64::INFINITY;
        for (name, value, range, allowed) in [
            ("min_step", self.min_step, positive.clone(), "positive"),
            (
                "max_step",
                self.max_step,
                self.min_step..f64::INFINITY,
                "larger than min_step",
            ),
            ("weight", self.weight, positive, "positive"),
            ("tolerance", self.tolerance, 0.0..1e-2, "in (0, 0.01)"),
            ("max_angle", self.max_angle, 0.0..1.5, "in (0, 1.5)"),
        ] {
            if !(range.start < value && value < range.end) {
                return refuse(name, value, allowed);
            }
        }
        if !(self.min_step <= self.initial_step && self.initial_step <= self.max_step) {
            return refuse(
                "initial_step",
                self.initial_step,
                "between min_step and max_step",
            );
        }
        for (name, value, least) in [
            ("max_corrections", self.max_corrections, 2),
            ("max_points", self.max_points, 1),
        ] {
            if value < least {
                return refuse(name, value as f64, &format!("at least {least}"));
            }
        }
        Ok(())
    }

    /// The weight in use: the nearest power of two.
    pub(in crate::solve) fn rounded_weight(&self) -> f64 {
        self.weight.log2().round().exp2()
    }

    pub(super) fn contains(&self, p: f64) -> bool {
        self.from.min(self.to) <= p && p <= self.from.max(self.to)
    }
}
