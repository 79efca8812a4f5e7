//! Derivatives of compared quantities by the free fields of a fit, where scenes have them: numbers of equilibria, the
//! parameter at special points of branches, motions of planar elastic rods.

use super::Fit;
use crate::scene::{ScalarField, SceneText};
use crate::study::branch::branch_by;
use crate::study::run::{NAMES, derivatives_at};
use crate::study::sweep::{SpecialName, cell};
use crate::study::{Cell, FirstOrder, Hooks, Quiet, dispatch};
use nalgebra::DMatrix;
use serde_json::Value;

/// Relative error of the derivatives of a run.
const RUN: f64 = 1e-7;

/// Derivatives of the weighted residuals by the coordinates of the box, with their errors. `None` if a quantity has no
/// derivative.
pub(super) fn of_rows(
    fit: &Fit,
    at: &[f64],
    noise: &[f64],
    hooks: &mut dyn Hooks,
) -> Option<[DMatrix<f64>; 2]> {
    let free = fit.values(at);
    let settings = fit.settings();
    // Rows with the same settings are one scene.
    let mut made: Vec<(&[String], [DMatrix<f64>; 2])> = Vec::new();
    for set in &settings {
        if made.iter().all(|(own, _)| own != set) {
            let asked = fit.asked(&settings, set);
            made.push((set, of_scene(fit, &[&free, set], &asked, hooks)?));
        }
    }
    let ranges = fit.free.iter().zip(at);
    let by: Option<Vec<f64>> = ranges
        .map(|(one, part)| one.number(*part).map(|[_, by]| by))
        .collect();
    let by = by?;
    let mut both = [0, 1].map(|_| DMatrix::zeros(fit.points(), fit.free.len()));
    let mut place = 0;
    for (k, (one, sigma)) in fit.compared.iter().zip(noise).enumerate() {
        for (row, set) in fit.data.rows.iter().zip(&settings) {
            let found = made.iter().find(|(own, _)| own == set);
            let (false, Some((_, found))) = (row[one.place].is_nan(), found) else {
                continue;
            };
            for (whole, part) in both.iter_mut().zip(found) {
                for (j, by) in by.iter().enumerate() {
                    whole[(place, j)] = part[(k, j)] * by / sigma;
                }
            }
            place += 1;
        }
    }
    let mut all = both.iter().flat_map(|whole| whole.iter());
    all.all(|x| x.is_finite()).then_some(both)
}

/// As [`of_rows`] for data over time of a motion that has derivatives.
pub(super) fn over_time(
    fit: &Fit,
    time: usize,
    at: &[f64],
    noise: &[f64],
) -> Option<[DMatrix<f64>; 2]> {
    let text = SceneText::new(&*fit.scene, &[&fit.set[..], &fit.values(at)].concat());
    let mut scene = text.scene().ok()?;
    let columns = fit.compared.iter().map(|one| {
        let name = &fit.data.names[one.place];
        NAMES.iter().position(|known| known == name)
    });
    let columns: Vec<usize> = columns.collect::<Option<_>>()?;
    let mut times: Vec<f64> = fit.data.column(time).collect();
    times.sort_by(f64::total_cmp);
    times.dedup();
    scene.run.as_mut()?.duration = times.last()?.max(f64::MIN_POSITIVE);
    let fields = fit.free.iter().map(|one| text.field(&one.path).ok());
    let fields: Vec<ScalarField> = fields.collect::<Option<_>>()?;
    let found = derivatives_at(&scene, &fields, times).ok()?;
    let mut slopes = DMatrix::zeros(fit.points(), fit.free.len());
    let each = fit.free.iter().zip(at).zip(&found.each).enumerate();
    for (j, ((one, part), found_by)) in each {
        let [_, by] = one.number(*part)?;
        let mut place = 0;
        for ((compared, column), sigma) in fit.compared.iter().zip(&columns).zip(noise) {
            for row in &fit.data.rows {
                if row[compared.place].is_nan() {
                    continue;
                }
                let sample = found.times.partition_point(|t| *t < row[time]);
                slopes[(place, j)] = found_by.samples[sample][*column] * by / sigma;
                place += 1;
            }
        }
    }
    let finite = slopes.iter().all(|x| x.is_finite());
    finite.then(|| [slopes.clone(), slopes * RUN])
}

/// Derivatives of the compared columns by the free fields in one scene, with their errors.
fn of_scene(
    fit: &Fit,
    set: &[&[String]; 2],
    asked: &[bool],
    hooks: &mut dyn Hooks,
) -> Option<[DMatrix<f64>; 2]> {
    let text = SceneText::new(&*fit.scene, &[&fit.set[..], set[0], set[1]].concat());
    let scene = text.scene().ok()?;
    if scene.is_motion() || scene.is_bar() || scene.wall().is_some() {
        return None;
    }
    let fields = fit.free.iter().map(|one| text.field(&one.path).ok());
    let fields: Vec<ScalarField> = fields.collect::<Option<_>>()?;
    let paths: Vec<String> = fields.iter().map(|field| field.path.clone()).collect();
    let summary = if scene.continuation.is_some() {
        branch_by(&scene, &fields, &mut Quiet(hooks))
            .ok()?
            .summary()
    } else {
        let asked = FirstOrder {
            by: fields,
            responses: false,
        };
        dispatch::rest(&scene, &asked).ok()?.0
    };
    let mut both = [0, 1].map(|_| DMatrix::zeros(asked.len(), paths.len()));
    for (k, one) in fit.compared.iter().enumerate().filter(|(k, _)| asked[*k]) {
        for (j, path) in paths.iter().enumerate() {
            let found = slope(&summary, &fit.data.names[one.place], path)?;
            for (whole, value) in both.iter_mut().zip(found) {
                whole[(k, j)] = value;
            }
        }
    }
    Some(both)
}

/// Derivative of a quantity by the field of a path, with an error.
fn slope(summary: &Value, quantity: &str, field: &str) -> Option<[f64; 2]> {
    let number = |at: &Value, path: &str| match cell(at, path) {
        Cell::Real(x) => Some(x),
        Cell::Integer(n) => Some(n as f64),
        Cell::Word(_) | Cell::Missing => None,
    };
    let kinds = ["derivatives", "derivative_errors"];
    let both: [Option<f64>; 2] = match SpecialName::parse(quantity) {
        Some(name) if name.is_parameter() => {
            let at = name.point(summary).ok()?;
            kinds.map(|kind| at[kind][field].as_f64())
        }
        Some(_) => return None,
        None => kinds.map(|kind| number(&summary[kind][field], quantity)),
    };
    Some([both[0]?, both[1]?])
}
