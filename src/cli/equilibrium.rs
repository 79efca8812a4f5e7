//! `snaprod equilibrium SCENE`: the equilibrium of a scene of statics.

use super::check::{SceneArgs, no_start, read_equilibrium};
use super::files::{json_text, number, print, print_json, settled};
use super::first_order::{self, FirstOrderArgs};
use super::output::{Output, OutputArgs};
use super::{Ending, Refusal, assembly_equilibrium, rod_figures, wall};
use clap::Args;
use nalgebra::Vector3;
use snaprod::math::se3::halves;
use snaprod::plot::rod_state;
use snaprod::rod::{Equilibrium, Path};
use snaprod::section::Centreline;
use snaprod::study::{self, ContactRecord, EquilibriumRecord, dispatch};
use std::fmt::Write;

#[derive(Args)]
pub struct EquilibriumArgs {
    #[command(flatten)]
    pub scene: SceneArgs,
    #[command(flatten)]
    pub output: OutputArgs,
    #[command(flatten)]
    pub first_order: FirstOrderArgs,
}

/// Words in place of the index under loads along rods without a potential.
pub(super) const NO_INDEX: &str = "none (a load that turns with the rod, or a couple on it, has no potential; stability may be lost by growing oscillations)";
/// Files of the command.
pub const FILES: &[&str] = &["equilibrium.*", "shape.csv", "contacts.csv"];

/// Solves the scene and describes its equilibrium.
pub fn equilibrium(args: &EquilibriumArgs) -> Result<Ending, Refusal> {
    let scene = read_equilibrium(&args.scene)?;
    if scene.is_assembly() {
        return assembly_equilibrium::equilibrium(args, &scene);
    }
    let asked = args.first_order.asked(&args.scene)?;
    if scene.wall().is_some() {
        let refused = asked.refused(dispatch::WALL);
        refused.map_err(|e| no_start(&args.scene.path, &e))?;
        return wall::equilibrium(args, &scene);
    }
    let record = study::equilibrium(&scene).map_err(|e| no_start(&args.scene.path, &e))?;
    let mut summary = record.summary();
    asked
        .of_rod(&scene, &record, &mut summary)
        .map_err(|e| no_start(&args.scene.path, &e))?;
    if let Some(directory) = &args.output.out {
        let out = Output::open(Some(directory), FILES, args.output.figures)?;
        out.write("equilibrium.json", json_text(summary.clone()).as_bytes())?;
        out.table(&record.shape()?)?;
        if let Some(contacts) = &record.contacts {
            out.table(&contacts.table(record.units)?)?;
        }
        out.figure("equilibrium", || Ok(rod_figures::state(&record)), rod_state);
        out.finish(args.output.speaks())?;
    }
    if args.output.json {
        print_json(summary);
    } else if args.output.speaks() {
        print(&(text(&record) + &first_order::text(&summary)));
    }
    Ok(Ending::Done)
}

fn text(record: &EquilibriumRecord) -> String {
    let found = &record.found;
    let mut text = String::new();
    let mut line = |name: &str, value: String| {
        let _ = writeln!(text, "{name:<15}{value}");
    };
    let (couple, force) = halves(&found.base);
    let end = &found.end;
    // Rounding is judged against the largest force or couple, and against the bending of the rod.
    let largest = |a: f64, b: &Vector3<f64>| a.max(b.amax());
    let couples = [&couple, &end.couple]
        .into_iter()
        .fold(record.stiffness / record.length, largest);
    let couples = couples.max(force.amax().max(end.force.amax()) * record.length);
    let forces = couples / record.length;
    let list = |x: &[f64], scale: f64| {
        let numbers: Vec<String> = x.iter().map(|x| number(settled(*x, scale))).collect();
        numbers.join(", ")
    };
    if let Some(curve) = &record.centreline {
        let Centreline {
            points,
            pieces,
            length,
            distance,
            ..
        } = curve;
        line(
            "centreline",
            format!(
                "{points} points, {pieces} pieces; length {} (of the rod {}); farthest point {distance:.1e} off",
                number(*length),
                number(record.length)
            ),
        );
        line(
            "",
            format!("at its begin position {}", list(&curve.position, *length)),
        );
        line(
            "",
            format!(
                "tangent {}, normal {}",
                list(&curve.tangent, 1.0),
                list(&curve.normal, 1.0)
            ),
        );
    }
    line("position", list(end.position.as_slice(), record.length));
    line("quaternion", list(&record.quaternion(), 1.0));
    line("base force", list(force.as_slice(), forces));
    line("base couple", list(couple.as_slice(), couples));
    line("tip force", list(end.force.as_slice(), forces));
    line("tip couple", list(end.couple.as_slice(), couples));
    line("energy", number(found.end.energy));
    for (k, tendon) in record
        .tendons
        .iter()
        .flat_map(|t| t.each.iter().enumerate())
    {
        let slack = if tendon.slack { ", slack" } else { "" };
        let (tension, length) = (number(tendon.tension), number(tendon.length));
        line(
            &format!("tendon {k}"),
            format!("tension {tension}, length {length}{slack}"),
        );
    }
    if let Some(tendons) = &record.tendons {
        let [couple, force] = &tendons.base;
        line("clamp force", list(force.as_slice(), forces));
        line("clamp couple", list(couple.as_slice(), couples));
    }
    for contact in record.contacts.iter().flat_map(|all| &all.each) {
        let touch = &contact.touch;
        let end = if touch.at_end { ", the end" } else { "" };
        line(
            "contact",
            match &touch.line {
                None => format!(
                    "{} at s = {}{end}, reaction {}",
                    contact.obstacle,
                    number(touch.s),
                    number(touch.reaction)
                ),
                Some(lies) => format!(
                    "{} from s = {} to {}, reactions {} and {} at the ends, {} between",
                    contact.obstacle,
                    number(touch.s),
                    number(touch.s + lies.length),
                    number(lies.at_start),
                    number(lies.at_end),
                    number(lies.pressed)
                ),
            },
        );
    }
    if let Some(contacts) = record.contacts.as_ref().filter(|all| all.each.is_empty()) {
        let gap = number(contacts.min_gap);
        line("contact", format!("none; the least gap is {gap}"));
    }
    if record.weight.is_some() {
        line("potential", number(found.potential));
    }
    let meaning = match (record.conservative, found.index) {
        (false, _) => {
            "for the same load kept dead; it does not decide stability, since the load is not conservative"
        }
        (true, 0) => "stable",
        (true, _) if found.route.from_guess => "unstable",
        (true, _) => "unstable; no stable equilibrium was found from any start",
    };
    let lies = |contact: &ContactRecord| contact.touch.line.is_some();
    let index = if record.indexed {
        format!("{} ({meaning})", found.index)
    } else if (record.contacts.iter()).any(|contacts| contacts.each.iter().any(lies)) {
        "none (it is not computed where the rod lies along an obstacle)".to_owned()
    } else {
        NO_INDEX.to_owned()
    };
    line("index", index);
    for mode in &record.zero_modes {
        line("zero mode", format!("{mode}; left out of the index"));
    }
    line("residual", format!("{:.1e}", found.residual));
    if record.contacts.is_some() {
        line(
            "path",
            format!("{}, with a jump of the force at each contact", way(found)),
        );
    } else {
        line("path", path(record));
    }
    line("", format!("because {}", found.taken.why));
    text
}

/// Space or plane in which an equilibrium was computed, in words.
fn way(found: &Equilibrium) -> &'static str {
    match found.taken.path {
        Path::Planar => "in a plane",
        Path::ClosedForm => "in closed form",
        Path::Auto | Path::Spatial => "in space",
    }
}

/// Solution path of an equilibrium, in words.
fn path(record: &EquilibriumRecord) -> String {
    let found = &record.found;
    let route = &found.route;
    let start = if route.from_guess {
        "from the guess of [start]".to_owned()
    } else {
        match (route.imperfect, route.steps) {
            (true, 0) => "at rest after a fall from the unloaded shape".to_owned(),
            (true, steps) => format!("from a bent rod by continuation in {steps} steps"),
            (false, steps) => format!("from the unloaded rod by continuation in {steps} steps"),
        }
    };
    let damped = if route.damping < 1.0 {
        format!(", damped down to {}", route.damping)
    } else {
        String::new()
    };
    format!(
        "{}, {}; {start}; {} Newton steps{damped}",
        way(found),
        if record.uniform {
            "inverse law formed once (uniform, linear)"
        } else {
            "inverse law at every section"
        },
        route.iterations
    )
}
