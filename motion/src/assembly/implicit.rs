//! Implicit steps of an assembly by Radau IIA with seven stages, for stiff rods whose fast modes are not of interest.
//!
//! ```text
//! place' = V,   M V' = wrenches of the rods + loads,   gap of every rod = 0
//! ```
//! The variables are the poses and velocities of the bodies; the charts are unknowns of every stage without a
//! past. So the error of a step is measured in poses and velocities, and that of a force by its effect on
//! these. The unknowns of Newton's iteration are the accelerations at the stages. Its matrix is known at each
//! stage and is used as it is, since it costs nothing beside the rods.

use super::{AssemblyRun, StateVector};
use nalgebra::{DMatrix, DVector};
use snaprod_systems::assembly::{Assembly, LinearisedStage};
use snaprod_systems::rod::Wrench;
use snaprod_systems::solve::cost::Cost;
use snaprod_systems::solve::dop853::State;
use snaprod_systems::solve::integrator::Method;
use snaprod_systems::solve::radau7::{GAMMA, NODES, RadauStep, S, tableau, through_stages};
use snaprod_systems::solve::stepper::AcceptedStep;

/// Most iterations of Newton's method, and the size of an increment that ends them as diverging.
const ITERATIONS: usize = 10;
const WILD: f64 = 1e2;
/// Part of a step's error left to the iteration, and the size of increments that are rounding.
const NEWTON: f64 = 0.1;
const ROUNDING: f64 = 1e-13;
/// Most attempts at one step.
const TRIES: usize = 12;
/// Bounds of a change of step length, and the safety factor on the error.
const SHRINK: f64 = 0.2;
const GROW: f64 = 3.0;
const SAFETY: f64 = 0.8;
/// Largest ratio of step lengths for which stages are extrapolated from the last step.
const BEYOND: f64 = 2.0;
/// Votes for implicit steps. Every explicit step has one vote, since a fast mode may ring so faintly that it
/// is resolved and still bounds the steps. A step longer than STIFF over the fastest rate has OTHERS votes.
/// Implicit steps are tried after PATIENCE votes; failures double this number up to PATIENCE_LIMIT.
const STIFF: f64 = 3.0;
const OTHERS: u32 = 6;
const PATIENCE: u32 = 100;
const PATIENCE_LIMIT: u32 = 3000;
/// Number of implicit steps in a row after which the change has paid.
const SETTLED: u32 = 20;
/// Cost of an explicit step in evaluations of implicit ones, which are finer, have tangents and take twice as long.
const EXPLICIT: f64 = 6.0;
/// An implicit step is tried with TRIAL times the length of explicit ones. Implicit steps begin if the
/// explicit work would be GAIN times theirs, and end when it would be less.
const TRIAL: f64 = 8.0;
const GAIN: f64 = 1.5;
/// Error of the integration along a rod, as a part of that for explicit steps: accelerations at the stages
/// follow from differences of poses, twice over a step.
const FINER: f64 = 1e-2;
/// Ratio of the error of a step to the estimate, which is of a lower order.
const SLACK: f64 = 0.03;

/// Accelerations and charts at the stages.
type AssemblyStages = [(DVector<f64>, Vec<Wrench>); S];

/// State of the implicit steps of a run.
#[derive(Debug, Clone)]
pub(super) struct Implicit {
    /// Implicit steps were asked for: they are taken wherever possible, without a test for stiffness.
    asked: bool,
    /// Implicit steps are allowed.
    allowed: bool,
    /// The run takes implicit steps now.
    on: bool,
    h: f64,
    last: Option<(f64, AssemblyStages)>,
    /// Length of the last explicit steps.
    explicit: f64,
    votes: u32,
    patience: u32,
    /// Number of implicit steps in a row.
    stay: u32,
}

impl Implicit {
    pub(super) fn new(method: Method, h: f64) -> Self {
        let asked = method == Method::Implicit;
        Self {
            asked,
            allowed: asked || method == Method::Auto,
            on: asked,
            h,
            last: None,
            explicit: 0.0,
            votes: 0,
            patience: PATIENCE,
            stay: 0,
        }
    }

    /// Drops the extrapolation of stages after a change of charts.
    pub(super) fn forget(&mut self) {
        self.last = None;
    }

    /// Switches to explicit steps.
    pub(super) fn leave(&mut self) {
        self.on = false;
        self.votes = 0;
        self.last = None;
        self.patience = (2 * self.patience).min(PATIENCE_LIMIT);
        self.stay = 0;
    }
}

/// A step whose stages are solved.
struct SolvedStep {
    stages: Vec<DVector<f64>>,
    unknowns: AssemblyStages,
    /// Linearisation at the last stage.
    last: LinearisedStage,
    iterations: usize,
    dets: Vec<Vec<f64>>,
}

/// Length of a step, and the latest time at which loads and section laws are seen.
#[derive(Clone, Copy)]
struct Span {
    h: f64,
    until: f64,
}

/// Solves the stages of a step from a guess; None if the iteration fails.
fn solve(
    assembly: &Assembly,
    from: &DVector<f64>,
    span: Span,
    mut unknowns: AssemblyStages,
    goal: f64,
    along: f64,
    cost: &mut Cost,
) -> Option<SolvedStep> {
    let (table, h) = (tableau(), span.h);
    let slots = assembly.slots();
    let velocities = &slots[1];
    let count = velocities.len();
    let time = assembly.time_slot();
    let mut stages = vec![from.clone(); S];
    let mut rates = stages.clone();
    let mut last = f64::INFINITY;
    for iteration in 0..=ITERATIONS {
        place(
            assembly,
            from,
            span,
            &unknowns,
            &slots,
            &mut stages,
            &mut rates,
        );
        let here: Option<Vec<LinearisedStage>> = stages
            .iter()
            .map(|stage| LinearisedStage::at(assembly, stage, along))
            .collect();
        cost.evaluations += S as u64;
        let here = here?;
        cost.iterations += 1;
        let mut matrix = DMatrix::identity(S * count, S * count);
        let mut right = DVector::zeros(S * count);
        for (i, at) in here.iter().enumerate() {
            for (k, slot) in velocities.iter().enumerate() {
                right[i * count + k] = at.rates[*slot] - unknowns[i].0[k];
            }
            for j in 0..S {
                let mut block = matrix.view_mut((i * count, j * count), (count, count));
                block -= &at.by_place * (h * h * table.twice[i][j]);
                block -= &at.by_velocity * (h * table.once[i][j]);
            }
        }
        let lu = matrix.lu();
        lu.solve_mut(&mut right).then_some(())?;
        let change = |rows: &[[f64; S]; S], i: usize| {
            let mut sum = DVector::zeros(count);
            for (j, weight) in rows[i].iter().enumerate() {
                sum.axpy(*weight, &right.rows(j * count, count), 1.0);
            }
            sum
        };
        let (mut size, mut gap) = (0.0_f64, 0.0_f64);
        for (i, at) in here.iter().enumerate() {
            let moved = change(&table.twice, i) * (h * h);
            let faster = change(&table.once, i) * h;
            size = size
                .max(moved.amax())
                .max(scaled(&faster, from, velocities));
            gap = gap.max(at.gap);
            let charts = &at.charts_by_place * moved;
            for (k, q) in unknowns[i].1.iter_mut().enumerate() {
                *q = at.charts[k] + charts.fixed_rows::<6>(6 * k);
            }
            unknowns[i].0 += right.rows(i * count, count);
        }
        if !(size < WILD) {
            return None;
        }
        // A Newton step removes the gap to first order; the rest is of its square.
        let size = size.max(gap * gap.min(1.0));
        let ratio = (size / last).min(1.0);
        if size * ratio.max(0.01) <= goal || size <= ROUNDING.max(goal) {
            place(
                assembly,
                from,
                span,
                &unknowns,
                &slots,
                &mut stages,
                &mut rates,
            );
            for (i, stage) in stages.iter_mut().enumerate() {
                for slot in [time + 1, time + 2] {
                    let sum: f64 = (0..S).map(|j| table.once[i][j] * here[j].rates[slot]).sum();
                    stage[slot] = from[slot] + h * sum;
                }
            }
            let dets = here.iter().map(|at| at.dets.clone()).collect();
            return Some(SolvedStep {
                stages,
                unknowns,
                last: here.into_iter().last()?,
                iterations: iteration + 1,
                dets,
            });
        }
        if iteration > 2 && ratio > 0.7 {
            return None;
        }
        last = size;
    }
    None
}

/// True if det J of a rod, `before` the step and at its stages, changes its sign or comes near zero in
/// between. The latter is the buckling of a column that bends alike about all axes: straight it stays an
/// equilibrium, and det J has a double root.
fn passes_fold(before: &[f64], stages: &[Vec<f64>]) -> bool {
    const BETWEEN: usize = 32;
    const NEAR: f64 = 1e-2;
    before.iter().enumerate().any(|(rod, first)| {
        let size = first.abs().max(stages[S - 1][rod].abs());
        let near = |det: f64| !(det * first.signum() > NEAR * size);
        let crossed = stages.iter().any(|dets| !(dets[rod] * first > 0.0));
        crossed
            || (1..BETWEEN).any(|k| {
                let weights = through_stages(k as f64 / BETWEEN as f64);
                let parts = weights.iter().zip(stages);
                near(parts.map(|(weight, dets)| weight * dets[rod]).sum())
            })
    })
}

/// Largest change of the velocities, relative to 1 + their sizes.
fn scaled(change: &DVector<f64>, state: &DVector<f64>, slots: &[usize]) -> f64 {
    let parts = change.iter().zip(slots);
    let parts = parts.map(|(x, slot)| x.abs() / (1.0 + state[*slot].abs()));
    parts.fold(0.0, f64::max)
}

/// Velocities, poses, charts and time at the stages, from the accelerations. Poses follow from velocities by
/// collocation too: rotations by an iteration that needs no rods.
fn place(
    assembly: &Assembly,
    from: &DVector<f64>,
    Span { h, until }: Span,
    unknowns: &AssemblyStages,
    slots: &[Vec<usize>; 2],
    stages: &mut [DVector<f64>],
    rates: &mut [DVector<f64>],
) {
    const SWEEPS: usize = 40;
    let [places, velocities] = slots;
    let once = &tableau().once;
    let time = assembly.time_slot();
    for (i, stage) in stages.iter_mut().enumerate() {
        for (k, slot) in velocities.iter().enumerate() {
            let sum: f64 = (0..S).map(|j| once[i][j] * unknowns[j].0[k]).sum();
            stage[*slot] = from[*slot] + h * sum;
        }
        for (k, q) in unknowns[i].1.iter().enumerate() {
            stage.as_mut_slice()[assembly.chart_slots(k)].copy_from_slice(q.as_slice());
        }
        stage[time] = (from[time] + h * NODES[i]).min(until);
    }
    for _ in 0..SWEEPS {
        for (stage, rates) in stages.iter().zip(rates.iter_mut()) {
            assembly.write_place_rates(stage, rates);
        }
        let mut moved = 0.0_f64;
        for (i, stage) in stages.iter_mut().enumerate() {
            for slot in places {
                let sum: f64 = (0..S).map(|j| once[i][j] * rates[j][*slot]).sum();
                let to = from[*slot] + h * sum;
                moved = moved.max((to - stage[*slot]).abs() / (1.0 + to.abs()));
                stage[*slot] = to;
            }
        }
        if moved < f64::EPSILON {
            break;
        }
    }
}

/// Error of a step in poses and velocities: h GAMMA times the defect of the stage polynomials from the rates
/// at the start. `quiet`: number of applications of the filter of Hairer and Wanner, which takes fast modes
/// as slaved to the rest.
fn error(
    from: &DVector<f64>,
    slope: &DVector<f64>,
    h: f64,
    solved: &SolvedStep,
    velocities: &[usize],
    quiet: usize,
) -> f64 {
    let start = &tableau().start;
    let size = h * GAMMA;
    let count = velocities.len();
    let miss = |begun: &dyn Fn(usize) -> f64, stage: &dyn Fn(usize, usize) -> f64| {
        DVector::from_fn(count, |k, _| {
            let sum: f64 = (0..S).map(|i| start[i] * stage(i, k)).sum();
            size * (begun(k) - sum)
        })
    };
    let mut moved = miss(&|k| from[velocities[k]], &|i, k| {
        solved.stages[i][velocities[k]]
    });
    let mut faster = miss(&|k| slope[velocities[k]], &|i, k| solved.unknowns[i].0[k]);
    if quiet > 0 {
        let at = &solved.last;
        let matrix =
            DMatrix::identity(count, count) - &at.by_velocity * size - &at.by_place * (size * size);
        let lu = matrix.lu();
        for _ in 0..quiet {
            faster += &at.by_place * &moved * size;
            if !lu.solve_mut(&mut faster) {
                return f64::INFINITY;
            }
            moved += &faster * size;
        }
    }
    let to = &solved.stages[S - 1];
    let sum: f64 = (0..count)
        .map(|k| {
            let slot = velocities[k];
            let speed = 1.0 + from[slot].abs().max(to[slot].abs());
            moved[k].powi(2) + (faster[k] / speed).powi(2)
        })
        .sum();
    let error = (sum / (2 * count) as f64).sqrt();
    if error.is_nan() { f64::INFINITY } else { error }
}

impl AssemblyRun<'_> {
    /// True if the next step is to be implicit, also as a trial. Among obstacles steps are explicit: an implicit step
    /// that ends at an event is a part of its polynomial, in which charts and poses drift apart.
    pub(super) fn is_implicit(&self) -> bool {
        let state = &self.implicit;
        let wanted = state.on || state.votes >= state.patience;
        state.allowed && wanted && self.among().is_none()
    }

    /// Counts the votes of an explicit step for implicit ones, with time at the `rate`: more if stability
    /// bounds the step.
    pub(super) fn judge(&mut self, step: &AcceptedStep<StateVector>, rate: f64) {
        let AcceptedStep::Explicit(step) = step else {
            return;
        };
        let state = &mut self.implicit;
        let stiff = step.stiffness(StateVector::mean_square);
        let speaks = state.asked || stiff.is_some_and(|size| size > STIFF);
        state.votes += if speaks { OTHERS } else { 1 };
        state.explicit = rate * self.solver.next_step();
    }

    /// Guess of accelerations and charts at the stages of a step of length `h`: extrapolated from the last
    /// step or, if `blind`, the values at the start.
    fn guess(&self, h: f64, blind: bool) -> AssemblyStages {
        let (state, slope) = (&self.solver.state().0, &self.solver.slope().0);
        let rods = self.assembly.links().len();
        if let Some((before, stages)) = &self.implicit.last
            && !blind
            && h <= BEYOND * before
        {
            return NODES.map(|c| {
                let weights = through_stages(1.0 + c * h / before);
                let mut sum = (stages[0].0.clone() * 0.0, vec![Wrench::zeros(); rods]);
                for (weight, (acceleration, charts)) in weights.iter().zip(stages) {
                    sum.0.axpy(*weight, acceleration, 1.0);
                    for (sum, q) in sum.1.iter_mut().zip(charts) {
                        *sum += q * *weight;
                    }
                }
                sum
            });
        }
        let [_, velocities] = self.assembly.slots();
        let acceleration =
            DVector::from_iterator(velocities.len(), velocities.iter().map(|slot| slope[*slot]));
        let chart = |k: usize, c: f64| {
            let slots = self.assembly.chart_slots(k);
            let [q, rate] =
                [state, slope].map(|x| Wrench::from_column_slice(&x.as_slice()[slots.clone()]));
            q + rate * (c * h)
        };
        NODES.map(|c| {
            (
                acceleration.clone(),
                (0..rods).map(|k| chart(k, c)).collect(),
            )
        })
    }

    /// One implicit step of at most `h_max`. None, with explicit steps from then on, if implicit steps do not
    /// pay or converge, or a rod would pass its fold.
    pub(super) fn implicit_step(&mut self, h_max: f64) -> Option<AcceptedStep<StateVector>> {
        let trial = !self.implicit.on;
        if trial {
            let longest = if self.implicit.asked {
                self.implicit.h
            } else {
                0.0
            };
            self.implicit.h = longest.max(TRIAL * self.implicit.explicit);
            self.implicit.last = None;
        }
        let (clock, since) = (self.slowed.clone(), self.since.clone());
        let h = self.solver.next_step();
        let state = self.solver.state().clone();
        if clock.is_some() {
            self.resume(state.clone(), None, self.implicit.explicit)?;
        }
        let taken = self.try_implicit(h_max, trial);
        if taken.is_none() {
            self.implicit.leave();
            if clock.is_some() {
                self.resume(state, clock, h)?;
                self.since = since;
            }
        }
        taken
    }

    fn try_implicit(&mut self, h_max: f64, trial: bool) -> Option<AcceptedStep<StateVector>> {
        let (from, slope) = (self.solver.state().clone(), self.solver.slope().clone());
        let [_, velocities] = self.assembly.slots();
        let local = self.local();
        let along = (FINER * self.along()).max(crate::options::FINEST);
        let goal = (NEWTON * local).max(ROUNDING);
        let before: Vec<f64> = self.watch.iter().map(|rod| rod.det).collect();
        let asked = self.implicit.asked;
        let mut blind = self.implicit.last.is_none();
        let mut rejected = false;
        for _ in 0..TRIES {
            let h = self.implicit.h.min(h_max);
            let begun = self.extra.evaluations;
            let assembly = self.assembly.clone();
            let guess = self.guess(h, blind);
            let until = self.until;
            let span = Span { h, until };
            let solved = solve(
                &assembly,
                &from.0,
                span,
                guess,
                goal,
                along,
                &mut self.extra,
            );
            let steps = |h: f64, evaluations: u64| {
                evaluations as f64 / EXPLICIT * self.implicit.explicit / h
            };
            let Some(solved) = solved else {
                self.extra.rejected += 1;
                rejected = true;
                if blind {
                    self.implicit.h = 0.4 * h;
                    if h < h_max.min(self.solver.next_step()) || trial && !asked {
                        return None;
                    }
                }
                blind = true;
                continue;
            };
            if passes_fold(&before, &solved.dets) {
                return None;
            }
            let quiet = match (asked, self.implicit.last.is_none()) {
                (false, _) => 0,
                (true, false) => 1,
                (true, true) => 2,
            };
            let size = error(&from.0, &slope.0, h, &solved, &velocities, quiet) * SLACK / local;
            let factor = SAFETY * size.max(1e-12).powf(-1.0 / 8.0);
            if !(size <= 1.0) {
                self.extra.rejected += 1;
                rejected = true;
                self.implicit.h = h * if factor > SHRINK {
                    factor.min(0.9)
                } else {
                    SHRINK
                };
                let poor = steps(self.implicit.h, self.extra.evaluations - begun) > 1.0;
                if poor && !asked || self.implicit.h < self.solver.next_step().min(h_max) {
                    return None;
                }
                continue;
            }
            let spent = steps(h, self.extra.evaluations - begun);
            if !asked && h < h_max && spent > if trial { 1.0 / GAIN } else { 1.0 } {
                return None;
            }
            let stages: Vec<StateVector> = solved.stages.into_iter().map(StateVector).collect();
            let stages: [StateVector; S] = stages.try_into().ok()?;
            let mut end = slope.clone();
            let along = self.along();
            let watch = &mut self.watch;
            assembly.write_slope(&stages[S - 1].0, None, along, &mut end.0, |k, sight| {
                watch[k] = sight
            })?;
            self.extra.evaluations += 1;
            self.extra.steps += 1;
            self.extra.implicit_steps += 1;
            self.extra.switches += u64::from(trial);
            let most = if rejected { 1.0 } else { GROW };
            let hard = if solved.iterations > 5 { 1.0 } else { most };
            if h >= self.implicit.h {
                self.implicit.h = h * factor.clamp(SHRINK, hard);
            }
            self.implicit.on = true;
            self.implicit.votes = 0;
            self.implicit.stay += 1;
            if self.implicit.stay == SETTLED {
                self.implicit.patience = PATIENCE;
            }
            self.implicit.last = Some((h, solved.unknowns));
            self.dense = None;
            self.taken_by = (assembly, None);
            self.solver.rewind(stages[S - 1].clone(), end.clone());
            return Some(AcceptedStep::Implicit(RadauStep::new(
                from,
                h,
                stages,
                [slope, end],
            )));
        }
        None
    }
}
