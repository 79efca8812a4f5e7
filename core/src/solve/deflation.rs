//! Further solutions at the same parameter, by deflation: known solutions are made repelling.
//!
//! Farrell, Birkisson and Funke, Deflation techniques for finding distinct solutions of nonlinear partial
//! differential equations (SIAM J. Sci. Comput. 37, 2015): Newton on m(x) F(x) with m = product of (|x - x_i|^-2 +
//! shift). New solutions lie off the known ones, so also on branches that no path connects to the known ones. A
//! search without result does not prove that no other solution exists.

use super::elimination::Elimination;
use super::newton;
use super::parametrised_problem::{Family, check_size};
use crate::error::{Error, Result};
use nalgebra::{DMatrix, DVector};

/// Options of the search.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Options {
    /// Options of each Newton iteration.
    pub newton: newton::Options,
    /// Shift of m, which keeps far solutions attractive; > 0.
    pub shift: f64,
    /// Solutions nearer than this, relative to 1 + |x|, are one; > 0.
    pub separation: f64,
}

impl Default for Options {
    /// Shift 1, separation 1e-6, Newton's defaults.
    fn default() -> Self {
        Self {
            newton: newton::Options::default(),
            shift: 1.0,
            separation: 1e-6,
        }
    }
}

/// Result of a search.
#[derive(Debug, Clone, PartialEq)]
pub struct Search {
    /// New solutions, distinct from each other and from the known ones, each with its Newton report
    /// (the last, undeflated iteration).
    pub solutions: Vec<newton::Solution>,
    /// For each guess, the error that ended the search.
    pub ends: Vec<Error>,
    /// Evaluations of F.
    pub evaluations: usize,
}

/// Further solutions of F(x, p) = 0 at this `p`. Newton is repeated from each guess, each time with all solutions up
/// to now deflated, until no new solution is found.
///
/// Solutions have the accuracy of [`newton::solve`], which finishes each of them undeflated.
///
/// # Errors
/// Options outside their sets. A search without result is no error.
pub fn find_further(
    family: &dyn Family,
    p: f64,
    known: &[DVector<f64>],
    guesses: &[DVector<f64>],
    options: &Options,
) -> Result<Search> {
    for (name, value) in [("shift", options.shift), ("separation", options.separation)] {
        if !(0.0 < value && value < f64::INFINITY) {
            return Err(Error::domain(format!(
                "deflation: {name} = {value} must be positive"
            )));
        }
    }
    options.newton.check()?;
    for (what, all) in [("a known solution", known), ("a guess", guesses)] {
        for x in all {
            check_size(family, what, x)?;
        }
    }
    let mut all = known.to_vec();
    let mut search = Search {
        solutions: Vec::new(),
        ends: Vec::new(),
        evaluations: 0,
    };
    let count = std::cell::Cell::new(0);
    let plain = |x: &DVector<f64>| {
        count.set(count.get() + 1);
        let at = family.linearised(x, p)?.checked(x, p)?;
        Ok((at.residual, at.jacobian))
    };
    for guess in guesses {
        let end = loop {
            let found = starts(guess, &all, options.separation)
                .into_iter()
                .map(|start| {
                    let deflated = |x: &DVector<f64>| {
                        let (f, jacobian) = plain(x)?;
                        let (m, gradient) = deflation(x, &all, options.shift);
                        let jacobian = (jacobian + &f * gradient.transpose()) * m;
                        Ok((f * m, jacobian))
                    };
                    newton::solve(deflated, &start, &options.newton)
                        .map(|rough| rough.x)
                        .or_else(|_| undamped_newton(deflated, start))
                        .and_then(|rough| newton::solve(plain, &rough, &options.newton))
                })
                .reduce(Result::or)
                .unwrap_or_else(|| Err(Error::no_convergence("no start")));
            match found {
                Ok(solution)
                    if all
                        .iter()
                        .any(|x| is_near(x, &solution.x, options.separation)) =>
                {
                    break Error::no_convergence(format!(
                        "the search fell back to a known solution, whose largest unknown is {:.3e}",
                        solution.x.amax()
                    ));
                }
                Ok(solution) => {
                    all.push(solution.x.clone());
                    search.solutions.push(solution);
                }
                Err(e) => break e,
            }
        };
        search.ends.push(end);
    }
    search.evaluations = count.get();
    Ok(search)
}

/// The guess; if it lies on a pole of m, a point on either side of the pole.
fn starts(guess: &DVector<f64>, known: &[DVector<f64>], separation: f64) -> Vec<DVector<f64>> {
    if known.iter().any(|x| is_near(x, guess, separation)) {
        let aside = 1e-2 * (1.0 + guess.norm());
        vec![guess.add_scalar(aside), guess.add_scalar(-aside)]
    } else {
        vec![guess.clone()]
    }
}

/// Newton without damping: a damped iteration never leaps over a pole of m, and in few dimensions
/// solutions lie behind poles.
fn undamped_newton(
    system: impl Fn(&DVector<f64>) -> Result<(DVector<f64>, DMatrix<f64>)>,
    start: DVector<f64>,
) -> Result<DVector<f64>> {
    let mut x = start.clone();
    let far = 10.0 * (1.0 + start.norm());
    for _ in 0..40 {
        let (f, jacobian) = system(&x)?;
        let step = Elimination::new(&jacobian, &DVector::zeros(x.len()))
            .solve(&-f)
            .x;
        let length = step.norm();
        if !(length.is_finite() && x.norm() < far) {
            break;
        }
        x += step * ((1.0 + x.norm()) / length).min(1.0);
        if length <= 1e-6 * (1.0 + x.norm()) {
            return Ok(x);
        }
    }
    Err(Error::no_convergence(format!(
        "neither damped nor undamped steps of Newton's method found a further solution from a guess whose largest unknown is {:.3e}; try \
         other guesses",
        start.amax()
    )))
}

fn is_near(a: &DVector<f64>, b: &DVector<f64>, separation: f64) -> bool {
    (a - b).norm() <= separation * (1.0 + a.norm())
}

/// m and the gradient of ln m.
fn deflation(x: &DVector<f64>, known: &[DVector<f64>], shift: f64) -> (f64, DVector<f64>) {
    let (mut m, mut gradient) = (1.0, DVector::zeros(x.len()));
    for solution in known {
        let d = x - solution;
        let square = d.norm_squared();
        m *= 1.0 / square + shift;
        gradient -= d * (2.0 / (square * (1.0 + shift * square)));
    }
    (m, gradient)
}
