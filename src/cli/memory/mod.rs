//! `snaprod memory SCENE`: small motions of the end of a straight viscoelastic rod.

mod figure;
mod text;

use super::check::{SceneArgs, no_start, refuse};
use super::files::{json_text, print, print_json};
use super::output::{Output, OutputArgs};
use super::{Ending, Refusal};
use clap::Args;
use serde_json::json;
use snaprod::plot::kernel;
use snaprod::study::memory::{self, POINTS, entries, table};

#[derive(Args)]
pub struct MemoryArgs {
    #[command(flatten)]
    pub scene: SceneArgs,
    /// First time, in the scene's unit; default a decade before the first relaxation.
    #[arg(long)]
    pub from: Option<f64>,
    /// Last time; default a decade after the last relaxation.
    #[arg(long)]
    pub to: Option<f64>,
    /// Number of times, logarithmically spaced, from 2 to 100000.
    #[arg(long, default_value_t = 201)]
    pub points: usize,
    #[command(flatten)]
    pub output: OutputArgs,
}

/// Files of the command.
const FILES: &[&str] = &["memory.json", "kernel.*"];

/// Describes the response of the end of the scene's rod.
pub fn memory(args: &MemoryArgs) -> Result<Ending, Refusal> {
    let scene = args.scene.read().map_err(refuse)?;
    let response = memory::memory(&scene).map_err(|e| no_start(&args.scene.path, &e))?;
    let times = times(args, response.decades())?;
    let mut object = response.summary();
    object["times"] =
        json!({ "from": times[0], "to": times[times.len() - 1], "points": times.len() });
    if let Some(out) = &args.output.out {
        let entries = entries(&response, &times);
        let out = Output::open(Some(out), FILES, args.output.figures)?;
        out.write("memory.json", json_text(object.clone()).as_bytes())?;
        out.table(&table(&response, &times, &entries))?;
        let data = || Ok(figure::data(&response, &times, &entries));
        out.figure("kernel", data, kernel);
        out.finish(args.output.speaks())?;
    }
    if args.output.json {
        object["out"] = json!(args.output.out);
        print_json(object);
    } else if args.output.speaks() {
        print(&text::text(&response, &times, args.output.out.as_deref()));
    }
    Ok(Ending::Done)
}

/// The times of the table.
fn times(args: &MemoryArgs, decades: [f64; 2]) -> Result<Vec<f64>, Refusal> {
    let [mut from, mut to] = decades;
    for (name, given, time) in [("--from", args.from, &mut from), ("--to", args.to, &mut to)] {
        if let Some(t) = given {
            if !(f64::MIN_POSITIVE..f64::INFINITY).contains(&t) {
                return Err(Refusal(format!(
                    "{name} {t}: a time must be finite and > 0, the table is in ratios of time; leave {name} out for a time that \
                     fits the rod, {time:e}"
                )));
            }
            *time = t;
        }
    }
    if !(from < to) {
        return Err(Refusal(format!(
            "the times run from {from:e} to {to:e}: --from must be less than --to"
        )));
    }
    if !POINTS.contains(&args.points) {
        return Err(Refusal(format!(
            "--points {}: from {} to {} times",
            args.points,
            POINTS.start(),
            POINTS.end()
        )));
    }
    Ok(memory::times([from, to], args.points)?)
}
