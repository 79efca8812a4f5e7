//! Curves over a pair of axes: work-precision plots, orders of convergence and every small figure.

use super::axes::Axis;
use super::data::{Series, as_many};
use super::geometry::Pixel;
use super::legend::{Drawn, named};
use super::page::{Block, Height, Page, Width};
use super::paper::Paper;
use super::slopes::{self, Slope};
use snaprod_core::error::{Error, Result};

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
    /// Reference slopes, thin triangles put where they cover no data (both axes logarithmic).
    pub slopes: Vec<Slope>,
}

const FIGURE: &str = "figure of lines";

/// Draws curves over linear or logarithmic axes as SVG.
///
/// Errs if a series has not as many ordinates as abscissae, if a slope is not finite, names no series or stands over an
/// axis that is not logarithmic, or if no point can be shown.
pub fn lines(data: &Lines, paper: &Paper) -> Result<String> {
    for (i, series) in data.series.iter().enumerate() {
        let (field, count) = (format!("series[{i}].y"), series.x.len());
        as_many(FIGURE, &field, series.y.len(), count, "abscissae")?;
    }
    let count = data.series.len();
    for (i, slope) in data.slopes.iter().enumerate() {
        let there = slope.series.is_none_or(|s| s < count) && data.x_log && data.y_log;
        if !(slope.order.abs() <= 100.0 && there) {
            return Err(Error::domain(format!(
                "{FIGURE}: slopes[{i}] has order {} at series {:?}; it needs a number within ±100, one of {count} series \
                 and logarithmic axes",
                slope.order, slope.series,
            )));
        }
    }
    // Logarithms of what lies outside these have no margin left.
    let shown = |log: bool, v: f64| v.is_finite() && (!log || (1e-290..1e290).contains(&v));
    let points = data.series.iter().flat_map(|s| s.x.iter().zip(&s.y));
    let points = points.filter(|(x, y)| shown(data.x_log, **x) && shown(data.y_log, **y));
    let (xs, ys): (Vec<f64>, Vec<f64>) = points.unzip();
    let nothing = || Error::domain(format!("{FIGURE}: no point to show"));
    let ticks = |log: bool| if log { 12 } else { 6 };
    let x = Axis::fit(&xs, data.x_log, &data.x_label, ticks(data.x_log)).ok_or_else(nothing)?;
    let y = Axis::fit(&ys, data.y_log, &data.y_label, ticks(data.y_log)).ok_or_else(nothing)?;
    let height = match data.equal && !data.x_log && !data.y_log {
        true => Height::Equal(80.0, 1100.0),
        false => Height::Pixels(360.0),
    };
    let series = data.series.iter().enumerate();
    let curves: Vec<Drawn> = series.map(|(i, s)| s.drawn(i, 1.5)).collect();
    let legend = vec![named(&curves)];
    let block = Block::plane(x, y, height, curves).under(|canvas, panel| {
        let curves = data.series.iter().map(|s| panel.pixels(&s.x, &s.y));
        slopes::draw(
            canvas,
            panel,
            &data.slopes,
            &curves.collect::<Vec<Vec<Pixel>>>(),
        );
    });
    let page = Page::new("Curves", &data.title, legend);
    page.column(Width::Whole(600.0), vec![block]).draw(paper)
}
