//! Chart points at eight places at once, in wide registers.
//!
//! The integrals are the main cost of a point. Places that have moved little since the last evaluation, as from one
//! sweep over a step to the next, take integrals carried along from there ([`mod@integral_updates`]).

mod integral_updates;

use super::chart::{TAUT, taut_limit};
use super::model::Elastica;
use super::small_load::SLIGHT;
use crate::manifold::{EightPoints, Eightfold, EquilibriumManifold};
use crate::math::Row;
use crate::math::agm::integrals;
use crate::math::lanes8::Eight;
use crate::math::real::{Halves, Real};
use crate::math::registers::Registers;
use integral_updates::{Base, update_integrals};
use nalgebra::Vector2;
use pulp::{Simd, WithSimd};
use std::f64::consts::{FRAC_1_PI, LN_2};

/// Pi in two parts; the first has few enough bits for an exact product with the number of half turns.
const PI: [f64; 2] = [3.141_592_653_589_782_5, 1.078_060_571_631_623_8e-14];
/// Largest |p| and largest w of the wide evaluation.
const FARTHEST: f64 = 300.0;
const LARGEST: f64 = 100.0;
/// Smallest w: the error of B is absolute at rounding level, while B is of order w^3.
const SHORTEST: f64 = 0.05;
/// Smallest |p|: next to the straight rod B_p loses its digits.
const STRAIGHTEST: f64 = 1e-3;

/// Evaluator of chart points at eight places, with the integrals of its last full evaluation.
pub(super) struct Eightfolds {
    registers: Registers,
    /// Error allowed in integrals that are carried to other places.
    error: f64,
    base: Option<Base>,
}

impl Eightfolds {
    /// Evaluator with integrals as good as `error`. `None` on a processor without wide registers: eight places would
    /// cost eight times one, and sequential steps need fewer slopes.
    pub fn new(error: f64) -> Option<Self> {
        Some(Self {
            registers: Registers::in_use()?,
            error: error.max(f64::EPSILON),
            base: None,
        })
    }
}

impl Eightfold<2> for Eightfolds {
    fn begin(&mut self) {
        self.base = None;
    }

    /// Points in wide registers, or one by one outside their range.
    #[inline]
    fn points(&mut self, q: &[Row; 2], to: &mut EightPoints<2>) -> bool {
        let registers = self.registers;
        registers.work(Work { all: self, q, to }) || one_by_one(q, to)
    }
}

fn one_by_one(q: &[Row; 2], to: &mut EightPoints<2>) -> bool {
    for (i, (p, w)) in q[0].iter().zip(&q[1]).enumerate() {
        let Some(at) = Elastica.point(&Vector2::new(*p, *w)) else {
            return false;
        };
        for k in 0..2 {
            to.pose[k][i] = at.pose[k];
            to.force[k][i] = at.force[k];
            to.adjugate[k][k][i] = at.jacobian[(1 - k, 1 - k)];
            to.adjugate[k][1 - k][i] = -at.jacobian[(k, 1 - k)];
        }
        to.det[i] = at.jacobian.determinant();
        to.pace[i] = at.pace;
    }
    true
}

/// Integrals at eight places ([`super::chart::Integrals`]), and their derivatives.
#[derive(Clone, Copy)]
struct IntegralsAtEight<S: Simd> {
    kap: Eight<S>,
    kap_c: Eight<S>,
    s: Eight<S>,
    c: Eight<S>,
    d: Eight<S>,
    inv_d: Eight<S>,
    lam: Eight<S>,
    b: Eight<S>,
}

struct Work<'a> {
    all: &'a mut Eightfolds,
    q: &'a [Row; 2],
    to: &'a mut EightPoints<2>,
}

impl WithSimd for Work<'_> {
    type Output = bool;

    #[inline(always)]
    fn with_simd<S: Simd>(self, simd: S) -> bool {
        let [p, w] = [Eight::of(simd, self.q[0]), Eight::of(simd, self.q[1])];
        let size = p.abs();
        // A NaN fails these comparisons.
        if !(size.greatest() < FARTHEST
            && size.least() > STRAIGHTEST
            && w.greatest() < LARGEST
            && w.least() > SHORTEST)
        {
            return false;
        }
        let carried = match &self.all.base {
            Some(base) => update_integrals(simd, base, self.all.error, [p, w]),
            None => None,
        };
        let (at, goes_on) = match carried {
            Some(carried) => carried,
            None => (evaluate_integrals(simd, p, w, size), true),
        };
        if goes_on {
            if !(at.lam.least() > SLIGHT) {
                return false;
            }
            self.all.base = Some(Base::new(self.q, &at));
        }
        at.point(self.to);
        true
    }
}

/// Integrals at (p, w), |p| = `size`, as [`super::chart::Integrals::new`].
#[inline(always)]
fn evaluate_integrals<S: Simd>(
    simd: S,
    p: Eight<S>,
    w: Eight<S>,
    size: Eight<S>,
) -> IntegralsAtEight<S> {
    let one = p.all(1.0);
    let Halves {
        up,
        down,
        twos,
        odd,
    } = p.half_exp();
    let (sinh, cosh) = (up - down, up + down);
    // For e^p near 1 the difference comes from the series.
    let sinh = twos.abs().below(0.5, odd, sinh);
    let kap_c = cosh.inverse();
    let kap = sinh * kap_c;
    let turns = (w * FRAC_1_PI).nearest();
    let beyond = turns.times_plus(w.all(-PI[1]), turns.times_plus(w.all(-PI[0]), w));
    let (sin, cos) = beyond.sin_cos();
    let odd = turns - (turns * 0.5).nearest() * 2.0;
    let sign = one - odd.abs() * 2.0;
    let across = kap * sin;
    let d = across.times_plus(across, kap_c * kap_c).sqrt();
    let inv_d = d.inverse();
    let [mut lam, mut b] = integrals(kap_c, sin, cos, d, turns);
    // From TAUT on the integrals are elementary, and the first means are too far apart.
    let far = sin.abs() * cosh;
    if far.greatest() >= TAUT {
        let [mut lams, mut bs] = [lam.numbers(), b.numbers()];
        let [far, sin] = [far.numbers(), sin.numbers()];
        let [cos, size] = [cos.numbers(), size.numbers()];
        let turns = turns.numbers();
        for i in 0..8 {
            if far[i] >= TAUT {
                let (lam, b) = taut_limit(size[i], sin[i].abs(), cos[i]);
                let (k, whole) = (size[i] + LN_2, 1.0);
                lams[i] = 2.0 * turns[i] * k + lam.copysign(sin[i]);
                bs[i] = 2.0 * turns[i] * whole + b.copysign(sin[i]);
            }
        }
        [lam, b] = [Eight::of(simd, lams), Eight::of(simd, bs)];
    }
    IntegralsAtEight {
        kap,
        kap_c,
        s: sin * sign,
        c: cos * sign,
        d,
        inv_d,
        lam,
        b,
    }
}

impl<S: Simd> IntegralsAtEight<S> {
    /// Derivatives lam_p and B_p.
    #[inline(always)]
    fn by_p(&self) -> [Eight<S>; 2] {
        let held = self.c * self.s * self.inv_d;
        let rest = self.lam - self.b * 2.0 - held;
        [
            self.kap * (self.b + held),
            self.kap_c * self.kap_c * rest * self.kap.inverse(),
        ]
    }

    /// Chart points from the integrals, as [`super::chart::ChartPoint`].
    #[inline(always)]
    fn point(&self, to: &mut EightPoints<2>) {
        let Self {
            kap,
            kap_c,
            s,
            c,
            d,
            inv_d,
            lam,
            b,
        } = *self;
        let one = lam.all(1.0);
        let kap_c2 = kap_c * kap_c;
        let inv = lam.inverse();
        let lam_p = kap * (b + c * s * inv_d);
        let de = kap_c2.times_plus(lam, kap * kap * b);
        let twice = inv * 2.0;
        let x = de.times_plus(twice, one * -1.0);
        let y = kap * s * twice;
        let x_p = twice * (kap_c2 * kap * (b - lam) - de * inv * lam_p);
        let x_w = kap * kap * (s * s - b * inv) * twice * inv_d;
        let y_p = (kap_c2 * s * 2.0 - y * lam_p) * inv;
        let y_w = kap * (c - s * inv * inv_d) * twice;
        let alpha_p = kap_c2 * c * inv_d * -2.0;
        let alpha_w = kap * s * inv_d * 2.0;
        let cos = (d - kap * c) * (d + kap * c);
        let sin = kap * c * d * -2.0;
        let pull = lam * lam;
        let [xp, yp] = rotate_to_fixed([cos, sin], [x_p - y * alpha_p, y_p + x * alpha_p]);
        let [xw, yw] = rotate_to_fixed([cos, sin], [x_w - y * alpha_w, y_w + x * alpha_w]);
        let minus = one * -1.0;
        let [x, y] = rotate_to_fixed([cos, sin], [x, y]);
        to.pose = [x.numbers(), y.numbers()];
        to.force = [(pull * cos).numbers(), (pull * sin).numbers()];
        to.adjugate = [
            [yw.numbers(), (xw * minus).numbers()],
            [(yp * minus).numbers(), xp.numbers()],
        ];
        to.det = (xp * yw - xw * yp).numbers();
        to.pace = (one + lam).inverse().numbers();
    }
}

/// Rotates a vector from the turned axes to the fixed ones.
#[inline(always)]
fn rotate_to_fixed<S: Simd>([cos, sin]: [Eight<S>; 2], v: [Eight<S>; 2]) -> [Eight<S>; 2] {
    [cos * v[0] - sin * v[1], sin * v[0] + cos * v[1]]
}

#[cfg(test)]
mod tests {
    use super::*;

    /// The larger of two errors; a NaN stays one.
    pub(super) fn worse(a: f64, b: f64) -> f64 {
        if a.is_nan() || b <= a { a } else { b }
    }

    /// Largest difference from points evaluated one by one, relative to the sizes of force, Jacobian and so on.
    fn off(q: &[Row; 2], to: &EightPoints<2>) -> f64 {
        let mut worst = 0.0_f64;
        for (i, (p, w)) in q[0].iter().zip(&q[1]).enumerate() {
            let at = Elastica.point(&Vector2::new(*p, *w)).unwrap();
            let (j, size) = (at.jacobian, at.jacobian.norm());
            let mut compare = |a: f64, b: f64, size: f64| {
                worst = worse(worst, (a - b).abs() / size);
            };
            for k in 0..2 {
                compare(to.pose[k][i], at.pose[k], 1.0);
                compare(to.force[k][i], at.force[k], at.force.norm());
                compare(to.adjugate[k][k][i], j[(1 - k, 1 - k)], size);
                compare(to.adjugate[k][1 - k][i], -j[(k, 1 - k)], size);
            }
            compare(to.det[i], j.determinant(), size * size);
            compare(to.pace[i], at.pace, at.pace);
        }
        worst
    }

    /// Catches formulas in wide registers that deviate from the chart: slack rods, taut ones, loops, some half turns,
    /// and mixed lanes. Carried integrals must be as good as asked for, and be evaluated anew where the places are
    /// too far.
    #[test]
    fn eight_points_are_those_of_one() {
        let mut to = EightPoints::default();
        let (mut near, mut far) = (0, 0);
        for k in 0..4000 {
            let wave = |i: usize, a: f64| ((k * 8 + i) as f64 * a).sin();
            let size = [3.0, 10.0, 40.0, 250.0][k % 4];
            let q: [Row; 2] = [
                std::array::from_fn(|i| size * wave(i, 1.1)),
                std::array::from_fn(|i| 4.0 + 3.99 * wave(i, 0.7)),
            ];
            // Without wide registers the test is void.
            let Some(mut served) = Eightfolds::new(1e-12) else {
                return;
            };
            assert!(served.points(&q, &mut to), "{q:?}");
            let e = off(&q, &to);
            assert!(e < 1e-13, "{e:e} at {q:?}");
            let Some(base) = served.base else {
                far += 1;
                continue;
            };
            let reach = served.error.cbrt();
            for part in [0.1, 0.9, 2.0, 20.0, 100.0] {
                let way = |i: usize| {
                    let (p, w) = (wave(i, 2.3), wave(i, 3.7));
                    let reach = part * reach / p.hypot(w);
                    [reach * p, reach * w / base.inv_d[i]]
                };
                let there: [Row; 2] = [0, 1].map(|k| std::array::from_fn(|i| q[k][i] + way(i)[k]));
                let [p, w] = &there;
                if w.iter().any(|w| *w <= 0.0) {
                    continue;
                }
                // Points evaluated one by one leave the base of the carried ones unchanged.
                let in_lanes =
                    w.iter().all(|w| *w > SLIGHT) && p.iter().all(|p| p.abs() > STRAIGHTEST);
                assert!(served.points(&there, &mut to));
                let stays = served.base.is_some_and(|now| now.p == base.p);
                assert!(stays == (part < 1.0) || !in_lanes, "{part}: {there:?}");
                let e = off(&there, &to);
                assert!(e < 1e-11, "{part}: {e:e} at {there:?}");
                near += usize::from(stays && part < 1.0);
                served.base = Some(base);
            }
        }
        assert!(near > 3000 && far < 2500, "{near} {far}");
        for q in [[[1.0; 8], [-0.1; 8]], [[f64::NAN; 8], [1.0; 8]]] {
            let served = Eightfolds::new(1e-12);
            assert!(served.is_some_and(|mut served| !served.points(&q, &mut to)));
        }
    }
}
