//! kernel.csv: relaxation function, memory kernel and creep function against time.

use super::MemoryRecord;
use crate::error::{Error, Result};
use crate::study::record::{Column, Table, Values};
use nalgebra::Matrix6;
use std::ops::RangeInclusive;

/// An entry of a matrix function of time.
#[derive(Debug, Clone, PartialEq)]
pub struct KernelEntry {
    /// R, k or J.
    pub function: char,
    /// Row and column, i <= j: R, k and J are symmetric.
    pub place: (usize, usize),
    /// "R_yy".
    pub name: String,
    /// Values at the times.
    pub values: Vec<f64>,
}

/// Allowed number of times in a table.
pub const POINTS: RangeInclusive<usize> = 2..=100_000;

/// Times in geometric sequence from first to last.
///
/// # Errors
/// Times that are not positive, finite and ascending; a number of times outside [`POINTS`].
pub fn times([from, to]: [f64; 2], points: usize) -> Result<Vec<f64>> {
    if !(f64::MIN_POSITIVE <= from && from < to && to < f64::INFINITY) {
        return Err(Error::domain(format!(
            "the times from {from:e} to {to:e} are in ratios: give 0 < from < to, both finite"
        )));
    }
    if !POINTS.contains(&points) {
        return Err(Error::domain(format!(
            "{points} times: a table has from {} to {}",
            POINTS.start(),
            POINTS.end()
        )));
    }
    let last = points - 1;
    // By logarithms, without overflow of ratios; both ends stay exact.
    let [a, b] = [from.log10(), to.log10()];
    let inner = |k: usize| 10.0_f64.powf(a + (b - a) * k as f64 / last as f64);
    let mut times: Vec<f64> = (0..=last).map(inner).collect();
    (times[0], times[last]) = (from, to);
    Ok(times)
}

/// Relative size, compared with the diagonal, below which an entry is rounding.
const NOTHING: f64 = 1e-12;

/// The nonzero entries.
pub fn entries(response: &MemoryRecord, times: &[f64]) -> Vec<KernelEntry> {
    let kernel = &response.kernel;
    let mut entries = Vec::new();
    for function in ['R', 'k', 'J'] {
        let at = |t: f64| match function {
            'R' => kernel.wrench_after_step(t),
            'k' => kernel.kernel(t),
            _ => kernel.creep(t),
        };
        if function == 'k' && response.forgets_all() {
            continue;
        }
        let matrices: Vec<Matrix6<f64>> = times.iter().map(|t| at(*t)).collect();
        let size = |i: usize| -> f64 { matrices.iter().map(|m| m[(i, i)]).fold(0.0, f64::max) };
        for (k, &i) in response.shown.iter().enumerate() {
            for &j in &response.shown[k..] {
                let values: Vec<f64> = matrices.iter().map(|m| m[(i, j)]).collect();
                let least = NOTHING * (size(i) * size(j)).sqrt();
                // A diagonal entry of the kernel may be rounding itself.
                let rounding = match function {
                    'k' => NOTHING * rate(response, i, j),
                    _ => 0.0,
                };
                if values.iter().any(|x| x.abs() > least.max(rounding)) {
                    entries.push(KernelEntry {
                        function,
                        place: (i, j),
                        name: format!("{function}_{}", response.entry(i, j)),
                        values,
                    });
                }
            }
        }
    }
    entries
}

/// Size of the kernel if R relaxed at the fastest rate.
fn rate(response: &MemoryRecord, i: usize, j: usize) -> f64 {
    let glassy = response.kernel.glassy();
    let fastest = response.terms.last().map_or(0.0, |term| term.rate);
    (glassy[(i, i)] * glassy[(j, j)]).sqrt() * fastest
}

/// The times and the entries as the table "kernel".
pub fn table(response: &MemoryRecord, times: &[f64], entries: &[KernelEntry]) -> Table {
    let column = |entry: &KernelEntry| {
        let (i, j) = entry.place;
        let (unit, what) = match entry.function {
            'R' => (response.unit(i, j, false).to_owned(), "relaxation function"),
            'k' if response.units.time().is_empty() => (String::new(), "memory kernel"),
            'k' => (format!("{}/s", response.unit(i, j, false)), "memory kernel"),
            _ => (response.unit(i, j, true).to_owned(), "creep function"),
        };
        Column {
            values: Values::Reals(entry.values.clone()),
            ..Column::reals(entry.name.clone(), unit, what)
        }
    };
    let time = Column {
        values: Values::Reals(times.to_vec()),
        ..Column::reals("t", response.units.time(), "time since the step")
    };
    let columns = std::iter::once(time).chain(entries.iter().map(column));
    Table::new("kernel", columns.collect())
}
