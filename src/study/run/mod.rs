//! Run of a scene of motion, and of every branch of it under landing = "all".

pub(super) mod bounces;
mod last_branch;
mod prepared;
pub(super) mod record;
pub(super) mod recorder;
pub(super) mod shapes;
mod spring;
pub(super) mod summary;
pub(super) mod table;
pub(super) mod tree;

pub use crate::scene::ModelKind;
pub use bounces::Bounces;
pub use last_branch::SingleMotion;
pub use prepared::Prepared;
pub use record::{Bounds, Frame, Moment, RunBranch, RunRecord};
pub use shapes::{Shapes, samples, shapes};
pub use spring::{Spring, SpringBranch, SpringMode};
pub use table::{columns, trajectory_name};
pub use tree::BranchOrigin;

use super::{Hooks, Sink};
use crate::error::Result;
use crate::motion::drive;
use recorder::Recorder;
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
    let root = prepared.motion()?;
    let spring = prepared.spring()?;
    let total = root.now().ledger().total();
    let rest = prepared.rest();
    let (branches, cut) = tree(root, prepared.run.branches, |stem, motion| {
        let first = prepared.moment(&*motion.now());
        let mut recorder = {
            let now = motion.now();
            let of = (prepared, rest.as_ref());
            Recorder::new(of, sink, hooks, fields, (stem.id, &*now), total)?
        };
        let outcome = drive(motion, prepared.run.samples, &mut recorder)?;
        let last = prepared.moment(&*motion.now());
        let entered = stem.entered.map(|snap| prepared.snap(&snap));
        let branch = RunBranch::new(
            stem.id,
            stem.parent,
            entered,
            (first, last),
            outcome.clone(),
            &*motion,
        );
        Ok((recorder.finish(&*motion, branch), outcome))
    })?;
    let folds = rest
        .as_ref()
        .map_or(Vec::new(), |rest| prepared.folds(rest, &branches));
    Ok(RunRecord {
        kind: prepared.kind(),
        units: prepared.units,
        scales: prepared.scales,
        scene: prepared.scene.clone(),
        duration: prepared.run.duration,
        solid: prepared.solid.clone(),
        strobe: prepared.run.strobe,
        bounds: Bounds {
            tolerance: prepared.run.tolerance,
            steps: prepared.run.max_steps,
            snaps: prepared.run.max_snaps,
            branches: prepared.run.branches,
            fixed_nodes: prepared.fixed_nodes,
        },
        start_index: match prepared.kind() {
            ModelKind::Sheet => branches.first().and_then(RunBranch::index_of_start),
            ModelKind::ElasticSpace => branches.first().and_then(|branch| branch.first.index),
            ModelKind::Planar | ModelKind::Space => prepared.index_of_start(),
        },
        validity: (rest.as_ref().filter(|_| !prepared.is_full()))
            .map(|rest| prepared.validity(rest, &branches, &folds)),
        folds,
        branches,
        cut,
        driven: prepared.is_driven(),
        heavy: prepared.is_heavy(),
        loaded: prepared.loaded,
        mass: prepared.mass.clone(),
        spring,
        viscosity: prepared.viscosity(),
        thickness: prepared.thickness,
        strains: prepared.strains(),
        strain_stride: recorder::stride(prepared, fields),
    })
}
