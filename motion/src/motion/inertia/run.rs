//! A run of a rod with mass, step by step.

use super::sample::HeavySample;
use crate::creep::grid::{Grid, more};
use crate::creep::kinematics::Local;
use crate::creep::resolution::{Demand, MOST_NODES, Nodes, ROUNDING, demand};
use crate::error::{Cause, Error, Result};
use crate::inertia::frames::Curve;
use crate::inertia::rod::{Given, HeavyRod};
use crate::motion::{Event, Motion, Options, Outcome, Resolution, Seen};
use crate::section::Strain;
use crate::solve::cost::Cost;
use crate::solve::integrator::{Integrator, Method};
use nalgebra::{DVector, Vector6};
use std::sync::Arc;

/// How a rod with mass starts.
pub struct HeavyStart<'a> {
    /// All strains at s in [0, 1].
    pub strain: &'a dyn Fn(f64) -> Strain,
    /// How fast they change.
    pub rate: HeavyRate<'a>,
    /// True: at the stable equilibrium under all loads at the time 0, of which `strain` is near.
    pub settled: bool,
}

/// How fast the strains change at the start.
pub enum HeavyRate<'a> {
    /// At these rates of the strains at s.
    Strain(&'a dyn Fn(f64) -> Strain),
    /// As the rod without mass would follow its end, which moves at this twist (angular first).
    End(Vector6<f64>),
}

/// The last two coefficients of the strain rates may carry this part of them; beyond, the run says so.
pub const SPILL: f64 = 1e-3;
/// A step's local error, as a part of the tolerance: the errors of the steps add up.
const LOCAL: f64 = 0.1;
/// Local errors below this drown in rounding.
const FINEST: f64 = 1e-13;
/// Nodes to begin with.
const FIRST: usize = 8;
/// Steps in a row after which nodes that are not needed are given up.
const PATIENCE: u32 = 40;
/// Tolerances below this leave no room for the errors along the rod.
const LEAST_TOLERANCE: f64 = 1e-13;
/// Coefficients that the nodes leave out change positions and energies by their square: they are held to this times the root of the
/// tolerance.
const ROOT: f64 = 0.1;

/// A run of a rod with mass in progress.
pub struct HeavyRun {
    rod: Arc<HeavyRod>,
    integrator: Integrator,
    options: Options,
    tail: f64,
    spill: f64,
    most_nodes: usize,
    idle: u32,
    /// Nodes that the next step should have.
    wanted: Option<Vec<usize>>,
    first: HeavySample,
    current: HeavySample,
    stopped: bool,
    interrupted: bool,
}

impl HeavyRun {
    /// A run at time 0.
    ///
    /// # Errors
    /// Strains that are not finite or outside the law's domain, or too rough for [`MOST_NODES`]; a velocity that the rod cannot follow;
    /// no equilibrium where one is asked for; a tolerance below 1e-13; symmetric steps.
    pub fn new(given: &Given, start: &HeavyStart<'_>, options: Options) -> Result<Self> {
        if !(options.tolerance >= LEAST_TOLERANCE) {
            return Err(Error::domain(format!(
                "tolerance = {} must lie in [1e-13, 1e-2] for a rod with mass",
                options.tolerance
            )));
        }
        if options.method == Method::Symmetric {
            return Err(Error::domain(
                "method: symmetric steps follow elastic rods without mass; let the program choose (auto), or ask for explicit or \
                 implicit steps",
            ));
        }
        let mut counts = match options.nodes {
            Nodes::Adaptive => vec![FIRST; given.breaks().len() + 1],
            Nodes::Fixed(nodes) => vec![nodes; given.breaks().len() + 1],
        };
        let (rod, q, w) = loop {
            let (rod, q, w) = begun(given, start, &counts)?;
            let (strains, rates) = (rod.strains(&q), rod.rates(&w));
            let shape = rod.sections.shape(&strains);
            let defect = shape.map_or(f64::INFINITY, |shape| shape.defect);
            match judged(&rod, (&strains, &rates), defect, &options).1 {
                Demand::More(more) if options.nodes == Nodes::Adaptive => {
                    if more.iter().any(|n| *n > MOST_NODES) {
                        return Err(Error::domain(format!(
                            "the strains at the start are too rough for {MOST_NODES} nodes on an element; give smoother strains, or a \
                             larger tolerance"
                        )));
                    }
                    counts = more;
                }
                _ => break (rod, q, w),
            }
        };
        let rod = Arc::new(rod);
        let mut y = rod.state(&q, &w);
        let outside = || {
            Error::domain(
                "the strains at the start are outside the law's domain, or too large for a shape of the rod",
            )
        };
        let at = rod.at(&y).ok_or_else(outside)?;
        let second = rod.accelerations(0.0, &at).ok_or_else(outside)?;
        let first = HeavySample::new(&rod, &y, second.as_slice()).ok_or_else(outside)?;
        y.rows_mut(rod.time() + 4, rod.size()).copy_from(&second);
        let tolerance = (LOCAL * options.tolerance).max(FINEST);
        let integrator = Integrator::new(&*rod, y, tolerance, options.method, None)
            .ok_or_else(|| Error::domain("the motion is not defined at the start"))?;
        Ok(Self {
            most_nodes: rod.sections.grid.len(),
            rod,
            integrator,
            options,
            tail: 0.0,
            spill: 0.0,
            idle: 0,
            wanted: None,
            current: first.clone(),
            first,
            stopped: false,
            interrupted: false,
        })
    }

    fn time(&self) -> f64 {
        self.integrator.state()[self.rod.time()]
    }

    /// The state of an implicit step has its second derivatives; that of an explicit one does not.
    fn sample_of(&self, y: &DVector<f64>) -> Option<HeavySample> {
        match self.integrator.method_now() {
            Method::Implicit => {
                let second = &y.as_slice()[self.rod.time() + 4..];
                HeavySample::new(&self.rod, y, second)
            }
            _ => {
                let at = self.rod.at(y)?;
                let second = self.rod.accelerations(y[self.rod.time()], &at)?;
                HeavySample::new(&self.rod, y, second.as_slice())
            }
        }
    }

    fn stop(&mut self, outcome: Outcome) -> Event {
        self.stopped = true;
        Event::Stop(outcome)
    }

    fn stuck(&mut self, cause: Cause, remedy: &str) -> Event {
        let outcome = Outcome::stuck(self.time(), cause, remedy);
        self.stop(outcome)
    }

    /// Judges the nodes after a step; what it finds is done before the next one.
    fn judge(&mut self) -> std::result::Result<(), Cause> {
        let fields = (
            self.current.strains.as_slice(),
            self.current.rates.as_slice(),
        );
        let ([tail, spill], demand) = judged(&self.rod, fields, self.current.defect, &self.options);
        self.tail = self.tail.max(tail);
        // Nodes that are about to be added hold the next states.
        let growing = self.options.nodes == Nodes::Adaptive && matches!(demand, Demand::More(_));
        if !growing {
            self.spill = self.spill.max(spill);
        }
        if self.options.nodes != Nodes::Adaptive {
            return Ok(());
        }
        match demand {
            Demand::More(counts) => {
                self.idle = 0;
                if counts.iter().any(|n| *n > MOST_NODES) {
                    return Err(Cause::Unresolved {
                        most: MOST_NODES,
                        tail,
                    });
                }
                self.wanted = Some(counts);
            }
            Demand::Fewer(counts) => {
                self.idle += 1;
                if self.idle >= PATIENCE {
                    self.idle = 0;
                    self.wanted = Some(counts);
                }
            }
            Demand::Enough => self.idle = 0,
        }
        Ok(())
    }

    /// Carries the state over to a grid with so many nodes on the elements.
    fn regrid(&mut self, counts: &[usize]) -> Option<()> {
        let y = self.integrator.state();
        let at = self.rod.at(y)?;
        let old = &self.rod.sections.grid;
        let grid = Grid::new(&old.breaks(), counts);
        let [strains, rates] = [&at.strains, &at.rates].map(|field| old.carried(field, &grid));
        let next = HeavyRod::new(self.rod.given.clone(), grid).ok()?;
        let mut state = next.state(&next.coordinates(&strains), &next.coordinates(&rates));
        let (from, to) = (self.rod.time(), next.time());
        state.rows_mut(to, 4).copy_from(&y.rows(from, 4));
        self.most_nodes = self.most_nodes.max(next.sections.grid.len());
        self.rod = Arc::new(next);
        self.integrator.restart(&*self.rod, state, None)
    }

    fn go_on(&mut self) -> Event {
        if self.interrupted {
            return self.stop(Outcome::Interrupted);
        }
        let from = self.time();
        let left = self.options.duration - from;
        if !(left > 1e-14 * self.options.duration) {
            return self.stop(Outcome::EndOfTime);
        }
        if self.integrator.cost().steps >= self.options.max_steps {
            return self.stop(Outcome::StepLimit);
        }
        let wanted = self.wanted.take();
        if wanted.is_some_and(|counts| self.regrid(&counts).is_none()) {
            return self.stuck(Cause::EdgeOfDomain, "change the loads, or the section");
        }
        let past = from + 1e-14 * self.options.duration;
        let left = left.min(self.rod.next_break(past) - from);
        if self.integrator.step(&*self.rod, left).is_err() {
            let cause = Cause::StepCollapsed {
                next: self.integrator.next_step(),
                tolerance: self.options.tolerance,
            };
            return self.stuck(
                cause,
                "the motion is rougher than rounding lets it be followed: raise the tolerance, give the rod damping, or fewer nodes \
                 (rod.nodes)",
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
                "waves in the rod have become too short: give it damping, which they meet first, raise the tolerance, or fix rod.nodes",
            );
        }
        Event::Step { from, to }
    }
}

impl<'a> Motion<'a> for HeavyRun {
    fn advance(&mut self) -> Option<Event> {
        (!self.stopped).then(|| self.go_on())
    }

    fn given(&self) -> Seen<'_> {
        Seen::Kept(&self.first)
    }

    fn now(&self) -> Seen<'_> {
        Seen::Kept(&self.current)
    }

    fn sample(&mut self, t: f64) -> Option<Seen<'_>> {
        let to = self.time();
        if t == to {
            return Some(Seen::Made(Box::new(self.current.clone())));
        }
        let fraction = 1.0 - (to - t) / self.integrator.span();
        if !((0.0..=1.0).contains(&fraction)) {
            return None;
        }
        let y = self.integrator.at(&*self.rod, fraction)?;
        let mut sample = self.sample_of(&y)?;
        sample.t = t;
        Some(Seen::Made(Box::new(sample)))
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

    fn resolution(&self) -> Option<Resolution> {
        Some(Resolution {
            most_nodes: self.most_nodes,
            tail: self.tail,
            rate_tail: Some(self.spill),
        })
    }
}

/// The rod at so many nodes, its coordinates and their rates at the start.
fn begun(
    given: &Given,
    start: &HeavyStart<'_>,
    counts: &[usize],
) -> Result<(HeavyRod, Vec<f64>, Vec<f64>)> {
    let grid = Grid::new(&given.breaks(), counts);
    let places = grid.nodes().to_vec();
    let rod = HeavyRod::new(given.clone(), grid)?;
    let field =
        |f: &dyn Fn(f64) -> Strain| -> Vec<Strain> { places.iter().map(|s| f(*s)).collect() };
    let strains = field(start.strain);
    if !strains.iter().all(|e| e.iter().all(|x| x.is_finite())) {
        return Err(Error::domain("the strains at the start must be finite"));
    }
    let mut q = rod.coordinates(&strains);
    if start.settled {
        q = rod.settled(0.0, &q)?;
    }
    let w = match &start.rate {
        HeavyRate::Strain(rate) => rod.coordinates(&field(*rate)),
        HeavyRate::End(twist) if *twist == Vector6::zeros() => vec![0.0; rod.size()],
        HeavyRate::End(twist) => {
            let still = vec![0.0; rod.size()];
            let at = rod.moving(&q, &still).ok_or_else(|| {
                Error::domain("the strains at the start are too large for a shape of the rod")
            })?;
            rod.following(&at, twist)?
        }
    };
    if !w.iter().all(|x| x.is_finite()) {
        return Err(Error::domain(
            "the rates of the strains at the start must be finite",
        ));
    }
    Ok((rod, q, w))
}

/// The last coefficients of strains and of rates, relative to 1 + their size, and what they ask for.
fn judged(
    rod: &HeavyRod,
    (strains, rates): (&[Strain], &[Strain]),
    defect: f64,
    options: &Options,
) -> ([f64; 2], Demand) {
    let grid = &rod.sections.grid;
    let bound = (ROOT * options.tolerance.sqrt()).max(options.tolerance);
    let fields: [&[Local<6>]; 2] = [strains, rates];
    let (tail, _) = demand(grid, &fields[..1], bound);
    let (spill, _) = demand(grid, &fields[1..], bound);
    // Rates of waves that pass are rougher than the strains, and enter by less.
    let (_, of_rates) = demand(grid, &fields[1..], 10.0 * bound);
    let (_, of_strains) = demand(grid, &fields[..1], bound);
    let blurred = match rod.given.curve {
        Curve::Plane => bound,
        Curve::Space => options.tolerance,
    };
    let demand = match (of_strains, of_rates) {
        (Demand::More(a), Demand::More(b)) => {
            Demand::More(a.iter().zip(&b).map(|(a, b)| *a.max(b)).collect())
        }
        (Demand::More(a), _) | (_, Demand::More(a)) => Demand::More(a),
        _ if defect > blurred.max(ROUNDING) => {
            Demand::More(grid.counts().into_iter().map(more).collect())
        }
        (Demand::Fewer(a), Demand::Fewer(b)) => {
            Demand::Fewer(a.iter().zip(&b).map(|(a, b)| *a.max(b)).collect())
        }
        _ => Demand::Enough,
    };
    ([tail, spill], demand)
}
