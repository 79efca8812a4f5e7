//! A viscoelastic rod in space, made from a scene of motion.

use super::in_space::{SpaceField, SpaceStart};
use super::obstacles::Obstacles;
use super::{ModelKind, MotionModel};
use crate::body::Frame;
use crate::error::{Quantity, Result};
use crate::motion::reduction::{ReducedStart, Reduction, Refusal};
use crate::motion::viscoelastic::{AlongRod, FreeStrains, ViscousStart, in_space};
use crate::motion::{Motion, Options};
use crate::scene::Scene;
use crate::section::rate::Viscoelastic;
use crate::section::{LawInTime, Strain};

/// A viscoelastic rod in space. The body is described in the frame of the clamp.
#[derive(Debug, Clone)]
pub struct ViscousSpace {
    /// Body, clamp and start.
    pub common: SpaceStart,
    /// The section, in the scene's units.
    pub section: Viscoelastic,
    /// Strains that can change.
    pub strains: FreeStrains,
    /// Strains at which the Maxwell branches are relaxed; `None`: the initial strains.
    pub relaxed: Option<SpaceField>,
    /// Elastic law that varies in time.
    in_time: Option<LawInTime>,
    /// Obstacles that the body hits.
    obstacles: Option<Obstacles>,
    /// Contact diameter of the rod, in units of the rod.
    diameter: f64,
}

impl Scene {
    /// Strains that can change in a motion in space.
    ///
    /// # Errors
    /// As [`Scene::cosserat_rod`]; shear and stretch held rigid in a combination that has no kinematics.
    pub fn moving(&self) -> Result<FreeStrains> {
        FreeStrains::of(self.cosserat_rod()?.law().rigid())
    }
}

impl ViscousSpace {
    /// Finds the start and converts to units of the rod.
    ///
    /// # Errors
    /// As [`Scene::viscoelastic`]; shear and stretch held rigid in a combination that has no kinematics; a start for
    /// which no equilibrium is found.
    pub fn new(scene: &Scene) -> Result<Self> {
        let section = scene.viscoelastic()?;
        let common = SpaceStart::new(
            scene,
            section.law_in_units(scene.scales()?.measures()).breaks(),
        )?;
        Ok(Self {
            strains: FreeStrains::of(section.elastic.rigid())?,
            section,
            relaxed: common.relaxed(scene),
            in_time: scene.rod.law_in_time(scene.scales()?.measures())?,
            obstacles: Obstacles::of_end_body(scene)?,
            diameter: (common.scales)
                .inward(Quantity::Length, scene.rod.thickness().unwrap_or(0.0)),
            common,
        })
    }
}

impl MotionModel for ViscousSpace {
    fn kind(&self) -> ModelKind {
        ModelKind::Space
    }

    fn motion(&self, options: Options) -> Result<Box<dyn Motion<'_> + '_>> {
        let measures = self.common.scales.measures();
        // The run rejects NaN and reports its place.
        let scaled = |field: &SpaceField, x: f64| {
            let strain = field.at(x).map(|strain| measures.strain_in(&strain));
            strain.unwrap_or(Strain::repeat(f64::NAN))
        };
        let relaxed = self.relaxed.as_ref().map(|field| |x: f64| scaled(field, x));
        let start = ViscousStart {
            strain: &|x| scaled(&self.common.strain, x),
            relaxed: relaxed.as_ref().map(|f| f as &dyn Fn(f64) -> Strain),
            velocity: self.common.velocity,
        };
        let section = self.section.law_in_units(measures);
        let back = self.common.clamp(0.0).pose().rotation.inverse();
        let along = AlongRod {
            dead: self.common.load(),
            turning: self.common.turning(|couple| back * couple),
            law_in_time: self.in_time.clone(),
        };
        let body = &self.common.carried;
        let clamp = self.common.clamp(0.0).pose();
        let around = (self.obstacles.as_ref()).map(|all| all.around(clamp, self.diameter));
        in_space(section, self.strains, along, body, &start, around, options)
            .map_err(|e| e.context(self.common.words.as_str()))
    }

    fn clamp(&self, t: f64) -> Frame<3> {
        self.common.clamp(t)
    }

    fn is_driven(&self) -> bool {
        self.common.is_driven() || self.in_time.is_some()
    }

    fn strains(&self) -> Vec<(&'static str, usize)> {
        let names = self.strains.names().iter();
        names.map(|name| (name.as_str(), *name as usize)).collect()
    }

    fn start_index(&self) -> Option<usize> {
        self.common.start_index
    }

    fn reduction(&self) -> Result<Option<std::result::Result<Reduction, Refusal>>> {
        if self.common.bears_load() || self.in_time.is_some() || self.common.carried.has_functions()
        {
            // A load along the rod prevents uniform strains. Springs neither vary in time nor bear functions.
            return Ok(None);
        }
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
        let section = self.section.law_in_units(self.common.scales.measures());
        Ok(Some(Reduction::recognise(
            &section,
            &self.common.carried,
            &start,
        )))
    }
}

/// Places at which the uniformity of the strains is tested.
const PROBES: [f64; 9] = [0.0, 0.03, 0.17, 0.29, 0.5, 0.618, 0.83, 0.97, 1.0];
