//! The folds that a motion runs into, by their normal forms (theory 2.8).

use super::RodInertia;
use crate::elastica::chart::Integrals;
use crate::elastica::curvature::TipDerivatives;
use crate::error::Result;
use nalgebra::Vector2;

/// The normal form of a fold that the motion runs into: A t + B a^2 moves the amplitude a of the critical shape (theory 2.8).
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Passage {
    /// A = |l . v|, l = -df(z), with z the null vector of dr(1)/d(p, w), of length 1: how fast the body drives the rod over the fold.
    pub drive: f64,
    /// B = |l . D^2 r \[z, z\]| / 2.
    pub bend: f64,
    /// M0 = z^T N z, per unit of the rod's mass.
    pub mass: f64,
    /// D0 = z^T R z, per unit of its Kelvin-Voigt time.
    pub friction: f64,
    /// The distance from the fold in a, along the critical direction z; 0 at the fold, > 0 before it.
    pub ahead: f64,
}

/// More than M0 of any fold: along z, of length 1, the rod moves less than that. Of folds it is at most 0.17, of other points 0.79 (measured, |p| < 6, w < 40).
const MOST: f64 = 1.0;

/// The time in which inertia lets a rod go from a fold, in units of T_i: the first pole of y'' = t + y^2.
pub const INERTIAL_ESCAPE: f64 = 3.411_684_340;
/// The time in which friction does, in units of T_v: the first zero of Airy's function.
pub const VISCOUS_ESCAPE: f64 = 2.338_107_410;

impl Passage {
    /// At a chart point on a fold or next to it, of an end that moves with `v`. The numbers are those of the fold itself up to the distance
    /// from it.
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

    /// The same but for D0, and with the bound 1 of M0 in its place; and z, by (p, lam).
    pub(super) fn ahead_of(rod: &RodInertia, v: &Vector2<f64>) -> (Self, Vector2<f64>) {
        let (at, i) = (rod.point(), &rod.integrals);
        let swing = &rod.clamp;
        let svd = rod.by.svd(false, true);
        let right = svd.v_t.expect("asked for");
        let z = right.row(svd.singular_values.imin()).transpose();
        // Of length 1 in (p, w), lam_w = 1/D.
        let z = z / z[0].hypot(i.d * (z[1] - i.lam_p() * z[0]));
        let along = Vector2::new(at.cos_alpha, at.sin_alpha);
        let aside = Vector2::new(-at.sin_alpha, at.cos_alpha);
        // f = lam^2 (cos alpha, sin alpha), alpha = -psi at the clamp.
        let turn = -(swing.psi_p * z[0] + swing.psi_u() * z[1]);
        let ell = -(along * (2.0 * i.lam * z[1]) + aside * (i.lam * i.lam * turn));
        let end = TipDerivatives::new(&at);
        let second = [end.pp, end.pl, end.ll].map(|d| Vector2::from(at.to_fixed(d)));
        let (fold, gradient) = fold_function(&end, i);
        let passage = Self {
            drive: ell.dot(v).abs(),
            bend: 0.5 * ell.dot(&quadratic(&second, &z)).abs(),
            mass: MOST,
            friction: 0.0,
            ahead: (fold / gradient.dot(&z)).abs(),
        };
        (passage, z)
    }

    /// The time until the fold, A t = B a^2.
    pub fn time_ahead(&self) -> f64 {
        self.bend * self.ahead * self.ahead / self.drive
    }

    /// T_i, the time scale of a rod of mass `mass` that inertia holds back.
    pub fn inertial(&self, mass: f64) -> f64 {
        (mass * self.mass).powf(0.4) * (self.drive * self.bend).powf(-0.2)
    }

    /// T_v, that of a rod that friction of the Kelvin-Voigt time `eta` holds back.
    pub fn viscous(&self, eta: f64) -> f64 {
        ((eta * self.friction).powi(2) / (self.drive * self.bend)).cbrt()
    }
}

/// (lam/kap)^2 det d r(1)/d(p, lam), which vanishes at folds alone, and its gradient. As a rod is pulled taut det tends to 0 like 1/lam^2 (theory 2.9), with no fold
/// there.
pub(super) fn fold_function(end: &TipDerivatives, i: &Integrals) -> (f64, Vector2<f64>) {
    let (det, gradient) = end.det_with_gradient();
    let (kap, lam) = (i.kap, i.lam);
    let scale = (lam / kap).powi(2);
    let by_p = gradient[0] - 2.0 * det * i.kap_c * i.kap_c / kap;
    let by_l = gradient[1] + 2.0 * det / lam;
    (scale * det, Vector2::new(by_p, by_l) * scale)
}

/// x^T H x of second derivatives (11, 12, 22).
fn quadratic(second: &[Vector2<f64>; 3], x: &Vector2<f64>) -> Vector2<f64> {
    second[0] * (x[0] * x[0]) + second[1] * (2.0 * x[0] * x[1]) + second[2] * (x[1] * x[1])
}
