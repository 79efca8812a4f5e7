//! Arithmetic shared by formulas over one number and over several in wide registers.

use std::f64::consts::LOG2_E;
use std::ops::{Add, Mul, Sub};

/// Number type of pendulum formulas.
pub trait Real:
    Copy + Add<Output = Self> + Sub<Output = Self> + Mul<Output = Self> + Mul<f64, Output = Self>
{
    /// x in all lanes, in the registers of `self`.
    fn all(self, x: f64) -> Self;
    /// 1/x.
    fn inverse(self) -> Self;
    /// Square root.
    fn sqrt(self) -> Self;
    /// Nearest integer, for |x| < 2^50.
    fn nearest(self) -> Self;
    /// self * factor + plus, rounded once where the processor does so at no cost.
    fn times_plus(self, factor: Self, plus: Self) -> Self;
    /// 2^k of integers |k| < 1023, given k + 2^52 + 1023: the last bits become the exponent.
    fn power_of_two(self) -> Self;

    /// Sum of k_i x_i.
    #[inline(always)]
    fn weighted_sum<const N: usize>(k: [f64; N], x: [Self; N]) -> Self {
        let mut sum = x[0] * k[0];
        for i in 1..N {
            sum = x[i].times_plus(x[i].all(k[i]), sum);
        }
        sum
    }

    /// Sum of p_k x^k.
    #[inline(always)]
    fn series<const N: usize>(self, p: &[f64; N]) -> Self {
        let mut sum = self.all(p[N - 1]);
        for c in p[..N - 1].iter().rev() {
            sum = sum.times_plus(self, self.all(*c));
        }
        sum
    }

    /// Sines and cosines, |v| <= pi/2.
    #[inline(always)]
    fn sin_cos(self) -> (Self, Self) {
        let minus = self * self * -1.0;
        let odd = minus.series(&const { reciprocal_factorials::<10>(1) });
        let even = minus.series(&const { reciprocal_factorials::<11>(0) });
        (self * odd, even)
    }

    /// Halves of e^v and e^-v, |v| < 700.
    #[inline(always)]
    fn half_exp(self) -> Halves<Self> {
        let twos = (self * LOG2_E).nearest();
        let r = Self::weighted_sum([1.0, -LOG_2[0], -LOG_2[1]], [self, twos, twos]);
        // Odd and even powers are independent sums; |r| < 0.35.
        let r2 = r * r;
        let even = r2.series(&const { reciprocal_factorials::<7>(0) });
        let odd = r * r2.series(&const { reciprocal_factorials::<7>(1) });
        Halves {
            up: (even + odd) * (twos + self.all(HALF)).power_of_two(),
            down: (even - odd) * (self.all(HALF) - twos).power_of_two(),
            twos,
            odd,
        }
    }
}

/// Halves of e^v and e^-v, from v = twos log 2 + r and sinh r.
#[derive(Debug, Clone, Copy)]
pub struct Halves<T> {
    /// e^v/2.
    pub up: T,
    /// e^-v/2.
    pub down: T,
    /// The integer `twos`.
    pub twos: T,
    /// sinh r.
    pub odd: T,
}

/// Argument for which [`Real::power_of_two`] gives 1/2.
const HALF: f64 = 4_503_599_627_371_518.0;
/// log 2 in two parts, the first with few enough bits to be multiplied without rounding.
const LOG_2: [f64; 2] = [0.693_145_751_953_125, 1.428_606_820_309_417_2e-6];

/// 1/(2k + first)!.
const fn reciprocal_factorials<const N: usize>(first: usize) -> [f64; N] {
    let mut all = [1.0; N];
    let mut k = 1;
    while k < N {
        let n = (2 * k + first) as f64;
        all[k] = all[k - 1] / (n * (n - 1.0));
        k += 1;
    }
    all
}

impl Real for f64 {
    #[inline(always)]
    fn all(self, x: f64) -> Self {
        x
    }

    #[inline(always)]
    fn inverse(self) -> Self {
        1.0 / self
    }

    #[inline(always)]
    fn sqrt(self) -> Self {
        f64::sqrt(self)
    }

    #[inline(always)]
    fn nearest(self) -> Self {
        self.round()
    }

    #[inline(always)]
    fn times_plus(self, factor: Self, plus: Self) -> Self {
        self * factor + plus
    }

    #[inline(always)]
    fn power_of_two(self) -> Self {
        Self::from_bits(self.to_bits() << 52)
    }
}
