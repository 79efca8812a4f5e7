//! Pendulum of the rod at many sections of one rod, by theta functions whose coefficients depend on the modulus
//! alone.
//!
//! (s, c, d, b) are those of `Integrals` at u. Let v = pi u/(2K) with the nome of the modulus, or v = pi u/(2K') with
//! the complementary nome, and let P1 .. P4 be the parts of the theta functions as in [`Nome`]. Up to factors:
//!
//! ```text
//! (s, c, d) = (P1 sin v, P2 cos v, P4)/P3,  or, by Jacobi's imaginary transformation,  (P1 sinh v, P4, P2 cosh v)/P3
//! b = linear u + factor (log P3)'
//! ```

use super::chart::{Integrals, Modulus};
use super::curvature::Swing;
use super::simd_sums::Lanes;
use crate::math::real::Real;
use crate::math::theta::Nome;
use pulp::Simd;
use std::f64::consts::{FRAC_2_PI, LN_2, PI};

/// One or several sections of a rod: [`Integrals`](super::chart::Integrals) at u = lam part.
#[derive(Debug, Clone, Copy)]
pub(super) struct SectionIntegrals<T> {
    pub u: T,
    pub s: T,
    pub c: T,
    pub d: T,
    pub b: T,
}

impl<T: Real> SectionIntegrals<T> {
    /// Pendulum at the section.
    #[inline(always)]
    pub fn swing(&self, modulus: &Modulus) -> Swing<T> {
        Swing::at(modulus, self.u, [self.s, self.c, self.d, self.b])
    }
}

/// Theta functions of a rod of one modulus and one load.
#[derive(Debug, Clone, Copy)]
pub(super) struct RodTheta {
    lam: f64,
    /// True if v is real: the nome is that of the modulus.
    real: bool,
    /// dv/du.
    pace: f64,
    nome: Nome,
    /// Value of v at the clamp.
    whole: f64,
    /// Half turn of the pendulum in v; `None` unless the rod reaches about half of one.
    half_turn: Option<f64>,
    /// Factors of s, c, d, and of P3'/(sin v cos v) in b.
    by_s: f64,
    by_c: f64,
    by_d: f64,
    by_b: f64,
    /// Slope in b = linear u + periodic part.
    linear: f64,
    /// Growth of b in a period 2K beyond the linear part.
    turns: f64,
}

impl RodTheta {
    /// Coefficients of the rod with this modulus and lam > 0.
    #[inline(always)]
    pub fn new(modulus: &Modulus, lam: f64) -> Self {
        let (k, kc) = (modulus.kap.abs(), modulus.kap_c);
        let real = kc > k;
        let (small, large) = if real { (k, kc) } else { (kc, k) };
        let nome = Nome::new(small * small, large);
        let Nome {
            q,
            over_square,
            theta2,
            theta3,
            theta4,
            pace,
            ..
        } = nome;
        let q3 = q * q * q;
        let q8 = q3 * q3 * (q * q);
        let (over2, over3) = (1.0 / theta2, 1.0 / theta3);
        // (log P3)' = 2 q (..) for both nomes; the division by kap^2 cancels the small nome of a weakly bent rod.
        let (by_s, by_c, by_d, by_b, linear) = if real {
            let linear = pace * pace * 8.0 * over_square * (1.0 + 4.0 * q3 + 9.0 * q8) * over3;
            (
                theta4 * over2,
                theta3 * over2,
                kc.sqrt(),
                -pace * over_square,
                linear,
            )
        } else {
            let (over4, over_k2) = (1.0 / theta4, 1.0 / (k * k));
            let left = pace * pace * q * (8.0 - 32.0 * q3 + 72.0 * q8) * over4;
            (
                kc * theta3 * theta3 * over2 * over4,
                theta3 * over4,
                kc * theta3 * over2,
                pace * q * over_k2,
                (left - kc * kc) * over_k2,
            )
        };
        let whole = lam * pace;
        let half_turn = if real {
            (2.0 * whole > PI).then_some(PI)
        } else {
            (2.0 * whole > -rough_log(q) - ROUGHLY).then(|| -q.ln())
        };
        Self {
            lam,
            real,
            pace,
            nome,
            whole,
            half_turn,
            by_s,
            by_c,
            by_d,
            by_b: 8.0 * by_b,
            linear,
            turns: if real { 0.0 } else { 2.0 * pace / (k * k) },
        }
    }

    /// Gauss rule that integrates along this rod to the relative error `error`: number of nodes, and grading towards
    /// the clamp ([`graded_node`]).
    ///
    /// The poles of the pendulum lie at odd multiples of K, at the distance K' from the rod. The error falls like
    /// rho^-2n, with rho the sum of the axes of Bernstein's ellipse through the nearest pole. A pole beyond the clamp
    /// counts as next to it, since the pendulum grows on the way there. The factor before the power is measured; for
    /// graded nodes the whole law is.
    #[inline(always)]
    pub fn rule(&self, error: f64) -> (f64, usize) {
        let quarter = 0.5 * PI / self.pace;
        // Ratio K'/K = log(1/q)/pi, or K/K' for the complementary nome.
        let other = quarter * rough_log(self.nome.q) * (-1.0 / PI);
        let (k, away) = if self.real {
            (quarter, other.min(FARTHEST * quarter))
        } else {
            (other, quarter)
        };
        let digits = binary_digits(error);
        if self.lam > NARROW * away && self.lam < k + MAX_BEYOND_QUARTER * away {
            let (range, draw) = grading_for_length(self.lam / away);
            return (DRAWN[0] + DRAWN[1] * range + DRAWN[2] * digits, draw);
        }
        let per = 2.0 / self.lam;
        let slowness = inverse_log_ellipse_sum((k * per - 1.0).min(1.0), away * per);
        let nodes = (NODES + 0.5 * LN_2 * digits) * slowness;
        (nodes.max(FEWEST[0] + FEWEST[1] * digits), 0)
    }

    /// Integrals of the whole rod, of the modulus of `self`.
    #[inline(always)]
    pub fn clamp(&self, modulus: &Modulus) -> Integrals {
        let SectionIntegrals { s, c, d, b, .. } = self.place_at(1.0);
        Integrals {
            kap: modulus.kap,
            kap_c: modulus.kap_c,
            s,
            c,
            d,
            lam: self.lam,
            b,
        }
    }

    /// v reduced by the nearest multiple of half turns; the number of half turns, and their sign in s and c.
    #[inline(always)]
    fn reduce_half_turns<T: Real>(&self, v: T) -> (T, Option<[T; 2]>) {
        let Some(half_turn) = self.half_turn else {
            return (v, None);
        };
        let turns = (v * (1.0 / half_turn)).nearest();
        let odd = T::weighted_sum([1.0, -2.0], [turns, (turns * 0.5).nearest()]);
        let sign = v.all(1.0) - odd * odd * 2.0;
        (
            T::weighted_sum([1.0, -half_turn], [v, turns]),
            Some([turns, sign]),
        )
    }

    /// One section, at u = lam part.
    #[inline(always)]
    pub fn place_at(&self, part: f64) -> SectionIntegrals<f64> {
        let (v, wound) = self.reduce_half_turns(part * self.whole);
        let (sin, cos) = if self.real {
            v.sin_cos()
        } else {
            (v.sinh(), v.cosh())
        };
        self.place(part, sin, cos, wound)
    }

    /// Sections in lanes, at u = lam part.
    #[inline(always)]
    pub fn at<S: Simd>(&self, part: Lanes<S>) -> SectionIntegrals<Lanes<S>> {
        let (v, wound) = self.reduce_half_turns(part * self.whole);
        let (sin, cos) = if self.real {
            v.sin_cos()
        } else {
            v.sinh_cosh()
        };
        self.place(part, sin, cos, wound)
    }

    /// Section with the fraction `part` of the rod beyond it, from (sin v, cos v) or (sinh v, cosh v). `wound`: half
    /// turns taken off v, and their sign in s and c.
    #[inline(always)]
    fn place<T: Real>(
        &self,
        part: T,
        sin: T,
        cos: T,
        wound: Option<[T; 2]>,
    ) -> SectionIntegrals<T> {
        // Either 2 q cos 2v or 2 q cosh 2v.
        let twice = 2.0 * self.nome.q;
        let bent = if self.real { -2.0 } else { 2.0 } * twice;
        let z = (sin * sin).times_plus(sin.all(bent), sin.all(twice));
        let [p1, p2, p3, p4] = self.nome.parts(z);
        let over = p3.inverse();
        let (p1, p2) = (sin * p1, cos * p2);
        let (c, d) = if self.real { (p2, p4) } else { (p4, p2) };
        let u = part * self.lam;
        let slope = sin * cos * (self.nome.slope(z) * over);
        let mut place = SectionIntegrals {
            u,
            s: p1 * (over * self.by_s),
            c: c * (over * self.by_c),
            d: d * (over * self.by_d),
            b: T::weighted_sum([self.linear, self.by_b], [u, slope]),
        };
        if let Some([turns, sign]) = wound {
            place.s = place.s * sign;
            place.c = place.c * sign;
            place.b = turns.times_plus(turns.all(self.turns), place.b);
        }
        place
    }
}

/// Distance lam s from the clamp beyond which a taut rod of bend T (`TautInertia`) is straight to the relative error
/// `error`.
#[inline(always)]
pub(super) fn reach_of_bend(ln_t: f64, error: f64) -> f64 {
    BEND_REACH[0] + BEND_REACH[1] * binary_digits(error) + ln_t.max(0.0)
}

/// Gauss rule to the relative error `error` up to lam s = `reach`, where the rod becomes straight or ends: number of
/// nodes, and grading towards the clamp. Bends beyond T = 1 lie inside the rod, where graded nodes are sparser.
#[inline(always)]
pub(super) fn rule_of_bend(reach: f64, ln_t: f64, error: f64) -> (f64, usize) {
    let (_, draw) = grading_for_length(reach * FRAC_2_PI);
    let at_clamp = BEND_NODES[0] + BEND_NODES[1] * binary_digits(error);
    (
        at_clamp * (INNER_BEND_FACTOR[0] + INNER_BEND_FACTOR[1] * ln_t).max(1.0),
        draw,
    )
}

/// Range and number of the grading for a rod as long as `widths` widths of its bend.
#[inline(always)]
fn grading_for_length(widths: f64) -> (f64, usize) {
    let most = (DRAWS - 1) as f64;
    let draw = (rough_log(2.0 * widths) / DRAW + 0.5).clamp(1.0, most) as usize;
    (DRAW * draw as f64, draw)
}

/// Position, as a fraction of the rod from the tip, of the node `x` of a rule on [0, 1], and its derivative. The map
/// 1 - sinh(range (1 - x))/sinh(range) grades nodes towards the narrow bend at the clamp of a rod under strong pull.
/// In x the poles are then a quarter turn away from the bend, however narrow it is. `draw` = 0 is the identity.
pub(super) fn graded_node(draw: usize, x: f64) -> [f64; 2] {
    if draw == 0 {
        return [x, 1.0];
    }
    let range = DRAW * draw as f64;
    let (at, scale) = (range * (1.0 - x), 1.0 / range.sinh());
    [1.0 - scale * at.sinh(), scale * range * at.cosh()]
}

/// Number of gradings, and the step in range between them.
pub(super) const DRAWS: usize = 48;
const DRAW: f64 = 0.25;

/// 1/log rho of Bernstein's ellipse about [-1, 1] through x + i y, approximately: sinh log rho = z, and 1/asinh
/// z = 1/z + Z[0] z/(z + Z[1]).
#[inline(always)]
fn inverse_log_ellipse_sum(x: f64, y: f64) -> f64 {
    const Z: [f64; 2] = [0.25, 0.8];
    let z = if x > 0.0 {
        let [more, less] = [1.0 + x, 1.0 - x].map(|x| (x * x + y * y).sqrt());
        let half = 0.5 * (more + less);
        (half * half - 1.0).sqrt()
    } else {
        y
    };
    1.0 / z + Z[0] * z / (z + Z[1])
}

/// -log_2 x, 0 < x < 1, rounded up.
#[inline(always)]
fn binary_digits(x: f64) -> f64 {
    1023.0 - (x.to_bits() >> 52) as f64
}

/// log x of a normal x > 0 to [`ROUGHLY`]: the significand by a straight line.
#[inline(always)]
fn rough_log(x: f64) -> f64 {
    const ONE: f64 = 4_503_599_627_370_496.0;
    (x.to_bits() as f64 / ONE - 1023.0) * LN_2
}

const ROUGHLY: f64 = 0.06;

/// Half the logarithm of the factor before rho^-2n.
const NODES: f64 = 3.0;
/// Smallest number of nodes, and its growth with every binary digit: slightly loaded rods bend by polynomials.
const FEWEST: [f64; 2] = [3.4, 0.2];
/// K'/K beyond which poles count as infinitely far.
const FARTHEST: f64 = 6.0;
/// Limits of graded rules: lam is more than NARROW K', and exceeds K by less than MAX_BEYOND_QUARTER K'. Such a rod is
/// straight but for a narrow bend at its clamp.
const NARROW: f64 = 3.5;
const MAX_BEYOND_QUARTER: f64 = 0.25;
/// Number of graded nodes: constant, and growth with the range and with every binary digit. Measured by the inertia
/// at the end for relative errors from 1e-4 to 1e-10 and lam < 30.
const DRAWN: [f64; 3] = [-1.05, 1.62, 0.4];
/// Taut rods. BEND_REACH: reach of the bend at the clamp, a constant, and its growth with every binary digit: ln 2, and
/// more for the powers of lam s that multiply the decay. BEND_NODES: number of Gauss nodes over the reach, and its
/// growth with every binary digit. INNER_BEND_FACTOR: factor of this number for a bend inside the rod, a constant, and
/// its growth with ln T. Measured for relative errors from 1e-4 to 1e-12, T from 0.001 to 18 and lam from 20 to 2000.
const BEND_REACH: [f64; 2] = [3.0, LN_2 + 0.1];
const BEND_NODES: [f64; 2] = [-1.0, 0.6];
const INNER_BEND_FACTOR: [f64; 2] = [0.5, 1.0];

#[cfg(test)]
mod tests {
    use super::super::chart::amplitude;
    use super::super::simd_sums::{InLanes, sums};
    use super::*;

    /// Catches a wrong coefficient, nome or period. Reference: Carlson's integrals, from the amplitude back to the
    /// load.
    #[test]
    fn places_are_those_of_the_chart() {
        for p in [1e-3, -0.3, 0.88, -0.8815, 1.6, -3.2, 6.0, 12.0] {
            for lam in [0.1, 1.4, 4.6, 9.0, 29.0] {
                let modulus = Modulus::new(p);
                let along = RodTheta::new(&modulus, lam);
                let places = [0.0005, 0.115, 0.295, 0.515, 0.705, 0.885, 0.9995, 1.0];
                for (k, part) in places.iter().enumerate() {
                    let at = Integrals::at_load(p, lam * part).unwrap();
                    let back = Integrals::new(p, amplitude(p, at.lam).unwrap());
                    let error = (back.lam - at.lam).abs() * at.d;
                    assert!(
                        error < 2e-14 * (1.0 + at.lam),
                        "p {p} lam {lam} part {part}: back by {error:e}"
                    );
                    let mut only = [0.0; 8];
                    only[k] = 1.0;
                    let found = sums(&Pendulum(&along), &places, &only);
                    for (found, expected) in found.iter().zip([at.s, at.c, at.d, at.b]) {
                        let error = (found - expected).abs();
                        assert!(
                            error < 2e-14 * (1.0 + at.lam),
                            "p {p} lam {lam} part {part}: {error:e}"
                        );
                    }
                }
            }
        }
    }

    struct Pendulum<'a>(&'a RodTheta);

    impl InLanes<4> for Pendulum<'_> {
        fn at<S: Simd>(&self, part: Lanes<S>) -> [Lanes<S>; 4] {
            let at = self.0.at(part);
            [at.s, at.c, at.d, at.b]
        }
    }
}
