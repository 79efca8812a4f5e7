//! Membranes inflated by pressure: spheres and flat discs, their p-V curves and limit points.
//!
//! A membrane of incompressible material has the energy W(l1, l2) per unloaded volume and the thickness d. Chart is a
//! stretch, pose the volume V, wrench the pressure, dU = p dV (docs/tubes.md 4). The volume grows with the chart: folds
//! are in the load, not in the pose. A reservoir of gas turns some of them into folds of the pose ([`gas`]).
//!
//! ```
//! # use snaprod_walls as snaprod;
//! use snaprod::membrane::{Rubber, Shape, Inflated};
//! let sphere = Inflated::new(Shape::Sphere, Rubber::neo_hookean(1.0)?, 1.0, 1.0)?;
//! let fold = &sphere.limit_points()?[0];
//! assert!((fold.stretch - 7f64.powf(1.0 / 6.0)).abs() < 1e-12);
//! # Ok::<(), snaprod_core::Error>(())
//! ```

pub mod breathing;
mod disc;
mod filling;
pub mod gas;
pub mod pair;
pub mod piston;
pub mod rings;
mod rubber;
pub mod sphere;

pub use filling::Filling;
pub use rubber::{Biaxial, Rubber};

use snaprod_core::solve::roots::chandrupatla;
use snaprod_core::{Error, Result};
use std::f64::consts::PI;

/// Shape of an unloaded membrane.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Shape {
    /// A closed sphere.
    Sphere,
    /// A flat disc whose edge is held.
    Disc,
}

impl Shape {
    /// The word for the shape in scenes.
    pub fn name(self) -> &'static str {
        match self {
            Self::Sphere => "sphere",
            Self::Disc => "disc",
        }
    }
}

/// A membrane that pressure inflates.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Inflated {
    /// Shape without load.
    pub shape: Shape,
    /// Energy of the material.
    pub rubber: Rubber,
    /// Radius R0 of the unloaded membrane.
    pub radius: f64,
    /// Thickness d of the unloaded membrane.
    pub thickness: f64,
}

/// An inflated membrane in equilibrium, in the units of the membrane.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct InflatedState {
    /// Stretch at the pole, the chart.
    pub stretch: f64,
    /// Pressure inside less outside.
    pub pressure: f64,
    /// Height of the pole above the edge of a disc; radius of a sphere.
    pub height: f64,
    /// Volume inside; of a disc above the plane of its edge.
    pub volume: f64,
    /// Meridional stretch at the edge.
    pub edge_stretch: f64,
    /// Angle of the wall below the plane of the edge, at the edge; 0 for a sphere.
    pub edge_angle: f64,
    /// Stored energy.
    pub energy: f64,
}

/// A limit point: an extremum of the pressure along the chart.
pub type LimitPoint = InflatedState;

const MOST_STRETCH: f64 = Inflated::MOST_STRETCH;
/// Least stretch at which slopes are formed by differences.
const LEAST_STRETCH: f64 = 1.01;

impl Inflated {
    /// Pole stretch up to which limit points are sought: rubber tears far below.
    pub const MOST_STRETCH: f64 = 30.0;

    /// A membrane of the given `radius` and `thickness`.
    ///
    /// # Errors
    /// A radius or thickness that is not finite and positive.
    pub fn new(shape: Shape, rubber: Rubber, radius: f64, thickness: f64) -> Result<Self> {
        for (name, value) in [("radius", radius), ("thickness", thickness)] {
            if !(0.0 < value && value < f64::INFINITY) {
                return Err(Error::domain(format!(
                    "the {name} {value} of a membrane must be finite and > 0"
                )));
            }
        }
        Ok(Self {
            shape,
            rubber,
            radius,
            thickness,
        })
    }

    /// p R0/(d C1), the pressure as a pure number, for a material with C1 > 0.
    pub fn pressure_number(&self, pressure: f64) -> f64 {
        pressure * self.radius / (self.thickness * self.rubber.first())
    }

    /// The equilibrium with the stretch `stretch` at the pole.
    ///
    /// # Errors
    /// A stretch below 1, which a membrane without bending stiffness cannot have; one at which it has no equilibrium.
    pub fn at_stretch(&self, stretch: f64) -> Result<InflatedState> {
        if !(1.0..f64::INFINITY).contains(&stretch) {
            return Err(Error::domain(format!(
                "the stretch {stretch} of an inflated membrane must be finite and >= 1: a compressed membrane wrinkles"
            )));
        }
        // In units of R0 and C d, where C is the unit of the energy.
        let unit = match self.shape {
            Shape::Sphere => sphere::state(&self.rubber, stretch),
            Shape::Disc => disc::state(&self.rubber, stretch)?,
        };
        Ok(InflatedState {
            stretch,
            pressure: unit.pressure * self.thickness / self.radius,
            height: unit.height * self.radius,
            volume: unit.volume * self.radius.powi(3),
            energy: unit.energy * self.thickness * self.radius.powi(2),
            ..unit
        })
    }

    /// Places [r, z] of half a meridian at the pole stretch `stretch`, from the pole on: to the edge of a disc, where
    /// z = 0, or to the other pole of a sphere about the origin.
    ///
    /// # Errors
    /// As [`Inflated::at_stretch`].
    pub fn meridian(&self, stretch: f64) -> Result<Vec<[f64; 2]>> {
        let at = self.at_stretch(stretch)?;
        let unit = match self.shape {
            Shape::Sphere => {
                let angle = |k: u32| PI * f64::from(k) / 60.0;
                let place = |k: u32| [stretch * angle(k).sin(), stretch * angle(k).cos()];
                (0..=60).map(place).collect()
            }
            Shape::Disc => disc::meridian_places(&self.rubber, at.stretch)?,
        };
        Ok(unit
            .into_iter()
            .map(|place| place.map(|x| x * self.radius))
            .collect())
    }

    /// The first equilibrium under `pressure` on the way from the flat or unloaded membrane.
    ///
    /// # Errors
    /// A pressure that no state up to the stretch 30 has, with the largest one; a pressure below 0.
    pub fn at_pressure(&self, pressure: f64) -> Result<InflatedState> {
        if !(0.0..f64::INFINITY).contains(&pressure) {
            return Err(Error::domain(format!(
                "the pressure {pressure} in a membrane must be finite and >= 0: under suction it wrinkles"
            )));
        }
        if pressure == 0.0 {
            return self.at_stretch(1.0);
        }
        let mut before = self.at_stretch(1.0)?;
        let mut greatest = before;
        for stretch in self.search_stretches() {
            let at = self.at_stretch(stretch)?;
            if at.pressure >= pressure {
                return self.between(&before, &at, pressure);
            }
            if at.pressure < before.pressure && before.pressure >= greatest.pressure {
                // A maximum lies between the neighbours of the highest state.
                let low = (before.stretch / self.search_step()).max(1.0);
                if let Some(peak) = self.extremum(low, stretch)? {
                    if peak.pressure >= pressure {
                        return self.between(&self.at_stretch(low)?, &peak, pressure);
                    }
                    greatest = peak;
                }
            } else if at.pressure > greatest.pressure {
                greatest = at;
            }
            before = at;
        }
        Err(Error::domain(format!(
            "the pressure {pressure} is above {}, the largest of this membrane up to the stretch {MOST_STRETCH}",
            greatest.pressure
        )))
    }

    /// Ratio of neighbouring stretches of a search. Points of spheres are in closed form.
    fn search_step(&self) -> f64 {
        match self.shape {
            Shape::Sphere => 1.02,
            Shape::Disc => 1.05,
        }
    }

    /// Growing stretches of a search, dense near 1.
    fn search_stretches(&self) -> impl Iterator<Item = f64> {
        let step = self.search_step();
        let next = move |stretch: &f64| Some(stretch * step.min(*stretch));
        std::iter::successors(Some(1.0 + 1e-3), next).take_while(|stretch| *stretch < MOST_STRETCH)
    }

    /// The state under `pressure` between two states.
    fn between(
        &self,
        low: &InflatedState,
        high: &InflatedState,
        pressure: f64,
    ) -> Result<InflatedState> {
        let off = |stretch: f64| {
            self.at_stretch(stretch)
                .map_or(f64::NAN, |at| at.pressure - pressure)
        };
        let from = (low.stretch, low.pressure - pressure);
        let root = chandrupatla(off, from, (high.stretch, high.pressure - pressure), 0.0);
        let none =
            || Error::no_convergence(format!("no state was found under the pressure {pressure}"));
        self.at_stretch(root.ok_or_else(none)?)
    }

    /// dpressure/dstretch: closed for a sphere, by differences of order 6 for a disc, there at
    /// 1.01 below this stretch.
    ///
    /// # Errors
    /// As [`Inflated::at_stretch`], at the stretch or near it.
    pub fn slope(&self, stretch: f64) -> Result<f64> {
        if self.shape == Shape::Sphere {
            return Ok(sphere::slope(&self.rubber, stretch) * self.thickness / self.radius);
        }
        self.difference(stretch, &|at| at.pressure)
    }

    /// The extremum of the pressure between two stretches, if there is one.
    fn extremum(&self, from: f64, to: f64) -> Result<Option<InflatedState>> {
        let ends = [from.max(LEAST_STRETCH), to.max(LEAST_STRETCH)];
        let slopes = [self.slope(ends[0])?, self.slope(ends[1])?];
        let off = |stretch: f64| self.slope(stretch).unwrap_or(f64::NAN);
        let root = chandrupatla(off, (ends[0], slopes[0]), (ends[1], slopes[1]), 0.0);
        root.map(|stretch| self.at_stretch(stretch)).transpose()
    }

    /// All extrema of the pressure up to the stretch 30, by growing stretch: maxima and minima in turn.
    ///
    /// # Errors
    /// A stretch on the way at which the membrane has no equilibrium.
    pub fn limit_points(&self) -> Result<Vec<LimitPoint>> {
        self.limit_points_between(LEAST_STRETCH, MOST_STRETCH)
    }

    /// All extrema of the pressure between two stretches, by growing stretch.
    ///
    /// # Errors
    /// As [`Inflated::limit_points`].
    pub fn limit_points_between(&self, from: f64, to: f64) -> Result<Vec<LimitPoint>> {
        let roots = self.roots(&|stretch| self.slope(stretch), from.max(LEAST_STRETCH), to)?;
        roots
            .into_iter()
            .map(|stretch| self.at_stretch(stretch))
            .collect()
    }

    /// Stretches between two bounds at which `number` changes sign, in growing order.
    fn roots(&self, number: &dyn Fn(f64) -> Result<f64>, from: f64, to: f64) -> Result<Vec<f64>> {
        let off = |stretch: f64| number(stretch).unwrap_or(f64::NAN);
        let mut found = Vec::new();
        let (mut low, mut before) = (from, number(from)?);
        while low < to {
            let high = (low * self.search_step()).min(to);
            let after = number(high)?;
            found.extend(chandrupatla(off, (low, before), (high, after), 0.0));
            (low, before) = (high, after);
        }
        Ok(found)
    }

    /// Derivative of a number of the states by the stretch, by differences of order 6; below the stretch 1.01 that at
    /// 1.01, since no state lies below 1.
    fn difference(&self, stretch: f64, number: &dyn Fn(&InflatedState) -> f64) -> Result<f64> {
        let stretch = stretch.max(LEAST_STRETCH);
        let h = 2e-3 * stretch.min(1.0 + 0.5 * (stretch - 1.0));
        let at = |k: f64| self.at_stretch(stretch + k * h).map(|at| number(&at));
        let difference = |k: f64| Ok::<f64, Error>(at(k)? - at(-k)?);
        Ok((45.0 * difference(1.0)? - 9.0 * difference(2.0)? + difference(3.0)?) / (60.0 * h))
    }
}
