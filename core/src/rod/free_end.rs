//! Rods whose end bears no couple, charted by the force on the end along its own directors.
//!
//! The end is taken as the origin of an initial-value problem that runs back to the clamp. This needs three unknowns
//! and three columns of the tangent instead of six, and charts the 3-dimensional submanifold m(1) = 0 of theory Sec.
//! 3. From the end, the clamp stands at r~ with directors R~; seen from the clamp, the end stands at -R~^T r~ with
//! R~^T.

use super::chart::{Chart, as_array, dynamic, dynamic_matrix};
use super::ivp::{self, LineState, Wrench};
use super::problem::{Problem, Trial};
use super::scaled_law::ScaledLaw;
use super::zero_modes::FreePhase;
use crate::error::Result;
use crate::math::se3::halves;
use nalgebra::{DMatrix, DVector, Matrix2xX, Matrix3, Vector3, Vector6};

/// The chart: force on the end, along the directors there, in units B/L^2.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct FreeEnd;

/// State of the end in the clamp's frame, with derivatives by the unknowns.
#[derive(Debug, Clone, Copy)]
pub struct FreeEndTrial {
    /// The unknowns.
    pub(super) q: Vector3<f64>,
    pub(super) r: Vector3<f64>,
    pub(super) energy: f64,
    pub(super) n: Vector3<f64>,
    pub(super) d_r: Matrix3<f64>,
    pub(super) d_n: Matrix3<f64>,
}

impl FreeEndTrial {
    /// The end under the reversed law, with K = 3 columns of the tangent, or none.
    pub(super) fn new<const K: usize>(
        reversed: &ScaledLaw,
        q: &Vector3<f64>,
        tolerance: f64,
    ) -> Result<Self> {
        let clamp: LineState<K> = ivp::clamp_from_end(reversed, q, tolerance)?;
        let rotation = clamp.rotation().transpose();
        let from_end = clamp.position();
        let column = |row: usize, j: usize| {
            if j < K {
                Vector3::from_fn(|i, _| clamp.tangent[row + i][j])
            } else {
                Vector3::zeros()
            }
        };
        let d_r = |j: usize| rotation * (column(0, j).cross(&from_end) - column(3, j));
        let d_n = |j: usize| rotation * (Vector3::ith(j, 1.0) - column(0, j).cross(q));
        Ok(Self {
            q: *q,
            r: -rotation * from_end,
            energy: clamp.energy(),
            n: rotation * q,
            d_r: Matrix3::from_columns(&[d_r(0), d_r(1), d_r(2)]),
            d_n: Matrix3::from_columns(&[d_n(0), d_n(1), d_n(2)]),
        })
    }

    /// Base wrench (m(0), n) in the clamp's frame, from m(1) = 0.
    pub(super) fn wrench(&self) -> Wrench {
        let m = self.r.cross(&self.n);
        Vector6::new(m.x, m.y, m.z, self.n.x, self.n.y, self.n.z)
    }
}

impl Problem {
    /// True if the end bears no couple, and the force is constant along the rod.
    pub(super) fn has_free_end(&self) -> bool {
        self.weight.is_none()
            && !self.is_mixed()
            && self.orientation.is_none()
            && [self.couple, self.arm] == [Vector3::zeros(); 2]
    }
}

impl Chart for FreeEnd {
    type Trial = FreeEndTrial;

    fn size(&self) -> usize {
        3
    }

    fn trial(&self, problem: &Problem, x: &DVector<f64>) -> Result<FreeEndTrial> {
        FreeEndTrial::new::<3>(
            &problem.rod.law.reversed(),
            &as_array(x)?,
            problem.tolerance,
        )
    }

    fn bare_trial(&self, problem: &Problem, x: &DVector<f64>) -> Result<FreeEndTrial> {
        FreeEndTrial::new::<0>(
            &problem.rod.law.reversed(),
            &as_array(x)?,
            problem.tolerance,
        )
    }

    fn residual(&self, problem: &Problem, trial: &FreeEndTrial) -> DVector<f64> {
        if problem.end.follower {
            return dynamic(trial.q - Vector3::from(problem.targets));
        }
        DVector::from_fn(3, |i, _| {
            let held = problem.end.position[i].is_some();
            let there = if held { &trial.r } else { &trial.n };
            problem.axes[i].dot(there) - problem.targets[i]
        })
    }

    fn equations(&self, problem: &Problem, trial: &FreeEndTrial) -> (DVector<f64>, DMatrix<f64>) {
        let mut matrix = Matrix3::identity();
        if !problem.end.follower {
            for i in 0..3 {
                let held = problem.end.position[i].is_some();
                let d = if held { &trial.d_r } else { &trial.d_n };
                matrix.set_row(i, &(problem.axes[i].transpose() * d));
            }
        }
        (self.residual(problem, trial), dynamic_matrix(matrix))
    }

    /// Along the directors of the end a free turn turns the force about d3.
    fn phase(
        &self,
        problem: &Problem,
        _: &DVector<f64>,
        trial: &FreeEndTrial,
    ) -> Result<Option<FreePhase>> {
        let wrench = trial.wrench();
        if problem.end.follower || problem.free_turn(&wrench).is_none() {
            return Ok(None);
        }
        let end = Trial::bare(trial.r, Matrix3::identity(), Vector3::zeros(), trial.n);
        let [_, place] = problem.phase_at_end(&end);
        Ok((place.norm() > 0.0).then(|| FreePhase {
            against: dynamic(place),
            pointer: trial.q.xy(),
            by: Matrix2xX::identity(3),
        }))
    }

    fn wrench(&self, problem: &Problem, x: &DVector<f64>) -> Result<Wrench> {
        Ok(self.bare_trial(problem, x)?.wrench())
    }

    fn winding(&self, problem: &Problem, x: &DVector<f64>) -> Result<f64> {
        let n = as_array::<3>(x)?;
        let b = Vector6::new(0.0, 0.0, 0.0, n.x, n.y, n.z);
        ivp::rate(&problem.rod.law.reversed(), &b)
    }

    /// Force of the wrench along the directors of the end under that wrench.
    fn unknowns(&self, problem: &Problem, b: &Wrench) -> Result<DVector<f64>> {
        let trial = problem.bare_trial(b)?;
        Ok(dynamic(trial.rotation.transpose() * halves(b).1))
    }
}
