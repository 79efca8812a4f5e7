//! Energy dissipated in viscous runs against the energy released by snaps in the elastic limit.

use super::axes::{Axis, Panel, extent};
use super::canvas::{Canvas, Pen};
use super::data::{AxisUnits, Series, as_many, rising};
use super::geometry::Pixel;
use super::labels;
use super::legend::{Entry, Key, PlottedCurve, mark, named};
use super::page::{Height, Page, PageBlock, WIDTH, Width};
use super::palette::{Colour, GREY, category};
use super::paper::Paper;
use snaprod_core::error::{Error, Result};

/// Snaps of one group, as those of one viscosity.
#[derive(Debug, Clone, Default, PartialEq)]
pub struct LossGroup {
    /// Name in the legend, as "η = 10⁻³".
    pub name: String,
    /// Elastic energy released by each snap in the elastic limit, in `units.energy`.
    pub released: Vec<f64>,
    /// Energy dissipated in the layer of each snap.
    pub dissipated: Vec<f64>,
    /// Text at each point, as the snap's number; empty for none. A label of several points, of any group, is
    /// written once.
    pub labels: Vec<String>,
}

/// Dissipated against released energy, a point for each snap.
#[derive(Debug, Clone, Default, PartialEq)]
pub struct SnapLosses {
    /// Title over the figure; may be empty.
    pub title: String,
    /// The points.
    pub groups: Vec<LossGroup>,
    /// Label of the horizontal axis, without its unit; if empty "released in the elastic limit".
    pub released_label: String,
    /// Units.
    pub units: AxisUnits,
}

const FIGURE: &str = "figure of losses";
/// The staircase and the diagonal, under the data.
const LIMIT: Pen = Pen::new(Colour(190, 190, 190), 5.0);

/// Draws the energy dissipated in the layer of each snap against the energy that the snap releases in the
/// elastic limit, with the diagonal, as SVG; below, their difference relative to the released energy, on a
/// logarithmic scale (none where they are equal).
///
/// Fails if the lists of a group differ in length, or if no point is finite.
pub fn dissipated_against_released(data: &SnapLosses, paper: &Paper) -> Result<String> {
    const SIDE: f64 = 400.0;
    for (i, group) in data.groups.iter().enumerate() {
        let count = group.released.len();
        let field = format!("groups[{i}].dissipated");
        as_many(FIGURE, &field, group.dissipated.len(), count, "released")?;
        if !group.labels.is_empty() {
            let field = format!("groups[{i}].labels");
            as_many(FIGURE, &field, group.labels.len(), count, "released")?;
        }
    }
    let points: Vec<[f64; 2]> = data.groups.iter().flat_map(finite).collect();
    let nothing = || Error::domain(format!("{FIGURE}: no snap to show"));
    let released = data.units.energy_of(match data.released_label.as_str() {
        "" => "released in the elastic limit",
        label => label,
    });
    let dissipated = data.units.energy_of("dissipated in the layer");
    let values: Vec<f64> = points.iter().flatten().copied().collect();
    let y = Axis::fit(&values, false, &dissipated, 6)
        .filter(|axis| (axis.hi - axis.lo).is_finite())
        .ok_or_else(nothing)?;
    let differences: Vec<f64> = points.iter().map(difference).collect();
    let below = Axis::fit(&differences, true, "relative difference", 5);
    let groups = data.groups.iter().enumerate();
    let groups = groups.filter(|(_, group)| finite(group).next().is_some());
    let marks = |f: fn(&[f64; 2]) -> f64| -> Vec<PlottedCurve> {
        let drawn = groups.clone().map(|(i, group)| {
            let (x, y): (Vec<f64>, Vec<f64>) = finite(group).map(|p| (p[0], f(&p))).unzip();
            PlottedCurve::new(Key::Mark(mark(i), category(i)), &group.name, &x, &y)
        });
        drawn.collect()
    };
    let upper = marks(|p| p[1]);
    let mut entries = named(&upper);
    let diagonal = Pen::new(GREY, 1.2);
    entries.push(Entry::new(Key::Line(diagonal), "dissipated = released"));
    let x = Axis::linear(y.lo, y.hi, &released, 6);
    let ends = [y.lo, y.hi];
    let upper = PageBlock::plane(x.clone(), y, Height::Pixels(SIDE), upper)
        .under(move |canvas, panel| panel.line(canvas, &ends, &ends, diagonal))
        .over(|canvas, panel| labels(canvas, panel, data));
    let lower = below.map(|y| PageBlock::plane(x, y, Height::Pixels(120.0), marks(difference)));
    let blocks = [upper].into_iter().chain(lower).collect();
    let page = Page::new("Energy dissipated and released", &data.title, vec![entries]);
    page.column(Width::Panels(SIDE), blocks).draw(paper)
}

/// The finite points (released, dissipated) of a group.
fn finite(group: &LossGroup) -> impl Iterator<Item = [f64; 2]> {
    let points = group.released.iter().zip(&group.dissipated);
    points
        .map(|(&r, &d)| [r, d])
        .filter(|p| p.iter().all(|v| v.is_finite()))
}

fn difference(point: &[f64; 2]) -> f64 {
    ((point[1] - point[0]) / point[0]).abs()
}

/// Writes each label once, beside the highest of its points, clear of points, labels and the diagonal.
fn labels(canvas: &mut Canvas, panel: &Panel, data: &SnapLosses) {
    let mut marks: Vec<Pixel> = Vec::new();
    let mut words: Vec<(Pixel, &str)> = Vec::new();
    for group in &data.groups {
        let names = group.labels.iter().map(String::as_str);
        let names = names.chain(std::iter::repeat(""));
        for ((&x, &y), name) in group.released.iter().zip(&group.dissipated).zip(names) {
            let at = panel.at(x, y);
            if !(at.0.is_finite() && at.1.is_finite()) {
                continue;
            }
            marks.push(at);
            match words.iter_mut().find(|word| word.1 == name) {
                Some(first) if at.1 < first.0.1 => first.0 = at,
                Some(_) => {}
                None => words.push((at, name)),
            }
        }
    }
    let [l, t, r, b] = panel.edges();
    labels::write(canvas, panel, [&vec![(l, b), (r, t)]], &marks, &words);
}

/// Cumulative losses over time.
#[derive(Debug, Clone, Default, PartialEq)]
pub struct LossesOverTime {
    /// Title over the figure; may be empty.
    pub title: String,
    /// Times of the snaps of the elastic limit run, not falling.
    pub snaps: Vec<f64>,
    /// Cumulative elastic energy released up to and with each snap (rising), in `units.energy`.
    pub released: Vec<f64>,
    /// The viscous runs: the energy dissipated (y) up to each time (x, finite, not falling).
    pub runs: Vec<Series>,
    /// Units.
    pub units: AxisUnits,
}

/// Draws the energies that viscous runs have dissipated against time, over the staircase of the energy that
/// the elastic limit run has released (zero before its first snap), as SVG.
///
/// Fails if there is no run, if lists differ in length, if times are not finite, fall or (of a run) span
/// nothing, or if no energy is finite.
pub fn losses_over_time(data: &LossesOverTime, paper: &Paper) -> Result<String> {
    let count = data.snaps.len();
    as_many(FIGURE, "released", data.released.len(), count, "snaps")?;
    let sound = |v: &f64| v.is_finite();
    if !data.snaps.iter().chain(&data.released).all(sound) || !data.snaps.is_sorted() {
        return Err(Error::domain(format!(
            "{FIGURE}: snaps and released need finite numbers, snaps must not fall"
        )));
    }
    let mut times = Vec::new();
    for (i, run) in data.runs.iter().enumerate() {
        let (first, last) = rising(FIGURE, &format!("runs[{i}].x"), &run.x)?;
        times.extend([first, last]);
        let (field, count) = (format!("runs[{i}].y"), run.x.len());
        as_many(FIGURE, &field, run.y.len(), count, "times")?;
    }
    let (start, end) = extent(&times)
        .filter(|(start, end)| (end - start).is_finite())
        .ok_or_else(|| Error::domain(format!("{FIGURE}: no run to show")))?;
    // The thick ends of the staircase stay inside the frame.
    let inside = |t: f64| t.clamp(start + 0.004 * (end - start), end - 0.004 * (end - start));
    let (mut step_times, mut step_levels) = (vec![inside(start)], vec![0.0]);
    let snaps = data.snaps.iter().zip(&data.released);
    for (&t, &released) in snaps.filter(|(t, _)| **t <= end) {
        step_times.extend([inside(t); 2]);
        step_levels.extend([step_levels[step_levels.len() - 1], released]);
    }
    step_times.push(inside(end));
    step_levels.push(step_levels[step_levels.len() - 1]);
    let dissipated = data.runs.iter().flat_map(|r| &r.y);
    if !dissipated.clone().any(|v| v.is_finite()) {
        return Err(Error::domain(format!("{FIGURE}: no energy to show")));
    }
    let label = data.units.energy_of("energy lost so far");
    let y = Axis::fit(dissipated.chain(&step_levels), false, &label, 6)
        .filter(|axis| (axis.hi - axis.lo).is_finite())
        .ok_or_else(|| Error::domain(format!("{FIGURE}: energies span no range")))?;

    let stairs = (!data.snaps.is_empty()).then(|| {
        let name = "released in the elastic limit";
        PlottedCurve::new(Key::Line(LIMIT), name, &step_times, &step_levels)
    });
    let runs = data
        .runs
        .iter()
        .enumerate()
        .map(|(i, run)| run.drawn(i, 1.6));
    let curves: Vec<PlottedCurve> = stairs.into_iter().chain(runs).collect();
    let x = Axis::linear(start, end, &data.units.time_of("time t"), 8);
    let page = Page::new("Energy lost over time", &data.title, vec![named(&curves)]);
    let block = PageBlock::plane(x, y, Height::Pixels(320.0), curves);
    page.column(Width::Whole(WIDTH), vec![block]).draw(paper)
}
