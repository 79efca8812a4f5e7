//! Figures of one motion: the rod's shapes in the plane, and the ledger against time.

use super::axes::{Axis, Panel, extent};
use super::canvas::{Canvas, Pen};
use super::data::{AxisUnits, Curve};
use super::geometry::{Pixel, finite, heading};
use super::legend::{Drawn, Entry, Key, Mark, Tones, named};
use super::page::{Block, Height, Page, WIDTH, Width};
use super::palette::{ALARM, Colour, GREY, INK, category};
use super::paper::Paper;
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
    /// The clamps: where each is, and a point ahead of it; by default the origin and along x.
    pub walls: Vec<[[f64; 2]; 2]>,
    /// Units and the rod's length.
    pub units: AxisUnits,
}

/// Draws the rod's shapes, coloured by time, with the path of the mass, folds and snaps as SVG.
///
/// Errs if there is no shape with a finite point and a finite time.
pub fn snapshots(data: &Snapshots, paper: &Paper) -> Result<String> {
    let shapes = seen(&data.shapes);
    let tones = Tones::over(shapes.iter().map(|s| &s.time))
        .ok_or_else(|| Error::domain("figure of snapshots: no shape to show"))?;

    let folds = data.folds.iter().enumerate();
    let name = |i: usize| if i == 0 { "fold" } else { "" };
    let folds = folds.map(|(i, fold)| Drawn::new(Key::Line(FOLD), name(i), &fold.x, &fold.y));
    // Where a long path covers itself, its shades tell how often.
    let pen = match way(&data.path) < LONG * data.units.radius() {
        true => PATH,
        false => Pen { width: 0.6, ..PATH }.alpha(0.4),
    };
    let path = Drawn::new(
        Key::Line(pen),
        "path of the mass",
        &data.path.x,
        &data.path.y,
    );
    let path = data.path.has_points().then_some(path);
    let lines: Vec<Drawn> = folds.chain(path).collect();
    let mut before = "before a snap";
    let rods = shapes.iter().enumerate().map(|(i, shape)| {
        let pen = Pen::new(tones.colour(shape.time), 1.8);
        // Of the two at one time the first is that before the snap.
        let snaps = shapes
            .get(i + 1)
            .is_some_and(|next| next.time == shape.time);
        let (pen, name) = match snaps {
            true => (pen.dashed(5.0, 3.0), std::mem::take(&mut before)),
            false => (pen, ""),
        };
        Drawn::new(Key::Line(pen), name, &shape.axis.x, &shape.axis.y)
    });
    let curves: Vec<Drawn> = lines.iter().cloned().chain(rods).collect();
    let mut entries = named(&curves);
    let ends: Vec<(f64, f64)> = (data.path.points().next().into_iter())
        .chain(data.path.points().next_back())
        .collect();
    if ends.len() == 2 {
        entries.push(Entry::new(Key::Mark(Mark::Ring, INK), "start"));
        entries.push(Entry::new(Key::Mark(Mark::Square, INK), "end"));
    }
    if !data.snaps.is_empty() {
        entries.push(Entry::new(Key::Mark(Mark::Cross, ALARM), "snap"));
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
    let mut block = Block::plane(x, y, Height::Equal(0.0, 1e3), curves)
        .without_grid()
        .under(ground)
        .over(|canvas, panel| {
            masses(canvas, panel);
            marks(canvas, panel);
            let still = [[[0.0, 0.0], [1.0, 0.0]]];
            let walls = match data.walls.is_empty() {
                true => &still[..],
                false => &data.walls,
            };
            for [base, ahead] in walls
                .iter()
                .map(|both| both.map(|at| panel.at(at[0], at[1])))
            {
                wall(canvas, base, ahead, 13.0);
            }
        });
    let mut page = Page::new("", vec![entries]);
    let bar = Some(tones.bar(&data.units.time_of("time t")));
    let Some((x, y)) = close else {
        block.bar = bar;
        return page.column(Width::Panels(430.0), vec![block]).draw(paper);
    };
    // Rods and masses would hide the path, which is what this panel is for.
    let rim = circle(data.units.radius());
    let rim = Drawn::line_of(Pen::new(GREY, 0.9), &rim.x, &rim.y);
    let still = lines.into_iter().chain([rim]).collect();
    let mut near = Block::plane(x, y, Height::Equal(0.0, 1e3), still).over(marks);
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

/// Axes of a square that the path fills, where it fills less than this part of the disc's.
fn close_axes(path: &Curve, units: &AxisUnits) -> Option<(Axis, Axis)> {
    const SMALL: f64 = 0.45;
    let ([left, right], [low, high]) = (extent(&path.x)?.into(), extent(&path.y)?.into());
    let reach = 0.55 * f64::max(right - left, high - low);
    let full = 1.08 * units.radius();
    // Below this, rounding of the numbers on the axes would show, and no motion.
    if !(1e-9 * full..SMALL * full).contains(&reach) {
        return None;
    }
    let axis = |a: f64, b: f64, name: &str| {
        let middle = 0.5 * (a + b);
        Axis::linear(middle - reach, middle + reach, &units.length_of(name), 5)
    };
    Some((axis(left, right, "x"), axis(low, high, "y")))
}

/// A path of so many lengths of the rod covers itself.
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
pub fn energies(data: &Energies, paper: &Paper) -> Result<String> {
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
        let (time, values) = thinned(&data.time, values);
        Drawn::new(Key::Line(pen), name, &time, &values)
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
    let (time, sizes) = thinned(&data.time, &sizes);
    let error = Drawn::line_of(Pen::new(category(0), 1.0), &time, &sizes);
    let snaps = |canvas: &mut Canvas, panel: &Panel| {
        for &snap in &data.snaps {
            panel.upright(canvas, snap, SNAP);
        }
    };
    let upper = Block::plane(x.clone(), y, Height::Pixels(250.0), curves).under(snaps);
    let lower = Block::plane(x, error_axis, Height::Pixels(110.0), vec![error]).under(snaps);
    let page = Page::new("", vec![entries]);
    page.column(Width::Whole(WIDTH), vec![upper, lower])
        .draw(paper)
}

/// A curve over rising times of which a drawing shows the same: where more than four points share half a pixel, the first, the least, the
/// largest and the last of them.
fn thinned(time: &[f64], values: &[f64]) -> (Vec<f64>, Vec<f64>) {
    const COLUMNS: f64 = 2.0 * WIDTH;
    let Some((start, end)) = extent(time).filter(|_| time.len() as f64 > 4.0 * COLUMNS) else {
        return (time.to_vec(), values.to_vec());
    };
    let column = |t: f64| ((t - start) / (end - start) * COLUMNS).floor();
    let points: Vec<(f64, f64)> = time.iter().copied().zip(values.iter().copied()).collect();
    let mut kept = Vec::new();
    for run in points.chunk_by(|a, b| column(a.0) == column(b.0)) {
        let by = |a: &&(f64, f64), b: &&(f64, f64)| a.1.total_cmp(&b.1);
        let mut few: Vec<&(f64, f64)> = [run.first(), run.last()].into_iter().flatten().collect();
        few.extend(run.iter().min_by(by));
        few.extend(run.iter().max_by(by));
        few.sort_by(|a, b| a.0.total_cmp(&b.0));
        kept.extend(few.into_iter().copied());
    }
    kept.into_iter().unzip()
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
