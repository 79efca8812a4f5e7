//! Motions of the sections of light rods.
//!
//! A light rod follows its attachments through equilibria. The velocity of a section is the derivative of the
//! equilibrium along the present velocities of bodies, supports and chart: a symmetric difference of order 4 over
//! equilibria close by.

use super::body::BodyMotion;
use super::configuration::{Configuration, Evaluated};
use super::network::Assembly;
use crate::error::Result;
use crate::math::difference::derivative;
use crate::math::se3::{halves, join};
use crate::rod::RodSection;
use nalgebra::{Isometry3, Matrix6xX, UnitQuaternion, Vector3, Vector6};

/// Largest change of poses and charts over the step of the difference, in radians and lengths and relative to
/// 1 + |q|. Truncation and rounding then are below 1e-8 of the largest velocity.
const CHANGE: f64 = 1e-3;

/// A section of a rod in motion, in the world.
#[derive(Debug, Clone)]
pub struct MovingSection {
    /// Pose, strains and resultants.
    pub section: RodSection,
    /// (angular velocity, velocity); NaN at a fold, where velocities are infinite.
    pub twist: Vector6<f64>,
}

impl Assembly {
    /// Sections of rod `k` in motion at arclengths in growing order. Rods with a free end come after the others.
    ///
    /// # Errors
    /// As [`super::Link::end`].
    pub fn moving_sections(
        &self,
        at: &Evaluated,
        k: usize,
        arclengths: &[f64],
        tolerance: f64,
    ) -> Result<Vec<MovingSection>> {
        let t = at.integrals.time;
        let here = self.sections(t, &at.now, k, arclengths, tolerance)?;
        if let Some(rod) = k
            .checked_sub(self.links().len())
            .and_then(|k| self.free().get(k))
        {
            let base = rod.from.at(t, &at.now.bodies);
            return Ok(here
                .into_iter()
                .map(|section| riding(section, &base))
                .collect());
        }
        let twists = match self.step_and_rate(at, k) {
            None => None,
            Some((0.0, _)) => Some(Matrix6xX::zeros(here.len())),
            Some((step, rate)) => {
                let beside = |dt: f64| {
                    let now = moved(at, k, &rate, dt);
                    self.sections(t + dt, &now, k, arclengths, tolerance).ok()
                };
                derivative(step, |dt| Some(change(&beside(-dt)?, &beside(dt)?)))
            }
        };
        let twists = twists.unwrap_or_else(|| Matrix6xX::from_element(here.len(), f64::NAN));
        let each = here.into_iter().zip(twists.column_iter());
        Ok(each
            .map(|(section, twist)| MovingSection {
                section,
                twist: twist.into_owned(),
            })
            .collect())
    }

    /// Step of the differences, 0 at rest, and rate of the chart of rod `k`. `None` at a fold.
    fn step_and_rate(&self, at: &Evaluated, k: usize) -> Option<(f64, Vector6<f64>)> {
        let (link, point) = (&self.links()[k], &at.points[k]);
        let scale = link.gap_scale(&point.end);
        let rate = link.regular(&point.end)?.solve(&(scale * point.drive()))?;
        let chart = rate.norm() / (1.0 + at.now.charts[k].norm());
        let length = link.rod().length();
        let fastest = [&point.base, &point.tip].into_iter().map(|end| {
            let (spin, velocity) = halves(&end.twist);
            spin.norm() + velocity.norm() / length
        });
        let fastest = fastest.fold(chart, f64::max);
        let step = if fastest > 0.0 { CHANGE / fastest } else { 0.0 };
        step.is_finite().then_some((step, rate))
    }
}

/// Motion of a section of a rod that keeps its shape and moves rigidly with `base`.
fn riding(section: RodSection, base: &BodyMotion) -> MovingSection {
    let (spin, velocity) = halves(&base.twist);
    let lever = section.position - base.pose.translation.vector;
    MovingSection {
        twist: join(&spin, &(velocity + spin.cross(&lever))),
        section,
    }
}

/// The configuration after a time `dt` at constant velocities, with the chart of rod `k` at the rate `rate`.
fn moved(at: &Evaluated, k: usize, rate: &Vector6<f64>, dt: f64) -> Configuration {
    let mut now = at.now.clone();
    now.charts[k] += rate * dt;
    for body in &mut now.bodies {
        let (spin, velocity) = halves(&body.twist);
        body.pose = turned(&body.pose, &(spin * dt), &(velocity * dt));
    }
    if let Some(Some(spin)) = now.spins.get_mut(k) {
        let (base, tip) = (&at.points[k].base.pose, &at.points[k].tip.pose);
        let chord = tip.translation.vector - base.translation.vector;
        let turn = chord * (spin.rate * dt / chord.norm());
        spin.turn = UnitQuaternion::from_scaled_axis(turn) * spin.turn;
    }
    now
}

/// Turns and shifts of sections, by columns.
fn change(before: &[RodSection], after: &[RodSection]) -> Matrix6xX<f64> {
    let pairs = before.iter().zip(after).map(|(before, after)| {
        let turn = after.pose().rotation * before.pose().rotation.inverse();
        join(&turn.scaled_axis(), &(after.position - before.position))
    });
    Matrix6xX::from_columns(&pairs.collect::<Vec<_>>())
}

/// A pose after a turn about its origin and a shift.
fn turned(pose: &Isometry3<f64>, turn: &Vector3<f64>, shift: &Vector3<f64>) -> Isometry3<f64> {
    Isometry3::from_parts(
        (pose.translation.vector + shift).into(),
        UnitQuaternion::from_scaled_axis(*turn) * pose.rotation,
    )
}
