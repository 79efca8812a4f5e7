//! Section laws in other coordinates: units of the rod, or arclength from the other end.

use super::rate::{Rate, RateLaw};
use super::{Compliance, Free, Inverse, LawRates, Resultant, SectionLaw, Strain, UniformLinear};
use crate::error::Result;
use nalgebra::Matrix6;
use std::sync::Arc;

/// Affine change of coordinates of a law. "in": from the law's own coordinates to the new ones; "out": back.
#[derive(Debug, Clone, Copy)]
pub(super) struct Coordinates {
    /// The law's own arclength at s = 0, and its derivative by s.
    pub arclength: [f64; 2],
    /// Factor of each strain; the factor of its resultant is the inverse one over `force`.
    pub strain: Strain,
    /// Unit of force.
    pub force: f64,
    /// Unit of time; elastic laws do not use it.
    pub time: f64,
}

impl Coordinates {
    /// Arclength s* = L - s from the other end, and directors turned by pi about d1, so that d3 points along the rod
    /// again. With T = diag(-1, 1, 1, -1, 1, 1): W*(e, s*) = W(T e, L - s*).
    fn from_other_end(length: f64) -> Self {
        Self {
            arclength: [length, -1.0],
            strain: Strain::new(-1.0, 1.0, 1.0, -1.0, 1.0, 1.0),
            force: 1.0,
            time: 1.0,
        }
    }

    fn arclength_out(&self, s: f64) -> f64 {
        self.arclength[0] + s * self.arclength[1]
    }

    fn breaks_in(&self, mut breaks: Vec<f64>) -> Vec<f64> {
        let [start, rate] = self.arclength;
        if rate < 0.0 {
            breaks.reverse();
        }
        breaks.into_iter().map(|s| (s - start) / rate).collect()
    }

    pub(super) fn strain_in(&self, e: &Strain) -> Strain {
        e.component_mul(&self.strain)
    }

    fn strain_out(&self, e: &Strain) -> Strain {
        e.component_div(&self.strain)
    }

    fn resultant_in(&self, w: &Resultant) -> Resultant {
        (w / self.force).component_div(&self.strain)
    }

    fn resultant_out(&self, w: &Resultant) -> Resultant {
        (w * self.force).component_mul(&self.strain)
    }

    pub(super) fn stiffness_in(&self, k: &Matrix6<f64>) -> Matrix6<f64> {
        let mut scaled = k / self.force;
        for (mut column, factor) in scaled.column_iter_mut().zip(&self.strain) {
            column.component_div_assign(&self.strain);
            column /= *factor;
        }
        scaled
    }

    fn compliance_in(&self, c: &Compliance) -> Compliance {
        match c {
            Compliance::Diagonal(c) => {
                let once = (c * self.force).component_mul(&self.strain);
                Compliance::Diagonal(once.component_mul(&self.strain))
            }
            Compliance::Full(c) => Compliance::Full(self.by_strains(c * self.force)),
        }
    }

    fn fluidity_in(&self, c: &Matrix6<f64>) -> Matrix6<f64> {
        self.by_strains(c * self.time * self.force)
    }

    /// The matrix with row i and column i multiplied by the factor of strain i.
    fn by_strains(&self, mut matrix: Matrix6<f64>) -> Matrix6<f64> {
        for (mut column, factor) in matrix.column_iter_mut().zip(&self.strain) {
            column.component_mul_assign(&self.strain);
            column *= *factor;
        }
        matrix
    }
}

/// A law in coordinates other than its own.
#[derive(Debug)]
pub(super) struct Transformed<T: ?Sized> {
    pub law: Arc<T>,
    pub to: Coordinates,
}

/// The law of a rod of this length, seen from the rod's other end.
pub(crate) fn reverse_law(law: Arc<dyn SectionLaw>, length: f64) -> impl SectionLaw {
    Transformed {
        law,
        to: Coordinates::from_other_end(length),
    }
}

impl SectionLaw for Transformed<dyn SectionLaw> {
    fn energy(&self, s: f64, e: &Strain) -> Result<f64> {
        let (law, to) = (&self.law, &self.to);
        Ok(law.energy(to.arclength_out(s), &to.strain_out(e))? / to.force)
    }

    fn resultants(&self, s: f64, e: &Strain) -> Result<Resultant> {
        let (law, to) = (&self.law, &self.to);
        let found = law.resultants(to.arclength_out(s), &to.strain_out(e))?;
        Ok(to.resultant_in(&found))
    }

    fn tangent(&self, s: f64, e: &Strain) -> Result<Matrix6<f64>> {
        let (law, to) = (&self.law, &self.to);
        let found = law.tangent(to.arclength_out(s), &to.strain_out(e))?;
        Ok(to.stiffness_in(&found))
    }

    fn free(&self, s: f64, e: &Strain) -> Result<Free> {
        let (law, to) = (&self.law, &self.to);
        let free = law.free(to.arclength_out(s), &to.strain_out(e))?;
        Ok(Free {
            energy: free.energy / to.force,
            resultants: to.resultant_in(&free.resultants),
            tangent: to.stiffness_in(&free.tangent),
        })
    }

    fn rigid(&self) -> [bool; 6] {
        self.law.rigid()
    }

    fn inverse(&self, s: f64, w: &Resultant) -> Result<Inverse> {
        let (law, to) = (&self.law, &self.to);
        let found = law.inverse(to.arclength_out(s), &to.resultant_out(w))?;
        Ok(Inverse {
            strain: to.strain_in(&found.strain),
            energy: found.energy / to.force,
            compliance: to.compliance_in(&found.compliance),
        })
    }

    /// Rates in the time of the law itself.
    fn rates(&self, s: f64, e: &Strain, w: &Resultant) -> Result<Option<LawRates>> {
        let (law, to) = (&self.law, &self.to);
        let own = (to.strain_out(e), to.resultant_out(w));
        let found = law.rates(to.arclength_out(s), &own.0, &own.1)?;
        Ok(found.map(|rates| LawRates {
            power: rates.power / to.force,
            resultants: to.resultant_in(&rates.resultants),
        }))
    }

    fn uniform_linear(&self) -> Option<UniformLinear> {
        let linear = self.law.uniform_linear()?;
        Some(UniformLinear {
            rest: self.to.strain_in(&linear.rest),
            compliance: self.to.compliance_in(&linear.compliance),
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
        self.to.breaks_in(self.law.breaks())
    }
}

impl RateLaw for Transformed<dyn RateLaw> {
    fn rate(&self, s: f64, e: &Strain, overstress: &Resultant) -> Result<Rate> {
        let (law, to) = (&self.law, &self.to);
        let (e, overstress) = (to.strain_out(e), to.resultant_out(overstress));
        let found = law.rate(to.arclength_out(s), &e, &overstress)?;
        let by_strain = |i, j, x: f64| x * to.time * to.strain[i] / to.strain[j];
        Ok(Rate {
            rate: to.strain_in(&found.rate) * to.time,
            by_overstress: to.fluidity_in(&found.by_overstress),
            by_strain: found.by_strain.map_with_location(by_strain),
        })
    }

    fn overstress(&self, s: f64, e: &Strain, rate: &Strain) -> Result<Resultant> {
        let (law, to) = (&self.law, &self.to);
        let rate = to.strain_out(rate) / to.time;
        let found = law.overstress(to.arclength_out(s), &to.strain_out(e), &rate)?;
        Ok(to.resultant_in(&found))
    }

    fn is_linear(&self) -> bool {
        self.law.is_linear()
    }

    fn uniform_fluidity(&self) -> Option<Matrix6<f64>> {
        Some(self.to.fluidity_in(&self.law.uniform_fluidity()?))
    }

    fn rigid(&self) -> [bool; 6] {
        self.law.rigid()
    }

    fn breaks(&self) -> Vec<f64> {
        self.to.breaks_in(self.law.breaks())
    }
}
