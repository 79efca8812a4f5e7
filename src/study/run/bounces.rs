//! Bounces of taut rods in a run: storage and words.

use super::outward::RunBounce;
use crate::scene::Units;

/// Number of bounces stored individually.
const KEPT: usize = 1000;

/// Bounces of a branch.
#[derive(Debug, Clone, Default)]
pub struct Bounces {
    /// The first KEPT bounces.
    pub first: Vec<RunBounce>,
    /// Number of bounces.
    pub count: usize,
    /// The bounce that friction would change most.
    pub hardest: Option<RunBounce>,
}

impl Bounces {
    /// Adds a bounce; true if the bounce is stored individually.
    pub(super) fn add(&mut self, bounce: RunBounce) -> bool {
        self.count += 1;
        let softer = |other: &RunBounce| other.friction_time <= bounce.friction_time;
        if !self.hardest.as_ref().is_some_and(softer) {
            self.hardest = Some(bounce.clone());
        }
        let stored = self.first.len() < KEPT;
        if stored {
            self.first.push(bounce);
        }
        stored
    }

    /// Number of bounces in these branches, and the one most sensitive to friction.
    pub fn of<'a>(
        branches: impl Iterator<Item = &'a Self> + Clone,
    ) -> Option<(usize, &'a RunBounce)> {
        let hardest = branches.clone().filter_map(|b| b.hardest.as_ref());
        let hardest = hardest.min_by(|a, b| a.friction_time.total_cmp(&b.friction_time))?;
        Some((branches.map(|b| b.count).sum(), hardest))
    }

    /// Remark on the effect of friction on the bounces: for a single planar rod in terms of the viscosity, otherwise
    /// of viscosity over stiffness.
    pub(super) fn text<'a>(
        branches: impl Iterator<Item = &'a Self> + Clone,
        units: Units,
        planar: bool,
    ) -> Option<String> {
        let (count, hardest) = Self::of(branches)?;
        let (viscosity, bound, unit) = if planar {
            ("viscosity", hardest.viscosity, " N m^2 s")
        } else {
            ("viscosity/stiffness", hardest.friction_time, " s")
        };
        let unit = match units {
            Units::Dimensionless => "",
            Units::Si => unit,
        };
        Some(format!(
            "{count} {} at full reach (lambda up to {:.3e}). They are elastic only if the rod's {viscosity} << {bound:.1e}{unit}; \
             otherwise set the rod's `damping`",
            if count == 1 { "bounce" } else { "bounces" },
            hardest.lambda,
        ))
    }
}
