//! Obstacles: bodies that rods and other bodies touch and do not enter.

use super::ends::{ClampMotion, Rotation};
use crate::{Result, obstacle};
use nalgebra::{Rotation3, Vector2, Vector3};
use serde::Serialize;

/// A body that stands or moves in a given way, and that the scene's rods and bodies do not enter.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct Obstacle {
    /// Name in events and tables; `obstacle1`, `obstacle2`, ... in the order of the list unless given.
    pub name: String,
    /// Shape and place.
    #[serde(flatten)]
    pub shape: ObstacleShape,
    /// Coefficient of friction; `None`: that of [`ContactRules`](super::ContactRules).
    #[serde(skip_serializing_if = "Option::is_none")]
    pub friction: Option<f64>,
    /// Restitution of impacts, in [0, 1]; `None`: that of [`ContactRules`](super::ContactRules).
    #[serde(skip_serializing_if = "Option::is_none")]
    pub restitution: Option<f64>,
    /// Displacement, and rotation about [`ObstacleShape::middle`], in time; `None`: the obstacle stands.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub motion: Option<ClampMotion>,
    /// Names of the rods and bodies that touch the obstacle; `None`: all.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub touches: Option<Vec<String>>,
}

/// Shape and place of an obstacle.
#[derive(Debug, Clone, PartialEq, Serialize)]
#[serde(rename_all = "lowercase")]
pub enum ObstacleShape {
    /// The half-space behind a plane.
    Plane {
        /// A point of the plane.
        point: [f64; 3],
        /// Normal, from the obstacle outwards, not 0, of any length.
        normal: [f64; 3],
    },
    /// A cylinder without ends.
    Cylinder {
        /// A point of the axis.
        point: [f64; 3],
        /// Direction of the axis, not 0, of any length.
        axis: [f64; 3],
        /// Radius > 0.
        radius: f64,
        /// True for a tube, which rods touch from inside.
        inside: bool,
    },
    /// A sphere.
    Sphere {
        /// Centre.
        centre: [f64; 3],
        /// Radius > 0.
        radius: f64,
        /// True for a shell, which rods touch from inside.
        inside: bool,
    },
    /// All points within a distance from a segment.
    Capsule {
        /// One end of the segment.
        from: [f64; 3],
        /// Second end.
        to: [f64; 3],
        /// Radius >= 0.
        radius: f64,
    },
    /// A disc of the plane.
    Disc {
        /// Centre; the third component is 0.
        centre: [f64; 3],
        /// Radius > 0.
        radius: f64,
        /// True for a hole, touched from inside.
        inside: bool,
    },
    /// All points of the plane within a distance from a segment.
    Segment {
        /// One end of the segment; the third component is 0.
        from: [f64; 3],
        /// Second end.
        to: [f64; 3],
        /// Radius >= 0.
        radius: f64,
    },
    /// A convex polygon of the plane.
    Polygon(
        /// Corners, either way round.
        Vec<[f64; 2]>,
    ),
    /// A box.
    Box {
        /// Centre.
        centre: [f64; 3],
        /// Lengths of the sides, > 0.
        sides: [f64; 3],
        /// Rotation from the world's axes to those of the box.
        #[serde(skip_serializing_if = "Option::is_none")]
        rotation: Option<Rotation>,
    },
}

impl Obstacle {
    /// The obstacle as a signed distance in units of `length`.
    ///
    /// # Errors
    /// As the constructors of [`obstacle::Obstacle`].
    pub(crate) fn in_units(&self, length: f64) -> Result<obstacle::Obstacle> {
        self.seen_from([0.0; 3], length)
    }

    /// [`Obstacle::in_units`] in a frame with this origin.
    ///
    /// # Errors
    /// As [`Obstacle::in_units`].
    pub(crate) fn seen_from(&self, origin: [f64; 3], length: f64) -> Result<obstacle::Obstacle> {
        let origin = Vector3::from(origin);
        let place = |x: &[f64; 3]| (Vector3::from(*x) - origin) / length;
        let size = |x: &[f64; 3]| Vector3::from(*x) / length;
        match &self.shape {
            ObstacleShape::Plane { point, normal } => {
                obstacle::Obstacle::plane(place(point), (*normal).into())
            }
            ObstacleShape::Cylinder {
                point,
                axis,
                radius,
                inside,
            } => {
                let axis = (*axis).into();
                obstacle::Obstacle::cylinder(place(point), axis, radius / length, *inside)
            }
            ObstacleShape::Sphere {
                centre,
                radius,
                inside,
            } => obstacle::Obstacle::sphere(place(centre), radius / length, *inside),
            ObstacleShape::Disc {
                centre,
                radius,
                inside,
            } => obstacle::Obstacle::disc(place(centre).xy(), radius / length, *inside),
            ObstacleShape::Polygon(corners) => {
                let corners: Vec<Vector2<f64>> = (corners.iter())
                    .map(|corner| (Vector2::from(*corner) - origin.xy()) / length)
                    .collect();
                obstacle::Obstacle::polygon(&corners)
            }
            ObstacleShape::Capsule { from, to, radius }
            | ObstacleShape::Segment { from, to, radius } => {
                obstacle::Obstacle::capsule(place(from), place(to), radius / length)
            }
            ObstacleShape::Box {
                centre,
                sides,
                rotation,
            } => {
                let turn = rotation.map_or_else(Rotation3::identity, |turn| turn.matrix());
                obstacle::Obstacle::cuboid(place(centre), size(sides), turn)
            }
        }
    }
}

impl ObstacleShape {
    /// The place about which a moving obstacle turns: its point, its centre, or the middle of its ends or corners.
    pub fn middle(&self) -> [f64; 3] {
        match self {
            Self::Plane { point, .. } | Self::Cylinder { point, .. } => *point,
            Self::Sphere { centre, .. } | Self::Disc { centre, .. } | Self::Box { centre, .. } => {
                *centre
            }
            Self::Capsule { from, to, .. } | Self::Segment { from, to, .. } => {
                std::array::from_fn(|i| 0.5 * (from[i] + to[i]))
            }
            Self::Polygon(corners) => {
                let count = corners.len().max(1) as f64;
                let mean = |i: usize| corners.iter().map(|corner| corner[i]).sum::<f64>() / count;
                [mean(0), mean(1), 0.0]
            }
        }
    }

    /// Every length of the obstacle by its field, with the index of the component.
    pub(super) fn lengths_mut(&mut self) -> Vec<(&'static str, usize, &mut f64)> {
        fn each<'a>(
            field: &'static str,
            place: &'a mut [f64],
        ) -> impl Iterator<Item = (&'static str, usize, &'a mut f64)> {
            place
                .iter_mut()
                .enumerate()
                .map(move |(i, x)| (field, i, x))
        }
        match self {
            ObstacleShape::Plane { point, .. } => each("plane.point.xyz", point).collect(),
            ObstacleShape::Cylinder { point, radius, .. } => each("cylinder.point.xyz", point)
                .chain([("cylinder.radius", 0, radius)])
                .collect(),
            ObstacleShape::Sphere { centre, radius, .. } => each("sphere.centre.xyz", centre)
                .chain([("sphere.radius", 0, radius)])
                .collect(),
            ObstacleShape::Capsule { from, to, radius } => each("capsule.from.xyz", from)
                .chain(each("capsule.to.xyz", to))
                .chain([("capsule.radius", 0, radius)])
                .collect(),
            ObstacleShape::Disc { centre, radius, .. } => each("disc.centre.xyz", &mut centre[..2])
                .chain([("disc.radius", 0, radius)])
                .collect(),
            ObstacleShape::Segment { from, to, radius } => each("segment.from.xyz", &mut from[..2])
                .chain(each("segment.to.xyz", &mut to[..2]))
                .chain([("segment.radius", 0, radius)])
                .collect(),
            ObstacleShape::Polygon(corners) => {
                each("polygon[]", corners.as_flattened_mut()).collect()
            }
            ObstacleShape::Box { centre, sides, .. } => each("box.centre.xyz", centre)
                .chain(each("box.sides.xyz", sides))
                .collect(),
        }
    }
}
