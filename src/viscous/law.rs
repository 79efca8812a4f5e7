//! Laws of strain-rate type: how fast a section creeps under the part of its resultants that its stored energy does not
//! take.
//!
//! AMV (2.20): the resultants are w = dW/de + D(e, e_t, s), with D monotone in e_t (2.33) and D(e, 0, s) = 0. A
//! [`RateLaw`] is the inverse (2.37): the rates e_t under a given overstress w - dW/de.

use crate::error::Result;
use crate::rod::section::{Resultant, SectionLaw, Strain};
use nalgebra::Matrix6;
use std::fmt::Debug;
use std::sync::Arc;

/// What a rate law gives.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Rate {
    /// e_t.
    pub rate: Strain,
    /// d e_t/d(overstress), positive definite (AMV (2.38)); zero rows and columns where a strain is held rigid.
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

    /// d e_t/d(overstress), if it is one matrix everywhere and always: it is then formed once.
    fn uniform_fluidity(&self) -> Option<Matrix6<f64>> {
        None
    }

    /// Which strains (u1 .. v3) cannot change.
    fn rigid(&self) -> [bool; 6];
}

/// A Maxwell branch beside the stored energy: a spring in series with a dashpot. With z the strain of its dashpot the
/// branch adds E (e - z) to the resultants, 1/2 (e - z).E (e - z) to the stored energy, and z_t = (e - z)/time.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Maxwell {
    /// E, symmetric positive semidefinite.
    pub modulus: Matrix6<f64>,
    /// Its relaxation time, > 0.
    pub time: f64,
}

/// A viscoelastic section: stored energy, rate law, Maxwell branches.
#[derive(Debug, Clone)]
pub struct Viscoelastic {
    /// Equilibrium elasticity.
    pub elastic: Arc<dyn SectionLaw>,
    /// The rate law; it holds rigid what the elastic law holds rigid.
    pub rate: Arc<dyn RateLaw>,
    /// Prony series.
    pub branches: Vec<Maxwell>,
}
