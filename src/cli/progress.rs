//! Progress of a run on the terminal.

use super::files::number;
use super::run::RunArgs;
use super::signals;
use indicatif::{ProgressBar, ProgressStyle};
use std::io::IsTerminal;
use std::time::{Duration, Instant};

/// A bar that shows how far a run is.
pub struct Progress {
    bar: Option<ProgressBar>,
    shown: Instant,
    duration: f64,
    time_scale: f64,
}

impl Progress {
    /// The bar of a run of this duration in the scene's units, if anybody can see it; the run's own times are to be
    /// multiplied by `time_scale`.
    pub fn new(args: &RunArgs, duration: f64, time_scale: f64) -> Self {
        let seen = !args.quiet && !args.json && std::io::stderr().is_terminal();
        Self {
            bar: seen.then(|| {
                let style =
                    ProgressStyle::with_template("{bar:40} t = {msg} of {prefix} [{eta} left]")
                        .unwrap_or_else(|_| ProgressStyle::default_bar());
                ProgressBar::new(10_000)
                    .with_style(style)
                    .with_prefix(number(duration))
            }),
            shown: Instant::now(),
            duration,
            time_scale,
        }
    }

    /// Shows the time; false if the run is to be interrupted.
    pub fn go_on(&mut self, time: f64) -> bool {
        if let Some(bar) = &self.bar
            && self.shown.elapsed() > Duration::from_millis(100)
        {
            self.shown = Instant::now();
            let now = time * self.time_scale;
            bar.set_position((1e4 * (now / self.duration)) as u64);
            bar.set_message(format!("{now:.4}"));
        }
        !signals::interrupted()
    }

    /// Takes the bar away.
    pub fn finish(&self) {
        if let Some(bar) = &self.bar {
            bar.finish_and_clear();
        }
    }
}
