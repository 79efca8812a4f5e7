//! Special points of a branch as quantities: `BP1` by its label, `LP@0.4` as the fold nearest to a value.

use super::{cell, number};
use crate::study::Cell;
use serde_json::Value;

/// Stems of the labels: fold, branch point, change of stability, cusp.
const STEMS: [&str; 4] = ["LP", "BP", "SC", "CP"];
/// Field of a special point for a name without a field, such as `LP1`.
const OWN: &str = "parameter";

/// A number of a special point, as a column names it.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct SpecialName<'p> {
    label: &'p str,
    stem: &'p str,
    /// The point nearest to this value of the parameter; `None`: the point of the label.
    near: Option<f64>,
    /// Path into the special point, or a column of branch.csv there.
    field: &'p str,
}

impl<'p> SpecialName<'p> {
    /// Reads `BP1`, `BP1.energy` or `BP@-850.5.energy`; `None` for a path of another kind.
    pub fn parse(path: &'p str) -> Option<Self> {
        let stem = STEMS.into_iter().find(|stem| path.starts_with(stem))?;
        let is_letter = |at: usize| path[at + 1..].starts_with(|c: char| c.is_ascii_alphabetic());
        let mut dots = path.match_indices('.').map(|(at, _)| at);
        let (label, field) = match dots.find(|at| is_letter(*at)) {
            Some(at) => (&path[..at], &path[at + 1..]),
            None => (path, OWN),
        };
        let rest = &label[stem.len()..];
        let near = match rest.strip_prefix('@') {
            Some(value) => Some(value.parse().ok().filter(|x: &f64| x.is_finite())?),
            None => {
                rest.parse::<usize>().ok()?;
                None
            }
        };
        Some(Self {
            label,
            stem,
            near,
            field,
        })
    }

    /// True if the name means the value of the parameter.
    pub fn is_parameter(&self) -> bool {
        self.field == OWN
    }

    /// The special point in the summary of a branch, or the reason for its absence.
    pub fn point<'v>(&self, summary: &'v Value) -> Result<&'v Value, String> {
        let label = self.label;
        let Some(own) = summary["special_points"].as_array() else {
            return Err(format!(
                "{label}: special points are those of a branch, and the scene has no [continue]"
            ));
        };
        let further = summary["fold_curves"]["special_points"].as_array();
        let all = || own.iter().chain(further.into_iter().flatten());
        let at = match self.near {
            None => all().find(|at| at["label"] == label),
            Some(x) => {
                let of_kind = own.iter().filter(|at| {
                    let label = at["label"].as_str();
                    label.is_some_and(|label| label.starts_with(self.stem))
                });
                let away = |at: &Value| (at[OWN].as_f64().unwrap_or(f64::NAN) - x).abs();
                of_kind.min_by(|a, b| away(a).total_cmp(&away(b)))
            }
        };
        let Some(at) = at else {
            let there: Vec<&str> = all().filter_map(|at| at["label"].as_str()).collect();
            let there = if there.is_empty() {
                "no special point".to_owned()
            } else {
                there.join(", ")
            };
            let ends = summary["stop"].as_array().into_iter().flatten();
            let ends: Vec<&str> = ends.filter_map(Value::as_str).collect();
            return Err(format!(
                "there is no {label} on the branch of [continue]: it has {there}; {}",
                ends.join("; ")
            ));
        };
        if let Some(doubt) = at["reason"].as_str() {
            return Err(format!("{label} is uncertain: {doubt}"));
        }
        Ok(at)
    }

    /// The number in the summary of a branch, or the reason for its absence.
    pub fn find(&self, summary: &Value) -> Result<Cell, String> {
        let (label, at) = (self.label, self.point(summary)?);
        let state = &at["state"][self.field];
        match cell(at, self.field) {
            // Columns of assemblies have dots in their names.
            Cell::Missing if state.is_number() => Ok(number(state)),
            Cell::Missing => Err(format!(
                "{label} has no {}; it has {}",
                self.field,
                names(at)
            )),
            found => Ok(found),
        }
    }
}

/// Names of the numbers of a special point and of its state.
fn names(at: &Value) -> String {
    let own = at.as_object().into_iter().flatten();
    let own = own.filter(|(_, value)| value.is_number());
    let state = at["state"].as_object().into_iter().flatten();
    let names: Vec<&str> = own.chain(state).map(|(name, _)| name.as_str()).collect();
    names.join(", ")
}
