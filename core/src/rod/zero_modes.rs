//! Zero modes: a continuous symmetry of an isotropic rod, by which it turns about its clamp for nothing (theory 3.1).
//!
//! The rod turns as a whole about the axis e of its clamp, and every section turns back about its own tangent by the
//! same angle: phi = e - d3. Isotropy keeps the energy of the rod, and a scene is symmetric if its loads and supports
//! are: dead loads along e, an end held on the axis with its tangent along e, or free. The base wrench then changes by
//! (e x m, e x n). This motion is known beforehand, so that no eigenvalue decides whether it counts.
//!
//! The equations of such an equilibrium are singular. Their Jacobian J maps the turn of the base wrench to 0. The
//! second variation is self-adjoint. Therefore J^T also maps a vector l to 0. Beside each held component of the end, l
//! has the change of the wrench by the turn; beside each loaded one it has the displacement, reversed. A pointer that
//! turns with the rod, (m1 + n1, m2 + n2) of the base wrench, keeps the direction that it had at the start of a branch.
//! Its deviation phi times l is added to the equations. They are then singular at true branch points alone.

use super::ivp::Wrench;
use super::problem::Trial;
use super::taut::Symmetry;
use super::{Plane, Problem};
use crate::math::se3::halves;
use nalgebra::{DMatrix, DVector, Matrix2xX, Matrix3, Vector2, Vector3};

/// Part of a direction that is rounding.
const ROUNDING: f64 = 1e-12;
/// Relative change of the base wrench below which the turn leaves the rod as it is: a straight rod.
const AT_REST: f64 = 1e-9;
/// Relative change of the force below which the turn keeps the force.
const KEPT: f64 = 1e-7;

/// Distance over the length, or angle, from the clamp's axis within which an end is on the axis, per part of the wrench
/// that bends the rod: stiff stubs stay near the axis.
const ON_AXIS: f64 = 1e-4;

/// The axis about which rods turn: d3 of the clamp, in the clamp's frame.
pub(super) const AXIS: Vector3<f64> = Vector3::new(0.0, 0.0, 1.0);

/// Effect of a rod's free turn about the axis of the clamp on the second variation.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) enum FreeTurn {
    /// The turn keeps the force: it is neutral while the force is given.
    AtGivenForce,
    /// The turn changes the force by this vector, and is neutral only while the place of the end is held.
    AtHeldPlace(Vector3<f64>),
}

/// A free turn in the unknowns x and equations of a chart.
#[derive(Debug, Clone, PartialEq)]
pub struct FreePhase {
    /// Combination l of the equations that the unknowns do not change.
    pub against: DVector<f64>,
    /// Pointer that turns with the rod.
    pub pointer: Vector2<f64>,
    /// Derivative of the pointer by x.
    pub by: Matrix2xX<f64>,
}

impl FreePhase {
    /// Adds an equation: the pointer keeps the direction `first`.
    pub fn hold(
        &self,
        first: &Vector2<f64>,
        residual: &mut DVector<f64>,
        jacobian: &mut DMatrix<f64>,
    ) {
        let size = jacobian.norm() / (jacobian.nrows() as f64).sqrt();
        let against = self.against.normalize() * size;
        let across = Vector2::new(-first.y, first.x);
        residual.axpy(across.dot(&self.pointer), &against, 1.0);
        jacobian.ger(1.0, &against, &self.by.tr_mul(&across), 1.0);
    }
}

/// A motion that costs nothing.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct ZeroMode {
    /// Axis of the turn, in the world.
    pub axis: Vector3<f64>,
}

impl std::fmt::Display for ZeroMode {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        let [x, y, z] = self.axis.map(|x| (1e9 * x).round() / 1e9 + 0.0).into();
        write!(
            f,
            "the rod turns for nothing about the axis ({x}, {y}, {z}) of its clamp"
        )
    }
}

impl Problem {
    /// Motions of the equilibrium with the base wrench `base` (world frame) that cost nothing, by the symmetry of the
    /// problem. They are left out of the index.
    pub fn zero_modes(&self, base: &Wrench) -> Vec<ZeroMode> {
        let turn = self.free_turn(&self.rod.inward(base));
        let axis = self.rod.clamp.rotation * AXIS;
        turn.map(|_| ZeroMode { axis }).into_iter().collect()
    }

    /// The turn about the clamp under a base wrench of the numerics; None without the symmetry, and if the turn leaves
    /// the rod as it is.
    pub(super) fn free_turn(&self, b: &Wrench) -> Option<FreeTurn> {
        let (m, n) = halves(b);
        let (couple, force) = (AXIS.cross(&m), AXIS.cross(&n));
        let size = 1.0 + b.norm();
        if couple.norm() + force.norm() <= AT_REST * size || !self.turns_freely_about_clamp() {
            return None;
        }
        Some(if force.norm() <= KEPT * size {
            FreeTurn::AtGivenForce
        } else {
            FreeTurn::AtHeldPlace(force)
        })
    }

    /// The phase of the free turn in the equations for the base wrench `b`; None without a free turn. `trial` is the
    /// end of the rod.
    pub(super) fn phase(&self, b: &Wrench, trial: &Trial) -> Option<FreePhase> {
        self.free_turn(b)?;
        let [turn, place] = self.phase_at_end(trial);
        let against = DVector::from_iterator(6, turn.iter().chain(&place).copied());
        let row = |i: usize, j: usize| f64::from(u8::from(j == i || j == 3 + i));
        let by = Matrix2xX::from_fn(6, row);
        (against.norm() > 0.0).then(|| FreePhase {
            against,
            pointer: &by * b,
            by,
        })
    }

    /// The equations of the end that a free turn leaves undetermined: those of its turn or couple, then those of its
    /// place or force, by world component.
    pub(super) fn phase_at_end(&self, trial: &Trial) -> [Vector3<f64>; 2] {
        let turned = AXIS - trial.rotation.column(2);
        let moved = AXIS.cross(&trial.r);
        if self.end.follower {
            let back = trial.rotation.transpose();
            return [-back * turned, -back * moved];
        }
        let turn = match self.orientation {
            Some(_) => AXIS.cross(&trial.m),
            None => -turned,
        };
        let pushed = AXIS.cross(&trial.n);
        let place = Vector3::from_fn(|i, _| {
            let held = self.end.position[i].is_some();
            self.axes[i].dot(&if held { pushed } else { -moved })
        });
        [turn, place]
    }

    /// True if the held place and directors of an end at `position` with d3 = `tangent` keep to the clamp's axis under
    /// the base wrench `b`. The index of a held end is also asked of problems that do not know where the end is held.
    pub(super) fn is_on_axis(
        &self,
        b: &Wrench,
        position: &Vector3<f64>,
        tangent: &Vector3<f64>,
    ) -> bool {
        let (m, n) = halves(b);
        let bent = AXIS.cross(&m).norm() + AXIS.cross(&n).norm();
        let near = ON_AXIS * bent.min(1.0);
        let held = (0..3).filter(|i| self.is_held()[*i]);
        let place: Vector3<f64> = held
            .map(|i| self.axes[i] * self.axes[i].dot(position))
            .sum();
        let turned = self.orientation.is_some() && (tangent - AXIS).norm() > near;
        place.xy().norm() <= near && !turned
    }

    /// Symmetries of the rod under the base wrench `b`, in units of the numerics. A planar rod stays in `plane`; `None`
    /// for a rod in space.
    pub(super) fn symmetry(&self, b: &Wrench, plane: Option<&Plane>) -> Symmetry {
        Symmetry {
            plane: plane.map(Plane::normal),
            turns: plane.is_none() && self.free_turn(b) == Some(FreeTurn::AtGivenForce),
        }
    }

    /// True if law, loads and supports stay the same under a turn about the clamp's axis: a bent rod turns for nothing.
    pub fn turns_freely_about_clamp(&self) -> bool {
        let along = |v: &Vector3<f64>| v.xy().norm() <= ROUNDING * (1.0 + v.norm());
        let ends = if self.end.follower {
            along(&self.couple) && along(&Vector3::from(self.targets))
        } else {
            let held = self.is_held();
            let part = |wanted: bool| -> Vector3<f64> {
                let those = (0..3).filter(|i| held[*i] == wanted);
                those.map(|i| self.axes[i] * self.targets[i]).sum()
            };
            // Held components: all, none, the one along the axis, or the two across it.
            let kept = (0..3).filter(|i| held[*i]);
            let kept: Matrix3<f64> = kept.map(|i| self.axes[i] * self.axes[i].transpose()).sum();
            let turned = AXIS.cross_matrix();
            let tip = match &self.orientation {
                Some(directors) => (directors.column(2) - AXIS).norm() <= ROUNDING,
                None => along(&self.couple),
            };
            (kept * turned - turned * kept).norm() <= ROUNDING
                && along(&part(true))
                && along(&part(false))
                && along(&self.arm)
                && tip
        };
        ends && self
            .weight
            .as_ref()
            .is_none_or(|weight| weight.is_along(&AXIS))
            && self.rod.law.is_axisymmetric()
    }
}
