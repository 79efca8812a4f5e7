//! Areas in which a gridded function is at least some level, as rings.

use super::data::Field;
use super::geometry::{Pixel, apart, middle};
use std::collections::{BTreeMap, BTreeSet};

/// A point of the level line or the grid. Each grid point has three keys: itself and the crossings on the
/// grid edges to its right and above.
type PointKey = usize;

/// The rings around {values >= level}, in data coordinates, the area on their left. Cells with a value that
/// is not a number belong to no area. Values are interpolated along grid edges.
pub(crate) fn at_least(field: &Field, values: &[f64], level: f64) -> Vec<Vec<Pixel>> {
    let (nx, ny) = (field.columns, field.rows);
    let cell = |i: usize, j: usize| {
        let a = j * nx + i;
        [a, a + 1, a + nx + 1, a + nx]
    };
    let full = |i: isize, j: isize| {
        let inside = (0..nx as isize - 1).contains(&i) && (0..ny as isize - 1).contains(&j);
        inside
            && cell(i as usize, j as usize)
                .iter()
                .all(|&m| values[m] >= level)
    };
    let mut edges: BTreeSet<(PointKey, PointKey)> = BTreeSet::new();
    let mut add = |from: PointKey, to: PointKey| {
        if !edges.remove(&(to, from)) {
            edges.insert((from, to));
        }
    };
    for j in 0..ny - 1 {
        for i in 0..nx - 1 {
            let nodes = cell(i, j);
            if nodes.iter().any(|&m| values[m].is_nan()) {
                continue;
            }
            let (i, j) = (i as isize, j as isize);
            if full(i, j) {
                // An edge between two full cells bounds nothing.
                let neighbours = [(i, j - 1), (i + 1, j), (i, j + 1), (i - 1, j)];
                for (side, (ni, nj)) in neighbours.into_iter().enumerate() {
                    if !full(ni, nj) {
                        add(3 * nodes[side], 3 * nodes[(side + 1) % 4]);
                    }
                }
                continue;
            }
            let mut ring: Vec<PointKey> = Vec::with_capacity(6);
            for side in 0..4 {
                let (a, b) = (nodes[side], nodes[(side + 1) % 4]);
                let (ina, inb) = (values[a] >= level, values[b] >= level);
                if ina {
                    ring.push(3 * a);
                }
                if ina != inb {
                    let upright = a.abs_diff(b) != 1;
                    ring.push(3 * a.min(b) + 1 + usize::from(upright));
                }
            }
            for k in 0..ring.len() {
                add(ring[k], ring[(k + 1) % ring.len()]);
            }
        }
    }
    let point = |key: PointKey| place(field, values, level, key);
    let rings = rings(edges).into_iter();
    rings
        .map(|ring| ring.into_iter().map(point).collect())
        .collect()
}

/// Joins directed edges to rings.
pub(crate) fn rings(edges: BTreeSet<(PointKey, PointKey)>) -> Vec<Vec<PointKey>> {
    let mut next: BTreeMap<PointKey, Vec<PointKey>> = BTreeMap::new();
    for (from, to) in edges {
        next.entry(from).or_default().push(to);
    }
    let mut rings = Vec::new();
    while let Some((&start, _)) = next.iter().next() {
        let mut ring = Vec::new();
        let mut at = start;
        while let Some(ways) = next.get_mut(&at) {
            let Some(to) = ways.pop() else { break };
            if ways.is_empty() {
                next.remove(&at);
            }
            ring.push(at);
            at = to;
        }
        if ring.len() > 2 {
            rings.push(ring);
        }
    }
    rings
}

/// The data point of a key.
fn place(field: &Field, values: &[f64], level: f64, key: PointKey) -> Pixel {
    let node = key / 3;
    let (i, j) = ((node % field.columns) as f64, (node / field.columns) as f64);
    let crossing = |other: usize| {
        let (a, b) = (values[node], values[other]);
        let t = (level - a) / (b - a);
        if t.is_finite() {
            t.clamp(0.0, 1.0)
        } else {
            0.5
        }
    };
    match key % 3 {
        0 => field.point(i, j),
        1 => field.point(i + crossing(node + 1), j),
        _ => field.point(i, j + crossing(node + field.columns)),
    }
}

/// Fills the grid points beyond the disc with the mean of their neighbours, `layers` deep, so that areas
/// reach the edge and can be cut there. Points within three steps of the edge are filled too: rods are too
/// taut there for most samplings.
pub(crate) fn extend(field: &Field, values: &mut [f64], radius: f64, layers: usize) {
    let (nx, ny) = (field.columns as isize, field.rows as isize);
    let step = (field.x[1] - field.x[0]) / (field.columns - 1) as f64;
    let rim = radius - 3.0 * step;
    for _ in 0..layers {
        let before = values.to_vec();
        for j in 0..ny {
            for i in 0..nx {
                let m = (j * nx + i) as usize;
                let (x, y) = field.point(i as f64, j as f64);
                if !before[m].is_nan() || x.hypot(y) < rim {
                    continue;
                }
                let (mut sum, mut count) = (0.0, 0);
                let around = (-1..=1).flat_map(|dj| (-1..=1).map(move |di| (i + di, j + dj)));
                for (a, b) in around.filter(|(a, b)| (0..nx).contains(a) && (0..ny).contains(b)) {
                    let value = before[(b * nx + a) as usize];
                    if !value.is_nan() {
                        sum += value;
                        count += 1;
                    }
                }
                if count > 0 {
                    values[m] = sum / f64::from(count);
                }
            }
        }
    }
}

/// For each connected area of one value: the value, the point farthest from other values and from the grid's
/// edge, and that distance in grid steps. Of several such points, the one nearest to their mean is taken:
/// mirror images then have mirrored points.
pub(crate) fn areas(field: &Field, values: &[f64]) -> Vec<(f64, Pixel, usize)> {
    let (nx, ny) = (field.columns, field.rows);
    let same =
        |a: usize, b: usize| values[a] == values[b] || (values[a].is_nan() && values[b].is_nan());
    // Neighbours of the same value: left, below, right, above.
    let around = |m: usize| {
        let (i, j) = (m % nx, m / nx);
        [
            (i > 0).then(|| m - 1),
            (j > 0).then(|| m - nx),
            (i + 1 < nx).then_some(m + 1),
            (j + 1 < ny).then_some(m + nx),
        ]
        .map(|n| n.filter(|n| same(m, *n)))
    };
    // Distance to the edge of the area along the grid, in a pass from each corner.
    let mut depth = vec![usize::MAX; values.len()];
    let deeper = |depth: &[usize], n: Option<usize>| n.map_or(1, |n| depth[n].saturating_add(1));
    for m in 0..values.len() {
        let [left, below, ..] = around(m);
        depth[m] = deeper(&depth, left).min(deeper(&depth, below));
    }
    for m in (0..values.len()).rev() {
        let [_, _, right, above] = around(m);
        depth[m] = depth[m]
            .min(deeper(&depth, right))
            .min(deeper(&depth, above));
    }
    let mut seen = vec![false; values.len()];
    let mut found = Vec::new();
    for start in 0..values.len() {
        if seen[start] || values[start].is_nan() {
            continue;
        }
        let mut area = vec![start];
        seen[start] = true;
        let mut next = 0;
        while next < area.len() {
            for n in around(area[next]).into_iter().flatten() {
                if !std::mem::replace(&mut seen[n], true) {
                    area.push(n);
                }
            }
            next += 1;
        }
        let deepest = area.iter().map(|&m| depth[m]).max().unwrap_or(0);
        area.retain(|&m| depth[m] == deepest);
        let points = area
            .iter()
            .map(|&m| field.point((m % nx) as f64, (m / nx) as f64));
        let points: Vec<Pixel> = points.collect();
        let mean = middle(&points);
        let nearest = points
            .into_iter()
            .min_by(|a, b| apart(*a, mean).total_cmp(&apart(*b, mean)));
        found.push((values[start], nearest.unwrap_or_default(), deepest));
    }
    found
}

#[cfg(test)]
mod tests {
    use super::super::geometry::area;
    use super::*;

    #[test]
    fn rings_of_an_annulus_enclose_its_area() {
        let field = Field::over_disc(201, 1.0, |x, y| {
            let r = x.hypot(y);
            0.25 - (r - 0.5) * (r - 0.5)
        });
        // Radii 0.3 and 0.7.
        let rings = at_least(&field, &field.values, 0.21);
        assert_eq!(rings.len(), 2);
        let total: f64 = rings.iter().map(|ring| 0.5 * area(ring)).sum();
        let exact = std::f64::consts::PI * (0.49 - 0.09);
        assert!((total / exact - 1.0).abs() < 1e-3, "{total} {exact}");
    }

    #[test]
    fn areas_are_labelled_inside() {
        let field = Field::over_disc(101, 1.0, |x, y| {
            if x.hypot(y) > 1.0 {
                f64::NAN
            } else if x > 0.2 {
                2.0
            } else {
                1.0
            }
        });
        let found = areas(&field, &field.values);
        assert_eq!(found.len(), 2);
        for (value, at, depth) in found {
            assert_eq!(value, if at.0 > 0.2 { 2.0 } else { 1.0 });
            assert!(depth > 10);
        }
    }
}
