//! The same of a taut rod: straight along its pull but for a bend at the clamp, by the pull lam and its direction gam (theory 2.9).
//!
//! The derivatives by p and lam both turn the rod and cancel to a part of 1/lam^2 of them. So T = tan(gam/4) and lam are the coordinates here, as ln T and ln lam.
//! With sigma = lam s, u = lam (1 - s) and y = T sinh(u)/cosh(lam), in the axes of the pull and up to exp(-2 lam),
//!
//! ```text
//! lam r = (sigma - 4 (F - f), -4 (G - g)),   f = y^2/(1 + y^2),   g = y/(1 + y^2),   F and G those of T.
//! ```
//!
//! The bend alone has y = T exp(-sigma); sinh joins to it what the end without a couple throws back. All
//! derivatives follow from those of y: T y_T = y, lam y_lam = -rho y, rho = lam - u coth u.

use super::carried::{CarriedRod, carried};
use super::moving::{Field, Moving, heavy};
use super::{Added, EXACT, OnEquilibria, ROUGH, nodes};
use crate::elastica::along::rule_of_bend;
use crate::elastica::chart::Integrals;
use crate::elastica::lanes::{self, InLanes, Lanes};
use crate::manifold::TAUT;
use crate::math::frame::Frame;
use crate::math::real::Real;
use nalgebra::{Matrix2, Vector2};
use pulp::{Simd, WithSimd};
use std::f64::consts::{FRAC_2_PI, LN_2};

/// ln |T| above which its bend is a loop that has left the clamp.
const LOOPED: f64 = 3.0;

/// A taut rod as far as its mass is concerned, per unit of mass.
#[derive(Debug, Clone, Copy)]
pub struct TautInertia {
    lam: f64,
    /// T = tan(gam/4), and ln |T|.
    t: f64,
    ln_t: f64,
    clamp: Bend,
    /// Part of the integrals along the rod by which they may be off.
    error: f64,
}

/// What the shape is made of, as a function of y.
#[derive(Debug, Clone, Copy)]
struct Bend<T = f64> {
    /// y^2/(1 + y^2).
    f: T,
    /// y/(1 + y^2).
    g: T,
    /// 1 - 2 f.
    c: T,
}

impl<T: Real> Bend<T> {
    #[inline(always)]
    fn new(y: T) -> Self {
        let (one, square) = (y.all(1.0), y * y);
        let over = (one + square).inverse();
        let g = y * over;
        Self {
            f: y * g,
            g,
            c: (one - square) * over,
        }
    }
}

/// A section, sigma from the clamp.
struct Section<T = f64> {
    sigma: T,
    bend: Bend<T>,
    /// rho = -d ln y/d ln lam, and what d rho/d ln lam is beyond rho.
    rho: T,
    rise: T,
}

impl TautInertia {
    /// The rod at the chart point (p, w); None if it is not taut.
    #[must_use]
    pub fn new(p: f64, w: f64) -> Option<Self> {
        Self::at_load(p, Integrals::new(p, w).lam)
    }

    /// The rod of modulus p under the pull lam; None if it is not taut, or its bend a loop that has left the clamp.
    #[must_use]
    pub fn at_load(p: f64, lam: f64) -> Option<Self> {
        // lam = |p| + ln(2 T).
        let ln_t = lam - p.abs() - LN_2;
        let taut = lam > TAUT && ln_t < LOOPED.min(0.5 * (lam - TAUT));
        let t = ln_t.exp().copysign(p);
        taut.then(|| Self {
            lam,
            t,
            ln_t,
            clamp: Bend::new(t),
            error: EXACT,
        })
    }

    /// The same with integrals along the rod that may be off by a part `error` of their size, between 1e-12 and 1e-4.
    #[must_use]
    pub fn to_part(self, error: f64) -> Self {
        let error = error.clamp(EXACT, ROUGH);
        Self { error, ..self }
    }

    /// |T|.
    pub(super) fn bend(&self) -> f64 {
        self.t.abs()
    }

    /// [`RodInertia::added`](super::RodInertia::added).
    pub fn added(&self, v: &Vector2<f64>, gravity: &Vector2<f64>) -> Option<Added> {
        lanes::wide(Adding {
            rod: self,
            v,
            gravity,
        })
    }

    #[inline(always)]
    fn moving(&self, v: &Vector2<f64>) -> Option<Moving> {
        let end = self.end();
        let field = self.field(&end);
        let [_, by_t, by_l] = field;
        let inverse = Matrix2::new(by_t[0], by_l[0], by_t[1], by_l[1]).try_inverse()?;
        // cos gam and sin gam, gam = 4 atan T.
        let Bend { g, c, .. } = self.clamp;
        let (cos, sin) = (c * c - 4.0 * g * g, 4.0 * g * c);
        let turn = Matrix2::new(cos, -sin, sin, cos);
        let rate = inverse * turn.tr_mul(v) * self.lam;
        Some(Moving {
            lam: self.lam,
            turn,
            inverse,
            rate,
            end: self.second(&end, &field, &rate).into(),
            spin: 0.0,
        })
    }

    /// Nodes along the rod, and their weights: a bend is as wide as its poles are away.
    #[inline(always)]
    fn nodes(&self) -> [&'static [f64]; 2] {
        let (least, draw) = rule_of_bend(self.lam * FRAC_2_PI, self.ln_t * FRAC_2_PI, self.error);
        nodes(least, draw)
    }

    /// The section with `part` > 0 of the rod beyond it.
    #[inline(always)]
    fn section<S: Simd>(&self, part: Lanes<S>) -> Section<Lanes<S>> {
        let u = part * self.lam;
        let sigma = u.all(self.lam) - u;
        let (near, back) = (sigma.faded(), (u * 2.0).faded());
        let one = u.all(1.0);
        let (sinh, cosh) = (one - back, one + back);
        let per = u * sinh.inverse();
        Section {
            sigma,
            bend: Bend::new(near * sinh * self.t),
            rho: u.all(self.lam) - per * cosh,
            rise: back * per * per * 4.0,
        }
    }

    #[inline(always)]
    fn end(&self) -> Section {
        Section {
            sigma: self.lam,
            bend: Bend::new(0.0),
            rho: self.lam - 1.0,
            rise: 1.0,
        }
    }

    /// lam times the place, and its derivatives by ln T and ln lam.
    #[inline(always)]
    fn field<T: Real>(&self, at: &Section<T>) -> Field<T> {
        let (clamp, Bend { f, g, c }) = (&self.clamp, at.bend);
        let (more, across) = (f.all(clamp.f) - f, g.all(clamp.g) - g);
        [
            [at.sigma - more * 4.0, across * -4.0],
            [
                across * across * 8.0,
                ((at.sigma - more * 2.0) * clamp.g - across * c) * 4.0,
            ],
            [
                (more - at.rho * g * g * 2.0) * 4.0,
                (across - at.rho * g * c) * 4.0,
            ],
        ]
    }

    /// lam times the second derivative of the place in time, while ln T and ln lam change at constant rates.
    #[inline(always)]
    fn second<T: Real>(
        &self,
        at: &Section<T>,
        [_, by_t, by_l]: &Field<T>,
        rate: &Vector2<f64>,
    ) -> [T; 2] {
        let (clamp, Bend { f, g, c }) = (&self.clamp, at.bend);
        let (rho, g2) = (at.rho, g * g);
        let (more, across) = (f.all(clamp.f) - f, g.all(clamp.g) - g);
        let steady = clamp.g * clamp.c;
        let slope = g.all(steady) - g * c;
        // The axes turn by gam_lnT = 4 G.
        let turn = 4.0 * clamp.g;
        let tt = [
            across * slope * 16.0 - by_t[1] * turn,
            ((at.sigma - more * 2.0) * steady - slope * c + g2 * across * 4.0) * 4.0
                + (by_t[0] - (g.all(clamp.g) + g) * across * 4.0) * turn,
        ];
        let bent = c * c - g2 * 4.0;
        let tl = [
            across * (rho * g * c * 2.0 - across) * 8.0,
            (across * c + more * (2.0 * clamp.g) - rho * g * (bent + g * (8.0 * clamp.g))) * 4.0,
        ];
        let rho2 = rho * rho;
        let ll = [
            g2 * (rho2 * c * 2.0 - at.rise) * 8.0,
            g * (rho2 * bent - at.rise * c) * 4.0,
        ];
        let [t, l] = (*rate).into();
        std::array::from_fn(|k| {
            tt[k] * (t * t) + tl[k] * (2.0 * t * l) + (ll[k] - by_l[k]) * (l * l)
        })
    }
}

impl OnEquilibria for TautInertia {
    fn added(&self, v: &Vector2<f64>, gravity: &Vector2<f64>) -> Option<Added> {
        self.added(v, gravity)
    }

    fn carried(
        &self,
        v: &Vector2<f64>,
        gravity: &Vector2<f64>,
        frame: &Frame<2>,
    ) -> Option<CarriedRod> {
        let moving = self.moving(v)?;
        let [places, weights] = self.nodes();
        let sections = Sections {
            rod: self,
            each: &Moved,
            rate: &moving.rate,
        };
        moving.carried(lanes::sums(&sections, places, weights), v, gravity, frame)
    }
}

/// [`TautInertia::added`], all of it compiled for wide registers.
struct Adding<'a> {
    rod: &'a TautInertia,
    v: &'a Vector2<f64>,
    gravity: &'a Vector2<f64>,
}

impl WithSimd for Adding<'_> {
    type Output = Option<Added>;

    #[inline(always)]
    fn with_simd<S: Simd>(self, simd: S) -> Option<Added> {
        let moving = self.rod.moving(self.v)?;
        let [places, weights] = self.rod.nodes();
        let sections = Sections {
            rod: self.rod,
            each: &Heavy,
            rate: &moving.rate,
        };
        moving.added(
            lanes::sums_in(simd, &sections, places, weights),
            self.gravity,
        )
    }
}

/// What is summed along a rod.
trait Asked<const K: usize> {
    fn of<T: Real>(&self, field: &Field<T>, second: &[T; 2]) -> [T; K];
}

struct Heavy;

impl Asked<12> for Heavy {
    #[inline(always)]
    fn of<T: Real>(&self, field: &Field<T>, second: &[T; 2]) -> [T; 12] {
        heavy(field, second)
    }
}

struct Moved;

impl Asked<20> for Moved {
    #[inline(always)]
    fn of<T: Real>(&self, field: &Field<T>, second: &[T; 2]) -> [T; 20] {
        carried(field, second)
    }
}

struct Sections<'a, E> {
    rod: &'a TautInertia,
    each: &'a E,
    rate: &'a Vector2<f64>,
}

impl<E: Asked<K>, const K: usize> InLanes<K> for Sections<'_, E> {
    #[inline(always)]
    fn at<S: Simd>(&self, part: Lanes<S>) -> [Lanes<S>; K] {
        let here = self.rod.section(part);
        let field = self.rod.field(&here);
        self.each
            .of(&field, &self.rod.second(&here, &field, self.rate))
    }
}
