//! Stiffness of the elastica's end, in closed form.
//!
//! Units: length 1, bending stiffness 1.

use super::chart::ChartPoint;
use super::straight_beam::EULER;
use crate::error::{Error, Result};
use crate::math::small_sort::sort_few;
use nalgebra::{Matrix2, Vector2};

/// Linear response of an equilibrium to displacements of its end.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct EndStiffness {
    /// Stiffness K = -df/d(x, y), f the force of the rod on its end; symmetric.
    pub matrix: Matrix2<f64>,
    /// d(p, w)/d(x, y).
    pub chart: Matrix2<f64>,
    /// det K, of full relative accuracy also near the straight rod, which is stiffer along itself by 1/kappa^2.
    pub determinant: f64,
}

/// Bound of |det| relative to its terms, for the chart's Jacobian: smaller values are zero to rounding.
const SINGULAR: f64 = 1e-12;

/// Derivative df/d(p, w), f the force of the rod on its end.
pub fn force_by_chart(at: &ChartPoint) -> Matrix2<f64> {
    let i = &at.integrals;
    let along = Vector2::new(at.cos_alpha, at.sin_alpha);
    let aside = Vector2::new(-at.sin_alpha, at.cos_alpha);
    // f = lam^2 (cos alpha, sin alpha), sin(alpha/2) = -kap cos w.
    let alpha_p = -2.0 * i.kap_c * i.kap_c * i.c / i.d;
    let alpha_w = 2.0 * i.kap * i.s / i.d;
    let column = |lam: f64, alpha: f64| (along * (2.0 * lam) + aside * (i.lam * alpha)) * i.lam;
    Matrix2::from_columns(&[column(i.lam_p(), alpha_p), column(1.0 / i.d, alpha_w)])
}

impl EndStiffness {
    /// Stiffness at the chart point (p, w), by exact derivatives of the closed form. The relative error of the
    /// principal stiffnesses is rounding over the distance from the next fold, and over |kappa| near the straight
    /// rod.
    ///
    /// # Errors
    /// A fold, where the stiffness is infinite along one direction; a rod straight to rounding, which is rigid along
    /// itself.
    pub fn at(p: f64, w: f64) -> Result<Self> {
        let at = ChartPoint::new(p, w);
        let [a, b] = [at.column_p, at.column_w].map(Vector2::from);
        // Near the straight rod both terms are small, and do not cancel.
        let terms = (a.x * b.y).abs() + (a.y * b.x).abs();
        let jacobian = Matrix2::from_columns(&[a, b]);
        let chart = jacobian
            .try_inverse()
            .filter(|_| a.perp(&b).abs() > SINGULAR * terms);
        let chart = chart.ok_or_else(|| {
            Error::ill_conditioned(
                "the rod is at a fold, or straight to rounding: its end is held infinitely stiff along one direction; move the \
                 equilibrium a little by its load",
            )
        })?;
        let force = force_by_chart(&at);
        Ok(Self {
            matrix: force * -chart,
            chart,
            determinant: force.determinant() * chart.determinant(),
        })
    }

    /// Principal stiffnesses, ascending, with their directions of length 1.
    pub fn principal(&self) -> [(f64, Vector2<f64>); 2] {
        let symmetric: Matrix2<f64> = (self.matrix + self.matrix.transpose()) * 0.5;
        let eigen = symmetric.symmetric_eigen();
        let of = |k: usize| eigen.eigenvectors.column(k).into_owned();
        let large = eigen.eigenvalues.iamax();
        let largest = eigen.eigenvalues[large];
        // The smaller from the product: a difference would carry the rounding error of the larger.
        let other = if largest == 0.0 {
            0.0
        } else {
            self.determinant / largest
        };
        let mut both = [(other, of(1 - large)), (largest, of(large))];
        sort_few(&mut both, |each| each.0);
        both
    }
}

/// Stiffness of the straight rod's end across the rod, under the pull N (a push: N < 0): N b/(b - tanh b), b^2 = N.
/// Evaluated by the continued fraction of tanh, which keeps its digits through N = 0; it vanishes at Euler's load.
pub fn transverse_stiffness(pull: f64) -> f64 {
    let terms = 20 + pull.abs().sqrt() as usize;
    let tail = (2..terms)
        .rev()
        .fold(0.0, |tail, k| pull / (f64::from(2 * k as u32 + 1) + tail));
    pull + 3.0 + tail
}

/// Morse index of the straight rod with a free end under the pull N: the number of Euler's loads (k - 1/2)^2 pi^2
/// below the push.
pub fn straight_index(pull: f64) -> usize {
    if pull >= -EULER {
        return 0;
    }
    ((-pull).sqrt() / std::f64::consts::PI + 0.5).floor() as usize
}
