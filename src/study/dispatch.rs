//! Studies for a scene of any kind: one rod, an assembly or a bar.

use super::neglected_mass::MassEffect;
use super::run::{Fields, Prepared, Shapes};
use super::{Hooks, Sink, Table, assembly, bar, equilibrium, run};
use crate::error::{Error, Result};
use crate::scene::Scene;
use assembly::AssemblyPrepared;
use bar::BarPrepared;
use serde_json::Value;

/// Result of a scene.
#[derive(Debug, Clone)]
pub struct SceneResult {
    /// Content of summary.json.
    pub summary: Value,
    /// Snaps, layers or shocks.
    pub events: Vec<Value>,
    /// Reason for an early end, if any.
    pub reason: Option<String>,
    /// Warning about the start, or the resolution of the rod.
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
) -> Result<SceneResult> {
    if scene.bar.is_some() {
        let record = bar::run(&BarPrepared::new(scene)?, sink, hooks)?;
        return Ok(SceneResult {
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
        return Ok(SceneResult {
            summary: record.summary(),
            events: record.events(),
            reason: record.reason(),
            warning: record.warning(),
        });
    }
    let record = run::run(&Prepared::new(scene)?, fields, sink, hooks)?;
    Ok(SceneResult {
        summary: record.summary(),
        events: record.events(),
        reason: record.reason(),
        warning: record.warning(),
    })
}

/// Trajectory of a scene of motion before its run: names, units and meanings of the columns.
///
/// # Errors
/// Errors of the setup; a scene of statics.
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

/// Equilibrium of a scene of statics of any kind: summary and shape.
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

/// Rods of a scene of motion at `times`, with their names; a single rod has none.
///
/// # Errors
/// Those of [`run::shapes`]; a bar, which has no shape.
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

/// Trajectory of a scene of motion at `times` only.
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

/// Sets a scene up, which finds errors invisible to the parser. The result is the effect of the mass of light rods,
/// if known.
///
/// # Errors
/// A start without motion; data without a well-posed problem.
pub fn check(scene: &Scene) -> Result<Option<MassEffect>> {
    if scene.bar.is_some() {
        return BarPrepared::new(scene).map(|_| None);
    }
    if scene.assembly.is_some() {
        if scene.is_motion() {
            AssemblyPrepared::new(scene)?.motion().map(drop)?
        } else {
            assembly::equilibrium(scene).map(drop)?
        }
        return assembly::small_mass(scene);
    }
    if !scene.is_motion() {
        return scene.problem().map(|_| None);
    }
    let prepared = Prepared::new(scene)?;
    prepared.motion().map(|_| prepared.small_mass())
}
