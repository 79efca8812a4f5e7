//! Loads without a potential along a rod in space: forces that turn with the sections, and couples.
//!
//! At one moment they act as a dead load f = R p and a couple l + R c do. Beyond a section the couples add
//! C = int_s^1 (l + R c) to its resultants. A change of the strains also turns f and R c at the nodes k, by phi_k:
//! ```text
//! dN_i = sum_k b_ik phi_k x f_k,   dc_i = sum_k b_ik ((r_k - r_i) x (phi_k x f_k) + phi_k x R_k c_k),
//! ```
//! b = weight - A, beside the terms of [`super::distributed_load`].

use super::distributed_load::{self, product, sums};
use super::{FramedCurve, beyond, column, free_v};
use crate::viscoelastic::grid::Grid;
use crate::viscoelastic::loads_at_nodes::TurningAtNode;
use nalgebra::{DMatrix, Matrix3, Vector3};

/// Forces at the nodes, in the frame of the clamp.
fn forces(curve: &FramedCurve, loads: &[TurningAtNode]) -> Vec<Vector3<f64>> {
    let nodes = loads.iter().zip(&curve.directors);
    nodes
        .map(|(load, directors)| load.force_at(directors))
        .collect()
}

/// Couple beyond each node.
fn couples(grid: &Grid, curve: &FramedCurve, loads: &[TurningAtNode]) -> Vec<Vector3<f64>> {
    let nodes = loads.iter().zip(&curve.directors);
    let mut sums: Vec<Vector3<f64>> = nodes
        .map(|(load, directors)| load.couple_at(directors))
        .collect();
    beyond(grid, &mut sums);
    let sums = sums.iter().zip(grid.weights());
    sums.map(|(sum, weight)| sum / *weight).collect()
}

/// (c + C, N) at the nodes.
pub(super) fn resultants(
    grid: &Grid,
    curve: &FramedCurve,
    loads: &[TurningAtNode],
) -> Vec<[Vector3<f64>; 2]> {
    let mut all = distributed_load::resultants(grid, curve, &forces(curve, loads));
    for (resultants, couple) in all.iter_mut().zip(couples(grid, curve, loads)) {
        resultants[0] += couple;
    }
    all
}

/// Adds dg_i/de_j to the block (i, j).
pub(super) fn add_stiffness<const M: usize>(
    grid: &Grid,
    curve: &FramedCurve,
    loads: &[TurningAtNode],
    out: &mut DMatrix<f64>,
) {
    let f = forces(curve, loads);
    distributed_load::add_stiffness::<M>(grid, curve, &f, out);
    let nodes = loads.iter().zip(&curve.directors);
    let turned: Vec<Vector3<f64>> = nodes
        .map(|(load, directors)| load.turned_couple_at(directors))
        .collect();
    let (inner, outer) = sums(grid);
    let vectors = |z: &[Vector3<f64>]| -> [DMatrix<f64>; 3] {
        std::array::from_fn(|a| product(&outer, &inner, &|k| z[k][a]))
    };
    let (by_force, by_couple) = (vectors(&f), vectors(&turned));
    let moments: [DMatrix<f64>; 9] = std::array::from_fn(|a| {
        product(&outer, &inner, &|k| curve.positions[k][a % 3] * f[k][a / 3])
    });
    let beyond = couples(grid, curve, loads);
    let mut up_to = vec![0.0; grid.len()];
    for element in grid.elements() {
        for j in element.nodes() {
            column(grid, element, j, &mut up_to);
            let directors = &curve.directors[j];
            for i in 0..grid.len() {
                let across = curve.directors[i].transpose();
                let at = |sums: &[DMatrix<f64>; 3]| Vector3::from_fn(|k, _| sums[k][(i, j)]);
                let (force, couple) = (at(&by_force), at(&by_couple));
                // x x (phi x f) = phi (x.f) - f (x.phi), over x = r_k - r_i.
                let moment = Matrix3::from_fn(|k, l| moments[k + 3 * l][(i, j)])
                    - curve.positions[i] * force.transpose();
                let lever = Matrix3::from_diagonal_element(moment.trace()) - moment.transpose();
                let own = beyond[i].cross_matrix() * up_to[i];
                let by_u = across * (lever - couple.cross_matrix() + own) * directors;
                let force_by_u = across * (-force.cross_matrix()) * directors;
                let mut block = out.fixed_view_mut::<M, M>(M * i, M * j);
                for (row, column) in (0..3).flat_map(|r| (0..3).map(move |c| (r, c))) {
                    block[(row, column)] += by_u[(row, column)];
                }
                for k in free_v(M) {
                    for column in 0..3 {
                        block[(k + M - 3, column)] += force_by_u[(k, column)];
                    }
                }
            }
        }
    }
}
