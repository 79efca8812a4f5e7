//! The strain of a rod over time and arclength, and where its energy is dissipated.

use super::axes::{Axis, Panel, ROOM_BELOW, room_left};
use super::canvas::{Canvas, Pen, draw};
use super::cells::Cells;
use super::data::{AxisUnits, as_many, rising, with_unit};
use super::legend::{ColourBar, Entry, Key, Legend};
use super::page::{head, top};
use super::palette::{Colour, INK, WHITE, diverging, sequential};
use crate::error::{Error, Result};

/// A strain of the rod over (t, s), and its dissipation density.
///
/// Each cell reaches half way to its neighbours, the outermost to the first and last time, and to the
/// rod's ends; so times and arclengths need not be evenly spaced.
#[derive(Debug, Clone, Default, PartialEq)]
pub struct StrainMap {
    /// Written over the figure; may be empty.
    pub title: String,
    /// Times of the columns, in `units.time`; they must not fall (two equal ones at a snap).
    pub time: Vec<f64>,
    /// Arclengths of the rows, in `units.length`, rising.
    pub s: Vec<f64>,
    /// `strain[i][j]` is the strain at `time[i]` and `s[j]`. What is not finite leaves a gap.
    pub strain: Vec<Vec<f64>>,
    /// The strain's name with its unit; if empty "curvature (1/ℓ)" with the unit of length.
    pub strain_label: String,
    /// The strain at the ends of the colour scale, which is symmetric about zero; by default the largest |strain| shown.
    pub strain_range: Option<f64>,
    /// `dissipation[i][j]` is the power dissipated per length at `time[i]` and `s[j]`, energy / (length x time);
    /// empty to leave the panel out. What is not finite leaves a gap.
    pub dissipation: Vec<Vec<f64>>,
    /// Decades below the largest dissipation shown that are told apart, at least 1 and at most 40; by
    /// default 8. What is smaller (or zero, or negative by roundoff) has the last colour.
    pub decades: Option<f64>,
    /// Times of snaps, in `units.time`: vertical lines.
    pub snaps: Vec<f64>,
    /// The times shown; by default all. The colour scales are those of the columns within.
    pub window: Option<[f64; 2]>,
    /// Units and the rod's length.
    pub units: AxisUnits,
}

const FIGURE: &str = "strain map";
const WIDTH: f64 = 700.0;
/// The fill where there is no value.
const GAP: Colour = Colour(188, 188, 188);
const SNAP: Pen = Pen::new(INK, 0.9).dashed(4.0, 4.0);
const SNAP_RIM: Pen = Pen::new(WHITE, 1.9).alpha(0.7);

/// One panel: what is shown, between 0 and 1, and its scale.
struct Layer {
    levels: Vec<f64>,
    scale: Axis,
    colour: fn(f64) -> Colour,
    open: [bool; 2],
}

/// Draws the strain over time (across) and arclength (up) in a diverging scale of colours and, if given, the
/// dissipation density below it in a logarithmic one, as SVG. Colours come in 65 steps, in fewer where
/// the field is so rough that the file would exceed about half a megabyte a panel.
///
/// Errs if times or arclengths fall, are not finite or fewer than two, if the lists do not have their lengths, if no value is finite, if
/// `strain_range`, `decades` or `window` is not a range, or if no dissipation shown is positive.
pub fn strain_map(data: &StrainMap) -> Result<String> {
    let (first, last) = rising(FIGURE, "time", &data.time)?;
    let (low, high) = rising(FIGURE, "s", &data.s)?;
    let [start, end] = data.window.unwrap_or([first, last]);
    let (start, end) = (start.max(first), end.min(last));
    if !(start < end && data.window.is_none_or(|[a, b]| a < b)) {
        return Err(Error::domain(format!(
            "{FIGURE}: window is {:?}; it needs two rising times that overlap with {first} to {last}",
            data.window.unwrap_or([start, end])
        )));
    }
    let x_edges = edges(&data.time, first, last);
    let y_edges = edges(&data.s, low.min(0.0), high.max(data.units.radius()));
    let shown: Vec<usize> = (0..data.time.len())
        .filter(|&i| x_edges[i + 1] > start && x_edges[i] < end)
        .collect();

    let mut layers = vec![strain_layer(data, &shown)?];
    if !data.dissipation.is_empty() {
        layers.push(dissipation_layer(data, &shown)?);
    }
    let length = data.units.length_of("arclength s");
    let y = Axis::linear(y_edges[0], y_edges[data.s.len()], &length, 5);
    let left = room_left(&y);
    let bars = layers
        .iter()
        .map(|layer| bar(layer, &[]).width())
        .fold(0.0, f64::max);
    let width = WIDTH - left - 14.0 - bars;

    let upper = Panel {
        left,
        top: 0.0,
        width,
        height: 220.0,
        x: Axis::linear(start, end, &data.units.time_of("time t"), 7),
        y,
    };
    let pixel = |t: f64| left + width * upper.x.place(t).clamp(0.0, 1.0);
    let across: Vec<f64> = shown
        .iter()
        .map(|&i| x_edges[i])
        .chain(shown.last().map(|&i| x_edges[i + 1]))
        .map(pixel)
        .collect();
    let up: Vec<f64> = y_edges.iter().map(|&s| upper.at(start, s).1).collect();
    let cells: Vec<Cells> = layers
        .iter()
        .map(|layer| Cells::new(&across, &up, &layer.levels))
        .collect();

    let snaps: Vec<f64> = data
        .snaps
        .iter()
        .copied()
        .filter(|t| (start..=end).contains(t))
        .collect();
    let mut entries = Vec::new();
    if !snaps.is_empty() {
        entries.push(Entry::new(Key::Line(SNAP), "snap"));
    }
    if cells.iter().any(|c| c.gaps) {
        entries.push(Entry::new(Key::Fill(GAP), "no value"));
    }
    let legend = Legend::new(entries, width);
    let top = top(&data.title, &legend);
    let gap = upper.height + 20.0;
    let height = top + gap * layers.len() as f64 - 20.0 + ROOM_BELOW;
    Ok(draw(WIDTH, height, |canvas| {
        head(canvas, &data.title, &legend, left);
        for (k, (layer, cells)) in layers.iter().zip(&cells).enumerate() {
            let mut panel = upper.clone();
            panel.top = top + gap * k as f64;
            if k + 1 < layers.len() {
                panel.x = panel.x.bare();
            }
            let colours: Vec<Colour> = (0..cells.bands)
                .map(|b| (layer.colour)(b as f64 / (cells.bands - 1) as f64))
                .collect();
            paint(canvas, &panel, cells, &colours);
            for &snap in &snaps {
                for pen in [SNAP_RIM, SNAP] {
                    panel.line(canvas, &[snap; 2], &[panel.y.lo, panel.y.hi], pen);
                }
            }
            panel.frame(canvas);
            let room = |open: bool| if open { 12.0 } else { 0.0 };
            bar(layer, &colours).draw(
                canvas,
                panel.right() + 14.0,
                panel.top + room(layer.open[1]),
                panel.bottom() - room(layer.open[0]),
            );
        }
    }))
}

/// The cells, traced for a panel whose top is at 0, in their panel.
fn paint(canvas: &mut Canvas, panel: &Panel, cells: &Cells, colours: &[Colour]) {
    if cells.gaps {
        let (l, t, r, b) = (panel.left, panel.top, panel.right(), panel.bottom());
        canvas.polygon(&[(l, t), (r, t), (r, b), (l, b)], GAP, 1.0);
    }
    cells.paint(canvas, panel.top, colours);
}

fn bar<'a>(layer: &'a Layer, colours: &'a [Colour]) -> ColourBar<'a> {
    ColourBar {
        axis: &layer.scale,
        colours,
        open_below: layer.open[0],
        open_above: layer.open[1],
    }
}

/// The finite values of the columns shown; errs if the list does not have its lengths.
fn values(data: &StrainMap, field: &str, list: &[Vec<f64>], shown: &[usize]) -> Result<Vec<f64>> {
    as_many(FIGURE, field, list.len(), data.time.len(), "times")?;
    for (i, column) in list.iter().enumerate() {
        let name = format!("{field}[{i}]");
        as_many(FIGURE, &name, column.len(), data.s.len(), "arclengths")?;
    }
    let finite = |v: &f64| if v.is_finite() { *v } else { f64::NAN };
    let columns = shown.iter().flat_map(|&i| list[i].iter());
    Ok(columns.map(finite).collect())
}

fn strain_layer(data: &StrainMap, shown: &[usize]) -> Result<Layer> {
    let values = values(data, "strain", &data.strain, shown)?;
    if values.iter().all(|v| v.is_nan()) {
        return Err(Error::domain(format!("{FIGURE}: no strain to show")));
    }
    let largest = values.iter().fold(0f64, |m, v| m.max(v.abs()));
    let range = match data.strain_range {
        Some(range) if !(range > 0.0 && range < 1e300) => {
            return Err(Error::domain(format!(
                "{FIGURE}: strain_range is {range}; it needs to be positive, or left out"
            )));
        }
        Some(range) => range,
        // A straight rod has the colour of zero.
        None if largest > 0.0 => largest.min(1e300),
        None => 1.0,
    };
    let label = if data.strain_label.is_empty() {
        match data.units.length.as_str() {
            "" => "curvature".to_owned(),
            length => format!("curvature (1/{length})"),
        }
    } else {
        data.strain_label.clone()
    };
    Ok(Layer {
        open: [
            values.iter().any(|v| *v < -range),
            values.iter().any(|v| *v > range),
        ],
        levels: values.iter().map(|v| 0.5 + 0.5 * (v / range)).collect(),
        scale: Axis::linear(-range, range, &label, 6),
        colour: diverging,
    })
}

fn dissipation_layer(data: &StrainMap, shown: &[usize]) -> Result<Layer> {
    let values = values(data, "dissipation", &data.dissipation, shown)?;
    let decades = data.decades.unwrap_or(8.0);
    if !(1.0..=40.0).contains(&decades) {
        return Err(Error::domain(format!(
            "{FIGURE}: decades is {decades}; it needs to be from 1 to 40"
        )));
    }
    let largest = values.iter().fold(0f64, |m, v| m.max(*v));
    if !(largest > 1e-250) {
        return Err(Error::domain(format!(
            "{FIGURE}: no dissipation to show, its largest is {largest}; leave the list empty"
        )));
    }
    let floor = 10f64.powf(largest.log10() - decades);
    let label = with_unit("dissipation density", &data.units.power_density());
    let scale = Axis::log(floor, largest, &label, 8);
    // Not `max`, which would turn NaN into the floor.
    let level = |v: &f64| if *v <= floor { 0.0 } else { scale.place(*v) };
    Ok(Layer {
        levels: values.iter().map(level).collect(),
        open: [values.iter().any(|v| *v < floor), false],
        scale,
        colour: sequential,
    })
}

/// Half way between neighbours, closed by the ends.
fn edges(values: &[f64], first: f64, last: f64) -> Vec<f64> {
    let mut edges = vec![first];
    edges.extend(values.windows(2).map(|p| 0.5 * p[0] + 0.5 * p[1]));
    edges.push(last);
    edges
}
