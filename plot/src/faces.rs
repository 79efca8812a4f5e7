//! Surfaces in space: faces painted from back to front, lines hidden exactly.

use super::canvas::{Canvas, Pen};
use super::data::Patch;
use super::depth::{DepthOrdered, order};
use super::geometry::{
    Pixel, Point, area, between, contains, cross, cut, cut_segment, dot, heading, length, minus,
    norm, thin,
};
use super::palette::{Colour, category};
use super::stage::Stage;
use std::collections::HashMap;

/// Whiteness added to the back of faces.
const BACK_TINT: f64 = 0.3;
/// Depth behind a face up to which a line lies on the face (the box has size 1).
const ON_FACE: f64 = 0.02;
/// Distance of sheets below which the order of input is the painting order.
const TIE: f64 = 0.006;
/// Approximate number of rulings on a patch each way.
const RULINGS: usize = 14;
/// Length in pixels below which a hidden stretch between two visible ones is drawn as visible.
const SHORT_DIVE: f64 = 14.0;
/// Outward growth of faces in pixels, to hide the seams.
const OVERLAP: f64 = 0.35;

/// Surfaces in a box in parallel projection.
pub(crate) struct Faces {
    stage: Stage,
    faces: Vec<Face>,
    /// Whiteness added to all colours, 0 to 1.
    pale: f64,
    /// Number of patches so far.
    patches: usize,
}

/// A quadrilateral cut at the box.
struct Face {
    edges: Vec<FaceEdge>,
    colour: Colour,
    sheet: usize,
    depth: f64,
    /// Corners on the canvas.
    shown: Vec<Pixel>,
    /// Bounding box of the corners.
    within: [Pixel; 2],
    /// Depth as a function of the pixel: slope . (x, y, 1), kept within the range.
    slope: Option<Point>,
    range: [f64; 2],
}

/// A drawn side of a face.
struct FaceEdge {
    /// Patch, row, column, direction: equal for both faces at the edge.
    name: [usize; 4],
    ends: [Pixel; 2],
    pen: Pen,
}

/// A stretch of a curve that is visible, or hidden, as a whole.
struct VisibleRun {
    seen: bool,
    /// True if the stretch begins at the end of the one before.
    joined: bool,
    line: Vec<Pixel>,
}

impl DepthOrdered for Face {
    fn outline(&self) -> &[Pixel] {
        &self.shown
    }

    fn depth(&self) -> f64 {
        self.depth
    }

    fn depth_at(&self, (x, y): Pixel) -> Option<f64> {
        self.slope
            .map(|s| dot(s, [x, y, 1.0]).clamp(self.range[0], self.range[1]))
    }

    fn sheet(&self) -> usize {
        self.sheet
    }
}

impl Faces {
    /// An empty box.
    pub(crate) fn new(stage: Stage) -> Self {
        Self {
            stage,
            faces: Vec::new(),
            pale: 0.0,
            patches: 0,
        }
    }

    fn project(&self, boxed: Point) -> Pixel {
        self.stage.camera().pixel(boxed)
    }

    /// Whitens patches added from now on by `t`, so that lines on them stand out.
    pub(crate) fn pale(&mut self, t: f64) {
        self.pale = t;
    }

    /// Adds a patch; its faces are cut at the box, its edges drawn dark, its rulings thin. Of two nearly
    /// coincident patches the one added first is visible.
    pub(crate) fn add(&mut self, patch: &Patch) {
        self.patches += 1;
        if !patch.is_sound() {
            return;
        }
        let base = category(patch.colour).tint(self.pale);
        let points: Vec<Point> = patch.points.iter().map(|&p| self.stage.boxed(p)).collect();
        let at = |i: usize, j: usize| points[i * patch.columns + j];
        let steps = [patch.rows - 1, patch.columns - 1];
        let stride = steps.map(|n| n.div_ceil(RULINGS).max(1));
        for i in 0..steps[0] {
            for j in 0..steps[1] {
                let corners = [at(i, j), at(i + 1, j), at(i + 1, j + 1), at(i, j + 1)];
                if !corners.iter().flatten().all(|c| c.is_finite()) {
                    continue;
                }
                let own = if patch.is_greyed(i, j) {
                    base.unstable()
                } else {
                    base
                };
                let colour = self.shaded(corners, own);
                // Sides in the order of the corners, each with its grid line.
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
                    let ends = [corners[side], corners[(side + 1) % 4]];
                    if let Some(ends) = cut_segment(ends[0], ends[1], self.bounds()) {
                        edges.push(FaceEdge {
                            name: [self.patches, row, column, way],
                            ends: ends.map(|p| self.project(p)),
                            pen,
                        });
                    }
                }
                self.push(self.cut(&corners), edges, colour);
            }
        }
    }

    fn push(&mut self, corners: Vec<Point>, edges: Vec<FaceEdge>, colour: Colour) {
        if corners.len() < 3 {
            return;
        }
        let depths: Vec<f64> = corners
            .iter()
            .map(|&p| dot(p, self.stage.camera().back))
            .collect();
        let shown: Vec<Pixel> = corners.iter().map(|&p| self.project(p)).collect();
        let within = [f64::min, f64::max].map(|of| {
            let both = |a: Pixel, b: &Pixel| (of(a.0, b.0), of(a.1, b.1));
            shown.iter().fold(shown[0], both)
        });
        self.faces.push(Face {
            edges,
            colour,
            sheet: self.patches,
            depth: depths.iter().sum::<f64>() / depths.len() as f64,
            shown,
            within,
            slope: self.slope(&corners),
            range: [
                depths.iter().copied().fold(f64::MAX, f64::min),
                depths.iter().copied().fold(f64::MIN, f64::max),
            ],
        });
    }

    /// The depth of a face's mean plane as a function of the pixel; `None` for a face seen edge-on.
    fn slope(&self, c: &[Point]) -> Option<Point> {
        let (n, camera) = (c.len(), self.stage.camera());
        let normal = cross(minus(c[n / 2], c[0]), minus(c[n - 1], c[1]));
        let facing = dot(normal, camera.back);
        let length = norm(normal);
        if length.is_nan() || facing.abs() <= 0.02 * length {
            return None;
        }
        let middle: Point = std::array::from_fn(|i| c.iter().map(|p| p[i]).sum::<f64>() / n as f64);
        // normal . (u right + v up + d eye) = normal . middle, with u, v from the pixel.
        let (u, v) = (
            dot(normal, camera.right) / facing,
            dot(normal, camera.up) / facing,
        );
        let (u, v) = (-u / camera.scale, v / camera.scale);
        let base = dot(normal, middle) / facing;
        Some([u, v, base - u * camera.centre.0 - v * camera.centre.1])
    }

    /// The colour of a face in the light, paler at its back.
    fn shaded(&self, corners: [Point; 4], colour: Colour) -> Colour {
        let normal = cross(minus(corners[2], corners[0]), minus(corners[3], corners[1]));
        let length = norm(normal);
        if length.is_nan() || length <= 0.0 {
            return colour;
        }
        let camera = self.stage.camera();
        let facing = dot(normal, camera.back) / length;
        let lamp: Point = std::array::from_fn(|i| {
            0.8 * camera.back[i] + 0.45 * camera.up[i] - 0.4 * camera.right[i]
        });
        let light = (dot(normal, lamp) / length).abs().min(1.0);
        let paint = colour.tint(if facing < 0.0 { BACK_TINT } else { 0.12 });
        if light > 0.6 {
            paint.tint(0.45 * (light - 0.6))
        } else {
            paint.shade(0.62 * (0.6 - light))
        }
    }

    /// The box, before the camera.
    fn bounds(&self) -> [[f64; 2]; 3] {
        let half = self.stage.aspect().map(|a| 0.5 * a * (1.0 + 1e-12));
        half.map(|h| [-h, h])
    }

    /// A polygon cut at the six planes of the box.
    fn cut(&self, corners: &[Point]) -> Vec<Point> {
        let bounds = self.bounds();
        (0..3).fold(corners.to_vec(), |polygon, i| {
            let above = cut(polygon, |p| p[i] - bounds[i][0]);
            cut(above, |p| bounds[i][1] - p[i])
        })
    }

    /// Draws the faces from back to front, each edge with the later of its two faces.
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

    /// Draws a curve with the pen `seen` on visible parts, `hidden` on the others.
    pub(crate) fn curve(&self, canvas: &mut Canvas, points: &[Point], seen: Pen, hidden: Pen) {
        // Short parts, each hidden as a whole or not at all.
        let mut runs: Vec<VisibleRun> = Vec::new();
        let mut end = None;
        for pair in points.windows(2) {
            let [a, b] = [pair[0], pair[1]].map(|p| self.stage.boxed(p));
            let Some([a, b]) = cut_segment(a, b, self.bounds()) else {
                continue;
            };
            let pixels = norm(minus(b, a)) * self.stage.camera().scale;
            let parts = (pixels / 3.0).ceil().clamp(1.0, 1000.0) as usize;
            for k in 0..parts {
                let from = between(a, b, k as f64 / parts as f64);
                let to = between(a, b, (k + 1) as f64 / parts as f64);
                let visible = self.sees(between(from, to, 0.5));
                let (from, to) = (self.project(from), self.project(to));
                let joined = end == Some(from);
                end = Some(to);
                match runs.last_mut() {
                    Some(run) if joined && run.seen == visible => run.line.push(to),
                    _ => runs.push(VisibleRun {
                        seen: visible,
                        joined,
                        line: vec![from, to],
                    }),
                }
            }
        }
        // A line on a sheet dips into the flat faces in places, and still counts as visible.
        for i in 1..runs.len().saturating_sub(1) {
            let between_seen = runs[i - 1].seen && runs[i + 1].seen;
            let whole = runs[i].joined && runs[i + 1].joined;
            if between_seen && whole && length(&runs[i].line) < SHORT_DIVE {
                runs[i].seen = true;
            }
        }
        for visible in [false, true] {
            let pen = if visible { seen } else { hidden };
            let mut line: Vec<Pixel> = Vec::new();
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

    /// The pixel of a data point, and whether the point is visible.
    pub(crate) fn spot(&self, p: Point) -> (Pixel, bool) {
        let boxed = self.stage.boxed(p);
        (self.project(boxed), self.sees(boxed))
    }

    /// True if no face stands before the point.
    fn sees(&self, p: Point) -> bool {
        let at = self.project(p);
        let depth = dot(p, self.stage.camera().back);
        !self.faces.iter().any(|face| {
            let [low, high] = face.within;
            face.range[1] > depth + ON_FACE
                && (low.0..=high.0).contains(&at.0)
                && (low.1..=high.1).contains(&at.1)
                && contains(&face.shown, at)
                && face.depth_at(at).is_some_and(|d| d > depth + ON_FACE)
        })
    }
}

/// The polygon with its sides moved a little outwards.
fn grown(corners: &[Pixel]) -> Vec<Pixel> {
    let (n, sense) = (corners.len(), area(corners).signum());
    let moved = (0..n).map(|i| {
        let (before, at, after) = (corners[(i + n - 1) % n], corners[i], corners[(i + 1) % n]);
        let [u, v] = [(before, at), (at, after)].map(|(a, b)| heading(a, b).unwrap_or_default());
        // Sharp corners are not drawn out to spikes.
        let bend: f64 = 1.0 + u.0 * v.0 + u.1 * v.1;
        let by = sense * OVERLAP / bend.max(0.5);
        (at.0 + by * (u.1 + v.1), at.1 - by * (u.0 + v.0))
    });
    moved.collect()
}
