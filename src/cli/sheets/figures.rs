//! Figures of the solution sheets, from their record.

use snaprod::elastica::folds::index;
use snaprod::elastica::{FoldLine, GridPoint, SheetGrid};
use snaprod::manifold::{Sheet, Sign};
use snaprod::plot::{
    Arc, AxisUnits, Curve, EnergyLandscape, Field, FoldMap, NamedPoint, Patch, Portrait, Sheets,
    SpaceCurve, View,
};
use snaprod::study::SheetsRecord;
use snaprod::study::sheets::{StableMap, phase_plane};
use std::f64::consts::PI;

/// Number of fold curves of the map.
const FOLDS: usize = 3;

/// Name of a sheet, such as "S₀⁺".
pub fn sheet_name(sheet: Sheet) -> String {
    const DIGITS: [char; 10] = ['₀', '₁', '₂', '₃', '₄', '₅', '₆', '₇', '₈', '₉'];
    let mode = sheet.mode.to_string();
    let digits = mode.bytes().map(|digit| DIGITS[usize::from(digit - b'0')]);
    let sign = match sheet.sign {
        Sign::Plus => '⁺',
        Sign::Minus => '⁻',
    };
    format!("S{}{sign}", digits.collect::<String>())
}

fn patch(grid: &SheetGrid, place: impl Fn(&GridPoint) -> [f64; 3]) -> Patch {
    let sheet = grid.sheet;
    Patch {
        name: sheet_name(sheet),
        colour: 2 * sheet.mode as usize + usize::from(sheet.sign == Sign::Minus),
        rows: grid.rows,
        columns: grid.columns,
        points: grid.points.iter().map(place).collect(),
        unstable: (grid.points.iter())
            .map(|q| !index(q.p, q.w).is_ok_and(|index| index == 0))
            .collect(),
    }
}

/// Fold curves on the sheets of a mode, both halves of each; broken where a curve leaves the sheets.
pub fn folds_on(
    mode: u32,
    folds: &[FoldLine],
    place: impl Fn(&GridPoint) -> [f64; 3],
) -> Vec<SpaceCurve> {
    let shown = |q: &GridPoint| {
        if (q.w / PI).ceil() - 1.0 == f64::from(mode) {
            place(q)
        } else {
            [f64::NAN; 3]
        }
    };
    let curve = |points: Vec<[f64; 3]>| SpaceCurve {
        name: "fold".into(),
        points,
        straight: false,
    };
    folds
        .iter()
        .flat_map(|fold| {
            [
                curve(fold.points.iter().map(|q| shown(&q.mirrored())).collect()),
                curve(fold.points.iter().map(shown).collect()),
            ]
        })
        .filter(|curve| curve.points.iter().flatten().any(|c| c.is_finite()))
        .collect()
}

/// One panel per mode of these grids; `place` maps grid points to space.
fn panels(
    record: &SheetsRecord,
    grids: &[SheetGrid],
    place: impl Fn(&GridPoint) -> [f64; 3] + Copy,
    bounds: [[f64; 2]; 3],
    view: Option<View>,
) -> Vec<Sheets> {
    let panel = |&mode: &u32| {
        let own = grids.iter().filter(|grid| grid.sheet.mode == mode);
        Sheets {
            title: title(mode),
            patches: own.map(|grid| patch(grid, place)).collect(),
            curves: folds_on(mode, &record.folds, place),
            view,
            bounds: Some(bounds),
            ..Sheets::default()
        }
    };
    record.modes.iter().map(panel).collect()
}

/// AMV Fig. 3.22, the sheets in (lam, alpha, theta(1)).
pub fn over_load(record: &SheetsRecord) -> Vec<Sheets> {
    let bounds = [[0.0, record.top_load], [-PI, PI], [-2.0 * PI, 2.0 * PI]];
    let view = View {
        azimuth: -40.0,
        elevation: 24.0,
    };
    let place = |q: &GridPoint| [q.lambda, q.alpha, q.theta1];
    let mut panels = panels(record, &record.over_load, place, bounds, Some(view));
    // Trivial solutions: under a load along its axis the rod is straight, compressed (alpha = 0) or pulled (alpha =
    // pi).
    let straight = [-PI, 0.0, PI].map(|alpha| SpaceCurve {
        name: "straight rod".into(),
        points: (0..=200)
            .map(|k| [record.top_load * f64::from(k) / 200.0, alpha, 0.0])
            .collect(),
        straight: true,
    });
    for panel in &mut panels {
        panel.curves.extend(straight.iter().cloned());
    }
    panels
}

/// AMV Fig. 3.24, the sheets over the positions of the free end.
pub fn over_disc(record: &SheetsRecord) -> Vec<Sheets> {
    let bounds = [[-1.05, 1.05], [-1.05, 1.05], [-2.0 * PI, 2.0 * PI]];
    let place = |q: &GridPoint| [q.x, q.y, q.theta1];
    panels(record, &record.over_disc, place, bounds, None)
}

fn title(mode: u32) -> String {
    match mode {
        0 => "j = 0: θ′ has no zero inside the rod".into(),
        1 => "j = 1: one zero of θ′".into(),
        _ => format!("j = {mode}: {mode} zeros of θ′"),
    }
}

/// Fold curve and mirror image over the disc.
pub fn halves(fold: &FoldLine) -> Vec<Curve> {
    [-1.0, 1.0]
        .map(|side| Curve::new(fold.points.iter().map(|q| [q.x, side * q.y])))
        .into()
}

/// A field over the square of the map.
fn field(stable: &StableMap, values: Vec<f64>) -> Field {
    Field {
        x: [-1.0, 1.0],
        y: [-1.0, 1.0],
        columns: stable.points,
        rows: stable.points,
        values,
    }
}

/// Number of stable equilibria, with the fold curves.
pub fn map(stable: &StableMap, folds: &[FoldLine]) -> FoldMap {
    let folds = &folds[..FOLDS];
    let cusps = folds.iter().flat_map(|fold| &fold.cusps);
    let counts = stable.counts.iter();
    let counts = counts.map(|count| count.map_or(f64::NAN, |count| count as f64));
    FoldMap {
        counts: field(stable, counts.collect()),
        cusps: cusps.flat_map(|q| [[q.x, q.y], [q.x, -q.y]]).collect(),
        folds: folds.iter().map(halves).collect(),
        units: AxisUnits::default(),
    }
}

/// Energies of the two lowest stable equilibria, with the border of stability.
pub fn landscape(stable: &StableMap, folds: &[FoldLine]) -> EnergyLandscape {
    let energies = |k: usize| field(stable, stable.lowest.iter().map(|e| e[k]).collect());
    EnergyLandscape {
        panels: vec![
            ("lowest stable equilibrium".into(), energies(0)),
            ("second lowest".into(), energies(1)),
        ],
        folds: halves(&folds[0]),
        range: Some([0.0, 60.0]),
        ..EnergyLandscape::default()
    }
}

/// AMV Fig. 3.12: orbits of the pendulum, and on one orbit the solutions for a given alpha.
pub fn portrait(modes: &[u32]) -> Portrait {
    let plane = phase_plane(modes);
    let curve = |points: Vec<[f64; 2]>| Curve::new(points);
    Portrait {
        orbits: plane.orbits.into_iter().map(curve).collect(),
        separatrix: plane.separatrix.map(curve).into(),
        verticals: vec![plane.clamp],
        arcs: (plane.arcs.into_iter())
            .map(|arc| Arc {
                name: format!("{}: {}", arc.path, sheet_name(arc.sheet)),
                curve: curve(arc.points),
            })
            .collect(),
        points: (plane.ends.iter())
            .map(|(name, at)| NamedPoint {
                name: name.to_string(),
                at: *at,
            })
            .collect(),
    }
}
