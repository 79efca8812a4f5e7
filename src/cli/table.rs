//! trajectory.csv.

use super::Refusal;
use super::files::exact;
use nalgebra::Vector2;
use snaprod::dynamics::{Ledger, Sample};
use snaprod::elastica::chart::ChartPoint;
use snaprod::manifold::Sheet;
use snaprod::scene::Scales;
use std::fs::File;
use std::path::Path;

/// The columns, in the scene's units (lam, p, w, mode, sign and index are numbers).
const COLUMNS: [&str; 19] = [
    "t",
    "x",
    "y",
    "vx",
    "vy",
    "lam",
    "p",
    "w",
    "mode",
    "sign",
    "index",
    "fx",
    "fy",
    "kinetic",
    "elastic",
    "potential",
    "dissipated",
    "work",
    "total",
];

/// A state of a planar run, elastic or viscoelastic, in the run's units.
pub struct Row {
    /// Time.
    pub t: f64,
    /// Position of the body.
    pub pose: Vector2<f64>,
    /// Velocity of the body.
    pub velocity: Vector2<f64>,
    /// The equilibrium that the rod is in, or near.
    pub labels: Option<Labels>,
    /// Force of the rod on the body.
    pub force: Vector2<f64>,
    /// Energies.
    pub ledger: Ledger,
}

/// What names an equilibrium.
pub struct Labels {
    /// (p, w).
    pub q: Vector2<f64>,
    /// Its sheet.
    pub sheet: Sheet,
    /// Its Morse index.
    pub index: usize,
}

impl From<&Sample<2>> for Row {
    fn from(sample: &Sample<2>) -> Self {
        Self {
            t: sample.phase.t,
            pose: sample.pose,
            velocity: sample.phase.v,
            labels: Some(Labels {
                q: sample.phase.q,
                sheet: sample.sheet,
                index: sample.index,
            }),
            force: sample.force,
            ledger: sample.ledger,
        }
    }
}

/// A trajectory being written, row by row.
pub struct Trajectory {
    writer: csv::Writer<File>,
    scales: Scales,
}

impl Trajectory {
    /// Starts the file.
    pub fn create(path: &Path, scales: Scales) -> Result<Self, Refusal> {
        let refuse = |e| Refusal(format!("cannot write {}: {e}", path.display()));
        let mut writer = csv::Writer::from_path(path).map_err(refuse)?;
        writer.write_record(COLUMNS).map_err(refuse)?;
        Ok(Self { writer, scales })
    }

    /// Adds a row; the columns that name an equilibrium are empty where there is none.
    pub fn row(&mut self, row: &Row) -> csv::Result<()> {
        let k = &self.scales;
        let ledger = &row.ledger;
        let label =
            |text: &dyn Fn(&Labels) -> String| row.labels.as_ref().map_or(String::new(), text);
        self.writer.write_record([
            exact(row.t * k.time),
            exact(row.pose[0] * k.length),
            exact(row.pose[1] * k.length),
            exact(row.velocity[0] * k.velocity),
            exact(row.velocity[1] * k.velocity),
            label(&|l| exact(ChartPoint::new(l.q[0], l.q[1]).integrals.lam)),
            label(&|l| exact(l.q[0])),
            label(&|l| exact(l.q[1])),
            label(&|l| l.sheet.mode.to_string()),
            label(&|l| l.sheet.sign.as_str().to_owned()),
            label(&|l| l.index.to_string()),
            exact(row.force[0] * k.force),
            exact(row.force[1] * k.force),
            exact(ledger.kinetic * k.energy),
            exact(ledger.elastic * k.energy),
            exact(ledger.potential * k.energy),
            exact(ledger.dissipated * k.energy),
            exact(ledger.work * k.energy),
            exact(ledger.total() * k.energy),
        ])
    }

    /// Makes sure that all rows are in the file.
    pub fn finish(mut self) -> Result<(), Refusal> {
        self.writer
            .flush()
            .map_err(|e| Refusal(format!("cannot finish trajectory.csv: {e}")))
    }
}
