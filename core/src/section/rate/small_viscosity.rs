//! Small viscosity: AMV (8.1).

use super::{Rate, RateLaw};
use crate::error::{Result, check_positive};
use crate::section::{Resultant, Strain};
use nalgebra::Matrix6;
use std::sync::Arc;

/// D(e, eta e_t, s) of another law D: AMV (8.1). The rates are those of D over eta (8.2).
#[derive(Debug, Clone)]
pub struct SmallViscosity {
    law: Arc<dyn RateLaw>,
    eta: f64,
}

impl SmallViscosity {
    /// The law D with eta e_t in place of e_t.
    ///
    /// # Errors
    /// An eta that is not finite and > 0.
    pub fn new(law: Arc<dyn RateLaw>, eta: f64) -> Result<Self> {
        check_positive("eta", eta)?;
        Ok(Self { law, eta })
    }
}

impl RateLaw for SmallViscosity {
    fn rate(&self, s: f64, e: &Strain, overstress: &Resultant) -> Result<Rate> {
        let slow = self.law.rate(s, e, overstress)?;
        Ok(Rate {
            rate: slow.rate / self.eta,
            by_overstress: slow.by_overstress / self.eta,
            by_strain: slow.by_strain / self.eta,
        })
    }

    fn overstress(&self, s: f64, e: &Strain, rate: &Strain) -> Result<Resultant> {
        self.law.overstress(s, e, &(rate * self.eta))
    }

    fn is_linear(&self) -> bool {
        self.law.is_linear()
    }

    fn uniform_fluidity(&self) -> Option<Matrix6<f64>> {
        Some(self.law.uniform_fluidity()? / self.eta)
    }

    fn rigid(&self) -> [bool; 6] {
        self.law.rigid()
    }

    fn breaks(&self) -> Vec<f64> {
        self.law.breaks()
    }
}
