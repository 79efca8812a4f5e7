//! Rate laws of a section: strain rates under the overstress, the resultants less their elastic part.
//!
//! AMV (2.20): the resultants are w = dW/de + D(e, e_t, s), with D monotone in e_t (2.33) and D(e, 0, s) = 0. A
//! [`RateLaw`] is the inverse (2.37): the rates e_t under a given overstress w - dW/de.
//!
//! | law | D(e, e_t, s) | |
//! |---|---|---|
//! | [`KelvinVoigt`] | H e_t | H a [`Viscosity`]: diagonal, full, along s, or proportional to the elastic tangent |
//! | [`Carreau`] | H e_t (1 + e_t.H e_t/onset)^((p-1)/2) | thins (p < 1) or thickens (p > 1) |
//! | [`FrictionBarrier`] | H e_t + Omega(d) d_t d(d)/de, d = (v3^2 - V^2)/v3 | infinite at total compression (2.41) |
//! | [`Dissipative`] | d(Phi)/d(e_t) | a user's own [`DissipationPotential`] |
//! | [`SmallViscosity`] | D(e, eta e_t) of another law | (8.1) |
//!
//! [`Damping`] prescribes one of the first three by numbers, which may be in proportion to the elastic law.
//!
//! A [`Viscoelastic`] section joins a stored energy, a rate law and [`Maxwell`] branches. Strains held rigid by the
//! elastic law (some of v1, v2, v3) have rate zero; their components of an overstress are reactions and are ignored.

mod active_strains;
mod carreau;
mod dissipative;
mod friction;
mod friction_spec;
mod kelvin_voigt;
mod small_viscosity;
mod viscoelastic;
mod viscosity;

pub use carreau::Carreau;
pub use dissipative::{DissipationPotential, Dissipative};
pub use friction::FrictionBarrier;
pub use friction_spec::{Damping, FrictionLaw, PowerLaw, StrainMatrix};
pub use kelvin_voigt::KelvinVoigt;
pub use small_viscosity::SmallViscosity;
pub use viscoelastic::{Maxwell, Viscoelastic};
pub use viscosity::{Viscosity, ViscosityAt};

pub use active_strains::{inverse_of_free, rigid_of};

use crate::error::Result;
use crate::section::{Resultant, Strain};
use nalgebra::Matrix6;
use std::fmt::Debug;

/// Rates under an overstress, with derivatives.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Rate {
    /// e_t.
    pub rate: Strain,
    /// d e_t/d(overstress), positive definite (AMV (2.38)); zero rows and columns for rigid strains.
    pub by_overstress: Matrix6<f64>,
    /// d e_t/d e at fixed overstress.
    pub by_strain: Matrix6<f64>,
}

/// A rate law of a section. `s` is the arclength from the clamp in the unloaded state, 0 <= s <= L.
pub trait RateLaw: Debug + Send + Sync {
    /// The rates under an overstress, to roundoff.
    ///
    /// # Errors
    /// Strains outside the law's domain; no convergence.
    fn rate(&self, s: f64, e: &Strain, overstress: &Resultant) -> Result<Rate>;

    /// The overstress D(e, e_t, s) at given rates: AMV (2.20) less its elastic part.
    ///
    /// # Errors
    /// As [`RateLaw::rate`]; rates of strains that are held rigid.
    fn overstress(&self, s: f64, e: &Strain, rate: &Strain) -> Result<Resultant>;

    /// True if the rates are proportional to the overstress.
    fn is_linear(&self) -> bool;

    /// d e_t/d(overstress), if constant along the rod and in time: it is then formed only once.
    fn uniform_fluidity(&self) -> Option<Matrix6<f64>> {
        None
    }

    /// Marks of the strains (u1 .. v3) that cannot change.
    fn rigid(&self) -> [bool; 6];

    /// Interior points in s where the law is not smooth in s, in growing order.
    fn breaks(&self) -> Vec<f64> {
        Vec::new()
    }
}
