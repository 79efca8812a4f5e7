//! Section laws converted to the units of the rod.

use super::rate::{Maxwell, Rate, RateLaw, Viscoelastic};
use super::{Compliance, Free, Inverse, Resultant, SectionLaw, Strain, UniformLinear};
use crate::error::Result;
use nalgebra::Matrix6;
use std::sync::Arc;

/// Units that make a rod dimensionless: lengths in `length`, times in `time`, forces in stiffness/length^2, couples
/// in stiffness/length.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Measures {
    /// Length of the rod.
    pub length: f64,
    /// Bending stiffness.
    pub stiffness: f64,
    /// Unit of time; elastic laws do not use it.
    pub time: f64,
}

/// The law converted to `units`; returned unchanged if length and stiffness are 1.
pub fn measured(law: Arc<dyn SectionLaw>, units: Measures) -> Arc<dyn SectionLaw> {
    if units.length == 1.0 && units.stiffness == 1.0 {
        law
    } else {
        Arc::new(Measured { law, units })
    }
}

impl Viscoelastic {
    /// The section converted to `units`; returned unchanged if these are 1.
    #[must_use]
    pub fn measured(&self, units: Measures) -> Self {
        if units == Measures::ONE {
            return self.clone();
        }
        let branch = |branch: &Maxwell| Maxwell {
            modulus: units.stiffness_in(&branch.modulus),
            time: branch.time / units.time,
        };
        Self {
            elastic: measured(self.elastic.clone(), units),
            rate: Arc::new(Measured {
                law: self.rate.clone(),
                units,
            }),
            branches: self.branches.iter().map(branch).collect(),
        }
    }
}

/// A law in units other than its own.
#[derive(Debug)]
struct Measured<T: ?Sized> {
    law: Arc<T>,
    units: Measures,
}

/// "in": from the law's own units to those of the rod; "out": back to the law's own.
impl Measures {
    /// Units of a law that is in the units of the rod already.
    pub const ONE: Self = Self {
        length: 1.0,
        stiffness: 1.0,
        time: 1.0,
    };

    /// Factor of a strain in the units of the rod: L for u, 1 for v.
    fn span(&self, i: usize) -> f64 {
        if i < 3 { self.length } else { 1.0 }
    }

    /// Unit of force; that of couples is L times as large.
    fn force(&self) -> f64 {
        self.stiffness / (self.length * self.length)
    }

    /// Strains in units of the rod: flexures and twist times the length.
    pub fn strain_in(&self, e: &Strain) -> Strain {
        e.map_with_location(|i, _, e| e * self.span(i))
    }

    /// Strains in the law's own units.
    pub fn strain_out(&self, e: &Strain) -> Strain {
        e.map_with_location(|i, _, e| e / self.span(i))
    }

    fn resultant_in(&self, w: &Resultant) -> Resultant {
        w.map_with_location(|i, _, w| w / self.force() / self.span(i))
    }

    fn resultant_out(&self, w: &Resultant) -> Resultant {
        w.map_with_location(|i, _, w| w * self.force() * self.span(i))
    }

    fn stiffness_in(&self, k: &Matrix6<f64>) -> Matrix6<f64> {
        k.map_with_location(|i, j, k| k / self.force() / self.span(i) / self.span(j))
    }

    fn compliance_in(&self, c: &Compliance) -> Compliance {
        let scaled = |i, j, c: f64| c * self.force() * self.span(i) * self.span(j);
        match c {
            Compliance::Diagonal(c) => {
                Compliance::Diagonal(c.map_with_location(|i, _, c| scaled(i, i, c)))
            }
            Compliance::Full(c) => Compliance::Full(c.map_with_location(scaled)),
        }
    }

    fn breaks_in(&self, breaks: Vec<f64>) -> Vec<f64> {
        breaks.into_iter().map(|s| s / self.length).collect()
    }
}

impl SectionLaw for Measured<dyn SectionLaw> {
    fn energy(&self, s: f64, e: &Strain) -> Result<f64> {
        let u = &self.units;
        Ok(self.law.energy(s * u.length, &u.strain_out(e))? / u.force())
    }

    fn resultants(&self, s: f64, e: &Strain) -> Result<Resultant> {
        let u = &self.units;
        let found = self.law.resultants(s * u.length, &u.strain_out(e))?;
        Ok(u.resultant_in(&found))
    }

    fn tangent(&self, s: f64, e: &Strain) -> Result<Matrix6<f64>> {
        let u = &self.units;
        let found = self.law.tangent(s * u.length, &u.strain_out(e))?;
        Ok(u.stiffness_in(&found))
    }

    fn free(&self, s: f64, e: &Strain) -> Result<Free> {
        let u = &self.units;
        let free = self.law.free(s * u.length, &u.strain_out(e))?;
        Ok(Free {
            energy: free.energy / u.force(),
            resultants: u.resultant_in(&free.resultants),
            tangent: u.stiffness_in(&free.tangent),
        })
    }

    fn rigid(&self) -> [bool; 3] {
        self.law.rigid()
    }

    fn inverse(&self, s: f64, w: &Resultant) -> Result<Inverse> {
        let u = &self.units;
        let found = self.law.inverse(s * u.length, &u.resultant_out(w))?;
        Ok(Inverse {
            strain: u.strain_in(&found.strain),
            energy: found.energy / u.force(),
            compliance: u.compliance_in(&found.compliance),
        })
    }

    fn uniform_linear(&self) -> Option<UniformLinear> {
        let linear = self.law.uniform_linear()?;
        Some(UniformLinear {
            rest: self.units.strain_in(&linear.rest),
            compliance: self.units.compliance_in(&linear.compliance),
        })
    }

    fn is_linear(&self) -> bool {
        self.law.is_linear()
    }

    fn is_uniform(&self) -> bool {
        self.law.is_uniform()
    }

    fn has_uniform_stiffness(&self) -> bool {
        self.law.has_uniform_stiffness()
    }

    fn planar_about(&self) -> [bool; 2] {
        self.law.planar_about()
    }

    fn breaks(&self) -> Vec<f64> {
        self.units.breaks_in(self.law.breaks())
    }
}

impl RateLaw for Measured<dyn RateLaw> {
    fn rate(&self, s: f64, e: &Strain, overstress: &Resultant) -> Result<Rate> {
        let u = &self.units;
        let found = self
            .law
            .rate(s * u.length, &u.strain_out(e), &u.resultant_out(overstress))?;
        let by_strain = |i, j, x: f64| x * u.time * u.span(i) / u.span(j);
        Ok(Rate {
            rate: u.strain_in(&found.rate) * u.time,
            by_overstress: self.fluidity_in(&found.by_overstress),
            by_strain: found.by_strain.map_with_location(by_strain),
        })
    }

    fn overstress(&self, s: f64, e: &Strain, rate: &Strain) -> Result<Resultant> {
        let u = &self.units;
        let rate = u.strain_out(rate) / u.time;
        let found = self.law.overstress(s * u.length, &u.strain_out(e), &rate)?;
        Ok(u.resultant_in(&found))
    }

    fn is_linear(&self) -> bool {
        self.law.is_linear()
    }

    fn uniform_fluidity(&self) -> Option<Matrix6<f64>> {
        Some(self.fluidity_in(&self.law.uniform_fluidity()?))
    }

    fn rigid(&self) -> [bool; 6] {
        self.law.rigid()
    }

    fn breaks(&self) -> Vec<f64> {
        self.units.breaks_in(self.law.breaks())
    }
}

impl Measured<dyn RateLaw> {
    fn fluidity_in(&self, c: &Matrix6<f64>) -> Matrix6<f64> {
        let u = &self.units;
        c.map_with_location(|i, j, c| c * u.time * u.force() * u.span(i) * u.span(j))
    }
}
