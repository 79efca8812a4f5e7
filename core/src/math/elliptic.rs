//! Elliptic integrals: Carlson's RF and RD, and Legendre's K, E, B, F, E(phi), B(phi) by the
//! complementary modulus.
//!
//! **The trap of every library**: the modulus argument here is the *complementary modulus*
//! `kc` = k' = sqrt(1 - k^2) = sqrt(1 - m), in (0, 1]. It is neither the modulus k (Boost, C++17)
//! nor the parameter m = k^2 (scipy, mpmath, `ellip`, Abramowitz & Stegun). The separatrix is
//! kc -> 0, and neither k nor m can be told from 1 there, while kc = 1e-150 is an ordinary number.
//!
//! With k^2 = (1 - kc)(1 + kc) and Delta(t)^2 = cos^2 t + kc^2 sin^2 t:
//!
//! ```text
//! F(phi) = int_0^phi dt/Delta    E(phi) = int_0^phi Delta dt    B(phi) = int_0^phi cos^2 t/Delta dt
//! K = F(pi/2),  E = E(pi/2),  B = B(pi/2)                       E = kc^2 F + k^2 B
//! ```
//!
//! All are sums of positive terms (DLMF 19.25.5, 19.25.10), so that each keeps its relative accuracy
//! for every kc, also where phi nears pi/2 as kc -> 0. Amplitudes beyond pi/2 are whole periods
//! (from the exactly reduced sine and cosine) and a rest.
//!
//! Modulus kc > 1 (k^2 < 0) is refused: F(phi, kc) = F(phi', 1/kc)/kc with tan phi' = kc tan phi
//! leads back.

use super::DomainError;
use super::carlson::{complete_kb, rf, rf_rd};
use std::f64::consts::{FRAC_PI_2, PI};

/// The range of arguments whose products need no scaling in the duplication ladder.
const TAME: std::ops::RangeInclusive<f64> = 1e-90..=1e90;

/// Carlson's integral of the first kind.
///
/// ```text
/// RF(x, y, z) = 1/2 int_0^inf dt / sqrt((t + x)(t + y)(t + z))
/// ```
/// * `x`, `y`, `z`: finite, >= 0, at most one of them zero. Symmetric.
///
/// Special cases: RF(x, x, x) = x^(-1/2); RF(0, y, y) = pi/2 y^(-1/2).
///
/// # Errors
/// [`DomainError`] if an argument is negative, infinite or NaN, or two are zero (RF is infinite).
///
/// # Accuracy
/// 5 ulp (median 0.7) for every admitted argument, subnormal and mixed ones included (table in
/// docs/elliptic_accuracy.md). Homogeneous scaling keeps every product in range.
///
/// # Source
/// DLMF 19.16.1; 19.26.18 (duplication), 19.36.1 (series).
///
/// # Example
/// ```
/// # use snaprod_core as snaprod;
/// use snaprod::math::elliptic::carlson_rf;
/// assert!((carlson_rf(1.0, 0.5, 0.25)? - 1.370171633266872).abs() < 1e-15);
/// # Ok::<(), snaprod::math::DomainError>(())
/// ```
pub fn carlson_rf(x: f64, y: f64, z: f64) -> Result<f64, DomainError> {
    const NAME: &str = "carlson_rf";
    check_carlson(NAME, [x, y, z])?;
    let [low, mid, high] = sort(x, y, z);
    if mid == 0.0 {
        return Err(fault(NAME, "y", mid, "at most one argument zero"));
    }
    if TAME.contains(&high) && TAME.contains(&mid) && (low == 0.0 || TAME.contains(&low)) {
        return Ok(rf(low, mid, high));
    }
    // One duplication by hand on the roots, brought to about 2^480: their products then neither
    // overflow nor vanish, and after it all three are at least lambda/4.
    let scale = power_of_two(480 - exponent(high.sqrt()));
    let [rx, ry, rz] = [low, mid, high].map(|v| v.sqrt() * scale);
    let lambda = rx * (ry + rz) + ry * rz;
    let [x, y, z] = [rx, ry, rz].map(|r| 0.25 * (r * r + lambda));
    Ok(rf(x, y, z) * scale)
}

/// Carlson's integral of the second kind.
///
/// ```text
/// RD(x, y, z) = 3/2 int_0^inf dt / (sqrt((t + x)(t + y)) (t + z)^(3/2))
/// ```
/// * `x`, `y`: finite, >= 0, at most one of them zero. Symmetric in these two.
/// * `z`: finite, > 0.
///
/// Special case: RD(x, x, x) = x^(-3/2).
///
/// # Errors
/// [`DomainError`] if an argument lies outside its set, or if the value exceeds the largest f64
/// (tiny arguments: RD is homogeneous of degree -3/2). A value below the smallest f64 is 0.
///
/// # Accuracy
/// 5 ulp (median 0.9) for every admitted argument whose value is a normal number.
///
/// # Source
/// DLMF 19.16.5; 19.26.20 (duplication), 19.36.2 (series).
///
/// # Example
/// ```
/// # use snaprod_core as snaprod;
/// use snaprod::math::elliptic::carlson_rd;
/// assert!((carlson_rd(0.0, 2.0, 1.0)? - 1.797210352103388).abs() < 1e-15);
/// # Ok::<(), snaprod::math::DomainError>(())
/// ```
pub fn carlson_rd(x: f64, y: f64, z: f64) -> Result<f64, DomainError> {
    const NAME: &str = "carlson_rd";
    check_carlson(NAME, [x, y, z])?;
    let (low, mid) = (x.min(y), x.max(y));
    if mid == 0.0 {
        return Err(fault(NAME, "y", mid, "x and y not both zero"));
    }
    if z == 0.0 {
        return Err(fault(NAME, "z", z, "(0, inf)"));
    }
    if TAME.contains(&z) && TAME.contains(&mid) && (low == 0.0 || TAME.contains(&low)) {
        return Ok(rf_rd(low, mid, z).1);
    }
    // One duplication by hand on the scaled roots, as in `carlson_rf`. Its term rz (z + lambda) is
    // of third degree: a z far below the rest leaves room upwards for the products.
    let top = mid.max(z).sqrt();
    let far_below = z.sqrt() < top * power_of_two(-200);
    let scale = power_of_two(if far_below { 400 } else { 300 } - exponent(top));
    let [rx, ry, rz] = [low, mid, z].map(|v| v.sqrt() * scale);
    let lambda = rx * (ry + rz) + ry * rz;
    let [xn, yn, zn] = [rx, ry, rz].map(|r| 0.25 * (r * r + lambda));
    let scaled = 3.0 / (rz * (rz * rz + lambda)) + 0.25 * rf_rd(xn, yn, zn).1;
    check_overflow(NAME, "z", z, scaled * scale * scale * scale)
}

/// The complete integral of the first kind, K.
///
/// ```text
/// K = int_0^{pi/2} dt / sqrt(cos^2 t + kc^2 sin^2 t)
/// ```
/// * `kc`: complementary modulus k' in (0, 1], **not k, not m = k^2**.
///
/// Special cases: K = pi/2 at kc = 1; K ~ ln(4/kc) as kc -> 0.
///
/// # Errors
/// [`DomainError`] outside (0, 1]; K(0) is infinite.
///
/// # Accuracy
/// 4 ulp (median 0.6) for every kc.
///
/// # Source
/// DLMF 19.2.8, 19.8.5 (arithmetic-geometric mean).
///
/// # Example
/// ```
/// # use snaprod_core as snaprod;
/// use snaprod::math::elliptic::complete_k;
/// assert!((complete_k(1e-150)? - (4e150f64).ln()).abs() < 1e-12);
/// # Ok::<(), snaprod::math::DomainError>(())
/// ```
pub fn complete_k(kc: f64) -> Result<f64, DomainError> {
    check_modulus("complete_k", kc, false)?;
    Ok(complete_kb(kc).0)
}

/// The complete integral of the second kind, E.
///
/// ```text
/// E = int_0^{pi/2} sqrt(cos^2 t + kc^2 sin^2 t) dt = kc^2 K + k^2 B
/// ```
/// * `kc`: complementary modulus k' in \[0, 1\], **not k, not m = k^2**.
///
/// Special cases: E = pi/2 at kc = 1; E = 1 at kc = 0.
///
/// # Errors
/// [`DomainError`] outside \[0, 1\].
///
/// # Accuracy
/// 3 ulp (median 0.9) for every kc.
///
/// # Source
/// DLMF 19.2.8, 19.25.1.
pub fn complete_e(kc: f64) -> Result<f64, DomainError> {
    check_modulus("complete_e", kc, true)?;
    Ok(complete_keb(kc).1)
}

/// The complete associated integral B.
///
/// ```text
/// B = int_0^{pi/2} cos^2 t / sqrt(cos^2 t + kc^2 sin^2 t) dt = (E - kc^2 K)/k^2
/// ```
/// * `kc`: complementary modulus k' in \[0, 1\], **not k, not m = k^2**.
///
/// Special cases: B = pi/4 at kc = 1; B = 1 at kc = 0.
///
/// # Errors
/// [`DomainError`] outside \[0, 1\].
///
/// # Accuracy
/// 5 ulp (median 1.0) for every kc: no difference is formed.
///
/// # Source
/// Bulirsch, Numer. Math. 7 (1965) 78, `cel2` = cel(kc, 1, 1, 0); DLMF 19.2.11.
pub fn complete_b(kc: f64) -> Result<f64, DomainError> {
    check_modulus("complete_b", kc, true)?;
    Ok(complete_keb(kc).2)
}

/// The incomplete integral of the first kind, F.
///
/// ```text
/// F(phi, kc) = int_0^phi dt / sqrt(cos^2 t + kc^2 sin^2 t)
/// ```
/// * `phi`: amplitude in radians, any finite number. F is odd, and F(phi + n pi) = F(phi) + 2nK.
/// * `kc`: complementary modulus k' in (0, 1], **not k, not m = k^2**; 0 also, for |phi| < pi/2.
///
/// Special cases: F = phi at kc = 1; F = artanh(sin phi) at kc = 0.
///
/// # Errors
/// [`DomainError`] for other arguments, and where F exceeds the largest f64 (|phi| > 1e305).
///
/// # Accuracy
/// 4 ulp (median 0.6), within pi/2 and beyond, for the f64 `phi` as given: also near pi/2, at any |phi|.
///
/// # Source
/// DLMF 19.2.4, 19.25.5; 19.2.10 (periods).
///
/// # Example
/// ```
/// # use snaprod_core as snaprod;
/// use snaprod::math::elliptic::incomplete_f;
/// // 5e-7 before pi/2 at m = 0.9999999999988: where formulations in m lose nine digits.
/// let f = incomplete_f(1.5707962720256379, 1.0946e-6)?;
/// assert!((f - 15.061311).abs() < 1e-3);
/// # Ok::<(), snaprod::math::DomainError>(())
/// ```
pub fn incomplete_f(phi: f64, kc: f64) -> Result<f64, DomainError> {
    const NAME: &str = "incomplete_f";
    let at = Amplitude::new(NAME, phi, kc, true)?;
    if at.periods != 0.0 && kc == 0.0 {
        return Err(fault(NAME, "phi", phi, "|phi| < pi/2 where kc = 0"));
    }
    let rest = at.sin * rf(at.cos2, at.delta2, 1.0);
    check_overflow(
        NAME,
        "phi",
        phi,
        at.with_periods(rest, || complete_kb(kc).0),
    )
}

/// The incomplete integral of the second kind, E(phi).
///
/// ```text
/// E(phi, kc) = int_0^phi sqrt(cos^2 t + kc^2 sin^2 t) dt
///            = s (kc^2 (RF(c^2,1,D^2) + k^2 s^2 RD(c^2,1,D^2)/3) + k^2 c/D)     |phi| <= pi/2
/// ```
/// * `phi`: amplitude in radians, any finite number. E is odd, and E(phi + n pi) = E(phi) + 2nE.
/// * `kc`: complementary modulus k' in \[0, 1\], **not k, not m = k^2**.
///
/// Special cases: E = phi at kc = 1; E = sin phi at kc = 0, |phi| <= pi/2.
///
/// # Errors
/// [`DomainError`] for other arguments, and where E exceeds the largest f64.
///
/// # Accuracy
/// 3 ulp within |phi| <= pi/2 and 6 beyond (median 0.7), for the f64 `phi` as given.
///
/// # Source
/// DLMF 19.2.5, 19.25.10: positive terms for every kc, where the common 19.25.9 subtracts.
pub fn incomplete_e(phi: f64, kc: f64) -> Result<f64, DomainError> {
    const NAME: &str = "incomplete_e";
    let at = Amplitude::new(NAME, phi, kc, true)?;
    let (rf, rd) = rf_rd(at.cos2, 1.0, at.delta2);
    let (k2, kc2) = (at.k2, kc * kc);
    let sin2 = at.sin * at.sin;
    let rest = at.sin * (kc2 * (rf + k2 * sin2 * rd / 3.0) + k2 * at.cos_over_delta());
    check_overflow(
        NAME,
        "phi",
        phi,
        at.with_periods(rest, || complete_keb(kc).1),
    )
}

/// The incomplete associated integral B(phi).
///
/// ```text
/// B(phi, kc) = int_0^phi cos^2 t / sqrt(cos^2 t + kc^2 sin^2 t) dt = (E(phi) - kc^2 F(phi))/k^2
///            = s (kc^2 s^2 RD(c^2,1,D^2)/3 + c/D)                               |phi| <= pi/2
/// ```
/// * `phi`: amplitude in radians, any finite number. B is odd, and B(phi + n pi) = B(phi) + 2nB.
/// * `kc`: complementary modulus k' in \[0, 1\], **not k, not m = k^2**.
///
/// Special cases: B = (phi + sin phi cos phi)/2 at kc = 1; B = sin phi at kc = 0, |phi| <= pi/2.
///
/// # Errors
/// [`DomainError`] for other arguments, and where B exceeds the largest f64.
///
/// # Accuracy
/// 5 ulp within |phi| <= pi/2 and 7 beyond (median 0.6), for the f64 `phi` as given.
///
/// # Source
/// DLMF 19.2.12 (Bulirsch el2(tan phi, kc, 1, 0)), 19.25.10.
pub fn incomplete_b(phi: f64, kc: f64) -> Result<f64, DomainError> {
    const NAME: &str = "incomplete_b";
    let at = Amplitude::new(NAME, phi, kc, true)?;
    let (_, rd) = rf_rd(at.cos2, 1.0, at.delta2);
    let rest = at.sin * (kc * kc * (at.sin * at.sin) * rd / 3.0 + at.cos_over_delta());
    check_overflow(
        NAME,
        "phi",
        phi,
        at.with_periods(rest, || complete_keb(kc).2),
    )
}

/// K, E, B and their derivatives with respect to kc.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Complete {
    /// K.
    pub k: f64,
    /// E.
    pub e: f64,
    /// B.
    pub b: f64,
    /// dK/dkc = -B/kc.
    pub k_kc: f64,
    /// dE/dkc = kc (K - B).
    pub e_kc: f64,
}

/// K, E, B with the derivatives of K and E, in one evaluation.
///
/// ```text
/// dK/dkc = -B/kc      dE/dkc = kc (K - B)
/// ```
/// By kc, not by k: dK/dk = k B/kc^2 is singular where kc dK/dkc = -B stays near -1. K - B > pi/4
/// does not cancel.
/// * `kc`: complementary modulus k' in (0, 1], **not k, not m = k^2**.
///
/// # Errors
/// [`DomainError`] outside (0, 1], and where B/kc exceeds the largest f64 (kc < 5.6e-309).
///
/// # Accuracy
/// 5 ulp in the values, 6 in dK/dkc, 3 in dE/dkc.
///
/// # Source
/// DLMF 19.4.1-2, written in B.
pub fn complete(kc: f64) -> Result<Complete, DomainError> {
    const NAME: &str = "complete";
    check_modulus(NAME, kc, false)?;
    let (k, e, b) = complete_keb(kc);
    let k_kc = check_overflow(NAME, "kc", kc, -b / kc)?;
    let e_kc = kc * (k - b);
    Ok(Complete {
        k,
        e,
        b,
        k_kc,
        e_kc,
    })
}

/// F, E, B of an amplitude and their derivatives.
///
/// The derivative of B with respect to kc is kc (2B - F - s c/Delta)/k^2, which loses digits as
/// k -> 0; it is not offered.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Incomplete {
    /// F(phi, kc).
    pub f: f64,
    /// E(phi, kc).
    pub e: f64,
    /// B(phi, kc).
    pub b: f64,
    /// dF/dphi = 1/Delta.
    pub f_phi: f64,
    /// dE/dphi = Delta.
    pub e_phi: f64,
    /// dB/dphi = cos^2 phi/Delta.
    pub b_phi: f64,
    /// dF/dkc at fixed phi.
    pub f_kc: f64,
    /// dE/dkc at fixed phi.
    pub e_kc: f64,
}

/// F, E and B with their derivatives, in one evaluation (two ladders).
///
/// ```text
/// dF/dphi = 1/Delta                      dE/dphi = Delta                 dB/dphi = cos^2 phi/Delta
/// dF/dkc  = -kc int sin^2 t/Delta^3 dt   dE/dkc  = kc int sin^2 t/Delta dt     (at fixed phi)
///         = -kc s^3 RD(c^2,1,D^2)/3              = kc s^3 RD(c^2,D^2,1)/3      |phi| <= pi/2
/// ```
/// By kc, not by k: these two are single Carlson functions, without the differences and the 1/kc^2
/// of the textbook derivative by k (DLMF 19.4.5-6).
/// * `phi`: amplitude in radians, any finite number.
/// * `kc`: complementary modulus k' in (0, 1], **not k, not m = k^2**.
///
/// # Errors
/// [`DomainError`] for other arguments, and where a result exceeds the largest f64.
///
/// # Accuracy
/// As [`incomplete_f`], [`incomplete_e`], [`incomplete_b`]; the derivatives by kc 7 ulp.
///
/// # Source
/// DLMF 19.25.5, 19.25.10; the derivatives under the integral sign, in RD as 19.25.10 has it.
///
/// # Example
/// ```
/// # use snaprod_core as snaprod;
/// use snaprod::math::elliptic::incomplete;
/// let i = incomplete(1.0, 0.25)?;
/// let k2 = 1.0 - 0.25 * 0.25;
/// assert!((0.25 * 0.25 * i.f + k2 * i.b - i.e).abs() < 1e-15);
/// # Ok::<(), snaprod::math::DomainError>(())
/// ```
pub fn incomplete(phi: f64, kc: f64) -> Result<Incomplete, DomainError> {
    const NAME: &str = "incomplete";
    let at = Amplitude::new(NAME, phi, kc, false)?;
    let (sin, sin2, delta, kc2) = (at.sin, at.sin * at.sin, at.delta2.sqrt(), kc * kc);
    let (rf, rd) = rf_rd(at.cos2, 1.0, at.delta2);
    // g = int sin^2/Delta^3, d = int sin^2/Delta
    let g = sin * (sin2 * rd / 3.0);
    let d = sin * (sin2 * rf_rd(at.cos2, at.delta2, 1.0).1 / 3.0);
    let f = sin * rf;
    let b = kc2 * g + sin * at.cos_over_delta();
    let e = kc2 * f + at.k2 * b;
    let whole = if at.periods == 0.0 {
        (0.0, 0.0, 0.0)
    } else {
        complete_keb(kc)
    };
    let with = |rest, complete| at.with_periods(rest, || complete);
    let out = Incomplete {
        f: with(f, whole.0),
        e: with(e, whole.1),
        b: with(b, whole.2),
        f_phi: 1.0 / delta,
        e_phi: delta,
        b_phi: at.cos2 / delta,
        f_kc: with(-kc * g, -whole.2 / kc),
        e_kc: with(kc * d, kc * (whole.0 - whole.2)),
    };
    check_overflow(NAME, "phi", phi, out.f)?;
    check_overflow(NAME, "kc", kc, out.f_kc)?;
    Ok(out)
}

/// Amplitude n pi +- r, 0 <= r <= pi/2, with the terms of the integrals to r.
struct Amplitude {
    /// n.
    periods: f64,
    /// The sign of the rest.
    sign: f64,
    /// sin r and cos r, both >= 0.
    sin: f64,
    cos: f64,
    cos2: f64,
    /// Delta(r)^2 = cos^2 r + kc^2 sin^2 r.
    delta2: f64,
    k2: f64,
}

impl Amplitude {
    #[inline]
    fn new(name: &'static str, phi: f64, kc: f64, zero: bool) -> Result<Self, DomainError> {
        check_modulus(name, kc, zero)?;
        if !phi.is_finite() {
            return Err(fault(name, "phi", phi, "finite"));
        }
        // The standard library reduces sine and cosine by all the digits of pi that phi needs. Only the count of
        // periods is computed here, and its rounding is corrected by their signs: cos(phi - n pi) >= 0.
        let (s, c) = phi.sin_cos();
        let (mut periods, mut parity) = (0.0, 1.0);
        if phi.abs() > FRAC_PI_2 {
            periods = (phi / PI).round();
            parity = if periods as i64 & 1 == 0 { 1.0 } else { -1.0 };
            if parity * c < 0.0 {
                periods += (parity * s).signum();
                parity = -parity;
            }
        }
        let (sin, cos) = (s.abs(), c.abs());
        let cos2 = cos * cos;
        let t = kc * sin;
        Ok(Self {
            periods,
            sign: parity.copysign(parity * s),
            sin,
            cos,
            cos2,
            delta2: cos2 + t * t,
            k2: (1.0 - kc) * (1.0 + kc),
        })
    }

    /// cos r/Delta(r), in [0, 1].
    #[inline]
    fn cos_over_delta(&self) -> f64 {
        self.cos / self.delta2.sqrt()
    }

    /// 2 n `complete` +- rest.
    #[inline]
    fn with_periods(&self, rest: f64, complete: impl FnOnce() -> f64) -> f64 {
        if self.periods == 0.0 {
            self.sign * rest
        } else {
            2.0 * self.periods * complete() + self.sign * rest
        }
    }
}

/// (K, E, B); at kc = 0 K is infinite and E = B = 1.
#[inline]
fn complete_keb(kc: f64) -> (f64, f64, f64) {
    if kc == 0.0 {
        return (f64::INFINITY, 1.0, 1.0);
    }
    let (k, b) = complete_kb(kc);
    (k, kc * kc * k + (1.0 - kc) * (1.0 + kc) * b, b)
}

#[cold]
fn fault(
    function: &'static str,
    argument: &'static str,
    value: f64,
    allowed: &'static str,
) -> DomainError {
    DomainError {
        function,
        argument,
        value,
        allowed,
    }
}

#[inline]
fn check_modulus(name: &'static str, kc: f64, zero: bool) -> Result<(), DomainError> {
    let allowed = if zero {
        "[0, 1] (complementary modulus)"
    } else {
        "(0, 1] (complementary modulus)"
    };
    if !(0.0..=1.0).contains(&kc) || (kc == 0.0 && !zero) {
        return Err(fault(name, "kc", kc, allowed));
    }
    Ok(())
}

#[inline]
fn check_carlson(name: &'static str, arguments: [f64; 3]) -> Result<(), DomainError> {
    for (argument, value) in ["x", "y", "z"].into_iter().zip(arguments) {
        if !(0.0..=f64::MAX).contains(&value) {
            return Err(fault(name, argument, value, "[0, inf)"));
        }
    }
    Ok(())
}

/// `result`, or an error if the result is too large for an f64.
#[inline]
fn check_overflow(
    name: &'static str,
    argument: &'static str,
    value: f64,
    result: f64,
) -> Result<f64, DomainError> {
    if result.is_finite() {
        Ok(result)
    } else {
        Err(fault(
            name,
            argument,
            value,
            "where the value is below 1.8e308",
        ))
    }
}

#[inline]
fn sort(x: f64, y: f64, z: f64) -> [f64; 3] {
    let (low, high) = (x.min(y), x.max(y));
    [low.min(z), low.max(high.min(z)), high.max(z)]
}

/// The binary exponent of a normal number.
#[inline]
fn exponent(x: f64) -> i64 {
    (x.to_bits() >> 52) as i64 - 1023
}

/// 2^e, |e| <= 1022.
#[inline]
fn power_of_two(e: i64) -> f64 {
    f64::from_bits(((e + 1023) as u64) << 52)
}
