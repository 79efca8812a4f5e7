//! `snaprod branch SCENE`.

mod figures;
mod files;
mod folds;
mod follow;
mod search;

use super::check::{SceneArgs, no_start, read_statics};
use super::files::{json_text, print, print_json};
use super::output::{FigureArgs, Output};
use super::{Ending, Refusal};
use clap::Args;
use folds::fold_curves;
use follow::Study;
use nalgebra::SVector;
use serde_json::{Value, json};
use snaprod::plot::{branch_diagram, rod_shapes};
use snaprod::rod::{
    Chart, Charted, Equilibrium, Path, Problem, RodFamily, Spatial, Statical, Taken,
};
use snaprod::scene::{Continue, Parameter, Scene};
use std::fmt::Write;
use std::path::PathBuf;

#[derive(Args)]
pub struct BranchArgs {
    #[command(flatten)]
    pub scene: SceneArgs,
    /// Where to write branch.csv, special_points.json and figures; default out/<name of the scene>.
    #[arg(long)]
    pub out: Option<PathBuf>,
    /// Print the special points as one JSON object.
    #[arg(long)]
    pub json: bool,
    #[command(flatten)]
    pub figures: FigureArgs,
}

/// What the command writes.
const FILES: &[&str] = &[
    "branch.*",
    "special_points.json",
    "shapes.*",
    "fold_curve.*",
];

/// Follows the branch of the scene, and what was asked beside it, and writes them.
pub fn branch(args: &BranchArgs) -> Result<Ending, Refusal> {
    let scene = read_statics(&args.scene)?;
    let refuse = |e| no_start(&args.scene.path, &e);
    let Some(wanted) = scene.continuation.clone() else {
        return Err(Refusal(format!(
            "{}: no [continue]: add one that names the parameter, as in\n  [continue]\n  parameter = \"end.load\"\n  from = 0.0\n  to = 1.0",
            args.scene.path.display()
        )));
    };
    let at = |p: f64| scene.with(&wanted.parameter, p).problem();
    let first = at(wanted.from).map_err(refuse)?;
    let start = first.solve(scene.guess().as_ref()).map_err(refuse)?;
    let (charted, taken) = charted(args, &scene, &wanted, &start)?;
    match charted {
        Charted::Spatial(chart) => along::<_, 6, 7>(args, &scene, &wanted, &start, chart, &taken),
        Charted::FreeEnd(chart) => along::<_, 3, 4>(args, &scene, &wanted, &start, chart, &taken),
        Charted::Planar(chart) => along::<_, 3, 4>(args, &scene, &wanted, &start, chart, &taken),
        Charted::ClosedForm(chart) => {
            along::<_, 2, 3>(args, &scene, &wanted, &start, chart, &taken)
        }
    }
}

/// The chart that holds all along the branch: the one of its start, if the equilibrium found lies in it, if it is that of other
/// problems in the range too, and if nothing is asked for that may lead out of it.
fn charted(
    args: &BranchArgs,
    scene: &Scene,
    wanted: &Continue,
    start: &Equilibrium,
) -> Result<(Charted, Taken), Refusal> {
    let at = |parameter: &Parameter, p: f64| scene.with(parameter, p).problem();
    let range = |parameter: Parameter, from: f64, to: f64| {
        [from, 0.37 * from + 0.63 * to, to].map(|p| (parameter, p))
    };
    let mut others = range(wanted.parameter, wanted.from, wanted.to).to_vec();
    if let Some(second) = &wanted.second {
        others.extend(range(second.parameter, second.from, second.to));
    }
    let holds = |chart: &Charted, of: &dyn Fn(&Problem) -> Option<Charted>| {
        others.iter().all(|(parameter, p)| {
            let there = at(parameter, *p).ok().and_then(|problem| of(&problem));
            there.is_none_or(|there| there.is_alike(chart))
        })
    };
    let refuse = |e| no_start(&args.scene.path, &e);
    let first = at(&wanted.parameter, wanted.from).map_err(refuse)?;
    let (charted, taken) = first.charted().map_err(refuse)?;
    let of_plane = |problem: &Problem| problem.charted().ok().map(|(chart, _)| chart);
    let leaves = wanted.switch || wanted.deflate;
    let why = if taken.path == Path::Spatial {
        taken.why
    } else if scene.solve.path == Path::Auto && start.taken.path != taken.path {
        start.taken.why.clone()
    } else if holds(&charted, &of_plane) && !(scene.solve.path == Path::Auto && leaves) {
        return Ok((charted, taken));
    } else if scene.solve.path == Path::Auto && leaves {
        "other branches may leave the plane of the data".to_owned()
    } else if scene.solve.path == Path::Auto {
        "the data are planar at the start of the branch, but not all along it".to_owned()
    } else {
        return Err(Refusal(format!(
            "{}: solve.path = \"{}\" holds at the start of the branch, but not all along it; use \"auto\"",
            args.scene.path.display(),
            taken.path.as_str()
        )));
    };
    let reduced = first.charted_in_space();
    let chart = if holds(&reduced, &|problem| Some(problem.charted_in_space())) {
        reduced
    } else {
        Charted::Spatial(Spatial)
    };
    let path = Path::Spatial;
    Ok((chart, Taken { path, why }))
}

/// Follows everything in one chart, N unknowns; M = N + 1.
fn along<C: Chart<N> + Copy, const N: usize, const M: usize>(
    args: &BranchArgs,
    scene: &Scene,
    wanted: &Continue,
    start: &Equilibrium,
    chart: C,
    taken: &Taken,
) -> Result<Ending, Refusal> {
    let make = |scene: &Scene, parameter: Parameter, span: f64| {
        let scene = scene.clone();
        let problem = move |p: f64| scene.with(&parameter, p).problem();
        RodFamily::in_chart(problem, parameter.changes_rod(), span, chart)
    };
    let family = make(scene, wanted.parameter, wanted.to - wanted.from);
    let x = family
        .unknowns(&start.base, wanted.from)
        .map_err(|e| no_start(&args.scene.path, &e))?;
    study::<_, N, M>(args, scene, wanted, x, make, taken)
}

/// Everything about the branch through `x`, with N unknowns; M = N + 1.
fn study<F: Statical<N>, const N: usize, const M: usize>(
    args: &BranchArgs,
    scene: &Scene,
    wanted: &Continue,
    x: SVector<f64, N>,
    make: impl Fn(&Scene, Parameter, f64) -> F,
    taken: &Taken,
) -> Result<Ending, Refusal> {
    let family = make(scene, wanted.parameter, wanted.to - wanted.from);
    let stations = match wanted.deflate {
        true => search::values(wanted),
        false => Vec::new(),
    };
    let mut study = Study::new(scene, wanted, &family, stations);
    study
        .through("the scene".to_owned(), x, wanted.from, wanted.both)
        .map_err(|e| no_start(&args.scene.path, &e))?;
    if wanted.switch {
        study.switch();
    }
    let searched = wanted.deflate.then(|| search::search(&mut study));
    let folds = wanted
        .second
        .as_ref()
        .map(|second| (second, fold_curves::<F, N, M>(&mut study, second, &make)));

    let Study {
        rows,
        located,
        curves,
        remarks,
        ..
    } = &study;
    let mut summary = json!({
        "parameter": wanted.parameter.to_string(),
        "path": { "kind": taken.path.as_str(), "why": taken.why },
        "points": rows.len(),
        "branches": files::curves(curves, rows),
        "special_points": located.iter().map(|at| at.json()).collect::<Vec<_>>(),
        "complete": curves.iter().all(|curve| curve.complete),
        "stop": curves.iter().flat_map(|curve| &curve.ends).collect::<Vec<_>>(),
        "remarks": remarks,
    });
    if let Some(searched) = searched {
        summary["deflation"] = searched;
    }
    if let Some((second, folds)) = &folds {
        let points: Vec<Value> = folds.located.iter().map(|at| at.fold_json()).collect();
        summary["fold_curves"] = json!({
            "second": second.parameter.to_string(),
            "points": folds.rows.len(),
            "curves": files::curves(&folds.curves, &folds.rows),
            "special_points": points,
        });
    }
    let directory = args.out.clone().unwrap_or_else(|| args.scene.directory());
    let out = Output::open(Some(&directory), FILES, args.figures)?;
    out.write("branch.csv", files::table(rows).as_bytes())?;
    out.write("special_points.json", json_text(summary.clone()).as_bytes())?;
    let diagram = || Ok(figures::diagram(scene, wanted, rows, located));
    out.figure("branch", diagram, branch_diagram);
    let shapes = || figures::shapes(scene, wanted, rows);
    out.figure("shapes", shapes, rod_shapes);
    if let Some((second, folds)) = &folds
        && !folds.rows.is_empty()
    {
        out.write("fold_curve.csv", files::table(&folds.rows).as_bytes())?;
        let curves = figures::fold_curves(scene, wanted, second, &folds.rows, &folds.located);
        out.figure("fold_curve", || Ok(curves), branch_diagram);
    }
    out.finish()?;

    let fold_curves = folds.iter().flat_map(|(_, folds)| &folds.curves);
    let complete = curves.iter().chain(fold_curves).all(|curve| curve.complete);
    if args.json {
        print_json(summary);
    } else {
        let mut text = match curves.len() {
            1 => format!(
                "{} points of the branch in {}\n",
                rows.len(),
                wanted.parameter
            ),
            n => format!(
                "{} points of {n} branches in {}\n",
                rows.len(),
                wanted.parameter
            ),
        };
        located.iter().for_each(|at| at.line(&mut text));
        curve_ends(&mut text, curves);
        if let Some((second, folds)) = &folds {
            let (first, second) = (wanted.parameter, second.parameter);
            let points = folds.rows.len();
            let _ = writeln!(text, "{points} points of fold curves in {first}, {second}");
            folds.located.iter().for_each(|at| at.line(&mut text));
            curve_ends(&mut text, &folds.curves);
        }
        let _ = writeln!(text, "path: {}, because {}", taken.path.as_str(), taken.why);
        for remark in remarks {
            let _ = writeln!(text, "remark: {remark}");
        }
        let _ = writeln!(text, "written: {}", directory.display());
        print(&text);
    }
    Ok(if complete {
        Ending::Done
    } else {
        Ending::Short
    })
}

fn curve_ends(text: &mut String, curves: &[follow::Curve]) {
    for end in curves.iter().flat_map(|curve| &curve.ends) {
        let _ = writeln!(text, "end: {end}");
    }
}
