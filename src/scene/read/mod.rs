//! From TOML to a [`Scene`](super::Scene), or to every fault of the text.

mod along;
mod branch;
mod document;
mod ends;
mod fields;
mod friction;
mod kind;
mod loads;
mod matrix;
mod reader;
mod rod;
mod rule;
mod run;
mod scene;
mod section;
mod sources;
mod start;
mod table;
mod words;

pub use document::{json_schema, reference};
pub(super) use scene::scene;
pub(super) use sources::Sources;

/// One syntax fault at byte `at`.
pub(super) fn not_toml(sources: &Sources, at: usize, message: &str) -> super::Faults {
    let reader = reader::Reader::new(sources);
    reader.syntax(at, message);
    reader.into_faults()
}

/// The fields of a table, by its name, in scenes of this kind.
pub(super) fn fields_of(planar: bool, motion: bool, table: &str) -> Vec<&'static str> {
    use fields::{Form, PLANE, REST, SPACE, TOP};
    let kind = match (planar, motion) {
        (true, _) => PLANE,
        (false, true) => SPACE,
        (false, false) => REST,
    };
    let spec = match TOP.field(table, kind).map(|field| &field.form) {
        Some(Form::Table(spec)) => spec,
        _ => &TOP,
    };
    spec.names(kind).collect()
}
