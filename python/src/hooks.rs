//! Ctrl-C and progress while Rust works without the lock of the interpreter.

use crate::convert::{self, refused};
use crate::loads::Raised;
use pyo3::prelude::*;
use pyo3::types::PyDict;
use snaprod::study::{Cell, Column, Hooks};
use std::sync::mpsc::{RecvTimeoutError, channel};
use std::time::{Duration, Instant};

/// Interval between calls of Python.
pub const EVERY: Duration = Duration::from_millis(50);

/// Checks Python for signals, and reports progress.
pub struct Watch {
    /// Called with the fraction done and the time or parameter reached.
    progress: Option<Py<PyAny>>,
    /// Called with every sample of a run, a dict by the names of the columns.
    on_sample: Option<Py<PyAny>>,
    /// Called with every event of a run, a dict.
    on_event: Option<Py<PyAny>>,
    /// The exception of a function that acts as a load.
    loads: Raised,
    asked: Instant,
    fraction: f64,
    at: f64,
    raised: Option<PyErr>,
}

impl Watch {
    pub fn new(progress: Option<Py<PyAny>>) -> Self {
        Self {
            progress,
            on_sample: None,
            on_event: None,
            loads: Raised::default(),
            asked: Instant::now(),
            fraction: 0.0,
            at: 0.0,
            raised: None,
        }
    }

    /// Adds functions of Python that are called with each sample and each event of a run.
    pub fn hearing(mut self, on_sample: Option<Py<PyAny>>, on_event: Option<Py<PyAny>>) -> Self {
        (self.on_sample, self.on_event) = (on_sample, on_event);
        self
    }

    /// Ends the work when a function that acts as a load has raised.
    pub fn under(mut self, loads: Raised) -> Self {
        self.loads = loads;
        self
    }

    /// Calls a function of Python, unless one has raised before.
    fn call(&mut self, call: impl FnOnce(Python<'_>, &Self) -> PyResult<()>) {
        if self.raised.is_some() {
            return;
        }
        if let Err(e) = Python::attach(|py| call(py, self)) {
            self.raised.get_or_insert(e);
        }
    }

    /// Checks for signals and reports progress.
    fn ask(&mut self) {
        self.asked = Instant::now();
        let asked = Python::attach(|py| {
            py.check_signals()?;
            match &self.progress {
                Some(progress) => progress.call1(py, (self.fraction, self.at)).map(|_| ()),
                None => Ok(()),
            }
        });
        if let Err(e) = asked {
            self.raised.get_or_insert(e);
        }
    }

    /// An exception raised by Python during the work, without a last check for signals: for very short work.
    pub fn raised(self) -> PyResult<()> {
        self.loads.or(self.raised.map_or(Ok(()), Err))
    }

    /// An exception raised by Python during the work, such as KeyboardInterrupt. Work shorter than EVERY has not
    /// checked before.
    pub fn finish(mut self) -> PyResult<()> {
        if self.raised.is_none() {
            self.ask();
        }
        self.raised()
    }
}

impl Hooks for Watch {
    fn interrupted(&mut self) -> bool {
        if self.raised.is_none() && self.asked.elapsed() > EVERY {
            self.ask();
        }
        self.raised.is_some() || self.loads.is_there()
    }

    fn progress(&mut self, fraction: f64, at: f64) {
        (self.fraction, self.at) = (fraction, at);
    }

    fn sample(&mut self, columns: &[Column], row: &[Cell]) {
        if self.on_sample.is_none() {
            return;
        }
        self.call(|py, watch| {
            let sample = PyDict::new(py);
            for (column, cell) in columns.iter().zip(row) {
                sample.set_item(&column.name, convert::cell(py, cell)?)?;
            }
            let mut heard = watch.on_sample.iter();
            heard.try_for_each(|f| f.call1(py, (&sample,)).map(drop))
        });
    }

    fn hears_events(&self) -> bool {
        self.on_event.is_some()
    }

    fn event(&mut self, event: serde_json::Value) {
        self.call(|py, watch| {
            let event = convert::value(py, &event)?;
            let mut heard = watch.on_event.iter();
            heard.try_for_each(|f| f.call1(py, (&event,)).map(drop))
        });
    }
}

/// Runs work without hooks on a thread of its own, so that Ctrl-C is noticed; interrupted work continues, and its
/// result is discarded.
pub fn aside<T: Send + 'static>(
    py: Python<'_>,
    work: impl FnOnce() -> snaprod::Result<T> + Send + 'static,
) -> PyResult<T> {
    let (done, mut result) = channel();
    std::thread::spawn(move || {
        // After an interrupt no receiver is left.
        let _ = done.send(work());
    });
    loop {
        let (come, waiting) = py.detach(move || (result.recv_timeout(EVERY), result));
        result = waiting;
        match come {
            Ok(found) => {
                py.check_signals()?;
                return found.map_err(|e| refused(&e));
            }
            Err(RecvTimeoutError::Timeout) => py.check_signals()?,
            Err(RecvTimeoutError::Disconnected) => {
                return Err(refused(&snaprod::Error::no_convergence(
                    "the computation ended without a result",
                )));
            }
        }
    }
}
