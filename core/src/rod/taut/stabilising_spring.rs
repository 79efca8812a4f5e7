//! Springs beside the end of a taut rod: charts between the force under which the rod is neutral and its fold.

use crate::error::{Error, Result};
use nalgebra::{Matrix3, Vector3};

/// A spring beside the end of a rod: together they bear the given force, n + stiffness (r(1) - at).
///
/// A rod becomes neutral under a given force before it does with its end held in place, for the held end stabilises
/// it: its force is no chart on the way to its fold. The total force on rod and spring is a chart, unless the spring
/// is as soft as the rod is unstable.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Spring {
    /// Force over length; infinite if the end is held at its place.
    pub stiffness: f64,
    /// Position of the end at which the spring bears nothing.
    pub at: Vector3<f64>,
}

/// Stiffnesses of springs, over the transverse stiffness of a string under the same pull.
const SPRINGS: [f64; 7] = [16.0, 4.0, 1.0, 0.25, 0.06, 0.015, 0.004];
/// Least |1 + k c| over 1 + |k c| of a chosen spring, and the value below which a spring is replaced.
const REGULAR: (f64, f64) = (0.6, 0.5);

impl Spring {
    /// Best stiffness of the spring beside a rod. `give` = d r(1)/d(given force) is the compliance beside a spring of
    /// the stiffness `own`; `string` is the transverse stiffness of a string under this pull, force over length.
    /// Chosen with hysteresis: a stiff spring stays in use, through the neutral point under the force, until its
    /// regularity is nearly lost. With C = d r(1)/dn of the rod alone the stiffness stays away from -1/C.
    pub fn best_stiffness(give: &Matrix3<f64>, own: f64, string: f64) -> f64 {
        let values = ((give + give.transpose()) * 0.5).symmetric_eigenvalues();
        // 1/c of the rod alone is less by the stiffness `own`.
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

    /// Stiffnesses among which [`Spring::best_stiffness`] chooses, the stiffest first.
    pub(in crate::rod) fn choice(string: f64) -> [f64; SPRINGS.len()] {
        SPRINGS.map(|k| k * string)
    }

    /// No spring: the rod bears the given force alone.
    pub const NONE: Self = Self {
        stiffness: 0.0,
        at: Vector3::new(0.0, 0.0, 0.0),
    };

    /// Compliance C = d r(1)/dn of the rod alone, of which the spring makes `give` = C (1 + k C)^-1.
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
