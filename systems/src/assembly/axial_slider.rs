//! Compliant sliders at the ends of nearly straight inextensible rods.
//!
//! A rod that cannot stretch, bent by angles of size b, is shorter from end to end by some s = b^2. Its compliance
//! along itself is proportional to s. For the straight rod the axial force is a constraint. Near it the axial force
//! is decided by rounding of the end's position, and vibrates with frequency 1/b: an artefact. As long as s is small,
//! the end therefore sits on a slider with a spring, along the direction e of the rod when the slider was set:
//! ```text
//! r = r(1) + c (e.n(1)) e,     m = m(1) - (r - r(1)) x n(1),     the spring stores c (e.n(1))^2/2,
//! ```
//! The travel c |e.n(1)| is at most UNSEEN of the tolerance, in rod lengths, when the slider is set; after a step
//! that ends with KEPT times as much it is set anew. The compliance across the rod is unchanged.
//!
//! A rod with inertia is swayed by its end. If the end moves along the rod at v, the force changes at v/(y + c), with
//! y the axial compliance by bending alone. The kinetic energy goes with the square of that rate. The slider's effect
//! c on the position is invisible, its effect c/y on the rate is not. With its mass the rod also vibrates no faster as
//! it straightens. Such a rod has no slider unless y is next to nothing. An integration error in y acts like a
//! slider, whether the rod can stretch or not: where y is small the rod is integrated more accurately, and a drifted
//! end is corrected by moving the body along the rod, not by the force.

use super::rod_element::{EndKind, EndSlider, Link, LinkEnd};
use crate::math::se3::{halves, join};
use crate::rod::Wrench;
use nalgebra::{Matrix3, Vector3, Vector6};

/// Largest travel of the slider when set, as part of the tolerance; the slider is reset beyond KEPT times that.
const UNSEEN: f64 = 0.1;
const KEPT: f64 = 3.0;
/// Largest compliance of a slider, in L^3/B.
const MAX_COMPLIANCE: f64 = 1e-7;
/// Axial compliance y, in L^3/B, above which a rod with inertia has no compliant slider. With hysteresis: the
/// second bound holds while a slider of compliance 0 is set, the first otherwise.
const RIGID: [f64; 2] = [1e-8, 5e-9];
/// Axial compliance y above which a rod with inertia has no slider at all, with the same hysteresis.
const SOFT: [f64; 2] = [1e-4, 2e-4];
/// Integration tolerance along the rod for y between RIGID and SOFT, as part of the usual one, and its floor.
const FINER: f64 = 1e-3;
const FINEST: f64 = 1e-14;
/// A rod counts as nearly straight below the first relative shortening, and ceases to above the second.
const STRAIGHT: [f64; 2] = [1e-4, 1e-3];

impl Link {
    /// Lets the end of an inextensible rod give way along the rod by less than a motion of this tolerance, in rod
    /// lengths, can resolve.
    pub fn allow(&mut self, tolerance: f64) {
        self.unseen = match self.rod.is_inextensible() {
            Ok(true) => UNSEEN * tolerance,
            _ => 0.0,
        };
    }

    /// Slider that suits the present end, with hysteresis.
    pub fn suited_slider(&self, end: &LinkEnd) -> Option<EndSlider> {
        if self.unseen == 0.0 && !self.is_followed() || end.chord().is_some() || end.is_taut() {
            return None;
        }
        let set = self.chart.slider();
        let own = end.pose.translation.vector - self.slider_travel(end);
        let distance = own.norm();
        if 1.0 - distance / self.rod.length() > STRAIGHT[usize::from(set.is_some())] {
            return None;
        }
        let along = own / distance;
        let held = set.filter(|slider| slider.compliance == 0.0);
        if self.is_followed() {
            let (yields, again) = (
                self.axial_compliance(end, &along),
                usize::from(held.is_some()),
            );
            if yields > SOFT[again] {
                return None;
            }
            if yields > RIGID[again] || self.unseen == 0.0 {
                let compliance = 0.0;
                return held.or(Some(EndSlider { compliance, along }));
            }
        }
        let pull = along.dot(&end.tip_force()).abs() / self.units()[3];
        let stays = |slider: &EndSlider| slider.compliance * pull <= KEPT * self.unseen;
        let slider = set.filter(|slider| slider.compliance > 0.0);
        slider.filter(stays).or_else(|| {
            Some(EndSlider {
                compliance: (self.unseen / pull).min(MAX_COMPLIANCE),
                along,
            })
        })
    }

    /// Tolerance of integration along the rod. Tightened so that the axial motion of the end is right to FINER of its
    /// axial compliance.
    pub(super) fn finer(&self, tolerance: f64) -> f64 {
        match self.chart.slider() {
            Some(slider) if slider.compliance == 0.0 => {
                (FINER * tolerance).max(FINEST).min(tolerance)
            }
            _ => tolerance,
        }
    }

    /// Axial compliance of the rod's own end, in L^3/B, with the attachment holding the end across: 0 for a straight
    /// rod.
    fn axial_compliance(&self, end: &LinkEnd, along: &Vector3<f64>) -> f64 {
        let moved = join(&Vector3::zeros(), along);
        let force = |q: Wrench| along.dot(&halves(&q).1);
        let pulled = self.regular(end).and_then(|factors| factors.solve(&moved));
        let slider = self.chart.slider().map_or(0.0, |slider| slider.compliance);
        pulled.map_or(0.0, |q| (1.0 / force(q) - slider).abs())
    }

    /// Travel of the end on its slider.
    fn slider_travel(&self, end: &LinkEnd) -> Vector3<f64> {
        let slider = self.chart.slider();
        slider.map_or_else(Vector3::zeros, |slider| {
            self.slid(&slider) * end.tip_force()
        })
    }

    /// c e e^T, a length by a force.
    fn slid(&self, slider: &EndSlider) -> Matrix3<f64> {
        let unit = self.rod.length() / self.units()[3];
        slider.along * slider.along.transpose() * (slider.compliance * unit)
    }

    /// Chart correction that closes the `gap` between end and attachment, except for its part along the slider; the
    /// force along the slider stays.
    pub(super) fn moved_across(
        &self,
        slider: &EndSlider,
        end: &LinkEnd,
        gap: &Vector6<f64>,
    ) -> Option<Wrench> {
        let scale = self.gap_scale(end);
        let along = slider.along * slider.along.transpose();
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

    /// End of the rod with the slider's spring behind it.
    pub(super) fn with_slider(&self, mut end: LinkEnd) -> LinkEnd {
        let Some(slider) = self.chart.slider().filter(|_| end.chord().is_none()) else {
            return end;
        };
        let (slid, force, unit) = (self.slid(&slider), end.tip_force(), self.units()[3]);
        let on_ball = matches!(end.kind, EndKind::OnBall { .. });
        let way = slid * force;
        // m = m(1) - way x n(1), and its derivative by the force. The load is dead in the world: it turns the other
        // way as the base turns, and n(1) = n(0) - load.
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
        if on_ball {
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
            if on_ball {
                let mut rows = along.prescribed.fixed_rows_mut::<3>(0);
                rows += bent;
            }
        }
        end
    }
}
