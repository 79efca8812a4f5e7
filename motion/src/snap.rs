//! The jump at a fold: r and v stay, the rod falls to another equilibrium (theory 2.6).

use super::state::planar;
use nalgebra::{DVector, SVector, UnitQuaternion};
use snaprod_systems::assembly::Configuration;
use snaprod_systems::elastica::{Elastica, LayerShape};
use snaprod_systems::error::Result;
use snaprod_systems::manifold::{Multivalued, Sheet, adjugate_times, fold_kernel};
use snaprod_systems::rod::Fallen;

/// Where a rod lands that has run out of its sheet.
#[derive(Debug, Clone, Copy, Default, PartialEq, Eq)]
#[cfg_attr(
    feature = "serde",
    derive(serde::Serialize),
    serde(rename_all = "lowercase")
)]
pub enum LandingRule {
    /// Where the fast viscous layer takes it: unique at a regular fold.
    #[default]
    Viscous,
    /// On the stable equilibrium of lowest energy.
    Lowest,
    /// On every stable equilibrium with no more energy than the fold: the run branches.
    All,
    /// On the stable equilibrium of this sheet, if it has no more energy than the fold; of several, on the one of
    /// lowest energy.
    #[cfg_attr(feature = "serde", serde(untagged))]
    Named(Sheet),
    /// On the stable equilibrium that comes in this place by energy, among those with no more energy than the fold; 1
    /// is the lowest. It tells landings apart where equilibria have no names.
    #[cfg_attr(feature = "serde", serde(untagged))]
    Ordered {
        /// The place, from 1.
        order: usize,
    },
}

impl LandingRule {
    /// The possible landings, sorted by energy, on which a rod lands: one, unless the rule is `All`; `sheet` names them.
    /// `Viscous` does not choose, and the lowest stands for its landing.
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
    /// Its sheet; None in models that do not name theirs.
    pub sheet: Option<Sheet>,
    /// Its Morse index (for the fold itself: on the side it was reached from).
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
    /// Pose, the same before and after; of elastic rods in space the place of the end of the rod along the directors of its base.
    pub pose: DVector<f64>,
    /// Velocity, the same before and after.
    pub velocity: DVector<f64>,
    /// The fold.
    pub from: SnapEnd,
    /// The landing.
    pub to: SnapEnd,
    /// Energy dissipated in the layer: elastic before minus after.
    pub released: f64,
    /// The number of the rod that jumps, of those of an assembly; 0 of one rod.
    pub rod: usize,
    /// How the base of that rod is turned in the frame of the motion.
    pub base: UnitQuaternion<f64>,
    /// The number of stable equilibria with no more energy than the fold; None under the rule `Viscous`, which does
    /// not choose. In the plane all are counted, in space those that were found.
    pub choices: Option<usize>,
    /// True if the fast viscous layer leads to this landing, false if it leads to another; None if the layer did not
    /// settle.
    pub reached: Option<bool>,
    /// The bodies and charts of an assembly at the fold; None in a plane.
    pub moving: Option<Box<Configuration>>,
}

/// A layer belongs to a snap if it lands as near as this to where the snap did, in the chart.
const SAME: f64 = 1e-6;

impl Snap {
    /// The shapes through which a planar elastica falls in this snap, in the frame of its clamp and its own units; None of other rods, and where
    /// another rule than the layer chose the landing.
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

    /// Whether a layer that ends in this chart point is that of the snap.
    pub(super) fn lands(&self, landed: &[f64]) -> bool {
        let (to, landed) = (&self.to.q, DVector::from_column_slice(landed));
        to.len() == landed.len() && (&landed - to).norm() < SAME * (1.0 + to.norm())
    }
}

/// Change of the force, relative to it, at which the two sides of a fold are told apart.
const ASIDE: f64 = 1e-4;

/// A vector along `kernel` that leads far enough from the fold `q` to tell its sides apart, and no
/// farther than the force follows: chart lengths mean nothing where the chart is stretched, but at a
/// fold the force must change along the kernel, for (pose, force) is an immersion.
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
    /// One, unless the rule is `All`, each with what [`Snap::reached`] says of it; none if no stable equilibrium is
    /// left.
    pub at: Vec<(T, Option<bool>)>,
    /// See [`Snap::choices`].
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

    /// Landings among the candidates `all`, sorted by energy, that the rule allows; `sheet` gives the sheet of a candidate.
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
