//! Reader of unloaded shapes by their geometry: a helix, an arc of a circle, or a curve through points.

use super::fields::{ARC, CENTRELINE, COIL};
use super::load_file::{Columns, columns, rows};
use super::phrases::Short;
use super::ranges::VALUE;
use super::table::{Absent, Table};
use crate::scene::{FaultKind, Rest};
use crate::section::Centreline;
use nalgebra::Vector3;
use std::f64::consts::TAU;
use toml::Spanned;
use toml::de::DeValue;

/// Relative difference of lengths that count as equal: people round.
const AGREE: f64 = 1e-6;
/// Relative difference of the length of the rod from that of a curve through points, up to which the curve is scaled.
const SCALED: f64 = 0.02;
/// Columns of a file of points.
const AXES: [&str; 3] = ["x", "y", "z"];

/// An unloaded shape.
pub(super) struct RestShape {
    pub rest: Rest,
    /// Length of a rod of this shape.
    pub length: f64,
    /// The curve through given points, if the shape is one.
    pub centreline: Option<Centreline>,
}

/// Reads `helix`, `arc` or `centreline` of `[rod.rest]`. The result is `Some(None)` without these. A given length of
/// the rod must agree with the shape.
pub(super) fn rest_shape(
    rod: &Table,
    table: &Table,
    length: Option<f64>,
) -> Option<Option<RestShape>> {
    let given = table.given(&["helix", "arc", "centreline"]);
    let Some(name) = given.first().copied() else {
        return Some(None);
    };
    let mut alone = true;
    for other in table.given(&["arc", "centreline", "curvature", "twist"]) {
        if other != name {
            let hint = "a shape says all strains of the unloaded rod: keep one of them";
            table.conflict(other, &[name], hint);
            alone = false;
        }
    }
    let shape = match name {
        "helix" => helix(rod, table, length),
        "centreline" => centreline(rod, table, length),
        _ => arc(rod, table, length),
    };
    shape.filter(|_| alone).map(Some)
}

/// Flexure about d2 and twist.
fn strains(curvature: f64, twist: f64) -> Rest {
    Rest {
        curvature: [0.0.into(), curvature.into()],
        twist: twist.into(),
    }
}

/// The length of the shape; a fault if the length of the rod is another.
fn agreed(rod: &Table, shape: f64, length: Option<f64>, by: &str) -> Option<f64> {
    match length {
        Some(length) if !((shape - length).abs() <= AGREE * shape) => {
            let allowed = format!("{}, the length of the unloaded shape", Short(shape));
            let hint = format!("it follows from {by}: leave the length out, or one of these");
            rod.refuse(FaultKind::Conflict, "length", allowed, hint)
        }
        Some(length) => Some(length),
        None => Some(shape),
    }
}

fn helix(rod: &Table, rest: &Table, length: Option<f64>) -> Option<RestShape> {
    let allowed = "a table such as { radius = 0.02, pitch = 0.05, turns = 4.0 }";
    let table = (rest.reader).table(&rest.field("helix"), rest.get("helix")?, &COIL, allowed)?;
    let (radius, pitch) = (table.number("radius"), table.number("pitch"));
    let (turns, left) = (table.optional("turns"), table.flag("left"));
    let (radius, pitch, turns, left) = (radius?, pitch?, turns?, left?);
    if left && pitch < 0.0 {
        let hint = "left = true, or a negative pitch, is a left-handed helix: keep one of them";
        return table.refuse(FaultKind::Conflict, "pitch", "> 0 beside left = true", hint);
    }
    let rise = pitch / TAU * if left { -1.0 } else { 1.0 };
    let turn = radius.hypot(rise);
    let length = match (turns, length) {
        (Some(turns), _) => agreed(rod, TAU * turns * turn, length, "radius, pitch and turns")?,
        (None, Some(length)) => length,
        (None, None) => {
            table.missing(
                "turns",
                "a number > 0; or the length of the rod",
                "turns = 4.0",
            );
            return None;
        }
    };
    let rest = strains(radius / turn / turn, rise / turn / turn);
    Some(RestShape {
        rest,
        length,
        centreline: None,
    })
}

fn arc(rod: &Table, rest: &Table, length: Option<f64>) -> Option<RestShape> {
    let allowed = "a table such as { radius = 0.5, angle = 1.5 }";
    let table = (rest.reader).table(&rest.field("arc"), rest.get("arc")?, &ARC, allowed)?;
    let (radius, angle) = (table.optional("radius"), table.optional("angle"));
    let degrees = table.optional("angle_degrees");
    let (radius, angle, degrees) = (radius?, angle?, degrees?);
    if angle.is_some() && degrees.is_some() {
        table.conflict("angle_degrees", &["angle"], "keep one of them");
        return None;
    }
    let angle = angle.or(degrees.map(f64::to_radians));
    if angle == Some(0.0) {
        let name = if degrees.is_some() {
            "angle_degrees"
        } else {
            "angle"
        };
        let hint = "a straight rod needs no shape";
        return table.refuse(FaultKind::Value, name, "an angle that is not 0", hint);
    }
    let (curvature, length) = match (radius, angle, length) {
        (Some(radius), Some(angle), _) => {
            let length = agreed(rod, radius * angle.abs(), length, "radius and angle")?;
            (angle / length, length)
        }
        (Some(radius), None, Some(length)) => (radius.recip(), length),
        (None, Some(angle), Some(length)) => (angle / length, length),
        (None, _, _) => {
            let allowed = "a number > 0; or angle with the length of the rod";
            table.missing("radius", allowed, "radius = 0.5");
            return None;
        }
        (Some(_), None, None) => {
            let allowed = "an angle in radians; or the length of the rod";
            table.missing("angle", allowed, "angle = 1.5");
            return None;
        }
    };
    let rest = strains(curvature, 0.0);
    Some(RestShape {
        rest,
        length,
        centreline: None,
    })
}

/// A curve through or near points.
fn centreline(rod: &Table, rest: &Table, length: Option<f64>) -> Option<RestShape> {
    let (field, value) = (rest.field("centreline"), rest.get("centreline")?);
    let reader = rest.reader;
    let mut pieces = None;
    let (mut normal, mut twist) = (None, 0.0);
    let names: Vec<String> = AXES.iter().map(|name| (*name).to_owned()).collect();
    let points = match value.get_ref() {
        DeValue::String(_) => from_file(rest, &field, value, &names)?,
        DeValue::Array(_) => listed(rest, &field, value)?,
        _ => {
            let allowed = "a name of a file, rows [x, y, z], or a table such as { file = \"curve.csv\", normal = [0.0, 0.0, 1.0] }";
            let table = reader.table(&field, value, &CENTRELINE, allowed)?;
            let columns = columns(&table, &AXES, "3 columns");
            let normal_given = if table.has("normal") {
                table.vector("normal").map(Some)
            } else {
                Some(None)
            };
            let count = if table.has("pieces") {
                table.count("pieces").map(Some)
            } else {
                Some(None)
            };
            let (turn, columns) = (table.number("twist"), columns?);
            let points = match table.given(&["file", "points"]).as_slice() {
                ["file"] => {
                    table.read("file", "a name in quotes", Absent::Fault, |field, value| {
                        from_file(&table, field, value, &columns)
                    })
                }
                ["points"] => table.read("points", ROWS, Absent::Fault, |field, value| {
                    listed(&table, field, value)
                }),
                [] => {
                    let allowed = "the name of a file; or points, rows [x, y, z]";
                    table.missing("file", allowed, "file = \"curve.csv\"");
                    None
                }
                _ => {
                    table.conflict("points", &["file"], "keep one of them");
                    None
                }
            };
            (pieces, normal, twist) = (count?, normal_given?, turn?);
            points?
        }
    };
    let made = Centreline::new(&points, pieces, normal.map(Vector3::from), twist);
    let (centreline, found) = match made {
        Ok(made) => made,
        Err(why) => {
            let allowed = "4 points or more of a smooth curve";
            return reader.refuse(FaultKind::Value, &field, value, allowed, why.to_string());
        }
    };
    let own = centreline.length;
    let length = match length {
        Some(length) if !((length - own).abs() <= SCALED * own) => {
            let allowed = format!("{}, the length of the curve, to two percent", Short(own));
            let hint = "the curve of `centreline` is longer or shorter: leave the length out, or scale the points";
            return rod.refuse(FaultKind::Conflict, "length", allowed, hint);
        }
        Some(length) => length,
        None => own,
    };
    // A rod of another length has the same shape, a little larger or smaller.
    let factor = length / own;
    let scaled = |along: crate::section::Along| along.stretched(factor).times(factor.recip());
    let rest = Rest {
        curvature: found.curvature.map(scaled),
        twist: scaled(found.twist),
    };
    Some(RestShape {
        rest,
        length,
        centreline: Some(centreline),
    })
}

/// Words for a list of points.
const ROWS: &str = "4 rows [x, y, z] or more";

fn listed(table: &Table, field: &str, value: &Spanned<DeValue>) -> Option<Vec<Vector3<f64>>> {
    let reader = table.reader;
    let row = |field: &str, value: &Spanned<DeValue>| {
        let number = |field: &str, value: &_| reader.number(field, value, &VALUE);
        reader.array(field, value, "a row [x, y, z]", &number)
    };
    let rows: Vec<[f64; 3]> = reader.all(field, value, ROWS, &row)?;
    Some(rows.into_iter().map(Vector3::from).collect())
}

fn from_file(
    table: &Table,
    field: &str,
    value: &Spanned<DeValue>,
    names: &[String],
) -> Option<Vec<Vector3<f64>>> {
    let kind = Columns { names, grow: false };
    let rows = rows(table, field, value, &kind)?;
    Some(
        rows.iter()
            .map(|row| Vector3::from_column_slice(row))
            .collect(),
    )
}
