//! Where an axis carries marks, and what is written at them.

use super::text;
use std::f64::consts::PI;

/// A mark on an axis; minor marks carry no label.
#[derive(Debug, Clone, PartialEq)]
pub(crate) struct Tick {
    pub value: f64,
    pub label: Option<String>,
}

/// Round numbers (1, 2, 2.5 or 5 times a power of ten) in [lo, hi], about `wanted` of them.
pub(crate) fn linear(lo: f64, hi: f64, wanted: usize) -> Vec<Tick> {
    let span = hi - lo;
    if !(span > 0.0 && span.is_finite()) {
        return Vec::new();
    }
    let raw = span / wanted.max(1) as f64;
    let power = raw.log10().floor();
    let base = 10f64.powf(power);
    let (factor, extra) = [(1.0, 0), (2.0, 0), (2.5, 1), (5.0, 0), (10.0, -1)]
        .into_iter()
        .find(|(factor, _)| factor * base >= 0.999 * raw)
        .unwrap_or((10.0, -1));
    let step = factor * base;
    if !(step.is_finite() && step > 0.0) {
        return Vec::new();
    }
    let decimals = (-(power as i64) + i64::from(extra)).clamp(0, 12) as usize;
    let written_out = lo.abs().max(hi.abs()) < 1e5 && step > 1e-5;
    let first = (lo / step - 1e-9).ceil();
    let count = ((hi / step + 1e-9).floor() - first).max(-1.0) as i64;
    (0..=count.min(100))
        .map(|i| {
            let value = (first + i as f64) * step;
            let label = if written_out {
                text::fixed(value, decimals)
            } else {
                // The nearest short decimal, so that 3 * 0.1 is not 0.30000000000000004.
                text::scientific(format!("{value:.5e}").parse().unwrap_or(value))
            };
            Tick {
                value,
                label: Some(label),
            }
        })
        .collect()
}

/// Powers of ten in [lo, hi], at most `wanted` of them labelled, with minor marks at 2..9 where
/// every power is labelled; under two decades 2 and 5 are labelled too, and under half a
/// decade all, for there may be none of those.
pub(crate) fn log(lo: f64, hi: f64, wanted: usize) -> Vec<Tick> {
    if !(lo > 0.0 && hi > lo && hi.is_finite()) {
        return Vec::new();
    }
    let first = lo.log10().floor() as i32;
    let last = hi.log10().ceil() as i32;
    let decades = (last - first).max(1);
    let stride = (decades as usize).div_ceil(wanted.max(1)).max(1) as i32;
    let mut ticks = Vec::new();
    for n in first..=last {
        let power = 10f64.powi(n);
        if n.rem_euclid(stride) == 0 {
            push(&mut ticks, power, Some(text::power_of_ten(n)), lo, hi);
        } else {
            push(&mut ticks, power, None, lo, hi);
        }
        if stride > 1 {
            continue;
        }
        for digit in 2..10 {
            let label = (decades <= 2 && (digit == 2 || digit == 5 || hi / lo < 3.0)).then(|| {
                if (-2..=3).contains(&n) {
                    text::fixed(f64::from(digit) * power, (-n).max(0) as usize)
                } else {
                    format!("{digit}·10{}", text::superscript(n))
                }
            });
            push(&mut ticks, f64::from(digit) * power, label, lo, hi);
        }
    }
    ticks
}

fn push(ticks: &mut Vec<Tick>, value: f64, label: Option<String>, lo: f64, hi: f64) {
    if value >= lo * (1.0 - 1e-9) && value <= hi * (1.0 + 1e-9) {
        ticks.push(Tick { value, label });
    }
}

/// Ticks at the multiples of pi, or at every second, third, ... to have at most seven.
pub(crate) fn angles(lo: f64, hi: f64) -> Vec<Tick> {
    let (first, last) = (
        (lo / PI - 1e-9).ceil() as i64,
        (hi / PI + 1e-9).floor() as i64,
    );
    // Not for a small part of a turn, nor for very many (or a range without bounds).
    if first >= last || hi - lo > 100.0 * PI || !(hi - lo).is_finite() {
        return linear(lo, hi, 5);
    }
    let step = (last - first) / 7 + 1;
    (first..=last)
        .filter(|n| n % step == 0)
        .map(|n| Tick {
            value: PI * n as f64,
            label: Some(match n {
                0 => "0".into(),
                1 => "π".into(),
                -1 => "−π".into(),
                _ => format!("{n}π").replace('-', "−"),
            }),
        })
        .collect()
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
