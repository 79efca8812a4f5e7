//! The numbers of a JSON value in order, and a value of the same layout with other numbers.

use serde_json::{Map, Value};

/// Keys whose values are no differentiable numbers of an equilibrium.
const FIXED: [&str; 9] = [
    "index",
    "path",
    "residual",
    "zero_modes",
    "centreline",
    "contacts",
    "from_guess",
    "stable",
    "conservative",
];

/// The part of a summary that has differentiable numbers.
pub fn differentiable(summary: Value) -> Value {
    let Value::Object(fields) = summary else {
        return summary;
    };
    let kept = fields.into_iter().filter_map(|(name, value)| {
        let value = real(value)?;
        (!FIXED.contains(&name.as_str())).then_some((name, value))
    });
    Value::Object(kept.collect())
}

/// The value without words, flags and missing numbers; `None` if nothing is left.
fn real(value: Value) -> Option<Value> {
    match value {
        Value::Number(_) => Some(value),
        Value::Array(items) => {
            let items: Vec<Value> = items.into_iter().filter_map(real).collect();
            (!items.is_empty()).then_some(Value::Array(items))
        }
        Value::Object(fields) => {
            let fields = fields.into_iter();
            let fields: Map<String, Value> = fields
                .filter_map(|(name, value)| Some((name, real(value)?)))
                .collect();
            (!fields.is_empty()).then_some(Value::Object(fields))
        }
        Value::Null | Value::Bool(_) | Value::String(_) => None,
    }
}

/// All numbers, in the order of the value.
pub fn numbers(value: &Value) -> Vec<f64> {
    match value {
        Value::Number(number) => vec![number.as_f64().unwrap_or(f64::NAN)],
        Value::Array(items) => items.iter().flat_map(numbers).collect(),
        Value::Object(fields) => fields.values().flat_map(numbers).collect(),
        Value::Null | Value::Bool(_) | Value::String(_) => Vec::new(),
    }
}

/// The value with other numbers.
pub fn with_numbers(value: &Value, numbers: &mut impl Iterator<Item = f64>) -> Value {
    match value {
        Value::Number(_) => numbers.next().map_or(Value::Null, Value::from),
        Value::Array(items) => items
            .iter()
            .map(|item| with_numbers(item, numbers))
            .collect(),
        Value::Object(fields) => fields
            .iter()
            .map(|(name, field)| (name.clone(), with_numbers(field, numbers)))
            .collect(),
        Value::Null | Value::Bool(_) | Value::String(_) => value.clone(),
    }
}
