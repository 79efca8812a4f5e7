//! Numbers as text, and output to the standard streams, which may be closed pipes.

use super::Refusal;
use serde_json::Value;
pub use snaprod::study::{exact, json_text};
use std::io::Write;
use std::sync::atomic::{AtomicBool, Ordering};

/// Prints text. A closed pipe is no error; a full disk ends the program.
pub fn print(text: &str) {
    let mut out = std::io::stdout().lock();
    survive(out.write_all(text.as_bytes()).and_then(|()| out.flush()));
}

/// Continues after success or a closed pipe; ends the program on any other error of standard output.
pub fn survive(written: std::io::Result<()>) {
    if let Err(e) = written
        && e.kind() != std::io::ErrorKind::BrokenPipe
    {
        print_error(&format!("error: cannot write to standard output: {e}"));
        std::process::exit(2);
    }
}

/// True if numbers in words have all digits. A process prints in one manner, hence a static.
static VERBOSE: AtomicBool = AtomicBool::new(false);

/// Sets whether numbers in words have all digits, as with `--verbose`; by default they have six.
pub fn print_all_digits(all: bool) {
    VERBOSE.store(all, Ordering::Relaxed);
}

/// The number rounded to six digits that count, unless all digits are asked for.
fn told(x: f64) -> f64 {
    if VERBOSE.load(Ordering::Relaxed) {
        x
    } else {
        format!("{x:.5e}").parse().unwrap_or(x)
    }
}

/// The number in words: six digits, or with `--verbose` all digits; whole numbers have no ".0".
pub fn number(x: f64) -> String {
    let text = exact(told(x));
    text.strip_suffix(".0").unwrap_or(&text).to_owned()
}

/// The number, or 0 if it is rounding compared with `scale`.
pub fn settled(x: f64, scale: f64) -> f64 {
    /// Rounding of solved quantities, relative to their scale.
    const ROUNDING: f64 = 1e-12;
    if x.abs() <= ROUNDING * scale { 0.0 } else { x }
}

/// Two numbers with a comma between them.
pub fn pair(a: f64, b: f64) -> String {
    format!("{}, {}", number(a), number(b))
}

/// A number in words: six digits, or with `--verbose` fixed decimals, with an exponent if fixed decimals would show too
/// few or too many digits.
pub fn rounded(x: f64, decimals: usize) -> String {
    if !VERBOSE.load(Ordering::Relaxed) {
        number(x)
    } else if x == 0.0 || (1e-3..1e9).contains(&x.abs()) {
        format!("{:.decimals$}", x + 0.0)
    } else {
        format!("{x:.decimals$e}")
    }
}

/// The number with five digits that count, for words in figures.
pub fn short(x: f64) -> String {
    match x.abs() {
        0.0 => "0".to_owned(),
        size if (1e-3..1e5).contains(&size) => {
            format!("{x:.*}", (4.0 - size.log10().floor()) as usize)
        }
        _ => format!("{x:.4e}"),
    }
}

/// Prints one JSON object.
pub fn print_json(value: Value) {
    print(&json_text(value));
}

/// Prints text on the error stream; a closed pipe is no error.
pub fn print_error(text: &str) {
    let _ = writeln!(std::io::stderr().lock(), "{text}");
}

/// Prints the reason of a refusal on the error stream, on a terminal in clap's colours.
pub fn print_refusal(why: &str) {
    let styles = clap::builder::Styles::styled();
    let error = styles.get_error();
    let _ = writeln!(anstream::stderr().lock(), "{error}error:{error:#} {why}");
}

/// A resolved scene as TOML, which can be run again; empty fields are left out.
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
