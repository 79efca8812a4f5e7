//! Extremes of trajectory columns of a run: `least.y` and `greatest.y` for column `y`.

use crate::error::Result;
use crate::scene::Scene;
use crate::study::{Cell, Sink, Table, Values};
use serde_json::{Map, Value};

/// Prefixes of the name of a trajectory column.
pub const LEAST: &str = "least";
pub const GREATEST: &str = "greatest";
/// Smallest number of samples for extremes: a trajectory written at its ends only would miss the peaks.
const LOOKS: usize = 400;

/// True if a quantity is an extreme of the trajectory.
pub fn is_extreme(path: &str) -> bool {
    let first = path.split_once('.').map(|(first, _)| first);
    first == Some(LEAST) || first == Some(GREATEST)
}

/// Raises the number of samples of a scene for extremes; a stroboscopic section keeps its own times.
pub fn looked_at(scene: &mut Scene) {
    if let Some(run) = &mut scene.run
        && run.strobe.is_none()
    {
        run.samples = run.samples.max(LOOKS);
    }
    if let Some(bar) = scene.bar_mut() {
        bar.samples = bar.samples.max(LOOKS);
    }
}

/// A sink that stores the extremes of the first trajectory.
#[derive(Default)]
pub struct Extremes {
    begun: usize,
    /// Trajectory without rows, and its table number.
    trajectory: Option<(usize, Table)>,
    /// Least and greatest of each column; NaN without numbers.
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
                // NaN leaves both unchanged.
                (*least, *greatest) = (least.min(x), greatest.max(x));
            }
        }
        Ok(())
    }
}

impl Extremes {
    /// Inserts the extremes into a summary, as nested tables by the parts of a name: `greatest.crown.z`.
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
                    // Integer columns were read as reals.
                    Values::Integers(_) if range[k].is_finite() => (range[k] as i64).into(),
                    Values::Integers(_) | Values::Words(_) => Value::Null,
                };
            }
            summary[name] = all;
        }
    }
}
