//! Newton corrections on a branch of solutions, in a hyperplane, and interpolation along the branch.

use super::elimination::{Elimination, Place};
use super::parametrised_problem::Family;
use super::rounding::AtRoot;
use crate::error::Error;
use nalgebra::DVector;
use std::cell::{Cell, OnceCell};

/// A family seen in coordinates (x, weight p), in which lengths and angles are Euclidean.
pub(crate) struct Space<'a> {
    pub family: &'a dyn Family,
    pub weight: f64,
    pub tolerance: f64,
    pub max_corrections: usize,
    pub evaluations: Cell<usize>,
    /// |next correction| / |correction|^2, the largest of the recent corrections.
    bend: Cell<f64>,
    /// Scale of the first determinant, common to all.
    blocks: OnceCell<i32>,
}

/// The largest correction, relative to the place, that may be taken for rounding.
pub(super) const MAX_ROUNDING_CORRECTION: f64 = 1e-7;

/// Criterion for the last correction.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) enum Finish {
    /// The next correction, as predicted, would be below the tolerance.
    Predicted,
    /// The correction itself is far below the tolerance: the tangent is then as accurate as the place.
    Evaluated,
}

/// A place on the branch.
#[derive(Debug, Clone)]
pub(crate) struct Corrected {
    pub place: Place,
    /// Unit tangent, less than a right angle from the hyperplane's normal.
    pub tangent: Place,
    /// det [F_x F_p; tangent^T]; changes sign at a simple branch point.
    pub branching: f64,
    /// Last pivot over first pivot of [F_x F_p].
    pub regularity: f64,
    /// Second correction over first; predicted if there was only one.
    pub contraction: f64,
    /// Estimated distance from the branch.
    pub error: f64,
}

/// Reason for a failed correction.
#[derive(Debug, Clone)]
pub(crate) enum Failure {
    Undefined(Error),
    Diverging(f64),
    Far,
    Parallel,
    Slow,
}

impl std::fmt::Display for Failure {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        match self {
            Self::Undefined(e) => write!(f, "F is undefined ({e})"),
            Self::Diverging(by) => {
                write!(f, "the corrections do not shrink (factor {by:.2})")
            }
            Self::Far => f.write_str("the first correction is as long as the step"),
            Self::Parallel => f.write_str("the branch runs parallel to the corrector's plane"),
            Self::Slow => f.write_str("too many corrections"),
        }
    }
}

impl<'a> Space<'a> {
    pub fn new(
        family: &'a dyn Family,
        weight: f64,
        tolerance: f64,
        max_corrections: usize,
    ) -> Self {
        Self {
            family,
            weight,
            tolerance,
            max_corrections,
            evaluations: Cell::new(0),
            bend: Cell::new(f64::INFINITY),
            blocks: OnceCell::new(),
        }
    }

    pub fn evaluate(&self, z: &Place) -> Result<(DVector<f64>, Elimination), Error> {
        self.evaluations.set(self.evaluations.get() + 1);
        let p = z.p / self.weight;
        let at = self.family.linearised(&z.x, p)?.checked(&z.x, p)?;
        let eliminated = Elimination::new(&at.jacobian, &(at.slope / self.weight));
        Ok((at.residual, eliminated))
    }

    /// The unit null vector of [F_x F_p] and the determinant with it as the last row, over a scale common to the
    /// whole branch.
    pub fn null(&self, eliminated: &Elimination) -> (Place, f64) {
        let (null, determinant) = eliminated.null();
        let blocks = self.blocks.get_or_init(|| determinant.blocks());
        (null, determinant.over(*blocks))
    }

    /// Corrects `guess` to the branch within the hyperplane through it with the given normal; the first correction
    /// may not be longer than `reach`.
    pub fn correct(
        &self,
        guess: &Place,
        normal: &Place,
        reach: f64,
        finish: Finish,
    ) -> Result<Corrected, Failure> {
        let normal = normal.clone().unit();
        let (mut z, mut before, mut contraction) = (guess.clone(), f64::INFINITY, f64::INFINITY);
        for k in 0..self.max_corrections {
            let (residual, eliminated) = self.evaluate(&z).map_err(Failure::Undefined)?;
            let (null, determinant) = self.null(&eliminated);
            let slant = normal.dot(&null);
            if !(slant.abs() > 1e-8) {
                return Err(Failure::Parallel);
            }
            let any = eliminated.solve(&-&residual);
            let slide = normal.dot(&any) / slant;
            let step = any - &null * slide;
            let length = step.norm();
            if !step.is_finite() {
                return Err(Failure::Diverging(f64::INFINITY));
            }
            let moved = &z + step;
            let at = std::mem::replace(&mut z, moved);
            let scale = 1.0 + z.norm();
            let fine = length <= self.tolerance * scale;
            let shrinking = length / before;
            if k == 0 {
                contraction = self.bend.get() * length;
                if length > reach {
                    return Err(Failure::Far);
                }
            } else {
                if k == 1 {
                    contraction = shrinking;
                }
                if before > 1e-6 * scale {
                    let bend = length / (before * before);
                    let kept = self.bend.get();
                    let kept = if kept.is_finite() { 0.5 * kept } else { 0.0 };
                    self.bend.set(bend.max(kept));
                }
            }
            // A tolerance below rounding cannot be met: corrections stay at the level of rounding.
            let noise = shrinking > 0.5;
            let stays = noise && !fine;
            if stays && !self.is_rounding(length, &at, &residual, &eliminated, &normal) {
                return Err(Failure::Diverging(shrinking));
            }
            if stays {
                // Corrections at the level of rounding do not measure contraction.
                contraction = 0.0;
            }
            // Quadratic convergence; after the first correction by the largest recent bend, with a margin.
            let next = if k > 0 {
                length * shrinking * shrinking
            } else {
                100.0 * self.bend.get() * length * length
            };
            let rounding = 4.0 * f64::EPSILON * scale;
            let last = match finish {
                Finish::Predicted => next <= self.tolerance * scale || fine,
                Finish::Evaluated => fine && (length <= 0.01 * self.tolerance * scale || noise),
            };
            if last || stays || length <= rounding {
                let sign = slant.signum();
                // At the level of noise the last correction is the only estimate of the error.
                let measured = noise || finish == Finish::Evaluated;
                let error = if measured { length } else { next.min(length) };
                return Ok(Corrected {
                    place: z,
                    tangent: null * sign,
                    branching: determinant * sign,
                    regularity: eliminated.regularity(),
                    contraction,
                    error: error.max(rounding),
                });
            }
            before = length;
        }
        Err(Failure::Slow)
    }

    /// True if a correction of this length in the hyperplane across `normal`, near a place where F is `residual`, may
    /// be mere rounding of F.
    pub fn is_rounding(
        &self,
        length: f64,
        z: &Place,
        residual: &DVector<f64>,
        eliminated: &Elimination,
        normal: &Place,
    ) -> bool {
        let (null, _) = eliminated.null();
        let n = residual.len();
        let solve = |off: &DVector<f64>| {
            let any = eliminated.solve(&off.rows(0, n).into_owned());
            let slide = (normal.dot(&any) - off[n]) / normal.dot(&null);
            Some((any - &null * slide).flat())
        };
        let phi = |z: &DVector<f64>| {
            let z = Place::from_slice(z.as_slice());
            Some(self.matrix(&z)?.1.push(normal.dot(&z)))
        };
        let at_root = AtRoot {
            z: &z.flat(),
            value: &residual.clone().push(normal.dot(z)),
            phi,
            solve,
        };
        length <= MAX_ROUNDING_CORRECTION * (1.0 + z.norm()) && at_root.explains(length)
    }
}

/// A place on a branch with the unit tangent there.
#[derive(Debug, Clone)]
pub(crate) struct DirectedPlace {
    pub place: Place,
    pub tangent: Place,
}

/// The cubic through two places with tangents, over the distance along the branch.
#[derive(Debug, Clone)]
pub(crate) struct Cubic {
    pub a: Place,
    pub b: Place,
    pub da: Place,
    pub db: Place,
    pub length: f64,
}

impl Cubic {
    pub fn new(a: DirectedPlace, b: DirectedPlace) -> Self {
        Self {
            length: length(&a.place, &a.tangent, &b.place, &b.tangent),
            a: a.place,
            b: b.place,
            da: a.tangent,
            db: b.tangent,
        }
    }

    /// At the fraction `t` of the length (beyond 1: extrapolated).
    pub fn at(&self, t: f64) -> Place {
        let chord = &self.b - &self.a;
        &self.a
            + chord * (t * t * (3.0 - 2.0 * t))
            + &self.da * (self.length * t * (1.0 - t) * (1.0 - t))
            + &self.db * (self.length * t * t * (t - 1.0))
    }

    /// Derivative by `t`.
    pub fn slope(&self, t: f64) -> Place {
        let chord = &self.b - &self.a;
        chord * (6.0 * t * (1.0 - t))
            + &self.da * (self.length * (1.0 - t) * (1.0 - 3.0 * t))
            + &self.db * (self.length * t * (3.0 * t - 2.0))
    }

    /// Fraction at the middle of two turns of p inside, if p has the same direction at both ends.
    pub fn turns_twice(&self) -> Option<f64> {
        let (pa, pb) = (self.da.p * self.length, self.db.p * self.length);
        let rise = self.b.p - self.a.p;
        // p' = pa + t (6 rise - 4 pa - 2 pb) + 3 t^2 (pa + pb - 2 rise)
        let (c1, c2) = (
            6.0 * rise - 4.0 * pa - 2.0 * pb,
            3.0 * (pa + pb - 2.0 * rise),
        );
        let t = -c1 / (2.0 * c2);
        let value = pa + 0.5 * t * c1;
        let turns = value * pa.signum() < -1e-6 * self.length;
        (pa * pb > 0.0 && 0.0 < t && t < 1.0 && turns).then_some(t)
    }
}

/// Length of the branch between two places with unit tangents; the error is of fifth order.
pub(crate) fn length(a: &Place, da: &Place, b: &Place, db: &Place) -> f64 {
    let chord = b - a;
    let size = chord.norm();
    let along = chord.unit();
    let across = |t: &Place| t - &(&along * along.dot(t));
    let (u, v) = (across(da), across(db));
    size * (1.0 + (2.0 * u.dot(&u) + 2.0 * v.dot(&v) - u.dot(&v)) / 30.0)
}
