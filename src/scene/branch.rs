//! How equilibria are solved, and the branch to follow.

use super::Parameter;
use crate::rod::Path;
use serde::Serialize;

/// How to solve.
#[derive(Debug, Clone, Copy, PartialEq, Serialize)]
pub struct Solve {
    /// Tolerance of the equilibria, relative, in [1e-13, 1e-4]; default [`Solve::TOLERANCE`].
    pub tolerance: f64,
    /// The path of the computation; default [`Path::Auto`].
    pub path: Path,
}

impl Solve {
    /// Default tolerance.
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
/// Steps are lengths along the branch, measured so that a change of the parameter alone by |to - from| has
/// length 1, and so does a change of the base wrench (of an assembly those of all rods, with the turns of the bodies in radians and their
/// displacements in mean lengths of the rods) by [`Continue::TYPICAL`] of the rod's own units (B/L for the
/// couple, B/L^2 for the force, B a bending stiffness). Hence 0.01 is at least 100 steps from `from` to `to`, and more
/// where the wrench changes much.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct Continue {
    /// What varies.
    #[serde(skip)]
    pub parameter: Parameter,
    /// Its path with the names of the scene ([`Scene::name_of`](super::Scene::name_of)), as messages and figures have it.
    #[serde(rename = "parameter")]
    pub name: String,
    /// Its first value; default the one in the scene.
    pub from: f64,
    /// The value at which the branch ends, not `from`.
    pub to: f64,
    /// First step; default 0.01, or the nearest that the bounds allow.
    pub step: f64,
    /// Shortest step, in (0, `max_step`]; default 1e-8.
    pub min_step: f64,
    /// Longest step, at most 1; default 0.1.
    pub max_step: f64,
    /// A branch ends after so many points, 2..=1_000_000; default 200.
    pub points: usize,
    /// Follow the branches that leave at branch points; default false.
    pub switch: bool,
    /// Also go the other way from `from`, as far as to 2 from - to; default false.
    pub both: bool,
    /// A branch that turns at a fold and comes back to `from` is what was asked for, not one that ended short of `to`;
    /// default false.
    pub back: bool,
    /// Look for branches that do not meet this one (deflation); default false.
    pub deflate: bool,
    /// Values of the parameter that the branch hits exactly.
    pub at: Vec<f64>,
    /// A second parameter: the curves of folds in both.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub second: Option<Second>,
}

impl Continue {
    /// The change of the base wrench, in B/L and B/L^2, that counts as much as the whole way of the parameter.
    pub const TYPICAL: f64 = 10.0;

    /// Least and greatest value of the parameter on the branch.
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
/// The curves go through the folds of the branch, where this parameter has its value in the scene, and are followed
/// in both directions as long as both parameters stay in their ranges. Steps are measured as in [`Continue`], with
/// |to - from| of this parameter as length 1, and the way of the first parameter counting as much.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct Second {
    /// What varies, not the first parameter.
    #[serde(skip)]
    pub parameter: Parameter,
    /// Its path with the names of the scene.
    #[serde(rename = "parameter")]
    pub name: String,
    /// One end of its range; default the value in the scene.
    pub from: f64,
    /// The other end, not `from`. The value in the scene lies between them, or is one of them.
    pub to: f64,
    /// First step; default 0.01, or the nearest that the bounds allow.
    pub step: f64,
    /// Shortest step; default 1e-8.
    pub min_step: f64,
    /// Longest step; default 0.05, smooth in a figure.
    pub max_step: f64,
    /// A curve ends after so many points in each direction; default 400.
    pub points: usize,
}
