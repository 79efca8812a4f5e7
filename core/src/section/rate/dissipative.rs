//! A user's own dissipation potential, its derivatives by automatic differentiation.

use super::active_strains::{check_constraints, free_overstress};
use super::{Rate, RateLaw};
use crate::error::{Error, Result, check_finite};
use crate::section::jet::{jet, mixed_derivatives};
use crate::section::newton::{Convexity, LawPoint, Potential, invert};
use crate::section::six;
use crate::section::{DualNum, Resultant, Strain};
use nalgebra::{Matrix6, Vector6};
use std::fmt::Debug;

/// A dissipation potential Phi(e, e_t, s) written once for numbers that carry their derivatives: D = d(Phi)/d(e_t).
///
/// Phi must be twice differentiable, strictly convex in e_t (AMV (2.33)), grow faster than linearly (2.34) and have no
/// slope in e_t at e_t = 0; convexity and slope are checked wherever it is evaluated. Strains and rates in the order
/// u1 u2 u3 v1 v2 v3.
///
/// ```
/// # use snaprod_core as snaprod;
/// # use snaprod::section::{DualNum, Resultant, Strain};
/// # use snaprod::section::rate::{DissipationPotential, Dissipative, RateLaw};
/// /// Eyring's: the overstress is the area sinh of the rate.
/// #[derive(Debug)]
/// struct Eyring;
///
/// impl DissipationPotential for Eyring {
///     fn potential<D: DualNum<Primitive = f64> + Copy>(&self, _s: f64, _e: &[D; 6], rate: &[D; 6]) -> D {
///         let one = |x: D| x * x.asinh() - (x * x + 1.0).sqrt() + 1.0;
///         rate.iter().fold(D::from(0.0), |sum, x| sum + one(*x))
///     }
/// }
///
/// let law = Dissipative::new(Eyring);
/// let straight = Strain::new(0.0, 0.0, 0.0, 0.0, 0.0, 1.0);
/// let found = law.rate(0.0, &straight, &Resultant::new(3.0, 0.0, 0.0, 0.0, 0.0, 0.0))?;
/// assert!((found.rate[0] - 3.0_f64.sinh()).abs() < 1e-13);
/// # Ok::<(), snaprod::Error>(())
/// ```
pub trait DissipationPotential: Debug + Send + Sync {
    /// Phi(e, e_t, s), a power per length.
    fn potential<D: DualNum<Primitive = f64> + Copy>(&self, s: f64, e: &[D; 6], rate: &[D; 6])
    -> D;

    /// True if the strains are in the law's domain. Strains with an infinite or undefined Phi are outside anyhow.
    fn admissible(&self, _s: f64, _e: &Strain) -> bool {
        true
    }

    /// Marks of the rigid strains among v1, v2, v3. Default: none.
    fn rigid(&self) -> [bool; 3] {
        [false; 3]
    }

    /// As [`RateLaw::breaks`]. Default: none.
    fn breaks(&self) -> Vec<f64> {
        Vec::new()
    }
}

/// The rate law of a [`DissipationPotential`].
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Dissipative<P>(P);

/// Rates at zero overstress (slope over curvature of the potential at rest) up to this size are rounding.
const STILL: f64 = 1e-12;

impl<P: DissipationPotential> Dissipative<P> {
    /// The law with this potential.
    pub fn new(potential: P) -> Self {
        Self(potential)
    }

    fn check_admissible(&self, s: f64, e: &Strain) -> Result<()> {
        check_finite("strains", e.as_slice())?;
        if self.0.admissible(s, e) {
            return Ok(());
        }
        Err(Error::domain(format!(
            "the strains {} are outside the domain of the dissipation potential at s = {s}",
            crate::error::named(&crate::error::STRAINS, e.as_slice())
        )))
    }
}

/// The potential at a fixed place and strain, as a function of the rates.
struct Here<'a, P> {
    law: &'a Dissipative<P>,
    s: f64,
    e: &'a Strain,
    /// Overstress of the wanted rates.
    driving: Resultant,
}

impl<P: DissipationPotential> Here<'_, P> {
    /// D, dD/d(e_t); None if these or Phi are not finite.
    fn jet(&self, rate: &Vector6<f64>) -> Option<(Resultant, Matrix6<f64>)> {
        let (value, slope, curvature) = jet(
            |rate| {
                let e = std::array::from_fn(|k| self.e[k].into());
                self.law.0.potential(self.s, &e, rate)
            },
            rate,
        );
        let mut all = slope.iter().chain(curvature.iter()).chain([&value]);
        all.all(|x| x.is_finite()).then_some((slope, curvature))
    }

    fn inside(&self, rate: &Strain) -> Result<(Resultant, Matrix6<f64>)> {
        let (slope, curvature) = self.jet(rate).ok_or_else(|| {
            Error::domain(format!(
                "the dissipation potential is not finite and smooth at s = {}, strains {}, rates of strain {}",
                self.s,
                crate::error::named(&crate::error::STRAINS, self.e.as_slice()),
                crate::error::named(&crate::error::STRAINS, rate.as_slice())
            ))
        })?;
        match Convexity::of(&curvature, self.rigid()) {
            Convexity::Strict => Ok((slope, curvature)),
            Convexity::Hidden(smallest) => Err(self.not_convex(rate, smallest, "any strain")),
            Convexity::Lost(smallest, strain) => Err(self.not_convex(rate, smallest, strain)),
        }
    }

    fn not_convex(&self, rate: &Strain, smallest: f64, strain: &str) -> Error {
        Error::domain(format!(
            "the dissipation potential must be strictly convex in the rates (AMV (2.33)); at s = {}, strains {}, \
             rates of strain {} the smallest eigenvalue of its second derivative is {smallest:.3e}, mostly \
             in the rate of {strain}",
            self.s,
            crate::error::named(&crate::error::STRAINS, self.e.as_slice()),
            crate::error::named(&crate::error::STRAINS, rate.as_slice())
        ))
    }

    /// Checks that the potential has no slope at rest, D(e, 0) = 0.
    fn check_rest(&self) -> Result<()> {
        let (slope, curvature) = self.inside(&Strain::zeros())?;
        let rigid = self.rigid();
        for k in (0..6).filter(|k| !rigid[*k]) {
            if !(slope[k].abs() <= STILL * curvature[(k, k)]) {
                return Err(Error::domain(format!(
                    "the dissipation potential must have no slope at rest; at s = {}, strains {} it is {}",
                    self.s,
                    crate::error::named(&crate::error::STRAINS, self.e.as_slice()),
                    crate::error::named(&crate::error::RESULTANTS, slope.as_slice())
                )));
            }
        }
        Ok(())
    }
}

impl<P: DissipationPotential> Potential for Here<'_, P> {
    fn rigid(&self) -> [bool; 6] {
        six(self.law.0.rigid())
    }

    fn at(&self, rate: &Vector6<f64>) -> Result<Option<LawPoint>> {
        let Some((resultants, slope)) = self.jet(rate) else {
            return Ok(None);
        };
        match Convexity::of(&slope, self.rigid()) {
            Convexity::Strict => {}
            // Convexity at these trial rates is hidden by rounding: the step was too long and is shortened.
            Convexity::Hidden(_) => return Ok(None),
            Convexity::Lost(smallest, strain) => {
                return Err(self.not_convex(rate, smallest, strain));
            }
        }
        Ok(Some(LawPoint {
            strain: *rate,
            // A potential such as sqrt(1 + x^2) - 1 loses its digits at small rates; its slope does not. With Phi -
            // w.e_t set equal at all points the search uses slopes alone, which suffices for a convex Phi.
            energy: self.driving.dot(rate),
            resultants,
            frame: Matrix6::identity(),
            slope,
        }))
    }
}

impl<P: DissipationPotential> RateLaw for Dissipative<P> {
    fn rate(&self, s: f64, e: &Strain, overstress: &Resultant) -> Result<Rate> {
        self.check_admissible(s, e)?;
        let driving = free_overstress(overstress, self.rigid())?;
        let here = Here {
            law: self,
            s,
            e,
            driving,
        };
        here.check_rest()?;
        let found = invert(&here, Strain::zeros(), &driving, |_| ()).map_err(|error| {
            error.context(format!(
                "rates (here called strains) from the dissipation potential (here called stored energy) at s = {s}, \
                 strains {}",
                crate::error::named(&crate::error::STRAINS, e.as_slice())
            ))
        })?;
        let by_overstress = found.compliance.matrix();
        let mixed = mixed_derivatives(|rate, e| self.0.potential(s, e, rate), &found.strain, e);
        let by_strain = -by_overstress * mixed;
        if !by_strain.iter().all(|x| x.is_finite()) {
            return Err(Error::domain(format!(
                "the dissipation potential is not smooth in the strains at s = {s}, strains {}",
                crate::error::named(&crate::error::STRAINS, e.as_slice())
            )));
        }
        Ok(Rate {
            rate: found.strain,
            by_overstress,
            by_strain,
        })
    }

    fn overstress(&self, s: f64, e: &Strain, rate: &Strain) -> Result<Resultant> {
        self.check_admissible(s, e)?;
        check_constraints(rate, self.rigid())?;
        let here = Here {
            law: self,
            s,
            e,
            driving: Resultant::zeros(),
        };
        here.check_rest()?;
        free_overstress(&here.inside(rate)?.0, self.rigid())
    }

    fn is_linear(&self) -> bool {
        false
    }

    fn rigid(&self) -> [bool; 6] {
        six(self.0.rigid())
    }

    fn breaks(&self) -> Vec<f64> {
        self.0.breaks()
    }
}
