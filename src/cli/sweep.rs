//! `snaprod sweep SCENE --vary PATH=FROM:TO:COUNT ..`: a table of what comes of a scene whose fields vary.
//!
//! Rows are made in chunks, on all cores. A chunk is written aside and renamed: whatever ends the program, a file is whole or not
//! there, and the same command goes on with what is missing.

use super::check::SceneArgs;
use super::files::{print, print_error, print_json};
use super::output::{FigureArgs, Output};
use super::progress::Progress;
use super::{Ending, Refusal, signals};
use clap::Args;
use rayon::prelude::*;
use serde_json::{Value, json};
use snaprod::plot::{OutcomeMap, Outcomes, SweptAxis, outcome_map};
use snaprod::study::sweep::{Interrupted, Sweep, Vary, fields};
use snaprod::study::{Csv, Hooks};
use std::fmt::Write;
use std::fs;
use std::path::{Path, PathBuf};
use std::sync::Mutex;
use std::sync::atomic::{AtomicUsize, Ordering};

#[derive(Args)]
pub struct SweepArgs {
    #[command(flatten)]
    scene: SceneArgs,
    /// Vary a field: PATH=FROM:TO:COUNT, PATH=log:FROM:TO:COUNT or PATH=[A, B, ..]; may be repeated. Paths are those of --set, with
    /// start.velocity.1 for start.velocity[1].
    #[arg(long, value_name = "PATH=VALUES", required = true)]
    vary: Vec<String>,
    /// So many points at random instead of a grid; ranges then have no count.
    #[arg(long, value_name = "N")]
    random: Option<usize>,
    /// The seed of the points at random.
    #[arg(long, value_name = "S", default_value_t = 0, requires = "random")]
    seed: u64,
    /// What to tell of each point: a path into summary.json, or into events, as in end.x or events.-1.t; may be repeated.
    #[arg(long, value_name = "PATH")]
    column: Vec<String>,
    /// The column that the map of a sweep over two fields shows; several are joined, as in events.-1.to.mode,events.-1.to.sign.
    #[arg(long, value_name = "PATH[,PATH]")]
    map: Option<String>,
    /// How many threads work; default as many as there are cores. What they write does not depend on it.
    #[arg(long, value_name = "N")]
    threads: Option<usize>,
    /// Where to write; default out/ and the name of the scene with -sweep.
    #[arg(long)]
    out: Option<PathBuf>,
    /// Print what came of it as one JSON object.
    #[arg(long)]
    json: bool,
    /// Print nothing but errors; no progress bar.
    #[arg(long)]
    quiet: bool,
    #[command(flatten)]
    figures: FigureArgs,
}

/// Files that are made anew at the end; the chunks and what they belong to stay.
const FILES: &[&str] = &["sweep.csv", "map.*"];
/// What the chunks belong to.
const PLAN: &str = "sweep.json";
/// Where they are.
const CHUNKS: &str = "chunks";

/// Makes the sweep, or what is missing of it.
pub fn sweep(args: &SweepArgs) -> Result<Ending, Refusal> {
    let sweep = planned(args)?;
    let mapped = args.mapped(&sweep)?;
    let directory = match &args.out {
        Some(out) => out.clone(),
        None => {
            let mut name = args.scene.directory().into_os_string();
            name.push("-sweep");
            name.into()
        }
    };
    let pool = rayon::ThreadPoolBuilder::new()
        .num_threads(args.threads.unwrap_or(0))
        .build()
        .map_err(|e| Refusal(format!("--threads: {e}")))?;
    let out = Output::open(Some(&directory), FILES, args.figures)?;
    begin(&sweep, &directory)?;
    signals::watch();
    let chunks = sweep.chunks();
    let path = |k: usize| directory.join(CHUNKS).join(format!("{k:06}.csv"));
    let missing: Vec<usize> = (0..chunks.len()).filter(|k| !path(*k).exists()).collect();
    let tally = Tally {
        done: AtomicUsize::new(0),
        all: missing.iter().map(|k| chunks[*k].len()).sum(),
        progress: Mutex::new(Progress::new(!args.quiet && !args.json)),
    };
    let made = pool.install(|| {
        missing.par_iter().try_for_each(|k| {
            let rows = sweep
                .rows(chunks[*k].clone(), &mut Worker(&tally))
                .map_err(|Interrupted| None)?;
            whole(&path(*k), rows.as_bytes()).map_err(Some)
        })
    });
    if let Ok(progress) = tally.progress.lock() {
        progress.finish();
    }
    match made {
        Ok(()) => {}
        Err(Some(refusal)) => return Err(refusal),
        Err(None) => {
            let kept = (0..chunks.len()).filter(|k| path(*k).exists());
            let kept: usize = kept.map(|k| chunks[k].len()).sum();
            if !args.quiet {
                print(&format!(
                    "interrupted: {kept} of {} points are in {}; the same command goes on\n",
                    sweep.points(),
                    directory.display()
                ));
            }
            return Ok(Ending::Short);
        }
    }
    let mut rows = String::new();
    for k in 0..chunks.len() {
        rows += &read(&path(k))?;
    }
    let table = Table::new(
        &sweep,
        &rows,
        chunks.iter().map(ExactSizeIterator::len).sum(),
    )?;
    let mut csv = Vec::new();
    // Nothing fails in memory.
    let _ = Csv::new(&mut csv, &sweep.table());
    csv.extend(rows.as_bytes());
    out.write("sweep.csv", &csv)?;
    if let Some(columns) = mapped {
        out.figure("map", || Ok(table.map(&sweep, &columns)), outcome_map);
    }
    out.finish()?;
    for path in &args.column {
        if table.column(path).all(str::is_empty) {
            print_error(&format!(
                "warning: --column {path}: no point has it; the names are those of summary.json, and events, of `snaprod run --json`"
            ));
        }
    }
    let outcomes = table.outcomes();
    if args.json {
        print_json(
            json!({ "points": sweep.points(), "made": tally.all, "outcomes": outcomes, "out": directory }),
        );
    } else if !args.quiet {
        let mut text = format!(
            "{} points, {} of them made now\n",
            sweep.points(),
            tally.all
        );
        for (outcome, count) in outcomes {
            // Nothing fails in memory.
            let _ = writeln!(text, "  {count} {outcome}");
        }
        let _ = writeln!(text, "written to {}", directory.display());
        print(&text);
    }
    Ok(Ending::Done)
}

/// The sweep that is asked for. One whose first and last point are no scenes is refused.
fn planned(args: &SweepArgs) -> Result<Sweep, Refusal> {
    let path = &args.scene.path;
    let text = fs::read_to_string(path)
        .map_err(|e| Refusal(format!("cannot read {}: {e}", path.display())))?;
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
    match (sweep.scene(0), sweep.scene(sweep.points() - 1)) {
        (Err(why), Err(_)) => Err(Refusal(format!("{}: {why}", path.display()))),
        _ => Ok(sweep),
    }
}

impl SweepArgs {
    /// The columns of the map; None where there is none.
    fn mapped(&self, sweep: &Sweep) -> Result<Option<Vec<String>>, Refusal> {
        let two = sweep.is_grid()
            && sweep.vary().len() == 2
            && sweep
                .vary()
                .iter()
                .all(|one| !one.is_list() && one.count() > Some(1));
        let known = sweep.quantities();
        match &self.map {
            Some(_) if !two => Err(Refusal(
                "--map: only a grid over two ranges has a map; give --vary PATH=FROM:TO:COUNT twice".to_owned(),
            )),
            Some(columns) => {
                let columns: Vec<String> = columns.split(',').map(|c| c.trim().to_owned()).collect();
                match columns.iter().find(|column| !known.contains(column)) {
                    Some(column) => Err(Refusal(format!(
                        "--map {column}: no column has this name; there are {}; add it by --column {column}",
                        known.join(", ")
                    ))),
                    None => Ok(Some(columns)),
                }
            }
            None if two => {
                let usual = known.iter().find(|column| *column == "snaps");
                Ok(usual.or(known.first()).map(|column| vec![column.clone()]))
            }
            None => Ok(None),
        }
    }
}

/// Makes the directory that of this sweep, or finds that it is.
fn begin(sweep: &Sweep, directory: &Path) -> Result<(), Refusal> {
    let plan = directory.join(PLAN);
    let identity = sweep.identity();
    if plan.exists() {
        let there: Value = serde_json::from_str(&read(&plan)?).unwrap_or(Value::Null);
        if there == identity {
            return Ok(());
        }
        let keys = identity.as_object().into_iter().flatten();
        let differ: Vec<&str> = keys
            .filter(|(key, value)| there[key.as_str()] != **value)
            .map(|(key, _)| key.as_str())
            .collect();
        return Err(Refusal(format!(
            "{} holds another sweep (it differs in: {}); choose another directory with --out, or remove that one",
            directory.display(),
            differ.join(", ")
        )));
    }
    let chunks = directory.join(CHUNKS);
    let made = fs::create_dir_all(&chunks);
    made.map_err(|e| Refusal(format!("cannot make {}: {e}", chunks.display())))?;
    // Chunks of nobody knows what.
    for entry in fs::read_dir(&chunks).into_iter().flatten().flatten() {
        let removed = fs::remove_file(entry.path());
        removed.map_err(|e| Refusal(format!("cannot remove {}: {e}", entry.path().display())))?;
    }
    whole(&plan, super::files::json_text(identity).as_bytes())
}

/// Writes a file aside and gives it its name.
fn whole(path: &Path, bytes: &[u8]) -> Result<(), Refusal> {
    let aside = path.with_extension("part");
    fs::write(&aside, bytes)
        .and_then(|()| fs::rename(&aside, path))
        .map_err(|e| Refusal(format!("cannot write {}: {e}", path.display())))
}

fn read(path: &Path) -> Result<String, Refusal> {
    fs::read_to_string(path).map_err(|e| Refusal(format!("cannot read {}: {e}", path.display())))
}

/// How far all threads are together.
struct Tally {
    done: AtomicUsize,
    all: usize,
    progress: Mutex<Progress>,
}

/// The hooks of one thread.
struct Worker<'a>(&'a Tally);

impl Hooks for Worker<'_> {
    fn interrupted(&mut self) -> bool {
        signals::interrupted()
    }

    fn progress(&mut self, _fraction: f64, _point: f64) {
        let done = self.0.done.fetch_add(1, Ordering::Relaxed) + 1;
        // Another thread shows it already.
        if let Ok(mut progress) = self.0.progress.try_lock() {
            progress.progress(done as f64 / self.0.all as f64, done as f64);
        }
    }
}

/// All rows, taken apart.
struct Table {
    names: Vec<String>,
    rows: Vec<Vec<String>>,
}

impl Table {
    fn new(sweep: &Sweep, text: &str, points: usize) -> Result<Self, Refusal> {
        let columns = sweep.table().columns;
        let names: Vec<String> = columns
            .iter()
            .map(|c| c.name.clone().into_owned())
            .collect();
        let rows: Vec<Vec<String>> = text.lines().map(fields).collect();
        if rows.len() != points || rows.iter().any(|row| row.len() != names.len()) {
            return Err(Refusal(format!(
                "the chunks do not hold the {points} rows of the sweep: somebody changed them; remove the directory"
            )));
        }
        Ok(Self { names, rows })
    }

    fn column(&self, name: &str) -> impl Iterator<Item = &str> {
        let place = self.names.iter().position(|other| other == name);
        self.rows
            .iter()
            .filter_map(move |row| Some(row[place?].as_str()))
    }

    /// How often each outcome came.
    fn outcomes(&self) -> std::collections::BTreeMap<&str, usize> {
        let mut counts = std::collections::BTreeMap::new();
        for outcome in self.column("outcome") {
            *counts.entry(outcome).or_default() += 1;
        }
        counts
    }

    /// The map over the two fields: numbers if one column is shown and holds some that are not whole, or words.
    fn map(&self, sweep: &Sweep, columns: &[String]) -> OutcomeMap {
        let axis = |k: usize| {
            let one = &sweep.vary()[k];
            let values = (0..one.count().unwrap_or(0)).map(|i| one.on_grid(i));
            SweptAxis {
                label: one.path.clone(),
                values: values.map(|x| x.parse().unwrap_or(f64::NAN)).collect(),
                log: one.is_logarithmic(),
            }
        };
        let mut words = vec![String::new(); self.rows.len()];
        for column in columns {
            for (word, part) in words.iter_mut().zip(self.column(column)) {
                if !(word.is_empty() || part.is_empty()) {
                    word.push(' ');
                }
                word.push_str(part);
            }
        }
        let number = |word: &String| word.parse::<f64>().ok();
        let whole = |word: &String| word.is_empty() || word.parse::<i64>().is_ok();
        let numbers = columns.len() == 1
            && words
                .iter()
                .all(|word| word.is_empty() || number(word).is_some())
            && !words.iter().all(whole);
        let label = columns.join(", ");
        OutcomeMap {
            title: label.clone(),
            x: axis(0),
            y: axis(1),
            outcomes: if numbers {
                Outcomes::Numbers(
                    words
                        .iter()
                        .map(|word| number(word).unwrap_or(f64::NAN))
                        .collect(),
                    label,
                )
            } else {
                Outcomes::Words(words)
            },
        }
    }
}
