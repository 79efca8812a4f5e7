//! Morse index of a taut rod by its second variation.
//!
//! At a given force the second variation is a functional of the turns phi alone. Let p = mu + m x phi/2, in units of
//! kappa, be conjugate to phi. The variations are Hamiltonian, phi' = a phi + e p, p' = g phi - a^T p, and the
//! functional is
//! ```text
//! int (phi' - a phi).e^-1 (phi' - a phi) + phi.g phi,      e = kappa E_uu,   a = E_uu [m]/2 + E_uv [n].
//! ```
//! Negative eigenvalues are counted over functions that are polynomials on every interval of the mesh. Where the rod
//! is straight under its pull the form is positive on intervals of any length; elsewhere the mesh is fine. Each held
//! position component takes away a negative eigenvalue of d r(1)/d n, as in the count by conjugate points.

use super::interval::{FrameAndCouple, RodUnderForce, STAGES, Scheme};
use super::{Shape, Tip};
use crate::error::{Error, Result};
use crate::math::gauss::legendre;
use crate::math::se3::frame;
use crate::rod::zero_modes::{AXIS, FreeTurn};
use nalgebra::{DMatrix, DVector, Matrix3, SMatrix, Vector3};

/// Number of polynomials that vanish at both ends, of degrees 2 to STAGES - 1.
const INNER: usize = STAGES - 2;
const SIZE: usize = 3 * (INNER + 2);
/// Eigenvalues above minus this part of the largest do not count as negative: they may be neutral.
const NEUTRAL: f64 = 1e-11;

/// A function at the stages: value and derivative by x in [0, 1].
type Function = [(f64, f64); STAGES];

/// Basis functions: the inner ones first, then the linear ones of both ends.
fn functions() -> [Function; INNER + 2] {
    let nodes = &Scheme::get().nodes;
    std::array::from_fn(|k| {
        nodes.map(|x| {
            let p = legendre(2.0 * x - 1.0, STAGES + 1);
            match k {
                // The integral of P_j from the start, j = k + 1.
                _ if k < INNER => {
                    let (j, odd) = (k + 1, 2.0 * k as f64 + 3.0);
                    ((p[j + 1] - p[j - 1]) / odd, 2.0 * p[j])
                }
                INNER => (1.0 - x, -1.0),
                _ => (x, 1.0),
            }
        })
    })
}

fn negative(matrix: &DMatrix<f64>) -> usize {
    below(matrix, NEUTRAL)
}

/// Number of eigenvalues below minus the part `least` of the largest. A pivot on the way counts whatever its size, for
/// the next one has the same eigenvalue inverted.
fn below(matrix: &DMatrix<f64>, least: f64) -> usize {
    let values = ((matrix + matrix.transpose()) * 0.5).symmetric_eigenvalues();
    let zero = least * values.amax();
    values.iter().filter(|x| **x < -zero).count()
}

impl RodUnderForce<'_> {
    /// The index with the place of the end held along `axes`, `compliance` being d r(1)/dn. A free turn about the clamp
    /// is left out.
    pub fn index(
        &self,
        shape: &Shape,
        tip: &Tip,
        compliance: &Matrix3<f64>,
        axes: &[Vector3<f64>],
        turn: Option<FreeTurn>,
    ) -> Result<usize> {
        let held = turn == Some(FreeTurn::AtGivenForce);
        let loaded = self.at_given_force(shape, tip, held)?;
        let mut compliance = DMatrix::from_fn(axes.len(), axes.len(), |i, j| {
            axes[i].dot(&(compliance * axes[j]))
        });
        let mut taken = 0;
        if let Some(FreeTurn::AtHeldPlace(force)) = turn {
            // The place does not change along this force: neutral with the place held, it is negative in the count.
            taken += 1;
            let along =
                DVector::from_iterator(axes.len(), axes.iter().map(|axis| axis.dot(&force)));
            let along = along.normalize();
            let rest = DMatrix::identity(axes.len(), axes.len()) - &along * along.transpose();
            compliance = &rest * compliance * &rest;
        }
        if !axes.is_empty() {
            taken += negative(&compliance);
        }
        loaded.checked_sub(taken).ok_or_else(|| {
            Error::no_convergence(
                "the index of a taut rod comes out negative: tighten the tolerance",
            )
        })
    }

    /// Inner node with the largest rotation e - d3 in a free turn about the clamp, and the unit vector of the rotation.
    fn turning_node(&self, shape: &Shape) -> (usize, Vector3<f64>) {
        let turned = |node: &FrameAndCouple| AXIS - frame(&node.turn).column(2);
        let inner = shape
            .nodes
            .iter()
            .enumerate()
            .skip(1)
            .take(shape.stages.len() - 1);
        let all = inner.map(|(k, node)| (k, turned(node)));
        let most = all.max_by(|a, b| a.1.norm().total_cmp(&b.1.norm()));
        most.map_or((0, Vector3::zeros()), |(k, turn)| (k, turn.normalize()))
    }

    /// The index under the given force. With `held`, a spring at one node holds the free turn about the clamp: a
    /// neutral mode becomes stable, and the sign of no other changes.
    fn at_given_force(&self, shape: &Shape, tip: &Tip, held: bool) -> Result<usize> {
        let spring = held.then(|| self.turning_node(shape));
        let singular =
            || Error::ill_conditioned("the index is undefined: the rod is neutral under its force");
        let functions = functions();
        let mut count = 0;
        // Stiffness at a node of the part of the rod before the node, with the base held.
        let mut before: Option<Matrix3<f64>> = None;
        for (k, stages) in shape.stages.iter().enumerate() {
            let (from, to) = (shape.places[k], shape.places[k + 1]);
            let matrix = self.second_variation(from, to, stages, &functions)?;
            let inner = matrix.view((0, 0), (3 * INNER, 3 * INNER)).into_owned();
            count += below(&inner, 0.0);
            let across = matrix.view((0, 3 * INNER), (3 * INNER, 6)).into_owned();
            let reduced = inner.full_piv_lu().solve(&across).ok_or_else(singular)?;
            let outer = matrix.view((3 * INNER, 3 * INNER), (6, 6)) - across.transpose() * reduced;
            let block = |i: usize, j: usize| outer.fixed_view::<3, 3>(i, j).into_owned();
            let mut here = block(3, 3);
            if let Some(before) = before {
                let mut start = before + block(0, 0);
                if let Some((_, axis)) = spring.filter(|(node, _)| *node == k) {
                    start += axis * axis.transpose() * start.norm();
                }
                let least = if k + 1 == shape.stages.len() {
                    NEUTRAL
                } else {
                    0.0
                };
                count += below(&DMatrix::from_column_slice(3, 3, start.as_slice()), least);
                let inverse = start.try_inverse().ok_or_else(singular)?;
                here -= block(3, 0) * inverse * block(0, 3);
            }
            before = Some(here);
        }
        if let (Tip::Loaded { arm, .. }, Some(mut end)) = (tip, before) {
            // A dead force on an arm of the end.
            let last = &shape.nodes[shape.nodes.len() - 1];
            let (n, c) = (
                self.force(1.0).cross_matrix(),
                (frame(&last.turn) * arm).cross_matrix(),
            );
            end -= (n * c + c * n) * (0.5 / self.kappa);
            count += negative(&DMatrix::from_column_slice(3, 3, end.as_slice()));
        }
        Ok(count)
    }

    fn second_variation(
        &self,
        from: f64,
        to: f64,
        stages: &[FrameAndCouple; STAGES],
        functions: &[Function; INNER + 2],
    ) -> Result<DMatrix<f64>> {
        let h = to - from;
        let mut sum = DMatrix::zeros(SIZE, SIZE);
        for (i, slope) in self.slopes(from, to, stages)?.iter().enumerate() {
            let [uu, uv, vu, vv] = &slope.e;
            let (bend, pull) = (stages[i].m.cross_matrix(), slope.n.cross_matrix());
            let a = uu * bend * 0.5 + uv * pull;
            // p' = mu' + (m' x phi + m x phi')/2, all over kappa.
            let way = vu * bend + vv * pull - slope.r.cross_matrix();
            let couple = slope.n.cross(&slope.r).cross_matrix();
            let g =
                (pull * way - pull * vu * bend * 0.5 + couple * 0.5 + bend * a * 0.5) / self.kappa;
            let g = (g + g.transpose()) * 0.5;
            // A small compliance stands for a rod that cannot be twisted.
            let e = (uu + Matrix3::identity() * (1e-12 * uu.norm())) * self.kappa;
            let stiffness = e.try_inverse().ok_or_else(|| {
                Error::ill_conditioned(
                    "the section cannot be bent: the index of a taut rod is undefined",
                )
            })?;
            let stiffness = (stiffness + stiffness.transpose()) * 0.5;
            let weight = h * Scheme::get().weights[i];
            let mut rate = SMatrix::<f64, 3, SIZE>::zeros();
            let mut value = SMatrix::<f64, 3, SIZE>::zeros();
            for (k, function) in functions.iter().enumerate() {
                let (f, df) = function[i];
                let block = Matrix3::identity() * (df / h) - a * f;
                rate.fixed_columns_mut::<3>(3 * k).copy_from(&block);
                value.fixed_columns_mut::<3>(3 * k).fill_diagonal(f);
            }
            let part = rate.transpose() * (stiffness * rate) + value.transpose() * (g * value);
            sum += part * weight;
        }
        Ok(sum)
    }
}
