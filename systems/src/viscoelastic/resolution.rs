//! Adaptive resolution of fields: elements gain nodes while the tails of their Legendre series are too large, and
//! lose nodes if fewer suffice.

use crate::viscoelastic::grid::{Grid, fewer, more};
use crate::viscoelastic::kinematics::Local;

/// Nodes along the rod.
#[derive(Debug, Clone, Copy, Default, PartialEq, Eq)]
pub enum Nodes {
    /// As many as the tolerance requires, at every time.
    #[default]
    Adaptive,
    /// A fixed number on each element, at all times.
    Fixed(usize),
}

/// Largest number of nodes of an element under [`Nodes::Adaptive`].
pub const MOST_NODES: usize = 320;
/// Part of the bound below which an element's tail on fewer nodes must lie before the element loses nodes.
const MARGIN: f64 = 0.03;
/// Tails below this, relative to 1 + the largest strain, are rounding.
pub const ROUNDING: f64 = 3e-14;

/// Number of nodes required by the last Legendre coefficients ("tails") of some fields, element by element.
#[derive(Debug, Clone, PartialEq)]
pub enum Demand {
    /// Some elements need more nodes: these numbers.
    More(Vec<usize>),
    /// Some elements need fewer nodes: these numbers.
    Fewer(Vec<usize>),
    /// The present nodes suffice.
    Enough,
}

/// Largest tail of the fields relative to 1 + their size, and the nodes that it requires at this tolerance.
pub fn demand<const M: usize>(
    grid: &Grid,
    fields: &[&[Local<M>]],
    tolerance: f64,
) -> (f64, Demand) {
    let mut counts = grid.counts();
    let now = counts.clone();
    let mut coarser: Vec<usize> = now.iter().map(|n| fewer(*n)).collect();
    let mut worst = 0.0f64;
    for field in fields {
        let size = 1.0 + field.iter().map(Local::amax).fold(0.0, f64::max);
        let bound = tolerance.max(ROUNDING);
        for (k, tail) in grid.tails(field).iter().enumerate() {
            let (tail, thinned) = (tail.now / size, tail.fewer / size);
            worst = worst.max(tail);
            if !(tail <= bound) {
                counts[k] = more(now[k]);
            }
            if !(thinned <= MARGIN * bound) {
                coarser[k] = now[k];
            }
        }
    }
    let demand = if counts != now {
        Demand::More(counts)
    } else if coarser != now {
        Demand::Fewer(coarser)
    } else {
        Demand::Enough
    };
    (worst, demand)
}
