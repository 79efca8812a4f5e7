//! Published numbers of rods: those of `examples/published`, through the public interface.

#[path = "../../examples/published/numbers/mod.rs"]
mod numbers;

/// Catches any error of mechanics, solver, continuation or index that changes a known number: B1-B7, B9-B11, B13
/// against closed forms and independent codes (tests/data/rod_branch.json).
#[test]
fn numbers_computed_apart_are_reproduced() {
    let numbers = numbers::all().expect("the numbers");
    assert!(numbers.len() > 80, "only {} numbers", numbers.len());
    for number in &numbers {
        assert!(number.distance() < numbers::BAR, "{number}");
    }
}
