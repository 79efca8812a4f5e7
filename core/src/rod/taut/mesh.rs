//! The mesh of a taut rod: fine in the layers at its ends.

use super::interval::STAGES;
use crate::rod::scaled_law::SAME_BREAK;

/// Extra length of the layers, in e-foldings, beyond the decay to the tolerance.
const BEYOND: f64 = 3.0;
/// Safety factor on the first intervals: the error estimate is cautious, and a second mesh costs more.
const SAFETY: f64 = 0.7;
/// Longest interval between the layers.
const LONGEST: f64 = 0.5;
/// Longest first step in a layer, times lam.
const FIRST: f64 = 4.0;

/// Order of the local error.
const ORDER: f64 = 2.0 * STAGES as f64 + 1.0;

/// Length of the first interval at an end, times lam.
pub(super) fn first_step(tolerance: f64) -> f64 {
    let falling = |n: usize| (1..=n).map(|k| (k as f64).ln()).sum::<f64>();
    let constant = 2.0 * falling(STAGES) - falling(2 * STAGES) - falling(2 * STAGES + 1);
    (SAFETY * ((tolerance.ln() - constant) / ORDER).exp()).min(FIRST)
}

/// Places of the nodes of a rod with lam = `lam` whose law is smooth between `breaks`. The local error of Gauss'
/// method, (s!)^2/((2s)! (2s+1)!) z^(2s+1) for exp(z x), z = lam h, is `tolerance` in the first interval at an end.
/// From there intervals grow as the layer's amplitude falls, up to `longest`.
pub(super) fn places(
    lam: f64,
    breaks: impl Iterator<Item = f64>,
    tolerance: f64,
    longest: f64,
) -> Vec<f64> {
    let (first, order) = (first_step(tolerance), ORDER);
    let (mut passed, mut layer) = (0.0, Vec::new());
    while passed < -tolerance.ln() + BEYOND && passed < 0.5 * lam {
        passed += first * (passed / order).exp();
        layer.push(passed / lam);
    }
    // Layers that meet share the rod equally.
    if let Some(last) = layer.last().copied()
        && last > 0.5
    {
        layer.iter_mut().for_each(|x| *x *= 0.5 / last);
    }
    let mut places: Vec<f64> = layer.iter().flat_map(|x| [*x, 1.0 - *x]).collect();
    let shortest = (0.02 * first / lam).min(1e-3);
    // A node that is near a break gives way to the break.
    let breaks: Vec<f64> = breaks.collect();
    places.retain(|x| breaks.iter().all(|at| (x - at).abs() >= shortest));
    places.extend([0.0, 1.0]);
    places.sort_by(f64::total_cmp);
    places.dedup_by(|later, earlier| *later - *earlier < shortest);
    places.extend(breaks);
    places.sort_by(f64::total_cmp);
    places.dedup_by(|later, earlier| *later - *earlier < SAME_BREAK);
    if let Some(last) = places.last_mut() {
        *last = 1.0;
    }
    let mut fine = vec![0.0];
    for pair in places.windows(2) {
        let pieces = ((pair[1] - pair[0]) / longest.min(LONGEST)).ceil().max(1.0);
        for k in 1..=pieces as usize {
            fine.push(pair[0] + (pair[1] - pair[0]) * k as f64 / pieces);
        }
    }
    fine
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Catches a safety factor on the bound itself: the longest first step is `FIRST`, and only shorter ones have the
    /// factor.
    #[test]
    fn the_bound_of_the_first_step_has_no_safety_factor() {
        assert_eq!(first_step(1e-4), FIRST);
        let ratio: f64 = first_step(1e-10) / first_step(1e-13);
        assert!((ratio - 1e3_f64.powf(1.0 / ORDER)).abs() < 1e-12, "{ratio}");
        assert!(first_step(1e-8) > SAFETY * FIRST, "{}", first_step(1e-8));
    }
}
