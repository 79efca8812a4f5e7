//! Viscosity matrices of a section: H in D = H e_t.

use super::active_strains::{clear_rigid, inverse_of_free, rigid_of};
use crate::error::{Error, Result, check_positive};
use crate::section::six;
use crate::section::{Linear, Resultant, SectionLaw, Varying};
use nalgebra::Matrix6;
use std::sync::Arc;

/// A viscosity matrix H, symmetric positive definite on the strains that are not held rigid; constant, a function of
/// the arclength, or proportional to an elastic law. Units: those of the stiffnesses times time.
///
/// ```
/// # use snaprod_core as snaprod;
/// # use snaprod::section::rate::Viscosity;
/// let h = Viscosity::diagonal([0.1, 0.2], 0.05)?.with_axial(3.0)?;
/// assert_eq!(h.at(0.3)?.inverse[(5, 5)], 1.0 / 3.0);
/// assert_eq!(h.rigid(), [false, false, false, true, true, false]);
/// # Ok::<(), snaprod::Error>(())
/// ```
#[derive(Debug, Clone)]
pub struct Viscosity {
    source: ViscositySource,
    rigid: [bool; 6],
    /// The viscosity, if uniform along the rod.
    uniform: Option<ViscosityAt>,
}

#[derive(Debug, Clone)]
enum ViscositySource {
    /// The stiffness of this law is H.
    Constant(Box<Linear>),
    Along(Varying),
    Proportional(Arc<dyn SectionLaw>, f64),
}

/// A viscosity matrix at one arclength.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct ViscosityAt {
    /// H; zero rows and columns for rigid strains.
    pub matrix: Matrix6<f64>,
    /// The inverse of the free block of H, zero elsewhere.
    pub inverse: Matrix6<f64>,
}

impl ViscosityAt {
    /// The smaller principal viscosity of flexure: the least eigenvalue of the block of u1 and u2.
    pub fn weakest_flexure(&self) -> f64 {
        let [a, b, c] = [(0, 0), (1, 1), (0, 1)].map(|at| self.matrix[at]);
        let largest = 0.5 * (a + b) + (0.5 * (a - b)).hypot(c);
        // Determinant over the larger eigenvalue: the difference of the two has no digits of the smaller one if they
        // are far apart.
        (a * b - c * c) / largest
    }
}

impl Viscosity {
    /// Flexural viscosities about d1 and d2, torsional viscosity; shear and stretch are rigid until
    /// [`Viscosity::with_shear`], [`Viscosity::with_axial`].
    ///
    /// # Errors
    /// A viscosity that is not finite and > 0.
    pub fn diagonal(bending: [f64; 2], torsion: f64) -> Result<Self> {
        check_positive("bending viscosity[0]", bending[0])?;
        check_positive("bending viscosity[1]", bending[1])?;
        check_positive("torsional viscosity", torsion)?;
        Self::constant(Linear::diagonal(bending, torsion)?)
    }

    /// Any symmetric positive definite H, rows and columns in the order u1 u2 u3 v1 v2 v3; nothing is rigid until
    /// [`Viscosity::with_rigid`].
    ///
    /// # Errors
    /// Entries that are not finite, an H that is not symmetric to rounding or not positive definite.
    pub fn full(matrix: Matrix6<f64>) -> Result<Self> {
        let read = Linear::full(matrix)
            .map_err(|e| e.context("the viscosity matrix, checked as a stiffness"))?;
        Self::constant(read)
    }

    /// With shear viscosities (of v1, v2), which are then no longer rigid.
    ///
    /// # Errors
    /// As [`Viscosity::diagonal`]; a viscosity that is given along s or by an elastic law, which has its own.
    pub fn with_shear(self, shear: [f64; 2]) -> Result<Self> {
        check_positive("shear viscosity[0]", shear[0])?;
        check_positive("shear viscosity[1]", shear[1])?;
        Self::constant(self.linear("shear viscosities")?.with_shear(shear)?)
    }

    /// With an axial viscosity (of v3), which is then no longer rigid.
    ///
    /// # Errors
    /// As [`Viscosity::with_shear`].
    pub fn with_axial(self, axial: f64) -> Result<Self> {
        check_positive("axial viscosity", axial)?;
        Self::constant(self.linear("an axial viscosity")?.with_axial(axial)?)
    }

    /// Holds the marked components of v1, v2, v3 rigid; the others are unchanged.
    ///
    /// # Errors
    /// As [`Viscosity::with_shear`].
    pub fn with_rigid(self, marked: [bool; 3]) -> Result<Self> {
        self.holding(six(marked))
    }

    /// Holds the marked strains rigid; the others are unchanged.
    ///
    /// # Errors
    /// As [`Viscosity::with_shear`].
    pub(super) fn holding(self, marked: [bool; 6]) -> Result<Self> {
        Self::constant(self.linear("what is rigid")?.holding(marked)?)
    }

    /// H along the rod: the stiffness of a [`Varying`] law, taken as a viscosity; its rest strains are ignored.
    ///
    /// # Errors
    /// A law that is not defined at s = 0, or not positive definite there.
    pub fn from_varying(law: Varying) -> Result<Self> {
        let rigid = law.at(0.0)?.is_rigid();
        Self::of(law.is_uniform(), ViscositySource::Along(law), rigid)
    }

    /// H = time x (elastic tangent at the unloaded strains), at every s. With [`KelvinVoigt`](super::KelvinVoigt) all
    /// small motions then share the retardation time `time`, and the end responds without memory.
    ///
    /// # Errors
    /// A time that is not finite and > 0; as [`SectionLaw::inverse`].
    pub fn proportional(law: Arc<dyn SectionLaw>, time: f64) -> Result<Self> {
        check_positive("time", time)?;
        let rigid = rigid_of(&law.inverse(0.0, &Resultant::zeros())?.compliance);
        Self::of(
            law.is_uniform(),
            ViscositySource::Proportional(law, time),
            rigid,
        )
    }

    /// H at s and its inverse.
    ///
    /// # Errors
    /// s outside a table; a viscosity that is not positive definite at s, or with other rigid strains than at s = 0;
    /// as [`SectionLaw::inverse`].
    pub fn at(&self, s: f64) -> Result<ViscosityAt> {
        match self.uniform {
            Some(uniform) => Ok(uniform),
            None => self.evaluate(s),
        }
    }

    /// H, if uniform along the rod.
    pub fn uniform(&self) -> Option<&ViscosityAt> {
        self.uniform.as_ref()
    }

    /// Marks of the rigid strains.
    pub fn rigid(&self) -> [bool; 6] {
        self.rigid
    }

    /// Interior points in s where H is not smooth, in growing order.
    pub fn breaks(&self) -> Vec<f64> {
        match &self.source {
            ViscositySource::Constant(_) => Vec::new(),
            ViscositySource::Along(law) => law.breaks(),
            ViscositySource::Proportional(law, _) => law.breaks(),
        }
    }

    fn constant(law: Linear) -> Result<Self> {
        Self::of(
            true,
            ViscositySource::Constant(Box::new(law)),
            law.is_rigid(),
        )
    }

    fn of(uniform: bool, source: ViscositySource, rigid: [bool; 6]) -> Result<Self> {
        let mut viscosity = Self {
            source,
            rigid,
            uniform: None,
        };
        let first = viscosity.evaluate(0.0)?;
        viscosity.uniform = uniform.then_some(first);
        Ok(viscosity)
    }

    fn linear(self, what: &str) -> Result<Linear> {
        match self.source {
            ViscositySource::Constant(law) => Ok(*law),
            ViscositySource::Along(_) => Err(Error::domain(format!(
                "{what} cannot be set on a viscosity given along s: set it in the law it was made from"
            ))),
            ViscositySource::Proportional(..) => Err(Error::domain(format!(
                "{what} cannot be set on a viscosity that is proportional to an elastic law: it follows from that law"
            ))),
        }
    }

    fn evaluate(&self, s: f64) -> Result<ViscosityAt> {
        let (found, rigid) = match &self.source {
            ViscositySource::Constant(law) => (read(law), law.is_rigid()),
            ViscositySource::Along(law) => {
                let law = law.at(s).map_err(|e| e.context("the viscosity"))?;
                (read(&law), law.is_rigid())
            }
            ViscositySource::Proportional(law, time) => {
                let compliance = law.inverse(s, &Resultant::zeros())?.compliance;
                let rigid = rigid_of(&compliance);
                let compliance = compliance.matrix();
                let tangent = inverse_of_free(&compliance, rigid).ok_or_else(|| {
                    Error::domain(format!(
                        "the elastic law has no positive definite tangent without load at s = {s}"
                    ))
                })?;
                let found = ViscosityAt {
                    matrix: tangent * *time,
                    inverse: compliance / *time,
                };
                (found, rigid)
            }
        };
        if rigid != self.rigid {
            return Err(Error::domain(format!(
                "the viscosity at s = {s} holds other strains rigid than at s = 0 ({} and {}); they must be the same all along the rod",
                crate::error::marked_strains(&rigid),
                crate::error::marked_strains(&self.rigid)
            )));
        }
        if !found
            .matrix
            .iter()
            .chain(&found.inverse)
            .all(|x| x.is_finite())
        {
            return Err(Error::domain(format!(
                "the viscosity at s = {s} or its inverse overflows"
            )));
        }
        Ok(found)
    }
}

fn read(law: &Linear) -> ViscosityAt {
    ViscosityAt {
        matrix: clear_rigid(law.stiffness(), law.is_rigid()),
        inverse: law.compliance().matrix(),
    }
}
