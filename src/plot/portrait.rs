//! The phase portrait of the elastica's equation.

use super::axes::{Axis, Mark, Panel, ROOM_BELOW, SMALL, TITLE, draw_mark, room_left, thin};
use super::canvas::{Canvas, Pen, Side, Type, draw};
use super::data::Curve;
use super::legend::{Entry, Key, Legend};
use super::palette::{Colour, GREY, INK, category};
use super::ticks::Tick;
use crate::error::{Error, Result};
use std::f64::consts::PI;

/// A piece of an orbit that is a solution, in the sense in which it is run through.
#[derive(Debug, Clone, Default, PartialEq)]
pub struct Arc {
    /// Its name in the legend, such as "ABCD: S₁⁺".
    pub name: String,
    /// Its points, from the clamp to the free end.
    pub curve: Curve,
}

/// A named point.
#[derive(Debug, Clone, Default, PartialEq)]
pub struct Named {
    /// Its name.
    pub name: String,
    /// Where it is.
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
    /// Solutions; each is drawn a little outside its orbit so that all of one orbit are seen.
    pub arcs: Vec<Arc>,
    /// Named points.
    pub points: Vec<Named>,
}

/// Draws the phase portrait with the arcs that are solutions as SVG. AMV's Fig. 3.12.
///
/// Errs if there is no orbit, separatrix or arc with a finite point.
pub fn phase_portrait(data: &Portrait) -> Result<String> {
    let arcs = data.arcs.iter().map(|arc| &arc.curve);
    let curves = data.orbits.iter().chain(&data.separatrix).chain(arcs);
    if !curves.into_iter().any(Curve::has_points) {
        return Err(Error::domain("phase portrait: no orbit to show"));
    }
    let halves = |n: i32, label: &str| Tick {
        value: 0.5 * PI * f64::from(n),
        label: Some(label.to_string()),
    };
    let x = Axis {
        ticks: vec![
            halves(-2, "−π"),
            halves(-1, "−π/2"),
            halves(0, "0"),
            halves(1, "π/2"),
            halves(2, "π"),
        ],
        ..Axis::linear(-1.12 * PI, 1.12 * PI, "ψ = θ − α", 5)
    };
    let y = Axis::linear(-2.45, 2.45, "ψₛ / λ", 5);
    let left = room_left(&y);
    let width = 520.0;
    let pen = |i: usize| Pen::new(category(i), 2.2);
    let entries = data.arcs.iter().enumerate();
    let legend = Legend::new(
        entries
            .map(|(i, arc)| Entry::new(Key::Line(pen(i)), arc.name.as_str()))
            .collect(),
        width,
    );
    let panel = Panel {
        left,
        top: 10.0 + legend.height(),
        width,
        height: width * (y.hi - y.lo) / (x.hi - x.lo),
        x,
        y,
    };
    let total = (panel.right() + 18.0, panel.bottom() + ROOM_BELOW);
    // Many arcs are drawn closer, to stay within the separatrix.
    let spacing = (22.0 / data.arcs.len().max(1) as f64).min(5.5);
    Ok(draw(total.0, total.1, |canvas| {
        legend.draw(canvas, left, 6.0);
        let thin_line = Pen::new(GREY, 0.8);
        panel.line(canvas, &[-4.0, 4.0], &[0.0, 0.0], thin_line);
        panel.line(canvas, &[0.0, 0.0], &[-4.0, 4.0], thin_line);
        for orbit in &data.orbits {
            panel.line(
                canvas,
                &orbit.x,
                &orbit.y,
                Pen::new(Colour(120, 120, 120), 0.9),
            );
        }
        for branch in &data.separatrix {
            panel.line(canvas, &branch.x, &branch.y, Pen::new(INK, 1.5));
        }
        for &x in &data.verticals {
            let pen = Pen::new(INK, 1.1).dashed(6.0, 4.0);
            panel.line(canvas, &[x, x], &[panel.y.lo, panel.y.hi], pen);
        }
        for (i, arc) in data.arcs.iter().enumerate() {
            draw_arc(canvas, &panel, arc, 5.0 + spacing * i as f64, pen(i));
        }
        for point in &data.points {
            let at = panel.at(point.at[0], point.at[1]);
            if panel.holds(at) {
                draw_mark(canvas, at, Mark::Disc, 3.4, INK);
                // Beside the point on the inner side: the arcs are outside.
                let middle = panel.at(0.0, 0.0);
                let (dx, dy) = (middle.0 - at.0, middle.1 - at.1);
                let length = dx.hypot(dy).max(1.0);
                let beside = (at.0 + 15.0 * dx / length, at.1 + 15.0 * dy / length);
                let font = Type::new(TITLE, Side::Middle, Side::Middle);
                canvas.halo_text(beside, &point.name, font);
            }
        }
        if let Some(&x) = data.verticals.first() {
            let at = panel.at(x, panel.y.hi);
            let font = Type::new(SMALL, Side::Start, Side::Start);
            canvas.halo_text((at.0 + 6.0, at.1 + 6.0), "ψ = −α (clamp)", font);
        }
        panel.frame(canvas);
    }))
}

/// Draws an arc `off` pixels outside its curve, drifting outwards so that later turns are seen, with
/// a dot where it starts and an arrowhead where it ends.
fn draw_arc(canvas: &mut Canvas, panel: &Panel, arc: &Arc, off: f64, pen: Pen) {
    let mut points = panel.pixels(&arc.curve.x, &arc.curve.y);
    points.retain(|p| p.0.is_finite() && p.1.is_finite());
    points.dedup_by(|a, b| (a.0 - b.0).hypot(a.1 - b.1) < 1e-3);
    let n = points.len();
    if n < 3 {
        return;
    }
    let middle = panel.at(0.0, 0.0);
    // Pixels from the start.
    let mut length = vec![0.0; n];
    for i in 1..n {
        let (a, b) = (points[i - 1], points[i]);
        length[i] = length[i - 1] + (b.0 - a.0).hypot(b.1 - a.1);
    }
    let shifted: Vec<(f64, f64)> = (0..n)
        .map(|i| {
            let (a, b) = (points[i.saturating_sub(1)], points[(i + 1).min(n - 1)]);
            let (tx, ty) = (b.0 - a.0, b.1 - a.1);
            let speed = tx.hypot(ty).max(1e-9);
            let (mut nx, mut ny) = (-ty / speed, tx / speed);
            if nx * (points[i].0 - middle.0) + ny * (points[i].1 - middle.1) < 0.0 {
                (nx, ny) = (-nx, -ny);
            }
            // Straight up or down at the start, so that it stays on the vertical line of the clamp.
            let turn = (length[i] / 60.0).min(1.0);
            let steep = off / ny.abs().max(0.35);
            (
                points[i].0 + turn * off * nx,
                points[i].1 + turn * off * ny + (1.0 - turn) * steep * ny.signum(),
            )
        })
        .collect();
    let tip = shifted[n - 1];
    // The direction of the end, over some pixels for steadiness.
    let back = shifted
        .iter()
        .rev()
        .find(|p| (p.0 - tip.0).hypot(p.1 - tip.1) > 6.0)
        .unwrap_or(&shifted[0]);
    let (dx, dy) = (tip.0 - back.0, tip.1 - back.1);
    let length = dx.hypot(dy).max(1e-9);
    let (ux, uy) = (dx / length, dy / length);
    let neck = (tip.0 - 6.0 * ux, tip.1 - 6.0 * uy);
    let mut shaft: Vec<_> = shifted
        .iter()
        .copied()
        .filter(|p| {
            (p.0 - tip.0) * ux + (p.1 - tip.1) * uy < -6.0
                || (p.0 - tip.0).hypot(p.1 - tip.1) > 12.0
        })
        .collect();
    shaft.push(neck);
    panel.pixel_line(canvas, &thin(&shaft, 0.05), pen);
    canvas.disc(shifted[0], 2.6, pen.colour, 1.0);
    let wing = |s: f64| {
        (
            tip.0 - 9.0 * ux - s * 4.5 * uy,
            tip.1 - 9.0 * uy + s * 4.5 * ux,
        )
    };
    canvas.polygon(&[tip, wing(1.0), neck, wing(-1.0)], pen.colour, 1.0);
}
