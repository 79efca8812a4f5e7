//! Figures of one motion: the rod's shapes in the plane, and the ledger against time.

use super::axes::{Axis, Panel, extent};
use super::canvas::{Canvas, Pen};
use super::data::{AxisUnits, Curve};
use super::geometry::{Pixel, finite, heading};
use super::legend::{Drawn, Entry, Key, Mark, Tones, named};
use super::page::{Block, Height, Page, WIDTH, Width};
use super::palette::{ALARM, Colour, GREY, INK, category};
use snaprod_core::error::{Error, Result};

/// The rod at one time.
#[derive(Debug, Clone, Default, PartialEq)]
pub struct Shape {
    /// When.
    pub time: f64,
    /// Its axis from the clamp to the mass; about 100 points.
    pub axis: Curve,
}

/// Those that can be drawn.
pub(crate) fn seen(shapes: &[Shape]) -> Vec<&Shape> {
    let seen = |s: &&Shape| s.time.is_finite() && s.axis.has_points();
    shapes.iter().filter(seen).collect()
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
    let shapes = seen(&data.shapes);
    let tones = Tones::over(shapes.iter().map(|s| &s.time))
        .ok_or_else(|| Error::domain("figure of snapshots: no shape to show"))?;

    let folds = data.folds.iter().enumerate();
    let name = |i: usize| if i == 0 { "fold" } else { "" };
    let folds = folds.map(|(i, fold)| Drawn::new(Key::Line(FOLD), name(i), &fold.x, &fold.y));
    let path = Drawn::new(
        Key::Line(PATH),
        "path of the mass",
        &data.path.x,
        &data.path.y,
    );
    let path = data.path.has_points().then_some(path);
    let rods = shapes.iter().map(|shape| {
        let pen = Pen::new(tones.colour(shape.time), 1.8);
        Drawn::line_of(pen, &shape.axis.x, &shape.axis.y)
    });
    let curves: Vec<Drawn> = folds.chain(path).chain(rods).collect();
    let mut entries = named(&curves);
    if !data.snaps.is_empty() {
        entries.push(Entry::new(Key::Mark(Mark::Cross, ALARM), "snap"));
    }
    let (x, y) = disc_axes(&data.units);
    let mut block = Block::plane(x, y, Height::Equal(0.0, 1e3), curves)
        .without_grid()
        .under(|canvas, panel| disc_ground(canvas, panel, data.units.radius()))
        .over(|canvas, panel| {
            for shape in &shapes {
                if let Some(tip) = shape.axis.points().next_back() {
                    let tip = panel.at(tip.0, tip.1);
                    panel.mark(canvas, tip, Mark::Disc, 5.0, tones.colour(shape.time));
                }
            }
            for snap in &data.snaps {
                panel.mark(canvas, panel.at(snap[0], snap[1]), Mark::Cross, 4.5, ALARM);
            }
            wall(canvas, panel.at(0.0, 0.0), panel.at(1.0, 0.0), 13.0);
        });
    block.bar = Some(tones.bar(&data.units.time_of("time t")));
    let page = Page::new("", vec![entries]);
    Ok(page.column(Width::Panels(430.0), vec![block]).draw())
}

const PATH: Pen = Pen::new(Colour(60, 60, 60), 0.9);
const FOLD: Pen = Pen::new(ALARM, 1.0).dashed(5.0, 3.5);

/// Axes of a square a little larger than the disc.
pub(crate) fn disc_axes(units: &AxisUnits) -> (Axis, Axis) {
    let reach = 1.08 * units.radius();
    let axis = |name: &str| Axis::linear(-reach, reach, &units.length_of(name), 5);
    (axis("x"), axis("y"))
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

/// The wall that holds a rod at a pixel, across its direction there, of half a height in pixels.
pub(crate) fn wall(canvas: &mut Canvas, at: Pixel, towards: Pixel, half: f64) {
    let Some(d) = heading(at, towards).filter(|_| finite(&at)) else {
        return;
    };
    // `along` the rod, `aside` along the wall.
    let point = |along: f64, aside: f64| {
        (
            at.0 + along * d.0 - aside * d.1,
            at.1 + along * d.1 + aside * d.0,
        )
    };
    for i in 0..7 {
        let aside = -half + (i as f64 + 0.7) * 2.0 * half / 7.0;
        let hatch = [point(-6.0, aside + 5.0), point(0.0, aside)];
        canvas.line(&hatch, Pen::new(INK, 0.8));
    }
    canvas.line(&[point(0.0, -half), point(0.0, half)], Pen::new(INK, 2.0));
}

/// The ledger of a motion: every vector as long as `time`, or empty to leave it out.
#[derive(Debug, Clone, Default, PartialEq)]
pub struct Energies {
    /// Times, rising; two equal ones at a snap.
    pub time: Vec<f64>,
    /// Kinetic energy of the mass.
    pub kinetic: Vec<f64>,
    /// Kinetic energy of a rod with mass.
    pub rod_kinetic: Vec<f64>,
    /// Elastic energy of the rod.
    pub elastic: Vec<f64>,
    /// Potential energy of the loads.
    pub potential: Vec<f64>,
    /// Energy lost in snaps and to friction so far.
    pub dissipated: Vec<f64>,
    /// Work of the driven clamp and of time-dependent loads so far.
    pub work: Vec<f64>,
    /// Kinetic, of mass and rod, + elastic + potential.
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
        ("kinetic of the rod", &data.rod_kinetic),
        ("total mechanical", &data.total),
    ];
    let used = all.into_iter().zip([0, 1, 2, 3, 4, 5, 6]);
    let used = used.filter(|((_, values), _)| !values.is_empty());
    let curves = used.clone().map(|((name, values), colour)| {
        let pen = match name {
            "total mechanical" => Pen::new(INK, 1.6),
            "work" => Pen::new(category(colour), 1.5).dashed(6.0, 4.0),
            _ => Pen::new(category(colour), 1.5),
        };
        Drawn::new(Key::Line(pen), name, &data.time, values)
    });
    let curves: Vec<Drawn> = curves.collect();
    let values = used.flat_map(|((_, values), _)| values.iter());
    let y = Axis::fit(values, false, &data.units.energy_of("energy"), 6)
        .ok_or_else(|| Error::domain("figure of energies: no energy to show"))?;
    let (floor, error_axis) = error_scale(&data.error, &data.units);

    let mut entries = named(&curves);
    if !data.snaps.is_empty() {
        entries.push(Entry::new(Key::Line(SNAP), "snap"));
    }
    let x = Axis::linear(start, end, &data.units.time_of("time t"), 8);
    let sizes: Vec<f64> = data.error.iter().map(|e| e.abs().max(floor)).collect();
    let error = Drawn::line_of(Pen::new(category(0), 1.0), &data.time, &sizes);
    let snaps = |canvas: &mut Canvas, panel: &Panel| {
        for &snap in &data.snaps {
            panel.upright(canvas, snap, SNAP);
        }
    };
    let upper = Block::plane(x.clone(), y, Height::Pixels(250.0), curves).under(snaps);
    let lower = Block::plane(x, error_axis, Height::Pixels(110.0), vec![error]).under(snaps);
    let page = Page::new("", vec![entries]);
    Ok(page.column(Width::Whole(WIDTH), vec![upper, lower]).draw())
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
