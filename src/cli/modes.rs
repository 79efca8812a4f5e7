//! `snaprod modes SCENE`: natural frequencies and mode shapes.

use super::check::{SceneArgs, no_start, read_modes};
use super::files::{json_text, print, print_json, rounded, short};
use super::first_order::{self, ByArgs};
use super::output::{Output, OutputArgs};
use super::{Ending, Refusal, rod_figures};
use clap::Args;
use snaprod::assembly::Joint;
use snaprod::plot::{ModeShape, ModeShapes, SpaceRod, mode_shapes};
use snaprod::study::modes::Station;
use snaprod::study::{self, ModesRecord};
use std::fmt::Write;

#[derive(Args)]
pub struct ModesArgs {
    #[command(flatten)]
    pub scene: SceneArgs,
    #[command(flatten)]
    pub output: OutputArgs,
    #[command(flatten)]
    pub by: ByArgs,
}

/// Files of the command.
const FILES: &[&str] = &["modes.*", "summary.json"];

/// Describes small motions about the equilibrium of a scene.
pub fn modes(args: &ModesArgs) -> Result<Ending, Refusal> {
    let scene = read_modes(&args.scene)?;
    let refuse = |e: snaprod::Error| no_start(&args.scene.path, &e);
    let record = study::modes(&scene).map_err(refuse)?;
    let mut summary = record.summary();
    let by = args.by.fields(&args.scene)?;
    if !by.is_empty() {
        let found = study::modes::derivatives(&scene, &by).map_err(refuse)?;
        found.put_into(&mut summary);
    }
    if let Some(directory) = &args.output.out {
        let grounds = match scene.assembly() {
            Some(given) => given.grounds(),
            None => vec![[Some(Joint::Weld).filter(|_| !scene.clamp.free), None]],
        };
        let out = Output::open(Some(directory), FILES, args.output.figures)?;
        out.write("summary.json", json_text(summary.clone()).as_bytes())?;
        out.table(&record.table()?)?;
        // Under follower loads the motions have no mode shapes.
        if !record.motions.modes.is_empty() {
            out.figure("modes", || Ok(shapes(&record, &grounds)), mode_shapes);
        }
        out.finish(args.output.speaks())?;
    }
    if args.output.json {
        print_json(summary);
    } else if args.output.speaks() {
        print(&(text(&record) + &first_order::text(&summary)));
    }
    Ok(Ending::Done)
}

fn text(record: &ModesRecord) -> String {
    let motions = &record.motions;
    let mut text = String::new();
    let mut line = |name: &str, value: String| {
        let _ = writeln!(text, "{name:<15}{value}");
    };
    for (k, rod) in motions.rods.iter().enumerate() {
        if let Some(end) = rod.last() {
            let p = end.position;
            let parts = if record.planar { 2 } else { 3 };
            let parts: Vec<String> = p.iter().take(parts).map(|x| rounded(*x, 12)).collect();
            let of = if record.of_start {
                "of [start]"
            } else {
                "under the loads"
            };
            let end = match record.names.get(k) {
                Some(name) => format!("end of rod {name:?}"),
                None => "end".to_owned(),
            };
            line(
                "equilibrium",
                format!("{of}, {end} at {}", parts.join(", ")),
            );
        }
    }
    let meaning = if motions.stable { "stable" } else { "unstable" };
    line("index", format!("{} ({meaning})", motions.index));
    let time = record.units.time();
    let [rate, time] = match time {
        "" => [String::new(), String::new()],
        time => [format!(" rad/{time}"), format!(" {time}")],
    };
    for (i, mode) in motions.modes.iter().enumerate() {
        let moves = motions.coordinates.iter().zip(&mode.shape);
        // The sum avoids a minus before a zero.
        let moves = moves.map(|(name, x)| format!("{name} {:.6}", (x * 1e6).round() / 1e6 + 0.0));
        let moves: Vec<String> = moves.collect();
        let motion = match (mode.period(), mode.angular_frequency) {
            (Some(period), omega) => {
                format!(
                    "omega {}{rate}, period {}{time}",
                    rounded(omega, 9),
                    rounded(period, 9)
                )
            }
            (None, 0.0) => "omega 0: free to move".to_owned(),
            (None, omega) => format!(
                "grows at the rate {}{}",
                rounded(-omega, 9),
                rate.replace("rad", "1")
            ),
        };
        line(
            &format!("mode {}", i + 1),
            format!("{motion}; {}", moves.join(", ")),
        );
    }
    if motions.rigid > 0 {
        let directions = match motions.rigid {
            1 => "1 direction, along the straight inextensible rod: it has no mode".to_owned(),
            n => format!("{n} directions, along straight inextensible rods: they have no modes"),
        };
        line("rigid", directions);
    }
    for s in motions.eigenvalues.iter().flatten() {
        line(
            "eigenvalue",
            match s.im {
                0.0 => format!("{}{}", rounded(s.re, 9), rate.replace("rad", "1")),
                im => format!(
                    "{} +- {} i{}",
                    rounded(s.re, 9),
                    rounded(im, 9),
                    rate.replace("rad", "1")
                ),
            },
        );
    }
    if let Some(mass) = &motions.mass {
        line("rod's mass", mass.text(record.units));
    }
    for remark in &record.remarks {
        line("note", remark.clone());
    }
    text
}

fn shapes(record: &ModesRecord, grounds: &[[Option<Joint>; 2]]) -> ModeShapes {
    let rod = |stations: &Vec<Station>| SpaceRod {
        points: stations.iter().map(|s| s.position.into()).collect(),
        directors: if record.planar {
            Vec::new()
        } else {
            stations
                .iter()
                .map(|s| std::array::from_fn(|k| s.directors.column(k).into_owned().into()))
                .collect()
        },
        ..SpaceRod::default()
    };
    let rate = match record.units.time() {
        "" => String::new(),
        time => format!(" rad/{time}"),
    };
    let modes = record
        .motions
        .modes
        .iter()
        .enumerate()
        .map(|(i, mode)| ModeShape {
            title: match mode.angular_frequency {
                0.0 => format!("mode {}: free to move", i + 1),
                omega if omega < 0.0 => {
                    let rate = rate.replace("rad", "1");
                    format!("mode {}: grows, {}{rate}", i + 1, short(-omega))
                }
                omega => format!("mode {}: ω = {}{rate}", i + 1, short(omega)),
            },
            rods: mode.rods.iter().map(rod).collect(),
        });
    ModeShapes {
        rods: (record.motions.rods.iter().zip(grounds))
            .map(|(stations, ground)| SpaceRod {
                ground: rod_figures::ground(ground),
                ..rod(stations)
            })
            .collect(),
        modes: modes.collect(),
        planar: record.planar,
        units: rod_figures::units(record.units),
    }
}
