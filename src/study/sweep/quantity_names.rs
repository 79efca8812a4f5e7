//! Check of quantity names against the results of one point, before all others run.

use super::{Interrupted, SpecialName, Sweep, element};
use crate::scene::nearest;
use crate::study::Hooks;
use serde_json::Value;

/// Prefix of paths into the event list, whose length and kinds differ between points.
const EVENTS: &str = "events.";

impl Sweep {
    /// Error message for a requested quantity that is found neither at the first point with a run nor at the last
    /// point, whose results may differ. `None` as well if no point near the start has a run.
    ///
    /// # Errors
    /// [`Interrupted`] if `hooks` says so.
    pub(super) fn unknown_quantity_message(
        &self,
        hooks: &mut dyn Hooks,
    ) -> std::result::Result<Option<String>, Interrupted> {
        // Usual quantities are allowed to be absent: callers may repeat the columns of another sweep.
        let usual = self.usual();
        let may_lack = |path: &String| path.starts_with(EVENTS) || usual.contains(path);
        let mut asked: Vec<&String> = self.asked.iter().filter(|path| !may_lack(path)).collect();
        if asked.is_empty() {
            return Ok(None);
        }
        let mut first = None;
        for point in self.chunks()[0].clone() {
            if let Ok(summary) = self.comes_of(point, hooks)? {
                first = Some((point, summary));
                break;
            }
        }
        let Some((point, summary)) = first else {
            return Ok(None);
        };
        asked.retain(|path| missing_value_message(&summary, path).is_some());
        let last = self.points() - 1;
        if !asked.is_empty()
            && last != point
            && let Ok(summary) = self.comes_of(last, hooks)?
        {
            asked.retain(|path| missing_value_message(&summary, path).is_some());
        }
        let wrong = asked
            .first()
            .and_then(|path| Some((path, missing_value_message(&summary, path)?)));
        Ok(wrong.map(|(path, there)| {
            let mut all = Vec::new();
            quantities("", &summary, &mut all);
            let meant = nearest(path, &mut all.iter().map(String::as_str));
            let meant = meant.map_or(String::new(), |name| format!("did you mean {name}? "));
            let further = if summary.get("special_points").is_some() {
                "the scene has [continue], so that the results are those of its branch: a special point is named as in LP1, BP2.energy or LP@0.4 (the fold \
                 nearest to 0.4); take [continue] out for one equilibrium"
            } else {
                "what happens on the way is named as in events.-1.t, and peaks as in greatest.y"
            };
            format!(
                "column {path}: what comes of point {point} has no such number or word; {meant}{there}; {further}"
            )
        }))
    }
}

/// Message if a path leads to no number or word. `None` if it does, or if it may at another point: longer lists,
/// fields of null.
fn missing_value_message(summary: &Value, path: &str) -> Option<String> {
    if let Some(name) = SpecialName::parse(path) {
        // Another point may have a branch with this special point.
        let is_branch = summary.get("special_points").is_some();
        return name.find(summary).err().filter(|_| !is_branch);
    }
    let mut at = summary;
    let mut way = String::new();
    for step in path.split('.') {
        let inner = match at {
            Value::Null => return None,
            Value::Array(list) => match element(list, step) {
                None if step.parse::<i64>().is_ok() => return None,
                inner => inner,
            },
            other => other.get(step),
        };
        let Some(inner) = inner else {
            return Some(holds(&way, at));
        };
        at = inner;
        if !way.is_empty() {
            way.push('.');
        }
        way.push_str(step);
    }
    matches!(at, Value::Array(_) | Value::Object(_)).then(|| holds(&way, at))
}

/// Message with the entries at a path.
fn holds(way: &str, at: &Value) -> String {
    let way = if way.is_empty() { "the summary" } else { way };
    match at {
        Value::Object(fields) => {
            let names: Vec<&str> = fields.keys().map(String::as_str).collect();
            format!("{way} has {}", names.join(", "))
        }
        Value::Array(list) => format!("{way} has {} elements, counted from 0", list.len()),
        _ => format!("{way} has no fields"),
    }
}

/// Paths of all numbers and words in nested tables.
fn quantities(way: &str, at: &Value, all: &mut Vec<String>) {
    match at {
        Value::Object(fields) => {
            for (name, inner) in fields {
                let path = match way {
                    "" => name.clone(),
                    _ => format!("{way}.{name}"),
                };
                quantities(&path, inner, all);
            }
        }
        Value::Array(_) => {}
        _ => all.push(way.to_owned()),
    }
}
