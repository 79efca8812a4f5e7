//! The amplitude chart (p, w) of the elastica's equilibria, in closed form.
//!
//! Measured from the free end, psi = theta - alpha is a librating pendulum with
//! sin(psi/2) = kap cos(phi), kap = tanh p; the amplitude phi runs from 0 at the tip to w at the
//! clamp. Units: length 1, bending stiffness 1.

use super::small_load::{SLIGHT, SlightTip};
use crate::error::{Error, Result};
use crate::math::carlson::{complete_kb, rf_rd};
use crate::math::jacobi::Quotients;
use std::f64::consts::{LN_2, PI};

/// Value of tan(phi_jacobi) = sin w / kap' beyond which the incomplete integrals are elementary to rounding: the
/// neglected terms are of relative size lam / TAUT^2.
pub(super) const TAUT: f64 = 1e9;
/// Value of p beyond which kap'^2 is below rounding and K, B are elementary.
const FLAT: f64 = 22.0;

/// Largest |p| served. A mass with kinetic energy T that hits the wall at the angle gam presses to lam = T/(4
/// sin^2(gam/4)) < |p| (theory 2.3), without bound near the straight rod. The chart covers this motion wherever the
/// force lam^2 can be represented.
pub const P_MAX: f64 = 1e100;

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

/// Closed-form integrals at one chart point, from which all quantities of the equilibrium follow.
///
/// With D(t)^2 = kap'^2 + kap^2 sin^2 t:
/// lam = int_0^w dt/D, b = int_0^w sin^2 t/D dt, d = D(w), s = sin w, c = cos w.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Integrals {
    /// kap = tanh p.
    pub kap: f64,
    /// kap' = sech p.
    pub kap_c: f64,
    /// sin w.
    pub s: f64,
    /// cos w.
    pub c: f64,
    /// D(w).
    pub d: f64,
    /// int_0^w dt/D: the square root of the pull.
    pub lam: f64,
    /// int_0^w sin^2 t/D dt.
    pub b: f64,
}

impl Integrals {
    /// Evaluates lam and B at (p, w), w >= 0. Relative accuracy of a few ulp in each (plus the
    /// conditioning in w where D(w) is small), for every p, also where kap' underflows.
    #[inline]
    pub fn new(p: f64, w: f64) -> Self {
        let (s, c) = w.sin_cos();
        let half_turns = if w < 0.5 * PI { 0.0 } else { (w / PI).round() };
        Self::from_circle(p, s, c, half_turns)
    }

    /// Integrals of a point from its load and its energy U = 2 lam kap^2 B, without quadrature; kap != 0.
    #[inline(always)]
    pub(super) fn from_load_and_energy(p: f64, w: f64, lam: f64, energy: f64) -> Self {
        let Modulus { kap, kap_c } = Modulus::new(p);
        let (s, c) = w.sin_cos();
        let across = kap * s;
        Self {
            kap,
            kap_c,
            s,
            c,
            d: (kap_c * kap_c + across * across).sqrt(),
            lam,
            b: energy / (2.0 * lam * kap * kap),
        }
    }

    /// Integrals at (p, lam). For a looped rod, w near a multiple of pi, D(w) is tiny, and lam keeps digits that w as
    /// a double cannot hold.
    ///
    /// # Errors
    /// lam not in (0, 1e9), p not finite, or |p| > 345 with lam > |p|.
    pub fn at_load(p: f64, lam: f64) -> Result<Self> {
        let (s, c, half_turns) = circle_at_load(p, lam)?;
        Ok(Self {
            lam,
            ..Self::from_circle(p, s, c, half_turns)
        })
    }

    /// Integrals from s = sin w, c = cos w and the number of half turns nearest to w.
    #[inline]
    fn from_circle(p: f64, s: f64, c: f64, half_turns: f64) -> Self {
        let Modulus { kap, kap_c } = Modulus::new(p);
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
            taut_limit(p.abs(), sa, ca)
        };
        let (lam, b) = if half_turns == 0.0 {
            (lam_r, b_r)
        } else {
            let (k_full, b_full) = if p.abs() > FLAT {
                (p.abs() + LN_2, 1.0)
            } else {
                complete_kb(kap_c)
            };
            // sin(w - n pi) = (-1)^n sin w has the sign of w - n pi.
            let beyond = if half_turns as i64 & 1 == 0 { s } else { -s };
            let sign = 1f64.copysign(beyond);
            (
                2.0 * half_turns * k_full + sign * lam_r,
                2.0 * half_turns * b_full + sign * b_r,
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

/// (lam, B) of the taut limit: lam = p + ln(2 tan(w/2)), B = 1 - cos w (theory 2.3: the rod is an arc of
/// a separatrix, exact up to exp(-2 lam)).
pub(super) fn taut_limit(p: f64, s: f64, c: f64) -> (f64, f64) {
    let half = s / (1.0 + c);
    (p + LN_2 + half.ln(), s * half)
}

/// Chart point in closed form: end position, its derivatives, and the force.
///
/// In axes turned by alpha the tip stands at (X, Y) = (2 dE/lam - 1, 2 kap s/lam). The fixed axes follow by one
/// rotation, whose sine and cosine are algebraic: no angle is formed.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct ChartPoint {
    /// Integrals at the point.
    pub integrals: Integrals,
    /// cos alpha, sin alpha: the pull on the mass is lam^2 (cos alpha, sin alpha).
    pub cos_alpha: f64,
    /// Sine of the direction of the pull.
    pub sin_alpha: f64,
    /// Tip in the turned axes.
    pub turned: [f64; 2],
    /// d(x, y)/dp at fixed w, in the fixed axes.
    pub column_p: [f64; 2],
    /// d(x, y)/dw at fixed p, in the fixed axes.
    pub column_w: [f64; 2],
}

impl ChartPoint {
    /// Evaluates the chart at (p, w), w > 0.
    #[inline]
    pub fn new(p: f64, w: f64) -> Self {
        Self::from_integrals(p, Integrals::new(p, w))
    }

    /// Chart point with the load lam on the line p.
    ///
    /// # Errors
    /// As [`Integrals::at_load`].
    pub fn at_load(p: f64, lam: f64) -> Result<Self> {
        Ok(Self::from_integrals(p, Integrals::at_load(p, lam)?))
    }

    /// Chart point from p and its integrals.
    #[inline]
    pub(super) fn from_integrals(p: f64, i: Integrals) -> Self {
        let Integrals {
            kap,
            kap_c,
            s,
            c,
            d,
            lam,
            b,
        } = i;
        let kap_c2 = kap_c * kap_c;
        let (inv, inv_d) = (1.0 / lam, 1.0 / d);
        let lam_p = kap * (b + c * s * inv_d);
        let de = i.de();
        let x = 2.0 * de * inv - 1.0;
        let y = 2.0 * kap * s * inv;
        let x_p = -2.0 * inv * (kap_c2 * kap * (lam - b) + de * inv * lam_p);
        // 2 (D - dE/(lam D))/lam without the cancellation as kap -> 0.
        let x_w = 2.0 * kap * kap * (s * s - b * inv) * inv * inv_d;
        let y_p = (2.0 * kap_c2 * s - y * lam_p) * inv;
        let y_w = 2.0 * kap * (c - s * inv * inv_d) * inv;
        let alpha_p = -2.0 * kap_c2 * c * inv_d;
        let alpha_w = 2.0 * kap * s * inv_d;
        let mut point = Self {
            integrals: i,
            // Exact, since D^2 + kap^2 c^2 = 1: alpha = -2 atan2(kap c, D).
            cos_alpha: (d - kap * c) * (d + kap * c),
            sin_alpha: -2.0 * kap * c * d,
            turned: [x, y],
            column_p: [0.0; 2],
            column_w: [0.0; 2],
        };
        if lam < SLIGHT {
            point.slight(p);
        } else {
            point.column_p = point.to_fixed([x_p - y * alpha_p, y_p + x * alpha_p]);
            point.column_w = point.to_fixed([x_w - y * alpha_w, y_w + x * alpha_w]);
        }
        point
    }

    /// Replaces the derivatives by a form of full relative accuracy as lam -> 0.
    #[cold]
    fn slight(&mut self, p: f64) {
        let i = &self.integrals;
        let tip = SlightTip::new(p, i);
        let lam_p = i.lam_p();
        self.column_p = std::array::from_fn(|k| tip.along_p[k] + tip.along_lam[k] * lam_p);
        self.column_w = tip.along_lam.map(|v| v / i.d);
    }

    /// Rotates a vector from the turned axes to the fixed ones.
    #[inline]
    pub fn to_fixed(&self, v: [f64; 2]) -> [f64; 2] {
        [
            self.cos_alpha * v[0] - self.sin_alpha * v[1],
            self.sin_alpha * v[0] + self.cos_alpha * v[1],
        ]
    }

    /// det d(x, y)/d(p, w).
    #[inline]
    pub fn det(&self) -> f64 {
        self.column_p[0] * self.column_w[1] - self.column_w[0] * self.column_p[1]
    }

    /// Fold function det d(x, y)/d(p, lam) / kap^2: zero at the folds and nowhere else, not even on the line kap = 0,
    /// where the whole chart collapses onto the straight rod.
    #[inline]
    pub fn fold_function(&self) -> f64 {
        let i = &self.integrals;
        self.det() * i.d / (i.kap * i.kap)
    }

    /// Elastic energy U = 2 lam kap^2 B.
    #[inline]
    pub fn energy(&self) -> f64 {
        let i = &self.integrals;
        2.0 * i.lam * i.kap * i.kap * i.b
    }
}

/// Amplitude w at which the rod of tip modulus p has the load lam: tan w = kap' tan am(lam).
///
/// # Errors
/// lam not in (0, 1e9), p not finite, or |p| > 345 with lam > |p|.
pub fn amplitude(p: f64, lam: f64) -> Result<f64> {
    let (s, c, half_turns) = circle_at_load(p, lam)?;
    let parity = if half_turns as i64 & 1 == 0 {
        1.0
    } else {
        -1.0
    };
    Ok(half_turns * PI + (s * parity).atan2(c * parity))
}

/// (sin w, cos w, half turns nearest to w) at the load lam: sin w = kap' sd(lam), cos w = cd(lam).
fn circle_at_load(p: f64, lam: f64) -> Result<(f64, f64, f64)> {
    if !(0.0 < lam && lam < 1e9) {
        return Err(Error::domain(format!(
            "lambda = {lam:?} must lie in (0, 1e9): lambda^2 is the pull on the mass in units of EI/L^2"
        )));
    }
    if !p.is_finite() {
        return Err(Error::domain(format!("p = {p} must be finite")));
    }
    if p.abs() > FLAT && lam < p.abs() {
        // Below the first quarter period the rod is taut: sinh lam = 2 tan(w/2)/kap'.
        let half = if lam > 20.0 {
            (lam - p.abs() - LN_2).exp()
        } else {
            0.5 * lam.sinh() * Modulus::new(p).kap_c
        };
        let scale = 1.0 / (1.0 + half * half);
        return Ok((2.0 * half * scale, (1.0 - half * half) * scale, 0.0));
    }
    let kap_c = Modulus::new(p).kap_c;
    if !(kap_c > 1e-150) {
        return Err(Error::domain(format!(
            "p = {p} with lambda = {lam}: beyond |p| = 345 only taut rods (lambda < |p|) are served"
        )));
    }
    // lam and w pass the odd multiples of K and pi/2 together.
    let at = Quotients::new(lam, kap_c);
    let (sn, cn, dn) = at.functions(kap_c);
    Ok((sn * (kap_c / dn), cn / dn, at.half_turns))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn taut_rods_keep_their_half_turn() {
        // w = 1.3788, well below pi/2, where am(38.5) is pi/2 to rounding; B = 1 - cos w.
        let i = Integrals::at_load(38.0, 38.5).unwrap();
        assert!((i.b - (1.0 - i.c)).abs() < 1e-14, "{i:?}");
        assert!((amplitude(38.0, 38.5).unwrap() - i.s.atan2(i.c)).abs() < 1e-15);
    }
}
