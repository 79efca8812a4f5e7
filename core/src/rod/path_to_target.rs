//! Continuation of a solution from an easy problem to the given one, in any chart.

use super::chart::{AnyChart, Equations};
use super::equilibrium::{Equilibrium, Route};
use super::ivp;
use super::problem::Problem;
use crate::error::{Error, Result};
use crate::solve::newton::{self, Failure, REMEDY, Solution};
use nalgebra::DVector;
use std::cell::{Cell, RefCell};

/// First and smallest step of a path, as fractions of the path.
const FIRST: f64 = 0.25;
const SMALLEST: f64 = 2e-4;
/// Distance, in the numerics' units, within which any prediction is good.
const CLOSE: f64 = 0.3;
/// Most Newton steps in one step of a path.
const PATIENCE: usize = 7;
/// Damping factor of Newton's method below which a prediction counts as off the path: under a heavy pull other shapes
/// have almost the same wrench.
const MIN_PATH_DAMPING: f64 = 0.9;
/// Singular values below this part of the Jacobian count as zero: directions in which the equilibrium is free to
/// move.
const NEUTRAL: f64 = 1e-7;
/// Largest winding rate of a trial, in radians along the rod, beyond three times that of the unloaded rod. A Newton
/// step from a nearly singular rod may ask for more, at great cost.
const MAX_WINDING: f64 = 200.0;

/// Evaluations of the rod after which a search is abandoned.
const BUDGET: usize = 4000;

/// Budget and failures shared by all paths to a solution.
pub(super) struct PathSearch {
    evaluations: Cell<usize>,
    starts: Cell<usize>,
    /// Fraction reached by the farthest of the failed paths, and its error.
    farthest: RefCell<Option<(f64, Error)>>,
    heavy: RefCell<Option<Error>>,
    reached: Cell<f64>,
}

impl PathSearch {
    pub(super) fn new() -> Self {
        Self {
            evaluations: Cell::new(0),
            starts: Cell::new(0),
            farthest: RefCell::new(None),
            heavy: RefCell::new(None),
            reached: Cell::new(0.0),
        }
    }

    /// True if the budget is spent.
    pub(super) fn is_over(&self) -> bool {
        self.evaluations.get() > BUDGET
    }

    /// Records the failure of a path.
    pub(super) fn failed(&self, why: Error) {
        self.starts.set(self.starts.get() + 1);
        let reached = self.reached.replace(0.0);
        if why.is_ill_conditioned() {
            self.heavy.replace(Some(why));
        } else if (self.farthest.borrow().as_ref()).is_none_or(|(best, _)| reached >= *best) {
            self.farthest.replace(Some((reached, why)));
        }
    }

    /// The error of a search without a result.
    pub(super) fn error(&self) -> Error {
        if let Some(why) = &*self.heavy.borrow() {
            return why.clone();
        }
        let starts = self.starts.get();
        let tried = format!(
            "no equilibrium was found from {starts} starts in {} evaluations of the rod; give a guess in [start], or reach the end \
             with [continue] from an easier one",
            self.evaluations.get()
        );
        match &*self.farthest.borrow() {
            Some((reached, why)) => why.clone().context(format!(
                "{tried}; the farthest path came {:.1} % of its way",
                100.0 * reached
            )),
            None => Error::no_convergence(tried),
        }
    }

    /// Replaces an unstable answer by the error of a stable one that double precision could not represent, if there
    /// was one: the caller asked for the stable equilibrium.
    pub(super) fn verdict(&self, found: Result<Equilibrium>) -> Result<Equilibrium> {
        match (&found, &*self.heavy.borrow()) {
            (Ok(found), Some(why)) if found.index > 0 => Err(why.clone()),
            _ => found,
        }
    }
}

/// Options of Newton's method for a problem.
pub(super) fn options(tolerance: f64, max_iterations: usize) -> newton::Options {
    newton::Options {
        tolerance,
        max_iterations,
        ..newton::Options::default()
    }
}

/// Newton's method in a chart.
pub(super) fn newton(
    chart: &dyn AnyChart,
    problem: &Problem,
    guess: &DVector<f64>,
    options: &newton::Options,
) -> Result<Solution> {
    let solved = newton::attempt(|x| chart.equations(problem, x), guess, options);
    solved.map_err(|failure| match &failure {
        Failure::Stopped {
            x,
            evaluations,
            why,
            ..
        } => match chart.wrench(problem, x) {
            Ok(b) => Error::no_convergence(format!(
                "Newton's method stopped after {evaluations} evaluations at the base wrench of {}: {why}; {REMEDY}",
                problem.rod.law.wrench_text(&b)
            )),
            Err(_) => failure.into(),
        },
        Failure::Refused(_) => failure.into(),
    })
}

pub(super) fn budgeted_equations(
    chart: &dyn AnyChart,
    search: &PathSearch,
    problem: &Problem,
    x: &DVector<f64>,
) -> Result<Equations> {
    search.evaluations.set(search.evaluations.get() + 1);
    if search.is_over() {
        return Err(Error::no_convergence("the search has taken too long"));
    }
    let unloaded = ivp::rate(&problem.rod.law, &ivp::Wrench::zeros())?;
    if !(chart.winding(problem, x)? < MAX_WINDING + 3.0 * unloaded) {
        return Err(Error::no_convergence(format!(
            "the next trial wrench would wind the rod up by more than {MAX_WINDING} radians"
        )));
    }
    chart.equations(problem, x)
}

/// Follows the solution of `at(part)` from part = 0, where the solution is `x`, to 1.
pub(super) fn follow(
    chart: &dyn AnyChart,
    search: &PathSearch,
    x: DVector<f64>,
    route: &mut Route,
    whence: &str,
    at: &dyn Fn(f64) -> Problem,
) -> Result<Solution> {
    let mut done = (0.0, x);
    let mut before: Option<(f64, DVector<f64>)> = None;
    let mut step = FIRST;
    loop {
        let part = (done.0 + step).min(1.0);
        let guess = match &before {
            Some((p, x)) => &done.1 + (&done.1 - x) * ((part - done.0) / (done.0 - p)),
            None => done.1.clone(),
        };
        let problem = at(part);
        let fine = problem.correction();
        let loose = if part < 1.0 { 1e-6 } else { fine };
        let mut outcome = newton::solve(
            |x| budgeted_equations(chart, search, &problem, x),
            &guess,
            &options(loose, PATIENCE),
        );
        if part >= 1.0 && outcome.is_err() {
            outcome = settle(chart, search, &problem, &guess);
        }
        // Reject jumps to another solution: the prediction must have been good.
        let on_path = |solved: &Solution| {
            let missed = (&solved.x - &guess).norm();
            let near = before.is_none() || missed < 0.5 * (&solved.x - &done.1).norm() + CLOSE;
            solved.damping > MIN_PATH_DAMPING && near
        };
        match outcome {
            Ok(solved) if on_path(&solved) => {
                route.add(&solved);
                route.steps += 1;
                if part >= 1.0 {
                    return Ok(solved);
                }
                if solved.iterations <= 4 {
                    step *= 1.6;
                }
                before = Some(std::mem::replace(&mut done, (part, solved.x)));
            }
            other => {
                step *= 0.4;
                if step < SMALLEST {
                    let why = other.err().unwrap_or_else(|| {
                        Error::no_convergence("Newton's method leaves the path: a fold is near")
                    });
                    search.reached.set(search.reached.get().max(done.0));
                    return Err(why.context(format!(
                        "on the way {whence}, after {:.2} % of it",
                        100.0 * done.0
                    )));
                }
            }
        }
    }
}

/// Newton steps of least length, for an equilibrium in a continuous family (a column of equal bending stiffnesses
/// buckles in any plane). Plain Newton steps are singular there; these find the nearest member.
fn settle(
    chart: &dyn AnyChart,
    search: &PathSearch,
    problem: &Problem,
    guess: &DVector<f64>,
) -> Result<Solution> {
    let mut x = guess.clone();
    let mut last = f64::INFINITY;
    for iterations in 0..2 * PATIENCE {
        let (value, jacobian) = budgeted_equations(chart, search, problem, &x)?;
        let size = jacobian.norm();
        let step = jacobian
            .svd(true, true)
            .solve(&value, NEUTRAL * size)
            .map_err(Error::no_convergence)?;
        let correction = step.norm();
        let fine = correction <= problem.correction() * (1.0 + x.norm());
        // Iterate down to the noise: the neutral eigenvalue must come out as zero.
        if fine && correction > 0.5 * last {
            return Ok(Solution {
                x,
                iterations,
                evaluations: iterations + 1,
                damping: 1.0,
                residual: value.norm(),
                correction,
                reason: newton::Reason::Noise,
            });
        }
        if !fine && !(correction < 0.9 * last) {
            break;
        }
        last = correction;
        x -= step;
    }
    Err(Error::no_convergence(
        "neither Newton's method nor steps of least length converge at the end of the path",
    ))
}
