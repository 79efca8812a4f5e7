//! A sweep in its directory, chunk by chunk.

use crate::convert::refused;
use crate::hooks::Watch;
use pyo3::prelude::*;
use pyo3::types::PyBytes;
use snaprod::study::sweep::{Directory, Sweep as Study};
use snaprod::study::{Hooks, Vary};
use std::path::PathBuf;
use std::sync::atomic::{AtomicBool, AtomicUsize, Ordering};

/// Names of columns, columns, and the file.
type ChunkRows<'py> = (Vec<String>, Vec<Vec<String>>, Bound<'py, PyBytes>);

/// A sweep in its directory. Several threads may make chunks of the sweep at once.
#[pyclass(frozen)]
pub struct Sweep {
    directory: Directory,
    stopped: AtomicBool,
    done: AtomicUsize,
}

#[pymethods]
impl Sweep {
    /// `vary`: the argument of `snaprod sweep --vary`; `random`: number of points and seed.
    #[new]
    fn new(
        py: Python<'_>,
        scene: String,
        set: Vec<String>,
        vary: Vec<String>,
        random: Option<(usize, u64)>,
        columns: Vec<String>,
        path: PathBuf,
    ) -> PyResult<Self> {
        let mut watch = Watch::new(None);
        let directory = py.detach(|| {
            let vary = vary.iter().map(|text| Vary::parse(text));
            let vary = vary.collect::<snaprod::Result<Vec<_>>>()?;
            let sweep = Study::new(scene, set, vary, random, columns)?;
            match sweep.refused() {
                Some(why) => Err(snaprod::Error::domain(why)),
                None => Directory::open(sweep, &path, &mut watch),
            }
        });
        watch.finish()?;
        Ok(Self {
            directory: directory.map_err(|e| refused(&e))?,
            stopped: AtomicBool::new(false),
            done: AtomicUsize::new(0),
        })
    }

    /// Number of points.
    #[getter]
    fn points(&self) -> usize {
        self.directory.sweep().points()
    }

    /// Number of points made by this object.
    #[getter]
    fn done(&self) -> usize {
        self.done.load(Ordering::Relaxed)
    }

    /// The varied fields, and the recorded quantities.
    #[getter]
    fn names(&self) -> (Vec<String>, Vec<String>) {
        let sweep = self.directory.sweep();
        let varied = sweep.vary().iter().map(|one| one.path.clone());
        (varied.collect(), sweep.quantities().to_vec())
    }

    /// The unit and the meaning of a column, if known.
    fn described(&self, column: &str) -> Option<[String; 2]> {
        self.directory.sweep().described(column)
    }

    /// Number of values of each field on a grid; number of points of a random sweep.
    #[getter]
    fn shape(&self) -> Vec<usize> {
        let sweep = self.directory.sweep();
        if sweep.is_grid() {
            sweep.vary().iter().filter_map(Vary::count).collect()
        } else {
            vec![sweep.points()]
        }
    }

    /// Number of points of a chunk.
    fn points_of(&self, chunk: usize) -> usize {
        self.directory.points_of(chunk)
    }

    /// The missing chunks.
    fn missing(&self) -> Vec<usize> {
        self.directory.made().missing
    }

    /// Makes a chunk; false if stopped.
    fn make(&self, py: Python<'_>, chunk: usize) -> PyResult<bool> {
        let made = py.detach(|| self.directory.make(chunk, &mut ChunkHooks(self)));
        made.map_err(|e| refused(&e))
    }

    /// Stops the chunks in progress.
    fn stop(&self) {
        self.stopped.store(true, Ordering::Relaxed);
    }

    /// All rows once no chunk is missing: names of columns, columns as text, and sweep.csv.
    fn rows<'py>(&self, py: Python<'py>) -> PyResult<ChunkRows<'py>> {
        let rows = py.detach(|| self.directory.rows());
        let rows = rows.map_err(|e| refused(&e))?;
        let column = |k: usize| rows.cells.iter().map(|row| row[k].clone()).collect();
        let columns = (0..rows.names.len()).map(column).collect();
        Ok((rows.names, columns, PyBytes::new(py, &rows.csv)))
    }
}

/// The hooks of one chunk.
struct ChunkHooks<'a>(&'a Sweep);

impl Hooks for ChunkHooks<'_> {
    fn interrupted(&mut self) -> bool {
        self.0.stopped.load(Ordering::Relaxed)
    }

    fn progress(&mut self, _fraction: f64, _point: f64) {
        self.0.done.fetch_add(1, Ordering::Relaxed);
    }
}
