//! The Morse index by conjugate points (theory Sec. 3).
//!
//! With n given and both ends' rotations held, the second variation is a functional of the rotation field alone; its
//! index is the number of conjugate points of the 3 x 3 matrix J(s) = d phi/d m(0). On steps without a conjugate
//! point of their own it is the number of negative eigenvalues of the symmetric B^-1 J(s+) J(s)^-1 summed
//! over the steps, B the step's own d phi/d m: no root is sought, and double points count twice. This holds unchanged for
//! unshearable and inextensible rods. The end then corrects the count (Haynsworth):
//!
//! * a free rotation adds the negative eigenvalues of d m(1)/d phi(1) at given n;
//! * each held component of the position takes away a negative eigenvalue of d r(1)/d n, if there is one.

use super::Rod;
use super::line::{self, Transition};
use super::problem::{End, Trial, halves};
use crate::error::{Error, Result};
use nalgebra::{DMatrix, Matrix3, Vector3};

/// Relative size below which an eigenvalue counts as zero.
const ZERO: f64 = 1e-13;

/// Negative eigenvalues of the symmetric part.
fn negative(matrix: &DMatrix<f64>) -> usize {
    if matrix.is_empty() {
        return 0;
    }
    let symmetric = 0.5 * (matrix + matrix.transpose());
    let floor = -ZERO * symmetric.norm();
    symmetric
        .symmetric_eigenvalues()
        .iter()
        .filter(|value| **value < floor)
        .count()
}

fn inverted(matrix: &Matrix3<f64>) -> Result<Matrix3<f64>> {
    matrix.try_inverse().ok_or_else(|| {
        Error::no_convergence("the index is undefined exactly at a conjugate point of the end; move the equilibrium a little")
    })
}

/// Conjugate points in (0, 1) of the rotation field at given n.
fn conjugate_points(transitions: &[Transition]) -> Result<usize> {
    let (mut j, mut p) = (Matrix3::zeros(), Matrix3::identity());
    let mut count = 0;
    for (i, step) in transitions.iter().enumerate() {
        let next = step.a * j + step.b * p;
        if i > 0 {
            let inverse = inverted(&step.b)?;
            // Congruent to B^-1 J(s+) J(s)^-1 without dividing by J.
            let form = j.transpose() * inverse * next;
            count += negative(&DMatrix::from_column_slice(3, 3, form.as_slice()));
        }
        p = step.c * j + step.d * p;
        j = next;
        // Columns are scaled and mixed freely: only J(s+) J(s)^-1 enters.
        if let Some(inverse) = (j.transpose() * j + p.transpose() * p)
            .cholesky()
            .and_then(|factor| factor.l().transpose().try_inverse())
        {
            j *= inverse;
            p *= inverse;
        }
    }
    Ok(count)
}

/// The index of the equilibrium at `trial`, whose tangent must be whole, under the end condition `end`.
///
/// A couple at a free end does work that depends on the path; its symmetric part is taken.
pub(super) fn index(
    rod: &Rod,
    end: &End,
    axes: &[Vector3<f64>; 3],
    trial: &Trial,
    tolerance: f64,
) -> Result<usize> {
    let count = conjugate_points(&line::transitions(
        &rod.law,
        &trial.b,
        tolerance.max(1e-10),
    )?)?;
    let block =
        |row: usize, column: usize| Matrix3::from_fn(|i, j| trial.tangent[row + i][column + j]);
    let (phi_m, phi_n, r_m, r_n) = (block(0, 0), block(0, 3), block(3, 0), block(3, 3));
    let (_, n) = halves(&trial.b);
    let pull = n.cross_matrix();
    let m_m = Matrix3::identity() + pull * r_m;
    let mut total = count;
    // d m(0)/d n that keeps the rotation, or the couple, of the end.
    let (matrix, right) = if end.orientation.is_some() {
        (phi_m, phi_n)
    } else {
        let stiffness = m_m * inverted(&phi_m)?;
        total += negative(&DMatrix::from_column_slice(3, 3, stiffness.as_slice()));
        (m_m, pull * r_n - trial.r.cross_matrix())
    };
    let held: Vec<usize> = (0..3).filter(|i| end.position[*i].is_some()).collect();
    if !held.is_empty() {
        let compliance = r_n - r_m * inverted(&matrix)? * right;
        let restricted = DMatrix::from_fn(held.len(), held.len(), |a, b| {
            axes[held[a]].dot(&(compliance * axes[held[b]]))
        });
        total = total.checked_sub(negative(&restricted)).ok_or_else(|| {
            Error::no_convergence(
                "the index comes out negative: the tolerance is too loose for this load",
            )
        })?;
    }
    Ok(total)
}
