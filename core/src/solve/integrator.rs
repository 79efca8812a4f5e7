//! Integration of intermittently stiff systems: DOP853 while it is cheaper, Radau IIA while the system is stiff.

use super::cost::Cost;
use super::dop853::{Dense, Dop853, Step, StepTooSmall};
use super::radau::{Radau, estimate_bound};
use super::system::{AnySystem, spectral_radius};
use nalgebra::DVector;

/// Integration method; in a scene by its name in small letters.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
#[cfg_attr(
    feature = "serde",
    derive(serde::Serialize),
    serde(rename_all = "lowercase")
)]
pub enum Method {
    /// Explicit or implicit, judged during the integration (the default).
    #[default]
    Auto,
    /// DOP853, order 8: explicit steps, bounded by the fastest decay.
    Explicit,
    /// Radau IIA, order 5, or 9 or 13 at fine tolerances: implicit steps, for stiff systems.
    Implicit,
    /// Gauss collocation, order 12: symmetric steps of one length, for long motions without friction
    /// ([`super::gauss`]). The integrator of this module does not implement it, and chooses as under `Auto`.
    Symmetric,
}

/// Step times eigenvalue above which stability limits DOP853 (Hairer's test).
const STIFF: f64 = 6.1;
/// Step times eigenvalue above which the interpolant of DOP853 is much poorer than its steps.
const POOR: f64 = 2.0;
/// Number of steps limited by stability after which Radau takes over: at first, and at most after changes that did
/// not pay. RELIEF steps in a row that stability does not limit reset the count.
const PATIENCE: u32 = 12;
const PATIENCE_LIMIT: u32 = 400;
const RELIEF: u32 = 6;
/// Ratio of the steps of Radau to those of DOP853 at which the system counts as stiff, even if accuracy limits the
/// step (as order reduction makes it). Checked every STRIDE steps.
const LONGER: f64 = 3.0;
const STRIDE: u64 = 4;
/// Error estimate of Radau of order 5 for a step h, over h^4 y''''. Steps of order 9 are longer, so the estimate
/// favours DOP853.
const RADAU_ERROR: f64 = 0.00458;
/// Step times spectral radius below which DOP853 would be stable with the steps of Radau.
const EASY: f64 = 3.0;
/// Number of steps below `EASY` in a row after which DOP853 takes over: at first, and at most after harmful changes. A
/// step that still grows by more than GROWTH does not count.
const CALM: u32 = 4;
const CALM_LIMIT: u32 = 4096;
const GROWTH: f64 = 2.0;
/// Step times spectral radius below which rounding limits DOP853: the slope contains the inverse of a nearly singular
/// mass, and no motion is that much faster than the fastest rate.
const ROUGH: f64 = 0.1;
/// A change to DOP853 was harmful if its first TRIAL steps are on average this much shorter than the next step of
/// Radau.
const TRIAL: u64 = 12;
const SHORTER: f64 = 8.0;
/// If Radau was used for fewer steps than this, the change did not pay: the next one waits twice as long.
const SHORT_STAY: u64 = 60;

/// An integration in progress. The system is passed to every call, so that its owner may change it in between; see
/// [`Integrator::restart`].
pub struct Integrator {
    tolerance: f64,
    method: Method,
    implicit: bool,
    explicit: Dop853<DVector<f64>>,
    last: Step<DVector<f64>>,
    dense: Option<Dense<DVector<f64>>>,
    radau: Radau,
    span: f64,
    /// Steps in a row in favour of the other method, and steps against it.
    votes: u32,
    relief: u32,
    patience: u32,
    calm: u32,
    /// Next step of Radau when DOP853 took over, the step count of DOP853 then, and the length covered since. None if
    /// DOP853 did not take over, or has been judged.
    trial: Option<(f64, u64, f64)>,
    /// The last slopes, STRIDE steps apart, each with the length covered since the one before.
    trail: Vec<(f64, DVector<f64>)>,
    /// Length covered since the last of these slopes.
    walked: f64,
    /// Step count of Radau when it last took over.
    since: u64,
    /// Spectral radius with the number of its Jacobian, and the last vector of the power iteration.
    radius: (u64, f64),
    direction: DVector<f64>,
    switches: u64,
    /// Evaluations outside the steps.
    extra: u64,
}

impl Integrator {
    /// Starts at `y`. The error of each step is kept near `tolerance`, in units of the root of
    /// [`AnySystem::mean_square`]: 1e-13 is the finest that makes sense. The error control corrects `first_step`;
    /// without one it is estimated from the slope and its change. None if `y` is outside the domain of the slope.
    pub fn new(
        system: &dyn AnySystem,
        y: DVector<f64>,
        tolerance: f64,
        method: Method,
        first_step: Option<f64>,
    ) -> Option<Self> {
        let method = match method {
            Method::Symmetric => Method::Auto,
            method => method,
        };
        let implicit = method == Method::Implicit;
        let mut slope = DVector::zeros(y.len());
        system.slope(&y, &mut slope)?;
        let mut extra = 1;
        let h = first_step.unwrap_or_else(|| {
            extra += 1;
            first_guess(system, &y, &slope, tolerance, implicit)
        });
        let explicit = Dop853::new(y.clone(), slope.clone(), h, tolerance);
        let last = explicit.blank();
        let mut settled = y;
        if implicit {
            system.settle(&mut settled)?;
            system.balance(&settled, &mut slope)?;
        }
        Some(Self {
            tolerance,
            method,
            implicit,
            explicit,
            last,
            dense: None,
            radau: Radau::new(settled, slope, h, tolerance),
            span: 0.0,
            votes: 0,
            relief: 0,
            patience: PATIENCE,
            calm: CALM,
            trial: None,
            trail: Vec::new(),
            walked: 0.0,
            since: 0,
            radius: (0, 0.0),
            direction: DVector::zeros(0),
            switches: 0,
            extra,
        })
    }

    /// Restricts implicit steps to the order that suits the tolerance: for systems whose samples inside steps cost as
    /// much as steps, so that longer steps do not pay.
    pub fn keep_order(&mut self) {
        self.radau.keep_order();
    }

    /// Starts anew at `y`, of any dimension and with a system that may have changed; step size, method and cost are
    /// kept, unless a first step is given. None, and nothing has changed, if `y` is outside the domain.
    pub fn restart(
        &mut self,
        system: &dyn AnySystem,
        y: DVector<f64>,
        first_step: Option<f64>,
    ) -> Option<()> {
        let h = first_step.unwrap_or(self.next_step());
        // Votes survive a restart: a run that restarts often would otherwise never change its method.
        let (votes, relief) = (self.votes, self.relief);
        self.start_method(system, y, h)?;
        (self.votes, self.relief) = (votes, relief);
        self.span = 0.0;
        self.dense = None;
        Some(())
    }

    /// Places the current method at a state; None, and nothing has changed, if the state is outside the domain.
    fn start_method(&mut self, system: &dyn AnySystem, mut y: DVector<f64>, h: f64) -> Option<()> {
        let mut slope = DVector::zeros(y.len());
        self.extra += 1;
        if self.implicit {
            system.settle(&mut y)?;
            system.balance(&y, &mut slope)?;
        } else {
            system.slope(&y, &mut slope)?;
        }
        self.votes = 0;
        self.relief = 0;
        self.trail.clear();
        self.walked = 0.0;
        self.radius.0 = 0;
        if self.implicit {
            self.radau.restart(y, slope, h);
        } else {
            self.explicit.restart(y, slope, h);
            self.last = self.explicit.blank();
        }
        Some(())
    }

    /// Changes to Radau IIA, unless the caller has fixed the method: for a system known to be stiff.
    pub fn switch_to_implicit(&mut self, system: &dyn AnySystem) {
        if self.method == Method::Auto && !self.implicit {
            self.switch(system, self.span);
        }
    }

    /// Takes one step of at most `h_max`.
    ///
    /// # Errors
    /// [`StepTooSmall`] if no step of a size worth taking meets the tolerance, or if the Jacobian is undefined.
    pub fn step(&mut self, system: &dyn AnySystem, h_max: f64) -> Result<(), StepTooSmall> {
        if self.method == Method::Auto {
            self.choose(system);
        }
        let taken = self.attempt(system, h_max);
        if taken.is_err() && self.method == Method::Auto && !self.implicit {
            self.switch(system, self.span);
            return self.attempt(system, h_max);
        }
        taken
    }

    fn attempt(&mut self, system: &dyn AnySystem, h_max: f64) -> Result<(), StepTooSmall> {
        self.dense = None;
        if self.implicit {
            self.radau.step(system, h_max)?;
            self.span = self.radau.span();
        } else {
            let f = |y: &DVector<f64>, out: &mut DVector<f64>| system.slope(y, out);
            let norm = |e: &_, from: &_, to: &_| system.mean_square(e, from, to);
            self.explicit
                .step_measured(f, norm, h_max, &mut self.last)?;
            self.span = self.last.h;
        }
        Ok(())
    }

    /// Judges the last step and changes the method if due.
    fn choose(&mut self, system: &dyn AnySystem) {
        if self.span == 0.0 {
            return;
        }
        if !self.implicit {
            if self.did_harm() {
                self.calm = (2 * self.calm).min(CALM_LIMIT);
                self.switch(system, self.span);
                return;
            }
            let norm = |e: &_, from: &_, to: &_| system.mean_square(e, from, to);
            let size = self.last.stiffness(norm);
            let longer = self.smoothness(system).filter(|&h| h > LONGER);
            let rough = self.explicit.next_step() * self.radius.1 < ROUGH && self.radius.1 > 0.0;
            if rough || longer.is_some() || size.is_some_and(|size| size > STIFF) {
                self.relief = 0;
                // Smoothness is judged over many steps: one such judgement counts as PATIENCE votes.
                self.votes += if longer.is_some() { PATIENCE } else { 1 };
                if self.votes >= self.patience {
                    if rough {
                        self.calm = (2 * self.calm).min(CALM_LIMIT);
                    }
                    self.switch(system, self.span);
                }
            } else {
                self.relief += 1;
                if self.relief >= RELIEF {
                    self.votes = 0;
                }
            }
            return;
        }
        let h = self.radau.next_step();
        if h > GROWTH * self.span || h * self.radius(h) > EASY {
            self.votes = 0;
            return;
        }
        self.votes += 1;
        if self.votes < self.calm {
            return;
        }
        // The Jacobian in use may belong to an earlier state: a new one decides.
        if self.radau.refresh(system).is_none() || h * self.radius(h) > EASY {
            self.votes = 0;
            return;
        }
        let stayed = self.radau.cost().steps - self.since;
        self.patience = if stayed < SHORT_STAY {
            (2 * self.patience).min(PATIENCE_LIMIT)
        } else {
            PATIENCE
        };
        self.switch(system, h);
        self.trial = (!self.implicit).then(|| (h, self.explicit.cost().steps, 0.0));
    }

    /// True if the first steps of DOP853 after Radau show that the change was harmful.
    fn did_harm(&mut self) -> bool {
        let Some((before, since, walked)) = &mut self.trial else {
            return false;
        };
        *walked += self.span;
        if self.explicit.cost().steps - *since < TRIAL {
            return false;
        }
        let harm = SHORTER * *walked < *before * TRIAL as f64;
        self.trial = None;
        harm
    }

    /// Step of Radau by its error estimate, over that of DOP853; every STRIDE steps. From the third divided
    /// difference of the slope, y''''/6, and the error estimate of Radau.
    fn smoothness(&mut self, system: &dyn AnySystem) -> Option<f64> {
        self.walked += self.span;
        if !self.explicit.cost().steps.is_multiple_of(STRIDE) {
            return None;
        }
        if self.trail.len() == 4 {
            self.trail.remove(0);
        }
        self.trail
            .push((self.walked, self.explicit.slope().clone()));
        self.walked = 0.0;
        if self.trail.len() < 4 {
            return None;
        }
        let mut at = 0.0;
        let places = [0, 1, 2, 3].map(|i| {
            at += if i == 0 { 0.0 } else { self.trail[i].0 };
            at
        });
        let mut third = DVector::zeros(self.state().len());
        for i in 0..4 {
            let others = (0..4).filter(|&j| j != i);
            let weight: f64 = others.map(|j| places[i] - places[j]).product();
            third.axpy(1.0 / weight, &self.trail[i].1, 1.0);
        }
        let y = self.state();
        let size = 6.0 * system.mean_square(&third, y, y).sqrt();
        let step = (estimate_bound(self.tolerance) / (RADAU_ERROR * size)).powf(0.25);
        // Slopes along three strides do not support steps of more than a few times their length.
        let taken = (at / (3 * STRIDE) as f64).max(self.explicit.next_step());
        Some(step.min(10.0 * at) / taken)
    }

    /// Spectral radius of the Jacobian of Radau, or a lower bound well beyond the limit for the step `h`.
    fn radius(&mut self, h: f64) -> f64 {
        let number = self.radau.cost().jacobians;
        if self.radius.0 != number
            && let Some(jacobian) = self.radau.jacobian()
        {
            let n = self.radau.state().len();
            self.radius = (
                number,
                spectral_radius(jacobian, &mut self.direction, n, EASY / h),
            );
        }
        self.radius.1
    }

    /// Changes to the other method at the current state with a step `h`.
    fn switch(&mut self, system: &dyn AnySystem, h: f64) {
        let y = self.state().clone();
        let h = if h > 0.0 { h } else { self.next_step() };
        self.implicit = !self.implicit;
        if self.start_method(system, y, h).is_none() {
            // The other method cannot start at this state.
            self.implicit = !self.implicit;
            return;
        }
        self.switches += 1;
        self.since = self.radau.cost().steps;
        self.span = 0.0;
    }

    /// The current state.
    pub fn state(&self) -> &DVector<f64> {
        if self.implicit {
            self.radau.state()
        } else {
            self.explicit.state()
        }
    }

    /// The slope at the current state.
    pub fn slope(&self) -> &DVector<f64> {
        if self.implicit {
            self.radau.slope()
        } else {
            self.explicit.slope()
        }
    }

    /// The state at the start of the last step; the current one before the first.
    pub fn from(&self) -> &DVector<f64> {
        if self.span == 0.0 {
            self.state()
        } else if self.implicit {
            self.radau.from()
        } else {
            &self.last.from
        }
    }

    /// Fraction of the last step, in [0, 1], after which the time is `t`; None outside the step. Time is the
    /// component number `time` of the state. It is taken from the states at both ends of the step: their difference
    /// equals the length of the step only up to rounding, and a moment just after the start could otherwise lie
    /// before it.
    pub fn fraction(&self, time: usize, t: f64) -> Option<f64> {
        let (from, to) = (self.from()[time], self.state()[time]);
        let inside = from < to && (from..=to).contains(&t);
        inside.then(|| (t - from) / (to - from))
    }

    /// Length of the last step; 0 before the first.
    pub fn span(&self) -> f64 {
        self.span
    }

    /// Length of the next trial step.
    pub fn next_step(&self) -> f64 {
        if self.implicit {
            self.radau.next_step()
        } else {
            self.explicit.next_step()
        }
    }

    /// The method of the last step, never `Auto`.
    pub fn method_now(&self) -> Method {
        if self.implicit {
            Method::Implicit
        } else {
            Method::Explicit
        }
    }

    /// State at the fraction `x` in [0, 1] of the last step; None on failure. DOP853 builds its interpolant of order
    /// 7 when first asked (3 slopes). Near its limit of stability, where the interpolant is poor, it repeats the step
    /// at the needed length (12 slopes). The collocation polynomial of Radau is of order 3, 5 or 7, far too poor.
    /// Slopes at the ends are too noisy for a better polynomial in a stiff system. The state then comes from a
    /// separate step, as accurate as the others, at the cost of new factors and an iteration or two.
    pub fn at(&mut self, system: &dyn AnySystem, x: f64) -> Option<DVector<f64>> {
        if self.span == 0.0 || x == 1.0 {
            return Some(self.state().clone());
        }
        if x == 0.0 {
            return Some(self.from().clone());
        }
        if self.implicit {
            return self.radau.state_by_step(system, x);
        }
        let f = |y: &DVector<f64>| {
            let mut out = DVector::zeros(y.len());
            system.slope(y, &mut out)?;
            Some(out)
        };
        let norm = |e: &_, from: &_, to: &_| system.mean_square(e, from, to);
        if self.last.stiffness(norm).is_some_and(|size| size > POOR) {
            let h = x * self.span;
            return Some(self.last.redo(f, h, self.explicit.cost_mut())?.to);
        }
        if self.dense.is_none() {
            self.dense = self.last.dense(f, self.explicit.cost_mut());
        }
        Some(self.dense.as_ref()?.at(x))
    }

    /// Cost counters.
    pub fn cost(&self) -> Cost {
        let extra = Cost {
            evaluations: self.extra,
            switches: self.switches,
            ..Cost::default()
        };
        self.explicit.cost() + self.radau.cost() + extra
    }
}

/// A first step from the slope and its change along an Euler step (Hairer, Norsett, Wanner I, Sec. II.4).
fn first_guess(
    system: &dyn AnySystem,
    y: &DVector<f64>,
    slope: &DVector<f64>,
    tolerance: f64,
    implicit: bool,
) -> f64 {
    let size = |x: &DVector<f64>| system.mean_square(x, y, y).sqrt();
    let rate = size(slope);
    let (bound, power) = if implicit {
        (estimate_bound(tolerance), 0.25)
    } else {
        (tolerance, 0.125)
    };
    let short = if rate > 1e-10 { 0.01 / rate } else { 1e-6 };
    let mut there = slope.clone();
    let change = match system.slope(&(y + short * slope), &mut there) {
        Some(()) => size(&(there - slope)) / short,
        None => rate,
    };
    let fastest = change.sqrt().max(rate);
    if fastest > 1e-10 {
        (bound.powf(power) / fastest).min(100.0 * short)
    } else {
        short
    }
}
