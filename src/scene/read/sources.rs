//! Text of a scene with its overrides, and the place of each byte.

use std::borrow::Cow;
use std::ops::Range;
use std::path::{Path, PathBuf};
use toml::Spanned;
use toml::de::{DeArray, DeTable, DeValue};

/// A document followed by the overrides, `rod.damping = 0.2`, in one text with one numbering of its bytes.
pub(in crate::scene) struct Sources {
    whole: String,
    /// First byte of each line of the document.
    lines: Vec<usize>,
    /// First byte of each override; the document ends before the first of them.
    overrides: Vec<usize>,
    /// Directory from which the names of files count.
    directory: PathBuf,
}

/// Place of a byte.
pub(in crate::scene) enum SourcePlace<'a> {
    /// Line and column in the document, both from 1.
    Text { line: usize, column: usize },
    /// In this override.
    Override(&'a str),
}

/// Rejection of an override, with its place and the message.
pub(super) struct OverrideError {
    pub at: usize,
    pub message: String,
}

/// Bound on the characters of a line that are counted for a column.
const MAX_COLUMN: usize = 1 << 16;

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
            directory: PathBuf::new(),
        }
    }

    /// Sets the directory of the text, from which relative paths in the text count.
    pub fn in_directory(mut self, directory: &Path) -> Self {
        self.directory = directory.to_owned();
        self
    }

    /// Path of a file that the text names.
    pub fn beside(&self, file: &str) -> PathBuf {
        self.directory.join(file)
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

    /// Byte range of the line, or the override, around byte `at`.
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

    pub fn place(&self, at: usize) -> SourcePlace<'_> {
        if at >= self.end()
            && let Some((_, text)) = self.overridden(at)
        {
            return SourcePlace::Override(text);
        }
        let at = self.floor(at);
        let line = self.line(at);
        let before = &self.whole[self.lines[line - 1]..at];
        let column = before.chars().take(MAX_COLUMN).count() + 1;
        SourcePlace::Text { line, column }
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

    /// The character boundary at or before byte `at`. The end of a text that ends in a line feed counts as the end of
    /// its last line, so that every fault is on an existing line.
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

/// Puts an override `path = value` into the document; `start` is its first byte. The value is TOML, the path is dotted.
/// An element of a list is named by its index from 0 (`loads.force[0].amplitude` or `loads.force.0.amplitude`), by its
/// name (`body.crown.mass`), or as a component (`velocity.x`). Missing tables on the path are created.
pub(super) fn apply<'a>(
    document: &mut DeTable<'a>,
    start: usize,
    text: &'a str,
) -> Result<(), OverrideError> {
    let refuse = |message: String| OverrideError { at: start, message };
    let Some((path, value)) = text.split_once('=') else {
        return Err(refuse(
            "an override is PATH=VALUE, as in rod.damping=0.2".to_owned(),
        ));
    };
    let offset = start + text.len() - value.trim_start().len();
    let mut value = DeValue::parse(value.trim()).map_err(|error| {
        let is_bare_list = value.contains(',') && !value.trim_start().starts_with(['[', '{', '"']);
        let advice = if is_bare_list {
            format!(
                "a list needs its brackets: {}=[{}]",
                path.trim(),
                value.trim()
            )
        } else {
            "a word needs its quotes: rod.model=\\\"elastica\\\"".to_owned()
        };
        refuse(format!(
            "{}; the value is TOML, so that {advice}",
            error.message()
        ))
    })?;
    shift(&mut value, offset);
    let Some(steps) = steps_of(path) else {
        return Err(refuse(format!(
            "{:?} is no field: write a path such as rod.damping or start.velocity[0]",
            path.trim()
        )));
    };
    let setting = Setting {
        key: start..start + path.trim_end().len(),
        steps,
    };
    setting.put_into(document, 0, value).map_err(refuse)
}

/// The value at a path of the document, with paths as in [`apply`].
pub(super) fn value_at<'t, 'a>(
    document: &'t DeTable<'a>,
    path: &str,
) -> Option<&'t Spanned<DeValue<'a>>> {
    let mut steps = steps_of(path)?.into_iter();
    let mut at = document.get(steps.next()?)?;
    for step in steps {
        at = match at.get_ref() {
            DeValue::Table(table) => table.get(step)?,
            DeValue::Array(list) => list.get(element(list, step)?)?,
            _ => return None,
        };
    }
    Some(at)
}

/// An override, split into the steps of its path.
struct Setting<'a> {
    /// Byte range of the path.
    key: Range<usize>,
    /// Names of fields, and indices of elements.
    steps: Vec<&'a str>,
}

impl<'a> Setting<'a> {
    /// Puts the value into a table, at the path of the steps from number `k` on.
    fn put_into(
        &self,
        table: &mut DeTable<'a>,
        k: usize,
        value: Spanned<DeValue<'a>>,
    ) -> Result<(), String> {
        let (step, rest) = (self.steps[k], &self.steps[k + 1..]);
        let key = Spanned::new(self.key.clone(), Cow::Borrowed(step));
        if rest.is_empty() {
            // Removal also replaces the key: faults then point to the override.
            table.remove(step);
            table.insert(key, value);
            return Ok(());
        }
        if !table.contains_key(step) && rest.iter().any(|step| is_number(step)) {
            return Err(format!(
                "the scene has no {}, in which an element could be replaced; a path begins at the top of the scene, as rod.length does, and a list that is \
                 not there is written whole",
                self.path_text(k + 1)
            ));
        }
        let empty = || Spanned::new(self.key.clone(), DeValue::Table(DeTable::new()));
        self.put(table.entry(key).or_insert_with(empty), k + 1, value)
    }

    /// Puts the value at `place`, or inside, along the steps from number `k` on.
    fn put(
        &self,
        place: &mut Spanned<DeValue<'a>>,
        k: usize,
        value: Spanned<DeValue<'a>>,
    ) -> Result<(), String> {
        let Some(step) = self.steps.get(k) else {
            *place = value;
            return Ok(());
        };
        let way = self.path_text(k);
        match place.get_mut() {
            DeValue::Table(table) if !is_number(step) => self.put_into(table, k, value),
            DeValue::Table(_) => Err(format!(
                "{way} has no such element: it is one table; leave out [{step}]"
            )),
            DeValue::Array(list) => {
                let place = element(list, step).and_then(|i| list.get_mut(i));
                match place {
                    Some(place) => self.put(place, k + 1, value),
                    None => Err(format!(
                        "{way} has no element {step}: {}",
                        elements(&way, list)
                    )),
                }
            }
            _ => Err(format!(
                "{way} is no table or list in the scene, but has a value: leave out what follows it"
            )),
        }
    }

    /// The path of the first `k` steps.
    fn path_text(&self, k: usize) -> String {
        let mut way = String::new();
        for step in &self.steps[..k] {
            match (is_number(step), way.is_empty()) {
                (true, _) => way += &format!("[{step}]"),
                (_, true) => way += step,
                (_, false) => way += &format!(".{step}"),
            }
        }
        way
    }
}

/// Splits a path into steps: `force[0]` and `force.0` both give `force` and `0`.
fn steps_of(path: &str) -> Option<Vec<&str>> {
    let bare = |c: char| c.is_ascii_alphanumeric() || c == '_' || c == '-';
    let mut steps = Vec::new();
    for part in path.split('.') {
        let (name, indices) = part.split_at(part.find('[').unwrap_or(part.len()));
        let name = name.trim();
        steps.push((!name.is_empty() && name.chars().all(bare)).then_some(name)?);
        for index in indices.trim_end().split_terminator(']') {
            let index = index.trim().strip_prefix('[')?.trim();
            steps.push(is_number(index).then_some(index)?);
        }
    }
    Some(steps)
}

fn is_number(step: &str) -> bool {
    !step.is_empty() && step.bytes().all(|b| b.is_ascii_digit())
}

/// Index of the element of a list that a step names.
fn element(list: &DeArray, step: &str) -> Option<usize> {
    if is_number(step) {
        return step.parse().ok();
    }
    let letter = || ["x", "y", "z"].iter().position(|letter| *letter == step);
    let is_vector = !(list.iter()).any(|of| of.get_ref().is_table() || of.get_ref().is_array());
    let mut all = list.iter();
    (all.position(|of| name(of) == Some(step))).or_else(|| letter().filter(|_| is_vector))
}

/// Value of the field `name` of a table in a list.
fn name<'t>(of: &'t Spanned<DeValue>) -> Option<&'t str> {
    of.get_ref().as_table()?.get("name")?.get_ref().as_str()
}

/// Description of the elements of a list, with an example path.
fn elements(way: &str, list: &DeArray) -> String {
    let Some(last) = list.len().checked_sub(1) else {
        return "it is empty".to_owned();
    };
    let numbers = match last {
        0 => format!("write {way}[0]"),
        _ => format!("write {way}[0] to {way}[{last}]"),
    };
    let names = list.iter().filter_map(name);
    let names: Vec<String> = names.map(|name| format!("{way}.{name}")).collect();
    if names.is_empty() {
        numbers
    } else {
        format!("{numbers}, or {}", names.join(", "))
    }
}

/// Moves the spans of a value and everything inside by `by` bytes.
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
