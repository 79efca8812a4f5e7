//! Equilibria of taut rods with given end conditions: Newton's method for the force, three unknowns instead of six.

use super::first_order_mass::neutral_error;
use super::interval::RodUnderForce;
use super::{Shape, Solved, Spring, Symmetry, Tip, solve_taut_rod};
use crate::error::{Error, Result};
use crate::math::se3::{exponential, frame, halves, join};
use crate::rod::distributed_load::ScaledLoad;
use crate::rod::equilibrium::{Equilibrium, Route};
use crate::rod::scaled_law::ScaledLaw;
use crate::rod::solution_path::{ChosenPath, Path};
use crate::rod::{Plane, Problem, RodSection, Wrench};
use nalgebra::{Matrix3, Vector3, Vector6};

/// sqrt(F L^2/B) beyond which a problem is first solved as that of a taut rod, and beyond which this is tried after
/// no stable equilibrium was found.
pub(in crate::rod) const TAUT: f64 = 16.0;
pub(in crate::rod) const TIGHT: f64 = 8.0;
/// Least sqrt(F L^2/B) of a base wrench that is taken as that of a taut rod, and tolerance on its couple, over sqrt(F
/// B).
const PULLED: f64 = 12.0;
const AGREES: f64 = 1e-5;
/// Largest difference of a base wrench, over sqrt(F B) and F, from that of the equilibrium found last, which is then
/// meant.
const KEPT: f64 = 1e-9;
/// Most Newton steps, and largest relative change of the force in one step.
const STEPS: usize = 60;
const CHANGE: f64 = 0.5;
/// Relative Newton step below which the force has converged; rounding of places times the stiffness allows no less.
const FORCE_CONVERGED: f64 = 1e-12;
/// Angles of the leaning force in turn; the last is zero.
const LEANS: [f64; 7] = [0.5, 0.35, 0.2, 0.1, 0.05, 0.02, 0.0];
/// Range of sqrt(F L^2/B) in which the force is sought that stretches the rod to its held length.
const RANGE: (f64, f64) = (3.0, 1e6);

impl Problem {
    /// The law and the load along the rod.
    pub(in crate::rod) fn law_and_load(&self) -> (&ScaledLaw, Option<&ScaledLoad>) {
        (&self.rod.law, self.weight.as_ref())
    }

    /// The rod with the load along it, under the force `n` at the base.
    pub(super) fn rod_under_force(&self, n: Vector3<f64>) -> RodUnderForce<'_> {
        RodUnderForce::new(&self.rod.law, self.weight.as_ref(), n)
    }

    /// The rod with its load, solved beside a spring as [`solve_taut_rod`] says.
    pub(in crate::rod) fn solve_beside(
        &self,
        b: &Wrench,
        symmetry: Symmetry,
        tip: &Tip,
        spring: &Spring,
        start: Option<&Shape>,
        tolerance: f64,
    ) -> Result<Solved> {
        let (m, n) = halves(b);
        let pulled = RodUnderForce {
            symmetry,
            ..self.rod_under_force(n)
        };
        solve_taut_rod(&pulled, &m, tip, spring, start, tolerance)
    }

    /// [`Problem::solve_beside`] of a rod whose section law, load or end condition differs little from that of `known`:
    /// place of the end and couple at the base to first order in the difference. Derivatives are those of `known`.
    pub(in crate::rod) fn solve_to_first_order(
        &self,
        b: &Wrench,
        symmetry: Symmetry,
        spring: &Spring,
        known: &Solved,
    ) -> Result<Solved> {
        let pulled = RodUnderForce {
            symmetry,
            ..self.rod_under_force(halves(b).1)
        };
        let (shape, position) = pulled.corrected_once(&known.shape, &self.tip(), spring)?;
        Ok(Solved {
            base_couple: shape.nodes[0].m,
            position,
            shape,
            ..known.clone()
        })
    }

    pub(in crate::rod) fn tip(&self) -> Tip {
        match self.orientation {
            Some(directors) => Tip::Turned(directors),
            None => Tip::Loaded {
                couple: self.couple,
                arm: self.arm,
            },
        }
    }

    pub(in crate::rod) fn is_held(&self) -> [bool; 3] {
        self.end.position.map(|x| x.is_some())
    }

    /// Mean bending compliance of the numerics: lam^2 = flexure |n|.
    pub(in crate::rod) fn flexure(&self) -> f64 {
        let [a, b] = self.rod.law.flexures();
        0.5 * (a + b)
    }

    /// False for problems under a load that turns with the end, which are not solved from both ends. The end of such
    /// a rod turns into the force whatever its direction. Only the decayed effect of the clamp, exp(-lam), determines
    /// the direction: no chart is better than that.
    pub(in crate::rod) fn may_be_taut(&self) -> bool {
        !self.is_followed()
    }

    /// The whole of the load along the rod.
    pub(in crate::rod) fn total_load(&self) -> Vector3<f64> {
        let weight = self.weight.as_ref();
        weight.map_or_else(Vector3::zeros, ScaledLoad::total)
    }

    /// lam = sqrt(|n| L^2/B) under the force `n` at the base, its mean along a rod that bears a load: an error at the
    /// base grows as exp(lam) under a pull.
    pub(in crate::rod) fn lam(&self, n: &Vector3<f64>) -> f64 {
        let root = |n: &Vector3<f64>| n.norm().sqrt();
        let weight = self.weight.as_ref();
        self.flexure().sqrt() * weight.map_or_else(|| root(n), |weight| weight.mean(n, root))
    }

    /// lam^2 of the part of the force that pulls the end, at `place`, away from the base; negative under compression. A
    /// loaded rod hangs along its own force: the whole of the force counts.
    pub(in crate::rod) fn pull_on(&self, n: &Vector3<f64>, place: &Vector3<f64>) -> f64 {
        let pull = match &self.weight {
            None => n.dot(place),
            Some(_) => return self.lam(n).powi(2),
        };
        self.flexure() * pull
    }

    /// The taut rod with a base wrench of the numerics; None if the rod is slack, or has another couple at the base.
    pub(in crate::rod) fn taut_at(&self, b: &Wrench) -> Option<Solved> {
        let (m, n) = halves(b);
        if let Some(kept) = self.at_rest.last() {
            let unit = kept.shape.n.norm().max(1.0);
            let off = (kept.base_couple - m).norm() / unit.sqrt();
            if off.max((kept.shape.n - n).norm() / unit) < KEPT {
                return Some((*kept).clone());
            }
        }
        if !self.may_be_taut() || !(self.lam(&n) > PULLED) {
            return None;
        }
        let along = self.symmetry(b, None);
        let found = self
            .solve_beside(b, along, &self.tip(), &Spring::NONE, None, self.tolerance)
            .ok()?;
        let agrees = (found.base_couple - m).norm() < AGREES * n.norm().sqrt();
        let pulled = self.pull_on(&n, &found.position) > PULLED * PULLED * 0.5;
        (agrees && pulled).then_some(found)
    }

    /// Morse index of a taut rod; `spring` is the spring with which the rod was solved.
    pub(in crate::rod) fn taut_index(&self, found: &Solved, spring: &Spring) -> Result<usize> {
        let axes = self.is_held().into_iter().zip(&self.axes);
        let axes: Vec<_> = axes
            .filter(|(held, _)| *held)
            .map(|(_, axis)| *axis)
            .collect();
        let pulled = self.rod_under_force(found.shape.n);
        let (b, tip) = (join(&found.base_couple, &found.shape.n), self.tip());
        let mut give = found.by_force.position;
        if found.plane.is_some() {
            // The index counts motions out of the plane as well.
            let whole = RodUnderForce {
                symmetry: self.symmetry(&b, None),
                ..pulled
            };
            let linearised = whole.correction(&found.shape, &tip, spring)?;
            let linearised = linearised.ok_or_else(neutral_error)?;
            give = linearised.way.fixed_columns::<3>(0).into_owned();
        }
        let alone = spring.alone(&give)?;
        let tangent = found
            .shape
            .nodes
            .last()
            .map(|end| frame(&end.turn).column(2).into_owned());
        let turn = self.free_turn(&b);
        let turn =
            turn.filter(|_| tangent.is_some_and(|d3| self.is_on_axis(&b, &found.position, &d3)));
        pulled.index(&found.shape, &tip, &alone, &axes, turn)
    }

    /// Sections of a taut rod at places in [0, 1], in growing order; `spring` is the spring with which the rod was
    /// solved.
    pub(in crate::rod) fn taut_sections(
        &self,
        found: &Solved,
        spring: &Spring,
        at: &[f64],
    ) -> Result<Vec<RodSection>> {
        let n = found.shape.n;
        let borne = n + (found.position - spring.at) * spring.stiffness;
        let pulled = self.rod_under_force(borne);
        let tip = self.tip();
        let sections = pulled.sections(&found.shape, &tip, spring, at, self.tolerance)?;
        let (sections, alone) = (sections.iter().zip(at), pulled.with_force(&n));
        sections
            .map(|((section, r, energy), s)| {
                let n = alone.force(s.clamp(0.0, 1.0));
                self.rod.outward_section(*s, section, r, *energy, &n)
            })
            .collect()
    }

    /// Force that stretches a straight rod with end layers to the held distance of its end, if that is taut.
    fn stretching_force(&self) -> Option<Vector3<f64>> {
        let place: Vector3<f64> = (0..3).map(|i| self.axes[i] * self.targets[i]).sum();
        let length = place.norm();
        let along = place.try_normalize(1e-9)?;
        let layer = |direction: Vector3<f64>| (0.25 * direction.angle(&along)).sin().powi(2);
        let last = self
            .orientation
            .map_or(0.0, |r| layer(r.column(2).into_owned()));
        let layers = layer(Vector3::z()) + last;
        let flexure = self.flexure();
        let excess = |lam: f64| {
            let pull = Vector6::new(0.0, 0.0, 0.0, 0.0, 0.0, lam * lam / flexure);
            let at = self.rod.law.inverse(0.5, &pull).ok()?;
            Some(at.strain[5] - 4.0 * layers / lam - length)
        };
        let (mut low, mut high) = RANGE;
        // A law that refuses a pull refuses greater ones.
        if !(excess(low)? < 0.0) {
            return None;
        }
        for _ in 0..60 {
            let middle = (low * high).sqrt();
            match excess(middle) {
                Some(excess) if excess < 0.0 => low = middle,
                _ => high = middle,
            }
        }
        (low < 0.9 * RANGE.1).then(|| along * (low * low / flexure))
    }

    /// Equilibrium of a taut rod, from the force of the guess or from that of a straight rod; None if sqrt(F L^2/B)
    /// is below `from`.
    pub(in crate::rod) fn solve_taut(
        &self,
        guess: Option<&Wrench>,
        from: f64,
    ) -> Option<Result<Equilibrium>> {
        if !self.may_be_taut() || self.path == Path::ClosedForm {
            return None;
        }
        let guess = guess.map(|base| self.rod.inward(base));
        let plane = match self.path {
            Path::Planar => Some(self.plane(guess.as_ref()).ok()?),
            _ => None,
        };
        let held = self.is_held();
        let (m, start) = match &guess {
            Some(b) => halves(b),
            // Each end bears half of the load along the rod.
            None if held == [true; 3] => (
                Vector3::zeros(),
                self.stretching_force()? + self.total_load() * 0.5,
            ),
            None => {
                let loaded = (0..3).filter(|i| !held[*i]);
                let force: Vector3<f64> = loaded.map(|i| self.axes[i] * self.targets[i]).sum();
                (Vector3::zeros(), force + self.total_load())
            }
        };
        (self.lam(&start) > from).then(|| self.find_force(&m, start, None, guess.is_some(), plane))
    }

    /// Newton's method for the force at the base, from `start` and the couple `m`, or from a shape.
    pub(super) fn find_force(
        &self,
        m: &Vector3<f64>,
        start: Vector3<f64>,
        shape: Option<Shape>,
        from_guess: bool,
        plane: Option<Plane>,
    ) -> Result<Equilibrium> {
        let (held, tip, borne) = (self.is_held(), self.tip(), self.total_load());
        let mut n = start;
        // Without a guess the couple at the base is meaningless.
        let mut last = if from_guess || shape.is_some() {
            shape
        } else {
            let straight = self.rod_under_force(n);
            Some(straight.guess_shape(&join(m, &n), &tip, self.tolerance)?)
        };
        let mut route = Route {
            from_guess,
            ..Route::start()
        };
        let mut before = f64::INFINITY;
        for _ in 0..STEPS {
            let b = join(&last.as_ref().map_or(*m, |shape| shape.nodes[0].m), &n);
            let (start, along) = (last.as_ref(), self.symmetry(&b, plane.as_ref()));
            let found = self.solve_beside(&b, along, &tip, &Spring::NONE, start, self.tolerance)?;
            route.iterations += 1;
            route.evaluations += found.iterations;
            let (mut off, mut by) = (Vector3::zeros(), Matrix3::zeros());
            for i in 0..3 {
                let axis = self.axes[i];
                let (is, row) = if held[i] {
                    (found.position, axis.transpose() * found.by_force.position)
                } else {
                    (n - borne, axis.transpose())
                };
                off[i] = axis.dot(&is) - self.targets[i];
                by.row_mut(i).copy_from(&row);
            }
            let step = -by.lu().solve(&off).ok_or_else(|| {
                Error::ill_conditioned(
                    "a taut rod is exactly at a fold, or cannot be stretched any more",
                )
            })?;
            let size = step.norm() / n.norm();
            // Iterate down to rounding, if no better is to be had.
            if size < FORCE_CONVERGED || (size < 1e-6 && size > 0.5 * before) {
                self.remember(&found);
                let told = self.told(&found, &Spring::NONE, off.norm(), route, plane)?;
                if told.index > 0
                    && !from_guess
                    && plane.is_none()
                    && held == [false; 3]
                    && let Some(stable) = self.find_out_of_plane(&n)
                {
                    self.remember(&stable);
                    return self.told(&stable, &Spring::NONE, off.norm(), route, plane);
                }
                return Ok(told);
            }
            before = size;
            let part = (CHANGE / size).min(1.0);
            route.damping = route.damping.min(part);
            n += step * part;
            last = Some(found.shape);
        }
        Err(Error::no_convergence(
            "the force of a taut rod was not found; give a guess of its base wrench",
        ))
    }

    /// A stable rod under the force `n` that leaves the plane of the clamp and the force, as rods do that turn far
    /// about their stiffer axis. The force leans out of that plane, which breaks the symmetry, and is led back.
    fn find_out_of_plane(&self, n: &Vector3<f64>) -> Option<Solved> {
        let across = Vector3::z().cross(n);
        let axes = match across.try_normalize(1e-12 * n.norm()) {
            Some(across) => vec![across.cross(n).normalize()],
            // A force against the clamp: any plane contains both.
            None => vec![Vector3::x(), Vector3::y()],
        };
        let led = |axis: &Vector3<f64>| {
            let mut found: Option<Solved> = None;
            for lean in LEANS {
                let force = frame(&exponential(&(axis * lean))) * n;
                let start = found.map(|found| found.shape);
                let m = start
                    .as_ref()
                    .map_or_else(Vector3::zeros, |shape| shape.nodes[0].m);
                let b = join(&m, &force);
                let (tip, along) = (self.tip(), Symmetry::default());
                let start = start.as_ref();
                found = self
                    .solve_beside(&b, along, &tip, &Spring::NONE, start, self.tolerance)
                    .ok();
                found.as_ref()?;
            }
            found.filter(|found| self.taut_index(found, &Spring::NONE) == Ok(0))
        };
        axes.iter().find_map(led)
    }

    /// The equilibrium of a rod solved beside a spring, in the user's units.
    pub(super) fn told(
        &self,
        found: &Solved,
        spring: &Spring,
        residual: f64,
        route: Route,
        plane: Option<Plane>,
    ) -> Result<Equilibrium> {
        let n = found.shape.n;
        let lam = self.lam(&n);
        if lam < TIGHT && route.from_guess {
            return Err(Error::no_convergence(
                "the guess is that of a taut rod, and leads to one that is slack; give a nearer guess",
            ));
        }
        let b = join(&found.base_couple, &n);
        if plane.is_some_and(|plane| !plane.in_plane_part(&b).1) {
            return Err(Error::no_convergence(
                "the equilibrium of a taut rod that was found is not in the plane; use solve.path = \"auto\"",
            ));
        }
        let path = match plane {
            Some(_) => Path::Planar,
            None => Path::Spatial,
        };
        let (last, tip) = (found.shape.at(1.0), n - self.total_load());
        let potential = (self.weight.as_ref()).map_or(0.0, |weight| weight.potential(found.work));
        Ok(Equilibrium {
            base: self.rod.outward_wrench(&b),
            end: self
                .rod
                .outward_section(1.0, &last, &found.position, found.energy, &tip)?,
            index: self.taut_index(found, spring)?,
            potential: potential * self.rod.units().0,
            residual,
            route,
            taken: ChosenPath::new(
                path,
                format!(
                    "the rod is taut, sqrt(F L^2/B) = {lam:.1}: the force is the unknown, and the rod is solved from both ends"
                ),
            ),
        })
    }
}
