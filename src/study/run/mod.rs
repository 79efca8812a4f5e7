//! Run of a scene of motion of rods, and of every branch of it under landing = "all".

mod assembly;
mod bounces;
mod contacts;
mod derivatives;
mod header;
mod joints;
mod last_branch;
mod moment;
mod one_rod;
mod outward;
mod prepared;
mod record;
mod recorder;
mod rest;
pub(super) mod shapes;
mod simulation;
mod spring;
pub(super) mod summary;
mod table;
mod tree;

pub use crate::scene::ModelKind;
pub use bounces::Bounces;
pub use contacts::BranchContacts;
pub(in crate::study) use derivatives::{NAMES, derivatives_at};
pub use derivatives::{RunDerivative, RunDerivatives, SnapDerivative, derivatives};
pub use header::{RunBody, RunHeader, RunRod};
pub use joints::RunJoint;
pub use last_branch::SingleMotion;
pub use moment::{BodyMoment, EndAction, FigureState, Moment, ShapesAt};
pub use outward::RunBounce;
pub use prepared::{Prepared, RunStart};
pub use record::{RunBranch, RunRecord};
pub use shapes::{Shapes, samples, shapes};
pub use simulation::{Simulation, SimulationState};
pub use spring::{Spring, SpringBranch, SpringMode};
pub use table::{columns, trajectory_name};

use super::{Hooks, Silent, Sink, Table};
use crate::error::Result;
use crate::motion::drive;
use crate::scene::Scene;
use recorder::{Outlets, Passed, Recorder};
use rest::LazyRest;
use tree::tree;

/// Density of the strain field output.
#[derive(Debug, Clone, Copy, Default, PartialEq, Eq)]
pub enum Fields {
    /// Nothing.
    None,
    /// About 400 samples, evenly spaced.
    #[default]
    Some,
    /// Every sample.
    All,
}

/// Material points s/L at which fields are written and drawn.
pub fn places() -> Vec<f64> {
    const ROWS: usize = 61;
    (0..ROWS).map(|i| i as f64 / (ROWS - 1) as f64).collect()
}

/// Runs a scene to its end.
///
/// Rows of the tables `trajectory` (and `trajectory-1`, ... of branches) and `strain` go to `sink` as the run goes on.
/// A run that ends early is no error: [`RunRecord::reason`] says why. One whose energy ledger does not close
/// ([`LedgerClosure`](crate::motion::LedgerClosure)) counts as ended early, too.
///
/// ```
/// use snaprod::scene::Scene;
/// use snaprod::study::{Silent, Table, run};
/// let scene = Scene::parse(
///     r#"
///     [rod]
///     model = "elastica"
///     length = 1.0
///     bending_stiffness = 1.0
///     [body]
///     mass = 1.0
///     [start]
///     lambda = 6.3
///     kappa = 0.6
///     velocity = [0.0, -0.5]
///     [run]
///     duration = 1.0
///     "#,
/// )?;
/// let mut tables: Vec<Table> = Vec::new();
/// let prepared = run::Prepared::new(&scene)?;
/// let record = run::run(&prepared, run::Fields::Some, &mut tables, &mut Silent)?;
/// assert!((record.branches[0].snaps[0].t - 0.025570197858).abs() < 1e-10);
/// // The samples, and the two sides of the snap.
/// assert_eq!(tables[0].rows(), 402);
/// # Ok::<(), Box<dyn std::error::Error>>(())
/// ```
///
/// # Errors
/// A start from which no motion is possible; rows refused by the sink.
pub fn run(
    prepared: &Prepared,
    fields: Fields,
    sink: &mut dyn Sink,
    hooks: &mut dyn Hooks,
) -> Result<RunRecord> {
    run_from(prepared, prepared.start()?, fields, sink, hooks)
}

/// Runs a scene from the start that [`Prepared::start`] has found, as [`run()`].
///
/// # Errors
/// Rows refused by the sink.
pub fn run_from<'p>(
    prepared: &'p Prepared,
    start: RunStart<'p>,
    fields: Fields,
    sink: &mut dyn Sink,
    hooks: &mut dyn Hooks,
) -> Result<RunRecord> {
    let header = &prepared.header;
    let spring = prepared.spring()?;
    let total = start.motion.now().ledger().total();
    let rest = LazyRest::new(&*prepared.model);
    let mut passed = Passed::default();
    let mut outlets = Outlets {
        sink,
        hooks,
        fields,
    };
    let mut state = Err(String::new());
    let (branches, cut) = tree(start.motion, header.run.branches, |origin, motion| {
        let mut recorder = Recorder::new(prepared, &rest, &mut outlets, origin.id, motion, total)?;
        let outcome = drive(motion, header.run.samples, &mut recorder)?;
        state = SimulationState::of(prepared, motion).map_err(|e| e.to_string());
        let branch = recorder.finish(motion, origin, outcome.clone(), &mut passed)?;
        Ok((branch, outcome))
    })?;
    let Passed { folds, bounces } = passed;
    let change_at_half_gap = match &prepared.at_half_gap {
        Some(scene) => Some(change_of_places(&branches, scene)?),
        None => None,
    };
    Ok(RunRecord {
        change_at_half_gap,
        validity: rest.validity(header, &folds, bounces),
        header: header.clone(),
        folds,
        branches,
        cut,
        state,
        start_index: start.index,
        spring,
        strain_stride: recorder::stride(prepared, fields),
    })
}

/// Largest distance of the bodies at the end of the last branch from those of the run of another scene.
fn change_of_places(branches: &[RunBranch], scene: &Scene) -> Result<f64> {
    let prepared = Prepared::new(scene)?;
    let mut tables: Vec<Table> = Vec::new();
    let other = run(&prepared, Fields::None, &mut tables, &mut Silent)?;
    let own = branches
        .iter()
        .rev()
        .take(1)
        .flat_map(|branch| &branch.last.bodies);
    let pairs = own.zip(&other.last().last.bodies);
    let changes =
        pairs.map(|(a, b)| (a.pose.translation.vector - b.pose.translation.vector).norm());
    Ok(changes.fold(0.0, f64::max))
}
