//! `snaprod equilibrium SCENE`.

use super::check::{SceneArgs, no_start, read_statics};
use super::files::{exact, json_text, number, print, print_json};
use super::output::{FigureArgs, Output};
use super::{Ending, Refusal};
use clap::Args;
use nalgebra::{Rotation3, UnitQuaternion, Vector3, Vector6};
use serde_json::{Value, json};
use snaprod::plot::{RodState, RodUnits, SpaceRod, rod_state};
use snaprod::rod::{Equilibrium, Path, Problem, RodSection};
use snaprod::scene::{Scene, Units};
use std::fmt::Write;
use std::path::PathBuf;

#[derive(Args)]
pub struct EquilibriumArgs {
    #[command(flatten)]
    pub scene: SceneArgs,
    /// Where to write shape.csv, equilibrium.json and equilibrium.svg; nothing is written without it.
    #[arg(long)]
    pub out: Option<PathBuf>,
    #[command(flatten)]
    pub figures: FigureArgs,
    /// Print one JSON object.
    #[arg(long)]
    pub json: bool,
}

/// What the command writes.
const FILES: &[&str] = &["equilibrium.*", "shape.csv"];
/// Sections in shape.csv.
const SECTIONS: usize = 201;

/// Solves the scene and describes its equilibrium.
pub fn equilibrium(args: &EquilibriumArgs) -> Result<Ending, Refusal> {
    let scene = read_statics(&args.scene)?;
    let refuse = |e| no_start(&args.scene.path, &e);
    let problem = scene.problem().map_err(refuse)?;
    let found = problem.solve(scene.guess().as_ref()).map_err(refuse)?;
    let object = describe(&problem, &found);
    if let Some(directory) = &args.out {
        let sections = problem.shape(&found.base, SECTIONS).map_err(refuse)?;
        let out = Output::open(Some(directory), FILES, args.figures)?;
        out.write("equilibrium.json", json_text(object.clone()).as_bytes())?;
        out.write("shape.csv", table(&sections).as_bytes())?;
        let state = || Ok(figure(&scene, &found, &sections));
        out.figure("equilibrium", state, rod_state);
        out.finish()?;
    }
    if args.json {
        print_json(object);
    } else {
        print(&text(&problem, &found));
    }
    Ok(Ending::Done)
}

/// [w, x, y, z] of the directors, w >= 0.
pub fn quaternion(section: &RodSection) -> [f64; 4] {
    let q =
        UnitQuaternion::from_rotation_matrix(&Rotation3::from_matrix_unchecked(section.directors));
    let sign = if q.w < 0.0 { -1.0 } else { 1.0 };
    [q.w, q.i, q.j, q.k].map(|x| sign * x)
}

pub fn halves(wrench: &Vector6<f64>) -> (Vector3<f64>, Vector3<f64>) {
    (
        wrench.fixed_rows::<3>(0).into_owned(),
        wrench.fixed_rows::<3>(3).into_owned(),
    )
}

pub fn list(x: &Vector3<f64>) -> [f64; 3] {
    (*x).into()
}

fn describe(problem: &Problem, found: &Equilibrium) -> Value {
    let (couple, force) = halves(&found.base);
    let route = &found.route;
    json!({
        "position": list(&found.end.position),
        "quaternion": quaternion(&found.end),
        "base_force": list(&force),
        "base_couple": list(&couple),
        "tip_force": list(&found.end.force),
        "tip_couple": list(&found.end.couple),
        "energy": found.end.energy,
        "index": found.index,
        "stable": problem.is_conservative().then_some(found.index == 0),
        "conservative": problem.is_conservative(),
        "residual": found.residual,
        "path": {
            "kind": found.taken.path.as_str(),
            "why": found.taken.why,
            "uniform": problem.rod().hoists_inverse(),
            "from_guess": route.from_guess,
            "continuation_steps": route.steps,
            "bent_start": route.imperfect,
            "newton_steps": route.iterations,
            "evaluations": route.evaluations,
            "smallest_damping": route.damping,
        },
    })
}

fn text(problem: &Problem, found: &Equilibrium) -> String {
    let mut text = String::new();
    let mut line = |name: &str, value: String| {
        let _ = writeln!(text, "{name:<15}{value}");
    };
    let three = |x: &Vector3<f64>| format!("{}, {}, {}", number(x.x), number(x.y), number(x.z));
    let (couple, force) = halves(&found.base);
    line("position", three(&found.end.position));
    line("quaternion", quaternion(&found.end).map(number).join(", "));
    line("base force", three(&force));
    line("base couple", three(&couple));
    line("tip force", three(&found.end.force));
    line("tip couple", three(&found.end.couple));
    line("energy", number(found.end.energy));
    let meaning = match (problem.is_conservative(), found.index) {
        (false, _) => {
            "of the same load kept dead; the load is not conservative: this does not decide stability"
        }
        (true, 0) => "stable",
        (true, _) if found.route.from_guess => "unstable",
        (true, _) => "unstable; no stable equilibrium was found from any start",
    };
    line("index", format!("{} ({meaning})", found.index));
    line("residual", format!("{:.1e}", found.residual));
    let route = &found.route;
    let start = if route.from_guess {
        "from the guess of [start]".to_owned()
    } else {
        let start = if route.imperfect {
            "a bent"
        } else {
            "the unloaded"
        };
        format!("from {start} rod by continuation in {} steps", route.steps)
    };
    let damped = if route.damping < 1.0 {
        format!(", damped down to {}", route.damping)
    } else {
        String::new()
    };
    line(
        "path",
        format!(
            "{}, {}; {start}; {} Newton steps{damped}",
            match found.taken.path {
                Path::Planar => "in a plane",
                Path::ClosedForm => "in closed form",
                Path::Auto | Path::Spatial => "in space",
            },
            if problem.rod().hoists_inverse() {
                "inverse law formed once (uniform, linear)"
            } else {
                "inverse law at every section"
            },
            route.iterations
        ),
    );
    line("", format!("because {}", found.taken.why));
    text
}

fn table(sections: &[RodSection]) -> String {
    let mut text = String::from(
        "s,x,y,z,d1x,d1y,d1z,d2x,d2y,d2z,d3x,d3y,d3z,u1,u2,u3,v1,v2,v3,m1,m2,m3,n1,n2,n3,energy\n",
    );
    for section in sections {
        let (m, n) = (
            section.directors.transpose() * section.couple,
            section.directors.transpose() * section.force,
        );
        let row: Vec<String> = std::iter::once(section.s)
            .chain(section.position.iter().copied())
            .chain(section.directors.iter().copied())
            .chain(section.strain.iter().copied())
            .chain(m.iter().copied())
            .chain(n.iter().copied())
            .chain([section.energy])
            .map(exact)
            .collect();
        text.push_str(&row.join(","));
        text.push('\n');
    }
    text
}

/// The rod as the figures want it.
pub fn drawn(sections: &[RodSection], value: Option<f64>, unstable: bool) -> SpaceRod {
    SpaceRod {
        name: String::new(),
        points: sections.iter().map(|s| s.position.into()).collect(),
        directors: sections
            .iter()
            .map(|s| std::array::from_fn(|j| s.directors.column(j).into_owned().into()))
            .collect(),
        value,
        unstable,
        colour: None,
    }
}

/// The units of figures.
pub fn units(scene: &Scene) -> RodUnits {
    match scene.units {
        Units::Si => RodUnits::si(),
        // Any consistent system: no symbol is right but those of the scene's own numbers.
        Units::Dimensionless => RodUnits {
            length: String::new(),
            force: String::new(),
            couple: String::new(),
        },
    }
}

fn figure(scene: &Scene, found: &Equilibrium, sections: &[RodSection]) -> RodState {
    let along = |pick: fn(&RodSection) -> Vector3<f64>| -> Vec<[f64; 3]> {
        sections.iter().map(|s| list(&pick(s))).collect()
    };
    RodState {
        rod: drawn(sections, None, found.index > 0),
        ribbon: 0.03 * scene.rod.length,
        end_force: Some(list(&found.end.force)),
        end_couple: Some(list(&found.end.couple)),
        s: sections.iter().map(|s| s.s).collect(),
        couples: along(|s| s.directors.transpose() * s.couple),
        forces: along(|s| s.directors.transpose() * s.force),
        curvatures: along(|s| s.strain.fixed_rows::<3>(0).into_owned()),
        stretches: along(|s| s.strain.fixed_rows::<3>(3).into_owned()),
        units: units(scene),
        ..RodState::default()
    }
}
