//! One half of a lobe of a ring under pressure, from the lobe's tip on: integrals over the wall, and Newton's method
//! for their conditions.
//!
//! Units are R (the perimeter is 2 pi R), the bending stiffness D per axial length, and Kp = D/R^3 for pressure. The
//! compliance of the wall along itself is c = 1/k. At the angle phi from the tip the curvature is
//! kappa = m + d cos(phi). The wall has the stretch nu, the pull N and the arclength S
//! ```text
//! nu^2 = 1 - c (2 sigma + kappa^2),   N = (nu - 1)/c = -(2 sigma + kappa^2)/(nu + 1),   dS = dphi / (nu sqrt(Q)),
//! Q = -(N_b + N_t)/(nu_b + nu_t) + 2 (a + b)(a + t) / ((nu_a + nu_t)(nu_b + nu_t)(nu_a + nu_b)),
//! P = -(a + b)(N_a + N_b) / (2 (nu_a + nu_b)),
//! ```
//! The curvature at phi is t, and its extremes are a = m + d and b = m - d. Q is minus the second divided
//! difference of N^2 over a, b, t. For c = 0 it is ((2m + d cos phi)^2 + nu^2)/4 of docs/tubes.md 1.

use nalgebra::{Matrix4, Vector4};
use num_dual::{Dual64, DualNum};
use snaprod_core::math::gauss::Rule;

/// Numbers of a lobe: m, d, sigma and the angle phi at which the integrals end.
pub(super) type Numbers = Vector4<f64>;
pub(super) const M: usize = 0;
pub(super) const D: usize = 1;
pub(super) const SIGMA: usize = 2;
pub(super) const END: usize = 3;

/// The wall from the tip of a lobe to the angle `end`.
#[derive(Debug, Clone, Copy)]
pub(super) struct Lobe<T> {
    pub m: T,
    pub d: T,
    pub sigma: T,
    pub end: T,
    pub compliance: f64,
}

/// Integrals over the wall of a lobe, from tip to end.
#[derive(Debug, Clone, Copy)]
pub(super) struct Integrals<T> {
    /// Arclength of the unstretched wall.
    pub length: T,
    /// Angle by which the tangent turns.
    pub turn: T,
    /// Energy of bending and of stretching.
    pub energy: T,
    /// Minus the integral of N over the stretched wall: twice pressure times the area that the wall sweeps.
    pub pull: T,
}

/// Curvature, stretch, pull and dphi-speed of the wall at one angle.
#[derive(Debug, Clone, Copy)]
pub(super) struct Place<T> {
    pub curvature: T,
    pub stretch: T,
    pub pull: T,
    /// sqrt(Q): dphi/dS over the stretch.
    pub speed: T,
}

impl Lobe<f64> {
    pub fn new(numbers: &Numbers, compliance: f64) -> Self {
        Self {
            m: numbers[M],
            d: numbers[D],
            sigma: numbers[SIGMA],
            end: numbers[END],
            compliance,
        }
    }
}

impl Lobe<Dual64> {
    /// The lobe with its derivatives along `direction` in the numbers.
    pub fn along(numbers: &Numbers, direction: &Numbers, compliance: f64) -> Self {
        let number = |k: usize| Dual64::new(numbers[k], direction[k]);
        Self {
            m: number(M),
            d: number(D),
            sigma: number(SIGMA),
            end: number(END),
            compliance,
        }
    }
}

impl<T: DualNum<Primitive = f64> + Copy> Lobe<T> {
    /// Stretch and pull where the curvature is `curvature`.
    fn stretch_and_pull(&self, curvature: T) -> (T, T) {
        let load = self.sigma * 2.0 + curvature * curvature;
        let stretch = (-load * self.compliance + 1.0).sqrt();
        (stretch, -load / (stretch + 1.0))
    }

    /// The wall at the angle `phi`.
    pub fn place(&self, phi: T) -> Place<T> {
        let (a, b) = (self.m + self.d, self.m - self.d);
        let curvature = self.m + self.d * phi.cos();
        let (stretch, pull) = self.stretch_and_pull(curvature);
        let (stretch_a, _) = self.stretch_and_pull(a);
        let (stretch_b, pull_b) = self.stretch_and_pull(b);
        let with_b = stretch_b + stretch;
        let square = -(pull_b + pull) / with_b
            + (a + b) * (a + curvature) * 2.0
                / ((stretch_a + stretch) * with_b * (stretch_a + stretch_b));
        Place {
            curvature,
            stretch,
            pull,
            speed: square.sqrt(),
        }
    }

    /// Pressure P.
    pub fn pressure(&self) -> T {
        let (a, b) = (self.m + self.d, self.m - self.d);
        let (stretch_a, pull_a) = self.stretch_and_pull(a);
        let (stretch_b, pull_b) = self.stretch_and_pull(b);
        -(a + b) * (pull_a + pull_b) / ((stretch_a + stretch_b) * 2.0)
    }

    /// Integrals from the tip to the angle `end`, by Gauss' rule.
    pub fn integrals(&self, rule: &Rule) -> Integrals<T> {
        let zero = self.m * 0.0;
        let mut sums = Integrals {
            length: zero,
            turn: zero,
            energy: zero,
            pull: zero,
        };
        for (node, weight) in rule.nodes.iter().zip(&rule.weights) {
            let at = self.place(self.end * *node);
            let over = self.end * *weight / at.speed;
            let part = over / at.stretch;
            let stored = at.curvature * at.curvature + at.pull * at.pull * self.compliance;
            sums.length += part;
            sums.turn += part * at.curvature;
            sums.energy += part * stored * 0.5;
            sums.pull -= over * at.pull;
        }
        sums
    }
}

/// Four conditions on a lobe: each is zero where it holds.
pub(super) type Conditions<'a> = &'a dyn Fn(&Lobe<Dual64>) -> [Dual64; 4];

/// A root of four conditions on the numbers of a lobe by Newton's method, with the Jacobian there; `None` without
/// convergence.
pub(super) fn solve(
    conditions: Conditions<'_>,
    guess: &Numbers,
    compliance: f64,
) -> Option<(Numbers, Matrix4<f64>)> {
    let mut numbers = *guess;
    let mut last = f64::INFINITY;
    for _ in 0..40 {
        let mut off = Vector4::zeros();
        let mut jacobian = Matrix4::zeros();
        for (k, mut column) in jacobian.column_iter_mut().enumerate() {
            let mut direction = Numbers::zeros();
            direction[k] = 1.0;
            let rows = conditions(&Lobe::along(&numbers, &direction, compliance));
            off = Vector4::from_fn(|i, _| rows[i].re);
            column.copy_from(&Vector4::from_fn(|i, _| rows[i].eps));
        }
        let step = jacobian.lu().solve(&off)?;
        let size = step.amax();
        if !size.is_finite() {
            return None;
        }
        numbers -= step;
        // Rounding sets a floor: steps no longer shrink there.
        if size < 1e-15 || size < 1e-11 && size >= 0.5 * last {
            return Some((numbers, jacobian));
        }
        last = size;
    }
    None
}
