//! Tip of the slightly loaded rod, lam < 0.3, where the closed form is a small difference of large terms.
//!
//! 1 - x is of order lam^4 and det d(x, y)/d(p, lam) of order lam^6. Here they come from integrals along the rod
//! whose integrands keep their own relative accuracy.

use super::chart::{Integrals, Modulus};

/// Load lam below which the closed form loses more than three digits of det.
pub(super) const SLIGHT: f64 = 0.3;

/// Gauss-Legendre, 8 nodes on (0, 1). The nearest singularities of the integrands lie at
/// |Im t| > 5 w for lam < 0.3: the error is below 20^-16.
const NODES: [(f64, f64); 8] = [
    (0.019855071751231912, 0.05061426814518853),
    (0.10166676129318664, 0.11119051722668721),
    (0.2372337950418355, 0.15685332293894344),
    (0.4082826787521751, 0.18134189168918083),
    (0.5917173212478248, 0.18134189168918083),
    (0.7627662049581645, 0.15685332293894344),
    (0.8983332387068134, 0.11119051722668721),
    (0.9801449282487681, 0.05061426814518853),
];

/// Tip (1 - x, y) and its derivatives by p (at fixed lam) and by lam, in the fixed axes.
pub(super) struct SlightTip {
    pub one_minus_x: f64,
    pub y: f64,
    /// d(x, y)/dp at fixed lam.
    pub along_p: [f64; 2],
    /// d(x, y)/dlam at fixed p.
    pub along_lam: [f64; 2],
}

impl SlightTip {
    /// Integrates along the rod of the chart line `p` whose integrals up to the clamp are `clamp`.
    ///
    /// With t the amplitude at a section and w that of the clamp, sin(theta/2) = kap (cos^2 t - cos^2 w)/(cos t
    /// D(w) + cos w D(t)); theta_p = 2 (P(t) - P(w)), P = c D + kap^2 s B; theta_lam = -2 kap ((1 - s) sin t - sin
    /// w), 1 - s = lam(t)/lam.
    pub fn new(p: f64, clamp: &Integrals) -> Self {
        let Modulus { kap, kap_c } = Modulus::new(p);
        let (kap2, kc2) = (kap * kap, kap_c * kap_c);
        let w = clamp.s.atan2(clamp.c);
        let mut tip = Self {
            one_minus_x: 0.0,
            y: 0.0,
            along_p: [0.0; 2],
            along_lam: [0.0; 2],
        };
        for (node, weight) in NODES {
            let t = node * w;
            let at = Integrals::new(p, t);
            let ds = weight * w / (at.d * clamp.lam);
            // cos^2 t - cos^2 w, without cancellation.
            let gap = (w - t).sin() * (w + t).sin();
            let both = at.c * clamp.d + clamp.c * at.d;
            let half = kap * gap / both;
            let sin = 2.0 * half * (1.0 - half * half).sqrt();
            let cos = 1.0 - 2.0 * half * half;
            // c^2 D^2 = kap'^2 + (kap^2 - kap'^2) s^2 - kap^2 s^4, so the difference of c D has the factor gap.
            let squares = at.s * at.s + clamp.s * clamp.s;
            let turned = -gap * (kap2 - kc2 - kap2 * squares) / (at.c * at.d + clamp.c * clamp.d);
            let theta_p = 2.0 * (turned + kap2 * (at.s * at.b - clamp.s * clamp.b));
            let theta_lam = -2.0 * kap * (at.lam / clamp.lam * at.s - clamp.s);
            tip.one_minus_x += 2.0 * half * half * ds;
            tip.y += sin * ds;
            tip.along_p[0] -= sin * theta_p * ds;
            tip.along_p[1] += cos * theta_p * ds;
            tip.along_lam[0] -= sin * theta_lam * ds;
            tip.along_lam[1] += cos * theta_lam * ds;
        }
        tip
    }
}
