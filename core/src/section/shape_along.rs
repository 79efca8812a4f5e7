//! Shapes of sections that vary along a rod, and the mass per length of the rod.

use super::{Along, Profile, Shape};
use crate::error::Result;
use crate::math::piecewise::Piecewise;
use nalgebra::Vector3;
use std::f64::consts::PI;

/// Samples at which a size along the rod is looked at.
const SAMPLES: u32 = 64;

impl From<Shape> for Shape<Along> {
    fn from(shape: Shape) -> Self {
        match shape {
            Shape::Circle { radius } => Self::Circle {
                radius: radius.into(),
            },
            Shape::Rectangle { width, height } => Self::Rectangle {
                width: width.into(),
                height: height.into(),
            },
            Shape::Tube {
                outer_radius,
                thickness,
            } => Self::Tube {
                outer_radius: outer_radius.into(),
                thickness: thickness.into(),
            },
        }
    }
}

impl Shape<Along> {
    /// The sizes of the shape.
    pub fn sizes(&self) -> impl Iterator<Item = &Along> {
        let (first, second) = match self {
            Self::Circle { radius } => (radius, None),
            Self::Rectangle { width, height } => (width, Some(height)),
            Self::Tube {
                outer_radius,
                thickness,
            } => (outer_radius, Some(thickness)),
        };
        [first].into_iter().chain(second)
    }

    fn with(&self, size: impl Fn(&Along) -> Result<f64>) -> Result<Shape> {
        Ok(match self {
            Self::Circle { radius } => Shape::Circle {
                radius: size(radius)?,
            },
            Self::Rectangle { width, height } => Shape::Rectangle {
                width: size(width)?,
                height: size(height)?,
            },
            Self::Tube {
                outer_radius,
                thickness,
            } => Shape::Tube {
                outer_radius: size(outer_radius)?,
                thickness: size(thickness)?,
            },
        })
    }

    /// The shape at s of a rod of this length.
    ///
    /// # Errors
    /// As [`Along::at`].
    pub fn at(&self, s: f64, length: f64) -> Result<Shape> {
        self.with(|size| size.at(s, length))
    }

    /// The shape, if it is the same all along the rod.
    pub fn uniform(&self) -> Option<Shape> {
        let all = self.sizes().all(|size| size.constant().is_some());
        all.then(|| self.at(0.0, 1.0).ok()).flatten()
    }

    /// Smallest width of the section along a rod of this length, see [`Shape::thickness`].
    pub fn thickness(&self, length: f64) -> f64 {
        let even = (0..=SAMPLES).map(|i| length * f64::from(i) / f64::from(SAMPLES));
        let nodes = self.sizes().flat_map(|size| size.nodes()).copied();
        let each = even
            .chain(nodes)
            .filter_map(|s| Some(self.at(s, length).ok()?.thickness()));
        each.fold(f64::INFINITY, f64::min)
    }

    /// Area along a rod of this length, over s/length.
    pub fn area(&self, length: f64) -> Piecewise {
        let of = |size: &Along| size.pieces(length);
        match self {
            Self::Circle { radius } => of(radius).by(&of(radius)).times(PI),
            Self::Rectangle { width, height } => of(width).by(&of(height)),
            Self::Tube {
                outer_radius,
                thickness,
            } => {
                let (outer, wall) = (of(outer_radius), of(thickness));
                let both = outer.times(2.0).plus(&wall.clone().times(-1.0));
                wall.by(&both).times(PI)
            }
        }
    }

    /// Second moments of area about d1 and about d2 along a rod of this length, over s/length.
    pub fn second_moments(&self, length: f64) -> [Piecewise; 2] {
        let of = |size: &Along| size.pieces(length);
        let round = |squares: Piecewise| {
            let moment = self.area(length).by(&squares).times(0.25);
            [moment.clone(), moment]
        };
        match self {
            Self::Circle { radius } => round(of(radius).by(&of(radius))),
            Self::Tube {
                outer_radius,
                thickness,
            } => {
                let outer = of(outer_radius);
                let inner = outer.plus(&of(thickness).times(-1.0));
                round(outer.by(&outer).plus(&inner.by(&inner)))
            }
            Self::Rectangle { width, height } => [height, width].map(|size| {
                let square = of(size).by(&of(size));
                self.area(length).by(&square).times(1.0 / 12.0)
            }),
        }
    }
}

impl Profile<Along> {
    /// The section at s of a rod of this length.
    ///
    /// # Errors
    /// As [`Along::at`].
    pub fn at(&self, s: f64, length: f64) -> Result<Profile> {
        Ok(Profile {
            shape: self.shape.at(s, length)?,
            material: self.material,
            set: self.set,
        })
    }
}

/// Mass and rotary inertia per length of a rod whose shape varies, over their means along the rod.
#[derive(Debug, Clone, PartialEq)]
pub struct MassAlong {
    density: Piecewise,
    rotary: [Piecewise; 3],
}

impl MassAlong {
    /// Of a homogeneous rod of this shape.
    pub fn new(shape: &Shape<Along>, length: f64) -> Self {
        let over_mean = |f: Piecewise| {
            let mean = f.integral();
            f.times(1.0 / mean)
        };
        let [first, second] = shape.second_moments(length);
        let polar = first.plus(&second);
        Self {
            density: over_mean(shape.area(length)),
            rotary: [first, second, polar].map(over_mean),
        }
    }

    /// The variation along the rod begun at its other end.
    #[must_use]
    pub fn reversed(&self) -> Self {
        Self {
            density: self.density.reversed(),
            rotary: self.rotary.each_ref().map(Piecewise::reversed),
        }
    }

    /// Mass per length over its mean, over s/length.
    pub fn density(&self) -> &Piecewise {
        &self.density
    }

    /// Rotary inertia per length about d1, d2, d3 over its means, at x = s/length.
    pub fn rotary(&self, x: f64) -> Vector3<f64> {
        Vector3::from_fn(|k, _| self.rotary[k].at(x))
    }
}
