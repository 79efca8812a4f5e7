//! Positions and labels of the marks of an axis.

use super::text;
use std::f64::consts::PI;

/// A mark on an axis; minor marks carry no label.
#[derive(Debug, Clone, PartialEq)]
pub(crate) struct Tick {
    pub value: f64,
    pub label: Option<String>,
}

/// Round numbers (1, 2, 2.5 or 5 times a power of ten) in [lo, hi], about `wanted` of them. A single one,
/// which defines no scale, is avoided if there is room for more.
pub(crate) fn linear(lo: f64, hi: f64, wanted: usize) -> Vec<Tick> {
    let span = hi - lo;
    if !(span > 0.0 && span.is_finite()) {
        return Vec::new();
    }
    let raw = span / wanted.max(1) as f64;
    let power = raw.log10().floor();
    let base = 10f64.powf(power);
    let factors = [(0.5, 1), (1.0, 0), (2.0, 0), (2.5, 1), (5.0, 0), (10.0, -1)];
    let fits = |(factor, _): &(f64, i64)| *factor >= 1.0 && factor * base >= 0.999 * raw;
    let coarse = factors.iter().position(fits).unwrap_or(5);
    let (factor, extra) = if wanted > 1 && within(lo, hi, factors[coarse].0 * base).1 < 1 {
        factors[coarse - 1]
    } else {
        factors[coarse]
    };
    let step = factor * base;
    if !(step.is_finite() && step > 0.0) {
        return Vec::new();
    }
    let decimals = (extra - power as i64).clamp(0, 12) as usize;
    let written_out = lo.abs().max(hi.abs()) < 1e5 && step > 1e-5;
    let (first, count) = within(lo, hi, step);
    let tick = |i: i64| {
        let value = (first + i as f64) * step;
        let label = if written_out {
            text::fixed(value, decimals)
        } else {
            text::scientific(format!("{value:.5e}").parse().unwrap_or(value))
        };
        let label = Some(label);
        Tick { value, label }
    };
    (0..=count.min(100)).map(tick).collect()
}

/// The first multiple of a step in [lo, hi], and the number of further ones; -1: there is none.
fn within(lo: f64, hi: f64, step: f64) -> (f64, i64) {
    let first = (lo / step - 1e-9).ceil();
    let count = ((hi / step + 1e-9).floor() - first).max(-1.0) as i64;
    (first, count)
}

/// Powers of ten in [lo, hi], at most `wanted` of them labelled, with minor marks at 2..9 where every power
/// is labelled. Under two decades 2 and 5 are labelled too, and under half a decade all, since the range may
/// hold no power.
pub(crate) fn log(lo: f64, hi: f64, wanted: usize) -> Vec<Tick> {
    if !(lo > 0.0 && hi > lo && hi.is_finite()) {
        return Vec::new();
    }
    let first = lo.log10().floor() as i32;
    let last = hi.log10().ceil() as i32;
    let decades = (last - first).max(1);
    let stride = (decades as usize).div_ceil(wanted.max(1)).max(1) as i32;
    let mut ticks = Vec::new();
    let mut push = |value: f64, label: Option<String>| {
        if value >= lo * (1.0 - 1e-9) && value <= hi * (1.0 + 1e-9) {
            ticks.push(Tick { value, label });
        }
    };
    for n in first..=last {
        let power = 10f64.powi(n);
        push(
            power,
            (n.rem_euclid(stride) == 0).then(|| text::power_of_ten(n)),
        );
        for digit in (2..10).filter(|_| stride == 1) {
            let label = (decades <= 2 && (digit == 2 || digit == 5 || hi / lo < 3.0)).then(|| {
                if (-2..=3).contains(&n) {
                    text::fixed(f64::from(digit) * power, (-n).max(0) as usize)
                } else {
                    format!("{digit}·10{}", text::superscript(n))
                }
            });
            push(f64::from(digit) * power, label);
        }
    }
    ticks
}

/// Numbers of one digit, or with 5 as their second, near equal steps of the root from lo >= 0 to hi.
pub(crate) fn roots(lo: f64, hi: f64, wanted: usize) -> Vec<Tick> {
    let (from, to) = (lo.sqrt(), hi.sqrt());
    let round = |i: usize| {
        let value = (from + (to - from) * i as f64 / wanted as f64).powi(2);
        let unit = 10f64.powf(value.log10().floor());
        let steps = if value < 2.75 * unit { 2.0 } else { 1.0 };
        let value = if value > 0.0 {
            (steps * value / unit).round() / steps * unit
        } else {
            0.0
        };
        let label = Some(text::short(value, 3));
        Tick { value, label }
    };
    let mut ticks: Vec<Tick> = (0..=wanted).map(round).collect();
    ticks.dedup();
    let room = 1e-9 * (hi - lo);
    ticks.retain(|tick| (lo - room..=hi + room).contains(&tick.value));
    ticks
}

/// Ticks at the multiples of pi, or at every second, third, ... to have at most seven.
pub(crate) fn angles(lo: f64, hi: f64) -> Vec<Tick> {
    let (first, last) = (
        (lo / PI - 1e-9).ceil() as i64,
        (hi / PI + 1e-9).floor() as i64,
    );
    // Linear marks for a small part of a turn, and for very many turns (or a range without bounds).
    if first >= last || hi - lo > 100.0 * PI || !(hi - lo).is_finite() {
        return linear(lo, hi, 5);
    }
    let step = (last - first) / 7 + 1;
    let tick = |n: i64| Tick {
        value: PI * n as f64,
        label: Some(match n {
            0 => "0".into(),
            1 => "π".into(),
            -1 => "−π".into(),
            _ => format!("{n}π").replace('-', "−"),
        }),
    };
    (first..=last).filter(|n| n % step == 0).map(tick).collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    fn labels(ticks: &[Tick]) -> Vec<&str> {
        ticks.iter().filter_map(|t| t.label.as_deref()).collect()
    }

    #[test]
    fn linear_ticks_are_round() {
        assert_eq!(
            labels(&linear(-1.0, 1.0, 4)),
            ["−1.0", "−0.5", "0.0", "0.5", "1.0"]
        );
        assert_eq!(
            labels(&linear(0.0, 1.0, 4)),
            ["0.00", "0.25", "0.50", "0.75", "1.00"]
        );
        assert_eq!(labels(&linear(0.0, 40.0, 4)), ["0", "10", "20", "30", "40"]);
        // 0.5 alone is round by halves.
        assert_eq!(labels(&linear(0.1, 0.95, 2)), ["0.25", "0.50", "0.75"]);
        assert_eq!(labels(&linear(0.1, 0.95, 1)).len(), 0);
        assert!(linear(1.0, 1.0, 5).is_empty());
        assert!(linear(f64::NAN, 1.0, 5).is_empty());
    }

    #[test]
    fn log_ticks_are_powers() {
        assert_eq!(
            labels(&log(1e-9, 1e-1, 5)),
            ["10⁻⁸", "10⁻⁶", "10⁻⁴", "10⁻²"]
        );
        assert!(log(0.0, 1.0, 5).is_empty());
        assert_eq!(labels(&log(0.021, 0.045, 5)), ["0.03", "0.04"]);
    }
}
