//! First and second derivatives of a user's potential in six variables, by hyper-dual numbers: exact to rounding.

use nalgebra::{Matrix6, Vector6};
use num_dual::HyperDual64;

type Six = [HyperDual64; 6];

fn constant(x: &Vector6<f64>) -> Six {
    std::array::from_fn(|k| x[k].into())
}

/// f, df/dx, d2f/dx2 at x: 21 evaluations.
pub(in crate::section) fn jet(
    f: impl Fn(&Six) -> HyperDual64,
    x: &Vector6<f64>,
) -> (f64, Vector6<f64>, Matrix6<f64>) {
    let mut value = 0.0;
    let mut slope = Vector6::zeros();
    let mut curvature = Matrix6::zeros();
    for i in 0..6 {
        for j in 0..=i {
            let mut at = constant(x);
            at[i] = at[i].derivative1();
            at[j] = at[j].derivative2();
            let here = f(&at);
            value = here.re;
            slope[i] = here.eps1;
            curvature[(i, j)] = here.eps1eps2;
            curvature[(j, i)] = here.eps1eps2;
        }
    }
    (value, slope, curvature)
}

/// d2f/dx dy at (x, y): 36 evaluations.
pub(in crate::section) fn mixed_derivatives(
    f: impl Fn(&Six, &Six) -> HyperDual64,
    x: &Vector6<f64>,
    y: &Vector6<f64>,
) -> Matrix6<f64> {
    Matrix6::from_fn(|i, j| {
        let [mut x, mut y] = [constant(x), constant(y)];
        x[i] = x[i].derivative1();
        y[j] = y[j].derivative2();
        f(&x, &y).eps1eps2
    })
}
