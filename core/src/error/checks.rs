//! Checks of numbers. A message names the number, the value and the allowed values.

use super::message::{DIGITS, format_rounded};
use super::{Error, Result};

/// Names of the strains, of the resultants, and of coordinates.
pub const STRAINS: [&str; 6] = ["u1", "u2", "u3", "v1", "v2", "v3"];
/// Names of the resultants.
pub const RESULTANTS: [&str; 6] = ["m1", "m2", "m3", "n1", "n2", "n3"];
/// Names of the coordinates of a place or direction.
pub const AXES: [&str; 3] = ["x", "y", "z"];

/// Numbers with their names, such as "x = 0.5, y = 0", rounded for messages. Numbers beyond the names are left out.
pub fn named(names: &[&str], values: &[f64]) -> String {
    let pairs = names.iter().zip(values);
    let texts: Vec<String> = pairs
        .map(|(name, value)| format!("{name} = {}", format_rounded(*value, DIGITS)))
        .collect();
    texts.join(", ")
}

/// Names of the strains that are marked, or "none".
pub fn marked_strains(marks: &[bool; 6]) -> String {
    let names = STRAINS.iter().zip(marks);
    let names: Vec<&str> = names
        .filter(|(_, mark)| **mark)
        .map(|(name, _)| *name)
        .collect();
    match names.as_slice() {
        [] => "none".to_owned(),
        names => names.join(", "),
    }
}

/// Error unless the number is finite and > 0.
pub(crate) fn check_positive(name: &str, value: f64) -> Result<()> {
    if 0.0 < value && value < f64::INFINITY {
        return Ok(());
    }
    Err(Error::domain(format!(
        "{name} = {value} must be finite and > 0"
    )))
}

/// Error unless all of these numbers are finite.
pub(crate) fn check_finite(name: &str, values: &[f64]) -> Result<()> {
    let Some(wrong) = values.iter().position(|x| !x.is_finite()) else {
        return Ok(());
    };
    Err(Error::domain(format!(
        "{name} must be finite: number {} of {} is {}",
        wrong + 1,
        values.len(),
        values[wrong]
    )))
}
