//! What a scene of statics may hold: fields, sets, defaults, and what they require of each other.

use super::along_schema::{SIZE, VALUE};
use super::continue_schema::{CONTINUE, continuation};
use super::fault::FaultKind;
use super::reader::{Need, Reader, Rule, Short, Spec, Table};
use super::schema::{ON_CIRCLE, SILENT, units};
use super::section_schema::{REST, SECTION, rest, rest_inside_barrier, section};
use super::{
    Clamp, Component, End, Loads, Model, Orientation, Rest, Rod, Rotation, Scene, Section, Solve,
    Start,
};
use crate::rod::Path;
use toml::Spanned;
use toml::de::DeValue;

use Need::{Or, Required};

pub(super) const TOP: Spec = Spec {
    name: "",
    fields: &["units", "rod", "clamp", "end", "start", "solve", "continue"],
    barred: &[
        (
            "body",
            "with [end], [solve] or [continue] the scene is one of statics, with [body] and [run] one of motion: \
             keep one of the two; at rest its weight is end.force",
        ),
        (
            "loads",
            "they act on the body of a scene of motion; in statics write force and couple in [end]",
        ),
        (
            "run",
            "with [end], [solve] or [continue] the scene is one of statics, with [body] and [run] one of motion: \
             keep one of the two; a branch is [continue]",
        ),
    ],
};
const RATES: &str =
    "at rest there are no rates; a scene of motion has [body] and [run] in place of [end]";
const ROD: Spec = Spec {
    name: "rod",
    fields: &["model", "length", "section", "rest"],
    barred: &[("damping", RATES), ("relaxation", RATES), ("nodes", RATES)],
};
pub(super) const CLAMP: Spec = Spec {
    name: "clamp",
    fields: &["position", "quaternion", "rotation"],
    barred: &[],
};
const END: Spec = Spec {
    name: "end",
    fields: &[
        "force",
        "couple",
        "load",
        "follower",
        "position",
        "quaternion",
        "rotation",
        "pose",
    ],
    barred: &[],
};
const POSE: Spec = Spec {
    name: "end.pose",
    fields: &["position", "quaternion", "rotation"],
    barred: &[],
};
const ROTATION: Spec = Spec {
    name: "rotation",
    fields: &["axis", "angle", "angle_degrees"],
    barred: &[],
};
const START: Spec = Spec {
    name: "start",
    fields: &["wrench"],
    barred: &[],
};
const SOLVE: Spec = Spec {
    name: "solve",
    fields: &["tolerance", "path"],
    barred: &[],
};
/// Where a field that stands in the wrong table may belong.
pub(super) const HOMES: [&Spec; 9] = [
    &TOP, &ROD, &SECTION, &REST, &END, &CLAMP, &START, &SOLVE, &CONTINUE,
];

const TOLERANCE: Rule = Rule {
    allowed: "a number in [1e-13, 1e-4]",
    holds: |x| (1e-13..=1e-4).contains(&x),
    hint: SILENT,
};
/// How far the norm of a quaternion may be from 1: numbers that were rounded to 7 digits are meant well.
const UNIT: f64 = 1e-6;

/// Reads everything before it gives up anything.
pub(super) fn resolve(top: &Table) -> Option<Scene> {
    let units = units(top);
    let rod = match top.get("rod") {
        Some(value) => open(top, value, &ROD).and_then(|table| rod(&table)),
        None => {
            let hint = "add `[rod]` with `model = \"cosserat\"`, and `[rod.section]`".to_owned();
            let allowed = format!("a table with {}", ROD.fields.join(", "));
            let kind = FaultKind::Missing;
            top.reader
                .record(kind, top.at, "rod", None, allowed, Some(hint));
            None
        }
    };
    let clamp = part(top, &CLAMP, Clamp::default(), clamp);
    let end = match top.get("end") {
        Some(value) => open(top, value, &END).and_then(|table| end(&table)),
        None => {
            let hint = "add `[end]` with `force = [0.0, 0.0, -1.0]`; left empty it is an end that is free and without load"
                .to_owned();
            let allowed = "a table with what holds or loads the end: position, quaternion or rotation, force, couple";
            let kind = FaultKind::Missing;
            top.reader
                .record(kind, top.at, "end", None, allowed, Some(hint));
            None
        }
    };
    let start = part(top, &START, Start::default(), |table| {
        let wrench = table.read("wrench", "", Or(None), |field, value| {
            table.reader.vector(field, value, VALUE).map(Some)
        });
        Some(Start {
            wrench: wrench?,
            ..Start::default()
        })
    });
    let solve = part(top, &SOLVE, Solve::default(), solve);
    let whole = || {
        Some(Scene {
            units: units?,
            rod: rod?,
            clamp: clamp?,
            body: None,
            end: Some(end?),
            start: start?,
            loads: Loads::default(),
            run: None,
            solve: solve?,
            continuation: None,
        })
    };
    let scene = whole().filter(|scene| in_reach(top, scene));
    let continuation = part(top, &CONTINUE, None, |table| {
        continuation(table, scene.as_ref()).map(Some)
    });
    let (mut scene, continuation) = (scene?, continuation?);
    scene.continuation = continuation;
    Some(scene)
}

fn open<'a>(top: &Table<'a>, value: &'a Spanned<DeValue<'a>>, spec: &Spec) -> Option<Table<'a>> {
    let allowed = format!("a table, [{}]", spec.name);
    top.reader.table(spec.name, value, spec, &HOMES, &allowed)
}

/// An optional table of the top.
fn part<'a, T>(
    top: &Table<'a>,
    spec: &Spec,
    default: T,
    parse: impl FnOnce(&Table<'a>) -> Option<T>,
) -> Option<T> {
    match top.get(spec.name) {
        None => Some(default),
        Some(value) => parse(&open(top, value, spec)?),
    }
}

fn rod(table: &Table) -> Option<Rod> {
    cosserat_rod(table, &HOMES).rod()
}

/// What was read of a rod.
pub(super) struct Parts {
    model: Option<Model>,
    pub length: Option<f64>,
    pub section: Option<Section>,
    rest: Option<Rest>,
}

impl Parts {
    pub fn rod(self) -> Option<Rod> {
        Some(Rod {
            model: self.model?,
            length: self.length?,
            section: self.section?,
            rest: self.rest?,
            damping: None,
            relaxation: Vec::new(),
            nodes: None,
        })
    }
}

/// Reads the elastic rod in `[rod]`.
pub(super) fn cosserat_rod(table: &Table, homes: &[&Spec]) -> Parts {
    let open = |value, spec: &Spec| {
        let allowed = format!("a table, [{}]", spec.name);
        table.reader.table(spec.name, value, spec, homes, &allowed)
    };
    let words = r#""cosserat", or "elastica" in a planar scene"#;
    let example = Required(r#"model = "cosserat""#);
    let model = table.read("model", words, example, |field, value| {
        let models = [("cosserat", Model::Cosserat)];
        table.reader.choice(field, value, &models, words)
    });
    let length = table.number("length", SIZE, Required("length = 1.0"));
    let section = match table.get("section") {
        Some(value) => open(value, &SECTION).and_then(|table| section(&table, length)),
        None => {
            let hint =
                "add `[rod.section]` with `bending = [1.0, 1.0]` and `torsion = 0.7`".to_owned();
            let allowed = "a section law: stiffnesses, or shape and material";
            let (kind, reader) = (FaultKind::Missing, table.reader);
            reader.record(kind, table.at, "rod.section", None, allowed, Some(hint));
            None
        }
    };
    let rest = match table.get("rest") {
        Some(value) => open(value, &REST).and_then(|inner| {
            let rest = rest(&inner, length)?;
            let known = section.as_ref().zip(length);
            let inside = known.is_none_or(|(section, length)| {
                rest_inside_barrier(&inner, section, &rest, length)
            });
            inside.then_some(rest)
        }),
        None => Some(Rest::default()),
    };
    Parts {
        model,
        length,
        section,
        rest,
    }
}

pub(super) fn clamp(table: &Table) -> Option<Clamp> {
    let position = table.vector("position", VALUE, Or([0.0; 3]));
    let orientation = orientation(table);
    Some(Clamp {
        position: position?,
        orientation: orientation?.unwrap_or_default(),
    })
}

/// A quaternion, or a rotation, or neither.
pub(super) fn orientation(table: &Table) -> Option<Option<Orientation>> {
    let quaternion = table.read("quaternion", "", Or(None), |field, value| {
        quaternion(table.reader, field, value).map(Some)
    });
    let rotation = table.read("rotation", "", Or(None), |field, value| {
        rotation(table.reader, field, value).map(Some)
    });
    if table.get("quaternion").is_some() && table.get("rotation").is_some() {
        table.conflict("rotation", &["quaternion"], "keep one of them");
        return None;
    }
    let by_rotation = rotation?.map(Orientation::Rotation);
    Some(quaternion?.map(Orientation::Quaternion).or(by_rotation))
}

fn quaternion(reader: &Reader, field: &str, value: &Spanned<DeValue>) -> Option<[f64; 4]> {
    let q: [f64; 4] = reader.vector(field, value, VALUE)?;
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
    reader.fault(FaultKind::Value, field, value.span(), allowed, Some(hint));
    None
}

fn rotation<'a>(
    reader: &'a Reader<'a>,
    field: &str,
    value: &'a Spanned<DeValue<'a>>,
) -> Option<Rotation> {
    let allowed = "a table such as { axis = [0.0, 1.0, 0.0], angle = 0.5 }, in radians";
    let table = reader.table(field, value, &ROTATION, &[], allowed)?;
    let words = "an array of three finite numbers, [x, y, z], not all 0";
    let axis = table.read(
        "axis",
        words,
        Required("axis = [0.0, 1.0, 0.0]"),
        |field, value| {
            let axis: [f64; 3] = reader.vector(field, value, VALUE)?;
            if axis == [0.0; 3] {
                let hint = "a rotation about no axis is none".to_owned();
                reader.fault(FaultKind::Value, field, value.span(), words, Some(hint));
                return None;
            }
            Some(unit(axis))
        },
    );
    let angle = table.optional("angle", VALUE);
    let degrees = table.optional("angle_degrees", VALUE);
    let angle = match (angle?, degrees?) {
        (Some(angle), None) => Some(angle),
        (None, Some(degrees)) => Some(degrees.to_radians()),
        (Some(_), Some(_)) => {
            table.conflict("angle_degrees", &["angle"], "keep one of them");
            None
        }
        (None, None) => {
            table.missing(
                "angle",
                "an angle in radians; or angle_degrees",
                "angle = 0.5",
            );
            None
        }
    };
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

/// The vector at unit length; a unit vector is left as it is, so that a scene reads back bit by bit.
fn unit<const N: usize>(vector: [f64; N]) -> [f64; N] {
    let size = norm(&vector);
    match (size - 1.0).abs() <= 4.0 * f64::EPSILON {
        true => vector,
        false => vector.map(|x| x / size),
    }
}

fn end(table: &Table) -> Option<End> {
    let reader = table.reader;
    let default = End::default();
    let force = table.vector("force", VALUE, Or(default.force));
    let couple = table.vector("couple", VALUE, Or(default.couple));
    let load = table.number("load", VALUE, Or(default.load));
    let flag = |field: &str, value: &_| reader.flag(field, value);
    let follower = table.read("follower", "", Or(default.follower), flag);
    let (position, orientation) = match table.get("pose") {
        None => (position(table, Or(default.position)), orientation(table)),
        Some(value) => pose(table, value)?,
    };
    let end = End {
        position: position?,
        orientation: orientation?,
        force: force?,
        couple: couple?,
        load: load?,
        follower: follower?,
    };
    loads_are_free(table, &end).then_some(end)
}

type Place = (Option<[Component; 3]>, Option<Option<Orientation>>);

/// Position and orientation in one table; both must be there.
fn pose<'a>(table: &Table<'a>, value: &'a Spanned<DeValue<'a>>) -> Option<Place> {
    let outside: Vec<&str> = POSE
        .fields
        .iter()
        .copied()
        .filter(|name| table.get(name).is_some())
        .collect();
    for name in &outside {
        table.conflict(name, &["pose"], "write it once, inside or outside of pose");
    }
    let allowed =
        "a table such as { position = [0.5, 0.0, 0.5], quaternion = [1.0, 0.0, 0.0, 0.0] }";
    let pose = table.reader.table("end.pose", value, &POSE, &[], allowed)?;
    let position = position(&pose, Required("position = [0.5, 0.0, 0.5]"));
    let orientation = orientation(&pose);
    if orientation == Some(None) {
        let (allowed, example) = (
            "a unit quaternion [w, x, y, z]; or rotation",
            "quaternion = [1.0, 0.0, 0.0, 0.0]",
        );
        pose.missing("quaternion", allowed, example);
        return None;
    }
    outside.is_empty().then_some((position, orientation))
}

fn position(table: &Table, need: Need<[Component; 3]>) -> Option<[Component; 3]> {
    let allowed = "an array of three, [x, y, z], each a finite number or \"free\"";
    let reader = table.reader;
    table.read("position", allowed, need, |field, value| {
        reader.array(field, value, allowed, |field, value| {
            match value.get_ref() {
                DeValue::String(_) => {
                    let words = [("free", Component::Free)];
                    reader.choice(field, value, &words, "a finite number or \"free\"")
                }
                _ => reader.number(field, value, VALUE).map(Component::Held),
            }
        })
    })
}

/// True if loads act only where nothing is held; else the faults.
fn loads_are_free(table: &Table, end: &End) -> bool {
    let reader = table.reader;
    let mut free = true;
    let mut refuse =
        |field: String, value: Option<&Spanned<DeValue>>, allowed: &str, hint: &str| {
            let Some(value) = value else { return };
            free = false;
            let (kind, hint) = (FaultKind::Conflict, Some(hint.to_owned()));
            reader.fault(kind, &field, value.span(), allowed, hint);
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

fn solve(table: &Table) -> Option<Solve> {
    let tolerance = table.number("tolerance", TOLERANCE, Or(Solve::TOLERANCE));
    let path = table.read("path", "", Or(Path::default()), |field, value| {
        let words = [
            ("auto", Path::Auto),
            ("planar", Path::Planar),
            ("spatial", Path::Spatial),
            ("closed-form", Path::ClosedForm),
        ];
        let allowed = r#""auto", "planar", "spatial" or "closed-form""#;
        table.reader.choice(field, value, &words, allowed)
    });
    Some(Solve {
        tolerance: tolerance?,
        path: path?,
    })
}

/// Why the end cannot be where it is held, if the rod does not stretch.
pub(super) fn out_of_reach(scene: &Scene) -> Option<String> {
    if !scene.rod.section.is_inextensible() {
        return None;
    }
    let base = scene.clamp.position;
    let end = scene.end.as_ref()?;
    // The components that are free may be as near as can be.
    let apart = |i: usize| end.position[i].held().map_or(0.0, |x| x - base[i]);
    too_far(norm(&[apart(0), apart(1), apart(2)]), scene.rod.length)
}

/// Why the end of a rod that does not stretch cannot be at such a distance of the clamp.
pub(super) fn too_far(distance: f64, length: f64) -> Option<String> {
    let ratio = distance / length;
    let (distance, length) = (Short(distance), Short(length));
    if ratio < 1.0 - ON_CIRCLE {
        return None;
    }
    Some(if ratio <= 1.0 + ON_CIRCLE {
        format!(
            "it is at distance {distance} of the clamp, the length of the rod, which is taut and straight there, \
             and its force undetermined; end a little inside"
        )
    } else {
        format!("the rod cannot reach so far: distance {distance:.6} of the clamp, length {length}")
    })
}

pub(super) const REACH: &str =
    "nearer to the clamp than the length of the rod, which can neither stretch nor shear";

fn in_reach(top: &Table, scene: &Scene) -> bool {
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
    // A misspelt field has a fault already, and its span does not matter.
    let (span, field) = plain
        .or_else(pose)
        .unwrap_or((top.at..top.at, "end.position"));
    let kind = FaultKind::Value;
    top.reader.fault(kind, field, span, REACH, Some(hint));
    false
}
