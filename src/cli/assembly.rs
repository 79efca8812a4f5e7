//! `snaprod run` and `snaprod equilibrium` for assemblies of several rods and bodies.

use super::check::no_start;
use super::equilibrium::EquilibriumArgs;
use super::files::{json_text, number, print, print_error, print_json, rounded, settled};
use super::output::Output;
use super::run::{RunArgs, write_shapes};
use super::run_text::{chosen, heavy_folds, mass, omitted_mass_note};
use super::{Ending, Refusal, equilibrium, rod_figures, run_page};
use nalgebra::Isometry3;
use snaprod::assembly::Joint;
use snaprod::math::se3::halves;
use snaprod::motion::{Ledger, Outcome};
use snaprod::plot::{
    self, AxisUnits, Energies, RodShapes, SpaceRod, SpaceWay, rod_shapes, space_way,
};
use snaprod::scene::{AssemblyScene, RodMassNote, Scene, Units};
use snaprod::study::Solid;
use snaprod::study::assembly::{
    self, AssemblyEquilibriumRecord, AssemblyMoment, AssemblyPrepared, AssemblyRunBranch,
    AssemblyRunRecord,
};
use std::fmt::Write;
use std::path::Path;

/// Colour of bodies in equilibrium, the grey of the palette: the other colours distinguish the rods.
const BODY: usize = 6;
/// Number of snaps printed one by one.
const SHOWN: usize = 20;

/// Writes the shapes and draws the figures and the page of a run.
pub fn draw(
    args: &RunArgs,
    out: &Output,
    scene: &Scene,
    (prepared, record): (&AssemblyPrepared, &AssemblyRunRecord),
) {
    write_shapes(args, out, scene, record.branches[0].last.t, || {
        Ok((prepared, prepared.names(), prepared.motion()?.0))
    });
    let grounds = prepared.grounds();
    out.figure("shapes", || Ok(moments(record, &grounds)), rod_shapes);
    if record.last().last.t > record.branches[0].first.t {
        out.figure("energies", || Ok(ledger(record)), plot::energies);
        for (i, name) in record.bodies.iter().enumerate() {
            out.figure(&format!("path_{name}"), || Ok(way(record, i)), space_way);
        }
    } else if out.draws() {
        print_error(
            "note: no energies.svg and no path_*.svg: the run ended at its start, and there is no motion to draw",
        );
    }
    if args.html {
        out.page("run", |figures| {
            run_page::several(args, prepared, record, figures)
        });
    }
}

/// Energy ledger of the last branch over time.
fn ledger(record: &AssemblyRunRecord) -> Energies {
    let states: Vec<(f64, &Ledger)> = record
        .last()
        .track
        .iter()
        .map(|at| (at.t, &at.ledger))
        .collect();
    let driven = states.iter().any(|(_, ledger)| ledger.work != 0.0);
    rod_figures::energies(
        &states,
        driven,
        snap_times(record),
        rod_figures::scaled(record.units, &record.scales),
    )
}

/// Path of a body's centre on the last branch.
fn way(record: &AssemblyRunRecord, body: usize) -> SpaceWay {
    let (last, solid) = (record.last(), &record.solids[body]);
    let centre = |at: &AssemblyMoment| solid.centre(&at.bodies[body].pose).into();
    SpaceWay {
        title: record.bodies[body].clone(),
        time: last.track.iter().map(|at| at.t).collect(),
        points: last.track.iter().map(centre).collect(),
        groove: solid.groove_along(last.track.iter().map(|at| &at.bodies[body].pose)),
        snaps: snap_times(record),
        units: rod_figures::scaled(record.units, &record.scales),
        ..SpaceWay::default()
    }
}

fn snap_times(record: &AssemblyRunRecord) -> Vec<f64> {
    let snaps = record.last().all_snaps();
    snaps.map(|snap| snap.t * record.scales.time).collect()
}

/// Rods and bodies at the first and the last moment, with the paths of the bodies' centres.
fn moments(record: &AssemblyRunRecord, grounds: &[[Option<Joint>; 2]]) -> RodShapes {
    let (trunk, last) = (&record.branches[0], record.last());
    let both = [("start", &trunk.first_shapes), ("end", &last.last_shapes)];
    let rods = both
        .iter()
        .enumerate()
        .flat_map(|(colour, (name, shapes))| {
            let rods = shapes.iter().zip(grounds).enumerate();
            rods.map(move |(k, (rod, ground))| SpaceRod {
                // One entry per moment in the legend.
                name: if k == 0 { *name } else { "" }.to_owned(),
                colour: Some(colour),
                ..drawn(rod, ground)
            })
        });
    let moments = [&trunk.first, &last.last].into_iter().enumerate();
    let bodies = moments.flat_map(|(colour, moment)| {
        let bodies = record.solids.iter().zip(&moment.bodies);
        bodies.map(move |(solid, body)| rod_figures::body(solid, &body.pose, None, Some(colour)))
    });
    let way = |(i, solid): (usize, &Solid)| {
        let track = last.track.iter();
        track
            .map(|at| solid.centre(&at.bodies[i].pose).into())
            .collect()
    };
    let groove = |(i, solid): (usize, &Solid)| {
        let poses = last.track.iter().map(|at| &at.bodies[i].pose);
        solid.groove_around(poses, record.scales.length)
    };
    RodShapes {
        bodies: bodies.collect(),
        paths: record.solids.iter().enumerate().map(way).collect(),
        grooves: record.solids.iter().enumerate().map(groove).collect(),
        triads: false,
        ..figure(
            rods.collect(),
            rod_figures::scaled(record.units, &record.scales),
        )
    }
}

fn drawn(rod: &[Isometry3<f64>], ground: &[Option<Joint>; 2]) -> SpaceRod {
    let directors = |pose: &Isometry3<f64>| {
        let turn = pose.rotation.to_rotation_matrix();
        std::array::from_fn(|j| turn.matrix().column(j).into_owned().into())
    };
    SpaceRod {
        points: rod
            .iter()
            .map(|pose| pose.translation.vector.into())
            .collect(),
        directors: rod.iter().map(directors).collect(),
        ground: rod_figures::ground(ground),
        ..SpaceRod::default()
    }
}

fn figure(rods: Vec<SpaceRod>, units: AxisUnits) -> RodShapes {
    RodShapes {
        rods,
        // Each rod draws its own attachments to the ground.
        clamp: false,
        units,
        ..RodShapes::default()
    }
}

pub fn run_text(record: &AssemblyRunRecord, out: Option<&Path>) -> String {
    let mut text = String::new();
    // Writing to a string cannot fail.
    let mut line = |line: String| {
        let _ = writeln!(text, "{line}");
    };
    if let Some(why) = record.warning() {
        line(format!("note: {why}"));
    }
    // If a verdict on the masses follows below, only defaults of the program are printed here.
    let said = record.masses.iter();
    let said = said.filter(|mass| mass.by_default || record.validity.is_none());
    for said in said.filter_map(RodMassNote::text) {
        line(said);
    }
    for branch in &record.branches {
        if record.branches.len() > 1 {
            line(match branch.stem.parent {
                None => "branch 0".to_owned(),
                Some(parent) => format!("branch {} (from branch {parent})", branch.stem.id),
            });
        }
        branch_text(record, branch, &mut line);
    }
    if let Some(bounces) = record.bounces() {
        line(bounces);
    }
    if let Some(time) = record.unfelt() {
        line(omitted_mass_note(time, record.units));
    }
    if let Some(why) = record.untold() {
        line(format!("note: {why}"));
    }
    if let Some(validity) = &record.validity {
        line(mass(validity));
    }
    if let Some(out) = out {
        line(format!("written to {}", out.display()));
    }
    text
}

fn branch_text(
    record: &AssemblyRunRecord,
    branch: &AssemblyRunBranch,
    line: &mut impl FnMut(String),
) {
    let (k, u) = (&record.scales, record.units);
    for snap in branch.all_snaps().take(SHOWN) {
        line(format!(
            "snap of {} at t = {}{}: released {}{}{}",
            record.rods.get(snap.rod).map_or("?", String::as_str),
            rounded(snap.t * k.time, 12),
            Units::suffix(u.time()),
            rounded(snap.released * k.energy, 9),
            Units::suffix(u.energy()),
            chosen(snap),
        ));
    }
    let count = branch.all_snaps().count();
    if count > SHOWN {
        line(format!("... and {} more snaps", count - SHOWN));
    }
    for fold in heavy_folds(&record.folds, branch.stem.id, u) {
        line(fold);
    }
    let last = &branch.last;
    line(if branch.outcome.is_complete() {
        format!(
            "t = {}{}: {}",
            number(match branch.outcome {
                Outcome::EndOfTime => record.duration,
                _ => last.t,
            }),
            Units::suffix(u.time()),
            branch.outcome
        )
    } else {
        format!(
            "t = {}{}: ended short ({})",
            number(last.t),
            Units::suffix(u.time()),
            branch.outcome.key()
        )
    });
    let vector = |v: &nalgebra::Vector3<f64>, scale: f64, symbol: &str| {
        let scale = v.amax().max(scale);
        let parts = v.iter().map(|x| rounded(settled(*x, scale), 9));
        let parts: Vec<String> = parts.collect();
        format!("({}){}", parts.join(", "), Units::suffix(symbol))
    };
    for (name, body) in record.bodies.iter().zip(&last.bodies) {
        line(format!(
            "{name}: r = {}, v = {}",
            vector(&body.pose.translation.vector, k.length, u.length()),
            vector(&body.velocity, k.velocity, u.velocity()),
        ));
    }
    line(format!(
        "energy balance error {:.1e}{} (relative {:.1e}); {} steps, {} right-hand sides",
        branch.closing.error,
        Units::suffix(u.energy()),
        branch.closing.relative(),
        branch.cost.steps,
        branch.cost.evaluations,
    ));
}

/// Solves the scene and describes its equilibrium.
pub fn equilibrium(args: &EquilibriumArgs, scene: &Scene) -> Result<Ending, Refusal> {
    let record = assembly::equilibrium(scene).map_err(|e| no_start(&args.scene.path, &e))?;
    let summary = record.summary();
    if let Some(directory) = &args.out {
        let out = Output::open(Some(directory), equilibrium::FILES, args.figures)?;
        out.write("equilibrium.json", json_text(summary.clone()).as_bytes())?;
        out.table(&record.shape()?)?;
        let unstable = record.conservative && record.index > 0;
        let names = record.rods.iter().map(|(name, _)| name.clone());
        let poses = record
            .shapes
            .iter()
            .map(|rod| rod.iter().map(|(_, pose)| *pose).collect());
        let shapes: Vec<Vec<Isometry3<f64>>> = poses.collect();
        let grounds = scene
            .assembly()
            .into_iter()
            .flat_map(AssemblyScene::grounds);
        let held = record.solids.iter().zip(&record.bodies);
        let bodies = held
            .clone()
            .map(|(solid, (_, pose))| rod_figures::body(solid, pose, None, Some(BODY)));
        let length = scene.rod.length;
        let grooves =
            held.map(|(solid, (_, pose))| solid.groove_around([pose].into_iter(), length));
        let rods = names
            .zip(shapes.iter().zip(grounds))
            .map(|(name, (rod, ground))| SpaceRod {
                name,
                unstable,
                ..drawn(rod, &ground)
            });
        let data = RodShapes {
            bodies: bodies.collect(),
            grooves: grooves.collect(),
            triads: false,
            ..figure(rods.collect(), rod_figures::units(record.units))
        };
        out.figure("equilibrium", || Ok(data), rod_shapes);
        out.finish(!args.json)?;
    }
    if args.json {
        print_json(summary);
    } else {
        print(&equilibrium_text(&record));
    }
    Ok(Ending::Done)
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
    line("energy", number(record.energy));
    let meaning = match (record.conservative, record.index, record.from_guess) {
        (false, ..) => {
            "of the symmetric part of the stiffness; it does not decide stability, since the loads are not conservative: run `snaprod modes`"
        }
        (true, 0, _) => "stable",
        (true, _, Some(true)) => "unstable; another guess, or none, may lead to a stable one",
        (true, ..) => "unstable; no stable equilibrium was found from any start",
    };
    line("index", format!("{} ({meaning})", record.index));
    line("residual", format!("{:.1e}", record.residual));
    let path = match record.from_guess {
        Some(true) => "from the guess",
        Some(false) => "from the unloaded rods; the guess led to no equilibrium",
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
