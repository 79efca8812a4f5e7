//! An elastic rod in space, made from a scene of motion.

use super::first_order_mass::first_order_rod;
use super::in_space::{SpaceField, SpaceStart, equilibrium_field, in_world, joint_of};
use super::obstacles::Obstacles;
use super::{ModelKind, MotionModel};
use crate::assembly::{
    Assembly, Attachment, Body, BodyMotion as Held, Configuration, Joint, LightRod, Link,
};
use crate::body::{Frame, Mass, Support};
use crate::error::{Error, Quantity, Result};
use crate::full_mass::elements;
use crate::math::se3::join;
use crate::motion::assembly::AssemblyRun;
use crate::motion::{Motion, Options};
use crate::rod::{Rod, Wrench};
use crate::scene::{InitialShape, Scene, StrainName};
use crate::section::LawInTime;
use nalgebra::{Isometry3, UnitQuaternion, Vector3, Vector6};

/// Tolerance of the pose of the end at the start.
const POSE: f64 = 1e-13;
/// Tolerance of the equilibrium in a groove at the start.
const SETTLING_TOLERANCE: f64 = 1e-11;

/// An elastic rod in space: an assembly of one rod and one body. The frame is that of the clamp. The frame is the
/// world among obstacles, and on a moving clamp under loads along the rod: dead ones would rotate in the frame of a
/// clamp that turns, and the power of others counts the velocity of the clamp.
#[derive(Debug, Clone)]
pub struct ElasticSpace {
    /// Body, clamp and start.
    pub common: SpaceStart,
    rod: Rod,
    /// Chart point at the start.
    chart: Wrench,
    /// Pose of the end at the start, in the clamp's frame.
    end: Isometry3<f64>,
    /// Contact diameter; 0 if contacts are not sought.
    diameter: f64,
    /// True if the run starts from the equilibrium in the groove.
    settled: bool,
    /// Mass of the rod, if its inertia is of first order.
    light: Option<LightRod>,
    /// Section law that varies in time.
    in_time: Option<LawInTime>,
    /// The body in the world frame and the clamp, for a run in the world frame.
    in_world: Option<(Mass, WorldClamp)>,
    /// Obstacles that the body hits.
    obstacles: Option<Obstacles>,
}

/// The clamp of a run in the world frame.
#[derive(Debug, Clone)]
enum WorldClamp {
    Standing(Isometry3<f64>),
    Moving(Support<3>),
}

impl ElasticSpace {
    /// Finds the start and converts to units of the rod.
    ///
    /// # Errors
    /// As [`Scene::cosserat_rod`]; a start for which no equilibrium is found.
    pub fn new(scene: &Scene) -> Result<Self> {
        let measures = scene.scales()?.measures();
        let breaks = scene.cosserat_rod()?.measured(measures).law().breaks();
        let common = SpaceStart::new(scene, breaks)?;
        let settled =
            common.groove.is_some() && matches!(scene.start.place, InitialShape::Settled { .. });
        let (chart, end) = match &common.strain {
            SpaceField::Equilibrium { problem, base, end } => {
                let mut end = problem.rod().clamp_pose().inv_mul(end);
                end.translation.vector /= problem.rod().length();
                (problem.rod().inward(base), end)
            }
            // An elastic rod without an equilibrium starts unloaded. In a groove the unloaded rod is the initial guess.
            SpaceField::Polynomial { .. } if settled || !common.bears_load() => {
                (Vector6::zeros(), Isometry3::identity())
            }
            SpaceField::Polynomial { .. } => {
                return Err(Error::domain(
                    "[start]: an elastic rod under its weight, or another load along it, does not rest straight: start it with settled = true, from \
                     a pose or an equilibrium; or give it friction (damping), or leave out its mass",
                ));
            }
        };
        let moved = common.support().is_some_and(|support| {
            common.along().turning.is_some() || support.turns() && common.bears_load()
        });
        let in_world = if !scene.obstacles.is_empty() || moved {
            let clamp = match common.support() {
                Some(support) => WorldClamp::Moving(support.clone()),
                None => WorldClamp::Standing(common.clamp(0.0).pose()),
            };
            Some((in_world(&scene.dimensionless()?)?, clamp))
        } else {
            None
        };
        let mut model = Self {
            in_time: scene.rod.law_in_time(measures)?,
            in_world,
            obstacles: Obstacles::of_end_body(scene)?,
            light: first_order_rod(&scene.rod, &scene.scales()?)?,
            rod: (common.rod.measured(measures)).with_mass_along(scene.rod.mass_along()),
            chart,
            end,
            diameter: common
                .scales
                .inward(Quantity::Length, scene.rod.thickness().unwrap_or(0.0)),
            settled,
            common,
        };
        if model.settled {
            let (assembly, now) = model.assembly()?;
            if !assembly.has_turning() {
                let index = assembly.index(0.0, &now, SETTLING_TOLERANCE)?;
                model.common.start_index = Some(index);
            }
        }
        Ok(model)
    }

    /// Pose of the end at the start, in the clamp's frame and units of the rod.
    pub(super) fn end(&self) -> &Isometry3<f64> {
        &self.end
    }

    /// Strains at the start, for every form in which the scene gives the start.
    ///
    /// # Errors
    /// As [`ElasticSpace::assembly`].
    pub(super) fn field(&self) -> Result<SpaceField> {
        let (_, start) = self.assembly()?;
        let rod = &self.common.rod;
        equilibrium_field(
            rod,
            self.common.along(),
            rod.outward_wrench(&start.charts[0]),
        )
    }

    /// Rod and body with their initial configuration, in units of the rod, in the clamp's frame or in the world.
    ///
    /// # Errors
    /// A start that cannot be evaluated.
    pub fn assembly(&self) -> Result<(Assembly, Configuration)> {
        let here = Isometry3::identity();
        let (carried, load, from, frame) = match &self.in_world {
            None => (
                &self.common.carried,
                self.common.load(),
                Attachment::ground(here),
                Frame::standing(&here),
            ),
            Some((carried, WorldClamp::Standing(pose))) => (
                carried,
                self.common.load_in_world(),
                Attachment::ground(*pose),
                Frame::standing(pose),
            ),
            Some((carried, WorldClamp::Moving(support))) => (
                carried,
                self.common.load_in_world(),
                Attachment::support(support.clone()),
                support.at(0.0),
            ),
        };
        let joint = joint_of(carried);
        let mut carrier = Body::new(carried.clone());
        if let Some(groove) = &self.common.groove {
            carrier = carrier.in_groove(groove.clone());
        }
        let to = Attachment::body(0, here);
        let mut link = Link::new(self.rod.clone(), from, to, joint).with_diameter(self.diameter);
        if let Some(load) = load {
            link = link.with_distributed(load)?;
        }
        let back = match &self.in_world {
            None => self.common.clamp(0.0).pose().rotation.inverse(),
            Some(_) => UnitQuaternion::identity(),
        };
        if let Some(loads) = self.common.turning(|couple| back * couple) {
            link = link.with_turning(&loads)?;
        }
        if let Some(law) = &self.in_time {
            link = link.with_law_in_time(law.clone());
        }
        let pose = link.held(&self.chart, &self.end, POSE)?.pose;
        let lever = join(&Vector3::zeros(), &pose.translation.vector);
        let mut twist = frame
            .of_poses()
            .absolute_velocity(&lever, &self.common.velocity);
        let mut pose = frame.pose() * pose;
        if joint == Joint::Ball {
            twist.fixed_rows_mut::<3>(0).fill(0.0);
            pose = pose.translation.into();
        }
        let mut start = Configuration {
            bodies: vec![Held { pose, twist }],
            charts: vec![self.chart],
            spins: Vec::new(),
        };
        let mut assembly = Assembly::new(vec![carrier], vec![link])?;
        if let Some(light) = &self.light {
            assembly = assembly.with_light_rods(vec![Some(light.clone())])?;
        }
        if self.settled {
            start = elements::equilibrium(&assembly, SETTLING_TOLERANCE)?.now;
            start.bodies[0].twist = twist;
        }
        Ok((assembly, start))
    }
}

impl MotionModel for ElasticSpace {
    fn kind(&self) -> ModelKind {
        ModelKind::ElasticSpace
    }

    fn motion(&self, options: Options) -> Result<Box<dyn Motion<'_> + '_>> {
        let begun = self
            .assembly()
            .and_then(|(assembly, start)| AssemblyRun::new(assembly, &start, options))
            .and_then(|run| match &self.obstacles {
                Some(obstacles) => run.among_obstacles(obstacles.among()),
                None => Ok(run),
            });
        let run = begun.map_err(|why| why.context(self.common.words.as_str()))?;
        Ok(Box::new(run))
    }

    fn clamp(&self, t: f64) -> Frame<3> {
        self.common.clamp(t)
    }

    fn is_driven(&self) -> bool {
        self.common.is_driven() || self.in_time.is_some()
    }

    fn strains(&self) -> Vec<(&'static str, usize)> {
        let rigid = self.rod.law().rigid();
        let moves = |name: &StrainName| !rigid[*name as usize];
        let names = StrainName::ALL.iter().filter(|name| moves(name));
        names.map(|name| (name.as_str(), *name as usize)).collect()
    }

    fn is_heavy(&self) -> bool {
        self.light.is_some()
    }

    fn looks_for_contact(&self) -> bool {
        self.diameter > 0.0
    }

    fn start_index(&self) -> Option<usize> {
        self.common.start_index
    }
}
