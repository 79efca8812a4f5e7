//! The committed figures are those that the program draws.

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
        let drawn = std::fs::read(out.join(name)).unwrap();
        assert!(drawn.len() < 1_000_000, "{name}: {} bytes", drawn.len());
        let committed = Path::new(env!("CARGO_MANIFEST_DIR"))
            .join("figures")
            .join(name);
        assert!(
            drawn == std::fs::read(&committed).unwrap(),
            "{name} has changed: look at it, then run `snaprod sheets`"
        );
    }
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
