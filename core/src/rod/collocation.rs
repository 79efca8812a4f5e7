//! The end of a uniform linear rod with its tangent, by Gauss collocation (theory Sec. 3): the initial-value problem of `line`.
//!
//! On a step of length h the slopes k_i at the eight nodes of the Gauss rule satisfy
//!
//! ```text
//! z_i = z(s) + h sum_j a_ij k_j,   k_i = f(z_i),   z(s + h) = z(s) + h sum_j b_j k_j,   a_ij = int_0^{c_i} l_j,
//! ```
//!
//! of order 16 at the end. They are swept until they stay. That is cheap here, where sections at the nodes are worked on side by side, as the
//! lanes of wide registers, and frame and centreline are swept alone. The tangent is linear in them: with R and r at the nodes
//!
//! ```text
//! phi' = M_uu tau + M_uv nu,   rho' = -[r']phi + M_vu tau + M_vv nu,   M = R C R^T,
//! tau = dm - [r]dn + [n]rho + [m]phi,   nu = dn + [n]phi,
//! ```
//!
//! is y' = A y + f, whose A and f are formed once a step instead of once a slope. Gauss methods keep quadratic invariants, such as |q|^2 = 1:
//! the directors need no division.

use super::line::{LineState, STEP_LIMIT, Wrench, directors, rate};
use super::scaled_law::ScaledLaw;
use crate::error::Result;
use crate::math::eight::{Eight, Rule, wide};
use crate::section::{Compliance, UniformLinear};
use crate::solve::cost::Cost;
use nalgebra::Matrix6;
use pulp::{Simd, WithSimd};

/// Sweeps beyond which a step is halved.
const MOST_SWEEPS: usize = 24;

/// The coefficient of P_7 in slopes that goes with the tolerance 1, fitted to what the errors of some rods are; steps of twice that are taken.
const TOP: f64 = 2.0;

/// The end of a uniform linear rod, with `K` columns of its tangent, by the components of the base wrench from `first` on; or the place
/// from which it cannot go on.
pub(super) fn end<const K: usize>(
    (law, linear): (&ScaledLaw, &UniformLinear),
    b: &Wrench,
    first: usize,
    tolerance: f64,
) -> Result<std::result::Result<(LineState<K>, Cost), f64>> {
    let rate = rate(law, b)?;
    Ok(wide(Along {
        linear,
        sense: law.sense(),
        b,
        first,
        step: (5.0 * tolerance.powf(1.0 / 16.0) / rate).min(1.0),
        // Of a function whose coefficients fall like x^k some x^16 is lost at the end of a step, where P_7 has x^7.
        goal: TOP * rate * (tolerance / rate).powf(7.0 / 16.0),
        stays: 0.02 * tolerance + 5e-16,
    }))
}

/// A rod, and how it is followed.
struct Along<'a, const K: usize> {
    linear: &'a UniformLinear,
    sense: f64,
    b: &'a Wrench,
    first: usize,
    /// The first step.
    step: f64,
    /// The coefficient of P_7 that slopes are to have.
    goal: f64,
    /// What a step may change by a sweep that is the last.
    stays: f64,
}

/// Numbers of vectors at the nodes.
type Vector<S> = [Eight<S>; 3];
type Matrix<S> = [Vector<S>; 3];

/// Frame as a quaternion, then couple and force along the directors.
const FRAME: usize = 10;

/// The sections at the nodes.
struct Sections<S: Simd> {
    /// Directors, by their number.
    d: Matrix<S>,
    m: Vector<S>,
    r: Vector<S>,
    /// r'.
    along: Vector<S>,
    /// Twice the energy per length.
    energy: Eight<S>,
}

impl<const K: usize> WithSimd for Along<'_, K> {
    type Output = std::result::Result<(LineState<K>, Cost), f64>;

    #[inline(always)]
    fn with_simd<S: Simd>(self, simd: S) -> Self::Output {
        let zero = Eight::all(simd, 0.0);
        let mut cost = Cost::default();
        let (mut s, mut energy) = (0.0, 0.0);
        let (mut q, mut r) = ([1.0, 0.0, 0.0, 0.0], [0.0; 3]);
        let mut tangent = [[0.0; 6]; K];
        let mut step = self.step;
        while 1.0 - s > 1e-14 {
            if cost.steps + cost.rejected > STEP_LIMIT {
                return Err(s);
            }
            // The rest in equal steps.
            let h = (1.0 - s) / ((1.0 - s) / step - 1e-6).ceil().max(1.0);
            let rule = Rule::new(simd, h);
            let start = self.resultants(&q, &r);
            let mut turning = [zero; FRAME];
            let mut varying = [[zero; 6]; K];
            if !self.sweep(&rule, &start, &mut turning, h, &mut cost) {
                step = 0.5 * h;
                cost.rejected += 1;
                continue;
            }
            let at = self.sections(&rule.places(&start, &turning), &r, &rule);
            let [q0, q1, q2, q3, ..] = turning;
            let mut top = rule.top(&[q0, q1, q2, q3]).max(rule.top(&at.along));
            if K > 0 && top <= 2.0 * self.goal {
                let size = largest(&tangent).max(1.0);
                let linear = self.linearised(&at);
                let stays = size * self.stays / h;
                if !linear.sweep(&rule, &tangent, &mut varying, stays, &mut cost) {
                    step = 0.5 * h;
                    cost.rejected += 1;
                    continue;
                }
                for column in &varying {
                    top = top.max(rule.top(column) / size);
                }
            }
            step = h * (0.95 * (self.goal / top).powf(1.0 / 7.0)).clamp(0.2, 2.0);
            if top > 2.0 * self.goal {
                cost.rejected += 1;
                continue;
            }
            for (z, slope) in q.iter_mut().zip(&turning) {
                *z += rule.integral(slope);
            }
            for (z, slope) in r.iter_mut().zip(&at.along) {
                *z += rule.integral(slope);
            }
            for (column, slopes) in tangent.iter_mut().zip(&varying) {
                for (y, slope) in column.iter_mut().zip(slopes) {
                    *y += rule.integral(slope);
                }
            }
            energy += 0.5 * self.sense * rule.integral(&at.energy);
            cost.steps += 1;
            s += h;
        }
        Ok((LineState::ended(q, r, energy, &tangent), cost))
    }
}

/// The largest size of an entry.
#[inline(always)]
fn largest(columns: &[[f64; 6]]) -> f64 {
    let mut size = 0.0_f64;
    for y in columns.as_flattened() {
        size = size.max(y.abs());
    }
    size
}

impl<const K: usize> Along<'_, K> {
    /// (q, R^T m, R^T n).
    #[inline(always)]
    fn resultants(&self, q: &[f64; 4], r: &[f64; 3]) -> [f64; FRAME] {
        let b = self.b;
        let m = [
            b[0] - (r[1] * b[5] - r[2] * b[4]),
            b[1] - (r[2] * b[3] - r[0] * b[5]),
            b[2] - (r[0] * b[4] - r[1] * b[3]),
        ];
        let d = directors(q);
        let mut z = [q[0], q[1], q[2], q[3], 0.0, 0.0, 0.0, 0.0, 0.0, 0.0];
        for k in 0..3 {
            z[4 + k] = d[k][0] * m[0] + d[k][1] * m[1] + d[k][2] * m[2];
            z[7 + k] = d[k][0] * b[3] + d[k][1] * b[4] + d[k][2] * b[5];
        }
        z
    }

    /// C w.
    #[inline(always)]
    fn change<S: Simd>(&self, w: &[Eight<S>; 6]) -> [Eight<S>; 6] {
        let mut change = *w;
        match &self.linear.compliance {
            Compliance::Diagonal(c) => {
                for i in 0..6 {
                    change[i] = w[i] * w[i].with(c[i]);
                }
            }
            Compliance::Full(c) => {
                for i in 0..6 {
                    let mut sum = w[0] * w[0].with(c[(i, 0)]);
                    for j in 1..6 {
                        sum = w[j].times_plus(w[j].with(c[(i, j)]), sum);
                    }
                    change[i] = sum;
                }
            }
        }
        change
    }

    /// q' = q (0, u)/2, m' = m x u + n x v, n' = n x u along the directors.
    #[inline(always)]
    fn slopes<S: Simd>(&self, z: &[Eight<S>; FRAME]) -> [Eight<S>; FRAME] {
        let [q0, q1, q2, q3, m0, m1, m2, n0, n1, n2] = *z;
        let change = self.change(&[m0, m1, m2, n0, n1, n2]);
        let mut e = change;
        for i in 0..6 {
            e[i] = change[i] + q0.with(self.linear.rest[i]);
        }
        let (u, v) = ([e[0], e[1], e[2]], [e[3], e[4], e[5]]);
        let (turned, pulled) = (cross(&[m0, m1, m2], &u), cross(&[n0, n1, n2], &v));
        let n = cross(&[n0, n1, n2], &u);
        let half = q0.with(0.5);
        let (u1, u2, u3) = (u[0] * half, u[1] * half, u[2] * half);
        let none = q0.with(0.0);
        [
            none - q3.times_plus(u3, q2.times_plus(u2, q1 * u1)),
            q2.times_plus(u3, q0 * u1) - q3 * u2,
            q3.times_plus(u1, q0 * u2) - q1 * u3,
            q1.times_plus(u2, q0 * u3) - q2 * u1,
            turned[0] + pulled[0],
            turned[1] + pulled[1],
            turned[2] + pulled[2],
            n[0],
            n[1],
            n[2],
        ]
    }

    /// Sweeps the slopes of frame and resultants until they stay.
    #[inline(always)]
    fn sweep<S: Simd>(
        &self,
        rule: &Rule<S>,
        start: &[f64; FRAME],
        slopes: &mut [Eight<S>; FRAME],
        h: f64,
        cost: &mut Cost,
    ) -> bool {
        let mut size = 1.0_f64;
        for w in &start[4..] {
            size = size.max(w.abs());
        }
        let zero = slopes[0].with(0.0);
        let stays = self.stays / h;
        for _ in 0..MOST_SWEEPS {
            let new = self.slopes(&rule.places(start, slopes));
            cost.evaluations += 8;
            let (mut turned, mut bent) = (zero, zero);
            for i in 0..FRAME {
                let moved = new[i] - slopes[i];
                if i < 4 {
                    turned = moved.times_plus(moved, turned);
                } else {
                    bent = moved.times_plus(moved, bent);
                }
            }
            *slopes = new;
            if turned.total() + bent.total() / (size * size) < stays * stays {
                return true;
            }
        }
        false
    }

    /// The sections whose frames and resultants are known, on a step from the place `r`.
    #[inline(always)]
    fn sections<S: Simd>(
        &self,
        z: &[Eight<S>; FRAME],
        r: &[f64; 3],
        rule: &Rule<S>,
    ) -> Sections<S> {
        let [w, x, y, zz, m0, m1, m2, n0, n1, n2] = *z;
        let (x2, y2, z2) = (x + x, y + y, zz + zz);
        let (wx, wy, wz) = (w * x2, w * y2, w * z2);
        let (xx, xy, xz) = (x * x2, x * y2, x * z2);
        let (yy, yz, zz) = (y * y2, y * z2, zz * z2);
        let one = w.with(1.0);
        let d = [
            [one - (yy + zz), xy + wz, xz - wy],
            [xy - wz, one - (xx + zz), yz + wx],
            [xz + wy, yz - wx, one - (xx + yy)],
        ];
        let local = [m0, m1, m2, n0, n1, n2];
        let change = self.change(&local);
        let mut energy = change[0] * local[0];
        for i in 1..6 {
            energy = change[i].times_plus(local[i], energy);
        }
        let mut v = [one; 3];
        for i in 0..3 {
            v[i] = change[3 + i] + w.with(self.linear.rest[3 + i]);
        }
        let along = turned_vector(&d, &v);
        Sections {
            m: turned_vector(&d, &[m0, m1, m2]),
            r: rule.places(r, &along),
            d,
            along,
            energy,
        }
    }

    /// A and f of y' = A y + f at the nodes.
    #[inline(always)]
    fn linearised<S: Simd>(&self, at: &Sections<S>) -> Linearised<S, K> {
        let b = self.b;
        let zero = at.energy.with(0.0);
        let n = [zero.with(b[3]), zero.with(b[4]), zero.with(b[5])];
        let none = [[zero; 3]; 3];
        let (uu, uv, vu, vv, coupled) = match &self.linear.compliance {
            Compliance::Diagonal(c) => {
                let uu = turned_diagonal(&at.d, [c[0], c[1], c[2]]);
                let vv = turned_diagonal(&at.d, [c[3], c[4], c[5]]);
                (uu, none, none, vv, false)
            }
            Compliance::Full(c) => (
                turned(&at.d, c, 0, 0),
                turned(&at.d, c, 0, 3),
                turned(&at.d, c, 3, 0),
                turned(&at.d, c, 3, 3),
                true,
            ),
        };
        let mut a = [[[zero; 6]; 3]; 2];
        let mut by = [[zero; 6]; 6];
        let zrow = [zero; 3];
        for (half, (by_m, by_n)) in [(uu, uv), (vu, vv)].into_iter().enumerate() {
            for i in 0..3 {
                // M [a] has the rows M_i x a.
                let m = cross(&by_m[i], &at.m);
                let pull = cross(&by_m[i], &n);
                let turn = if coupled || half == 1 {
                    cross(&by_n[i], &n)
                } else {
                    zrow
                };
                let lever = cross(&by_m[i], &at.r);
                for j in 0..3 {
                    a[half][i][j] = m[j] + turn[j];
                    a[half][i][3 + j] = pull[j];
                    by[j][3 * half + i] = by_m[i][j];
                    by[3 + j][3 * half + i] = by_n[i][j] - lever[j];
                }
            }
        }
        let [t1, t2, t3] = at.along;
        a[1][0][1] = a[1][0][1] + t3;
        a[1][0][2] = a[1][0][2] - t2;
        a[1][1][0] = a[1][1][0] - t3;
        a[1][1][2] = a[1][1][2] + t1;
        a[1][2][0] = a[1][2][0] + t2;
        a[1][2][1] = a[1][2][1] - t1;
        let mut f = [[zero; 6]; K];
        for (k, f) in f.iter_mut().enumerate() {
            *f = by[(self.first + k) % 6];
        }
        Linearised { a, f, coupled }
    }
}

/// y' = A y + f at the nodes.
struct Linearised<S: Simd, const K: usize> {
    /// By phi' and rho', of phi and rho.
    a: [[[Eight<S>; 6]; 3]; 2],
    f: [[Eight<S>; 6]; K],
    /// True if rho' depends on rho.
    coupled: bool,
}

impl<S: Simd, const K: usize> Linearised<S, K> {
    /// Sweeps the slopes of the tangent until they change by no more than `stays`.
    #[inline(always)]
    fn sweep(
        &self,
        rule: &Rule<S>,
        tangent: &[[f64; 6]; K],
        slopes: &mut [[Eight<S>; 6]; K],
        stays: f64,
        cost: &mut Cost,
    ) -> bool {
        let a = &self.a;
        let zero = a[0][0][0].with(0.0);
        let mut phi = [[zero; 3]; K];
        for _ in 0..MOST_SWEEPS {
            cost.evaluations += 8;
            // Column by column twice: what is stored at the nodes is loaded again at all lanes, which it could not be at once.
            for k in 0..K {
                let [y0, y1, y2, y3, y4, y5] = tangent[k];
                let [k0, k1, k2, k3, k4, k5] = slopes[k];
                phi[k] = rule.places(&[y0, y1, y2], &[k0, k1, k2]);
                let [_, _, _, mut v0, mut v1, mut v2] = self.f[k];
                let mut rho = [v0, v1, v2];
                for j in 0..3 {
                    for i in 0..3 {
                        rho[i] = a[1][i][j].times_plus(phi[k][j], rho[i]);
                    }
                }
                if self.coupled {
                    let before = rule.places(&[y3, y4, y5], &[k3, k4, k5]);
                    for j in 0..3 {
                        for i in 0..3 {
                            rho[i] = a[1][i][3 + j].times_plus(before[j], rho[i]);
                        }
                    }
                }
                [v0, v1, v2] = rho;
                slopes[k] = [k0, k1, k2, v0, v1, v2];
            }
            // With the new rho', in which phi is known better.
            let mut change = zero;
            for k in 0..K {
                let [_, _, _, y3, y4, y5] = tangent[k];
                let [k0, k1, k2, k3, k4, k5] = slopes[k];
                let rho = rule.places(&[y3, y4, y5], &[k3, k4, k5]);
                let [f0, f1, f2, ..] = self.f[k];
                let mut turned = [f0, f1, f2];
                for j in 0..3 {
                    for i in 0..3 {
                        turned[i] = a[0][i][j].times_plus(phi[k][j], turned[i]);
                        turned[i] = a[0][i][3 + j].times_plus(rho[j], turned[i]);
                    }
                }
                let [t0, t1, t2] = turned;
                let (d0, d1, d2) = (t0 - k0, t1 - k1, t2 - k2);
                change = d0.times_plus(d0, d1.times_plus(d1, d2.times_plus(d2, change)));
                slopes[k] = [t0, t1, t2, k3, k4, k5];
            }
            if change.total() < stays * stays {
                return true;
            }
        }
        false
    }
}

/// R v.
#[inline(always)]
fn turned_vector<S: Simd>(d: &Matrix<S>, v: &Vector<S>) -> Vector<S> {
    let mut all = *v;
    for i in 0..3 {
        let sum = d[1][i].times_plus(v[1], d[0][i] * v[0]);
        all[i] = d[2][i].times_plus(v[2], sum);
    }
    all
}

/// a x b.
#[inline(always)]
fn cross<S: Simd>(a: &Vector<S>, b: &Vector<S>) -> Vector<S> {
    [
        a[1] * b[2] - a[2] * b[1],
        a[2] * b[0] - a[0] * b[2],
        a[0] * b[1] - a[1] * b[0],
    ]
}

/// R diag(c) R^T.
#[inline(always)]
fn turned_diagonal<S: Simd>(d: &Matrix<S>, c: [f64; 3]) -> Matrix<S> {
    let mut scaled = *d;
    let mut all = *d;
    for k in 0..3 {
        for i in 0..3 {
            scaled[k][i] = d[k][i] * d[k][i].with(c[k]);
        }
    }
    for i in 0..3 {
        for j in 0..=i {
            let mut sum = scaled[0][i] * d[0][j];
            for k in 1..3 {
                sum = scaled[k][i].times_plus(d[k][j], sum);
            }
            all[i][j] = sum;
            all[j][i] = sum;
        }
    }
    all
}

/// R C R^T for the 3 x 3 block of C at (row, column).
#[inline(always)]
fn turned<S: Simd>(d: &Matrix<S>, c: &Matrix6<f64>, row: usize, column: usize) -> Matrix<S> {
    let mut half = *d;
    let mut all = *d;
    for k in 0..3 {
        for j in 0..3 {
            let mut sum = d[0][j] * d[0][j].with(c[(row + k, column)]);
            for l in 1..3 {
                sum = d[l][j].times_plus(d[l][j].with(c[(row + k, column + l)]), sum);
            }
            half[k][j] = sum;
        }
    }
    for i in 0..3 {
        for j in 0..3 {
            let mut sum = d[0][i] * half[0][j];
            for k in 1..3 {
                sum = d[k][i].times_plus(half[k][j], sum);
            }
            all[i][j] = sum;
        }
    }
    all
}
