//! Events inside of a step of rods with mass: a zero of a function of the state, the first contact of rods.

use nalgebra::DVector;
use snaprod_systems::assembly::{Contact, Nearness};

/// Fractions of a step at which contacts inside the step are tested.
const INSIDE: [f64; 3] = [0.25, 0.5, 0.75];
/// Most rounds of the search for an event.
const ROUNDS: usize = 60;
/// Tolerance of the search in time, relative to the duration of the run.
const CLOSE: f64 = 1e-13;

/// A step of a run of rods with a contact diameter.
pub(super) trait RodsInStep {
    /// State at the fraction `part` of the step; None if there is none.
    fn inside(&mut self, part: f64) -> Option<DVector<f64>>;

    /// Distances of the rods with a contact diameter in a state; None without a shape.
    fn nearness(&self, y: &DVector<f64>) -> Option<Nearness>;

    /// The contact next to `near` in a state; None if it is lost.
    fn contact_near(&self, y: &DVector<f64>, near: &Contact) -> Option<Contact>;

    /// Length of the step over the duration of the run.
    fn relative_span(&self) -> f64;
}

/// First contact in a step, with the fraction of the step at which its gap is 0, or at which the contact is first seen
/// where no zero is found. `Some(None)`: nothing touches. None: a state inside the step has no shape. Of the distances,
/// `before` and `after` are those at the ends of the step.
pub(super) fn first_contact<S: RodsInStep>(
    step: &mut S,
    before: &Nearness,
    after: &Nearness,
) -> Option<Option<(Contact, f64)>> {
    let touches = |near: &Nearness| near.contact.filter(|contact| contact.gap <= 0.0);
    let mut found = touches(after).map(|contact| (contact, 1.0));
    // Within a step the gap falls below its end values by at most the distance moved by the rods.
    if before.least_gap().min(after.least_gap()) < before.moved(after) {
        for part in INSIDE {
            let y = step.inside(part)?;
            if let Some(contact) = step.nearness(&y).as_ref().and_then(touches) {
                found = Some((contact, part));
                break;
            }
        }
    }
    let Some((contact, part)) = found else {
        return Some(None);
    };
    let gap = |step: &S, y: &DVector<f64>| {
        let there = step.contact_near(y, &contact);
        Some(there.map_or(1.0, |contact| contact.gap))
    };
    // Rods that fold onto each other touch along a line: the pair that is nearest jumps, and its gap has no zero.
    let part = crossing(step, part, 0.0, &gap).unwrap_or(part);
    Some(Some((contact, part)))
}

/// The fraction of the step at which `function` takes on the sign that it has at `part`. None unless the function
/// starts with the other sign, or within `rounding` of 0.
pub(super) fn crossing<S: RodsInStep>(
    step: &mut S,
    part: f64,
    rounding: f64,
    function: &dyn Fn(&S, &DVector<f64>) -> Option<f64>,
) -> Option<f64> {
    let (mut low, mut high) = (0.0, part);
    let from = step.inside(0.0)?;
    let mut at_low = function(step, &from)?;
    let to = step.inside(part)?;
    let mut at_high = function(step, &to)?;
    if !(at_low * at_high <= 0.0) {
        if !(at_low.abs() <= rounding) {
            return None;
        }
        at_low = 0.0;
    }
    // Secant method, with the value halved on the side that stays (Illinois).
    for _ in 0..ROUNDS {
        if (high - low) * step.relative_span() <= CLOSE || at_high == 0.0 {
            break;
        }
        let x = (low * at_high - high * at_low) / (at_high - at_low);
        let x = x.clamp(low + 0.01 * (high - low), high - 0.01 * (high - low));
        let there = step.inside(x)?;
        let value = function(step, &there)?;
        if value * at_high < 0.0 {
            (low, at_low) = (x, value);
            at_high *= 0.5;
        } else {
            (high, at_high) = (x, value);
            at_low *= 0.5;
        }
    }
    Some(high)
}
