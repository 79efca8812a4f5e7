//! Flat discs with a held edge: one initial-value problem for each stretch at the pole, without a search for a root.
//!
//! R is the radius in the unloaded disc, and ' = d/dR. The stretches along meridian and parallel are l1 and l2 = r/R,
//! the tensions N = dW/dl. The meridian falls by the angle b:
//! ```text
//! H = R N1 cos b,   R N1 sin b = p r^2/2,   r' = l1 cos b,   z' = -l1 sin b,   H' = N2 - p r l1 sin b.
//! ```
//! The equations have no length of their own: they are integrated with p = 1 from the pole to the parallel with l2 = 1,
//! which is the edge. Its R is the pressure p R0/d. The independent variable is ln R, in which the pole is regular.

use super::{InflatedState, Rubber};
use nalgebra::{SVector, Vector2};
use snaprod_core::solve::dop853::Dop853;
use snaprod_core::solve::roots::chandrupatla;
use snaprod_core::{Error, Result};
use std::f64::consts::PI;

/// State: l2, H/R, then the drop of the meridian, the volume and the energy since the pole, and R.
type State = SVector<f64, 6>;
const HOOP: usize = 0;
const PULL: usize = 1;
const DROP: usize = 2;
const VOLUME: usize = 3;
const ENERGY: usize = 4;
const RADIUS: usize = 5;

/// Tolerance of the integration.
const TOLERANCE: f64 = 1e-13;
/// First R over the radius of curvature at the pole: the series there is of second order.
const FIRST: f64 = 2e-4;
const STEPS: usize = 2000;

/// Meridional stretch l1 and the sine and cosine of b; `None` where no l1 bears the tension.
fn meridian(rubber: &Rubber, state: &State, guess: f64) -> Option<(f64, Vector2<f64>)> {
    let (l2, radius) = (state[HOOP], state[RADIUS]);
    let force = Vector2::new(0.5 * l2 * l2 * radius, state[PULL]);
    let tension = force.norm();
    let mut l1 = guess;
    for _ in 0..50 {
        let at = rubber.at(l1, l2);
        let change = (at.stress[0] - tension) / at.moduli[0];
        // A stretch stays positive.
        l1 = (l1 - change).max(0.5 * l1);
        if !l1.is_finite() {
            return None;
        }
        if change.abs() < 1e-15 * l1 || change.abs() < 1e-9 * l1 && at.moduli[0] > 0.0 {
            // One step of Newton's method more than this is below rounding.
            let at = rubber.at(l1, l2);
            return Some((
                l1 - (at.stress[0] - tension) / at.moduli[0],
                force / tension,
            ));
        }
    }
    None
}

/// Derivative of the state by ln R.
fn rate(rubber: &Rubber, state: &State, guess: f64) -> Option<(State, f64)> {
    let (l2, radius) = (state[HOOP], state[RADIUS]);
    let (l1, direction) = meridian(rubber, state, guess)?;
    let (sin, cos) = (direction[0], direction[1]);
    let at = rubber.at(l1, l2);
    let place = l2 * radius;
    Some((
        State::from([
            l1 * cos - l2,
            at.stress[1] - place * l1 * sin - state[PULL],
            radius * l1 * sin,
            // The volume below the surface and above the plane of this parallel grows by its area times the drop.
            PI * place * place * radius * l1 * sin,
            2.0 * PI * radius * radius * at.energy,
            radius,
        ]),
        l1,
    ))
}

/// The state near the pole, to second order in R.
fn near_pole(rubber: &Rubber, l0: f64) -> State {
    let at = rubber.at(l0, l0);
    let [w11, w12, _] = at.moduli;
    let tension = at.stress[0];
    // Curvature of the meridian over R, from p r = 2 N sin(b)/l2 at the pole.
    let curvature = l0 * l0 / (2.0 * tension);
    let square = curvature * curvature;
    let hoop = -square * (tension + l0 * (3.0 * w11 - w12)) / (16.0 * w11);
    let along = 3.0 * hoop + 0.5 * l0 * square;
    let pull = w11 * along + w12 * hoop - 0.5 * tension * square;
    let radius = FIRST / curvature;
    let r2 = radius * radius;
    let drop = 0.5 * l0 * curvature * r2;
    State::from([
        l0 + hoop * r2,
        tension + pull * r2,
        drop,
        0.5 * PI * l0 * l0 * r2 * drop,
        PI * r2 * at.energy,
        radius,
    ])
}

/// Equilibrium with the stretch `l0` at the pole, in units of R0 and d.
pub(super) fn state(rubber: &Rubber, l0: f64) -> Result<InflatedState> {
    follow(rubber, l0, 1.0, &mut |_| {})
}

/// Places [r, z] of the meridian from the pole to the edge, in units of R0; z is 0 at the edge.
pub(super) fn meridian_places(rubber: &Rubber, l0: f64) -> Result<Vec<[f64; 2]>> {
    let mut states = Vec::new();
    let edge = follow(rubber, l0, 0.1, &mut |state| states.push(*state))?;
    if states.is_empty() {
        return Ok(vec![[0.0, 0.0], [1.0, 0.0]]);
    }
    let radius = edge.pressure;
    // Near the pole the states are closer to each other than a figure shows.
    states.retain(|state| state[RADIUS] > 0.01 * radius);
    let place = |state: &State| {
        [
            state[HOOP] * state[RADIUS] / radius,
            edge.height - state[DROP] / radius,
        ]
    };
    let mut places = vec![[0.0, edge.height]];
    places.extend(states.iter().map(place));
    places.push([1.0, 0.0]);
    Ok(places)
}

/// Integrates from the pole to the edge with steps in ln R of at most `longest`, and shows the state after each step
/// inside the edge.
fn follow(
    rubber: &Rubber,
    l0: f64,
    longest: f64,
    see: &mut dyn FnMut(&State),
) -> Result<InflatedState> {
    if l0 == 1.0 {
        return Ok(InflatedState {
            stretch: 1.0,
            pressure: 0.0,
            height: 0.0,
            volume: 0.0,
            edge_stretch: 1.0,
            edge_angle: 0.0,
            energy: 0.0,
        });
    }
    let failed = |why: &str| {
        Error::no_convergence(format!(
            "no equilibrium of the disc was found at the stretch {l0} of its pole: {why}"
        ))
    };
    let mut guess = l0;
    let mut slope = |state: &State| {
        let (rate, l1) = rate(rubber, state, guess)?;
        guess = l1;
        Some(rate)
    };
    let start = near_pole(rubber, l0);
    let first = slope(&start).ok_or_else(|| failed("the pole bears no tension"))?;
    let mut run = Dop853::new(start, first, 0.1, TOLERANCE);
    for _ in 0..STEPS {
        let step = (run.step(&mut slope, longest))
            .map_err(|_| failed("no stretch of the meridian bears its tension"))?;
        if !(step.to[HOOP] <= 1.0) {
            see(&step.to);
            continue;
        }
        let mut cost = run.cost();
        let redone = |h: f64, slope: &mut dyn FnMut(&State) -> Option<State>, cost: &mut _| {
            step.redo(|state: &State| slope(state), h, cost)
                .map(|step| step.to)
        };
        let off =
            |h: f64| redone(h, &mut slope, &mut cost).map_or(f64::NAN, |state| state[HOOP] - 1.0);
        let (from, to) = (step.from[HOOP] - 1.0, step.to[HOOP] - 1.0);
        let h =
            chandrupatla(off, (0.0, from), (step.h, to), 0.0).ok_or_else(|| failed("no edge"))?;
        let edge = redone(h, &mut slope, &mut run.cost()).ok_or_else(|| failed("no edge"))?;
        let (edge_stretch, direction) =
            meridian(rubber, &edge, guess).ok_or_else(|| failed("no edge"))?;
        let radius = edge[RADIUS];
        return Ok(InflatedState {
            stretch: l0,
            pressure: radius,
            height: edge[DROP] / radius,
            volume: edge[VOLUME] / radius.powi(3),
            edge_stretch,
            edge_angle: direction[0].atan2(direction[1]),
            energy: edge[ENERGY] / radius.powi(2),
        });
    }
    Err(failed("the hoop stretch stays above 1"))
}
