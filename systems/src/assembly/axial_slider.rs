//! Rods of an assembly that cannot stretch and are all but straight.
//!
//! Bent by angles of the size b a rod that cannot stretch is shorter from end to end by some s = b^2, and along itself it gives way as s does: where it
//! is straight its force along itself is a constraint, and where it is nearly so that force is what rounding makes of the place of its end, and
//! vibrates as 1/b. Nobody asked for either. As long as s is small the end gives way by a little more, as if it sat on a slider with a spring, along the
//! rod as it stood when that was set:
//! ```text
//! r = r(1) + c (e.n(1)) e,     m = m(1) - (r - r(1)) x n(1),     the spring stores c (e.n(1))^2/2,
//! ```
//! with c |e.n(1)| at most UNSEEN of the tolerance, in lengths of the rod, where the spring is set; after steps that end with KEPT as much it is set anew. What the rod does across itself is left as it is.
//!
//! A rod whose mass is felt is swayed by its end: where that moves along the rod at v, the force there changes at v/(y + c), y what the end yields to a unit
//! force by the bending of the rod alone, and its kinetic energy goes with the square of that. What a slider makes of the place cannot be seen, what it makes of the rate can,
//! c/y. And with its mass the rod vibrates no faster as it gets straight. So it has no slider unless y is next to nothing. What an error of the integration along the rod makes of
//! y is as good as a slider, whether the rod can stretch or not: where y is small the rod is integrated so much finer, and an end that has drifted off is brought back by
//! its body along the rod, not by its force.

use super::{Joint, Link, LinkEnd};
use crate::math::se3::{halves, joined};
use crate::rod::Wrench;
use nalgebra::{Matrix3, Vector3, Vector6};

/// The part of the tolerance by which an end gives way, and of that where it has another spring ...
const UNSEEN: f64 = 0.1;
const KEPT: f64 = 3.0;
/// ... and the most that it gives under a unit force, in L^3/B.
const MOST: f64 = 1e-7;
/// An end that yields along the rod by more than this under a unit force, in L^3/B, has its rod's mass without a slider; the other where it has none ...
const RIGID: [f64; 2] = [1e-8, 5e-9];
/// ... and by more than this as any rod does.
const SOFT: [f64; 2] = [1e-4, 2e-4];
/// Between the two it is found to this part of the tolerance along other rods.
const FINER: f64 = 1e-3;
const FINEST: f64 = 1e-14;
/// A rod that is shorter from end to end by less than this part of its length is all but straight, until it is shorter by so much.
const STRAIGHT: [f64; 2] = [1e-4, 1e-3];

/// A slider with a spring between the end of a rod and its attachment.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Give {
    /// c, in L^3/B; 0 where only the force along the rod is to stay as its end is brought back.
    pub compliance: f64,
    /// e, along the directors of the base, of length 1.
    pub along: Vector3<f64>,
}

impl Link {
    /// Lets the end of a rod that cannot stretch give way along it by what a motion of this tolerance, in lengths of the rod, does not see.
    pub fn allow(&mut self, tolerance: f64) {
        self.unseen = match self.rod.is_inextensible() {
            Ok(true) => UNSEEN * tolerance,
            _ => 0.0,
        };
    }

    /// Sets what stands between the end of the rod and its attachment.
    pub fn let_give(&mut self, give: Option<Give>) {
        self.give = give;
    }

    /// What stands between the end of the rod and its attachment.
    pub fn give(&self) -> Option<Give> {
        self.give
    }

    /// What should stand there, with hysteresis, by the end as it is now.
    pub fn better_give(&self, end: &LinkEnd) -> Option<Give> {
        if self.unseen == 0.0 && !self.felt || end.chord.is_some() || end.slack.is_some() {
            return None;
        }
        let own = end.pose.translation.vector - self.given(end);
        let distance = own.norm();
        if 1.0 - distance / self.rod.length() > STRAIGHT[usize::from(self.give.is_some())] {
            return None;
        }
        let along = own / distance;
        let held = self.give.filter(|give| give.compliance == 0.0);
        if self.felt {
            let (yields, again) = (self.yields(end, &along), usize::from(held.is_some()));
            if yields > SOFT[again] {
                return None;
            }
            if yields > RIGID[again] || self.unseen == 0.0 {
                let compliance = 0.0;
                return held.or(Some(Give { compliance, along }));
            }
        }
        let pull = along.dot(&end.tip_force()).abs() / self.units()[3];
        let stays = |give: &Give| give.compliance * pull <= KEPT * self.unseen;
        let slider = self.give.filter(|give| give.compliance > 0.0);
        slider.filter(stays).or_else(|| {
            Some(Give {
                compliance: (self.unseen / pull).min(MOST),
                along,
            })
        })
    }

    /// The tolerance along the rod for one of the motion. What its end does along itself follows from J to this part of what it yields there.
    pub(super) fn finer(&self, tolerance: f64) -> f64 {
        match self.give {
            Some(give) if give.compliance == 0.0 => (FINER * tolerance).max(FINEST).min(tolerance),
            _ => tolerance,
        }
    }

    /// How far a unit force along the rod moves its own end along itself, in L^3/B, its attachment holding it across: 0 where it is straight.
    fn yields(&self, end: &LinkEnd, along: &Vector3<f64>) -> f64 {
        let moved = joined(&Vector3::zeros(), along);
        let force = |q: Wrench| along.dot(&halves(&q).1);
        let pulled = self.regular(end).and_then(|factors| factors.solve(&moved));
        let slider = self.give.map_or(0.0, |give| give.compliance);
        pulled.map_or(0.0, |q| (1.0 / force(q) - slider).abs())
    }

    /// How far the end has given way.
    fn given(&self, end: &LinkEnd) -> Vector3<f64> {
        self.give
            .map_or_else(Vector3::zeros, |give| self.slid(&give) * end.tip_force())
    }

    /// c e e^T, a length by a force.
    fn slid(&self, give: &Give) -> Matrix3<f64> {
        let unit = self.rod.length() / self.units()[3];
        give.along * give.along.transpose() * (give.compliance * unit)
    }

    /// The change of the chart by which the end meets its attachment but for `gap` along the slider; the force along that stays.
    pub(super) fn moved_across(
        &self,
        give: &Give,
        end: &LinkEnd,
        gap: &Vector6<f64>,
    ) -> Option<Wrench> {
        let scale = self.gap_scale(end);
        let along = give.along * give.along.transpose();
        let across = Matrix3::identity() - along;
        let (mut equations, mut gap) = (scale * end.jacobian, scale * gap);
        let rows = across * equations.fixed_rows::<3>(3);
        equations.fixed_rows_mut::<3>(3).copy_from(&rows);
        let mut block = equations.fixed_view_mut::<3, 3>(3, 3);
        block += along;
        let rows = across * gap.fixed_rows::<3>(3);
        gap.fixed_rows_mut::<3>(3).copy_from(&rows);
        equations.full_piv_lu().solve(&gap)
    }

    /// The end of the rod with the spring behind it.
    pub(super) fn sprung(&self, mut end: LinkEnd) -> LinkEnd {
        let Some(give) = self.give.filter(|_| end.chord.is_none()) else {
            return end;
        };
        let (slid, force, unit) = (self.slid(&give), end.tip_force(), self.units()[3]);
        let way = slid * force;
        // m = m(1) - way x n(1), and by the force; the load is dead in the world: it turns the other way as the base turns, and n(1) = n(0) - load.
        let couple_by_force = force.cross_matrix() * slid - way.cross_matrix();
        end.pose.translation.vector += way;
        end.couple -= way.cross(&force);
        end.energy += 0.5 * way.dot(&force);
        let mut block = end.tangent.fixed_view_mut::<3, 3>(3, 3);
        block += slid * unit;
        let mut block = end.jacobian.fixed_view_mut::<3, 3>(3, 3);
        block += slid * unit;
        let mut block = end.resultants.fixed_view_mut::<3, 3>(6, 3);
        block += couple_by_force * unit;
        if self.joint == Joint::Ball {
            let mut block = end.jacobian.fixed_view_mut::<3, 3>(0, 3);
            block += couple_by_force * unit;
        }
        if let Some(along) = &mut end.along
            && self.base_turns()
        {
            let force_by_turn = -along.total.cross_matrix();
            let (moved, bent) = (slid * force_by_turn, couple_by_force * force_by_turn);
            let mut rows = along.turned.fixed_rows_mut::<3>(3);
            rows += moved;
            let mut rows = along.turned.fixed_rows_mut::<3>(6);
            rows += bent;
            let mut rows = along.prescribed.fixed_rows_mut::<3>(3);
            rows += moved;
            if self.joint == Joint::Ball {
                let mut rows = along.prescribed.fixed_rows_mut::<3>(0);
                rows += bent;
            }
        }
        end
    }
}
