//! The lumped Starling resistor: a collapsible part between two rigid tubes, as one area (docs/tubes.md 6).
//!
//! In the units of the wall law, with F(a) = Phi the pressure inside less outside, and E that outside,
//!
//! ```text
//! l1 Q1' = Pu - r1 Q1 - F(a) - E - Q1|Q1|/(2 a^2),   lam a' = Q1 - Q2,
//! l2 Q2' = F(a) + E + (1 - chi) Q2|Q2|/(2 a^2) - r2 Q2 - Pd.
//! ```
//!
//! With chi = 1 an equilibrium loses its stability where S = u/c is above 1 alone, to a limit cycle.

use super::FlowLaw;
use nalgebra::{Matrix3, Vector3, Vector4};
use snaprod_core::error::{Cause, Error, Result, Stuck};
use snaprod_core::solve::cost::Cost;
use snaprod_core::solve::dop853::Dop853;
use snaprod_core::solve::roots::chandrupatla;

/// Relative tolerance of the steps.
const TOLERANCE: f64 = 1e-13;
/// Largest relative difference of two maxima that count as equal, and least relative amplitude of a cycle.
const EQUAL: f64 = 1e-9;
const LEAST: f64 = 1e-6;
/// Largest number of maxima in a period.
const LONGEST: usize = 16;

/// A Starling resistor.
#[derive(Debug, Clone)]
pub struct Starling {
    /// Wall law of the collapsible part.
    pub law: FlowLaw,
    /// Inertances l1, l2.
    pub inertance: [f64; 2],
    /// Resistances r1, r2.
    pub resistance: [f64; 2],
    /// Volume of the collapsible part over its area, lam.
    pub volume: f64,
    /// Part chi of the dynamic pressure that is lost behind the collapsible part.
    pub loss: f64,
    /// Pressure E outside.
    pub outside: f64,
    /// Pressures Pu and Pd at the ends.
    pub pressure: [f64; 2],
}

/// Flows Q1, Q2 and area a.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct StarlingState {
    /// Flow Q1 into the collapsible part.
    pub inflow: f64,
    /// Area a.
    pub area: f64,
    /// Flow Q2 out of it.
    pub outflow: f64,
}

/// A limit cycle.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Cycle {
    /// Period.
    pub period: f64,
    /// Maxima of the area in a period.
    pub lag: usize,
    /// Least area.
    pub min: f64,
    /// Greatest area.
    pub max: f64,
}

/// A point of Hopf's bifurcation in Pu.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct HopfPoint {
    /// Pressure Pu upstream.
    pub pressure: f64,
    /// The equilibrium.
    pub state: StarlingState,
    /// Period 2 pi/omega of the small cycles at the Hopf point.
    pub period: f64,
}

impl StarlingState {
    fn of(y: &Vector4<f64>) -> Self {
        Self {
            inflow: y[0],
            area: y[1],
            outflow: y[2],
        }
    }
}

impl Starling {
    /// Rates of Q1, a, Q2; `None` outside of the areas of the law.
    fn rates(&self, y: &Vector4<f64>) -> Option<Vector4<f64>> {
        let (inflow, area, outflow) = (y[0], y[1], y[2]);
        self.law.check(area).ok()?;
        let inside = self.law.at(area).pressure + self.outside;
        let dynamic = |flow: f64| 0.5 * flow * flow.abs() / (area * area);
        let first = self.pressure[0] - self.resistance[0] * inflow - inside - dynamic(inflow);
        let last = inside + (1.0 - self.loss) * dynamic(outflow)
            - self.resistance[1] * outflow
            - self.pressure[1];
        Some(Vector4::new(
            first / self.inertance[0],
            (inflow - outflow) / self.volume,
            last / self.inertance[1],
            1.0,
        ))
    }

    /// Derivative of the rates of Q1, a, Q2.
    fn jacobian(&self, at: StarlingState) -> Matrix3<f64> {
        let (a, slope) = (at.area, self.law.at(at.area).slope);
        let (p, q) = (at.inflow, at.outflow);
        let [l1, l2] = self.inertance;
        let kept = 1.0 - self.loss;
        Matrix3::new(
            (-self.resistance[0] - p.abs() / (a * a)) / l1,
            (-slope + p * p.abs() / a.powi(3)) / l1,
            0.0,
            1.0 / self.volume,
            0.0,
            -1.0 / self.volume,
            0.0,
            (slope - kept * q * q.abs() / a.powi(3)) / l2,
            (kept * q.abs() / (a * a) - self.resistance[1]) / l2,
        )
    }

    /// The equilibrium of the least flow.
    ///
    /// # Errors
    /// Pressures without an equilibrium.
    pub fn equilibrium(&self) -> Result<StarlingState> {
        let none = || {
            Error::unreachable(format!(
                "the resistor has no equilibrium at Pu = {}, Pd = {}, E = {}",
                self.pressure[0], self.pressure[1], self.outside
            ))
        };
        // Without recovery the area follows from the flow; the flow is then a root, and recovery is added in parts.
        let drop = self.pressure[0] - self.pressure[1];
        let sign = drop.signum();
        let area = |flow: f64| {
            self.law
                .area(self.pressure[1] + self.resistance[1] * flow - self.outside)
        };
        let off = |size: f64| {
            let flow = sign * size;
            area(flow).map_or(f64::NAN, |a| {
                sign * (drop - (self.resistance[0] + self.resistance[1]) * flow)
                    - 0.5 * size * size / (a * a)
            })
        };
        let (mut at, mut value, mut step) = (0.0, off(0.0), 1e-3);
        let flow = loop {
            if value == 0.0 || drop == 0.0 {
                break at;
            }
            let next = at + step;
            let there = off(next);
            if !(there.is_finite() && next < 1e6) {
                return Err(none());
            }
            if there <= 0.0 {
                break chandrupatla(off, (at, value), (next, there), 0.0).ok_or_else(none)?;
            }
            (at, value, step) = (next, there, step * 1.1);
        };
        let flow = sign * flow;
        let mut state = StarlingState {
            inflow: flow,
            area: area(flow).ok_or_else(none)?,
            outflow: flow,
        };
        let parts: u32 = 20;
        for k in 1..=parts {
            let with = Self {
                loss: 1.0 - (1.0 - self.loss) * f64::from(k) / f64::from(parts),
                ..self.clone()
            };
            state = with.refined(state).ok_or_else(none)?;
            if self.loss == 1.0 {
                break;
            }
        }
        Ok(state)
    }

    /// Newton's iteration for an equilibrium.
    fn refined(&self, mut state: StarlingState) -> Option<StarlingState> {
        for _ in 0..50 {
            let y = Vector4::new(state.inflow, state.area, state.outflow, 0.0);
            let rates = self.rates(&y)?;
            let rates = Vector3::new(rates[0], rates[1], rates[2]);
            let change = self.jacobian(state).lu().solve(&rates)?;
            state.inflow -= change[0];
            state.area -= change[1];
            state.outflow -= change[2];
            if change.amax() <= 1e-15 * (1.0 + y.amax()) {
                break;
            }
        }
        (state.inflow.is_finite() && state.area > 0.0).then_some(state)
    }

    /// Speed index S = u/c of the collapsible part, with the velocity of the inflow.
    pub fn index(&self, at: StarlingState) -> f64 {
        at.inflow / at.area / self.law.wave_speed(at.area)
    }

    /// Eigenvalues \[real, imaginary\] of small motions about an equilibrium, by falling real part.
    pub fn eigenvalues(&self, at: StarlingState) -> [[f64; 2]; 3] {
        let found = self.jacobian(at).complex_eigenvalues();
        let mut all: [[f64; 2]; 3] = std::array::from_fn(|i| [found[i].re, found[i].im]);
        all.sort_by(|a, b| b[0].total_cmp(&a[0]).then(b[1].total_cmp(&a[1])));
        all
    }

    /// The first point of Hopf's bifurcation at a pressure Pu between `low` and `high`; `None` if there is none.
    ///
    /// # Errors
    /// Pressures without an equilibrium.
    pub fn hopf(&self, low: f64, high: f64) -> Result<Option<HopfPoint>> {
        let at = |pressure: f64| Self {
            pressure: [pressure, self.pressure[1]],
            ..self.clone()
        };
        // Of x^3 + b x^2 + c x + d a pair of roots is imaginary where b c = d, c > 0.
        let numbers = |pressure: f64| -> Result<[f64; 3]> {
            let with = at(pressure);
            let matrix = with.jacobian(with.equilibrium()?);
            let minors = |i: usize, j: usize| {
                matrix[(i, i)] * matrix[(j, j)] - matrix[(i, j)] * matrix[(j, i)]
            };
            Ok([
                -matrix.trace(),
                minors(0, 1) + minors(0, 2) + minors(1, 2),
                -matrix.determinant(),
            ])
        };
        let margin = |pressure: f64| numbers(pressure).map_or(f64::NAN, |[b, c, d]| b * c - d);
        let steps: u32 = 64;
        let value = |k: u32| low + (high - low) * f64::from(k) / f64::from(steps);
        let mut before = (low, numbers(low).map(|[b, c, d]| b * c - d)?);
        for k in 1..=steps {
            let now = (value(k), margin(value(k)));
            if before.1 * now.1 <= 0.0
                && let Some(pressure) = chandrupatla(margin, before, now, 0.0)
            {
                let [_, speed, _] = numbers(pressure)?;
                if speed > 0.0 {
                    return Ok(Some(HopfPoint {
                        pressure,
                        state: at(pressure).equilibrium()?,
                        period: std::f64::consts::TAU / speed.sqrt(),
                    }));
                }
            }
            before = now;
        }
        Ok(None)
    }

    /// A motion from a state.
    ///
    /// # Errors
    /// An area that the law does not have.
    pub fn motion(&self, start: StarlingState) -> Result<StarlingMotion<'_>> {
        self.law.check(start.area)?;
        let y = Vector4::new(start.inflow, start.area, start.outflow, 0.0);
        let slope = self.rates(&y).unwrap_or_default();
        Ok(StarlingMotion {
            resistor: self,
            run: Dop853::new(y, slope, 1e-3, TOLERANCE),
            time: 0.0,
            cost: Cost::default(),
            maxima: Vec::new(),
            minima: Vec::new(),
        })
    }
}

/// A resistor in motion.
pub struct StarlingMotion<'s> {
    resistor: &'s Starling,
    run: Dop853<Vector4<f64>>,
    time: f64,
    cost: Cost,
    /// \[t, a\] of the maxima and the minima of the area so far.
    maxima: Vec<[f64; 2]>,
    minima: Vec<[f64; 2]>,
}

impl StarlingMotion<'_> {
    /// The time.
    pub fn time(&self) -> f64 {
        self.time
    }

    /// The present state.
    pub fn state(&self) -> StarlingState {
        StarlingState::of(self.run.state())
    }

    /// Goes on until the time `until`, and keeps the extremes of the area on the way.
    ///
    /// # Errors
    /// The area leaves the law, or the steps collapse.
    pub fn advance(&mut self, until: f64) -> Result<(), Stuck> {
        let resistor = self.resistor;
        let f = |y: &Vector4<f64>| resistor.rates(y);
        while self.time < until {
            let (at, left) = (self.time, until - self.time);
            let step = self.run.step(f, left).map_err(|_| {
                let why = Error::no_convergence(
                    "the steps collapse: the collapsible part closes, or leaves its law",
                );
                Stuck::new(at, Cause::Failed(why), "check pressures and law")
            })?;
            self.time = if step.h >= left {
                until
            } else {
                self.run.state()[3]
            };
            let swelling = |y: &Vector4<f64>| y[0] - y[2];
            let (a, b) = (swelling(&step.from), swelling(&step.to));
            if a * b < 0.0 {
                let mut cost = std::mem::take(&mut self.cost);
                let off = |h: f64| {
                    step.redo(f, h, &mut cost)
                        .map_or(f64::NAN, |part| swelling(&part.to))
                };
                let found = chandrupatla(off, (0.0, a), (step.h, b), 0.0)
                    .and_then(|h| step.redo(f, h, &mut self.cost));
                if let Some(part) = found {
                    let list = if a > 0.0 {
                        &mut self.maxima
                    } else {
                        &mut self.minima
                    };
                    list.push([part.to[3], part.to[1]]);
                }
            }
        }
        Ok(())
    }

    /// The limit cycle that the motion has reached, if it has: the last maxima of the area repeat to 1e-9.
    pub fn cycle(&self) -> Option<Cycle> {
        let n = self.maxima.len();
        let recent = (0..=LONGEST).take_while(|lag| 3 * lag < n);
        let lag = recent.skip(1).find(|lag| {
            let same = |k: usize| {
                let [a, b] = [self.maxima[n - 1 - k][1], self.maxima[n - 1 - k - lag][1]];
                (a - b).abs() <= EQUAL * a
            };
            (0..2 * lag).all(same)
        })?;
        let heights = self.maxima[n - lag..].iter().map(|at| at[1]);
        let max = heights.fold(0.0, f64::max);
        let least = self.minima.len().checked_sub(lag)?;
        let min = self.minima[least..]
            .iter()
            .fold(f64::INFINITY, |min, at| min.min(at[1]));
        (max - min > LEAST * max).then(|| Cycle {
            period: self.maxima[n - 1][0] - self.maxima[n - 1 - lag][0],
            lag,
            min,
            max,
        })
    }
}
