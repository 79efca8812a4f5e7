//! Jacobi's functions sn, cn, dn, am (and cd, sd) of a real argument, by the complementary modulus.
//!
//! The functions are quotients of theta functions. The nome is that of the modulus, with real v = pi u/(2K). If the
//! complementary nome is smaller, it is used with v = pi u/(2K'), and the argument is i v (Jacobi's imaginary
//! transformation, DLMF 22.6.1); all terms then grow like e^v. Whole periods are first taken off u, so that |v| is at
//! most half of one. Each function keeps its *relative* accuracy, also where it is exponentially small.

use super::DomainError;
use super::real::Real;
use super::theta::Nome;
use std::f64::consts::{FRAC_1_PI, FRAC_1_SQRT_2, PI};

/// Bound of K, which holds even at the least kc: e^K is still a double.
const LOG_OF_LARGEST: f64 = 709.782_712_893_384;

/// Values sn, cn, dn and the amplitude at one argument.
///
/// Derivatives with respect to u: sn' = cn dn, cn' = -sn dn, dn' = -k^2 sn cn, am' = dn (DLMF 22.13.1-3, 22.16.1
/// ff.). Also cd' = -kc^2 sd nd, sd' = cd nd with nd = 1/dn. With respect to kc at fixed u: am_kc = -dn F_kc(am),
/// with F_kc from [`super::elliptic::incomplete`].
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
/// Each value f is within 4 eps (|f| + |u f'(u)|): a few ulp, and the effect of a few ulp in u. For |u| far beyond
/// 1/eps no digit is right, but the values stay in their ranges and satisfy the identities. Measured:
/// docs/elliptic_accuracy.md.
///
/// # Source
/// DLMF 20.2.1-4 (thetas), 22.2.2-9 (the functions by them), 22.6(iv) (imaginary arguments).
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
    let at = Quotients::new(u, kc);
    // Half way between two multiples cn is 0 to rounding, of either sign.
    let am = at.half_turns * PI + (at.sn / at.cn.max(0.0)).atan();
    let (sn, cn, dn) = at.functions(kc);
    Ok(Jacobi { sn, cn, dn, am })
}

/// (sn, cn, dn) of u for the complementary modulus `kc`: [`jacobi`] without the arctangent of `am`.
///
/// Parameters, traps, accuracy and source as for [`jacobi`].
///
/// # Errors
/// [`DomainError`] if `u` is not finite or `kc` lies outside its set.
#[inline]
pub fn sn_cn_dn(u: f64, kc: f64) -> Result<(f64, f64, f64), DomainError> {
    check("sn_cn_dn", u, kc)?;
    Ok(Quotients::new(u, kc).functions(kc))
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

/// Functions of u = 2 K n + r at r, |r| <= K or a little more, not yet clamped to their ranges.
pub(crate) struct Quotients {
    pub half_turns: f64,
    pub sn: f64,
    pub cn: f64,
    pub dn: f64,
}

impl Quotients {
    /// Functions at a finite u, for a normal kc <= 1.
    #[inline]
    pub fn new(u: f64, kc: f64) -> Self {
        let k2 = (1.0 - kc) * (1.0 + kc);
        if kc > FRAC_1_SQRT_2 {
            Self::real(u, &Nome::new(k2, kc))
        } else {
            Self::imaginary(u, kc, &Nome::new(kc * kc, k2.sqrt()))
        }
    }

    /// Functions by the nome of the modulus; the standard sine and cosine take the periods off.
    #[inline]
    fn real(u: f64, nome: &Nome) -> Self {
        let v = u / nome.period;
        let (s, c) = v.sin_cos();
        let [p1, p2, p3, p4] = nome.parts(2.0 * nome.q * ((c - s) * (c + s)));
        let over = 1.0 / (nome.theta2 * p4);
        let half_turns = nearest(v * FRAC_1_PI);
        let sign = parity(half_turns);
        Self {
            half_turns,
            sn: sign * nome.theta3 * (s * p1) * over,
            cn: sign * nome.theta4 * (c * p2) * over,
            dn: nome.theta4 / nome.theta3 * nome.theta2 * p3 * over,
        }
    }

    /// Functions by the nome of the complementary modulus.
    #[inline]
    fn imaginary(u: f64, kc: f64, nome: &Nome) -> Self {
        let (over3, over4) = (1.0 / nome.theta3, 1.0 / nome.theta4);
        let (mut half_turns, mut v) = (0.0, u / nome.period);
        let mut up = v.abs().exp();
        if nome.over_square * (kc * up) * (kc * up) > 1.0 {
            let r;
            (half_turns, r) = without_half_turns(u, kc, nome);
            v = r / nome.period;
            up = v.abs().exp();
        }
        let far = kc * up;
        let down = 1.0 / up;
        let near = kc * down;
        let s = if v.abs() < 0.5 {
            v * (v * v).series(&SINH)
        } else {
            (0.5 * (up - down)).copysign(v)
        };
        let c = 0.5 * (up + down);
        let [p1, p2, p3, p4] = nome.parts(nome.over_square * (far * far + near * near));
        let over = 1.0 / (c * p2);
        Self {
            half_turns,
            sn: nome.theta3 * over4 * (s * over) * p1,
            cn: nome.theta2 * over4 * over * p4,
            dn: nome.theta2 * over3 * over * p3,
        }
    }

    /// Values sn, cn, dn of u, clamped to their ranges.
    #[inline]
    pub fn functions(&self, kc: f64) -> (f64, f64, f64) {
        // The sum of the squares is 1 to rounding.
        let lengthened = 1.5 - 0.5 * (self.sn * self.sn + self.cn * self.cn);
        let by = parity(self.half_turns) * lengthened;
        let unit = |f: f64| (by * f).clamp(-1.0, 1.0);
        (unit(self.sn), unit(self.cn), self.dn.clamp(kc, 1.0))
    }
}

/// Parity (-1)^n.
#[inline]
fn parity(n: f64) -> f64 {
    f64::from_bits(1f64.to_bits() | ((n as i64 as u64) << 63))
}

/// Half turns n and remainder r of u = 2 K n + r, |r| <= K.
#[inline]
fn without_half_turns(u: f64, kc: f64, nome: &Nome) -> (f64, f64) {
    // K = -log(q) theta_3(0)^2/2, even where q underflows.
    let half_log = -(kc * nome.over_square.sqrt()).ln();
    let quarter = (nome.period * half_log).min(LOG_OF_LARGEST);
    let half_turns = nearest(u / (2.0 * quarter));
    // Beyond 1/eps periods the remainder has no correct digit.
    let rest = u - half_turns * (2.0 * quarter);
    (half_turns, rest.clamp(-quarter, quarter))
}

/// Nearest integer; beyond 2^52 all doubles are integers.
#[inline]
fn nearest(x: f64) -> f64 {
    const BIG: f64 = 6_755_399_441_055_744.0;
    if x.abs() < 1e15 { (x + BIG) - BIG } else { x }
}

/// 1/(2k + 1)!.
const SINH: [f64; 7] = [
    1.0,
    1.0 / 6.0,
    1.0 / 120.0,
    1.0 / 5_040.0,
    1.0 / 362_880.0,
    1.0 / 39_916_800.0,
    1.0 / 6_227_020_800.0,
];
