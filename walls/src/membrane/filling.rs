//! Fillings of a membrane in motion: a pressure that is given over time, or gas of a fixed content.
//!
//! Gas of the content c in the membrane and in a vessel of the volume V_r, with p_a outside, has
//! ```text
//! p = c/(V + V_r) - p_a,   G = p_a (V - V_0) - c ln((V + V_r)/(V_0 + V_r)),   dG = -p dV.
//! ```
//! G takes the place of the work of the pressure: kinetic + stored + G is constant.

use super::gas::Vessel;
use snaprod_core::math::history::History;
use snaprod_core::{Error, Result};

/// A pressure over time, or gas, in a membrane in motion.
#[derive(Debug, Clone, PartialEq)]
pub enum Filling {
    /// Pressure inside less outside, over time.
    Pressure(History),
    /// Gas in the membrane and a vessel.
    Gas {
        /// Content p V, absolute.
        contents: f64,
        /// The vessel.
        vessel: Vessel,
    },
}

impl From<History> for Filling {
    fn from(pressure: History) -> Self {
        Self::Pressure(pressure)
    }
}

impl Filling {
    /// Checks the numbers, for a membrane of the unloaded volume `volume`.
    pub(super) fn checked(self, volume: f64) -> Result<Self> {
        match self {
            Self::Pressure(history) => history.checked().map(Self::Pressure),
            Self::Gas { contents, vessel } => {
                if !(0.0 < contents && contents < f64::INFINITY) {
                    return Err(Error::domain(format!(
                        "the content {contents} of gas must be finite and > 0"
                    )));
                }
                if !(vessel.volume + volume > 0.0) {
                    return Err(Error::domain(
                        "gas in a flat disc needs a vessel: the volume of the vessel must be > 0",
                    ));
                }
                Ok(Self::Gas { contents, vessel })
            }
        }
    }

    /// True if the pressure does work on the membrane that is no change of the energy of a gas.
    pub(super) fn is_driven(&self) -> bool {
        matches!(self, Self::Pressure(_))
    }

    /// Pressure inside less outside.
    pub(super) fn pressure(&self, time: f64, volume: f64) -> f64 {
        match self {
            Self::Pressure(history) => history.at(time),
            Self::Gas { contents, vessel } => contents / (volume + vessel.volume) - vessel.outside,
        }
    }

    /// -dp/dV.
    pub(super) fn stiffness(&self, volume: f64) -> f64 {
        match self {
            Self::Pressure(_) => 0.0,
            Self::Gas { contents, vessel } => contents / (volume + vessel.volume).powi(2),
        }
    }

    /// Energy of the gas at `volume` less that at the volume `from`.
    pub(super) fn energy(&self, from: f64, volume: f64) -> f64 {
        match self {
            Self::Pressure(_) => 0.0,
            Self::Gas { contents, vessel } => {
                let wider = (volume - from) / (from + vessel.volume);
                vessel.outside * (volume - from) - contents * wider.ln_1p()
            }
        }
    }

    /// The first break of the pressure after `time`.
    pub(super) fn next_break(&self, time: f64) -> f64 {
        match self {
            Self::Pressure(history) => history.next_break(time),
            Self::Gas { .. } => f64::INFINITY,
        }
    }
}
