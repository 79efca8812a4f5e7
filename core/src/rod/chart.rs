//! Charts in which a problem is solved: all six components of the base wrench in space, fewer where the data allow it.

use super::line::{self, Wrench};
use super::problem::{Problem, Trial};
use crate::error::Result;
use nalgebra::{Matrix6, SMatrix, SVector, Vector6};

/// Unknowns and equations of a problem, and the way from and to the base wrench.
pub trait Chart<const N: usize> {
    /// The rod at trial unknowns.
    type Trial;

    /// The rod at `x` with its derivatives by `x`.
    fn trial(&self, problem: &Problem, x: &SVector<f64, N>) -> Result<Self::Trial>;

    /// The rod at `x` without derivatives, which are then meaningless.
    fn bare_trial(&self, problem: &Problem, x: &SVector<f64, N>) -> Result<Self::Trial>;

    /// The equations of the end condition.
    fn residual(&self, problem: &Problem, trial: &Self::Trial) -> SVector<f64, N>;

    /// The equations and their derivatives by the unknowns.
    fn equations(
        &self,
        problem: &Problem,
        trial: &Self::Trial,
    ) -> (SVector<f64, N>, SMatrix<f64, N, N>);

    /// The base wrench, in the clamp's frame and the numerics' units.
    fn wrench(&self, problem: &Problem, x: &SVector<f64, N>) -> Result<Wrench>;

    /// How fast the rod winds, about, under `x`: radians along the whole length.
    fn winding(&self, problem: &Problem, x: &SVector<f64, N>) -> Result<f64> {
        line::rate(&problem.rod.law, &self.wrench(problem, x)?)
    }

    /// The unknowns of a base wrench, or of the nearest one in the chart.
    fn unknowns(&self, problem: &Problem, b: &Wrench) -> Result<SVector<f64, N>>;
}

/// The base wrench itself: any rod, any end.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Spatial;

impl Chart<6> for Spatial {
    type Trial = Trial;

    fn trial(&self, problem: &Problem, x: &Vector6<f64>) -> Result<Trial> {
        problem.trial(x)
    }

    fn bare_trial(&self, problem: &Problem, x: &Vector6<f64>) -> Result<Trial> {
        problem.bare_trial(x)
    }

    fn residual(&self, problem: &Problem, trial: &Trial) -> Vector6<f64> {
        problem.residual(trial)
    }

    fn equations(&self, problem: &Problem, trial: &Trial) -> (Vector6<f64>, Matrix6<f64>) {
        problem.equations(trial)
    }

    fn wrench(&self, _: &Problem, x: &Vector6<f64>) -> Result<Wrench> {
        Ok(*x)
    }

    fn unknowns(&self, _: &Problem, b: &Wrench) -> Result<Vector6<f64>> {
        Ok(*b)
    }
}
