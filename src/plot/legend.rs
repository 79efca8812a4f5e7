//! Legends and colour bars. They stand outside the panels, so they never cover data.

use super::axes::{Axis, LABEL, Mark, SMALL, draw_mark};
use super::canvas::{Canvas, Pen, Side, Type};
use super::palette::{Colour, INK};
use super::text;

/// The sample drawn before a legend's word.
#[derive(Debug, Clone, Copy)]
pub(crate) enum Key {
    Line(Pen),
    Mark(Mark, Colour),
    LineMark(Pen, Mark),
    Fill(Colour),
}

/// One word of a legend with its sample.
#[derive(Debug, Clone)]
pub(crate) struct Entry {
    key: Key,
    text: String,
}

impl Entry {
    pub(crate) fn new(key: Key, text: impl Into<String>) -> Self {
        Self {
            key,
            text: text.into(),
        }
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
    /// Breaks the entries into rows no wider than `width` pixels.
    pub(crate) fn new(entries: Vec<Entry>, width: f64) -> Self {
        Self::grouped(vec![entries], width)
    }

    /// The same; each group begins a row.
    pub(crate) fn grouped(groups: Vec<Vec<Entry>>, width: f64) -> Self {
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
                    row.push(entry);
                }
            }
        }
        Self { rows }
    }

    /// The height it takes, with a small gap below.
    pub(crate) fn height(&self) -> f64 {
        match self.rows.len() {
            0 => 0.0,
            n => n as f64 * ROW + 4.0,
        }
    }

    /// Draws it with its upper left corner at (left, top).
    pub(crate) fn draw(&self, canvas: &mut Canvas, left: f64, top: f64) {
        for (i, row) in self.rows.iter().enumerate() {
            let y = top + (i as f64 + 0.5) * ROW;
            let mut x = left;
            for entry in row {
                let end = x + entry.sample_width();
                let mid = (0.5 * (x + end), y);
                match entry.key {
                    Key::Line(pen) => canvas.line(&[(x, y), (end, y)], pen),
                    Key::Mark(mark, colour) => draw_mark(canvas, mid, mark, 4.0, colour),
                    Key::LineMark(pen, mark) => {
                        canvas.line(&[(x, y), (end, y)], pen);
                        draw_mark(canvas, mid, mark, 3.6, pen.colour);
                    }
                    Key::Fill(colour) => {
                        let (t, b) = (y - 5.0, y + 5.0);
                        canvas.polygon(&[(x, t), (end, t), (end, b), (x, b)], colour, 1.0);
                        let pen = Pen::new(INK, 0.5);
                        canvas.line(&[(x, t), (end, t), (end, b), (x, b), (x, t)], pen);
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
pub(crate) struct ColourBar<'a> {
    /// The scale; its label names the quantity.
    pub axis: &'a Axis,
    /// Colours from bottom to top in equal steps.
    pub colours: &'a [Colour],
    /// Draws a point below: values under the scale have the first colour.
    pub open_below: bool,
    /// Draws a point on top: values above the scale have the last colour.
    pub open_above: bool,
}

/// The strip's width.
const STRIP: f64 = 14.0;

impl<'a> ColourBar<'a> {
    /// A strip whose ends are the ends of the scale.
    pub(crate) fn new(axis: &'a Axis, colours: &'a [Colour]) -> Self {
        Self {
            axis,
            colours,
            open_below: false,
            open_above: false,
        }
    }

    /// The room it takes to the right of its left edge.
    pub(crate) fn width(&self) -> f64 {
        STRIP + 8.0 + self.axis.label_width() + 8.0 + LABEL + 8.0
    }

    /// Draws it between top and bottom, from `left` on.
    pub(crate) fn draw(&self, canvas: &mut Canvas, left: f64, top: f64, bottom: f64) {
        let right = left + STRIP;
        let step = (bottom - top) / self.colours.len().max(1) as f64;
        for (i, &colour) in self.colours.iter().enumerate() {
            let low = bottom - i as f64 * step;
            // Reaches a little under the next one, so that no seam shows.
            let high = (low - step - 0.5).max(top);
            canvas.polygon(
                &[(left, low), (right, low), (right, high), (left, high)],
                colour,
                1.0,
            );
        }
        let pen = Pen::new(INK, 0.8);
        let mut outline = vec![(left, top), (left, bottom)];
        if self.open_below {
            let tip = (0.5 * (left + right), bottom + 10.0);
            if let Some(&first) = self.colours.first() {
                canvas.polygon(&[(left, bottom), (right, bottom), tip], first, 1.0);
            }
            outline.push(tip);
        }
        outline.extend([(right, bottom), (right, top)]);
        if self.open_above {
            let tip = (0.5 * (left + right), top - 10.0);
            if let Some(&last) = self.colours.last() {
                canvas.polygon(&[(left, top), (right, top), tip], last, 1.0);
            }
            outline.push(tip);
        }
        outline.push((left, top));
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
