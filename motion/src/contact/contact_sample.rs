//! Contacts of a state of a run: gaps, forces, and the losses and work up to the state.

use super::contact_set::ContactNow;
use super::rod_contact::RodContactNow;

/// The contacts of a state of a run, and the energies that they have taken and given up to then.
#[derive(Debug, Clone, Default, PartialEq)]
pub struct ContactSample {
    /// Energy lost in impacts, a part of the dissipated energy.
    pub impact_lost: f64,
    /// Energy lost where surfaces close at a barrier, a part of the dissipated energy.
    pub closing_lost: f64,
    /// Energy of barriers, a part of the elastic energy.
    pub barrier: f64,
    /// Energy lost to friction at contacts, a part of the dissipated energy.
    pub friction_lost: f64,
    /// Work of moving obstacles on the bodies, a part of the work.
    pub obstacle_work: f64,
    /// The least gap of all possible contacts; infinite without any.
    pub least_gap: f64,
    /// The contacts that carry forces.
    pub contacts: Vec<ContactNow>,
    /// The places at which rods touch obstacles.
    pub rods: Vec<RodContactNow>,
}

/// A part of a sum that a motion integrates: the growth while contacts were closed.
#[derive(Debug, Clone, Copy, Default)]
pub(crate) struct PartOfSum {
    /// The part up to the last change of the contacts.
    before: f64,
    /// The sum then.
    since: f64,
    /// The part of what the sum has grown by since then.
    share: f64,
}

impl PartOfSum {
    /// The part, at a value of the sum since the last change.
    pub fn at(&self, sum: f64) -> f64 {
        self.before + self.share * (sum - self.since)
    }

    /// From the value `sum` on the part has the share `share` in what the sum grows by.
    pub fn go_on(&mut self, sum: f64, share: f64) {
        *self = Self {
            before: self.at(sum),
            since: sum,
            share,
        };
    }
}
