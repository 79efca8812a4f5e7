//! The pendulum of the rod at many places of one rod: theta functions, whose coefficients are the modulus' alone.
//!
//! With the nome q of the modulus, or of the complementary one if that is smaller, q <= exp(-pi) = 0.0432: four terms of each series are
//! exact to rounding. (s, c, d, b) are those of `Integrals` at u; in x = sin^2 v, v = pi u/(2K), or x = -sinh^2 v, v = pi u/(2K'), they are polynomials:
//!
//! ```text
//! (s, c, d) = (P1 sin v, P2 cos v, P4)/P3,  or, by Jacobi's imaginary transformation,  (P1 sinh v, P4, P2 cosh v)/P3
//! b = linear u + factor (log P3)'
//! ```

use super::chart::{Integrals, Modulus};
use super::curvature::Swing;
use std::ops::{Add, Mul, Sub};
use wide::f64x2;

/// Numbers at two places, which are worked on at once.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) struct Two(f64x2);

/// What formulas of the pendulum are made of.
pub(super) trait Real:
    Copy + Add<Output = Self> + Sub<Output = Self> + Mul<Output = Self> + Mul<f64, Output = Self>
{
    fn both(x: f64) -> Self;
    fn inverse(self) -> Self;
}

impl Real for f64 {
    fn both(x: f64) -> Self {
        x
    }

    fn inverse(self) -> Self {
        1.0 / self
    }
}

impl Real for Two {
    #[inline(always)]
    fn both(x: f64) -> Self {
        Self(f64x2::splat(x))
    }

    #[inline(always)]
    fn inverse(self) -> Self {
        Self(f64x2::splat(1.0) / self.0)
    }
}

impl Two {
    #[inline(always)]
    fn of(values: [f64; 2]) -> Self {
        Self(f64x2::new(values))
    }

    #[inline(always)]
    pub fn first(self) -> f64 {
        self.0.to_array()[0]
    }

    #[inline(always)]
    pub fn sum(self) -> f64 {
        self.0.reduce_add()
    }
}

impl Add for Two {
    type Output = Self;
    #[inline(always)]
    fn add(self, other: Self) -> Self {
        Self(self.0 + other.0)
    }
}

impl Sub for Two {
    type Output = Self;
    #[inline(always)]
    fn sub(self, other: Self) -> Self {
        Self(self.0 - other.0)
    }
}

impl Mul for Two {
    type Output = Self;
    #[inline(always)]
    fn mul(self, other: Self) -> Self {
        Self(self.0 * other.0)
    }
}

impl Mul<f64> for Two {
    type Output = Self;
    #[inline(always)]
    fn mul(self, factor: f64) -> Self {
        Self(self.0 * f64x2::splat(factor))
    }
}

/// Two places of a rod, as [`Integrals`](super::chart::Integrals) has them at u = lam part.
#[derive(Debug, Clone, Copy)]
pub(super) struct Places {
    /// The parts of the rod beyond them.
    pub part: Two,
    pub u: Two,
    pub s: Two,
    pub c: Two,
    pub d: Two,
    pub b: Two,
}

impl Places {
    /// The pendulum there.
    #[inline(always)]
    pub fn swing(&self, modulus: &Modulus) -> Swing<Two> {
        Swing::at(modulus, self.u, [self.s, self.c, self.d, self.b])
    }
}

/// A rod of one modulus and one load.
#[derive(Debug, Clone, Copy)]
pub(super) struct Along {
    lam: f64,
    /// True where v is real: the nome is that of the modulus.
    real: bool,
    /// dv/du, and the nome.
    pace: f64,
    nome: f64,
    /// (sin v, cos v) in the middle of the rod, or (e^v, e^-v).
    middle: [f64; 2],
    /// P1 .. P4 and P3'/(sin v cos v), with the factors that s, c, d and b have.
    p1: [f64; 4],
    p2: [f64; 4],
    p3: [f64; 4],
    p4: [f64; 4],
    slope: [f64; 3],
    /// b = linear u + slope.
    linear: f64,
    /// What b gains, beyond that, in a period 2K.
    turns: f64,
}

impl Along {
    /// Of the rod with this modulus and 0 < lam.
    pub fn new(modulus: &Modulus, lam: f64) -> Self {
        let (k, kc) = (modulus.kap.abs(), modulus.kap_c);
        let real = kc > k;
        // The nome from the smaller of both moduli and the larger one.
        let (small, large) = if real { (k, kc) } else { (kc, k) };
        let root = 1.0 + large.sqrt();
        // Of its square: the nome over that is regular.
        let per = 0.5 / ((1.0 + large) * (root * root));
        let e = per * small * small;
        let e4 = (e * e) * (e * e);
        let scale = per * (1.0 + e4 * (2.0 + e4 * (15.0 + e4 * 150.0)));
        let q = scale * small * small;
        let q2 = q * q;
        let (q4, q6) = (q2 * q2, q2 * q2 * q2);
        let (q8, q9, q12) = (q4 * q4, q4 * q4 * q, q6 * q6);
        let theta3 = 1.0 + 2.0 * (q + q4 + q9);
        let theta4 = 1.0 - 2.0 * (q - q4 + q9);
        let theta2 = 1.0 + q2 + q6 + q12;
        let pace = 1.0 / (theta3 * theta3);
        let k2 = k * k;
        // (log P3)' = 2 q (..) in both; the nome of a weakly bent rod drops out against kap^2.
        let (by_s, by_c, by_d, by_b, linear) = if real {
            let linear = pace * pace * 8.0 * scale * (1.0 + 4.0 * q * q2 + 9.0 * q8) / theta3;
            (
                theta4 / theta2,
                theta3 / theta2,
                kc.sqrt(),
                -pace * scale,
                linear,
            )
        } else {
            let left = pace * pace * q * (8.0 - 32.0 * q * q2 + 72.0 * q8) / theta4;
            let linear = (left - kc * kc) / k2;
            let by_s = kc * theta3 * theta3 / (theta2 * theta4);
            (
                by_s,
                theta3 / theta4,
                kc * theta3 / theta2,
                pace * q / k2,
                linear,
            )
        };
        let (by_2, by_4) = if real { (by_c, by_d) } else { (by_d, by_c) };
        let half = 0.5 * lam * pace;
        Self {
            lam,
            real,
            pace,
            nome: q,
            middle: if real {
                let (sin, cos) = half.sin_cos();
                [sin, cos]
            } else {
                let e = half.exp();
                [e, 1.0 / e]
            },
            p1: [
                1.0 - 3.0 * q2 + 5.0 * q6 - 7.0 * q12,
                4.0 * q2 - 20.0 * q6 + 56.0 * q12,
                16.0 * q6 - 112.0 * q12,
                64.0 * q12,
            ]
            .map(|x| x * by_s),
            p2: [
                theta2,
                -4.0 * q2 - 12.0 * q6 - 24.0 * q12,
                16.0 * q6 + 80.0 * q12,
                -64.0 * q12,
            ]
            .map(|x| x * by_2),
            p3: [
                theta3,
                -4.0 * q - 16.0 * q4 - 36.0 * q9,
                16.0 * q4 + 96.0 * q9,
                -64.0 * q9,
            ],
            p4: [
                theta4,
                4.0 * q - 16.0 * q4 + 36.0 * q9,
                16.0 * q4 - 96.0 * q9,
                64.0 * q9,
            ]
            .map(|x| x * by_4),
            slope: [
                8.0 + 32.0 * q * q2 + 72.0 * q8,
                -64.0 * q * q2 - 384.0 * q8,
                384.0 * q8,
            ]
            .map(|x| x * by_b),
            linear,
            turns: if real { 0.0 } else { 2.0 * pace / k2 },
        }
    }

    /// The nodes of a Gauss rule that integrates along this rod to a part of 1e-12. The poles of the pendulum lie K' > pi/2 and more
    /// from the rod, so that the rule of a long one needs 28/pi lam/2 nodes (Bernstein's ellipse); the base is measured.
    pub fn nodes(&self) -> usize {
        (NODES[0] + NODES[1] * self.lam).max(FEWEST) as usize
    }

    /// The chart's integrals of the whole rod, whose modulus this is.
    pub fn clamp(&self, modulus: &Modulus) -> Integrals {
        let Places { s, c, d, b, .. } = self.at(1.0);
        Integrals {
            kap: modulus.kap,
            kap_c: modulus.kap_c,
            s: s.first(),
            c: c.first(),
            d: d.first(),
            lam: self.lam,
            b: b.first(),
        }
    }

    /// At u = lam (1 +- x)/2.
    #[inline(always)]
    pub fn at(&self, x: f64) -> Places {
        let part = Two::of([0.5 + 0.5 * x, 0.5 - 0.5 * x]);
        let u = part * self.lam;
        let off = 0.5 * self.lam * self.pace * x;
        let [a, b] = self.middle;
        let mut turns = [0.0; 2];
        let mut sign = [1.0; 2];
        let (sin, cos, square) = if self.real {
            let (s, c) = off.sin_cos();
            let sin = Two::of([a * c + b * s, a * c - b * s]);
            let cos = Two::of([b * c - a * s, b * c + a * s]);
            (sin, cos, sin * sin)
        } else {
            let e = off.exp();
            let inverse = 1.0 / e;
            let mut up = [a * e, a * inverse];
            let mut down = [b * inverse, b * e];
            for i in 0..2 {
                // Whole periods 2K are taken off, exp(-2K dv/du) = q.
                while up[i] * up[i] * self.nome > 1.0 {
                    up[i] *= self.nome;
                    down[i] = 1.0 / up[i];
                    turns[i] += 1.0;
                    sign[i] = -sign[i];
                }
            }
            let (up, down) = (Two::of(up), Two::of(down));
            let (sinh, cosh) = ((up - down) * 0.5, (up + down) * 0.5);
            (sinh, cosh, sinh * sinh * -1.0)
        };
        let two = |p: &[f64; 3]| (square * p[2] + Two::both(p[1])) * square + Two::both(p[0]);
        let three = |p: &[f64; 4]| {
            ((square * p[3] + Two::both(p[2])) * square + Two::both(p[1])) * square
                + Two::both(p[0])
        };
        let sign = Two::of(sign);
        let over = three(&self.p3).inverse();
        let (p2, p4) = (cos * three(&self.p2) * over, three(&self.p4) * over);
        let (c, d) = if self.real { (p2, p4) } else { (p4, p2) };
        Places {
            part,
            u,
            s: sin * three(&self.p1) * over * sign,
            c: c * sign,
            d,
            b: u * self.linear + sin * cos * two(&self.slope) * over + Two::of(turns) * self.turns,
        }
    }
}

/// Nodes: a base, and more as the rod is pulled harder.
const NODES: [f64; 2] = [4.0, 4.8];
const FEWEST: f64 = 8.0;

#[cfg(test)]
mod tests {
    use super::*;

    /// Catches a wrong coefficient, nome or period: Carlson's integrals and Jacobi's functions by the ladder are another way to the same.
    #[test]
    fn places_are_those_of_the_chart() {
        for p in [1e-3, -0.3, 0.88, -0.8815, 1.6, -3.2, 6.0, 12.0] {
            for lam in [0.1, 1.4, 4.6, 9.0, 29.0] {
                let modulus = Modulus::new(p);
                let along = Along::new(&modulus, lam);
                for x in [0.03, 0.41, 0.77, 0.999] {
                    let found = along.at(x);
                    let parts = found.part.0.to_array();
                    for (k, part) in parts.into_iter().enumerate() {
                        assert!((part - 0.5 - [0.5, -0.5][k] * x).abs() < 1e-15);
                        let at = Integrals::at_load(p, lam * part).unwrap();
                        let both = [
                            (found.s, at.s),
                            (found.c, at.c),
                            (found.d, at.d),
                            (found.b, at.b),
                        ];
                        for (found, expected) in both {
                            let error = (found.0.to_array()[k] - expected).abs();
                            assert!(
                                error < 2e-14 * (1.0 + at.lam),
                                "p {p} lam {lam} x {x}: {error:e}"
                            );
                        }
                    }
                }
            }
        }
    }
}
