//! Labels of the equilibrium near a planar viscoelastic rod.

use super::sample::ViscousSample;
use nalgebra::Vector2;
use snaprod_systems::elastica::{Elastica, Equilibrium};
use snaprod_systems::manifold::invert_near;
use snaprod_systems::viscoelastic::plane::Plane;

/// Largest distance from equilibrium ([`ViscousSample::distance`]) at which a nearby equilibrium is sought.
const NEAR: f64 = 0.1;
/// Largest difference of the curvature (root mean squares over the rod), relative to that of the rod.
const ALIKE: f64 = 0.02;

/// The equilibrium with the same end whose curvature agrees with the rod to 2 %. None if there is none, or if
/// Maxwell branches carry couples of their own.
pub fn near_equilibrium(sample: &ViscousSample<Plane, 1, 2>) -> Option<Equilibrium> {
    if sample.distance() > NEAR {
        return None;
    }
    let n = sample.flow.wrench;
    let lam = n.norm().sqrt();
    let alpha = (-n[1]).atan2(-n[0]);
    let half = 0.5 * (sample.configuration.shape.end_angle() - alpha);
    let p = (half.sin() / half.cos().abs()).asinh();
    let guess = Equilibrium::from_lambda_p(lam, p).ok()?;
    let found = invert_near(
        &Elastica,
        &sample.pose,
        &Vector2::new(guess.p, guess.w),
        1e-13,
    )
    .ok()?;
    let there = Equilibrium::new(found.q[0], found.q[1]).ok()?;
    let (mut difference, mut size) = (0.0, 0.0);
    let strains = &sample.configuration.strains;
    for ((s, weight), e) in sample
        .grid
        .nodes()
        .iter()
        .zip(sample.grid.weights())
        .zip(strains)
    {
        difference += weight * (there.section(*s).ok()?.curvature - e[0]).powi(2);
        size += weight * e[0] * e[0];
    }
    (difference <= ALIKE * ALIKE * size).then_some(there)
}
