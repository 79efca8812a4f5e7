//! What a viscous run dissipates against what the elastic limit releases in its snaps.

use super::axes::{Axis, LABEL, Panel, SMALL, draw_mark, extent, mark};
use super::canvas::{Canvas, Pen, Side, Type};
use super::data::{AxisUnits, as_many, rising};
use super::legend::{Entry, Key};
use super::page::{Column, ROOM_RIGHT, WIDTH, room};
use super::palette::{Colour, GREY, category};
use super::text;
use crate::error::{Error, Result};

/// Snaps that share a name, as those of one viscosity.
#[derive(Debug, Clone, Default, PartialEq)]
pub struct LossGroup {
    /// Its name in the legend, as "η = 10⁻³".
    pub name: String,
    /// Elastic energy released by each snap in the elastic limit, in `units.energy`.
    pub released: Vec<f64>,
    /// Energy dissipated in the layer of each.
    pub dissipated: Vec<f64>,
    /// What is written at each point, as the snap's number; empty for none. A label that several points
    /// have, of this group or others, is written once.
    pub labels: Vec<String>,
}

/// Dissipated against released energy, a point for each snap.
#[derive(Debug, Clone, Default, PartialEq)]
pub struct SnapLosses {
    /// Written over the figure; may be empty.
    pub title: String,
    /// The points.
    pub groups: Vec<LossGroup>,
    /// What the horizontal axis says, without its unit; if empty "released in the elastic limit".
    pub released_label: String,
    /// Units.
    pub units: AxisUnits,
}

const FIGURE: &str = "figure of losses";
/// The staircase and the diagonal, under the data.
const LIMIT: Pen = Pen::new(Colour(190, 190, 190), 5.0);

type Pixel = (f64, f64);

/// Draws the energy dissipated in the layer of each snap against the energy that the snap releases in the elastic
/// limit, with the diagonal, as SVG; below, by how much they differ relative to what is released, on a
/// logarithmic scale (none where they are equal).
///
/// Errs if the lists of a group differ in length, or if no point is finite.
pub fn dissipated_against_released(data: &SnapLosses) -> Result<String> {
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
    let mut entries: Vec<Entry> = groups
        .filter(|(_, g)| !g.name.is_empty() && finite(g).next().is_some())
        .map(|(i, g)| Entry::new(Key::Mark(mark(i), category(i)), g.name.as_str()))
        .collect();
    let diagonal = Pen::new(GREY, 1.2);
    entries.push(Entry::new(Key::Line(diagonal), "dissipated = released"));
    let x = Axis::linear(y.lo, y.hi, &released, 6);
    let axes: Vec<_> = [(y, SIDE)]
        .into_iter()
        .chain(below.map(|y| (y, 120.0)))
        .collect();
    let width = room(&axes) + SIDE + ROOM_RIGHT;
    let page = Column::new(width, &data.title, vec![entries], &x, axes);
    Ok(page.draw(|canvas, row, panel| {
        if row == 0 {
            let ends = [panel.x.lo, panel.x.hi];
            panel.line(canvas, &ends, &ends, diagonal);
        }
        for (i, group) in data.groups.iter().enumerate() {
            for point in finite(group) {
                let shown = [point[1], difference(&point)][row];
                let at = panel.at(point[0], shown);
                if panel.holds(at) {
                    draw_mark(canvas, at, mark(i), 4.2, category(i));
                }
            }
        }
        if row == 0 {
            labels(canvas, panel, data);
        }
    }))
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
    let mut taken: Vec<Pixel> = Vec::new();
    let mut named: Vec<(&str, Pixel)> = Vec::new();
    for group in &data.groups {
        for (k, (&x, &y)) in group.released.iter().zip(&group.dissipated).enumerate() {
            let at = panel.at(x, y);
            if !(at.0.is_finite() && at.1.is_finite()) {
                continue;
            }
            taken.push(at);
            let Some(label) = group.labels.get(k).filter(|l| !l.is_empty()) else {
                continue;
            };
            match named.iter_mut().find(|n| n.0 == label) {
                Some(first) if at.1 < first.1.1 => first.1 = at,
                Some(_) => {}
                None => named.push((label, at)),
            }
        }
    }
    let font = Type::new(SMALL, Side::Middle, Side::Middle);
    for (label, at) in named {
        let half = 0.5 * text::width(label, SMALL);
        let clearance = |p: &Pixel| {
            let across = |q: &Pixel| (p.0 - q.0).abs() - half;
            let apart = |q: &Pixel| across(q).max(0.0).hypot(p.1 - q.1);
            let diagonal = ((p.0 - panel.left) - (panel.bottom() - p.1)).abs() / 2f64.sqrt();
            let least = taken
                .iter()
                .map(apart)
                .fold(diagonal - 0.7 * half, f64::min);
            // Enough is enough: the first of the places that are clear.
            least.min(9.0)
        };
        // Above to the left first: that side of the diagonal is where nothing should be.
        let place = [135, 180, 90, 0, 315, 270, 45, 225]
            .into_iter()
            .flat_map(|angle: i32| [12.0, 18.0].map(|r| (f64::from(angle).to_radians(), r)))
            .map(|(a, r)| (at.0 + (r + half) * a.cos(), at.1 - r * a.sin()))
            .filter(|p| {
                p.0 - half > panel.left + 3.0
                    && p.0 + half < panel.right() - 3.0
                    && p.1 > panel.top + 9.0
                    && p.1 < panel.bottom() - 9.0
            })
            .map(|p| (clearance(&p), p))
            .reduce(|best, next| if next.0 > best.0 { next } else { best });
        if let Some((_, place)) = place {
            canvas.halo_text(place, label, font);
            let reach = half.min(3.0 * LABEL);
            taken.extend([
                place,
                (place.0 - reach, place.1),
                (place.0 + reach, place.1),
            ]);
        }
    }
}

/// What one viscous run has dissipated so far.
#[derive(Debug, Clone, Default, PartialEq)]
pub struct LossRun {
    /// Its name in the legend, as "dissipated, η = 10⁻³".
    pub name: String,
    /// Times, in `units.time`, finite, not falling.
    pub time: Vec<f64>,
    /// Energy dissipated up to each; what is not finite breaks the curve.
    pub dissipated: Vec<f64>,
}

/// Cumulative losses over time.
#[derive(Debug, Clone, Default, PartialEq)]
pub struct LossesOverTime {
    /// Written over the figure; may be empty.
    pub title: String,
    /// Times of the snaps of the elastic limit run, not falling.
    pub snaps: Vec<f64>,
    /// Elastic energy released in snaps up to and with each of them (so it rises), in `units.energy`.
    pub released: Vec<f64>,
    /// The viscous runs.
    pub runs: Vec<LossRun>,
    /// Units.
    pub units: AxisUnits,
}

/// Draws the energies that viscous runs have dissipated against time, over the staircase of the energy that the
/// elastic limit run has released (zero before its first snap), as SVG.
///
/// Errs if there is no run, if lists differ in length, if times are not finite, fall or (of a run) span nothing, or
/// if no energy is finite.
pub fn losses_over_time(data: &LossesOverTime) -> Result<String> {
    as_many(
        FIGURE,
        "released",
        data.released.len(),
        data.snaps.len(),
        "snaps",
    )?;
    let sound = |v: &f64| v.is_finite();
    if !data.snaps.iter().chain(&data.released).all(sound) || !data.snaps.is_sorted() {
        return Err(Error::domain(format!(
            "{FIGURE}: snaps and released need finite numbers, snaps must not fall"
        )));
    }
    let mut times = Vec::new();
    for (i, run) in data.runs.iter().enumerate() {
        let (first, last) = rising(FIGURE, &format!("runs[{i}].time"), &run.time)?;
        times.extend([first, last]);
        let (field, count) = (format!("runs[{i}].dissipated"), run.time.len());
        as_many(FIGURE, &field, run.dissipated.len(), count, "times")?;
    }
    let (start, end) = extent(&times)
        .filter(|(start, end)| (end - start).is_finite())
        .ok_or_else(|| Error::domain(format!("{FIGURE}: no run to show")))?;
    let mut steps = vec![(start, 0.0)];
    let mut level = 0.0;
    for (&t, &released) in data.snaps.iter().zip(&data.released) {
        if t <= end {
            steps.extend([(t.max(start), level), (t.max(start), released)]);
            level = released;
        }
    }
    steps.push((end, level));
    let (step_times, step_levels): (Vec<f64>, Vec<f64>) = steps.into_iter().unzip();
    let dissipated = data.runs.iter().flat_map(|r| &r.dissipated);
    if !dissipated.clone().any(|v| v.is_finite()) {
        return Err(Error::domain(format!("{FIGURE}: no energy to show")));
    }
    let label = data.units.energy_of("energy lost so far");
    let y = Axis::fit(dissipated.chain(&step_levels), false, &label, 6)
        .filter(|axis| (axis.hi - axis.lo).is_finite())
        .ok_or_else(|| Error::domain(format!("{FIGURE}: energies span no range")))?;

    let mut entries = Vec::new();
    if !data.snaps.is_empty() {
        entries.push(Entry::new(
            Key::Line(LIMIT),
            "released in the elastic limit",
        ));
    }
    for (i, run) in data.runs.iter().enumerate() {
        if !run.name.is_empty() {
            let pen = Pen::new(category(i), 1.6);
            entries.push(Entry::new(Key::Line(pen), run.name.as_str()));
        }
    }
    let x = Axis::linear(start, end, &data.units.time_of("time t"), 8);
    let page = Column::new(WIDTH, &data.title, vec![entries], &x, vec![(y, 320.0)]);
    Ok(page.draw(|canvas, _, panel| {
        if !data.snaps.is_empty() {
            // Its thick ends stay inside the frame.
            let (l, r) = (panel.left + 2.5, panel.right() - 2.5);
            let mut stairs = panel.pixels(&step_times, &step_levels);
            stairs.iter_mut().for_each(|p| p.0 = p.0.clamp(l, r));
            panel.pixel_line(canvas, &stairs, LIMIT);
        }
        for (i, run) in data.runs.iter().enumerate() {
            let pen = Pen::new(category(i), 1.6);
            panel.line(canvas, &run.time, &run.dissipated, pen);
        }
    }))
}
