//! Nodes along a rod, which follow its motion.

use snaprod_systems::error::Cause;
use snaprod_systems::viscoelastic::resolution::{Demand, MOST_NODES, Nodes};

/// How many nodes the elements are to have, and how many there were at most.
pub(super) struct Following {
    nodes: Nodes,
    /// Steps in a row after which nodes that are not needed are given up.
    patience: u32,
    idle: u32,
    wanted: Option<Vec<usize>>,
    most: usize,
}

impl Following {
    /// From as many nodes in all as there are at the start.
    pub fn new(nodes: Nodes, patience: u32, at_start: usize) -> Self {
        Self {
            nodes,
            patience,
            idle: 0,
            wanted: None,
            most: at_start,
        }
    }

    /// Whether the nodes are about to become more.
    pub fn grows(&self, demand: &Demand) -> bool {
        self.nodes == Nodes::Adaptive && matches!(demand, Demand::More(_))
    }

    /// What the fields ask for after a step, whose last coefficients are of the size `tail`. It is done before the next step, so that this one can be sampled.
    ///
    /// # Errors
    /// More nodes on an element than there may be.
    pub fn asked(&mut self, demand: Demand, tail: f64) -> Result<(), Cause> {
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

    /// The numbers of nodes that the elements are to have from now on, if these are others.
    pub fn wanted(&mut self) -> Option<Vec<usize>> {
        self.wanted.take()
    }

    /// There are so many nodes in all.
    pub fn became(&mut self, nodes: usize) {
        self.most = self.most.max(nodes);
    }

    /// Most nodes so far.
    pub fn most(&self) -> usize {
        self.most
    }
}
