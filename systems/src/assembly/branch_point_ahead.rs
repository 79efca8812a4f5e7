//! Approach of a rod with held ends to a branch point: next neutral direction, steps left, imperfection (theory 3.3).

use super::state::RodMonitor;
use nalgebra::{Matrix6, Vector6};

/// Floor of the relative resistance in the measure of an imperfection: a rod cannot be resolved closer to neutral,
/// and a rigid rod has no imperfection.
const WEAKEST: f64 = 1e-8;

/// A direction of the chart in which a rod is about to be neutral, or has just been.
#[derive(Debug, Clone, Copy)]
pub struct NeutralApproach {
    /// Steps until neutral, at the rate of the last step: negative if the point lies within that step.
    pub left: f64,
    /// Imperfection: part of the ends' motion that pushes along this direction, times the resistance relative to the
    /// largest. It is constant while the rod approaches, and pure rounding if a symmetry forbids any push.
    pub push: f64,
    along: Vector6<f64>,
    against: Vector6<f64>,
}

impl NeutralApproach {
    /// Resistance of the rod in this direction, by its Jacobian: 0 where the rod is neutral, in one direction or in
    /// several.
    pub fn resistance(&self, jacobian: &Matrix6<f64>) -> f64 {
        let moved = jacobian.full_piv_lu().solve(&self.against);
        moved.map_or(0.0, |moved| self.along.dot(&moved).recip())
    }
}

impl RodMonitor {
    /// First direction to become neutral, at the rates of the step from `before` to this state; None if no resistance
    /// falls.
    pub fn neutral_next(&self, before: &Self) -> Option<NeutralApproach> {
        let svd = before.jacobian.svd(true, true);
        let (u, v_t) = (svd.u?, svd.v_t?);
        let (most, speed) = (svd.singular_values.max(), before.drive.norm());
        let all = (0..6).filter_map(|k| {
            let against = u.column(k).into_owned();
            let was = svd.singular_values[k];
            let mut next = NeutralApproach {
                left: f64::INFINITY,
                push: against.dot(&before.drive).abs() / speed * (was / most).max(WEAKEST),
                along: v_t.row(k).transpose(),
                against,
            };
            let is = next.resistance(&self.jacobian);
            next.left = is / (was - is);
            (is < was).then_some(next)
        });
        all.min_by(|a, b| a.left.total_cmp(&b.left))
    }

    /// True if the rod is neutral, to `within`, in more than one direction.
    pub fn is_neutral_all_round(&self, within: f64) -> bool {
        let sizes = self.jacobian.singular_values();
        sizes.iter().filter(|size| **size <= within).count() > 1
    }
}
