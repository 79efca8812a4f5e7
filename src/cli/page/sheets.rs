//! Data of the solution sheets for a page: two views of the sheets, the map of stable equilibria over the disc, and
//! shapes of rods at nodes.

use super::numbers::{base64, quantized};
use crate::cli::sheets::figures::{folds_on, halves};
use serde_json::{Value, json};
use snaprod::Result;
use snaprod::elastica::{Elastica, Equilibrium, GridPoint, SheetGrid};
use snaprod::manifold::EquilibriumManifold;
use snaprod::plot::{Curve, SpaceCurve};
use snaprod::study::SheetsRecord;
use snaprod::study::sheets::StableMap;
use std::f64::consts::PI;

/// Strides along p and along lam between nodes with a shown rod.
const EVERY: [usize; 2] = [3, 4];
/// Number of sections of a shown rod.
const SECTIONS: usize = 17;
/// Least distance of the points of a fold curve, in parts of their box.
const APART: f64 = 0.005;
/// Ratio by which the sheets exceed the box of the loads, at whose border they are clipped.
const LOAD_MARGIN: f64 = 1.5;
/// Tolerance of the end of the rod at a chart point.
const HELD: f64 = 1e-6;
/// Stride of the map of stable equilibria in the points of its record.
const COARSER: usize = 2;

/// Data of the page of the sheets. An interrupted study has only a part of the data.
///
/// # Errors
/// Errors of the elastica, which do not occur in practice.
pub fn sheets_data(record: &SheetsRecord) -> Result<Value> {
    let top = record.top_load;
    let disc = |q: &GridPoint| [q.x, q.y, q.theta1];
    let load = |q: &GridPoint| [q.lambda.min(LOAD_MARGIN * top), q.alpha, q.theta1];
    Ok(json!({
        "kind": "sheets",
        "sheets": record.over_disc.iter().map(|grid| json!({
            "name": grid.sheet.to_string(),
            "mode": grid.sheet.mode,
        })).collect::<Vec<_>>(),
        "views": [
            view(record, &record.over_disc, disc, [[-1.05, 1.05], [-1.05, 1.05], [-2.0 * PI, 2.0 * PI]]),
            view(record, &record.over_load, load, [[0.0, top], [-PI, PI], [-2.0 * PI, 2.0 * PI]]),
        ],
        "nodes": record.over_disc.iter().map(nodes).collect::<Result<Vec<_>>>()?,
        "map": record.stable.as_ref().map(map),
        "folds": record.folds.iter().flat_map(halves).map(|fold| flat(&fold)).collect::<Vec<_>>(),
    }))
}

/// A curve in the plane.
fn flat(curve: &Curve) -> Value {
    let points = curve.x.iter().zip(&curve.y).map(|(x, y)| [*x, *y]);
    let points = sparse(points, [1.0; 2]);
    let part = |i: usize| quantized(&points.iter().map(|p| p[i]).collect::<Vec<_>>());
    json!({ "x": part(0), "y": part(1) })
}

/// Points with a least distance from the previous one, in parts of the sizes of the axes; gaps are kept.
fn sparse<const N: usize>(
    points: impl Iterator<Item = [f64; N]>,
    sizes: [f64; N],
) -> Vec<[f64; N]> {
    let mut kept: Vec<[f64; N]> = Vec::new();
    for p in points {
        let gap = p.iter().any(|x| x.is_nan());
        let wanted = kept.last().is_none_or(|last| {
            let parts = (0..N).map(|i| (p[i] - last[i]) / sizes[i]);
            let way = parts.map(|part| part * part).sum::<f64>().sqrt();
            if last.iter().any(|x| x.is_nan()) {
                !gap
            } else {
                gap || way >= APART
            }
        });
        if wanted {
            kept.push(p);
        }
    }
    kept
}

/// Positions of points, encoded with one range per axis.
fn axes(points: impl Iterator<Item = [f64; 3]>) -> [Value; 3] {
    let points: Vec<[f64; 3]> = points.collect();
    [0, 1, 2].map(|i| quantized(&points.iter().map(|p| p[i]).collect::<Vec<_>>()))
}

/// Sheets in a box, with the fold curves on them.
fn view(
    record: &SheetsRecord,
    grids: &[SheetGrid],
    place: impl Fn(&GridPoint) -> [f64; 3] + Copy,
    bounds: [[f64; 2]; 3],
) -> Value {
    let inside = |p: &[f64; 3]| (0..3).all(|i| bounds[i][0] <= p[i] && p[i] <= bounds[i][1]);
    let sizes = bounds.map(|[low, high]| high - low);
    let patch = |grid: &SheetGrid| {
        json!({
            "rows": grid.rows,
            "columns": grid.columns,
            "at": axes(grid.points.iter().map(place)),
        })
    };
    let fold = |mode: &u32| {
        let curves = folds_on(*mode, &record.folds, place);
        let curve = |curve: SpaceCurve| {
            let points = curve.points.into_iter();
            let points = points.map(|p| if inside(&p) { p } else { [f64::NAN; 3] });
            axes(sparse(points, sizes).into_iter())
        };
        curves.into_iter().map(curve).collect::<Vec<_>>()
    };
    json!({
        "bounds": bounds,
        "patches": grids.iter().map(patch).collect::<Vec<_>>(),
        "folds": record.modes.iter().map(fold).collect::<Vec<_>>(),
        "modes": record.modes,
    })
}

/// Rods at selected nodes of a sheet: labels, index, shape.
fn nodes(grid: &SheetGrid) -> Result<Value> {
    let mut chosen: Vec<&GridPoint> = Vec::new();
    let (rows, columns) = (
        grid.rows.div_ceil(EVERY[0]),
        grid.columns.div_ceil(EVERY[1]),
    );
    for row in (0..grid.rows).step_by(EVERY[0]) {
        let of_row = (0..grid.columns).step_by(EVERY[1]);
        chosen.extend(of_row.map(|column| &grid.points[row * grid.columns + column]));
    }
    let mut shapes = Vec::new();
    let mut index = Vec::new();
    for q in &chosen {
        shapes.extend(rod(q).into_iter().flatten());
        index.push(Elastica.index(&[q.p, q.w].into()).ok());
    }
    let part =
        |of: fn(&GridPoint) -> f64| quantized(&chosen.iter().map(|q| of(q)).collect::<Vec<_>>());
    Ok(json!({
        "rows": rows,
        "columns": columns,
        "sections": SECTIONS,
        "shape": quantized(&shapes),
        "index": index,
        "kappa": part(|q| q.p.tanh()),
        "lambda": part(|q| q.lambda),
        "alpha": part(|q| q.alpha),
        "theta": part(|q| q.theta1),
        "x": part(|q| q.x),
        "y": part(|q| q.y),
    }))
}

/// The rod of a node; NaN if its loop is so small that the chart point does not determine the end.
fn rod(q: &GridPoint) -> Vec<[f64; 2]> {
    let last = SECTIONS - 1;
    let even = |k: usize| k as f64 / last as f64;
    // Without a force the rod is straight at every chart point.
    let Ok(rod) = Equilibrium::new(q.p, q.w) else {
        return (0..=last).map(|k| [even(k), 0.0]).collect();
    };
    if (rod.x - q.x).hypot(rod.y - q.y) > HELD {
        return vec![[f64::NAN; 2]; SECTIONS];
    }
    let curve = rod.curve(SECTIONS);
    curve.iter().map(|at| [at.x, at.y]).collect()
}

/// Number of stable equilibria over the square: one byte each, 255 out of reach of the end.
fn map(stable: &StableMap) -> Value {
    let n = stable.points;
    let along = || (0..n).step_by(COARSER);
    let counts = along().flat_map(|row| along().map(move |column| row * n + column));
    let bytes = counts.map(|k| stable.counts[k].map_or(255, |count| count.min(254) as u8));
    json!({ "points": along().count(), "counts": base64(&bytes.collect::<Vec<u8>>()) })
}
