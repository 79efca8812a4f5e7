//! A body in the plane together with its rod, whose mass is followed to first order (theory 2.9).

use super::sheet::Phase;
use nalgebra::{SMatrix, SVector};
use snaprod_systems::body::{Body, EndMotion};
use snaprod_systems::manifold::{ManifoldPoint, RodMass};

/// A rod whose mass is followed, and by how much that may be off.
#[derive(Clone, Copy)]
pub(super) struct Carried<'a, const N: usize> {
    /// The rod.
    pub rod: &'a dyn RodMass<N>,
    /// Bound of the error of its mass, in that of the body.
    pub error: f64,
}

/// How well the mass of a rod has to be known: the body feels an error by the part of its own mass that it is.
pub(super) fn rod_error<const N: usize>(body: &Body<N>, tolerance: f64) -> f64 {
    body.mass() * tolerance
}

/// The force on the body of the inertia of its rod, and of what of its weight the equilibria do not bear; None where it cannot be followed.
pub(super) fn force_of_mass<const N: usize>(
    rod: &dyn RodMass<N>,
    body: &Body<N>,
    (y, point): (&Phase<N>, &ManifoldPoint<N>),
    error: f64,
) -> Option<SVector<f64, N>> {
    let mut action = body.action(y.t, &point.pose, &y.v, &point.force);
    let alone = action.acceleration;
    with_rod(Carried { rod, error }, body, (y, point), &mut action)?;
    Some((action.acceleration - alone) * body.mass())
}

/// The motion of a body together with its rod: (mu I + A) v' = mu a + b, a the acceleration without it. A clamp that moves bears the rod's
/// inertia at its end and along it.
pub(super) fn with_rod<const N: usize>(
    Carried { rod, error }: Carried<N>,
    body: &Body<N>,
    (y, point): (&Phase<N>, &ManifoldPoint<N>),
    action: &mut EndMotion<N>,
) -> Option<()> {
    let (frame, mass) = (body.support().map(|support| support.at(y.t)), body.mass());
    let felt = rod.added(frame.as_ref(), [&y.q, &y.v], point, error)?;
    let all = (felt.mass + SMatrix::identity() * mass).try_inverse()?;
    let alone = action.acceleration;
    action.acceleration = all * (alone * mass + felt.force);
    if let Some(frame) = frame {
        let borne = (action.acceleration - alone) * mass;
        action.power += borne.dot(&frame.carried(&point.pose))
            + felt.pull.dot(&action.acceleration)
            + felt.power;
    }
    Some(())
}
