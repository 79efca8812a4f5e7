//! Rods in space: centrelines, ribbons that show the twist, clamps, triads.

use super::axes::{Axis, extent};
use super::canvas::draw;
use super::data::View;
use super::legend::{ColourBar, Entry, Key, Legend};
use super::page::{ABOVE_LEGEND, WIDTH, head, title_height};
use super::painter::Painter;
use super::palette::{Colour, INK, category, line_colours, sequential_line};
use super::scenery::{RodUnits, Scenery, SpaceRod, pen};
use crate::error::Result;

/// Rods in space.
#[derive(Debug, Clone, PartialEq)]
pub struct RodShapes {
    /// Written over the figure; may be empty.
    pub title: String,
    /// The rods.
    pub rods: Vec<SpaceRod>,
    /// What [`SpaceRod::value`] is, with its unit.
    pub value_label: String,
    /// The width of the strip along d1 that shows the twist, as a length; 0 for a line alone.
    pub ribbon: f64,
    /// Draws the plate that holds the first point.
    pub clamp: bool,
    /// Draws the directors at the last point, if given.
    pub triads: bool,
    /// Where from; by default the side from which the shapes are seen best.
    pub view: Option<View>,
    /// Units.
    pub units: RodUnits,
}

impl Default for RodShapes {
    /// No rods; lines with clamps and triads.
    fn default() -> Self {
        Self {
            title: String::new(),
            rods: Vec::new(),
            value_label: String::new(),
            ribbon: 0.0,
            clamp: true,
            triads: true,
            view: None,
            units: RodUnits::default(),
        }
    }
}

/// Draws rods in true perspective, at equal scales in x, y and z, as SVG. What is nearer is thicker and cuts a
/// white rim into what it crosses. A rod without a triad at its end has a disc there. A single rod, if
/// not plane, throws a shadow on the floor.
///
/// Errs if there is no rod with a finite point.
pub fn rod_shapes(data: &RodShapes) -> Result<String> {
    const HEIGHT: f64 = 500.0;
    let values: Vec<f64> = data.rods.iter().filter_map(|rod| rod.value).collect();
    let range = extent(&values).map(|(lo, hi)| if hi > lo { (lo, hi) } else { (lo, lo + 1.0) });
    let range = range.filter(|(lo, hi)| (hi - lo).is_finite() && hi > lo);
    let colour = |i: usize| rod_colour(&data.rods[i], i, range);
    let scale = range.map(|(lo, hi)| Axis::linear(lo, hi, &data.value_label, 6));
    let colours = line_colours();
    let bar = scale.as_ref().map(|axis| ColourBar::new(axis, &colours));

    let mut scenery = Scenery::new(&data.rods, data.ribbon, data.clamp, data.triads)?;
    let legend = Legend::new(entries(data, &colour), WIDTH - 60.0);
    let top = ABOVE_LEGEND + title_height(&data.title) + legend.height();
    scenery.view = data.view;
    let stage = scenery.stage(&data.units.axes(), [0.0, top, WIDTH, HEIGHT]);
    // A flat box does not need all of it.
    let least = if bar.is_some() { 260.0 } else { 120.0 };
    let height = stage.height().clamp(least, HEIGHT);
    let stage = scenery.stage(&data.units.axes(), [0.0, top, WIDTH, height]);
    let width = WIDTH + bar.as_ref().map_or(0.0, |bar| 8.0 + bar.width());
    Ok(draw(width, top + height, |canvas| {
        head(canvas, &data.title, &legend, 30.0);
        stage.walls(canvas);
        let mut painter = Painter::new(&stage, !scenery.plane);
        for (i, rod) in data.rods.iter().enumerate() {
            painter.rod(rod, colour(i), &scenery);
        }
        painter.paint(canvas);
        stage.axes(canvas);
        if let Some(bar) = &bar {
            let inset = 0.12 * height;
            bar.draw(canvas, WIDTH + 8.0, top + inset, top + height - inset);
        }
    }))
}

fn rod_colour(rod: &SpaceRod, i: usize, range: Option<(f64, f64)>) -> Colour {
    match (rod.value.filter(|v| v.is_finite()), range) {
        (Some(value), Some((lo, hi))) => sequential_line((value - lo) / (hi - lo)),
        _ => category(rod.colour.unwrap_or(i)),
    }
}

/// Names, and what thin lines mean.
fn entries(data: &RodShapes, colour: &impl Fn(usize) -> Colour) -> Vec<Entry> {
    let seen = |rod: &&SpaceRod| rod.ends().is_some();
    let mut entries: Vec<Entry> = data
        .rods
        .iter()
        .enumerate()
        .filter(|(_, rod)| seen(rod) && !rod.name.is_empty())
        .map(|(i, rod)| Entry::new(Key::Line(pen(rod, colour(i))), rod.name.as_str()))
        .collect();
    if data.rods.iter().filter(seen).any(|rod| rod.unstable) {
        for (unstable, word) in [(false, "stable"), (true, "unstable")] {
            if data
                .rods
                .iter()
                .filter(seen)
                .any(|r| r.unstable == unstable)
            {
                let rod = SpaceRod {
                    unstable,
                    ..SpaceRod::default()
                };
                entries.push(Entry::new(Key::Line(pen(&rod, INK)), word));
            }
        }
    }
    entries
}
