//! Texts of faults: lists, nearest names, excerpts, numbers.

use std::fmt;
use toml::de::DeValue;

/// Longest excerpt of a value in a fault, in characters.
const EXCERPT: usize = 48;
/// Length of an unknown name up to which a suggestion is sought; a longer name is no typing slip.
const LONGEST_NAME: usize = 64;

/// List of quoted words: `"a", "b" or "c"`.
pub(super) fn listed(words: &[&str]) -> String {
    let quoted: Vec<String> = words.iter().map(|word| format!("{word:?}")).collect();
    match quoted.split_last() {
        Some((last, [])) => last.clone(),
        Some((last, rest)) => format!("{} or {last}", rest.join(", ")),
        None => String::new(),
    }
}

/// Description of an array of this many numbers.
pub(super) fn vector_words(count: usize) -> &'static str {
    match count {
        2 => "an array of two finite numbers, [x, y]",
        3 => "an array of three finite numbers, [x, y, z]",
        4 => "an array of four finite numbers",
        _ => "an array of six finite numbers",
    }
}

/// The name nearest to `word`, if near enough for a typing slip: one edit, and one more for every four letters. A name
/// that contains the other also counts.
pub(crate) fn nearest<'n>(word: &str, names: &mut dyn Iterator<Item = &'n str>) -> Option<&'n str> {
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
    // Cutting first keeps a huge value cheap.
    let head: String = text.chars().take(4 * EXCERPT).collect();
    let line = head.split_whitespace().collect::<Vec<_>>().join(" ");
    let whole = head.len() == text.len() && line.chars().count() <= EXCERPT;
    if whole {
        line
    } else {
        line.chars()
            .take(EXCERPT - 3)
            .chain("...".chars())
            .collect()
    }
}

/// The type of a value, with its article.
pub(super) fn type_name(value: &DeValue) -> &'static str {
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

/// A number in a message, printed in a few characters for any size.
pub(super) struct Short(pub f64);

impl fmt::Display for Short {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        if self.0 == 0.0 || (1e-5..1e16).contains(&self.0.abs()) {
            self.0.fmt(f)
        } else {
            fmt::LowerExp::fmt(&self.0, f)
        }
    }
}
