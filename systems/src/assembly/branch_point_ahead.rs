//! How a rod comes to be neutral with its ends held, told by what is watched of it (theory 3.3).

use super::Sight;
use nalgebra::{Matrix6, Vector6};

/// A rod that resists less than this part of the most is as near as a step comes to where it is neutral, or all but rigid: of that no imperfection is told.
const WEAKEST: f64 = 1e-8;

/// A direction of the chart in which a rod is about to be neutral, or has just been.
#[derive(Debug, Clone, Copy)]
pub struct Neutral {
    /// In how many steps, at the rate of the last one: negative if it was within that.
    pub left: f64,
    /// How much of the motion of the ends pushes the rod there, times how much less the rod resists there than where it resists most: an imperfection,
    /// which stays as it is while the rod comes nearer, and is nothing but rounding where a symmetry forbids any push.
    pub push: f64,
    along: Vector6<f64>,
    against: Vector6<f64>,
}

impl Neutral {
    /// What the rod resists with in this direction, by its Jacobian. It goes through 0 where the rod is neutral, in one direction or in several at once.
    pub fn resistance(&self, jacobian: &Matrix6<f64>) -> f64 {
        let moved = jacobian.full_piv_lu().solve(&self.against);
        moved.map_or(0.0, |moved| self.along.dot(&moved).recip())
    }
}

impl Sight {
    /// The direction in which the rod is neutral first, at the rates of the step that led here from `before`; None if it comes nearer to none.
    pub fn neutral_next(&self, before: &Self) -> Option<Neutral> {
        let svd = before.jacobian.svd(true, true);
        let (u, v_t) = (svd.u?, svd.v_t?);
        let (most, speed) = (svd.singular_values.max(), before.drive.norm());
        let all = (0..6).filter_map(|k| {
            let against = u.column(k).into_owned();
            let was = svd.singular_values[k];
            let mut next = Neutral {
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

    /// True if the rod is neutral in more than one direction, to `within`.
    pub fn is_neutral_all_round(&self, within: f64) -> bool {
        let sizes = self.jacobian.singular_values();
        sizes.iter().filter(|size| **size <= within).count() > 1
    }
}
