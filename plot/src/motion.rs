//! Figures of one motion: the rod's shapes in the plane, and the ledger against time.

use super::axes::{Axis, Panel, extent};
use super::canvas::{Canvas, Pen};
use super::data::{AxisUnits, Curve};
use super::energies::snap_name;
use super::geometry::{Pixel, finite, heading};
use super::legend::{Entry, Key, Mark, PlottedCurve, Tones, named};
use super::page::{Height, Page, PageBlock, Width};
use super::palette::{ALARM, Colour, GREY, INK};
use super::paper::Paper;
use super::scenery::{OBSTACLE, OBSTACLE_NAME};
use snaprod_core::error::{Error, Result};

/// The rod at one time.
#[derive(Debug, Clone, Default, PartialEq)]
pub struct DrawnShape {
    /// Time of the shape.
    pub time: f64,
    /// Centreline from the clamp to the mass; about 100 points.
    pub axis: Curve,
}

/// The shapes that can be drawn.
pub(crate) fn seen(shapes: &[DrawnShape]) -> Vec<&DrawnShape> {
    let seen = |s: &&DrawnShape| s.time.is_finite() && s.axis.has_points();
    shapes.iter().filter(seen).collect()
}

/// A motion in the plane.
#[derive(Debug, Clone, Default, PartialEq)]
pub struct Snapshots {
    /// The rod at some times; six to twelve are distinct. Give the two shapes of a snap as two of them.
    pub shapes: Vec<DrawnShape>,
    /// The path of the mass.
    pub path: Curve,
    /// Fold curves of the region of the motion.
    pub folds: Vec<Curve>,
    /// Positions of the end at snaps.
    pub snaps: Vec<[f64; 2]>,
    /// Name of the snaps in the legend; if empty "snap".
    pub snaps_name: String,
    /// Clamps: the position of each, and a point ahead of it; by default the origin and along x.
    pub walls: Vec<[[f64; 2]; 2]>,
    /// Lines on obstacles.
    pub obstacles: Vec<Curve>,
    /// Units and the rod's length.
    pub units: AxisUnits,
}

/// Draws the rod's shapes, coloured by time, with the path of the mass, folds and snaps as SVG.
///
/// Fails if there is no shape with a finite point and a finite time.
pub fn snapshots(data: &Snapshots, paper: &Paper) -> Result<String> {
    let shapes = seen(&data.shapes);
    let tones = Tones::over(shapes.iter().map(|s| &s.time))
        .ok_or_else(|| Error::domain("figure of snapshots: no shape to show"))?;

    let folds = data.folds.iter().enumerate();
    let name = |i: usize| if i == 0 { "fold" } else { "" };
    let folds =
        folds.map(|(i, fold)| PlottedCurve::new(Key::Line(FOLD), name(i), &fold.x, &fold.y));
    let obstacles = data.obstacles.iter().enumerate().map(|(i, line)| {
        let name = if i == 0 { OBSTACLE_NAME } else { "" };
        PlottedCurve::new(Key::Line(OBSTACLE), name, &line.x, &line.y)
    });
    // A long path covers itself; transparency then shows how often.
    let pen = if way(&data.path) < LONG * data.units.radius() {
        PATH
    } else {
        Pen { width: 0.6, ..PATH }.alpha(0.4)
    };
    let path = PlottedCurve::new(
        Key::Line(pen),
        "path of the mass",
        &data.path.x,
        &data.path.y,
    );
    let path = data.path.has_points().then_some(path);
    let lines: Vec<PlottedCurve> = obstacles.chain(folds).chain(path).collect();
    let mut before = "before a snap";
    let rods = shapes.iter().enumerate().map(|(i, shape)| {
        let pen = Pen::new(tones.colour(shape.time), 1.8);
        // Of two shapes at one time the first is that before the snap.
        let snaps = shapes
            .get(i + 1)
            .is_some_and(|next| next.time == shape.time);
        let (pen, name) = if snaps {
            (pen.dashed(5.0, 3.0), std::mem::take(&mut before))
        } else {
            (pen, "")
        };
        PlottedCurve::new(Key::Line(pen), name, &shape.axis.x, &shape.axis.y)
    });
    let curves: Vec<PlottedCurve> = lines.iter().cloned().chain(rods).collect();
    let mut entries = named(&curves);
    let ends: Vec<(f64, f64)> = (data.path.points().next().into_iter())
        .chain(data.path.points().next_back())
        .collect();
    if ends.len() == 2 {
        entries.push(Entry::new(Key::Mark(Mark::Ring, INK), "start"));
        entries.push(Entry::new(Key::Mark(Mark::Square, INK), "end"));
    }
    if !data.snaps.is_empty() {
        entries.push(Entry::new(
            Key::Mark(Mark::Cross, ALARM),
            snap_name(&data.snaps_name),
        ));
    }
    let marks = |canvas: &mut Canvas, panel: &Panel| {
        for (at, mark) in ends.iter().zip([Mark::Ring, Mark::Square]) {
            panel.mark(canvas, panel.at(at.0, at.1), mark, 4.5, INK);
        }
        for snap in &data.snaps {
            panel.mark(canvas, panel.at(snap[0], snap[1]), Mark::Cross, 4.5, ALARM);
        }
    };
    let masses = |canvas: &mut Canvas, panel: &Panel| {
        for shape in &shapes {
            if let Some(tip) = shape.axis.points().next_back() {
                let tip = panel.at(tip.0, tip.1);
                panel.mark(canvas, tip, Mark::Disc, 5.0, tones.colour(shape.time));
            }
        }
    };
    let ground =
        |canvas: &mut Canvas, panel: &Panel| disc_ground(canvas, panel, data.units.radius());
    let close = close_axes(&data.path, &data.units);
    let (x, y) = disc_axes(&data.units);
    let mut block = PageBlock::plane(x, y, Height::Equal(0.0, 1e3), curves)
        .without_grid()
        .under(ground)
        .over(|canvas, panel| {
            masses(canvas, panel);
            marks(canvas, panel);
            let still = [[[0.0, 0.0], [1.0, 0.0]]];
            let walls = if data.walls.is_empty() {
                &still[..]
            } else {
                &data.walls
            };
            for [base, ahead] in walls
                .iter()
                .map(|both| both.map(|at| panel.at(at[0], at[1])))
            {
                wall(canvas, base, ahead, 13.0);
            }
        });
    let mut page = Page::new("A rod at several times", "", vec![entries]);
    let bar = Some(tones.bar(&data.units.time_of("time t")));
    let Some((x, y)) = close else {
        block.bar = bar;
        return page.column(Width::Panels(430.0), vec![block]).draw(paper);
    };
    // This panel shows the path; rods and masses would hide it.
    let rim = circle(data.units.radius());
    let rim = PlottedCurve::line_of(Pen::new(GREY, 0.9), &rim.x, &rim.y);
    let still = lines.into_iter().chain([rim]).collect();
    let mut near = PageBlock::plane(x, y, Height::Equal(0.0, 1e3), still).over(marks);
    near.title = "the path, closer";
    near.bar = bar;
    page = page.column(Width::Panels(430.0), vec![block]);
    page.column(Width::Panels(430.0), vec![near]).draw(paper)
}

/// The length of a path.
fn way(path: &Curve) -> f64 {
    let steps = path.x.windows(2).zip(path.y.windows(2));
    let steps = steps.map(|(x, y)| (x[1] - x[0]).hypot(y[1] - y[0]));
    steps.filter(|step| step.is_finite()).sum()
}

/// Axes of a square around the path, if it is small beside the disc.
fn close_axes(path: &Curve, units: &AxisUnits) -> Option<(Axis, Axis)> {
    const SMALL: f64 = 0.45;
    let ([left, right], [low, high]) = (extent(&path.x)?.into(), extent(&path.y)?.into());
    let reach = 0.55 * f64::max(right - left, high - low);
    let full = 1.08 * units.radius();
    // For smaller paths the axes would show rounding of their numbers.
    if !(1e-9 * full..SMALL * full).contains(&reach) {
        return None;
    }
    let axis = |a: f64, b: f64, name: &str| {
        let middle = 0.5 * (a + b);
        Axis::linear(middle - reach, middle + reach, &units.length_of(name), 5)
    };
    Some((axis(left, right, "x"), axis(low, high, "y")))
}

/// Length of a path, in lengths of the rod, above which the path covers itself.
const LONG: f64 = 60.0;
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

/// Draws the wall that holds a rod at a pixel, across the direction `towards` another; `half` is its half
/// height in pixels.
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
