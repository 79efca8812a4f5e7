//! Surfaces in space: parallel projection, faces sorted by depth, lines hidden exactly.

use super::axes::{LABEL, MARK_3D, SMALL};
use super::canvas::{Canvas, Pen, Side, Type};
use super::data::{Bounds, Patch, View};
use super::palette::{Colour, FAINT, INK, category};
use super::ticks;

pub(crate) type Point = [f64; 3];

/// Two thirds of the way a back face's colour is from the front's to white.
const BACK_TINT: f64 = 0.5;
/// How far behind a face a line may lie and still count as lying on it (the box has size 1).
const ON_FACE: f64 = 0.012;
/// About so many rulings are drawn on a patch each way.
const RULINGS: usize = 14;
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
}

/// A quadrilateral cut at the box, in box coordinates.
struct Face {
    corners: Vec<Point>,
    edges: Vec<(Point, Point, Colour, f64)>,
    colour: Colour,
    depth: f64,
    /// Corners on the canvas.
    shown: Vec<(f64, f64)>,
}

fn dot(a: Point, b: Point) -> f64 {
    a[0] * b[0] + a[1] * b[1] + a[2] * b[2]
}

fn minus(a: Point, b: Point) -> Point {
    [a[0] - b[0], a[1] - b[1], a[2] - b[2]]
}

fn between(a: Point, b: Point, t: f64) -> Point {
    std::array::from_fn(|i| a[i] + t * (b[i] - a[i]))
}

fn cross(a: Point, b: Point) -> Point {
    [
        a[1] * b[2] - a[2] * b[1],
        a[2] * b[0] - a[0] * b[2],
        a[0] * b[1] - a[1] * b[0],
    ]
}

impl Scene {
    /// A box with named axes seen from `view`, fitted into `width` x `height` pixels from (0, top);
    /// `aspect` gives the lengths of its edges as drawn.
    pub(crate) fn new(
        bounds: Bounds,
        labels: [String; 3],
        aspect: Point,
        view: View,
        (top, width, height): (f64, f64, f64),
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
            0.5 * width - scene.scale * x,
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

    /// Adds a patch; its faces are cut at the box, its edges drawn dark, its rulings thin.
    pub(crate) fn add(&mut self, patch: &Patch) {
        if !patch.is_sound() {
            return;
        }
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
                let colour = self.shaded(corners, category(patch.colour));
                // Sides in the order of the corners: along i at j, along j at i + 1, and back.
                let lines = [(j, 1), (i + 1, 0), (j + 1, 1), (i, 0)];
                let edges = (0..4).filter_map(|side| {
                    let (index, way) = lines[side];
                    let pen = if index == 0 || index == steps[way] {
                        (colour.shade(0.55), 0.8)
                    } else if index % stride[way] == 0 {
                        (colour.shade(0.22), 0.35)
                    } else {
                        return None;
                    };
                    let (a, b) = self.cut_segment(corners[side], corners[(side + 1) % 4])?;
                    Some((a, b, pen.0, pen.1))
                });
                let edges = edges.collect();
                self.push(self.cut(&corners), edges, colour);
            }
        }
    }

    fn push(
        &mut self,
        corners: Vec<Point>,
        edges: Vec<(Point, Point, Colour, f64)>,
        colour: Colour,
    ) {
        if corners.len() < 3 {
            return;
        }
        let depth = corners.iter().map(|&p| dot(p, self.eye)).sum::<f64>() / corners.len() as f64;
        let shown = corners.iter().map(|&p| self.project(p)).collect();
        self.faces.push(Face {
            corners,
            edges,
            colour,
            depth,
            shown,
        });
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

    /// Draws the faces from the farthest to the nearest.
    pub(crate) fn paint(&mut self, canvas: &mut Canvas) {
        self.faces.sort_by(|a, b| a.depth.total_cmp(&b.depth));
        for face in &self.faces {
            canvas.polygon(&grown(&face.shown), face.colour, 1.0);
            for &(a, b, colour, width) in &face.edges {
                let ends = [self.project(a), self.project(b)];
                canvas.line(&ends, Pen::new(colour, width));
            }
        }
    }

    /// Draws a curve: with `seen` where nothing stands before it, with `hidden` elsewhere.
    pub(crate) fn curve(&self, canvas: &mut Canvas, points: &[Point], seen: Pen, hidden: Pen) {
        // Pieces short enough that each is hidden as a whole or not at all.
        let mut pieces: Vec<(bool, Vec<(f64, f64)>)> = Vec::new();
        let mut joined = false;
        for pair in points.windows(2) {
            let Some((a, b)) = self.cut_segment(self.boxed(pair[0]), self.boxed(pair[1])) else {
                joined = false;
                continue;
            };
            let length = dot(minus(b, a), minus(b, a)).sqrt();
            let parts = (length * self.scale / 3.0).ceil().clamp(1.0, 1000.0) as usize;
            for k in 0..parts {
                let from = between(a, b, k as f64 / parts as f64);
                let to = between(a, b, (k + 1) as f64 / parts as f64);
                let visible = self.sees(between(from, to, 0.5));
                let (from, to) = (self.project(from), self.project(to));
                match pieces.last_mut() {
                    Some((same, run)) if joined && *same == visible => run.push(to),
                    _ => pieces.push((visible, vec![from, to])),
                }
                joined = true;
            }
        }
        for visible in [false, true] {
            let pen = if visible { seen } else { hidden };
            for (_, run) in pieces.iter().filter(|piece| piece.0 == visible) {
                canvas.line(&super::axes::thin(run, 0.06), pen);
            }
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
            contains(&face.shown, at)
                && self.depth_of(face, at).is_some_and(|d| d > depth + ON_FACE)
        })
    }

    /// The depth of a face's plane under a pixel; `None` for a face seen edge-on.
    fn depth_of(&self, face: &Face, at: (f64, f64)) -> Option<f64> {
        let c = &face.corners;
        let n = c.len();
        let normal = cross(minus(c[n / 2], c[0]), minus(c[n - 1], c[1]));
        let facing = dot(normal, self.eye);
        let length = dot(normal, normal).sqrt();
        if facing.abs() < 0.02 * length || length == 0.0 {
            return None;
        }
        // From a point of the screen plane towards the eye onto the plane through the face's middle.
        let x = (at.0 - self.centre.0) / self.scale;
        let y = (self.centre.1 - at.1) / self.scale;
        let middle: Point = std::array::from_fn(|i| c.iter().map(|p| p[i]).sum::<f64>() / n as f64);
        let screen: Point = std::array::from_fn(|i| x * self.right[i] + y * self.up[i]);
        Some(dot(normal, minus(middle, screen)) / facing)
    }

    /// The three far walls with a faint grid: under everything.
    pub(crate) fn walls(&self, canvas: &mut Canvas) {
        for axis in 0..3 {
            let far = if self.eye[axis] > 0.0 { -0.5 } else { 0.5 } * self.aspect[axis];
            let (u, v) = ((axis + 1) % 3, (axis + 2) % 3);
            let place = |a: f64, b: f64| {
                let mut p = [0.0; 3];
                p[axis] = far;
                p[u] = a * self.aspect[u];
                p[v] = b * self.aspect[v];
                self.project(p)
            };
            let wall = [(-0.5, -0.5), (0.5, -0.5), (0.5, 0.5), (-0.5, 0.5)];
            let wall: Vec<_> = wall.iter().map(|&(a, b)| place(a, b)).collect();
            canvas.polygon(&wall, Colour(250, 250, 250), 1.0);
            let pen = Pen::new(FAINT, 0.7);
            for tick in self.ticks(u) {
                let t = self.boxed_along(u, tick.value) / self.aspect[u];
                canvas.line(&[place(t, -0.5), place(t, 0.5)], pen);
            }
            for tick in self.ticks(v) {
                let t = self.boxed_along(v, tick.value) / self.aspect[v];
                canvas.line(&[place(-0.5, t), place(0.5, t)], pen);
            }
            canvas.line(&[wall[0], wall[1], wall[2], wall[3], wall[0]], pen);
        }
    }

    fn ticks(&self, axis: usize) -> Vec<ticks::Tick> {
        let [lo, hi] = self.bounds[axis];
        ticks::linear(lo, hi, 5)
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
