//! Reader of `[[obstacle]]`: fixed bodies that rods do not enter.

use super::assembly::plain_name;
use super::ends::{direction, rotation};
use super::fields::{Form, Kinds, Need, ROTATION, STATICS, Spec, field, spec};
use super::ranges::{NON_NEGATIVE, SIZE, VALUE};
use super::table::{Absent, Table};
use crate::scene::{FaultKind, Obstacle, ObstacleShape};

/// Most obstacles of a scene.
const OBSTACLES: usize = 100;
/// Kinds of scenes with obstacles.
pub(super) const ON: Kinds = STATICS;

#[rustfmt::skip]
pub(super) static OBSTACLE: Spec = spec("obstacle", &[
    field("name", ON, Form::Name, "", Need::Or("\"obstacle1\", \"obstacle2\", ..."), "Name of the obstacle in tables and messages."),
    field("plane", ON, Form::Table(&PLANE), "", Need::No, "The half-space behind a plane."),
    field("cylinder", ON, Form::Table(&CYLINDER), "", Need::No, "A cylinder without ends, or a tube."),
    field("sphere", ON, Form::Table(&SPHERE), "", Need::No, "A sphere, or a shell."),
    field("capsule", ON, Form::Table(&CAPSULE), "", Need::No, "A straight bar with round ends."),
    field("box", ON, Form::Table(&BOX), "", Need::No, "A box."),
]);
#[rustfmt::skip]
static PLANE: Spec = spec("obstacle.plane", &[
    field("point", ON, Form::Vector(&VALUE), "m", Need::Or("[0.0, 0.0, 0.0]"), "A point of the plane."),
    field("normal", ON, Form::Vector(&VALUE), "", Need::Yes("normal = [0.0, 0.0, 1.0]"), "Normal from the obstacle outwards, not 0, of any length."),
]);
#[rustfmt::skip]
static CYLINDER: Spec = spec("obstacle.cylinder", &[
    field("point", ON, Form::Vector(&VALUE), "m", Need::Or("[0.0, 0.0, 0.0]"), "A point of the axis."),
    field("axis", ON, Form::Vector(&VALUE), "", Need::Yes("axis = [0.0, 1.0, 0.0]"), "Direction of the axis, not 0, of any length."),
    field("radius", ON, Form::Number(&SIZE), "m", Need::Yes("radius = 0.1"), "Radius."),
    field("inside", ON, Form::Flag, "", Need::Or("false"), "true: a tube, which rods touch from inside."),
]);
#[rustfmt::skip]
static SPHERE: Spec = spec("obstacle.sphere", &[
    field("centre", ON, Form::Vector(&VALUE), "m", Need::Or("[0.0, 0.0, 0.0]"), "Centre."),
    field("radius", ON, Form::Number(&SIZE), "m", Need::Yes("radius = 0.1"), "Radius."),
    field("inside", ON, Form::Flag, "", Need::Or("false"), "true: a shell, which rods touch from inside."),
]);
#[rustfmt::skip]
static CAPSULE: Spec = spec("obstacle.capsule", &[
    field("from", ON, Form::Vector(&VALUE), "m", Need::Or("[0.0, 0.0, 0.0]"), "One end of its axis."),
    field("to", ON, Form::Vector(&VALUE), "m", Need::Or("[0.0, 0.0, 0.0]"), "The other end of its axis."),
    field("radius", ON, Form::Number(&NON_NEGATIVE), "m", Need::Yes("radius = 0.1"), "Distance of the surface from the axis."),
]);
#[rustfmt::skip]
static BOX: Spec = spec("obstacle.box", &[
    field("centre", ON, Form::Vector(&VALUE), "m", Need::Or("[0.0, 0.0, 0.0]"), "Centre."),
    field("sides", ON, Form::Vector(&SIZE), "m", Need::Yes("sides = [0.1, 0.1, 0.1]"), "Lengths of the sides."),
    field("rotation", ON, Form::Table(&ROTATION), "", Need::No, "Rotation from the world's axes to those of the box; without it along the axes."),
]);

/// Reads the obstacles of a scene; none without the list.
pub(super) fn obstacles(top: &Table) -> Option<Vec<Obstacle>> {
    let reader = top.reader;
    if !top.knows("obstacle") {
        return Some(Vec::new());
    }
    let words =
        "tables [[obstacle]], at most 100, such as { plane = { normal = [0.0, 0.0, 1.0] } }";
    top.read("obstacle", words, Absent::Or(Vec::new()), |field, value| {
        if value.get_ref().is_table() {
            let hint = "write it with two brackets, [[obstacle]]: there may be several";
            reader.wrong_type(field, value, words, Some(hint));
            return None;
        }
        let read = |field: &str, value| {
            let table = reader.table(field, value, &OBSTACLE, "a table, [[obstacle]]")?;
            obstacle(&table)
        };
        let list = reader.all(field, value, words, &read)?;
        if list.len() > OBSTACLES {
            let hint = format!("it has {} elements", list.len());
            return reader.refuse(FaultKind::Value, field, value, words, hint);
        }
        let named = list
            .into_iter()
            .enumerate()
            .map(|(k, (name, shape))| Obstacle {
                name: name.unwrap_or_else(|| format!("obstacle{}", k + 1)),
                shape,
            });
        let obstacles: Vec<Obstacle> = named.collect();
        for (k, obstacle) in obstacles.iter().enumerate() {
            if obstacles[..k]
                .iter()
                .any(|other| other.name == obstacle.name)
            {
                let hint = format!("two of them are called {:?}", obstacle.name);
                let allowed = "a list of obstacles with different names";
                return reader.refuse(FaultKind::Value, field, value, allowed, hint);
            }
        }
        Some(obstacles)
    })
}

/// Reads the name of an obstacle, if given, and the shape.
fn obstacle(table: &Table) -> Option<(Option<String>, ObstacleShape)> {
    let allowed = "a name of letters, digits, _ and -";
    let name = table.maybe("name", |field, value| {
        plain_name(table.reader, field, value, allowed).map(str::to_owned)
    });
    let shapes = ["plane", "cylinder", "sphere", "capsule", "box"];
    let given = table.given(&shapes);
    let one = match given.as_slice() {
        [one] => *one,
        [first, .., last] => {
            table.conflict(
                last,
                &[*first],
                "an obstacle has one shape: write another [[obstacle]]",
            );
            return None;
        }
        [] => {
            let allowed = "one of plane, cylinder, sphere, capsule and box";
            table.missing("plane", allowed, "plane = { normal = [0.0, 0.0, 1.0] }");
            return None;
        }
    };
    let shape = match one {
        "plane" => plane(&table.inner("plane", &PLANE)?),
        "cylinder" => cylinder(&table.inner("cylinder", &CYLINDER)?),
        "sphere" => sphere(&table.inner("sphere", &SPHERE)?),
        "capsule" => capsule(&table.inner("capsule", &CAPSULE)?),
        _ => cuboid(&table.inner("box", &BOX)?),
    };
    Some((name?, shape?))
}

fn plane(table: &Table) -> Option<ObstacleShape> {
    let (point, normal) = (table.vector("point"), direction(table, "normal"));
    Some(ObstacleShape::Plane {
        point: point?,
        normal: normal?,
    })
}

fn cylinder(table: &Table) -> Option<ObstacleShape> {
    let (point, axis) = (table.vector("point"), direction(table, "axis"));
    let (radius, inside) = (table.number("radius"), table.flag("inside"));
    Some(ObstacleShape::Cylinder {
        point: point?,
        axis: axis?,
        radius: radius?,
        inside: inside?,
    })
}

fn sphere(table: &Table) -> Option<ObstacleShape> {
    let (centre, radius) = (table.vector("centre"), table.number("radius"));
    let inside = table.flag("inside");
    Some(ObstacleShape::Sphere {
        centre: centre?,
        radius: radius?,
        inside: inside?,
    })
}

fn capsule(table: &Table) -> Option<ObstacleShape> {
    let (from, to) = (table.vector("from"), table.vector("to"));
    let radius = table.number("radius");
    let (from, to, radius) = (from?, to?, radius?);
    if from == to {
        let name = if table.has("to") { "to" } else { "from" };
        if !table.has(name) {
            table.missing("to", "another point than `from`", "to = [0.0, 1.0, 0.0]");
            return None;
        }
        let hint = "with one point it is a sphere: write sphere = { centre = .., radius = .. }";
        return table.refuse(
            FaultKind::Value,
            name,
            "another point than the other end",
            hint,
        );
    }
    Some(ObstacleShape::Capsule { from, to, radius })
}

fn cuboid(table: &Table) -> Option<ObstacleShape> {
    let (centre, sides) = (table.vector("centre"), table.vector("sides"));
    let rotation = table.maybe("rotation", |field, value| {
        rotation(table.reader, field, value)
    });
    Some(ObstacleShape::Box {
        centre: centre?,
        sides: sides?,
        rotation: rotation?,
    })
}
