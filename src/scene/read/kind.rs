//! Recognition of the kind of a scene from its content.

use super::fields::{
    ASSEMBLY, BAR, FLOWS, INFLATIONS, Kinds, MEMBRANES, PLANE, SPACE, STATICS, TUBES,
};
use super::phrases::nearest;
use crate::scene::Model;
use toml::Spanned;
use toml::de::{DeTable, DeValue};

/// The words of `rod.model`.
pub(super) const MODELS: [&str; 3] = ["elastica", "cosserat", "bar"];

/// The value of `rod.model`, valid or not.
fn model_of<'a>(document: &'a DeTable<'a>) -> Option<&'a Spanned<DeValue<'a>>> {
    document.get("rod")?.get_ref().as_table()?.get("model")
}

/// Tables of a scene of statics in space.
const STATICS_TABLES: [&str; 3] = ["end", "solve", "continue"];
/// Tables of a tube with a flow.
const FLOW_TABLES: [&str; 4] = ["run", "upstream", "downstream", "start"];
/// Tables, and fields of `[rod]`, of a motion in space.
const MOTION: ([&str; 3], [&str; 3]) =
    (["body", "loads", "run"], ["damping", "relaxation", "nodes"]);

/// True if a scene in space has more tables and fields of motion than of statics.
fn is_motion(document: &DeTable) -> bool {
    let rod = document.get("rod").and_then(|rod| rod.get_ref().as_table());
    let (tables, fields) = MOTION;
    let count = |names: [&str; 3], table: &DeTable| {
        names
            .iter()
            .filter(|name| table.contains_key(**name))
            .count()
    };
    count(tables, document) + rod.map_or(0, |rod| count(fields, rod))
        > count(STATICS_TABLES, document)
}

/// The kind of a scene. Without a valid `rod.model` the other tables and fields decide.
pub(super) fn scene_kind(document: &DeTable) -> Kinds {
    let is_list = |name: &str| {
        let table = document.get(name);
        table.is_some_and(|table| table.get_ref().is_array())
    };
    if is_list("rod") || !document.contains_key("rod") && is_list("body") {
        return ASSEMBLY;
    }
    if !document.contains_key("rod") {
        if document.contains_key("tube") {
            let flows = FLOW_TABLES.iter().any(|name| document.contains_key(*name));
            return if flows { FLOWS } else { TUBES };
        }
        if document.contains_key("membrane") {
            let moves = ["run", "body"]
                .iter()
                .any(|name| document.contains_key(*name));
            return if moves { INFLATIONS } else { MEMBRANES };
        }
    }
    match (guess_model(document), is_motion(document)) {
        (Model::Bar, _) => BAR,
        (Model::Elastica, _) => PLANE,
        (Model::Cosserat, true) => SPACE,
        (Model::Cosserat, false) => STATICS,
    }
}

fn guess_model(document: &DeTable) -> Model {
    let word = model_of(document).and_then(|value| value.get_ref().as_str());
    match word.and_then(|word| nearest(word, &mut MODELS.into_iter())) {
        Some("cosserat") => return Model::Cosserat,
        Some("bar") => return Model::Bar,
        Some(_) => return Model::Elastica,
        None => {}
    }
    let rod = document.get("rod").and_then(|rod| rod.get_ref().as_table());
    // A planar rod, too, may have a section, if it has a material.
    let section =
        rod.is_some_and(|rod| rod.contains_key("section") && !rod.contains_key("material"));
    if section
        || STATICS_TABLES
            .iter()
            .any(|name| document.contains_key(*name))
    {
        Model::Cosserat
    } else {
        Model::Elastica
    }
}
