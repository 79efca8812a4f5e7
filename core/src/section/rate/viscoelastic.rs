//! A viscoelastic section: stored energy, rate law, Maxwell branches.

use super::RateLaw;
use super::active_strains::{clear_rigid, inverse_of_free, rigid_of};
use crate::error::{Error, Result, check_positive};
use crate::section::{Resultant, SectionLaw, StrainName};
use nalgebra::Matrix6;
use std::sync::Arc;

/// A Maxwell branch in parallel with the stored energy: a spring in series with a dashpot. Let z be the strain of the
/// dashpot. The branch adds E (e - z) to the resultants and 1/2 (e - z).E (e - z) to the stored energy, and z_t = (e
/// - z)/time.
///
/// E is a matrix, or a [`StrainMatrix`](super::StrainMatrix) that may be in proportion to the section.
#[derive(Debug, Clone, Copy, PartialEq)]
#[cfg_attr(feature = "serde", derive(serde::Serialize))]
pub struct Maxwell<E = Matrix6<f64>> {
    /// E, symmetric positive semidefinite.
    #[cfg_attr(feature = "serde", serde(rename = "stiffness"))]
    pub modulus: E,
    /// Relaxation time, > 0.
    pub time: f64,
}

impl Maxwell {
    /// E = modulus, a symmetric positive semidefinite matrix; time > 0.
    ///
    /// # Errors
    /// Entries that are not finite, a modulus that is not symmetric to rounding (it is then made symmetric) or has a
    /// negative eigenvalue; a time that is not finite and > 0.
    pub fn new(modulus: Matrix6<f64>, time: f64) -> Result<Self> {
        check_positive("relaxation time", time)?;
        for i in 0..6 {
            for j in 0..6 {
                let (entry, other) = (modulus[(i, j)], modulus[(j, i)]);
                if !entry.is_finite() {
                    return Err(Error::domain(format!(
                        "modulus[{i}][{j}] = {entry} must be finite"
                    )));
                }
                let size = entry.abs().max(other.abs())
                    + modulus[(i, i)].abs().sqrt() * modulus[(j, j)].abs().sqrt();
                if !((entry - other).abs() <= 32.0 * f64::EPSILON * size) {
                    return Err(Error::domain(format!(
                        "modulus[{i}][{j}] = {entry} and modulus[{j}][{i}] = {other} must be equal"
                    )));
                }
            }
        }
        let symmetric = modulus.map_with_location(|i, j, entry| {
            if entry == modulus[(j, i)] {
                entry
            } else {
                0.5 * entry + 0.5 * modulus[(j, i)]
            }
        });
        semidefinite(&symmetric)?;
        Ok(Self {
            modulus: symmetric,
            time,
        })
    }

    /// E = `share` x (elastic tangent at the unloaded strains of `law`, at s = 0).
    ///
    /// # Errors
    /// A share that is not finite and > 0; as [`Maxwell::new`] and [`SectionLaw::inverse`].
    pub fn proportional(law: &dyn SectionLaw, share: f64, time: f64) -> Result<Self> {
        check_positive("share", share)?;
        Self::new(unloaded_tangent(law, 0.0)? * share, time)
    }
}

/// Checks that a modulus is positive semidefinite, after scaling to a unit diagonal.
fn semidefinite(modulus: &Matrix6<f64>) -> Result<()> {
    let roots = modulus.diagonal().map(|entry| entry.abs().sqrt());
    for i in 0..6 {
        if !(modulus[(i, i)] >= 0.0) {
            return Err(Error::domain(format!(
                "modulus[{i}][{i}] = {} ({}) must be >= 0",
                modulus[(i, i)],
                StrainName::ALL[i].as_str()
            )));
        }
        for j in 0..i {
            let entry = modulus[(i, j)];
            if !(entry.abs() <= roots[i] * roots[j] * (1.0 + 64.0 * f64::EPSILON)) {
                return Err(Error::domain(format!(
                    "the modulus is not positive semidefinite: modulus[{i}][{j}] = {entry} \
                     against the diagonal entries {} and {}",
                    modulus[(i, i)],
                    modulus[(j, j)]
                )));
            }
        }
    }
    let scaled = modulus.map_with_location(|i, j, entry| match roots[i] * roots[j] {
        0.0 => 0.0,
        _ => entry / roots[i] / roots[j],
    });
    let smallest = scaled.symmetric_eigenvalues().min();
    if !(smallest >= -64.0 * f64::EPSILON) {
        return Err(Error::domain(format!(
            "the modulus is not positive semidefinite: scaled to a unit diagonal its smallest eigenvalue is \
             {smallest:.3e}"
        )));
    }
    Ok(())
}

/// A viscoelastic section: stored energy, rate law, Maxwell branches.
///
/// ```
/// # use snaprod_core as snaprod;
/// # use snaprod::section::Linear;
/// # use snaprod::section::rate::{KelvinVoigt, Maxwell, Viscoelastic};
/// # use std::sync::Arc;
/// let elastic = Arc::new(Linear::diagonal([1.0, 1.5], 0.7)?);
/// let rate = Arc::new(KelvinVoigt::proportional(elastic.clone(), 0.1)?);
/// let branch = Maxwell::proportional(&*elastic, 0.5, 2.0)?;
/// let section = Viscoelastic::new(elastic, rate)?.with_branch(branch)?;
/// assert_eq!(section.stiffness_after(0.0, 0.0)?[(0, 0)], 1.5);
/// # Ok::<(), snaprod::Error>(())
/// ```
#[derive(Debug, Clone)]
pub struct Viscoelastic {
    /// Equilibrium elasticity.
    pub elastic: Arc<dyn SectionLaw>,
    /// The rate law, with the same rigid strains as the elastic law.
    pub rate: Arc<dyn RateLaw>,
    /// Prony series.
    pub branches: Vec<Maxwell>,
}

impl Viscoelastic {
    /// A stored energy and a rate law, without branches.
    ///
    /// # Errors
    /// A rate law and an elastic law with different rigid strains; an elastic law that has no unloaded state at s =
    /// 0.
    pub fn new(elastic: Arc<dyn SectionLaw>, rate: Arc<dyn RateLaw>) -> Result<Self> {
        let held = rigid_of(&elastic.inverse(0.0, &Resultant::zeros())?.compliance);
        let still = rate.rigid();
        for k in 0..6 {
            if held[k] != still[k] {
                let (first, second, cure) = if held[k] {
                    ("elastic", "rate", "leave out its viscosity")
                } else {
                    ("rate", "elastic", "give a viscosity")
                };
                return Err(Error::domain(format!(
                    "the {first} law holds {} rigid and the {second} law does not: both must, {cure}",
                    StrainName::ALL[k].as_str()
                )));
            }
        }
        Ok(Self {
            elastic,
            rate,
            branches: Vec::new(),
        })
    }

    /// Adds a Maxwell branch. Rows and columns of its modulus for rigid strains are dropped.
    ///
    /// # Errors
    /// As [`Maxwell::new`].
    pub fn with_branch(mut self, branch: Maxwell) -> Result<Self> {
        let count = self.branches.len();
        let checked = Maxwell::new(branch.modulus, branch.time)
            .map_err(|e| e.context(format!("Maxwell branch {count}")))?;
        self.branches.push(Maxwell {
            modulus: clear_rigid(&checked.modulus, self.rate.rigid()),
            ..checked
        });
        Ok(self)
    }

    /// The stiffness against small strains from the unloaded state, at time t >= 0 after a step: elastic tangent plus
    /// sum E_k exp(-t/time_k). t = 0 gives the instantaneous stiffness, infinite t that of equilibrium. The viscosity
    /// of the rate law adds an impulse at t = 0. Rows and columns of rigid strains are zero.
    ///
    /// # Errors
    /// A time that is not >= 0; as [`SectionLaw::inverse`].
    pub fn stiffness_after(&self, s: f64, t: f64) -> Result<Matrix6<f64>> {
        if !(0.0 <= t) {
            return Err(Error::domain(format!("t = {t} must be >= 0")));
        }
        let elastic = unloaded_tangent(&*self.elastic, s)?;
        Ok(self.branches.iter().fold(elastic, |sum, branch| {
            sum + branch.modulus * (-t / branch.time).exp()
        }))
    }

    /// Interior points in s where the section is not smooth in s, in growing order.
    pub fn breaks(&self) -> Vec<f64> {
        let mut breaks = self.elastic.breaks();
        breaks.extend(self.rate.breaks());
        breaks.sort_by(f64::total_cmp);
        breaks.dedup();
        breaks
    }
}

/// d^2 W/de^2 without load; zero rows and columns for rigid strains.
fn unloaded_tangent(law: &dyn SectionLaw, s: f64) -> Result<Matrix6<f64>> {
    let compliance = law.inverse(s, &Resultant::zeros())?.compliance;
    inverse_of_free(&compliance.matrix(), rigid_of(&compliance)).ok_or_else(|| {
        Error::domain(format!(
            "the elastic law has no positive definite tangent without load at s = {s}"
        ))
    })
}
