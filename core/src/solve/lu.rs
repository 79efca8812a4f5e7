//! LU factors of real and complex matrices with partial pivoting, in wide registers.
//!
//! Real and imaginary parts are stored separately, and columns in whole lines of eight: all operations are sums of
//! real products down the columns.

use super::system::{Factor, Scalar};
use crate::math::lanes8::Eight;
use crate::math::registers::wide;
use nalgebra::{DMatrix, DVector};
use pulp::{Simd, WithSimd};

/// Eight rows of a column; those beyond the last row of the matrix are zero.
#[derive(Debug, Clone, Copy)]
#[repr(align(64))]
struct RowLine([f64; 8]);

const ZERO: RowLine = RowLine([0.0; 8]);

/// `FROM[i]`: ones from place i on, zeros before.
const FROM: [[f64; 8]; 8] = {
    let mut from = [[0.0; 8]; 8];
    let mut i = 0;
    while i < 8 {
        let mut j = i;
        while j < 8 {
            from[i][j] = 1.0;
            j += 1;
        }
        i += 1;
    }
    from
};

/// Factors P A = L U.
///
/// Single numbers are never written just before the line around them is read: the processor would stall.
#[derive(Debug, Clone)]
pub struct Lu {
    size: usize,
    /// Entries of U, and of L below its unit diagonal, by columns; imaginary parts of complex matrices only.
    re: Vec<RowLine>,
    im: Vec<RowLine>,
    /// Row exchanged with row k at step k.
    rows: Vec<usize>,
    /// Reciprocal pivots 1/u_kk.
    inverse: Vec<[f64; 2]>,
}

impl Lu {
    /// The factors of a square matrix; None if it is singular, or has entries that are not finite.
    pub fn new<T: Scalar>(matrix: &DMatrix<T>) -> Option<Self> {
        let size = matrix.nrows();
        let lines = size.div_ceil(8) * size;
        let mut lu = Self {
            size,
            re: vec![ZERO; lines],
            im: vec![ZERO; if is_complex::<T>() { lines } else { 0 }],
            rows: Vec::with_capacity(size),
            inverse: Vec::with_capacity(size),
        };
        let each = lu.lines().max(1);
        let columns = || matrix.as_slice().chunks_exact(size.max(1));
        for (numbers, column) in columns().zip(lu.re.chunks_exact_mut(each)) {
            copy_part(numbers, column, |x| x.real());
        }
        for (numbers, column) in columns().zip(lu.im.chunks_exact_mut(each)) {
            copy_part(numbers, column, |x| x.imaginary());
        }
        lu.eliminate().then_some(lu)
    }

    /// Factorises the matrix; false if singular or not finite.
    fn eliminate(&mut self) -> bool {
        if !wide(Eliminating(self)) {
            return false;
        }
        // Exchanges of rows have yet to be applied to the earlier columns of L.
        let each = self.lines().max(1);
        for part in [&mut self.re, &mut self.im] {
            for (i, column) in part.chunks_exact_mut(each).enumerate() {
                for (k, row) in self.rows.iter().enumerate().skip(i + 1) {
                    exchange(column, k, *row);
                }
            }
        }
        true
    }

    /// Solution for the right-hand sides, by real and imaginary parts; the sides are overwritten.
    fn solve_lines(&self, sides: [&mut [RowLine]; 2]) -> Vec<[f64; 2]> {
        let mut found = vec![[0.0; 2]; self.size];
        wide(Solving {
            lu: self,
            sides,
            found: &mut found,
        });
        found
    }

    /// Number of lines of a column.
    fn lines(&self) -> usize {
        self.size.div_ceil(8)
    }

    /// Brings the largest remaining entry of column k to the diagonal; false if all are zero.
    #[inline(always)]
    fn pivot(&mut self, k: usize) -> bool {
        let column = k * self.lines()..(k + 1) * self.lines();
        let (re, im) = (&self.re[column.clone()], self.im.get(column.clone()));
        let (mut row, mut largest) = (k, -1.0);
        for (b, line) in re.iter().enumerate().skip(k / 8) {
            let mut sizes = line.0.map(|x| x * x);
            if let Some(im) = im {
                for (size, y) in sizes.iter_mut().zip(im[b].0) {
                    *size += y * y;
                }
            }
            for (i, size) in sizes.iter().enumerate() {
                if *size > largest && 8 * b + i >= k {
                    (row, largest) = (8 * b + i, *size);
                }
            }
        }
        let at = |lines: &[RowLine]| lines[row / 8].0[row % 8];
        let (x, y) = (at(re), im.map_or(0.0, at));
        self.inverse.push([x / largest, -y / largest]);
        self.rows.push(row);
        exchange(&mut self.re[column.clone()], k, row);
        if let Some(im) = self.im.get_mut(column) {
            exchange(im, k, row);
        }
        largest > 0.0 && largest.is_finite()
    }
}

/// True if numbers of this type are complex.
const fn is_complex<T>() -> bool {
    size_of::<T>() > size_of::<f64>()
}

/// Copies one part of every number into lines.
fn copy_part<T: Copy>(numbers: &[T], lines: &mut [RowLine], of: impl Fn(T) -> f64) {
    for (line, numbers) in lines.iter_mut().zip(numbers.chunks(8)) {
        for (place, x) in line.0.iter_mut().zip(numbers) {
            *place = of(*x);
        }
    }
}

/// Exchanges two rows of a column.
#[inline(always)]
fn exchange(column: &mut [RowLine], i: usize, j: usize) {
    let (x, y) = (column[i / 8].0[i % 8], column[j / 8].0[j % 8]);
    column[i / 8].0[i % 8] = y;
    column[j / 8].0[j % 8] = x;
}

struct Eliminating<'a>(&'a mut Lu);

impl WithSimd for Eliminating<'_> {
    type Output = bool;

    #[inline(always)]
    fn with_simd<S: Simd>(self, simd: S) -> bool {
        let (n, lines, lu) = (self.0.size, self.0.lines(), self.0);
        // Column of L, from the line of the row below the diagonal on.
        let (mut below, mut imaginary) = (vec![ZERO; lines], vec![ZERO; lines]);
        for k in 0..n {
            if !lu.pivot(k) {
                return false;
            }
            if k + 1 == n {
                break;
            }
            let ([p, q], row) = (lu.inverse[k], lu.rows[k]);
            let first = (k + 1) / 8;
            // The row exchanged with the pivot row is treated separately: its entry below the pivot, and its factor.
            let factor = |l: &[RowLine]| {
                if row > k {
                    l[row / 8 - first].0[row % 8]
                } else {
                    0.0
                }
            };
            let (done, rest) = lu.re.split_at_mut((k + 1) * lines);
            let (re, l) = (&mut done[k * lines + first..], &mut below[first..]);
            let above = separate_above(simd, re, k + 1);
            if lu.im.is_empty() {
                for (x, l) in re.iter_mut().zip(l.iter_mut()) {
                    *l = RowLine((Eight::of(simd, x.0) * p).numbers());
                }
                put(simd, re, l, above);
                let f = factor(l);
                for column in rest.chunks_exact_mut(lines) {
                    let [a, old] = [row, k].map(|i| column[i / 8].0[i % 8]);
                    take(simd, &mut column[first..], l, a);
                    column[row / 8].0[row % 8] = old - a * f;
                    column[k / 8].0[k % 8] = a;
                }
                continue;
            }
            let (done, parts) = lu.im.split_at_mut((k + 1) * lines);
            let (im, m) = (&mut done[k * lines + first..], &mut imaginary[first..]);
            let beside = separate_above(simd, im, k + 1);
            for ((x, y), (l, m)) in re.iter().zip(im.iter()).zip(l.iter_mut().zip(m.iter_mut())) {
                let (x, y) = (Eight::of(simd, x.0), Eight::of(simd, y.0));
                *l = RowLine((x * p - y * q).numbers());
                *m = RowLine((x * q + y * p).numbers());
            }
            put(simd, re, l, above);
            put(simd, im, m, beside);
            let f = [factor(l), factor(m)];
            for (x, y) in rest
                .chunks_exact_mut(lines)
                .zip(parts.chunks_exact_mut(lines))
            {
                let [a, old] = [row, k].map(|i| [x[i / 8].0[i % 8], y[i / 8].0[i % 8]]);
                take_complex(simd, [&mut x[first..], &mut y[first..]], [l, m], a);
                x[row / 8].0[row % 8] = old[0] - (a[0] * f[0] - a[1] * f[1]);
                y[row / 8].0[row % 8] = old[1] - (a[0] * f[1] + a[1] * f[0]);
                (x[k / 8].0[k % 8], y[k / 8].0[k % 8]) = (a[0], a[1]);
            }
        }
        true
    }
}

/// Mask of the line of a row: ones from the row on and zeros before; and its complement.
#[inline(always)]
fn masks<S: Simd>(simd: S, row: usize) -> (Eight<S>, Eight<S>) {
    let mask = Eight::of(simd, FROM[row % 8]);
    (mask, Eight::all(simd, 1.0) - mask)
}

/// Separates the entries above `row` from the first line of a column, before its division by a possibly small pivot.
#[inline(always)]
fn separate_above<S: Simd>(simd: S, column: &mut [RowLine], row: usize) -> RowLine {
    let (mask, others) = masks(simd, row);
    let above = only(simd, column[0], others);
    column[0] = only(simd, column[0], mask);
    above
}

/// Stores a column of L below the separated entries of its first line.
#[inline(always)]
fn put<S: Simd>(simd: S, place: &mut [RowLine], l: &[RowLine], above: RowLine) {
    place.copy_from_slice(l);
    place[0] = RowLine((Eight::of(simd, above.0) + Eight::of(simd, l[0].0)).numbers());
}

/// x -= a l for real columns.
#[inline(always)]
fn take<S: Simd>(simd: S, x: &mut [RowLine], l: &[RowLine], a: f64) {
    let a = Eight::all(simd, -a);
    for (x, l) in x.iter_mut().zip(l) {
        x.0 = Eight::of(simd, l.0)
            .times_plus(a, Eight::of(simd, x.0))
            .numbers();
    }
}

/// x -= a l for complex columns.
#[inline(always)]
fn take_complex<S: Simd>(
    simd: S,
    [x, y]: [&mut [RowLine]; 2],
    [l, m]: [&[RowLine]; 2],
    [a, b]: [f64; 2],
) {
    let (less_a, less_b, b) = (
        Eight::all(simd, -a),
        Eight::all(simd, -b),
        Eight::all(simd, b),
    );
    for ((x, y), (l, m)) in x.iter_mut().zip(y.iter_mut()).zip(l.iter().zip(m)) {
        let (l, m) = (Eight::of(simd, l.0), Eight::of(simd, m.0));
        let re = l.times_plus(less_a, Eight::of(simd, x.0));
        let im = l.times_plus(less_b, Eight::of(simd, y.0));
        x.0 = m.times_plus(b, re).numbers();
        y.0 = m.times_plus(less_a, im).numbers();
    }
}

struct Solving<'a> {
    lu: &'a Lu,
    /// Real and imaginary part of the right-hand side, overwritten.
    sides: [&'a mut [RowLine]; 2],
    found: &'a mut [[f64; 2]],
}

impl WithSimd for Solving<'_> {
    type Output = ();

    #[inline(always)]
    fn with_simd<S: Simd>(self, simd: S) {
        let Self { lu, sides, found } = self;
        let (n, lines, [x, y]) = (lu.size, lu.lines(), sides);
        for (k, row) in lu.rows.iter().enumerate() {
            exchange(x, k, *row);
            if !y.is_empty() {
                exchange(y, k, *row);
            }
        }
        for k in 0..n.saturating_sub(1) {
            let (i, j, first) = (k / 8, k % 8, (k + 1) / 8);
            let column = k * lines + first..(k + 1) * lines;
            let (mask, _) = masks(simd, k + 1);
            let re = &lu.re[column.clone()];
            let top = only(simd, re[0], mask);
            if lu.im.is_empty() {
                let a = x[i].0[j];
                take(simd, &mut x[first..=first], &[top], a);
                take(simd, &mut x[first + 1..], &re[1..], a);
                continue;
            }
            let im = &lu.im[column];
            let a = [x[i].0[j], y[i].0[j]];
            let l = [&[top][..], &[only(simd, im[0], mask)]];
            take_complex(simd, [&mut x[first..=first], &mut y[first..=first]], l, a);
            take_complex(
                simd,
                [&mut x[first + 1..], &mut y[first + 1..]],
                [&re[1..], &im[1..]],
                a,
            );
        }
        for k in (0..n).rev() {
            let ([p, q], i, j) = (lu.inverse[k], k / 8, k % 8);
            let column = k * lines..k * lines + i + 1;
            let (_, mask) = masks(simd, k);
            let re = &lu.re[column.clone()];
            let end = only(simd, re[i], mask);
            if lu.im.is_empty() {
                let a = x[i].0[j] * p;
                found[k] = [a, 0.0];
                take(simd, &mut x[i..=i], &[end], a);
                take(simd, &mut x[..i], &re[..i], a);
                continue;
            }
            let im = &lu.im[column];
            let a = [x[i].0[j] * p - y[i].0[j] * q, x[i].0[j] * q + y[i].0[j] * p];
            found[k] = a;
            let u = [&[end][..], &[only(simd, im[i], mask)]];
            take_complex(simd, [&mut x[i..=i], &mut y[i..=i]], u, a);
            take_complex(simd, [&mut x[..i], &mut y[..i]], [&re[..i], &im[..i]], a);
        }
    }
}

/// A line times a mask.
#[inline(always)]
fn only<S: Simd>(simd: S, line: RowLine, mask: Eight<S>) -> RowLine {
    RowLine((mask * Eight::of(simd, line.0)).numbers())
}

impl<T: Scalar> Factor<T> for Lu {
    fn solve(&self, b: &mut DVector<T>) -> bool {
        let mut sides = vec![ZERO; if is_complex::<T>() { 2 } else { 1 } * self.lines()];
        let (x, y) = sides.split_at_mut(self.lines());
        copy_part(b.as_slice(), x, |b| b.real());
        copy_part(b.as_slice(), y, |b| b.imaginary());
        let found = self.solve_lines([x, y]);
        for (b, [re, im]) in b.iter_mut().zip(&found) {
            *b = T::of(*re, *im);
        }
        found.as_flattened().iter().all(|x| x.is_finite())
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use nalgebra::Complex;
    use std::cmp::Ordering;

    /// Catches a wrong sign, row or part: products with the matrix give back the right-hand sides, for all rows of
    /// the pivots. Also small pivots that make numbers above them infinite.
    #[test]
    fn solutions_solve() {
        let number = |i: usize| ((i * i) as f64 * 0.618_033_988_749_894_9).fract() - 0.5;
        let n = 13;
        let real = DMatrix::from_fn(n, n, |i, j| number(i * n + j + 1));
        let b = DVector::from_fn(n, |i, _| number(i));
        let mut x = b.clone();
        assert!(Lu::new(&real).unwrap().solve(&mut x));
        assert!((&real * x - &b).amax() < 1e-12);
        let complex = real.map_with_location(|i, j, x| Complex::new(x, number(i + 31 * j + 7)));
        let b = b.map(|x| Complex::new(x, 0.3 - x * x));
        let mut x = b.clone();
        assert!(Lu::new(&complex).unwrap().solve(&mut x));
        assert!((complex * x - b).iter().all(|gap| gap.norm() < 1e-12));
        assert!(Lu::new(&DMatrix::from_element(2, 2, 1.0)).is_none());
        // Small pivots below large entries of U.
        let graded = DMatrix::from_fn(n, n, |i, j| match i.cmp(&j) {
            Ordering::Less => 1e180,
            Ordering::Equal => 1e-140,
            Ordering::Greater => 0.0,
        });
        let mut last = DVector::zeros(n);
        last[0] = 1e-140;
        assert!(Lu::new(&graded).unwrap().solve(&mut last));
        assert!((last[0] - 1.0).abs() < 1e-12 && last.rows(1, n - 1).amax() == 0.0);
    }
}
