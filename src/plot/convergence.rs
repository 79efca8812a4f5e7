//! How fast viscous runs approach their elastic limit.

use super::axes::{Axis, Panel, SMALL, draw_mark, mark};
use super::canvas::{Canvas, Pen, Side, Type};
use super::data::{AxisUnits, as_many, with_unit};
use super::legend::{Entry, Key};
use super::page::Column;
use super::palette::{Colour, category};
use super::text;
use crate::error::{Error, Result};

/// The error of one quantity, or in one stretch of the motion.
#[derive(Debug, Clone, Default, PartialEq)]
pub struct ConvergenceSeries {
    /// Its name in the legend, as "on the sheet" or "after the first fold".
    pub name: String,
    /// Viscosities.
    pub eta: Vec<f64>,
    /// The error at each; those that are not positive (or not finite) break the line.
    pub error: Vec<f64>,
}

/// A reference slope: a triangle near a series.
#[derive(Debug, Clone, Default, PartialEq)]
pub struct Slope {
    /// The order p of error ~ eta^p.
    pub order: f64,
    /// What is written at it, as "2/3"; if empty the number.
    pub name: String,
    /// The index of the series it stands by; by default where there is room.
    pub series: Option<usize>,
}

/// Errors against the viscosity.
#[derive(Debug, Clone, Default, PartialEq)]
pub struct Convergence {
    /// Written over the figure; may be empty.
    pub title: String,
    /// The series.
    pub series: Vec<ConvergenceSeries>,
    /// Reference slopes.
    pub slopes: Vec<Slope>,
    /// The horizontal axis with its unit; if empty "viscosity η" with the unit energy x length x time.
    pub eta_label: String,
    /// The vertical axis with its unit; if empty "error".
    pub error_label: String,
    /// Units.
    pub units: AxisUnits,
}

const FIGURE: &str = "figure of convergence";
const WIDTH: f64 = 600.0;
const GUIDE: Colour = Colour(105, 105, 105);
/// What a guide keeps away from curves and from other guides, pixels.
const CLEAR: f64 = 9.0;

type Pixel = (f64, f64);

/// Draws errors against the viscosity, both logarithmic with a mark at each decade, as SVG; reference
/// slopes are thin triangles, put where they cover no data.
///
/// Errs if a series has not as many errors as viscosities, if a slope is not finite or names no series, or
/// if no point is positive and finite.
pub fn convergence(data: &Convergence) -> Result<String> {
    for (i, series) in data.series.iter().enumerate() {
        let (field, count) = (format!("series[{i}].error"), series.eta.len());
        as_many(FIGURE, &field, series.error.len(), count, "viscosities")?;
    }
    for (i, slope) in data.slopes.iter().enumerate() {
        let there = slope.series.is_none_or(|s| s < data.series.len());
        if !(slope.order.abs() <= 100.0) || !there {
            return Err(Error::domain(format!(
                "{FIGURE}: slopes[{i}] has order {} at series {:?}; it needs a number within ±100 and one of {} series",
                slope.order,
                slope.series,
                data.series.len()
            )));
        }
    }
    let points = data
        .series
        .iter()
        .flat_map(|s| s.eta.iter().zip(&s.error))
        .filter(|p| [p.0, p.1].iter().all(|v| (1e-290..1e290).contains(*v)));
    let (etas, errors): (Vec<f64>, Vec<f64>) = points.unzip();
    let nothing = || Error::domain(format!("{FIGURE}: no positive error to show"));
    let eta_label = if data.eta_label.is_empty() {
        with_unit("viscosity η", &data.units.viscosity())
    } else {
        data.eta_label.clone()
    };
    let error_label = if data.error_label.is_empty() {
        "error"
    } else {
        &data.error_label
    };
    let x = Axis::fit(&etas, true, &eta_label, 10).ok_or_else(nothing)?;
    let y = Axis::fit(&errors, true, error_label, 12).ok_or_else(nothing)?;
    let named = data.series.iter().enumerate();
    let entries = named
        .filter(|(_, s)| !s.name.is_empty())
        .map(|(i, s)| Entry::new(Key::LineMark(pen(i), mark(i)), s.name.as_str()))
        .collect();
    let page = Column::new(WIDTH, &data.title, vec![entries], &x, vec![(y, 380.0)]);
    Ok(page.draw(|canvas, _, panel| {
        let curves = data.series.iter();
        let curves: Vec<Vec<Pixel>> = curves.map(|s| panel.pixels(&s.eta, &s.error)).collect();
        for guide in guides(&data.slopes, panel, &curves) {
            guide.draw(canvas);
        }
        for (i, curve) in curves.iter().enumerate() {
            panel.pixel_line(canvas, curve, pen(i));
        }
        for (i, curve) in curves.iter().enumerate() {
            for &at in curve.iter().filter(|p| panel.holds(**p)) {
                draw_mark(canvas, at, mark(i), 3.6, category(i));
            }
        }
    }))
}

fn pen(i: usize) -> Pen {
    Pen::new(category(i), 1.5)
}

/// A right triangle whose long side has the slope.
struct Guide {
    /// The corners; the right angle is the second.
    corners: [Pixel; 3],
    /// The words "1" and the slope, with where they are centred.
    words: [(Pixel, String); 2],
}

impl Guide {
    /// `run` and `rise` in pixels (rise positive upwards) from the left end of the long side; the right angle is
    /// on the right, or on the left.
    fn new(at: Pixel, run: f64, rise: f64, on_right: bool, name: &str) -> Self {
        let end = (at.0 + run, at.1 - rise);
        let corner = if on_right {
            (end.0, at.1)
        } else {
            (at.0, end.1)
        };
        let half = 0.5 * text::width(name, SMALL) + 5.0;
        let aside = if on_right { half } else { -half };
        // The level leg's word stands off the triangle.
        let off = if on_right == (rise >= 0.0) { 9.0 } else { -9.0 };
        Self {
            corners: [at, corner, end],
            words: [
                ((at.0 + 0.5 * run, corner.1 + off), "1".into()),
                ((corner.0 + aside, at.1 - 0.5 * rise), name.into()),
            ],
        }
    }

    /// Points of its outline and about its words.
    fn outline(&self) -> Vec<Pixel> {
        let [a, b, c] = self.corners;
        let mut points = Vec::new();
        for (from, to) in [(a, b), (b, c), (c, a)] {
            points.extend((0..6).map(|i| between(from, to, i as f64 / 6.0)));
        }
        for (at, word) in &self.words {
            let half = 0.5 * text::width(word, SMALL);
            points.extend([
                (at.0 - half, at.1),
                *at,
                (at.0 + half, at.1 - 4.0),
                (at.0 + half, at.1 + 4.0),
            ]);
        }
        points
    }

    fn draw(&self, canvas: &mut Canvas) {
        let [a, b, c] = self.corners;
        canvas.line(&[a, b, c, a], Pen::new(GUIDE, 1.0));
        let font = Type::new(SMALL, Side::Middle, Side::Middle).colour(GUIDE);
        for (at, word) in &self.words {
            canvas.halo_text(*at, word, font);
        }
    }
}

fn between(a: Pixel, b: Pixel, t: f64) -> Pixel {
    (a.0 + t * (b.0 - a.0), a.1 + t * (b.1 - a.1))
}

fn distance(points: &[Pixel], others: &[Pixel]) -> f64 {
    let apart = |p: &Pixel| {
        let squares = others
            .iter()
            .map(|q| (p.0 - q.0).powi(2) + (p.1 - q.1).powi(2));
        squares.fold(f64::INFINITY, f64::min)
    };
    points
        .iter()
        .map(apart)
        .fold(f64::INFINITY, f64::min)
        .sqrt()
}

/// Places for the guides: with the long side nearest to their series, among those that keep clear of everything.
fn guides(slopes: &[Slope], panel: &Panel, curves: &[Vec<Pixel>]) -> Vec<Guide> {
    let decade = panel.width / (panel.x.hi / panel.x.lo).log10();
    let up = panel.height / (panel.y.hi / panel.y.lo).log10();
    let dense: Vec<Vec<Pixel>> = curves.iter().map(|c| sampled(c)).collect();
    let mut taken: Vec<Pixel> = dense.iter().flatten().copied().collect();
    let mut guides = Vec::new();
    for slope in slopes {
        // A decade long, but neither tiny nor larger than a quarter of the panel.
        let steepest = (0.25 * panel.height) / (slope.order.abs() * up).max(1e-9);
        let run = (decade.clamp(36.0, 0.22 * panel.width)).min(steepest * decade);
        let rise = slope.order * run / decade * up;
        let name = if slope.name.is_empty() {
            super::layer::short(slope.order)
        } else {
            slope.name.clone()
        };
        let near: Vec<Pixel> = match slope.series {
            Some(s) => dense[s].clone(),
            None => dense.iter().flatten().copied().collect(),
        };
        let mut best: Option<(f64, Guide)> = None;
        for i in 0..(panel.width / 12.0) as usize {
            for j in 0..(panel.height / 12.0) as usize {
                for on_right in [true, false] {
                    let at = (
                        panel.left + 12.0 * i as f64,
                        panel.bottom() - 12.0 * j as f64,
                    );
                    let guide = Guide::new(at, run, rise, on_right, &name);
                    let outline = guide.outline();
                    let inside = |p: &Pixel| {
                        p.0 > panel.left + 8.0
                            && p.0 < panel.right() - 8.0
                            && p.1 > panel.top + 10.0
                            && p.1 < panel.bottom() - 10.0
                    };
                    if !outline.iter().all(inside) {
                        continue;
                    }
                    let clear = distance(&outline, &taken);
                    // What is not clear comes after all that is, the clearest first.
                    let middle = between(guide.corners[0], guide.corners[2], 0.5);
                    let off = (middle.0 - panel.left - 0.5 * panel.width).abs();
                    let cost = if clear >= CLEAR {
                        distance(&[middle], &near) + 0.05 * off
                    } else {
                        1e6 - clear
                    };
                    if best.as_ref().is_none_or(|(least, _)| cost < *least) {
                        best = Some((cost, guide));
                    }
                }
            }
        }
        if let Some((_, guide)) = best {
            taken.extend(guide.outline());
            guides.push(guide);
        }
    }
    guides
}

/// Points along a line, 8 pixels apart or less.
fn sampled(curve: &[Pixel]) -> Vec<Pixel> {
    let finite = |p: &Pixel| p.0.is_finite() && p.1.is_finite();
    let mut points: Vec<Pixel> = curve.iter().copied().filter(finite).collect();
    for pair in curve.windows(2).filter(|p| p.iter().all(finite)) {
        let length = (pair[1].0 - pair[0].0).hypot(pair[1].1 - pair[0].1);
        let steps = (length / 8.0).ceil().min(200.0) as usize;
        points.extend((1..steps).map(|i| between(pair[0], pair[1], i as f64 / steps as f64)));
    }
    points
}
