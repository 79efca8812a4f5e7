//! Curves over a pair of axes: work-precision plots and every small figure.

use super::axes::{Axis, Panel, ROOM_BELOW, draw_mark, mark, room_left};
use super::canvas::{Pen, draw};
use super::legend::{Entry, Key, Legend};
use super::palette::category;
use crate::error::{Error, Result};

/// How a series is drawn.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub enum Trace {
    /// A line.
    #[default]
    Line,
    /// A dashed line.
    Dashed,
    /// Marks alone.
    Marks,
    /// A line with marks.
    LineMarks,
}

/// One named curve; points that are not finite break it.
#[derive(Debug, Clone, Default, PartialEq)]
pub struct Series {
    /// Its name in the legend; without one it is left out there.
    pub name: String,
    /// Abscissae.
    pub x: Vec<f64>,
    /// Ordinates.
    pub y: Vec<f64>,
    /// How it is drawn.
    pub trace: Trace,
    /// Which colour (and mark) of the palette; by default its place in the list.
    pub colour: Option<usize>,
}

/// A figure of curves.
#[derive(Debug, Clone, Default, PartialEq)]
pub struct Lines {
    /// Written over the figure; may be empty.
    pub title: String,
    /// The name of the x axis, with its unit.
    pub x_label: String,
    /// The name of the y axis, with its unit.
    pub y_label: String,
    /// Logarithmic x axis: values that are not positive are left out.
    pub x_log: bool,
    /// Logarithmic y axis: values that are not positive are left out.
    pub y_log: bool,
    /// The curves.
    pub series: Vec<Series>,
    /// One unit of x as long as one of y (both axes linear): for positions.
    pub equal: bool,
}

/// Draws curves over linear or logarithmic axes as SVG.
///
/// Errs if no point can be shown.
pub fn lines(data: &Lines) -> Result<String> {
    const WIDTH: f64 = 600.0;
    let shown = |log: bool, v: f64| v.is_finite() && (!log || v > 0.0);
    let points: Vec<(f64, f64)> = data
        .series
        .iter()
        .flat_map(|s| s.x.iter().copied().zip(s.y.iter().copied()))
        .filter(|p| shown(data.x_log, p.0) && shown(data.y_log, p.1))
        .collect();
    let (xs, ys): (Vec<f64>, Vec<f64>) = points.into_iter().unzip();
    let nothing = || Error::domain("figure of lines: no point to show");
    let x = Axis::fit(&xs, data.x_log, &data.x_label, 6).ok_or_else(nothing)?;
    let y = Axis::fit(&ys, data.y_log, &data.y_label, 6).ok_or_else(nothing)?;
    let left = room_left(&y);
    let width = WIDTH - left - 18.0;
    let height = if data.equal && !data.x_log && !data.y_log {
        (width * (y.hi - y.lo) / (x.hi - x.lo)).clamp(80.0, 2.0 * width)
    } else {
        340.0
    };
    let entries = data
        .series
        .iter()
        .enumerate()
        .filter(|(_, s)| !s.name.is_empty());
    let legend = Legend::new(
        entries
            .map(|(i, s)| Entry::new(key(s, i), s.name.as_str()))
            .collect(),
        width,
    );
    let title = if data.title.is_empty() { 0.0 } else { 24.0 };
    let top = 10.0 + title + legend.height();
    let panel = Panel {
        left,
        top,
        width,
        height,
        x,
        y,
    };
    Ok(draw(WIDTH, top + height + ROOM_BELOW, |canvas| {
        if title > 0.0 {
            let over = Panel {
                top: 10.0 + title,
                ..panel.clone()
            };
            over.title(canvas, &data.title);
        }
        legend.draw(canvas, left, 8.0 + title);
        panel.grid(canvas);
        for (i, series) in data.series.iter().enumerate() {
            if series.trace != Trace::Marks {
                panel.line(canvas, &series.x, &series.y, pen(series, i));
            }
        }
        for (i, series) in data.series.iter().enumerate() {
            if matches!(series.trace, Trace::Marks | Trace::LineMarks) {
                let look = series.colour.unwrap_or(i);
                for at in panel.pixels(&series.x, &series.y) {
                    if panel.holds(at) {
                        draw_mark(canvas, at, mark(look), 3.6, category(look));
                    }
                }
            }
        }
        panel.frame(canvas);
    }))
}

fn pen(series: &Series, i: usize) -> Pen {
    let pen = Pen::new(category(series.colour.unwrap_or(i)), 1.5);
    match series.trace {
        Trace::Dashed => pen.dashed(6.0, 4.0),
        _ => pen,
    }
}

fn key(series: &Series, i: usize) -> Key {
    let look = series.colour.unwrap_or(i);
    match series.trace {
        Trace::Line | Trace::Dashed => Key::Line(pen(series, i)),
        Trace::Marks => Key::Mark(mark(look), category(look)),
        Trace::LineMarks => Key::LineMark(pen(series, i), mark(look)),
    }
}
