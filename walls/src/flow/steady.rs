//! Steady flows along a tube, choked ones among them, without friction; and the choked length of friction.
//!
//! The flow q = A u and the head H = u^2/2 + p/rho are the same along a tube without friction. With the speed index
//! S = u/c,
//!
//! ```text
//! (1 - S^2) c^2 A_x/A = -(p_e/rho)_x   in a tube whose wall is uniform.
//! ```
//!
//! The flow passes S = 1 at a greatest p_e, and comes back to S < 1 in an elastic jump, which loses head.

use super::{FlowLaw, FlowState, Place};
use snaprod_core::solve::roots::chandrupatla;
use snaprod_core::{Error, Result};
use snaprod_waves::law1d::{Law1d, Panels};

/// Side of choking.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Branch {
    /// Slower than waves.
    Slow,
    /// Faster than waves.
    Fast,
}

/// Flow and head of a steady flow, in the units of a tube of the density 1.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct SteadyFlow {
    /// Flow q.
    pub flow: f64,
    /// Head H, of the density 1.
    pub head: f64,
}

/// A choked flow over a place of greatest pressure outside, with its elastic jump.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct ChokedFlow {
    /// Before the jump.
    pub before: SteadyFlow,
    /// After the jump.
    pub after: SteadyFlow,
    /// Area at the throat.
    pub throat: f64,
    /// Place of the jump.
    pub jump: f64,
    /// Areas on the two sides of the jump.
    pub sides: [f64; 2],
}

impl SteadyFlow {
    /// The flow of a state at a place.
    pub fn of(law: &FlowLaw, place: &Place, state: FlowState) -> Self {
        Self {
            flow: state.area * state.velocity,
            head: 0.5 * state.velocity.powi(2) + pressure(law, place, state.area),
        }
    }

    /// The area of the flow q at which S = 1 at a place.
    pub fn critical_area(law: &FlowLaw, place: &Place, flow: f64) -> Option<f64> {
        let unit = place.stiffness.sqrt() * place.area;
        let off = |lam: f64| (flow / unit) - law.speed(lam);
        bracketed(law, law.middle(), &off).map(|lam| place.area / lam)
    }

    /// The area at a place, on a side of choking.
    ///
    /// # Errors
    /// A head that is too small for the flow at the place.
    pub fn area(&self, law: &FlowLaw, place: &Place, branch: Branch) -> Result<f64> {
        let missing = || {
            Error::unreachable(format!(
                "the head {} is too small for the flow {} where the pressure outside is {}: the flow is choked there",
                self.head, self.flow, place.outside
            ))
        };
        let throat = Self::critical_area(law, place, self.flow).ok_or_else(missing)?;
        let off =
            |area: f64| 0.5 * (self.flow / area).powi(2) + pressure(law, place, area) - self.head;
        let least = off(throat);
        if least.abs() <= 1e-14 * self.head.abs().max(1.0) {
            return Ok(throat);
        }
        if !(least < 0.0) {
            return Err(missing());
        }
        let factor: f64 = match branch {
            Branch::Slow => 1.1,
            Branch::Fast => 1.0 / 1.1,
        };
        let [low, high] = law.areas().map(|area| area * place.area);
        let (mut at, mut value, mut step) = (throat, least, factor);
        for _ in 0..200 {
            let next = (at * step).clamp(
                0.5 * (at + low),
                if high.is_finite() {
                    0.5 * (at + high)
                } else {
                    f64::MAX
                },
            );
            let there = off(next);
            if there >= 0.0 {
                return chandrupatla(off, (at, value), (next, there), 0.0).ok_or_else(missing);
            }
            (at, value) = (next, there);
            step *= factor;
        }
        Err(missing())
    }
}

/// Pressure inside.
fn pressure(law: &FlowLaw, place: &Place, area: f64) -> f64 {
    place.outside + place.stiffness * law.at(area / place.area).pressure
}

/// A zero of a function of lam, sought on both sides of `start`.
fn bracketed(law: &FlowLaw, start: f64, f: &dyn Fn(f64) -> f64) -> Option<f64> {
    let [low, high] = law.reach();
    let value = f(start);
    let (mut down, mut up) = ((start, value), (start, value));
    let mut step: f64 = 1.05;
    for _ in 0..100 {
        let at = (down.0 / step).max(0.5 * (down.0 + low));
        let there = f(at);
        if there * down.1 <= 0.0 {
            return chandrupatla(f, (at, there), down, 0.0);
        }
        down = (at, there);
        let at = (up.0 * step).min(0.5 * (up.0 + high));
        let there = f(at);
        if there * up.1 <= 0.0 {
            return chandrupatla(f, up, (at, there), 0.0);
        }
        up = (at, there);
        step *= 1.1;
    }
    None
}

/// Tube, throat and areas at the ends of a choked flow, of the density 1.
pub struct Throat<'t> {
    /// Wall law.
    pub law: &'t FlowLaw,
    /// Wall and surroundings along the tube.
    pub places: &'t dyn Fn(f64) -> Place,
    /// Place of the greatest pressure outside.
    pub at: f64,
    /// The ends of the tube.
    pub ends: [f64; 2],
    /// Areas at the ends.
    pub areas: [f64; 2],
}

impl Throat<'_> {
    /// The choked flow: the flow follows from the area at the first end and S = 1 at the throat, the jump from the
    /// area at the last end.
    ///
    /// # Errors
    /// Areas for which no flow is choked, or no jump stands between the throat and the last end.
    pub fn choked(&self) -> Result<ChokedFlow> {
        let place = |x: f64| (self.places)(x);
        let none = |what: &str| Error::unreachable(format!("no choked flow has {what}"));
        let (first, top, last) = (place(self.ends[0]), place(self.at), place(self.ends[1]));
        let critical = |flow: f64| {
            let area = SteadyFlow::critical_area(self.law, &top, flow).unwrap_or(f64::NAN);
            let velocity = flow / area;
            (
                SteadyFlow::of(self.law, &top, FlowState { area, velocity }),
                area,
            )
        };
        let entering = |flow: f64| {
            let area = self.areas[0];
            let velocity = flow / area;
            SteadyFlow::of(self.law, &first, FlowState { area, velocity })
        };
        let off = |flow: f64| critical(flow).0.head - entering(flow).head;
        // From small flows up to S = 1 at the first end.
        let unit = first.stiffness.sqrt() * first.area;
        let most = unit * self.law.speed(first.area / self.areas[0]);
        let ends = (1e-6 * most, 0.999_999 * most);
        let flow = chandrupatla(off, (ends.0, off(ends.0)), (ends.1, off(ends.1)), 0.0)
            .filter(|flow| flow.is_finite())
            .ok_or_else(|| none(&format!("the area {} at its first end", self.areas[0])))?;
        let (before, throat) = critical(flow);
        let area = self.areas[1];
        let velocity = flow / area;
        let after = SteadyFlow::of(self.law, &last, FlowState { area, velocity });
        let sides = |x: f64| -> Result<[f64; 2]> {
            let here = place(x);
            Ok([
                before.area(self.law, &here, Branch::Fast)?,
                after.area(self.law, &here, Branch::Slow)?,
            ])
        };
        let thrust = |x: f64, area: f64| {
            let here = place(x);
            let wall = self.law.at(area / here.area).thrust(area / here.area);
            flow * flow / area + here.area * here.stiffness * wall
        };
        let off =
            |x: f64| sides(x).map_or(f64::NAN, |[fast, slow]| thrust(x, slow) - thrust(x, fast));
        // Near the throat the head after the jump may be too small for any slow state.
        let steps: u32 = 400;
        let x = |k: u32| self.at + (self.ends[1] - self.at) * f64::from(k) / f64::from(steps);
        let mut last_found: Option<(f64, f64)> = None;
        for k in 1..=steps {
            let now = (x(k), off(x(k)));
            if let Some(from) = last_found.filter(|from| from.1 * now.1 <= 0.0) {
                let jump = chandrupatla(off, from, now, 0.0)
                    .ok_or_else(|| none("an elastic jump that was found"))?;
                return Ok(ChokedFlow {
                    before,
                    after,
                    throat,
                    jump,
                    sides: sides(jump)?,
                });
            }
            last_found = (!now.1.is_nan()).then_some(now);
        }
        Err(none(&format!("the area {} at its last end", self.areas[1])))
    }
}

/// The length over which friction b u|u|, per length and density, chokes a flow in a uniform tube, in the units of the
/// law: from the area `inlet` to S = 1,
///
/// ```text
/// x = integral of (c^2 - u^2) a^2/(b q^2) da.
/// ```
///
/// # Errors
/// An inlet at which the flow is not slower than waves.
pub fn choke_length(law: &FlowLaw, flow: f64, inlet: f64, friction: f64) -> Result<f64> {
    let place = Place {
        area: 1.0,
        stiffness: 1.0,
        outside: 0.0,
    };
    let throat = SteadyFlow::critical_area(law, &place, flow).filter(|throat| *throat < inlet);
    let throat = throat.ok_or_else(|| {
        Error::domain(format!(
            "the flow {flow} at the area {inlet} must be slower than waves: lower the flow"
        ))
    })?;
    let part = |area: f64| {
        let gap = area * law.at(area).slope - (flow / area).powi(2);
        gap * area * area / (friction * flow * flow)
    };
    Ok(Panels::default().integral(&part, &law.contacts(), throat, inlet))
}
