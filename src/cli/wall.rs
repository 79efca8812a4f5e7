//! `snaprod equilibrium` and `snaprod branch` of walls under pressure: tubes and membranes.

use super::branch::BranchArgs;
use super::check::no_start;
use super::equilibrium::EquilibriumArgs;
use super::files::{exact, json_text, number, print, print_json, rounded};
use super::output::Output;
use super::{Ending, Refusal, branch, equilibrium};
use serde_json::Value;
use snaprod::plot::{self, LineStyle, Lines, Series};
use snaprod::scene::{Scene, Units, WallParameter};
use snaprod::study::wall::{self, WallBranchRecord, WallRecord};
use std::fmt::Write;

/// Solves the scene and describes its equilibrium.
pub fn equilibrium(args: &EquilibriumArgs, scene: &Scene) -> Result<Ending, Refusal> {
    let record = wall::equilibrium(scene).map_err(|e| no_start(&args.scene.path, &e))?;
    if let Some(directory) = &args.output.out {
        let out = Output::open(Some(directory), equilibrium::FILES, args.output.figures)?;
        out.write(
            "equilibrium.json",
            json_text(record.summary.clone()).as_bytes(),
        )?;
        out.table(&record.shape)?;
        out.figure("equilibrium", || Ok(shape(&record)), plot::lines);
        out.finish(!args.output.json)?;
    }
    if args.output.json {
        print_json(record.summary);
    } else {
        print(&text(&record));
    }
    Ok(Ending::Done)
}

/// Numbers and words of a record in the order in which they are printed. A record has some of them.
const PRINTED: [&str; 20] = [
    "pressure",
    "pressure_number",
    "area",
    "lumen_area",
    "height",
    "volume",
    "contents",
    "stretch",
    "edge_stretch",
    "edge_angle",
    "energy",
    "compliance",
    "wave_speed",
    "contact",
    "contact_force",
    "contact_length",
    "curvature_tip",
    "curvature_trough",
    "axes",
    "stable",
];

/// The numbers and words of the record, one a line.
fn text(record: &WallRecord) -> String {
    let mut text = String::new();
    for name in PRINTED {
        let shown = match &record.summary[name] {
            Value::Number(x) => x.as_f64().map(number),
            Value::String(word) => Some(word.clone()),
            Value::Bool(flag) => Some(flag.to_string()),
            Value::Array(list) if name == "axes" => {
                let numbers = list.iter().filter_map(Value::as_f64).map(number);
                Some(numbers.collect::<Vec<_>>().join(", "))
            }
            _ => None,
        };
        if let Some(shown) = shown {
            let _ = writeln!(text, "{:<18}{shown}", name.replace('_', " "));
        }
    }
    text
}

fn shape(record: &WallRecord) -> Lines {
    let columns: Vec<&str> = record
        .shape
        .columns
        .iter()
        .map(|column| &*column.name)
        .collect();
    let label = |k: usize| Units::label(columns[k], record.units.length());
    Lines {
        x_label: label(0),
        y_label: label(1),
        series: vec![Series {
            x: record.shape.reals(columns[0]).to_vec(),
            y: record.shape.reals(columns[1]).to_vec(),
            ..Series::default()
        }],
        equal: true,
        ..Lines::default()
    }
}

/// Follows the branch of the scene and writes it.
pub fn branch(args: &BranchArgs, scene: &Scene) -> Result<Ending, Refusal> {
    if args.html {
        return Err(Refusal(
            "--html: branches of tubes and membranes have no page; leave it out, and see branch.svg and shapes.svg".to_owned(),
        ));
    }
    let record = wall::branch(scene).map_err(|e| no_start(&args.scene.path, &e))?;
    let summary = record.summary();
    let directory = args.output.directory(&args.scene, "");
    let out = Output::open(Some(&directory), branch::FILES, args.output.figures)?;
    out.table(&record.points)?;
    out.write("special_points.json", json_text(summary.clone()).as_bytes())?;
    out.figure("branch", || Ok(diagram(&record)), plot::lines);
    out.figure("shapes", || Ok(shapes(&record)), plot::lines);
    out.finish(!args.output.json)?;
    if args.output.json {
        print_json(summary);
    } else {
        let mut text = branch_text(&record);
        let _ = writeln!(text, "written: {}", directory.display());
        print(&text);
    }
    Ok(match record.stop {
        None => Ending::Done,
        Some(_) => Ending::Short,
    })
}

fn branch_text(record: &WallBranchRecord) -> String {
    let mut text = String::new();
    let name = record.branch.parameter.name();
    let _ = writeln!(
        text,
        "{} points of the branch in {name}",
        record.points.rows()
    );
    for at in &record.specials {
        let kind = if at.kind == at.label { "" } else { at.kind };
        let _ = writeln!(
            text,
            "{:<9}{kind:<5} at {}, pressure {}",
            at.label,
            exact(at.parameter),
            exact(at.pressure)
        );
    }
    if let Some(why) = &record.stop {
        let _ = writeln!(text, "end: {why}");
    }
    text
}

/// Pressure over the area or the volume, with the special points.
fn diagram(record: &WallBranchRecord) -> Lines {
    let points = &record.points;
    let (x, x_label) = match record.branch.parameter {
        WallParameter::Stretch => ("volume", Units::label("volume", record.units.volume())),
        WallParameter::Pressure | WallParameter::Area => ("area", "area A/A0".to_owned()),
    };
    let curve = |name: &str, keep: &dyn Fn(&str) -> bool, trace: LineStyle| {
        let labels = points.words("label");
        let rows: Vec<usize> = (0..points.rows()).filter(|k| keep(&labels[*k])).collect();
        let of = |column: &str| rows.iter().map(|k| points.reals(column)[*k]).collect();
        Series {
            name: name.to_owned(),
            x: of(x),
            y: of("pressure"),
            trace,
            ..Series::default()
        }
    };
    let mut series = vec![curve("", &|_| true, LineStyle::Line)];
    for at in &record.specials {
        series.push(curve(
            &at.label,
            &|label| label == at.label,
            LineStyle::LineMarks,
        ));
    }
    Lines {
        x_label,
        y_label: Units::label("pressure", record.units.stress()),
        series,
        ..Lines::default()
    }
}

/// Shapes along the branch.
fn shapes(record: &WallBranchRecord) -> Lines {
    let unit = Units::suffix(record.branch.parameter.unit(record.units));
    let name = record.branch.parameter.name();
    let series = record.shapes.iter().map(|(at, shape)| Series {
        name: format!("{name} = {}{unit}", rounded(*at, 4)),
        x: shape.iter().map(|point| point[0]).collect(),
        y: shape.iter().map(|point| point[1]).collect(),
        ..Series::default()
    });
    let labels = match record.branch.parameter {
        WallParameter::Stretch => ["r", "z"],
        WallParameter::Pressure | WallParameter::Area => ["x", "y"],
    };
    let [x_label, y_label] = labels.map(|name| Units::label(name, record.units.length()));
    Lines {
        x_label,
        y_label,
        series: series.collect(),
        equal: true,
        ..Lines::default()
    }
}
