//! Kelvin-Voigt friction: D = H e_t.

use super::active_strains::{check_constraints, free_overstress};
use super::{Rate, RateLaw, Viscosity};
use crate::error::Result;
use crate::section::{Resultant, SectionLaw, Strain};
use nalgebra::Matrix6;
use std::sync::Arc;

/// The law D = H e_t.
///
/// ```
/// # use snaprod_core as snaprod;
/// # use snaprod::section::rate::{KelvinVoigt, RateLaw, Viscosity};
/// # use snaprod::section::{Resultant, Strain};
/// let law = KelvinVoigt::new(Viscosity::diagonal([0.1, 0.2], 0.5)?);
/// let straight = Strain::new(0.0, 0.0, 0.0, 0.0, 0.0, 1.0);
/// let found = law.rate(0.0, &straight, &Resultant::new(1.0, 0.0, 0.0, 7.0, 0.0, 0.0))?;
/// assert_eq!(found.rate.as_slice(), [10.0, 0.0, 0.0, 0.0, 0.0, 0.0]);
/// # Ok::<(), snaprod::Error>(())
/// ```
#[derive(Debug, Clone)]
pub struct KelvinVoigt(Viscosity);

impl KelvinVoigt {
    /// The law with the viscosity H.
    pub fn new(viscosity: Viscosity) -> Self {
        Self(viscosity)
    }

    /// H = time x (elastic tangent at the unloaded strains): [`Viscosity::proportional`].
    ///
    /// # Errors
    /// As [`Viscosity::proportional`].
    pub fn proportional(law: Arc<dyn SectionLaw>, time: f64) -> Result<Self> {
        Viscosity::proportional(law, time).map(Self)
    }

    /// The viscosity H.
    pub fn viscosity(&self) -> &Viscosity {
        &self.0
    }
}

impl RateLaw for KelvinVoigt {
    fn rate(&self, s: f64, _e: &Strain, overstress: &Resultant) -> Result<Rate> {
        let driving = free_overstress(overstress, self.0.rigid())?;
        let inverse = self.0.at(s)?.inverse;
        Ok(Rate {
            rate: inverse * driving,
            by_overstress: inverse,
            by_strain: Matrix6::zeros(),
        })
    }

    fn overstress(&self, s: f64, _e: &Strain, rate: &Strain) -> Result<Resultant> {
        check_constraints(rate, self.0.rigid())?;
        Ok(self.0.at(s)?.matrix * rate)
    }

    fn is_linear(&self) -> bool {
        true
    }

    fn uniform_fluidity(&self) -> Option<Matrix6<f64>> {
        Some(self.0.uniform()?.inverse)
    }

    fn rigid(&self) -> [bool; 6] {
        self.0.rigid()
    }

    fn breaks(&self) -> Vec<f64> {
        self.0.breaks()
    }
}
