//! Reads a TOML document field by field and collects every fault on the way.
//!
//! serde stops at the first error; here a reader that fails records a [`Fault`] and gives `None`,
//! and the caller goes on. Invariant: `None` means that a fault was recorded.

use super::fields::{Kinds, PLANE, Spec};
use super::phrases::{kind_of, nearest, shorten, vector_words};
use super::ranges::Rule;
use super::sources::{Place, Refused, Sources, apply};
use super::table::Table;
use crate::scene::{Fault, FaultKind, Faults};
use std::cell::{Cell, RefCell};
use std::ops::Range;
use toml::Spanned;
use toml::de::{DeTable, DeValue};

/// What to do about a fault, if more can be said.
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

/// Faults that are kept with their texts; more are only counted.
const KEPT: usize = 1000;

/// The text, what overrides it, and the faults found in them so far.
pub(super) struct Reader<'a> {
    text: &'a Sources,
    /// The kind of the scene.
    pub kind: Cell<Kinds>,
    faults: RefCell<Vec<Fault>>,
    /// Where values begin whose field is misspelt.
    slips: RefCell<Vec<usize>>,
    more: Cell<usize>,
}

impl<'a> Reader<'a> {
    pub fn new(text: &'a Sources) -> Self {
        Self {
            text,
            kind: Cell::new(PLANE),
            faults: RefCell::default(),
            slips: RefCell::default(),
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
    pub fn is_full(&self) -> bool {
        self.faults.borrow().len() >= KEPT
    }

    /// Counts a fault that is not kept.
    pub fn count_on(&self) {
        self.more.set(self.more.get() + 1);
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

    /// Notes that the field of a value is misspelt, and read as what may be meant.
    pub fn slipped(&self, value: &Spanned<DeValue>) {
        self.slips.borrow_mut().push(value.span().start);
    }

    /// Where byte `at` is, in words.
    pub fn place(&self, at: usize) -> String {
        match self.text.place(at) {
            Place::Text { line, .. } => format!("line {line}"),
            Place::Override(text) => format!("--set {}", shorten(text)),
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

    /// The same, of a value that must be given up.
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

    /// Records a fault at byte `at` that shows the text of `value`, if there is one to show.
    pub fn record(
        &self,
        kind: FaultKind,
        at: usize,
        field: &str,
        value: Option<Range<usize>>,
        allowed: impl Into<String>,
        hint: impl Into<Hint>,
    ) {
        // What is of another type, or in conflict with others, is not what was meant: that it is unknown has been said.
        let guessed = matches!(kind, FaultKind::Type | FaultKind::Conflict);
        if guessed && self.slips.borrow().contains(&at) {
            return;
        }
        if self.is_full() {
            return self.count_on();
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
            hint: hint.into().0,
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
        self.fault(FaultKind::Type, field, value, allowed, hint);
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
        self.refuse(FaultKind::Value, field, value, rule.allowed, hint)
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
            self.fault(FaultKind::Value, field, value, allowed, None);
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
        self.array(field, value, vector_words(N), &parse)
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

    /// Any number of elements, each read by `parse`; `None` for those with faults.
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

    /// Any number of elements, if none has a fault.
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

    /// Any number of numbers that satisfy `rule`.
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
        for (name, choice) in choices {
            if *name == word {
                return Some(choice.clone());
            }
        }
        let hint = nearest(word, &mut choices.iter().map(|(name, _)| *name))
            .map(|name| format!("did you mean {name:?}?"));
        self.refuse(FaultKind::Value, field, value, allowed, hint)
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
