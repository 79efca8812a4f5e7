//! Scenes of any kind: one rod, an assembly or a bar, for those who take what comes.

use super::neglected_mass::SmallMass;
use super::run::{Fields, Prepared, Shapes};
use super::{Hooks, Sink, Table, assembly, bar, equilibrium, run};
use crate::error::{Error, Result};
use crate::scene::Scene;
use assembly::AssemblyPrepared;
use bar::BarPrepared;
use serde_json::Value;

/// What came of a scene.
#[derive(Debug, Clone)]
pub struct Found {
    /// All numbers and words, as summary.json has them.
    pub summary: Value,
    /// Snaps, layers, shocks.
    pub events: Vec<Value>,
    /// Why it fell short of what was asked, if it did.
    pub reason: Option<String>,
    /// What is to be said of the start, or of how the rod is resolved.
    pub warning: Option<String>,
}

/// Runs a scene of motion of any kind; its tables go to `sink`.
///
/// # Errors
/// Those of [`run::run`], [`assembly::run`] and [`bar::run`]; a scene of statics.
pub fn motion(
    scene: &Scene,
    fields: Fields,
    sink: &mut dyn Sink,
    hooks: &mut dyn Hooks,
) -> Result<Found> {
    if scene.bar.is_some() {
        let record = bar::run(&BarPrepared::new(scene)?, sink, hooks)?;
        return Ok(Found {
            summary: record.summary(),
            events: record.events(),
            reason: record.reason(),
            warning: None,
        });
    }
    scene.run()?;
    if scene.assembly.is_some() {
        let prepared = AssemblyPrepared::new(scene)?;
        let start = prepared.motion()?;
        let record = assembly::run(&prepared, start, sink, hooks)?;
        return Ok(Found {
            summary: record.summary(),
            events: record.events(),
            reason: record.reason(),
            warning: record.warning(),
        });
    }
    let record = run::run(&Prepared::new(scene)?, fields, sink, hooks)?;
    Ok(Found {
        summary: record.summary(),
        events: record.events(),
        reason: record.reason(),
        warning: record.warning(),
    })
}

/// The trajectory of a scene of motion of any kind before its run: names, units and meanings of its columns.
///
/// # Errors
/// Those of setting the scene up; a scene of statics.
pub fn columns(scene: &Scene) -> Result<Table> {
    if scene.bar.is_some() {
        return Ok(bar::columns(scene));
    }
    scene.run()?;
    match scene.assembly {
        Some(_) => Ok(AssemblyPrepared::new(scene)?.columns()),
        None => run::columns(scene),
    }
}

/// The equilibrium of a scene of statics of any kind: its summary, and its shape.
///
/// # Errors
/// Those of [`equilibrium()`] and [`assembly::equilibrium`]; a scene of motion of one rod.
pub fn rest(scene: &Scene) -> Result<(Value, Table)> {
    if scene.assembly.is_some() {
        let record = assembly::equilibrium(scene)?;
        return Ok((record.summary(), record.shape()?));
    }
    scene.end()?;
    let record = equilibrium(scene)?;
    Ok((record.summary(), record.shape()?))
}

/// The rods of a scene of motion at these times, with their names; the one rod of a scene has none.
///
/// # Errors
/// Those of [`run::shapes`]; a bar, which has no shape but its places.
pub fn shapes(
    scene: &Scene,
    times: &[f64],
    points: usize,
    hooks: &mut dyn Hooks,
) -> Result<(Vec<String>, Vec<Shapes>)> {
    if scene.bar.is_some() {
        return Err(Error::domain(
            "a bar stays straight: its places over time are in the table waves",
        ));
    }
    scene.run()?;
    if scene.assembly.is_some() {
        let prepared = AssemblyPrepared::new(scene)?;
        let found = assembly::shapes(&prepared, times, points, hooks)?;
        return Ok((prepared.names(), found));
    }
    let found = run::shapes(&Prepared::new(scene)?, times, points, hooks)?;
    Ok((vec![String::new()], found))
}

/// The trajectory of a scene of motion at these times alone.
///
/// # Errors
/// Those of [`run::samples`]; a bar.
pub fn samples(scene: &Scene, times: &[f64], hooks: &mut dyn Hooks) -> Result<Table> {
    if scene.bar.is_some() {
        return Err(Error::domain(
            "a bar is sampled at even times: run.samples has how many",
        ));
    }
    scene.run()?;
    match scene.assembly {
        Some(_) => assembly::samples(&AssemblyPrepared::new(scene)?, times, hooks),
        None => run::samples(&Prepared::new(scene)?, times, hooks),
    }
}

/// Sets a scene up, for what only that can find; tells what the mass of light rods changes, where it is known.
///
/// # Errors
/// A start from which no run can go; data that make no problem.
pub fn check(scene: &Scene) -> Result<Option<SmallMass>> {
    if scene.bar.is_some() {
        return BarPrepared::new(scene).map(|_| None);
    }
    if scene.assembly.is_some() {
        match scene.is_motion() {
            true => AssemblyPrepared::new(scene)?.motion().map(drop)?,
            false => assembly::equilibrium(scene).map(drop)?,
        }
        return assembly::small_mass(scene);
    }
    if !scene.is_motion() {
        return scene.problem().map(|_| None);
    }
    let prepared = Prepared::new(scene)?;
    prepared.motion().map(|_| prepared.small_mass())
}
