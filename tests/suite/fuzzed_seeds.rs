//! Seed inputs of the fuzzers, and inputs found by them, run without a fuzzer.

use crate::fuzzed::{Held, kernel, reader};
use snaprod::scene::Scene;
use std::fs;

/// Every file of a directory of the repository; `judge` receives its bytes.
fn each(directory: &str, judge: impl Fn(&[u8]) -> Held) {
    let path = format!("{}/{directory}", env!("CARGO_MANIFEST_DIR"));
    let files: Vec<_> = fs::read_dir(&path)
        .unwrap()
        .map(|entry| entry.unwrap().path())
        .collect();
    assert!(files.len() > 3, "{path} is empty");
    for file in files {
        judge(&fs::read(&file).unwrap()).unwrap_or_else(|why| panic!("{}: {why}", file.display()));
    }
}

/// Catches a reader that panics, never ends, or refuses a scene without a message or a place in the text.
#[test]
fn the_reader_answers_whatever_it_is_given() {
    each("fuzz/seeds/reader", reader);
    each("scenes", reader);
}

/// Catches kernels that panic or return NaN or infinite numbers, and equilibria with wrong end positions.
#[test]
fn kernels_answer_whatever_they_are_given() {
    each("fuzz/seeds/kernels", |bytes| {
        let text = String::from_utf8_lossy(bytes);
        text.lines().try_for_each(kernel)
    });
}

/// Catches a field of another kind of scene that is read although it was reported: a block, which only bars have, of a
/// mass on a strip. Its own fields were reported, too, and with assertions compiled the reader aborted.
#[test]
fn a_field_of_another_kind_is_reported_once() {
    let text = r#"
[rod]
model = "elastica"
length = 1.0
bending_stiffness = 1.0
[body]
mass = 1.0
[start]
lambda = 6.3
kappa = 0.6
[loads]
force = { direction = [0.0, 1.0], block = { size = 2.0, until = 0.002 } }
[run]
duration = 3.0
"#;
    let faults = Scene::parse(text).unwrap_err();
    let told: Vec<&str> = faults
        .as_slice()
        .iter()
        .map(|fault| &*fault.field)
        .collect();
    assert_eq!(told, ["loads.force.block"], "{faults}");
}
