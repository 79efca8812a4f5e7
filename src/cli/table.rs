//! trajectory.csv.

use super::files::exact;
use nalgebra::Vector2;
use snaprod::elastica::chart::ChartPoint;
use snaprod::manifold::Sheet;
use snaprod::motion::{Ledger, Sample};
use snaprod::scene::Scales;

/// The columns of a planar run, in the scene's units (lam, p, w, mode, sign and index are numbers).
pub const COLUMNS: [&str; 19] = [
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

impl Row {
    /// The columns; those that name an equilibrium are empty where there is none.
    pub fn cells(&self, k: &Scales) -> Vec<String> {
        let label =
            |text: &dyn Fn(&Labels) -> String| self.labels.as_ref().map_or(String::new(), text);
        let mut cells = vec![
            exact(self.t * k.time),
            exact(self.pose[0] * k.length),
            exact(self.pose[1] * k.length),
            exact(self.velocity[0] * k.velocity),
            exact(self.velocity[1] * k.velocity),
            label(&|l| exact(ChartPoint::new(l.q[0], l.q[1]).integrals.lam)),
            label(&|l| exact(l.q[0])),
            label(&|l| exact(l.q[1])),
            label(&|l| l.sheet.mode.to_string()),
            label(&|l| l.sheet.sign.as_str().to_owned()),
            label(&|l| l.index.to_string()),
            exact(self.force[0] * k.force),
            exact(self.force[1] * k.force),
        ];
        cells.extend(energies(&self.ledger, k.energy));
        cells
    }
}

/// The columns of the energies, in units of `scale`.
pub fn energies(ledger: &Ledger, scale: f64) -> [String; 6] {
    [
        ledger.kinetic,
        ledger.elastic,
        ledger.potential,
        ledger.dissipated,
        ledger.work,
        ledger.total(),
    ]
    .map(|energy| exact(energy * scale))
}
