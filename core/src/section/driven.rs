//! Rest strains that are driven: muscles, swelling, heat. A law whose strains count from moving rest strains.

use super::{Along, Free, Inverse, LawRates, Resultant, SectionLaw, Strain, UniformLinear};
use crate::error::{Error, Result};
use nalgebra::Matrix6;
use std::sync::Arc;

/// Shape of driven rest strains: the addition to the rest strains along a rod, per unit of amplitude.
#[derive(Debug, Clone, PartialEq)]
#[cfg_attr(feature = "serde", derive(serde::Serialize))]
pub struct RestDrive {
    /// Flexures about d1 and d2, per length.
    pub curvature: [Along; 2],
    /// Twist, radians per length.
    pub twist: Along,
    /// Stretch.
    pub stretch: Along,
}

impl RestDrive {
    /// The strains with their places in (u1, u2, u3, v1, v2, v3).
    fn all(&self) -> [(usize, &Along); 4] {
        let [first, second] = &self.curvature;
        [
            (0, first),
            (1, second),
            (2, &self.twist),
            (5, &self.stretch),
        ]
    }

    /// Curvatures, twist and stretch.
    pub fn each(&self) -> impl Iterator<Item = &Along> {
        self.all().map(|(_, along)| along).into_iter()
    }

    fn at(&self, s: f64, length: f64) -> Result<Strain> {
        let mut strain = Strain::zeros();
        for (k, along) in self.all() {
            strain[k] = along.at(s, length)?;
        }
        Ok(strain)
    }
}

/// The law W(e - a d(s)) of a rod with driven rest strains: d the drive, a its amplitude.
#[derive(Debug, Clone)]
pub struct Driven {
    base: Arc<dyn SectionLaw>,
    drive: RestDrive,
    amplitude: f64,
    /// Rate of the amplitude in time.
    rate: f64,
    /// Length of the rod.
    length: f64,
}

impl Driven {
    /// The law of a rod under a drive. `base` is the law of the rod at amplitude 0, `length` the length of the rod.
    ///
    /// # Errors
    /// An amplitude that is not finite.
    pub fn new(
        base: Arc<dyn SectionLaw>,
        drive: RestDrive,
        amplitude: f64,
        length: f64,
    ) -> Result<Self> {
        if !amplitude.is_finite() {
            return Err(Error::domain(format!(
                "the amplitude of driven rest strains is {amplitude}; it must be finite"
            )));
        }
        Ok(Self {
            base,
            drive,
            amplitude,
            rate: 0.0,
            length,
        })
    }

    /// The law with an amplitude that changes at `rate`.
    #[must_use]
    pub fn changing(mut self, rate: f64) -> Self {
        self.rate = rate;
        self
    }

    fn shift(&self, s: f64) -> Result<Strain> {
        Ok(self.drive.at(s, self.length)? * self.amplitude)
    }
}

impl SectionLaw for Driven {
    fn energy(&self, s: f64, e: &Strain) -> Result<f64> {
        self.base.energy(s, &(e - self.shift(s)?))
    }

    fn resultants(&self, s: f64, e: &Strain) -> Result<Resultant> {
        self.base.resultants(s, &(e - self.shift(s)?))
    }

    fn tangent(&self, s: f64, e: &Strain) -> Result<Matrix6<f64>> {
        self.base.tangent(s, &(e - self.shift(s)?))
    }

    fn free(&self, s: f64, e: &Strain) -> Result<Free> {
        self.base.free(s, &(e - self.shift(s)?))
    }

    fn rigid(&self) -> [bool; 6] {
        self.base.rigid()
    }

    fn inverse(&self, s: f64, w: &Resultant) -> Result<Inverse> {
        let mut found = self.base.inverse(s, w)?;
        found.strain += self.shift(s)?;
        Ok(found)
    }

    fn rates(&self, s: f64, e: &Strain, w: &Resultant) -> Result<Option<LawRates>> {
        if self.rate == 0.0 {
            return Ok(None);
        }
        let faster = self.drive.at(s, self.length)? * self.rate;
        Ok(Some(LawRates {
            power: -w.dot(&faster),
            resultants: -(self.free(s, e)?.tangent * faster),
        }))
    }

    fn uniform_linear(&self) -> Option<UniformLinear> {
        let mut linear = self.base.uniform_linear().filter(|_| self.is_uniform())?;
        linear.rest += self.shift(0.0).ok()?;
        Some(linear)
    }

    fn is_linear(&self) -> bool {
        self.base.is_linear()
    }

    fn is_uniform(&self) -> bool {
        self.base.is_uniform() && self.drive.each().all(|along| along.constant().is_some())
    }

    fn has_uniform_stiffness(&self) -> bool {
        self.base.has_uniform_stiffness()
    }

    fn planar_about(&self) -> [bool; 2] {
        let base = self.base.planar_about();
        // The amplitude is left out: a branch in the amplitude stays in the plane.
        let [first, second] = &self.drive.curvature;
        let twists = !self.drive.twist.vanishes();
        let across = [second, first].map(Along::vanishes);
        std::array::from_fn(|axis| base[axis] && !twists && across[axis])
    }

    fn breaks(&self) -> Vec<f64> {
        let mut all = self.base.breaks();
        all.extend(self.drive.each().flat_map(Along::breaks));
        all.sort_by(f64::total_cmp);
        all.dedup();
        all
    }
}
