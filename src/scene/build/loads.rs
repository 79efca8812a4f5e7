//! A point mass with its loads; loads in time.

use crate::body::{Body, History, Support, TimeLoad};
use crate::error::Result;
use crate::scene::{Force, InTime, Loads, Pulse, Ramp, Sine};
use nalgebra::SVector;
use std::f64::consts::TAU;

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
        let direction = inward(force.unit());
        match &force.size {
            InTime::Sine(Sine {
                amplitude,
                frequency,
                phase,
            }) => TimeLoad::sine(direction * *amplitude, TAU * frequency, *phase),
            size => TimeLoad::new(direction, history(size)?),
        }
        .map_err(|e| e.context(format!("loads.force[{i}]")))
    };
    forces.iter().enumerate().map(one).collect()
}

fn history(size: &InTime) -> Result<History> {
    match size {
        InTime::Sine(sine) => History::sine(sine.amplitude, TAU * sine.frequency, sine.phase),
        InTime::Ramp(Ramp {
            from,
            to,
            start,
            until,
        }) => History::ramp([*start, *until], [*from, *to]),
        InTime::Pulse(Pulse {
            at,
            width,
            amplitude,
        }) => History::pulse([at - 0.5 * width, at + 0.5 * width], *amplitude),
        InTime::Table(rows) => History::table(rows.clone()),
    }
}
