//! `snaprod branch SCENE`.

use super::check::{no_start, read_statics};
use super::equilibrium::{drawn, halves, list, quaternion, units};
use super::files::{
    check_png, exact, json_text, make_directory, print, print_json, write_figure, write_whole,
};
use super::{BranchArgs, Ending, Refusal};
use serde_json::{Value, json};
use snaprod::plot::{
    Branch as Curve, BranchDiagram, BranchPanel, RodShapes, Special as Mark, SpecialKind,
    branch_diagram, rod_shapes,
};
use snaprod::rod::{Equilibrium, Problem, RodFamily};
use snaprod::scene::{Continue, Parameter, Statics, Units};
use snaprod::solve::arclength::{Branch, Direction, Item, Options, Point, Role, Stop};
use snaprod::solve::special::{Kind, Special, Status};
use snaprod::solve::switching::switch;
use std::fmt::Write;

/// The size of the wrench, in B/L and B/L^2, that counts as much as the whole range of the parameter.
const TYPICAL: f64 = 10.0;
/// Shapes in the figure of shapes.
const SHAPES: usize = 12;

/// Branches followed in all, switching included.
const BRANCHES: usize = 24;
/// Distance from a branch point at which another branch is picked up, as a part of its whole range.
const AWAY: f64 = 0.003;

/// A point or special point with its equilibrium.
struct Row {
    /// 0 is the branch of the scene; others left it at branch points.
    branch: usize,
    p: f64,
    arclength: f64,
    equilibrium: Equilibrium,
    index: Option<usize>,
    label: String,
}

/// Follows the branch of the scene and writes it.
pub fn branch(args: &BranchArgs) -> Result<Ending, Refusal> {
    check_png(args.png)?;
    let scene = read_statics(&args.scene)?;
    let refuse = |e| no_start(&args.scene, &e);
    let Some(wanted) = scene.continuation.clone() else {
        return Err(Refusal(format!(
            "{}: no [continue]: add one that names the parameter, as in\n  [continue]\n  parameter = \"end.load\"\n  from = 0.0\n  to = 1.0",
            args.scene.display()
        )));
    };
    for (asked, field, instead) in [
        (
            wanted.second.is_some(),
            "second",
            "use the library's solve::fold_curve",
        ),
        (
            wanted.deflate,
            "deflate = true",
            "use the library's solve::deflation",
        ),
    ] {
        if asked {
            return Err(Refusal(format!(
                "{}: [continue] {field}: this command does not do it yet; leave it out, or {instead}",
                args.scene.display()
            )));
        }
    }
    let parameter = wanted.parameter;
    let make = |p: f64| scene.with(&parameter, p).problem();
    let family = RodFamily::new(make, changes_rod(parameter), wanted.to - wanted.from);
    let start = family
        .problem(wanted.from)
        .and_then(|problem| problem.solve(scene.guess().as_ref()))
        .map_err(refuse)?;
    let x = family.unknowns(&start.base, wanted.from).map_err(refuse)?;

    let mut found = Found::default();
    let ways: &[Direction] = if wanted.both {
        &[Direction::Backward, Direction::Forward]
    } else {
        &[Direction::Forward]
    };
    for &way in ways {
        let backward = way == Direction::Backward;
        let branch =
            Branch::new(&family, x, wanted.from, options(&scene, &wanted, way)).map_err(refuse)?;
        // The start is there already when the branch was followed the other way.
        let skip = wanted.both && !backward;
        found
            .follow(&family, branch, 0, backward, skip)
            .map_err(refuse)?;
    }
    if wanted.switch {
        let options = options(&scene, &wanted, Direction::Forward);
        found.switch(&family, &options).map_err(refuse)?;
    }
    let Found {
        rows,
        specials,
        stops,
    } = found;
    write(args, &scene, &wanted, &family, &rows, &specials, &stops)?;
    let reached = stops
        .iter()
        .all(|stop| matches!(stop, Stop::Reached | Stop::Closed | Stop::LeftAtStart));
    Ok(if reached { Ending::Done } else { Ending::Short })
}

/// What following branches has brought together.
#[derive(Default)]
struct Found {
    rows: Vec<Row>,
    specials: Vec<(Special<6>, String)>,
    stops: Vec<Stop>,
}

impl Found {
    /// Follows a branch to its end.
    fn follow<P: Fn(f64) -> snaprod::Result<Problem>>(
        &mut self,
        family: &RodFamily<P>,
        branch: Branch<'_, RodFamily<P>, 6>,
        number: usize,
        backward: bool,
        skip_start: bool,
    ) -> snaprod::Result<()> {
        let first = self.rows.len();
        let sign = if backward { -1.0 } else { 1.0 };
        for item in branch {
            match item {
                Item::Point(point) if skip_start && point.role == Role::Start => {}
                Item::Point(point) => {
                    self.rows
                        .push(row(family, &point, number, sign, String::new())?);
                }
                Item::Special(special) => {
                    let label = label(&special.kind, &self.specials);
                    self.rows
                        .push(row(family, &special.point, number, sign, label.clone())?);
                    self.specials.push((special, label));
                }
                Item::Stop(stop) => self.stops.push(stop),
            }
        }
        if backward {
            self.rows[first..].reverse();
        }
        Ok(())
    }

    /// Follows the branches that leave the scene's at its branch points.
    fn switch<P: Fn(f64) -> snaprod::Result<Problem>>(
        &mut self,
        family: &RodFamily<P>,
        options: &Options,
    ) -> snaprod::Result<()> {
        let crossings: Vec<Special<6>> = self
            .specials
            .iter()
            .filter(|(special, _)| {
                matches!(special.kind, Kind::BranchPoint | Kind::StabilityChange)
            })
            .map(|(special, _)| special.clone())
            .collect();
        let mut number = 0;
        for special in crossings {
            let Ok(ways) = switch(family, &special, TYPICAL * AWAY, options) else {
                continue;
            };
            for start in &ways.starts {
                if number + 1 >= BRANCHES {
                    return Ok(());
                }
                let Ok(branch) = Branch::along(family, start, options.clone()) else {
                    continue;
                };
                number += 1;
                self.follow(family, branch, number, false, false)?;
            }
        }
        Ok(())
    }
}

/// True if the rod itself depends on the parameter, not only its ends.
fn changes_rod(parameter: Parameter) -> bool {
    use Parameter::*;
    matches!(
        parameter,
        Length | Bending(_) | Torsion | Shear(_) | Axial | Curvature(_) | Twist
    )
}

fn options(scene: &Statics, wanted: &Continue, direction: Direction) -> Options {
    // In the scene the whole range of the parameter has length 1.
    let whole = (wanted.to - wanted.from).abs();
    let (low, high) = wanted.range();
    let (from, to) = if wanted.to > wanted.from {
        (low, high)
    } else {
        (high, low)
    };
    Options {
        at: wanted.at.clone(),
        direction,
        initial_step: TYPICAL * wanted.step,
        min_step: TYPICAL * wanted.min_step,
        max_step: TYPICAL * wanted.max_step,
        tolerance: scene.solve.tolerance,
        weight: TYPICAL / whole,
        max_points: wanted.points,
        ..Options::between(from, to)
    }
}

fn label(kind: &Kind, specials: &[(Special<6>, String)]) -> String {
    let stem = match kind {
        Kind::Fold => "LP",
        Kind::BranchPoint => "BP",
        Kind::Cusp => "CP",
        Kind::StabilityChange | Kind::Event => "SC",
    };
    let count = specials
        .iter()
        .filter(|(_, label)| label.starts_with(stem))
        .count();
    format!("{stem}{}", count + 1)
}

fn row<P: Fn(f64) -> snaprod::Result<Problem>>(
    family: &RodFamily<P>,
    point: &Point<6>,
    branch: usize,
    sign: f64,
    label: String,
) -> snaprod::Result<Row> {
    Ok(Row {
        branch,
        p: point.p,
        arclength: sign * point.arclength / TYPICAL,
        equilibrium: family.equilibrium(&point.x, point.p, point.index.unwrap_or(0))?,
        index: point.index,
        label,
    })
}

fn write<P: Fn(f64) -> snaprod::Result<Problem>>(
    args: &BranchArgs,
    scene: &Statics,
    wanted: &Continue,
    family: &RodFamily<P>,
    rows: &[Row],
    specials: &[(Special<6>, String)],
    stops: &[Stop],
) -> Result<(), Refusal> {
    let out = args.out.clone().unwrap_or_else(|| {
        let stem = args.scene.file_stem().unwrap_or_default();
        std::path::Path::new("out").join(stem)
    });
    let summary = json!({
        "parameter": wanted.parameter.to_string(),
        "points": rows.len(),
        "special_points": specials.iter().map(|(s, label)| special_json(s, label)).collect::<Vec<_>>(),
        "stop": stops.iter().map(ToString::to_string).collect::<Vec<_>>(),
    });
    make_directory(&out)?;
    write_whole(&out.join("branch.csv"), table(rows).as_bytes())?;
    write_whole(
        &out.join("special_points.json"),
        json_text(summary.clone()).as_bytes(),
    )?;
    write_figure(
        &out,
        "branch",
        &diagram(scene, wanted, rows, specials)?,
        args.png,
    )?;
    write_figure(
        &out,
        "shapes",
        &shapes(scene, wanted, family, rows)?,
        args.png,
    )?;
    if args.json {
        print_json(summary);
    } else {
        let mut text = format!(
            "{} points of the branch in {}\n",
            rows.len(),
            wanted.parameter
        );
        for (special, label) in specials {
            let _ = writeln!(
                text,
                "{label:<5} {:<17} at {} +- {:.0e}, index {} -> {}",
                special.kind.to_string(),
                exact(special.point.p),
                special.error_p,
                count(special.index.0),
                count(special.index.1),
            );
        }
        for stop in stops {
            let _ = writeln!(text, "end: {stop}");
        }
        let _ = writeln!(text, "written: {}", out.display());
        print(&text);
    }
    Ok(())
}

fn count(index: Option<usize>) -> String {
    index.map_or_else(|| "?".to_owned(), |i| i.to_string())
}

fn special_json(special: &Special<6>, label: &str) -> Value {
    let (status, reason) = match &special.status {
        Status::Converged => ("converged", None),
        Status::Guess(why) => ("guess", Some(why)),
    };
    json!({
        "label": label,
        "kind": special.kind.to_string(),
        "status": status,
        "reason": reason,
        "parameter": special.point.p,
        "arclength": special.point.arclength / TYPICAL,
        "interval": [special.interval.0 / TYPICAL, special.interval.1 / TYPICAL],
        "precision": { "parameter": special.error_p, "arclength": special.error_s / TYPICAL },
        "index_before": special.index.0,
        "index_after": special.index.1,
    })
}

fn table(rows: &[Row]) -> String {
    let mut text = String::from(
        "branch,parameter,arclength,x,y,z,qw,qx,qy,qz,base_fx,base_fy,base_fz,base_mx,base_my,base_mz,tip_fx,tip_fy,tip_fz,tip_mx,tip_my,tip_mz,energy,index,residual,label\n",
    );
    for row in rows {
        let end = &row.equilibrium.end;
        let (couple, force) = halves(&row.equilibrium.base);
        let numbers = [row.p, row.arclength]
            .into_iter()
            .chain(list(&end.position))
            .chain(quaternion(end))
            .chain(list(&force))
            .chain(list(&couple))
            .chain(list(&end.force))
            .chain(list(&end.couple))
            .chain([end.energy]);
        let mut cells = vec![row.branch.to_string()];
        cells.extend(numbers.map(exact));
        cells.push(row.index.map_or_else(String::new, |i| i.to_string()));
        cells.push(exact(row.equilibrium.residual));
        cells.push(row.label.clone());
        text.push_str(&cells.join(","));
        text.push('\n');
    }
    text
}

/// The component, of end position and base couple, that changes most along the branch beside the parameter itself.
fn measure(rows: &[Row], units: Units, length: f64) -> (String, Vec<f64>) {
    let component = |k: usize| -> Vec<f64> {
        let pick = |row: &Row| {
            if k < 3 {
                row.equilibrium.end.position[k] / length
            } else {
                row.equilibrium.base[k - 3]
            }
        };
        rows.iter().map(pick).collect()
    };
    let span = |values: &[f64]| {
        let low = values.iter().copied().fold(f64::INFINITY, f64::min);
        let high = values.iter().copied().fold(f64::NEG_INFINITY, f64::max);
        high - low
    };
    let ps: Vec<f64> = rows.iter().map(|row| row.p).collect();
    // A held component is the parameter, or constant.
    let follows = |values: &[f64]| {
        let offset = values[0] * length - ps[0];
        values
            .iter()
            .zip(&ps)
            .all(|(v, p)| (v * length - p - offset).abs() < 1e-9 * length)
    };
    let best = |range: std::ops::Range<usize>| {
        range
            .map(|k| (k, component(k)))
            .filter(|(_, values)| !follows(values) && span(values) > 1e-6)
            .max_by(|a, b| span(&a.1).total_cmp(&span(&b.1)))
    };
    let names = [
        "x of the end",
        "y of the end",
        "z of the end",
        "base couple mx",
        "base couple my",
        "base couple mz",
    ];
    let couple = match units {
        Units::Si => "N m",
        Units::Dimensionless => "",
    };
    match best(0..3).or_else(|| best(3..6)) {
        Some((k, values)) if k < 3 => {
            let values = values.iter().map(|v| v * length).collect();
            (Units::label(names[k], units.length()), values)
        }
        Some((k, values)) => (Units::label(names[k], couple), values),
        None => (Units::label(names[3], couple), component(3)),
    }
}

fn diagram(
    scene: &Statics,
    wanted: &Continue,
    rows: &[Row],
    specials: &[(Special<6>, String)],
) -> Result<String, Refusal> {
    let (name, values) = measure(rows, scene.units, scene.rod.length);
    let energies = rows.iter().map(|row| row.equilibrium.end.energy).collect();
    let last = rows.iter().map(|row| row.branch).max().unwrap_or(0);
    let panel = |y_label: String, y: Vec<f64>| {
        let marks = specials
            .iter()
            .filter_map(|(special, label)| {
                let i = rows.iter().position(|row| row.label == *label)?;
                Some(Mark {
                    x: rows[i].p,
                    y: y[i],
                    kind: match special.kind {
                        Kind::Fold => SpecialKind::Fold,
                        Kind::BranchPoint => SpecialKind::BranchPoint,
                        Kind::Cusp => SpecialKind::Cusp,
                        Kind::StabilityChange | Kind::Event => SpecialKind::StabilityChange,
                    },
                    label: label.clone(),
                })
            })
            .collect();
        BranchPanel {
            y_label,
            y_range: None,
            branches: (0..=last)
                .map(|number| {
                    let own = || {
                        rows.iter()
                            .enumerate()
                            .filter(move |(_, row)| row.branch == number)
                    };
                    Curve {
                        name: String::new(),
                        x: own().map(|(_, row)| row.p).collect(),
                        y: own().map(|(i, _)| y[i]).collect(),
                        index: own().map(|(_, row)| row.index).collect(),
                        colour: None,
                    }
                })
                .collect(),
            specials: marks,
        }
    };
    Ok(branch_diagram(&BranchDiagram {
        title: String::new(),
        x_label: wanted.parameter.to_string(),
        x_range: None,
        panels: vec![
            panel(name, values),
            panel(
                Units::label("stored energy", scene.units.energy()),
                energies,
            ),
        ],
    })?)
}

fn shapes<P: Fn(f64) -> snaprod::Result<Problem>>(
    scene: &Statics,
    wanted: &Continue,
    family: &RodFamily<P>,
    rows: &[Row],
) -> Result<String, Refusal> {
    let last = rows.len() - 1;
    let shown = SHAPES.min(rows.len());
    let mut rods = Vec::new();
    for k in 0..shown {
        let row = &rows[k * last / (shown - 1).max(1)];
        let problem = family.problem(row.p)?;
        let sections = problem.shape(&row.equilibrium.base, 121)?;
        rods.push(drawn(
            &sections,
            Some(row.p),
            row.index.is_some_and(|i| i > 0),
        ));
    }
    Ok(rod_shapes(&RodShapes {
        rods,
        value_label: wanted.parameter.to_string(),
        ribbon: 0.03 * scene.rod.length,
        triads: false,
        units: units(scene),
        ..RodShapes::default()
    })?)
}
