//! One rod with a body at its end, as the model of a run.

use super::header::{RunBody, RunHeader, RunRod};
use super::moment::{BodyMoment, EndAction};
use super::outward::{self, RunBounce};
use super::prepared::{RunModel, RunStart};
use super::rest::{LazyRest, RestState};
use super::shapes::Shapes;
use super::spring::Spring;
use crate::assembly::{self, Contact};
use crate::elastica::Elastica;
use crate::error::{Error, Quantity, Result};
use crate::math::se3::{halves, join};
use crate::motion::{
    Bounce, EndInWorld, LightReference, MasslessRod, SectionState, Snap, State, curve_outward,
    outward,
};
use crate::scene::{Joint, Scene, Setup};
use crate::study::Solid;
use crate::study::neglected_mass::{PlanarRodMass, RodsAtRest, viscosity};
use crate::study::stations::{self, StationValues};
use nalgebra::{DVector, Isometry3, Vector3};

/// One rod ready to run.
pub(super) struct OneRod {
    setup: Setup,
    /// A rod of known mass on a fixed clamp.
    massive: Option<RodOfKnownMass>,
    /// True if Maxwell branches carry couples of their own, so that no elastic sheet is the rod's.
    relaxes: bool,
    /// True if nothing holds the base.
    free: bool,
}

/// Data for the estimate of mass effects.
enum RodOfKnownMass {
    /// In a plane.
    Plane(PlanarRodMass),
    /// In space: the scene of the rod.
    Space(Box<Scene>),
}

impl OneRod {
    pub fn new(scene: &Scene) -> Result<(Self, RunHeader)> {
        let setup = Setup::new(scene).map_err(|e| scene.in_own_units(e))?;
        let (kind, heavy) = (setup.model.kind(), setup.model.is_heavy());
        let solid = match &scene.body {
            Some(body) => match &body.joint {
                Joint::Ball => Solid::point(),
                Joint::Weld {
                    offset, inertia, ..
                } => Solid::new(body.mass, inertia, offset),
            },
            None => Solid::point(),
        };
        let watched = setup.model.looks_for_contact();
        let header = RunHeader {
            model: Some(kind),
            full: heavy && !kind.is_elastic(),
            units: scene.units,
            scales: setup.scales,
            scene: resolved(scene)?,
            run: scene.run()?.clone(),
            fixed_nodes: scene.rod.nodes.is_some(),
            bodies: vec![RunBody {
                name: String::new(),
                solid: solid.within(scene.groove()),
                is_end: scene.body.is_none(),
            }],
            rods: vec![RunRod {
                name: String::new(),
                thickness: watched.then(|| scene.rod.thickness()).flatten(),
                grounds: [
                    Some(assembly::Joint::Weld).filter(|_| !scene.clamp.free),
                    None,
                ],
                free: false,
            }],
            stations: stations::placed(scene),
            obstacles: scene.obstacles.clone(),
            barrier_gap: scene.barrier_gap(),
            has_contact: scene.has_contact() || scene.rods_meet(),
            joints: Vec::new(),
            heavy,
            driven: setup.model.is_driven(),
            loaded: scene.is_loaded_along() && !scene.rod.is_light(),
            masses: scene.mass_notes(),
            viscosity: viscosity(scene)?,
            strains: setup.model.strains(),
        };
        let one = Self {
            massive: massive(scene, &setup)?,
            setup,
            relaxes: !scene.rod.relaxation.is_empty() || scene.rod.field_in_time().is_some(),
            free: scene.clamp.free,
        };
        Ok((one, header))
    }

    /// Place and velocity relative to the clamp, transformed to the world; two components in a plane.
    fn point_outward(
        &self,
        t: f64,
        pose: &DVector<f64>,
        velocity: &DVector<f64>,
    ) -> [DVector<f64>; 2] {
        let clamp = self.setup.model.clamp(t);
        let lifted = |v: &DVector<f64>| Vector3::from_fn(|i, _| v.get(i).copied().unwrap_or(0.0));
        let flat = |v: Vector3<f64>| DVector::from_column_slice(&v.as_slice()[..pose.len()]);
        let (x, v) = (lifted(pose), lifted(velocity));
        [flat(clamp.place(&x)), flat(clamp.absolute_velocity(&x, &v))]
    }
}

/// The scene with its defaults, for summary.json.
pub(super) fn resolved(scene: &Scene) -> Result<serde_json::Value> {
    serde_json::to_value(scene).map_err(|e| Error::io("the scene cannot be written").caused_by(e))
}

fn massive(scene: &Scene, setup: &Setup) -> Result<Option<RodOfKnownMass>> {
    // The estimates are about the equilibrium without obstacles.
    if !scene.obstacles.is_empty() {
        return Ok(None);
    }
    if setup.model.kind().in_space() {
        let given = if scene.is_planar() {
            scene.lifted_for_modes()?
        } else {
            Some(scene.clone())
        };
        // The equilibria of the light rod do not apply to a distributed load on a rod whose mass is followed in full.
        let known = |scene: &Scene| {
            let along = !scene.loads.distributed.is_zero() || !scene.rod.loads.is_empty();
            let loaded = scene.rod.is_heavy() && along;
            if scene.clamp.free {
                return false;
            }
            let mass = scene.body.is_some() && scene.rod.mass().is_some();
            mass && scene.clamp.motion.is_none() && !loaded
        };
        let given = given.filter(known);
        return Ok(given.map(|scene| RodOfKnownMass::Space(Box::new(scene))));
    }
    // A distributed load shifts equilibria and folds by more than the rod's mass does.
    let bare = scene.loads.distributed.is_zero() && scene.rod.loads.is_empty();
    let light = scene.body.is_some() && bare;
    match setup.load.filter(|_| light) {
        Some(load) => {
            let rod = PlanarRodMass::new(scene, &setup.scales, load)?;
            Ok(rod.map(RodOfKnownMass::Plane))
        }
        None => Ok(None),
    }
}

impl RunModel for OneRod {
    fn start(&self) -> Result<RunStart<'_>> {
        let motion = self.setup.motion()?;
        let index = if self.setup.model.kind().is_elastic() {
            motion.now().index()
        } else {
            self.setup.model.start_index()
        };
        Ok(RunStart { motion, index })
    }

    fn clamp(&self, t: f64) -> Isometry3<f64> {
        let clamp = self.setup.model.clamp(t).pose();
        outward(&clamp, self.setup.scales.length, &Isometry3::identity())
    }

    fn bodies(&self, state: &dyn State) -> Vec<BodyMoment> {
        let k = &self.setup.scales;
        let clamp = self.setup.model.clamp(state.time());
        let end = EndInWorld::new(&clamp, state);
        let groove = state.groove_forces().into_iter().next().flatten();
        let turned = |force: Vector3<f64>| k.outward(Quantity::Force, clamp.outward(&force));
        let end = BodyMoment {
            pose: outward(&Isometry3::identity(), k.length, &end.pose),
            velocity: k.outward(Quantity::Velocity, end.velocity),
            // The angular velocity of an end may be infinite and is then left out.
            angular_velocity: k.outward(Quantity::AngularVelocity, end.spin),
            action: Some(EndAction {
                force: k.outward(Quantity::Force, end.force),
                couple: k.outward(Quantity::Couple, end.couple),
            }),
            groove: groove.map(turned),
        };
        let base = state.bodies().first().filter(|_| self.free).map(|base| {
            let (spin, velocity) = halves(&clamp.of_poses().outward(&base.twist));
            BodyMoment {
                pose: outward(&clamp.pose(), k.length, &base.pose),
                velocity: k.outward(Quantity::Velocity, velocity),
                angular_velocity: k.outward(Quantity::AngularVelocity, spin),
                action: None,
                groove: None,
            }
        });
        std::iter::once(end).chain(base).collect()
    }

    fn curves(&self, state: &dyn State, sections: usize) -> Result<Shapes> {
        let mut curve = state.sections(sections);
        let clamp = self.setup.model.clamp(state.time()).pose();
        curve_outward(&clamp, self.setup.scales.length, &mut curve);
        Ok(vec![curve])
    }

    fn sections(
        &self,
        state: &dyn State,
        _rod: usize,
        places: &[f64],
    ) -> Result<Vec<StationValues>> {
        let k = &self.setup.scales;
        let clamp = self.setup.model.clamp(state.time());
        let (frame, base) = (clamp.of_poses(), clamp.pose());
        let sections = state.moving_sections(0, places).into_iter();
        let section = |section: SectionState| {
            let lever = join(&Vector3::zeros(), &section.pose.translation.vector);
            let twist = frame.absolute_velocity(&lever, &section.twist);
            let pose = outward(&base, 1.0, &section.pose);
            StationValues::in_motion(&section, pose, twist).outward(k)
        };
        Ok(sections.map(section).collect())
    }

    fn rest(&self) -> Option<RestState> {
        match self.massive.as_ref()? {
            RodOfKnownMass::Plane(rod) => Some(RestState::Plane {
                rod: *rod,
                mass: rod.at_rest()?,
            }),
            RodOfKnownMass::Space(scene) => Some(RestState::Space {
                rods: Box::new(RodsAtRest::single(scene)?),
                alone: false,
            }),
        }
    }

    fn light_rods(&self, rest: &LazyRest, first: &dyn State) -> Vec<LightReference> {
        if self.setup.model.kind().is_elastic() || self.relaxes {
            return Vec::new();
        }
        let rod: Option<Box<dyn MasslessRod>> = match (&self.massive, rest.get()) {
            (Some(RodOfKnownMass::Plane(_)), _) => Some(Box::new(Elastica)),
            (_, Some(RestState::Space { rods, .. })) => rods
                .light()
                .map(|rod| Box::new(rod) as Box<dyn MasslessRod>),
            _ => None,
        };
        let rod = rod.map(|rod| LightReference::new(rod, first));
        rod.into_iter().collect()
    }

    fn snap(&self, snap: &Snap) -> Result<Snap> {
        let k = &self.setup.scales;
        let [pose, velocity] = self.point_outward(snap.t, &snap.pose, &snap.velocity);
        let charts = [&snap.from, &snap.to].map(|end| match end.sheet {
            Some(_) => end.q.clone(),
            // The base wrench along the directors of the clamp.
            None => outward::wrench(k, &end.q),
        });
        let world = Snap {
            pose,
            velocity,
            ..snap.clone()
        };
        Ok(outward::snap(k, &world, charts))
    }

    fn bounce(&self, bounce: &Bounce) -> RunBounce {
        let [pose, velocity] = self.point_outward(bounce.t, &bounce.pose, &bounce.velocity);
        RunBounce::new(&self.setup.scales, bounce, [&pose, &velocity])
    }

    fn contact(&self, contact: &Contact) -> Contact {
        let k = &self.setup.scales;
        let length = |x| k.outward(Quantity::Length, x);
        Contact {
            at: contact.at.map(length),
            gap: length(contact.gap),
            ..*contact
        }
    }

    fn spring(&self, header: &RunHeader) -> Result<Option<Result<Spring, String>>> {
        if !header.run.reduce {
            return Ok(Some(Err("[run] reduce = false".to_owned())));
        }
        Ok(match self.setup.model.reduction()? {
            None => None,
            Some(Ok(reduction)) => Some(Ok(Spring::new(&reduction, &header.scales)?)),
            Some(Err(refusal)) => {
                let units = header.scales.of_messages(header.units);
                Some(Err(refusal.in_units(&units).to_string()))
            }
        })
    }
}
