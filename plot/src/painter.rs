//! Painting of rods, plates and arrows from back to front; nearer things cut a white rim into things behind.

use super::axes::SMALL;
use super::canvas::{Canvas, Pen, Side, Type};
use super::geometry::{
    Pixel, Point, along, apart, between, cross, dot, dotted, drawable, finite, heading, length,
    minus, norm, tangent, thin, unit,
};
use super::labels;
use super::palette::{Colour, GREY, INK, WHITE, category};
use super::scenery::{Ground, Scenery, SpaceBody, SpaceRod, pen};
use super::stage::Stage;

/// Depth difference, as a part of the box, below which crossing things count as touching: no rim is cut.
const TOUCHING: f64 = 0.025;

/// Distance from a drawn line, in pixels, that nobody sees.
const THIN: f64 = 0.06;

/// Colour of the k-th director and of the components along it.
fn director(k: usize) -> Colour {
    category(k)
}

/// Things to paint, with their distance from the eye.
pub(crate) struct Painter<'a> {
    stage: &'a Stage,
    halo: bool,
    /// Length of a piece of a line, in pixels. Pieces are painted from the farthest to the nearest.
    piece: f64,
    things: Vec<(f64, Vec<Ink>)>,
    plates: Vec<[Point; 8]>,
    /// Words beside points lie over everything.
    words: Vec<(Pixel, &'static str, Colour)>,
}

enum Ink {
    Area(Vec<Pixel>, Colour),
    /// A transparent area.
    Glass(Vec<Pixel>, Colour),
    Line(Vec<Pixel>, Pen),
    Disc(Pixel, f64, Colour),
}

/// A place on a rod.
#[derive(Clone, Copy)]
struct PaintedPlace {
    at: Point,
    /// Director d1.
    side: Option<Point>,
    pixel: Pixel,
}

impl<'a> Painter<'a> {
    pub(crate) fn new(stage: &'a Stage, halo: bool) -> Self {
        Self {
            stage,
            halo,
            // In a plane nothing passes behind another.
            piece: if halo { 9.0 } else { 28.0 },
            things: Vec::new(),
            plates: Vec::new(),
            words: Vec::new(),
        }
    }

    fn add(&mut self, at: Point, inks: Vec<Ink>) {
        self.things.push((self.stage.depth(at), inks));
    }

    /// A white rim along a line, cut into things well behind. `thick`: the depth of the thing itself.
    fn rim(&mut self, at: Point, line: &[Pixel], half: f64, thick: f64) {
        if self.halo {
            let behind = TOUCHING + thick / self.stage.size();
            let rim = vec![Ink::Area(strip(line, half), WHITE)];
            self.things.push((self.stage.depth(at) + behind, rim));
        }
    }

    /// Paints from back to front. Parts in one plane are painted in their order.
    pub(crate) fn paint(mut self, canvas: &mut Canvas) {
        let inks = self.things.iter().flat_map(|(_, inks)| inks);
        let lines = inks.filter_map(|ink| match ink {
            Ink::Line(line, _) => Some(line),
            _ => None,
        });
        let ink: Vec<Pixel> = lines.flat_map(|line| dotted(line, 3.0)).collect();
        if self.halo {
            self.things.sort_by(|a, b| b.0.total_cmp(&a.0));
        }
        for ink in self.things.into_iter().flat_map(|(_, inks)| inks) {
            match ink {
                Ink::Area(corners, colour) => canvas.polygon(&corners, colour, 1.0),
                Ink::Glass(corners, colour) => canvas.polygon(&corners, colour, 0.7),
                Ink::Line(points, pen) => canvas.line(&points, pen),
                Ink::Disc(at, radius, colour) => {
                    canvas.disc(at, radius + 0.8, WHITE, 1.0);
                    canvas.disc(at, radius, colour, 1.0);
                }
            }
        }
        let words: Vec<(Pixel, &str)> = self
            .words
            .iter()
            .map(|(at, word, _)| (*at, *word))
            .collect();
        let tips: Vec<Pixel> = words.iter().map(|(at, _)| *at).collect();
        let placed = labels::place(self.stage.area(), &ink, &tips, &words);
        for ((_, word, colour), placed) in self.words.iter().zip(placed) {
            let colour = colour.shade(0.25);
            if let Some(leader) = placed.leader {
                canvas.line(&leader, Pen::new(colour, 0.6));
            }
            let font = Type::new(SMALL, Side::Middle, Side::Middle);
            canvas.halo_text(placed.at, word, font.colour(colour));
        }
    }

    /// Adds a rod with shadow, plate, ribbon and the mark at the end.
    pub(crate) fn rod(&mut self, rod: &SpaceRod, colour: Colour, with: &Scenery) {
        let Some((first, last)) = rod.ends() else {
            return;
        };
        if with.shadow && self.stage.shows_floor() {
            let shadow = |p: &Point| {
                if drawable(p) {
                    self.stage.pixel(self.stage.on_floor(*p))
                } else {
                    (f64::NAN, f64::NAN)
                }
            };
            let pen = Pen::new(Colour(208, 208, 208), 2.2);
            let line = Ink::Line(rod.points.iter().map(shadow).collect(), pen);
            self.things.push((f64::INFINITY, vec![line]));
        }
        for (end, at) in [first, last].into_iter().enumerate() {
            match with.ground(rod, end) {
                Some(Ground::Clamp) => with
                    .plate(rod, end)
                    .into_iter()
                    .for_each(|at| self.plate(at)),
                Some(Ground::Ball) => self.ring(rod.points[at]),
                None => {}
            }
        }
        let pen = pen(rod, colour);
        let ribbon = with.ribbon;
        for piece in self.pieces(rod, pen) {
            self.piece(&piece, pen, ribbon);
        }
        let end = rod.points[last];
        match rod.triad(last).filter(|_| with.triads) {
            Some(triad) => {
                for (k, (d, word)) in triad.into_iter().zip(["d₁", "d₂", "d₃"]).enumerate() {
                    let tip = along(end, with.arm, d);
                    self.arrow(end, tip, Pen::new(director(k), 1.6), 1);
                    if !(rod.unstable && with.dashed_unnamed) {
                        self.word(tip, word, director(k));
                    }
                }
            }
            None if with.ground(rod, 1).is_some() => {}
            None => {
                let radius = 4.2 * self.stage.nearness(end);
                let radius = if rod.unstable { 0.75 * radius } else { radius };
                self.add(end, vec![Ink::Disc(self.stage.pixel(end), radius, colour)]);
            }
        }
    }

    /// The rod cut into pieces for the order of painting, longer ones in a plane, or into its dashes.
    fn pieces(&self, rod: &SpaceRod, pen: Pen) -> Vec<Vec<PaintedPlace>> {
        let step = if pen.dash.is_some() { 1.5 } else { 7.0 };
        let station = |at: Point, side: Option<Point>| PaintedPlace {
            at,
            side,
            pixel: self.stage.pixel(at),
        };
        let mut pieces = Vec::new();
        let mut piece: Vec<PaintedPlace> = Vec::new();
        let (mut drawing, mut length) = (true, 0.0);
        let given = |i: usize| {
            let p = rod.points.get(i).filter(|p| drawable(p))?;
            Some(station(*p, rod.triad(i).map(|t| t[0])))
        };
        for i in 0..rod.points.len() {
            let Some(from) = given(i) else {
                pieces.extend(Some(std::mem::take(&mut piece)).filter(|p| p.len() > 1));
                (drawing, length) = (true, 0.0);
                continue;
            };
            if piece.is_empty() && drawing {
                piece.push(from);
            }
            let Some(to) = given(i + 1) else {
                continue;
            };
            let n = (apart(from.pixel, to.pixel) / step)
                .ceil()
                .clamp(1.0, 800.0) as usize;
            for k in 1..=n {
                let t = k as f64 / n as f64;
                let side = match (from.side, to.side) {
                    (Some(a), Some(b)) => unit(between(a, b, t)),
                    _ => None,
                };
                let part = || station(between(from.at, to.at, t), side);
                let next = if k == n { to } else { part() };
                length += apart(from.pixel, to.pixel) / n as f64;
                if drawing {
                    piece.push(next);
                }
                let wanted = match pen.dash {
                    None => self.piece,
                    Some((on, _)) if drawing => on - pen.width,
                    Some((_, off)) => off + pen.width,
                };
                if length >= wanted - 0.5 {
                    length = 0.0;
                    pieces.extend(Some(std::mem::take(&mut piece)).filter(|p| p.len() > 1));
                    drawing = pen.dash.is_none() || !drawing;
                    if drawing {
                        piece.push(next);
                    }
                }
            }
        }
        pieces.extend(Some(piece).filter(|p| p.len() > 1));
        pieces
    }

    fn piece(&mut self, piece: &[PaintedPlace], pen: Pen, ribbon: f64) {
        let middle = piece[piece.len() / 2].at;
        let near = self.stage.nearness(middle);
        let width = pen.width * near.powf(1.6).clamp(0.55, 1.9);
        let pen = Pen {
            width,
            dash: None,
            ..pen
        };
        let line: Vec<Pixel> = piece.iter().map(|s| s.pixel).collect();
        let line = thin(&line, THIN);
        let mut inks = Vec::new();
        let sides: Option<Vec<Point>> = piece.iter().map(|s| s.side).collect();
        if let Some(sides) = sides.filter(|_| ribbon > 0.0) {
            let edge = |sign: f64| -> Vec<Pixel> {
                let at = piece.iter().zip(&sides);
                let edge = at.map(|(s, d)| self.stage.pixel(along(s.at, 0.5 * sign * ribbon, *d)));
                thin(&edge.collect::<Vec<Pixel>>(), THIN)
            };
            let (left, right) = (edge(1.0), edge(-1.0));
            let run = minus(piece[piece.len() - 1].at, piece[0].at);
            let normal = unit(cross(run, sides[piece.len() / 2])).unwrap_or_default();
            let eye = unit(self.stage.towards_eye(middle)).unwrap_or_default();
            let facing = dot(normal, eye);
            // The back is paler than the front, and both are darker at an oblique view.
            let tint = if facing > 0.0 { 0.45 } else { 0.75 };
            let fill = pen.colour.tint(tint).shade(0.22 * (1.0 - facing.abs()));
            self.rim(middle, &left, 2.0, ribbon);
            self.rim(middle, &right, 2.0, ribbon);
            let band: Vec<Pixel> = left.iter().chain(right.iter().rev()).copied().collect();
            // A line in the band's own colour hides the seams between bands.
            inks.push(Ink::Area(band.clone(), fill));
            inks.push(Ink::Line(
                vec![band[0], band[band.len() - 1]],
                Pen::new(fill, 0.5),
            ));
            let rim = Pen::new(pen.colour.shade(0.15), 0.8);
            inks.push(Ink::Line(left, rim));
            inks.push(Ink::Line(right, rim));
            let axis = Pen {
                width: 0.6 * pen.width,
                ..pen
            };
            inks.push(Ink::Line(line, axis));
        } else {
            self.rim(middle, &line, 0.5 * width + 1.7, 0.0);
            inks.push(Ink::Line(line, pen));
        }
        self.add(middle, inks);
    }

    /// Adds the plate of a clamp, once even if several rods share it.
    fn plate(&mut self, corners: [Point; 8]) {
        let close = |a: Point, b: Point| norm(minus(a, b)) < 1e-6 * self.stage.size();
        let drawn = |other: &[Point; 8]| (0..8).all(|i| close(other[i], corners[i]));
        if self.plates.iter().any(drawn) {
            return;
        }
        self.plates.push(corners);
        self.solid(corners, GREY, Ink::Area);
    }

    /// Adds a ball joint on the ground.
    fn ring(&mut self, at: Point) {
        let (pixel, radius) = (self.stage.pixel(at), 4.2 * self.stage.nearness(at));
        let ring = [(radius, INK), (0.5 * radius, WHITE)];
        let ring = ring.map(|(radius, colour)| Ink::Disc(pixel, radius, colour));
        self.add(at, ring.into());
    }

    /// Adds a body: its box, or a ball for a point mass.
    pub(crate) fn body(&mut self, body: &SpaceBody, colour: Colour) {
        match body.corners() {
            Some(corners) => self.solid(corners, colour, Ink::Glass),
            None if drawable(&body.centre) => {
                let radius = 5.5 * self.stage.nearness(body.centre);
                let ball = Ink::Disc(self.stage.pixel(body.centre), radius, colour);
                self.add(body.centre, vec![ball]);
            }
            None => {}
        }
    }

    /// Adds a line, as the path of a point, hidden by nearer things.
    pub(crate) fn path(&mut self, points: &[Point], pen: Pen) {
        for run in points.split(|p| !drawable(p)) {
            let pixels: Vec<Pixel> = run.iter().map(|p| self.stage.pixel(*p)).collect();
            let mut from = 0;
            for to in 1..run.len() {
                let line = &pixels[from..=to];
                if to + 1 == run.len() || length(line) > self.piece {
                    let middle = between(run[from], run[to], 0.5);
                    self.add(middle, vec![Ink::Line(thin(line, THIN), pen)]);
                    from = to;
                }
            }
        }
    }

    /// Adds a convex solid of six faces: four corners in front, the same four behind.
    fn solid(
        &mut self,
        corners: [Point; 8],
        colour: Colour,
        face_of: fn(Vec<Pixel>, Colour) -> Ink,
    ) {
        let middle = |of: &[usize]| -> Point {
            let sum = of.iter().fold([0.0; 3], |s, &i| along(s, 1.0, corners[i]));
            sum.map(|c| c / of.len() as f64)
        };
        let centre = middle(&[0, 1, 2, 3, 4, 5, 6, 7]);
        let faces = [
            ([0, 1, 2, 3], 0.72),
            ([4, 5, 6, 7], 0.72),
            ([0, 1, 5, 4], 0.45),
            ([1, 2, 6, 5], 0.35),
            ([2, 3, 7, 6], 0.45),
            ([3, 0, 4, 7], 0.35),
        ];
        let mut inks = Vec::new();
        for (face, tint) in faces {
            let at = middle(&face);
            // The solid is convex, so faces towards the eye do not hide each other. Those of a flat one are at its
            // centre.
            let facing = dot(minus(at, centre), self.stage.towards_eye(at));
            if facing > -1e-9 * self.stage.size() {
                let ring: Vec<Pixel> = face.map(|i| self.stage.pixel(corners[i])).to_vec();
                let mut outline = ring.clone();
                outline.push(ring[0]);
                inks.push(face_of(ring, colour.tint(tint)));
                inks.push(Ink::Line(outline, Pen::new(INK, 0.9)));
            }
        }
        self.add(centre, inks);
    }

    /// Adds a word beside the point of an arrow.
    pub(crate) fn word(&mut self, at: Point, word: &'static str, colour: Colour) {
        let at = self.stage.pixel(at);
        if finite(&at) {
            self.words.push((at, word, colour));
        }
    }

    /// Adds an arrow with a number of heads, in pieces for the order of painting.
    pub(crate) fn arrow(&mut self, from: Point, to: Point, pen: Pen, heads: usize) {
        let (a, b) = (self.stage.pixel(from), self.stage.pixel(to));
        let length = apart(a, b);
        let way = heading(a, b).unwrap_or_default();
        // An arrow seen along itself is all head.
        let head = (3.4 + 2.6 * pen.width).min(0.45 * length);
        let neck = (heads as f64 * 0.8 * head).min(0.95 * length);
        let stop = if length > 0.0 {
            1.0 - neck / length
        } else {
            0.0
        };
        let n = (length / 8.0).ceil().clamp(1.0, 100.0) as usize;
        for k in 0..n {
            let part = |k: usize| between(from, to, stop * k as f64 / n as f64);
            let (p, q) = (part(k), part(k + 1));
            let line = vec![self.stage.pixel(p), self.stage.pixel(q)];
            let middle = between(p, q, 0.5);
            self.rim(middle, &line, 0.5 * pen.width + 1.2, 0.0);
            self.add(middle, vec![Ink::Line(line, pen)]);
        }
        let mut inks = Vec::new();
        for i in (0..heads).rev() {
            let by = |d: f64, w: f64| (b.0 - d * way.0 - w * way.1, b.1 - d * way.1 + w * way.0);
            let tip = 0.8 * head * i as f64;
            let (base, half) = (tip + head, 0.4 * head);
            let corners = vec![by(tip, 0.0), by(base, half), by(base, -half)];
            inks.push(Ink::Area(corners, pen.colour));
        }
        self.add(to, inks);
    }
}

/// A band about a line, cut off square at its ends: a round end would bite into the next piece.
fn strip(line: &[Pixel], half: f64) -> Vec<Pixel> {
    let n = line.len();
    let side = |by: f64| {
        (0..n).map(move |i| {
            let way = tangent(line, i).unwrap_or_default();
            (line[i].0 - by * way.1, line[i].1 + by * way.0)
        })
    };
    side(half).chain(side(-half).rev()).collect()
}
