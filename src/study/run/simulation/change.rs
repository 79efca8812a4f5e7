//! Rules of change: the fields of a scene that may change while a motion goes on.

use crate::error::{Error, Result};
use serde_json::{Map, Value};

/// Fields that may change while a motion goes on: names of tables, and of fields of rods, bodies and runs.
const TABLES: [&str; 2] = ["loads", "load"];
const FIELDS: [&str; 7] = [
    "damping",
    "tendon",
    "force",
    "couple",
    "drag",
    "rotational_drag",
    "duration",
];

/// Refuses a scene that differs from the present one in a field that cannot change while a motion goes on.
pub(super) fn refuse_others(before: &Value, after: &Value) -> Result<()> {
    let mut paths = Vec::new();
    differences(before, after, "", &mut paths);
    let may = |path: &String| {
        let mut parts = path.split('.');
        let first = parts.next().unwrap_or_default();
        TABLES.contains(&first) || parts.any(|part| FIELDS.contains(&part))
    };
    match paths.iter().find(|path| !may(path)) {
        None => Ok(()),
        Some(path) => Err(Error::domain(format!(
            "{path} cannot change while the motion goes on; what can is [loads], [[load]], and of rods, bodies and the run: {}",
            FIELDS.join(", ")
        ))),
    }
}

/// Paths at which two values differ.
fn differences(before: &Value, after: &Value, path: &str, found: &mut Vec<String>) {
    let inside = |name: &str| match path {
        "" => name.to_owned(),
        _ => format!("{path}.{name}"),
    };
    match (before, after) {
        (Value::Object(a), Value::Object(b)) => {
            let mut names: Vec<&String> = a.keys().chain(b.keys()).collect();
            names.sort();
            names.dedup();
            for name in names {
                let of = |map: &Map<String, Value>| map.get(name).cloned().unwrap_or(Value::Null);
                differences(&of(a), &of(b), &inside(name), found);
            }
        }
        (Value::Array(a), Value::Array(b)) if a.len() == b.len() => {
            for (i, (a, b)) in a.iter().zip(b).enumerate() {
                differences(a, b, &inside(&i.to_string()), found);
            }
        }
        (a, b) if a == b => {}
        _ => found.push(path.to_owned()),
    }
}
