//! Conversion of scenes to problems and runs of the library: statics in the scene's units, motions in those of the rod.

mod assembly;
mod clamp;
mod elastic_space;
mod first_order_mass;
mod grooved;
mod heavy;
mod in_plane;
mod in_space;
mod loads;
mod obstacles;
mod planar;
mod planar_as_spatial;
mod rod;
mod section;
mod space;
mod viscous;

pub use assembly::{AssemblySetup, PlacedJoint};
pub use elastic_space::ElasticSpace;
pub(in crate::scene) use heavy::heavy_law_in_space as heavy_in_space;
pub use heavy::{HeavyPlane, HeavySpace};
pub use in_space::{SpaceField, SpaceStart};
pub use planar::ElasticPlane;
pub use space::ViscousSpace;
pub use viscous::ViscousPlane;

use super::{Run, Scales, Scene};
use crate::body::Frame;
use crate::error::{Quantity, Result};
use crate::motion::reduction::{Reduction, Refusal};
use crate::motion::{Motion, Nodes, Options};
use nalgebra::Vector2;

/// A rod model made from a scene of motion, ready to run. Length, bending stiffness and mass are 1, and states are in
/// the clamp's frame.
pub trait MotionModel {
    /// Kind of the model, for tables and figures.
    fn kind(&self) -> ModelKind;

    /// The motion from the start.
    ///
    /// # Errors
    /// A start from which no motion is possible.
    fn motion(&self, options: Options) -> Result<Box<dyn Motion<'_> + '_>>;

    /// Frame of the clamp at time `t`.
    fn clamp(&self, t: f64) -> Frame<3>;

    /// True if time-dependent forces do work on the body.
    fn is_driven(&self) -> bool;

    /// Names of the active strains, with their indices among (u1, .. v3).
    fn strains(&self) -> Vec<(&'static str, usize)> {
        Vec::new()
    }

    /// Morse index of the equilibrium at the start; `None` if the start is no equilibrium or was not found from its
    /// end.
    fn start_index(&self) -> Option<usize> {
        None
    }

    /// True if the rod has mass: the ledger then contains its kinetic energy.
    fn is_heavy(&self) -> bool {
        false
    }

    /// True if self-contacts of the rod are sought, which requires its thickness.
    fn looks_for_contact(&self) -> bool {
        false
    }

    /// Loads on the end of a planar rod at t = 0, along the axes of its clamp; `None` for other rods and moving clamps.
    fn load(&self) -> Option<Vector2<f64>> {
        None
    }

    /// The equivalent spring and dashpot of the rod, or the reason against a reduction; `None` for rods to which no
    /// reduction applies.
    ///
    /// # Errors
    /// A start that cannot be evaluated.
    fn reduction(&self) -> Result<Option<std::result::Result<Reduction, Refusal>>> {
        Ok(None)
    }
}

/// Kinds of rods that differ in tables and figures.
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
    /// True if the rod is elastic: always in equilibrium, with snaps.
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
    /// Rod model of the scene.
    pub model: Box<dyn MotionModel>,
    /// Options of the run.
    pub options: Options,
    /// Loads on the end of a planar rod at t = 0, along the axes of its clamp, in units of its length and EI; `None`
    /// for other rods and moving clamps.
    pub load: Option<Vector2<f64>>,
    /// Conversion to the scene's units.
    pub scales: Scales,
}

impl Setup {
    /// Finds the start and converts to units of the rod.
    ///
    /// # Errors
    /// A scene of statics; errors of the rod model.
    pub fn new(scene: &Scene) -> Result<Self> {
        let bearing = scene.bearing_in_plane()?;
        let load = match &bearing {
            Some(_) => planar::load_on_fixed_clamp(&planar::body(&scene.dimensionless()?)?),
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

    /// The motion from the start.
    ///
    /// # Errors
    /// A start from which no motion is possible.
    pub fn motion(&self) -> Result<Box<dyn Motion<'_> + '_>> {
        self.model.motion(self.options)
    }
}

/// Tolerance of equilibria, at rest or at the start of a motion: a digit better than the scene asks for.
fn equilibrium_tolerance(scene: &Scene) -> f64 {
    let asked = scene.solve.tolerance;
    let run = scene.run.as_ref();
    0.1 * run.map_or(asked, |run| asked.min(run.tolerance))
}

/// Options from `[run]`, in units of the rod.
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
