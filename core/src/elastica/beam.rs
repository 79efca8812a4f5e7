//! Straight rod as a beam under a pull N along it, for small deflections y of its end (theory 2.3): cross force k(N)
//! y, 1 - x = c(N) y^2, with k' = 2 c.

use super::straight_chart::{Moments, SERIES_MAX_PULL};
use crate::manifold::AxialConstraint;
use nalgebra::Vector2;

/// Least pull at which the end counts as held along the axis, somewhat above [`BUCKLED`].
pub(super) const MOST_HELD: f64 = -19.0;
/// Pull at which the rod buckles with its end on the axis, -b*^2 for tan b* = b*: c and k are infinite there.
pub(super) const BUCKLED: f64 = -BUCKLED_ROOT * BUCKLED_ROOT;
const BUCKLED_ROOT: f64 = 4.493_409_457_909_064;
/// sqrt(N) beyond which exp(-sqrt(N)) is below rounding.
const TAUT_ROOT: f64 = 40.0;

/// Coefficients of the straight rod as a beam.
pub(super) struct Beam {
    /// k(N).
    pub stiffness: f64,
    /// c(N).
    pub shortening: f64,
    /// dc/dN; negative.
    pub softening: f64,
    /// Stored energy over y^2, k/2 - N c.
    pub stored: f64,
}

impl Beam {
    /// Beam under the pull [`BUCKLED`] + `more`, for any `more` > 0: to full relative accuracy also where c and k are
    /// large.
    pub fn new(more: f64) -> Self {
        let pull = more + BUCKLED;
        if pull > TAUT_ROOT * TAUT_ROOT {
            return Self::taut(pull);
        }
        let Moments { g, m, slope } = Moments::new(pull);
        let rise = if pull < -SERIES_MAX_PULL {
            // (cos b - sin b/b)/(cos b - 1) at b = b* - e.
            let root = (-pull).sqrt();
            let e = more / (BUCKLED_ROOT + root);
            let (sin, cos) = e.sin_cos();
            let scaled = sin - e * cos + BUCKLED_ROOT * root * sin;
            BUCKLED_ROOT.cos() * scaled / (root * (root.cos() - 1.0))
        } else {
            1.0 - m[1]
        };
        let shortening = 0.5 * (1.0 - 2.0 * m[1] + m[2]) / (rise * rise);
        let stiffness = (pull + 0.5 * g) / rise;
        Self {
            stiffness,
            shortening,
            softening: (slope[2] - 2.0 * slope[1]) / (2.0 * rise * rise)
                + 2.0 * shortening * slope[1] / rise,
            stored: 0.5 * stiffness - pull * shortening,
        }
    }

    /// Beam without terms of order exp(-sqrt(N)).
    fn taut(pull: f64) -> Self {
        let u = 1.0 / pull.sqrt();
        let rest = 1.0 - u;
        Self {
            stiffness: pull / rest,
            shortening: (1.0 - 1.5 * u) / (2.0 * rest * rest),
            softening: -u.powi(3) * (1.0 - 3.0 * u) / (8.0 * rest.powi(3)),
            stored: 0.25 / (u * rest * rest),
        }
    }
}

/// Straight rod under `pull`; `None` from [`MOST_HELD`] down, close to the push at which the rod buckles with its end
/// on the axis and beyond: the end is not held along the rod there.
pub(super) fn straight_rod_constraint(pull: f64) -> Option<AxialConstraint<2>> {
    (pull > MOST_HELD).then(|| {
        let beam = Beam::new(pull - BUCKLED);
        AxialConstraint {
            pose: Vector2::x(),
            along: Vector2::x(),
            across: Vector2::y(),
            stiffness: beam.stiffness,
            shortening: beam.shortening,
            softening: beam.softening,
        }
    })
}
