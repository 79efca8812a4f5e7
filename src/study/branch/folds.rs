//! Fold curves in two parameters.

use super::follow::{
    Located, Row, SAME_EQUILIBRIUM, Study, TYPICAL_WRENCH, Watch, number_labels, signed,
};
use super::other_tolerances;
use super::record::{self, CurveRecord, CurveSet};
use super::subject::{Subject, VariedScene};
use crate::error::Result;
use crate::scene::{Continue, Scene, Second};
use crate::solve::arclength::{Continuation, Direction, Item, Options, Point, Role, Stop};
use crate::solve::fold_curve::{Crossed, FoldCurve};
use crate::solve::parametrised_problem::Family;
use crate::solve::special_points::{Special, SpecialKind};
use nalgebra::DVector;

/// Curves of folds.
struct Folds {
    rows: Vec<Row>,
    located: Vec<Located>,
    curves: Vec<CurveRecord>,
    /// Unknowns (x, p) where the curves cross q = `here`.
    landed: Vec<DVector<f64>>,
}

/// Window in which fold curves are followed: range and unit of the first parameter p, and the second parameter q.
struct Window<'a> {
    scene: &'a Scene,
    subject: &'a dyn Subject,
    wanted: &'a Continue,
    range: (f64, f64),
    unit: f64,
    second: &'a Second,
    /// Value of the second parameter in the scene.
    here: f64,
    bounded: &'a dyn Fn(Special) -> Special,
}

/// Follows the fold curves through the folds of the branches.
pub fn fold_curves(study: &mut Study<'_>, second: &Second) -> Result<CurveSet> {
    let (scene, wanted, subject) = (study.scene, study.wanted, study.subject);
    let (p_span, q_span) = (wanted.to - wanted.from, second.to - second.from);
    let unit = p_span.abs() / TYPICAL_WRENCH;
    let size = study.family.size();
    let crossed = |(scene, part): (Scene, f64)| {
        let other = scene.clone();
        let in_p = move |q: f64| {
            let scene = scene.with(&second.parameter, q);
            subject.family(VariedScene::over(&scene, wanted.parameter), part * p_span)
        };
        let in_q = move |p: f64| {
            let scene = other.with(&wanted.parameter, p);
            subject.family(VariedScene::over(&scene, second.parameter), part * q_span)
        };
        Crossed::new(in_p, in_q, size, unit)
    };
    let others = other_tolerances(scene, subject.finest());
    let [given, others] = [vec![(scene.clone(), 1.0)], others.into()]
        .map(|scenes| scenes.into_iter().map(crossed).collect::<Vec<_>>());
    let family = FoldCurve::new(&given[0]);
    let others = [0, 1].map(|i| FoldCurve::new(&others[i]));
    let others = [&others[0] as &dyn Family, &others[1]];
    let here = scene.value(&second.parameter);
    let options = |direction: Direction| Options {
        at: vec![here],
        direction,
        initial_step: TYPICAL_WRENCH * second.step,
        min_step: TYPICAL_WRENCH * second.min_step,
        max_step: TYPICAL_WRENCH * second.max_step,
        tolerance: scene.solve.tolerance,
        weight: TYPICAL_WRENCH / q_span.abs(),
        max_points: second.points,
        ..Options::between(second.from, second.to)
    };
    let fine = Options {
        tolerance: (0.01 * scene.solve.tolerance).max(1e-12),
        ..options(Direction::Forward)
    };
    let window = Window {
        scene,
        subject,
        wanted,
        range: wanted.range(),
        unit,
        second,
        here,
        bounded: &|special: Special| special.with_error_bounds(&others, &fine),
    };
    let mut this = Folds {
        rows: Vec::new(),
        located: Vec::new(),
        curves: Vec::new(),
        landed: Vec::new(),
    };
    let (mut remarks, mut lost) = (Vec::new(), Vec::new());
    let is_fold = |at: &&Located| at.special.kind == SpecialKind::Fold;
    for fold in study.located.iter().filter(is_fold) {
        let point = &fold.special.point;
        let y = FoldCurve::unknowns(&point.x, point.p / unit);
        // Another fold of the branch may lie on a curve which returns to the same q.
        let same = |z: &DVector<f64>| (&y - z).norm() <= SAME_EQUILIBRIUM * (1.0 + y.norm());
        if study.watch.interrupted || this.landed.iter().any(same) {
            continue;
        }
        this.curves.push(CurveRecord {
            origin: fold.label.clone(),
            ends: Vec::new(),
            complete: true,
        });
        let (row, located) = (this.rows.len(), this.located.len());
        for (direction, end) in [
            (Direction::Backward, second.from),
            (Direction::Forward, second.to),
        ] {
            // At an end of the range only the other direction leads inside.
            if here == end || study.watch.interrupted {
                continue;
            }
            let again = this.rows.len() > row;
            match Continuation::new(&family, y.clone(), here, options(direction)) {
                Ok(branch) => {
                    let run = CurveRun {
                        branch,
                        direction,
                        again,
                    };
                    let watch = &mut study.watch;
                    this.follow(run, &family, &window, watch, &mut remarks);
                }
                Err(e) => lost.push(format!("fold curve through {}: {e}", fold.label)),
            }
        }
        number_labels(&mut this.rows[row..], &mut this.located, located, stem);
        indices_at_special_points(&mut this.rows[row..]);
    }
    if !study.located.iter().any(|at| is_fold(&at)) {
        remarks.push(format!(
            "second = {}: the branches have no fold, so there is no fold curve to follow",
            second.name
        ));
    }
    study.remarks.extend(remarks);
    study.lost.extend(lost);
    let first = |at: &Located| {
        let special = &at.special;
        Some((special.point.x[size], special.error_x[size]))
    };
    Ok(CurveSet {
        points: record::table(scene, wanted, Some(second), subject, &this.rows)?,
        curves: this.curves,
        specials: this
            .located
            .iter()
            .map(|at| at.record(first(at), None))
            .collect(),
    })
}

/// Continuation of a fold curve in one direction.
struct CurveRun<'a> {
    branch: Continuation<'a>,
    direction: Direction,
    /// True if the start point is in the rows already.
    again: bool,
}

impl Folds {
    /// Follows the last curve in one direction.
    fn follow(
        &mut self,
        run: CurveRun<'_>,
        family: &FoldCurve<'_>,
        window: &Window<'_>,
        watch: &mut Watch<'_>,
        remarks: &mut Vec<String>,
    ) {
        let CurveRun {
            branch,
            direction,
            again,
        } = run;
        let number = self.curves.len() - 1;
        let backward = direction == Direction::Backward;
        let first = self.rows.len();
        for item in branch {
            let (point, special) = match item {
                Item::Point(point) => (point, None),
                Item::Special(special) => (special.point.clone(), Some(special)),
                Item::Stop(stop) => {
                    let (complete, words) = ended(number, window.second, &stop);
                    self.end(complete, words);
                    break;
                }
            };
            if point.p == window.here && point.role != Role::Step {
                self.landed.push(point.x.clone());
            }
            if again && point.role == Role::Start {
                continue;
            }
            let q = point.p;
            let (x, p) = FoldCurve::parts(&point.x);
            let p = p * window.unit;
            let (low, high) = window.range;
            // Rounding must not end a curve that runs along the border.
            let slack = 1e-9 * (high - low);
            if !(low - slack <= p && p <= high + slack) {
                let words = format!(
                    "fold curve {number} left the range of {} at {} = {q}",
                    window.wanted.name, window.second.name
                );
                self.end(true, words);
                break;
            }
            let label = match special {
                Some(special) => {
                    let mut special = (window.bounded)(special);
                    // Temporary label: numbers are given along the curve by `number_labels`.
                    let label = format!("#{}", self.located.len());
                    special.point.x[x.len()] = p;
                    special.error_x[x.len()] *= window.unit.abs();
                    self.located.push(Located {
                        label: label.clone(),
                        curve: number,
                        special,
                        backward,
                    });
                    label
                }
                None => String::new(),
            };
            let scene = window.scene.with(&window.second.parameter, q);
            let state =
                window
                    .subject
                    .state(&scene.with(&window.wanted.parameter, p), &x, point.error);
            match state {
                Ok(state) => self.rows.push(Row {
                    curve: number,
                    p,
                    q: Some(q),
                    arclength: signed(backward, point.arclength),
                    x,
                    state,
                    index: lower_index(family, &point),
                    label,
                }),
                Err(e) => {
                    let words = format!("fold curve {number}: points are left out: {e}");
                    if !remarks.contains(&words) {
                        remarks.push(words);
                    }
                }
            }
            if watch.stops(p) {
                let name = &window.second.name;
                self.end(
                    false,
                    format!("fold curve {number} was interrupted at {name} = {q}"),
                );
                break;
            }
        }
        if backward {
            self.rows[first..].reverse();
        }
    }

    fn end(&mut self, complete: bool, words: String) {
        if let Some(curve) = self.curves.last_mut() {
            curve.end(complete, words);
        }
    }
}

/// Morse index of the more stable of the two equilibria that meet at a fold.
fn lower_index(family: &FoldCurve<'_>, point: &Point) -> Option<usize> {
    let both = family.indices(&point.x, point.p).ok().flatten();
    both.map(|(lower, _)| lower)
}

/// Replaces the meaningless index computed at a cusp by the smaller index of the two neighbouring rows.
fn indices_at_special_points(rows: &mut [Row]) {
    for i in 0..rows.len() {
        if !rows[i].label.is_empty() {
            let before = i.checked_sub(1).and_then(|i| rows[i].index);
            let after = rows.get(i + 1).and_then(|row| row.index);
            rows[i].index = match (before, after) {
                (Some(a), Some(b)) => Some(a.min(b)),
                (a, b) => a.or(b),
            };
        }
    }
}

fn stem(special: &Special) -> &'static str {
    match special.kind {
        SpecialKind::Cusp => "CP",
        // The second parameter has a turning point: two folds of the branches meet in a branch point.
        SpecialKind::Fold => "TP",
        SpecialKind::BranchPoint => "BP",
        SpecialKind::StabilityChange | SpecialKind::Event => "SC",
    }
}

/// Description of an end of a fold curve, and true if the curve was followed as far as was asked.
fn ended(number: usize, second: &Second, stop: &Stop) -> (bool, String) {
    let name = &second.name;
    let done = |words: String| (true, format!("fold curve {number} {words}"));
    let short = |why: String| {
        let words =
            format!("fold curve {number} ended short of the ends of the range of {name}: {why}");
        (false, words)
    };
    match stop {
        Stop::Reached => done(format!("reached {name} = {}", second.to)),
        Stop::LeftAtStart => done(format!("reached {name} = {}", second.from)),
        Stop::Closed => done("is a closed loop".to_owned()),
        Stop::MaxPoints => short(format!(
            "its {} points were used up; raise points or max_step in second",
            second.points
        )),
        Stop::StepTooSmall { p, reason, .. } => short(format!("it is stuck at {p}: {reason}")),
        Stop::Undefined { p, reason, .. } => short(format!(
            "there is no equilibrium to follow beyond {p}: {reason}"
        )),
    }
}
