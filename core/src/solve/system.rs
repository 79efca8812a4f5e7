//! Systems of run-time dimension, y' = f(y), and their Jacobians in the form that is best factored.

use super::lu::Lu;
use nalgebra::{Complex, DMatrix, DVector};

pub use crate::math::small_matrices::Scalar;

/// An autonomous system y' = f(y) of any dimension; time, if needed, is a component of y.
pub trait System {
    /// The Jacobian df/dy.
    type Linearised: Linearised + 'static;

    /// f(y) into `out`, of the same length as `y`; None outside the domain, which shortens the step.
    fn slope(&self, y: &DVector<f64>, out: &mut DVector<f64>) -> Option<()>;

    /// The Jacobian at y. It drives an iteration only: its errors cost time, not accuracy. Rows of quadratures, on
    /// which nothing depends, may be left zero.
    fn linearised(&self, y: &DVector<f64>) -> Option<Self::Linearised>;

    /// A cheaper Jacobian without costly terms that matter little in most steps: Newton's iteration tries it first.
    /// None if no cheaper one exists.
    fn roughly_linearised(&self, _y: &DVector<f64>) -> Option<Self::Linearised> {
        None
    }

    /// Number of components at the end of y that are algebraic in the form for implicit steps: y' = f(y, a), 0 = g(y,
    /// a). In the form of [`System::slope`] nothing depends on them.
    fn algebraic(&self) -> usize {
        0
    }

    /// f(y, a), and g(y, a) in the components of a.
    fn balance(&self, y: &DVector<f64>, out: &mut DVector<f64>) -> Option<()> {
        self.slope(y, out)
    }

    /// [`System::balance`] of several states, such as the stages of a step; None if one is undefined.
    fn balances(&self, states: &[DVector<f64>], out: &mut [DVector<f64>]) -> Option<()> {
        let mut states = states.iter().zip(out);
        states.try_for_each(|(y, out)| self.balance(y, out))
    }

    /// Prepares y for [`System::balance`]: solves for the algebraic components and updates others used by that form
    /// alone.
    fn settle(&self, _y: &mut DVector<f64>) -> Option<()> {
        Some(())
    }

    /// Weighted mean square of an error between the states `from` and `to`; the tolerance bounds its root. It is a
    /// sum of multiples of the squared components. The mean over several errors is thus that of the root mean squares
    /// of their components.
    fn mean_square(&self, error: &DVector<f64>, from: &DVector<f64>, to: &DVector<f64>) -> f64;

    /// Weighted mean square of an increment of the stages of a step of length `h` from the state `at`: a sum as
    /// [`System::mean_square`]. Newton's iteration ends by this norm.
    fn increment_square(&self, increment: &DVector<f64>, at: &DVector<f64>, _h: f64) -> f64 {
        self.mean_square(increment, at, at)
    }
}

/// A Jacobian J.
pub trait Linearised {
    /// Factors of sigma - J in the form of [`System::balance`]; without sigma in the rows of algebraic components.
    type Factor<T: Scalar>: Factor<T> + 'static;

    /// sigma - J, factored; None if it is singular.
    fn shifted<T: Scalar>(&self, sigma: T) -> Option<Self::Factor<T>>;

    /// Rounding of the solutions of steps of length `h` beyond that of the components themselves, in units of
    /// [`System::mean_square`]: increments of this size are meaningless.
    fn rounding(&self, _h: f64) -> f64 {
        0.0
    }

    /// J x, of the form of [`System::slope`].
    fn times(&self, x: &DVector<f64>) -> DVector<f64>;
}

/// A factored matrix.
pub trait Factor<T> {
    /// Overwrites the right-hand side `b` with the solution; false on failure.
    fn solve(&self, b: &mut DVector<T>) -> bool;
}

/// Object-safe form of [`System`]: the integrator is compiled once for all systems. Every system implements it.
pub trait AnySystem {
    /// [`System::slope`].
    fn slope(&self, y: &DVector<f64>, out: &mut DVector<f64>) -> Option<()>;
    /// [`System::linearised`].
    fn linearised(&self, y: &DVector<f64>) -> Option<Box<dyn AnyLinearised>>;
    /// [`System::roughly_linearised`].
    fn roughly_linearised(&self, y: &DVector<f64>) -> Option<Box<dyn AnyLinearised>>;
    /// [`System::algebraic`].
    fn algebraic(&self) -> usize;
    /// [`System::balance`].
    fn balance(&self, y: &DVector<f64>, out: &mut DVector<f64>) -> Option<()>;
    /// [`System::balances`].
    fn balances(&self, states: &[DVector<f64>], out: &mut [DVector<f64>]) -> Option<()>;
    /// [`System::settle`].
    fn settle(&self, y: &mut DVector<f64>) -> Option<()>;
    /// [`System::mean_square`].
    fn mean_square(&self, error: &DVector<f64>, from: &DVector<f64>, to: &DVector<f64>) -> f64;
    /// [`System::increment_square`].
    fn increment_square(&self, increment: &DVector<f64>, at: &DVector<f64>, h: f64) -> f64;
}

/// Object-safe form of [`Linearised`].
pub trait AnyLinearised {
    /// [`Linearised::shifted`] by a real number.
    fn real(&self, sigma: f64) -> Option<Box<dyn Factor<f64>>>;
    /// [`Linearised::shifted`] by a complex number.
    fn complex(&self, sigma: Complex<f64>) -> Option<Box<dyn Factor<Complex<f64>>>>;
    /// [`Linearised::rounding`].
    fn rounding(&self, h: f64) -> f64;
    /// [`Linearised::times`].
    fn times(&self, x: &DVector<f64>) -> DVector<f64>;
}

impl<S: System> AnySystem for S {
    fn slope(&self, y: &DVector<f64>, out: &mut DVector<f64>) -> Option<()> {
        System::slope(self, y, out)
    }

    fn linearised(&self, y: &DVector<f64>) -> Option<Box<dyn AnyLinearised>> {
        Some(Box::new(System::linearised(self, y)?))
    }

    fn roughly_linearised(&self, y: &DVector<f64>) -> Option<Box<dyn AnyLinearised>> {
        Some(Box::new(System::roughly_linearised(self, y)?))
    }

    fn algebraic(&self) -> usize {
        System::algebraic(self)
    }

    fn balance(&self, y: &DVector<f64>, out: &mut DVector<f64>) -> Option<()> {
        System::balance(self, y, out)
    }

    fn balances(&self, states: &[DVector<f64>], out: &mut [DVector<f64>]) -> Option<()> {
        System::balances(self, states, out)
    }

    fn settle(&self, y: &mut DVector<f64>) -> Option<()> {
        System::settle(self, y)
    }

    fn mean_square(&self, error: &DVector<f64>, from: &DVector<f64>, to: &DVector<f64>) -> f64 {
        System::mean_square(self, error, from, to)
    }

    fn increment_square(&self, increment: &DVector<f64>, at: &DVector<f64>, h: f64) -> f64 {
        System::increment_square(self, increment, at, h)
    }
}

impl<L: Linearised + 'static> AnyLinearised for L {
    fn real(&self, sigma: f64) -> Option<Box<dyn Factor<f64>>> {
        Some(Box::new(self.shifted(sigma)?))
    }

    fn complex(&self, sigma: Complex<f64>) -> Option<Box<dyn Factor<Complex<f64>>>> {
        Some(Box::new(self.shifted(sigma)?))
    }

    fn rounding(&self, h: f64) -> f64 {
        Linearised::rounding(self, h)
    }

    fn times(&self, x: &DVector<f64>) -> DVector<f64> {
        Linearised::times(self, x)
    }
}

impl Linearised for DMatrix<f64> {
    type Factor<T: Scalar> = Lu;

    fn shifted<T: Scalar>(&self, sigma: T) -> Option<Lu> {
        let mut matrix = self.map(|x| T::from_real(-x));
        for i in 0..matrix.nrows() {
            matrix[(i, i)] += sigma;
        }
        Lu::new(&matrix)
    }

    fn times(&self, x: &DVector<f64>) -> DVector<f64> {
        self * x
    }
}

/// Number of products of a power iteration, and number of the last ones averaged: growth under a matrix far from
/// normal alternates.
const PRODUCTS: usize = 8;
const AVERAGED: usize = 4;
/// Factor by which the growth in one product may exceed the spectral radius.
const WELL_BEYOND: f64 = 10.0;

/// Spectral radius of J by power iteration, mostly to some 10 %; the iteration stops early once the radius is well
/// beyond `enough`. `vector` is the last vector for a similar J; any other length starts afresh.
pub(super) fn spectral_radius(
    jacobian: &dyn AnyLinearised,
    vector: &mut DVector<f64>,
    dimension: usize,
    enough: f64,
) -> f64 {
    let afresh = vector.len() != dimension;
    if afresh {
        *vector = DVector::zeros(dimension);
    }
    // A small part of every direction is added: the last vector may lack the direction that is now dominant.
    let share = 0.1 / (dimension.max(1) as f64).sqrt();
    for (i, x) in vector.iter_mut().enumerate() {
        *x += share * (1.0 + 2.0 * i as f64 * i as f64).sin();
    }
    let mut growth = 0.0;
    let norm = vector.norm();
    *vector /= norm;
    for i in 0..PRODUCTS {
        let next = jacobian.times(vector);
        let size = next.norm();
        if size == 0.0 {
            vector.fill(0.0);
            return 0.0;
        }
        if !size.is_finite() {
            vector.fill(0.0);
            return f64::INFINITY;
        }
        *vector = next / size;
        if i == 1 && !afresh && size > WELL_BEYOND * enough {
            return size;
        }
        if i >= PRODUCTS - AVERAGED {
            growth += size.ln() / AVERAGED as f64;
        }
    }
    growth.exp()
}
