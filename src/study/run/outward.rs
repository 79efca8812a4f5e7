//! Conversion of the records of a motion from the units of the rod to the units of the scene.

use crate::error::Quantity;
use crate::motion::{Bounce, Snap, SnapEnd, UnknownInterval};
use crate::scene::Scales;
use nalgebra::DVector;

/// A snap whose ends have the chart points `from` and `to` of the record; its bodies, charts and joints are left out.
pub(super) fn snap(k: &Scales, snap: &Snap, [from, to]: [DVector<f64>; 2]) -> Snap {
    let end = |end: &SnapEnd, q: DVector<f64>| SnapEnd {
        q,
        elastic: k.outward(Quantity::Couple, end.elastic),
        ..*end
    };
    Snap {
        t: k.outward(Quantity::Time, snap.t),
        time_error: k.outward(Quantity::Time, snap.time_error),
        pose: vector(k, Quantity::Length, &snap.pose),
        velocity: vector(k, Quantity::Velocity, &snap.velocity),
        from: end(&snap.from, from),
        to: end(&snap.to, to),
        released: k.outward(Quantity::Couple, snap.released),
        joints: Vec::new(),
        moving: None,
        ..*snap
    }
}

/// A wrench (couple, force).
pub(super) fn wrench(k: &Scales, q: &DVector<f64>) -> DVector<f64> {
    let of = |i: usize| [Quantity::Couple, Quantity::Force][usize::from(i >= 3)];
    DVector::from_fn(q.len(), |i, _| k.outward(of(i), q[i]))
}

/// A vector of one quantity.
pub(super) fn vector(k: &Scales, of: Quantity, v: &DVector<f64>) -> DVector<f64> {
    v.map(|x| k.outward(of, x))
}

/// An interval without a light rod.
pub(super) fn interval(k: &Scales, lost: UnknownInterval) -> UnknownInterval {
    UnknownInterval {
        from: k.outward(Quantity::Time, lost.from),
        until: lost.until.map(|t| k.outward(Quantity::Time, t)),
        ..lost
    }
}

/// A bounce of a taut rod, in the units of the scene.
#[derive(Debug, Clone, PartialEq)]
pub struct RunBounce {
    /// Number of the rod.
    pub rod: usize,
    /// Time at which the end is farthest out.
    pub t: f64,
    /// Position of the end, in an assembly along the directors of its base.
    pub pose: DVector<f64>,
    /// Velocity of the end, across the pull.
    pub velocity: DVector<f64>,
    /// The largest pull.
    pub tension: f64,
    /// sqrt(tension L^2/B).
    pub lambda: f64,
    /// Stored energy.
    pub elastic: f64,
    /// [`Bounce::viscosity`]: viscosity over stiffness at which friction takes all of the energy.
    pub friction_time: f64,
    /// The viscosity of a planar rod at which friction takes all of the energy.
    pub viscosity: f64,
}

impl RunBounce {
    /// A bounce with position and velocity in the units of the rod.
    pub(super) fn new(k: &Scales, bounce: &Bounce, [pose, velocity]: [&DVector<f64>; 2]) -> Self {
        Self {
            rod: bounce.rod,
            t: k.outward(Quantity::Time, bounce.t),
            pose: vector(k, Quantity::Length, pose),
            velocity: vector(k, Quantity::Velocity, velocity),
            tension: k.outward(Quantity::Force, bounce.tension),
            lambda: bounce.lambda,
            elastic: k.outward(Quantity::Couple, bounce.elastic),
            friction_time: k.outward(Quantity::Time, bounce.viscosity()),
            viscosity: bounce.viscosity() * k.viscosity(),
        }
    }
}
