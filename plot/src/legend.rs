//! Appearance of curves and marks, legends and colour bars. Legends stand outside the panels, so they never
//! cover data.

use super::axes::{Axis, LABEL, Panel, SMALL, extent};
use super::canvas::{Canvas, Pen, Side, Type};
use super::geometry::Pixel;
use super::palette::{Colour, INK, WHITE, sequential_line};
use super::text;

/// A shape that marks a point.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) enum Mark {
    Disc,
    Square,
    Triangle,
    Diamond,
    Ring,
    Cross,
    /// A small disc without a rim, for thousands close together.
    Dot,
}

/// The i-th mark for things without an order.
pub(crate) fn mark(i: usize) -> Mark {
    use Mark::*;
    [Disc, Square, Triangle, Diamond, Ring][i % 5]
}

/// Draws a mark of about the area of a disc of radius `r`, with a thin white rim.
pub(crate) fn draw_mark(canvas: &mut Canvas, at: Pixel, mark: Mark, r: f64, colour: Colour) {
    let shape: &[Pixel] = match mark {
        Mark::Disc => {
            canvas.disc(at, r + 0.8, WHITE, 1.0);
            return canvas.disc(at, r, colour, 1.0);
        }
        Mark::Dot => return canvas.disc(at, 0.3 * r, colour, 1.0),
        Mark::Ring => {
            canvas.disc(at, r, WHITE, 1.0);
            return canvas.circle(at, r - 0.4, Pen::new(colour, 1.4));
        }
        Mark::Cross => {
            for (width, colour) in [(4.0, WHITE), (2.0, colour)] {
                for s in [r, -r] {
                    let arm = [(at.0 - r, at.1 - s), (at.0 + r, at.1 + s)];
                    canvas.line(&arm, Pen::new(colour, width));
                }
            }
            return;
        }
        Mark::Square => &[(-0.9, -0.9), (0.9, -0.9), (0.9, 0.9), (-0.9, 0.9)],
        Mark::Triangle => &[(0.0, -1.3), (1.13, 0.65), (-1.13, 0.65)],
        Mark::Diamond => &[(0.0, -1.3), (1.1, 0.0), (0.0, 1.3), (-1.1, 0.0)],
    };
    for (r, colour) in [(r + 0.9, WHITE), (r, colour)] {
        let corners = shape.iter().map(|p| (at.0 + r * p.0, at.1 + r * p.1));
        canvas.polygon(&corners.collect::<Vec<_>>(), colour, 1.0);
    }
}

/// Sample of a curve or mark, drawn before its name in a legend.
#[derive(Debug, Clone, Copy)]
pub(crate) enum Key {
    Line(Pen),
    Mark(Mark, Colour),
    LineMark(Pen, Mark),
    Fill(Colour),
}

/// A curve of a panel: sample, name and points; points that are not finite break the curve.
#[derive(Debug, Clone)]
pub(crate) struct PlottedCurve {
    pub entry: Entry,
    x: Vec<f64>,
    y: Vec<f64>,
}

impl PlottedCurve {
    pub(crate) fn new(key: Key, name: &str, x: &[f64], y: &[f64]) -> Self {
        Self {
            entry: Entry::new(key, name),
            x: x.to_vec(),
            y: y.to_vec(),
        }
    }

    /// A line without a name.
    pub(crate) fn line_of(pen: Pen, x: &[f64], y: &[f64]) -> Self {
        Self::new(Key::Line(pen), "", x, y)
    }

    /// Draws the line of the curve, cut at the frame.
    pub(crate) fn line(&self, canvas: &mut Canvas, panel: &Panel) {
        if let Key::Line(pen) | Key::LineMark(pen, _) = self.entry.key {
            panel.line(canvas, &self.x, &self.y, pen);
        }
    }

    /// Draws the marks of the curve inside the frame.
    pub(crate) fn marks(&self, canvas: &mut Canvas, panel: &Panel) {
        let (mark, colour) = match self.entry.key {
            Key::Mark(mark, colour) => (mark, colour),
            Key::LineMark(pen, mark) => (mark, pen.colour),
            Key::Line(_) | Key::Fill(_) => return,
        };
        for at in panel.pixels(&self.x, &self.y) {
            panel.mark(canvas, at, mark, 3.6, colour);
        }
    }
}

/// Legend entries of the named curves.
pub(crate) fn named(curves: &[PlottedCurve]) -> Vec<Entry> {
    let named = curves.iter().filter(|c| !c.entry.text.is_empty());
    named.map(|c| c.entry.clone()).collect()
}

/// One name of a legend with its sample.
#[derive(Debug, Clone)]
pub(crate) struct Entry {
    key: Key,
    text: String,
}

impl Entry {
    /// The name; empty if not in a legend.
    pub(crate) fn text(&self) -> &str {
        &self.text
    }

    pub(crate) fn new(key: Key, text: impl Into<String>) -> Self {
        let text = text.into();
        Self { key, text }
    }

    fn sample_width(&self) -> f64 {
        match self.key {
            Key::Line(_) | Key::LineMark(..) => 24.0,
            Key::Mark(..) => 10.0,
            Key::Fill(_) => 14.0,
        }
    }

    fn width(&self) -> f64 {
        self.sample_width() + 6.0 + text::width(&self.text, SMALL) + 16.0
    }
}

const ROW: f64 = 18.0;

/// Entries set in rows above a panel.
pub(crate) struct Legend {
    rows: Vec<Vec<Entry>>,
}

impl Legend {
    /// Breaks the entries into rows no wider than `width` pixels; each group begins a row.
    pub(crate) fn new(groups: &[Vec<Entry>], width: f64) -> Self {
        let mut rows: Vec<Vec<Entry>> = Vec::new();
        for group in groups {
            let mut used = f64::INFINITY;
            for entry in group {
                let needed = entry.width();
                if used + needed > width + 16.0 {
                    rows.push(Vec::new());
                    used = 0.0;
                }
                used += needed;
                if let Some(row) = rows.last_mut() {
                    row.push(entry.clone());
                }
            }
        }
        Self { rows }
    }

    /// Height of the legend, with a small gap below.
    pub(crate) fn height(&self) -> f64 {
        match self.rows.len() {
            0 => 0.0,
            n => n as f64 * ROW + 4.0,
        }
    }

    /// Draws the legend with its upper left corner at (left, top).
    pub(crate) fn draw(&self, canvas: &mut Canvas, left: f64, top: f64) {
        for (i, row) in self.rows.iter().enumerate() {
            let y = top + (i as f64 + 0.5) * ROW;
            let mut x = left;
            for entry in row {
                let end = x + entry.sample_width();
                let mid = (0.5 * (x + end), y);
                if let Key::Line(pen) | Key::LineMark(pen, _) = entry.key {
                    canvas.line(&[(x, y), (end, y)], pen);
                }
                match entry.key {
                    Key::Line(_) => {}
                    Key::Mark(mark, colour) => draw_mark(canvas, mid, mark, 4.0, colour),
                    Key::LineMark(pen, mark) => draw_mark(canvas, mid, mark, 3.6, pen.colour),
                    Key::Fill(colour) => {
                        let (t, b) = (y - 5.0, y + 5.0);
                        let ring = [(x, t), (end, t), (end, b), (x, b), (x, t)];
                        canvas.polygon(&ring[..4], colour, 1.0);
                        canvas.line(&ring, Pen::new(INK, 0.5));
                    }
                }
                let font = Type::new(SMALL, Side::Start, Side::Middle);
                canvas.text((end + 6.0, y), &entry.text, font);
                x += entry.width();
            }
        }
    }
}

/// A strip of colours with a scale, standing at the right of a panel.
#[derive(Debug, Clone)]
pub(crate) struct ColourBar {
    /// The scale; its label names the quantity.
    axis: Axis,
    /// Colours from bottom to top in equal steps.
    pub colours: Vec<Colour>,
    /// Pointed ends below and on top: values beyond the scale have the first and the last colour.
    open: [bool; 2],
}

/// Colours of lines over a range of numbers.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Tones {
    lo: f64,
    span: f64,
}

impl Tones {
    /// The range of the finite values; `None` without values or for too wide a span.
    pub(crate) fn over<'a>(values: impl IntoIterator<Item = &'a f64>) -> Option<Self> {
        let (lo, hi) = extent(values)?;
        let span = if hi > lo { hi - lo } else { 1.0 };
        (span.is_finite() && lo + span > lo).then_some(Self { lo, span })
    }

    pub(crate) fn colour(&self, value: f64) -> Colour {
        sequential_line((value - self.lo) / self.span)
    }

    /// The colour bar of the range.
    pub(crate) fn bar(&self, label: &str) -> ColourBar {
        let axis = Axis::linear(self.lo, self.lo + self.span, label, 6);
        let colours = (0..64).map(|i| sequential_line(f64::from(i) / 63.0));
        ColourBar::new(axis, colours.collect(), [false; 2])
    }
}

/// Width of the strip.
const STRIP: f64 = 14.0;
/// Height of the points of a strip.
const TIP: f64 = 10.0;

impl ColourBar {
    /// Name of the quantity shown by the colours.
    pub(crate) fn label(&self) -> &str {
        &self.axis.label
    }

    /// A strip from end to end of the scale; `open`: pointed below and on top, for values beyond the scale.
    pub(crate) fn new(axis: Axis, colours: Vec<Colour>, open: [bool; 2]) -> Self {
        Self {
            axis,
            colours,
            open,
        }
    }

    /// Width of the bar with its scale, without the margin of the page.
    pub(crate) fn width(&self) -> f64 {
        STRIP + 8.0 + self.axis.label_width() + 8.0 + LABEL + 8.0
    }

    /// Draws the bar between `top` and `bottom`, from `left` on.
    pub(crate) fn draw(&self, canvas: &mut Canvas, left: f64, top: f64, bottom: f64) {
        let tip = |open: bool| if open { TIP + 2.0 } else { 0.0 };
        let (top, bottom) = (top + tip(self.open[1]), bottom - tip(self.open[0]));
        let right = left + STRIP;
        let step = (bottom - top) / self.colours.len().max(1) as f64;
        for (i, &colour) in self.colours.iter().enumerate() {
            let low = bottom - i as f64 * step;
            // Each colour overlaps the next a little to hide the seam.
            let high = (low - step - 0.5).max(top);
            let strip = [(left, low), (right, low), (right, high), (left, high)];
            canvas.polygon(&strip, colour, 1.0);
        }
        let ends = [
            (
                self.open[0],
                bottom,
                TIP,
                self.colours.first(),
                [left, right],
            ),
            (self.open[1], top, -TIP, self.colours.last(), [right, left]),
        ];
        let mut outline = vec![(left, top)];
        for (open, y, tip, colour, [from, to]) in ends {
            outline.push((from, y));
            if let Some(&colour) = colour.filter(|_| open) {
                let tip = (0.5 * (left + right), y + tip);
                canvas.polygon(&[(left, y), (right, y), tip], colour, 1.0);
                outline.push(tip);
            }
            outline.push((to, y));
        }
        let pen = Pen::new(INK, 0.8);
        canvas.line(&outline, pen);
        let font = Type::new(SMALL, Side::Start, Side::Middle);
        for tick in &self.axis.ticks {
            let y = bottom - (bottom - top) * self.axis.place(tick.value);
            let mark = if tick.label.is_some() { 4.0 } else { 2.5 };
            canvas.line(&[(right, y), (right + mark, y)], pen);
            if let Some(label) = &tick.label {
                canvas.text((right + 7.0, y), label, font);
            }
        }
        let font = Type::new(LABEL, Side::Middle, Side::Start).upwards();
        let beside = right + 7.0 + self.axis.label_width() + 6.0;
        canvas.text((beside, 0.5 * (top + bottom)), &self.axis.label, font);
    }
}
