//! Integrals lam and B carried from eight places to others nearby.
//!
//! The update follows their differentials (theory 2.7),
//! ```text
//! dlam = lam_p dp + dw/D,        lam_p = kap (B + c s/D)
//! dB   = B_p dp + s^2/D dw,      B_p = (kap'^2 (lam - 2B - c s/D))/kap
//! ```
//! by the trapezoidal rule between the two places. Its error in lam and kap B is of third order in the distance. B
//! itself is less accurate next to the straight rod, but enters every result times kap. For places farther away, like
//! those of the first sweeps of a step, the rule is corrected by the second derivatives at both ends. The error is
//! then of fifth order, and later places are carried from the new one.

use super::IntegralsAtEight;
use crate::math::Row;
use crate::math::lanes8::Eight;
use crate::math::real::Real;
use pulp::Simd;

/// Base of carried integrals: places, their integrals and derivatives.
#[derive(Clone, Copy)]
#[repr(align(64))]
pub(super) struct Base {
    pub p: Row,
    w: Row,
    kap: Row,
    kap_c: Row,
    s: Row,
    c: Row,
    d: Row,
    pub inv_d: Row,
    lam: Row,
    b: Row,
    lam_p: Row,
    b_p: Row,
}

impl Base {
    /// Base at the places `q` with their integrals.
    #[inline(always)]
    pub fn new<S: Simd>(q: &[Row; 2], at: &IntegralsAtEight<S>) -> Self {
        let [lam_p, b_p] = at.by_p();
        Self {
            p: q[0],
            w: q[1],
            kap: at.kap.numbers(),
            kap_c: at.kap_c.numbers(),
            s: at.s.numbers(),
            c: at.c.numbers(),
            d: at.d.numbers(),
            inv_d: at.inv_d.numbers(),
            lam: at.lam.numbers(),
            b: at.b.numbers(),
            lam_p: lam_p.numbers(),
            b_p: b_p.numbers(),
        }
    }

    /// Integrals of the base.
    #[inline(always)]
    fn at<S: Simd>(&self, simd: S) -> IntegralsAtEight<S> {
        IntegralsAtEight {
            kap: Eight::of(simd, self.kap),
            kap_c: Eight::of(simd, self.kap_c),
            s: Eight::of(simd, self.s),
            c: Eight::of(simd, self.c),
            d: Eight::of(simd, self.d),
            inv_d: Eight::of(simd, self.inv_d),
            lam: Eight::of(simd, self.lam),
            b: Eight::of(simd, self.b),
        }
    }
}

/// Integrals at `q` from those at `base`, and whether `q` should become the new base; `None` if `q` is too far for an
/// error of about `error`.
#[inline(always)]
pub(super) fn update_integrals<S: Simd>(
    simd: S,
    base: &Base,
    error: f64,
    q: [Eight<S>; 2],
) -> Option<(IntegralsAtEight<S>, bool)> {
    let [p, w] = q;
    let before = base.at(simd);
    let (dp, dw) = (p - Eight::of(simd, base.p), w - Eight::of(simd, base.w));
    // The integrals vary with w on the scale D.
    let turned = dw * before.inv_d;
    let square = turned.times_plus(turned, dp * dp).greatest();
    let near = square * square * square <= error * error;
    if !near {
        // Next to the straight rod B_p is a small difference over kap.
        let steep = dp * before.kap.inverse();
        let square = turned.times_plus(turned, steep * steep).greatest();
        let fourth = square * square;
        if !(fourth * fourth * square <= error * error && square <= FAR * FAR) {
            return None;
        }
    }
    let one = p.all(1.0);
    let (p2, w2) = (dp * dp, dw * dw);
    let (cosh, sinh) = (
        p2.series(&COSH) * p2 + one,
        dp * (p2.series(&SINH) * p2 + one),
    );
    let (cos, sin) = (
        w2.series(&COS) * w2 + one,
        dw * (w2.series(&SIN) * w2 + one),
    );
    let IntegralsAtEight {
        kap, kap_c, s, c, ..
    } = before;
    let over = kap.times_plus(sinh, cosh).inverse();
    let kap_c = kap_c * over;
    let kap = kap.times_plus(cosh, sinh) * over;
    let (s, c) = (s.times_plus(cos, c * sin), c * cos - s * sin);
    let across = kap * s;
    let d2 = across.times_plus(across, kap_c * kap_c);
    // Root and inverse are independent operations, which overlap in the processor.
    let d = d2.sqrt();
    let inv_d = d2.inverse() * d;
    let (lam, b) = (before.lam, before.b);
    let mut here = IntegralsAtEight {
        kap,
        kap_c,
        s,
        c,
        d,
        inv_d,
        lam,
        b,
    };
    if near {
        let [lam_p, b_p] = [Eight::of(simd, base.lam_p), Eight::of(simd, base.b_p)];
        let s2 = before.s * before.s;
        here.lam = lam + lam_p.times_plus(dp, turned);
        here.b = b + b_p.times_plus(dp, s2 * turned);
        let [lam_p1, b_p1] = here.by_p();
        let (dp, dw) = (dp * 0.5, dw * 0.5);
        let turned = [dw * before.inv_d, dw * here.inv_d];
        here.lam = lam + (lam_p + lam_p1).times_plus(dp, turned[0] + turned[1]);
        here.b = b + (b_p + b_p1).times_plus(dp, s2 * turned[0] + s * s * turned[1]);
        return Some((here, false));
    }
    let (half, twelfth) = (one * 0.5, one * (1.0 / 12.0));
    let [first, second] = before.derivatives_along(&before.way(dp, dw));
    here.lam = lam + second[0].times_plus(half, first[0]);
    here.b = b + second[1].times_plus(half, first[1]);
    let lam = lam + second[0].times_plus(twelfth, first[0] * 0.5);
    let b = b + second[1].times_plus(twelfth, first[1] * 0.5);
    let way = here.way(dp, dw);
    // The derivatives at the end depend on the integrals there, predicted by the derivatives at the start; each
    // correction gains an order.
    for _ in 0..2 {
        let [first, second] = here.derivatives_along(&way);
        here.lam = lam + (first[0] * 0.5 - second[0] * twelfth);
        here.b = b + (first[1] * 0.5 - second[1] * twelfth);
    }
    Some((here, true))
}

/// Longest way over which integrals are carried.
const FAR: f64 = 0.03;
/// Taylor coefficients of (cosh x - 1)/x^2 and so on, |x| < [`FAR`], in powers of x^2.
const COSH: [f64; 3] = [1.0 / 2.0, 1.0 / 24.0, 1.0 / 720.0];
const SINH: [f64; 3] = [1.0 / 6.0, 1.0 / 120.0, 1.0 / 5040.0];
const COS: [f64; 3] = [-1.0 / 2.0, 1.0 / 24.0, -1.0 / 720.0];
const SIN: [f64; 3] = [-1.0 / 6.0, 1.0 / 120.0, -1.0 / 5040.0];

/// Straight way in the chart, at one of its ends: terms of the derivatives along it, besides kap and the integrals.
/// Derivatives are by the fraction of the way, from 0 at its start to 1 at its end.
struct ChartWay<S: Simd> {
    dp: Eight<S>,
    /// c s/D and its derivative.
    held: [Eight<S>; 2],
    /// dw/D and its derivative.
    turned: [Eight<S>; 2],
    /// s^2 dw/D and its derivative.
    slid: [Eight<S>; 2],
    /// kap'^2 dp/kap, the factor in the change of B with p, and its derivative.
    steep: [Eight<S>; 2],
}

impl<S: Simd> IntegralsAtEight<S> {
    /// Terms of the way (dp, dw) at these places.
    #[inline(always)]
    fn way(&self, dp: Eight<S>, dw: Eight<S>) -> ChartWay<S> {
        let Self {
            kap,
            kap_c,
            s,
            c,
            inv_d,
            ..
        } = *self;
        let (kap_c2, s2) = (kap_c * kap_c, s * s);
        let inv = kap.inverse();
        let turned = dw * inv_d;
        let held = c * s * inv_d;
        // Ratio D'/D, from D^2 = 1 - kap^2 c^2.
        let grows = kap * c * (kap * s * dw - kap_c2 * c * dp) * inv_d * inv_d;
        let slower = turned * grows * -1.0;
        let steep = dp * kap_c2 * inv;
        ChartWay {
            dp,
            held: [held, (c * c - s2) * turned - held * grows],
            turned: [turned, slower],
            slid: [
                s2 * turned,
                s2.times_plus(slower, s * c * dw * turned * 2.0),
            ],
            steep: [steep, steep * dp * (inv + kap) * -1.0],
        }
    }

    /// First and second derivatives of lam and B along a way, at these places.
    #[inline(always)]
    fn derivatives_along(&self, way: &ChartWay<S>) -> [[Eight<S>; 2]; 2] {
        let Self {
            kap, kap_c, lam, b, ..
        } = *self;
        let ChartWay {
            dp,
            held,
            turned,
            slid,
            steep,
        } = *way;
        let on = b + held[0];
        let rest = lam - b * 2.0 - held[0];
        let lam1 = (kap * on).times_plus(dp, turned[0]);
        let b1 = steep[0].times_plus(rest, slid[0]);
        let lam2 = (kap_c * kap_c * dp * on + kap * (b1 + held[1])).times_plus(dp, turned[1]);
        let rest1 = lam1 - b1 * 2.0 - held[1];
        let b2 = steep[1].times_plus(rest, steep[0].times_plus(rest1, slid[1]));
        [[lam1, b1], [lam2, b2]]
    }
}

#[cfg(test)]
mod tests {
    use super::super::evaluate_integrals;
    use super::super::tests::worse;
    use super::*;
    use pulp::WithSimd;

    /// Carries the integrals at `q` along ways of the length `reach`, if the error allows.
    struct Carrying {
        q: [Row; 2],
        way: [Row; 2],
        reach: f64,
        error: f64,
        /// Measure of ways and errors: dp/kap and B if true, dp and kap B if false.
        steep: bool,
    }

    impl WithSimd for Carrying {
        type Output = Option<(f64, bool)>;

        /// Largest error of lam and B, relative to 1 + their size, and whether the base should move.
        #[inline(always)]
        fn with_simd<S: Simd>(self, simd: S) -> Self::Output {
            let [p, w] = self.q.map(|x| Eight::of(simd, x));
            let at = evaluate_integrals(simd, p, w, p.abs());
            let [dp, dw] = self.way.map(|x| Eight::of(simd, x) * self.reach);
            let by_p = if self.steep { dp * at.kap.abs() } else { dp };
            let there = [p + by_p, w + dw * at.d];
            let base = Base::new(&self.q, &at);
            let (got, goes_on) = update_integrals(simd, &base, self.error, there)?;
            let want = evaluate_integrals(simd, there[0], there[1], there[0].abs());
            let weight = if self.steep {
                p.with(1.0)
            } else {
                want.kap.abs()
            };
            let mut off = 0.0_f64;
            for (got, want, weight) in [(got.lam, want.lam, p.with(1.0)), (got.b, want.b, weight)] {
                let (got, want, weight) = (got.numbers(), want.numbers(), weight.numbers());
                for i in 0..8 {
                    let e = weight[i] * (got[i] - want[i]).abs() / (1.0 + want[i].abs());
                    off = worse(off, e);
                }
            }
            Some((off, goes_on))
        }
    }

    /// Catches a wrong derivative: errors are of third order along short ways, of fifth along longer ones, and no
    /// greater than the quantity that decides between them. Next to the straight rod the error on short ways is that of
    /// kap B, as B enters every result times kap.
    #[test]
    fn integrals_are_carried_to_their_orders() {
        for (order, decided_by, steep) in [(3, 2, true), (5, 4, true), (3, 2, false)] {
            let (mut sum, mut count) = (0.0, 0);
            for k in 0..1000 {
                let wave = |i: usize, a: f64| ((k * 8 + i) as f64 * a).sin();
                let size = [0.1, 1.0, 3.0, 20.0][k % 4];
                let angle = |i: usize| std::f64::consts::PI * wave(i, 2.3);
                let off = [0.028, 0.014].map(|reach: f64| {
                    let carrying = Carrying {
                        q: [
                            std::array::from_fn(|i| size * (1.2 + wave(i, 1.1))),
                            std::array::from_fn(|i| 4.0 + 3.5 * wave(i, 0.7)),
                        ],
                        way: [
                            std::array::from_fn(|i| 0.999 * angle(i).cos()),
                            std::array::from_fn(|i| 0.999 * angle(i).sin()),
                        ],
                        reach,
                        error: reach.powi(decided_by),
                        steep,
                    };
                    let (off, goes_on) = crate::math::registers::wide(carrying).unwrap();
                    assert_eq!(goes_on, order == 5);
                    assert!(
                        off <= reach.powi(order),
                        "{k}: {off:e} after {reach}, {steep}"
                    );
                    off
                });
                if off[1] > 1e-13 {
                    sum += (off[0] / off[1]).log2();
                    count += 1;
                }
            }
            let seen = sum / f64::from(count);
            assert!(
                (seen - f64::from(order)).abs() < 0.2 && count > 500,
                "{order}: {seen}, {count}"
            );
        }
    }
}
