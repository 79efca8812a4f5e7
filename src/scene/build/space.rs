//! A viscoelastic rod in space.

use super::clamp as supports;
use super::loads::{forces, point_mass};
use super::rod::rotation;
use super::{ModelKind, MotionModel};
use crate::body::{EndBody, Frame, RigidBody, Support};
use crate::creep::grid::{FEWEST, Grid};
use crate::creep::kinematics::{AtEnd, Kinematics, Local};
use crate::creep::material::Material;
use crate::creep::space::Space;
use crate::error::{Error, Result};
use crate::math::se3::{halves, joined};
use crate::motion::creep::{MOST_NODES, ViscousRun, ViscousSample, ViscousStart};
use crate::motion::reduction::{Carried, ReducedStart, Reduction, Refusal};
use crate::motion::{Motion, Options, State};
use crate::rod::{EndConditions, Problem, Rod, Wrench};
use crate::scene::{
    Dimensionless, EndLoad, EndPose, Joint, Place, Relaxed, Scales, Scene, StrainField, StrainName,
};
use crate::section::Strain;
use crate::section::rate::Viscoelastic;
use nalgebra::{Isometry3, Matrix3, Vector3, Vector6};

/// A viscoelastic rod in space. The frame of its body is that of the clamp.
#[derive(Debug, Clone)]
pub struct ViscousSpace {
    /// The body with its loads.
    pub carried: Carried,
    /// The section, in the scene's units.
    pub section: Viscoelastic,
    /// Which strains move.
    pub strains: Moving,
    /// The strains at the start, in the scene's units.
    pub strain: SpaceField,
    /// Where the Maxwell branches are relaxed at the start, if not there.
    pub relaxed: Option<SpaceField>,
    /// (angular velocity, velocity) of the end at the start.
    pub velocity: Vector6<f64>,
    /// The Morse index of the equilibrium at the start, if it is one.
    pub start_index: Option<usize>,
    /// The way back to the scene's units.
    pub scales: Scales,
    /// The pose of the base, in the scene's units.
    pub clamp: Isometry3<f64>,
    /// What a fault of the start is about.
    words: String,
}

/// The strains of a rod in space that move.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Moving {
    /// u1, u2, u3: shear and stretch are rigid.
    Flexure,
    /// u1, u2, u3, v3: shear is rigid.
    Stretch,
    /// All six.
    All,
}

impl Moving {
    fn of(rigid: [bool; 3]) -> Result<Self> {
        match rigid {
            [true, true, true] => Ok(Self::Flexure),
            [true, true, false] => Ok(Self::Stretch),
            [false, false, false] => Ok(Self::All),
            _ => {
                let named = |held: bool| {
                    let names = ["v1", "v2", "v3"].iter().zip(rigid);
                    let list: Vec<&str> = names
                        .filter(|(_, is)| *is == held)
                        .map(|(n, _)| *n)
                        .collect();
                    list.join(" and ")
                };
                let (still, free) = (named(true), named(false));
                Err(Error::domain(format!(
                    "rod.section holds {still} rigid and lets {free} move: in a motion v1, v2 and v3 are all rigid, or v1 and v2 \
                     alone, or none; give {still} a stiffness in [rod.section], or hold {free} rigid, too"
                )))
            }
        }
    }

    /// Their names.
    pub fn names(self) -> &'static [StrainName] {
        use StrainName::{U1, U2, U3, V3};
        match self {
            Self::Flexure => &[U1, U2, U3],
            Self::Stretch => &[U1, U2, U3, V3],
            Self::All => &StrainName::ALL,
        }
    }
}

/// A field of all six strains along a rod, in the scene's units.
#[derive(Debug, Clone)]
pub enum SpaceField {
    /// Polynomials, and the strains of the unloaded rod where none is given.
    Polynomial {
        /// The polynomials.
        given: StrainField,
        /// The rod.
        rod: Rod,
    },
    /// An equilibrium.
    Equilibrium {
        /// The rod.
        rod: Rod,
        /// Its base wrench.
        base: Wrench,
    },
}

/// Tolerance of the integration along an equilibrium at the start.
const SHAPE: f64 = 1e-13;

impl SpaceField {
    /// The strains at x = s/L.
    ///
    /// # Errors
    /// As [`Rod::shape`]; a law that has no unloaded state there.
    pub fn at(&self, x: f64) -> Result<Strain> {
        match self {
            Self::Polynomial { given, rod } => {
                let mut strain = rod.law().unloaded(x * rod.length())?;
                for name in StrainName::ALL {
                    if let Some(value) = given.at(name, x) {
                        strain[name as usize] = value;
                    }
                }
                Ok(strain)
            }
            Self::Equilibrium { rod, base } => {
                let sections = rod.shape(base, &[x * rod.length()], SHAPE)?;
                sections
                    .first()
                    .map(|section| section.strain)
                    .ok_or_else(|| Error::domain(format!("no section at s/L = {x}")))
            }
        }
    }

    /// Where the end is, seen from the clamp, in units of the rod.
    fn end(&self, section: &Viscoelastic, scales: &Scales) -> Result<Vector3<f64>> {
        let mut breaks = section.measured(scales.measures()).breaks();
        breaks.retain(|s| 0.0 < *s && *s < 1.0);
        let mut nodes = 2 * FEWEST;
        loop {
            let grid = Grid::new(&breaks, &vec![nodes; breaks.len() + 1]);
            let strain = |x: &f64| Ok(scales.measures().strain_in(&self.at(*x)?));
            let strains: Vec<Strain> = grid.nodes().iter().map(strain).collect::<Result<_>>()?;
            let space = Space::<6, 6>::new();
            let curve = space.shape(&grid, &strains).ok_or_else(|| {
                Error::domain("[start]: the strains are too large for a shape of the rod")
            })?;
            if nodes >= MOST_NODES || space.defect(&grid, &curve) <= SHAPE {
                return Ok(curve.end().translation.vector);
            }
            nodes *= 2;
        }
    }
}

impl Scene {
    /// The strains that move in a motion in space.
    ///
    /// # Errors
    /// As [`Scene::cosserat_rod`]; shear and stretch held rigid in a combination that has no kinematics.
    pub fn moving(&self) -> Result<Moving> {
        Moving::of(self.cosserat_rod()?.law().rigid())
    }
}

impl ViscousSpace {
    /// Finds the start and scales everything.
    ///
    /// # Errors
    /// As [`Scene::viscoelastic`]; shear and stretch held rigid in a combination that has no kinematics; a start
    /// for which no equilibrium is found.
    pub fn new(scene: &Scene) -> Result<Self> {
        let section = scene.viscoelastic()?;
        let plain = scene.dimensionless()?;
        let (mut rod, scales) = (scene.cosserat_rod()?, scene.scales()?);
        let clamp = Isometry3::from_parts(
            Vector3::from(scene.clamp.position).into(),
            rotation(&scene.clamp.orientation),
        );
        let support = supports::spatial(&plain.clamp)?;
        if let Some(support) = &support {
            // An equilibrium is one about the clamp as it stands at t = 0.
            let begun = support.pose(0.0);
            rod = rod.with_clamp(begun.translation.vector * scales.length, begun.rotation);
        }
        let field = |given: &StrainField| SpaceField::Polynomial {
            given: given.clone(),
            rod: rod.clone(),
        };
        let (strain, start_index) = match end(scene)? {
            None => match &scene.start.place {
                Place::Strain { strain: given } => (field(given), None),
                _ => (field(&StrainField::default()), None),
            },
            Some(end) => equilibrium(&rod, end, scene.run()?.tolerance)?,
        };
        let relaxed = match &scene.start.relaxed {
            Relaxed::Start => None,
            Relaxed::Strain(given) => Some(field(given)),
            Relaxed::Unloaded | Relaxed::Curvature(_) => Some(field(&StrainField::default())),
        };
        let inward = Inward(clamp);
        let about = "[start], in the frame of the clamp";
        let start = &plain.start;
        let (velocity, words) = match &support {
            None => (
                inward.pair(&start.angular_velocity, &start.velocity),
                about.to_owned(),
            ),
            Some(support) => {
                let frame = support.at(0.0).of_poses();
                let place = joined(&Vector3::zeros(), &strain.end(&section, &scales)?);
                let given = joined(&start.angular_velocity.into(), &start.velocity.into());
                let (omega, v) = halves(&frame.outward(&frame.carried(&place)));
                let (omega, v) = (omega / scales.time, v * scales.velocity);
                let mut carried = vec![("velocity", v.as_slice())];
                if matches!(plain.body.joint, Joint::Weld { .. }) {
                    carried.push(("angular_velocity", omega.as_slice()));
                }
                (
                    supports::begun(&frame, &place, &given, &plain),
                    supports::words(about, &carried, &plain),
                )
            }
        };
        Ok(Self {
            carried: carried(&plain, &inward, support)?,
            strains: Moving::of(section.elastic.rigid())?,
            section,
            strain,
            relaxed,
            velocity,
            start_index,
            scales,
            clamp,
            words,
        })
    }

    fn with_body<'a, B, const D: usize>(
        &'a self,
        body: &'a B,
        velocity: AtEnd<D>,
        options: Options,
    ) -> Result<Box<dyn Motion<'a> + 'a>>
    where
        B: EndBody<D, Pose = Isometry3<f64>>,
    {
        match self.strains {
            Moving::Flexure => self.with_strains::<B, 3, D>(body, velocity, options),
            Moving::Stretch => self.with_strains::<B, 4, D>(body, velocity, options),
            Moving::All => self.with_strains::<B, 6, D>(body, velocity, options),
        }
    }

    fn with_strains<'a, B, const M: usize, const D: usize>(
        &'a self,
        body: &'a B,
        velocity: AtEnd<D>,
        options: Options,
    ) -> Result<Box<dyn Motion<'a> + 'a>>
    where
        B: EndBody<D, Pose = Isometry3<f64>>,
        ViscousSample<Space<M, D>, M, D>: State,
    {
        let places = Space::<M, D>::places();
        let material = Material::new(self.section.measured(self.scales.measures()), places)?;
        let local = |field: &SpaceField, x: f64| -> Local<M> {
            // NaN is refused by the run, which says where.
            field.at(x).map_or(Local::repeat(f64::NAN), |strain| {
                material.active_of(&self.scales.measures().strain_in(&strain))
            })
        };
        let relaxed = self.relaxed.as_ref().map(|field| |x: f64| local(field, x));
        let start = ViscousStart {
            strain: &|x| local(&self.strain, x),
            relaxed: relaxed.as_ref().map(|f| f as &dyn Fn(f64) -> Local<M>),
            velocity,
        };
        let run = ViscousRun::new(
            Space::<M, D>::new(),
            material.clone(),
            body,
            &start,
            options,
        )
        .map_err(|e| e.context(self.words.as_str()))?;
        Ok(Box::new(run))
    }
}

impl MotionModel for ViscousSpace {
    fn kind(&self) -> ModelKind {
        ModelKind::Space
    }

    /// With the kinematics that its strains and its joint ask for.
    fn motion(&self, options: Options) -> Result<Box<dyn Motion<'_> + '_>> {
        match &self.carried {
            Carried::Welded(body) => self.with_body(body, self.velocity, options),
            Carried::BallJoint(body) => {
                let velocity = self.velocity.fixed_rows::<3>(3).into_owned();
                self.with_body(body, velocity, options)
            }
        }
    }

    fn clamp(&self, t: f64) -> Frame<3> {
        let support = match &self.carried {
            Carried::Welded(body) => body.support(),
            Carried::BallJoint(body) => body.support(),
        };
        match support {
            Some(support) => support.at(t),
            None => {
                let position = self.clamp.translation.vector / self.scales.length;
                Frame::standing(&Isometry3::from_parts(position.into(), self.clamp.rotation))
            }
        }
    }

    fn is_driven(&self) -> bool {
        match &self.carried {
            Carried::Welded(body) => body.is_driven(),
            Carried::BallJoint(body) => body.is_driven(),
        }
    }

    fn strains(&self) -> Vec<(&'static str, usize)> {
        let names = self.strains.names().iter();
        names.map(|name| (name.as_str(), *name as usize)).collect()
    }

    fn start_index(&self) -> Option<usize> {
        self.start_index
    }

    fn reduction(&self) -> Result<Option<std::result::Result<Reduction, Refusal>>> {
        let scaled = |field: &SpaceField, x: f64| -> Result<Strain> {
            Ok(self.scales.measures().strain_in(&field.at(x)?))
        };
        let sampled = |field: &SpaceField| -> Result<Vec<Strain>> {
            PROBES.iter().map(|x| scaled(field, *x)).collect()
        };
        let branches = match &self.relaxed {
            None => Vec::new(),
            Some(field) => vec![sampled(field)?; self.section.branches.len()],
        };
        let start = ReducedStart {
            time: 0.0,
            strains: &sampled(&self.strain)?,
            branches: &branches,
            velocity: self.velocity,
        };
        let section = self.section.measured(self.scales.measures());
        Ok(Some(Reduction::recognise(&section, &self.carried, &start)))
    }
}

/// Places at which strains are asked whether they are the same all along the rod.
const PROBES: [f64; 9] = [0.0, 0.03, 0.17, 0.29, 0.5, 0.618, 0.83, 0.97, 1.0];

/// World vectors in the frame of the clamp.
struct Inward(Isometry3<f64>);

impl Inward {
    fn vector(&self, v: &[f64; 3]) -> Vector3<f64> {
        self.0.rotation.inverse() * Vector3::from(*v)
    }

    fn pair(&self, a: &[f64; 3], b: &[f64; 3]) -> Vector6<f64> {
        let (a, b) = (self.vector(a), self.vector(b));
        Vector6::new(a.x, a.y, a.z, b.x, b.y, b.z)
    }
}

fn carried(plain: &Dimensionless, inward: &Inward, support: Option<Support<3>>) -> Result<Carried> {
    let loads = &plain.loads;
    // The support of a clamp that moves leads the loads inwards by itself.
    let vector = |v: &[f64; 3]| match support {
        None => inward.vector(v),
        Some(_) => Vector3::from(*v),
    };
    match &plain.body.joint {
        Joint::Ball => {
            let body = point_mass(loads, |v| vector(&v), support.clone())?;
            Ok(Carried::BallJoint(body))
        }
        Joint::Weld { offset, inertia } => {
            let inertia = Matrix3::from_fn(|i, j| inertia[i][j]);
            let body = RigidBody::new(1.0, inertia)
                .map_err(|e| e.context("body.inertia, in units of mass length^2"))?
                .with_centre((*offset).into())?
                .with_gravity(vector(&loads.gravity))?
                .with_dead_force(vector(&loads.dead))?
                .with_dead_couple(vector(&loads.couple))?
                .with_rotational_drag(loads.rotational_drag)?
                .with_drag(loads.drag)?;
            let forces = forces(&loads.force, |v| vector(&v))?;
            let body = forces.into_iter().fold(body, RigidBody::with_force);
            Ok(Carried::Welded(match support {
                None => body,
                Some(support) => body.with_support(support),
            }))
        }
    }
}

/// The end condition of which the start is an equilibrium.
fn end(scene: &Scene) -> Result<Option<EndConditions>> {
    Ok(match &scene.start.place {
        Place::Equilibrium {
            equilibrium: EndLoad { force, couple },
        } => Some(EndConditions::load((*force).into(), (*couple).into())),
        Place::Pose {
            pose: EndPose {
                position,
                orientation,
            },
        } => Some(match orientation {
            None => EndConditions::ball((*position).into()),
            Some(orientation) => EndConditions::pose((*position).into(), rotation(orientation)),
        }),
        Place::Settled { .. } => Some(at_rest(scene)?),
        _ => None,
    })
}

/// The loads at t = 0 on the end: they act at the centre of mass.
fn at_rest(scene: &Scene) -> Result<EndConditions> {
    let (body, loads) = (scene.body()?, &scene.loads);
    let constant = Vector3::from(loads.gravity) * body.mass + Vector3::from(loads.dead);
    let moving = forces(&loads.force, Vector3::from)?;
    let force = moving.iter().fold(constant, |sum, load| sum + load.at(0.0));
    let arm = match &body.joint {
        Joint::Weld { offset, .. } => (*offset).into(),
        Joint::Ball => Vector3::zeros(),
    };
    Ok(EndConditions::weight(force, arm, loads.couple.into()))
}

fn equilibrium(
    rod: &Rod,
    end: EndConditions,
    tolerance: f64,
) -> Result<(SpaceField, Option<usize>)> {
    let doing = |e: Error| e.context("[start]");
    let tolerance = (0.1 * tolerance).clamp(SHAPE, 1e-4);
    let found = Problem::new(rod.clone(), end, tolerance)
        .and_then(|problem| problem.solve(None))
        .map_err(doing)?;
    let field = SpaceField::Equilibrium {
        rod: rod.clone(),
        base: found.base,
    };
    Ok((field, Some(found.index)))
}
