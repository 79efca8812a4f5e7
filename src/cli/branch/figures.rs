//! Figures of branches: the bifurcation diagram, fold curves, shapes.

use super::super::Refusal;
use super::super::equilibrium::{drawn, units};
use super::follow::{Located, Row};
use snaprod::plot::{
    Branch as Line, BranchDiagram, BranchPanel, RodShapes, Special as Mark, SpecialKind,
    branch_diagram, rod_shapes,
};
use snaprod::scene::{Continue, Second, Statics, Units};
use snaprod::solve::special::Kind;

/// Shapes in the figure of shapes.
const SHAPES: usize = 12;

/// The component, of end position and base couple, that changes most along the branch beside the parameter itself.
fn measure(rows: &[Row], units: Units, length: f64) -> (String, Vec<f64>) {
    let component = |k: usize| -> Vec<f64> {
        let pick = |row: &Row| {
            if k < 3 {
                row.state.end.position[k] / length
            } else {
                row.state.base[k - 3]
            }
        };
        rows.iter().map(pick).collect()
    };
    let span = |values: &[f64]| {
        let low = values.iter().copied().fold(f64::INFINITY, f64::min);
        let high = values.iter().copied().fold(f64::NEG_INFINITY, f64::max);
        high - low
    };
    let ps: Vec<f64> = rows.iter().map(|row| row.p).collect();
    // A held component is the parameter, or constant.
    let follows = |values: &[f64]| {
        let offset = values[0] * length - ps[0];
        values
            .iter()
            .zip(&ps)
            .all(|(v, p)| (v * length - p - offset).abs() < 1e-9 * length)
    };
    let best = |range: std::ops::Range<usize>| {
        range
            .map(|k| (k, component(k)))
            .filter(|(_, values)| !follows(values) && span(values) > 1e-6)
            .max_by(|a, b| span(&a.1).total_cmp(&span(&b.1)))
    };
    let names = [
        "x of the end",
        "y of the end",
        "z of the end",
        "base couple mx",
        "base couple my",
        "base couple mz",
    ];
    let couple = units.couple();
    match best(0..3).or_else(|| best(3..6)) {
        Some((k, values)) if k < 3 => {
            let values = values.iter().map(|v| v * length).collect();
            (Units::label(names[k], units.length()), values)
        }
        Some((k, values)) => (Units::label(names[k], couple), values),
        None => (Units::label(names[3], couple), component(3)),
    }
}

/// A panel of lines and marks: `x` and `y` of each row.
fn panel<const N: usize>(
    rows: &[Row],
    located: &[Located<N>],
    y_label: String,
    (x, y): (&[f64], &[f64]),
) -> BranchPanel {
    let last = rows.iter().map(|row| row.curve).max().unwrap_or(0);
    let line = |number: usize| {
        let own = || (0..rows.len()).filter(move |&i| rows[i].curve == number);
        Line {
            name: String::new(),
            x: own().map(|i| x[i]).collect(),
            y: own().map(|i| y[i]).collect(),
            index: own().map(|i| rows[i].index).collect(),
            colour: None,
        }
    };
    let mark = |at: &Located<N>| {
        let i = rows.iter().position(|row| row.label == at.label)?;
        let kind = match at.special.kind {
            Kind::Fold => SpecialKind::Fold,
            Kind::BranchPoint => SpecialKind::BranchPoint,
            Kind::Cusp => SpecialKind::Cusp,
            Kind::StabilityChange | Kind::Event => SpecialKind::StabilityChange,
        };
        Some(Mark {
            x: x[i],
            y: y[i],
            kind,
            label: at.label.clone(),
        })
    };
    BranchPanel {
        y_label,
        y_range: None,
        branches: (0..=last).map(line).collect(),
        specials: located.iter().filter_map(mark).collect(),
    }
}

/// The bifurcation diagram: a measure of the rods and their energy over the parameter.
pub fn diagram<const N: usize>(
    scene: &Statics,
    wanted: &Continue,
    rows: &[Row],
    located: &[Located<N>],
) -> Result<String, Refusal> {
    let ps: Vec<f64> = rows.iter().map(|row| row.p).collect();
    let (name, values) = measure(rows, scene.units, scene.rod.length);
    let energies: Vec<f64> = rows.iter().map(|row| row.state.end.energy).collect();
    let energy = Units::label("stored energy", scene.units.energy());
    Ok(branch_diagram(&BranchDiagram {
        title: String::new(),
        x_label: wanted.parameter.label(scene.units),
        x_range: None,
        panels: vec![
            panel(rows, located, name, (&ps, &values)),
            panel(rows, located, energy, (&ps, &energies)),
        ],
        folds: false,
    })?)
}

/// Fold curves: the second parameter over the first.
pub fn fold_curves<const M: usize>(
    scene: &Statics,
    wanted: &Continue,
    second: &Second,
    rows: &[Row],
    located: &[Located<M>],
) -> Result<String, Refusal> {
    let ps: Vec<f64> = rows.iter().map(|row| row.p).collect();
    let qs: Vec<f64> = rows.iter().filter_map(|row| row.q).collect();
    let y_label = second.parameter.label(scene.units);
    Ok(branch_diagram(&BranchDiagram {
        title: String::new(),
        x_label: wanted.parameter.label(scene.units),
        x_range: None,
        panels: vec![panel(rows, located, y_label, (&ps, &qs))],
        folds: true,
    })?)
}

/// Shapes along the branches.
pub fn shapes(scene: &Statics, wanted: &Continue, rows: &[Row]) -> Result<String, Refusal> {
    let last = rows.len() - 1;
    let shown = SHAPES.min(rows.len());
    let mut rods = Vec::new();
    for k in 0..shown {
        let row = &rows[k * last / (shown - 1).max(1)];
        let problem = scene.with(&wanted.parameter, row.p).problem()?;
        let sections = problem.shape(&row.state.base, 121)?;
        rods.push(drawn(
            &sections,
            Some(row.p),
            row.index.is_some_and(|i| i > 0),
        ));
    }
    Ok(rod_shapes(&RodShapes {
        rods,
        value_label: wanted.parameter.label(scene.units),
        ribbon: 0.03 * scene.rod.length,
        triads: false,
        units: units(scene),
        ..RodShapes::default()
    })?)
}
