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

/// Catches what such scenes have brought to light: a mesh along a taut rod of absurd length under a couple that grew until the memory was full, a stiffness
/// by which all energies were rounded to nothing, and waves so fast that no step moved the time, or that no interruption was heeded.
#[test]
fn scenes_that_went_wrong_end_in_a_stated_outcome() {
    let long = r#"
[rod]
model = "cosserat"
length = 1e16
section = { bending = [5.85e-4, 2.78e-3], torsion = 4.16e-4, axial = 3.62e6 }
[end]
force = [1804.8, -4889.7, 4759.3]
couple = [-2.27, -2.40, -3.30]
"#;
    let stiff = r#"
[rod]
model = "elastica"
length = 7.6e-5
bending_stiffness = 1e300
damping = { proportional = 2e-6 }
[body]
mass = 1916.0
[start]
rest = "straight"
velocity = [0.0, 5.35]
[run]
duration = 2e-4
"#;
    let fast = r#"
[rod]
model = "bar"
length = 3.0
area = 0.03
density = 1e-300
law = { neo_hookean = 37.2 }
cells = 10
[loads]
force = { block = { size = -0.174, until = 0.002 } }
[run]
duration = 9e-4
"#;
    // A step of 1e-14: interrupted within a row.
    let slow = fast.replace("1e-300", "1e-26");
    for (text, wanted) in [
        (long, "refused"),
        (stiff, "refused"),
        (fast, "stuck"),
        (&slow, "interrupted"),
    ] {
        let word =
            judged(text, Duration::from_secs(1)).unwrap_or_else(|why| panic!("{why}: {text}"));
        assert!(word.starts_with(wanted), "{word}");
    }
}
