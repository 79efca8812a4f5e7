//! Phase portrait of the elastica's equation.

use super::axes::{Axis, Panel, SMALL, TITLE};
use super::canvas::{Canvas, Pen, Side, Type};
use super::data::Curve;
use super::geometry::{Pixel, apart, finite, heading, tangent};
use super::legend::{Entry, Key, Mark, PlottedCurve};
use super::page::{Height, Page, PageBlock, Width};
use super::palette::{Colour, GREY, INK, category};
use super::paper::Paper;
use super::ticks::Tick;
use snaprod_core::error::{Error, Result};
use std::f64::consts::PI;

/// A piece of an orbit that is a solution, in the sense of growing s.
#[derive(Debug, Clone, Default, PartialEq)]
pub struct Arc {
    /// Name in the legend, such as "ABCD: S₁⁺".
    pub name: String,
    /// Points from the clamp to the free end.
    pub curve: Curve,
}

/// A named point.
#[derive(Debug, Clone, Default, PartialEq)]
pub struct NamedPoint {
    /// Name of the point.
    pub name: String,
    /// Position in the phase plane.
    pub at: [f64; 2],
}

/// Phase portrait of psi'' + lam^2 sin psi = 0: abscissa psi, ordinate psi_s / lam.
#[derive(Debug, Clone, Default, PartialEq)]
pub struct Portrait {
    /// Orbits that are not highlighted.
    pub orbits: Vec<Curve>,
    /// The separatrix.
    pub separatrix: Vec<Curve>,
    /// Abscissae of vertical lines: the states at the clamp, psi = -alpha.
    pub verticals: Vec<f64>,
    /// Solutions; arcs of one orbit are drawn side by side, a little outside the orbit.
    pub arcs: Vec<Arc>,
    /// Named points.
    pub points: Vec<NamedPoint>,
}

/// Draws the phase portrait with the arcs that are solutions as SVG. AMV's Fig. 3.12.
///
/// Fails if there is no orbit, separatrix or arc with a finite point.
pub fn phase_portrait(data: &Portrait, paper: &Paper) -> Result<String> {
    let arcs = data.arcs.iter().map(|arc| &arc.curve);
    let curves = data.orbits.iter().chain(&data.separatrix).chain(arcs);
    if !curves.into_iter().any(Curve::has_points) {
        return Err(Error::domain("phase portrait: no orbit to show"));
    }
    let halves = ["−π", "−π/2", "0", "π/2", "π"].into_iter().enumerate();
    let ticks = halves.map(|(i, label)| Tick {
        value: 0.5 * PI * (i as f64 - 2.0),
        label: Some(label.to_string()),
    });
    let x = Axis {
        ticks: ticks.collect(),
        wanted: 0,
        ..Axis::linear(-1.12 * PI, 1.12 * PI, "ψ = θ − α", 5)
    };
    let y = Axis::linear(-2.45, 2.45, "ψₛ / λ", 5);
    let pen = |i: usize| Pen::new(category(i), 2.2);
    let arcs = data.arcs.iter().enumerate();
    let entry = |(i, arc): (usize, &Arc)| Entry::new(Key::Line(pen(i)), arc.name.as_str());
    let page = Page::new(
        "Phase plane of the elastica",
        "",
        vec![arcs.map(entry).collect()],
    );
    let line = |pen: Pen| move |c: &Curve| PlottedCurve::line_of(pen, &c.x, &c.y);
    let orbits = data
        .orbits
        .iter()
        .map(line(Pen::new(Colour(120, 120, 120), 0.9)));
    let curves = orbits
        .chain(data.separatrix.iter().map(line(Pen::new(INK, 1.5))))
        .collect();
    // Many arcs are drawn closer, to stay within the separatrix.
    let spacing = (22.0 / data.arcs.len().max(1) as f64).min(5.5);
    let block = PageBlock::plane(x, y, Height::Equal(0.0, 1e3), curves)
        .without_grid()
        .under(|canvas, panel| {
            panel.level(canvas, 0.0, Pen::new(GREY, 0.8));
            panel.upright(canvas, 0.0, Pen::new(GREY, 0.8));
        })
        .over(move |canvas, panel| {
            for &x in &data.verticals {
                panel.upright(canvas, x, Pen::new(INK, 1.1).dashed(6.0, 4.0));
            }
            for (i, arc) in data.arcs.iter().enumerate() {
                draw_arc(canvas, panel, arc, 5.0 + spacing * i as f64, pen(i));
            }
            for point in &data.points {
                let at = panel.at(point.at[0], point.at[1]);
                panel.mark(canvas, at, Mark::Disc, 3.4, INK);
                if panel.holds(at) {
                    // Beside the point on the inner side: the arcs are outside.
                    let way = heading(at, panel.at(0.0, 0.0)).unwrap_or_default();
                    let beside = (at.0 + 15.0 * way.0, at.1 + 15.0 * way.1);
                    let font = Type::new(TITLE, Side::Middle, Side::Middle);
                    canvas.halo_text(beside, &point.name, font);
                }
            }
            if let Some(&x) = data.verticals.first() {
                let at = panel.at(x, panel.y.hi);
                let font = Type::new(SMALL, Side::Start, Side::Start);
                canvas.halo_text((at.0 + 6.0, at.1 + 6.0), "ψ = −α (clamp)", font);
            }
        });
    page.column(Width::Panels(520.0), vec![block]).draw(paper)
}

/// Draws an arc `off` pixels outside its curve, drifting outwards to keep later turns visible, with a dot at
/// its start and an arrowhead at its end.
fn draw_arc(canvas: &mut Canvas, panel: &Panel, arc: &Arc, off: f64, pen: Pen) {
    let mut points = panel.pixels(&arc.curve.x, &arc.curve.y);
    points.retain(finite);
    points.dedup_by(|a, b| apart(*a, *b) < 1e-3);
    let n = points.len();
    if n < 3 {
        return;
    }
    let middle = panel.at(0.0, 0.0);
    let mut run = 0.0;
    let shifted = (0..n).map(|i| {
        let at = points[i];
        run += apart(points[i.saturating_sub(1)], at);
        let (tx, ty) = tangent(&points, i).unwrap_or((1.0, 0.0));
        let out = if tx * (at.1 - middle.1) - ty * (at.0 - middle.0) < 0.0 {
            -1.0
        } else {
            1.0
        };
        let (nx, ny) = (-out * ty, out * tx);
        // Shift straight up or down at the start, to stay on the vertical line of the clamp.
        let turn = (run / 60.0).min(1.0);
        let steep = off / ny.abs().max(0.35) * ny.signum();
        (
            at.0 + turn * off * nx,
            at.1 + turn * off * ny + (1.0 - turn) * steep,
        )
    });
    let shifted: Vec<Pixel> = shifted.collect();
    let tip = shifted[n - 1];
    // The direction of the end, over some pixels for steadiness.
    let back = shifted.iter().rev().find(|p| apart(**p, tip) > 6.0);
    let (ux, uy) = heading(*back.unwrap_or(&shifted[0]), tip).unwrap_or_default();
    // `d` pixels before the tip, `s` beside.
    let by = |d: f64, s: f64| (tip.0 - d * ux - s * uy, tip.1 - d * uy + s * ux);
    let neck = by(6.0, 0.0);
    let short =
        |p: &&Pixel| (p.0 - tip.0) * ux + (p.1 - tip.1) * uy < -6.0 || apart(**p, tip) > 12.0;
    let mut shaft: Vec<Pixel> = shifted.iter().filter(short).copied().collect();
    shaft.push(neck);
    panel.pixel_line(canvas, &shaft, pen);
    canvas.disc(shifted[0], 2.6, pen.colour, 1.0);
    canvas.polygon(&[tip, by(9.0, 4.5), neck, by(9.0, -4.5)], pen.colour, 1.0);
}
