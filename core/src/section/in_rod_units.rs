//! Section laws converted to the units of the rod.

use super::coordinates::{Coordinates, Transformed};
use super::rate::{Maxwell, Viscoelastic};
use super::{SectionLaw, Strain};
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

impl Measures {
    /// Units of a law that is in the units of the rod already.
    pub const ONE: Self = Self {
        length: 1.0,
        stiffness: 1.0,
        time: 1.0,
    };

    fn coordinates(self) -> Coordinates {
        let length = self.length;
        Coordinates {
            arclength: [0.0, length],
            strain: Strain::new(length, length, length, 1.0, 1.0, 1.0),
            force: self.stiffness / (length * length),
            time: self.time,
        }
    }

    /// Strains in units of the rod: flexures and twist times the length.
    pub fn strain_in(self, e: &Strain) -> Strain {
        self.coordinates().strain_in(e)
    }
}

/// The law converted to `units`; returned unchanged if length and stiffness are 1.
pub fn law_in_units(law: Arc<dyn SectionLaw>, units: Measures) -> Arc<dyn SectionLaw> {
    if units.length == 1.0 && units.stiffness == 1.0 {
        return law;
    }
    let to = units.coordinates();
    Arc::new(Transformed { law, to })
}

impl Viscoelastic {
    /// The section converted to `units`; returned unchanged if these are 1.
    #[must_use]
    pub fn law_in_units(&self, units: Measures) -> Self {
        if units == Measures::ONE {
            return self.clone();
        }
        let to = units.coordinates();
        let branch = |branch: &Maxwell| Maxwell {
            modulus: to.stiffness_in(&branch.modulus),
            time: branch.time / units.time,
        };
        let law = self.rate.clone();
        Self {
            elastic: law_in_units(self.elastic.clone(), units),
            rate: Arc::new(Transformed { law, to }),
            branches: self.branches.iter().map(branch).collect(),
        }
    }
}
