//! Profiles over equal cells: slopes without overshoot, and steep passages.

/// The central slope, limited to `steep` times the lesser of both. With 2 it keeps the bounds of the neighbours (van
/// Leer's monotonized central limiter), with 1 it is the lesser of them.
#[inline]
pub fn limited(steep: f64, a: f64, b: f64) -> f64 {
    let size = (steep * a.abs())
        .min(steep * b.abs())
        .min(0.5 * (a + b).abs());
    if a * b > 0.0 { size.copysign(a) } else { 0.0 }
}

/// A steep monotone passage between two cells whose neighbourhoods are flat.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Passage {
    /// The cell before.
    pub from: usize,
    /// The cell after.
    pub to: usize,
}

/// Largest number of cells over which a scheme spreads either half of a shock beside its steepest face.
const SPREAD: usize = 6;
/// Jumps down to this fraction of the steepest belong to the passage.
const FOOT: f64 = 0.12;
/// Least part of the passage's rise on its steepest face.
const STEEP: f64 = 0.2;

/// The steep passages of a profile that rise by `faint` or more, in order.
pub fn passages(values: &[f64], faint: f64) -> Vec<Passage> {
    let n = values.len();
    let jump = |i: usize| values[i + 1] - values[i];
    let mut found = Vec::new();
    let mut i = 0;
    while i + 1 < n {
        let steepest = jump(i).abs();
        let near = i.saturating_sub(SPREAD)..(i + SPREAD + 1).min(n - 1);
        if !(steepest > 0.2 * faint) || near.clone().any(|k| jump(k).abs() > steepest) {
            i += 1;
            continue;
        }
        let belongs = |k: usize| jump(k) * jump(i) > 0.0 && jump(k).abs() > FOOT * steepest;
        let (mut a, mut b) = (i, i + 1);
        while a > 0 && i - a < SPREAD && belongs(a - 1) {
            a -= 1;
        }
        while b + 1 < n && b - i < SPREAD + 1 && belongs(b) {
            b += 1;
        }
        let spread = (a > 0 && belongs(a - 1)) || (b + 1 < n && belongs(b));
        // Extends the passage by up to three flat cells on either side.
        for _ in 0..3 {
            let flat = |k: usize| jump(k).abs() <= FOOT * steepest;
            a -= usize::from(a > 0 && flat(a - 1));
            b += usize::from(b + 1 < n && flat(b));
        }
        let rise = (values[b] - values[a]).abs();
        if !spread && rise >= faint && steepest >= STEEP * rise {
            found.push(Passage { from: a, to: b });
        }
        i = b;
    }
    found
}
