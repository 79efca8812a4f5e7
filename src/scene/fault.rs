//! Faults of a scene, each with its line and column.

use crate::Error;
use serde::Serialize;
use std::fmt;

/// The kind of a [`Fault`].
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize)]
#[serde(rename_all = "lowercase")]
pub enum FaultKind {
    /// The text is not TOML (or not UTF-8); nothing after it was read.
    Syntax,
    /// A required field or table is absent.
    Missing,
    /// A field or table that no scene has.
    Unknown,
    /// A value of the wrong type.
    Type,
    /// A value outside its set.
    Value,
    /// Fields that exclude each other.
    Conflict,
}

/// One fault of a scene: its place, the value found, the values allowed, and a hint.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct Fault {
    /// The kind of fault.
    pub kind: FaultKind,
    /// Line in the text, from 1; 0 in an override. A missing table is reported at the last line.
    pub line: usize,
    /// Column in that line, in characters, from 1; 0 in an override.
    pub column: usize,
    /// The override at fault, `rod.damping=0.2`; `None` if the fault is in the text.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub set: Option<String>,
    /// Path of the field, as in `body.mass` or `loads.force[1].direction`; empty for a syntax fault.
    pub field: String,
    /// The value as written, shortened to one line; `None` if nothing was written.
    pub value: Option<String>,
    /// Allowed values; completes the sentence "must be ...". For a syntax fault, the parser's message.
    pub allowed: String,
    /// Advice on the correction, if any.
    pub hint: Option<String>,
}

impl fmt::Display for Fault {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match &self.set {
            Some(set) => write!(f, "--set {set}: ")?,
            None => write!(f, "{}:{}: ", self.line, self.column)?,
        }
        FaultText(self).fmt(f)
    }
}

impl Fault {
    /// Text of the fault without its place, for scenes not written as text: the field, the value, the allowed values.
    pub fn without_place(&self) -> impl fmt::Display + '_ {
        FaultText(self)
    }

    /// Copy of the fault without the "(line n)" of conflicting fields, for scenes not written as text.
    pub fn without_lines(&self) -> Self {
        let mut parts = self.allowed.split(" (line ");
        let mut allowed = parts.next().unwrap_or_default().to_owned();
        parts.for_each(|part| {
            allowed.push_str(
                part.trim_start_matches(|c: char| c.is_ascii_digit())
                    .trim_start_matches(')'),
            )
        });
        Self {
            allowed,
            ..self.clone()
        }
    }
}

struct FaultText<'a>(&'a Fault);

impl fmt::Display for FaultText<'_> {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let fault = self.0;
        let found = match (fault.field.as_str(), &fault.value) {
            (field, None) => field.to_owned(),
            ("", Some(value)) => value.clone(),
            (field, Some(value)) => format!("{field} = {value}"),
        };
        f.write_str(&found)?;
        let verdict = match fault.kind {
            FaultKind::Syntax if fault.set.is_some() => ": cannot be set: ",
            FaultKind::Syntax if found.is_empty() => "not TOML: ",
            FaultKind::Syntax => ": not TOML: ",
            FaultKind::Missing => ": missing; must be ",
            FaultKind::Unknown => ": unknown; must be ",
            FaultKind::Type | FaultKind::Value | FaultKind::Conflict => ": must be ",
        };
        write!(f, "{verdict}{}", fault.allowed)?;
        match &fault.hint {
            Some(hint) => write!(f, "; {hint}"),
            None => Ok(()),
        }
    }
}

/// All faults of one scene, in the order of the text; never empty.
///
/// `Display` gives one line per fault, `7:8: body.mass = -1.0: must be a finite number > 0`;
/// [`Faults::in_file`] puts the file's name before each.
#[derive(Debug, Clone, PartialEq, Serialize)]
#[serde(transparent)]
pub struct Faults {
    list: Vec<Fault>,
    /// Number of faults beyond those of the list.
    #[serde(skip)]
    more: usize,
}

/// Number of faults that `Display` prints.
const PRINTED: usize = 100;

impl Faults {
    /// Sorts by place; `more` faults were counted and not kept.
    pub(super) fn new(mut list: Vec<Fault>, more: usize) -> Self {
        list.sort_by_key(|fault| (fault.line, fault.column));
        Self { list, more }
    }

    /// The faults, in the order of the text; at most the first 1000 found.
    pub fn as_slice(&self) -> &[Fault] {
        &self.list
    }

    /// Number of faults, including those not kept.
    pub fn count(&self) -> usize {
        self.list.len() + self.more
    }

    /// Report with `file:` before every line, the form that editors can jump to.
    pub fn in_file<'a>(&'a self, file: &'a str) -> impl fmt::Display + 'a {
        Report {
            file: Some(file),
            faults: self,
        }
    }
}

impl<'a> IntoIterator for &'a Faults {
    type Item = &'a Fault;
    type IntoIter = std::slice::Iter<'a, Fault>;

    fn into_iter(self) -> Self::IntoIter {
        self.list.iter()
    }
}

impl fmt::Display for Faults {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let report = Report {
            file: None,
            faults: self,
        };
        report.fmt(f)
    }
}

impl std::error::Error for Faults {}

struct Report<'a> {
    file: Option<&'a str>,
    faults: &'a Faults,
}

impl fmt::Display for Report<'_> {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        for (i, fault) in self.faults.into_iter().take(PRINTED).enumerate() {
            if i > 0 {
                f.write_str("\n")?;
            }
            if let (Some(file), None) = (self.file, &fault.set) {
                write!(f, "{file}:")?;
            }
            write!(f, "{fault}")?;
        }
        match self.faults.count().saturating_sub(PRINTED) {
            0 => Ok(()),
            more => write!(f, "\nand {more} more faults"),
        }
    }
}

/// Failure of [`Scene::read`](super::Scene::read).
#[derive(Debug, Clone, PartialEq)]
pub enum ReadError {
    /// The file could not be read ([`Error::is_io`]).
    File(Error),
    /// The file was read and holds faults.
    Scene {
        /// Path of the file, as the caller gave it.
        file: String,
        /// All faults of the scene.
        faults: Faults,
    },
}

impl fmt::Display for ReadError {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::File(error) => error.fmt(f),
            Self::Scene { file, faults } => faults.in_file(file).fmt(f),
        }
    }
}

impl std::error::Error for ReadError {
    fn source(&self) -> Option<&(dyn std::error::Error + 'static)> {
        match self {
            Self::File(error) => Some(error),
            Self::Scene { faults, .. } => Some(faults),
        }
    }
}
