//! Starts of a motion, with the special care of starts on a fold.

use super::sheet::Phase;
use super::snap::{aside, fold_sides};
use nalgebra::SVector;
use snaprod_systems::body::PointMass;
use snaprod_systems::error::{Error, Result};
use snaprod_systems::manifold::{ManifoldPoint, Multivalued, adjugate_times, invert_near};
use snaprod_systems::math::small_sort::sort_few;

/// Classification of a start.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum Departure<const N: usize> {
    /// Off all folds.
    Regular {
        /// Sign of det.
        orientation: f64,
    },
    /// From a fold onto the sheet of lower index.
    FromFold {
        /// The first state of the motion.
        phase: Phase<N>,
        /// Sign of det on the lower sheet.
        orientation: f64,
        /// Index on the lower sheet.
        index: usize,
    },
    /// On a fold, pressed out of both sheets: the rod snaps at once.
    Snap {
        /// Index of the lower of the two sheets.
        index: usize,
    },
}

/// First sieve for folds: |det| below this multiple of the product of the columns' lengths.
const NEAR_FOLD: f64 = 1e-9;
/// Fold to rounding: |det| below this multiple of its value a little aside. A chart that is merely stretched
/// (the elastica near the straight rod) has as small a det on both sides.
const ON_FOLD: f64 = 1e-6;
/// Velocity across the fold, relative to the whole velocity, below which the acceleration decides.
const GRAZING: f64 = 1e-9;
/// First step of a body that leaves a fold from rest, as a fraction of the step of [`aside`]. It is short
/// enough that its error, of third order in time, is near rounding.
const FIRST_STEP: f64 = 0.1;

/// Classifies the start `phase`.
///
/// # Errors
/// A state outside the chart, or a degenerate point from which no sheet can be followed.
pub fn depart<M: Multivalued<N>, const N: usize>(
    manifold: &M,
    body: &PointMass<N>,
    phase: &Phase<N>,
) -> Result<Departure<N>> {
    let q = phase.q;
    let at = manifold.point(&q).ok_or_else(|| {
        Error::domain(format!(
            "the start {} lies outside the chart",
            snaprod_systems::error::named(&["q1", "q2"], q.as_slice())
        ))
    })?;
    let (det, across) = adjugate_times(&at.jacobian, &phase.v);
    let regular = Departure::Regular {
        orientation: det.signum(),
    };
    let mut columns: [f64; N] = std::array::from_fn(|j| at.jacobian.column(j).norm());
    sort_few(&mut columns, |length| -length);
    // For N = 1 the product of the columns is |det| itself, so the comparison would be empty.
    let scale = if N == 1 {
        at.pace
    } else {
        columns.iter().product()
    };
    if det.abs() > NEAR_FOLD * scale {
        return Ok(regular);
    }
    let (upward, index) = fold_sides(manifold, &q)?;
    let step = aside(manifold, &q, &at.force, &upward);
    let det_aside = |sign: f64| {
        manifold
            .point(&(q + step * sign))
            .map(|p| adjugate_times(&p.jacobian, &phase.v).0)
    };
    let (Some(below), Some(above)) = (det_aside(-1.0), det_aside(1.0)) else {
        return Ok(Departure::Snap { index });
    };
    if det.abs() > ON_FOLD * below.abs().max(above.abs()) {
        return Ok(regular);
    }
    let orientation = below.signum();
    let action = body.action(phase.t, &at.pose, &phase.v, &at.force);
    let (_, pushed) = adjugate_times(&at.jacobian, &action.acceleration);
    // On the fold adj(Dg) v = c kernel; s c < 0 leads to the lower side, where t can grow.
    let drift = orientation * across.dot(&upward);
    let push = orientation * pushed.dot(&upward);
    let unit: f64 = columns.iter().skip(1).product();
    let grazing = drift.abs() <= GRAZING * unit * phase.v.norm() || phase.v.norm() == 0.0;
    let leads_down = if grazing { push < 0.0 } else { drift < 0.0 };
    // At a cusp both sides have the same index and det keeps its sign: a stable cusp can be left.
    let stable_cusp = above.signum() == orientation && index == 0;
    if !(leads_down || stable_cusp) {
        return Ok(Departure::Snap { index });
    }
    let departure = |phase| Departure::FromFold {
        phase,
        orientation,
        index,
    };
    if !grazing {
        return Ok(departure(*phase));
    }
    if stable_cusp {
        // The pose changes with the third power of the distance: by less than 1e-11 here.
        let q = q - step;
        return Ok(departure(Phase { q, ..*phase }));
    }
    Ok(from_rest(manifold, body, phase, &at, &step)
        // The motion grazes the fold from outside, or meets an unstable cusp: no sheet to follow.
        .map_or(Departure::Snap { index }, departure))
}

/// The first step from rest on a fold. It is taken in t, since t' = 0 keeps the integration in tau at the
/// fold for ever. `step` leads to the upper side.
///
/// Off the fold q moves in proportion to t, and the force with it: the acceleration is taken as linear in t,
/// from the fold to the point reached.
fn from_rest<M: Multivalued<N>, const N: usize>(
    manifold: &M,
    body: &PointMass<N>,
    phase: &Phase<N>,
    at: &ManifoldPoint<N>,
    step: &SVector<f64, N>,
) -> Option<Phase<N>> {
    let q = phase.q;
    let start = body
        .action(phase.t, &at.pose, &phase.v, &at.force)
        .acceleration;
    // Along q - sigma step the pose moves by bend sigma^2 / 2: sigma = FIRST_STEP is reached at dt.
    let bend = (manifold.point(&(q - step))?.pose - at.pose) * 2.0;
    let pull = start.dot(&bend) / bend.norm_squared();
    let dt = FIRST_STEP / pull.sqrt();
    if !(dt.is_finite() && dt > 0.0) {
        return None;
    }
    let mut arrived = q;
    let mut v = phase.v + start * dt;
    let mut later = start;
    for _ in 0..2 {
        let shift = phase.v * dt + (start * 2.0 + later) * (dt * dt / 6.0);
        let sigma = (2.0 * shift.dot(&bend) / bend.norm_squared())
            .max(0.0)
            .sqrt();
        let guess = q - step * sigma.max(1e-3 * FIRST_STEP);
        arrived = invert_near(manifold, &(at.pose + shift), &guess, 1e-16)
            .ok()?
            .q;
        let there = manifold.point(&arrived)?;
        later = body
            .action(phase.t + dt, &there.pose, &v, &there.force)
            .acceleration;
        v = phase.v + (start + later) * (0.5 * dt);
    }
    let average = body.action(
        phase.t + 0.5 * dt,
        &at.pose,
        &((phase.v + v) * 0.5),
        &at.force,
    );
    Some(Phase {
        q: arrived,
        v,
        t: phase.t + dt,
        work: phase.work + average.power * dt,
        drag_loss: phase.drag_loss + average.loss * dt,
    })
}
