//! Unit of processor time in which `.ci/run` counts the suite: fixed work that no change of the library makes faster.

/// Steps of a map on [0, 4], some three seconds of sines, roots and divisions.
#[test]
#[ignore = "unit of the suite's budget, for .ci/run"]
fn yardstick() {
    let mut x = 0.3_f64;
    for _ in 0..100_000_000 {
        x = 4.0 * (x.sin() * x).sqrt().abs() / (1.0 + x);
        if !(x > 0.0) {
            x = 0.3;
        }
    }
    assert!((0.0..=4.0).contains(&x), "{x}");
}
