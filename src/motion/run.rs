//! A run: motion on a sheet, snap at the fold, motion on the next sheet, as an iterator.

use super::ledger::Ledger;
use super::sheet::{Motion, Phase, Progress};
use super::snap::{LandingRule, Snap, SnapEnd, landings, orientation};
use super::start::{Departure, depart};
use crate::body::Body;
use crate::error::{Error, Result};
use crate::manifold::{Multivalued, Sheet};
use crate::solve::dop853::Work;
use nalgebra::SVector;

/// What a run is asked to do. Defaults: tolerance 1e-10, viscous landing, 1e7 steps, 1e5 snaps.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct RunOptions {
    /// End of time.
    pub duration: f64,
    /// Ten times the bound of the local error of each step, relative to 1 + size, in chart, velocity and
    /// time: the error of a smooth run of a few periods is of this order.
    pub tolerance: f64,
    /// Where snaps land.
    pub landing: LandingRule,
    /// Most steps.
    pub max_steps: u64,
    /// Most snaps.
    pub max_snaps: u64,
}

impl RunOptions {
    /// Options with defaults, up to the time `duration`.
    ///
    /// # Errors
    /// A duration that is not positive and finite.
    pub fn new(duration: f64) -> Result<Self> {
        if !(0.0 < duration && duration < f64::INFINITY) {
            return Err(Error::domain(format!(
                "duration = {duration} must be finite and > 0"
            )));
        }
        Ok(Self {
            duration,
            tolerance: 1e-10,
            landing: LandingRule::Viscous,
            max_steps: 10_000_000,
            max_snaps: 100_000,
        })
    }

    /// Sets the tolerance.
    ///
    /// # Errors
    /// A tolerance outside [1e-14, 1e-2].
    pub fn with_tolerance(mut self, tolerance: f64) -> Result<Self> {
        if !(1e-14..=1e-2).contains(&tolerance) {
            return Err(Error::domain(format!(
                "tolerance = {tolerance} must lie in [1e-14, 1e-2]"
            )));
        }
        self.tolerance = tolerance;
        Ok(self)
    }

    /// Sets the landing rule.
    #[must_use]
    pub fn with_landing(mut self, landing: LandingRule) -> Self {
        self.landing = landing;
        self
    }
}

/// Why a run ended.
#[derive(Debug, Clone, PartialEq)]
pub enum Outcome<const N: usize> {
    /// The end of time was reached.
    EndOfTime,
    /// At a fold the landing rule found no stable equilibrium.
    NoStableEquilibrium,
    /// At a fold under the rule `All`: each snap continues in a run of its own.
    Branched(Vec<Snap<N>>),
    /// The bound on steps was reached.
    StepLimit,
    /// The bound on snaps was reached.
    SnapLimit,
    /// The run cannot go on; the text says why and what would help.
    Stuck(String),
    /// Told to stop from outside.
    Interrupted,
}

impl<const N: usize> Outcome<N> {
    /// A stable key: end_of_time, no_stable_equilibrium, branched, step_limit, snap_limit, stuck, interrupted.
    pub fn key(&self) -> &'static str {
        match self {
            Self::EndOfTime => "end_of_time",
            Self::NoStableEquilibrium => "no_stable_equilibrium",
            Self::Branched(_) => "branched",
            Self::StepLimit => "step_limit",
            Self::SnapLimit => "snap_limit",
            Self::Stuck(_) => "stuck",
            Self::Interrupted => "interrupted",
        }
    }
}

impl<const N: usize> std::fmt::Display for Outcome<N> {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        match self {
            Self::EndOfTime => f.write_str("the end of time was reached"),
            Self::NoStableEquilibrium => f.write_str(
                "the rod ran out of its sheet and the landing rule leaves no stable equilibrium at this pose; landing = \"viscous\" always finds one if there is one",
            ),
            Self::Branched(snaps) => write!(f, "the run branched into {}", snaps.len()),
            Self::StepLimit => f.write_str("the bound max_steps was reached"),
            Self::SnapLimit => f.write_str("the bound max_snaps was reached"),
            Self::Stuck(why) => f.write_str(why),
            Self::Interrupted => f.write_str("interrupted"),
        }
    }
}

/// What one advance of a run was.
#[derive(Debug, Clone, PartialEq)]
pub enum RunEvent<const N: usize> {
    /// A step; samples between these times can be asked for now.
    Step {
        /// Time at its start.
        from: f64,
        /// Time at its end.
        to: f64,
    },
    /// A snap.
    Snap(Snap<N>),
    /// The end; nothing follows.
    Stop(Outcome<N>),
}

/// The state of a run at one moment.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Sample<const N: usize> {
    /// Time, chart point, velocity.
    pub phase: Phase<N>,
    /// Pose.
    pub pose: SVector<f64, N>,
    /// Force of the rod on the body.
    pub force: SVector<f64, N>,
    /// Sheet.
    pub sheet: Sheet,
    /// Morse index.
    pub index: usize,
    /// Ledger.
    pub ledger: Ledger,
}

/// Steps between two looks at the pace of a run.
const STRETCH: u64 = 50_000;

/// A run in progress.
pub struct Run<'a, M, const N: usize> {
    manifold: &'a M,
    body: &'a Body<N>,
    options: RunOptions,
    motion: Motion<'a, M, N>,
    index: usize,
    snapped: f64,
    snaps: u64,
    past: Work,
    pending: Option<f64>,
    stopped: bool,
    interrupted: bool,
    /// The state it was asked to start from.
    given: Phase<N>,
    /// Steps and time when the pace was last judged.
    milestone: (u64, f64),
}

impl<'a, M: Multivalued<N>, const N: usize> Run<'a, M, N> {
    /// A run from the chart point `q` with velocity `v` at time 0. A start on a fold moves off it to
    /// the stable side if it can, and snaps at once if it cannot.
    ///
    /// # Errors
    /// A start outside the chart, or a velocity that is not finite.
    pub fn new(
        manifold: &'a M,
        body: &'a Body<N>,
        q: SVector<f64, N>,
        v: SVector<f64, N>,
        options: RunOptions,
    ) -> Result<Self> {
        let zero = Phase {
            q,
            v,
            t: 0.0,
            work: 0.0,
            drag_loss: 0.0,
        };
        Self::start(manifold, body, zero, options, 0.0, 0)
    }

    fn start(
        manifold: &'a M,
        body: &'a Body<N>,
        phase: Phase<N>,
        options: RunOptions,
        snapped: f64,
        snaps: u64,
    ) -> Result<Self> {
        if !phase.v.iter().all(|v| v.is_finite()) {
            return Err(Error::domain(format!(
                "the velocity {:?} must be finite",
                phase.v.as_slice()
            )));
        }
        let given = phase;
        let departure = depart(manifold, body, &phase)?;
        let (phase, orientation, index, pending) = match departure {
            Departure::Regular { orientation } => {
                (phase, orientation, manifold.index(&phase.q)?, None)
            }
            Departure::FromFold {
                phase,
                orientation,
                index,
            } => (phase, orientation, index, None),
            Departure::Snap { index } => {
                (phase, orientation(manifold, &phase.q)?, index, Some(0.0))
            }
        };
        Ok(Self {
            manifold,
            body,
            options,
            motion: Motion::new(manifold, body, phase, orientation, options.tolerance)?,
            index,
            snapped,
            snaps,
            past: Work::default(),
            pending,
            stopped: false,
            interrupted: false,
            given,
            milestone: (0, phase.t),
        })
    }

    /// The run that follows from `snap`, one of those of [`Outcome::Branched`].
    ///
    /// # Errors
    /// A snap that is not of this run's manifold.
    pub fn branch(&self, snap: &Snap<N>) -> Result<Self> {
        let phase = Phase {
            q: snap.to.q,
            ..*self.motion.phase()
        };
        Self::start(
            self.manifold,
            self.body,
            phase,
            self.options,
            self.snapped + snap.released,
            self.snaps + 1,
        )
    }

    /// The state now.
    pub fn now(&self) -> Sample<N> {
        self.describe(*self.motion.phase())
    }

    /// The state at a time within the last step; None outside it.
    pub fn sample(&mut self, t: f64) -> Option<Sample<N>> {
        let phase = self.motion.at(t)?;
        Some(self.describe(phase))
    }

    /// The state that the run was given, which may lie a first small step before its motion: see
    /// [`Run::new`] on starts at folds.
    pub fn given(&self) -> Sample<N> {
        self.describe(self.given)
    }

    /// Time now.
    pub fn time(&self) -> f64 {
        self.motion.phase().t
    }

    /// End of time.
    pub fn duration(&self) -> f64 {
        self.options.duration
    }

    /// True if the run stands at a fold and will snap next.
    pub fn at_fold(&self) -> bool {
        self.pending.is_some()
    }

    /// Ends the run at its next step, with [`Outcome::Interrupted`].
    pub fn interrupt(&mut self) {
        self.interrupted = true;
    }

    /// What it cost so far.
    pub fn work(&self) -> Work {
        let (a, b) = (self.past, self.motion.work());
        Work {
            evaluations: a.evaluations + b.evaluations,
            steps: a.steps + b.steps,
            rejected: a.rejected + b.rejected,
            dense: a.dense + b.dense,
        }
    }

    /// Snaps so far.
    pub fn snaps(&self) -> u64 {
        self.snaps
    }

    fn describe(&self, phase: Phase<N>) -> Sample<N> {
        let at = self
            .manifold
            .point(&phase.q)
            .expect("every state of a run lies in the chart");
        Sample {
            phase,
            pose: at.pose,
            force: at.force,
            sheet: self.manifold.sheet(&phase.q),
            index: self.index,
            ledger: Ledger::new(self.body, &at, &phase, self.snapped),
        }
    }

    /// Looks back over the last stretch of steps: at that rate, would the run end within max_steps? A
    /// mass that settles on the straight rod oscillates ever faster, without bound.
    fn hopeless(&mut self, steps: u64) -> Option<String> {
        let (before, since) = self.milestone;
        let time = self.time();
        self.milestone = (steps, time);
        let per_time = (steps - before) as f64 / (time - since);
        let needed = per_time * (self.options.duration - time);
        if needed <= 2.0 * self.options.max_steps as f64 {
            return None;
        }
        let here = self.now();
        Some(format!(
            "at t = {time:?}, pose {:?}, the last {} steps advanced time by {:.2e}: the end would take {needed:.1e} more steps, beyond max_steps = {}; \
             the motion's own time has become too short for the time asked, as under enormous loads or for a mass that settles on the straight rod at (1, 0); \
             change the loads, end earlier, or raise max_steps",
            here.pose.as_slice(),
            steps - before,
            time - since,
            self.options.max_steps
        ))
    }

    fn stop(&mut self, outcome: Outcome<N>) -> RunEvent<N> {
        self.stopped = true;
        RunEvent::Stop(outcome)
    }

    /// At a fold: finds the landings and, unless the run branches, goes on from there.
    fn snap(&mut self, time_error: f64) -> Result<RunEvent<N>> {
        if self.snaps >= self.options.max_snaps {
            return Ok(self.stop(Outcome::SnapLimit));
        }
        let phase = *self.motion.phase();
        let here = self.describe(phase);
        let landed = landings(self.manifold, &phase.q, self.options.landing)?;
        let mut snaps = Vec::with_capacity(landed.len());
        for q in landed {
            let elastic = self
                .manifold
                .point(&q)
                .ok_or_else(|| Error::domain("a landing outside the chart"))?
                .energy;
            snaps.push(Snap {
                t: phase.t,
                time_error,
                pose: here.pose,
                velocity: phase.v,
                from: SnapEnd {
                    q: phase.q,
                    sheet: here.sheet,
                    index: self.index,
                    elastic: here.ledger.elastic,
                },
                to: SnapEnd {
                    q,
                    sheet: self.manifold.sheet(&q),
                    index: self.manifold.index(&q)?,
                    elastic,
                },
                released: here.ledger.elastic - elastic,
            });
        }
        if snaps.is_empty() {
            return Ok(self.stop(Outcome::NoStableEquilibrium));
        }
        if self.options.landing == LandingRule::All {
            return Ok(self.stop(Outcome::Branched(snaps)));
        }
        let snap = snaps[0];
        self.past = self.work();
        self.snapped += snap.released;
        self.snaps += 1;
        self.index = snap.to.index;
        self.motion = Motion::new(
            self.manifold,
            self.body,
            Phase {
                q: snap.to.q,
                ..phase
            },
            orientation(self.manifold, &snap.to.q)?,
            self.options.tolerance,
        )?;
        Ok(RunEvent::Snap(snap))
    }
}

impl<M: Multivalued<N>, const N: usize> Iterator for Run<'_, M, N> {
    type Item = RunEvent<N>;

    fn next(&mut self) -> Option<RunEvent<N>> {
        if self.stopped {
            return None;
        }
        if self.interrupted {
            return Some(self.stop(Outcome::Interrupted));
        }
        if let Some(time_error) = self.pending.take() {
            let t = self.time();
            return Some(
                self.snap(time_error)
                    .unwrap_or_else(|e| self.stop(Outcome::Stuck(format!("snap at t = {t}: {e}")))),
            );
        }
        let from = self.time();
        if from >= self.options.duration {
            return Some(self.stop(Outcome::EndOfTime));
        }
        let steps = self.work().steps;
        if steps >= self.options.max_steps {
            return Some(self.stop(Outcome::StepLimit));
        }
        if self.options.max_steps > 20 * STRETCH
            && steps >= self.milestone.0 + STRETCH
            && let Some(why) = self.hopeless(steps)
        {
            return Some(self.stop(Outcome::Stuck(why)));
        }
        let end = self.body.next_break(from).min(self.options.duration);
        let Some(progress) = self.motion.step(end) else {
            let here = self.now();
            return Some(self.stop(Outcome::Stuck(format!(
                "the step size collapsed at t = {}, pose {:?}, chart point {:?}: the motion runs into a singular point of the model \
                 (for the elastica: the straight rod at (1, 0)); start from another pose or velocity",
                here.phase.t,
                here.pose.as_slice(),
                here.phase.q.as_slice()
            ))));
        };
        if let Progress::Fold { time_error } = progress {
            self.pending = Some(time_error);
        }
        Some(RunEvent::Step {
            from,
            to: self.time(),
        })
    }
}
