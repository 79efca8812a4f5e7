//! Progress of a run on the terminal.

use super::signals;
use indicatif::{ProgressBar, ProgressDrawTarget, ProgressStyle};
use snaprod::study::Hooks;
use std::io::IsTerminal;
use std::sync::atomic::{AtomicUsize, Ordering};

/// Length of the bar, in its own units.
const LENGTH: u64 = 1_000_000;
/// Pictures of the bar a second.
const RATE: u8 = 10;

/// A progress bar on a terminal; signals interrupt the study.
pub struct Progress {
    bar: ProgressBar,
    drawn: bool,
}

impl Progress {
    /// Shows a bar if `wanted` and standard error is a terminal.
    pub fn new(wanted: bool) -> Self {
        let target = if wanted && std::io::stderr().is_terminal() {
            ProgressDrawTarget::stderr_with_hz(RATE)
        } else {
            ProgressDrawTarget::hidden()
        };
        let bar = ProgressBar::with_draw_target(Some(LENGTH), target);
        let style = ProgressStyle::with_template("{bar:40} at {msg} [{eta} left]");
        Self {
            bar: match style {
                Ok(style) => bar.with_style(style.progress_chars("█░")),
                Err(_) => bar,
            },
            drawn: false,
        }
    }

    /// Sets whether the record follows the motion more closely than the samples, for figures.
    pub fn of_drawn(self, drawn: bool) -> Self {
        Self { drawn, ..self }
    }

    /// Removes the bar.
    pub fn finish(&self) {
        self.bar.finish_and_clear();
    }

    /// Shows the fraction done, and the time or the parameter reached.
    fn show(&self, fraction: f64, at: f64) {
        self.bar.set_message(format!("{at:.4}"));
        self.bar
            .set_position((LENGTH as f64 * fraction.clamp(0.0, 1.0)) as u64);
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
        if !self.bar.is_hidden() {
            self.show(fraction, at);
        }
    }
}

/// Count of the completed pieces of a study, over all threads.
pub struct Tally {
    done: AtomicUsize,
    all: usize,
    progress: Progress,
}

impl Tally {
    /// Count 0 of `all`; shows a bar if `wanted`.
    pub fn new(all: usize, wanted: bool) -> Self {
        Self {
            done: AtomicUsize::new(0),
            all,
            progress: Progress::new(wanted),
        }
    }

    /// Counts a completed piece.
    pub fn count(&self) {
        let done = self.done.fetch_add(1, Ordering::Relaxed) + 1;
        if !self.progress.bar.is_hidden() {
            self.progress
                .show(done as f64 / self.all as f64, done as f64);
        }
    }

    /// Removes the bar.
    pub fn finish(&self) {
        self.progress.finish();
    }
}
