//! Grooves of a scene: curves in which a body slides.

use crate::Result;
use crate::body;
use nalgebra::Vector3;
use serde::Serialize;

/// A curve, fixed in the world, in which the origin of a body's frame slides without friction.
#[derive(Debug, Clone, PartialEq, Serialize)]
#[serde(untagged)]
pub enum Groove {
    /// A straight line without ends.
    Line {
        /// The line.
        line: GrooveLine,
    },
    /// A circle.
    Circle {
        /// The circle.
        circle: GrooveCircle,
    },
    /// A smooth curve through 3 to 200 points; neighbours are distinct.
    Spline {
        /// The points.
        spline: Vec<[f64; 3]>,
        /// True if the last point is joined to the first; default false.
        closed: bool,
    },
}

/// A straight groove.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct GrooveLine {
    /// A point of the line.
    pub point: [f64; 3],
    /// Direction of the line, not 0, of any length.
    pub direction: [f64; 3],
}

/// A circular groove.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct GrooveCircle {
    /// Centre of the circle.
    pub centre: [f64; 3],
    /// Normal of the circle's plane, not 0, of any length.
    pub axis: [f64; 3],
    /// Radius > 0.
    pub radius: f64,
}

impl Groove {
    /// The curve.
    ///
    /// # Errors
    /// As [`body::Groove`].
    pub fn curve(&self) -> Result<body::Groove> {
        let place = |x: &[f64; 3]| Vector3::from(*x);
        match self {
            Self::Line { line } => body::Groove::line(place(&line.point), line.direction.into()),
            Self::Circle { circle } => {
                let axis = circle.axis.into();
                body::Groove::circle(place(&circle.centre), axis, circle.radius, None)
            }
            Self::Spline { spline, closed } => {
                let points: Vec<Vector3<f64>> = spline.iter().map(place).collect();
                body::Groove::spline(&points, *closed)
            }
        }
    }
}
