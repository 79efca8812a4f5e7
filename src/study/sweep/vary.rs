//! A varied field of a scene, with its range or list of values.

use crate::error::{Error, Result};
use crate::scene::is_count;
use crate::study::exact;

/// A field of the scene and its values, written as `PATH=FROM:TO:COUNT`, `PATH=log:FROM:TO:COUNT` or
/// `PATH=[A, B, ..]`; without the count in a random sweep.
#[derive(Debug, Clone, PartialEq)]
pub struct Vary {
    /// Dotted path of the field as written: `start.velocity.1` or `start.velocity[1]`.
    pub path: String,
    values: VariedValues,
    /// True if the field is a whole number.
    counts: bool,
}

#[derive(Debug, Clone, PartialEq)]
enum VariedValues {
    /// `count` values between the ends, evenly spaced, in the logarithm if `log`.
    Range {
        from: f64,
        to: f64,
        log: bool,
        count: Option<usize>,
    },
    /// Listed values, as TOML.
    List(Vec<String>),
}

/// Largest number of values of one field.
const MOST: usize = 100_000_000;
/// Relative tolerance within which values of an integer field are whole: logarithms round.
const WHOLE: f64 = 1e-12;

impl Vary {
    /// Parses the argument of `--vary`.
    ///
    /// # Errors
    /// A text of none of the forms; ends that are not finite, or not positive with logarithmic spacing; a count of 0.
    pub fn parse(text: &str) -> Result<Self> {
        let forms = "PATH=FROM:TO:COUNT, PATH=log:FROM:TO:COUNT or PATH=[A, B, ..], as in start.velocity.1=-2:2:9";
        Self::read(text)
            .map_err(|why| Error::domain(format!("--vary {text}: {why}; write {forms}")))
    }

    /// Field and values, or an error message.
    fn read(text: &str) -> std::result::Result<Self, &'static str> {
        let refuse = Err;
        let Some((path, values)) = text.split_once('=') else {
            return refuse("there is no =");
        };
        let path = path.trim().to_owned();
        if path.is_empty() {
            return refuse("there is no path before =");
        }
        let values = values.trim();
        if let Some(list) = values.strip_prefix('[') {
            let Some(list) = list.strip_suffix(']') else {
                return refuse("the list does not end in ]");
            };
            let list = items(list);
            if list.iter().any(String::is_empty) {
                return refuse("a value of the list is missing");
            }
            return Ok(Self {
                path,
                values: VariedValues::List(list),
                counts: false,
            });
        }
        let (log, range) = match values.strip_prefix("log:") {
            Some(range) => (true, range),
            None => (false, values),
        };
        let parts: Vec<&str> = range.split(':').map(str::trim).collect();
        let (ends, count) = match parts.as_slice() {
            [from, to] => ([*from, *to], None),
            [from, to, count] => ([*from, *to], Some(*count)),
            _ => return refuse("it has not two or three parts between colons"),
        };
        let [Ok(from), Ok(to)] = ends.map(str::parse::<f64>) else {
            return refuse("its ends are not numbers");
        };
        if !(from.is_finite() && to.is_finite()) {
            return refuse("its ends are not finite");
        }
        if log && !(from > 0.0 && to > 0.0) {
            return refuse("logarithms need ends > 0");
        }
        let count = match count.map(str::parse::<usize>) {
            None => None,
            Some(Ok(count)) if (1..=MOST).contains(&count) => Some(count),
            Some(_) => return refuse("the count is not a whole number from 1 to 100000000"),
        };
        Ok(Self {
            path,
            values: VariedValues::Range {
                from,
                to,
                log,
                count,
            },
            counts: false,
        })
    }

    /// Marks the values of an integer field: whole values of a range are then written as integers.
    pub(super) fn of_field(self) -> Self {
        Self {
            counts: is_count(&self.path),
            ..self
        }
    }

    /// True for the same field in any spelling: `velocity.1` and `velocity.y` are `velocity[1]`.
    pub fn is_of(&self, path: &str) -> bool {
        indexed(path.trim()) == indexed(&self.path)
    }

    /// Number of grid values; `None` for a range without a count (random points).
    pub fn count(&self) -> Option<usize> {
        match &self.values {
            VariedValues::Range { count, .. } => *count,
            VariedValues::List(list) => Some(list.len()),
        }
    }

    /// True for a list, for which no count is given.
    pub fn is_list(&self) -> bool {
        matches!(self.values, VariedValues::List(_))
    }

    /// Values of a list, as TOML.
    pub(super) fn listed(&self) -> Option<&[String]> {
        match &self.values {
            VariedValues::List(list) => Some(list),
            VariedValues::Range { .. } => None,
        }
    }

    /// True for logarithmic spacing.
    pub fn is_logarithmic(&self) -> bool {
        matches!(self.values, VariedValues::Range { log: true, .. })
    }

    /// Value `i` of a grid, as TOML.
    pub fn on_grid(&self, i: usize) -> String {
        match &self.values {
            VariedValues::List(list) => list[i % list.len()].clone(),
            VariedValues::Range { count, .. } => {
                let intervals = count.unwrap_or(1).saturating_sub(1);
                let part = if intervals == 0 {
                    0.0
                } else {
                    i as f64 / intervals as f64
                };
                self.at(part)
            }
        }
    }

    /// Value at a fraction in [0, 1) of the range or list, as TOML.
    pub fn at(&self, part: f64) -> String {
        match &self.values {
            VariedValues::List(list) => {
                let i = (part * list.len() as f64) as usize;
                list[i.min(list.len() - 1)].clone()
            }
            VariedValues::Range { from, to, log, .. } => {
                let x = between(part, [*from, *to], *log);
                if (x - x.round()).abs() <= WHOLE * x.abs() && self.counts {
                    format!("{x:.0}")
                } else {
                    exact(x)
                }
            }
        }
    }

    /// Value of a random point from a number in [0, 1), as TOML; for an integer field one of the integers in the
    /// range.
    pub(super) fn drawn(&self, part: f64) -> String {
        if let (true, VariedValues::Range { from, to, log, .. }) = (self.counts, &self.values) {
            let (least, most) = (from.min(*to).ceil(), from.max(*to).floor());
            if least <= most {
                // First and last integer get as much room as the others.
                let x = between(part, [least - 0.5, most + 0.5], *log).round();
                return format!("{:.0}", x.clamp(least, most) + 0.0);
            }
        }
        self.at(part)
    }

    /// Parses the argument of `--free`: a field and its range.
    ///
    /// # Errors
    /// As [`Vary::parse`]; a list; a count; an empty range; an integer field.
    pub fn free(text: &str) -> Result<Self> {
        let forms = "PATH=FROM:TO or PATH=log:FROM:TO, as in rod.damping=log:0.01:1";
        let refuse = |why: &str| Error::domain(format!("--free {text}: {why}; write {forms}"));
        let found = Self::read(text).map_err(refuse)?;
        match found.values {
            VariedValues::List(_) => Err(refuse("a list is no range")),
            VariedValues::Range { count: Some(_), .. } => {
                Err(refuse("a range that is searched has no count"))
            }
            VariedValues::Range { from, to, .. } if !(from < to) => {
                Err(refuse("FROM is not below TO"))
            }
            VariedValues::Range { .. } if is_count(&found.path) => Err(Error::domain(format!(
                "--free {text}: {} is a whole number, which a search by derivatives cannot find; compare its values by a sweep",
                found.path
            ))),
            VariedValues::Range { .. } => Ok(found),
        }
    }

    /// Value and derivative by the fraction of the range, also outside [0, 1]; `None` for a list.
    pub fn number(&self, part: f64) -> Option<[f64; 2]> {
        match self.values {
            VariedValues::List(_) => None,
            VariedValues::Range { from, to, log, .. } => {
                let x = between(part, [from, to], log);
                let by = if log { x * (to / from).ln() } else { to - from };
                Some([x, by])
            }
        }
    }
}

/// Value at a fraction of a range, with exact ends.
fn between(part: f64, [from, to]: [f64; 2], log: bool) -> f64 {
    let between = |a: f64, b: f64| a * (1.0 - part) + b * part;
    match (part, log) {
        (0.0, _) => from,
        (1.0, _) => to,
        (_, false) => between(from, to),
        (_, true) => between(from.ln(), to.ln()).exp(),
    }
}

/// Spells `velocity.1` and `velocity.y` as `velocity[1]`.
fn indexed(path: &str) -> String {
    let mut out = String::new();
    for step in path.split('.') {
        let axis = ["x", "y", "z"].iter().position(|axis| *axis == step);
        if !step.is_empty() && step.bytes().all(|b| b.is_ascii_digit()) {
            out.push_str(&format!("[{step}]"));
        } else if let (Some(k), false) = (axis, out.is_empty()) {
            out.push_str(&format!("[{k}]"));
        } else {
            if !out.is_empty() {
                out.push('.');
            }
            out.push_str(step);
        }
    }
    out
}

/// Items of a TOML array; commas inside brackets and quotes do not separate.
fn items(list: &str) -> Vec<String> {
    let (mut depth, mut quote, mut out) = (0i32, None, vec![String::new()]);
    for c in list.chars() {
        match (quote, c) {
            (Some(q), _) if c == q => quote = None,
            (None, '"' | '\'') => quote = Some(c),
            (None, '[' | '{') => depth += 1,
            (None, ']' | '}') => depth -= 1,
            (None, ',') if depth == 0 => {
                out.push(String::new());
                continue;
            }
            _ => {}
        }
        if let Some(last) = out.last_mut() {
            last.push(c);
        }
    }
    out.iter().map(|item| item.trim().to_owned()).collect()
}
