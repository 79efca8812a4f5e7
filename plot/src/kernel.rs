//! Memory of viscoelastic rods: relaxation functions (or kernels) and creep functions of their ends.

use super::axes::{Axis, Panel, extent};
use super::canvas::{Canvas, Pen};
use super::data::{AxisUnits, as_many};
use super::legend::{Entry, Key, PlottedCurve};
use super::page::{Height, Page, PageBlock, WIDTH, Width};
use super::palette::{GREY, INK, category};
use super::paper::Paper;
use snaprod_core::error::{Error, Result};

/// One component of a matrix of functions of time.
#[derive(Debug, Clone, Default, PartialEq)]
pub struct KernelCurve {
    /// Name with unit, as "m₁–φ₁ (EI/ℓ)". Curves of one name have one colour in both panels and one entry in
    /// the legend.
    pub name: String,
    /// Value at each of the times; values that are not finite break the curve.
    pub values: Vec<f64>,
    /// Value at time 0+: a dashed line at the left.
    pub instantaneous: Option<f64>,
    /// Value as time goes to infinity: a dashed line at the right.
    pub relaxed: Option<f64>,
}

/// Components of a relaxation function (or memory kernel) and of the creep function, up to 6 x 6 of each.
/// Eight differ by colour, as many more by dashes.
#[derive(Debug, Clone, Default, PartialEq)]
pub struct KernelFigure {
    /// Title over the figure; may be empty.
    pub title: String,
    /// Times, in `units.time`, in any order that the curves follow; those that are not positive are left out.
    pub time: Vec<f64>,
    /// Components of the relaxation function: the upper panel.
    pub relaxation: Vec<KernelCurve>,
    /// Components of the creep function: the lower panel. Empty to leave it out.
    pub creep: Vec<KernelCurve>,
    /// The upper vertical axis, with its unit; if empty "relaxation function".
    pub relaxation_label: String,
    /// The lower vertical axis, with its unit; if empty "creep function".
    pub creep_label: String,
    /// Logarithmic vertical axes: values that are not positive are left out.
    pub log: bool,
    /// Units.
    pub units: AxisUnits,
}

const FIGURE: &str = "figure of a kernel";
/// Length of the lines of limits, as a part of the panel's width.
const LIMIT: f64 = 0.5;

/// Draws components of the relaxation and the creep function against the logarithm of time as SVG; lines of
/// limits are dashed in the colour of their curves, at the left for time 0, at the right for infinity.
///
/// Fails without two different positive times, if a curve has not as many values as there are times, or if a
/// panel has curves but no value to show.
pub fn kernel(data: &KernelFigure, paper: &Paper) -> Result<String> {
    let count = data.time.len();
    for (field, curves) in [("relaxation", &data.relaxation), ("creep", &data.creep)] {
        for (i, curve) in curves.iter().enumerate() {
            let name = format!("{field}[{i}].values");
            as_many(FIGURE, &name, curve.values.len(), count, "times")?;
        }
    }
    let (start, end) = extent(data.time.iter().filter(|t| **t > 1e-290))
        .filter(|(start, end)| end > start && *end < 1e290)
        .ok_or_else(|| Error::domain(format!("{FIGURE}: time has no two positive entries")))?;
    let mut names: Vec<&str> = Vec::new();
    for curve in data.relaxation.iter().chain(&data.creep) {
        if !names.contains(&curve.name.as_str()) {
            names.push(&curve.name);
        }
    }
    let names = &names;
    let look = move |c: &KernelCurve| pen(names.iter().position(|n| *n == c.name).unwrap_or(0));

    let label = |given: &str, usual: &str| {
        let label = if given.is_empty() { usual } else { given };
        label.to_string()
    };
    let parts = [
        (
            &data.relaxation,
            label(&data.relaxation_label, "relaxation function"),
        ),
        (&data.creep, label(&data.creep_label, "creep function")),
    ];
    let positive = |curve: &'_ KernelCurve| -> Vec<f64> {
        let seen = data.time.iter().zip(&curve.values);
        let seen = seen.filter(|(t, _)| **t > 0.0).map(|(_, value)| *value);
        seen.chain(curve.instantaneous)
            .chain(curve.relaxed)
            .collect()
    };
    let shown: Vec<_> = parts.iter().filter(|p| !p.0.is_empty()).collect();
    let height = if shown.len() > 1 { 230.0 } else { 320.0 };
    let x = Axis::log(start, end, &data.units.time_of("time t"), 10);
    let mut blocks = Vec::new();
    for (curves, label) in shown {
        let values: Vec<f64> = curves.iter().flat_map(positive).collect();
        let y = Axis::fit(&values, data.log, label, 6)
            .filter(|axis| (axis.hi - axis.lo).is_finite())
            .ok_or_else(|| Error::domain(format!("{FIGURE}: {label}: no value to show")))?;
        let drawn = |c: &KernelCurve| PlottedCurve::line_of(look(c), &data.time, &c.values);
        let drawn = curves.iter().map(drawn).collect();
        let block = PageBlock::plane(x.clone(), y, Height::Pixels(height), drawn);
        blocks.push(block.under(move |canvas, panel| {
            if panel.y.lo < 0.0 && panel.y.hi > 0.0 && !data.log {
                panel.level(canvas, 0.0, Pen::new(GREY, 0.9));
            }
            for curve in curves.iter() {
                limits(canvas, panel, curve, look(curve));
            }
        }));
    }
    if blocks.is_empty() {
        return Err(Error::domain(format!("{FIGURE}: no component to show")));
    }

    let known = names
        .iter()
        .enumerate()
        .filter(|(_, name)| !name.is_empty());
    let entry = |(i, name): (usize, &&str)| Entry::new(Key::Line(pen(i)), *name);
    let mut entries: Vec<Entry> = known.map(entry).collect();
    let mut curves = data.relaxation.iter().chain(&data.creep);
    if curves.any(|c| c.instantaneous.is_some() || c.relaxed.is_some()) {
        let pen = limit(Pen::new(INK, 1.6));
        let name = "instantaneous (left), relaxed (right)";
        entries.push(Entry::new(Key::Line(pen), name));
    }
    let page = Page::new("Memory of a rod", &data.title, vec![entries]);
    page.column(Width::Whole(WIDTH), blocks).draw(paper)
}

/// The pen of the i-th curve: dashes where the colours begin again.
fn pen(i: usize) -> Pen {
    let pen = Pen::new(category(i), 1.7);
    match i / 8 {
        0 => pen,
        1 => pen.dashed(9.0, 4.0),
        2 => pen.dashed(2.5, 3.0),
        _ => pen.dashed(14.0, 3.0),
    }
}

fn limit(pen: Pen) -> Pen {
    Pen { width: 1.0, ..pen }.dashed(4.5, 3.5)
}

/// Draws the limits of a curve at the ends of the panel.
fn limits(canvas: &mut Canvas, panel: &Panel, curve: &KernelCurve, pen: Pen) {
    let (l, r) = (panel.left, panel.right());
    let reach = LIMIT * panel.width;
    for (value, ends) in [
        (curve.instantaneous, [l, l + reach]),
        (curve.relaxed, [r - reach, r]),
    ] {
        if let Some(value) = value {
            let y = panel.at(panel.x.lo, value).1;
            panel.pixel_line(canvas, &ends.map(|x| (x, y)), limit(pen));
        }
    }
}
