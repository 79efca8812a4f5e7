//! Maps of the disc: how many stable equilibria there are, and how much energy they hold.

use super::axes::{Axis, Mark, Panel, ROOM_BELOW, TITLE, draw_mark, extent};
use super::canvas::{Canvas, Pen, Side, Type, draw};
use super::contour::{areas, at_least, extend};
use super::data::{AxisUnits, Curve, Field};
use super::legend::{ColourBar, Entry, Key, Legend};
use super::motion::{circle, clamp, disc_panel};
use super::palette::{Colour, GREY, INK, WHITE, category, sequential};
use crate::error::{Error, Result};

/// Folds over the disc and what they bound.
#[derive(Debug, Clone, Default, PartialEq)]
pub struct FoldMap {
    /// The number of stable equilibria at each grid point, NaN off the disc.
    pub counts: Field,
    /// First, second, ... fold curve; each may have several pieces, as by mirror symmetry.
    pub folds: Vec<Vec<Curve>>,
    /// Cusps of the fold curves.
    pub cusps: Vec<[f64; 2]>,
    /// Units and the rod's length.
    pub units: AxisUnits,
}

/// Draws the fold curves over the disc, cusps marked and regions filled and labelled by the number of stable
/// equilibria, as SVG.
///
/// Errs if the counts are no grid or have no value.
pub fn fold_map(data: &FoldMap) -> Result<String> {
    const NAMES: [&str; 6] = [
        "1st fold", "2nd fold", "3rd fold", "4th fold", "5th fold", "6th fold",
    ];
    let range = data.counts.is_sound().then(|| extent(&data.counts.values));
    let (least, most) = range
        .flatten()
        .ok_or_else(|| Error::domain("fold map: no counts of equilibria to show"))?;
    let radius = data.units.radius();
    let mut counts: Vec<f64> = data.counts.values.iter().map(|c| c.round()).collect();
    extend(&data.counts, &mut counts, radius, 7);
    counts.iter_mut().for_each(|c| *c = c.round());
    let (least, most) = (least.round().max(0.0), most.round().clamp(0.0, 1000.0));

    let mut entries = Vec::new();
    let mut inside: Vec<f64> = data.counts.values.clone();
    inside.retain(|c| c.is_finite());
    inside.iter_mut().for_each(|c| *c = c.round());
    inside.sort_by(f64::total_cmp);
    inside.dedup();
    for &count in inside.iter().take(6) {
        let word = if count == 1.0 {
            "equilibrium"
        } else {
            "equilibria"
        };
        let text = format!("{count} stable {word}");
        entries.push(Entry::new(Key::Fill(ground(count)), text));
    }
    for (i, fold) in data.folds.iter().enumerate() {
        if fold.iter().any(Curve::has_points) {
            let name = NAMES.get(i).copied().unwrap_or("further fold");
            entries.push(Entry::new(Key::Line(fold_pen(i)), name));
        }
    }
    if !data.cusps.is_empty() {
        entries.push(Entry::new(Key::Mark(Mark::Diamond, INK), "cusp"));
    }
    let mut panel = disc_panel(&data.units, 470.0);
    let legend = Legend::new(entries, panel.width);
    panel.top = 10.0 + legend.height();
    let size = (panel.right() + 18.0, panel.bottom() + ROOM_BELOW);
    Ok(draw(size.0, size.1, |canvas| {
        legend.draw(canvas, panel.left, 6.0);
        let mut level = least;
        while level <= most {
            fill(
                canvas,
                &panel,
                &data.counts,
                &counts,
                level - 0.5,
                ground(level),
            );
            level += 1.0;
        }
        cut_at_disc(canvas, &panel, radius);
        for (i, fold) in data.folds.iter().enumerate().rev() {
            for piece in fold {
                panel.line(canvas, &piece.x, &piece.y, fold_pen(i));
            }
        }
        for cusp in &data.cusps {
            let at = panel.at(cusp[0], cusp[1]);
            if panel.holds(at) {
                draw_mark(canvas, at, Mark::Diamond, 3.2, INK);
            }
        }
        let font = Type::new(TITLE + 1.0, Side::Middle, Side::Middle);
        let step = panel.width * (data.counts.x[1] - data.counts.x[0])
            / (panel.x.hi - panel.x.lo)
            / data.counts.columns as f64;
        let original: Vec<f64> = data.counts.values.iter().map(|c| c.round()).collect();
        for (count, at, depth) in areas(&data.counts, &original) {
            if depth as f64 * step > 10.0 {
                canvas.text(panel.at(at.0, at.1), &format!("{count}"), font);
            }
        }
        panel.frame(canvas);
    }))
}

/// The fill of a region with `count` stable equilibria: darker for more.
fn ground(count: f64) -> Colour {
    match count as i64 {
        i64::MIN..=0 => Colour(255, 255, 255),
        1 => Colour(226, 236, 245),
        2 => Colour(178, 207, 229),
        3 => Colour(122, 172, 209),
        4 => Colour(78, 134, 184),
        _ => Colour(44, 95, 145),
    }
}

fn fold_pen(i: usize) -> Pen {
    // Vermilion first: it is the one that matters.
    const ORDER: [usize; 6] = [1, 2, 3, 4, 0, 6];
    let width = if i == 0 { 1.6 } else { 1.1 };
    Pen::new(category(ORDER[i % ORDER.len()]), width)
}

fn fill(
    canvas: &mut Canvas,
    panel: &Panel,
    field: &Field,
    values: &[f64],
    level: f64,
    colour: Colour,
) {
    let rings: Vec<Vec<(f64, f64)>> = at_least(field, values, level)
        .into_iter()
        .map(|ring| {
            let pixels: Vec<_> = ring.iter().map(|p| panel.at(p.0, p.1)).collect();
            super::axes::thin(&pixels, 0.12)
        })
        .collect();
    canvas.region(&rings, colour, 1.0);
}

/// Whitens what lies in the panel off the disc, and draws the disc's edge.
fn cut_at_disc(canvas: &mut Canvas, panel: &Panel, radius: f64) {
    let rim = circle(radius);
    let mut hole = panel.pixels(&rim.x, &rim.y);
    let (l, t, r, b) = (panel.left, panel.top, panel.right(), panel.bottom());
    // The rim runs up the screen's y axis backwards, clockwise as seen; the frame the other way.
    let frame = vec![(l, t), (r, t), (r, b), (l, b)];
    canvas.region(&[frame, hole.clone()], WHITE, 1.0);
    hole.push(hole[0]);
    canvas.line(&hole, Pen::new(GREY, 1.1));
}

/// How values become colours.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub enum Scale {
    /// In proportion.
    Linear,
    /// By their square roots: small values are told apart better.
    #[default]
    Sqrt,
    /// By their logarithms; the range must be positive.
    Log,
}

impl Scale {
    fn apply(self, value: f64) -> f64 {
        match self {
            Self::Linear => value,
            // Not `max`, which would turn NaN into 0.
            Self::Sqrt if value < 0.0 => 0.0,
            Self::Sqrt => value.sqrt(),
            Self::Log => value.ln(),
        }
    }

    fn undo(self, value: f64) -> f64 {
        match self {
            Self::Linear => value,
            Self::Sqrt => value * value,
            Self::Log => value.exp(),
        }
    }
}

/// Elastic energies over the disc.
#[derive(Debug, Clone, Default, PartialEq)]
pub struct EnergyLandscape {
    /// Each panel's title and field: the lowest stable equilibrium's energy, the second's if wanted. NaN where
    /// there is none.
    pub panels: Vec<(String, Field)>,
    /// Fold curves drawn over every panel.
    pub folds: Vec<Curve>,
    /// How energies become colours.
    pub scale: Scale,
    /// The range of the colours; by default what holds all values. Energies are unbounded at the disc's edge, so
    /// give an upper end: what lies above it has the last colour.
    pub range: Option<[f64; 2]>,
    /// Units and the rod's length.
    pub units: AxisUnits,
}

/// Draws the energy of equilibria over the disc as filled contours with a common colour bar, as SVG.
///
/// Errs if there is no grid with a value, or the range is empty (or not positive on a logarithmic scale).
pub fn energy_landscape(data: &EnergyLandscape) -> Result<String> {
    const BANDS: usize = 16;
    let fields: Vec<&(String, Field)> = data.panels.iter().filter(|p| p.1.is_sound()).collect();
    let all = fields.iter().flat_map(|p| p.1.values.iter());
    let all = all.filter(|v| data.scale != Scale::Log || **v > 0.0);
    let found =
        extent(all).ok_or_else(|| Error::domain("energy landscape: no energies to show"))?;
    let [lo, hi] = data.range.unwrap_or([found.0, found.1]);
    let (low, high) = (data.scale.apply(lo), data.scale.apply(hi));
    if !(low < high && (high - low).is_finite()) {
        return Err(Error::domain(format!(
            "energy landscape: no range of energies from {lo} to {hi}"
        )));
    }
    let colours: Vec<Colour> = (0..BANDS)
        .map(|i| sequential(i as f64 / (BANDS - 1) as f64))
        .collect();
    let axis = bar_axis(data.scale, lo, hi, &data.units.energy_of("elastic energy"));
    let bar = ColourBar {
        axis: &axis,
        colours: &colours,
        open_below: false,
        open_above: found.1 > hi,
    };

    let side = if fields.len() > 1 { 320.0 } else { 430.0 };
    let first = disc_panel(&data.units, side);
    let fold_shown = data.folds.iter().any(Curve::has_points);
    let entries = if fold_shown {
        vec![Entry::new(Key::Line(ON_COLOUR), "fold")]
    } else {
        Vec::new()
    };
    let legend = Legend::new(entries, side);
    let titled = fields.iter().any(|p| !p.0.is_empty());
    let top = 10.0 + legend.height() + if titled { 20.0 } else { 0.0 };
    let step = side + first.left + 14.0;
    let panels: Vec<Panel> = (0..fields.len())
        .map(|i| Panel {
            left: first.left + i as f64 * step,
            top,
            ..first.clone()
        })
        .collect();
    let end = panels.last().map_or(0.0, Panel::right) + 20.0;
    Ok(draw(end + bar.width(), top + side + ROOM_BELOW, |canvas| {
        legend.draw(canvas, first.left, 6.0);
        for (panel, (title, field)) in panels.iter().zip(&fields) {
            let mut values: Vec<f64> = field
                .values
                .iter()
                .map(|&v| ((data.scale.apply(v) - low) / (high - low)).clamp(0.0, 1.0))
                .collect();
            extend(field, &mut values, data.units.radius(), 7);
            for (i, &colour) in colours.iter().enumerate() {
                fill(
                    canvas,
                    panel,
                    field,
                    &values,
                    i as f64 / BANDS as f64,
                    colour,
                );
            }
            cut_at_disc(canvas, panel, data.units.radius());
            for fold in &data.folds {
                panel.line(canvas, &fold.x, &fold.y, ON_COLOUR_RIM);
                panel.line(canvas, &fold.x, &fold.y, ON_COLOUR);
            }
            clamp(canvas, panel.at(0.0, 0.0));
            panel.title(canvas, title);
            panel.frame(canvas);
        }
        bar.draw(canvas, end, top + 14.0, top + side - 4.0);
    }))
}

const ON_COLOUR: Pen = Pen::new(Colour(213, 60, 0), 1.3);
const ON_COLOUR_RIM: Pen = Pen::new(WHITE, 2.6).alpha(0.8);

/// The colour bar's axis; for square roots round energies at unequal distances.
fn bar_axis(scale: Scale, lo: f64, hi: f64, label: &str) -> Axis {
    match scale {
        Scale::Log => Axis::log(lo, hi, label, 6),
        Scale::Linear => Axis::linear(lo, hi, label, 6),
        Scale::Sqrt => {
            let mut axis = Axis::linear(scale.apply(lo), scale.apply(hi), label, 6);
            let step = (axis.hi - axis.lo) / 6.0;
            let mut ticks = Vec::new();
            let mut last = f64::NEG_INFINITY;
            // Round numbers near equal steps of the root.
            for i in 0..=6 {
                let wanted = scale.undo(axis.lo + i as f64 * step);
                let round = round_to_digit(wanted);
                let at = scale.apply(round);
                if round > last && at >= axis.lo - 1e-9 && at <= axis.hi + 1e-9 {
                    last = round;
                    ticks.push(super::ticks::Tick {
                        value: at,
                        label: Some(plain(round)),
                    });
                }
            }
            axis.ticks = ticks;
            axis
        }
    }
}

/// The nearest number with one digit, or with 5 as its second.
fn round_to_digit(value: f64) -> f64 {
    if value.is_nan() || value <= 0.0 {
        return 0.0;
    }
    let unit = 10f64.powf(value.log10().floor());
    let digits = value / unit;
    let rounded = if digits < 2.75 {
        (2.0 * digits).round() / 2.0
    } else {
        digits.round()
    };
    rounded * unit
}

/// A short number without a needless fraction.
fn plain(value: f64) -> String {
    let rounded: f64 = format!("{value:.2e}").parse().unwrap_or(value);
    if rounded != 0.0 && !(1e-3..1e5).contains(&rounded.abs()) {
        super::text::scientific(rounded)
    } else {
        format!("{rounded}").replace('-', "−")
    }
}
