//! Types for the description of a field: kinds of scenes, form, unit, need.

use super::fields::TOP;
use super::ranges::Rule;

/// Set of kinds of scenes, one bit each.
pub(super) type Kinds = u16;
/// A motion in the plane.
pub(super) const PLANE: Kinds = 1;
/// Statics, in space.
pub(super) const STATICS: Kinds = 2;
/// A motion in space.
pub(super) const SPACE: Kinds = 4;
/// Several rods and bodies in space, in statics or in motion.
pub(super) const ASSEMBLY: Kinds = 8;
/// A bar with mass, in longitudinal motion.
pub(super) const BAR: Kinds = 16;
/// A section of a tube under pressure, at rest.
pub(super) const TUBES: Kinds = 32;
/// A membrane under pressure, at rest.
pub(super) const MEMBRANES: Kinds = 64;
/// A flow in a tube.
pub(super) const FLOWS: Kinds = 128;
/// A membrane in motion.
pub(super) const INFLATIONS: Kinds = 256;
/// A membrane, at rest or in motion.
pub(super) const INFLATED: Kinds = MEMBRANES | INFLATIONS;
/// A tube, at rest or with a flow.
pub(super) const TUBED: Kinds = TUBES | FLOWS;
/// A wall under pressure, at rest.
pub(super) const WALL: Kinds = TUBES | MEMBRANES;
/// One rod in motion.
pub(super) const MOTION: Kinds = PLANE | SPACE;
/// Kinds of scenes with a motion of rods.
pub(super) const RUNS: Kinds = MOTION | ASSEMBLY;
/// Kinds of scenes with histories in time.
pub(super) const DRIVEN: Kinds = RUNS | BAR | FLOWS | INFLATIONS;
pub(super) const IN_SPACE: Kinds = STATICS | SPACE | ASSEMBLY;
/// One rod in space.
pub(super) const ONE_IN_SPACE: Kinds = STATICS | SPACE;
/// One rod.
pub(super) const ONE: Kinds = PLANE | STATICS | SPACE;
pub(super) const ANY: Kinds = PLANE | STATICS | SPACE | ASSEMBLY;

/// A table of a scene with its fields.
pub(super) struct Spec {
    /// Name between brackets; empty for the top of the file.
    pub name: &'static str,
    /// Fields of the table (tables, for the top of the file).
    pub fields: &'static [Field],
    /// Fields that a kind of scene does not have, each with advice.
    pub barred: &'static [(Kinds, &'static str, &'static str)],
}

impl Spec {
    /// The field `name` in scenes of this kind.
    pub fn field(&self, name: &str, kind: Kinds) -> Option<&'static Field> {
        let fields: &'static [Field] = self.fields;
        fields
            .iter()
            .find(|field| field.name == name && field.on & kind != 0)
    }

    /// Names of all fields in scenes of this kind.
    pub fn names(&self, kind: Kinds) -> impl Iterator<Item = &'static str> {
        let fields: &'static [Field] = self.fields;
        fields
            .iter()
            .filter(move |field| field.on & kind != 0)
            .map(|field| field.name)
    }
}

/// A field. A field with different meanings in different kinds of scenes has one entry for each.
pub(super) struct Field {
    pub name: &'static str,
    /// Kinds of scenes with this field.
    pub on: Kinds,
    pub form: Form,
    /// SI unit; empty for a pure number.
    pub unit: &'static str,
    pub need: Need,
    /// Meaning, in a sentence.
    pub doc: &'static str,
}

/// Form of a value.
pub(super) enum Form {
    /// A number.
    Number(&'static Rule),
    /// An integer between the two bounds, both included.
    Count(usize, usize),
    /// true or false.
    Flag,
    /// A name of the user's choice.
    Name,
    /// One of these words.
    Word(&'static [&'static str]),
    /// A vector: two numbers in the plane, three in space.
    Vector(&'static Rule),
    /// A fixed number of numbers.
    Numbers(usize),
    /// A list of numbers, of any length.
    List,
    /// Arrays with a fixed number of numbers each.
    Rows(usize),
    /// A table.
    Table(&'static Spec),
    /// An array of forms.
    Array(&'static Form),
    /// One of several forms.
    OneOf(&'static [Form]),
}

/// True if the field at a dotted path, written as in overrides, is a whole number.
pub(crate) fn is_count(path: &str) -> bool {
    let steps = path.split('.');
    let names = steps.map(|step| step.split('[').next().unwrap_or_default().trim());
    counts(&Form::Table(&TOP), &names.collect::<Vec<_>>())
}

fn counts(form: &Form, steps: &[&str]) -> bool {
    match (form, steps) {
        (Form::Count(..), []) => true,
        (Form::Table(spec), [name, rest @ ..]) => {
            let mut named = spec.fields.iter().filter(|field| field.name == *name);
            named.any(|field| counts(&field.form, rest))
        }
        // A step of the path may be the name of an element.
        (Form::Array(inner), _) => {
            counts(inner, steps) || matches!(steps, [_, rest @ ..] if counts(inner, rest))
        }
        (Form::OneOf(forms), _) => forms.iter().any(|form| counts(form, steps)),
        _ => false,
    }
}

/// Need of a field: required, with a default, or optional.
pub(super) enum Need {
    /// Required; the text is a line as an example.
    Yes(&'static str),
    /// Optional; the text is the default, in TOML.
    Or(&'static str),
    /// Optional; the documentation tells the behaviour without the field.
    No,
}

pub(super) const fn field(
    name: &'static str,
    on: Kinds,
    form: Form,
    unit: &'static str,
    need: Need,
    doc: &'static str,
) -> Field {
    Field {
        name,
        on,
        form,
        unit,
        need,
        doc,
    }
}

pub(super) const fn spec(name: &'static str, fields: &'static [Field]) -> Spec {
    Spec {
        name,
        fields,
        barred: &[],
    }
}
