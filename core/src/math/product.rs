//! Products of a matrix with vectors, and sines and cosines of vectors, in wide registers.

use super::lanes8::Eight;
use super::real::Real;
use super::registers::wide;
use nalgebra::{DMatrix, DVector};
use pulp::{Simd, WithSimd};
use std::f64::consts::{FRAC_1_PI, PI};

/// Eight numbers of a column, below each other.
type ColumnLine = [f64; 8];

/// Lines summed side by side: as many as the registers hold for two vectors.
const BLOCK: usize = 4;

/// Matrix whose columns are stored in lines of eight.
#[derive(Debug, Clone)]
pub struct Matrix {
    lines: Vec<ColumnLine>,
    rows: usize,
}

impl Matrix {
    /// Copy of a nalgebra matrix.
    pub fn new(matrix: &DMatrix<f64>) -> Self {
        let mut lines = Vec::with_capacity(matrix.ncols() * matrix.nrows().div_ceil(8));
        for column in matrix.column_iter() {
            for part in column.as_slice().chunks(8) {
                let mut line = [0.0; 8];
                line[..part.len()].copy_from_slice(part);
                lines.push(line);
            }
        }
        Self {
            lines,
            rows: matrix.nrows(),
        }
    }

    /// Products with K vectors of the length of a row.
    pub fn times<const K: usize>(&self, vectors: [&DVector<f64>; K]) -> [DVector<f64>; K] {
        let mut products = std::array::from_fn(|_| DVector::zeros(self.rows));
        let slices = products.each_mut().map(DVector::as_mut_slice);
        self.write_times(vectors.map(DVector::as_slice), slices);
        products
    }

    /// Products with K vectors, written into `products`.
    pub fn write_times<const K: usize>(&self, vectors: [&[f64]; K], products: [&mut [f64]; K]) {
        wide(Times {
            matrix: self,
            vectors,
            products,
        });
    }

    /// Products with all columns of K matrices, all of the same number of columns.
    pub fn times_all<const K: usize>(&self, matrices: [&DMatrix<f64>; K]) -> [DMatrix<f64>; K] {
        let mut products = matrices.map(|matrix| DMatrix::zeros(self.rows, matrix.ncols()));
        for j in 0..matrices.first().map_or(0, |matrix| matrix.ncols()) {
            let each = |matrix: &DMatrix<f64>| j * matrix.nrows()..(j + 1) * matrix.nrows();
            let vectors = matrices.map(|matrix| &matrix.as_slice()[each(matrix)]);
            let columns = products.each_mut().map(|product| {
                let column = each(product);
                &mut product.as_mut_slice()[column]
            });
            self.write_times(vectors, columns);
        }
        products
    }
}

struct Times<'a, const K: usize> {
    matrix: &'a Matrix,
    vectors: [&'a [f64]; K],
    products: [&'a mut [f64]; K],
}

impl<const K: usize> WithSimd for Times<'_, K> {
    type Output = ();

    #[inline(always)]
    fn with_simd<S: Simd>(mut self, simd: S) {
        let each = self.matrix.rows.div_ceil(8);
        let mut first = 0;
        while first + BLOCK <= each {
            self.block::<S, BLOCK>(simd, first, each);
            first += BLOCK;
        }
        while first < each {
            self.block::<S, 1>(simd, first, each);
            first += 1;
        }
    }
}

impl<const K: usize> Times<'_, K> {
    /// Products of L lines from `first` on; `each`: number of lines in a column.
    #[inline(always)]
    fn block<S: Simd, const L: usize>(&mut self, simd: S, first: usize, each: usize) {
        let mut sums = [[Eight::all(simd, 0.0); L]; K];
        for (j, column) in self.matrix.lines.chunks_exact(each).enumerate() {
            for (sums, vector) in sums.iter_mut().zip(&self.vectors) {
                let x = Eight::all(simd, vector[j]);
                for (sum, line) in sums.iter_mut().zip(&column[first..]) {
                    *sum = x.times_plus(Eight::of(simd, *line), *sum);
                }
            }
        }
        for (product, sums) in self.products.iter_mut().zip(sums) {
            let product = &mut product[8 * first..];
            for (part, sum) in product.chunks_mut(8).zip(sums) {
                part.copy_from_slice(&sum.numbers()[..part.len()]);
            }
        }
    }
}

/// Cosines and sines of angles up to 1e9, to rounding of the angle.
pub(crate) fn cosines_and_sines(angles: &DVector<f64>) -> [DVector<f64>; 2] {
    let mut cosines = angles.clone();
    let mut sines = angles.clone();
    wide(AngleSlices {
        cosines: cosines.as_mut_slice(),
        sines: sines.as_mut_slice(),
    });
    [cosines, sines]
}

struct AngleSlices<'a> {
    /// On entry both slices hold the angles.
    cosines: &'a mut [f64],
    sines: &'a mut [f64],
}

/// Excess of pi over its nearest double.
const BEYOND_PI: f64 = 1.224_646_799_147_353_2e-16;

impl WithSimd for AngleSlices<'_> {
    type Output = ();

    #[inline(always)]
    fn with_simd<S: Simd>(self, simd: S) {
        let parts = self.cosines.chunks_mut(8).zip(self.sines.chunks_mut(8));
        for (cosines, sines) in parts {
            let mut angles = [0.0; 8];
            angles[..cosines.len()].copy_from_slice(cosines);
            let angle = Eight::of(simd, angles);
            let turns = (angle * FRAC_1_PI).nearest();
            let rest = turns.times_plus(angle.with(-PI), angle);
            let rest = turns.times_plus(angle.with(-BEYOND_PI), rest);
            let (sin, cos) = rest.sin_cos();
            // -1 after odd half turns.
            let odd = turns - (turns * 0.5).nearest() * 2.0;
            let sign = (odd * odd).times_plus(angle.with(-2.0), angle.with(1.0));
            cosines.copy_from_slice(&(cos * sign).numbers()[..cosines.len()]);
            sines.copy_from_slice(&(sin * sign).numbers()[..sines.len()]);
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Catches a line or a vector left out, and a half turn too many. Reference: single numbers, for sizes with and
    /// without a remainder.
    #[test]
    fn what_is_wide_is_what_is_narrow() {
        let number = |i: usize| ((i * i) as f64 * 0.618_033_988_749_894_9).fract() - 0.5;
        for (rows, columns) in [(3, 5), (8, 8), (40, 40), (37, 21), (120, 119)] {
            let matrix = DMatrix::from_fn(rows, columns, |i, j| number(i * columns + j + 1));
            let x = DVector::from_fn(columns, |i, _| number(i + 3));
            let y = DVector::from_fn(columns, |i, _| number(2 * i + 1));
            let [ax, ay] = Matrix::new(&matrix).times([&x, &y]);
            assert!((&matrix * x - ax).amax() < 1e-14 * columns as f64);
            assert!((&matrix * y - ay).amax() < 1e-14 * columns as f64);
            let many = matrix.transpose();
            let [product] = Matrix::new(&matrix).times_all([&many]);
            assert!((&matrix * many - product).amax() < 1e-14 * columns as f64);
        }
        let angles = DVector::from_fn(53, |i, _| 40.0 * number(i) + 1e-3 * number(7 * i));
        let [cosines, sines] = cosines_and_sines(&angles);
        for (i, angle) in angles.iter().enumerate() {
            assert!((cosines[i] - angle.cos()).abs() < 4e-16, "cos {angle}");
            assert!((sines[i] - angle.sin()).abs() < 4e-16, "sin {angle}");
        }
    }
}
