//! Starts, and the special care of those that lie on a fold.

use super::motion::Phase;
use super::snap::fold_sides;
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

/// |det| below this multiple of the product of the columns' lengths, or of the pace, is a fold to
/// rounding.
const ON_FOLD: f64 = 1e-11;
/// Offset at which the sides of a fold are told apart.
const ASIDE: f64 = 1e-4;
/// Velocity across the fold, relative to all of it, below which the acceleration decides.
const GRAZING: f64 = 1e-9;
/// Time of the first, explicit step of a body that leaves a fold from rest: short enough that its
/// error, of third order in the velocity, is near rounding.
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
    let mut columns: [f64; N] = std::array::from_fn(|j| at.jacobian.column(j).norm());
    columns.sort_by(|a, b| b.total_cmp(a));
    // The columns' lengths alone cannot tell: for N = 1 their product is |det|.
    let scale = columns.iter().product::<f64>().max(at.pace);
    if !(det.abs() <= ON_FOLD * scale) {
        return Ok(Departure::Regular {
            orientation: det.signum(),
        });
    }
    let (upward, index) = fold_sides(manifold, &q)?;
    let det_aside = |offset: f64| {
        manifold
            .point(&(q + upward * offset))
            .map(|p| adjugate_times(&p.jacobian, &phase.v).0)
    };
    let orientation = match det_aside(-ASIDE) {
        Some(det) => det.signum(),
        None => return Ok(Departure::Snap { index }),
    };
    let action = body.action(phase.t, &phase.v, &at.force);
    let (_, pushed) = adjugate_times(&at.jacobian, &action.acceleration);
    // On the fold adj(Dg) v = c kernel; s c < 0 leads to the lower side, where t can grow.
    let drift = orientation * across.dot(&upward);
    let push = orientation * pushed.dot(&upward);
    let unit: f64 = columns.iter().skip(1).product();
    let grazing = drift.abs() <= GRAZING * unit * phase.v.norm() || phase.v.norm() == 0.0;
    let leads_down = if grazing { push < 0.0 } else { drift < 0.0 };
    // At a cusp both sides have the same index and det keeps its sign: a stable one can be left.
    let cusp = det_aside(ASIDE).is_some_and(|det| det.signum() == orientation);
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
    // From rest t' = 0 for ever: make the first step by hand. Off the fold q moves in proportion to
    // t, and the force with it: the acceleration is linear in t, from the fold to where q arrives.
    let dt = FIRST_TIME;
    let beside = manifold
        .point(&(q - upward * 1e-3))
        .ok_or_else(|| Error::domain("the fold lies at the border of the chart"))?;
    let bend = (beside.pose - at.pose) * (2.0 / 1e-6);
    let mut arrived = q;
    let mut v = phase.v + action.acceleration * dt;
    let mut later = action.acceleration;
    for _ in 0..2 {
        let shift = phase.v * dt + (action.acceleration * 2.0 + later) * (dt * dt / 6.0);
        let offset = (2.0 * (shift.dot(&bend) / bend.norm_squared()).max(0.0)).sqrt();
        let guess = q - upward * offset.max(1e-8);
        arrived = invert_near(manifold, &(at.pose + shift), &guess, 1e-16)
            .map_err(|e| e.context("leaving the fold from rest"))?
            .q;
        let there = manifold
            .point(&arrived)
            .ok_or_else(|| Error::domain("the fold lies at the border of the chart"))?;
        later = body.action(phase.t + dt, &v, &there.force).acceleration;
        v = phase.v + (action.acceleration + later) * (0.5 * dt);
    }
    let mid = (phase.v + v) * 0.5;
    let average = body.action(phase.t + 0.5 * dt, &mid, &at.force);
    Ok(Departure::FromFold {
        phase: Phase {
            q: arrived,
            v,
            t: phase.t + dt,
            work: phase.work + average.power * dt,
            drag_loss: phase.drag_loss + average.loss * dt,
        },
        orientation,
        index,
    })
}
