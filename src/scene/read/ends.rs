//! Readers of `[clamp]`, `[body]` and `[end]`.

use super::fields::{CLAMP_MOTION, PLANE, POSE, ROTATION, SHAKE, TURN};
use super::groove::groove;
use super::matrix::{definite, rows};
use super::obstacle::body_shape;
use super::phrases::Short;
use super::ranges::{FINITE, MOMENT, Rule, VALUE};
use super::reader::Reader;
use super::solid::{Matter, has_extent, is_of_a_body, matter};
use super::table::{Absent, Alternative, MissingField, Table};
use crate::scene::{
    Body, Clamp, ClampMotion, Component, End, FaultKind, History, Joint, Orientation, Rotation,
    Scene, Sine, Translation, Turn,
};
use nalgebra::{Matrix3, Rotation3, UnitQuaternion, Vector3};
use std::f64::consts::PI;
use toml::Spanned;
use toml::de::DeValue;

/// Tolerance of the norm of a quaternion about 1: numbers rounded to 7 digits are accepted.
const UNIT: f64 = 1e-6;
/// Largest sine of the angle between a tangent and a normal that count as parallel.
const PARALLEL: f64 = 1e-6;
/// Relative width around |r| = L within which a position counts as on the circle: the rounding of the norm.
pub(super) const ON_CIRCLE: f64 = 4.0 * f64::EPSILON;

pub(super) fn clamp(table: &Table) -> Option<Clamp> {
    let reader = table.reader;
    let position = table.vector("position");
    let orientation = match reader.kind.get() {
        // Without `angle` the default orientation stays, a quaternion that is not written again.
        PLANE if table.get("angle").is_none() => Some(None),
        PLANE => table
            .number("angle")
            .map(|angle| Some(Orientation::Angle(angle))),
        _ => orientation(table),
    };
    let (motion, free) = (motion(table), table.flag("free"));
    Some(Clamp {
        position: position?,
        orientation: orientation?.unwrap_or_default(),
        motion: motion?,
        free: free?,
    })
}

/// Reads the motion of a clamp or another support.
pub(super) fn motion(table: &Table) -> Option<Option<ClampMotion>> {
    let allowed = "a table such as { turn = { rate = 1.0 } }";
    table.maybe("motion", |field, value| {
        let table = table.reader.table(field, value, &CLAMP_MOTION, allowed)?;
        let (translate, turn) = (translation(&table), turn(&table));
        let (translate, turn) = (translate?, turn?);
        Some(ClampMotion { translate, turn })
    })
}

fn translation(table: &Table) -> Option<Option<Translation>> {
    let reader = table.reader;
    let size = if reader.kind.get() == PLANE { 3 } else { 4 };
    let allowed = "an array of rows [t, x, y] (in space [t, x, y, z]) of growing times, or a table such as \
                   { direction = [0.0, 1.0], amplitude = 0.01, frequency = 2.0 }";
    table.maybe("translate", |field, value| {
        if value.get_ref().is_table() {
            let table = reader.table(field, value, &SHAKE, allowed)?;
            let (direction, sine) = (direction(&table, "direction"), sine(&table));
            let (direction, sine) = (direction?, sine?);
            return Some(Translation::Sine { direction, sine });
        }
        let words = if size == 3 {
            "a row [t, x, y]"
        } else {
            "a row [t, x, y, z]"
        };
        let row = |field: &str, value| {
            let row = reader.numbers(field, value, words, &FINITE)?;
            if row.len() != size {
                let hint = format!("it has {} elements", row.len());
                return reader.refuse(FaultKind::Value, field, value, words, hint);
            }
            Some(row)
        };
        let table = reader.all(field, value, allowed, &row)?;
        let times: Vec<f64> = table.iter().map(|row| row[0]).collect();
        check_increasing(reader, field, value, &times)?;
        Some(Translation::Table(table))
    })
}

/// Checks for increasing times, at least one; reports the fault.
pub(super) fn check_increasing(
    reader: &Reader,
    field: &str,
    value: &Spanned<DeValue>,
    times: &[f64],
) -> Option<()> {
    if !times.is_empty() && times.windows(2).all(|pair| pair[0] < pair[1]) {
        return Some(());
    }
    let allowed = "rows of growing times, at least one";
    reader.refuse(FaultKind::Value, field, value, allowed, None)
}

fn turn(table: &Table) -> Option<Option<Turn>> {
    let reader = table.reader;
    let allowed = "a table such as { rate = 1.0 }, { amplitude = 0.1, frequency = 2.0 } or { table = [[0.0, 0.0], [1.0, 0.5]] }";
    table.maybe("turn", |field, value| {
        let table = reader.table(field, value, &TURN, allowed)?;
        let planar = reader.kind.get() == PLANE;
        let rows = if table.has("table") {
            turn_rows(&table, planar)?
        } else {
            Vec::new()
        };
        if let [[_, _, rest @ ..], ..] = rows.iter().map(Vec::as_slice).collect::<Vec<_>>()[..]
            && !rest.is_empty()
        {
            table.conflict(
                "axis",
                &["table"],
                "a rotation vector has its own axis; leave it out",
            );
            let rows = rows.iter().map(|row| [row[0], row[1], row[2], row[3]]);
            let table = rows.collect();
            return Some(Turn::Vectors { table });
        }
        let axis = if planar {
            Some([0.0, 0.0, 1.0])
        } else {
            direction(&table, "axis")
        };
        let clash = |name: &str| {
            let others = ["rate", "amplitude", "frequency", "phase"];
            let clash = table.given(&others.map(|other| if other == name { "" } else { other }));
            table.conflict(
                name,
                &clash,
                "a constant rate, a sine or a table: keep one of them",
            );
            clash.is_empty()
        };
        let rate = table.optional("rate")?;
        let angle = if table.has("table") {
            let rows = rows.iter().map(|row| [row[0], row[1]]).collect();
            clash("table").then_some(History::Table(rows))?
        } else if let Some(rate) = rate {
            clash("rate").then_some(History::Rate { rate })?
        } else {
            History::Sine(sine(&table)?)
        };
        Some(Turn::About { axis: axis?, angle })
    })
}

/// Reads the table of a turn: rows of angles about an axis, or of rotation vectors.
fn turn_rows(table: &Table, planar: bool) -> Option<Vec<Vec<f64>>> {
    let reader = table.reader;
    let words = if planar {
        "an array of rows [t, angle] of growing times, in radians"
    } else {
        "an array of rows of growing times: [t, angle] about `axis`, or [t, x, y, z] with rotation vectors, in radians"
    };
    table.read("table", words, Absent::Fault, |field, value| {
        let row = |field: &str, value| reader.numbers(field, value, words, &FINITE);
        let rows = reader.all(field, value, words, &row)?;
        let size = rows.first().map_or(0, Vec::len);
        let known = size == 2 || (size == 4 && !planar);
        if let Some(odd) = rows.iter().find(|row| row.len() != size || !known) {
            let hint = format!("a row has {} elements", odd.len());
            return reader.refuse(FaultKind::Value, field, value, words, hint);
        }
        let times: Vec<f64> = rows.iter().map(|row| row[0]).collect();
        check_increasing(reader, field, value, &times)?;
        Some(rows)
    })
}

/// Reads `amplitude`, `frequency` and `phase`.
pub(super) fn sine(table: &Table) -> Option<Sine> {
    let required = |name: &str, example: &str| match table.get(name) {
        Some(_) => table.optional(name).flatten(),
        None => {
            table.missing(name, "a finite number", example);
            None
        }
    };
    let amplitude = required("amplitude", "amplitude = 0.5");
    let frequency = required("frequency", "frequency = 2.0");
    let phase = table.number("phase");
    let mean = if table.knows("mean") {
        table.number("mean")
    } else {
        Some(0.0)
    };
    Some(Sine {
        mean: mean?,
        amplitude: amplitude?,
        frequency: frequency?,
        phase: phase?,
    })
}

/// Reads a vector that is not 0.
pub(super) fn direction(table: &Table, name: &str) -> Option<[f64; 3]> {
    let words = match table.reader.kind.get() {
        PLANE => "an array of two finite numbers, [x, y], not both 0",
        _ => "an array of three finite numbers, [x, y, z], not all 0",
    };
    table.read(name, words, Absent::Fault, |field, value| {
        let direction = table.reader.point(field, value, &FINITE)?;
        if direction == [0.0; 3] {
            let reader = table.reader;
            return reader.refuse(FaultKind::Value, field, value, words, None);
        }
        Some(direction)
    })
}

/// Reads the body; the first result is true for a weld. `weld` is false for a point mass on a ball joint in space.
pub(super) fn body(table: &Table, weld: Option<bool>) -> (Option<bool>, Option<Body>) {
    if table.reader.kind.get() == PLANE {
        let (mass, shape) = (table.number("mass"), body_shape(table));
        let body = || {
            Some(Body {
                mass: mass?,
                joint: Joint::Ball,
                groove: None,
                shape: shape?,
            })
        };
        return (Some(false), body());
    }
    (weld, spatial_body(table, weld))
}

fn spatial_body(table: &Table, weld: Option<bool>) -> Option<Body> {
    let reader = table.reader;
    let groove = groove(table);
    let offset = table.vector("offset");
    let rotor = table.vector("rotor");
    let allowed =
        "an array of three finite numbers > 0, about the directors; or three rows of three";
    let Matter { mass, inertia } = matter(table, || {
        table.maybe("inertia", |field, value| {
            inertia(reader, field, value, allowed, &MOMENT)
        })
    });
    let shape = body_shape(table);
    let joint = if weld? {
        if !has_extent(table) {
            table.missing("inertia", allowed, "inertia = [0.01, 0.01, 0.01]");
        }
        Joint::Weld {
            offset: offset?,
            inertia: inertia??,
            rotor: rotor?,
        }
    } else {
        let hint = "an end that is free to turn carries a point mass; a body with extension has joint = \"weld\"";
        table.conflict("inertia", &["joint"], hint);
        table.conflict("solid", &["joint"], hint);
        if rotor.is_some_and(|rotor| rotor != [0.0; 3]) {
            table.conflict("rotor", &["joint"], hint);
            return None;
        }
        let moved = offset != Some([0.0; 3]);
        if moved && offset.is_some() {
            table.conflict("offset", &["joint"], hint);
        }
        inertia?;
        if moved || has_extent(table) {
            return None;
        }
        Joint::Ball
    };
    Some(Body {
        mass: mass?,
        joint,
        groove: groove?,
        shape: shape?,
    })
}

/// Reads an inertia about the centre of mass that a body can have; `moment` is the rule for its diagonal.
pub(super) fn inertia(
    reader: &Reader,
    field: &str,
    value: &Spanned<DeValue>,
    allowed: &str,
    moment: &Rule,
) -> Option<[[f64; 3]; 3]> {
    let nested = |list: &toml::de::DeArray| list.iter().any(|row| row.get_ref().is_array());
    let inertia = if value.get_ref().as_array().is_some_and(nested) {
        let rows = rows(
            reader,
            field,
            value,
            allowed,
            "an array of three finite numbers",
        )?;
        let consequence = "no body with a thickness has such an inertia";
        definite(reader, field, value, rows, &[0, 1, 2], moment, consequence)?
    } else {
        let number = |field: &str, value: &_| reader.number(field, value, moment);
        let [a, b, c] = reader.array(field, value, allowed, &number)?;
        [[a, 0.0, 0.0], [0.0, b, 0.0], [0.0, 0.0, c]]
    };
    is_of_a_body(reader, field, value, &inertia).then_some(inertia)
}

/// The fields that say an orientation.
pub(super) const ORIENTATION: [&str; 4] = ["quaternion", "rotation", "tangent", "normal"];

/// Reads a quaternion, or a rotation, or a tangent with or without a normal, or nothing.
pub(super) fn orientation(table: &Table) -> Option<Option<Orientation>> {
    let quaternion = table.maybe("quaternion", |field, value| {
        quaternion(table.reader, field, value)
    });
    let rotation = table.maybe("rotation", |field, value| {
        rotation(table.reader, field, value)
    });
    if table.has("quaternion") && table.has("rotation") {
        table.conflict("rotation", &["quaternion"], "keep one of them");
        return None;
    }
    let others = table.given(&ORIENTATION[..2]);
    for name in table.given(&ORIENTATION[2..]) {
        table.conflict(name, &others, "keep one way to say the orientation");
    }
    if !others.is_empty() && !table.given(&ORIENTATION[2..]).is_empty() {
        return None;
    }
    let by_tangent = by_tangent(table);
    let by_rotation = rotation?.map(Orientation::Rotation);
    let given = quaternion?.map(Orientation::Quaternion).or(by_rotation);
    Some(given.or(by_tangent?.map(Orientation::Quaternion)))
}

/// Reads the directors by `tangent`, d3, and `normal`, d1.
fn by_tangent(table: &Table) -> Option<Option<[f64; 4]>> {
    if !table.has("tangent") {
        if table.has("normal") {
            let allowed = "the direction of the rod, with normal";
            table.missing("tangent", allowed, "tangent = [0.0, 0.0, 1.0]");
            return None;
        }
        return Some(None);
    }
    let normal = table.has("normal").then(|| direction(table, "normal"));
    let along = direction(table, "tangent");
    let tangent = Vector3::from(unit(along?));
    let turn = match normal {
        Some(normal) => {
            let normal = Vector3::from(unit(normal?));
            let across = normal - tangent * tangent.dot(&normal);
            if !(across.norm() > PARALLEL) {
                let allowed = "a direction that is not along tangent";
                let hint = "d1 is the part of it perpendicular to tangent";
                return table.refuse(FaultKind::Value, "normal", allowed, hint);
            }
            let first = across.normalize();
            let frame = Matrix3::from_columns(&[first, tangent.cross(&first), tangent]);
            UnitQuaternion::from_rotation_matrix(&Rotation3::from_matrix_unchecked(frame))
        }
        None => UnitQuaternion::rotation_between(&Vector3::z(), &tangent)
            .unwrap_or_else(|| UnitQuaternion::from_axis_angle(&Vector3::y_axis(), PI)),
    };
    let q = turn.into_inner().normalize();
    Some(Some([q.w, q.i, q.j, q.k]))
}

fn quaternion(reader: &Reader, field: &str, value: &Spanned<DeValue>) -> Option<[f64; 4]> {
    let q: [f64; 4] = reader.vector(field, value, &VALUE)?;
    let size = norm(&q);
    if (size - 1.0).abs() <= UNIT {
        return Some(unit(q));
    }
    let hint = match size {
        0.0 => "it is zero; no rotation is [1, 0, 0, 0]".to_owned(),
        _ => format!(
            "its norm is {:.9}: divide it by that, or write rotation = {{ axis = [..], angle = .. }}",
            Short(size)
        ),
    };
    let allowed = "a rotation: a quaternion [w, x, y, z] with w^2 + x^2 + y^2 + z^2 = 1, to 1e-6";
    reader.refuse(FaultKind::Value, field, value, allowed, hint)
}

pub(super) fn rotation<'a>(
    reader: &'a Reader<'a>,
    field: &str,
    value: &'a Spanned<DeValue<'a>>,
) -> Option<Rotation> {
    let allowed = "a table such as { axis = [0.0, 1.0, 0.0], angle = 0.5 }, in radians";
    let table = reader.table(field, value, &ROTATION, allowed)?;
    let words = "an array of three finite numbers, [x, y, z], not all 0";
    let axis = table.read("axis", words, Absent::Fault, |field, value| {
        let axis: [f64; 3] = reader.vector(field, value, &VALUE)?;
        if axis == [0.0; 3] {
            let hint = "a rotation about no axis is none";
            return reader.refuse(FaultKind::Value, field, value, words, hint);
        }
        Some(unit(axis))
    });
    let angle = table.optional("angle");
    let degrees = table.optional("angle_degrees");
    let angle = table.either(
        Alternative {
            name: "angle",
            value: angle,
        },
        Alternative {
            name: "angle_degrees",
            value: degrees.map(|x| x.map(f64::to_radians)),
        },
        "keep one of them",
        &MissingField {
            name: "angle",
            allowed: "an angle in radians; or angle_degrees",
            example: "angle = 0.5",
        },
    );
    Some(Rotation {
        axis: axis?,
        angle: angle?,
    })
}

pub(super) fn norm(vector: &[f64]) -> f64 {
    let size = vector.iter().fold(0.0_f64, |size, x| size.max(x.abs()));
    match size {
        0.0 => 0.0,
        _ => {
            size * vector
                .iter()
                .map(|x| (x / size).powi(2))
                .sum::<f64>()
                .sqrt()
        }
    }
}

/// The vector scaled to unit length. A unit vector stays unchanged, so that a scene reads back bit by bit.
fn unit<const N: usize>(vector: [f64; N]) -> [f64; N] {
    let size = norm(&vector);
    if (size - 1.0).abs() <= 4.0 * f64::EPSILON {
        vector
    } else {
        vector.map(|x| x / size)
    }
}

pub(super) fn end(table: &Table) -> Option<End> {
    let force = table.vector("force");
    let couple = table.vector("couple");
    let load = table.number("load");
    let follower = table.flag("follower");
    let turning = ["follower_force", "follower_couple"].map(|name| table.vector(name));
    let (position, orientation) = match table.get("pose") {
        None => (
            position(table, Absent::Or([Component::Free; 3])),
            orientation(table),
        ),
        Some(value) => pose(table, value)?,
    };
    let end = End {
        position: position?,
        orientation: orientation?,
        force: force?,
        couple: couple?,
        load: load?,
        follower: follower?,
        follower_force: turning[0]?,
        follower_couple: turning[1]?,
    };
    loads_are_free(table, &end).then_some(end)
}

type GivenPose = (Option<[Component; 3]>, Option<Option<Orientation>>);

/// Reads position and orientation from one table; both are required.
fn pose<'a>(table: &Table<'a>, value: &'a Spanned<DeValue<'a>>) -> Option<GivenPose> {
    let [a, b, c, d] = ORIENTATION;
    let outside = table.given(&["position", a, b, c, d]);
    for name in &outside {
        table.conflict(name, &["pose"], "write it once, inside or outside of pose");
    }
    let allowed =
        "a table such as { position = [0.5, 0.0, 0.5], quaternion = [1.0, 0.0, 0.0, 0.0] }";
    let pose = table.reader.table("end.pose", value, &POSE, allowed)?;
    let position = position(&pose, Absent::Fault);
    let orientation = orientation(&pose);
    if orientation == Some(None) {
        let (allowed, example) = (
            "a unit quaternion [w, x, y, z]; or rotation, or tangent",
            "quaternion = [1.0, 0.0, 0.0, 0.0]",
        );
        pose.missing("quaternion", allowed, example);
        return None;
    }
    outside.is_empty().then_some((position, orientation))
}

fn position(table: &Table, absent: Absent<[Component; 3]>) -> Option<[Component; 3]> {
    let allowed = "an array of three, [x, y, z], each a finite number or \"free\"";
    let reader = table.reader;
    table.read("position", allowed, absent, |field, value| {
        reader.array(
            field,
            value,
            allowed,
            &|field, value| match value.get_ref() {
                DeValue::String(_) => {
                    let words = [("free", Component::Free)];
                    reader.choice(field, value, &words, "a finite number or \"free\"")
                }
                _ => reader.number(field, value, &VALUE).map(Component::Held),
            },
        )
    })
}

/// True if loads act only on free components; otherwise reports the faults.
fn loads_are_free(table: &Table, end: &End) -> bool {
    let reader = table.reader;
    let mut free = true;
    let mut refuse =
        |field: String, value: Option<&Spanned<DeValue>>, allowed: &str, hint: &str| {
            let Some(value) = value else { return };
            free = false;
            reader.fault(FaultKind::Conflict, &field, value, allowed, hint);
        };
    let element = |name: &str, i: usize| table.get(name)?.get_ref().as_array()?.get(i);
    for i in 0..3 {
        if end.position[i] != Component::Free && end.force[i] != 0.0 {
            let allowed = format!("0 where component {i} (from 0) of the position is held");
            let hint = "the force there is the reaction, part of the solution; to give it, write \"free\" for the \
                        component of the position";
            refuse(
                format!("end.force[{i}]"),
                element("force", i),
                &allowed,
                hint,
            );
        }
        if end.orientation.is_some() && end.couple[i] != 0.0 {
            let hint = "the couple is the reaction, part of the solution; leave the orientation out to give it";
            let allowed = "0 where the orientation is held";
            refuse(
                format!("end.couple[{i}]"),
                element("couple", i),
                allowed,
                hint,
            );
        }
    }
    for (name, load) in [
        ("follower_force", end.follower_force),
        ("follower_couple", end.follower_couple),
    ] {
        if load != [0.0; 3] && (end.follower || !end.is_loaded()) {
            refuse(
                format!("end.{name}"),
                table.get(name),
                "0, or left out, where something of the end is held or `follower` is true",
                "it turns with an end that is free; `follower = true` is for force and couple together",
            );
        }
    }
    if end.follower && !end.is_loaded() {
        let allowed = "false where a position or an orientation is held";
        let hint = "a load that follows the directors needs an end that is free";
        refuse(
            "end.follower".to_owned(),
            table.get("follower"),
            allowed,
            hint,
        );
    }
    free
}

/// Reason why the held position is out of reach of an inextensible rod; `None` within reach.
pub(super) fn out_of_reach(scene: &Scene) -> Option<String> {
    if !scene.rod.section.is_inextensible() {
        return None;
    }
    let base = scene.clamp.position;
    let end = scene.end.as_ref()?;
    // Free components may take the nearest value.
    let apart = |i: usize| end.position[i].held().map_or(0.0, |x| x - base[i]);
    too_far(norm(&[apart(0), apart(1), apart(2)]), scene.rod.length)
}

/// Reason why this distance is out of reach of an inextensible rod; `None` within reach.
pub(super) fn too_far(distance: f64, length: f64) -> Option<String> {
    let ratio = distance / length;
    let (distance, length) = (Short(distance), Short(length));
    if ratio < 1.0 - ON_CIRCLE {
        return None;
    }
    Some(if ratio <= 1.0 + ON_CIRCLE {
        format!(
            "it is at distance {distance} of the clamp, the length of the rod, which is taut and straight there, \
             and its force undetermined; end a little inside, such as at 0.999 of that"
        )
    } else {
        format!("the rod cannot reach so far: distance {distance:.6} of the clamp, length {length}")
    })
}

pub(super) const REACH: &str =
    "nearer to the clamp than the length of the rod, which can neither stretch nor shear";

pub(super) fn in_reach(top: &Table, scene: &Scene) -> bool {
    let Some(hint) = out_of_reach(scene) else {
        return true;
    };
    let inside =
        |value: Option<&'_ Spanned<DeValue>>, name: &str| -> Option<std::ops::Range<usize>> {
            Some(value?.get_ref().as_table()?.get(name)?.span())
        };
    let end = top.get("end");
    let pose = || {
        Some((
            inside(end?.get_ref().as_table()?.get("pose"), "position")?,
            "end.pose.position",
        ))
    };
    let plain = inside(end, "position").map(|span| (span, "end.position"));
    // A misspelt field already has a fault: any span will do.
    let (span, field) = plain
        .or_else(pose)
        .unwrap_or((top.at..top.at, "end.position"));
    let kind = FaultKind::Value;
    top.reader
        .record(kind, span.start, field, Some(span), REACH, hint);
    false
}
