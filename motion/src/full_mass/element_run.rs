//! Runs of rods with mass in elements, step by step: motions at an engineer's accuracy.
//!
//! Steps are implicit (Radau IIA). Errors are measured in places, so that steps are as long as the motion asked for
//! allows. Waves that are faster than the steps die out, and their energy is booked as numerical loss. Elements are
//! added where the places show that they are too long.

use super::element_sample::{ElementSample, ledger};
use super::run::{HeavyRun, resolved_start};
use super::start::HeavyStart;
use super::touch::{RodsInStep, first_contact};
use crate::contact::RodContactEvent;
use crate::saved_state::{SavedState, outside_step};
use crate::{Event, Motion, Options, Outcome, Resolution, State, StateRef, StateVariables};
use nalgebra::DVector;
use snaprod_systems::assembly::{Contact, Nearness, Tube};
use snaprod_systems::error::{Cause, Error, Message, Quantity, Result};
use snaprod_systems::full_mass::assembly::HeavyAssembly;
use snaprod_systems::full_mass::elements::{
    ElementAssembly, ElementMoment, Freedoms, INTEGRALS, Mesh, Missed, Touching,
};
use snaprod_systems::solve::cost::Cost;
use snaprod_systems::solve::integrator::{Integrator, Method};
use snaprod_systems::viscoelastic::resolution::Nodes;
use std::collections::VecDeque;
use std::sync::Arc;

/// Name of the state variables of rods in elements.
pub const IN_ELEMENTS: &str = "places and velocities of nodes and bodies";

/// Smallest tolerance of runs in elements. At finer ones the strains at Gauss nodes are ahead.
const FINEST: f64 = 0.99e-5;
/// Degree of the elements, and that for tolerances below `CLOSE`.
const DEGREE: usize = 6;
const CLOSE_DEGREE: usize = 8;
const CLOSE: f64 = 1e-4;
/// Local tolerance at the tolerance 1e-3, and its power of the tolerance. Radau's estimate is a power 2/3 of the
/// local tolerance, so that the error of a run is about the tolerance.
const LOCAL: f64 = 5e-6;
const LOCAL_POWER: f64 = 1.6;
/// Power of the tolerance that bounds the last coefficients of an element: the error of places is nearly their
/// square.
const TAIL_POWER: f64 = 2.0 / 3.0;
const TAIL: f64 = 0.7;
/// Elements of an interval at the start. Fewer elements would lose the waves that begin in the interval.
const FIRST: usize = 2;
/// Most elements of an interval.
const MOST_ELEMENTS: usize = 400;
/// Give of the springs of rigid strains under the loads, over the tolerance. The stiffness of the springs follows, up
/// to `HARDEST` times that of the first springs. Loads in time are sampled in `LOOKS` intervals of the run.
const GIVE: f64 = 0.3;
const LOOKS: usize = 64;
const HARDEST: f64 = 1e7;
/// Largest give of a rigid strain, over the tolerance; a larger give ends the run.
const GIVES_WAY: f64 = 10.0;
/// Distance, over the tolerance, within which the equilibrium of the elements is taken for that of a settled start.
const NEAR_REST: f64 = 30.0;
/// Gap at which obstacles are near, over the width of their barrier, and error of places there over that width.
const NEAR: f64 = 100.0;
const WITHIN_GAP: f64 = 0.02;
/// Points looked at for each point of a rod that an obstacle may push.
const BETWEEN: usize = 4;
/// Part of the accelerations out of a plane that ends a motion in the plane.
const ASIDE: f64 = 1e-9;

/// Stands in saved states for the axis of a motion that is not restricted to a plane.
const NO_AXIS: f64 = 3.0;
/// Method of saved states.
const METHOD: &str = "rods with mass in elements";

/// A run of rods in elements in progress.
pub struct ElementRun {
    model: Arc<ElementAssembly>,
    given: HeavyAssembly,
    integrator: Integrator,
    options: Options,
    first: ElementSample,
    current: ElementSample,
    /// Energy at the start, less work and losses that are known: what it falls below is numerical loss.
    energy: f64,
    numerical: f64,
    /// Numerical loss, and total of the ledger, at the start of the last step.
    numerical_before: f64,
    total_before: f64,
    tail: f64,
    /// True until something moves, and shows whether it stays in a plane.
    undecided: bool,
    most_nodes: usize,
    /// Distances between rods with a contact diameter, where the first contact ends the run.
    near: Option<Nearness>,
    /// Touches and releases of rods that are still to be reported.
    touched: VecDeque<RodContactEvent>,
    /// True if rigid strains give far more than the tolerance.
    gives: bool,
    /// Reason for an end of the run with the last step.
    ended: Option<Outcome>,
    stopped: bool,
    interrupted: bool,
}

/// The motion of rods with mass by the method that suits the tolerance: in elements where it is coarse, else by the
/// strains at Gauss nodes.
///
/// # Errors
/// As [`HeavyRun::new`].
pub fn heavy_motion<'a>(
    given: &HeavyAssembly,
    start: &HeavyStart<'_>,
    options: Options,
) -> Result<Box<dyn Motion<'a> + 'a>> {
    let asked = options.method == Method::Auto && options.nodes == Nodes::Adaptive;
    if given
        .obstacles()
        .is_some_and(|among| !among.obstacles.is_empty())
    {
        return among_obstacles(given, start, options, asked);
    }
    if !asked || options.tolerance < FINEST {
        return Ok(Box::new(HeavyRun::new(given, start, options)?));
    }
    match in_elements(given, &options) {
        Ok(model) => Ok(Box::new(ElementRun::new(given, model, start, options)?)),
        Err(why) => {
            let run = HeavyRun::new(given, start, options)?;
            Ok(Box::new(run.without_elements(why.to_string())))
        }
    }
}

/// The motion of rods with mass among obstacles: in elements.
fn among_obstacles<'a>(
    given: &HeavyAssembly,
    start: &HeavyStart<'_>,
    options: Options,
    asked: bool,
) -> Result<Box<dyn Motion<'a> + 'a>> {
    let only = "rods with all of their mass touch obstacles in elements";
    if !asked || options.tolerance < FINEST {
        return Err(Error::domain(format!(
            "{only}: leave out method and nodes, and write a tolerance of 1e-5 or more"
        )));
    }
    let model = in_elements(given, &options).map_err(|why| why.context(only))?;
    Ok(Box::new(ElementRun::new(given, model, start, options)?))
}

/// The assembly with each rod cut into the elements of the start.
///
/// # Errors
/// Rods that elements do not follow.
fn in_elements(given: &HeavyAssembly, options: &Options) -> Result<ElementAssembly> {
    let intervals = given.links.iter();
    let intervals = intervals.map(|link| vec![FIRST; link.rod.given.breaks().len() + 1]);
    let degree = if options.tolerance < CLOSE {
        CLOSE_DEGREE
    } else {
        DEGREE
    };
    let mesh = Mesh {
        elements: intervals.collect(),
        degree,
    };
    ElementAssembly::new(given, mesh)
}

impl ElementRun {
    fn new(
        given: &HeavyAssembly,
        model: ElementAssembly,
        start: &HeavyStart<'_>,
        options: Options,
    ) -> Result<Self> {
        let (strained, strains, _) = resolved_start(given, start, &options)?;
        let outside = || {
            Error::domain(
                "the strains at the start are outside the law's domain, or too large for a shape of the rod",
            )
        };
        let at = strained.at(&strains).ok_or_else(outside)?;
        let bound = tail_bound(&options);
        let strained_state = |model: &ElementAssembly| {
            let rods = (0..model.rods()).map(|k| strained.motions_of(&at, k, model.places(k)));
            model.state(&at.places(), &rods.collect::<Vec<_>>())
        };
        let mut model = model;
        let (model, y) = loop {
            let y = strained_state(&model);
            let moment = model.moment(&y).ok_or_else(outside)?;
            match finer(&model, &model.tails(&moment), bound) {
                Some(mesh) => model = ElementAssembly::new(given, mesh)?,
                None => break (model, y),
            }
        };
        let loaded = model.moment(&y).ok_or_else(outside)?;
        let times: Vec<f64> = (0..=LOOKS)
            .map(|k| loaded.t + options.duration * k as f64 / LOOKS as f64)
            .collect();
        let give = model.give_under_loads(&loaded, &times) / (GIVE * options.tolerance);
        let model = model.with_hold(give.clamp(1.0, HARDEST));
        outside_obstacles(given, &model, &loaded)?;
        let strength = model.barrier_strength(&loaded, &times);
        let model = model.with_barrier_strength(strength);
        let (model, undecided) = match in_a_plane(&model, &y) {
            InPlane::One(axis) => (model.with_freedoms(Freedoms::Plane(axis)), false),
            InPlane::Many => (model, true),
            InPlane::None => (model, false),
        };
        let (mut model, mut y) = (model, y);
        while start.settled && given.is_held() {
            let like = |made: ElementAssembly| {
                let held = made.with_hold(model.hold());
                held.with_freedoms(model.freedoms())
                    .with_barrier_strength(strength)
            };
            let standing = ElementAssembly::new(&given.standing_at(0.0), model.mesh().clone())?;
            let Some(rested) = like(standing).rested(&y, NEAR_REST * options.tolerance) else {
                break;
            };
            let moment = model.moment(&rested).ok_or_else(outside)?;
            let Some(mesh) = finer(&model, &model.tails(&moment), bound) else {
                y = rested;
                break;
            };
            model = like(ElementAssembly::new(given, mesh)?);
            y = strained_state(&model);
        }
        let moment = model.moment(&y).ok_or_else(outside)?;
        let model = Arc::new(model.with_near_rods(&moment, 0.0).anchored(&moment));
        let near = nearness(given, &model, &moment);
        let touching = near.as_ref().and_then(|near| near.contact);
        if let Some(contact) = touching.filter(|contact| contact.gap < 0.0) {
            return Err(contact.at_start(|rod| given.rod_name(rod)));
        }
        if model.least_gap_of_rods(&moment) == f64::NEG_INFINITY {
            return Err(Error::domain(
                "rods are inside of each other at the start: start elsewhere, or set contact_diameter = 0 in a rod",
            ));
        }
        let near = near.filter(|_| !model.rods_meet());
        let first = ElementSample::new(&model, moment.clone(), &y.as_slice()[model.time()..], 0.0);
        let local = LOCAL * (options.tolerance / 1e-3).powf(LOCAL_POWER);
        let first_step = start.step_from_rest(&first.ledger(), &options);
        let integrator = Self::integrator(&model, y, local, first_step).ok_or_else(outside)?;
        let total = first.ledger().total();
        Ok(Self {
            energy: total,
            total_before: total,
            most_nodes: model.most_nodes(),
            current: first.clone(),
            first,
            given: given.clone(),
            model,
            integrator,
            options,
            numerical: 0.0,
            numerical_before: 0.0,
            tail: 0.0,
            undecided,
            near,
            touched: VecDeque::new(),
            gives: false,
            ended: None,
            stopped: false,
            interrupted: false,
        })
    }

    fn integrator(
        model: &ElementAssembly,
        y: DVector<f64>,
        tolerance: f64,
        first_step: Option<f64>,
    ) -> Option<Integrator> {
        let mut integrator = Integrator::new(model, y, tolerance, Method::Implicit, first_step)?;
        integrator.keep_order();
        Some(integrator)
    }

    fn time(&self) -> f64 {
        self.integrator.state()[self.model.time()]
    }

    fn stop(&mut self, outcome: Outcome) -> Event {
        self.stopped = true;
        Event::Stop(outcome)
    }

    fn stuck(&mut self, cause: Cause, remedy: &str) -> Event {
        let outcome = Outcome::stuck(self.time(), cause, remedy);
        self.stop(outcome)
    }

    /// Continues from a state of the last model on another one.
    fn on(&mut self, model: ElementAssembly, from: &DVector<f64>) -> Option<()> {
        let state = model.carried(&self.model, from)?;
        let model = if model.rods_meet() {
            let moment = model.moment(&state)?;
            model.with_near_rods(&moment, self.way_ahead(&moment))
        } else {
            model
        };
        let model = model.anchored_as(&self.model, &state, from)?;
        self.integrator.restart(&model, state, None)?;
        self.model = Arc::new(model);
        self.most_nodes = self.most_nodes.max(self.model.most_nodes());
        Some(())
    }

    /// A bound of the ways of nodes in the next step.
    fn way_ahead(&self, at: &ElementMoment) -> f64 {
        let step = self.integrator.next_step().min(self.options.duration);
        self.model.fastest(at) * step
    }

    /// Lists what is near other rods anew, where the list does not serve for the next step.
    fn look_ahead(&mut self) -> Option<()> {
        if !self.model.rods_meet() {
            return Some(());
        }
        let moment = self.model.moment(self.integrator.state())?;
        let way = self.way_ahead(&moment);
        if !self.model.knows_near_rods(&moment, way) {
            let model = ElementAssembly::clone(&self.model);
            self.model = Arc::new(model.with_near_rods(&moment, way));
        }
        Some(())
    }

    /// Restricts the motion to a plane, once the rods move and stay in one plane alone.
    fn decide(&mut self) -> Option<()> {
        let state = self.integrator.state().clone();
        match in_a_plane(&self.model, &state) {
            InPlane::Many => {}
            InPlane::None => self.undecided = false,
            InPlane::One(axis) => {
                self.undecided = false;
                let model = ElementAssembly::clone(&self.model);
                self.on(model.with_freedoms(Freedoms::Plane(axis)), &state)?;
            }
        }
        Some(())
    }

    /// Bound of the last coefficients of an element. Near obstacles the error of places is below the width of their
    /// barrier.
    fn tail_bound(&self) -> f64 {
        let bound = tail_bound(&self.options);
        let (Some(among), Some(contact)) = (self.given.obstacles(), self.current.contact()) else {
            return bound;
        };
        if contact.least_gap < NEAR * among.gap {
            bound.min((WITHIN_GAP * among.gap).sqrt())
        } else {
            bound
        }
    }

    /// Takes a step no longer than `left`, on as many elements as it needs. None if there is no such step.
    fn step(&mut self, left: f64) -> Option<()> {
        let bound = self.tail_bound();
        self.look_ahead()?;
        loop {
            self.integrator.step(&*self.model, left).ok()?;
            let state = self.integrator.state();
            let moment = self.model.moment(state)?;
            let from = self.integrator.from().clone();
            let before = self.model.moment(&from)?;
            let mut missed = self.model.missed(&before, &moment);
            if let Some(Missed::Near { way }) = missed {
                let model = ElementAssembly::clone(&self.model).with_near_rods(&before, way);
                let same = model.has_near_rods_of(&self.model);
                self.model = Arc::new(model);
                if !same {
                    let span = self.integrator.span();
                    self.integrator.restart(&*self.model, from, Some(span))?;
                    continue;
                }
                missed = self.model.missed(&before, &moment);
            }
            if let Some(missed) = missed {
                if missed == Missed::Between {
                    let denser = ElementAssembly::clone(&self.model).with_denser_points(2)?;
                    self.on(denser, &from)?;
                }
                let half = 0.5 * self.integrator.span();
                self.integrator.restart(&*self.model, from, Some(half))?;
                continue;
            }
            if self.model.leaves_plane(state)? > ASIDE {
                let whole = ElementAssembly::clone(&self.model);
                self.on(whole.with_freedoms(Freedoms::Space), &from)?;
                continue;
            }
            if self.model.give(&moment)? > GIVES_WAY * self.options.tolerance {
                self.gives = true;
                return None;
            }
            let tails = self.model.tails(&moment);
            let largest = tails
                .iter()
                .flatten()
                .fold(0.0, |most, tail| tail.max(most));
            let Some(mesh) = finer(&self.model, &tails, bound) else {
                self.tail = self.tail.max(largest);
                return Some(());
            };
            let freedoms = self.model.freedoms();
            let hold = self.model.hold();
            let model = ElementAssembly::new(&self.given, mesh).ok()?;
            let model = model.with_barrier_strength(self.model.strength());
            let among_obstacles = model.strength().is_some();
            let finer = self.on(model.with_freedoms(freedoms).with_hold(hold), &from);
            if finer.is_none() && among_obstacles {
                // Places of rods on more elements differ by an error, and may lie inside an obstacle.
                self.tail = self.tail.max(largest);
                return Some(());
            }
            finer?;
        }
    }

    fn go_on(&mut self) -> Event {
        if self.interrupted {
            return self.stop(Outcome::Interrupted);
        }
        if let Some(event) = self.touched.pop_front() {
            return Event::RodContact(event);
        }
        if let Some(outcome) = self.ended.take() {
            return self.stop(outcome);
        }
        let from = self.time();
        let left = self.options.duration - from;
        if !(left > 1e-14 * self.options.duration) {
            return self.stop(Outcome::EndOfTime);
        }
        if self.integrator.cost().steps >= self.options.max_steps {
            return self.stop(Outcome::StepLimit);
        }
        if self.undecided && self.decide().is_none() {
            return self.stuck(Cause::EdgeOfDomain, "change the loads, or the section");
        }
        if self.model.rubs() {
            // Samples inside of the last step needed the anchors of its start.
            let model = ElementAssembly::clone(&self.model);
            self.model = Arc::new(model.anchored(self.current.moment()));
        }
        let past = from + 1e-14 * self.options.duration;
        let left = left.min(self.model.next_break(past) - from);
        if self.step(left).is_none() {
            if self.gives {
                let remedy = "what is held rigid gives more than the tolerance: give the section its axial and shear \
                              stiffness, or ask for a tolerance of 1e-6";
                return self.stuck(Cause::EdgeOfDomain, remedy);
            }
            let cause = Cause::StepCollapsed {
                next: self.integrator.next_step(),
                tolerance: self.options.tolerance,
            };
            return self.stuck(
                cause,
                "the loads change faster than steps can follow, or the rod is beyond its law: change the loads or the section",
            );
        }
        if self.look_for_contact().is_none() {
            let remedy = "a contact of rods was not located: lower the tolerance";
            return self.stuck(Cause::EdgeOfDomain, remedy);
        }
        let to = self.time();
        match self.sampled(self.integrator.state(), None) {
            Some((current, numerical)) => {
                (self.numerical_before, self.numerical) = (self.numerical, numerical);
                self.total_before = self.current.ledger().total();
                let changes = current.changed_contacts(&self.current);
                self.touched.extend(changes);
                self.current = current;
            }
            None => return self.stuck(Cause::EdgeOfDomain, "change the loads, or the section"),
        }
        Event::Step { from, to }
    }

    /// Shortens the step to the first contact of rods. None if the contact cannot be located.
    fn look_for_contact(&mut self) -> Option<()> {
        if self.near.is_none() {
            return Some(());
        }
        let after = self.nearness(self.integrator.state())?;
        let before = self.near.replace(after.clone()).unwrap_or_default();
        let Some((contact, part)) = first_contact(self, &before, &after)? else {
            return Some(());
        };
        let h = part * self.integrator.span();
        let from = self.integrator.from().clone();
        self.integrator.restart(&*self.model, from, Some(h))?;
        // If the step comes out shorter, the next step leads to the contact.
        self.integrator.step(&*self.model, h).ok()?;
        if self.integrator.span() >= h * (1.0 - 1e-9) {
            let there = self.contact_near(self.integrator.state(), &contact);
            self.ended = Some(Outcome::SelfContact(there.unwrap_or(contact)));
        }
        Some(())
    }

    /// The sample of a state, and the numerical loss: the energy that is missing, which never falls.
    fn sampled(&self, y: &DVector<f64>, numerical: Option<f64>) -> Option<(ElementSample, f64)> {
        let moment = self.model.moment(y)?;
        let integrals = &y.as_slice()[self.model.time()..];
        let numerical = numerical.unwrap_or_else(|| {
            let known = ledger(&self.model, &moment, integrals, 0.0).total();
            self.numerical.max(self.energy - known)
        });
        let sample = ElementSample::new(&self.model, moment, integrals, numerical);
        Some((sample, numerical))
    }

    /// The state at the fraction x of the last step: the polynomial of degree 5 through places, velocities and
    /// accelerations at both ends, or that of degree 3 where waves blur the accelerations.
    fn between(&self, x: f64) -> Option<DVector<f64>> {
        let (from, to) = (self.integrator.from(), self.integrator.state());
        let h = self.integrator.span();
        let slope = |y: &DVector<f64>| {
            let mut out = DVector::zeros(y.len());
            snaprod_systems::solve::system::System::slope(&*self.model, y, &mut out)?;
            Some(out)
        };
        let (before, after) = (slope(from)?, slope(to)?);
        let mut y = from + (to - from) * x;
        // Deviation from the chord, by Hermite's cubic.
        let (a, b) = (x * (1.0 - x).powi(2), x * x * (1.0 - x));
        let cubic = |y: &mut DVector<f64>, i: usize| {
            let chord = to[i] - from[i];
            y[i] += a * (h * before[i] - chord) - b * (h * after[i] - chord);
        };
        (0..self.model.time()).for_each(|i| cubic(&mut y, i));
        (self.model.time() + 1..y.len()).for_each(|i| cubic(&mut y, i));
        // The correction of degree 5 has the accelerations at both ends.
        let mut bent = y.clone();
        let mut change = 0.0_f64;
        let weight = (x * (1.0 - x)).powi(2) / 2.0;
        for (place, speed) in self.model.places_and_speeds() {
            // Second derivatives of the cubic at both ends.
            let chord = to[place] - from[place];
            let (v, w) = (h * from[speed], h * to[speed]);
            let cubic = [
                6.0 * chord - 4.0 * v - 2.0 * w,
                -6.0 * chord + 2.0 * v + 4.0 * w,
            ];
            let missing = [
                h * h * before[speed] - cubic[0],
                h * h * after[speed] - cubic[1],
            ];
            let add = weight * (missing[0] * (1.0 - x) + missing[1] * x);
            change = change.max(add.abs());
            bent[place] += add;
        }
        if change < self.options.tolerance {
            y = bent;
        }
        let slopes = ((1.0 - x) * (1.0 - 3.0 * x), x * (2.0 - 3.0 * x));
        let rate = |i: usize| {
            let chord = to[i] - from[i];
            (chord + slopes.0 * (h * before[i] - chord) - slopes.1 * (h * after[i] - chord)) / h
        };
        for site in 0..self.model.sites() {
            let at = self.model.spin_of(site);
            let size = |y: &DVector<f64>| y.fixed_rows::<3>(at).norm();
            // Slender sections turn faster than the steps resolve: the turns have the spins, the accelerations do not.
            if h * (size(&before) + size(&after)) > size(from) + size(to) {
                self.model.set_spin(site, &mut y, rate);
            }
        }
        y[self.model.time()] = from[self.model.time()] + x * h;
        Some(y)
    }
}

impl RodsInStep for ElementRun {
    fn inside(&mut self, part: f64) -> Option<DVector<f64>> {
        self.between(part)
    }

    fn nearness(&self, y: &DVector<f64>) -> Option<Nearness> {
        nearness(&self.given, &self.model, &self.model.moment(y)?)
    }

    fn contact_near(&self, y: &DVector<f64>, near: &Contact) -> Option<Contact> {
        near.now(&tubes(&self.given, &self.model, &self.model.moment(y)?))
    }

    fn relative_span(&self) -> f64 {
        self.integrator.span() / self.options.duration
    }
}

/// Refuses a start inside of an obstacle.
fn outside_obstacles(
    given: &HeavyAssembly,
    model: &ElementAssembly,
    at: &ElementMoment,
) -> Result<()> {
    let (Some(nearest), Some(obstacles)) = (model.nearest_place(at, BETWEEN), given.obstacles())
    else {
        return Ok(());
    };
    if nearest.gap > 0.0 {
        return Ok(());
    }
    let (what, s) = match nearest.of {
        Touching::Rod { rod, centre, .. } => (given.rod_name(rod), Some(centre)),
        Touching::Body(_) => ("a body".to_owned(), None),
    };
    let shape = obstacles.obstacles[nearest.obstacle].name();
    let mut inside = Message::from(format!("{what} starts "))
        .number(-nearest.gap, Quantity::Length)
        .words(format!(
            " inside of a {shape} (obstacle {})",
            nearest.obstacle + 1
        ));
    if let Some(s) = s {
        inside = inside
            .words(", deepest at s = ")
            .number(s, Quantity::Length);
    }
    let inside = inside
        .words("; surfaces lie on each other at a distance of contact.gap: move one of the two");
    Err(Error::domain(inside))
}

/// Centrelines of the rods with a contact diameter.
fn tubes<'a>(
    given: &'a HeavyAssembly,
    model: &'a ElementAssembly,
    at: &'a ElementMoment,
) -> Vec<Tube<'a>> {
    let rods = given.links.iter().enumerate();
    let tubes = rods.filter_map(|(k, link)| {
        let held = link.ties().map(|tie| &tie.on.on).collect();
        let exact = move |s: f64| Some(model.centreline(at, k, s));
        Tube::new(k, link.rod.given.diameter?, held, model.length(k), exact)
    });
    tubes.collect()
}

/// Distances of rods with a contact diameter to themselves and to each other; None without such rods.
fn nearness(
    given: &HeavyAssembly,
    model: &ElementAssembly,
    at: &ElementMoment,
) -> Option<Nearness> {
    let tubes = tubes(given, model, at);
    (!tubes.is_empty()).then(|| Nearness::of(&tubes))
}

/// Planes in which the rods are and move.
enum InPlane {
    None,
    /// The plane normal to the world axis of this number.
    One(usize),
    /// Nothing moves yet.
    Many,
}

/// The planes normal to an axis in which a state stays.
fn in_a_plane(model: &ElementAssembly, y: &DVector<f64>) -> InPlane {
    let flat = |axis: &usize| {
        let flat = model.clone().with_freedoms(Freedoms::Plane(*axis));
        flat.leaves_plane(y).is_some_and(|off| off < ASIDE)
    };
    let mut axes = (0..3).filter(flat);
    match (axes.next(), axes.next()) {
        (None, _) => InPlane::None,
        (Some(axis), None) => InPlane::One(axis),
        _ => InPlane::Many,
    }
}

/// Bound of the last coefficients of an element.
fn tail_bound(options: &Options) -> f64 {
    TAIL * options.tolerance.powf(TAIL_POWER)
}

/// The mesh with more elements where tails are beyond the bound; None if there are enough.
fn finer(model: &ElementAssembly, tails: &[Vec<f64>], bound: f64) -> Option<Mesh> {
    let mut mesh = model.mesh().clone();
    let mut changed = false;
    for (counts, tails) in mesh.elements.iter_mut().zip(tails) {
        for (count, tail) in counts.iter_mut().zip(tails) {
            if *tail > bound && *count < MOST_ELEMENTS {
                // Halves of elements have the same polynomials: momentum and energy stay.
                *count *= 2;
                changed = true;
            }
        }
    }
    changed.then_some(mesh)
}

impl<'a> Motion<'a> for ElementRun {
    fn advance(&mut self) -> Option<Event> {
        (!self.stopped).then(|| self.go_on())
    }

    fn given(&self) -> StateRef<'_> {
        StateRef::Kept(&self.first)
    }

    fn now(&self) -> StateRef<'_> {
        StateRef::Kept(&self.current)
    }

    fn sample(&mut self, t: f64) -> Option<StateRef<'_>> {
        if t == self.time() {
            return Some(StateRef::Kept(&self.current));
        }
        let x = self.integrator.fraction(self.model.time(), t)?;
        let mut y = self.between(x)?;
        y[self.model.time()] = t;
        let between = |before: f64, now: f64| before + x * (now - before);
        let numerical = between(self.numerical_before, self.numerical);
        // Small errors of places are large energies of stiff strains, and larger forces of the springs that hold rigid
        // strains, or lead into an obstacle: a step of its own then leads to the sample.
        let total = between(self.total_before, self.current.ledger().total());
        let closed = self.sampled(&y, Some(numerical)).filter(|(sample, _)| {
            let ledger = sample.ledger();
            (ledger.total() - total).abs() <= self.options.tolerance * ledger.largest()
        });
        let (sample, _) = match closed.filter(|_| !self.model.has_springs()) {
            Some(made) => made,
            None => {
                let mut y = self.integrator.at(&*self.model, x)?;
                y[self.model.time()] = t;
                self.sampled(&y, Some(numerical))?
            }
        };
        Some(StateRef::Made(Box::new(sample)))
    }

    fn save(&mut self, t: f64) -> Result<SavedState> {
        let numerical =
            |x: f64| self.numerical_before + x * (self.numerical - self.numerical_before);
        let (y, numerical) = if t == self.time() {
            (self.integrator.state().clone(), self.numerical)
        } else {
            let x = self.integrator.fraction(self.model.time(), t);
            let x = x.ok_or_else(|| outside_step(t))?;
            let numerical = numerical(x);
            let y = self.integrator.at(&*self.model, x);
            (y.ok_or_else(|| outside_step(t))?, numerical)
        };
        let (sample, _) = (self.sampled(&y, Some(numerical))).ok_or_else(|| outside_step(t))?;
        let (mesh, time, y) = (self.model.mesh(), self.model.time(), y.as_slice());
        let elements = mesh.elements.iter().flatten();
        let axis = match self.model.freedoms() {
            Freedoms::Space => NO_AXIS,
            Freedoms::Plane(axis) => axis as f64,
        };
        Ok(SavedState::new(METHOD, t, &sample.ledger())
            .with("elements", elements.map(|n| *n as f64))
            .with("degree", [mesh.degree as f64])
            .with("plane", [axis])
            .with("undecided", [f64::from(u8::from(self.undecided))])
            .with("hold", [self.model.hold()])
            .with("motion", y[..time].to_vec())
            .with("integrals", y[time + 1..time + INTEGRALS].to_vec())
            .with("numerical_loss", [numerical]))
    }

    fn restore(&mut self, saved: &SavedState) -> Result<()> {
        saved.check(METHOD)?;
        let counts = saved.counts("elements")?;
        let intervals = self.model.mesh().elements.iter().map(Vec::len);
        saved.sized("elements", intervals.clone().sum())?;
        let mut counts = counts.into_iter();
        let elements = intervals.map(|size| counts.by_ref().take(size).collect());
        saved.sized("degree", 1)?;
        let mesh = Mesh {
            elements: elements.collect(),
            degree: saved.counts("degree")?[0],
        };
        let [axis] = saved.array("plane")?;
        let freedoms = (0..3)
            .find(|k| axis == f64::from(*k))
            .map_or(Freedoms::Space, |k| Freedoms::Plane(k as usize));
        let [hold] = saved.array("hold")?;
        let model = ElementAssembly::new(&self.given, mesh)?;
        let model = model.with_freedoms(freedoms).with_hold(hold);
        let model = model.with_barrier_strength(self.model.strength());
        let outside = || {
            Error::domain(
                "the strains of the state are outside the law's domain, or of another rod",
            )
        };
        let time = model.time();
        let mut numbers = saved.sized("motion", time)?.to_vec();
        numbers.push(saved.t);
        numbers.extend_from_slice(saved.sized("integrals", INTEGRALS - 1)?);
        let mut y = DVector::from_vec(numbers);
        let [numerical] = saved.array("numerical_loss")?;
        let moment = model.moment(&y).ok_or_else(outside)?;
        let now = ledger(&model, &moment, &y.as_slice()[time..], numerical);
        y[time + 2] += saved.work_of_change(&now)?;
        self.integrator
            .restart(&model, y, None)
            .ok_or_else(outside)?;
        if !model.rods_meet() {
            self.near = nearness(&self.given, &model, &moment);
        }
        let model = model.with_near_rods(&moment, 0.0);
        self.model = Arc::new(model.anchored(&moment));
        self.most_nodes = self.most_nodes.max(self.model.most_nodes());
        let state = self.integrator.state();
        (self.current, _) = self.sampled(state, Some(numerical)).ok_or_else(outside)?;
        self.first = self.current.clone();
        let total = self.current.ledger().total();
        self.energy = total;
        (self.numerical, self.numerical_before) = (numerical, numerical);
        self.total_before = total;
        self.undecided = saved.array::<1>("undecided")?[0] != 0.0;
        (self.gives, self.stopped, self.ended) = (false, false, None);
        Ok(())
    }

    fn renew(&mut self) -> Result<()> {
        let undefined = || Error::domain("the motion is not defined under the new loads");
        let y = self.integrator.state().clone();
        self.integrator
            .restart(&*self.model, y, None)
            .ok_or_else(undefined)?;
        let now = self.sampled(self.integrator.state(), Some(self.numerical));
        (self.current, _) = now.ok_or_else(undefined)?;
        Ok(())
    }

    fn duration(&self) -> f64 {
        self.options.duration
    }

    fn interrupt(&mut self) {
        self.interrupted = true;
    }

    fn cost(&self) -> Cost {
        self.integrator.cost()
    }

    fn carries(&self) -> Vec<StateVariables> {
        let time = self.model.time();
        StateVariables::some([
            (IN_ELEMENTS, time),
            ("time, work, and the parts of the dissipation", INTEGRALS),
        ])
    }

    fn resolution(&self) -> Option<Resolution> {
        Some(Resolution {
            most_nodes: self.most_nodes,
            tail: self.tail,
            rate_tail: None,
        })
    }
}
