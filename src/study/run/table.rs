//! The tables of a run: trajectory and strain field.

use super::ModelKind;
use super::prepared::Prepared;
use super::record::Moment;
use crate::error::Result;
use crate::motion::Ledger;
use crate::scene::{Scene, Units};
use crate::study::{Cell, Column, Table};

/// Name of a branch's trajectory, without extension.
pub fn trajectory_name(branch: usize) -> String {
    name("trajectory", branch)
}

/// Name of a table of a branch.
fn name(table: &str, branch: usize) -> String {
    match branch {
        0 => table.to_owned(),
        _ => format!("{table}-{branch}"),
    }
}

/// The trajectory of a scene of one rod before its run: names, units and meanings of its columns.
///
/// # Errors
/// Those of [`Prepared::new`].
pub fn columns(scene: &Scene) -> Result<Table> {
    Ok(trajectory(&Prepared::new(scene)?, 0))
}

/// The trajectory of a branch, without rows.
pub(super) fn trajectory(prepared: &Prepared, branch: usize) -> Table {
    let u = prepared.units;
    let axes: &[(&str, &str)] = match prepared.kind() {
        ModelKind::Sheet | ModelKind::Planar => &[("x", "x"), ("y", "y")],
        ModelKind::ElasticSpace | ModelKind::Space => &[("x", "x"), ("y", "y"), ("z", "z")],
    };
    let vector = |prefix: &str, unit: &'static str, meaning: &str| -> Vec<Column> {
        let name = |axis: &str| format!("{prefix}{axis}");
        let column = |(axis, along): &(&str, &str)| {
            Column::reals(name(axis), unit, format!("{meaning}, along {along}"))
        };
        axes.iter().map(column).collect()
    };
    let mut columns = vec![Column::reals("t", u.time(), "time")];
    columns.extend(vector("", u.length(), "position of the end"));
    let velocity = vector("v", u.velocity(), "velocity of the end");
    let force = vector("f", u.force(), "force of the rod on the body");
    if prepared.kind().in_space() {
        let part = |name, which| {
            Column::reals(
                name,
                "",
                format!("quaternion of the end's directors, {which}"),
            )
        };
        columns.extend([
            part("qw", "scalar part"),
            part("qx", "along x"),
            part("qy", "along y"),
            part("qz", "along z"),
        ]);
        columns.extend(velocity);
        let per_time = match u.time() {
            "" => "",
            _ => "rad/s",
        };
        columns.extend(vector(
            "w",
            per_time,
            "angular velocity of the end's directors",
        ));
        columns.extend(force);
        columns.extend(vector("m", u.couple(), "couple of the rod on the body"));
        if prepared.grooved {
            columns.extend(vector("g", u.force(), "force of the groove on the body"));
        }
    } else {
        columns.extend(velocity);
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
        columns.extend(force);
    }
    columns.extend(ledger_columns(u));
    if prepared.is_heavy() {
        columns.push(rod_kinetic(u));
    }
    if prepared.kind() == ModelKind::ElasticSpace {
        let meaning = "Morse index of the rod with its end held: 0 is stable";
        columns.push(Column::integers("index", meaning));
    }
    Table::new(trajectory_name(branch), columns)
}

/// Column of the kinetic energy of a rod with mass, a part of `total`.
pub(in crate::study) fn rod_kinetic(units: Units) -> Column {
    let meaning = "kinetic energy of the rod, one more term of the total";
    Column::reals("rod_kinetic", units.energy(), meaning)
}

/// Energy columns of a state.
pub(in crate::study) fn ledger_columns(units: Units) -> [Column; 6] {
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
pub(in crate::study) fn ledger_cells(ledger: &Ledger, total: f64) -> [Cell; 6] {
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

/// The row of a state.
pub(super) fn row((kind, heavy): (ModelKind, bool), at: &Moment) -> Vec<Cell> {
    let real = Cell::Real;
    let axes = if kind.in_space() { 3 } else { 2 };
    let mut cells = vec![real(at.t)];
    let r = at.pose.translation.vector;
    cells.extend(r.iter().take(axes).copied().map(real));
    if kind.in_space() {
        let q = at.pose.rotation;
        cells.extend([q.w, q.i, q.j, q.k].map(real));
        let vectors = [at.velocity, at.angular_velocity, at.force, at.couple];
        for v in vectors.iter().chain(&at.groove) {
            cells.extend(v.iter().copied().map(real));
        }
    } else {
        cells.extend(at.velocity.iter().take(axes).copied().map(real));
        let labels = at.labels.as_ref();
        cells.extend([
            labels.map(|l| l.lambda()).into(),
            labels.map(|l| l.p).into(),
            labels.map(|l| l.w).into(),
            labels.map(|l| l.sheet.mode as usize).into(),
            labels.map(|l| l.sheet.sign.as_str()).into(),
            labels.map(|l| l.index).into(),
        ]);
        cells.extend(at.force.iter().take(axes).copied().map(real));
    }
    cells.extend(ledger_cells(&at.ledger, at.total));
    if heavy {
        cells.push(real(at.ledger.rod_kinetic));
    }
    if kind == ModelKind::ElasticSpace {
        cells.push(at.index.into());
    }
    cells
}

/// The strain field of a branch over time and arclength, without rows.
pub(super) fn strain(prepared: &Prepared, branch: usize) -> Table {
    let u = prepared.units;
    let mut columns = vec![
        Column::reals("t", u.time(), "time"),
        Column::reals("s", u.length(), "arclength from the clamp, unstrained"),
    ];
    for (name, i) in prepared.strains() {
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
