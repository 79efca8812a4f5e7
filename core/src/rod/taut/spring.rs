//! Springs beside the end of a taut rod: charts between a force under which it is neutral and its fold.

use crate::error::{Error, Result};
use nalgebra::{Matrix3, Vector3};

/// A spring beside the end of a rod: together they bear the force that is given, n + stiffness (r(1) - at).
///
/// A rod becomes neutral under a given force before it does with its end held in place, for that holds it better: its
/// force is no chart on the way to its fold. What a spring makes of it is one, unless the spring is as soft as the
/// rod is unstable.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Spring {
    /// Force over length; infinite if the end is held at its place.
    pub stiffness: f64,
    /// Where the end is to be for the spring to bear nothing.
    pub at: Vector3<f64>,
}

/// Stiffnesses of springs, over what a string under its pull resists to be moved across.
const SPRINGS: [f64; 7] = [16.0, 4.0, 1.0, 0.25, 0.06, 0.015, 0.004];
/// |1 + k c| over 1 + |k c| at which a spring is taken, and below which it is left.
const REGULAR: (f64, f64) = (0.6, 0.5);

impl Spring {
    /// The stiffness that a spring should have beside a rod that gives way by `give` = d r(1)/d(force given) beside
    /// one of the stiffness `own`, its end held as it is; `string` is what a string under this pull resists to be
    /// moved across, force over length. With hysteresis: a stiff one, beside which nothing happens where the rod
    /// becomes neutral under its force, until it has nearly lost what such a spring gives. With C = d r(1)/dn of the
    /// rod alone it stays away from -1/C.
    pub fn better(give: &Matrix3<f64>, own: f64, string: f64) -> f64 {
        let values = ((give + give.transpose()) * 0.5).symmetric_eigenvalues();
        // Of the rod alone 1/c is less by the spring that stands there.
        let regular = |k: f64| {
            let part = |c: &f64| {
                let (alone, with) = (1.0 - own * c, 1.0 + (k - own) * c);
                with.abs() / (alone.abs() + (k * c).abs())
            };
            values.iter().map(part).fold(1.0, f64::min)
        };
        if own > 0.0 && regular(own) > REGULAR.1 {
            return own;
        }
        let springs = Self::choice(string);
        let found = springs.iter().find(|k| regular(**k) > REGULAR.0);
        *found.unwrap_or(&springs[springs.len() - 1])
    }

    /// The stiffnesses among which [`Spring::better`] chooses, the stiffest first.
    pub(in crate::rod) fn choice(string: f64) -> [f64; SPRINGS.len()] {
        SPRINGS.map(|k| k * string)
    }

    /// None: the force is as given.
    pub const NONE: Self = Self {
        stiffness: 0.0,
        at: Vector3::new(0.0, 0.0, 0.0),
    };

    /// d r(1)/dn of the rod alone, of which the spring makes `give` = C (1 + k C)^-1.
    pub(in crate::rod) fn alone(&self, give: &Matrix3<f64>) -> Result<Matrix3<f64>> {
        let left = Matrix3::identity() - give * self.stiffness;
        let inverse = left.try_inverse().ok_or_else(|| {
            Error::ill_conditioned(
                "the index of a taut rod is undefined: it is neutral under its force",
            )
        })?;
        Ok(give * inverse)
    }
}
