//! Fits of scenes to measured data.

use crate::convert::refused;
use crate::hooks::Watch;
use crate::{Given, pieces};
use pyo3::prelude::*;
use pyo3::types::PyDict;
use snaprod::study::{Data, Fit, Hooks, Vary};

/// The columns and rows of CSV, as the program reads it; messages begin with the name of the file.
#[pyfunction]
pub fn data(name: &str, text: &str) -> PyResult<(Vec<String>, Vec<Vec<f64>>)> {
    let read =
        Data::parse(text).map_err(|e| refused(&snaprod::Error::domain(format!("{name}: {e}"))))?;
    Ok((read.names, read.rows))
}

/// Fits fields of a scene to data: names of columns and rows of numbers, NaN where nothing was measured.
#[pyfunction]
#[allow(clippy::too_many_arguments)] // As the program has options.
pub fn fit<'py>(
    py: Python<'py>,
    given: Given,
    data: (Vec<String>, Vec<Vec<f64>>),
    free: Vec<String>,
    set_by_row: Vec<String>,
    noise: Vec<(String, f64)>,
    starts: usize,
    seed: u64,
    progress: Option<Py<PyAny>>,
) -> PyResult<Bound<'py, PyDict>> {
    let (text, set, _) = given;
    let (names, rows) = data;
    let mut watch = Watch::new(progress);
    let found = py.detach(|| {
        let free: snaprod::Result<Vec<Vary>> = free.iter().map(|text| Vary::free(text)).collect();
        let data = Data::new(names, rows)?;
        let fit = Fit::new(text, set, free?, data, &set_by_row, &noise)?;
        let mut found = Vec::new();
        for k in 0..starts {
            found.extend(fit.search(&fit.start(k, seed), &mut watch)?);
            watch.progress((k + 1) as f64 / starts as f64, (k + 1) as f64);
        }
        fit.best(found, starts, &mut watch)
    });
    watch.finish()?;
    let record = found.map_err(|e| refused(&e))?;
    let mut tables = vec![record.table()];
    tables.extend(record.curve());
    pieces(py, &tables, &record.summary())
}
