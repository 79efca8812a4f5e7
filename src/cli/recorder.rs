//! Watches a run: writes the table, keeps what the figures need.

use super::Refusal;
use super::output::{Output, Table};
use super::progress::Progress;
use super::run::{RunArgs, trajectory_name};
use super::table::{COLUMNS, Row};
use snaprod::motion::{Ledger, Observer, Outcome, Sample, Snap};
use snaprod::scene::{Scales, Scene};
use snaprod::solve::dop853::Work;

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
    table: Table,
    scales: Scales,
    progress: Progress,
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
        out: &Output,
        id: usize,
        total: f64,
    ) -> Result<Self, Refusal> {
        let table = out.table(&trajectory_name(id), &COLUMNS)?;
        Ok(Self {
            table,
            scales,
            progress: Progress::new(args, scene.run()?.duration, scales.time),
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
        self.progress.finish();
        self.table.finish()?;
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
        self.table.row(&Row::from(sample).cells(&self.scales))?;
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
        self.progress.go_on(time)
    }
}
