//! Bounds of the errors of special points: each is located again on families that are computed otherwise.
//!
//! A family carries the error of its computation, such as that of an integration to a tolerance, and its special points
//! with it; nothing in the family itself shows how much. Two finer families show it: the error of the first place is
//! the distance to theirs, but for their own errors, of which their distance from each other is a measure.

use super::arclength::Options;
use super::corrector::{Finish, Space};
use super::family::Family;
use super::special::{Special, SpecialKind, Status};
use nalgebra::DVector;

/// How far from the special point the search begins, relative to the size of the unknowns: nearest first, so that a
/// neighbour is not taken for it.
const REACHES: [f64; 4] = [1e-5, 1e-4, 1e-3, 1e-2];

/// A special point found again.
struct Found {
    x: DVector<f64>,
    p: f64,
    /// Distance along the branch from where it was found first.
    shift: f64,
    error_s: f64,
    error_p: f64,
    error_x: DVector<f64>,
}

impl Special {
    /// The same special point with `error_p`, `error_x` and `error_s` that bound its errors, those of the family's own computation
    /// included. `finer` are families of the same problem whose errors are less by a factor of 10 or more, each by another. A
    /// point that one of them does not have is a guess.
    #[must_use]
    pub fn bounded(mut self, finer: &[&dyn Family], options: &Options) -> Self {
        let found: Vec<Found> = finer
            .iter()
            .filter_map(|family| self.found_again(*family, options))
            .collect();
        if found.len() < finer.len() && self.is_converged() {
            self.status =
                Status::Guess("computed to a tighter tolerance it is not found again".into());
        }
        let here = Found {
            x: self.point.x.clone(),
            p: self.point.p,
            shift: 0.0,
            error_s: self.error_s,
            error_p: self.error_p,
            error_x: self.error_x.clone(),
        };
        let rounding = |value: f64| 4.0 * f64::EPSILON * value.abs();
        self.error_p = bound(&here, &found, |at| (at.p, at.error_p)) + rounding(here.p);
        self.error_s = bound(&here, &found, |at| (at.shift, at.error_s));
        self.error_x = DVector::from_fn(self.point.x.len(), |i, _| {
            bound(&here, &found, |at| (at.x[i], at.error_x[i])) + rounding(here.x[i])
        });
        self
    }

    fn found_again(&self, family: &dyn Family, options: &Options) -> Option<Found> {
        let weight = options.rounded_weight();
        let space = Space::new(family, weight, options.tolerance, options.max_corrections);
        let (place, tangent) = self.place_and_tangent(weight);
        let size = 1.0 + place.norm();
        if self.kind == SpecialKind::BranchPoint {
            let reach = REACHES[REACHES.len() - 1] * size;
            if let Some((again, error)) = space.polish_branch_point(&place, reach) {
                return Some(Found {
                    shift: tangent.dot(&(&again - &place)),
                    error_s: error,
                    error_p: error / weight,
                    error_x: DVector::from_element(place.x.len(), error),
                    x: again.x,
                    p: again.p / weight,
                });
            }
        }
        REACHES.iter().find_map(|reach| {
            let beside = |s: f64| {
                let on = space.correct(
                    &(&place + &tangent * s),
                    &tangent,
                    s.abs(),
                    Finish::Evaluated,
                );
                Some(space.dressed(on.ok()?, s, true))
            };
            let (before, after) = (beside(-reach * size)?, beside(reach * size)?);
            let near = |at: &Self| at.point.arclength.abs();
            let all = space.search(&before, &after, 0).into_iter();
            let same = all.filter(|at| alike(at.kind, self.kind) && at.is_converged());
            same.min_by(|a, b| near(a).total_cmp(&near(b)))
                .map(|at| Found {
                    x: at.point.x,
                    p: at.point.p,
                    shift: at.point.arclength,
                    error_s: at.error_s,
                    error_p: at.error_p,
                    error_x: at.error_x,
                })
        })
    }
}

/// Twice the distance to the finer values, four times their own, and what each is uncertain by.
fn bound(here: &Found, finer: &[Found], of: impl Fn(&Found) -> (f64, f64)) -> f64 {
    let (value, own) = of(here);
    let apart = |a: f64, b: f64| (a - b).abs();
    let all = || finer.iter().map(&of);
    let distance = all().map(|(x, _)| apart(x, value)).fold(0.0, f64::max);
    let scatter = all()
        .flat_map(|(x, _)| all().map(move |(y, _)| apart(x, y)))
        .fold(0.0, f64::max);
    2.0 * distance + 4.0 * scatter + all().map(|(_, e)| e).fold(own, f64::max)
}

/// A branch point and a change of the index are one thing seen by two tests: which of them sees it first depends on errors.
fn alike(a: SpecialKind, b: SpecialKind) -> bool {
    let crossing = |kind| {
        matches!(
            kind,
            SpecialKind::BranchPoint | SpecialKind::StabilityChange
        )
    };
    a == b || crossing(a) && crossing(b)
}
