//! The elastica as an equilibrium manifold: chart (p, w), pose (x, y).

use super::chart::ChartPoint;
use super::equilibrium::sheet;
use super::{folds, inversion, layer};
use crate::error::Result;
use crate::manifold::{EquilibriumManifold, ManifoldPoint, Sheet};
use nalgebra::{Matrix2, Vector2};

/// A uniform inextensible planar rod of length 1 and bending stiffness 1, clamped at the origin
/// along +x, with a force but no couple at its free end (theory Sec. 2).
#[derive(Debug, Clone, Copy, Default, PartialEq, Eq)]
pub struct Elastica;

/// Largest |p| served: far beyond the tautest rod whose end double precision can tell from |r| = 1.
pub const P_MAX: f64 = 1e6;
/// Load below which all stable equilibria are searched.
const STABLE_LAMBDA: f64 = 14.0;

impl EquilibriumManifold<2> for Elastica {
    #[inline]
    fn point(&self, q: &Vector2<f64>) -> Option<ManifoldPoint<2>> {
        let (p, w) = (q[0], q[1]);
        if !(w > 0.0 && w < 1e6 && p.abs() < P_MAX) {
            return None;
        }
        let at = ChartPoint::new(p, w);
        let lam = at.integrals.lam;
        let [x, y] = at.to_fixed(at.turned);
        let [xp, yp] = at.to_fixed(at.turned_p);
        let [xw, yw] = at.to_fixed(at.turned_w);
        let pull = lam * lam;
        if !(pull > 0.0 && (xp + yp + xw + yw).is_finite()) {
            return None;
        }
        Some(ManifoldPoint {
            pose: Vector2::new(x, y),
            force: Vector2::new(pull * at.cos_alpha, pull * at.sin_alpha),
            energy: at.energy(),
            jacobian: Matrix2::new(xp, xw, yp, yw),
            // At the taut wall det ~ 1/lam^2: time then slows as 1/lam, the distance to the wall,
            // which turns the bounce (a repulsion 1/distance^2) into a polynomial in that time.
            pace: 1.0 / (1.0 + lam),
        })
    }

    fn index(&self, q: &Vector2<f64>) -> Result<usize> {
        folds::index(q[0], q[1])
    }

    fn sheet(&self, q: &Vector2<f64>) -> Sheet {
        sheet(q[0], q[1])
    }

    fn stable_at(&self, pose: &Vector2<f64>) -> Result<Vec<Vector2<f64>>> {
        // No stable rod carries more: the first fold of a stable rod away from the loops lies below.
        let mut found: Vec<_> = inversion::equilibria_at(pose[0], pose[1], STABLE_LAMBDA)?
            .into_iter()
            .filter(|e| e.index == 0)
            .collect();
        found.sort_by(|a, b| a.equilibrium.energy.total_cmp(&b.equilibrium.energy));
        Ok(found
            .into_iter()
            .map(|e| Vector2::new(e.equilibrium.p, e.equilibrium.w))
            .collect())
    }

    fn settle(&self, q: &Vector2<f64>, leaving: &Vector2<f64>) -> Result<Vector2<f64>> {
        layer::settle(q, leaving)
    }
}
