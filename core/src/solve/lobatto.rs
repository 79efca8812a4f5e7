//! Collocation at the nine nodes of Lobatto's rule, of order 16, for motions whose slope is evaluated at eight nodes
//! at once.
//!
//! On a step of length h the slopes k_i at the nodes c_i, the first of them known, satisfy
//!
//! ```text
//! y_i = y + h sum_j a_ij k_j,   k_i = f(y_i),   a_ij = int_0^{c_i} l_j,
//! ```
//!
//! and the last of them is the end. The slopes are iterated to convergence by sweeps that begin with the polynomial
//! of the step before. An explicit method evaluates its slopes one after the other. Here eight are evaluated at once;
//! in wide registers a sweep costs little more than a slope or two. In a sweep velocities come before positions:
//! positions are advanced by the velocities of the new forces, which halves the sweeps of a smooth motion.
//!
//! The last two of the nine Legendre coefficients of the slopes control the step. A smooth function whose
//! coefficients fall like x^k has an error of about x^16 at the end of a step, where they are x^8.

mod rule;

use super::cost::Cost;
use super::dop853::{State, integrate_polynomial};
use crate::math::Row;
use crate::math::registers::wide;
use pulp::{Simd, WithSimd};
pub use rule::NodeRows;
use rule::{Fitting, Modes, integrals, squared_change, states_at_nodes};
use std::marker::PhantomData;

/// A motion whose slope is evaluated at eight nodes at once, in rows of numbers at the nodes: positions, as many
/// velocities, time, and integrals that act on nothing.
pub trait Sweeps {
    /// Number of positions.
    const PLACES: usize;
    /// Number of rows, at most 8.
    const ROWS: usize;

    /// Number of rows with a slope in this motion; later rows are constant.
    fn changing(&self) -> usize;

    /// True if forces depend on time.
    fn is_timed(&self) -> bool;

    /// Begins a step, independent of earlier evaluations.
    fn begin(&mut self);

    /// Slopes of all rows but the positions; false outside the domain.
    fn forces<S: Simd>(&mut self, simd: S, at: &NodeRows, slopes: &mut NodeRows) -> bool;

    /// Slopes of the positions, after [`Sweeps::forces`], with the velocities of `at`.
    fn moves<S: Simd>(&mut self, simd: S, at: &NodeRows, slopes: &mut NodeRows);
}

/// Steps of a motion in terms of its states.
pub trait Eightwise<Y> {
    /// Rows of a state.
    fn row(&self, state: &Y) -> Row;

    /// State of the rows.
    fn state(&self, row: &Row) -> Y;

    /// States at the eight nodes.
    fn states(&self, at: &NodeRows) -> [Y; 8];

    /// Solves a step, by [`solve`].
    ///
    /// # Errors
    /// The reason for a step that is not solved.
    fn solve(&mut self, step: &Unsolved, to: &mut Solved) -> Result<(), StepFailure>;
}

/// A right-hand side, one state at a time or eight.
pub trait Slopes<Y> {
    /// The slope at a state; None outside the domain.
    fn slope(&mut self, at: &Y) -> Option<Y>;

    /// Solver of steps with eight states at once, if there is one.
    fn eightwise(&mut self) -> Option<&mut dyn Eightwise<Y>>;
}

impl<Y, F: FnMut(&Y) -> Option<Y>> Slopes<Y> for F {
    fn slope(&mut self, at: &Y) -> Option<Y> {
        self(at)
    }

    fn eightwise(&mut self) -> Option<&mut dyn Eightwise<Y>> {
        None
    }
}

/// Coefficient for the tolerance 1, which scales with the root of the tolerance; measured.
const GOAL: f64 = 0.012;
/// Largest error of an accepted step, over the aim; the next step is then shorter.
const SLACK: f64 = 30.0;
/// Sweep after which the error is judged, and the error over `SLACK` at which the step is given up.
const LOOK: usize = 2;
const HOPELESS: f64 = 2.0;
/// Remaining change of a last sweep, as a part of the tolerance; and rounding.
const LEFT: f64 = 0.05;
const ROUNDING: f64 = 1e-15;
/// Most sweeps, and the largest ratio of successive changes from the fourth sweep on.
const SWEEPS: usize = 13;
const CONVERGES: f64 = 0.7;
/// Changes below `NOISE` are rounding if a sweep leaves more than the part `STALLS` of them.
const NOISE: f64 = 1e-12;
/// Rounding accepted in a part of an accepted step, in tolerances; and the part that a sweep leaves of noise.
const ROUGH: f64 = 10.0;
const STALLS: f64 = 0.5;
/// Safety factor and bounds of a change of length.
const SAFETY: f64 = 0.8;
const SHRINK: f64 = 0.3;
const GROW: f64 = 1.5;
const EXPONENT: f64 = 1.0 / 9.0;
/// Most trials of a step; another method then takes this step and `PAUSE` more.
const TRIALS: usize = 6;
const PAUSE: u32 = 4;

/// A step to be solved.
#[derive(Debug, Clone)]
pub struct Unsolved<'a> {
    from: Row,
    start: Row,
    h: f64,
    tolerance: f64,
    guess: Option<SlopeGuess<'a>>,
    /// True if the step is given up as soon as it proves too long; false for a part of an accepted step.
    judged: bool,
}

/// Slopes from the polynomials of another step, on whose [-1, 1] this one begins at `from`, `ratio` times as long.
#[derive(Debug, Clone)]
struct SlopeGuess<'a> {
    of: &'a Modes,
    from: f64,
    ratio: f64,
}

/// A solved step, in rows.
#[derive(Debug, Clone)]
pub struct Solved {
    to: Row,
    slopes: NodeRows,
    modes: Modes,
    error: f64,
    sweeps: u64,
}

impl Solved {
    /// Not yet solved.
    const BLANK: Self = Self {
        to: [0.0; 8],
        slopes: NodeRows::ZERO,
        modes: Modes::ZERO,
        error: 0.0,
        sweeps: 0,
    };
}

/// Reason for a step that is not solved.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum StepFailure {
    /// A node leaves the domain.
    Domain,
    /// Sweeps do not converge.
    Slow,
    /// The step is too long by this error, according to the first sweeps.
    Long(f64),
}

/// State of the stepper between collocation steps.
#[derive(Debug, Clone)]
pub struct Lobatto<Y> {
    tolerance: f64,
    h: f64,
    /// The last step and its length (0 if none), and storage for the next.
    last: Box<Solved>,
    length: f64,
    next: Box<Solved>,
    pause: u32,
    of: PhantomData<Y>,
}

/// One accepted step.
#[derive(Debug, Clone)]
pub struct LobattoStep<Y> {
    /// State at the start.
    pub from: Y,
    /// State at the end.
    pub to: Y,
    /// Length.
    pub h: f64,
    slopes: [Y; 9],
    tolerance: f64,
}

impl<Y: State> Lobatto<Y> {
    /// Stepper with local errors of about `tolerance`; the first step is tried with the length `h`.
    pub fn new(h: f64, tolerance: f64) -> Self {
        Self {
            tolerance,
            h,
            last: Box::new(Solved::BLANK),
            length: 0.0,
            next: Box::new(Solved::BLANK),
            pause: 0,
            of: PhantomData,
        }
    }

    /// Length of the next trial step; None while another method is in use.
    pub fn next_step(&self) -> Option<f64> {
        (self.pause == 0).then_some(self.h)
    }

    /// Sets the length of the next step, after steps of another method.
    pub fn resume(&mut self, h: f64) {
        self.h = h;
        self.length = 0.0;
    }

    /// A step from a state with its slope, of at most `h_max`; None to request another method.
    pub fn step(
        &mut self,
        from: &Y,
        slope: &Y,
        of: &mut dyn Eightwise<Y>,
        h_max: f64,
        cost: &mut Cost,
    ) -> Option<LobattoStep<Y>> {
        if self.pause > 0 {
            self.pause -= 1;
            return None;
        }
        let mut step = Unsolved {
            from: of.row(from),
            start: of.row(slope),
            h: 0.0,
            tolerance: self.tolerance,
            guess: None,
            judged: true,
        };
        for _ in 0..TRIALS {
            let h = self.h.min(h_max);
            step.h = h;
            let goes_on = self.length > 0.0 && self.last.to == step.from;
            step.guess = goes_on.then(|| SlopeGuess {
                of: &self.last.modes,
                from: 1.0,
                ratio: h / self.length,
            });
            let error = match solve_counted(of, &step, &mut self.next, cost) {
                Ok(()) if self.next.error <= SLACK => {
                    let factor = SAFETY * self.next.error.max(1e-10).powf(-EXPONENT);
                    let longer = h * factor.clamp(SHRINK, GROW);
                    // A step cut short by `h_max` says little about the length that the error allows.
                    self.h = if h < self.h {
                        self.h.max(longer)
                    } else {
                        longer
                    };
                    cost.steps += 1;
                    std::mem::swap(&mut self.last, &mut self.next);
                    self.length = h;
                    return Some(to_step(from, slope, &self.last, h, self.tolerance, of));
                }
                Ok(()) => self.next.error,
                Err(StepFailure::Long(error)) => error,
                Err(StepFailure::Slow | StepFailure::Domain) => f64::INFINITY,
            };
            cost.rejected += 1;
            self.h = h * (SAFETY * error.powf(-EXPONENT)).max(SHRINK);
        }
        self.pause = PAUSE;
        None
    }
}

/// Solves a step and counts its cost.
fn solve_counted<Y>(
    of: &mut dyn Eightwise<Y>,
    step: &Unsolved,
    to: &mut Solved,
    cost: &mut Cost,
) -> Result<(), StepFailure> {
    let found = of.solve(step, to);
    cost.evaluations += match &found {
        Ok(()) => 8 * to.sweeps,
        Err(StepFailure::Long(_)) => 8 * LOOK as u64,
        Err(StepFailure::Slow) => 8 * SWEEPS as u64,
        Err(StepFailure::Domain) => 8,
    };
    found
}

/// Solves a step: sweeps from its guess until the slopes converge.
///
/// # Errors
/// The reason for a step that is not solved; `to` is then meaningless.
pub fn solve<M: Sweeps>(
    motion: &mut M,
    step: &Unsolved,
    to: &mut Solved,
) -> Result<(), StepFailure> {
    motion.begin();
    wide(Sweeping { motion, step, to })
}

struct Sweeping<'a, 'b, M> {
    motion: &'a mut M,
    step: &'a Unsolved<'b>,
    to: &'a mut Solved,
}

impl<M: Sweeps> WithSimd for Sweeping<'_, '_, M> {
    type Output = Result<(), StepFailure>;

    #[inline(always)]
    fn with_simd<S: Simd>(self, simd: S) -> Self::Output {
        let Self { motion, step, to } = self;
        let Unsolved {
            from,
            start,
            h,
            tolerance,
            guess,
            judged,
        } = step;
        let (places, rows, timed) = (M::PLACES, motion.changing(), motion.is_timed());
        let all = M::ROWS as f64;
        // No slope depends on the rows behind the time.
        let time = 2 * places;
        let mut scales = *from;
        for x in &mut scales {
            *x = 1.0 / (1.0 + x.abs());
        }
        scales[time] = 1.0;
        // Slopes before and after a sweep, swapped from one sweep to the next.
        let mut slopes = [NodeRows::ZERO; 2];
        match guess {
            Some(guess) => guess
                .of
                .at(simd, guess.from, guess.ratio, rows, &mut slopes[0]),
            None => {
                for (row, slope) in slopes[0].0.iter_mut().zip(start) {
                    *row = [*slope; 8];
                }
            }
        }
        let [mut old, mut new] = slopes.each_mut();
        let mut at = NodeRows::ZERO;
        states_at_nodes(simd, from, start, old, *h, places..time, &mut at);
        // Squares are compared, which saves the latency of a root.
        let mean = h * h / (8.0 * all);
        let left = (LEFT * tolerance) * (LEFT * tolerance);
        let rough = (ROUGH * tolerance) * (ROUGH * tolerance);
        let mut last = f64::NAN;
        for sweep in 1..=SWEEPS {
            states_at_nodes(simd, from, start, old, *h, 0..places, &mut at);
            if timed {
                states_at_nodes(simd, from, start, old, *h, time..time + 1, &mut at);
            }
            if !motion.forces(simd, &at, new) {
                return Err(StepFailure::Domain);
            }
            states_at_nodes(simd, from, start, new, *h, places..time, &mut at);
            motion.moves(simd, &at, new);
            let moved = squared_change(simd, [old, new], &scales, rows) * mean;
            (old, new) = (new, old);
            let small = moved < NOISE * NOISE;
            let stalls = sweep > 3 && moved > CONVERGES * CONVERGES * last && !small;
            let noisy = sweep > 2 && small && moved > STALLS * STALLS * last;
            // A part of a step converges as the whole did: the remaining changes are rounding.
            let rounding =
                moved < ROUNDING * ROUNDING || noisy || !judged && stalls && moved < rough;
            // The next sweep is expected to move by moved min(moved/last, 1), in terms of the roots of these squares.
            let stays = rounding || sweep > 1 && moved * moved.min(last) < left * last;
            if stays || *judged && sweep == LOOK {
                to.modes.fit_high(simd, start, old, rows);
                let tail = size(to.modes.tail(&scales, rows)) / all.sqrt();
                let error = h * tail / (GOAL * tolerance.sqrt());
                if stays {
                    to.modes.fit_mean(simd, start, old, rows);
                    to.to = *from;
                    for i in 0..rows {
                        to.to[i] += h * to.modes.mean[i];
                    }
                    to.slopes = *old;
                    (to.error, to.sweeps) = (error, sweep as u64);
                    return Ok(());
                }
                if error > HOPELESS * SLACK {
                    return Err(StepFailure::Long(error));
                }
            }
            if !(moved < f64::INFINITY) || stalls {
                break;
            }
            last = moved;
        }
        Err(StepFailure::Slow)
    }
}

/// Size of the truncated coefficients by extrapolation. One of two may vanish by chance.
#[inline(always)]
fn size([fifth, sixth, seventh, eighth]: [f64; 4]) -> f64 {
    let decay = ((eighth + seventh) / (sixth + fifth + f64::MIN_POSITIVE)).min(1.0);
    (eighth * eighth + seventh * seventh * decay).sqrt()
}

fn to_step<Y: State>(
    from: &Y,
    slope: &Y,
    solved: &Solved,
    h: f64,
    tolerance: f64,
    of: &dyn Eightwise<Y>,
) -> LobattoStep<Y> {
    let [b, c, d, e, f, g, i, j] = of.states(&solved.slopes);
    LobattoStep {
        from: from.clone(),
        to: of.state(&solved.to),
        h,
        slopes: [slope.clone(), b, c, d, e, f, g, i, j],
        tolerance,
    }
}

impl<Y: State> LobattoStep<Y> {
    /// Slopes at the nodes, first the start and last the end.
    pub fn stage_slopes(&self) -> &[Y] {
        &self.slopes
    }

    /// The slope at the end.
    pub fn end_slope(&self) -> &Y {
        &self.slopes[8]
    }

    /// State at the fraction `x` in [0, 1] of the step, from the polynomial through the slopes: of order 9.
    pub fn at(&self, x: f64) -> Y {
        integrate_polynomial(&self.from, self.h, &integrals(x), &self.slopes)
    }

    /// A part of the step from its start, of length `h`, at full order; None on failure.
    pub fn redo(&self, of: &mut dyn Eightwise<Y>, h: f64, cost: &mut Cost) -> Option<Self> {
        self.solve_part(&self.from, &self.slopes[0], -1.0, of, h, cost)
    }

    /// Both halves, with polynomials as accurate inside as the step is at its end.
    pub fn halves(&self, of: &mut dyn Eightwise<Y>, cost: &mut Cost) -> Option<[Self; 2]> {
        let h = 0.5 * self.h;
        let first = self.redo(of, h, cost)?;
        let second = self.solve_part(&first.to, first.end_slope(), 0.0, of, h, cost)?;
        Some([first, second])
    }

    /// A step of length `h` that begins at a place in [-1, 1] of this one, with the given state and slope.
    fn solve_part(
        &self,
        from: &Y,
        slope: &Y,
        place: f64,
        of: &mut dyn Eightwise<Y>,
        h: f64,
        cost: &mut Cost,
    ) -> Option<Self> {
        let start = of.row(&self.slopes[0]);
        let mut slopes = NodeRows::ZERO;
        for (i, slope) in self.slopes[1..].iter().enumerate() {
            for (row, x) in slopes.0.iter_mut().zip(of.row(slope)) {
                row[i] = x;
            }
        }
        let modes = wide(Fitting { start, slopes });
        let step = Unsolved {
            from: of.row(from),
            start: of.row(slope),
            h,
            tolerance: self.tolerance,
            guess: Some(SlopeGuess {
                of: &modes,
                from: place,
                ratio: h / self.h,
            }),
            judged: false,
        };
        let mut to = Solved::BLANK;
        solve_counted(of, &step, &mut to, cost).ok()?;
        Some(to_step(from, slope, &to, h, self.tolerance, of))
    }
}

#[cfg(test)]
mod tests;
