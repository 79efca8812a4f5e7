//! Two equal membranes on one vessel of liquid: liquid that one loses the other gains.
//!
//! With the volumes V1 + V2 = V of the liquid in both, the energy U(V1) + U(V - V1) has
//! ```text
//! p(V1) = p(V2)   in equilibrium,   p'(V1) + p'(V2) > 0   where it is stable.
//! ```
//! Equal volumes are always in equilibrium. They become unstable at the limit points of one membrane, where a branch of
//! unequal volumes leaves: pitchforks.

use super::{Inflated, InflatedState, LEAST_STRETCH, MOST_STRETCH};
use snaprod_core::solve::roots::chandrupatla;
use snaprod_core::{Error, Result};

/// Two equal membranes in equilibrium.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct PairState {
    /// The two membranes, the smaller one first.
    pub each: [InflatedState; 2],
    /// True if the energy is least at the held volume of liquid.
    pub stable: bool,
}

impl PairState {
    /// Volume in both.
    pub fn volume(&self) -> f64 {
        self.each[0].volume + self.each[1].volume
    }

    /// Energy of both.
    pub fn energy(&self) -> f64 {
        self.each[0].energy + self.each[1].energy
    }

    /// True if both are alike.
    pub fn is_even(&self) -> bool {
        self.each[0].stretch == self.each[1].stretch
    }
}

/// Part of the stretch by which the search for unequal volumes stays away from equal ones.
const ASIDE: f64 = 1e-5;

/// Equilibria of two membranes like `membrane` at which branches of unequal volumes leave the branch of equal ones, by
/// growing volume.
///
/// # Errors
/// As [`Inflated::limit_points`].
pub fn pitchforks(membrane: &Inflated) -> Result<Vec<PairState>> {
    let points = membrane.limit_points()?.into_iter();
    let state = |at| PairState {
        each: [at; 2],
        stable: false,
    };
    Ok(points.map(state).collect())
}

/// All equilibria of two membranes like `membrane` that hold the volume `volume` together: the equal ones first, then
/// unequal ones by growing stretch of the smaller one. To 1e-10 of the stretches.
///
/// # Errors
/// A volume below that of both without load, or above that of both at the stretch 30.
pub fn at_volume(membrane: &Inflated, volume: f64) -> Result<Vec<PairState>> {
    let bounds = [1.0, MOST_STRETCH].map(|stretch| membrane.at_stretch(stretch));
    let [least, most] = bounds;
    let (least, most) = (least?.volume, most?.volume);
    if !(2.0 * least <= volume && volume <= 2.0 * most) {
        return Err(Error::domain(format!(
            "the volume {volume} of two membranes must lie between {} and {}, those at the stretches 1 and {MOST_STRETCH}",
            2.0 * least,
            2.0 * most
        )));
    }
    let with = |own: f64| -> Result<InflatedState> {
        let off = |x: f64| {
            membrane
                .at_stretch(x)
                .map_or(f64::NAN, |at| at.volume - own)
        };
        let ends = [(1.0, least - own), (MOST_STRETCH, most - own)];
        let found = chandrupatla(off, ends[0], ends[1], 0.0);
        let none = || Error::no_convergence(format!("no membrane was found with the volume {own}"));
        membrane.at_stretch(found.ok_or_else(none)?)
    };
    let rate = |at: &InflatedState| -> Result<f64> {
        let wider = membrane.difference(at.stretch, &|at| at.volume)?;
        Ok(membrane.slope(at.stretch)? / wider)
    };
    let state = |each: [InflatedState; 2]| -> Result<PairState> {
        let stable = rate(&each[0])? + rate(&each[1])? > 0.0;
        Ok(PairState { each, stable })
    };
    let even = with(0.5 * volume)?;
    let mut found = vec![state([even; 2])?];
    // Difference of the pressures over that of the volumes: equal volumes are no root.
    let split = |x: f64| -> Result<f64> {
        let small = membrane.at_stretch(x)?;
        let large = with(volume - small.volume)?;
        Ok((large.pressure - small.pressure) / (large.volume - small.volume))
    };
    // The smaller one, from where the larger one is at its bound.
    let from = if volume - most > least {
        with(volume - most)?.stretch
    } else {
        1.0
    };
    let to = even.stretch * (1.0 - ASIDE);
    if !(from < to) || to < LEAST_STRETCH {
        return Ok(found);
    }
    for stretch in membrane.roots(&split, from, to)? {
        let small = membrane.at_stretch(stretch)?;
        found.push(state([small, with(volume - small.volume)?])?);
    }
    Ok(found)
}
