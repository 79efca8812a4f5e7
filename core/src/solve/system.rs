//! Systems of run-time dimension, y' = f(y), and their Jacobians in the form that is best factored.

use super::lu::Lu;
use nalgebra::{Complex, DMatrix, DVector};

pub use crate::math::fixed::Scalar;

/// An autonomous system y' = f(y) of any dimension; time is a component of y where it is needed.
pub trait System {
    /// The Jacobian df/dy.
    type Linearised: Linearised + 'static;

    /// f(y) into `out`, of the same length as `y`; None outside its domain, which shortens the step.
    fn slope(&self, y: &DVector<f64>, out: &mut DVector<f64>) -> Option<()>;

    /// The Jacobian at y. It drives an iteration only: errors in it cost time, not accuracy. Rows of components that
    /// nothing depends on (quadratures) may be left zero.
    fn linearised(&self, y: &DVector<f64>) -> Option<Self::Linearised>;

    /// The Jacobian without what costs much and counts little in most steps: Newton's iteration tries it first. None
    /// if there is none that is cheaper.
    fn roughly_linearised(&self, _y: &DVector<f64>) -> Option<Self::Linearised> {
        None
    }

    /// How many components at the end of y are algebraic, in the form that implicit steps take: y' = f(y, a), 0 =
    /// g(y, a). In the form of [`System::slope`] nothing depends on them.
    fn algebraic(&self) -> usize {
        0
    }

    /// f(y, a), and g(y, a) in the places of the algebraic components.
    fn balance(&self, y: &DVector<f64>, out: &mut DVector<f64>) -> Option<()> {
        self.slope(y, out)
    }

    /// [`System::balance`] of several states, as those of the stages of a step; None if one of them has none.
    fn balances(&self, states: &[DVector<f64>], out: &mut [DVector<f64>]) -> Option<()> {
        let mut states = states.iter().zip(out);
        states.try_for_each(|(y, out)| self.balance(y, out))
    }

    /// Makes y fit for [`System::balance`]: algebraic components that solve it, and what else only that form depends
    /// on.
    fn settle(&self, _y: &mut DVector<f64>) -> Option<()> {
        Some(())
    }

    /// Weighted mean square of an error made between the states `from` and `to`; the tolerance bounds its root. It is
    /// a sum of multiples of the squares of the components: that of several errors, in the mean, is that of the root
    /// mean squares of their components.
    fn mean_square(&self, error: &DVector<f64>, from: &DVector<f64>, to: &DVector<f64>) -> f64;
}

/// A Jacobian J.
pub trait Linearised {
    /// sigma - J of the form of [`System::balance`], ready to be solved with; without sigma in the rows of algebraic
    /// components.
    type Factor<T: Scalar>: Factor<T> + 'static;

    /// sigma - J, factored; None if it is singular.
    fn shifted<T: Scalar>(&self, sigma: T) -> Option<Self::Factor<T>>;

    /// Rounding of the solutions of steps of length `h` beyond that of the components themselves, in units of
    /// [`System::mean_square`]: increments of this size say nothing.
    fn rounding(&self, _h: f64) -> f64 {
        0.0
    }

    /// J x, of the form of [`System::slope`].
    fn times(&self, x: &DVector<f64>) -> DVector<f64>;
}

/// A factored matrix.
pub trait Factor<T> {
    /// Overwrites the right-hand side `b` with the solution; false if that failed.
    fn solve(&self, b: &mut DVector<T>) -> bool;
}

/// A [`System`] as the integrator sees it, without its types: the integrator is compiled once for all of them. Every
/// system is one.
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
}

/// A [`Linearised`] without its types.
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

/// Products of a power iteration, and how many of the last are averaged: growth under a matrix that is far from
/// normal alternates.
const PRODUCTS: usize = 8;
const AVERAGED: usize = 4;
/// By this factor growth may exceed the spectral radius in a product.
const WELL_BEYOND: f64 = 10.0;

/// The spectral radius of J by power iteration, mostly to some 10 %; one that is seen to be well beyond `enough` is
/// left at that. `vector` is where the last one of a similar J ended; any other length starts afresh.
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
    // A small part of every direction is added: the vector of the last iteration may lack the one that is dominant now.
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
