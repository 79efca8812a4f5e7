//! Viscoelastic runs as an iterator, step by step.

use super::contacts::ViscousContacts;
use super::sample::ViscousSample;
use super::snap_layer::LayerWatch;
use crate::adaptive_nodes::AdaptiveNodes;
use crate::contact::BodyAtEnd;
use crate::saved_state::{SavedState, outside_step};
use crate::{Event, Motion, Options, Outcome, Resolution, State, StateRef, StateVariables};
use nalgebra::DVector;
use snaprod_systems::body::EndBody;
use snaprod_systems::error::{Cause, Error, Message, Quantity, Result};
use snaprod_systems::solve::cost::Cost;
use snaprod_systems::solve::integrator::{Integrator, Method};
use snaprod_systems::viscoelastic::grid::{Grid, more};
use snaprod_systems::viscoelastic::kinematics::{AtEnd, Kinematics, Local};
use snaprod_systems::viscoelastic::material::Material;
use snaprod_systems::viscoelastic::reduced::Reduced;
use snaprod_systems::viscoelastic::resolution::{Demand, MOST_NODES, Nodes, ROUNDING, demand};
use snaprod_systems::viscoelastic::system::{Hold, ViscousSystem};
use std::sync::Arc;

/// The initial data of a viscoelastic run: any strains, any memory, any velocity of the end.
pub struct ViscousStart<'a, const M: usize, const D: usize> {
    /// Strains at s in [0, 1].
    pub strain: &'a dyn Fn(f64) -> Local<M>,
    /// Strains at which the Maxwell branches are relaxed; None: the initial strains.
    pub relaxed: Option<&'a dyn Fn(f64) -> Local<M>>,
    /// Velocity of the end.
    pub velocity: AtEnd<D>,
}

/// Initial number of nodes per element.
const FIRST: usize = 8;
/// Number of steps in a row after which unneeded nodes are given up.
const PATIENCE: u32 = 12;
/// A start is sampled down to distances 2^-NEAREST from the ends of the elements.
const NEAREST: i32 = 45;
/// Interpolation error between nodes, relative to 1 + the largest strain at the nodes, that reveals a bend
/// between nodes.
const FAR: f64 = 1e-3;
/// Largest error of the velocity of the end at the start, relative to 1 + its size; beyond it the rod cannot follow.
const FOLLOWS: f64 = 1e-9;
/// Rounding error of that velocity, relative to the velocities by the stresses alone and by the wrench alone.
const ROUNDED: f64 = 1e-13;

/// Shortest step to the end of a sequence of bounces, as a part of the duration of the run.
const SHORTEST: f64 = 1e-14;
/// Advice where contacts end a run.
const REMEDY: &str = "change the obstacles, the start or the friction a little";

/// Method of saved states.
const METHOD: &str = "a rod with friction and without mass";

/// A viscoelastic run in progress.
pub struct ViscousRun<'a, K: Kinematics<M, D>, B, const M: usize, const D: usize>
where
    B: EndBody<D, Pose = K::Pose>,
{
    pub(super) system: ViscousSystem<K, BodyAtEnd<'a, B>, M, D>,
    pub(super) integrator: Integrator,
    pub(super) options: Options,
    /// Contacts of the body with obstacles; None without obstacles.
    pub(super) contacts: Option<ViscousContacts<'a>>,
    watch: LayerWatch,
    /// An event of the last step that is still to be reported.
    pub(super) found: Option<Event>,
    tail: f64,
    nodes: AdaptiveNodes,
    pub(super) first: ViscousSample<K, M, D>,
    pub(super) current: ViscousSample<K, M, D>,
    stopped: bool,
    interrupted: bool,
}

impl<'a, K, B, const M: usize, const D: usize> ViscousRun<'a, K, B, M, D>
where
    K: Kinematics<M, D>,
    B: EndBody<D, Pose = K::Pose>,
{
    /// A run at time 0.
    ///
    /// # Errors
    /// Strains that are not finite or outside the law's domain, or so rough that [`MOST_NODES`] do not resolve them; a
    /// velocity that the rod cannot follow (an inextensible straight rod cannot be stretched); a tolerance below 1e-13.
    pub fn new(
        kinematics: K,
        material: Material<M>,
        body: &'a B,
        start: &ViscousStart<'_, M, D>,
        options: Options,
    ) -> Result<Self> {
        options.suits_strains("viscoelastic rod")?;
        let system = resolved(kinematics, material, body, start, &options)?;
        let grid = &system.rod.grid;
        let strains = field(grid, start.strain);
        let relaxed = start
            .relaxed
            .map_or_else(|| strains.clone(), |f| field(grid, f));
        let memory = vec![relaxed; system.rod.material.branches().len()];
        let y = system.state(&strains, &memory, &start.velocity);
        let (configuration, flow) = system.at(&y).ok_or_else(|| {
            Error::domain(
                "the strains at the start are outside the law's domain, or too large for a shape: give strains that the section admits",
            )
        })?;
        let first = ViscousSample::new(&system, &y, configuration, flow);
        let moved = system.rod.moved(&first.configuration, &first.flow);
        let missed = (moved - start.velocity).norm();
        // Rates are differences of the parts by stresses and by the wrench, which are large if the viscosity
        // is small.
        let parts: f64 = first
            .flow
            .fluidity
            .iter()
            .zip(&first.configuration.taken)
            .zip(grid.weights())
            .map(|((fluidity, taken), w)| w * (fluidity * taken).norm())
            .sum();
        if !(missed <= FOLLOWS * (1.0 + start.velocity.norm()) + ROUNDED * parts) {
            // In space with a welded end the angular velocity comes first.
            let of = |i: usize| Quantity::of_twist(if D == 6 { i } else { 3 });
            return Err(Error::domain(
                Message::from("the rod cannot follow the velocity ")
                    .list(start.velocity.as_slice(), of)
                    .words(
                        " of its end: it is straight and inextensible, or cannot be strained that way; it would move at ",
                    )
                    .list(moved.as_slice(), of)
                    .words("; change the velocity, or bend the rod a little"),
            ));
        }
        if options.method == Method::Symmetric {
            return Err(Error::domain(
                "method: symmetric steps keep the energy of a motion that can run backward, and a rod with damping loses it; let the \
                 program choose (auto), or ask for explicit or implicit steps",
            ));
        }
        let local = options.local_tolerance();
        let integrator = Integrator::new(&system, y, local, options.method, None)
            .ok_or_else(|| Error::domain("the motion is not defined at the start"))?;
        let nodes = AdaptiveNodes::new(options.nodes, PATIENCE, system.rod.grid.len());
        let watch = LayerWatch::new(&first);
        Ok(Self {
            system,
            integrator,
            options,
            contacts: None,
            watch,
            found: None,
            tail: 0.0,
            nodes,
            current: first.clone(),
            first,
            stopped: false,
            interrupted: false,
        })
    }

    /// The state at the start.
    pub fn first(&self) -> &ViscousSample<K, M, D> {
        &self.first
    }

    /// The state now.
    pub fn now(&self) -> &ViscousSample<K, M, D> {
        &self.current
    }

    /// The state at a time within the last step; None outside it.
    pub fn sample(&mut self, t: f64) -> Option<ViscousSample<K, M, D>> {
        if t == self.time() {
            return Some(self.current.clone());
        }
        let fraction = self.integrator.fraction(self.system.layout().time(), t)?;
        let y = self.integrator.at(&self.system, fraction)?;
        let mut sample = self.sample_of(&y)?;
        sample.t = t;
        Some(sample)
    }

    /// The sample of a state within the last step, or at its end.
    fn sample_of(&self, y: &DVector<f64>) -> Option<ViscousSample<K, M, D>> {
        let (configuration, flow) = match self.integrator.method_now() {
            Method::Implicit => self.system.reached(y)?,
            _ => self.system.at(y)?,
        };
        let sample = ViscousSample::new(&self.system, y, configuration, flow);
        Some(self.with_contacts(sample, y))
    }

    /// Samples the present state, which has changed.
    pub(super) fn see(&mut self) {
        if let Some(current) = self.sample_of(self.integrator.state()) {
            self.current = current;
        }
    }

    fn has_no_contacts(&self) -> Result<()> {
        match self.contacts {
            None => Ok(()),
            Some(_) => Err(Error::domain(
                "states of a motion among obstacles are neither saved nor restored yet: leave the obstacles out",
            )),
        }
    }

    /// The state at a time within the last step or at its end.
    ///
    /// # Errors
    /// A time outside the last step; a run among obstacles.
    pub fn save(&mut self, t: f64) -> Result<SavedState> {
        self.has_no_contacts()?;
        let layout = self.system.layout();
        let (y, sample) = if t == self.time() {
            (self.integrator.state().clone(), self.current.clone())
        } else {
            let inside = |run: &mut Self| {
                let fraction = run.integrator.fraction(layout.time(), t)?;
                let y = run.integrator.at(&run.system, fraction)?;
                let sample = run.sample_of(&y)?;
                Some((y, sample))
            };
            inside(self).ok_or_else(|| outside_step(t))?
        };
        let part = |range: std::ops::Range<usize>| y.as_slice()[range].to_vec();
        let counts = self.system.rod.grid.counts();
        Ok(SavedState::new(METHOD, t, &sample.ledger)
            .with("nodes", counts.iter().map(|n| *n as f64))
            .with("strains", part(0..layout.field()))
            .with("memory", part(layout.field()..layout.velocity()))
            .with("velocity", part(layout.velocity()..layout.time()))
            .with("integrals", part(layout.time() + 1..layout.place()))
            .with("place", part(layout.place()..layout.wrench()))
            .with("wrench", part(layout.wrench()..layout.len())))
    }

    /// Goes on from a saved state.
    ///
    /// # Errors
    /// The state of another method or of another rod; strains outside the law's domain; a run among obstacles.
    pub fn restore(&mut self, saved: &SavedState) -> Result<()> {
        self.has_no_contacts()?;
        saved.check(METHOD)?;
        let counts = saved.counts("nodes")?;
        let breaks = self.system.rod.grid.breaks();
        saved.sized("nodes", breaks.len() + 1)?;
        let before = self.system.rod.grid.clone();
        self.system.rod.grid = Arc::new(Grid::new(&breaks, &counts));
        let placed = self.place_at(saved);
        if placed.is_err() {
            self.system.rod.grid = before;
        }
        placed
    }

    /// Continues from a saved state on the present grid.
    fn place_at(&mut self, saved: &SavedState) -> Result<()> {
        let layout = self.system.layout();
        let mut numbers = Vec::with_capacity(layout.len());
        let time = [
            ("strains", layout.field()),
            ("memory", layout.branches * layout.field()),
            ("velocity", layout.end),
        ];
        for (name, size) in time {
            numbers.extend_from_slice(saved.sized(name, size)?);
        }
        numbers.push(saved.t);
        let integrals = layout.place() - layout.time() - 1;
        for (name, size) in [
            ("integrals", integrals),
            ("place", layout.place),
            ("wrench", layout.end),
        ] {
            numbers.extend_from_slice(saved.sized(name, size)?);
        }
        let mut y = DVector::from_vec(numbers);
        let outside = || Error::domain("the strains of the state are outside the law's domain");
        let (configuration, flow) = self.system.at(&y).ok_or_else(outside)?;
        let sample = ViscousSample::new(&self.system, &y, configuration, flow);
        y[layout.time() + 2] += saved.work_of_change(&sample.ledger)?;
        self.integrator
            .restart(&self.system, y, None)
            .ok_or_else(outside)?;
        self.current = self
            .sample_of(self.integrator.state())
            .ok_or_else(outside)?;
        self.first = self.current.clone();
        self.watch = LayerWatch::new(&self.current);
        self.nodes.record_total(self.system.rod.grid.len());
        (self.found, self.stopped) = (None, false);
        Ok(())
    }

    /// Time now.
    pub fn time(&self) -> f64 {
        self.integrator.state()[self.system.layout().time()]
    }

    /// End of time.
    pub fn duration(&self) -> f64 {
        self.options.duration
    }

    /// Ends the run at its next step.
    pub fn interrupt(&mut self) {
        self.interrupted = true;
    }

    /// Cost so far.
    pub fn cost(&self) -> Cost {
        self.integrator.cost()
    }

    /// The method of the last step.
    pub fn method(&self) -> Method {
        self.integrator.method_now()
    }

    /// Largest relative size of the last coefficients of a field so far, a measure of the resolution of the strains.
    pub fn tail(&self) -> f64 {
        self.tail
    }

    /// Most nodes so far.
    pub fn most_nodes(&self) -> usize {
        self.nodes.most()
    }

    /// The rod.
    pub fn rod(&self) -> &Reduced<K, M, D> {
        &self.system.rod
    }

    /// Ends the run; a layer under way is reported before the stop.
    pub(super) fn stop(&mut self, outcome: Outcome) -> Event {
        let stop = Event::Stop(outcome);
        let cut = || self.watch.cut(&self.current).map(Event::Layer);
        match self.found.take().or_else(cut) {
            Some(layer) => {
                self.found = Some(stop);
                layer
            }
            None => {
                self.stopped = true;
                stop
            }
        }
    }

    fn stuck(&mut self, cause: Cause, remedy: &str) -> Event {
        let outcome = Outcome::stuck(self.time(), cause, remedy);
        self.stop(outcome)
    }

    /// Judges the nodes after a step.
    fn judge(&mut self) -> std::result::Result<(), Cause> {
        let y = self.integrator.state();
        let strains = self.system.strains(y);
        let memory = self.system.memory(y);
        let fields: Vec<_> = std::iter::once(strains.as_slice())
            .chain(memory.iter().map(Vec::as_slice))
            .collect();
        let rod = &self.system.rod;
        let (tail, mut demand) = demand(&rod.grid, &fields, self.options.tolerance);
        let defect = rod
            .kinematics
            .defect(&rod.grid, &self.current.configuration.shape);
        if defect > self.options.tolerance.max(ROUNDING) && !matches!(demand, Demand::More(_)) {
            demand = Demand::More(rod.grid.counts().into_iter().map(more).collect());
        }
        self.tail = self.tail.max(tail);
        self.nodes.register_demand(demand, tail)
    }

    /// Carries the state over to a grid with these node counts on the elements.
    fn regrid(&mut self, counts: &[usize]) -> Option<()> {
        let y = self.integrator.state();
        let old = self.system.rod.grid.clone();
        let grid = Arc::new(Grid::new(&old.breaks(), counts));
        let carry = |field: &[Local<M>]| old.carried(field, &grid);
        let strains = carry(&self.system.strains(y));
        let memory: Vec<_> = self.system.memory(y).iter().map(|z| carry(z)).collect();
        let integrals = y.as_slice()[self.system.layout().time()..].to_vec();
        let velocity = self.system.velocity(y);
        self.nodes.record_total(grid.len());
        self.system.rod.grid = grid;
        let mut next = self.system.state(&strains, &memory, &velocity);
        next.as_mut_slice()[self.system.layout().time()..].copy_from_slice(&integrals);
        self.integrator.restart(&self.system, next, None)
    }

    /// Changes the form of implicit steps if the other one has become better.
    fn reform(&mut self) -> Option<()> {
        let (y, h) = (self.integrator.state(), self.integrator.next_step());
        let (at, flow) = (&self.current.configuration, &self.current.flow);
        let suited = self.system.suited(at, flow, y, h);
        let before = std::mem::replace(&mut self.system.hold, suited);
        if self.integrator.method_now() == Method::Explicit {
            if suited == Hold::Together {
                self.integrator.switch_to_implicit(&self.system);
            }
            return Some(());
        }
        if suited == before {
            return Some(());
        }
        let y = y.clone();
        self.integrator.restart(&self.system, y, None)
    }

    fn go_on(&mut self) -> Event {
        if let Some(event) = self.found.take() {
            self.stopped = matches!(event, Event::Stop(_));
            return event;
        }
        if self.interrupted {
            return self.stop(Outcome::Interrupted);
        }
        match self.contact_event() {
            Some(Ok(event)) => return event,
            Some(Err(why)) => return self.stuck(Cause::Failed(why), REMEDY),
            None => {}
        }
        let from = self.time();
        let left = self.options.duration - from;
        if !(left > 1e-14 * self.options.duration) {
            return self.stop(Outcome::EndOfTime);
        }
        if self.cost().steps >= self.options.max_steps {
            return self.stop(Outcome::StepLimit);
        }
        let held = self.reform();
        let wanted = self.nodes.wanted();
        if held.is_none() || wanted.is_some_and(|counts| self.regrid(&counts).is_none()) {
            return self.stuck(Cause::EdgeOfDomain, "change the loads, or the section");
        }
        // A break ahead by no more than rounding counts as passed.
        let past = from + 1e-14 * self.options.duration;
        let left = left.min(self.system.next_break(past) - from);
        let left = left.min((self.end_of_step() - from).max(SHORTEST * self.options.duration));
        self.look_until();
        let before = self.acceleration();
        if self.integrator.step(&self.system, left).is_err() {
            let cause = Cause::StepCollapsed {
                next: self.integrator.next_step(),
                tolerance: self.options.tolerance,
            };
            return self.stuck(
                cause,
                "the motion is too rough for double precision: raise the tolerance, or the damping",
            );
        }
        if let Err(why) = self.look_for_contact(&before) {
            return self.stuck(Cause::Failed(why), REMEDY);
        }
        let to = self.time();
        self.see();
        self.found = self
            .found
            .take()
            .or_else(|| self.watch.look(&self.current).map(Event::Layer));
        if let Err(cause) = self.judge() {
            return self.stuck(
                cause,
                "bends have become very sharp, as under enormous end forces: raise the tolerance or the damping, or change the loads",
            );
        }
        Event::Step { from, to }
    }
}

impl<K, B, const M: usize, const D: usize> Iterator for ViscousRun<'_, K, B, M, D>
where
    K: Kinematics<M, D>,
    B: EndBody<D, Pose = K::Pose>,
{
    type Item = Event;

    fn next(&mut self) -> Option<Event> {
        (!self.stopped).then(|| self.go_on())
    }
}

impl<'a, K, B, const M: usize, const D: usize> Motion<'a> for ViscousRun<'a, K, B, M, D>
where
    K: Kinematics<M, D>,
    B: EndBody<D, Pose = K::Pose>,
    ViscousSample<K, M, D>: State,
{
    fn advance(&mut self) -> Option<Event> {
        self.next()
    }

    fn given(&self) -> StateRef<'_> {
        StateRef::Kept(self.first())
    }

    fn now(&self) -> StateRef<'_> {
        StateRef::Kept(self.now())
    }

    fn sample(&mut self, t: f64) -> Option<StateRef<'_>> {
        Some(StateRef::Made(Box::new(self.sample(t)?)))
    }

    fn save(&mut self, t: f64) -> Result<SavedState> {
        self.save(t)
    }

    fn restore(&mut self, saved: &SavedState) -> Result<()> {
        self.restore(saved)
    }

    fn renew(&mut self) -> Result<()> {
        let y = self.integrator.state().clone();
        self.integrator
            .restart(&self.system, y, None)
            .ok_or_else(|| Error::domain("the motion is not defined under the new loads"))?;
        self.settle_contacts()?;
        self.see();
        Ok(())
    }

    fn duration(&self) -> f64 {
        self.duration()
    }

    fn interrupt(&mut self) {
        self.interrupt();
    }

    fn cost(&self) -> Cost {
        self.cost()
    }

    fn carries(&self) -> Vec<StateVariables> {
        let layout = self.system.layout();
        StateVariables::some([
            ("strains at the nodes", layout.field()),
            (
                "strains of the dashpots there",
                layout.branches * layout.field(),
            ),
            ("velocity of the end", layout.end),
            ("place of the end", layout.place),
            ("wrench on the end, which implicit steps find", layout.end),
            (
                "time, work, dissipation and loss to drag",
                layout.place() - layout.time(),
            ),
        ])
    }

    fn resolution(&self) -> Option<Resolution> {
        Some(Resolution {
            most_nodes: self.nodes.most(),
            tail: self.tail,
            rate_tail: None,
        })
    }
}

fn field<const M: usize>(grid: &Grid, f: &dyn Fn(f64) -> Local<M>) -> Vec<Local<M>> {
    grid.nodes().iter().map(|s| f(*s)).collect()
}

/// A place where the polynomials through the values at the nodes are far from the field. A bend so short that
/// it falls between nodes leaves no trace in the coefficients. The search covers the ends of the elements,
/// near which such bends occur.
fn missed<const M: usize>(
    grid: &Grid,
    f: &dyn Fn(f64) -> Local<M>,
    values: &[Local<M>],
) -> Option<f64> {
    let size = 1.0 + values.iter().map(Local::amax).fold(0.0, f64::max);
    grid.elements().iter().find_map(|element| {
        let length = element.to() - element.from();
        let near = (1..NEAREST).map(|k| length * 0.5f64.powi(k));
        let mut places: Vec<f64> = near
            .flat_map(|d| [element.from() + d, element.to() - d])
            .collect();
        places.sort_by(f64::total_cmp);
        let seen = grid.at_each(values, &places);
        let mut both = places.iter().zip(seen);
        both.find(|(s, seen)| !((f(**s) - seen).amax() <= FAR * size))
            .map(|(s, _)| *s)
    })
}

/// The system with as many nodes as the start needs.
fn resolved<'a, K, B, const M: usize, const D: usize>(
    kinematics: K,
    material: Material<M>,
    body: &'a B,
    start: &ViscousStart<'_, M, D>,
    options: &Options,
) -> Result<ViscousSystem<K, BodyAtEnd<'a, B>, M, D>>
where
    K: Kinematics<M, D>,
    B: EndBody<D, Pose = K::Pose>,
{
    let breaks = material.breaks();
    let first = match options.nodes {
        Nodes::Adaptive => FIRST,
        Nodes::Fixed(nodes) => nodes,
    };
    let mut counts = vec![first; breaks.len() + 1];
    loop {
        let grid = Grid::new(&breaks, &counts);
        let strains = field(&grid, start.strain);
        if let Some(i) = strains
            .iter()
            .position(|e| !e.iter().all(|x| x.is_finite()))
        {
            return Err(Error::domain(
                Message::from("the strains at s = ")
                    .number(grid.nodes()[i], Quantity::Length)
                    .words(" are ")
                    .list(strains[i].as_slice(), Quantity::of_strain)
                    .words("; they must be finite"),
            ));
        }
        let relaxed = start.relaxed.map_or_else(Vec::new, |f| field(&grid, f));
        let mut fields = vec![strains.as_slice()];
        if !relaxed.is_empty() {
            fields.push(&relaxed);
        }
        let shape = kinematics.shape(&grid, &strains);
        let blurred = shape
            .is_none_or(|shape| kinematics.defect(&grid, &shape) > options.tolerance.max(ROUNDING));
        let missed = missed(&grid, start.strain, &strains)
            .or_else(|| start.relaxed.and_then(|f| missed(&grid, f, &relaxed)));
        let (tail, demand) = demand(&grid, &fields, options.tolerance);
        let more = match demand {
            Demand::More(counts) => Some(counts),
            _ if blurred || missed.is_some() => Some(grid.counts().into_iter().map(more).collect()),
            _ => None,
        };
        match more {
            Some(more) if options.nodes == Nodes::Adaptive => {
                if more.iter().any(|n| *n > MOST_NODES) {
                    return Err(Error::domain(match missed {
                        Some(s) => Message::from(format!(
                            "the strains at the start are too rough: {MOST_NODES} nodes on an element do not see those at s = "
                        ))
                        .number(s, Quantity::Length)
                        .words(", ")
                        .list((start.strain)(s).as_slice(), Quantity::of_strain)
                        .words(
                            "; a rod that is held at almost its full reach is straight but for such a bend, far shorter than the \
                             rod: start further inside, or give smoother strains",
                        ),
                        None => Message::from(format!(
                            "the strains at the start are too rough: {MOST_NODES} nodes on an element leave coefficients of {tail:.1e} (tolerance {:.1e}); \
                             give smoother strains, or a larger tolerance",
                            options.tolerance
                        )),
                    }));
                }
                counts = more;
            }
            _ => {
                let rod = Reduced {
                    kinematics,
                    material,
                    grid: Arc::new(grid),
                };
                let body = BodyAtEnd {
                    free: body,
                    contacts: None,
                };
                return Ok(ViscousSystem::new(rod, body, Hold::Velocity));
            }
        }
    }
}
