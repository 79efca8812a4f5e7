//! Taut rods: equilibria under a given force with the tip turned, or loaded, as given (theory 3.6).
//!
//! The base wrench determines the end of a rod with an error that grows as exp(lam), lam^2 = F L^2/B. The force n and
//! the tip data are well conditioned at both ends. Given both, frame and couple solve a boundary-value problem whose
//! growing modes die towards one end and whose decaying modes towards the other. It is collocated ([`interval`]) on a
//! mesh that is fine in the layers at the ends, of the width 1/lam. Intervals between the layers may have any length;
//! r(1) and the energy are quadratures. The couple is an unknown of its own: m(0) - r x n would lose lam^2 times
//! rounding.

mod at_rest;
mod boundary_layers;
mod chain;
mod condensed;
mod end_conditions;
mod first_order_mass;
mod index;
mod interval;
mod landing;
mod mesh;
mod stabilising_spring;
mod taut_rod;
mod turning_base;

use crate::error::{Error, Result};
use crate::math::se3::{exponential, frame, join, rotation_vector};
use chain::{
    ANSWERS, Answers, AtEnd, ChainSolution, ForceEquation, Forces, REST, chain, interval_change,
    rest,
};
use condensed::Condensed;
use first_order_mass::neutral_error;
use interval::{RodUnderForce, STAGES, Scheme, correct};
use nalgebra::{Matrix3, SMatrix, Vector3};

pub(in crate::rod) use end_conditions::{TAUT, TIGHT};
pub use first_order_mass::Rates;
pub(in crate::rod) use interval::{FrameAndCouple, Symmetry};
pub use landing::Fallen;
pub use stabilising_spring::Spring;
pub use taut_rod::{Taut, TautLoad};

/// Data at the end of a rod besides the force.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum Tip {
    /// Directors of the end, as columns.
    Turned(Matrix3<f64>),
    /// Couple on the end, with the force on an arm.
    Loaded {
        /// The couple.
        couple: Vector3<f64>,
        /// Arm from the end to the point of action of the force, along the directors of the end.
        arm: Vector3<f64>,
    },
}

/// Converged mesh, frames and couples of a taut rod: the start of the next solution.
#[derive(Debug, Clone, PartialEq)]
pub(in crate::rod) struct Shape {
    places: Vec<f64>,
    nodes: Vec<FrameAndCouple>,
    stages: Vec<[FrameAndCouple; STAGES]>,
    n: Vector3<f64>,
    tolerance: f64,
}

/// Solution for a taut rod, with the derivatives of its ends.
#[derive(Debug, Clone)]
pub(in crate::rod) struct Solved {
    pub shape: Shape,
    pub base_couple: Vector3<f64>,
    pub position: Vector3<f64>,
    pub energy: f64,
    /// Work int f.r ds of the load along the rod.
    pub work: f64,
    /// Derivatives by the given force, and by the turn (or couple) of the end.
    pub by_force: Derivatives,
    pub by_tip: Derivatives,
    /// Sign of the determinant of the boundary-value problem; it changes where the rod under this force, with its
    /// spring, is neutral.
    pub sign: f64,
    /// Normal of the plane that the rod was not let out of.
    pub plane: Option<Vector3<f64>>,
    /// Estimated error of frame and couple (over sqrt|n|), and number of Newton steps.
    pub error: f64,
    pub iterations: usize,
}

/// Derivatives of the couple at the base and of couple, turn and place of the end.
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

impl Solved {
    /// Stored energy plus the potential of the load, up to a constant.
    fn whole_energy(&self) -> f64 {
        self.energy - self.work
    }
}

/// Most Newton steps on a mesh, and most meshes tried.
const MAX_NEWTON_STEPS: usize = 40;
const MESHES: usize = 24;
/// Halvings of a mesh before values between its nodes are read.
const HALVINGS: usize = 2;
/// Most successive halvings of a whole mesh on which Newton's method fares badly; after these there is no such rod.
const COARSE_MESHES: usize = 3;
/// Most intervals of a mesh.
const INTERVALS: usize = 2_000;
/// Largest ratio of sqrt|n| between rod and mesh at which a mesh is reused.
const ALIKE: f64 = 1.25;
/// Largest difference of couples m(0), over sqrt|n|, at which a mesh is reused, and a solution is the one meant.
const NEAR: f64 = 0.3;
/// Largest sqrt|n| at which the base wrench is integrated along the rod for a first guess.
const FOLLOWED: f64 = 18.0;
/// Largest turn of a section in a Newton step, in radians.
const TURN: f64 = 0.7;
/// Smallest ratio of the second Newton step to the first that is predicted. Turns and stages vary together up to the
/// error of a step, which is small if sections turn by no more than `TURNED` radians in an interval.
const LINEAR: f64 = 1e-3;
const TURNED: f64 = 1.5;
/// After a Newton step below `SMALL` the next must be at most `COARSE` times as large. The second that is larger shows
/// that the mesh is too coarse.
const SMALL: f64 = 0.02;
const COARSE: f64 = 0.25;
/// Newton steps below this size are rounding, and say nothing of the mesh.
const ROUNDED: f64 = 1e-9;
/// Longest last step, in tolerances. Derivatives are those before the last step: begun from the last rod of a motion
/// in short steps they would lag by one step, an error that no shorter step mends.
const LINEARISED: f64 = 1.0;
/// Smallest step of a continuation from another rod, as a fraction of the whole path.
const MIN_CONTINUATION_STEP: f64 = 0.02;
/// Finest and coarsest tolerance of a mesh.
const FINEST: f64 = 1e-14;
const COARSEST: f64 = 1e-6;

impl Shape {
    /// The shape with these sections at s, on the mesh `places`, under the base force `n`.
    fn from_sections(
        places: Vec<f64>,
        n: Vector3<f64>,
        tolerance: f64,
        section: impl Fn(f64) -> FrameAndCouple,
    ) -> Self {
        let inner = &Scheme::get().nodes;
        Self {
            nodes: places.iter().map(|s| section(*s)).collect(),
            stages: places
                .windows(2)
                .map(|pair| inner.map(|x| section(pair[0] + x * (pair[1] - pair[0]))))
                .collect(),
            places,
            n,
            tolerance,
        }
    }

    /// True if a rod under the force `n`, wanted to `tolerance`, can begin from this shape.
    fn serves(&self, n: &Vector3<f64>, tolerance: f64) -> bool {
        let ratio = (n.norm() / self.n.norm()).sqrt();
        self.tolerance <= tolerance && (1.0 / ALIKE..ALIKE).contains(&ratio)
    }

    /// Force n of the shape.
    pub fn force(&self) -> Vector3<f64> {
        self.n
    }

    /// Number of intervals.
    pub fn intervals(&self) -> usize {
        self.stages.len()
    }

    /// Frame and couple at `s`.
    pub fn at(&self, s: f64) -> FrameAndCouple {
        let after = self.places.partition_point(|place| *place <= s);
        let k = after.clamp(1, self.stages.len()) - 1;
        let (from, to) = (self.places[k], self.places[k + 1]);
        let by = Scheme::get().interpolate((s - from) / (to - from));
        let mut found = FrameAndCouple {
            turn: self.nodes[k].turn * by[0],
            m: self.nodes[k].m * by[0],
        };
        for (stage, by) in self.stages[k].iter().zip(&by[1..]) {
            found.turn += stage.turn * *by;
            found.m += stage.m * *by;
        }
        found
    }

    /// For each interval, whether one of the places `at` lies between its nodes.
    fn holding(&self, at: &[f64]) -> Vec<bool> {
        let mut holding = vec![false; self.stages.len()];
        for s in at {
            let after = self.places.partition_point(|place| place < s);
            if self.places.get(after).is_some_and(|place| place > s) && after > 0 {
                holding[after - 1] = true;
            }
        }
        holding
    }

    /// This shape with the intervals marked in `split` halved.
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

/// A Newton correction of the collocation unknowns: condensed intervals, their responses to the end data, the change
/// of the force.
struct Correction {
    intervals: Vec<Condensed>,
    answers: Vec<Answers>,
    force: Forces,
    /// Displacement of the end.
    way: SMatrix<f64, 3, ANSWERS>,
    sign: f64,
    size: f64,
}

/// The rod `pulled`, whose force at the base it bears together with `spring`; its end is held as `tip` says. The couple
/// `m` at the base and `start` select among several equilibria. `tolerance` is for turns and couples over sqrt|n|.
/// Motions out of the plane of the rod's symmetry show neither in the derivatives nor in the sign.
///
/// # Errors
/// A law that refuses; no convergence.
fn solve_taut_rod(
    pulled: &RodUnderForce<'_>,
    m: &Vector3<f64>,
    tip: &Tip,
    spring: &Spring,
    start: Option<&Shape>,
    tolerance: f64,
) -> Result<Solved> {
    let tolerance = tolerance.clamp(FINEST, COARSEST);
    let b = join(m, &pulled.n);
    let begun = |shape: Shape| pulled.refine_until_accurate(shape, tip, spring, tolerance);
    let near = |couple: &Vector3<f64>| (couple - m).norm() < NEAR * pulled.kappa;
    let beside =
        start.filter(|shape| near(&shape.nodes[0].m) && shape.serves(&pulled.n, tolerance));
    let ways: [&dyn Fn() -> Option<Solved>; 3] = [
        &|| begun(beside?.clone()).ok(),
        &|| {
            if pulled.kappa < FOLLOWED {
                begun(pulled.integrate_from_base(&b, tip, tolerance)?).ok()
            } else {
                None
            }
        },
        &|| pulled.continue_from(start?, tip, spring, tolerance),
    ];
    // The first rod found may be another equilibrium than the one meant.
    let mut other = None;
    for way in ways {
        match way() {
            Some(found) if near(&found.base_couple) => return Ok(found),
            found => other = other.or(found),
        }
    }
    match (
        pulled.guess_shape(&b, tip, tolerance).and_then(begun),
        other,
    ) {
        (Ok(found), _) if near(&found.base_couple) => Ok(found),
        (_, Some(other)) => Ok(other),
        (guessed, None) => guessed.or_else(|why| {
            let fallen = pulled.resting_shape(tip, tolerance);
            fallen.map_or(Err(why), begun)
        }),
    }
}

impl RodUnderForce<'_> {
    /// Continuation from a more distant rod: force and end data are led to the given values, in steps as small as
    /// needed.
    fn continue_from(
        &self,
        start: &Shape,
        tip: &Tip,
        spring: &Spring,
        tolerance: f64,
    ) -> Option<Solved> {
        let mut shape = start.clone();
        shape.tolerance = shape.tolerance.min(tolerance);
        let last = shape.nodes[shape.nodes.len() - 1];
        let (mut place, turn) = (Vector3::zeros(), frame(&last.turn));
        let there = self.with_force_and_unit(shape.n);
        for (k, stages) in shape.stages.iter().enumerate() {
            let passed = there.integrate_interval(shape.places[k], shape.places[k + 1], stages);
            place += passed.ok()?.way;
        }
        let same = |before: &Shape, found: &Solved| {
            (found.base_couple - before.nodes[0].m).norm() < NEAR * self.kappa
        };
        let (mut done, mut step) = (0.0, 0.5);
        while step > MIN_CONTINUATION_STEP {
            let part = (done + step).min(1.0);
            let way = |from: &Vector3<f64>, to: &Vector3<f64>| from + (to - from) * part;
            let tip = match tip {
                Tip::Turned(target) => {
                    let turning = rotation_vector(&(target * turn.transpose()));
                    Tip::Turned(frame(&exponential(&(turning * part))) * turn)
                }
                Tip::Loaded { couple, arm } => {
                    let own = last.m - (turn * arm).cross(&there.force(1.0));
                    Tip::Loaded {
                        couple: way(&own, couple),
                        arm: *arm,
                    }
                }
            };
            let spring = Spring {
                at: way(&place, &spring.at),
                ..*spring
            };
            let there = self.with_force_and_unit(way(&start.n, &self.n));
            match there.refine_until_accurate(shape.clone(), &tip, &spring, tolerance) {
                // A jump of the shape means another equilibrium.
                Ok(found) if !same(&shape, &found) => step *= 0.5,
                Ok(found) if part == 1.0 => return Some(found),
                Ok(found) => {
                    (shape, done) = (found.shape, part);
                    step *= 1.5;
                }
                Err(_) => step *= 0.5,
            }
        }
        None
    }

    /// Solution on meshes that are refined until the error is below the tolerance.
    fn refine_until_accurate(
        &self,
        start: Shape,
        tip: &Tip,
        spring: &Spring,
        tolerance: f64,
    ) -> Result<Solved> {
        let mut shape = start;
        if spring.stiffness == 0.0 {
            shape.n = self.n;
        }
        let (mut iterations, mut coarse) = (0, 0);
        for _ in 0..MESHES {
            let before = shape.clone();
            let Some((correction, steps)) = self.newton(&mut shape, tip, spring, tolerance)? else {
                let all = vec![true; before.stages.len()];
                coarse += 1;
                if coarse > COARSE_MESHES || all.len() > INTERVALS {
                    break;
                }
                shape = before.halved(&all);
                continue;
            };
            coarse = 0;
            let there = self.with_force(&shape.n);
            iterations += steps;
            let mut split = Vec::with_capacity(shape.stages.len());
            let mut reached = EndSums {
                position: Vector3::zeros(),
                energy: 0.0,
                work: 0.0,
            };
            let mut error = 0.0_f64;
            for (k, stages) in shape.stages.iter().enumerate() {
                let (from, to) = (shape.places[k], shape.places[k + 1]);
                let passed = there.integrate_interval(from, to, stages)?;
                let jump = there.jump(to);
                reached.work += (there.force(from) - there.force(to)).dot(&reached.position)
                    + passed.work
                    + jump.dot(&passed.way);
                reached.position += passed.way;
                reached.energy += passed.energy;
                error = error.max(passed.error);
                split.push(!(passed.error <= tolerance && passed.turn <= TURNED));
            }
            if !split.contains(&true) {
                return Ok(self.solved_rod(shape, correction, reached, error, iterations));
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

    /// Newton's method on the mesh of `shape`; returns the last step taken, or None if the mesh is too coarse. The
    /// variations are collocated independently of the rod. If the rod turns by radians in an interval they differ
    /// from the derivatives of its own collocation, and steps that should vanish do not.
    fn newton(
        &self,
        shape: &mut Shape,
        tip: &Tip,
        spring: &Spring,
        tolerance: f64,
    ) -> Result<Option<(Correction, usize)>> {
        let lost = || {
            Error::no_convergence(
                "the equilibrium of a taut rod under a given force was not found: it is neutral, or far from where the search began",
            )
        };
        let (mut last, mut slow) = (f64::INFINITY, 0);
        for steps in 1..=MAX_NEWTON_STEPS {
            let correction = self.correction(shape, tip, spring)?.ok_or_else(lost)?;
            let size = correction.size;
            if !size.is_finite() {
                break;
            }
            let part = (TURN / size).min(1.0);
            let force = rest(&correction.force);
            for (k, answers) in correction.answers.iter().enumerate() {
                let change = rest(answers);
                correct(&mut shape.nodes[k], &change, part, self.kappa);
                if let Some(interval) = correction.intervals.get(k) {
                    interval.correct(&change, &force, part, self.kappa, &mut shape.stages[k]);
                }
            }
            shape.n += force * part;
            // Predicted size of the next step, by the rate of the last two; at first by that of Newton's method.
            let rate = if steps == 1 {
                size.max(LINEAR)
            } else {
                size / last
            };
            let done = size * rate < 0.1 * tolerance && size < LINEARISED * tolerance;
            let stays = size < ROUNDED && size > 0.3 * last;
            if part == 1.0 && (done || stays) {
                return Ok(Some((correction, steps)));
            }
            slow += usize::from(last < SMALL && size > COARSE * last && size >= ROUNDED);
            if slow > 1 {
                return Ok(None);
            }
            last = size;
        }
        Err(lost())
    }

    /// One Newton correction; None if the linearised rod is singular.
    fn correction(&self, shape: &Shape, tip: &Tip, spring: &Spring) -> Result<Option<Correction>> {
        let there = self.with_force(&shape.n);
        let mut intervals = Vec::with_capacity(shape.stages.len());
        let mut place = Vector3::zeros();
        for (k, stages) in shape.stages.iter().enumerate() {
            let (from, to) = (shape.places[k], shape.places[k + 1]);
            let ends = [&shape.nodes[k], &shape.nodes[k + 1]];
            let by = there.variations(from, to, stages)?;
            let found = by.and_then(|by| {
                let left = there.residual(&by, ends, stages);
                let whole = by.condense()?.with_residual(&by, &left);
                Some(match &self.symmetry.plane {
                    Some(normal) => whole.in_plane(normal, by.h),
                    None => whole,
                })
            });
            let Some(found) = found else {
                return Ok(None);
            };
            place += found.length;
            intervals.push(found);
        }
        let end = there.at_end(&shape.nodes[shape.nodes.len() - 1], tip);
        let unit = self.kappa * self.kappa;
        let hold = match spring.stiffness {
            f64::INFINITY => ForceEquation {
                give: 0.0,
                stiffness: unit,
                off: (spring.at - place) * unit,
                unit,
            },
            stiffness => ForceEquation {
                give: 1.0,
                stiffness,
                off: self.n - shape.n - (place - spring.at) * stiffness,
                unit,
            },
        };
        let Some(chained) = chain(&intervals, &end, &hold, self.turns_freely()) else {
            return Ok(None);
        };
        let ChainSolution { nodes, force, sign } = chained;
        let mut way = SMatrix::zeros();
        let moved = rest(&force);
        let mut size = moved.amax() / hold.unit;
        for (interval, start) in intervals.iter().zip(&nodes) {
            way += interval_change(&interval.way, start, &force);
            size = size
                .max(interval.change(&rest(start), &moved))
                .max(rest(start).amax());
        }
        Ok(Some(Correction {
            intervals,
            answers: nodes,
            force,
            way,
            sign,
            size,
        }))
    }

    /// This rod next to the converged one of `shape`, which has another law, load or end condition, to first order in
    /// the difference: one Newton correction. The stages are those of `shape`. The place of the end comes second.
    fn corrected_once(
        &self,
        shape: &Shape,
        tip: &Tip,
        spring: &Spring,
    ) -> Result<(Shape, Vector3<f64>)> {
        let correction = self.correction(shape, tip, spring)?;
        let correction = correction.ok_or_else(neutral_error)?;
        let mut found = shape.clone();
        found.n += rest(&correction.force);
        for (node, answers) in found.nodes.iter_mut().zip(&correction.answers) {
            correct(node, &rest(answers), 1.0, self.kappa);
        }
        let lengths = correction.intervals.iter().map(|interval| interval.length);
        Ok((found, lengths.sum::<Vector3<f64>>() + rest(&correction.way)))
    }

    /// True if one motion is known to be neutral; it leads out of any plane.
    fn turns_freely(&self) -> bool {
        self.symmetry.turns && self.symmetry.plane.is_none()
    }

    fn at_end(&self, last: &FrameAndCouple, tip: &Tip) -> AtEnd {
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
                let (lever, n) = (frame(&last.turn) * arm, self.force(1.0));
                let off = couple + lever.cross(&n) - last.m;
                let mut turned = -(n.cross_matrix() * lever.cross_matrix()) / self.kappa;
                if let Some(normal) = &self.symmetry.plane {
                    let about = normal * normal.transpose();
                    turned = about * turned * about;
                }
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

    fn solved_rod(
        &self,
        shape: Shape,
        correction: Correction,
        reached: EndSums,
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
            position: reached.position,
            energy: reached.energy,
            work: reached.work,
            by_force: derivatives(0),
            by_tip: derivatives(3),
            sign: correction.sign,
            plane: self.symmetry.plane,
            error,
            iterations,
            shape,
        }
    }
}

/// Integrals from the clamp to the end.
struct EndSums {
    position: Vector3<f64>,
    energy: f64,
    /// Work of the load along the rod.
    work: f64,
}

/// Frame and couple at a place, the position and the energy up to the place.
type PassedSection = (FrameAndCouple, Vector3<f64>, f64);

impl RodUnderForce<'_> {
    /// Sections at places in growing order.
    fn sections(
        &self,
        shape: &Shape,
        tip: &Tip,
        spring: &Spring,
        at: &[f64],
        tolerance: f64,
    ) -> Result<Vec<PassedSection>> {
        // Nodes are as accurate as the rod. Between them polynomials of the degree of the stages gain as many binary
        // digits with every halving.
        let mut fine = shape.clone();
        let mut halved = false;
        for _ in 0..HALVINGS {
            let split = fine.holding(at);
            if !split.contains(&true) {
                break;
            }
            fine = fine.halved(&split);
            halved = true;
        }
        let coarse = halved && self.newton(&mut fine, tip, spring, tolerance)?.is_none();
        if coarse {
            return Err(Error::no_convergence(
                "the shape of a taut rod is not resolved; loosen the tolerance",
            ));
        }
        let there = self.with_force(&fine.n);
        let mut found = Vec::with_capacity(at.len());
        let (mut k, mut way, mut energy) = (0, Vector3::zeros(), 0.0);
        for s in at {
            while k + 1 < fine.stages.len() && fine.places[k + 1] <= *s {
                let passed = there.integrate_interval(
                    fine.places[k],
                    fine.places[k + 1],
                    &fine.stages[k],
                )?;
                way += passed.way;
                energy += passed.energy;
                k += 1;
            }
            let (from, to) = (fine.places[k], s.clamp(fine.places[k], fine.places[k + 1]));
            let part = Scheme::get().nodes.map(|x| fine.at(from + x * (to - from)));
            let passed = there.integrate_interval(from, to, &part)?;
            let mut section = fine.at(to);
            section.turn /= section.turn.norm();
            found.push((section, way + passed.way, energy + passed.energy));
        }
        Ok(found)
    }
}
