//! Points of the page and of space: vectors, lines cut at a box, polygons.

use super::data::Bounds;

pub(crate) type Point = [f64; 3];
pub(crate) type Pixel = (f64, f64);

/// Size of coordinates that counts as not finite: the squares would not be finite.
const FAR: f64 = 1e100;

/// True if the point can be drawn.
pub(crate) fn drawable(p: &Point) -> bool {
    p.iter().all(|c| c.abs() < FAR)
}

pub(crate) fn finite(p: &Pixel) -> bool {
    p.0.is_finite() && p.1.is_finite()
}

pub(crate) fn dot(a: Point, b: Point) -> f64 {
    a[0] * b[0] + a[1] * b[1] + a[2] * b[2]
}

pub(crate) fn norm(a: Point) -> f64 {
    dot(a, a).sqrt()
}

pub(crate) fn minus(a: Point, b: Point) -> Point {
    [a[0] - b[0], a[1] - b[1], a[2] - b[2]]
}

pub(crate) fn along(p: Point, t: f64, d: Point) -> Point {
    std::array::from_fn(|i| p[i] + t * d[i])
}

pub(crate) fn between<const N: usize>(a: [f64; N], b: [f64; N], t: f64) -> [f64; N] {
    std::array::from_fn(|i| a[i] + t * (b[i] - a[i]))
}

pub(crate) fn cross(a: Point, b: Point) -> Point {
    [
        a[1] * b[2] - a[2] * b[1],
        a[2] * b[0] - a[0] * b[2],
        a[0] * b[1] - a[1] * b[0],
    ]
}

/// The vector at length 1; `None` if it has no direction.
pub(crate) fn unit(v: Point) -> Option<Point> {
    let largest = v.iter().fold(0.0, |m: f64, c| m.max(c.abs()));
    let scaled = v.map(|c| c / largest);
    (largest > 0.0 && largest < FAR).then(|| scaled.map(|c| c / norm(scaled)))
}

/// The least box that holds all points; `None` without points.
pub(crate) fn box_of<'a>(points: impl IntoIterator<Item = &'a Point>) -> Option<Bounds> {
    let points = points.into_iter().filter(|p| drawable(p));
    points.fold(None, |b, p| {
        let b: Bounds = b.unwrap_or_else(|| p.map(|c| [c, c]));
        Some(std::array::from_fn(|i| {
            [b[i][0].min(p[i]), b[i][1].max(p[i])]
        }))
    })
}

/// Bounding box [left, top, right, bottom] of some pixels.
pub(crate) fn hull(pixels: impl IntoIterator<Item = Pixel>) -> [f64; 4] {
    let start = [f64::MAX, f64::MAX, f64::MIN, f64::MIN];
    pixels.into_iter().fold(start, |b, p| {
        [b[0].min(p.0), b[1].min(p.1), b[2].max(p.0), b[3].max(p.1)]
    })
}

/// True if the areas [left, top, right, bottom] come nearer than these distances across and down.
pub(crate) fn meet(a: &[f64; 4], b: &[f64; 4], across: f64, down: f64) -> bool {
    a[0] < b[2] + across && b[0] < a[2] + across && a[1] < b[3] + down && b[1] < a[3] + down
}

pub(crate) fn apart(a: Pixel, b: Pixel) -> f64 {
    (a.0 - b.0).hypot(a.1 - b.1)
}

pub(crate) fn midway(a: Pixel, b: Pixel, t: f64) -> Pixel {
    (a.0 + t * (b.0 - a.0), a.1 + t * (b.1 - a.1))
}

/// Unit vector from one pixel to another; none if they are the same.
pub(crate) fn heading(a: Pixel, b: Pixel) -> Option<Pixel> {
    unit([b.0 - a.0, b.1 - a.1, 0.0]).map(|d| (d[0], d[1]))
}

/// The direction of a line at its i-th point.
pub(crate) fn tangent(line: &[Pixel], i: usize) -> Option<Pixel> {
    heading(line[i.saturating_sub(1)], line[(i + 1).min(line.len() - 1)])
}

pub(crate) fn length(line: &[Pixel]) -> f64 {
    line.windows(2).map(|p| apart(p[0], p[1])).sum()
}

/// Points along a line, no more than `step` pixels apart.
pub(crate) fn dotted(line: &[Pixel], step: f64) -> Vec<Pixel> {
    let pairs = line.windows(2).filter(|p| p.iter().all(finite));
    let dots = pairs.flat_map(|pair| {
        let n = (apart(pair[0], pair[1]) / step).ceil().clamp(1.0, 2000.0);
        (0..=n as usize).map(move |i| midway(pair[0], pair[1], i as f64 / n))
    });
    dots.collect()
}

/// The part of a segment within a box (Liang and Barsky); none of a segment that is not finite.
pub(crate) fn cut_segment<const N: usize>(
    a: [f64; N],
    b: [f64; N],
    bounds: [[f64; 2]; N],
) -> Option<[[f64; N]; 2]> {
    let (mut from, mut to) = (0f64, 1f64);
    for i in 0..N {
        let way = b[i] - a[i];
        if !way.is_finite() {
            return None;
        }
        for (p, q) in [(-way, a[i] - bounds[i][0]), (way, bounds[i][1] - a[i])] {
            if p == 0.0 && q < 0.0 {
                return None;
            } else if p < 0.0 {
                from = from.max(q / p);
            } else if p > 0.0 {
                to = to.min(q / p);
            }
        }
    }
    let start = if from > 0.0 { between(a, b, from) } else { a };
    let end = if to < 1.0 { between(a, b, to) } else { b };
    (from <= to).then_some([start, end])
}

/// The pieces of a polyline within [left, top, right, bottom]; points that are not finite break it.
pub(crate) fn clip(points: &[Pixel], [left, top, right, bottom]: [f64; 4]) -> Vec<Vec<Pixel>> {
    let mut runs: Vec<Vec<Pixel>> = Vec::new();
    let mut open = false;
    let frame = [[left, right], [top, bottom]];
    for pair in points.windows(2) {
        let [a, b] = [0, 1].map(|i| [pair[i].0, pair[i].1]);
        let Some(ends) = cut_segment(a, b, frame) else {
            open = false;
            continue;
        };
        let [from, to] = ends.map(|[x, y]| (x, y));
        match runs.last_mut() {
            Some(run) if open && from == pair[0] => run.push(to),
            _ => runs.push(vec![from, to]),
        }
        open = to == pair[1];
    }
    runs
}

/// The part of a convex polygon where a linear function of its points is not negative (Sutherland and Hodgman).
pub(crate) fn cut<const N: usize>(
    polygon: Vec<[f64; N]>,
    inside: impl Fn(&[f64; N]) -> f64,
) -> Vec<[f64; N]> {
    if polygon.iter().all(|p| inside(p) >= 0.0) {
        return polygon;
    }
    let mut kept = Vec::with_capacity(polygon.len() + 2);
    for (i, &a) in polygon.iter().enumerate() {
        let b = polygon[(i + 1) % polygon.len()];
        let (da, db) = (inside(&a), inside(&b));
        if da >= 0.0 {
            kept.push(a);
        }
        if (da >= 0.0) != (db >= 0.0) {
            kept.push(between(a, b, da / (da - db)));
        }
    }
    kept
}

/// Twice the area of a polygon, positive if the corners run like x to y.
pub(crate) fn area(polygon: &[Pixel]) -> f64 {
    let next = polygon.iter().cycle().skip(1);
    let sides = polygon.iter().zip(next);
    sides.map(|(a, b)| a.0 * b.1 - a.1 * b.0).sum()
}

/// The mean of some pixels.
pub(crate) fn middle(points: &[Pixel]) -> Pixel {
    let n = points.len() as f64;
    let sum = points
        .iter()
        .fold((0.0, 0.0), |s, p| (s.0 + p.0, s.1 + p.1));
    (sum.0 / n, sum.1 / n)
}

/// True if the point lies in the polygon (even-odd rule).
pub(crate) fn contains(polygon: &[Pixel], p: Pixel) -> bool {
    let next = polygon.iter().cycle().skip(1);
    let crossed = polygon.iter().zip(next).filter(|(a, b)| {
        (a.1 > p.1) != (b.1 > p.1) && p.0 < (b.0 - a.0) * (p.1 - a.1) / (b.1 - a.1) + a.0
    });
    crossed.count() % 2 == 1
}

/// Leaves out points that lie within `tolerance` of the line through those kept (Douglas and Peucker,
/// without recursion). Ends are kept; all points must be finite.
pub(crate) fn thin(points: &[Pixel], tolerance: f64) -> Vec<Pixel> {
    let n = points.len();
    if n < 3 {
        return points.to_vec();
    }
    let mut keep = vec![false; n];
    (keep[0], keep[n - 1]) = (true, true);
    let mut stack = vec![(0, n - 1)];
    while let Some((i, j)) = stack.pop() {
        let far = (i + 1..j)
            .map(|m| (m, distance(points[m], points[i], points[j])))
            .max_by(|a, b| a.1.total_cmp(&b.1));
        if let Some((m, d)) = far
            && d > tolerance
        {
            keep[m] = true;
            stack.extend([(i, m), (m, j)]);
        }
    }
    let kept = points.iter().zip(keep).filter(|(_, keep)| *keep);
    kept.map(|(p, _)| *p).collect()
}

/// Distance of p from the segment a b.
fn distance(p: Pixel, a: Pixel, b: Pixel) -> f64 {
    let (dx, dy) = (b.0 - a.0, b.1 - a.1);
    let square = dx * dx + dy * dy;
    let t = ((p.0 - a.0) * dx + (p.1 - a.1) * dy) / square;
    let t = if square > 0.0 { t.clamp(0.0, 1.0) } else { 0.0 };
    apart(p, midway(a, b, t))
}
