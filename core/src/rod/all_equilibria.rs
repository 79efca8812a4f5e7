//! Search for all equilibria under one end condition: from every start, and by deflation.

use super::chart::{AnyChart, Chart, Spatial, dynamic};
use super::closed_form::ClosedForm;
use super::equilibrium::{Equilibrium, Route};
use super::ivp::Wrench;
use super::path_to_target::{self, PathSearch, budgeted_equations, options};
use super::planar::Plane;
use super::problem::Problem;
use super::solution_path::{ChosenPath, Path, ProblemChart};
use super::starts::PathStart;
use super::taut::TAUT;
use crate::elastica::equilibria_at;
use crate::error::Result;
use crate::math::se3::{halves, join};
use crate::solve::deflation::{self, find_further};
use crate::solve::newton;
use crate::solve::parametrised_problem::{Family, Linearised};
use nalgebra::{DVector, Matrix3, Vector3};
use std::f64::consts::TAU;

/// Couples and forces, in B/L and B/L^2, at which deflation begins: those of a strongly bent rod.
const TYPICAL: f64 = 10.0;
/// Distance, relative to 1 + their wrench, below which two equilibria are one. At a fold, where two meet, they are
/// known only to the root of the tolerance.
const SAME: f64 = 1e-4;
/// Most Newton steps of one search by deflation.
const PATIENCE: usize = 40;

/// Sizes of the forces of guesses of deflation within a plane, in parts of [`TYPICAL`]. Couples go with their root.
const PLANAR_SIZES: [f64; 6] = [1.0, 3.0, 6.0, 12.0, 22.0, 36.0];
/// Largest wrench of a list, in the same units, unless the answer to the problem has half of that.
const LARGEST: f64 = 400.0;
/// Directions of the force, couples and most Newton steps of the scan of a plane.
const SCAN_DIRECTIONS: usize = 12;
const SCAN_COUPLES: [f64; 7] = [-2.1, -1.4, -0.7, 0.1, 0.7, 1.4, 2.1];
const SCAN_PATIENCE: usize = 20;
/// Residual, relative to 1 + the wrench, up to which the image of an equilibrium under a symmetry is one.
const IMAGE: f64 = 1e-6;
/// Singular values of the equations below this part of the largest belong to a continuous family.
const NEUTRAL: f64 = 1e-8;

/// A held rod in a chart as a family with one member.
struct HeldRod<'a> {
    chart: &'a dyn AnyChart,
    problem: &'a Problem,
    search: PathSearch,
}

impl Family for HeldRod<'_> {
    fn size(&self) -> usize {
        self.chart.size()
    }

    fn linearised(&self, x: &DVector<f64>, _: f64) -> Result<Linearised> {
        let (residual, jacobian) = budgeted_equations(self.chart, &self.search, self.problem, x)?;
        Ok(Linearised {
            residual,
            jacobian,
            slope: DVector::zeros(self.size()),
        })
    }
}

/// The search that found an equilibrium.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Finding {
    /// The answer to the problem without a guess.
    Solution,
    /// The complete list of the planar elastica.
    ClosedForm,
    /// A path from another start.
    Start,
    /// Deflation of the known equilibria.
    Deflation,
    /// The image of a known equilibrium under a symmetry of the data.
    Symmetry,
}

/// One of all equilibria of a problem.
#[derive(Debug, Clone)]
pub struct ListedEquilibrium {
    /// The equilibrium.
    pub equilibrium: Equilibrium,
    /// The problem; shooting from its base wrench gives this equilibrium, also of a taut rod.
    pub problem: Problem,
    /// The search that found the equilibrium.
    pub finding: Finding,
    /// Index among variations within the plane of the data. `None` for an equilibrium out of the plane, for data
    /// without a plane, and for a taut rod that is unstable.
    pub index_in_plane: Option<usize>,
    /// True if neighbours in a continuous family are equilibria, too: a motion that costs nothing.
    pub neutral: bool,
}

/// All equilibria of a problem that a search found.
#[derive(Debug, Clone)]
pub struct AllEquilibria {
    /// The equilibria, in the order of their discovery.
    pub found: Vec<ListedEquilibrium>,
    /// Greatest sqrt(force L^2/B) below which no equilibrium within the plane is missing; `None` where nothing is
    /// proven.
    pub complete_below: Option<f64>,
    /// Largest base wrench searched, couple in B/L, force in B/L^2.
    pub largest_wrench: f64,
}

impl Problem {
    /// Base wrenches, in the world frame, of the equilibria found under this end condition besides those at `known`.
    /// The search begins from every start of [`Problem::solve`], in a plane and in closed form where the data allow
    /// it. Deflation then continues from all of these and from rods bent every way. Only the closed form guarantees
    /// that none in its plane is missing.
    pub fn others(&self, known: &[Wrench]) -> Vec<Wrench> {
        let mut all: Vec<Wrench> = known.iter().map(|base| self.rod.inward(base)).collect();
        match self.choose_chart(None) {
            Ok((ProblemChart::ClosedForm(chart), taken)) => {
                self.gather(&chart, &mut self.closed_starts(&chart), &taken, &mut all);
            }
            Ok((ProblemChart::Planar(plane), taken)) => {
                self.gather(&plane, &mut self.planar_starts(&plane), &taken, &mut all);
            }
            _ => {}
        }
        let taken = ChosenPath::new(Path::Spatial, "all equilibria are looked for".to_owned());
        self.gather(&Spatial, &mut self.starts(), &taken, &mut all);
        self.deflate(&mut all);
        let found = all.split_off(known.len()).into_iter();
        found.map(|b| self.rod.outward_wrench(&b)).collect()
    }

    /// Adds the equilibria reached from the starts.
    fn gather(
        &self,
        chart: &dyn AnyChart,
        starts: &mut dyn Iterator<Item = PathStart>,
        taken: &ChosenPath,
        all: &mut Vec<Wrench>,
    ) {
        let search = PathSearch::new();
        for start in starts {
            if search.is_over() {
                break;
            }
            if let Ok(found) = self.walk(chart, &search, start, taken) {
                let b = self.rod.inward(&found.base);
                if !all.iter().any(|known| is_same(known, &b)) {
                    all.push(b);
                }
            }
        }
    }

    /// Adds the equilibria found by deflation, up to wrenches of twice the known size: rods have equilibria of any
    /// order.
    fn deflate(&self, all: &mut Vec<Wrench>) {
        let bound = 2.0 * all.iter().map(|b| b.norm()).fold(TYPICAL, f64::max);
        let mut guesses: Vec<DVector<f64>> = all.iter().map(|b| dynamic(*b)).collect();
        let known = guesses.clone();
        for k in 0..6 {
            guesses.extend([TYPICAL, -TYPICAL].map(|size| dynamic(Wrench::ith(k, size))));
        }
        let found = self.deflated(&Spatial, &known, &guesses);
        all.extend(found.into_iter().filter(|b| b.norm() <= bound));
    }

    /// Base wrenches of the equilibria in a chart that deflation of the known ones finds from the guesses.
    fn deflated<C: Chart + AnyChart>(
        &self,
        chart: &C,
        known: &[DVector<f64>],
        guesses: &[DVector<f64>],
    ) -> Vec<Wrench> {
        let asked = deflation::Options {
            newton: options(self.correction(), PATIENCE),
            separation: SAME,
            ..deflation::Options::default()
        };
        let mut all = known.to_vec();
        for guess in guesses {
            // Each guess has a budget of its own: a hopeless one takes nothing from the others.
            let member = HeldRod {
                chart,
                problem: self,
                search: PathSearch::new(),
            };
            let guess = std::slice::from_ref(guess);
            if let Ok(search) = find_further(&member, 0.0, &all, guess, &asked) {
                all.extend(search.solutions.into_iter().map(|solution| solution.x));
            }
        }
        let found = all[known.len()..].iter();
        found
            .filter_map(|x| Chart::wrench(chart, self, x).ok())
            .collect()
    }
}

impl Problem {
    /// All equilibria that starts, closed form, deflation and symmetries find, with the one near `guess`. The closed
    /// form of the elastica leaves none out of its plane below `lambda_max`. A rod with a load along it also falls from
    /// tilts every way. Where it is so heavy that its base wrench tells nothing of its end, these falls are the whole
    /// search. `interrupted` is asked between the searches.
    ///
    /// # Errors
    /// No equilibrium found, as [`Problem::solve`].
    pub fn all_equilibria(
        &self,
        guess: Option<&Wrench>,
        lambda_max: f64,
        interrupted: &mut dyn FnMut() -> bool,
    ) -> Result<AllEquilibria> {
        let solution = self.solve(None);
        let mut all: Vec<(Wrench, Finding)> = Vec::new();
        let mut direct = Vec::new();
        let answers = std::iter::once((self.clone(), solution.clone()));
        let near_guess = guess.map(|base| {
            let there = self.clone();
            let found = there.solve(Some(base));
            (there, found)
        });
        for (problem, answer) in answers.chain(near_guess) {
            let Ok(found) = answer else {
                continue;
            };
            let b = self.rod.inward(&found.base);
            if !all.iter().any(|(known, _)| is_same(known, &b)) {
                all.push((b, Finding::Solution));
                direct.push((problem, found, Finding::Solution));
            }
        }
        let heavy = solution
            .as_ref()
            .is_ok_and(|found| self.outweighs_base(&found.base));
        let mut complete_below = None;
        let charted = self.choose_chart(None).map(|(chart, _)| chart);
        let plane = match charted {
            Ok(ProblemChart::ClosedForm(chart)) => {
                complete_below = self.list_closed_form(&chart, lambda_max, &mut all);
                Some(*chart.plane())
            }
            Ok(ProblemChart::Planar(plane)) => Some(plane),
            _ => None,
        };
        let taken = ChosenPath::new(Path::Spatial, "all equilibria are looked for".to_owned());
        if !interrupted() {
            for (problem, found) in self.fallen_every_way(plane.as_ref()) {
                let b = self.rod.inward(&found.base);
                if !all.iter().any(|(known, _)| is_same(known, &b)) {
                    all.push((b, Finding::Start));
                    direct.push((problem, found, Finding::Start));
                }
            }
        }
        if let Some(plane) = &plane
            && !heavy
            && !interrupted()
        {
            let mut wrenches: Vec<Wrench> = all.iter().map(|(b, _)| *b).collect();
            self.gather(plane, &mut self.planar_starts(plane), &taken, &mut wrenches);
            note(&mut all, wrenches, Finding::Start);
            self.add_images(Some(plane), &mut all);
            if complete_below.is_none() {
                self.scan(plane, &mut all);
                self.deflate_in(plane, &mut all);
                self.add_images(Some(plane), &mut all);
            }
        }
        if !heavy && !interrupted() {
            let mut wrenches: Vec<Wrench> = all.iter().map(|(b, _)| *b).collect();
            self.gather(&Spatial, &mut self.starts(), &taken, &mut wrenches);
            note(&mut all, wrenches, Finding::Start);
            self.add_images(plane.as_ref(), &mut all);
        }
        if !heavy && !interrupted() {
            let mut wrenches: Vec<Wrench> = all.iter().map(|(b, _)| *b).collect();
            self.deflate(&mut wrenches);
            note(&mut all, wrenches, Finding::Deflation);
            self.add_images(plane.as_ref(), &mut all);
        }
        // Rods have equilibria of any order: the list ends at one size.
        let answer = all.first().map_or(0.0, |(b, _)| b.norm());
        let largest = LARGEST.max(2.0 * answer);
        all.retain(|(b, finding)| b.norm() <= largest || *finding == Finding::ClosedForm);
        let mut found: Vec<ListedEquilibrium> = Vec::new();
        for (b, finding) in all {
            let own = |found: &Equilibrium| is_same(&self.rod.inward(&found.base), &b);
            let listed = match direct.iter().position(|(_, found, _)| own(found)) {
                Some(k) => {
                    let (problem, found, finding) = direct.swap_remove(k);
                    self.described_in_list(found, problem, finding, plane.as_ref())
                }
                None => self.listed(&b, finding, plane.as_ref()),
            };
            let Ok(listed) = listed else {
                continue;
            };
            // Of a continuous family one member is listed.
            let energy = listed.equilibrium.end.energy + listed.equilibrium.potential;
            let is_member = |other: &ListedEquilibrium| {
                let own = other.equilibrium.end.energy + other.equilibrium.potential;
                other.neutral && (own - energy).abs() <= SAME * (1e-3 + energy.abs())
            };
            if !(listed.neutral && found.iter().any(is_member)) {
                found.push(listed);
            }
        }
        match (found.is_empty(), solution) {
            (true, Err(why)) => Err(why),
            _ => Ok(AllEquilibria {
                found,
                complete_below,
                largest_wrench: largest,
            }),
        }
    }

    /// Adds every elastica with its end in place and lambda below the bound; returns the bound if the list is proven.
    fn list_closed_form(
        &self,
        chart: &ClosedForm,
        lambda_max: f64,
        all: &mut Vec<(Wrench, Finding)>,
    ) -> Option<f64> {
        self.end.position[0]?;
        let target = chart.target(self);
        for listed in equilibria_at(target.x, target.y, lambda_max).ok()? {
            let x = ClosedForm::at(listed.equilibrium.p, listed.equilibrium.w);
            let b = Chart::wrench(chart, self, &dynamic(x)).ok()?;
            if !all.iter().any(|(known, _)| is_same(known, &b)) {
                all.push((b, Finding::ClosedForm));
            }
        }
        Some(lambda_max)
    }

    /// Adds the equilibria to which Newton's method leads from forces of all directions and sizes in the plane. With a
    /// force P the couple is at most of the size 2 sqrt(P) on a rod that turns back (theory 2.1).
    fn scan(&self, plane: &Plane, all: &mut Vec<(Wrench, Finding)>) {
        let asked = options(self.correction(), SCAN_PATIENCE);
        for size in PLANAR_SIZES.map(|part| part * TYPICAL) {
            for direction in 0..SCAN_DIRECTIONS {
                let angle = TAU * (direction as f64 + 0.25) / SCAN_DIRECTIONS as f64;
                let (across, along) = angle.sin_cos();
                for couple in SCAN_COUPLES {
                    let start = Vector3::new(couple * size.sqrt(), along * size, across * size);
                    let member = HeldRod {
                        chart: plane,
                        problem: self,
                        search: PathSearch::new(),
                    };
                    let equations = |x: &DVector<f64>| {
                        let at = member.linearised(x, 0.0)?;
                        Ok((at.residual, at.jacobian))
                    };
                    let Ok(found) = newton::solve(equations, &dynamic(start), &asked) else {
                        continue;
                    };
                    let Ok(b) = Chart::wrench(plane, self, &found.x) else {
                        continue;
                    };
                    if b.norm() <= LARGEST && !all.iter().any(|(known, _)| is_same(known, &b)) {
                        all.push((b, Finding::Start));
                    }
                }
            }
        }
    }

    /// Adds the equilibria within the plane that deflation finds.
    fn deflate_in(&self, plane: &Plane, all: &mut Vec<(Wrench, Finding)>) {
        let within = |b: &Wrench| Some(plane.in_plane_part(b)).filter(|(_, whole)| *whole);
        let known: Vec<DVector<f64>> = (all.iter())
            .filter_map(|(b, _)| within(b))
            .map(|(x, _)| dynamic(x))
            .collect();
        let mut guesses = known.clone();
        for part in PLANAR_SIZES {
            for corner in 0..27 {
                let signs = [corner % 3, corner / 3 % 3, corner / 9].map(|k| f64::from(k) - 1.0);
                let couple = part.sqrt();
                let x = Vector3::new(signs[0] * couple, signs[1] * part, signs[2] * part);
                guesses.push(dynamic(x * TYPICAL));
            }
        }
        let found = self.deflated(plane, &known, &guesses);
        for b in found.into_iter().filter(|b| b.norm() <= LARGEST) {
            if !all.iter().any(|(known, _)| is_same(known, &b)) {
                all.push((b, Finding::Deflation));
            }
        }
    }

    /// Adds the images of the known equilibria under symmetries of the data: reflections in planes through d3, half a
    /// turn about d3, and the exchange of both ends. An image counts if it solves the problem.
    fn add_images(&self, plane: Option<&Plane>, all: &mut Vec<(Wrench, Finding)>) {
        if self.end.follower {
            return;
        }
        let [one, other] = [Vector3::x(), Vector3::y()].map(|normal| reflection(&normal));
        let mut turns = vec![Matrix3::identity(), one, other, one * other];
        turns.extend(plane.map(|plane| reflection(&plane.normal())));
        let mut next = 0;
        while let Some((b, _)) = all.get(next).copied() {
            next += 1;
            let reversed = self.exchanged(&b);
            for from in std::iter::once(b).chain(reversed) {
                for turn in &turns {
                    let (m, n) = halves(&from);
                    // Couples are axial vectors.
                    let image = join(&(turn * m * turn.determinant()), &(turn * n));
                    if all.iter().any(|(known, _)| is_same(known, &image)) {
                        continue;
                    }
                    let left = self.bare_trial(&image).map(|trial| self.residual(&trial));
                    if left.is_ok_and(|left| left.norm() <= IMAGE * (1.0 + image.norm())) {
                        all.push((image, Finding::Symmetry));
                    }
                }
            }
        }
    }

    /// The base wrench of the rod that is seen from its other end, d1 kept and d2, d3 turned about it.
    fn exchanged(&self, b: &Wrench) -> Option<Wrench> {
        let end = self.bare_trial(b).ok()?;
        let back = end.rotation.transpose();
        let (m, n) = (back * end.m, back * end.n);
        Some(join(
            &Vector3::new(-m.x, m.y, m.z),
            &Vector3::new(-n.x, n.y, n.z),
        ))
    }

    /// The equilibrium with this base wrench, in the units of the numerics.
    fn listed(
        &self,
        b: &Wrench,
        finding: Finding,
        plane: Option<&Plane>,
    ) -> Result<ListedEquilibrium> {
        // Few steps: each search ends with a converged equilibrium, and an image is as good.
        let asked = options(self.correction(), 10);
        let solved = path_to_target::newton(&Spatial, self, &dynamic(*b), &asked);
        let equilibrium = match solved {
            Ok(solved) => {
                let mut route = Route::start();
                route.add(&solved);
                let why = "all equilibria were looked for".to_owned();
                let taken = ChosenPath::new(Path::Spatial, why);
                self.describe(&Spatial, &solved, route, taken)?
            }
            Err(_) => self.solve(Some(&self.rod.outward_wrench(b)))?,
        };
        self.described_in_list(equilibrium, self.clone(), finding, plane)
    }

    /// A found equilibrium with what the list says of it. The base wrench of a taut rod tells nothing of the end: there
    /// the symmetry of the data alone tells of a neutral motion.
    fn described_in_list(
        &self,
        equilibrium: Equilibrium,
        problem: Self,
        finding: Finding,
        plane: Option<&Plane>,
    ) -> Result<ListedEquilibrium> {
        let b = self.rod.inward(&equilibrium.base);
        let flat = plane.filter(|plane| plane.in_plane_part(&b).1);
        let taut = self.is_taut(&equilibrium.base, &equilibrium.end);
        let index_in_plane = if taut {
            flat.and((equilibrium.index == 0).then_some(0))
        } else {
            flat.and_then(|plane| self.index_in_plane(plane, &b))
        };
        let neutral = if taut {
            !self.zero_modes(&equilibrium.base).is_empty()
        } else {
            let values = self.equations(&self.trial(&b)?).1.singular_values();
            values.min() <= NEUTRAL * values.max()
        };
        Ok(ListedEquilibrium {
            index_in_plane,
            neutral,
            finding,
            equilibrium,
            problem,
        })
    }

    /// True if a load along the rod makes the rod so taut that shooting from the base is useless.
    fn outweighs_base(&self, base: &Wrench) -> bool {
        let (_, n) = halves(&self.rod.inward(base));
        self.weight.is_some() && self.may_be_taut() && self.lam(&n) > TAUT
    }
}

/// Reflection in the plane through the clamp with this unit normal.
fn reflection(normal: &Vector3<f64>) -> Matrix3<f64> {
    Matrix3::identity() - 2.0 * normal * normal.transpose()
}

/// Appends the wrenches of `found` after the known ones, each with the search `finding`.
fn note(all: &mut Vec<(Wrench, Finding)>, found: Vec<Wrench>, finding: Finding) {
    let known = all.len();
    all.extend(found.into_iter().skip(known).map(|b| (b, finding)));
}

/// True if two wrenches belong to one equilibrium.
fn is_same(a: &Wrench, b: &Wrench) -> bool {
    (a - b).norm() <= SAME * (1.0 + b.norm())
}
