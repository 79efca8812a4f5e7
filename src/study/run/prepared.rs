//! A scene of motion ready to run, for every rod model.

use super::record::{Moment, RunBranch};
use super::shapes::poses;
use super::spring::Spring;
use crate::elastica::{Elastica, FoldNormalForm};
use crate::error::{Error, Result};
use crate::math::se3::{halves, joined};
use crate::motion::{
    Bounce, Ledger, LightReference, MasslessRod, Motion, RodCurve, Snap, State, curve_outward,
    outward,
};
use crate::scene::{Joint, ModelKind, RodMassNote, Run, Scales, Scene, Setup, Units};
use crate::study::Solid;
use crate::study::neglected_mass::{
    BouncePassed, BouncingRod, FoldPassed, FoldTreatment, MassEffect, PassedFold,
    PlanarRodMass as Planar, RodsAtRest, Validity, passed, viscosity,
};
use nalgebra::{DVector, Isometry3, Vector2, Vector3};

/// A scene of motion ready to run, with the scales back to the units of the scene.
pub struct Prepared {
    setup: Setup,
    /// The scene's units.
    pub units: Units,
    /// Scales from units of the rod to units of the scene.
    pub scales: Scales,
    /// The parsed scene, with its defaults.
    pub scene: serde_json::Value,
    /// The `[run]` table of the scene.
    pub(super) run: Run,
    pub(super) fixed_nodes: bool,
    /// True if a load along the rod bends it; false with inertia = "first-order", which includes the weight.
    pub(super) loaded: bool,
    viscosity: Option<f64>,
    /// A rod of known mass on a fixed clamp.
    massive: Option<RodOfKnownMass>,
    /// True if Maxwell branches carry couples of their own, so that no elastic sheet is the rod's.
    relaxes: bool,
    /// Treatment of the mass of an elastic rod, if known.
    pub(super) mass: Option<RodMassNote>,
    /// Diameter of the rod for self-contact, in the units of the scene; `None` without contact detection.
    pub(in crate::study) thickness: Option<f64>,
    /// The body as figures show it.
    pub(in crate::study) solid: Solid,
    /// True if the body slides in a groove.
    pub(super) grooved: bool,
}

/// Data for the estimate of mass effects.
enum RodOfKnownMass {
    /// In a plane.
    Plane(Planar),
    /// In space: the scene of the rod.
    Space(Box<Scene>),
}

/// Equilibrium under the loads at t = 0, with the effect of the rod's mass.
pub(super) enum RestState {
    Plane(Planar, MassEffect),
    Space(Box<RodsAtRest>),
}

impl RestState {
    fn mass(&self) -> &MassEffect {
        match self {
            Self::Plane(_, mass) => mass,
            Self::Space(resting) => &resting.mass,
        }
    }
}

impl Prepared {
    /// Finds the start and scales the scene.
    ///
    /// # Errors
    /// A scene that cannot run: no equilibrium for the requested start, or several; strains held rigid in a
    /// combination without kinematics; a law that overflows.
    pub fn new(scene: &Scene) -> Result<Self> {
        let setup = Setup::new(scene).map_err(|e| scene.in_own_units(e))?;
        let setup_kind = setup.model.kind();
        let looks_for_contact = setup.model.looks_for_contact();
        let scales = setup.scales;
        let massive = match (setup_kind.in_space(), setup.load) {
            (true, _) => {
                let given = if scene.is_planar() {
                    scene.lifted_for_modes()?
                } else {
                    Some(scene.clone())
                };
                // The equilibria of the light rod do not apply to a distributed load on a rod whose mass is followed
                // in full.
                let known = |scene: &Scene| {
                    let loaded = scene.rod.is_heavy() && !scene.loads.distributed.is_zero();
                    scene.rod.mass().is_some() && scene.clamp.motion.is_none() && !loaded
                };
                given
                    .filter(known)
                    .map(|scene| RodOfKnownMass::Space(Box::new(scene)))
            }
            // A distributed load shifts equilibria and folds by more than the rod's mass does.
            (false, Some(load)) if scene.loads.distributed.is_zero() => {
                Planar::new(scene, &scene.scales()?, load)?.map(RodOfKnownMass::Plane)
            }
            (false, _) => None,
        };
        Ok(Self {
            scales,
            setup,
            units: scene.units,
            scene: serde_json::to_value(scene)
                .map_err(|e| Error::io("the scene cannot be written").caused_by(e))?,
            run: scene.run()?.clone(),
            fixed_nodes: scene.rod.nodes.is_some(),
            loaded: scene.is_loaded_along() && !scene.rod.is_light(),
            viscosity: viscosity(scene)?,
            massive,
            relaxes: !scene.rod.relaxation.is_empty(),
            mass: scene.mass_notes().into_iter().next(),
            thickness: looks_for_contact.then(|| scene.rod.thickness()).flatten(),
            solid: match &scene.body()?.joint {
                Joint::Ball => Solid::point(),
                Joint::Weld {
                    offset, inertia, ..
                } => Solid::new(scene.body()?.mass, inertia, offset),
            }
            .within(scene.body()?.groove.as_ref()),
            grooved: scene.body()?.groove.is_some(),
        })
    }

    /// Model of the rod.
    pub fn kind(&self) -> ModelKind {
        self.setup.model.kind()
    }

    /// The motion from its start.
    ///
    /// # Errors
    /// A start from which no motion is possible.
    pub fn motion(&self) -> Result<Box<dyn Motion<'_> + '_>> {
        self.setup
            .motion()
            .map_err(|e| e.in_units(&self.scales.of_messages(self.units)))
    }

    /// True if the rod has mass.
    pub fn is_heavy(&self) -> bool {
        self.setup.model.is_heavy()
    }

    /// True if the rod's mass is followed in full.
    pub fn is_full(&self) -> bool {
        self.is_heavy() && matches!(self.kind(), ModelKind::Planar | ModelKind::Space)
    }

    /// The light rod that accompanies a rod with friction or mass from its first state. `None` for other models, and
    /// where no rest state is known.
    pub(super) fn accompanying_light_rod(
        &self,
        rest: Option<&RestState>,
        first: &dyn State,
    ) -> Option<LightReference> {
        if self.kind().is_elastic() || self.relaxes {
            return None;
        }
        let rod: Box<dyn MasslessRod> = match (self.massive.as_ref()?, rest) {
            (RodOfKnownMass::Plane(_), _) => Box::new(Elastica),
            (RodOfKnownMass::Space(_), Some(RestState::Space(resting))) => {
                Box::new(resting.light()?)
            }
            (RodOfKnownMass::Space(_), _) => return None,
        };
        Some(LightReference::new(rod, first))
    }

    /// True if forces in time do work on the body.
    pub fn is_driven(&self) -> bool {
        self.setup.model.is_driven()
    }

    /// Equilibrium under the loads at t = 0. `None` unless the mass is known and the clamp fixed, and where no
    /// equilibrium is found.
    pub(super) fn rest(&self) -> Option<RestState> {
        match self.massive.as_ref()? {
            RodOfKnownMass::Plane(light) => Some(RestState::Plane(*light, light.at_rest()?)),
            RodOfKnownMass::Space(scene) => {
                Some(RestState::Space(Box::new(RodsAtRest::single(scene)?)))
            }
        }
    }

    /// Effect of the rod's mass at the equilibrium under the loads at t = 0. `None` where the mass is unknown or
    /// followed in full, where the clamp moves, and where no equilibrium is found.
    pub fn small_mass(&self) -> Option<MassEffect> {
        if self.is_full() {
            return None;
        }
        Some(self.rest()?.mass().clone())
    }

    /// Folds passed in the branches of a run: snaps of the rod, or of the light rod that accompanies it.
    pub(super) fn folds(&self, rest: &RestState, branches: &[RunBranch]) -> Vec<FoldPassed> {
        let k = &self.scales;
        let follows = match self.kind() {
            _ if self.is_full() => FoldTreatment::Mass,
            ModelKind::Sheet | ModelKind::ElasticSpace => FoldTreatment::Jump,
            ModelKind::Planar | ModelKind::Space => FoldTreatment::Friction,
        };
        let form = |snap: &Snap| match rest {
            RestState::Plane(light, _) => {
                let v = self.inward(snap)?;
                let form = FoldNormalForm::new(snap.from.q[0], snap.from.q[1], &v).ok()?;
                Some(PassedFold {
                    rod: None,
                    form,
                    eta: light.eta,
                    eps: light.eps,
                })
            }
            RestState::Space(resting) => resting.passed(snap),
        };
        let of = |branch: &RunBranch| {
            let snaps = branch.entered.iter().chain(&branch.snaps);
            let crossed = branch.crossed.iter();
            let all: Vec<(&Snap, Option<Ledger>)> = snaps
                .map(|snap| (snap, None))
                .chain(crossed.map(|c| (&c.snap, Some(c.ledger.scaled(k.energy)))))
                .collect();
            let last = (branch.last.t, branch.last.ledger);
            passed((branch.id, follows), &all, last, (k, rest.mass()), form)
        };
        branches.iter().flat_map(of).collect()
    }

    /// Validity of neglecting the rod's mass in this run.
    pub(super) fn validity(
        &self,
        rest: &RestState,
        branches: &[RunBranch],
        folds: &[FoldPassed],
    ) -> Validity {
        let bounces = branches.iter().flat_map(|b| &b.bounces.first);
        let passed = |bounce| match rest {
            RestState::Plane(light, _) => {
                let rod = BouncingRod {
                    name: None,
                    mass: light.eps,
                    length: 1.0,
                    eta: light.eta,
                };
                Some(BouncePassed::new(bounce, rod, self.scales.time))
            }
            RestState::Space(resting) => resting.bounced(bounce),
        };
        Validity {
            rest: rest.mass().clone(),
            folds: folds.to_vec(),
            bounces: bounces.filter_map(passed).collect(),
            damped: match rest {
                RestState::Plane(light, _) => light.eta > 0.0,
                RestState::Space(_) => !self.kind().is_elastic(),
            },
        }
    }

    /// Velocity of the end at a snap along the axes of the clamp, in units of the rod; `None` in space.
    fn inward(&self, snap: &Snap) -> Option<Vector2<f64>> {
        let [x, y] = *snap.velocity.as_slice() else {
            return None;
        };
        let clamp = self.setup.model.clamp(0.0).pose().rotation;
        Some((clamp.inverse() * Vector3::new(x, y, 0.0)).xy())
    }

    /// The viscosity of a planar rod at small rates, in the scene's units.
    pub fn viscosity(&self) -> Option<f64> {
        self.viscosity
    }

    /// Morse index of the equilibrium at the start, if the start was found from a given end.
    pub(super) fn index_of_start(&self) -> Option<usize> {
        self.setup.model.start_index()
    }

    /// The exactly equivalent spring and dashpot, or the reason why there is none; `None` for models without this
    /// equivalence.
    ///
    /// # Errors
    /// A start that cannot be evaluated.
    pub(in crate::study) fn spring(&self) -> Result<Option<Result<Spring, String>>> {
        if !self.run.reduce {
            return Ok(Some(Err("[run] reduce = false".to_owned())));
        }
        Ok(match self.setup.model.reduction()? {
            None => None,
            Some(Ok(reduction)) => Some(Ok(Spring::new(&reduction, &self.scales)?)),
            Some(Err(refusal)) => {
                let units = self.scales.of_messages(self.units);
                Some(Err(refusal.in_units(&units).to_string()))
            }
        })
    }

    /// Names of the moving strains, and their indices in (u1, .. v3).
    pub(in crate::study) fn strains(&self) -> Vec<(&'static str, usize)> {
        self.setup.model.strains()
    }

    /// A state in the world frame and the scene's units.
    pub(in crate::study) fn moment(&self, state: &dyn State) -> Moment {
        Moment {
            labels: state.equilibrium(),
            index: state.index(),
            ..self.moment_without_index(state)
        }
    }

    /// A state in the world frame without equilibrium labels and index, which are the expensive part.
    pub(in crate::study) fn moment_without_index(&self, state: &dyn State) -> Moment {
        let (k, ledger, pose) = (&self.scales, state.ledger(), state.pose());
        let clamp = self.setup.model.clamp(state.time());
        let (frame, end) = (clamp.of_poses(), pose.translation.vector);
        let lever = joined(&Vector3::zeros(), &end);
        let own = state.twist();
        let twist = frame.absolute(&lever, &own);
        // The angular velocity of an end may be infinite and is then left out; its velocity is known nevertheless.
        let straight = joined(&Vector3::zeros(), &halves(&own).1);
        let velocity = frame.absolute(&lever, &straight);
        let action = frame.outward(&state.action());
        let groove = state.groove_forces().into_iter().next().flatten();
        Moment {
            t: self.run.output_time(state.time(), k.time),
            clamp: outward(&clamp.pose(), k.length, &Isometry3::identity()),
            pose: outward(&clamp.pose(), k.length, &pose),
            velocity: velocity.fixed_rows::<3>(3) * k.velocity,
            angular_velocity: twist.fixed_rows::<3>(0) / k.time,
            force: action.fixed_rows::<3>(3) * k.force,
            couple: action.fixed_rows::<3>(0) * k.energy,
            groove: groove.map(|force| {
                let force = frame.outward(&joined(&Vector3::zeros(), &force));
                force.fixed_rows::<3>(3) * k.force
            }),
            ledger: ledger.scaled(k.energy),
            total: ledger.total() * k.energy,
            friction: state.friction() * k.energy,
            labels: None,
            index: None,
        }
    }

    /// Sections from the clamp to the end in the world frame and the scene's units, as [`State::sections`].
    pub(in crate::study) fn curve(&self, state: &dyn State, points: usize) -> RodCurve {
        let mut sections = state.sections(points);
        let clamp = self.setup.model.clamp(state.time()).pose();
        curve_outward(&clamp, self.scales.length, &mut sections);
        sections
    }

    /// Poses of sections from the clamp to the end.
    pub(in crate::study) fn sections(
        &self,
        state: &dyn State,
        points: usize,
    ) -> Vec<Isometry3<f64>> {
        poses(self.curve(state, points))
    }

    /// Moving strains at places in [0, 1], ascending, in the units of the scene.
    pub(super) fn strains_at(&self, state: &dyn State, places: &[f64]) -> Vec<Vec<f64>> {
        let (all, length) = (state.strains_at(places), self.scales.length);
        let moving = self.strains().into_iter();
        moving
            .map(|(_, i)| {
                let unit = if i < 3 { length } else { 1.0 };
                all.iter().map(|e| e.as_slice()[i] / unit).collect()
            })
            .collect()
    }

    /// Dissipation per length and time at places in [0, 1], ascending, in the units of the scene.
    pub(super) fn dissipation_at(&self, state: &dyn State, places: &[f64]) -> Vec<f64> {
        let k = &self.scales;
        let density = k.energy / k.length / k.time;
        let values = state.dissipation_at(places);
        values.iter().map(|d| d * density).collect()
    }

    /// A snap in the world frame.
    pub(super) fn snap(&self, snap: &Snap) -> Snap {
        let (pose, velocity) = self.point_outward(snap.t, &snap.pose, &snap.velocity);
        Snap {
            pose,
            velocity,
            ..snap.clone()
        }
    }

    /// A bounce in the world frame.
    pub(super) fn bounce(&self, bounce: &Bounce) -> Bounce {
        let (pose, velocity) = self.point_outward(bounce.t, &bounce.pose, &bounce.velocity);
        Bounce {
            pose,
            velocity,
            ..bounce.clone()
        }
    }

    /// Place and velocity relative to the clamp, transformed to the world; two components in a plane.
    fn point_outward(
        &self,
        t: f64,
        pose: &DVector<f64>,
        velocity: &DVector<f64>,
    ) -> (DVector<f64>, DVector<f64>) {
        let clamp = self.setup.model.clamp(t);
        let lifted = |v: &DVector<f64>| Vector3::from_fn(|i, _| v.get(i).copied().unwrap_or(0.0));
        let flat = |v: Vector3<f64>| DVector::from_column_slice(&v.as_slice()[..pose.len()]);
        let (x, v) = (lifted(pose), lifted(velocity));
        (flat(clamp.place(&x)), flat(clamp.absolute(&x, &v)))
    }
}
