//! Derivatives of solutions of F(x, p) = 0 by the implicit function theorem.
//!
//! Solutions have dx/dp = -F_x^-1 F_p. Let q be another number of the problem. At a fold, with psi . F_x = 0, the
//! critical value of p has
//! ```text
//! dp/dq = - psi . F_q / psi . F_p.
//! ```
//! A branch point of a pitchfork stays one where psi . F_q = 0. With F_x z = 0 and the changes v_p, v_q of the
//! solution along the branch without the amplitude of z, the derivative of the determinant vanishes:
//! ```text
//! dp/dq = - (psi . D_q F_x z) / (psi . D_p F_x z),     D_q F_x = F_xx v_q + F_xq,     F_x v_q = -F_q.
//! ```
//! Derivatives by p and q are extrapolated differences of F and F_x at the fixed solution. No solver is differenced.

use super::extrapolated_slope::Slope;
use super::normal_form::null_vectors;
use super::parametrised_problem::Family;
use crate::error::{Error, Result};
use nalgebra::{DMatrix, DVector};

/// Least singular value of F_x with rows and columns of length 1, relative to the largest, of a regular solution.
const SINGULAR: f64 = 1e-10;
/// Largest psi . F_q, relative to F_q, of a branch point that stays one.
const UNFOLDED: f64 = 1e-7;
/// Largest psi . F_xx z z of a pitchfork, relative to the largest rate of psi . F_x z.
const ASYMMETRIC: f64 = 1e-5;
/// Newton steps that remove the residual of the solver.
const POLISH: usize = 3;
/// Step along the critical direction, relative to 1 + |x|.
const ALONG: f64 = 0.02;

/// A solution and its derivative.
#[derive(Debug, Clone, PartialEq)]
pub struct Response {
    /// The solution x, polished by Newton's method.
    pub x: DVector<f64>,
    /// dx/dp.
    pub by: Slope,
    /// First step of the differences in p.
    pub step: f64,
}

/// The matrix with rows, then columns, of length 1.
fn balanced(matrix: &DMatrix<f64>) -> DMatrix<f64> {
    let mut matrix = matrix.clone();
    for mut row in matrix.row_iter_mut() {
        let size = row.norm();
        row /= if size > 0.0 { size } else { 1.0 };
    }
    for mut column in matrix.column_iter_mut() {
        let size = column.norm();
        column /= if size > 0.0 { size } else { 1.0 };
    }
    matrix
}

/// dx/dp of the solution near `x` at `p`.
///
/// # Errors
/// Those of the family; a solution at a fold or a branch point, which has no derivative.
pub fn response(family: &dyn Family, x: &DVector<f64>, p: f64) -> Result<Response> {
    let mut x = x.clone();
    let mut at = family.linearised(&x, p)?;
    for _ in 0..POLISH {
        let Some(step) = at.jacobian.clone().lu().solve(&-&at.residual) else {
            break;
        };
        let there = &x + step;
        match family.linearised(&there, p) {
            Ok(next) if next.residual.norm() < at.residual.norm() => (x, at) = (there, next),
            _ => break,
        }
    }
    let values = balanced(&at.jacobian).singular_values();
    let inverse = at.jacobian.clone().try_inverse();
    let inverse = inverse.filter(|_| values.min() > SINGULAR * values.max());
    let Some(inverse) = inverse else {
        return Err(Error::ill_conditioned(
            "the equilibrium is at a fold or a branch point, where it has no derivative; move a load or a length a little",
        ));
    };
    let step = family.first_step(&x, p)?;
    let slope = family.by_parameter(&x, p, step)?;
    let by = Slope {
        value: -(&inverse * slope.value),
        error: inverse.abs() * slope.error,
    };
    Ok(Response { x, by, step })
}

/// A singular solution (x, p) of a family.
#[derive(Clone, Copy)]
pub struct Critical<'a> {
    /// The family in the parameter p.
    pub family: &'a dyn Family,
    /// The unknowns.
    pub x: &'a DVector<f64>,
    /// The critical value of the parameter.
    pub p: f64,
}

/// A derivative of one number with its estimated error.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Rate {
    /// The derivative.
    pub value: f64,
    /// Estimated error, >= 0.
    pub error: f64,
}

impl Rate {
    /// -above/below.
    fn of_ratio(above: Self, below: Self) -> Self {
        let value = -above.value / below.value;
        let error = (above.error + value.abs() * below.error) / below.value.abs();
        Self { value, error }
    }

    fn along(psi: &DVector<f64>, slope: &Slope) -> Self {
        Self {
            value: psi.dot(&slope.value),
            error: psi.abs().dot(&slope.error),
        }
    }

    fn of(slope: &Slope) -> Self {
        Self {
            value: slope.value[0],
            error: slope.error[0],
        }
    }
}

impl Critical<'_> {
    /// Derivative of the critical value at a fold by the number q of the family `by`, whose solutions at `q` are those
    /// of this family at p.
    ///
    /// # Errors
    /// Those of the families; a solution at which F_p is no obstacle to solutions, as at a branch point.
    pub fn of_fold(&self, by: &dyn Family, q: f64) -> Result<Rate> {
        let (x, p) = (self.x, self.p);
        let [psi, _] = null_vectors(&self.family.linearised(x, p)?.jacobian)?;
        let slope_p = self.by(self.family, p)?;
        let slope_q = self.by(by, q)?;
        let [by_p, by_q] = [&slope_p, &slope_q].map(|slope| Rate::along(&psi, slope));
        if !(by_p.value.abs() > UNFOLDED * slope_p.value.norm()) {
            return Err(Error::ill_conditioned(
                "the parameter does not move the equilibrium off this fold: the derivative of its value is not determined",
            ));
        }
        Ok(Rate::of_ratio(by_q, by_p))
    }

    fn by(&self, family: &dyn Family, at: f64) -> Result<Slope> {
        family.by_parameter(self.x, at, family.first_step(self.x, at)?)
    }

    /// Derivative of the critical value at a pitchfork by the number q of the family `by`.
    ///
    /// # Errors
    /// Those of the families; a branch point that unfolds with q, or that is no pitchfork.
    pub fn of_branch_point(&self, by: &dyn Family, q: f64) -> Result<Rate> {
        let (x, p) = (self.x, self.p);
        let jacobian = self.family.linearised(x, p)?.jacobian;
        let [psi, z] = null_vectors(&jacobian)?;
        let size = x.len();
        let mut bordered = DMatrix::zeros(size + 1, size + 1);
        bordered.view_mut((0, 0), (size, size)).copy_from(&jacobian);
        bordered.view_mut((0, size), (size, 1)).copy_from(&psi);
        bordered
            .view_mut((size, 0), (1, size))
            .copy_from(&z.transpose());
        let bordered = bordered.lu();
        let rate = |family: &dyn Family, at: f64| -> Result<(Rate, f64)> {
            let step = family.first_step(x, at)?;
            let slope = family.by_parameter(x, at, step)?;
            let left = Rate::along(&psi, &slope);
            let right = -slope.value.clone().push(0.0);
            let change = bordered.solve(&right).ok_or_else(|| {
                Error::ill_conditioned("two branches more cross at this branch point")
            })?;
            let change = change.rows(0, size).into_owned();
            let off = left.value.abs() / slope.value.norm().max(f64::MIN_POSITIVE);
            // The change of the solution may need a shorter step than that of the equations.
            let short = ALONG * (1.0 + x.norm()) / change.norm().max(f64::MIN_POSITIVE);
            let determinant = Slope::at(step.min(short), &mut |h| {
                let there = family.linearised(&(x + &change * h), at + h)?;
                Ok(DVector::repeat(1, psi.dot(&(there.jacobian * &z))))
            })?;
            Ok((Rate::of(&determinant), off))
        };
        let (by_q, off) = rate(by, q)?;
        if !(off < UNFOLDED) {
            return Err(Error::domain(
                "this number breaks the symmetry of the branch point, which then unfolds into a fold or none: it has no derivative; \
                 follow the branch of a scene without the symmetry",
            ));
        }
        let (by_p, _) = rate(self.family, p)?;
        let bend = Slope::at(ALONG * (1.0 + x.norm()), &mut |h| {
            let there = self.family.linearised(&(x + &z * h), p)?;
            Ok(DVector::repeat(1, psi.dot(&(there.jacobian * &z))))
        })?;
        let scale = jacobian.norm().max(1.0);
        if !(bend.value[0].abs() < ASYMMETRIC * scale) {
            return Err(Error::domain(
                "this branch point is no pitchfork: its two branches cross, and its derivative is not computed; take the fold of a scene \
                 nearby, or two branches of neighbouring scenes",
            ));
        }
        Ok(Rate::of_ratio(by_q, by_p))
    }
}
