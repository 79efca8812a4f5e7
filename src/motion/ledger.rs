//! The energy ledger: kinetic + elastic + potential + dissipated - work = constant.

use super::sheet::Phase;
use crate::body::Body;
use crate::manifold::ManifoldPoint;

/// The terms of the ledger at one moment.
#[derive(Debug, Clone, Copy, Default, PartialEq)]
pub struct Ledger {
    /// mu |v|^2 / 2.
    pub kinetic: f64,
    /// Stored in the rod.
    pub elastic: f64,
    /// Of gravity and dead loads, zero at the clamp.
    pub potential: f64,
    /// Lost in snaps and to drag, so far.
    pub dissipated: f64,
    /// Done by the forces in time and by the clamp, so far.
    pub work: f64,
}

impl Ledger {
    /// The ledger of a state on the manifold; `snapped` is what the snaps so far released.
    pub fn new<const N: usize>(
        body: &Body<N>,
        at: &ManifoldPoint<N>,
        phase: &Phase<N>,
        snapped: f64,
    ) -> Self {
        Self {
            kinetic: body.kinetic(phase.t, &at.pose, &phase.v),
            elastic: at.energy,
            potential: body.potential(phase.t, &at.pose),
            dissipated: snapped + phase.drag_loss,
            work: phase.work,
        }
    }

    /// What should not change.
    pub fn total(&self) -> f64 {
        self.kinetic + self.elastic + self.potential + self.dissipated - self.work
    }

    /// The largest term, by which an error of the total is judged.
    pub fn largest(&self) -> f64 {
        [
            self.kinetic,
            self.elastic,
            self.potential,
            self.dissipated,
            self.work,
        ]
        .into_iter()
        .fold(0.0, |most, term| most.max(term.abs()))
    }
}
