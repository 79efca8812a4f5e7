//! Data of branches for a page: points, special points, and shapes of the rods.

use super::numbers::{quantized, units};
use serde_json::{Value, json};
use snaprod::rod::RodSection;
use snaprod::study::branch::{BranchRecord, CurveSet, FoldCurves, ShapeRecord};
use snaprod::study::{Column, Values};
use std::collections::BTreeMap;

/// Bounds on the number of sections of a rod, and on the number of sections in all pictures together.
const SECTIONS: usize = 31;
const FEWEST: usize = 9;
const IN_ALL: usize = 8_000;
/// Relative range of a column, against the largest values of its unit, below which its variation is rounding.
const ROUNDING: f64 = 1e-8;
/// Bound on the number of rows of a page; of more rows every second, third, ... is left out.
const ROWS: usize = 1200;
/// Bound on the number of columns of a page.
const COLUMNS: usize = 24;

/// Data of the page of branches; `shown` is the column drawn first.
pub fn branch_data(record: &BranchRecord, shown: &str) -> Value {
    let set = &record.branches;
    let table = &set.points;
    let rows = rows(record);
    let pick = |values: &[f64]| rows.iter().map(|k| values[*k]).collect::<Vec<f64>>();
    let columns = columns(&table.columns, shown).into_iter().map(|column| {
        json!({
            "name": column.name,
            "unit": column.unit,
            "meaning": column.meaning,
            "values": quantized(&pick(table.reals(&column.name))),
        })
    });
    let place = |row: usize| rows.binary_search(&row).unwrap_or_default();
    let specials = set.specials.iter().filter_map(|at| {
        let [before, after] = at.index;
        Some(json!({
            "row": place(set.row(at)?),
            "label": at.label,
            "kind": at.kind_name(),
            "index": [before, after],
        }))
    });
    let (numbers, index) = (set.numbers(), table.integers("index"));
    json!({
        "kind": "branch",
        "units": { "length": record.units.length() },
        "length": record.length,
        "parameter": record.label(),
        "conservative": record.conservative,
        "at": quantized(&pick(table.reals("parameter"))),
        "branch": rows.iter().map(|k| numbers[*k]).collect::<Vec<_>>(),
        "index": rows.iter().map(|k| index[*k]).collect::<Vec<_>>(),
        "columns": columns.collect::<Vec<_>>(),
        "shown": shown,
        "specials": specials.collect::<Vec<_>>(),
        "pictures": pictures(record, place),
        "folds": record.fold_curves.as_ref().map(|folds| fold_curves(record, folds)),
    })
}

/// Rows of the page: all, or a selection with every row that is special or has a shape.
fn rows(record: &BranchRecord) -> Vec<usize> {
    let count = record.branches.points.rows();
    let stride = count.div_ceil(ROWS).max(1);
    let labels = record.branches.points.words("label");
    let shaped: Vec<usize> = record.pictures.iter().map(|shape| shape.row).collect();
    let wanted = |k: &usize| {
        k.is_multiple_of(stride) || !labels[*k].is_empty() || shaped.binary_search(k).is_ok()
    };
    (0..count).filter(wanted).collect()
}

/// Numeric columns with a visible variation, and always `shown`.
fn columns<'c>(columns: &'c [Column], shown: &str) -> Vec<&'c Column> {
    let ends = |column: &Column| -> [f64; 2] {
        let Values::Reals(values) = &column.values else {
            return [0.0; 2];
        };
        let finite = values.iter().filter(|x| x.is_finite());
        let widest = [f64::INFINITY, f64::NEG_INFINITY];
        finite.fold(widest, |[a, b], x| [a.min(*x), b.max(*x)])
    };
    let mut scales: BTreeMap<&str, f64> = BTreeMap::new();
    for column in columns {
        let [low, high] = ends(column);
        let scale = scales.entry(&column.unit).or_default();
        *scale = scale.max(high).max(-low);
    }
    let tells = |column: &&Column| {
        let [low, high] = ends(column);
        let own = matches!(
            column.name.as_ref(),
            "parameter" | "arclength" | "residual" | "error"
        );
        let scale = scales.get(column.unit.as_ref()).copied().unwrap_or(0.0);
        column.name == shown || !own && high - low > ROUNDING * scale
    };
    let mut found: Vec<&Column> = columns.iter().filter(tells).collect();
    found.sort_by_key(|column| column.name != shown);
    found.truncate(COLUMNS);
    found
}

/// Shapes: the rows that have them, and each rod over these rows; bodies of an assembly as points.
fn pictures(record: &BranchRecord, place: impl Fn(usize) -> usize) -> Value {
    let mut by_row: BTreeMap<usize, Vec<&ShapeRecord>> = BTreeMap::new();
    for shape in &record.pictures {
        by_row.entry(shape.row).or_default().push(shape);
    }
    let most = by_row.values().map(Vec::len).max().unwrap_or(0);
    by_row.retain(|_, rods| rods.len() == most && rods.iter().all(|rod| rod.sections.len() > 1));
    let count = (IN_ALL / (most * by_row.len()).max(1)).clamp(FEWEST, SECTIONS);
    let rod = |k: usize| {
        let sections: Vec<&RodSection> = by_row
            .values()
            .flat_map(|rods| {
                let last = rods[k].sections.len() - 1;
                (0..count).map(move |i| &rods[k].sections[i * last / (count - 1)])
            })
            .collect();
        let places = sections.iter().flat_map(|at| at.position.data.0[0]);
        let across = sections.iter().map(|at| at.directors.column(0));
        json!({
            "sections": count,
            "at": quantized(&places.collect::<Vec<f64>>()),
            "d1": units(across.flat_map(|d| [d[0], d[1], d[2]])),
        })
    };
    let table = &record.branches.points;
    let names = table.columns.iter().map(|column| column.name.as_ref());
    let bodies = names.filter_map(|name| name.strip_suffix(".qw"));
    let body = |name: &str| {
        let part = |axis| {
            let all = table.reals(&format!("{name}.{axis}"));
            quantized(&by_row.keys().map(|row| all[*row]).collect::<Vec<f64>>())
        };
        let place = ["x", "y", "z"].map(part);
        json!({ "name": name, "at": place })
    };
    json!({
        "rows": by_row.keys().map(|row| place(*row)).collect::<Vec<_>>(),
        "rods": (0..most).map(rod).collect::<Vec<_>>(),
        "bodies": bodies.map(body).collect::<Vec<_>>(),
    })
}

/// Curves of folds over both parameters.
fn fold_curves(record: &BranchRecord, folds: &FoldCurves) -> Value {
    let CurveSet {
        points,
        curves,
        specials,
    } = &folds.curves;
    let (x, y) = (points.reals("parameter"), points.reals("second"));
    let numbers = folds.curves.numbers();
    let curve = |number: usize| {
        let own: Vec<usize> = (0..x.len())
            .filter(|k| numbers[*k] == Some(number as i64))
            .collect();
        let part =
            |values: &[f64]| quantized(&own.iter().map(|k| values[*k]).collect::<Vec<f64>>());
        json!({ "x": part(x), "y": part(y) })
    };
    let special = specials.iter().map(|at| {
        json!({ "label": at.label, "kind": at.kind_name(), "x": at.parameter, "y": at.second })
    });
    json!({
        "x": record.label(),
        "y": folds.label(record.units),
        "curves": (0..curves.len()).map(curve).collect::<Vec<_>>(),
        "specials": special.collect::<Vec<_>>(),
    })
}
