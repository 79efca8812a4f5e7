//! Studies for a scene of any kind: rods, a bar, a flow, a membrane in motion or a wall at rest.

use super::neglected_mass::MassEffect;
use super::run::{Fields, Prepared, RunRecord, RunStart, Shapes};
use super::{
    FirstOrder, Hooks, Sink, Table, assembly, bar, equilibrium, flow, inflation, run, wall,
};
use crate::error::{Error, Result};
use crate::scene::{Scene, SceneKind};
use bar::{BarPrepared, BarRecord};
use flow::{FlowPrepared, FlowRecord};
use inflation::{InflationPrepared, InflationRecord};
use serde_json::Value;

/// A scene of motion of any kind, ready to run.
pub enum PreparedScene {
    /// Rods, one or an assembly.
    Rods(Box<Prepared>),
    /// A bar.
    Bar(Box<BarPrepared>),
    /// A flow in a tube.
    Flow(Box<FlowPrepared>),
    /// A membrane in motion.
    Inflation(Box<InflationPrepared>),
}

/// A scene of any kind at its start.
pub enum SceneStart<'p> {
    /// Rods, and their motion from the start.
    Rods(&'p Prepared, RunStart<'p>),
    /// A bar.
    Bar(&'p BarPrepared),
    /// A flow in a tube.
    Flow(&'p FlowPrepared),
    /// A membrane in motion.
    Inflation(&'p InflationPrepared),
}

/// A completed run of a scene of any kind.
pub enum SceneRun<'p> {
    /// Rods, one or an assembly.
    Rods(&'p Prepared, Box<RunRecord>),
    /// A bar.
    Bar(Box<BarRecord>),
    /// A flow in a tube.
    Flow(Box<FlowRecord>),
    /// A membrane in motion.
    Inflation(Box<InflationRecord>),
}

impl PreparedScene {
    /// Scales a scene of motion.
    ///
    /// # Errors
    /// A scene of statics; errors that [`Scene::parse`] cannot detect from the numbers alone.
    pub fn new(scene: &Scene) -> Result<Self> {
        require_motion(scene)?;
        Ok(if scene.is_bar() {
            Self::Bar(Box::new(BarPrepared::new(scene)?))
        } else if scene.flow().is_some() {
            Self::Flow(Box::new(FlowPrepared::new(scene)?))
        } else if scene.inflation().is_some() {
            Self::Inflation(Box::new(InflationPrepared::new(scene)?))
        } else {
            Self::Rods(Box::new(Prepared::new(scene)?))
        })
    }

    /// Finds the start.
    ///
    /// # Errors
    /// A start from which no motion is possible.
    pub fn start(&self) -> Result<SceneStart<'_>> {
        Ok(match self {
            Self::Rods(prepared) => SceneStart::Rods(prepared, prepared.start()?),
            Self::Bar(prepared) => SceneStart::Bar(prepared),
            Self::Flow(prepared) => SceneStart::Flow(prepared),
            Self::Inflation(prepared) => SceneStart::Inflation(prepared),
        })
    }
}

impl<'p> SceneStart<'p> {
    /// The motion from a state that a run or a simulation of the scene has saved.
    ///
    /// # Errors
    /// The state of another model; a bar, a flow or a membrane.
    pub fn restored(self, state: &run::SimulationState) -> Result<Self> {
        match self {
            Self::Rods(prepared, start) => Ok(Self::Rods(prepared, start.restored(state)?)),
            Self::Bar(_) => Err(Error::domain(
                "a bar does not go on from a saved state: run it from its start",
            )),
            Self::Flow(_) => Err(Error::domain(
                "a flow does not go on from a saved state: run it from its start",
            )),
            Self::Inflation(_) => Err(Error::domain(
                "a membrane does not go on from a saved state: run it from its start",
            )),
        }
    }

    /// Runs the scene; its tables go to `sink`. `fields` is the density of the strain field of one rod.
    ///
    /// # Errors
    /// Those of [`run::run_from`] and [`bar::run`].
    pub fn run(
        self,
        fields: Fields,
        sink: &mut dyn Sink,
        hooks: &mut dyn Hooks,
    ) -> Result<SceneRun<'p>> {
        Ok(match self {
            Self::Rods(prepared, start) => {
                let record = run::run_from(prepared, start, fields, sink, hooks)?;
                SceneRun::Rods(prepared, Box::new(record))
            }
            Self::Bar(prepared) => SceneRun::Bar(Box::new(bar::run(prepared, sink, hooks)?)),
            Self::Flow(prepared) => SceneRun::Flow(Box::new(flow::run(prepared, sink, hooks)?)),
            Self::Inflation(prepared) => {
                SceneRun::Inflation(Box::new(inflation::run(prepared, sink, hooks)?))
            }
        })
    }
}

impl SceneRun<'_> {
    /// The run in JSON and words.
    pub fn result(&self) -> SceneResult {
        match self {
            Self::Rods(_, record) => SceneResult {
                summary: record.summary(),
                events: record.events(),
                reason: record.reason(),
                warning: record.warning(),
                state: record.state.clone(),
            },
            Self::Bar(record) => SceneResult {
                summary: record.summary(),
                events: record.events(),
                reason: record.reason(),
                warning: None,
                state: Err("the state of a bar is not saved".to_owned()),
            },
            Self::Flow(record) => SceneResult {
                summary: record.summary(),
                events: record.events.clone(),
                reason: record.reason(),
                warning: None,
                state: Err("the state of a flow is not saved".to_owned()),
            },
            Self::Inflation(record) => SceneResult {
                summary: record.summary(),
                events: record.events.clone(),
                reason: record.reason(),
                warning: record.warning(),
                state: Err("the state of a membrane is not saved".to_owned()),
            },
        }
    }
}

/// Refuses a scene of statics before any setup; a bar, a flow or a membrane in motion is always a motion.
fn require_motion(scene: &Scene) -> Result<()> {
    match scene.kind {
        SceneKind::Bar(_) | SceneKind::Flow(_) | SceneKind::Inflation(_) => Ok(()),
        SceneKind::Assembly(_) | SceneKind::Rod | SceneKind::Wall(_) => scene.run().map(drop),
    }
}

/// Rods in motion; a bar, a flow or a membrane is refused with its reason.
fn prepared_rods(
    scene: &Scene,
    [of_bar, of_flow, of_membrane]: [&'static str; 3],
) -> Result<Prepared> {
    match scene.kind {
        SceneKind::Bar(_) => Err(Error::domain(of_bar)),
        SceneKind::Flow(_) => Err(Error::domain(of_flow)),
        SceneKind::Inflation(_) => Err(Error::domain(of_membrane)),
        SceneKind::Assembly(_) | SceneKind::Rod | SceneKind::Wall(_) => {
            scene.run()?;
            Prepared::new(scene)
        }
    }
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
    /// The last state, from which another run goes on; or the reason why a run of this kind saves no state.
    pub state: std::result::Result<run::SimulationState, String>,
}

/// Runs a scene of motion of any kind; its tables go to `sink`.
///
/// # Errors
/// Those of [`PreparedScene::new`], [`PreparedScene::start`] and [`SceneStart::run`].
pub fn motion(
    scene: &Scene,
    fields: Fields,
    sink: &mut dyn Sink,
    hooks: &mut dyn Hooks,
) -> Result<SceneResult> {
    let prepared = PreparedScene::new(scene)?;
    let run = prepared.start()?.run(fields, sink, hooks)?;
    Ok(run.result())
}

/// Runs a scene of motion from a saved state, as [`motion`].
///
/// # Errors
/// Those of [`motion`] and [`SceneStart::restored`].
pub fn motion_from(
    scene: &Scene,
    state: &run::SimulationState,
    fields: Fields,
    sink: &mut dyn Sink,
    hooks: &mut dyn Hooks,
) -> Result<SceneResult> {
    let prepared = PreparedScene::new(scene)?;
    let start = prepared.start()?.restored(state)?;
    Ok(start.run(fields, sink, hooks)?.result())
}

/// Trajectory of a scene of motion before its run: names, units and meanings of the columns.
///
/// # Errors
/// Errors of the setup; a scene of statics.
pub fn columns(scene: &Scene) -> Result<Table> {
    require_motion(scene)?;
    if scene.is_bar() {
        Ok(bar::columns(scene))
    } else if let Some(given) = scene.flow() {
        Ok(flow::columns(scene.units, given))
    } else if let Some(given) = scene.inflation() {
        Ok(inflation::columns(scene.units, given))
    } else {
        run::columns(scene)
    }
}

/// Equilibrium of a scene of statics of any kind: summary and shape, with the derivatives that are asked for.
///
/// # Errors
/// Those of [`equilibrium()`] and [`assembly::equilibrium`]; a scene of motion of one rod; derivatives of a scene that
/// has none.
pub fn rest(scene: &Scene, asked: &FirstOrder) -> Result<(Value, Table)> {
    if scene.is_assembly() {
        let record = assembly::equilibrium(scene)?;
        let mut summary = record.summary();
        asked.of_assembly(scene, &record, &mut summary)?;
        return Ok((summary, record.shape()?));
    }
    if scene.wall().is_some() {
        asked.refused(WALL)?;
        let record = wall::equilibrium(scene)?;
        return Ok((record.summary, record.shape));
    }
    scene.end()?;
    let record = equilibrium(scene)?;
    let mut summary = record.summary();
    asked.of_rod(scene, &record, &mut summary)?;
    Ok((summary, record.shape()?))
}

/// Refusal of derivatives of walls under pressure.
pub const WALL: &str = "derivatives, stiffness and compliance are those of rods: a wall under pressure has none; take differences of a sweep";

/// Rods of a scene of motion at `times`, with their names; a single rod has none.
///
/// # Errors
/// Those of [`run::shapes`](fn@run::shapes); a bar, a flow or a membrane, which has no rods.
pub fn shapes(
    scene: &Scene,
    times: &[f64],
    points: usize,
    hooks: &mut dyn Hooks,
) -> Result<(Vec<String>, Vec<Shapes>)> {
    let why = [
        "a bar stays straight: its places over time are in the table waves",
        "a flow has no rods: areas along the tube over time are in the table fields",
        "a membrane has no rods: profiles of a disc over time are in the table fields",
    ];
    let prepared = prepared_rods(scene, why)?;
    let found = run::shapes(&prepared, times, points, hooks)?;
    let rods = prepared.header.rods.into_iter();
    Ok((rods.map(|rod| rod.name).collect(), found))
}

/// Trajectory of a scene of motion at `times` only.
///
/// # Errors
/// Those of [`run::samples`]; a bar, a flow or a membrane.
pub fn samples(scene: &Scene, times: &[f64], hooks: &mut dyn Hooks) -> Result<Table> {
    let why = [
        "a bar is sampled at even times: run.samples has how many",
        "a flow is sampled at even times: run.samples has how many",
        "a membrane is sampled at even times: run.samples has how many",
    ];
    run::samples(&prepared_rods(scene, why)?, times, hooks)
}

/// Sets a scene up, which finds errors invisible to the parser. The result is the effect of the mass of light rods,
/// if known.
///
/// # Errors
/// A start from which no motion is possible; data without a well-posed problem.
pub fn check(scene: &Scene) -> Result<Option<MassEffect>> {
    match scene.kind {
        SceneKind::Bar(_) => BarPrepared::new(scene).map(|_| None),
        SceneKind::Flow(_) => FlowPrepared::new(scene).map(|_| None),
        SceneKind::Inflation(_) => InflationPrepared::new(scene).map(|_| None),
        SceneKind::Wall(_) => wall::equilibrium(scene).map(|_| None),
        SceneKind::Assembly(_) if !scene.is_motion() => {
            assembly::equilibrium(scene)?;
            assembly::small_mass(scene)
        }
        SceneKind::Rod if !scene.is_motion() && !scene.obstacles.is_empty() => {
            scene.contact_problem().map(|_| None)
        }
        SceneKind::Rod if !scene.is_motion() => scene.problem().map(|_| None),
        SceneKind::Assembly(_) | SceneKind::Rod => {
            let prepared = Prepared::new(scene)?;
            prepared.start()?;
            Ok(prepared.small_mass())
        }
    }
}
