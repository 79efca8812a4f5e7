//! Location of events inside a step, to the accuracy of the integration: the step is taken again with other lengths.

use snaprod_systems::solve::cost::Cost;
use snaprod_systems::solve::gauss::Reversible;
use snaprod_systems::solve::lobatto::Slopes;
use snaprod_systems::solve::roots::chandrupatla;
use snaprod_systems::solve::stepper::{AcceptedStep, StepInterpolant};

/// Most corrections of an event by redoing the step; three reach rounding from the interpolant.
const CORRECTIONS: usize = 40;
/// Relative size of a correction, as a part of the step, below which one without progress is rounding.
const ROUNDING: f64 = 1e-8;
/// Fraction of the end values of t': if t' at a stage falls below it, the inside of the step is searched.
const SUSPICIOUS: f64 = 0.1;
/// Halvings that locate a sudden change: to 1e-11 of a step.
const HALVINGS: usize = 36;
/// Distance from an end of a step, as a fraction, at which the slope towards an adjacent minimum is tested.
const EDGE: f64 = 1.0 / 4096.0;
/// Golden sections in the search for a minimum.
const SECTIONS: usize = 24;
/// Samples of a suspicious step.
const SAMPLES: usize = 12;

/// A state with time among its variables.
pub trait Timed: Reversible {
    /// Time t of a state, or t' of a slope.
    fn time(&self) -> f64;
}

/// Approximate location of an event in a step, with the rate of its event function by h.
#[derive(Clone, Copy)]
pub struct Guess {
    /// Length of the step that ends at the event.
    pub h: f64,
    /// Derivative of the event function by h.
    pub rate: f64,
    /// Time of the event.
    pub t: f64,
}

/// An event found.
pub struct Located<S> {
    /// The step that ends at the event.
    pub step: AcceptedStep<S>,
    /// Change of the event's time in the last correction.
    pub time_error: f64,
}

/// Largest time error in a symmetric step, as a part of the step, that a linear correction may remove.
const OFF: f64 = 1e-6;

/// The state at the time `t` within a step. Explicit and collocation steps are interpolated; the interpolant is kept
/// in `dense`. A symmetric step is taken again to `t`, and its slope corrects the last digits of time.
pub fn at_time<S: Timed>(
    step: &mut AcceptedStep<S>,
    dense: &mut Option<StepInterpolant<S>>,
    f: &mut impl Slopes<S>,
    t: f64,
    cost: &mut Cost,
) -> Option<S> {
    let (from, to) = (step.from().time(), step.to().time());
    if t == to {
        return Some(step.to().clone());
    }
    if t == from {
        return Some(step.from().clone());
    }
    if !(from < t && t < to) {
        return None;
    }
    if dense.is_none() {
        *dense = step.interpolant(f, cost);
    }
    let dense = dense.as_ref()?;
    let x = chandrupatla(
        |x| dense.at(x).time() - t,
        (0.0, from - t),
        (1.0, to - t),
        0.0,
    )?;
    if !matches!(step, AcceptedStep::Symmetric(_)) {
        return Some(dense.at(x));
    }
    cost.samples += 1;
    let mut h = x * step.h();
    loop {
        let there = step.redo(f, h, cost)?;
        let missing = (t - there.to().time()) / there.end_slope().time();
        if missing.abs() <= OFF * step.h() {
            let mut state = there.to().clone();
            state.axpy(missing, there.end_slope());
            return Some(state);
        }
        let next = h + missing;
        if !(0.0 < next && next < step.h() && missing.abs() < 0.1 * step.h()) {
            return None;
        }
        h = next;
    }
}

/// The first zero of t' inside a step: detected at the stages, confirmed on the interpolant. None if there is none.
pub fn first_fold<S: Timed>(
    step: &mut AcceptedStep<S>,
    f: &mut impl Slopes<S>,
    cost: &mut Cost,
) -> Option<Guess> {
    let ends = step.start_slope().time().min(step.end_slope().time());
    let rates = step.stage_slopes().iter().map(Timed::time);
    let least = rates.fold(f64::INFINITY, f64::min);
    if ends > 0.0 && least > SUSPICIOUS * ends {
        return None;
    }
    let h = step.h();
    let (start, end) = (step.start_slope().time(), step.end_slope().time());
    let dense = step.interpolant(f, cost)?;
    let mut rate_at = |x: f64| {
        cost.evaluations += 1;
        f.slope(&dense.at(x)).map_or(f64::NAN, |slope| slope.time())
    };
    let mut before = (0.0, start);
    for i in 1..=SAMPLES {
        let x = i as f64 / SAMPLES as f64;
        let after = (x, if i == SAMPLES { end } else { rate_at(x) });
        // A start at a fold has t' = 0: only a change from positive counts.
        if before.1 > 0.0 && after.1 <= 0.0 {
            let rate = (after.1 - before.1) / ((after.0 - before.0) * h);
            let x = chandrupatla(rate_at, before, after, 1e-9)?;
            return Some(Guess {
                h: x * h,
                rate,
                t: dense.at(x).time(),
            });
        }
        before = after;
    }
    None
}

/// Fractions of a step at which rods are looked at.
const LOOKS: [f64; 5] = [0.2, 0.4, 0.6, 0.8, 0.9];

/// The first of [`LOOKS`] at which `look` sees something inside a step, with what is seen. The outer None: the step has
/// no interpolant.
pub fn seen_inside<S: Timed, T>(
    step: &mut AcceptedStep<S>,
    f: &mut impl Slopes<S>,
    look: impl Fn(&S) -> Option<T>,
    cost: &mut Cost,
) -> Option<Option<(f64, T)>> {
    let dense = step.interpolant(f, cost)?;
    Some(
        LOOKS
            .into_iter()
            .find_map(|x| Some((x, look(&dense.at(x))?))),
    )
}

/// The step shortened to the zero of `gap`, which has the value `last` at the fraction `part`.
pub fn end_at_zero<S: Timed>(
    step: &mut AcceptedStep<S>,
    f: &mut impl Slopes<S>,
    (part, last): (f64, f64),
    gap: impl Fn(&S) -> f64,
    cost: &mut Cost,
) -> Option<AcceptedStep<S>> {
    let h = part * step.h();
    let first = gap(step.from());
    let guess = Guess {
        h: h * first / (first - last),
        rate: (last - first) / h,
        t: step.from().time(),
    };
    locate(step, f, guess, |state, _| gap(state), cost).map(|found| found.step)
}

/// The first fraction of a step at which `room` is not positive, to rounding. The search samples at `places` equal
/// intervals and at the minima between them. None if `room` is not positive at the start, or positive all along.
pub fn first_change<S>(
    inside: impl Fn(f64) -> S,
    places: u32,
    room: impl Fn(&S) -> f64,
) -> Option<f64> {
    let place = |k: usize| k as f64 / f64::from(places);
    let gone = |room: f64| !(room > 0.0);
    let at = |x: f64| room(&inside(x));
    let rooms: Vec<f64> = (0..=places as usize).map(|k| at(place(k))).collect();
    if gone(rooms[0]) {
        return None;
    }
    // A minimum lies between two samples if `room` falls inwards at an end, or from both sides.
    let last = rooms.len() - 1;
    let falls = |k: usize| match k {
        0 => at(EDGE) < rooms[0],
        k if k == last => at(1.0 - EDGE) < rooms[k],
        k => rooms[k] < rooms[k - 1] && rooms[k] <= rooms[k + 1],
    };
    let (mut low, mut high) = (0..=last).find_map(|k| {
        let before = place(k.saturating_sub(1));
        if gone(rooms[k]) {
            return Some((before, place(k)));
        }
        let lowest = falls(k).then(|| lowest(at, before, place((k + 1).min(last))));
        Some((before, lowest.flatten()?))
    })?;
    for _ in 0..HALVINGS {
        let middle = 0.5 * (low + high);
        if gone(at(middle)) {
            high = middle
        } else {
            low = middle
        }
    }
    Some(high)
}

/// A fraction between two at which `room` is not positive, found by golden sections towards its minimum; None
/// if the minimum is positive.
fn lowest(room: impl Fn(f64) -> f64, mut from: f64, mut to: f64) -> Option<f64> {
    for _ in 0..SECTIONS {
        let part = 0.5 * (3.0 - 5f64.sqrt()) * (to - from);
        let (left, right) = (from + part, to - part);
        let rooms = [left, right].map(&room);
        for (x, room) in [left, right].into_iter().zip(rooms) {
            if !(room > 0.0) {
                return Some(x);
            }
        }
        if rooms[0] < rooms[1] {
            to = right
        } else {
            from = left
        }
    }
    None
}

/// The step shortened to `fraction` of its length; None if the shorter step fails or takes no time.
pub fn shorten_step<S: Timed>(
    step: &AcceptedStep<S>,
    f: &mut impl Slopes<S>,
    fraction: f64,
    cost: &mut Cost,
) -> Option<AcceptedStep<S>> {
    let part = step.redo(f, fraction * step.h(), cost)?;
    (part.to().time() > step.from().time()).then_some(part)
}

/// Redoes the step with other lengths until the event function, of state and slope, vanishes at its end. The
/// event then has the accuracy of the integration, not of an interpolant. Secants, and halving where they
/// fail: t may grow like h^2 from a fold.
pub fn locate<S: Timed>(
    step: &AcceptedStep<S>,
    f: &mut impl Slopes<S>,
    guess: Guess,
    event: impl Fn(&S, &S) -> f64,
    cost: &mut Cost,
) -> Option<Located<S>> {
    let Guess {
        mut h,
        mut rate,
        t: mut time,
    } = guess;
    let (mut low, mut high) = (0.0, step.h());
    let mut previous: Option<(f64, f64)> = None;
    let mut best: Option<(f64, Located<S>)> = None;
    for _ in 0..CORRECTIONS {
        let Some(redone) = step.redo(f, h, cost) else {
            // Behind the event the right-hand side may not be defined or smooth, as at a pulse that begins
            // there. Step back by half from the last length before the event; if the last step also ended
            // behind it, go back as far again.
            let middle = 0.5 * (low + h);
            high = h;
            h = match previous {
                Some((h0, _)) if h0 > h => (2.0 * h - h0).max(middle),
                Some((h0, _)) => 0.5 * (h0 + h),
                None => middle,
            };
            continue;
        };
        let g = event(redone.to(), redone.end_slope());
        let moved = previous.map_or(f64::INFINITY, |(h0, _)| (h - h0).abs());
        if let Some((h0, g0)) = previous
            && h != h0
            && g != g0
        {
            rate = (g - g0) / (h - h0);
        }
        let t = redone.to().time();
        let time_error = (t - time).abs() + f64::EPSILON * t.abs();
        time = t;
        let better = best.as_ref().is_none_or(|(size, _)| g.abs() <= *size);
        if better {
            best = Some((
                g.abs(),
                Located {
                    step: redone,
                    time_error,
                },
            ));
        }
        let correction = -g / rate;
        if correction.abs() <= 4.0 * f64::EPSILON * h || !better && moved <= ROUNDING * h {
            break;
        }
        if g * guess.rate < 0.0 {
            low = h;
        } else {
            high = h;
        }
        previous = Some((h, g));
        let secant = h + correction;
        h = if better && low < secant && secant < high {
            secant
        } else {
            0.5 * (low + high)
        };
    }
    best.map(|(_, located)| located)
}
