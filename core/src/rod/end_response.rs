//! Stiffness and compliance of a rod at its end.
//!
//! The base wrench determines pose and wrench of the end. With the derivatives T of the pose (rotation, place) and W of
//! the wrench (couple, force) by the base wrench, the stiffness is W T^-1 and the compliance T W^-1. Loads along the
//! rod stay as they are. The stiffness is not symmetric where the end bears a couple: with rotations as spins in the
//! world, its skew part is that of the couple.

use super::ivp::Wrench;
use super::problem::Problem;
use crate::error::{Error, Result};
use nalgebra::{Matrix3x6, Matrix6};

/// Least singular value, relative to the largest, of a matrix that has an inverse.
const SINGULAR: f64 = 1e-10;

/// Linear relation of a change of the wrench (couple, force) on the end and the change of pose (rotation vector, place)
/// of the end, in the world. The clamp is held.
#[derive(Debug, Clone, PartialEq)]
pub struct EndResponse {
    /// Wrench by pose; `None` where the held end is at a fold, and for a straight inextensible rod.
    pub stiffness: Option<Matrix6<f64>>,
    /// Pose by wrench; `None` where the loaded end is at a fold.
    pub compliance: Option<Matrix6<f64>>,
}

/// a b^-1; `None` for a singular b.
fn over(a: &Matrix6<f64>, b: &Matrix6<f64>) -> Option<Matrix6<f64>> {
    let values = b.singular_values();
    let inverse = b.try_inverse()?;
    (values.min() > SINGULAR * values.max()).then(|| a * inverse)
}

impl Problem {
    /// Stiffness and compliance of the end in the equilibrium of a base wrench, in the world and the user's units.
    /// They are exact derivatives, right to the tolerance of the problem.
    ///
    /// # Errors
    /// A rod that is taut ([`Problem::is_taut`]), whose base wrench does not resolve the end; a wrench that the rod
    /// cannot follow.
    pub fn end_response(&self, base: &Wrench) -> Result<EndResponse> {
        let b = self.rod.inward(base);
        if self.is_taut(base, &self.end_section(&b)?) {
            return Err(Error::ill_conditioned(
                "the rod is so taut that its base wrench does not resolve the end: write the rod as an assembly, [[rod]] with a [[body]] at \
                 its end",
            ));
        }
        let trial = self.trial(&b)?;
        let [m, n] = self.resultants_by(&trial);
        let half = |row: usize| Matrix3x6::from_fn(|i, j| trial.tangent[row + i][j]);
        let turn = self.rod.clamp.rotation.to_rotation_matrix();
        let (couple, force) = self.rod.units();
        let both = |first: Matrix3x6<f64>, second: Matrix3x6<f64>| {
            let mut whole = Matrix6::zeros();
            let halves = [(0, first), (3, second)];
            for (row, part) in halves {
                let part = turn.matrix() * part;
                whole.fixed_rows_mut::<3>(row).copy_from(&part);
            }
            whole
        };
        // Both matrices are inverted without units.
        let [pose, wrench] = [both(half(0), half(3)), both(m, n)];
        let scaled = |matrix: Matrix6<f64>, rows: [f64; 2], columns: [f64; 2]| {
            Matrix6::from_fn(|i, j| matrix[(i, j)] * rows[i / 3] / columns[j / 3])
        };
        let (wrenches, poses) = ([couple, force], [1.0, self.rod.length]);
        Ok(EndResponse {
            stiffness: over(&wrench, &pose).map(|matrix| scaled(matrix, wrenches, poses)),
            compliance: over(&pose, &wrench).map(|matrix| scaled(matrix, poses, wrenches)),
        })
    }
}
