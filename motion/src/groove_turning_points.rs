//! Bodies that slide over an end of their groove and back within one step: the states at its ends do not show
//! the crossing.

use snaprod_systems::solve::roots::chandrupatla;

/// Tolerance, relative to the step, of the moment at which a body turns back; its position then is off by the square.
const FOUND: f64 = 1e-6;
/// Largest distance to an end of the groove, relative to the length, of a body on the end.
pub(super) const ON_END: f64 = 1e-12;

/// The fraction of a step at which a body turns back beyond the end of its groove; None if it does not.
/// `from`, `to`: parameter along the groove and its rate at the start and end of the step, which takes the
/// time `span`. `first`, `last`: the ends of the groove. `at` gives parameter and rate at a fraction.
pub(super) fn turning_fraction(
    [from, to]: [[f64; 2]; 2],
    span: f64,
    [first, last]: [f64; 2],
    mut at: impl FnMut(f64) -> Option<[f64; 2]>,
) -> Option<f64> {
    let [phi, rate] = from;
    if !(rate * to[1] < 0.0) {
        return None;
    }
    let end = if rate > 0.0 { last } else { first };
    // A body under even deceleration goes half as far as at the initial rate, at most.
    if !((end - phi) / rate < span) {
        return None;
    }
    let x = chandrupatla(
        |x| at(x).map_or(f64::NAN, |[_, rate]| rate),
        (0.0, rate),
        (1.0, to[1]),
        FOUND,
    )?;
    let beyond = (at(x)?[0] - end) * rate.signum();
    (beyond > ON_END * (last - first)).then_some(x)
}
