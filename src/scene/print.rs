//! A scene written again: what it holds, and no field that its kind does not have.

use super::{Scene, schema, spatial_schema, statics_schema};
use serde::Serialize;
use serde::ser::{Error, Serializer};
use serde_json::Value;

impl Serialize for Scene {
    fn serialize<S: Serializer>(&self, serializer: S) -> Result<S::Ok, S::Error> {
        // That of the derive: every field of every kind of scene.
        let whole =
            Scene::serialize(self, serde_json::value::Serializer).map_err(S::Error::custom)?;
        let Value::Object(mut tables) = whole else {
            return Err(S::Error::custom("a scene is a table"));
        };
        let specs = match (self.is_planar(), self.is_motion()) {
            (true, _) => &schema::HOMES[..],
            (false, true) => &spatial_schema::HOMES[..],
            (false, false) => &statics_schema::HOMES[..],
        };
        for spec in specs {
            let table = match spec.name {
                "" => Some(&mut tables),
                name => tables.get_mut(name).and_then(Value::as_object_mut),
            };
            if let Some(table) = table {
                table.retain(|name, _| spec.fields.contains(&name.as_str()));
            }
        }
        if self.is_planar() {
            // The only method of an elastic run, and there not to be written.
            let run = tables.get_mut("run").and_then(Value::as_object_mut);
            if let Some(run) = run {
                run.retain(|name, value| !(name == "method" && value == "auto"));
            }
        }
        let mut scene = Value::Object(tables);
        if self.is_planar() {
            flatten(&mut scene);
        }
        scene.serialize(serializer)
    }
}

/// Vectors of the plane.
const VECTORS: [&str; 5] = ["position", "velocity", "gravity", "dead", "direction"];

/// Leaves out the third component of every vector.
fn flatten(value: &mut Value) {
    match value {
        Value::Object(table) => {
            for (name, value) in table {
                match value {
                    Value::Array(vector) if VECTORS.contains(&name.as_str()) => vector.truncate(2),
                    value => flatten(value),
                }
            }
        }
        Value::Array(values) => values.iter_mut().for_each(flatten),
        _ => {}
    }
}
