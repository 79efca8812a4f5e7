//! Vectors of space and the camera: where a point is seen.

use super::data::{Bounds, View};

pub(crate) type Point = [f64; 3];
pub(crate) type Pixel = (f64, f64);

/// Coordinates beyond this count as not finite: their squares would not be.
const FAR: f64 = 1e100;

/// True if the point can be drawn.
pub(crate) fn drawable(p: &Point) -> bool {
    p.iter().all(|c| c.abs() < FAR)
}

pub(crate) fn dot(a: Point, b: Point) -> f64 {
    a[0] * b[0] + a[1] * b[1] + a[2] * b[2]
}

pub(crate) fn minus(a: Point, b: Point) -> Point {
    [a[0] - b[0], a[1] - b[1], a[2] - b[2]]
}

pub(crate) fn along(p: Point, t: f64, d: Point) -> Point {
    std::array::from_fn(|i| p[i] + t * d[i])
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

/// left, top, right, bottom of some pixels.
pub(crate) fn hull(pixels: impl Iterator<Item = Pixel>) -> [f64; 4] {
    let start = [f64::MAX, f64::MAX, f64::MIN, f64::MIN];
    pixels.fold(start, |b, p| {
        [b[0].min(p.0), b[1].min(p.1), b[2].max(p.0), b[3].max(p.1)]
    })
}

/// Looks at the origin of a box about 1 in size.
#[derive(Debug, Clone)]
pub(crate) struct Camera {
    /// Directions of the page, and towards the eye.
    pub right: Point,
    pub up: Point,
    pub back: Point,
    /// From the origin to the eye; infinite for parallel projection.
    pub distance: f64,
    /// Pixels of a unit length at the origin.
    pub scale: f64,
    /// The pixel of the origin.
    pub centre: Pixel,
}

impl Camera {
    pub(crate) fn new(view: View, distance: f64) -> Self {
        let degrees = |angle: f64, or: f64| if angle.is_finite() { angle } else { or };
        let (sa, ca) = degrees(view.azimuth, -60.0).to_radians().sin_cos();
        let elevation = degrees(view.elevation, 20.0).clamp(-90.0, 90.0);
        let (se, ce) = elevation.to_radians().sin_cos();
        Self {
            right: [-sa, ca, 0.0],
            up: [-se * ca, -se * sa, ce],
            back: [ce * ca, ce * sa, se],
            distance,
            scale: 1.0,
            centre: (0.0, 0.0),
        }
    }

    /// How much larger than at the origin things look there.
    pub(crate) fn nearness(&self, q: Point) -> f64 {
        1.0 / (1.0 - dot(q, self.back) / self.distance).max(0.03)
    }

    /// Where a point is seen; not finite if the point is not.
    pub(crate) fn pixel(&self, q: Point) -> Pixel {
        let f = self.scale * self.nearness(q);
        (
            self.centre.0 + f * dot(q, self.right),
            self.centre.1 - f * dot(q, self.up),
        )
    }

    /// Shows the points as large as they fit into the pixels [left, top, width, height] less the room at the left, above, at the
    /// right and below.
    pub(crate) fn fit(
        &mut self,
        points: impl Iterator<Item = Point>,
        [left, top, width, height]: [f64; 4],
        room: [f64; 4],
    ) {
        (self.scale, self.centre) = (1.0, (0.0, 0.0));
        let drawn = hull(points.map(|q| self.pixel(q)));
        let inner = (
            (width - room[0] - room[2]).max(0.2 * width),
            (height - room[1] - room[3]).max(0.2 * height),
        );
        self.scale = (inner.0 / (drawn[2] - drawn[0])).min(inner.1 / (drawn[3] - drawn[1]));
        self.centre = (
            left + room[0] + 0.5 * inner.0 - 0.5 * self.scale * (drawn[0] + drawn[2]),
            top + room[1] + 0.5 * inner.1 - 0.5 * self.scale * (drawn[1] + drawn[3]),
        );
    }
}
