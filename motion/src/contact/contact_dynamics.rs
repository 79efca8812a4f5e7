//! The interface between contacts and the motion of the bodies, whatever else moves with them.

use super::contact_forces::Moment;
use nalgebra::Vector6;

/// The equations of motion of bodies, as their contacts see them. The state is that of an integration.
pub(crate) trait ContactDynamics {
    /// A state of the integration.
    type State;

    /// The time of a state.
    fn time(&self, y: &Self::State) -> f64;

    /// Poses and velocities of bodies and obstacles. The accelerations of the bodies are left at 0.
    fn places(&self, y: &Self::State) -> Moment<'_>;

    /// Poses, velocities, and the accelerations of the bodies without contact forces; NaN where these do not exist.
    fn moment(&self, y: &Self::State) -> Moment<'_>;

    /// Adds to the twists (angular velocity, velocity) of the bodies, in the world.
    fn add_twists(&self, y: &mut Self::State, changes: &[Vector6<f64>]);

    /// Shifts the poses of the bodies by small twists, in the world.
    fn shift(&self, y: &mut Self::State, changes: &[Vector6<f64>]);

    /// Books the kinetic energy lost in an impact, and the work of obstacles in it.
    fn book_impact(&self, y: &mut Self::State, loss: f64, work: f64);
}
