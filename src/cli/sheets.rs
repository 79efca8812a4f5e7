//! `snaprod sheets`: the figures of the elastica's solution sheets.

use super::files::{print, print_json};
use super::output::{FigureArgs, Output};
use super::{Ending, Refusal};
use clap::Args;
use serde_json::json;
use snaprod::elastica::{FoldLine, GridPoint, SheetGrid, StableRegion, sheet_grid, sheet_grid_in};
use snaprod::manifold::{Sheet, Sign};
use snaprod::plot::{
    Arc, AxisUnits, Curve, EnergyLandscape, Field, FoldMap, Named, Patch, Portrait, Sheets,
    SpaceCurve, View, energy_landscape, fold_map, phase_portrait, sheets_lambda_alpha,
    sheets_over_disc,
};
use std::f64::consts::{FRAC_PI_2, PI};
use std::path::PathBuf;

#[derive(Args)]
pub struct SheetsArgs {
    /// Modes j, 0 to 3, of the sheets S_j^+- to draw.
    #[arg(
        long,
        value_delimiter = ',',
        default_value = "0,1",
        allow_hyphen_values = true
    )]
    pub modes: Vec<String>,
    /// Where to write.
    #[arg(long, default_value = "figures")]
    pub out: PathBuf,
    /// Write a PNG beside every figure (needs the feature `png`).
    #[arg(long)]
    pub png: bool,
    /// Print the list of files as one JSON object.
    #[arg(long)]
    pub json: bool,
}

/// Modes that can be drawn.
const MODES: std::ops::RangeInclusive<u32> = 0..=3;
/// Points of a sheet along p and along lam, for two modes or fewer.
const ROWS: f64 = 36.0;
const COLUMNS: f64 = 48.0;
/// Points of the maps along either axis.
const MAP: usize = 241;
/// Fold curves of the map.
const FOLDS: usize = 3;

/// What the command writes.
const FILES: &[&str] = &[
    "phase_portrait.*",
    "sheets_lambda_alpha.*",
    "sheets_over_disc.*",
    "fold_map.*",
    "energy_landscape.*",
];

/// Writes the figures.
pub fn sheets(args: &SheetsArgs) -> Result<Ending, Refusal> {
    let modes = asked_modes(&args.modes)?;
    let folds: Vec<FoldLine> = (1..=FOLDS.max(modes.len() + 1))
        .map(FoldLine::new)
        .collect::<Result<_, _>>()?;
    let region = StableRegion::new()?;
    let figures = FigureArgs {
        png: args.png,
        ..FigureArgs::default()
    };
    let out = Output::open(Some(&args.out), FILES, figures)?;
    let panels = |panels: &Vec<Sheets>| sheets_lambda_alpha(panels);
    out.figure("phase_portrait", || Ok(portrait(&modes)), phase_portrait);
    out.figure(
        "sheets_lambda_alpha",
        || lambda_alpha(&modes, &folds),
        panels,
    );
    let panels = |panels: &Vec<Sheets>| sheets_over_disc(panels);
    out.figure("sheets_over_disc", || over_disc(&modes, &folds), panels);
    out.figure("fold_map", || Ok(map(&region, &folds)), fold_map);
    out.figure("energy_landscape", || landscape(&region), energy_landscape);
    let files = out.finish()?;
    if args.json {
        print_json(json!({ "out": args.out, "files": files }));
    } else {
        for file in &files {
            print(&format!("{}\n", args.out.join(file).display()));
        }
    }
    Ok(match files.len() < FILES.len() {
        true => Ending::Short,
        false => Ending::Done,
    })
}

fn asked_modes(texts: &[String]) -> Result<Vec<u32>, Refusal> {
    let mut modes = Vec::new();
    for text in texts {
        match text.trim().parse() {
            Ok(mode) if MODES.contains(&mode) => modes.push(mode),
            _ => {
                return Err(Refusal(format!(
                    "--modes: {text:?} is no mode that can be drawn; give some of 0, 1, 2, 3, separated by commas"
                )));
            }
        }
    }
    modes.sort_unstable();
    modes.dedup();
    Ok(modes)
}

/// "S₀⁺" and so on.
fn name(sheet: Sheet) -> String {
    let digits = ['₀', '₁', '₂', '₃'];
    let sign = if sheet.sign == Sign::Plus {
        '⁺'
    } else {
        '⁻'
    };
    format!("S{}{sign}", digits[sheet.mode as usize])
}

/// Points of a sheet along p and along lam: fewer for many sheets, for the sake of the file's size.
fn size(modes: &[u32]) -> (usize, usize) {
    let share = (2.0 / modes.len().max(2) as f64).sqrt();
    ((ROWS * share) as usize, (COLUMNS * share) as usize)
}

/// The two sheets of each mode.
fn pairs(modes: &[u32]) -> Vec<Sheet> {
    let both = |&mode| [Sign::Plus, Sign::Minus].map(|sign| Sheet { mode, sign });
    modes.iter().flat_map(both).collect()
}

fn patch(grid: &SheetGrid, place: impl Fn(&GridPoint) -> [f64; 3]) -> Patch {
    let sheet = grid.sheet;
    Patch {
        name: name(sheet),
        colour: 2 * sheet.mode as usize + usize::from(sheet.sign == Sign::Minus),
        rows: grid.rows,
        columns: grid.columns,
        points: grid.points.iter().map(place).collect(),
    }
}

/// The fold curves on the sheets of a mode, both halves of each; broken where they leave them.
fn folds_on(
    mode: u32,
    folds: &[FoldLine],
    place: impl Fn(&GridPoint) -> [f64; 3],
) -> Vec<SpaceCurve> {
    let mirrored = |q: &GridPoint| GridPoint {
        p: -q.p,
        alpha: -q.alpha,
        theta1: -q.theta1,
        y: -q.y,
        ..*q
    };
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
    };
    folds
        .iter()
        .flat_map(|fold| {
            [
                curve(fold.points.iter().map(|q| shown(&mirrored(q))).collect()),
                curve(fold.points.iter().map(shown).collect()),
            ]
        })
        .filter(|curve| curve.points.iter().flatten().any(|c| c.is_finite()))
        .collect()
}

/// AMV Fig. 3.22, the sheets in (lam, alpha, theta(1)): a panel for each mode.
fn lambda_alpha(modes: &[u32], folds: &[FoldLine]) -> Result<Vec<Sheets>, Refusal> {
    let (rows, columns) = size(modes);
    // S_j begins at lam = j pi.
    let top = 9.6 + PI * f64::from(modes.last().copied().unwrap_or(1).saturating_sub(1));
    let place = |q: &GridPoint| [q.lambda, q.alpha, q.theta1];
    // Distances as in the figure; beyond its box there is nothing to sample.
    let shown = |q: &GridPoint| {
        let lam = q.lambda.min(1.05 * top) / top;
        [lam, q.alpha / (2.0 * PI), q.theta1 / (4.0 * PI)]
    };
    let panel = |&mode: &u32| {
        let mut patches = Vec::new();
        for sheet in pairs(&[mode]) {
            let grid = sheet_grid_in(sheet, rows, columns, shown)?;
            patches.push(patch(&grid, place));
        }
        Ok(Sheets {
            title: title(mode),
            patches,
            curves: folds_on(mode, folds, place),
            view: Some(View {
                azimuth: -40.0,
                elevation: 24.0,
            }),
            bounds: Some([[0.0, top], [-PI, PI], [-2.0 * PI, 2.0 * PI]]),
            ..Sheets::default()
        })
    };
    modes.iter().map(panel).collect()
}

/// AMV Fig. 3.24, the sheets over the positions of the free end: a panel for each mode.
fn over_disc(modes: &[u32], folds: &[FoldLine]) -> Result<Vec<Sheets>, Refusal> {
    let (rows, columns) = size(modes);
    let place = |q: &GridPoint| [q.x, q.y, q.theta1];
    let panel = |&mode: &u32| {
        let mut patches = Vec::new();
        for sheet in pairs(&[mode]) {
            let grid = sheet_grid(sheet, rows, columns)?;
            patches.push(patch(&grid, place));
        }
        Ok(Sheets {
            title: title(mode),
            patches,
            curves: folds_on(mode, folds, place),
            bounds: Some([[-1.05, 1.05], [-1.05, 1.05], [-2.0 * PI, 2.0 * PI]]),
            ..Sheets::default()
        })
    };
    modes.iter().map(panel).collect()
}

fn title(mode: u32) -> String {
    match mode {
        0 => "j = 0: θ′ has no zero inside the rod".into(),
        1 => "j = 1: one zero of θ′".into(),
        _ => format!("j = {mode}: {mode} zeros of θ′"),
    }
}

/// Fold curve and mirror image over the disc.
fn halves(fold: &FoldLine) -> Vec<Curve> {
    [-1.0, 1.0]
        .map(|side| Curve::new(fold.points.iter().map(|q| [q.x, side * q.y])))
        .into()
}

fn map(region: &StableRegion, folds: &[FoldLine]) -> FoldMap {
    let folds = &folds[..FOLDS];
    let cusps = folds.iter().flat_map(|fold| &fold.cusps);
    FoldMap {
        counts: Field::over_disc(MAP, 1.0, |x, y| {
            if x.hypot(y) < 1.0 {
                region.stable_count(x, y) as f64
            } else {
                f64::NAN
            }
        }),
        cusps: cusps.flat_map(|q| [[q.x, q.y], [q.x, -q.y]]).collect(),
        folds: folds.iter().map(halves).collect(),
        units: AxisUnits::default(),
    }
}

fn landscape(region: &StableRegion) -> Result<EnergyLandscape, Refusal> {
    let energies = region.lowest_energies(MAP)?;
    let field = |k: usize| Field {
        x: [-1.0, 1.0],
        y: [-1.0, 1.0],
        columns: MAP,
        rows: MAP,
        values: energies.iter().map(|e| e[k]).collect(),
    };
    Ok(EnergyLandscape {
        panels: vec![
            ("lowest stable equilibrium".into(), field(0)),
            ("second lowest".into(), field(1)),
        ],
        folds: halves(&region.border),
        range: Some([0.0, 60.0]),
        ..EnergyLandscape::default()
    })
}

/// AMV Fig. 3.12: orbits of psi'' + lam^2 sin psi = 0, and on one of them the solutions of a given alpha,
/// arcs from the clamp, psi = -alpha, to the free end, psi_s = 0.
fn portrait(modes: &[u32]) -> Portrait {
    const K: f64 = 0.75;
    const CLAMP: f64 = -0.7;
    // sin(psi/2) = k sin phi and psi_s/lam = 2 k cos phi: clockwise as phi grows.
    let on = |k: f64, phi: f64| [2.0 * (k * phi.sin()).asin(), 2.0 * k * phi.cos()];
    let run = |k: f64, from: f64, to: f64| {
        Curve::new((0..=300).map(|i| on(k, from + (to - from) * f64::from(i) / 300.0)))
    };
    let a = ((0.5 * CLAMP).sin() / K).asin();
    let c = PI - a;
    let arcs = pairs(modes).into_iter().map(|sheet| {
        // Both ends, B and D, are passed in turn: S_j^+ starts at A and S_j^- at C.
        let plus = sheet.sign == Sign::Plus;
        let (from, first) = if plus { (a, FRAC_PI_2) } else { (c, 1.5 * PI) };
        let letters = if plus { ["AB", "CD"] } else { ["CD", "AB"] };
        let path: String = (0..=sheet.mode).map(|i| letters[i as usize % 2]).collect();
        Arc {
            name: format!("{path}: {}", name(sheet)),
            curve: run(K, from, first + PI * f64::from(sheet.mode)),
        }
    });
    let separatrix = |side: f64| {
        Curve::new((0..=200).map(|i| {
            let psi = PI * (f64::from(i) / 100.0 - 1.0);
            [psi, side * 2.0 * (0.5 * psi).cos()]
        }))
    };
    let named = |name: &str, phi| Named {
        name: name.into(),
        at: on(K, phi),
    };
    Portrait {
        orbits: [0.25, 0.5, 0.75, 0.93]
            .iter()
            .map(|&k| run(k, 0.0, 2.0 * PI))
            .collect(),
        separatrix: vec![separatrix(1.0), separatrix(-1.0)],
        verticals: vec![CLAMP],
        arcs: arcs.collect(),
        points: vec![
            named("A", a),
            named("B", FRAC_PI_2),
            named("C", c),
            named("D", 1.5 * PI),
        ],
    }
}
