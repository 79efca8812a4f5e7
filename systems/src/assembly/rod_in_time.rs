//! Light rods whose section law varies in time: tensions of tendons, driven rest strains (theory 3.8).
//!
//! The end X(q, t) of such a rod moves even at a fixed chart q. The chart follows its attachment if
//!
//! ```text
//! J q' = xi - X_t.
//! ```
//!
//! The drive works at the rate `int W_t ds` ([`EndRates`]).

use super::rod_element::{EndKind, Link, LinkEnd};
use crate::error::Result;
use crate::math::se3::join;
use crate::rod::{EndRates, Wrench};
use crate::section::LawInTime;
use nalgebra::{UnitQuaternion, Vector3, Vector6};
use std::borrow::Cow;
use std::sync::Arc;

/// Effect of a drive at one moment, at a fixed chart.
#[derive(Debug, Clone, PartialEq)]
pub(super) struct DriveAtChart {
    /// Rates of the quantities in the rows of [`LinkEnd::jacobian`].
    pub rates: Vector6<f64>,
    /// Angular velocity of the end.
    pub turn: Vector3<f64>,
    /// Power of the drive.
    pub power: f64,
}

impl Link {
    /// Lets the section law of the rod vary in time. The rod keeps its chart by the base wrench at every pull.
    #[must_use]
    pub fn with_law_in_time(mut self, law: LawInTime) -> Self {
        self.in_time = Some(Arc::new(law));
        self
    }

    /// True if the section law of the rod varies in time.
    pub fn varies_in_time(&self) -> bool {
        self.in_time.is_some()
    }

    /// The link at time `t` with its base rotated to `base` in the world, for queries by chart and relative end pose.
    /// Rotation and time matter only for a load along the rod and for a section law in time.
    ///
    /// # Errors
    /// A section law that is not defined at this time.
    pub fn seen_at(&self, t: f64, base: &UnitQuaternion<f64>) -> Result<Cow<'_, Self>> {
        let mut seen = self.with_base_rotation(base);
        if let Some(in_time) = &self.in_time {
            let link = seen.to_mut();
            link.rod = link.rod.with_law(in_time.at(t)?)?;
        }
        Ok(seen)
    }

    /// The drive at time `t` of this link, which is seen at that time, with its end at the chart point q.
    pub(super) fn drive_at(
        &self,
        t: f64,
        q: &Wrench,
        end: &LinkEnd,
        tolerance: f64,
    ) -> Result<Option<DriveAtChart>> {
        if !self.in_time.as_ref().is_some_and(|law| law.moves(t)) {
            return Ok(None);
        }
        let (base, tolerance) = (q.component_mul(&self.units()), self.finer(tolerance));
        let EndRates {
            turn,
            position,
            couple,
            power,
        } = match self.load {
            None => self.rod.end_rates(&base, tolerance)?,
            Some(_) => self.base_wrench_problem(tolerance)?.end_rates(&base)?,
        };
        let rates = match &end.kind {
            EndKind::OnBall { .. } => join(&couple, &position),
            EndKind::Pinned {
                chord, per_couple, ..
            } => {
                let stretch = chord * chord.dot(&position);
                join(&Vector3::zeros(), &(stretch + couple * *per_couple))
            }
            EndKind::Welded { .. } | EndKind::Taut { .. } => join(&turn, &position),
        };
        Ok(Some(DriveAtChart { rates, turn, power }))
    }
}
