//! The inner layer of a snap: the rod falls from the fold to its landing while the body stays where it is.

use super::axes::{Axis, Mark, Panel, ROOM_BELOW, draw_mark, extent, room_left};
use super::canvas::{Canvas, Pen, draw};
use super::data::{AxisUnits, Curve, as_many, rising, with_unit};
use super::legend::{ColourBar, Entry, Key, Legend};
use super::motion::Shape;
use super::page::{ROOM_RIGHT, WIDTH, head, top};
use super::palette::{ALARM, GREY, INK, category, line_colours, sequential_line};
use super::text;
use crate::error::{Error, Result};

/// The energies of one viscous run through a layer, over its own stretched time.
#[derive(Debug, Clone, Default, PartialEq)]
pub struct LayerRun {
    /// The run's viscosity eta, for the legend.
    pub eta: f64,
    /// Stretched times T = (t - t_peak) / eta, t_peak the time of the largest rate of dissipation (the fold itself is passed
    /// earlier, by a time of order eta^(2/3)), finite, not falling.
    pub stretched: Vec<f64>,
    /// Elastic energy at each of them, in `units.energy`; empty to leave it out. What is not finite breaks the curve.
    pub elastic: Vec<f64>,
    /// Energy dissipated since the fold, likewise.
    pub dissipated: Vec<f64>,
}

/// A snap in stretched time.
#[derive(Debug, Clone, Default, PartialEq)]
pub struct LayerFigure {
    /// Written over the figure; may be empty.
    pub title: String,
    /// The shape at the fold, from the clamp to the body, in `units.length`; empty to leave it out.
    pub fold: Curve,
    /// The shape on which the rod lands.
    pub landing: Curve,
    /// Shapes between; their times are stretched times T. Six to twelve can be told apart.
    pub shapes: Vec<Shape>,
    /// The runs whose energies are drawn; if they fall on one curve, T is the layer's time. Empty to
    /// leave out the lower panel.
    pub runs: Vec<LayerRun>,
    /// The elastic energy released by the snap in the elastic limit: a dashed line.
    pub released: Option<f64>,
    /// Units; T is in time / (energy x length x time).
    pub units: AxisUnits,
}

const FIGURE: &str = "figure of a layer";
const FOLD: Pen = Pen::new(INK, 3.0);
const LANDING: Pen = Pen::new(ALARM, 3.0);
const RELEASED: Pen = Pen::new(INK, 1.1).dashed(9.0, 5.0);

/// Draws the layer of a snap as SVG: above, the shapes from the fold to the landing, coloured by T, at
/// equal scales, with the clamp at the first point and the body at the last; below, elastic and dissipated
/// energy against T. Runs are drawn from thick to thin, so that those which coincide are all seen. Marks on
/// the axis of T show the moments drawn above.
///
/// Errs if no shape has a finite point and time, if a list of a run has not as many entries as its `stretched`,
/// or if the times of a run are not finite, fall or span nothing.
pub fn layer(data: &LayerFigure) -> Result<String> {
    for (i, run) in data.runs.iter().enumerate() {
        rising(FIGURE, &format!("runs[{i}].stretched"), &run.stretched)?;
        for (name, list) in [("elastic", &run.elastic), ("dissipated", &run.dissipated)] {
            if !list.is_empty() {
                let field = format!("runs[{i}].{name}");
                let times = run.stretched.len();
                as_many(FIGURE, &field, list.len(), times, "stretched times")?;
            }
        }
    }
    let shapes: Vec<&Shape> = data
        .shapes
        .iter()
        .filter(|s| s.time.is_finite() && s.axis.has_points())
        .collect();
    let ends = [(&data.fold, FOLD), (&data.landing, LANDING)];
    let all = shapes.iter().map(|s| &s.axis);
    let all: Vec<&Curve> = all.chain(ends.iter().map(|e| e.0)).collect();
    let none = || Error::domain(format!("{FIGURE}: no shape to show"));
    let body = [&data.fold, &data.landing]
        .into_iter()
        .chain(shapes.iter().map(|s| &s.axis))
        .find_map(|curve| finite(curve).pop())
        .ok_or_else(none)?;

    let unit = data.units.stretched_time();
    let (first, last) = extent(shapes.iter().map(|s| &s.time)).unwrap_or((0.0, 1.0));
    let span = if last > first { last - first } else { 1.0 };
    let times = Axis::linear(first, first + span, &with_unit("T", &unit), 6);
    let colours = line_colours();
    let bar = ColourBar::new(&times, &colours);
    let energies = energy_axis(data);

    let upper = equal_panel(&all, &data.units, WIDTH - 22.0 - bar.width()).ok_or_else(none)?;
    let left = upper.left.max(energies.as_ref().map_or(0.0, room_left));
    let legend = Legend::new(upper_entries(data), WIDTH - left - ROOM_RIGHT);
    let upper = evened(Panel {
        left,
        width: upper.width - (left - upper.left),
        top: top(&data.title, &legend),
        ..upper
    });
    let key = Legend::new(lower_entries(data), WIDTH - left - ROOM_RIGHT);
    let lower = energies.map(|y| {
        let spans = data.runs.iter().flat_map(|r| &r.stretched);
        let (from, to) = extent(spans.chain(shapes.iter().map(|s| &s.time))).unwrap_or((0.0, 1.0));
        let label = with_unit("stretched time T = (t − t_peak)/η", &unit);
        Panel {
            left,
            top: upper.bottom() + ROOM_BELOW + 8.0 + key.height(),
            width: WIDTH - left - ROOM_RIGHT,
            height: 210.0,
            x: Axis::linear(from, to, &label, 8),
            y,
        }
    });
    let bottom = lower.as_ref().map_or(upper.bottom(), Panel::bottom);
    Ok(draw(WIDTH, bottom + ROOM_BELOW, |canvas| {
        head(canvas, &data.title, &legend, left);
        upper.grid(canvas);
        for shape in &shapes {
            let pen = Pen::new(sequential_line((shape.time - first) / span), 1.5);
            upper.line(canvas, &shape.axis.x, &shape.axis.y, pen);
        }
        for (curve, pen) in ends {
            upper.line(canvas, &curve.x, &curve.y, pen);
        }
        let clamped = all.iter().map(|c| finite(c)).find(|p| p.len() > 1);
        if let Some([from, to, ..]) = clamped.as_deref() {
            wall(canvas, upper.at(from[0], from[1]), upper.at(to[0], to[1]));
        }
        draw_mark(canvas, upper.at(body[0], body[1]), Mark::Square, 6.5, INK);
        upper.frame(canvas);
        if !shapes.is_empty() {
            let inset = 0.06 * upper.height;
            let (top, bottom) = (upper.top + inset, upper.bottom() - inset);
            bar.draw(canvas, upper.right() + 18.0, top, bottom);
        }
        if let Some(panel) = &lower {
            key.draw(canvas, left, panel.top - key.height());
            panel.grid(canvas);
            for shape in &shapes {
                let x = panel.at(shape.time, panel.y.lo).0;
                let pen = Pen::new(sequential_line((shape.time - first) / span), 3.0);
                canvas.line(&[(x, panel.bottom() - 9.0), (x, panel.bottom())], pen);
            }
            if let Some(released) = data.released {
                let across = [panel.x.lo, panel.x.hi];
                panel.line(canvas, &across, &[released; 2], RELEASED);
            }
            for (i, run) in data.runs.iter().enumerate() {
                let [solid, dashed] = pens(i, data.runs.len());
                panel.line(canvas, &run.stretched, &run.elastic, solid);
                panel.line(canvas, &run.stretched, &run.dissipated, dashed);
            }
            panel.frame(canvas);
        }
    }))
}

/// Elastic and dissipated energy of the i-th of n runs.
fn pens(i: usize, n: usize) -> [Pen; 2] {
    let width = (1.6 + 1.3 * (n - 1 - i) as f64).min(5.0);
    let pen = Pen::new(category(i), width);
    [pen, pen.dashed(5.0 + width, 3.0)]
}

fn upper_entries(data: &LayerFigure) -> Vec<Entry> {
    let mut entries = Vec::new();
    for (curve, pen, name) in [
        (&data.fold, FOLD, "fold"),
        (&data.landing, LANDING, "landing"),
    ] {
        if curve.has_points() {
            entries.push(Entry::new(Key::Line(pen), name));
        }
    }
    let mark = Key::Mark(Mark::Square, INK);
    entries.push(Entry::new(mark, "end, held by the body"));
    entries
}

fn lower_entries(data: &LayerFigure) -> Vec<Entry> {
    let has = |list: fn(&LayerRun) -> &Vec<f64>| data.runs.iter().any(|r| !list(r).is_empty());
    let ink = Pen::new(INK, 1.6);
    let mut entries = Vec::new();
    if has(|r| &r.elastic) {
        entries.push(Entry::new(Key::Line(ink), "elastic"));
    }
    if has(|r| &r.dissipated) {
        let key = Key::Line(ink.dashed(5.0, 3.0));
        entries.push(Entry::new(key, "dissipated"));
    }
    if data.released.is_some_and(f64::is_finite) {
        let name = "released in the elastic limit";
        entries.push(Entry::new(Key::Line(RELEASED), name));
    }
    for (i, run) in data.runs.iter().enumerate() {
        if run.eta.is_finite() {
            let pen = Pen {
                dash: None,
                ..pens(i, data.runs.len())[0]
            };
            let name = format!("η = {}", short(run.eta));
            entries.push(Entry::new(Key::Line(pen), name));
        }
    }
    entries
}

/// A viscosity as it is written: 0.05, but 10⁻⁴.
pub(super) fn short(value: f64) -> String {
    let rounded: f64 = format!("{value:.3e}").parse().unwrap_or(value);
    if rounded == 0.0 || (0.01..1e4).contains(&rounded.abs()) {
        format!("{rounded}").replace('-', "−")
    } else {
        text::scientific(rounded)
    }
}

/// Holds all energies; `None` if there are none.
fn energy_axis(data: &LayerFigure) -> Option<Axis> {
    let curves = data.runs.iter().flat_map(|r| [&r.elastic, &r.dissipated]);
    let values: Vec<f64> = curves.flatten().copied().collect();
    extent(&values)?;
    let all = values.iter().chain(&data.released);
    Axis::fit(all, false, &data.units.energy_of("energy"), 6)
}

fn finite(curve: &Curve) -> Vec<[f64; 2]> {
    let points = curve.x.iter().zip(&curve.y).map(|(&x, &y)| [x, y]);
    points
        .filter(|p| p[0].is_finite() && p[1].is_finite())
        .collect()
}

/// A panel that holds the curves with a margin; its width given, its left edge for its own numbers.
fn equal_panel(curves: &[&Curve], units: &AxisUnits, width: f64) -> Option<Panel> {
    let points: Vec<[f64; 2]> = curves.iter().flat_map(|c| finite(c)).collect();
    let range = |k: usize| {
        let values: Vec<f64> = points.iter().map(|p| p[k]).collect();
        let (lo, hi) = extent(&values)?;
        (hi - lo).is_finite().then_some((lo, hi))
    };
    let ((x0, x1), (y0, y1)) = (range(0)?, range(1)?);
    let margin = 0.06 * (x1 - x0).max(y1 - y0).max(1e-6 * units.radius());
    let y = Axis::linear(y0 - margin, y1 + margin, &units.length_of("y"), 5);
    let left = room_left(&y);
    let panel = Panel {
        left,
        top: 0.0,
        width: width - left,
        height: 0.0,
        x: Axis::linear(x0 - margin, x1 + margin, &units.length_of("x"), 6),
        y,
    };
    // The numbers of the axis as it will be, which may be longer.
    let left = left.max(room_left(&evened(panel.clone()).y));
    Some(Panel {
        left,
        width: width - left,
        ..panel
    })
}

/// The same panel with a height, and its axes widened so that both have the same scale.
fn evened(panel: Panel) -> Panel {
    let (across, up) = (panel.x.hi - panel.x.lo, panel.y.hi - panel.y.lo);
    let height = (panel.width * up / across).clamp(200.0, 400.0);
    let scale = (panel.width / across).min(height / up);
    let widened = |axis: &Axis, pixels: f64| {
        let extra = 0.5 * (pixels / scale - (axis.hi - axis.lo)).max(0.0);
        Axis::linear(axis.lo - extra, axis.hi + extra, &axis.label, 5)
    };
    Panel {
        height,
        x: widened(&panel.x, panel.width),
        y: widened(&panel.y, height),
        ..panel
    }
}

/// The wall that holds the rod at a pixel, across its direction there.
fn wall(canvas: &mut Canvas, at: (f64, f64), towards: (f64, f64)) {
    let length = (towards.0 - at.0).hypot(towards.1 - at.1);
    if !(length > 0.0 && length.is_finite()) {
        return;
    }
    let d = ((towards.0 - at.0) / length, (towards.1 - at.1) / length);
    // `along` the rod, `aside` along the wall.
    let point = |along: f64, aside: f64| {
        (
            at.0 + along * d.0 - aside * d.1,
            at.1 + along * d.1 + aside * d.0,
        )
    };
    let half = 15.0;
    for i in 0..7 {
        let aside = -half + (i as f64 + 0.7) * 2.0 * half / 7.0;
        let hatch = [point(-6.0, aside + 5.0), point(0.0, aside)];
        canvas.line(&hatch, Pen::new(GREY, 0.9));
    }
    canvas.line(&[point(0.0, -half), point(0.0, half)], Pen::new(INK, 2.2));
}
