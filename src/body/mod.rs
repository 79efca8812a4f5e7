//! The body at the rod's end and the loads on it: a point mass or a rigid body.

mod end_body;
mod rigid;

pub use end_body::{EndBody, EndLinear, EndMotion};
pub use rigid::RigidBody;

use crate::error::{Error, Result};
use nalgebra::SVector;
use std::fmt;
use std::sync::Arc;

/// A force on the body that depends on time alone.
#[derive(Clone)]
pub enum TimeForce<const N: usize> {
    /// amplitude sin(angular_frequency t + phase).
    Harmonic {
        /// Vector amplitude.
        amplitude: SVector<f64, N>,
        /// In radians per unit of time.
        angular_frequency: f64,
        /// In radians.
        phase: f64,
    },
    /// Any smooth function of time. The step control sees only its values: a pulse shorter than a
    /// step of the motion can be missed.
    Custom(Arc<dyn Fn(f64) -> SVector<f64, N> + Send + Sync>),
}

impl<const N: usize> TimeForce<N> {
    /// The force at time `t`.
    pub fn at(&self, t: f64) -> SVector<f64, N> {
        match self {
            Self::Harmonic {
                amplitude,
                angular_frequency,
                phase,
            } => amplitude * (angular_frequency * t + phase).sin(),
            Self::Custom(f) => f(t),
        }
    }
}

impl<const N: usize> fmt::Debug for TimeForce<N> {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::Harmonic {
                amplitude,
                angular_frequency,
                phase,
            } => f
                .debug_struct("Harmonic")
                .field("amplitude", &amplitude.as_slice())
                .field("angular_frequency", angular_frequency)
                .field("phase", phase)
                .finish(),
            Self::Custom(_) => f.write_str("Custom(..)"),
        }
    }
}

/// A point mass and what acts on it besides the rod.
#[derive(Debug, Clone)]
pub struct Body<const N: usize> {
    mass: f64,
    /// Gravity (acceleration) and dead force together: a constant force, with a potential.
    constant: SVector<f64, N>,
    drag: f64,
    forces: Vec<TimeForce<N>>,
}

impl<const N: usize> Body<N> {
    /// A free mass.
    ///
    /// # Errors
    /// A mass that is not positive and finite.
    pub fn new(mass: f64) -> Result<Self> {
        if !(0.0 < mass && mass < f64::INFINITY) {
            return Err(Error::domain(format!(
                "mass = {mass} must be finite and > 0"
            )));
        }
        Ok(Self {
            mass,
            constant: SVector::zeros(),
            drag: 0.0,
            forces: Vec::new(),
        })
    }

    /// Adds gravity, an acceleration.
    ///
    /// # Errors
    /// A component that is not finite.
    pub fn with_gravity(self, gravity: SVector<f64, N>) -> Result<Self> {
        let weight = gravity * self.mass;
        self.with_dead_force(weight)
            .map_err(|e| e.context("gravity"))
    }

    /// Adds a constant force.
    ///
    /// # Errors
    /// A component that is not finite.
    pub fn with_dead_force(mut self, force: SVector<f64, N>) -> Result<Self> {
        if !force.iter().all(|f| f.is_finite()) {
            return Err(Error::domain(format!(
                "a constant force of components {:?} must be finite",
                force.as_slice()
            )));
        }
        self.constant += force;
        Ok(self)
    }

    /// Sets a linear drag: force -drag v.
    ///
    /// # Errors
    /// A drag that is negative or not finite.
    pub fn with_drag(mut self, drag: f64) -> Result<Self> {
        if !(0.0..f64::INFINITY).contains(&drag) {
            return Err(Error::domain(format!(
                "drag = {drag} must be finite and >= 0"
            )));
        }
        self.drag = drag;
        Ok(self)
    }

    /// Adds a force in time.
    #[must_use]
    pub fn with_force(mut self, force: TimeForce<N>) -> Self {
        self.forces.push(force);
        self
    }

    /// The mass.
    pub fn mass(&self) -> f64 {
        self.mass
    }

    /// Potential of the constant loads at a pose.
    pub fn potential(&self, pose: &SVector<f64, N>) -> f64 {
        // Subtracted from zero, so that no load gives 0 and not -0.
        0.0 - self.constant.dot(pose)
    }

    /// Kinetic energy.
    pub fn kinetic(&self, velocity: &SVector<f64, N>) -> f64 {
        0.5 * self.mass * velocity.norm_squared()
    }

    /// True if a force in time does work.
    pub fn is_driven(&self) -> bool {
        !self.forces.is_empty()
    }

    /// True if drag dissipates.
    pub fn is_damped(&self) -> bool {
        self.drag > 0.0
    }

    /// What acts at time `t` and velocity `v` under the rod's force.
    #[inline]
    pub fn action(&self, t: f64, v: &SVector<f64, N>, rod: &SVector<f64, N>) -> Action<N> {
        let mut force = rod + self.constant;
        let mut power = 0.0;
        let mut loss = 0.0;
        if self.is_driven() {
            let driving = self
                .forces
                .iter()
                .fold(SVector::zeros(), |sum: SVector<f64, N>, f| sum + f.at(t));
            force += driving;
            power = driving.dot(v);
        }
        if self.is_damped() {
            force -= v * self.drag;
            loss = self.drag * v.norm_squared();
        }
        Action {
            acceleration: force / self.mass,
            power,
            loss,
        }
    }
}

/// Acceleration of the body, power of the driving forces, loss to drag.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Action<const N: usize> {
    /// Sum of forces over mass.
    pub acceleration: SVector<f64, N>,
    /// Driving forces times velocity.
    pub power: f64,
    /// drag |v|^2.
    pub loss: f64,
}
