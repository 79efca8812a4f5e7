//! `snaprod equilibria`: all equilibria of a scene of statics, or of the elastica with the end at a point.

use super::check::{SceneArgs, no_start, read_equilibrium};
use super::files::{json_text, number, pair, print, print_json, short};
use super::output::{Output, OutputArgs};
use super::page::{Page, PageKind, equilibria_data, scene_text};
use super::signals::Signals;
use super::{Ending, Refusal, assembly_equilibrium, rod_figures};
use clap::Args;
use snaprod::plot::{RodPanel, RodPanels, rod_panels};
use snaprod::scene::Scene;
use snaprod::study::all_equilibria::{AllEquilibriaRecord, StateKind, StateRecord};
use snaprod::study::{self, EquilibriaRecord};
use std::fmt::Write;
use std::path::PathBuf;

#[derive(Args)]
pub struct EquilibriaArgs {
    /// The scene, a TOML file: one rod or an assembly in statics.
    #[arg(value_name = "SCENE", required_unless_present = "at")]
    pub scene: Option<PathBuf>,
    /// Replace or add a field of the scene, as in --set end.position.z=0.6; may be repeated.
    #[arg(long, value_name = "PATH=VALUE", conflicts_with = "at")]
    pub set: Vec<String>,
    /// Instead of a scene: the end position x,y of the elastica (length 1, bending stiffness 1).
    #[arg(long, value_name = "X,Y", allow_hyphen_values = true, value_parser = parse_point, conflicts_with_all = ["scene", "out"])]
    pub at: Option<[f64; 2]>,
    /// Of an elastica only equilibria with lambda below this, at most 60; lambda = sqrt(|force| L^2/B).
    #[arg(long, default_value_t = 14.0)]
    pub lambda_max: f64,
    /// Write equilibria.html, a page with a numbered panel for each equilibrium; it is one file and needs no network.
    #[arg(long, requires = "out", conflicts_with = "at")]
    pub html: bool,
    #[command(flatten)]
    pub output: OutputArgs,
}

/// Files of the command.
const FILES: &[&str] = &["equilibria.*", "shapes.*"];
/// Number of equilibria up to which each has a panel.
const MOST_PANELS: usize = 24;

fn parse_point(text: &str) -> Result<[f64; 2], String> {
    let parts: Vec<_> = text.split(',').map(|part| part.trim().parse()).collect();
    match parts.as_slice() {
        [Ok(x), Ok(y)] => Ok([*x, *y]),
        _ => Err("write two numbers with a comma between them, as in 0.5,-0.2".to_owned()),
    }
}

/// Lists all equilibria of a scene, or at a point.
pub fn equilibria(args: &EquilibriaArgs) -> Result<Ending, Refusal> {
    if let Some(path) = &args.scene {
        return of_scene(args, path);
    }
    let record = study::equilibria(args.at.unwrap_or([f64::NAN; 2]), args.lambda_max)?;
    if args.output.json {
        print_json(record.summary())
    } else if args.output.speaks() {
        print(&text(&record))
    }
    Ok(Ending::Done)
}

fn of_scene(args: &EquilibriaArgs, path: &std::path::Path) -> Result<Ending, Refusal> {
    if !(0.0 < args.lambda_max && args.lambda_max <= 60.0) {
        return Err(Refusal(format!(
            "--lambda-max {}: must be in (0, 60]",
            args.lambda_max
        )));
    }
    let given = SceneArgs {
        path: path.to_owned(),
        set: args.set.clone(),
    };
    let scene = read_equilibrium(&given)?;
    let record = study::all_equilibria(&scene, args.lambda_max, &mut Signals::watched());
    let record = record.map_err(|e| no_start(path, &e))?;
    let summary = record.summary();
    if let Some(directory) = &args.output.out {
        let out = Output::open(Some(directory), FILES, args.output.figures)?;
        out.write("equilibria.json", json_text(summary.clone()).as_bytes())?;
        out.table(&record.table()?)?;
        out.table(&record.shapes()?)?;
        let data = panels(&scene, &record);
        out.figure("equilibria", || Ok(data), rod_panels);
        if args.html {
            out.page("equilibria", |_| {
                Ok(Page {
                    name: given.name(),
                    kind: PageKind::Equilibria,
                    data: equilibria_data(&record),
                    words: list(&record),
                    events: Vec::new(),
                    // The page draws the panels itself.
                    figures: Vec::new(),
                    scene: scene_text(&given),
                })
            });
        }
        out.finish(args.output.speaks())?;
    }
    if args.output.json {
        print_json(summary);
    } else if args.output.speaks() {
        print(&list(&record));
    }
    Ok(if record.interrupted {
        Ending::Short
    } else {
        Ending::Done
    })
}

/// A numbered panel for each equilibrium.
fn panels(scene: &Scene, record: &AllEquilibriaRecord) -> RodPanels {
    let shown = record.states.iter().take(MOST_PANELS).enumerate();
    let panel = |(k, state): (usize, &StateRecord)| {
        let unstable = record.conservative && state.index > 0;
        let (rods, bodies) = match &state.kind {
            StateKind::Rod(one) => {
                let rod = rod_figures::drawn(&one.sections, None, unstable);
                (vec![rod_figures::on_ground(rod, scene)], Vec::new())
            }
            StateKind::Assembly(all) => {
                let figure = assembly_equilibrium::figure(scene, all);
                (figure.rods, figure.bodies)
            }
        };
        RodPanel {
            title: format!(
                "{}: energy {}, {}",
                k + 1,
                short(state.energy),
                index_words(record, state)
            ),
            rods,
            bodies,
        }
    };
    RodPanels {
        title: match record.states.len() {
            1 => "The equilibrium that was found".to_owned(),
            n if n > MOST_PANELS => format!("{MOST_PANELS} of {n} equilibria"),
            n => format!("{n} equilibria"),
        },
        panels: shown.map(panel).collect(),
        units: rod_figures::units(record.units),
    }
}

fn index_words(record: &AllEquilibriaRecord, state: &StateRecord) -> String {
    match state.index_in_plane {
        _ if !record.indexed => "no index".to_owned(),
        Some(flat) if flat != state.index => {
            format!("index {}, in plane {flat}", state.index)
        }
        _ => format!("index {}", state.index),
    }
}

fn list(record: &AllEquilibriaRecord) -> String {
    let mut text = match record.states.len() {
        1 => "one equilibrium\n".to_owned(),
        n => format!("{n} equilibria\n"),
    };
    let _ = writeln!(
        text,
        "{:>3} {:>16} {:>6} {:>9}  found by",
        "", "energy", "index", "in plane"
    );
    for (k, state) in record.states.iter().enumerate() {
        let flat = state
            .index_in_plane
            .map_or_else(|| "-".to_owned(), |i| i.to_string());
        let index = if record.indexed {
            state.index.to_string()
        } else {
            "-".to_owned()
        };
        let mut words = state.how.to_owned();
        if record.conservative && state.index == 0 {
            words += "; stable";
        }
        if state.neutral {
            words += "; one of a continuous family: a motion costs nothing";
        }
        let _ = writeln!(
            text,
            "{:>3} {:>16} {index:>6} {flat:>9}  {words}",
            k + 1,
            number(state.energy),
        );
    }
    if !record.indexed {
        text.push_str("the loads on the rods have no potential: there is no index\n");
    } else if !record.conservative {
        text.push_str("the loads have no potential: the index is that of the same loads kept dead and does not decide stability\n");
    }
    let _ = writeln!(text, "sought: {}", record.sought);
    let _ = writeln!(text, "proven: {}", record.proven);
    if record.interrupted {
        text.push_str("interrupted: the search is not complete\n");
    }
    text
}

fn text(record: &EquilibriaRecord) -> String {
    if let Some(note) = record.note {
        return format!("at (1, 0) {note}\n");
    }
    let mut text = format!(
        "{} with the end at ({}) and lambda < {}\n",
        match record.found.len() {
            0 => "no equilibrium".to_owned(),
            1 => "one equilibrium".to_owned(),
            n => format!("{n} equilibria"),
        },
        pair(record.at[0], record.at[1]),
        number(record.lambda_max)
    );
    if record.found.is_empty() {
        text.push_str("near full reach lambda is larger: try --lambda-max 60, or `snaprod elastica` with --lambda and --p\n");
    } else {
        let _ = writeln!(
            text,
            "{:>6} {:>14} {:>14} {:>12} {:>12} {:>14} {:>5}",
            "sheet", "lambda", "p", "alpha", "theta(1)", "energy", "index"
        );
    }
    for f in &record.found {
        let e = &f.equilibrium;
        let _ = writeln!(
            text,
            "{:>6} {:>14.9} {:>14.9} {:>12.8} {:>12.8} {:>14.9} {:>5}{}",
            e.sheet.to_string(),
            e.lambda,
            e.p,
            e.alpha,
            e.theta1,
            e.energy,
            f.index,
            if f.degenerate {
                "  at a fold (double)"
            } else if f.stable() {
                "  stable"
            } else {
                ""
            }
        );
    }
    text
}
