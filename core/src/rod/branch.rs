//! Families of problems in one parameter, for the continuation of [`crate::solve::arclength`].

use super::RodSection;
use super::chart::{Chart, Spatial};
use super::ivp::Wrench;
use super::problem::Problem;
use crate::error::Result;
use crate::solve::difference_step::derivative;
use crate::solve::extrapolated_slope::{Slope, first_step};
use crate::solve::parametrised_problem::{Family, Linearised};
use nalgebra::{DVector, Vector2, Vector3};
use std::sync::OnceLock;

/// Change of the equations over which a difference by the parameter is taken.
const CHANGE: f64 = 1e-2;

/// Problems in one parameter, in a chart: [`Spatial`], or a [`super::Plane`] or [`super::ClosedForm`] valid for all
/// of them.
///
/// Equations and their derivatives by the unknowns are exact. Derivatives by the parameter are central differences,
/// of the end condition alone unless the parameter changes the rod. They only set directions: no point depends on
/// them. A rod that turns about its clamp for nothing keeps the phase in which the family meets it first.
pub struct RodFamily<P, C = Spatial> {
    problem: P,
    chart: C,
    changes_rod: bool,
    step: f64,
    /// Direction of the pointer of a free turn where the turn was first met: the phase of the whole branch.
    pointer: OnceLock<Vector2<f64>>,
}

/// A point of a branch of equilibria.
#[derive(Debug, Clone, PartialEq)]
pub struct BranchEquilibrium {
    /// Base wrench (m(0), n) in the world frame.
    pub base: Wrench,
    /// The section at the end.
    pub end: RodSection,
    /// Norm of the residual, in the numerics' units (length, B/L, B/L^2).
    pub residual: f64,
}

/// A family of equilibria of rods, in any chart.
pub trait Statical: Family {
    /// The equilibrium at a point of the branch.
    ///
    /// # Errors
    /// Those of the problem and of the rod.
    fn state(&self, x: &DVector<f64>, p: f64) -> Result<BranchEquilibrium>;
}

impl<P: Fn(f64) -> Result<Problem>> RodFamily<P> {
    /// `problem(p)` in space for every p of a range of length `span`; `changes_rod` if length, section or rest strains
    /// depend on p.
    pub fn new(problem: P, changes_rod: bool, span: f64) -> Self {
        Self::in_chart(problem, changes_rod, span, Spatial)
    }
}

impl<P: Fn(f64) -> Result<Problem>, C> RodFamily<P, C> {
    /// As [`RodFamily::new`], in another chart.
    pub fn in_chart(problem: P, changes_rod: bool, span: f64, chart: C) -> Self {
        // The error of a central difference is of the order of the squared step, the noise 1e-12 over the step.
        let step = if changes_rod { 1e-4 } else { 1e-5 };
        Self {
            problem,
            chart,
            changes_rod,
            step: step * span.abs(),
            pointer: OnceLock::new(),
        }
    }

    /// The problem at p.
    ///
    /// # Errors
    /// The errors of the closure that makes the problem at p.
    pub fn problem(&self, p: f64) -> Result<Problem> {
        (self.problem)(p)
    }

    /// The unknowns of a base wrench in the world frame at p.
    ///
    /// # Errors
    /// Those of the closure; a wrench outside the chart.
    pub fn unknowns(&self, base: &Wrench, p: f64) -> Result<DVector<f64>>
    where
        C: Chart,
    {
        let problem = (self.problem)(p)?;
        self.chart.unknowns(&problem, &problem.rod.inward(base))
    }

    /// The equations at another parameter and the same unknowns, beside those of the trial `known`.
    fn residual_beside(&self, x: &DVector<f64>, p: f64, known: &C::Trial) -> Result<DVector<f64>>
    where
        C: Chart,
    {
        let problem = (self.problem)(p)?;
        let beside = self.chart.trial_beside(&problem, x, known)?;
        Ok(self.chart.residual(&problem, &beside))
    }

    /// Factors of the equations at p along a critical direction that changes the end by `end`, as [`Chart::working`].
    pub(super) fn working(&self, p: f64, end: &[Vector3<f64>; 2]) -> Result<Vec<Option<f64>>>
    where
        C: Chart,
    {
        Ok(self.chart.working(&(self.problem)(p)?, end))
    }
}

impl<P: Fn(f64) -> Result<Problem>, C: Chart> Family for RodFamily<P, C> {
    fn size(&self) -> usize {
        self.chart.size()
    }

    fn linearised(&self, x: &DVector<f64>, p: f64) -> Result<Linearised> {
        let problem = (self.problem)(p)?;
        let chart = &self.chart;
        let trial = chart.trial(&problem, x)?;
        let (mut residual, mut jacobian) = chart.equations(&problem, &trial);
        if let Some(phase) = chart.phase(&problem, x, &trial)?
            && let Some(now) = phase.pointer.try_normalize(f64::MIN_POSITIVE)
        {
            let first = self.pointer.get_or_init(|| now);
            phase.hold(first, &mut residual, &mut jacobian);
        }
        let slope = derivative(p, self.step, CHANGE, &|p| {
            let problem = (self.problem)(p)?;
            if self.changes_rod {
                let beside = chart.trial_beside(&problem, x, &trial)?;
                return Ok(chart.residual(&problem, &beside));
            }
            // The parameter changes the end condition alone: the rod is integrated once for both differences.
            Ok(chart.residual(&problem, &trial))
        })?;
        Ok(Linearised {
            residual,
            jacobian,
            slope,
        })
    }

    fn by_parameter(&self, x: &DVector<f64>, p: f64, step: f64) -> Result<Slope> {
        let known = self.chart.trial(&(self.problem)(p)?, x)?;
        Slope::at(step, &mut |h| self.residual_beside(x, p + h, &known))
    }

    fn first_step(&self, x: &DVector<f64>, p: f64) -> Result<f64> {
        let known = self.chart.trial(&(self.problem)(p)?, x)?;
        first_step(p, &mut |p| self.residual_beside(x, p, &known))
    }

    fn index(&self, x: &DVector<f64>, p: f64) -> Result<Option<usize>> {
        let problem = (self.problem)(p)?;
        // Follower loads have no potential: no index, and only singular tangents are special points.
        if problem.is_followed() {
            return Ok(None);
        }
        self.chart.index(&problem, x).map(Some)
    }
}

impl<P: Fn(f64) -> Result<Problem>, C: Chart> Statical for RodFamily<P, C> {
    fn state(&self, x: &DVector<f64>, p: f64) -> Result<BranchEquilibrium> {
        let problem = (self.problem)(p)?;
        let trial = self.chart.bare_trial(&problem, x)?;
        let b = self.chart.wrench(&problem, x)?;
        Ok(BranchEquilibrium {
            base: problem.rod.outward_wrench(&b),
            end: self.chart.end(&problem, x)?,
            residual: self.chart.residual(&problem, &trial).norm(),
        })
    }
}
