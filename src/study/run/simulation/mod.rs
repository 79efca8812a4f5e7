//! A motion that is stepped: its state can be looked at, saved and changed at any time.

mod change;
mod state;

pub use state::SimulationState;

use super::prepared::Prepared;
use super::shapes::Shapes;
use super::table;
use crate::error::{Error, Quantity, Result};
use crate::motion::{Event, Motion, Outcome, SavedState, State};
use crate::scene::{LandingRule, Scene, SteeredForce};
use crate::study::{Cell, Hooks, Silent, Table};
use change::refuse_others;
use self_cell::self_cell;
use serde_json::Value;
use state::{Push, pushes_of, replay};

type BoxedMotion<'p> = Box<dyn Motion<'p> + 'p>;

self_cell!(
    /// A scene ready to run, with the motion that borrows from it.
    struct Running {
        owner: Box<Prepared>,
        #[not_covariant]
        dependent: BoxedMotion,
    }
);

impl Running {
    fn of(prepared: Box<Prepared>) -> Result<Self> {
        Self::try_new(prepared, |prepared| prepared.motion())
    }
}

/// A motion that is stepped.
///
/// The motion takes the steps of [`run()`](fn@super::run), whatever the times at which its state is asked for: states
/// inside of steps come from the polynomials of the steps. A simulation that is advanced in pieces equals one run to
/// rounding, in every model. With steered forces steps end at each time of an advance, and pieces equal one run to the
/// tolerance. Times and values are in the units of the scene.
///
/// ```
/// use snaprod::{scene::Scene, study::run::Simulation};
/// let scene = Scene::parse(
///     r#"
///     [rod]
///     model = "elastica"
///     length = 1.0
///     bending_stiffness = 1.0
///     [body]
///     mass = 1.0
///     [start]
///     lambda = 6.3
///     kappa = 0.6
///     velocity = [0.0, -0.5]
///     [run]
///     duration = 1.0
///     "#,
/// )?;
/// let mut simulation = Simulation::new(&scene)?;
/// simulation.advance(0.02)?;
/// let before = simulation.state()?;
/// simulation.advance(0.03)?;
/// assert_eq!(simulation.events()?[0]["kind"], "snap");
/// simulation.restore(&before)?;
/// assert_eq!(simulation.t(), 0.02);
/// # Ok::<(), Box<dyn std::error::Error>>(())
/// ```
pub struct Simulation {
    /// The scene at the start, without steered forces.
    plain: Scene,
    /// The present scene, without steered forces; `changed` if another than `plain`.
    scene: Scene,
    changed: bool,
    steered: Vec<SteeredForce>,
    running: Running,
    /// The present, and the end of the last step, in units of the motion.
    t: f64,
    head: f64,
    /// False before the first step: the state is then the given one.
    stepped: bool,
    /// The forces that were steered since the start; `None` if the motion did not come from the start alone.
    log: Option<Vec<Push>>,
    events: Vec<Event>,
    outcome: Option<Outcome>,
}

/// Relative distance of times that are the same.
const SAME: f64 = 4e-12;

impl Simulation {
    /// A simulation at the start of a scene of motion of rods and bodies.
    ///
    /// # Errors
    /// A scene of statics, or a bar; a start from which no motion is possible; `landing = "all"`, under which a motion
    /// branches.
    pub fn new(scene: &Scene) -> Result<Self> {
        Self::pushed(scene, &[])
    }

    /// A simulation in which forces on bodies can be steered ([`Simulation::push`]). `bodies`: their names in an
    /// assembly, or one empty name for the body of one rod.
    ///
    /// # Errors
    /// As [`Simulation::new`]; a name that is none of a body.
    pub fn pushed(scene: &Scene, bodies: &[&str]) -> Result<Self> {
        if scene.is_medium() {
            return Err(Error::domain(
                "a bar, a flow or a membrane cannot be stepped: it is run from beginning to end",
            ));
        }
        if scene.run()?.landing == LandingRule::All {
            return Err(Error::domain(
                "run.landing = \"all\": a simulation follows one motion; choose a landing, such as \"viscous\"",
            ));
        }
        let mut whole = scene.clone();
        let steered = bodies.iter().map(|body| whole.steered(body));
        let steered = steered.collect::<Result<Vec<_>>>()?;
        let running = Running::of(Box::new(Prepared::new(&whole)?))?;
        Ok(Self {
            plain: scene.clone(),
            scene: scene.clone(),
            changed: false,
            steered,
            running,
            t: 0.0,
            head: 0.0,
            stepped: false,
            log: Some(Vec::new()),
            events: Vec::new(),
            outcome: None,
        })
    }

    fn prepared(&self) -> &Prepared {
        self.running.borrow_owner()
    }

    fn unit_of_time(&self) -> f64 {
        self.prepared().header.scales.unit(Quantity::Time)
    }

    /// Time now.
    pub fn t(&self) -> f64 {
        self.prepared().time(self.t)
    }

    /// End of time: `run.duration`.
    pub fn duration(&self) -> f64 {
        self.prepared().header.run.duration
    }

    /// Reason why the motion ended; `None` while it goes on.
    pub fn ended(&self) -> Option<String> {
        let outcome = self.outcome.as_ref()?;
        Some(self.prepared().header.reason(outcome))
    }

    /// Advances to the time `t` exactly. What happens at `t` itself, such as a snap, belongs to the next advance.
    ///
    /// # Errors
    /// A time before now or after `run.duration`; a motion that ends before `t`: the simulation is then at its end.
    pub fn advance(&mut self, t: f64) -> Result<()> {
        self.advance_with(t, &mut Silent)
    }

    /// Advances as [`Simulation::advance`]. An interrupt ends at the last step; the simulation can go on from there.
    ///
    /// # Errors
    /// Those of [`Simulation::advance`]; an interrupt.
    pub fn advance_with(&mut self, t: f64, hooks: &mut dyn Hooks) -> Result<()> {
        let (now, duration) = (self.t(), self.duration());
        if !(now <= t && t <= duration * (1.0 + SAME)) {
            return Err(Error::domain(if t < now {
                format!("t = {t}: the time is {now} already; restore a state to go back")
            } else {
                format!(
                    "t = {t}: must be a time up to run.duration = {duration}; give a longer duration"
                )
            }));
        }
        let end = self.running.with_dependent(|_, motion| motion.duration());
        let until = (t / self.unit_of_time()).min(end);
        self.hold_until(until);
        while !self.reaches(until) {
            self.take_step()?;
            hooks.progress(self.head / end, self.head * self.unit_of_time());
            if hooks.interrupted() {
                self.t = self.head.min(until);
                return Err(Error::domain("it was interrupted"));
            }
        }
        self.t = if self.is_near(until) {
            self.head
        } else {
            until
        };
        Ok(())
    }

    /// Takes one step of the method, or goes to the end of the step under way. False if the motion has ended.
    ///
    /// # Errors
    /// A motion that cannot go on: the simulation is then at its end.
    pub fn step(&mut self) -> Result<bool> {
        if self.outcome.is_some() {
            return Ok(false);
        }
        if self.t < self.head {
            self.t = self.head;
            return Ok(true);
        }
        self.hold_until(f64::INFINITY);
        let end = self.running.with_dependent(|_, motion| motion.duration());
        if self.stepped && self.reaches(end) {
            return Ok(false);
        }
        self.take_step()?;
        self.t = self.head;
        Ok(true)
    }

    /// Lets steered forces hold up to a time, at which a step then ends.
    fn hold_until(&self, t: f64) {
        let t = self.prepared().time(t);
        self.steered.iter().for_each(|force| force.hold_until(t));
    }

    fn is_near(&self, t: f64) -> bool {
        (self.head - t).abs() <= SAME * (1.0 + t.abs())
    }

    fn reaches(&self, t: f64) -> bool {
        self.head >= t || self.is_near(t)
    }

    /// Takes one step, with the events before it.
    fn take_step(&mut self) -> Result<()> {
        while self.outcome.is_none() {
            let event = (self.running).with_dependent_mut(|_, motion| motion.advance());
            match event {
                Some(Event::Step { to, .. }) => {
                    (self.head, self.stepped) = (to, true);
                    return Ok(());
                }
                Some(Event::Stop(outcome)) => self.outcome = Some(outcome),
                None => self.outcome = Some(Outcome::EndOfTime),
                Some(event) => self.events.push(event),
            }
        }
        self.t = self.head;
        let at = self.t();
        Err(Error::domain(format!(
            "the motion ended at t = {at}: {}",
            self.ended().unwrap_or_default()
        )))
    }

    /// Looks at the present state.
    fn look<T>(&mut self, see: impl FnOnce(&Prepared, &dyn State) -> Result<T>) -> Result<T> {
        let (t, inside, stepped) = (self.t, self.t < self.head, self.stepped);
        self.running.with_dependent_mut(|prepared, motion| {
            let state = if !stepped {
                motion.given()
            } else if inside {
                let found = motion.sample(t);
                found.ok_or_else(|| {
                    Error::no_convergence("the state within the step was not found")
                })?
            } else {
                motion.now()
            };
            see(prepared, &*state)
        })
    }

    /// Columns of [`Simulation::row`]: those of the trajectory of a run.
    pub fn columns(&self) -> Table {
        table::trajectory(&self.prepared().header, 0)
    }

    /// The present state as a row of the trajectory.
    ///
    /// # Errors
    /// A state that cannot be evaluated.
    pub fn row(&mut self) -> Result<Vec<Cell>> {
        self.look(|prepared, state| {
            let stations = prepared.stations(state)?;
            let joints = prepared.joints(state)?;
            let moment = prepared.moment(state);
            Ok(table::row(&prepared.header, &moment, &stations, &joints))
        })
    }

    /// Names of the rods; one rod has an empty name.
    pub fn rods(&self) -> Vec<String> {
        let rods = self.prepared().header.rods.iter();
        rods.map(|rod| rod.name.clone()).collect()
    }

    /// The present shapes of the rods, in the form of [`shapes`](fn@super::shapes).
    ///
    /// # Errors
    /// A state that cannot be evaluated.
    pub fn shapes(&mut self, points: usize) -> Result<Shapes> {
        self.look(|prepared, state| prepared.curves(state, points))
    }

    /// Events so far, in the order of time and in the form of events.json.
    ///
    /// # Errors
    /// An event that cannot be evaluated.
    pub fn events(&self) -> Result<Vec<Value>> {
        let told = self.events.iter().map(|event| self.prepared().told(event));
        told.filter_map(Result::transpose).collect()
    }

    /// Steers the force on a body of [`Simulation::pushed`], by its number in the list: from now on `force`, along the
    /// axes of the world. Its work is in the column `work`.
    ///
    /// # Errors
    /// A number that is none of the list; a component that is not finite, or out of the plane of a planar rod.
    pub fn push(&mut self, number: usize, force: [f64; 3]) -> Result<()> {
        let Some(steered) = self.steered.get(number) else {
            return Err(Error::domain(
                "no body is to be pushed: name the bodies when the simulation is made",
            ));
        };
        if !force.iter().all(|x| x.is_finite()) {
            return Err(Error::domain(format!("force = {force:?}: must be finite")));
        }
        if self.plain.is_planar() && !self.plain.is_assembly() && force[2] != 0.0 {
            return Err(Error::domain(format!(
                "force = {force:?}: a planar rod moves in the plane of x and y; the third component must be 0"
            )));
        }
        if self.t < self.head {
            return Err(Error::domain(
                "a force changes at the end of a step: advance first",
            ));
        }
        if steered.value() == force {
            return Ok(());
        }
        steered.set(force);
        if let Some(log) = &mut self.log {
            let push = Push {
                t: self.t,
                k: number,
                force,
            };
            log.push(push);
        }
        if self.stepped {
            self.running.with_dependent_mut(|_, motion| motion.renew())
        } else {
            self.restart()
        }
    }

    /// Steered forces now, in the units of the scene.
    pub fn pushes(&self) -> Vec<[f64; 3]> {
        self.steered.iter().map(SteeredForce::value).collect()
    }

    /// Begins the motion anew at its start, under the present scene and steered forces.
    fn restart(&mut self) -> Result<()> {
        self.hold_until(f64::INFINITY);
        self.running.with_dependent_mut(|prepared, motion| {
            *motion = prepared.motion()?;
            Ok::<_, Error>(())
        })?;
        (self.t, self.head, self.stepped) = (0.0, 0.0, false);
        self.events.clear();
        self.outcome = None;
        Ok(())
    }

    /// Goes back to the start of the scene that the simulation was made with, without steered forces.
    ///
    /// # Errors
    /// A start from which no motion is possible.
    pub fn reset(&mut self) -> Result<()> {
        if self.changed {
            let (whole, steered) = steered_scene(&self.plain, &self.steered)?;
            self.running = Running::of(Box::new(Prepared::new(&whole)?))?;
            (self.steered, self.scene) = (steered, self.plain.clone());
            self.changed = false;
        }
        self.steered.iter().for_each(|force| force.set([0.0; 3]));
        self.log = Some(Vec::new());
        self.restart()
    }

    /// Everything from which the motion goes on. Where the motion saves no state, as among obstacles, the state is the
    /// time with the steered forces up to it: [`Simulation::restore`] then follows the motion once more.
    ///
    /// # Errors
    /// A state that cannot be saved, after loads have changed or another state was restored. The message says why.
    pub fn state(&mut self) -> Result<SimulationState> {
        let t = self.t;
        let motion = if self.stepped {
            let saved = self.running.with_dependent_mut(|_, motion| motion.save(t));
            match (saved, self.log.as_ref().filter(|_| !self.changed)) {
                (Err(_), Some(log)) => replay(t, log),
                (saved, _) => saved?,
            }
        } else {
            SavedState {
                method: SimulationState::START.to_owned(),
                t: 0.0,
                parts: [].into(),
            }
        };
        Ok(SimulationState {
            t: self.t(),
            motion,
            pushes: self.pushes(),
        })
    }

    /// Goes on from a saved state, of this simulation or of another of the same scene. Events after it are forgotten.
    ///
    /// # Errors
    /// The state of another model or of other rods.
    pub fn restore(&mut self, state: &SimulationState) -> Result<()> {
        if state.pushes.len() != self.steered.len() {
            return Err(Error::domain(format!(
                "the state has {} steered forces, and the simulation {}",
                state.pushes.len(),
                self.steered.len()
            )));
        }
        if state.motion.method == SimulationState::REPLAY {
            return self.replay(state);
        }
        let begun = state.motion.method == SimulationState::START;
        for (steered, force) in self.steered.iter().zip(&state.pushes) {
            steered.set(*force);
        }
        if begun {
            let forces = state.pushes.iter().enumerate();
            let pushes = forces.map(|(k, force)| Push {
                t: 0.0,
                k,
                force: *force,
            });
            self.log = Some(pushes.collect());
            return self.restart();
        }
        self.begin_at(&state.motion)?;
        self.log = None;
        let t = state.motion.t;
        let before = |event: &Event| time_of(event).is_some_and(|at| at <= t);
        self.events.retain(before);
        Ok(())
    }

    /// Follows the motion once more from the start up to a state.
    fn replay(&mut self, state: &SimulationState) -> Result<()> {
        if self.changed {
            return Err(Error::domain(
                "this state is reached from the start of the scene, and loads have changed since: reset the simulation first",
            ));
        }
        let unit = self.unit_of_time();
        let log = pushes_of(&state.motion)?;
        self.reset()?;
        for push in &log {
            self.advance(push.t * unit)?;
            self.push(push.k, push.force)?;
        }
        self.advance(state.t)
    }

    /// Begins the motion anew at a saved state, under the present scene.
    fn begin_at(&mut self, saved: &SavedState) -> Result<()> {
        self.hold_until(f64::INFINITY);
        self.running.with_dependent_mut(|prepared, motion| {
            let mut anew = prepared.motion()?;
            anew.restore(saved)?;
            *motion = anew;
            Ok::<_, Error>(())
        })?;
        self.stand_at_end();
        self.outcome = None;
        Ok(())
    }

    /// Makes the end of the last step the present. A motion that leaves a fold has moved on by a first small step.
    fn stand_at_end(&mut self) {
        let now = (self.running).with_dependent(|_, motion| motion.now().time());
        (self.t, self.head, self.stepped) = (now, now, true);
    }

    /// Goes on under another scene that differs in loads, friction or tensions alone. The change of energy is booked
    /// as work. `scene`: without the steered forces and functions on bodies, which stay.
    ///
    /// # Errors
    /// A scene that differs in another field; a state that cannot be saved; rods that cannot be in the present state
    /// under the new scene. The simulation is then unchanged.
    pub fn change(&mut self, scene: &Scene) -> Result<()> {
        let scene = scene.clone().with_functions_of(&self.scene)?;
        let (whole, steered) = steered_scene(&scene, &self.steered)?;
        let prepared = Box::new(Prepared::new(&whole)?);
        refuse_others(&self.prepared().header.scene, &prepared.header.scene)?;
        let t = self.t;
        let mut saved = None;
        if self.stepped {
            let state = (self.running).with_dependent_mut(|_, motion| motion.save(t))?;
            saved = Some(state);
        }
        let mut running = Running::of(prepared)?;
        if let Some(saved) = saved {
            let restored = running.with_dependent_mut(|_, motion| motion.restore(&saved));
            restored.map_err(|e| e.context("the present state under the changed scene"))?;
        }
        (self.running, self.steered) = (running, steered);
        (self.scene, self.changed) = (scene, true);
        if self.stepped {
            self.stand_at_end();
        }
        Ok(())
    }

    /// Another simulation in the present state ([`Simulation::state`]), independent of this one.
    ///
    /// # Errors
    /// Those of [`Simulation::state`].
    pub fn copy(&mut self) -> Result<Self> {
        let names: Vec<String> = self
            .steered
            .iter()
            .map(|force| force.body.clone())
            .collect();
        let names: Vec<&str> = names.iter().map(String::as_str).collect();
        let mut copy = Self::pushed(&self.plain, &names)?;
        let state = self.state()?;
        if self.changed {
            (copy.running, copy.steered, copy.changed) = {
                let (whole, steered) = steered_scene(&self.scene, &self.steered)?;
                (
                    Running::of(Box::new(Prepared::new(&whole)?))?,
                    steered,
                    true,
                )
            };
        }
        copy.restore(&state)?;
        copy.scene = self.scene.clone();
        copy.events = self.events.clone();
        copy.log = self.log.clone();
        Ok(copy)
    }
}

/// A scene with forces of its own in the place of steered ones, of the same values.
fn steered_scene(scene: &Scene, like: &[SteeredForce]) -> Result<(Scene, Vec<SteeredForce>)> {
    let mut whole = scene.clone();
    let steered = like.iter().map(|force| {
        let made = whole.steered(&force.body)?;
        made.set(force.value());
        Ok(made)
    });
    let steered = steered.collect::<Result<_>>()?;
    Ok((whole, steered))
}

/// Time of an event, in units of the motion.
fn time_of(event: &Event) -> Option<f64> {
    Some(match event {
        Event::Step { to, .. } => *to,
        Event::Snap(snap) => snap.t,
        Event::Layer(layer) => layer.from,
        Event::Bounce(bounce) => bounce.t,
        Event::Contact(event) => event.time(),
        Event::RodContact(event) => event.t,
        Event::Stop(_) => return None,
    })
}
