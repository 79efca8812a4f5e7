//! Numbers as text, and the standard streams, which may be closed pipes.

use super::Refusal;
use serde_json::Value;
pub use snaprod::study::{exact, json_text};
use std::io::Write;

/// Prints text; a reader that has gone away is no error, a full disk ends the program.
pub fn print(text: &str) {
    let mut out = std::io::stdout().lock();
    survive(out.write_all(text.as_bytes()).and_then(|()| out.flush()));
}

/// Goes on after standard output was written, or was closed by its reader; ends the program otherwise.
pub fn survive(written: std::io::Result<()>) {
    if let Err(e) = written
        && e.kind() != std::io::ErrorKind::BrokenPipe
    {
        print_error(&format!("error: cannot write to standard output: {e}"));
        std::process::exit(2);
    }
}

/// The same as [`exact`] for text, where a whole number needs no ".0".
pub fn number(x: f64) -> String {
    let text = exact(x);
    text.strip_suffix(".0").unwrap_or(&text).to_owned()
}

/// The number, or 0 where it is rounding beside `scale`.
pub fn settled(x: f64, scale: f64) -> f64 {
    /// Rounding of what is solved for, relative to its scale.
    const ROUNDING: f64 = 1e-12;
    if x.abs() <= ROUNDING * scale { 0.0 } else { x }
}

/// Two numbers.
pub fn pair(a: f64, b: f64) -> String {
    format!("{}, {}", number(a), number(b))
}

/// A number with so many decimals; where they would show little or too much of it, with an exponent.
pub fn rounded(x: f64, decimals: usize) -> String {
    if x == 0.0 || (1e-3..1e9).contains(&x.abs()) {
        format!("{:.decimals$}", x + 0.0)
    } else {
        format!("{x:.decimals$e}")
    }
}

/// Prints one JSON object.
pub fn print_json(value: Value) {
    print(&json_text(value));
}

/// Prints text on the error stream; a reader that has gone away is no error.
pub fn print_error(text: &str) {
    let _ = writeln!(std::io::stderr().lock(), "{text}");
}

/// A scene with its defaults as TOML, which can be run again; what it does not have is left out.
pub fn toml_text(scene: &Value) -> Result<String, Refusal> {
    fn without_nulls(value: &Value) -> Value {
        match value {
            Value::Object(map) => {
                let some = map.iter().filter(|(_, value)| !value.is_null());
                let some = some.map(|(name, value)| (name.clone(), without_nulls(value)));
                Value::Object(some.collect())
            }
            Value::Array(list) => list.iter().map(without_nulls).collect(),
            other => other.clone(),
        }
    }
    toml::to_string(&without_nulls(scene))
        .map_err(|e| Refusal(format!("the resolved scene cannot be written: {e}")))
}
