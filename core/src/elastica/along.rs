//! The pendulum of the rod at many places of one rod: theta functions, whose coefficients are the modulus' alone.
//!
//! With the nome q of the modulus, or of the complementary one if that is smaller, q <= exp(-pi) = 0.0432: four terms of each series are
//! exact to rounding. (s, c, d, b) are those of `Integrals` at u; in x = sin^2 v, v = pi u/(2K), or x = -sinh^2 v, v = pi u/(2K'), they are polynomials:
//!
//! ```text
//! (s, c, d) = (P1 sin v, P2 cos v, P4)/P3,  or, by Jacobi's imaginary transformation,  (P1 sinh v, P4, P2 cosh v)/P3
//! b = linear u + factor (log P3)'
//! ```

use super::chart::{Integrals, Modulus};
use super::curvature::Swing;
use std::f64::consts::{FRAC_2_PI, LN_2, LOG2_E, PI};
use std::ops::{Add, Mul, Sub};
use wide::f64x2;

/// Numbers at two places, which are worked on at once.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) struct Two(f64x2);

/// What formulas of the pendulum are made of.
pub(super) trait Real:
    Copy + Add<Output = Self> + Sub<Output = Self> + Mul<Output = Self> + Mul<f64, Output = Self>
{
    fn both(x: f64) -> Self;
    fn inverse(self) -> Self;
}

impl Real for f64 {
    fn both(x: f64) -> Self {
        x
    }

    fn inverse(self) -> Self {
        1.0 / self
    }
}

impl Real for Two {
    #[inline(always)]
    fn both(x: f64) -> Self {
        Self(f64x2::splat(x))
    }

    #[inline(always)]
    fn inverse(self) -> Self {
        Self(f64x2::splat(1.0) / self.0)
    }
}

impl Two {
    #[inline(always)]
    pub fn of(values: [f64; 2]) -> Self {
        Self(f64x2::new(values))
    }

    /// Sines and cosines of 0 <= v < 100 (Cephes' polynomials on [-pi/4, pi/4]).
    #[inline(always)]
    fn sin_cos(self) -> (Self, Self) {
        let quarter = nearest(self * FRAC_2_PI);
        let r = (self - quarter * HALF_PI[0]) - quarter * HALF_PI[1];
        let r2 = r * r;
        let sum = |p: &[f64; 6]| {
            let first = Self::both(p[5]);
            p[..5]
                .iter()
                .rev()
                .fold(first, |sum, c| sum * r2 + Self::both(*c))
        };
        let sin = r + r * r2 * sum(&SINE);
        let cos = Self::both(1.0) - r2 * 0.5 + r2 * r2 * sum(&COSINE);
        // Quarter turns: an odd one, +-1 or 0, and half turns, each of which changes the signs.
        let half = nearest(quarter * 0.5);
        let odd = quarter - half * 2.0;
        let rest = half - nearest(half * 0.5) * 2.0;
        let sign = Self::both(1.0) - rest * rest * 2.0;
        let even = (Self::both(1.0) - odd * odd) * sign;
        let odd = odd * sign;
        (sin * even + cos * odd, cos * even - sin * odd)
    }

    /// e^v, |v| < 100.
    #[inline(always)]
    fn exp(self) -> Self {
        let twos = nearest(self * LOG2_E);
        let r = (self - twos * LOG_2[0]) - twos * LOG_2[1];
        // Odd and even powers side by side.
        let r2 = r * r;
        let sum = |p: &[f64; 7]| {
            let first = Self::both(p[6]);
            p[..6]
                .iter()
                .rev()
                .fold(first, |sum, c| sum * r2 + Self::both(*c))
        };
        // Powers of two by their exponents.
        let power = |k: f64| f64::from_bits(((k as i64 + 1023) as u64) << 52);
        let [first, second] = twos.0.to_array();
        (sum(&EVEN) + r * sum(&ODD)) * Self::of([power(first), power(second)])
    }

    #[inline(always)]
    pub fn sum(self) -> f64 {
        self.0.reduce_add()
    }
}

/// The nearest integers, of |x| < 2^50.
#[inline(always)]
fn nearest(x: Two) -> Two {
    // Beyond 2^52 there are integers only.
    const BIG: f64 = 6_755_399_441_055_744.0;
    (x + Two::both(BIG)) - Two::both(BIG)
}

/// pi/2 and log 2 in two parts, the first with few enough bits to be multiplied without rounding.
const HALF_PI: [f64; 2] = [1.570_796_310_901_641_8, 1.589_325_477_352_819_6e-8];
const LOG_2: [f64; 2] = [0.693_145_751_953_125, 1.428_606_820_309_417_2e-6];
/// 1/(2k)! and 1/(2k + 1)!.
const EVEN: [f64; 7] = [
    1.0,
    1.0 / 2.0,
    1.0 / 24.0,
    1.0 / 720.0,
    1.0 / 40_320.0,
    1.0 / 3_628_800.0,
    1.0 / 479_001_600.0,
];
const ODD: [f64; 7] = [
    1.0,
    1.0 / 6.0,
    1.0 / 120.0,
    1.0 / 5_040.0,
    1.0 / 362_880.0,
    1.0 / 39_916_800.0,
    1.0 / 6_227_020_800.0,
];
/// (sin r - r)/r^3 and (cos r - 1 + r^2/2)/r^4 in r^2.
const SINE: [f64; 6] = [
    -1.666_666_666_666_663e-1,
    8.333_333_333_322_118e-3,
    -1.984_126_982_958_954e-4,
    2.755_731_362_138_572_5e-6,
    -2.505_074_776_285_780_7e-8,
    1.589_623_015_765_465_7e-10,
];
const COSINE: [f64; 6] = [
    4.166_666_666_666_659_3e-2,
    -1.388_888_888_887_305_6e-3,
    2.480_158_728_885_170_5e-5,
    -2.755_731_417_929_674e-7,
    2.087_570_084_197_473e-9,
    -1.135_853_652_138_768_2e-11,
];

impl Add for Two {
    type Output = Self;
    #[inline(always)]
    fn add(self, other: Self) -> Self {
        Self(self.0 + other.0)
    }
}

impl Sub for Two {
    type Output = Self;
    #[inline(always)]
    fn sub(self, other: Self) -> Self {
        Self(self.0 - other.0)
    }
}

impl Mul for Two {
    type Output = Self;
    #[inline(always)]
    fn mul(self, other: Self) -> Self {
        Self(self.0 * other.0)
    }
}

impl Mul<f64> for Two {
    type Output = Self;
    #[inline(always)]
    fn mul(self, factor: f64) -> Self {
        Self(self.0 * f64x2::splat(factor))
    }
}

/// A place of a rod, or two, as [`Integrals`](super::chart::Integrals) has it at u = lam part.
#[derive(Debug, Clone, Copy)]
pub(super) struct Places<T> {
    /// The part of the rod beyond it.
    pub part: T,
    pub u: T,
    pub s: T,
    pub c: T,
    pub d: T,
    pub b: T,
}

impl<T: Real> Places<T> {
    /// The pendulum there.
    #[inline(always)]
    pub fn swing(&self, modulus: &Modulus) -> Swing<T> {
        Swing::at(modulus, self.u, [self.s, self.c, self.d, self.b])
    }
}

/// A rod of one modulus and one load.
#[derive(Debug, Clone, Copy)]
pub(super) struct Along {
    lam: f64,
    /// True where v is real: the nome is that of the modulus.
    real: bool,
    /// dv/du, and the nome.
    pace: f64,
    nome: f64,
    /// (sin v, cos v) in the middle of the rod, or (e^v, e^-v).
    middle: [f64; 2],
    /// True if v goes beyond half a period.
    winds: bool,
    /// P1 .. P4 and P3'/(sin v cos v), with the factors that s, c, d and b have.
    p1: [f64; 4],
    p2: [f64; 4],
    p3: [f64; 4],
    p4: [f64; 4],
    slope: [f64; 3],
    /// b = linear u + slope.
    linear: f64,
    /// What b gains, beyond that, in a period 2K.
    turns: f64,
}

impl Along {
    /// Of the rod with this modulus and 0 < lam.
    #[inline(always)]
    pub fn new(modulus: &Modulus, lam: f64) -> Self {
        let (k, kc) = (modulus.kap.abs(), modulus.kap_c);
        let real = kc > k;
        // The nome from the smaller of both moduli and the larger one.
        let (small, large) = if real { (k, kc) } else { (kc, k) };
        let root = 1.0 + large.sqrt();
        // Of its square: the nome over that is regular.
        let per = 0.5 / ((1.0 + large) * (root * root));
        let e = per * small * small;
        let e4 = (e * e) * (e * e);
        let scale = per * (1.0 + e4 * (2.0 + e4 * (15.0 + e4 * 150.0)));
        let q = scale * small * small;
        let q2 = q * q;
        let (q4, q6) = (q2 * q2, q2 * q2 * q2);
        let (q8, q9, q12) = (q4 * q4, q4 * q4 * q, q6 * q6);
        let theta3 = 1.0 + 2.0 * (q + q4 + q9);
        let theta4 = 1.0 - 2.0 * (q - q4 + q9);
        let theta2 = 1.0 + q2 + q6 + q12;
        let (over2, over3) = (1.0 / theta2, 1.0 / theta3);
        let pace = over3 * over3;
        // (log P3)' = 2 q (..) in both; the nome of a weakly bent rod drops out against kap^2.
        let (by_s, by_c, by_d, by_b, linear) = if real {
            let linear = pace * pace * 8.0 * scale * (1.0 + 4.0 * q * q2 + 9.0 * q8) * over3;
            (
                theta4 * over2,
                theta3 * over2,
                kc.sqrt(),
                -pace * scale,
                linear,
            )
        } else {
            let (over4, over_k2) = (1.0 / theta4, 1.0 / (k * k));
            let left = pace * pace * q * (8.0 - 32.0 * q * q2 + 72.0 * q8) * over4;
            (
                kc * theta3 * theta3 * over2 * over4,
                theta3 * over4,
                kc * theta3 * over2,
                pace * q * over_k2,
                (left - kc * kc) * over_k2,
            )
        };
        let (by_2, by_4) = if real { (by_c, by_d) } else { (by_d, by_c) };
        let half = 0.5 * lam * pace;
        let middle = if real {
            let (sin, cos) = half.sin_cos();
            [sin, cos]
        } else {
            let e = half.exp();
            [e, 1.0 / e]
        };
        Self {
            lam,
            real,
            pace,
            nome: q,
            middle,
            winds: !real && middle[0].powi(4) * q > 1.0,
            p1: [
                1.0 - 3.0 * q2 + 5.0 * q6 - 7.0 * q12,
                4.0 * q2 - 20.0 * q6 + 56.0 * q12,
                16.0 * q6 - 112.0 * q12,
                64.0 * q12,
            ]
            .map(|x| x * by_s),
            p2: [
                theta2,
                -4.0 * q2 - 12.0 * q6 - 24.0 * q12,
                16.0 * q6 + 80.0 * q12,
                -64.0 * q12,
            ]
            .map(|x| x * by_2),
            p3: [
                theta3,
                -4.0 * q - 16.0 * q4 - 36.0 * q9,
                16.0 * q4 + 96.0 * q9,
                -64.0 * q9,
            ],
            p4: [
                theta4,
                4.0 * q - 16.0 * q4 + 36.0 * q9,
                16.0 * q4 - 96.0 * q9,
                64.0 * q9,
            ]
            .map(|x| x * by_4),
            slope: [
                8.0 + 32.0 * q * q2 + 72.0 * q8,
                -64.0 * q * q2 - 384.0 * q8,
                384.0 * q8,
            ]
            .map(|x| x * by_b),
            linear,
            turns: if real { 0.0 } else { 2.0 * pace / (k * k) },
        }
    }

    /// The nodes of a Gauss rule that integrates along this rod to the part `error`. The poles of the pendulum lie K' away from the rod, so that
    /// the error falls like rho^-2n, log rho = asinh(z), z = 2 K'/lam (Bernstein's ellipse); the factor before it is measured, and logarithms
    /// and 1/asinh z = 1/z + Z[0] z/(z + Z[1]) are rough.
    #[inline(always)]
    pub fn nodes(&self, error: f64) -> usize {
        const Z: [f64; 2] = [0.25, 0.8];
        // K'/K = log(1/q)/pi.
        let quarter = 0.5 * PI / self.pace;
        let away = match self.real {
            true => quarter * (binary_digits(self.nome) * (LN_2 / PI)).min(FARTHEST),
            false => quarter,
        };
        let z = 2.0 * away / self.lam;
        let over = 1.0 / z + Z[0] * z / (z + Z[1]);
        let digits = binary_digits(error);
        let nodes = (NODES + 0.5 * LN_2 * digits) * over;
        nodes.max(FEWEST[0] + FEWEST[1] * digits) as usize
    }

    /// The chart's integrals of the whole rod, whose modulus this is.
    #[inline(always)]
    pub fn clamp(&self, modulus: &Modulus) -> Integrals {
        // At twice the angle of the middle.
        let [sin, cos] = self.middle;
        let (turned, wound) = match self.real {
            true => ((2.0 * sin * cos, 1.0 - 2.0 * sin * sin), Wound::default()),
            false => {
                let (e, wound) = self.unwound(sin * sin);
                (halves(e, 1.0 / e), wound)
            }
        };
        let Places { s, c, d, b, .. } = self.place(1.0, turned, [wound.turns, wound.sign]);
        Integrals {
            kap: modulus.kap,
            kap_c: modulus.kap_c,
            s,
            c,
            d,
            lam: self.lam,
            b,
        }
    }

    /// e^v with whole periods 2K taken off, exp(-2K dv/du) = q.
    fn unwound(&self, mut e: f64) -> (f64, Wound) {
        let mut wound = Wound::default();
        while e * e * self.nome > 1.0 {
            e *= self.nome;
            wound.turns += 1.0;
            wound.sign = -wound.sign;
        }
        (e, wound)
    }

    /// At u = lam (1 + x)/2 and at u = lam (1 - x)/2, for two x at once.
    #[inline(always)]
    pub fn at(&self, x: Two) -> (Places<Two>, Places<Two>) {
        let part = x * 0.5;
        let parts = (Two::both(0.5) + part, Two::both(0.5) - part);
        let off = x * (0.5 * self.lam * self.pace);
        let [a, b] = self.middle;
        let still = [Two::both(0.0), Two::both(1.0)];
        if self.real {
            let (s, c) = off.sin_cos();
            let more = (c * a + s * b, c * b - s * a);
            let less = (c * a - s * b, c * b + s * a);
            return (
                self.place(parts.0, more, still),
                self.place(parts.1, less, still),
            );
        }
        let up = off.exp();
        let down = up.inverse();
        let (more, less) = ((up * a, down * b), (down * a, up * b));
        if self.winds {
            let (more, wound) = self.unwound_two(more.0);
            let first = self.place(parts.0, more, wound);
            let (less, wound) = self.unwound_two(less.0);
            return (first, self.place(parts.1, less, wound));
        }
        (
            self.place(parts.0, halves(more.0, more.1), still),
            self.place(parts.1, halves(less.0, less.1), still),
        )
    }

    /// (sinh v, cosh v) of two e^v at once, with what was taken off.
    fn unwound_two(&self, up: Two) -> ((Two, Two), [Two; 2]) {
        let [first, second] = up.0.to_array();
        let ((a, wound_a), (b, wound_b)) = (self.unwound(first), self.unwound(second));
        let up = Two::of([a, b]);
        let turns = Two::of([wound_a.turns, wound_b.turns]);
        let sign = Two::of([wound_a.sign, wound_b.sign]);
        (halves(up, up.inverse()), [turns, sign])
    }

    /// The place with this part of the rod beyond it from (sin v, cos v), or (sinh v, cosh v); `turns` whole periods have been taken off v, which
    /// change the sign of s and c to `sign`.
    #[inline(always)]
    fn place<T: Real>(&self, part: T, (sin, cos): (T, T), [turns, sign]: [T; 2]) -> Places<T> {
        let square = sin * sin * if self.real { 1.0 } else { -1.0 };
        let two = |p: &[f64; 3]| (square * p[2] + T::both(p[1])) * square + T::both(p[0]);
        let three = |p: &[f64; 4]| {
            ((square * p[3] + T::both(p[2])) * square + T::both(p[1])) * square + T::both(p[0])
        };
        let over = three(&self.p3).inverse();
        let (p2, p4) = (cos * three(&self.p2) * over, three(&self.p4) * over);
        let (c, d) = if self.real { (p2, p4) } else { (p4, p2) };
        let u = part * self.lam;
        Places {
            part,
            u,
            s: sin * three(&self.p1) * over * sign,
            c: c * sign,
            d,
            b: u * self.linear + sin * cos * two(&self.slope) * over + turns * self.turns,
        }
    }
}

/// -log_2 x, 0 < x < 1, rounded up.
#[inline(always)]
fn binary_digits(x: f64) -> f64 {
    1023.0 - (x.to_bits() >> 52) as f64
}

/// (sinh v, cosh v) of e^v and e^-v.
#[inline(always)]
fn halves<T: Real>(up: T, down: T) -> (T, T) {
    ((up - down) * 0.5, (up + down) * 0.5)
}

/// Periods that have been taken off.
struct Wound {
    turns: f64,
    sign: f64,
}

impl Default for Wound {
    fn default() -> Self {
        Self {
            turns: 0.0,
            sign: 1.0,
        }
    }
}

/// Half the logarithm of the factor before the power of the ellipse.
const NODES: f64 = 3.0;
/// Slightly loaded rods bend by polynomials.
const FEWEST: [f64; 2] = [3.4, 0.2];
/// K'/K beyond which poles count as infinitely far.
const FARTHEST: f64 = 6.0;

#[cfg(test)]
mod tests {
    use super::*;

    /// Catches a wrong coefficient, nome or period: Carlson's integrals and Jacobi's functions by the ladder are another way to the same.
    #[test]
    fn places_are_those_of_the_chart() {
        for p in [1e-3, -0.3, 0.88, -0.8815, 1.6, -3.2, 6.0, 12.0] {
            for lam in [0.1, 1.4, 4.6, 9.0, 29.0] {
                let modulus = Modulus::new(p);
                let along = Along::new(&modulus, lam);
                for x in [[0.03, 0.41], [0.77, 0.999]] {
                    let found = along.at(Two::of(x));
                    for (side, k) in [(0, 0), (0, 1), (1, 0), (1, 1)] {
                        let found = [&found.0, &found.1][side];
                        let part = found.part.0.to_array()[k];
                        let expected = 0.5 + [0.5, -0.5][side] * x[k];
                        assert!((part - expected).abs() < 1e-15);
                        let at = Integrals::at_load(p, lam * part).unwrap();
                        let both = [
                            (found.s, at.s),
                            (found.c, at.c),
                            (found.d, at.d),
                            (found.b, at.b),
                        ];
                        for (found, expected) in both {
                            let error = (found.0.to_array()[k] - expected).abs();
                            assert!(
                                error < 2e-14 * (1.0 + at.lam),
                                "p {p} lam {lam} x {x:?}: {error:e}"
                            );
                        }
                    }
                }
            }
        }
    }
}
