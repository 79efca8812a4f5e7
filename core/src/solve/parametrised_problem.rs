//! Families of problems F(x, p) = 0 for continuation, with their derivatives.

use super::extrapolated_slope::{Slope, first_step};
use super::special_points::SpecialKind;
use crate::error::{Error, Result};
use nalgebra::{DMatrix, DVector};

/// F and its first derivatives at one (x, p).
#[derive(Debug, Clone, PartialEq)]
pub struct Linearised {
    /// F(x, p).
    pub residual: DVector<f64>,
    /// dF/dx; row i belongs to F_i.
    pub jacobian: DMatrix<f64>,
    /// dF/dp.
    pub slope: DVector<f64>,
}

impl Linearised {
    /// Error if the sizes are wrong or a number is not finite.
    pub(crate) fn checked(self, x: &DVector<f64>, p: f64) -> Result<Self> {
        let n = x.len();
        if self.residual.len() != n || self.jacobian.shape() != (n, n) || self.slope.len() != n {
            return Err(Error::domain(format!(
                "F has {} equations, dF/dx {} x {} entries and dF/dp {}, for {n} unknowns; there must be as many of each",
                self.residual.len(),
                self.jacobian.nrows(),
                self.jacobian.ncols(),
                self.slope.len()
            )));
        }
        let finite = |v: &f64| v.is_finite();
        if self.residual.iter().all(finite)
            && self.jacobian.iter().all(finite)
            && self.slope.iter().all(finite)
        {
            Ok(self)
        } else {
            Err(Error::domain(format!(
                "F or a derivative is not finite at p = {p}, where the largest of {n} unknowns is {:.3e}; return an error where F is undefined",
                x.amax()
            )))
        }
    }
}

/// F(x, p) = 0 with x in R^N: smooth, evaluated to rounding or to a noise of about 1e-13. Matrices are dense.
pub trait Family {
    /// N, the number of unknowns and of equations.
    fn size(&self) -> usize;

    /// F, dF/dx and dF/dp.
    ///
    /// # Errors
    /// F is undefined at this point. Branches end there, with this error as the reason.
    fn linearised(&self, x: &DVector<f64>, p: f64) -> Result<Linearised>;

    /// dF/dp at the fixed x to nearly all digits, by extrapolated differences from the first step `step`.
    ///
    /// # Errors
    /// As [`Family::linearised`].
    fn by_parameter(&self, x: &DVector<f64>, p: f64, step: f64) -> Result<Slope> {
        Slope::at(step, &mut |h| Ok(self.linearised(x, p + h)?.residual))
    }

    /// First step of the differences of [`Family::by_parameter`].
    ///
    /// # Errors
    /// As [`Family::linearised`].
    fn first_step(&self, x: &DVector<f64>, p: f64) -> Result<f64> {
        first_step(p, &mut |p| Ok(self.linearised(x, p)?.residual))
    }

    /// The Morse index of the solution (x, p), or None if the family has none. Evaluated once for each accepted
    /// point, and during the location of stability changes.
    ///
    /// # Errors
    /// The index cannot be found; the point is then reported without one.
    fn index(&self, _x: &DVector<f64>, _p: f64) -> Result<Option<usize>> {
        Ok(None)
    }

    /// A test function of the family, whose sign changes along the branch are located and labelled as events.
    /// `direction` is the unit tangent as (dx, dp). None (the default): no events.
    ///
    /// # Errors
    /// As [`Family::index`].
    fn event(
        &self,
        _x: &DVector<f64>,
        _p: f64,
        _direction: &DVector<f64>,
        _dp: f64,
    ) -> Result<Option<f64>> {
        Ok(None)
    }

    /// Kind of a root of [`Family::event`].
    fn event_kind(&self) -> SpecialKind {
        SpecialKind::Event
    }
}

/// Error if the number of unknowns is not that of the family; `what` names the vector.
pub(crate) fn check_size(family: &dyn Family, what: &str, x: &DVector<f64>) -> Result<()> {
    let (size, given) = (family.size(), x.len());
    if size == given && size > 0 {
        return Ok(());
    }
    Err(Error::domain(format!(
        "{what} has {given} unknowns, and the family {size}; it must have as many, and one at least"
    )))
}

impl<F: Family + ?Sized> Family for Box<F> {
    fn size(&self) -> usize {
        (**self).size()
    }

    fn linearised(&self, x: &DVector<f64>, p: f64) -> Result<Linearised> {
        (**self).linearised(x, p)
    }

    fn by_parameter(&self, x: &DVector<f64>, p: f64, step: f64) -> Result<Slope> {
        (**self).by_parameter(x, p, step)
    }

    fn first_step(&self, x: &DVector<f64>, p: f64) -> Result<f64> {
        (**self).first_step(x, p)
    }

    fn index(&self, x: &DVector<f64>, p: f64) -> Result<Option<usize>> {
        (**self).index(x, p)
    }

    fn event(
        &self,
        x: &DVector<f64>,
        p: f64,
        direction: &DVector<f64>,
        dp: f64,
    ) -> Result<Option<f64>> {
        (**self).event(x, p, direction, dp)
    }

    fn event_kind(&self) -> SpecialKind {
        (**self).event_kind()
    }
}
