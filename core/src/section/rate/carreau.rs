//! Carreau's friction law, which thins or thickens with the dissipation: D = H e_t (1 + e_t.H e_t/onset)^((p - 1)/2).
//!
//! It is the common law of polymers and of soft matter: a Newtonian plateau at small rates, a power law of exponent p
//! at large ones. The power law alone (Norton's) has infinite viscosity at rest for p < 1 and none for p > 1, so that
//! (2.38) fails; the plateau cures this. The norm sqrt(e_t.H e_t) couples the components: the law is meaningful for a
//! full H, and its inverse is one scalar equation. With q = |e_t|_H, tau = sqrt(w.H^-1 w) for the overstress w,
//! ```text
//! q f(q) = tau,   e_t = H^-1 w/f(q),   f(q) = (1 + q^2/onset)^((p - 1)/2).
//! ```
//! q f grows with slope f (1 + p y^2)/(1 + y^2), y^2 = q^2/onset. The slope is positive for p > 0, so that D is the
//! gradient of a strictly convex potential of e_t (2.33), and D.e_t/|e_t| grows as |e_t|^p (2.34).

use super::active_strains::{check_constraints, free_overstress};
use super::{Rate, RateLaw, Viscosity, ViscosityAt};
use crate::error::{Error, Result, check_positive};
use crate::section::{Resultant, Strain};
use nalgebra::Matrix6;

/// The law D = H e_t (1 + e_t.H e_t/onset)^((p - 1)/2), thinning for p < 1, thickening for p > 1: a Newtonian
/// plateau, then a power law (see the head of the module).
#[derive(Debug, Clone)]
pub struct Carreau {
    viscosity: Viscosity,
    onset: PlateauEnd,
    exponent: f64,
}

/// End of the Newtonian plateau.
#[derive(Debug, Clone, Copy)]
enum PlateauEnd {
    /// A dissipation, uniform along the rod.
    Dissipation(f64),
    /// A rate of flexure about the weakest axis of each section.
    Flexure(f64),
}

impl PlateauEnd {
    /// Square root of the dissipation e_t.H e_t at which a section of this viscosity leaves the plateau.
    fn root(self, viscosity: &ViscosityAt) -> f64 {
        match self {
            Self::Dissipation(onset) => onset.sqrt(),
            Self::Flexure(rate) => rate * viscosity.weakest_flexure().sqrt(),
        }
    }
}

impl Carreau {
    /// The law with the viscosity H at rest. `onset` is the dissipation e_t.H e_t (a power per length) at the end of
    /// the plateau: for a rate k of the strain i alone, H_ii k^2. Far above D grows as |e_t|^`exponent`.
    ///
    /// # Errors
    /// An onset or an exponent that is not finite and > 0.
    pub fn new(viscosity: Viscosity, onset: f64, exponent: f64) -> Result<Self> {
        check_positive("onset", onset)?;
        Self::with(viscosity, PlateauEnd::Dissipation(onset), exponent)
    }

    /// The law whose plateau ends at this `rate` of flexure about the weakest axis: the onset is h(s) rate^2, h(s)
    /// the smaller principal viscosity of flexure of the section at s. For flexure about that axis alone the law is
    /// then that of the planar rod everywhere along a rod that varies, from either end.
    ///
    /// # Errors
    /// A rate or an exponent that is not finite and > 0; a viscosity that holds a flexure rigid.
    pub fn from_flexure(viscosity: Viscosity, rate: f64, exponent: f64) -> Result<Self> {
        check_positive("rate", rate)?;
        if let [true, ..] | [_, true, ..] = viscosity.rigid() {
            return Err(Error::domain(
                "the viscosity holds u1 or u2 rigid, and a rate of flexure says where a power of the rate sets in: give viscosities of \
                 flexure, or an onset by the dissipation",
            ));
        }
        Self::with(viscosity, PlateauEnd::Flexure(rate), exponent)
    }

    fn with(viscosity: Viscosity, onset: PlateauEnd, exponent: f64) -> Result<Self> {
        check_positive("exponent", exponent)?;
        Ok(Self {
            viscosity,
            onset,
            exponent,
        })
    }

    /// f at y = q/sqrt(onset).
    fn factor(&self, y: f64) -> f64 {
        1.0_f64.hypot(y).powf(self.exponent - 1.0)
    }

    /// Solution y of y f(y) = t, t >= 0, to roundoff. In log y the equation is convex or concave with slopes between
    /// 1 and p: Newton's iteration converges from any start.
    fn invert(&self, t: f64) -> f64 {
        let p = self.exponent;
        if p == 1.0 || !(0.0 < t) {
            return t;
        }
        let target = t.ln();
        let mut log = if t < 1.0 { target } else { target / p };
        let slope = |y: f64| {
            let size = 1.0_f64.hypot(y);
            1.0 + (p - 1.0) * (y / size) * (y / size)
        };
        let mut before = f64::INFINITY;
        for _ in 0..100 {
            let y = log.exp();
            let off = target - log - (p - 1.0) * 1.0_f64.hypot(y).ln();
            log += off / slope(y);
            if !(off.abs() < 0.5 * before) {
                break;
            }
            before = off.abs();
        }
        // exp(log y) has fewer digits than y if log y is large: the last two steps are taken in y itself.
        let mut y = log.exp();
        for _ in 0..2 {
            let ratio = t / (y * self.factor(y));
            if !(ratio.is_finite() && 0.0 < ratio) {
                break;
            }
            y += y * (ratio - 1.0) / slope(y);
        }
        y
    }
}

impl RateLaw for Carreau {
    fn rate(&self, s: f64, _e: &Strain, overstress: &Resultant) -> Result<Rate> {
        let driving = free_overstress(overstress, self.viscosity.rigid())?;
        let viscosity = self.viscosity.at(s)?;
        let (inverse, onset) = (viscosity.inverse, self.onset.root(&viscosity));
        let newtonian = inverse * driving;
        // Scaled: squares of large overstresses must not overflow.
        let size = driving.amax();
        let tau = if size > 0.0 {
            size * (driving / size).dot(&(newtonian / size)).max(0.0).sqrt()
        } else {
            0.0
        };
        let y = self.invert(tau / onset);
        let factor = self.factor(y);
        let rate = newtonian / factor;
        let bend = rate / onset / 1.0_f64.hypot(self.exponent.sqrt() * y);
        let by_overstress =
            inverse / factor + bend * bend.transpose() * ((1.0 - self.exponent) / factor);
        if !rate.iter().chain(&by_overstress).all(|x| x.is_finite()) {
            return Err(Error::domain(format!(
                "the overstress {} brings about rates that overflow",
                crate::error::named(&crate::error::RESULTANTS, driving.as_slice())
            )));
        }
        Ok(Rate {
            rate,
            by_overstress,
            by_strain: Matrix6::zeros(),
        })
    }

    fn overstress(&self, s: f64, _e: &Strain, rate: &Strain) -> Result<Resultant> {
        check_constraints(rate, self.viscosity.rigid())?;
        let viscosity = self.viscosity.at(s)?;
        let newtonian = viscosity.matrix * rate;
        let size = rate.amax();
        let q = if size > 0.0 {
            size * (rate / size).dot(&(newtonian / size)).max(0.0).sqrt()
        } else {
            0.0
        };
        Ok(newtonian * self.factor(q / self.onset.root(&viscosity)))
    }

    fn is_linear(&self) -> bool {
        self.exponent == 1.0
    }

    fn rigid(&self) -> [bool; 6] {
        self.viscosity.rigid()
    }

    fn breaks(&self) -> Vec<f64> {
        self.viscosity.breaks()
    }
}
