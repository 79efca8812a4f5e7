//! trajectory.csv.

use super::Refusal;
use super::files::exact;
use snaprod::dynamics::Sample;
use snaprod::elastica::chart::ChartPoint;
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

    /// Adds a row.
    pub fn row(&mut self, sample: &Sample<2>) -> csv::Result<()> {
        let k = &self.scales;
        let phase = &sample.phase;
        let ledger = &sample.ledger;
        let (p, w) = (phase.q[0], phase.q[1]);
        self.writer.write_record([
            exact(phase.t * k.time),
            exact(sample.pose[0] * k.length),
            exact(sample.pose[1] * k.length),
            exact(phase.v[0] * k.velocity),
            exact(phase.v[1] * k.velocity),
            exact(ChartPoint::new(p, w).integrals.lam),
            exact(p),
            exact(w),
            sample.sheet.mode.to_string(),
            sample.sheet.sign.as_str().to_owned(),
            sample.index.to_string(),
            exact(sample.force[0] * k.force),
            exact(sample.force[1] * k.force),
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
