//! Families of problems in one parameter, for the continuation of [`crate::solve::arclength`].

use super::RodSection;
use super::line::Wrench;
use super::problem::Problem;
use crate::error::Result;
use crate::solve::family::{Family, Linearised};
use nalgebra::{SVector, Vector6};

/// A solution of a family of statics, in the user's frame and units.
#[derive(Debug, Clone, PartialEq)]
pub struct State {
    /// Base wrench (m(0), n) in the world frame.
    pub base: Wrench,
    /// The section at the end: pose, couple and force there, energy of the rod.
    pub end: RodSection,
    /// Size of the equations left over, in the numerics' units (length, B/L, B/L^2).
    pub residual: f64,
}

/// A family of equilibria of a rod, whatever its unknowns are.
pub trait Statical<const N: usize>: Family<N> {
    /// The rod at a solution.
    ///
    /// # Errors
    /// No such rod at p; a wrench that the rod cannot follow.
    fn state(&self, x: &SVector<f64, N>, p: f64) -> Result<State>;
}

/// Problems in one parameter; the unknowns are the base wrench in the clamp's frame, in units B/L and B/L^2.
///
/// Equations and their derivatives by the wrench are exact; those by the parameter are central differences, of the
/// end condition alone unless the parameter changes the rod. They only set directions: no point depends on them.
pub struct RodFamily<P> {
    problem: P,
    changes_rod: bool,
    step: f64,
}

impl<P: Fn(f64) -> Result<Problem>> RodFamily<P> {
    /// `problem(p)` for every p of a range of length `span`; `changes_rod` if length, section or rest strains depend on p.
    pub fn new(problem: P, changes_rod: bool, span: f64) -> Self {
        // The error of a central difference is of the order of its square, the noise 1e-12 over it.
        let step = if changes_rod { 1e-4 } else { 1e-5 };
        Self {
            problem,
            changes_rod,
            step: step * span.abs(),
        }
    }

    /// The problem at p.
    ///
    /// # Errors
    /// Those of the closure.
    pub fn problem(&self, p: f64) -> Result<Problem> {
        (self.problem)(p)
    }

    /// The unknowns of a base wrench in the world frame at p.
    ///
    /// # Errors
    /// Those of the closure.
    pub fn unknowns(&self, base: &Wrench, p: f64) -> Result<Vector6<f64>> {
        Ok((self.problem)(p)?.rod.inward(base))
    }

    fn slope(&self, x: &Vector6<f64>, p: f64) -> Result<Vector6<f64>> {
        let at = |p: f64| -> Result<Vector6<f64>> {
            let problem = (self.problem)(p)?;
            Ok(problem.residual(&problem.bare_trial(x)?))
        };
        self.difference(p, at)
    }

    /// A central difference, one-sided where one side is out of reach.
    fn difference(&self, p: f64, at: impl Fn(f64) -> Result<Vector6<f64>>) -> Result<Vector6<f64>> {
        let h = self.step;
        match (at(p + h), at(p - h)) {
            (Ok(after), Ok(before)) => Ok((after - before) / (2.0 * h)),
            (Ok(after), Err(_)) => Ok((after - at(p)?) / h),
            (Err(_), Ok(before)) => Ok((at(p)? - before) / h),
            (Err(why), Err(_)) => Err(why),
        }
    }
}

impl<P: Fn(f64) -> Result<Problem>> Family<6> for RodFamily<P> {
    fn linearised(&self, x: &Vector6<f64>, p: f64) -> Result<Linearised<6>> {
        let problem = (self.problem)(p)?;
        let trial = problem.trial(x)?;
        let (residual, jacobian) = problem.equations(&trial);
        let slope = if self.changes_rod {
            self.slope(x, p)?
        } else {
            // The end of the rod stays; only what it is compared with moves.
            self.difference(p, |p| Ok((self.problem)(p)?.residual(&trial)))?
        };
        Ok(Linearised {
            residual,
            jacobian,
            slope,
        })
    }

    fn index(&self, x: &Vector6<f64>, p: f64) -> Result<Option<usize>> {
        (self.problem)(p)?.index(x).map(Some)
    }
}

impl<P: Fn(f64) -> Result<Problem>> Statical<6> for RodFamily<P> {
    fn state(&self, x: &Vector6<f64>, p: f64) -> Result<State> {
        let problem = (self.problem)(p)?;
        Ok(State {
            base: problem.rod.outward_wrench(x),
            end: problem.end_section(x)?,
            residual: problem.residual(&problem.bare_trial(x)?).norm(),
        })
    }
}
