//! Reference data and comparisons that a NaN, a wrong sign or a missing file cannot pass.

use serde_json::Value;

/// Reads a JSON file of tests/data; missing or broken data fail.
pub fn json(name: &str) -> Value {
    let path = format!("{}/tests/data/{name}", env!("CARGO_MANIFEST_DIR"));
    let text = std::fs::read_to_string(&path).unwrap_or_else(|e| panic!("{path}: {e}"));
    serde_json::from_str(&text).unwrap_or_else(|e| panic!("{path}: {e}"))
}

/// The rows under `key`, at least `least` of them.
pub fn rows<'a>(data: &'a Value, key: &str, least: usize) -> &'a [Value] {
    let rows = data[key]
        .as_array()
        .unwrap_or_else(|| panic!("no list {key}"));
    assert!(rows.len() >= least, "{key}: only {} rows", rows.len());
    rows
}

/// A number written as a number or as a decimal string.
pub fn number(row: &Value, key: &str) -> f64 {
    let value = &row[key];
    value
        .as_f64()
        .or_else(|| value.as_str().and_then(|s| s.parse().ok()))
        .unwrap_or_else(|| panic!("no number {key} in {row}"))
}

/// |got - want| <= tolerance max(|want|, floor): false for NaN.
pub fn close(got: f64, want: f64, tolerance: f64, floor: f64) -> bool {
    (got - want).abs() <= tolerance * want.abs().max(floor)
}

/// Asserts [`close`] with a message.
#[track_caller]
pub fn assert_close(got: f64, want: f64, tolerance: f64, floor: f64, what: &str) {
    assert!(
        close(got, want, tolerance, floor),
        "{what}: got {got:e}, want {want:e}, off by {:e}",
        got - want
    );
}
