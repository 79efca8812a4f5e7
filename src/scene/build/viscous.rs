//! From a planar scene with damping to a viscoelastic run, in units of the rod.

use super::clamp::{self, Seen};
use super::planar::{body, start};
use super::section::ELASTIC;
use crate::body::Body;
use crate::creep::kinematics::Local;
use crate::creep::material::Material;
use crate::creep::plane::Plane;
use crate::elastica::Equilibrium;
use crate::error::{Error, Result};
use crate::math::gauss::Rule;
use crate::motion::creep::{ViscousRun, ViscousStart};
use crate::motion::{Nodes, Options};
use crate::scene::{Place, Relaxed, Scales, Scene, StrainName};
use nalgebra::{Vector1, Vector2};

/// A planar viscoelastic scene made ready to run: length, stiffness and mass are 1.
#[derive(Debug, Clone)]
pub struct ViscousSetup {
    /// The mass and its loads.
    pub body: Body<2>,
    /// The section.
    pub material: Material<1>,
    /// Viscosity eta at small rates.
    pub viscosity: f64,
    /// The strains at the start.
    pub strain: Field,
    /// Where the Maxwell branches are relaxed at the start, if not there.
    pub relaxed: Option<Field>,
    /// Velocity at the start.
    pub velocity: Vector2<f64>,
    /// What to run.
    pub options: Options,
    /// The way back to the scene's units.
    pub scales: Scales,
}

/// Panels, and Gauss nodes in each, of the integral to the end of a rod of given curvature.
const PANELS: usize = 32;
const PANEL: usize = 10;

/// A field of curvature, s in [0, 1].
#[derive(Debug, Clone)]
pub enum Field {
    /// c0 + c1 s + ...
    Polynomial(Vec<f64>),
    /// That of an equilibrium.
    Equilibrium(Box<Equilibrium>),
}

impl Field {
    /// The curvature at s.
    pub fn at(&self, s: f64) -> Local<1> {
        Vector1::new(match self {
            Self::Polynomial(c) => c.iter().rev().fold(0.0, |sum, c| sum * s + c),
            // A rod of a chart has a curvature everywhere; NaN is refused by the run.
            Self::Equilibrium(rod) => rod.section(s).map_or(f64::NAN, |at| at.curvature),
        })
    }

    /// Where the end is: the integral of (cos theta, sin theta), theta = c0 s + c1 s^2/2 + ...
    fn end(&self) -> Vector2<f64> {
        let curvature = match self {
            Self::Equilibrium(rod) => return Vector2::new(rod.x, rod.y),
            Self::Polynomial(curvature) => curvature,
        };
        let rule = Rule::new(PANEL);
        let theta = |s: f64| {
            let term = |(k, c): (usize, &f64)| c * s.powi(k as i32 + 1) / (k + 1) as f64;
            curvature.iter().enumerate().map(term).sum::<f64>()
        };
        let point = |panel: usize, i: usize| {
            let (sin, cos) = theta((panel as f64 + rule.nodes[i]) / PANELS as f64).sin_cos();
            Vector2::new(cos, sin) * (rule.weights[i] / PANELS as f64)
        };
        (0..PANELS)
            .flat_map(|panel| (0..PANEL).map(move |i| (panel, i)))
            .map(|(panel, i)| point(panel, i))
            .sum()
    }
}

impl ViscousSetup {
    /// Finds the start and scales everything.
    ///
    /// # Errors
    /// A scene without damping; a start position with no equilibrium as asked for, or with several; scales at which the
    /// law is not one of doubles.
    pub fn new(scene: &Scene) -> Result<Self> {
        let (plain, run) = (scene.dimensionless()?, scene.run()?);
        let viscosity = plain.viscosity();
        if !(viscosity > 0.0) {
            return Err(Error::domain(format!(
                "{ELASTIC} no strains of its own to be followed; write damping > 0"
            )));
        }
        let mut options = Options::new(plain.duration)?
            .with_tolerance(run.tolerance)
            .map_err(|e| e.context("[run]"))?
            .with_nodes(scene.rod.nodes.map_or(Nodes::Adaptive, Nodes::Fixed))
            .with_method(run.method);
        options.max_steps = run.max_steps as u64;
        let strain = match &plain.start.place {
            Place::Curvature { curvature } => Field::Polynomial(curvature.clone()),
            _ => match start(scene, &plain)? {
                None => Field::Polynomial(vec![0.0]),
                Some(rod) => {
                    // A rod drawn to its full reach has no arclength that double precision holds.
                    rod.section(0.5).map_err(|e| {
                        e.context("[start]: the rod is held so near to its full reach that it cannot be followed; start further inside")
                    })?;
                    Field::Equilibrium(Box::new(rod))
                }
            },
        };
        let relaxed = match plain.start.relaxed.clone() {
            Relaxed::Start => None,
            Relaxed::Unloaded => Some(Field::Polynomial(vec![0.0])),
            Relaxed::Curvature(curvature) => Some(Field::Polynomial(curvature)),
            Relaxed::Strain(_) => {
                return Err(Error::domain(
                    "start.relaxed: strains are for a rod in space",
                ));
            }
        };
        let seen = Seen(clamp::planar(&plain.clamp)?);
        let velocity = seen.velocity(&strain.end(), plain.start.velocity);
        let scales = scene.scales()?;
        let law = scene.viscoelastic()?.measured(scales.measures());
        Ok(Self {
            body: body(&plain)?,
            material: Material::new(law, [StrainName::U1 as usize])?,
            viscosity,
            strain,
            relaxed,
            velocity,
            options,
            scales,
        })
    }

    /// The run.
    ///
    /// # Errors
    /// As [`ViscousRun::new`].
    pub fn run(&self) -> Result<ViscousRun<'_, Plane, Body<2>, 1, 2>> {
        let relaxed = self.relaxed.as_ref().map(|field| |s: f64| field.at(s));
        let start = ViscousStart {
            strain: &|s| self.strain.at(s),
            relaxed: relaxed.as_ref().map(|f| f as &dyn Fn(f64) -> Local<1>),
            velocity: self.velocity,
        };
        ViscousRun::new(
            Plane,
            self.material.clone(),
            &self.body,
            &start,
            self.options,
        )
        .map_err(|e| e.context("[start]"))
    }
}
