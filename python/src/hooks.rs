//! Ctrl-C and progress while Rust works without the lock of the interpreter.

use crate::convert::refused;
use pyo3::prelude::*;
use snaprod::study::Hooks;
use std::sync::mpsc::{RecvTimeoutError, channel};
use std::time::{Duration, Instant};

/// Interval between calls of Python.
pub const EVERY: Duration = Duration::from_millis(50);

/// Checks Python for signals, and reports progress.
pub struct Watch {
    /// Called with the fraction done and the time or parameter reached.
    progress: Option<Py<PyAny>>,
    asked: Instant,
    fraction: f64,
    at: f64,
    raised: Option<PyErr>,
}

impl Watch {
    pub fn new(progress: Option<Py<PyAny>>) -> Self {
        Self {
            progress,
            asked: Instant::now(),
            fraction: 0.0,
            at: 0.0,
            raised: None,
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

    /// An exception raised by Python during the work, such as KeyboardInterrupt. Work shorter than EVERY has not
    /// checked before.
    pub fn finish(mut self) -> PyResult<()> {
        if self.raised.is_none() {
            self.ask();
        }
        self.raised.map_or(Ok(()), Err)
    }
}

impl Hooks for Watch {
    fn interrupted(&mut self) -> bool {
        if self.raised.is_none() && self.asked.elapsed() > EVERY {
            self.ask();
        }
        self.raised.is_some()
    }

    fn progress(&mut self, fraction: f64, at: f64) {
        (self.fraction, self.at) = (fraction, at);
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
