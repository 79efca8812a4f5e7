//! An assembly of rods and bodies, as the model of a run.

use super::header::{RunBody, RunHeader, RunRod};
use super::joints::{self, RunJoint};
use super::moment::BodyMoment;
use super::one_rod::resolved;
use super::outward::{self, RunBounce};
use super::prepared::{RunModel, RunStart};
use super::rest::{LazyRest, RestState};
use super::shapes::Shapes;
use crate::assembly::{BodyMotion, Contact};
use crate::error::{Quantity, Result};
use crate::math::se3::halves;
use crate::motion::{Bounce, LightReference, SectionState, Snap, SnapEnd, State, curve_outward};
use crate::rod::Wrench;
use crate::scene::{AssemblyScene, AssemblySetup, PlacedJoint, Scene};
use crate::study::Solid;
use crate::study::neglected_mass::RodsAtRest;
use crate::study::stations::{self, StationValues};
use nalgebra::{DVector, Isometry3};

/// An assembly ready to run.
pub(super) struct AssemblyModel {
    setup: AssemblySetup,
    scene: Scene,
    joints: Vec<PlacedJoint>,
}

impl AssemblyModel {
    pub fn new(scene: &Scene) -> Result<(Self, RunHeader)> {
        let setup = AssemblySetup::new(scene).map_err(|e| scene.in_own_units(e))?;
        let joints = setup.joints(scene)?;
        let given = || scene.assembly().into_iter();
        let bodies = given().flat_map(|given| given.bodies.iter().map(move |body| (given, body)));
        let held = given().flat_map(|given| &given.rods);
        let held = held.map(|rod| (&rod.name, rod.rod.thickness(), false));
        let free = given().flat_map(|given| &given.free);
        let free = free.map(|rod| (&rod.name, None, true));
        let grounds = given().flat_map(AssemblyScene::grounds);
        let rods = held.chain(free).zip(grounds);
        let header = RunHeader {
            model: None,
            full: setup.is_heavy(),
            units: scene.units,
            scales: setup.scales,
            scene: resolved(scene)?,
            run: scene.run()?.clone(),
            fixed_nodes: scene.rod.nodes.is_some(),
            bodies: bodies
                .map(|(given, body)| RunBody {
                    name: body.name.clone(),
                    solid: if given.is_negligible(body) {
                        Solid::point()
                    } else {
                        Solid::of(body)
                    },
                    is_end: false,
                })
                .collect(),
            rods: rods
                .map(|((name, thickness, free), grounds)| RunRod {
                    name: name.clone(),
                    thickness,
                    grounds,
                    free,
                })
                .collect(),
            stations: stations::placed_in_motion(scene),
            obstacles: scene.obstacles.clone(),
            barrier_gap: scene.barrier_gap(),
            has_contact: scene.has_contact() || scene.rods_meet(),
            joints: joints.iter().map(RunJoint::new).collect(),
            heavy: setup.is_heavy() || setup.assembly.light_rods().next().is_some(),
            driven: false,
            loaded: false,
            masses: scene.mass_notes(),
            viscosity: None,
            strains: Vec::new(),
        };
        let model = Self {
            setup,
            scene: scene.clone(),
            joints,
        };
        Ok((model, header))
    }

    /// A snap with the wrenches at the base of the rod, along the directors there.
    fn with_wrenches(
        &self,
        snap: &Snap,
        wrench: impl Fn(&Wrench) -> Result<Wrench>,
    ) -> Result<Snap> {
        let chart = |end: &SnapEnd| -> Result<DVector<f64>> {
            let found = wrench(&Wrench::from_column_slice(end.q.as_slice()))?;
            Ok(DVector::from_column_slice(found.as_slice()))
        };
        let charts = [chart(&snap.from)?, chart(&snap.to)?];
        Ok(outward::snap(&self.setup.scales, snap, charts))
    }
}

impl RunModel for AssemblyModel {
    fn start(&self) -> Result<RunStart<'_>> {
        let (motion, index) = self.setup.motion(&self.scene)?;
        Ok(RunStart { motion, index })
    }

    fn bodies(&self, state: &dyn State) -> Vec<BodyMoment> {
        let k = &self.setup.scales;
        let mut grooves = state.groove_forces().into_iter();
        let body = |place: &BodyMotion| {
            let (spin, velocity) = halves(&place.twist);
            let mut pose = place.pose;
            pose.translation.vector *= k.length;
            BodyMoment {
                pose,
                velocity: k.outward(Quantity::Velocity, velocity),
                angular_velocity: k.outward(Quantity::AngularVelocity, spin),
                action: None,
                groove: (grooves.next().flatten()).map(|force| k.outward(Quantity::Force, force)),
            }
        };
        state.bodies().iter().map(body).collect()
    }

    fn curves(&self, state: &dyn State, sections: usize) -> Result<Shapes> {
        // The number of intervals.
        let count = sections.max(2) - 1;
        if let Some(now) = state.configuration() {
            return self.setup.shapes(state.time(), now, count);
        }
        let mut curves = state.curves(count);
        for curve in &mut curves {
            curve_outward(&Isometry3::identity(), self.setup.scales.length, curve);
        }
        Ok(curves)
    }

    fn sections(
        &self,
        state: &dyn State,
        rod: usize,
        places: &[f64],
    ) -> Result<Vec<StationValues>> {
        stations::from_base(self.setup.moves_reversed(rod), places, |places| {
            let sections = state.moving_sections(rod, places).into_iter();
            let values = |section: SectionState| {
                StationValues::in_motion(&section, section.pose, section.twist)
                    .outward(&self.setup.scales)
            };
            Ok(sections.map(values).collect())
        })
    }

    fn joints(&self, state: &dyn State) -> Result<Vec<f64>> {
        let mut numbers = Vec::new();
        for joint in &self.joints {
            let found = self.sections(state, joint.rod, &[joint.place])?;
            let now = (state.time(), state.bodies());
            match found.first() {
                Some(at) => numbers.extend(joints::numbers(joint, now, at, &self.setup.scales)),
                None => numbers.extend(vec![f64::NAN; RunJoint::new(joint).count()]),
            }
        }
        Ok(numbers)
    }

    fn rest(&self) -> Option<RestState> {
        // The estimates are about the equilibrium without obstacles.
        if self.scene.has_contact() {
            return None;
        }
        Some(RestState::Space {
            rods: Box::new(RodsAtRest::assembly(&self.scene, &self.setup)?),
            alone: true,
        })
    }

    fn light_rods(&self, _rest: &LazyRest, first: &dyn State) -> Vec<LightReference> {
        let rods = self.setup.light_rods(&self.scene).into_iter();
        rods.map(|rod| LightReference::new(Box::new(rod), first))
            .collect()
    }

    fn snap(&self, snap: &Snap) -> Result<Snap> {
        self.with_wrenches(snap, |q| {
            let seen = (snap.t, &snap.base);
            self.setup.base_wrench(snap.rod, q, seen)
        })
    }

    fn light_snap(&self, snap: &Snap) -> Result<Snap> {
        self.with_wrenches(snap, |q| self.setup.light_wrench(snap.rod, q))
    }

    fn bounce(&self, bounce: &Bounce) -> RunBounce {
        let place = [&bounce.pose, &bounce.velocity];
        RunBounce::new(&self.setup.scales, bounce, place)
    }

    fn contact(&self, contact: &Contact) -> Contact {
        let k = &self.setup.scales;
        Contact {
            at: [0, 1].map(|i| self.setup.arclength(contact.rods[i], contact.at[i])),
            gap: k.outward(Quantity::Length, contact.gap),
            ..*contact
        }
    }
}
