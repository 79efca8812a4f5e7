//! Adaptive numbers of nodes along a rod.

use snaprod_systems::error::Cause;
use snaprod_systems::viscoelastic::resolution::{Demand, MOST_NODES, Nodes};

/// Node counts of the elements over a run, and the largest total so far.
pub(super) struct AdaptiveNodes {
    nodes: Nodes,
    /// Number of steps in a row after which unneeded nodes are given up.
    patience: u32,
    idle: u32,
    wanted: Option<Vec<usize>>,
    most: usize,
}

impl AdaptiveNodes {
    /// Starts with the total number of nodes `at_start`.
    pub fn new(nodes: Nodes, patience: u32, at_start: usize) -> Self {
        Self {
            nodes,
            patience,
            idle: 0,
            wanted: None,
            most: at_start,
        }
    }

    /// True if the demand adds nodes.
    pub fn grows(&self, demand: &Demand) -> bool {
        self.nodes == Nodes::Adaptive && matches!(demand, Demand::More(_))
    }

    /// Registers the demand of the fields after a step, whose last coefficients are of the size `tail`. The
    /// change is made before the next step, so that the last one can still be sampled.
    ///
    /// # Errors
    /// More nodes on an element than [`MOST_NODES`].
    pub fn register_demand(&mut self, demand: Demand, tail: f64) -> Result<(), Cause> {
        if self.nodes != Nodes::Adaptive {
            return Ok(());
        }
        let idle = std::mem::take(&mut self.idle) + 1;
        match demand {
            Demand::More(counts) if counts.iter().any(|n| *n > MOST_NODES) => {
                return Err(Cause::Unresolved {
                    most: MOST_NODES,
                    tail,
                });
            }
            Demand::More(counts) => self.wanted = Some(counts),
            Demand::Fewer(counts) if idle >= self.patience => self.wanted = Some(counts),
            Demand::Fewer(_) => self.idle = idle,
            Demand::Enough => {}
        }
        Ok(())
    }

    /// The node counts for the elements from now on; None if unchanged.
    pub fn wanted(&mut self) -> Option<Vec<usize>> {
        self.wanted.take()
    }

    /// Records the total number of nodes.
    pub fn record_total(&mut self, nodes: usize) {
        self.most = self.most.max(nodes);
    }

    /// Largest total number of nodes so far.
    pub fn most(&self) -> usize {
        self.most
    }
}
