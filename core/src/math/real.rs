//! Numbers of which formulas are made: one, or several at once.

use std::ops::{Add, Mul, Sub};

/// What formulas of the pendulum are made of.
pub(crate) trait Real:
    Copy + Add<Output = Self> + Sub<Output = Self> + Mul<Output = Self> + Mul<f64, Output = Self>
{
    /// x at all places at which this is.
    fn all(self, x: f64) -> Self;
    fn inverse(self) -> Self;
    /// The nearest integer, of |x| < 2^50.
    fn nearest(self) -> Self;
    /// self times the one plus the other, rounded once where the processor does that as fast.
    fn times_plus(self, factor: Self, plus: Self) -> Self;

    /// The sum of k[i] x[i].
    #[inline(always)]
    fn mixed<const N: usize>(k: [f64; N], x: [Self; N]) -> Self {
        let mut sum = x[0] * k[0];
        for i in 1..N {
            sum = x[i].times_plus(x[i].all(k[i]), sum);
        }
        sum
    }

    /// The sum of p[k] x^k.
    #[inline(always)]
    fn series<const N: usize>(self, p: &[f64; N]) -> Self {
        let mut sum = self.all(p[N - 1]);
        for c in p[..N - 1].iter().rev() {
            sum = sum.times_plus(self, self.all(*c));
        }
        sum
    }
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
    fn nearest(self) -> Self {
        self.round()
    }

    #[inline(always)]
    fn times_plus(self, factor: Self, plus: Self) -> Self {
        self * factor + plus
    }
}
