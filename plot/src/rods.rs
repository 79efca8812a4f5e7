//! Rods in space: centrelines, ribbons that show the twist, clamps, triads.

use super::canvas::Pen;
use super::data::{AxisUnits, View};
use super::geometry::drawable;
use super::legend::{ColourBar, Entry, Key, Tones};
use super::page::{Page, PageBlock, WIDTH, Width};
use super::painter::Painter;
use super::palette::{Colour, GREY, INK, category};
use super::paper::Paper;
use super::scenery::{
    GROOVE, GROOVE_NAME, OBSTACLE, OBSTACLE_NAME, Scenery, SpaceBody, SpaceRod, pen,
};
use snaprod_core::error::Result;

/// Rods in space.
#[derive(Debug, Clone, PartialEq)]
pub struct RodShapes {
    /// Title over the figure; may be empty.
    pub title: String,
    /// The rods.
    pub rods: Vec<SpaceRod>,
    /// Bodies that the rods carry.
    pub bodies: Vec<SpaceBody>,
    /// Thin lines: the paths of points.
    pub paths: Vec<Vec<[f64; 3]>>,
    /// Lines on obstacles.
    pub obstacles: Vec<Vec<[f64; 3]>>,
    /// Curves that bodies slide in.
    pub grooves: Vec<Vec<[f64; 3]>>,
    /// Name of [`SpaceRod::value`], with its unit.
    pub value_label: String,
    /// Width of the strip along d1 that shows the twist, as a length; 0 for a line alone.
    pub ribbon: f64,
    /// Draws the plate that holds the first point.
    pub clamp: bool,
    /// Draws the directors at the last point, if given.
    pub triads: bool,
    /// Viewpoint; by default the side from which the shapes are seen best.
    pub view: Option<View>,
    /// Units.
    pub units: AxisUnits,
}

impl Default for RodShapes {
    /// No rods; lines with clamps and triads.
    fn default() -> Self {
        Self {
            title: String::new(),
            rods: Vec::new(),
            bodies: Vec::new(),
            paths: Vec::new(),
            obstacles: Vec::new(),
            grooves: Vec::new(),
            value_label: String::new(),
            ribbon: 0.0,
            clamp: true,
            triads: true,
            view: None,
            units: AxisUnits::default(),
        }
    }
}

/// Draws rods in true perspective, at equal scales in x, y and z, as SVG. Nearer things are thicker and cut a
/// white rim into things behind. A rod end without a triad has a disc, unless it is on the ground. A single
/// rod, if not plane, throws a shadow on the floor.
///
/// Fails if there is no rod with a finite point.
pub fn rod_shapes(data: &RodShapes, paper: &Paper) -> Result<String> {
    const HEIGHT: f64 = 500.0;
    let tones = Tones::over(data.rods.iter().filter_map(|rod| rod.value.as_ref()));
    let colour = |i: usize| toned(data.rods[i].value, data.rods[i].colour.unwrap_or(i), tones);

    let mut scenery = Scenery::new(&data.rods, data.ribbon, data.clamp, data.triads)?;
    scenery.view = data.view;
    let corners = data.bodies.iter().filter_map(SpaceBody::corners);
    scenery.hold(&corners.flatten().collect::<Vec<_>>());
    for line in data
        .paths
        .iter()
        .chain(&data.grooves)
        .chain(&data.obstacles)
    {
        scenery.hold(line);
    }
    let stage = |place: [f64; 4]| scenery.stage(&data.units, place);
    // A flat box does not need the full height.
    let least = if tones.is_some() { 260.0 } else { 120.0 };
    let needed = stage([0.0, 0.0, WIDTH, HEIGHT]).height();
    let mut block = PageBlock::space(needed.clamp(least, HEIGHT), stage, |canvas, stage| {
        let mut painter = Painter::new(stage, !scenery.plane);
        for groove in &data.grooves {
            painter.path(groove, GROOVE);
        }
        for line in &data.obstacles {
            painter.path(line, OBSTACLE);
        }
        for path in &data.paths {
            painter.path(path, Pen::new(GREY.tint(0.35), 0.9));
        }
        for (i, rod) in data.rods.iter().enumerate() {
            painter.rod(rod, colour(i), &scenery);
        }
        for (i, body) in data.bodies.iter().enumerate() {
            painter.body(body, toned(body.value, body.colour.unwrap_or(i), tones));
        }
        painter.paint(canvas);
    });
    block.bar = tones.map(|tones| tones.bar(&data.value_label));
    let width = WIDTH + block.bar.as_ref().map_or(0.0, ColourBar::width);
    let page = Page::new("Rods in space", &data.title, vec![entries(data, &colour)]);
    page.column(Width::Whole(width), vec![block]).draw(paper)
}

fn toned(value: Option<f64>, category_of: usize, tones: Option<Tones>) -> Colour {
    match (value.filter(|v| v.is_finite()), tones) {
        (Some(value), Some(tones)) => tones.colour(value),
        _ => category(category_of),
    }
}

/// Legend entries: names, and the meaning of thin lines.
fn entries(data: &RodShapes, colour: &impl Fn(usize) -> Colour) -> Vec<Entry> {
    let seen = data
        .rods
        .iter()
        .enumerate()
        .filter(|(_, rod)| rod.ends().is_some());
    let named = seen.clone().filter(|(_, rod)| !rod.name.is_empty());
    let named = named.map(|(i, rod)| Entry::new(Key::Line(pen(rod, colour(i))), rod.name.as_str()));
    let mut entries: Vec<Entry> = named.collect();
    let has = |unstable: bool| seen.clone().any(|(_, rod)| rod.unstable == unstable);
    for (unstable, word) in [(false, "stable"), (true, "unstable")] {
        if has(true) && has(unstable) {
            let rod = SpaceRod {
                unstable,
                ..SpaceRod::default()
            };
            entries.push(Entry::new(Key::Line(pen(&rod, INK)), word));
        }
    }
    if data.grooves.iter().flatten().any(drawable) {
        entries.push(Entry::new(Key::Line(GROOVE), GROOVE_NAME));
    }
    if data.obstacles.iter().flatten().any(drawable) {
        entries.push(Entry::new(Key::Line(OBSTACLE), OBSTACLE_NAME));
    }
    entries
}
