//! What acts on the body of a scene beside the rod.

use serde::Serialize;

/// Loads on the body, in the world. Everything defaults to zero.
#[derive(Debug, Clone, PartialEq, Default, Serialize)]
pub struct Loads {
    /// Acceleration of gravity: force mass * gravity at the centre of mass.
    pub gravity: [f64; 3],
    /// Constant force at the centre of mass.
    pub dead: [f64; 3],
    /// Constant couple; 0 for a point mass.
    pub couple: [f64; 3],
    /// Drag coefficient >= 0: force -drag * velocity of the centre of mass, at the centre of mass.
    pub drag: f64,
    /// Sinusoidal forces at the centre of mass, added up.
    pub force: Vec<Force>,
}

/// A force amplitude * sin(2 pi frequency t + phase) along a direction.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct Force {
    /// Direction, not zero, of any length: only [`Force::unit`] enters the force, so that
    /// `amplitude` is the amplitude.
    pub direction: [f64; 3],
    /// Amplitude, a force of either sign.
    pub amplitude: f64,
    /// Frequency >= 0, cycles per time. At 0 the force is constant, amplitude * sin(phase).
    pub frequency: f64,
    /// Phase in radians; default 0.
    pub phase: f64,
}

impl Force {
    /// The direction at unit length.
    pub fn unit(&self) -> [f64; 3] {
        // Scaled by the largest component first, so that the norm neither over- nor underflows.
        let size = self
            .direction
            .iter()
            .fold(0.0_f64, |size, x| size.max(x.abs()));
        let scaled = self.direction.map(|x| x / size);
        let norm = scaled.iter().fold(0.0_f64, |norm, x| norm.hypot(*x));
        scaled.map(|x| x / norm)
    }
}
