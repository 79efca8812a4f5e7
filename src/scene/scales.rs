//! Conversion between the user's units and the library's.

use super::acting::in_units;
use super::registry::{Loaded, Number, Registry};
use super::{AssemblyBody, Body, Clamp, ClampMotion, Loads, Scene, Start, Units};
use crate::error::{Error, Quantity, Result};
use crate::section::Measures;
use std::ops::{Div, Mul};

/// The library's unit of each quantity, measured in the user's: a value in the scene is the library's number times the
/// scale.
///
/// In the library's units the rod's length L, its bending stiffness EI (in space its reference stiffness,
/// [`Rod::reference_stiffness`](crate::rod::Rod::reference_stiffness)) and the body's mass m are 1. All other units
/// follow: force EI/L^2, energy EI/L, and, from mass * length / time^2 = force, time sqrt(m L^3/EI).
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Scales {
    /// L.
    pub length: f64,
    /// EI / L^2.
    pub force: f64,
    /// EI / L.
    pub energy: f64,
    /// m.
    pub mass: f64,
    /// sqrt(m L^3 / EI).
    pub time: f64,
    /// length / time = sqrt(EI / (m L)).
    pub velocity: f64,
    /// force / mass = EI / (m L^2).
    pub acceleration: f64,
    /// force / velocity = sqrt(m EI / L^3).
    pub drag: f64,
}

impl Scales {
    /// The scales of a length, a bending stiffness and a mass.
    pub fn new(length: f64, stiffness: f64, mass: f64) -> Self {
        let energy = stiffness / length;
        let force = energy / length;
        let velocity = (energy / mass).sqrt();
        Self {
            length,
            force,
            energy,
            mass,
            time: length / velocity,
            velocity,
            acceleration: force / mass,
            drag: force / velocity,
        }
    }

    /// True if length, bending stiffness and mass are 1 in the scene's units, which then equal the library's.
    pub fn are_one(&self) -> bool {
        self.length == 1.0 && self.stiffness() == 1.0 && self.mass == 1.0
    }

    /// Scale of bending stiffness, EI = energy * length.
    pub fn stiffness(&self) -> f64 {
        self.energy * self.length
    }

    /// Units for sections, see [`Viscoelastic::law_in_units`](crate::section::rate::Viscoelastic::law_in_units).
    pub fn measures(&self) -> Measures {
        Measures {
            length: self.length,
            stiffness: self.stiffness(),
            time: self.time,
        }
    }

    /// Scale of the viscosity eta of m = eta theta'_t: EI * time.
    pub fn viscosity(&self) -> f64 {
        self.stiffness() * self.time
    }

    /// Conversion of messages from the rod's units to the scene's, for [`Error::in_units`].
    pub fn of_messages(&self, units: Units) -> impl Fn(Quantity) -> (f64, &'static str) {
        let scales = *self;
        move |of| (scales.unit(of), units.symbol(of))
    }

    /// The library's unit of a quantity, in the user's units.
    pub fn unit(&self, of: Quantity) -> f64 {
        match of {
            Quantity::Ratio => 1.0,
            Quantity::Length => self.length,
            Quantity::Time => self.time,
            Quantity::Rate | Quantity::AngularVelocity => 1.0 / self.time,
            Quantity::Mass => self.mass,
            Quantity::Velocity => self.velocity,
            Quantity::Acceleration => self.acceleration,
            Quantity::Inertia => self.mass * self.length * self.length,
            Quantity::Force => self.force,
            Quantity::Distributed => self.force / self.length,
            Quantity::ForceRate => self.force / self.time,
            Quantity::CoupleRate => self.energy / self.time,
            Quantity::Couple => self.energy,
            Quantity::Drag => self.drag,
            Quantity::RotationalDrag => self.energy * self.time,
            Quantity::Curvature => 1.0 / self.length,
            Quantity::CurvatureRate => 1.0 / (self.length * self.time),
            Quantity::Stiffness(i, j) => 1.0 / self.compliance(i, j),
            Quantity::Viscosity(i, j) => self.time / self.compliance(i, j),
        }
    }

    /// Converts a number of the scene to the library's units. Every conversion goes through this function.
    pub fn inward(&self, of: Quantity, x: f64) -> f64 {
        // Multiplication by a known inverse avoids a second rounding.
        match of {
            Quantity::Rate | Quantity::AngularVelocity => x * self.time,
            Quantity::Curvature => x * self.length,
            Quantity::CurvatureRate => x * self.length * self.time,
            Quantity::Stiffness(i, j) => x * self.compliance(i, j),
            Quantity::Viscosity(i, j) => x * (self.compliance(i, j) / self.time),
            _ => x / self.unit(of),
        }
    }

    /// Converts a number or a vector in the library's units to the scene's. Energies are couples, powers per length are
    /// force rates.
    pub fn outward<T>(&self, of: Quantity, x: T) -> T
    where
        T: Mul<f64, Output = T> + Div<f64, Output = T>,
    {
        // Division by a known unit avoids a second rounding.
        match of {
            Quantity::Rate | Quantity::AngularVelocity => x / self.time,
            Quantity::Curvature => x / self.length,
            _ => x * self.unit(of),
        }
    }

    /// Inverse of the unit of a stiffness: couples are scaled by B/L, forces by B/L^2, flexures and twist by 1/L.
    fn compliance(&self, i: usize, j: usize) -> f64 {
        let size = |i: usize| if i < 3 { 1.0 } else { self.length };
        size(i) * size(j) / self.stiffness()
    }

    /// Converts the numbers of a part of a scene to the library's units.
    fn convert<T>(
        &self,
        mut part: T,
        walk: impl for<'a> FnOnce(&mut Registry<'a>, &'a mut T),
    ) -> T {
        let mut numbers = Registry::default();
        walk(&mut numbers, &mut part);
        for number in numbers.numbers {
            *number.slot = self.inward(number.of, *number.slot);
        }
        part
    }

    /// A body of an assembly in the library's units.
    pub(super) fn body(&self, body: &AssemblyBody) -> AssemblyBody {
        AssemblyBody {
            functions: in_units(&body.functions, self),
            ..self.convert(body.clone(), |all, body| all.assembly_body(0, body))
        }
    }

    /// The motion of a support in the library's units.
    pub fn motion(&self, motion: ClampMotion) -> ClampMotion {
        self.convert(motion, |all, motion| all.motion(motion))
    }

    /// True if no scale over- or underflows.
    pub(super) fn are_normal(&self) -> bool {
        let all = [self.length, self.force, self.energy, self.mass];
        let more = [self.time, self.velocity, self.acceleration, self.drag];
        all.iter().chain(&more).all(|scale| scale.is_normal())
    }
}

/// Support, body, start and loads of one rod in the library's units: length, bending stiffness and mass are 1. The law
/// of the section is converted by
/// [`Viscoelastic::law_in_units`](crate::section::rate::Viscoelastic::law_in_units), the duration of the run by
/// [`Scales::inward`].
#[derive(Debug, Clone, PartialEq)]
pub struct Dimensionless {
    /// The pose of the base.
    pub clamp: Clamp,
    /// The body, of mass 1. `None`: the end of the rod is free, and the rod has mass 1.
    pub body: Option<Body>,
    /// The start.
    pub start: Start,
    /// The loads. As the mass is 1, gravity equals the weight.
    pub loads: Loads,
}

impl Scene {
    /// Scales from length L, bending stiffness EI (in space the reference stiffness B of the rod) and mass, that of the
    /// rod if there is no body; for an assembly from its first rod and its first body.
    ///
    /// # Errors
    /// As [`Scene::body`] and, in space, [`Scene::cosserat_rod`].
    pub fn scales(&self) -> Result<Scales> {
        let stiffness = if self.is_planar() {
            self.rod.bending_stiffness()?
        } else {
            self.cosserat_rod()?.reference_stiffness()
        };
        let mass = match self.assembly() {
            Some(assembly) => assembly.mass(),
            None => self.carried_mass()?,
        };
        Ok(Scales::new(self.rod.length, stiffness, mass))
    }

    /// Converts an error from the rod's units to the scene's.
    pub fn in_own_units(&self, error: Error) -> Error {
        match self.scales() {
            Ok(scales) => error.in_units(&scales.of_messages(self.units)),
            Err(_) => error,
        }
    }

    /// Support, body, start and loads in the library's units; [`Scene::scales`] converts back.
    ///
    /// # Errors
    /// As [`Scene::scales`].
    pub fn dimensionless(&self) -> Result<Dimensionless> {
        let scales = self.scales()?;
        Ok(Dimensionless {
            clamp: scales.convert(self.clamp.clone(), |all, clamp| all.clamp(clamp)),
            body: (self.body.clone()).map(|body| scales.convert(body, |all, body| all.body(body))),
            start: scales.convert(self.start.clone(), |all, start| all.start(start)),
            loads: Loads {
                functions: in_units(&self.loads.functions, &scales),
                ..scales.convert(self.loads.clone(), |all, loads| {
                    all.loads(loads, Loaded::Body)
                })
            },
        })
    }

    /// Message about the first number that over- or underflows in the library's units; `None` if all are in range.
    pub(super) fn overflow(&self) -> Option<String> {
        let what = match self.scales() {
            Ok(scales) if scales.are_normal() => {
                let mut scene = self.clone();
                let fails = |number: &Number| {
                    let x = scales.inward(number.of, *number.slot);
                    !number.range.holds(x)
                };
                let number = scene.numbers().into_iter().find(fails)?;
                format!("{} over- or underflows", self.name_of(&number.path))
            }
            _ => "they over- or underflow".to_owned(),
        };
        Some(format!("{what}: choose units nearer to the rod's size"))
    }
}
