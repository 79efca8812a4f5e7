//! Samples of whole sheets, for figures: grids of points of about equal distance.
//!
//! On a line p = const a sheet S_j^+- runs from lam = 2 j K to 2 (j + 1) K; its seams are w = j pi and (j + 1) pi.
//! The parameter here is the load: near a seam of a looped rod w moves by less than a double can hold
//! (by 1e-100 at p = 230) while the end passes through the disc.

use super::equilibrium::Equilibrium;
use crate::error::Result;
use crate::manifold::{Sheet, Sign};
use crate::math::carlson::complete_kb;
use std::f64::consts::LN_2;

/// Largest |p| sampled: 1 - |r| is of order 2/p for most rods, so the rim is reached to 0.7 %.
pub(super) const P_TOP: f64 = 300.0;
/// Distance of neighbours on the fine lines that grids are interpolated on.
const FINE: f64 = 0.02;
/// Distance over the disc of neighbours on a fold line.
pub(super) const SPACING: f64 = 0.005;

/// Equilibrium as a point of figures. Units: length 1, bending stiffness 1.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct GridPoint {
    /// Chart: kap = tanh p.
    pub p: f64,
    /// Chart: amplitude at the clamp.
    pub w: f64,
    /// lam = sqrt(|force|).
    pub lambda: f64,
    /// Direction of the force on the mass.
    pub alpha: f64,
    /// Tip angle theta(1).
    pub theta1: f64,
    /// End position.
    pub x: f64,
    /// End position.
    pub y: f64,
    /// Elastic energy.
    pub energy: f64,
}

/// A sheet sampled on a grid.
#[derive(Debug, Clone, PartialEq)]
pub struct SheetGrid {
    /// Sheet sampled.
    pub sheet: Sheet,
    /// Number of lines p = const; p grows from row to row.
    pub rows: usize,
    /// Number of points per line; lam grows from the seam w = j pi to the seam w = (j + 1) pi.
    pub columns: usize,
    /// Row by row: point (i, j) is `points[i * columns + j]`.
    pub points: Vec<GridPoint>,
}

impl GridPoint {
    /// Mirror image, p -> -p and y -> -y.
    pub fn mirrored(&self) -> Self {
        Self {
            p: -self.p,
            alpha: -self.alpha,
            theta1: -self.theta1,
            y: -self.y,
            ..*self
        }
    }

    /// Equilibrium (p, lam), or the unloaded rod, lam = 0, that borders S_0.
    pub(super) fn new(p: f64, lambda: f64) -> Result<Self> {
        if lambda == 0.0 {
            return Ok(Self {
                p,
                w: 0.0,
                lambda,
                alpha: -2.0 * p.tanh().asin(),
                theta1: 0.0,
                x: 1.0,
                y: 0.0,
                energy: 0.0,
            });
        }
        let e = Equilibrium::from_lambda_p(lambda, p)?;
        Ok(Self {
            p,
            w: e.w,
            lambda,
            alpha: e.alpha,
            theta1: e.theta1,
            x: e.x,
            y: e.y,
            energy: e.energy,
        })
    }
}

/// Samples a sheet on rows x columns points, at least 2 x 2, of about equal distance over the disc. The grid runs
/// from kap = 0 to 1 - |kap| = 1e-260 and from seam to seam. (p, lam) grow along rows and columns on every sheet, so
/// that all are oriented alike.
pub fn sheet_grid(sheet: Sheet, rows: usize, columns: usize) -> Result<SheetGrid> {
    sheet_grid_in(sheet, rows, columns, |q| [q.x, q.y, 0.2 * q.theta1])
}

/// Samples a sheet as [`sheet_grid`], with distances measured after `place`, the position of a point in a figure.
pub fn sheet_grid_in(
    sheet: Sheet,
    rows: usize,
    columns: usize,
    place: impl Fn(&GridPoint) -> [f64; 3],
) -> Result<SheetGrid> {
    let (rows, columns) = (rows.max(2), columns.max(2));
    let mode = f64::from(sheet.mode);
    // theta'(0) has the sign of kap (-1)^j.
    let positive = (sheet.sign == Sign::Plus) == (sheet.mode & 1 == 0);
    let (from, to) = if positive {
        (0.0, P_TOP)
    } else {
        (-P_TOP, 0.0)
    };
    let points = grid(from, to, rows, columns, place, |p| {
        let turn = 2.0 * quarter_period(p);
        Ok((mode * turn, (mode + 1.0) * turn))
    })?;
    Ok(SheetGrid {
        sheet,
        rows,
        columns,
        points,
    })
}

/// Samples the stable equilibria with kap of the given sign, up to the first fold, as [`sheet_grid`] samples a sheet:
/// the last column is the fold.
pub fn stable_grid(side: Sign, rows: usize, columns: usize) -> Result<Vec<GridPoint>> {
    let (from, to) = match side {
        Sign::Plus => (1e-3, P_TOP),
        Sign::Minus => (-P_TOP, -1e-3),
    };
    let place = |q: &GridPoint| [q.x, q.y, 0.2 * q.theta1];
    grid(from, to, rows.max(2), columns.max(2), place, |p| {
        Ok((0.0, super::folds::fold_at(1, p)?.equilibrium.lambda))
    })
}

/// Points between the bounds of lam on lines p = const, of about equal distance after `place`.
fn grid(
    from: f64,
    to: f64,
    rows: usize,
    columns: usize,
    place: impl Fn(&GridPoint) -> [f64; 3],
    bounds: impl Fn(f64) -> Result<(f64, f64)>,
) -> Result<Vec<GridPoint>> {
    let between = |(low, high): (f64, f64), t: f64| low + t * (high - low);
    // Distance of rows: the mean over both borders and three lines between them.
    let lines = [0.0, 0.25, 0.5, 0.75, 1.0];
    let ps = spread(rows, from, to, |p| {
        let range = bounds(p)?;
        lines
            .iter()
            .map(|&t| Ok(place(&GridPoint::new(p, between(range, t))?)))
            .collect()
    })?;
    let mut points = Vec::with_capacity(rows * columns);
    for p in ps {
        let range = bounds(p)?;
        let at = |t: f64| GridPoint::new(p, between(range, t));
        for t in spread(columns, 0.0, 1.0, |t| Ok(vec![place(&at(t)?)]))? {
            points.push(at(t)?);
        }
    }
    Ok(points)
}

/// K, the quarter period of the pendulum.
pub(super) fn quarter_period(p: f64) -> f64 {
    if p.abs() > 22.0 {
        p.abs() + LN_2
    } else {
        complete_kb(1.0 / p.cosh()).0
    }
}

/// Parameters from `from` to `to`, `n` of them, with equal distances of neighbours. The distance of two parameters is
/// the mean over their points.
pub(super) fn spread(
    n: usize,
    from: f64,
    to: f64,
    at: impl Fn(f64) -> Result<Vec<[f64; 3]>>,
) -> Result<Vec<f64>> {
    let distance = |a: &[[f64; 3]], b: &[[f64; 3]]| {
        let sum: f64 = a
            .iter()
            .zip(b)
            .map(|(a, b)| (a[0] - b[0]).hypot(a[1] - b[1]).hypot(a[2] - b[2]))
            .sum();
        sum / a.len() as f64
    };
    let line = refine_samples(from, to, at, |a, b, step| {
        distance(a, b) > FINE && step > 1e-9
    })?;
    let mut length = vec![0.0];
    let mut total = 0.0;
    for pair in line.windows(2) {
        // The small term keeps the length increasing where the points stand still.
        total += distance(&pair[0].1, &pair[1].1) + 1e-9 * (pair[1].0 - pair[0].0);
        length.push(total);
    }
    let last = n - 1;
    let mut k = 0;
    let mut out = vec![from];
    for i in 1..last {
        let wanted = total * i as f64 / last as f64;
        while length[k + 1] < wanted {
            k += 1;
        }
        let t = (wanted - length[k]) / (length[k + 1] - length[k]);
        out.push(line[k].0 + t * (line[k + 1].0 - line[k].0));
    }
    out.push(to);
    Ok(out)
}

/// Samples a function from `from` to `to`, halving every interval that is `coarse(a, b, length)`.
pub(super) fn refine_samples<T: Clone>(
    from: f64,
    to: f64,
    at: impl Fn(f64) -> Result<T>,
    coarse: impl Fn(&T, &T, f64) -> bool,
) -> Result<Vec<(f64, T)>> {
    const FIRST: usize = 24;
    let mut out = vec![(from, at(from)?)];
    // Right ends not yet reached, the nearest last.
    let mut ahead = Vec::new();
    for i in (1..=FIRST).rev() {
        let t = from + (to - from) * i as f64 / FIRST as f64;
        ahead.push((t, at(t)?));
    }
    while let Some(next) = ahead.pop() {
        let here = &out[out.len() - 1];
        let middle = 0.5 * (here.0 + next.0);
        if coarse(&here.1, &next.1, next.0 - here.0) {
            let value = at(middle)?;
            ahead.push(next);
            ahead.push((middle, value));
        } else {
            out.push(next);
        }
    }
    Ok(out)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn sheets_are_evenly_sampled_from_seam_to_seam() {
        for mode in 0..=3 {
            for sign in [Sign::Plus, Sign::Minus] {
                let grid = sheet_grid(Sheet { mode, sign }, 40, 30).unwrap();
                assert_eq!(grid.points.len(), 40 * 30);
                let mut longest = 0f64;
                for (k, q) in grid.points.iter().enumerate() {
                    assert!(q.x.hypot(q.y) <= 1.0 + 1e-12 && q.energy.is_finite());
                    let (i, j) = (k / 30, k % 30);
                    let inside = 0 < i && i < 39 && 0 < j && j < 29 && q.p.abs() < 10.0;
                    if inside {
                        let sheet = super::super::equilibrium::sheet(q.p, q.w);
                        assert_eq!(sheet, grid.sheet);
                    }
                    if j > 0 {
                        let r = grid.points[k - 1];
                        assert!(q.lambda > r.lambda);
                        longest = longest.max((q.x - r.x).hypot(q.y - r.y));
                    }
                }
                assert!(longest < 0.35, "{mode} {sign:?}: {longest}");
            }
        }
    }
}
