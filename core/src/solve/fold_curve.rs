//! Curves of folds in two parameters: F(x, p, q) = 0 with F_x singular, continued in q.

use super::elimination::Svd;
use super::family::{Family, Linearised};
use super::special::SpecialKind;
use crate::error::{Error, Result};
use nalgebra::{DMatrix, SMatrix, SVector};
use std::cell::RefCell;

/// F and its first derivatives at one (x, p, q).
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Linearised2<const N: usize> {
    /// F(x, p, q).
    pub residual: SVector<f64, N>,
    /// dF/dx.
    pub jacobian: SMatrix<f64, N, N>,
    /// dF/dp.
    pub slope_p: SVector<f64, N>,
    /// dF/dq.
    pub slope_q: SVector<f64, N>,
}

/// F(x, p, q) = 0 with two parameters.
pub trait Family2<const N: usize> {
    /// F with its first derivatives.
    ///
    /// # Errors
    /// F is undefined here.
    fn linearised(&self, x: &SVector<f64, N>, p: f64, q: f64) -> Result<Linearised2<N>>;

    /// The Morse index of the solution (x, p, q), or None if the family has none.
    ///
    /// # Errors
    /// The index cannot be found here.
    fn index(&self, _x: &SVector<f64, N>, _p: f64, _q: f64) -> Result<Option<usize>> {
        Ok(None)
    }
}

/// A family in two parameters made of families in each of them, with the same unknowns: `in_p(q)` has the
/// parameter p, `in_q(p)` the parameter q. Costs an evaluation of both.
pub struct Crossed<A, B> {
    in_p: A,
    in_q: B,
    unit: f64,
}

impl<A, B> Crossed<A, B> {
    /// p is counted in `unit`s (not 0) of the families' own, so that it is of the size of the unknowns.
    pub fn new(in_p: A, in_q: B, unit: f64) -> Self {
        Self { in_p, in_q, unit }
    }
}

impl<A, B, F, G, const N: usize> Family2<N> for Crossed<A, B>
where
    A: Fn(f64) -> F,
    B: Fn(f64) -> G,
    F: Family<N>,
    G: Family<N>,
{
    fn linearised(&self, x: &SVector<f64, N>, p: f64, q: f64) -> Result<Linearised2<N>> {
        let p = p * self.unit;
        let at = (self.in_p)(q).linearised(x, p)?;
        Ok(Linearised2 {
            residual: at.residual,
            jacobian: at.jacobian,
            slope_p: at.slope * self.unit,
            slope_q: (self.in_q)(p).linearised(x, q)?.slope,
        })
    }

    fn index(&self, x: &SVector<f64, N>, p: f64, q: f64) -> Result<Option<usize>> {
        (self.in_p)(q).index(x, p * self.unit)
    }
}

/// The folds of F(., ., q) as a family of its own, with unknowns (x, p) in R^M, M = N + 1, and
/// parameter q: F = 0 and g = 0, g the smallest singular value of F_x with the sign of det F_x.
///
/// Follow it with [`super::arclength::Continuation`], starting from a located fold; folds of this branch
/// are turns of the curve in q, its events are cusps. g is exact; only its gradient comes from
/// central differences (of F_x along the kernel: one evaluation here costs three of F), so that
/// folds are as accurate as F_x. At a cusp p and q are accurate to second order, x to about 1e-7.
pub struct FoldCurve<'a, const N: usize, const M: usize> {
    family: &'a dyn Family2<N>,
    /// The kernel where it was last asked for: gives the test function of cusps a steady sign.
    kernel: RefCell<Option<SVector<f64, N>>>,
}

/// The smallest singular value and its vectors.
struct Smallest<const N: usize> {
    left: SVector<f64, N>,
    right: SVector<f64, N>,
    /// left . F_x right, with left and right oriented so that its sign is that of det F_x.
    value: f64,
}

impl<const N: usize> Smallest<N> {
    fn of(jacobian: &SMatrix<f64, N, N>) -> Self {
        let svd = Svd::new(&DMatrix::from_column_slice(N, N, jacobian.as_slice()));
        let orientation = (svd.left.determinant() * svd.right.determinant()).signum();
        let column = |m: &DMatrix<f64>| {
            let column = m.column(N - 1);
            SVector::from_fn(|i, _| column[i])
        };
        let left: SVector<f64, N> = column(&svd.left) * orientation;
        let right = column(&svd.right);
        Self {
            value: left.dot(&(jacobian * right)),
            left,
            right,
        }
    }
}

impl<const N: usize, const M: usize> FoldCurve<'_, N, M> {
    /// (x, p) as one vector.
    pub fn unknowns(x: &SVector<f64, N>, p: f64) -> SVector<f64, M> {
        SVector::from_fn(|i, _| if i < N { x[i] } else { p })
    }

    /// x and p of one vector.
    pub fn parts(y: &SVector<f64, M>) -> (SVector<f64, N>, f64) {
        (SVector::from_fn(|i, _| y[i]), y[N])
    }
}

impl<'a, const N: usize, const M: usize> FoldCurve<'a, N, M> {
    /// The fold curves of a family. M must be N + 1, or this does not compile.
    pub fn new(family: &'a dyn Family2<N>) -> Self {
        const { assert!(M == N + 1, "unknowns of a fold curve are (x, p): M = N + 1") };
        Self {
            family,
            kernel: RefCell::new(None),
        }
    }

    /// Morse indices of the two solutions that meet at a fold, the lower one first; none if the family has none, or if
    /// they cannot be told apart. At a cusp, where three meet, they mean nothing.
    ///
    /// # Errors
    /// As [`Family2::linearised`] and [`Family2::index`].
    pub fn indices(&self, y: &SVector<f64, M>, q: f64) -> Result<Option<(usize, usize)>> {
        let (x, p) = Self::parts(y);
        let right = Smallest::of(&self.at(&x, p, q)?.jacobian).right;
        let h = 1e-4 * (1.0 + x.norm());
        let beside = |h: f64| self.family.index(&(x + right * h), p, q);
        // Two that do not differ by one are not those of this fold: another is near, or the index is not known that well.
        Ok(beside(h)?
            .zip(beside(-h)?)
            .map(|(a, b)| (a.min(b), a.max(b)))
            .filter(|(a, b)| a + 1 == *b))
    }

    fn at(&self, x: &SVector<f64, N>, p: f64, q: f64) -> Result<Linearised2<N>> {
        let at = self.family.linearised(x, p, q)?;
        let slopes = at.slope_p.iter().chain(at.slope_q.iter());
        let mut all = at.residual.iter().chain(at.jacobian.iter()).chain(slopes);
        if all.all(|v| v.is_finite()) {
            Ok(at)
        } else {
            Err(Error::domain(format!(
                "F or a derivative is not finite at x = {:?}, p = {p}, q = {q}; return an error where F is undefined",
                x.as_slice()
            )))
        }
    }
}

impl<const N: usize, const M: usize> Family<M> for FoldCurve<'_, N, M> {
    fn linearised(&self, y: &SVector<f64, M>, q: f64) -> Result<Linearised<M>> {
        let (x, p) = Self::parts(y);
        let at = self.at(&x, p, q)?;
        let small = Smallest::of(&at.jacobian);
        let h = 3e-5 * (1.0 + x.norm());
        let plus = self.at(&(x + small.right * h), p, q)?;
        let minus = self.at(&(x - small.right * h), p, q)?;
        let along = |a: f64, b: f64| (a - b) / (2.0 * h);
        // d g = left . d(F_x) right, and by symmetry F_x's derivative may be taken along right.
        let by_x = (plus.jacobian - minus.jacobian).tr_mul(&small.left) / (2.0 * h);
        let by_p = along(
            small.left.dot(&plus.slope_p),
            small.left.dot(&minus.slope_p),
        );
        let by_q = along(
            small.left.dot(&plus.slope_q),
            small.left.dot(&minus.slope_q),
        );
        let jacobian = SMatrix::from_fn(|i, j| match (i < N, j < N) {
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

    /// Along a fold curve left . (F_p dp + F_q dq) = 0, so (dp, dq) is a multiple of (-left . F_q, left . F_p):
    /// the multiple, which vanishes at a cusp.
    fn event(
        &self,
        y: &SVector<f64, M>,
        q: f64,
        (dy, dq): (&SVector<f64, M>, f64),
    ) -> Result<Option<f64>> {
        let (x, p) = Self::parts(y);
        let at = self.at(&x, p, q)?;
        let small = Smallest::of(&at.jacobian);
        let mut last = self.kernel.borrow_mut();
        let sign = match *last {
            Some(kernel) if kernel.dot(&small.right) < 0.0 => -1.0,
            _ => 1.0,
        };
        *last = Some(small.right * sign);
        let (a, b) = (small.left.dot(&at.slope_p), small.left.dot(&at.slope_q));
        Ok(Some(sign * (a * dq - b * dy[N])))
    }

    fn event_kind(&self) -> SpecialKind {
        SpecialKind::Cusp
    }
}
