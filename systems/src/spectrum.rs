//! Eigenvalues of matrices that are not symmetric.

use nalgebra::{Complex, DMatrix, Schur};

/// Iterations of the eigenvalue method for each unknown.
const ITERATIONS: usize = 100;
/// Tries of the eigenvalue method: where it ends, in units of rounding, and noise in the matrix, relative.
const STRICT: [(f64, f64); 4] = [(1.0, 0.0), (8.0, 0.0), (8.0, 1e-15), (64.0, 1e-14)];
/// Multiples of it are spread evenly modulo 1.
const GOLDEN: f64 = 0.618_033_988_749_894_9;

/// All eigenvalues; None if no try of the method ends.
pub(crate) fn eigenvalues(matrix: DMatrix<f64>) -> Option<Vec<Complex<f64>>> {
    if matrix.is_empty() {
        return Some(Vec::new());
    }
    let (n, size) = (matrix.nrows(), matrix.norm());
    // Rates that are many times the same can make the method go in circles, which the transposed matrix, less strict an end, or rounding of another kind, breaks.
    let noise = |i: usize, j: usize| ((i * n + j) as f64 * GOLDEN).fract() - 0.5;
    let schur = STRICT.iter().find_map(|(strict, shaken)| {
        let shaken = matrix.map_with_location(|i, j, x| x + noise(i, j) * shaken * size / n as f64);
        let each = [shaken.transpose(), shaken];
        each.into_iter()
            .rev()
            .find_map(|matrix| Schur::try_new(matrix, strict * f64::EPSILON, ITERATIONS * n))
    });
    Some(schur?.complex_eigenvalues().iter().copied().collect())
}
