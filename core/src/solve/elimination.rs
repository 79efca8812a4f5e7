//! Dense linear algebra near singular matrices: elimination with complete pivoting of N x (N + 1), and singular
//! values by one-sided Jacobi rotations.

use crate::math::small_sort::sort_few;
use nalgebra::{DMatrix, DVector};
use std::ops::{Add, Mul, Sub};

/// A point (or vector) of R^N x R: the unknowns and the parameter.
#[derive(Debug, Clone, PartialEq)]
pub(crate) struct Place {
    pub x: DVector<f64>,
    pub p: f64,
}

impl Place {
    pub fn new(x: DVector<f64>, p: f64) -> Self {
        Self { x, p }
    }

    /// The unit vector along the parameter, with `size` unknowns.
    pub fn along_p(size: usize) -> Self {
        Self::new(DVector::zeros(size), 1.0)
    }

    pub fn dot(&self, other: &Self) -> f64 {
        self.x.dot(&other.x) + self.p * other.p
    }

    pub fn norm(&self) -> f64 {
        self.dot(self).sqrt()
    }

    /// Normalised to unit length; a zero vector stays zero.
    pub fn unit(self) -> Self {
        let norm = self.norm();
        if norm > 0.0 {
            self * (1.0 / norm)
        } else {
            self
        }
    }

    /// The vector or its opposite, whichever is less than a right angle from `reference`.
    pub fn towards(self, reference: &Self) -> Self {
        if self.dot(reference) < 0.0 {
            self * -1.0
        } else {
            self
        }
    }

    pub fn is_finite(&self) -> bool {
        self.x.iter().all(|v| v.is_finite()) && self.p.is_finite()
    }

    /// Unknowns and parameter as one vector.
    pub fn flat(&self) -> DVector<f64> {
        self.x.clone().push(self.p)
    }

    /// Largest component along this vector of errors bounded by `errors`.
    pub fn reach_of(&self, errors: &Self) -> f64 {
        self.x.abs().dot(&errors.x.abs()) + (self.p * errors.p).abs()
    }

    /// A place from a slice: the unknowns, then the parameter.
    pub fn from_slice(values: &[f64]) -> Self {
        let size = values.len() - 1;
        Self::new(DVector::from_column_slice(&values[..size]), values[size])
    }
}

impl Add for Place {
    type Output = Self;
    fn add(self, other: Self) -> Self {
        Self::new(self.x + other.x, self.p + other.p)
    }
}

impl Add<Place> for &Place {
    type Output = Place;
    fn add(self, other: Place) -> Place {
        Place::new(&self.x + other.x, self.p + other.p)
    }
}

impl Sub for &Place {
    type Output = Place;
    fn sub(self, other: Self) -> Place {
        Place::new(&self.x - &other.x, self.p - other.p)
    }
}

impl Sub for Place {
    type Output = Self;
    fn sub(self, other: Self) -> Self {
        Self::new(self.x - other.x, self.p - other.p)
    }
}

impl Mul<f64> for Place {
    type Output = Self;
    fn mul(self, factor: f64) -> Self {
        Self::new(self.x * factor, self.p * factor)
    }
}

impl Mul<f64> for &Place {
    type Output = Place;
    fn mul(self, factor: f64) -> Place {
        Place::new(&self.x * factor, self.p * factor)
    }
}

/// A determinant as value * BLOCK^blocks: with many unknowns it overflows or underflows a double.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Determinant {
    value: f64,
    blocks: i32,
}

/// 2^256: products by it are exact.
const BLOCK: f64 =
    (1_u128 << 64) as f64 * (1_u128 << 64) as f64 * (1_u128 << 64) as f64 * (1_u128 << 64) as f64;

impl Determinant {
    fn grow(&mut self, factor: f64) {
        self.value *= factor;
        if self.value.abs() > BLOCK {
            self.value /= BLOCK;
            self.blocks += 1;
        } else if self.value != 0.0 && self.value.abs() < 1.0 / BLOCK {
            self.value *= BLOCK;
            self.blocks -= 1;
        }
    }

    /// Exponent of BLOCK.
    pub fn blocks(self) -> i32 {
        self.blocks
    }

    /// The determinant over BLOCK^blocks.
    pub fn over(self, blocks: i32) -> f64 {
        self.value * BLOCK.powi(self.blocks - blocks)
    }
}

/// [J | b], N x (N + 1), eliminated with complete pivoting: a singular J does no harm as long as the whole has rank
/// N.
pub(crate) struct Elimination {
    /// Unit lower and upper factors of the pivot columns; the last column is that without a pivot.
    factors: DMatrix<f64>,
    rows: Vec<usize>,
    columns: Vec<usize>,
    sign: f64,
}

impl Elimination {
    pub fn new(jacobian: &DMatrix<f64>, slope: &DVector<f64>) -> Self {
        let n = slope.len();
        let mut factors = DMatrix::zeros(n, n + 1);
        factors.columns_mut(0, n).copy_from(jacobian);
        factors.set_column(n, slope);
        let mut this = Self {
            factors,
            rows: (0..n).collect(),
            columns: (0..=n).collect(),
            sign: 1.0,
        };
        for k in 0..n {
            this.pivot(k);
            let pivot = this.factors[(k, k)];
            if pivot == 0.0 {
                break;
            }
            let (done, rest) = this.factors.as_mut_slice().split_at_mut((k + 1) * n);
            let lower = &mut done[k * n + k + 1..];
            lower.iter_mut().for_each(|x| *x /= pivot);
            for column in rest.chunks_exact_mut(n) {
                let above = column[k];
                for (x, factor) in column[k + 1..].iter_mut().zip(&*lower) {
                    *x -= factor * above;
                }
            }
        }
        this
    }

    /// Brings the largest remaining entry to (k, k); of equal ones that of the first row, and in the row the first.
    fn pivot(&mut self, k: usize) {
        let n = self.rows.len();
        let (mut row, mut column, mut largest) = (k, k, 0.0);
        for (j, values) in self.factors.as_slice().chunks_exact(n).enumerate().skip(k) {
            for (i, value) in values.iter().enumerate().skip(k) {
                let value = value.abs();
                if value > largest || value == largest && i < row {
                    (row, column, largest) = (i, j, value);
                }
            }
        }
        if row != k {
            self.factors.swap_rows(k, row);
            self.rows.swap(k, row);
            self.sign = -self.sign;
        }
        if column != k {
            self.factors.swap_columns(k, column);
            self.columns.swap(k, column);
            self.sign = -self.sign;
        }
    }

    /// U y = right; components without a pivot are zero.
    fn back_substitute(&self, mut y: DVector<f64>) -> DVector<f64> {
        let n = y.len();
        for i in (0..n).rev() {
            for j in i + 1..n {
                y[i] -= self.factors[(i, j)] * y[j];
            }
            let pivot = self.factors[(i, i)];
            y[i] = if pivot == 0.0 { 0.0 } else { y[i] / pivot };
        }
        y
    }

    fn spread(&self, y: &DVector<f64>, free: f64) -> Place {
        let n = y.len();
        let mut z = Place::new(DVector::zeros(n), 0.0);
        let values = y.iter().chain(std::iter::once(&free));
        for (&column, value) in self.columns.iter().zip(values) {
            if column < n {
                z.x[column] = *value
            } else {
                z.p = *value
            }
        }
        z
    }

    /// A solution z of [J | b] z = right: the one with the free component zero.
    pub fn solve(&self, right: &DVector<f64>) -> Place {
        let n = right.len();
        let mut y = DVector::from_iterator(n, self.rows.iter().map(|&row| right[row]));
        for i in 0..n {
            for j in 0..i {
                let known = y[j];
                y[i] -= self.factors[(i, j)] * known;
            }
        }
        self.spread(&self.back_substitute(y), 0.0)
    }

    /// (n, d): the unit null vector n of [J | b] and the determinant d of [J b; n^T]. The vector d n is the Cramer
    /// product of the rows: smooth, and zero where the rank is below N.
    pub fn null(&self) -> (Place, Determinant) {
        let n = self.rows.len();
        let null = self.spread(&self.back_substitute(-self.factors.column(n)), 1.0);
        let mut determinant = Determinant {
            value: self.sign,
            blocks: 0,
        };
        let length = null.norm();
        for pivot in self.pivots().chain([length]) {
            determinant.grow(pivot);
        }
        (null * (1.0 / length), determinant)
    }

    /// The last pivot over the first: small near a branch point, zero if the rank is below N.
    pub fn regularity(&self) -> f64 {
        let (first, last) = (self.pivots().next(), self.pivots().last());
        match (first, last) {
            (Some(first), Some(last)) if first != 0.0 => (last / first).abs(),
            _ => 0.0,
        }
    }

    fn pivots(&self) -> impl Iterator<Item = f64> {
        (0..self.rows.len()).map(|k| self.factors[(k, k)])
    }
}

/// A = U diag(values) V^T of a matrix that is square or has fewer rows than columns.
pub(crate) struct Svd {
    /// rows x rows.
    pub left: DMatrix<f64>,
    /// Singular values in falling order, as many as A has columns (the last are zero if A is wide).
    pub values: DVector<f64>,
    /// columns x columns, a complete basis: the last columns span the kernel.
    pub right: DMatrix<f64>,
}

impl Svd {
    /// One-sided Jacobi: small singular values come with small relative errors.
    pub fn new(a: &DMatrix<f64>) -> Self {
        let (rows, n) = a.shape();
        let (mut b, mut v) = (a.clone(), DMatrix::identity(n, n));
        for _ in 0..40 {
            let mut turned = false;
            for i in 0..n {
                for j in i + 1..n {
                    let (ii, jj) = (b.column(i).norm_squared(), b.column(j).norm_squared());
                    let ij = b.column(i).dot(&b.column(j));
                    if ij == 0.0 || ij.abs() <= 1e-16 * (ii * jj).sqrt() {
                        continue;
                    }
                    let zeta = (jj - ii) / (2.0 * ij);
                    let t = zeta.signum() / (zeta.abs() + zeta.hypot(1.0));
                    if t.abs() < 1e-17 {
                        continue;
                    }
                    turned = true;
                    let c = 1.0 / t.hypot(1.0);
                    for m in [&mut b, &mut v] {
                        for k in 0..m.nrows() {
                            let (p, q) = (m[(k, i)], m[(k, j)]);
                            m[(k, i)] = c * (p - t * q);
                            m[(k, j)] = c * (q + t * p);
                        }
                    }
                }
            }
            if !turned {
                break;
            }
        }
        let norms: Vec<f64> = (0..n).map(|j| b.column(j).norm()).collect();
        let mut order: Vec<usize> = (0..n).collect();
        sort_few(&mut order, |j| -norms[*j]);
        let values = DVector::from_iterator(n, order.iter().map(|&j| norms[j]));
        let right = DMatrix::from_fn(n, n, |i, j| v[(i, order[j])]);
        let mut left = DMatrix::zeros(rows, rows);
        for k in 0..rows {
            let column = b.column(order[k]) / norms[order[k]];
            let column = orthogonal_column(&left, k, column);
            left.set_column(k, &column);
        }
        Self {
            left,
            values,
            right,
        }
    }
}

/// `column` made orthogonal to the first `k` columns of `basis`; if nothing remains (the singular value is zero or
/// rounding), any unit vector orthogonal to these columns.
fn orthogonal_column(basis: &DMatrix<f64>, k: usize, column: DVector<f64>) -> DVector<f64> {
    let rows = basis.nrows();
    let units = (0..rows).map(|i| DVector::from_fn(rows, |r, _| f64::from(u8::from(r == i))));
    let mut best = DVector::zeros(rows);
    for (trial, mut v) in std::iter::once(column).chain(units).enumerate() {
        if !v.iter().all(|x| x.is_finite()) {
            continue;
        }
        for _ in 0..2 {
            for j in 0..k {
                let along = basis.column(j).dot(&v);
                v -= basis.column(j) * along;
            }
        }
        let left = v.norm();
        if left > best.norm() {
            best = v;
        }
        if trial == 0 && left > 0.5 {
            break;
        }
    }
    let norm = best.norm();
    best / norm
}
