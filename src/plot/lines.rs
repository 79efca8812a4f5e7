//! Curves over a pair of axes: work-precision plots and every small figure.

use super::axes::{Axis, draw_mark, mark, room_left};
use super::canvas::Pen;
use super::legend::{Entry, Key};
use super::page::{Column, ROOM_RIGHT};
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
    let width = WIDTH - room_left(&y) - ROOM_RIGHT;
    let height = if data.equal && !data.x_log && !data.y_log {
        (width * (y.hi - y.lo) / (x.hi - x.lo)).clamp(80.0, 2.0 * width)
    } else {
        340.0
    };
    let named = data.series.iter().enumerate();
    let entries = named
        .filter(|(_, s)| !s.name.is_empty())
        .map(|(i, s)| Entry::new(key(s, i), s.name.as_str()))
        .collect();
    let page = Column::new(WIDTH, &data.title, vec![entries], &x, vec![(y, height)]);
    Ok(page.draw(|canvas, _, panel| {
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
