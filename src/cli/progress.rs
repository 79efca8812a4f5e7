//! Progress of a run on the terminal.

use super::signals;
use snaprod::study::Hooks;
use std::io::IsTerminal;
use std::sync::Mutex;
use std::sync::atomic::{AtomicUsize, Ordering};
use std::time::{Duration, Instant};

/// Length of the bar, in characters.
const BAR: usize = 40;
/// To the start of the line, which is emptied.
const CLEAR: &str = "\r\x1b[2K";

/// A bar that shows how far a study is, if anybody can see it; signals interrupt the study.
pub struct Progress {
    seen: bool,
    begun: Instant,
    shown: Instant,
    drawn: bool,
}

impl Progress {
    /// A bar, if it is wanted and standard error is a terminal.
    pub fn new(wanted: bool) -> Self {
        let now = Instant::now();
        Self {
            seen: wanted && std::io::stderr().is_terminal(),
            begun: now,
            shown: now,
            drawn: false,
        }
    }

    /// For a run whose motion is drawn, or not.
    pub fn of_drawn(self, drawn: bool) -> Self {
        Self { drawn, ..self }
    }

    /// Takes the bar away.
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

/// How many of a study's pieces all threads together have done.
pub struct Tally {
    done: AtomicUsize,
    all: usize,
    progress: Mutex<Progress>,
}

impl Tally {
    /// None yet of `all`; with a bar, if it is wanted.
    pub fn new(all: usize, wanted: bool) -> Self {
        Self {
            done: AtomicUsize::new(0),
            all,
            progress: Mutex::new(Progress::new(wanted)),
        }
    }

    /// One more is done.
    pub fn count(&self) {
        let done = self.done.fetch_add(1, Ordering::Relaxed) + 1;
        // Another thread shows it already.
        if let Ok(mut progress) = self.progress.try_lock() {
            progress.progress(done as f64 / self.all as f64, done as f64);
        }
    }

    /// Takes the bar away.
    pub fn finish(&self) {
        if let Ok(progress) = self.progress.lock() {
            progress.finish();
        }
    }
}
