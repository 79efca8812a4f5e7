//! Waves between two states, by the concave or convex hull of the stress (Oleinik's condition; docs/bars.md 1).

use super::Law1d;
use snaprod_core::solve::roots::chandrupatla;

/// Kind of a part of a wave.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum WaveKind {
    /// A jump.
    Shock,
    /// A smooth spreading part, a rarefaction.
    Fan,
}

/// A part of a wave, with speeds over the material, positive in either direction.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Wave {
    /// Shock or fan.
    pub kind: WaveKind,
    /// The stretch ahead.
    pub from: f64,
    /// The stretch behind.
    pub to: f64,
    /// Speed of the front.
    pub head: f64,
    /// Speed of the end; equal to that of the front for a shock.
    pub tail: f64,
}

/// Samples in each interval between inflections, from which the order of chords and arcs is found.
const SAMPLES: usize = 12;

/// See [`Law1d::waves`].
pub(super) fn waves<L: Law1d + ?Sized>(law: &L, ahead: f64, behind: f64) -> Vec<Wave> {
    if ahead == behind || !(ahead.is_finite() && behind.is_finite()) {
        return Vec::new();
    }
    match simple(law, ahead, behind) {
        Some(WaveKind::Shock) => return vec![shock(law, ahead, behind)],
        Some(WaveKind::Fan) => return fans(law, ahead, behind),
        None => {}
    }
    let mut waves = Vec::new();
    let mut at = ahead;
    for (from, to) in chords(law, ahead, behind) {
        waves.extend(fans(law, at, from));
        waves.push(shock(law, from, to));
        at = to;
    }
    waves.extend(fans(law, at, behind));
    waves
}

/// The fans from one stretch to another. A jump of the slope of the stress parts them: the speed jumps there, and the
/// stretch of the jump stands between two fans.
fn fans<L: Law1d + ?Sized>(law: &L, from: f64, to: f64) -> Vec<Wave> {
    let (low, high) = (from.min(to), from.max(to));
    let inner = law.bends().iter().copied();
    let mut stops: Vec<f64> = inner.filter(|lam| low < *lam && *lam < high).collect();
    if to < from {
        stops.reverse();
    }
    stops.push(to);
    let mut waves = Vec::new();
    let mut at = from;
    for stop in stops {
        if stop != at {
            waves.push(Wave {
                kind: WaveKind::Fan,
                from: at,
                to: stop,
                head: law.speed(beside(law, at, stop)),
                tail: law.speed(beside(law, stop, at)),
            });
        }
        at = stop;
    }
    waves
}

/// The stretch `at`; of a bend the next stretch towards `to`, since the slope of the stress may jump at the bend.
fn beside<L: Law1d + ?Sized>(law: &L, at: f64, to: f64) -> f64 {
    if law.bends().contains(&at.abs()) {
        at + (4.0 * f64::EPSILON * at).abs().copysign(to - at)
    } else {
        at
    }
}

/// The kind of a wave without an inflection of the stress inside; None for any other wave.
fn simple<L: Law1d + ?Sized>(law: &L, ahead: f64, behind: f64) -> Option<WaveKind> {
    let (low, high) = (ahead.min(behind), ahead.max(behind));
    let next = law.bends().partition_point(|lam| *lam <= low);
    if law.bends().get(next).is_some_and(|lam| *lam < high) {
        return None;
    }
    let bend = law.jet(0.5 * (low + high))[3] * (behind - ahead);
    Some(if bend > 0.0 {
        WaveKind::Shock
    } else {
        WaveKind::Fan
    })
}

fn shock<L: Law1d + ?Sized>(law: &L, from: f64, to: f64) -> Wave {
    let speed = law.chord_speed(from, to);
    Wave {
        kind: WaveKind::Shock,
        from,
        to,
        head: speed,
        tail: speed,
    }
}

/// See [`Law1d::velocity_jump`].
pub(super) fn velocity_jump<L: Law1d + ?Sized>(law: &L, ahead: f64, behind: f64) -> (f64, f64) {
    let jump = |from: f64, to: f64| {
        let speed = law.chord_speed(from, to);
        let slope = law.jet(to)[2] / law.density();
        (speed * (to - from), 0.5 * (speed + slope / speed))
    };
    let fan = |from: f64, to: f64| (law.phi(from, to), law.speed(to));
    match simple(law, ahead, behind) {
        _ if ahead == behind => (0.0, law.speed(ahead)),
        Some(WaveKind::Shock) => jump(ahead, behind),
        Some(WaveKind::Fan) => fan(ahead, behind),
        None => {
            let mut sum = (0.0, law.speed(behind));
            for wave in law.waves(ahead, behind) {
                let (rise, slope) = match wave.kind {
                    WaveKind::Shock => jump(wave.from, wave.to),
                    WaveKind::Fan => fan(wave.from, wave.to),
                };
                sum = (sum.0 + rise, slope);
            }
            sum
        }
    }
}

/// The chords of the hull from `ahead` to `behind`, (from, to) in this order.
///
/// A lower convex hull becomes an upper concave one if lam and sigma both change sign.
fn chords<L: Law1d + ?Sized>(law: &L, ahead: f64, behind: f64) -> Vec<(f64, f64)> {
    let side = (behind - ahead).signum();
    let at = |y: f64| {
        let [_, sigma, slope, _] = law.jet(side * y);
        (side * sigma, slope)
    };
    let (low, high) = (side * ahead, side * behind);
    let mut ends: Vec<f64> = (law.bends().iter())
        .map(|lam| side * lam)
        .filter(|y| low < *y && *y < high)
        .collect();
    if side < 0.0 {
        ends.reverse();
    }
    let ends = [&[low][..], &ends, &[high]].concat();
    let pieces: Vec<(f64, f64)> = ends.windows(2).map(|p| (p[0], p[1])).collect();
    let concave: Vec<(f64, f64)> = (pieces.iter().copied())
        .filter(|(a, b)| side * law.jet(side * 0.5 * (a + b))[3] <= 0.0)
        .collect();
    let mut points: Vec<f64> = (pieces.iter())
        .flat_map(|(a, b)| (0..SAMPLES).map(move |i| a + (b - a) * i as f64 / SAMPLES as f64))
        .collect();
    points.push(high);

    // The hull of the samples, as indices into the list.
    let mut hull: Vec<usize> = Vec::new();
    for i in 0..points.len() {
        while let [.., p, q] = hull[..] {
            let slope =
                |a: usize, b: usize| (at(points[b]).0 - at(points[a]).0) / (points[b] - points[a]);
            if slope(p, q) > slope(q, i) {
                break;
            }
            hull.pop();
        }
        hull.push(i);
    }

    let mut chords: Vec<(f64, f64)> = Vec::new();
    for edge in hull.windows(2) {
        let (mut p, mut q) = (points[edge[0]], points[edge[1]]);
        if concave.iter().any(|(a, b)| *a <= p && q <= *b) {
            continue;
        }
        // Arcs on which the chord may end: a tangent to an arc touches at a single point.
        let left = concave.iter().find(|(a, b)| *a <= p && p <= *b);
        let right = concave.iter().rfind(|(a, b)| *a <= q && q <= *b);
        for _ in 0..50 {
            let before = (p, q);
            let gap = |y: f64, far: f64| {
                let ((here, slope), there) = (at(y), at(far).0);
                slope * (far - y) - (there - here)
            };
            if let Some(&(a, b)) = left {
                p = touching(law, |y| gap(y, q), a, b);
            }
            if let Some(&(a, b)) = right {
                q = touching(law, |y| -gap(y, p), a, b);
            }
            let moved = (p - before.0).abs().max((q - before.1).abs());
            if moved <= 4.0 * f64::EPSILON * high.abs().max(low.abs()) {
                break;
            }
        }
        chords.push((side * p, side * q));
    }
    chords
}

/// Zero of the falling function `gap` between a and b, with the slopes inside; if `gap` has one sign, the end towards
/// which it points.
fn touching<L: Law1d + ?Sized>(law: &L, gap: impl Fn(f64) -> f64, a: f64, b: f64) -> f64 {
    let (first, last) = (beside(law, a, b), beside(law, b, a));
    let (at_first, at_last) = (gap(first), gap(last));
    if !(at_first > 0.0) {
        return a;
    }
    if !(at_last < 0.0) {
        return b;
    }
    chandrupatla(gap, (first, at_first), (last, at_last), 0.0).unwrap_or(a)
}
