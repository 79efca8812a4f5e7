//! The committed figures are those that the program draws.

use crate::program::parts;
use std::path::{Path, PathBuf};
use std::process::{Command, Output};

fn sheets(arguments: &[&str]) -> Output {
    Command::new(env!("CARGO_BIN_EXE_snaprod"))
        .arg("sheets")
        .args(arguments)
        .output()
        .unwrap()
}

/// A directory of this test's own.
fn directory(name: &str) -> PathBuf {
    Path::new(env!("CARGO_TARGET_TMPDIR")).join(name)
}

#[test]
fn sheets_are_drawn_as_committed() {
    let out = directory("sheets");
    let made = sheets(&["--json", "--out", out.to_str().unwrap()]);
    assert!(made.status.success(), "{made:?}");
    let report: serde_json::Value = serde_json::from_slice(&made.stdout).unwrap();
    let files = report["files"].as_array().unwrap();
    assert_eq!(files.len(), 5);
    for file in files {
        let name = file.as_str().unwrap();
        let drawn = std::fs::read_to_string(out.join(name)).unwrap();
        assert!(drawn.len() < 1_000_000, "{name}: {} bytes", drawn.len());
        let committed = Path::new(env!("CARGO_MANIFEST_DIR"))
            .join("figures")
            .join(name);
        let different = differences(&drawn, &std::fs::read_to_string(&committed).unwrap());
        // Where a coordinate is rounded, another machine may keep a point more.
        assert!(
            different * 500 <= drawn.lines().count(),
            "{name} has changed in {different} lines: look at it, then run `snaprod sheets`"
        );
    }
}

/// How many lines of two figures differ by more than 0.3 pixels in a coordinate (figures are drawn ten times enlarged) or in
/// anything else: functions of another machine's library are an ulp apart.
fn differences(a: &str, b: &str) -> usize {
    let alike = |a: &str, b: &str| {
        let ((text, numbers), (other, values)) = (parts(a), parts(b));
        let near = |(x, y): (&String, &String)| {
            let [x, y]: [f64; 2] = [x, y].map(|n| n.parse().unwrap());
            (x - y).abs() <= 3.0
        };
        text == other && numbers.iter().zip(&values).all(near)
    };
    let unlike = a.lines().zip(b.lines()).filter(|(a, b)| !alike(a, b));
    unlike.count() + a.lines().count().abs_diff(b.lines().count())
}

#[test]
fn many_modes_fit() {
    let out = directory("modes");
    let made = sheets(&["--modes", "3,0,2,1", "--out", out.to_str().unwrap()]);
    assert!(made.status.success(), "{made:?}");
    for line in String::from_utf8(made.stdout).unwrap().lines() {
        let size = std::fs::metadata(line).unwrap().len();
        assert!(size < 1_000_000, "{line}: {size} bytes");
    }
}

#[test]
fn bad_modes_are_named() {
    for bad in ["4", "-1", "x", "0,,1"] {
        let made = sheets(&["--modes", bad]);
        assert_eq!(made.status.code(), Some(2), "{bad}");
        let why = String::from_utf8(made.stderr).unwrap();
        assert!(
            why.contains("--modes") && why.contains("0, 1, 2, 3"),
            "{why}"
        );
    }
}
