//! Systems of run-time size for solvers of fixed sizes: they are filled up with unknowns that are zero.
//!
//! Newton's method and the continuation are compiled for numbers of unknowns known in advance, which keeps the small problems
//! of single rods on the stack. An equation x = 0 beside the others changes neither their solutions nor their tangents,
//! lengths, determinants; it costs time alone.

use crate::error::{Error, Result};
use crate::solve::arclength::{Continuation, Item, Options, Point, Stop};
use crate::solve::family::{Family, Linearised};
use crate::solve::newton;
use crate::solve::special::{Special, SpecialKind, Status};
use nalgebra::{DMatrix, DVector, SMatrix, SVector};

/// The sizes that are compiled; the last is the most that there can be.
const SMALL: usize = 24;
pub(super) const MOST: usize = 72;

/// F(x, p) = 0.
pub(super) trait Equations {
    /// How many unknowns.
    fn size(&self) -> usize;

    /// F, dF/dx, dF/dp.
    fn linearised(&self, x: &[f64], p: f64) -> Result<(DVector<f64>, DMatrix<f64>, DVector<f64>)>;

    /// The Morse index, if there is one.
    fn index(&self, _x: &[f64], _p: f64) -> Result<Option<usize>> {
        Ok(None)
    }
}

/// As a family of N unknowns.
struct Padded<'a>(&'a dyn Equations);

impl<const N: usize> Family<N> for Padded<'_> {
    fn linearised(&self, x: &SVector<f64, N>, p: f64) -> Result<Linearised<N>> {
        let size = self.0.size();
        let (f, jacobian, slope) = self.0.linearised(&x.as_slice()[..size], p)?;
        let mut padded = Linearised {
            residual: *x,
            jacobian: SMatrix::identity(),
            slope: SVector::zeros(),
        };
        padded.residual.rows_mut(0, size).copy_from(&f);
        padded.slope.rows_mut(0, size).copy_from(&slope);
        padded
            .jacobian
            .view_mut((0, 0), (size, size))
            .copy_from(&jacobian);
        Ok(padded)
    }

    fn index(&self, x: &SVector<f64, N>, p: f64) -> Result<Option<usize>> {
        self.0.index(&x.as_slice()[..self.0.size()], p)
    }
}

fn padded<const N: usize>(x: &DVector<f64>) -> SVector<f64, N> {
    SVector::from_fn(|i, _| x.get(i).copied().unwrap_or(0.0))
}

fn cut<const N: usize>(x: &SVector<f64, N>, size: usize) -> DVector<f64> {
    DVector::from_column_slice(&x.as_slice()[..size])
}

/// Refuses what is too large.
pub(super) fn check(size: usize) -> Result<()> {
    if size <= MOST {
        return Ok(());
    }
    Err(Error::domain(format!(
        "the assembly has {size} unknowns in statics, 6 for each rod and rigid body and 3 for each point mass; {MOST} are the most, {} rods \
         and rigid bodies: solve it in parts; a motion of rods that close no loop may start from the unloaded ones, rest = \"straight\"",
        MOST / 6
    )))
}

/// A root and the length of the last correction.
#[derive(Debug, Clone, PartialEq)]
pub(super) struct Root {
    pub x: DVector<f64>,
    pub correction: f64,
}

/// Newton's method for F(x, p) = 0 at `p`.
pub(super) fn root(
    equations: &dyn Equations,
    x: &DVector<f64>,
    p: f64,
    options: &newton::Options,
) -> Result<Root> {
    fn sized<const N: usize>(
        equations: &dyn Equations,
        x: &DVector<f64>,
        p: f64,
        options: &newton::Options,
    ) -> Result<Root> {
        let family = Padded(equations);
        let system = |x: &SVector<f64, N>| {
            let at = family.linearised(x, p)?;
            Ok((at.residual, at.jacobian))
        };
        let solved = newton::solve(system, &padded(x), options)?;
        Ok(Root {
            x: cut(&solved.x, x.len()),
            correction: solved.correction,
        })
    }
    check(x.len())?;
    match x.len() {
        0..=SMALL => sized::<SMALL>(equations, x, p, options),
        _ => sized::<MOST>(equations, x, p, options),
    }
}

/// A point of a branch.
#[derive(Debug, Clone, PartialEq)]
pub(super) struct On {
    pub x: DVector<f64>,
    pub p: f64,
    pub arclength: f64,
    pub index: Option<usize>,
    pub error: f64,
}

/// A special point of a branch.
#[derive(Debug, Clone, PartialEq)]
pub(super) struct SpecialOn {
    pub kind: SpecialKind,
    pub status: Status,
    pub at: On,
    pub error_p: f64,
    pub error_s: f64,
    pub interval: (f64, f64),
    pub index: (Option<usize>, Option<usize>),
    pub turning: bool,
}

/// A branch.
#[derive(Debug, Clone)]
pub(super) struct Followed {
    pub points: Vec<On>,
    pub specials: Vec<SpecialOn>,
    pub stop: Stop,
    pub interrupted: bool,
}

/// The branch through (x, p). Special points are located again on `finer` equations, for bounds of their errors; it ends where
/// `go_on`, told the parameter, says no.
pub(super) fn follow(
    equations: &dyn Equations,
    finer: &[&dyn Equations],
    (x, p): (&DVector<f64>, f64),
    options: &Options,
    go_on: &mut dyn FnMut(f64) -> bool,
) -> Result<Followed> {
    fn point<const N: usize>(point: &Point<N>, size: usize) -> On {
        On {
            x: cut(&point.x, size),
            p: point.p,
            arclength: point.arclength,
            index: point.index,
            error: point.error,
        }
    }
    fn special<const N: usize>(special: &Special<N>, size: usize) -> SpecialOn {
        SpecialOn {
            kind: special.kind,
            status: special.status.clone(),
            at: point(&special.point, size),
            error_p: special.error_p,
            error_s: special.error_s,
            interval: special.interval,
            index: special.index,
            turning: special.turning,
        }
    }
    fn sized<const N: usize>(
        equations: &dyn Equations,
        finer: &[&dyn Equations],
        (x, p): (&DVector<f64>, f64),
        options: &Options,
        go_on: &mut dyn FnMut(f64) -> bool,
    ) -> Result<Followed> {
        let family = Padded(equations);
        let finer: Vec<Padded<'_>> = finer.iter().map(|finer| Padded(*finer)).collect();
        let finer: Vec<&dyn Family<N>> = finer.iter().map(|finer| finer as _).collect();
        let fine = Options {
            tolerance: (0.01 * options.tolerance).max(1e-12),
            ..options.clone()
        };
        let mut followed = Followed {
            points: Vec::new(),
            specials: Vec::new(),
            stop: Stop::MaxPoints,
            interrupted: false,
        };
        for item in Continuation::<N>::new(&family, padded(x), p, options.clone())? {
            let p = match item {
                Item::Point(found) => {
                    followed.points.push(point(&found, x.len()));
                    found.p
                }
                Item::Special(found) => {
                    let found = match finer.is_empty() {
                        true => found,
                        false => found.bounded(&finer, &fine),
                    };
                    followed.specials.push(special(&found, x.len()));
                    found.point.p
                }
                Item::Stop(stop) => {
                    followed.stop = stop;
                    break;
                }
            };
            if !go_on(p) {
                followed.interrupted = true;
                break;
            }
        }
        Ok(followed)
    }
    check(x.len())?;
    match x.len() {
        0..=SMALL => sized::<SMALL>(equations, finer, (x, p), options, go_on),
        _ => sized::<MOST>(equations, finer, (x, p), options, go_on),
    }
}
