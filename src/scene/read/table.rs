//! A table of the document, with readers for the forms of its fields.

use super::fields::{
    ASSEMBLY, BAR, FLOWS, Field, Form, HOMES, INFLATED, INFLATIONS, Kinds, MEMBRANES, Need, PLANE,
    SPACE, Spec, TUBED, TUBES,
};
use super::kind::MODELS;
use super::phrases::{listed, nearest, shorten, vector_words};
use super::ranges::{FINITE, Rule};
use super::reader::{Hint, Reader};
use crate::scene::FaultKind;
use toml::Spanned;
use toml::de::{DeTable, DeValue};

/// Treatment of an absent field.
pub(super) enum Absent<T> {
    /// A fault that shows the example of the description.
    Fault,
    /// This default value.
    Or(T),
}

/// A table of the document, its unknown fields already reported.
pub(super) struct Table<'a> {
    /// Reader that collects the faults.
    pub reader: &'a Reader<'a>,
    path: String,
    spec: &'static Spec,
    entries: &'a DeTable<'a>,
    /// First byte of the table.
    pub at: usize,
    /// Misspelt fields: (name meant, name written). A misspelt field is reported, then read under the name meant. Hence
    /// one slip does not also count as a missing field and hides no other fault.
    slips: Vec<(&'static str, &'a str)>,
}

/// One of two fields of which exactly one is given.
pub(super) struct Alternative<'a, T> {
    pub name: &'a str,
    /// The value; inner None: the field is absent, outer None: it is faulty.
    pub value: Option<Option<T>>,
}

/// Fault of a field that is not given, though needed.
pub(super) struct MissingField<'a> {
    pub name: &'a str,
    pub allowed: &'a str,
    pub example: &'a str,
}

impl<'a> Table<'a> {
    /// Opens a table and reports the fields that `spec` lacks in scenes of the current kind.
    pub fn open(
        reader: &'a Reader<'a>,
        path: &str,
        entries: &'a DeTable<'a>,
        at: usize,
        spec: &'static Spec,
    ) -> Self {
        let mut table = Self {
            reader,
            path: path.to_owned(),
            spec,
            entries,
            at,
            slips: Vec::new(),
        };
        let kind = reader.kind.get();
        for (key, value) in entries.iter() {
            let name: &'a str = key.get_ref();
            if spec.field(name, kind).is_some() {
                continue;
            }
            if reader.is_full() {
                reader.count_on();
                continue;
            }
            let field = table.field(name);
            // The text of a table would only repeat its name.
            let shown = (!value.get_ref().is_table()).then(|| value.span());
            let barred = |(on, barred, _): &&(Kinds, &str, &str)| *barred == name && on & kind != 0;
            if let Some((_, _, hint)) = spec.barred.iter().find(barred) {
                let at = value.span().start;
                reader.record(FaultKind::Conflict, at, &field, shown, "left out", *hint);
                continue;
            }
            let hint = table.misplaced(name).or_else(|| {
                let meant = nearest(name, &mut spec.names(kind))?;
                // Of two misspellings of one field the first in the table counts.
                if !entries.contains_key(meant) && table.slip(meant).is_none() {
                    table.slips.push((meant, name));
                    reader.slipped(value);
                }
                Some(format!("did you mean `{meant}`?"))
            });
            let names: Vec<&str> = spec.names(kind).collect();
            let allowed = format!("one of {}", names.join(", "));
            let at = key.span().start;
            reader.record(FaultKind::Unknown, at, &field, shown, allowed, hint);
        }
        table
    }

    /// Advice on the proper place of a misplaced field, if known.
    fn misplaced(&self, name: &str) -> Option<String> {
        let kind = self.reader.kind.get();
        let header = HOMES.iter().any(|home| home.name == self.spec.name);
        let home = HOMES
            .iter()
            .find(|home| header && home.field(name, kind).is_some());
        if let Some(home) = home {
            return Some(match home.name {
                "" => format!("`{name}` belongs at the top of the file, before the first [table]"),
                home @ ("rod" | "body") if kind == ASSEMBLY => {
                    format!("`{name}` belongs in [[{home}]]")
                }
                home => format!("`{name}` belongs in [{home}]"),
            });
        }
        let other = self.spec.field(name, Kinds::MAX)?;
        Some(match other.on {
            PLANE => format!("`{name}` is for scenes in the plane, rod.model = \"elastica\""),
            SPACE => {
                format!("`{name}` is for motions in space, rod.model = \"cosserat\" with [run]")
            }
            TUBES | MEMBRANES | INFLATED | TUBED => {
                format!(
                    "`{name}` is for walls under pressure, [tube] or [membrane] in place of [rod]"
                )
            }
            INFLATIONS => format!("`{name}` is for membranes in motion, [membrane] with [run]"),
            FLOWS => format!("`{name}` is for flows in tubes, [tube] with [run]"),
            BAR => format!("`{name}` is for bars in longitudinal motion, rod.model = \"bar\""),
            ASSEMBLY => format!("`{name}` is for assemblies, [[rod]] and [[body]]"),
            _ => format!("`{name}` is for rods in space, rod.model = \"cosserat\""),
        })
    }

    /// Opens a table inside this one.
    pub fn inner(&self, name: &str, spec: &'static Spec) -> Option<Table<'a>> {
        let (value, field) = (self.get(name)?, self.field(name));
        let allowed = format!("a table, [{field}]");
        self.reader.table(&field, value, spec, &allowed)
    }

    fn slip(&self, meant: &str) -> Option<&'a str> {
        let found = self.slips.iter().find(|(field, _)| *field == meant);
        found.map(|(_, written)| *written)
    }

    /// Path of the table; empty for the top of the file.
    pub fn path(&self) -> &str {
        &self.path
    }

    /// Path of a field of this table.
    pub fn field(&self, name: &str) -> String {
        let bare = |c: char| c.is_ascii_alphanumeric() || c == '_' || c == '-';
        let name = if !name.is_empty() && name.chars().all(bare) {
            shorten(name)
        } else {
            shorten(&format!("{name:?}"))
        };
        if self.path.is_empty() {
            name
        } else {
            format!("{}.{name}", self.path)
        }
    }

    /// Value of a field, if given.
    pub fn get(&self, name: &str) -> Option<&'a Spanned<DeValue<'a>>> {
        let written = self.slip(name).unwrap_or(name);
        self.entries.get(written)
    }

    /// True if a field was given.
    pub fn has(&self, name: &str) -> bool {
        self.get(name).is_some()
    }

    /// True if the table has such a field in scenes of the current kind.
    pub fn knows(&self, name: &str) -> bool {
        self.spec.field(name, self.reader.kind.get()).is_some()
    }

    /// The given ones among these fields.
    pub fn given<'n>(&self, names: &[&'n str]) -> Vec<&'n str> {
        names
            .iter()
            .copied()
            .filter(|name| self.has(name))
            .collect()
    }

    /// Place of a given field, in words.
    fn place_of(&self, name: &str) -> Option<String> {
        let value = self.get(name)?;
        Some(self.reader.place(value.span().start))
    }

    /// Description of a field.
    fn of(&self, name: &str) -> &'static Field {
        static NONE: Field = Field {
            name: "",
            on: 0,
            form: Form::Number(&FINITE),
            unit: "",
            need: Need::No,
            doc: "",
        };
        let found = self.spec.field(name, self.reader.kind.get());
        debug_assert!(found.is_some(), "{} {name}", self.spec.name);
        found.unwrap_or(&NONE)
    }

    /// Reports a required field that is absent.
    pub fn missing(&self, name: &str, allowed: &str, example: &str) {
        let place = match self.path.as_str() {
            "" => "at the top of the file".to_owned(),
            inline if inline.contains(['.', '[']) => format!("in {inline}"),
            header => format!("in [{header}]"),
        };
        let (field, hint) = (self.field(name), format!("write `{example}` {place}"));
        self.reader
            .record(FaultKind::Missing, self.at, &field, None, allowed, hint);
    }

    /// Reports that `name` conflicts with the given fields among `others`.
    pub fn conflict(&self, name: &str, others: &[&str], hint: &str) {
        let Some(value) = self.get(name) else { return };
        // For a misspelt field the name meant is only a guess, so a conflict proves nothing.
        let others: Vec<&str> = others
            .iter()
            .copied()
            .filter(|other| self.slip(other).is_none())
            .collect();
        if others.is_empty() {
            return;
        }
        let named = |other: &&str| {
            let place = self.place_of(other)?;
            Some(format!("{} ({place})", self.field(other)))
        };
        let others: Vec<String> = others.iter().filter_map(named).collect();
        let verb = if others.len() == 1 { "is" } else { "are" };
        let place = self.reader.place(value.span().start);
        let allowed = format!(
            "left out ({place}) where {} {verb} given",
            others.join(" and ")
        );
        self.fault(FaultKind::Conflict, name, allowed, hint);
    }

    /// Records a fault in a given field.
    pub fn fault(
        &self,
        kind: FaultKind,
        name: &str,
        allowed: impl Into<String>,
        hint: impl Into<Hint>,
    ) {
        if let Some(value) = self.get(name) {
            let field = self.field(name);
            self.reader.fault(kind, &field, value, allowed, hint);
        }
    }

    /// Records a fault in a given field and returns `None`.
    pub fn refuse<T>(
        &self,
        kind: FaultKind,
        name: &str,
        allowed: impl Into<String>,
        hint: impl Into<Hint>,
    ) -> Option<T> {
        self.fault(kind, name, allowed, hint);
        None
    }

    /// Reads a given field with `parse`; treats an absent one by `absent`.
    pub fn read<T>(
        &self,
        name: &str,
        allowed: &str,
        absent: Absent<T>,
        parse: impl FnOnce(&str, &'a Spanned<DeValue<'a>>) -> Option<T>,
    ) -> Option<T> {
        match (self.get(name), absent) {
            (Some(value), _) => parse(&self.field(name), value),
            (None, Absent::Or(default)) => Some(default),
            (None, Absent::Fault) => {
                self.absent(name, allowed);
                None
            }
        }
    }

    /// Reports an absent required field, with the example of its description.
    fn absent(&self, name: &str, allowed: &str) {
        let example = match self.of(name).need {
            Need::Yes(example) => example,
            _ => name,
        };
        self.missing(name, allowed, example);
    }

    /// Reads a field, if given.
    pub fn maybe<T>(
        &self,
        name: &str,
        parse: impl FnOnce(&str, &'a Spanned<DeValue<'a>>) -> Option<T>,
    ) -> Option<Option<T>> {
        self.read(name, "", Absent::Or(None), |field, value| {
            parse(field, value).map(Some)
        })
    }

    /// The given one of two fields. The hint `keep` is for both given, `absent` for none.
    pub fn either<T>(
        &self,
        first: Alternative<'_, T>,
        second: Alternative<'_, T>,
        keep: &str,
        absent: &MissingField<'_>,
    ) -> Option<T> {
        match (first.value?, second.value?) {
            (Some(value), None) | (None, Some(value)) => return Some(value),
            (Some(_), Some(_)) => self.conflict(second.name, &[first.name], keep),
            (None, None) => self.missing(absent.name, absent.allowed, absent.example),
        }
        None
    }

    /// Reads a field by its description; `default` parses the default.
    fn by_form<T>(
        &self,
        name: &str,
        allowed: &str,
        default: impl FnOnce(&str) -> Option<T>,
        parse: impl FnOnce(&str, &'a Spanned<DeValue<'a>>) -> Option<T>,
    ) -> Option<T> {
        let absent = match self.of(name).need {
            Need::Or(text) => default(text).map_or(Absent::Fault, Absent::Or),
            Need::Yes(_) | Need::No => Absent::Fault,
        };
        self.read(name, allowed, absent, parse)
    }

    fn rule(&self, name: &str) -> &'static Rule {
        match &self.of(name).form {
            Form::Number(rule)
            | Form::Vector(rule)
            | Form::OneOf([Form::Number(rule) | Form::Vector(rule), ..]) => rule,
            _ => &FINITE,
        }
    }

    /// Reads a number by its description.
    pub fn number(&self, name: &str) -> Option<f64> {
        let rule = self.rule(name);
        let default = |text: &str| text.parse().ok();
        self.by_form(name, rule.allowed, default, |field, value| {
            self.reader.number(field, value, rule)
        })
    }

    /// Default of a number; NaN if there is none.
    pub fn default(&self, name: &str) -> f64 {
        match self.of(name).need {
            Need::Or(text) => text.parse().unwrap_or(f64::NAN),
            _ => f64::NAN,
        }
    }

    /// Reads a number, if given.
    pub fn optional(&self, name: &str) -> Option<Option<f64>> {
        let rule = self.rule(name);
        self.maybe(name, |field, value| self.reader.number(field, value, rule))
    }

    /// Reads an integer by its description.
    pub fn count(&self, name: &str) -> Option<usize> {
        let Form::Count(least, most) = self.of(name).form else {
            return None;
        };
        let allowed = format!("an integer from {least} to {most}");
        let default = |text: &str| text.parse().ok();
        self.by_form(name, &allowed, default, |field, value| {
            self.reader.count(field, value, least, most)
        })
    }

    /// Reads true or false by its description.
    pub fn flag(&self, name: &str) -> Option<bool> {
        let default = |text: &str| text.parse().ok();
        self.by_form(name, "true or false", default, |field, value| {
            self.reader.flag(field, value)
        })
    }

    /// Reads one of the field's words, whose meanings are `choices` in the same order; the default is the first.
    pub fn word<T: Clone>(&self, name: &str, choices: &[T]) -> Option<T> {
        let words: &'static [&'static str] = match &self.of(name).form {
            Form::Word(words) | Form::OneOf([Form::Word(words), ..]) => words,
            _ => &[],
        };
        let pairs: Vec<(&'static str, T)> =
            words.iter().copied().zip(choices.iter().cloned()).collect();
        // Any model is allowed: the model determines the kind of scene.
        let allowed = if name == "model" && self.reader.kind.get() != ASSEMBLY {
            listed(&MODELS)
        } else {
            listed(words)
        };
        let default = |_: &str| choices.first().cloned();
        self.by_form(name, &allowed, default, |field, value| {
            self.reader.choice(field, value, &pairs, &allowed)
        })
    }

    /// Reads a vector: three numbers in space, two in the plane, where the third is 0.
    pub fn vector(&self, name: &str) -> Option<[f64; 3]> {
        let plane = self.reader.kind.get() == PLANE;
        let allowed = vector_words(if plane { 2 } else { 3 });
        let default = |_: &str| Some([0.0; 3]);
        self.by_form(name, allowed, default, |field, value| {
            self.reader.point(field, value, self.rule(name))
        })
    }
}
