//! Solution sheets S_j^+- of the planar elastica, fold curves and stable equilibria, sampled for figures and tables.
//! Length 1, bending stiffness 1.

mod portrait;
mod table;

pub use portrait::{PhaseArc, PhasePlane, phase_plane};

use super::Hooks;
use crate::elastica::{FoldLine, GridPoint, SheetGrid, StableRegion, sheet_grid, sheet_grid_in};
use crate::error::Result;
use crate::manifold::{Sheet, Sign};
use std::f64::consts::PI;

/// Points of a sheet along p and along lam, for at most two modes.
const ROWS: f64 = 36.0;
const COLUMNS: f64 = 48.0;
/// Points of the map along either axis.
const MAP: usize = 241;
/// Smallest number of fold curves.
const FOLDS: usize = 3;

/// Sheets, fold curves and stable equilibria; data missing after an interrupt are empty.
#[derive(Debug, Clone, PartialEq)]
pub struct SheetsRecord {
    /// The modes j, each once, in order.
    pub modes: Vec<u32>,
    /// S_j^+ and S_j^- of each mode, sampled evenly over the positions of the free end.
    pub over_disc: Vec<SheetGrid>,
    /// S_j^+ and S_j^- of each mode, sampled evenly in (lam, alpha, theta(1)) for lam below `top_load`.
    pub over_load: Vec<SheetGrid>,
    /// Load lam up to which the sheets are shown; S_j begins at lam = j pi.
    pub top_load: f64,
    /// First fold curves for p > 0; for p < 0 they are mirror images. Stable equilibria lie below the first.
    pub folds: Vec<FoldLine>,
    /// The stable equilibria over the disc.
    pub stable: Option<StableMap>,
    /// True if it was interrupted.
    pub interrupted: bool,
}

/// Stable equilibria on n x n points of the square [-1, 1]^2, row by row from y = -1.
#[derive(Debug, Clone, PartialEq)]
pub struct StableMap {
    /// Number n of points per side.
    pub points: usize,
    /// Number of stable equilibria with the end at the point; `None` outside the reachable disc.
    pub counts: Vec<Option<usize>>,
    /// Energies of the two lowest equilibria; NaN if absent, and for |r| > 0.985.
    pub lowest: Vec<[f64; 2]>,
}

/// Samples the sheets of `modes`, in about half a second.
///
/// ```
/// use snaprod::study::{Silent, sheets};
/// let record = sheets(&[0], &mut Silent)?;
/// let [sheets, folds, stable] = record.tables()?;
/// assert!(sheets.words("sign").iter().any(|sign| sign == "-"));
/// let counts = stable.integers("stable");
/// assert_eq!(counts[144 * 241 + 156], Some(3)); // at (0.3, 0.2)
/// assert!(folds.reals("lam").iter().all(|lam| *lam > 5.7658));
/// # Ok::<(), snaprod::Error>(())
/// ```
///
/// # Errors
/// Errors of the samples: none in practice for the first modes.
pub fn sheets(modes: &[u32], hooks: &mut dyn Hooks) -> Result<SheetsRecord> {
    let mut modes = modes.to_vec();
    modes.sort_unstable();
    modes.dedup();
    let highest = modes.last().copied().unwrap_or(1);
    let mut record = SheetsRecord {
        top_load: 9.6 + PI * f64::from(highest.saturating_sub(1)),
        modes,
        over_disc: Vec::new(),
        over_load: Vec::new(),
        folds: Vec::new(),
        stable: None,
        interrupted: false,
    };
    for (done, part) in [
        SheetsRecord::sample_folds,
        SheetsRecord::sample_loads,
        SheetsRecord::sample_disc,
        SheetsRecord::sample_stable,
    ]
    .into_iter()
    .enumerate()
    {
        record.interrupted = hooks.interrupted();
        if record.interrupted {
            break;
        }
        part(&mut record)?;
        let done = (done + 1) as f64;
        hooks.progress(done / 4.0, done);
    }
    Ok(record)
}

/// Both sheets of each mode.
fn pairs(modes: &[u32]) -> impl Iterator<Item = Sheet> {
    let both = |&mode| [Sign::Plus, Sign::Minus].map(|sign| Sheet { mode, sign });
    modes.iter().flat_map(both)
}

impl SheetsRecord {
    fn sample_folds(&mut self) -> Result<()> {
        let numbers = 1..=FOLDS.max(self.modes.len() + 1);
        self.folds = numbers.map(FoldLine::new).collect::<Result<_>>()?;
        Ok(())
    }

    fn sample_loads(&mut self) -> Result<()> {
        let (rows, columns) = self.size();
        let top = self.top_load;
        // Scaled as in AMV Fig. 3.22; loads beyond its box are clamped.
        let shown = |q: &GridPoint| {
            let lam = q.lambda.min(1.05 * top) / top;
            [lam, q.alpha / (2.0 * PI), q.theta1 / (4.0 * PI)]
        };
        let grid = |sheet| sheet_grid_in(sheet, rows, columns, shown);
        self.over_load = pairs(&self.modes).map(grid).collect::<Result<_>>()?;
        Ok(())
    }

    fn sample_disc(&mut self) -> Result<()> {
        let (rows, columns) = self.size();
        let grid = |sheet| sheet_grid(sheet, rows, columns);
        self.over_disc = pairs(&self.modes).map(grid).collect::<Result<_>>()?;
        Ok(())
    }

    fn sample_stable(&mut self) -> Result<()> {
        let region = StableRegion::new()?;
        let counts = (0..MAP * MAP).map(|m| {
            let [x, y] = place(MAP, m);
            (x.hypot(y) < 1.0).then(|| region.stable_count(x, y))
        });
        self.stable = Some(StableMap {
            points: MAP,
            counts: counts.collect(),
            lowest: region.lowest_energies(MAP)?,
        });
        Ok(())
    }

    /// Points of a sheet along p and along lam: fewer for many sheets, to limit the size of a figure.
    fn size(&self) -> (usize, usize) {
        let share = (2.0 / self.modes.len().max(2) as f64).sqrt();
        ((ROWS * share) as usize, (COLUMNS * share) as usize)
    }
}

/// Point number `m` of an n x n map.
fn place(n: usize, m: usize) -> [f64; 2] {
    [m % n, m / n].map(|i| 2.0 * i as f64 / (n - 1) as f64 - 1.0)
}
