//! Progress of a run on the terminal.

use super::signals;
use indicatif::{ProgressBar, ProgressStyle};
use snaprod::study::Hooks;
use std::io::IsTerminal;
use std::time::{Duration, Instant};

/// A bar that shows how far a study is, if anybody can see it; signals interrupt the study.
pub struct Progress {
    bar: Option<ProgressBar>,
    shown: Instant,
}

impl Progress {
    /// A bar, if it is wanted and standard error is a terminal.
    pub fn new(wanted: bool) -> Self {
        let style = || {
            ProgressStyle::with_template("{bar:40} at {msg} [{eta} left]")
                .unwrap_or_else(|_| ProgressStyle::default_bar())
        };
        let seen = wanted && std::io::stderr().is_terminal();
        Self {
            bar: seen.then(|| ProgressBar::new(10_000).with_style(style())),
            shown: Instant::now(),
        }
    }

    /// Takes the bar away.
    pub fn finish(&self) {
        if let Some(bar) = &self.bar {
            bar.finish_and_clear();
        }
    }
}

impl Hooks for Progress {
    fn interrupted(&mut self) -> bool {
        signals::interrupted()
    }

    fn progress(&mut self, fraction: f64, at: f64) {
        if let Some(bar) = &self.bar
            && self.shown.elapsed() > Duration::from_millis(100)
        {
            self.shown = Instant::now();
            bar.set_position((1e4 * fraction) as u64);
            bar.set_message(format!("{at:.4}"));
        }
    }
}
