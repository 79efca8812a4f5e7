//! Runs of rods with mass, step by step.

use super::resolution::NodeResolution;
use super::sample::HeavySample;
use super::start::{HeavyStart, split};
use super::touch::{RodsInStep, crossing, first_contact};
use crate::adaptive_nodes::AdaptiveNodes;
use crate::groove_turning_points::{ON_END, turning_fraction};
use crate::saved_state::{SavedState, outside_step};
use crate::{Event, Motion, Options, Outcome, Resolution, State, StateRef, StateVariables};
use nalgebra::DVector;
use snaprod_systems::assembly::{Body, Contact, Nearness};
use snaprod_systems::error::{Cause, Error, Result};
use snaprod_systems::full_mass::assembly::{HeavyAssembly, INTEGRALS};
use snaprod_systems::solve::cost::Cost;
use snaprod_systems::solve::integrator::{Integrator, Method};
use snaprod_systems::solve::system::System;
use snaprod_systems::viscoelastic::resolution::{Demand, MOST_NODES, Nodes};
use std::sync::Arc;

/// Largest share of the last two coefficients in the strain rates; beyond it the run reports the rates as unresolved.
pub const SPILL: f64 = 1e-3;
/// Smallest local tolerance of rods with mass: below it errors drown in rounding.
const FINEST: f64 = 1e-13;
/// Initial number of nodes per element.
const FIRST: usize = 8;
/// Ratio of coefficients to their bound at which a step is taken again with more nodes: errors made by too
/// few nodes persist in the state.
const FAR: f64 = 10.0;
/// Number of steps in a row after which unneeded nodes are given up.
const PATIENCE: u32 = 40;
/// Largest drift of rod ends from the attachments, in tolerances, that is left uncorrected.
const DRIFTED: f64 = 0.1;
/// Method of saved states.
const METHOD: &str = "rods with mass by strains at Gauss nodes";

/// A run of rods with mass in progress.
pub struct HeavyRun {
    model: Arc<HeavyAssembly>,
    integrator: Integrator,
    options: Options,
    tails: [f64; 2],
    nodes: AdaptiveNodes,
    first: HeavySample,
    current: HeavySample,
    /// Distances between rods with a contact diameter.
    near: Option<Nearness>,
    /// Reason for an end of the run with the last step.
    ended: Option<Outcome>,
    /// Why this run stands in place of one in elements.
    no_elements: Option<String>,
    stopped: bool,
    interrupted: bool,
}

impl HeavyRun {
    /// A run at time 0; the nodes of `given` are replaced.
    ///
    /// # Errors
    /// Strains that are not finite or outside the law's domain, or too rough for [`MOST_NODES`]; a velocity
    /// that a rod cannot follow; a failed search for the equilibrium of a settled start; ends of rods off their
    /// attachments, bodies off their grooves; a tolerance below 1e-13; symmetric steps.
    pub fn new(given: &HeavyAssembly, start: &HeavyStart<'_>, options: Options) -> Result<Self> {
        Body::start_in_grooves(&given.carriers, &start.bodies)?;
        options.suits_strains("rod with mass")?;
        if options.method == Method::Symmetric {
            return Err(Error::domain(
                "method: symmetric steps follow elastic rods without mass; let the program choose (auto), or ask for explicit or \
                 implicit steps",
            ));
        }
        let mut links = given.links.iter();
        if links.any(|link| link.rod.given.has_point_loads()) {
            return Err(Error::domain(
                "a load at one place of a rod with mass needs elements: leave out rod.nodes, method and Maxwell branches, and give a run.tolerance of \
                 1e-5 or more; or write a short part of the rod, from and to, with the load per length",
            ));
        }
        let (model, mut y, nodes) = resolved_start(given, start, &options)?;
        let model = Arc::new(model);
        System::settle(&*model, &mut y).ok_or_else(|| {
            Error::domain(
                "the accelerations at the start do not follow from the loads: the strains are outside the law's domain, or the rods hold \
                 each other in more ways than they can deform (straight inextensible rods that close a loop)",
            )
        })?;
        let current = model.at(&y);
        let current = current.and_then(|at| HeavySample::new(&model, &y, at, model.second(&y)));
        let current = current.ok_or_else(outside_domain)?;
        let near = nearness(&model, &y);
        let touching = near.as_ref().and_then(|near| near.contact);
        if let Some(contact) = touching.filter(|contact| contact.gap < 0.0) {
            return Err(contact.at_start(|rod| model.rod_name(rod)));
        }
        let tolerance = options.local_tolerance().max(FINEST);
        let first_step = start.step_from_rest(&current.ledger(), &options);
        let mut integrator = Integrator::new(&*model, y, tolerance, options.method, first_step)
            .ok_or_else(|| Error::domain("the motion is not defined at the start"))?;
        if first_step.is_some() {
            // Explicit steps would follow the rounding of the slopes.
            integrator.switch_to_implicit(&*model);
        }
        // Factors are dense, and every sample computes some of its own.
        integrator.keep_order();
        Ok(Self {
            nodes: AdaptiveNodes::new(options.nodes, PATIENCE, nodes),
            model,
            integrator,
            options,
            tails: [0.0; 2],
            first: current.clone(),
            current,
            near,
            ended: None,
            no_elements: None,
            stopped: false,
            interrupted: false,
        })
    }

    /// This run, in place of one in elements, for a reason.
    pub(super) fn without_elements(mut self, why: String) -> Self {
        self.no_elements = Some(why);
        self
    }

    fn time(&self) -> f64 {
        self.integrator.state()[self.model.time()]
    }

    /// The sample of a state vector, which contains second derivatives only after an implicit step.
    fn sample_of(&self, y: &DVector<f64>) -> Option<HeavySample> {
        let at = self.model.at(y)?;
        if self.integrator.method_now() == Method::Implicit {
            return HeavySample::new(&self.model, y, at, self.model.second(y));
        }
        let unknowns = self.model.accelerations(&at)?;
        HeavySample::new(&self.model, y, at, unknowns.as_slice())
    }

    fn stop(&mut self, outcome: Outcome) -> Event {
        self.stopped = true;
        Event::Stop(outcome)
    }

    fn stuck(&mut self, cause: Cause, remedy: &str) -> Event {
        let outcome = Outcome::stuck(self.time(), cause, remedy);
        self.stop(outcome)
    }

    /// Judges the nodes after a step.
    fn judge(&mut self) -> std::result::Result<(), Cause> {
        let judged = NodeResolution::new(&self.model, self.integrator.state(), &self.options);
        let Some(judged) = judged else {
            return Err(Cause::EdgeOfDomain);
        };
        let ([tail, spill], demand) = (judged.tails, judged.demand);
        self.tails[0] = self.tails[0].max(tail);
        // Nodes about to be added resolve the next states.
        if !self.nodes.grows(&demand) {
            self.tails[1] = self.tails[1].max(spill);
        }
        self.nodes.register_demand(demand, tail)
    }

    /// Node counts for another try of the last step; None if the present nodes suffice.
    fn unresolved(&self) -> Option<Vec<usize>> {
        if self.options.nodes != Nodes::Adaptive {
            return None;
        }
        let judged = NodeResolution::new(&self.model, self.integrator.state(), &self.options)?;
        match judged.demand {
            Demand::More(counts) if judged.excess > FAR => {
                Some(counts).filter(|counts| counts.iter().all(|n| *n <= MOST_NODES))
            }
            _ => None,
        }
    }

    /// Takes a step no longer than `left`, with as many nodes as it needs. False if the step size collapses, or the
    /// motion cannot continue on other nodes.
    fn step(&mut self, left: f64) -> bool {
        while self.integrator.step(&*self.model, left).is_ok() {
            let Some(counts) = self.unresolved() else {
                return true;
            };
            let from = self.integrator.from().clone();
            if self.regrid(&from, &counts).is_none() {
                return false;
            }
        }
        false
    }

    /// Continues from a state on a grid with these node counts on the elements.
    fn regrid(&mut self, from: &DVector<f64>, counts: &[usize]) -> Option<()> {
        let model = self.model.with_nodes(&split(&self.model, counts)).ok()?;
        let state = model.closed(&model.carried(&self.model, from)?).ok()?;
        self.integrator.restart(&model, state, None)?;
        self.model = Arc::new(model);
        let nodes = NodeResolution::new(&self.model, self.integrator.state(), &self.options)?.nodes;
        self.nodes.record_total(nodes);
        Some(())
    }

    /// Brings the ends of rods back to their attachments after a drift by integration errors.
    fn hold(&mut self) -> Option<()> {
        if self.model.multipliers() == 0 {
            return Some(());
        }
        let y = self.integrator.state();
        let [gap, leaving] = self.model.gap(&self.model.at(y)?);
        if gap.max(leaving) <= DRIFTED * self.options.tolerance {
            return Some(());
        }
        match self.model.closed(y) {
            Ok(state) => self.integrator.restart(&*self.model, state, None),
            Err(_) => Some(()),
        }
    }

    fn go_on(&mut self) -> Event {
        if self.interrupted {
            return self.stop(Outcome::Interrupted);
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
        let here = self.integrator.state().clone();
        let wanted = self.nodes.wanted();
        if wanted.is_some_and(|counts| self.regrid(&here, &counts).is_none()) {
            let why = Error::no_convergence("the strains could not be carried to other nodes");
            return self.stuck(
                Cause::Failed(why),
                "leave run.tolerance out, or raise it to 1e-5 or more; or give the rod damping",
            );
        }
        let past = from + 1e-14 * self.options.duration;
        let left = left.min(self.model.next_break(past) - from);
        if self.hold().is_none() {
            return self.stuck(Cause::EdgeOfDomain, "change the loads, or the section");
        }
        if !self.step(left) {
            let cause = Cause::StepCollapsed {
                next: self.integrator.next_step(),
                tolerance: self.options.tolerance,
            };
            return self.stuck(
                cause,
                "the motion is too rough for double precision: raise the tolerance, give the rod damping, or fewer nodes \
                 (rod.nodes)",
            );
        }
        if self.look().is_none() {
            return self.stuck(
                Cause::EdgeOfDomain,
                "the end of a groove, or a contact, was not located: lower the tolerance",
            );
        }
        let to = self.time();
        match self.sample_of(self.integrator.state()) {
            Some(current) => self.current = current,
            None => return self.stuck(Cause::EdgeOfDomain, "change the loads, or the section"),
        }
        if let Err(cause) = self.judge() {
            return self.stuck(
                cause,
                "waves in the rod have become too short: give the rod damping, which damps the shortest waves first, raise the tolerance, or fix rod.nodes",
            );
        }
        Event::Step { from, to }
    }
}

impl HeavyRun {
    /// Shortens the step to its first event: a body at the end of its groove, or a contact of rods. None if
    /// an event cannot be located.
    fn look(&mut self) -> Option<()> {
        let [from, to] = [self.integrator.from(), self.integrator.state()].map(DVector::clone);
        if let Some((part, body)) = self.leaves_groove(&from, &to)? {
            self.end_at(&from, part, Outcome::GrooveEnd(body))?;
        }
        let Some(after) = nearness(&self.model, self.integrator.state()) else {
            return Some(());
        };
        let before = self.near.replace(after.clone()).unwrap_or_default();
        if let Some((contact, part)) = first_contact(self, &before, &after)? {
            self.end_at(&from, part, Outcome::SelfContact(contact))?;
            let there = self.contact_near(self.integrator.state(), &contact);
            if let Some(Outcome::SelfContact(contact)) = &mut self.ended {
                *contact = there.unwrap_or(*contact);
            }
        }
        Some(())
    }

    /// First body that reaches the end of its groove in the step, with the fraction of the step: `Some(None)`
    /// if no body does, None if it cannot be located.
    fn leaves_groove(
        &mut self,
        from: &DVector<f64>,
        to: &DVector<f64>,
    ) -> Option<Option<(f64, usize)>> {
        let [before, after] = [from, to].map(|y| self.model.along_grooves(y));
        if before.is_empty() {
            return Some(None);
        }
        let span = self.integrator.span();
        let (model, integrator) = (&*self.model, &mut self.integrator);
        let turns = before.iter().zip(&after).enumerate();
        let turns = turns.filter_map(|(k, (from, to))| {
            turning_fraction([from.1, to.1], span, from.2, |x| {
                let y = integrator.at(&*model, x)?;
                Some(model.along_grooves(&y)[k].1)
            })
        });
        // Bodies past an end before the first body turns back are still beyond their end at that moment.
        let part = turns.fold(1.0, f64::min);
        let there = self.integrator.at(&*self.model, part)?;
        let mut first: Option<(f64, usize)> = None;
        for (k, (body, [phi, _], [start, last])) in
            self.model.along_grooves(&there).into_iter().enumerate()
        {
            // A body may rest on the end itself.
            let rounding = ON_END * (last - start);
            let end = phi.clamp(start, last);
            if (phi - end).abs() <= rounding {
                continue;
            }
            let beyond =
                |run: &Self, y: &DVector<f64>| Some(run.model.along_grooves(y)[k].1[0] - end);
            let part = crossing(self, part, rounding, &beyond)?;
            if first.is_none_or(|(least, _)| part < least) {
                first = Some((part, body));
            }
        }
        Some(first)
    }

    /// Ends the step after the fraction `part`.
    fn end_at(&mut self, from: &DVector<f64>, part: f64, outcome: Outcome) -> Option<()> {
        // The step is taken again, so that samples lie inside. If it comes out shorter, the next step leads
        // to the event.
        let h = part * self.integrator.span();
        let system = &*self.model;
        self.integrator.restart(system, from.clone(), Some(h))?;
        self.integrator.step(system, h).ok()?;
        let whole = self.integrator.span() >= h * (1.0 - 1e-9);
        self.ended = Some(outcome).filter(|_| whole);
        Some(())
    }
}

/// The error of strains without a shape.
fn outside_domain() -> Error {
    Error::domain(
        "the strains at the start are outside the law's domain, or too large for a shape of the rod",
    )
}

/// The rods at the nodes that the start needs, its state, and the number of nodes of the rod that has most.
///
/// # Errors
/// As [`HeavyRun::new`].
pub(super) fn resolved_start(
    given: &HeavyAssembly,
    start: &HeavyStart<'_>,
    options: &Options,
) -> Result<(HeavyAssembly, DVector<f64>, usize)> {
    let rods = given.links.iter();
    let elements = rods.map(|link| link.rod.given.breaks().len() + 1).sum();
    let mut counts = match options.nodes {
        Nodes::Adaptive => vec![FIRST; elements],
        Nodes::Fixed(nodes) => vec![nodes; elements],
    };
    loop {
        let (model, y) = start.at_nodes(given, &counts)?;
        let judged = NodeResolution::new(&model, &y, options).ok_or_else(outside_domain)?;
        match judged.demand {
            Demand::More(more) if options.nodes == Nodes::Adaptive => {
                if more.iter().any(|n| *n > MOST_NODES) {
                    return Err(Error::domain(format!(
                        "the strains at the start are too rough for {MOST_NODES} nodes on an element; give smoother strains, or a \
                         larger tolerance"
                    )));
                }
                counts = more;
            }
            _ => return Ok((model, y, judged.nodes)),
        }
    }
}

/// Distances of rods with a contact diameter to themselves and to each other; None without such rods.
fn nearness(model: &HeavyAssembly, y: &DVector<f64>) -> Option<Nearness> {
    let at = model.at(y)?;
    let tubes = model.tubes(&at);
    (!tubes.is_empty()).then(|| Nearness::of(&tubes))
}

impl RodsInStep for HeavyRun {
    fn inside(&mut self, part: f64) -> Option<DVector<f64>> {
        self.integrator.at(&*self.model, part)
    }

    fn nearness(&self, y: &DVector<f64>) -> Option<Nearness> {
        nearness(&self.model, y)
    }

    fn contact_near(&self, y: &DVector<f64>, near: &Contact) -> Option<Contact> {
        near.now(&self.model.tubes(&self.model.at(y)?))
    }

    fn relative_span(&self) -> f64 {
        self.integrator.span() / self.options.duration
    }
}

impl<'a> Motion<'a> for HeavyRun {
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
        let fraction = self.integrator.fraction(self.model.time(), t)?;
        let mut y = self.integrator.at(&*self.model, fraction)?;
        y[self.model.time()] = t;
        Some(StateRef::Made(Box::new(self.sample_of(&y)?)))
    }

    fn save(&mut self, t: f64) -> Result<SavedState> {
        let (y, ledger) = if t == self.time() {
            (self.integrator.state().clone(), self.current.ledger())
        } else {
            let inside = |run: &mut Self| {
                let fraction = run.integrator.fraction(run.model.time(), t)?;
                let y = run.integrator.at(&*run.model, fraction)?;
                let ledger = run.sample_of(&y)?.ledger();
                Some((y, ledger))
            };
            inside(self).ok_or_else(|| outside_step(t))?
        };
        let rods = self.model.links.iter();
        let counts = rods.flat_map(|link| link.rod.sections.grid.counts());
        let (time, y) = (self.model.time(), y.as_slice());
        Ok(SavedState::new(METHOD, t, &ledger)
            .with("nodes", counts.map(|n| n as f64))
            .with("motion", y[..time].to_vec())
            .with("integrals", y[time + 1..time + INTEGRALS].to_vec()))
    }

    fn restore(&mut self, saved: &SavedState) -> Result<()> {
        saved.check(METHOD)?;
        let counts = saved.counts("nodes")?;
        let rods = self.model.links.iter();
        let elements = rods.map(|link| link.rod.given.breaks().len() + 1).sum();
        saved.sized("nodes", elements)?;
        let model = Arc::new(self.model.with_nodes(&split(&self.model, &counts))?);
        let time = model.time();
        let mut numbers = saved.sized("motion", time)?.to_vec();
        numbers.push(saved.t);
        numbers.extend_from_slice(saved.sized("integrals", INTEGRALS - 1)?);
        numbers.resize(time + INTEGRALS + model.unknowns(), 0.0);
        let mut y = DVector::from_vec(numbers);
        let at = model.at(&y).ok_or_else(outside_domain)?;
        System::settle(&*model, &mut y).ok_or_else(outside_domain)?;
        let now = HeavySample::new(&model, &y, at, model.second(&y)).ok_or_else(outside_domain)?;
        y[time + 2] += saved.work_of_change(&now.ledger())?;
        self.integrator
            .restart(&*model, y, None)
            .ok_or_else(outside_domain)?;
        self.near = nearness(&model, self.integrator.state());
        self.model = model;
        self.current = self
            .sample_of(self.integrator.state())
            .ok_or_else(outside_domain)?;
        self.first = self.current.clone();
        self.nodes.record_total(counts.iter().sum());
        (self.ended, self.stopped) = (None, false);
        Ok(())
    }

    fn renew(&mut self) -> Result<()> {
        let y = self.integrator.state().clone();
        self.integrator
            .restart(&*self.model, y, None)
            .ok_or_else(|| Error::domain("the motion is not defined under the new loads"))?;
        self.current = self
            .sample_of(self.integrator.state())
            .ok_or_else(outside_domain)?;
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
        let y = self.integrator.state();
        let strains: usize = self.model.links.iter().map(|link| link.rod.size()).sum();
        let time = self.model.time();
        StateVariables::some([
            ("strains at the nodes", strains),
            ("rates of the strains", strains),
            (
                "bodies and dashpots: places, velocities, strains",
                time - 2 * strains,
            ),
            ("time, work, dissipation and loss to drag", INTEGRALS),
            (
                "accelerations and forces, which implicit steps find",
                y.len() - time - INTEGRALS,
            ),
        ])
    }

    fn resolution(&self) -> Option<Resolution> {
        Some(Resolution {
            most_nodes: self.nodes.most(),
            tail: self.tails[0],
            rate_tail: Some(self.tails[1]),
        })
    }

    fn why_no_elements(&self) -> Option<&str> {
        self.no_elements.as_deref()
    }
}
