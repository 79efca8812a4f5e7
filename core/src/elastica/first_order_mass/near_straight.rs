//! First-order inertia of a nearly straight rod: the sections of a beam under tension (theory 2.9).
//!
//! Under the pull N a small deflection y of the end bends the rod to the shape of a beam,
//! ```text
//! r(s) = (s - sigma(s) y^2, w(s) y),    sigma(s) = 1/2 int_0^s w'^2
//! w'''' = N w'',   w(0) = w'(0) = w''(1) = 0,   w(1) = 1
//! ```
//! With u = 1 - s, and C = cosh(b u), S = sinh(b u)/b, b^2 = N,
//! ```text
//! h = (S - u)/N,   h' = (C - 1)/N
//! w = (h'(1) s - h(1) + h(u))/(h'(1) - h(1)),   dw/ds = (h'(1) - h'(u))/(h'(1) - h(1))
//! ```
//! Both hold through N = 0, where h is a series. Units: length 1, bending stiffness 1.

use crate::math::gauss::Rule;
use nalgebra::DMatrix;
use std::sync::OnceLock;

/// Gauss nodes along the rod: enough for a bend of width 1/b at the clamp.
const NODES: usize = 32;
/// Range of the pull N: 32 nodes resolve the strongest pull; the strongest push lies beyond Euler's load but short of
/// the pole of w (tan b = b).
const SERVED: [f64; 2] = [-19.0, 3600.0];
/// Bound on |N| for the series of h, and the number of terms.
const GENTLE: f64 = 4.0;
const TERMS: usize = 14;

/// A section of the beam.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) struct BeamSection {
    /// Position along the rod, and weight of its Gauss node.
    pub s: f64,
    pub weight: f64,
    /// w, and its derivative by the pull.
    pub across: f64,
    pub by_pull: f64,
    /// Shortening sigma(s).
    pub shortening: f64,
}

/// h and h', and their derivatives by the pull.
#[derive(Debug, Clone, Copy)]
struct Bend {
    value: [f64; 2],
    by_pull: [f64; 2],
}

impl Bend {
    /// h and h' at the distance u from the end.
    fn at(pull: f64, u: f64) -> Self {
        if pull.abs() < GENTLE {
            return Self::series(pull, u);
        }
        let b = pull.abs().sqrt();
        let (c, s) = if pull > 0.0 {
            ((b * u).cosh(), (b * u).sinh() / b)
        } else {
            ((b * u).cos(), (b * u).sin() / b)
        };
        let value = [(s - u) / pull, (c - 1.0) / pull];
        let rates = [0.5 * (u * c - s) / pull, 0.5 * u * s];
        Self {
            value,
            by_pull: [0, 1].map(|k| (rates[k] - value[k]) / pull),
        }
    }

    /// h = sum_k N^k u^(2k+3)/(2k+3)!.
    fn series(pull: f64, u: f64) -> Self {
        let (mut value, mut by_pull) = ([0.0; 2], [0.0; 2]);
        // u^(2k+2)/(2k+2)!, N^k and k N^(k-1).
        let (mut term, mut power, mut rate) = (0.5 * u * u, 1.0, 0.0);
        for k in 0..TERMS {
            let n = (2 * k + 3) as f64;
            let parts = [term * u / n, term];
            for i in 0..2 {
                value[i] += parts[i] * power;
                by_pull[i] += parts[i] * rate;
            }
            term *= u * u / (n * (n + 1.0));
            rate = rate * pull + power;
            power *= pull;
        }
        Self { value, by_pull }
    }
}

/// Sections of the rod under `pull`; `None` outside the range served.
pub(super) fn sections(pull: f64) -> Option<[BeamSection; NODES]> {
    static KEPT: OnceLock<(Rule, DMatrix<f64>)> = OnceLock::new();
    if !(SERVED[0] < pull && pull < SERVED[1]) {
        return None;
    }
    let (rule, integrate) = KEPT.get_or_init(|| {
        let rule = Rule::new(NODES);
        let (integrate, _) = rule.matrices();
        (rule, integrate)
    });
    let clamp = Bend::at(pull, 1.0);
    let rise = clamp.value[1] - clamp.value[0];
    let rise_by_pull = clamp.by_pull[1] - clamp.by_pull[0];
    let mut sections = [BeamSection {
        s: 0.0,
        weight: 0.0,
        across: 0.0,
        by_pull: 0.0,
        shortening: 0.0,
    }; NODES];
    let mut squares = [0.0; NODES];
    for (k, at) in sections.iter_mut().enumerate() {
        (at.s, at.weight) = (rule.nodes[k], rule.weights[k]);
        let here = Bend::at(pull, 1.0 - at.s);
        let lift = |h: [f64; 2], clamp: [f64; 2]| clamp[1] * at.s - clamp[0] + h[0];
        at.across = lift(here.value, clamp.value) / rise;
        at.by_pull = (lift(here.by_pull, clamp.by_pull) - at.across * rise_by_pull) / rise;
        let slope = (clamp.value[1] - here.value[1]) / rise;
        squares[k] = 0.5 * slope * slope;
    }
    for (j, square) in squares.iter().enumerate() {
        for (at, part) in sections.iter_mut().zip(integrate.column(j)) {
            at.shortening += part * square;
        }
    }
    Some(sections)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::elastica::straight_beam::AlmostStraight;

    /// Catches a wrong shape or shortening, a wrong derivative, and digits lost where the pull vanishes. Reference:
    /// the beam equation w'' = N (w - 1) + F (1 - s) in integrated form, on both sides of every switch. F comes from
    /// the boundary value problem of the rod.
    #[test]
    fn sections_are_those_of_the_rod() {
        let pulls = [
            -18.0, -4.01, -3.99, -1.0, -1e-6, 0.0, 1e-9, 0.3, 3.99, 4.01, 60.0, 890.0, 3500.0,
        ];
        for pull in pulls {
            let found = sections(pull).unwrap();
            let rods = AlmostStraight::new(f64::max(pull, 1.0));
            let y = 1e-7;
            let force = rods.at(pull, y).map_or(f64::NAN, |bent| bent.across / y);
            let mean = |f: &dyn Fn(&BeamSection) -> f64| -> f64 {
                found.iter().map(|at| at.weight * f(at)).sum()
            };
            let bend = |at: &BeamSection| pull * (at.across - 1.0) + force * (1.0 - at.s);
            let close = |found: f64, expected: f64, what: &str| {
                let off = (found / expected - 1.0).abs();
                assert!(off < 2e-10, "{what} of {pull}: {found}, {expected}");
            };
            // w(1) = 1, and int sigma = 1/2 int (1 - s) w'^2.
            close(mean(&|at| (1.0 - at.s) * bend(at)), 1.0, "rise");
            let lever = mean(&|at| (1.0 - at.s) * at.across * bend(at));
            close(mean(&|at| at.shortening), 0.25 - 0.5 * lever, "shortening");
            let h = 1e-4;
            let [less, more] = [pull - h, pull + h].map(|pull| sections(pull).unwrap());
            for (k, at) in found.iter().enumerate() {
                let slope = (more[k].across - less[k].across) / (2.0 * h);
                let size = found[NODES / 2].by_pull.abs();
                assert!((slope - at.by_pull).abs() < 1e-5 * size, "{pull}: {k}");
            }
        }
    }
}
