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

mod carried;
mod light;
mod passage;
mod straight;

pub use light::LightRod;
pub use passage::{INERTIAL_ESCAPE, Passage, VISCOUS_ESCAPE};

use super::along::{Along, DRAWS, drawn};
use super::chart::{ChartPoint, Integrals, Modulus};
use super::curvature::{Swing, TipDerivatives};
use super::lanes::{self, InLanes, Lanes, WIDEST};
use crate::error::{Error, Result};
use crate::math::gauss::Rule;
use crate::math::real::Real;
use nalgebra::{Matrix2, Vector2};
use pulp::{Simd, WithSimd};
use std::sync::OnceLock;

/// A rod pulled harder than this is left out: its bends are narrower than what any mass of the rod bears.
const TAUT: f64 = 100.0;

/// Integrals along the rod are as good as exact.
const EXACT: f64 = 1e-12;
/// The most that they may be off.
const ROUGH: f64 = 1e-4;

/// A rod on its equilibrium (p, lam), as far as its mass is concerned, per unit of mass.
pub struct RodInertia {
    p: f64,
    modulus: Modulus,
    /// The chart's integrals at (p, lam).
    integrals: Integrals,
    clamp: Swing,
    along: Along,
    /// Part of the integrals along the rod by which they may be off.
    error: f64,
    /// [`RodInertia::field`] of the end.
    end: [[f64; 2]; 3],
    /// lam d r(1)/d(p, lam), in the axes of [`ChartPoint::turned`].
    by: Matrix2<f64>,
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

impl RodInertia {
    /// The rod at the chart point (p, w).
    ///
    /// # Errors
    /// A point outside the chart; a pull above lam = 100.
    pub fn new(p: f64, w: f64) -> Result<Self> {
        let modulus = Modulus::new(p);
        let integrals = Integrals::new(p, w);
        let along = Along::new(&modulus, pulled(integrals.lam)?);
        Ok(Self::of(p, modulus, integrals, along))
    }

    /// The rod of modulus p under the pull lam.
    ///
    /// # Errors
    /// A pull that is not in (0, 100).
    #[inline(always)]
    pub fn at_load(p: f64, lam: f64) -> Result<Self> {
        let modulus = Modulus::new(p);
        let along = Along::new(&modulus, pulled(lam)?);
        Ok(Self::of(p, modulus, along.clamp(&modulus), along))
    }

    /// The same with integrals along the rod that may be off by a part `error` of their size, between 1e-12 and 1e-4.
    #[must_use]
    #[inline(always)]
    pub fn to_part(self, error: f64) -> Self {
        let error = error.clamp(EXACT, ROUGH);
        Self { error, ..self }
    }

    #[inline(always)]
    fn of(p: f64, modulus: Modulus, integrals: Integrals, along: Along) -> Self {
        let mut rod = Self {
            p,
            modulus,
            integrals,
            clamp: Swing::new(&integrals),
            along,
            error: EXACT,
            end: [[0.0; 2]; 3],
            by: Matrix2::zeros(),
        };
        rod.end = rod.field_of_end();
        let [_, by_p, by_l] = rod.end;
        rod.by = Matrix2::new(by_p[0], by_l[0], by_p[1], by_l[1]);
        rod
    }

    /// The chart's point.
    fn point(&self) -> ChartPoint {
        ChartPoint::from_integrals(self.p, self.integrals)
    }

    /// (lam Dr(1))^-1, and d(p, lam)/dt of the end's velocity; None at a fold.
    #[inline(always)]
    fn chart_rate(&self, v: &Vector2<f64>) -> Option<(Matrix2<f64>, Vector2<f64>)> {
        let inverse = self.by.try_inverse()?;
        Some((inverse, inverse * self.turned(v) * self.integrals.lam))
    }

    /// A vector in the axes of [`ChartPoint::turned`].
    fn turned(&self, v: &Vector2<f64>) -> Vector2<f64> {
        self.turn().tr_mul(v)
    }

    /// Where the end is.
    fn place(&self) -> Vector2<f64> {
        self.turn() * Vector2::from(self.end[0]) / self.integrals.lam
    }

    /// The turn from those axes to those of the clamp.
    fn turn(&self) -> Matrix2<f64> {
        // alpha = -psi at the clamp.
        let [cos, minus] = self.clamp.z_u();
        let sin = -minus;
        Matrix2::new(cos, -sin, sin, cos)
    }

    /// lam times the place of the section with `part` of the rod beyond it, where the pendulum is at `here`, and lam times its derivatives by p
    /// and lam.
    #[inline(always)]
    fn field<T: Real>(&self, part: T, here: &Swing<T>) -> [[T; 2]; 3] {
        let (clamp, inv) = (&self.clamp, 1.0 / self.integrals.lam);
        let (z_u, here_u) = (clamp.z_u(), here.z_u());
        let w = [less(clamp.z[0], here.z[0]), less(clamp.z[1], here.z[1])];
        let w_p = [
            less(clamp.z_p[0], here.z_p[0]),
            less(clamp.z_p[1], here.z_p[1]),
        ];
        let w_l = [
            less(z_u[0], part.times_plus(here_u[0], w[0] * inv)),
            less(z_u[1], part.times_plus(here_u[1], w[1] * inv)),
        ];
        self.along_chart(w, w_p, w_l)
    }

    /// The same of the end, where the pendulum begins.
    #[inline(always)]
    fn field_of_end(&self) -> [[f64; 2]; 3] {
        let (clamp, inv) = (&self.clamp, 1.0 / self.integrals.lam);
        let (w, z_u) = (clamp.z, clamp.z_u());
        let w_l = [z_u[0] - w[0] * inv, z_u[1] - w[1] * inv];
        self.along_chart(w, clamp.z_p, w_l)
    }

    /// The place w with its derivatives by p and lam, from those at fixed alpha = -psi at the clamp.
    #[inline(always)]
    fn along_chart<T: Real>(&self, w: [T; 2], w_p: [T; 2], w_l: [T; 2]) -> [[T; 2]; 3] {
        let (a_p, a_l) = (-self.clamp.psi_p, -self.clamp.psi_u);
        let by_p = [w_p[0] - w[1] * a_p, w_p[1] + w[0] * a_p];
        [w, by_p, [w_l[0] - w[1] * a_l, w_l[1] + w[0] * a_l]]
    }

    /// lam times the second derivative of such a place in time, while p and lam change at constant rates: what `Turning` has, applied to a
    /// section with the field [w, by_p, by_l].
    #[inline(always)]
    fn second<T: Real>(
        &self,
        turning: &Turning,
        part: T,
        here: &Swing<T>,
        field: &[[T; 2]; 3],
    ) -> [T; 2] {
        let [p, l] = turning.rate;
        let [cos, sin] = here.z_u();
        let along = (here.psi_p * (2.0 * p * l) + part * here.psi_u * (l * l)) * part;
        let z = [
            here.z_pp[0] * (p * p) - sin * along,
            here.z_pp[1] * (p * p) + cos * along,
        ];
        let drawn = [less(turning.z[0], z[0]), less(turning.z[1], z[1])];
        self.accelerated(turning, drawn, field)
    }

    /// The same of the end.
    #[inline(always)]
    fn second_of_end(&self, turning: &Turning) -> Vector2<f64> {
        self.accelerated(turning, turning.z, &self.end).into()
    }

    /// The same from the second derivative of lam w, w the place seen from the turned axes.
    #[inline(always)]
    fn accelerated<T: Real>(
        &self,
        turning: &Turning,
        drawn: [T; 2],
        [w, by_p, by_l]: &[[T; 2]; 3],
    ) -> [T; 2] {
        let [p, l] = turning.rate;
        let slower = 2.0 * l / self.integrals.lam;
        // r = Rot(alpha) w, whose rate w' + alpha' J w the field has.
        let (turn, spin) = (turning.first, turning.second);
        let rate = [by_p[0] * p + by_l[0] * l, by_p[1] * p + by_l[1] * l];
        let own = [rate[0] + w[1] * turn, rate[1] - w[0] * turn];
        let drawn = [drawn[0] - own[0] * slower, drawn[1] - own[1] * slower];
        [
            drawn[0] - rate[1] * (2.0 * turn) - w[1] * spin + w[0] * (turn * turn),
            drawn[1] + rate[0] * (2.0 * turn) + w[0] * spin + w[1] * (turn * turn),
        ]
    }

    /// Integrals along the rod.
    #[inline(always)]
    fn integrals<const K: usize>(&self, each: &impl AtSection<K>) -> [f64; K] {
        let [places, weights] = self.nodes();
        lanes::sums(&Sections { rod: self, each }, places, weights)
    }

    /// Nodes along the rod, and their weights.
    #[inline(always)]
    fn nodes(&self) -> [&'static [f64]; 2] {
        let (least, draw) = self.along.rule(self.error);
        nodes(least, draw)
    }

    /// What the end feels of a unit of mass of the rod while it moves with `v` and gravity g acts on the rod; None at a fold.
    pub fn added(&self, v: &Vector2<f64>, gravity: &Vector2<f64>) -> Option<Added> {
        let (inverse, rate) = self.chart_rate(v)?;
        let turning = Turning::new(&self.clamp, rate.into());
        let [n11, n12, n22, f1, f2, along @ ..] = self.integrals(&Heavy(&turning));
        let [.., x, y] = along;
        let weight = self.weighed(along, gravity);
        let (mass, force) = self.felt(&inverse, &turning, [n11, n12, n22, f1, f2], &weight)?;
        Some(Added {
            mass,
            force,
            centre: self.turn() * Vector2::new(x, y) / self.integrals.lam,
        })
    }

    /// lam times int r_q^T g ds, from lam times those of r_p, r_lam and r.
    #[inline(always)]
    fn weighed(&self, [p1, p2, l1, l2, ..]: [f64; 6], gravity: &Vector2<f64>) -> Vector2<f64> {
        let g = self.turned(gravity);
        Vector2::new(p1 * g.x + p2 * g.y, l1 * g.x + l2 * g.y)
    }

    /// lam^2 of r_q^T r_q and of r_q^T r_tt at a section.
    #[inline(always)]
    fn pushed<T: Real>(
        &self,
        turning: &Turning,
        part: T,
        here: &Swing<T>,
        field: &[[T; 2]; 3],
    ) -> [T; 5] {
        let second = self.second(turning, part, here, field);
        let [_, p, l] = *field;
        [
            dot(p, p),
            dot(p, l),
            dot(l, l),
            dot(p, second),
            dot(l, second),
        ]
    }

    /// A and b from the sums of [`Self::pushed`] along the rod, and lam times that of r_q^T g; `inverse` is (lam Dr(1))^-1.
    #[inline(always)]
    fn felt(
        &self,
        inverse: &Matrix2<f64>,
        turning: &Turning,
        [n11, n12, n22, f1, f2]: [f64; 5],
        weight: &Vector2<f64>,
    ) -> Option<(Matrix2<f64>, Vector2<f64>)> {
        // P = r_q Dr^-1, both in the turned axes.
        let carried = Matrix2::new(n11, n12, n12, n22) * inverse;
        let left = Vector2::new(f1, f2) - carried * self.second_of_end(turning);
        let turn = self.turn();
        let mass = turn * inverse.tr_mul(&carried) * turn.transpose();
        let force = turn * inverse.tr_mul(&(weight - left / self.integrals.lam));
        let all = mass.iter().chain(&force);
        all.copied().all(f64::is_finite).then_some((mass, force))
    }

    /// (N, R) = int (r_q^T r_q, theta'_q theta'_q^T) ds in q = (p, lam): twice the kinetic energy of the rod per unit of mass, and its
    /// dissipation by Kelvin-Voigt friction of the time 1, of the rates q'.
    pub fn metric(&self) -> (Matrix2<f64>, Matrix2<f64>) {
        let lam = self.integrals.lam;
        let [n11, n12, n22, r11, r12, r22] = self.integrals(&Still);
        (
            Matrix2::new(n11, n12, n12, n22) / (lam * lam),
            Matrix2::new(r11, r12, r12, r22),
        )
    }

    /// d r(1)/d(p, lam), and its second derivatives (pp, p lam, lam lam).
    pub fn end(&self) -> (Matrix2<f64>, [Vector2<f64>; 3]) {
        let end = TipDerivatives::new(&self.point());
        let fixed = |v: [f64; 2]| self.turn() * Vector2::from(v);
        let by = self.by / self.integrals.lam;
        (self.turn() * by, [end.pp, end.pl, end.ll].map(fixed))
    }
}

fn pulled(lam: f64) -> Result<f64> {
    if !(lam > 0.0 && lam < TAUT) {
        return Err(Error::domain(format!(
            "the rod is pulled with lambda = {lam}; its mass is followed for 0 < lambda < {TAUT}"
        )));
    }
    Ok(lam)
}

/// The nodes and weights on [0, 1] of the Gauss rule of at least so many nodes that fill all lanes, drawn so far to the clamp.
#[inline(always)]
fn nodes(least: usize, draw: usize) -> [&'static [f64]; 2] {
    const RULES: usize = 128;
    static KEPT: [[OnceLock<Rule>; RULES]; DRAWS] =
        [const { [const { OnceLock::new() }; RULES] }; DRAWS];
    let full = least.div_ceil(WIDEST).clamp(1, RULES);
    let rule = KEPT[draw][full - 1].get_or_init(|| {
        let mut rule = Rule::new(WIDEST * full);
        for (x, weight) in rule.nodes.iter_mut().zip(&mut rule.weights) {
            let [part, stretch] = drawn(draw, *x);
            (*x, *weight) = (part, *weight * stretch);
        }
        rule
    });
    [&rule.nodes, &rule.weights]
}

/// What is integrated along a rod: K numbers at the section with `part` of the rod beyond it, where the pendulum is at `here`.
trait AtSection<const K: usize> {
    fn at<T: Real>(&self, rod: &RodInertia, part: T, here: &Swing<T>) -> [T; K];
}

struct Sections<'a, E> {
    rod: &'a RodInertia,
    each: &'a E,
}

impl<E: AtSection<K>, const K: usize> InLanes<K> for Sections<'_, E> {
    #[inline(always)]
    fn at<S: Simd>(&self, part: Lanes<S>) -> [Lanes<S>; K] {
        let here = self.rod.along.at(part).swing(&self.rod.modulus);
        self.each.at(self.rod, part, &here)
    }
}

/// [`RodInertia::pushed`].
struct Weightless<'a>(&'a Turning);

impl AtSection<5> for Weightless<'_> {
    #[inline(always)]
    fn at<T: Real>(&self, rod: &RodInertia, part: T, here: &Swing<T>) -> [T; 5] {
        rod.pushed(self.0, part, here, &rod.field(part, here))
    }
}

/// Mass and force of [`RodInertia::added`] of a rod that is at (p, lam) and whose end moves with `v`, all of it compiled for wide registers, since it
/// is part of every step of a run.
struct Adding {
    p: f64,
    lam: f64,
    error: f64,
    v: Vector2<f64>,
    gravity: Vector2<f64>,
}

impl WithSimd for Adding {
    type Output = Option<(Matrix2<f64>, Vector2<f64>)>;

    #[inline(always)]
    fn with_simd<S: Simd>(self, simd: S) -> Self::Output {
        let rod = RodInertia::at_load(self.p, self.lam).ok()?;
        let rod = rod.to_part(self.error);
        let (inverse, rate) = rod.chart_rate(&self.v)?;
        let turning = Turning::new(&rod.clamp, rate.into());
        let ([places, weights], rod) = (rod.nodes(), &rod);
        if self.gravity == Vector2::zeros() {
            let each = &Weightless(&turning);
            let sums = lanes::sums_in(simd, &Sections { rod, each }, places, weights);
            return rod.felt(&inverse, &turning, sums, &Vector2::zeros());
        }
        let each = &Heavy(&turning);
        let [n11, n12, n22, f1, f2, along @ ..] =
            lanes::sums_in(simd, &Sections { rod, each }, places, weights);
        let weight = rod.weighed(along, &self.gravity);
        rod.felt(&inverse, &turning, [n11, n12, n22, f1, f2], &weight)
    }
}

/// The same sums, then lam times the derivatives of the place by p and lam, and the place.
struct Heavy<'a>(&'a Turning);

impl AtSection<11> for Heavy<'_> {
    #[inline(always)]
    fn at<T: Real>(&self, rod: &RodInertia, part: T, here: &Swing<T>) -> [T; 11] {
        let field = rod.field(part, here);
        let [n11, n12, n22, f1, f2] = rod.pushed(self.0, part, here, &field);
        let [w, p, l] = field;
        [n11, n12, n22, f1, f2, p[0], p[1], l[0], l[1], w[0], w[1]]
    }
}

/// lam^2 of r_q^T r_q, and theta'_q theta'_q^T.
struct Still;

impl AtSection<6> for Still {
    #[inline(always)]
    fn at<T: Real>(&self, rod: &RodInertia, part: T, here: &Swing<T>) -> [T; 6] {
        let lam = rod.integrals.lam;
        let [_, by_p, by_l] = rod.field(part, here);
        // theta' = -lam psi_u at u = lam (1 - s).
        let p = here.psi_pu * -lam;
        let l = here.psi_u * -1.0 - part * here.psi_uu * lam;
        [
            dot(by_p, by_p),
            dot(by_p, by_l),
            dot(by_l, by_l),
            p * p,
            p * l,
            l * l,
        ]
    }
}

/// How the turned axes move.
struct Turning {
    /// (p', lam').
    rate: [f64; 2],
    /// alpha', alpha''.
    first: f64,
    second: f64,
    /// Z'' of the pendulum at the clamp.
    z: [f64; 2],
}

impl Turning {
    #[inline(always)]
    fn new(clamp: &Swing, rate: [f64; 2]) -> Self {
        let [p, l] = rate;
        let [cos, sin] = clamp.z_u();
        let along = 2.0 * p * l * clamp.psi_p + l * l * clamp.psi_u;
        // alpha = -psi at the clamp.
        Self {
            rate,
            first: -(clamp.psi_p * p + clamp.psi_u * l),
            second: -(clamp.psi_pp * p * p + 2.0 * clamp.psi_pu * p * l + clamp.psi_uu * l * l),
            z: [
                clamp.z_pp[0] * p * p - sin * along,
                clamp.z_pp[1] * p * p + cos * along,
            ],
        }
    }
}

/// x - y.
#[inline(always)]
fn less<T: Real>(x: f64, y: T) -> T {
    y.all(x) - y
}

#[inline(always)]
fn dot<T: Real>(a: [T; 2], b: [T; 2]) -> T {
    a[0].times_plus(b[0], a[1] * b[1])
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Catches nodes that are drawn to a bend where they should not be, or too few of them, on taut rods that end before, at and beyond their bend: the
    /// even rule with all the nodes that there are is another way.
    #[test]
    fn drawn_nodes_integrate_as_even_ones_do() {
        let mut drawn = 0;
        for p in [2.6, 4.0, 5.5, 7.0, 9.0, 14.0, 29.0, 45.0, 70.0, 95.0] {
            for short in [12.0, 8.0, 4.0, 2.0, 1.0, 0.5, 0.2, 0.0, -0.2, -0.5, -0.7] {
                let lam = p + 4f64.ln() - short;
                let Ok(mut rod) = RodInertia::at_load(p, lam) else {
                    continue;
                };
                let turning = Turning::new(&rod.clamp, [0.7, -0.3]);
                let each = Heavy(&turning);
                let [places, weights] = nodes(512, 0);
                let (all, each) = (&rod, &each);
                let even = lanes::sums(&Sections { rod: all, each }, places, weights);
                for part in [1e-4, 1e-7, 1e-10] {
                    rod = rod.to_part(part);
                    drawn += usize::from(rod.along.rule(part).1 > 0);
                    let found = rod.integrals(each);
                    for of in [0..3, 3..5, 5..11] {
                        let size = even[of.clone()]
                            .iter()
                            .fold(0.0, |a: f64, x| a.max(x.abs()));
                        for k in of {
                            let off = (found[k] - even[k]).abs() / (size * part);
                            assert!(off < 10.0, "p {p} lam {lam} part {part:e}: {off}");
                        }
                    }
                }
            }
        }
        assert!(drawn > 100, "{drawn}");
    }
}
