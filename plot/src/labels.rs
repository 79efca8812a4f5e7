//! Placement of words beside points: on the least ink, on no mark and no other word.

use super::axes::{LABEL, Panel, SMALL};
use super::canvas::{Canvas, Pen, Side, Type};
use super::geometry::{Pixel, clip, dotted, meet};
use super::palette::INK;
use super::text;

/// Directions of a word from its spot, in order of preference: both sides, below and above.
const WAYS: [(f64, f64); 8] = {
    const D: f64 = std::f64::consts::FRAC_1_SQRT_2;
    [
        (D, -D),
        (1.0, 0.0),
        (D, D),
        (-D, -D),
        (-1.0, 0.0),
        (-D, D),
        (0.0, -1.0),
        (0.0, 1.0),
    ]
};
/// Distances of a word from its spot in pixels, each with a cost relative to a dot of ink.
const DISTANCES: [(f64, f64); 3] = [(7.0, 0.0), (13.0, 0.7), (24.0, 1.6)];

/// Writes each word near its spot on a panel with these lines and marks; a distant word gets a line to its spot.
pub(crate) fn write<'w>(
    canvas: &mut Canvas,
    panel: &Panel,
    lines: impl IntoIterator<Item = &'w Vec<Pixel>>,
    marks: &[Pixel],
    words: &[(Pixel, &str)],
) {
    let edges = panel.edges();
    let lines = lines.into_iter().flat_map(|line| clip(line, edges));
    let ink: Vec<Pixel> = lines.flat_map(|line| dotted(&line, 3.0)).collect();
    let font = Type::new(SMALL, Side::Middle, Side::Middle);
    let mut taken: Vec<[f64; 4]> = Vec::new();
    for &(spot, word) in words.iter().filter(|(_, word)| !word.is_empty()) {
        let (w, h) = (0.5 * text::width(word, SMALL) + 1.5, 0.5 * LABEL);
        let holds = |area: &[f64; 4], p: &Pixel, room: f64| {
            let (across, down) = (
                area[0] - room..area[2] + room,
                area[1] - room..area[3] + room,
            );
            across.contains(&p.0) && down.contains(&p.1)
        };
        let place = |off: f64, way: Pixel| {
            let lean = |c: f64| if c.abs() < 0.1 { 0.0 } else { c.signum() };
            (
                spot.0 + off * way.0 + w * lean(way.0),
                spot.1 + off * way.1 + h * lean(way.1),
            )
        };
        let cost = |at: Pixel| {
            let area = [at.0 - w, at.1 - h, at.0 + w, at.1 + h];
            let outside = area[0] < edges[0] + 2.0
                || area[1] < edges[1] + 2.0
                || area[2] > edges[2] - 2.0
                || area[3] > edges[3] - 2.0;
            ink.iter().filter(|p| holds(&area, p, 0.0)).count() as f64
                + 8.0 * marks.iter().filter(|p| holds(&area, p, 4.5)).count() as f64
                + 30.0 * taken.iter().filter(|o| meet(&area, o, 0.0, 0.0)).count() as f64
                + if outside { 100.0 } else { 0.0 }
        };
        let ways = WAYS.iter().enumerate();
        let ways = ways.flat_map(|(i, &way)| DISTANCES.map(|(off, dear)| (i, way, off, dear)));
        let priced = ways.map(|(i, way, off, dear)| {
            let at = place(off, way);
            (cost(at) + dear + 0.01 * i as f64, at, way, off)
        });
        let Some((_, at, way, off)) = priced.min_by(|a, b| a.0.total_cmp(&b.0)) else {
            continue;
        };
        if off > 20.0 {
            let on = |d: f64| (spot.0 + d * way.0, spot.1 + d * way.1);
            canvas.line(&[on(5.0), on(off - 2.0)], Pen::new(INK, 0.6));
        }
        canvas.halo_text(at, word, font);
        taken.push([at.0 - w, at.1 - h, at.0 + w, at.1 + h]);
    }
}
