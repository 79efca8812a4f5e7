//! Special points between two accepted points of a branch: detected, located, labelled.
//!
//! Test functions with a sign: the tangent's part along p (fold), the determinant of [F_x F_p; tangent^T] (simple
//! branch point), the family's own (event). The Morse index shows the rest: crossings of even multiplicity, and pairs
//! within one step, which is then divided.

use super::arclength::Point;
use super::elimination::Place;
use super::newton_on_branch::{Corrected, Cubic, DirectedPlace, Failure, Finish, Space, length};
use super::roots::chandrupatla;
use crate::math::small_sort::sort_few;
use nalgebra::DVector;

/// Kind of a special point.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum SpecialKind {
    /// p turns back: F_x is singular, the branch is smooth.
    Fold,
    /// A second branch crosses: [F_x F_p] loses one rank.
    BranchPoint,
    /// The index changes without a sign change of either determinant (a crossing of even multiplicity, or an index
    /// that is not that of F_x).
    StabilityChange,
    /// The family's own test function changes sign.
    Event,
    /// Fold curves only: p and q turn together, two folds meet.
    Cusp,
}

impl std::fmt::Display for SpecialKind {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        f.write_str(match self {
            Self::Fold => "fold",
            Self::BranchPoint => "branch point",
            Self::StabilityChange => "stability change",
            Self::Event => "event",
            Self::Cusp => "cusp",
        })
    }
}

/// Convergence of a location.
#[derive(Debug, Clone, PartialEq, Eq)]
pub enum Status {
    /// Located to the stated precision.
    Converged,
    /// Only bracketed by the interval; the location did not converge, for the given reason.
    Guess(String),
}

/// A special point.
#[derive(Debug, Clone, PartialEq)]
pub struct Special {
    /// Kind of the point.
    pub kind: SpecialKind,
    /// Convergence of the location.
    pub status: Status,
    /// The place, with its tangent along the branch followed. Index: the lower of the two sides.
    pub point: Point,
    /// Arclengths that bracket the point.
    pub interval: (f64, f64),
    /// Error of the arclength on the family as computed; [`Special::with_error_bounds`] includes the error of the
    /// computation.
    pub error_s: f64,
    /// Error of p, likewise.
    pub error_p: f64,
    /// Errors of the unknowns, likewise.
    pub error_x: DVector<f64>,
    /// Index before and after, along the branch.
    pub index: (Option<usize>, Option<usize>),
    /// True for a branch point or a cusp at which the parameter turns as well (as in a pitchfork met on its bent
    /// branch).
    pub turning: bool,
}

impl Special {
    /// Place and tangent in coordinates (x, weight p).
    pub(crate) fn place_and_tangent(&self, weight: f64) -> DirectedPlace {
        let at = &self.point;
        DirectedPlace {
            place: Place::new(at.x.clone(), at.p * weight),
            tangent: Place::new(at.tangent_x.clone(), at.tangent_p * weight),
        }
    }

    /// True if the location converged.
    pub fn is_converged(&self) -> bool {
        self.status == Status::Converged
    }
}

/// A place on the branch with arclength, index and event function.
#[derive(Debug, Clone)]
pub(crate) struct Sample {
    pub on: Corrected,
    pub arclength: f64,
    pub index: Option<usize>,
    pub event: Option<f64>,
}

impl Sample {
    pub fn place_and_tangent(&self) -> DirectedPlace {
        DirectedPlace {
            place: self.on.place.clone(),
            tangent: self.on.tangent.clone(),
        }
    }
}

/// Most divisions of a step in search of points shown by the index on both sides of its middle, or of a parameter
/// that turns twice.
pub(super) const MAX_DEPTH: usize = 6;
/// Distance along the branch, relative to the unknowns, below which special points are one; and the same in
/// tolerances.
const APART: f64 = 1e-7;
const TOLERANCES: f64 = 100.0;

fn changes_sign(a: f64, b: f64) -> bool {
    a * b < 0.0 || (b == 0.0 && a != 0.0)
}

pub(super) fn lowest(a: Option<usize>, b: Option<usize>) -> Option<usize> {
    match (a, b) {
        (Some(a), Some(b)) => Some(a.min(b)),
        (a, b) => a.or(b),
    }
}

/// Result of a bracketing search on points of the branch.
pub(super) struct Bracket {
    pub left: Sample,
    pub right: Sample,
    pub best: Sample,
    pub failure: Option<Failure>,
    pub converged: bool,
}

impl Bracket {
    fn interval(&self) -> (f64, f64) {
        (self.left.arclength, self.right.arclength)
    }

    pub fn width(&self) -> f64 {
        self.right.arclength - self.left.arclength
    }
}

impl Space<'_> {
    /// Adds arclength, index and event to a corrected place after `before`.
    pub fn dress(&self, on: Corrected, before: &Sample) -> Sample {
        let arclength =
            before.arclength + length(&before.on.place, &before.on.tangent, &on.place, &on.tangent);
        self.dressed(on, arclength, true)
    }

    pub fn dressed(&self, on: Corrected, arclength: f64, index: bool) -> Sample {
        let p = on.place.p / self.weight;
        let dp = on.tangent.p / self.weight;
        Sample {
            index: index
                .then(|| self.family.index(&on.place.x, p).ok().flatten())
                .flatten(),
            event: (self.family.event(&on.place.x, p, &on.tangent.x, dp).ok()).flatten(),
            arclength,
            on,
        }
    }

    /// A point of the branch at the fraction `t` between two others.
    pub fn point_between(
        &self,
        a: &Sample,
        b: &Sample,
        t: f64,
        index: bool,
    ) -> Result<Sample, Failure> {
        let cubic = Cubic::new(a.place_and_tangent(), b.place_and_tangent());
        let reach = 0.5 * cubic.length;
        let on = self.correct(&cubic.at(t), &cubic.slope(t), reach, Finish::Evaluated)?;
        // Not measured from `a`: points between two others must keep their order, whatever the error of the length.
        let arclength = a.arclength + t * (b.arclength - a.arclength);
        Ok(self.dressed(on, arclength, index))
    }

    pub fn point(&self, sample: &Sample) -> Point {
        let Corrected {
            place,
            tangent,
            error,
            ..
        } = &sample.on;
        Point {
            x: place.x.clone(),
            p: place.p / self.weight,
            tangent_x: tangent.x.clone(),
            tangent_p: tangent.p / self.weight,
            arclength: sample.arclength,
            index: sample.index,
            evaluations: 0,
            error: *error,
            role: super::arclength::Role::Special,
        }
    }

    /// True if the signs of the test functions account for the change of the index between two neighbours.
    fn is_explained(&self, a: &Sample, b: &Sample) -> bool {
        let simple = usize::from(changes_sign(a.on.tangent.p, b.on.tangent.p))
            + usize::from(changes_sign(a.on.branching, b.on.branching));
        match a.index.zip(b.index).map(|(a, b)| a.abs_diff(b)) {
            None => true,
            Some(0) => simple != 1,
            Some(jump) => simple == jump,
        }
    }

    /// Special points between two neighbours, in order.
    pub fn search(&self, a: &Sample, b: &Sample, depth: usize) -> Vec<Special> {
        let fold = changes_sign(a.on.tangent.p, b.on.tangent.p);
        let branch = changes_sign(a.on.branching, b.on.branching);
        let event = matches!((a.event, b.event), (Some(a), Some(b)) if changes_sign(a, b));
        let jump = a.index.zip(b.index).map(|(a, b)| a.abs_diff(b));
        let explained = self.is_explained(a, b);
        let cubic = Cubic::new(a.place_and_tangent(), b.place_and_tangent());
        let twice = if fold { None } else { cubic.turns_twice() };
        // Steps with changes of the index alone are divided until points at this distance are resolved: their kind
        // does not depend on the step.
        let apart = APART.max(TOLERANCES * self.tolerance) * (1.0 + b.on.place.norm());
        let many = depth < MAX_DEPTH;
        let divides = if explained {
            many && twice.is_some()
        } else {
            many || b.arclength - a.arclength > apart
        };
        if divides
            && let Ok(middle) = self.point_between(a, b, twice.unwrap_or(0.5), true)
            && (many || self.is_explained(a, &middle) || self.is_explained(&middle, b))
        {
            let mut found = self.search(a, &middle, depth + 1);
            found.extend(self.search(&middle, b, depth + 1));
            return found;
        }
        let mut found = Vec::new();
        if branch {
            found.push(self.branch_point(a, b));
        }
        if fold {
            match found.first().map(|at| at.point.arclength) {
                None => found.push(self.root(SpecialKind::Fold, a, b, |s| Some(s.on.tangent.p))),
                Some(s) => self.fold_beside_branch_point(a, b, s, &mut found),
            }
        }
        if !(fold || branch) && jump.is_some_and(|jump| jump > 0) {
            self.stability_change(a, b, &mut found);
        }
        if event {
            let mut special = self.root(self.family.event_kind(), a, b, |s| s.event);
            if special.kind == SpecialKind::Cusp {
                // q turns at a cusp as well: one point, one label.
                let near = |s: &Special| {
                    let distance = (s.point.arclength - special.point.arclength).abs();
                    s.kind == SpecialKind::Fold && distance <= 1e-2 * cubic.length
                };
                special.turning = found.iter().any(near);
                found.retain(|s| !near(s));
            }
            found.push(special);
        }
        sort_few(&mut found, |special| special.point.arclength);
        self.label_indices(a, b, &mut found);
        found
    }

    /// Indices on both sides of each special point: those of the neighbours, or of points in between.
    fn label_indices(&self, a: &Sample, b: &Sample, found: &mut [Special]) {
        let mut before = a.index;
        for k in 0..found.len() {
            if found[k].kind == SpecialKind::StabilityChange {
                before = found[k].index.1;
                continue;
            }
            let after = match found.get(k + 1) {
                None => b.index,
                Some(next) if next.kind == SpecialKind::StabilityChange => next.index.0,
                Some(next) => {
                    let s = 0.5 * (found[k].point.arclength + next.point.arclength);
                    let t = (s - a.arclength) / (b.arclength - a.arclength);
                    a.index
                        .and_then(|_| self.point_between(a, b, t, true).ok())
                        .and_then(|middle| middle.index)
                }
            };
            found[k].index = (before, after);
            found[k].point.index = lowest(before, after);
            before = after;
        }
    }

    /// Brackets a sign change of `test` on points of the branch, to `tolerance` of the interval.
    pub(super) fn bracket(
        &self,
        a: &Sample,
        b: &Sample,
        index: bool,
        tolerance: f64,
        test: impl Fn(&Sample) -> Option<f64>,
    ) -> Bracket {
        let mut this = Bracket {
            left: a.clone(),
            right: b.clone(),
            best: a.clone(),
            failure: None,
            converged: false,
        };
        let (Some(fa), Some(fb)) = (test(a), test(b)) else {
            return this;
        };
        let mut smallest = f64::INFINITY;
        let mut ends = (a.clone(), b.clone());
        let root = chandrupatla(
            |t| {
                // The prediction is best between the nearest known points, unless their distance is mere noise.
                if this.width() > 1e-3 * (b.arclength - a.arclength) {
                    ends = (this.left.clone(), this.right.clone());
                }
                let s = a.arclength + t * (b.arclength - a.arclength);
                let inner = (s - ends.0.arclength) / (ends.1.arclength - ends.0.arclength);
                let sample = self.point_between(&ends.0, &ends.1, inner, index);
                match sample {
                    Ok(sample) => {
                        let value = test(&sample).unwrap_or(f64::NAN);
                        if value.abs() < smallest {
                            (smallest, this.best) = (value.abs(), sample.clone());
                        }
                        if value != 0.0 {
                            if (value > 0.0) == (fa > 0.0) {
                                this.left = sample;
                            } else {
                                this.right = sample;
                            }
                        }
                        value
                    }
                    Err(failure) => {
                        this.failure = Some(failure);
                        f64::NAN
                    }
                }
            },
            (0.0, fa),
            (1.0, fb),
            tolerance,
        );
        if fb == 0.0 {
            this.best = b.clone();
        }
        this.converged = root.is_some();
        this
    }

    /// A root of a smooth test function, located on points of the branch.
    fn root(
        &self,
        kind: SpecialKind,
        a: &Sample,
        b: &Sample,
        test: impl Fn(&Sample) -> Option<f64>,
    ) -> Special {
        let ends = test(a).zip(test(b));
        let found = self.bracket(a, b, false, 1e-11, &test);
        let best = found.best.clone();
        // Distance to the root by the secant; at least the error of the place itself.
        let steep = ends.map_or(0.0, |(fa, fb)| (fb - fa) / (b.arclength - a.arclength));
        let missed = test(&best).map_or(f64::INFINITY, |f| (f / steep).abs());
        let error_s = missed.min(found.width()).max(best.on.error);
        self.special(kind, &best, &found, error_s)
    }

    pub(super) fn special(
        &self,
        kind: SpecialKind,
        at: &Sample,
        found: &Bracket,
        error_s: f64,
    ) -> Special {
        let status = match (&found.failure, found.converged) {
            (None, true) => Status::Converged,
            (Some(failure), _) => Status::Guess(format!("near it {failure}")),
            _ => Status::Guess("its test function has no root that could be bracketed".into()),
        };
        let slope = at.on.tangent.p.abs();
        // p is stationary at a fold: the curvature of the branch is at most about 1 / length in these units.
        let second = match kind {
            SpecialKind::Fold | SpecialKind::Cusp => error_s * error_s,
            _ => 0.0,
        };
        Special {
            kind,
            status,
            point: self.point(at),
            interval: found.interval(),
            error_s,
            error_p: (slope * error_s + second + at.on.error) / self.weight,
            error_x: (at.on.tangent.x.abs() * error_s).add_scalar(second + at.on.error),
            index: (found.left.index, found.right.index),
            turning: false,
        }
    }

    /// Both p and the determinant change sign: either p turns at the branch point itself, or a fold lies on one side
    /// of it.
    fn fold_beside_branch_point(&self, a: &Sample, b: &Sample, s: f64, found: &mut Vec<Special>) {
        let fold = |l: &Sample, r: &Sample| {
            changes_sign(l.on.tangent.p, r.on.tangent.p)
                .then(|| self.root(SpecialKind::Fold, l, r, |s| Some(s.on.tangent.p)))
        };
        let t = (s - a.arclength) / (b.arclength - a.arclength);
        let near = |t: f64| (0.0 < t && t < 1.0).then(|| self.point_between(a, b, t, false).ok());
        let before = near(t - 0.02).flatten().unwrap_or_else(|| a.clone());
        let after = near(t + 0.02).flatten().unwrap_or_else(|| b.clone());
        if changes_sign(before.on.tangent.p, after.on.tangent.p) {
            found[0].turning = true;
        }
        found.extend(fold(a, &before));
        found.extend(fold(&after, b));
    }
}
