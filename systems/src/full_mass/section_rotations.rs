//! Rotation rates of a rod's sections in space, exact for the rotations by collocation.
//!
//! The quaternions at the nodes solve p_i = p_0 + sum_j A_ij p_j o u_j/2, of any norm, and R = R(p). With x = R u_t
//! the rates in the world, and g the solution of g_im = A_im + sum_j A_ij g_jm o u_j/2,
//! ```text
//! S(f)_i = sum_j f_j o q_ij,   q_ij = p_j o g_ij o p_i^-1,
//! y = p_t p^-1 = S(x)/2,       z = p_tt p^-1 = S(2 y x + R u_tt)/2,
//! omega = 2 Im y,          omega_t = 2 Im (z - y^2),
//! ```
//! R_t = omega x R therefore holds at the nodes at any resolution: the energy of the discrete rod is conserved, and
//! ends do not drift from their attachments. If the nodes resolve the rotations, q_ij is A_ij, and omega = A (R u_t).
//! A change du of the strains turns p by eta = S(R du)/2.

use super::frames::Triple;
use crate::math::product::Matrix;
use crate::math::se3::{Turn, conjugate, product};
use nalgebra::{DMatrix, Matrix3, Matrix4, Vector3};

/// Four components of a quaternion at sections (rows) for changes of the strains (columns).
pub type Quads = [DMatrix<f64>; 4];

/// (f o q)_k = sum_l SIGN_kl q_PART_kl f_l.
const PART: [[usize; 4]; 4] = [[0, 1, 2, 3], [1, 0, 3, 2], [2, 3, 0, 1], [3, 2, 1, 0]];
const SIGN: [[f64; 4]; 4] = [
    [1.0, -1.0, -1.0, -1.0],
    [1.0, 1.0, 1.0, -1.0],
    [1.0, -1.0, 1.0, 1.0],
    [1.0, 1.0, -1.0, 1.0],
];

/// The sums S of a shape, from the rates at the nodes.
#[derive(Debug, Clone)]
pub struct Spins {
    /// q; rows are sections, the last of them the end.
    q: Quads,
}

/// A column of [`Quads`] that rotates a single node: column number, node, axis in the world.
#[derive(Debug, Clone, Copy)]
pub struct NodeRotation {
    pub column: usize,
    pub node: usize,
    pub axis: Vector3<f64>,
}

/// The quaternions of a motion.
pub struct Spun<'a> {
    /// Vectors R u_t and R u_tt at the nodes.
    pub bends: &'a [Vector3<f64>],
    pub faster: &'a [Vector3<f64>],
    /// y and z.
    pub y: &'a [Turn],
    pub z: &'a [Turn],
    /// Angular velocity of the base.
    pub base: Vector3<f64>,
}

/// A vector as a quaternion.
pub fn pure(v: &Vector3<f64>) -> Turn {
    Turn::new(0.0, v.x, v.y, v.z)
}

/// Twice the vector of a quaternion.
pub fn twice(p: &Turn) -> Vector3<f64> {
    Vector3::new(p[1], p[2], p[3]) * 2.0
}

/// f -> a o f.
fn left(a: &Turn) -> Matrix4<f64> {
    let [w, x, y, z] = [a[0], a[1], a[2], a[3]];
    #[rustfmt::skip]
    let matrix = Matrix4::new(
        w, -x, -y, -z,
        x,  w, -z,  y,
        y,  z,  w, -x,
        z, -y,  x,  w,
    );
    matrix
}

/// f -> f o a.
fn right(a: &Turn) -> Matrix4<f64> {
    Matrix4::from_fn(|k, l| SIGN[k][l] * a[PART[k][l]])
}

fn blank(rows: usize, columns: usize) -> Quads {
    std::array::from_fn(|_| DMatrix::zeros(rows, columns))
}

fn entry(x: &Quads, row: usize, column: usize) -> Turn {
    Turn::from_fn(|k, _| x[k][(row, column)])
}

fn add(x: &mut Quads, row: usize, column: usize, value: &Turn) {
    for (x, value) in x.iter_mut().zip(value.iter()) {
        x[(row, column)] += value;
    }
}

/// Product of each section's matrix with the quaternions of the first `rows` sections.
fn local(x: &Quads, rows: usize, matrix: impl Fn(usize) -> Matrix4<f64>) -> Quads {
    let matrices: Vec<_> = (0..rows).map(matrix).collect();
    products(&matrices, x)
}

/// Product of each section's matrix with the quaternions of `x` at the section, column by column.
#[inline(never)]
fn products(matrices: &[Matrix4<f64>], x: &Quads) -> Quads {
    let mut out = blank(matrices.len(), x[0].ncols());
    for column in 0..x[0].ncols() {
        for (row, m) in matrices.iter().enumerate() {
            let value = m * entry(x, row, column);
            add(&mut out, row, column, &value);
        }
    }
    out
}

fn subtract(x: &mut Quads, y: &Quads) {
    for (x, y) in x.iter_mut().zip(y) {
        *x -= y;
    }
}

/// Twice the vector parts.
fn vectors(x: &Quads) -> Triple {
    [1, 2, 3].map(|k| &x[k] * 2.0)
}

impl Spins {
    /// The sums S for curvatures `u` along the directors, of a rod with base directors `base`; `up` leads to the
    /// nodes and to the end. None if the collocation has no solution.
    pub fn new(up: &DMatrix<f64>, u: &[Vector3<f64>], base: &Matrix3<f64>) -> Option<Self> {
        let n = u.len();
        let halves: Vec<Matrix4<f64>> = u.iter().map(|u| right(&(pure(u) * 0.5))).collect();
        let mut matrix = DMatrix::identity(4 * n, 4 * n);
        for (j, half) in halves.iter().enumerate() {
            for i in 0..n {
                let mut block = matrix.fixed_view_mut::<4, 4>(4 * i, 4 * j);
                block -= half * up[(i, j)];
            }
        }
        // Columns of g, and p.
        let mut found = DMatrix::zeros(4 * n, n + 1);
        for i in 0..n {
            for m in 0..n {
                found[(4 * i, m)] = up[(i, m)];
            }
            found[(4 * i, n)] = 1.0;
        }
        if !matrix.lu().solve_mut(&mut found) {
            return None;
        }
        let at = |i: usize, m: usize| -> Turn {
            if i < n {
                return found.fixed_view::<4, 1>(4 * i, m).into_owned();
            }
            let first = if m < n { up[(n, m)] } else { 1.0 };
            let start = Turn::new(first, 0.0, 0.0, 0.0);
            halves.iter().enumerate().fold(start, |sum, (j, half)| {
                sum + half * found.fixed_view::<4, 1>(4 * j, m) * up[(n, j)]
            })
        };
        let p: Vec<Turn> = (0..n).map(|i| at(i, n)).collect();
        let mut q = blank(n + 1, n);
        for i in 0..=n {
            let here = at(i, n);
            let back = conjugate(&here) / here.norm_squared();
            for (m, p) in p.iter().enumerate() {
                let part = product(&product(p, &at(i, m)), &back);
                let along = base * Vector3::new(part[1], part[2], part[3]);
                add(
                    &mut q,
                    i,
                    m,
                    &(pure(&along) + Turn::new(part[0], 0.0, 0.0, 0.0)),
                );
            }
        }
        q.iter()
            .all(|q| q.iter().all(|x| x.is_finite()))
            .then_some(Self { q })
    }

    /// S(f)/2.
    pub fn halved(&self, f: impl Fn(usize) -> Turn) -> Vec<Turn> {
        let (rows, n) = self.q[0].shape();
        let mut out = vec![Turn::zeros(); rows];
        for j in 0..n {
            let f = left(&(f(j) * 0.5));
            for (i, out) in out.iter_mut().enumerate() {
                *out += f * entry(&self.q, i, j);
            }
        }
        out
    }

    /// sum_i a_i o q_ij*, of vectors at the sections: the vector part is dual to a rotation of node j.
    pub fn gathered(&self, a: &[Vector3<f64>]) -> Vec<Turn> {
        let n = self.q[0].ncols();
        let sum = |j: usize| {
            let each = a.iter().enumerate();
            each.fold(Turn::zeros(), |sum, (i, a)| {
                sum + left(&pure(a)) * conjugate(&entry(&self.q, i, j))
            })
        };
        (0..n).map(sum).collect()
    }

    /// Vector parts of [`Spins::gathered`] for each column, of as many sections as there are rows.
    pub fn gathered_all(&self, a: &Triple) -> Triple {
        let rows = a[0].nrows();
        [1, 2, 3].map(|k| {
            let mut sum = DMatrix::zeros(self.q[0].ncols(), a[0].ncols());
            for l in 1..4 {
                let q = self.q[PART[l][k]].rows(0, rows).transpose();
                let [product] = Matrix::new(&q).times_all([&a[l - 1]]);
                sum += product * SIGN[l][k];
            }
            sum
        })
    }

    /// S(f)/2 for each column.
    fn halved_all(&self, f: &Quads) -> Quads {
        std::array::from_fn(|k| {
            let mut sum = DMatrix::zeros(self.q[0].nrows(), f[0].ncols());
            for l in 0..4 {
                sum.gemm(0.5 * SIGN[k][l], &self.q[PART[k][l]], &f[l], 1.0);
            }
            sum
        })
    }

    /// eta: rotations of the sections by these changes of the strains, and by rotations of the base about the three
    /// axes from column `base` on.
    pub fn turned(&self, own: &[NodeRotation], base: Option<usize>, columns: usize) -> Quads {
        let rows = self.q[0].nrows();
        let mut eta = blank(rows, columns);
        for NodeRotation { column, node, axis } in own {
            let axis = left(&(pure(axis) * 0.5));
            for i in 0..rows {
                add(&mut eta, i, *column, &(axis * entry(&self.q, i, *node)));
            }
        }
        if let Some(base) = base {
            for k in 0..3 {
                eta[1 + k].column_mut(base + k).fill(0.5);
            }
        }
        eta
    }

    /// Derivatives of omega and omega_t by the strains, and of omega_t by the rates; columns of the base rotate and
    /// spin it.
    pub fn carried(
        &self,
        eta: &Quads,
        own: &[NodeRotation],
        base: Option<usize>,
        at: &Spun,
    ) -> [Triple; 3] {
        let (rows, n) = self.q[0].shape();
        // A rigid rotation carries the vectors along.
        let rigid = |x: &mut Quads, by: &[Turn]| {
            let Some(base) = base else { return };
            for column in base..base + 3 {
                for (row, by) in by.iter().enumerate() {
                    let value = product(&entry(eta, row, column), by);
                    for (x, value) in x.iter_mut().zip(value.iter()) {
                        x[(row, column)] = *value;
                    }
                }
            }
        };
        let sums = |mut f: Quads, of: &dyn Fn(usize) -> Turn| {
            for NodeRotation { column, node, axis } in own {
                add(&mut f, *node, *column, &product(&of(*node), &pure(axis)));
            }
            self.halved_all(&f)
        };
        let x = |j: usize| pure(&at.bends[j]);
        let mut kappa = sums(local(eta, n, |j| right(&x(j))), &|j| at.y[j]);
        rigid(&mut kappa, at.y);
        let mut dy = kappa.clone();
        subtract(&mut dy, &local(eta, rows, |i| left(&at.y[i])));

        let mut pushed = local(&kappa, n, |j| right(&(x(j) * 2.0)));
        subtract(
            &mut pushed,
            &local(eta, n, |j| right(&-pure(&at.faster[j]))),
        );
        let mut dz = sums(pushed, &|j| at.z[j]);
        rigid(&mut dz, at.z);
        subtract(&mut dz, &local(eta, rows, |i| left(&at.z[i])));
        subtract(
            &mut dz,
            &local(&dy, rows, |i| left(&at.y[i]) + right(&at.y[i])),
        );

        let mut by_rate = sums(local(eta, n, |j| right(&(x(j) * 2.0))), &|j| at.y[j] * 2.0);
        subtract(
            &mut by_rate,
            &local(eta, rows, |i| left(&at.y[i]) + right(&at.y[i])),
        );
        // Rotation of the base adds to the rates relative to the base.
        let led = |mut out: Triple, by: &Quads| {
            let cross = at.base.cross_matrix();
            for column in 0..out[0].ncols() {
                for row in 0..rows {
                    let led = cross * twice(&entry(by, row, column));
                    for (out, led) in out.iter_mut().zip(led.iter()) {
                        out[(row, column)] += led;
                    }
                }
            }
            out
        };
        let d_alpha = led(vectors(&dz), &dy);
        let mut alpha_by_rate = led(vectors(&by_rate), eta);
        if let Some(base) = base {
            for column in base..base + 3 {
                for row in 0..rows {
                    let spun = twice(&entry(eta, row, column)).cross(&twice(&at.y[row]));
                    for (out, spun) in alpha_by_rate.iter_mut().zip(spun.iter()) {
                        out[(row, column)] = *spun;
                    }
                }
            }
        }
        [vectors(&dy), d_alpha, alpha_by_rate]
    }

    /// Derivative of the work of couples on the rotations by `own`, by all strains and the rotation of the base. Rows
    /// are numbered as `own`; the couples are those on the sections, and `gathered` their [`Spins::gathered`].
    pub fn bent(
        &self,
        eta: &Quads,
        own: &[NodeRotation],
        base: Option<usize>,
        couples: &[Vector3<f64>],
        gathered: &[Turn],
    ) -> DMatrix<f64> {
        let rows = self.q[0].nrows();
        let columns = eta[0].ncols();
        // -couple . 2 Im (eta_a eta_b), and for a rotation of the base couple . 2 Im (eta_b eta_a - eta_a eta_b).
        let mut w = blank(rows, columns);
        for column in 0..columns {
            let turns = base.is_some_and(|base| (base..base + 3).contains(&column));
            for (row, couple) in couples.iter().enumerate() {
                let back = conjugate(&entry(eta, row, column));
                let mut value = product(&pure(couple), &back) * -2.0;
                if turns {
                    value += product(&back, &pure(couple)) * 2.0;
                }
                add(&mut w, row, column, &value);
            }
        }
        let mut all = DMatrix::zeros(columns, columns);
        for (eta, w) in eta.iter().zip(&w) {
            let [product] = Matrix::new(&eta.transpose()).times_all([w]);
            all += product;
        }
        let mut out = DMatrix::zeros(own.len(), columns);
        for (a, row) in own.iter().enumerate() {
            out.row_mut(a).copy_from(&all.row(row.column));
        }
        for (a, NodeRotation { node, axis, .. }) in own.iter().enumerate() {
            let weight = -product(&gathered[*node], &pure(axis));
            for (b, other) in own.iter().enumerate() {
                let part = weight.dot(&entry(eta, *node, other.column));
                out[(a, other.column)] += part;
                out[(b, own[a].column)] += part;
            }
        }
        out
    }
}
