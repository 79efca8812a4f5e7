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
/// Most places looked at for one depth. A body that glides along a surface at the depth itself is near a touch
/// everywhere; the search then goes on with a larger depth.
const MOST_LOOKS: usize = 4000;
/// Growth of the depth after [`MOST_LOOKS`] places.
const DEEPER: f64 = 100.0;
/// Shortest stretch, relative to the step.
const SHORTEST: f64 = 1e-13;

/// The end of a stretch in which the gap falls below minus the depth for the first time between `from` and `to`; the
/// gap falls there. None if it stays above. `fall` bounds -g'' over the stretch. The depth is [`DEPTH`], or larger
/// where the gap stays near that value.
pub(super) fn first_touch(
    from: GapAt,
    to: GapAt,
    fall: f64,
    inside: &mut impl FnMut(f64) -> Option<GapAt>,
) -> Option<GapAt> {
    let mut search = Search {
        depth: DEPTH,
        fall,
        shortest: SHORTEST * (to.t - from.t),
        looks: 0,
        inside,
    };
    loop {
        match search.within(from, to) {
            Looked::Touches(touch) => return Some(touch),
            Looked::Free => return None,
            Looked::TooOften => {
                search.looks = 0;
                search.depth *= DEEPER;
            }
        }
    }
}

/// Result of a search in a stretch.
enum Looked {
    Free,
    Touches(GapAt),
    /// [`MOST_LOOKS`] places were looked at.
    TooOften,
}

struct Search<'a, F> {
    depth: f64,
    fall: f64,
    shortest: f64,
    looks: usize,
    inside: &'a mut F,
}

impl<F: FnMut(f64) -> Option<GapAt>> Search<'_, F> {
    /// Time from a place, at this rate towards the stretch, for which the parabola stays above minus the depth.
    fn clear(&self, gap: f64, rate: f64) -> f64 {
        let room = gap + self.depth;
        if !(room > 0.0) {
            return 0.0;
        }
        // room + rate t - fall t^2/2 = 0, in a form without cancellation for either sign of the rate.
        let root = (rate * rate + 2.0 * self.fall * room).sqrt();
        if rate > 0.0 {
            (rate + root) / self.fall
        } else {
            2.0 * room / (root - rate)
        }
    }

    fn within(&mut self, from: GapAt, to: GapAt) -> Looked {
        let length = to.t - from.t;
        let covered = self.clear(from.gap, from.rate) + self.clear(to.gap, -to.rate) > length;
        if covered && to.gap > -self.depth {
            return Looked::Free;
        }
        // A monotone fall: the touch is in this stretch, and only one.
        let falls = from.gap > -self.depth && to.gap <= -self.depth && from.rate.max(to.rate) < 0.0;
        let is_monotone = self.fall * length < 0.5 * from.rate.abs().min(to.rate.abs());
        if falls && is_monotone || length <= self.shortest {
            return if to.gap <= -self.depth && to.rate < 0.0 {
                Looked::Touches(to)
            } else {
                Looked::Free
            };
        }
        self.looks += 1;
        if self.looks > MOST_LOOKS {
            return Looked::TooOften;
        }
        let Some(middle) = (self.inside)(0.5 * (from.t + to.t)) else {
            return Looked::Free;
        };
        match self.within(from, middle) {
            Looked::Free => self.within(middle, to),
            found => found,
        }
    }
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

    /// Catches a search without end: a gap that stays at the depth itself, with rounding, for a whole step.
    #[test]
    fn a_body_that_glides_at_the_depth_is_passed() {
        let mut looks = 0;
        let at = |t: f64| GapAt {
            t,
            gap: -DEPTH * (1.0 + 1e-3 * (1e7 * t).sin()),
            rate: 1e-16 * (1e7 * t).cos(),
        };
        let found = first_touch(at(0.0), at(1.0), 100.0, &mut |t| {
            looks += 1;
            Some(at(t))
        });
        assert!(found.is_none() && looks < 20_000, "{found:?}, {looks}");
    }
}
