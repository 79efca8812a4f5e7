//! Output: numbers, standard output that may be a closed pipe, and files that are written whole or not at all.

use super::Refusal;
use serde_json::Value;
use std::fs;
use std::io::Write;
use std::path::Path;

/// Prints text; a reader that has gone away is no error, a full disk ends the program.
pub fn print(text: &str) {
    let mut out = std::io::stdout().lock();
    if let Err(e) = out.write_all(text.as_bytes()).and_then(|()| out.flush())
        && e.kind() != std::io::ErrorKind::BrokenPipe
    {
        print_error(&format!("error: cannot write to standard output: {e}"));
        std::process::exit(2);
    }
}

/// A number in full precision, for tables: with an exponent where its digits would be many zeros, and
/// no minus before a zero.
pub fn exact(x: f64) -> String {
    // -0.0 + 0.0 is 0.0.
    format!("{:?}", x + 0.0)
}

/// The same for text, where a whole number needs no ".0".
pub fn number(x: f64) -> String {
    let text = exact(x);
    text.strip_suffix(".0").unwrap_or(&text).to_owned()
}

/// A number with so many decimals; where they would show little or too much of it, with an exponent.
pub fn rounded(x: f64, decimals: usize) -> String {
    if x == 0.0 || (1e-3..1e9).contains(&x.abs()) {
        format!("{:.decimals$}", x + 0.0)
    } else {
        format!("{x:.decimals$e}")
    }
}

/// JSON text; no number in it is -0.0.
pub fn json_text(mut value: Value) -> String {
    unsign_zeros(&mut value);
    format!("{value:#}\n")
}

fn unsign_zeros(value: &mut Value) {
    match value {
        Value::Array(list) => list.iter_mut().for_each(unsign_zeros),
        Value::Object(map) => map.values_mut().for_each(unsign_zeros),
        Value::Number(n) if n.is_f64() && n.as_f64() == Some(0.0) => *value = 0.0.into(),
        _ => {}
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

/// Makes a directory and those above it.
pub fn make_directory(path: &Path) -> Result<(), Refusal> {
    fs::create_dir_all(path).map_err(|e| {
        Refusal(format!(
            "cannot make the directory {}: {e}; choose another with --out",
            path.display()
        ))
    })
}

/// Writes a file by way of a neighbour, so that it is never seen half written.
pub fn write_whole(path: &Path, bytes: &[u8]) -> Result<(), Refusal> {
    let mut draft = path.as_os_str().to_owned();
    draft.push(".part");
    let refuse = |e| Refusal(format!("cannot write {}: {e}", path.display()));
    fs::write(&draft, bytes).map_err(refuse)?;
    fs::rename(&draft, path).map_err(refuse)
}

/// Writes a figure, and its PNG where asked.
pub fn write_figure(directory: &Path, name: &str, svg: &str, png: bool) -> Result<(), Refusal> {
    write_whole(&directory.join(format!("{name}.svg")), svg.as_bytes())?;
    if png {
        write_png(directory, name, svg)?;
    }
    Ok(())
}

#[cfg(feature = "png")]
fn write_png(directory: &Path, name: &str, svg: &str) -> Result<(), Refusal> {
    let bytes = snaprod::plot::png(svg, 2.0)?;
    write_whole(&directory.join(format!("{name}.png")), &bytes)
}

#[cfg(not(feature = "png"))]
fn write_png(_: &Path, _: &str, _: &str) -> Result<(), Refusal> {
    unreachable!("refused by check_png")
}

/// Refuses `--png` early where the program cannot do it.
pub fn check_png(asked: bool) -> Result<(), Refusal> {
    if asked && cfg!(not(feature = "png")) {
        return Err(Refusal(
            "--png: this program was built without PNG; build it with `cargo build --release --features png`, or use the SVG files".to_owned(),
        ));
    }
    Ok(())
}
