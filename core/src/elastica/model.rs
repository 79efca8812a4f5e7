//! The elastica as an equilibrium manifold: chart (p, w), pose (x, y).

use super::chart::{ChartPoint, P_MAX, amplitude};
use super::chart8::Eightfolds;
use super::equilibrium::sheet;
use super::viscous_landing::LayerShape;
use super::{beam, folds, inversion, shaking_average, straight_chart, viscous_landing};
use crate::error::{Error, Result};
use crate::manifold::{
    AxialConstraint, Eightfold, EquilibriumManifold, ManifoldPoint, Multivalued, Patch,
    ShakingTurn, Sheet, Sign, TAUT, invert_near,
};
use crate::math::small_sort::sort_few;
use nalgebra::{Matrix2, Vector2};

/// A uniform inextensible planar rod of length 1 and bending stiffness 1, clamped at the origin
/// along +x, with a force but no couple at its free end (theory Sec. 2).
#[derive(Debug, Clone, Copy, Default, PartialEq, Eq)]
pub struct Elastica;

/// Load below which the search for stable equilibria is exhaustive.
const STABLE_LAMBDA: f64 = 14.0;

/// Largest absolute error of lam, as computed from w, at which a motion is followed.
const LOST: f64 = 1e-8;

impl Elastica {
    /// Shapes of the rod that leaves the fold `q` along `leaving` with its end held and a little friction, step by
    /// step, and the landing (theory 2.6). The landing is that of [`Multivalued::settle`].
    ///
    /// # Errors
    /// A flow that does not come to rest.
    pub fn layer(
        &self,
        q: &Vector2<f64>,
        leaving: &Vector2<f64>,
    ) -> Result<(Vec<LayerShape>, Vector2<f64>)> {
        viscous_landing::shapes(self, q, leaving)
    }
}

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
        let [xp, yp] = at.column_p;
        let [xw, yw] = at.column_w;
        let pull = lam * lam;
        if !(pull > 0.0 && (xp + yp + xw + yw).is_finite()) {
            return None;
        }
        Some(ManifoldPoint {
            pose: Vector2::new(x, y),
            force: Vector2::new(pull * at.cos_alpha, pull * at.sin_alpha),
            energy: at.energy(),
            jacobian: Matrix2::new(xp, xw, yp, yw),
            // At the taut wall det ~ 1/lam^2. Time then slows as 1/lam, the distance to the wall, which turns the
            // bounce (a repulsion 1/distance^2) into a polynomial in the slowed time.
            pace: 1.0 / (1.0 + lam),
        })
    }

    fn index(&self, q: &Vector2<f64>) -> Result<usize> {
        folds::index(q[0], q[1])
    }
}

impl Multivalued<2> for Elastica {
    fn sheet(&self, q: &Vector2<f64>) -> Sheet {
        sheet(q[0], q[1])
    }

    /// Taut rods, w = |gam|/2 with gam the direction of the pull, lam = |p| + ln(2 tan(w/2)), are elementary up to
    /// exp(-2 lam) (theory 2.3); rods with loops have w within exp(p - lam) of a multiple of pi.
    fn tautness(&self, patch: Patch, q: &Vector2<f64>) -> Option<f64> {
        if let Patch::Near(side) = patch {
            return straight_chart::lambda(side, q).filter(|lam| *lam > TAUT);
        }
        let (p, w) = (q[0], q[1]);
        // The logarithm is below 3.4: lam is evaluated only where it can be large.
        if !(p.abs() > TAUT - 3.4 && w < 3.0) {
            return None;
        }
        let lam = ChartPoint::new(p, w).integrals.lam;
        (lam > TAUT).then_some(lam)
    }

    fn better_patch(&self, patch: Patch, q: &Vector2<f64>) -> Patch {
        match patch {
            Patch::Near(side) if straight_chart::stays_in_chart(side, q) => patch,
            Patch::Near(_) => Patch::Global,
            Patch::Global => {
                straight_chart::entry_side(q[0], q[1]).map_or(Patch::Global, Patch::Near)
            }
        }
    }

    fn change_patch(&self, q: &Vector2<f64>, from: Patch, to: Patch) -> Vector2<f64> {
        match (from, to) {
            (Patch::Global, Patch::Near(_)) => straight_chart::from_amplitude(q[0], q[1]),
            (Patch::Near(side), Patch::Global) => straight_chart::to_amplitude(side, q),
            _ => *q,
        }
    }

    #[inline]
    fn point_in(&self, patch: Patch, q: &Vector2<f64>) -> Option<ManifoldPoint<2>> {
        match patch {
            Patch::Global => self.point(q),
            Patch::Near(side) => straight_chart::point(side, q),
        }
    }

    fn eightfold(&self, patch: Patch, error: f64) -> Option<Box<dyn Eightfold<2> + Send>> {
        match patch {
            Patch::Global => Some(Box::new(Eightfolds::new(error)?)),
            Patch::Near(_) => None,
        }
    }

    /// Direction along the straight rod.
    fn shaking_direction(&self, patch: Patch) -> Option<Vector2<f64>> {
        matches!(patch, Patch::Near(_)).then(Vector2::x)
    }

    fn shaking_turn(&self, patch: Patch, q: &Vector2<f64>, load: f64) -> Option<ShakingTurn> {
        match patch {
            Patch::Global => None,
            Patch::Near(side) => shaking_average::shaking_turn(side, q, load),
        }
    }

    fn axial_constraint(&self, pull: f64) -> Option<AxialConstraint<2>> {
        beam::straight_rod_constraint(pull)
    }

    fn deflected_point(&self, pull: f64, across: f64) -> Option<(Patch, Vector2<f64>)> {
        let side = Sign::of(across);
        Some((
            Patch::Near(side),
            straight_chart::point_of_deflection(side, pull, across),
        ))
    }

    /// Near w = n pi a rod with a loop has D(w) ~ kap' = sech p, and dlam = dw/D. The force then lacks the digits of
    /// lam that w as a double cannot hold, and the energy ledger opens.
    fn check_resolution(&self, q: &Vector2<f64>) -> Result<()> {
        let (p, w) = (q[0], q[1]);
        // Outside this range D is far from 0, or of the order of w.
        if !(p.abs() > 15.0 && w > 2.5) {
            return Ok(());
        }
        let at = ChartPoint::new(p, w).integrals;
        if f64::EPSILON * w <= LOST * at.d {
            return Ok(());
        }
        Err(Error::ill_conditioned(format!(
            "the rod has a loop so tight (p = {p}, lambda = {}) that a motion of its end by {:.0e} of its length slides the loop \
             along it, which double precision does not hold; loops are followed while |p| < 17 or so",
            at.lam, at.d
        )))
    }

    /// Exhaustive for loads lam < 14. Stable rods under stronger loads are straight up to bends of width 1/lam. Taut
    /// ones are found at any load from their closed form. Rods with a loop are sought near their asymptotic place up
    /// to lam = 30, the limit of the chart's resolution.
    fn stable_at(&self, pose: &Vector2<f64>) -> Result<Vec<Vector2<f64>>> {
        let mut found: Vec<_> = inversion::equilibria_at(pose[0], pose[1], STABLE_LAMBDA)?
            .into_iter()
            .filter(|e| e.index == 0)
            .map(|e| Vector2::new(e.equilibrium.p, e.equilibrium.w))
            .collect();
        for guess in heavily_loaded(pose) {
            let Ok(landed) = invert_near(self, pose, &guess, 1e-15) else {
                continue;
            };
            let q = landed.q;
            let new = |other: &Vector2<f64>| {
                (q[0] - other[0]).abs() > 1e-6 * q[0].abs() || (q[1] - other[1]).abs() > 1e-6 * q[1]
            };
            let heavy = ChartPoint::new(q[0], q[1]).integrals.lam >= STABLE_LAMBDA;
            if heavy && found.iter().all(new) && self.index(&q)? == 0 {
                found.push(q);
            }
        }
        sort_few(&mut found, |q| ChartPoint::new(q[0], q[1]).energy());
        Ok(found)
    }

    fn only_landing(&self, q: &Vector2<f64>) -> Option<Vector2<f64>> {
        straight_chart::landing(q)
    }

    fn settle(&self, q: &Vector2<f64>, leaving: &Vector2<f64>) -> Result<Vector2<f64>> {
        // A growing w is a growing push.
        let near = if leaving[1] > 0.0 {
            straight_chart::landing(q)
        } else {
            None
        };
        near.map_or_else(|| viscous_landing::settle(self, q, leaving), Ok)
    }
}

/// Guesses of all stable equilibria with lam > 14 at a pose.
///
/// Taut: r = Rot(gam) (1 - (4/lam) S^2, -(2/lam) sin(gam/2)), S = sin(gam/4) (theory 2.3), w = |gam|/2,
/// lam = |p| + ln(2 tan(w/2)), for |gam| < 2 pi: the rod turns into the pull either way round. Hence 1 - |r|^2 = 8
/// S^2/lam - 16 S^2/lam^2, and gam is the angle of r up to O(1/lam). Looped: gam is a whole turn, lam = 4/(1 - |r|),
/// and p determines the position of the loop along the rod.
fn heavily_loaded(pose: &Vector2<f64>) -> Vec<Vector2<f64>> {
    let (radius, angle) = (pose.norm(), pose[1].atan2(pose[0]));
    let gap = (1.0 - radius) * (1.0 + radius);
    let mut guesses = Vec::new();
    // No rod with lam > 14 turns more than once: 1 - |r| < 4/lam.
    if !(gap > 0.0 && gap < 8.0 / STABLE_LAMBDA) {
        return guesses;
    }
    let full = std::f64::consts::TAU;
    for target in [angle, angle - full, angle + full] {
        let mut gam = target;
        let mut lam = 0.0;
        for _ in 0..60 {
            let s2 = (0.25 * gam).sin().powi(2);
            lam = 4.0 * (s2 + (s2 * (s2 - gap)).max(0.0).sqrt()) / gap;
            let behind = (2.0 / lam * (0.5 * gam).sin()).atan2(1.0 - 4.0 / lam * s2);
            gam = target + behind;
        }
        let w = 0.5 * gam.abs();
        if lam > 0.9 * STABLE_LAMBDA && w < 3.1 {
            guesses.push(Vector2::new(
                (lam - (2.0 * (0.5 * w).tan()).ln()).copysign(gam),
                w,
            ));
        }
    }
    let lam = 4.0 / (1.0 - radius);
    if angle.abs() < 1.0 && lam < 32.0 {
        for lam in [lam, lam - 2.0] {
            for part in [0.45, 0.5, 0.55, 0.6, 0.7, 0.8, 0.9, 1.0] {
                for p in [part * lam, -part * lam] {
                    guesses.extend(amplitude(p, lam).map(|w| Vector2::new(p, w)));
                }
            }
        }
    }
    guesses
}
