//! Rods with their full mass, in the plane and in space, made from a scene of motion.

use super::clamp::{self, start_context};
use super::grooved;
use super::in_space::{FREE_END, SpaceField, SpaceStart, turning_in_units};
use super::loads::point_mass;
use super::obstacles::of_heavy_rods;
use super::planar::start;
use super::viscous::CurvatureField;
use super::{ModelKind, MotionModel};
use crate::assembly::BodyMotion;
use crate::body::{Frame, Mass, PointMass, Support};
use crate::error::{Error, Quantity, Result};
use crate::full_mass::assembly::HeavyAssembly;
use crate::full_mass::frames::Curve;
use crate::full_mass::law::Law;
use crate::full_mass::obstacles::ObstaclesOfRods;
use crate::full_mass::rod::{HeavyRod, RodDescription};
use crate::math::se3::join;
use crate::motion::full_mass::{EndVelocity, HeavyStart, RodStart, StrainAt, heavy_motion};
use crate::motion::{Motion, Options};
use crate::rod::{DistributedLoad, LoadsWithoutPotential};
use crate::scene::{
    Dimensionless, InitialShape, Model, Rod, Scales, Scene, Start, StrainField, StrainName,
    StrainRate,
};
use crate::section::rate::RateLaw;
use crate::section::{Linear, Measures, SectionLaw, Strain};
use nalgebra::{Isometry3, Matrix3, UnitQuaternion, Vector2, Vector3};
use std::sync::Arc;

/// A rod with mass in the plane; a point mass is attached to its end by a ball joint.
#[derive(Debug, Clone)]
pub struct HeavyPlane {
    /// Rod, body and loads.
    pub given: RodDescription,
    /// Curvature at the start, or initial guess of the curvature in equilibrium.
    pub curvature: CurvatureField,
    /// Curvature at which the Maxwell branches are relaxed; `None`: the initial one.
    pub relaxed: Option<CurvatureField>,
    /// Initial rate of the curvature; `None`: the rate of a massless rod following the end.
    pub rate: Option<Vec<f64>>,
    /// True if the run starts from the stable equilibrium under all loads.
    pub settled: bool,
    /// True for an unloaded rod that starts without strain rates on a moving clamp.
    rides: bool,
    /// Velocity of the end.
    pub velocity: EndVelocity,
    /// Obstacles, if there are any.
    obstacles: Option<ObstaclesOfRods>,
    words: String,
}

/// A rod with mass in space.
#[derive(Debug, Clone)]
pub struct HeavySpace {
    /// Body, clamp and start.
    pub common: SpaceStart,
    /// Rod, body and loads.
    pub given: RodDescription,
    /// Strains at which the Maxwell branches are relaxed; `None`: the initial strains.
    pub relaxed: Option<SpaceField>,
    /// Initial strain rates, in units of the rod; `None`: the rates of a massless rod that follows its end.
    pub rate: Option<StrainField>,
    /// True if the run starts from the equilibrium under all loads; without a groove the stable one.
    pub settled: bool,
    /// True if nothing holds the base.
    pub free: bool,
    /// True for an unloaded rod that starts without strain rates on a moving clamp.
    rides: bool,
    /// Obstacles, if there are any.
    obstacles: Option<ObstaclesOfRods>,
    /// Velocity of the end.
    velocity: EndVelocity,
}

/// True for an unloaded rod that starts at rest on its moving clamp. It moves as a rigid one: under a load the rates of
/// the equilibria that the light rod would follow are not its own.
fn rides(start: &Start) -> bool {
    let unloaded = match &start.place {
        InitialShape::Rest { .. } => true,
        InitialShape::Strain { strain } => strain.is_unloaded(),
        _ => false,
    };
    unloaded && start.with_clamp && start.velocity == [0.0; 3] && start.angular_velocity == [0.0; 3]
}

/// Section law with its friction, in the units `measures`.
fn law(rod: &Rod, measures: Measures, active: &[usize]) -> Result<Law> {
    let (elastic, friction): (Arc<dyn SectionLaw>, Option<Arc<dyn RateLaw>>) = match &rod.damping {
        Some(_) => {
            let section = rod.viscoelastic()?.law_in_units(measures);
            let law = Law::new(section.elastic, Some(section.rate), active)?;
            return Ok(law.with_branches(section.branches));
        }
        None if rod.model == Model::Elastica => (Arc::new(Linear::diagonal([1.0; 2], 1.0)?), None),
        None => (rod.unclamped()?.measured(measures).law().clone(), None),
    };
    Law::new(elastic, friction, active)
}

/// Mass of the rod over the unit of mass.
fn mass(rod: &Rod, scales: &Scales) -> Result<f64> {
    if !rod.is_heavy() {
        return Err(Error::domain(
            "rod.inertia: a rod with mass has inertia = \"full\"",
        ));
    }
    rod.known_mass_over_unit(scales)
}

/// Section law in space with its active strains, the mass and the rotary inertia of the sections, in units of `scales`.
///
/// # Errors
/// As [`Scene::viscoelastic`]; a rod without mass.
pub(in crate::scene) fn heavy_law_in_space(
    rod: &Rod,
    scales: &Scales,
) -> Result<(Law, f64, Option<Matrix3<f64>>)> {
    let rigid = rod.unclamped()?.law().rigid();
    let active: Vec<usize> = (0..6).filter(|k| !rigid[*k]).collect();
    let measures = scales.measures();
    Ok((
        law(rod, measures, &active)?.with_law_in_time(rod.law_in_time(measures)?),
        mass(rod, scales)?,
        rotary(rod, scales)?,
    ))
}

/// A point of mass 1 on the clamp of the rod, under gravity alone.
pub(super) fn unit_point_mass(
    gravity: Vector3<f64>,
    support: Option<Support<3>>,
) -> Result<PointMass<3>> {
    let grain = PointMass::new(1.0)?.with_gravity(gravity)?;
    Ok(match support {
        Some(support) => grain.with_support(support),
        None => grain,
    })
}

impl HeavyPlane {
    /// Finds the start and converts to units of the rod.
    ///
    /// # Errors
    /// As [`Scene::viscoelastic`]; a start position with no matching equilibrium, or with several; a rod without mass.
    pub fn new(scene: &Scene) -> Result<Self> {
        let (plain, scales) = (scene.dimensionless()?, scene.scales()?);
        let support = clamp::clamp_in_space(&plain.clamp)?;
        let mass_at_end = plain.body.as_ref().map_or(FREE_END, |_| 1.0);
        let (loads, world) = (&plain.loads, Isometry3::identity());
        let body = point_mass(mass_at_end, loads, Vector3::from, &world, support.clone())?;
        let given = RodDescription {
            law: law(&scene.rod, scales.measures(), &[StrainName::U1 as usize])?,
            curve: Curve::Plane,
            mass: mass(&scene.rod, &scales)?,
            rotary: None,
            along: None,
            grain: unit_point_mass(plain.loads.gravity.into(), support.clone())?,
            distributed: distributed(&plain, (&scene.rod, &scales), Vector3::from)?,
            turning: None,
            body: Some(Mass::Point(body)),
            // Planar rods pass beside each other without contact.
            diameter: None,
        };
        let settled = matches!(plain.start.place, InitialShape::Settled { .. });
        let curvature = match &plain.start.place {
            InitialShape::Curvature { curvature } => CurvatureField::Polynomial(curvature.clone()),
            InitialShape::Settled { .. } => CurvatureField::Polynomial(vec![0.0]),
            _ => match start(scene, &plain)? {
                None => CurvatureField::Polynomial(vec![0.0]),
                Some(rod) => CurvatureField::Equilibrium(Box::new(rod)),
            },
        };
        let rate = match &plain.start.rate {
            Some(StrainRate::Curvature(rate)) => Some(rate.clone()),
            // Without given rates the rod is at rest, unless its end moves.
            None => None,
            Some(StrainRate::Strain(_)) => {
                return Err(Error::domain("start.strain_rate is for a rod in space"));
            }
        };
        let given_velocity = join(&Vector3::zeros(), &plain.start.velocity.into());
        let words = match &support {
            None => "[start]".to_owned(),
            Some(support) => {
                let end = curvature.end();
                let place = Vector3::new(end.x, end.y, 0.0);
                let frame = support.at(0.0);
                let carried =
                    frame.outward(&frame.velocity_of_fixed_point(&place)) * scales.velocity;
                start_context("[start]", &[("velocity", &carried.as_slice()[..2])], &plain)
            }
        };
        Ok(Self {
            given,
            curvature,
            relaxed: CurvatureField::relaxed(&plain.start.relaxed)?,
            rate,
            settled,
            rides: rides(&scene.start),
            velocity: clamp::end_velocity(support.as_ref(), &given_velocity, &plain),
            obstacles: of_heavy_rods(scene, &standing_clamp(support.as_ref()))?,
            words,
        })
    }
}

/// The place of a clamp at the start of a motion.
fn standing_clamp(support: Option<&Support<3>>) -> Isometry3<f64> {
    support.map_or_else(Isometry3::identity, |support| support.at(0.0).pose())
}

/// The rods among obstacles, if there are any.
fn among(rods: HeavyAssembly, obstacles: Option<&ObstaclesOfRods>) -> HeavyAssembly {
    match obstacles {
        Some(obstacles) => rods.among(obstacles.clone()),
        None => rods,
    }
}

impl HeavyPlane {
    /// The rod with its body, in the clamp's frame.
    ///
    /// # Errors
    /// As [`HeavyRod::new`].
    pub fn assembly(&self) -> Result<HeavyAssembly> {
        let alone = HeavyAssembly::of_rod(HeavyRod::coarse(self.given.clone())?)?;
        Ok(among(alone, self.obstacles.as_ref()))
    }

    /// Start of [`HeavyPlane::assembly`].
    pub fn start(&self) -> HeavyStart<'_> {
        let relaxed = self.relaxed.as_ref();
        let rod = RodStart {
            base: UnitQuaternion::identity(),
            strain: Box::new(|s| bent(self.curvature.at(s)[0])),
            relaxed: relaxed.map(|field| Box::new(|s| bent(field.at(s)[0])) as StrainAt<'_>),
            rate: Box::new(|s| {
                let rate = self.rate.iter().flatten().rev();
                Strain::x() * rate.fold(0.0, |sum, c| sum * s + c)
            }),
            velocity: Some(self.velocity),
        };
        HeavyStart {
            bodies: Vec::new(),
            rods: vec![rod],
            joints: Vec::new(),
            settled: self.settled,
            following: self.rate.is_none() && !self.rides,
        }
    }
}

/// Load along the rod `rod` of the scene without its weight. `inward` maps world vectors to the frame of the run.
fn distributed(
    plain: &Dimensionless,
    (rod, scales): (&Rod, &Scales),
    inward: impl Fn([f64; 3]) -> Vector3<f64>,
) -> Result<Option<DistributedLoad>> {
    let unit = scales.inward(Quantity::Distributed, 1.0);
    let listed = rod.dead_forces()?.mapped(|f| f * unit);
    let whole = plain.loads.distributed.on(1.0)?.plus(&listed)?;
    Ok(if whole.is_zero() {
        None
    } else {
        Some(whole.mapped(|f| inward((*f).into())))
    })
}

/// Loads of the list on a rod that have no potential, in units of `scales`; `None` without such loads. `inward` maps
/// couples of the world to the frame of the run.
pub(super) fn turning_on(
    rod: &Rod,
    scales: &Scales,
    inward: impl Fn(Vector3<f64>) -> Vector3<f64>,
) -> Result<Option<LoadsWithoutPotential>> {
    if !rod.has_turning_loads() {
        return Ok(None);
    }
    Ok(Some(turning_in_units(
        &rod.turning_loads()?,
        scales,
        inward,
    )))
}

fn bent(curvature: f64) -> Strain {
    Strain::new(curvature, 0.0, 0.0, 0.0, 0.0, 1.0)
}

impl MotionModel for HeavyPlane {
    fn kind(&self) -> ModelKind {
        ModelKind::Planar
    }

    fn motion(&self, options: Options) -> Result<Box<dyn Motion<'_> + '_>> {
        let run = heavy_motion(&self.assembly()?, &self.start(), options);
        run.map_err(|e| e.context(self.words.as_str()))
    }

    fn load(&self) -> Option<Vector2<f64>> {
        let stands = (self.given.grain.support()).is_none_or(|support| support.is_fixed());
        match &self.given.body {
            Some(Mass::Point(body)) if stands => Some(body.load(0.0).xy()),
            _ => None,
        }
    }

    fn clamp(&self, t: f64) -> Frame<3> {
        match self.given.grain.support() {
            Some(support) => support.at(t),
            None => Frame::standing(&Isometry3::identity()),
        }
    }

    fn is_driven(&self) -> bool {
        self.given.body.as_ref().is_some_and(Mass::is_driven)
    }

    fn strains(&self) -> Vec<(&'static str, usize)> {
        vec![("curvature", StrainName::U1 as usize)]
    }

    fn is_heavy(&self) -> bool {
        true
    }
}

impl HeavySpace {
    /// Finds the start and converts to units of the rod.
    ///
    /// # Errors
    /// As [`Scene::viscoelastic`]; a rod without mass; a start for which no equilibrium is found.
    pub fn new(scene: &Scene) -> Result<Self> {
        let (plain, scales) = (scene.dimensionless()?, scene.scales()?);
        let (law, mass, rotary) = heavy_law_in_space(&scene.rod, &scales)?;
        let mut common = SpaceStart::new(scene, law.breaks())?;
        let settled = matches!(scene.start.place, InitialShape::Settled { .. });
        if settled && common.groove.is_some() {
            common.strain = grooved::settled(scene)?;
        }
        let (body, support) = (common.carried.clone(), common.support().cloned());
        let start = &plain.start;
        let velocity = match &support {
            None => common.velocity,
            Some(_) => join(&start.angular_velocity.into(), &start.velocity.into()),
        };
        // The support of a moving clamp converts the loads itself.
        let inward = |v: [f64; 3]| match support {
            None => common.clamp.rotation.inverse() * Vector3::from(v),
            Some(_) => Vector3::from(v),
        };
        let given = RodDescription {
            law,
            curve: Curve::Space,
            mass,
            rotary,
            along: scene.rod.mass_along(),
            grain: unit_point_mass(inward(plain.loads.gravity), support.clone())?,
            distributed: distributed(&plain, (&scene.rod, &scales), inward)?,
            turning: turning_on(&scene.rod, &scales, |couple| inward(couple.into()))?,
            body: Some(body),
            diameter: scene.rod.thickness().map(|d| d / common.scales.length),
        };
        Ok(Self {
            given,
            rate: match &plain.start.rate {
                Some(StrainRate::Strain(rate)) => Some(rate.clone()),
                _ => None,
            },
            relaxed: common.relaxed(scene),
            settled,
            free: scene.clamp.free,
            rides: rides(&scene.start),
            velocity: clamp::end_velocity(support.as_ref(), &velocity, &plain),
            obstacles: of_heavy_rods(scene, &common.clamp(0.0).pose())?,
            common,
        })
    }

    /// The rod with its body, in the clamp's frame.
    ///
    /// # Errors
    /// As [`HeavyRod::new`].
    pub fn assembly(&self) -> Result<HeavyAssembly> {
        let rod = || HeavyRod::coarse(self.given.clone());
        let alone = match &self.common.groove {
            None if self.free => HeavyAssembly::of_free_rod(rod()?),
            None => HeavyAssembly::of_rod(rod()?),
            Some(groove) => self.grooved(groove),
        };
        Ok(among(alone?, self.obstacles.as_ref()))
    }

    /// Start of [`HeavySpace::assembly`].
    ///
    /// # Errors
    /// Strains that give no shape.
    pub fn start(&self) -> Result<HeavyStart<'_>> {
        let relaxed = self.relaxed.as_ref();
        let rod = RodStart {
            base: UnitQuaternion::identity(),
            strain: Box::new(|s| self.strain_at(s)),
            relaxed: relaxed.map(|field| Box::new(|s| self.scaled(field, s)) as StrainAt<'_>),
            rate: Box::new(|s| self.rate_at(s)),
            velocity: Some(self.velocity),
        };
        let bodies = match &self.common.groove {
            Some(_) => vec![self.body_in_groove()?],
            None if self.free => vec![BodyMotion {
                pose: Isometry3::identity(),
                twist: self.common.velocity,
            }],
            None => Vec::new(),
        };
        Ok(HeavyStart {
            bodies,
            rods: vec![rod],
            joints: Vec::new(),
            settled: self.settled,
            // A free rod without strain rates moves as it is.
            following: self.rate.is_none() && !self.free && !self.rides,
        })
    }

    /// All strains of the start at s in [0, 1], in units of the rod; NaN if undefined.
    pub(super) fn strain_at(&self, s: f64) -> Strain {
        self.scaled(&self.common.strain, s)
    }

    /// Strains of this field at s in [0, 1], in units of the rod; NaN if undefined.
    pub(super) fn scaled(&self, field: &SpaceField, s: f64) -> Strain {
        let measures = self.common.scales.measures();
        let strain = field.at(s).map(|e| measures.strain_in(&e));
        strain.unwrap_or(Strain::repeat(f64::NAN))
    }

    /// Initial strain rates at s; zero if not given.
    pub(super) fn rate_at(&self, s: f64) -> Strain {
        let of = |name: StrainName| self.rate.as_ref().and_then(|rate| rate.at(name, s));
        Strain::from_fn(|k, _| of(StrainName::ALL[k]).unwrap_or(0.0))
    }
}

/// Rotary inertia of the sections per length, about their centres along their directors, in units of the rod.
/// `None` for slender sections, whose inertia nothing tells.
fn rotary(rod: &Rod, scales: &Scales) -> Result<Option<Matrix3<f64>>> {
    let Some(rotary) = rod.rotary_over_unit(scales)? else {
        return Ok(None);
    };
    if rotary.iter().all(|j| j.is_normal() && *j > 0.0) {
        Ok(Some(Matrix3::from_diagonal(&rotary)))
    } else {
        let given = rod.rotary_inertia()?.unwrap_or_default();
        Err(Error::domain(format!(
            "rod.section_inertia = {given:?} must be finite and > 0"
        )))
    }
}

impl MotionModel for HeavySpace {
    fn kind(&self) -> ModelKind {
        ModelKind::Space
    }

    fn motion(&self, options: Options) -> Result<Box<dyn Motion<'_> + '_>> {
        let run = || heavy_motion(&self.assembly()?, &self.start()?, options);
        run().map_err(|e| e.context(self.common.words.as_str()))
    }

    fn clamp(&self, t: f64) -> Frame<3> {
        self.common.clamp(t)
    }

    fn is_driven(&self) -> bool {
        self.common.is_driven()
    }

    fn strains(&self) -> Vec<(&'static str, usize)> {
        let active = self.given.law.active().iter();
        active.map(|k| (StrainName::ALL[*k].as_str(), *k)).collect()
    }

    fn looks_for_contact(&self) -> bool {
        self.given.diameter.is_some()
    }

    fn start_index(&self) -> Option<usize> {
        None
    }

    fn is_heavy(&self) -> bool {
        true
    }
}
