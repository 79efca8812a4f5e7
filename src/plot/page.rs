//! The scaffold of a figure: a title, a legend, and under them panels in a column over one horizontal axis.

use super::axes::{Axis, Panel, ROOM_BELOW, TITLE, room_left};
use super::canvas::{Canvas, Side, Type, draw};
use super::legend::{Entry, Legend};

/// The usual width of a figure, in pixels.
pub(crate) const WIDTH: f64 = 640.0;
/// From a panel to the right edge of the figure.
pub(crate) const ROOM_RIGHT: f64 = 18.0;
/// From the upper edge of the figure, or from its title, to the legend and to a panel without one.
pub(crate) const ABOVE_LEGEND: f64 = 6.0;
const ABOVE: f64 = 10.0;
/// Between panels that share an axis.
const GAP: f64 = 14.0;

/// The height that a title takes.
pub(crate) fn title_height(title: &str) -> f64 {
    if title.is_empty() { 0.0 } else { 24.0 }
}

/// Writes the title of a figure.
pub(crate) fn heading(canvas: &mut Canvas, title: &str, left: f64) {
    let font = Type::new(TITLE, Side::Start, Side::End);
    canvas.text((left, 23.0), title, font);
}

/// The upper edge of the panel under a title and a legend.
pub(crate) fn top(title: &str, legend: &Legend) -> f64 {
    ABOVE + title_height(title) + legend.height()
}

/// Writes the title and the legend, both flush left.
pub(crate) fn head(canvas: &mut Canvas, title: &str, legend: &Legend, left: f64) {
    heading(canvas, title, left);
    legend.draw(canvas, left, ABOVE_LEGEND + title_height(title));
}

/// The room that the widest of some vertical axes takes at its left.
pub(crate) fn room(axes: &[(Axis, f64)]) -> f64 {
    axes.iter()
        .map(|(axis, _)| room_left(axis))
        .fold(0.0, f64::max)
}

/// Panels over one horizontal axis.
pub(crate) struct Column<'a> {
    title: &'a str,
    width: f64,
    legend: Legend,
    panels: Vec<Panel>,
}

impl<'a> Column<'a> {
    /// A figure of this width; each group of entries begins a row of the legend. `axes` are the vertical axes of the panels
    /// from top to bottom, with the panels' heights.
    pub(crate) fn new(
        width: f64,
        title: &'a str,
        groups: Vec<Vec<Entry>>,
        x: &Axis,
        axes: Vec<(Axis, f64)>,
    ) -> Self {
        let left = room(&axes);
        let inner = width - left - ROOM_RIGHT;
        let legend = Legend::grouped(groups, inner);
        let mut below = top(title, &legend);
        let last = axes.len().saturating_sub(1);
        let row = |(i, (y, height)): (usize, (Axis, f64))| {
            let panel = Panel {
                left,
                top: below,
                width: inner,
                height,
                // Only the lowest has the numbers and the name.
                x: if i == last { x.clone() } else { x.bare() },
                y,
            };
            below = panel.bottom() + GAP;
            panel
        };
        Self {
            title,
            width,
            legend,
            panels: axes.into_iter().enumerate().map(row).collect(),
        }
    }

    /// Draws all panels, each with its data between its grid and its frame.
    pub(crate) fn draw(&self, mut paint: impl FnMut(&mut Canvas, usize, &Panel)) -> String {
        let (left, bottom) = match self.panels.last() {
            Some(panel) => (panel.left, panel.bottom()),
            None => (0.0, 0.0),
        };
        draw(self.width, bottom + ROOM_BELOW, |canvas| {
            head(canvas, self.title, &self.legend, left);
            for (i, panel) in self.panels.iter().enumerate() {
                panel.grid(canvas);
                paint(canvas, i, panel);
                panel.frame(canvas);
            }
        })
    }
}
