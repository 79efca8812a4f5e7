//! Sums over the masses that the sections of a rod carry.

use super::frames::Triple;
use nalgebra::{DMatrix, Matrix6, Vector3, Vector6};

/// Couples of wrenches (from component 0), or forces (from component 3).
pub(super) fn parts(wrenches: &[Vector6<f64>], first: usize) -> Vec<Vector3<f64>> {
    let each = wrenches.iter();
    each.map(|w| w.fixed_rows::<3>(first).into_owned())
        .collect()
}

/// Adds J^T (matrix x) for row `i` of the sections to `out`, where `left` and `right` hold the twists
/// (turn, move) of all of them.
pub(super) fn add_mass(
    out: &mut DMatrix<f64>,
    i: usize,
    matrix: &Matrix6<f64>,
    left: [&Triple; 2],
    right: [&Triple; 2],
) {
    let row = |of: [&Triple; 2], k: usize| of[k / 3][k % 3].row(i).transpose();
    for k in 0..6 {
        if matrix.row(k).iter().all(|x| *x == 0.0) {
            continue;
        }
        let mut sum = row(right, 0) * matrix[(k, 0)];
        for l in 1..6 {
            if matrix[(k, l)] != 0.0 {
                sum.axpy(matrix[(k, l)], &row(right, l), 1.0);
            }
        }
        out.ger(1.0, &row(left, k), &sum, 1.0);
    }
}
