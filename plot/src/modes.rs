//! Mode shapes: rods in equilibrium and displaced both ways, a panel for each mode.

use super::axes::Axis;
use super::canvas::Pen;
use super::data::AxisUnits;
use super::geometry::{along, drawable};
use super::legend::{Entry, Key, Mark, PlottedCurve};
use super::motion::wall;
use super::page::{Height, Page, PageBlock, Width};
use super::painter::Painter;
use super::palette::{Colour, category};
use super::paper::Paper;
use super::scenery::{Scenery, SpaceRod, pen};
use super::spread::Spread;
use snaprod_core::error::{Error, Result};

/// Largest displacement drawn, as a part of the size of the whole, and largest turn, in radians.
const REACH: f64 = 0.125;
const TURN: f64 = 0.35;

/// Modes of vibration.
#[derive(Debug, Clone, Default, PartialEq)]
pub struct ModeShapes {
    /// The rods in equilibrium, each with its supports on the ground.
    pub rods: Vec<SpaceRod>,
    /// The modes.
    pub modes: Vec<ModeShape>,
    /// True if everything lies in the plane z = 0.
    pub planar: bool,
    /// Units.
    pub units: AxisUnits,
}

/// One mode.
#[derive(Debug, Clone, Default, PartialEq)]
pub struct ModeShape {
    /// Title over its panel.
    pub title: String,
    /// Displacements of points and directors of the rods, in any scale. The largest displacement is drawn as
    /// an eighth of the whole, unless a turn would exceed a third of a radian.
    pub rods: Vec<SpaceRod>,
}

/// Draws every mode as SVG: equilibrium as a line, displaced both ways dashed. The directors at the end are
/// drawn for a single rod, and for several if a mode only turns them.
///
/// Fails if there is no mode, or no finite point.
pub fn mode_shapes(data: &ModeShapes, paper: &Paper) -> Result<String> {
    const PANEL: f64 = 265.0;
    let none = || Error::domain("figure of modes: no mode with a finite point to show");
    let all = data
        .rods
        .iter()
        .flat_map(|rod| &rod.points)
        .filter(|p| drawable(p));
    let size = (0..3)
        .map(|k| {
            let (lo, hi) = all
                .clone()
                .fold((f64::INFINITY, f64::NEG_INFINITY), |(lo, hi), p| {
                    (lo.min(p[k]), hi.max(p[k]))
                });
            hi - lo
        })
        .fold(f64::NEG_INFINITY, f64::max);
    if data.modes.is_empty() || !(size > 0.0 && size.is_finite()) {
        return Err(none());
    }
    let extents: Vec<ModeExtent> = data
        .modes
        .iter()
        .map(|mode| ModeExtent::of(mode, size))
        .collect();
    let drawn: Vec<Vec<SpaceRod>> = (data.modes.iter().zip(&extents))
        .map(|(mode, extent)| both_ways(data, mode, extent.amplitude()))
        .collect();
    // One view for all modes.
    let points = drawn.iter().flatten().flat_map(|rod| &rod.points);
    let view = Spread::new(points).ok_or_else(none)?.view();
    let scenery = |(rods, extent): (&Vec<SpaceRod>, &ModeExtent)| {
        // Three triads for each of several rods would cover the rods, so they are drawn only where nothing
        // else shows the motion.
        let triads = data.rods.len() == 1 || extent.turns();
        let mut scenery = Scenery::new(rods, 0.0, false, triads)?;
        scenery.dashed_unnamed = true;
        scenery.view = Some(view);
        Ok(scenery)
    };
    let sceneries = drawn.iter().zip(&extents).map(scenery);
    let mut sceneries: Vec<Scenery> = sceneries.collect::<Result<_>>()?;
    Scenery::share(&mut sceneries);
    let columns = match data.modes.len() {
        0..=2 => data.modes.len(),
        4 => 2,
        _ => 3,
    };
    let mut blocks: Vec<Vec<PageBlock>> = (0..columns).map(|_| Vec::new()).collect();
    for (i, ((mode, rods), scenery)) in data.modes.iter().zip(&drawn).zip(&sceneries).enumerate() {
        let mut block = if data.planar {
            plane(rods, &data.units).ok_or_else(none)?
        } else {
            let stage = |place: [f64; 4]| scenery.stage(&data.units, place);
            let needed = stage([0.0, 0.0, PANEL, PANEL]).height();
            PageBlock::space(needed.clamp(140.0, PANEL), stage, |canvas, stage| {
                let mut painter = Painter::new(stage, !scenery.plane);
                rods.iter()
                    .for_each(|rod| painter.rod(rod, colour(rod), scenery));
                painter.paint(canvas);
            })
        };
        block.title = &mode.title;
        blocks[i % columns].push(block);
    }
    let keys = [(false, "equilibrium"), (true, "displaced both ways")].map(|(unstable, word)| {
        let rod = SpaceRod {
            unstable,
            ..SpaceRod::default()
        };
        Entry::new(Key::Line(pen(&rod, colour(&rod))), word)
    });
    let page = Page::new(
        "Small vibrations about an equilibrium",
        "",
        vec![keys.to_vec()],
    );
    let page = blocks.into_iter().fold(page, |page, blocks| {
        page.column(Width::Panels(PANEL), blocks)
    });
    page.grid().draw(paper)
}

fn colour(rod: &SpaceRod) -> Colour {
    category(usize::from(rod.unstable))
}

/// Extent of a mode: largest displacement and turn, in units of the largest ones drawn.
struct ModeExtent {
    far: f64,
    turned: f64,
}

impl ModeExtent {
    fn of(mode: &ModeShape, size: f64) -> Self {
        let length = |v: &[f64; 3]| v.iter().map(|x| x * x).sum::<f64>().sqrt();
        let points = mode.rods.iter().flat_map(|rod| &rod.points);
        let directors = mode
            .rods
            .iter()
            .flat_map(|rod| rod.directors.iter().flatten());
        Self {
            far: points.map(length).fold(0.0, f64::max) / (REACH * size),
            turned: directors.map(length).fold(0.0, f64::max) / TURN,
        }
    }

    fn amplitude(&self) -> f64 {
        1.0 / self.far.max(self.turned).max(f64::MIN_POSITIVE)
    }

    /// True if the lines of the rods hardly move.
    fn turns(&self) -> bool {
        self.far < 0.1 * self.turned
    }
}

/// The rods, then displaced along the mode and against it, thin and dashed.
fn both_ways(data: &ModeShapes, mode: &ModeShape, amplitude: f64) -> Vec<SpaceRod> {
    let displaced = |by: f64| {
        data.rods
            .iter()
            .zip(&mode.rods)
            .map(move |(rod, moves)| SpaceRod {
                points: rod
                    .points
                    .iter()
                    .zip(&moves.points)
                    .map(|(p, v)| along(*p, by, *v))
                    .collect(),
                directors: rod
                    .directors
                    .iter()
                    .zip(&moves.directors)
                    .map(|(at, moves)| std::array::from_fn(|k| along(at[k], by, moves[k])))
                    .collect(),
                unstable: true,
                ..rod.clone()
            })
    };
    let rest = data.rods.iter().map(|rod| SpaceRod {
        unstable: false,
        ..rod.clone()
    });
    rest.chain(displaced(amplitude))
        .chain(displaced(-amplitude))
        .collect()
}

fn plane<'a>(rods: &'a [SpaceRod], units: &AxisUnits) -> Option<PageBlock<'a>> {
    let of = |rod: &SpaceRod, k: usize| rod.points.iter().map(|p| p[k]).collect::<Vec<f64>>();
    let axis = |k: usize, name: &str| {
        let values: Vec<f64> = rods.iter().flat_map(|rod| of(rod, k)).collect();
        Axis::fit(&values, false, &units.length_of(name), 5)
    };
    let curves = rods.iter().map(|rod| {
        let pen: Pen = pen(rod, colour(rod));
        PlottedCurve::line_of(pen, &of(rod, 0), &of(rod, 1))
    });
    let (x, y) = (axis(0, "x")?, axis(1, "y")?);
    let block = PageBlock::plane(x, y, Height::Equal(140.0, 420.0), curves.collect());
    Some(block.over(move |canvas, panel| {
        for rod in rods {
            let at = |i: usize| panel.at(rod.points[i][0], rod.points[i][1]);
            let Some((first, last)) = rod.ends() else {
                continue;
            };
            let radius = if rod.unstable { 3.5 } else { 5.0 };
            panel.mark(canvas, at(last), Mark::Disc, radius, colour(rod));
            if !rod.unstable && first < last && rod.ground[0].is_some() {
                wall(canvas, at(first), at(first + 1), 11.0);
            }
        }
    }))
}
