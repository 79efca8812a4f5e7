//! Enclosures of the pendulum over a box of the chart, in intervals.

use super::super::BoxCoordinate;
use super::{I, at};
use crate::elastica::chart::{Integrals, amplitude};
use std::f64::consts::PI;

/// RF and RD of the same arguments, z the last of RD, by duplication (DLMF 19.26.18, 19.26.20) until all three are
/// close. Both decrease in every argument and are powers of the common value of equal arguments.
fn ladder(mut x: I, mut y: I, mut z: I) -> [I; 2] {
    let (mut sum, mut power) = (I::ZERO, 1.0);
    for _ in 0..60 {
        let (least, most) = (x.lo.min(y.lo).min(z.lo), x.hi.max(y.hi).max(z.hi));
        if most - least < 1e-15 * least {
            break;
        }
        let [rx, ry, rz] = [x, y, z].map(I::sqrt);
        let lambda = rx * (ry + rz) + ry * rz;
        sum = sum + at(power) / (rz * (z + lambda));
        power *= 0.25;
        [x, y, z] = [x, y, z].map(|v| (v + lambda) * at(0.25));
    }
    let mean = x.hull(y).hull(z);
    let f = I::ONE / mean.sqrt();
    [f, at(3.0) * sum + at(power) * f / mean]
}

/// lam, B and D up to the amplitude (s, c), at most a quarter turn (theory 2.2).
fn quarter_turn(s: I, c: I, [kap, kc]: [I; 2]) -> [I; 3] {
    let tau = s / kc;
    let stretch = I::ONE + (kap * tau).square();
    let [f, d] = ladder(c.square(), stretch, I::ONE);
    [
        tau * f,
        kc.square() * tau * tau.square() * d / at(3.0),
        kc * stretch.sqrt(),
    ]
}

/// kap = tanh p and kap' = sech p.
fn modulus(p: f64) -> [I; 2] {
    let e = at(-p).exp();
    let e2 = e.square();
    let scale = I::ONE / (I::ONE + e2);
    [(I::ONE - e2) * scale, at(2.0) * e * scale]
}

/// Enclosure of kap/p, which falls with p; near p = 0 it lies between the partial sums of 1 - p^2/3 + 2 p^4/15 - ...
fn modulus_over_p(p: f64) -> I {
    if p > 0.03 {
        return modulus(p)[0] / at(p);
    }
    let p2 = at(p).square();
    let low = I::ONE - p2 / at(3.0);
    low.hull(low + at(2.0) * p2.square() / at(15.0))
}

/// Box of the chart.
#[derive(Debug, Clone, Copy)]
pub(super) struct Place {
    pub p: [f64; 2],
    pub u: [f64; 2],
}

/// Enclosure of the pendulum over a box.
pub(super) struct Enclosure {
    pub u: I,
    /// Fields in the order of `Pendulum`: p, kap, kap', t, 1/t, s, c, D, B.
    pub values: [I; 9],
    /// Quarter period K.
    pub quarter: I,
}

/// Enclosures of s, c, D, B at a point, and of K. The amplitude is the library's; the difference of its load from u,
/// by interval arithmetic, is a shift along u.
pub(super) fn at_point(p: f64, u: f64) -> ([I; 4], I) {
    let [kap, kc] = modulus(p);
    let [quarter, b_quarter, _] = quarter_turn(I::ONE, I::ZERO, [kap, kc]);
    let guess = Integrals::at_load(p, u).unwrap();
    let half_turns = (amplitude(p, u).unwrap() / PI).round();
    let parity = if half_turns % 2.0 == 0.0 { 1.0 } else { -1.0 };
    let side = 1f64.copysign(guess.s * parity);
    let (s, c) = if guess.s.abs() < 0.7 {
        let s = at(guess.s.abs());
        (s, (I::ONE - s.square()).sqrt())
    } else {
        let c = at(guess.c.abs());
        ((I::ONE - c.square()).sqrt(), c)
    };
    let [lam, b, d] = quarter_turn(s, c, [kap, kc]);
    let turns = at(2.0 * half_turns);
    let whole = |full: I, rest: I| turns * full + at(side) * rest;
    let off = (at(u) - whole(quarter, lam)).size();
    // |ds/du|, |dc/du| and |dD/du| are at most D, which changes at most exponentially.
    assert!(off < 1e-9, "{p} {u}: {off}");
    let shift = I::about_zero(off * d.hi * 1.01);
    let values = [
        at(side * parity) * s + shift,
        at(parity) * c + shift,
        d + shift,
        whole(b_quarter, b) + I::about_zero(off),
    ];
    (values, quarter)
}

impl Enclosure {
    pub fn new(kind: BoxCoordinate, place: &Place) -> Self {
        let [low, high] = place.p;
        let u = I::new(place.u[0], place.u[1]);
        let (p0, u0) = (0.5 * (low + high), 0.5 * (u.lo + u.hi));
        let ([s0, c0, d0, b0], quarter) = at_point(p0, u0);
        let p = I::new(low, high);
        let (dp, du) = (p - at(p0), u - at(u0));
        // dK/dp = kap B(K) < 1.
        let quarter = quarter + dp;
        let ([kap_low, kc_high], [kap_high, kc_low]) = (modulus(low), modulus(high));
        let (kap, kc) = (kap_low.hull(kap_high), kc_low.hull(kc_high));
        let t = match kind {
            BoxCoordinate::Linear => kap,
            BoxCoordinate::Log => modulus_over_p(low).hull(modulus_over_p(high)),
        };
        // Every quarter turn adds at most 1 to B, and B < u. The rates of s and D are at most (1 + B) times the
        // larger of both along p, and 1 times it along u.
        let b_most = u.hi.min((u.hi / quarter.lo).ceil());
        let rate = dp.size() * (1.0 + b_most) + du.size();
        let change = s0.size().max(d0.hi) * (rate.exp() - 1.0) * 1.01;
        let around = |v: I| v + I::about_zero(change);
        let unit = I::about_zero(1.0);
        let (mut s, mut c) = (around(s0).meet(unit), around(c0).meet(unit));
        let mut d = around(d0).meet(I::new(0.0, 1.0));
        let mut b = I::new(0.0, b_most);
        let slow = kap.hi * 0.51 * (u.hi * u.hi + u.hi);
        for _ in 0..5 {
            let n = d * b + s * c;
            let m = kap * n;
            let f = c * d + kap.square() * (s * b);
            let by_p = (kc.square() * (u - b) - d * n) / kap;
            // kap B_p = -2 kap int s c m du, |m| < kap (B + 1/2).
            let by_p = by_p.meet(I::about_zero(slow));
            let next = [
                s0 - c * m * dp + c * d * du,
                c0 + s * m * dp - s * d * du,
                d0 - kap * c * f * dp + kap.square() * s * c * du,
                b0 + by_p * dp + s.square() * du,
            ];
            s = s.meet(next[0]);
            c = c.meet(next[1]);
            d = d.meet(next[2]);
            b = b.meet(next[3]);
        }
        Self {
            u,
            values: [p, kap, kc, t, I::ONE / t, s, c, d, b],
            quarter,
        }
    }
}
