//! Equilibria with touches, found from the free rod by continuation.

use super::super::ivp::Wrench;
use super::super::problem::Trial;
use super::closest_points::{Low, TouchedSteps};
use super::equations::{Stations, Touching};
use super::index::Index;
use super::{
    ContactEquilibrium, ContactGuess, ContactProblem, HELD_DEPTH, Line, ScaledTouch, TouchLine,
    TouchPoint, Way,
};
use crate::error::{Error, Result};
use nalgebra::DMatrix;

/// Reactions and gaps below this size are rounding, in units of the rod.
pub(super) const ROUNDING: f64 = 1e-10;
/// Relative curvature, in units of the rod, up to which a touch at a point has become flat.
const FLAT: f64 = 1e-9;
/// Largest lam of a pull.
const LAM: f64 = 18.0;
/// Largest residual of an answer, relative to the wrench.
const POOR: f64 = 1e-7;
/// Distance along the rod below which a closest point is the touch itself.
const SAME_TOUCH: f64 = 1e-6;
/// Length of a line that begins, and distance of a line from an end of the rod at which the line may reach the end.
const FIRST_LENGTH: f64 = 1e-3;
const NEAR_END: f64 = 0.1;
/// Places of a line at which the pressure is looked at.
const LINE_PROBES: usize = 32;
/// Changes of the set of touches at one problem before the search gives up.
const CHANGES: usize = 24;
/// The shortest step of a continuation, and that after which line contact or a corner is believed.
const SHORTEST_STEP: f64 = 1e-4;
const SHORT_STEP: f64 = 0.01;
/// Change of the base wrench against the one expected, relative, above which a step of a continuation is halved.
const FAR: f64 = 0.5;
/// Cosine between normals below which an obstacle may have changed the side of the rod, and the least step of the test
/// between both places.
const TURNED: f64 = 0.5;
const SMALL_STEP: f64 = 1e-5;
/// Depth of a rod in a withdrawn obstacle that is left free at the start.
const CLEARANCE: f64 = 1e-9;

/// Reason for which a set of touches could not be completed.
#[derive(Debug, Clone)]
pub(super) enum Halt {
    /// A touch at a point becomes a line.
    Line(Error),
    /// A touch is met at which the rod does not go on: a corner fold.
    Corner(Error),
    /// No convergence, or a limit of the method.
    Lost(Error),
}

impl Halt {
    pub(super) fn error(self) -> Error {
        let (Self::Line(why) | Self::Corner(why) | Self::Lost(why)) = self;
        why
    }
}

impl From<Error> for Halt {
    fn from(why: Error) -> Self {
        Self::Lost(why)
    }
}

/// An equilibrium with its touches; all gaps and all reactions are >= 0.
#[derive(Debug, Clone)]
pub(super) struct Settled {
    pub(super) at: Touching,
    /// Closest points, those at the touches included.
    pub(super) lows: Vec<Low>,
}

impl Settled {
    /// Closest points that are no touches.
    pub(super) fn inactive(&self) -> impl Iterator<Item = &Low> {
        self.lows.iter().filter(|low| !self.at.touches_at(low))
    }
}

impl Touching {
    /// True if the base wrench is another one than that expected: the equilibrium may be one of another branch.
    fn is_far_from(&self, expected: &Self) -> bool {
        (self.b - expected.b).norm() > FAR * (1.0 + expected.b.norm())
    }

    /// True if the closest point is one of the touches.
    pub(super) fn touches_at(&self, low: &Low) -> bool {
        (self.touches.iter()).any(|touch| {
            touch.surface == low.surface
                && low.s > touch.s - SAME_TOUCH
                && low.s < touch.to() + SAME_TOUCH
        })
    }
}

impl ContactProblem {
    /// Solves the problem: from a guess, or without one from the free rod.
    ///
    /// If the end of the rod is free, and the unloaded rod enters no obstacle, the loads grow from zero with the
    /// obstacles in their places. So the rod does not pass through a peg. Otherwise, or if that fails, the start is the
    /// free rod or the guess. All obstacles are withdrawn until the start enters none, and are put back step by step.
    ///
    /// Touches are added and released on the way. At the end all gaps and all reactions are >= 0. The path turns back
    /// at a touch whose compliance dG/dR is not positive: a corner fold. Several new touches need a P-matrix.
    ///
    /// # Errors
    /// No convergence; "line contact" where a touch at a point becomes a line; "corner fold" where the path turns back;
    /// more touches than the options allow; a held end inside an obstacle; an obstacle too thin to be withdrawn.
    pub fn solve(&self, guess: Option<&ContactGuess>) -> Result<ContactEquilibrium> {
        let Some(guess) = guess else {
            return match self.solve_by_loads() {
                Some(Ok(settled)) => self.describe(&settled, Way::Loads),
                Some(Err(why)) => self.solve_by_withdrawal(None).map_err(|_| why),
                None => self.solve_by_withdrawal(None),
            };
        };
        let guess = self.inward(guess)?;
        self.solve_by_withdrawal(Some(guess))
    }

    /// The loads grow from zero with the obstacles in place; None if the end is held, or the unloaded rod enters an
    /// obstacle.
    fn solve_by_loads(&self) -> Option<Result<Settled>> {
        let unloaded = Touching {
            b: Wrench::zeros(),
            touches: Vec::new(),
        };
        if self.problem.end.holds() || !(self.deepest(&unloaded).ok()? >= 0.0) {
            return None;
        }
        let part = |t: f64| {
            let mut part = self.clone();
            let problem = &mut part.problem;
            problem.couple *= t;
            problem.targets = problem.targets.map(|force| force * t);
            problem.weight = problem.weight.as_ref().map(|weight| weight.times(t));
            part.load = part.load.times(t);
            Ok(part)
        };
        let followed = Self::follow(part, unloaded, self.options.step);
        Some(followed.map_err(|why| {
            why.context("the loads on the rod grow from zero with the obstacles in their places")
        }))
    }

    /// The obstacles are put back from where the rod at the start enters none.
    fn solve_by_withdrawal(&self, guess: Option<Touching>) -> Result<ContactEquilibrium> {
        let start = match guess {
            Some(guess) => guess,
            None => Touching {
                b: self.rod().inward(&self.problem.solve(None)?.base),
                touches: Vec::new(),
            },
        };
        let start = self.polish(&start)?;
        let deepest = self.deepest(&start)?;
        if deepest >= -ROUNDING {
            let settled = self.settle(&start).map_err(Halt::error)?;
            return self.describe(&settled, Way::Direct);
        }
        let depth = (CLEARANCE - deepest) * self.rod().length;
        let settled = Self::follow(
            |t| {
                Ok(Self {
                    withdrawn: self.withdrawn + depth * (1.0 - t),
                    ..self.clone()
                })
            },
            start,
            self.options.step,
        )
        .map_err(|why| {
            why.context(format!(
                "the rod at the start enters an obstacle by {:.6e}, and putting the obstacles back in their places failed",
                -deepest * self.rod().length
            ))
        })?;
        self.describe(&settled, Way::Obstacles)
    }

    /// Follows problems from t = 0, where `start` is near an equilibrium, to t = 1, in steps of `step` at most.
    ///
    /// # Errors
    /// As [`ContactProblem::solve`]; those of `at`.
    pub fn solve_along(
        at: impl Fn(f64) -> Result<Self>,
        start: &ContactGuess,
        step: f64,
    ) -> Result<ContactEquilibrium> {
        let first = at(0.0)?.inward(start)?;
        let settled = Self::follow(&at, first, step)?;
        at(1.0)?.describe(&settled, Way::Given)
    }

    fn follow(at: impl Fn(f64) -> Result<Self>, start: Touching, longest: f64) -> Result<Settled> {
        let first = at(0.0)?;
        let mut here = first.settle(&start).map_err(Halt::error)?;
        let (mut t, mut step) = (0.0, longest.min(0.25));
        let mut before: Option<(f64, Touching)> = None;
        while t < 1.0 {
            let next = if t + step > 1.0 - 1e-9 { 1.0 } else { t + step };
            let problem = at(next)?;
            let guess = problem.extrapolated(before.as_ref(), (t, &here.at), next);
            let settled = problem.settle(&guess).and_then(|found| {
                match problem.passes_through(&here.lows, &found.lows) {
                    None if step > SHORT_STEP && found.at.is_far_from(&guess) => Err(Halt::Lost(
                        Error::no_convergence("the rod would snap to another shape"),
                    )),
                    None => Ok(found),
                    Some(surface) => Err(Halt::Lost(Error::unreachable(format!(
                        "the rod would snap past obstacle {}",
                        surface + 1
                    )))),
                }
            });
            match settled {
                Ok(found) => {
                    before = Some((t, here.at));
                    (t, here) = (next, found);
                    step = (2.0 * step).min(longest);
                }
                Err(Halt::Line(_) | Halt::Corner(_)) if step > SHORT_STEP => step *= 0.5,
                Err(Halt::Lost(_)) if step > SHORTEST_STEP => step *= 0.5,
                Err(why) => {
                    return Err(why.error().context(format!("at {:.4} of the way", next)));
                }
            }
        }
        Ok(here)
    }

    /// The unknowns ahead, along the secant of the last two.
    fn extrapolated(
        &self,
        before: Option<&(f64, Touching)>,
        (t, here): (f64, &Touching),
        next: f64,
    ) -> Touching {
        let Some((earlier, from)) = before else {
            return here.clone();
        };
        let alike = from.touches.len() == here.touches.len()
            && (from.touches.iter().zip(&here.touches))
                .all(|(a, b)| a.surface == b.surface && a.has() == b.has());
        if !alike {
            return here.clone();
        }
        let (x, y) = (self.unknowns(from), self.unknowns(here));
        let ahead = &y + (&y - x) * ((next - t) / (t - earlier));
        self.touching(&ahead, &here.touches)
            .unwrap_or_else(|_| here.clone())
    }

    /// A guess in the units of the rod.
    ///
    /// # Errors
    /// A surface that does not exist; a place beyond the rod; a touch of an end that is held.
    pub(super) fn inward(&self, guess: &ContactGuess) -> Result<Touching> {
        let (length, unit) = (self.rod().length, self.rod().units().1);
        let mut touches = Vec::with_capacity(guess.touches.len());
        for touch in &guess.touches {
            if touch.surface >= self.surfaces.len() {
                return Err(Error::domain(format!(
                    "a touch of the guess names surface {}; there are {}, counted from 0",
                    touch.surface,
                    self.surfaces.len()
                )));
            }
            let s = touch.s.map_or(1.0, |s| s / length);
            let line = (touch.length > 0.0).then(|| Line::over(s, touch.length / length));
            let least = if line.is_some() {
                0.0
            } else {
                f64::MIN_POSITIVE
            };
            if touch.s.is_some() && !(s >= least && s < 1.0) {
                return Err(Error::domain(format!(
                    "a touch of the guess is at s/L = {s}; it must be between the clamp, 0, and the end, 1"
                )));
            }
            if touch.s.is_none() && !self.end_is_free() {
                return Err(Error::domain(
                    "a touch of the guess is at the end, whose place is held; give its arclength",
                ));
            }
            touches.push(ScaledTouch {
                surface: touch.surface,
                s,
                at_end: touch.s.is_none(),
                reaction: touch.reaction / unit,
                line,
            });
        }
        Ok(Touching {
            b: self.rod().inward(&guess.base),
            touches,
        })
    }

    /// True if no component of the end's place is held: the end itself can then be pushed by an obstacle.
    pub(super) fn end_is_free(&self) -> bool {
        self.problem.end.position.iter().all(Option::is_none)
    }

    /// The least gap apart from the touches; infinite without a closest point.
    fn deepest(&self, at: &Touching) -> Result<f64> {
        let lows = self.lows(&self.shape_of(&at.b, &at.touches)?)?;
        let inactive = lows.iter().filter(|low| !at.touches_at(low));
        Ok(inactive.fold(f64::INFINITY, |least, low| least.min(low.gap)))
    }

    /// True if a surface has changed the side of the rod between two equilibria: its normal at the closest point has
    /// turned, and it lies between both places of the closest point.
    fn passes_through(&self, before: &[Low], after: &[Low]) -> Option<usize> {
        after.iter().find_map(|low| {
            let alike = before.iter().filter(|old| old.surface == low.surface);
            let old = alike.min_by(|a, b| {
                let apart = |old: &&Low| (old.s - low.s).abs();
                apart(a).total_cmp(&apart(b))
            })?;
            if old.normal.dot(&low.normal) > TURNED {
                return None;
            }
            let (way, mut part) = (low.r - old.r, 0.0);
            // The gap is Lipschitz: no obstacle is within its distance.
            while part < 1.0 {
                let gap = self.gap(low.surface, &(old.r + way * part)).value;
                if gap < -ROUNDING {
                    return Some(low.surface);
                }
                part += gap.max(SMALL_STEP) / way.norm().max(SMALL_STEP);
            }
            None
        })
    }

    /// The equilibrium near a guess, with touches added where the rod enters an obstacle, and released where they pull.
    pub(super) fn settle(&self, guess: &Touching) -> Result<Settled, Halt> {
        let mut guess = guess.clone();
        self.refuse_pull(&guess.b)?;
        for _ in 0..CHANGES {
            let polished = self.polish(&guess);
            // A gap between clamp and line closes as the fourth power of its length: it is rounding long before.
            let longer = self.with_longer_lines(polished.as_ref().unwrap_or(&guess))?;
            let at = match longer.map(|longer| self.polish(&longer)) {
                Some(Ok(longer)) if self.ends_as_held(&longer)? => longer,
                _ => polished?,
            };
            let size = 1.0 + at.b.norm();
            let pulling = (0..at.touches.len())
                .filter(|i| {
                    at.touches[*i].line.is_none() && at.touches[*i].reaction < -ROUNDING * size
                })
                .min_by(|i, j| {
                    let reaction = |i: &usize| at.touches[*i].reaction;
                    reaction(i).total_cmp(&reaction(j))
                });
            if let Some(i) = pulling {
                guess = at;
                guess.touches.remove(i);
                continue;
            }
            let shape = self.shape_of(&at.b, &at.touches)?;
            let stations = self.stations(&at, &shape)?;
            if let Some(moved) = self.without_slid_end(&at, &stations)? {
                guess = moved;
                continue;
            }
            if let Some(changed) = self.with_lines(&at, &stations) {
                guess = changed;
                continue;
            }
            self.refuse_pulling_lines(&at, &shape, &stations)?;
            let lows = self.lows(&shape)?;
            let entered = lows.iter().filter(|low| !at.touches_at(low));
            let entered: Vec<Low> = (entered.copied())
                .filter(|low| low.gap < -ROUNDING)
                .collect();
            if entered.is_empty() {
                return Ok(Settled { at, lows });
            }
            guess = self.with_touches(&at, &entered)?;
        }
        Err(Halt::Lost(Error::no_convergence(
            "touches are added and released in turn without end; start from a guess, or approach in smaller steps",
        )))
    }

    /// Refuses a pull under which an error at the clamp, which grows as exp(lam), hides the touches.
    fn refuse_pull(&self, b: &Wrench) -> Result<()> {
        let [first, second] = self.rod().law.flexures();
        let lam = (b[5].max(0.0) * first.max(second)).sqrt();
        if lam < LAM {
            return Ok(());
        }
        Err(Error::ill_conditioned(format!(
            "the clamp pulls the rod with lam = sqrt(F L^2/B) = {lam:.1}: rods that touch obstacles are solved from their clamp, where an \
             error grows as exp(lam), up to lam = {LAM}; lower the pull, or shorten the rod"
        )))
    }

    /// The touches with a touch at the end moved along the rod, if the gap there falls inwards.
    fn without_slid_end(
        &self,
        at: &Touching,
        stations: &Stations,
    ) -> Result<Option<Touching>, Halt> {
        let mut moved = at.clone();
        for (touch, (section, gap)) in moved.touches.iter_mut().zip(&stations.at) {
            let slope = section.slope(gap);
            if touch.at_end && slope > ROUNDING {
                let curvature = section.relative_curvature(gap);
                if curvature > FLAT {
                    touch.at_end = false;
                    touch.s = 1.0 - (slope / curvature).clamp(1e-6, 0.5);
                } else if self.is_planar() {
                    *touch = touch.as_line_to_end(FIRST_LENGTH);
                } else {
                    return Err(self.line_contact(touch));
                }
                return Ok(Some(moved));
            }
        }
        Ok(None)
    }

    /// The touches with a flat point made a line, or a line of negative length made a point; None if there is none.
    fn with_lines(&self, at: &Touching, stations: &Stations) -> Option<Touching> {
        let mut changed = at.clone();
        for (touch, (section, gap)) in changed.touches.iter_mut().zip(&stations.at) {
            match touch.line {
                None if touch.at_end => {}
                None if section.relative_curvature(gap) > FLAT => {}
                None => {
                    *touch = touch.as_line(section.n.dot(&gap.normal), FIRST_LENGTH);
                    return Some(changed);
                }
                Some(line) if line.length < -SAME_TOUCH => {
                    touch.reaction += section.n.dot(&gap.normal);
                    touch.line = None;
                    return Some(changed);
                }
                Some(_) => {}
            }
        }
        None
    }

    /// The touches with a line near an end of the rod made one that begins at the clamp, or goes on to the end. The
    /// clamp has to lie along the surface.
    pub(super) fn with_longer_lines(&self, at: &Touching) -> Result<Option<Touching>> {
        let clamp = self.loaded().clamp(&at.b)?;
        let mut longer = at.clone();
        for touch in &mut longer.touches {
            let Some(line) = &mut touch.line else {
                continue;
            };
            let gap = self.gap(touch.surface, &clamp.r);
            let lies =
                gap.value.abs() < HELD_DEPTH.max(ROUNDING) && clamp.slope(&gap).abs() < ROUNDING;
            let to = touch.s + line.length;
            if !line.from_clamp && touch.s < NEAR_END && lies {
                *line = Line {
                    length: to,
                    from_clamp: true,
                    ..*line
                };
                touch.s = 0.0;
                return Ok(Some(longer));
            }
            if !line.to_end && to > 1.0 - NEAR_END {
                *line = Line {
                    length: 1.0 - touch.s,
                    to_end: true,
                    ..*line
                };
                touch.reaction = 0.0;
                return Ok(Some(longer));
            }
        }
        Ok(None)
    }

    /// Refuses a line whose end would pull, whose surface would have to pull, or whose rod would not end as it is held.
    fn refuse_pulling_lines(
        &self,
        at: &Touching,
        shape: &TouchedSteps<'_>,
        stations: &Stations,
    ) -> Result<(), Halt> {
        let size = 1.0 + at.b.norm();
        let length = self.rod().length;
        let mut lying = shape.lying();
        for (touch, (section, gap)) in at.touches.iter().zip(&stations.at) {
            let (Some(line), Some(stretch)) = (touch.line, lying.next()) else {
                continue;
            };
            let before = if line.from_clamp {
                0.0
            } else {
                section.n.dot(&gap.normal)
            };
            let least = (0..=LINE_PROBES)
                .map(|k| {
                    stretch.pressure(
                        shape.load(),
                        stretch.from + (stretch.to - stretch.from) * k as f64 / LINE_PROBES as f64,
                    )
                })
                .fold(f64::INFINITY, f64::min);
            let why = if before < -ROUNDING * size || touch.reaction < -ROUNDING * size {
                "an end of the line would have to pull"
            } else if least < -ROUNDING * size {
                "the surface would have to pull between the ends of the line"
            } else if !(self
                .gap(touch.surface, &shape.section(touch.to())?.r)
                .value
                .abs()
                < 1e-9)
            {
                "the line would go over an edge of the obstacle"
            } else {
                continue;
            };
            return Err(Halt::Line(Error::unreachable(format!(
                "line contact: the rod lies along obstacle {} from s = {:.6} to {:.6}, and {why}; such states are not solved here",
                touch.surface + 1,
                touch.s * length,
                touch.to() * length
            ))));
        }
        if !self.ends_as_held(at)? {
            return Err(Halt::Line(Error::unreachable(
                "line contact: the rod would lie along an obstacle up to its end, which is held, or loaded by a couple, otherwise",
            )));
        }
        Ok(())
    }

    fn line_contact(&self, touch: &ScaledTouch) -> Halt {
        Halt::Line(Error::unreachable(format!(
            "line contact: the touch of obstacle {} at s = {:.6} has lost its relative curvature, and the rod would lie along the obstacle \
             outside of a plane of symmetry; only rods in a plane lie on obstacles",
            touch.surface + 1,
            touch.s * self.rod().length
        )))
    }

    /// True unless the rod lies on a surface up to its end, and misses the turn, the place or the couple there that the
    /// end condition gives. A force across the surface is borne by the surface.
    fn ends_as_held(&self, at: &Touching) -> Result<bool> {
        if !at.touches.iter().any(ScaledTouch::goes_on_to_end) {
            return Ok(true);
        }
        let end = self.shape_of(&at.b, &at.touches)?.section(1.0)?;
        let misses = (self.problem).residual(&Trial::bare(end.r, end.rotation, end.m, end.n));
        let placed = self.end_is_free() || misses.fixed_rows::<3>(3).norm() < ROUNDING.sqrt();
        Ok(placed && misses.fixed_rows::<3>(0).norm() < ROUNDING.sqrt())
    }

    /// The touches with those where the rod has entered an obstacle.
    fn with_touches(&self, at: &Touching, entered: &[Low]) -> Result<Touching, Halt> {
        let old = at
            .touches
            .iter()
            .filter(|touch| touch.line.is_none())
            .count();
        if at.touches.len() + entered.len() > self.options.max_touches {
            return Err(Halt::Lost(Error::domain(format!(
                "the rod would touch at {} places, more than max_touches = {} allows; raise the limit, or use a barrier",
                at.touches.len() + entered.len(),
                self.options.max_touches
            ))));
        }
        let mut more = at.clone();
        for low in entered {
            if low.at_end && !self.end_is_free() {
                return Err(Halt::Lost(Error::unreachable(format!(
                    "the held end lies inside obstacle {}, by {:.6e}; hold it elsewhere, or move the obstacle",
                    low.surface + 1,
                    -low.gap * self.rod().length
                ))));
            }
            more.touches.push(ScaledTouch {
                surface: low.surface,
                s: low.s,
                at_end: low.at_end,
                reaction: 0.0,
                line: None,
            });
        }
        let beneath = self.compliance(&self.balanced(&more)?.jacobian, &more.touches)?;
        if !is_p_matrix(&schur(&beneath, old)) {
            let low = entered[0];
            return Err(Halt::Corner(Error::unreachable(format!(
                "corner fold: at the touch of obstacle {} at s = {:.6} a reaction would not open the gap (dG/dR is not positive), so that the \
                 path turns back; follow a branch around it, or start from a guess beyond",
                low.surface + 1,
                low.s * self.rod().length
            ))));
        }
        Ok(more)
    }

    /// dG_i/dR_j at held end condition, from the derivatives of the equations. The places of the touches follow.
    ///
    /// # Errors
    /// A rod that is at a fold with its touches set free.
    pub(super) fn compliance(
        &self,
        jacobian: &DMatrix<f64>,
        touches: &[ScaledTouch],
    ) -> Result<DMatrix<f64>> {
        let unknowns: usize = touches.iter().map(ScaledTouch::unknowns).sum();
        let equations: usize = touches.iter().map(ScaledTouch::equations).sum();
        let mut column = jacobian.ncols() - unknowns;
        let mut row = jacobian.nrows() - equations;
        // Gap and reaction of the points; lines stay.
        let (mut own_rows, mut own) = (Vec::new(), Vec::new());
        for touch in touches {
            if touch.line.is_none() {
                own_rows.push(row);
                own.push(column);
            }
            column += touch.unknowns();
            row += touch.equations();
        }
        let without = |own: &[usize]| -> Vec<usize> {
            (0..jacobian.ncols()).filter(|i| !own.contains(i)).collect()
        };
        let (rest_rows, rest) = (without(&own_rows), without(&own));
        let part = |rows: &[usize], columns: &[usize]| {
            DMatrix::from_fn(rows.len(), columns.len(), |i, j| {
                jacobian[(rows[i], columns[j])]
            })
        };
        let solved = part(&rest_rows, &rest)
            .lu()
            .solve(&part(&rest_rows, &own))
            .ok_or_else(|| {
                Error::ill_conditioned("the rod is at a fold with its touches set free")
            })?;
        Ok(part(&own_rows, &own) - part(&own_rows, &rest) * solved)
    }

    pub(super) fn describe(&self, settled: &Settled, way: Way) -> Result<ContactEquilibrium> {
        self.described(settled, way, None)
    }

    /// The equilibrium in the world, with the given index if it is known.
    pub(super) fn described(
        &self,
        settled: &Settled,
        way: Way,
        index: Option<Index>,
    ) -> Result<ContactEquilibrium> {
        let at = &settled.at;
        let rod = self.rod();
        let (couple, force) = rod.units();
        let balanced = self.balanced(at)?;
        let residual = balanced.residual.norm();
        if !(residual < POOR * (1.0 + at.b.norm())) {
            return Err(Error::ill_conditioned(format!(
                "the best base wrench that double precision holds misses the end condition or a touch by {residual:.1e} (in L, B/L, \
                 B/L^2): the rod is pulled too hard, or too long; rods that touch obstacles are solved from their clamp only"
            )));
        }
        let shape = self.shape_of(&at.b, &at.touches)?;
        let stations = self.stations(at, &shape)?;
        let (state, b) = shape.state(1.0)?;
        let mut end = rod.outward(&state, &b, &self.load)?;
        let turn = rod.clamp.rotation;
        let mut touches = Vec::with_capacity(at.touches.len());
        let mut lying = shape.lying();
        for (touch, (section, gap)) in at.touches.iter().zip(&stations.at) {
            let normal = turn * gap.normal;
            if touch.at_end {
                end.force -= normal * (touch.reaction * force);
            }
            let lies = touch.line.and_then(|line| {
                let stretch = lying.next()?;
                let before = if line.from_clamp {
                    0.0
                } else {
                    section.n.dot(&gap.normal)
                };
                Some(TouchLine {
                    length: (stretch.to - stretch.from) * rod.length,
                    at_start: before * force,
                    at_end: touch.reaction * force,
                    pressed: stretch.pressed(shape.load()) * force,
                })
            });
            touches.push(TouchPoint {
                surface: touch.surface,
                s: touch.s * rod.length,
                at_end: touch.at_end,
                reaction: lies.map_or(touch.reaction * force, |line| {
                    line.at_start + line.at_end + line.pressed
                }),
                line: lies,
                position: rod.clamp.translation.vector + turn * section.r * rod.length,
                normal,
                relative_curvature: section.relative_curvature(gap) / rod.length,
                feature: gap.feature,
            });
        }
        let compliance = self.compliance(&balanced.jacobian, &at.touches);
        let mut order: Vec<usize> = (0..touches.len()).collect();
        order.sort_by(|i, j| touches[*i].s.total_cmp(&touches[*j].s));
        let points = order.iter().filter(|i| touches[**i].line.is_none());
        let before = |i: &usize| {
            touches[..*i]
                .iter()
                .filter(|touch| touch.line.is_none())
                .count()
        };
        let own: Vec<usize> = points.map(before).collect();
        let count = own.len();
        let compliance = compliance.map_or_else(
            |_| DMatrix::from_element(count, count, f64::INFINITY),
            |c| {
                DMatrix::from_fn(count, count, |i, j| {
                    c[(own[i], own[j])] * rod.length / force
                })
            },
        );
        let has_line = at.touches.iter().any(|touch| touch.line.is_some());
        let index = match index {
            Some(known) => Some(known),
            None if has_line => None,
            None => Some(self.index_of(at)?),
        };
        let least = (settled.inactive()).fold(f64::INFINITY, |least, low| least.min(low.gap));
        Ok(ContactEquilibrium {
            base: rod.outward_wrench(&at.b),
            end,
            touches: order.iter().map(|i| touches[*i]).collect(),
            min_gap: least * rod.length,
            potential: self.load.potential(shape.work) * couple,
            index: index.map(|index| index.held),
            index_released: index.map(|index| index.released),
            neutral: index.map_or(0, |index| index.neutral),
            compliance,
            residual,
            way,
        })
    }
}

/// The compliance of the last rows with the first `old` gaps held.
fn schur(compliance: &DMatrix<f64>, old: usize) -> DMatrix<f64> {
    let new = compliance.nrows() - old;
    let part = |i: usize, j: usize, rows: usize, columns: usize| {
        compliance.view((i, j), (rows, columns)).into_owned()
    };
    let own = part(old, old, new, new);
    if old == 0 {
        return own;
    }
    match part(0, 0, old, old).lu().solve(&part(0, old, old, new)) {
        Some(solved) => own - part(old, 0, new, old) * solved,
        None => DMatrix::from_element(new, new, f64::NAN),
    }
}

/// True if all principal minors are positive: then every right-hand side has one answer of gaps and reactions.
pub(super) fn is_p_matrix(matrix: &DMatrix<f64>) -> bool {
    let count = matrix.nrows();
    (1_u32..1 << count).all(|set| {
        let chosen: Vec<usize> = (0..count).filter(|i| set >> i & 1 == 1).collect();
        let minor = DMatrix::from_fn(chosen.len(), chosen.len(), |i, j| {
            matrix[(chosen[i], chosen[j])]
        });
        minor.determinant() > 0.0
    })
}
