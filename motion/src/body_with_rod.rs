//! Motion of a body in the plane together with its rod, the rod's mass followed to first order (theory 2.9).

use super::sheet::Phase;
use nalgebra::{SMatrix, SVector};
use snaprod_systems::body::{EndMotion, PointMass};
use snaprod_systems::manifold::{FirstOrderInertia, ManifoldPoint};

/// A rod with a followed mass, and the tolerance of that mass.
#[derive(Clone, Copy)]
pub(super) struct FollowedMass<'a, const N: usize> {
    /// The rod.
    pub rod: &'a dyn FirstOrderInertia<N>,
    /// Bound of the error of the rod's mass, in units of the body's.
    pub error: f64,
}

/// Tolerance of the mass of a rod: an error acts on the body in proportion to its share of the body's mass.
pub(super) fn rod_error<const N: usize>(body: &PointMass<N>, tolerance: f64) -> f64 {
    body.mass() * tolerance
}

/// Force on the body by the inertia of its rod, and by the part of the rod's weight that the equilibria do
/// not bear. None where the mass cannot be followed.
pub(super) fn force_of_mass<const N: usize>(
    rod: &dyn FirstOrderInertia<N>,
    body: &PointMass<N>,
    y: &Phase<N>,
    point: &ManifoldPoint<N>,
    error: f64,
) -> Option<SVector<f64, N>> {
    let mut action = body.action(y.t, &point.pose, &y.v, &point.force);
    let alone = action.acceleration;
    with_rod(FollowedMass { rod, error }, body, y, point, &mut action)?;
    Some((action.acceleration - alone) * body.mass())
}

/// Adds the rod to the motion of the body: (mu I + A) v' = mu a + b, a the acceleration without the rod. On a
/// moving clamp the clamp bears the rod's inertia at its end and along it.
pub(super) fn with_rod<const N: usize>(
    FollowedMass { rod, error }: FollowedMass<N>,
    body: &PointMass<N>,
    y: &Phase<N>,
    point: &ManifoldPoint<N>,
    action: &mut EndMotion<N>,
) -> Option<()> {
    let (frame, mass) = (body.support().map(|support| support.at(y.t)), body.mass());
    let felt = rod.end_inertia(frame.as_ref(), [&y.q, &y.v], point, error)?;
    let all = (felt.mass + SMatrix::identity() * mass).try_inverse()?;
    let alone = action.acceleration;
    action.acceleration = all * (alone * mass + felt.force);
    if let Some(frame) = frame {
        let borne = (action.acceleration - alone) * mass;
        action.power += borne.dot(&frame.velocity_of_fixed_point(&point.pose))
            + felt.pull.dot(&action.acceleration)
            + felt.power;
    }
    Some(())
}
