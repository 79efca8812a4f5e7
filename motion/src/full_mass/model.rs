//! Rods with mass as a run sees them: one rod with its body, or an assembly.

use crate::{Options, State};
use nalgebra::DVector;
use snaprod_systems::assembly::{Contact, Nearness};
use snaprod_systems::full_mass::rod::{HeavyRod, Moving};
use snaprod_systems::solve::system::AnySystem;
use snaprod_systems::viscoelastic::grid::more;
use snaprod_systems::viscoelastic::kinematics::Local;
use snaprod_systems::viscoelastic::resolution::{Demand, Nodes, ROUNDING, demand};

/// Coefficients that the nodes leave out change positions and energies by their square: they are held to this times the root of the
/// tolerance.
const ROOT: f64 = 0.1;
/// Rates of waves that pass are rougher than the strains, and enter by less than 1 over this.
const LATE: f64 = 10.0;

/// Rods with mass at given nodes, with what they carry.
pub(super) trait Model {
    /// The equations.
    fn system(&self) -> &dyn AnySystem;

    /// Where time stands in a state; energy dissipated, work and loss to drag follow.
    fn time(&self) -> usize;

    /// What a state shows; `implicit`: it has its accelerations. None outside the domain of a law.
    fn sample(&self, y: &DVector<f64>, implicit: bool) -> Option<Box<dyn State>>;

    /// The rods of a state.
    fn rods(&self, y: &DVector<f64>) -> Option<Vec<(&HeavyRod, Moving)>>;

    /// The same at so many nodes on the elements of all rods in a row, with the state.
    fn regridded(&self, y: &DVector<f64>, counts: &[usize]) -> Option<Begun>;

    /// The state brought back to where it must be, if it is farther from there than `bound`.
    fn held(&self, _y: &DVector<f64>, _bound: f64) -> Option<DVector<f64>> {
        None
    }

    /// Of every body in a groove with ends: its number, the parameter with its rate, and between which it lies.
    fn along_grooves(&self, _y: &DVector<f64>) -> Vec<(usize, [f64; 2], [f64; 2])> {
        Vec::new()
    }

    /// How near rods with a contact diameter are to themselves and to each other; None where there is none.
    fn nearness(&self, y: &DVector<f64>) -> Option<Nearness>;

    /// What messages call a rod.
    fn rod_name(&self, _rod: usize) -> String {
        "the rod".to_owned()
    }

    /// The contact next to `near` in a state; None if it is lost.
    fn contact(&self, y: &DVector<f64>, near: &Contact) -> Option<Contact>;

    /// The first time after `t` at which a load or the motion of a support is not smooth.
    fn next_break(&self, t: f64) -> f64;
}

/// A model with a state.
pub(super) type Begun = (Box<dyn Model>, DVector<f64>);

/// What the nodes of all rods of a state are worth.
pub(super) struct Judged {
    /// The last coefficients of strains and of rates as far as they enter, relative to 1 + their size, at worst.
    pub tails: [f64; 2],
    /// What that asks for, elements of all rods in a row.
    pub demand: Demand,
    /// The largest of the last coefficients over its bound.
    pub excess: f64,
    /// Most nodes of a rod.
    pub nodes: usize,
}

impl Judged {
    /// Judges a state of a model; None where it has no shape.
    pub fn new(model: &dyn Model, y: &DVector<f64>, options: &Options) -> Option<Self> {
        let mut tails = [0.0_f64; 2];
        let (mut more, mut excess) = (false, 0.0_f64);
        let mut nodes = 0;
        let mut counts = Vec::new();
        let mut thinned = Vec::new();
        for (rod, moving) in model.rods(y)? {
            let grid = &rod.sections.grid;
            nodes = nodes.max(grid.len());
            let (tail, over, demand) = judged(rod, &moving, options);
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

/// The strain rates, each times what it enters by into the motion, and into the energy: by no more than 1/[`LATE`] of
/// a strain of that size, and by less where the strains that it stands for are less ([`HeavyRod::delays`]). A rod that
/// is let go begins with waves shorter than any nodes at rates that do not vanish, which enter by next to nothing.
fn entering(rod: &HeavyRod, moving: &Moving) -> [Vec<Local<6>>; 2] {
    let delays = rod.delays(moving);
    let weights = delays.map_or([Local::repeat(1.0); 2], |delays| {
        delays.map(|delays| delays.map(|delay| (LATE * delay).min(1.0)))
    });
    weights.map(|weights| {
        let rates = moving.rates.iter();
        rates.map(|rate| rate.component_mul(&weights)).collect()
    })
}

/// The last coefficients of strains and of rates as far as they enter, relative to 1 + their size. With them the
/// largest over its bound, and the nodes that they ask for.
fn judged(rod: &HeavyRod, moving: &Moving, options: &Options) -> ([f64; 2], f64, Demand) {
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
    let (spill, of_rates) = demand(grid, &[&moves], LATE * bound);
    let shown = match options.nodes {
        Nodes::Adaptive => spill,
        // Given nodes were not chosen for the motion of the body.
        Nodes::Fixed(_) => demand(grid, &[&energy], LATE * bound).0,
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
    let excess = (tail / bound).max(spill / (LATE * bound));
    ([tail, shown], excess, demand)
}
