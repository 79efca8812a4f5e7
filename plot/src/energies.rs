//! Energies of a motion and the error of their ledger.

use super::axes::{Axis, Panel, extent};
use super::canvas::{Canvas, Pen};
use super::data::AxisUnits;
use super::history::{History, thinned};
use super::legend::{Entry, Key, PlottedCurve, named};
use super::page::{Height, Page, PageBlock, WIDTH, Width};
use super::palette::{ALARM, INK, category};
use super::paper::Paper;
use super::text;
use snaprod_core::error::{Error, Result};

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
    /// Name of the potential energy in the legend; if empty "potential".
    pub potential_name: String,
    /// Energy lost in snaps and to friction so far.
    pub dissipated: Vec<f64>,
    /// Work of the driven clamp and of time-dependent loads so far.
    pub work: Vec<f64>,
    /// Kinetic, of mass and rod, + elastic + potential.
    pub total: Vec<f64>,
    /// Error of the ledger: the change of kinetic + elastic + potential + dissipated - work.
    pub error: Vec<f64>,
    /// Times of snaps.
    pub snaps: Vec<f64>,
    /// Name of the snaps in the legend; if empty "snap".
    pub snaps_name: String,
    /// Units.
    pub units: AxisUnits,
}

/// Draws the energies against time and, below, the size of the ledger's error on a logarithmic scale, as SVG;
/// snaps are vertical lines. An initial elastic or potential energy that would hide the motion is subtracted
/// from that energy and from the total, as their names say. Losses and work more than five times as large as all
/// other terms have a panel of their own.
///
/// Fails without two different finite times or without energies.
pub fn energies(data: &Energies, paper: &Paper) -> Result<String> {
    let (start, end) = extent(&data.time)
        .filter(|(start, end)| end > start)
        .ok_or_else(|| Error::domain("figure of energies: no span of time"))?;
    let change = largest_change(data);
    let [elastic, potential] = [&data.elastic, &data.potential].map(|term| base(term, change));
    let potential_name = match data.potential_name.as_str() {
        "" => "potential",
        given => given,
    };
    let all = [
        ("kinetic", &data.kinetic, 0.0),
        ("elastic", &data.elastic, elastic),
        (potential_name, &data.potential, potential),
        ("dissipated", &data.dissipated, 0.0),
        ("work", &data.work, 0.0),
        ("kinetic of the rod", &data.rod_kinetic, 0.0),
        ("total mechanical", &data.total, elastic + potential),
    ];
    let used = all.into_iter().zip([0, 1, 2, 3, 4, 5, 6]);
    let used = used.filter(|((_, values, _), _)| !values.is_empty());
    let told: Vec<Vec<f64>> = (used.clone())
        .map(|((_, values, less), _)| values.iter().map(|v| v - less).collect())
        .collect();
    let histories: Vec<History> = (used.clone().zip(&told))
        .map(|(((name, _, less), colour), values)| {
            let pen = match name {
                "total mechanical" => Pen::new(INK, 1.6),
                "work" => Pen::new(category(colour), 1.5).dashed(6.0, 4.0),
                _ => Pen::new(category(colour), 1.5),
            };
            History::new(
                &without(name, less, &data.units.energy),
                pen,
                &data.time,
                values,
            )
        })
        .collect();
    let curves: Vec<PlottedCurve> = histories.iter().map(|one| one.line.clone()).collect();
    // Losses and work that add up would flatten all others: they then have a panel of their own.
    let adds_up = |name: &str| ["dissipated", "work"].contains(&name);
    let most = |up: bool| {
        let of = used.clone().zip(&told);
        let of = of.filter(|(((name, ..), _), _)| adds_up(name) == up);
        let spans = of.filter_map(|(_, values)| extent(values));
        spans.fold(0.0, |most, (low, high)| {
            f64::max(most, high.max(0.0) - low.min(0.0))
        })
    };
    let apart = most(false) > 0.0 && most(true) > APART * most(false);
    let (mut above, mut beside) = (Vec::new(), Vec::new());
    for ((((name, ..), _), values), history) in used.clone().zip(&told).zip(&histories) {
        let to = if apart && adds_up(name) {
            &mut beside
        } else {
            &mut above
        };
        to.push((values, history));
    }
    let sizes = used.flat_map(|((_, values, _), _)| values.iter().filter(|v| v.is_finite()));
    let largest = sizes.fold(0.0, |most, v| f64::max(most, v.abs()));
    let mut entries = named(&curves);
    if !data.snaps.is_empty() {
        entries.push(Entry::new(Key::Line(SNAP), snap_name(&data.snaps_name)));
    }
    let x = Axis::linear(start, end, &data.units.time_of("time t"), 8);
    let snaps = |canvas: &mut Canvas, panel: &Panel| snap_lines(canvas, panel, &data.snaps);
    let panel = |of: &[(&Vec<f64>, &History)], height: f64| -> Result<PageBlock> {
        let values = of.iter().flat_map(|(values, _)| values.iter());
        let y = Axis::fit(values, false, &data.units.energy_of("energy"), 6)
            .ok_or_else(|| Error::domain("figure of energies: no energy to show"))?;
        let curves = of.iter().map(|(_, history)| history.line.clone()).collect();
        let histories: Vec<History> = of.iter().map(|(_, history)| (*history).clone()).collect();
        let block = PageBlock::plane(x.clone(), y, Height::Pixels(height), curves);
        Ok(block.under(move |canvas, panel| {
            histories.iter().for_each(|one| one.band(canvas, panel));
            snaps(canvas, panel);
        }))
    };
    let mut blocks = vec![panel(&above, if apart { 190.0 } else { 250.0 })?];
    if apart {
        blocks.push(panel(&beside, 110.0)?);
    }
    let rounding = ROUNDING * largest;
    // A NaN is no rounding.
    if data.error.iter().all(|e| e.abs() <= rounding) {
        let said = if data.error.is_empty() {
            String::new()
        } else {
            closed_to(rounding, &data.units.energy)
        };
        let page = Page::new("Energies of a motion", &said, vec![entries]);
        return page.column(Width::Whole(WIDTH), blocks).draw(paper);
    }
    let error_axis = error_scale(&data.error, rounding, &data.units);
    let sizes = data.error.iter().map(|e| e.abs().max(error_axis.lo));
    let (time, sizes) = thinned(&data.time, &sizes.collect::<Vec<_>>());
    let error = PlottedCurve::line_of(Pen::new(category(0), 1.0), &time, &sizes);
    let lower =
        PageBlock::plane(x.clone(), error_axis, Height::Pixels(110.0), vec![error]).under(snaps);
    blocks.push(lower);
    let page = Page::new("Energies of a motion", "", vec![entries]);
    page.column(Width::Whole(WIDTH), blocks).draw(paper)
}

/// Initial value of a term if it would hide the motion, that is if nothing changes by more than a small part
/// of it; else 0. A motion at rest has nothing to hide.
fn base(term: &[f64], change: f64) -> f64 {
    let start = term.first().copied().unwrap_or(0.0).abs();
    let hides = change < HIDES * start && change > REST * start;
    if hides { term[0] } else { 0.0 }
}

/// The largest change of any term.
fn largest_change(data: &Energies) -> f64 {
    let terms = [
        &data.kinetic,
        &data.rod_kinetic,
        &data.elastic,
        &data.potential,
        &data.dissipated,
        &data.work,
    ];
    let spans = terms.into_iter().filter_map(extent);
    spans.fold(0.0, |most, (low, high)| f64::max(most, high - low))
}

/// The name of a term less a number.
fn without(name: &str, less: f64, unit: &str) -> String {
    let (sign, size) = match less {
        0.0 => return name.to_owned(),
        less if less < 0.0 => ('+', -less),
        less => ('−', less),
    };
    let told = format!("{name} {sign} {} {unit}", text::short(size, 4));
    told.trim_end().to_owned()
}

/// Name of a snap in the legend.
pub(crate) fn snap_name(given: &str) -> &str {
    match given {
        "" => "snap",
        given => given,
    }
}

/// Size of losses and work, in that of the other terms, from which they have a panel of their own.
const APART: f64 = 5.0;
/// Largest change, as a part of a term, at which the term hides the change; smallest change that is more than
/// the rounding of a motion at rest.
const HIDES: f64 = 0.25;
const REST: f64 = 1e-6;
pub(crate) const SNAP: Pen = Pen::new(ALARM, 0.9).dashed(4.0, 3.0);
/// Most snaps with a full line each; of more only the ends of the lines are drawn, which leaves the curves visible.
const LINES: usize = 40;
/// Rounding of the sums, relative to the largest energy.
const ROUNDING: f64 = 8.0 * f64::EPSILON;

/// A sentence with the bound of the error, one digit, rounded up.
fn closed_to(rounding: f64, unit: &str) -> String {
    let digit = 10f64.powf(rounding.log10().floor());
    let bound = if rounding > 0.0 {
        text::short((rounding / digit).ceil() * digit, 1)
    } else {
        "0".to_owned()
    };
    format!("the ledger closes to {bound} {unit}")
        .trim_end()
        .to_owned()
        + ", its rounding"
}

/// Draws a line at each snap, or a short one at the upper edge if there are many.
pub(crate) fn snap_lines(canvas: &mut Canvas, panel: &Panel, snaps: &[f64]) {
    const SHORT: f64 = 7.0;
    if snaps.len() <= LINES {
        return snaps
            .iter()
            .for_each(|snap| panel.upright(canvas, *snap, SNAP));
    }
    let mut last = f64::NEG_INFINITY;
    for snap in snaps {
        let at = panel.at(*snap, panel.y.hi);
        // Closer lines would cover each other.
        if panel.holds(at) && (at.0 - last).abs() > 0.3 {
            last = at.0;
            canvas.line(&[at, (at.0, at.1 + SHORT)], Pen { dash: None, ..SNAP });
        }
    }
}

/// The axis of |error|: from rounding, or from ten decades below the largest error, since an accidentally
/// exact step says nothing.
fn error_scale(error: &[f64], rounding: f64, units: &AxisUnits) -> Axis {
    let sizes: Vec<f64> = error.iter().map(|e| e.abs()).filter(|e| *e > 0.0).collect();
    let (lo, hi) = extent(&sizes).unwrap_or((1e-17, 1e-15));
    let top = 10f64.powf((hi.log10() + 0.2).ceil()).clamp(1e-290, 1e300);
    let bottom = 10f64.powf(lo.max(rounding).log10().floor());
    let bottom = bottom.max(1e-10 * top);
    let label = units.energy_of("|error|");
    Axis::log(bottom, top.max(10.0 * bottom), &label, 4)
}
