//! A user's own stored energy, its derivatives by automatic differentiation.

use super::jet::jet;
use super::linear::{STRAIGHT, check_constraints, check_unconstrained};
use super::newton::{Convexity, LawPoint, Potential, invert};
use super::six;
use super::{Free, Inverse, Resultant, SectionLaw, Strain};
use crate::error::{Error, Result, check_finite};
use nalgebra::{Matrix6, Vector6};
use num_dual::DualNum;
use std::fmt::Debug;

/// A stored energy W(e, s) written once for numbers that carry their derivatives.
///
/// W must be strictly convex and twice differentiable in e where it is admissible, and grow faster than linearly;
/// convexity is checked wherever it is evaluated. Strains in the order u1 u2 u3 v1 v2 v3.
///
/// ```
/// # use snaprod_core as snaprod;
/// # use snaprod::section::{DualNum, Hyperelastic, Resultant, SectionLaw, StoredEnergy};
/// /// Bending and torsion that stiffen, stretch that cannot reach zero.
/// #[derive(Debug)]
/// struct Stiffening;
///
/// impl StoredEnergy for Stiffening {
///     fn energy<D: DualNum<Primitive = f64> + Copy>(&self, _s: f64, e: &[D; 6]) -> D {
///         let u = e[0] * e[0] + e[1] * e[1] + e[2] * e[2];
///         let shear = e[3] * e[3] + e[4] * e[4];
///         u * 0.5 + u * u * 0.1 + shear * 40.0 + (e[5] - 1.0 - e[5].ln()) * 100.0
///     }
/// }
///
/// let law = Hyperelastic::new(Stiffening);
/// let pressed = law.inverse(0.0, &Resultant::new(0.0, 0.0, 0.0, 0.0, 0.0, -300.0))?;
/// assert!((pressed.strain[5] - 0.25).abs() < 1e-15);
/// # Ok::<(), snaprod::Error>(())
/// ```
pub trait StoredEnergy: Debug + Send + Sync {
    /// W(e, s), per length.
    fn energy<D: DualNum<Primitive = f64> + Copy>(&self, s: f64, e: &[D; 6]) -> D;

    /// True if the strains are in the law's domain, which must be convex. Strains with an infinite or undefined W are
    /// outside anyhow.
    fn admissible(&self, _s: f64, _e: &Strain) -> bool {
        true
    }

    /// Admissible strains from which the inverse law starts, preferably those without load; rigid strains are held at
    /// these values. Default: straight and unstretched.
    fn start(&self, _s: f64) -> Strain {
        Strain::from(STRAIGHT)
    }

    /// Marks of the rigid strains among v1, v2, v3. Default: none.
    fn rigid(&self) -> [bool; 3] {
        [false; 3]
    }

    /// True if W does not depend on s. Default: false.
    fn is_uniform(&self) -> bool {
        false
    }

    /// As [`SectionLaw::breaks`]. Default: none.
    fn breaks(&self) -> Vec<f64> {
        Vec::new()
    }

    /// As [`SectionLaw::planar_about`]. Default: unknown.
    fn planar_about(&self) -> [bool; 2] {
        [false; 2]
    }
}

/// The section law of a [`StoredEnergy`].
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Hyperelastic<E>(E);

impl<E: StoredEnergy> Hyperelastic<E> {
    /// The law with this stored energy.
    pub fn new(stored: E) -> Self {
        Self(stored)
    }

    /// Residuals of the Newton iterates of the inverse law, relative to their terms: the convergence history.
    ///
    /// # Errors
    /// As [`SectionLaw::inverse`].
    pub fn convergence(&self, s: f64, w: &Resultant) -> Result<Vec<f64>> {
        let mut residuals = Vec::new();
        let here = LawAt { law: self, s };
        invert(&here, self.0.start(s), w, |residual| {
            residuals.push(residual)
        })?;
        Ok(residuals)
    }

    /// Energy, resultants, tangent; None outside the domain.
    fn jet(&self, s: f64, e: &Strain) -> Option<(f64, Resultant, Matrix6<f64>)> {
        if !self.0.admissible(s, e) {
            return None;
        }
        let (energy, slope, curvature) = jet(|e| self.0.energy(s, e), e);
        let mut all = slope.iter().chain(curvature.iter()).chain([&energy]);
        all.all(|x| x.is_finite())
            .then_some((energy, slope, curvature))
    }

    /// Energy, resultants, tangent at strains that satisfy the constraints.
    fn inside(&self, s: f64, e: &Strain) -> Result<(f64, Resultant, Matrix6<f64>)> {
        check_finite("the strains", e.as_slice())?;
        check_constraints(six(self.0.rigid()), &self.0.start(s), e)?;
        let jet = self.jet(s, e).ok_or_else(|| {
            Error::domain(format!(
                "the strains {} are not admissible at s = {s}: \
                 outside the domain of the stored energy, or it is not finite and smooth there",
                crate::error::named(&crate::error::STRAINS, e.as_slice())
            ))
        })?;
        Convexity::of(&jet.2, six(self.0.rigid())).strict(s, e)?;
        Ok(jet)
    }
}

/// The law at one s, as a function of its strains.
struct LawAt<'a, E> {
    law: &'a Hyperelastic<E>,
    s: f64,
}

impl<E: StoredEnergy> Potential for LawAt<'_, E> {
    fn rigid(&self) -> [bool; 6] {
        six(self.law.0.rigid())
    }

    fn at(&self, x: &Vector6<f64>) -> Result<Option<LawPoint>> {
        let Some((energy, resultants, slope)) = self.law.jet(self.s, x) else {
            return Ok(None);
        };
        let convexity = Convexity::of(&slope, self.rigid());
        // The step went too far into a fast stiffening law: try a shorter one.
        if matches!(convexity, Convexity::Hidden(_)) {
            return Ok(None);
        }
        convexity.strict(self.s, x)?;
        Ok(Some(LawPoint {
            strain: *x,
            energy,
            resultants,
            frame: Matrix6::identity(),
            slope,
        }))
    }
}

impl<E: StoredEnergy> SectionLaw for Hyperelastic<E> {
    fn energy(&self, s: f64, e: &Strain) -> Result<f64> {
        Ok(self.inside(s, e)?.0)
    }

    fn resultants(&self, s: f64, e: &Strain) -> Result<Resultant> {
        check_unconstrained(six(self.0.rigid()))?;
        Ok(self.inside(s, e)?.1)
    }

    fn tangent(&self, s: f64, e: &Strain) -> Result<Matrix6<f64>> {
        check_unconstrained(six(self.0.rigid()))?;
        Ok(self.inside(s, e)?.2)
    }

    fn free(&self, s: f64, e: &Strain) -> Result<Free> {
        let (energy, resultants, tangent) = self.inside(s, e)?;
        Ok(Free::new(energy, resultants, tangent, six(self.0.rigid())))
    }

    fn rigid(&self) -> [bool; 6] {
        six(self.0.rigid())
    }

    fn inverse(&self, s: f64, w: &Resultant) -> Result<Inverse> {
        let here = LawAt { law: self, s };
        invert(&here, self.0.start(s), w, |_| ())
            .map_err(|e| e.context(format!("the section at s = {s}")))
    }

    fn is_uniform(&self) -> bool {
        self.0.is_uniform()
    }

    fn breaks(&self) -> Vec<f64> {
        self.0.breaks()
    }

    fn planar_about(&self) -> [bool; 2] {
        self.0.planar_about()
    }
}
