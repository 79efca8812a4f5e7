//! The intervals of a taut rod joined: elimination from node to node with exchanges of rows.
//!
//! What the base leaves over, three equations, goes along from node to node: growing variations are eliminated by what comes after them,
//! decaying ones by what came before. That is as stable as the problem itself, whatever lam (de Boor and Weiss).

// Entries of matrices are told by their indices.
#![allow(clippy::needless_range_loop)]

use super::interval::Condensed;
use nalgebra::{SMatrix, SVector, Vector6};

/// Answers to unit forces, to unit turns (or couples) of the end, and to the residual.
pub(super) const ANSWERS: usize = 7;
/// Where the residual's stand.
pub(super) const REST: usize = 6;

pub(super) type Answers = SMatrix<f64, 6, ANSWERS>;

/// The equations at the end: `by` y = `right`.
pub(super) struct AtEnd {
    pub by: SMatrix<f64, 3, 6>,
    pub right: SMatrix<f64, 3, ANSWERS>,
}

const WIDE: usize = 12 + ANSWERS;

/// Turn and couple (over kappa) at every node for every right-hand side, and the sign of the determinant; None where it vanishes.
pub(super) fn chain(intervals: &[Condensed], end: &AtEnd) -> Option<(Vec<Answers>, f64)> {
    let mut sign = 1.0;
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
        for (to, row) in carry.iter_mut().zip(&panel[6..]) {
            to[..6].copy_from_slice(&row[6..12]);
            to[6..].copy_from_slice(&row[12..]);
        }
        let rows: [[f64; WIDE]; 6] = std::array::from_fn(|i| panel[i]);
        upper.push(rows);
    }
    let mut last = [[0.0; 6 + ANSWERS]; 6];
    for (i, row) in last.iter_mut().enumerate() {
        if i < 3 {
            *row = carry[i];
            continue;
        }
        for j in 0..6 {
            row[j] = end.by[(i - 3, j)];
        }
        for j in 0..ANSWERS {
            row[6 + j] = end.right[(i - 3, j)];
        }
    }
    sign *= pivoted(&mut last, 6)?;
    let back = |rows: &[&[f64]], right: &Answers| {
        let mut y = *right;
        for i in (0..6).rev() {
            for j in i + 1..6 {
                let known = y.row(j) * rows[i][j];
                let mut row = y.row_mut(i);
                row -= known;
            }
            let pivot = rows[i][i];
            y.row_mut(i).unscale_mut(pivot);
        }
        y
    };
    let right = Answers::from_fn(|i, j| last[i][6 + j]);
    let mut found = vec![back(&last.each_ref().map(|row| row.as_slice()), &right)];
    for rows in upper.iter().rev() {
        let next = found[found.len() - 1];
        let known = SMatrix::<f64, 6, 6>::from_fn(|i, j| rows[i][6 + j]) * next;
        let right = Answers::from_fn(|i, j| rows[i][12 + j]) - known;
        found.push(back(&rows.each_ref().map(|row| row.as_slice()), &right));
    }
    found.reverse();
    found
        .iter()
        .all(|y| y.iter().all(|x| x.is_finite()))
        .then_some((found, sign))
}

/// Eliminates the first columns with exchanges of rows; the sign of the determinant of what was eliminated.
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

/// The change of an interval that its start, and the force, make: `by` has the columns of [`Condensed`].
pub(super) fn follow<const K: usize>(
    by: &SMatrix<f64, K, 10>,
    start: &Answers,
) -> SMatrix<f64, K, ANSWERS> {
    let mut found = by.fixed_columns::<6>(0) * start;
    let mut force = found.fixed_columns_mut::<3>(0);
    force += by.fixed_columns::<3>(6);
    let mut rest = found.fixed_columns_mut::<1>(REST);
    rest += by.column(9);
    found
}

/// The answer to the residual.
pub(super) fn rest(answers: &Answers) -> Vector6<f64> {
    SVector::from(answers.column(REST))
}
