//! First-order inertia of a taut rod: straight along its pull but for a bend at the clamp (theory 2.9).
//!
//! The derivatives by p and by lam both turn the rod and cancel down to 1/lam^2 of their size. The coordinates are
//! therefore ln T and ln lam, with T = tan(gam/4) and gam the direction of the pull. With sigma = lam s, u = lam
//! (1 - s) and y = T sinh(u)/cosh(lam), in the axes of the pull and up to exp(-2 lam),
//!
//! ```text
//! lam r = (sigma - 4 (F - f), -4 (G - g)),   f = y^2/(1 + y^2),   g = y/(1 + y^2),   F and G those of T.
//! ```
//!
//! The bend alone has y = T exp(-sigma); sinh adds the reflection at the free end. All derivatives follow from those
//! of y: T y_T = y, lam y_lam = -rho y, rho = lam - u coth u. Where y is negligible the position and its derivatives
//! are linear in sigma, and two nodes serve all of that part.

use super::end_inertia::{
    EndMotion, PlaceByChart, inertia_integrand, inertia_integrand_with_weight,
};
use super::moving_clamp::moving_clamp_integrand;
use super::{AddedInertia, EXACT, OnEquilibria, ROUGH, nodes};
use crate::elastica::chart::Integrals;
use crate::elastica::shape_by_theta::{reach_of_bend, rule_of_bend};
use crate::elastica::simd_sums::{self, InLanes, Lanes};
use crate::manifold::TAUT;
use crate::math::real::Real;
use nalgebra::{Matrix2, Vector2};
use pulp::{Simd, WithSimd};
use std::f64::consts::LN_2;

/// Node 1/sqrt(3) of the two-point Gauss rule on [-1, 1].
const FRAC_1_SQRT_3: f64 = 0.577_350_269_189_625_8;

/// ln |T| above which the bend is a loop away from the clamp.
const LOOPED: f64 = 3.0;

/// First-order inertia of a taut rod, per unit of mass.
#[derive(Debug, Clone, Copy)]
pub struct TautInertia {
    lam: f64,
    /// T = tan(gam/4), with the sign of p, and ln |T|.
    t: f64,
    ln_t: f64,
    /// exp(-lam).
    faded: f64,
    clamp: TautBend,
    /// Relative error allowed in the integrals along the rod.
    error: f64,
    /// Start of the straight part in sigma, to that error; at most lam.
    reach: f64,
}

/// Shape functions of y.
#[derive(Debug, Clone, Copy)]
struct TautBend<T = f64> {
    /// y^2/(1 + y^2).
    f: T,
    /// y/(1 + y^2).
    g: T,
    /// 1 - 2 f.
    c: T,
}

impl<T: Real> TautBend<T> {
    /// Shape functions from y and 1/(1 + y^2).
    #[inline(always)]
    fn new(y: T, over: T) -> Self {
        let (one, square) = (y.all(1.0), y * y);
        Self {
            f: square * over,
            g: y * over,
            c: (one - square) * over,
        }
    }
}

/// Section at the distance sigma from the clamp.
struct TautSection<T = f64> {
    sigma: T,
    bend: TautBend<T>,
    /// rho = -d ln y/d ln lam, and d rho/d ln lam - rho.
    rho: T,
    rise: T,
}

impl TautInertia {
    /// The rod at the chart point (p, w); `None` as in [`Self::at_load`].
    #[must_use]
    pub fn new(p: f64, w: f64) -> Option<Self> {
        Self::at_load(p, Integrals::new(p, w).lam)
    }

    /// The rod of modulus p under the load lam; `None` if it is not taut or its bend is a loop that has left the
    /// clamp.
    #[must_use]
    pub fn at_load(p: f64, lam: f64) -> Option<Self> {
        // lam = |p| + ln(2 T).
        let ln_t = lam - p.abs() - LN_2;
        let taut = lam > TAUT && ln_t < LOOPED.min(0.5 * (lam - TAUT));
        let t = ln_t.exp().copysign(p);
        taut.then(|| {
            let rod = Self {
                lam,
                t,
                ln_t,
                faded: (-lam).exp(),
                clamp: TautBend::new(t, 1.0 / (1.0 + t * t)),
                error: EXACT,
                reach: lam,
            };
            rod.to_part(EXACT)
        })
    }

    /// Allows the relative error `error`, between 1e-12 and 1e-4, in the integrals along the rod.
    #[must_use]
    pub fn to_part(self, error: f64) -> Self {
        let error = error.clamp(EXACT, ROUGH);
        let reach = self.lam.min(reach_of_bend(self.ln_t, error));
        Self {
            error,
            reach,
            ..self
        }
    }

    /// |T|.
    pub(super) fn bend(&self) -> f64 {
        self.t.abs()
    }

    /// Added mass, force and centre, as [`RodInertia::added`](super::RodInertia::added).
    pub fn added(&self, v: &Vector2<f64>, gravity: &Vector2<f64>) -> Option<AddedInertia> {
        self.added_inertia(v, gravity)
    }

    /// Mass and force of [`Self::added`], in wide registers.
    #[inline(always)]
    pub(super) fn mass_and_force(
        &self,
        v: &Vector2<f64>,
        gravity: &Vector2<f64>,
    ) -> Option<(Matrix2<f64>, Vector2<f64>)> {
        simd_sums::wide(WideInertia {
            rod: self,
            v,
            gravity,
        })
    }

    #[inline(always)]
    fn end_motion(&self, v: &Vector2<f64>) -> Option<EndMotion> {
        let end = self.end();
        let [_, by_t, by_l] = self.field(&end);
        let inverse = Matrix2::new(by_t[0], by_l[0], by_t[1], by_l[1]).try_inverse()?;
        // cos gam and sin gam, gam = 4 atan T.
        let TautBend { g, c, .. } = self.clamp;
        let (cos, sin) = (c * c - 4.0 * g * g, 4.0 * g * c);
        let turn = Matrix2::new(cos, -sin, sin, cos);
        let scale = 0.25 * self.lam;
        let rate = inverse * turn.tr_mul(v) * scale;
        Some(EndMotion {
            scale,
            turn,
            inverse,
            rate,
            end: self.second(&end, &rate).into(),
            spin: 0.0,
        })
    }

    /// Integrals along the rod while (ln T, ln lam) changes at `rate`.
    fn integrals<const K: usize>(&self, each: &impl Integrand<K>, rate: &Vector2<f64>) -> [f64; K] {
        let ([places, weights], rod) = (self.nodes(), self);
        let bend = simd_sums::sums(&TautSections { rod, each, rate }, places, weights);
        self.with_straight(bend, each, rate)
    }

    /// Nodes and weights along the bend.
    #[inline(always)]
    fn nodes(&self) -> [&'static [f64]; 2] {
        let (least, draw) = rule_of_bend(self.reach, self.ln_t, self.error);
        nodes(least, draw)
    }

    /// Means over the whole rod from those over the bend.
    #[inline(always)]
    fn with_straight<const K: usize>(
        &self,
        mut means: [f64; K],
        each: &impl Integrand<K>,
        rate: &Vector2<f64>,
    ) -> [f64; K] {
        let half = 0.5 * (self.lam - self.reach);
        if half > 0.0 {
            // The two-point Gauss rule is exact: the integrands are products of two linear functions.
            let (middle, aside) = (self.reach + half, half * FRAC_1_SQRT_3);
            let [near, far] = [middle - aside, middle + aside].map(|sigma| {
                let (field, second) = self.straight(sigma, rate);
                each.of(&field, &second)
            });
            let (bent, half) = (self.reach / self.lam, half / self.lam);
            for k in 0..K {
                means[k] = means[k] * bent + (near[k] + far[k]) * half;
            }
        }
        means
    }

    /// [`Self::field`] and [`Self::second`] on the straight part, y = 0.
    #[inline(always)]
    fn straight(&self, sigma: f64, rate: &Vector2<f64>) -> (PlaceByChart<f64>, [f64; 2]) {
        let TautBend { f, g, c } = self.clamp;
        let (square, beyond) = (g * g, sigma - 2.0 * f);
        let field = [
            [0.25 * sigma - f, -g],
            [2.0 * square, beyond * g - g],
            [f, g],
        ];
        let [tt, tl] = [rate.x * rate.x, 2.0 * rate.x * rate.y];
        let second = [
            square * (tt * (4.0 + 2.0 * c - 4.0 * beyond) - 2.0 * tl),
            g * (tt * 4.0 * square + tl * (1.0 + 2.0 * f)),
        ];
        (field, second)
    }

    /// Section with the fraction `part` > 0 of the bend beyond it.
    #[inline(always)]
    fn section<S: Simd>(&self, part: Lanes<S>) -> TautSection<Lanes<S>> {
        let left = part * self.reach;
        let sigma = left.all(self.reach) - left;
        let u = left.all(self.lam) - sigma;
        let [near, far] = sigma.faded();
        let tip = far * self.faded;
        let (one, back) = (u.all(1.0), tip * tip);
        let (sinh, cosh) = (one - back, one + back);
        let y = near * sinh * self.t;
        // One division for 1/sinh and 1/(1 + y^2).
        let square = y.times_plus(y, one);
        let over = (sinh * square).inverse();
        let per = u * square * over;
        TautSection {
            sigma,
            bend: TautBend::new(y, sinh * over),
            rho: u.all(self.lam) - per * cosh,
            rise: back * per * per * 4.0,
        }
    }

    #[inline(always)]
    fn end(&self) -> TautSection {
        TautSection {
            sigma: self.lam,
            bend: TautBend::new(0.0, 1.0),
            rho: self.lam - 1.0,
            rise: 1.0,
        }
    }

    /// Position times lam/4, and its derivatives by ln T and ln lam.
    #[inline(always)]
    fn field<T: Real>(&self, at: &TautSection<T>) -> PlaceByChart<T> {
        let (clamp, TautBend { f, g, c }) = (&self.clamp, at.bend);
        let (more, across) = (f.all(clamp.f) - f, g.all(clamp.g) - g);
        let pulled = at.rho * g;
        [
            [at.sigma * 0.25 - more, across * -1.0],
            [
                across * across * 2.0,
                (at.sigma - more * 2.0) * clamp.g - across * c,
            ],
            [more - pulled * g * 2.0, across - pulled * c],
        ]
    }

    /// Second derivative of the position in time, times lam/4, at constant rates of ln T and ln lam. The sum
    /// cos(gam/2) r_lnT (ln T)'^2 + r_lnlam (ln lam)'^2 is subtracted, which shortens the formulas: any combination
    /// of r_lnT and r_lnlam with factors constant along the rod drops out of r_tt - P c, as c is computed from the
    /// same function.
    #[inline(always)]
    fn second<T: Real>(&self, at: &TautSection<T>, rate: &Vector2<f64>) -> [T; 2] {
        let (clamp, TautBend { f, g, c }) = (&self.clamp, at.bend);
        let (rho, g2, gc) = (at.rho, g * g, g * c);
        let (more, across) = (f.all(clamp.f) - f, g.all(clamp.g) - g);
        let steady = clamp.g * clamp.c;
        // Second derivative by ln T; the axes turn by gam_lnT = 4 G.
        let square = clamp.g * clamp.g;
        let tt = [
            across
                * (c * (4.0 * clamp.g) + g.all(4.0 * steady) - gc * 4.0 - across * (2.0 * clamp.c))
                - (at.sigma - more * 2.0) * (4.0 * square),
            gc * (c - g.all(clamp.c)) + across * (g2 + g.all(square) - g * (3.0 * clamp.g)) * 4.0,
        ];
        let bent = c * c - g2 * 4.0;
        let tl = [
            across * (rho * gc * 2.0 - across) * 2.0,
            across * c + more * (2.0 * clamp.g) - rho * g * (bent + g * (8.0 * clamp.g)),
        ];
        // Second derivative by ln lam.
        let rho2 = rho * rho;
        let ll = [
            g2 * (rho2 * c * 2.0 - at.rise) * 2.0,
            g * (rho2 * bent - at.rise * c),
        ];
        let [t, l]: [f64; 2] = (*rate).into();
        let by = [t * t, 2.0 * t * l, l * l];
        [
            T::weighted_sum(by, [tt[0], tl[0], ll[0]]),
            T::weighted_sum(by, [tt[1], tl[1], ll[1]]),
        ]
    }
}

impl OnEquilibria for TautInertia {
    fn sums_with_weight(&self, v: &Vector2<f64>) -> Option<(EndMotion, [f64; 12])> {
        let motion = self.end_motion(v)?;
        let sums = self.integrals(&TautHeavy, &motion.rate);
        Some((motion, sums))
    }

    fn sums_on_moving_clamp(&self, v: &Vector2<f64>) -> Option<(EndMotion, [f64; 20])> {
        let motion = self.end_motion(v)?;
        let sums = self.integrals(&TautMoved, &motion.rate);
        Some((motion, sums))
    }
}

/// Computation of [`TautInertia::mass_and_force`], all compiled for wide registers: every step of a run needs it.
struct WideInertia<'a> {
    rod: &'a TautInertia,
    v: &'a Vector2<f64>,
    gravity: &'a Vector2<f64>,
}

impl WithSimd for WideInertia<'_> {
    type Output = Option<(Matrix2<f64>, Vector2<f64>)>;

    #[inline(always)]
    fn with_simd<S: Simd>(self, simd: S) -> Self::Output {
        let Self { rod, v, gravity } = self;
        let moving = rod.end_motion(v)?;
        let ([places, weights], rate) = (rod.nodes(), &moving.rate);
        if *gravity == Vector2::zeros() {
            let each = &TautWeightless;
            let bend = simd_sums::sums_in(simd, &TautSections { rod, each, rate }, places, weights);
            return moving.mass_and_force(rod.with_straight(bend, each, rate), &Vector2::zeros());
        }
        let each = &TautHeavy;
        let bend = simd_sums::sums_in(simd, &TautSections { rod, each, rate }, places, weights);
        let [n11, n12, n22, f1, f2, turned, along @ ..] = rod.with_straight(bend, each, rate);
        let weight = moving.weight_integral(along, gravity);
        moving.mass_and_force([n11, n12, n22, f1, f2, turned], &weight)
    }
}

/// Integrand of K components at a section.
trait Integrand<const K: usize> {
    fn of<T: Real>(&self, field: &PlaceByChart<T>, second: &[T; 2]) -> [T; K];
}

struct TautWeightless;

impl Integrand<6> for TautWeightless {
    #[inline(always)]
    fn of<T: Real>(&self, field: &PlaceByChart<T>, second: &[T; 2]) -> [T; 6] {
        inertia_integrand(field, second)
    }
}

struct TautHeavy;

impl Integrand<12> for TautHeavy {
    #[inline(always)]
    fn of<T: Real>(&self, field: &PlaceByChart<T>, second: &[T; 2]) -> [T; 12] {
        inertia_integrand_with_weight(field, second)
    }
}

struct TautMoved;

impl Integrand<20> for TautMoved {
    #[inline(always)]
    fn of<T: Real>(&self, field: &PlaceByChart<T>, second: &[T; 2]) -> [T; 20] {
        moving_clamp_integrand(field, second)
    }
}

struct TautSections<'a, E> {
    rod: &'a TautInertia,
    each: &'a E,
    rate: &'a Vector2<f64>,
}

impl<E: Integrand<K>, const K: usize> InLanes<K> for TautSections<'_, E> {
    #[inline(always)]
    fn at<S: Simd>(&self, part: Lanes<S>) -> [Lanes<S>; K] {
        let here = self.rod.section(part);
        let field = self.rod.field(&here);
        self.each.of(&field, &self.rod.second(&here, self.rate))
    }
}
