//! The least and the greatest of what a run's trajectory has: `least.y` and `greatest.y` of its column `y`.

use crate::error::Result;
use crate::scene::Scene;
use crate::study::{Cell, Sink, Table, Values};
use serde_json::{Map, Value};

/// What comes before the name of a column of the trajectory.
pub const LEAST: &str = "least";
pub const GREATEST: &str = "greatest";
/// A run is looked at this often at least: where it is written at its ends alone, its peaks lie between.
const LOOKS: usize = 400;

/// True if a quantity is an extreme along the run.
pub fn is_extreme(path: &str) -> bool {
    let first = path.split_once('.').map(|(first, _)| first);
    first == Some(LEAST) || first == Some(GREATEST)
}

/// How often a scene is to be looked at for extremes; a stroboscopic section has its own times.
pub fn looked_at(scene: &mut Scene) {
    if let Some(run) = &mut scene.run
        && run.strobe.is_none()
    {
        run.samples = run.samples.max(LOOKS);
    }
    if let Some(bar) = &mut scene.bar {
        bar.samples = bar.samples.max(LOOKS);
    }
}

/// A sink that keeps the extremes of the trajectory, of several branches that of the first.
#[derive(Default)]
pub struct Extremes {
    begun: usize,
    /// The trajectory, without rows, and its number.
    trajectory: Option<(usize, Table)>,
    /// Least and greatest of each column; NaN of one without numbers.
    ranges: Vec<[f64; 2]>,
}

impl Sink for Extremes {
    fn begin(&mut self, table: Table) -> Result<usize> {
        let number = self.begun;
        self.begun += 1;
        if table.name == "trajectory" {
            self.ranges = vec![[f64::NAN; 2]; table.columns.len()];
            self.trajectory = Some((number, table));
        }
        Ok(number)
    }

    fn row(&mut self, table: usize, cells: &[Cell]) -> Result<()> {
        if self
            .trajectory
            .as_ref()
            .is_some_and(|(own, _)| *own == table)
        {
            for ([least, greatest], cell) in self.ranges.iter_mut().zip(cells) {
                let x = match cell {
                    Cell::Real(x) => *x,
                    Cell::Integer(n) => *n as f64,
                    Cell::Word(_) | Cell::Missing => continue,
                };
                // What is no number is neither.
                (*least, *greatest) = (least.min(x), greatest.max(x));
            }
        }
        Ok(())
    }
}

impl Extremes {
    /// Puts them into a summary, a table within a table for each part of a name: `greatest.crown.z`.
    pub fn put_into(self, summary: &mut Value) {
        let Some((_, table)) = self.trajectory else {
            return;
        };
        for (k, name) in [LEAST, GREATEST].into_iter().enumerate() {
            let mut all = Value::Object(Map::new());
            for (column, range) in table.columns.iter().zip(&self.ranges) {
                let mut at = &mut all;
                for step in column.name.split('.') {
                    at = &mut at[step];
                }
                *at = match column.values {
                    Values::Reals(_) => range[k].into(),
                    // Whole numbers were read from such.
                    Values::Integers(_) if range[k].is_finite() => (range[k] as i64).into(),
                    Values::Integers(_) | Values::Words(_) => Value::Null,
                };
            }
            summary[name] = all;
        }
    }
}
