//! The scene reader on fuzzed input.
#![no_main]

#[path = "../../tests/suite/fuzzed.rs"]
#[allow(dead_code)]
mod fuzzed;

libfuzzer_sys::fuzz_target!(|input: &[u8]| {
    fuzzed::reader(input).unwrap();
});
