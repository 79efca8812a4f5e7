//! Solution of a problem: from a guess, or from the unloaded rod by continuation.

use super::chart::{AnyChart, Spatial, dynamic};
use super::distributed_load::ScaledLoad;
use super::free_end::FreeEnd;
use super::ivp::Wrench;
use super::path_to_target::{PathSearch, follow, newton, options};
use super::problem::{EndConditions, Problem};
use super::solution_path::{ChosenPath, Path, ProblemChart};
use super::starts::PathStart;
use super::taut::{TAUT, TIGHT};
use super::{Rod, RodSection};
use crate::error::{Error, Result};
use crate::solve::newton::Solution;
use crate::solve::warm_start::WarmStart;
use nalgebra::{DVector, Rotation3, UnitQuaternion, Vector3};

/// An equilibrium of a rod, with the record of its search.
#[derive(Debug, Clone, PartialEq)]
pub struct Equilibrium {
    /// Base wrench (m(0), n) in the world frame.
    pub base: Wrench,
    /// The section at the end: pose, couple and force there, energy of the rod.
    pub end: RodSection,
    /// Potential -int f.r ds of the load along the rod, in the world; 0 without one.
    pub potential: f64,
    /// Morse index in space under the end condition; 0 is stable. 0 without meaning where loads turn with the rod
    /// beside dead ones, or along it ([`Problem::is_mixed`]).
    pub index: usize,
    /// Norm of the residual, in the numerics' units (length, B/L, B/L^2).
    pub residual: f64,
    /// Record of the search.
    pub route: Route,
    /// Chart of the solution (spatial, planar or closed form), with the reason.
    pub taken: ChosenPath,
}

/// Record of the search that found an equilibrium.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Route {
    /// True if found from the user's guess; otherwise from the unloaded rod by continuation.
    pub from_guess: bool,
    /// Steps of the continuation.
    pub steps: usize,
    /// True if the path began at a bent or loaded rod, not at the unloaded one, to avoid a bifurcation or a fold.
    pub imperfect: bool,
    /// Newton steps in total.
    pub iterations: usize,
    /// Evaluations of the rod with its tangent, in total.
    pub evaluations: usize,
    /// The smallest damping factor of Newton's method; 1 if never damped.
    pub damping: f64,
}

/// Relative difference of energies beyond which one of two equilibria lies lower.
const LOWER: f64 = 1e-6;
/// Largest residual of an answer, relative to the wrench.
const POOR: f64 = 1e-7;

impl Problem {
    /// Solves the problem; without a guess by continuation from the unloaded rod.
    ///
    /// Loads and poses grow in proportion from the unloaded rod. If the path ends on an unstable equilibrium, or
    /// cannot be followed, it is repeated with small intrinsic curvatures that are removed by the end. The first
    /// stable equilibrium is the answer, or else the one of lowest index. Planar data are solved in their plane
    /// first, and in space only if no equilibrium stable in space is found there ([`Problem::with_path`] decides
    /// otherwise).
    ///
    /// # Errors
    /// No convergence from the guess, or on any path; the message says how far the best one came. A requested path
    /// that is not valid.
    pub fn solve(&self, guess: Option<&Wrench>) -> Result<Equilibrium> {
        if guess.is_some() {
            return self.solve_along_paths(guess);
        }
        if self.is_followed() {
            let fallen = self.is_heavy().then(|| self.solve_from_fallen()).flatten();
            return fallen.map_or_else(|| self.solve_along_paths(None), Ok);
        }
        let is_stable =
            |found: &Result<Equilibrium>| matches!(found, Ok(found) if found.index == 0);
        // A heavy rod defies continuation: it falls first.
        let mut fallen = None;
        if self.is_heavy() {
            fallen = self.solve_by_descent();
            if let Some(fallen) = &fallen
                && is_stable(fallen)
            {
                return fallen.clone();
            }
        }
        let found = self.solve_along_paths(None);
        if let Ok(led) = &found
            && led.index == 0
        {
            // Between two ends a rod may bow against the weight, and stay bowed.
            let other = self.may_bow().then(|| self.solve_by_descent()).flatten();
            return match other {
                Some(Ok(fallen)) if fallen.index == 0 && self.lies_lower(&fallen, led) => {
                    Ok(fallen)
                }
                _ => found,
            };
        }
        match (found, fallen.or_else(|| self.solve_by_descent())) {
            (Err(_), Some(Ok(fallen))) => Ok(fallen),
            (Ok(found), Some(Ok(fallen))) if fallen.index < found.index => Ok(fallen),
            (found, _) => found,
        }
    }

    /// True for a rod under a load along it between two ends.
    fn may_bow(&self) -> bool {
        let held = self.is_held();
        self.weight.is_some()
            && self.path == Path::Auto
            && self.is_conservative()
            && held == [true; 3]
    }

    /// True if the first equilibrium has less energy, its loads included, than the other. Both ends are held.
    fn lies_lower(&self, one: &Equilibrium, other: &Equilibrium) -> bool {
        let [one, other] = [one, other].map(|found| found.end.energy + found.potential);
        one < other - LOWER * (self.rod.units().0 + other.abs())
    }

    /// The equilibrium under loads that turn with the rod: the rod falls without these, which then grow. `None` if the
    /// rod does not fall, or cannot be followed.
    fn solve_from_fallen(&self) -> Option<Equilibrium> {
        let free = EndConditions::load(Vector3::zeros(), Vector3::zeros());
        let mut quiet = Problem {
            followed: None,
            turning: [Vector3::zeros(); 2],
            at_rest: WarmStart::default(),
            ..self.clone()
        };
        if self.end.follower {
            quiet.end = free;
            (quiet.targets, quiet.couple) = ([0.0; 3], Vector3::zeros());
        }
        let fallen = quiet.solve_by_descent()?.ok()?;
        let start = PathStart::Resting(self.rod.inward(&fallen.base));
        let why = "a load turns with the rod: it grows on the rod that has fallen under its weight";
        let taken = ChosenPath::new(Path::Spatial, why);
        self.walk(&Spatial, &PathSearch::new(), start, &taken).ok()
    }

    /// True if the load along the rod bends the rod so far that continuation from the unloaded rod may fail:
    /// sqrt(f L^3/B), with the whole load f L and the softer flexure, is beyond [`TIGHT`].
    pub(super) fn is_heavy(&self) -> bool {
        let Some(weight) = &self.weight else {
            return false;
        };
        let [a, b] = self.rod.law.flexures();
        (weight.total().norm() * a.max(b)).sqrt() > TIGHT
    }

    /// The equilibrium from a guess, or along paths from the unloaded rod.
    fn solve_along_paths(&self, guess: Option<&Wrench>) -> Result<Equilibrium> {
        let taut = self.solve_taut(guess, TAUT);
        if let Some(Ok(found)) = &taut
            && (found.index == 0 || guess.is_some())
        {
            return Ok(found.clone());
        }
        let borne = match &self.weight {
            None => self.check_load(),
            Some(weight) => self.check_weight(weight),
        };
        if let Err(why) = borne {
            // An unstable equilibrium is better than none.
            return taut.and_then(Result::ok).ok_or(why);
        }
        // A pull costs digits: a tighter integration recovers some of them.
        let found = match self.solve_once(guess) {
            Err(why) if why.is_ill_conditioned() && self.tolerance > 1e-13 => Problem {
                tolerance: 1e-14,
                ..self.clone()
            }
            .solve_once(guess),
            found => found,
        };
        // A path from the unloaded rod may end with a hanging body upright, and may not reach a stretched rod: try
        // the taut solver.
        let poor = match &found {
            Ok(found) => found.index > 0 && guess.is_none(),
            Err(_) => true,
        };
        if poor
            && taut.is_none()
            && let Some(Ok(taut)) = self.solve_taut(guess, TIGHT)
            && found
                .as_ref()
                .map_or(true, |found| taut.index < found.index)
        {
            return Ok(taut);
        }
        found
    }

    fn solve_once(&self, guess: Option<&Wrench>) -> Result<Equilibrium> {
        let (charted, taken) = self.choose_chart(guess)?;
        let search = PathSearch::new();
        let flat = match charted {
            ProblemChart::Spatial(_) | ProblemChart::FreeEnd(_) => {
                return search.verdict(self.solve_in_space(&search, guess, taken));
            }
            ProblemChart::Planar(plane) => self.solve_in(
                &plane,
                &search,
                &mut self.planar_starts(&plane),
                guess,
                taken,
            ),
            ProblemChart::ClosedForm(chart) => {
                let starts = &mut self.closed_starts(&chart);
                let closed = self.solve_in(&chart, &search, starts, guess, taken);
                match closed {
                    Err(why) if self.path == Path::Auto => {
                        let why =
                            format!("the data are planar; the closed form gave no answer: {why}");
                        let plane = chart.plane();
                        let taken = ChosenPath::new(Path::Planar, why);
                        self.solve_in(plane, &search, &mut self.planar_starts(plane), guess, taken)
                    }
                    closed => closed,
                }
            }
        };
        let why = match &flat {
            _ if self.path != Path::Auto => return search.verdict(flat),
            Ok(found) if found.index == 0 || self.is_followed() || guess.is_some() => return flat,
            Ok(found) => format!(
                "the data are planar, but the equilibrium found in the plane has index {} in space",
                found.index
            ),
            Err(why) => format!("the data are planar, but the plane gave no answer: {why}"),
        };
        let taken = ChosenPath::new(Path::Spatial, why);
        search.verdict(match (flat, self.solve_in_space(&search, guess, taken)) {
            (Ok(flat), Ok(spatial)) if spatial.index < flat.index => Ok(spatial),
            (Err(_), spatial) => spatial,
            (flat, _) => flat,
        })
    }

    /// Bound on a dead force F: a stable rod trails along it, and an error at the clamp grows as exp(lam), lam^2 =
    /// |F| L^2/B.
    fn check_load(&self) -> Result<()> {
        const LAM: f64 = 24.0;
        let loaded = (0..3).filter(|i| self.end.position[*i].is_none());
        let force = loaded.map(|i| self.targets[i].powi(2)).sum::<f64>().sqrt();
        let [a, b] = self.rod.law.flexures();
        let lam = (force * a.max(b)).sqrt();
        if self.is_followed() || lam < LAM {
            return Ok(());
        }
        let (_, unit) = self.rod.units();
        Err(Error::ill_conditioned(format!(
            "the force on the end is {:.6e}, sqrt(F L^2/B) = {lam:.1}: beyond {LAM} only rods that are taut under it are found, and in this \
             chart none was; use solve.path = \"auto\", give a guess, or lower the force",
            force * unit
        )))
    }

    /// Bound on a load along the rod, with lam the mean of sqrt(|n| L^2/B): a hanging rod amplifies an error by
    /// exp(lam).
    fn check_weight(&self, weight: &ScaledLoad) -> Result<()> {
        const LAM: f64 = 16.0;
        let loaded = (0..3).filter(|i| self.end.position[*i].is_none());
        let force: Vector3<f64> = loaded.map(|i| self.axes[i] * self.targets[i]).sum();
        let [a, b] = self.rod.law.flexures();
        let root = |n: &Vector3<f64>| n.norm().sqrt();
        let lam = weight.mean(&(force + weight.total()), root) * a.max(b).sqrt();
        if self.is_followed() || lam < LAM {
            return Ok(());
        }
        Err(Error::ill_conditioned(format!(
            "under the load along the rod and on its end lam, the mean of sqrt(|n| L^2/B) along the rod, is {lam:.1}: an error at the clamp grows about as \
             exp(lam), so that beyond {LAM} only rods that are taut are found, and here none was; give a guess, or lower the load"
        )))
    }

    fn solve_in_space(
        &self,
        search: &PathSearch,
        guess: Option<&Wrench>,
        taken: ChosenPath,
    ) -> Result<Equilibrium> {
        if !self.has_free_end() {
            return self.solve_in(&Spatial, search, &mut self.starts(), guess, taken);
        }
        let starts = &mut self.free_starts();
        let reduced = self.solve_in(&FreeEnd, search, starts, guess, taken.clone());
        let enough = |found: &Equilibrium| found.index == 0 || self.is_followed();
        if guess.is_some() || reduced.as_ref().is_ok_and(enough) {
            return reduced;
        }
        match (
            reduced,
            self.solve_in(&Spatial, search, &mut self.starts(), guess, taken),
        ) {
            (Ok(reduced), Ok(whole)) if whole.index < reduced.index => Ok(whole),
            (Err(_), whole) => whole,
            (reduced, _) => reduced,
        }
    }

    /// The first stable equilibrium reached from the starts, or else the one of lowest index.
    fn solve_in(
        &self,
        chart: &dyn AnyChart,
        search: &PathSearch,
        starts: &mut dyn Iterator<Item = PathStart>,
        guess: Option<&Wrench>,
        taken: ChosenPath,
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
        let mut best: Option<Equilibrium> = None;
        for start in starts {
            if search.is_over() {
                break;
            }
            match self.walk(chart, search, start, &taken) {
                Ok(found) => {
                    let enough = found.index == 0 || self.is_followed();
                    if best.as_ref().is_none_or(|best| found.index < best.index) {
                        best = Some(found);
                    }
                    if enough {
                        break;
                    }
                }
                Err(why) => search.failed(why),
            }
        }
        best.ok_or_else(|| search.error())
    }

    /// Newton's tolerance: a little above the noise of the integration.
    pub(super) fn correction(&self) -> f64 {
        (10.0 * self.tolerance).max(1e-12)
    }

    pub(super) fn describe(
        &self,
        chart: &dyn AnyChart,
        solved: &Solution,
        route: Route,
        taken: ChosenPath,
    ) -> Result<Equilibrium> {
        let mut b = chart.wrench(self, &solved.x)?;
        // Residual in space and from the clamp, whatever the chart: the reported equilibrium is that of the base
        // wrench.
        let mut residual = self.residual(&self.bare_trial(&b)?).norm();
        if !(residual < 10.0 * self.correction() * (1.0 + b.norm()))
            && let Ok(polished) =
                newton(&Spatial, self, &dynamic(b), &options(self.correction(), 6))
            && let Ok(polished) = Spatial.wrench(self, &polished.x)
            && (polished - b).norm() < 1e-3 * (1.0 + b.norm())
        {
            b = polished;
            residual = self.residual(&self.bare_trial(&b)?).norm();
        }
        // Follower loads beside dead loads, or along the rod, leave the equilibrium without an index.
        let index = if self.is_mixed() { 0 } else { self.index(&b)? };
        if !(residual < POOR * (1.0 + b.norm())) {
            return Err(Error::ill_conditioned(format!(
                "the best base wrench that double precision holds misses the end condition by {residual:.1e} (in L, B/L, B/L^2): the rod is \
                 pulled too hard; lower the load"
            )));
        }
        Ok(Equilibrium {
            base: self.rod.outward_wrench(&b),
            end: self.end_section(&b)?,
            potential: self.potential(&self.rod.outward_wrench(&b))?,
            index,
            residual,
            route,
            taken,
        })
    }

    /// The rod led from `start` to the end condition.
    pub(super) fn walk(
        &self,
        chart: &dyn AnyChart,
        search: &PathSearch,
        start: PathStart,
        taken: &ChosenPath,
    ) -> Result<Equilibrium> {
        let bend = match start {
            PathStart::Bent(bend) => bend,
            _ => Vector3::zeros(),
        };
        let begun = self.first_part(start);
        let first = Problem {
            rod: self.bent(bend),
            weight: self.share(begun),
            followed: self.followed.as_ref().map(|load| load.times(0.0)),
            turning: [Vector3::zeros(); 2],
            ..self.clone()
        };
        let mut route = Route {
            imperfect: start != PathStart::Unloaded,
            ..Route::start()
        };
        let x = match start {
            PathStart::Loaded(b) | PathStart::Resting(b) => chart.unknowns(&first, &b)?,
            PathStart::Turned(axis) => self.turn_pull(chart, search, &axis, &mut route)?,
            PathStart::Unloaded | PathStart::Bent(_) => DVector::zeros(chart.size()),
        };
        let b = chart.wrench(&first, &x)?;
        let end = first.integrate_to_end::<0>(&b)?;
        let (r, rotation, n) = (end.at.position(), end.at.rotation(), end.n);
        let couple = if self.weight.is_none() && self.followed.is_none() {
            b.fixed_rows::<3>(0) - (r + first.lever(&rotation)).cross(&n)
        } else {
            end.m - first.lever(&rotation).cross(&n)
        };
        let turn = self.orientation.map(|target| {
            UnitQuaternion::from_rotation_matrix(&Rotation3::from_matrix_unchecked(
                target * rotation.transpose(),
            ))
            .scaled_axis()
        });
        let mut solved = follow(chart, search, x, &mut route, start.description(), &|part| {
            let mut way = first.clone();
            way.weight = self.share(begun + (1.0 - begun) * part);
            way.followed = self.followed.as_ref().map(|load| load.times(part));
            way.turning = self.turning.map(|load| load * part);
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
            solved = follow(
                chart,
                search,
                solved.x,
                &mut route,
                start.description(),
                &|part| Problem {
                    rod: self.bent(bend * (1.0 - part)),
                    ..self.clone()
                },
            )?;
        }
        self.describe(chart, &solved, route, taken.clone())
    }

    /// The rod under a part of the dead force, reached by rotating a pull along the clamp's d3 about `axis`.
    fn turn_pull(
        &self,
        chart: &dyn AnyChart,
        search: &PathSearch,
        axis: &Vector3<f64>,
        route: &mut Route,
    ) -> Result<DVector<f64>> {
        let whence = PathStart::Turned(*axis).description();
        let force = self.whole_force();
        let size = self.pull();
        let angle = Vector3::z().angle(&force);
        let pull = Vector3::z() * size;
        let way = |turn: f64, part: f64| {
            let (on_end, weight) = match &self.weight {
                None => (Rotation3::new(axis * (angle * turn)) * pull * part, None),
                // Both loads together, rotated back from their final directions.
                Some(load) => {
                    let back = Rotation3::new(axis * (angle * (turn - 1.0)));
                    let share = part * size / force.norm();
                    let on_end = back * self.dead_force() * share;
                    (on_end, Some(load.times(share).turned(&back)))
                }
            };
            Problem {
                targets: self.axes.map(|a| a.dot(&on_end)),
                couple: Vector3::zeros(),
                weight,
                ..self.clone()
            }
        };
        let zero = DVector::zeros(chart.size());
        let pulled = follow(chart, search, zero, route, whence, &|t| way(0.0, t))?;
        let turned = follow(chart, search, pulled.x, route, whence, &|t| way(t, 1.0))?;
        Ok(turned.x)
    }

    /// The given fraction of the load along the rod.
    fn share(&self, part: f64) -> Option<ScaledLoad> {
        self.weight.as_ref().map(|weight| weight.times(part))
    }

    fn bent(&self, bend: Vector3<f64>) -> Rod {
        Rod {
            law: self.rod.law.bent(bend),
            ..self.rod.clone()
        }
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

    pub(super) fn add(&mut self, solved: &Solution) {
        self.iterations += solved.iterations;
        self.evaluations += solved.evaluations;
        self.damping = self.damping.min(solved.damping);
    }
}
