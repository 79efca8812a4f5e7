//! Lobatto's rule of nine nodes, in wide registers: functions that are always inlined are compiled for them, closures
//! are not.
#![allow(clippy::needless_range_loop)]

use crate::math::Row;
use crate::math::collocation_tables::{integral_table, legendre, mode_table};
use crate::math::lanes8::Eight;
use pulp::{Simd, WithSimd};
use std::ops::Range;

/// Largest number of rows of a state.
pub const ROWS: usize = 8;

/// Numbers by row and node, the first node omitted.
#[derive(Debug, Clone, Copy)]
#[repr(align(64))]
pub struct NodeRows(pub [Row; ROWS]);

impl NodeRows {
    /// Zeros.
    pub(super) const ZERO: Self = Self([[0.0; 8]; ROWS]);
}

/// Legendre coefficients by row: P_1 .. P_8, and P_0.
#[derive(Debug, Clone, Copy)]
pub(super) struct Modes {
    pub high: NodeRows,
    pub mean: Row,
}

/// Nodes on [-1, 1]; the first, -1, is omitted.
const PLACES: Row = [
    -0.899_757_995_411_460_2,
    -0.677_186_279_510_737_8,
    -0.363_117_463_826_178_16,
    0.0,
    0.363_117_463_826_178_16,
    0.677_186_279_510_737_8,
    0.899_757_995_411_460_2,
    1.0,
];
/// Weight of the first node, and those of the others.
const FIRST: f64 = 1.0 / 36.0;
const WEIGHTS: Row = [
    0.165_495_361_560_805_53,
    0.274_538_712_500_161_74,
    0.346_428_510_973_046_35,
    0.371_519_274_376_417_2,
    0.346_428_510_973_046_35,
    0.274_538_712_500_161_74,
    0.165_495_361_560_805_53,
    FIRST,
];

/// `MODES[j][k]`: contribution of the value at node j, 0 the first, to the coefficient of P_k.
const MODES: [[f64; 9]; 9] = mode_table(&with_first(-1.0, PLACES), &with_first(FIRST, WEIGHTS));

/// `INTEGRALS[j][i]` = a_ij of node j, 0 the first.
const INTEGRALS: [Row; 9] = integral_table(&MODES, &PLACES);

const fn with_first(first: f64, others: Row) -> [f64; 9] {
    let [a, b, c, d, e, f, g, h] = others;
    [first, a, b, c, d, e, f, g, h]
}

/// y + h a k at the nodes, for the given rows.
#[inline(always)]
pub(super) fn states_at_nodes<S: Simd>(
    simd: S,
    from: &Row,
    start: &Row,
    slopes: &NodeRows,
    h: f64,
    rows: Range<usize>,
    to: &mut NodeRows,
) {
    let mut a = [Eight::all(simd, 0.0); 9];
    for j in 0..9 {
        a[j] = Eight::of(simd, INTEGRALS[j]);
    }
    for i in rows {
        // Two sums, which run in parallel.
        let [mut sum, mut rest] = [a[0] * start[i], a[1] * slopes.0[i][0]];
        for j in [2, 4, 6] {
            rest = a[j + 1].times_plus(a[0].with(slopes.0[i][j]), rest);
            sum = a[j].times_plus(a[0].with(slopes.0[i][j - 1]), sum);
        }
        sum = a[8].times_plus(a[0].with(slopes.0[i][7]), sum);
        to.0[i] = (sum + rest)
            .times_plus(a[0].with(h), a[0].with(from[i]))
            .numbers();
    }
}

/// Sum over nodes and rows of the squared change of the slopes, each by its scale.
#[inline(always)]
pub(super) fn squared_change<S: Simd>(
    simd: S,
    [before, now]: [&NodeRows; 2],
    scales: &Row,
    rows: usize,
) -> f64 {
    let mut sum = Eight::all(simd, 0.0);
    for i in 0..rows {
        let change = (Eight::of(simd, now.0[i]) - Eight::of(simd, before.0[i])) * scales[i];
        sum = change.times_plus(change, sum);
    }
    sum.total()
}

/// The polynomials through the slopes, as a task for wide registers.
pub(super) struct Fitting {
    pub start: Row,
    pub slopes: NodeRows,
}

impl WithSimd for Fitting {
    type Output = Modes;

    #[inline(always)]
    fn with_simd<S: Simd>(self, simd: S) -> Modes {
        let mut modes = Modes::ZERO;
        modes.fit_high(simd, &self.start, &self.slopes, ROWS);
        modes.fit_mean(simd, &self.start, &self.slopes, ROWS);
        modes
    }
}

impl Modes {
    pub const ZERO: Self = Self {
        high: NodeRows::ZERO,
        mean: [0.0; 8],
    };

    /// Fits the coefficients of P_1 .. P_8 to the slopes; rows without slopes are unchanged.
    #[inline(always)]
    pub fn fit_high<S: Simd>(&mut self, simd: S, start: &Row, slopes: &NodeRows, rows: usize) {
        let mut high = [Eight::all(simd, 0.0); 9];
        for j in 0..9 {
            let mut at = [0.0; 8];
            at.copy_from_slice(&MODES[j][1..]);
            high[j] = Eight::of(simd, at);
        }
        for i in 0..rows {
            let mut sum = high[0] * start[i];
            for j in 0..8 {
                sum = high[j + 1].times_plus(high[0].with(slopes.0[i][j]), sum);
            }
            self.high.0[i] = sum.numbers();
        }
    }

    /// Fits the coefficients of P_0 to the slopes.
    #[inline(always)]
    pub fn fit_mean<S: Simd>(&mut self, simd: S, start: &Row, slopes: &NodeRows, rows: usize) {
        let weights = Eight::of(simd, WEIGHTS) * 0.5;
        for i in 0..rows {
            let rest = (weights * Eight::of(simd, slopes.0[i])).total();
            self.mean[i] = (0.5 * FIRST) * start[i] + rest;
        }
    }

    /// Values of the polynomials at the nodes of a step that begins at `from` on [-1, 1] and is `ratio` times as
    /// long.
    #[inline(always)]
    pub fn at<S: Simd>(&self, simd: S, from: f64, ratio: f64, rows: usize, to: &mut NodeRows) {
        let one = Eight::all(simd, 1.0);
        let x = (Eight::of(simd, PLACES) + one).times_plus(one.with(ratio), one.with(from));
        let mut p = [one; 9];
        p[1] = x;
        for k in 1..8 {
            let n = k as f64;
            // A recurrence with a single operation of latency.
            let steep = x * ((2.0 * n + 1.0) / (n + 1.0));
            p[k + 1] = steep.times_plus(p[k], p[k - 1] * (-n / (n + 1.0)));
        }
        for i in 0..rows {
            let mut sum = one.with(self.mean[i]);
            for k in 1..9 {
                sum = p[k].times_plus(one.with(self.high.0[i][k - 1]), sum);
            }
            to.0[i] = sum.numbers();
        }
    }

    /// Norms over the rows of the last four coefficients, each row by its scale.
    #[inline(always)]
    pub fn tail(&self, scales: &Row, rows: usize) -> [f64; 4] {
        let mut sizes = [0.0; 4];
        for i in 0..rows {
            for k in 0..4 {
                let last = self.high.0[i][k + 4] * scales[i];
                sizes[k] += last * last;
            }
        }
        for size in &mut sizes {
            *size = size.sqrt();
        }
        sizes
    }
}

/// Integrals over [0, x] of the Lagrange polynomials of the nodes on [0, 1].
pub(super) fn integrals(x: f64) -> [f64; 9] {
    let z = 2.0 * x - 1.0;
    let p = legendre(z);
    let ninth = (17.0 * z * p[8] - 8.0 * p[7]) / 9.0;
    // Half the integrals of P_0 .. P_8 from -1 on.
    let mut whole = [0.5 * (1.0 + z); 9];
    for k in 1..9 {
        let next = if k == 8 { ninth } else { p[k + 1] };
        whole[k] = (next - p[k - 1]) * (0.5 / (2 * k + 1) as f64);
    }
    let mut weights = [0.0; 9];
    for (weight, modes) in weights.iter_mut().zip(&MODES) {
        for k in 0..9 {
            *weight += modes[k] * whole[k];
        }
    }
    weights
}
