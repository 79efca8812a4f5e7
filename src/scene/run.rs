//! Settings of a run: duration, accuracy, time steps, landing rule, output times.

use crate::motion::LandingRule;
use crate::solve::integrator::Method;
use serde::Serialize;

/// Times closer than this part of the duration are identified. Conversion of units rounds, and a step may end this far
/// from its target.
const SAME_TIME: f64 = 3e-14;

/// Settings of a run: duration, accuracy, time steps, landing rule, output times.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct Run {
    /// Duration > 0.
    pub duration: f64,
    /// Relative tolerance of the time steps, in [1e-14, 1e-2]; default 1e-10, in space 1e-8.
    pub tolerance: f64,
    /// Kind of time steps: explicit or implicit; symmetric only without damping. In the plane without damping implicit
    /// steps are excluded. Default [`Method::Auto`].
    pub method: Method,
    /// In space: look for the spring and dashpot to which a uniform rod reduces exactly in longitudinal, twisting and
    /// shearing motions ([`Reduction`](crate::motion::reduction::Reduction)), and print them; default true.
    pub reduce: bool,
    /// Landing of a snapping rod; default [`LandingRule::Viscous`], the only rule with damping.
    pub landing: LandingRule,
    /// Bound on the number of whole runs (those that do not branch again) under [`LandingRule::All`], 1..=10000;
    /// default 64. Without effect under other landing rules.
    pub branches: usize,
    /// Number of equally spaced output times, both ends counted, 2..=10_000_000; default 400.
    pub samples: usize,
    /// Period between output times, if the scene gives a period in place of their number: the trajectory is a Poincaré
    /// section.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub strobe: Option<f64>,
    /// Number of time steps after which the run stops, 1..=1_000_000_000; default 10_000_000.
    pub max_steps: usize,
    /// Number of snaps before the run stops at the next one, 0..=1_000_000_000; default 100_000.
    pub max_snaps: usize,
}

impl Run {
    /// Time `t` of the motion in the scene's units, where `unit` is one unit of the motion. Output times and the end of
    /// the run come out exactly as the scene gives them, without the rounding of the conversion.
    pub(crate) fn output_time(&self, t: f64, unit: f64) -> f64 {
        let (told, last) = (t * unit, (self.samples - 1) as f64);
        let asked = self.duration * ((told / self.duration * last).round() / last);
        if (told - asked).abs() <= SAME_TIME * self.duration {
            asked
        } else {
            told
        }
    }
}
