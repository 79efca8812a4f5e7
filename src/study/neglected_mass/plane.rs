//! Mass effects of the planar rod at rest, in closed form and on Gauss nodes.

use super::{MassEffect, RodMass};
use crate::elastica::{
    EndStiffness, Equilibrium, HeldMode, RodInertia, TautInertia, equilibrium_under_load,
    held_modes,
};
use crate::error::{Quantity, Result};
use crate::scene::{Scales, Scene};
use nalgebra::Vector2;

/// Fundamental vibration of a straight clamped rod whose other end is pinned: omega^2 = x^4, cos x sinh x = sin x
/// cosh x.
const STRAIGHT: HeldMode = HeldMode {
    stiffness: 237.721_067_534_944_6,
    friction: 118.860_533_767_472_3,
};
/// 33/140: part of the mass of the straight rod that is added to a body in transverse motion.
const ACROSS: f64 = 33.0 / 140.0;

/// Data of a planar rod for mass effects, in units of the rod.
#[derive(Debug, Clone, Copy)]
pub(in crate::study) struct PlanarRodMass {
    /// Mass of the rod over that of the body.
    pub eps: f64,
    /// Kelvin-Voigt time.
    pub eta: f64,
    /// Loads on the end at t = 0, along the axes of the clamp.
    pub load: Vector2<f64>,
    /// True if the mass is followed to first order.
    pub followed: bool,
    /// sqrt(m L^3/EI) in the scene's units.
    pub time: f64,
}

impl PlanarRodMass {
    /// The rod of a planar scene under these loads; `None` if its mass is unknown.
    ///
    /// # Errors
    /// A rod without a bending stiffness.
    pub fn new(scene: &Scene, scales: &Scales, load: Vector2<f64>) -> Result<Option<Self>> {
        let Some(eps) = scene.rod.mass_over_unit(scales) else {
            return Ok(None);
        };
        let viscosity = viscosity(scene)?.unwrap_or(0.0);
        Ok(Some(Self {
            eps,
            eta: scales.inward(Quantity::Viscosity(0, 0), viscosity),
            load,
            time: scales.time,
            followed: scene.rod.is_light(),
        }))
    }

    /// Mass effects at the stable equilibrium under the load; `None` if none is found.
    pub fn at_rest(&self) -> Option<MassEffect> {
        let rest = equilibrium_under_load(&self.load).ok()?;
        Some(self.about(rest.as_ref()))
    }

    /// Mass effects about an equilibrium; `None` denotes the straight rod.
    pub fn about(&self, at: Option<&Equilibrium>) -> MassEffect {
        let (frequency_shift, mode) = match at {
            None if self.load == Vector2::zeros() => {
                (Some(-0.5 * self.eps * ACROSS), Some(STRAIGHT))
            }
            // An axial pull changes the modes of the straight rod, for which STRAIGHT and ACROSS no longer hold.
            None => (None, None),
            Some(at) => (
                shift(at.p, at.w, self.eps),
                held_modes(at.p, at.w, 1)
                    .ok()
                    .and_then(|m| m.first().copied()),
            ),
        };
        MassEffect {
            frequency_shift,
            rods: vec![RodMass {
                rod: None,
                eps: Some(self.eps),
                frequency: mode.and_then(|m| Some(m.frequency(self.eps)? / self.time)),
                decay: mode.map(|m| m.friction * self.eta / self.eps / self.time),
                followed: self.followed,
            }],
        }
    }
}

/// The viscosity of a planar rod at small rates, in the scene's units.
pub(in crate::study) fn viscosity(scene: &Scene) -> Result<Option<f64>> {
    let damping = scene.rod.damping.as_ref().filter(|_| scene.is_planar());
    let stiffness = || scene.rod.bending_stiffness();
    damping
        .map(|damping| Ok(damping.viscosity(stiffness()?)))
        .transpose()
}

/// -eps/2 v.A v for the softest direction v of the end.
fn shift(p: f64, w: f64, eps: f64) -> Option<f64> {
    let [(_, v), _] = EndStiffness::at(p, w).ok()?.principal();
    let still = Vector2::zeros();
    let added = match TautInertia::new(p, w) {
        Some(rod) => rod.added(&still, &still)?,
        None => RodInertia::new(p, w).ok()?.added(&still, &still)?,
    };
    Some(-0.5 * eps * v.dot(&(added.mass * v)))
}
