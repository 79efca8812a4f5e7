//! Nearly straight rods, by their end force and the deflection of their end.
//!
//! The chart (p, w) collapses onto the straight rod: p = 0 holds it under every push, p -> +-infinity under every
//! pull. The coordinates here are the pull N along the clamp's axis and the deflection y of the end. In them the
//! neighbours of the straight rod are smooth through N = 0. The rod solves
//! ```text
//! theta'' = N sin theta - F cos theta,   theta(0) = 0,   theta'(1) = 0,   int_0^1 sin theta ds = y
//! ```
//! for theta and the cross force F. To leading order F is proportional to y, and 1 - x = c(N) y^2, c(0) = 3/5
//! (theory 2.3). Units: length 1, bending stiffness 1.

use super::chart::Integrals;
use crate::error::{Error, Message, Quantity};
use crate::math::gauss::Rule;
use nalgebra::{DMatrix, DVector};
use std::f64::consts::PI;

/// Euler's load: the straight rod buckles under this push.
pub const EULER: f64 = 0.25 * PI * PI;
/// Error for a push along the straight rod beyond [`EULER`].
pub fn unstable_push_error(push: f64) -> Error {
    Error::domain(
        Message::from("a push of ")
            .number(push, Quantity::Force)
            .words(" along the rod is beyond Euler's load, (pi^2/4) EI/L^2 = ")
            .number(EULER, Quantity::Force)
            .words(
                ": the straight rod is unstable, and which way it buckles is not determined; give it an imperfection \
                 (imperfection = 0.01 in [start], the angle of its end), a velocity or a load across, or less load along the rod",
            ),
    )
}

/// Largest pull served: the grid must resolve the bend at the clamp, of width 1/lam.
pub const MOST_PULL: f64 = 3600.0;

/// Nearly straight rod, made by [`AlmostStraight::at`].
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct NearlyStraightShape {
    /// Pull N: the x component of the force on the rod's end.
    pub pull: f64,
    /// Cross force F: the y component of the force on the rod's end.
    pub across: f64,
    /// 1 - x, of full relative accuracy.
    pub one_minus_x: f64,
    /// Angle of the tangent at the end.
    theta1: f64,
    /// theta'(0).
    clamp_curvature: f64,
}

/// The boundary value problem, discretised.
pub struct AlmostStraight {
    /// The weights of the Gauss nodes along the rod.
    weights: AngleField,
    /// theta' from theta'', with theta'(1) = 0.
    once: DMatrix<f64>,
    /// theta from theta'', with both end conditions.
    twice: DMatrix<f64>,
}

type AngleField = DVector<f64>;

impl AlmostStraight {
    /// Discretisation for pulls up to `most_pull`, which is cut at [`MOST_PULL`].
    pub fn new(most_pull: f64) -> Self {
        let lam = most_pull.clamp(0.0, MOST_PULL).sqrt();
        let rule = Rule::new((24.0 + 1.2 * lam) as usize);
        let (integrate, _) = rule.matrices();
        let once = integrate.map_with_location(|_, j, value| value - rule.weights[j]);
        Self {
            twice: integrate * &once,
            once,
            weights: rule.weights.into(),
        }
    }

    /// Rod under the pull `pull` > -[`EULER`] with its end at the height `y`, by Newton's method from the straight
    /// rod; `None` if y is too large for convergence.
    pub fn at(&self, pull: f64, y: f64) -> Option<NearlyStraightShape> {
        let (theta, across) = self.solve_shape(pull, y)?;
        Some(self.bent(pull, across, &theta))
    }

    /// theta at the nodes, and the cross force F.
    fn solve_shape(&self, pull: f64, y: f64) -> Option<(AngleField, f64)> {
        let (n, weights) = (self.weights.len(), &self.weights);
        let (mut theta, mut across) = (AngleField::zeros(n), 0.0);
        let mut matrix = DMatrix::zeros(n + 1, n + 1);
        for _ in 0..20 {
            let (sin, cos) = (theta.map(f64::sin), theta.map(f64::cos));
            let couple = &sin * pull - &cos * across;
            let mut right = (&self.twice * &couple - &theta).push(y - weights.dot(&sin));
            for j in 0..n {
                let slope = cos[j] * pull + sin[j] * across;
                for i in 0..n {
                    matrix[(i, j)] = -self.twice[(i, j)] * slope;
                }
                matrix[(j, j)] += 1.0;
                matrix[(n, j)] = weights[j] * cos[j];
            }
            let column = &self.twice * cos;
            matrix.view_mut((0, n), (n, 1)).copy_from(&column);
            matrix[(n, n)] = 0.0;
            if !matrix.clone().lu().solve_mut(&mut right) {
                return None;
            }
            let change = right.rows(0, n);
            theta += change;
            across += right[n];
            if change.amax() <= 1e-15 * theta.amax() {
                return Some((theta, across));
            }
            if !(theta.amax() < 1.0) {
                return None;
            }
        }
        // Newton's method ends at rounding: check only that the angle has stayed small.
        (theta.amax() < 1.0).then_some((theta, across))
    }

    fn bent(&self, pull: f64, across: f64, theta: &AngleField) -> NearlyStraightShape {
        let couple = theta.map(|t| pull * t.sin() - across * t.cos());
        let curvature = &self.once * &couple;
        let weights = &self.weights;
        NearlyStraightShape {
            pull,
            across,
            one_minus_x: weights.dot(&theta.map(|t| 2.0 * (0.5 * t).sin().powi(2))),
            theta1: weights.dot(&curvature),
            clamp_curvature: -weights.dot(&couple),
        }
    }

    /// Law of shortening (c, dc/dN): 1 - x = c(N) y^2 for small y; the derivative to three digits.
    pub fn shortening(&self, pull: f64) -> Option<(f64, f64)> {
        let y = 1e-6;
        let c = |pull: f64| Some(self.at(pull, y)?.one_minus_x / (y * y));
        let h = 1e-4 * (1.0 + pull.abs()).min(EULER + pull);
        Some((c(pull)?, (c(pull + h)? - c(pull - h)?) / (2.0 * h)))
    }
}

impl NearlyStraightShape {
    /// Amplitude chart point (p, w).
    ///
    /// The first integral of the rod's equation gives kap sin w = theta'(0)/(2 lam) and kap cos w = -sin(alpha/2),
    /// alpha the direction of the force on the body. Under a push p follows from kap = sin((theta(1) - alpha)/2).
    /// Under a pull this angle is nearly a right one, and p is found from lam(p, w) = lam.
    pub fn chart(&self) -> [f64; 2] {
        let lam = self.across.hypot(self.pull).sqrt();
        let alpha = (-self.across).atan2(-self.pull);
        let along = (0.5 * alpha).sin().abs();
        let w = (0.5 * self.clamp_curvature / lam).abs().atan2(along);
        if self.pull <= 0.0 {
            return [(0.5 * (self.theta1 - alpha)).tan().asinh(), w];
        }
        // Exact for w -> 0: sinh lam = 2 tan(w/2)/kap'.
        let half = (0.5 * w).tan();
        let mut p = if lam < 20.0 {
            (lam.sinh() / (2.0 * half)).max(1.0).acosh()
        } else {
            lam - (2.0 * half).ln()
        };
        for _ in 0..4 {
            let at = Integrals::new(p, w);
            p += (lam - at.lam) / at.lam_p();
        }
        [p.copysign(self.across), w]
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::elastica::Equilibrium;

    /// Catches a wrong branch of p or w, and a digit lost in the change of chart. Pulled, pushed and free rods, bent
    /// from y = 1e-120 up, must have the same end and force in the closed form.
    #[test]
    fn bent_rods_are_where_the_closed_form_has_them() {
        for pull in [-2.3, -1.0, -1e-3, 0.0, 1e-9, 0.3, 5.0, 60.0, 700.0] {
            let rods = AlmostStraight::new(pull);
            for y in [1e-120, -1e-60, 1e-9, -1e-4, 0.03, -0.1] {
                let bent = rods.at(pull, y).unwrap();
                let [p, w] = bent.chart();
                let exact = Equilibrium::new(p, w).unwrap();
                let close = |a: f64, b: f64| (a - b).abs() <= 3e-13 * b.abs();
                let same = close(exact.y, y)
                    && close(exact.one_minus_x, bent.one_minus_x)
                    && (exact.force[0] + pull).abs() <= 3e-13 * (1.0 + pull.abs())
                    && close(-exact.force[1], bent.across);
                assert!(same, "N = {pull}, y = {y}: {bent:?} {exact:?}");
            }
        }
    }

    /// Catches a wrong law of shortening. Reference: the closed form of theory 2.3.
    #[test]
    fn shortening_is_that_of_the_beam() {
        for pull in [-2.4, -1.0, 1e-2, 4.0, 900.0] {
            let b = f64::abs(pull).sqrt();
            // tanh(b)/b and 1/cosh^2 b; b is imaginary under a push.
            let (t, sech2) = if pull > 0.0 {
                (b.tanh() / b, b.cosh().powi(-2))
            } else {
                (b.tan() / b, b.cos().powi(-2))
            };
            let expected = 0.5 * (1.0 - 1.5 * t + 0.5 * sech2) / (1.0 - t).powi(2);
            let (c, slope) = AlmostStraight::new(pull).shortening(pull).unwrap();
            assert!(
                (c - expected).abs() < 2e-11 && slope < 0.0,
                "{pull}: {c}, {expected}, {slope}"
            );
        }
    }
}
