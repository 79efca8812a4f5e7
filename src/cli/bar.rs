//! `snaprod run` of a bar in longitudinal motion.

use super::files::{number, rounded};
use super::output::Output;
use super::run::RunArgs;
use super::{Refusal, rod_figures};
use snaprod::plot::{self, AxisUnits, Curve, Lines, Series, StrainMap};
use snaprod::scene::Units;
use snaprod::study::bar::BarRecord;
use std::fmt::Write;
use std::path::Path;

/// Number of intervals between the times of profiles.
const SNAPSHOTS: usize = 6;

/// Refuses options that a bar cannot serve.
pub fn refuse_options(args: &RunArgs) -> Result<(), Refusal> {
    if args.html {
        return Err(Refusal(
            "--html: a bar stays straight, and a page of it would not move; leave it out, and see waves.svg and snapshots.svg".to_owned(),
        ));
    }
    if args.gltf || args.film.is_some() {
        return Err(Refusal(
            "--gltf, --film: a bar stays straight and has no shapes to show; leave them out, and see waves.svg and snapshots.svg".to_owned(),
        ));
    }
    if args.vtk {
        return Err(Refusal(
            "--vtk: a bar stays straight and has no shapes to write; leave it out, its places over time are in waves.csv, with --npz in waves.npz".to_owned(),
        ));
    }
    Ok(())
}

/// Draws the figures of a run.
pub fn draw(out: &Output, record: &BarRecord) {
    out.figure("waves", || Ok(map(record)), plot::strain_map);
    out.figure("snapshots", || Ok(snapshots(record)), plot::lines);
    out.figure("energies", || Ok(energies(record)), plot::lines);
}

/// The stress over time and material coordinate, with characteristics and shocks.
fn map(record: &BarRecord) -> StrainMap {
    let fronts = record.shocks.iter().map(|shock| {
        let points = shock.points.iter();
        Curve::new(points.map(|point| [point.time, point.position]))
    });
    StrainMap {
        title: record.scheme.to_owned(),
        time: record.times.clone(),
        s: record.x.clone(),
        strain: record.field.clone(),
        strain_label: Units::label("stress", record.units.stress()),
        rays: record
            .rays
            .iter()
            .map(|ray| Curve::new(ray.iter().copied()))
            .collect(),
        fronts: fronts.collect(),
        s_label: "X".to_owned(),
        units: AxisUnits {
            rod: record.length,
            ..rod_figures::units(record.units)
        },
        ..StrainMap::default()
    }
}

/// The stress along the bar at a few times.
fn snapshots(record: &BarRecord) -> Lines {
    Lines {
        x_label: Units::label("X", record.units.length()),
        y_label: Units::label("stress", record.units.stress()),
        series: profiles(&record.times, &record.x, &record.field, record.units)
            .skip(1)
            .collect(),
        ..Lines::default()
    }
}

/// Profiles over `x` at a few of the times, the first time among them. The field has a row for each time.
pub(super) fn profiles(
    times: &[f64],
    x: &[f64],
    field: &[Vec<f64>],
    units: Units,
) -> impl Iterator<Item = Series> {
    let last = times.len().saturating_sub(1);
    (0..=SNAPSHOTS).filter_map(move |k| {
        let i = last * k / SNAPSHOTS;
        Some(Series {
            name: format!(
                "t = {}{}",
                rounded(*times.get(i)?, 4),
                Units::suffix(units.time())
            ),
            x: x.to_vec(),
            y: field.get(i)?.clone(),
            ..Series::default()
        })
    })
}

/// The ledger over time: energies and dissipation against the work of the load.
fn energies(record: &BarRecord) -> Lines {
    let curve = |name: &str, of: &dyn Fn(&snaprod::bar::Ledger) -> f64| Series {
        name: name.to_owned(),
        x: record.moments.iter().map(|at| at.time).collect(),
        y: record.moments.iter().map(|at| of(&at.ledger)).collect(),
        ..Series::default()
    };
    Lines {
        x_label: Units::label("time t", record.units.time()),
        y_label: Units::label("energy", record.units.energy()),
        series: vec![
            curve("work", &|l| l.work),
            curve("kinetic", &|l| l.kinetic),
            curve("strain", &|l| l.strain),
            curve("lost", &|l| l.lost),
        ],
        ..Lines::default()
    }
}

pub fn text(record: &BarRecord, out: Option<&Path>) -> String {
    let mut text = String::new();
    let u = record.units;
    // Writing to a string cannot fail.
    let mut line = |line: String| {
        let _ = writeln!(text, "{line}");
    };
    let with = |x: f64, symbol| format!("{}{}", rounded(x, 6), Units::suffix(symbol));
    let at = |t, x| format!("t = {}, X = {}", with(t, u.time()), with(x, u.length()));
    let power = match u {
        Units::Si => u.power(),
        Units::Dimensionless => "per time",
    };
    if let Some(first) = &record.breaking {
        line(format!(
            "the first wave breaks at {}",
            at(first.time, first.position)
        ));
    }
    for shock in &record.shocks {
        if let (Some(from), Some(to)) = (shock.points.first(), shock.points.last()) {
            line(format!(
                "shock from {} to {}: speed {}, loses {} there",
                at(from.time, from.position),
                at(to.time, to.position),
                with(to.speed, u.velocity()),
                with(to.loss_rate, power),
            ));
        }
    }
    line(format!(
        "stress at X = 0 from {} to {}",
        with(record.wall.min, u.stress()),
        with(record.wall.max, u.stress())
    ));
    if let Some(last) = record.last() {
        let l = &last.ledger;
        line(format!(
            "t = {}{}: work {}, kinetic {}, strain {}, lost {}",
            number(last.time),
            Units::suffix(u.time()),
            with(l.work, u.energy()),
            with(l.kinetic, u.energy()),
            with(l.strain, u.energy()),
            with(l.lost, u.energy()),
        ));
    }
    if let Some(out) = out {
        line(format!("written to {}", out.display()));
    }
    text
}
