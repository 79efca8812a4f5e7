//! Reader of a TOML document, field by field, that collects every fault.
//!
//! serde stops at the first error. Here a reader that fails records a [`Fault`] and returns `None`, and the caller goes
//! on. Invariant: `None` means that a fault was recorded.

use super::fields::{Kinds, PLANE, Spec};
use super::phrases::{nearest, shorten, type_name, vector_words};
use super::ranges::Rule;
use super::sources::{OverrideError, SourcePlace, Sources, apply};
use super::table::Table;
use crate::scene::{Fault, FaultKind, Faults};
use std::cell::{Cell, RefCell};
use std::ops::Range;
use std::path::PathBuf;
use toml::Spanned;
use toml::de::{DeTable, DeValue};

/// Advice on the correction of a fault, if any.
pub(super) struct Hint(Option<String>);

impl From<Option<String>> for Hint {
    fn from(hint: Option<String>) -> Self {
        Self(hint)
    }
}

impl From<String> for Hint {
    fn from(hint: String) -> Self {
        Self(Some(hint))
    }
}

impl From<&str> for Hint {
    fn from(hint: &str) -> Self {
        Self(Some(hint.to_owned()))
    }
}

/// Number of faults kept with their texts; further faults are only counted.
const MAX_KEPT_FAULTS: usize = 1000;

/// The text with its overrides, and the faults found up to now.
pub(super) struct Reader<'a> {
    text: &'a Sources,
    /// Kind of the scene.
    pub kind: Cell<Kinds>,
    faults: RefCell<Vec<Fault>>,
    /// Start bytes of the values of misspelt fields.
    slips: RefCell<Vec<usize>>,
    more: Cell<usize>,
    /// True if an override could not be set: fields may be missing because of it.
    unset: Cell<bool>,
}

impl<'a> Reader<'a> {
    pub fn new(text: &'a Sources) -> Self {
        Self {
            text,
            kind: Cell::new(PLANE),
            faults: RefCell::default(),
            slips: RefCell::default(),
            more: Cell::new(0),
            unset: Cell::new(false),
        }
    }

    /// Path of a file that the text names.
    pub fn beside(&self, file: &str) -> PathBuf {
        self.text.beside(file)
    }

    pub fn into_faults(self) -> Faults {
        let mut faults = self.faults.into_inner();
        if self.unset.get() {
            // An override that failed may have been to add the missing field, or to end the conflict.
            faults.retain(|f| !matches!(f.kind, FaultKind::Missing | FaultKind::Conflict));
        }
        Faults::new(faults, self.more.get())
    }

    pub fn is_clean(&self) -> bool {
        self.faults.borrow().is_empty()
    }

    /// True if a further fault would only be counted, without its text.
    pub fn is_full(&self) -> bool {
        self.faults.borrow().len() >= MAX_KEPT_FAULTS
    }

    /// Counts a fault that is not kept.
    pub fn count_on(&self) {
        self.more.set(self.more.get() + 1);
    }

    /// The document with the overrides that can be set, or `None` if the document is not TOML.
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
            if let Err(OverrideError { at, message }) = apply(&mut document, start, text) {
                self.syntax(at, &message);
                self.unset.set(true);
            }
        }
        Some(document)
    }

    /// Records that the text is not TOML from byte `at` on.
    pub fn syntax(&self, at: usize, message: &str) {
        let line = self.text.line_around(at);
        self.record(FaultKind::Syntax, at, "", Some(line), message, None);
    }

    /// Marks the field of a value as misspelt; the value is read as that of the field probably meant.
    pub fn slipped(&self, value: &Spanned<DeValue>) {
        self.slips.borrow_mut().push(value.span().start);
    }

    /// Place of byte `at`, in words.
    pub fn place(&self, at: usize) -> String {
        match self.text.place(at) {
            SourcePlace::Text { line, .. } => format!("line {line}"),
            SourcePlace::Override(text) => format!("--set {}", shorten(text)),
        }
    }

    /// Records a fault in a value.
    pub fn fault(
        &self,
        kind: FaultKind,
        field: &str,
        value: &Spanned<DeValue>,
        allowed: impl Into<String>,
        hint: impl Into<Hint>,
    ) {
        let span = value.span();
        self.record(kind, span.start, field, Some(span), allowed, hint);
    }

    /// Records a fault in a value and returns `None`.
    pub fn refuse<T>(
        &self,
        kind: FaultKind,
        field: &str,
        value: &Spanned<DeValue>,
        allowed: impl Into<String>,
        hint: impl Into<Hint>,
    ) -> Option<T> {
        self.fault(kind, field, value, allowed, hint);
        None
    }

    /// Records a fault at byte `at`, and shows the text of `value` if given.
    pub fn record(
        &self,
        kind: FaultKind,
        at: usize,
        field: &str,
        value: Option<Range<usize>>,
        allowed: impl Into<String>,
        hint: impl Into<Hint>,
    ) {
        // A wrong type or a conflict shows that the guess at a misspelt field was wrong. The field was already reported
        // as unknown.
        let guessed = matches!(kind, FaultKind::Type | FaultKind::Conflict);
        if guessed && self.slips.borrow().contains(&at) {
            return;
        }
        if self.is_full() {
            return self.count_on();
        }
        let ((line, column), set) = match self.text.place(at) {
            SourcePlace::Text { line, column } => ((line, column), None),
            SourcePlace::Override(text) => ((0, 0), Some(shorten(text))),
        };
        self.faults.borrow_mut().push(Fault {
            kind,
            line,
            column,
            set,
            field: field.to_owned(),
            value: value.and_then(|span| self.text.get(span)).map(shorten),
            allowed: allowed.into(),
            hint: hint.into().0,
        });
    }

    /// Records a wrong type, and names the type found.
    pub fn wrong_type(
        &self,
        field: &str,
        value: &Spanned<DeValue>,
        allowed: &str,
        hint: Option<&str>,
    ) {
        let found = type_name(value.get_ref());
        let hint = match hint {
            Some(hint) => format!("it is {found}: {hint}"),
            None => format!("it is {found}"),
        };
        self.fault(FaultKind::Type, field, value, allowed, hint);
    }

    /// Reads a float or an integer that satisfies `rule`.
    pub fn number(&self, field: &str, value: &Spanned<DeValue>, rule: &Rule) -> Option<f64> {
        let number = match value.get_ref() {
            // The parser has checked the digits. A float too large for f64 becomes infinite, which the rule excludes.
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
        self.refuse(FaultKind::Value, field, value, rule.allowed, hint)
    }

    /// Reads an integer from `least` to `most`, both included.
    pub fn count(
        &self,
        field: &str,
        value: &Spanned<DeValue>,
        least: usize,
        most: usize,
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
            self.fault(FaultKind::Value, field, value, allowed, None);
        }
        count
    }

    /// Reads N finite numbers.
    pub fn vector<const N: usize>(
        &self,
        field: &str,
        value: &Spanned<DeValue>,
        rule: &Rule,
    ) -> Option<[f64; N]> {
        let parse = |field: &str, value: &_| self.number(field, value, rule);
        self.array(field, value, vector_words(N), &parse)
    }

    /// Reads a vector: three numbers in space, two in the plane, where the third is 0.
    pub fn point(&self, field: &str, value: &Spanned<DeValue>, rule: &Rule) -> Option<[f64; 3]> {
        if self.kind.get() == PLANE {
            let [x, y] = self.vector(field, value, rule)?;
            return Some([x, y, 0.0]);
        }
        self.vector(field, value, rule)
    }

    /// Reads N elements, each with `parse`.
    pub fn array<'v, T, const N: usize>(
        &self,
        field: &str,
        value: &'v Spanned<DeValue<'v>>,
        allowed: &str,
        parse: &dyn Fn(&str, &'v Spanned<DeValue<'v>>) -> Option<T>,
    ) -> Option<[T; N]> {
        let elements = self.list(field, value, allowed, parse)?;
        let count = elements.len();
        let Ok(elements) = <[Option<T>; N]>::try_from(elements) else {
            let hint = format!("it has {count} elements");
            return self.refuse(FaultKind::Value, field, value, allowed, hint);
        };
        let elements: Option<Vec<T>> = elements.into_iter().collect();
        elements?.try_into().ok()
    }

    /// Reads any number of elements, each with `parse`; `None` for elements with faults.
    pub fn list<'v, T>(
        &self,
        field: &str,
        value: &'v Spanned<DeValue<'v>>,
        allowed: &str,
        parse: &dyn Fn(&str, &'v Spanned<DeValue<'v>>) -> Option<T>,
    ) -> Option<Vec<Option<T>>> {
        let Some(array) = value.get_ref().as_array() else {
            self.wrong_type(field, value, allowed, None);
            return None;
        };
        let read = |(i, value)| parse(&format!("{field}[{i}]"), value);
        Some(array.iter().enumerate().map(read).collect())
    }

    /// Reads any number of elements; `None` if one has a fault.
    pub fn all<'v, T>(
        &self,
        field: &str,
        value: &'v Spanned<DeValue<'v>>,
        allowed: &str,
        parse: &dyn Fn(&str, &'v Spanned<DeValue<'v>>) -> Option<T>,
    ) -> Option<Vec<T>> {
        let list = self.list(field, value, allowed, parse)?;
        list.into_iter().collect()
    }

    /// Reads any number of numbers that satisfy `rule`.
    pub fn numbers(
        &self,
        field: &str,
        value: &Spanned<DeValue>,
        allowed: &str,
        rule: &Rule,
    ) -> Option<Vec<f64>> {
        let number = |field: &str, value: &_| self.number(field, value, rule);
        self.all(field, value, allowed, &number)
    }

    /// Reads true or false.
    pub fn flag(&self, field: &str, value: &Spanned<DeValue>) -> Option<bool> {
        let flag = value.get_ref().as_bool();
        if flag.is_none() {
            let quoted = value.get_ref().as_str();
            let hint = matches!(quoted, Some("true" | "false")).then_some("leave out the quotes");
            self.wrong_type(field, value, "true or false", hint);
        }
        flag
    }

    /// Reads one of the words in `choices`.
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
        for (name, choice) in choices {
            if *name == word {
                return Some(choice.clone());
            }
        }
        let hint = nearest(word, &mut choices.iter().map(|(name, _)| *name))
            .map(|name| format!("did you mean {name:?}?"));
        self.refuse(FaultKind::Value, field, value, allowed, hint)
    }

    /// Opens a table with the fields of `spec`.
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
