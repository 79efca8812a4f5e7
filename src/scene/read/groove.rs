//! Reader of grooves.

use super::ends::direction;
use super::fields::{ASSEMBLY, Form, Kinds, Need, SPACE, Spec, field, spec};
use super::ranges::{SIZE, VALUE};
use super::reader::Reader;
use super::table::Table;
use crate::scene::{FaultKind, Groove, GrooveCircle, GrooveLine};
use toml::Spanned;
use toml::de::DeValue;

const ON: Kinds = SPACE | ASSEMBLY;
#[rustfmt::skip]
pub(super) static GROOVE: Spec = spec("groove", &[
    field("line", ON, Form::Table(&LINE), "", Need::No, "A straight line without ends."),
    field("circle", ON, Form::Table(&CIRCLE), "", Need::No, "A circle."),
    field("spline", ON, Form::Rows(3), "m", Need::No, "Points, from 3 to 200: a curve through them of degree 5, smooth to its fourth derivative. The body stops the run at an end of it."),
    field("closed", ON, Form::Flag, "", Need::Or("false"), "Of a spline: joined from its last point to its first, without ends."),
]);
#[rustfmt::skip]
static LINE: Spec = spec("body.groove.line", &[
    field("point", ON, Form::Vector(&VALUE), "m", Need::Or("[0.0, 0.0, 0.0]"), "A point of the line."),
    field("direction", ON, Form::Vector(&VALUE), "", Need::Yes("direction = [1.0, 0.0, 0.0]"), "Direction, not 0, of any length."),
]);
#[rustfmt::skip]
static CIRCLE: Spec = spec("body.groove.circle", &[
    field("centre", ON, Form::Vector(&VALUE), "m", Need::Or("[0.0, 0.0, 0.0]"), "Its centre."),
    field("axis", ON, Form::Vector(&VALUE), "", Need::Yes("axis = [0.0, 0.0, 1.0]"), "Across its plane, not 0, of any length."),
    field("radius", ON, Form::Number(&SIZE), "m", Need::Yes("radius = 0.5"), "Its radius."),
]);

/// Reads the groove of a body.
pub(super) fn groove(body: &Table) -> Option<Option<Groove>> {
    if !body.has("groove") {
        return Some(None);
    }
    let table = body.inner("groove", &GROOVE)?;
    let given = table.given(&["line", "circle", "spline"]);
    let [one] = given.as_slice() else {
        return match given.as_slice() {
            [first, .., last] => {
                table.conflict(last, &[*first], "keep one of them");
                None
            }
            _ => body.refuse(
                FaultKind::Value,
                "groove",
                "a table with one of line, circle and spline",
                "write `groove = { line = { direction = [1.0, 0.0, 0.0] } }`",
            ),
        };
    };
    if table.has("closed") && *one != "spline" {
        let hint = "a line has no ends, and a circle is closed";
        return table.refuse(
            FaultKind::Conflict,
            "closed",
            "left out of a line or a circle",
            hint,
        );
    }
    let groove = match *one {
        "line" => line(&table.inner("line", &LINE)?).map(|line| Groove::Line { line }),
        "circle" => {
            circle(&table.inner("circle", &CIRCLE)?).map(|circle| Groove::Circle { circle })
        }
        _ => spline(&table),
    }?;
    if let Err(why) = groove.curve() {
        let hint = why.to_string();
        return body.refuse(FaultKind::Value, "groove", "a curve that can be made", hint);
    }
    Some(Some(groove))
}

fn line(table: &Table) -> Option<GrooveLine> {
    let (point, direction) = (table.vector("point"), direction(table, "direction"));
    Some(GrooveLine {
        point: point?,
        direction: direction?,
    })
}

fn circle(table: &Table) -> Option<GrooveCircle> {
    let (centre, axis) = (table.vector("centre"), direction(table, "axis"));
    let radius = table.number("radius");
    Some(GrooveCircle {
        centre: centre?,
        axis: axis?,
        radius: radius?,
    })
}

fn spline(table: &Table) -> Option<Groove> {
    let allowed = "an array of points [x, y, z], from 3 to 200";
    let reader: &Reader = table.reader;
    let point = |field: &str, value: &Spanned<DeValue>| reader.point(field, value, &VALUE);
    let points = table.maybe("spline", |field, value| {
        let points = reader.all(field, value, allowed, &point)?;
        if !(3..=200).contains(&points.len()) {
            let hint = format!("there are {}", points.len());
            return reader.refuse(FaultKind::Value, field, value, allowed, hint);
        }
        Some(points)
    });
    let closed = table.flag("closed");
    Some(Groove::Spline {
        spline: points??,
        closed: closed?,
    })
}
