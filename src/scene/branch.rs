//! Settings of the equilibrium solver, and of the branch of equilibria to follow.

use super::Parameter;
use crate::rod::Path;
use serde::Serialize;

/// Settings of the equilibrium solver.
#[derive(Debug, Clone, Copy, PartialEq, Serialize)]
pub struct Solve {
    /// Tolerance of the equilibria, relative, in [1e-13, 1e-4]; default [`Solve::TOLERANCE`].
    pub tolerance: f64,
    /// Form of the equations: spatial, planar or closed form; default [`Path::Auto`].
    pub path: Path,
}

impl Solve {
    /// Default of [`Solve::tolerance`].
    pub const TOLERANCE: f64 = 1e-10;
}

impl Default for Solve {
    fn default() -> Self {
        Self {
            tolerance: Self::TOLERANCE,
            path: Path::Auto,
        }
    }
}

/// A branch of equilibria in one parameter of the scene.
///
/// Steps are lengths along the branch. A change of the parameter alone by |to - from| has length 1. So does a change of
/// the base wrench by [`Continue::WRENCH_SCALE`] of the rod's own units: B/L for the couple, B/L^2 for the force, B a
/// bending stiffness. An assembly counts the wrenches of all rods, the rotations of the bodies in radians, and their
/// displacements in mean lengths of the rods. Hence a step of 0.01 gives at least 100 steps from `from` to `to`, and
/// more where the wrench changes much.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct Continue {
    /// The parameter that varies.
    #[serde(skip)]
    pub parameter: Parameter,
    /// Path of the parameter with the scene's names ([`Scene::name_of`](super::Scene::name_of)), for messages and
    /// figures.
    #[serde(rename = "parameter")]
    pub name: String,
    /// Value of the parameter at the start of the branch; default the value in the scene.
    pub from: f64,
    /// Value at which the branch ends, different from `from`.
    pub to: f64,
    /// First step; default 0.01, clipped to the bounds.
    pub step: f64,
    /// Shortest step, in (0, `max_step`]; default 1e-8.
    pub min_step: f64,
    /// Longest step, at most 1; default 0.1.
    pub max_step: f64,
    /// Bound on the number of points of a branch, 2..=1_000_000; default 200.
    pub points: usize,
    /// Follow the branches that leave at branch points; default false.
    pub switch: bool,
    /// Also follow the opposite direction from `from`, as far as 2 from - to; default false.
    pub both: bool,
    /// Count a branch that turns at a fold and comes back to `from` as complete, not as ended short of `to`; default
    /// false.
    pub back: bool,
    /// Look for disconnected branches (deflation); default false.
    pub deflate: bool,
    /// Parameter values at which the branch has an exact point.
    pub at: Vec<f64>,
    /// Second parameter, for curves of folds in the plane of both parameters.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub second: Option<Second>,
}

impl Continue {
    /// Change of the base wrench, in B/L and B/L^2, that counts as much as the whole range of the parameter.
    pub const WRENCH_SCALE: f64 = 10.0;

    /// Least and greatest parameter value on the branch.
    pub fn range(&self) -> (f64, f64) {
        let first = if self.both {
            2.0 * self.from - self.to
        } else {
            self.from
        };
        (first.min(self.to), first.max(self.to))
    }
}

/// The second parameter of fold curves.
///
/// The curves start from the folds of the branch, at which this parameter has its value in the scene. They are followed
/// in both directions as long as both parameters stay in their ranges. Steps are measured as in [`Continue`]: |to -
/// from| of this parameter has length 1, and so has the range of the first parameter.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct Second {
    /// The parameter, different from the first one.
    #[serde(skip)]
    pub parameter: Parameter,
    /// Path of the parameter with the scene's names.
    #[serde(rename = "parameter")]
    pub name: String,
    /// One end of the range; default the value in the scene.
    pub from: f64,
    /// Other end of the range, different from `from`. The closed range includes the value in the scene.
    pub to: f64,
    /// First step; default 0.01, clipped to the bounds.
    pub step: f64,
    /// Shortest step; default 1e-8.
    pub min_step: f64,
    /// Longest step; default 0.05, which gives smooth curves in a figure.
    pub max_step: f64,
    /// Bound on the number of points in each direction; default 400.
    pub points: usize,
}
