//! Factors of real and complex matrices by elimination with partial pivoting.
//!
//! Real and imaginary parts are kept apart: what is done to them are sums of real products down the columns, for which registers are wide.

use super::system::{Factor, Scalar};
use crate::math::eight::wide;
use nalgebra::{DMatrix, DVector};
use pulp::{Simd, WithSimd};

/// A = P_1 L_1 P_2 L_2 .. U: rows are exchanged as the elimination comes to them, and not in what it has left behind.
#[derive(Debug, Clone)]
pub struct Lu {
    size: usize,
    /// The parts of U, and of L below its diagonal of ones, by columns; imaginary ones of complex matrices only.
    re: Vec<f64>,
    im: Vec<f64>,
    /// The row that was exchanged with each when it was its turn.
    rows: Vec<usize>,
    /// 1/u_kk.
    inverse: Vec<[f64; 2]>,
}

impl Lu {
    /// The factors of a square matrix; None if it is singular, or has entries that are not finite.
    pub fn new<T: Scalar>(matrix: &DMatrix<T>) -> Option<Self> {
        let mut lu = Self {
            size: matrix.nrows(),
            re: matrix.iter().map(|x| x.real()).collect(),
            im: Vec::new(),
            rows: Vec::with_capacity(matrix.nrows()),
            inverse: Vec::with_capacity(matrix.nrows()),
        };
        if is_complex::<T>() {
            lu.im.extend(matrix.iter().map(|x| x.imaginary()));
        }
        wide(Eliminating(&mut lu)).then_some(lu)
    }

    /// Brings the largest entry of what is left of column k to its diagonal; false if there is none.
    fn pivot(&mut self, k: usize) -> bool {
        let n = self.size;
        let column = k * n..(k + 1) * n;
        let (re, im) = (&self.re[column.clone()], self.im.get(column));
        let size = |row: usize| re[row] * re[row] + im.map_or(0.0, |im| im[row] * im[row]);
        let (mut row, mut largest) = (k, size(k));
        for other in k + 1..n {
            let size = size(other);
            if size > largest {
                (row, largest) = (other, size);
            }
        }
        let imaginary = im.map_or(0.0, |im| im[row]);
        self.inverse.push([re[row] / largest, -imaginary / largest]);
        self.rows.push(row);
        for part in [&mut self.re, &mut self.im] {
            if let Some(column) = part.get_mut(k * n..(k + 1) * n) {
                column.swap(k, row);
            }
        }
        largest > 0.0 && largest.is_finite()
    }
}

/// Whether numbers of this type have two parts.
const fn is_complex<T>() -> bool {
    size_of::<T>() > size_of::<f64>()
}

struct Eliminating<'a>(&'a mut Lu);

impl WithSimd for Eliminating<'_> {
    type Output = bool;

    #[inline(always)]
    fn with_simd<S: Simd>(self, _: S) -> bool {
        let (n, lu) = (self.0.size, self.0);
        for k in 0..n {
            if !lu.pivot(k) {
                return false;
            }
            let ([p, q], row) = (lu.inverse[k], lu.rows[k]);
            let (done, rest) = lu.re.split_at_mut((k + 1) * n);
            let re = &mut done[k * n + k + 1..];
            if lu.im.is_empty() {
                for x in re.iter_mut() {
                    *x *= p;
                }
                for column in rest.chunks_exact_mut(n) {
                    column.swap(k, row);
                    let (above, below) = column.split_at_mut(k + 1);
                    take(below, re, above[k]);
                }
                continue;
            }
            let (done, imaginary) = lu.im.split_at_mut((k + 1) * n);
            let im = &mut done[k * n + k + 1..];
            for (x, y) in re.iter_mut().zip(im.iter_mut()) {
                (*x, *y) = (*x * p - *y * q, *x * q + *y * p);
            }
            for (x, y) in rest.chunks_exact_mut(n).zip(imaginary.chunks_exact_mut(n)) {
                x.swap(k, row);
                y.swap(k, row);
                let ((x0, x), (y0, y)) = (x.split_at_mut(k + 1), y.split_at_mut(k + 1));
                take_complex([x, y], [re, im], [x0[k], y0[k]]);
            }
        }
        true
    }
}

/// x -= a l.
#[inline(always)]
fn take(x: &mut [f64], l: &[f64], a: f64) {
    for (x, l) in x.iter_mut().zip(l) {
        *x -= l * a;
    }
}

/// The same of complex numbers.
#[inline(always)]
fn take_complex([x, y]: [&mut [f64]; 2], [l, m]: [&[f64]; 2], [a, b]: [f64; 2]) {
    for (((x, y), l), m) in x.iter_mut().zip(y.iter_mut()).zip(l).zip(m) {
        *x -= l * a - m * b;
        *y -= l * b + m * a;
    }
}

struct Solving<'a>(&'a Lu, [&'a mut [f64]; 2]);

impl WithSimd for Solving<'_> {
    type Output = ();

    #[inline(always)]
    fn with_simd<S: Simd>(self, _: S) {
        let Self(lu, [x, y]) = self;
        let n = lu.size;
        for (k, row) in lu.rows.iter().enumerate() {
            x.swap(k, *row);
            let below = k * n + k + 1..(k + 1) * n;
            if lu.im.is_empty() {
                let a = x[k];
                take(&mut x[k + 1..], &lu.re[below], a);
                continue;
            }
            y.swap(k, *row);
            let a = [x[k], y[k]];
            let l = [&lu.re[below.clone()], &lu.im[below]];
            take_complex([&mut x[k + 1..], &mut y[k + 1..]], l, a);
        }
        for k in (0..n).rev() {
            let [p, q] = lu.inverse[k];
            let above = k * n..k * n + k;
            if lu.im.is_empty() {
                x[k] *= p;
                let a = x[k];
                take(&mut x[..k], &lu.re[above], a);
                continue;
            }
            let a = [x[k] * p - y[k] * q, x[k] * q + y[k] * p];
            [x[k], y[k]] = a;
            let u = [&lu.re[above.clone()], &lu.im[above]];
            take_complex([&mut x[..k], &mut y[..k]], u, a);
        }
    }
}

impl<T: Scalar> Factor<T> for Lu {
    fn solve(&self, b: &mut DVector<T>) -> bool {
        let mut x: Vec<f64> = b.iter().map(|b| b.real()).collect();
        let mut y: Vec<f64> = match self.im.is_empty() {
            true => Vec::new(),
            false => b.iter().map(|b| b.imaginary()).collect(),
        };
        wide(Solving(self, [&mut x, &mut y]));
        for (i, b) in b.iter_mut().enumerate() {
            *b = T::of(x[i], y.get(i).copied().unwrap_or(0.0));
        }
        b.iter().all(|b| b.is_finite())
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use nalgebra::Complex;

    /// Catches a wrong sign, row or part: products with the matrix give back the right-hand sides, whichever row the pivots come from.
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
    }
}
