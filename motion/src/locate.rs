//! Events inside a step, found to the accuracy of the integration: the step is taken again with other lengths.

use snaprod_systems::solve::cost::Cost;
use snaprod_systems::solve::gauss::Reversible;
use snaprod_systems::solve::lobatto::Slopes;
use snaprod_systems::solve::roots::chandrupatla;
use snaprod_systems::solve::stepper::{Inside, Taken};

/// Most corrections of an event by redoing the step; three reach rounding from the interpolant.
const CORRECTIONS: usize = 40;
/// A correction below this part of the step that brings nothing is rounding.
const ROUNDING: f64 = 1e-8;
/// Look inside a step when t' at a stage falls below this fraction of its values at the ends.
const SUSPICIOUS: f64 = 0.1;
/// Halvings by which a moment is found at which something changes at once: to 1e-11 of a step.
const HALVINGS: usize = 36;
/// So far within an end of a step it is looked whether there is a low next to it.
const EDGE: f64 = 1.0 / 4096.0;
/// Golden sections on the way to a low.
const SECTIONS: usize = 24;
/// Samples of a suspicious step.
const SAMPLES: usize = 12;

/// A state that has time among its variables.
pub trait Timed: Reversible {
    /// Time; of a slope, t'.
    fn time(&self) -> f64;
}

/// Where in a step an event is thought to be, and how fast its function changes with h there.
#[derive(Clone, Copy)]
pub struct Guess {
    /// The length of the step that ends there.
    pub h: f64,
    /// Change of the event function by h.
    pub rate: f64,
    /// The time there.
    pub t: f64,
}

/// An event found.
pub struct Located<S> {
    /// The step that ends there.
    pub step: Taken<S>,
    /// Change of its time in the last correction.
    pub time_error: f64,
}

/// A state found in a symmetric step at a time that is farther off than this part of the step is sought again from there.
const OFF: f64 = 1e-6;

/// The state at a time within a step: from the interpolant of any but a symmetric one, which is kept in `dense`; from a symmetric one
/// by a step of its own, whose few last digits of time its slope makes good.
pub fn at_time<S: Timed>(
    step: &mut Taken<S>,
    dense: &mut Option<Inside<S>>,
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
        *dense = step.inside(f, cost);
    }
    let dense = dense.as_ref()?;
    let x = chandrupatla(
        |x| dense.at(x).time() - t,
        (0.0, from - t),
        (1.0, to - t),
        0.0,
    )?;
    if !matches!(step, Taken::Symmetric(_)) {
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

/// The first zero of t' inside a step, if there is one: seen at the stages, confirmed on the interpolant.
pub fn first_fold<S: Timed>(
    step: &mut Taken<S>,
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
    let dense = step.inside(f, cost)?;
    let mut rate_at = |x: f64| {
        cost.evaluations += 1;
        f.slope(&dense.at(x)).map_or(f64::NAN, |slope| slope.time())
    };
    let mut before = (0.0, start);
    for i in 1..=SAMPLES {
        let x = i as f64 / SAMPLES as f64;
        let after = (x, if i == SAMPLES { end } else { rate_at(x) });
        // A start at a fold has t' = 0 there: only a change from positive counts.
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

/// The first fraction of a step at which `room` of the states inside is gone, to rounding: it is looked for at so many places as far apart, and at the
/// lows between them. None if there is none at the start, or all along.
pub fn changes<S>(inside: impl Fn(f64) -> S, places: u32, room: impl Fn(&S) -> f64) -> Option<f64> {
    let place = |k: usize| k as f64 / f64::from(places);
    let gone = |room: f64| !(room > 0.0);
    let at = |x: f64| room(&inside(x));
    let rooms: Vec<f64> = (0..=places as usize).map(|k| at(place(k))).collect();
    if gone(rooms[0]) {
        return None;
    }
    // Where it falls inwards at either end, or from both sides, there is a low between.
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
        let lowest = falls(k).then(|| lowest(at, (before, place((k + 1).min(last)))));
        Some((before, lowest.flatten()?))
    })?;
    for _ in 0..HALVINGS {
        let middle = 0.5 * (low + high);
        match gone(at(middle)) {
            true => high = middle,
            false => low = middle,
        }
    }
    Some(high)
}

/// A place between two at which `room` is gone, on the way to its low there by golden sections.
fn lowest(room: impl Fn(f64) -> f64, (mut from, mut to): (f64, f64)) -> Option<f64> {
    for _ in 0..SECTIONS {
        let part = 0.5 * (3.0 - 5f64.sqrt()) * (to - from);
        let (left, right) = (from + part, to - part);
        let rooms = [left, right].map(&room);
        for (x, room) in [left, right].into_iter().zip(rooms) {
            if !(room > 0.0) {
                return Some(x);
            }
        }
        match rooms[0] < rooms[1] {
            true => to = right,
            false => from = left,
        }
    }
    None
}

/// The part of a step of so long a fraction; None if it cannot be taken, or is no part at all.
pub fn part<S: Timed>(
    step: &Taken<S>,
    f: &mut impl Slopes<S>,
    fraction: f64,
    cost: &mut Cost,
) -> Option<Taken<S>> {
    let part = step.redo(f, fraction * step.h(), cost)?;
    (part.to().time() > step.from().time()).then_some(part)
}

/// Redoes the step with other lengths until the event function, of state and slope, vanishes at its end: the event then has
/// the accuracy of the integration, not of an interpolant. Secants, and halving where they fail: t may grow like h^2 from a
/// fold.
pub fn locate<S: Timed>(
    step: &Taken<S>,
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
            // What lies behind the event, as a pulse that begins there, may be no way to follow: back half of the way that led
            // there from before it, or on as far again where the last step ended behind it, too.
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
