//! Equilibrium under the loads at t = 0, with the effect of the rods' mass there, at folds and in bounces.

use super::header::RunHeader;
use super::moment::Moment;
use super::prepared::RunModel;
use crate::elastica::FoldNormalForm;
use crate::motion::{Bounce, Ledger, LightSnap, Snap};
use crate::study::neglected_mass::{
    BouncePassed, BouncingRod, BranchEnd, FoldPassed, FoldTreatment, MassEffect, PassedFold,
    PlanarRodMass, RodsAtRest, Validity, passed,
};
use nalgebra::Vector2;
use std::cell::OnceCell;

/// Equilibrium under the loads at t = 0, with the effect of the rods' mass.
pub(super) enum RestState {
    /// Of a planar rod.
    Plane {
        rod: PlanarRodMass,
        mass: MassEffect,
    },
    /// Of rods in space. If `alone`, each light rod of a comparison is seen without the assembly.
    Space { rods: Box<RodsAtRest>, alone: bool },
}

/// Equilibrium of a run, found when it is first asked for.
pub(super) struct LazyRest<'p> {
    model: &'p dyn RunModel,
    found: OnceCell<Option<RestState>>,
}

impl<'p> LazyRest<'p> {
    pub fn new(model: &'p dyn RunModel) -> Self {
        Self {
            model,
            found: OnceCell::new(),
        }
    }

    /// The equilibrium; `None` where no mass is known, the clamp moves or no equilibrium is found.
    pub fn get(&self) -> Option<&RestState> {
        self.found.get_or_init(|| self.model.rest()).as_ref()
    }

    /// Validity of neglecting the rods' mass, from the folds and bounces of a run.
    pub fn validity(
        &self,
        header: &RunHeader,
        folds: &[FoldPassed],
        bounces: Vec<BouncePassed>,
    ) -> Option<Validity> {
        if header.full {
            return None;
        }
        let rest = self.get()?;
        Some(Validity {
            rest: rest.mass().clone(),
            folds: folds.to_vec(),
            bounces,
            damped: match rest {
                RestState::Plane { rod, .. } => rod.eta > 0.0,
                RestState::Space { .. } => !header.is_elastic(),
            },
        })
    }

    /// Folds passed in branch `id` at its `snaps`, then folds `crossed` by light rods for comparison. Snaps are in the
    /// units of the motion.
    pub fn folds(
        &self,
        header: &RunHeader,
        id: usize,
        snaps: &[Snap],
        crossed: &[LightSnap],
        last: &Moment,
    ) -> Vec<FoldPassed> {
        if snaps.is_empty() && crossed.is_empty() {
            return Vec::new();
        }
        let Some(rest) = self.get() else {
            return Vec::new();
        };
        let k = &header.scales;
        let last = BranchEnd {
            t: last.t,
            ledger: last.ledger,
        };
        let jumps: Vec<(&Snap, Option<Ledger>)> = snaps.iter().map(|snap| (snap, None)).collect();
        let crossed = crossed.iter();
        let crossed = crossed.map(|c| (&c.snap, Some(c.ledger.scaled(k.energy))));
        let crossed: Vec<_> = crossed.collect();
        let through = if header.full {
            FoldTreatment::Mass
        } else {
            FoldTreatment::Friction
        };
        let mass = rest.mass();
        let mut all = passed(id, FoldTreatment::Jump, &jumps, &last, k, mass, |snap| {
            rest.jump(snap)
        });
        all.extend(passed(id, through, &crossed, &last, k, mass, |snap| {
            rest.crossing(snap)
        }));
        all
    }
}

impl RestState {
    /// Effect of the rods' mass at the equilibrium.
    pub fn mass(&self) -> &MassEffect {
        match self {
            Self::Plane { mass, .. } => mass,
            Self::Space { rods, .. } => &rods.mass,
        }
    }

    /// A bounce of a rod; `None` if its mass is unknown.
    pub fn bounced(&self, bounce: &Bounce) -> Option<BouncePassed> {
        match self {
            Self::Plane { rod, .. } => {
                let of = BouncingRod {
                    name: None,
                    mass: rod.eps,
                    length: 1.0,
                    eta: rod.eta,
                };
                Some(BouncePassed::new(bounce, of, rod.time))
            }
            Self::Space { rods, .. } => rods.bounced(bounce),
        }
    }

    /// Normal form of the fold at a snap of the run.
    fn jump(&self, snap: &Snap) -> Option<PassedFold> {
        match self {
            Self::Plane { rod, .. } => {
                let [x, y] = *snap.velocity.as_slice() else {
                    return None;
                };
                let v = Vector2::new(x, y);
                let form = FoldNormalForm::new(snap.from.q[0], snap.from.q[1], &v).ok()?;
                Some(PassedFold {
                    rod: None,
                    form,
                    eta: rod.eta,
                    eps: rod.eps,
                })
            }
            Self::Space { rods, .. } => rods.passed(snap),
        }
    }

    /// Normal form of the fold that a light rod crossed beside the run.
    fn crossing(&self, snap: &Snap) -> Option<PassedFold> {
        match self {
            Self::Space { rods, alone: true } => rods.passed_alone(snap),
            _ => self.jump(snap),
        }
    }
}
