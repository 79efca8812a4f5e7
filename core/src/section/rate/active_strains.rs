//! Free strains of a rate law, and checks of numbers given for them.

use crate::error::{Error, Result, check_finite};
use crate::section::{Compliance, Resultant, Strain, StrainName};
use nalgebra::{Matrix6, Vector6};

/// Marks of the strains that a compliance holds rigid, by zero diagonal entries.
pub fn rigid_of(compliance: &Compliance) -> [bool; 6] {
    let diagonal = match compliance {
        Compliance::Diagonal(entries) => *entries,
        Compliance::Full(matrix) => matrix.diagonal(),
    };
    std::array::from_fn(|k| diagonal[k] == 0.0)
}

/// The inverse of the free block of a symmetric positive definite matrix, zero elsewhere; None unless positive
/// definite beyond rounding. The matrix is scaled to a unit diagonal: the criterion must not depend on units.
pub fn inverse_of_free(matrix: &Matrix6<f64>, rigid: [bool; 6]) -> Option<Matrix6<f64>> {
    let roots = Vector6::from_fn(|k, _| if rigid[k] { 1.0 } else { matrix[(k, k)].sqrt() });
    let scaled = Matrix6::from_fn(|i, j| match (i == j, rigid[i] || rigid[j]) {
        (true, true) => 1.0,
        (false, true) => 0.0,
        (_, false) => matrix[(i, j)] / roots[i] / roots[j],
    });
    if !scaled.iter().all(|x| x.is_finite()) {
        return None;
    }
    let inverse = scaled.cholesky()?.inverse();
    // One step of Newton's iteration for inverses removes the error of the elimination.
    let inverse = inverse + inverse * (Matrix6::identity() - scaled * inverse);
    let symmetric = Matrix6::from_fn(|i, j| {
        if rigid[i] || rigid[j] {
            0.0
        } else {
            0.5 * (inverse[(i, j)] + inverse[(j, i)]) / roots[i] / roots[j]
        }
    });
    symmetric.iter().all(|x| x.is_finite()).then_some(symmetric)
}

/// The matrix with zero rows and columns at the rigid strains.
pub(super) fn clear_rigid(matrix: &Matrix6<f64>, rigid: [bool; 6]) -> Matrix6<f64> {
    matrix.map_with_location(|i, j, entry| if rigid[i] || rigid[j] { 0.0 } else { entry })
}

/// The overstress without reactions, if it is finite.
pub(super) fn free_overstress(overstress: &Resultant, rigid: [bool; 6]) -> Result<Resultant> {
    let driving = Vector6::from_fn(|k, _| if rigid[k] { 0.0 } else { overstress[k] });
    check_finite("overstress", driving.as_slice())?;
    Ok(driving)
}

/// Checks that rates satisfy the constraints.
pub(super) fn check_constraints(rate: &Strain, rigid: [bool; 6]) -> Result<()> {
    check_finite("strain rates", rate.as_slice())?;
    for k in (0..6).filter(|k| rigid[*k]) {
        if rate[k] != 0.0 {
            return Err(Error::domain(format!(
                "the strain {} is held rigid: its rate is {} and must be 0",
                StrainName::ALL[k].as_str(),
                rate[k]
            )));
        }
    }
    Ok(())
}
