//! kernel.csv: relaxation function, memory kernel and creep function against time.

use super::response::Response;
use crate::cli::files::exact;
use nalgebra::Matrix6;

/// One component of a matrix of functions of time.
pub struct Column {
    /// R, k or J.
    pub function: char,
    /// Its place in the matrix, i <= j: all three are symmetric.
    pub place: (usize, usize),
    pub name: String,
    pub values: Vec<f64>,
}

/// An entry smaller than this against the diagonal is rounding.
const NOTHING: f64 = 1e-12;

/// The components that are not zero.
pub fn columns(response: &Response, times: &[f64]) -> Vec<Column> {
    let kernel = &response.kernel;
    let mut columns = Vec::new();
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
                // Of the kernel, a diagonal entry may itself be rounding.
                let rounding = match function {
                    'k' => NOTHING * rate(response, i, j),
                    _ => 0.0,
                };
                if values.iter().any(|x| x.abs() > least.max(rounding)) {
                    columns.push(Column {
                        function,
                        place: (i, j),
                        name: format!("{function}_{}", response.entry(i, j)),
                        values,
                    });
                }
            }
        }
    }
    columns
}

/// How large the kernel would be if R were forgotten at the fastest rate.
fn rate(response: &Response, i: usize, j: usize) -> f64 {
    let glassy = response.kernel.glassy();
    let fastest = response.terms.last().map_or(0.0, |term| term.rate);
    (glassy[(i, i)] * glassy[(j, j)]).sqrt() * fastest
}

/// The table.
pub fn csv(times: &[f64], columns: &[Column]) -> String {
    let mut text = String::from("t");
    for column in columns {
        text.push(',');
        text.push_str(&column.name);
    }
    text.push('\n');
    for (row, t) in times.iter().enumerate() {
        text.push_str(&exact(*t));
        for column in columns {
            text.push(',');
            text.push_str(&exact(column.values[row]));
        }
        text.push('\n');
    }
    text
}
