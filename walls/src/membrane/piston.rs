//! A piston that closes the vessel of a balloon: an equilibrium manifold of dimension 1, for a heavy body on it.
//!
//! Chart is the stretch x of the balloon. Pose is the displacement y of the piston into the vessel, which takes the
//! volume S y out of it, S being the area of the piston. With the content c of gas and the pressure p_a outside,
//! ```text
//! (p(x) + p_a) (V(x) + V_r - S y) = c,   w = -p S,   U = U_m(x) - c ln(V_g) + p_a V_g,   V_g = c/(p + p_a),
//! dy/dx = (V' + c p'/(p + p_a)^2) / S,   dU = -w dy.
//! ```
//! With the piston held the second derivative of the energy by x has the sign of dy/dx: folds are its zeros.

use super::gas::Vessel;
use super::{Inflated, LEAST_STRETCH, MOST_STRETCH, Shape, sphere};
use nalgebra::{Matrix1, Vector1};
use snaprod_core::manifold::{EquilibriumManifold, ManifoldPoint, Multivalued, Sheet, Sign};
use snaprod_core::solve::roots::chandrupatla;
use snaprod_core::{Error, Result};
use std::f64::consts::PI;

/// A balloon on a vessel of gas that a piston closes.
///
/// Sheets: S_0^- before the first fold, S_1^+ between two folds (unstable), S_0^+ past the second. Without folds there
/// is S_0^+ alone.
#[derive(Debug, Clone)]
pub struct PistonOnBalloon {
    balloon: Inflated,
    vessel: Vessel,
    contents: f64,
    area: f64,
    /// Stretches at folds, in growing order.
    folds: Vec<f64>,
}

/// Distance in stretch up to which a point counts as a fold: the coordinate of the piston differs by rounding there.
const ON_FOLD: f64 = 1e-7;

impl PistonOnBalloon {
    /// A `balloon` on a `vessel` with the content `contents` of gas, p V absolute, behind a piston of the area `area`.
    ///
    /// # Errors
    /// A membrane that is no sphere; an area or a content that is not finite and positive.
    pub fn new(balloon: Inflated, vessel: Vessel, contents: f64, area: f64) -> Result<Self> {
        if balloon.shape != Shape::Sphere {
            return Err(Error::domain("pistons are for spheres, shape = \"sphere\""));
        }
        for (name, value) in [("area of the piston", area), ("content of gas", contents)] {
            if !(0.0 < value && value < f64::INFINITY) {
                return Err(Error::domain(format!(
                    "the {name} {value} must be finite and > 0"
                )));
            }
        }
        let mut piston = Self {
            balloon,
            vessel,
            contents,
            area,
            folds: Vec::new(),
        };
        let slope = |x: f64| Ok(piston.slope(x));
        piston.folds = balloon.roots(&slope, LEAST_STRETCH, MOST_STRETCH)?;
        Ok(piston)
    }

    /// Stretches of the balloon at the folds, in growing order.
    pub fn folds(&self) -> &[f64] {
        &self.folds
    }

    /// The place y of the piston at the stretch x.
    fn pose(&self, x: f64) -> f64 {
        let state = self.unit(x);
        let gas = self.contents / (state.0 + self.vessel.outside);
        (state.1 + self.vessel.volume - gas) / self.area
    }

    /// Pressure and volume of the balloon.
    fn unit(&self, x: f64) -> (f64, f64) {
        let at = sphere::state(&self.balloon.rubber, x);
        let pressure = at.pressure * self.balloon.thickness / self.balloon.radius;
        (pressure, at.volume * self.balloon.radius.powi(3))
    }

    /// dy/dx.
    fn slope(&self, x: f64) -> f64 {
        let scale = self.balloon.thickness / self.balloon.radius;
        let steeper = sphere::slope(&self.balloon.rubber, x) * scale;
        let pressure = self.unit(x).0 + self.vessel.outside;
        let wider = 4.0 * PI * x * x * self.balloon.radius.powi(3);
        (wider + self.contents * steeper / (pressure * pressure)) / self.area
    }

    /// Number of folds below x.
    fn passed(&self, x: f64) -> usize {
        self.folds.iter().filter(|fold| **fold < x).count()
    }

    /// The stable stretches at the place `y`, in growing order.
    fn stable_stretches(&self, y: f64) -> Vec<f64> {
        let mut ends = vec![1.0];
        ends.extend(&self.folds);
        ends.push(MOST_STRETCH);
        let off = |x: f64| self.pose(x) - y;
        let stable = |part: &&[f64]| self.slope(0.5 * (part[0] + part[1])) > 0.0;
        let parts = ends.windows(2).filter(stable);
        let root =
            |part: &[f64]| chandrupatla(off, (part[0], off(part[0])), (part[1], off(part[1])), 0.0);
        parts.filter_map(root).collect()
    }
}

impl EquilibriumManifold<1> for PistonOnBalloon {
    fn point(&self, q: &Vector1<f64>) -> Option<ManifoldPoint<1>> {
        let x = q[0];
        // A balloon of less than its unloaded size wrinkles.
        if !(1.0..MOST_STRETCH).contains(&x) {
            return None;
        }
        let (pressure, _) = self.unit(x);
        let absolute = pressure + self.vessel.outside;
        if !(absolute > 0.0) {
            return None;
        }
        let gas = self.contents / absolute;
        let stored = sphere::state(&self.balloon.rubber, x).energy
            * self.balloon.thickness
            * self.balloon.radius.powi(2);
        Some(ManifoldPoint {
            pose: Vector1::new(self.pose(x)),
            force: Vector1::new(-pressure * self.area),
            energy: stored - self.contents * gas.ln() + self.vessel.outside * gas,
            jacobian: Matrix1::new(self.slope(x)),
            pace: 4.0 * PI * self.balloon.radius.powi(3) / self.area,
        })
    }

    fn index(&self, q: &Vector1<f64>) -> Result<usize> {
        if !(1.0..MOST_STRETCH).contains(&q[0]) {
            return Err(Error::domain(format!(
                "the stretch {} of the balloon must be in [1, {MOST_STRETCH})",
                q[0]
            )));
        }
        Ok(usize::from(self.slope(q[0]) < 0.0))
    }
}

impl Multivalued<1> for PistonOnBalloon {
    fn sheet(&self, q: &Vector1<f64>) -> Sheet {
        let passed = self.passed(q[0]);
        let sign = if passed == 0 && !self.folds.is_empty() {
            Sign::Minus
        } else {
            Sign::Plus
        };
        Sheet {
            mode: u32::from(passed == 1),
            sign,
        }
    }

    fn stable_at(&self, pose: &Vector1<f64>) -> Result<Vec<Vector1<f64>>> {
        if !pose[0].is_finite() {
            return Err(Error::domain(format!(
                "the place y = {} of the piston must be finite",
                pose[0]
            )));
        }
        let mut found: Vec<(f64, Vector1<f64>)> = (self.stable_stretches(pose[0]).into_iter())
            .filter_map(|x| {
                let q = Vector1::new(x);
                Some((self.point(&q)?.energy, q))
            })
            .collect();
        found.sort_by(|a, b| a.0.total_cmp(&b.0));
        Ok(found.into_iter().map(|(_, q)| q).collect())
    }

    fn settle(&self, q: &Vector1<f64>, leaving: &Vector1<f64>) -> Result<Vector1<f64>> {
        let (x, direction) = (q[0], leaving[0]);
        let on_fold = self.folds.iter().any(|fold| (fold - x).abs() < ON_FOLD * x);
        if !(on_fold || self.slope(x) < 0.0) || direction == 0.0 || direction.is_nan() {
            return Err(Error::domain(format!(
                "the balloon does not leave the stretch {x} in the direction {direction}: it is stable there"
            )));
        }
        let beyond = |other: &f64| (other - x) * direction.signum() > 1e-4;
        let stable = self.stable_stretches(self.pose(x));
        let mut ahead = stable.into_iter().filter(beyond);
        // The nearest in the direction of the fall.
        let landed = if direction > 0.0 {
            ahead.next()
        } else {
            ahead.next_back()
        };
        landed.map(Vector1::new).ok_or_else(|| {
            Error::unreachable(format!(
                "the balloon falls from the stretch {x} to no stable state: past the stretch {MOST_STRETCH} or below 1"
            ))
        })
    }
}
