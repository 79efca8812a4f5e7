//! Fits of scenes to measured data.

use crate::convert::refused;
use crate::hooks::{EVERY, Watch};
use crate::{Given, pieces};
use pyo3::prelude::*;
use pyo3::types::PyDict;
use snaprod::study::fit::SearchEnd;
use snaprod::study::{Data, Fit, Hooks, Vary};
use std::sync::atomic::{AtomicBool, AtomicUsize, Ordering};
use std::sync::mpsc::{RecvTimeoutError, channel};
use std::thread;

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
    let (text, set, ..) = given;
    let (names, rows) = data;
    let mut watch = Watch::new(progress);
    let found = py.detach(|| {
        let free: snaprod::Result<Vec<Vary>> = free.iter().map(|text| Vary::free(text)).collect();
        let data = Data::new(names, rows)?;
        let fit = Fit::new(text, set, free?, data, &set_by_row, &noise)?;
        let found = searched(&fit, starts, seed, &mut watch)?;
        fit.best(found, starts, &mut watch)
    });
    watch.finish()?;
    let record = found.map_err(|e| refused(&e))?;
    let mut tables = vec![record.table()];
    tables.extend(record.curve());
    pieces(py, &tables, &record.summary())
}

/// Searches from all starts on all cores, as the program does, in the order of the starts.
fn searched(
    fit: &Fit,
    starts: usize,
    seed: u64,
    watch: &mut Watch,
) -> snaprod::Result<Vec<SearchEnd>> {
    let (stopped, next) = (AtomicBool::new(false), AtomicUsize::new(0));
    let cores = thread::available_parallelism().map_or(1, usize::from);
    let (end, ends) = channel();
    let search = &|k: usize| fit.search(&fit.start(k, seed), &mut Searcher(&stopped));
    let mut found = Vec::new();
    thread::scope(|scope| {
        for _ in 0..cores.min(starts) {
            let (end, next) = (end.clone(), &next);
            scope.spawn(move || {
                loop {
                    let k = next.fetch_add(1, Ordering::Relaxed);
                    // The receiver waits for all senders, so sending succeeds.
                    if k >= starts || end.send((k, search(k))).is_err() {
                        break;
                    }
                }
            });
        }
        drop(end);
        let mut failed = None;
        loop {
            match ends.recv_timeout(EVERY) {
                Ok((k, Ok(one))) => found.push((k, one)),
                Ok((_, Err(e))) => {
                    // The first error is kept: searches stopped because of it report an interrupt.
                    failed.get_or_insert(e);
                }
                Err(RecvTimeoutError::Timeout) => {}
                Err(RecvTimeoutError::Disconnected) => break,
            }
            watch.progress(found.len() as f64 / starts as f64, found.len() as f64);
            if watch.interrupted() || failed.is_some() {
                stopped.store(true, Ordering::Relaxed);
            }
        }
        failed.map_or(Ok(()), Err)
    })?;
    found.sort_by_key(|(k, _)| *k);
    Ok(found.into_iter().filter_map(|(_, one)| one).collect())
}

/// The hooks of one search.
struct Searcher<'a>(&'a AtomicBool);

impl Hooks for Searcher<'_> {
    fn interrupted(&mut self) -> bool {
        self.0.load(Ordering::Relaxed)
    }
}
