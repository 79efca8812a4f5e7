//! Rods of an assembly that are pulled taut: their charts hold the force, their attachments the rest.
//!
//! Beyond sqrt(n.r L/B) of about ten the base wrench loses digits as to where the end is, ten times as many at twice that. The
//! force n still charts the rod if its end is held as the attachment says, turned so or without couple: r(1), m(0) and m(1) follow from
//! [`crate::rod::Rod::taut`] and its derivatives. The six numbers of the chart stay the base wrench (m(0), n); the couple is one that
//! follows, its place in the equations
//! ```text
//! m(0) of the chart = m(0)(n, turn of the end),     place of the end = r(1)(n, turn of the end).
//! ```

use super::{Joint, Link, LinkEnd};
use crate::error::Result;
use crate::math::se3::halves;
use crate::rod::{RodSection, Taut, Tip, Wrench};
use nalgebra::{Isometry3, Matrix3, Matrix6, SMatrix, Vector3};
use std::sync::Mutex;

/// (L/B) n.r(1) beyond which a rod is taut, and below which it is slack again.
const TAUT: f64 = 100.0;
const SLACK: f64 = 64.0;

/// What the chart of a rod stands for.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub enum Seen {
    /// Whichever is better under its pull.
    #[default]
    ByPull,
    /// Its base wrench.
    FromBase,
    /// Its force.
    Taut,
}

/// The taut rod that was found last, to begin the next with. A copy of a link begins anew.
#[derive(Debug, Default)]
pub(super) struct Warm(Mutex<Option<Taut>>);

impl Clone for Warm {
    fn clone(&self) -> Self {
        Self::default()
    }
}

impl Warm {
    fn taken(&self) -> Option<Taut> {
        self.0.lock().ok()?.take()
    }

    fn keep(&self, found: &Taut) {
        if let Ok(mut kept) = self.0.lock() {
            *kept = Some(found.clone());
        }
    }
}

impl Link {
    /// Says what the chart stands for; until then the pull decides.
    pub fn seen_as(&mut self, seen: Seen) {
        self.seen = seen;
    }

    /// (L/B) n.r(1), of a rod that holds its end at `held`.
    fn pull(&self, q: &Wrench, held: &Isometry3<f64>) -> f64 {
        halves(q).1.dot(&held.translation.vector) / self.rod.length()
    }

    /// What its chart stands for.
    pub fn seen(&self) -> Seen {
        self.seen
    }

    /// What its chart should stand for, with hysteresis.
    pub fn better_seen(&self, q: &Wrench, held: &Isometry3<f64>) -> Seen {
        if self.joint == Joint::Pins {
            return Seen::FromBase;
        }
        let border = if self.seen == Seen::Taut { SLACK } else { TAUT };
        if self.pull(q, held) > border {
            Seen::Taut
        } else {
            Seen::FromBase
        }
    }

    pub(super) fn is_taut(&self, q: &Wrench, held: &Isometry3<f64>) -> bool {
        if self.joint == Joint::Pins {
            return false;
        }
        match self.seen {
            Seen::ByPull => self.pull(q, held) > TAUT,
            seen => seen == Seen::Taut,
        }
    }

    /// The end under the chart point q with the attachment at `held`, both seen from the base.
    ///
    /// # Errors
    /// As [`crate::rod::Rod::end`] and [`crate::rod::Rod::taut`].
    pub fn held(&self, q: &Wrench, held: &Isometry3<f64>, tolerance: f64) -> Result<LinkEnd> {
        if !self.is_taut(q, held) {
            return self.end(q, tolerance);
        }
        let found = self.pulled(q, held, tolerance)?;
        let units = self.units();
        let (couple, force) = (units[0], units[3]);
        let (by_force, by_tip) = (&found.by_force, &found.by_tip);
        let mut resultants = SMatrix::<f64, 9, 6>::zeros();
        let mut turned = None;
        let mut tangent = Matrix6::zeros();
        let mut jacobian = Matrix6::zeros();
        let mut drive = Matrix6::identity();
        let unit = Matrix3::identity();
        for (row, by) in [
            (0, &by_force.base_couple),
            (3, &unit),
            (6, &by_force.couple),
        ] {
            resultants
                .fixed_view_mut::<3, 3>(row, 3)
                .copy_from(&(by * force));
        }
        for (row, by) in [(0, &by_force.turn), (3, &by_force.position)] {
            tangent
                .fixed_view_mut::<3, 3>(row, 3)
                .copy_from(&(by * force));
        }
        jacobian.fixed_view_mut::<3, 3>(0, 0).fill_diagonal(couple);
        jacobian
            .fixed_view_mut::<3, 3>(0, 3)
            .copy_from(&(by_force.base_couple * -force));
        jacobian
            .fixed_view_mut::<3, 3>(3, 3)
            .copy_from(&(by_force.position * force));
        drive.fixed_rows_mut::<3>(0).fill(0.0);
        if self.joint == Joint::Weld {
            let mut by_turn = SMatrix::<f64, 9, 3>::zeros();
            for (row, by) in [(0, &by_tip.base_couple), (6, &by_tip.couple)] {
                by_turn.fixed_view_mut::<3, 3>(row, 0).copy_from(by);
            }
            turned = Some(by_turn);
            for (row, by) in [(0, by_tip.base_couple), (3, -by_tip.position)] {
                drive.fixed_view_mut::<3, 3>(row, 0).copy_from(&by);
            }
        }
        let m = halves(&found.base).0;
        Ok(LinkEnd {
            pose: found.end.pose(),
            base_couple: m,
            couple: found.end.couple,
            force: found.end.force,
            energy: found.end.energy,
            tangent,
            resultants,
            turned,
            jacobian,
            drive,
            per_couple: 0.0,
            chord: None,
            slack: Some(m - halves(q).0 * couple),
        })
    }

    /// The taut rod, begun from the last one.
    pub(super) fn pulled(&self, q: &Wrench, held: &Isometry3<f64>, tolerance: f64) -> Result<Taut> {
        let tip = match self.joint {
            Joint::Weld => Tip::Turned(*held.rotation.to_rotation_matrix().matrix()),
            Joint::Ball | Joint::Pins => Tip::Loaded {
                couple: Vector3::zeros(),
                arm: Vector3::zeros(),
            },
        };
        let base = q.component_mul(&self.units());
        let last = self.warm.taken();
        let found = self.rod.taut(&base, &tip, last.as_ref(), tolerance)?;
        self.warm.keep(&found);
        Ok(found)
    }

    /// Sections at the arclengths `at`, in growing order, in the directors of the base, of the rod whose attachment is at `held`.
    ///
    /// # Errors
    /// As [`Link::held`].
    pub fn shape(
        &self,
        q: &Wrench,
        held: &Isometry3<f64>,
        at: &[f64],
        tolerance: f64,
    ) -> Result<Vec<RodSection>> {
        if self.is_taut(q, held) {
            let found = self.pulled(q, held, tolerance)?;
            return self.rod.taut_shape(&found, at, tolerance);
        }
        self.rod
            .shape(&q.component_mul(&self.units()), at, tolerance)
    }
}
