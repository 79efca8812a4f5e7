//! Spheres in motion under a pressure that is given over time.
//!
//! A sphere of the mass 4 pi R0^2 d rho that stays a sphere has one stretch x, with
//! ```text
//! rho R0^2 x'' = (p(t) R0/d) x^2 - W'(x).
//! ```
//! Closed forms for a step of the pressure are in [`super::sphere`].

use super::rings::{Height, MembraneLedger};
use super::{Inflated, Shape, sphere};
use nalgebra::SVector;
use snaprod_core::math::history::History;
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
/// Stretch below 1 from which a sphere counts as compressed: rounding lies far below.
const COMPRESSED: f64 = 1e-9;

/// A sphere in motion.
#[derive(Debug, Clone)]
pub struct SphereMotion {
    sphere: Inflated,
    pressure: History,
    /// Unit of time, (rho R0^2/C1)^(1/2).
    second: f64,
    /// Unit of energy, 4 pi R0^2 d C1.
    energy: f64,
    run: Dop853<State>,
    time: f64,
    highest: Height,
    compressed: Option<f64>,
}

/// Why a sphere does not go on.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum SphereEnd {
    /// The stretch grew past 30 at this time.
    Burst(f64),
    /// The stretch fell to 0.1, or no step was short enough, at this time.
    Collapse(f64),
}

impl SphereMotion {
    /// A `sphere` of the given `density` at rest without load, under `pressure` from time 0.
    ///
    /// # Errors
    /// A membrane of another shape; a density that is not finite and positive; a history with numbers that are not
    /// finite.
    pub fn new(sphere: Inflated, density: f64, pressure: History) -> Result<Self> {
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
            pressure: pressure.checked()?,
            second,
            energy: 4.0 * PI * sphere.radius.powi(2) * sphere.thickness * first,
            run: Dop853::new(start, State::zeros(), 1e-2, TOLERANCE),
            time: 0.0,
            highest: Height {
                value: sphere.radius,
                time: 0.0,
            },
            compressed: None,
        };
        motion.restart();
        Ok(motion)
    }

    /// Right-hand side of a step that ends at the time `end` at the latest. Up to a jump of the pressure it has the
    /// pressure before the jump.
    fn rate(&self, state: &State, end: f64) -> Option<State> {
        let x = state[STRETCH];
        if !(x > 0.1 && x < 2.0 * BURST) {
            return None;
        }
        let time = (state[TIME] * self.second).min(end);
        let number = self.sphere.pressure_number(self.pressure.at(time));
        let push = number * x * x;
        let first = self.sphere.rubber.first();
        let pull = 2.0 * self.sphere.rubber.at(x, x).stress[0] / first;
        let v = state[RATE];
        Some(State::from([v, push - pull, push * v, 1.0]))
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
            let next = self.pressure.next_break(self.time);
            let stop = end.min(next);
            let left = (stop - self.time) / self.second;
            let mut run = self.run.clone();
            let step = run
                .step(|state| self.rate(state, next.next_down()), left)
                .map_err(|_| SphereEnd::Collapse(self.time))?;
            // A maximum inside the step; its time is counted from the start of the step.
            let peak = (step.from[RATE] > 0.0 && step.to[RATE] <= 0.0)
                .then(|| self.peak(&step, next.next_down(), &mut run))
                .flatten();
            self.run = run;
            self.time = if step.h >= left {
                stop
            } else {
                self.time + step.h * self.second
            };
            let at = peak.unwrap_or(Height {
                value: self.stretch() * self.sphere.radius,
                time: self.time,
            });
            if at.value > self.highest.value {
                self.highest = at;
            }
            if self.stretch() < 1.0 - COMPRESSED && self.compressed.is_none() {
                self.compressed = Some(self.time);
            }
            if self.stretch() > BURST {
                return Err(SphereEnd::Burst(self.time));
            }
            if self.time == next {
                self.restart();
            }
        }
        Ok(())
    }

    /// The maximum of the radius within a step.
    fn peak(&self, step: &Step<State>, end: f64, run: &mut Dop853<State>) -> Option<Height> {
        let mut at = |h: f64| step.redo(|state| self.rate(state, end), h, run.cost_mut());
        let rate = |h: f64| at(h).map_or(f64::NAN, |step| step.to[RATE]);
        let ends = [(0.0, step.from[RATE]), (step.h, step.to[RATE])];
        let h = chandrupatla(rate, ends[0], ends[1], 0.0)?;
        Some(Height {
            value: at(h)?.to[STRETCH] * self.sphere.radius,
            time: self.time + h * self.second,
        })
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

    /// The end of the first step with a stretch below 1. A sphere without bending stiffness wrinkles there; this motion
    /// stays spherical from then on, which a real one does not.
    pub fn compressed(&self) -> Option<f64> {
        self.compressed
    }

    /// Volume inside.
    pub fn volume(&self) -> f64 {
        sphere::state(&self.sphere.rubber, self.stretch()).volume * self.sphere.radius.powi(3)
    }

    /// Pressure inside less outside.
    pub fn pressure(&self) -> f64 {
        self.pressure.at(self.time)
    }

    /// Energies.
    pub fn ledger(&self) -> MembraneLedger {
        let state = self.run.state();
        let x = state[STRETCH];
        let stored = self.sphere.rubber.at(x, x).energy / self.sphere.rubber.first();
        MembraneLedger {
            kinetic: self.energy * 0.5 * state[RATE].powi(2),
            stored: self.energy * stored,
            work: self.energy * state[WORK],
        }
    }
}
