//! Normal form of a fold of a branch: force of the parameter along the critical direction, and its curvature (theory
//! 2.8).
//!
//! At a fold the equations F(b, p) = 0 of the end are singular: F_b z = 0. With the amplitude a along z the
//! unbalanced force is
//!
//! ```text
//! psi . F = A (p - p_f) + B a^2,     A = psi . F_p,     B = 1/2 psi . D^2 F[z, z],     psi . F_b = 0.
//! ```
//!
//! Base wrenches determine pose and wrench of the end such that d(m dphi + n dr) = 0. Where the end is free, psi is
//! therefore the motion of the end along z; where it is held, minus the change of the holding wrench. psi . F is the
//! derivative by a of stored energy less the work of the loads.
//!
//! Loads without a potential, such as follower loads, have another left null motion y of the end. psi is then the
//! motion of the free end under y, and does not follow from z.

use super::branch::RodFamily;
use super::chart::Chart;
use super::ivp::Wrench;
use super::problem::{Problem, Trial};
use crate::error::{Error, Result};
use crate::math::se3::{halves, join};
use crate::solve::normal_form::{normal_form, null_vectors};
use crate::solve::parametrised_problem::Family;
use nalgebra::{DVector, Matrix6, Vector3, Vector6};

/// Largest psi . F_b, relative to its factors, of loads that have a potential. In a chart: largest relative
/// difference between the known factors and the left null vector.
const SINGULAR: f64 = 1e-4;

/// A fold of a rod, in B/L.
#[derive(Debug, Clone, PartialEq)]
pub struct Fold {
    /// A: force per unit of the parameter.
    pub drive: f64,
    /// B: curvature of the force in the amplitude.
    pub bend: f64,
    /// The motion y that the unbalanced force works on, as the rate of the base wrench. Loads with a potential have y
    /// = z.
    pub against: Wrench,
}

impl Problem {
    /// psi at a trial, for the critical direction `z` of loads that have a potential.
    fn conjugate(&self, trial: &Trial, z: &Wrench) -> Vector6<f64> {
        let moved = Vector6::from_fn(|i, _| (0..6).map(|k| trial.tangent[i][k] * z[k]).sum());
        let (turn, place) = halves(&moved);
        let [couple, force] = self.resultants_by(trial).map(|by| by * z);
        // Displacement of the point of action of the force.
        let place = place + turn.cross(&self.lever(&trial.rotation));
        let first = match self.orientation {
            Some(_) => -couple,
            None => turn,
        };
        Vector6::from_fn(|i, _| match i {
            0..3 => first[i],
            _ if self.end.position[i - 3].is_some() => -self.axes[i - 3].dot(&force),
            _ => self.axes[i - 3].dot(&place),
        })
    }

    /// The base wrench whose rate moves the free components of the end as psi says, and leaves the held ones at rest.
    fn base_rate_of(&self, trial: &Trial, psi: &Vector6<f64>) -> Option<Wrench> {
        let (first, second) = halves(psi);
        let (turn, place) = if self.end.follower {
            (trial.rotation * first, trial.rotation * second)
        } else {
            let turn = match self.orientation {
                Some(_) => Vector3::zeros(),
                None => first,
            };
            let lever = turn.cross(&self.lever(&trial.rotation));
            let free = (0..3).filter(|i| self.end.position[*i].is_none());
            let place = free.map(|i| self.axes[i] * (second[i] - self.axes[i].dot(&lever)));
            (turn, place.sum())
        };
        let tangent = Matrix6::from_fn(|i, j| trial.tangent[i][j]);
        tangent.lu().solve(&join(&turn, &place))
    }
}

impl<P: Fn(f64) -> Result<Problem>> RodFamily<P> {
    /// The fold at the parameter p and the base wrench `b`, along the critical direction `z` = db/da, both along the
    /// clamp's directors in B/L and B/L^2.
    ///
    /// # Errors
    /// Those of the problem and of the rod; a point or a direction that is not that of a fold.
    pub fn fold(&self, b: &Wrench, z: &Wrench, p: f64) -> Result<Fold> {
        let problem = self.problem(p)?;
        let trial = problem.trial(b)?;
        let [x, along] = [b, z].map(|v| DVector::from_column_slice(v.as_slice()));
        let jacobian = self.linearised(&x, p)?.jacobian;
        let conjugate = DVector::from_column_slice(problem.conjugate(&trial, z).as_slice());
        let left = jacobian.tr_mul(&conjugate).norm();
        let conservative =
            !problem.is_followed() && left <= SINGULAR * jacobian.norm() * conjugate.norm();
        let (psi, against) = if conservative {
            (conjugate, *z)
        } else {
            let [psi, _] = null_vectors(&jacobian)?;
            let against = problem.base_rate_of(&trial, &Vector6::from_column_slice(psi.as_slice()));
            let against = against.filter(|y| y.norm() > 0.0).ok_or_else(|| {
                Error::ill_conditioned("the end of the rod cannot move in every way")
            })?;
            // Normalised to the length of z.
            let unit = z.norm() / against.norm();
            (psi * unit, against * unit)
        };
        let [drive, bend] = normal_form(self, &x, p, &psi, &along)?;
        Ok(Fold {
            drive,
            bend,
            against,
        })
    }
}

impl<P: Fn(f64) -> Result<Problem>, C: Chart> RodFamily<P, C> {
    /// (A, B) of the fold at (x, p) along `z` in the chart, for loads that have a potential. `end` is the image of z
    /// at the end: (force, place) per a, along the clamp's directors, in B/L^2 and lengths of the rod.
    ///
    /// # Errors
    /// As [`RodFamily::fold`]; a chart in which no factor of an equation is known; loads without a potential.
    pub fn fold_in_chart(
        &self,
        x: &DVector<f64>,
        z: &DVector<f64>,
        p: f64,
        end: &[Vector3<f64>; 2],
    ) -> Result<[f64; 2]> {
        let known = self.working(p, end)?;
        let [psi, _] = null_vectors(&self.linearised(x, p)?.jacobian)?;
        let pairs = || {
            let rows = known.iter().zip(psi.iter());
            rows.filter_map(|(known, psi)| Some(((*known)?, *psi)))
        };
        let size: f64 = pairs().map(|(known, _)| known * known).sum();
        if !(size > 0.0) {
            return Err(Error::domain(
                "the chart knows no factor, other than 0, of the equations of the end at this fold",
            ));
        }
        let scale = pairs().map(|(known, psi)| known * psi).sum::<f64>()
            / pairs().map(|(_, psi)| psi * psi).sum::<f64>();
        let off: f64 = pairs()
            .map(|(known, psi)| (known - scale * psi).powi(2))
            .sum();
        if !(off <= SINGULAR * SINGULAR * size) {
            return Err(Error::domain("the loads of the end have no potential"));
        }
        normal_form(self, x, p, &(psi * scale), z)
    }
}
