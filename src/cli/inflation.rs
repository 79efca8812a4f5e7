//! `snaprod run` of a membrane in motion.

use super::files::{number, rounded};
use super::output::Output;
use super::run::RunArgs;
use super::{Refusal, rod_figures};
use serde_json::Value;
use snaprod::motion::Ledger;
use snaprod::plot::{self, Energies, Lines, Series};
use snaprod::scene::Units;
use snaprod::study::inflation::{InflationMoment, InflationRecord};
use std::fmt::Write;
use std::path::Path;

/// Number of intervals between the times of profiles.
const SNAPSHOTS: usize = 6;

/// Refuses options that a membrane cannot serve.
pub fn refuse_options(args: &RunArgs) -> Result<(), Refusal> {
    let given = [
        (args.html, "--html"),
        (args.gltf, "--gltf"),
        (args.film.is_some(), "--film"),
        (args.vtk, "--vtk"),
    ];
    match given.iter().find(|(given, _)| *given) {
        None => Ok(()),
        Some((_, option)) => Err(Refusal(format!(
            "{option}: a membrane has no rods to show; leave it out, and see height.svg and energies.svg, and of a disc snapshots.svg \
             and fields.csv"
        ))),
    }
}

/// Draws the figures of a run.
pub fn draw(out: &Output, record: &InflationRecord) {
    let marks = record.snap_times();
    out.figure(
        "height",
        || Ok(histories(record)),
        move |panels, paper| plot::stacked("", panels, (&marks, "snap"), paper),
    );
    out.figure("energies", || Ok(energies(record)), plot::energies);
    if !record.profiles.is_empty() {
        out.figure("snapshots", || Ok(snapshots(record)), plot::lines);
    }
}

/// Height and pressure over time, and the place of a piston.
fn histories(record: &InflationRecord) -> Vec<Lines> {
    let u = record.units;
    let panel = |name: &str, unit: &str, of: &dyn Fn(&InflationMoment) -> f64| Lines {
        x_label: Units::label("time t", u.time()),
        y_label: Units::label(name, unit),
        series: vec![Series {
            x: record.moments.iter().map(|at| at.time).collect(),
            y: record.moments.iter().map(of).collect(),
            ..Series::default()
        }],
        ..Lines::default()
    };
    let mut panels = vec![
        panel("height", u.length(), &|at| at.height),
        panel("pressure", u.stress(), &|at| at.pressure),
    ];
    if record.last().is_some_and(|at| at.piston.is_some()) {
        let place = |at: &InflationMoment| at.piston.unwrap_or(f64::NAN);
        panels.push(panel("piston", u.length(), &place));
    }
    panels
}

/// The ledger over time.
fn energies(record: &InflationRecord) -> Energies {
    let states = record.moments.iter().map(|at| (at.time, &at.ledger));
    let states: Vec<(f64, &Ledger)> = states.collect();
    let units = rod_figures::units(record.units);
    Energies {
        potential_name: "gas".to_owned(),
        ..rod_figures::energies(&states, false, record.snap_times(), units)
    }
}

/// The profile of a disc at a few times.
fn snapshots(record: &InflationRecord) -> Lines {
    let u = record.units;
    let last = record.profiles.len().saturating_sub(1);
    let series = (0..=SNAPSHOTS).filter_map(|k| {
        let (time, half) = record.profiles.get(last * k / SNAPSHOTS)?;
        let other = half.iter().rev().map(|[r, z]| [-r, *z]);
        let whole = other.chain(half.iter().copied());
        let (x, y) = whole.map(|[r, z]| (r, z)).unzip();
        Some(Series {
            name: format!("t = {}{}", rounded(*time, 4), Units::suffix(u.time())),
            x,
            y,
            ..Series::default()
        })
    });
    Lines {
        x_label: Units::label("r", u.length()),
        y_label: Units::label("z", u.length()),
        series: series.collect(),
        equal: true,
        ..Lines::default()
    }
}

pub fn text(record: &InflationRecord, out: Option<&Path>) -> String {
    let mut text = String::new();
    let u = record.units;
    // Writing to a string cannot fail.
    let mut line = |line: String| {
        let _ = writeln!(text, "{line}");
    };
    let with = |x: f64, symbol| format!("{}{}", rounded(x, 6), Units::suffix(symbol));
    let time = |t: f64| format!("t = {}", with(t, u.time()));
    for event in &record.events {
        let of = |path: &str| {
            event
                .pointer(path)
                .and_then(Value::as_f64)
                .unwrap_or(f64::NAN)
        };
        let kind = event["kind"].as_str().unwrap_or_default();
        let at = time(of("/t"));
        line(match kind {
            "fold" => {
                let way = if event["outward"] == true {
                    "outward"
                } else {
                    "inward"
                };
                format!(
                    "fold at {at}: {way} through the stretch {}",
                    rounded(of("/stretch"), 6)
                )
            }
            "snap" => format!(
                "snap at {at}: stretch from {} to {}, releases {}",
                rounded(of("/from/stretch"), 6),
                rounded(of("/to/stretch"), 6),
                with(of("/released"), u.energy())
            ),
            _ => match (event["ring"].as_u64(), event["direction"].as_str()) {
                (Some(ring), Some(direction)) => {
                    format!("{kind} at {at}: ring {ring} from the pole, along its {direction}")
                }
                _ => format!("{kind} at {at}"),
            },
        });
    }
    if let Some([dynamic, limit]) = &record.snaps_at {
        let told = |name: &str, found: &Option<_>| {
            found.map(|at: snaprod::study::inflation::SnapPressure| {
                format!("{name} {}", with(at.pressure, u.stress()))
            })
        };
        let both = [
            told("a step from rest snaps it at the pressure", dynamic),
            told("the limit point at rest is", limit),
        ];
        let both: Vec<String> = both.into_iter().flatten().collect();
        if !both.is_empty() {
            line(both.join(", "));
        }
    }
    if let Some(found) = &record.oscillation {
        line(format!(
            "oscillation: period {}, stretch from {} to {}",
            with(found.period, u.time()),
            number(found.min),
            number(found.max)
        ));
    }
    let highest = record.max_height;
    line(format!(
        "greatest height {} at {}",
        with(highest.value, u.length()),
        time(highest.time)
    ));
    if let Some(last) = record.last() {
        line(format!(
            "{}: height {}, stretch {}, pressure {}",
            time(last.time),
            with(last.height, u.length()),
            rounded(last.stretch, 6),
            with(last.pressure, u.stress()),
        ));
    }
    if let Some(why) = record.warning() {
        line(format!("note: {why}"));
    }
    if let Some(out) = out {
        line(format!("written to {}", out.display()));
    }
    text
}
