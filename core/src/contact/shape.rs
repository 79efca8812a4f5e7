//! Shapes of bodies: point, ball, capsule, cylinder, box.

use super::Obstacle;
use crate::error::{Error, Result, check_finite, check_positive};
use nalgebra::{Isometry3, Vector3};

/// The shape of a body, about its own middle. Capsules and cylinders lie along z.
///
/// All lengths are in one unit of the user's choice.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum Shape {
    /// A point.
    Point,
    /// A ball.
    Ball {
        /// The radius.
        radius: f64,
    },
    /// A cylinder between two half balls.
    Capsule {
        /// Half of the distance between the centres of the half balls.
        half_length: f64,
        /// The radius.
        radius: f64,
    },
    /// A circular cylinder with flat ends.
    Cylinder {
        /// Half of the length.
        half_length: f64,
        /// The radius.
        radius: f64,
    },
    /// A box. A side of 0 makes a plate, as in planar scenes, which lie in z = 0.
    Cuboid {
        /// Half of each side.
        half_sides: Vector3<f64>,
    },
}

impl Shape {
    /// A ball.
    ///
    /// # Errors
    /// A radius that is not finite and positive.
    pub fn ball(radius: f64) -> Result<Self> {
        check_positive("the radius of a ball", radius)?;
        Ok(Self::Ball { radius })
    }

    /// A capsule whose half balls have their centres `length` apart.
    ///
    /// # Errors
    /// A length or a radius that is not finite and positive.
    pub fn capsule(length: f64, radius: f64) -> Result<Self> {
        check_positive("the length of a capsule", length)?;
        check_positive("the radius of a capsule", radius)?;
        Ok(Self::Capsule {
            half_length: 0.5 * length,
            radius,
        })
    }

    /// A cylinder with flat ends.
    ///
    /// # Errors
    /// A length or a radius that is not finite and positive.
    pub fn cylinder(length: f64, radius: f64) -> Result<Self> {
        check_positive("the length of a cylinder", length)?;
        check_positive("the radius of a cylinder", radius)?;
        Ok(Self::Cylinder {
            half_length: 0.5 * length,
            radius,
        })
    }

    /// A box with these sides; at most one of them is 0.
    ///
    /// # Errors
    /// A side that is negative or not finite; two sides of 0.
    pub fn cuboid(sides: Vector3<f64>) -> Result<Self> {
        check_finite("the sides of a box", sides.as_slice())?;
        let flat = sides.iter().filter(|side| **side == 0.0).count();
        if sides.min() < 0.0 || flat > 1 {
            return Err(Error::domain(format!(
                "the sides of a box, {}, must be > 0, one of them may be 0",
                crate::error::named(&crate::error::AXES, sides.as_slice())
            )));
        }
        Ok(Self::Cuboid {
            half_sides: 0.5 * sides,
        })
    }

    /// The name of the shape in messages.
    pub fn name(&self) -> &'static str {
        match self {
            Self::Point => "point",
            Self::Ball { .. } => "ball",
            Self::Capsule { .. } => "capsule",
            Self::Cylinder { .. } => "cylinder",
            Self::Cuboid { .. } => "box",
        }
    }
}

/// A shape in the frame of a body. The origin is the body's reference point.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct PlacedShape {
    /// The shape.
    pub shape: Shape,
    /// The pose of the shape's own frame, as seen from the body.
    pub place: Isometry3<f64>,
}

impl From<Shape> for PlacedShape {
    fn from(shape: Shape) -> Self {
        Self {
            shape,
            place: Isometry3::identity(),
        }
    }
}

impl PlacedShape {
    /// The middle, as seen from the body.
    pub(super) fn middle(&self) -> Vector3<f64> {
        self.place.translation.vector
    }

    /// The ends of an axis of half length `half_length` along z, as seen from the body.
    pub(super) fn ends(&self, half_length: f64) -> [Vector3<f64>; 2] {
        [-half_length, half_length]
            .map(|z| self.place * nalgebra::Point3::new(0.0, 0.0, z))
            .map(|point| point.coords)
    }

    /// The corners of a box, as seen from the body: 8, of a plate 4.
    pub(super) fn corners(&self, half_sides: &Vector3<f64>) -> Vec<Vector3<f64>> {
        let mut corners: Vec<Vector3<f64>> = Vec::with_capacity(8);
        for k in 0..8 {
            let sign = |i: usize| if k >> i & 1 == 0 { -1.0 } else { 1.0 };
            let skip = (0..3).any(|i| half_sides[i] == 0.0 && sign(i) > 0.0);
            if !skip {
                let own = Vector3::from_fn(|i, _| sign(i) * half_sides[i]);
                corners.push(self.middle() + self.place.rotation * own);
            }
        }
        corners
    }

    /// The shape as an obstacle in the frame of the body; None for a point, a cylinder and a plate, which have no
    /// distance function here.
    pub(super) fn as_obstacle(&self) -> Option<Obstacle> {
        match self.shape {
            Shape::Point | Shape::Cylinder { .. } => None,
            Shape::Ball { radius } => Some(Obstacle::Sphere {
                centre: self.middle(),
                radius,
                inside: false,
            }),
            Shape::Capsule {
                half_length,
                radius,
            } => {
                let [from, to] = self.ends(half_length);
                Some(Obstacle::Capsule { from, to, radius })
            }
            Shape::Cuboid { half_sides } => (half_sides.min() > 0.0).then(|| Obstacle::Cuboid {
                centre: self.middle(),
                rotation: self.place.rotation.to_rotation_matrix(),
                half_sides,
            }),
        }
    }
}
