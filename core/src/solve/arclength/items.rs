//! Items of a continuation: points, special points, and the end of the branch.

use crate::error::Error;
use crate::solve::special_points::Special;
use nalgebra::DVector;

/// Reason for an accepted point.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Role {
    /// The first point.
    Start,
    /// A step of the continuation.
    Step,
    /// A requested value of p, hit exactly.
    Requested,
    /// The last point: on an end of the range of p, or the start of a closed branch.
    End,
    /// At a special point.
    Special,
}

/// A point of the branch.
#[derive(Debug, Clone, PartialEq)]
pub struct Point {
    /// The unknowns.
    pub x: DVector<f64>,
    /// The parameter.
    pub p: f64,
    /// dx/ds, s being arclength: |dx/ds|^2 + weight^2 (dp/ds)^2 = 1. Accurate to about the square
    /// root of the tolerance at steps, to the tolerance elsewhere.
    pub tangent_x: DVector<f64>,
    /// dp/ds.
    pub tangent_p: f64,
    /// Length of the branch from the start, by a rule of fourth order.
    pub arclength: f64,
    /// Morse index, if the family knows it.
    pub index: Option<usize>,
    /// Evaluations of F since the previous point, failed steps and special points included.
    pub evaluations: usize,
    /// Estimated distance from the branch.
    pub error: f64,
    /// Reason for the point.
    pub role: Role,
}

/// Reason for the end of a branch. None is an error: all points up to the end are valid.
#[derive(Debug, Clone, PartialEq)]
pub enum Stop {
    /// p arrived at `to`.
    Reached,
    /// p left the range at `from`.
    LeftAtStart,
    /// The branch is closed: the last point is the first.
    Closed,
    /// The largest number of points was reached.
    MaxPoints,
    /// The step would have to be smaller than allowed.
    StepTooSmall {
        /// The last point's p.
        p: f64,
        /// The last point's arclength.
        arclength: f64,
        /// The failure at the smallest step, with a remedy.
        reason: String,
    },
    /// The family is undefined beyond the last point.
    Undefined {
        /// The last point's p.
        p: f64,
        /// The last point's arclength.
        arclength: f64,
        /// Error of the family.
        reason: Error,
    },
}

impl std::fmt::Display for Stop {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        match self {
            Self::Reached => f.write_str("the parameter reached its end"),
            Self::LeftAtStart => {
                f.write_str("the branch turned back and left the range where it began")
            }
            Self::Closed => f.write_str("the branch is a closed loop"),
            Self::MaxPoints => f.write_str("the number of points is used up"),
            Self::StepTooSmall {
                p,
                arclength,
                reason,
            } => write!(f, "stuck at p = {p}, arclength {arclength}: {reason}"),
            Self::Undefined {
                p,
                arclength,
                reason,
            } => write!(
                f,
                "the family is undefined beyond p = {p}, arclength {arclength}: {reason}"
            ),
        }
    }
}

/// Item of the iterator, in order along the branch; a `Stop` comes last, once.
#[derive(Debug, Clone, PartialEq)]
pub enum Item {
    /// An accepted point.
    Point(Point),
    /// A special point between its neighbouring points.
    Special(Special),
    /// The end of the branch, with the reason.
    Stop(Stop),
}

/// A whole branch, collected.
#[derive(Debug, Clone, PartialEq)]
pub struct Trace {
    /// Accepted points, in order.
    pub points: Vec<Point>,
    /// Special points, in order.
    pub specials: Vec<Special>,
    /// Reason for the end of the branch.
    pub stop: Stop,
    /// Evaluations of F in total.
    pub evaluations: usize,
}

/// Start along a branch of known direction, as after branch switching.
#[derive(Debug, Clone, PartialEq)]
pub struct BranchStart {
    /// The unknowns.
    pub x: DVector<f64>,
    /// The parameter.
    pub p: f64,
    /// Direction in x; the whole direction may have any length but zero.
    pub direction_x: DVector<f64>,
    /// Direction in p.
    pub direction_p: f64,
}
