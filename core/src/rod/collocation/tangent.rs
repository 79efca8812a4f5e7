//! Tangent of the end of a uniform linear rod: derivatives of frame and centreline by the base wrench.
//!
//! Frame and centreline change by phi and rho. Let r_s be the place where a step starts, and rho* = rho - phi x (r -
//! r_s). Then
//!
//! ```text
//! (phi, rho*)' = C* y,   y = (tau, sigma) = y_s + (m_s x dphi + n x drho*, n x dphi),
//!
//! C* = | P    Q |,   P = M_uu,   Q = M_uv - P [a],   T = M_vv - M_vu [a] + [a] Q,   M = R C R^T,   a = r - r_s,
//!      | Q^T  T |
//! ```
//!
//! with the changes y_s of couple and force at r_s, and the changes dphi and drho* of phi and rho* since. A step adds
//! to y only a term of rank four, for n.sigma and m_s.sigma + n.tau are constant: it is L x with x = (dphi_1, dphi_2,
//! dtau_1, dtau_2),
//!
//! ```text
//! dsigma = |n| (-dphi_2, dphi_1, 0),   dtau_3 = m_1 dphi_2 - m_2 dphi_1,
//! ```
//!
//! and x' = A x + f with A = H C* L, f = H C* y_s. H takes (phi, rho*)' to x'. This is a Hamiltonian system of four
//! variables, whose matrices are formed once a step instead of once a slope. Its two halves are swept in turn, each
//! with the newest values of the other, which takes two thirds of the sweeps. The origin r_s must be near: about the
//! clamp y would change by a force times the whole of r, most of which cancels.
//!
//! If one compliance is much greater than the others, as for a rod soft in torsion, A is nearly nilpotent, for d.(m x
//! d) = 0. Swept as a whole it converges at once, however great it is. Its halves do not: in that case both take the
//! values of the sweep before.

use super::{
    Integration, MAX_COLUMNS, MOST_SWEEPS, MatrixField, NodeSections, SweptColumns, SweptSlopes,
    VariationStart, VectorField,
};
use crate::math::lanes8::{Eight, GaussRule};
use crate::section::Compliance;
use nalgebra::Matrix6;
use pulp::Simd;

impl Integration<'_> {
    /// C* at the nodes, at the displacements `r` from the start of the step.
    #[inline(always)]
    fn compliance_changes<S: Simd>(
        &self,
        at: &NodeSections<S>,
        r: &VectorField<S>,
    ) -> [[Eight<S>; 6]; 6] {
        let zero = at.energy.with(0.0);
        let none = [[zero; 3]; 3];
        let (uu, uv, vu, vv) = match &self.linear.compliance {
            Compliance::Diagonal(c) => {
                let uu = turned_diagonal(&at.d, [c[0], c[1], c[2]]);
                let vv = turned_diagonal(&at.d, [c[3], c[4], c[5]]);
                (uu, none, none, vv)
            }
            Compliance::Full(c) => (
                rotate_block(&at.d, c, 0, 0),
                rotate_block(&at.d, c, 0, 3),
                rotate_block(&at.d, c, 3, 0),
                rotate_block(&at.d, c, 3, 3),
            ),
        };
        // M [r] has the rows M_i x r.
        let mut by_force = uv;
        let mut pulled = vv;
        for i in 0..3 {
            let lever = cross(&uu[i], r);
            let carried = cross(&vu[i], r);
            for j in 0..3 {
                by_force[i][j] = uv[i][j] - lever[j];
                pulled[i][j] = vv[i][j] - carried[j];
            }
        }
        let mut all = [[zero; 6]; 6];
        for j in 0..3 {
            let turned = cross(r, &[by_force[0][j], by_force[1][j], by_force[2][j]]);
            for i in 0..3 {
                all[i][j] = uu[i][j];
                all[i][3 + j] = by_force[i][j];
                all[3 + j][i] = by_force[i][j];
                all[3 + i][3 + j] = pulled[i][j] + turned[i];
            }
        }
        all
    }

    /// Couple m at the place `r`.
    #[inline(always)]
    pub(super) fn couple(&self, r: &[f64; 3]) -> [f64; 3] {
        [
            self.m[0] - self.n * r[1],
            self.m[1] + self.n * r[0],
            self.m[2],
        ]
    }

    /// y at a section: change of couple and force by each column.
    #[inline(always)]
    fn couple_and_force_changes(
        &self,
        r: &[f64; 3],
        columns: &SweptColumns,
    ) -> [[f64; 6]; MAX_COLUMNS] {
        let ([m1, m2, m3], n) = (self.couple(r), self.n);
        let mut all = [[0.0; 6]; MAX_COLUMNS];
        for (y, (at, base)) in (all.iter_mut()).zip(columns.tangent.iter().zip(&columns.base)) {
            let [p1, p2, p3, r1, r2, _] = *at;
            let [a, b, c, d, e, f] = *base;
            *y = [
                a - (r[1] * f - r[2] * e) + m2 * p3 - m3 * p2 - n * r2,
                b - (r[2] * d - r[0] * f) + m3 * p1 - m1 * p3 + n * r1,
                c - (r[0] * e - r[1] * d) + m1 * p2 - m2 * p1,
                d - n * p2,
                e + n * p1,
                f,
            ];
        }
        all
    }

    /// Sweeps x on a step from the place `r` until its slopes converge, then forms those of phi and rho*; returns the
    /// number of sweeps.
    #[inline(always)]
    pub(super) fn vary<S: Simd>(
        &self,
        at: &NodeSections<S>,
        rule: &GaussRule<S>,
        r: &[f64; 3],
        columns: &SweptColumns,
        start: VariationStart<'_, S>,
        slopes: &mut [[Eight<S>; 6]],
    ) -> Option<usize> {
        let change = self.compliance_changes(at, &rule.places(&[0.0; 3], &at.along));
        let y = self.couple_and_force_changes(r, columns);
        let count = slopes.len().min(MAX_COLUMNS);
        let ([m1, m2, m3], n) = (self.couple(r), self.n);
        let zero = change[0][0].with(0.0);
        // H C* and A.
        let mut rows = [change[0], change[1], change[0], change[1]];
        let mut by = [[zero; 4]; 4];
        for j in 0..6 {
            rows[2][j] = change[2][j] * m2 - change[1][j] * m3 - change[4][j] * n;
            rows[3][j] = change[0][j] * m3 - change[2][j] * m1 + change[3][j] * n;
        }
        for i in 0..4 {
            let [a1, a2, a3, a4, a5, _] = rows[i];
            by[i] = [a5 * n - a3 * m2, a3 * m1 - a4 * n, a1, a2];
        }
        let mut own = [[zero; 4]; MAX_COLUMNS];
        let mut x = [[zero; 4]; MAX_COLUMNS];
        let VariationStart {
            swept,
            extension: guess,
            stays,
        } = start;
        let SweptSlopes { turning, pulled } = swept;
        for k in 0..count {
            let mut begun = [zero; 6];
            for j in 0..6 {
                begun[j] = zero.with(y[k][j]);
            }
            for i in 0..4 {
                own[k][i] = product(&rows[i], &begun);
            }
            let [f1, f2, mut f3, mut f4] = own[k];
            turning[k] = match &guess {
                None => [f1, f2],
                Some((extension, further)) => {
                    let ([k1, k2], [k3, k4]) = (turning[k], pulled[k]);
                    let [k1, k2, k3, k4] = extension.of(&[k1, k2, k3, k4]);
                    // Transfers the couple from the start of the other step to the present start.
                    f3 = k1.times_plus(zero.with(n * further), k3);
                    f4 = k2.times_plus(zero.with(n * further), k4);
                    [k1, k2]
                }
            };
            let [tau1, tau2] = rule.places(&[0.0; 2], &[f3, f4]);
            x[k] = [zero, zero, tau1, tau2];
        }
        let mut last = 0.0;
        for sweeps in 1..=MOST_SWEEPS {
            // Gauss-Seidel: tau' by phi, then phi' by tau. All columns are done together, since values stored at the
            // nodes are reloaded for all lanes, and an immediate reload would stall.
            for k in 0..count {
                let [_, _, mut k3, mut k4] = own[k];
                let [_, _, tau1, tau2] = x[k];
                let [phi1, phi2] = rule.places(&[0.0; 2], &turning[k]);
                let before = [phi1, phi2, tau1, tau2];
                for j in [2, 3, 0, 1] {
                    k3 = by[2][j].times_plus(before[j], k3);
                    k4 = by[3][j].times_plus(before[j], k4);
                }
                x[k] = before;
                pulled[k] = [k3, k4];
            }
            let mut moved = zero;
            for k in 0..count {
                let [mut k1, mut k2, ..] = own[k];
                let [phi1, phi2, ..] = x[k];
                let [tau1, tau2] = rule.places(&[0.0; 2], &pulled[k]);
                let newest = [phi1, phi2, tau1, tau2];
                if !self.alone {
                    x[k] = newest;
                }
                for j in 0..4 {
                    k1 = by[0][j].times_plus(x[k][j], k1);
                    k2 = by[1][j].times_plus(x[k][j], k2);
                }
                let [before1, before2] = turning[k];
                let (d1, d2) = (k1 - before1, k2 - before2);
                moved = d1.times_plus(d1, d2.times_plus(d2, moved));
                turning[k] = [k1, k2];
                x[k] = newest;
            }
            let moved = moved.total();
            // The same superlinear stop as for the frame.
            if moved * moved <= stays * stays * last {
                for k in 0..count {
                    let [phi1, phi2, tau1, tau2] = x[k];
                    let [t1, t2, t3, s1, s2, s3] = y[k];
                    let all = [
                        tau1 + zero.with(t1),
                        tau2 + zero.with(t2),
                        phi2.times_plus(zero.with(m1), zero.with(t3)) - phi1 * m2,
                        zero.with(s1) - phi2 * n,
                        phi1.times_plus(zero.with(n), zero.with(s2)),
                        zero.with(s3),
                    ];
                    for i in 0..6 {
                        slopes[k][i] = product(&change[i], &all);
                    }
                }
                return Some(sweeps);
            }
            last = moved;
        }
        None
    }
}

/// Adds a step with the given slopes; `moved` is the displacement of the section over the step.
#[inline(always)]
pub(super) fn carry<S: Simd>(
    tangent: &mut [[f64; 6]],
    rule: &GaussRule<S>,
    slopes: &[[Eight<S>; 6]],
    moved: &[f64; 3],
) {
    for (column, slopes) in tangent.iter_mut().zip(slopes) {
        for (y, slope) in column.iter_mut().zip(slopes) {
            *y += rule.integral(slope);
        }
        let [phi1, phi2, phi3, ..] = *column;
        column[3] += phi2 * moved[2] - phi3 * moved[1];
        column[4] += phi3 * moved[0] - phi1 * moved[2];
        column[5] += phi1 * moved[1] - phi2 * moved[0];
    }
}

/// sum_j a_j x_j.
#[inline(always)]
fn product<S: Simd>(a: &[Eight<S>; 6], x: &[Eight<S>; 6]) -> Eight<S> {
    let mut sum = a[0] * x[0];
    for j in 1..6 {
        sum = a[j].times_plus(x[j], sum);
    }
    sum
}

/// a x b.
#[inline(always)]
pub(super) fn cross<S: Simd>(a: &VectorField<S>, b: &VectorField<S>) -> VectorField<S> {
    [
        a[1] * b[2] - a[2] * b[1],
        a[2] * b[0] - a[0] * b[2],
        a[0] * b[1] - a[1] * b[0],
    ]
}

/// R diag(c) R^T.
#[inline(always)]
fn turned_diagonal<S: Simd>(d: &MatrixField<S>, c: [f64; 3]) -> MatrixField<S> {
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
fn rotate_block<S: Simd>(
    d: &MatrixField<S>,
    c: &Matrix6<f64>,
    row: usize,
    column: usize,
) -> MatrixField<S> {
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
