//! Body, clamp and start of a rod in space, common to all its motions.

use super::clamp as supports;
use super::equilibrium_tolerance;
use super::loads::{acting_on, in_time, point_mass};
use super::rod::rotation;
use crate::assembly::{self, Assembly, Attachment, Body, Link};
use crate::body::{Frame, Groove, Mass, RigidBody, Support};
use crate::error::{Error, Quantity, Result};
use crate::full_mass::elements;
use crate::math::se3::{halves, join};
use crate::motion::viscoelastic::MOST_NODES;
use crate::rod::{DistributedLoad, EndConditions, LoadsWithoutPotential, Problem, Rod, Wrench};
use crate::scene::{
    Dimensionless, EndLoad, EndPose, Force, InitialShape, Joint, RelaxedAt, Scales, Scene,
    StrainField, StrainName,
};
use crate::section::Strain;
use crate::viscoelastic::grid::{FEWEST, Grid};
use crate::viscoelastic::kinematics::Kinematics;
use crate::viscoelastic::space::Space;
use nalgebra::{Isometry3, Matrix3, Vector3, Vector6};

/// Body, clamp and start of a rod in space. Body and groove are described in the frame of the clamp.
#[derive(Debug, Clone)]
pub struct SpaceStart {
    /// The body with its loads.
    pub carried: Mass,
    /// Strains at the start, in the scene's units.
    pub strain: SpaceField,
    /// Groove of the body.
    pub groove: Option<Groove>,
    /// Twist (angular velocity, velocity) of the end at the start.
    pub velocity: Vector6<f64>,
    /// Morse index of the equilibrium at the start; `None` if the start is no equilibrium or the index was not
    /// computed.
    pub start_index: Option<usize>,
    /// Conversion to the scene's units.
    pub scales: Scales,
    /// Pose of the base, in the scene's units.
    pub clamp: Isometry3<f64>,
    /// Context of messages about the start.
    pub(super) words: String,
    /// The rod on its clamp in the pose at t = 0, in the scene's units.
    pub(super) rod: Rod,
    /// Loads along a rod without full inertia.
    along: LoadsOnRod,
}

/// Loads along a rod, in the world and the scene's units.
#[derive(Debug, Clone, Default)]
pub(super) struct LoadsOnRod {
    /// Dead forces.
    pub dead: Option<DistributedLoad>,
    /// Loads without a potential.
    pub turning: Option<LoadsWithoutPotential>,
}

impl LoadsOnRod {
    fn is_none(&self) -> bool {
        self.dead.is_none() && self.turning.is_none()
    }

    /// Boundary-value problem of a rod under these loads.
    fn problem(&self, rod: &Rod, end: EndConditions, tolerance: f64) -> Result<Problem> {
        let problem = Problem::new(rod.clone(), end, tolerance)?;
        let problem = match &self.dead {
            None => problem,
            Some(load) => problem.with_distributed(load),
        };
        Ok(match &self.turning {
            None => problem,
            Some(loads) => problem.with_followers(loads),
        })
    }
}

impl SpaceStart {
    /// Strains at which the Maxwell branches are relaxed; `None`: the initial strains.
    pub(super) fn relaxed(&self, scene: &Scene) -> Option<SpaceField> {
        let given = match &scene.start.relaxed {
            RelaxedAt::Start => return None,
            RelaxedAt::Strain(given) => given.clone(),
            RelaxedAt::Unloaded | RelaxedAt::Curvature(_) => StrainField::default(),
        };
        Some(SpaceField::Polynomial {
            given,
            rod: Box::new(self.rod.clone()),
        })
    }

    /// Finds the start and converts to units of the rod. The section is not smooth at the places `breaks` in [0, 1].
    ///
    /// # Errors
    /// A start for which no equilibrium is found.
    pub(super) fn new(scene: &Scene, breaks: Vec<f64>) -> Result<Self> {
        let plain = scene.dimensionless()?;
        let (mut rod, scales) = (scene.cosserat_rod()?, scene.scales()?);
        let clamp = Isometry3::from_parts(
            Vector3::from(scene.clamp.position).into(),
            rotation(&scene.clamp.orientation),
        );
        let support = supports::spatial(&plain.clamp)?;
        let mut base = clamp;
        base.translation.vector = plain.clamp.position.into();
        if let Some(support) = &support {
            // The initial equilibrium is that of the clamp's pose at t = 0.
            base = support.pose(0.0);
            rod = rod.with_clamp(
                scales.outward(Quantity::Length, base.translation.vector),
                base.rotation,
            );
        }
        let load = scene.light_load()?;
        let turning = scene.light_turning_loads()?;
        let field = |given: &StrainField| SpaceField::Polynomial {
            given: given.clone(),
            rod: Box::new(rod.clone()),
        };
        // With a groove the equilibrium is solved together with the body.
        let settled =
            matches!(scene.start.place, InitialShape::Settled { .. }) && scene.groove().is_none();
        let at_start = scene.load_at_start()?;
        let under = |dead: Option<&DistributedLoad>| -> Result<_> {
            let along = &LoadsOnRod {
                dead: dead.cloned(),
                turning: turning.clone(),
            };
            let tolerance = equilibrium_tolerance(scene).max(SHAPE_TOLERANCE);
            if settled {
                let followed = under_followers(&rod, along, &base, &plain, &scales, tolerance)?;
                if let Some(followed) = followed {
                    return Ok(Some((followed, None)));
                }
            }
            match end(scene)? {
                Some(end) => {
                    let guess = scene.guess();
                    equilibrium(&rod, along, end, guess.as_ref(), tolerance).map(Some)
                }
                None => Ok(None),
            }
        };
        // If no equilibrium with the weight of a heavy rod is found, the massless equilibrium is the initial guess for
        // settling.
        let found = match under(at_start.as_ref()) {
            Err(_) if at_start.is_some() && load.is_none() => under(None)?,
            found => found?,
        };
        let (strain, start_index) = match (found, &scene.start.place) {
            (Some(found), _) => found,
            (None, InitialShape::Strain { strain: given }) => (field(given), None),
            (None, _) => (field(&StrainField::default()), None),
        };
        let inward = ToClampFrame(clamp);
        let about = "[start], in the frame of the clamp";
        let start = &plain.start;
        let (velocity, words) = match &support {
            None => (
                inward.pair(&start.angular_velocity, &start.velocity),
                about.to_owned(),
            ),
            Some(support) => {
                let frame = support.at(0.0).of_poses();
                let place = join(&Vector3::zeros(), &strain.end(breaks, &scales)?);
                let given = join(&start.angular_velocity.into(), &start.velocity.into());
                let (omega, v) = halves(&frame.outward(&frame.velocity_of_fixed_point(&place)));
                let omega = scales.outward(Quantity::AngularVelocity, omega);
                let v = scales.outward(Quantity::Velocity, v);
                let mut carried = vec![("velocity", v.as_slice())];
                if plain.body.as_ref().is_none_or(|body| body.joint.is_weld()) {
                    carried.push(("angular_velocity", omega.as_slice()));
                }
                (
                    supports::initial_relative_velocity(&frame, &place, &given, &plain),
                    supports::start_context(about, &carried, &plain),
                )
            }
        };
        let mut found = Self {
            groove: None,
            carried: carried(&plain, &inward, support)?,
            strain,
            velocity,
            start_index,
            scales,
            clamp,
            words,
            rod,
            along: LoadsOnRod {
                dead: load,
                turning,
            },
        };
        if let Some(groove) = plain.body.as_ref().and_then(|body| body.groove.as_ref()) {
            found.groove = Some(groove.curve()?.seen_from(&found.clamp(0.0).pose()));
        }
        Ok(found)
    }

    /// Dead load along the rod in the clamp's frame and units of the rod.
    pub(super) fn load(&self) -> Option<DistributedLoad> {
        let back = self.rod.clamp_pose().rotation.inverse();
        Some(self.load_in_world()?.mapped(|f| back * f))
    }

    /// Dead load along the rod in the world and units of the rod.
    pub(super) fn load_in_world(&self) -> Option<DistributedLoad> {
        let unit = self.scales.inward(Quantity::Distributed, 1.0);
        Some(self.along.dead.as_ref()?.mapped(|f| f * unit))
    }

    /// Loads along the rod without a potential, in units of the rod; `inward` maps couples of the world to the frame of
    /// the run.
    pub(super) fn turning(
        &self,
        inward: impl Fn(Vector3<f64>) -> Vector3<f64>,
    ) -> Option<LoadsWithoutPotential> {
        let turning = self.along.turning.as_ref()?;
        Some(turning_in_units(turning, &self.scales, inward))
    }

    /// Loads along the rod.
    pub(super) fn along(&self) -> &LoadsOnRod {
        &self.along
    }

    /// True if any load acts along the rod.
    pub(super) fn bears_load(&self) -> bool {
        !self.along.is_none()
    }

    /// The clamp as a moving support; `None` if at rest.
    pub(super) fn support(&self) -> Option<&Support<3>> {
        self.carried.support()
    }

    /// Frame of the clamp at time `t`.
    pub(super) fn clamp(&self, t: f64) -> Frame<3> {
        match self.support() {
            Some(support) => support.at(t),
            None => {
                let position = self.clamp.translation.vector / self.scales.length;
                Frame::standing(&Isometry3::from_parts(position.into(), self.clamp.rotation))
            }
        }
    }

    /// True if forces without a potential do work on the body or on the rod.
    pub(super) fn is_driven(&self) -> bool {
        self.carried.is_driven() || self.along.turning.is_some()
    }
}

/// A field of all six strains along a rod, in the scene's units.
#[derive(Debug, Clone)]
pub enum SpaceField {
    /// Polynomials; a strain without one has its value in the unloaded rod.
    Polynomial {
        /// The polynomials.
        given: StrainField,
        /// The rod, for its rest strains.
        rod: Box<Rod>,
    },
    /// Strains of an equilibrium.
    Equilibrium {
        /// The rod with its end condition.
        problem: Box<Problem>,
        /// Base wrench of the equilibrium.
        base: Wrench,
        /// Pose of the end in equilibrium.
        end: Isometry3<f64>,
    },
}

/// Mass of the body that stands for a free end, over that of its rod: the end bears loads, and its inertia is below
/// the rounding of that of the rod.
pub(super) const FREE_END: f64 = 1e-30;

/// Tolerance of the integration along an equilibrium at the start.
const SHAPE_TOLERANCE: f64 = 1e-13;

impl SpaceField {
    /// Strains at x = s/L.
    ///
    /// # Errors
    /// As [`Rod::shape`]; a law without an unloaded state at x.
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
            Self::Equilibrium { problem, base, .. } => {
                let sections = problem.sections(base, &[x])?;
                sections
                    .first()
                    .map(|section| section.strain)
                    .ok_or_else(|| Error::domain(format!("no section at s/L = {x}")))
            }
        }
    }

    /// Position of the end, in the clamp's frame and units of the rod.
    fn end(&self, mut breaks: Vec<f64>, scales: &Scales) -> Result<Vector3<f64>> {
        if let Self::Equilibrium { problem, end, .. } = self {
            let clamp = problem.rod().clamp_pose();
            return Ok(clamp.inv_mul(end).translation.vector / problem.rod().length());
        }
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
            if nodes >= MOST_NODES || space.defect(&grid, &curve) <= SHAPE_TOLERANCE {
                return Ok(curve.end().translation.vector);
            }
            nodes *= 2;
        }
    }
}

/// Converter of world vectors to the frame of the clamp.
struct ToClampFrame(Isometry3<f64>);

impl ToClampFrame {
    fn vector(&self, v: &[f64; 3]) -> Vector3<f64> {
        self.0.rotation.inverse() * Vector3::from(*v)
    }

    fn pair(&self, a: &[f64; 3], b: &[f64; 3]) -> Vector6<f64> {
        let (a, b) = (self.vector(a), self.vector(b));
        Vector6::new(a.x, a.y, a.z, b.x, b.y, b.z)
    }
}

/// Joint of a light or heavy rod to the body at its end: a weld to a rigid body, a ball joint to a point mass.
pub(super) fn joint_of(body: &Mass) -> assembly::Joint {
    if body.turns() {
        assembly::Joint::Weld
    } else {
        assembly::Joint::Ball
    }
}

/// The body with its loads in the world frame.
pub(super) fn in_world(plain: &Dimensionless) -> Result<Mass> {
    carried(plain, &ToClampFrame(Isometry3::identity()), None)
}

fn carried(
    plain: &Dimensionless,
    inward: &ToClampFrame,
    support: Option<Support<3>>,
) -> Result<Mass> {
    let loads = &plain.loads;
    // The support of a moving clamp converts the loads itself.
    let vector = |v: &[f64; 3]| match support {
        None => inward.vector(v),
        Some(_) => Vector3::from(*v),
    };
    let frame = match support {
        None => inward.0,
        Some(_) => Isometry3::identity(),
    };
    let body = match plain.body.as_ref().map(|body| &body.joint) {
        Some(Joint::Ball) => {
            let body = point_mass(1.0, loads, |v| vector(&v), &frame, support.clone())?;
            return Ok(Mass::Point(body));
        }
        Some(Joint::Weld {
            offset,
            inertia,
            rotor,
        }) => {
            let inertia = Matrix3::from_fn(|i, j| inertia[i][j]);
            RigidBody::new(1.0, inertia)
                .map_err(|e| e.context("body.inertia, in units of mass length^2"))?
                .with_centre((*offset).into())?
                .with_rotor((*rotor).into())?
        }
        None => RigidBody::new(FREE_END, Matrix3::from_diagonal_element(FREE_END))?,
    };
    let body = acting_on(body, loads, |v| vector(&v), &frame)?;
    Ok(Mass::Rigid(match support {
        None => body,
        Some(support) => body.with_support(support),
    }))
}

/// End condition of the equilibrium at the start; `None` if the start is given otherwise.
fn end(scene: &Scene) -> Result<Option<EndConditions>> {
    Ok(match &scene.start.place {
        InitialShape::Equilibrium {
            equilibrium: EndLoad { force, couple },
        } => Some(EndConditions::load((*force).into(), (*couple).into())),
        InitialShape::Pose {
            pose: EndPose {
                position,
                orientation,
            },
        } => Some(match orientation {
            None => EndConditions::ball((*position).into()),
            Some(orientation) => EndConditions::pose((*position).into(), rotation(orientation)),
        }),
        // With a groove the equilibrium is solved together with the body.
        InitialShape::Settled { .. } if scene.groove().is_none() => Some(at_rest(scene)?),
        _ => None,
    })
}

/// Loads at t = 0 on the end; they act at the centre of mass.
fn at_rest(scene: &Scene) -> Result<EndConditions> {
    let (body, loads) = (scene.body.as_ref(), &scene.loads);
    let mass = body.map_or(0.0, |body| body.mass);
    let constant = Vector3::from(loads.gravity) * mass + Vector3::from(loads.dead);
    let now = |constant: Vector3<f64>, parts: &[Force]| -> Result<_> {
        let parts = in_time("loads", parts, Vector3::from)?;
        Ok(parts
            .iter()
            .fold(constant, |sum, (_, load)| sum + load.at(0.0)))
    };
    let force = now(constant, &loads.force)?;
    let couple = now(loads.couple.constant().into(), loads.couple.in_time())?;
    let arm = match body.map(|body| &body.joint) {
        Some(Joint::Weld { offset, .. }) => (*offset).into(),
        Some(Joint::Ball) | None => Vector3::zeros(),
    };
    Ok(EndConditions::weight(force, arm, couple))
}

/// The equilibrium under the loads at t = 0 if some of them turn with the rod or the body, solved as an assembly of one
/// rod.
fn under_followers(
    rod: &Rod,
    along: &LoadsOnRod,
    base: &Isometry3<f64>,
    plain: &Dimensionless,
    scales: &Scales,
    tolerance: f64,
) -> Result<Option<SpaceField>> {
    let body = in_world(plain)?;
    if !body.is_followed(0.0) && along.turning.is_none() {
        return Ok(None);
    }
    let mut link = Link::new(
        rod.measured(scales.measures()),
        Attachment::ground(*base),
        Attachment::body(0, Isometry3::identity()),
        joint_of(&body),
    );
    if let Some(load) = &along.dead {
        let unit = scales.inward(Quantity::Distributed, 1.0);
        link = link.with_distributed(load.mapped(|f| f * unit))?;
    }
    if let Some(turning) = &along.turning {
        link = link.with_turning(&turning_in_units(turning, scales, |couple| couple))?;
    }
    let assembly = Assembly::new(vec![Body::new(body)], vec![link])?;
    let found = elements::equilibrium(&assembly, tolerance).map_err(|e| e.context("[start]"))?;
    equilibrium_field(rod, along, rod.outward_wrench(&found.now.charts[0])).map(Some)
}

/// Loads without a potential, given in the scene's units, in those of `scales`; `inward` maps couples of the world to
/// the frame of the run.
pub(super) fn turning_in_units(
    given: &LoadsWithoutPotential,
    scales: &Scales,
    inward: impl Fn(Vector3<f64>) -> Vector3<f64>,
) -> LoadsWithoutPotential {
    let force = scales.inward(Quantity::Distributed, 1.0);
    // A couple per length has the unit of a force.
    let couple = scales.inward(Quantity::Force, 1.0);
    LoadsWithoutPotential {
        follower_force: given.follower_force.mapped(|f| f * force),
        couple: given.couple.mapped(|c| inward(c * couple)),
        follower_couple: given.follower_couple.mapped(|c| c * couple),
    }
}

/// Strain field of the rod under the base wrench `base`, for any support of the end.
pub(super) fn equilibrium_field(rod: &Rod, along: &LoadsOnRod, base: Wrench) -> Result<SpaceField> {
    // Only shapes under the base wrench are evaluated. A free end also allows a straight rod, which cannot be held at
    // full reach.
    let free = EndConditions::load(Vector3::zeros(), Vector3::zeros());
    let problem = along.problem(rod, free, SHAPE_TOLERANCE)?;
    let sections = problem.sections(&base, &[1.0])?;
    let end = sections
        .first()
        .ok_or_else(|| Error::domain("the rod has no end"))?
        .pose();
    Ok(SpaceField::Equilibrium {
        problem: Box::new(problem),
        base,
        end,
    })
}

fn equilibrium(
    rod: &Rod,
    along: &LoadsOnRod,
    end: EndConditions,
    guess: Option<&Wrench>,
    tolerance: f64,
) -> Result<(SpaceField, Option<usize>)> {
    let doing = |e: Error| e.context("[start]");
    let found = along
        .problem(rod, end, tolerance)
        .and_then(|problem| problem.solve(guess))
        .map_err(doing)?;
    let field = SpaceField::Equilibrium {
        base: found.base,
        end: found.end.pose(),
        problem: Box::new(along.problem(rod, end, SHAPE_TOLERANCE)?),
    };
    Ok((field, Some(found.index).filter(|_| along.turning.is_none())))
}
