//! Bounds of the map from (p, lam) to the tip over a box, for the search for all equilibria.
//!
//! In a box with centre c and Jacobian J the tip is r_c + J dq + remainder. Second derivatives are exact at the centre.
//! The third are bounded over the box by constants that are proven in interval arithmetic
//! (core/tests/box_bounds/proof.rs).

use super::chart::{ChartPoint, Modulus};
use super::curvature::{TipDerivatives, cross, dot};
use super::equilibrium::{closed_tip, tip};
use super::shape_by_theta::RodTheta;
use super::small_load::SLIGHT;
use crate::error::Result;
use std::f64::consts::LN_2;

/// Half width of a box up to which the tip is needed to a few ulp.
const SMALL: f64 = 1e-4;

/// First coordinate of a box.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) enum BoxCoordinate {
    /// ln p.
    Log,
    /// p.
    Linear,
}

/// Curvature of the map over a box, in the box's own coordinates: second derivatives at the centre, bounds of the
/// third over the box.
#[derive(Debug, Clone, Copy)]
pub(super) struct Bending {
    /// pp, pl, ll at the centre, each as (1 - x, y).
    second: [[f64; 2]; 3],
    /// Bounds of ppp, ppl, pll, lll, each as (x, y).
    third: [[f64; 2]; 4],
}

/// Bounds of the third derivatives along ln p, of 1 - x in units of p^2 and of y in units of p, as [`bound_terms`] in
/// p lam.
const LOG_X: [[f64; 2]; 4] = [[31.0, 0.132], [11.0, 0.34], [9.6, 1.0], [10.0, 0.0]];
const LOG_Y: [[f64; 2]; 4] = [[9.0, 0.155], [3.0, 0.335], [2.6, 0.88], [4.0, 0.0]];
/// Bounds of the third derivatives along p, p > 0.85, of 1 - x and y, as [`bound_terms`] in lam.
const LINEAR: [[f64; 2]; 4] = [[8.0, 0.12], [4.0, 0.4], [6.0, 1.4], [11.7, 0.0]];
/// Coefficient of a second bound, for p > 0.85: that of the rod's turn as a bend passes the clamp.
const PASSING: f64 = 16.4;
/// Bound of the speed of |r| along p, in units of (lam/K + 1)/lam.
const MOVED: f64 = 3.0;

/// Bounds of ppp, ppl, pll, lll: a constant each, and one times r^3, r^2, r, 1.
fn bound_terms(r: f64, terms: [[f64; 2]; 4]) -> [f64; 4] {
    let power = [r * r * r, r * r, r, 1.0];
    std::array::from_fn(|k| terms[k][0] + terms[k][1] * power[k])
}

impl Bending {
    /// Bounds of the third derivatives over a box whose centre has its end at the distance `radius` from the clamp.
    /// They are proven for 1.25 < lam < 60.25 and p < lam + 3.35 (theory 2.4).
    ///
    /// The bounds grow like powers of lam and scale with p^2 and p near the straight rod. Farther from it the map is
    /// curved by the turn of the rod as a bend passes the clamp, at lam = K, 3K, 5K, .. with K(p) the quarter period.
    /// The n-th bend moves 2n + 1 times as fast with p as K does, and the end goes round the clamp with it. The
    /// straight part between two bends contributes only terms that decay exponentially with its length.
    pub(super) fn third(
        kind: BoxCoordinate,
        p: f64,
        a: f64,
        lam: f64,
        b: f64,
        radius: f64,
    ) -> [[f64; 2]; 4] {
        let high = lam + b;
        match kind {
            BoxCoordinate::Log => {
                let p = p * (1.0 + a + a * a);
                let [x, y] = [LOG_X, LOG_Y].map(|terms| bound_terms(p * high, terms));
                std::array::from_fn(|k| [x[k] * p * p, y[k] * p])
            }
            BoxCoordinate::Linear => {
                let quarter = [p - a + LN_2, p + a + QUARTER];
                let turns = (high / quarter[0]).max(1.0);
                // |r| changes along lam at most at the rate 2/lam.
                let low = lam - b;
                let moved = (2.0 * b + MOVED * a * (turns + 1.0)) / low;
                let size = PASSING
                    * (radius + moved + 4.0 / low)
                    * (-from_bends([lam - b, high], quarter)).exp();
                let passing = bound_terms(turns, [[0.0, size]; 4]);
                let any = bound_terms(high, LINEAR);
                std::array::from_fn(|k| [any[k].min(passing[k]); 2])
            }
        }
    }

    /// Bounds of the change of the Jacobian's two columns over half widths (a, b), as (x, y).
    fn column_change(&self, a: f64, b: f64) -> [[f64; 2]; 2] {
        let half = [0.5 * a * a, a * b, 0.5 * b * b];
        std::array::from_fn(|column| {
            std::array::from_fn(|i| {
                self.second[column][i].abs() * a
                    + self.second[column + 1][i].abs() * b
                    + (0..3)
                        .map(|k| self.third[column + k][i] * half[k])
                        .sum::<f64>()
            })
        })
    }

    /// Contribution of each coordinate alone to the remainder.
    pub(super) fn shares(&self, a: f64, b: f64) -> (f64, f64) {
        let size = |v: [f64; 2]| v[0].abs() + v[1].abs();
        (
            (3.0 * size(self.second[0]) + size(self.third[0]) * a) * a * a,
            (3.0 * size(self.second[2]) + size(self.third[3]) * b) * b * b,
        )
    }
}

/// K < p + QUARTER for p > 1; K exceeds p + log 2.
const QUARTER: f64 = LN_2 + 0.25;
/// Distance in lam from the clamp at which bends stop lowering the bound: farther terms decay more slowly.
const FAR: f64 = 11.0;

/// Least distance in lam between the interval `[low, high]` and odd multiples of K in `[least, most]`.
fn from_bends([low, high]: [f64; 2], [least, most]: [f64; 2]) -> f64 {
    // Number of bends that have surely passed the clamp.
    let passed = ((low / most + 1.0) * 0.5).floor();
    let behind = if passed < 1.0 {
        FAR
    } else {
        low - (2.0 * passed - 1.0) * most
    };
    let ahead = (2.0 * passed + 1.0) * least - high;
    behind.min(ahead).clamp(0.0, FAR)
}

/// Tip and its derivatives over the box's coordinates, as (1 - x, y).
pub(super) struct Local {
    pub(super) tip: [f64; 2],
    along_first: [f64; 2],
    along_lam: [f64; 2],
}

/// Chart coordinate p of a box coordinate.
fn place(kind: BoxCoordinate, first: f64) -> f64 {
    match kind {
        BoxCoordinate::Log => first.exp(),
        BoxCoordinate::Linear => first,
    }
}

/// Chart point of a box coordinate.
pub(super) fn chart_point(kind: BoxCoordinate, first: f64, lam: f64) -> Result<(f64, ChartPoint)> {
    let p = place(kind, first);
    Ok((p, ChartPoint::at_load(p, lam)?))
}

/// Tip and chart point at (p, lam) by theta functions. Faster than [`ChartPoint::at_load`], and right to 1e-14 of
/// kap^2 and kap, the scales on which weakly bent rods move.
fn quick_point(p: f64, lam: f64) -> ((f64, f64), ChartPoint) {
    let modulus = Modulus::new(p);
    let integrals = RodTheta::new(&modulus, lam).clamp(&modulus);
    let at = ChartPoint::from_integrals(p, integrals);
    (closed_tip(&at), at)
}

/// Tip (1 - x, y) at (p, lam), right to 1e-14 of kap^2 and kap.
pub(super) fn quick_tip(p: f64, lam: f64) -> [f64; 2] {
    quick_point(p, lam).0.into()
}

impl Local {
    pub(super) fn new(kind: BoxCoordinate, p: f64, at: &ChartPoint) -> Self {
        let (one_minus_x, y) = tip(p, at);
        Self::with_tip(kind, p, at, one_minus_x, y)
    }

    /// Expansion at the centre of a box of half width `width`; in large boxes an error of 1e-14 of the tip does not
    /// matter.
    pub(super) fn at_centre(
        kind: BoxCoordinate,
        first: f64,
        lam: f64,
        width: f64,
    ) -> Result<(f64, ChartPoint, Self)> {
        if width > SMALL && lam > SLIGHT {
            let p = place(kind, first);
            let ((one_minus_x, y), at) = quick_point(p, lam);
            let local = Self::with_tip(kind, p, &at, one_minus_x, y);
            return Ok((p, at, local));
        }
        let (p, at) = chart_point(kind, first, lam)?;
        let local = Self::new(kind, p, &at);
        Ok((p, at, local))
    }

    fn with_tip(kind: BoxCoordinate, p: f64, at: &ChartPoint, one_minus_x: f64, y: f64) -> Self {
        let stretch = if kind == BoxCoordinate::Log { p } else { 1.0 };
        let i = &at.integrals;
        let lam_p = i.lam_p();
        let mirror = |[x, y]: [f64; 2]| [-x, y];
        let along_lam = mirror(at.column_w.map(|v| v * i.d));
        let along_p = mirror(at.column_p);
        Self {
            tip: [one_minus_x, y],
            along_first: std::array::from_fn(|k| (along_p[k] - along_lam[k] * lam_p) * stretch),
            along_lam,
        }
    }

    pub(super) fn bending(
        kind: BoxCoordinate,
        p: f64,
        at: &ChartPoint,
        third: [[f64; 2]; 4],
    ) -> Bending {
        let t = TipDerivatives::new(at);
        let second = match kind {
            BoxCoordinate::Linear => [t.pp, t.pl, t.ll],
            // d/d(ln p) = p d/dp.
            BoxCoordinate::Log => [
                std::array::from_fn(|k| p * (p * t.pp[k] + t.p[k])),
                t.pl.map(|v| p * v),
                t.ll,
            ],
        };
        Bending {
            second: second.map(|v| mirror_derivative(at, v)),
            third,
        }
    }

    /// Newton step for the logarithms of y and of (1 - x)/y^2 at the target, and the larger of the two residuals.
    pub(super) fn by_shape(&self, target: [f64; 2]) -> ((f64, f64), f64) {
        let [x, y] = self.tip;
        let row = |v: [f64; 2]| [v[1] / y, v[0] / x - 2.0 * v[1] / y];
        let [first, lam] = [self.along_first, self.along_lam].map(row);
        let [by_x, by_y] = [target[0] / x, target[1] / y].map(f64::ln);
        let gap = [by_y, by_x - 2.0 * by_y];
        let det = cross(first, lam);
        let step = (cross(gap, lam) / det, cross(first, gap) / det);
        (step, gap[0].abs().max(gap[1].abs()))
    }

    /// Newton step to the target at distance `gap`.
    pub(super) fn step(&self, gap: [f64; 2]) -> (f64, f64) {
        let det = cross(self.along_first, self.along_lam);
        (
            cross(gap, self.along_lam) / det,
            cross(self.along_first, gap) / det,
        )
    }
}

/// Derivative of (1 - x, y) in the fixed axes, from one of the tip in the turned axes.
pub(super) fn mirror_derivative(at: &ChartPoint, v: [f64; 2]) -> [f64; 2] {
    let [x, y] = at.to_fixed(v);
    [-x, y]
}

/// Range of the tip over a box: expansion about the centre, with each coordinate in half widths of the box.
pub(super) struct TipRange {
    along_first: [f64; 2],
    along_lam: [f64; 2],
    /// Half the pure second derivatives, and the mixed one.
    bend_first: [f64; 2],
    bend_lam: [f64; 2],
    mixed: [f64; 2],
    /// Bounds of the remainder.
    rest: [f64; 2],
}

impl TipRange {
    pub(super) fn new(local: &Local, bending: &Bending, a: f64, b: f64) -> Self {
        let [pp, pl, ll] = bending.second;
        let cubic = [a * a * a, 3.0 * a * a * b, 3.0 * a * b * b, b * b * b].map(|v| v / 6.0);
        // The tip, like the target, is known to a few ulp: a target on a fold must not slip through.
        let rounding = 1e-15 * (local.tip[0].abs() + local.tip[1].abs());
        let rest = |i: usize| (0..4).fold(rounding, |sum, k| sum + bending.third[k][i] * cubic[k]);
        Self {
            along_first: local.along_first.map(|v| v * a),
            along_lam: local.along_lam.map(|v| v * b),
            bend_first: pp.map(|v| v * (0.5 * a * a)),
            bend_lam: ll.map(|v| v * (0.5 * b * b)),
            mixed: pl.map(|v| v * (a * b)),
            rest: [rest(0), rest(1)],
        }
    }

    /// True if no point of the box reaches a target at the distance `gap` from the centre, since in some direction
    /// the target is farther than the tip.
    pub(super) fn misses(&self, gap: [f64; 2]) -> bool {
        self.is_beyond(gap, gap)
            || self.is_beyond([-self.along_lam[1], self.along_lam[0]], gap)
            || self.is_beyond([-self.along_first[1], self.along_first[0]], gap)
            || self.is_beyond([1.0, 0.0], gap)
            || self.is_beyond([0.0, 1.0], gap)
    }

    /// True if the target is farther than the tip along the direction `e`. A quadratic part that bends the other way
    /// reduces the reach.
    fn is_beyond(&self, e: [f64; 2], gap: [f64; 2]) -> bool {
        let away = dot(e, gap);
        let side = 1f64.copysign(away);
        let reach = largest_value(dot(e, self.along_first), side * dot(e, self.bend_first))
            + largest_value(dot(e, self.along_lam), side * dot(e, self.bend_lam))
            + dot(e, self.mixed).abs()
            + dot(e.map(f64::abs), self.rest);
        away.abs() > reach
    }
}

/// The largest value of slope t + bend t^2 for |t| <= 1.
fn largest_value(slope: f64, bend: f64) -> f64 {
    let slope = slope.abs();
    if slope + 2.0 * bend >= 0.0 {
        slope + bend
    } else {
        -0.25 * slope * slope / bend
    }
}

/// True if the map is one-to-one on the box: |J^-1 (J(q) - J)| < 1 there, in the box's own norm.
pub(super) fn injective(local: &Local, bending: &Bending, a: f64, b: f64) -> bool {
    let det = cross(local.along_first, local.along_lam);
    let [change_first, change_lam] = bending.column_change(a, b);
    // Rows of |adj J|, scaled to the box.
    let row_first = [local.along_lam[1].abs() / a, local.along_lam[0].abs() / a];
    let row_lam = [
        local.along_first[1].abs() / b,
        local.along_first[0].abs() / b,
    ];
    let size = |row: [f64; 2]| dot(row, change_first) * a + dot(row, change_lam) * b;
    size(row_first).max(size(row_lam)) < det.abs()
}

#[cfg(test)]
#[path = "../../tests/box_bounds/proof.rs"]
mod proof;

#[cfg(test)]
mod tests {
    use super::*;

    /// Catches a bound on third derivatives that fails. Third derivatives are sampled by central differences of the
    /// exact second ones, at pseudo-random places of boxes of all sizes, of both kinds, up to lam = 60.
    #[test]
    fn third_derivatives_stay_below_their_bounds() {
        let mut seed = 20_u64;
        let mut random = move || {
            seed = seed
                .wrapping_mul(6_364_136_223_846_793_005)
                .wrapping_add(1_442_695_040_888_963_407);
            (seed >> 11) as f64 / (1u64 << 53) as f64
        };
        let second = |kind, first: f64, lam: f64| {
            let (p, at) = chart_point(kind, first, lam).unwrap();
            Local::bending(kind, p, &at, [[0.0; 2]; 4]).second
        };
        let mut fullest = 0.0f64;
        for i in 0..40_000 {
            let lam = 1.3 + 58.7 * random().powi(2);
            let (kind, first) = if i % 2 == 0 {
                (BoxCoordinate::Log, -6.0 * random())
            } else {
                (BoxCoordinate::Linear, 1.0 + (lam + 3.0) * random().powi(2))
            };
            let half = [0.6, 0.6].map(|most| most * random().powi(4));
            let centre = [first, lam + half[1]];
            let (p, at) = chart_point(kind, centre[0], centre[1]).unwrap();
            let radius = at.turned[0].hypot(at.turned[1]);
            let bound = Bending::third(kind, p, half[0], centre[1], half[1], radius);
            let within = |k: usize, share: f64| centre[k] + half[k] * (2.0 * share - 1.0);
            let mut first = within(0, random());
            if kind == BoxCoordinate::Linear {
                first = first.max(0.85);
            }
            let lam = within(1, random());
            let h = 1e-4;
            let [ahead, behind] = [h, -h].map(|h| second(kind, first + h, lam));
            let [above, below] = [h, -h].map(|h| second(kind, first, lam + h));
            for k in 0..2 {
                let slope = |a: &[[f64; 2]; 3], b: &[[f64; 2]; 3], i: usize| {
                    (a[i][k] - b[i][k]) / (2.0 * h)
                };
                let third = [
                    slope(&ahead, &behind, 0),
                    slope(&ahead, &behind, 1),
                    slope(&above, &below, 1),
                    slope(&above, &below, 2),
                ];
                for (j, value) in third.into_iter().enumerate() {
                    // Differences of rounded values say nothing below 1e-8.
                    let share = value.abs() / (bound[j][k] + 1e-7);
                    assert!(
                        share <= 1.0,
                        "{kind:?} {first} lam {lam}: third {j} of {k}: {share} of its bound"
                    );
                    fullest = fullest.max(share);
                }
            }
        }
        // A bound never approached would only make the search slow.
        assert!(fullest > 0.3, "{fullest}");
    }
}
