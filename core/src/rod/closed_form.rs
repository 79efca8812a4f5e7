//! Planar elastica in closed form: uniform, straight, unshearable, inextensible rods in a plane, without a couple at
//! the end.
//!
//! The two unknowns are the chart (p, w) of [`crate::elastica`], in units of 0.1; nothing is integrated. The
//! compliance c in the plane scales its unit stiffness: lam^2 = c |n|.

use super::chart::{Chart, as_array, dynamic, dynamic_matrix};
use super::ivp::Wrench;
use super::planar::Plane;
use super::problem::Problem;
use crate::elastica::chart::{ChartPoint, amplitude};
use crate::error::{Error, Result};
use crate::section::Compliance;
use nalgebra::{DMatrix, DVector, Matrix2, Vector2, Vector3};

/// The chart of an elastica in a plane.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct ClosedForm {
    plane: Plane,
}

/// The rod's end in closed form: position and force with their derivatives by (p, w), base couple.
#[derive(Debug, Clone, Copy)]
pub struct ClosedTrial {
    r: Vector2<f64>,
    d_r: Matrix2<f64>,
    n: Vector2<f64>,
    d_n: Matrix2<f64>,
}

/// Unit of the unknowns in (p, w). A change by 1 then changes the wrench by about 1, as in the other charts, so that
/// steps along a branch are comparable.
const UNIT: f64 = 0.1;
/// Largest |p| and w tried: larger ones are rods straight to rounding or wound up.
const P_LIMIT: f64 = 300.0;
const W_LIMIT: f64 = 300.0;

impl Problem {
    /// The closed form of this problem, or the reason why none is valid.
    pub(super) fn closed_form(
        &self,
        plane: &Plane,
    ) -> std::result::Result<ClosedForm, &'static str> {
        if self.weight.is_some() {
            return Err("there is a load along the rod");
        }
        let Some(linear) = self.rod.law.uniform() else {
            return Err("the section is not linear and uniform");
        };
        let c = linear.compliance.matrix();
        if (0..6).any(|i| (3..6).any(|j| c[(i, j)] != 0.0)) {
            return Err("the rod can be sheared or stretched");
        }
        if linear.rest.fixed_rows::<3>(0).norm() != 0.0 {
            return Err("the unloaded rod is curved");
        }
        if self.orientation.is_some() || self.couple != Vector3::zeros() {
            return Err("there is a couple at its end");
        }
        if self.end.follower {
            return Err("the load follows the end");
        }
        match self.end.position.iter().flatten().count() {
            0 if self.dead_force() == Vector3::zeros() => return Err("nothing loads its end"),
            0 | 3 => (),
            _ => return Err("the end is half held, half loaded"),
        }
        Ok(ClosedForm { plane: *plane })
    }
}

impl ClosedForm {
    /// Plane of the elastica.
    pub fn plane(&self) -> &Plane {
        &self.plane
    }

    /// Unknowns of the point (p, w) of the elastica's chart.
    pub(super) fn at(p: f64, w: f64) -> Vector2<f64> {
        Vector2::new(p, w) / UNIT
    }

    /// Prescribed position or force of the end, in the plane.
    pub(super) fn target(&self, problem: &Problem) -> Vector2<f64> {
        self.plane
            .flat(&(0..3).map(|i| problem.axes[i] * problem.targets[i]).sum())
    }

    /// Bending compliance in the plane.
    fn compliance(&self, problem: &Problem) -> f64 {
        let a = self.plane.normal();
        match problem.rod.law.uniform().map(|linear| &linear.compliance) {
            Some(Compliance::Diagonal(c)) => c[0] * a.x * a.x + c[1] * a.y * a.y,
            Some(Compliance::Full(c)) => a.dot(&(c.fixed_view::<3, 3>(0, 0) * a)),
            // Only uniform linear laws have a closed form.
            None => f64::NAN,
        }
    }

    fn is_held(problem: &Problem) -> bool {
        problem.end.position[0].is_some()
    }

    /// Unknowns under a small force along `n`; None if the force only pulls.
    pub(super) fn slightly_loaded(
        &self,
        problem: &Problem,
        n: &Vector2<f64>,
    ) -> Option<Vector2<f64>> {
        // As lam -> 0: alpha = -2 asin kap, n = -lam^2 (cos, sin) alpha.
        let alpha = (-n.y).atan2(-n.x);
        let kap = -(0.5 * alpha).sin();
        let p = kap.atanh();
        (p.abs() < 15.0).then(|| {
            let lam = (self.compliance(problem) * n.norm()).sqrt();
            Self::at(p, lam * (0.5 * alpha).cos())
        })
    }
}

impl Chart for ClosedForm {
    type Trial = ClosedTrial;

    fn size(&self) -> usize {
        2
    }

    fn is_planar(&self) -> bool {
        true
    }

    fn trial(&self, problem: &Problem, x: &DVector<f64>) -> Result<ClosedTrial> {
        let c = self.compliance(problem);
        let x = as_array::<2>(x)?;
        let (p, w) = (UNIT * x[0], UNIT * x[1]);
        if !(p.abs() < P_LIMIT && 0.0 < w && w < W_LIMIT) {
            return Err(Error::domain(format!(
                "(p, w) = ({p}, {w}) lies outside the chart of the elastica; a straight rod under tension does too: \
                 use the path \"planar\""
            )));
        }
        let at = ChartPoint::new(p, w);
        let i = &at.integrals;
        let direction = Vector2::new(at.cos_alpha, at.sin_alpha);
        let across = Vector2::new(-at.sin_alpha, at.cos_alpha);
        let (lam_p, lam_w) = (i.lam_p(), 1.0 / i.d);
        let (alpha_p, alpha_w) = (
            -2.0 * i.kap_c * i.kap_c * i.c / i.d,
            2.0 * i.kap * i.s / i.d,
        );
        let d_force = |lam: f64, alpha: f64| {
            -(direction * (2.0 * i.lam * lam) + across * (i.lam * i.lam * alpha)) / c
        };
        Ok(ClosedTrial {
            r: at.to_fixed(at.turned).into(),
            d_r: Matrix2::from_columns(&[at.column_p.into(), at.column_w.into()]) * UNIT,
            n: -direction * (i.lam * i.lam / c),
            d_n: Matrix2::from_columns(&[d_force(lam_p, alpha_p), d_force(lam_w, alpha_w)]) * UNIT,
        })
    }

    fn bare_trial(&self, problem: &Problem, x: &DVector<f64>) -> Result<ClosedTrial> {
        self.trial(problem, x)
    }

    fn residual(&self, problem: &Problem, trial: &ClosedTrial) -> DVector<f64> {
        let there = if Self::is_held(problem) {
            trial.r
        } else {
            trial.n
        };
        dynamic(there - self.target(problem))
    }

    fn equations(&self, problem: &Problem, trial: &ClosedTrial) -> (DVector<f64>, DMatrix<f64>) {
        let d = if Self::is_held(problem) {
            trial.d_r
        } else {
            trial.d_n
        };
        (self.residual(problem, trial), dynamic_matrix(d))
    }

    fn wrench(&self, problem: &Problem, x: &DVector<f64>) -> Result<Wrench> {
        let ClosedTrial { r, n, .. } = self.trial(problem, x)?;
        // Base couple from m(1) = 0.
        Ok(self.plane.wrench(&Vector3::new(r.perp(&n), n.x, n.y)))
    }

    /// Elastica with the force of the wrench, and the nearest couple in the chart.
    fn unknowns(&self, problem: &Problem, b: &Wrench) -> Result<DVector<f64>> {
        let (flat, _) = self.plane.in_plane_part(b);
        let n = Vector2::new(flat[1], flat[2]);
        let c = self.compliance(problem);
        let lam = (c * n.norm()).sqrt();
        let alpha = (-n.y).atan2(-n.x);
        let bend = c * flat[0] / (2.0 * lam);
        // theta'^2/2 - lam^2 cos(theta - alpha) is constant along the rod, and theta' = 0 at the end.
        let size = (0.5 * alpha).sin().hypot(bend).min(1.0 - 1e-13).atanh();
        let w = amplitude(size, lam)?;
        // sin(-alpha/2) = kap cos w, theta'(0) = 2 lam kap D sin w.
        let (sin, cos) = w.sin_cos();
        let sign = -(0.5 * alpha).sin() * cos + bend * sin;
        Ok(dynamic(Self::at(size.copysign(sign), w)))
    }
}
