//! `snaprod run SCENE`, the motion of a scene: trajectory.csv, strain.csv, events.json, summary.json, resolved.toml
//! and figures.

use super::check::SceneArgs;
use super::files::{json_text, print, print_error, print_json, toml_text};
use super::first_order::{self, ByArgs};
use super::output::{Output, OutputArgs};
use super::progress::Progress;
use super::run_figures::{RunFigure, moves, run_figures};
use super::run_film::FilmFormat;
use super::{Ending, Refusal, bar, check, flow, inflation, run_film, run_page, run_text, signals};
use clap::Args;
use serde_json::{Value, json};
use snaprod::study::dispatch::{PreparedScene, SceneRun};
use snaprod::study::export::{gltf, posed, shape_arrays, vtk};
use snaprod::study::run::{Fields, Prepared, RunRecord, SimulationState, derivatives};
use std::path::{Path, PathBuf};

#[derive(Args)]
pub struct RunArgs {
    #[command(flatten)]
    pub scene: SceneArgs,
    #[command(flatten)]
    pub output: OutputArgs,
    /// Write no strain.csv, the strains along a rod with damping or mass, or an elastic one in space.
    #[arg(long)]
    pub no_strain: bool,
    /// Write all samples into strain.csv, not only some 400 of them.
    #[arg(long, conflicts_with = "no_strain")]
    pub all_strain: bool,
    /// Write run.html, a page that plays the motion: one file, no network needed.
    #[arg(long)]
    pub html: bool,
    /// Write the rods and bodies at every sample for ParaView: run.vtkhdf, one file with all times.
    #[arg(long)]
    pub vtk: bool,
    /// Write the rods and bodies as an animation for Blender, browsers and slides: run.glb (glTF).
    #[arg(long)]
    pub gltf: bool,
    /// Write a film of the motion: FILE.svg plays in browsers; FILE.gif and FILE.mp4 need the feature `png`, and
    /// FILE.mp4 the program ffmpeg.
    #[arg(long, value_name = "FILE")]
    pub film: Option<PathBuf>,
    /// Write state.json, the state at the end, from which another run goes on (--from).
    #[arg(long)]
    pub state: bool,
    #[command(flatten)]
    pub by: ByArgs,
    /// Go on from the state.json of another run of the scene: its directory, or the file.
    #[arg(long, value_name = "DIR", conflicts_with_all = ["html", "vtk", "gltf", "film", "npz"])]
    pub from: Option<PathBuf>,
}

impl RunArgs {
    /// True if shapes of the rods are written, which requires a second pass over the motion.
    pub fn follows_again(&self) -> bool {
        self.directory().is_some() && (self.output.figures.npz || self.vtk || self.gltf)
    }

    /// Output directory; `None`: no file is written.
    pub fn directory(&self) -> Option<PathBuf> {
        let wanted = self.output.out.is_some() || !self.output.json;
        wanted.then(|| self.output.directory(&self.scene, ""))
    }
}

/// Names of all files that a run may write.
pub const FILES: &[&str] = &[
    "trajectory.csv",
    "trajectory-*.csv",
    "derivatives.csv",
    "strain.csv",
    "strain-*.csv",
    "contacts.csv",
    "events.json",
    "summary.json",
    "resolved.toml",
    "state.json",
    "snapshots.*",
    "energies.*",
    "surface.*",
    "strain*.svg",
    "strain*.png",
    "strain*.pdf",
    "layer.*",
    "losses.*",
    "shapes.*",
    "path.*",
    "path_*.svg",
    "path_*.png",
    "path_*.pdf",
    "poincare.*",
    "waves.*",
    "fields.csv",
    "fields.npz",
    "area.*",
    "cycle.*",
    "height.*",
    "run.html",
    "run.vtkhdf",
    "run.glb",
    "run.pvd",
    "run-*.vtu",
];

/// Runs the scene.
pub fn run(args: &RunArgs) -> Result<Ending, Refusal> {
    let scene = check::read(&args.scene)?;
    if scene.is_bar() {
        bar::refuse_options(args)?;
    }
    if scene.flow().is_some() {
        flow::refuse_options(args)?;
    }
    if scene.inflation().is_some() {
        inflation::refuse_options(args)?;
    }
    let no_start = |e: snaprod::Error| check::no_start(&args.scene.path, &e);
    if let Some(file) = &args.film {
        FilmFormat::of(file)?;
    }
    let by = args.by.fields(&args.scene)?;
    let derivatives = if by.is_empty() {
        None
    } else if args.from.is_some() {
        return Err(Refusal(
            "--by: derivatives are those of a run from its start: leave out --from".to_owned(),
        ));
    } else {
        Some(derivatives(&scene, &by).map_err(no_start)?)
    };
    let prepared = PreparedScene::new(&scene).map_err(no_start)?;
    // A start that cannot run is refused before a directory is made.
    let mut start = prepared.start().map_err(no_start)?;
    if let Some(path) = &args.from {
        start = start.restored(&saved_state(path)?)?;
    }
    let directory = args.directory();
    let out = Output::open(directory.as_deref(), FILES, args.output.figures)?;
    signals::watch();
    let mut tables = out.tables();
    let mut progress = Progress::new(args.output.speaks()).of_drawn(out.draws());
    let fields = match (args.no_strain || directory.is_none(), args.all_strain) {
        (true, _) => Fields::None,
        (_, true) => Fields::All,
        (_, false) => Fields::Some,
    };
    let run = start.run(fields, &mut tables, &mut progress)?;
    progress.finish();
    tables.finish()?;
    let result = run.result();
    let (mut summary, events) = (result.summary, Value::Array(result.events));
    if let Some(derivatives) = &derivatives {
        derivatives.put_into(&mut summary);
        out.table(&derivatives.table()?)?;
    }
    out.write("events.json", json_text(events.clone()).as_bytes())?;
    out.write("summary.json", json_text(summary.clone()).as_bytes())?;
    out.write("resolved.toml", toml_text(&summary["scene"])?.as_bytes())?;
    if args.state {
        match result.state {
            Ok(state) => out.write("state.json", json_text(state.json()).as_bytes())?,
            Err(why) => print_error(&format!("warning: state.json is missing: {why}")),
        }
    }
    draw(args, &out, &run);
    out.finish(args.output.speaks())?;
    if args.output.json {
        (summary["events"], summary["out"]) = (events, json!(directory));
        print_json(summary);
    } else if args.output.speaks() {
        print(&(text(&run, directory.as_deref()) + &first_order::text(&summary)));
    }
    let Some(why) = result.reason else {
        return Ok(Ending::Done);
    };
    if !args.output.json {
        print_error(&format!("the run ended short: {why}"));
    }
    Ok(Ending::Short)
}

/// The state that another run has written into a directory, or into a file.
fn saved_state(path: &Path) -> Result<SimulationState, Refusal> {
    let file = if path.is_dir() {
        path.join("state.json")
    } else {
        path.to_owned()
    };
    let named = |why: String| Refusal(format!("--from: {}: {why}", file.display()));
    let text = std::fs::read_to_string(&file)
        .map_err(|e| named(format!("{e}; a run with --state writes this file")))?;
    let value: Value = serde_json::from_str(&text).map_err(|e| named(e.to_string()))?;
    SimulationState::from_json(&value).map_err(|e| named(e.to_string()))
}

/// Writes the shapes and draws the figures and the page, as far as they are requested.
fn draw(args: &RunArgs, out: &Output, run: &SceneRun) {
    let (prepared, record) = match run {
        SceneRun::Rods(prepared, record) => (*prepared, record),
        SceneRun::Bar(record) => return bar::draw(out, record),
        SceneRun::Flow(record) => return flow::draw(out, record),
        SceneRun::Inflation(record) => return inflation::draw(out, record),
    };
    write_shapes(args, out, prepared, record);
    if out.draws() {
        for (name, figure) in run_figures(record) {
            out.figure(&name, || Ok(figure?), RunFigure::draw);
        }
        if record.header.is_assembly() && !moves(record) {
            print_error(
                "note: no energies.svg and no path_*.svg: the run ended at its start, and there is no motion to draw",
            );
        }
    }
    if let Some(file) = &args.film
        && let Err(Refusal(why)) = run_film::write(args, file, prepared, record)
    {
        print_error(&format!("warning: {} is missing: {why}", file.display()));
    }
    if args.html {
        out.page("run", |figures| {
            run_page::page(args, prepared, record, figures)
        });
    }
}

/// The report of a run whose files are in `directory`.
fn text(run: &SceneRun, directory: Option<&Path>) -> String {
    match run {
        SceneRun::Rods(_, record) => run_text::text(record, directory),
        SceneRun::Bar(record) => bar::text(record, directory),
        SceneRun::Flow(record) => flow::text(record, directory),
        SceneRun::Inflation(record) => inflation::text(record, directory),
    }
}

/// Number of sections of a light rod, or of an element of a rod with its own strains, in files for other programs.
const SECTIONS: usize = 61;

/// Repeats the motion up to the end of its trunk, and writes shapes.npz and the files of ParaView if requested. A
/// failure is only a warning: the run stays valid.
fn write_shapes(args: &RunArgs, out: &Output, prepared: &Prepared, record: &RunRecord) {
    if !args.follows_again() {
        return;
    }
    if let Err(Refusal(why)) = try_shapes(args, out, prepared, record.branches[0].last.t) {
        print_error(&format!(
            "warning: the shapes of the rods are missing: {why}"
        ));
    }
}

fn try_shapes(args: &RunArgs, out: &Output, prepared: &Prepared, last: f64) -> Result<(), Refusal> {
    let run = &prepared.header.run;
    let steps = run.samples - 1;
    let even = (0..=steps).map(|k| run.duration * k as f64 / steps as f64);
    let mut times: Vec<f64> = even.filter(|t| *t <= last).collect();
    // The last state of a run that ended short is also written.
    if times.last().is_none_or(|t| last - t > 1e-9 * last) {
        times.push(last);
    }
    let mut progress = Progress::new(args.output.speaks());
    let moments = posed(prepared, &times, SECTIONS, &mut progress)?;
    progress.finish();
    if args.output.figures.npz {
        let rods = prepared.header.rods.iter();
        let names: Vec<String> = rods.map(|rod| rod.name.clone()).collect();
        out.arrays("shapes", &shape_arrays(&names, &moments))?;
    }
    if args.vtk {
        out.write("run.vtkhdf", &vtk(&moments))?;
    }
    if args.gltf {
        out.write("run.glb", &gltf(&prepared.header, &moments))?;
    }
    Ok(())
}
