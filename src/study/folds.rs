//! The fold curves of the planar elastica, as a table.

use super::Hooks;
use super::record::{Cell, Column, Table};
use crate::elastica::{FoldPoint, fold_curve};
use crate::error::Result;

/// The range of |p| of the table, and the spacing of points in arclength over (p, lambda).
const P_RANGE: (f64, f64) = (0.01, 8.0);
const SPACING: f64 = 0.05;

/// The first `count` fold curves from p = -8 to 8 for length 1 and bending stiffness 1. The half p < 0 is the mirror
/// image y -> -y of the other. After an interrupt the complete curves are returned.
///
/// # Errors
/// A curve beyond double precision.
pub fn folds(count: usize, hooks: &mut dyn Hooks) -> Result<Table> {
    let mut table = Table::new(
        "folds",
        vec![
            Column::integers("number", "number of the fold curve"),
            Column::reals("p", "", "kappa = tanh p"),
            Column::reals("kappa", "", "sin((theta(1) - alpha)/2)"),
            Column::reals("lam", "", "lambda = sqrt(|force|)"),
            Column::reals("x", "", "position of the end along the clamp's tangent"),
            Column::reals("y", "", "position of the end across it"),
            Column::reals("alpha", "", "angle of the force"),
            Column::reals("elastic", "", "elastic energy"),
            Column::words("cusp", "\"cusp\" where two fold curves meet"),
        ],
    );
    for number in 1..=count {
        let half = fold_curve(number, P_RANGE.0, P_RANGE.1, SPACING)?;
        let mirrored = half.iter().rev().map(|point| (point, -1.0));
        for (point, side) in mirrored.chain(half.iter().map(|point| (point, 1.0))) {
            table.push(&row(point, side))?;
        }
        hooks.progress(number as f64 / count as f64, number as f64);
        if hooks.interrupted() {
            break;
        }
    }
    Ok(table)
}

/// A fold point, or with side = -1 its mirror image.
fn row(point: &FoldPoint, side: f64) -> [Cell; 9] {
    let e = &point.equilibrium;
    [
        point.number.into(),
        (side * e.p).into(),
        (side * e.kappa).into(),
        e.lambda.into(),
        e.x.into(),
        (side * e.y).into(),
        (side * e.alpha).into(),
        e.energy.into(),
        if point.cusp { "cusp" } else { "" }.into(),
    ]
}
