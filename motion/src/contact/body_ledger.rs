//! The energy ledger of bodies with contact.

/// Energies of bodies with contact at one moment.
///
/// Losses and works are sums since the start; the total stays as it was.
#[derive(Debug, Clone, Copy, Default, PartialEq)]
pub struct BodyLedger {
    /// Kinetic energy.
    pub kinetic: f64,
    /// Potential of the constant forces.
    pub potential: f64,
    /// Energy lost in impacts.
    pub impact_loss: f64,
    /// Energy lost to friction in contacts that last.
    pub friction_loss: f64,
    /// Energy lost to drag.
    pub drag_loss: f64,
    /// Work of loads without a potential.
    pub work: f64,
    /// Work of moving obstacles on the bodies.
    pub obstacle_work: f64,
}

impl BodyLedger {
    /// The conserved sum.
    pub fn total(&self) -> f64 {
        self.kinetic + self.potential + self.impact_loss + self.friction_loss + self.drag_loss
            - self.work
            - self.obstacle_work
    }

    /// The largest term, by which an error of the total is judged.
    pub fn largest(&self) -> f64 {
        [
            self.kinetic,
            self.potential,
            self.impact_loss,
            self.friction_loss,
            self.drag_loss,
            self.work,
            self.obstacle_work,
        ]
        .into_iter()
        .fold(0.0, |most, term| most.max(term.abs()))
    }
}
