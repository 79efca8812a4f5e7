//! Solving a problem: from a guess, or from the unloaded rod by continuation.

use super::chart::{Chart, Spatial};
use super::closed_form::ClosedForm;
use super::follow::{follow, newton, options};
use super::free_end::FreeEnd;
use super::line::Wrench;
use super::path::{Charted, Path, Taken};
use super::planar::Plane;
use super::problem::{End, Problem};
use super::{Rod, RodSection};
use crate::elastica::Elastica;
use crate::error::{Error, Result};
use crate::manifold::Multivalued;
use crate::solve::newton::Solution;
use nalgebra::{Rotation3, SVector, UnitQuaternion, Vector3, Vector6};
use std::f64::consts::FRAC_PI_3;

/// An equilibrium of a rod, and how it was found.
#[derive(Debug, Clone, PartialEq)]
pub struct Equilibrium {
    /// Base wrench (m(0), n) in the world frame.
    pub base: Wrench,
    /// The section at the end: pose, couple and force there, energy of the rod.
    pub end: RodSection,
    /// Morse index in space under the end condition; 0 is stable.
    pub index: usize,
    /// Size of the equations left over, in the numerics' units (length, B/L, B/L^2).
    pub residual: f64,
    /// How it was found.
    pub route: Route,
    /// In space, in a plane or in closed form, and why.
    pub taken: Taken,
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
/// Those that stay in a plane.
const PLANAR_IMPERFECTIONS: [f64; 3] = [0.25, -0.25, 0.8];

/// Residuals above this, relative to the wrench, are no answer.
const POOR: f64 = 1e-7;

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

impl Start {
    /// Where the path comes from, for messages.
    fn whence(self) -> &'static str {
        match self {
            Self::Unloaded => "from the unloaded rod",
            Self::Bent(_) => "from a slightly bent rod",
            Self::Loaded(_) => "from an arc with the same distance between its ends",
        }
    }
}

impl Problem {
    /// Solves the problem; without a guess by continuation from the unloaded rod.
    ///
    /// Loads and poses grow in proportion from the unloaded rod. If the path ends on an unstable equilibrium, or cannot be
    /// followed, it is walked again with small intrinsic curvatures that are taken back at the end: the first
    /// stable equilibrium is the answer, or else the one of lowest index. Planar data are solved in their plane first,
    /// and in space only if nothing that is stable in space is found there ([`Problem::with_path`] decides otherwise).
    ///
    /// # Errors
    /// No convergence from the guess, or on any path; the message says how far the best one came. A path asked for
    /// that does not hold.
    pub fn solve(&self, guess: Option<&Wrench>) -> Result<Equilibrium> {
        self.check_load()?;
        let (charted, taken) = self.charted()?;
        let flat = match charted {
            Charted::Spatial(_) | Charted::FreeEnd(_) => return self.solve_in_space(guess, taken),
            Charted::Planar(plane) => self.solve_planar(&plane, guess, taken),
            Charted::ClosedForm(chart) => {
                let closed = self.solve_in(&chart, self.closed_starts(&chart), guess, taken);
                match closed {
                    Err(why) if self.path == Path::Auto && !why.is_ill_conditioned() => {
                        let why =
                            format!("the data are planar; the closed form gave no answer: {why}");
                        self.solve_planar(chart.plane(), guess, Taken::new(Path::Planar, why))
                    }
                    closed => closed,
                }
            }
        };
        if self.path != Path::Auto {
            return flat;
        }
        let why = match &flat {
            Ok(found) if found.index == 0 || self.end.follower || guess.is_some() => return flat,
            Ok(found) => format!(
                "the data are planar, but the equilibrium found in the plane has index {} in space",
                found.index
            ),
            Err(why) if why.is_ill_conditioned() => return flat,
            Err(why) => format!("the data are planar, but the plane gave no answer: {why}"),
        };
        let spatial = self.solve_in_space(guess, Taken::new(Path::Spatial, why));
        match (flat, spatial) {
            (Ok(flat), Ok(spatial)) if spatial.index < flat.index => Ok(spatial),
            (Err(_), spatial) => spatial,
            (flat, _) => flat,
        }
    }

    /// Under a dead force F a stable rod trails along it, and an error at its clamp grows as exp(lam), lam^2 = |F| L^2/B.
    fn check_load(&self) -> Result<()> {
        const LAM: f64 = 36.0;
        let loaded = (0..3).filter(|i| self.end.position[*i].is_none());
        let force = loaded.map(|i| self.targets[i].powi(2)).sum::<f64>().sqrt();
        let [a, b] = self.rod.law.flexures();
        let lam = (force * a.max(b)).sqrt();
        if self.end.follower || lam < LAM {
            return Ok(());
        }
        let (_, unit) = self.rod.units();
        Err(Error::ill_conditioned(format!(
            "the force on the end is {:.6e}, too heavy for this rod: sqrt(F L^2/B) = {lam:.1} must be below {LAM}; lower the force, or \
             shorten or stiffen the rod",
            force * unit
        )))
    }

    fn solve_in_space(&self, guess: Option<&Wrench>, taken: Taken) -> Result<Equilibrium> {
        if !self.has_free_end() {
            return self.solve_in(&Spatial, self.starts(), guess, taken);
        }
        let reduced = self.solve_in(&FreeEnd, self.free_starts(), guess, taken.clone());
        let enough = |found: &Equilibrium| found.index == 0 || self.end.follower;
        if guess.is_some() || reduced.as_ref().is_ok_and(enough) {
            return reduced;
        }
        let whole = self.solve_in(&Spatial, self.starts(), guess, taken);
        match (reduced, whole) {
            (Ok(reduced), Ok(whole)) if whole.index < reduced.index => Ok(whole),
            (Err(_), whole) => whole,
            (reduced, _) => reduced,
        }
    }

    fn solve_planar(
        &self,
        plane: &Plane,
        guess: Option<&Wrench>,
        taken: Taken,
    ) -> Result<Equilibrium> {
        let bends = PLANAR_IMPERFECTIONS.map(|size| Start::Bent(plane.normal() * size));
        let arcs = self.arcs(&[plane.normal(), -plane.normal()]);
        let starts = std::iter::once(Start::Unloaded)
            .chain(self.ball_jointed())
            .chain(bends)
            .chain(arcs.into_iter().map(Start::Loaded));
        self.solve_in(plane, starts, guess, taken)
    }

    /// Rods bent by a force on their end that follows it: to all sides, if the end is held.
    fn free_starts(&self) -> impl Iterator<Item = Start> {
        let held = self.end.position.iter().any(Option::is_some);
        let sides = (0..if held { 6 } else { 0 }).filter_map(|k| {
            let (sin, cos) = (1.1 + FRAC_PI_3 * f64::from(k)).sin_cos();
            let q = Vector3::new(3.0 * cos, 3.0 * sin, -0.3);
            FreeEnd.wrench(self, &q).ok().map(Start::Loaded)
        });
        let bends = IMPERFECTIONS.map(|bend| Start::Bent(bend.into()));
        std::iter::once(Start::Unloaded).chain(bends).chain(sides)
    }

    fn starts(&self) -> impl Iterator<Item = Start> {
        let across = self.held_place().map(|place| Vector3::z().cross(&place));
        let axis = across
            .filter(|across| across.norm() > 1e-3)
            .unwrap_or(Vector3::new(0.6, 0.8, 0.0));
        let side = Vector3::z().cross(&axis);
        let axes = [
            axis,
            axis + 0.5 * side,
            axis - 0.5 * side,
            side,
            -side,
            -axis,
        ];
        // A little force, so that no symmetry is kept.
        let force = Vector6::new(0.0, 0.0, 0.0, 0.1, 0.07, 0.05);
        let arcs = self.arcs(&axes).into_iter().map(move |b| b + force);
        std::iter::once(Start::Unloaded)
            .chain(self.ball_jointed())
            .chain(IMPERFECTIONS.map(|bend| Start::Bent(bend.into())))
            .chain(arcs.map(Start::Loaded))
    }

    /// Points of the chart from which a path may lead to the target: a slight load, or bows to both sides; then, if
    /// need be, every stable elastica with its end there.
    fn closed_starts(&self, chart: &ClosedForm) -> impl Iterator<Item = Start> {
        let target = chart.target(self);
        let held = self.end.position[0].is_some();
        let bows =
            [1.0, -1.0].map(|side: f64| ClosedForm::at(side.copysign(side * target.y) * 0.6, 1.2));
        let slight = chart.slightly_loaded(self, &(target * 1e-3));
        let first = slight.filter(|_| !held).into_iter().chain(bows);
        let all = move || {
            let found = held.then(|| Elastica.stable_at(&target).ok()).flatten();
            let found = found.unwrap_or_default().into_iter();
            found.map(|q| ClosedForm::at(q.x, q.y))
        };
        let rest = std::iter::once_with(all).flatten();
        first
            .chain(rest)
            .filter_map(|x| chart.wrench(self, &x).ok().map(Start::Loaded))
    }

    /// The stable equilibrium that the first of the starts leads to, or else the one of lowest index.
    fn solve_in<C: Chart<N>, const N: usize>(
        &self,
        chart: &C,
        starts: impl Iterator<Item = Start>,
        guess: Option<&Wrench>,
        taken: Taken,
    ) -> Result<Equilibrium> {
        if let Some(guess) = guess {
            let x = chart.unknowns(self, &self.rod.inward(guess))?;
            let solved = newton(chart, self, &x, &options(self.correction(), 60))?;
            let mut route = Route {
                from_guess: true,
                ..Route::start()
            };
            route.add(&solved);
            return self.describe(chart, &solved, route, taken);
        }
        let mut best: Option<Result<Equilibrium>> = None;
        for start in starts {
            let found = self.walk(chart, start, &taken);
            let better = match (&best, &found) {
                (None, _) | (Some(Err(_)), Ok(_)) => true,
                (Some(Ok(best)), Ok(found)) => found.index < best.index,
                (Some(_), Err(_)) => false,
            };
            let enough = match &found {
                Ok(found) => found.index == 0 || self.end.follower,
                Err(why) => why.is_ill_conditioned(),
            };
            if better {
                best = Some(found);
            }
            if enough {
                break;
            }
        }
        best.unwrap_or_else(|| Err(Error::no_convergence("there is no path to begin with")))
    }

    /// Newton's tolerance: a little above the noise of the integration.
    pub(super) fn correction(&self) -> f64 {
        (10.0 * self.tolerance).max(1e-12)
    }

    fn describe<C: Chart<N>, const N: usize>(
        &self,
        chart: &C,
        solved: &Solution<N>,
        route: Route,
        taken: Taken,
    ) -> Result<Equilibrium> {
        let b = chart.wrench(self, &solved.x)?;
        // In space and from the clamp, whatever the chart: what is reported is what the base wrench gives.
        let residual = self.residual(&self.bare_trial(&b)?).norm();
        let index = self.index(&b)?;
        if !(residual < POOR * (1.0 + b.norm())) {
            return Err(Error::ill_conditioned(format!(
                "the best base wrench that double precision holds misses the end condition by {residual:.1e} (in L, B/L, B/L^2): the rod is \
                 pulled too hard; lower the load"
            )));
        }
        Ok(Equilibrium {
            base: self.rod.outward_wrench(&b),
            end: self.end_section(&b)?,
            index,
            residual,
            route,
            taken,
        })
    }

    /// Arcs of a circle, made by couples about the given axes, whose chord is as long as the distance to be held: the other
    /// starts when the unloaded rod cannot be moved (a straight inextensible rod is singular) or its path ends in a fold.
    fn arcs(&self, axes: &[Vector3<f64>]) -> Vec<Wrench> {
        let Some(target) = self.held_place() else {
            return Vec::new();
        };
        let chord = target.norm().clamp(0.05, 0.98);
        // 2 sin(k/2)/k = chord, by Newton's method from the small-angle value.
        let mut k = (24.0 * (1.0 - chord)).sqrt();
        for _ in 0..30 {
            let (s, c) = (0.5 * k).sin_cos();
            k -= (2.0 * s / k - chord) / (c / k - 2.0 * s / (k * k));
        }
        let wrench = |axis: &Vector3<f64>| {
            let m = axis.normalize() * k;
            Vector6::new(m.x, m.y, m.z, 0.0, 0.0, 0.0)
        };
        axes.iter().map(wrench).collect()
    }

    /// The rod with its end in the place asked for but free to turn: from there the end is turned into its pose.
    fn ball_jointed(&self) -> impl Iterator<Item = Start> {
        std::iter::once_with(|| {
            self.held_place()?;
            self.orientation?;
            let ball = Problem {
                end: End {
                    orientation: None,
                    couple: Vector3::zeros(),
                    ..self.end
                },
                orientation: None,
                couple: Vector3::zeros(),
                ..self.clone()
            };
            let found = ball.solve(None).ok()?;
            Some(Start::Loaded(self.rod.inward(&found.base)))
        })
        .flatten()
    }

    /// Where the end is held, if all of its place is.
    fn held_place(&self) -> Option<Vector3<f64>> {
        let held = self.end.position.iter().all(Option::is_some);
        held.then(|| (0..3).map(|i| self.axes[i] * self.targets[i]).sum())
    }

    /// The rod led from `start` to the end condition.
    fn walk<C: Chart<N>, const N: usize>(
        &self,
        chart: &C,
        start: Start,
        taken: &Taken,
    ) -> Result<Equilibrium> {
        let bend = match start {
            Start::Bent(bend) => bend,
            _ => Vector3::zeros(),
        };
        let first = Problem {
            rod: self.bent(bend),
            ..self.clone()
        };
        let x = match start {
            Start::Loaded(b) => chart.unknowns(self, &b)?,
            _ => SVector::zeros(),
        };
        let b = chart.wrench(&first, &x)?;
        let mut route = Route {
            imperfect: start != Start::Unloaded,
            ..Route::start()
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
        let mut solved = follow(chart, x, &mut route, start.whence(), |part| {
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
            solved = follow(chart, solved.x, &mut route, start.whence(), |part| {
                Problem {
                    rod: self.bent(bend * (1.0 - part)),
                    ..self.clone()
                }
            })?;
        }
        self.describe(chart, &solved, route, taken.clone())
    }

    fn bent(&self, bend: Vector3<f64>) -> Rod {
        Rod {
            law: self.rod.law.bent(bend),
            ..self.rod.clone()
        }
    }
}

impl Route {
    fn start() -> Self {
        Self {
            from_guess: false,
            steps: 0,
            imperfect: false,
            iterations: 0,
            evaluations: 0,
            damping: 1.0,
        }
    }

    pub(super) fn add<const N: usize>(&mut self, solved: &Solution<N>) {
        self.iterations += solved.iterations;
        self.evaluations += solved.evaluations;
        self.damping = self.damping.min(solved.damping);
    }
}
