//! Conversion of TOML to a [`Scene`](super::Scene), or to the list of all faults of the text.

mod assembly;
mod bar;
mod branch;
mod document;
mod ends;
mod field_spec;
mod fields;
mod flow;
mod friction;
mod groove;
mod inflation;
mod joint;
mod jointed;
mod kind;
mod load_file;
mod load_list;
mod loads;
mod matrix;
mod obstacle;
mod phrases;
mod plane;
mod ranges;
mod reader;
mod rest_shape;
mod rod;
mod rod_end;
mod run;
mod scene;
mod section;
mod solid;
mod sources;
mod start;
mod station;
mod table;
mod tendon;
mod varying;
mod wall;

use super::Scene;
pub use document::{json_schema, reference};
pub(crate) use field_spec::is_count;
pub(crate) use phrases::nearest;
pub(super) use plane::normal_director;
pub(super) use scene::scene;
pub(super) use sources::Sources;
pub(super) use tendon::TENDONS;

/// One syntax fault at byte `at`.
pub(super) fn not_toml(sources: &Sources, at: usize, message: &str) -> super::Faults {
    let reader = reader::Reader::new(sources);
    reader.syntax(at, message);
    reader.into_faults()
}

/// The number at a path of the text with overrides; `None` without a number.
pub(super) fn number_at(sources: &Sources, path: &str) -> Option<f64> {
    let reader = reader::Reader::new(sources);
    let document = reader.document()?;
    let value = sources::value_at(&document, path)?;
    match value.get_ref() {
        toml::de::DeValue::Float(float) => float.as_str().parse().ok(),
        toml::de::DeValue::Integer(integer) => integer.as_str().parse().ok(),
        _ => None,
    }
}

/// Names of the fields of a table in scenes of this kind.
pub(super) fn fields_of(scene: &Scene, table: &str) -> Vec<&'static str> {
    use fields::{Form, TOP};
    let kind = scene.kind_of_fields();
    let spec = match TOP.field(table, kind).map(|field| &field.form) {
        Some(Form::Table(spec)) => spec,
        _ => &TOP,
    };
    spec.names(kind).collect()
}
