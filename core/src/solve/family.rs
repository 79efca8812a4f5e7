//! What the continuation asks of a problem: F(x, p) = 0 with its derivatives.

use super::special::SpecialKind;
use crate::error::{Error, Result};
use nalgebra::{SMatrix, SVector};

/// F and its first derivatives at one (x, p).
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Linearised<const N: usize> {
    /// F(x, p).
    pub residual: SVector<f64, N>,
    /// dF/dx; row i belongs to F_i.
    pub jacobian: SMatrix<f64, N, N>,
    /// dF/dp.
    pub slope: SVector<f64, N>,
}

impl<const N: usize> Linearised<N> {
    /// Itself, unless a number in it is not finite.
    pub(crate) fn checked(self, x: &SVector<f64, N>, p: f64) -> Result<Self> {
        let finite = |v: &f64| v.is_finite();
        if self.residual.iter().all(finite)
            && self.jacobian.iter().all(finite)
            && self.slope.iter().all(finite)
        {
            Ok(self)
        } else {
            Err(Error::domain(format!(
                "F or a derivative is not finite at x = {:?}, p = {p}; return an error where F is undefined",
                x.as_slice()
            )))
        }
    }
}

/// F(x, p) = 0 with x in R^N: smooth, `N` small, evaluated to rounding or to a noise of about 1e-13.
pub trait Family<const N: usize> {
    /// F, dF/dx and dF/dp.
    ///
    /// # Errors
    /// F is undefined here. Branches end there, with this error as the reason.
    fn linearised(&self, x: &SVector<f64, N>, p: f64) -> Result<Linearised<N>>;

    /// The Morse index of the solution (x, p), or None if the family has none. Asked once for each
    /// accepted point, and during the location of stability changes.
    ///
    /// # Errors
    /// The index cannot be found here; the point is then reported without one.
    fn index(&self, _x: &SVector<f64, N>, _p: f64) -> Result<Option<usize>> {
        Ok(None)
    }

    /// A test function of the family's own, whose sign changes along the branch are located and
    /// labelled as events. `direction` is the unit tangent as (dx, dp). None (the default): no events.
    ///
    /// # Errors
    /// As [`Family::index`].
    fn event(
        &self,
        _x: &SVector<f64, N>,
        _p: f64,
        _direction: (&SVector<f64, N>, f64),
    ) -> Result<Option<f64>> {
        Ok(None)
    }

    /// What a root of [`Family::event`] is called.
    fn event_kind(&self) -> SpecialKind {
        SpecialKind::Event
    }
}

impl<F: Family<N> + ?Sized, const N: usize> Family<N> for Box<F> {
    fn linearised(&self, x: &SVector<f64, N>, p: f64) -> Result<Linearised<N>> {
        (**self).linearised(x, p)
    }

    fn index(&self, x: &SVector<f64, N>, p: f64) -> Result<Option<usize>> {
        (**self).index(x, p)
    }

    fn event(
        &self,
        x: &SVector<f64, N>,
        p: f64,
        direction: (&SVector<f64, N>, f64),
    ) -> Result<Option<f64>> {
        (**self).event(x, p, direction)
    }

    fn event_kind(&self) -> SpecialKind {
        (**self).event_kind()
    }
}
