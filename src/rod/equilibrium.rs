//! Solving a problem: from a guess, or from the unloaded rod by continuation.

use super::line::Wrench;
use super::problem::Problem;
use super::{Rod, RodSection};
use crate::error::{Error, Result};
use crate::solve::newton::{self, Solution};
use nalgebra::{Rotation3, UnitQuaternion, Vector3, Vector6};

/// An equilibrium of a rod, and how it was found.
#[derive(Debug, Clone, PartialEq)]
pub struct Equilibrium {
    /// Base wrench (m(0), n) in the world frame.
    pub base: Wrench,
    /// The section at the end: pose, couple and force there, energy of the rod.
    pub end: RodSection,
    /// Morse index under the end condition; 0 is stable.
    pub index: usize,
    /// Size of the equations left over, in the numerics' units (length, B/L, B/L^2).
    pub residual: f64,
    /// How it was found.
    pub route: Route,
}

/// How an equilibrium was found.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Route {
    /// From the user's guess, or else from the unloaded rod by continuation.
    pub from_guess: bool,
    /// Steps of the continuation.
    pub steps: usize,
    /// The path began at a bent rod, to lead it past a bifurcation or a singular straight rod.
    pub imperfect: bool,
    /// Newton steps, all in all.
    pub iterations: usize,
    /// Evaluations of the rod with its tangent, all in all.
    pub evaluations: usize,
    /// The smallest damping factor of Newton's method; 1 if never damped.
    pub damping: f64,
}

/// Intrinsic flexures (u1, u2, u3 times L) that lead past bifurcations: generic directions, so that no symmetry is kept.
const IMPERFECTIONS: [[f64; 3]; 4] = [
    [0.11, 0.23, 0.01],
    [0.21, -0.13, -0.02],
    [-0.12, -0.22, 0.015],
    [0.7, 0.4, 0.05],
];
/// Singular values below this part of the Jacobian are directions in which the equilibrium is free to move.
const NEUTRAL: f64 = 1e-7;

/// Where a path begins.
#[derive(Debug, Clone, Copy, PartialEq)]
enum Start {
    /// The unloaded rod.
    Unloaded,
    /// The unloaded rod with an intrinsic curvature that is taken back at the end.
    Bent(Vector3<f64>),
    /// The rod under a base wrench (the numerics' units).
    Loaded(Wrench),
}

/// First and smallest step of the continuation from the unloaded rod, as fractions of the way.
const FIRST: f64 = 0.25;
const SMALLEST: f64 = 2e-4;
/// Newton steps allowed in one step of a path.
const PATIENCE: usize = 8;

impl Problem {
    /// Solves the problem; without a guess by continuation from the unloaded rod.
    ///
    /// Loads and poses grow in proportion from the unloaded rod. If the path ends on an unstable equilibrium, or cannot be
    /// followed, it is walked again with small intrinsic curvatures that are taken back at the end: the first
    /// stable equilibrium is the answer, or else the one of lowest index.
    ///
    /// # Errors
    /// No convergence from the guess, or on any path; the message says how far the best one came.
    pub fn solve(&self, guess: Option<&Wrench>) -> Result<Equilibrium> {
        if let Some(guess) = guess {
            let solved = newton::solve(
                |b| self.evaluate(b),
                &self.rod.inward(guess),
                &self.options(self.correction(), 60),
            )?;
            let route = Route {
                from_guess: true,
                ..Route::start()
            };
            return self.describe(&solved, route);
        }
        let straight = self.walk(Start::Unloaded);
        if let Ok(found) = &straight
            && (found.index == 0 || self.is_follower())
        {
            return straight;
        }
        let mut best = straight;
        let bent = IMPERFECTIONS.map(|bend| Start::Bent(bend.into()));
        for start in bent.into_iter().chain(self.arcs()) {
            let Ok(found) = self.walk(start) else {
                continue;
            };
            if best.as_ref().map_or(true, |b| found.index < b.index) {
                let stable = found.index == 0;
                best = Ok(found);
                if stable {
                    break;
                }
            }
        }
        best
    }

    /// Newton's tolerance: a little above the noise of the integration.
    fn correction(&self) -> f64 {
        (10.0 * self.tolerance).max(1e-12)
    }

    fn options(&self, tolerance: f64, max_iterations: usize) -> newton::Options {
        newton::Options {
            tolerance,
            max_iterations,
            ..newton::Options::default()
        }
    }

    fn describe(&self, solved: &Solution<6>, route: Route) -> Result<Equilibrium> {
        Ok(Equilibrium {
            base: self.rod.outward_wrench(&solved.x),
            end: self.end_section(&solved.x)?,
            index: self.index(&solved.x)?,
            residual: self.residual(&self.bare_trial(&solved.x)?).norm(),
            route: route.and(solved),
        })
    }

    /// Arcs of a circle, made by couples, whose chord is as long as the distance to be held: the other starts when the unloaded
    /// rod cannot be moved (a straight inextensible rod is singular) or its path ends in a fold.
    fn arcs(&self) -> Vec<Start> {
        if !self.end.position.iter().all(Option::is_some) {
            return Vec::new();
        }
        let target: Vector3<f64> = (0..3).map(|i| self.axes[i] * self.targets[i]).sum();
        let chord = target.norm().clamp(0.05, 0.98);
        // 2 sin(k/2)/k = chord, by Newton's method from the small-angle value.
        let mut k = (24.0 * (1.0 - chord)).sqrt();
        for _ in 0..30 {
            let (s, c) = (0.5 * k).sin_cos();
            k -= (2.0 * s / k - chord) / (c / k - 2.0 * s / (k * k));
        }
        let across = Vector3::z().cross(&target);
        let axis = if across.norm() > 1e-3 {
            across.normalize()
        } else {
            Vector3::new(0.6, 0.8, 0.0)
        };
        let side = Vector3::z().cross(&axis);
        [
            axis,
            (axis + 0.5 * side).normalize(),
            (axis - 0.5 * side).normalize(),
            side,
            -side,
            -axis,
        ]
        .map(|axis| {
            let m = axis * k;
            // A little force, so that no symmetry is kept.
            Start::Loaded(Vector6::new(m.x, m.y, m.z, 0.1, 0.07, 0.05))
        })
        .to_vec()
    }

    /// The rod led from `start` to the end condition.
    fn walk(&self, start: Start) -> Result<Equilibrium> {
        let bend = match start {
            Start::Bent(bend) => bend,
            _ => Vector3::zeros(),
        };
        let b = match start {
            Start::Loaded(b) => b,
            _ => Wrench::zeros(),
        };
        let mut route = Route {
            imperfect: start != Start::Unloaded,
            ..Route::start()
        };
        let first = Problem {
            rod: self.bent(bend),
            ..self.clone()
        };
        let (section, _) = super::line::end::<0>(&first.rod.law, &b, self.tolerance)?;
        let (r, rotation) = (section.position(), section.rotation());
        let n = b.fixed_rows::<3>(3).into_owned();
        let couple = b.fixed_rows::<3>(0) - r.cross(&n);
        let turn = self.orientation.map(|target| {
            UnitQuaternion::from_rotation_matrix(&Rotation3::from_matrix_unchecked(
                target * rotation.transpose(),
            ))
            .scaled_axis()
        });
        let mut solved = self.follow(b, &mut route, "from the unloaded rod", |part| {
            let mut way = first.clone();
            way.couple = couple + (self.couple - couple) * part;
            for i in 0..3 {
                let from = match self.end.position[i] {
                    Some(_) => self.axes[i].dot(&r),
                    None => self.axes[i].dot(&n),
                };
                way.targets[i] = from + part * (self.targets[i] - from);
            }
            way.orientation = turn.map(|turn| {
                UnitQuaternion::from_scaled_axis(turn * part)
                    .to_rotation_matrix()
                    .matrix()
                    * rotation
            });
            way
        })?;
        if bend != Vector3::zeros() {
            solved = self.follow(solved.x, &mut route, "from the bent rod", |part| Problem {
                rod: self.bent(bend * (1.0 - part)),
                ..self.clone()
            })?;
        }
        self.describe(&solved, route)
    }

    fn bent(&self, bend: Vector3<f64>) -> Rod {
        Rod {
            law: self.rod.law.bent(bend),
            ..self.rod.clone()
        }
    }

    /// Follows the solution of `at(part)` from part = 0, where `b` solves it, to 1.
    fn follow(
        &self,
        b: Wrench,
        route: &mut Route,
        whence: &str,
        at: impl Fn(f64) -> Problem,
    ) -> Result<Solution<6>> {
        let mut done = (0.0, b);
        let mut before: Option<(f64, Wrench)> = None;
        let mut step = FIRST;
        loop {
            let part = (done.0 + step).min(1.0);
            let guess = match &before {
                Some((p, b)) => done.1 + (done.1 - b) * ((part - done.0) / (done.0 - p)),
                None => done.1,
            };
            let problem = at(part);
            let loose = if part < 1.0 { 1e-6 } else { self.correction() };
            let mut outcome = newton::solve(
                |b| problem.evaluate(b),
                &guess,
                &self.options(loose, PATIENCE),
            );
            if part >= 1.0 && outcome.is_err() {
                outcome = problem.settle(&guess);
            }
            match outcome {
                // A jump to another solution is no step of the path.
                Ok(solved) if solved.damping > 0.2 => {
                    *route = route.and(&solved);
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
                        return Err(why.context(format!(
                            "on the way {whence}, after {:.2} % of it; give a guess in [start], or reach the end with [continue]",
                            100.0 * done.0
                        )));
                    }
                }
            }
        }
    }

    /// Steps of least length where the equilibrium is one of a continuous family (a column of equal bending stiffnesses
    /// buckles any way round): Newton's method finds no single solution there, these find the nearest.
    fn settle(&self, guess: &Wrench) -> Result<Solution<6>> {
        let mut x = *guess;
        let mut last = f64::INFINITY;
        for iterations in 0..PATIENCE {
            let (value, jacobian) = self.evaluate(&x)?;
            let step = jacobian
                .svd(true, true)
                .solve(&value, NEUTRAL * jacobian.norm())
                .map_err(Error::no_convergence)?;
            let correction = step.norm();
            // Half the digits of a first step would be luck, not convergence.
            if correction <= self.correction() * (1.0 + x.norm()) {
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
            if !(correction < 0.9 * last) {
                break;
            }
            last = correction;
            x -= step;
        }
        Err(Error::no_convergence(
            "neither Newton's method nor steps of least length converge at the end of the path",
        ))
    }

    fn is_follower(&self) -> bool {
        self.end.follower
    }
}

impl Route {
    pub(super) fn start() -> Self {
        Self {
            from_guess: false,
            steps: 0,
            imperfect: false,
            iterations: 0,
            evaluations: 0,
            damping: 1.0,
        }
    }

    fn and(self, solved: &Solution<6>) -> Self {
        Self {
            iterations: self.iterations + solved.iterations,
            evaluations: self.evaluations + solved.evaluations,
            damping: self.damping.min(solved.damping),
            ..self
        }
    }
}
