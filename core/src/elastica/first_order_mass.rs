//! First-order inertia of a light planar rod: added mass and force at its end (theory 2.9).
//!
//! The rod stays on its equilibria r(s; q). Its kinetic energy is then m/2 int |P v|^2 ds with v the velocity of the
//! end and P(s) = r_q (Dr(1))^-1: the rod adds the mass m int P^T P ds to that of the body. All fields are closed
//! forms. The section at the distance u = lam (1 - s) from the tip is that of the pendulum of the same modulus at the
//! amplitude phi(u),
//!
//! ```text
//! r(s) = Rot(alpha) (Z(lam) - Z(u))/lam,   Z(u) = int_0^u (cos psi, sin psi).
//! ```
//!
//! Units: length 1, bending stiffness 1.

mod end_inertia;
mod fold_ahead;
mod follow_mass;
mod moving_clamp;
mod near_straight;
mod small_force;
mod taut_inertia;

pub use fold_ahead::{FoldNormalForm, INERTIAL_ESCAPE, VISCOUS_ESCAPE};
pub use follow_mass::LightRod;
pub use taut_inertia::TautInertia;

use end_inertia::{EndMotion, dot, inertia_integrand, inertia_integrand_with_weight, quarter_turn};
use moving_clamp::MovingClampInertia;

use super::chart::{ChartPoint, Integrals, Modulus};
use super::curvature::{Swing, TipDerivatives};
use super::shape_by_theta::{DRAWS, RodTheta, graded_node};
use super::simd_sums::{self, InLanes, Lanes, WIDEST};
use crate::error::{Error, Result};
use crate::math::frame::Frame;
use crate::math::gauss::Rule;
use crate::math::real::Real;
use nalgebra::{Matrix2, Vector2};
use pulp::{Simd, WithSimd};
use std::sync::OnceLock;

/// Load lam above which the derivatives by (p, lam) lose their digits; [`TautInertia`] serves these rods.
const TAUT: f64 = 100.0;

/// Least relative error that the integrals along the rod can be given: as good as exact.
const EXACT: f64 = 1e-12;
/// Largest relative error that the integrals along the rod can be given.
const ROUGH: f64 = 1e-4;

/// First-order inertia of the rod at the equilibrium (p, lam), per unit of its mass.
pub struct RodInertia {
    p: f64,
    modulus: Modulus,
    /// The chart's integrals at (p, lam).
    integrals: Integrals,
    clamp: Swing,
    along: RodTheta,
    /// Relative error allowed in the integrals along the rod.
    error: f64,
    /// [`RodInertia::field`] of the end section.
    end: [[f64; 2]; 3],
    /// lam d r(1)/d(p, lam), in the axes of [`ChartPoint::turned`].
    by: Matrix2<f64>,
}

/// Contribution of a unit of the rod's mass to the equation of motion of the end.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct AddedInertia {
    /// Added mass A = int P^T P ds.
    pub mass: Matrix2<f64>,
    /// Force int P^T (g - e) ds, with e the acceleration of the sections at zero acceleration of the end.
    pub force: Vector2<f64>,
    /// Centre of mass int r ds.
    pub centre: Vector2<f64>,
}

/// Equilibrium rod, in coordinates that keep all digits along the rod. Its end moves with `v`, seen from the clamp.
trait OnEquilibria {
    /// Motion of the end, and the sums of [`inertia_integrand_with_weight`]; `None` at a fold.
    fn sums_with_weight(&self, v: &Vector2<f64>) -> Option<(EndMotion, [f64; 12])>;

    /// Motion of the end, and the sums of [`moving_clamp::moving_clamp_integrand`]; `None` at a fold.
    fn sums_on_moving_clamp(&self, v: &Vector2<f64>) -> Option<(EndMotion, [f64; 20])>;

    /// [`RodInertia::added`].
    fn added_inertia(&self, v: &Vector2<f64>, gravity: &Vector2<f64>) -> Option<AddedInertia> {
        let (motion, sums) = self.sums_with_weight(v)?;
        motion.added_inertia(sums, gravity)
    }

    /// First-order inertia on a moving clamp; gravity is given in the world.
    fn moving_clamp_inertia(
        &self,
        v: &Vector2<f64>,
        gravity: &Vector2<f64>,
        frame: &Frame<2>,
    ) -> Option<MovingClampInertia> {
        let (motion, sums) = self.sums_on_moving_clamp(v)?;
        motion.moving_clamp_inertia(sums, v, gravity, frame)
    }
}

impl RodInertia {
    /// The rod at the chart point (p, w).
    ///
    /// # Errors
    /// A point outside the chart; a pull above lam = 100.
    pub fn new(p: f64, w: f64) -> Result<Self> {
        Self::with_integrals(p, Integrals::new(p, w))
    }

    /// Inertia at a chart point whose integrals are known.
    #[inline(always)]
    fn with_integrals(p: f64, integrals: Integrals) -> Result<Self> {
        let Integrals {
            kap, kap_c, lam, ..
        } = integrals;
        let modulus = Modulus { kap, kap_c };
        let along = RodTheta::new(&modulus, check_pull(lam)?);
        Ok(Self::of(p, modulus, integrals, along))
    }

    /// Inertia of the rod of modulus p under the load lam.
    ///
    /// # Errors
    /// A load lam outside (0, 100).
    #[inline(always)]
    pub fn at_load(p: f64, lam: f64) -> Result<Self> {
        let modulus = Modulus::new(p);
        let along = RodTheta::new(&modulus, check_pull(lam)?);
        Ok(Self::of(p, modulus, along.clamp(&modulus), along))
    }

    /// Allows the relative error `error`, between 1e-12 and 1e-4, in the integrals along the rod.
    #[must_use]
    #[inline(always)]
    pub fn with_error(self, error: f64) -> Self {
        let error = error.clamp(EXACT, ROUGH);
        Self { error, ..self }
    }

    #[inline(always)]
    fn of(p: f64, modulus: Modulus, integrals: Integrals, along: RodTheta) -> Self {
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
        rod.end = rod.vector_to_end(1.0, &rod.clamp);
        let [_, by_p, by_l] = rod.end;
        rod.by = Matrix2::new(by_p[0], by_l[0], by_p[1], by_l[1]);
        rod
    }

    /// Point of the amplitude chart.
    fn point(&self) -> ChartPoint {
        ChartPoint::from_integrals(self.p, self.integrals)
    }

    /// Inverse (lam Dr(1))^-1, and the rate d(p, lam)/dt for the end velocity `v`; `None` at a fold.
    #[inline(always)]
    fn chart_rate(&self, v: &Vector2<f64>) -> Option<(Matrix2<f64>, Vector2<f64>)> {
        let inverse = self.by.try_inverse()?;
        Some((
            inverse,
            inverse * self.in_turned_axes(v) * self.integrals.lam,
        ))
    }

    /// A vector in the axes of [`ChartPoint::turned`].
    fn in_turned_axes(&self, v: &Vector2<f64>) -> Vector2<f64> {
        self.turn().tr_mul(v)
    }

    /// Position of the end.
    fn place(&self) -> Vector2<f64> {
        self.turn() * Vector2::from(self.end[0]) / self.integrals.lam
    }

    /// Rotation from the axes of [`ChartPoint::turned`] to those of the clamp.
    fn turn(&self) -> Matrix2<f64> {
        // alpha = -psi at the clamp.
        let [cos, minus] = self.clamp.z_u;
        let sin = -minus;
        Matrix2::new(cos, -sin, sin, cos)
    }

    /// Position of a section and its derivatives by p and lam, all times lam. `part`: fraction of the rod beyond the
    /// section; `here`: the pendulum at the section.
    #[inline(always)]
    fn field<T: Real>(&self, part: T, here: &Swing<T>) -> [[T; 2]; 3] {
        let drawn = self.vector_to_end(part, here);
        let [w, p, l] = self.end;
        [
            subtract(w, drawn[0]),
            subtract(p, drawn[1]),
            subtract(l, drawn[2]),
        ]
    }

    /// Vector from a section to the end and its derivatives, all times lam: Rot(alpha) Z/lam in the turned axes,
    /// alpha = -psi at the clamp.
    #[inline(always)]
    fn vector_to_end<T: Real>(&self, part: T, here: &Swing<T>) -> [[T; 2]; 3] {
        let (a_p, a_l) = (-self.clamp.psi_p, -self.clamp.psi_u());
        let slower = -1.0 / self.integrals.lam;
        let ([x, y], z_p, z_u) = (here.z, here.z_p, here.z_u);
        [
            here.z,
            [
                T::weighted_sum([1.0, -a_p], [z_p[0], y]),
                T::weighted_sum([1.0, a_p], [z_p[1], x]),
            ],
            [
                part.times_plus(z_u[0], T::weighted_sum([slower, -a_l], [x, y])),
                part.times_plus(z_u[1], T::weighted_sum([slower, a_l], [y, x])),
            ],
        ]
    }

    /// Motion of the rod at the rate `rate` of (p, lam).
    #[inline(always)]
    fn turning(&self, rate: Vector2<f64>) -> ForceTurning {
        ForceTurning::new(&self.clamp, self.integrals.lam, rate.into())
    }

    /// Integrals along the rod.
    #[inline(always)]
    fn integrals<const K: usize>(&self, each: &impl AtSection<K>) -> [f64; K] {
        let [places, weights] = self.nodes();
        simd_sums::sums(&ChartSections { rod: self, each }, places, weights)
    }

    /// Nodes along the rod, and their weights.
    #[inline(always)]
    fn nodes(&self) -> [&'static [f64]; 2] {
        let (least, draw) = self.along.rule(self.error);
        nodes(least, draw)
    }

    /// Added mass, force and centre per unit of mass, for the end velocity `v` and gravity; `None` at a fold.
    pub fn added(&self, v: &Vector2<f64>, gravity: &Vector2<f64>) -> Option<AddedInertia> {
        self.added_inertia(v, gravity)
    }

    /// Motion of the end with the velocity `v`, and the rotation of the axes of [`ChartPoint::turned`] in it; `None`
    /// at a fold.
    #[inline(always)]
    fn end_motion(&self, v: &Vector2<f64>) -> Option<(EndMotion, ForceTurning)> {
        let (inverse, rate) = self.chart_rate(v)?;
        let turning = self.turning(rate);
        let moving = EndMotion {
            scale: self.integrals.lam,
            turn: self.turn(),
            inverse,
            rate,
            end: self.second_of_end(&turning),
            spin: turning.turn,
        };
        Some((moving, turning))
    }

    /// Second derivative lam r_tt of the end as in [`ForceTurning`], without the term along r_t.
    #[inline(always)]
    fn second_of_end(&self, turning: &ForceTurning) -> Vector2<f64> {
        let rate = self.by * Vector2::from(turning.rate);
        Vector2::from(turning.end) + quarter_turn(&rate) * (2.0 * turning.turn)
    }

    /// Metrics (N, R) = int (r_q^T r_q, theta'_q theta'_q^T) ds in q = (p, lam). N is twice the kinetic energy of the
    /// rates q' per unit of mass; R is their dissipation by Kelvin-Voigt friction of the time 1.
    pub fn metric(&self) -> (Matrix2<f64>, Matrix2<f64>) {
        let lam = self.integrals.lam;
        let [n11, n12, n22, r11, r12, r22] = self.integrals(&MetricIntegrand);
        (
            Matrix2::new(n11, n12, n12, n22) / (lam * lam),
            Matrix2::new(r11, r12, r12, r22),
        )
    }

    /// Jacobian d r(1)/d(p, lam), and second derivatives (pp, p lam, lam lam).
    pub fn end(&self) -> (Matrix2<f64>, [Vector2<f64>; 3]) {
        let end = TipDerivatives::new(&self.point());
        let fixed = |v: [f64; 2]| self.turn() * Vector2::from(v);
        let by = self.by / self.integrals.lam;
        (self.turn() * by, [end.pp, end.pl, end.ll].map(fixed))
    }
}

fn check_pull(lam: f64) -> Result<f64> {
    if !(lam > 0.0 && lam < TAUT) {
        return Err(Error::domain(format!(
            "the rod is pulled with lambda = {lam}; here 0 < lambda < {TAUT} is allowed: of a rod that is bent at its clamp alone take TautInertia"
        )));
    }
    Ok(lam)
}

/// Nodes and weights on [0, 1] of the Gauss rule of at least `least` nodes that fills all lanes, graded towards the
/// clamp by `draw`.
#[inline(always)]
fn nodes(least: f64, draw: usize) -> [&'static [f64]; 2] {
    const RULES: usize = 128;
    const LANES: f64 = WIDEST as f64;
    static KEPT: [[OnceLock<Rule>; RULES]; DRAWS] =
        [const { [const { OnceLock::new() }; RULES] }; DRAWS];
    // A counting loop instead of a division: branch prediction starts on the expected rule before `least` is known.
    let (mut full, mut beyond) = (1, LANES + 1.0);
    while full < RULES && beyond <= least {
        (full, beyond) = (full + 1, beyond + LANES);
    }
    let rule = KEPT[draw][full - 1].get_or_init(|| {
        let mut rule = Rule::new(WIDEST * full);
        for (x, weight) in rule.nodes.iter_mut().zip(&mut rule.weights) {
            let [part, stretch] = graded_node(draw, *x);
            (*x, *weight) = (part, *weight * stretch);
        }
        rule
    });
    [&rule.nodes, &rule.weights]
}

/// Integrand of K components at the section with the fraction `part` of the rod beyond it, where the pendulum is at
/// `here`.
trait AtSection<const K: usize> {
    fn at<T: Real>(&self, rod: &RodInertia, part: T, here: &Swing<T>) -> [T; K];
}

struct ChartSections<'a, E> {
    rod: &'a RodInertia,
    each: &'a E,
}

impl<E: AtSection<K>, const K: usize> InLanes<K> for ChartSections<'_, E> {
    #[inline(always)]
    fn at<S: Simd>(&self, part: Lanes<S>) -> [Lanes<S>; K] {
        let here = self.rod.along.at(part).swing(&self.rod.modulus);
        self.each.at(self.rod, part, &here)
    }
}

/// Integrand [`inertia_integrand`], without gravity.
struct Weightless<'a>(&'a ForceTurning);

impl AtSection<6> for Weightless<'_> {
    #[inline(always)]
    fn at<T: Real>(&self, rod: &RodInertia, part: T, here: &Swing<T>) -> [T; 6] {
        inertia_integrand(
            &rod.field(part, here),
            &self.0.difference_from_end(part, here),
        )
    }
}

/// Mass and force of [`RodInertia::added`] at (p, w) for the end velocity `v`. The whole computation is compiled for
/// wide registers: every step of a run needs it.
struct Adding {
    p: f64,
    integrals: Integrals,
    error: f64,
    v: Vector2<f64>,
    gravity: Vector2<f64>,
}

impl WithSimd for Adding {
    type Output = Option<(Matrix2<f64>, Vector2<f64>)>;

    #[inline(always)]
    fn with_simd<S: Simd>(self, simd: S) -> Self::Output {
        let rod = RodInertia::with_integrals(self.p, self.integrals).ok()?;
        let rod = rod.with_error(self.error);
        let (moving, turning) = rod.end_motion(&self.v)?;
        let ([places, weights], rod) = (rod.nodes(), &rod);
        if self.gravity == Vector2::zeros() {
            let each = &Weightless(&turning);
            let sums = simd_sums::sums_in(simd, &ChartSections { rod, each }, places, weights);
            return moving.mass_and_force(sums, &Vector2::zeros());
        }
        let each = &Heavy(&turning);
        let [n11, n12, n22, f1, f2, turned, along @ ..] =
            simd_sums::sums_in(simd, &ChartSections { rod, each }, places, weights);
        let weight = moving.weight_integral(along, &self.gravity);
        moving.mass_and_force([n11, n12, n22, f1, f2, turned], &weight)
    }
}

/// Integrand [`inertia_integrand_with_weight`], with gravity.
struct Heavy<'a>(&'a ForceTurning);

impl AtSection<12> for Heavy<'_> {
    #[inline(always)]
    fn at<T: Real>(&self, rod: &RodInertia, part: T, here: &Swing<T>) -> [T; 12] {
        let field = rod.field(part, here);
        inertia_integrand_with_weight(&field, &self.0.difference_from_end(part, here))
    }
}

/// Integrand of [`RodInertia::metric`]: lam^2 r_q^T r_q, and theta'_q theta'_q^T.
struct MetricIntegrand;

impl AtSection<6> for MetricIntegrand {
    #[inline(always)]
    fn at<T: Real>(&self, rod: &RodInertia, part: T, here: &Swing<T>) -> [T; 6] {
        let lam = rod.integrals.lam;
        let [_, by_p, by_l] = rod.field(part, here);
        // theta' = -lam psi_u at u = lam (1 - s).
        let p = here.z_p[1] * lam;
        let l = part.times_plus(here.z_u[1] * lam, here.z[1]);
        [
            dot(&by_p, &by_p),
            dot(&by_p, &by_l),
            dot(&by_l, &by_l),
            p * p,
            p * l,
            l * l,
        ]
    }
}

/// Motion of the rod while p and lam change at constant rates. With R = lam r_t and J the rotation by a right angle,
/// in the turned axes (theory 2.9),
///
/// ```text
/// lam r_tt = F(lam) - F(u) + 2 (alpha' J - lam'/lam) R,   F = Z_tt + (alpha'' + 2 alpha' lam'/lam) J Z + alpha'^2 Z
/// ```
///
/// A term of r_tt along R occurs in the end's acceleration c too, hence in P c, and drops out of r_tt - P c.
struct ForceTurning {
    /// (p', lam').
    rate: [f64; 2],
    /// alpha'.
    turn: f64,
    /// alpha'' + 2 alpha' lam'/lam.
    aside: f64,
    /// F(lam).
    end: [f64; 2],
}

impl ForceTurning {
    #[inline(always)]
    fn new(clamp: &Swing, lam: f64, rate: [f64; 2]) -> Self {
        let [p, l] = rate;
        // alpha = -psi at the clamp.
        let turn = -(clamp.psi_p * p + clamp.psi_u() * l);
        let change = clamp.z_p[1] * (2.0 * p * l) + clamp.z_u[1] * (l * l) - clamp.psi_pp * (p * p);
        let mut turning = Self {
            rate,
            turn,
            aside: change + 2.0 * turn * l / lam,
            end: [0.0; 2],
        };
        turning.end = turning.difference_from_end(1.0, clamp).map(|f| -f);
        turning
    }

    /// Difference F(lam) - F(u) at the section with the fraction `part` of the rod beyond it, where the pendulum is
    /// at `here`.
    #[inline(always)]
    fn difference_from_end<T: Real>(&self, part: T, here: &Swing<T>) -> [T; 2] {
        let ([p, l], [x, y], [cos, sin]) = (self.rate, here.z, here.z_u);
        let (square, end) = (self.turn * self.turn, self.end.map(|f| x.all(f)));
        // psi_tt of the section, with dpsi/du = -y.
        let along = part * T::weighted_sum([2.0 * p * l, -l * l], [here.psi_p, part * y]);
        [
            along.times_plus(
                sin,
                T::weighted_sum(
                    [1.0, -p * p, self.aside, -square],
                    [end[0], here.z_pp[0], y, x],
                ),
            ),
            along.times_plus(
                cos * -1.0,
                T::weighted_sum(
                    [1.0, -p * p, -self.aside, -square],
                    [end[1], here.z_pp[1], x, y],
                ),
            ),
        ]
    }
}

/// x - y.
#[inline(always)]
fn subtract<T: Real>(x: [f64; 2], y: [T; 2]) -> [T; 2] {
    [y[0].all(x[0]) - y[0], y[1].all(x[1]) - y[1]]
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Catches wrong grading or too few nodes, on taut rods that end before, at and beyond their bend. Reference: the
    /// ungraded rule with the largest number of nodes.
    #[test]
    fn drawn_nodes_integrate_as_even_ones_do() {
        let mut drawn = 0;
        for p in [2.6, 4.0, 5.5, 7.0, 9.0, 14.0, 29.0, 45.0, 70.0, 95.0] {
            for short in [
                12.0, 8.0, 4.0, 2.0, 1.0, 0.75, 0.5, 0.2, 0.0, -0.2, -0.5, -0.7,
            ] {
                let lam = p + 4f64.ln() - short;
                let Ok(mut rod) = RodInertia::at_load(p, lam) else {
                    continue;
                };
                let turning = rod.turning(Vector2::new(0.7, -0.3));
                let each = Heavy(&turning);
                let [places, weights] = nodes(512.0, 0);
                let (all, each) = (&rod, &each);
                let even = simd_sums::sums(&ChartSections { rod: all, each }, places, weights);
                for part in [1e-4, 1e-6, 1e-8, 1e-10] {
                    rod = rod.with_error(part);
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
