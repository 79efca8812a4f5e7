//! Rods in space with their accessories: supports, bodies, ribbons, and the box that holds them.

use super::canvas::Pen;
use super::data::{AxisUnits, Bounds, View};
use super::geometry::{Point, along, box_of, cross, drawable, minus, norm, unit};
use super::palette::Colour;
use super::spread::Spread;
use super::stage::{Stage, size_of};
use snaprod_core::error::{Error, Result};

/// One rod in space.
#[derive(Debug, Clone, Default, PartialEq)]
pub struct SpaceRod {
    /// Name in the legend; empty for none.
    pub name: String,
    /// Centreline from the clamp on; 100 to 200 points are smooth. A point that is not finite breaks it.
    pub points: Vec<[f64; 3]>,
    /// Directors [d1, d2, d3] at each point; empty if none are drawn.
    pub directors: Vec<[[f64; 3]; 3]>,
    /// Number shown by the colour, as the parameter of a branch. None, or not finite: a colour of the palette.
    pub value: Option<f64>,
    /// True for unstable rods, drawn thin and dashed.
    pub unstable: bool,
    /// Index of the palette's colour; by default the index in the list.
    pub colour: Option<usize>,
    /// Supports of the base and of the end on the ground.
    pub ground: [Option<Ground>; 2],
}

/// Support of the end of a rod on the ground.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Ground {
    /// A clamp, drawn as a plate.
    Clamp,
    /// A ball joint, drawn as a ring.
    Ball,
}

impl SpaceRod {
    /// Indices of the first and the last point that can be drawn.
    pub(crate) fn ends(&self) -> Option<(usize, usize)> {
        let first = self.points.iter().position(drawable)?;
        Some((first, self.points.iter().rposition(drawable)?))
    }

    /// Unit directors at a point; None if missing or not finite.
    pub(crate) fn triad(&self, i: usize) -> Option<[Point; 3]> {
        let [a, b, c] = *self.directors.get(i)?;
        Some([unit(a)?, unit(b)?, unit(c)?])
    }

    /// Direction of the rod at the i-th point: by the director d3, or else by the neighbours.
    pub(crate) fn heading(&self, i: usize) -> Option<Point> {
        if let Some([_, _, d3]) = self.triad(i) {
            return Some(d3);
        }
        let ahead = self.points.get(i + 1).filter(|p| drawable(p));
        let behind = i.checked_sub(1).and_then(|j| self.points.get(j));
        match (ahead, behind.filter(|p| drawable(p))) {
            (Some(&ahead), _) => unit(minus(ahead, self.points[i])),
            (None, Some(&behind)) => unit(minus(self.points[i], behind)),
            _ => None,
        }
    }
}

/// A body in space, drawn as a box.
#[derive(Debug, Clone, Default, PartialEq)]
pub struct SpaceBody {
    /// Centre of mass.
    pub centre: [f64; 3],
    /// Vectors from the centre to the middles of three faces, at right angles; all zero for a point mass,
    /// drawn as a ball.
    pub half_edges: [[f64; 3]; 3],
    /// Number shown by the colour, as [`SpaceRod::value`].
    pub value: Option<f64>,
    /// Index of the palette's colour; by default the index in the list.
    pub colour: Option<usize>,
}

impl SpaceBody {
    /// Corners of the box: four below, the same four above; None for a point mass, or if not finite.
    pub(crate) fn corners(&self) -> Option<[Point; 8]> {
        let [a, b, c] = self.half_edges;
        let corner = |i: usize| {
            let (s, t) = [(-1.0, -1.0), (1.0, -1.0), (1.0, 1.0), (-1.0, 1.0)][i % 4];
            let up = if i < 4 { -1.0 } else { 1.0 };
            along(along(along(self.centre, s, a), t, b), up, c)
        };
        let corners: [Point; 8] = std::array::from_fn(corner);
        let solid = [a, b, c].iter().any(|edge| norm(*edge) > 0.0);
        (solid && corners.iter().all(drawable)).then_some(corners)
    }
}

/// Pen of a groove, broad and pale, so that the path of a body in the groove is visible.
pub(crate) const GROOVE: Pen = Pen::new(Colour(190, 190, 190), 3.6);
pub(crate) const GROOVE_NAME: &str = "groove";

/// Pen of lines on obstacles.
pub(crate) const OBSTACLE: Pen = Pen::new(Colour(165, 165, 165), 0.9);
pub(crate) const OBSTACLE_NAME: &str = "obstacle";

/// Pen of a rod at the middle of the box.
pub(crate) fn pen(rod: &SpaceRod, colour: Colour) -> Pen {
    if rod.unstable {
        Pen::new(colour, 1.3).dashed(6.0, 3.6)
    } else {
        Pen::new(colour, 2.5)
    }
}

/// Accessories of the rods.
pub(crate) struct Scenery {
    /// Width of ribbons.
    pub ribbon: f64,
    pub clamp: bool,
    pub triads: bool,
    /// True to leave out the names of the directors of dashed rods, which would cover the others.
    pub dashed_unnamed: bool,
    /// True if all rods lie in one plane: crossing rods do not pass behind each other.
    pub plane: bool,
    /// Length of directors.
    pub arm: f64,
    pub shadow: bool,
    pub view: Option<View>,
    best: View,
    content: Bounds,
}

impl Scenery {
    pub(crate) fn new(rods: &[SpaceRod], ribbon: f64, clamp: bool, triads: bool) -> Result<Self> {
        let points = || rods.iter().flat_map(|rod| &rod.points);
        let none = || Error::domain("figure of rods: no rod with a finite point to show");
        let bounds = box_of(points()).ok_or_else(none)?;
        let spread = Spread::new(points()).ok_or_else(none)?;
        let size = size_of(&bounds);
        let ribbon = if ribbon > 0.0 {
            ribbon.min(0.5 * size)
        } else {
            0.0
        };
        let mut scenery = Self {
            ribbon,
            clamp,
            triads,
            dashed_unnamed: false,
            plane: spread.is_plane(),
            arm: 0.13 * size,
            shadow: !spread.is_plane() && rods.len() == 1,
            view: None,
            best: spread.view(),
            content: bounds,
        };
        let mut all: Vec<Point> = Vec::new();
        for rod in rods {
            let Some((_, last)) = rod.ends() else {
                continue;
            };
            let plates = [0, 1].into_iter().filter_map(|end| scenery.plate(rod, end));
            all.extend(plates.flatten());
            if let Some(triad) = rod.triad(last).filter(|_| triads) {
                all.extend(triad.map(|d| along(rod.points[last], 1.15 * scenery.arm, d)));
            }
            if ribbon > 0.0 {
                for (i, p) in rod.points.iter().enumerate() {
                    if let Some([d1, ..]) = rod.triad(i).filter(|_| drawable(p)) {
                        all.extend([0.5, -0.5].map(|t| along(*p, t * ribbon, d1)));
                    }
                }
            }
        }
        scenery.hold(&all);
        Ok(scenery)
    }

    /// Extends the content by more points.
    pub(crate) fn hold(&mut self, points: &[Point]) {
        let corners: [Point; 2] = [0, 1].map(|k| self.content.map(|b| b[k]));
        if let Some(bounds) = box_of(corners.iter().chain(points)) {
            self.content = bounds;
        }
    }

    /// Gives panels beside each other one box and so one scale.
    pub(crate) fn share(all: &mut [Self]) {
        let corners = all
            .iter()
            .flat_map(|one| [0, 1].map(|k| one.content.map(|b| b[k])));
        let corners: Vec<Point> = corners.collect();
        all.iter_mut().for_each(|one| one.hold(&corners));
    }

    /// The box round everything, in the pixels [left, top, width, height].
    pub(crate) fn stage(&self, units: &AxisUnits, place: [f64; 4]) -> Stage {
        let labels = ["x", "y", "z"].map(|name| units.length_of(name));
        Stage::new(self.content, &labels, self.view.unwrap_or(self.best), place)
    }

    /// Support of the base (0) or the end (1) of a rod on the ground.
    pub(crate) fn ground(&self, rod: &SpaceRod, end: usize) -> Option<Ground> {
        rod.ground[end].or((self.clamp && end == 0).then_some(Ground::Clamp))
    }

    /// Corners of the plate that clamps the base (0) or the end (1) of a rod: four in front, four behind.
    pub(crate) fn plate(&self, rod: &SpaceRod, end: usize) -> Option<[Point; 8]> {
        self.ground(rod, end).filter(|on| *on == Ground::Clamp)?;
        let (first, last) = rod.ends()?;
        let (held, behind) = [(first, -1.0), (last, 1.0)][end];
        let axis = rod.heading(held)?;
        let [a, b] = match rod.triad(held) {
            Some([d1, d2, _]) => [d1, d2],
            None => {
                let other = if axis[2].abs() < 0.9 {
                    [0.0, 0.0, 1.0]
                } else {
                    [1.0, 0.0, 0.0]
                };
                let a = unit(cross(other, axis))?;
                [a, cross(axis, a)]
            }
        };
        let half = (0.5 * self.arm).max(0.8 * self.ribbon);
        let at = |i: usize| {
            let (s, t) = [(-1.0, -1.0), (1.0, -1.0), (1.0, 1.0), (-1.0, 1.0)][i % 4];
            let p = along(along(rod.points[held], s * half, a), t * half, b);
            if i < 4 {
                p
            } else {
                along(p, 0.3 * behind * half, axis)
            }
        };
        Some(std::array::from_fn(at))
    }
}
