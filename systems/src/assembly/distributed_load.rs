//! Rods of an assembly under loads along them, such as their weight (theory 3.8).
//!
//! The base wrench (m(0), n(0)) stays the chart; n(1) = n(0) - int f, and m(1) follows. The load is dead in the
//! world. Seen from a base that turns by psi (on a body or a moving support), the load turns by -psi. Let E be the
//! derivative of the end by that rotation at fixed chart ([`crate::rod::LoadedEnd::by_turn`]). The end follows its
//! attachment if
//! ```text
//! J q' = xi - E omega,
//! ```
//! xi the twist of the attachment relative to the base and omega the spin of the base, along its directors. For a
//! ball joint the first rows are those of m(1), which stays 0. For a taut rod the turn also changes the dependent
//! m(0), and the force n(0) beside its spring. Rods between two ball joints rest on a force along their chord, and
//! have no load. Loads along the directors, such as pressure, turn with the base. What they take of n depends on the
//! chart. Their power is linear in q', in the spin of the base and in its velocity ([`crate::rod::LoadPower`]).

use super::attachment::AttachedTo;
use super::rod_element::{EndKind, Link, LinkEnd, LoadOnRod, LoadTerms, TurningLoads, seen_from};
use crate::error::Result;
use crate::math::se3::halves;
use crate::rod::{EndConditions, LoadPower, LoadedEnd, Problem, Wrench};
use nalgebra::{Matrix6, SMatrix, UnitQuaternion, Vector3};
use std::borrow::Cow;
use std::sync::Arc;

impl Link {
    /// The link with its base rotated to `base` in the world, for queries by chart and relative end pose. The
    /// rotation matters only for a load along the rod.
    pub fn with_base_rotation(&self, base: &UnitQuaternion<f64>) -> Cow<'_, Self> {
        if !(self.is_loaded() && self.base_turns()) {
            return Cow::Borrowed(self);
        }
        let mut link = self.clone();
        link.load = self.load.as_ref().map(|load| LoadOnRod {
            seen: seen_from(&load.world, base),
            world: load.world.clone(),
        });
        let turning = self.turning.as_ref();
        link.turning = turning.map(|loads| TurningLoads::on(&loads.world, base));
        Cow::Owned(link)
    }

    /// True if the base can turn: with its carrier, or, between two ball joints, with the chord.
    pub(super) fn base_turns(&self) -> bool {
        self.is_pinned() || !matches!(self.from.on, AttachedTo::Ground)
    }

    /// Equilibrium problem of the rod with an end condition, under its load.
    pub(super) fn bearing(&self, end: EndConditions, tolerance: f64) -> Result<Problem> {
        let problem = Problem::new(self.rod.clone(), end, tolerance)?;
        let problem = match self.borne() {
            Some(load) => problem.with_distributed(load),
            None => problem,
        };
        Ok(match &self.turning {
            Some(loads) => problem.with_followers(&loads.seen),
            None => problem,
        })
    }

    /// Equilibrium problem of the rod as an initial value problem from the base wrench, without an end condition.
    pub(super) fn base_wrench_problem(&self, tolerance: f64) -> Result<Problem> {
        let free = EndConditions::load(Vector3::zeros(), Vector3::zeros());
        self.bearing(free, tolerance)
    }

    /// [`Link::end`] under a load along the rod.
    pub(super) fn loaded_end(&self, q: &Wrench, tolerance: f64) -> Result<LinkEnd> {
        let units = self.units();
        let base = q.component_mul(&units);
        let (problem, turns) = (self.base_wrench_problem(tolerance)?, self.base_turns());
        let (found, trace) = if self.mass.is_none() {
            (problem.loaded_end(&base, turns)?, None)
        } else {
            let (found, trace) = problem.traced_loaded_end(&base, turns)?;
            (found, Some(Arc::new(trace)))
        };
        let LoadedEnd {
            section,
            tangent,
            couple,
            taken,
            potential,
            by_turn,
            power,
        } = found;
        let change = Matrix6::from_diagonal(&units);
        let (tangent, couple, taken) = (tangent * change, couple * change, taken * change);
        let mut resultants = SMatrix::<f64, 9, 6>::zeros();
        resultants.fixed_rows_mut::<6>(0).copy_from(&change);
        resultants.fixed_rows_mut::<3>(6).copy_from(&couple);
        let all = by_turn.unwrap_or_else(SMatrix::zeros);
        let turned = all.fixed_rows::<9>(0).into_owned();
        let mut prescribed = turned.fixed_rows::<6>(0).into_owned();
        let (mut jacobian, mut drive) = (tangent, Matrix6::identity());
        let kind = if self.joint().turns() {
            jacobian.fixed_rows_mut::<3>(0).copy_from(&couple);
            drive.fixed_rows_mut::<3>(0).fill(0.0);
            let rows = turned.fixed_rows::<3>(6);
            prescribed.fixed_rows_mut::<3>(0).copy_from(&rows);
            EndKind::OnBall { trace }
        } else {
            EndKind::Welded { trace }
        };
        let (m, n) = halves(&base);
        let dead = self.borne().map(|load| load.total(self.rod.length()));
        Ok(LinkEnd {
            pose: section.pose(),
            base_couple: m,
            couple: section.couple,
            force: n,
            along: Some(LoadTerms {
                total: n - section.force,
                dead: dead.unwrap_or_default(),
                potential,
                turned,
                force_turned: all.fixed_rows::<3>(9).into_owned(),
                taken,
                power: power.map(|power| LoadPower {
                    by_wrench: power.by_wrench * change,
                    ..power
                }),
                base: SMatrix::zeros(),
                prescribed,
            }),
            energy: section.energy,
            tangent,
            resultants,
            jacobian,
            drive,
            kind,
        })
    }
}
