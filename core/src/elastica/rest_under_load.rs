//! Rod at rest under a dead load on its mass.

use super::{Elastica, Equilibrium, LightRod, straight_chart};
use crate::error::{Error, Message, Quantity, Result};
use crate::manifold::{DeflectionState, EquilibriumManifold, FirstOrderInertia};
use crate::math::frame::Frame;
use crate::solve::roots::chandrupatla;
use nalgebra::{Matrix2, Vector2};
use std::f64::consts::FRAC_PI_2;

/// Stable shape of the rod at rest under the dead load `load` on its mass, in units of EI/L^2. `None` is the straight
/// rod: the load lies along it and pulls, or pushes with less than Euler's pi^2/4.
///
/// The force of the rod on the mass is -load, so that lambda = |load|^(1/2) and alpha is the direction of -load: one
/// equation for p. The stable solution leans to the side of the load and has no inflection, 0 < w < pi/2.
///
/// # Errors
/// A load that is not finite, or has lambda beyond 340, that is a size beyond 1.2e5 EI/L^2; a push along the rod beyond
/// Euler's load, under which the rod may buckle to either side.
pub fn equilibrium_under_load(load: &Vector2<f64>) -> Result<Option<Equilibrium>> {
    let lambda = load.norm().sqrt();
    if !(lambda <= LAMBDA_MOST) {
        return Err(Error::domain(
            Message::from("the load ")
                .list(load.as_slice(), |_| Quantity::Force)
                .words(" must be finite, and below ")
                .number(LAMBDA_MOST * LAMBDA_MOST, Quantity::Force)
                .words(" in size"),
        ));
    }
    let buckles = load.x < 0.0 && lambda > FRAC_PI_2;
    if load.y == 0.0 && buckles {
        return Err(Error::ambiguous(
            Message::from("the load pushes the straight rod with ")
                .number(-load.x, Quantity::Force)
                .words(", beyond Euler's load, (pi^2/4) EI/L^2 = ")
                .number(FRAC_PI_2 * FRAC_PI_2, Quantity::Force)
                .words(
                    ": it buckles to either side; add a small load across the rod, or tilt the clamp a little, to choose one",
                ),
        ));
    }
    // Directions of loads are known to rounding. Beyond Euler's load the rounding error selects the side to which the
    // rod buckles.
    if (load.y.abs() <= ALONG * load.x.abs() && !buckles) || lambda == 0.0 {
        return Ok(None);
    }
    let bent = |p: f64| Equilibrium::from_lambda_p(lambda, p.copysign(load.y));
    if let Some(p) = straight_chart::modulus_under_pull(load) {
        return bent(p).map(Some);
    }
    let at = |ln_p: f64| Equilibrium::from_lambda_p(lambda, ln_p.exp());
    let (mut low, high) = (LEAST_P.ln(), (lambda + MOST_P).ln());
    if lambda > FRAC_PI_2 {
        // Smaller p give shapes with an inflection.
        let beyond = |ln_p: f64| at(ln_p).map_or(f64::NAN, |e| e.w - FRAC_PI_2);
        let ends = ((low, beyond(low)), (high, beyond(high)));
        low = chandrupatla(beyond, ends.0, ends.1, 0.0).unwrap_or(low);
    }
    // Above `low` alpha falls from 0 towards -pi.
    let target = -load.y.abs().atan2(-load.x);
    let excess = |ln_p: f64| at(ln_p).map_or(f64::NAN, |e| e.alpha - target);
    let ends = ((low, excess(low)), (high, excess(high)));
    // For a load along the rod up to rounding, the solution is the first shape without inflection.
    let root = if ends.0.1 <= 0.0 && lambda > FRAC_PI_2 {
        Some(low)
    } else {
        chandrupatla(excess, ends.0, ends.1, 0.0)
    };
    root.and_then(|ln_p| bent(ln_p.exp()).ok())
        .map(Some)
        .ok_or_else(|| {
            let words = Message::from("no shape at rest was found under the load ");
            Error::no_convergence(words.list(load.as_slice(), |_| Quantity::Force))
        })
}

/// Stable shape of the rod at rest under `load` on its mass and its own weight, to first order in the weight, as in
/// motions of a [`LightRod`]. `load` is along the axes of the clamp. `frame` is the clamp in the world; `None` stands
/// for a clamp at the origin, along the axes of the world.
///
/// Near the straight rod only the weight across it counts. The weight is ignored where motions do not account for the
/// rod's mass, as under a strong pull.
///
/// # Errors
/// As [`equilibrium_under_load`]; no convergence, for rods that are not light.
pub fn equilibrium_under_load_and_weight(
    rod: &LightRod,
    frame: Option<&Frame<2>>,
    load: &Vector2<f64>,
) -> Result<Option<Equilibrium>> {
    let none = Vector2::zeros();
    let felt = |total: &Vector2<f64>| -> Result<Option<Vector2<f64>>> {
        let Some(at) = equilibrium_under_load(total)? else {
            return Ok(None);
        };
        let q = Vector2::new(at.p, at.w);
        if !(rod.validity_margin(&q, &none, false) > 0.0) {
            return Ok(None);
        }
        let Some(point) = Elastica.point(&q) else {
            return Ok(None);
        };
        let felt = rod.end_inertia(frame, [&q, &none], &point, f64::EPSILON);
        Ok(felt.map(|felt| load + felt.force))
    };
    let weight = frame.map_or(rod.gravity, |frame| frame.inward(&rod.gravity)) * rod.mass;
    let mut total = load + weight * WEIGHT_AT_END;
    let slack = equilibrium_under_load(&total)?.map_or(0.0, |at| at.one_minus_x);
    if slack < BEAM_REQUIRED_BELOW {
        return slightly_bent(rod, frame, load);
    }
    let mut last = f64::INFINITY;
    for _ in 0..STEPS {
        let Some(there) = felt(&total)? else {
            return equilibrium_under_load(load);
        };
        let size = total.norm();
        let mut slope = Matrix2::identity();
        for i in 0..2 {
            let mut aside = total;
            aside[i] += DIFFERENCE * size;
            // At the edge of the range in which the mass is followed the weight is kept constant.
            let beside = felt(&aside)?.unwrap_or(there);
            let column = slope.column(i) - (beside - there) / (DIFFERENCE * size);
            slope.set_column(i, &column);
        }
        let Some(step) = slope.lu().solve(&(there - total)) else {
            break;
        };
        total += step;
        // For slightly bent rods the weight's force is noisy, and steps stop falling.
        let step = step.norm() / size;
        if step <= ROUNDING || (step <= NOISE && step >= 0.5 * last) {
            return equilibrium_under_load(&total);
        }
        last = step;
    }
    if slack < SLIGHT {
        slightly_bent(rod, frame, load)
    } else {
        Err(not_found_error())
    }
}

/// Rest shape of a nearly straight rod: the weight across it changes with the deflection, the pull is that of the
/// load.
fn slightly_bent(
    rod: &LightRod,
    frame: Option<&Frame<2>>,
    load: &Vector2<f64>,
) -> Result<Option<Equilibrium>> {
    let mut total = *load;
    for _ in 0..STEPS {
        let at = equilibrium_under_load(&total)?;
        let deflected = DeflectionState {
            pull: load.x,
            tightening: 0.0,
            height: at.map_or(0.0, |at| at.y),
            speed: 0.0,
        };
        let Some(felt) = rod.deflection_inertia(frame, &deflected) else {
            return equilibrium_under_load(load);
        };
        let next = load.y + felt.force;
        if (next - total.y).abs() <= ROUNDING * next.abs() {
            return Ok(at);
        }
        total.y = next;
    }
    Err(not_found_error())
}

fn not_found_error() -> Error {
    Error::no_convergence(
        "no shape at rest of the rod with its weight, felt to first order, was found: write inertia = \"full\" in [rod]",
    )
}

/// Fraction of a cantilever's weight that, concentrated at the end, deflects the end as far: 3/8.
const WEIGHT_AT_END: f64 = 0.375;
/// Newton's method: most steps, and in parts of the load the finite difference, the step that counts as rounding, and
/// the largest step due to noise.
const STEPS: usize = 40;
const DIFFERENCE: f64 = 1e-4;
const ROUNDING: f64 = 1e-12;
const NOISE: f64 = 1e-7;
/// 1 - x below which the model of the nearly straight rod is the fallback (its error is of order 1 - x), and below
/// which it is required: the general inertia drowns in rounding.
const SLIGHT: f64 = 1e-5;
const BEAM_REQUIRED_BELOW: f64 = 1e-8;
/// Ratio of cross load to axial load below which the load lies along the rod.
const ALONG: f64 = 4.0 * f64::EPSILON;
/// Largest lambda: for stronger loads the chart serves only rods that are taut all along.
const LAMBDA_MOST: f64 = 340.0;
/// Least p of the search, and the excess of its largest p over lambda, enough for loads along the rod to rounding.
const LEAST_P: f64 = 1e-150;
const MOST_P: f64 = 700.0;
