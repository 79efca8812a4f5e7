//! An elastic rod in space.

use super::in_space::{InSpace, SpaceField};
use super::{ModelKind, MotionModel};
use crate::assembly::{Assembly, Attachment, Carrier, Configuration, Joint, Link, Place};
use crate::body::Frame;
use crate::error::Result;
use crate::motion::assembly::AssemblyRun;
use crate::motion::reduction::Carried;
use crate::motion::{Motion, Options};
use crate::rod::{Rod, Wrench};
use crate::scene::{Scene, StrainName};
use nalgebra::{Isometry3, Vector6};

/// Tolerance of the pose of the end at the start.
const POSE: f64 = 1e-13;

/// An elastic rod in space: an assembly of one rod and one body, seen from the clamp.
#[derive(Debug, Clone)]
pub struct ElasticSpace {
    /// Body, clamp and start.
    pub common: InSpace,
    rod: Rod,
    /// The chart at the start.
    chart: Wrench,
}

impl ElasticSpace {
    /// Finds the start and scales everything.
    ///
    /// # Errors
    /// As [`Scene::cosserat_rod`]; a start for which no equilibrium is found.
    pub fn new(scene: &Scene) -> Result<Self> {
        let measures = scene.scales()?.measures();
        let breaks = scene.cosserat_rod()?.measured(measures).law().breaks();
        let common = InSpace::new(scene, breaks)?;
        let chart = match &common.strain {
            SpaceField::Equilibrium { rod, base } => rod.inward(base),
            // The unloaded rod: an elastic one has no strains of its own to start from.
            SpaceField::Polynomial { .. } => Vector6::zeros(),
        };
        Ok(Self {
            rod: common.rod.measured(measures),
            chart,
            common,
        })
    }

    /// The rod and the body, and where they start, in the frame of the clamp and units of the rod.
    ///
    /// # Errors
    /// A start that cannot be evaluated.
    pub fn assembly(&self) -> Result<(Assembly, Configuration)> {
        let (carrier, joint) = match &self.common.carried {
            Carried::Welded(body) => (Carrier::rigid(body.clone()), Joint::Weld),
            Carried::BallJoint(body) => (Carrier::point(body.clone()), Joint::Ball),
        };
        let here = Isometry3::identity();
        let (from, to) = (Attachment::ground(here), Attachment::body(0, here));
        let link = Link::new(self.rod.clone(), from, to, joint);
        let pose = link.end(&self.chart, POSE)?.pose;
        let (pose, twist) = match joint {
            Joint::Weld => (pose, self.common.velocity),
            Joint::Ball => {
                let mut twist = self.common.velocity;
                twist.fixed_rows_mut::<3>(0).fill(0.0);
                (pose.translation.into(), twist)
            }
        };
        let start = Configuration {
            bodies: vec![Place { pose, twist }],
            charts: vec![self.chart],
        };
        Ok((Assembly::new(vec![carrier], vec![link])?, start))
    }
}

impl MotionModel for ElasticSpace {
    fn kind(&self) -> ModelKind {
        ModelKind::ElasticSpace
    }

    fn motion(&self, options: Options) -> Result<Box<dyn Motion<'_> + '_>> {
        let begun = self
            .assembly()
            .and_then(|(assembly, start)| AssemblyRun::new(assembly, &start, options));
        let run = begun.map_err(|why| why.context(self.common.words.as_str()))?;
        Ok(Box::new(run))
    }

    fn clamp(&self, t: f64) -> Frame<3> {
        self.common.clamp(t)
    }

    fn is_driven(&self) -> bool {
        self.common.is_driven()
    }

    fn strains(&self) -> Vec<(&'static str, usize)> {
        let rigid = self.rod.law().rigid();
        let moves = |name: &StrainName| (*name as usize) < 3 || !rigid[*name as usize - 3];
        let names = StrainName::ALL.iter().filter(|name| moves(name));
        names.map(|name| (name.as_str(), *name as usize)).collect()
    }

    fn start_index(&self) -> Option<usize> {
        self.common.start_index
    }
}
