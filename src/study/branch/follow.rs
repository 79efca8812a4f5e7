//! Continuation of the branches of one scene, with their rows, special points and remarks.

use super::record::CurveRecord;
use super::subject::{BranchState, Subject};
use crate::error::{Error, Result};
use crate::scene::{Continue, Scene};
use crate::solve::arclength::{Continuation, Direction, Item, Options, Point, Role, Stop};
use crate::solve::branch_switching::switch;
use crate::solve::parametrised_problem::Family;
use crate::solve::special_points::{Special, SpecialKind};
use crate::study::Hooks;
use nalgebra::DVector;

/// Norm of the wrench that weighs as much as the whole range of the parameter.
pub(in crate::study) const TYPICAL_WRENCH: f64 = Continue::WRENCH_SCALE;
/// Largest number of branches followed by switching, the first included.
const MAX_BRANCHES: usize = 24;
/// Distance from a branch point at which another branch starts, as a fraction of the whole range.
const SWITCHING_DISTANCE: f64 = 0.003;
/// Relative distance of unknowns below which two solutions count as one equilibrium.
pub const SAME_EQUILIBRIUM: f64 = 1e-6;
/// Length of the initial part of a branch. If this part meets a known branch at a station, both are one branch:
/// starts from two neighbouring branch points lie close together on one branch.
const INITIAL_PART: f64 = 3.0 * TYPICAL_WRENCH * SWITCHING_DISTANCE;

/// A row of the table of branches: a point or special point with its equilibrium.
pub struct Row {
    /// Number of the branch or fold curve.
    pub curve: usize,
    pub p: f64,
    /// The second parameter, on fold curves.
    pub q: Option<f64>,
    pub arclength: f64,
    pub x: DVector<f64>,
    pub state: BranchState,
    pub index: Option<usize>,
    pub label: String,
}

/// Options of the continuation that a scene asks for, with points at these values of the parameter beside those asked
/// for.
pub(super) fn branch_options(
    scene: &Scene,
    wanted: &Continue,
    stations: &[f64],
    direction: Direction,
) -> Options {
    let (low, high) = wanted.range();
    let (from, to) = if wanted.to > wanted.from {
        (low, high)
    } else {
        (high, low)
    };
    let mut at = wanted.at.clone();
    at.extend(stations.iter().filter(|p| !wanted.at.contains(p)));
    Options {
        at,
        direction,
        initial_step: TYPICAL_WRENCH * wanted.step,
        min_step: TYPICAL_WRENCH * wanted.min_step,
        max_step: TYPICAL_WRENCH * wanted.max_step,
        tolerance: scene.solve.tolerance,
        weight: TYPICAL_WRENCH / (wanted.to - wanted.from).abs(),
        max_points: wanted.points,
        ..Options::between(from, to)
    }
}

/// A special point with its label and curve.
pub struct Located {
    pub label: String,
    pub curve: usize,
    pub special: Special,
    /// Followed in the direction of decreasing arclength.
    pub backward: bool,
}

/// Hooks of the caller, and whether an interrupt was requested.
pub struct Watch<'a> {
    pub hooks: &'a mut dyn Hooks,
    from: f64,
    to: f64,
    pub interrupted: bool,
}

impl<'a> Watch<'a> {
    /// Progress of a branch is the fraction of the range of the parameter that lies behind.
    pub fn new(hooks: &'a mut dyn Hooks, wanted: &Continue) -> Self {
        Self {
            hooks,
            from: wanted.from,
            to: wanted.to,
            interrupted: false,
        }
    }

    /// Reports the progress at this value of the parameter; true if the caller wants to stop.
    pub fn stops(&mut self, p: f64) -> bool {
        let fraction = ((p - self.from) / (self.to - self.from)).clamp(0.0, 1.0);
        self.hooks.progress(fraction, p);
        self.interrupted |= self.hooks.interrupted();
        self.interrupted
    }
}

/// Branches of one scene.
pub struct Study<'a> {
    pub scene: &'a Scene,
    pub wanted: &'a Continue,
    pub subject: &'a dyn Subject,
    pub family: &'a dyn Family,
    /// Families of the same equilibria at other tolerances, used for the errors of special points.
    pub others: &'a [&'a dyn Family],
    pub rows: Vec<Row>,
    pub located: Vec<Located>,
    pub curves: Vec<CurveRecord>,
    pub remarks: Vec<String>,
    /// Branches that were not followed, one text for each: the point where the branch begins, and the reason.
    pub lost: Vec<String>,
    pub watch: Watch<'a>,
    /// True if the first branch has left the domain of the unknowns.
    pub left: bool,
    /// Parameter values at which branches are compared: every branch has a point at each.
    stations: Vec<f64>,
    /// (p, unknowns) of branches at stations and at their ends.
    landed: Vec<(f64, DVector<f64>)>,
}

impl<'a> Study<'a> {
    pub fn new(
        scene: &'a Scene,
        wanted: &'a Continue,
        subject: &'a dyn Subject,
        family: &'a dyn Family,
        others: &'a [&'a dyn Family],
        stations: Vec<f64>,
        watch: Watch<'a>,
    ) -> Self {
        Self {
            scene,
            wanted,
            subject,
            family,
            others,
            rows: Vec::new(),
            located: Vec::new(),
            curves: Vec::new(),
            remarks: Vec::new(),
            lost: Vec::new(),
            watch,
            left: false,
            stations,
            landed: Vec::new(),
        }
    }

    fn options(&self, direction: Direction) -> Options {
        branch_options(self.scene, self.wanted, &self.stations, direction)
    }

    /// Largest norm of the unknowns at stations and ends of branches.
    pub fn size(&self) -> f64 {
        self.landed
            .iter()
            .map(|(_, x)| x.norm())
            .fold(0.0, f64::max)
    }

    /// Unknowns of the equilibria found so far at a station.
    pub fn known(&self, p: f64) -> Vec<DVector<f64>> {
        let here = self.landed.iter().filter(|(at, _)| *at == p);
        here.map(|(_, x)| x.clone()).collect()
    }

    pub fn knows(&self, p: f64, x: &DVector<f64>) -> bool {
        is_among(&self.landed, p, x)
    }

    /// Follows the branch through an equilibrium, one way or both.
    pub fn follow_both_ways(
        &mut self,
        origin: String,
        x: DVector<f64>,
        p: f64,
        both: bool,
    ) -> Result<()> {
        let family = self.family;
        // Backward first: rows are stored in the order of growing arclength.
        let ways: &[Direction] = if both {
            &[Direction::Backward, Direction::Forward]
        } else {
            &[Direction::Forward]
        };
        let mut branches = Vec::new();
        for &way in ways {
            let options = self.options(way);
            let ahead = match way {
                Direction::Forward => options.to,
                Direction::Backward => options.from,
            };
            // At an end of the range only the other direction leads inside.
            if p != ahead {
                let branch = Continuation::new(family, x.clone(), p, options);
                let branch = branch.map_err(|why| self.not_begun(why, p))?;
                branches.push((way == Direction::Backward, branch));
            }
        }
        self.follow(origin, branches);
        Ok(())
    }

    /// Error if no branch starts at p, worded for equilibria that are not isolated; `Continuation` cannot give
    /// advice.
    fn not_begun(&self, why: Error, p: f64) -> Error {
        let parameter = &self.wanted.name;
        if !why.is_ambiguous() {
            why
        } else {
            Error::ambiguous(format!(
                "the branch begins at {parameter} = {p} at a fold, a branch point, or a member of a continuous family of equilibria, as a symmetry makes one: \
             under equal bending stiffnesses a rod that is bent between held ends can stand in every plane through them; begin at another value of \
             {parameter} (from), or break the symmetry a little, as by bending stiffnesses that differ by a thousandth"
            ))
        }
    }

    /// Follows a branch in both directions, unless the branch is already known.
    fn follow(&mut self, origin: String, branches: Vec<(bool, Continuation<'_>)>) {
        let number = self.curves.len();
        self.curves.push(CurveRecord {
            origin,
            ends: Vec::new(),
            complete: true,
        });
        let (row, located, landed) = (self.rows.len(), self.located.len(), self.landed.len());
        for (i, (backward, branch)) in branches.into_iter().enumerate() {
            let first = self.rows.len();
            for item in branch {
                let p = match item {
                    // The start point was recorded in the other direction.
                    Item::Point(point) if i > 0 && point.role == Role::Start => continue,
                    Item::Point(point) => {
                        if point.role != Role::Step {
                            let is_beside = point.arclength.abs() <= INITIAL_PART;
                            if is_beside && is_among(&self.landed[..landed], point.p, &point.x) {
                                self.rows.truncate(row);
                                self.located.truncate(located);
                                self.landed.truncate(landed);
                                self.curves.pop();
                                return;
                            }
                            self.landed.push((point.p, point.x.clone()));
                        }
                        self.add(number, &point, backward, String::new());
                        point.p
                    }
                    Item::Special(special) => {
                        let options = Options {
                            tolerance: (0.01 * self.scene.solve.tolerance).max(1e-12),
                            ..self.options(Direction::Forward)
                        };
                        let special = special.with_error_bounds(self.others, &options);
                        // Temporary label: numbers are given along the branch by `number_labels`.
                        let name = format!("#{}", self.located.len());
                        let p = special.point.p;
                        self.add(number, &special.point, backward, name.clone());
                        self.located.push(Located {
                            label: name,
                            curve: number,
                            special,
                            backward,
                        });
                        p
                    }
                    Item::Stop(stop) => {
                        let last = self.rows[first..].last().map(|row| row.p);
                        let (complete, words) =
                            describe_end(self.wanted, number, backward, &stop, last, self.subject);
                        self.curves[number].end(complete, words);
                        break;
                    }
                };
                self.left |= number == 0 && self.rows.last().is_some_and(|row| row.state.left);
                if self.left {
                    break;
                }
                if self.watch.stops(p) {
                    let words = self.ended_early_message(
                        number,
                        backward,
                        &format!("it was interrupted at {p}"),
                    );
                    self.curves[number].end(false, words);
                    break;
                }
            }
            if backward {
                self.rows[first..].reverse();
            }
            if self.watch.interrupted || self.left {
                break;
            }
        }
        let stem = |special: &Special| match special.kind {
            SpecialKind::Fold => "LP",
            SpecialKind::BranchPoint => "BP",
            SpecialKind::Cusp => "CP",
            SpecialKind::StabilityChange | SpecialKind::Event => "SC",
        };
        number_labels(&mut self.rows[row..], &mut self.located, located, stem);
    }

    fn add(&mut self, curve: usize, point: &Point, backward: bool, label: String) {
        let scene = self.scene.with(&self.wanted.parameter, point.p);
        match self.subject.state(&scene, &point.x, point.error) {
            Ok(state) => self.rows.push(Row {
                curve,
                p: point.p,
                q: None,
                arclength: signed(backward, point.arclength),
                x: point.x.clone(),
                state,
                index: point.index,
                label,
            }),
            Err(e) => self.remarks.push(format!(
                "branch {curve}: the point at {} = {} is left out: {e}",
                self.wanted.name, point.p
            )),
        }
    }

    fn ended_early_message(&self, number: usize, backward: bool, why: &str) -> String {
        ended_early_message(self.wanted, number, backward, why)
    }

    /// Follows the branches which cross branch 0 at branch points.
    pub fn switch(&mut self) {
        let family = self.family;
        let options = self.options(Direction::Forward);
        let mut starts = Vec::new();
        for at in self.located.iter().filter(|at| at.curve == 0) {
            let kind = at.special.kind;
            if !matches!(
                kind,
                SpecialKind::BranchPoint | SpecialKind::StabilityChange
            ) || self.watch.interrupted
            {
                continue;
            }
            match switch(
                family,
                &at.special,
                TYPICAL_WRENCH * SWITCHING_DISTANCE,
                &options,
            ) {
                Ok(ways) => {
                    let named = |remark: &String| format!("switching at {}: {remark}", at.label);
                    self.remarks.extend(ways.remarks.iter().map(named));
                    self.lost.extend(ways.lost.iter().map(named));
                    if ways.starts.is_empty() && ways.lost.is_empty() {
                        self.lost.push(format!(
                            "switching at {}: no other branch was found; under a symmetry, as with equal bending stiffnesses, \
                             the branches form a continuous family: break the symmetry slightly",
                            at.label
                        ));
                    }
                    starts.extend(
                        ways.starts
                            .into_iter()
                            .map(|start| (at.label.clone(), start)),
                    );
                }
                Err(e) => {
                    let words = format!("switching at {}: {e}", at.label);
                    // The index may also change where no other branch crosses.
                    if kind == SpecialKind::BranchPoint || e.is_no_convergence() {
                        self.lost.push(words)
                    } else {
                        self.remarks.push(words)
                    }
                }
            }
        }
        // A branch that joins two branch points is met again at the second. Each start is therefore compared with the
        // branches followed before.
        self.stations
            .extend(starts.iter().map(|(_, start)| start.p));
        for (k, (label, start)) in starts.iter().enumerate() {
            if self.watch.interrupted {
                return;
            }
            if self.knows(start.p, &start.x) {
                continue;
            }
            if self.curves.len() >= MAX_BRANCHES {
                self.lost.push(format!(
                    "{} starts at branch points are not followed: the limit of {MAX_BRANCHES} branches is reached",
                    starts.len() - k
                ));
                return;
            }
            match Continuation::along(family, start, self.options(Direction::Forward)) {
                Ok(branch) => self.follow(label.clone(), vec![(false, branch)]),
                Err(e) => self.lost.push(format!("switching at {label}: {e}")),
            }
        }
    }
}

/// True if the equilibrium (x, p) is among the recorded ones.
fn is_among(landed: &[(f64, DVector<f64>)], p: f64, x: &DVector<f64>) -> bool {
    let same = |y: &DVector<f64>| (x - y).norm() <= SAME_EQUILIBRIUM * (1.0 + x.norm());
    landed.iter().any(|(at, y)| *at == p && same(y))
}

/// Arclength in the measure of the scene, negative for `backward`.
pub fn signed(backward: bool, arclength: f64) -> f64 {
    let sign = if backward { -1.0 } else { 1.0 };
    sign * arclength / TYPICAL_WRENCH
}

/// Labels the special points from `first` on, in the order of the rows.
pub fn number_labels(
    rows: &mut [Row],
    located: &mut [Located],
    first: usize,
    stem: impl Fn(&Special) -> &'static str,
) {
    let mut next = first;
    for row in rows {
        let Some(k) = (next..located.len()).find(|&k| row.label == located[k].label) else {
            continue;
        };
        located.swap(next, k);
        let stem = stem(&located[next].special);
        let before = located[..next].iter();
        let count = before.filter(|at| at.label.starts_with(stem)).count();
        row.label = format!("{stem}{}", count + 1);
        located[next].label = row.label.clone();
        next += 1;
    }
}

/// Message for a branch with an end before its aim.
fn ended_early_message(wanted: &Continue, number: usize, backward: bool, why: &str) -> String {
    let Continue { name, to, .. } = wanted;
    let aim = match (number, backward) {
        (0, false) => format!("{name} = {to}"),
        _ => format!("the ends of the range of {name}"),
    };
    format!("branch {number} ended short of {aim}: {why}")
}

/// Description of how the end of a branch (number, backward) was reached; true if the branch was followed as far as
/// was asked.
fn describe_end(
    wanted: &Continue,
    number: usize,
    backward: bool,
    stop: &Stop,
    last: Option<f64>,
    subject: &dyn Subject,
) -> (bool, String) {
    let Continue {
        name: parameter,
        from,
        to,
        points,
        ..
    } = wanted;
    let short = |why: String| (false, ended_early_message(wanted, number, backward, &why));
    let start = subject.start();
    let last = last.unwrap_or(*from);
    match stop {
        Stop::LeftAtStart if number == 0 && !backward && wanted.back => (
            true,
            format!("branch 0 turned back before {parameter} = {to} and came to {last}"),
        ),
        Stop::LeftAtStart if number == 0 && !backward => short(format!(
            "it turned back and left its range at the other end, {last}; the part beyond is not followed, and may still lead to {to}: \
             set {} in [continue], set a nearer `to`, accept this end with back = true, or look for other branches with \
             switch = true or deflate = true, or from {start}",
            if wanted.both {
                "a wider range (from, or to)"
            } else {
                "both = true, which follows both directions, or another from"
            }
        )),
        Stop::Reached | Stop::LeftAtStart => (
            true,
            format!("branch {number} reached {parameter} = {last}"),
        ),
        Stop::Closed => (true, format!("branch {number} is a closed loop")),
        Stop::MaxPoints => short(format!(
            "its {points} points were used up at {last}; {}",
            (subject.out_of_reach(wanted))
                .unwrap_or_else(|| "raise points or max_step in [continue]".to_owned())
        )),
        Stop::StepTooSmall { p, reason, .. } => short(format!("it is stuck at {p}: {reason}")),
        Stop::Undefined { p, reason, .. } => short(format!(
            "there is no equilibrium to follow beyond {p}: {reason}"
        )),
    }
}
