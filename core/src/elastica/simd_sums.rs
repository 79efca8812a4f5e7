//! Numbers at several sections of a rod, processed at once in wide registers, up to four.
//!
//! Only inlined code is compiled for the wide registers: functions carry `inline(always)`, and closures are avoided.

use crate::math::real::{Halves, Real};
use crate::math::registers::Registers;
use pulp::{Simd, WithSimd, bytemuck};
use std::ops::{Add, Mul, Sub};

/// Numbers at several sections, one in each lane of a register.
#[derive(Debug, Clone, Copy)]
pub(super) struct Lanes<S: Simd> {
    simd: S,
    at: S::f64s,
}

/// Largest number of lanes: quadrature rules have a multiple of this many nodes, which fills all lanes.
pub(super) const WIDEST: usize = 4;

/// Integrand over lanes.
pub(super) trait InLanes<const K: usize> {
    /// K numbers at each of the places `x` in [0, 1].
    fn at<S: Simd>(&self, x: Lanes<S>) -> [Lanes<S>; K];
}

/// Weighted sums of `each` over `places`, whose number is a multiple of [`WIDEST`].
#[inline(always)]
pub(super) fn sums<const K: usize>(
    each: &impl InLanes<K>,
    places: &[f64],
    weights: &[f64],
) -> [f64; K] {
    wide(LaneSums {
        each,
        places,
        weights,
    })
}

/// Weighted sums as in [`sums`], inside code that is already compiled for wide registers.
#[inline(always)]
pub(super) fn sums_in<S: Simd, const K: usize>(
    simd: S,
    each: &impl InLanes<K>,
    places: &[f64],
    weights: &[f64],
) -> [f64; K] {
    let (places, _) = S::as_simd_f64s(places);
    let (weights, _) = S::as_simd_f64s(weights);
    let mut sums = [simd.splat_f64s(0.0); K];
    for (x, weight) in places.iter().zip(weights) {
        let terms = each.at(Lanes { simd, at: *x });
        for k in 0..K {
            sums[k] = simd.mul_add_e_f64s(terms[k].at, *weight, sums[k]);
        }
    }
    let mut all = [0.0; K];
    for k in 0..K {
        all[k] = simd.reduce_sum_f64s(sums[k]);
    }
    all
}

/// Result of `work`, compiled for registers of [`WIDEST`] numbers, or for one number at a time.
#[inline(always)]
pub(super) fn wide<W: WithSimd>(work: W) -> W::Output {
    match Registers::in_use() {
        Some(registers) => registers.work_in_four(work),
        None => Simd::vectorize(pulp::Scalar::new(), work),
    }
}

struct LaneSums<'a, E, const K: usize> {
    each: &'a E,
    places: &'a [f64],
    weights: &'a [f64],
}

impl<E: InLanes<K>, const K: usize> WithSimd for LaneSums<'_, E, K> {
    type Output = [f64; K];

    #[inline(always)]
    fn with_simd<S: Simd>(self, simd: S) -> [f64; K] {
        sums_in(simd, self.each, self.places, self.weights)
    }
}

impl<S: Simd> Lanes<S> {
    /// The numbers as a slice, for scalar operations.
    #[inline(always)]
    fn each(&mut self) -> &mut [f64] {
        bytemuck::cast_slice_mut(std::slice::from_mut(&mut self.at))
    }

    /// Hyperbolic sines and cosines, |v| < 100.
    #[inline(always)]
    pub fn sinh_cosh(self) -> (Self, Self) {
        let Halves { up, down, .. } = self.half_exp();
        (up - down, up + down)
    }

    /// exp(-v) and exp(v), v > 0; v beyond [`FADED`] counts as FADED.
    #[inline(always)]
    pub fn faded(mut self) -> [Self; 2] {
        for v in self.each() {
            *v = v.min(FADED);
        }
        let Halves { up, down, .. } = self.half_exp();
        [down * 2.0, up * 2.0]
    }
}

/// Largest exponent distinguished: exp(-FADED) is negligible in every sum.
const FADED: f64 = 90.0;
impl<S: Simd> Real for Lanes<S> {
    #[inline(always)]
    fn all(self, x: f64) -> Self {
        let at = self.simd.splat_f64s(x);
        Self { at, ..self }
    }

    #[inline(always)]
    fn inverse(self) -> Self {
        let at = self.simd.div_f64s(self.simd.splat_f64s(1.0), self.at);
        Self { at, ..self }
    }

    #[inline(always)]
    fn sqrt(self) -> Self {
        let at = self.simd.sqrt_f64s(self.at);
        Self { at, ..self }
    }

    #[inline(always)]
    fn nearest(self) -> Self {
        // Beyond 2^52 all doubles are integers.
        let big = self.all(6_755_399_441_055_744.0);
        (self + big) - big
    }

    #[inline(always)]
    fn power_of_two(mut self) -> Self {
        for k in self.each() {
            *k = f64::from_bits(k.to_bits() << 52);
        }
        self
    }

    #[inline(always)]
    fn times_plus(self, factor: Self, plus: Self) -> Self {
        let at = self.simd.mul_add_e_f64s(self.at, factor.at, plus.at);
        Self { at, ..self }
    }
}

impl<S: Simd> Add for Lanes<S> {
    type Output = Self;
    #[inline(always)]
    fn add(self, other: Self) -> Self {
        let at = self.simd.add_f64s(self.at, other.at);
        Self { at, ..self }
    }
}

impl<S: Simd> Sub for Lanes<S> {
    type Output = Self;
    #[inline(always)]
    fn sub(self, other: Self) -> Self {
        let at = self.simd.sub_f64s(self.at, other.at);
        Self { at, ..self }
    }
}

impl<S: Simd> Mul for Lanes<S> {
    type Output = Self;
    #[inline(always)]
    fn mul(self, other: Self) -> Self {
        let at = self.simd.mul_f64s(self.at, other.at);
        Self { at, ..self }
    }
}

impl<S: Simd> Mul<f64> for Lanes<S> {
    type Output = Self;
    #[inline(always)]
    fn mul(self, factor: f64) -> Self {
        self * self.all(factor)
    }
}
