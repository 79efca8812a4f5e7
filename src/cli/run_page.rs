//! The page of a run, with pictures from a second pass over the motion.

use super::page::{MotionContext, Page, PageKind, event_rows, motion_data, scene_text};
use super::progress::Progress;
use super::run::RunArgs;
use super::run_figures::{first_folds, snaps_name};
use super::{Refusal, run_text};
use snaprod::study::film::film;
use snaprod::study::run::{Prepared, RunRecord};

/// Figures drawn by the page itself.
const DRAWN: [&str; 3] = ["energies", "surface", "path"];
/// Number of moments around which pictures are denser.
const MOMENTS: usize = 20;

/// Number of pictures, without those of snaps, and of points of the trace of one body.
const PICTURES: usize = 400;
const POINTS: usize = 1500;

/// For each body of a scene: true if the body has a `solid` or a shape of its own, hence a size.
pub fn sized(scene: &str) -> Vec<bool> {
    let Ok(scene) = toml::from_str::<toml::Table>(scene) else {
        return Vec::new();
    };
    let has_size = |body: &toml::Value| {
        let is_shape = |shape: &toml::Value| shape.as_str() != Some("point");
        body.get("solid").is_some() || body.get("shape").is_some_and(is_shape)
    };
    match scene.get("body") {
        Some(toml::Value::Array(bodies)) => bodies.iter().map(has_size).collect(),
        Some(body) => vec![has_size(body)],
        None => Vec::new(),
    }
}

/// The page of a run of rods; `figures` are those already drawn.
pub fn page(
    args: &RunArgs,
    prepared: &Prepared,
    record: &RunRecord,
    mut figures: Vec<(String, String)>,
) -> Result<Page, Refusal> {
    let (header, drawn) = (&record.header, record.line());
    let mut marks: Vec<f64> = drawn.snaps.iter().map(|(t, _)| *t).collect();
    marks.sort_by(f64::total_cmp);
    let forks = record.lineage().into_iter().skip(1);
    let forks: Vec<usize> = forks.map(|branch| branch.fork).collect();
    let mut progress = Progress::new(args.output.speaks());
    let film = film(
        prepared,
        &forks,
        &marks[..marks.len().min(MOMENTS)],
        [PICTURES, 3 * POINTS / (header.bodies.len() + 2)],
        &mut progress,
    )?;
    progress.finish();
    let around = MotionContext {
        header,
        marks,
        marked: snaps_name(record),
        folds: if header.in_space() {
            Vec::new()
        } else {
            first_folds(&drawn.way, record)?
        },
        sized: sized(&scene_text(&args.scene)),
    };
    figures.retain(|(name, _)| !DRAWN.contains(&name.as_str()));
    Ok(Page {
        name: args.scene.name(),
        kind: PageKind::Motion,
        data: motion_data(&film, &around)?,
        words: run_text::text(record, None),
        events: event_rows(&record.events(), header.units),
        figures,
        scene: scene_text(&args.scene),
    })
}
