//! Small vibrations of a system from its stiffness, damping and mass.

use crate::error::{Error, Result};
use crate::math::small_sort::sort_few;
use crate::solve::positive_definite::definite;
use nalgebra::{DMatrix, DVector};

/// A small vibration about an equilibrium.
#[derive(Debug, Clone)]
pub struct Vibration {
    /// Square of the angular frequency; negative if the equilibrium is unstable.
    pub square: f64,
    /// Decay rate of the amplitude, to first order in the friction.
    pub decay: f64,
    /// Change of the coordinates, normalised to mass 1.
    pub shape: DVector<f64>,
}

/// Motions with friction need all vibrations: a force on a body acts across the rod at its end, which a few
/// vibrations do not resolve. With 24 of them eigenvalues were off by 1e-6 to 1e-4 with drag on the body, a rotor in
/// it or friction of the rod. Beck's column fluttered at 0.97 of its load.
pub(super) const ALL: usize = usize::MAX;
/// Largest number of shifts tried for an indefinite stiffness, each ten times the one before.
const SHIFTS: i32 = 24;
/// Squares of frequencies below this, in units of the rod and the body, count as those of neutral directions of a rod
/// or an assembly.
const NEUTRAL_SQUARE: f64 = 1e-8;

/// The vibrations `modes`, with squares at the rounding level of a free motion set to 0. If the stiffness is positive
/// definite beyond rounding, no motion is free and all squares stay.
pub(super) fn held_or_neutral(modes: Vec<Vibration>, stiffness: &DMatrix<f64>) -> Vec<Vibration> {
    let symmetric = (stiffness + stiffness.transpose()) * 0.5;
    let neutral = definite(&symmetric).map_or(NEUTRAL_SQUARE, |_| 0.0);
    let told = modes.into_iter().map(|mode| Vibration {
        square: if mode.square.abs() > neutral {
            mode.square
        } else {
            0.0
        },
        ..mode
    });
    told.collect()
}

/// The `count` slowest vibrations of a system with this stiffness K, damping and mass M, by rising square of the
/// frequency.
///
/// If K is positive definite, they come from (1/omega^2) K x = M x by Cholesky factors of K: low frequencies keep
/// their digits however fast the highest are. Otherwise they come from K + shift M, with 1/(omega^2 + shift). There
/// the rigid motions, 1/shift, leave rounding in the others. Their squares are then the Rayleigh quotients of their
/// shapes, whose error is the square of that of the shapes.
///
/// # Errors
/// A mass matrix that is singular to rounding where K is not positive definite.
pub(super) fn slowest(
    [stiffness, damping, mass]: [&DMatrix<f64>; 3],
    count: usize,
) -> Result<Vec<Vibration>> {
    let k = (stiffness + stiffness.transpose()) * 0.5;
    let degenerate =
        || Error::domain("the mass matrix of the rod is singular to rounding: use fewer nodes");
    // Start at the first frequency that a shift resolves, and go upwards. The stiffness of rigid motions is pure
    // rounding.
    let diagonal = k.diagonal().abs();
    let elastic = diagonal.iter().filter(|x| **x > 1e-10 * diagonal.max());
    let typical = elastic.copied().fold(f64::INFINITY, f64::min) / mass.diagonal().max();
    let shifts = (0..SHIFTS).map(|i| typical * 1e-6 * 10f64.powi(i));
    let (factors, shift) = std::iter::once(0.0)
        .chain(shifts)
        .find_map(|shift| Some(((&k + mass * shift).cholesky()?, shift)))
        .ok_or_else(degenerate)?;
    let l = factors.l();
    let half = l.solve_lower_triangular(mass).ok_or_else(degenerate)?;
    let whole = l
        .solve_lower_triangular(&half.transpose())
        .ok_or_else(degenerate)?;
    let eigen = ((&whole + whole.transpose()) * 0.5).symmetric_eigen();
    let shapes = l
        .tr_solve_lower_triangular(&eigen.eigenvectors)
        .ok_or_else(degenerate)?;
    let squares = eigen
        .eigenvalues
        .map(|x| 1.0 / x.max(f64::MIN_POSITIVE) - shift);
    let mut order: Vec<usize> = (0..k.nrows()).collect();
    sort_few(&mut order, |i| squares[*i]);
    Ok(order
        .into_iter()
        .take(count)
        .map(|i| {
            let shape: DVector<f64> = shapes.column(i).into_owned();
            let mass = shape.dot(&(mass * &shape));
            let friction = shape.dot(&(damping * &shape));
            let quotient = shape.dot(&(&k * &shape)) / mass;
            Vibration {
                square: if shift > 0.0 { quotient } else { squares[i] },
                decay: 0.5 * friction / mass,
                shape: shape / mass.sqrt(),
            }
        })
        .collect())
}
