//! Space seen in true perspective: a camera and a box with axes, equal scales on all three.

use super::axes::{LABEL, MARK_3D, SMALL};
use super::canvas::{Canvas, Pen, Side, Type};
use super::data::{Bounds, View};
use super::palette::INK;
use super::scene::{Point, cross, dot, draw_walls, minus};
use super::text;
use super::ticks::{self, Tick};
use nalgebra::{Matrix3, SymmetricEigen};

pub(crate) type Pixel = (f64, f64);

/// From the middle of the box to the eye; the box's longest edge is 1.
const DISTANCE: f64 = 3.0;
/// Coordinates beyond this count as not finite: their squares would not be.
const FAR: f64 = 1e100;
/// No edge of the box is shorter than this part of the longest one: a plane shape gets a shallow box.
const SHALLOW: f64 = 0.16;
/// Round the words of the axes, in pixels.
const MARGIN: f64 = 8.0;

/// True if the point can be drawn.
pub(crate) fn drawable(p: &Point) -> bool {
    p.iter().all(|c| c.abs() < FAR)
}

pub(crate) fn along(p: Point, t: f64, d: Point) -> Point {
    std::array::from_fn(|i| p[i] + t * d[i])
}

/// The vector at length 1; `None` if it has no direction.
pub(crate) fn unit(v: Point) -> Option<Point> {
    let largest = v.iter().fold(0.0, |m: f64, c| m.max(c.abs()));
    if !(largest > 0.0 && largest < FAR) {
        return None;
    }
    let v = v.map(|c| c / largest);
    let length = dot(v, v).sqrt();
    Some(v.map(|c| c / length))
}

/// The least box that holds all points; `None` without points.
pub(crate) fn box_of<'a>(points: impl IntoIterator<Item = &'a Point>) -> Option<Bounds> {
    points
        .into_iter()
        .filter(|p| drawable(p))
        .fold(None, |b, p| {
            let b: Bounds = b.unwrap_or_else(|| p.map(|c| [c, c]));
            Some(std::array::from_fn(|i| {
                [b[i][0].min(p[i]), b[i][1].max(p[i])]
            }))
        })
}

/// The longest edge of a box; 1, or what can be told from roundoff, if it is a point.
pub(crate) fn size_of(bounds: &Bounds) -> f64 {
    let longest = bounds.iter().fold(0.0, |m: f64, b| m.max(b[1] - b[0]));
    let largest = bounds
        .iter()
        .flatten()
        .fold(0.0, |m: f64, c| m.max(c.abs()));
    if longest > 1e-9 * largest && longest > 1e-200 {
        longest
    } else if largest > 1e-200 {
        largest
    } else {
        1.0
    }
}

/// How points lie in space.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) struct Spread {
    /// Principal directions, widest first.
    pub axes: [Point; 3],
    /// Root mean squares along them, the box's longest edge being 1.
    pub size: [f64; 3],
}

impl Spread {
    /// Principal axes of the points.
    pub(crate) fn new<'a>(points: impl Iterator<Item = &'a Point> + Clone) -> Option<Self> {
        let bounds = box_of(points.clone())?;
        let size = size_of(&bounds);
        let scaled = |p: &Point| -> Point {
            std::array::from_fn(|i| (p[i] - 0.5 * (bounds[i][0] + bounds[i][1])) / size)
        };
        let (mut n, mut sum, mut square) = (0.0, [0.0; 3], Matrix3::zeros());
        for p in points.filter(|p| drawable(p)).map(scaled) {
            n += 1.0;
            sum = along(sum, 1.0, p);
            square += Matrix3::from_fn(|i, j| p[i] * p[j]);
        }
        let mean = sum.map(|c| c / n);
        let matrix = square / n - Matrix3::from_fn(|i, j| mean[i] * mean[j]);
        let eigen = SymmetricEigen::new(matrix);
        let mut order = [0, 1, 2];
        order.sort_by(|&a, &b| eigen.eigenvalues[b].total_cmp(&eigen.eigenvalues[a]));
        Some(Self {
            axes: order.map(|k| std::array::from_fn(|i| eigen.eigenvectors[(i, k)])),
            size: order.map(|k| eigen.eigenvalues[k].max(0.0).sqrt()),
        })
    }

    /// True if all points lie in a plane, up to what can be seen.
    pub(crate) fn is_plane(&self) -> bool {
        self.size[2] < 1e-4 * self.size[0].max(1e-3)
    }

    /// The side from which the shape is seen best: its principal plane all but faces the eye, z stands up
    /// where that plane does, and x or y runs to the right.
    pub(crate) fn view(&self) -> View {
        let [long, wide, deep] = self.size;
        let slender = wide < 1e-3 * long.max(1e-3) || (deep > 0.6 * wide && wide < 0.75 * long);
        let round = deep > 0.6 * wide && !slender;
        if round {
            return View {
                azimuth: -60.0,
                elevation: 20.0,
            };
        }
        let normal = if slender {
            // From the side.
            unit(cross(self.axes[0], [0.0, 0.0, 1.0]))
                .filter(|_| self.axes[0][2].abs() < 0.95)
                .unwrap_or([0.0, -1.0, 0.0])
        } else {
            self.axes[2]
        };
        let (turn, lift) = if self.is_plane() {
            (12.0, 14.0)
        } else {
            (24.0, 20.0)
        };
        let upright = normal[2].abs();
        if upright > 0.8 {
            // Turned as well it would seem to lean.
            return View {
                azimuth: if self.is_plane() {
                    -90.0
                } else {
                    -90.0 - 0.6 * turn
                },
                elevation: 90.0 - 1.6 * lift,
            };
        }
        // Right is (-sin, cos) of the azimuth.
        let to_right = -normal[1] + 0.99 * normal[0];
        let sign = if upright > 0.3 {
            normal[2].signum()
        } else if to_right < 0.0 {
            -1.0
        } else {
            1.0
        };
        let [x, y, z] = normal.map(|c| sign * c);
        View {
            azimuth: y.atan2(x).to_degrees() + turn,
            elevation: z.asin().to_degrees().clamp(lift, 62.0),
        }
    }
}

/// A box of space shown in a rectangle of the canvas.
pub(crate) struct Stage {
    bounds: Bounds,
    /// The longest edge.
    size: f64,
    right: Point,
    up: Point,
    back: Point,
    scale: f64,
    centre: Pixel,
    edges: [Edge; 3],
    /// left, top, right, bottom of the box with its words.
    used: [f64; 4],
}

/// An edge of the box that carries an axis.
#[derive(Debug, Clone, Default)]
struct Edge {
    ends: [Pixel; 2],
    ticks: Vec<Tick>,
    marks: Vec<[Pixel; 2]>,
    words: Vec<Word>,
    /// Smaller is better.
    cost: f64,
}

#[derive(Debug, Clone)]
struct Word {
    at: Pixel,
    text: String,
    font: Type,
}

impl Word {
    /// left, top, right, bottom.
    fn area(&self) -> [f64; 4] {
        let (mut w, mut h) = (text::width(&self.text, self.font.size), self.font.size);
        let (mut across, mut down) = (self.font.across, self.font.down);
        if self.font.upright {
            std::mem::swap(&mut w, &mut h);
            // Reading upwards, "across" runs up the page and "down" to the right.
            (across, down) = (self.font.down, self.font.across);
        }
        let from = |side: Side, at: f64, length: f64| match side {
            Side::Start => at,
            Side::Middle => at - 0.5 * length,
            Side::End => at - length,
        };
        let (l, t) = (from(across, self.at.0, w), from(down, self.at.1, h));
        [l, t, l + w, t + h]
    }
}

impl Stage {
    /// A box around `content` (with some room) seen from `view`, as large as it fits into the pixels
    /// [left, top, width, height] with its numbers and names.
    pub(crate) fn new(
        content: Bounds,
        labels: &[String; 3],
        view: View,
        rectangle: [f64; 4],
    ) -> Self {
        let size = size_of(&content);
        let bounds: Bounds = content.map(|[lo, hi]| {
            let half = (0.5 * (hi - lo) + 0.05 * size).max(0.5 * SHALLOW * size);
            let mid = 0.5 * (lo + hi);
            [mid - half, mid + half]
        });
        let degrees = |angle: f64, or: f64| if angle.is_finite() { angle } else { or };
        let (sa, ca) = degrees(view.azimuth, -60.0).to_radians().sin_cos();
        let elevation = degrees(view.elevation, 20.0).clamp(-90.0, 90.0);
        let (se, ce) = elevation.to_radians().sin_cos();
        let mut stage = Self {
            size: bounds.iter().fold(0.0, |m: f64, b| m.max(b[1] - b[0])),
            bounds,
            right: [-sa, ca, 0.0],
            up: [-se * ca, -se * sa, ce],
            back: [ce * ca, ce * sa, se],
            scale: 1.0,
            centre: (0.0, 0.0),
            edges: Default::default(),
            used: [0.0; 4],
        };
        // The words' room depends on the scale, hence a few rounds.
        let [left, top, width, height] = rectangle;
        let mut room = [60.0, 14.0, 60.0, 50.0];
        for _ in 0..3 {
            (stage.scale, stage.centre) = (1.0, (0.0, 0.0));
            let drawn = hull((0..8).map(|c| stage.pixel(stage.corner(c))));
            let inner = (
                (width - room[0] - room[2]).max(0.2 * width),
                (height - room[1] - room[3]).max(0.2 * height),
            );
            stage.scale = (inner.0 / (drawn[2] - drawn[0])).min(inner.1 / (drawn[3] - drawn[1]));
            stage.centre = (
                left + room[0] + 0.5 * inner.0 - 0.5 * stage.scale * (drawn[0] + drawn[2]),
                top + room[1] + 0.5 * inner.1 - 0.5 * stage.scale * (drawn[1] + drawn[3]),
            );
            stage.lay_out_axes(labels);
            let frame = hull((0..8).map(|c| stage.pixel(stage.corner(c))));
            let words = stage.edges.iter().flat_map(|e| &e.words).map(Word::area);
            let all = words.fold(frame, |b, a| {
                [
                    b[0].min(a[0]),
                    b[1].min(a[1]),
                    b[2].max(a[2]),
                    b[3].max(a[3]),
                ]
            });
            let sign = [-1.0, -1.0, 1.0, 1.0];
            room = std::array::from_fn(|i| sign[i] * (all[i] - frame[i]) + MARGIN);
            stage.used = all;
        }
        stage
    }

    /// The height that it takes with a margin all round.
    pub(crate) fn height(&self) -> f64 {
        self.used[3] - self.used[1] + 2.0 * MARGIN
    }

    /// The longest edge.
    pub(crate) fn size(&self) -> f64 {
        self.size
    }

    /// Towards the eye from a point.
    pub(crate) fn towards_eye(&self, p: Point) -> Point {
        minus(self.back.map(|c| DISTANCE * c), self.boxed(p))
    }

    /// The centre of the box is the origin and its longest edge 1.
    fn boxed(&self, p: Point) -> Point {
        std::array::from_fn(|i| {
            let [lo, hi] = self.bounds[i];
            (p[i] - 0.5 * (lo + hi)) / self.size
        })
    }

    fn corner(&self, c: usize) -> Point {
        std::array::from_fn(|i| self.bounds[i][c >> i & 1])
    }

    /// How far before the eye; `DISTANCE` at the middle of the box.
    pub(crate) fn depth(&self, p: Point) -> f64 {
        DISTANCE - dot(self.boxed(p), self.back)
    }

    /// How much larger than at the middle of the box things look there.
    pub(crate) fn nearness(&self, p: Point) -> f64 {
        DISTANCE / self.depth(p).max(0.1)
    }

    /// Where a point is seen; not finite if the point is not.
    pub(crate) fn pixel(&self, p: Point) -> Pixel {
        let q = self.boxed(p);
        let f = self.scale / (DISTANCE - dot(q, self.back)).max(0.1);
        (
            self.centre.0 + f * dot(q, self.right),
            self.centre.1 - f * dot(q, self.up),
        )
    }

    /// The floor under a point, or the ceiling if it is seen from below.
    pub(crate) fn on_floor(&self, p: Point) -> Point {
        [p[0], p[1], self.bounds[2][self.far_side(2)]]
    }

    /// True if shadows on the floor can be told from their things.
    pub(crate) fn shows_floor(&self) -> bool {
        (0.13..0.8).contains(&self.back[2]) && self.aspect(0) > 0.3 && self.aspect(1) > 0.3
    }

    fn aspect(&self, i: usize) -> f64 {
        (self.bounds[i][1] - self.bounds[i][0]) / self.size
    }

    fn far_side(&self, axis: usize) -> usize {
        usize::from(self.back[axis] <= 0.0)
    }

    /// The three far walls with grid lines: under everything.
    pub(crate) fn walls(&self, canvas: &mut Canvas) {
        let far = [0, 1, 2].map(|axis| self.far_side(axis));
        let ticks = self.edges.each_ref().map(|edge| edge.ticks.as_slice());
        draw_walls(canvas, &self.bounds, far, ticks, |p| self.pixel(p));
    }

    /// Axes with marks, numbers and names.
    pub(crate) fn axes(&self, canvas: &mut Canvas) {
        let pen = Pen::new(INK, 0.9);
        for edge in &self.edges {
            canvas.line(&edge.ends, pen);
            for mark in &edge.marks {
                canvas.line(mark, pen);
            }
            for word in &edge.words {
                canvas.text(word.at, &word.text, word.font);
            }
        }
    }

    /// Chooses for each axis one of the edges of the outline, so that no words meet.
    fn lay_out_axes(&mut self, labels: &[String; 3]) {
        let options: Vec<Vec<Edge>> = (0..3)
            .map(|axis| {
                let mut edges: Vec<Edge> = (0..8)
                    .filter(|c| c >> axis & 1 == 0)
                    .map(|c| self.edge(axis, c, &labels[axis]))
                    .collect();
                edges.sort_by(|a, b| a.cost.total_cmp(&b.cost));
                edges.truncate(3);
                edges
            })
            .collect();
        let mut least = f64::INFINITY;
        let mut chosen = [0; 3];
        for n in 0..27 {
            let pick = [n % 3, n / 3 % 3, n / 9];
            let edges: [&Edge; 3] = std::array::from_fn(|i| &options[i][pick[i]]);
            let cost: f64 = edges.iter().map(|e| e.cost).sum::<f64>() + clashes(edges);
            if cost < least {
                (least, chosen) = (cost, pick);
            }
        }
        self.edges = std::array::from_fn(|i| options[i][chosen[i]].clone());
    }

    /// The edge along `axis` from a corner, with its words.
    fn edge(&self, axis: usize, corner: usize, label: &str) -> Edge {
        let start = self.corner(corner);
        let [lo, hi] = self.bounds[axis];
        let on = |t: f64| {
            let mut p = start;
            p[axis] = t;
            self.pixel(p)
        };
        let (a, b) = (on(lo), on(hi));
        let (dx, dy) = (b.0 - a.0, b.1 - a.1);
        let length = dx.hypot(dy).max(1e-9);
        let mid = on(0.5 * (lo + hi));
        let middle = self.pixel(std::array::from_fn(|i| {
            0.5 * (self.bounds[i][0] + self.bounds[i][1])
        }));
        let mut out = (-dy / length, dx / length);
        if out.0 * (mid.0 - middle.0) + out.1 * (mid.1 - middle.1) < 0.0 {
            out = (-out.0, -out.1);
        }
        let upright = dy.abs() > 2.5 * dx.abs();
        let needed = (46.0 * dx.abs() + 24.0 * dy.abs()) / length;
        let ticks = if length > 26.0 {
            ticks::linear(lo, hi, (length / needed).clamp(1.0, 6.0) as usize)
        } else {
            Vec::new()
        };
        let side = if out.0 > 0.35 {
            Side::Start
        } else if out.0 < -0.35 {
            Side::End
        } else {
            Side::Middle
        };
        let font = Type::new(SMALL, side, Side::Middle);
        let mut edge = Edge {
            ends: [a, b],
            ..Edge::default()
        };
        let mut widest = 0f64;
        for tick in &ticks {
            let p = on(tick.value);
            let by = |d: f64| (p.0 + d * out.0, p.1 + d * out.1);
            edge.marks.push([p, by(MARK_3D)]);
            let text = tick.label.clone().unwrap_or_default();
            widest = widest.max(text::width(&text, SMALL));
            edge.words.push(Word {
                at: by(MARK_3D + 6.0 + 3.0 * out.1.abs()),
                text,
                font,
            });
        }
        edge.ticks = ticks;
        if length > 12.0 {
            let beside = if side == Side::Middle {
                0.5 * widest * out.0.abs()
            } else {
                widest * out.0.abs()
            };
            let off = MARK_3D + 14.0 + beside + 14.0 * out.1.abs();
            let turned = upright && length > text::width(label, LABEL);
            let font = if turned {
                let down = if out.0 < 0.0 { Side::End } else { Side::Start };
                Type::new(LABEL, Side::Middle, down).upwards()
            } else {
                Type::new(LABEL, side, Side::Middle)
            };
            edge.words.push(Word {
                at: (mid.0 + off * out.0, mid.1 + off * out.1),
                text: label.to_string(),
                font,
            });
        }
        // Only edges of the outline: one of the two faces that meet there is seen, the other is not.
        let eye = self.back.map(|c| DISTANCE * c);
        let seen = |i: usize| {
            let out = if corner >> i & 1 == 1 { 1.0 } else { -1.0 };
            out * eye[i] > 0.5 * self.aspect(i)
        };
        let outline = seen((axis + 1) % 3) != seen((axis + 2) % 3);
        // Rather at the left if it stands, and below if it lies.
        let frame = hull((0..8).map(|c| self.pixel(self.corner(c))));
        let place = if upright {
            2.0 * (mid.0 - frame[0]) / (frame[2] - frame[0])
        } else {
            8.0 * (frame[3] - mid.1) / (frame[3] - frame[1])
        };
        edge.cost = place + if outline { 0.0 } else { 60.0 };
        edge
    }
}

/// A large number for every two words of different edges that meet.
fn clashes(edges: [&Edge; 3]) -> f64 {
    let areas: Vec<(usize, [f64; 4])> = edges
        .iter()
        .enumerate()
        .flat_map(|(i, edge)| edge.words.iter().map(move |word| (i, word.area())))
        .collect();
    let mut count = 0.0;
    for (k, (i, a)) in areas.iter().enumerate() {
        for (j, b) in &areas[..k] {
            let meet =
                a[0] < b[2] + 3.0 && b[0] < a[2] + 3.0 && a[1] < b[3] + 1.0 && b[1] < a[3] + 1.0;
            if i != j && meet {
                count += 1.0;
            }
        }
    }
    300.0 * count
}

/// left, top, right, bottom of some pixels.
fn hull(pixels: impl Iterator<Item = Pixel>) -> [f64; 4] {
    let start = [f64::MAX, f64::MAX, f64::MIN, f64::MIN];
    pixels.fold(start, |b, p| {
        [b[0].min(p.0), b[1].min(p.1), b[2].max(p.0), b[3].max(p.1)]
    })
}

#[cfg(test)]
mod tests {
    use super::*;

    fn facing(points: &[Point], normal: Point) -> f64 {
        let view = Spread::new(points.iter()).unwrap().view();
        let (sa, ca) = view.azimuth.to_radians().sin_cos();
        let (se, ce) = view.elevation.to_radians().sin_cos();
        dot([ce * ca, ce * sa, se], normal).abs()
    }

    /// Catches a camera that looks along the plane of a plane shape.
    #[test]
    fn planes_face_the_eye() {
        let arc: Vec<[f64; 2]> = (0..30)
            .map(|i| [0.1 * i as f64, (0.1 * i as f64).sin()])
            .collect();
        for (axis, normal) in [
            (0, [1.0, 0.0, 0.0]),
            (1, [0.0, 1.0, 0.0]),
            (2, [0.0, 0.0, 1.0]),
        ] {
            let points: Vec<Point> = arc
                .iter()
                .map(|[a, b]| {
                    let mut p = [0.0; 3];
                    (p[(axis + 1) % 3], p[(axis + 2) % 3]) = (*a, *b);
                    p
                })
                .collect();
            assert!(facing(&points, normal) > 0.9, "{axis}");
            assert!(Spread::new(points.iter()).unwrap().is_plane());
        }
        let tilted: Vec<Point> = arc.iter().map(|[a, b]| [*a, *b, 0.5 * a]).collect();
        assert!(facing(&tilted, unit([-0.5, 0.0, 1.0]).unwrap()) > 0.8);
    }

    /// Catches a projection that is parallel, mirrored or of unequal scales.
    #[test]
    fn near_things_look_larger() {
        let view = View {
            azimuth: -90.0,
            elevation: 0.0,
        };
        let labels = ["x", "y", "z"].map(String::from);
        let stage = Stage::new([[-1.0, 1.0]; 3], &labels, view, [0.0, 0.0, 400.0, 400.0]);
        let span = |y: f64, i: usize| {
            let mut d = [0.0, y, 0.0];
            d[i] = 0.5;
            let (a, b) = (stage.pixel([0.0, y, 0.0]), stage.pixel(d));
            (b.0 - a.0, b.1 - a.1)
        };
        let (near, far) = (span(-1.0, 0), span(1.0, 0));
        // The eye stands at (0, -3 L, 0), L the box's edge.
        let eye = 3.0 * stage.size();
        let ratio = near.0 / far.0;
        assert!((ratio - (eye + 1.0) / (eye - 1.0)).abs() < 1e-12 && far.0 > 0.0);
        let up = span(-1.0, 2);
        assert!((near.0 + up.1).abs() < 1e-9 && up.1 < 0.0, "{up:?}");
        let want = eye / (eye - 1.0);
        assert!((stage.nearness([0.0, -1.0, 0.0]) - want).abs() < 1e-12);
    }
}
