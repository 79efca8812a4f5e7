//! Resolution of a state of rods with mass by their nodes.

use crate::Options;
use nalgebra::DVector;
use snaprod_systems::full_mass::assembly::HeavyAssembly;
use snaprod_systems::full_mass::rod::{HeavyRod, RodState};
use snaprod_systems::viscoelastic::grid::more;
use snaprod_systems::viscoelastic::kinematics::Local;
use snaprod_systems::viscoelastic::resolution::{Demand, Nodes, ROUNDING, demand};

/// Bound of the truncated coefficients over the root of the tolerance: they change positions and energies by
/// their square.
const ROOT: f64 = 0.1;
/// Ratio of the bounds of strain rates and strains: rates of passing waves are rougher, and enter the motion
/// by less than one over this ratio.
const RATE_BOUND_RATIO: f64 = 10.0;

/// Resolution of a state by the nodes of all rods.
pub(super) struct NodeResolution {
    /// Largest of the last coefficients of strains and of weighted rates, relative to 1 + their size.
    pub tails: [f64; 2],
    /// Demand for nodes that follows, for the elements of all rods in a row.
    pub demand: Demand,
    /// Largest ratio of a last coefficient to its bound.
    pub excess: f64,
    /// Largest number of nodes of a rod.
    pub nodes: usize,
}

impl NodeResolution {
    /// Judges a state; None if the strains give no shape.
    pub fn new(model: &HeavyAssembly, y: &DVector<f64>, options: &Options) -> Option<Self> {
        let mut tails = [0.0_f64; 2];
        let (mut more, mut excess) = (false, 0.0_f64);
        let mut nodes = 0;
        let mut counts = Vec::new();
        let mut thinned = Vec::new();
        for (link, moving) in model.links.iter().zip(&model.at(y)?.rods) {
            let grid = &link.rod.sections.grid;
            nodes = nodes.max(grid.len());
            let (tail, over, demand) = judged(&link.rod, moving, options);
            excess = excess.max(over);
            for (worst, tail) in tails.iter_mut().zip(tail) {
                *worst = worst.max(tail);
            }
            let now = grid.counts();
            let (wanted, least) = match demand {
                Demand::More(wanted) => {
                    more = true;
                    (wanted.clone(), wanted)
                }
                Demand::Fewer(least) => (now, least),
                Demand::Enough => (now.clone(), now),
            };
            counts.extend(wanted);
            thinned.extend(least);
        }
        let demand = match (more, counts != thinned) {
            (true, _) => Demand::More(counts),
            (false, true) => Demand::Fewer(thinned),
            (false, false) => Demand::Enough,
        };
        Some(Self {
            tails,
            demand,
            excess,
            nodes,
        })
    }
}

/// The strain rates, weighted by their effect on the motion and on the energy. The weight is at most
/// 1/[`RATE_BOUND_RATIO`] of a strain of that size, and less where the corresponding strains are smaller
/// ([`HeavyRod::delays`]). A rod that is let go begins with waves shorter than any nodes. Their rates do not vanish,
/// but have almost no effect.
fn entering(rod: &HeavyRod, moving: &RodState) -> [Vec<Local<6>>; 2] {
    let delays = rod.delays(moving);
    let weights = delays.map_or([Local::repeat(1.0); 2], |delays| {
        delays.map(|delays| delays.map(|delay| (RATE_BOUND_RATIO * delay).min(1.0)))
    });
    weights.map(|weights| {
        let rates = moving.rates.iter();
        rates.map(|rate| rate.component_mul(&weights)).collect()
    })
}

/// Last coefficients of strains and of weighted rates, relative to 1 + their size; the largest over its
/// bound; the demand for nodes.
fn judged(rod: &HeavyRod, moving: &RodState, options: &Options) -> ([f64; 2], f64, Demand) {
    let grid = &rod.sections.grid;
    let bound = (ROOT * options.tolerance.sqrt()).max(options.tolerance);
    let dashpots = rod.dashpots(moving);
    let strains: Vec<&[Local<6>]> = std::iter::once(&moving.strains)
        .chain(&dashpots)
        .map(Vec::as_slice)
        .collect();
    let defect = moving.shape.defect;
    let (tail, _) = demand(grid, &strains, bound);
    let [moves, energy] = entering(rod, moving);
    let (spill, of_rates) = demand(grid, &[&moves], RATE_BOUND_RATIO * bound);
    let shown = match options.nodes {
        Nodes::Adaptive => spill,
        // Fixed nodes were not chosen for the motion of the body.
        Nodes::Fixed(_) => demand(grid, &[&energy], RATE_BOUND_RATIO * bound).0,
    };
    let (_, of_strains) = demand(grid, &strains, bound);
    let demand = match (of_strains, of_rates) {
        (Demand::More(a), Demand::More(b)) => {
            Demand::More(a.iter().zip(&b).map(|(a, b)| *a.max(b)).collect())
        }
        (Demand::More(a), _) | (_, Demand::More(a)) => Demand::More(a),
        _ if defect > bound.max(ROUNDING) => {
            Demand::More(grid.counts().into_iter().map(more).collect())
        }
        (Demand::Fewer(a), Demand::Fewer(b)) => {
            Demand::Fewer(a.iter().zip(&b).map(|(a, b)| *a.max(b)).collect())
        }
        _ => Demand::Enough,
    };
    let excess = (tail / bound).max(spill / (RATE_BOUND_RATIO * bound));
    ([tail, shown], excess, demand)
}
