//! Camera: the projection of points of space to the page.

use super::data::View;
use super::geometry::{Pixel, Point, dot, hull};

/// A camera that looks at the origin of a box of size about 1.
#[derive(Debug, Clone)]
pub(crate) struct Camera {
    /// Directions of the page, and towards the eye.
    pub right: Point,
    pub up: Point,
    pub back: Point,
    /// Distance from the origin to the eye; infinite for parallel projection.
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

    pub(crate) fn is_parallel(&self) -> bool {
        self.distance.is_infinite()
    }

    /// Magnification at the point `q`, relative to the origin.
    pub(crate) fn nearness(&self, q: Point) -> f64 {
        1.0 / (1.0 - dot(q, self.back) / self.distance).max(0.03)
    }

    /// The pixel of a point; not finite if the point is not.
    pub(crate) fn pixel(&self, q: Point) -> Pixel {
        let f = self.scale * self.nearness(q);
        (
            self.centre.0 + f * dot(q, self.right),
            self.centre.1 - f * dot(q, self.up),
        )
    }

    /// Scales and shifts the view so that the points fill the rectangle [left, top, width, height] of pixels,
    /// less a margin at the left, above, at the right and below.
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
