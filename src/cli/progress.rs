//! Progress of a run on the terminal.

use super::signals;
use snaprod::study::Hooks;
use std::io::IsTerminal;
use std::sync::Mutex;
use std::sync::atomic::{AtomicUsize, Ordering};
use std::time::{Duration, Instant};

/// Length of the bar, in characters.
const BAR: usize = 40;
/// Escape sequence: to the start of the line, and clear the line.
const CLEAR: &str = "\r\x1b[2K";

/// A progress bar on a terminal; signals interrupt the study.
pub struct Progress {
    seen: bool,
    begun: Instant,
    shown: Instant,
    drawn: bool,
}

impl Progress {
    /// Shows a bar if `wanted` and standard error is a terminal.
    pub fn new(wanted: bool) -> Self {
        let now = Instant::now();
        Self {
            seen: wanted && std::io::stderr().is_terminal(),
            begun: now,
            shown: now,
            drawn: false,
        }
    }

    /// Sets whether the record follows the motion more closely than the samples, for figures.
    pub fn of_drawn(self, drawn: bool) -> Self {
        Self { drawn, ..self }
    }

    /// Removes the bar.
    pub fn finish(&self) {
        if self.seen {
            eprint!("{CLEAR}");
        }
    }
}

impl Hooks for Progress {
    fn interrupted(&mut self) -> bool {
        signals::interrupted()
    }

    fn pictures(&mut self) -> usize {
        usize::from(self.drawn)
    }

    fn progress(&mut self, fraction: f64, at: f64) {
        if !self.seen || self.shown.elapsed() <= Duration::from_millis(100) {
            return;
        }
        self.shown = Instant::now();
        let done = fraction.clamp(1e-6, 1.0);
        let full = (BAR as f64 * done) as usize;
        let bar = "█".repeat(full) + &"░".repeat(BAR - full);
        let left = self.begun.elapsed().as_secs_f64() * (1.0 / done - 1.0);
        eprint!("{CLEAR}{bar} at {at:.4} [{left:.0} s left]");
    }
}

/// Count of the completed pieces of a study, over all threads.
pub struct Tally {
    done: AtomicUsize,
    all: usize,
    progress: Mutex<Progress>,
}

impl Tally {
    /// Count 0 of `all`; shows a bar if `wanted`.
    pub fn new(all: usize, wanted: bool) -> Self {
        Self {
            done: AtomicUsize::new(0),
            all,
            progress: Mutex::new(Progress::new(wanted)),
        }
    }

    /// Counts a completed piece.
    pub fn count(&self) {
        let done = self.done.fetch_add(1, Ordering::Relaxed) + 1;
        // If another thread holds the lock, that thread updates the bar.
        if let Ok(mut progress) = self.progress.try_lock() {
            progress.progress(done as f64 / self.all as f64, done as f64);
        }
    }

    /// Removes the bar.
    pub fn finish(&self) {
        if let Ok(progress) = self.progress.lock() {
            progress.finish();
        }
    }
}
