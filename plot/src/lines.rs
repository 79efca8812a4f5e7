//! Curves over a pair of axes: work-precision plots, orders of convergence and every small figure.

use super::axes::Axis;
use super::data::{Series, as_many};
use super::energies::{SNAP, snap_lines};
use super::geometry::Pixel;
use super::legend::{Entry, Key, PlottedCurve, named};
use super::page::{Height, Page, PageBlock, WIDTH, Width};
use super::paper::Paper;
use super::slopes::{self, Slope};
use snaprod_core::error::{Error, Result};

/// A figure of curves.
#[derive(Debug, Clone, Default, PartialEq)]
pub struct Lines {
    /// Title over the figure; may be empty.
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
    /// True for equal scales of x and y (both axes linear), as for positions.
    pub equal: bool,
    /// Reference slopes: thin triangles placed off the data (both axes logarithmic).
    pub slopes: Vec<Slope>,
}

const FIGURE: &str = "figure of lines";
/// Number of small multiples beside each other.
const ACROSS: usize = 3;

/// Draws curves over linear or logarithmic axes as SVG.
///
/// Fails if a series has not as many ordinates as abscissae, or if no point can be shown. Fails also if a
/// slope is not finite, names no series or stands over an axis that is not logarithmic.
pub fn lines(data: &Lines, paper: &Paper) -> Result<String> {
    data.check()?;
    let [x, y] = axes(std::slice::from_ref(data), 6)?;
    let height = if data.equal && !data.x_log && !data.y_log {
        Height::Equal(80.0, 1100.0)
    } else {
        Height::Pixels(360.0)
    };
    let curves = data.curves();
    let page = Page::new("Curves", &data.title, vec![named(&curves)]);
    let block = PageBlock::plane(x, y, height, curves).under(|canvas, panel| {
        let curves = data.series.iter().map(|s| panel.pixels(&s.x, &s.y));
        slopes::draw(
            canvas,
            panel,
            &data.slopes,
            &curves.collect::<Vec<Vec<Pixel>>>(),
        );
    });
    page.column(Width::Whole(600.0), vec![block]).draw(paper)
}

/// Draws small multiples as SVG: panels in rows of three, each under its title, over common axes that hold
/// the points of all. Labels and scales are those of the first panel. Curves of the same name have one entry
/// in the legend. Slopes and `equal` are ignored.
///
/// Fails as [`lines`] does, and if there is no panel.
pub fn small_multiples(title: &str, panels: &[Lines], paper: &Paper) -> Result<String> {
    panels.iter().try_for_each(Lines::check)?;
    let [x, y] = axes(panels, 4)?;
    let mut legend: Vec<Entry> = Vec::new();
    for entry in panels.iter().flat_map(|panel| named(&panel.curves())) {
        if !legend.iter().any(|other| other.text() == entry.text()) {
            legend.push(entry);
        }
    }
    let mut page = Page::new("Curves", title, vec![legend]);
    for column in 0..panels.len().min(ACROSS) {
        let panels = panels.iter().skip(column).step_by(ACROSS);
        let blocks = panels.map(|panel| {
            let curves = panel.curves();
            let mut block = PageBlock::plane(x.clone(), y.clone(), Height::Pixels(170.0), curves);
            block.title = &panel.title;
            block
        });
        page = page.column(Width::Panels(225.0), blocks.collect());
    }
    page.draw(paper)
}

/// Draws panels one over another as SVG, each with its own y axis, over one x axis that holds the points of all. The
/// x axis is that of the first panel. Curves have their colours from their place in the whole figure. Titles, slopes
/// and `equal` of the panels are ignored. `marks` are places on the x axis, with a vertical line each; `mark` is their
/// name in the legend.
///
/// Fails as [`lines`] does, and if there is no panel.
pub fn stacked(
    title: &str,
    panels: &[Lines],
    (marks, mark): (&[f64], &str),
    paper: &Paper,
) -> Result<String> {
    panels.iter().try_for_each(Lines::check)?;
    let [x, _] = axes(panels, 6)?;
    let mut legend: Vec<Entry> = Vec::new();
    let mut blocks = Vec::new();
    let mut drawn = 0;
    for panel in panels {
        let [_, y] = axes(std::slice::from_ref(panel), 5)?;
        let series = panel.series.iter().enumerate();
        let curves: Vec<PlottedCurve> = series.map(|(i, s)| s.drawn(drawn + i, 1.5)).collect();
        drawn += curves.len();
        legend.extend(named(&curves));
        let block = PageBlock::plane(x.clone(), y, Height::Pixels(150.0), curves);
        blocks.push(block.under(move |canvas, panel| snap_lines(canvas, panel, marks)));
    }
    if !marks.is_empty() {
        legend.push(Entry::new(Key::Line(SNAP), mark));
    }
    let page = Page::new("Curves", title, vec![legend]);
    page.column(Width::Whole(WIDTH), blocks).draw(paper)
}

impl Lines {
    fn check(&self) -> Result<()> {
        for (i, series) in self.series.iter().enumerate() {
            let (field, count) = (format!("series[{i}].y"), series.x.len());
            as_many(FIGURE, &field, series.y.len(), count, "abscissae")?;
        }
        let count = self.series.len();
        for (i, slope) in self.slopes.iter().enumerate() {
            let there = slope.series.is_none_or(|s| s < count) && self.x_log && self.y_log;
            if !(slope.order.abs() <= 100.0 && there) {
                return Err(Error::domain(format!(
                    "{FIGURE}: slopes[{i}] has order {} at series {:?}; it needs a number within ±100, one of {count} series \
                     and logarithmic axes",
                    slope.order, slope.series,
                )));
            }
        }
        Ok(())
    }

    fn curves(&self) -> Vec<PlottedCurve> {
        let series = self.series.iter().enumerate();
        series.map(|(i, s)| s.drawn(i, 1.5)).collect()
    }
}

/// Axes with the labels and scales of the first panel that hold the points of all, with about so many
/// `numbers` if linear.
fn axes(panels: &[Lines], numbers: usize) -> Result<[Axis; 2]> {
    let nothing = || Error::domain(format!("{FIGURE}: no point to show"));
    let first = panels.first().ok_or_else(nothing)?;
    // Logarithms of values outside these bounds have no margin left.
    let shown = |log: bool, v: f64| v.is_finite() && (!log || (1e-290..1e290).contains(&v));
    let series = panels.iter().flat_map(|panel| &panel.series);
    let points = series.flat_map(|s| s.x.iter().zip(&s.y));
    let points = points.filter(|(x, y)| shown(first.x_log, **x) && shown(first.y_log, **y));
    let (xs, ys): (Vec<f64>, Vec<f64>) = points.unzip();
    let ticks = |log: bool| if log { 12 } else { numbers };
    let x = Axis::fit(&xs, first.x_log, &first.x_label, ticks(first.x_log));
    let y = Axis::fit(&ys, first.y_log, &first.y_label, ticks(first.y_log));
    x.zip(y).map(|(x, y)| [x, y]).ok_or_else(nothing)
}
