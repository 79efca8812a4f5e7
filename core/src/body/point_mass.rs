//! A point mass with its loads, seen from the clamp of the rod.

use super::load_function::first_break_of;
use super::{
    BodyState, BodyWrench, EndMotion, LoadFunction, Support, TimeLoad, check_drag, check_vector,
    first_break, sum_at,
};
use crate::error::{Error, Result};
use crate::manifold::FirstOrderInertia;
use nalgebra::SVector;
use std::sync::Arc;

/// A point mass with the loads on it besides the rod.
#[derive(Debug, Clone)]
pub struct PointMass<const N: usize> {
    pub(super) mass: f64,
    /// Gravity (acceleration) and dead force together: a constant force, with a potential.
    pub(super) constant: SVector<f64, N>,
    pub(super) drag: f64,
    pub(super) forces: Vec<TimeLoad<N>>,
    pub(super) functions: Vec<LoadFunction>,
    pub(super) support: Option<Box<Support<N>>>,
    pub(super) rod: Option<Arc<dyn FirstOrderInertia<N>>>,
}

impl<const N: usize> PointMass<N> {
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
            functions: Vec::new(),
            support: None,
            rod: None,
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
        self.constant += check_vector("a constant force", force)?;
        Ok(self)
    }

    /// Sets a linear drag: force -drag v.
    ///
    /// # Errors
    /// A drag that is negative or not finite.
    pub fn with_drag(mut self, drag: f64) -> Result<Self> {
        self.drag = check_drag("drag", drag)?;
        Ok(self)
    }

    /// Adds a force in time.
    #[must_use]
    pub fn with_force(mut self, force: TimeLoad<N>) -> Self {
        self.forces.push(force);
        self
    }

    /// Adds a force as a function of time and of the motion of the mass, in the world. Only motions feel the function;
    /// [`PointMass::load`] is without it.
    #[must_use]
    pub fn with_function(mut self, force: LoadFunction) -> Self {
        self.functions.push(force);
        self
    }

    /// Clamps the rod in `support`. Loads stay as given, in the world frame; places, velocities and forces of the rod
    /// are then seen from the clamp, along its axes.
    #[must_use]
    pub fn with_support(mut self, support: Support<N>) -> Self {
        self.support = Some(Box::new(support));
        self
    }

    /// Accounts for the inertia of the rod.
    #[must_use]
    pub fn with_rod(mut self, rod: Arc<dyn FirstOrderInertia<N>>) -> Self {
        self.rod = Some(rod);
        self
    }

    /// The inertia of the rod, if accounted for.
    pub fn rod(&self) -> Option<&dyn FirstOrderInertia<N>> {
        self.rod.as_deref()
    }

    /// The body with its clamp fixed in the pose of time `t`.
    #[must_use]
    pub fn standing_at(mut self, t: f64) -> Self {
        self.support = self.support.map(|support| Box::new(support.standing_at(t)));
        self
    }

    /// The clamp, if it is not fixed at the origin along the axes of the world.
    pub fn support(&self) -> Option<&Support<N>> {
        self.support.as_deref()
    }

    /// The mass.
    pub fn mass(&self) -> f64 {
        self.mass
    }

    /// Weight and dead force in total, in the world.
    pub fn constant(&self) -> &SVector<f64, N> {
        &self.constant
    }

    /// Potential of the constant loads at a pose seen from the clamp.
    pub fn potential(&self, t: f64, pose: &SVector<f64, N>) -> f64 {
        let place = match &self.support {
            Some(support) => support.at(t).place(pose),
            None => *pose,
        };
        // Subtracted from zero, to give 0 and not -0 without loads.
        0.0 - self.constant.dot(&place)
    }

    /// Kinetic energy, of a velocity seen from the clamp.
    pub fn kinetic(&self, t: f64, pose: &SVector<f64, N>, velocity: &SVector<f64, N>) -> f64 {
        let velocity = match &self.support {
            Some(support) => support.at(t).absolute_velocity(pose, velocity),
            None => *velocity,
        };
        0.5 * self.mass * velocity.norm_squared()
    }

    /// The loads at time `t` besides drag and functions, along the axes of the clamp.
    pub fn load(&self, t: f64) -> SVector<f64, N> {
        let load = self.constant + sum_at(&self.forces, t);
        match &self.support {
            Some(support) => support.at(t).inward(&load),
            None => load,
        }
    }

    /// True if a load depends on time or on the motion, other than drag.
    pub(super) fn is_timed(&self) -> bool {
        !self.forces.is_empty() || self.has_functions()
    }

    /// True if a load is a function of the motion.
    pub fn has_functions(&self) -> bool {
        !self.functions.is_empty()
    }

    /// True if a force in time, a function or a moving clamp does work.
    pub fn is_driven(&self) -> bool {
        self.is_timed() || self.support.as_ref().is_some_and(|s| !s.is_fixed())
    }

    /// Force of the drag over velocity.
    pub fn drag(&self) -> f64 {
        self.drag
    }

    /// True if drag dissipates.
    pub fn is_damped(&self) -> bool {
        self.drag > 0.0
    }

    /// The first time after `t` at which a load or the motion of the clamp is not smooth, or which a step must not
    /// skip; infinite if none is left.
    pub fn next_break(&self, t: f64) -> f64 {
        let clamp = self.support.as_ref();
        let clamp = clamp.map_or(f64::INFINITY, |support| support.next_break(t));
        first_break(&self.forces, t)
            .min(first_break_of(&self.functions, t))
            .min(clamp)
    }

    /// Motion of the body at time `t` under the rod's force; place, velocity and force are seen from the clamp.
    #[inline]
    pub fn action(
        &self,
        t: f64,
        pose: &SVector<f64, N>,
        v: &SVector<f64, N>,
        rod: &SVector<f64, N>,
    ) -> EndMotion<N> {
        match &self.support {
            None => self.action_at(t, pose, v, rod),
            Some(support) => {
                let frame = support.at(t);
                let place = frame.place(pose);
                let world = |v: &_, rod: &_| self.action_at(t, &place, v, rod);
                frame.motion(pose, v, rod, world)
            }
        }
    }

    /// Motion of the body at a place in the world.
    #[inline]
    fn action_at(
        &self,
        t: f64,
        place: &SVector<f64, N>,
        v: &SVector<f64, N>,
        rod: &SVector<f64, N>,
    ) -> EndMotion<N> {
        if self.functions.is_empty() {
            return self.free_action(t, v, rod);
        }
        let state = BodyState::of_point(t, place.as_slice(), v.as_slice());
        let force = BodyWrench::sum(&self.functions, &state).on_point();
        let mut action = self.free_action(t, v, &(rod + force));
        action.power += force.dot(v);
        action
    }

    /// Motion of the body in the world frame, without functions.
    #[inline]
    pub(super) fn free_action(
        &self,
        t: f64,
        v: &SVector<f64, N>,
        rod: &SVector<f64, N>,
    ) -> EndMotion<N> {
        let mut force = rod + self.constant;
        let mut power = 0.0;
        let mut loss = 0.0;
        if !self.forces.is_empty() {
            let driving = sum_at(&self.forces, t);
            force += driving;
            power = driving.dot(v);
        }
        if self.is_damped() {
            force -= v * self.drag;
            loss = self.drag * v.norm_squared();
        }
        EndMotion {
            acceleration: force / self.mass,
            power,
            loss,
        }
    }
}
