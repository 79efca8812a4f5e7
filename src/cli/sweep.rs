//! `snaprod sweep SCENE --vary PATH=FROM:TO:COUNT ..`: a table of the results of a scene over varied fields.
//!
//! Rows are computed in chunks, on all cores. A chunk is written as a draft and renamed, so that every chunk file is
//! whole after any end of the program. The same command then computes the missing chunks.

use super::check::{SceneArgs, shown};
use super::files::{print, print_error, print_json};
use super::output::{Output, OutputArgs};
use super::progress::Tally;
use super::signals::{self, Signals};
use super::{Ending, Refusal, sweep_map};
use clap::Args;
use rayon::prelude::*;
use serde_json::json;
use snaprod::plot::{outcome_map, swept_curves};
use snaprod::study::Hooks;
use snaprod::study::sweep::{Directory, Sweep, Vary};
use std::fmt::Write;

#[derive(Args)]
pub struct SweepArgs {
    #[command(flatten)]
    scene: SceneArgs,
    /// Vary a field: PATH=FROM:TO:COUNT, PATH=log:FROM:TO:COUNT or PATH=[A, B, ..]; may be repeated. Paths are those of
    /// --set: start.velocity.1, start.velocity[1] and start.velocity.y are one field, body.NAME.mass is that of the
    /// body of this name.
    #[arg(long, value_name = "PATH=VALUES", required = true)]
    vary: Vec<String>,
    /// Number of random points, instead of a grid; ranges then have no count.
    #[arg(long, value_name = "N")]
    random: Option<usize>,
    /// Seed of the random points.
    #[arg(long, value_name = "S", default_value_t = 0, requires = "random")]
    seed: u64,
    /// A result of each point: a path into summary.json, or into events, as in end.x or events.-1.t; or the least or
    /// the greatest along the run of a column of trajectory.csv, as in greatest.y; of a scene with [continue] a special
    /// point of its branch, as in BP1, LP2.energy or LP@0.4; may be repeated. Without it, the usual columns for the
    /// scene.
    #[arg(long, value_name = "PATH")]
    column: Vec<String>,
    /// The column shown in the map of a sweep over two fields, also written to the table; several are joined, as in
    /// events.-1.to.mode,events.-1.to.sign.
    #[arg(long, value_name = "PATH[,PATH]")]
    map: Option<String>,
    /// Number of threads; default the number of cores. The results do not depend on it.
    #[arg(long, value_name = "N", value_parser = clap::value_parser!(u16).range(1..=1024))]
    threads: Option<u16>,
    #[command(flatten)]
    output: OutputArgs,
}

/// Files written anew at the end; the chunks and their description stay.
const FILES: &[&str] = &["sweep.csv", "map.*", "curves.*"];

/// Computes the sweep, or its missing part.
pub fn sweep(args: &SweepArgs) -> Result<Ending, Refusal> {
    let sweep = planned(args)?;
    let mapped = args.mapped(&sweep)?;
    let directory = args.output.directory(&args.scene, "-sweep");
    args.output.figures.print.check()?;
    signals::watch();
    let opened = Directory::open(sweep, &directory, &mut Signals);
    if opened.is_err() && signals::interrupted() {
        print_error("interrupted: no point is computed yet");
        return Ok(Ending::Short);
    }
    let sweep = opened?;
    // A refused sweep leaves no directory behind.
    let out = Output::open(Some(&directory), FILES, args.output.figures)?;
    let there = sweep.made();
    for file in there.damaged {
        print_error(&format!(
            "warning: {} is damaged: its points are computed again",
            file.display()
        ));
    }
    let missing = there.missing;
    let made_now: usize = missing.iter().map(|k| sweep.points_of(*k)).sum();
    let tally = Tally::new(made_now, args.output.speaks());
    let threads = args
        .threads
        .map_or(0, |n| usize::from(n).min(missing.len()));
    let pool = rayon::ThreadPoolBuilder::new()
        .num_threads(threads)
        .build()
        .map_err(|e| Refusal(format!("--threads: {e}")))?;
    let made: Result<(), Option<snaprod::Error>> = pool.install(|| {
        missing.par_iter().try_for_each(|k| {
            let whole = sweep.make(*k, &mut ThreadHooks(&tally)).map_err(Some)?;
            whole.then_some(()).ok_or(None)
        })
    });
    tally.finish();
    match made {
        Ok(()) => {}
        Err(Some(error)) => return Err(error.into()),
        Err(None) => {
            if !args.output.quiet {
                print(&format!(
                    "interrupted: {} of {} points are in {}; repeat the command to continue\n",
                    sweep.made().kept,
                    sweep.sweep().points(),
                    directory.display()
                ));
            }
            return Ok(Ending::Short);
        }
    }
    let rows = sweep.rows()?;
    out.write("sweep.csv", &rows.csv)?;
    if args.output.figures.npz {
        out.arrays("sweep", &rows.arrays())?;
    }
    if let Some(columns) = mapped {
        out.figure(
            "map",
            || Ok(sweep_map::map(sweep.sweep(), &rows, &columns)),
            outcome_map,
        );
    }
    if is_over(sweep.sweep(), 1) {
        let data = sweep_map::curves(sweep.sweep(), &rows);
        if !data.curves.is_empty() {
            out.figure("curves", || Ok(data), swept_curves);
        }
    }
    out.finish(args.output.speaks())?;
    let asked = args.column.iter().map(|path| ("--column", path));
    for (option, path) in asked.chain(args.map_columns().iter().map(|path| ("--map", path))) {
        let column = sweep.sweep().column_of(path);
        if rows.column(&column).all(str::is_empty) {
            print_error(&format!(
                "warning: {option} {path}: not found in any point; names are those of summary.json and of events in `snaprod run --json`"
            ));
        }
    }
    let outcomes = rows.outcomes();
    if args.output.json {
        print_json(
            json!({ "points": sweep.sweep().points(), "made": made_now, "outcomes": outcomes, "out": directory }),
        );
    } else if args.output.speaks() {
        let mut text = format!(
            "{} points, {} of them computed now\n",
            sweep.sweep().points(),
            made_now
        );
        for (outcome, count) in outcomes {
            // Writing to a string cannot fail.
            let _ = writeln!(text, "  {count} {outcome}");
        }
        let _ = writeln!(text, "written to {}", directory.display());
        print(&text);
    }
    Ok(Ending::Done)
}

/// The requested sweep; refused if both its first and last point are invalid scenes.
fn planned(args: &SweepArgs) -> Result<Sweep, Refusal> {
    let text = args.scene.text()?;
    let vary = args.vary.iter().map(|text| Vary::parse(text));
    let vary = vary.collect::<snaprod::Result<Vec<_>>>()?;
    let random = args.random.map(|points| (points, args.seed));
    let sweep = Sweep::new(
        text,
        args.scene.set.clone(),
        vary,
        random,
        args.column.clone(),
    )?;
    match sweep.refused() {
        Some(why) => Err(Refusal(format!("{}: {why}", shown(&args.scene.path)))),
        None => Ok(sweep.telling(args.map_columns())?),
    }
}

/// True for a grid over this number of ranges.
fn is_over(sweep: &Sweep, fields: usize) -> bool {
    let mut vary = sweep.vary().iter();
    sweep.is_grid()
        && vary.len() == fields
        && vary.all(|one| !one.is_list() && one.count() > Some(1))
}

impl SweepArgs {
    /// Columns named by `--map`.
    fn map_columns(&self) -> Vec<String> {
        let names = self.map.iter().flat_map(|text| text.split(','));
        let names = names.map(|name| name.trim().to_owned());
        names.filter(|name| !name.is_empty()).collect()
    }

    /// Columns of the map; `None` without a map.
    fn mapped(&self, sweep: &Sweep) -> Result<Option<Vec<String>>, Refusal> {
        let two = is_over(sweep, 2);
        let named = self.map_columns();
        let known = sweep.quantities();
        match &self.map {
            Some(_) if !two => Err(Refusal(
                "--map: only a grid over two ranges has a map; give --vary PATH=FROM:TO:COUNT twice".to_owned(),
            )),
            Some(text) if named.is_empty() => Err(Refusal(format!(
                "--map {text:?}: no column is named; write one as in --column, or several with commas between them"
            ))),
            Some(_) => Ok(Some(named.iter().map(|name| sweep.column_of(name)).collect())),
            None if two => {
                let usual = known.iter().find(|column| *column == "snaps");
                Ok(usual.or(known.first()).map(|column| vec![column.clone()]))
            }
            None => Ok(None),
        }
    }
}

/// Hooks of a study in one thread.
struct ThreadHooks<'a>(&'a Tally);

impl Hooks for ThreadHooks<'_> {
    fn interrupted(&mut self) -> bool {
        signals::interrupted()
    }

    fn progress(&mut self, _fraction: f64, _point: f64) {
        self.0.count();
    }
}
