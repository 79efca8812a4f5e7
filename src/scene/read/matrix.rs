//! Checks of symmetric matrices of a scene.

use super::phrases::Short;
use super::ranges::{Rule, VALUE};
use super::reader::Reader;
use super::varying::ROUNDING;
use crate::scene::FaultKind;
use nalgebra::{DMatrix, SymmetricEigen};
use toml::Spanned;
use toml::de::DeValue;

/// Reads rows of numbers.
pub(super) fn rows<const N: usize>(
    reader: &Reader,
    field: &str,
    value: &Spanned<DeValue>,
    allowed: &str,
    row_words: &str,
) -> Option<[[f64; N]; N]> {
    let number = |field: &str, value: &_| reader.number(field, value, &VALUE);
    let row = |field: &str, value| reader.array(field, value, row_words, &number);
    reader.array(field, value, allowed, &row)
}

/// The matrix, exactly symmetrised, if it is symmetric up to rounding and positive definite in the rows and columns
/// `free`. A `diagonal` rule that allows 0 weakens definite to semidefinite. Otherwise reports the fault with its
/// `consequence`.
pub(super) fn definite<const N: usize>(
    reader: &Reader,
    field: &str,
    value: &Spanned<DeValue>,
    mut rows: [[f64; N]; N],
    free: &[usize],
    diagonal: &Rule,
    consequence: &str,
) -> Option<[[f64; N]; N]> {
    let refuse = |field: &str, allowed: &str, hint: String| {
        reader.refuse(FaultKind::Value, field, value, allowed, hint)
    };
    for &i in free {
        if !(diagonal.holds)(rows[i][i]) {
            let hint = (diagonal.hint)(rows[i][i]).unwrap_or(consequence);
            let hint = format!("it is {}: {hint}", Short(rows[i][i]));
            return refuse(&format!("{field}[{i}][{i}]"), diagonal.allowed, hint);
        }
    }
    for &i in free {
        for &j in free.iter().filter(|j| **j < i) {
            let (a, b) = (rows[i][j], rows[j][i]);
            if !((a - b).abs() <= ROUNDING * (rows[i][i] * rows[j][j]).sqrt()) {
                let (a, b) = (Short(a), Short(b));
                let hint =
                    format!("row {i}, column {j} is {a}, row {j}, column {i} is {b} (from 0)");
                return refuse(field, "symmetric", hint);
            }
            let mean = 0.5 * (a + b);
            (rows[i][j], rows[j][i]) = (mean, mean);
        }
    }
    // Scaling to a unit diagonal removes the units of couples and forces.
    let scaled = DMatrix::from_fn(free.len(), free.len(), |a, b| {
        let (i, j) = (free[a], free[b]);
        match (i == j, rows[i][j] == 0.0) {
            (true, _) => 1.0,
            (false, true) => 0.0,
            (false, false) => rows[i][j] / (rows[i][i].sqrt() * rows[j][j].sqrt()),
        }
    });
    let semi = (diagonal.holds)(0.0);
    let (words, bound) = if semi {
        ("positive semidefinite", -ROUNDING)
    } else {
        ("positive definite", ROUNDING)
    };
    let large = scaled
        .iter()
        .any(|x| !(x.abs() <= 1.0 + if semi { ROUNDING } else { 0.0 }));
    let least = if large || free.is_empty() {
        f64::INFINITY
    } else {
        SymmetricEigen::new(scaled).eigenvalues.min()
    };
    if large {
        let hint = "an entry beside the diagonal is larger than the root of the product of its two diagonal entries";
        return refuse(field, words, format!("{hint}: {consequence}"));
    }
    if !(least > bound) {
        let hint = format!("scaled to a unit diagonal its least eigenvalue is {least:.6e}");
        return refuse(field, words, format!("{hint}: {consequence}"));
    }
    Some(rows)
}
