//! Error bounds of special points: each is located again on families with other errors of computation.
//!
//! A family carries the error of its computation, such as that of an integration to a tolerance, and so do its
//! special points; the family itself cannot show this error. Two finer families show it. The error of the first
//! location is its distance to theirs, up to their own errors, which their mutual distance measures. If nothing is
//! finer, two coarser families serve: an error at most half of theirs is at most the distance to theirs. Rounding,
//! common to all, is added: its effect on the equations is mapped through the regular system that has the special
//! point as its root.

use super::arclength::Options;
use super::elimination::Place;
use super::newton_on_branch::{DirectedPlace, Finish, Space};
use super::parametrised_problem::Family;
use super::rounding::{AtRoot, solver};
use super::special_points::{Special, SpecialKind, Status};
use nalgebra::{DMatrix, DVector, RowDVector};

/// Distances from the special point at which the search begins, relative to the size of the unknowns: nearest first,
/// so that no neighbour is found instead.
const REACHES: [f64; 4] = [1e-5, 1e-4, 1e-3, 1e-2];

/// A special point located again.
struct LocatedAgain {
    x: DVector<f64>,
    p: f64,
    /// Distance along the branch from the first location.
    shift: f64,
    error_s: f64,
    error_p: f64,
    error_x: DVector<f64>,
}

impl Special {
    /// This special point with bounds `error_p`, `error_x` and `error_s` that include the error of the family's own
    /// computation. `others` are families of the same problem whose errors are less by different factors of 10 or
    /// more, or greater by a factor of two or more. A point missing in one of them becomes a guess. Rounding is that
    /// of the last family.
    #[must_use]
    pub fn with_error_bounds(mut self, others: &[&dyn Family], options: &Options) -> Self {
        let found: Vec<LocatedAgain> = others
            .iter()
            .filter_map(|family| self.found_again(*family, options))
            .collect();
        if found.len() < others.len() && self.is_converged() {
            self.status =
                Status::Guess("computed to another tolerance it is not found again".into());
        }
        let here = LocatedAgain {
            x: self.point.x.clone(),
            p: self.point.p,
            shift: 0.0,
            error_s: self.error_s,
            error_p: self.error_p,
            error_x: self.error_x.clone(),
        };
        let rounding = (others.last()).and_then(|family| self.rounding(*family, options));
        let (rounding, along) = rounding.unwrap_or_else(|| {
            let all = [self.point.x.as_slice(), &[self.point.p]].concat();
            (Place::from_slice(&all) * (4.0 * f64::EPSILON), 0.0)
        });
        self.error_p = bound(&here, &found, |at| (at.p, at.error_p)) + rounding.p.abs();
        self.error_s = bound(&here, &found, |at| (at.shift, at.error_s)) + along;
        self.error_x = DVector::from_fn(self.point.x.len(), |i, _| {
            bound(&here, &found, |at| (at.x[i], at.error_x[i])) + rounding.x[i].abs()
        });
        self
    }

    /// Error bounds by rounding of the family's equations: of unknowns and parameter, and of the arclength. None if
    /// the family is undefined nearby.
    fn rounding(&self, family: &dyn Family, options: &Options) -> Option<(Place, f64)> {
        let weight = options.rounded_weight();
        let space = Space::new(family, weight, options.tolerance, options.max_corrections);
        let DirectedPlace { place, tangent } = self.place_and_tangent(weight);
        let moved = match self.kind {
            SpecialKind::BranchPoint => space.rounding_of_branch_point(&place)?,
            SpecialKind::StabilityChange => {
                &tangent * space.rounding_of_crossing(&place, &tangent)?
            }
            kind => space.rounding_of_tested(kind, &place, &tangent)?,
        };
        let along = tangent.reach_of(&moved);
        Some((Place::new(moved.x, moved.p / weight), along))
    }

    fn found_again(&self, family: &dyn Family, options: &Options) -> Option<LocatedAgain> {
        let weight = options.rounded_weight();
        let space = Space::new(family, weight, options.tolerance, options.max_corrections);
        let DirectedPlace { place, tangent } = self.place_and_tangent(weight);
        let size = 1.0 + place.norm();
        if self.kind == SpecialKind::BranchPoint {
            let reach = REACHES[REACHES.len() - 1] * size;
            if let Some((again, error)) = space.polish_branch_point(&place, reach) {
                return Some(LocatedAgain {
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
            let same = all.filter(|at| is_same_event(at.kind, self.kind) && at.is_converged());
            same.min_by(|a, b| near(a).total_cmp(&near(b)))
                .map(|at| LocatedAgain {
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

impl Space<'_> {
    /// F, and the test function of folds or of the family's own events, on the branch or near it.
    fn test_values(&self, kind: SpecialKind, z: &Place, tangent: &Place) -> Option<DVector<f64>> {
        let (residual, eliminated) = self.evaluate(z).ok()?;
        let along = self.null(&eliminated).0.towards(tangent);
        let test = match kind {
            SpecialKind::Fold => along.p,
            _ => {
                let (p, dp) = (z.p / self.weight, along.p / self.weight);
                self.family.event(&z.x, p, &along.x, dp).ok()??
            }
        };
        Some(residual.push(test))
    }

    /// Displacement of a fold or an event by rounding of F and of the test function.
    fn rounding_of_tested(&self, kind: SpecialKind, z: &Place, tangent: &Place) -> Option<Place> {
        let (matrix, _) = self.matrix(z)?;
        let n = matrix.nrows();
        let mut system = DMatrix::zeros(n + 1, n + 1);
        system.rows_mut(0, n).copy_from(&matrix);
        let gradient = match kind {
            // With A t = 0 and |t| = 1: A dt = -A'[w] t = -A'[t] w, t . dt = 0.
            SpecialKind::Fold => {
                let mut whole = system.clone();
                whole.set_row(n, &tangent.flat().transpose());
                let by_p = Place::along_p(n).flat();
                let row = whole.transpose().full_piv_lu().solve(&by_p)?;
                -(row.rows(0, n).transpose() * self.bend_along(z, tangent)?)
            }
            _ => {
                let h = 3e-5 * (1.0 + z.norm());
                let mut gradient = RowDVector::zeros(n + 1);
                for k in 0..=n {
                    let at = |by: f64| {
                        let mut beside = z.flat();
                        beside[k] += by;
                        let beside = Place::from_slice(beside.as_slice());
                        Some(self.test_values(kind, &beside, tangent)?[n])
                    };
                    gradient[k] = (at(h)? - at(-h)?) / (2.0 * h);
                }
                gradient
            }
        };
        system.set_row(n, &gradient);
        let value = self.test_values(kind, z, tangent)?;
        let phi =
            |z: &DVector<f64>| self.test_values(kind, &Place::from_slice(z.as_slice()), tangent);
        let at_root = AtRoot {
            z: &z.flat(),
            value: &value,
            phi,
            solve: solver(system),
        };
        Some(Place::from_slice(at_root.errors()?.as_slice()))
    }
}

/// Twice the distance to the other values, plus four times their scatter, plus the largest own uncertainty.
fn bound(
    here: &LocatedAgain,
    others: &[LocatedAgain],
    of: impl Fn(&LocatedAgain) -> (f64, f64),
) -> f64 {
    let (value, own) = of(here);
    let apart = |a: f64, b: f64| (a - b).abs();
    let all = || others.iter().map(&of);
    let distance = all().map(|(x, _)| apart(x, value)).fold(0.0, f64::max);
    let scatter = all()
        .flat_map(|(x, _)| all().map(move |(y, _)| apart(x, y)))
        .fold(0.0, f64::max);
    2.0 * distance + 4.0 * scatter + all().map(|(_, e)| e).fold(own, f64::max)
}

/// A branch point and a change of the index are one event seen by two tests: errors decide which test sees it first.
fn is_same_event(a: SpecialKind, b: SpecialKind) -> bool {
    let crossing = |kind| {
        matches!(
            kind,
            SpecialKind::BranchPoint | SpecialKind::StabilityChange
        )
    };
    a == b || crossing(a) && crossing(b)
}
