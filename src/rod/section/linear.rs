//! The linear law W = (e - rest).K (e - rest)/2, with shear and stretch free or held rigid.

use super::{Compliance, Inverse, Resultant, SectionLaw, Strain, UniformLinear};
use crate::error::{Error, Result};
use nalgebra::{DMatrix, Matrix6, Vector6};

const NAMES: [&str; 6] = ["u1", "u2", "u3", "v1", "v2", "v3"];

/// A uniform linear section. Rigid strains keep their rest value; their resultants are reactions.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Linear {
    stiffness: Matrix6<f64>,
    compliance: Compliance,
    rigid: [bool; 6],
    rest: Strain,
}

impl Linear {
    /// Bending stiffnesses about d1 and d2 and torsional stiffness; unshearable and inextensible, straight.
    ///
    /// # Errors
    /// A stiffness that is not positive and finite.
    pub fn diagonal(bending: [f64; 2], torsion: f64) -> Result<Self> {
        let entries = Vector6::new(bending[0], bending[1], torsion, 1.0, 1.0, 1.0);
        Self::new(
            Matrix6::from_diagonal(&entries),
            [false, false, false, true, true, true],
        )
    }

    /// Any symmetric positive definite stiffness, rows and columns u1 u2 u3 v1 v2 v3; `rigid` marks the
    /// strains among v1, v2, v3 that are held, whose rows and columns are not used.
    ///
    /// # Errors
    /// A matrix that is not finite, symmetric and positive definite on the free strains; a rigid flexure or twist.
    pub fn new(stiffness: Matrix6<f64>, rigid: [bool; 6]) -> Result<Self> {
        if rigid[..3].contains(&true) {
            return Err(Error::domain(
                "flexure and twist cannot be rigid: a rod without them is a rigid body; hold only v1, v2, v3",
            ));
        }
        let free: Vec<usize> = (0..6).filter(|i| !rigid[*i]).collect();
        let size = free
            .iter()
            .map(|i| stiffness[(*i, *i)].abs())
            .fold(0.0, f64::max);
        for &i in &free {
            let own = stiffness[(i, i)];
            if !(own > 0.0 && own.is_finite()) {
                return Err(Error::domain(format!(
                    "the stiffness of {} is {own}; it must be positive and finite (or rigid, for shear and stretch)",
                    NAMES[i]
                )));
            }
            for &j in &free {
                let (a, b) = (stiffness[(i, j)], stiffness[(j, i)]);
                if !((a - b).abs() <= 1e-12 * size) {
                    return Err(Error::domain(format!(
                        "the stiffness is not symmetric: ({}, {}) is {a}, ({}, {}) is {b}",
                        NAMES[i], NAMES[j], NAMES[j], NAMES[i]
                    )));
                }
            }
        }
        // Scaled to a unit diagonal, so that N m^2 and N compare.
        let scale = |k: usize| stiffness[(free[k], free[k])].sqrt();
        let scaled = DMatrix::from_fn(free.len(), free.len(), |a, b| {
            0.5 * (stiffness[(free[a], free[b])] + stiffness[(free[b], free[a])])
                / (scale(a) * scale(b))
        });
        let inverse = scaled.cholesky().map(|factor| factor.inverse()).ok_or_else(|| {
            Error::domain(
                "the stiffness is not positive definite: some strain stores no energy or a negative one (the law is not convex); \
                 reduce the coupling terms",
            )
        })?;
        let mut compliance = Matrix6::zeros();
        let mut clean = Matrix6::zeros();
        for (a, &i) in free.iter().enumerate() {
            for (b, &j) in free.iter().enumerate() {
                compliance[(i, j)] = inverse[(a, b)] / (scale(a) * scale(b));
                clean[(i, j)] = 0.5 * (stiffness[(i, j)] + stiffness[(j, i)]);
            }
        }
        let is_diagonal = (0..6).all(|i| (0..6).all(|j| i == j || clean[(i, j)] == 0.0));
        let compliance = if is_diagonal {
            Compliance::Diagonal(Vector6::from_fn(|i, _| {
                if rigid[i] { 0.0 } else { 1.0 / clean[(i, i)] }
            }))
        } else {
            Compliance::Full(compliance)
        };
        Ok(Self {
            stiffness: clean,
            compliance,
            rigid,
            rest: Vector6::new(0.0, 0.0, 0.0, 0.0, 0.0, 1.0),
        })
    }

    /// With shear stiffnesses along d1 and d2.
    ///
    /// # Errors
    /// As [`Linear::new`].
    pub fn with_shear(self, shear: [f64; 2]) -> Result<Self> {
        self.with_free(3, shear[0])?.with_free(4, shear[1])
    }

    /// With an axial stiffness.
    ///
    /// # Errors
    /// As [`Linear::new`].
    pub fn with_axial(self, axial: f64) -> Result<Self> {
        self.with_free(5, axial)
    }

    fn with_free(self, i: usize, value: f64) -> Result<Self> {
        let mut stiffness = self.stiffness;
        stiffness[(i, i)] = value;
        let mut rigid = self.rigid;
        rigid[i] = false;
        Ok(Self {
            rest: self.rest,
            ..Self::new(stiffness, rigid)?
        })
    }

    /// With intrinsic flexures u1, u2 and twist u3.
    ///
    /// # Errors
    /// A number that is not finite.
    pub fn with_rest(mut self, curvature: [f64; 2], twist: f64) -> Result<Self> {
        if ![curvature[0], curvature[1], twist]
            .iter()
            .all(|x| x.is_finite())
        {
            return Err(Error::domain(format!(
                "the rest curvature {curvature:?} and twist {twist} must be finite"
            )));
        }
        self.rest = Vector6::new(curvature[0], curvature[1], twist, 0.0, 0.0, 1.0);
        Ok(self)
    }

    fn free_strain(&self, e: &Strain) -> Result<Strain> {
        let change = e - self.rest;
        for i in 0..6 {
            if self.rigid[i] && !(change[i].abs() <= 1e-14) {
                return Err(Error::domain(format!(
                    "{} is rigid at {}, not {}",
                    NAMES[i], self.rest[i], e[i]
                )));
            }
        }
        Ok(change)
    }

    fn unconstrained(&self) -> Result<()> {
        match (0..6).find(|i| self.rigid[*i]) {
            Some(i) => Err(Error::domain(format!(
                "{} is rigid: its resultant is a reaction that the strains do not determine",
                NAMES[i]
            ))),
            None => Ok(()),
        }
    }
}

impl SectionLaw for Linear {
    fn energy(&self, _: f64, e: &Strain) -> Result<f64> {
        let change = self.free_strain(e)?;
        Ok(0.5 * change.dot(&(self.stiffness * change)))
    }

    fn resultants(&self, _: f64, e: &Strain) -> Result<Resultant> {
        self.unconstrained()?;
        Ok(self.stiffness * (e - self.rest))
    }

    fn tangent(&self, _: f64, _: &Strain) -> Result<Matrix6<f64>> {
        self.unconstrained()?;
        Ok(self.stiffness)
    }

    fn inverse(&self, _: f64, w: &Resultant) -> Result<Inverse> {
        let change = &self.compliance * w;
        Ok(Inverse {
            strain: self.rest + change,
            energy: 0.5 * w.dot(&change),
            compliance: self.compliance,
        })
    }

    fn uniform_linear(&self) -> Option<UniformLinear> {
        Some(UniformLinear {
            rest: self.rest,
            compliance: self.compliance,
        })
    }

    fn is_uniform(&self) -> bool {
        true
    }
}
