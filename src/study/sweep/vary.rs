//! What a sweep varies: a field of the scene, and the values that it takes.

use crate::error::{Error, Result};
use crate::scene::is_count;
use crate::study::exact;

/// A field of the scene and its values, written as `PATH=FROM:TO:COUNT`, `PATH=log:FROM:TO:COUNT` or `PATH=[A, B, ..]`; in a random
/// sweep without the count.
#[derive(Debug, Clone, PartialEq)]
pub struct Vary {
    /// The dotted path of the field, as it was written: `start.velocity.1` or `start.velocity[1]`.
    pub path: String,
    values: Values,
    /// True if the field is a whole number.
    counts: bool,
}

#[derive(Debug, Clone, PartialEq)]
enum Values {
    /// From the first to the last, `count` of them; the logarithms are evenly spaced if `log`.
    Range {
        from: f64,
        to: f64,
        log: bool,
        count: Option<usize>,
    },
    /// These, as TOML.
    List(Vec<String>),
}

/// Most values of one field.
const MOST: usize = 100_000_000;
/// A value of a field that counts is whole within this, relatively: logarithms round.
const WHOLE: f64 = 1e-12;

impl Vary {
    /// Reads what stands after `--vary`.
    ///
    /// # Errors
    /// A text that is none of the forms; ends that are not finite, or not positive where logarithms are spaced; a count of 0.
    pub fn parse(text: &str) -> Result<Self> {
        let forms = "PATH=FROM:TO:COUNT, PATH=log:FROM:TO:COUNT or PATH=[A, B, ..], as in start.velocity.1=-2:2:9";
        Self::read(text)
            .map_err(|why| Error::domain(format!("--vary {text}: {why}; write {forms}")))
    }

    /// The field and its values, or what is wrong with the text.
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
                values: Values::List(list),
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
            values: Values::Range {
                from,
                to,
                log,
                count,
            },
            counts: false,
        })
    }

    /// The same as values of its field: where a scene has a whole number there, whole values of a range are written as one.
    pub(super) fn of_field(self) -> Self {
        Self {
            counts: is_count(&self.path),
            ..self
        }
    }

    /// True if it varies the field of this path, however that is written: `velocity.1` and `velocity.y` are `velocity[1]`.
    pub fn is_of(&self, path: &str) -> bool {
        indexed(path.trim()) == indexed(&self.path)
    }

    /// How many values a grid has in this direction; None if it is for random points alone.
    pub fn count(&self) -> Option<usize> {
        match &self.values {
            Values::Range { count, .. } => *count,
            Values::List(list) => Some(list.len()),
        }
    }

    /// True if it is a list, whose number of values is no count of a grid.
    pub fn is_list(&self) -> bool {
        matches!(self.values, Values::List(_))
    }

    /// The values of a list, as TOML.
    pub(super) fn listed(&self) -> Option<&[String]> {
        match &self.values {
            Values::List(list) => Some(list),
            Values::Range { .. } => None,
        }
    }

    /// True if its values are spaced by their logarithms.
    pub fn is_logarithmic(&self) -> bool {
        matches!(self.values, Values::Range { log: true, .. })
    }

    /// Value `i` of a grid, as TOML.
    pub fn on_grid(&self, i: usize) -> String {
        match &self.values {
            Values::List(list) => list[i % list.len()].clone(),
            Values::Range { count, .. } => {
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

    /// The value at a part in [0, 1) of the range, or of the list, as TOML.
    pub fn at(&self, part: f64) -> String {
        match &self.values {
            Values::List(list) => {
                let i = (part * list.len() as f64) as usize;
                list[i.min(list.len() - 1)].clone()
            }
            Values::Range { from, to, log, .. } => {
                let x = between(part, [*from, *to], *log);
                match (x - x.round()).abs() <= WHOLE * x.abs() {
                    true if self.counts => format!("{x:.0}"),
                    _ => exact(x),
                }
            }
        }
    }

    /// The value of a random point, by a number in [0, 1), as TOML: where the field is a whole number, one of those in the range.
    pub(super) fn drawn(&self, part: f64) -> String {
        if let (true, Values::Range { from, to, log, .. }) = (self.counts, &self.values) {
            let (least, most) = (from.min(*to).ceil(), from.max(*to).floor());
            if least <= most {
                // The first and the last have as much room as the others.
                let x = between(part, [least - 0.5, most + 0.5], *log).round();
                return format!("{:.0}", x.clamp(least, most) + 0.0);
            }
        }
        self.at(part)
    }

    /// Reads what stands after `--free`: a field and the range of the values that it may have.
    ///
    /// # Errors
    /// Those of [`Vary::parse`]; a list; a count; a range that is empty; a field that is a whole number.
    pub fn free(text: &str) -> Result<Self> {
        let forms = "PATH=FROM:TO or PATH=log:FROM:TO, as in rod.damping=log:0.01:1";
        let refuse = |why: &str| Error::domain(format!("--free {text}: {why}; write {forms}"));
        let found = Self::read(text).map_err(refuse)?;
        match found.values {
            Values::List(_) => Err(refuse("a list is no range")),
            Values::Range { count: Some(_), .. } => {
                Err(refuse("a range that is searched has no count"))
            }
            Values::Range { from, to, .. } if !(from < to) => Err(refuse("FROM is not below TO")),
            Values::Range { .. } if is_count(&found.path) => Err(Error::domain(format!(
                "--free {text}: {} is a whole number, which a search by derivatives cannot find; compare its values by a sweep",
                found.path
            ))),
            Values::Range { .. } => Ok(found),
        }
    }

    /// The number at a part of the range, beyond it too, and its derivative by the part; of a list there is none.
    pub fn number(&self, part: f64) -> Option<[f64; 2]> {
        match self.values {
            Values::List(_) => None,
            Values::Range { from, to, log, .. } => {
                let x = between(part, [from, to], log);
                let by = if log { x * (to / from).ln() } else { to - from };
                Some([x, by])
            }
        }
    }
}

/// The value at a part of a range, whose ends are hit exactly.
fn between(part: f64, [from, to]: [f64; 2], log: bool) -> f64 {
    let between = |a: f64, b: f64| a * (1.0 - part) + b * part;
    match (part, log) {
        (0.0, _) => from,
        (1.0, _) => to,
        (_, false) => between(from, to),
        (_, true) => between(from.ln(), to.ln()).exp(),
    }
}

/// `velocity.1` and `velocity.y` as `velocity[1]`.
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

/// The items of a TOML array: commas inside brackets and quotes do not part them.
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
