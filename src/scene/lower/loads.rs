//! Loads of point masses and rigid bodies, constant and time-dependent.

use crate::body::{PointMass, RigidBody, Support, TimeLoad};
use crate::error::Result;
use crate::scene::{Force, Loads};
use nalgebra::{Isometry3, SVector, Vector3};

/// A point mass and its loads, in units of the rod. `inward` maps world vectors to the frame of the run, which stands
/// in the world as `frame`.
pub(super) fn point_mass<const N: usize>(
    mass: f64,
    loads: &Loads,
    inward: impl Fn([f64; 3]) -> SVector<f64, N>,
    frame: &Isometry3<f64>,
    support: Option<Support<N>>,
) -> Result<PointMass<N>> {
    let body = PointMass::new(mass)?
        .with_gravity(inward(loads.gravity))?
        .with_dead_force(inward(loads.dead))?
        .with_drag(loads.drag)?;
    let forces = in_time("force", &loads.force, inward)?.into_iter();
    let body = forces.fold(body, |body, (_, force)| body.with_force(force));
    let functions = loads.functions.iter().map(|f| f.seen_from(frame));
    let body = functions.fold(body, PointMass::with_function);
    Ok(match support {
        Some(support) => body.with_support(support),
        None => body,
    })
}

/// Adds the loads of a rigid body, in units of the rod. `inward` maps world vectors to the frame of the run, which
/// stands in the world as `frame`.
pub(super) fn acting_on(
    body: RigidBody,
    loads: &Loads,
    inward: impl Fn([f64; 3]) -> Vector3<f64>,
    frame: &Isometry3<f64>,
) -> Result<RigidBody> {
    let mut body = body
        .with_gravity(inward(loads.gravity))?
        .with_dead_force(inward(loads.dead))?
        .with_dead_couple(inward(loads.couple.constant()))?
        .with_drag(loads.drag)?
        .with_rotational_drag(loads.rotational_drag)?;
    for (follower, force) in in_time("force", &loads.force, &inward)? {
        body = if follower {
            body.with_follower_force(force)
        } else {
            body.with_force(force)
        };
    }
    for (follower, couple) in in_time("couple", loads.couple.in_time(), &inward)? {
        body = if follower {
            body.with_follower_couple(couple)
        } else {
            body.with_couple(couple)
        };
    }
    let functions = loads.functions.iter().map(|f| f.seen_from(frame));
    Ok(functions.fold(body, RigidBody::with_function))
}

/// Time-dependent loads, each with a flag for follower loads. `inward` maps directions of the world to the frame of the
/// run.
pub(super) fn in_time<const N: usize>(
    name: &str,
    loads: &[Force],
    inward: impl Fn([f64; 3]) -> SVector<f64, N>,
) -> Result<Vec<(bool, TimeLoad<N>)>> {
    let one = |(i, load): (usize, &Force)| {
        let unit = load.unit();
        let direction = if load.follower {
            SVector::from_fn(|i, _| unit[i])
        } else {
            inward(unit)
        };
        let made = TimeLoad::new(direction, load.size.clone())
            .map_err(|e| e.context(format!("{name}[{i}]")))?;
        Ok((load.follower, made))
    };
    loads.iter().enumerate().map(one).collect()
}
