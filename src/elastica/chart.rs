//! The amplitude chart (p, w) of the elastica's equilibria, in closed form.
//!
//! Measured from the free end, psi = theta - alpha is a librating pendulum with
//! sin(psi/2) = kap cos(phi), kap = tanh p; the amplitude phi runs from 0 at the tip to w at the
//! clamp. Units: length 1, bending stiffness 1.

use crate::math::carlson::{complete_kb, rf_rd};
use std::f64::consts::{LN_2, PI};

/// tan(phi_jacobi) = sin w / kap' beyond which the incomplete integrals are elementary to rounding:
/// the neglected terms are of relative size lam / TAUT^2.
const TAUT: f64 = 1e9;
/// p beyond which kap'^2 is below rounding and K, B are elementary.
const FLAT: f64 = 22.0;

/// The modulus at `p`: kap = tanh p and kap' = sech p, each to a few ulp.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Modulus {
    /// kap = tanh p, in (-1, 1); rounds to +-1 for |p| > 19.
    pub kap: f64,
    /// kap' = sech p in (0, 1]; underflows to 0 beyond |p| = 745.
    pub kap_c: f64,
}

impl Modulus {
    /// kap and kap' at p, without the cancellation of 1 - kap^2.
    #[inline]
    pub fn new(p: f64) -> Self {
        let e = (-p.abs()).exp();
        if e < 0.6 {
            let scale = 1.0 / (1.0 + e * e);
            let kap = (1.0 - e * e) * scale;
            return Self {
                kap: kap.copysign(p),
                kap_c: 2.0 * e * scale,
            };
        }
        let m = (-2.0 * p.abs()).exp_m1();
        let scale = 1.0 / (2.0 + m);
        Self {
            kap: (-m * scale).copysign(p),
            kap_c: 2.0 * e * scale,
        }
    }
}

/// The closed form at one chart point: what every quantity of the equilibrium is made of.
///
/// With D(t)^2 = kap'^2 + kap^2 sin^2 t:
/// lam = int_0^w dt/D, b = int_0^w sin^2 t/D dt, d = D(w), s = sin w, c = cos w.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Integrals {
    pub kap: f64,
    pub kap_c: f64,
    pub s: f64,
    pub c: f64,
    pub d: f64,
    pub lam: f64,
    pub b: f64,
}

impl Integrals {
    /// Evaluates lam and B at (p, w), w >= 0. Relative accuracy of a few ulp in each (plus the
    /// conditioning in w where D(w) is small), for every p, also where kap' underflows.
    #[inline]
    pub fn new(p: f64, w: f64) -> Self {
        let Modulus { kap, kap_c } = Modulus::new(p);
        let (s, c) = w.sin_cos();
        let (sa, ca) = (s.abs(), c.abs());
        // tau = |s| / kap', formed without overflow of cosh p.
        let tau = if p.abs() < 700.0 {
            sa / kap_c
        } else {
            let half = (0.5 * p.abs()).exp();
            sa * half * 0.5 * half
        };
        let stretch2 = 1.0 + (kap * tau) * (kap * tau);
        let d = if tau < TAUT {
            kap_c * stretch2.sqrt()
        } else {
            kap.abs() * sa
        };
        let (lam_r, b_r) = if tau < TAUT {
            let (rf, rd) = rf_rd(ca * ca, stretch2, 1.0);
            (tau * rf, kap_c * kap_c * tau * tau * tau * rd / 3.0)
        } else {
            taut(p.abs(), sa, ca)
        };
        let (lam, b) = if w < 0.5 * PI {
            (lam_r, b_r)
        } else {
            let n = (w / PI).round();
            let (k_full, b_full) = if p.abs() > FLAT {
                (p.abs() + LN_2, 1.0)
            } else {
                complete_kb(kap_c)
            };
            // sin(w - n pi) has the sign of w - n pi; it is (-1)^n sin w.
            let beyond = if (n as i64) & 1 == 0 { s } else { -s };
            let sign = 1f64.copysign(beyond);
            (
                2.0 * n * k_full + sign * lam_r,
                2.0 * n * b_full + sign * b_r,
            )
        };
        Self {
            kap,
            kap_c,
            s,
            c,
            d,
            lam,
            b,
        }
    }

    /// lam_p = kap (B + c s/D) at fixed w.
    #[inline]
    pub fn lam_p(&self) -> f64 {
        self.kap * (self.b + self.c * self.s / self.d)
    }

    /// int_0^w D dt = kap'^2 lam + kap^2 B.
    #[inline]
    pub fn de(&self) -> f64 {
        self.kap_c * self.kap_c * self.lam + self.kap * self.kap * self.b
    }
}

/// (lam, B) of the taut limit: lam = p + ln(2 tan(w/2)), B = 1 - cos w (theory: the rod is an arc of
/// a separatrix, exact up to exp(-2 lam)).
fn taut(p: f64, s: f64, c: f64) -> (f64, f64) {
    let half = s / (1.0 + c);
    (p + LN_2 + half.ln(), s * half)
}
