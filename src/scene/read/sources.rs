//! The text of a scene with what overrides it, and where in them a byte is.

use std::borrow::Cow;
use std::ops::Range;
use toml::Spanned;
use toml::de::{DeTable, DeValue};

/// A document, and after it the overrides, `rod.damping = 0.2`, one after another: every byte has one number.
pub(in crate::scene) struct Sources {
    whole: String,
    /// First byte of each line of the document.
    lines: Vec<usize>,
    /// First byte of each override; before the first, the document ends.
    overrides: Vec<usize>,
}

/// Where a byte is.
pub(in crate::scene) enum Place<'a> {
    /// In the document: line and column, both from 1.
    Text { line: usize, column: usize },
    /// In this override.
    Override(&'a str),
}

/// Why an override cannot be put into the document.
pub(super) struct Refused {
    pub at: usize,
    pub message: String,
}

/// Characters of a line that are counted for a column.
const WIDEST: usize = 1 << 16;

impl Sources {
    pub fn new(text: &str, overrides: &[&str]) -> Self {
        let feeds = text.bytes().enumerate().filter(|(_, byte)| *byte == b'\n');
        let lines = std::iter::once(0)
            .chain(feeds.map(|(i, _)| i + 1))
            .collect();
        let mut whole = text.to_owned();
        let start = |text: &&str| {
            let start = whole.len();
            whole.push_str(text);
            start
        };
        let overrides = overrides.iter().map(start).collect();
        Self {
            whole,
            lines,
            overrides,
        }
    }

    fn end(&self) -> usize {
        self.overrides.first().copied().unwrap_or(self.whole.len())
    }

    /// The text of the document.
    pub fn document(&self) -> &str {
        &self.whole[..self.end()]
    }

    /// The overrides, each with its first byte.
    pub fn overrides(&self) -> impl Iterator<Item = (usize, &str)> {
        let ends = self.overrides.iter().skip(1).chain([&0]);
        self.overrides.iter().zip(ends).map(|(start, end)| {
            let end = if *end == 0 { self.whole.len() } else { *end };
            (*start, &self.whole[*start..end])
        })
    }

    pub fn get(&self, span: Range<usize>) -> Option<&str> {
        self.whole.get(span)
    }

    /// The line, or the override, that byte `at` is in.
    pub fn line_around(&self, at: usize) -> Range<usize> {
        if at >= self.end()
            && let Some((start, text)) = self.overridden(at)
        {
            return start..start + text.len();
        }
        let at = self.floor(at);
        let start = self.lines[self.line(at) - 1];
        let document = self.document();
        let end = document[at..]
            .find('\n')
            .map_or(document.len(), |feed| at + feed);
        start..end
    }

    pub fn place(&self, at: usize) -> Place<'_> {
        if at >= self.end()
            && let Some((_, text)) = self.overridden(at)
        {
            return Place::Override(text);
        }
        let at = self.floor(at);
        let line = self.line(at);
        let before = &self.whole[self.lines[line - 1]..at];
        let column = before.chars().take(WIDEST).count() + 1;
        Place::Text { line, column }
    }

    fn overridden(&self, at: usize) -> Option<(usize, &str)> {
        self.overrides()
            .take_while(|(start, _)| *start <= at)
            .last()
    }

    /// Line of a byte of the document, from 1.
    fn line(&self, at: usize) -> usize {
        self.lines.partition_point(|start| *start <= at).max(1)
    }

    /// The character boundary at or before byte `at`. The end of a text that ends in a line feed counts as the end of its
    /// last line, so that every fault is on a line that exists.
    fn floor(&self, at: usize) -> usize {
        let document = self.document();
        let end = document.len() - usize::from(document.ends_with('\n'));
        let mut at = at.min(end);
        while !document.is_char_boundary(at) {
            at -= 1;
        }
        at
    }
}

/// Puts an override `path = value` into the document: the path is dotted, `loads.force[0].amplitude` or `loads.force.0.amplitude`, and
/// tables on the way that are not there are made; the value is TOML. `start`: its first byte.
pub(super) fn apply<'a>(
    document: &mut DeTable<'a>,
    start: usize,
    text: &'a str,
) -> Result<(), Refused> {
    let refuse = |message: String| Refused { at: start, message };
    let Some((path, value)) = text.split_once('=') else {
        return Err(refuse(
            "an override is PATH=VALUE, as in rod.damping=0.2".to_owned(),
        ));
    };
    let offset = start + text.len() - value.trim_start().len();
    let mut value = DeValue::parse(value.trim()).map_err(|error| {
        refuse(format!(
            "{}; the value is TOML, so that a word needs its quotes: rod.model=\\\"elastica\\\"",
            error.message()
        ))
    })?;
    shift(&mut value, offset);
    let steps = steps_of(path.trim());
    let Some((last, way)) = steps.split_last() else {
        return Err(refuse("the path is empty".to_owned()));
    };
    let mut table = document;
    for step in way {
        let (name, indices) =
            step_of(step).ok_or_else(|| refuse(format!("{step:?} is no field")))?;
        let entry = table.entry(Spanned::new(start..start, Cow::Borrowed(name)));
        let empty = || Spanned::new(start..start, DeValue::Table(DeTable::new()));
        let place = element(entry.or_insert_with(empty), &indices)
            .ok_or_else(|| refuse(format!("{step} has no such element")))?;
        let DeValue::Table(inner) = place.get_mut() else {
            return Err(refuse(format!("{step} is no table in the scene")));
        };
        table = inner;
    }
    let (name, indices) = step_of(last).ok_or_else(|| refuse(format!("{last:?} is no field")))?;
    if indices.is_empty() {
        // The key with its place goes, too.
        table.remove(name);
        let key = Spanned::new(start..start + path.trim_end().len(), Cow::Borrowed(name));
        table.insert(key, value);
        return Ok(());
    }
    let place = table.get_mut(name).and_then(|list| element(list, &indices));
    *place.ok_or_else(|| refuse(format!("{last} is no element of an array in the scene")))? = value;
    Ok(())
}

/// The steps of a dotted path; a number after a point belongs to the step before it.
fn steps_of(path: &str) -> Vec<&str> {
    let mut steps = Vec::new();
    let mut start = 0;
    for (at, _) in path.match_indices('.') {
        let next = path[at + 1..].split(['.', '[']).next().unwrap_or_default();
        if next.is_empty() || !next.bytes().all(|b| b.is_ascii_digit()) {
            steps.push(path[start..at].trim());
            start = at + 1;
        }
    }
    steps.push(path[start..].trim());
    steps
}

/// `force[0]` or `force.0`: a name and indices, from 0; a letter of x, y, z is for the parameters of branches alone.
fn step_of(step: &str) -> Option<(&str, Vec<usize>)> {
    let (name, rest) = step.split_at(step.find(['[', '.']).unwrap_or(step.len()));
    let bare = |c: char| c.is_ascii_alphanumeric() || c == '_' || c == '-';
    let parts = rest.split(['.', '[', ']']).map(str::trim);
    let indices = parts
        .filter(|part| !part.is_empty())
        .map(|part| part.parse().ok());
    let indices: Option<Vec<usize>> = indices.collect();
    let is_whole = !rest.contains("[]");
    (is_whole && !name.is_empty() && name.chars().all(bare)).then_some((name, indices?))
}

fn element<'t, 'a>(
    value: &'t mut Spanned<DeValue<'a>>,
    indices: &[usize],
) -> Option<&'t mut Spanned<DeValue<'a>>> {
    indices
        .iter()
        .try_fold(value, |value, i| match value.get_mut() {
            DeValue::Array(list) => list.get_mut(*i),
            _ => None,
        })
}

/// Moves a value, and all in it, by so many bytes.
fn shift(value: &mut Spanned<DeValue>, by: usize) {
    let span = value.span();
    match value.get_mut() {
        DeValue::Array(list) => list.iter_mut().for_each(|value| shift(value, by)),
        DeValue::Table(table) => {
            let moved = std::mem::take(table).into_iter().map(|(key, mut value)| {
                shift(&mut value, by);
                let span = key.span();
                let key = Spanned::new(span.start + by..span.end + by, key.into_inner());
                (key, value)
            });
            *table = moved.collect();
        }
        _ => {}
    }
    let inner = std::mem::replace(value.get_mut(), DeValue::Boolean(false));
    *value = Spanned::new(span.start + by..span.end + by, inner);
}
