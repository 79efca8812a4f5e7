//! Watches a viscoelastic run: writes the tables, keeps what the figures need.

use super::super::progress::Progress;
use super::super::table::{Labels, Row, Trajectory};
use super::{Refusal, RunArgs, Sample, places, write_row};
use nalgebra::Vector2;
use snaprod::dynamics::Ledger;
use snaprod::dynamics::viscous::{ViscousObserver, near_equilibrium};
use snaprod::elastica::Elastica;
use snaprod::manifold::EquilibriumManifold;
use snaprod::scene::{Scales, Scene};
use snaprod::viscous::plane::Plane;
use std::fs::File;
use std::path::Path;

impl From<&Sample> for Row {
    fn from(sample: &Sample) -> Self {
        let labels = near_equilibrium(sample).and_then(|near| {
            let q = Vector2::new(near.p, near.w);
            Some(Labels {
                q,
                sheet: near.sheet,
                index: Elastica.index(&q).ok()?,
            })
        });
        Self {
            t: sample.t,
            pose: sample.pose,
            velocity: sample.velocity,
            labels,
            force: -sample.flow.wrench,
            ledger: sample.ledger,
        }
    }
}

/// One moment, for the figures.
#[derive(Debug, Clone)]
pub struct Moment {
    pub t: f64,
    pub pose: Vector2<f64>,
    pub ledger: Ledger,
    /// The rod's axis.
    pub curve: Vec<[f64; 2]>,
    /// Curvature and dissipation density at [`places`].
    pub strain: Vec<f64>,
    pub dissipation: Vec<f64>,
}

impl Moment {
    fn new(sample: &Sample) -> Self {
        let places = places();
        Self {
            t: sample.t,
            pose: sample.pose,
            ledger: sample.ledger,
            curve: sample.curve(CURVE),
            strain: sample.strains_at(&places).iter().map(|e| e[0]).collect(),
            dissipation: sample.dissipation_at(&places),
        }
    }
}

/// What is kept of a run.
#[derive(Debug, Default)]
pub struct Record {
    /// Even samples, thinned.
    pub track: Vec<Moment>,
    /// Ends of the steps of the passage through which the rod dissipated most, thinned.
    pub passage: Vec<Moment>,
    /// Largest term of the ledger.
    pub largest: f64,
    /// Largest change of its total.
    pub error: f64,
}

/// Points of a drawn axis.
const CURVE: usize = 60;
/// Most samples kept for the figures; beyond, every second one is dropped.
const KEPT: usize = 1200;
const KEPT_OF_PASSAGE: usize = 400;
/// A passage is kept while the rod is farther than this from equilibrium.
const AWAY: f64 = 1e-3;

/// The observer of a run.
pub struct Recorder {
    table: Option<Trajectory>,
    field: Option<csv::Writer<File>>,
    scales: Scales,
    progress: Progress,
    total: f64,
    record: Record,
    track: Thinned,
    passage: Vec<Moment>,
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

    fn push(&mut self, list: &mut Vec<Moment>, moment: impl FnOnce() -> Moment) {
        if self.seen.is_multiple_of(self.stride) {
            list.push(moment());
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

impl Recorder {
    /// A recorder that writes to `out`, if anywhere.
    pub fn new(
        args: &RunArgs,
        scene: &Scene,
        scales: Scales,
        out: Option<&Path>,
        first: &Sample,
    ) -> Result<Self, Refusal> {
        let table = out
            .map(|out| Trajectory::create(&out.join("trajectory.csv"), scales))
            .transpose()?;
        let field = out.map(|out| field(&out.join("strain.csv"))).transpose()?;
        Ok(Self {
            table,
            field,
            scales,
            progress: Progress::new(args, scene.run.duration, scales.time),
            total: first.ledger.total(),
            record: Record::default(),
            track: Thinned::new(KEPT),
            passage: Vec::new(),
            thinning: Thinned::new(KEPT_OF_PASSAGE),
        })
    }

    /// Closes the tables and hands over what was kept.
    pub fn finish(mut self) -> Result<Record, Refusal> {
        self.end_passage();
        self.progress.finish();
        if let Some(table) = self.table {
            table.finish()?;
        }
        if let Some(mut field) = self.field {
            field
                .flush()
                .map_err(|e| Refusal(format!("cannot finish strain.csv: {e}")))?;
        }
        Ok(self.record)
    }

    fn audit(&mut self, ledger: &Ledger) {
        self.record.largest = self.record.largest.max(ledger.largest());
        self.record.error = self.record.error.max((ledger.total() - self.total).abs());
    }

    /// Keeps the passage if more was dissipated in it than in those before.
    fn end_passage(&mut self) {
        let passage = std::mem::take(&mut self.passage);
        self.thinning = Thinned::new(KEPT_OF_PASSAGE);
        let lost = |passage: &[Moment]| match passage {
            [first, .., last] => last.ledger.dissipated - first.ledger.dissipated,
            _ => 0.0,
        };
        if lost(&passage) > lost(&self.record.passage) {
            self.record.passage = passage;
        }
    }
}

fn field(path: &Path) -> Result<csv::Writer<File>, Refusal> {
    let refuse = |e| Refusal(format!("cannot write {}: {e}", path.display()));
    let mut writer = csv::Writer::from_path(path).map_err(refuse)?;
    writer
        .write_record(["t", "s", "curvature", "dissipation"])
        .map_err(refuse)?;
    Ok(writer)
}

impl ViscousObserver<Plane, 1, 2> for Recorder {
    fn sample(&mut self, sample: &Sample) -> snaprod::Result<()> {
        let refuse = |name: &str, e| snaprod::Error::io(format!("cannot write {name}: {e}"));
        if let Some(table) = &mut self.table {
            table
                .row(&sample.into())
                .map_err(|e| refuse("trajectory.csv", e))?;
        }
        self.audit(&sample.ledger);
        let moment = Moment::new(sample);
        if let Some(field) = &mut self.field {
            let k = &self.scales;
            let density = k.energy / k.length / k.time;
            let columns = moment.strain.iter().zip(&moment.dissipation);
            for (s, (strain, dissipation)) in places().iter().zip(columns) {
                let row = [
                    sample.t * k.time,
                    s * k.length,
                    strain / k.length,
                    dissipation * density,
                ];
                write_row(field, row).map_err(|e| refuse("strain.csv", e))?;
            }
        }
        self.track.push(&mut self.record.track, || moment);
        Ok(())
    }

    fn step(&mut self, sample: &Sample) -> snaprod::Result<()> {
        self.audit(&sample.ledger);
        if sample.distance() > AWAY {
            self.thinning
                .push(&mut self.passage, || Moment::new(sample));
        } else if !self.passage.is_empty() {
            self.end_passage();
        }
        Ok(())
    }

    fn go_on(&mut self, time: f64) -> bool {
        self.progress.go_on(time)
    }
}
