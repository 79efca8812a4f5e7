//! Kernels on fuzzed input, one call a line.
#![no_main]

#[path = "../../tests/suite/fuzzed.rs"]
#[allow(dead_code)]
mod fuzzed;

libfuzzer_sys::fuzz_target!(|input: &str| {
    input.lines().for_each(|line| fuzzed::kernel(line).unwrap());
});
