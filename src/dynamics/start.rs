//! Starts, and the special care of those that lie on a fold.

use super::motion::Phase;
use super::snap::{aside, fold_sides};
use crate::body::Body;
use crate::error::{Error, Result};
use crate::manifold::{EquilibriumManifold, adjugate_times, invert_near};

/// How a motion gets under way.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum Departure<const N: usize> {
    /// Off all folds.
    Regular {
        /// Sign of det.
        orientation: f64,
    },
    /// From a fold onto the sheet of lower index.
    FromFold {
        /// The state to go on from.
        phase: Phase<N>,
        /// Sign of det on that sheet.
        orientation: f64,
        /// Index on that sheet.
        index: usize,
    },
    /// On a fold, pressed out of both sheets: the rod snaps at once.
    Snap {
        /// Index of the lower of the two sheets.
        index: usize,
    },
}

/// |det| below this multiple of the product of the columns' lengths is a fold to rounding.
const ON_FOLD: f64 = 1e-11;
/// Velocity across the fold, relative to all of it, below which the acceleration decides.
const GRAZING: f64 = 1e-9;
/// Time of the first, explicit step of a body that leaves a fold from rest: short enough that its
/// error, of third order in it, is below rounding.
const FIRST_TIME: f64 = 1e-5;

/// Decides how `phase` departs.
///
/// # Errors
/// A state outside the chart, or a degenerate point from which no sheet can be followed.
pub fn depart<M: EquilibriumManifold<N>, const N: usize>(
    manifold: &M,
    body: &Body<N>,
    phase: &Phase<N>,
) -> Result<Departure<N>> {
    let q = phase.q;
    let at = manifold.point(&q).ok_or_else(|| {
        Error::domain(format!(
            "the start q = {:?} lies outside the chart",
            q.as_slice()
        ))
    })?;
    let (det, across) = adjugate_times(&at.jacobian, &phase.v);
    let scale: f64 = at.jacobian.column_iter().map(|c| c.norm()).product();
    if !(det.abs() <= ON_FOLD * scale) {
        return Ok(Departure::Regular {
            orientation: det.signum(),
        });
    }
    let (upward, index) = fold_sides(manifold, &q)?;
    let step = aside(manifold, &q, &at.force, &upward);
    let det_aside = |sign: f64| {
        manifold
            .point(&(q + step * sign))
            .map(|p| adjugate_times(&p.jacobian, &phase.v).0)
    };
    let orientation = match det_aside(-1.0) {
        Some(det) => det.signum(),
        None => return Ok(Departure::Snap { index }),
    };
    let action = body.action(phase.t, &phase.v, &at.force);
    let (_, pushed) = adjugate_times(&at.jacobian, &action.acceleration);
    // On the fold adj(Dg) v = c kernel; s c < 0 leads to the lower side, where t can grow.
    let drift = orientation * across.dot(&upward);
    let push = orientation * pushed.dot(&upward);
    let unit: f64 = scale
        / at.jacobian
            .column_iter()
            .map(|c| c.norm())
            .fold(1e-300, f64::max);
    let grazing = drift.abs() <= GRAZING * unit * phase.v.norm() || phase.v.norm() == 0.0;
    let leads_down = if grazing { push < 0.0 } else { drift < 0.0 };
    // At a cusp both sides have the same index and det keeps its sign: a stable one can be left.
    let cusp = det_aside(1.0).is_some_and(|det| det.signum() == orientation);
    if !(leads_down || cusp && index == 0) {
        return Ok(Departure::Snap { index });
    }
    if !grazing {
        return Ok(Departure::FromFold {
            phase: *phase,
            orientation,
            index,
        });
    }
    if cusp && index == 0 {
        // The pose changes with the third power of the distance: by less than 1e-11 here.
        let q = q - step;
        return Ok(Departure::FromFold {
            phase: Phase { q, ..*phase },
            orientation,
            index,
        });
    }
    // From rest t' = 0 for ever: make the first step by hand, with constant acceleration.
    let dt = FIRST_TIME;
    let shift = phase.v * dt + action.acceleration * (0.5 * dt * dt);
    let beside = manifold
        .point(&(q - upward * 1e-3))
        .ok_or_else(|| Error::domain("the fold lies at the border of the chart"))?;
    let bend = (beside.pose - at.pose) * (2.0 / 1e-6);
    let offset = (2.0 * (shift.dot(&bend) / bend.norm_squared()).max(0.0)).sqrt();
    let near = q - upward * offset.max(1e-8);
    let Ok(landed) = invert_near(manifold, &(at.pose + shift), &near, 1e-16) else {
        // The motion grazes the fold from outside, or meets an unstable cusp: no sheet to follow.
        return Ok(Departure::Snap { index });
    };
    let v = phase.v + action.acceleration * dt;
    let mid = phase.v + action.acceleration * (0.5 * dt);
    let average = body.action(phase.t + 0.5 * dt, &mid, &at.force);
    Ok(Departure::FromFold {
        phase: Phase {
            q: landed.q,
            v,
            t: phase.t + dt,
            work: phase.work + average.power * dt,
            drag_loss: phase.drag_loss + average.loss * dt,
        },
        orientation,
        index,
    })
}
