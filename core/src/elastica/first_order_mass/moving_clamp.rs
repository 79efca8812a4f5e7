//! First-order inertia of the planar rod on a moving clamp.
//!
//! The clamp turns at the rate w and has the velocity d and the acceleration e; J is the rotation by a right angle. A
//! section at r(t), with the velocity v seen from the clamp, has the velocity v + w J r + d along the axes of the
//! clamp. Its acceleration there is r_tt + w' J r - w^2 r + 2 w J r_t + e. The end thus feels the force int P^T
//! (g - acceleration) ds. Besides the power of the force at the end the clamp supplies int (acceleration - g) .
//! (w J r + d) ds.

use super::end_inertia::{EndMotion, PlaceByChart, cross, dot, inertia_integrand, quarter_turn};
use super::{AtSection, ForceTurning, Heavy, OnEquilibria, RodInertia};
use crate::elastica::curvature::Swing;
use crate::manifold::EndInertia;
use crate::math::frame::Frame;
use crate::math::real::Real;
use nalgebra::{Matrix2, Vector2};

/// Contribution of a unit of the rod's mass where the clamp moves.
pub(super) struct MovingClampInertia {
    /// int P^T P ds.
    mass: Matrix2<f64>,
    force: Vector2<f64>,
    /// int P^T (w J r + d) ds.
    pull: Vector2<f64>,
    power: f64,
    /// Kinetic energy in the world.
    pub kinetic: f64,
    /// Centre of mass int r ds, seen from the clamp.
    pub centre: Vector2<f64>,
}

impl MovingClampInertia {
    /// Inertia of a rod of the mass `mass`.
    pub fn end_inertia(&self, mass: f64) -> EndInertia<2> {
        EndInertia {
            mass: self.mass * mass,
            force: self.force * mass,
            pull: self.pull * mass,
            power: self.power * mass,
        }
    }
}

/// Integrand on a moving clamp: [`inertia_integrand`], then the sums that frame velocity and acceleration need.
#[inline(always)]
pub(super) fn moving_clamp_integrand<T: Real>(field: &PlaceByChart<T>, left: &[T; 2]) -> [T; 20] {
    let [n11, n12, n22, f1, f2, turned] = inertia_integrand(field, left);
    let [w, p, l] = field;
    [
        n11,
        n12,
        n22,
        f1,
        f2,
        turned,
        p[0],
        p[1],
        l[0],
        l[1],
        w[0],
        w[1],
        left[0],
        left[1],
        dot(w, w),
        dot(p, w),
        dot(l, w),
        cross(p, w),
        cross(l, w),
        cross(w, left),
    ]
}

/// Integrand [`moving_clamp_integrand`].
struct Moved<'a>(&'a ForceTurning);

impl AtSection<20> for Moved<'_> {
    #[inline(always)]
    fn at<T: Real>(&self, rod: &RodInertia, part: T, here: &Swing<T>) -> [T; 20] {
        let field = rod.field(part, here);
        moving_clamp_integrand(&field, &self.0.difference_from_end(part, here))
    }
}

impl OnEquilibria for RodInertia {
    fn sums_with_weight(&self, v: &Vector2<f64>) -> Option<(EndMotion, [f64; 12])> {
        let (motion, turning) = self.end_motion(v)?;
        Some((motion, self.integrals(&Heavy(&turning))))
    }

    fn sums_on_moving_clamp(&self, v: &Vector2<f64>) -> Option<(EndMotion, [f64; 20])> {
        let (motion, turning) = self.end_motion(v)?;
        Some((motion, self.integrals(&Moved(&turning))))
    }
}

impl EndMotion {
    /// Inertia felt by end and clamp, from the sums of [`moving_clamp_integrand`].
    pub(super) fn moving_clamp_inertia(
        &self,
        sums: [f64; 20],
        v: &Vector2<f64>,
        gravity: &Vector2<f64>,
        frame: &Frame<2>,
    ) -> Option<MovingClampInertia> {
        let Self {
            turn,
            inverse,
            rate,
            end,
            spin,
            ..
        } = self;
        let [n11, n12, n22, f1, f2, p_l, p1, p2, l1, l2, x, y, a1, a2, ..] = sums;
        let [.., ww, pw, lw, p_w, l_w, w_a] = sums;
        let per = 1.0 / self.scale;
        let [turn_rate, turn_change] = frame.turning();
        let square = turn_rate * turn_rate;
        // Axes of the fields; r, r_p, r_l and r_tt (at constant q') carry the scale.
        let drift = self.in_field_axes(&frame.velocity_of_fixed_point(&Vector2::zeros()));
        let pushed =
            frame.inward(&(frame.acceleration_of_fixed_point(&Vector2::zeros()) - gravity));
        let pushed = self.in_field_axes(&pushed);
        let (by_p, by_l) = (Vector2::new(p1, p2), Vector2::new(l1, l2));
        let centre = Vector2::new(x, y) * per;
        let weight = Vector2::new(
            per * (turn_change * p_w + square * pw + 2.0 * turn_rate * p_l * rate[1])
                - by_p.dot(&pushed),
            per * (turn_change * l_w + square * lw - 2.0 * turn_rate * p_l * rate[0])
                - by_l.dot(&pushed),
        );
        let (mass, force) = self.mass_and_force([n11, n12, n22, f1, f2, p_l], &weight)?;
        let swept = Vector2::new(
            by_p.dot(&drift) - turn_rate * per * p_w,
            by_l.dot(&drift) - turn_rate * per * l_w,
        );
        let pull = inverse.tr_mul(&swept);
        // Power of the sections: first at constant q', then with the acceleration of the end. Terms of r_tt along r_t
        // are left out of both.
        let moved = (by_p * rate[0] + by_l * rate[1]) * per;
        let turning_rate = turn_rate + spin;
        let accelerations = [
            Vector2::new(a1, a2) * per,
            quarter_turn(&centre) * turn_change - centre * square,
            quarter_turn(&moved) * (2.0 * turning_rate),
            pushed,
        ];
        let turned =
            turn_rate * per * per * (w_a + 2.0 * turning_rate * (pw * rate[0] + lw * rate[1]));
        let all = accelerations.iter().sum::<Vector2<f64>>();
        let power = turned
            + turn_rate * (turn_change * ww * per * per + quarter_turn(&centre).dot(&pushed))
            + all.dot(&drift)
            - pull.dot(&(end * per));
        let (centre, pull) = (turn * centre, turn * pull);
        let still = 0.5
            * (square * ww * per * per
                + frame
                    .velocity_of_fixed_point(&Vector2::zeros())
                    .norm_squared())
            + turn_rate
                * quarter_turn(&centre).dot(&frame.velocity_of_fixed_point(&Vector2::zeros()));
        Some(MovingClampInertia {
            mass,
            force,
            pull,
            power,
            kinetic: 0.5 * v.dot(&(mass * v)) + v.dot(&pull) + still,
            centre,
        })
    }
}
