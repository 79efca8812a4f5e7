//! One-sided Riemann problems at the ends of a tube (docs/tubes.md 5).
//!
//! Every end is seen as a left one: velocities and flows are positive into the tube. The wave from the end into the
//! state inside relates velocity and area at the end; the condition at the end is a second relation.

use super::face::Sided;
use super::riemann::Way;
use super::{FlowEnd, FlowState, FlowTube, Place, Reservoir};
use snaprod_core::solve::roots::chandrupatla;
use snaprod_core::{Error, Result};
use snaprod_waves::law1d::Law1d;

/// Factor of a step of the search for a bracket, at first.
const STEP: f64 = 1.05;

/// Time and pressure of the moment, and the flow through the rigid tube at the end.
#[derive(Debug, Clone, Copy)]
pub(super) struct EndNow {
    pub time: f64,
    /// Pressure outside at the end.
    pub outside: f64,
    /// Flow along +x in the rigid tube; of no meaning without inertance.
    pub flow: f64,
}

impl FlowTube {
    /// The state at the end `side` (0 left, 1 right) beside the state `inside`.
    ///
    /// # Errors
    /// A condition that no state fulfils.
    pub(super) fn end_state(
        &self,
        side: usize,
        place: &Place,
        inside: &Sided,
        now: EndNow,
    ) -> Result<Sided> {
        let sign = if side == 0 { 1.0 } else { -1.0 };
        let unit = self.unit_speed(place);
        let of = |state: FlowState| {
            let area = state.area * place.area;
            self.sided(place, area, sign * state.velocity * unit * area)
        };
        let ahead = FlowState {
            area: inside.area / place.area,
            velocity: sign * inside.velocity / unit,
        };
        self.law.check(ahead.area)?;
        let lam = match &self.ends[side] {
            FlowEnd::Open => return Ok(*inside),
            FlowEnd::Supercritical(given) => {
                let area = given.area * place.area;
                return Ok(self.sided(place, area, given.velocity * area));
            }
            FlowEnd::Closed => self.under_flow(ahead, 0.0),
            FlowEnd::Flow(history) => {
                self.under_flow(ahead, sign * history.at(now.time) / (unit * place.area))
            }
            FlowEnd::Reservoir(reservoir) if reservoir.inertance > 0.0 => {
                self.under_flow(ahead, sign * now.flow / (unit * place.area))
            }
            FlowEnd::Reservoir(reservoir) => {
                let pressure = reservoir.pressure.at(now.time);
                let head = (pressure - now.outside) / place.stiffness;
                let resistance = reservoir.resistance * unit * place.area / place.stiffness;
                self.under_head(ahead, head, resistance, reservoir.recovery)
            }
        };
        let lam = lam.ok_or_else(|| {
            let name = ["upstream", "downstream"][side];
            Error::unreachable(format!(
                "no state of the tube fulfils the condition at its {name} end, beside the area {} A0 and the velocity {}: \
                 compare its pressure with that outside; a ring without a thickness has no round states",
                ahead.area, inside.velocity
            ))
        })?;
        let star = FlowState {
            area: 1.0 / lam,
            velocity: ahead.velocity - self.law.velocity_jump(1.0 / ahead.area, lam).0,
        };
        let limited = matches!(&self.ends[side], FlowEnd::Reservoir(r) if r.inertance == 0.0)
            && star.velocity > self.law.wave_speed(star.area);
        if limited {
            // A reservoir without a nozzle feeds no flow faster than waves.
            let FlowEnd::Reservoir(reservoir) = &self.ends[side] else {
                return Ok(*inside);
            };
            let head = (reservoir.pressure.at(now.time) - now.outside) / place.stiffness;
            let resistance = reservoir.resistance * unit * place.area / place.stiffness;
            if let Some(state) = self.greatest_inflow(head, resistance) {
                return Ok(of(state));
            }
        }
        let waves = self.law.over_the_tube(ahead, star.area, Way::Right);
        let at = self.law.inside_wave(ahead, &waves, Way::Right, 0.0);
        Ok(of(at.unwrap_or(star)))
    }

    /// Rate of the flow in the rigid tube at the end `side` beside the state `at` of the end.
    pub(super) fn end_rate(&self, reservoir: &Reservoir, side: usize, at: EndPressure) -> f64 {
        let sign = if side == 0 { 1.0 } else { -1.0 };
        let inward = sign * at.flow;
        let regained = if inward > 0.0 {
            1.0
        } else {
            reservoir.recovery
        };
        let tube = at.pressure + regained * at.dynamic;
        sign * (at.reservoir - reservoir.resistance * inward - tube) / reservoir.inertance
    }

    /// lam = 1/a at an end with the inflow `flow`. Where so much cannot leave, the result lies past the choked state.
    fn under_flow(&self, ahead: FlowState, flow: f64) -> Option<f64> {
        let start = 1.0 / ahead.area;
        self.falling(start, &|lam| {
            (ahead.velocity - self.law.velocity_jump(start, lam).0) / lam - flow
        })
    }

    /// lam = 1/a at an end before a reservoir of the pressure `head` over that outside. Into the tube the dynamic
    /// pressure is won from the reservoir; out of it the part `recovery` is regained.
    fn under_head(
        &self,
        ahead: FlowState,
        head: f64,
        resistance: f64,
        recovery: f64,
    ) -> Option<f64> {
        let start = 1.0 / ahead.area;
        self.falling(start, &|lam| {
            let velocity = ahead.velocity - self.law.velocity_jump(start, lam).0;
            let part = if velocity > 0.0 { 1.0 } else { recovery };
            self.law.at(1.0 / lam).pressure
                + 0.5 * part * velocity * velocity
                + resistance * velocity / lam
                - head
        })
    }

    /// The greatest inflow from a reservoir: as fast as waves.
    fn greatest_inflow(&self, head: f64, resistance: f64) -> Option<FlowState> {
        let lam = self.falling(self.law.middle(), &|lam| {
            let speed = self.law.wave_speed(1.0 / lam);
            self.law.at(1.0 / lam).pressure + 0.5 * speed * speed + resistance * speed / lam - head
        })?;
        Some(FlowState {
            area: 1.0 / lam,
            velocity: self.law.wave_speed(1.0 / lam),
        })
    }

    /// Zero of the function `f` of lam, which falls. If it ceases to fall before it vanishes, as an outflow does past
    /// choking, the result is past the least value.
    fn falling(&self, start: f64, f: &dyn Fn(f64) -> f64) -> Option<f64> {
        let [low, high] = self.law.reach();
        let (mut at, mut value) = (start, f(start));
        let up = value > 0.0;
        let mut step = STEP;
        for _ in 0..200 {
            if value == 0.0 {
                return Some(at);
            }
            let next = if up {
                (at * step).min(0.5 * (at + high))
            } else {
                (at / step).max(0.5 * (at + low))
            };
            let there = f(next);
            if there.is_nan() {
                return None;
            }
            if (there > 0.0) != up {
                return chandrupatla(f, (at, value), (next, there), 0.0);
            }
            if up && there >= value {
                return Some(next);
            }
            (at, value) = (next, there);
            step *= 1.2;
        }
        None
    }
}

/// Pressures at an end.
#[derive(Debug, Clone, Copy)]
pub(super) struct EndPressure {
    /// Pressure inside the tube.
    pub pressure: f64,
    /// Dynamic pressure rho u^2/2.
    pub dynamic: f64,
    /// Pressure of the reservoir.
    pub reservoir: f64,
    /// Flow along +x.
    pub flow: f64,
}
