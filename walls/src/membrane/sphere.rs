//! Spherical membranes: p-V curve in closed form, and motion under a step of the pressure.
//!
//! With x the stretch and W(x) the energy per unloaded volume, in units of R0 and the thickness d,
//! ```text
//! p = W'(x)/x^2,   V = (4/3) pi x^3,   U = 4 pi W,   x'^2/2 + W(x) - p (x^3 - 1)/3 = E,
//! ```
//! in the time sqrt(rho R0^2): the membrane has the mass 4 pi R0^2 rho d. The neo-Hookean sphere has p = 4 C (x^-1 -
//! x^-7).

use super::{InflatedState, Rubber};
use snaprod_core::math::gauss::Rule;
use snaprod_core::solve::roots::chandrupatla;
use snaprod_core::{Error, Result};
use std::f64::consts::PI;

/// Stretch up to which a motion counts as bounded.
const BOUND: f64 = 1e3;

/// Equilibrium at a stretch, in units of R0 and d.
pub(super) fn state(rubber: &Rubber, x: f64) -> InflatedState {
    let at = rubber.at(x, x);
    InflatedState {
        stretch: x,
        // dW/dx is twice dW/dl1.
        pressure: 2.0 * at.stress[0] / (x * x),
        height: x,
        volume: 4.0 / 3.0 * PI * x.powi(3),
        edge_stretch: x,
        edge_angle: 0.0,
        energy: 4.0 * PI * at.energy,
    }
}

/// dp/dx, in units of R0 and d.
pub(super) fn slope(rubber: &Rubber, x: f64) -> f64 {
    let at = rubber.at(x, x);
    let [w11, w12, _] = at.moduli;
    2.0 * (w11 + w12) / (x * x) - 4.0 * at.stress[0] / x.powi(3)
}

/// Motion of a sphere that starts at rest and unstretched under a step of the pressure.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct StepResponse {
    /// Greatest stretch.
    pub amplitude: f64,
    /// Period, in sqrt(rho R0^2/C) where C is the unit of the energy.
    pub period: f64,
}

/// W(x) - p (x^3 - 1)/3: potential under the pressure p, in units of R0 and d.
fn potential(rubber: &Rubber, pressure: f64, x: f64) -> f64 {
    rubber.at(x, x).energy - pressure * (x * x * x - 1.0) / 3.0
}

/// Amplitude and period under a step to the pressure `pressure`, in units of R0, d and the energy; to 1e-12.
///
/// # Errors
/// A pressure <= 0; one under which the sphere grows without bound, which is named.
pub fn step_response(rubber: &Rubber, pressure: f64) -> Result<StepResponse> {
    if !(0.0 < pressure && pressure < f64::INFINITY) {
        return Err(Error::domain(format!(
            "the step of the pressure, p* = {pressure}, must be finite and > 0"
        )));
    }
    let off = |x: f64| potential(rubber, pressure, x);
    // The potential falls from 0 and returns to 0 at the amplitude.
    let mut low = 1.0 + 1e-9;
    let mut high = low;
    while high < BOUND && !(off(high) > 0.0) {
        low = high;
        high = 1.0 + (high - 1.0) * 1.05;
    }
    if !(off(high) > 0.0) {
        return Err(Error::domain(format!(
            "under the step p* = {pressure} the sphere grows without bound: it is above the dynamic snap"
        )));
    }
    let amplitude = chandrupatla(off, (low, off(low)), (high, off(high)), 0.0)
        .ok_or_else(|| Error::no_convergence("no amplitude was found"))?;
    // T = 2 int dx / sqrt(-2 V). With x = 1 + a sin^2(u) the ends are smooth, and so is V/((x - 1)(b - x)).
    let span = amplitude - 1.0;
    let rule = Rule::new(200);
    let quarter = 0.5 * PI;
    let nodes = rule.nodes.iter().zip(&rule.weights);
    let part = |(node, weight): (&f64, &f64)| {
        let (sin, cos) = (quarter * node).sin_cos();
        let x = 1.0 + span * sin * sin;
        let depth = -potential(rubber, pressure, x) / (span * sin * cos).powi(2);
        weight / (2.0 * depth).sqrt()
    };
    let period = 4.0 * quarter * nodes.map(part).sum::<f64>();
    Ok(StepResponse { amplitude, period })
}

/// A step of the pressure from rest that just makes the sphere snap, as a pressure and the stretch at which it hangs:
/// the first maximum of 3 W/(x^3 - 1). `None` for a sphere that does not snap.
pub fn dynamic_snap(rubber: &Rubber) -> Option<(f64, f64)> {
    // (x^3 - 1) W' - 3 x^2 W, of which the maximum is a root.
    let slope = |x: f64| {
        let at = rubber.at(x, x);
        (x * x * x - 1.0) * 2.0 * at.stress[0] - 3.0 * x * x * at.energy
    };
    let mut low = 1.05;
    while low < BOUND {
        let high = low * 1.01;
        if slope(low) > 0.0 && slope(high) <= 0.0 {
            let x = chandrupatla(slope, (low, slope(low)), (high, slope(high)), 0.0)?;
            return Some((3.0 * rubber.at(x, x).energy / (x * x * x - 1.0), x));
        }
        low = high;
    }
    None
}
