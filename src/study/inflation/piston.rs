//! A heavy piston on the vessel of a light balloon, in a run.

use super::{InflationEnd, InflationMoment, InflationRecord, Moving, NO_STEP};
use crate::error::{Cause, Result};
use crate::membrane::Inflated;
use crate::membrane::piston::PistonOnBalloon;
use crate::membrane::rings::Height;
use crate::motion::{Event, Ledger, Options, Outcome, Run, Sample, Snap};
use crate::scene::{InflationScene, PistonScene, PistonStart};
use crate::solve::roots::chandrupatla;
use nalgebra::Vector1;
use serde_json::{Value, json};

/// Distance from the stretches at which the balloon is slack or bursts, from which on the run ends: steps towards those
/// stretches become shorter and shorter.
const AT_END: f64 = 1e-9;

/// A piston that moves.
pub(super) struct PistonMotion<'p> {
    run: Run<'p, PistonOnBalloon, 1>,
    start: &'p PistonStart,
    piston: &'p PistonScene,
    balloon: Inflated,
    /// Energy of the gas at the start.
    gas: f64,
    highest: Height,
    snaps: Vec<Value>,
    /// The state at the end of the last step.
    now: Sample<1>,
    /// States before and after the snaps since the last sample.
    jumps: Vec<InflationMoment>,
    /// True at the end of time.
    done: bool,
}

impl<'p> PistonMotion<'p> {
    pub(super) fn new(
        start: &'p PistonStart,
        piston: &'p PistonScene,
        given: &InflationScene,
    ) -> Result<Self> {
        let options = Options::new(given.duration / start.scale.time)?;
        let run = Run::new(
            &start.manifold,
            &start.body,
            Vector1::new(start.stretch),
            Vector1::new(start.velocity),
            options,
        )?;
        let mut motion = Self {
            now: run.now(),
            jumps: Vec::new(),
            run,
            start,
            piston,
            balloon: given.membrane,
            gas: 0.0,
            highest: Height {
                value: start.stretch * given.membrane.radius,
                time: 0.0,
            },
            snaps: Vec::new(),
            done: false,
        };
        motion.gas = motion.describe(0.0, &motion.run.given())?.ledger.potential;
        Ok(motion)
    }

    /// A state of the run in the units of the scene, at the time `t`.
    fn describe(&self, t: f64, at: &Sample<1>) -> Result<InflationMoment> {
        let scale = &self.start.scale;
        let state = self.balloon.at_stretch(at.phase.q[0])?;
        let ledger = at.ledger.scaled(scale.energy());
        Ok(InflationMoment {
            time: t,
            height: state.height,
            stretch: state.stretch,
            volume: state.volume,
            pressure: state.pressure,
            piston: Some(at.pose[0] * scale.length),
            velocity: at.phase.v[0] * scale.velocity(),
            ledger: Ledger {
                elastic: state.energy,
                potential: ledger.elastic - state.energy - self.gas,
                ..ledger
            },
        })
    }

    /// Counts a stretch, at a time in the units of the run, among the highest.
    fn rise(&mut self, stretch: f64, time: f64) {
        let value = stretch * self.balloon.radius;
        if value > self.highest.value {
            let time = time * self.start.scale.time;
            self.highest = Height { value, time };
        }
    }

    /// Looks at the last step, from the time `from` with the velocity `before` to the time `to`.
    fn look(&mut self, from: f64, to: f64, before: f64) -> std::result::Result<(), InflationEnd> {
        self.now = self.run.now();
        let (x, after) = (self.now.phase.q[0], self.now.phase.v[0]);
        if before * after < 0.0 {
            let run = &mut self.run;
            let velocity = |t: f64| run.sample(t).map_or(f64::NAN, |at| at.phase.v[0]);
            let turn = chandrupatla(velocity, (from, before), (to, after), 0.0);
            if let Some((t, at)) = turn.and_then(|t| Some((t, self.run.sample(t)?))) {
                self.rise(at.phase.q[0], t);
            }
        }
        self.rise(x, to);
        let time = to * self.start.scale.time;
        if x < 1.0 + AT_END && after < 0.0 {
            return Err(InflationEnd::Slack(time));
        }
        if x > Inflated::MOST_STRETCH * (1.0 - AT_END) {
            return Err(InflationEnd::Burst(time));
        }
        let Ok(state) = self.balloon.at_stretch(x) else {
            return Ok(());
        };
        if self.piston.room(state.pressure, state.volume) > 0.0 {
            return Ok(());
        }
        Err(InflationEnd::Bottom(time))
    }

    /// A snap as an event, in the units of the scene.
    fn snap(&mut self, snap: &Snap) -> Result<Value> {
        let scale = &self.start.scale;
        let side = |x: f64| -> Result<Value> {
            let state = self.balloon.at_stretch(x)?;
            Ok(json!({
                "stretch": x, "height": state.height, "pressure": state.pressure, "volume": state.volume,
            }))
        };
        let event = json!({
            "kind": "snap",
            "t": snap.t * scale.time,
            "time_error": snap.time_error * scale.time,
            "piston": snap.pose[0] * scale.length,
            "velocity": snap.velocity[0] * scale.velocity(),
            "from": side(snap.from.q[0])?,
            "to": side(snap.to.q[0])?,
            "released": snap.released * scale.energy(),
        });
        let time = snap.t * scale.time;
        let before = self.describe(time, &self.now)?;
        self.now = self.run.now();
        let after = self.describe(time, &self.now)?;
        self.jumps.extend([before, after]);
        self.rise(snap.to.q[0], snap.t);
        Ok(event)
    }

    /// The name of an end of the run.
    fn end(&self, outcome: Outcome) -> InflationEnd {
        let time = Moving::time(self);
        match outcome {
            Outcome::Stuck(stuck) => {
                let why = match stuck.cause {
                    Cause::Failed(why) => format!("{why}; start with less speed, or give more gas"),
                    _ => NO_STEP.to_owned(),
                };
                InflationEnd::Stuck(time, why)
            }
            other => InflationEnd::Stopped(time, other),
        }
    }
}

impl Moving for PistonMotion<'_> {
    fn go(&mut self, t: f64, steps: usize) -> std::result::Result<(), InflationEnd> {
        for _ in 0..steps {
            if Moving::time(self) >= t {
                break;
            }
            let before = self.now.phase.v[0];
            match self.run.next() {
                Some(Event::Step { from, to }) => self.look(from, to, before)?,
                Some(Event::Snap(snap)) => {
                    // Both sides of a snap are states of the balloon.
                    let event = self.snap(&snap);
                    self.snaps.extend(event);
                }
                Some(Event::Stop(Outcome::EndOfTime)) | None => self.done = true,
                Some(Event::Stop(outcome)) => return Err(self.end(outcome)),
                Some(_) => {}
            }
        }
        Ok(())
    }

    fn time(&self) -> f64 {
        if self.done {
            f64::INFINITY
        } else {
            self.run.time() * self.start.scale.time
        }
    }

    fn moment(&mut self, t: f64) -> Result<InflationMoment> {
        let now = match self.run.sample(t / self.start.scale.time) {
            Some(at) => at,
            None if t == 0.0 => self.run.given(),
            None => self.run.now(),
        };
        self.describe(t, &now)
    }

    fn jumps(&mut self) -> Vec<InflationMoment> {
        std::mem::take(&mut self.jumps)
    }

    fn finish(&self, record: &mut InflationRecord) {
        record.max_height = self.highest;
        let cost = self.run.cost();
        record.work = [cost.steps, cost.evaluations];
        record.events.extend(self.snaps.iter().cloned());
    }
}
