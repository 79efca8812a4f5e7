//! A panel: a frame with two axes, into which data are drawn.

use super::canvas::{Canvas, Pen, Side, Type};
use super::palette::{Colour, FAINT, INK, WHITE};
use super::text;
use super::ticks::{self, Tick};

/// Font sizes in pixels.
pub(crate) const TITLE: f64 = 14.0;
pub(crate) const LABEL: f64 = 13.0;
pub(crate) const SMALL: f64 = 11.5;

/// Length of a tick mark.
const MARK: f64 = 5.0;
/// The same in space.
pub(crate) const MARK_3D: f64 = 4.0;

/// A range of numbers laid along an edge of a panel.
#[derive(Debug, Clone)]
pub(crate) struct Axis {
    pub lo: f64,
    pub hi: f64,
    pub log: bool,
    pub label: String,
    /// Numbers stand at the marks.
    pub numbered: bool,
    pub ticks: Vec<Tick>,
}

impl Axis {
    /// Equal steps from lo to hi.
    pub(crate) fn linear(lo: f64, hi: f64, label: &str, wanted: usize) -> Self {
        Self {
            lo,
            hi,
            log: false,
            label: label.to_string(),
            numbered: true,
            ticks: ticks::linear(lo, hi, wanted),
        }
    }

    /// Equal ratios from lo > 0 to hi.
    pub(crate) fn log(lo: f64, hi: f64, label: &str, wanted: usize) -> Self {
        Self {
            lo,
            hi,
            log: true,
            label: label.to_string(),
            numbered: true,
            ticks: ticks::log(lo, hi, wanted),
        }
    }

    /// Holds all finite values, with a margin of a twentieth; `None` if there are none.
    pub(crate) fn fit<'a>(
        values: impl IntoIterator<Item = &'a f64>,
        log: bool,
        label: &str,
        wanted: usize,
    ) -> Option<Self> {
        let (lo, hi) = extent(values.into_iter().filter(|v| !log || **v > 0.0))?;
        if log {
            let margin = (0.05 * (hi / lo).log10()).max(0.15);
            let factor = 10f64.powf(margin);
            return Some(Self::log(
                (lo / factor).max(1e-300),
                (hi * factor).min(1e300),
                label,
                wanted,
            ));
        }
        let span = if hi > lo {
            hi - lo
        } else {
            lo.abs().max(1.0) * 0.2
        };
        Some(Self::linear(
            lo - 0.05 * span,
            hi + 0.05 * span,
            label,
            wanted,
        ))
    }

    /// The range given, or else one that holds the values. A spread that is mere roundoff is not
    /// magnified.
    pub(crate) fn over(
        values: &[f64],
        range: Option<[f64; 2]>,
        label: &str,
        wanted: usize,
    ) -> Option<Self> {
        if let Some([lo, hi]) = range.filter(|[lo, hi]| lo < hi && (hi - lo).is_finite()) {
            return Some(Self::linear(lo, hi, label, wanted));
        }
        let (lo, hi) = extent(values)?;
        if !(hi - lo > 1e-9 * lo.abs().max(hi.abs())) {
            return Self::fit(&[0.5 * lo + 0.5 * hi], false, label, wanted);
        }
        Self::fit(values, false, label, wanted)
    }

    /// The same without numbers and name, for a panel that shares the axis of the one below.
    pub(crate) fn bare(&self) -> Self {
        Self {
            label: String::new(),
            numbered: false,
            ..self.clone()
        }
    }

    /// Where `value` lies: 0 at lo, 1 at hi; NaN where a logarithm has no value.
    pub(crate) fn place(&self, value: f64) -> f64 {
        if self.log {
            if value > 0.0 {
                (value / self.lo).ln() / (self.hi / self.lo).ln()
            } else {
                f64::NAN
            }
        } else {
            (value - self.lo) / (self.hi - self.lo)
        }
    }

    /// The room its tick labels need beside a vertical axis.
    pub(crate) fn label_width(&self) -> f64 {
        self.ticks
            .iter()
            .filter_map(|tick| tick.label.as_deref())
            .map(|label| text::width(label, SMALL))
            .fold(0.0, f64::max)
    }
}

/// The least and the largest of the finite values.
pub(crate) fn extent<'a>(values: impl IntoIterator<Item = &'a f64>) -> Option<(f64, f64)> {
    values
        .into_iter()
        .filter(|v| v.is_finite())
        .fold(None, |range, &v| match range {
            None => Some((v, v)),
            Some((lo, hi)) => Some((v.min(lo), v.max(hi))),
        })
}

/// A rectangle of the canvas with its axes.
#[derive(Debug, Clone)]
pub(crate) struct Panel {
    pub left: f64,
    pub top: f64,
    pub width: f64,
    pub height: f64,
    pub x: Axis,
    pub y: Axis,
}

impl Panel {
    /// The pixel of a data point; not finite if the point is not.
    pub(crate) fn at(&self, x: f64, y: f64) -> (f64, f64) {
        (
            self.left + self.width * self.x.place(x),
            self.top + self.height * (1.0 - self.y.place(y)),
        )
    }

    pub(crate) fn right(&self) -> f64 {
        self.left + self.width
    }

    pub(crate) fn bottom(&self) -> f64 {
        self.top + self.height
    }

    /// Pixels of a curve.
    pub(crate) fn pixels(&self, x: &[f64], y: &[f64]) -> Vec<(f64, f64)> {
        x.iter().zip(y).map(|(&x, &y)| self.at(x, y)).collect()
    }

    /// A curve, cut at the frame.
    pub(crate) fn line(&self, canvas: &mut Canvas, x: &[f64], y: &[f64], pen: Pen) {
        self.pixel_line(canvas, &self.pixels(x, y), pen);
    }

    /// A line given in pixels, cut at the frame and thinned to what can be seen.
    pub(crate) fn pixel_line(&self, canvas: &mut Canvas, points: &[(f64, f64)], pen: Pen) {
        let frame = [self.left, self.top, self.right(), self.bottom()];
        for run in clip(points, frame) {
            canvas.line(&thin(&run, 0.06), pen);
        }
    }

    /// True if the pixel lies in the frame.
    pub(crate) fn holds(&self, p: (f64, f64)) -> bool {
        p.0 >= self.left - 0.5
            && p.0 <= self.right() + 0.5
            && p.1 >= self.top - 0.5
            && p.1 <= self.bottom() + 0.5
    }

    /// Faint lines at the labelled ticks: under the data.
    pub(crate) fn grid(&self, canvas: &mut Canvas) {
        let pen = Pen::new(FAINT, 0.7);
        for tick in self.x.ticks.iter().filter(|t| t.label.is_some()) {
            let x = self.left + self.width * self.x.place(tick.value);
            canvas.line(&[(x, self.top), (x, self.bottom())], pen);
        }
        for tick in self.y.ticks.iter().filter(|t| t.label.is_some()) {
            let y = self.top + self.height * (1.0 - self.y.place(tick.value));
            canvas.line(&[(self.left, y), (self.right(), y)], pen);
        }
    }

    /// Frame, tick marks, numbers and names: over the data.
    pub(crate) fn frame(&self, canvas: &mut Canvas) {
        let pen = Pen::new(INK, 0.9);
        let (l, t, r, b) = (self.left, self.top, self.right(), self.bottom());
        canvas.line(&[(l, t), (r, t), (r, b), (l, b), (l, t)], pen);
        let small = Type::new(SMALL, Side::Middle, Side::Start);
        for tick in &self.x.ticks {
            let x = l + self.width * self.x.place(tick.value);
            let mark = if tick.label.is_some() {
                MARK
            } else {
                0.55 * MARK
            };
            canvas.line(&[(x, b), (x, b + mark)], pen);
            if let (Some(label), true) = (&tick.label, self.x.numbered) {
                canvas.text((x, b + MARK + 3.0), label, small);
            }
        }
        let beside = Type::new(SMALL, Side::End, Side::Middle);
        for tick in &self.y.ticks {
            let y = t + self.height * (1.0 - self.y.place(tick.value));
            let mark = if tick.label.is_some() {
                MARK
            } else {
                0.55 * MARK
            };
            canvas.line(&[(l - mark, y), (l, y)], pen);
            if let Some(label) = &tick.label {
                canvas.text((l - MARK - 3.0, y), label, beside);
            }
        }
        let name = Type::new(LABEL, Side::Middle, Side::Start);
        canvas.text(
            (0.5 * (l + r), b + MARK + 3.0 + SMALL + 6.0),
            &self.x.label,
            name,
        );
        let name = Type::new(LABEL, Side::Middle, Side::End).upwards();
        let beside = l - MARK - 3.0 - self.y.label_width() - 5.0;
        canvas.text((beside, 0.5 * (t + b)), &self.y.label, name);
    }

    /// A bold-sized name over the panel, flush left.
    pub(crate) fn title(&self, canvas: &mut Canvas, title: &str) {
        let font = Type::new(TITLE, Side::Start, Side::End);
        canvas.text((self.left, self.top - 5.0), title, font);
    }
}

/// The room left of a panel for its y axis.
pub(crate) fn room_left(y: &Axis) -> f64 {
    MARK + 3.0 + y.label_width() + 5.0 + LABEL + 12.0
}

/// The room under a panel for its x axis.
pub(crate) const ROOM_BELOW: f64 = MARK + 3.0 + SMALL + 6.0 + LABEL + 9.0;

/// The pieces of a polyline within [left, top, right, bottom] (Liang and Barsky); points that are
/// not finite break it.
pub(crate) fn clip(points: &[(f64, f64)], frame: [f64; 4]) -> Vec<Vec<(f64, f64)>> {
    let mut runs: Vec<Vec<(f64, f64)>> = Vec::new();
    let mut open = false;
    for pair in points.windows(2) {
        let Some((from, to)) = clip_segment(pair[0], pair[1], frame) else {
            open = false;
            continue;
        };
        match runs.last_mut() {
            Some(run) if open && from == pair[0] => run.push(to),
            _ => runs.push(vec![from, to]),
        }
        open = to == pair[1];
    }
    runs
}

type Segment = ((f64, f64), (f64, f64));

fn clip_segment(a: (f64, f64), b: (f64, f64), frame: [f64; 4]) -> Option<Segment> {
    let (dx, dy) = (b.0 - a.0, b.1 - a.1);
    if !(dx.is_finite() && dy.is_finite()) {
        return None;
    }
    let (mut t0, mut t1) = (0f64, 1f64);
    for (p, q) in [
        (-dx, a.0 - frame[0]),
        (dx, frame[2] - a.0),
        (-dy, a.1 - frame[1]),
        (dy, frame[3] - a.1),
    ] {
        if p == 0.0 {
            if q < 0.0 {
                return None;
            }
        } else if p < 0.0 {
            t0 = t0.max(q / p);
        } else {
            t1 = t1.min(q / p);
        }
    }
    let point = |t: f64| (a.0 + t * dx, a.1 + t * dy);
    (t0 <= t1).then(|| {
        (
            if t0 > 0.0 { point(t0) } else { a },
            if t1 < 1.0 { point(t1) } else { b },
        )
    })
}

/// Leaves out points that lie within `tolerance` of the line through those kept (Douglas and Peucker,
/// without recursion). Ends are kept; all points must be finite.
pub(crate) fn thin(points: &[(f64, f64)], tolerance: f64) -> Vec<(f64, f64)> {
    let n = points.len();
    if n < 3 {
        return points.to_vec();
    }
    let mut keep = vec![false; n];
    keep[0] = true;
    keep[n - 1] = true;
    let mut stack = vec![(0, n - 1)];
    while let Some((i, j)) = stack.pop() {
        let far = (i + 1..j)
            .map(|m| (m, distance(points[m], points[i], points[j])))
            .max_by(|a, b| a.1.total_cmp(&b.1));
        if let Some((m, d)) = far
            && d > tolerance
        {
            keep[m] = true;
            stack.push((i, m));
            stack.push((m, j));
        }
    }
    points
        .iter()
        .zip(keep)
        .filter_map(|(&p, keep)| keep.then_some(p))
        .collect()
}

/// From p to the segment a b.
fn distance(p: (f64, f64), a: (f64, f64), b: (f64, f64)) -> f64 {
    let (dx, dy) = (b.0 - a.0, b.1 - a.1);
    let square = dx * dx + dy * dy;
    let t = if square > 0.0 {
        (((p.0 - a.0) * dx + (p.1 - a.1) * dy) / square).clamp(0.0, 1.0)
    } else {
        0.0
    };
    (p.0 - a.0 - t * dx).hypot(p.1 - a.1 - t * dy)
}

/// A shape that marks a point.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) enum Mark {
    Disc,
    Square,
    Triangle,
    Diamond,
    Ring,
    Cross,
}

/// The i-th mark for things without an order.
pub(crate) fn mark(i: usize) -> Mark {
    const MARKS: [Mark; 5] = [
        Mark::Disc,
        Mark::Square,
        Mark::Triangle,
        Mark::Diamond,
        Mark::Ring,
    ];
    MARKS[i % MARKS.len()]
}

/// Draws a mark of about the area of a disc of radius `r`, with a thin white rim.
pub(crate) fn draw_mark(canvas: &mut Canvas, at: (f64, f64), mark: Mark, r: f64, colour: Colour) {
    let (x, y) = at;
    let shape: &[(f64, f64)] = match mark {
        Mark::Disc => {
            canvas.disc(at, r + 0.8, WHITE, 1.0);
            canvas.disc(at, r, colour, 1.0);
            return;
        }
        Mark::Ring => {
            canvas.disc(at, r, WHITE, 1.0);
            canvas.circle(at, r - 0.4, Pen::new(colour, 1.4));
            return;
        }
        Mark::Cross => {
            let arm = |s: f64| [(x - r, y - s * r), (x + r, y + s * r)];
            for (width, colour) in [(4.0, WHITE), (2.0, colour)] {
                canvas.line(&arm(1.0), Pen::new(colour, width));
                canvas.line(&arm(-1.0), Pen::new(colour, width));
            }
            return;
        }
        Mark::Square => &[(-0.9, -0.9), (0.9, -0.9), (0.9, 0.9), (-0.9, 0.9)],
        Mark::Triangle => &[(0.0, -1.3), (1.13, 0.65), (-1.13, 0.65)],
        Mark::Diamond => &[(0.0, -1.3), (1.1, 0.0), (0.0, 1.3), (-1.1, 0.0)],
    };
    let scaled = |s: f64| -> Vec<_> { shape.iter().map(|p| (x + s * p.0, y + s * p.1)).collect() };
    canvas.polygon(&scaled(r + 0.9), WHITE, 1.0);
    canvas.polygon(&scaled(r), colour, 1.0);
}
