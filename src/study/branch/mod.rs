//! Branches of equilibria in one parameter of a static scene. Included are special points, crossing branches,
//! branches found by deflation, and curves of folds in a second parameter.

mod assembled;
mod folds;
mod follow;
mod record;
mod rod;
mod search;
mod subject;
mod touched;

pub use record::{
    BranchMass, BranchRecord, ContactAt, CurveRecord, CurveSet, DeflationRecord, FoldCurves,
    PointDerivative, ShapeRecord, SpecialPoint,
};

use super::Hooks;
use crate::error::{Error, Result};
use crate::rod::{
    BothEnds, Chart, ChosenPath, Equilibrium, Path, Problem, ProblemChart, RodFamily, Spatial,
    Wrench,
};
use crate::scene::{Continue, Parameter, ScalarField, Scene};
use crate::solve::implicit_derivative::{Critical, Rate};
use crate::solve::special_points::SpecialKind;
use assembled::Assembled;
pub(in crate::study) use assembled::guesses;
use folds::fold_curves;
pub(in crate::study) use follow::SAME_EQUILIBRIUM;
use follow::{Located, Study, Watch};
use nalgebra::DVector;
use rod::SingleRod;
use subject::{GeneralPoint, LoadClass, Subject, VariedScene};

/// Follows the branch that the `[continue]` of the scene describes, and the further branches requested there.
///
/// A branch that ends early is no error: its points are in the record, with the reason. After an interrupt the record
/// has the points found so far.
///
/// ```
/// use snaprod::scene::Scene;
/// use snaprod::study::{Silent, branch};
/// let column = Scene::parse(
///     r#"
///     [rod]
///     model = "cosserat"
///     length = 1.0
///     [rod.section]
///     bending = [1.5, 1.0]
///     torsion = 0.8
///     [end]
///     force = [0.0, 0.0, -1.0]
///     [continue]
///     parameter = "end.load"
///     from = 0.0
///     to = 3.0
///     "#,
/// )?;
/// let record = branch(&column, &mut Silent)?;
/// let euler = &record.branches.specials[0];
/// let quarter = std::f64::consts::PI.powi(2) / 4.0;
/// assert!((euler.parameter - quarter).abs() <= euler.precision);
/// # Ok::<(), Box<dyn std::error::Error>>(())
/// ```
///
/// # Errors
/// A scene without `[continue]`; no equilibrium at its start; a requested solution path (e.g. closed form) that fails
/// along the branch.
pub fn branch(scene: &Scene, hooks: &mut dyn Hooks) -> Result<BranchRecord> {
    branch_by(scene, &[], hooks)
}

/// [`branch()`] with the derivatives of the folds and branch points by fields of the scene.
///
/// # Errors
/// As [`branch()`]; derivatives of rods among obstacles.
pub fn branch_by(scene: &Scene, by: &[ScalarField], hooks: &mut dyn Hooks) -> Result<BranchRecord> {
    scene.refuse_functions("a branch")?;
    let Some(wanted) = &scene.continuation else {
        return Err(missing(scene));
    };
    if scene.is_assembly() {
        let in_units = |e| scene.in_own_units(e);
        let (subject, x) = Assembled::new(scene, wanted).map_err(in_units)?;
        let record = followed(scene, wanted, (&subject, by), x, hooks).map_err(in_units)?;
        return record.ok_or_else(left_chart_error);
    }
    if !scene.obstacles.is_empty() {
        if !by.is_empty() {
            return Err(Error::domain(
                "derivatives of special points are not computed for rods among obstacles; leave out [[obstacle]], or take differences of a sweep",
            ));
        }
        return touched::branch(scene, wanted, hooks);
    }
    let first = scene.with(&wanted.parameter, wanted.from).problem()?;
    let start = first.solve(scene.guess().as_ref())?;
    let (charted, mut taken) = chart_for_branch(scene, wanted, &start)?;
    let base = &start.base;
    // A requested closed form is followed as far as it is valid.
    let while_slack = scene.solve.path != Path::ClosedForm;
    let (record, plane) = if while_slack && first.is_taut(base, &start.end) {
        let plane = match charted {
            ProblemChart::Planar(plane) => Some(plane),
            ProblemChart::ClosedForm(chart) => Some(*chart.plane()),
            ProblemChart::Spatial(_) | ProblemChart::FreeEnd(_) => None,
        };
        (None, plane)
    } else {
        match charted {
            ProblemChart::Spatial(chart) => (
                follow_in_chart(scene, (wanted, by), chart, base, while_slack, hooks)?,
                None,
            ),
            ProblemChart::FreeEnd(chart) => (
                follow_in_chart(scene, (wanted, by), chart, base, while_slack, hooks)?,
                None,
            ),
            ProblemChart::Planar(chart) => (
                follow_in_chart(scene, (wanted, by), chart, base, while_slack, hooks)?,
                Some(chart),
            ),
            ProblemChart::ClosedForm(chart) => {
                let plane = *chart.plane();
                (
                    follow_in_chart(scene, (wanted, by), chart, base, while_slack, hooks)?,
                    Some(plane),
                )
            }
        }
    };
    let record = match record {
        Some(record) => record,
        // The two-ended chart has no phase of a free turn in space.
        None if plane.is_none() && !first.zero_modes(base).is_empty() => {
            taken = ChosenPath {
                path: Path::Spatial,
                why: "the rod turns for nothing about the axis of its clamp, out of every plane: it is solved from its clamp even where it \
                      is taut"
                    .to_owned(),
            };
            let record = follow_in_chart(scene, (wanted, by), Spatial, base, false, hooks)?;
            record.ok_or_else(left_chart_error)?
        }
        None => {
            taken = ChosenPath {
                path: plane.map_or(Path::Spatial, |_| Path::Planar),
                why: "the rod is taut on a part of its branch: there it is solved from both ends"
                    .to_owned(),
            };
            let record = follow_in_chart(
                scene,
                (wanted, by),
                BothEnds::new(&first, plane),
                base,
                false,
                hooks,
            )?;
            record.ok_or_else(left_chart_error)?
        }
    };
    Ok(BranchRecord {
        taken: Some(taken),
        ..record
    })
}

/// Follows all branches in one chart; `None` if `while_slack` and the rod becomes taut on the branch.
fn follow_in_chart<C: Chart + Clone + 'static>(
    scene: &Scene,
    (wanted, by): (&Continue, &[ScalarField]),
    chart: C,
    base: &Wrench,
    while_slack: bool,
    hooks: &mut dyn Hooks,
) -> Result<Option<BranchRecord>> {
    let problem = |p: f64| scene.with(&wanted.parameter, p).problem();
    let x = RodFamily::in_chart(problem, false, 1.0, chart.clone()).unknowns(base, wanted.from)?;
    let rod = SingleRod {
        scene,
        chart,
        while_slack,
    };
    followed(scene, wanted, (&rod, by), x, hooks)
}

/// Error for a branch that leaves unknowns expected to be valid everywhere.
fn left_chart_error() -> Error {
    Error::no_convergence("the branch left the unknowns that hold all along it")
}

/// Error for a scene without `[continue]`.
fn missing(scene: &Scene) -> Error {
    if scene.wall().is_some() {
        return Error::domain(
            "this is a wall under pressure, whose branches `snaprod branch` and `study::wall::branch` follow",
        );
    }
    let example = match scene.assembly() {
        Some(_) => "body.NAME.force.z",
        None => "end.load",
    };
    Error::domain(format!(
        "no [continue]: add one that names the parameter, as in\n  [continue]\n  parameter = {example:?}\n  from = 0.0\n  to = 1.0"
    ))
}

/// Chart for the whole branch. It is the chart of the start if the equilibrium lies in it, if other problems in the
/// range have the same chart, and if nothing requested may leave it.
fn chart_for_branch(
    scene: &Scene,
    wanted: &Continue,
    start: &Equilibrium,
) -> Result<(ProblemChart, ChosenPath)> {
    let at = |parameter: &Parameter, p: f64| scene.with(parameter, p).problem();
    let range = |parameter: Parameter, from: f64, to: f64| {
        [from, 0.37 * from + 0.63 * to, to].map(|p| (parameter, p))
    };
    let mut others = range(wanted.parameter, wanted.from, wanted.to).to_vec();
    if let Some(second) = &wanted.second {
        others.extend(range(second.parameter, second.from, second.to));
    }
    let holds = |chart: &ProblemChart, of: &dyn Fn(&Problem) -> Option<ProblemChart>| {
        others.iter().all(|(parameter, p)| {
            let there = at(parameter, *p).ok().and_then(|problem| of(&problem));
            there.is_none_or(|there| there.is_alike(chart))
        })
    };
    let first = at(&wanted.parameter, wanted.from)?;
    let guess = scene.guess();
    let (charted, taken) = first.choose_chart(guess.as_ref())?;
    let of_plane = |problem: &Problem| Some(problem.choose_chart(guess.as_ref()).ok()?.0);
    let leaves = wanted.switch || wanted.deflate;
    let why = if taken.path == Path::Spatial {
        taken.why
    } else if scene.solve.path == Path::Auto && start.taken.path != taken.path {
        start.taken.why.clone()
    } else if holds(&charted, &of_plane) && !(scene.solve.path == Path::Auto && leaves) {
        return Ok((charted, taken));
    } else if scene.solve.path == Path::Auto && leaves {
        "other branches may leave the plane of the data".to_owned()
    } else if scene.solve.path == Path::Auto {
        "the data are planar at the start of the branch, but not all along it".to_owned()
    } else {
        return Err(Error::domain(format!(
            "solve.path = \"{}\" holds at the start of the branch, but not all along it; use \"auto\"",
            taken.path.as_str()
        )));
    };
    let reduced = first.charted_in_space();
    let chart = if holds(&reduced, &|problem| Some(problem.charted_in_space())) {
        reduced
    } else {
        ProblemChart::Spatial(Spatial)
    };
    let path = Path::Spatial;
    Ok((chart, ChosenPath { path, why }))
}

/// All results for the branch through `x`; `None` if the branch leaves the domain of the unknowns.
fn followed(
    scene: &Scene,
    wanted: &Continue,
    (subject, by): (&dyn Subject, &[ScalarField]),
    x: DVector<f64>,
    hooks: &mut dyn Hooks,
) -> Result<Option<BranchRecord>> {
    let span = wanted.to - wanted.from;
    let family = subject.family(VariedScene::over(scene, wanted.parameter), span);
    let others = other_tolerances(scene, subject.finest()).map(|(scene, part)| {
        subject.family(VariedScene::over(&scene, wanted.parameter), part * span)
    });
    let others = others.each_ref().map(|family| &**family);
    let stations = if wanted.deflate {
        search::values(wanted)
    } else {
        Vec::new()
    };
    let mut study = Study::new(
        scene,
        wanted,
        subject,
        &*family,
        &others,
        stations,
        Watch::new(hooks, wanted),
    );
    study.follow_both_ways("the scene".to_owned(), x, wanted.from, wanted.both)?;
    if study.left {
        return Ok(None);
    }
    if wanted.switch {
        study.switch();
    }
    let deflation = wanted.deflate.then(|| search::search(&mut study));
    let fold_curves = match &wanted.second {
        Some(second) => Some(FoldCurves {
            second: second.parameter,
            name: second.name.clone(),
            curves: fold_curves(&mut study, second)?,
        }),
        None => None,
    };
    let loads = loads(scene, wanted, subject)?;
    let mut remarks: Vec<String> = loads.remark().map(str::to_owned).into_iter().collect();
    remarks.append(&mut study.remarks);
    for row in &study.rows {
        let there = scene.with(&wanted.parameter, row.p);
        let modes = subject.zero_modes(&there, &row.x)?;
        if !modes.is_empty() {
            let name = &wanted.name;
            remarks.push(format!(
                "from {name} = {} on {}: left out of the index and of special points",
                row.p,
                modes.join(", and ")
            ));
            break;
        }
    }
    let mut fold = |at: &Located| {
        let fold = match at.special.kind {
            SpecialKind::Fold => subject.fold(scene, wanted, &at.special.point),
            _ => return None,
        };
        fold.unwrap_or_else(|why| {
            remarks.push(format!(
                "the delay at fold {} is not computed: {why}",
                at.label
            ));
            None
        })
    };
    let specials = study.located.iter();
    let specials = specials.map(|at| SpecialPoint {
        derivatives: derivatives(&study, at, by),
        ..at.record(None, fold(at))
    });
    let leaves = |special: SpecialPoint| SpecialPoint {
        out_of_plane: subject.is_planar() && special.is_odd_change(),
        ..special
    };
    let specials = specials.map(leaves).collect();
    let pictures = study.watch.hooks.pictures();
    let shapes = |chosen| record::shapes(scene, wanted, subject, &study.rows, chosen);
    Ok(Some(BranchRecord {
        parameter: wanted.parameter,
        name: wanted.name.clone(),
        units: scene.units,
        length: scene.rod.length,
        conservative: loads == LoadClass::Conservative,
        taken: None,
        branches: CurveSet {
            points: record::table(scene, wanted, None, subject, &study.rows)?,
            specials,
            curves: study.curves,
        },
        fold_curves,
        deflation,
        masses: record::masses(scene, wanted, subject, &study.rows),
        shapes: shapes(record::even(subject.shown(), &study.rows)),
        pictures: shapes(record::even_and_special(pictures, &study.rows)),
        obstacles: Vec::new(),
        remarks,
        lost: study.lost,
        interrupted: study.watch.interrupted,
    }))
}

/// Derivatives of the parameter at a special point by fields of the scene.
fn derivatives(study: &Study<'_>, at: &Located, by: &[ScalarField]) -> Vec<PointDerivative> {
    let (wanted, point) = (study.wanted, &at.special.point);
    let tolerance = study.subject.finest();
    let mut scene = study.scene.clone();
    scene.solve.tolerance = tolerance;
    let rate = |field: &ScalarField| -> Result<Rate> {
        let there = scene.with(&wanted.parameter, point.p);
        let general = study.subject.in_general(&there, &point.x)?;
        let (subject, x) = match &general {
            Some(GeneralPoint { subject, x }) => (&**subject, x),
            None => (study.subject, &point.x),
        };
        let scenes = VariedScene::over(&scene, wanted.parameter);
        let family = subject.family(scenes, wanted.to - wanted.from);
        let critical = Critical {
            family: &*family,
            x,
            p: point.p,
        };
        let at_point = (wanted.parameter, point.p);
        let other = subject.family(VariedScene::by(field, at_point, tolerance), 1.0);
        match at.special.kind {
            _ if !at.special.is_converged() => Err(Error::domain(
                "the point is only a guess, and has no derivative",
            )),
            SpecialKind::Fold => critical.of_fold(&*other, field.value),
            SpecialKind::BranchPoint => critical.of_branch_point(&*other, field.value),
            SpecialKind::StabilityChange | SpecialKind::Event | SpecialKind::Cusp => {
                Err(Error::domain(
                    "derivatives are those of folds and branch points: this point shows in the index alone, as where a rod leaves the \
                     plane of its branch; set solve.path = \"spatial\" to see it as a branch point",
                ))
            }
        }
    };
    let each = by.iter().map(|field| PointDerivative {
        field: field.path.clone(),
        rate: rate(field).map_err(|why| study.scene.in_own_units(why).to_string()),
    });
    each.collect()
}

/// Class of the loads over all ranges: the worst at their ends, since a load that vanishes at one end looks
/// conservative there.
fn loads(scene: &Scene, wanted: &Continue, subject: &dyn Subject) -> Result<LoadClass> {
    let own = [wanted.from, wanted.to].map(|p| (wanted.parameter, p));
    let second = wanted.second.iter();
    let second = second.flat_map(|second| [second.from, second.to].map(|p| (second.parameter, p)));
    let mut worst = LoadClass::Conservative;
    for (parameter, p) in own.into_iter().chain(second) {
        worst = worst.max(subject.loads(&scene.with(&parameter, p))?);
    }
    Ok(worst)
}

/// The scene at two other tolerances, with factors of the difference step in the parameter. Both compute the same
/// special points with other errors. They are tighter, unless the tolerance is within the factor TIGHTER of `finest`;
/// then both are looser.
fn other_tolerances(scene: &Scene, finest: f64) -> [(Scene, f64); 2] {
    let given = scene.solve.tolerance.max(finest);
    let tighter = [30.0, 1000.0].map(|factor| (given / factor).max(finest));
    let tolerances = if given >= TIGHTER * finest {
        tighter
    } else {
        [LOOSER * given; 2]
    };
    [(tolerances[0], 0.4), (tolerances[1], 0.7)].map(|(tolerance, span)| {
        let mut other = scene.clone();
        other.solve.tolerance = tolerance;
        (other, span)
    })
}

/// Factors by which another tolerance must be tighter (at least), or looser, for an error to be visible.
const TIGHTER: f64 = 9.0;
const LOOSER: f64 = 3.0;
/// Tightest tolerance of a scene: a smaller one only adds rounding to the integration along the rod.
const FINEST: f64 = 1e-13;
