//! Jacobi's functions sn, cn, dn, am (and cd, sd) of a real argument, by the complementary modulus.
//!
//! A descending Landen ladder in (1, kc) -> ((1 + kc)/2, sqrt kc) runs until the modulus is so
//! small that two terms of each theta function are complete; Bulirsch's recurrence climbs back with
//! sums and products of positive terms. So each function keeps its *relative* accuracy, also where
//! it is exponentially small, and no period is subtracted: the ladder's phase counts them.

use super::DomainError;
use std::f64::consts::PI;

/// Stop the ladder at (a - g) <= SPREAD (a + g): the modulus of the next level. The nome there is
/// q < SPREAD^2 / 15.9 = 5e-5, and the theta series drop only q^4 = 7e-18.
const SPREAD: f64 = 0.028;
/// Levels that any normal `kc` needs, and two to spare.
const LEVELS: usize = 14;
/// Below this |u| the functions are u, 1, 1 to half an ulp.
const TINY: f64 = 1e-8;

/// sn, cn, dn and the amplitude at one argument.
///
/// Derivatives with respect to u: sn' = cn dn, cn' = -sn dn, dn' = -k^2 sn cn, am' = dn
/// (DLMF 22.13.1-3, 22.16.1 ff.), and cd' = -kc^2 sd nd, sd' = cd nd with nd = 1/dn. With respect to
/// kc at fixed u: am_kc = -dn F_kc(am), with F_kc from [`super::elliptic::incomplete`].
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Jacobi {
    /// sin am, in [-1, 1].
    pub sn: f64,
    /// cos am, in [-1, 1].
    pub cn: f64,
    /// sqrt(cos^2 am + kc^2 sin^2 am), in [kc, 1].
    pub dn: f64,
    /// The amplitude: continuous and increasing in u, am(u + 2K) = am(u) + pi.
    pub am: f64,
}

impl Jacobi {
    /// cd = cn/dn, in [-1, 1]: sn shifted by a quarter period, cd(u) = sn(u + K).
    ///
    /// The tangent of an elastica is sin(psi/2) = kap cd(lam (1 - s)).
    #[must_use]
    pub fn cd(&self) -> f64 {
        self.cn / self.dn
    }

    /// sd = sn/dn, in [-1/kc, 1/kc]: kc sd(u) = -cn(u + K).
    ///
    /// The curvature of an elastica is theta' = 2 lam kap kap' sd(lam (1 - s)).
    #[must_use]
    pub fn sd(&self) -> f64 {
        self.sn / self.dn
    }
}

/// sn, cn, dn and am of u for the complementary modulus `kc`.
///
/// ```text
/// u = F(am, kc),  sn = sin am,  cn = cos am,  dn = sqrt(cn^2 + kc^2 sn^2)
/// ```
/// * `u`: finite.
/// * `kc`: in [2.3e-308, 1] (normal), dimensionless.
///
/// **Trap**: `kc` is the *complementary modulus* k' = sqrt(1 - k^2) = sqrt(1 - m), neither the
/// modulus k nor the parameter m = k^2 of mpmath, scipy and Abramowitz & Stegun.
///
/// Special cases: kc = 1: sin u, cos u, 1, u. As kc -> 0: tanh u, sech u, sech u, gd u, but periodic
/// with 4K = 4 ln(4/kc) for every kc > 0.
///
/// # Errors
/// [`DomainError`] if `u` is not finite or `kc` lies outside its set.
///
/// # Accuracy
/// Each value f is within 4 eps (|f| + |u f'(u)|): a few ulp, and the effect of a few ulp in u. For
/// |u| far beyond 1/eps that is no digit at all, but the values stay in their ranges and satisfy the
/// identities. Measured: docs/elliptic_accuracy.md.
///
/// # Source
/// DLMF 22.7.1-4 (descending Landen), 22.2.4-6 and 20.2 (thetas), 22.20(ii); the climb after
/// Bulirsch, Numer. Math. 7 (1965) 78, `sncndn`.
///
/// # Example
/// ```
/// # use snaprod_core as snaprod;
/// use snaprod::math::jacobi::jacobi;
/// let j = jacobi(1.5, 1e-120)?; // all but on the separatrix
/// assert!((j.sn - 1.5f64.tanh()).abs() < 1e-15);
/// assert!((j.cd() - 1.0).abs() < 1e-15);
/// # Ok::<(), snaprod::math::DomainError>(())
/// ```
pub fn jacobi(u: f64, kc: f64) -> Result<Jacobi, DomainError> {
    check("jacobi", u, kc)?;
    let Some(Climbed {
        phase,
        cs,
        sn,
        cn,
        dn,
    }) = ladder(u, kc)
    else {
        let (sn, cn, dn) = (u, 1.0, 1.0);
        return Ok(Jacobi { sn, cn, dn, am: u });
    };
    if phase.abs() > 1e16 {
        return Ok(Jacobi {
            sn,
            cn,
            dn,
            am: phase,
        });
    }
    // am and the phase pass each multiple of pi/2 together. The multiple of pi nearest to the
    // phase may be off by one next to its middle; the half plane of (sn, cn) decides.
    let mut periods = (phase / PI + 0.5f64.copysign(phase)) as i64;
    let mut sign = if periods & 1 == 0 { 1.0 } else { -1.0 };
    if sign * cn < 0.0 {
        sign = -sign;
        periods -= (sign * sn).signum() as i64;
    }
    let am = periods as f64 * PI + (1.0 / cs).atan();
    Ok(Jacobi { sn, cn, dn, am })
}

/// (sn, cn, dn) of u for the complementary modulus `kc`: [`jacobi`] without the arctangent of `am`.
///
/// Parameters, traps, accuracy and source as there.
///
/// # Errors
/// [`DomainError`] if `u` is not finite or `kc` lies outside its set.
#[inline]
pub fn sn_cn_dn(u: f64, kc: f64) -> Result<(f64, f64, f64), DomainError> {
    check("sn_cn_dn", u, kc)?;
    Ok(ladder(u, kc).map_or((u, 1.0, 1.0), |at| (at.sn, at.cn, at.dn)))
}

#[inline]
fn check(function: &'static str, u: f64, kc: f64) -> Result<(), DomainError> {
    if !u.is_finite() {
        return Err(DomainError {
            function,
            argument: "u",
            value: u,
            allowed: "finite",
        });
    }
    if !(f64::MIN_POSITIVE..=1.0).contains(&kc) {
        return Err(DomainError {
            function,
            argument: "kc",
            value: kc,
            allowed: "[2.3e-308, 1] (complementary modulus)",
        });
    }
    Ok(())
}

/// The functions, and the phase pi u/(2K).
struct Climbed {
    phase: f64,
    /// cn/sn.
    cs: f64,
    sn: f64,
    cn: f64,
    dn: f64,
}

/// Down the ladder, the thetas there, and up again; `None` where |u| is tiny.
#[inline]
fn ladder(u: f64, kc: f64) -> Option<Climbed> {
    if u.abs() < TINY {
        return None;
    }
    let mut levels = [(1.0, 1.0); LEVELS];
    let mut n = 0;
    let (mut a, mut g) = (1.0, kc);
    while a - g > SPREAD * (a + g) && n < LEVELS {
        levels[n] = (a, g);
        n += 1;
        (a, g) = (0.5 * (a + g), (a * g).sqrt());
    }
    // One level more needs no root: its modulus k = (a - g)/(a + g), m/16 = (k/4)^2, and the nome
    // q = m/16 + 8 (m/16)^2 + 84 (m/16)^3 + 992 (m/16)^4 (19.5.5).
    let next = 0.5 * (a + g);
    let k4 = (a - g) / (8.0 * next);
    let m16 = k4 * k4;
    let q = m16 * (1.0 + m16 * (8.0 + m16 * (84.0 + m16 * 992.0)));
    // pi/(2K) = next / theta_3(0)^2 (20.9.2), theta_3(0) = 1 + 2 q.
    let theta3 = 1.0 + 2.0 * q;
    let phase = u * (next / (theta3 * theta3));
    let (sin, cos) = phase.sin_cos();
    let cos2 = (cos - sin) * (cos + sin);
    // cs = theta_4 theta_2(v) / (theta_3 theta_1(v)), dn = theta_4 theta_3(v) / (theta_3 theta_4(v))
    // (22.2.4-6) with theta_2(v)/theta_1(v) = cot v (1 + 4 q^2 cos 2v).
    let ratio = (1.0 - 2.0 * q) / theta3;
    let mut cs = ratio * (1.0 + 4.0 * q * q * cos2) * (cos / sin);
    let mut dn = ratio * (1.0 + 2.0 * q * cos2) / (1.0 - 2.0 * q * cos2);
    let mut below = next;
    let mut shift = below * (cs * cs);
    let mut climb = |a: f64, g: f64| {
        let (ratio, old) = (below / a, dn);
        dn = (g + shift) / (a + shift);
        cs *= ratio * old;
        shift *= ratio * (old * old);
        below = a;
    };
    climb(a, g);
    for &(a, g) in levels[..n].iter().rev() {
        climb(a, g);
    }
    let sn = (1.0 / (1.0 + cs * cs).sqrt()).copysign(sin);
    Some(Climbed {
        phase,
        cs,
        sn,
        cn: cs * sn,
        dn,
    })
}
