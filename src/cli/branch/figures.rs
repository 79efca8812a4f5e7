//! Figures of branches: the bifurcation diagram, fold curves, shapes.

use super::super::rod_figures::{drawn, units};
use nalgebra::{Quaternion, UnitQuaternion};
use snaprod::plot::{
    BranchDiagram, BranchLine as Line, BranchPanel, RodShapes, Special as Mark, SpecialKind,
};
use snaprod::scene::Units;
use snaprod::solve::special_points::SpecialKind as Kind;
use snaprod::study::branch::{BranchRecord, CurveSet, FoldCurves, SpecialPoint};
use std::f64::consts::TAU;

/// Number of branches up to which a figure has names.
const MOST_NAMES: usize = 8;
/// Part of the widest component by which branches must differ to look different.
const APART: f64 = 0.02;
/// Part of the span of all energies below which energies of branches are close.
const CLOSE: f64 = 0.3;
/// Part of the widest component that another component must move to be shown instead.
const MOVES: f64 = 0.5;
/// Rotation in radians below which a rotation is not shown.
const TURNS: f64 = 1e-3;
const AXES: [&str; 3] = ["x", "y", "z"];
/// Number of points of a branch for the distance to another one.
const TRIED: usize = 64;
/// Number of special points up to which all have labels; of more, only those of the first branch.
const MOST_LABELS: usize = 16;

/// The measure of a branch for its diagram: name in figures, and column.
///
/// Candidates are the components of the position of the end or of a body. The choice is the component that
/// distinguishes most pairs of branches. Ties are broken by the component along a load that is the parameter, then by
/// the largest variation apart from that of the parameter. If none moves visibly, a base couple is shown.
pub fn measure(record: &BranchRecord) -> (String, &str) {
    let (table, units) = (&record.branches.points, record.units);
    let ps = table.reals("parameter");
    let own = record
        .branches
        .numbers()
        .iter()
        .take_while(|n| **n == Some(0))
        .count();
    let score = |values: &[f64]| {
        let bent = bend(ps, values);
        // The scene's own branch counts more than the others; a linear dependence on the parameter counts little.
        span(&bent[..own]) + 0.5 * span(&bent) + 1e-3 * span(values)
    };
    // (the body of an assembly, if any; the name of the component).
    let parts = |name: &str| match name.rsplit_once('.') {
        Some((of, name)) => (Some(of.to_owned()), name.to_owned()),
        None => (None, name.to_owned()),
    };
    let along_load = record.parameter.load("force");
    let along_load = along_load.map(|(body, i)| body_columns(record, body) + AXES[i]);
    let best = |names: [&'static str; 3]| {
        let columns = table.columns.iter().map(|column| column.name.as_ref());
        let columns = columns.filter(|column: &&str| names.contains(&parts(column).1.as_str()));
        let columns: Vec<&str> = columns.collect();
        let widest = (columns.iter()).map(|name| span(table.reals(name)));
        let widest = widest.fold(0.0, f64::max);
        // A component that hardly moves compared with the others does not show the extent of a branch.
        let moving = columns
            .into_iter()
            .filter(|name| span(table.reals(name)) >= MOVES * widest);
        let scored = moving.map(|name| {
            let values = table.reals(name);
            let apart = told_apart(&record.branches, ps, values, APART * widest);
            let is_along = along_load.as_deref() == Some(name);
            ((apart, is_along), score(values), name)
        });
        let best = scored.max_by(|a, b| a.0.cmp(&b.0).then(a.1.total_cmp(&b.1)));
        best.map_or((0.0, names[0]), |(_, score, name)| (score, name))
    };
    let (shown, column) = best(AXES);
    // A held component is constant or the parameter.
    if shown > 2e-3 * record.length {
        let (of, name) = parts(column);
        let of = of.unwrap_or_else(|| "the end".to_owned());
        let label = Units::label(&format!("{name} of {of}"), units.length());
        return (label, column);
    }
    let (_, column) = best(["base_mx", "base_my", "base_mz"]);
    let (of, name) = parts(column);
    let mut label = name.replace("base_", "base couple ");
    if let Some(of) = of {
        label = format!("{label} of {of}");
    }
    (Units::label(&label, units.couple()), column)
}

/// Prefix of the columns of a body; empty for the end of a single rod.
fn body_columns(record: &BranchRecord, body: Option<usize>) -> String {
    let Some(body) = body else {
        return String::new();
    };
    let names = record.branches.points.columns.iter();
    let mut bodies = names.filter_map(|column| column.name.strip_suffix("qw"));
    bodies.nth(body).unwrap_or_default().to_owned()
}

/// If a couple is the parameter: the rotation, about its axis, of the end or body on which it acts. The angle counts
/// from the first point and beyond full turns. Returns the name in figures and the values; `None` without a visible
/// rotation.
fn turn(record: &BranchRecord) -> Option<(String, Vec<f64>)> {
    let (body, axis) = record.parameter.load("couple")?;
    let columns = body_columns(record, body);
    let set = &record.branches;
    let [w, x, y, z] =
        ["qw", "qx", "qy", "qz"].map(|part| set.points.reals(&format!("{columns}{part}")));
    let all = (0..w.len()).map(|k| Quaternion::new(w[k], x[k], y[k], z[k]));
    let poses: Vec<_> = all.map(UnitQuaternion::from_quaternion).collect();
    let (ps, numbers) = (set.points.reals("parameter"), set.numbers());
    let mut turns: Vec<f64> = Vec::with_capacity(poses.len());
    for k in 0..poses.len() {
        let since = poses[k] * poses[0].inverse();
        let turn = 2.0 * since.coords[axis].atan2(since.w);
        // A branch continues from its own last point, and begins near a point of another branch.
        let before = if k > 0 && numbers[k] == numbers[k - 1] {
            Some(k - 1)
        } else {
            let far = |i: &usize| (ps[*i] - ps[k]).abs();
            (0..k).min_by(|a, b| far(a).total_cmp(&far(b)))
        };
        let last = before.map_or(0.0, |i| turns[i]);
        turns.push(turn - TAU * ((turn - last) / TAU).round());
    }
    let of = columns.strip_suffix('.').unwrap_or("the end");
    let label = format!("turn of {of} about {} (rad)", AXES[axis]);
    (span(&turns) > TURNS).then_some((label, turns))
}

/// Number of pairs of branches that differ by more than `least` at some value of the parameter; of many branches only
/// the first ones count.
fn told_apart(set: &CurveSet, ps: &[f64], values: &[f64], least: f64) -> usize {
    let numbers = set.numbers();
    let curve = |number: usize| -> Vec<(f64, f64)> {
        let own = (0..numbers.len()).filter(|&i| numbers[i] == Some(number as i64));
        own.map(|i| (ps[i], values[i])).collect()
    };
    let curves: Vec<_> = (0..set.curves.len().min(MOST_NAMES)).map(curve).collect();
    let pairs = (0..curves.len()).flat_map(|i| (0..i).map(move |j| (i, j)));
    pairs
        .filter(|(i, j)| apart(&curves[*i], &curves[*j]) > least)
        .count()
}

/// Largest distance of sampled points of a branch from another one at the same parameter; the other branch may pass
/// that value several times or never.
fn apart(one: &[(f64, f64)], other: &[(f64, f64)]) -> f64 {
    let nearest = |&(p, y): &(f64, f64)| {
        let passes = other.windows(2).filter_map(|pair| {
            let [(a, ya), (b, yb)] = [pair[0], pair[1]];
            let within = a.min(b) <= p && p <= a.max(b);
            let part = if a == b { 0.0 } else { (p - a) / (b - a) };
            within.then_some((ya + part * (yb - ya) - y).abs())
        });
        passes.min_by(f64::total_cmp)
    };
    let some = one.iter().step_by(one.len().div_ceil(TRIED).max(1));
    some.filter_map(nearest).fold(0.0, f64::max)
}

fn span(values: &[f64]) -> f64 {
    let values = values.iter().copied();
    values.clone().fold(f64::NEG_INFINITY, f64::max) - values.fold(f64::INFINITY, f64::min)
}

/// Values minus their best linear fit.
fn bend(x: &[f64], y: &[f64]) -> Vec<f64> {
    let n = x.len().max(1) as f64;
    let (mx, my) = (x.iter().sum::<f64>() / n, y.iter().sum::<f64>() / n);
    let points = || x.iter().zip(y).map(|(x, y)| (x - mx, y - my));
    let (up, over) = points().fold((0.0, 0.0), |(a, b), (x, y)| (a + x * y, b + x * x));
    let slope = if over > 0.0 { up / over } else { 0.0 };
    points().map(|(x, y)| y - slope * x).collect()
}

/// A panel of lines and marks: `x` and `y` of each row; `name` is the name of the lines.
fn panel(name: &str, set: &CurveSet, y_label: String, x: &[f64], y: &[f64]) -> BranchPanel {
    let numbers = set.numbers();
    let last = set.curves.len().saturating_sub(1);
    let named = (1..MOST_NAMES).contains(&last);
    let indices = set.points.integers("index");
    let line = |number: usize| {
        let own = || (0..numbers.len()).filter(move |&i| numbers[i] == Some(number as i64));
        Line {
            name: if named {
                format!("{name} {number}")
            } else {
                String::new()
            },
            x: own().map(|i| x[i]).collect(),
            y: own().map(|i| y[i]).collect(),
            index: own().map(|i| indices[i].map(|n| n as usize)).collect(),
            colour: None,
        }
    };
    let mark = |at: &SpecialPoint| {
        let i = set.row(at)?;
        let kind = match at.kind {
            _ if at.contact.is_some() => SpecialKind::Contact,
            Kind::Fold => SpecialKind::Fold,
            Kind::BranchPoint => SpecialKind::BranchPoint,
            Kind::Cusp => SpecialKind::Cusp,
            Kind::StabilityChange | Kind::Event => SpecialKind::StabilityChange,
        };
        Some(Mark {
            x: x[i],
            y: y[i],
            kind,
            label: if at.curve == 0 || set.specials.len() <= MOST_LABELS {
                at.label.clone()
            } else {
                String::new()
            },
        })
    };
    BranchPanel {
        y_label,
        y_range: None,
        branches: (0..=last).map(line).collect(),
        specials: set.specials.iter().filter_map(mark).collect(),
    }
}

/// The bifurcation diagram: a measure of the rods and their energy over the parameter.
pub fn diagram(record: &BranchRecord) -> BranchDiagram {
    let set = &record.branches;
    let ps = set.points.reals("parameter");
    let (measured, values) = turn(record).unwrap_or_else(|| {
        let (label, column) = measure(record);
        (label, set.points.reals(column).to_vec())
    });
    // The energy of an assembly includes the potential of gravity and constant forces.
    let energy = match record.taken {
        Some(_) => "stored energy",
        None => "total potential energy",
    };
    let energies = set.points.reals("energy");
    let (energy, energies) = match less_the_first(set, ps, energies) {
        Some(less) => (format!("{energy} less that of branch 0"), less),
        None => (energy.to_owned(), energies.to_vec()),
    };
    let energy = Units::label(&energy, record.units.energy());
    BranchDiagram {
        title: String::new(),
        x_label: in_words(&record.label()),
        x_range: None,
        panels: vec![
            panel("branch", set, measured, ps, &values),
            panel("branch", set, energy, ps, &energies),
        ],
        folds: false,
        without_potential: !record.conservative,
    }
}

/// The label of a parameter with words for the fields that vary most often; other fields keep their path.
fn in_words(label: &str) -> String {
    const WORDS: [(&str, &str); 7] = [
        ("end.rotation.angle", "rotation of the end"),
        ("end.position.x", "x of the end"),
        ("end.position.y", "y of the end"),
        ("end.position.z", "z of the end"),
        ("end.load", "factor of the end's loads"),
        ("loads.load", "factor of the loads"),
        ("loads.gravity", "gravity"),
    ];
    let known = WORDS.iter().find_map(|(path, words)| {
        let rest = label.strip_prefix(path)?;
        // A longer path is another field.
        (rest.is_empty() || rest.starts_with(' ')).then(|| format!("{words}{rest}"))
    });
    known.unwrap_or_else(|| label.to_owned())
}

/// Energies less that of the scene's own branch at the same parameter, NaN where it does not go; `None` if the energies
/// themselves tell the branches apart, or if the own branch passes a parameter twice.
fn less_the_first(set: &CurveSet, ps: &[f64], energies: &[f64]) -> Option<Vec<f64>> {
    let numbers = set.numbers();
    let own = || (0..ps.len()).filter(|i| numbers[*i] == Some(0));
    let mut first: Vec<(f64, f64)> = own().map(|i| (ps[i], energies[i])).collect();
    let rises = |pair: &[(f64, f64)]| pair[0].0 <= pair[1].0;
    if !first.windows(2).all(rises) {
        first.reverse();
    }
    if set.curves.len() < 2 || !first.windows(2).all(rises) {
        return None;
    }
    first.dedup_by(|b, a| a.0 == b.0);
    // The parabola through three neighbours.
    let at = |p: f64| {
        let n = first.len();
        let k = first.partition_point(|(q, _)| *q < p);
        let inside = n >= 3 && first[0].0 <= p && p <= first[n - 1].0;
        let three = inside.then(|| &first[k.clamp(2, n - 1) - 2..][..3])?;
        let part = |i: usize| {
            let others = (0..3).filter(|j| *j != i);
            others
                .map(|j| (p - three[j].0) / (three[i].0 - three[j].0))
                .product::<f64>()
        };
        Some((0..3).map(|i| three[i].1 * part(i)).sum::<f64>())
    };
    let less = ps.iter().zip(energies);
    let less: Vec<f64> = less
        .map(|(p, e)| at(*p).map_or(f64::NAN, |own| e - own))
        .collect();
    let finite: Vec<f64> = less.iter().copied().filter(|e| e.is_finite()).collect();
    (span(&finite) < CLOSE * span(energies)).then_some(less)
}

/// Fold curves: the second parameter over the first.
pub fn fold_curves(record: &BranchRecord, folds: &FoldCurves) -> BranchDiagram {
    let points = &folds.curves.points;
    let (ps, qs) = (points.reals("parameter"), points.reals("second"));
    let y_label = folds.label(record.units);
    BranchDiagram {
        title: String::new(),
        x_label: record.label(),
        x_range: None,
        panels: vec![panel("fold curve", &folds.curves, y_label, ps, qs)],
        folds: true,
        without_potential: !record.conservative,
    }
}

/// Shapes along the branches.
pub fn shapes(record: &BranchRecord) -> RodShapes {
    let shapes = record.shapes.iter();
    RodShapes {
        rods: shapes
            .map(|shape| drawn(&shape.sections, Some(shape.parameter), shape.unstable))
            .collect(),
        obstacles: record.obstacles.clone(),
        value_label: record.label(),
        // Ribbons of several rods would cover each other.
        ribbon: match record.taken {
            Some(_) => 0.03 * record.length,
            None => 0.0,
        },
        triads: false,
        // A rod of an assembly may begin on a body.
        clamp: record.taken.is_some(),
        units: units(record.units),
        ..RodShapes::default()
    }
}
