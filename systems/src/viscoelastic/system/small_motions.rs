//! Eigenvalues of small motions of a body on a viscoelastic rod about an equilibrium.
//!
//! About an equilibrium e*, w* with V = 0 small changes obey, with the terms of
//! [`Linear`](crate::viscoelastic::reduced::Linear),
//! ```text
//! e_t = drift e + sum_k relaxing_k z_k + push w,     z_t = (e - z)/tau_k,     gather e_t = V,
//! M V_t = M (by_pose gather e + by_velocity V) - w,
//! ```
//! in which the friction of the section is its derivative at rest. G = gather push eliminates the wrench w. In a
//! direction in which no wrench moves the end (a straight inextensible rod, along itself), V = 0. That row of the
//! balance only determines w.
//!
//! In Laplace form the strains give w = K(s) gather e, with K(s) the dynamic stiffness of the rod. The eigenvalues
//! are the roots of det(M s^2 + C s + K(s)) = 0. If friction is tau times the tangent and the rod is straight and
//! unloaded, K(s) = (1 + tau s) K.

use super::ViscousLinear;
use crate::spectrum::eigenvalues;
use crate::viscoelastic::reduced::{Drift, loose};
use nalgebra::{Complex, DMatrix, DVector, SMatrix};

/// Imaginary part, relative to the eigenvalue, below which the eigenvalue is a multiple real one with rounding.
const REAL: f64 = 1e-6;
/// Relative size from which a new direction of the Krylov space counts.
const REACHED: f64 = 1e-11;

/// Eigenvalues s of small motions exp(s t).
#[derive(Debug, Clone, PartialEq)]
pub struct Rates {
    /// Eigenvalues of the body on the rod: two for each direction in which the end moves, or more if memory lets more
    /// motions oscillate. Oscillations with Im s > 0 appear once. Sorted by imaginary, then real part.
    pub body: Vec<Complex<f64>>,
    /// Least and greatest real part of the eigenvalues of the rod with its end held, among those that end wrenches
    /// excite. None if the end has no memory; otherwise the number of eigenvalues grows with the grid.
    pub held: Option<[f64; 2]>,
    /// Number of overdamped rates between these two. There body and rod move as one, and no rate belongs to the body
    /// alone.
    pub among: usize,
}

impl<const M: usize, const D: usize> ViscousLinear<M, D> {
    /// Eigenvalues about an equilibrium; `weights` are those of the nodes. None without convergence.
    pub fn rates(&self, weights: &[f64]) -> Option<Rates> {
        let (rod, n) = (&self.rod, self.layout.field());
        let Drift::Whole(drift) = &rod.drift else {
            return None;
        };
        let strains = n * (1 + self.relaxing.len());
        let mut rate = DMatrix::zeros(strains, strains);
        rate.view_mut((0, 0), (n, n)).copy_from(drift);
        for (k, (blocks, time)) in self.relaxing.iter().enumerate() {
            let first = (k + 1) * n;
            for (node, block) in blocks.iter().enumerate() {
                rate.fixed_view_mut::<M, M>(node * M, first + node * M)
                    .copy_from(block);
            }
            for j in 0..n {
                rate[(first + j, j)] = 1.0 / time;
                rate[(first + j, first + j)] = -1.0 / time;
            }
        }
        let matrix =
            |fixed: &SMatrix<f64, D, D>| DMatrix::from_column_slice(D, D, fixed.as_slice());
        let still: Vec<usize> = loose(&self.mobility).collect();
        let motion = SmallMotion {
            rate,
            push: &rod.push,
            gather: &rod.gather,
            convection: &rod.convection,
            roots: (0..strains).map(|i| weights[i % n / M].sqrt()).collect(),
            free: (0..D).filter(|i| !still.contains(i)).collect(),
            mass: matrix(&self.body.by_wrench.try_inverse()?),
            by_pose: matrix(&self.body.by_pose),
            by_velocity: matrix(&self.body.by_velocity),
        };
        motion.rates()
    }
}

/// Linearised equations of strains, memory and body, with matrix sizes known only at run time.
struct SmallMotion<'a> {
    /// (e, z_1, ..)_t without the wrench.
    rate: DMatrix<f64>,
    /// Matrices from the wrench to e_t, from strains to the place of the end, and to its velocity at fixed rates.
    push: &'a DMatrix<f64>,
    gather: &'a DMatrix<f64>,
    convection: &'a DMatrix<f64>,
    /// Square roots of the weights of (e, z).
    roots: Vec<f64>,
    /// Directions in which the end moves.
    free: Vec<usize>,
    /// M, and derivatives of the acceleration by pose and velocity.
    mass: DMatrix<f64>,
    by_pose: DMatrix<f64>,
    by_velocity: DMatrix<f64>,
}

impl SmallMotion<'_> {
    /// The full pencil has the eigenvalues of the body and, slightly changed, those of the rod with its end held.
    /// Each of the latter is paired with the nearest real one of the full pencil; the unpaired ones are the body's.
    fn rates(self) -> Option<Rates> {
        let moving = self.free.len();
        let matrix = self.first_order()?;
        let inner = matrix.nrows() - moving;
        let held = matrix.view((0, 0), (inner, inner)).into_owned();
        let mut held = eigenvalues(held)?;
        // With V = 0 the place of the end is constant: one zero eigenvalue per direction of motion.
        held.sort_by(|a, b| a.norm().total_cmp(&b.norm()));
        let mut held: Vec<f64> = held.iter().skip(moving).map(|s| s.re).collect();
        held.sort_by(f64::total_cmp);
        let all = eigenvalues(matrix)?;
        let oscillates = |s: &Complex<f64>| s.im.abs() > REAL * s.norm();
        let mut body: Vec<_> = all.iter().copied().filter(oscillates).collect();
        let real = all.iter().filter(|s| !oscillates(s)).map(|s| s.re);
        let mut real: Vec<f64> = real.collect();
        real.sort_by(f64::total_cmp);
        body.retain(|s| s.im > 0.0);
        let left = unpaired(&real, &held);
        let held = held.first().zip(held.last()).map(|(a, b)| [*a, *b]);
        let is_among = |s: &f64| held.is_some_and(|[a, b]| a <= *s && *s <= b);
        let (among, own): (Vec<f64>, Vec<f64>) = left.into_iter().partition(is_among);
        body.extend(own.into_iter().map(Complex::from));
        crate::math::small_sort::sort_eigenvalues(&mut body);
        Some(Rates {
            body,
            held,
            among: among.len(),
        })
    }

    /// The matrix of (e, z_1, ..; V) without the held directions, with the strains in a basis of those that end
    /// wrenches can excite.
    fn first_order(self) -> Option<DMatrix<f64>> {
        let Self {
            mut rate,
            roots,
            free,
            mass,
            ..
        } = self;
        let (n, strains, moving) = (self.push.nrows(), rate.nrows(), free.len());
        let mut push = DMatrix::zeros(strains, moving);
        push.rows_mut(0, n)
            .copy_from(&self.push.select_columns(&free));
        let mut gather = DMatrix::zeros(self.gather.nrows(), strains);
        gather.columns_mut(0, n).copy_from(self.gather);
        let mut convection = DMatrix::zeros(self.gather.nrows(), strains);
        convection.columns_mut(0, n).copy_from(self.convection);
        // Scaled by the roots of the weights, in which symmetric laws become symmetric matrices.
        for (i, root) in roots.iter().enumerate() {
            rate.row_mut(i).scale_mut(*root);
            push.row_mut(i).scale_mut(*root);
        }
        for (j, root) in roots.iter().enumerate() {
            rate.column_mut(j).unscale_mut(*root);
            gather.column_mut(j).unscale_mut(*root);
            convection.column_mut(j).unscale_mut(*root);
        }
        let basis = reached(&rate, &push);
        let inner = basis.ncols();
        let rate = basis.transpose() * rate * &basis;
        let push = basis.transpose() * push;
        let gather = gather * &basis;
        let moved = gather.select_rows(&free);
        let convection = (convection * &basis).select_rows(&free);
        // gather (rate + push w) + convection = V.
        let mut missing = DMatrix::zeros(moving, inner + moving);
        missing
            .columns_mut(0, inner)
            .copy_from(&-(&moved * &rate + convection));
        missing
            .columns_mut(inner, moving)
            .copy_from(&DMatrix::identity(moving, moving));
        let wrench = (moved * &push).lu().solve(&missing)?;
        let mut matrix = DMatrix::zeros(inner + moving, inner + moving);
        matrix.view_mut((0, 0), (inner, inner)).copy_from(&rate);
        let mut strained = matrix.rows_mut(0, inner);
        strained += push * &wrench;
        // M V_t of the free directions; the other rows give the wrench there.
        let pose = &mass * self.by_pose * gather;
        let drag = &mass * self.by_velocity;
        let mut balance = -wrench;
        for (i, &row) in free.iter().enumerate() {
            for j in 0..inner {
                balance[(i, j)] += pose[(row, j)];
            }
            for (j, &column) in free.iter().enumerate() {
                balance[(i, inner + j)] += drag[(row, column)];
            }
        }
        let mass = DMatrix::from_fn(moving, moving, |i, j| mass[(free[i], free[j])]);
        let acceleration = mass.lu().solve(&balance)?;
        matrix.rows_mut(inner, moving).copy_from(&acceleration);
        matrix.iter().all(|x| x.is_finite()).then_some(matrix)
    }
}

/// Orthonormal basis of the Krylov space: the smallest that holds the columns of `push` and that `rate` maps into
/// itself. The complement relaxes by itself, at rates of possibly high multiplicity, and moves no end.
fn reached(rate: &DMatrix<f64>, push: &DMatrix<f64>) -> DMatrix<f64> {
    let mut basis: Vec<DVector<f64>> = Vec::new();
    let add = |basis: &mut Vec<DVector<f64>>, mut x: DVector<f64>| {
        let size = x.norm();
        // Two passes of orthogonalisation suffice.
        for _ in 0..2 {
            for q in basis.iter() {
                let part = q.dot(&x);
                x.axpy(-part, q, 1.0);
            }
        }
        let left = x.norm();
        if left > REACHED * size && basis.len() < rate.nrows() {
            basis.push(x / left);
        }
    };
    for column in push.column_iter() {
        add(&mut basis, column.into_owned());
    }
    let mut next = 0;
    while next < basis.len() {
        let image = rate * &basis[next];
        add(&mut basis, image);
        next += 1;
    }
    if basis.is_empty() {
        DMatrix::zeros(rate.nrows(), 0)
    } else {
        DMatrix::from_columns(&basis)
    }
}

/// Members of `all` left over when each of `some` is paired with one of them, in order, with the least sum of
/// relative distances. Both ascend.
fn unpaired(all: &[f64], some: &[f64]) -> Vec<f64> {
    let (rows, columns) = (some.len(), all.len());
    if rows > columns {
        return Vec::new();
    }
    let apart = |i: usize, j: usize| {
        let size = some[i].abs() + all[j].abs();
        if size > 0.0 {
            (some[i] - all[j]).abs() / size
        } else {
            0.0
        }
    };
    // cost[i][j]: the first i of `some` among the first j of `all`.
    let mut cost = DMatrix::from_element(rows + 1, columns + 1, f64::INFINITY);
    cost.row_mut(0).fill(0.0);
    for i in 1..=rows {
        for j in i..=columns {
            cost[(i, j)] = cost[(i, j - 1)].min(cost[(i - 1, j - 1)] + apart(i - 1, j - 1));
        }
    }
    let mut left = Vec::new();
    let (mut i, mut j) = (rows, columns);
    while j > 0 {
        if i > 0 && cost[(i, j)] < cost[(i, j - 1)] {
            i -= 1;
        } else {
            left.push(all[j - 1]);
        }
        j -= 1;
    }
    left
}
