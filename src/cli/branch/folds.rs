//! Fold curves in two parameters.

use super::follow::{Curve, Located, Row, Study, TYPICAL, number_labels, signed};
use nalgebra::SVector;
use snaprod::rod::Statical;
use snaprod::scene::{Parameter, Second, Statics};
use snaprod::solve::arclength::{Branch, Direction, Item, Options, Point, Role, Stop};
use snaprod::solve::fold_curve::{Crossed, Family2, FoldCurve};
use snaprod::solve::special::{Kind, Special};

/// Curves of folds.
pub struct Folds<const M: usize> {
    pub rows: Vec<Row>,
    pub located: Vec<Located<M>>,
    pub curves: Vec<Curve>,
}

/// Follows the fold curves through the folds of the branches; M = N + 1. `make` gives the family of a scene over one of its
/// parameters, for a range of this length.
pub fn fold_curves<F, const N: usize, const M: usize>(
    study: &mut Study<'_, F, N>,
    second: &Second,
    make: &impl Fn(&Statics, Parameter, f64) -> F,
) -> Folds<M>
where
    F: Statical<N>,
{
    let (scene, wanted) = (study.scene, study.wanted);
    let (p_span, q_span) = (wanted.to - wanted.from, second.to - second.from);
    let unit = p_span.abs() / TYPICAL;
    let at_q = |q: f64| make(&scene.with(&second.parameter, q), wanted.parameter, p_span);
    let at_p = |p: f64| make(&scene.with(&wanted.parameter, p), second.parameter, q_span);
    let crossed = Crossed::new(at_q, at_p, unit);
    let family = FoldCurve::<_, N, M>::new(&crossed);
    let here = scene.value(&second.parameter);
    let mut this = Folds {
        rows: Vec::new(),
        located: Vec::new(),
        curves: Vec::new(),
    };
    let mut landed: Vec<SVector<f64, M>> = Vec::new();
    let folds = study
        .located
        .iter()
        .filter(|at| at.special.kind == Kind::Fold);
    for fold in folds {
        let point = &fold.special.point;
        let y = FoldCurve::<(), N, M>::unknowns(&point.x, point.p / unit);
        // A curve that comes back to this value of q may pass through other folds of the branch.
        if landed
            .iter()
            .any(|z| (y - z).norm() <= 1e-6 * (1.0 + y.norm()))
        {
            continue;
        }
        let number = this.curves.len();
        let mut curve = Curve {
            origin: fold.label.clone(),
            ends: Vec::new(),
            complete: true,
        };
        let (row, located) = (this.rows.len(), this.located.len());
        let mut skip_start = false;
        for (direction, end) in [
            (Direction::Backward, second.from),
            (Direction::Forward, second.to),
        ] {
            if here == end {
                continue;
            }
            let backward = direction == Direction::Backward;
            let options = Options {
                at: vec![here],
                direction,
                initial_step: TYPICAL * second.step,
                min_step: TYPICAL * second.min_step,
                max_step: TYPICAL * second.max_step,
                tolerance: scene.solve.tolerance,
                weight: TYPICAL / q_span.abs(),
                max_points: second.points,
                ..Options::between(second.from, second.to)
            };
            let branch = match Branch::new(&family, y, here, options) {
                Ok(branch) => branch,
                Err(e) => {
                    study
                        .remarks
                        .push(format!("fold curve through {}: {e}", fold.label));
                    continue;
                }
            };
            let first = this.rows.len();
            for item in branch {
                let (point, label) = match item {
                    Item::Point(point) => {
                        if point.role != Role::Step && point.p == here {
                            landed.push(point.x);
                        }
                        if skip_start && point.role == Role::Start {
                            continue;
                        }
                        (point, String::new())
                    }
                    Item::Special(special) => {
                        let label = format!("#{}", this.located.len());
                        let point = special.point;
                        this.located.push(Located {
                            label: label.clone(),
                            curve: number,
                            special: scaled(special, unit),
                            backward,
                        });
                        (point, label)
                    }
                    Item::Stop(stop) => {
                        let (complete, words) = ended(number, second, &stop);
                        curve.complete &= complete;
                        curve.ends.push(words);
                        break;
                    }
                };
                let (x, p) = FoldCurve::<(), N, M>::parts(&point.x);
                let (low, high) = wanted.range();
                // Rounding must not end a curve along the border.
                let slack = 1e-9 * (high - low);
                if !(low - slack <= p * unit && p * unit <= high + slack) {
                    if !label.is_empty() {
                        this.located.pop();
                    }
                    curve.ends.push(format!(
                        "fold curve {number} left the range of {} at {} = {}",
                        wanted.parameter, second.parameter, point.p
                    ));
                    break;
                }
                match make(
                    &scene.with(&second.parameter, point.p),
                    wanted.parameter,
                    p_span,
                )
                .state(&x, p * unit)
                {
                    Ok(state) => this.rows.push(Row {
                        curve: number,
                        p: p * unit,
                        q: Some(point.p),
                        arclength: signed(backward, point.arclength),
                        state,
                        index: lower_index(&family, &point),
                        label,
                    }),
                    Err(e) => study.remarks.push(format!("fold curve {number}: {e}")),
                }
            }
            skip_start = true;
            if backward {
                this.rows[first..].reverse();
            }
        }
        number_labels(&mut this.rows[row..], &mut this.located, located, stem);
        indices_at_special_points(&mut this.rows[row..]);
        this.curves.push(curve);
    }
    if study.located.iter().all(|at| at.special.kind != Kind::Fold) {
        study.remarks.push(format!(
            "second = {}: the branches have no fold, so there is no fold curve to follow",
            second.parameter
        ));
    }
    this
}

/// The index of the two equilibria that meet at a fold: that of the more stable one.
fn lower_index<F: Family2<N>, const N: usize, const M: usize>(
    family: &FoldCurve<'_, F, N, M>,
    point: &Point<M>,
) -> Option<usize> {
    let both = family.indices(&point.x, point.p).ok().flatten();
    both.map(|(lower, _)| lower)
}

/// The index computed at a cusp means nothing: it is that of its neighbours.
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

/// The first parameter in the scene's units.
fn scaled<const M: usize>(mut special: Special<M>, unit: f64) -> Special<M> {
    special.point.x[M - 1] *= unit;
    special
}

fn stem<const M: usize>(special: &Special<M>) -> &'static str {
    match special.kind {
        Kind::Cusp => "CP",
        // The second parameter turns: two folds of the branches meet in a branch point.
        Kind::Fold => "TP",
        Kind::BranchPoint => "BP",
        Kind::StabilityChange | Kind::Event => "SC",
    }
}

fn ended(number: usize, second: &Second, stop: &Stop) -> (bool, String) {
    let name = second.parameter;
    match stop {
        Stop::Reached => (
            true,
            format!("fold curve {number} reached {name} = {}", second.to),
        ),
        Stop::LeftAtStart => (
            true,
            format!("fold curve {number} reached {name} = {}", second.from),
        ),
        Stop::Closed => (true, format!("fold curve {number} is a closed loop")),
        Stop::MaxPoints => (
            false,
            format!(
                "fold curve {number} ended short of the ends of the range of {name}: its {} points were used up; raise points or \
                 max_step in second",
                second.points
            ),
        ),
        Stop::StepTooSmall { p, reason, .. } => (
            false,
            format!(
                "fold curve {number} ended short of the ends of the range of {name}: it is stuck at {p}: {reason}"
            ),
        ),
        Stop::Undefined { p, reason, .. } => (
            false,
            format!(
                "fold curve {number} ended short of the ends of the range of {name}: there is no equilibrium to follow beyond {p}: {reason}"
            ),
        ),
    }
}
