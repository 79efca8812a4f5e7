//! A scene of motion made ready to run, whichever model it is of.

use super::record::Moment;
use super::spring::Spring;
use crate::body::{Frame, Support};
use crate::error::{Error, Result};
use crate::math::se3::joined;
use crate::motion::{Bounce, Motion, Snap, State};
use crate::scene::{MotionSetup, Scales, Scene, Setup, StrainName, Units, ViscousSetup};
use crate::section::Strain;
use nalgebra::{DVector, Isometry3, Vector3};

/// A scene of motion made ready to run: the model, and the way back to the scene's units.
pub struct Prepared {
    model: Model,
    /// The scene's units.
    pub units: Units,
    /// The way back to them.
    pub scales: Scales,
    /// The scene as it was read, with its defaults.
    pub scene: serde_json::Value,
    pub(super) samples: usize,
    pub(super) branches: usize,
    pub(super) duration: f64,
    pub(super) tolerance: f64,
    pub(super) max_steps: usize,
    pub(super) max_snaps: usize,
    reduce: bool,
}

enum Model {
    /// An elastic rod in a plane.
    Elastic(Setup),
    /// A viscoelastic rod in a plane.
    Planar(ViscousSetup),
    /// A viscoelastic rod in space.
    Space(Box<MotionSetup>),
}

/// What kind of rod runs, as far as tables and figures differ.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum ModelKind {
    /// Elastic, in a plane: a point on a sheet.
    Sheet,
    /// Viscoelastic, in a plane.
    Planar,
    /// Viscoelastic, in space.
    Space,
}

impl Prepared {
    /// Finds the start and scales everything.
    ///
    /// # Errors
    /// Whatever keeps the scene from running: no equilibrium at the start as asked for, or several; strains held rigid in a
    /// combination that has no kinematics; numbers at which a law is not one of doubles.
    pub fn new(scene: &Scene) -> Result<Self> {
        let run = scene.run()?;
        let model = match (scene.is_planar(), &scene.rod.damping) {
            (true, None) => Setup::new(scene).map(Model::Elastic),
            (true, Some(_)) => ViscousSetup::new(scene).map(Model::Planar),
            (false, _) => MotionSetup::new(scene).map(|setup| Model::Space(Box::new(setup))),
        };
        let model = model.map_err(|e| scene.in_own_units(e))?;
        let scales = match &model {
            Model::Elastic(setup) => setup.scales,
            Model::Planar(setup) => setup.scales,
            Model::Space(setup) => setup.scales,
        };
        Ok(Self {
            model,
            units: scene.units,
            scales,
            scene: serde_json::to_value(scene)
                .map_err(|e| Error::io("the scene cannot be written").caused_by(e))?,
            samples: run.samples,
            branches: run.branches,
            duration: run.duration,
            tolerance: run.tolerance,
            max_steps: run.max_steps,
            max_snaps: run.max_snaps,
            reduce: run.reduce,
        })
    }

    /// What kind of rod runs.
    pub fn kind(&self) -> ModelKind {
        match &self.model {
            Model::Elastic(_) => ModelKind::Sheet,
            Model::Planar(_) => ModelKind::Planar,
            Model::Space(_) => ModelKind::Space,
        }
    }

    /// The motion from its start.
    ///
    /// # Errors
    /// A start from which it cannot go.
    pub fn motion(&self) -> Result<Box<dyn Motion<'_> + '_>> {
        let motion: Result<Box<dyn Motion<'_> + '_>> = match &self.model {
            Model::Elastic(setup) => setup.run().map(|run| Box::new(run) as _),
            Model::Planar(setup) => setup.run().map(|run| Box::new(run) as _),
            Model::Space(setup) => setup.motion(),
        };
        motion.map_err(|e| e.in_units(&self.scales.of_messages(self.units)))
    }

    /// True if forces in time do work on the body.
    pub fn is_driven(&self) -> bool {
        match &self.model {
            Model::Elastic(setup) => setup.body.is_driven(),
            Model::Planar(setup) => setup.body.is_driven(),
            Model::Space(setup) => setup.is_driven(),
        }
    }

    /// The viscosity of a planar rod at small rates, in the scene's units.
    pub fn viscosity(&self) -> Option<f64> {
        match &self.model {
            Model::Planar(setup) => Some(setup.viscosity * self.scales.viscosity()),
            Model::Elastic(_) | Model::Space(_) => None,
        }
    }

    /// The Morse index of the equilibrium at the start of a rod in space, if it is one.
    pub(super) fn index_of_start(&self) -> Option<usize> {
        match &self.model {
            Model::Space(setup) => setup.start_index,
            Model::Elastic(_) | Model::Planar(_) => None,
        }
    }

    /// The spring and dashpot that the rod is exactly, or why it is none; None where the question does not arise.
    ///
    /// # Errors
    /// A start that cannot be evaluated.
    pub(super) fn spring(&self) -> Result<Option<Result<Spring, String>>> {
        let Model::Space(setup) = &self.model else {
            return Ok(None);
        };
        if !self.reduce {
            return Ok(Some(Err("[run] reduce = false".to_owned())));
        }
        Ok(Some(match setup.reduction()? {
            Ok(reduction) => Ok(Spring::new(&reduction, &self.scales)?),
            Err(refusal) => {
                let units = self.scales.of_messages(self.units);
                Err(refusal.in_units(&units).to_string())
            }
        }))
    }

    /// Names of the strains that move, with their places among (u1, .. v3).
    pub(super) fn strains(&self) -> Vec<(&'static str, usize)> {
        match &self.model {
            Model::Elastic(_) => Vec::new(),
            Model::Planar(_) => vec![("curvature", StrainName::U1 as usize)],
            Model::Space(setup) => {
                let names = setup.strains.names().iter();
                names.map(|name| (name.as_str(), *name as usize)).collect()
            }
        }
    }

    /// A state in the world frame and the scene's units.
    pub(super) fn moment(&self, state: &dyn State) -> Moment {
        let (k, ledger, pose) = (&self.scales, state.ledger(), state.pose());
        let clamp = self.clamp(state.time());
        let (frame, end) = (clamp.of_poses(), pose.translation.vector);
        let twist = frame.absolute(&joined(&Vector3::zeros(), &end), &state.twist());
        let action = frame.outward(&state.action());
        Moment {
            t: state.time() * k.time,
            pose: self.outward(&clamp, &pose),
            velocity: twist.fixed_rows::<3>(3) * k.velocity,
            angular_velocity: twist.fixed_rows::<3>(0) / k.time,
            force: action.fixed_rows::<3>(3) * k.force,
            couple: action.fixed_rows::<3>(0) * k.energy,
            ledger: ledger.scaled(k.energy),
            total: ledger.total() * k.energy,
            friction: state.friction() * k.energy,
            labels: state.equilibrium(),
        }
    }

    /// Sections from the clamp to the end in the world frame and the scene's units, as [`State::sections`].
    pub(super) fn sections(&self, state: &dyn State, points: usize) -> Vec<Isometry3<f64>> {
        let sections = state.sections(points);
        let clamp = self.clamp(state.time());
        let outward = |pose| self.outward(&clamp, pose);
        sections.iter().map(outward).collect()
    }

    /// Each of the strains that move at places in [0, 1], in growing order, in the scene's units.
    pub(super) fn strains_at(&self, state: &dyn State, places: &[f64]) -> Vec<Vec<f64>> {
        let (all, length) = (state.strains_at(places), self.scales.length);
        let outward = |e: &Strain, i: usize| if i < 3 { e[i] / length } else { e[i] };
        let moving = self.strains().into_iter();
        moving
            .map(|(_, i)| all.iter().map(|e| outward(e, i)).collect())
            .collect()
    }

    /// Dissipation per length and time at places in [0, 1], in growing order, in the scene's units.
    pub(super) fn dissipation_at(&self, state: &dyn State, places: &[f64]) -> Vec<f64> {
        let k = &self.scales;
        let density = k.energy / k.length / k.time;
        let values = state.dissipation_at(places);
        values.iter().map(|d| d * density).collect()
    }

    /// A snap as the world sees it.
    pub(super) fn snap(&self, snap: &Snap) -> Snap {
        let (pose, velocity) = self.planar_outward(snap.t, &snap.pose, &snap.velocity);
        Snap {
            pose,
            velocity,
            ..snap.clone()
        }
    }

    /// A bounce as the world sees it.
    pub(super) fn bounce(&self, bounce: &Bounce) -> Bounce {
        let (pose, velocity) = self.planar_outward(bounce.t, &bounce.pose, &bounce.velocity);
        Bounce {
            pose,
            velocity,
            ..bounce.clone()
        }
    }

    /// The clamp at time `t`, in the units of the rod.
    fn clamp(&self, t: f64) -> Frame<3> {
        let planar = |support: Option<&Support<2>>| Some(support?.at(t).in_space());
        let frame = match &self.model {
            Model::Elastic(setup) => planar(setup.body.support()),
            Model::Planar(setup) => planar(setup.body.support()),
            Model::Space(setup) => return setup.clamp(t),
        };
        frame.unwrap_or_else(|| Frame::standing(&Isometry3::identity()))
    }

    /// Place and velocity in a plane, seen from the clamp, as the world sees them.
    fn planar_outward(
        &self,
        t: f64,
        pose: &DVector<f64>,
        velocity: &DVector<f64>,
    ) -> (DVector<f64>, DVector<f64>) {
        let clamp = self.clamp(t);
        let lifted = |v: &DVector<f64>| Vector3::new(v[0], v[1], 0.0);
        let flat = |v: Vector3<f64>| DVector::from_column_slice(&v.as_slice()[..2]);
        let (x, v) = (lifted(pose), lifted(velocity));
        (flat(clamp.place(&x)), flat(clamp.absolute(&x, &v)))
    }

    /// A pose seen from the clamp and in the units of the rod in the world frame and the scene's units.
    fn outward(&self, clamp: &Frame<3>, pose: &Isometry3<f64>) -> Isometry3<f64> {
        let pose = clamp.pose() * pose;
        let position = pose.translation.vector * self.scales.length;
        Isometry3::from_parts(position.into(), pose.rotation)
    }
}
