//! A point mass with its loads; loads in time.

use crate::body::{Body, Support, TimeLoad};
use crate::error::Result;
use crate::scene::{Force, Loads};
use nalgebra::SVector;

/// A point mass 1 and what acts on it, in units of the rod, world vectors led by `inward` into the frame of the run.
pub(super) fn point_mass<const N: usize>(
    loads: &Loads,
    inward: impl Fn([f64; 3]) -> SVector<f64, N>,
    support: Option<Support<N>>,
) -> Result<Body<N>> {
    let body = Body::new(1.0)?
        .with_gravity(inward(loads.gravity))?
        .with_dead_force(inward(loads.dead))?
        .with_drag(loads.drag)?;
    let forces = forces(&loads.force, inward)?;
    let body = forces.into_iter().fold(body, Body::with_force);
    Ok(match support {
        Some(support) => body.with_support(support),
        None => body,
    })
}

/// Forces in time, their directions led by `inward` into the frame of the run.
pub(super) fn forces<const N: usize>(
    forces: &[Force],
    inward: impl Fn([f64; 3]) -> SVector<f64, N>,
) -> Result<Vec<TimeLoad<N>>> {
    let one = |(i, force): (usize, &Force)| {
        TimeLoad::new(inward(force.unit()), force.size.clone())
            .map_err(|e| e.context(format!("loads.force[{i}]")))
    };
    forces.iter().enumerate().map(one).collect()
}
