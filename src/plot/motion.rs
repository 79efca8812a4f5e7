//! Figures of one motion: the rod's shapes in the plane, and the ledger against time.

use super::axes::{Axis, Mark, Panel, ROOM_BELOW, draw_mark, extent, room_left};
use super::canvas::{Canvas, Pen, draw};
use super::data::{AxisUnits, Curve};
use super::legend::{ColourBar, Entry, Key, Legend};
use super::page::{Column, WIDTH, head, top};
use super::palette::{ALARM, Colour, GREY, INK, category, line_colours, sequential_line};
use crate::error::{Error, Result};

/// The rod at one time.
#[derive(Debug, Clone, Default, PartialEq)]
pub struct Shape {
    /// When.
    pub time: f64,
    /// Its axis from the clamp to the mass; about 100 points.
    pub axis: Curve,
}

/// A motion in the plane.
#[derive(Debug, Clone, Default, PartialEq)]
pub struct Snapshots {
    /// The rod at some times; six to twelve can be told apart. Draw the two shapes of a snap as two of them.
    pub shapes: Vec<Shape>,
    /// The path of the mass.
    pub path: Curve,
    /// Fold curves of the region that is visited.
    pub folds: Vec<Curve>,
    /// Where the rod snaps.
    pub snaps: Vec<[f64; 2]>,
    /// Units and the rod's length.
    pub units: AxisUnits,
}

/// Draws the rod's shapes, coloured by time, with the path of the mass, folds and snaps as SVG.
///
/// Errs if there is no shape with a finite point and a finite time.
pub fn snapshots(data: &Snapshots) -> Result<String> {
    let shapes: Vec<&Shape> = data
        .shapes
        .iter()
        .filter(|s| s.time.is_finite() && s.axis.has_points())
        .collect();
    let (first, last) = extent(shapes.iter().map(|s| &s.time))
        .ok_or_else(|| Error::domain("figure of snapshots: no shape to show"))?;
    let span = if last > first { last - first } else { 1.0 };
    let tone = |t: f64| sequential_line((t - first) / span);
    let times = Axis::linear(first, first + span, &data.units.time_of("time t"), 6);
    let colours = line_colours();
    let bar = ColourBar::new(&times, &colours);

    let mut entries = Vec::new();
    if data.path.has_points() {
        entries.push(Entry::new(Key::Line(PATH), "path of the mass"));
    }
    if data.folds.iter().any(Curve::has_points) {
        entries.push(Entry::new(Key::Line(FOLD), "fold"));
    }
    if !data.snaps.is_empty() {
        entries.push(Entry::new(Key::Mark(Mark::Cross, ALARM), "snap"));
    }
    let mut panel = disc_panel(&data.units, 430.0);
    let legend = Legend::new(entries, panel.width);
    panel.top = top("", &legend);
    let width = panel.right() + 22.0 + bar.width();
    Ok(draw(width, panel.bottom() + ROOM_BELOW, |canvas| {
        head(canvas, "", &legend, panel.left);
        disc_ground(canvas, &panel, data.units.radius());
        for fold in &data.folds {
            panel.line(canvas, &fold.x, &fold.y, FOLD);
        }
        panel.line(canvas, &data.path.x, &data.path.y, PATH);
        for shape in &shapes {
            let pen = Pen::new(tone(shape.time), 1.8);
            panel.line(canvas, &shape.axis.x, &shape.axis.y, pen);
        }
        for shape in &shapes {
            let points = panel.pixels(&shape.axis.x, &shape.axis.y);
            let tip = points.iter().rev().find(|p| p.0.is_finite());
            if let Some(&tip) = tip.filter(|p| panel.holds(**p)) {
                draw_mark(canvas, tip, Mark::Disc, 5.0, tone(shape.time));
            }
        }
        for snap in &data.snaps {
            let at = panel.at(snap[0], snap[1]);
            if panel.holds(at) {
                draw_mark(canvas, at, Mark::Cross, 4.5, ALARM);
            }
        }
        clamp(canvas, panel.at(0.0, 0.0));
        panel.frame(canvas);
        let (top, bottom) = (panel.top + 20.0, panel.bottom() - 20.0);
        bar.draw(canvas, panel.right() + 22.0, top, bottom);
    }))
}

const PATH: Pen = Pen::new(Colour(60, 60, 60), 0.9);
const FOLD: Pen = Pen::new(ALARM, 1.0).dashed(5.0, 3.5);

/// A square panel a little larger than the disc.
pub(crate) fn disc_panel(units: &AxisUnits, side: f64) -> Panel {
    let reach = 1.08 * units.radius();
    let y = Axis::linear(-reach, reach, &units.length_of("y"), 5);
    Panel {
        left: room_left(&y),
        top: 10.0,
        width: side,
        height: side,
        x: Axis::linear(-reach, reach, &units.length_of("x"), 5),
        y,
    }
}

/// The points of a circle about the origin.
pub(crate) fn circle(radius: f64) -> Curve {
    Curve::new((0..=240).map(|i| {
        let (sin, cos) = (i as f64 * std::f64::consts::TAU / 240.0).sin_cos();
        [radius * cos, radius * sin]
    }))
}

/// The disc that the free end cannot leave.
pub(crate) fn disc_ground(canvas: &mut Canvas, panel: &Panel, radius: f64) {
    let rim = circle(radius);
    let pixels = panel.pixels(&rim.x, &rim.y);
    canvas.polygon(&pixels, Colour(247, 247, 247), 1.0);
    canvas.line(&pixels, Pen::new(GREY, 0.9));
}

/// The wall at the origin that holds the rod along +x.
pub(crate) fn clamp(canvas: &mut Canvas, at: (f64, f64)) {
    let half = 13.0;
    for i in 0..6 {
        let y = at.1 - half + (i as f64 + 0.8) * 2.0 * half / 6.0;
        canvas.line(&[(at.0 - 6.0, y + 5.0), (at.0, y)], Pen::new(INK, 0.8));
    }
    canvas.line(
        &[(at.0, at.1 - half), (at.0, at.1 + half)],
        Pen::new(INK, 2.0),
    );
}

/// The ledger of a motion: every vector as long as `time`, or empty to leave it out.
#[derive(Debug, Clone, Default, PartialEq)]
pub struct Energies {
    /// Times, rising; two equal ones at a snap.
    pub time: Vec<f64>,
    /// Kinetic energy of the mass.
    pub kinetic: Vec<f64>,
    /// Elastic energy of the rod.
    pub elastic: Vec<f64>,
    /// Potential energy of the loads.
    pub potential: Vec<f64>,
    /// Energy lost in snaps and to friction so far.
    pub dissipated: Vec<f64>,
    /// Work of the driven clamp and of time-dependent loads so far.
    pub work: Vec<f64>,
    /// Kinetic + elastic + potential.
    pub total: Vec<f64>,
    /// Error of the ledger: what kinetic + elastic + potential + dissipated - work has changed by.
    pub error: Vec<f64>,
    /// Times of snaps.
    pub snaps: Vec<f64>,
    /// Units.
    pub units: AxisUnits,
}

/// Draws the energies against time and, below, the size of the ledger's error on a logarithmic scale,
/// as SVG; snaps are vertical lines.
///
/// Errs if there are not two finite times or no energies.
pub fn energies(data: &Energies) -> Result<String> {
    let (start, end) = extent(&data.time)
        .filter(|(start, end)| end > start)
        .ok_or_else(|| Error::domain("figure of energies: no span of time"))?;
    let all = [
        ("kinetic", &data.kinetic),
        ("elastic", &data.elastic),
        ("potential", &data.potential),
        ("dissipated", &data.dissipated),
        ("work", &data.work),
        ("total mechanical", &data.total),
    ];
    let curves: Vec<(&str, &Vec<f64>, Pen)> = all
        .into_iter()
        .zip([0, 1, 2, 3, 4, 6])
        .filter(|((_, values), _)| !values.is_empty())
        .map(|((name, values), colour)| {
            let pen = match name {
                "total mechanical" => Pen::new(INK, 1.6),
                "work" => Pen::new(category(colour), 1.5).dashed(6.0, 4.0),
                _ => Pen::new(category(colour), 1.5),
            };
            (name, values, pen)
        })
        .collect();
    let values = curves.iter().flat_map(|(_, values, _)| values.iter());
    let y = Axis::fit(values, false, &data.units.energy_of("energy"), 6)
        .ok_or_else(|| Error::domain("figure of energies: no energy to show"))?;
    let (floor, error_axis) = error_scale(&data.error, &data.units);

    let mut entries: Vec<Entry> = curves
        .iter()
        .map(|(name, _, pen)| Entry::new(Key::Line(*pen), *name))
        .collect();
    if !data.snaps.is_empty() {
        entries.push(Entry::new(Key::Line(SNAP), "snap"));
    }
    let x = Axis::linear(start, end, &data.units.time_of("time t"), 8);
    let axes = vec![(y, 250.0), (error_axis, 110.0)];
    let page = Column::new(WIDTH, "", vec![entries], &x, axes);
    let sizes: Vec<f64> = data.error.iter().map(|e| e.abs().max(floor)).collect();
    Ok(page.draw(|canvas, row, panel| {
        for &snap in &data.snaps {
            let ends = [panel.y.lo, panel.y.hi];
            panel.line(canvas, &[snap, snap], &ends, SNAP);
        }
        if row == 0 {
            for (_, values, pen) in &curves {
                panel.line(canvas, &data.time, values, *pen);
            }
        } else {
            panel.line(canvas, &data.time, &sizes, Pen::new(category(0), 1.0));
        }
    }))
}

const SNAP: Pen = Pen::new(ALARM, 0.9).dashed(4.0, 3.0);

/// The axis of |error|, and the size at which smaller errors (and none) are drawn.
fn error_scale(error: &[f64], units: &AxisUnits) -> (f64, Axis) {
    let sizes: Vec<f64> = error.iter().map(|e| e.abs()).filter(|e| *e > 0.0).collect();
    let (lo, hi) = extent(&sizes).unwrap_or((1e-17, 1e-15));
    // Ten decades at most: the rare step that happens to be exact says nothing.
    let top = 10f64.powf((hi.log10() + 0.2).ceil()).clamp(1e-290, 1e300);
    let bottom = 10f64.powf(lo.log10().floor()).max(1e-10 * top);
    let label = units.energy_of("|error|");
    (bottom, Axis::log(bottom, top.max(10.0 * bottom), &label, 4))
}
