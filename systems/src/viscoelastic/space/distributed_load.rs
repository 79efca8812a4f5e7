//! A dead load along a rod in space.
//!
//! Beyond a section the load has the force N = int_s^1 f and the couple c = int_s^1 (r(x) - r(s)) x f dx about the
//! section. The local resultants are g = R^T (c, N). With b = weight - A, in sums over the nodes k beyond node i,
//! ```text
//! dg_i = R_i^T (c_i x phi_i + dc_i, N_i x phi_i),       dc_i = sum_k b_ik (dr_k - dr_i) x f_k,
//! dr_k = sum_j A_kj (R_j du_j x (r_k - r_j) + R_j dv_j).
//! ```

use super::{FramedCurve, beyond, column, free_v};
use crate::viscoelastic::grid::Grid;
use crate::viscoelastic::kinematics::{Borne, Local};
use nalgebra::{DMatrix, Matrix3, SVector, Vector3};

/// (c, N) at the nodes.
pub(super) fn resultants(
    grid: &Grid,
    curve: &FramedCurve,
    force: &[Vector3<f64>],
) -> Vec<[Vector3<f64>; 2]> {
    let moments = curve.positions.iter().zip(force);
    let mut sums: Vec<SVector<f64, 6>> = moments
        .map(|(r, f)| {
            let m = r.cross(f);
            SVector::from([m.x, m.y, m.z, f.x, f.y, f.z])
        })
        .collect();
    beyond(grid, &mut sums);
    let nodes = sums.iter().zip(grid.weights()).zip(&curve.positions);
    let each = nodes.map(|((sum, weight), r)| {
        let n = sum.fixed_rows::<3>(3) / *weight;
        [sum.fixed_rows::<3>(0) / *weight - r.cross(&n), n]
    });
    each.collect()
}

/// The local resultants of the free strains from (c, N) at the nodes.
pub(super) fn local<const M: usize>(
    curve: &FramedCurve,
    resultants: &[[Vector3<f64>; 2]],
) -> Vec<Local<M>> {
    let nodes = resultants.iter().zip(&curve.directors);
    let local = nodes.map(|([c, n], directors)| {
        let mut g = Local::<M>::zeros();
        g.fixed_rows_mut::<3>(0).copy_from(&directors.tr_mul(c));
        for k in free_v(M) {
            g[k + M - 3] = directors.column(k).dot(n);
        }
        g
    });
    local.collect()
}

/// The local resultants of the load, and its potential.
pub(super) fn borne<const M: usize>(
    grid: &Grid,
    curve: &FramedCurve,
    force: &[Vector3<f64>],
) -> Borne<M> {
    let works = force.iter().zip(&curve.positions).zip(grid.weights());
    Borne {
        resultants: local(curve, &resultants(grid, curve, force)),
        potential: -works.map(|((f, r), weight)| weight * f.dot(r)).sum::<f64>(),
    }
}

/// The matrices A and b = weight - A.
pub(super) fn sums(grid: &Grid) -> (DMatrix<f64>, DMatrix<f64>) {
    let (n, inner) = (grid.len(), grid.integration());
    let outer = DMatrix::from_fn(n, n, |i, k| grid.weights()[k] - inner[(i, k)]);
    (inner, outer)
}

/// sum_k b_ik A_kj z_k.
pub(super) fn product(
    outer: &DMatrix<f64>,
    inner: &DMatrix<f64>,
    z: &dyn Fn(usize) -> f64,
) -> DMatrix<f64> {
    let mut scaled = inner.clone();
    for (k, mut row) in scaled.row_iter_mut().enumerate() {
        row *= z(k);
    }
    outer * scaled
}

/// Adds dg_i/de_j to the block (i, j).
pub(super) fn add_stiffness<const M: usize>(
    grid: &Grid,
    curve: &FramedCurve,
    force: &[Vector3<f64>],
    out: &mut DMatrix<f64>,
) {
    let n = grid.len();
    let (inner, outer) = sums(grid);
    // Over the components z of f and of r f^T.
    let product = |z: &dyn Fn(usize) -> f64| product(&outer, &inner, z);
    let forces: [DMatrix<f64>; 3] = std::array::from_fn(|a| product(&|k| force[k][a]));
    let moments: [DMatrix<f64>; 9] =
        std::array::from_fn(|a| product(&|k| curve.positions[k][a % 3] * force[k][a / 3]));
    let resultants = resultants(grid, curve, force);
    let mut up_to = vec![0.0; n];
    for element in grid.elements() {
        for j in element.nodes() {
            column(grid, element, j, &mut up_to);
            let (directors, place) = (&curve.directors[j], &curve.positions[j]);
            for i in 0..n {
                let ([c, beyond], a) = (&resultants[i], up_to[i]);
                let across = curve.directors[i].transpose();
                let sum = Vector3::from_fn(|k, _| forces[k][(i, j)]);
                let outer = Matrix3::from_fn(|k, l| moments[k + 3 * l][(i, j)]);
                // sum b A ((r_k - r_j) f_k^T) - trace: (a x x) x f = x (f.a) - a (x.f).
                let arms = outer - place * sum.transpose();
                let arm = curve.positions[i] - place;
                let own = arm * beyond.transpose();
                let by_turn = (arms - Matrix3::from_diagonal_element(arms.trace()))
                    - (own - Matrix3::from_diagonal_element(own.trace())) * a
                    + c.cross_matrix() * a;
                let by_u = across * by_turn * directors;
                // b x f.
                let by_v = across * (beyond * a - sum).cross_matrix() * directors;
                let force_by_u = across * beyond.cross_matrix() * directors * a;
                let mut block = out.fixed_view_mut::<M, M>(M * i, M * j);
                for (row, column) in (0..3).flat_map(|r| (0..3).map(move |c| (r, c))) {
                    block[(row, column)] += by_u[(row, column)];
                }
                for k in free_v(M) {
                    for row in 0..3 {
                        block[(row, k + M - 3)] += by_v[(row, k)];
                        block[(k + M - 3, row)] += force_by_u[(k, row)];
                    }
                }
            }
        }
    }
}
