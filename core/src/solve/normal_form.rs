//! Normal form of a fold of a family F(x, p) = 0. Near the fold, with x = x_f + a z,
//! ```text
//! l . F = A (p - p_f) + B a^2,     A = l . F_p,     B = 1/2 l . D^2 F[z, z],     F_x z = 0,   l . F_x = 0.
//! ```
//! The normalisations of z and of l set the units of A and B.

use super::difference_step::Steps;
use super::parametrised_problem::Family;
use crate::error::{Error, Result};
use nalgebra::{DMatrix, DVector};

/// Steps of derivatives along z, the first relative to 1 + |x|. Their error is of the fourth power of the step, plus
/// the noise of F_x over the step.
const STEPS: Steps = Steps {
    first: 4e-3,
    most: 6,
    same: 1e-8,
};
/// Bound on l . F_x and F_x z at a fold, relative to their factors.
const SINGULAR: f64 = 1e-4;

/// Unit vectors (l, z) of the smallest singular value of the matrix.
pub fn null_vectors(jacobian: &DMatrix<f64>) -> Result<[DVector<f64>; 2]> {
    let svd = jacobian.clone().svd(true, true);
    let least = svd.singular_values.imin();
    match (svd.u, svd.v_t) {
        (Some(u), Some(v)) => Ok([u.column(least).into_owned(), v.row(least).transpose()]),
        _ => Err(Error::no_convergence("the null vectors of a fold")),
    }
}

/// (A, B) at the fold (x, p) along z, by l.
///
/// # Errors
/// Those of the family; a point that is no fold, or vectors that are not its null vectors.
pub fn normal_form(
    family: &dyn Family,
    x: &DVector<f64>,
    p: f64,
    l: &DVector<f64>,
    z: &DVector<f64>,
) -> Result<[f64; 2]> {
    let at = |step: f64| family.linearised(&(x + z * step), p);
    let here = at(0.0)?;
    let [left, right] = [here.jacobian.tr_mul(l).norm(), (&here.jacobian * z).norm()];
    let size = here.jacobian.norm();
    if !(left <= SINGULAR * size * l.norm() && right <= SINGULAR * size * z.norm()) {
        return Err(Error::domain(
            "the equations are not singular along this direction, or their loads have no potential",
        ));
    }
    let slope =
        |step: f64| -> Result<DMatrix<f64>> { Ok(at(step)?.jacobian - at(-step)?.jacobian) };
    let bend = |h: f64| -> Result<f64> {
        let change = (slope(h)? * 8.0 - slope(2.0 * h)?) / (12.0 * h);
        Ok(0.5 * l.dot(&(change * z)))
    };
    let steps = Steps {
        first: STEPS.first * (1.0 + x.norm()) / z.norm(),
        ..STEPS
    };
    let found = steps.best_step(bend, |a, b| (a - b).abs() / b.abs())?;
    let form = found.map(|(_, bend)| [l.dot(&here.slope), bend]);
    let finite = form.filter(|form| form.iter().all(|x| x.is_finite()));
    finite.ok_or_else(|| {
        Error::domain("the fold has no normal form: how it bends is zero, or is not resolved")
    })
}
