//! Taut rods: the equilibrium under a given force whose end is turned, or loaded, as given (theory 3.6).
//!
//! The base wrench tells where the end of a rod is with an error that grows as exp(lam), lam^2 = F L^2/B. What is good at both
//! ends are the force n and what the end is held by: with them given, frame and couple solve a boundary-value problem whose growing
//! modes die towards one end and whose decaying modes towards the other. It is collocated ([`interval`]) on a mesh that is fine in
//! the layers at the ends, of the width 1/lam, and takes any step between them; r(1) and the energy are quadratures. The couple is
//! an unknown of its own: m(0) - r x n would lose lam^2 times rounding.

mod chain;
mod guess;
mod held;
mod index;
mod interval;
mod mesh;
mod pulled;

use super::line::Wrench;
use super::scaled_law::ScaledLaw;
use crate::error::{Error, Result};
use crate::math::se3::{frame, halves, rotation_vector};
use chain::{ANSWERS, Answers, AtEnd, REST, chain, follow, rest};
use interval::{Condensed, Pulled, STAGES, Scheme, correct};
use nalgebra::{Matrix3, SMatrix, Vector3};

pub(in crate::rod) use interval::Section;
pub use pulled::Taut;

/// What is given at the end of a rod, beside the force.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum Tip {
    /// Its directors, as columns.
    Turned(Matrix3<f64>),
    /// The couple on it; the force acts `arm` away, along its directors.
    Loaded {
        /// The couple.
        couple: Vector3<f64>,
        /// From the end to where the force acts, along the directors of the end.
        arm: Vector3<f64>,
    },
}

/// A taut rod, to begin another with: mesh, frames and couples.
#[derive(Debug, Clone)]
pub(in crate::rod) struct Shape {
    places: Vec<f64>,
    nodes: Vec<Section>,
    stages: Vec<[Section; STAGES]>,
    n: Vector3<f64>,
    tolerance: f64,
}

/// A taut rod with what its ends do.
#[derive(Debug, Clone)]
pub(in crate::rod) struct Solved {
    pub shape: Shape,
    pub base_couple: Vector3<f64>,
    pub position: Vector3<f64>,
    pub energy: f64,
    /// Derivatives by the force, and by the turn (or couple) of the end.
    pub by_force: Derivatives,
    pub by_tip: Derivatives,
    /// The sign of the determinant of the boundary-value problem: changes where the rod under this force is neutral.
    pub sign: f64,
    /// Estimated error of frame and couple (over sqrt|n|), Newton steps, intervals.
    pub error: f64,
    pub iterations: usize,
}

/// Of couple at the base, couple, turn and place of the end.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Derivatives {
    /// m(0).
    pub base_couple: Matrix3<f64>,
    /// m(L).
    pub couple: Matrix3<f64>,
    /// Rotation vector of the end.
    pub turn: Matrix3<f64>,
    /// Position of the end.
    pub position: Matrix3<f64>,
}

/// Newton steps at most, and meshes tried.
const MOST: usize = 40;
const MESHES: usize = 24;
/// How often a mesh is halved for what is between its nodes.
const HALVINGS: usize = 2;
/// Intervals at most.
const INTERVALS: usize = 2_000;
/// A mesh serves where sqrt|n| is not farther from that it was made for.
const ALIKE: f64 = 1.25;
/// ... and where its couple m(0) is not farther off, over sqrt|n|.
const NEAR: f64 = 0.3;
/// The base wrench is followed along the rod to find what it means, up to this sqrt|n|.
const FOLLOWED: f64 = 18.0;
/// A step of Newton's method turns no section farther.
const TURN: f64 = 0.7;
/// Newton's steps fall by this factor at least: turns and stages vary together but for the error of a step.
const LINEAR: f64 = 1e-3;
/// Derivatives are those before the last step, which must not be longer, in tolerances.
const LINEARISED: f64 = 1e3;
/// Finest and coarsest tolerance of a mesh.
const FINEST: f64 = 1e-14;
const COARSEST: f64 = 1e-6;

impl Shape {
    /// True if a rod under the force `n`, wanted to `tolerance`, can begin here.
    fn serves(&self, n: &Vector3<f64>, tolerance: f64) -> bool {
        let ratio = (n.norm() / self.n.norm()).sqrt();
        self.tolerance <= tolerance && (1.0 / ALIKE..ALIKE).contains(&ratio)
    }

    /// How many intervals it has.
    pub fn intervals(&self) -> usize {
        self.stages.len()
    }

    /// Frame and couple at `s`.
    pub fn at(&self, s: f64) -> Section {
        let after = self.places.partition_point(|place| *place <= s);
        let k = after.clamp(1, self.stages.len()) - 1;
        let (from, to) = (self.places[k], self.places[k + 1]);
        let by = Scheme::get().interpolate((s - from) / (to - from));
        let mut found = Section {
            turn: self.nodes[k].turn * by[0],
            m: self.nodes[k].m * by[0],
        };
        for (stage, by) in self.stages[k].iter().zip(&by[1..]) {
            found.turn += stage.turn * *by;
            found.m += stage.m * *by;
        }
        found
    }

    /// Every interval of `split` halved.
    fn halved(&self, split: &[bool]) -> Self {
        let nodes = &Scheme::get().nodes;
        let mut finer = Self {
            places: vec![0.0],
            nodes: vec![self.nodes[0]],
            stages: Vec::new(),
            ..self.clone()
        };
        for (k, halve) in split.iter().enumerate() {
            let (from, to) = (self.places[k], self.places[k + 1]);
            if *halve {
                let middle = 0.5 * (from + to);
                for (a, b, node) in [
                    (from, middle, self.at(middle)),
                    (middle, to, self.nodes[k + 1]),
                ] {
                    finer.stages.push(nodes.map(|x| self.at(a + x * (b - a))));
                    finer.places.push(b);
                    finer.nodes.push(node);
                }
            } else {
                finer.stages.push(self.stages[k]);
                finer.places.push(to);
                finer.nodes.push(self.nodes[k + 1]);
            }
        }
        finer
    }
}

/// One Newton step: its parts, and what they do.
struct Correction {
    intervals: Vec<Condensed>,
    answers: Vec<Answers>,
    /// Way of the end.
    way: SMatrix<f64, 3, ANSWERS>,
    sign: f64,
    size: f64,
}

/// The rod under the base wrench's force `b.n`, its end held as `tip` says; `b.m` and `start` tell which equilibrium is meant. To
/// `tolerance` in turns and couples over sqrt|n|.
///
/// # Errors
/// A law that refuses; no convergence.
pub(in crate::rod) fn solved(
    law: &ScaledLaw,
    b: &Wrench,
    tip: &Tip,
    start: Option<&Shape>,
    tolerance: f64,
) -> Result<Solved> {
    let tolerance = tolerance.clamp(FINEST, COARSEST);
    let (m, n) = halves(b);
    let pulled = Pulled::new(law, n);
    let near = |shape: &&Shape| {
        shape.serves(&n, tolerance) && (shape.nodes[0].m - m).norm() < NEAR * pulled.kappa
    };
    if let Some(start) = start.filter(near)
        && let Ok(found) = pulled.refined(start.clone(), tip, tolerance)
    {
        return Ok(found);
    }
    if pulled.kappa < FOLLOWED
        && let Some(start) = pulled.followed(b, tip, tolerance)
        && let Ok(found) = pulled.refined(start, tip, tolerance)
    {
        return Ok(found);
    }
    pulled.refined(pulled.guessed(b, tip, tolerance)?, tip, tolerance)
}

impl<'a> Pulled<'a> {
    pub(super) fn new(law: &'a ScaledLaw, n: Vector3<f64>) -> Self {
        Self {
            law,
            n,
            kappa: n.norm().sqrt().max(1.0),
        }
    }
}

impl Pulled<'_> {
    /// Solved on meshes that are refined until the error is below the tolerance.
    fn refined(&self, start: Shape, tip: &Tip, tolerance: f64) -> Result<Solved> {
        let mut shape = start;
        shape.n = self.n;
        let mut iterations = 0;
        for _ in 0..MESHES {
            let (correction, steps) = self.newton(&mut shape, tip, tolerance)?;
            iterations += steps;
            let mut split = Vec::with_capacity(shape.stages.len());
            let (mut position, mut energy, mut error) = (Vector3::zeros(), 0.0, 0.0_f64);
            for (k, stages) in shape.stages.iter().enumerate() {
                let passed = self.passed((shape.places[k], shape.places[k + 1]), stages)?;
                position += passed.way;
                energy += passed.energy;
                error = error.max(passed.error);
                split.push(!(passed.error <= tolerance));
            }
            if !split.contains(&true) {
                return Ok(self.told(shape, correction, (position, energy), error, iterations));
            }
            if shape.stages.len() > INTERVALS {
                break;
            }
            shape = shape.halved(&split);
        }
        Err(Error::no_convergence(format!(
            "a taut rod is not resolved to {tolerance:.0e} by {INTERVALS} intervals along it; loosen the tolerance"
        )))
    }

    /// Newton's method on the mesh of `shape`, with the last step taken.
    fn newton(&self, shape: &mut Shape, tip: &Tip, tolerance: f64) -> Result<(Correction, usize)> {
        let lost = || {
            Error::no_convergence(
                "the equilibrium of a taut rod under a given force was not found: it is neutral, or far from where the search began",
            )
        };
        let mut last = f64::INFINITY;
        for steps in 1..=MOST {
            let correction = self.correction(shape, tip)?.ok_or_else(lost)?;
            let size = correction.size;
            if !size.is_finite() {
                break;
            }
            let part = (TURN / size).min(1.0);
            for (k, answers) in correction.answers.iter().enumerate() {
                let change = rest(answers);
                correct(&mut shape.nodes[k], &change, part, self.kappa);
                if let Some(interval) = correction.intervals.get(k) {
                    interval.correct(&change, part, self.kappa, &mut shape.stages[k]);
                }
            }
            // What the next step would be, by the rate of the last two; at first by that of Newton's method.
            let rate = if steps == 1 {
                size.max(LINEAR)
            } else {
                size / last
            };
            let done = size * rate < 0.1 * tolerance && size < LINEARISED * tolerance;
            if part == 1.0 && (done || (size < 1e-9 && size > 0.3 * last)) {
                return Ok((correction, steps));
            }
            last = size;
        }
        Err(lost())
    }

    /// None where the linearised rod is singular.
    fn correction(&self, shape: &Shape, tip: &Tip) -> Result<Option<Correction>> {
        let mut intervals = Vec::with_capacity(shape.stages.len());
        for (k, stages) in shape.stages.iter().enumerate() {
            let places = (shape.places[k], shape.places[k + 1]);
            let Some(found) =
                self.condensed(places, [&shape.nodes[k], &shape.nodes[k + 1]], stages)?
            else {
                return Ok(None);
            };
            intervals.push(found);
        }
        let end = self.at_end(&shape.nodes[shape.nodes.len() - 1], tip);
        let Some((answers, sign)) = chain(&intervals, &end) else {
            return Ok(None);
        };
        let mut way = SMatrix::zeros();
        let mut size = 0.0_f64;
        for (interval, start) in intervals.iter().zip(&answers) {
            way += follow(&interval.way, start);
            size = size
                .max(interval.change(&rest(start)))
                .max(rest(start).amax());
        }
        Ok(Some(Correction {
            intervals,
            answers,
            way,
            sign,
            size,
        }))
    }

    fn at_end(&self, last: &Section, tip: &Tip) -> AtEnd {
        let mut end = AtEnd {
            by: SMatrix::zeros(),
            right: SMatrix::zeros(),
        };
        let unit = Matrix3::identity();
        match tip {
            Tip::Turned(target) => {
                let off = rotation_vector(&(target * frame(&last.turn).transpose()));
                end.by.fixed_columns_mut::<3>(0).copy_from(&unit);
                end.right.fixed_columns_mut::<3>(3).copy_from(&unit);
                end.right.column_mut(REST).copy_from(&off);
            }
            Tip::Loaded { couple, arm } => {
                // m = couple + R arm x n.
                let lever = frame(&last.turn) * arm;
                let off = couple + lever.cross(&self.n) - last.m;
                let turned = -(self.n.cross_matrix() * lever.cross_matrix()) / self.kappa;
                end.by.fixed_columns_mut::<3>(0).copy_from(&turned);
                end.by.fixed_columns_mut::<3>(3).copy_from(&unit);
                let by_force = lever.cross_matrix() / self.kappa;
                end.right.fixed_columns_mut::<3>(0).copy_from(&by_force);
                let by_couple = unit / self.kappa;
                end.right.fixed_columns_mut::<3>(3).copy_from(&by_couple);
                end.right.column_mut(REST).copy_from(&(off / self.kappa));
            }
        }
        end
    }

    fn told(
        &self,
        shape: Shape,
        correction: Correction,
        (position, energy): (Vector3<f64>, f64),
        error: f64,
        iterations: usize,
    ) -> Solved {
        let last = correction.answers.len() - 1;
        let [first, end] = [0, last].map(|k| correction.answers[k]);
        let derivatives = |column: usize| {
            let part =
                |rows: &Answers, row: usize| rows.fixed_view::<3, 3>(row, column).into_owned();
            Derivatives {
                base_couple: part(&first, 3) * self.kappa,
                couple: part(&end, 3) * self.kappa,
                turn: part(&end, 0),
                position: correction.way.fixed_columns::<3>(column).into_owned(),
            }
        };
        Solved {
            base_couple: shape.nodes[0].m,
            position,
            energy,
            by_force: derivatives(0),
            by_tip: derivatives(3),
            sign: correction.sign,
            error,
            iterations,
            shape,
        }
    }
}

/// Frame and couple at a place, the way there and the energy on it.
type Passed = (Section, Vector3<f64>, f64);

impl Pulled<'_> {
    /// Sections at places in growing order.
    fn sections(
        &self,
        shape: &Shape,
        tip: &Tip,
        at: &[f64],
        tolerance: f64,
    ) -> Result<Vec<Passed>> {
        // Polynomials of the degree of the stages gain as many binary digits with every halving.
        let mut fine = shape.clone();
        for _ in 0..HALVINGS {
            fine = fine.halved(&vec![true; fine.stages.len()]);
        }
        self.newton(&mut fine, tip, tolerance)?;
        let mut found = Vec::with_capacity(at.len());
        let (mut k, mut way, mut energy) = (0, Vector3::zeros(), 0.0);
        for s in at {
            while k + 1 < fine.stages.len() && fine.places[k + 1] <= *s {
                let passed = self.passed((fine.places[k], fine.places[k + 1]), &fine.stages[k])?;
                way += passed.way;
                energy += passed.energy;
                k += 1;
            }
            let (from, to) = (fine.places[k], s.clamp(fine.places[k], fine.places[k + 1]));
            let part = Scheme::get().nodes.map(|x| fine.at(from + x * (to - from)));
            let passed = self.passed((from, to), &part)?;
            let mut section = fine.at(to);
            section.turn /= section.turn.norm();
            found.push((section, way + passed.way, energy + passed.energy));
        }
        Ok(found)
    }
}
