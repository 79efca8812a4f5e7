//! The motion of bodies on elastic rods in space: AMV (4.7)-(4.9), several rods and bodies, through folds (theory 3.3).
//!
//! Away from folds time is what the steps advance in. A rod that nears its fold slows it (see [`crate::assembly::Slowed`]): the
//! fold is then an ordinary root of t', found to the accuracy of the integration. There that rod settles with its ends held,
//! and the others stay as they are.

mod sample;

pub use sample::AssemblySample;

use super::drive::Motion;
use super::event::{Event, Outcome};
use super::locate::{Guess, Timed, first_fold, locate};
use super::options::Options;
use super::snap::{LandingRule, Snap, SnapEnd};
use super::state::Seen;
use crate::assembly::{Assembly, Configuration, Evaluated, Integrals, Slowed};
use crate::error::{Cause, Error, Result};
use crate::solve::cost::Cost;
use crate::solve::dop853::{Dense, Dop853, State, Step};
use crate::solve::roots::chandrupatla;
use nalgebra::{DVector, Vector6};
use std::sync::Arc;

/// Bound of a step's local error, as a part of the tolerance.
const LOCAL: f64 = 0.1;
/// Local errors below this drown in rounding.
const FINEST: f64 = 1e-14;
/// Error of the integration along a rod, as a part of that of a step: slopes must be smooth to it.
const ALONG: f64 = 0.1;
/// Time is slowed for a rod whose det J would vanish, at its present rate, within so many steps ...
const NEAR: f64 = 8.0;
/// ... until det J has grown to so many times what it was then.
const FAR: f64 = 4.0;
/// A state this near to the end of time, relative to 1 + its size, is at it.
const ON_TIME: f64 = 1e-12;
/// Ends of rods that are farther than this many tolerances from their attachments at the start are no start.
const APART: f64 = 1e4;
/// Charts are brought back to the poses of the bodies when their ends have drifted off by so many local tolerances ...
const DRIFTED: f64 = 3.0;
/// ... and a rod whose end cannot be held within so many tolerances is too taut for its base wrench.
const LOOSE: f64 = 1e3;

/// The numbers of a state; time stands third from the last.
#[derive(Debug, Clone)]
struct Numbers(DVector<f64>);

impl State for Numbers {
    fn axpy(&mut self, a: f64, x: &Self) {
        State::axpy(&mut self.0, a, &x.0);
    }

    fn mean_square(&self, from: &Self, to: &Self) -> f64 {
        self.0.mean_square(&from.0, &to.0)
    }
}

impl Timed for Numbers {
    fn time(&self) -> f64 {
        self.0[self.0.len() - 3]
    }
}

impl Numbers {
    fn at_time(mut self, t: f64) -> Self {
        let slot = self.0.len() - 3;
        self.0[slot] = t;
        self
    }
}

/// What is watched of a rod while it moves.
#[derive(Debug, Clone, Copy, Default)]
struct Watch {
    /// det J: 0 at a fold.
    det: f64,
    /// Distance of its end from its attachment.
    gap: f64,
}

/// How a step ended.
enum Progress {
    Moved,
    Arrived,
    Fold { link: usize, time_error: f64 },
}

/// A motion of an assembly in progress.
pub struct AssemblyRun {
    assembly: Arc<Assembly>,
    options: Options,
    solver: Dop853<Numbers>,
    step: Step<Numbers>,
    dense: Option<Dense<Numbers>>,
    slowed: Option<Slowed>,
    /// The rods at the present state.
    watch: Vec<Watch>,
    /// The index of every rod with its ends held, on the sheet it moves on.
    indices: Vec<usize>,
    /// Cost outside the steps.
    extra: Cost,
    released: f64,
    snaps: u64,
    /// The rod that has reached its fold.
    pending: Option<(usize, f64)>,
    first: AssemblySample,
    before_snap: Option<AssemblySample>,
    stopped: bool,
    interrupted: bool,
}

impl AssemblyRun {
    /// A run from `start` at time 0. Poses and charts must agree.
    ///
    /// # Errors
    /// Rods whose ends are not where their attachments are, or that stand at a fold; a landing rule that is not served.
    pub fn new(assembly: Assembly, start: &Configuration, options: Options) -> Result<Self> {
        if options.landing != LandingRule::Viscous {
            return Err(Error::domain(
                "landing: in space a rod lands where friction takes it; use landing = \"viscous\"",
            ));
        }
        let assembly = Arc::new(assembly);
        let local = (LOCAL * options.tolerance).max(FINEST);
        let along = (ALONG * local).max(FINEST);
        let state = assembly.state(start, &Integrals::default());
        let at = assembly.evaluated(&state, along).ok_or_else(|| {
            Error::domain("the rods cannot be followed under the wrenches of the start")
        })?;
        let apart = assembly.drift(&at);
        if !(apart <= APART * options.tolerance) {
            return Err(Error::domain(format!(
                "the ends of the rods are {apart:.1e} of their length away from their attachments at the start"
            )));
        }
        let links = assembly.links().len();
        let numbers = Numbers(state);
        let mut slope = numbers.clone();
        let mut watch = vec![Watch::default(); links];
        assembly
            .write_slope(&numbers.0, None, along, &mut slope.0, |k, det, gap| watch[k] = Watch { det, gap })
            .ok_or_else(|| {
                Error::ill_conditioned(
                    "a rod stands exactly at a fold at the start, as a straight rod that cannot stretch does; let it stretch (an axial \
                     stiffness), start it bent (an equilibrium under a load, settled = true), or give it friction (damping)",
                )
            })?;
        let rate = slope.mean_square(&numbers, &numbers).sqrt();
        let h = 0.3 * options.tolerance.powf(0.125) / rate.max(0.1);
        let indices = indices(&assembly, &at.now, along)?;
        let first = AssemblySample::new(assembly.clone(), at, 0.0, &indices);
        let solver = Dop853::new(numbers, slope, h, local);
        Ok(Self {
            step: solver.blank(),
            solver,
            assembly,
            options,
            dense: None,
            slowed: None,
            watch,
            indices,
            extra: Cost::default(),
            released: 0.0,
            snaps: 0,
            pending: None,
            first,
            before_snap: None,
            stopped: false,
            interrupted: false,
        })
    }

    fn local(&self) -> f64 {
        (LOCAL * self.options.tolerance).max(FINEST)
    }

    /// Error of the integration along the rods.
    fn along(&self) -> f64 {
        (ALONG * self.local()).max(FINEST)
    }

    fn describe(&self, state: &DVector<f64>) -> AssemblySample {
        let at = self
            .assembly
            .evaluated(state, self.along())
            .expect("every state of a run has its rods");
        AssemblySample::new(self.assembly.clone(), at, self.released, &self.indices)
    }

    /// The state at a time within the last step; None outside it.
    pub fn state_at(&mut self, t: f64) -> Option<AssemblySample> {
        let state = self.inside(t)?;
        Some(self.describe(&state))
    }

    /// The state now.
    pub fn sample_now(&self) -> AssemblySample {
        self.describe(&self.solver.state().0)
    }

    /// Goes on from `state` with the clock `slowed`, steps of the length `h` to begin with.
    fn resume(&mut self, state: Numbers, slowed: Option<Slowed>, h: f64) -> Option<()> {
        let along = self.along();
        let mut slope = state.clone();
        let watch = &mut self.watch;
        self.assembly
            .write_slope(&state.0, slowed, along, &mut slope.0, |k, det, gap| {
                watch[k] = Watch { det, gap }
            })?;
        self.extra.evaluations += 1;
        self.slowed = slowed;
        self.solver.restart(state, slope, h);
        Some(())
    }

    /// Slows time for rod `link`.
    fn slow(&mut self, state: Numbers, link: usize, scale: f64) -> Option<()> {
        let h = self.solver.next_step();
        self.resume(state, Some(Slowed { link, scale }), h)
    }

    fn take_step(&mut self, h_max: f64) -> Option<()> {
        let (assembly, along, slowed) = (&self.assembly, self.along(), self.slowed);
        let watch = &mut self.watch;
        let f = |y: &Numbers, out: &mut Numbers| {
            assembly.write_slope(&y.0, slowed, along, &mut out.0, |k, det, gap| {
                watch[k] = Watch { det, gap }
            })
        };
        self.dense = None;
        self.solver.step_into(f, h_max, &mut self.step).ok()
    }

    /// One step, at most to time `end`, or to a fold if that comes first. None: the step size has collapsed.
    fn advance_to(&mut self, end: f64) -> Option<Progress> {
        if self.slowed.is_some() {
            return self.slow_step(end);
        }
        let before: Vec<f64> = self.watch.iter().map(|rod| rod.det).collect();
        let from = self.solver.state().clone();
        let left = end - from.time();
        if self.take_step(left).is_none() {
            // As at a fold that is too near for plain steps: towards which det J fell.
            let nearest = (0..before.len()).max_by(|a, b| {
                let fall = |k: &usize| (1.0 - self.watch[*k].det / before[*k]).abs();
                fall(a).total_cmp(&fall(b))
            })?;
            self.slow(from, nearest, before[nearest])?;
            return self.slow_step(end);
        }
        let crossed = (0..before.len()).find(|k| self.watch[*k].det * before[*k] <= 0.0);
        if let Some(link) = crossed {
            self.slow(from, link, before[link])?;
            return self.slow_step(end);
        }
        let h = self.step.h;
        let arrived = h >= left || (end - self.step.to.time()).abs() <= ON_TIME * (1.0 + end);
        if arrived {
            self.step.to = self.step.to.clone().at_time(end);
            let slope = self.step.end_slope().clone();
            self.solver.rewind(self.step.to.clone(), slope);
        }
        if self
            .watch
            .iter()
            .any(|rod| rod.gap > DRIFTED * self.local())
        {
            self.hold()?;
        }
        let falling = |k: &usize| {
            let rate = (self.watch[*k].det - before[*k]) / h;
            let time = -self.watch[*k].det / rate;
            0.0 < time && time < NEAR * self.solver.next_step()
        };
        if let Some(link) = (0..before.len()).find(falling) {
            self.slow(self.step.to.clone(), link, self.watch[link].det)?;
        }
        Some(if arrived {
            Progress::Arrived
        } else {
            Progress::Moved
        })
    }

    /// Brings the charts back to the poses of the bodies.
    fn hold(&mut self) -> Option<()> {
        let state = self.solver.state().clone();
        let at = self.assembly.evaluated(&state.0, self.along())?;
        self.extra.evaluations += 1;
        let charts = self.assembly.corrected(&at)?;
        let held = self
            .assembly
            .state(&Configuration { charts, ..at.now }, &at.integrals);
        let h = self.solver.next_step();
        self.resume(Numbers(held), None, h)
    }

    /// The rod whose end cannot be held, if there is one: how far it is off, and sqrt(F L^2/B).
    fn loose(&self) -> Option<(usize, f64, f64)> {
        let off = |rod: &Watch| rod.gap > LOOSE * self.options.tolerance;
        let link = self.watch.iter().position(off)?;
        let slots = self.assembly.chart_slots(link);
        let force = self.solver.state().0.rows(slots.start + 3, 3).norm();
        Some((link, self.watch[link].gap, force.sqrt()))
    }

    /// The same with time slowed for the rod that nears its fold.
    fn slow_step(&mut self, end: f64) -> Option<Progress> {
        let slowed = self.slowed?;
        let (assembly, along) = (self.assembly.clone(), self.along());
        let f = |y: &Numbers| {
            let mut out = y.clone();
            assembly.write_slope(&y.0, Some(slowed), along, &mut out.0, |_, _, _| ())?;
            Some(out)
        };
        let remaining = end - self.solver.state().time();
        let mut h_max = 4.0 * remaining / self.solver.slope().time().max(1e-3);
        let mut cost = Cost::default();
        let (mut step, fold) = loop {
            self.take_step(h_max)?;
            let mut step = self.step.clone();
            let fold = first_fold(&mut step, f, &mut cost)
                .and_then(|guess| locate(&step, f, guess, |_, slope| slope.time(), &mut cost));
            if fold.is_some() || step.end_slope().time() > 0.0 {
                break (step, fold);
            }
            // Time turned back and the fold was not found: it must be in a shorter step.
            self.solver
                .rewind(step.from.clone(), step.stage_slopes()[0].clone());
            h_max = 0.5 * step.h;
        };
        let progress = match fold {
            Some(fold) if fold.step.to.time() < end => {
                step = fold.step;
                Progress::Fold {
                    link: slowed.link,
                    time_error: fold.time_error,
                }
            }
            _ if step.to.time() >= end => {
                let guess = Guess {
                    h: step.h * remaining / (step.to.time() - step.from.time()),
                    rate: (step.to.time() - step.from.time()) / step.h,
                    t: end,
                };
                let found = locate(&step, f, guess, |state, _| state.time() - end, &mut cost)?;
                if (found.step.to.time() - end).abs() > ON_TIME * (1.0 + end) {
                    return None;
                }
                step = found.step;
                step.to = step.to.at_time(end);
                Progress::Arrived
            }
            _ => Progress::Moved,
        };
        self.extra.evaluations += cost.evaluations;
        self.extra.samples += cost.samples;
        let rate = step.end_slope().time();
        self.solver
            .rewind(step.to.clone(), step.end_slope().clone());
        self.step = step;
        if rate > FAR {
            let h = rate * self.solver.next_step();
            self.resume(self.step.to.clone(), None, h)?;
        }
        Some(progress)
    }

    /// The state at a time within the last step.
    fn inside(&mut self, t: f64) -> Option<DVector<f64>> {
        let (from, to) = (self.step.from.time(), self.step.to.time());
        if t == to {
            return Some(self.step.to.0.clone());
        }
        if t == from {
            return Some(self.step.from.0.clone());
        }
        if !(from < t && t < to) {
            return None;
        }
        if self.dense.is_none() {
            let (assembly, along) = (self.assembly.clone(), self.along());
            // The step was taken under the clock that its own slopes show.
            let slowed = self.slowed.filter(|_| {
                self.step
                    .stage_slopes()
                    .iter()
                    .any(|slope| slope.time() != 1.0)
            });
            let f = |y: &Numbers| {
                let mut out = y.clone();
                assembly.write_slope(&y.0, slowed, along, &mut out.0, |_, _, _| ())?;
                Some(out)
            };
            let mut cost = Cost::default();
            self.dense = self.step.dense(f, &mut cost);
            self.extra.evaluations += cost.evaluations;
            self.extra.samples += cost.samples;
        }
        let dense = self.dense.as_ref()?;
        let x = chandrupatla(
            |x| dense.at(x).time() - t,
            (0.0, from - t),
            (1.0, to - t),
            0.0,
        )?;
        Some(dense.at(x).at_time(t).0)
    }

    fn stop(&mut self, outcome: Outcome) -> Event {
        self.stopped = true;
        Event::Stop(outcome)
    }

    fn stuck(&mut self, cause: Cause, remedy: &str) -> Event {
        let outcome = Outcome::stuck(self.solver.state().time(), cause, remedy);
        self.stop(outcome)
    }

    /// At a fold of rod `link`: settles it and goes on.
    fn snap(&mut self, link: usize, time_error: f64) -> Result<Event> {
        if self.snaps >= self.options.max_snaps {
            return Ok(self.stop(Outcome::SnapLimit));
        }
        let along = self.along();
        let here = self.sample_now();
        let rod = &self.assembly.links()[link];
        let Evaluated {
            mut now,
            integrals,
            points,
        } = here.at.clone();
        let fallen = rod.settle(&now.charts[link], along)?;
        let before = SnapEnd {
            q: DVector::from_column_slice(now.charts[link].as_slice()),
            sheet: None,
            index: self.indices[link],
            elastic: points[link].end.energy,
        };
        now.charts[link] = fallen;
        let after = SnapEnd {
            q: DVector::from_column_slice(fallen.as_slice()),
            sheet: None,
            index: rod.index(&fallen, along)?,
            elastic: rod.end(&fallen, along)?.energy,
        };
        let body = &now.bodies[0];
        let snap = Snap {
            t: integrals.time,
            time_error,
            pose: DVector::from_column_slice(body.pose.translation.vector.as_slice()),
            velocity: DVector::from_column_slice(&body.twist.as_slice()[3..]),
            released: before.elastic - after.elastic,
            from: before,
            to: after,
            rod: link,
        };
        let h = self.solver.next_step();
        let state = Numbers(self.assembly.state(&now, &integrals));
        self.released += snap.released;
        self.snaps += 1;
        self.indices[link] = snap.to.index;
        self.before_snap = Some(here);
        self.resume(state, None, h)
            .ok_or_else(|| Error::no_convergence("the motion cannot leave its landing"))?;
        self.step = self.solver.blank();
        self.dense = None;
        Ok(Event::Snap(snap))
    }
}

fn indices(assembly: &Assembly, now: &Configuration, tolerance: f64) -> Result<Vec<usize>> {
    assembly
        .links()
        .iter()
        .zip(&now.charts)
        .map(|(link, q): (_, &Vector6<f64>)| link.index(q, tolerance))
        .collect()
}

impl<'a> Motion<'a> for AssemblyRun {
    fn advance(&mut self) -> Option<Event> {
        if self.stopped {
            return None;
        }
        if let Some((link, time_error)) = self.pending.take() {
            return Some(self.snap(link, time_error).unwrap_or_else(|why| {
                self.stuck(
                    Cause::Failed(why),
                    "the rod found no way down from its fold; change the start a little, or tighten run.tolerance",
                )
            }));
        }
        if self.interrupted {
            return Some(self.stop(Outcome::Interrupted));
        }
        let from = self.solver.state().time();
        if from >= self.options.duration {
            return Some(self.stop(Outcome::EndOfTime));
        }
        if self.cost().steps >= self.options.max_steps {
            return Some(self.stop(Outcome::StepLimit));
        }
        let end = self.assembly.next_break(from).min(self.options.duration);
        let Some(progress) = self.advance_to(end) else {
            let cause = Cause::StepCollapsed {
                next: self.solver.next_step(),
                tolerance: self.options.tolerance,
            };
            return Some(self.stuck(
                cause,
                "a rod is pulled straight, or folds in a way that is not simple: give it stretch (a finite axial stiffness), or \
                 friction (damping)",
            ));
        };
        if let Some((link, gap, lambda)) = self.loose() {
            let which = match self.assembly.links().len() {
                1 => "the rod".to_owned(),
                _ => format!("rod {link}"),
            };
            let why = Error::ill_conditioned(format!(
                "the end of {which} can be held no better than {gap:.1e} of its length: it is pulled so taut, by \
                 sqrt(F L^2/B) = {lambda:.1}, that its base wrench no longer tells where its end is"
            ));
            return Some(self.stuck(
                Cause::Failed(why),
                "let the rod stretch more (a smaller axial stiffness), give it friction (damping), or end before it is taut",
            ));
        }
        if let Progress::Fold { link, time_error } = progress {
            self.pending = Some((link, time_error));
        }
        Some(Event::Step {
            from,
            to: self.step.to.time(),
        })
    }

    fn given(&self) -> Seen<'_> {
        Seen::Kept(&self.first)
    }

    fn now(&self) -> Seen<'_> {
        Seen::Made(Box::new(self.sample_now()))
    }

    fn before_snap(&self) -> Option<Seen<'_>> {
        self.before_snap
            .as_ref()
            .map(|sample| Seen::Kept(sample as _))
    }

    fn sample(&mut self, t: f64) -> Option<Seen<'_>> {
        Some(Seen::Made(Box::new(self.state_at(t)?)))
    }

    fn duration(&self) -> f64 {
        self.options.duration
    }

    fn interrupt(&mut self) {
        self.interrupted = true;
    }

    fn cost(&self) -> Cost {
        self.solver.cost() + self.extra
    }
}
