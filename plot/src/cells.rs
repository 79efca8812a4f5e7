//! Grids of coloured cells, drawn without seams.
//!
//! Cells that merely touch show hairlines of the paper between them if a viewer smooths edges. So the colours
//! are stacked: the area of all cells of band k and above is painted as one, then that of band k + 1 over it.
//! The paper is never seen, and a smooth field costs its level lines, not its cells.

use super::axes::Panel;
use super::canvas::Canvas;
use super::contour::rings;
use super::geometry::Pixel;
use super::palette::Colour;
use std::collections::BTreeSet;

/// Numbers of colour bands to try; the first that is small enough as SVG is taken.
const BANDS: [usize; 4] = [65, 33, 17, 9];
/// Most corners of a map; each takes about 11 bytes.
const CORNERS: usize = 40_000;
/// Number of columns of a panel that can be resolved: a tenth of a pixel each.
const FINEST: f64 = 5000.0;

type Ring = Vec<Pixel>;

/// A traced grid.
pub(crate) struct Cells {
    /// Number of colours, odd.
    pub bands: usize,
    /// Occurring bands, rising, each with the outline of its cells and of all higher ones.
    areas: Vec<(usize, Vec<Ring>)>,
    /// True if a cell has no value.
    pub gaps: bool,
}

impl Cells {
    /// Traces `levels` in [0, 1] (NaN for a gap), column by column. The cell between `x[i]`, `x[i + 1]` and `y[j]`,
    /// `y[j + 1]` (as parts of the panel from its lower left corner) has the level `levels[i * (y.len() - 1) + j]`.
    pub(crate) fn new(x: &[f64], y: &[f64], levels: &[f64]) -> Self {
        Self::banded(x, y, levels, &BANDS)
    }

    /// As `new`, with the first of `bands_tried` that is small enough as SVG, or the last.
    pub(crate) fn banded(x: &[f64], y: &[f64], levels: &[f64], bands_tried: &[usize]) -> Self {
        let rows = y.len().saturating_sub(1);
        // Columns below the drawing's resolution are dropped, and their neighbours extended to meet.
        let seen = |i: &usize| (FINEST * x[*i]).round() != (FINEST * x[i + 1]).round();
        let columns: Vec<usize> = (0..x.len().saturating_sub(1)).filter(seen).collect();
        let mut edges: Vec<f64> = columns.iter().map(|&i| x[i]).collect();
        edges.extend(columns.last().map(|&i| x[i + 1]));
        let level = |c: usize, j: usize| levels[columns[c] * rows + j];
        let cells = columns.len() * rows;
        let gaps = (0..cells).any(|m| level(m / rows, m % rows).is_nan());

        let (mut bands, mut areas) = (0, Vec::new());
        for &tried in bands_tried {
            let heights: Vec<usize> = (0..cells)
                .map(|m| height_of(level(m / rows, m % rows), tried))
                .collect();
            let at = |(i, j): (usize, usize)| (edges[i], y[j]);
            let pixels = |ring: Vec<(usize, usize)>| ring.into_iter().map(at).collect();
            let all = outlines(columns.len(), rows, &heights).into_iter();
            bands = tried;
            areas = all
                .enumerate()
                .filter(|(k, _)| heights.contains(&(k + 1)))
                .map(|(k, rings)| (k, rings.into_iter().map(pixels).collect()))
                .collect();
            if corners(&areas) <= CORNERS {
                break;
            }
        }
        Self { bands, areas, gaps }
    }

    /// Paints the areas, band k in the k-th of `bands` colours.
    pub(crate) fn paint(&self, canvas: &mut Canvas, panel: &Panel, colours: &[Colour]) {
        let at = |p: &Pixel| {
            (
                panel.left + p.0 * panel.width,
                panel.bottom() - p.1 * panel.height,
            )
        };
        for ((_, rings), colour) in self.areas.iter().map(|area| (area, colours[area.0])) {
            let rings: Vec<Ring> = rings
                .iter()
                .map(|ring| ring.iter().map(at).collect())
                .collect();
            canvas.region(&rings, colour, 1.0);
        }
    }
}

/// Number of points of the areas, with the bridges to their rings.
fn corners(areas: &[(usize, Vec<Ring>)]) -> usize {
    let rings = areas.iter().flat_map(|area| &area.1);
    rings.map(|ring| ring.len() + 2).sum()
}

/// 1 + the band of a level; 0 for a gap.
fn height_of(level: f64, bands: usize) -> usize {
    if level.is_nan() {
        0
    } else {
        1 + ((level.clamp(0.0, 1.0) * bands as f64) as usize).min(bands - 1)
    }
}

/// For every k from 0 the rings around the grid cells higher than k, as corners (column edge, row edge). The
/// cells lie always on the same side, so holes run the other way round.
fn outlines(columns: usize, rows: usize, heights: &[usize]) -> Vec<Vec<Vec<(usize, usize)>>> {
    let highest = heights.iter().copied().max().unwrap_or(0);
    let mut edges = vec![BTreeSet::new(); highest];
    for (i, j) in (0..columns * rows).map(|m| (m / rows, m % rows)) {
        let height = heights[i * rows + j];
        let corners = [(i, j), (i + 1, j), (i + 1, j + 1), (i, j + 1)];
        // Below the first column or row indices wrap round to large ones.
        let (left, below) = (i.wrapping_sub(1), j.wrapping_sub(1));
        let beyond = [(i, below), (i + 1, j), (i, j + 1), (left, j)];
        for (side, (p, q)) in beyond.into_iter().enumerate() {
            let outside = !(p < columns && q < rows);
            let lower = if outside { 0 } else { heights[p * rows + q] };
            if lower < height {
                let ends = [side, (side + 1) % 4].map(|k| corners[k].0 * (rows + 1) + corners[k].1);
                for set in &mut edges[lower..height] {
                    set.insert((ends[0], ends[1]));
                }
            }
        }
    }
    let corner = |m: usize| (m / (rows + 1), m % (rows + 1));
    let turning = |ring: Vec<usize>| bends(&ring.into_iter().map(corner).collect::<Vec<_>>());
    edges
        .into_iter()
        .map(|set| rings(set).into_iter().map(turning).collect())
        .collect()
}

/// The corners of a ring, without its collinear points.
fn bends(ring: &[(usize, usize)]) -> Vec<(usize, usize)> {
    let n = ring.len();
    (0..n)
        .filter(|&k| {
            let (before, after) = (ring[(k + n - 1) % n], ring[(k + 1) % n]);
            before.0 != after.0 && before.1 != after.1
        })
        .map(|k| ring[k])
        .collect()
}

#[cfg(test)]
mod tests {
    use super::super::geometry::area;
    use super::*;

    /// Catches a lost hole, or a hole in the same sense as its rim, which would be filled.
    #[test]
    fn a_hole_runs_the_other_way() {
        let rings = outlines(3, 3, &[1, 1, 1, 1, 0, 1, 1, 1, 1]).remove(0);
        let area = |ring: &[(usize, usize)]| {
            0.5 * area(
                &ring
                    .iter()
                    .map(|p| (p.0 as f64, p.1 as f64))
                    .collect::<Vec<_>>(),
            )
        };
        let areas: Vec<f64> = rings.iter().map(|r| area(r)).collect();
        assert_eq!(areas.len(), 2);
        assert_eq!(areas.iter().sum::<f64>(), 8.0);
        assert!(rings.iter().all(|r| r.len() == 4));
    }

    /// Catches lost cells at touching corners, and huge files from noise.
    #[test]
    fn noise_keeps_to_the_budget() {
        let x: Vec<f64> = (0..=400).map(|i| f64::from(i) / 400.0).collect();
        let y: Vec<f64> = (0..=60).map(|j| f64::from(j) / 60.0).collect();
        let levels: Vec<f64> = (0..400 * 60)
            .map(|m| (0.5 + 0.5 * (f64::from(m) * 12.9898).sin()) * 43.7 % 1.0)
            .collect();
        let cells = Cells::new(&x, &y, &levels);
        assert_eq!(cells.bands, 9);
        let heights: Vec<usize> = (0..64).map(|m| 1 - (m / 8 + m % 8) % 2).collect();
        let checkers = outlines(8, 8, &heights).remove(0);
        assert_eq!(checkers.iter().map(Vec::len).sum::<usize>(), 4 * 32);
    }
}
