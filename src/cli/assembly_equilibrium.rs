//! `snaprod equilibrium` for assemblies of several rods and bodies.

use super::check::no_start;
use super::equilibrium::{EquilibriumArgs, FILES, NO_INDEX};
use super::files::{json_text, number, print, print_json};
use super::output::Output;
use super::{Ending, Refusal, first_order, rod_figures};
use snaprod::math::se3::halves;
use snaprod::plot::{RodShapes, SpaceRod, rod_shapes};
use snaprod::scene::{AssemblyScene, Scene};
use snaprod::study::assembly::{self, AssemblyEquilibriumRecord};
use std::fmt::Write;

/// Colour of bodies in equilibrium, the grey of the palette: the other colours distinguish the rods.
const BODY: usize = 6;

/// Solves the scene and describes its equilibrium.
pub fn equilibrium(args: &EquilibriumArgs, scene: &Scene) -> Result<Ending, Refusal> {
    let record = assembly::equilibrium(scene).map_err(|e| no_start(&args.scene.path, &e))?;
    let asked = args.first_order.asked(&args.scene)?;
    let mut summary = record.summary();
    asked
        .of_assembly(scene, &record, &mut summary)
        .map_err(|e| no_start(&args.scene.path, &e))?;
    if let Some(directory) = &args.output.out {
        let out = Output::open(Some(directory), FILES, args.output.figures)?;
        out.write("equilibrium.json", json_text(summary.clone()).as_bytes())?;
        out.table(&record.shape()?)?;
        let data = figure(scene, &record);
        out.figure("equilibrium", || Ok(data), rod_shapes);
        out.finish(args.output.speaks())?;
    }
    if args.output.json {
        print_json(summary);
    } else if args.output.speaks() {
        print(&(equilibrium_text(&record) + &first_order::text(&summary)));
    }
    Ok(Ending::Done)
}

/// Rods and bodies of an equilibrium.
pub fn figure(scene: &Scene, record: &AssemblyEquilibriumRecord) -> RodShapes {
    let unstable = record.conservative && record.index > 0;
    let grounds = scene.assembly().into_iter();
    let grounds = grounds.flat_map(AssemblyScene::grounds);
    let named = record.rods.iter().zip(&record.shapes).zip(grounds);
    let rods = named.map(|(((name, _), rod), ground)| SpaceRod {
        name: name.clone(),
        unstable,
        ..rod_figures::posed(rod.iter().map(|(_, pose)| pose), &ground)
    });
    let held = record.solids.iter().zip(&record.bodies);
    let bodies = held.clone();
    let bodies = bodies.map(|(solid, (_, pose))| rod_figures::body(solid, pose, None, Some(BODY)));
    let length = scene.rod.length;
    let grooves = held.map(|(solid, (_, pose))| solid.groove_around([pose].into_iter(), length));
    RodShapes {
        rods: rods.collect(),
        bodies: bodies.collect(),
        grooves: grooves.collect(),
        triads: false,
        // Each rod draws its own attachments to the ground.
        clamp: false,
        units: rod_figures::units(record.units),
        ..RodShapes::default()
    }
}

fn equilibrium_text(record: &AssemblyEquilibriumRecord) -> String {
    let mut text = String::new();
    let mut line = |name: &str, value: String| {
        let _ = writeln!(text, "{name:<15}{value}");
    };
    let list = |x: &[f64]| {
        let numbers: Vec<String> = x.iter().map(|x| number(*x)).collect();
        numbers.join(", ")
    };
    for (name, pose) in &record.bodies {
        let q = pose.rotation;
        line("body", name.clone());
        line("  position", list(pose.translation.vector.as_slice()));
        line("  quaternion", list(&[q.w, q.i, q.j, q.k]));
    }
    for ((name, wrench), shape) in record.rods.iter().zip(&record.shapes) {
        let (couple, force) = halves(wrench);
        line("rod", name.clone());
        line("  base force", list(force.as_slice()));
        line("  base couple", list(couple.as_slice()));
        if let Some((_, end)) = shape.last().filter(|_| record.free.contains(name)) {
            line("  free end", list(end.translation.vector.as_slice()));
        }
    }
    for (rod, tendons) in &record.tendons {
        for (k, tendon) in tendons.each.iter().enumerate() {
            let (tension, length) = (number(tendon.tension), number(tendon.length));
            line(
                &format!("tendon {k}"),
                format!("of {rod}: tension {tension}, length {length}"),
            );
        }
    }
    line("energy", number(record.energy));
    line("  elastic", number(record.elastic));
    let meaning = match (record.conservative, record.index, record.from_guess) {
        (false, ..) => {
            "of the symmetric part of the stiffness; it does not decide stability, since the loads are not conservative: run `snaprod modes`"
        }
        (true, 0, _) => "stable",
        (true, _, Some(true)) => "unstable; another guess, or none, may lead to a stable one",
        (true, ..) => "unstable; no stable equilibrium was found from any start",
    };
    let index = if record.indexed {
        format!("{} ({meaning})", record.index)
    } else {
        NO_INDEX.to_owned()
    };
    line("index", index);
    for mode in &record.zero_modes {
        line("zero mode", format!("{mode}; left out of the index"));
    }
    line("residual", format!("{:.1e}", record.residual));
    let path = match record.from_guess {
        Some(true) => "from the guess",
        Some(false) => "from the unloaded rods; the guess led to no equilibrium",
        None if record.fallen => "at rest after a fall from the unloaded rods",
        None => "from the unloaded rods",
    };
    line("path", path.to_owned());
    if let Some(rod) = &record.overdrawn {
        line(
            "guess",
            format!(
                "out of reach: rod {rod:?} is shorter than the distance between its ends in the guess"
            ),
        );
    }
    text
}
