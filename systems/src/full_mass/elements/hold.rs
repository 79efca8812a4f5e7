//! Springs that hold a site near the poses that a joint with axes, a groove or a plane leaves free.
//!
//! The elements know welds and ball joints alone. In a descent a stiff spring stands for every other constraint. With
//! the gap g from the nearest allowed pose, a rotation vector and a shift, a spring has the energy
//! ```text
//! E = (k g_turn^2 + K g_shift^2)/2 + potential of the laws of the joint.
//! ```
//! Derivatives are differences of g: the energy of a stiff spring itself is too large beside its changes.

use super::system::Moving;
use crate::assembly::Guide;
use crate::body::Groove;
use nalgebra::{Isometry3, SMatrix, SVector, UnitQuaternion, Vector3, Vector6};

/// Steps of the differences that give first and second derivatives, in radians and units of length.
const FIRST: f64 = 1e-4;
const SECOND: f64 = 1e-3;

/// Displacements of the site and of the carrier of its joint, each a turn and a shift.
pub(super) const SIDES: usize = 12;
pub(super) type Sides = SVector<f64, SIDES>;

/// Constraint of a site.
#[derive(Debug, Clone)]
pub(super) enum Confinement {
    /// A joint with axes, or a plane.
    Guide(Guide),
    /// A groove of the world.
    Groove(Groove),
}

/// A spring between a site and the poses that a groove, plane or joint leaves free.
#[derive(Debug, Clone)]
pub(super) struct Hold {
    pub site: usize,
    pub by: Confinement,
    /// Stiffness against turns and against shifts.
    pub couple: f64,
    pub force: f64,
}

/// Gap (turn, shift) from the nearest allowed pose, and the potential of the laws.
struct Apart {
    gap: Vector6<f64>,
    potential: f64,
}

fn moved(pose: &Isometry3<f64>, by: &Vector6<f64>) -> Isometry3<f64> {
    let turn = UnitQuaternion::from_scaled_axis(by.fixed_rows::<3>(0).into_owned());
    let shift = by.fixed_rows::<3>(3).into_owned();
    Isometry3::from_parts(
        (pose.translation.vector + shift).into(),
        turn * pose.rotation,
    )
}

impl Hold {
    /// Site that carries the joint; None on the ground.
    pub fn carrier(&self) -> Option<usize> {
        match &self.by {
            Confinement::Guide(guide) => guide.parent(),
            Confinement::Groove(_) => None,
        }
    }

    fn apart(&self, sites: &[Moving], by: &Sides) -> Apart {
        let pose = moved(
            &sites[self.site].pose(),
            &by.fixed_rows::<6>(0).into_owned(),
        );
        match &self.by {
            Confinement::Groove(groove) => {
                let place = pose.translation.vector;
                let off = place - groove.at(groove.nearest(&place))[0];
                let mut gap = Vector6::zeros();
                gap.fixed_rows_mut::<3>(3).copy_from(&off);
                Apart {
                    gap,
                    potential: 0.0,
                }
            }
            Confinement::Guide(guide) => {
                let frame = match self.carrier() {
                    None => guide.frame(0.0, &[]),
                    Some(carrier) => {
                        let by = by.fixed_rows::<6>(6).into_owned();
                        moved(&sites[carrier].pose(), &by) * guide.on().place
                    }
                };
                let allowed = guide.pose(&frame, &guide.coordinates(&frame, &pose));
                let turn = (pose.rotation * allowed.rotation.inverse()).scaled_axis();
                let shift = pose.translation.vector - allowed.translation.vector;
                Apart {
                    gap: crate::math::se3::join(&turn, &shift),
                    potential: guide.potential(&frame, &pose),
                }
            }
        }
    }

    /// Number of the displacements on which the gap depends.
    fn sides(&self) -> usize {
        if self.carrier().is_some() { SIDES } else { 6 }
    }

    fn weighed(&self, gap: &Vector6<f64>) -> Vector6<f64> {
        Vector6::from_fn(|i, _| gap[i] * if i < 3 { self.couple } else { self.force })
    }

    /// Derivative of the energy by the displacements, and the energy.
    pub fn pull(&self, sites: &[Moving]) -> (Sides, f64) {
        let here = self.apart(sites, &Sides::zeros());
        let forces = self.weighed(&here.gap);
        let mut gradient = Sides::zeros();
        for side in 0..self.sides() {
            let [ahead, behind] =
                [FIRST, -FIRST].map(|step| self.apart(sites, &(Sides::ith(side, step))));
            gradient[side] = (forces.dot(&(ahead.gap - behind.gap)) + ahead.potential
                - behind.potential)
                / (2.0 * FIRST);
        }
        (gradient, 0.5 * forces.dot(&here.gap) + here.potential)
    }

    /// Derivative of the gradient. The components of the gradient turn with the site.
    pub fn stiffness(&self, sites: &[Moving]) -> SMatrix<f64, SIDES, SIDES> {
        let here = self.apart(sites, &Sides::zeros());
        let forces = self.weighed(&here.gap);
        let count = self.sides();
        let mut slopes = SMatrix::<f64, 6, SIDES>::zeros();
        let mut gradient = Sides::zeros();
        // Energy of a displacement with the forces of the spring held constant.
        let worth = |by: Sides| {
            let at = self.apart(sites, &by);
            forces.dot(&at.gap) + at.potential
        };
        for side in 0..count {
            let [ahead, behind] =
                [FIRST, -FIRST].map(|step| self.apart(sites, &Sides::ith(side, step)));
            let slope = (ahead.gap - behind.gap) / (2.0 * FIRST);
            slopes.set_column(side, &slope);
            let by_law = (ahead.potential - behind.potential) / (2.0 * FIRST);
            gradient[side] = forces.dot(&slope) + by_law;
        }
        let mut second = SMatrix::<f64, SIDES, SIDES>::zeros();
        for a in 0..count {
            for b in 0..=a {
                let [one, other] = [Sides::ith(a, SECOND), Sides::ith(b, SECOND)];
                let bent = worth(one + other) - worth(one - other) - worth(other - one)
                    + worth(-one - other);
                let bent = bent / (4.0 * SECOND * SECOND);
                (second[(a, b)], second[(b, a)]) = (bent, bent);
            }
        }
        let mut weighed = slopes;
        for (i, mut row) in weighed.row_iter_mut().enumerate() {
            row *= if i < 3 { self.couple } else { self.force };
        }
        second += slopes.tr_mul(&weighed);
        // A turn also turns the axes of the couple.
        for first in [0, 6] {
            let couple = Vector3::new(gradient[first], gradient[first + 1], gradient[first + 2]);
            let mut block = second.fixed_view_mut::<3, 3>(first, first);
            block -= couple.cross_matrix() * 0.5;
        }
        second
    }
}
