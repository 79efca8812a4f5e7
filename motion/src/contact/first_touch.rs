//! The first touch within a step, without sampling: gaps are bounded below between the places where they are known.
//!
//! With K a bound of -g'' over a stretch from 0 to T, g(t) >= g(0) + g'(0) t - K t^2/2, and so from the other end. A
//! stretch whose two parabolas stay above zero together has no touch; any other stretch is halved.

/// Gap and rate of a candidate at a time from the start of the step.
#[derive(Debug, Clone, Copy)]
pub(super) struct GapAt {
    pub t: f64,
    pub gap: f64,
    pub rate: f64,
}

/// Depth at which an overlap counts as a touch; a shallower graze passes.
pub(super) const DEPTH: f64 = 1e-12;
/// Shortest stretch, relative to the step.
const SHORTEST: f64 = 1e-13;

/// Time from a place, at this rate towards the stretch, for which the parabola stays above -[`DEPTH`].
fn clear(gap: f64, rate: f64, fall: f64) -> f64 {
    let room = gap + DEPTH;
    if !(room > 0.0) {
        return 0.0;
    }
    // room + rate t - fall t^2/2 = 0, in a form without cancellation for either sign of the rate.
    let root = (rate * rate + 2.0 * fall * room).sqrt();
    if rate > 0.0 {
        (rate + root) / fall
    } else {
        2.0 * room / (root - rate)
    }
}

/// The end of a stretch in which the gap falls below -[`DEPTH`] for the first time between `from` and `to`; the gap
/// falls there. None if it stays above. `fall` bounds -g'' over the stretch.
pub(super) fn first_touch(
    from: GapAt,
    to: GapAt,
    fall: f64,
    inside: &mut impl FnMut(f64) -> Option<GapAt>,
) -> Option<GapAt> {
    let shortest = SHORTEST * (to.t - from.t);
    search(from, to, fall, shortest, inside)
}

fn search(
    from: GapAt,
    to: GapAt,
    fall: f64,
    shortest: f64,
    inside: &mut impl FnMut(f64) -> Option<GapAt>,
) -> Option<GapAt> {
    let length = to.t - from.t;
    let covered = clear(from.gap, from.rate, fall) + clear(to.gap, -to.rate, fall) > length;
    if covered && to.gap > -DEPTH {
        return None;
    }
    // A monotone fall: the touch is in this stretch, and only one.
    let falls_on = from.gap > -DEPTH && to.gap <= -DEPTH && from.rate.max(to.rate) < 0.0;
    if falls_on && fall * length < 0.5 * from.rate.abs().min(to.rate.abs()) || length <= shortest {
        return (to.gap <= -DEPTH && to.rate < 0.0).then_some(to);
    }
    let middle = inside(0.5 * (from.t + to.t))?;
    search(from, middle, fall, shortest, inside)
        .or_else(|| search(middle, to, fall, shortest, inside))
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Catches a touch that hides between samples: a dip of width 1e-4 in a step of length 1, just deep enough, and
    /// just not.
    #[test]
    fn narrow_dips_are_found() {
        for (depth, touches) in [(1e-9, true), (-1e-9, false)] {
            let at = |t: f64| {
                let s = (t - 0.377_123) / 1e-4;
                GapAt {
                    t,
                    gap: 0.5 * s * s * 1e-3 - depth,
                    rate: s * 1e-3 / 1e-4,
                }
            };
            let found = first_touch(at(0.0), at(1.0), 1e-3 / 1e-8, &mut |t| Some(at(t)));
            assert_eq!(found.is_some(), touches);
            assert!(found.is_none_or(|found| (found.t - 0.377_123).abs() < 1e-6));
        }
    }
}
