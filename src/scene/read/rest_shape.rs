//! Reader of unloaded shapes by their geometry: a helix, or an arc of a circle.

use super::fields::{ARC, COIL};
use super::phrases::Short;
use super::table::Table;
use crate::scene::{FaultKind, Rest};
use std::f64::consts::TAU;

/// Relative difference of lengths that count as equal: people round.
const AGREE: f64 = 1e-6;

/// An unloaded shape.
pub(super) struct RestShape {
    pub rest: Rest,
    /// Length of a rod of this shape.
    pub length: f64,
}

/// Reads `helix` or `arc` of `[rod.rest]`. The result is `Some(None)` without either. A given length of the rod must
/// agree with the shape.
pub(super) fn rest_shape(
    rod: &Table,
    table: &Table,
    length: Option<f64>,
) -> Option<Option<RestShape>> {
    let given = table.given(&["helix", "arc"]);
    let Some(name) = given.first().copied() else {
        return Some(None);
    };
    let mut alone = true;
    for other in table.given(&["arc", "curvature", "twist"]) {
        if other != name {
            let hint = "a shape says all strains of the unloaded rod: keep one of them";
            table.conflict(other, &[name], hint);
            alone = false;
        }
    }
    let shape = match name {
        "helix" => helix(rod, table, length),
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
    Some(RestShape { rest, length })
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
    Some(RestShape { rest, length })
}
