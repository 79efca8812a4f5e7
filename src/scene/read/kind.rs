//! The kind of a scene, from what is in it.

use super::fields::{ASSEMBLY, BAR, Kinds, PLANE, REST, SPACE};
use super::phrases::nearest;
use crate::scene::Model;
use toml::Spanned;
use toml::de::{DeTable, DeValue};

/// The words of `rod.model`.
pub(super) const MODELS: [&str; 3] = ["elastica", "cosserat", "bar"];

/// `rod.model`, whatever it is.
fn model_of<'a>(document: &'a DeTable<'a>) -> Option<&'a Spanned<DeValue<'a>>> {
    document.get("rod")?.get_ref().as_table()?.get("model")
}

/// Tables of a rod in space at rest.
const STATICS: [&str; 3] = ["end", "solve", "continue"];
/// Tables, and fields of the rod, of a rod in space in motion.
const MOTION: ([&str; 3], [&str; 3]) =
    (["body", "loads", "run"], ["damping", "relaxation", "nodes"]);

/// True if a rod in space is rather in motion than at rest: more of that is there.
fn is_motion(document: &DeTable) -> bool {
    let rod = document.get("rod").and_then(|rod| rod.get_ref().as_table());
    let (tables, fields) = MOTION;
    let count = |names: [&str; 3], table: &DeTable| {
        names
            .iter()
            .filter(|name| table.contains_key(**name))
            .count()
    };
    count(tables, document) + rod.map_or(0, |rod| count(fields, rod)) > count(STATICS, document)
}

/// The kind of a scene; where `rod.model` does not say it, what else is there decides.
pub(super) fn kind_of(document: &DeTable) -> Kinds {
    if document
        .get("rod")
        .is_some_and(|rod| rod.get_ref().is_array())
    {
        return ASSEMBLY;
    }
    match (guess_model(document), is_motion(document)) {
        (Model::Bar, _) => BAR,
        (Model::Elastica, _) => PLANE,
        (Model::Cosserat, true) => SPACE,
        (Model::Cosserat, false) => REST,
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
    // A section of a material is one of the plane, too.
    let section =
        rod.is_some_and(|rod| rod.contains_key("section") && !rod.contains_key("material"));
    let statics = ["end", "solve", "continue"];
    match section || statics.iter().any(|name| document.contains_key(*name)) {
        true => Model::Cosserat,
        false => Model::Elastica,
    }
}
