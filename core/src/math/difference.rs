//! Derivative by a symmetric difference of order 4.

use std::ops::{Add, Mul};

/// Weights of the differences over one step and over two.
const WEIGHTS: [f64; 2] = [2.0 / 3.0, -1.0 / 12.0];

/// f'(0) from `change(h) = f(h) - f(-h)` at one and at two steps, with an error of step^4 f^(5)/30. `None` where a
/// change is not known.
pub fn derivative<T: Add<Output = T> + Mul<f64, Output = T>>(
    step: f64,
    mut change: impl FnMut(f64) -> Option<T>,
) -> Option<T> {
    let [near, far] = WEIGHTS.map(|weight| weight / step);
    Some(change(step)? * near + change(2.0 * step)? * far)
}

#[cfg(test)]
mod tests {
    use super::derivative;

    /// Catches wrong weights: the rule is exact for polynomials up to degree 4, and of order 4 for the exponential.
    #[test]
    fn the_difference_has_order_4() {
        let cubic = |x: f64| 3.0 * x - 2.0 * x.powi(3);
        let exact = derivative(0.5, |h| Some(cubic(h) - cubic(-h))).unwrap();
        assert!((exact - 3.0).abs() < 1e-13, "{exact}");
        let of = |step| derivative(step, |h: f64| Some(h.exp() - (-h).exp())).unwrap() - 1.0;
        let order = (of(0.2) / of(0.1)).log2();
        assert!((order - 4.0).abs() < 0.05, "{order}");
    }
}
