//! Slip in an impact in space, where its direction turns on the way.
//!
//! With u the slip velocity, t its tangential part and p the normal impulse,
//! ```text
//! du/dp = B (1, -mu t/|t|),     dp = |t| ds:     du/ds = B (|t|, -mu t)
//! ```
//! is smooth where the slip comes to rest. The slip comes to rest exponentially, after an infinite s.

use super::impact::{ImpactEnd, ImpactPath, STILL};
use crate::error::{Error, Result};
use crate::solve::dop853::Dop853;
use crate::solve::roots::chandrupatla;
use nalgebra::{Matrix3, SVector, Vector3};

/// Slip velocity, impulse and work, relative to the largest values in the impact.
type Scaled = SVector<f64, 7>;

/// Local tolerance of the integration.
const TOLERANCE: f64 = 1e-14;
/// Most steps.
const STEPS: usize = 2000;

/// Goes along the path to its end (true), or until the slip comes to rest (false).
///
/// # Errors
/// No end within a large number of steps.
pub(super) fn curved_slip(
    b: &Matrix3<f64>,
    friction: f64,
    speed: f64,
    path: &mut ImpactPath,
    end: ImpactEnd,
) -> Result<bool> {
    // Velocities by `speed`, B by B_nn; impulses and works follow.
    let scaled_b = b / b.m11;
    let impulse = speed / b.m11;
    let work = speed * impulse;
    let inward = |path: &ImpactPath| -> Scaled {
        let (u, j) = (path.slip / speed, path.impulse / impulse);
        Scaled::from_column_slice(&[u.x, u.y, u.z, j.x, j.y, j.z, path.work / work])
    };
    let outward = |y: &Scaled| ImpactPath {
        slip: Vector3::new(y[0], y[1], y[2]) * speed,
        impulse: Vector3::new(y[3], y[4], y[5]) * impulse,
        work: y[6] * work,
    };
    let slope = |y: &Scaled| -> Option<Scaled> {
        let slip = y[1].hypot(y[2]);
        let force = Vector3::new(slip, -friction * y[1], -friction * y[2]);
        let u = scaled_b * force;
        let power = y[0] * force.x;
        Some(Scaled::from_column_slice(&[
            u.x, u.y, u.z, force.x, force.y, force.z, power,
        ]))
    };
    let missing = |y: &Scaled| {
        let scale = match end {
            ImpactEnd::NormalVelocity(_) => speed,
            ImpactEnd::NormalImpulse(_) => impulse,
            ImpactEnd::Work(_) => work,
        };
        end.missing(&outward(y)) / scale
    };
    let start = inward(path);
    let first = slope(&start).unwrap_or_default();
    let mut solver = Dop853::new(start, first, 0.1, TOLERANCE);
    for _ in 0..STEPS {
        let step = (solver.step(slope, f64::INFINITY))
            .map_err(|_| Error::no_convergence("the slip of an impact cannot be integrated"))?;
        // The work falls before it rises: only a rise ends the impact.
        let rises = step.to[0] > 0.0 || !matches!(end, ImpactEnd::Work(_));
        if rises && missing(&step.to) >= 0.0 {
            let mut cost = Default::default();
            let mut last = step.to;
            let mut at = |h: f64| {
                let redone = step.redo(slope, h, &mut cost);
                redone.map_or(f64::NAN, |redone| {
                    last = redone.to;
                    missing(&redone.to)
                })
            };
            let before = missing(&step.from);
            let h = if before < 0.0 {
                chandrupatla(&mut at, (0.0, before), (step.h, missing(&step.to)), 0.0)
            } else {
                Some(0.0)
            };
            let h = h.ok_or_else(|| Error::no_convergence("the end of an impact was not found"))?;
            let _ = at(h);
            *path = outward(&last);
            return Ok(true);
        }
        if step.to[1].hypot(step.to[2]) <= STILL {
            *path = outward(&step.to);
            return Ok(false);
        }
    }
    Err(Error::no_convergence(
        "the slip of an impact does not come to an end",
    ))
}
