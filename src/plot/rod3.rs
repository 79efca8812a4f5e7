//! Rods in space: centrelines, ribbons that show the twist, clamps, triads, loads.

use super::axes::{Axis, Panel, extent};
use super::canvas::{Canvas, Pen, draw};
use super::data::{Bounds, View};
use super::legend::{ColourBar, Entry, Key, Legend};
use super::painter::Painter;
use super::palette::{Colour, INK, category, sequential_line};
use super::scene::{Point, cross, minus};
use super::space::{Spread, Stage, along, box_of, drawable, size_of, unit};
use crate::error::{Error, Result};

/// The units written in figures of rods in space.
#[derive(Debug, Clone, PartialEq)]
pub struct RodUnits {
    /// The unit of length; empty, like each of them, for labels without a unit.
    pub length: String,
    /// The unit of force.
    pub force: String,
    /// The unit of couple.
    pub couple: String,
}

/// A name with its unit; without one where the unit is empty.
pub(super) fn labelled(name: &str, unit: &str) -> String {
    if unit.is_empty() {
        name.to_owned()
    } else {
        format!("{name} ({unit})")
    }
}

impl Default for RodUnits {
    /// Length ℓ, force EI/ℓ², couple EI/ℓ.
    fn default() -> Self {
        Self {
            length: "ℓ".into(),
            force: "EI/ℓ²".into(),
            couple: "EI/ℓ".into(),
        }
    }
}

impl RodUnits {
    /// Metres, newtons, newton metres.
    pub fn si() -> Self {
        Self {
            length: "m".into(),
            force: "N".into(),
            couple: "N m".into(),
        }
    }

    pub(crate) fn axes(&self) -> [String; 3] {
        ["x", "y", "z"].map(|name| labelled(name, &self.length))
    }
}

/// One rod in space.
#[derive(Debug, Clone, Default, PartialEq)]
pub struct SpaceRod {
    /// Its name in the legend; without one it is left out there.
    pub name: String,
    /// Its centreline from the clamp on; 100 to 200 points are smooth. A point that is not finite breaks it.
    pub points: Vec<[f64; 3]>,
    /// The directors [d1, d2, d3] at each point; empty if there are none to draw.
    pub directors: Vec<[[f64; 3]; 3]>,
    /// What its colour shows, as the parameter of its branch. Without one (or not finite) the colour is the
    /// palette's.
    pub value: Option<f64>,
    /// Unstable rods are thin and dashed.
    pub unstable: bool,
    /// Which colour of the palette; by default its place in the list.
    pub colour: Option<usize>,
}

impl SpaceRod {
    /// Indices of the first and the last point that can be drawn.
    pub(crate) fn ends(&self) -> Option<(usize, usize)> {
        let first = self.points.iter().position(drawable)?;
        Some((first, self.points.iter().rposition(drawable)?))
    }

    /// The directors at a point, if they are there and finite.
    pub(crate) fn triad(&self, i: usize) -> Option<[Point; 3]> {
        let [a, b, c] = *self.directors.get(i)?;
        Some([unit(a)?, unit(b)?, unit(c)?])
    }

    /// Where the rod points to at its i-th point: by its directors or else its neighbours.
    pub(crate) fn heading(&self, i: usize) -> Option<Point> {
        if let Some([_, _, d3]) = self.triad(i) {
            return Some(d3);
        }
        let ahead = self.points.get(i + 1).filter(|p| drawable(p));
        let behind = i.checked_sub(1).and_then(|j| self.points.get(j));
        match (ahead, behind.filter(|p| drawable(p))) {
            (Some(&ahead), _) => unit(minus(ahead, self.points[i])),
            (None, Some(&behind)) => unit(minus(self.points[i], behind)),
            _ => None,
        }
    }
}

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
    const WIDTH: f64 = 640.0;
    const HEIGHT: f64 = 500.0;
    let values: Vec<f64> = data.rods.iter().filter_map(|rod| rod.value).collect();
    let range = extent(&values).map(|(lo, hi)| if hi > lo { (lo, hi) } else { (lo, lo + 1.0) });
    let range = range.filter(|(lo, hi)| (hi - lo).is_finite() && hi > lo);
    let colour = |i: usize| rod_colour(&data.rods[i], i, range);
    let scale = range.map(|(lo, hi)| Axis::linear(lo, hi, &data.value_label, 6));
    let colours: Vec<Colour> = (0..64).map(|i| sequential_line(i as f64 / 63.0)).collect();
    let bar = scale.as_ref().map(|axis| ColourBar {
        axis,
        colours: &colours,
        open_below: false,
        open_above: false,
    });

    let mut scenery = Scenery::new(&data.rods, data.ribbon, data.clamp, data.triads)?;
    let legend = Legend::new(entries(data, &colour), WIDTH - 60.0);
    let title = if data.title.is_empty() { 0.0 } else { 24.0 };
    let top = 6.0 + title + legend.height();
    scenery.view = data.view;
    let stage = scenery.stage(&data.units.axes(), [0.0, top, WIDTH, HEIGHT]);
    // A flat box does not need all of it.
    let least = if bar.is_some() { 260.0 } else { 120.0 };
    let height = stage.height().clamp(least, HEIGHT);
    let stage = scenery.stage(&data.units.axes(), [0.0, top, WIDTH, height]);
    let width = WIDTH + bar.as_ref().map_or(0.0, |bar| 8.0 + bar.width());
    Ok(draw(width, top + height, |canvas| {
        heading(canvas, &data.title, 30.0, WIDTH);
        legend.draw(canvas, 30.0, 6.0 + title);
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

/// The title of a figure.
pub(crate) fn heading(canvas: &mut Canvas, title: &str, left: f64, width: f64) {
    if !title.is_empty() {
        let nowhere = Axis::linear(0.0, 1.0, "", 1);
        let over = Panel {
            left,
            top: 28.0,
            width,
            height: 0.0,
            x: nowhere.clone(),
            y: nowhere,
        };
        over.title(canvas, title);
    }
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

/// Drawn at the middle of the box.
pub(crate) fn pen(rod: &SpaceRod, colour: Colour) -> Pen {
    if rod.unstable {
        Pen::new(colour, 1.3).dashed(6.0, 3.6)
    } else {
        Pen::new(colour, 2.5)
    }
}

/// What is drawn along with the lines.
pub(crate) struct Scenery {
    /// The width of ribbons.
    pub ribbon: f64,
    pub clamp: bool,
    pub triads: bool,
    /// All rods lie in one plane: what meets there does not pass behind.
    pub plane: bool,
    /// Length of directors.
    pub arm: f64,
    pub shadow: bool,
    pub view: Option<View>,
    best: View,
    content: Bounds,
}

impl Scenery {
    pub(crate) fn new(rods: &[SpaceRod], ribbon: f64, clamp: bool, triads: bool) -> Result<Self> {
        let points = || rods.iter().flat_map(|rod| &rod.points);
        let none = || Error::domain("figure of rods: no rod with a finite point to show");
        let bounds = box_of(points()).ok_or_else(none)?;
        let spread = Spread::new(points()).ok_or_else(none)?;
        let size = size_of(&bounds);
        let ribbon = if ribbon > 0.0 {
            ribbon.min(0.5 * size)
        } else {
            0.0
        };
        let mut scenery = Self {
            ribbon,
            clamp,
            triads,
            plane: spread.is_plane(),
            arm: 0.13 * size,
            shadow: !spread.is_plane() && rods.len() == 1,
            view: None,
            best: spread.view(),
            content: bounds,
        };
        let mut all: Vec<Point> = Vec::new();
        for rod in rods {
            let Some((first, last)) = rod.ends() else {
                continue;
            };
            if clamp {
                all.extend(scenery.plate(rod, first).into_iter().flatten());
            }
            if let Some(triad) = rod.triad(last).filter(|_| triads) {
                all.extend(triad.map(|d| along(rod.points[last], 1.15 * scenery.arm, d)));
            }
            if ribbon > 0.0 {
                for (i, p) in rod.points.iter().enumerate() {
                    if let Some([d1, ..]) = rod.triad(i).filter(|_| drawable(p)) {
                        all.extend([0.5, -0.5].map(|t| along(*p, t * ribbon, d1)));
                    }
                }
            }
        }
        scenery.hold(&all);
        Ok(scenery)
    }

    /// Makes room for more points.
    pub(crate) fn hold(&mut self, points: &[Point]) {
        let corners: [Point; 2] = [0, 1].map(|k| self.content.map(|b| b[k]));
        if let Some(bounds) = box_of(corners.iter().chain(points)) {
            self.content = bounds;
        }
    }

    pub(crate) fn stage(&self, labels: &[String; 3], rectangle: [f64; 4]) -> Stage {
        Stage::new(
            self.content,
            labels,
            self.view.unwrap_or(self.best),
            rectangle,
        )
    }

    /// The corners of the plate that holds a rod's first point: four in front, four behind.
    pub(crate) fn plate(&self, rod: &SpaceRod, first: usize) -> Option<[Point; 8]> {
        let axis = rod.heading(first)?;
        let [a, b] = match rod.triad(first) {
            Some([d1, d2, _]) => [d1, d2],
            None => {
                let other = if axis[2].abs() < 0.9 {
                    [0.0, 0.0, 1.0]
                } else {
                    [1.0, 0.0, 0.0]
                };
                let a = unit(cross(other, axis))?;
                [a, cross(axis, a)]
            }
        };
        let half = (0.5 * self.arm).max(0.8 * self.ribbon);
        let at = |i: usize| {
            let (s, t) = [(-1.0, -1.0), (1.0, -1.0), (1.0, 1.0), (-1.0, 1.0)][i % 4];
            let p = along(along(rod.points[first], s * half, a), t * half, b);
            if i < 4 {
                p
            } else {
                along(p, -0.3 * half, axis)
            }
        };
        Some(std::array::from_fn(at))
    }
}
