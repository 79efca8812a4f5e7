//! Curves of folds in two parameters: F(x, p, q) = 0 with F_x singular, continued in q.

use super::elimination::Svd;
use super::parametrised_problem::{Family, Linearised};
use super::special_points::SpecialKind;
use crate::error::{Error, Result};
use nalgebra::{DMatrix, DVector};
use std::cell::RefCell;

/// F and its first derivatives at one (x, p, q).
#[derive(Debug, Clone, PartialEq)]
pub struct Linearised2 {
    /// F(x, p, q).
    pub residual: DVector<f64>,
    /// dF/dx.
    pub jacobian: DMatrix<f64>,
    /// dF/dp.
    pub slope_p: DVector<f64>,
    /// dF/dq.
    pub slope_q: DVector<f64>,
}

/// F(x, p, q) = 0 with two parameters.
pub trait Family2 {
    /// N, the number of unknowns and of equations.
    fn size(&self) -> usize;

    /// F with first derivatives.
    ///
    /// # Errors
    /// F is undefined at (x, p, q).
    fn linearised(&self, x: &DVector<f64>, p: f64, q: f64) -> Result<Linearised2>;

    /// The Morse index of the solution (x, p, q), or None if the family has none.
    ///
    /// # Errors
    /// The index cannot be found here.
    fn index(&self, _x: &DVector<f64>, _p: f64, _q: f64) -> Result<Option<usize>> {
        Ok(None)
    }
}

/// A family in two parameters made of families in each of them, with the same unknowns: `in_p(q)` has the parameter
/// p, `in_q(p)` the parameter q. An evaluation costs one of each.
pub struct Crossed<A, B> {
    in_p: A,
    in_q: B,
    size: usize,
    unit: f64,
}

impl<A, B> Crossed<A, B> {
    /// Combines families of `size` unknowns. p is counted in `unit`s (not 0) of the families' own, and so is of the
    /// size of the unknowns.
    pub fn new(in_p: A, in_q: B, size: usize, unit: f64) -> Self {
        Self {
            in_p,
            in_q,
            size,
            unit,
        }
    }
}

impl<A, B, F, G> Family2 for Crossed<A, B>
where
    A: Fn(f64) -> F,
    B: Fn(f64) -> G,
    F: Family,
    G: Family,
{
    fn size(&self) -> usize {
        self.size
    }

    fn linearised(&self, x: &DVector<f64>, p: f64, q: f64) -> Result<Linearised2> {
        let p = p * self.unit;
        let at = (self.in_p)(q).linearised(x, p)?;
        Ok(Linearised2 {
            residual: at.residual,
            jacobian: at.jacobian,
            slope_p: at.slope * self.unit,
            slope_q: (self.in_q)(p).linearised(x, q)?.slope,
        })
    }

    fn index(&self, x: &DVector<f64>, p: f64, q: f64) -> Result<Option<usize>> {
        (self.in_p)(q).index(x, p * self.unit)
    }
}

/// The folds of F(., ., q) as a family, with unknowns (x, p) in R^(N + 1) and parameter q: F = 0 and g = 0, g the
/// smallest singular value of F_x with the sign of det F_x.
///
/// Follow it with [`super::arclength::Continuation`], starting from a located fold. Folds of this branch are turns of
/// the curve in q, its events are cusps. g is exact; only its gradient comes from central differences (of F_x along
/// the kernel: one evaluation here costs three of F). Folds are therefore as accurate as F_x. At a cusp p and q are
/// accurate to second order, x to about 1e-7.
pub struct FoldCurve<'a> {
    family: &'a dyn Family2,
    /// The last kernel, which gives the test function of cusps a consistent sign.
    kernel: RefCell<Option<DVector<f64>>>,
}

/// The smallest singular value and its vectors.
struct Smallest {
    left: DVector<f64>,
    right: DVector<f64>,
    /// left . F_x right; left and right are oriented to give the sign of det F_x.
    value: f64,
}

impl Smallest {
    fn of(jacobian: &DMatrix<f64>) -> Self {
        let svd = Svd::new(jacobian);
        let orientation = (svd.left.determinant() * svd.right.determinant()).signum();
        let column = |m: &DMatrix<f64>| m.column(m.ncols() - 1).into_owned();
        let left = column(&svd.left) * orientation;
        let right = column(&svd.right);
        Self {
            value: left.dot(&(jacobian * &right)),
            left,
            right,
        }
    }
}

impl<'a> FoldCurve<'a> {
    /// (x, p) as one vector.
    pub fn unknowns(x: &DVector<f64>, p: f64) -> DVector<f64> {
        x.clone().push(p)
    }

    /// x and p of one vector.
    pub fn parts(y: &DVector<f64>) -> (DVector<f64>, f64) {
        let size = y.len() - 1;
        (y.rows(0, size).into_owned(), y[size])
    }

    /// The fold curves of a family.
    pub fn new(family: &'a dyn Family2) -> Self {
        Self {
            family,
            kernel: RefCell::new(None),
        }
    }

    /// Morse indices of the two solutions that meet at a fold, the lower one first. None if the family has none, or
    /// if they do not differ by one. At a cusp, where three solutions meet, they are meaningless.
    ///
    /// # Errors
    /// As [`Family2::linearised`] and [`Family2::index`].
    pub fn indices(&self, y: &DVector<f64>, q: f64) -> Result<Option<(usize, usize)>> {
        let (x, p) = Self::parts(y);
        let right = Smallest::of(&self.at(&x, p, q)?.jacobian).right;
        let h = 1e-4 * (1.0 + x.norm());
        let beside = |h: f64| self.family.index(&(&x + &right * h), p, q);
        // Indices that do not differ by one do not belong to this fold: another fold is near, or the indices are too
        // inaccurate.
        Ok(beside(h)?
            .zip(beside(-h)?)
            .map(|(a, b)| (a.min(b), a.max(b)))
            .filter(|(a, b)| a + 1 == *b))
    }

    fn at(&self, x: &DVector<f64>, p: f64, q: f64) -> Result<Linearised2> {
        let at = self.family.linearised(x, p, q)?;
        let slopes = at.slope_p.iter().chain(at.slope_q.iter());
        let mut all = at.residual.iter().chain(at.jacobian.iter()).chain(slopes);
        if all.all(|v| v.is_finite()) {
            Ok(at)
        } else {
            Err(Error::domain(format!(
                "F or a derivative is not finite at p = {p}, q = {q}, where the largest of {} unknowns is {:.3e}; return an error where F is \
                 undefined",
                x.len(),
                x.amax()
            )))
        }
    }
}

impl Family for FoldCurve<'_> {
    fn size(&self) -> usize {
        self.family.size() + 1
    }

    fn linearised(&self, y: &DVector<f64>, q: f64) -> Result<Linearised> {
        let (x, p) = Self::parts(y);
        let at = self.at(&x, p, q)?;
        let small = Smallest::of(&at.jacobian);
        let h = 3e-5 * (1.0 + x.norm());
        let plus = self.at(&(&x + &small.right * h), p, q)?;
        let minus = self.at(&(&x - &small.right * h), p, q)?;
        let along = |a: f64, b: f64| (a - b) / (2.0 * h);
        // d g = left . d(F_x) right, and by symmetry the derivative of F_x may be taken along right.
        let by_x = (plus.jacobian - minus.jacobian).tr_mul(&small.left) / (2.0 * h);
        let by_p = along(
            small.left.dot(&plus.slope_p),
            small.left.dot(&minus.slope_p),
        );
        let by_q = along(
            small.left.dot(&plus.slope_q),
            small.left.dot(&minus.slope_q),
        );
        let n = x.len();
        let jacobian = DMatrix::from_fn(n + 1, n + 1, |i, j| match (i < n, j < n) {
            (true, true) => at.jacobian[(i, j)],
            (true, false) => at.slope_p[i],
            (false, true) => by_x[j],
            (false, false) => by_p,
        });
        Ok(Linearised {
            residual: Self::unknowns(&at.residual, small.value),
            jacobian,
            slope: Self::unknowns(&at.slope_q, by_q),
        })
    }

    /// Along a fold curve left . (F_p dp + F_q dq) = 0, so (dp, dq) is a multiple of (-left . F_q, left . F_p). The
    /// multiple vanishes at a cusp.
    fn event(&self, y: &DVector<f64>, q: f64, dy: &DVector<f64>, dq: f64) -> Result<Option<f64>> {
        let (x, p) = Self::parts(y);
        let at = self.at(&x, p, q)?;
        let small = Smallest::of(&at.jacobian);
        let mut last = self.kernel.borrow_mut();
        let sign = match &*last {
            Some(kernel) if kernel.dot(&small.right) < 0.0 => -1.0,
            _ => 1.0,
        };
        *last = Some(&small.right * sign);
        let (a, b) = (small.left.dot(&at.slope_p), small.left.dot(&at.slope_q));
        Ok(Some(sign * (a * dq - b * dy[x.len()])))
    }

    fn event_kind(&self) -> SpecialKind {
        SpecialKind::Cusp
    }
}
