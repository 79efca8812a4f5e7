//! Progress of a run on the terminal.

use super::signals;
use snaprod::study::Hooks;
use std::io::IsTerminal;
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
