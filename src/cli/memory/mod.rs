//! `snaprod memory SCENE`: small motions of the end of a straight viscoelastic rod.

mod figure;
mod response;
mod table;
mod text;

use super::check::{no_start, refuse};
use super::files::{
    check_png, json_text, make_directory, print, print_json, write_figure, write_whole,
};
use super::{Ending, MemoryArgs, Refusal};
use response::{End, Response};
use serde_json::json;
use snaprod::scene::{AnyScene, FrictionLaw, read_any};
use std::path::Path;

/// Describes the response of the end of the scene's rod.
pub fn memory(args: &MemoryArgs) -> Result<Ending, Refusal> {
    check_png(args.png)?;
    let response = respond(&args.scene)?;
    let times = times(args, response.decades())?;
    let mut object = response.object();
    super::query::merge(
        &mut object,
        json!({ "times": { "from": times[0], "to": times[times.len() - 1], "points": times.len() } }),
    );
    if let Some(out) = &args.out {
        let columns = table::columns(&response, &times);
        let drawn = figure::draw(&response, &times, &columns)?;
        make_directory(out)?;
        write_whole(
            &out.join("memory.json"),
            json_text(object.clone()).as_bytes(),
        )?;
        write_whole(
            &out.join("kernel.csv"),
            table::csv(&times, &columns).as_bytes(),
        )?;
        write_figure(out, "kernel", &drawn, args.png)?;
    }
    if args.json {
        super::query::merge(&mut object, json!({ "out": args.out }));
        print_json(object);
    } else {
        print(&text::text(&response, &times, args.out.as_deref()));
    }
    Ok(Ending::Done)
}

/// The response of the end, as the scene's body loads it.
fn respond(path: &Path) -> Result<Response, Refusal> {
    let failed = |e: snaprod::Error| no_start(path, &e);
    match read_any(path).map_err(refuse)? {
        AnyScene::Dynamics(scene) => {
            let section = scene.viscoelastic().map_err(failed)?;
            let nonlinear = scene
                .rod
                .damping
                .is_some_and(|damping| damping.power.is_some());
            Response::new(
                &section,
                scene.rod.length,
                End::Planar,
                scene.units,
                nonlinear,
            )
            .map_err(failed)
        }
        AnyScene::SpatialMotion(scene) => {
            let section = scene.viscoelastic().map_err(failed)?;
            let end = if scene.body.joint.is_weld() {
                End::Welded
            } else {
                End::Ball
            };
            let nonlinear = scene.rod.damping.law != FrictionLaw::Linear;
            let length = scene.rod.elastic.length;
            Response::new(&section, length, end, scene.units, nonlinear).map_err(failed)
        }
        AnyScene::Statics(_) => Err(Refusal(format!(
            "{}: a scene of statics has no internal friction, and the memory is that of friction: give [rod] damping, as in \
             damping = {{ proportional = 0.05 }}, and [body], [start] and [run] in place of [end]",
            path.display()
        ))),
    }
}

/// Most times in a table.
const MOST: usize = 100_000;

/// Times in equal ratios.
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
    if !(2..=MOST).contains(&args.points) {
        return Err(Refusal(format!(
            "--points {}: from 2 to {MOST} times",
            args.points
        )));
    }
    let last = args.points - 1;
    // By logarithms, so that no ratio overflows; the ends as they were given.
    let [a, b] = [from.log10(), to.log10()];
    let mut times: Vec<f64> = (0..=last)
        .map(|k| 10.0_f64.powf(a + (b - a) * k as f64 / last as f64))
        .collect();
    (times[0], times[last]) = (from, to);
    Ok(times)
}
