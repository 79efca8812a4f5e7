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
        let Softest { along, force, .. } = Softest::of(rod);
        let end = TipDerivatives::new(&at);
        let second = [end.pp, end.pl, end.ll].map(|d| Vector2::from(at.to_fixed(d)));
        let (fold, gradient) = fold_function(&end, i);
        let passage = Self {
            drive: force.dot(v).abs(),
            bend: 0.5 * force.dot(&quadratic(&second, &along)).abs(),
            mass: MOST,
            friction: 0.0,
            ahead: (fold / gradient.dot(&along)).abs(),
        };
        (passage, along)
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

/// The way in which a rod can change its shape while its end moves least: at a fold not at all.
pub(super) struct Softest {
    /// z, by (p, lam), of length 1 in (p, w).
    along: Vector2<f64>,
    /// ell = -df(z), what the force of the rod changes by.
    force: Vector2<f64>,
}

impl Softest {
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

    /// |ell| |dr(z)|, which near a fold, where they are parallel, is 2 B times the distance from it. Elsewhere they may be across each other.
    fn stiffness(&self, rod: &RodInertia) -> f64 {
        // `by` is lam dr.
        self.force.norm() * (rod.by * self.along).norm() / rod.integrals.lam
    }

    /// By how many radians `rod`, with its mass along it, sways that way in so long a time.
    pub(super) fn sways(&self, rod: &RodInertia, mass: f64, time: f64) -> f64 {
        let (n, _) = rod.metric();
        time * (self.stiffness(rod) / (mass * self.along.dot(&(n * self.along)))).sqrt()
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

#[cfg(test)]
mod tests {
    use super::*;
    use crate::elastica::chart::amplitude;

    /// Catches a stiffness that is not that of the normal form, or one with zeros where no fold is: next to a fold a rod sways sqrt(2) (t/T_i)^(5/4) radians in the time t
    /// that is left, T_i its time scale; and over a wide field its stiffness vanishes nowhere but at folds.
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
                let form = Passage::new(p, w, &v).unwrap();
                let left = form.time_ahead();
                let rod = RodInertia::new(p, w).unwrap();
                let soft = Softest::of(&rod);
                let expected = (left / form.inertial(mass)).powf(1.25) * 2f64.sqrt();
                let error = soft.sways(&rod, mass, left) / expected - 1.0;
                assert!(error.abs() < 30.0 * off, "{off}: {error:.1e}");
            }
        }
        let mut least = f64::INFINITY;
        for k in 1..400 {
            for j in 1..100 {
                let rod = RodInertia::new(0.01 * f64::from(k), 0.03 * f64::from(j)).unwrap();
                let soft = Softest::of(&rod);
                least = least
                    .min(soft.stiffness(&rod) / soft.along.dot(&(rod.metric().0 * soft.along)));
            }
        }
        assert!(least > 1.0, "{least}");
    }
}
