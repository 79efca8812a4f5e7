//! A few of the scenes that `examples/stress.rs` draws at random.

use crate::stress_scenes::{judged, scene};
use snaprod::scene::Scene;
use snaprod::study::run::Fields;
use snaprod::study::{Silent, Table, dispatch};
use std::time::Duration;

/// Catches panics, NaN and infinite numbers, time running back, spurious or unreported energy, and refusals without a
/// message, over all models. A scene over its time limit is interrupted, which is a valid outcome.
#[test]
#[ignore = "second tier: 9 s"]
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

/// Catches failures found by random scenes. A mesh along a taut rod of absurd length under a couple grew until the
/// memory was full. A stiffness rounded all energies to nothing. Waves were so fast that no step moved the time, or
/// that no interruption was noticed.
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

/// Catches a motion below its tolerance that ends as if normal: with a body of 1e-16 the speeds are 2e-8 in units of
/// the rod, the tolerance is 5e-8, and the energies are those of the steps' errors. A finer tolerance closes the
/// ledger.
#[test]
fn motions_below_their_tolerance_are_told() {
    let scene = |tolerance: &str| {
        format!(
            r#"
[rod]
model = "cosserat"
length = 5.6
section = {{ bending = [9.0, 6.0], torsion = 7.1 }}
rest = {{ curvature = [2e-3, -0.26] }}
[body]
mass = 1e-16
joint = "ball"
[start]
settled = true
velocity = [1.16, -2.19, -0.06]
[run]
duration = 1e-6
samples = 41
tolerance = {tolerance}
"#
        )
    };
    let ends = |tolerance| judged(&scene(tolerance), Duration::from_secs(60)).unwrap();
    assert_eq!(ends("5e-8"), "below the tolerance");
    let fine = Scene::parse(&scene("1e-12")).unwrap();
    let found =
        dispatch::motion(&fine, Fields::None, &mut Vec::<Table>::new(), &mut Silent).unwrap();
    assert_eq!((found.reason, found.warning), (None, None));
    let relative = found.summary["energy_error"]["relative"].as_f64();
    assert!(relative.is_some_and(|off| off < 1e-4), "{relative:?}");
}
