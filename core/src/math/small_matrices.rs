//! Products of small matrices whose sizes are known to the compiler, written out.
//!
//! nalgebra's operators go through general kernels, column by column. Without full optimisation these are calls. For
//! matrices of this size a call costs more than its products: a fifth of the time of a viscoelastic rod in space went
//! into them. The loops here use plain counters, since iterator adapters are calls there, too.

use nalgebra::{Complex, ComplexField, SMatrix};

/// A real or complex number.
pub trait Scalar: ComplexField<RealField = f64> + Copy {
    /// Number from its real and imaginary parts; a real number ignores the latter.
    fn of(re: f64, im: f64) -> Self;

    /// self + a b.
    fn plus(self, a: Self, b: Self) -> Self;

    /// self + a b with a real a.
    fn plus_scaled(self, a: f64, b: Self) -> Self;
}

impl Scalar for f64 {
    fn of(re: f64, _: f64) -> Self {
        re
    }

    #[inline(always)]
    fn plus(self, a: Self, b: Self) -> Self {
        self + a * b
    }

    #[inline(always)]
    fn plus_scaled(self, a: f64, b: Self) -> Self {
        self + a * b
    }
}

impl Scalar for Complex<f64> {
    fn of(re: f64, im: f64) -> Self {
        Self::new(re, im)
    }

    #[inline(always)]
    fn plus(self, a: Self, b: Self) -> Self {
        Self::new(
            self.re + (a.re * b.re - a.im * b.im),
            self.im + (a.re * b.im + a.im * b.re),
        )
    }

    #[inline(always)]
    fn plus_scaled(self, a: f64, b: Self) -> Self {
        Self::new(self.re + a * b.re, self.im + a * b.im)
    }
}

/// Product a b.
#[inline(always)]
pub fn times<T: Scalar, const R: usize, const K: usize, const C: usize>(
    a: &SMatrix<T, R, K>,
    b: &SMatrix<T, K, C>,
) -> SMatrix<T, R, C> {
    let mut sum = SMatrix::zeros();
    add_times(&mut sum, a, b);
    sum
}

/// Adds a b to `sum`.
#[inline(always)]
pub fn add_times<T: Scalar, const R: usize, const K: usize, const C: usize>(
    sum: &mut SMatrix<T, R, C>,
    a: &SMatrix<T, R, K>,
    b: &SMatrix<T, K, C>,
) {
    let (sum, a, b) = (&mut sum.data.0, &a.data.0, &b.data.0);
    let mut j = 0;
    while j < C {
        let mut k = 0;
        while k < K {
            let mut i = 0;
            while i < R {
                sum[j][i] = sum[j][i].plus(a[k][i], b[j][k]);
                i += 1;
            }
            k += 1;
        }
        j += 1;
    }
}

/// Adds a^T b to `sum`.
#[inline(always)]
pub fn add_transposed_times<T: Scalar, const R: usize, const K: usize, const C: usize>(
    sum: &mut SMatrix<T, R, C>,
    a: &SMatrix<T, K, R>,
    b: &SMatrix<T, K, C>,
) {
    let (sum, a, b) = (&mut sum.data.0, &a.data.0, &b.data.0);
    let mut j = 0;
    while j < C {
        let mut i = 0;
        while i < R {
            let mut k = 0;
            while k < K {
                sum[j][i] = sum[j][i].plus(a[i][k], b[j][k]);
                k += 1;
            }
            i += 1;
        }
        j += 1;
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Catches a wrong order of rows and columns, and a wrong sign in a complex product. Reference: nalgebra.
    #[test]
    fn products_are_those_of_the_matrices() {
        let number = |i: usize, j: usize| {
            let x = (3 * i + 5 * j) as f64;
            Complex::new((1.0 + x).sin(), (2.0 - x).cos())
        };
        let a = SMatrix::<_, 4, 3>::from_fn(number);
        let b = SMatrix::<_, 3, 2>::from_fn(|i, j| number(j + 7, i));
        let c = SMatrix::<_, 4, 2>::from_fn(|i, j| number(i, j + 11));
        assert!((times(&a, &b) - a * b).norm() < 1e-15);
        let mut sum = c;
        add_times(&mut sum, &a, &b);
        assert!((sum - (c + a * b)).norm() < 1e-15);
        let mut sum = b;
        add_transposed_times(&mut sum, &a, &c);
        assert!((sum - (b + a.transpose() * c)).norm() < 1e-15);
        let real = SMatrix::<f64, 4, 3>::from_fn(|i, j| number(i, j).re);
        let across = SMatrix::<f64, 3, 2>::from_fn(|i, j| number(i, j).im);
        assert!((times(&real, &across) - real * across).norm() < 1e-15);
        let (x, z) = (number(1, 2), number(4, 4));
        assert!((z.plus_scaled(0.3, x) - (z + x * 0.3)).norm() < 1e-16);
    }
}
