//! Joined intervals of a taut rod: elimination from node to node with exchanges of rows.
//!
//! The three equations left by the base are carried from node to node. Growing variations are eliminated by later
//! intervals, decaying ones by earlier ones. This is as stable as the problem itself, whatever lam (de Boor and
//! Weiss).

// Matrix entries are addressed by their indices.
#![allow(clippy::needless_range_loop)]

//! The force is an unknown as well: a spring at the end determines it up to the stretch of the spring,
//! ```text
//! dn + k dr(1) = df,        dr(1) = sum of the contributions of the intervals.
//! ```
//! The sum is carried along as three rows that are never pivots. The equations of the end and of the spring are
//! solved together last: they are regular where those of the end alone, under a given force, are not.

use super::condensed::Condensed;
use nalgebra::{SMatrix, SVector, Vector3};

/// Number of right-hand sides: unit forces (of the spring), unit turns (or couples) of the end, and the residual.
pub(super) const ANSWERS: usize = 7;
/// Column of the residual.
pub(super) const REST: usize = 6;

pub(super) type Answers = SMatrix<f64, 6, ANSWERS>;
pub(super) type Forces = SMatrix<f64, 3, ANSWERS>;

/// Equations at the end: `by` y = `right`.
pub(super) struct AtEnd {
    pub by: SMatrix<f64, 3, 6>,
    pub right: SMatrix<f64, 3, ANSWERS>,
}

/// Equation of the force: give dn + k dr(1) = df.
pub(super) struct ForceEquation {
    /// 1, or 0 if the end is held.
    pub give: f64,
    pub stiffness: f64,
    /// Residual of this equation.
    pub off: Vector3<f64>,
    /// Unit of forces.
    pub unit: f64,
}

/// Solution of the chain for all right-hand sides.
pub(super) struct ChainSolution {
    /// Turn and couple (over kappa) at every node.
    pub nodes: Vec<Answers>,
    /// Change of the force.
    pub force: Forces,
    /// Sign of the determinant.
    pub sign: f64,
}

/// Pivots of the last equations below this part of the largest count as zero.
const NEUTRAL: f64 = 1e-10;
const WIDE: usize = 12 + ANSWERS;
const LAST: usize = 9 + ANSWERS;

/// Unknowns for every right-hand side; None if the determinant vanishes. If the rod turns for nothing, one direction of
/// the last equations is neutral: their solution is the shortest.
pub(super) fn chain(
    intervals: &[Condensed],
    end: &AtEnd,
    hold: &ForceEquation,
    turns: bool,
) -> Option<ChainSolution> {
    let mut sign = 1.0;
    // dr(1) by the node reached, then by the force, the tip, and 1.
    let mut way = [[0.0; 6 + ANSWERS]; 3];
    // The base does not turn.
    let mut carry = [[0.0; 6 + ANSWERS]; 3];
    for (i, row) in carry.iter_mut().enumerate() {
        row[i] = 1.0;
    }
    let mut upper = Vec::with_capacity(intervals.len());
    for interval in intervals {
        let mut panel = [[0.0; WIDE]; 9];
        for (row, from) in panel.iter_mut().zip(&carry) {
            row[..6].copy_from_slice(&from[..6]);
            row[12..].copy_from_slice(&from[6..]);
        }
        for i in 0..6 {
            let row = &mut panel[3 + i];
            for j in 0..6 {
                row[j] = -interval.end[(i, j)];
            }
            row[6 + i] = 1.0;
            for j in 0..3 {
                row[12 + j] = interval.end[(i, 6 + j)];
            }
            row[12 + REST] = interval.end[(i, 9)];
        }
        sign *= pivoted(&mut panel, 6)?;
        for (i, sum) in way.iter_mut().enumerate() {
            for j in 0..6 {
                sum[j] += interval.way[(i, j)];
            }
            for j in 0..3 {
                sum[6 + j] += interval.way[(i, 6 + j)];
            }
            sum[6 + REST] += interval.way[(i, 9)];
            let mut next = [0.0; 6];
            for (k, row) in panel[..6].iter().enumerate() {
                let factor = sum[k] / row[k];
                for j in k + 1..6 {
                    sum[j] -= factor * row[j];
                }
                for (to, by) in next.iter_mut().zip(&row[6..12]) {
                    *to -= factor * by;
                }
                for (to, by) in sum[6..].iter_mut().zip(&row[12..]) {
                    *to += factor * by;
                }
            }
            sum[..6].copy_from_slice(&next);
        }
        for (to, row) in carry.iter_mut().zip(&panel[6..]) {
            to[..6].copy_from_slice(&row[6..12]);
            to[6..].copy_from_slice(&row[12..]);
        }
        let rows: [[f64; WIDE]; 6] = std::array::from_fn(|i| panel[i]);
        upper.push(rows);
    }
    let (k, unit) = (hold.stiffness / hold.unit, hold.unit);
    let mut last = [[0.0; LAST]; 9];
    for (i, row) in last.iter_mut().enumerate() {
        let (by, right): ([f64; 6], [f64; ANSWERS]) = match i {
            0..3 => split_row(&carry[i]),
            3..6 => (
                std::array::from_fn(|j| end.by[(i - 3, j)]),
                std::array::from_fn(|j| end.right[(i - 3, j)]),
            ),
            _ => {
                let (by, right) = split_row(&way[i - 6]);
                (by.map(|x| k * x), right.map(|x| -k * x))
            }
        };
        row[..6].copy_from_slice(&by);
        for j in 0..3 {
            row[6 + j] = -right[j] * unit;
        }
        row[12..].copy_from_slice(&right[3..]);
        if i >= 6 {
            row[i] += hold.give;
            row[9 + i - 6] = 1.0 / unit;
            row[9 + REST] += hold.off[i - 6] / unit;
        }
    }
    let whole = last;
    sign *= pivoted(&mut last, 9)?;
    let pivots = (0..9).map(|i| last[i][i].abs());
    let (least, most) = pivots.fold((f64::INFINITY, 0.0_f64), |(a, b), x| (a.min(x), b.max(x)));
    let mut found = SMatrix::<f64, 9, ANSWERS>::from_fn(|i, j| last[i][9 + j]);
    if least > NEUTRAL * most && !turns {
        back_substitute(&last, &mut found);
    } else {
        let matrix = SMatrix::<f64, 9, 9>::from_fn(|i, j| whole[i][j]);
        let right = SMatrix::<f64, 9, ANSWERS>::from_fn(|i, j| whole[i][9 + j]);
        let parts = matrix.svd(true, true);
        let mut zero = NEUTRAL * parts.singular_values.amax();
        if turns {
            zero = zero.max(parts.singular_values.amin());
        }
        found = parts.solve(&right, zero).ok()?;
    }
    let force: Forces = found.fixed_rows::<3>(6) * unit;
    let mut nodes = vec![found.fixed_rows::<6>(0).into_owned()];
    for rows in upper.iter().rev() {
        let next = nodes[nodes.len() - 1];
        let known = SMatrix::<f64, 6, 6>::from_fn(|i, j| rows[i][6 + j]) * next;
        let mut y = SMatrix::<f64, 6, 3>::from_fn(|i, j| rows[i][12 + j]) * force - known;
        for (i, row) in rows.iter().enumerate() {
            y[(i, REST)] += row[12 + REST];
        }
        back_substitute(rows, &mut y);
        nodes.push(y);
    }
    nodes.reverse();
    let finite = nodes.iter().all(|y| y.iter().all(|x| x.is_finite()));
    finite.then_some(ChainSolution { nodes, force, sign })
}

fn split_row(row: &[f64; 6 + ANSWERS]) -> ([f64; 6], [f64; ANSWERS]) {
    (
        std::array::from_fn(|j| row[j]),
        std::array::from_fn(|j| row[6 + j]),
    )
}

/// Back substitution in place with the upper triangle of the first columns of `rows`.
fn back_substitute<const W: usize, const R: usize>(
    rows: &[[f64; W]; R],
    y: &mut SMatrix<f64, R, ANSWERS>,
) {
    for i in (0..R).rev() {
        for j in i + 1..R {
            let known = y.row(j) * rows[i][j];
            let mut row = y.row_mut(i);
            row -= known;
        }
        y.row_mut(i).unscale_mut(rows[i][i]);
    }
}

/// Gaussian elimination of the first columns with exchanges of rows; returns the sign of the eliminated determinant.
fn pivoted<const W: usize, const R: usize>(
    rows: &mut [[f64; W]; R],
    columns: usize,
) -> Option<f64> {
    let mut sign = 1.0;
    for k in 0..columns {
        let best = (k..R).max_by(|a, b| rows[*a][k].abs().total_cmp(&rows[*b][k].abs()))?;
        if best != k {
            rows.swap(k, best);
            sign = -sign;
        }
        let (above, below) = rows.split_at_mut(k + 1);
        let pivot = &above[k];
        if !(pivot[k].abs() > 0.0 && pivot[k].is_finite()) {
            return None;
        }
        sign *= pivot[k].signum();
        for row in below {
            let factor = row[k] / pivot[k];
            if factor != 0.0 {
                for (x, p) in row[k + 1..].iter_mut().zip(&pivot[k + 1..]) {
                    *x -= factor * p;
                }
            }
        }
    }
    Some(sign)
}

/// Change of an interval by its start and by the force: `by` has the columns of [`Condensed`].
pub(super) fn interval_change<const K: usize>(
    by: &SMatrix<f64, K, 10>,
    start: &Answers,
    force: &Forces,
) -> SMatrix<f64, K, ANSWERS> {
    let mut found = by.fixed_columns::<6>(0) * start + by.fixed_columns::<3>(6) * force;
    let mut rest = found.fixed_columns_mut::<1>(REST);
    rest += by.column(9);
    found
}

/// Solution for the residual.
pub(super) fn rest<const K: usize>(answers: &SMatrix<f64, K, ANSWERS>) -> SVector<f64, K> {
    SVector::from(answers.column(REST))
}
