//! What is said of a field of a scene: the kinds of scenes that have it, its form, its unit, whether it must be given.

use super::fields::TOP;
use super::ranges::Rule;

/// Kinds of scenes, as bits.
pub(super) type Kinds = u8;
/// A motion in the plane.
pub(super) const PLANE: Kinds = 1;
/// Statics, in space.
pub(super) const REST: Kinds = 2;
/// A motion in space.
pub(super) const SPACE: Kinds = 4;
/// Several rods and bodies in space, at rest or in motion.
pub(super) const ASSEMBLY: Kinds = 8;
/// A bar with mass, in longitudinal motion.
pub(super) const BAR: Kinds = 16;
/// One rod in motion.
pub(super) const MOTION: Kinds = PLANE | SPACE;
/// What can run.
pub(super) const RUNS: Kinds = MOTION | ASSEMBLY;
/// What forces in time act on.
pub(super) const DRIVEN: Kinds = RUNS | BAR;
pub(super) const IN_SPACE: Kinds = REST | SPACE | ASSEMBLY;
/// One rod in space.
pub(super) const ONE_IN_SPACE: Kinds = REST | SPACE;
/// One rod.
pub(super) const ONE: Kinds = PLANE | REST | SPACE;
pub(super) const ANY: Kinds = PLANE | REST | SPACE | ASSEMBLY;

/// One table of a scene, and what it may hold.
pub(super) struct Spec {
    /// Its name between brackets; empty for the top of the file.
    pub name: &'static str,
    /// Its fields (tables, for the top of the file).
    pub fields: &'static [Field],
    /// Fields that a kind of scene does not have, each with what to do.
    pub barred: &'static [(Kinds, &'static str, &'static str)],
}

impl Spec {
    /// A field of scenes of this kind.
    pub fn field(&self, name: &str, kind: Kinds) -> Option<&'static Field> {
        let fields: &'static [Field] = self.fields;
        fields
            .iter()
            .find(|field| field.name == name && field.on & kind != 0)
    }

    /// The names of all fields of scenes of this kind.
    pub fn names(&self, kind: Kinds) -> impl Iterator<Item = &'static str> {
        let fields: &'static [Field] = self.fields;
        fields
            .iter()
            .filter(move |field| field.on & kind != 0)
            .map(|field| field.name)
    }
}

/// A field. Where it means different things in different kinds of scenes it has an entry for each.
pub(super) struct Field {
    pub name: &'static str,
    /// The kinds of scenes that have it.
    pub on: Kinds,
    pub form: Form,
    /// Its unit in SI; empty for a pure number.
    pub unit: &'static str,
    pub need: Need,
    /// What it is, in a sentence.
    pub doc: &'static str,
}

/// What a value is.
pub(super) enum Form {
    /// A number.
    Number(&'static Rule),
    /// An integer from .. to ..
    Count(usize, usize),
    /// true or false.
    Flag,
    /// A name of the user's choice.
    Name,
    /// One of these words.
    Word(&'static [&'static str]),
    /// A vector: two numbers in the plane, three in space.
    Vector(&'static Rule),
    /// So many numbers.
    Numbers(usize),
    /// Any number of numbers.
    List,
    /// Arrays of so many numbers each.
    Rows(usize),
    /// A table.
    Table(&'static Spec),
    /// An array of forms.
    Array(&'static Form),
    /// One of several.
    OneOf(&'static [Form]),
}

/// True if the field at a dotted path, as overrides have it, is a whole number.
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
        // An element may be called by its name.
        (Form::Array(inner), _) => {
            counts(inner, steps) || matches!(steps, [_, rest @ ..] if counts(inner, rest))
        }
        (Form::OneOf(forms), _) => forms.iter().any(|form| counts(form, steps)),
        _ => false,
    }
}

/// Whether a field must be given.
pub(super) enum Need {
    /// Yes; a line as an example.
    Yes(&'static str),
    /// No; its default, in TOML.
    Or(&'static str),
    /// No; what happens without it is in its documentation.
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
