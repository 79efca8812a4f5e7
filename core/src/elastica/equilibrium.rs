//! One equilibrium of the elastica in full: labels, end position, force, energy, shape.

use super::chart::{ChartPoint, Integrals, Modulus, P_MAX, amplitude};
use crate::error::{Error, Result};
use crate::manifold::{Sheet, Sign};
use crate::math::gauss::Rule;
use std::f64::consts::{FRAC_PI_2, PI};

/// Load lam below which the end position is integrated along the rod. The closed form is a difference of terms of
/// size one, while 1 - x is of order lam^4.
const SLIGHT: f64 = 1.2;

/// Sheet of the chart point: theta' has ceil(w/pi) - 1 zeros inside the rod and starts with the sign of kap sin w.
pub fn sheet(p: f64, w: f64) -> Sheet {
    // The seam w = j pi belongs to the lower mode, even if rounding has put w just beyond it.
    let mode = ((w / PI * (1.0 - 4.0 * f64::EPSILON)).ceil() - 1.0).max(0.0);
    // Inside (j pi, (j + 1) pi) the sine has the sign (-1)^j.
    let sign = if mode as u64 & 1 == 0 { p } else { -p };
    Sheet {
        mode: mode as u32,
        sign: Sign::of(sign),
    }
}

/// Equilibrium with its labels in three conventions: (p, w), (lambda, kappa), (j, +-, k, beta).
///
/// Units: length 1, bending stiffness 1.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Equilibrium {
    /// Chart: kap = tanh p.
    pub p: f64,
    /// Chart: amplitude at the clamp, > 0.
    pub w: f64,
    /// lam = sqrt(|force|).
    pub lambda: f64,
    /// kap = sin((theta(1) - alpha)/2), signed.
    pub kappa: f64,
    /// kap' = sqrt(1 - kap^2), computed without this cancellation.
    pub kappa_c: f64,
    /// The paper's sheet S_j^+-.
    pub sheet: Sheet,
    /// The paper's k = |kap|.
    pub k: f64,
    /// The paper's beta in [-pi/2, pi/2]: alpha = 2 asin(k sin beta), w = (j + 1/2) pi +- beta.
    pub beta: f64,
    /// Direction of the force on the mass: lam^2 (cos alpha, sin alpha).
    pub alpha: f64,
    /// Tip angle theta(1).
    pub theta1: f64,
    /// End position.
    pub x: f64,
    /// End position.
    pub y: f64,
    /// 1 - x, to full relative accuracy near the straight rod.
    pub one_minus_x: f64,
    /// Elastic energy, 1/2 int theta'^2.
    pub energy: f64,
    /// Force of the rod on the mass.
    pub force: [f64; 2],
}

/// Section of the rod.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct PlanarSection {
    /// Arclength from the clamp.
    pub s: f64,
    /// Angle of the tangent.
    pub theta: f64,
    /// theta'(s), the couple.
    pub curvature: f64,
    /// Position.
    pub x: f64,
    /// Position.
    pub y: f64,
}

impl Equilibrium {
    /// Equilibrium at the chart point (p, w).
    ///
    /// # Errors
    /// p not finite or beyond 1e100, w not in (0, 1e6), or a rod too slight for double precision.
    pub fn new(p: f64, w: f64) -> Result<Self> {
        if !(p.abs() < P_MAX) {
            return Err(Error::domain(format!(
                "p = {p} must be finite and below {P_MAX:e} in size"
            )));
        }
        if !(0.0 < w && w < 1e6) {
            return Err(Error::domain(format!("w = {w} must lie in (0, 1e6)")));
        }
        Self::from_point(p, w, &ChartPoint::new(p, w))
    }

    fn from_point(p: f64, w: f64, at: &ChartPoint) -> Result<Self> {
        let i = at.integrals;
        if !(i.lam > 0.0 && i.lam.is_finite() && i.d > 0.0) {
            return Err(Error::domain(format!(
                "(p, w) = ({p}, {w}) is out of the range of double precision"
            )));
        }
        let sheet = sheet(p, w);
        let alpha = -2.0 * (i.kap * i.c).atan2(i.d);
        let beta = sheet.sign.value() * (w - (f64::from(sheet.mode) + 0.5) * PI);
        let (one_minus_x, y) = tip(p, at);
        let pull = i.lam * i.lam;
        Ok(Self {
            p,
            w,
            lambda: i.lam,
            kappa: i.kap,
            kappa_c: i.kap_c,
            sheet,
            k: i.kap.abs(),
            beta: beta.clamp(-FRAC_PI_2, FRAC_PI_2),
            alpha,
            theta1: alpha + 2.0 * i.kap.atan2(i.kap_c),
            x: if one_minus_x < 0.5 {
                1.0 - one_minus_x
            } else {
                at.to_fixed(at.turned)[0]
            },
            y,
            one_minus_x,
            energy: at.energy(),
            force: [pull * at.cos_alpha, pull * at.sin_alpha],
        })
    }

    /// Equilibrium with load lambda = sqrt(|force|) and tip modulus kappa = sin((theta(1) - alpha)/2).
    ///
    /// # Errors
    /// lambda not in (0, 1e9) or kappa not in (-1, 1).
    pub fn from_lambda_kappa(lambda: f64, kappa: f64) -> Result<Self> {
        if !(-1.0 < kappa && kappa < 1.0) {
            return Err(Error::domain(format!(
                "kappa = {kappa} must lie in (-1, 1); closer to 1 than doubles go, give p (kappa = tanh p) instead"
            )));
        }
        // Keep kappa as given, free of the round trip through p.
        Ok(Self {
            kappa,
            k: kappa.abs(),
            ..Self::from_lambda_p(lambda, kappa.atanh())?
        })
    }

    /// Equilibrium with load lambda and p, kappa = tanh p: for taut and looped rods, where 1 - |kappa| is tiny.
    ///
    /// # Errors
    /// lambda not in (0, 1e9) or p out of range.
    pub fn from_lambda_p(lambda: f64, p: f64) -> Result<Self> {
        Self::from_point(p, amplitude(p, lambda)?, &ChartPoint::at_load(p, lambda)?)
    }

    /// Equilibrium (j, +-, k, beta) of the paper (AMV (3.14)).
    ///
    /// # Errors
    /// k not in [0, 1) or beta not in [-pi/2, pi/2], or the empty corner of S_0 where lambda = 0.
    pub fn from_sheet(sheet: Sheet, k: f64, beta: f64) -> Result<Self> {
        if !(0.0..1.0).contains(&k) {
            return Err(Error::domain(format!("k = {k} must lie in [0, 1)")));
        }
        if !(beta.abs() <= FRAC_PI_2) {
            return Err(Error::domain(format!(
                "beta = {beta} must lie in [-pi/2, pi/2]"
            )));
        }
        let sign = sheet.sign.value();
        let parity = if sheet.mode & 1 == 0 { 1.0 } else { -1.0 };
        let w = (f64::from(sheet.mode) + 0.5) * PI + sign * beta;
        if !(w > 0.0) {
            return Err(Error::domain(format!(
                "beta = {beta} on {sheet} is the unloaded rod (lambda = 0), which lies on no sheet"
            )));
        }
        Self::new(sign * parity * k.atanh(), w)
    }

    /// The section at arclength s in [0, 1] from the clamp.
    ///
    /// # Errors
    /// s outside [0, 1].
    pub fn section(&self, s: f64) -> Result<PlanarSection> {
        if !(0.0..=1.0).contains(&s) {
            return Err(Error::domain(format!("s = {s} must lie in [0, 1]")));
        }
        if s == 1.0 {
            return Ok(self.section_at(1.0, 0.0));
        }
        if s == 0.0 {
            return Ok(self.section_at(0.0, self.w));
        }
        Ok(self.section_at(s, amplitude(self.p, self.lambda * (1.0 - s))?))
    }

    /// Sections from clamp to tip, `n` >= 2 of them, for drawing. Even spacing in amplitude follows the bends and
    /// needs no Jacobi function.
    pub fn curve(&self, n: usize) -> Vec<PlanarSection> {
        let last = n.max(2) - 1;
        (0..=last)
            .map(|i| {
                let t = self.w * (1.0 - i as f64 / last as f64);
                let s = if i == 0 {
                    0.0
                } else {
                    1.0 - Integrals::new(self.p, t).lam / self.lambda
                };
                self.section_at(s, t)
            })
            .collect()
    }

    /// Section of amplitude t: psi = 2 asin(kap cos t), and the rod beyond the section is the equilibrium (p, t) of
    /// length 1 - s under the same force.
    fn section_at(&self, s: f64, t: f64) -> PlanarSection {
        let (sin_alpha, cos_alpha) = self.alpha.sin_cos();
        let (sin_t, cos_t) = t.sin_cos();
        let (rest_x, rest_y, d) = if t > 0.0 {
            let i = Integrals::new(self.p, t);
            (
                2.0 * i.de() / self.lambda - (1.0 - s),
                2.0 * self.kappa * sin_t / self.lambda,
                i.d,
            )
        } else {
            (0.0, 0.0, self.kappa_c)
        };
        let psi = 2.0 * (self.kappa * cos_t).atan2(d);
        PlanarSection {
            s,
            theta: if s == 0.0 { 0.0 } else { self.alpha + psi },
            curvature: 2.0 * self.lambda * self.kappa * sin_t,
            x: self.x - (cos_alpha * rest_x - sin_alpha * rest_y),
            y: self.y - (sin_alpha * rest_x + cos_alpha * rest_y),
        }
    }
}

/// Tip as (1 - x, y), each to relative accuracy also near the straight rod.
pub(super) fn tip(p: f64, at: &ChartPoint) -> (f64, f64) {
    let i = &at.integrals;
    if i.lam < SLIGHT {
        return slight_tip(p, i);
    }
    closed_tip(at)
}

/// Tip as (1 - x, y) by the closed form, to an ulp of kap^2 and kap.
pub(super) fn closed_tip(at: &ChartPoint) -> (f64, f64) {
    let i = &at.integrals;
    // 1 - (cos alpha X - sin alpha Y), with s^2 + c^2 = 1 and D^2 + kap^2 c^2 = 1 inserted: the remaining terms are
    // of the order of the result, for small kap and for small w.
    let (kap2, kc2, c2) = (i.kap * i.kap, i.kap_c * i.kap_c, i.c * i.c);
    let bent = ((2.0 * c2 * kap2 - 1.0) * i.b - 2.0 * i.c * i.s * i.d) / i.lam;
    let one_minus_x = 2.0 * kap2 * (i.s * i.s + 2.0 * c2 * kc2 + bent);
    (one_minus_x, at.to_fixed(at.turned)[1])
}

/// Tip of a slightly loaded rod, by quadrature: 1 - x = 2 int sin^2(theta/2) ds and y = 2 int sin(theta/2)
/// cos(theta/2) ds, ds = dt/(lam D(t)). Here sin(theta/2) = kap (cos^2 t - cos^2 w)/(cos t D(w) + cos w D(t)).
fn slight_tip(p: f64, i: &Integrals) -> (f64, f64) {
    let w = i.s.atan2(i.c);
    let Modulus { kap, kap_c } = Modulus::new(p);
    // 20 nodes: the nearest singularity, |Im t| ~ kap', leaves an error of 2.8^-40.
    let rule = Rule::new(20);
    let (mut one_minus_x, mut y, mut length) = (0.0, 0.0, 0.0);
    for (node, weight) in rule.nodes.iter().zip(&rule.weights) {
        let t = w * node;
        let (st, ct) = t.sin_cos();
        let d = kap_c.hypot(kap * st);
        let difference = (w - t).sin() * (w + t).sin();
        let half = kap * difference / (ct * i.d + i.c * d);
        let ds = weight / d;
        one_minus_x += ds * half * half;
        y += ds * half * (1.0 - half * half).sqrt();
        length += ds;
    }
    (2.0 * one_minus_x / length, 2.0 * y / length)
}
