//! The rod at rest under a load on its mass.

use super::Equilibrium;
use crate::error::{Error, Message, Quantity, Result};
use crate::solve::roots::chandrupatla;
use nalgebra::Vector2;
use std::f64::consts::{FRAC_PI_2, PI};

/// The stable shape of the rod at rest under the dead load `load` on its mass, in units of EI/L^2; `None` is the straight
/// rod, of a load along it that pulls or does not push beyond Euler's pi^2/4.
///
/// The force of the rod on the mass is -load, so that lambda = |load|^(1/2) and alpha is the direction of -load: one
/// equation for p. Of its solutions the stable one leans to the side of the load and has no inflection, 0 < w < pi/2.
///
/// # Errors
/// A load that is not finite or has lambda beyond 340, that is 1.2e5 EI/L^2; a push along the rod beyond Euler's load, for it may buckle to either
/// side.
pub fn settled(load: &Vector2<f64>) -> Result<Option<Equilibrium>> {
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
    if load.y == 0.0 {
        if load.x < 0.0 && lambda > FRAC_PI_2 {
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
        return Ok(None);
    }
    if lambda == 0.0 {
        return Ok(None);
    }
    let at = |ln_p: f64| Equilibrium::from_lambda_p(lambda, ln_p.exp());
    let (mut low, high) = (LEAST_P.ln(), (lambda + MOST_P).ln());
    if lambda > FRAC_PI_2 {
        // Below this p the rod has an inflection.
        let beyond = |ln_p: f64| at(ln_p).map_or(f64::NAN, |e| e.w - FRAC_PI_2);
        let ends = ((low, beyond(low)), (high, beyond(high)));
        low = chandrupatla(beyond, ends.0, ends.1, 0.0).unwrap_or(low);
    }
    // From there on alpha falls from 0 towards -pi.
    let target = load.y.abs().atan2(load.x) - PI;
    let excess = |ln_p: f64| at(ln_p).map_or(f64::NAN, |e| e.alpha - target);
    let ends = ((low, excess(low)), (high, excess(high)));
    // Under a load that lies along the rod but for rounding the first shape without inflection is the one.
    let root = match ends.0.1 <= 0.0 && lambda > FRAC_PI_2 {
        true => Some(low),
        false => chandrupatla(excess, ends.0, ends.1, 0.0),
    };
    root.and_then(|ln_p| Equilibrium::from_lambda_p(lambda, ln_p.exp().copysign(load.y)).ok())
        .map(Some)
        .ok_or_else(|| {
            let words = Message::from("no shape at rest was found under the load ");
            Error::no_convergence(words.list(load.as_slice(), |_| Quantity::Force))
        })
}

/// Beyond it the chart serves only rods that are taut all along.
const LAMBDA_MOST: f64 = 340.0;
/// p of the slightest bend looked at, and by how much it exceeds lambda for a load along the rod to rounding.
const LEAST_P: f64 = 1e-150;
const MOST_P: f64 = 700.0;
