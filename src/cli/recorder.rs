//! Watches a run: writes the table, keeps what the figures need, shows progress, heeds Ctrl-C.

use super::files::number;
use super::run::trajectory_name;
use super::table::Trajectory;
use super::{Refusal, RunArgs};
use indicatif::{ProgressBar, ProgressStyle};
use snaprod::dynamics::{Ledger, Observer, Outcome, Sample, Snap};
use snaprod::scene::{Scales, Scene};
use snaprod::solve::dop853::Work;
use std::io::IsTerminal;
use std::path::Path;
use std::sync::atomic::{AtomicBool, Ordering};
use std::time::{Duration, Instant};

/// Set by Ctrl-C; the runs look at it after every step. A process has one signal handler, hence the
/// one static of the program.
static INTERRUPTED: AtomicBool = AtomicBool::new(false);

/// Makes Ctrl-C end the run with what it has.
pub fn watch_interrupts() {
    // Without a handler Ctrl-C ends the program as usual: no reason to refuse the run.
    let _ = ctrlc::set_handler(|| {
        // The second one does not wait for the step, or the figures, to be done.
        if INTERRUPTED.swap(true, Ordering::Relaxed) {
            std::process::exit(1);
        }
    });
}

/// What is kept of one branch.
#[derive(Debug, Clone)]
pub struct Branch {
    /// Number, in the order in which the branches are run; 0 is the trunk.
    pub id: usize,
    /// The branch it forks from.
    pub parent: Option<usize>,
    /// The snap by which it was entered.
    pub entered: Option<Snap<2>>,
    /// Its first state.
    pub first: Sample<2>,
    /// Its last state.
    pub last: Sample<2>,
    /// How it ended.
    pub outcome: Outcome<2>,
    /// Its cost.
    pub work: Work,
    /// Its own snaps.
    pub snaps: Vec<Snap<2>>,
    /// Samples for the figures, thinned, with both sides of every snap.
    pub track: Vec<Sample<2>>,
    /// Largest term of the ledger.
    pub largest: f64,
    /// Largest change of the ledger's total since the start of the trunk, over all samples and snaps.
    pub error: f64,
}

impl Branch {
    /// A branch that consists of its first state.
    pub fn default_for(first: &Sample<2>) -> Self {
        Self {
            id: 0,
            parent: None,
            entered: None,
            first: *first,
            last: *first,
            outcome: Outcome::EndOfTime,
            work: Work::default(),
            snaps: Vec::new(),
            track: Vec::new(),
            largest: 0.0,
            error: 0.0,
        }
    }
}

/// Most samples kept for the figures; beyond, every second one is dropped.
const KEPT: usize = 4000;

/// The observer of one branch.
pub struct Recorder {
    table: Option<Trajectory>,
    bar: Option<ProgressBar>,
    shown: Instant,
    duration: f64,
    time_scale: f64,
    total: f64,
    snaps: Vec<Snap<2>>,
    track: Vec<Sample<2>>,
    stride: usize,
    seen: usize,
    largest: f64,
    error: f64,
}

impl Recorder {
    /// A recorder that writes to `out`, if anywhere; `total` is what the ledger should keep.
    pub fn new(
        args: &RunArgs,
        scene: &Scene,
        scales: Scales,
        out: Option<&Path>,
        id: usize,
        total: f64,
    ) -> Result<Self, Refusal> {
        let table = match out {
            Some(out) => Some(Trajectory::create(&out.join(trajectory_name(id)), scales)?),
            None => None,
        };
        let bar = (!args.quiet && !args.json && std::io::stderr().is_terminal()).then(|| {
            let style = ProgressStyle::with_template("{bar:40} t = {msg} of {prefix} [{eta} left]")
                .unwrap_or_else(|_| ProgressStyle::default_bar());
            ProgressBar::new(10_000)
                .with_style(style)
                .with_prefix(number(scene.run.duration))
        });
        Ok(Self {
            table,
            bar,
            shown: Instant::now(),
            duration: scene.run.duration,
            time_scale: scales.time,
            total,
            snaps: Vec::new(),
            track: Vec::new(),
            stride: 1,
            seen: 0,
            largest: 0.0,
            error: 0.0,
        })
    }

    /// Closes the table and hands over what was kept.
    pub fn finish(mut self, branch: Branch) -> Result<Branch, Refusal> {
        self.audit(&branch.first.ledger);
        self.audit(&branch.last.ledger);
        if let Some(bar) = &self.bar {
            bar.finish_and_clear();
        }
        if let Some(table) = self.table {
            table.finish()?;
        }
        Ok(Branch {
            snaps: self.snaps,
            track: self.track,
            largest: self.largest,
            error: self.error,
            ..branch
        })
    }

    /// Every state that is seen is audited, though not every one is kept.
    fn audit(&mut self, ledger: &Ledger) {
        self.largest = self.largest.max(ledger.largest());
        self.error = self.error.max((ledger.total() - self.total).abs());
    }

    fn keep(&mut self, sample: &Sample<2>) {
        self.track.push(*sample);
        if self.track.len() > KEPT {
            let mut odd = false;
            self.track.retain(|_| {
                odd = !odd;
                odd
            });
            self.stride *= 2;
        }
    }
}

impl Observer<2> for Recorder {
    fn sample(&mut self, sample: &Sample<2>) -> snaprod::Result<()> {
        if let Some(table) = &mut self.table {
            table
                .row(sample)
                .map_err(|e| snaprod::Error::io(format!("cannot write trajectory.csv: {e}")))?;
        }
        self.audit(&sample.ledger);
        if self.seen.is_multiple_of(self.stride) {
            self.keep(sample);
        }
        self.seen += 1;
        Ok(())
    }

    fn snap(
        &mut self,
        snap: &Snap<2>,
        before: &Sample<2>,
        after: &Sample<2>,
    ) -> snaprod::Result<()> {
        self.snaps.push(*snap);
        self.audit(&before.ledger);
        self.audit(&after.ledger);
        self.keep(before);
        self.keep(after);
        Ok(())
    }

    fn go_on(&mut self, time: f64) -> bool {
        if let Some(bar) = &self.bar
            && self.shown.elapsed() > Duration::from_millis(100)
        {
            self.shown = Instant::now();
            let now = time * self.time_scale;
            bar.set_position((1e4 * (now / self.duration)) as u64);
            bar.set_message(format!("{now:.4}"));
        }
        !INTERRUPTED.load(Ordering::Relaxed)
    }
}
