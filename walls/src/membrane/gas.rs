//! Gas behind a membrane: a content of gas in the membrane and a vessel, and its folds.
//!
//! The content is p V, absolute and at one temperature: (p + p_a)(V + V_r), with the pressure p_a outside and the
//! volume V_r of the vessel. Along the chart of the membrane it has extrema: folds in the pose, at which the membrane
//! snaps.

use super::{Inflated, InflatedState, LEAST_STRETCH, MOST_STRETCH};
use snaprod_core::solve::roots::chandrupatla;
use snaprod_core::{Error, Result};

/// A vessel that feeds a membrane with gas.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Vessel {
    /// Pressure p_a outside of the membrane.
    pub outside: f64,
    /// Volume V_r of the vessel.
    pub volume: f64,
}

impl Vessel {
    /// A vessel.
    ///
    /// # Errors
    /// A volume or a pressure below 0.
    pub fn new(outside: f64, volume: f64) -> Result<Self> {
        for (name, value) in [("outside pressure", outside), ("volume", volume)] {
            if !(0.0..f64::INFINITY).contains(&value) {
                return Err(Error::domain(format!(
                    "the {name} {value} of a vessel of gas must be finite and >= 0"
                )));
            }
        }
        Ok(Self { outside, volume })
    }

    /// Content p V of gas in the membrane and the vessel.
    pub fn contents(&self, state: &InflatedState) -> f64 {
        (state.pressure + self.outside) * (state.volume + self.volume)
    }

    /// dcontents/dstretch, by differences of order 6.
    ///
    /// # Errors
    /// A stretch at which the membrane has no equilibrium.
    pub fn slope(&self, membrane: &Inflated, stretch: f64) -> Result<f64> {
        membrane.difference(stretch, &|at| self.contents(at))
    }

    /// Extrema of the content along the chart between two stretches, by growing stretch: folds at which the membrane
    /// snaps when gas is added or taken.
    ///
    /// # Errors
    /// A stretch at which the membrane has no equilibrium.
    pub fn folds(&self, membrane: &Inflated, from: f64, to: f64) -> Result<Vec<InflatedState>> {
        let slope = |stretch| self.slope(membrane, stretch);
        let roots = membrane.roots(&slope, from.max(LEAST_STRETCH), to)?;
        roots
            .into_iter()
            .map(|stretch| membrane.at_stretch(stretch))
            .collect()
    }

    /// The first equilibrium with the content `contents`, on the way from the unloaded membrane.
    ///
    /// # Errors
    /// A content below that of the unloaded membrane, or above all up to the stretch 30.
    pub fn at_contents(&self, membrane: &Inflated, contents: f64) -> Result<InflatedState> {
        let mut before = membrane.at_stretch(1.0)?;
        let least = self.contents(&before);
        if !(least..f64::INFINITY).contains(&contents) {
            return Err(Error::domain(format!(
                "the content {contents} of gas must be finite and >= {least}, that of the unloaded membrane"
            )));
        }
        for stretch in membrane.search_stretches() {
            let at = membrane.at_stretch(stretch)?;
            if self.contents(&at) >= contents {
                let off = |x: f64| {
                    membrane
                        .at_stretch(x)
                        .map_or(f64::NAN, |at| self.contents(&at) - contents)
                };
                let from = (before.stretch, self.contents(&before) - contents);
                let to = (stretch, self.contents(&at) - contents);
                let x = chandrupatla(off, from, to, 0.0)
                    .ok_or_else(|| Error::no_convergence("no state with the content was found"))?;
                return membrane.at_stretch(x);
            }
            before = at;
        }
        Err(Error::domain(format!(
            "the content {contents} of gas is above all of this membrane up to the stretch {MOST_STRETCH}"
        )))
    }
}
