//! The inner layer of a snap: the rod falls from the fold to its landing while the body stays where it is.

use super::axes::{Axis, extent};
use super::canvas::Pen;
use super::data::{AxisUnits, Curve, as_many, rising, with_unit};
use super::legend::{Entry, Key, Mark, PlottedCurve, Tones, draw_mark, named};
use super::motion::{DrawnShape, seen, wall};
use super::page::{Height, Page, PageBlock, WIDTH, Width};
use super::palette::{ALARM, INK, category};
use super::paper::Paper;
use super::text;
use snaprod_core::error::{Error, Result};

/// The energies of one viscous run through a layer, over its own stretched time.
#[derive(Debug, Clone, Default, PartialEq)]
pub struct LayerRun {
    /// The run's viscosity eta, for the legend.
    pub eta: f64,
    /// Stretched times T = (t - t_peak) / eta, finite, not falling. t_peak is the time of the largest rate of
    /// dissipation; the fold itself is passed earlier, by a time of order eta^(2/3).
    pub stretched: Vec<f64>,
    /// Elastic energy at each time, in `units.energy`; empty to leave it out. Values that are not finite
    /// break the curve.
    pub elastic: Vec<f64>,
    /// Energy dissipated since the fold, as `elastic`.
    pub dissipated: Vec<f64>,
}

/// A snap in stretched time.
#[derive(Debug, Clone, Default, PartialEq)]
pub struct LayerFigure {
    /// Title over the figure; may be empty.
    pub title: String,
    /// The shape at the fold, from the clamp to the body, in `units.length`; empty to leave it out.
    pub fold: Curve,
    /// The shape on which the rod lands.
    pub landing: Curve,
    /// Shapes between; their times are stretched times T. Six to twelve are distinct.
    pub shapes: Vec<DrawnShape>,
    /// Runs whose energies are drawn; if they fall on one curve, T is the layer's time. Empty to leave out
    /// the lower panel.
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

/// Draws the layer of a snap as SVG. Above: the shapes from the fold to the landing, coloured by T, at equal
/// scales, with the clamp at the first point and the body at the last. Below: elastic and dissipated energy
/// against T. Runs are drawn from thick to thin, so that coincident ones are all visible. Marks on the axis
/// of T show the moments drawn above.
///
/// Fails if no shape has a finite point and time, or if a list of a run has not as many entries as its
/// `stretched`. Fails also if the times of a run are not finite, fall or span nothing.
pub fn layer(data: &LayerFigure, paper: &Paper) -> Result<String> {
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
    let shapes = seen(&data.shapes);
    let ends = [
        (&data.fold, FOLD, "fold"),
        (&data.landing, LANDING, "landing"),
    ];
    let all = shapes.iter().map(|s| &s.axis);
    let all: Vec<&Curve> = all.chain(ends.iter().map(|e| e.0)).collect();
    let none = || Error::domain(format!("{FIGURE}: no shape to show"));
    let held = [&data.fold, &data.landing]
        .into_iter()
        .chain(shapes.iter().map(|s| &s.axis));
    let body = held
        .filter_map(|curve| curve.points().next_back())
        .next()
        .ok_or_else(none)?;

    let unit = data.units.stretched_time();
    let tones = Tones::over(shapes.iter().map(|s| &s.time));
    let tone = |t: f64| tones.map_or(INK, |tones| tones.colour(t));
    let mut curves: Vec<PlottedCurve> = Vec::new();
    for shape in &shapes {
        let pen = Pen::new(tone(shape.time), 1.5);
        curves.push(PlottedCurve::line_of(pen, &shape.axis.x, &shape.axis.y));
    }
    for (curve, pen, name) in ends.into_iter().filter(|end| end.0.has_points()) {
        curves.push(PlottedCurve::new(Key::Line(pen), name, &curve.x, &curve.y));
    }
    let mut entries = named(&curves);
    let mark = Key::Mark(Mark::Square, INK);
    entries.push(Entry::new(mark, "end, held by the body"));
    let (x, y) = equal_axes(&all, &data.units).ok_or_else(none)?;
    let mut upper =
        PageBlock::plane(x, y, Height::Equal(200.0, 400.0), curves).over(|canvas, panel| {
            let clamped = all.iter().map(|c| c.points().take(2).collect::<Vec<_>>());
            if let Some([from, to]) = clamped.into_iter().find(|p| p.len() > 1).as_deref() {
                wall(canvas, panel.at(from.0, from.1), panel.at(to.0, to.1), 15.0);
            }
            draw_mark(canvas, panel.at(body.0, body.1), Mark::Square, 6.5, INK);
        });
    upper.bar = tones.map(|tones| tones.bar(&with_unit("T", &unit)));
    let lower = energy_axis(data).map(|y| {
        let spans = data.runs.iter().flat_map(|r| &r.stretched);
        let (from, to) = extent(spans.chain(shapes.iter().map(|s| &s.time))).unwrap_or((0.0, 1.0));
        let label = with_unit("stretched time T = (t − t_peak)/η", &unit);
        let x = Axis::linear(from, to, &label, 8);
        let mut curves = Vec::new();
        for (i, run) in data.runs.iter().enumerate() {
            let [solid, dashed] = pens(i, data.runs.len());
            curves.push(PlottedCurve::line_of(solid, &run.stretched, &run.elastic));
            curves.push(PlottedCurve::line_of(
                dashed,
                &run.stretched,
                &run.dissipated,
            ));
        }
        let mut block = PageBlock::plane(x, y, Height::Pixels(210.0), curves);
        block.legend = lower_entries(data);
        block.under(|canvas, panel| {
            for shape in &shapes {
                let (x, y) = panel.at(shape.time, panel.y.lo);
                let pen = Pen::new(tone(shape.time), 3.0);
                canvas.line(&[(x, y - 9.0), (x, y)], pen);
            }
            if let Some(released) = data.released {
                panel.level(canvas, released, RELEASED);
            }
        })
    });
    let page = Page::new("A snap in stretched time", &data.title, vec![entries]);
    let blocks = [upper].into_iter().chain(lower).collect();
    page.column(Width::Whole(WIDTH), blocks).draw(paper)
}

/// Pens of the elastic and the dissipated energy of the i-th of n runs.
fn pens(i: usize, n: usize) -> [Pen; 2] {
    let width = (1.6 + 1.3 * (n - 1 - i) as f64).min(5.0);
    let pen = Pen::new(category(i), width);
    [pen, pen.dashed(5.0 + width, 3.0)]
}

/// Legend rows: the kinds of lines, and below them the runs.
fn lower_entries(data: &LayerFigure) -> Vec<Vec<Entry>> {
    let has = |list: fn(&LayerRun) -> &Vec<f64>| data.runs.iter().any(|r| !list(r).is_empty());
    let ink = Pen::new(INK, 1.6);
    let name = "released in the elastic limit";
    let kinds = [
        (has(|r| &r.elastic), ink, "elastic"),
        (has(|r| &r.dissipated), ink.dashed(5.0, 3.0), "dissipated"),
        (data.released.is_some_and(f64::is_finite), RELEASED, name),
    ];
    let kinds = kinds.into_iter().filter(|kind| kind.0);
    let kinds = kinds.map(|(_, pen, name)| Entry::new(Key::Line(pen), name));
    let runs = data
        .runs
        .iter()
        .enumerate()
        .filter(|(_, run)| run.eta.is_finite());
    let unit = data.units.viscosity();
    let runs = runs.map(|(i, run)| {
        let name = format!("η = {} {unit}", text::short(run.eta, 4));
        let name = name.trim_end();
        Entry::new(Key::Line(pens(i, data.runs.len())[0]), name)
    });
    vec![kinds.collect(), runs.collect()]
}

/// An axis for all energies; `None` without energies.
fn energy_axis(data: &LayerFigure) -> Option<Axis> {
    let curves = data.runs.iter().flat_map(|r| [&r.elastic, &r.dissipated]);
    let values: Vec<f64> = curves.flatten().copied().collect();
    extent(&values)?;
    let all = values.iter().chain(&data.released);
    Axis::fit(all, false, &data.units.energy_of("energy"), 6)
}

/// Axes that hold the curves with a margin, at equal scales.
fn equal_axes(curves: &[&Curve], units: &AxisUnits) -> Option<(Axis, Axis)> {
    let points = curves.iter().flat_map(|c| c.points());
    let (xs, ys): (Vec<f64>, Vec<f64>) = points.unzip();
    let range = |values: &[f64]| extent(values).filter(|(lo, hi)| (hi - lo).is_finite());
    let ((x0, x1), (y0, y1)) = (range(&xs)?, range(&ys)?);
    let margin = 0.06 * (x1 - x0).max(y1 - y0).max(1e-6 * units.radius());
    let axis = |lo: f64, hi: f64, name: &str, wanted: usize| {
        Axis::linear(lo - margin, hi + margin, &units.length_of(name), wanted)
    };
    Some((axis(x0, x1, "x", 6), axis(y0, y1, "y", 5)))
}
