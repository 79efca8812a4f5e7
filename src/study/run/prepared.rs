//! A scene of motion of rods ready to run, one rod or an assembly.

use super::assembly::AssemblyModel;
use super::contacts::{BranchContacts, sample_outward};
use super::header::RunHeader;
use super::moment::{BodyMoment, Moment, ShapesAt};
use super::one_rod::OneRod;
use super::outward::RunBounce;
use super::rest::{LazyRest, RestState};
use super::shapes::{Shapes, poses};
use super::simulation::SimulationState;
use super::spring::Spring;
use super::summary::layer;
use crate::assembly::Contact;
use crate::error::{Error, Quantity, Result};
use crate::motion::{Bounce, Event, LightReference, Motion, Snap, State};
use crate::scene::Scene;
use crate::study::neglected_mass::MassEffect;
use crate::study::stations::{self, StationValues};
use nalgebra::Isometry3;
use serde_json::{Map, Value};

/// Sections of the axis of a planar rod that touches obstacles.
const SECTIONS: usize = 97;

/// A scene of motion of rods ready to run, with the facts known before its start.
pub struct Prepared {
    /// Model, units, names and bounds of the run.
    pub header: RunHeader,
    pub(super) model: Box<dyn RunModel>,
    /// The scene with half the gap of its barrier, where the change is asked for.
    pub(super) at_half_gap: Option<Scene>,
}

/// A motion from its start.
pub struct RunStart<'p> {
    /// The motion.
    pub motion: Box<dyn Motion<'p> + 'p>,
    /// Morse index of the equilibrium at the start; `None` if unknown or not in equilibrium.
    pub index: Option<usize>,
}

impl RunStart<'_> {
    /// The motion from a state that a run or a simulation of the scene has saved.
    ///
    /// # Errors
    /// The state of another model or of other rods.
    pub fn restored(mut self, state: &SimulationState) -> Result<Self> {
        if state.motion.method == SimulationState::REPLAY {
            return Err(Error::domain(
                "the state is one that is reached from the start of the scene: a simulation can restore it, a run cannot",
            ));
        }
        if state.motion.method != SimulationState::START {
            self.motion.restore(&state.motion)?;
            self.index = self.motion.now().index();
        }
        Ok(self)
    }
}

/// Differences between one rod and an assembly in a run. States, snaps and bounces are those of the motion; results
/// are in the world and the scene's units.
pub(super) trait RunModel {
    /// The motion from its start. Errors are in the units of the motion.
    fn start(&self) -> Result<RunStart<'_>>;

    /// Frame of the clamp at time `t` of the motion.
    fn clamp(&self, _t: f64) -> Isometry3<f64> {
        Isometry3::identity()
    }

    /// Bodies of a state; for one rod, its end.
    fn bodies(&self, state: &dyn State) -> Vec<BodyMoment>;

    /// Every rod from base to end, with `sections` sections of a light rod.
    fn curves(&self, state: &dyn State, sections: usize) -> Result<Shapes>;

    /// Sections of a rod at ascending places in [0, 1].
    fn sections(&self, state: &dyn State, rod: usize, places: &[f64])
    -> Result<Vec<StationValues>>;

    /// Coordinates and rates of all joints with axes, in the order of the columns; NaN where a rod has no shape.
    fn joints(&self, _state: &dyn State) -> Result<Vec<f64>> {
        Ok(Vec::new())
    }

    /// Equilibrium under the loads at t = 0. `None` unless a mass is known and the clamp fixed, and where no
    /// equilibrium is found.
    fn rest(&self) -> Option<RestState>;

    /// Light rods beside rods with friction or mass, from the first state on.
    fn light_rods(&self, rest: &LazyRest, first: &dyn State) -> Vec<LightReference>;

    /// A snap of the motion.
    fn snap(&self, snap: &Snap) -> Result<Snap>;

    /// A snap of a light rod beside the motion.
    fn light_snap(&self, snap: &Snap) -> Result<Snap> {
        self.snap(snap)
    }

    /// A bounce of a taut rod.
    fn bounce(&self, bounce: &Bounce) -> RunBounce;

    /// A contact of rods.
    fn contact(&self, contact: &Contact) -> Contact;

    /// The exactly equivalent spring and dashpot, or the reason why there is none; `None` for models without this
    /// equivalence.
    fn spring(&self, _header: &RunHeader) -> Result<Option<Result<Spring, String>>> {
        Ok(None)
    }
}

impl Prepared {
    /// Scales the scene; for one rod, finds its start.
    ///
    /// # Errors
    /// A scene of statics; a scene that cannot run: no equilibrium for the requested start, or several; strains held
    /// rigid in a combination without kinematics; a law that overflows.
    pub fn new(scene: &Scene) -> Result<Self> {
        if scene.is_assembly() {
            let (model, header) = AssemblyModel::new(scene)?;
            return Ok(Self {
                header,
                model: Box::new(model),
                at_half_gap: scene.at_half_gap(),
            });
        }
        let (model, header) = OneRod::new(scene)?;
        Ok(Self {
            header,
            model: Box::new(model),
            at_half_gap: scene.at_half_gap(),
        })
    }

    /// The motion from its start, and the Morse index there.
    ///
    /// # Errors
    /// A start without a possible motion.
    pub fn start(&self) -> Result<RunStart<'_>> {
        let (k, units) = (&self.header.scales, self.header.units);
        self.model
            .start()
            .map_err(|e| e.in_units(&k.of_messages(units)))
    }

    /// The motion from its start.
    ///
    /// # Errors
    /// A start without a possible motion.
    pub fn motion(&self) -> Result<Box<dyn Motion<'_> + '_>> {
        Ok(self.start()?.motion)
    }

    /// Effect of the rods' mass at the equilibrium under the loads at t = 0. `None` where no mass is known or it is
    /// followed in full, where the clamp moves, and where no equilibrium is found.
    pub fn small_mass(&self) -> Option<MassEffect> {
        if self.header.full {
            return None;
        }
        Some(self.model.rest()?.mass().clone())
    }

    /// The exactly equivalent spring and dashpot of one rod, or the reason why there is none; `None` for models without
    /// this equivalence.
    ///
    /// # Errors
    /// A start that cannot be evaluated.
    pub(in crate::study) fn spring(&self) -> Result<Option<Result<Spring, String>>> {
        self.model.spring(&self.header)
    }

    /// A state in the world frame and the scene's units.
    pub(in crate::study) fn moment(&self, state: &dyn State) -> Moment {
        let labels = state.equilibrium();
        let touches = self.header.is_sheet() && labels.is_none();
        let curve = touches.then(|| state.sections(SECTIONS));
        let axis = curve.into_iter().flatten();
        Moment {
            axis: axis
                .map(|(_, at)| [at.translation.x, at.translation.y])
                .collect(),
            labels,
            index: state.index(),
            ..self.moment_without_index(state)
        }
    }

    /// A state in the world frame without equilibrium labels and index, which are the expensive part.
    pub(in crate::study) fn moment_without_index(&self, state: &dyn State) -> Moment {
        let (k, ledger) = (&self.header.scales, state.ledger());
        Moment {
            t: self.time(state.time()),
            clamp: self.model.clamp(state.time()),
            bodies: self.model.bodies(state),
            ledger: ledger.scaled(k.energy),
            total: ledger.total() * k.energy,
            friction: state.friction() * k.energy,
            numerical_loss: state.numerical_loss() * k.energy,
            contact: state.contact().map(|sample| sample_outward(k, sample)),
            labels: None,
            axis: Vec::new(),
            index: None,
        }
    }

    /// An event in the form of events.json; `None` for steps and the end.
    ///
    /// # Errors
    /// An event that cannot be evaluated.
    pub(super) fn told(&self, event: &Event) -> Result<Option<Value>> {
        let (header, model) = (&self.header, &self.model);
        let k = &header.scales;
        let contacts = |contacts: BranchContacts| contacts.outward(k);
        Ok(Some(match event {
            Event::Step { .. } | Event::Stop(_) => return Ok(None),
            Event::Snap(snap) => Value::Object(header.snap(&model.snap(snap)?)),
            Event::Bounce(bounce) => header.bounce(&model.bounce(bounce)),
            Event::Layer(passed) => {
                layer(&passed.scaled(k.unit(Quantity::Time), k.unit(Quantity::Couple)))
            }
            Event::Contact(event) => {
                let mut one = BranchContacts::new();
                one.events.push(*event);
                let told = contacts(one).events;
                let told = told.iter().map(|event| header.contact_event(event));
                Value::Object(told.fold(Map::new(), |_, event| event))
            }
            Event::RodContact(event) => {
                let mut one = BranchContacts::new();
                one.rod_events.push(*event);
                let told = contacts(one).rod_events;
                let told = told.iter().map(|event| header.rod_event(event));
                told.fold(Value::Null, |_, event| event)
            }
        }))
    }

    /// A time of the motion in the scene's units.
    pub(super) fn time(&self, t: f64) -> f64 {
        let unit = self.header.scales.unit(Quantity::Time);
        self.header.run.output_time(t, unit)
    }

    /// Every rod from base to end in the world frame and the scene's units, with `sections` sections of a light rod. A
    /// rod without a shape has no sections.
    pub(in crate::study) fn curves(&self, state: &dyn State, sections: usize) -> Result<Shapes> {
        self.model.curves(state, sections)
    }

    /// Values at the stations of a state; `None` where the rod has no shape.
    pub(super) fn stations(&self, state: &dyn State) -> Result<Vec<Option<StationValues>>> {
        stations::values(&self.header.stations, |rod, places| {
            self.model.sections(state, rod, places)
        })
    }

    /// Coordinates and rates of all joints with axes.
    pub(super) fn joints(&self, state: &dyn State) -> Result<Vec<f64>> {
        self.model.joints(state)
    }

    /// The poses of [`Prepared::curves`], with the time.
    pub(super) fn shapes_at(&self, state: &dyn State, sections: usize) -> Result<ShapesAt> {
        let curves = self.curves(state, sections)?;
        Ok(ShapesAt {
            t: self.time(state.time()),
            rods: curves.into_iter().map(poses).collect(),
        })
    }

    /// Moving strains at places in [0, 1], ascending, in the units of the scene.
    pub(super) fn strains_at(&self, state: &dyn State, places: &[f64]) -> Vec<Vec<f64>> {
        let (all, k) = (state.strains_at(places), &self.header.scales);
        let moving = self.header.strains.iter();
        let along = moving.map(|(_, i)| {
            let of = [Quantity::Curvature, Quantity::Ratio][usize::from(*i >= 3)];
            all.iter()
                .map(|e| k.outward(of, e.as_slice()[*i]))
                .collect()
        });
        along.collect()
    }

    /// Dissipation per length and time at places in [0, 1], ascending, in the units of the scene.
    pub(super) fn dissipation_at(&self, state: &dyn State, places: &[f64]) -> Vec<f64> {
        let k = &self.header.scales;
        let values = state.dissipation_at(places).into_iter();
        values.map(|d| k.outward(Quantity::ForceRate, d)).collect()
    }
}
