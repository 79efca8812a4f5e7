//! A few of the scenes that `examples/stress.rs` draws at random.

use crate::stress_scenes::{judged, scene};
use std::time::Duration;

/// Catches panics, numbers that are none, time that runs back, energy that comes out of nowhere or goes unsaid, and refusals without words, over all models. A
/// scene that takes longer than it is given is interrupted, which is an outcome, too.
#[test]
fn scenes_drawn_at_random_end_in_a_stated_outcome() {
    let mut done = 0;
    for seed in 1_000_000..1_000_060 {
        match judged(&scene(seed), Duration::from_millis(300)) {
            Ok(word) => done += usize::from(!word.starts_with("refused")),
            Err(why) => panic!("`cargo run --release --example stress {seed}`: {why}"),
        }
    }
    assert!(done > 30, "{done} scenes ran");
}
