//! Figures of branches: the bifurcation diagram, fold curves, shapes.

use super::super::Refusal;
use super::super::equilibrium::{drawn, units};
use super::follow::{Located, Row};
use snaprod::plot::{
    Branch as Line, BranchDiagram, BranchPanel, RodShapes, Special as Mark, SpecialKind,
};
use snaprod::scene::{Continue, Scene, Second, Units};
use snaprod::solve::special::Kind;

/// More branches than this have no names in a figure.
const MOST_NAMES: usize = 8;
/// If there are more special points than this, only those of the first branch have labels.
const MOST_LABELS: usize = 16;
/// Shapes in the figure of shapes.
const SHAPES: usize = 12;

/// The component of the end's position that shows most beside the parameter itself, or else of the base couple: its name, and its
/// value on all rows.
fn measure(rows: &[Row], units: Units, length: f64) -> (String, Vec<f64>) {
    let ps: Vec<f64> = rows.iter().map(|row| row.p).collect();
    let position = |k: usize| rows.iter().map(|row| row.state.end.position[k]).collect();
    let couple = |k: usize| rows.iter().map(|row| row.state.base[k]).collect();
    let own = rows.iter().take_while(|row| row.curve == 0).count();
    let score = |values: &Vec<f64>| {
        let bent = bend(&ps, values);
        // The scene's own branch counts more than those found beside it; what follows the parameter shows little.
        span(&bent[..own]) + 0.5 * span(&bent) + 1e-3 * span(values)
    };
    let best = |lists: [Vec<f64>; 3]| {
        let scored = lists.into_iter().enumerate();
        scored
            .map(|(k, values)| (score(&values), k, values))
            .max_by(|a, b| a.0.total_cmp(&b.0))
    };
    let name = |what: &str, k: usize| format!("{what}{}", ["x", "y", "z"][k]);
    let end = best([position(0), position(1), position(2)]);
    // A held component is constant or the parameter.
    if let Some((_, k, values)) = end.filter(|(score, ..)| *score > 2e-3 * length) {
        let name = format!("{} of the end", name("", k));
        return (Units::label(&name, units.length()), values);
    }
    match best([couple(0), couple(1), couple(2)]) {
        Some((_, k, values)) => (
            Units::label(&name("base couple m", k), units.couple()),
            values,
        ),
        None => (String::new(), Vec::new()),
    }
}

fn span(values: &[f64]) -> f64 {
    let values = values.iter().copied();
    values.clone().fold(f64::NEG_INFINITY, f64::max) - values.fold(f64::INFINITY, f64::min)
}

/// The values less the straight line through them that fits best.
fn bend(x: &[f64], y: &[f64]) -> Vec<f64> {
    let n = x.len().max(1) as f64;
    let (mx, my) = (x.iter().sum::<f64>() / n, y.iter().sum::<f64>() / n);
    let points = || x.iter().zip(y).map(|(x, y)| (x - mx, y - my));
    let (up, over) = points().fold((0.0, 0.0), |(a, b), (x, y)| (a + x * y, b + x * x));
    let slope = if over > 0.0 { up / over } else { 0.0 };
    points().map(|(x, y)| y - slope * x).collect()
}

/// A panel of lines and marks: `x` and `y` of each row. `name` says what the lines are.
fn panel<const N: usize>(
    name: &str,
    rows: &[Row],
    located: &[Located<N>],
    y_label: String,
    (x, y): (&[f64], &[f64]),
) -> BranchPanel {
    let last = rows.iter().map(|row| row.curve).max().unwrap_or(0);
    let named = (1..MOST_NAMES).contains(&last);
    let line = |number: usize| {
        let own = || (0..rows.len()).filter(move |&i| rows[i].curve == number);
        Line {
            name: match named {
                true => format!("{name} {number}"),
                false => String::new(),
            },
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
            label: match at.curve == 0 || located.len() <= MOST_LABELS {
                true => at.label.clone(),
                false => String::new(),
            },
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
    scene: &Scene,
    wanted: &Continue,
    rows: &[Row],
    located: &[Located<N>],
) -> BranchDiagram {
    let ps: Vec<f64> = rows.iter().map(|row| row.p).collect();
    let (measured, values) = measure(rows, scene.units, scene.rod.length);
    let energies: Vec<f64> = rows.iter().map(|row| row.state.end.energy).collect();
    let energy = Units::label("stored energy", scene.units.energy());
    BranchDiagram {
        title: String::new(),
        x_label: wanted.parameter.label(scene.units),
        x_range: None,
        panels: vec![
            panel("branch", rows, located, measured, (&ps, &values)),
            panel("branch", rows, located, energy, (&ps, &energies)),
        ],
        folds: false,
    }
}

/// Fold curves: the second parameter over the first.
pub fn fold_curves<const M: usize>(
    scene: &Scene,
    wanted: &Continue,
    second: &Second,
    rows: &[Row],
    located: &[Located<M>],
) -> BranchDiagram {
    let ps: Vec<f64> = rows.iter().map(|row| row.p).collect();
    let qs: Vec<f64> = rows.iter().filter_map(|row| row.q).collect();
    let y_label = second.parameter.label(scene.units);
    BranchDiagram {
        title: String::new(),
        x_label: wanted.parameter.label(scene.units),
        x_range: None,
        panels: vec![panel("fold curve", rows, located, y_label, (&ps, &qs))],
        folds: true,
    }
}

/// Shapes along the branches.
pub fn shapes(scene: &Scene, wanted: &Continue, rows: &[Row]) -> Result<RodShapes, Refusal> {
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
    Ok(RodShapes {
        rods,
        value_label: wanted.parameter.label(scene.units),
        ribbon: 0.03 * scene.rod.length,
        triads: false,
        units: units(scene),
        ..RodShapes::default()
    })
}
