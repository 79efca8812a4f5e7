//! Numbers at the eight nodes of a Gauss rule, processed at once.
//!
//! Only inlined code is compiled for the wide registers: functions carry `inline(always)`, and closures are avoided.

use super::Row;
use super::collocation_tables::{integral_table, mode_table};
use super::real::Real;
use pulp::Simd;
use std::ops::{Add, Mul, Sub};

/// Nodes and weights of the Gauss rule on [-1, 1].
const NODES: Row = [
    -0.960_289_856_497_536_3,
    -0.796_666_477_413_626_7,
    -0.525_532_409_916_329,
    -0.183_434_642_495_649_8,
    0.183_434_642_495_649_8,
    0.525_532_409_916_329,
    0.796_666_477_413_626_7,
    0.960_289_856_497_536_3,
];
const WEIGHTS: Row = [
    0.101_228_536_290_376_26,
    0.222_381_034_453_374_48,
    0.313_706_645_877_887_27,
    0.362_683_783_378_362,
    0.362_683_783_378_362,
    0.313_706_645_877_887_27,
    0.222_381_034_453_374_48,
    0.101_228_536_290_376_26,
];

/// `MODES[j][k]`: contribution of the value at node j to the coefficient of P_k.
const MODES: [[f64; 8]; 8] = mode_table(&NODES, &WEIGHTS);

/// `INTEGRALS[j][i]` = a_ij.
const INTEGRALS: [Row; 8] = integral_table(&MODES, &NODES);

/// Contributions to the coefficient of P_7.
const LAST_MODE: Row = {
    let mut last = [0.0; 8];
    let mut j = 0;
    while j < 8 {
        last[j] = MODES[j][7];
        j += 1;
    }
    last
};

/// The Gauss rule on a step.
pub(crate) struct GaussRule<S: Simd> {
    /// h b_j.
    weights: Eight<S>,
    /// h a_ij by j.
    integrals: [Eight<S>; 8],
    top: Eight<S>,
}

impl<S: Simd> GaussRule<S> {
    /// Rule for steps of length `h`.
    #[inline(always)]
    pub fn new(simd: S, h: f64) -> Self {
        let mut integrals = [Eight::all(simd, 0.0); 8];
        for j in 0..8 {
            integrals[j] = Eight::of(simd, INTEGRALS[j]) * h;
        }
        Self {
            weights: Eight::of(simd, WEIGHTS) * (0.5 * h),
            integrals,
            top: Eight::of(simd, LAST_MODE),
        }
    }

    /// Stage values z_i = z + h sum_j a_ij k_j.
    #[inline(always)]
    pub fn places<const N: usize>(&self, z: &[f64; N], slopes: &[Eight<S>; N]) -> [Eight<S>; N] {
        let mut all = *slopes;
        for i in 0..N {
            all[i] = (self.integrals[0]).times_plus(slopes[i].spread(0), slopes[i].with(z[i]));
        }
        for j in 1..8 {
            for i in 0..N {
                all[i] = (self.integrals[j]).times_plus(slopes[i].spread(j), all[i]);
            }
        }
        all
    }

    /// Integral h sum_j b_j k_j over the step.
    #[inline(always)]
    pub fn integral(&self, slope: &Eight<S>) -> f64 {
        slope.sum(self.weights)
    }

    /// Largest |coefficient of P_7| of the slopes.
    #[inline(always)]
    pub fn top<const N: usize>(&self, slopes: &[Eight<S>; N]) -> f64 {
        let mut largest = 0.0_f64;
        for slope in slopes {
            largest = largest.max(slope.sum(self.top).abs());
        }
        largest
    }
}

/// Interpolation from the nodes of one step to those of another.
pub(crate) struct Extension<S: Simd> {
    /// Lagrange's polynomials of the first step's nodes.
    by: [Eight<S>; 8],
}

impl<S: Simd> Extension<S> {
    /// Interpolation to a step that starts `from` lengths of the first step after its start, and is `ratio` times as
    /// long.
    #[inline(always)]
    pub fn new(simd: S, from: f64, ratio: f64) -> Self {
        let x = Eight::of(simd, NODES) * ratio + Eight::all(simd, 2.0 * from + ratio - 1.0);
        let mut p = [Eight::all(simd, 1.0), x, x, x, x, x, x, x];
        for k in 1..7 {
            let n = k as f64;
            // Only one operation waits for the previous polynomial.
            let steep = x * ((2.0 * n + 1.0) / (n + 1.0));
            p[k + 1] = steep.times_plus(p[k], p[k - 1] * (-n / (n + 1.0)));
        }
        let mut by = p;
        for j in 0..8 {
            by[j] = Eight::all(simd, MODES[j][0]);
            for k in 1..8 {
                by[j] = p[k].times_plus(x.with(MODES[j][k]), by[j]);
            }
        }
        Self { by }
    }

    /// Interpolated values at the nodes of the second step.
    #[inline(always)]
    pub fn of<const N: usize>(&self, values: &[Eight<S>; N]) -> [Eight<S>; N] {
        let mut all = *values;
        for i in 0..N {
            all[i] = self.by[0] * values[i].spread(0);
        }
        for j in 1..8 {
            for i in 0..N {
                all[i] = self.by[j].times_plus(values[i].spread(j), all[i]);
            }
        }
        all
    }
}

/// An operation on the registers that hold eight numbers, written out for one register and for two. The kernels
/// consist of hundreds of such operations, and a loop for each would dominate the compile time.
macro_rules! of_registers {
    ($x:ident in $to:expr $(, $y:ident in $other:expr)* => $result:expr) => {{
        let (at, _) = S::as_mut_simd_f64s(&mut $to);
        $(let ($y, _) = S::as_simd_f64s(&$other);)*
        if size_of::<S::f64s>() == 64 {
            at[0] = of_registers!(@one 0, at $x $($y)*, $result);
        } else if size_of::<S::f64s>() == 32 {
            at[0] = of_registers!(@one 0, at $x $($y)*, $result);
            at[1] = of_registers!(@one 1, at $x $($y)*, $result);
        } else {
            for i in 0..at.len() {
                at[i] = of_registers!(@one i, at $x $($y)*, $result);
            }
        }
    }};
    (@one $i:expr, $at:ident $x:ident $($y:ident)*, $result:expr) => {{
        let $x = $at[$i];
        $(let $y = $y[$i];)*
        $result
    }};
}

/// Eight numbers, in one cache line.
#[derive(Debug, Clone, Copy)]
#[repr(align(64))]
pub struct Eight<S: Simd> {
    simd: S,
    at: [f64; 8],
}

impl<S: Simd> Eight<S> {
    /// Eight numbers from an array.
    #[inline(always)]
    pub fn of(simd: S, at: [f64; 8]) -> Self {
        Self { simd, at }
    }

    /// The numbers as an array.
    #[inline(always)]
    pub fn numbers(self) -> [f64; 8] {
        self.at
    }

    /// Absolute values.
    #[inline(always)]
    pub fn abs(mut self) -> Self {
        of_registers!(x in self.at => self.simd.abs_f64s(x));
        self
    }

    /// Selection by lane: `one` where `self` is below `bound`, `other` where not.
    #[inline(always)]
    pub fn below(mut self, bound: f64, one: Self, other: Self) -> Self {
        let simd = self.simd;
        let bound = simd.splat_f64s(bound);
        of_registers!(x in self.at, y in one.at, z in other.at => {
            simd.select_f64s(simd.less_than_f64s(x, bound), y, z)
        });
        self
    }

    /// Smaller of two, by lane.
    #[inline(always)]
    pub fn smaller(mut self, other: Self) -> Self {
        of_registers!(x in self.at, y in other.at => self.simd.min_f64s(x, y));
        self
    }

    /// Greater of two, by lane.
    #[inline(always)]
    pub fn greater(mut self, other: Self) -> Self {
        of_registers!(x in self.at, y in other.at => self.simd.max_f64s(x, y));
        self
    }

    /// Least of the eight.
    #[inline(always)]
    pub fn least(self) -> f64 {
        let (at, _) = S::as_simd_f64s(&self.at);
        let mut least = at[0];
        for x in &at[1..] {
            least = self.simd.min_f64s(least, *x);
        }
        self.simd.reduce_min_f64s(least)
    }

    /// Greatest of the eight.
    #[inline(always)]
    pub fn greatest(self) -> f64 {
        -(self * -1.0).least()
    }

    /// x at all nodes.
    #[inline(always)]
    pub fn all(simd: S, x: f64) -> Self {
        Self { simd, at: [x; 8] }
    }

    /// x in all lanes, in the registers of `self`.
    #[inline(always)]
    pub fn with(self, x: f64) -> Self {
        Self { at: [x; 8], ..self }
    }

    /// The value at one node, in all lanes.
    #[inline(always)]
    fn spread(self, node: usize) -> Self {
        self.with(self.at[node])
    }

    /// self * factor + plus, rounded once where the processor does so at no cost.
    #[inline(always)]
    pub fn times_plus(mut self, factor: Self, plus: Self) -> Self {
        of_registers!(x in self.at, y in factor.at, z in plus.at => self.simd.mul_add_e_f64s(x, y, z));
        self
    }

    /// Sum of the eight.
    #[inline(always)]
    pub fn total(self) -> f64 {
        self.sum(self.with(1.0))
    }

    /// Weighted sum of the eight.
    #[inline(always)]
    fn sum(mut self, weights: Self) -> f64 {
        let mut sum = self.simd.splat_f64s(0.0);
        of_registers!(x in self.at, weight in weights.at => {
            sum = self.simd.mul_add_e_f64s(x, weight, sum);
            sum
        });
        self.simd.reduce_sum_f64s(sum)
    }
}

impl<S: Simd> Add for Eight<S> {
    type Output = Self;
    #[inline(always)]
    fn add(mut self, other: Self) -> Self {
        of_registers!(x in self.at, y in other.at => self.simd.add_f64s(x, y));
        self
    }
}

impl<S: Simd> Sub for Eight<S> {
    type Output = Self;
    #[inline(always)]
    fn sub(mut self, other: Self) -> Self {
        of_registers!(x in self.at, y in other.at => self.simd.sub_f64s(x, y));
        self
    }
}

impl<S: Simd> Mul for Eight<S> {
    type Output = Self;
    #[inline(always)]
    fn mul(mut self, other: Self) -> Self {
        of_registers!(x in self.at, y in other.at => self.simd.mul_f64s(x, y));
        self
    }
}

impl<S: Simd> Mul<f64> for Eight<S> {
    type Output = Self;
    #[inline(always)]
    fn mul(self, factor: f64) -> Self {
        self * self.with(factor)
    }
}

impl<S: Simd> Real for Eight<S> {
    #[inline(always)]
    fn all(self, x: f64) -> Self {
        self.with(x)
    }

    #[inline(always)]
    fn inverse(mut self) -> Self {
        let one = self.simd.splat_f64s(1.0);
        of_registers!(x in self.at => self.simd.div_f64s(one, x));
        self
    }

    #[inline(always)]
    fn sqrt(mut self) -> Self {
        of_registers!(x in self.at => self.simd.sqrt_f64s(x));
        self
    }

    #[inline(always)]
    fn nearest(self) -> Self {
        // Beyond 2^52 all doubles are integers.
        let big = self.with(6_755_399_441_055_744.0);
        (self + big) - big
    }

    #[inline(always)]
    fn times_plus(self, factor: Self, plus: Self) -> Self {
        Eight::times_plus(self, factor, plus)
    }

    #[inline(always)]
    fn power_of_two(mut self) -> Self {
        for k in &mut self.at {
            *k = f64::from_bits(k.to_bits() << 52);
        }
        self
    }
}

#[cfg(test)]
mod tests {
    use super::super::registers::wide;
    use super::*;
    use pulp::WithSimd;

    struct Extending([f64; 2]);

    impl WithSimd for Extending {
        type Output = f64;

        #[inline(always)]
        fn with_simd<S: Simd>(self, simd: S) -> f64 {
            let [from, ratio] = self.0;
            let seventh = |x: f64| (x - 0.3).powi(7) + x;
            let at = Eight::of(simd, NODES.map(seventh));
            let [there] = Extension::new(simd, from, ratio).of(&[at]);
            let mut off = 0.0_f64;
            for (x, value) in NODES.iter().zip(there.numbers()) {
                let x = 2.0 * (from + 0.5 * ratio * (x + 1.0)) - 1.0;
                off = off.max((value - seventh(x)).abs() / (1.0 + seventh(x).abs()));
            }
            off
        }
    }

    /// Catches guesses made for another step: polynomials of degree 7 must extend exactly.
    #[test]
    fn polynomials_extend_to_other_steps() {
        for (from, ratio) in [(0.0, 1.0), (0.0, 0.5), (1.0, 0.4), (1.0, 1.0), (1.0, 2.0)] {
            let off = wide(Extending([from, ratio]));
            assert!(off < 1e-11, "{from}, {ratio}: {off:e}");
        }
    }
}
