//! Functions of time and of the motion as loads on the bodies of a scene, and forces that the owner of a simulation
//! steers.

use super::{Scales, Scene, SceneKind};
use crate::body::{BodyState, BodyWrench, LoadFunction};
use crate::error::{Error, Quantity, Result};
use nalgebra::{Isometry3, Vector3};
use std::fmt;
use std::sync::Arc;
use std::sync::atomic::{AtomicU64, Ordering};

impl Scene {
    /// Lets a function act on a body in a motion, beside all loads of the scene. `body`: its name in an assembly, empty
    /// for the body of one rod, or for the free end of a rod without a body. Times, states and loads are in the world
    /// and in the units of the scene.
    ///
    /// The start of the scene is found without the function.
    ///
    /// ```
    /// use snaprod::body::{BodyState, BodyWrench, LoadFunction};
    /// use snaprod::{scene::Scene, study::run::Simulation};
    /// let mut scene = Scene::parse(
    ///     r#"
    ///     [rod]
    ///     model = "elastica"
    ///     length = 1.0
    ///     bending_stiffness = 1.0
    ///     [body]
    ///     mass = 1.0
    ///     [start]
    ///     lambda = 2.0
    ///     kappa = 0.6
    ///     [run]
    ///     duration = 2.0
    ///     "#,
    /// )?;
    /// // A drag that grows with the speed.
    /// let drag = |now: &BodyState| BodyWrench {
    ///     force: -2.0 * now.velocity.norm() * now.velocity,
    ///     ..BodyWrench::default()
    /// };
    /// scene.act("", LoadFunction::smooth(drag))?;
    /// let mut simulation = Simulation::new(&scene)?;
    /// let work = simulation.columns().columns.iter().position(|column| column.name == "work");
    /// let work = work.expect("every run has this column");
    /// simulation.advance(2.0)?;
    /// assert!(matches!(simulation.row()?[work], snaprod::study::Cell::Real(work) if work < -0.1));
    /// # Ok::<(), Box<dyn std::error::Error>>(())
    /// ```
    ///
    /// # Errors
    /// A name that is none of a body; a body without mass; a scene of statics; a bar, a flow, a wall or a membrane.
    pub fn act(&mut self, body: &str, load: LoadFunction) -> Result<()> {
        let number = self.loaded(body)?;
        match (&mut self.kind, number) {
            (SceneKind::Assembly(all), Some(k)) => all.bodies[k].functions.push(load),
            _ => self.loads.functions.push(load),
        }
        Ok(())
    }

    /// Adds a force of size 0 on a body, to be steered. `body`: as in [`Scene::act`].
    ///
    /// # Errors
    /// As [`Scene::act`].
    pub fn steered(&mut self, body: &str) -> Result<SteeredForce> {
        let force = SteeredForce::new(body);
        self.act(body, force.function())?;
        Ok(force)
    }

    /// True if a body turns with its rods, so that a couple can act on the body. `body`: as in [`Scene::act`].
    ///
    /// # Errors
    /// As [`Scene::act`].
    pub fn turns(&self, body: &str) -> Result<bool> {
        Ok(match (self.assembly(), self.loaded(body)?, &self.body) {
            (Some(all), Some(k), _) => all.bodies[k].extent.is_some(),
            (_, _, Some(body)) => !self.is_planar() && body.joint.is_weld(),
            // A free end.
            (_, _, None) => !self.is_planar(),
        })
    }

    /// True if a function acts on a body.
    pub fn has_functions(&self) -> bool {
        let bodies = self.assembly().map_or(&[][..], |all| &all.bodies);
        !self.loads.functions.is_empty() || bodies.iter().any(|body| !body.functions.is_empty())
    }

    /// Refuses functions on bodies. `work`: the work that leaves them out.
    ///
    /// # Errors
    /// A scene with functions.
    pub(crate) fn refuse_functions(&self, work: &str) -> Result<()> {
        if !self.has_functions() {
            return Ok(());
        }
        Err(Error::domain(format!(
            "{work}: functions as loads act in motions alone; leave them out, or write the load as a field of the scene"
        )))
    }

    /// Functions of `other`, added to the bodies of the same names.
    ///
    /// # Errors
    /// A body of `other` with functions that this scene does not have.
    pub(crate) fn with_functions_of(mut self, other: &Self) -> Result<Self> {
        for function in &other.loads.functions {
            self.act("", function.clone())?;
        }
        let bodies = other.assembly().map_or(&[][..], |all| &all.bodies);
        for body in bodies {
            for function in &body.functions {
                self.act(&body.name, function.clone())?;
            }
        }
        Ok(self)
    }

    /// The number of the body of this name; `None` for the body of one rod.
    fn loaded(&self, body: &str) -> Result<Option<usize>> {
        Err(Error::domain(match &self.kind {
            SceneKind::Rod if body.is_empty() && self.is_motion() => return Ok(None),
            SceneKind::Rod if body.is_empty() => {
                "the scene is one of statics: functions and pushes act in a motion, with [run]"
                    .to_owned()
            }
            SceneKind::Assembly(assembly) => {
                let names = assembly.bodies.iter().map(|body| body.name.as_str());
                let names: Vec<&str> = names.collect();
                match names.iter().position(|name| *name == body) {
                    Some(k) if assembly.bodies[k].is_massless() => {
                        format!("the body {body:?} has no mass, and cannot be pushed in a motion")
                    }
                    Some(k) => return Ok(Some(k)),
                    None => format!(
                        "{body:?} is none of the bodies of the scene: {}",
                        names.join(", ")
                    ),
                }
            }
            SceneKind::Rod => format!(
                "{body:?} is none of the bodies of the scene: one rod has one body, without a name"
            ),
            SceneKind::Bar(_)
            | SceneKind::Flow(_)
            | SceneKind::Inflation(_)
            | SceneKind::Wall(_) => {
                "a bar, a flow, a wall or a membrane has no body on which a function or a push could act"
                    .to_owned()
            }
        }))
    }
}

/// Functions of a scene in the library's units.
pub(super) fn in_units(functions: &[LoadFunction], scales: &Scales) -> Vec<LoadFunction> {
    let each = functions.iter().map(|function| measured(function, *scales));
    each.collect()
}

/// A function of a scene in the library's units.
fn measured(function: &LoadFunction, scales: Scales) -> LoadFunction {
    let (load, breaks) = (function.clone(), function.clone());
    LoadFunction::with_breaks(
        move |state| {
            let place = scales.outward(Quantity::Length, state.pose.translation.vector);
            let found = load.at(&BodyState {
                t: outward_time(&load, &scales, state.t),
                pose: Isometry3::from_parts(place.into(), state.pose.rotation),
                velocity: scales.outward(Quantity::Velocity, state.velocity),
                angular_velocity: scales.outward(Quantity::AngularVelocity, state.angular_velocity),
            });
            let inward = |of: Quantity, v: Vector3<f64>| v.map(|x| scales.inward(of, x));
            BodyWrench {
                force: inward(Quantity::Force, found.force),
                couple: inward(Quantity::Couple, found.couple),
            }
        },
        move |t| {
            let next = breaks.next_break(outward_time(&breaks, &scales, t));
            scales.inward(Quantity::Time, next)
        },
    )
}

/// A time of the motion in the units of the scene, on the side of a break on which the time of the motion is: rounding
/// must not carry the end of a step across a jump.
fn outward_time(function: &LoadFunction, scales: &Scales, t: f64) -> f64 {
    let time = scales.outward(Quantity::Time, t);
    let around = 4.0 * f64::EPSILON * time.abs();
    let jump = function.next_break(time - around);
    if !((jump - time).abs() <= around) {
        time
    } else if t < scales.inward(Quantity::Time, jump) {
        time.min(jump.next_down())
    } else {
        time.max(jump)
    }
}

/// A force on a body that the owner of a simulation changes between steps. The force is along the axes of the world and
/// in the units of the scene. A step ends where the time to hold the force ends, so that a change lies inside no step.
#[derive(Clone)]
pub struct SteeredForce {
    /// Name of the body; empty for the body of one rod.
    pub body: String,
    /// Bits of the three components and of the time to hold them.
    held: Arc<[AtomicU64; 4]>,
}

impl SteeredForce {
    /// A force of size 0 that holds for ever, unless the owner changes the force.
    fn new(body: &str) -> Self {
        let held = [0.0, 0.0, 0.0, f64::INFINITY].map(|x| AtomicU64::new(x.to_bits()));
        Self {
            body: body.to_owned(),
            held: Arc::new(held),
        }
    }

    fn number(&self, i: usize) -> f64 {
        f64::from_bits(self.held[i].load(Ordering::Relaxed))
    }

    fn put(&self, i: usize, x: f64) {
        self.held[i].store(x.to_bits(), Ordering::Relaxed);
    }

    /// The force.
    pub fn value(&self) -> [f64; 3] {
        std::array::from_fn(|i| self.number(i))
    }

    /// Changes the force.
    pub fn set(&self, force: [f64; 3]) {
        (0..3).for_each(|i| self.put(i, force[i]));
    }

    /// Sets the time up to which the force holds.
    pub fn hold_until(&self, t: f64) {
        self.put(3, t);
    }

    /// The force as a function.
    fn function(&self) -> LoadFunction {
        let (force, until) = (self.clone(), self.clone());
        LoadFunction::with_breaks(
            move |_| BodyWrench {
                force: force.value().into(),
                couple: Vector3::zeros(),
            },
            move |t| {
                Some(until.number(3))
                    .filter(|s| *s > t)
                    .unwrap_or(f64::INFINITY)
            },
        )
    }
}

impl fmt::Debug for SteeredForce {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(f, "SteeredForce on {:?}: {:?}", self.body, self.value())
    }
}
