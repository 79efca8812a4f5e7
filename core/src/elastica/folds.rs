//! Fold curves, cusps and Morse index of the elastica.
//!
//! Cut the rod at a distance s from its tip: the remaining part is the equilibrium (p, w') of the same chart line,
//! w' < w. A variation of the shorter rod, continued by zero to the clamp, is one of the longer rod with the same
//! fixed end. So the index can only grow along w at fixed p, by one at each zero of det d(x, y)/d(p, .). Hence:
//!
//! * index(p, w) = the number of zeros of det(p, .) below w;
//! * the n-th fold curve is a graph w = w_n(p), even in p; all equilibria below the first are stable.

use super::chart::ChartPoint;
use super::curvature::{TipDerivatives, dot};
use super::equilibrium::Equilibrium;
use crate::error::{Error, Result};
use crate::math::carlson::complete_kb;
use crate::solve::roots::chandrupatla;
use std::f64::consts::LN_2;

/// Lower bound of lambda at a fold, and of lambda in quarter periods K. The least lambda of the first fold curve is
/// 5.7658925 (at kap = 0.9428598, by golden sections over tools/ref_folds.py). Both bounds are proven for |p| < 30
/// (core/tests/box_bounds/proof.rs; beyond see theory 2.4).
pub(super) const MIN_FOLD_LAM: f64 = 5.6;
pub(super) const QUARTERS: f64 = 1.85;
/// Step in lambda of the scan for folds. Neighbouring folds of a line p = const lie more than 3 apart.
const SCAN: f64 = 0.9;
/// Largest number of a fold curve.
const MAX_CURVE_NUMBER: usize = 4096;
/// Largest Morse index counted, which takes a second.
const COUNTED: usize = 1 << 20;

/// det d(x, y)/d(p, lam) / kap^2 at the load `lam` on the line `p`.
fn fold_function(p: f64, lam: f64) -> Result<f64> {
    let f = ChartPoint::at_load(p, lam)?.fold_function();
    if f.is_finite() {
        Ok(f)
    } else {
        Err(Error::domain(format!(
            "(p, lambda) = ({p}, {lam}) is out of the range of double precision"
        )))
    }
}

/// Start in lambda of a scan for folds on the line `p`.
fn scan_start(p: f64) -> f64 {
    let kap_c = 1.0 / p.cosh();
    let quarter = if p.abs() > 22.0 {
        p.abs() + LN_2
    } else {
        complete_kb(kap_c).0
    };
    MIN_FOLD_LAM.max(QUARTERS * quarter)
}

/// Nearest p off the axis: kap = 0 holds only the straight rod, and its neighbours stand in for it.
fn off_axis(p: f64) -> f64 {
    if p.abs() < 1e-8 { 1e-8 } else { p }
}

/// Brackets in lambda of the folds on the line `p` below `lam_max`, in order, at most `most`.
fn brackets(p: f64, lam_max: f64, most: usize) -> Result<Vec<[(f64, f64); 2]>> {
    let p = off_axis(p);
    let mut found = Vec::new();
    let mut low = scan_start(p);
    if !(low < lam_max) {
        return Ok(found);
    }
    let mut f_low = fold_function(p, low)?;
    while low < lam_max && found.len() < most {
        let high = (low + SCAN).min(lam_max);
        let f_high = fold_function(p, high)?;
        if (f_low < 0.0) != (f_high < 0.0) {
            found.push([(low, f_low), (high, f_high)]);
        }
        (low, f_low) = (high, f_high);
    }
    Ok(found)
}

/// Morse index of the equilibrium (p, w): the number of fold curves below it. On a fold, to rounding, it is the index
/// of either side.
///
/// # Errors
/// A point outside the range of double precision, or beyond a million folds.
pub fn index(p: f64, w: f64) -> Result<usize> {
    // Every fold lies beyond w = 2.5 (measured: the least is 2.98, for p -> infinity).
    if w < 2.5 {
        return Ok(0);
    }
    let p = off_axis(p);
    let at = ChartPoint::new(p, w);
    let lam = at.integrals.lam;
    let start = scan_start(p);
    if lam <= start {
        return Ok(0);
    }
    let below = brackets(p, lam, COUNTED)?;
    let mut count = below.len();
    if count == COUNTED {
        return Err(Error::domain(format!(
            "(p, lambda) = ({p}, {lam}) lies beyond {COUNTED} folds, up to which the Morse index is counted; lower lambda"
        )));
    }
    // The scan ends at w as recovered from lambda; the sign of the fold function at the point itself decides the
    // side.
    let even = fold_function(p, start)? < 0.0;
    if (at.fold_function() < 0.0) != (even == count.is_multiple_of(2)) {
        let near = |b: &[(f64, f64); 2]| b[1].0 == lam;
        count = if below.last().is_some_and(near) {
            count - 1
        } else {
            count + 1
        };
    }
    Ok(count)
}

/// Point of a fold curve.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct FoldPoint {
    /// Number of the curve, 1, 2, 3, ...
    pub number: usize,
    /// The degenerate equilibrium.
    pub equilibrium: Equilibrium,
    /// True at a cusp, where the image of the fold curve turns back.
    pub cusp: bool,
}

/// Point of fold curve `number` (1, 2, ...) on the line `p`.
///
/// # Errors
/// A `number` outside 1 to 4096, or a p too large for double precision.
pub fn fold_at(number: usize, p: f64) -> Result<FoldPoint> {
    if number == 0 || number > MAX_CURVE_NUMBER {
        return Err(Error::domain(format!(
            "fold curves are numbered 1 to {MAX_CURVE_NUMBER}; there is no number {number}"
        )));
    }
    let q = off_axis(p);
    let quarter = scan_start(q).max(QUARTERS * MIN_FOLD_LAM);
    // Fold n lies below 2 (n + 1) quarter periods.
    let lam_max = (number as f64 + 1.5) * 2.0 * quarter;
    let all = brackets(q, lam_max, number)?;
    let Some(&bracket) = all.get(number - 1) else {
        return Err(Error::no_convergence(format!(
            "fold curve {number} was not met on p = {p} below lambda = {lam_max}"
        )));
    };
    fold_between(number, p, bracket)
}

/// Point of fold curve `number` on the line `p` between two loads, given with their fold functions.
fn fold_between(number: usize, p: f64, [low, high]: [(f64, f64); 2]) -> Result<FoldPoint> {
    let mut failed = None;
    let lam = chandrupatla(
        |lam| {
            fold_function(off_axis(p), lam).unwrap_or_else(|e| {
                failed = Some(e);
                f64::NAN
            })
        },
        low,
        high,
        0.0,
    );
    match (lam, failed) {
        (Some(lam), _) => Ok(FoldPoint {
            number,
            equilibrium: Equilibrium::from_lambda_p(lam, p)?,
            cusp: false,
        }),
        (None, Some(e)) => Err(e),
        (None, None) => Err(Error::no_convergence(format!(
            "the root of fold curve {number} on p = {p} was lost"
        ))),
    }
}

/// Distance in lambda to the first fold at fixed p: positive for stable rods.
///
/// # Errors
/// p out of range.
pub fn fold_distance(equilibrium: &Equilibrium) -> Result<f64> {
    Ok(fold_at(1, equilibrium.p)?.equilibrium.lambda - equilibrium.lambda)
}

/// Half of the fold curve `number`, from p = `p_min` > 0 to `p_max`, with its cusps: points spaced
/// by at most `spacing` in arclength over (p, lam), cusps as points of their own. The other half is
/// the mirror image p -> -p, y -> -y.
///
/// # Errors
/// A range or spacing that is not positive, or a fold that cannot be followed.
pub fn fold_curve(number: usize, p_min: f64, p_max: f64, spacing: f64) -> Result<Vec<FoldPoint>> {
    if !(0.0 < p_min && p_min < p_max && p_max < 300.0) {
        return Err(Error::domain(format!(
            "a fold curve runs over 0 < p_min < p_max < 300, not {p_min} .. {p_max}"
        )));
    }
    if !(spacing > 1e-6) {
        return Err(Error::domain(format!(
            "spacing = {spacing} must be at least 1e-6"
        )));
    }
    let mut here = fold_at(number, p_min)?;
    let rises = fold_function(off_axis(p_min), here.equilibrium.lambda + 0.1)? > 0.0;
    let mut points = vec![here];
    let (mut speed, mut way) = image_speed(&here, [0.0, 1.0])?;
    while here.equilibrium.p < p_max {
        let next = advance(&here, rises, spacing, p_max)?;
        let (next_speed, next_way) = image_speed(&next, way)?;
        if speed * next_speed < 0.0 {
            points.push(cusp_between(&here, speed, &next, next_speed, way)?);
        }
        points.push(next);
        (here, speed, way) = (next, next_speed, next_way);
    }
    // Each point was sought beside the previous one. The last, counted from the straight rod, shows that all lie on
    // one curve.
    let counted = fold_at(number, here.equilibrium.p)?.equilibrium.lambda;
    if !((counted - here.equilibrium.lambda).abs() < 1e-6 * counted) {
        return Err(Error::no_convergence(format!(
            "fold curve {number} was lost between p = {p_min} and {p_max}: give a smaller spacing than {spacing}"
        )));
    }
    Ok(points)
}

/// Point of a fold curve on the line `p`, within `reach` in lambda of the point `here` on another line; `None` if the
/// fold is not found. Neighbouring folds of a line lie more than 3 apart. `rises`: the fold function rises through
/// this curve; at the neighbours it changes sign the other way.
fn fold_beside(here: &FoldPoint, rises: bool, p: f64, reach: f64) -> Result<Option<FoldPoint>> {
    let lam = here.equilibrium.lambda;
    let q = off_axis(p);
    let [low, high] = [lam - reach, lam + reach];
    let [f_low, f_high] = [fold_function(q, low)?, fold_function(q, high)?];
    if (f_low < 0.0, f_high > 0.0) != (rises, rises) {
        return Ok(None);
    }
    fold_between(here.number, p, [(low, f_low), (high, f_high)]).map(Some)
}

/// Next point of the curve, with p growing. The step in p is shortened until lam follows within the spacing (the
/// first curve drops from lam = 7.3 to 5.9 while p passes from 1.495 to 1.6).
fn advance(here: &FoldPoint, rises: bool, spacing: f64, p_max: f64) -> Result<FoldPoint> {
    let p = here.equilibrium.p;
    let mut step = spacing.min(p_max - p);
    loop {
        let to = if p + step >= p_max { p_max } else { p + step };
        let next = match fold_beside(here, rises, to, 1.5 * spacing.min(0.9))? {
            Some(next) => next,
            None if step > 1e-6 => {
                step *= 0.5;
                continue;
            }
            None => fold_at(here.number, to)?,
        };
        let moved =
            (next.equilibrium.p - p).hypot(next.equilibrium.lambda - here.equilibrium.lambda);
        if moved <= 1.01 * spacing || step < 1e-9 {
            return Ok(next);
        }
        step *= 0.9 * spacing / moved;
    }
}

/// Signed speed d(x, y)/dp of the end along the image of the fold curve, and its positive direction: the one near
/// `like`, that of the previous point. At a cusp the end turns back and the speed changes sign. The direction, which
/// both columns of d(x, y)/d(p, lam) have at a fold, is continuous.
fn image_speed(at: &FoldPoint, like: [f64; 2]) -> Result<(f64, [f64; 2])> {
    let e = &at.equilibrium;
    let t = TipDerivatives::new(&ChartPoint::at_load(off_axis(e.p), e.lambda)?);
    let longer = if dot(t.p, t.p) > dot(t.l, t.l) {
        t.p
    } else {
        t.l
    };
    let length = dot(longer, longer).sqrt().copysign(dot(longer, like));
    let way = longer.map(|c| c / length);
    let (_, gradient) = t.det_with_gradient();
    let slope = -gradient[0] / gradient[1];
    Ok((dot(t.p, way) + slope * dot(t.l, way), way))
}

fn cusp_between(
    a: &FoldPoint,
    fa: f64,
    b: &FoldPoint,
    fb: f64,
    like: [f64; 2],
) -> Result<FoldPoint> {
    let mut failed = None;
    let p = chandrupatla(
        |p| {
            fold_at(a.number, p)
                .and_then(|at| Ok(image_speed(&at, like)?.0))
                .unwrap_or_else(|e| {
                    failed = Some(e);
                    f64::NAN
                })
        },
        (a.equilibrium.p, fa),
        (b.equilibrium.p, fb),
        1e-14,
    );
    if let Some(e) = failed {
        return Err(e.context("locating a cusp"));
    }
    let p = p.ok_or_else(|| Error::no_convergence("a cusp was bracketed and lost"))?;
    Ok(FoldPoint {
        cusp: true,
        ..fold_at(a.number, p)?
    })
}
