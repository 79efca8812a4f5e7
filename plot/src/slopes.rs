//! Reference slopes: triangles near a series of a figure with two logarithmic axes.

use super::axes::{Panel, SMALL};
use super::canvas::{Canvas, Pen, Side, Type};
use super::geometry::{Pixel, dotted, hull, midway};
use super::palette::Colour;
use super::text;

/// A reference slope: a triangle near a series.
#[derive(Debug, Clone, Default, PartialEq)]
pub struct Slope {
    /// The order p of y ~ x^p.
    pub order: f64,
    /// Text at the triangle, as "2/3"; if empty the number.
    pub name: String,
    /// Index of the adjacent series; by default any with room.
    pub series: Option<usize>,
}

const GUIDE: Colour = Colour(105, 105, 105);
/// Clearance of a guide from curves and from other guides, in pixels.
const CLEAR: f64 = 9.0;

/// Draws the guides off the curves.
pub(crate) fn draw(canvas: &mut Canvas, panel: &Panel, slopes: &[Slope], curves: &[Vec<Pixel>]) {
    for guide in guides(slopes, panel, curves) {
        guide.draw(canvas);
    }
}

/// A right triangle whose long side has the slope.
struct SlopeTriangle {
    /// Corners; the right angle is the second.
    corners: [Pixel; 3],
    /// The words "1" and the slope, each with its centre.
    words: [(Pixel, String); 2],
}

impl SlopeTriangle {
    /// A triangle with the legs `run` and `rise` in pixels (rise positive upwards) from the left end of the
    /// long side; the right angle is on the right, or on the left.
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

    /// Points of the outline and about the words.
    fn outline(&self) -> Vec<Pixel> {
        let [a, b, c] = self.corners;
        let mut points = Vec::new();
        for (from, to) in [(a, b), (b, c), (c, a)] {
            points.extend((0..6).map(|i| midway(from, to, i as f64 / 6.0)));
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

fn distance(points: &[Pixel], others: &[Pixel]) -> f64 {
    let squares = points.iter().flat_map(|p| {
        let square = |q: &Pixel| (p.0 - q.0).powi(2) + (p.1 - q.1).powi(2);
        others.iter().map(square)
    });
    squares.fold(f64::INFINITY, f64::min).sqrt()
}

/// Places for the guides: clear of everything, with the long side nearest to their series.
fn guides(slopes: &[Slope], panel: &Panel, curves: &[Vec<Pixel>]) -> Vec<SlopeTriangle> {
    let decade = panel.width / (panel.x.hi / panel.x.lo).log10();
    let up = panel.height / (panel.y.hi / panel.y.lo).log10();
    let dense: Vec<Vec<Pixel>> = curves.iter().map(|c| dotted(c, 8.0)).collect();
    let mut taken: Vec<Pixel> = dense.iter().flatten().copied().collect();
    let mut guides = Vec::new();
    for slope in slopes {
        // A decade long, but neither tiny nor larger than a quarter of the panel.
        let steepest = (0.25 * panel.height) / (slope.order.abs() * up).max(1e-9);
        let run = decade
            .clamp(36.0, 0.22 * panel.width)
            .min(steepest * decade);
        let rise = slope.order * run / decade * up;
        let name = if slope.name.is_empty() {
            text::short(slope.order, 4)
        } else {
            slope.name.clone()
        };
        let near: Vec<Pixel> = match slope.series {
            Some(s) => dense[s].clone(),
            None => dense.iter().flatten().copied().collect(),
        };
        let mut best: Option<(f64, SlopeTriangle)> = None;
        for i in 0..(panel.width / 12.0) as usize {
            for j in 0..(panel.height / 12.0) as usize {
                for on_right in [true, false] {
                    let at = (
                        panel.left + 12.0 * i as f64,
                        panel.bottom() - 12.0 * j as f64,
                    );
                    let guide = SlopeTriangle::new(at, run, rise, on_right, &name);
                    let outline = guide.outline();
                    let [l, t, r, b] = hull(outline.iter().copied());
                    let [left, top, right, bottom] = panel.edges();
                    if l < left + 8.0 || r > right - 8.0 || t < top + 10.0 || b > bottom - 10.0 {
                        continue;
                    }
                    let clear = distance(&outline, &taken);
                    // Places without enough clearance rank after all others, the clearest first.
                    let middle = midway(guide.corners[0], guide.corners[2], 0.5);
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
