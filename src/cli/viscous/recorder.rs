//! Watches a viscoelastic run: writes the tables, keeps what the figures need.

use super::super::files::exact;
use super::super::output::Table;
use super::super::progress::Progress;
use super::{Kind, Refusal, Task, places};
use snaprod::creep::kinematics::Kinematics;
use snaprod::motion::Ledger;
use snaprod::motion::creep::{ViscousObserver, ViscousSample};

/// One moment, for the figures, in the scene's units.
#[derive(Debug, Clone)]
pub struct Moment<S> {
    pub t: f64,
    pub ledger: Ledger,
    pub shape: S,
    /// The strains that move and the dissipation density at [`places`].
    pub strains: Vec<Vec<f64>>,
    pub dissipation: Vec<f64>,
}

/// What is kept of a run.
pub struct Record<K: Kind> {
    /// Even samples, thinned.
    pub track: Vec<Moment<K::Shape>>,
    /// Ends of the steps of the passage through which the rod dissipated most, thinned.
    pub passage: Vec<Moment<K::Shape>>,
    /// Time and axis of a few even samples.
    pub axes: Vec<(f64, K::Axis)>,
    /// Largest term of the ledger.
    pub largest: f64,
    /// Largest change of its total.
    pub error: f64,
    /// Dissipated at the end.
    pub dissipated: f64,
}

/// Most samples kept for the figures; beyond, every second one is dropped.
const KEPT: usize = 1200;
const KEPT_OF_PASSAGE: usize = 400;
const AXES: usize = 10;
/// A passage is kept while the rod is farther than this from equilibrium.
const AWAY: f64 = 1e-3;

/// The observer of a run.
pub struct Recorder<'k, K: Kind> {
    kind: &'k K,
    table: Table,
    field: Table,
    progress: Progress,
    places: Vec<f64>,
    length: f64,
    total: f64,
    record: Record<K>,
    track: Thinned,
    axes: Thinned,
    passage: Vec<Moment<K::Shape>>,
    thinning: Thinned,
}

/// Keeps every so many of a list.
struct Thinned {
    stride: usize,
    seen: usize,
    most: usize,
}

impl Thinned {
    fn new(most: usize) -> Self {
        Self {
            stride: 1,
            seen: 0,
            most,
        }
    }

    fn push<T>(&mut self, list: &mut Vec<T>, item: impl FnOnce() -> T) {
        if self.seen.is_multiple_of(self.stride) {
            list.push(item());
            if list.len() > self.most {
                let mut odd = false;
                list.retain(|_| {
                    odd = !odd;
                    odd
                });
                self.stride *= 2;
            }
        }
        self.seen += 1;
    }
}

impl<'k, K: Kind> Recorder<'k, K> {
    /// A recorder of a run that begins at `first`.
    pub fn new(kind: &'k K, task: &Task, first: &K::Sample) -> Result<Self, Refusal> {
        let table = task.out.table("trajectory.csv", K::COLUMNS)?;
        let strains = kind.strain_names();
        let columns = [&["t", "s"], strains.as_slice(), &["dissipation"]].concat();
        let field = task.out.table("strain.csv", &columns)?;
        let total = kind.ledger(first).1.total();
        Ok(Self {
            kind,
            table,
            field,
            progress: Progress::new(task.args, task.duration, task.scales.time),
            places: places(),
            length: task.scales.length,
            total,
            record: Record {
                track: Vec::new(),
                passage: Vec::new(),
                axes: Vec::new(),
                largest: 0.0,
                error: 0.0,
                dissipated: 0.0,
            },
            track: Thinned::new(KEPT),
            axes: Thinned::new(AXES),
            passage: Vec::new(),
            thinning: Thinned::new(KEPT_OF_PASSAGE),
        })
    }

    /// Closes the tables and hands over what was kept; `last` is the last state.
    pub fn finish(mut self, last: &K::Sample) -> Result<Record<K>, Refusal> {
        self.end_passage();
        self.end_axes(last);
        self.progress.finish();
        self.table.finish()?;
        self.field.finish()?;
        Ok(self.record)
    }

    /// Writes and keeps one of the evenly spaced samples.
    pub fn take(&mut self, sample: &K::Sample) -> snaprod::Result<()> {
        self.table.row(&self.kind.row(sample))?;
        self.audit(sample);
        let moment = self.moment(sample);
        for (i, s) in self.places.iter().enumerate() {
            let strains = moment.strains.iter().map(|strain| strain[i]);
            let row = [moment.t, s * self.length]
                .into_iter()
                .chain(strains)
                .chain([moment.dissipation[i]]);
            self.field.row(&row.map(exact).collect::<Vec<_>>())?;
        }
        let axis = || (moment.t, self.kind.axis(sample));
        self.axes.push(&mut self.record.axes, axis);
        self.track.push(&mut self.record.track, || moment);
        Ok(())
    }

    /// Shows the time, in the run's units; false if the run is to be interrupted.
    pub fn go_on(&mut self, time: f64) -> bool {
        self.progress.go_on(time)
    }

    fn moment(&self, sample: &K::Sample) -> Moment<K::Shape> {
        let (t, ledger) = self.kind.ledger(sample);
        Moment {
            t,
            ledger,
            shape: self.kind.shape(sample),
            strains: self.kind.strains(sample, &self.places),
            dissipation: self.kind.dissipation(sample, &self.places),
        }
    }

    fn audit(&mut self, sample: &K::Sample) {
        let (_, ledger) = self.kind.ledger(sample);
        let record = &mut self.record;
        record.largest = record.largest.max(ledger.largest());
        record.error = record.error.max((ledger.total() - self.total).abs());
        record.dissipated = ledger.dissipated;
    }

    /// The last axis in its place, or instead of one that is near in time.
    fn end_axes(&mut self, last: &K::Sample) {
        let (t, axes) = (self.kind.ledger(last).0, &mut self.record.axes);
        if let [.., (before, _), (near, _)] = axes.as_slice()
            && t - near < 0.5 * (near - before)
        {
            axes.pop();
        }
        axes.push((t, self.kind.axis(last)));
    }

    /// Keeps the passage if more was dissipated in it than in those before.
    fn end_passage(&mut self) {
        let passage = std::mem::take(&mut self.passage);
        self.thinning = Thinned::new(KEPT_OF_PASSAGE);
        let lost = |passage: &[Moment<K::Shape>]| match passage {
            [first, .., last] => last.ledger.dissipated - first.ledger.dissipated,
            _ => 0.0,
        };
        if lost(&passage) > lost(&self.record.passage) {
            self.record.passage = passage;
        }
    }
}

impl<R, K, const M: usize, const D: usize> ViscousObserver<R, M, D> for Recorder<'_, K>
where
    R: Kinematics<M, D>,
    K: Kind<Sample = ViscousSample<R, M, D>>,
{
    fn sample(&mut self, sample: &K::Sample) -> snaprod::Result<()> {
        self.take(sample)
    }

    fn step(&mut self, sample: &K::Sample) -> snaprod::Result<()> {
        self.audit(sample);
        if !K::PASSAGE {
            return Ok(());
        }
        if self.kind.distance(sample) > AWAY {
            let mut passage = std::mem::take(&mut self.passage);
            let mut thinning = std::mem::replace(&mut self.thinning, Thinned::new(0));
            thinning.push(&mut passage, || self.moment(sample));
            (self.passage, self.thinning) = (passage, thinning);
        } else if !self.passage.is_empty() {
            self.end_passage();
        }
        Ok(())
    }

    fn go_on(&mut self, time: f64) -> bool {
        self.go_on(time)
    }
}
