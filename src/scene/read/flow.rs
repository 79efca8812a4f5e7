//! Reader of flows in tubes: `[tube]` with `[run]`.

use super::fields::{
    DOWNSTREAM, FLUID, IN_TIME, LUMPED, OUTSIDE, OUTSIDE_PRESSURE, RUN, START, START_AREA,
    TUBE_TABLE, UPSTREAM,
};
use super::loads::size;
use super::ranges::{FINITE, POSITIVE, Rule, VALUE};
use super::scene::{default, part, units};
use super::table::{Absent, Table};
use super::wall::{refuse_tube, tube_wall};
use crate::flow::{FlowVolumes, Reservoir};
use crate::scene::{
    FaultKind, FlowEndScene, FlowMedium, FlowScene, FlowStart, History, Lumped, OutsidePressure,
    Scene, SceneKind, TubeFlow, WallFriction,
};

/// Reads every field before returning `None`, for a complete list of faults.
pub(super) fn flow(top: &Table) -> Option<Scene> {
    let units = units(top);
    let table = part(top, &TUBE_TABLE).flatten();
    let run = part(top, &RUN).flatten().and_then(|table| {
        let (duration, samples) = (table.number("duration"), table.count("samples"));
        let step = table.optional("time_step");
        Some((duration?, samples?, step?))
    });
    let table = table?;
    let wall = tube_wall(&table);
    if table.number("tension")? != 0.0 {
        let hint = "the tension along the tube is not computed: leave it out";
        return table.refuse(FaultKind::Value, "tension", "0", hint);
    }
    let medium = if table.has("lumped") {
        lumped(top, &table).map(FlowMedium::Lumped)
    } else {
        with_length(top, &table).map(FlowMedium::Tube)
    };
    let (duration, samples, time_step) = run?;
    let scene = FlowScene {
        wall: wall?,
        medium: medium?,
        duration,
        samples,
        time_step,
    };
    if let Err(error) = can_start(&scene) {
        let allowed = "a tube with a flow that can start";
        return refuse_tube(top, table.at, allowed, error.to_string());
    }
    Some(Scene::without_rods(units?, SceneKind::Flow(scene)))
}

/// Makes the flow and its first state.
fn can_start(scene: &FlowScene) -> crate::error::Result<()> {
    if let (Some(tube), FlowMedium::Tube(given)) = (scene.tube()?, &scene.medium) {
        FlowVolumes::new(&tube, given.cells)?;
    }
    if let (Some(resistor), FlowMedium::Lumped(given)) = (scene.resistor()?, &scene.medium) {
        let equilibrium = resistor.equilibrium()?;
        resistor.law.check(given.area.unwrap_or(equilibrium.area))?;
    }
    Ok(())
}

/// Reads a tube with a length.
fn with_length(top: &Table, table: &Table) -> Option<TubeFlow> {
    let (length, cells) = (table.optional("length"), table.count("cells"));
    let length = length?;
    let Some(length) = length else {
        table.missing("length", "a finite number > 0", "length = 0.1");
        return None;
    };
    let fluid = part(top, &FLUID).flatten();
    let fluid = match &fluid {
        Some(table) => of_fluid(table),
        None => {
            let hint = "add `[fluid]` with `density = 1000.0`".to_owned();
            let allowed = "a table with density, viscosity, friction";
            top.reader.record(
                FaultKind::Missing,
                top.at,
                "fluid",
                None,
                allowed,
                Some(hint),
            );
            None
        }
    };
    let nothing = OutsidePressure::Uniform(History::Constant(0.0));
    let outside = default(part(top, &OUTSIDE), nothing, |table| outside(table, length));
    let upstream = default(part(top, &UPSTREAM), FlowEndScene::Open, end);
    let downstream = default(part(top, &DOWNSTREAM), FlowEndScene::Open, end);
    let start = default(part(top, &START), FlowStart::Uniform([1.0, 0.0]), |table| {
        start(table, length)
    });
    let (density, friction) = fluid?;
    Some(TubeFlow {
        length,
        cells: cells?,
        density,
        friction,
        outside: outside?,
        ends: [upstream?, downstream?],
        start: start?,
    })
}

fn of_fluid(table: &Table) -> Option<(f64, WallFriction)> {
    let (density, viscosity) = (table.optional("density"), table.optional("viscosity"));
    let words = ["none", "linear", "darcy"];
    let word = if table.has("friction") {
        table.word("friction", &words).map(Some)
    } else {
        Some(None)
    };
    let (density, viscosity, word) = (density?, viscosity?, word?);
    let Some(density) = density else {
        table.missing("density", "a finite number > 0", "density = 1000.0");
        return None;
    };
    let friction = match (word, viscosity) {
        (Some("none"), _) | (None, None) => WallFriction::None,
        (Some("darcy"), Some(viscosity)) => WallFriction::Darcy(viscosity),
        (_, Some(viscosity)) => WallFriction::Linear(viscosity),
        (Some(_), None) => {
            table.missing(
                "viscosity",
                "a finite number > 0, for the friction",
                "viscosity = 1e-6",
            );
            return None;
        }
    };
    Some((density, friction))
}

fn outside(table: &Table, length: f64) -> Option<OutsidePressure> {
    let nothing = OutsidePressure::Uniform(History::Constant(0.0));
    table.read("pressure", "", Absent::Or(nothing), |field, value| {
        let allowed =
            "a number, a table { table = [[x, p], ..] } along the tube, or a history in time";
        if !value.get_ref().is_table() {
            let number = table.reader.number(field, value, &VALUE)?;
            return Some(OutsidePressure::Uniform(History::Constant(number)));
        }
        let inner = table
            .reader
            .table(field, value, &OUTSIDE_PRESSURE, allowed)?;
        if inner.has("table") {
            return along(&inner, length, &FINITE).map(OutsidePressure::Table);
        }
        size(&inner).map(OutsidePressure::Uniform)
    })
}

/// Reads the rows \[x, value\] of a `table` along the tube.
fn along(table: &Table, length: f64, rule: &'static Rule) -> Option<Vec<[f64; 2]>> {
    let reader = table.reader;
    let allowed = "rows [x, value] with x growing from 0 to the length of the tube";
    table.read("table", allowed, Absent::Fault, |field, value| {
        let row = |field: &str, value| {
            let number = |field: &str, value: &_| reader.number(field, value, &FINITE);
            reader.array(field, value, "a row [x, value]", &number)
        };
        let rows: Vec<[f64; 2]> = reader.all(field, value, allowed, &row)?;
        let grows = rows.len() > 1 && rows.windows(2).all(|pair| pair[0][0] < pair[1][0]);
        let covers =
            grows && rows[0][0] <= 0.0 && rows[rows.len() - 1][0] >= length * (1.0 - 1e-12);
        if covers && rows.iter().all(|row| (rule.holds)(row[1])) {
            return Some(rows);
        }
        let hint = format!(
            "the tube is from 0 to {length}; every value is {}",
            rule.allowed
        );
        table.refuse(FaultKind::Value, "table", allowed, hint)
    })
}

/// Reads a number or a history in time.
pub(super) fn in_time(table: &Table, name: &str) -> Option<Option<History>> {
    table.maybe(name, |field, value| {
        if !value.get_ref().is_table() {
            return table
                .reader
                .number(field, value, &VALUE)
                .map(History::Constant);
        }
        let allowed =
            "a number, or a history in time such as { amplitude = 100.0, frequency = 2.0 }";
        size(&table.reader.table(field, value, &IN_TIME, allowed)?)
    })
}

fn end(table: &Table) -> Option<FlowEndScene> {
    let (pressure, flow) = (in_time(table, "pressure"), in_time(table, "flow"));
    let area = if table.knows("area") {
        table.optional("area")
    } else {
        Some(None)
    };
    let closed = table.flag("closed");
    let (resistance, inertance) = (table.number("resistance"), table.number("inertance"));
    let recovery = table.number("recovery");
    let (pressure, flow, area, closed) = (pressure?, flow?, area?, closed?);
    let (resistance, inertance, recovery) = (resistance?, inertance?, recovery?);
    let given = [pressure.is_some(), flow.is_some(), closed];
    if given.iter().filter(|given| **given).count() > 1 {
        let hint = "an end has a pressure, or a flow, or is closed: keep one of them";
        let name = if closed { "closed" } else { "flow" };
        table.fault(FaultKind::Conflict, name, "alone", hint);
        return None;
    }
    if let (Some(_), false) = (area, matches!(flow, Some(History::Constant(_)))) {
        let hint = "upstream an area goes with a flow that is a number and faster than waves; else leave it out: the \
                    tube sets it";
        return table.refuse(FaultKind::Conflict, "area", "with flow", hint);
    }
    Some(match (pressure, flow, closed) {
        (Some(pressure), ..) => FlowEndScene::Reservoir(Reservoir {
            pressure,
            resistance,
            inertance,
            recovery,
        }),
        (_, Some(History::Constant(flow)), _) if area.is_some() => {
            FlowEndScene::Supercritical { flow, area: area? }
        }
        (_, Some(flow), _) => FlowEndScene::Flow(flow),
        (_, _, true) => FlowEndScene::Closed,
        (None, None, false) => FlowEndScene::Open,
    })
}

fn start(table: &Table, length: f64) -> Option<FlowStart> {
    let velocity = table.number("velocity");
    let pair = |name: &str| {
        table.maybe(name, |field, value| {
            let number = |field: &str, value: &_| table.reader.number(field, value, &FINITE);
            table
                .reader
                .array(field, value, "two numbers, [area, velocity]", &number)
        })
    };
    let (left, right, at) = (pair("left"), pair("right"), table.optional("at"));
    let rows = table.read("area", "", Absent::Or(Ok(1.0)), |field, value| {
        if !value.get_ref().is_table() {
            return table.reader.number(field, value, &POSITIVE).map(Ok);
        }
        let allowed = "a number, or a table { table = [[x, area], ..] } along the tube";
        let inner = table.reader.table(field, value, &START_AREA, allowed)?;
        along(&inner, length, &POSITIVE).map(Err)
    });
    let (velocity, left, right, at, area) = (velocity?, left?, right?, at?, rows?);
    let (left, right): ([f64; 2], [f64; 2]) = match (left, right) {
        (Some(left), Some(right)) => (left, right),
        (None, None) => {
            return Some(match area {
                Ok(area) => FlowStart::Uniform([area, velocity]),
                Err(rows) => FlowStart::Table(rows, velocity),
            });
        }
        (Some(_), None) => {
            table.missing(
                "right",
                "the state right of `at`, with left",
                "right = [0.5, 0.0]",
            );
            return None;
        }
        (None, Some(_)) => {
            table.missing(
                "left",
                "the state left of `at`, with right",
                "left = [1.0, 0.0]",
            );
            return None;
        }
    };
    for name in ["area", "velocity"] {
        if table.has(name) {
            let hint = "left and right are area and velocity: leave this out";
            return table.refuse(
                FaultKind::Conflict,
                name,
                "left out beside left and right",
                hint,
            );
        }
    }
    let at = at.unwrap_or(0.5 * length);
    if !(at <= length) {
        let allowed = format!("at most the length of the tube, {length}");
        return table.refuse(FaultKind::Value, "at", allowed, None);
    }
    Some(FlowStart::Riemann { left, right, at })
}

/// Reads a Starling resistor.
fn lumped(top: &Table, table: &Table) -> Option<Lumped> {
    let inner = table.inner("lumped", &LUMPED)?;
    let [l1, l2, lam, r1, r2, chi, outside] =
        ["l1", "l2", "lam", "r1", "r2", "chi", "E"].map(|name| inner.number(name));
    let number = |end: &Table| {
        let pressure = in_time(end, "pressure")?;
        match pressure {
            Some(History::Constant(pressure)) => Some(pressure),
            None => Some(0.0),
            Some(_) => end.refuse(
                FaultKind::Value,
                "pressure",
                "a number, for a lumped tube",
                None,
            ),
        }
    };
    let upstream = part(top, &UPSTREAM).flatten();
    let upstream = match &upstream {
        Some(end) => number(end),
        None => {
            let hint = "add `[upstream]` with `pressure = 8.0`".to_owned();
            let allowed = "a table with pressure";
            top.reader.record(
                FaultKind::Missing,
                top.at,
                "upstream",
                None,
                allowed,
                Some(hint),
            );
            None
        }
    };
    let downstream = default(part(top, &DOWNSTREAM), 0.0, number);
    let area = default(part(top, &START), None, |table| {
        table.maybe("area", |field, value| {
            table.reader.number(field, value, &POSITIVE)
        })
    });
    Some(Lumped {
        inertance: [l1?, l2?],
        resistance: [r1?, r2?],
        volume: lam?,
        loss: chi?,
        outside: outside?,
        pressure: [upstream?, downstream?],
        area: area?,
    })
}
