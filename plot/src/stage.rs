//! A box of space with walls and axes, seen by a camera.

use super::axes::{LABEL, MARK_3D, SMALL};
use super::camera::Camera;
use super::canvas::{Canvas, Pen, Side, Type};
use super::data::{Bounds, View};
use super::geometry::{Pixel, Point, dot, hull, meet, minus};
use super::palette::{Colour, FAINT, INK};
use super::text;
use super::ticks::{self, Tick};

/// Distance of the eye from the middle of the box for rods; the box's longest edge is 1.
const DISTANCE: f64 = 3.0;
/// Least edge of the box relative to the longest: a plane shape gets a shallow box.
const SHALLOW: f64 = 0.16;
/// Margin round the words of the axes, in pixels.
const MARGIN: f64 = 8.0;
/// Most rounds of the placement of box and words.
const ROUNDS: usize = 8;

/// Longest edge of a box; for a point, 1 or a size well above roundoff.
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

/// A box of space shown in a rectangle of the canvas.
#[derive(Clone)]
pub(crate) struct Stage {
    bounds: Bounds,
    /// Lengths of the edges before the camera, the longest about 1.
    aspect: Point,
    camera: Camera,
    edges: [AxisEdge; 3],
    /// Bounding box [left, top, right, bottom] of the box with its words.
    used: [f64; 4],
}

/// An edge of the box that carries an axis.
#[derive(Debug, Clone, Default)]
struct AxisEdge {
    ends: [Pixel; 2],
    ticks: Vec<Tick>,
    marks: Vec<[Pixel; 2]>,
    words: Vec<StageWord>,
    /// Cost of the choice; smaller is better.
    cost: f64,
}

#[derive(Debug, Clone)]
struct StageWord {
    at: Pixel,
    text: String,
    font: Type,
}

impl StageWord {
    /// Bounding box [left, top, right, bottom].
    fn area(&self) -> [f64; 4] {
        let (mut w, mut h) = (text::width(&self.text, self.font.size), self.font.size);
        let (mut across, mut down) = (self.font.across, self.font.down);
        if self.font.upright {
            std::mem::swap(&mut w, &mut h);
            // For text that reads upwards, "across" runs up the page and "down" to the right.
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

impl AxisEdge {
    /// True if two numbers in a row touch.
    fn overprints(&self) -> bool {
        let mut pairs = self.words.windows(2);
        pairs.any(|two| meet(&two[0].area(), &two[1].area(), 2.0, -3.0))
    }

    /// Leaves out every other number with its mark, but not 0.
    fn thin_out(&mut self) {
        let is_zero = |word: &StageWord| word.text.chars().all(|c| "0.".contains(c));
        let odd = self.words.iter().position(is_zero).unwrap_or(0) % 2;
        let mut k = 0;
        self.words.retain(|_| {
            k += 1;
            k % 2 != odd
        });
        let mut k = 0;
        self.marks.retain(|_| {
            k += 1;
            k % 2 != odd
        });
    }

    /// Moves numbers that run into a word of another axis a little towards the middle of the edge, as where
    /// both axes end in one corner. A number that cannot be parted goes with its mark.
    fn yield_to(&mut self, others: &[StageWord]) {
        let areas: Vec<[f64; 4]> = others.iter().map(StageWord::area).collect();
        let close = |word: &StageWord| {
            areas
                .iter()
                .any(|area| meet(&word.area(), area, 10.0, -4.0))
        };
        let [a, b] = self.ends;
        let middle = (0.5 * (a.0 + b.0), 0.5 * (a.1 + b.1));
        let marks = std::mem::take(&mut self.marks);
        // Numbers come first, one for each mark; the name of the axis stays.
        for (k, word) in std::mem::take(&mut self.words).into_iter().enumerate() {
            let Some(mark) = marks.get(k) else {
                self.words.push(word);
                continue;
            };
            let (dx, dy) = (middle.0 - mark[0].0, middle.1 - mark[0].1);
            let length = dx.hypot(dy).max(1e-9);
            let moved = NUDGES.map(|by| StageWord {
                at: (word.at.0 + by * dx / length, word.at.1 + by * dy / length),
                ..word.clone()
            });
            if let Some(word) = moved.into_iter().find(|word| !close(word)) {
                self.words.push(word);
                self.marks.push(*mark);
            }
        }
    }
}

/// Shifts of the number of a tick along its edge, in pixels.
const NUDGES: [f64; 4] = [0.0, 3.0, 6.0, 9.0];

impl Stage {
    /// A box around `content` (with some room) seen from `view`, with its numbers and names as large as the
    /// pixels [left, top, width, height] allow.
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
        let longest = bounds.iter().fold(0.0, |m: f64, b| m.max(b[1] - b[0]));
        let aspect = bounds.map(|[lo, hi]| (hi - lo) / longest);
        Self::seen(
            bounds,
            labels,
            aspect,
            Camera::new(view, DISTANCE),
            rectangle,
        )
    }

    /// Exactly the box `bounds`, its edges drawn in the ratios of `aspect`, seen by any camera.
    pub(crate) fn seen(
        bounds: Bounds,
        labels: &[String; 3],
        aspect: Point,
        camera: Camera,
        rectangle: [f64; 4],
    ) -> Self {
        let mut stage = Self {
            bounds,
            aspect,
            camera,
            edges: Default::default(),
            used: [0.0; 4],
        };
        // The words' room depends on the scale, hence a few rounds. From the third on the room only grows:
        // otherwise words that change edges might alternate for ever, and end with too little room.
        let mut room = [60.0, 14.0, 60.0, 50.0];
        for round in 0..ROUNDS {
            let corners: [Point; 8] = std::array::from_fn(|c| stage.boxed(stage.corner(c)));
            stage.camera.fit(corners.into_iter(), rectangle, room);
            stage.lay_out_axes(labels);
            let frame = hull((0..8).map(|c| stage.pixel(stage.corner(c))));
            let words = stage
                .edges
                .iter()
                .flat_map(|e| &e.words)
                .map(StageWord::area);
            let all = words.fold(frame, |b, a| {
                hull([b, a].map(|b| [(b[0], b[1]), (b[2], b[3])]).concat())
            });
            let sign = [-1.0, -1.0, 1.0, 1.0];
            stage.used = all;
            let taken: [f64; 4] = std::array::from_fn(|i| sign[i] * (all[i] - frame[i]) + MARGIN);
            if round < 2 {
                room = taken;
            } else if (0..4).all(|i| taken[i] <= room[i] + 0.5) {
                break;
            } else {
                room = std::array::from_fn(|i| room[i].max(taken[i]));
            }
        }
        stage
    }

    /// The camera, for points in coordinates of [`Stage::boxed`].
    pub(crate) fn camera(&self) -> &Camera {
        &self.camera
    }

    /// Lengths of the edges in coordinates of [`Stage::boxed`].
    pub(crate) fn aspect(&self) -> Point {
        self.aspect
    }

    /// The box with its words: left, top, right, bottom.
    pub(crate) fn area(&self) -> [f64; 4] {
        self.used
    }

    /// Height of the box with its words and a margin all round.
    pub(crate) fn height(&self) -> f64 {
        self.used[3] - self.used[1] + 2.0 * MARGIN
    }

    /// Data length of 1 before the camera, along the first axis: the longest edge if all axes have one scale.
    pub(crate) fn size(&self) -> f64 {
        (self.bounds[0][1] - self.bounds[0][0]) / self.aspect[0]
    }

    /// Vector from a point to the eye.
    pub(crate) fn towards_eye(&self, p: Point) -> Point {
        minus(self.camera.back.map(|c| DISTANCE * c), self.boxed(p))
    }

    /// Coordinates before the camera: the centre of the box is the origin.
    pub(crate) fn boxed(&self, p: Point) -> Point {
        std::array::from_fn(|i| {
            let [lo, hi] = self.bounds[i];
            self.aspect[i] * ((p[i] - 0.5 * (lo + hi)) / (hi - lo))
        })
    }

    fn corner(&self, c: usize) -> Point {
        std::array::from_fn(|i| self.bounds[i][c >> i & 1])
    }

    /// Depth before the eye; `DISTANCE` at the middle of the box.
    pub(crate) fn depth(&self, p: Point) -> f64 {
        DISTANCE - dot(self.boxed(p), self.camera.back)
    }

    /// Magnification at a point, relative to the middle of the box.
    pub(crate) fn nearness(&self, p: Point) -> f64 {
        self.camera.nearness(self.boxed(p))
    }

    /// The pixel of a point; not finite if the point is not.
    pub(crate) fn pixel(&self, p: Point) -> Pixel {
        self.camera.pixel(self.boxed(p))
    }

    /// Projection of a point to the floor, or to the ceiling if seen from below.
    pub(crate) fn on_floor(&self, p: Point) -> Point {
        [p[0], p[1], self.bounds[2][self.far_side(2)]]
    }

    /// True if shadows on the floor can be told from their things.
    pub(crate) fn shows_floor(&self) -> bool {
        (0.13..0.8).contains(&self.camera.back[2]) && self.aspect[0] > 0.3 && self.aspect[1] > 0.3
    }

    fn far_side(&self, axis: usize) -> usize {
        usize::from(self.camera.back[axis] <= 0.0)
    }

    /// Draws the three far walls with grid lines at the ticks, under everything.
    pub(crate) fn walls(&self, canvas: &mut Canvas) {
        for axis in 0..3 {
            let (u, v) = ((axis + 1) % 3, (axis + 2) % 3);
            let place = |a: f64, b: f64| {
                let mut p = [self.bounds[axis][self.far_side(axis)]; 3];
                (p[u], p[v]) = (a, b);
                self.pixel(p)
            };
            let ([ul, uh], [vl, vh]) = (self.bounds[u], self.bounds[v]);
            let wall = [place(ul, vl), place(uh, vl), place(uh, vh), place(ul, vh)];
            canvas.polygon(&wall, Colour(250, 250, 250), 1.0);
            let pen = Pen::new(FAINT, 0.7);
            for tick in &self.edges[u].ticks {
                canvas.line(&[place(tick.value, vl), place(tick.value, vh)], pen);
            }
            for tick in &self.edges[v].ticks {
                canvas.line(&[place(ul, tick.value), place(uh, tick.value)], pen);
            }
            canvas.line(&[wall[0], wall[1], wall[2], wall[3], wall[0]], pen);
        }
    }

    /// Draws the axes with marks, numbers and names.
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

    /// Chooses for each axis one of the edges of the outline, with a minimum of overlapping words. In parallel
    /// projection the numbers of axes that end in one corner are close on any edge; then each axis has its best edge.
    fn lay_out_axes(&mut self, labels: &[String; 3]) {
        let options: Vec<Vec<AxisEdge>> = (0..3)
            .map(|axis| {
                let mut edges: Vec<AxisEdge> = (0..8)
                    .filter(|c| c >> axis & 1 == 0)
                    .map(|c| self.edge(axis, c, &labels[axis]))
                    .collect();
                edges.sort_by(|a, b| a.cost.total_cmp(&b.cost));
                edges.truncate(if self.camera.is_parallel() { 1 } else { 3 });
                edges
            })
            .collect();
        let picks = (0..27).map(|n| [n % 3, n / 3 % 3, n / 9]);
        let picked = picks.filter_map(|pick| {
            let edges = [0, 1, 2].map(|i| options[i].get(pick[i]));
            let [Some(a), Some(b), Some(c)] = edges else {
                return None;
            };
            Some((a.cost + b.cost + c.cost + clashes([a, b, c]), [a, b, c]))
        });
        if let Some((_, edges)) = picked.min_by(|a, b| a.0.total_cmp(&b.0)) {
            self.edges = edges.map(AxisEdge::clone);
            for [one, other] in [[0, 1], [0, 2], [1, 2]] {
                let fewer = self.edges[one].ticks.len() < self.edges[other].ticks.len();
                let (from, beside) = if fewer { (other, one) } else { (one, other) };
                let beside = self.edges[beside].words.clone();
                self.edges[from].yield_to(&beside);
            }
        }
    }

    /// The edge along `axis` from a corner, with its words.
    fn edge(&self, axis: usize, corner: usize, label: &str) -> AxisEdge {
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
        let ticks = if label.ends_with("(rad)") {
            ticks::angles(lo, hi)
        } else if length > 26.0 {
            // One number defines no scale: two may stand closer than more do.
            let close = (60.0 * dx.abs() + 28.0 * dy.abs()) / length;
            let least = if length > close { 2.0 } else { 1.0 };
            ticks::linear(lo, hi, (length / needed).clamp(least, 6.0) as usize)
        } else {
            Vec::new()
        };
        let side = match out.0 {
            x if x > 0.35 => Side::Start,
            x if x < -0.35 => Side::End,
            _ => Side::Middle,
        };
        let font = Type::new(SMALL, side, Side::Middle);
        let mut edge = AxisEdge {
            ends: [a, b],
            ..AxisEdge::default()
        };
        let mut widest = 0f64;
        for tick in &ticks {
            let p = on(tick.value);
            let by = |d: f64| (p.0 + d * out.0, p.1 + d * out.1);
            edge.marks.push([p, by(MARK_3D)]);
            let text = tick.label.clone().unwrap_or_default();
            widest = widest.max(text::width(&text, SMALL));
            edge.words.push(StageWord {
                at: by(MARK_3D + 6.0 + 3.0 * out.1.abs()),
                text,
                font,
            });
        }
        while edge.overprints() {
            edge.thin_out();
        }
        edge.ticks = ticks;
        if length > 12.0 {
            let part = if side == Side::Middle { 0.5 } else { 1.0 };
            let off = MARK_3D + 14.0 + part * widest * out.0.abs() + 14.0 * out.1.abs();
            let turned = upright && length > text::width(label, LABEL);
            let font = if turned {
                let down = if out.0 < 0.0 { Side::End } else { Side::Start };
                Type::new(LABEL, Side::Middle, down).upwards()
            } else {
                Type::new(LABEL, side, Side::Middle)
            };
            edge.words.push(StageWord {
                at: (mid.0 + off * out.0, mid.1 + off * out.1),
                text: label.to_string(),
                font,
            });
        }
        // Only edges of the outline: of the two faces at the edge one is visible and one is not.
        let seen = |i: usize| {
            let out = if corner >> i & 1 == 1 { 1.0 } else { -1.0 };
            out * self.camera.back[i] > 0.5 * self.aspect[i] / self.camera.distance
        };
        let outline = seen((axis + 1) % 3) != seen((axis + 2) % 3);
        // Vertical edges preferably at the left, horizontal ones below.
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

/// Number of overlapping pairs of words of different edges, times a large cost.
fn clashes(edges: [&AxisEdge; 3]) -> f64 {
    let areas: Vec<(usize, [f64; 4])> = edges
        .iter()
        .enumerate()
        .flat_map(|(i, edge)| edge.words.iter().map(move |word| (i, word.area())))
        .collect();
    let pairs = areas.iter().enumerate();
    let pairs = pairs.flat_map(|(k, a)| areas[..k].iter().map(move |b| (a, b)));
    let count = pairs.filter(|((i, a), (j, b))| i != j && meet(a, b, 3.0, 1.0));
    300.0 * count.count() as f64
}

#[cfg(test)]
mod tests {
    use super::*;

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
