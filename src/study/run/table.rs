//! The tables of a run: trajectory and strain field.

use super::contacts;
use super::header::RunHeader;
use super::joints;
use super::moment::{BodyMoment, Moment};
use super::prepared::Prepared;
use crate::error::Result;
use crate::motion::Ledger;
use crate::scene::{Scene, Units};
use crate::study::stations::{self, StationValues};
use crate::study::{Cell, Column, Table};
use nalgebra::Vector3;

/// Name of a branch's trajectory, without extension.
pub fn trajectory_name(branch: usize) -> String {
    name("trajectory", branch)
}

/// Name of a table of a branch.
pub(super) fn name(table: &str, branch: usize) -> String {
    match branch {
        0 => table.to_owned(),
        _ => format!("{table}-{branch}"),
    }
}

/// The trajectory of a scene of rods before its run: names, units and meanings of its columns.
///
/// # Errors
/// Those of [`Prepared::new`].
pub fn columns(scene: &Scene) -> Result<Table> {
    Ok(trajectory(&Prepared::new(scene)?.header, 0))
}

/// The trajectory of a branch, without rows.
pub(super) fn trajectory(header: &RunHeader, branch: usize) -> Table {
    let u = header.units;
    let mut columns = vec![Column::reals("t", u.time(), "time")];
    if header.is_assembly() {
        columns.extend(bodies(header));
    } else if header.in_space() {
        columns.extend(end_in_space(header));
    } else {
        columns.extend(end_in_plane(u));
    }
    columns.extend(ledger_columns(u));
    if header.has_contact {
        columns.extend(contacts::columns(header));
    }
    if header.heavy {
        columns.push(rod_kinetic(u));
    }
    columns.extend(index(header).map(|meaning| Column::integers("index", meaning)));
    columns.extend(stations::columns(&header.stations, u, true));
    columns.extend(joints::columns(&header.joints, u));
    Table::new(trajectory_name(branch), columns)
}

/// Meaning of the last column, the Morse index of light rods in space; `None` without this column.
fn index(header: &RunHeader) -> Option<&'static str> {
    if header.is_assembly() {
        Some("Morse indices of the rods with their ends held, added up: 0 is stable")
    } else if header.in_space() && header.is_elastic() {
        Some("Morse index of the rod with its end held: 0 is stable")
    } else {
        None
    }
}

const AXES: [&str; 3] = ["x", "y", "z"];

/// Columns of the components of a vector along these axes.
fn vector(
    axes: &'static [&'static str],
    prefix: &'static str,
    unit: &'static str,
    meaning: &'static str,
) -> impl Iterator<Item = Column> {
    axes.iter().map(move |axis| {
        Column::reals(
            format!("{prefix}{axis}"),
            unit,
            format!("{meaning}, along {axis}"),
        )
    })
}

fn angular_velocity(u: Units) -> &'static str {
    match u.time() {
        "" => "",
        _ => "rad/s",
    }
}

/// Columns of the end of a planar rod, and of the equilibrium that the rod is in or near.
fn end_in_plane(u: Units) -> Vec<Column> {
    let vector = |prefix, unit, meaning| vector(&AXES[..2], prefix, unit, meaning);
    let mut columns: Vec<Column> = vector("", u.length(), "position of the end").collect();
    columns.extend(vector("v", u.velocity(), "velocity of the end"));
    columns.extend([
        Column::reals(
            "lam",
            "",
            "lambda = L sqrt(force/EI) of the equilibrium that the rod is in or near",
        ),
        Column::reals("p", "", "its chart coordinate p, kappa = tanh p"),
        Column::reals("w", "", "its chart coordinate w"),
        Column::integers("mode", "the mode j of its sheet S_j^+-"),
        Column::words("sign", "the sign of its sheet"),
        Column::integers("index", "its Morse index: 0 is stable"),
    ]);
    columns.extend(vector("f", u.force(), "force of the rod on the body"));
    columns
}

/// Columns of the end of one rod in space, and of its base if free, in the order of [`BodyMoment::numbers`].
fn end_in_space(header: &RunHeader) -> Vec<Column> {
    let u = header.units;
    let vector = |prefix, unit, meaning| vector(&AXES, prefix, unit, meaning);
    let mut columns: Vec<Column> = vector("", u.length(), "position of the end").collect();
    let parts = [
        ("qw", "scalar part"),
        ("qx", "along x"),
        ("qy", "along y"),
        ("qz", "along z"),
    ];
    columns.extend(parts.map(|(name, which)| {
        let meaning = format!("quaternion of the end's directors, {which}");
        Column::reals(name, "", meaning)
    }));
    let spin = "angular velocity of the end's directors";
    columns.extend(vector("v", u.velocity(), "velocity of the end"));
    columns.extend(vector("w", angular_velocity(u), spin));
    columns.extend(vector("f", u.force(), "force of the rod on the body"));
    columns.extend(vector("m", u.couple(), "couple of the rod on the body"));
    let groove = vector("g", u.force(), "force of the groove on the body");
    columns.extend(groove.filter(|_| header.bodies[0].is_grooved()));
    if header.rods[0].grounds[0].is_none() {
        columns.extend(free_base(u));
    }
    columns
}

/// Columns of a base that nothing holds.
fn free_base(u: Units) -> impl Iterator<Item = Column> {
    let position = vector(&AXES, "base_", u.length(), "position of the free base");
    let turn = ["base_qw", "base_qx", "base_qy", "base_qz"];
    let turn =
        turn.map(|name| Column::reals(name, "", "quaternion of the directors of the free base"));
    let velocity = vector(&AXES, "base_v", u.velocity(), "velocity of the free base");
    let spin = "angular velocity of the directors of the free base";
    let spin = vector(&AXES, "base_w", angular_velocity(u), spin);
    position.chain(turn).chain(velocity).chain(spin)
}

/// Columns of the bodies of an assembly, each in the order of [`BodyMoment::numbers`].
fn bodies(header: &RunHeader) -> Vec<Column> {
    let u = header.units;
    let groups = [
        (&["x", "y", "z"][..], u.length(), "position"),
        (&["qw", "qx", "qy", "qz"], "", "quaternion"),
        (&["vx", "vy", "vz"], u.velocity(), "velocity"),
        (&["wx", "wy", "wz"], angular_velocity(u), "angular velocity"),
    ];
    let mut columns = Vec::new();
    for body in &header.bodies {
        let name = &body.name;
        for (parts, unit, what) in groups {
            columns.extend(parts.iter().map(|part| {
                let meaning = format!("{what} of the frame of {name}, in the world");
                Column::reals(format!("{name}.{part}"), unit, meaning)
            }));
        }
        let force = ["groove_x", "groove_y", "groove_z"].iter().map(|part| {
            let meaning = format!("force of the groove on {name}, in the world");
            Column::reals(format!("{name}.{part}"), u.force(), meaning)
        });
        columns.extend(force.filter(|_| body.is_grooved()));
    }
    columns
}

/// Column of the kinetic energy of a rod with mass, a part of `total`.
fn rod_kinetic(units: Units) -> Column {
    let meaning = "kinetic energy of the rod, one more term of the total";
    Column::reals("rod_kinetic", units.energy(), meaning)
}

/// Energy columns of a state.
fn ledger_columns(units: Units) -> [Column; 6] {
    let energy = |name, meaning| Column::reals(name, units.energy(), meaning);
    [
        energy("kinetic", "kinetic energy of the body"),
        energy("elastic", "energy stored in the rod"),
        energy(
            "potential",
            "potential of gravity and constant loads, 0 where these act at the origin of the world (of one rod in space on a clamp that stands still, at the clamp)",
        ),
        energy("dissipated", "dissipated so far"),
        energy("work", "work of the forces in time so far"),
        energy(
            "total",
            "kinetic + elastic + potential + dissipated - work, which should not change",
        ),
    ]
}

/// Values of [`ledger_columns`].
fn ledger_cells(ledger: &Ledger, total: f64) -> [Cell; 6] {
    [
        ledger.kinetic,
        ledger.elastic,
        ledger.potential,
        ledger.dissipated,
        ledger.work,
        total,
    ]
    .map(Cell::Real)
}

/// The row of a state with the values at its stations and joints.
pub(super) fn row(
    header: &RunHeader,
    at: &Moment,
    stations: &[Option<StationValues>],
    joints: &[f64],
) -> Vec<Cell> {
    let mut cells = vec![Cell::Real(at.t)];
    if header.in_space() {
        let numbers = at.bodies.iter().flat_map(BodyMoment::numbers);
        cells.extend(numbers.map(Cell::Real));
    } else {
        let end = at.end();
        let plane = |v: Vector3<f64>| [v.x, v.y].map(Cell::Real);
        let labels = at.labels.as_ref();
        cells.extend(plane(at.position()));
        cells.extend(plane(end.velocity));
        cells.extend([
            labels.map(|l| l.lambda()).into(),
            labels.map(|l| l.p).into(),
            labels.map(|l| l.w).into(),
            labels.map(|l| l.sheet.mode as usize).into(),
            labels.map(|l| l.sheet.sign.as_str()).into(),
            at.index.into(),
        ]);
        cells.extend(
            end.action
                .into_iter()
                .flat_map(|action| plane(action.force)),
        );
    }
    cells.extend(ledger_cells(&at.ledger, at.total));
    if header.has_contact {
        cells.extend(contacts::cells(header, at.contact.as_ref()));
    }
    if header.heavy {
        cells.push(Cell::Real(at.ledger.rod_kinetic));
    }
    if index(header).is_some() {
        cells.push(at.index.into());
    }
    let values = stations.iter();
    let values = values.flat_map(|values| StationValues::numbers(values.as_ref(), true));
    let known = |x: f64| Some(x).filter(|x| !x.is_nan());
    let values = values.chain(joints.iter().copied());
    cells.extend(values.map(|x| Cell::from(known(x))));
    cells
}

/// The strain field of a branch over time and arclength, without rows.
pub(super) fn strain(header: &RunHeader, branch: usize) -> Table {
    let u = header.units;
    let mut columns = vec![
        Column::reals("t", u.time(), "time"),
        Column::reals("s", u.length(), "arclength from the clamp, unstrained"),
    ];
    for &(name, i) in &header.strains {
        let (unit, meaning) = match i {
            0 | 1 => (u.curvature(), "flexure"),
            2 => (u.curvature(), "twist"),
            3 | 4 => ("", "shear"),
            _ => ("", "stretch"),
        };
        columns.push(Column::reals(name, unit, meaning));
    }
    let power = match u.energy() {
        "" => "",
        _ => "W/m",
    };
    columns.push(Column::reals(
        "dissipation",
        power,
        "power dissipated per length",
    ));
    Table::new(name("strain", branch), columns)
}
