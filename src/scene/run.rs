//! How long and how accurately a motion is followed, and what a snap does.

use crate::motion::LandingRule;
use crate::solve::integrator::Method;
use serde::Serialize;

/// Times nearer to each other, relative to the duration, are one: ways between units round, and steps end within this of where they are to.
const ONE: f64 = 3e-14;

/// How long, how accurately, and what a snap does.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct Run {
    /// Duration > 0.
    pub duration: f64,
    /// Tolerance of the time steps, relative, in [1e-14, 1e-2]; default 1e-10, in space
    /// 1e-8.
    pub tolerance: f64,
    /// How the run steps through time: explicitly or implicitly, without damping symmetrically too; in the plane without damping
    /// not implicitly; default [`Method::Auto`].
    pub method: Method,
    /// In space: whether the program looks for the spring and dashpot that a uniform rod exactly is in longitudinal, twisting
    /// and shearing motions ([`Reduction`](crate::motion::reduction::Reduction)), and prints them; default true.
    pub reduce: bool,
    /// Where a snapping rod lands; default [`LandingRule::Viscous`], and nothing else with damping.
    pub landing: LandingRule,
    /// Bound on the number of whole runs, those that do not branch again, under [`LandingRule::All`], 1..=10000; default 64. Without effect under the other landings.
    pub branches: usize,
    /// Number of equally spaced times, both ends counted, at which the motion is written,
    /// 2..=10_000_000; default 400.
    pub samples: usize,
    /// The period between those times, if the scene gives one in place of their number: the trajectory is a Poincaré section.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub strobe: Option<f64>,
    /// The run stops after so many steps, 1..=1_000_000_000; default 10_000_000.
    pub max_steps: usize,
    /// The run stops at the next snap after so many, 0..=1_000_000_000; default 100_000.
    pub max_snaps: usize,
}

impl Run {
    /// A time of the motion in the scene's units, of which `unit` is one of the motion's; even samples and the end of the run as they were asked for,
    /// which the way into units of the rod and back misses by rounding.
    pub(crate) fn told(&self, t: f64, unit: f64) -> f64 {
        let (told, last) = (t * unit, (self.samples - 1) as f64);
        let asked = self.duration * ((told / self.duration * last).round() / last);
        match (told - asked).abs() <= ONE * self.duration {
            true => asked,
            false => told,
        }
    }
}
