//! The page of a run, with pictures from a second pass over the motion.

use super::page::{Kind, MotionContext, Page, event_rows, motion_data, name, scene_text};
use super::progress::Progress;
use super::run::RunArgs;
use super::run_figures::{first_folds, snaps_name};
use super::{Refusal, assembly, run_text};
use snaprod::assembly::Joint;
use snaprod::motion::Snap;
use snaprod::study::assembly::{AssemblyPrepared, AssemblyRunRecord};
use snaprod::study::film::film;
use snaprod::study::run::{ModelKind, Prepared, RunRecord};

/// Figures drawn by the page itself.
const DRAWN: [&str; 3] = ["energies", "surface", "path"];
/// Number of moments around which pictures are denser.
const MOMENTS: usize = 20;

/// Number of pictures, without those of snaps, and of points of the trace of one body.
const PICTURES: usize = 400;
const POINTS: usize = 1500;

type Figures = Vec<(String, String)>;

/// The page of one rod.
pub fn single(
    args: &RunArgs,
    prepared: &Prepared,
    record: &RunRecord,
    figures: Figures,
) -> Result<Page, Refusal> {
    let entered = |id: usize| {
        let branch = &record.branches[id];
        (branch.parent, branch.entered.clone())
    };
    let drawn = record.line();
    let mut marks: Vec<f64> = drawn.snaps.iter().map(|(t, _)| *t).collect();
    marks.sort_by(f64::total_cmp);
    let mut progress = progress(args);
    let film = film(
        prepared,
        prepared.motion()?,
        &line(record.last().id, entered),
        &marks[..marks.len().min(MOMENTS)],
        many(1),
        &mut progress,
    )?;
    progress.finish();
    let length = record.scales.length;
    let elastica = matches!(record.kind, ModelKind::Sheet | ModelKind::Planar);
    let folds = if elastica {
        first_folds(&drawn.way, record)?
    } else {
        Vec::new()
    };
    let around = MotionContext {
        units: record.units,
        length,
        rods: vec![String::new()],
        grounds: vec![[Some(Joint::Weld), None]],
        bodies: vec![(String::new(), record.solid.clone())],
        marks,
        marked: snaps_name(record),
        elastica,
        exact: record.kind == ModelKind::Sheet,
        folds,
    };
    Ok(page(
        args,
        motion_data(&film, &around)?,
        run_text::text(record, None),
        event_rows(&record.events(), record.units),
        figures,
    ))
}

/// The page of an assembly.
pub fn several(
    args: &RunArgs,
    prepared: &AssemblyPrepared,
    record: &AssemblyRunRecord,
    figures: Figures,
) -> Result<Page, Refusal> {
    let entered = |id: usize| {
        let stem = &record.branches[id].stem;
        (stem.parent, stem.entered.clone())
    };
    let snaps = record.last().all_snaps();
    let marks: Vec<f64> = snaps.map(|snap| snap.t * record.scales.time).collect();
    let mut progress = progress(args);
    let film = film(
        prepared,
        prepared.motion()?.0,
        &line(record.last().stem.id, entered),
        &marks[..marks.len().min(MOMENTS)],
        many(record.bodies.len()),
        &mut progress,
    )?;
    progress.finish();
    let bodies = record.bodies.iter().cloned();
    let around = MotionContext {
        units: record.units,
        length: record.scales.length,
        rods: prepared.names(),
        grounds: prepared.grounds(),
        bodies: bodies.zip(record.solids.iter().cloned()).collect(),
        marks,
        marked: "snap",
        elastica: false,
        exact: false,
        folds: Vec::new(),
    };
    Ok(page(
        args,
        motion_data(&film, &around)?,
        assembly::run_text(record, None),
        event_rows(&record.events(), record.units),
        figures,
    ))
}

/// Number of pictures, and of points of the trace, for this many bodies.
fn many(bodies: usize) -> [usize; 2] {
    [PICTURES, 3 * POINTS / (bodies + 2)]
}

fn progress(args: &RunArgs) -> Progress {
    Progress::new(!args.quiet && !args.json)
}

/// Snaps at the start of the branches from the trunk to branch `last`.
fn line(last: usize, entered: impl Fn(usize) -> (Option<usize>, Option<Snap>)) -> Vec<Snap> {
    let mut snaps = Vec::new();
    let mut at = Some(last);
    while let Some(id) = at {
        let (parent, snap) = entered(id);
        snaps.extend(snap);
        at = parent;
    }
    snaps.reverse();
    snaps
}

fn page(
    args: &RunArgs,
    data: serde_json::Value,
    words: String,
    events: Vec<[String; 3]>,
    mut figures: Figures,
) -> Page {
    figures.retain(|(name, _)| !DRAWN.contains(&name.as_str()));
    Page {
        name: name(&args.scene),
        kind: Kind::Motion,
        data,
        words,
        events,
        figures,
        scene: scene_text(&args.scene),
    }
}
