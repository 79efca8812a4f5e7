//! Bodies that slide over an end of their groove and back within a step, which its ends do not tell.

use snaprod_systems::solve::roots::chandrupatla;

/// How well the moment is found at which a body turns back, relative to the step: where it is then is off by the square.
const FOUND: f64 = 1e-6;
/// A body this near to an end of its groove, relative to its length, is on it.
pub(super) const ON_END: f64 = 1e-12;

/// The part of a step that takes the time `span` after which a body turns back beyond the end of its groove towards which it sets out, if it does. The
/// parameter along the groove, which lies between `ends`, and its rate are given where the step begins and ends, and `at` a part of it.
pub(super) fn turned(
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
    // A body that slows down evenly comes half as far as at the rate at which it sets out, at most.
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
