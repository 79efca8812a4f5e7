//! A viscoelastic rod in a plane, made from a scene of motion.

use super::clamp::{self, ClampFrame};
use super::in_space::SpaceField;
use super::obstacles::Obstacles;
use super::planar::{body, load_on_fixed_clamp, start};
use super::{ElasticSpace, ModelKind, MotionModel};
use crate::body::{Frame, PointMass};
use crate::elastica::Equilibrium;
use crate::elastica::straight_beam::{EULER, unstable_push_error};
use crate::error::{Error, Quantity, Result};
use crate::math::gauss::Rule;
use crate::motion::viscoelastic::{ViscousStart, in_plane};
use crate::motion::{Motion, Options};
use crate::rod::DistributedLoad;
use crate::scene::{Dimensionless, InitialShape, RelaxedAt, Scene, StrainName};
use crate::viscoelastic::kinematics::Local;
use crate::viscoelastic::material::Material;
use nalgebra::{UnitQuaternion, Vector1, Vector2};

/// A viscoelastic rod in a plane.
#[derive(Debug, Clone)]
pub struct ViscousPlane {
    /// The mass and its loads.
    pub body: PointMass<2>,
    /// The section.
    pub material: Material<1>,
    /// The strains at the start.
    pub strain: CurvatureField,
    /// Curvature at which the Maxwell branches are relaxed; `None`: the initial one.
    pub relaxed: Option<CurvatureField>,
    /// Velocity at the start.
    pub velocity: Vector2<f64>,
    /// Obstacles that the body hits.
    obstacles: Option<Obstacles>,
    /// Context of messages about the start.
    words: String,
}

/// Panels, and Gauss nodes per panel, of the integral to the end of a rod of given curvature.
const PANELS: usize = 32;
const NODES_PER_PANEL: usize = 10;

/// A field of curvature, s in [0, 1].
#[derive(Debug, Clone)]
pub enum CurvatureField {
    /// c0 + c1 s + ...
    Polynomial(Vec<f64>),
    /// Curvature of an equilibrium.
    Equilibrium(Box<Equilibrium>),
    /// Curvature of an equilibrium under a load along the rod, computed in space.
    Bearing {
        /// The strains.
        strains: Box<SpaceField>,
        /// Length of the rod in the units of `strains`.
        length: f64,
        /// Position of the end.
        end: Vector2<f64>,
    },
}

impl CurvatureField {
    /// Curvature at which the Maxwell branches of a planar rod are relaxed; `None`: the initial one.
    ///
    /// # Errors
    /// Strains, which are for a rod in space.
    pub(super) fn relaxed(relaxed: &RelaxedAt) -> Result<Option<Self>> {
        Ok(match relaxed {
            RelaxedAt::Start => None,
            RelaxedAt::Unloaded => Some(Self::Polynomial(vec![0.0])),
            RelaxedAt::Curvature(curvature) => Some(Self::Polynomial(curvature.clone())),
            RelaxedAt::Strain(_) => {
                return Err(Error::domain(
                    "start.relaxed: strains are for a rod in space",
                ));
            }
        })
    }

    /// Curvature at s.
    pub fn at(&self, s: f64) -> Local<1> {
        Vector1::new(match self {
            Self::Polynomial(c) => c.iter().rev().fold(0.0, |sum, c| sum * s + c),
            // Every point of the chart has a curvature. The run rejects NaN.
            Self::Equilibrium(rod) => rod.section(s).map_or(f64::NAN, |at| at.curvature),
            Self::Bearing {
                strains, length, ..
            } => strains.at(s).map_or(f64::NAN, |e| e[BENDING] * length),
        })
    }

    /// Position of the end: the integral of (cos theta, sin theta), theta = c0 s + c1 s^2/2 + ...
    pub(super) fn end(&self) -> Vector2<f64> {
        let curvature = match self {
            Self::Equilibrium(rod) => return Vector2::new(rod.x, rod.y),
            Self::Bearing { end, .. } => return *end,
            Self::Polynomial(curvature) => curvature,
        };
        let rule = Rule::new(NODES_PER_PANEL);
        let theta = |s: f64| {
            let term = |(k, c): (usize, &f64)| c * s.powi(k as i32 + 1) / (k + 1) as f64;
            curvature.iter().enumerate().map(term).sum::<f64>()
        };
        let point = |panel: usize, i: usize| {
            let (sin, cos) = theta((panel as f64 + rule.nodes[i]) / PANELS as f64).sin_cos();
            Vector2::new(cos, sin) * (rule.weights[i] / PANELS as f64)
        };
        (0..PANELS)
            .flat_map(|panel| (0..NODES_PER_PANEL).map(move |i| (panel, i)))
            .map(|(panel, i)| point(panel, i))
            .sum()
    }
}

impl ViscousPlane {
    /// Finds the start.
    ///
    /// # Errors
    /// As [`Scene::viscoelastic`]; a start position with no matching equilibrium, or with several; scales at which the
    /// law over- or underflows.
    pub fn new(scene: &Scene) -> Result<Self> {
        let (plain, scales) = (scene.dimensionless()?, scene.scales()?);
        let law = scene.viscoelastic()?.law_in_units(scales.measures());
        let load = load_in_plane(scene)?;
        let strain = match &plain.start.place {
            InitialShape::Curvature { curvature } => CurvatureField::Polynomial(curvature.clone()),
            InitialShape::Settled { .. } if load.is_some() => {
                let space = ElasticSpace::new(&scene.planar_in_space()?)?;
                let end = space.end().translation.vector;
                CurvatureField::Bearing {
                    strains: Box::new(space.common.strain),
                    length: scales.length,
                    // The plane is spanned by d3 and -d2.
                    end: Vector2::new(end.z, -end.y),
                }
            }
            _ => match start(scene, &plain)? {
                None => {
                    stays_straight(&plain)?;
                    CurvatureField::Polynomial(vec![0.0])
                }
                Some(rod) => {
                    // At full reach double precision cannot resolve the arclength.
                    rod.section(0.5).map_err(|e| {
                        e.context("[start]: the rod is held so near to its full reach that it cannot be followed; start further inside")
                    })?;
                    CurvatureField::Equilibrium(Box::new(rod))
                }
            },
        };
        let relaxed = CurvatureField::relaxed(&plain.start.relaxed)?;
        let seen = ClampFrame(clamp::planar(&plain.clamp)?);
        let (velocity, words) = seen.velocity(&strain.end(), &plain, "[start]", &scales);
        Ok(Self {
            body: body(&plain)?,
            material: Material::new(law, [BENDING])?.under(load),
            strain,
            relaxed,
            velocity,
            obstacles: Obstacles::of_point_mass(scene)?,
            words,
        })
    }
}

/// Dead load along a planar rod without inertia, in the clamp's frame and units of the rod.
pub(super) fn load_in_plane(scene: &Scene) -> Result<Option<DistributedLoad>> {
    let (plain, scales) = (scene.dimensionless()?, scene.scales()?);
    let Some(load) = scene.light_load()? else {
        return Ok(None);
    };
    let unit = scales.inward(Quantity::Distributed, 1.0);
    let frame =
        clamp::clamp_in_space(&plain.clamp)?.map(|support| support.pose(0.0).rotation.inverse());
    let back = frame.unwrap_or_else(UnitQuaternion::identity);
    Ok(Some(load.mapped(|f| back * f * unit)))
}

impl MotionModel for ViscousPlane {
    fn kind(&self) -> ModelKind {
        ModelKind::Planar
    }

    fn motion(&self, options: Options) -> Result<Box<dyn Motion<'_> + '_>> {
        let relaxed = self.relaxed.as_ref().map(|field| |s: f64| field.at(s));
        let start = ViscousStart {
            strain: &|s| self.strain.at(s),
            relaxed: relaxed.as_ref().map(|f| f as &dyn Fn(f64) -> Local<1>),
            velocity: self.velocity,
        };
        let clamp = self.clamp(0.0).pose();
        let around = (self.obstacles.as_ref()).map(|all| all.around(clamp, 0.0));
        in_plane(self.material.clone(), &self.body, &start, around, options)
            .map_err(|e| e.context(self.words.as_str()))
    }

    fn clamp(&self, t: f64) -> Frame<3> {
        clamp::frame(&self.body, t)
    }

    fn load(&self) -> Option<Vector2<f64>> {
        load_on_fixed_clamp(&self.body)
    }

    fn is_driven(&self) -> bool {
        self.body.is_driven()
    }

    fn strains(&self) -> Vec<(&'static str, usize)> {
        vec![("curvature", BENDING)]
    }
}

/// Rejects a straight rod without transverse loads or velocity under a thrust beyond Euler's load: it would stay
/// straight for ever.
fn stays_straight(plain: &Dimensionless) -> Result<()> {
    let (body, start) = (body(plain)?, &plain.start);
    let (load, free) = (body.load(0.0), start.relaxed == RelaxedAt::Start);
    let idle = load.y == 0.0 && start.velocity == [0.0; 3] && !body.is_driven() && free;
    if idle && load.x < -EULER {
        Err(unstable_push_error(-load.x).context("[start]"))
    } else {
        Ok(())
    }
}

/// Index of the bending strain of a planar rod.
const BENDING: usize = StrainName::U1 as usize;
