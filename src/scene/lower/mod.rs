//! From a scene to what the library solves and runs: statics in the scene's units, motions in those of the rod.

mod assembly;
mod clamp;
mod elastic_space;
mod first_order_mass;
mod grooved;
mod heavy;
mod in_space;
mod loads;
mod planar;
mod planar_as_spatial;
mod rod;
mod section;
mod space;
mod viscous;

pub use assembly::AssemblySetup;
pub use elastic_space::ElasticSpace;
pub(in crate::scene) use heavy::in_space as heavy_in_space;
pub use heavy::{HeavyPlane, HeavySpace};
pub use in_space::{InSpace, SpaceField};
pub use planar::ElasticPlane;
pub use space::ViscousSpace;
pub use viscous::ViscousPlane;

use super::{Run, Scales, Scene};
use crate::body::Frame;
use crate::error::{Quantity, Result};
use crate::motion::reduction::{Reduction, Refusal};
use crate::motion::{Motion, Nodes, Options};
use nalgebra::Vector2;

/// A model of rods, made from a scene of motion and ready to run. Length, bending stiffness and mass are 1, and states are
/// seen from the clamp.
pub trait MotionModel {
    /// What tables and figures show of it.
    fn kind(&self) -> ModelKind;

    /// The motion from its start.
    ///
    /// # Errors
    /// A start from which it cannot go.
    fn motion(&self, options: Options) -> Result<Box<dyn Motion<'_> + '_>>;

    /// The clamp at time `t`.
    fn clamp(&self, t: f64) -> Frame<3>;

    /// True if forces in time do work on the body.
    fn is_driven(&self) -> bool;

    /// Names of the strains that move, with their places among (u1, .. v3).
    fn strains(&self) -> Vec<(&'static str, usize)> {
        Vec::new()
    }

    /// The Morse index of the equilibrium at the start, if it is one and was found by its end.
    fn start_index(&self) -> Option<usize> {
        None
    }

    /// True if the rod has mass: its kinetic energy is one of the ledger's.
    fn is_heavy(&self) -> bool {
        false
    }

    /// True if contacts of the rod with itself are looked for, provided that it is known how thick it is.
    fn looks_for_contact(&self) -> bool {
        false
    }

    /// The loads on the end of a planar rod at t = 0, along the axes of its clamp; None of other rods, and where the clamp moves.
    fn load(&self) -> Option<Vector2<f64>> {
        None
    }

    /// The spring and dashpot that the rod is, or why it is none; None where the question does not arise.
    ///
    /// # Errors
    /// A start that cannot be evaluated.
    fn reduction(&self) -> Result<Option<std::result::Result<Reduction, Refusal>>> {
        Ok(None)
    }
}

/// What kind of rod runs, as far as tables and figures differ.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum ModelKind {
    /// Elastic, in a plane: a point on a sheet.
    Sheet,
    /// Viscoelastic, in a plane.
    Planar,
    /// Elastic, in space: a point of the equilibrium manifold.
    ElasticSpace,
    /// Viscoelastic, in space.
    Space,
}

impl ModelKind {
    /// True if the rod is elastic: it is in equilibrium at every moment, and snaps.
    pub fn is_elastic(self) -> bool {
        matches!(self, Self::Sheet | Self::ElasticSpace)
    }

    /// True if the rod moves in space.
    pub fn in_space(self) -> bool {
        matches!(self, Self::ElasticSpace | Self::Space)
    }
}

/// A scene of motion made ready to run.
pub struct Setup {
    /// The model that its rod asks for.
    pub model: Box<dyn MotionModel>,
    /// What to run.
    pub options: Options,
    /// The loads on the end of a planar rod at t = 0, along the axes of its clamp and in units of its length and EI; None of other rods, and where the
    /// clamp moves.
    pub load: Option<Vector2<f64>>,
    /// The way back to the scene's units.
    pub scales: Scales,
}

impl Setup {
    /// Finds the start and scales everything.
    ///
    /// # Errors
    /// A scene of statics; as the model that its rod asks for.
    pub fn new(scene: &Scene) -> Result<Self> {
        let bearing = scene.bearing_in_plane()?;
        let load = match &bearing {
            Some(_) => planar::resting(&planar::body(&scene.dimensionless()?)?),
            None => None,
        };
        let scene = bearing.as_ref().unwrap_or(scene);
        let (run, scales) = (scene.run()?, scene.scales()?);
        let model: Box<dyn MotionModel> = match (scene.is_planar(), &scene.rod.damping) {
            (true, _) if scene.rod.is_heavy() => Box::new(HeavyPlane::new(scene)?),
            (false, _) if scene.rod.is_heavy() => Box::new(HeavySpace::new(scene)?),
            (true, None) => Box::new(ElasticPlane::new(scene)?),
            (true, Some(_)) => Box::new(ViscousPlane::new(scene)?),
            (false, None) => Box::new(ElasticSpace::new(scene)?),
            (false, Some(_)) => Box::new(ViscousSpace::new(scene)?),
        };
        let options = options(run, &scales)?
            .with_nodes(scene.rod.nodes.map_or(Nodes::Adaptive, Nodes::Fixed));
        Ok(Self {
            load: model.load().or(load),
            model,
            options,
            scales,
        })
    }

    /// The motion from its start.
    ///
    /// # Errors
    /// A start from which it cannot go.
    pub fn motion(&self) -> Result<Box<dyn Motion<'_> + '_>> {
        self.model.motion(self.options)
    }
}

/// What `[run]` asks for, in units of the rod.
fn options(run: &Run, scales: &Scales) -> Result<Options> {
    let mut options = Options::new(scales.inward(Quantity::Time, run.duration))
        .and_then(|options| options.with_tolerance(run.tolerance))
        .map_err(|e| e.context("[run]"))?
        .with_landing(run.landing)
        .with_method(run.method);
    options.max_steps = run.max_steps as u64;
    options.max_snaps = run.max_snaps as u64;
    Ok(options)
}
