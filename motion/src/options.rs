//! Options of a run.

use super::LandingRule;
use snaprod_systems::error::{Error, Result};
use snaprod_systems::solve::integrator::Method;

pub use snaprod_systems::viscoelastic::resolution::Nodes;

/// Options of a run. Defaults: tolerance 1e-10, viscous landing, 1e7 steps, 1e5 snaps, method and nodes
/// chosen by the program.
///
/// An elastic rod has no nodes and ignores them. Its steps are explicit unless symmetric ones are asked for;
/// in space they are implicit where that pays or is asked for. A viscoelastic rod has no landings, since its
/// snaps are passages of finite duration, and no symmetric steps.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Options {
    /// End of time.
    pub duration: f64,
    /// Bound of the error, relative to 1 + size, of a smooth run of a few periods: in time, and along the rod
    /// if the rod has strains. The local error of a step is bounded by a tenth of it.
    pub tolerance: f64,
    /// Landing rule of snaps.
    pub landing: LandingRule,
    /// Explicit, implicit or symmetric steps.
    pub method: Method,
    /// Nodes along the rod.
    pub nodes: Nodes,
    /// Most steps.
    pub max_steps: u64,
    /// Most snaps.
    pub max_snaps: u64,
}

/// Bound of a step's local error, as a part of the tolerance. Errors of steps add up; their sum is then of the order of
/// the tolerance.
pub(crate) const LOCAL: f64 = 0.1;
/// Smallest local tolerance: below it errors drown in rounding.
pub(crate) const FINEST: f64 = 1e-14;

impl Options {
    /// Smallest tolerance of rods with strains: below it no room is left for the errors along the rod.
    pub const LEAST_WITH_STRAINS: f64 = 1e-13;

    /// Options with defaults, up to the time `duration`.
    ///
    /// # Errors
    /// A duration that is not positive and finite.
    pub fn new(duration: f64) -> Result<Self> {
        if !(0.0 < duration && duration < f64::INFINITY) {
            return Err(Error::domain(format!(
                "duration = {duration} must be finite and > 0"
            )));
        }
        Ok(Self {
            duration,
            tolerance: 1e-10,
            landing: LandingRule::Viscous,
            method: Method::Auto,
            nodes: Nodes::Adaptive,
            max_steps: 10_000_000,
            max_snaps: 100_000,
        })
    }

    /// Sets the tolerance.
    ///
    /// # Errors
    /// A tolerance outside [1e-14, 1e-2]. Rods with strains ask for at least [`Options::LEAST_WITH_STRAINS`].
    pub fn with_tolerance(mut self, tolerance: f64) -> Result<Self> {
        if !(1e-14..=1e-2).contains(&tolerance) {
            return Err(Error::domain(format!(
                "tolerance = {tolerance} must lie in [1e-14, 1e-2]"
            )));
        }
        self.tolerance = tolerance;
        Ok(self)
    }

    /// Bound of the local error of a step.
    pub(crate) fn local_tolerance(&self) -> f64 {
        (LOCAL * self.tolerance).max(FINEST)
    }

    /// # Errors
    /// A tolerance below [`Options::LEAST_WITH_STRAINS`]; `of` says of which rod.
    pub(crate) fn suits_strains(&self, of: &str) -> Result<()> {
        if self.tolerance >= Self::LEAST_WITH_STRAINS {
            return Ok(());
        }
        Err(Error::domain(format!(
            "tolerance = {} must lie in [1e-13, 1e-2] for a {of}",
            self.tolerance
        )))
    }

    /// Sets the landing rule.
    #[must_use]
    pub fn with_landing(mut self, landing: LandingRule) -> Self {
        self.landing = landing;
        self
    }

    /// Sets the method.
    #[must_use]
    pub fn with_method(mut self, method: Method) -> Self {
        self.method = method;
        self
    }

    /// Sets the nodes.
    #[must_use]
    pub fn with_nodes(mut self, nodes: Nodes) -> Self {
        self.nodes = nodes;
        self
    }
}
