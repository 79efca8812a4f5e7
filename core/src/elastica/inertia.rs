//! What a rod of small mass adds to the motion of the mass at its end (theory 2.9).
//!
//! The rod stays on its equilibria, r(s; q). Its kinetic energy is then m/2 int |P v|^2 ds with v the velocity of the end and
//! P(s) = r_q (Dr(1))^-1: the rod adds the mass m int P^T P ds to that of the body. All fields are closed forms: the place at
//! the distance u = lam (1 - s) from the tip is that of the pendulum of the same modulus at the amplitude phi(u),
//!
//! ```text
//! r(s) = Rot(alpha) (Z(lam) - Z(u))/lam,   Z(u) = int_0^u (cos psi, sin psi).
//! ```
//!
//! Units: length 1, bending stiffness 1.

use super::chart::{ChartPoint, Integrals};
use super::curvature::{Swing, TipDerivatives, turned};
use crate::error::{Error, Result};
use crate::manifold::RodMass;
use crate::math::gauss::Rule;
use nalgebra::{Matrix2, Vector2};

/// Nodes along the rod: a base, and more as it is pulled harder, for bends of width 1/lam.
const NODES: [f64; 2] = [24.0, 4.0];
/// A rod pulled harder than this is left out: its bends are narrower than what any mass of the rod bears.
const TAUT: f64 = 100.0;

/// One section of the rod: its place and how that follows (p, lam).
struct Section {
    weight: f64,
    place: Vector2<f64>,
    by: Matrix2<f64>,
    /// Second derivatives: pp, p lam, lam lam.
    second: [Vector2<f64>; 3],
    /// d theta'/d(p, lam).
    curvature: Vector2<f64>,
}

/// A rod on its equilibrium (p, lam), as far as its mass is concerned, per unit of mass.
pub struct RodInertia {
    sections: Vec<Section>,
    /// d r(1)/d(p, lam).
    by: Matrix2<f64>,
    /// Second derivatives of r(1).
    second: [Vector2<f64>; 3],
}

/// What a unit of the rod's mass adds to the equation of motion of the end.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Added {
    /// A = int P^T P ds, the mass that the end feels.
    pub mass: Matrix2<f64>,
    /// int P^T (g - e) ds: e is the acceleration of the sections while that of the end is zero.
    pub force: Vector2<f64>,
    /// int r ds, the rod's centre of mass.
    pub centre: Vector2<f64>,
}

/// x^T H x of second derivatives (11, 12, 22).
fn quadratic(second: &[Vector2<f64>; 3], x: &Vector2<f64>) -> Vector2<f64> {
    second[0] * (x[0] * x[0]) + second[1] * (2.0 * x[0] * x[1]) + second[2] * (x[1] * x[1])
}

impl RodInertia {
    /// The rod at the chart point (p, w).
    ///
    /// # Errors
    /// A point outside the chart; a pull above lam = 100.
    pub fn new(p: f64, w: f64) -> Result<Self> {
        let at = ChartPoint::new(p, w);
        let lam = at.integrals.lam;
        if !(lam > 0.0 && lam < TAUT) {
            return Err(Error::domain(format!(
                "the rod is pulled with lambda = {lam}; its mass is followed for 0 < lambda < {TAUT}"
            )));
        }
        let rule = Rule::new((NODES[0] + NODES[1] * lam) as usize);
        let end = TipDerivatives::new(&at);
        let clamp = Swing::new(&at.integrals);
        let section = |(s, weight): (&f64, &f64)| {
            let part = 1.0 - s;
            let inner = Integrals::at_load(p, lam * part)?;
            Ok(section(&at, &clamp, &inner, part, *weight))
        };
        let sections: Result<Vec<_>> = rule.nodes.iter().zip(&rule.weights).map(section).collect();
        let vector = |v: [f64; 2]| Vector2::from(at.to_fixed(v));
        Ok(Self {
            sections: sections?,
            by: Matrix2::from_columns(&[vector(end.p), vector(end.l)]),
            second: [end.pp, end.pl, end.ll].map(vector),
        })
    }

    /// d(p, lam)/dt of the end's velocity; None at a fold.
    fn chart_rate(&self, v: &Vector2<f64>) -> Option<(Matrix2<f64>, Vector2<f64>)> {
        let inverse = self.by.try_inverse()?;
        Some((inverse, inverse * v))
    }

    /// What the end feels of a unit of mass of the rod while it moves with `v` and gravity g acts on the rod; None at a fold.
    pub fn added(&self, v: &Vector2<f64>, gravity: &Vector2<f64>) -> Option<Added> {
        let (inverse, rate) = self.chart_rate(v)?;
        let end = quadratic(&self.second, &rate);
        let mut added = Added {
            mass: Matrix2::zeros(),
            force: Vector2::zeros(),
            centre: Vector2::zeros(),
        };
        for section in &self.sections {
            let carried = section.by * inverse;
            let left = quadratic(&section.second, &rate) - carried * end;
            added.mass += carried.transpose() * carried * section.weight;
            added.force += carried.transpose() * (gravity - left) * section.weight;
            added.centre += section.place * section.weight;
        }
        let all = added.mass.iter().chain(&added.force);
        all.copied().all(f64::is_finite).then_some(added)
    }

    /// (N, R) = int (r_q^T r_q, theta'_q theta'_q^T) ds in q = (p, lam): twice the kinetic energy of the rod per unit of mass, and its
    /// dissipation by Kelvin-Voigt friction of the time 1, of the rates q'.
    pub fn metric(&self) -> (Matrix2<f64>, Matrix2<f64>) {
        let mut sums = (Matrix2::zeros(), Matrix2::zeros());
        for section in &self.sections {
            sums.0 += section.by.transpose() * section.by * section.weight;
            sums.1 += section.curvature * section.curvature.transpose() * section.weight;
        }
        sums
    }

    /// d r(1)/d(p, lam), and its second derivatives (pp, p lam, lam lam).
    pub fn end(&self) -> (&Matrix2<f64>, &[Vector2<f64>; 3]) {
        (&self.by, &self.second)
    }
}

/// The section with `part` of the rod beyond it, where the pendulum is at `inner`.
fn section(at: &ChartPoint, clamp: &Swing, inner: &Integrals, part: f64, weight: f64) -> Section {
    let (lam, inv) = (at.integrals.lam, 1.0 / at.integrals.lam);
    let here = Swing::new(inner);
    let less = |a: [f64; 2], part: f64, b: [f64; 2]| [a[0] - part * b[0], a[1] - part * b[1]];
    let over = |a: [f64; 2]| a.map(|x| x * inv);
    let w = over(less(clamp.z, 1.0, here.z));
    let w_p = over(less(clamp.z_p, 1.0, here.z_p));
    let w_l = over(less(less(clamp.z_u(), part, here.z_u()), 1.0, w));
    let w_pp = over(less(clamp.z_pp, 1.0, here.z_pp));
    let w_pl = over(less(less(clamp.z_pu(), part, here.z_pu()), 1.0, w_p));
    let w_ll = over(less(less(clamp.z_uu(), part * part, here.z_uu()), 2.0, w_l));
    // alpha = -psi at the clamp.
    let (a_p, a_l) = (-clamp.psi_p, -clamp.psi_u);
    let fixed = |v: [f64; 2]| Vector2::from(at.to_fixed(v));
    let first = |wa: [f64; 2], a: f64| fixed([wa[0] - a * w[1], wa[1] + a * w[0]]);
    let second = |w2, a, wa, b, wb, ab: f64| fixed(turned(w, w2, a, wa, b, wb, -ab));
    Section {
        weight,
        place: fixed(w),
        by: Matrix2::from_columns(&[first(w_p, a_p), first(w_l, a_l)]),
        second: [
            second(w_pp, a_p, w_p, a_p, w_p, clamp.psi_pp),
            second(w_pl, a_p, w_p, a_l, w_l, clamp.psi_pu),
            second(w_ll, a_l, w_l, a_l, w_l, clamp.psi_uu),
        ],
        // theta' = -lam psi_u at u = lam (1 - s).
        curvature: Vector2::new(-lam * here.psi_pu, -here.psi_u - lam * part * here.psi_uu),
    }
}

/// A planar elastica of small mass whose shapes stay equilibria.
///
/// Its mass is followed until twice the time T_i = (M0)^(2/5) (A B)^(-1/5) before a fold, in which inertia lets the rod go
/// (theory 2.8), and on rods that are not pulled too hard.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct LightRod {
    /// Mass of the whole rod.
    pub mass: f64,
    /// Gravity along the axes of the clamp.
    pub gravity: Vector2<f64>,
}

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
        Ok(Self::of(&ChartPoint::new(p, w), &RodInertia::new(p, w)?, v))
    }

    fn of(at: &ChartPoint, rod: &RodInertia, v: &Vector2<f64>) -> Self {
        let i = &at.integrals;
        let swing = Swing::new(i);
        let svd = rod.by.svd(false, true);
        let right = svd.v_t.expect("asked for");
        let z = right.row(svd.singular_values.imin()).transpose();
        // Of length 1 in (p, w), lam_w = 1/D.
        let z = z / z[0].hypot(i.d * (z[1] - i.lam_p() * z[0]));
        let along = Vector2::new(at.cos_alpha, at.sin_alpha);
        let aside = Vector2::new(-at.sin_alpha, at.cos_alpha);
        // f = lam^2 (cos alpha, sin alpha), alpha = -psi at the clamp.
        let turn = -(swing.psi_p * z[0] + swing.psi_u * z[1]);
        let ell = -(along * (2.0 * i.lam * z[1]) + aside * (i.lam * i.lam * turn));
        let (n, r) = rod.metric();
        let [pp, pl, ll] = rod.second.map(|d| [d.x, d.y]);
        let columns = [0, 1].map(|k| [rod.by[(0, k)], rod.by[(1, k)]]);
        let end = TipDerivatives {
            p: columns[0],
            l: columns[1],
            pp,
            pl,
            ll,
        };
        let (fold, gradient) = fold_function(&end, i);
        Self {
            drive: ell.dot(v).abs(),
            bend: 0.5 * ell.dot(&quadratic(&rod.second, &z)).abs(),
            mass: z.dot(&(n * z)),
            friction: z.dot(&(r * z)),
            ahead: (fold / gradient.dot(&z)).abs(),
        }
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

/// det d r(1)/d(p, lam) / kap^2, which vanishes at folds alone, and its gradient.
fn fold_function(end: &TipDerivatives, i: &Integrals) -> (f64, Vector2<f64>) {
    let (det, gradient) = end.det_with_gradient();
    let kap2 = i.kap * i.kap;
    let by_p = (gradient[0] - 2.0 * det * i.kap_c * i.kap_c / i.kap) / kap2;
    (det / kap2, Vector2::new(by_p, gradient[1] / kap2))
}

/// No rod lighter loaded than lam = 5.766 is at a fold (`folds.rs`); nor, with room to spare for what leads there, next to one.
const UNFOLDED: f64 = 4.5;
/// Times T_i before a fold within which a rod is not followed, and beyond which it is again.
const CLEAR: [f64; 2] = [2.0, 3.0];
/// Pulls lam above which a rod is not followed, and below which it is again.
const PULLED: [f64; 2] = [30.0, 20.0];
/// |kap| below which a rod is as good as straight, so that its end is held along it: its mass then swings across as 1/kap.
const STRAIGHT: [f64; 2] = [1e-3, 2e-3];

impl RodMass<2> for LightRod {
    fn added(&self, q: &Vector2<f64>, v: &Vector2<f64>) -> Option<(Matrix2<f64>, Vector2<f64>)> {
        let rod = RodInertia::new(q[0], q[1]).ok()?;
        let added = rod.added(v, &self.gravity)?;
        Some((added.mass * self.mass, added.force * self.mass))
    }

    fn energies(&self, q: &Vector2<f64>, v: &Vector2<f64>) -> Option<[f64; 2]> {
        let rod = RodInertia::new(q[0], q[1]).ok()?;
        let added = rod.added(v, &self.gravity)?;
        let kinetic = 0.5 * self.mass * v.dot(&(added.mass * v));
        Some([kinetic, -self.mass * self.gravity.dot(&added.centre)])
    }

    fn holds(&self, q: &Vector2<f64>, v: &Vector2<f64>, followed: bool) -> bool {
        let bound = usize::from(!followed);
        let at = ChartPoint::new(q[0], q[1]);
        let i = &at.integrals;
        if !(i.lam < PULLED[bound] && i.kap.abs() > STRAIGHT[bound]) {
            return false;
        }
        if i.lam < UNFOLDED {
            return true;
        }
        let Ok(rod) = RodInertia::new(q[0], q[1]) else {
            return false;
        };
        let Some((_, rate)) = rod.chart_rate(v) else {
            return false;
        };
        let (fold, gradient) = fold_function(&TipDerivatives::new(&at), i);
        let away = fold * gradient.dot(&rate) >= 0.0;
        let passage = Passage::of(&at, &rod, v);
        away || passage.time_ahead() > CLEAR[bound] * passage.inertial(self.mass)
    }
}
