//! Dense linear algebra of small systems in which singular matrices are the point: elimination with
//! complete pivoting of N x (N + 1), and singular values by one-sided Jacobi rotations.

use crate::math::order::sort_few;
use nalgebra::{DMatrix, DVector, SMatrix, SVector};
use std::ops::{Add, Mul, Sub};

/// A point (or vector) of R^N x R: the unknowns and the parameter.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) struct Place<const N: usize> {
    pub x: SVector<f64, N>,
    pub p: f64,
}

impl<const N: usize> Place<N> {
    pub fn new(x: SVector<f64, N>, p: f64) -> Self {
        Self { x, p }
    }

    /// The unit vector along the parameter.
    pub fn along_p() -> Self {
        Self::new(SVector::zeros(), 1.0)
    }

    pub fn dot(&self, other: &Self) -> f64 {
        self.x.dot(&other.x) + self.p * other.p
    }

    pub fn norm(&self) -> f64 {
        self.dot(self).sqrt()
    }

    /// Of unit length; a zero vector stays as it is.
    pub fn unit(&self) -> Self {
        let norm = self.norm();
        if norm > 0.0 {
            *self * (1.0 / norm)
        } else {
            *self
        }
    }

    /// Itself or its opposite, whichever makes less than a right angle with `reference`.
    pub fn towards(&self, reference: &Self) -> Self {
        if self.dot(reference) < 0.0 {
            *self * -1.0
        } else {
            *self
        }
    }

    pub fn is_finite(&self) -> bool {
        self.x.iter().all(|v| v.is_finite()) && self.p.is_finite()
    }

    pub fn from_slice(values: &[f64]) -> Self {
        Self::new(SVector::from_column_slice(&values[..N]), values[N])
    }
}

impl<const N: usize> Add for Place<N> {
    type Output = Self;
    fn add(self, other: Self) -> Self {
        Self::new(self.x + other.x, self.p + other.p)
    }
}

impl<const N: usize> Sub for Place<N> {
    type Output = Self;
    fn sub(self, other: Self) -> Self {
        Self::new(self.x - other.x, self.p - other.p)
    }
}

impl<const N: usize> Mul<f64> for Place<N> {
    type Output = Self;
    fn mul(self, factor: f64) -> Self {
        Self::new(self.x * factor, self.p * factor)
    }
}

/// [J | b], N x (N + 1), eliminated with complete pivoting: a singular J does no harm as long as the
/// whole has rank N.
pub(crate) struct Elimination<const N: usize> {
    /// Unit lower and upper factors of the pivot columns.
    factors: SMatrix<f64, N, N>,
    /// The eliminated column that no pivot was taken from.
    rest: SVector<f64, N>,
    rows: [usize; N],
    columns: [usize; N],
    free: usize,
    sign: f64,
}

impl<const N: usize> Elimination<N> {
    pub fn new(jacobian: &SMatrix<f64, N, N>, slope: &SVector<f64, N>) -> Self {
        let mut this = Self {
            factors: *jacobian,
            rest: *slope,
            rows: std::array::from_fn(|i| i),
            columns: std::array::from_fn(|i| i),
            free: N,
            sign: 1.0,
        };
        for k in 0..N {
            this.pivot(k);
            let u = &mut this.factors;
            if u[(k, k)] == 0.0 {
                break;
            }
            for i in k + 1..N {
                let factor = u[(i, k)] / u[(k, k)];
                u[(i, k)] = factor;
                for j in k + 1..N {
                    let above = u[(k, j)];
                    u[(i, j)] -= factor * above;
                }
                this.rest[i] -= factor * this.rest[k];
            }
        }
        this
    }

    /// Brings the largest entry of what is left to (k, k).
    fn pivot(&mut self, k: usize) {
        let (mut row, mut column, mut largest) = (k, k, 0.0);
        for i in k..N {
            for j in k..=N {
                let value = if j < N {
                    self.factors[(i, j)]
                } else {
                    self.rest[i]
                };
                if value.abs() > largest {
                    (row, column, largest) = (i, j, value.abs());
                }
            }
        }
        if row != k {
            self.factors.swap_rows(k, row);
            self.rest.swap_rows(k, row);
            self.rows.swap(k, row);
            self.sign = -self.sign;
        }
        if column == N {
            for i in 0..N {
                std::mem::swap(&mut self.factors[(i, k)], &mut self.rest[i]);
            }
            std::mem::swap(&mut self.columns[k], &mut self.free);
            self.sign = -self.sign;
        } else if column != k {
            self.factors.swap_columns(k, column);
            self.columns.swap(k, column);
            self.sign = -self.sign;
        }
    }

    /// U y = right; components without a pivot are zero.
    fn back(&self, mut y: SVector<f64, N>) -> SVector<f64, N> {
        for i in (0..N).rev() {
            for j in i + 1..N {
                y[i] -= self.factors[(i, j)] * y[j];
            }
            let pivot = self.factors[(i, i)];
            y[i] = if pivot == 0.0 { 0.0 } else { y[i] / pivot };
        }
        y
    }

    fn spread(&self, y: &SVector<f64, N>, free: f64) -> Place<N> {
        let mut z = Place::new(SVector::zeros(), 0.0);
        let mut set = |column: usize, value: f64| {
            if column < N {
                z.x[column] = value;
            } else {
                z.p = value;
            }
        };
        for k in 0..N {
            set(self.columns[k], y[k]);
        }
        set(self.free, free);
        z
    }

    /// One solution z of [J | b] z = right (that with the free component zero).
    pub fn solve(&self, right: &SVector<f64, N>) -> Place<N> {
        let mut y = SVector::zeros();
        for i in 0..N {
            y[i] = right[self.rows[i]];
        }
        for i in 0..N {
            for j in 0..i {
                let known = y[j];
                y[i] -= self.factors[(i, j)] * known;
            }
        }
        self.spread(&self.back(y), 0.0)
    }

    /// (n, d): the unit null vector n of [J | b] and the determinant d of [J b; n^T]. The vector
    /// d n is the Cramer product of the rows: smooth, and zero where the rank falls below N.
    pub fn null(&self) -> (Place<N>, f64) {
        let null = self.spread(&self.back(-self.rest), 1.0);
        let pivots: f64 = self.factors.diagonal().iter().product();
        let length = null.norm();
        (null * (1.0 / length), self.sign * pivots * length)
    }

    /// The last pivot over the first: small near a branch point, zero if the rank is below N.
    pub fn regularity(&self) -> f64 {
        let first = self.factors[(0, 0)].abs();
        if first == 0.0 {
            0.0
        } else {
            self.factors[(N - 1, N - 1)].abs() / first
        }
    }
}

/// A = U diag(values) V^T of a matrix with as many rows as columns or fewer.
pub(crate) struct Svd {
    /// rows x rows.
    pub left: DMatrix<f64>,
    /// Falling, as many as A has columns (the last are zero if A is wide).
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
            let column = completed(&left, k, column);
            left.set_column(k, &column);
        }
        Self {
            left,
            values,
            right,
        }
    }
}

/// `column` made orthogonal to the first `k` columns of `basis`; if nothing of it is left (the
/// singular value is zero or rounding), any unit vector orthogonal to them.
fn completed(basis: &DMatrix<f64>, k: usize, column: DVector<f64>) -> DVector<f64> {
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
