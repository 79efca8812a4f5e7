//! Roots of the equations of statics: homotopy paths, falls from unstable equilibria, Newton's method.

use super::configuration::Configuration;
use super::equations::UnknownScales;
use super::network::Assembly;
use crate::error::{Error, Result};
use crate::solve::arclength::{Continuation, Options, Stop};
use crate::solve::newton;
use crate::solve::parametrised_problem::{Family, Linearised};
use nalgebra::DVector;

/// Stiffness, in the units of the balance, of springs on the bodies at the start of a homotopy, slackened along it.
/// Without them an otherwise unconstrained motion (a body that can spin about a ball joint) would leave no path.
const SPRING: f64 = 0.1;
/// Homotopy parameter beyond which a stuck path is accepted: an equilibrium that is free to move is a singular end.
const NEARLY: f64 = 0.99;
/// Relative singular value of the Jacobian below which a direction counts as neutral.
const NEUTRAL: f64 = 1e-7;
/// Largest number of least-norm steps.
const MOST_SETTLING: usize = 20;
/// Residual, in multiples of the tolerance, up to which an assembly with neutral directions is solved. Larger ones
/// mean an unbalanced load: then, too, steps end, far away or without descent.
const MAX_NEUTRAL_RESIDUAL: f64 = 1e3;

/// Displacement by which bodies are let go beside an unstable equilibrium, in radians and mean rod lengths.
const ASIDE: f64 = 0.02;
/// Relative stiffness of the springs at the end of a fall.
const SLACK: f64 = 1e-4;
/// Longest step of a fall, relative to the unknowns: Newton's method may end far away.
const LEAP: f64 = 1.0;
/// Largest number of steps of a fall.
const MOST_FALLING: usize = 60;
/// Newton options in a fall. Steps are short and inexact; a step without quick convergence is too long.
const STEP: newton::Options = newton::Options {
    tolerance: 1e-6,
    max_iterations: 8,
    min_damping: 0.1,
};

/// A failed path: largest parameter reached, reason, and whether the path was only too long.
pub(super) struct FailedPath {
    pub part: f64,
    pub why: Error,
    pub long: bool,
}

impl FailedPath {
    pub(super) fn at_once(why: Error) -> Self {
        let (part, long) = (0.0, false);
        Self { part, why, long }
    }
}

/// Equations of statics at t = 0, or of a homotopy.
pub(super) struct Statics<'a> {
    assembly: &'a Assembly,
    pub(super) frame: UnknownScales,
    pub(super) tolerance: f64,
    /// R(y0) of the homotopy with parameter p; None for the equations themselves.
    pub(super) start: Option<DVector<f64>>,
}

/// Bounds of a path: number of points, and longest step in the units of charts.
pub(super) type PathBounds = (usize, f64);
/// Bounds while other paths remain to be tried.
pub(super) const BRIEF: PathBounds = (150, 50.0);
/// Bounds of a long path: the forces of taut rods are far away, but nothing happens on the way.
pub(super) const FAR: PathBounds = (400, 1e12);

/// A root and the length of the last correction.
pub(super) struct Root {
    pub x: DVector<f64>,
    pub correction: f64,
}

impl Family for Statics<'_> {
    fn size(&self) -> usize {
        self.assembly.unknowns()
    }

    fn linearised(&self, x: &DVector<f64>, p: f64) -> Result<Linearised> {
        let x = x.as_slice();
        let now = self.frame.configuration(self.assembly, x);
        self.frame.check(self.assembly, x, &now)?;
        let points = self
            .assembly
            .points(0.0, &now.bodies, &now.charts, self.tolerance)?;
        let mut residual = self.frame.residual(self.assembly, &now.bodies, &points);
        let mut jacobian = self.frame.jacobian(self.assembly, x, &now.bodies, &points);
        let Some(start) = &self.start else {
            return Ok(Linearised {
                slope: DVector::zeros(residual.len()),
                residual,
                jacobian,
            });
        };
        let mut slope = start.clone();
        for i in 0..self.assembly.freedoms().1 {
            slope[i] += SPRING * x[i];
            jacobian[(i, i)] -= (1.0 - p) * SPRING;
        }
        residual -= &slope * (1.0 - p);
        Ok(Linearised {
            residual,
            jacobian,
            slope,
        })
    }
}

impl<'a> Statics<'a> {
    pub(super) fn new(assembly: &'a Assembly, now: &Configuration, tolerance: f64) -> Self {
        Self {
            assembly,
            frame: UnknownScales::new(assembly, now.bodies.iter().map(|place| place.pose)),
            tolerance: (0.01 * tolerance).clamp(1e-14, 1e-9),
            start: None,
        }
    }

    /// End of the path from x, and whether it is stuck just before.
    pub(super) fn followed(
        &self,
        x: DVector<f64>,
        (points, step): PathBounds,
    ) -> std::result::Result<(DVector<f64>, bool), FailedPath> {
        let options = Options {
            initial_step: 0.1,
            max_step: step,
            tolerance: 1e-7,
            max_points: points,
            special: false,
            ..Options::between(0.0, 1.0)
        };
        let path = Continuation::new(self, x, 0.0, options).map_err(FailedPath::at_once)?;
        let followed = path.trace();
        let far = followed.points.iter().map(|point| point.p);
        let part = far.fold(0.0, f64::max);
        let (long, why) = match (followed.stop, followed.points.last()) {
            (Stop::Reached, Some(last)) => return Ok((last.x.clone(), false)),
            (_, Some(last)) if last.p > NEARLY => return Ok((last.x.clone(), true)),
            (Stop::Undefined { reason, .. }, _) => (false, reason),
            (Stop::MaxPoints, _) => {
                let why = "the path took too many steps; give a guess, or lower the loads and follow a branch up to them";
                (true, Error::no_convergence(why))
            }
            (stop, _) => (false, Error::no_convergence(stop.to_string())),
        };
        Err(FailedPath { part, why, long })
    }

    /// Fall from an unstable equilibrium towards one side (`way` 1 or -1). Each step goes to the equilibrium with
    /// springs at the last configuration, stiff enough to make that stable, which lowers the energy. Where the bodies
    /// are stable without, the springs slacken. None if `x` is not unstable, the rods cannot be followed, or the fall
    /// takes too many steps.
    pub(super) fn fallen(&self, x: &DVector<f64>, way: f64) -> Option<DVector<f64>> {
        let (least, direction) = self.softest(x).filter(|(least, _)| *least < 0.0)?;
        let mut x = x + direction * (way * ASIDE);
        let mut spring = -2.0 * least;
        let slack = SLACK * spring;
        for _ in 0..MOST_FALLING {
            let held = |y: &DVector<f64>| {
                let Linearised {
                    mut residual,
                    mut jacobian,
                    ..
                } = self.linearised(y, 0.0)?;
                for i in 0..self.assembly.freedoms().1 {
                    residual[i] -= spring * (y[i] - x[i]);
                    jacobian[(i, i)] -= spring;
                }
                Ok((residual, jacobian))
            };
            let next = newton::solve(held, &x, &STEP).ok();
            match next.filter(|next| (&next.x - &x).norm() <= LEAP * (1.0 + x.norm())) {
                Some(next) => {
                    x = next.x;
                    spring = (-2.0 * self.softest(&x)?.0).max(0.3 * spring);
                }
                None => spring *= 4.0,
            }
            if spring <= slack {
                return Some(x);
            }
        }
        None
    }

    /// Least stiffness of the bodies with the rods following, and its direction in the unknowns.
    fn softest(&self, x: &DVector<f64>) -> Option<(f64, DVector<f64>)> {
        let jacobian = self.linearised(x, 0.0).ok()?.jacobian;
        let (n, bodies) = (x.len(), self.assembly.freedoms().1);
        // Rods between places on the ground alone move no body.
        if bodies == 0 {
            return None;
        }
        let rods = jacobian.view((bodies, bodies), (n - bodies, n - bodies));
        let ends = jacobian.view((bodies, 0), (n - bodies, bodies));
        let follow = -rods.into_owned().lu().solve(&ends)?;
        let forces = jacobian.view((0, bodies), (bodies, n - bodies));
        let stiffness = -(jacobian.view((0, 0), (bodies, bodies)) + forces * &follow);
        if !stiffness.iter().all(|k| k.is_finite()) {
            return None;
        }
        let modes = (0.5 * (&stiffness + stiffness.transpose())).symmetric_eigen();
        let (least, value) = modes.eigenvalues.argmin();
        let mode = modes.eigenvectors.column(least);
        let mut direction = DVector::zeros(n);
        direction.rows_mut(0, bodies).copy_from(&mode);
        direction
            .rows_mut(bodies, n - bodies)
            .copy_from(&(follow * mode));
        Some((value, direction))
    }

    /// False for unbalanced loads on neutral directions: a residual above `MAX_NEUTRAL_RESIDUAL` times the tolerance,
    /// relative to the charts. Always true if every body is held.
    fn solves(&self, x: &DVector<f64>, tolerance: f64) -> bool {
        let charts = x.iter().skip(self.assembly.freedoms().1);
        let most = charts.fold(1.0, |most: f64, q| most.max(q.abs()));
        let left = || self.linearised(x, 0.0).map(|at| at.residual.amax());
        self.assembly.is_held()
            || left().is_ok_and(|left| left <= MAX_NEUTRAL_RESIDUAL * tolerance * most)
    }
}

/// Newton's method. If it fails on a member of a continuous family, least-norm steps follow (a column of equal
/// bending stiffnesses buckles in any direction, a body turns about a ball joint).
pub(super) fn solved(statics: &Statics<'_>, x: &DVector<f64>, tolerance: f64) -> Result<Root> {
    let options = newton::Options {
        tolerance,
        ..newton::Options::default()
    };
    let system = |x: &DVector<f64>| {
        let at = statics.linearised(x, 0.0)?;
        Ok((at.residual, at.jacobian))
    };
    match newton::solve(system, x, &options) {
        Ok(found) if statics.solves(&found.x, tolerance) => Ok(Root {
            x: found.x,
            correction: found.correction,
        }),
        found => settled(statics, x, tolerance).ok_or_else(|| match found {
            Err(why) => why,
            Ok(_) => Error::no_convergence("nothing bears the loads"),
        }),
    }
}

/// Least-norm steps to an equilibrium that is free to move.
pub(super) fn settled(statics: &Statics<'_>, x: &DVector<f64>, tolerance: f64) -> Option<Root> {
    let (mut x, mut last) = (x.clone(), f64::INFINITY);
    for _ in 0..MOST_SETTLING {
        let at = statics.linearised(&x, 0.0).ok()?;
        let size = at.jacobian.norm();
        let step = at
            .jacobian
            .svd(true, true)
            .solve(&at.residual, NEUTRAL * size)
            .ok()?;
        let correction = step.norm();
        let fine = correction <= tolerance * (1.0 + x.norm());
        let rounding = 4.0 * f64::EPSILON * (1.0 + x.norm());
        if fine && (correction > 0.5 * last || correction <= rounding) {
            return statics
                .solves(&x, tolerance)
                .then_some(Root { x, correction });
        }
        if !fine && !(correction < 0.9 * last) {
            return None;
        }
        last = correction;
        x -= step;
    }
    None
}
