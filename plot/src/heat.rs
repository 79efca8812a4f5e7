//! Strain of a rod over time and arclength, and the density of its dissipation.

use super::axes::Axis;
use super::canvas::Pen;
use super::cells::Cells;
use super::data::{AxisUnits, Curve, as_many, rising, with_unit};
use super::energies::snap_name;
use super::legend::{ColourBar, Entry, Key};
use super::page::{Height, Page, PageBlock, Width};
use super::palette::{Colour, INK, WHITE, diverging, sequential};
use super::paper::Paper;
use snaprod_core::error::{Error, Result};

/// A strain of the rod over (t, s), and its dissipation density.
///
/// Each cell reaches half way to its neighbours, the outermost to the first and last time, and to the
/// rod's ends; so times and arclengths need not be evenly spaced.
#[derive(Debug, Clone, Default, PartialEq)]
pub struct StrainMap {
    /// Title over the figure; may be empty.
    pub title: String,
    /// Times of the columns, in `units.time`; they must not fall (two equal ones at a snap).
    pub time: Vec<f64>,
    /// Arclengths of the rows, in `units.length`, rising.
    pub s: Vec<f64>,
    /// `strain[i][j]` is the strain at `time[i]` and `s[j]`. Values that are not finite leave a gap.
    pub strain: Vec<Vec<f64>>,
    /// The strain's name with its unit; if empty "curvature (1/ℓ)" with the unit of length.
    pub strain_label: String,
    /// The strain at the ends of the colour scale, which is symmetric about zero. By default the largest
    /// |strain| shown. Strains of one sign, up to a twentieth of the largest, then have a scale with all colours.
    pub strain_range: Option<f64>,
    /// `dissipation[i][j]` is the power dissipated per length at `time[i]` and `s[j]`, energy / (length x
    /// time); empty to leave the panel out. Values that are not finite leave a gap.
    pub dissipation: Vec<Vec<f64>>,
    /// Number of decades of dissipation with different colours, from 1 to 40, below the largest shown; by
    /// default 8. Smaller values (or zero, or negative roundoff) have the last colour.
    pub decades: Option<f64>,
    /// Times of snaps, in `units.time`: vertical lines.
    pub snaps: Vec<f64>,
    /// Name of the snaps in the legend; if empty "snap".
    pub snaps_name: String,
    /// Characteristics, each a curve of (time, arclength): thin lines.
    pub rays: Vec<Curve>,
    /// Shocks, each a curve of (time, arclength): thick lines.
    pub fronts: Vec<Curve>,
    /// Label of the vertical axis, without its unit; if empty "arclength s".
    pub s_label: String,
    /// The times shown; by default all. Colour scales are fitted to the columns within.
    pub window: Option<[f64; 2]>,
    /// Units and the rod's length.
    pub units: AxisUnits,
}

const FIGURE: &str = "strain map";
/// Fill of cells without a value.
pub(crate) const GAP: Colour = Colour(188, 188, 188);
const SNAP: Pen = Pen::new(INK, 0.9).dashed(4.0, 4.0);
const SNAP_RIM: Pen = Pen::new(WHITE, 1.9).alpha(0.7);

const RAY: Pen = Pen::new(INK, 0.5).alpha(0.55);
const FRONT: Pen = Pen::new(INK, 2.2);

/// One panel: levels between 0 and 1, and their scale.
struct HeatPanel {
    levels: Vec<f64>,
    scale: Axis,
    colour: fn(f64) -> Colour,
    open: [bool; 2],
}

/// Draws the strain over time (across) and arclength (up) in a diverging scale of colours and, if given, the
/// dissipation density below it in a logarithmic one, as SVG. Colours come in 65 steps, in fewer where the
/// field is so rough that the file would exceed about half a megabyte a panel.
///
/// Fails if times or arclengths fall, are not finite or fewer than two, or if the lists do not have their
/// lengths. Fails also if no value is finite, if `strain_range`, `decades` or `window` is not a range, or if
/// no dissipation shown is positive.
pub fn strain_map(data: &StrainMap, paper: &Paper) -> Result<String> {
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
    let length = data.units.length_of(match data.s_label.as_str() {
        "" => "arclength s",
        label => label,
    });
    let y = Axis::linear(y_edges[0], y_edges[data.s.len()], &length, 5);
    let x = Axis::linear(start, end, &data.units.time_of("time t"), 7);
    let across = shown.iter().copied().chain(shown.last().map(|&i| i + 1));
    let across = across
        .map(|i| x.place(x_edges[i]).clamp(0.0, 1.0))
        .collect::<Vec<_>>();
    let up: Vec<f64> = y_edges.iter().map(|&s| y.place(s)).collect();
    let within = |t: &&f64| (start..=end).contains(*t);
    let snaps: Vec<f64> = data.snaps.iter().filter(within).copied().collect();
    let mut entries = Vec::new();
    if !snaps.is_empty() {
        entries.push(Entry::new(Key::Line(SNAP), snap_name(&data.snaps_name)));
    }
    let named = [
        (&data.rays, RAY, "characteristic"),
        (&data.fronts, FRONT, "shock"),
    ];
    for (curves, pen, name) in named {
        if curves.iter().any(Curve::has_points) {
            entries.push(Entry::new(Key::Line(pen), name));
        }
    }
    let (snaps, mut gaps) = (&snaps, false);
    let blocks = layers.into_iter().map(|layer| {
        let cells = Cells::new(&across, &up, &layer.levels);
        gaps |= cells.gaps;
        let colour = |b: usize| (layer.colour)(b as f64 / (cells.bands - 1) as f64);
        let colours: Vec<Colour> = (0..cells.bands).map(colour).collect();
        let bar = ColourBar::new(layer.scale, colours.clone(), layer.open);
        let mut block = PageBlock::plane(x.clone(), y.clone(), Height::Pixels(220.0), Vec::new())
            .without_grid()
            .under(move |canvas, panel| {
                if cells.gaps {
                    canvas.polygon(&panel.ring()[..4], GAP, 1.0);
                }
                cells.paint(canvas, panel, &colours);
                for &snap in snaps {
                    panel.upright(canvas, snap, SNAP_RIM);
                    panel.upright(canvas, snap, SNAP);
                }
                for (curves, pen, _) in named {
                    for curve in curves {
                        let (t, s): (Vec<f64>, Vec<f64>) = curve.points().unzip();
                        panel.line(canvas, &t, &s, pen);
                    }
                }
            });
        block.bar = Some(bar);
        block
    });
    let blocks: Vec<PageBlock> = blocks.collect();
    if gaps {
        entries.push(Entry::new(Key::Fill(GAP), "no value"));
    }
    let page = Page::new("Strain over time and arclength", &data.title, vec![entries]);
    page.column(Width::Whole(700.0), blocks).draw(paper)
}

/// The finite values of the columns shown; fails if the list does not have its lengths.
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

fn strain_layer(data: &StrainMap, shown: &[usize]) -> Result<HeatPanel> {
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
    let label = match data.strain_label.as_str() {
        "" => data.units.curvature(),
        label => label.to_owned(),
    };
    if let Some((lo, hi)) = one_sided(&values).filter(|_| data.strain_range.is_none()) {
        return Ok(HeatPanel {
            open: [false; 2],
            levels: values.iter().map(|v| (v - lo) / (hi - lo)).collect(),
            scale: Axis::linear(lo, hi, &label, 6),
            colour: if hi > -lo {
                sequential
            } else {
                |t| sequential(1.0 - t)
            },
        });
    }
    Ok(HeatPanel {
        open: [
            values.iter().any(|v| *v < -range),
            values.iter().any(|v| *v > range),
        ],
        levels: values.iter().map(|v| 0.5 + 0.5 * (v / range)).collect(),
        scale: Axis::linear(-range, range, &label, 6),
        colour: diverging,
    })
}

/// The range from zero, of values that have one sign up to small exceptions; `None` for all others.
fn one_sided(values: &[f64]) -> Option<(f64, f64)> {
    /// Part of the largest value that values of the other sign stay below.
    const SMALL: f64 = 0.05;
    let (lo, hi) = values
        .iter()
        .fold((0f64, 0f64), |(lo, hi), v| (lo.min(*v), hi.max(*v)));
    let (least, most) = (hi.min(-lo), hi.max(-lo));
    (least < SMALL * most && most < 1e300).then_some((lo, hi))
}

fn dissipation_layer(data: &StrainMap, shown: &[usize]) -> Result<HeatPanel> {
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
    Ok(HeatPanel {
        levels: values.iter().map(level).collect(),
        open: [values.iter().any(|v| *v < floor), false],
        scale,
        colour: sequential,
    })
}

/// Cell edges: half way between neighbours, closed by the ends.
pub(crate) fn edges(values: &[f64], first: f64, last: f64) -> Vec<f64> {
    let mut edges = vec![first];
    edges.extend(values.windows(2).map(|p| 0.5 * p[0] + 0.5 * p[1]));
    edges.push(last);
    edges
}
