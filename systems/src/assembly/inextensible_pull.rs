//! Rods as tethers: force of an inextensible unshearable rod, pulled straight, on its attachments (theory 2.8).

use super::configuration::Evaluated;
use super::network::Assembly;
use super::rod_element::{Link, LinkPoint};
use crate::math::se3::{halves, join};
use nalgebra::Vector3;

/// Pull of a rod.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Tether {
    /// Tension n, a force.
    pub tension: f64,
    /// sqrt(n L^2/B).
    pub lambda: f64,
    /// Reach lost to the bent ends, d = L - r(1).n/|n|; n d is the energy stored in them.
    pub slack: f64,
    /// Minus the power of the pull, n.r(1)': above 0 while the attachments move apart against the pull.
    pub parting: f64,
    /// Direction of the pull from base to end, in the world.
    pub along: Vector3<f64>,
}

impl Tether {
    /// The rod at `point` as a tether. None for a rod that stretches or shears, that is not pulled, or that is
    /// between two ball joints, where nothing is bent.
    pub fn of(link: &Link, point: &LinkPoint) -> Option<Self> {
        if link.is_pinned() || !link.rod().is_inextensible().ok()? {
            return None;
        }
        let n = point.end.force;
        let tension = n.norm();
        let along = n.try_normalize(f64::MIN_POSITIVE)?;
        let reach = along.dot(&point.end.pose.translation.vector);
        (reach > 0.0).then(|| Self {
            tension,
            lambda: (tension / link.units()[3]).sqrt(),
            slack: link.rod().length() - reach,
            parting: n.dot(&halves(&point.relative_twist()).1),
            along: point.base.pose.rotation * along,
        })
    }

    /// Effective mass m against a separation of the attachments of rod `k` along the pull: a unit force on each
    /// accelerates them apart by 1/m. Infinite if no carrying body moves that way.
    pub fn resistance(&self, assembly: &Assembly, k: usize, at: &Evaluated) -> Option<f64> {
        let bodies = &at.now.bodies;
        let wrenches = assembly.wrenches(bodies, &at.points);
        let own = assembly.own_twists(bodies);
        let mut give = 0.0;
        for (body, arm) in assembly
            .links()
            .get(k)?
            .levers(bodies)
            .into_iter()
            .flatten()
        {
            let (carrier, pose) = (&assembly.carriers()[body], &bodies[body].pose);
            let [mass, ..] =
                carrier.linear_own(at.integrals.time, pose, &wrenches[body], &own[body])?;
            let pushed = join(&arm.cross(&self.along), &self.along);
            let pushed = own[body].tr_mul(&pushed);
            give += pushed.dot(&mass.cholesky()?.solve(&pushed));
        }
        Some(1.0 / give)
    }
}
