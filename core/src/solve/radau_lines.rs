//! Vector operations of Newton's iteration on Radau stages, in wide registers: eight components of all stages at
//! once.

use super::radau_stages::Tableau;
use super::radau7::S;
use crate::math::lanes8::Eight;
use crate::math::real::Real;
use nalgebra::{DMatrix, DVector};
use pulp::{Simd, WithSimd};

/// Largest number of stages.
const MOST: usize = S;

/// Eight numbers of a field from index `first` on, padded with zeros.
#[inline(always)]
fn line<S: Simd>(simd: S, field: &[f64], first: usize) -> Eight<S> {
    let left = field.get(first..).unwrap_or_default();
    if let Some(whole) = left.first_chunk::<8>() {
        return Eight::of(simd, *whole);
    }
    let mut padded = [0.0; 8];
    padded[..left.len()].copy_from_slice(left);
    Eight::of(simd, padded)
}

/// Stores a line at the index `first`, truncated at the end of the field.
#[inline(always)]
fn put<S: Simd>(line: Eight<S>, field: &mut DVector<f64>, first: usize) {
    let left = &mut field.as_mut_slice()[first..];
    if let Some(whole) = left.first_chunk_mut::<8>() {
        *whole = line.numbers();
        return;
    }
    left.copy_from_slice(&line.numbers()[..left.len()]);
}

/// Row i of a matrix times the lines of the stages.
#[inline(always)]
fn row_times<S: Simd>(rows: &DMatrix<f64>, i: usize, lines: &[Eight<S>; MOST]) -> Eight<S> {
    let mut sum = lines[0] * rows[(i, 0)];
    for j in 1..rows.ncols() {
        sum = lines[j].times_plus(sum.with(rows[(i, j)]), sum);
    }
    sum
}

/// T^-1 F - Lambda/h W: right-hand sides of the linear systems of an iteration.
pub(super) struct Residuals<'a> {
    pub tableau: &'a Tableau,
    pub h: f64,
    /// Number of leading components that are differential; for the algebraic ones the residual is T^-1 F.
    pub differential: usize,
    pub slopes: &'a [DVector<f64>],
    pub w: &'a [DVector<f64>],
    pub to: &'a mut [DVector<f64>],
}

impl WithSimd for Residuals<'_> {
    type Output = ();

    #[inline(always)]
    fn with_simd<S: Simd>(self, simd: S) {
        let (tableau, stages, n) = (self.tableau, self.w.len(), self.w[0].len());
        let mut first = 0;
        while first < n {
            let mut slopes = [Eight::all(simd, 0.0); MOST];
            let mut w = slopes;
            for i in 0..stages {
                slopes[i] = line(simd, self.slopes[i].as_slice(), first);
                w[i] =
                    line(simd, &self.w[i].as_slice()[..self.differential], first) * (1.0 / self.h);
            }
            let real = row_times(&tableau.t_inverse, 0, &slopes) - w[0] * tableau.gamma;
            put(real, &mut self.to[0], first);
            for m in 0..tableau.pairs.len() {
                let (pair, re, im) = (tableau.pairs[m], 2 * m + 1, 2 * m + 2);
                let moved = w[im] * pair.im - w[re] * pair.re;
                put(
                    row_times(&tableau.t_inverse, re, &slopes) + moved,
                    &mut self.to[re],
                    first,
                );
                let moved = w[re] * pair.im + w[im] * pair.re;
                put(
                    row_times(&tableau.t_inverse, im, &slopes) - moved,
                    &mut self.to[im],
                    first,
                );
            }
            first += 8;
        }
    }
}

/// Applies the increments of W to W, Z and the states.
pub(super) struct Advance<'a> {
    pub t: &'a DMatrix<f64>,
    pub increments: &'a [DVector<f64>],
    pub y: &'a DVector<f64>,
    pub w: &'a mut [DVector<f64>],
    pub z: &'a mut [DVector<f64>],
    /// y + z.
    pub states: &'a mut [DVector<f64>],
    /// Root mean square over the stages of the change of Z, by components.
    pub change: &'a mut DVector<f64>,
}

impl WithSimd for Advance<'_> {
    type Output = ();

    #[inline(always)]
    fn with_simd<S: Simd>(self, simd: S) {
        let (stages, n) = (self.w.len(), self.y.len());
        let share = 1.0 / stages as f64;
        let mut first = 0;
        while first < n {
            let y = line(simd, self.y.as_slice(), first);
            let mut increments = [y; MOST];
            let all = self.increments.iter().zip(self.w.iter_mut());
            for (increment, (given, w)) in increments.iter_mut().zip(all) {
                *increment = line(simd, given.as_slice(), first);
                let moved = line(simd, w.as_slice(), first) + *increment;
                put(moved, w, first);
            }
            let mut squares = Eight::all(simd, 0.0);
            for i in 0..stages {
                let change = row_times(self.t, i, &increments);
                let z = line(simd, self.z[i].as_slice(), first) + change;
                put(z, &mut self.z[i], first);
                put(y + z, &mut self.states[i], first);
                squares = change.times_plus(change, squares);
            }
            put((squares * share).sqrt(), self.change, first);
            first += 8;
        }
    }
}
