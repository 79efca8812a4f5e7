//! `snaprod run` of a flow in a tube.

use super::bar::profiles;
use super::files::{number, rounded};
use super::output::Output;
use super::run::RunArgs;
use super::{Refusal, rod_figures};
use snaprod::plot::{self, AxisUnits, Curve, Lines, Series, StrainMap};
use snaprod::scene::Units;
use snaprod::study::flow::{FlowMoment, FlowRecord};
use std::fmt::Write;
use std::path::Path;

/// Refuses options that a flow cannot serve.
pub fn refuse_options(args: &RunArgs) -> Result<(), Refusal> {
    let figures = "see area.svg and snapshots.svg, or cycle.svg of a lumped tube";
    if args.html {
        return Err(Refusal(format!(
            "--html: a flow has no page; leave it out, and {figures}"
        )));
    }
    if args.vtk {
        return Err(Refusal(
            "--vtk: a flow has no rods to write; leave it out, its areas along the tube are in fields.csv, with --npz in fields.npz"
                .to_owned(),
        ));
    }
    Ok(())
}

/// Draws the figures of a run.
pub fn draw(out: &Output, record: &FlowRecord) {
    if record.is_lumped() {
        out.figure("cycle", || Ok(cycle(record)), plot::lines);
        return;
    }
    out.figure("area", || Ok(map(record)), plot::strain_map);
    out.figure("snapshots", || Ok(snapshots(record)), plot::lines);
    out.figure("energies", || Ok(energies(record)), plot::lines);
}

/// The area over time and place, with the elastic jumps.
fn map(record: &FlowRecord) -> StrainMap {
    let fronts = record.jumps.iter().map(|jump| {
        let points = jump.points.iter();
        Curve::new(points.map(|point| [point.time, point.position]))
    });
    let less = |row: &Vec<f64>| row.iter().map(|area| area - 1.0).collect();
    StrainMap {
        title: "area".to_owned(),
        time: record.times.clone(),
        s: record.x.clone(),
        strain: record.areas.iter().map(less).collect(),
        strain_label: "A/A0 - 1".to_owned(),
        fronts: fronts.collect(),
        s_label: "x".to_owned(),
        units: AxisUnits {
            rod: record.length,
            ..rod_figures::units(record.units)
        },
        ..StrainMap::default()
    }
}

/// The area along the tube at a few times.
fn snapshots(record: &FlowRecord) -> Lines {
    Lines {
        x_label: Units::label("x", record.units.length()),
        y_label: "area A/A0".to_owned(),
        series: profiles(&record.times, &record.x, &record.areas, record.units).collect(),
        ..Lines::default()
    }
}

/// A number of the samples over their time.
fn over_time(record: &FlowRecord, name: &str, of: &dyn Fn(&FlowMoment) -> f64) -> Series {
    Series {
        name: name.to_owned(),
        x: record.moments.iter().map(|at| at.time).collect(),
        y: record.moments.iter().map(of).collect(),
        ..Series::default()
    }
}

/// The ledger over time.
fn energies(record: &FlowRecord) -> Lines {
    Lines {
        x_label: Units::label("time t", record.units.time()),
        y_label: Units::label("energy", record.units.energy()),
        series: vec![
            over_time(record, "kinetic", &|at| at.ledger.kinetic),
            over_time(record, "wall", &|at| at.ledger.wall),
            over_time(record, "work at the ends", &|at| at.ledger.work),
            over_time(record, "work outside", &|at| at.ledger.outside),
            over_time(record, "friction", &|at| at.ledger.friction),
            over_time(record, "jumps", &|at| at.ledger.jumps),
        ],
        ..Lines::default()
    }
}

/// The motion of a lumped tube in the plane of area and flow.
fn cycle(record: &FlowRecord) -> Lines {
    let flow = |name: &str, k: usize| Series {
        name: name.to_owned(),
        x: record.moments.iter().map(|at| at.least.0).collect(),
        y: record.moments.iter().map(|at| at.flows[k]).collect(),
        ..Series::default()
    };
    Lines {
        x_label: "area a".to_owned(),
        y_label: "flow Q".to_owned(),
        series: vec![flow("Q1", 0), flow("Q2", 1)],
        ..Lines::default()
    }
}

pub fn text(record: &FlowRecord, out: Option<&Path>) -> String {
    let mut text = String::new();
    let u = record.units;
    // Writing to a string cannot fail.
    let mut line = |line: String| {
        let _ = writeln!(text, "{line}");
    };
    let with = |x: f64, symbol| format!("{}{}", rounded(x, 6), Units::suffix(symbol));
    for event in &record.events {
        let of = |key: &str| event[key].as_f64().unwrap_or(f64::NAN);
        line(format!(
            "{} at t = {}, x = {}, speed {}",
            event["kind"].as_str().unwrap_or_default(),
            with(of("t"), u.time()),
            with(of("x"), u.length()),
            with(of("speed"), u.velocity()),
        ));
    }
    if let Some(hopf) = &record.hopf {
        line(format!(
            "equilibria are unstable from Pu = {} on, where cycles have the period {}",
            number(hopf.pressure),
            number(hopf.period)
        ));
    }
    if let Some(cycle) = &record.cycle {
        line(format!(
            "cycle: period {}, area from {} to {}",
            number(cycle.period),
            number(cycle.min),
            number(cycle.max)
        ));
    }
    if let Some(last) = record.last() {
        let (flow, time) = if record.is_lumped() {
            ("", "")
        } else {
            (if u == Units::Si { "m^3/s" } else { "" }, u.time())
        };
        line(format!(
            "t = {}{}: least area {} A0, inflow {}, outflow {}, S up to {}",
            number(last.time),
            Units::suffix(time),
            rounded(last.least.0, 6),
            with(last.flows[0], flow),
            with(last.flows[1], flow),
            rounded(last.index.0, 6),
        ));
    }
    if let Some(out) = out {
        line(format!("written to {}", out.display()));
    }
    text
}
