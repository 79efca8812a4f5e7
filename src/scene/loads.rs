//! What acts on the body of a scene beside the rod.

use super::Sine;
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
    /// Rotational drag >= 0: couple -rotational_drag * angular velocity on a welded body.
    pub rotational_drag: f64,
    /// Forces in time at the centre of mass, added up.
    pub force: Vec<Force>,
}

/// A force in time along a direction.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct Force {
    /// Direction, not zero, of any length: only [`Force::unit`] enters the force.
    pub direction: [f64; 3],
    /// Its size in time.
    #[serde(flatten)]
    pub size: InTime,
}

/// The size of a force in time, as it is written; a [`History`](crate::body::History) is made of it.
#[derive(Debug, Clone, PartialEq, Serialize)]
#[serde(rename_all = "lowercase")]
pub enum InTime {
    /// `ramp`: it grows linearly.
    Ramp(Ramp),
    /// `pulse`: a raised cosine.
    Pulse(Pulse),
    /// `table`: rows [t, f] of growing times, linear in between, constant before and after.
    Table(Vec<[f64; 2]>),
    /// A sine.
    #[serde(untagged)]
    Sine(Sine),
}

/// A force that grows from `from` before `start` to `to` after `until`.
#[derive(Debug, Clone, Copy, PartialEq, Serialize)]
pub struct Ramp {
    /// Size before; default 0.
    pub from: f64,
    /// Size after.
    pub to: f64,
    /// When it begins to grow, >= 0; default 0.
    pub start: f64,
    /// When it has grown, > `start`.
    pub until: f64,
}

/// A pulse amplitude (1 + cos(2 pi (t - at)/width))/2, |t - at| <= width/2.
#[derive(Debug, Clone, Copy, PartialEq, Serialize)]
pub struct Pulse {
    /// Time of its middle.
    pub at: f64,
    /// How long it lasts, > 0.
    pub width: f64,
    /// Its height.
    pub amplitude: f64,
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
