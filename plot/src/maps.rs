//! Maps of the disc: the number of stable equilibria, and their energies.

use super::axes::{Axis, Panel, Scale, TITLE, extent};
use super::canvas::{Canvas, Pen, Side, Type};
use super::contour::{areas, at_least, extend};
use super::data::{AxisUnits, Curve, Field};
use super::geometry::{Pixel, thin};
use super::legend::{ColourBar, Entry, Key, Mark, PlottedCurve, named};
use super::motion::{circle, disc_axes, wall};
use super::page::{Height, Page, PageBlock, Width};
use super::palette::{Colour, GREY, INK, WHITE, category, sequential};
use super::paper::Paper;
use snaprod_core::error::{Error, Result};

/// Folds over the disc and the regions between them.
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
/// Fails if the counts are no grid or have no value.
pub fn fold_map(data: &FoldMap, paper: &Paper) -> Result<String> {
    const NAMES: [&str; 6] = [
        "1st fold", "2nd fold", "3rd fold", "4th fold", "5th fold", "6th fold",
    ];
    let range = data.counts.is_sound().then(|| extent(&data.counts.values));
    let (least, most) = range
        .flatten()
        .ok_or_else(|| Error::domain("fold map: no counts of equilibria to show"))?;
    let radius = data.units.radius();
    let rounded: Vec<f64> = data.counts.values.iter().map(|c| c.round()).collect();
    let mut counts = rounded.clone();
    extend(&data.counts, &mut counts, radius, 7);
    counts.iter_mut().for_each(|c| *c = c.round());
    let (least, most) = (least.round().max(0.0), most.round().clamp(0.0, 1000.0));

    let mut inside: Vec<f64> = rounded.iter().copied().filter(|c| c.is_finite()).collect();
    inside.sort_by(f64::total_cmp);
    inside.dedup();
    let counted = inside.iter().take(6).map(|&count| {
        let word = if count == 1.0 {
            "equilibrium"
        } else {
            "equilibria"
        };
        Entry::new(Key::Fill(ground(count)), format!("{count} stable {word}"))
    });
    let mut entries: Vec<Entry> = counted.collect();
    let mut curves = Vec::new();
    for (i, fold) in data.folds.iter().enumerate() {
        let mut name = NAMES.get(i).copied().unwrap_or("further fold");
        for piece in fold.iter().filter(|piece| piece.has_points()) {
            curves.push(PlottedCurve::new(
                Key::Line(fold_pen(i)),
                name,
                &piece.x,
                &piece.y,
            ));
            name = "";
        }
    }
    entries.extend(named(&curves));
    // The first fold matters most: it lies on top.
    curves.reverse();
    if !data.cusps.is_empty() {
        entries.push(Entry::new(Key::Mark(Mark::Diamond, INK), "cusp"));
    }
    let (x, y) = disc_axes(&data.units);
    let block = PageBlock::plane(x, y, Height::Equal(0.0, 1e3), curves)
        .without_grid()
        .under(|canvas, panel| {
            for level in (0..=(most - least) as usize).map(|i| least + i as f64) {
                fill(
                    canvas,
                    panel,
                    &data.counts,
                    &counts,
                    level - 0.5,
                    ground(level),
                );
            }
            cut_at_disc(canvas, panel, radius);
        })
        .over(|canvas, panel| {
            for cusp in &data.cusps {
                panel.mark(canvas, panel.at(cusp[0], cusp[1]), Mark::Diamond, 3.2, INK);
            }
            let font = Type::new(TITLE + 1.0, Side::Middle, Side::Middle);
            let field = &data.counts;
            let step = panel.at(field.x[1], 0.0).0 - panel.at(field.x[0], 0.0).0;
            for (count, at, depth) in areas(field, &rounded) {
                if depth as f64 * step > 10.0 * field.columns as f64 {
                    canvas.text(panel.at(at.0, at.1), &format!("{count}"), font);
                }
            }
        });
    let page = Page::new("Folds and numbers of stable equilibria", "", vec![entries]);
    page.column(Width::Panels(470.0), vec![block]).draw(paper)
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
    // Vermilion for the first fold, which matters most.
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
    let rings = at_least(field, values, level).into_iter().map(|ring| {
        let pixels: Vec<Pixel> = ring.iter().map(|p| panel.at(p.0, p.1)).collect();
        thin(&pixels, 0.12)
    });
    canvas.region(&rings.collect::<Vec<_>>(), colour, 1.0);
}

/// Whitens the panel outside the disc, and draws the disc's edge.
fn cut_at_disc(canvas: &mut Canvas, panel: &Panel, radius: f64) {
    let rim = circle(radius);
    let mut hole = panel.pixels(&rim.x, &rim.y);
    // The rim runs up the screen's y axis backwards, clockwise as seen; the frame the other way.
    let frame = panel.ring()[..4].to_vec();
    canvas.region(&[frame, hole.clone()], WHITE, 1.0);
    hole.push(hole[0]);
    canvas.line(&hole, Pen::new(GREY, 1.1));
}

/// Elastic energies over the disc.
#[derive(Debug, Clone, Default, PartialEq)]
pub struct EnergyLandscape {
    /// Title and field of each panel: energy of the lowest stable equilibrium, and of the second if wanted.
    /// NaN for none.
    pub panels: Vec<(String, Field)>,
    /// Fold curves drawn over every panel.
    pub folds: Vec<Curve>,
    /// Scale from energies to colours.
    pub scale: Scale,
    /// Range of the colours; by default it holds all values. Energies are unbounded at the disc's edge, so
    /// give an upper end: larger values have the last colour.
    pub range: Option<[f64; 2]>,
    /// Units and the rod's length.
    pub units: AxisUnits,
}

/// Draws the energy of equilibria over the disc as filled contours with a common colour bar, as SVG.
///
/// Fails if there is no grid with a value, or the range is empty (or not positive on a logarithmic scale).
pub fn energy_landscape(data: &EnergyLandscape, paper: &Paper) -> Result<String> {
    const BANDS: usize = 16;
    let fields: Vec<&(String, Field)> = data.panels.iter().filter(|p| p.1.is_sound()).collect();
    let all = fields.iter().flat_map(|p| p.1.values.iter());
    let all = all.filter(|v| data.scale != Scale::Log || **v > 0.0);
    let found =
        extent(all).ok_or_else(|| Error::domain("energy landscape: no energies to show"))?;
    let [lo, hi] = data.range.unwrap_or([found.0, found.1]);
    let span = data.scale.apply(hi) - data.scale.apply(lo);
    if !(span > 0.0 && span.is_finite()) {
        return Err(Error::domain(format!(
            "energy landscape: no range of energies from {lo} to {hi}"
        )));
    }
    let colours = (0..BANDS).map(|i| sequential(i as f64 / (BANDS - 1) as f64));
    let colours: Vec<Colour> = colours.collect();
    let label = data.units.energy_of("elastic energy");
    let axis = Axis::scaled(data.scale, lo, hi, &label, 6);
    let last = fields.len() - 1;
    let radius = data.units.radius();
    let curves = |pen: Pen| {
        data.folds
            .iter()
            .map(move |f| PlottedCurve::line_of(pen, &f.x, &f.y))
    };
    let curves: Vec<PlottedCurve> = curves(ON_COLOUR_RIM).chain(curves(ON_COLOUR)).collect();
    let entries = if data.folds.iter().any(Curve::has_points) {
        vec![Entry::new(Key::Line(ON_COLOUR), "fold")]
    } else {
        Vec::new()
    };
    let side = if last > 0 { 320.0 } else { 430.0 };
    let mut page = Page::new("Energy of equilibria", "", vec![entries]);
    for (i, (title, field)) in fields.into_iter().enumerate() {
        let level = |&v: &f64| axis.place(v).clamp(0.0, 1.0);
        let mut values: Vec<f64> = field.values.iter().map(level).collect();
        extend(field, &mut values, radius, 7);
        let (x, y) = disc_axes(&data.units);
        let filled = colours.clone();
        let mut block = PageBlock::plane(x, y, Height::Equal(0.0, 1e3), curves.clone())
            .without_grid()
            .under(move |canvas, panel| {
                for (k, &colour) in filled.iter().enumerate() {
                    let level = k as f64 / BANDS as f64;
                    fill(canvas, panel, field, &values, level, colour);
                }
                cut_at_disc(canvas, panel, radius);
            })
            .over(|canvas, panel| wall(canvas, panel.at(0.0, 0.0), panel.at(1.0, 0.0), 13.0));
        block.title = title;
        if i == last {
            let bar = ColourBar::new(axis.clone(), colours.clone(), [false, found.1 > hi]);
            block.bar = Some(bar);
        }
        page = page.column(Width::Panels(side), vec![block]);
    }
    page.draw(paper)
}

const ON_COLOUR: Pen = Pen::new(Colour(213, 60, 0), 1.3);
const ON_COLOUR_RIM: Pen = Pen::new(WHITE, 2.6).alpha(0.8);
