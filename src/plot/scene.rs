//! Surfaces in space: parallel projection, faces painted from back to front, lines hidden exactly.

use super::axes::{LABEL, MARK_3D, SMALL, thin};
use super::canvas::{Canvas, Pen, Side, Type};
use super::data::{Bounds, Patch, View};
use super::depth::{Layer, order};
use super::palette::{Colour, FAINT, INK, category};
use super::ticks;
use std::collections::HashMap;

pub(crate) type Point = [f64; 3];

/// How far a back face's colour is towards white.
const BACK_TINT: f64 = 0.5;
/// How far behind a face a line may lie and still count as lying on it (the box has size 1).
const ON_FACE: f64 = 0.02;
/// Sheets closer than this are painted in the order they were given.
const TIE: f64 = 0.006;
/// About so many rulings are drawn on a patch each way.
const RULINGS: usize = 14;
/// A line hidden for fewer pixels than this between two seen parts is drawn as seen.
const SHORT_DIVE: f64 = 14.0;
/// Faces are grown by so many pixels, which hides the seams between them.
const OVERLAP: f64 = 0.35;

/// A box of space shown on a rectangle of the canvas.
pub(crate) struct Scene {
    bounds: Bounds,
    labels: [String; 3],
    /// The box's edges as seen, longest about 1.
    aspect: Point,
    right: Point,
    up: Point,
    eye: Point,
    scale: f64,
    centre: (f64, f64),
    faces: Vec<Face>,
    /// How far all colours are towards white, 0 to 1.
    pale: f64,
    /// Number of patches so far.
    patches: usize,
}

/// A quadrilateral cut at the box.
struct Face {
    edges: Vec<Edge>,
    colour: Colour,
    sheet: usize,
    depth: f64,
    /// Corners on the canvas.
    shown: Vec<(f64, f64)>,
    /// Depth as a function of the pixel: at a pixel (x, y), slope . (x, y, 1), kept within the range.
    slope: Option<Point>,
    range: [f64; 2],
}

/// A side of a face that is drawn.
struct Edge {
    /// Patch, row, column, direction: the same for the two faces that share it.
    name: [usize; 4],
    ends: [(f64, f64); 2],
    pen: Pen,
}

/// A stretch of a curve that is seen, or hidden, as a whole.
struct Run {
    seen: bool,
    /// Begins where the one before ends.
    joined: bool,
    line: Vec<(f64, f64)>,
}

impl Layer for Face {
    fn outline(&self) -> &[(f64, f64)] {
        &self.shown
    }

    fn depth(&self) -> f64 {
        self.depth
    }

    fn depth_at(&self, (x, y): (f64, f64)) -> Option<f64> {
        self.slope
            .map(|s| dot(s, [x, y, 1.0]).clamp(self.range[0], self.range[1]))
    }

    fn sheet(&self) -> usize {
        self.sheet
    }
}

pub(crate) fn dot(a: Point, b: Point) -> f64 {
    a[0] * b[0] + a[1] * b[1] + a[2] * b[2]
}

pub(crate) fn minus(a: Point, b: Point) -> Point {
    [a[0] - b[0], a[1] - b[1], a[2] - b[2]]
}

pub(crate) fn between(a: Point, b: Point, t: f64) -> Point {
    std::array::from_fn(|i| a[i] + t * (b[i] - a[i]))
}

pub(crate) fn cross(a: Point, b: Point) -> Point {
    [
        a[1] * b[2] - a[2] * b[1],
        a[2] * b[0] - a[0] * b[2],
        a[0] * b[1] - a[1] * b[0],
    ]
}

impl Scene {
    /// A box with named axes seen from `view`, fitted into the pixels [left, top, width, height];
    /// `aspect` gives the lengths of its edges as drawn.
    pub(crate) fn new(
        bounds: Bounds,
        labels: [String; 3],
        aspect: Point,
        view: View,
        [left, top, width, height]: [f64; 4],
    ) -> Self {
        let (se, ce) = view.elevation.to_radians().sin_cos();
        let (sa, ca) = view.azimuth.to_radians().sin_cos();
        let mut scene = Self {
            bounds,
            labels,
            aspect,
            right: [-sa, ca, 0.0],
            up: [-se * ca, -se * sa, ce],
            eye: [ce * ca, ce * sa, se],
            scale: 1.0,
            centre: (0.0, 0.0),
            faces: Vec::new(),
            pale: 0.0,
            patches: 0,
        };
        let corners: Vec<(f64, f64)> = (0..8).map(|c| scene.project(scene.corner(c))).collect();
        let span = |f: fn(&(f64, f64)) -> f64| {
            let (lo, hi) = corners
                .iter()
                .map(f)
                .fold((f64::MAX, f64::MIN), |(lo, hi), v| (lo.min(v), hi.max(v)));
            (hi - lo, 0.5 * (lo + hi))
        };
        let ((w, x), (h, y)) = (span(|p| p.0), span(|p| p.1));
        // Room for the numbers and names round the box.
        let (side, over, under) = (74.0, 12.0, 50.0);
        scene.scale = ((width - 2.0 * side) / w).min((height - over - under) / h);
        scene.centre = (
            left + 0.5 * width - scene.scale * x,
            top + 0.5 * (height + over - under) - scene.scale * y,
        );
        scene
    }

    /// Data to box coordinates, centred.
    fn boxed(&self, p: Point) -> Point {
        std::array::from_fn(|i| {
            let [lo, hi] = self.bounds[i];
            self.aspect[i] * ((p[i] - lo) / (hi - lo) - 0.5)
        })
    }

    fn project(&self, p: Point) -> (f64, f64) {
        (
            self.centre.0 + self.scale * dot(p, self.right),
            self.centre.1 - self.scale * dot(p, self.up),
        )
    }

    /// Corner `c` of the box: bit i set means the upper end of axis i.
    fn corner(&self, c: usize) -> Point {
        std::array::from_fn(|i| self.aspect[i] * if c >> i & 1 == 1 { 0.5 } else { -0.5 })
    }

    /// Makes patches added from now on paler, so that lines on them stand out.
    pub(crate) fn pale(&mut self, t: f64) {
        self.pale = t;
    }

    /// Adds a patch; its faces are cut at the box, its edges drawn dark, its rulings thin. Where two
    /// patches all but coincide, the one added first is seen.
    pub(crate) fn add(&mut self, patch: &Patch) {
        self.patches += 1;
        if !patch.is_sound() {
            return;
        }
        let base = category(patch.colour).tint(self.pale);
        let points: Vec<Point> = patch.points.iter().map(|&p| self.boxed(p)).collect();
        let at = |i: usize, j: usize| points[i * patch.columns + j];
        let steps = [patch.rows - 1, patch.columns - 1];
        let stride = steps.map(|n| n.div_ceil(RULINGS).max(1));
        for i in 0..steps[0] {
            for j in 0..steps[1] {
                let corners = [at(i, j), at(i + 1, j), at(i + 1, j + 1), at(i, j + 1)];
                if !corners.iter().flatten().all(|c| c.is_finite()) {
                    continue;
                }
                let colour = self.shaded(corners, base);
                // Sides in the order of the corners, each with the grid line it belongs to.
                let sides = [(i, j, 1), (i + 1, j, 0), (i, j + 1, 1), (i, j, 0)];
                let mut edges = Vec::new();
                for (side, &(row, column, way)) in sides.iter().enumerate() {
                    let line = if way == 0 { row } else { column };
                    let pen = if line == 0 || line == steps[way] {
                        Pen::new(base.shade(0.6), 0.8)
                    } else if line % stride[way] == 0 {
                        Pen::new(colour.shade(0.24), 0.4)
                    } else {
                        continue;
                    };
                    if let Some((a, b)) = self.cut_segment(corners[side], corners[(side + 1) % 4]) {
                        edges.push(Edge {
                            name: [self.patches, row, column, way],
                            ends: [self.project(a), self.project(b)],
                            pen,
                        });
                    }
                }
                self.push(self.cut(&corners), edges, colour);
            }
        }
    }

    fn push(&mut self, corners: Vec<Point>, edges: Vec<Edge>, colour: Colour) {
        if corners.len() < 3 {
            return;
        }
        let depths: Vec<f64> = corners.iter().map(|&p| dot(p, self.eye)).collect();
        self.faces.push(Face {
            edges,
            colour,
            sheet: self.patches,
            depth: depths.iter().sum::<f64>() / depths.len() as f64,
            shown: corners.iter().map(|&p| self.project(p)).collect(),
            slope: self.slope(&corners),
            range: [
                depths.iter().copied().fold(f64::MAX, f64::min),
                depths.iter().copied().fold(f64::MIN, f64::max),
            ],
        });
    }

    /// The depth of a face's mean plane as a function of the pixel; `None` for a face seen edge-on.
    fn slope(&self, c: &[Point]) -> Option<Point> {
        let n = c.len();
        let normal = cross(minus(c[n / 2], c[0]), minus(c[n - 1], c[1]));
        let facing = dot(normal, self.eye);
        let length = dot(normal, normal).sqrt();
        if length.is_nan() || facing.abs() <= 0.02 * length {
            return None;
        }
        let middle: Point = std::array::from_fn(|i| c.iter().map(|p| p[i]).sum::<f64>() / n as f64);
        // normal . (u right + v up + d eye) = normal . middle, with u, v from the pixel.
        let (u, v) = (
            dot(normal, self.right) / facing,
            dot(normal, self.up) / facing,
        );
        let (u, v) = (-u / self.scale, v / self.scale);
        let base = dot(normal, middle) / facing;
        Some([u, v, base - u * self.centre.0 - v * self.centre.1])
    }

    /// The colour of a face in the light, paler at its back.
    fn shaded(&self, corners: [Point; 4], colour: Colour) -> Colour {
        let normal = cross(minus(corners[2], corners[0]), minus(corners[3], corners[1]));
        let length = dot(normal, normal).sqrt();
        if length.is_nan() || length <= 0.0 {
            return colour;
        }
        let facing = dot(normal, self.eye) / length;
        let lamp: Point =
            std::array::from_fn(|i| 0.8 * self.eye[i] + 0.45 * self.up[i] - 0.4 * self.right[i]);
        let light = (dot(normal, lamp) / length).abs().min(1.0);
        let paint = colour.tint(if facing < 0.0 { BACK_TINT } else { 0.12 });
        if light > 0.6 {
            paint.tint(0.45 * (light - 0.6))
        } else {
            paint.shade(0.62 * (0.6 - light))
        }
    }

    /// A polygon cut at the six planes of the box (Sutherland and Hodgman).
    fn cut(&self, corners: &[Point]) -> Vec<Point> {
        let mut polygon = corners.to_vec();
        for axis in 0..3 {
            for sign in [-1.0, 1.0] {
                let limit = 0.5 * self.aspect[axis] * (1.0 + 1e-12);
                let inside = |p: &Point| limit - sign * p[axis];
                if polygon.iter().all(|p| inside(p) >= 0.0) {
                    continue;
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
                polygon = kept;
            }
        }
        polygon
    }

    /// A segment cut at the box.
    fn cut_segment(&self, a: Point, b: Point) -> Option<(Point, Point)> {
        let (mut t0, mut t1) = (0f64, 1f64);
        for axis in 0..3 {
            let limit = 0.5 * self.aspect[axis] * (1.0 + 1e-12);
            let (da, db) = (a[axis], b[axis]);
            if !(db - da).is_finite() {
                return None;
            }
            for (p, q) in [(da - db, da + limit), (db - da, limit - da)] {
                if p == 0.0 {
                    if q < 0.0 {
                        return None;
                    }
                } else if p < 0.0 {
                    t0 = t0.max(q / p);
                } else {
                    t1 = t1.min(q / p);
                }
            }
        }
        (t0 <= t1).then(|| (between(a, b, t0), between(a, b, t1)))
    }

    /// Draws the faces from back to front; an edge with the later of the two faces that share it.
    pub(crate) fn paint(&self, canvas: &mut Canvas) {
        let order = order(&self.faces, TIE);
        let mut last: HashMap<[usize; 4], usize> = HashMap::new();
        for &face in &order {
            for edge in &self.faces[face].edges {
                last.insert(edge.name, face);
            }
        }
        for &i in &order {
            let face = &self.faces[i];
            canvas.polygon(&grown(&face.shown), face.colour, 1.0);
            for edge in face.edges.iter().filter(|edge| last[&edge.name] == i) {
                canvas.line(&edge.ends, edge.pen);
            }
        }
    }

    /// Draws a curve: with `seen` where nothing stands before it, with `hidden` elsewhere.
    pub(crate) fn curve(&self, canvas: &mut Canvas, points: &[Point], seen: Pen, hidden: Pen) {
        // In parts short enough that each is hidden as a whole or not at all.
        let mut runs: Vec<Run> = Vec::new();
        let mut end = None;
        for pair in points.windows(2) {
            let Some((a, b)) = self.cut_segment(self.boxed(pair[0]), self.boxed(pair[1])) else {
                continue;
            };
            let length = dot(minus(b, a), minus(b, a)).sqrt();
            let parts = (length * self.scale / 3.0).ceil().clamp(1.0, 1000.0) as usize;
            for k in 0..parts {
                let from = between(a, b, k as f64 / parts as f64);
                let to = between(a, b, (k + 1) as f64 / parts as f64);
                let visible = self.sees(between(from, to, 0.5));
                let (from, to) = (self.project(from), self.project(to));
                let joined = end == Some(from);
                end = Some(to);
                match runs.last_mut() {
                    Some(run) if joined && run.seen == visible => run.line.push(to),
                    _ => runs.push(Run {
                        seen: visible,
                        joined,
                        line: vec![from, to],
                    }),
                }
            }
        }
        // A line on a sheet dives into its flat faces here and there; it is not hidden for that.
        for i in 1..runs.len().saturating_sub(1) {
            let between_seen = runs[i - 1].seen && runs[i + 1].seen;
            let whole = runs[i].joined && runs[i + 1].joined;
            if between_seen && whole && path_length(&runs[i].line) < SHORT_DIVE {
                runs[i].seen = true;
            }
        }
        for visible in [false, true] {
            let pen = if visible { seen } else { hidden };
            let mut line: Vec<(f64, f64)> = Vec::new();
            for run in runs.iter().filter(|run| run.seen == visible) {
                if line.last() != run.line.first() {
                    canvas.line(&thin(&line, 0.06), pen);
                    line.clear();
                }
                line.extend_from_slice(&run.line);
            }
            canvas.line(&thin(&line, 0.06), pen);
        }
    }

    /// The pixel of a data point, and whether it is seen.
    pub(crate) fn spot(&self, p: Point) -> ((f64, f64), bool) {
        let boxed = self.boxed(p);
        (self.project(boxed), self.sees(boxed))
    }

    /// True if no face stands before the point.
    fn sees(&self, p: Point) -> bool {
        let at = self.project(p);
        let depth = dot(p, self.eye);
        !self.faces.iter().any(|face| {
            face.range[1] > depth + ON_FACE
                && contains(&face.shown, at)
                && face.depth_at(at).is_some_and(|d| d > depth + ON_FACE)
        })
    }

    /// The three far walls with a faint grid: under everything.
    pub(crate) fn walls(&self, canvas: &mut Canvas) {
        let far = self.eye.map(|e| usize::from(e <= 0.0));
        let ticks = [0, 1, 2].map(|axis| self.ticks(axis));
        let place = |p: Point| self.project(self.boxed(p));
        draw_walls(
            canvas,
            &self.bounds,
            far,
            ticks.each_ref().map(Vec::as_slice),
            place,
        );
    }

    fn ticks(&self, axis: usize) -> Vec<ticks::Tick> {
        let [lo, hi] = self.bounds[axis];
        if self.labels[axis].ends_with("(rad)") {
            return ticks::angles(lo, hi);
        }
        ticks::linear(lo, hi, if hi - lo < 2.5 { 4 } else { 5 })
    }

    fn boxed_along(&self, axis: usize, value: f64) -> f64 {
        let [lo, hi] = self.bounds[axis];
        self.aspect[axis] * ((value - lo) / (hi - lo) - 0.5)
    }

    /// Axes with marks, numbers and names along the outer edges of the box: over everything.
    pub(crate) fn axes(&self, canvas: &mut Canvas) {
        let middle = self.project([0.0; 3]);
        for axis in 0..3 {
            let edge = self.outer_edge(axis);
            let on = |t: f64| {
                let mut p = edge;
                p[axis] = t;
                self.project(p)
            };
            let half = 0.5 * self.aspect[axis];
            let (a, b) = (on(-half), on(half));
            let pen = Pen::new(INK, 0.9);
            canvas.line(&[a, b], pen);
            // Outwards, across the edge.
            let (dx, dy) = (b.0 - a.0, b.1 - a.1);
            let length = dx.hypot(dy).max(1e-9);
            let mut out = (-dy / length, dx / length);
            let mid = (0.5 * (a.0 + b.0), 0.5 * (a.1 + b.1));
            if out.0 * (mid.0 - middle.0) + out.1 * (mid.1 - middle.1) < 0.0 {
                out = (-out.0, -out.1);
            }
            let side = if out.0 > 0.35 {
                Side::Start
            } else if out.0 < -0.35 {
                Side::End
            } else {
                Side::Middle
            };
            let font = Type::new(SMALL, side, Side::Middle);
            let mut widest = 0f64;
            for tick in self.ticks(axis) {
                let p = on(self.boxed_along(axis, tick.value));
                let by = |d: f64| (p.0 + d * out.0, p.1 + d * out.1);
                canvas.line(&[p, by(MARK_3D)], pen);
                if let Some(label) = &tick.label {
                    widest = widest.max(super::text::width(label, SMALL));
                    canvas.text(by(MARK_3D + 7.0), label, font);
                }
            }
            let off = MARK_3D + 16.0 + widest * out.0.abs() + 10.0 * out.1.abs();
            let at = (mid.0 + off * out.0, mid.1 + off * out.1);
            if axis == 2 {
                let down = if out.0 < 0.0 { Side::End } else { Side::Start };
                let name = Type::new(LABEL, Side::Middle, down).upwards();
                canvas.text(at, &self.labels[axis], name);
            } else {
                canvas.text(at, &self.labels[axis], Type::new(LABEL, side, Side::Middle));
            }
        }
    }

    /// The edge that carries an axis: below and in front for the horizontal ones, at the left for the
    /// vertical one. Given by the fixed coordinates of its points.
    fn outer_edge(&self, axis: usize) -> Point {
        let candidates = (0..8).filter(|c| c >> axis & 1 == 0).map(|c| {
            let mut p = self.corner(c);
            p[axis] = 0.0;
            p
        });
        let (right, up) = (self.right, self.up);
        let score = |p: &Point| {
            if axis == 2 {
                -dot(*p, right)
            } else {
                -dot(*p, up)
            }
        };
        candidates
            .max_by(|a, b| score(a).total_cmp(&score(b)))
            .unwrap_or_default()
    }
}

/// The walls of a box at its lower (0) or upper (1) ends, with grid lines at the ticks; `place` says where a point is seen.
pub(super) fn draw_walls(
    canvas: &mut Canvas,
    bounds: &Bounds,
    ends: [usize; 3],
    ticks: [&[ticks::Tick]; 3],
    place: impl Fn(Point) -> (f64, f64),
) {
    for axis in 0..3 {
        let (u, v) = ((axis + 1) % 3, (axis + 2) % 3);
        let place = |a: f64, b: f64| {
            let mut p = [bounds[axis][ends[axis]]; 3];
            (p[u], p[v]) = (a, b);
            place(p)
        };
        let ([ul, uh], [vl, vh]) = (bounds[u], bounds[v]);
        let wall = [place(ul, vl), place(uh, vl), place(uh, vh), place(ul, vh)];
        canvas.polygon(&wall, Colour(250, 250, 250), 1.0);
        let pen = Pen::new(FAINT, 0.7);
        for tick in ticks[u] {
            canvas.line(&[place(tick.value, vl), place(tick.value, vh)], pen);
        }
        for tick in ticks[v] {
            canvas.line(&[place(ul, tick.value), place(uh, tick.value)], pen);
        }
        canvas.line(&[wall[0], wall[1], wall[2], wall[3], wall[0]], pen);
    }
}

fn path_length(points: &[(f64, f64)]) -> f64 {
    points
        .windows(2)
        .map(|p| (p[1].0 - p[0].0).hypot(p[1].1 - p[0].1))
        .sum()
}

/// The polygon with its corners moved a little outwards.
fn grown(corners: &[(f64, f64)]) -> Vec<(f64, f64)> {
    let n = corners.len() as f64;
    let (sx, sy) = corners
        .iter()
        .fold((0.0, 0.0), |(x, y), p| (x + p.0, y + p.1));
    let (mx, my) = (sx / n, sy / n);
    corners
        .iter()
        .map(|&(x, y)| {
            let (dx, dy) = (x - mx, y - my);
            let length = dx.hypot(dy).max(1e-9);
            (x + OVERLAP * dx / length, y + OVERLAP * dy / length)
        })
        .collect()
}

/// True if the point lies in the polygon (even-odd rule).
fn contains(polygon: &[(f64, f64)], p: (f64, f64)) -> bool {
    let mut inside = false;
    let mut previous = polygon.len() - 1;
    for i in 0..polygon.len() {
        let (a, b) = (polygon[i], polygon[previous]);
        if (a.1 > p.1) != (b.1 > p.1) && p.0 < (b.0 - a.0) * (p.1 - a.1) / (b.1 - a.1) + a.0 {
            inside = !inside;
        }
        previous = i;
    }
    inside
}
