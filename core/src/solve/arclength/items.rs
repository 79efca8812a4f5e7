//! What the continuation gives.

use crate::error::Error;
use crate::solve::special_points::Special;
use nalgebra::DVector;

/// What a point is there for.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Role {
    /// The first point.
    Start,
    /// A step of the continuation.
    Step,
    /// A value of p that was asked for, hit exactly.
    Requested,
    /// The last point: on an end of the range of p, or the start again.
    End,
    /// The place of a special point.
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
    /// Evaluations of F since the point before, failed steps and special points included.
    pub evaluations: usize,
    /// Estimated distance from the branch.
    pub error: f64,
    /// Why the point is there.
    pub role: Role,
}

/// Why a branch ended. None of these is an error: the points up to here are good.
#[derive(Debug, Clone, PartialEq)]
pub enum Stop {
    /// p arrived at `to`.
    Reached,
    /// p left the range at `from`.
    LeftAtStart,
    /// The branch is closed: the last point is the first.
    Closed,
    /// As many points as were asked for.
    MaxPoints,
    /// The step would have to be smaller than allowed.
    StepTooSmall {
        /// The last point's p.
        p: f64,
        /// The last point's arclength.
        arclength: f64,
        /// What went wrong at the smallest step, and what may help.
        reason: String,
    },
    /// The family is undefined beyond the last point.
    Undefined {
        /// The last point's p.
        p: f64,
        /// The last point's arclength.
        arclength: f64,
        /// What the family said.
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

/// What the iterator gives, in order along the branch; a `Stop` comes last, once.
#[derive(Debug, Clone, PartialEq)]
pub enum Item {
    /// An accepted point.
    Point(Point),
    /// A special point between the point before and the point after.
    Special(Special),
    /// The end, and why.
    Stop(Stop),
}

/// A whole branch.
#[derive(Debug, Clone, PartialEq)]
pub struct Trace {
    /// Accepted points, in order.
    pub points: Vec<Point>,
    /// Special points, in order.
    pub specials: Vec<Special>,
    /// Why it ended.
    pub stop: Stop,
    /// Evaluations of F in all.
    pub evaluations: usize,
}

/// Where to start along a branch of which the direction is known, as after branch switching.
#[derive(Debug, Clone, PartialEq)]
pub struct BranchStart {
    /// The unknowns.
    pub x: DVector<f64>,
    /// The parameter.
    pub p: f64,
    /// The direction to go; any length but zero.
    pub direction_x: DVector<f64>,
    /// Its part along p.
    pub direction_p: f64,
}
