//! Charts of rod problems: all six components of the base wrench in space, fewer where the data allow it.

use super::RodSection;
use super::ivp::{self, Wrench};
use super::problem::{Problem, Trial};
use super::zero_modes::FreePhase;
use crate::error::{Error, Result};
use nalgebra::{DMatrix, DVector, SMatrix, SVector, Vector3};

/// Unknowns and equations of a problem, with the conversion from and to the base wrench.
pub trait Chart {
    /// The rod at trial unknowns.
    type Trial;

    /// Number of unknowns.
    fn size(&self) -> usize;

    /// True if the unknowns keep the rod in a plane.
    fn is_planar(&self) -> bool {
        false
    }

    /// The rod at `x` with its derivatives by `x`.
    fn trial(&self, problem: &Problem, x: &DVector<f64>) -> Result<Self::Trial>;

    /// The rod at `x` without derivatives, whose values are then meaningless.
    fn bare_trial(&self, problem: &Problem, x: &DVector<f64>) -> Result<Self::Trial>;

    /// The rod at `x` of a problem that differs little from that of the trial `known` at the same `x`, for differences:
    /// right to first order, without derivatives.
    fn trial_beside(
        &self,
        problem: &Problem,
        x: &DVector<f64>,
        _known: &Self::Trial,
    ) -> Result<Self::Trial> {
        self.bare_trial(problem, x)
    }

    /// The equations of the end condition.
    fn residual(&self, problem: &Problem, trial: &Self::Trial) -> DVector<f64>;

    /// The equations and their derivatives by the unknowns.
    fn equations(&self, problem: &Problem, trial: &Self::Trial) -> (DVector<f64>, DMatrix<f64>);

    /// The free turn of the rod at `x` in these unknowns and equations; None without one, and in a plane.
    fn phase(&self, _: &Problem, _x: &DVector<f64>, _: &Self::Trial) -> Result<Option<FreePhase>> {
        Ok(None)
    }

    /// The base wrench, in the clamp's frame and the numerics' units.
    fn wrench(&self, problem: &Problem, x: &DVector<f64>) -> Result<Wrench>;

    /// Rate of change of the rod's variables under `x`, in radians along the whole length; an estimate.
    fn winding(&self, problem: &Problem, x: &DVector<f64>) -> Result<f64> {
        ivp::rate(&problem.rod.law, &self.wrench(problem, x)?)
    }

    /// The unknowns of a base wrench, or of the nearest base wrench in the chart.
    fn unknowns(&self, problem: &Problem, b: &Wrench) -> Result<DVector<f64>>;

    /// Size of base wrenches with unknowns of the given size.
    fn reach(&self, size: f64) -> f64 {
        size
    }

    /// Factor of each equation in the derivative of stored energy less the work of the loads along a critical
    /// direction. `end` is the change (force, place) of the end along that direction, along the clamp's directors
    /// (see `fold`). None if the chart does not provide it.
    fn working(&self, _: &Problem, _end: &[Vector3<f64>; 2]) -> Vec<Option<f64>> {
        vec![None; self.size()]
    }

    /// The Morse index of an equilibrium, as [`Problem::index_at`].
    fn index(&self, problem: &Problem, x: &DVector<f64>) -> Result<usize> {
        problem.index(&self.wrench(problem, x)?)
    }

    /// The section at the end, in the world.
    fn end(&self, problem: &Problem, x: &DVector<f64>) -> Result<RodSection> {
        problem.end_section(&self.wrench(problem, x)?)
    }

    /// Sections at places in [0, 1], in growing order, in the world.
    fn sections(&self, problem: &Problem, x: &DVector<f64>, at: &[f64]) -> Result<Vec<RodSection>> {
        let b = self.wrench(problem, x)?;
        problem.sections(&problem.rod.outward_wrench(&b), at)
    }
}

/// Object-safe form of [`Chart`]: searches for an equilibrium are compiled once.
pub(super) trait AnyChart {
    /// [`Chart::size`].
    fn size(&self) -> usize;
    /// [`Chart::equations`] at `x`.
    fn equations(&self, problem: &Problem, x: &DVector<f64>) -> Result<Equations>;
    /// [`Chart::wrench`].
    fn wrench(&self, problem: &Problem, x: &DVector<f64>) -> Result<Wrench>;
    /// [`Chart::winding`].
    fn winding(&self, problem: &Problem, x: &DVector<f64>) -> Result<f64>;
    /// [`Chart::unknowns`].
    fn unknowns(&self, problem: &Problem, b: &Wrench) -> Result<DVector<f64>>;
}

impl<C: Chart> AnyChart for C {
    fn size(&self) -> usize {
        Chart::size(self)
    }

    fn equations(&self, problem: &Problem, x: &DVector<f64>) -> Result<Equations> {
        Ok(Chart::equations(self, problem, &self.trial(problem, x)?))
    }

    fn wrench(&self, problem: &Problem, x: &DVector<f64>) -> Result<Wrench> {
        Chart::wrench(self, problem, x)
    }

    fn winding(&self, problem: &Problem, x: &DVector<f64>) -> Result<f64> {
        Chart::winding(self, problem, x)
    }

    fn unknowns(&self, problem: &Problem, b: &Wrench) -> Result<DVector<f64>> {
        Chart::unknowns(self, problem, b)
    }
}

/// Residuals and their derivatives by the unknowns.
pub(super) type Equations = (DVector<f64>, DMatrix<f64>);

/// Unknowns as an array of the chart's size.
///
/// # Errors
/// A different number of unknowns.
pub(super) fn as_array<const N: usize>(x: &DVector<f64>) -> Result<SVector<f64, N>> {
    if x.len() == N {
        return Ok(SVector::from_column_slice(x.as_slice()));
    }
    Err(Error::domain(format!(
        "the rod has {N} unknowns in this chart, not {}",
        x.len()
    )))
}

/// A vector of fixed size in the form of the solvers.
pub(super) fn dynamic<const N: usize>(x: SVector<f64, N>) -> DVector<f64> {
    DVector::from_column_slice(x.as_slice())
}

/// A matrix of fixed size in the form of the solvers.
pub(super) fn dynamic_matrix<const N: usize>(matrix: SMatrix<f64, N, N>) -> DMatrix<f64> {
    DMatrix::from_column_slice(N, N, matrix.as_slice())
}

/// The base wrench itself: valid for any rod and any end condition.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Spatial;

impl Chart for Spatial {
    type Trial = Trial;

    fn size(&self) -> usize {
        6
    }

    fn trial(&self, problem: &Problem, x: &DVector<f64>) -> Result<Trial> {
        problem.trial(&as_array(x)?)
    }

    fn bare_trial(&self, problem: &Problem, x: &DVector<f64>) -> Result<Trial> {
        problem.bare_trial(&as_array(x)?)
    }

    fn residual(&self, problem: &Problem, trial: &Trial) -> DVector<f64> {
        dynamic(problem.residual(trial))
    }

    fn equations(&self, problem: &Problem, trial: &Trial) -> (DVector<f64>, DMatrix<f64>) {
        let (residual, matrix) = problem.equations(trial);
        (dynamic(residual), dynamic_matrix(matrix))
    }

    fn phase(
        &self,
        problem: &Problem,
        x: &DVector<f64>,
        trial: &Trial,
    ) -> Result<Option<FreePhase>> {
        Ok(problem.phase(&as_array(x)?, trial))
    }

    fn wrench(&self, _: &Problem, x: &DVector<f64>) -> Result<Wrench> {
        as_array(x)
    }

    fn unknowns(&self, _: &Problem, b: &Wrench) -> Result<DVector<f64>> {
        Ok(dynamic(*b))
    }
}
