//! Elliptic integrals of eight arguments at once, by arithmetic-geometric means.
//!
//! Every lane takes the same path: one root and two divisions a mean, some five means for any modulus, and the
//! complete integrals at no cost. Carlson's ladder ([`super::carlson`]), which keeps every digit of every small
//! result, takes three roots a step and more steps.

use super::lanes8::Eight;
use super::real::Real;
use pulp::Simd;
use std::f64::consts::{FRAC_PI_4, PI};

/// Bound of the number of means, beyond the need of any modulus.
const MEANS: usize = 20;
/// Relative difference of two means below which the next pair is equal to rounding, as each step squares it.
const CLOSE: f64 = 1e-8;

/// Integrals `int_0^x dt/D` and `int_0^x sin^2 t/D dt`, each plus `turns` times its value from 0 to pi. Here
/// D^2 = kc^2 + (1 - kc^2) sin^2 t, |x| <= pi/2 by its sine and cosine, and `d` = D(x).
///
/// Method: Bulirsch's el2 (Numer. Math. 7 (1965) 78), with the modulus 1/kc and the coefficients 0 and 1. Accuracy:
/// rounding relative to 1 + the value; kc > 1e-150, sin x != 0.
#[inline(always)]
pub(crate) fn integrals<S: Simd>(
    kc: Eight<S>,
    sin: Eight<S>,
    cos: Eight<S>,
    d: Eight<S>,
    turns: Eight<S>,
) -> [Eight<S>; 2] {
    let (zero, one) = (kc.with(0.0), kc.with(1.0));
    let stretch = kc.inverse();
    let mut p = d * stretch;
    let mut y = (cos * sin.inverse()).abs();
    let mut hold = (sin * cos).abs();
    let mut c = hold * p.inverse() * 0.5;
    let (mut qc, mut m) = (stretch, one);
    // Bulirsch's a and b, and the previous a.
    let (mut a, mut b, mut last) = (one * 0.5, one, zero);
    let (mut f, mut l) = (zero, zero);
    // Each mean doubles the angle.
    let mut turns = turns;
    for _ in 0..MEANS {
        b = last.times_plus(qc, b);
        let e = m * qc;
        let over = (p * y).inverse();
        let g = e * y * over;
        hold = f.times_plus(g, hold);
        f = c;
        last = a;
        let y_less = e * p * over;
        p = p + g;
        let before = m;
        m = m + qc;
        let over = (p * m).inverse();
        c = (hold * m).times_plus(over, c) * 0.5;
        a = (b * p).times_plus(over, a) * 0.5;
        y = y - y_less;
        turns = turns * 2.0;
        if (before * CLOSE - (before - qc).abs()).least() >= 0.0 {
            break;
        }
        qc = e.sqrt() * 2.0;
        l = y.below(0.0, l * 2.0 + one, l * 2.0);
    }
    let angle = angle(m, y) + l * PI;
    let over = (kc * m).inverse();
    let all = sin.below(0.0, angle * -1.0, angle) + turns * PI;
    let c = sin.below(0.0, c, c * -1.0);
    let lam = all * over;
    [lam, (all * a).times_plus(over, c * stretch)]
}

/// Angle in (0, pi) of (y, m), m > 0.
#[inline(always)]
fn angle<S: Simd>(m: Eight<S>, y: Eight<S>) -> Eight<S> {
    let far = y.abs();
    let (low, high) = (m.smaller(far), m.greater(far));
    // The series serves tangents up to tan(pi/8).
    let steep = low - high * (std::f64::consts::SQRT_2 - 1.0);
    let above = steep.below(0.0, low, low - high);
    let below = steep.below(0.0, high, low + high);
    let z = above * below.inverse();
    let u = z * z;
    let part =
        (z * u).times_plus(u.series(&ATAN), z) + steep.below(0.0, m.with(0.0), m.with(FRAC_PI_4));
    // Angle from the first axis, not from the nearer one.
    let part = (far - m).below(0.0, part * -1.0 + m.with(0.5 * PI), part);
    y.below(0.0, part * -1.0 + m.with(PI), part)
}

/// (atan z - z)/z^3 by powers of z^2, |z| < tan(pi/8), to 3e-17: best approximation by mpmath's chebyfit.
const ATAN: [f64; 11] = [
    -0.333_333_333_333_333_3,
    0.199_999_999_999_955_17,
    -0.142_857_142_846_656_8,
    0.111_111_110_151_870_2,
    -0.090_909_045_753_065_49,
    0.076_921_831_253_768_92,
    -0.066_645_105_255_089_37,
    0.058_581_409_048_663_28,
    -0.050_854_078_345_894_84,
    0.039_230_447_784_793_1,
    -0.019_175_404_711_104_934,
];

#[cfg(test)]
mod tests {
    use super::super::registers::wide;
    use super::*;
    use pulp::WithSimd;

    struct ArgumentsAt {
        kc: [f64; 8],
        w: [f64; 8],
    }

    impl WithSimd for ArgumentsAt {
        type Output = [[f64; 8]; 2];

        #[inline(always)]
        fn with_simd<S: Simd>(self, simd: S) -> Self::Output {
            let kc = Eight::of(simd, self.kc);
            let turns = self.w.map(|w| (w / PI).round());
            let beyond: [f64; 8] = std::array::from_fn(|i| self.w[i] - turns[i] * PI);
            let [sin, cos] = [beyond.map(f64::sin), beyond.map(f64::cos)];
            let d = std::array::from_fn(|i| {
                let (kc, sin): (f64, f64) = (self.kc[i], sin[i]);
                (kc * kc + (1.0 - kc * kc) * sin * sin).sqrt()
            });
            let [sin, cos, d, turns] = [sin, cos, d, turns].map(|x| Eight::of(simd, x));
            let [lam, b] = integrals(kc, sin, cos, d, turns);
            [lam.numbers(), b.numbers()]
        }
    }

    /// Catches a wrong coefficient. Reference: quadrature in 30 digits (mpmath).
    #[test]
    fn means_are_the_integrals() {
        let kc = [0.5, 0.5, 0.01, 0.9, 1e-6, 0.5, 1.0, 0.3];
        let w = [2.5, 1.2, 3.0, 0.3, 2.9, 0.1, 1.0, 7.0];
        let [lam, b] = wide(ArgumentsAt { kc, w });
        let want = [
            (3.198_180_919_256_025_5, 1.664_538_317_276_712_6),
            (1.779_225_237_415_718, 0.535_665_033_909_675_5),
            (8.636_690_435_125_373, 1.989_685_165_344_613_7),
            (0.332_191_970_501_906_9, 0.009_761_518_929_874_8),
            (17.310_573_774_195_177, 1.970_958_165_142_170_6),
            (0.199_015_199_520_481_7, 0.000_659_456_972_925_3),
            (1.0, 0.272_675_643_293_579_5),
            (12.173_317_953_844_976, 3.981_072_209_348_430_9),
        ];
        for i in 0..8 {
            for (got, want) in [(lam[i], want[i].0), (b[i], want[i].1)] {
                assert!(
                    (got - want).abs() < 4e-16 * (1.0 + want),
                    "{i}: {got} {want}"
                );
            }
        }
    }
}
