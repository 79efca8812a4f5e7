//! Snaps: jumps at a fold, at which pose and velocity of the end stay while the rod falls to another
//! equilibrium (theory 2.6).

use super::state::planar;
use nalgebra::{DVector, SVector, UnitQuaternion};
use snaprod_systems::assembly::Configuration;
use snaprod_systems::elastica::{Elastica, LayerShape};
use snaprod_systems::error::Result;
use snaprod_systems::manifold::{Multivalued, Sheet, adjugate_times, fold_kernel};
use snaprod_systems::rod::Fallen;

/// Rule for the landing of a rod at a fold.
#[derive(Debug, Clone, Copy, Default, PartialEq, Eq)]
#[cfg_attr(
    feature = "serde",
    derive(serde::Serialize),
    serde(rename_all = "lowercase")
)]
pub enum LandingRule {
    /// The landing of the fast viscous layer: unique at a regular fold.
    #[default]
    Viscous,
    /// The stable equilibrium of lowest energy.
    Lowest,
    /// Every stable equilibrium with no more energy than the fold: the run branches.
    All,
    /// The stable equilibrium of this sheet with no more energy than the fold; of several, the one of lowest energy.
    #[cfg_attr(feature = "serde", serde(untagged))]
    Named(Sheet),
    /// The stable equilibrium of this rank by energy, among those with no more energy than the fold; 1 is the
    /// lowest. Ranks tell landings apart where equilibria have no names.
    #[cfg_attr(feature = "serde", serde(untagged))]
    Ordered {
        /// The rank, from 1.
        order: usize,
    },
}

impl LandingRule {
    /// Selects from the possible landings, sorted by energy: one, unless the rule is `All`. `sheet` names
    /// them. `Viscous` makes no choice; the lowest stands for its landing.
    pub(super) fn chosen<T>(
        self,
        mut stable: Vec<T>,
        sheet: impl Fn(&T) -> Option<Sheet>,
    ) -> Vec<T> {
        match self {
            Self::All => return stable,
            Self::Named(wanted) => stable.retain(|at| sheet(at) == Some(wanted)),
            Self::Ordered { order } => {
                stable.drain(..order.saturating_sub(1).min(stable.len()));
            }
            Self::Viscous | Self::Lowest => {}
        }
        stable.truncate(1);
        stable
    }
}

/// One end of a snap.
#[derive(Debug, Clone, PartialEq)]
pub struct SnapEnd {
    /// Chart point, for the elastica (p, w).
    pub q: DVector<f64>,
    /// Sheet; None in models that do not name sheets.
    pub sheet: Option<Sheet>,
    /// Morse index; at the fold, on the side of the approach.
    pub index: usize,
    /// Stored energy.
    pub elastic: f64,
}

/// A snap: a jump of the rod at a fold.
#[derive(Debug, Clone, PartialEq)]
pub struct Snap {
    /// Time.
    pub t: f64,
    /// Uncertainty of the time from locating the fold, without the integration's own error.
    pub time_error: f64,
    /// Pose at the snap, continuous across it. For elastic rods in space, the position of the end along the
    /// directors of the base.
    pub pose: DVector<f64>,
    /// Velocity at the snap, continuous across it.
    pub velocity: DVector<f64>,
    /// The fold.
    pub from: SnapEnd,
    /// The landing.
    pub to: SnapEnd,
    /// Energy dissipated in the layer: elastic before minus after.
    pub released: f64,
    /// Number of the rod that jumps, in an assembly; 0 for one rod.
    pub rod: usize,
    /// Coordinates of the joints with axes of the rod at the landing, in an assembly; else none.
    pub joints: Vec<f64>,
    /// Rotation of the base of the rod in the frame of the motion.
    pub base: UnitQuaternion<f64>,
    /// Number of stable equilibria with no more energy than the fold; None under the rule `Viscous`, which
    /// does not choose. In the plane all are counted, in space those that were found.
    pub choices: Option<usize>,
    /// True if the fast viscous layer leads to this landing, false if to another; None if the layer did not settle.
    pub reached: Option<bool>,
    /// The bodies and charts of an assembly at the fold; None in a plane.
    pub moving: Option<Box<Configuration>>,
}

/// Largest chart distance, relative to 1 + norm, between the landing of a layer and of the snap.
const SAME: f64 = 1e-6;

impl Snap {
    /// Shapes of a planar elastica during this snap, in the frame and the units of its clamp. None for other
    /// rods, and if another rule than the layer chose the landing.
    pub(super) fn fall(&self) -> Option<Vec<Fallen>> {
        self.from.sheet?;
        let [p, w] = *self.from.q.as_slice() else {
            return None;
        };
        let from = SVector::from([p, w]);
        let (leaving, _) = fold_sides(&Elastica, &from).ok()?;
        let (shapes, landed) = Elastica.layer(&from, &leaving).ok()?;
        let placed = |shape: LayerShape| {
            let sections = shape.sections.iter();
            let sections = sections.map(|[x, y, theta]| planar(*x, *y, *theta));
            (shape.elastic, sections.collect())
        };
        self.lands(landed.as_slice())
            .then(|| shapes.into_iter().map(placed).collect())
    }

    /// True if the chart point `landed` of a layer is the landing of this snap.
    pub(super) fn lands(&self, landed: &[f64]) -> bool {
        let (to, landed) = (&self.to.q, DVector::from_column_slice(landed));
        to.len() == landed.len() && (&landed - to).norm() < SAME * (1.0 + to.norm())
    }
}

/// Relative change of the force from a fold to the points at which its two sides are distinguished.
const ASIDE: f64 = 1e-4;

/// A vector along `kernel` that leads far enough from the fold `q` to distinguish its sides, and no farther
/// than the force follows. Chart lengths mean nothing where the chart is stretched, but at a fold the force
/// must change along the kernel, for (pose, force) is an immersion.
pub fn aside<const N: usize>(
    manifold: &impl Multivalued<N>,
    q: &SVector<f64, N>,
    force: &SVector<f64, N>,
    kernel: &SVector<f64, N>,
) -> SVector<f64, N> {
    let mut step = kernel * ASIDE;
    let near = |step: &SVector<f64, N>| {
        [q + step, q - step].iter().all(|beside| {
            manifold
                .point(beside)
                .is_some_and(|p| (p.force - force).norm() <= 4.0 * ASIDE * (force.norm() + 1e-300))
        })
    };
    while !near(&step) && step.norm() > 4.0 * f64::EPSILON * (1.0 + q.norm()) {
        step *= 0.5;
    }
    step
}

/// The two sides of a fold: its kernel, directed to the side of higher index, and the index of the
/// lower side.
///
/// # Errors
/// No simple fold at `q`.
pub fn fold_sides<const N: usize>(
    manifold: &impl Multivalued<N>,
    q: &SVector<f64, N>,
) -> Result<(SVector<f64, N>, usize)> {
    let at = manifold
        .point(q)
        .ok_or_else(|| crate::Error::domain("the fold lies outside the chart"))?;
    let kernel = fold_kernel(&at.jacobian)?;
    let step = aside(manifold, q, &at.force, &kernel);
    let ahead = manifold.index(&(q + step))?;
    let behind = manifold.index(&(q - step))?;
    Ok(if ahead >= behind {
        (kernel, behind)
    } else {
        (-kernel, ahead)
    })
}

/// The landings that a rule allows.
#[derive(Debug, Clone)]
pub struct Landings<T> {
    /// Landings with their [`Snap::reached`]: one, unless the rule is `All`; empty if no stable equilibrium is left.
    pub at: Vec<(T, Option<bool>)>,
    /// Number of possible landings, as [`Snap::choices`].
    pub choices: Option<usize>,
}

impl<T> Landings<T> {
    /// The landing to which the viscous layer leads.
    pub fn viscous(at: T) -> Self {
        Self {
            at: vec![(at, Some(true))],
            choices: None,
        }
    }

    /// The candidates in `all`, sorted by energy, that the rule allows; `sheet` gives the sheet of a candidate.
    pub fn chosen(
        rule: LandingRule,
        all: Vec<(T, Option<bool>)>,
        sheet: impl Fn(&T) -> Option<Sheet>,
    ) -> Self {
        let choices = Some(all.len());
        let at = rule.chosen(all, |(at, _)| sheet(at));
        Self { at, choices }
    }
}

/// The landings that the rule allows from the degenerate equilibrium `q`.
///
/// # Errors
/// A layer that does not settle, or a search that fails.
pub fn landings<const N: usize>(
    manifold: &impl Multivalued<N>,
    q: &SVector<f64, N>,
    rule: LandingRule,
) -> Result<Landings<SVector<f64, N>>> {
    let settle = || {
        let (leaving, _) = fold_sides(manifold, q)?;
        manifold.settle(q, &leaving)
    };
    if rule == LandingRule::Viscous {
        return Ok(Landings::viscous(settle()?));
    }
    let settled = settle().ok();
    let reached = |at: &SVector<f64, N>| {
        settled.map(|settled| (settled - at).norm() < SAME * (1.0 + at.norm()))
    };
    let all = manifold.landings(q)?.into_iter();
    let all = all.map(|at| (at, reached(&at))).collect();
    Ok(Landings::chosen(rule, all, |other| {
        Some(manifold.sheet(other))
    }))
}

/// The sign of det at `q`: the orientation of its sheet.
///
/// # Errors
/// `q` outside the chart.
pub fn orientation<const N: usize>(
    manifold: &impl Multivalued<N>,
    q: &SVector<f64, N>,
) -> Result<f64> {
    let at = manifold
        .point(q)
        .ok_or_else(|| crate::Error::domain("a point outside the chart has no orientation"))?;
    let (det, _) = adjugate_times(&at.jacobian, &SVector::zeros());
    Ok(if det < 0.0 { -1.0 } else { 1.0 })
}
