//! Numbers at several places of a rod, which are worked on at once: as many as the processor has room for.
//!
//! What is compiled for its wide registers is what is inlined, always: closures are not.

use crate::math::real::Real;
use pulp::{Arch, Simd, WithSimd, bytemuck};
use std::f64::consts::{FRAC_2_PI, LOG2_E};
use std::ops::{Add, Mul, Sub};

/// Numbers at [`Lanes::COUNT`] places.
#[derive(Debug, Clone, Copy)]
pub(super) struct Lanes<S: Simd> {
    simd: S,
    at: S::f64s,
}

/// The most lanes that there are: rules of so many nodes, or a multiple, fill all.
pub(super) const WIDEST: usize = 4;

/// What is done with lanes.
pub(super) trait InLanes<const K: usize> {
    /// K numbers at places, from those on [0, 1].
    fn at<S: Simd>(&self, x: Lanes<S>) -> [Lanes<S>; K];
}

/// Sums of `each` with these weights over places, a multiple of [`WIDEST`].
#[inline(always)]
pub(super) fn sums<const K: usize>(
    each: &impl InLanes<K>,
    places: &[f64],
    weights: &[f64],
) -> [f64; K] {
    wide(Sums {
        each,
        places,
        weights,
    })
}

/// The same within what is compiled for wide registers already.
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

/// Does `work`, all of which is inlined, compiled for the widest registers that the processor has.
#[inline(always)]
pub(super) fn wide<W: WithSimd>(work: W) -> W::Output {
    Arch::new().dispatch(work)
}

struct Sums<'a, E, const K: usize> {
    each: &'a E,
    places: &'a [f64],
    weights: &'a [f64],
}

impl<E: InLanes<K>, const K: usize> WithSimd for Sums<'_, E, K> {
    type Output = [f64; K];

    #[inline(always)]
    fn with_simd<S: Simd>(self, simd: S) -> [f64; K] {
        sums_in(simd, self.each, self.places, self.weights)
    }
}

impl<S: Simd> Lanes<S> {
    /// The numbers, to be worked on one by one.
    #[inline(always)]
    pub fn each(&mut self) -> &mut [f64] {
        bytemuck::cast_slice_mut(std::slice::from_mut(&mut self.at))
    }

    /// Sines and cosines of 0 <= v < 100 (Cephes' polynomials on [-pi/4, pi/4]).
    #[inline(always)]
    pub fn sin_cos(self) -> (Self, Self) {
        let quarter = (self * FRAC_2_PI).nearest();
        let r = (self - quarter * HALF_PI[0]) - quarter * HALF_PI[1];
        let r2 = r * r;
        let sin = r + r * r2 * r2.series(&SINE);
        let cos = self.all(1.0) - r2 * 0.5 + r2 * r2 * r2.series(&COSINE);
        // Quarter turns: an odd one, +-1 or 0, and half turns, each of which changes the signs.
        let half = (quarter * 0.5).nearest();
        let odd = quarter - half * 2.0;
        let rest = half - (half * 0.5).nearest() * 2.0;
        let sign = self.all(1.0) - rest * rest * 2.0;
        let even = (self.all(1.0) - odd * odd) * sign;
        let odd = odd * sign;
        (sin * even + cos * odd, cos * even - sin * odd)
    }

    /// e^v and e^-v, |v| < 100.
    #[inline(always)]
    pub fn exp(self) -> (Self, Self) {
        let twos = (self * LOG2_E).nearest();
        let r = (self - twos * LOG_2[0]) - twos * LOG_2[1];
        // Odd and even powers side by side.
        let r2 = r * r;
        let (even, odd) = (r2.series(&EVEN), r * r2.series(&ODD));
        let up = twos.power_of_two();
        let down = (twos * -1.0).power_of_two();
        ((even + odd) * up, (even - odd) * down)
    }

    /// 2^k of integers |k| < 1023: the last digits of k + 1023 + 2^52 become the exponent.
    #[inline(always)]
    fn power_of_two(self) -> Self {
        let mut power = self + self.all(4_503_599_627_371_519.0);
        for k in power.each() {
            *k = f64::from_bits(k.to_bits() << 52);
        }
        power
    }

    /// The nearest integers, of |x| < 2^50.
    #[inline(always)]
    fn nearest(self) -> Self {
        // Beyond 2^52 there are integers only.
        let big = self.all(6_755_399_441_055_744.0);
        (self + big) - big
    }
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
