//! Branches of equilibria with touches in one parameter: through touch, release and corner folds.
//!
//! Between two events the set of touches is fixed, and the branch is a smooth one of `arclength`. Its test function is
//! the least of all reactions, of the gaps at closest points that are no touches, and of the relative curvatures. At a
//! root the set changes. The new sheet begins at the same equilibrium; the branch goes on to that side of it where the
//! new reaction, or the new gap, grows. If the parameter then moves the other way the crease is a corner fold.

use super::active_set::{ROUNDING, Settled};
use super::equations::Touching;
use super::index::Index;
use super::{ContactEquilibrium, ContactGuess, ContactProblem, ScaledTouch, Way};
use crate::error::{Error, Result};
use crate::solve::arclength::{BranchStart, Continuation, Item, Options, Point, Stop};
use crate::solve::lagrange::lagrange;
use crate::solve::parametrised_problem::{Family, Linearised};
use crate::solve::special_points::SpecialKind;
use nalgebra::{DMatrix, DVector};

/// Length of the first step onto a new sheet: beyond the noise of its reaction, far below any step.
const ASIDE: f64 = 1e-6;
/// Step of the differences by the parameter, over its range.
const DIFFERENCE: f64 = 1e-6;
/// Relative curvature, over 1 + |b|, at which a special point is the beginning of line contact.
const FLAT: f64 = 1e-4;
/// Points from which the beginning of line contact is interpolated, and their distance over the range of the parameter.
const NODES: usize = 8;
const NODE_STEP: f64 = 4e-3;
/// Distance of a touch from an end of the rod, over its length, at which the touch is about to leave the rod.
const NEAR_END: f64 = 1e-4;
/// Distance of a line from an end of the rod at which the line counts as having reached the end.
const REACHED: f64 = 1e-6;
/// Singular value, over the largest, up to which a direction of the equations counts as free.
const RANK: f64 = 1e-9;
/// Most events of a branch.
const MOST_EVENTS: usize = 200;

/// A point of a branch.
#[derive(Debug, Clone, PartialEq)]
pub struct ContactBranchPoint {
    /// The parameter.
    pub p: f64,
    /// Length of the branch from its start, in the unknowns and the parameter.
    pub arclength: f64,
    /// The equilibrium.
    pub equilibrium: ContactEquilibrium,
}

/// Kind of an event on a branch.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum ContactEventKind {
    /// A gap closes.
    Touch,
    /// A reaction falls to zero.
    Release,
    /// The touch of the free end begins to slide along the rod.
    EndSlides,
    /// Line contact begins: the relative curvature of a touch is zero. In space the branch ends.
    Line,
    /// A line shrinks to a point.
    Point,
    /// The start or the end of a line, or the surface between, would have to pull. The branch ends.
    LineLifts,
    /// A line reaches the clamp, which lies along the surface, or the end of the rod.
    LineAtEnd,
    /// A touch arrives at an end of the rod: the rod slips off, or is held there. The branch ends here. The place is as
    /// exact as the shortest step of the branch.
    SlipOff,
    /// The parameter turns back at a touch or at a release; follows that event.
    Corner,
    /// The parameter turns back on a smooth sheet.
    Fold,
    /// A second branch crosses.
    BranchPoint,
    /// The index changes otherwise.
    StabilityChange,
}

impl ContactEventKind {
    /// "touch", "release", "end_slides", "line", "point", "line_lifts", "line_at_end", "slip_off", "corner", "fold",
    /// "branch_point" or "stability_change".
    pub fn as_str(self) -> &'static str {
        match self {
            Self::Touch => "touch",
            Self::Release => "release",
            Self::EndSlides => "end_slides",
            Self::Line => "line",
            Self::Point => "point",
            Self::LineLifts => "line_lifts",
            Self::LineAtEnd => "line_at_end",
            Self::SlipOff => "slip_off",
            Self::Corner => "corner",
            Self::Fold => "fold",
            Self::BranchPoint => "branch_point",
            Self::StabilityChange => "stability_change",
        }
    }
}

/// An event on a branch.
#[derive(Debug, Clone, PartialEq)]
pub struct ContactEvent {
    /// Kind.
    pub kind: ContactEventKind,
    /// Number of the surface; None for events of the rod alone.
    pub surface: Option<usize>,
    /// Arclength along the rod of the touch concerned.
    pub s: Option<f64>,
    /// The point of the branch, with the touches before the event.
    pub point: ContactBranchPoint,
    /// Index before and after; None where unknown, or where the branch ends.
    pub index: (Option<usize>, Option<usize>),
}

/// A branch, with the reason for its end.
#[derive(Debug, Clone, PartialEq)]
pub struct ContactBranch {
    /// Points in order.
    pub points: Vec<ContactBranchPoint>,
    /// Events in order.
    pub events: Vec<ContactEvent>,
    /// Reason for the end.
    pub stop: ContactStop,
}

/// Reason for the end of a branch.
#[derive(Debug, Clone, PartialEq)]
pub enum ContactStop {
    /// As of a branch without touches.
    Smooth(Stop),
    /// The last event ends the branch: line contact, or a touch at an end of the rod.
    Event(ContactEventKind),
    /// More events than a branch may have.
    TooManyEvents,
    /// The next equilibrium has too few digits; the text says why.
    Lost(String),
}

impl std::fmt::Display for ContactStop {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        match self {
            Self::Smooth(stop) => stop.fmt(f),
            Self::Event(ContactEventKind::Line) => {
                f.write_str(
                    "line contact begins: beyond, the rod would lie along an obstacle, in space or in neutral balance",
                )
            }
            Self::Event(ContactEventKind::LineLifts) => {
                f.write_str("a rod that lies along an obstacle lifts off within the line")
            }
            Self::Event(_) => f.write_str("a touch has arrived at an end of the rod"),
            Self::Lost(why) => f.write_str(why),
            Self::TooManyEvents => write!(f, "the branch has more than {MOST_EVENTS} events"),
        }
    }
}

/// Equilibria with a given set of touches, by the parameter.
struct TouchedFamily<'a, F> {
    at: &'a F,
    kind: Vec<ScaledTouch>,
    /// Number of unknowns of the base wrench.
    wrench: usize,
    step: f64,
}

/// The least of the quantities that are positive on a sheet.
#[derive(Debug, Clone, Copy)]
struct Bound {
    kind: ContactEventKind,
    surface: usize,
    s: f64,
    /// Number of the touch, or of the closest point.
    number: usize,
    value: f64,
}

impl<F: Fn(f64) -> Result<ContactProblem>> TouchedFamily<'_, F> {
    fn residual(&self, x: &DVector<f64>, p: f64) -> Result<DVector<f64>> {
        let problem = (self.at)(p)?;
        let at = problem.touching(x, &self.kind)?;
        let stations = problem.stations(&at, &problem.shape_of(&at.b, &at.touches)?)?;
        problem.residual(&at.touches, &stations)
    }

    fn settled(&self, x: &DVector<f64>, p: f64) -> Result<(ContactProblem, Settled)> {
        let problem = (self.at)(p)?;
        let at = problem.touching(x, &self.kind)?;
        let lows = problem.lows(&problem.shape_of(&at.b, &at.touches)?)?;
        Ok((problem, Settled { at, lows }))
    }

    /// The least of the quantities that are positive on the sheet.
    fn bound(&self, x: &DVector<f64>, p: f64) -> Result<Option<Bound>> {
        let problem = (self.at)(p)?;
        let at = problem.touching(x, &self.kind)?;
        let shape = problem.shape_of(&at.b, &at.touches)?;
        let stations = problem.stations(&at, &shape)?;
        let lows = problem.lows(&shape)?;
        let size = 1.0 + at.b.norm();
        let is_free = problem.end_is_free();
        let mut bounds = Vec::new();
        let touches = at.touches.iter().zip(&stations.at);
        for (number, (touch, (section, gap))) in touches.enumerate() {
            let mut add = |kind, value| {
                bounds.push(Bound {
                    kind,
                    surface: touch.surface,
                    s: touch.s,
                    number,
                    value,
                });
            };
            let Some(line) = touch.line else {
                add(ContactEventKind::Release, touch.reaction / size);
                if touch.at_end {
                    add(ContactEventKind::EndSlides, -section.slope(gap));
                } else {
                    add(
                        ContactEventKind::Line,
                        section.relative_curvature(gap) / size,
                    );
                }
                continue;
            };
            let mut least = f64::INFINITY;
            if !line.from_clamp {
                least = least.min(gap.normal.dot(&section.n));
                add(ContactEventKind::LineAtEnd, touch.s - REACHED);
            }
            if !line.to_end {
                least = least.min(touch.reaction);
                add(ContactEventKind::Point, line.length);
                add(ContactEventKind::LineAtEnd, 1.0 - REACHED - touch.to());
            } else if !line.from_clamp {
                add(ContactEventKind::Point, 1.0 - REACHED - touch.s);
            }
            if least.is_finite() {
                add(ContactEventKind::LineLifts, least / size);
            }
        }
        for (number, low) in lows.iter().enumerate() {
            if !at.touches_at(low) && (is_free || !low.at_end) {
                bounds.push(Bound {
                    kind: ContactEventKind::Touch,
                    surface: low.surface,
                    s: low.s,
                    number,
                    value: low.gap,
                });
            }
        }
        Ok(bounds
            .into_iter()
            .min_by(|a, b| a.value.total_cmp(&b.value)))
    }

    /// True if a touch is about to lose its relative curvature.
    fn is_flat(&self, point: &Point) -> Result<bool> {
        let bound = self.bound(&point.x, point.p)?;
        let flat = |bound: Bound| bound.kind == ContactEventKind::Line && bound.value.abs() < FLAT;
        Ok(bound.is_some_and(flat))
    }

    /// The point where the relative curvature of touch `number` is zero, near `point`: the equations are singular
    /// there, and so unknowns and parameter are interpolated in the curvature from points before. `passed` are points
    /// of the sheet.
    fn line_start(
        &self,
        passed: &[(DVector<f64>, f64)],
        point: &Point,
        number: usize,
    ) -> Result<Point> {
        let step = -point.tangent_p.signum() * NODE_STEP * self.step / DIFFERENCE;
        let mut curvatures = [0.0; NODES];
        let mut values = Vec::with_capacity(NODES);
        let lost = || Error::no_convergence("the touch that becomes a line is lost");
        let regular = passed
            .iter()
            .rev()
            .find(|(_, p)| (p - point.p).abs() > step.abs());
        let (x, p) = regular.ok_or_else(lost)?;
        let mut guess = (self.at)(*p)?.touching(x, &self.kind)?;
        for (k, curvature) in curvatures.iter_mut().enumerate() {
            let p = point.p + step * (NODES - k) as f64;
            let problem = (self.at)(p)?;
            guess = problem.polish(&guess)?;
            let shape = problem.shape_of(&guess.b, &guess.touches)?;
            let found = problem.stations(&guess, &shape)?;
            let (section, gap) = found.at.get(number).ok_or_else(lost)?;
            *curvature = section.relative_curvature(gap);
            values.push((problem.unknowns(&guess), p));
        }
        let mut found = Point {
            x: DVector::zeros(point.x.len()),
            p: 0.0,
            ..point.clone()
        };
        for ((x, p), weight) in values.iter().zip(lagrange(&curvatures, 0.0)) {
            found.x += x * weight;
            found.p += p * weight;
        }
        Ok(found)
    }

    /// The unit tangent (dx, dp), of either sense. None if the equations leave more than one direction.
    fn tangent(&self, x: &DVector<f64>, p: f64) -> Result<Option<DVector<f64>>> {
        let at = self.linearised(x, p)?;
        let n = x.len();
        let mut matrix = DMatrix::zeros(n + 1, n + 1);
        matrix.view_mut((0, 0), (n, n)).copy_from(&at.jacobian);
        matrix.view_mut((0, n), (n, 1)).copy_from(&at.slope);
        let svd = matrix.svd(false, true);
        let least = svd.singular_values.imin();
        let free = RANK * svd.singular_values.max();
        if svd
            .singular_values
            .iter()
            .filter(|value| **value <= free)
            .count()
            > 1
        {
            return Ok(None);
        }
        let rows = svd
            .v_t
            .ok_or_else(|| Error::no_convergence("the branch has no direction at its crease"))?;
        Ok(Some(rows.row(least).transpose()))
    }
}

impl ContactProblem {
    /// The touches beyond an event of touch `number`: a point becomes a line, a line a point, or a line goes on to an
    /// end of the rod. None if the branch ends there.
    fn beyond(
        &self,
        at: &Touching,
        kind: ContactEventKind,
        number: usize,
    ) -> Result<Option<Touching>> {
        let mut beyond = at.clone();
        let shape = self.shape_of(&at.b, &at.touches)?;
        let stations = self.stations(at, &shape)?;
        let (Some(touch), Some((section, gap))) =
            (beyond.touches.get_mut(number), stations.at.get(number))
        else {
            return Ok(None);
        };
        let before = gap.normal.dot(&section.n);
        match (kind, touch.line) {
            (ContactEventKind::Line, None) if self.is_planar() => {
                *touch = touch.as_line(before, 0.0)
            }
            (ContactEventKind::EndSlides, None) if section.relative_curvature(gap) > ROUNDING => {
                touch.at_end = false;
                touch.s = 1.0 - ROUNDING;
            }
            (ContactEventKind::EndSlides, None) if self.is_planar() => {
                *touch = touch.as_line_to_end(ROUNDING);
            }
            (ContactEventKind::Point, Some(line)) if line.from_clamp => {
                // The clamp takes over the reaction at the end of the line.
                let mut force = beyond.b.fixed_rows_mut::<3>(3);
                force -= gap.normal * touch.reaction;
                beyond.touches.remove(number);
            }
            (ContactEventKind::Point, Some(line)) => {
                touch.reaction += before;
                touch.line = None;
                touch.at_end = line.to_end;
                if line.to_end {
                    touch.s = 1.0;
                }
            }
            (ContactEventKind::LineAtEnd, Some(_)) => return self.with_longer_lines(at),
            _ => return Ok(None),
        }
        Ok(Some(beyond))
    }
}

impl<F: Fn(f64) -> Result<ContactProblem>> Family for TouchedFamily<'_, F> {
    fn size(&self) -> usize {
        self.wrench + self.kind.iter().map(ScaledTouch::unknowns).sum::<usize>()
    }

    fn linearised(&self, x: &DVector<f64>, p: f64) -> Result<Linearised> {
        let problem = (self.at)(p)?;
        let found = problem.balanced(&problem.touching(x, &self.kind)?)?;
        let h = self.step;
        let slope = match (self.residual(x, p + h), self.residual(x, p - h)) {
            (Ok(after), Ok(before)) => (after - before) / (2.0 * h),
            (Ok(after), Err(_)) => (after - &found.residual) / h,
            (Err(_), Ok(before)) => (&found.residual - before) / h,
            (Err(why), Err(_)) => return Err(why),
        };
        Ok(Linearised {
            residual: found.residual,
            jacobian: found.jacobian,
            slope,
        })
    }

    fn index(&self, x: &DVector<f64>, p: f64) -> Result<Option<usize>> {
        if self.kind.iter().any(|touch| touch.line.is_some()) {
            return Ok(None);
        }
        let problem = (self.at)(p)?;
        let at = problem.touching(x, &self.kind)?;
        Ok(Some(problem.index_of(&at)?.held))
    }

    fn event(&self, x: &DVector<f64>, p: f64, _: &DVector<f64>, _: f64) -> Result<Option<f64>> {
        Ok(self.bound(x, p)?.map(|bound| bound.value))
    }
}

/// A branch being followed, sheet by sheet.
struct Follower<'a, F> {
    at: &'a F,
    options: Options,
    wrench: usize,
    step: f64,
    /// Length of the sheets before.
    before: f64,
    branch: ContactBranch,
}

/// The sheet that follows, or the end.
enum Next {
    Sheet(Vec<ScaledTouch>, BranchStart),
    End(ContactStop),
}

impl ContactBranch {
    /// The branch of `at(p)` through the equilibrium near `start` at `p`; the range of p, its sense and the steps are
    /// those of `options`.
    ///
    /// The plane of the problem, and the numbers of the surfaces, must be the same for every p.
    ///
    /// # Errors
    /// Options outside their sets; no equilibrium near `start`, or one that enters an obstacle; a start at a fold; an
    /// error of `at`.
    pub fn follow(
        at: impl Fn(f64) -> Result<ContactProblem>,
        start: &ContactGuess,
        p: f64,
        options: Options,
    ) -> Result<Self> {
        let first = at(p)?;
        let problem = first.clone();
        let at = |p: f64| at(p)?.in_plane_of(&first);
        let settled = problem
            .settle(&problem.inward(start)?)
            .map_err(super::active_set::Halt::error)?;
        let step = DIFFERENCE * (options.to - options.from).abs();
        let mut follower = Follower {
            at: &at,
            options,
            wrench: problem.wrench_unknowns(),
            step,
            before: 0.0,
            branch: Self {
                points: Vec::new(),
                events: Vec::new(),
                stop: ContactStop::TooManyEvents,
            },
        };
        let Settled { at: first, .. } = &settled;
        let sheet = follower.sheet(first.touches.clone());
        let x = problem.unknowns(first);
        let begun = Continuation::new(&sheet, x, p, follower.options.clone())?;
        let mut next = follower.along(&sheet, begun)?;
        loop {
            match next {
                Next::End(stop) => {
                    follower.branch.stop = stop;
                    return Ok(follower.branch);
                }
                Next::Sheet(kind, start) => {
                    let sheet = follower.sheet(kind);
                    let begun = Continuation::along(&sheet, &start, follower.options.clone())?;
                    next = follower.along(&sheet, begun)?;
                }
            }
        }
    }
}

impl<'a, F: Fn(f64) -> Result<ContactProblem>> Follower<'a, F> {
    fn sheet(&self, kind: Vec<ScaledTouch>) -> TouchedFamily<'a, F> {
        TouchedFamily {
            at: self.at,
            kind,
            wrench: self.wrench,
            step: self.step,
        }
    }

    fn point(&self, sheet: &TouchedFamily<'_, F>, point: &Point) -> Result<ContactBranchPoint> {
        let (problem, settled) = sheet.settled(&point.x, point.p)?;
        let index = point.index.map(|held| Index {
            held,
            released: held,
            neutral: 0,
        });
        Ok(ContactBranchPoint {
            p: point.p,
            arclength: self.before + point.arclength,
            equilibrium: problem.described(&settled, Way::Given, index)?,
        })
    }

    /// Follows one sheet to its end.
    fn along(&mut self, sheet: &TouchedFamily<'_, F>, begun: Continuation<'_>) -> Result<Next> {
        let mut passed = Vec::new();
        for item in begun {
            match item {
                Item::Point(point) => {
                    passed.push((point.x.clone(), point.p));
                    match self.point(sheet, &point) {
                        Ok(point) => self.branch.points.push(point),
                        Err(why) if !self.branch.points.is_empty() => {
                            return Ok(Next::End(ContactStop::Lost(why.to_string())));
                        }
                        Err(why) => return Err(why),
                    }
                }
                Item::Stop(stop) => {
                    let slipped = matches!(stop, Stop::Undefined { .. }) && self.slip_off();
                    return Ok(Next::End(if slipped {
                        ContactStop::Event(ContactEventKind::SlipOff)
                    } else {
                        ContactStop::Smooth(stop)
                    }));
                }
                Item::Special(special) => {
                    if self.branch.events.len() >= MOST_EVENTS {
                        return Ok(Next::End(ContactStop::TooManyEvents));
                    }
                    let kind = match special.kind {
                        SpecialKind::Event => return self.crease(sheet, &passed, &special.point),
                        // Where a touch becomes flat the equations lose rank, too: one event.
                        _ if sheet.is_flat(&special.point)? => {
                            return self.crease(sheet, &passed, &special.point);
                        }
                        SpecialKind::Fold => ContactEventKind::Fold,
                        SpecialKind::BranchPoint => ContactEventKind::BranchPoint,
                        SpecialKind::StabilityChange | SpecialKind::Cusp => {
                            ContactEventKind::StabilityChange
                        }
                    };
                    let point = self.point(sheet, &special.point)?;
                    self.branch.events.push(ContactEvent {
                        kind,
                        surface: None,
                        s: None,
                        point,
                        index: special.index,
                    });
                }
            }
        }
        Ok(Next::End(ContactStop::Smooth(Stop::MaxPoints)))
    }

    /// True, with an event, if a touch of the last point has come to an end of the rod: beyond, it has no place.
    fn slip_off(&mut self) -> bool {
        let Some(last) = self.branch.points.last() else {
            return false;
        };
        let length = last.equilibrium.end.s;
        let is_near_end = |s: f64| s.min(length - s) < NEAR_END * length;
        let mut touches = last.equilibrium.touches.iter();
        let Some(touch) = touches.find(|touch| !touch.at_end && is_near_end(touch.s)) else {
            return false;
        };
        self.branch.events.push(ContactEvent {
            kind: ContactEventKind::SlipOff,
            surface: Some(touch.surface),
            s: Some(touch.s),
            index: (last.equilibrium.index, None),
            point: last.clone(),
        });
        true
    }

    /// The sheet beyond an event; `passed` are the points of the sheet before.
    fn crease(
        &mut self,
        sheet: &TouchedFamily<'_, F>,
        passed: &[(DVector<f64>, f64)],
        point: &Point,
    ) -> Result<Next> {
        let lost = || Error::no_convergence("an event of the branch could not be told");
        let bound = sheet.bound(&point.x, point.p)?.ok_or_else(lost)?;
        let refined = match bound.kind {
            ContactEventKind::Line => sheet.line_start(passed, point, bound.number).ok(),
            _ => None,
        };
        let point = refined.as_ref().unwrap_or(point);
        let (problem, settled) = sheet.settled(&point.x, point.p)?;
        let of_touch = settled.at.touches.get(bound.number).map(|touch| touch.s);
        let s = match bound.kind {
            ContactEventKind::Touch => bound.s,
            _ => of_touch.unwrap_or(bound.s),
        };
        let here = self.point(sheet, point)?;
        let length = problem.rod().length;
        let event = ContactEvent {
            kind: bound.kind,
            surface: Some(bound.surface),
            s: Some(s * length),
            index: (point.index, None),
            point: here,
        };
        self.branch.points.push(event.point.clone());
        self.branch.events.push(event.clone());
        let mut touching: Touching = settled.at.clone();
        match bound.kind {
            ContactEventKind::Touch => {
                let low = settled.lows.get(bound.number).ok_or_else(lost)?;
                touching.touches.push(ScaledTouch {
                    surface: low.surface,
                    s: low.s,
                    at_end: low.at_end,
                    reaction: 0.0,
                    line: None,
                });
            }
            ContactEventKind::Release => {
                touching.touches.remove(bound.number);
            }
            kind => match problem.beyond(&touching, kind, bound.number)? {
                Some(changed) => touching = changed,
                None => return Ok(Next::End(ContactStop::Event(kind))),
            },
        }
        let next = self.sheet(touching.touches.clone());
        let x = problem.unknowns(&touching);
        let Some(mut tangent) = next.tangent(&x, point.p)? else {
            // Without weight the free parts beside a line have neutral modes: the line has no one place.
            return match bound.kind {
                ContactEventKind::Line => Ok(Next::End(ContactStop::Event(ContactEventKind::Line))),
                _ => Err(Error::no_convergence(
                    "the branch has more than one direction at its crease",
                )),
            };
        };
        let n = x.len();
        // A line up to the end begins and is left a little before the end: the next sheet begins beyond its own bound.
        let at_tip = |touch: &ScaledTouch| touch.at_end || touch.goes_on_to_end();
        let to_tip = matches!(
            bound.kind,
            ContactEventKind::Point | ContactEventKind::EndSlides
        ) && touching.touches.get(bound.number).is_some_and(at_tip);
        let aside = if to_tip { 100.0 * REACHED } else { ASIDE };
        // What the new sheet has more grows: reaction, gap, length or relative curvature.
        let ahead = |tangent: &DVector<f64>| -> Result<DVector<f64>> {
            Ok(&x + tangent.rows(0, n) * aside)
        };
        // Column of reaction (0), place (1) or length (2) of a touch.
        let entry = |number: usize, which: usize| -> Option<f64> {
            let before = touching
                .touches
                .iter()
                .take(number)
                .map(ScaledTouch::unknowns);
            let first = sheet.wrench + before.sum::<usize>();
            touching.touches.get(number)?.columns(first)[which].map(|column| tangent[column])
        };
        let last = touching.touches.len().saturating_sub(1);
        let measure = |tangent: &DVector<f64>| -> Result<f64> {
            let p = point.p + tangent[n] * aside;
            let problem = (self.at)(p)?;
            let at = problem.touching(&ahead(tangent)?, &touching.touches)?;
            let shape = problem.shape_of(&at.b, &at.touches)?;
            if bound.kind != ContactEventKind::Point {
                return Ok(problem.gap(bound.surface, &shape.section(bound.s)?.r).value);
            }
            let stations = problem.stations(&at, &shape)?;
            let (section, gap) = stations.at.get(bound.number).ok_or_else(lost)?;
            let at_end = touching.touches[bound.number].at_end;
            Ok(if at_end {
                -section.slope(gap)
            } else {
                section.relative_curvature(gap)
            })
        };
        let grows = match bound.kind {
            ContactEventKind::Touch => entry(last, 0).ok_or_else(lost)? > 0.0,
            ContactEventKind::Line => entry(bound.number, 2).ok_or_else(lost)? > 0.0,
            ContactEventKind::EndSlides => entry(bound.number, 1).ok_or_else(lost)? < 0.0,
            // The branch goes on; nothing of the new sheet is zero at its beginning.
            ContactEventKind::LineAtEnd => tangent[n] * point.tangent_p > 0.0,
            ContactEventKind::Point if touching.touches.len() < settled.at.touches.len() => {
                tangent[n] * point.tangent_p > 0.0
            }
            _ => measure(&tangent)? > measure(&-&tangent)?,
        };
        if !grows {
            tangent.neg_mut();
        }
        let direction_p = tangent[n];
        let start = BranchStart {
            x: ahead(&tangent)?,
            p: point.p + direction_p * aside,
            direction_x: tangent.rows(0, n).into_owned(),
            direction_p,
        };
        let after = next.index(&start.x, start.p).ok().flatten();
        let turns = direction_p * point.tangent_p < 0.0;
        if let Some(last) = self.branch.events.last_mut() {
            last.index.1 = after;
        }
        if turns {
            self.branch.events.push(ContactEvent {
                kind: ContactEventKind::Corner,
                index: (point.index, after),
                ..event
            });
        }
        self.before += point.arclength;
        Ok(Next::Sheet(touching.touches, start))
    }
}
