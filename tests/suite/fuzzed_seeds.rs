//! The inputs that the fuzzers begin with, and those they found, without a fuzzer.

use crate::fuzzed::{Held, kernel, reader};
use std::fs;

/// Every file of a directory of the repository; `judge` is given its bytes.
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

/// Catches a reader that panics, goes on for ever, or refuses a scene without words or without a place in the text.
#[test]
fn the_reader_answers_whatever_it_is_given() {
    each("fuzz/seeds/reader", reader);
    each("scenes", reader);
}

/// Catches kernels that panic, give numbers that are none, or equilibria that are not where they were asked for.
#[test]
fn kernels_answer_whatever_they_are_given() {
    each("fuzz/seeds/kernels", |bytes| {
        let text = String::from_utf8_lossy(bytes);
        text.lines().try_for_each(kernel)
    });
}
