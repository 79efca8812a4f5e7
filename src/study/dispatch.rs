//! Studies for a scene of any kind: one rod, an assembly or a bar.

use super::neglected_mass::MassEffect;
use super::run::{Fields, Prepared, RunRecord, Shapes};
use super::{Hooks, Sink, Table, assembly, bar, equilibrium, run};
use crate::error::{Error, Result};
use crate::scene::{Scene, SceneKind};
use assembly::{AssemblyMotion, AssemblyPrepared, AssemblyRunRecord};
use bar::{BarPrepared, BarRecord};
use serde_json::Value;

/// A scene of motion of any kind, ready to run.
pub enum PreparedScene {
    /// One rod.
    Rod(Box<Prepared>),
    /// Several rods and bodies, and their motion from the start.
    Assembly(Box<AssemblyPrepared>, AssemblyMotion),
    /// A bar.
    Bar(Box<BarPrepared>),
}

/// A completed run of a scene of any kind.
pub enum SceneRun {
    /// One rod.
    Rod(Box<Prepared>, Box<RunRecord>),
    /// Several rods and bodies.
    Assembly(Box<AssemblyPrepared>, Box<AssemblyRunRecord>),
    /// A bar.
    Bar(Box<BarRecord>),
}

impl PreparedScene {
    /// Scales a scene of motion, and finds the start of an assembly.
    ///
    /// # Errors
    /// A scene of statics; errors that [`Scene::parse`] cannot detect from the numbers alone; a start of an assembly
    /// from which no motion is possible.
    pub fn new(scene: &Scene) -> Result<Self> {
        require_motion(scene)?;
        Ok(match scene.kind {
            SceneKind::Bar(_) => Self::Bar(Box::new(BarPrepared::new(scene)?)),
            SceneKind::Assembly(_) => {
                let prepared = AssemblyPrepared::new(scene)?;
                let start = prepared.motion()?;
                Self::Assembly(Box::new(prepared), start)
            }
            SceneKind::Rod => Self::Rod(Box::new(Prepared::new(scene)?)),
        })
    }

    /// Finds the start of one rod, which [`PreparedScene::new`] leaves to the run.
    ///
    /// # Errors
    /// A start from which no motion is possible.
    pub fn check_start(&self) -> Result<()> {
        match self {
            Self::Rod(prepared) => prepared.motion().map(drop),
            Self::Assembly(..) | Self::Bar(_) => Ok(()),
        }
    }

    /// Runs the scene; its tables go to `sink`. `fields` is the density of the strain field of one rod.
    ///
    /// # Errors
    /// Those of [`run::run`], [`assembly::run`] and [`bar::run`].
    pub fn run(
        self,
        fields: Fields,
        sink: &mut dyn Sink,
        hooks: &mut dyn Hooks,
    ) -> Result<SceneRun> {
        Ok(match self {
            Self::Rod(prepared) => {
                let record = run::run(&prepared, fields, sink, hooks)?;
                SceneRun::Rod(prepared, Box::new(record))
            }
            Self::Assembly(prepared, start) => {
                let record = assembly::run(&prepared, start, sink, hooks)?;
                SceneRun::Assembly(prepared, Box::new(record))
            }
            Self::Bar(prepared) => SceneRun::Bar(Box::new(bar::run(&prepared, sink, hooks)?)),
        })
    }
}

impl SceneRun {
    /// The run in JSON and words.
    pub fn result(&self) -> SceneResult {
        let (summary, events, reason, warning) = match self {
            Self::Rod(_, r) => (r.summary(), r.events(), r.reason(), r.warning()),
            Self::Assembly(_, r) => (r.summary(), r.events(), r.reason(), r.warning()),
            Self::Bar(r) => (r.summary(), r.events(), r.reason(), None),
        };
        SceneResult {
            summary,
            events,
            reason,
            warning,
        }
    }
}

/// Refuses a scene of statics before any setup; a bar is always a motion.
fn require_motion(scene: &Scene) -> Result<()> {
    if scene.is_bar() {
        return Ok(());
    }
    scene.run().map(drop)
}

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
/// Those of [`PreparedScene::new`] and [`PreparedScene::run`].
pub fn motion(
    scene: &Scene,
    fields: Fields,
    sink: &mut dyn Sink,
    hooks: &mut dyn Hooks,
) -> Result<SceneResult> {
    let prepared = PreparedScene::new(scene)?;
    Ok(prepared.run(fields, sink, hooks)?.result())
}

/// Trajectory of a scene of motion before its run: names, units and meanings of the columns.
///
/// # Errors
/// Errors of the setup; a scene of statics.
pub fn columns(scene: &Scene) -> Result<Table> {
    require_motion(scene)?;
    match scene.kind {
        SceneKind::Bar(_) => Ok(bar::columns(scene)),
        SceneKind::Assembly(_) => Ok(AssemblyPrepared::new(scene)?.columns()),
        SceneKind::Rod => run::columns(scene),
    }
}

/// Equilibrium of a scene of statics of any kind: summary and shape.
///
/// # Errors
/// Those of [`equilibrium()`] and [`assembly::equilibrium`]; a scene of motion of one rod.
pub fn rest(scene: &Scene) -> Result<(Value, Table)> {
    if scene.is_assembly() {
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
/// Those of [`run::shapes`](fn@run::shapes); a bar, which has no shape.
pub fn shapes(
    scene: &Scene,
    times: &[f64],
    points: usize,
    hooks: &mut dyn Hooks,
) -> Result<(Vec<String>, Vec<Shapes>)> {
    require_motion(scene)?;
    match scene.kind {
        SceneKind::Bar(_) => Err(Error::domain(
            "a bar stays straight: its places over time are in the table waves",
        )),
        SceneKind::Assembly(_) => {
            let prepared = AssemblyPrepared::new(scene)?;
            let found = assembly::shapes(&prepared, times, points, hooks)?;
            Ok((prepared.names(), found))
        }
        SceneKind::Rod => {
            let found = run::shapes(&Prepared::new(scene)?, times, points, hooks)?;
            Ok((vec![String::new()], found))
        }
    }
}

/// Trajectory of a scene of motion at `times` only.
///
/// # Errors
/// Those of [`run::samples`]; a bar.
pub fn samples(scene: &Scene, times: &[f64], hooks: &mut dyn Hooks) -> Result<Table> {
    require_motion(scene)?;
    match scene.kind {
        SceneKind::Bar(_) => Err(Error::domain(
            "a bar is sampled at even times: run.samples has how many",
        )),
        SceneKind::Assembly(_) => assembly::samples(&AssemblyPrepared::new(scene)?, times, hooks),
        SceneKind::Rod => run::samples(&Prepared::new(scene)?, times, hooks),
    }
}

/// Sets a scene up, which finds errors invisible to the parser. The result is the effect of the mass of light rods,
/// if known.
///
/// # Errors
/// A start from which no motion is possible; data without a well-posed problem.
pub fn check(scene: &Scene) -> Result<Option<MassEffect>> {
    match scene.kind {
        SceneKind::Bar(_) => BarPrepared::new(scene).map(|_| None),
        SceneKind::Assembly(_) => {
            if scene.is_motion() {
                AssemblyPrepared::new(scene)?.motion().map(drop)?;
            } else {
                assembly::equilibrium(scene).map(drop)?;
            }
            assembly::small_mass(scene)
        }
        SceneKind::Rod if !scene.is_motion() => scene.problem().map(|_| None),
        SceneKind::Rod => {
            let prepared = Prepared::new(scene)?;
            prepared.motion().map(|_| prepared.small_mass())
        }
    }
}
