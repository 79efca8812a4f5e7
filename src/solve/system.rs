//! Systems of differential equations of run-time dimension, y' = f(y), and their linearisation.

use nalgebra::{ComplexField, DMatrix, DVector, Dyn};

/// An autonomous system; where time matters it is a component of y.
pub trait System {
    /// Its Jacobian, in whatever form it is best factored.
    type Linearised: Linearised;

    /// f(y) into `out`; None outside its domain (shortens the step).
    fn slope(&self, y: &DVector<f64>, out: &mut DVector<f64>) -> Option<()>;

    /// The Jacobian at y.
    fn linearised(&self, y: &DVector<f64>) -> Option<Self::Linearised>;

    /// Weighted mean square of an error, in units in which 1 is the size of the state.
    fn mean_square(&self, error: &DVector<f64>, from: &DVector<f64>, to: &DVector<f64>) -> f64;
}

/// A Jacobian J.
pub trait Linearised {
    /// sigma - J, factored.
    type Factor<T: ComplexField<RealField = f64> + Copy>: Factor<T>;

    /// sigma - J, factored; None if singular.
    fn shifted<T: ComplexField<RealField = f64> + Copy>(&self, sigma: T)
    -> Option<Self::Factor<T>>;

    /// J x.
    fn times(&self, x: &DVector<f64>) -> DVector<f64>;
}

/// A factored matrix.
pub trait Factor<T> {
    /// Solves in place; false if singular.
    fn solve(&self, b: &mut DVector<T>) -> bool;
}

impl Linearised for DMatrix<f64> {
    type Factor<T: ComplexField<RealField = f64> + Copy> = nalgebra::LU<T, Dyn, Dyn>;

    fn shifted<T: ComplexField<RealField = f64> + Copy>(
        &self,
        sigma: T,
    ) -> Option<Self::Factor<T>> {
        let mut matrix = self.map(|x| T::from_real(-x));
        for i in 0..self.nrows() {
            matrix[(i, i)] += sigma;
        }
        Some(matrix.lu())
    }

    fn times(&self, x: &DVector<f64>) -> DVector<f64> {
        self * x
    }
}

impl<T: ComplexField> Factor<T> for nalgebra::LU<T, Dyn, Dyn> {
    fn solve(&self, b: &mut DVector<T>) -> bool {
        self.solve_mut(b)
    }
}
