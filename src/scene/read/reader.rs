//! Reads a TOML document field by field and collects every fault on the way.
//!
//! serde stops at the first error; here a reader that fails records a [`Fault`] and gives `None`,
//! and the caller goes on. Invariant: `None` means that a fault was recorded.

use super::fields::{Field, Form, HOMES, Kinds, Need, PLANE, SPACE, Spec};
use super::rule::{FINITE, Rule};
use super::sources::{Place, Refused, Sources, apply};
use crate::scene::{Fault, FaultKind, Faults};
use std::cell::{Cell, RefCell};
use std::fmt;
use std::ops::Range;
use toml::Spanned;
use toml::de::{DeTable, DeValue};

/// Longest excerpt of a value in a fault, in characters.
const EXCERPT: usize = 48;
/// Longer unknown names get no suggestion: they are no typing slip.
const LONGEST_NAME: usize = 64;

/// What stands in for an absent field whose value is read by a function.
pub(super) enum Absent<T> {
    /// Nothing; the fault shows the example of the table.
    Fault,
    /// This.
    Or(T),
}

/// Faults that are kept with their texts; more are only counted.
const KEPT: usize = 1000;

/// The text, what overrides it, and the faults found in them so far.
pub(super) struct Reader<'a> {
    text: &'a Sources,
    /// The kind of the scene.
    pub kind: Cell<Kinds>,
    faults: RefCell<Vec<Fault>>,
    more: Cell<usize>,
}

impl<'a> Reader<'a> {
    pub fn new(text: &'a Sources) -> Self {
        Self {
            text,
            kind: Cell::new(PLANE),
            faults: RefCell::default(),
            more: Cell::new(0),
        }
    }

    pub fn into_faults(self) -> Faults {
        Faults::new(self.faults.into_inner(), self.more.get())
    }

    pub fn is_clean(&self) -> bool {
        self.faults.borrow().is_empty()
    }

    /// True if another fault would only be counted, and its words need not be found.
    fn is_full(&self) -> bool {
        self.faults.borrow().len() >= KEPT
    }

    /// The document with its overrides, or the syntax faults.
    pub fn document(&self) -> Option<DeTable<'a>> {
        let mut document = match DeTable::parse(self.text.document()) {
            Ok(document) => document.into_inner(),
            Err(error) => {
                let at = error.span().map_or(0, |span| span.start);
                self.syntax(at, error.message());
                return None;
            }
        };
        for (start, text) in self.text.overrides() {
            if let Err(Refused { at, message }) = apply(&mut document, start, text) {
                self.syntax(at, &message);
            }
        }
        self.is_clean().then_some(document)
    }

    /// Records that the text is not TOML from byte `at` on.
    pub fn syntax(&self, at: usize, message: &str) {
        let line = self.text.line_around(at);
        self.record(FaultKind::Syntax, at, "", Some(line), message, None);
    }

    /// Where byte `at` is, in words.
    pub fn place(&self, at: usize) -> String {
        match self.text.place(at) {
            Place::Text { line, .. } => format!("line {line}"),
            Place::Override(text) => format!("--set {}", shorten(text)),
        }
    }

    /// Records a fault in the value at `span`.
    pub fn fault(
        &self,
        kind: FaultKind,
        field: &str,
        span: Range<usize>,
        allowed: impl Into<String>,
        hint: Option<String>,
    ) {
        self.record(kind, span.start, field, Some(span), allowed, hint);
    }

    /// Records a fault at byte `at` that shows the text of `value`, if there is one to show.
    pub fn record(
        &self,
        kind: FaultKind,
        at: usize,
        field: &str,
        value: Option<Range<usize>>,
        allowed: impl Into<String>,
        hint: Option<String>,
    ) {
        if self.is_full() {
            self.more.set(self.more.get() + 1);
            return;
        }
        let ((line, column), set) = match self.text.place(at) {
            Place::Text { line, column } => ((line, column), None),
            Place::Override(text) => ((0, 0), Some(shorten(text))),
        };
        self.faults.borrow_mut().push(Fault {
            kind,
            line,
            column,
            set,
            field: field.to_owned(),
            value: value.and_then(|span| self.text.get(span)).map(shorten),
            allowed: allowed.into(),
            hint,
        });
    }

    /// Records a wrong type, saying what was found.
    pub fn wrong_type(
        &self,
        field: &str,
        value: &Spanned<DeValue>,
        allowed: &str,
        hint: Option<&str>,
    ) {
        let found = kind_of(value.get_ref());
        let hint = match hint {
            Some(hint) => format!("it is {found}: {hint}"),
            None => format!("it is {found}"),
        };
        self.fault(FaultKind::Type, field, value.span(), allowed, Some(hint));
    }

    /// A float or an integer that satisfies `rule`.
    pub fn number(&self, field: &str, value: &Spanned<DeValue>, rule: &Rule) -> Option<f64> {
        let number = match value.get_ref() {
            // The parser has checked the digits; a float too large for f64 becomes infinite and is
            // refused by the rule.
            DeValue::Float(float) => float.as_str().parse().unwrap_or(f64::NAN),
            DeValue::Integer(integer) if integer.radix() == 10 => {
                integer.as_str().parse().unwrap_or(f64::NAN)
            }
            DeValue::Integer(integer) => u128::from_str_radix(integer.as_str(), integer.radix())
                .map_or(f64::NAN, |i| i as f64),
            other => {
                let quoted = other.as_str().is_some_and(|s| s.parse::<f64>().is_ok());
                let hint = quoted.then_some("leave out the quotes");
                self.wrong_type(field, value, rule.allowed, hint);
                return None;
            }
        };
        if (rule.holds)(number) {
            return Some(number);
        }
        let hint = (rule.hint)(number).map(str::to_owned);
        self.fault(FaultKind::Value, field, value.span(), rule.allowed, hint);
        None
    }

    /// An integer in `range`.
    pub fn count(
        &self,
        field: &str,
        value: &Spanned<DeValue>,
        (least, most): (usize, usize),
    ) -> Option<usize> {
        let allowed = format!("an integer from {least} to {most}");
        let Some(integer) = value.get_ref().as_integer() else {
            let float = value.get_ref().as_float();
            let whole = float
                .and_then(|f| f.as_str().parse::<f64>().ok())
                .filter(|f| least as f64 <= *f && *f <= most as f64 && f.fract() == 0.0)
                .map(|f| format!("write it without a point or an exponent: {f:.0}"));
            self.wrong_type(field, value, &allowed, whole.as_deref());
            return None;
        };
        let count = usize::from_str_radix(integer.as_str(), integer.radix())
            .ok()
            .filter(|count| (least..=most).contains(count));
        if count.is_none() {
            self.fault(FaultKind::Value, field, value.span(), allowed, None);
        }
        count
    }

    /// So many finite numbers.
    pub fn vector<const N: usize>(
        &self,
        field: &str,
        value: &Spanned<DeValue>,
        rule: &Rule,
    ) -> Option<[f64; N]> {
        let parse = |field: &str, value: &_| self.number(field, value, rule);
        self.array(field, value, vector_words(N), parse)
    }

    /// A vector: two numbers in the plane, where the third is 0, three in space.
    pub fn point(&self, field: &str, value: &Spanned<DeValue>, rule: &Rule) -> Option<[f64; 3]> {
        if self.kind.get() == PLANE {
            let [x, y] = self.vector(field, value, rule)?;
            return Some([x, y, 0.0]);
        }
        self.vector(field, value, rule)
    }

    /// So many elements, each read by `parse`.
    pub fn array<'v, T, const N: usize>(
        &self,
        field: &str,
        value: &'v Spanned<DeValue<'v>>,
        allowed: &str,
        parse: impl Fn(&str, &'v Spanned<DeValue<'v>>) -> Option<T>,
    ) -> Option<[T; N]> {
        let elements = self.list(field, value, allowed, parse)?;
        let count = elements.len();
        let Ok(elements) = <[Option<T>; N]>::try_from(elements) else {
            let hint = Some(format!("it has {count} elements"));
            self.fault(FaultKind::Value, field, value.span(), allowed, hint);
            return None;
        };
        let elements: Option<Vec<T>> = elements.into_iter().collect();
        elements?.try_into().ok()
    }

    /// Any number of elements, each read by `parse`; `None` for those with faults.
    pub fn list<'v, T>(
        &self,
        field: &str,
        value: &'v Spanned<DeValue<'v>>,
        allowed: &str,
        parse: impl Fn(&str, &'v Spanned<DeValue<'v>>) -> Option<T>,
    ) -> Option<Vec<Option<T>>> {
        let Some(array) = value.get_ref().as_array() else {
            self.wrong_type(field, value, allowed, None);
            return None;
        };
        let read = |(i, value)| parse(&format!("{field}[{i}]"), value);
        Some(array.iter().enumerate().map(read).collect())
    }

    /// true or false.
    pub fn flag(&self, field: &str, value: &Spanned<DeValue>) -> Option<bool> {
        let flag = value.get_ref().as_bool();
        if flag.is_none() {
            let quoted = value.get_ref().as_str();
            let hint = matches!(quoted, Some("true" | "false")).then_some("leave out the quotes");
            self.wrong_type(field, value, "true or false", hint);
        }
        flag
    }

    /// One of the words in `choices`.
    pub fn choice<T: Clone>(
        &self,
        field: &str,
        value: &Spanned<DeValue>,
        choices: &[(&'static str, T)],
        allowed: &str,
    ) -> Option<T> {
        let Some(word) = value.get_ref().as_str() else {
            self.wrong_type(field, value, allowed, None);
            return None;
        };
        if let Some((_, choice)) = choices.iter().find(|(name, _)| *name == word) {
            return Some(choice.clone());
        }
        let hint = nearest(word, choices.iter().map(|(name, _)| *name))
            .map(|name| format!("did you mean {name:?}?"));
        self.fault(FaultKind::Value, field, value.span(), allowed, hint);
        None
    }

    /// A table that holds what `spec` says.
    pub fn table(
        &'a self,
        field: &str,
        value: &'a Spanned<DeValue<'a>>,
        spec: &'static Spec,
        allowed: &str,
    ) -> Option<Table<'a>> {
        let Some(entries) = value.get_ref().as_table() else {
            self.wrong_type(field, value, allowed, None);
            return None;
        };
        let at = value.span().start;
        Some(Table::open(self, field, entries, at, spec))
    }
}

/// One table of the document, its unknown fields already reported.
pub(super) struct Table<'a> {
    /// Where faults go.
    pub reader: &'a Reader<'a>,
    path: String,
    spec: &'static Spec,
    entries: &'a DeTable<'a>,
    /// Byte at which the table begins.
    pub at: usize,
    /// Misspelt fields: (what was meant, what was written). They are reported, then read as what
    /// was meant, so that one slip does not also count as a missing field and hides no other fault.
    slips: Vec<(&'static str, &'a str)>,
}

impl<'a> Table<'a> {
    /// Opens a table and reports the fields that `spec` does not hold in a scene of this kind.
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
                reader.more.set(reader.more.get() + 1);
                continue;
            }
            let field = table.field(name);
            // The text of a table would only repeat its name.
            let shown = (!value.get_ref().is_table()).then(|| value.span());
            let barred = |(on, barred, _): &&(Kinds, &str, &str)| *barred == name && on & kind != 0;
            if let Some((_, _, hint)) = spec.barred.iter().find(barred) {
                let (at, hint) = (value.span().start, Some((*hint).to_owned()));
                reader.record(FaultKind::Conflict, at, &field, shown, "left out", hint);
                continue;
            }
            let hint = table.misplaced(name).or_else(|| {
                let meant = nearest(name, spec.names(kind))?;
                // Of two slips for one field the first in the table wins.
                if !entries.contains_key(meant) && table.slip(meant).is_none() {
                    table.slips.push((meant, name));
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

    /// Where a field that this table does not have belongs, if it is known.
    fn misplaced(&self, name: &str) -> Option<String> {
        let kind = self.reader.kind.get();
        let header = HOMES.iter().any(|home| home.name == self.spec.name);
        let home = HOMES
            .iter()
            .find(|home| header && home.field(name, kind).is_some());
        if let Some(home) = home {
            return Some(match home.name {
                "" => format!("`{name}` belongs at the top of the file, before the first [table]"),
                home => format!("`{name}` belongs in [{home}]"),
            });
        }
        let other = self.spec.field(name, Kinds::MAX)?;
        Some(match other.on {
            PLANE => format!("`{name}` is for scenes in the plane, rod.model = \"elastica\""),
            SPACE => {
                format!("`{name}` is for motions in space, rod.model = \"cosserat\" with [run]")
            }
            _ => format!("`{name}` is for rods in space, rod.model = \"cosserat\""),
        })
    }

    fn slip(&self, meant: &str) -> Option<&'a str> {
        let found = self.slips.iter().find(|(field, _)| *field == meant);
        found.map(|(_, written)| *written)
    }

    /// Path of a field of this table.
    pub fn field(&self, name: &str) -> String {
        let bare = |c: char| c.is_ascii_alphanumeric() || c == '_' || c == '-';
        let name = match !name.is_empty() && name.chars().all(bare) {
            true => shorten(name),
            false => shorten(&format!("{name:?}")),
        };
        match self.path.is_empty() {
            true => name,
            false => format!("{}.{name}", self.path),
        }
    }

    /// The value of a field, if it was given.
    pub fn get(&self, name: &str) -> Option<&'a Spanned<DeValue<'a>>> {
        let written = self.slip(name).unwrap_or(name);
        self.entries.get(written)
    }

    /// Where a field is, in words, if it was given.
    fn place_of(&self, name: &str) -> Option<String> {
        let value = self.get(name)?;
        Some(self.reader.place(value.span().start))
    }

    /// The entry of a field in the tables.
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
            inline if inline.contains('.') => format!("in {inline}"),
            header => format!("in [{header}]"),
        };
        let hint = Some(format!("write `{example}` {place}"));
        let field = self.field(name);
        let reader = self.reader;
        reader.record(FaultKind::Missing, self.at, &field, None, allowed, hint);
    }

    /// Reports that `name` stands where `others` exclude it.
    pub fn conflict(&self, name: &str, others: &[&str], hint: &str) {
        let Some(value) = self.get(name) else { return };
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
        let (field, hint) = (self.field(name), Some(hint.to_owned()));
        let kind = FaultKind::Conflict;
        self.reader.fault(kind, &field, value.span(), allowed, hint);
    }

    /// Reads a field with `parse`, or takes what stands in for it.
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
                let example = match self.of(name).need {
                    Need::Yes(example) => example,
                    _ => name,
                };
                self.missing(name, allowed, example);
                None
            }
        }
    }

    /// A field of the tables by its form, its default parsed by `default`.
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
            Form::Number(rule) | Form::Vector(rule) | Form::OneOf([Form::Number(rule), ..]) => rule,
            _ => &FINITE,
        }
    }

    /// A number, as the tables have it.
    pub fn number(&self, name: &str) -> Option<f64> {
        let rule = self.rule(name);
        let default = |text: &str| text.parse().ok();
        self.by_form(name, rule.allowed, default, |field, value| {
            self.reader.number(field, value, rule)
        })
    }

    /// The default of a number; NaN if it has none.
    pub fn default(&self, name: &str) -> f64 {
        match self.of(name).need {
            Need::Or(text) => text.parse().unwrap_or(f64::NAN),
            _ => f64::NAN,
        }
    }

    /// A number, if it was given.
    pub fn optional(&self, name: &str) -> Option<Option<f64>> {
        let rule = self.rule(name);
        self.read(name, rule.allowed, Absent::Or(None), |field, value| {
            self.reader.number(field, value, rule).map(Some)
        })
    }

    /// An integer, as the tables have it.
    pub fn count(&self, name: &str) -> Option<usize> {
        let Form::Count(least, most) = self.of(name).form else {
            return None;
        };
        let allowed = format!("an integer from {least} to {most}");
        let default = |text: &str| text.parse().ok();
        self.by_form(name, &allowed, default, |field, value| {
            self.reader.count(field, value, (least, most))
        })
    }

    /// true or false, as the tables have it.
    pub fn flag(&self, name: &str) -> Option<bool> {
        let default = |text: &str| text.parse().ok();
        self.by_form(name, "true or false", default, |field, value| {
            self.reader.flag(field, value)
        })
    }

    /// The one of the field's words that was given, of which `choices` has the meanings; its default is the first of them.
    pub fn word<T: Clone>(&self, name: &str, choices: &[T]) -> Option<T> {
        let words: &'static [&'static str] = match &self.of(name).form {
            Form::Word(words) | Form::OneOf([Form::Word(words), ..]) => words,
            _ => &[],
        };
        let pairs: Vec<(&'static str, T)> =
            words.iter().copied().zip(choices.iter().cloned()).collect();
        let allowed = listed(words);
        let default = |_: &str| choices.first().cloned();
        self.by_form(name, &allowed, default, |field, value| {
            self.reader.choice(field, value, &pairs, &allowed)
        })
    }

    /// A vector: two numbers in the plane, where the third is 0, three in space.
    pub fn vector(&self, name: &str) -> Option<[f64; 3]> {
        let plane = self.reader.kind.get() == PLANE;
        let allowed = vector_words(if plane { 2 } else { 3 });
        let default = |_: &str| Some([0.0; 3]);
        self.by_form(name, allowed, default, |field, value| {
            self.reader.point(field, value, self.rule(name))
        })
    }
}

/// `"a", "b" or "c"`.
pub(super) fn listed(words: &[&str]) -> String {
    let quoted: Vec<String> = words.iter().map(|word| format!("{word:?}")).collect();
    match quoted.split_last() {
        Some((last, [])) => last.clone(),
        Some((last, rest)) => format!("{} or {last}", rest.join(", ")),
        None => String::new(),
    }
}

/// What an array of so many numbers must be.
fn vector_words(count: usize) -> &'static str {
    match count {
        2 => "an array of two finite numbers, [x, y]",
        3 => "an array of three finite numbers, [x, y, z]",
        4 => "an array of four finite numbers",
        _ => "an array of six finite numbers",
    }
}

/// The nearest of `names` to `word`, if near enough for a typing slip: one edit, and one more for
/// every four letters; or one name that contains the other.
pub(super) fn nearest<'n>(word: &str, names: impl Iterator<Item = &'n str>) -> Option<&'n str> {
    if word.len() > LONGEST_NAME {
        return None;
    }
    let word = word.to_lowercase().replace('-', "_");
    names
        .filter_map(|name| {
            let edits = strsim::osa_distance(&word, name);
            let part =
                word.len().min(name.len()) >= 4 && (name.contains(&word) || word.contains(name));
            (edits <= 1 + word.len() / 4 && edits < name.len() || part).then_some((edits, name))
        })
        .min()
        .map(|(_, name)| name)
}

/// One line of at most [`EXCERPT`] characters.
pub(super) fn shorten(text: &str) -> String {
    // Taken first, so that a huge value costs nothing.
    let head: String = text.chars().take(4 * EXCERPT).collect();
    let line = head.split_whitespace().collect::<Vec<_>>().join(" ");
    let whole = head.len() == text.len() && line.chars().count() <= EXCERPT;
    match whole {
        true => line,
        false => line
            .chars()
            .take(EXCERPT - 3)
            .chain("...".chars())
            .collect(),
    }
}

/// The type of a value, with its article.
fn kind_of(value: &DeValue) -> &'static str {
    match value {
        DeValue::String(_) => "a string",
        DeValue::Integer(_) => "an integer",
        DeValue::Float(_) => "a float",
        DeValue::Boolean(_) => "a boolean",
        DeValue::Datetime(_) => "a date",
        DeValue::Array(_) => "an array",
        DeValue::Table(_) => "a table",
    }
}

/// A number of a message, which prints in a few characters whatever its size.
pub(super) struct Short(pub f64);

impl fmt::Display for Short {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self.0 == 0.0 || (1e-5..1e16).contains(&self.0.abs()) {
            true => self.0.fmt(f),
            false => fmt::LowerExp::fmt(&self.0, f),
        }
    }
}
