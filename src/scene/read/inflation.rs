//! Reader of membranes in motion: `[membrane]` with `[run]`.

use super::fields::{BODY, GAS, LOADS, MEMBRANE_TABLE, RUN, START};
use super::flow::in_time;
use super::scene::{default, part, units};
use super::table::Table;
use super::wall::{of_gas, of_membrane};
use crate::membrane::gas::Vessel;
use crate::membrane::{Filling, Shape};
use crate::scene::{FaultKind, History, InflationScene, Mover, PistonScene, Scene, SceneKind};

/// Reads every field before returning `None`, for a complete list of faults.
pub(super) fn inflation(top: &Table) -> Option<Scene> {
    let units = units(top);
    let piston = top.has("body");
    let table = part(top, &MEMBRANE_TABLE).flatten();
    let run = part(top, &RUN).flatten().and_then(|table| {
        let (duration, samples) = (table.number("duration"), table.count("samples"));
        Some((duration?, samples?))
    });
    let gas = default(part(top, &GAS), None, |table| of_gas(table).map(Some));
    let body = default(part(top, &BODY), None, |table| {
        let (mass, area) = (table.number("mass"), table.number("area"));
        Some(Some([mass?, area?]))
    });
    let loads = default(part(top, &LOADS), [None, None], |table| {
        let (pressure, force) = (in_time(table, "pressure"), in_time(table, "force"));
        if piston {
            let hint = "the gas has the pressure of balloon and piston: write [loads] force";
            left_out(table, "pressure", "where [body] is given", hint)?;
        } else {
            left_out(table, "force", WITHOUT_PISTON, UNLOADED)?;
        }
        Some([pressure?, force?])
    });
    let start = default(part(top, &START), (None, 0.0), |table| {
        let (stretch, velocity) = (table.optional("stretch"), table.number("velocity"));
        if !piston {
            let names = ["stretch", "velocity"];
            let out = names.map(|name| left_out(table, name, WITHOUT_PISTON, UNLOADED));
            out.into_iter().collect::<Option<Vec<()>>>()?;
        }
        Some((stretch?, velocity?))
    });
    let table = table?;
    let made = of_membrane(&table);
    let (density, elements) = (table.optional("density"), table.count("elements"));
    let ([pressure, force], gas, body) = (loads?, gas?, body?);
    let (membrane, constants) = made?;
    let mover = if let Some([mass, area]) = body {
        for name in ["density", "elements"] {
            let hint = "the balloon below a heavy piston has no mass: keep one of the two";
            left_out(&table, name, "where [body] is given", hint)?;
        }
        if membrane.shape != Shape::Sphere {
            let hint =
                "pistons are on vessels of spheres: leave out [body], and give the disc a density";
            return table.refuse(
                FaultKind::Conflict,
                "shape",
                "\"sphere\" with a piston, [body]",
                hint,
            );
        }
        let (contents, vessel) = gas_below(top, gas)?;
        let (stretch, velocity) = start?;
        Mover::Piston(PistonScene {
            mass,
            area,
            force: force.unwrap_or(History::Constant(0.0)),
            contents,
            vessel,
            stretch,
            velocity,
        })
    } else {
        if membrane.shape == Shape::Sphere {
            let hint = "a sphere in motion stays a sphere, and has no rings";
            left_out(&table, "elements", "where the shape is \"sphere\"", hint)?;
        }
        let filling = filling(top, table.at, pressure, gas);
        let density = density?;
        if density.is_none() {
            let allowed = "the mass per volume of the membrane, or a heavy piston, [body]";
            table.missing("density", allowed, "density = 1000.0");
        }
        start?;
        Mover::Membrane {
            density: density?,
            elements: elements?,
            filling: filling?,
        }
    };
    let (duration, samples) = run?;
    let scene = InflationScene {
        membrane,
        constants,
        mover,
        duration,
        samples,
    };
    if let Err(error) = scene.start() {
        let allowed = "a membrane whose motion can start";
        return refuse(top, table.at, FaultKind::Value, allowed, error.to_string());
    }
    Some(Scene::without_rods(units?, SceneKind::Inflation(scene)))
}

const WITHOUT_PISTON: &str = "without a piston, [body]";
const UNLOADED: &str =
    "a membrane with density starts unloaded and at rest, under [loads] pressure or [gas]";

/// Refuses a given field of another kind of motion.
fn left_out(table: &Table, name: &str, place: &str, hint: &str) -> Option<()> {
    if !table.has(name) {
        return Some(());
    }
    table.refuse(
        FaultKind::Conflict,
        name,
        format!("left out {place}"),
        hint.to_owned(),
    )
}

/// Refuses the table `[membrane]` that begins at `at`.
fn refuse<T>(top: &Table, at: usize, kind: FaultKind, allowed: &str, hint: String) -> Option<T> {
    let reader = top.reader;
    reader.record(kind, at, "membrane", None, allowed, Some(hint));
    None
}

/// The pressure or the gas in a membrane with density, whose table begins at `at`.
fn filling(
    top: &Table,
    at: usize,
    pressure: Option<History>,
    gas: Option<(f64, Vessel)>,
) -> Option<Filling> {
    match (pressure, gas) {
        (Some(pressure), None) => Some(Filling::Pressure(pressure)),
        (None, Some((contents, vessel))) => Some(Filling::Gas { contents, vessel }),
        (both, _) => {
            let count = if both.is_some() {
                "both are"
            } else {
                "none is"
            };
            let hint = format!(
                "{count} given: a membrane in motion has one of [loads] pressure and [gas] contents"
            );
            let allowed = "a membrane with a pressure, or with gas";
            refuse(top, at, FaultKind::Conflict, allowed, hint)
        }
    }
}

/// The gas below a piston.
fn gas_below(top: &Table, gas: Option<(f64, Vessel)>) -> Option<(f64, Vessel)> {
    if gas.is_none() {
        let hint = "add `[gas]` with `contents = 200.0`, the gas below the piston".to_owned();
        let allowed = "a table with contents, volume, outside";
        let reader = top.reader;
        reader.record(FaultKind::Missing, top.at, "gas", None, allowed, Some(hint));
    }
    gas
}
