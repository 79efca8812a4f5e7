//! Interval arithmetic of doubles. Every operation is rounded outward by one to two units in the last place. This
//! suffices, since IEEE 754 rounds sums, products, quotients and square roots correctly.

use std::ops::{Add, Div, Mul, Neg, Sub};

/// Closed interval [lo, hi].
#[derive(Debug, Clone, Copy)]
pub(super) struct Interval {
    pub lo: f64,
    pub hi: f64,
}

const ENTIRE: Interval = Interval {
    lo: f64::NEG_INFINITY,
    hi: f64::INFINITY,
};

/// Absolute part of outward rounding. Without it enclosures of zero would become subnormal numbers, which are a
/// hundred times slower.
const TINY: f64 = 1e-120;

#[inline(always)]
fn below(x: f64) -> f64 {
    x - (x.abs() * f64::EPSILON + TINY)
}

#[inline(always)]
fn above(x: f64) -> f64 {
    x + (x.abs() * f64::EPSILON + TINY)
}

/// Minimum of two numbers, neither of them NaN: one instruction.
#[inline(always)]
fn lesser(a: f64, b: f64) -> f64 {
    if a < b { a } else { b }
}

#[inline(always)]
fn greater(a: f64, b: f64) -> f64 {
    if a > b { a } else { b }
}

impl Interval {
    pub const ZERO: Self = Self::point(0.0);
    pub const ONE: Self = Self::point(1.0);

    pub const fn point(x: f64) -> Self {
        Self { lo: x, hi: x }
    }

    pub fn new(lo: f64, hi: f64) -> Self {
        assert!(lo <= hi, "{lo} {hi}");
        Self { lo, hi }
    }

    /// Interval [-x, x].
    pub fn about_zero(x: f64) -> Self {
        Self::new(-x, x)
    }

    /// Outward rounding: |x| epsilon is one to two units in the last place of x, and TINY more than one of any
    /// smaller number.
    #[inline(always)]
    fn outward(lo: f64, hi: f64) -> Self {
        Self {
            lo: below(lo),
            hi: above(hi),
        }
    }

    /// Largest absolute value.
    pub fn size(self) -> f64 {
        self.lo.abs().max(self.hi.abs())
    }

    /// Least absolute value.
    pub fn least(self) -> f64 {
        self.lo.max(-self.hi).max(0.0)
    }

    pub fn hull(self, other: Self) -> Self {
        Self::new(self.lo.min(other.lo), self.hi.max(other.hi))
    }

    /// Intersection, for a number known to lie in both.
    pub fn meet(self, other: Self) -> Self {
        Self::new(self.lo.max(other.lo), self.hi.min(other.hi))
    }

    pub fn square(self) -> Self {
        let (least, most) = (self.least(), self.size());
        Self {
            lo: below(least * least).max(0.0),
            hi: above(most * most),
        }
    }

    /// Square root of a number known to be >= 0.
    pub fn sqrt(self) -> Self {
        Self {
            lo: below(self.lo.max(0.0).sqrt()).max(0.0),
            hi: above(self.hi.sqrt()),
        }
    }

    /// Exponential: Taylor series at x/2^k, squared k times.
    pub fn exp(self) -> Self {
        Self::new(Self::exp_at(self.lo).lo, Self::exp_at(self.hi).hi)
    }

    fn exp_at(x: f64) -> Self {
        let halvings = (x.abs() * 16.0).max(1.0).log2().ceil() as i32;
        let y = Self::point(x * 0.5f64.powi(halvings));
        // The terms after the twelfth sum to less than a hundredth of it.
        let mut sum = Self::new(0.99, 1.01);
        for k in (1..=12).rev() {
            sum = Self::ONE + sum * y / Self::point(f64::from(k));
        }
        (0..halvings).fold(sum, |e, _| e.square())
    }
}

impl Add for Interval {
    type Output = Self;
    #[inline(always)]
    fn add(self, b: Self) -> Self {
        Self::outward(self.lo + b.lo, self.hi + b.hi)
    }
}

impl Sub for Interval {
    type Output = Self;
    #[inline(always)]
    fn sub(self, b: Self) -> Self {
        Self::outward(self.lo - b.hi, self.hi - b.lo)
    }
}

impl Neg for Interval {
    type Output = Self;
    #[inline(always)]
    fn neg(self) -> Self {
        Self {
            lo: -self.hi,
            hi: -self.lo,
        }
    }
}

impl Mul for Interval {
    type Output = Self;
    #[inline(always)]
    fn mul(self, b: Self) -> Self {
        let [p, q, r, s] = [
            self.lo * b.lo,
            self.lo * b.hi,
            self.hi * b.lo,
            self.hi * b.hi,
        ];
        if (p + q + r + s).is_nan() {
            return ENTIRE;
        }
        Self::outward(
            lesser(lesser(p, q), lesser(r, s)),
            greater(greater(p, q), greater(r, s)),
        )
    }
}

impl Div for Interval {
    type Output = Self;
    #[inline(always)]
    fn div(self, b: Self) -> Self {
        if !(b.lo > 0.0 || b.hi < 0.0) {
            return ENTIRE;
        }
        self * Self::outward(1.0 / b.hi, 1.0 / b.lo)
    }
}
