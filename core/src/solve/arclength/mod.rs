//! Pseudo-arclength continuation of F(x, p) = 0, as an iterator.
//!
//! Prediction by the cubic through the last two points and their tangents, Newton correction in a
//! hyperplane; every elimination of [F_x F_p] gives correction and tangent alike, so that folds are
//! ordinary points. The step follows the contraction of the corrector and the angle between tangents.
//!
//! ```
//! # use snaprod_core as snaprod;
//! use nalgebra::{DMatrix, DVector};
//! use snaprod::solve::arclength::{Continuation, Options};
//! use snaprod::solve::parametrised_problem::{Family, Linearised};
//!
//! /// x^2 + p^2 = 1.
//! struct Circle;
//! impl Family for Circle {
//!     fn size(&self) -> usize {
//!         1
//!     }
//!
//!     fn linearised(&self, x: &DVector<f64>, p: f64) -> snaprod::Result<Linearised> {
//!         Ok(Linearised {
//!             residual: DVector::from_element(1, x[0] * x[0] + p * p - 1.0),
//!             jacobian: DMatrix::from_element(1, 1, 2.0 * x[0]),
//!             slope: DVector::from_element(1, 2.0 * p),
//!         })
//!     }
//! }
//! let trace = Continuation::new(&Circle, DVector::from_element(1, 1.0), 0.0, Options::between(-2.0, 2.0))?.trace();
//! assert_eq!(trace.specials.len(), 2); // the folds at p = 1 and p = -1
//! println!("{}", trace.stop);
//! # Ok::<(), snaprod::Error>(())
//! ```

mod items;
mod options;

pub use items::{BranchStart, Item, Point, Role, Stop, Trace};
pub use options::{Direction, Options, Predictor};

use super::elimination::Place;
use super::newton;
use super::newton_on_branch::{Corrected, Cubic, DirectedPlace, Failure, Finish, Space};
use super::parametrised_problem::{Family, check_size};
use super::special_points::{Sample, Special, SpecialKind};
use crate::error::{Error, Result};
use crate::math::small_sort::sort_few;
use nalgebra::DVector;
use std::collections::VecDeque;

/// Steps in a row after which a branch creeps, and their length, over that of the range of p, and over the longest
/// step allowed.
const CREEPING_STEPS: usize = 10;
const CREEPING: f64 = 1e-6;
const SHORT: f64 = 0.5;

/// A branch being followed: iterate over it.
pub struct Continuation<'a> {
    space: Space<'a>,
    options: Options,
    start: Sample,
    current: Sample,
    previous: Option<Sample>,
    step: f64,
    /// A length at which a step failed since the last success; steps do not grow beyond.
    ceiling: f64,
    /// Steps in a row that are far shorter than the range.
    creeping: usize,
    points: usize,
    counted: usize,
    queue: VecDeque<Item>,
    done: bool,
}

impl<'a> Continuation<'a> {
    /// A branch through the solution near `x` at exactly this `p`, found by damped Newton.
    ///
    /// # Errors
    /// Options outside their sets, p outside the range, no solution near `x`, or a start where the
    /// direction of growing p is undefined (a fold or branch point: use [`Continuation::along`]).
    pub fn new(
        family: &'a dyn Family,
        x: DVector<f64>,
        p: f64,
        mut options: Options,
    ) -> Result<Self> {
        let space = Self::space(family, &x, p, &mut options)?;
        let newton = newton::Options {
            tolerance: options.tolerance,
            ..newton::Options::default()
        };
        let solved = newton::solve(
            |x| {
                space.evaluations.set(space.evaluations.get() + 1);
                let at = family.linearised(x, p)?.checked(x, p)?;
                Ok((at.residual, at.jacobian))
            },
            &x,
            &newton,
        )
        .map_err(|e| e.context(format!("the branch's first point, p = {p}")))?;
        let place = Place::new(solved.x, p * options.weight);
        let (_, eliminated) = space.evaluate(&place)?;
        let (null, determinant) = space.null(&eliminated);
        let forward = (options.to > options.from) == (options.direction == Direction::Forward);
        let sign = if forward == (null.p > 0.0) { 1.0 } else { -1.0 };
        if !(null.p.abs() > 1e-10) || eliminated.regularity() < 1e-12 {
            return Err(Error::ambiguous(format!(
                "the branch's first point, p = {p}, is a fold or a branch point, where no direction goes with p; \
                 start from another p, or give the direction"
            )));
        }
        let on = Corrected {
            place,
            tangent: null * sign,
            branching: determinant * sign,
            regularity: eliminated.regularity(),
            contraction: 0.0,
            error: solved.correction,
        };
        Ok(Self::begin(space, on, options))
    }

    /// A branch through the solution near a start with its direction; p may move a little (the
    /// correction is made across the direction). `options.direction` is not used.
    ///
    /// # Errors
    /// As [`Continuation::new`]; a zero direction.
    pub fn along(
        family: &'a dyn Family,
        start: &BranchStart,
        mut options: Options,
    ) -> Result<Self> {
        let space = Self::space(family, &start.x, start.p, &mut options)?;
        check_size(
            family,
            "the direction of a branch's start",
            &start.direction_x,
        )?;
        let direction = Place::new(
            start.direction_x.clone(),
            start.direction_p * options.weight,
        );
        if !(direction.norm() > 0.0 && direction.is_finite()) {
            return Err(Error::domain(
                "the direction of a branch's start must be finite and not zero",
            ));
        }
        let guess = Place::new(start.x.clone(), start.p * options.weight);
        let on = space
            .correct(&guess, &direction, f64::INFINITY, Finish::Evaluated)
            .map_err(|failure| {
                Error::no_convergence(format!(
                    "the branch's first point, near p = {}: {failure}; start nearer to a solution",
                    start.p
                ))
            })?;
        Ok(Self::begin(space, on, options))
    }

    fn space(
        family: &'a dyn Family,
        x: &DVector<f64>,
        p: f64,
        options: &mut Options,
    ) -> Result<Space<'a>> {
        options.check()?;
        check_size(family, "the branch's first point", x)?;
        options.weight = options.rounded_weight();
        if !(p.is_finite() && options.contains(p)) {
            return Err(Error::domain(format!(
                "the branch's first point, p = {p}, must lie between {} and {}",
                options.from, options.to
            )));
        }
        Ok(Space::new(
            family,
            options.weight,
            options.tolerance,
            options.max_corrections,
        ))
    }

    fn begin(space: Space<'a>, on: Corrected, options: Options) -> Self {
        let first = space.dressed(on, 0.0, true);
        let mut this = Self {
            space,
            step: options.initial_step,
            options,
            start: first.clone(),
            current: first.clone(),
            previous: None,
            ceiling: f64::INFINITY,
            creeping: 0,
            points: 0,
            counted: 0,
            queue: VecDeque::new(),
            done: false,
        };
        this.push(&first, Role::Start);
        this
    }

    /// Evaluations of F up to now.
    pub fn evaluations(&self) -> usize {
        self.space.evaluations.get()
    }

    /// Follows the branch to its end.
    pub fn trace(mut self) -> Trace {
        let (mut points, mut specials) = (Vec::new(), Vec::new());
        let mut stop = Stop::MaxPoints;
        for item in self.by_ref() {
            match item {
                Item::Point(point) => points.push(point),
                Item::Special(special) => specials.push(special),
                Item::Stop(reason) => stop = reason,
            }
        }
        Trace {
            points,
            specials,
            stop,
            evaluations: self.evaluations(),
        }
    }

    fn push(&mut self, sample: &Sample, role: Role) {
        let evaluations = self.evaluations();
        let point = Point {
            role,
            evaluations: evaluations - self.counted,
            ..self.space.point(sample)
        };
        self.counted = evaluations;
        self.points += 1;
        self.queue.push_back(Item::Point(point));
    }

    fn stop(&mut self, stop: Stop) {
        self.queue.push_back(Item::Stop(stop));
        self.done = true;
    }

    /// Predicted (place, direction) a step `h` ahead.
    fn predict(&self, h: f64) -> (Place, Place) {
        let Corrected { place, tangent, .. } = &self.current.on;
        match (&self.previous, self.options.predictor) {
            (Some(previous), Predictor::Cubic) => {
                let cubic = Cubic::new(
                    previous.place_and_tangent(),
                    self.current.place_and_tangent(),
                );
                let t = 1.0 + h / cubic.length;
                // Far beyond a short cubic its errors grow.
                if h > 5.0 * cubic.length {
                    return (place + tangent * h, tangent.clone());
                }
                (cubic.at(t), cubic.slope(t))
            }
            _ => (place + tangent * h, tangent.clone()),
        }
    }

    /// The end of the range that p passes between two values.
    fn end_passed(&self, before: f64, after: f64) -> Option<f64> {
        [self.options.from, self.options.to]
            .into_iter()
            .find(|end| (before < *end && *end < after) || (after < *end && *end < before))
    }

    fn stop_at(&self, end: f64) -> Stop {
        if end == self.options.to {
            Stop::Reached
        } else {
            Stop::LeftAtStart
        }
    }

    /// A point of the branch at exactly this p, near `guess`.
    fn land(&self, guess: &Place, p: f64, reach: f64) -> Result<Corrected, Failure> {
        let target = p * self.options.weight;
        let guess = Place::new(guess.x.clone(), target);
        let normal = Place::along_p(guess.x.len());
        let mut on = self
            .space
            .correct(&guess, &normal, reach, Finish::Evaluated)?;
        on.place.p = target;
        on.tangent = on.tangent.towards(&self.current.on.tangent);
        if on.tangent.p < 0.0 {
            on.branching = -on.branching;
        }
        Ok(on)
    }

    /// The step, shortened if the prediction itself turns by more than the largest angle.
    fn limited_by_angle(&self, h: f64) -> f64 {
        let (_, normal) = self.predict(h);
        let angle = angle(&normal.unit(), &self.current.on.tangent);
        if angle > self.options.max_angle {
            (h * (self.options.max_angle / angle).max(0.3)).max(self.options.min_step)
        } else {
            h
        }
    }

    /// One attempt at a step of length `h`.
    fn attempt(&self, h: f64) -> Result<Corrected, Failure> {
        let (mut guess, mut normal) = self.predict(h);
        let reach = 0.5 * h;
        let now = self.current.on.place.p / self.options.weight;
        if let Some(end) = self.end_passed(now, guess.p / self.options.weight) {
            // Do not evaluate F beyond the end of the range, where it may be undefined.
            let fraction = (end - now) / (guess.p / self.options.weight - now);
            (guess, normal) = self.predict(h * fraction);
            if normal.clone().unit().p.abs() > 0.05 {
                return self.land(&guess, end, reach);
            }
        }
        self.space
            .correct(&guess, &normal, reach, Finish::Predicted)
    }

    /// The next accepted point, or the reason for the end; adapts the step.
    fn advance(&mut self) -> Result<Sample, Stop> {
        let options = self.options.clone();
        let mut h = self.limited_by_angle(self.step.min(self.ceiling));
        let mut degenerate = 0;
        loop {
            let failure = match self.attempt(h) {
                Ok(on) => {
                    let before = &self.current.on;
                    let moved = (&on.place - &before.place).norm();
                    let angle = angle(&on.tangent, &before.tangent);
                    if on.regularity < 1e-9 && degenerate < 2 {
                        // On a branch point: the tangent is noise. Stop a little earlier.
                        degenerate += 1;
                        h *= 0.83;
                        continue;
                    }
                    if moved > 2.0 * h {
                        Failure::Far
                    } else if angle > 1.5 * options.max_angle && h > options.min_step {
                        h = (h * (0.7 * options.max_angle / angle).max(0.25)).max(options.min_step);
                        continue;
                    } else if angle > 1.5 * options.max_angle {
                        Failure::Diverging(angle)
                    } else {
                        self.adapt(h, &on, angle);
                        return Ok(self.space.dress(on, &self.current));
                    }
                }
                Err(failure) => failure,
            };
            if h <= options.min_step {
                return Err(self.give_up(failure));
            }
            // Where F ends, approach in half steps; the ceiling keeps the next step from failing again.
            let fraction = match failure {
                Failure::Diverging(by) if by.is_finite() => (0.25 / by).sqrt().clamp(0.2, 0.5),
                _ => 0.5,
            };
            self.ceiling = match failure {
                Failure::Undefined(_) => 0.5 * h,
                _ => f64::INFINITY,
            };
            h = (h * fraction).max(options.min_step);
        }
    }

    fn adapt(&mut self, h: f64, on: &Corrected, angle: f64) {
        let order = match (self.options.predictor, &self.previous) {
            (Predictor::Cubic, Some(_)) => 4.0,
            _ => 2.0,
        };
        const CONTRACTION: f64 = 0.03;
        let by_contraction = if on.contraction.is_finite() {
            (CONTRACTION / on.contraction.max(1e-12)).powf(1.0 / order)
        } else {
            2.0
        };
        let by_angle = 0.8 * self.options.max_angle / angle.max(1e-12);
        let factor = by_contraction.min(by_angle).clamp(0.3, 2.0);
        // A limit of the domain that was not met as predicted lies farther on.
        self.ceiling *= 1.5;
        self.step = (h * factor).clamp(self.options.min_step, self.options.max_step);
    }

    fn give_up(&self, failure: Failure) -> Stop {
        let p = self.current.on.place.p / self.options.weight;
        let arclength = self.current.arclength;
        match failure {
            Failure::Undefined(reason) => Stop::Undefined {
                p,
                arclength,
                reason,
            },
            failure => Stop::StepTooSmall {
                p,
                arclength,
                reason: format!(
                    "with the smallest step allowed, {failure}; F may have a kink or a wrong derivative here, or be noisier than the \
                     tolerance {:e}; a smaller min_step or a larger tolerance may help",
                    self.options.tolerance
                ),
            },
        }
    }

    /// The end of a branch that creeps: ten steps in a row are shorter than a millionth of the range, though longer
    /// ones are allowed.
    fn creep(&mut self, step: f64) -> Option<Stop> {
        let options = &self.options;
        let range = (options.to - options.from).abs() * options.weight;
        let is_short = step < CREEPING * range && step < SHORT * options.max_step;
        self.creeping = if is_short { self.creeping + 1 } else { 0 };
        (self.creeping >= CREEPING_STEPS).then(|| Stop::StepTooSmall {
            p: self.current.on.place.p / options.weight,
            arclength: self.current.arclength,
            reason: format!(
                "the branch creeps: {CREEPING_STEPS} steps in a row are shorter than {CREEPING:e} of the range; F may be noisier here than the \
                 tolerance {:e}, or the unknowns lose their digits; a larger tolerance or other unknowns may help",
                options.tolerance
            ),
        })
    }

    /// The start again, if the branch passes it between two neighbours.
    fn closing_point(&self, a: &Sample, b: &Sample) -> Option<Sample> {
        let DirectedPlace {
            place: home,
            tangent: normal,
        } = self.start.place_and_tangent();
        let side = |s: &Sample| normal.dot(&(&s.on.place - &home));
        let passed = side(a) < 0.0 && side(b) >= 0.0 && normal.dot(&b.on.tangent) > 0.0;
        if !(passed && a.arclength > 0.0) {
            return None;
        }
        let t = side(a) / (side(a) - side(b));
        let cubic = Cubic::new(a.place_and_tangent(), b.place_and_tangent());
        let guess = cubic.at(t);
        if !((&guess - &home).norm() < 0.2 * cubic.length) {
            return None;
        }
        // The guess moves along the normal into the start's plane.
        let out = normal.dot(&(&guess - &home));
        let guess = guess - &normal * out;
        let finish = Finish::Evaluated;
        let on = self.space.correct(&guess, &normal, cubic.length, finish);
        let mut on = on.ok()?;
        let rounding = 10.0 * (on.error + self.start.on.error);
        let near = 1e3 * self.options.tolerance * (1.0 + home.norm()) + rounding;
        if !((&on.place - &home).norm() <= near) {
            return None;
        }
        on.place = home;
        Some(self.space.dress(on, a))
    }

    /// Requested values of p, and ends of the range, between two neighbours: in order, with the end of the range that
    /// the branch reaches first, if any.
    fn landings(&self, a: &Sample, b: &Sample, specials: &[Special]) -> Vec<(Sample, Option<f64>)> {
        let weight = self.options.weight;
        let ends = [self.options.from, self.options.to];
        // p is monotone between folds; with the folds themselves as knots the guesses near them hold.
        let turns = specials
            .iter()
            .filter(|s| s.kind == SpecialKind::Fold || s.turning)
            .map(|s| (s.place_and_tangent(weight), s.point.arclength));
        let mut knots = vec![(a.place_and_tangent(), a.arclength)];
        knots.extend(turns);
        knots.push((b.place_and_tangent(), b.arclength));
        let mut landed = Vec::new();
        for pair in knots.windows(2) {
            let ((start, s0), (end, s1)) = (&pair[0], &pair[1]);
            let cubic = Cubic::new(start.clone(), end.clone());
            let (p0, p1) = (cubic.a.p / weight, cubic.b.p / weight);
            for &value in self.options.at.iter().chain(&ends) {
                if !((p0 < value && value < p1) || (p1 < value && value < p0)) {
                    continue;
                }
                // Bisection on the cubic gives the guess.
                let (mut low, mut high) = (0.0, 1.0);
                for _ in 0..50 {
                    let middle = 0.5 * (low + high);
                    let before = (cubic.at(middle).p / weight < value) == (p0 < value);
                    *(if before { &mut low } else { &mut high }) = middle;
                }
                let (guess, along) = (cubic.at(low), cubic.slope(low));
                let reach = 0.5 * cubic.length;
                // Near a fold the guess may be too far off; a point of the branch is not.
                let landing = self.land(&guess, value, reach).or_else(|_| {
                    let finish = Finish::Evaluated;
                    let near = self.space.correct(&guess, &along, reach, finish)?;
                    self.land(&near.place, value, reach)
                });
                if let Ok(mut on) = landing {
                    if on.tangent.dot(&along) < 0.0 {
                        on.tangent = on.tangent * -1.0;
                        on.branching = -on.branching;
                    }
                    let end = ends.contains(&value).then_some(value);
                    let sample = self.space.dressed(on, s0 + low * (s1 - s0), true);
                    landed.push((sample, end));
                }
            }
        }
        sort_few(&mut landed, |(sample, _)| sample.arclength);
        if let Some(last) = landed.iter().position(|l| l.1.is_some()) {
            landed.truncate(last + 1);
        }
        landed
    }

    /// The end of the range of p at the present point, if the branch leads outward.
    fn range_end_ahead(&self) -> Option<f64> {
        let Corrected { place, tangent, .. } = &self.current.on;
        let p = place.p / self.options.weight;
        let (low, high) = (
            self.options.from.min(self.options.to),
            self.options.from.max(self.options.to),
        );
        let outward = |sign: f64| sign * tangent.p > 1e-9;
        if p <= low && outward(-1.0) {
            Some(low)
        } else {
            (p >= high && outward(1.0)).then_some(high)
        }
    }

    fn proceed(&mut self) {
        if let Some(end) = self.range_end_ahead() {
            return self.stop(self.stop_at(end));
        }
        if self.points >= self.options.max_points {
            return self.stop(Stop::MaxPoints);
        }
        let a = self.current.clone();
        let mut b = match self.advance() {
            Ok(b) => b,
            Err(stop) => return self.stop(stop),
        };
        let mut stop = self.creep(b.arclength - a.arclength);
        if let Some(home) = self.closing_point(&a, &b) {
            (b, stop) = (home, Some(Stop::Closed));
        }
        let specials = if self.options.special {
            self.space.search(&a, &b, 0)
        } else {
            Vec::new()
        };
        let weight = self.options.weight;
        let p = b.on.place.p / weight;
        let mut landings = self.landings(&a, &b, &specials);
        if let Some((sample, Some(end))) = landings.last().cloned() {
            landings.pop();
            (b, stop) = (sample, Some(self.stop_at(end)));
        } else if stop.is_none() && (p == self.options.from || p == self.options.to) {
            stop = Some(self.stop_at(p));
        } else if !self.options.contains(p) {
            // The end was passed but could not be hit.
            let end = self.end_passed(a.on.place.p / weight, p).unwrap_or(p);
            stop = Some(self.stop_at(end));
        }
        let mut landings = landings.into_iter().map(|l| l.0).peekable();
        let inside = specials.into_iter();
        for special in inside.filter(|s| s.point.arclength <= b.arclength) {
            while let Some(l) = landings.next_if(|l| l.arclength < special.point.arclength) {
                self.push(&l, Role::Requested);
            }
            self.queue.push_back(Item::Special(special));
        }
        for landing in landings {
            self.push(&landing, Role::Requested);
        }
        let role = if stop.is_some() {
            Role::End
        } else if self.options.at.contains(&(b.on.place.p / weight)) {
            Role::Requested
        } else {
            Role::Step
        };
        self.push(&b, role);
        (self.previous, self.current) = (Some(a), b);
        if let Some(stop) = stop {
            self.stop(stop);
        }
    }
}

/// Angle between unit vectors, accurate when small.
fn angle(a: &Place, b: &Place) -> f64 {
    2.0 * (0.5 * (a - b).norm()).min(1.0).asin()
}

impl Iterator for Continuation<'_> {
    type Item = Item;

    fn next(&mut self) -> Option<Item> {
        if self.queue.is_empty() && !self.done {
            self.proceed();
        }
        self.queue.pop_front()
    }
}
