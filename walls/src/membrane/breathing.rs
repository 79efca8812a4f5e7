//! Spheres in motion under a pressure that is given over time, or under gas.
//!
//! A sphere of the mass 4 pi R0^2 d rho that stays a sphere has one stretch x, with
//! ```text
//! rho R0^2 x'' = (p R0/d) x^2 - W'(x).
//! ```
//! Closed forms for a step of the pressure are in [`super::sphere`].

use super::rings::{Height, MembraneLedger};
use super::{Filling, Inflated, Shape};
use nalgebra::SVector;
use snaprod_core::solve::dop853::{Dop853, Step};
use snaprod_core::solve::roots::chandrupatla;
use snaprod_core::{Error, Result};
use std::f64::consts::PI;

/// Stretch and its rate, work over 4 pi R0^2 d C1, and the time, in the unit (rho R0^2/C1)^(1/2) of time.
type State = SVector<f64, 4>;
const STRETCH: usize = 0;
const RATE: usize = 1;
const WORK: usize = 2;
const TIME: usize = 3;

/// Tolerance of the integration.
const TOLERANCE: f64 = 1e-12;
/// Stretch from which a sphere counts as burst.
const BURST: f64 = 30.0;
/// Least stretch of a motion.
const COLLAPSED: f64 = 0.1;
/// Stretch below which a motion without a further step has come to the least stretch.
const NEARLY_COLLAPSED: f64 = 0.11;
/// Stretch below 1 from which a sphere counts as compressed: rounding lies far below.
const COMPRESSED: f64 = 1e-9;

/// Relative difference of heights of one height: errors of the integration lie below.
const SAME: f64 = 1e-9;

/// A turn of a sphere: a maximum or a minimum of its stretch.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Turn {
    /// Time.
    pub time: f64,
    /// Stretch.
    pub stretch: f64,
}

/// A passage of a sphere through a stretch that is watched.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Passage {
    /// Time.
    pub time: f64,
    /// The stretch.
    pub stretch: f64,
    /// True if the sphere grows.
    pub outward: bool,
}

/// A sphere in motion.
#[derive(Debug, Clone)]
pub struct SphereMotion {
    sphere: Inflated,
    filling: Filling,
    /// Unit of time, (rho R0^2/C1)^(1/2).
    second: f64,
    /// Unit of energy, 4 pi R0^2 d C1.
    energy: f64,
    run: Dop853<State>,
    time: f64,
    highest: Height,
    /// Number of turns before the greatest height.
    highest_swing: usize,
    compressed: Option<f64>,
    turns: Vec<Turn>,
    watched: Vec<f64>,
    passages: Vec<Passage>,
}

/// Why a sphere does not go on.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum SphereEnd {
    /// The stretch grew past 30 at this time.
    Burst(f64),
    /// The stretch fell to 0.1 at this time.
    Collapse(f64),
    /// No step was short enough at this time: the numbers are too large.
    Stuck(f64),
}

impl SphereMotion {
    /// A `sphere` of the given `density` at rest without load, under `filling` from time 0. A history in time is a
    /// pressure.
    ///
    /// # Errors
    /// A membrane of another shape; a density that is not finite and positive; a history with numbers that are not
    /// finite; a content of gas that is not finite and positive.
    pub fn new(sphere: Inflated, density: f64, filling: impl Into<Filling>) -> Result<Self> {
        if sphere.shape != Shape::Sphere {
            return Err(Error::domain(
                "this motion is for spheres, shape = \"sphere\": for discs see membrane::rings",
            ));
        }
        if !(0.0 < density && density < f64::INFINITY) {
            return Err(Error::domain(format!(
                "the density {density} of a membrane in motion must be finite and > 0"
            )));
        }
        let first = sphere.rubber.first();
        let second = sphere.radius * (density / first).sqrt();
        let mut start = State::zeros();
        start[STRETCH] = 1.0;
        let mut motion = Self {
            sphere,
            filling: filling.into().checked(volume(&sphere, 1.0))?,
            second,
            energy: 4.0 * PI * sphere.radius.powi(2) * sphere.thickness * first,
            run: Dop853::new(start, State::zeros(), 1e-2, TOLERANCE),
            time: 0.0,
            highest: Height {
                value: sphere.radius,
                time: 0.0,
            },
            highest_swing: 0,
            compressed: None,
            turns: Vec::new(),
            watched: Vec::new(),
            passages: Vec::new(),
        };
        motion.restart();
        Ok(motion)
    }

    /// Watches for passages through these stretches.
    #[must_use]
    pub fn watching(mut self, stretches: Vec<f64>) -> Self {
        self.watched = stretches;
        self
    }

    /// Right-hand side of a step that ends at the time `end` at the latest. Up to a jump of the pressure it has the
    /// pressure before the jump.
    fn rate(&self, state: &State, end: f64) -> Option<State> {
        let x = state[STRETCH];
        if !(x > COLLAPSED && x < 2.0 * BURST) {
            return None;
        }
        let time = (state[TIME] * self.second).min(end);
        let pressure = self.filling.pressure(time, volume(&self.sphere, x));
        let push = self.sphere.pressure_number(pressure) * x * x;
        let first = self.sphere.rubber.first();
        let pull = 2.0 * self.sphere.rubber.at(x, x).stress[0] / first;
        let v = state[RATE];
        let power = if self.filling.is_driven() {
            push * v
        } else {
            0.0
        };
        Some(State::from([v, push - pull, power, 1.0]))
    }

    /// Begins a step anew, after a break of the pressure.
    fn restart(&mut self) {
        let mut state = *self.run.state();
        state[TIME] = self.time / self.second;
        let slope = (self.rate(&state, self.time)).unwrap_or_else(State::zeros);
        self.run.restart(state, slope, 1e-2);
    }

    /// Goes on to the time `end`.
    ///
    /// # Errors
    /// A sphere that bursts or collapses.
    pub fn advance(&mut self, end: f64) -> std::result::Result<(), SphereEnd> {
        while self.time < end {
            self.step(end)?;
        }
        Ok(())
    }

    /// One step, at most to the time `end`, which lies ahead.
    ///
    /// # Errors
    /// As [`SphereMotion::advance`].
    pub fn step(&mut self, end: f64) -> std::result::Result<(), SphereEnd> {
        let next = self.filling.next_break(self.time);
        let stop = end.min(next);
        let left = (stop - self.time) / self.second;
        let mut run = self.run.clone();
        let step = run
            .step(|state| self.rate(state, next.next_down()), left)
            .map_err(|_| {
                if self.stretch() < NEARLY_COLLAPSED {
                    SphereEnd::Collapse(self.time)
                } else {
                    SphereEnd::Stuck(self.time)
                }
            })?;
        self.look(&step, next.next_down(), &mut run);
        self.run = run;
        self.time = if step.h >= left {
            stop
        } else {
            self.time + step.h * self.second
        };
        self.rise(self.stretch(), self.time);
        if self.stretch() > BURST {
            return Err(SphereEnd::Burst(self.time));
        }
        if self.time == next {
            self.restart();
        }
        Ok(())
    }

    /// Counts a stretch and its time among the highest. Of swings of one height the first counts.
    fn rise(&mut self, stretch: f64, time: f64) {
        let value = stretch * self.sphere.radius;
        let swing = self.turns.len();
        let least = if swing == self.highest_swing {
            self.highest.value
        } else {
            self.highest.value * (1.0 + SAME)
        };
        if value > least {
            self.highest = Height { value, time };
            self.highest_swing = swing;
        }
    }

    /// Looks for turns and passages within a step, which has begun at the present time.
    fn look(&mut self, step: &Step<State>, end: f64, run: &mut Dop853<State>) {
        let [from, to] = [&step.from, &step.to].map(|state| [state[RATE], state[STRETCH]]);
        let turned = (from[0] > 0.0 && to[0] <= 0.0) || (from[0] < 0.0 && to[0] >= 0.0);
        // Stretches at the start of the step, at its turn and at its end, each with its place in the step.
        let mut nodes = vec![(0.0, from[1])];
        if turned {
            let ends = [(0.0, from[0]), (step.h, to[0])];
            if let Some((h, stretch)) = self.root(step, end, run, ends, &|state| state[RATE]) {
                let time = self.time + h * self.second;
                self.rise(stretch, time);
                self.turns.push(Turn { time, stretch });
                nodes.push((h, stretch));
            }
        }
        nodes.push((step.h, to[1]));
        let levels: Vec<f64> = (self.watched.iter().copied())
            .chain([1.0 - COMPRESSED])
            .collect();
        for part in nodes.windows(2) {
            for &level in &levels {
                let ends = [0, 1].map(|k| (part[k].0, part[k].1 - level));
                let outward = ends[0].1 < 0.0 && ends[1].1 >= 0.0;
                let inward = ends[0].1 >= 0.0 && ends[1].1 < 0.0;
                if !(outward || inward) {
                    continue;
                }
                let off = |state: &State| state[STRETCH] - level;
                let Some((h, _)) = self.root(step, end, run, ends, &off) else {
                    continue;
                };
                let time = self.time + h * self.second;
                if level < 1.0 {
                    if inward {
                        self.compressed.get_or_insert(time);
                    }
                } else {
                    self.passages.push(Passage {
                        time,
                        stretch: level,
                        outward,
                    });
                }
            }
        }
    }

    /// The place within a step at which `number` of the state vanishes, between two places at which it is known, and
    /// the stretch there.
    fn root(
        &self,
        step: &Step<State>,
        end: f64,
        run: &mut Dop853<State>,
        ends: [(f64, f64); 2],
        number: &dyn Fn(&State) -> f64,
    ) -> Option<(f64, f64)> {
        let mut at = |h: f64| step.redo(|state| self.rate(state, end), h, run.cost_mut());
        let off = |h: f64| at(h).map_or(f64::NAN, |step| number(&step.to));
        let h = chandrupatla(off, ends[0], ends[1], 0.0)?;
        Some((h, at(h)?.to[STRETCH]))
    }

    /// Time.
    pub fn time(&self) -> f64 {
        self.time
    }

    /// Stretch.
    pub fn stretch(&self) -> f64 {
        self.run.state()[STRETCH]
    }

    /// The greatest radius since the start.
    pub fn highest(&self) -> Height {
        self.highest
    }

    /// The first time at which the stretch fell below 1. A sphere without bending stiffness wrinkles there; this motion
    /// stays spherical from then on, which a real one does not.
    pub fn compressed(&self) -> Option<f64> {
        self.compressed
    }

    /// Rate of the radius.
    pub fn velocity(&self) -> f64 {
        self.run.state()[RATE] * self.sphere.radius / self.second
    }

    /// Maxima and minima of the stretch since the start, in the order of time.
    pub fn turns(&self) -> &[Turn] {
        &self.turns
    }

    /// Passages through the stretches that are watched.
    pub fn passages(&self) -> &[Passage] {
        &self.passages
    }

    /// Numbers of steps and of right-hand sides since the start.
    pub fn work(&self) -> [u64; 2] {
        let cost = self.run.cost();
        [cost.steps, cost.evaluations]
    }

    /// The sphere.
    pub fn sphere(&self) -> &Inflated {
        &self.sphere
    }

    /// The pressure over time, or the gas.
    pub fn filling(&self) -> &Filling {
        &self.filling
    }

    /// Radius.
    pub fn radius(&self) -> f64 {
        self.stretch() * self.sphere.radius
    }

    /// Volume inside.
    pub fn volume(&self) -> f64 {
        volume(&self.sphere, self.stretch())
    }

    /// Pressure inside less outside.
    pub fn pressure(&self) -> f64 {
        self.filling.pressure(self.time, self.volume())
    }

    /// Energies.
    pub fn ledger(&self) -> MembraneLedger {
        let state = self.run.state();
        let x = state[STRETCH];
        let stored = self.sphere.rubber.at(x, x).energy / self.sphere.rubber.first();
        MembraneLedger {
            kinetic: self.energy * 0.5 * state[RATE].powi(2),
            stored: self.energy * stored,
            gas: self
                .filling
                .energy(volume(&self.sphere, 1.0), self.volume()),
            work: self.energy * state[WORK],
        }
    }
}

/// Volume inside of a sphere at a stretch.
fn volume(sphere: &Inflated, stretch: f64) -> f64 {
    4.0 / 3.0 * PI * (stretch * sphere.radius).powi(3)
}
