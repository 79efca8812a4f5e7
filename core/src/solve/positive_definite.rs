//! Matrices that are positive definite beyond rounding.

use nalgebra::{Cholesky, DMatrix, Dyn};

/// Smallest pivot relative to its diagonal element; smaller ones are rounding.
const PIVOT: f64 = 1e-11;

/// Cholesky factors of a symmetric matrix; None unless the matrix is positive definite beyond rounding, whatever the
/// units of its rows.
pub fn definite(matrix: &DMatrix<f64>) -> Option<Cholesky<f64, Dyn>> {
    let factors = matrix.clone().cholesky()?;
    let pivots = factors.l_dirty().diagonal();
    let own = matrix.diagonal();
    let mut pairs = pivots.iter().zip(&own);
    let beyond = pairs.all(|(pivot, own)| pivot * pivot > PIVOT * own);
    beyond.then_some(factors)
}
