//! Curves over time, thinned to the resolution of a drawing; fast oscillations become bands.

use super::axes::{Panel, extent};
use super::canvas::{Canvas, Pen};
use super::legend::{Key, PlottedCurve};
use super::page::WIDTH;

/// Number of turns in a panel above which a curve becomes a band: they are less than five pixels apart.
const TURNS: f64 = WIDTH / 5.0;
/// Least number of turns per step of a band: its edges and its mean come from several swings.
const IN_STEP: f64 = 6.0;
/// Most steps of a band.
const STEPS: f64 = WIDTH / 4.0;
/// Smallest swing, as a part of the range, that counts as a turn.
const SMALL: f64 = 0.02;
/// Transparency of a band.
const BAND: f64 = 0.25;

/// The drawn form of a curve over time.
#[derive(Clone)]
pub(crate) struct History {
    /// The curve itself, or the mean of a band.
    pub line: PlottedCurve,
    pen: Pen,
    /// Outline of the band: times and values, the upper edge and then the lower one backwards.
    band: [Vec<f64>; 2],
}

impl History {
    /// A history of values over rising times. Values that are not finite break the curve, and a broken curve
    /// is no band.
    pub(crate) fn new(name: &str, pen: Pen, time: &[f64], values: &[f64]) -> Self {
        let key = Key::Line(pen);
        let turns = turns(values);
        let whole = values.iter().all(|value| value.is_finite());
        if turns <= TURNS || !whole {
            let (time, values) = thinned(time, values);
            return Self {
                line: PlottedCurve::new(key, name, &time, &values),
                pen,
                band: Default::default(),
            };
        }
        let steps = columns(time, values, (turns / IN_STEP).min(STEPS).floor());
        let middle = |of: &CurvePiece| 0.5 * (of.points[0].0 + of.points[of.points.len() - 1].0);
        let mut at: Vec<f64> = steps.iter().map(middle).collect();
        // The band spans the whole time.
        if let ([first, .., last], Some((start, end))) = (at.as_mut_slice(), extent(time)) {
            (*first, *last) = (start, end);
        }
        let upper = steps.iter().zip(&at).map(|(step, t)| (*t, step.range.1));
        let lower = steps.iter().zip(&at).map(|(step, t)| (*t, step.range.0));
        let (times, edge): (Vec<f64>, Vec<f64>) = upper.chain(lower.rev()).unzip();
        let means: Vec<f64> = steps.iter().map(|step| step.mean()).collect();
        Self {
            line: PlottedCurve::new(key, name, &at, &means),
            pen,
            band: [times, edge],
        }
    }

    /// Paints the band, under all lines.
    pub(crate) fn band(&self, canvas: &mut Canvas, panel: &Panel) {
        let [time, values] = &self.band;
        let outline = panel.pixels(time, values);
        canvas.polygon(&outline, self.pen.colour, BAND);
    }
}

/// Number of turns of a curve by more than a small part of its range.
fn turns(values: &[f64]) -> f64 {
    let Some((low, high)) = extent(values) else {
        return 0.0;
    };
    let least = SMALL * (high - low);
    let (mut count, mut rising, mut last) = (0.0, None, f64::NAN);
    for &value in values.iter().filter(|value| value.is_finite()) {
        let way = value - last;
        match rising {
            // The turning point moves on while the curve goes the same way.
            Some(up) if (way > 0.0) == up => last = value,
            _ if way.abs() > least => {
                count += f64::from(u8::from(rising.is_some()));
                (rising, last) = (Some(way > 0.0), value);
            }
            _ if last.is_nan() => last = value,
            _ => {}
        }
    }
    count
}

/// The part of a curve in a short piece of the panel.
struct CurvePiece {
    points: Vec<(f64, f64)>,
    range: (f64, f64),
}

impl CurvePiece {
    /// The mean over time.
    fn mean(&self) -> f64 {
        let span = self.points[self.points.len() - 1].0 - self.points[0].0;
        let parts = self.points.windows(2);
        let area: f64 = parts
            .map(|two| 0.5 * (two[0].1 + two[1].1) * (two[1].0 - two[0].0))
            .sum();
        if span > 0.0 {
            area / span
        } else {
            self.points[0].1
        }
    }
}

/// A curve cut into `count` equal pieces of time; pieces without a point are left out.
fn columns(time: &[f64], values: &[f64], count: f64) -> Vec<CurvePiece> {
    let (start, end) = extent(time).unwrap_or_default();
    let column = |t: f64| {
        ((t - start) / (end - start) * count)
            .floor()
            .min(count - 1.0)
    };
    let points = time.iter().copied().zip(values.iter().copied());
    let points: Vec<(f64, f64)> = points
        .filter(|(t, v)| t.is_finite() && v.is_finite())
        .collect();
    let pieces = points.chunk_by(|a, b| column(a.0) == column(b.0));
    let piece = |points: &[(f64, f64)]| {
        let values: Vec<f64> = points.iter().map(|(_, value)| *value).collect();
        Some(CurvePiece {
            points: points.to_vec(),
            range: extent(&values)?,
        })
    };
    pieces.filter_map(piece).collect()
}

/// A curve over rising times with fewer points and the same drawing. Where more than four points share half a
/// pixel, the first, the least, the largest and the last of them stay. Values that are not finite break the
/// curve before and after.
pub(crate) fn thinned(time: &[f64], values: &[f64]) -> (Vec<f64>, Vec<f64>) {
    const COLUMNS: f64 = 2.0 * WIDTH;
    if time.len() as f64 <= 4.0 * COLUMNS {
        return (time.to_vec(), values.to_vec());
    }
    if let Some(at) = values.iter().position(|value| !value.is_finite()) {
        let rest = values[at..].iter().position(|value| value.is_finite());
        let rest = rest.map_or(values.len(), |more| at + more);
        let [before, after] =
            [0..at, rest..values.len()].map(|part| thinned(&time[part.clone()], &values[part]));
        let join = |mut a: Vec<f64>, b: Vec<f64>| {
            a.push(f64::NAN);
            a.extend(b);
            a
        };
        return (join(before.0, after.0), join(before.1, after.1));
    }
    let mut kept = Vec::new();
    for CurvePiece { points, .. } in columns(time, values, COLUMNS) {
        let by = |a: &&(f64, f64), b: &&(f64, f64)| a.1.total_cmp(&b.1);
        let mut few: Vec<&(f64, f64)> = [points.first(), points.last()]
            .into_iter()
            .flatten()
            .collect();
        few.extend(points.iter().min_by(by));
        few.extend(points.iter().max_by(by));
        few.sort_by(|a, b| a.0.total_cmp(&b.0));
        kept.extend(few.into_iter().copied());
    }
    kept.into_iter().unzip()
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::palette::INK;

    fn swinging(count: f64, points: usize) -> History {
        let time: Vec<f64> = (0..=points).map(|k| k as f64 / points as f64).collect();
        let values = time
            .iter()
            .map(|t| t + 0.5 * (std::f64::consts::TAU * count * t).sin());
        History::new("", Pen::new(INK, 1.0), &time, &values.collect::<Vec<_>>())
    }

    /// Catches a fast oscillation drawn as a block, a band off the extremes of its swings, and slow or noisy
    /// curves drawn as bands.
    #[test]
    fn fast_oscillations_are_bands_about_their_mean() {
        assert!(swinging(20.0, 10_000).band[0].is_empty());
        let fast = swinging(500.0, 100_000);
        let [time, edge] = &fast.band;
        let upper = time.len() / 2;
        assert_eq!(time.len(), 2 * STEPS as usize);
        for (k, (t, value)) in time.iter().zip(edge).enumerate() {
            let side = if k < upper { 0.5 } else { -0.5 };
            assert!((value - t - side).abs() < 0.015, "{t}: {value}");
        }
        // Too many points for a drawing, and a break among them.
        let time: Vec<f64> = (0..20_000).map(f64::from).collect();
        let broken: Vec<f64> = (time.iter())
            .map(|t| {
                if *t == 9_000.0 {
                    f64::NAN
                } else {
                    (0.001 * t).sin()
                }
            })
            .collect();
        let (_, kept) = thinned(&time, &broken);
        assert_eq!(kept.iter().filter(|value| value.is_nan()).count(), 1);
        let noise: Vec<f64> = (0..10_000)
            .map(|k| k as f64 + 10.0 * f64::from(k % 2))
            .collect();
        assert_eq!(turns(&noise), 0.0);
    }
}
