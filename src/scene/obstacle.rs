//! Obstacles: fixed bodies that rods touch and do not enter.

use super::ends::Rotation;
use crate::{Result, obstacle};
use nalgebra::{Rotation3, Unit, Vector3};
use serde::Serialize;

/// A fixed body that the scene's rod does not enter.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct Obstacle {
    /// Name in events and tables; `obstacle1`, `obstacle2`, ... in the order of the list unless given.
    pub name: String,
    /// Shape and place.
    #[serde(flatten)]
    pub shape: ObstacleShape,
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
        let place = |x: &[f64; 3]| Vector3::from(*x) / length;
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
            ObstacleShape::Capsule { from, to, radius } => {
                obstacle::Obstacle::capsule(place(from), place(to), radius / length)
            }
            ObstacleShape::Box {
                centre,
                sides,
                rotation,
            } => {
                let turn = rotation.as_ref().map_or_else(Rotation3::identity, |turn| {
                    let axis = Unit::new_normalize(Vector3::from(turn.axis));
                    Rotation3::from_axis_angle(&axis, turn.angle)
                });
                obstacle::Obstacle::cuboid(place(centre), place(sides), turn)
            }
        }
    }

    /// Every length of the obstacle by its field, with the index of the component.
    pub(super) fn lengths_mut(&mut self) -> Vec<(&'static str, usize, &mut f64)> {
        fn each<'a>(
            field: &'static str,
            place: &'a mut [f64; 3],
        ) -> impl Iterator<Item = (&'static str, usize, &'a mut f64)> {
            place
                .iter_mut()
                .enumerate()
                .map(move |(i, x)| (field, i, x))
        }
        match &mut self.shape {
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
            ObstacleShape::Box { centre, sides, .. } => each("box.centre.xyz", centre)
                .chain(each("box.sides.xyz", sides))
                .collect(),
        }
    }
}
