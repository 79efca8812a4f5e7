//! Friction and memory prescribed by numbers, possibly in proportion to the section, and the resulting laws.

use super::{Carreau, FrictionBarrier, KelvinVoigt, Maxwell, RateLaw, Viscosity};
use crate::error::{Error, Result};
use crate::section::{BarrierTerm, SectionLaw};
use nalgebra::Matrix6;
use std::sync::Arc;

/// Numbers over the strains (u1, u2, u3, v1, v2, v3): a symmetric matrix. Rows and columns of strains that the section
/// holds rigid have no effect.
#[derive(Debug, Clone, PartialEq)]
pub enum StrainMatrix {
    /// A number for bending in the plane; for planar rods only.
    Bending(f64),
    /// Diagonal matrix: an array of six numbers.
    Diagonal([f64; 6]),
    /// Full matrix by rows: an array of six arrays.
    Full(Box<[[f64; 6]; 6]>),
    /// A multiple of the section's stiffness at its unloaded strains: `{ proportional = factor }`.
    Proportional(f64),
}

impl StrainMatrix {
    /// The rows; `None` if in proportion to the section.
    pub fn rows(&self) -> Option<[[f64; 6]; 6]> {
        let mut rows = [[0.0; 6]; 6];
        match self {
            Self::Bending(x) => rows[0][0] = *x,
            Self::Diagonal(diagonal) => (0..6).for_each(|i| rows[i][i] = diagonal[i]),
            Self::Full(full) => rows = **full,
            Self::Proportional(_) => return None,
        }
        Some(rows)
    }

    /// The matrix for bending alone of a planar rod with this stiffness.
    #[must_use]
    pub fn in_plane(&self, bending: f64) -> Self {
        match self {
            Self::Proportional(factor) => Self::Bending(factor * bending),
            matrix => matrix.clone(),
        }
    }

    /// The rows and columns of the strains that can change; None if in proportion to the section.
    fn free(&self, rigid: [bool; 6]) -> Option<Matrix6<f64>> {
        let rows = self.rows()?;
        let entry = |i: usize, j: usize| {
            if rigid[i] || rigid[j] {
                0.0
            } else {
                rows[i][j]
            }
        };
        Some(Matrix6::from_fn(entry))
    }

    /// The viscosity of a section of this law.
    fn viscosity(&self, law: &Arc<dyn SectionLaw>) -> Result<Viscosity> {
        let rigid = law.rigid();
        match self {
            Self::Proportional(time) => Viscosity::proportional(law.clone(), *time),
            Self::Bending(eta) => Viscosity::diagonal([*eta; 2], *eta),
            Self::Diagonal(_) | Self::Full(_) => {
                let mut matrix = self.free(rigid).unwrap_or_default();
                // A positive entry in place of the rigid ones.
                let size = matrix.diagonal().max();
                for k in (0..6).filter(|k| rigid[*k]) {
                    matrix[(k, k)] = size;
                }
                Viscosity::full(matrix)?.holding(rigid)
            }
        }
    }
}

impl Maxwell<StrainMatrix> {
    /// The Maxwell branch for a section of this law.
    ///
    /// # Errors
    /// As [`Maxwell::new`]; a branch in proportion to a section whose stiffness varies along the rod.
    pub fn branch_for(&self, law: &dyn SectionLaw) -> Result<Maxwell> {
        match (self.modulus.free(law.rigid()), &self.modulus) {
            (Some(modulus), _) => Maxwell::new(modulus, self.time),
            (None, StrainMatrix::Proportional(share)) if *share != 0.0 => {
                if !law.has_uniform_stiffness() {
                    return Err(Error::domain(
                        "stiffness = { proportional = .. }: the stiffness of the section varies along the rod, and a branch is the same all along; give six stiffnesses",
                    ));
                }
                Maxwell::proportional(law, *share, self.time)
            }
            (None, _) => Maxwell::new(Matrix6::zeros(), self.time),
        }
    }
}

#[cfg(feature = "serde")]
impl serde::Serialize for StrainMatrix {
    fn serialize<S: serde::Serializer>(
        &self,
        serializer: S,
    ) -> std::result::Result<S::Ok, S::Error> {
        use serde::ser::SerializeMap;
        match self {
            Self::Bending(x) => x.serialize(serializer),
            Self::Diagonal(diagonal) => diagonal.serialize(serializer),
            Self::Full(rows) => rows.serialize(serializer),
            Self::Proportional(factor) => {
                let mut table = serializer.serialize_map(Some(1))?;
                table.serialize_entry("proportional", factor)?;
                table.end()
            }
        }
    }
}

/// Internal friction, w = dW/de + D(e, e_t) (AMV (2.20)); in the plane, for the couple alone, m = EI theta' +
/// D(theta'_t).
///
/// In a scene the matrix H alone, or a table: `{ proportional = 0.05, exponent = 0.5, rate = 1.0 }`,
/// `{ proportional = 0.05, barrier = { strength = 0.1, half_widths = [0.05, 0.05] } }`; with `viscosity` in place of
/// `proportional`, H is any matrix, in the plane a number.
#[derive(Debug, Clone, PartialEq)]
pub struct Damping {
    /// H, stiffness times time, positive definite in the strains that are not rigid;
    /// [`StrainMatrix::Proportional`] is a time > 0.
    pub viscosity: StrainMatrix,
    /// Dependence of D on H.
    pub law: FrictionLaw,
}

impl Damping {
    /// The rate law of a section with this elastic law.
    ///
    /// # Errors
    /// A matrix that is not positive definite in the strains that the law does not hold rigid; a power of the rate,
    /// or a barrier, that does not fit the matrix.
    pub fn law(&self, elastic: &Arc<dyn SectionLaw>) -> Result<Arc<dyn RateLaw>> {
        let viscosity = self.viscosity.viscosity(elastic)?;
        Ok(match self.law {
            FrictionLaw::Linear => Arc::new(KelvinVoigt::new(viscosity)),
            FrictionLaw::Power(power) => {
                if let StrainMatrix::Diagonal(_) | StrainMatrix::Full(_) = self.viscosity {
                    return Err(Error::domain(
                        "a power of the rate needs a viscosity in proportion to the section: write `proportional = 0.05`",
                    ));
                }
                let PowerLaw { exponent, rate } = power;
                Arc::new(Carreau::from_flexure(viscosity, rate, exponent)?)
            }
            FrictionLaw::Barrier(barrier) => Arc::new(FrictionBarrier::new(
                viscosity,
                barrier.half_widths,
                barrier.strength,
            )?),
        })
    }

    /// eta, stiffness times time, of a planar rod of this bending stiffness; NaN in space.
    pub fn viscosity(&self, bending_stiffness: f64) -> f64 {
        match self.viscosity {
            StrainMatrix::Bending(viscosity) => viscosity,
            StrainMatrix::Proportional(time) => time * bending_stiffness,
            StrainMatrix::Diagonal(_) | StrainMatrix::Full(_) => f64::NAN,
        }
    }
}

/// Form of the friction in strains and rates.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum FrictionLaw {
    /// Kelvin-Voigt, D = H e_t.
    Linear,
    /// D = H e_t (1 + e_t.K e_t/(b rate^2))^((exponent - 1)/2), H in proportion to K, the stiffness of the section at
    /// its unloaded strains. b is the smaller principal bending stiffness of the section ([`Carreau::from_flexure`]).
    /// For flexure about the weakest axis D is eta u_t (1 + (u_t/rate)^2)^((exponent - 1)/2).
    Power(PowerLaw),
    /// D = H e_t plus friction that is infinite at total compression (AMV (2.40), (2.41)); only in space.
    Barrier(BarrierTerm),
}

/// Friction by a power of the rate: linear below `rate`, growing as rate^exponent above.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct PowerLaw {
    /// In [0.1, 10]; 1 is Kelvin-Voigt, less is shear thinning.
    pub exponent: f64,
    /// Rate of the curvature about the weakest axis, > 0, at which the power sets in, 1/(length times time).
    pub rate: f64,
}

#[cfg(feature = "serde")]
impl serde::Serialize for Damping {
    fn serialize<S: serde::Serializer>(
        &self,
        serializer: S,
    ) -> std::result::Result<S::Ok, S::Error> {
        use serde::ser::SerializeMap;
        if self.law == FrictionLaw::Linear {
            return self.viscosity.serialize(serializer);
        }
        let mut table = serializer.serialize_map(None)?;
        match &self.viscosity {
            StrainMatrix::Proportional(time) => table.serialize_entry("proportional", time)?,
            matrix => table.serialize_entry("viscosity", matrix)?,
        }
        match self.law {
            FrictionLaw::Linear => {}
            FrictionLaw::Power(PowerLaw { exponent, rate }) => {
                table.serialize_entry("exponent", &exponent)?;
                table.serialize_entry("rate", &rate)?;
            }
            FrictionLaw::Barrier(barrier) => table.serialize_entry("barrier", &barrier)?,
        }
        table.end()
    }
}
