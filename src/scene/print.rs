//! Serialisation of a resolved scene, restricted to the fields of its kind.

use super::read::fields_of;
use super::{BarScene, FlowScene, InflationScene, Rod, Scene, WallScene};
use serde::Serialize;
use serde::ser::{Error, Serializer};
use serde_json::Value;

impl Serialize for Scene {
    fn serialize<S: Serializer>(&self, serializer: S) -> Result<S::Ok, S::Error> {
        let apart =
            (self.bar().map(BarScene::tables)).or_else(|| self.wall().map(WallScene::tables));
        let apart = apart.or_else(|| self.flow().map(FlowScene::tables));
        let apart = apart.or_else(|| self.inflation().map(InflationScene::tables));
        if let Some(mut tables) = apart {
            let units = serde_json::to_value(self.units).map_err(S::Error::custom)?;
            tables.insert("units".to_owned(), units);
            return Value::Object(tables).serialize(serializer);
        }
        // The derived implementation: every field of every kind of scene.
        let whole =
            Scene::serialize(self, serde_json::value::Serializer).map_err(S::Error::custom)?;
        let Value::Object(mut tables) = whole else {
            return Err(S::Error::custom("a scene is a table"));
        };
        let names = |table: &str| fields_of(self, table);
        tables.retain(|name, _| names("").contains(&name.as_str()));
        if let Some(assembly) = self.assembly() {
            let value = serde_json::to_value(assembly).map_err(S::Error::custom)?;
            if let Value::Object(lists) = value {
                // Bodies without rods have no list of rods.
                tables.remove("rod");
                tables.extend(lists);
            }
            if self.run.is_none() {
                tables.remove("start");
            }
        }
        for (table, value) in &mut tables {
            if let (Some(value), known) = (value.as_object_mut(), names(table)) {
                value.retain(|name, _| known.contains(&name.as_str()));
            }
        }
        if self.rod.damping.is_none()
            && !self.rod.is_heavy()
            && let Some(run) = tables.get_mut("run").and_then(Value::as_object_mut)
        {
            // Elastic runs have this method by default.
            run.retain(|name, value| !(name == "method" && value == "auto"));
        }
        if self.end.is_some() && self.loads == super::Loads::default() {
            tables.remove("loads");
        }
        let listed = listed_loads(self).map_err(S::Error::custom)?;
        if !listed.is_empty() {
            tables.insert("load".to_owned(), Value::Array(listed));
        }
        if self.is_planar() {
            drop_planar_defaults(self, &mut tables);
            tables.values_mut().for_each(flatten);
        }
        Value::Object(tables).serialize(serializer)
    }
}

/// The loads on rods, as tables `[[load]]`.
fn listed_loads(scene: &Scene) -> serde_json::Result<Vec<Value>> {
    let rods: Vec<(Option<&str>, &Rod)> = match scene.assembly() {
        Some(assembly) => {
            let rods = assembly.rods.iter();
            rods.map(|rod| (Some(rod.name.as_str()), &rod.rod))
                .collect()
        }
        None => vec![(None, &scene.rod)],
    };
    let mut all = Vec::new();
    for (name, rod) in rods {
        for load in &rod.loads {
            let mut value = serde_json::to_value(load)?;
            if let Value::Object(table) = &mut value {
                if let Some(name) = name {
                    table.insert("rod".to_owned(), name.into());
                }
                if load.couple == [0.0; 3] {
                    table.remove("couple");
                }
                if load.turns_with_end(rod.length) {
                    table.remove("s");
                    table.insert("on".to_owned(), "end".into());
                }
                if let (true, Some(Value::Array(force))) =
                    (scene.is_planar(), table.get_mut("force"))
                {
                    force.truncate(2);
                }
            }
            all.push((load.number, value));
        }
    }
    all.sort_by_key(|(number, _)| *number);
    Ok(all.into_iter().map(|(_, value)| value).collect())
}

/// Leaves out of a planar scene the default clamp, the quaternion of a clamp, the default method and the axis of a
/// turn.
fn drop_planar_defaults(scene: &Scene, tables: &mut serde_json::Map<String, Value>) {
    if scene.clamp == super::Clamp::default() {
        tables.remove("clamp");
    }
    if let Some(clamp) = tables.get_mut("clamp").and_then(Value::as_object_mut) {
        clamp.remove("quaternion");
    }
    if let Some(run) = tables.get_mut("run").and_then(Value::as_object_mut) {
        run.retain(|name, value| !(name == "method" && value == "auto"));
    }
    // The axis of a planar turn is always the normal of the plane.
    let turn = tables
        .get_mut("clamp")
        .and_then(|clamp| clamp.pointer_mut("/motion/turn"));
    if let Some(turn) = turn.and_then(Value::as_object_mut) {
        turn.remove("axis");
    }
}

/// Names of the fields that hold vectors of the plane.
const VECTORS: [&str; 11] = [
    "centre",
    "from",
    "normal",
    "point",
    "position",
    "to",
    "velocity",
    "gravity",
    "dead",
    "distributed",
    "direction",
];

/// Leaves out the third component of every vector.
fn flatten(value: &mut Value) {
    match value {
        Value::Object(table) => {
            for (name, value) in table {
                match value {
                    // Rows (s, vector) of a table, or vectors of a polynomial.
                    Value::Object(rows) if name == "distributed" => {
                        for (form, rows) in rows {
                            let size = if form == "table" { 3 } else { 2 };
                            let rows = rows.as_array_mut().into_iter().flatten();
                            let rows = rows.filter_map(Value::as_array_mut);
                            rows.for_each(|row| row.truncate(size));
                        }
                    }
                    Value::Array(vector) if VECTORS.contains(&name.as_str()) => vector.truncate(2),
                    value => flatten(value),
                }
            }
        }
        Value::Array(values) => values.iter_mut().for_each(flatten),
        _ => {}
    }
}
