//! Two-ended chart of a rod: a chart for branches of equilibria that keeps its digits under any pull.
//!
//! The unknowns are the base wrench b = (m(0), n) and the free components of the end's place. For a slack rod the
//! base wrench determines everything: the residuals are the end condition, and the given place less the end of the
//! rod. For a taut rod (theory 3.6) the base wrench supplies the force alone. The rod is then solved from both ends
//! under that force, which it bears together with a spring from its end to the given place. The tip is turned or
//! loaded as the end condition says. The residuals are
//! ```text
//! m(0) - m(0)(f, end),     place - r(1)(f, end),     f = n + k (r(1) - place).
//! ```
//! The spring bears nothing where both vanish. Both forms have the same solutions, whatever the spring, and their
//! signs are made to agree, so a branch may change from one form to the other anywhere. Wrenches grow with the square
//! of lam. Beyond [`SLACK`] the unknowns are therefore logarithmic, so that a branch takes about as many steps for
//! each power of ten.

use super::RodSection;
use super::chart::Chart;
use super::ivp::Wrench;
use super::planar::Plane;
use super::problem::{Problem, Trial};
use super::taut::{Solved, Spring, Tip};
use crate::error::{Error, Result};
use crate::math::se3::{frame, halves, join, rotation_vector};
use crate::solve::warm_start::WarmStart;
use nalgebra::{DMatrix, DVector, Matrix3, SMatrix, SVector, Vector3};
use std::sync::Arc;

/// lam^2 beyond which a rod is solved from both ends.
const TAUT: f64 = 100.0;
/// lam^2 beyond which a rod under a load along it is solved from both ends. Its force is greatest at the ends.
const LOADED: f64 = 49.0;
/// Couples and forces up to this size enter the unknowns unscaled; larger ones by their logarithm.
const SLACK: f64 = 10.0;
/// Tolerance of taut rods, over that of the problem: differences between meshes must not trouble Newton's method.
const FINER: f64 = 0.01;
/// Thresholds on [`GivenData::mismatch`]: a rod farther off than `OTHER` may be another equilibrium, and one nearer
/// than `CLOSE` is certainly the given one.
const OTHER: f64 = 0.05;
const CLOSE: f64 = 3e-3;
/// Number of unknowns of a rod in space with a movable end.
const WHOLE: usize = 9;

/// The two-ended chart: the base wrench and the components of the end's place that are not held; for a planar rod,
/// those within the plane.
#[derive(Debug, Clone)]
pub struct BothEnds {
    plane: Option<Plane>,
    /// Components of the end's place that are unknown.
    free: Vec<usize>,
    /// The taut rod last solved, shared between clones: a family and the observers of its points begin from the same
    /// rod.
    warm: Arc<WarmStart<SprungRod>>,
}

/// A taut rod and the spring beside its end.
#[derive(Debug)]
struct SprungRod {
    found: Solved,
    spring: Spring,
}

/// Base wrench (m, n) and place of the end given by the unknowns, in the clamp's frame.
#[derive(Debug, Clone, Copy)]
struct GivenData {
    m: Vector3<f64>,
    n: Vector3<f64>,
    place: Vector3<f64>,
}

impl GivenData {
    /// Distance of a rod from the given data: the larger of those of the base couple, over sqrt(F B), and of the end,
    /// over the width of a layer.
    fn mismatch(&self, SprungRod { found, .. }: &SprungRod) -> f64 {
        let kappa = self.n.norm().sqrt().max(1.0);
        let couple = (found.base_couple - self.m).norm() / kappa;
        couple.max((found.position - self.place).norm() * kappa)
    }
}

/// The rod at trial unknowns.
#[derive(Debug, Clone)]
pub struct BothEndsTrial {
    given: GivenData,
    /// d(m, n, place) by the unknowns.
    by: DMatrix<f64>,
    seen: TrialForm,
}

#[derive(Debug, Clone)]
enum TrialForm {
    FromBase(Box<Trial>),
    Taut(Arc<SprungRod>, Tip),
}

/// Residuals of a rod in space whose end is free to move: couple or turn, place, force.
type FreeEndResiduals = SVector<f64, WHOLE>;
type FreeEndSlopes = SMatrix<f64, WHOLE, WHOLE>;

impl Problem {
    /// True if the rod is so taut that its base wrench loses digits of the end: sqrt(F L^2/B) beyond ten, or beyond
    /// seven under a load along the rod. Base wrench and end are in the world. False for loads that turn with the
    /// end, which have no other chart.
    pub fn is_taut(&self, base: &Wrench, end: &RodSection) -> bool {
        let (_, n) = halves(&self.rod.inward(base));
        let clamp = &self.rod.clamp;
        let place = clamp.inverse_transform_point(&end.position.into()).coords / self.rod.length;
        self.may_be_taut() && self.pull_on(&n, &place) > self.taut_from()
    }

    fn taut_from(&self) -> f64 {
        if self.weight.is_some() { LOADED } else { TAUT }
    }
}

impl BothEnds {
    /// The chart of all problems with the same components of the end held as `problem`. With a plane, the unknowns
    /// stay in the plane.
    pub fn new(problem: &Problem, plane: Option<Plane>) -> Self {
        let held = problem.is_held();
        let mut free: Vec<usize> = (0..3).filter(|i| !held[*i]).collect();
        if let Some(plane) = &plane {
            free = match free.len() {
                3 => vec![0, 1],
                _ => {
                    free.retain(|i| problem.axes[*i].dot(&plane.normal()).abs() < 0.5);
                    free
                }
            };
        }
        Self {
            plane,
            free,
            warm: Arc::default(),
        }
    }

    /// Directions of the unknown couples, forces, and components of the end's place.
    fn directions(&self, problem: &Problem) -> [Vec<Vector3<f64>>; 3] {
        let Some(plane) = &self.plane else {
            let all: Vec<_> = (0..3).map(|i| Vector3::ith(i, 1.0)).collect();
            let free = self.free.iter().map(|i| problem.axes[*i]).collect();
            return [all.clone(), all, free];
        };
        let inside = vec![plane.lift([1.0, 0.0].into()), plane.lift([0.0, 1.0].into())];
        let whole = problem.is_held() == [false; 3];
        let free = self
            .free
            .iter()
            .map(|i| if whole { inside[*i] } else { problem.axes[*i] });
        [vec![plane.normal()], inside.clone(), free.collect()]
    }

    fn given(&self, problem: &Problem, x: &DVector<f64>) -> Result<(GivenData, DMatrix<f64>)> {
        if x.len() != self.size() {
            return Err(Error::domain(format!(
                "the rod has {} unknowns in this chart, not {}",
                self.size(),
                x.len()
            )));
        }
        let held = problem.is_held();
        let mut whole = FreeEndResiduals::zeros();
        for i in (0..3).filter(|i| held[*i]) {
            let mut place = whole.fixed_rows_mut::<3>(6);
            place += problem.axes[i] * problem.targets[i];
        }
        let mut by = DMatrix::zeros(WHOLE, x.len());
        let mut k = 0;
        for (row, directions) in [0, 3, 6].into_iter().zip(self.directions(problem)) {
            for direction in &directions {
                let (value, slope) = match row {
                    6 => (x[k], 1.0),
                    _ => (SLACK * (x[k] / SLACK).sinh(), (x[k] / SLACK).cosh()),
                };
                let mut part = whole.fixed_rows_mut::<3>(row);
                part += direction * value;
                by.view_mut((row, k), (3, 1))
                    .copy_from(&(direction * slope));
                k += 1;
            }
        }
        let part = |row: usize| whole.fixed_rows::<3>(row).into_owned();
        let given = GivenData {
            m: part(0),
            n: part(3),
            place: part(6),
        };
        Ok((given, by))
    }

    /// The unknowns of a given base wrench and place.
    fn unknowns_of(&self, problem: &Problem, given: &GivenData) -> DVector<f64> {
        let vectors = [given.m, given.n, given.place];
        let mut x = Vec::with_capacity(self.size());
        for (k, directions) in self.directions(problem).iter().enumerate() {
            for direction in directions {
                let value = direction.dot(&vectors[k]);
                x.push(match k {
                    2 => value,
                    _ => SLACK * (value / SLACK).asinh(),
                });
            }
        }
        DVector::from_vec(x)
    }

    /// The rod under the given force, beside a spring that keeps the problem regular.
    fn solve_beside_spring(&self, problem: &Problem, given: &GivenData) -> Result<Arc<SprungRod>> {
        let last = self.warm.last();
        let tip = problem.tip();
        let symmetry = problem.symmetry(&join(&given.m, &given.n), self.plane.as_ref());
        let under = |stiffness: f64, start: Option<&SprungRod>| {
            let spring = Spring {
                stiffness,
                at: given.place,
            };
            let b = join(&given.m, &given.n);
            let start = start.map(|beside| &beside.found.shape);
            let tolerance = FINER * problem.tolerance;
            let found = problem.solve_beside(&b, symmetry, &tip, &spring, start, tolerance)?;
            Ok(SprungRod { found, spring })
        };
        let mean = given.n - problem.total_load() * 0.5;
        let string = mean.norm() / given.place.norm().max(1e-3);
        let springs = Spring::choice(string);
        let kept = last
            .as_ref()
            .map_or(springs[0], |last| last.spring.stiffness);
        let mut nearest = under(kept, last.as_deref());
        // Another spring, or another start, may lead to a nearer rod: a rod that is off may be another equilibrium.
        for stiffness in [kept].into_iter().chain(springs) {
            if nearest
                .as_ref()
                .is_ok_and(|found| given.mismatch(found) < OTHER)
            {
                break;
            }
            let found = under(stiffness, None);
            let off = |found: &Result<SprungRod>| {
                found
                    .as_ref()
                    .map_or(f64::INFINITY, |found| given.mismatch(found))
            };
            if off(&found) < off(&nearest) || nearest.is_err() {
                nearest = found;
            }
        }
        let mut found = nearest?;
        let own = found.spring.stiffness;
        let better = Spring::best_stiffness(&found.found.by_force.position, own, string);
        if better != own
            && let Ok(again) = under(better, Some(&found))
            && given.mismatch(&again) < OTHER
        {
            found = again;
        }
        let found = Arc::new(found);
        if given.mismatch(&found) < CLOSE {
            self.warm.keep(&found);
        }
        Ok(found)
    }

    fn evaluate(&self, problem: &Problem, x: &DVector<f64>) -> Result<BothEndsTrial> {
        let (given, by) = self.given(problem, x)?;
        let taut = problem.pull_on(&given.n, &given.place) > problem.taut_from();
        let seen = if taut && problem.may_be_taut() {
            TrialForm::Taut(self.solve_beside_spring(problem, &given)?, problem.tip())
        } else {
            let b = join(&given.m, &given.n);
            TrialForm::FromBase(Box::new(problem.trial(&b)?))
        };
        Ok(BothEndsTrial { given, by, seen })
    }

    /// Projection of the nine residuals on the directions of the unknowns: plane and held components drop out.
    fn rows(&self, problem: &Problem) -> DMatrix<f64> {
        let [couples, forces, free] = self.directions(problem);
        let mut rows = DMatrix::zeros(self.size(), WHOLE);
        // A follower load has its components along the directors of the end, which turns within the plane.
        let free = if problem.end.follower {
            forces.clone()
        } else {
            free
        };
        let mut k = 0;
        for (column, directions) in [(0, couples), (3, forces), (6, free)] {
            for direction in directions {
                rows.view_mut((k, column), (1, 3))
                    .copy_from(&direction.transpose());
                k += 1;
            }
        }
        rows
    }
}

impl BothEndsTrial {
    /// Change of the tip's turn, or couple, from the trial to `problem`.
    fn tip_change(&self, problem: &Problem, beside: &SprungRod, tip: &Tip) -> Vector3<f64> {
        match (tip, problem.tip()) {
            (Tip::Turned(here), Tip::Turned(there)) => rotation_vector(&(there * here.transpose())),
            (Tip::Loaded { couple, arm }, Tip::Loaded { couple: c, arm: a }) => {
                let directors = frame(&beside.found.shape.at(1.0).turn);
                let n = self.given.n - problem.total_load();
                c - couple + (directors * (a - arm)).cross(&n)
            }
            // The kind of tip does not change along a branch.
            _ => Vector3::repeat(f64::NAN),
        }
    }

    /// All nine residuals. The difference between the end conditions of `problem` and of the trial enters to first
    /// order.
    fn residual(&self, problem: &Problem) -> FreeEndResiduals {
        let GivenData { m, n, mut place } = self.given;
        let held = problem.is_held();
        // Force on the end.
        let mut force = n - problem.total_load();
        let mut moved = Vector3::zeros();
        for (i, (axis, target)) in problem.axes.iter().zip(problem.targets).enumerate() {
            if held[i] {
                moved += axis * (target - axis.dot(&place));
            } else if !problem.end.follower {
                force -= axis * target;
            }
        }
        place += moved;
        let (first, r) = match &self.seen {
            TrialForm::FromBase(trial) => {
                let all = problem.residual(trial);
                if problem.end.follower {
                    force = all.fixed_rows::<3>(3).into_owned();
                }
                (all.fixed_rows::<3>(0).into_owned(), trial.r)
            }
            TrialForm::Taut(beside, tip) => {
                let other = self.tip_change(problem, beside, tip);
                let pulled = moved * beside.spring.stiffness;
                let found = &beside.found;
                let (by_force, by_tip) = (&found.by_force, &found.by_tip);
                let at = |by: [&Matrix3<f64>; 2]| by[0] * pulled + by[1] * other;
                let m0 = found.base_couple + at([&by_force.base_couple, &by_tip.base_couple]);
                let r = found.position + at([&by_force.position, &by_tip.position]);
                ((m - m0) * beside.weight(), r)
            }
        };
        let off = place - r;
        FreeEndResiduals::from_iterator(first.iter().chain(&off).chain(&force).copied())
    }

    /// Derivatives of the residuals by m, n and place.
    fn slopes(&self, problem: &Problem) -> FreeEndSlopes {
        let mut slopes = FreeEndSlopes::zeros();
        let mut put = |row: usize, column: usize, block: &Matrix3<f64>| {
            slopes.fixed_view_mut::<3, 3>(row, column).copy_from(block);
        };
        let unit = Matrix3::identity();
        put(3, 6, &unit);
        put(6, 3, &unit);
        match &self.seen {
            TrialForm::FromBase(trial) => {
                let (_, equations) = problem.equations(trial);
                for column in [0, 3] {
                    put(
                        0,
                        column,
                        &equations.fixed_view::<3, 3>(0, column).into_owned(),
                    );
                    let r = Matrix3::from_fn(|i, j| -trial.tangent[3 + i][column + j]);
                    put(3, column, &r);
                    if problem.end.follower {
                        put(
                            6,
                            column,
                            &equations.fixed_view::<3, 3>(3, column).into_owned(),
                        );
                    }
                }
            }
            TrialForm::Taut(beside, _) => {
                let (by, k) = (&beside.found.by_force, beside.spring.stiffness);
                let weight = beside.weight();
                put(0, 0, &(unit * weight));
                put(0, 3, &(by.base_couple * -weight));
                put(0, 6, &(by.base_couple * (-weight * k)));
                put(3, 3, &-by.position);
                put(3, 6, &(unit - by.position * k));
            }
        }
        slopes
    }
}

impl SprungRod {
    /// Factor of the residual of the base couple, with the sign that the equations of the base wrench have.
    fn weight(&self) -> f64 {
        self.found.sign / self.found.shape.force().norm().sqrt().max(1.0)
    }
}

impl Chart for BothEnds {
    type Trial = BothEndsTrial;

    fn size(&self) -> usize {
        self.free.len() + self.plane.map_or(6, |_| 3)
    }

    fn is_planar(&self) -> bool {
        self.plane.is_some()
    }

    fn trial(&self, problem: &Problem, x: &DVector<f64>) -> Result<BothEndsTrial> {
        self.evaluate(problem, x)
    }

    fn bare_trial(&self, problem: &Problem, x: &DVector<f64>) -> Result<BothEndsTrial> {
        self.evaluate(problem, x)
    }

    /// A taut rod stays beside its spring: beside another spring the rod would have other equations.
    fn trial_beside(
        &self,
        problem: &Problem,
        x: &DVector<f64>,
        known: &BothEndsTrial,
    ) -> Result<BothEndsTrial> {
        let TrialForm::Taut(known, _) = &known.seen else {
            return self.evaluate(problem, x);
        };
        let (given, by) = self.given(problem, x)?;
        let b = join(&given.m, &given.n);
        let spring = Spring {
            at: given.place,
            ..known.spring
        };
        let symmetry = problem.symmetry(&b, self.plane.as_ref());
        let found = problem.solve_to_first_order(&b, symmetry, &spring, &known.found)?;
        let beside = Arc::new(SprungRod { found, spring });
        let seen = TrialForm::Taut(beside, problem.tip());
        Ok(BothEndsTrial { given, by, seen })
    }

    fn residual(&self, problem: &Problem, trial: &BothEndsTrial) -> DVector<f64> {
        self.rows(problem) * trial.residual(problem)
    }

    fn equations(&self, problem: &Problem, trial: &BothEndsTrial) -> (DVector<f64>, DMatrix<f64>) {
        let rows = self.rows(problem);
        let slopes = &rows * trial.slopes(problem) * &trial.by;
        (rows * trial.residual(problem), slopes)
    }

    fn wrench(&self, problem: &Problem, x: &DVector<f64>) -> Result<Wrench> {
        let (given, _) = self.given(problem, x)?;
        Ok(join(&given.m, &given.n))
    }

    fn unknowns(&self, problem: &Problem, b: &Wrench) -> Result<DVector<f64>> {
        let (m, n) = halves(b);
        let place = match problem.taut_at(b) {
            Some(found) => found.position,
            None => problem.bare_trial(b)?.r,
        };
        Ok(self.unknowns_of(problem, &GivenData { m, n, place }))
    }

    fn reach(&self, size: f64) -> f64 {
        SLACK * (size / SLACK).sinh()
    }

    /// Factors of the equations. An equation of the place along a held direction has the rate of the holding force;
    /// an equation of the force on a free component has the displacement of that component. Others are unknown.
    fn working(&self, problem: &Problem, [force, place]: &[Vector3<f64>; 2]) -> Vec<Option<f64>> {
        let [couples, forces, free] = self.directions(problem);
        let held = |direction: &Vector3<f64>| {
            let along = free.iter().map(|free| free.dot(direction).abs());
            along.fold(0.0, f64::max) < 1e-9
        };
        let first = couples.iter().map(|_| None);
        let second = forces.iter().map(|k| held(k).then(|| k.dot(force)));
        let third = free.iter().map(|k| Some(k.dot(place)));
        let third = third.map(|moved| moved.filter(|_| !problem.end.follower));
        first.chain(second).chain(third).collect()
    }

    fn index(&self, problem: &Problem, x: &DVector<f64>) -> Result<usize> {
        match &self.evaluate(problem, x)?.seen {
            TrialForm::Taut(beside, _) => problem.taut_index(&beside.found, &beside.spring),
            TrialForm::FromBase(_) => problem.index(&self.wrench(problem, x)?),
        }
    }

    fn sections(&self, problem: &Problem, x: &DVector<f64>, at: &[f64]) -> Result<Vec<RodSection>> {
        match &self.evaluate(problem, x)?.seen {
            TrialForm::Taut(beside, _) => problem.taut_sections(&beside.found, &beside.spring, at),
            TrialForm::FromBase(_) => {
                let b = self.wrench(problem, x)?;
                problem.sections(&problem.rod.outward_wrench(&b), at)
            }
        }
    }

    fn end(&self, problem: &Problem, x: &DVector<f64>) -> Result<RodSection> {
        self.sections(problem, x, &[1.0])
            .map(|mut all| all.remove(0))
    }
}
