//! A viscoelastic rod in space.

use super::in_space::{InSpace, SpaceField};
use super::{ModelKind, MotionModel};
use crate::body::{EndBody, Frame};
use crate::creep::kinematics::{AtEnd, Local};
use crate::creep::material::Material;
use crate::creep::space::Space;
use crate::error::{Error, Result};
use crate::motion::creep::{ViscousRun, ViscousSample, ViscousStart};
use crate::motion::reduction::{Carried, ReducedStart, Reduction, Refusal};
use crate::motion::{Motion, Options, State};
use crate::scene::{Relaxed, Scene, StrainField, StrainName};
use crate::section::Strain;
use crate::section::rate::Viscoelastic;
use nalgebra::Isometry3;

/// A viscoelastic rod in space. The frame of its body is that of the clamp.
#[derive(Debug, Clone)]
pub struct ViscousSpace {
    /// Body, clamp and start.
    pub common: InSpace,
    /// The section, in the scene's units.
    pub section: Viscoelastic,
    /// Which strains move.
    pub strains: Moving,
    /// Where the Maxwell branches are relaxed at the start, if not there.
    pub relaxed: Option<SpaceField>,
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
        let common = InSpace::new(scene, section.measured(scene.scales()?.measures()).breaks())?;
        let field = |given: &StrainField| SpaceField::Polynomial {
            given: given.clone(),
            rod: common.rod.clone(),
        };
        let relaxed = match &scene.start.relaxed {
            Relaxed::Start => None,
            Relaxed::Strain(given) => Some(field(given)),
            Relaxed::Unloaded | Relaxed::Curvature(_) => Some(field(&StrainField::default())),
        };
        Ok(Self {
            strains: Moving::of(section.elastic.rigid())?,
            section,
            relaxed,
            common,
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
        let material = Material::new(self.section.measured(self.common.scales.measures()), places)?;
        let local = |field: &SpaceField, x: f64| -> Local<M> {
            // NaN is refused by the run, which says where.
            field.at(x).map_or(Local::repeat(f64::NAN), |strain| {
                material.active_of(&self.common.scales.measures().strain_in(&strain))
            })
        };
        let relaxed = self.relaxed.as_ref().map(|field| |x: f64| local(field, x));
        let start = ViscousStart {
            strain: &|x| local(&self.common.strain, x),
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
        .map_err(|e| e.context(self.common.words.as_str()))?;
        Ok(Box::new(run))
    }
}

impl MotionModel for ViscousSpace {
    fn kind(&self) -> ModelKind {
        ModelKind::Space
    }

    /// With the kinematics that its strains and its joint ask for.
    fn motion(&self, options: Options) -> Result<Box<dyn Motion<'_> + '_>> {
        match &self.common.carried {
            Carried::Welded(body) => self.with_body(body, self.common.velocity, options),
            Carried::BallJoint(body) => {
                let velocity = self.common.velocity.fixed_rows::<3>(3).into_owned();
                self.with_body(body, velocity, options)
            }
        }
    }

    fn clamp(&self, t: f64) -> Frame<3> {
        self.common.clamp(t)
    }

    fn is_driven(&self) -> bool {
        self.common.is_driven()
    }

    fn strains(&self) -> Vec<(&'static str, usize)> {
        let names = self.strains.names().iter();
        names.map(|name| (name.as_str(), *name as usize)).collect()
    }

    fn start_index(&self) -> Option<usize> {
        self.common.start_index
    }

    fn reduction(&self) -> Result<Option<std::result::Result<Reduction, Refusal>>> {
        let scaled = |field: &SpaceField, x: f64| -> Result<Strain> {
            Ok(self.common.scales.measures().strain_in(&field.at(x)?))
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
            strains: &sampled(&self.common.strain)?,
            branches: &branches,
            velocity: self.common.velocity,
        };
        let section = self.section.measured(self.common.scales.measures());
        Ok(Some(Reduction::recognise(
            &section,
            &self.common.carried,
            &start,
        )))
    }
}

/// Places at which strains are asked whether they are the same all along the rod.
const PROBES: [f64; 9] = [0.0, 0.03, 0.17, 0.29, 0.5, 0.618, 0.83, 0.97, 1.0];
