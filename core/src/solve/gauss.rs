//! Symmetric Runge-Kutta stepping of order 12 (Gauss collocation, 6 stages) for reversible systems over long times.
//!
//! Hairer, Lubich, Wanner: *Geometric Numerical Integration*, 2nd ed., Secs. V.1, VIII.3, VIII.6. An explicit step
//! leaves an energy error of one sign, and the errors accumulate. A symmetric step is its own inverse under h -> -h.
//! In a system that is reversible under a change of sign of the velocities, the energy errors of both halves of an
//! oscillation then cancel. The step must not be controlled by an error of past steps. All steps have the same length
//! in the independent variable sigma of
//! ```text
//! dy/dsigma = f(y)/Q(y),
//! ```
//! with a smooth Q that is the same for both directions ([`Reversible`]).

use super::cost::Cost;
use super::dop853::{State, StepTooSmall, integrate_polynomial};
use super::lagrange::lagrange;

/// State space of a system that may be reversible.
pub trait Reversible: State {
    /// Q^2 at the state `at` with the slope `self`: a smooth function of both, even in the slope, independent of
    /// time.
    fn pace_squared(&self, at: &Self) -> f64;
}

/// Number of stages.
const S: usize = 6;
/// Nodes: start, stages, end.
const PLACES: [f64; S + 2] = [
    0.0,
    0.033_765_242_898_423_99,
    0.169_395_306_766_867_73,
    0.380_690_406_958_401_56,
    0.619_309_593_041_598_5,
    0.830_604_693_233_132_2,
    0.966_234_757_101_576,
    1.0,
];
const WEIGHTS: [f64; S] = [
    0.085_662_246_189_585_18,
    0.180_380_786_524_069_3,
    0.233_956_967_286_345_52,
    0.233_956_967_286_345_52,
    0.180_380_786_524_069_3,
    0.085_662_246_189_585_18,
];
/// Exact weights less their doubles: these errors are the same in every step and would accumulate.
const REMAINDERS: [f64; S] = [R0, R1, R2, R2, R1, R0];
const R0: f64 = -5.81519e-18;
const R1: f64 = 6.51018e-19;
const R2: f64 = 5.16417e-18;
const STAGES: [[f64; S]; S] = [
    [
        0.042_831_123_094_792_59,
        -0.014_763_725_997_197_413,
        0.009_325_050_706_477_751,
        -0.005_668_858_049_483_512,
        0.002_854_433_315_099_335,
        -0.000_812_780_171_264_762_1,
    ],
    [
        0.092_673_491_430_378_87,
        0.090_190_393_262_034_65,
        -0.020_300_102_293_239_586,
        0.010_363_156_240_246_424,
        -0.004_887_192_928_037_671,
        0.001_355_561_055_485_061_8,
    ],
    [
        0.082_247_922_612_843_87,
        0.196_032_162_333_245,
        0.116_978_483_643_172_76,
        -0.020_482_527_745_656_096,
        0.007_989_991_899_662_336,
        -0.002_075_625_784_866_334,
    ],
    [
        0.087_737_871_974_451_5,
        0.172_390_794_624_406_96,
        0.254_439_495_032_001_64,
        0.116_978_483_643_172_76,
        -0.015_651_375_809_175_7,
        0.003_414_323_576_741_298_7,
    ],
    [
        0.084_306_685_134_100_11,
        0.185_267_979_452_106_96,
        0.223_593_811_046_099_1,
        0.254_257_069_579_585_1,
        0.090_190_393_262_034_65,
        -0.007_011_245_240_793_691,
    ],
    [
        0.086_475_026_360_849_93,
        0.177_526_353_208_969_98,
        0.239_625_825_335_829_05,
        0.224_631_916_579_867_78,
        0.195_144_512_521_266_72,
        0.042_831_123_094_792_59,
    ],
];

/// Change of the slopes at which a stage equation is solved to rounding.
const ROUNDING: f64 = 1e-16;
/// Unshrinking changes are rounding below `FLOOR`, or below this part of the tolerance.
const FLOOR: f64 = 1e-12;
const PART: f64 = 0.01;
/// Contraction of an error by one iteration, over h times the fastest rate.
const SWEEP: f64 = 0.1;
/// Most iterations; a step that takes more is shortened.
const ITERATIONS: u64 = 40;
/// A first step is lengthened as long as fewer iterations suffice.
const EASY: u64 = 14;
/// Most rounds of fitting the first step, and the bounds of its change in one round.
const ROUNDS: u32 = 30;
const GROW: f64 = 1.5;
const SHRINK: f64 = 0.3;
/// Largest ratio of the bound to the error of a first step at which the step counts as fitted.
const FITTED: f64 = 30.0;
/// Bound on the error of the first step, relative to that of all steps, since the hardest part of the motion is not
/// known yet. (Half the length reduces the error 8000 times at a few tenths more work: the iteration then converges
/// faster.)
const SAFE: f64 = 0.1;
/// Factor by which the error of later steps may exceed the bound; beyond, all later steps are shortened, by a little
/// more than needed.
const SLACK: f64 = 10.0;
const SPARE: f64 = 0.8;
/// A trial longer than `h_max` over this may reach the break that `h_max` stands for, and be rejected for it. (Some
/// callers allow four times the way to the break, and time may run faster in the step than at its start.)
const NEAR: f64 = 8.0;
/// A step below this multiple of the first has stalled.
const STALL: f64 = 1e-12;

/// An integration in progress.
#[derive(Debug, Clone)]
pub struct Gauss<Y> {
    tolerance: f64,
    h: f64,
    first: f64,
    /// True before the first step with this length.
    fresh: bool,
    state: Y,
    /// Slope in sigma.
    slope: Y,
    /// Rounding error of the state, for compensated summation.
    rest: Option<Y>,
    last: Option<GaussStep<Y>>,
    cost: Cost,
}

/// One accepted step.
#[derive(Debug, Clone)]
pub struct GaussStep<Y> {
    /// State at the start.
    pub from: Y,
    /// State at the end.
    pub to: Y,
    /// Length in sigma.
    pub h: f64,
    /// Slopes in sigma at the places.
    slopes: [Y; S + 2],
    /// Rounding error of the state at the end.
    rest: Y,
    floor: f64,
    iterations: u64,
    /// Contraction of the last iterations: ratio of successive changes.
    contraction: f64,
}

/// Converts the slope at `at` into the slope in sigma.
fn divide_by_pace<Y: Reversible>(slope: &mut Y, at: &Y) -> Option<()> {
    let pace = slope.pace_squared(at).sqrt();
    if !(0.0 < pace && pace < f64::INFINITY) {
        return None;
    }
    let before = slope.clone();
    slope.axpy(1.0 / pace - 1.0, &before);
    Some(())
}

/// Integrals over [0, x] of the Lagrange polynomials, exact by Gauss's rule.
fn integrals(x: f64) -> [f64; S + 2] {
    let mut sums = [0.0; S + 2];
    for (place, weight) in PLACES[1..].iter().zip(WEIGHTS) {
        for (sum, value) in sums.iter_mut().zip(lagrange(&PLACES, x * place)) {
            *sum += x * weight * value;
        }
    }
    sums
}

/// sum_i weights_i slopes_i.
fn weighted_sum<Y: State>(weights: &[f64], slopes: &[Y]) -> Y {
    let mut sum = slopes[0].clone();
    sum.axpy(weights[0] - 1.0, &slopes[0]);
    for (weight, slope) in weights.iter().zip(slopes).skip(1) {
        sum.axpy(*weight, slope);
    }
    sum
}

impl<Y: Reversible> Gauss<Y> {
    /// Starts at `state` with its `slope` in the system's own variable; `h` is a first guess, which is fitted to the
    /// tolerance by trials.
    pub fn new(state: Y, mut slope: Y, h: f64, tolerance: f64) -> Option<Self> {
        divide_by_pace(&mut slope, &state)?;
        Some(Self {
            tolerance,
            h,
            first: h,
            fresh: true,
            state,
            slope,
            rest: None,
            last: None,
            cost: Cost::default(),
        })
    }

    /// Continues from another state, with steps of the same length.
    pub fn restart(&mut self, state: Y, mut slope: Y) -> Option<()> {
        divide_by_pace(&mut slope, &state)?;
        self.state = state;
        self.slope = slope;
        self.rest = None;
        self.last = None;
        Some(())
    }

    /// Fits the length of the steps anew, for the start of another motion.
    pub fn refit(&mut self) {
        self.fresh = true;
    }

    /// Cost counters.
    pub fn cost(&self) -> Cost {
        self.cost
    }

    /// Cost counters, to be increased by the caller for evaluations made outside the steps.
    pub fn cost_mut(&mut self) -> &mut Cost {
        &mut self.cost
    }

    /// The current state.
    pub fn state(&self) -> &Y {
        &self.state
    }

    /// The slope in sigma at the current state.
    pub fn slope(&self) -> &Y {
        &self.slope
    }

    /// The length of the steps.
    pub fn next_step(&self) -> f64 {
        self.h
    }

    /// Takes one step of at most `h_max`. `f` is the right-hand side in the system's own variable; None means outside
    /// its domain and shortens the steps. Only this step is shortened if it may have met the break that `h_max`
    /// stands for, otherwise all.
    ///
    /// # Errors
    /// [`StepTooSmall`] if no step of a size worth taking can be solved.
    pub fn step(
        &mut self,
        mut f: impl FnMut(&Y, &mut Y) -> Option<()>,
        h_max: f64,
    ) -> Result<GaussStep<Y>, StepTooSmall> {
        let mut rounds = if self.fresh { ROUNDS } else { 0 };
        let mut longest = f64::INFINITY;
        let mut h_max = h_max;
        let near = h_max / NEAR;
        loop {
            let h = self.h.min(h_max);
            if !(h > STALL * self.first.min(h_max)) {
                return Err(StepTooSmall);
            }
            let guess = match &self.last {
                Some(last) => last.extrapolated_slopes(h),
                None => std::array::from_fn(|_| self.slope.clone()),
            };
            let start = StepStart {
                from: &self.state,
                slope: &self.slope,
                rest: self.rest.as_ref(),
            };
            let floor = FLOOR.max(PART * self.tolerance);
            let solved = solve(start, h, floor, guess, &mut f, &mut self.cost);
            let error = solved
                .as_ref()
                .map_or(f64::INFINITY, |step| step.error() / (SAFE * self.tolerance));
            let allowed = if self.fresh { 1.0 } else { SLACK };
            if let Some(step) = solved
                && error <= allowed
            {
                let grow = GROW.min((FITTED.sqrt() * error).max(1e-300).powf(-1.0 / 13.0));
                let longer = h * grow;
                if rounds > 0
                    && error * FITTED < 1.0
                    && step.iterations < EASY
                    && h == self.h
                    && longer < longest
                {
                    rounds -= 1;
                    self.h = longer;
                    self.first = self.first.max(longer);
                    continue;
                }
                self.fresh &= h < self.h;
                self.cost.steps += 1;
                self.state.clone_from(&step.to);
                self.slope.clone_from(&step.slopes[S + 1]);
                self.rest = Some(step.rest.clone());
                self.last = Some(step.clone());
                return Ok(step);
            }
            self.cost.rejected += 1;
            longest = longest.min(h);
            let factor = SPARE * error.powf(-1.0 / 13.0);
            let shorter = h * if factor > SHRINK { factor } else { SHRINK };
            if h > near {
                h_max = shorter
            } else {
                self.h = shorter
            }
        }
    }

    /// Moves the state back inside the last step, to a located event; `slope` is in sigma.
    pub fn rewind(&mut self, state: Y, slope: Y) {
        self.state = state;
        self.slope = slope;
        self.rest = None;
        self.last = None;
    }
}

/// Data at the start of a step.
struct StepStart<'a, Y> {
    from: &'a Y,
    slope: &'a Y,
    /// Rounding error of the state, for compensated summation.
    rest: Option<&'a Y>,
}

/// The step of length `h` from a state with its slope and rest, by fixed-point iteration to rounding from guesses of
/// the slopes at the stages. None if it does not converge, or leaves the domain.
fn solve<Y: Reversible>(
    start: StepStart<'_, Y>,
    h: f64,
    floor: f64,
    mut stages: [Y; S],
    f: &mut impl FnMut(&Y, &mut Y) -> Option<()>,
    cost: &mut Cost,
) -> Option<GaussStep<Y>> {
    let StepStart { from, slope, rest } = start;
    let mut new = slope.clone();
    let mut last = f64::INFINITY;
    let mut contraction: f64 = 0.0;
    let mut iterations = 0;
    loop {
        iterations += 1;
        let mut moved = 0.0;
        for i in 0..S {
            let mut at = from.clone();
            for (a, slope) in STAGES[i].iter().zip(&stages) {
                at.axpy(h * a, slope);
            }
            cost.evaluations += 1;
            f(&at, &mut new)?;
            divide_by_pace(&mut new, &at)?;
            stages[i].axpy(-1.0, &new);
            moved += stages[i].mean_square(from, from);
            stages[i].clone_from(&new);
        }
        let moved = h * (moved / S as f64).sqrt();
        if moved <= ROUNDING || moved >= last && moved < floor {
            break;
        }
        if !(moved < 1e3 * last.max(1.0)) || iterations >= ITERATIONS {
            return None;
        }
        if iterations > 2 && moved > floor {
            contraction = moved / last;
        }
        last = moved;
    }
    cost.iterations += iterations;
    // y + increment by compensated summation: the rounding error is kept for the next step.
    let mut increment = weighted_sum(&REMAINDERS, &stages);
    let main = weighted_sum(&WEIGHTS, &stages);
    increment.axpy(1.0, &main);
    let whole = increment.clone();
    increment.axpy(h - 1.0, &whole);
    if let Some(rest) = rest {
        increment.axpy(1.0, rest);
    }
    let mut to = from.clone();
    to.axpy(1.0, &increment);
    let mut gained = to.clone();
    gained.axpy(-1.0, from);
    increment.axpy(-1.0, &gained);
    cost.evaluations += 1;
    let mut end = slope.clone();
    f(&to, &mut end)?;
    divide_by_pace(&mut end, &to)?;
    let [a, b, c, d, e, g] = stages;
    Some(GaussStep {
        from: from.clone(),
        to,
        h,
        slopes: [slope.clone(), a, b, c, d, e, g, end],
        rest: increment,
        floor,
        iterations,
        contraction,
    })
}

impl<Y: Reversible> GaussStep<Y> {
    /// Guesses of the slopes at the stages of a following step of length `h`.
    fn extrapolated_slopes(&self, h: f64) -> [Y; S] {
        std::array::from_fn(|i| {
            weighted_sum(
                &lagrange(&PLACES, 1.0 + PLACES[i + 1] * h / self.h),
                &self.slopes,
            )
        })
    }

    /// Estimate of the local error: the first Legendre coefficient of the slope beyond the step's polynomial, times
    /// the response of the end to it. The coefficient is extrapolated by the decay of the known ones. The response
    /// decays likewise or, if that is more, follows from the fastest rate z met by the iteration as for exp(i z x).
    /// The product is then the error of such a motion to leading order.
    fn error(&self) -> f64 {
        let sizes: [f64; S] = std::array::from_fn(|k| {
            let weights: [f64; S] = std::array::from_fn(|i| {
                let x = 2.0 * PLACES[i + 1] - 1.0;
                (2 * k + 1) as f64 * WEIGHTS[i] * legendre(k, x)
            });
            weighted_sum(&weights, &self.slopes[1..=S]).mean_square(&self.from, &self.to)
        });
        // Decay of squares, over two degrees.
        let ratio = (sizes[5] + sizes[4]) / (sizes[3] + sizes[2] + f64::MIN_POSITIVE);
        let decay = ratio.min(1.0).powf(0.25);
        let fastest = 0.5 * self.contraction / SWEEP;
        let answer = decay.powi(6).max(fastest.powi(6) / 10_395.0);
        // One of two coefficients may vanish by chance.
        let beyond = (sizes[5] + sizes[4] * decay.powi(2)) * decay.powi(2);
        self.h * beyond.sqrt() * answer
    }

    /// The slopes in sigma at the start, the stages and the end.
    pub fn stage_slopes(&self) -> &[Y] {
        &self.slopes
    }

    /// Slope in sigma at the end.
    pub fn end_slope(&self) -> &Y {
        &self.slopes[S + 1]
    }

    /// State at the fraction `x` in [0, 1] of the step, from the polynomial through the slopes: of order 8.
    pub fn at(&self, x: f64) -> Y {
        integrate_polynomial(&self.from, self.h, &integrals(x), &self.slopes)
    }

    /// This step with another length, at full order.
    pub fn redo(
        &self,
        mut f: impl FnMut(&Y, &mut Y) -> Option<()>,
        h: f64,
        cost: &mut Cost,
    ) -> Option<Self> {
        let guess = std::array::from_fn(|i| {
            weighted_sum(&lagrange(&PLACES, PLACES[i + 1] * h / self.h), &self.slopes)
        });
        let start = StepStart {
            from: &self.from,
            slope: &self.slopes[0],
            rest: None,
        };
        solve(start, h, self.floor, guess, &mut f, cost)
    }
}

/// Legendre's polynomial of degree `k`.
fn legendre(k: usize, x: f64) -> f64 {
    let (mut before, mut now) = (0.0, 1.0);
    for j in 0..k {
        let j = j as f64;
        (before, now) = (now, ((2.0 * j + 1.0) * x * now - j * before) / (j + 1.0));
    }
    now
}
