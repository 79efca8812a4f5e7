//! Normal forms of the folds that a motion runs into (theory 2.8).

use super::RodInertia;
use crate::elastica::chart::Integrals;
use crate::elastica::curvature::TipDerivatives;
use crate::error::Result;
use nalgebra::Vector2;

/// Normal form of a fold ahead: A t + B a^2 drives the amplitude a of the critical shape (theory 2.8).
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct FoldNormalForm {
    /// A = |l . v| with l = -df(z) and z the unit null vector of dr(1)/d(p, w): the speed at which the body drives
    /// the rod over the fold.
    pub drive: f64,
    /// B = |l . D^2 r \[z, z\]| / 2.
    pub bend: f64,
    /// M0 = z^T N z, per unit of the rod's mass.
    pub mass: f64,
    /// D0 = z^T R z, per unit of its Kelvin-Voigt time.
    pub friction: f64,
    /// Distance to the fold in a, along z; 0 at the fold, > 0 before it.
    pub ahead: f64,
}

/// Upper bound of M0, since |z| = 1. Measured over |p| < 6, w < 40: at most 0.17 at folds, 0.79 elsewhere.
const MODAL_MASS_BOUND: f64 = 1.0;

/// Inertial delay of the departure from a fold, in units of T_i: the first pole of y'' = t + y^2.
pub const INERTIAL_ESCAPE: f64 = 3.411_684_340;
/// Viscous delay of the departure from a fold, in units of T_v: the first zero of Airy's function.
pub const VISCOUS_ESCAPE: f64 = 2.338_107_410;

impl FoldNormalForm {
    /// Normal form at a chart point on or near a fold, for the end velocity `v`. Its coefficients are those of the
    /// fold up to terms of first order in the distance.
    ///
    /// # Errors
    /// As [`RodInertia::new`].
    pub fn new(p: f64, w: f64, v: &Vector2<f64>) -> Result<Self> {
        Ok(Self::of(&RodInertia::new(p, w)?, v))
    }

    pub(super) fn of(rod: &RodInertia, v: &Vector2<f64>) -> Self {
        let (mut passage, z) = Self::ahead_of(rod, v);
        let (n, r) = rod.metric();
        passage.mass = z.dot(&(n * z));
        passage.friction = z.dot(&(r * z));
        passage
    }

    /// Normal form without integrals along the rod: M0 is replaced by its bound 1 and D0 by 0. Also z, by (p, lam).
    pub(super) fn ahead_of(rod: &RodInertia, v: &Vector2<f64>) -> (Self, Vector2<f64>) {
        let (at, i) = (rod.point(), &rod.integrals);
        let SoftestMode { along, force, .. } = SoftestMode::of(rod);
        let end = TipDerivatives::new(&at);
        let second = [end.pp, end.pl, end.ll].map(|d| Vector2::from(at.to_fixed(d)));
        let (fold, gradient) = fold_function(&end, i);
        let passage = Self {
            drive: force.dot(v).abs(),
            bend: 0.5 * force.dot(&quadratic(&second, &along)).abs(),
            mass: MODAL_MASS_BOUND,
            friction: 0.0,
            ahead: (fold / gradient.dot(&along)).abs(),
        };
        (passage, along)
    }

    /// Time until the fold, from A t = B a^2.
    pub fn time_ahead(&self) -> f64 {
        self.bend * self.ahead * self.ahead / self.drive
    }

    /// Inertial time scale T_i of a rod of mass `mass`.
    pub fn inertial(&self, mass: f64) -> f64 {
        (mass * self.mass).powf(0.4) * (self.drive * self.bend).powf(-0.2)
    }

    /// Viscous time scale T_v for the Kelvin-Voigt time `eta`.
    pub fn viscous(&self, eta: f64) -> f64 {
        ((eta * self.friction).powi(2) / (self.drive * self.bend)).cbrt()
    }
}

/// Softest change of shape: the one that moves the end least; at a fold it leaves the end at rest.
pub(super) struct SoftestMode {
    /// Direction z, by (p, lam), of length 1 in (p, w).
    along: Vector2<f64>,
    /// Change of the rod's force, ell = -df(z).
    force: Vector2<f64>,
}

impl SoftestMode {
    pub(super) fn of(rod: &RodInertia) -> Self {
        let (at, i) = (rod.point(), &rod.integrals);
        let swing = &rod.clamp;
        let svd = rod.by.svd(false, true);
        let right = svd.v_t.expect("asked for");
        let z = right.row(svd.singular_values.imin()).transpose();
        // lam_w = 1/D.
        let z = z / z[0].hypot(i.d * (z[1] - i.lam_p() * z[0]));
        let along = Vector2::new(at.cos_alpha, at.sin_alpha);
        let aside = Vector2::new(-at.sin_alpha, at.cos_alpha);
        // f = lam^2 (cos alpha, sin alpha), alpha = -psi at the clamp.
        let turn = -(swing.psi_p * z[0] + swing.psi_u() * z[1]);
        let ell = -(along * (2.0 * i.lam * z[1]) + aside * (i.lam * i.lam * turn));
        Self {
            along: z,
            force: ell,
        }
    }

    /// Stiffness |ell| |dr(z)|. Near a fold ell and dr(z) are parallel, and this is 2 B times the distance to the
    /// fold; elsewhere they may be perpendicular.
    fn stiffness(&self, rod: &RodInertia) -> f64 {
        // `by` is lam dr.
        self.force.norm() * (rod.by * self.along).norm() / rod.integrals.lam
    }

    /// Sway of `rod` in radians in the direction z within `time`, with the mass `mass` along it.
    pub(super) fn sways(&self, rod: &RodInertia, mass: f64, time: f64) -> f64 {
        let (n, _) = rod.metric();
        time * (self.stiffness(rod) / (mass * self.along.dot(&(n * self.along)))).sqrt()
    }
}

/// Fold function (lam/kap)^2 det d r(1)/d(p, lam), which vanishes only at folds, and its gradient. det alone also
/// tends to 0 like 1/lam^2 as a rod is pulled taut (theory 2.9).
pub(super) fn fold_function(end: &TipDerivatives, i: &Integrals) -> (f64, Vector2<f64>) {
    let (det, gradient) = end.det_with_gradient();
    let (kap, lam) = (i.kap, i.lam);
    let scale = (lam / kap).powi(2);
    let by_p = gradient[0] - 2.0 * det * i.kap_c * i.kap_c / kap;
    let by_l = gradient[1] + 2.0 * det / lam;
    (scale * det, Vector2::new(by_p, by_l) * scale)
}

/// Quadratic form x^T H x of second derivatives (11, 12, 22).
fn quadratic(second: &[Vector2<f64>; 3], x: &Vector2<f64>) -> Vector2<f64> {
    second[0] * (x[0] * x[0]) + second[1] * (2.0 * x[0] * x[1]) + second[2] * (x[1] * x[1])
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::elastica::chart::amplitude;

    /// Catches a stiffness unlike the normal form's, or zeros away from folds. In the time t left before a fold a rod
    /// sways sqrt(2) (t/T_i)^(5/4) radians; over a wide field the stiffness vanishes only at folds.
    #[test]
    fn rods_sway_in_the_time_left_as_their_normal_form_says() {
        // By (p, lam).
        let fold = [0.639_250_507, 6.556_218_856];
        for (mass, v) in [
            (1e-3, Vector2::new(0.0, -0.5)),
            (0.2, Vector2::new(0.7, -1.0)),
        ] {
            for off in [1e-3, 1e-4] {
                let (p, lam) = (fold[0] + 0.06 * off, fold[1] - 0.26 * off);
                let w = amplitude(p, lam).unwrap();
                let form = FoldNormalForm::new(p, w, &v).unwrap();
                let left = form.time_ahead();
                let rod = RodInertia::new(p, w).unwrap();
                let soft = SoftestMode::of(&rod);
                let expected = (left / form.inertial(mass)).powf(1.25) * 2f64.sqrt();
                let error = soft.sways(&rod, mass, left) / expected - 1.0;
                assert!(error.abs() < 30.0 * off, "{off}: {error:.1e}");
            }
        }
        let mut least = f64::INFINITY;
        for k in 1..400 {
            for j in 1..100 {
                let rod = RodInertia::new(0.01 * f64::from(k), 0.03 * f64::from(j)).unwrap();
                let soft = SoftestMode::of(&rod);
                least = least
                    .min(soft.stiffness(&rod) / soft.along.dot(&(rod.metric().0 * soft.along)));
            }
        }
        assert!(least > 1.0, "{least}");
    }
}
