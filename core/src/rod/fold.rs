//! The normal form of a fold of a branch: how the parameter drives the rod out of its equilibrium, and how fast it then leaves (theory 2.8).
//!
//! At a fold the equations F(b, p) = 0 of the end are singular: F_b z = 0. With the amplitude a of the rod along z, out of balance is the force
//!
//! ```text
//! psi . F = A (p - p_f) + B a^2,     A = psi . F_p,     B = 1/2 psi . D^2 F[z, z],     psi . F_b = 0.
//! ```
//! Base wrenches make pose and wrench of the end so that d(m dphi + n dr) = 0. psi therefore has, where the end is free, what z moves it by, and
//! where it is held, against what it is held by, the change of the wrench that holds it; and psi . F is the derivative by a of stored energy less
//! the work of the loads.

use super::branch::RodFamily;
use super::line::Wrench;
use super::problem::{Problem, Trial};
use crate::error::{Error, Result};
use crate::math::se3::halves;
use crate::solve::family::Family;
use nalgebra::{DMatrix, DVector, Vector6};

/// The step of derivatives along z, relative to 1 + |b|: its fourth power, and the tolerance over it, is their error.
const STEP: f64 = 2e-3;
/// psi . F_b of what is a fold, relative to its factors.
const SINGULAR: f64 = 1e-4;

impl Problem {
    /// psi at a trial, for the critical direction `z`.
    fn conjugate(&self, trial: &Trial, z: &Wrench) -> Vector6<f64> {
        let moved = Vector6::from_fn(|i, _| (0..6).map(|k| trial.tangent[i][k] * z[k]).sum());
        let (turn, place) = halves(&moved);
        let [couple, force] = self.resultants_by(trial).map(|by| by * z);
        // The place at which the force acts.
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
}

impl<P: Fn(f64) -> Result<Problem>> RodFamily<P> {
    /// (A, B) of the fold at the parameter p and the base wrench `b`, along the critical direction `z` = db/da, both along the clamp's directors
    /// in B/L and B/L^2: A in B/L per unit of the parameter, B in B/L, both taken positive.
    ///
    /// # Errors
    /// Those of the problem and of the rod; loads that have no potential, as those that follow the end and couples on an end that turns in space;
    /// a point or a direction that is not that of a fold.
    pub fn fold_form(&self, (b, z): (&Wrench, &Wrench), p: f64) -> Result<[f64; 2]> {
        let problem = self.problem(p)?;
        if problem.end.follower {
            return Err(Error::domain("loads that follow the end have no potential"));
        }
        let psi = problem.conjugate(&problem.trial(b)?, z);
        let psi = DVector::from_column_slice(psi.as_slice());
        let at =
            |step: f64| self.linearised(&DVector::from_column_slice((b + z * step).as_slice()), p);
        let here = at(0.0)?;
        let left = here.jacobian.tr_mul(&psi).norm();
        if !(left <= SINGULAR * here.jacobian.norm() * psi.norm()) {
            return Err(Error::domain(
                "the equations of the end are not singular along this direction, or its load has no potential",
            ));
        }
        let h = STEP * (1.0 + b.norm()) / z.norm();
        let slope =
            |step: f64| -> Result<DMatrix<f64>> { Ok(at(step)?.jacobian - at(-step)?.jacobian) };
        let change = (slope(h)? * 8.0 - slope(2.0 * h)?) / (12.0 * h);
        let along = DVector::from_column_slice(z.as_slice());
        let form = [psi.dot(&here.slope), 0.5 * psi.dot(&(change * along))].map(f64::abs);
        if form.iter().all(|x| x.is_finite()) {
            Ok(form)
        } else {
            Err(Error::domain("the fold has no normal form"))
        }
    }
}
