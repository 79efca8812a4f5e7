//! Waves between two states, by the concave or convex hull of the stress (Oleinik's condition; docs/bars.md 1).

use super::Material;
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

impl Material {
    /// The parts of the wave that changes the stretch `ahead` of it to the stretch `behind` it, the foremost first:
    /// the upper concave hull of the stress if the wave stretches, the lower convex hull if it shortens; chords are
    /// shocks, arcs fans.
    pub fn waves(&self, ahead: f64, behind: f64) -> Vec<Wave> {
        let arc = |from, to| Wave {
            kind: WaveKind::Fan,
            from,
            to,
            head: self.speed(from),
            tail: self.speed(to),
        };
        if ahead == behind || !(ahead.is_finite() && behind.is_finite()) {
            return Vec::new();
        }
        match self.simple(ahead, behind) {
            Some(WaveKind::Shock) => return vec![self.shock(ahead, behind)],
            Some(WaveKind::Fan) => return vec![arc(ahead, behind)],
            None => {}
        }
        let mut waves = Vec::new();
        let mut at = ahead;
        for (from, to) in self.chords(ahead, behind) {
            if at != from {
                waves.push(arc(at, from));
            }
            waves.push(self.shock(from, to));
            at = to;
        }
        if at != behind {
            waves.push(arc(at, behind));
        }
        waves
    }

    /// The kind of a wave without an inflection of the stress inside; None for any other wave.
    fn simple(&self, ahead: f64, behind: f64) -> Option<WaveKind> {
        let (low, high) = (ahead.min(behind), ahead.max(behind));
        let next = self.inflections().partition_point(|lam| *lam <= low);
        if self.inflections().get(next).is_some_and(|lam| *lam < high) {
            return None;
        }
        let bend = self.jet(0.5 * (low + high))[3] * (behind - ahead);
        Some(if bend > 0.0 {
            WaveKind::Shock
        } else {
            WaveKind::Fan
        })
    }

    fn shock(&self, from: f64, to: f64) -> Wave {
        let speed = self.chord_speed(from, to);
        Wave {
            kind: WaveKind::Shock,
            from,
            to,
            head: speed,
            tail: speed,
        }
    }

    /// The speed of a shock, density s^2 = \[sigma\]/\[lam\]; the speed of waves if the states are equal.
    pub fn chord_speed(&self, from: f64, to: f64) -> f64 {
        let rise = self.stress(to) - self.stress(from);
        // Below this the difference of the stresses loses more digits than the curvature of the law contributes.
        if (to - from).abs() < 1e-8 * from {
            return self.speed(0.5 * (from + to));
        }
        (rise / (to - from) / self.density()).sqrt()
    }

    /// Energy that a shock dissipates per area and time: its speed times the area between the stress and its chord.
    /// Negative for an inadmissible jump.
    pub fn dissipation(&self, ahead: f64, behind: f64) -> f64 {
        let [w0, s0, ..] = self.jet(ahead);
        let [w1, s1, ..] = self.jet(behind);
        self.chord_speed(ahead, behind) * (w0 - w1 - 0.5 * (s0 + s1) * (ahead - behind))
    }

    /// Change of the velocity by the wave from `ahead` to `behind`, positive for a stretching wave, and its
    /// derivative by `behind`. A wave towards -X adds the change, one towards +X subtracts it.
    pub fn velocity_jump(&self, ahead: f64, behind: f64) -> (f64, f64) {
        let jump = |from: f64, to: f64| {
            let speed = self.chord_speed(from, to);
            let slope = self.jet(to)[2] / self.density();
            (speed * (to - from), 0.5 * (speed + slope / speed))
        };
        let fan = |from: f64, to: f64| (self.phi(from, to), self.speed(to));
        match self.simple(ahead, behind) {
            _ if ahead == behind => (0.0, self.speed(ahead)),
            Some(WaveKind::Shock) => jump(ahead, behind),
            Some(WaveKind::Fan) => fan(ahead, behind),
            None => {
                let mut sum = (0.0, self.speed(behind));
                for wave in self.waves(ahead, behind) {
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
    fn chords(&self, ahead: f64, behind: f64) -> Vec<(f64, f64)> {
        let side = (behind - ahead).signum();
        let at = |y: f64| {
            let [_, sigma, slope, _] = self.jet(side * y);
            (side * sigma, slope)
        };
        let (low, high) = (side * ahead, side * behind);
        let mut ends: Vec<f64> = (self.inflections().iter())
            .map(|lam| side * lam)
            .filter(|y| low < *y && *y < high)
            .collect();
        if side < 0.0 {
            ends.reverse();
        }
        let ends = [&[low][..], &ends, &[high]].concat();
        let pieces: Vec<(f64, f64)> = ends.windows(2).map(|p| (p[0], p[1])).collect();
        let concave: Vec<(f64, f64)> = (pieces.iter().copied())
            .filter(|(a, b)| side * self.jet(side * 0.5 * (a + b))[3] <= 0.0)
            .collect();
        let mut points: Vec<f64> = (pieces.iter())
            .flat_map(|(a, b)| (0..SAMPLES).map(move |i| a + (b - a) * i as f64 / SAMPLES as f64))
            .collect();
        points.push(high);

        // The hull of the samples, as indices into the list.
        let mut hull: Vec<usize> = Vec::new();
        for i in 0..points.len() {
            while let [.., p, q] = hull[..] {
                let slope = |a: usize, b: usize| {
                    (at(points[b]).0 - at(points[a]).0) / (points[b] - points[a])
                };
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
                    p = touching(|y| gap(y, q), a, b);
                }
                if let Some(&(a, b)) = right {
                    q = touching(|y| -gap(y, p), a, b);
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
}

/// Zero of the falling function `gap` between a and b; if `gap` has one sign, the end towards which it points.
fn touching(gap: impl Fn(f64) -> f64, a: f64, b: f64) -> f64 {
    let (at_a, at_b) = (gap(a), gap(b));
    if !(at_a > 0.0) {
        return a;
    }
    if !(at_b < 0.0) {
        return b;
    }
    chandrupatla(gap, (a, at_a), (b, at_b), 0.0).unwrap_or(a)
}
