//! The sheets, the fold curves and the map of stable equilibria as tables.

use super::{SheetsRecord, place};
use crate::elastica::GridPoint;
use crate::error::Result;
use crate::study::record::{Cell, Column, Table};

/// The columns of [`point`].
fn point_columns() -> [Column; 8] {
    [
        ("p", "chart coordinate, kappa = tanh p"),
        ("w", "chart coordinate, amplitude at the clamp"),
        ("lam", "lambda = sqrt(|force|)"),
        ("alpha", "angle of the force"),
        ("theta1", "angle of the tangent at the end"),
        ("x", "position of the end along the clamp's tangent"),
        ("y", "position of the end across it"),
        ("elastic", "elastic energy"),
    ]
    .map(|(name, meaning)| Column::reals(name, "", meaning))
}

fn point(q: &GridPoint) -> [Cell; 8] {
    [q.p, q.w, q.lambda, q.alpha, q.theta1, q.x, q.y, q.energy].map(Cell::Real)
}

impl SheetsRecord {
    /// The tables "sheets", sampled over the disc, row by row; "folds"; "stable", the map.
    ///
    /// # Errors
    /// None that is known of.
    pub fn tables(&self) -> Result<[Table; 3]> {
        Ok([
            self.sheet_table()?,
            self.fold_table()?,
            self.stable_table()?,
        ])
    }

    fn sheet_table(&self) -> Result<Table> {
        let mut columns = vec![
            Column::integers("mode", "the mode j of the sheet S_j^+-"),
            Column::words("sign", "the sign of the sheet"),
            Column::integers("row", "number of the line p = const"),
        ];
        columns.extend(point_columns());
        let mut table = Table::new("sheets", columns);
        for grid in &self.over_disc {
            let (mode, sign) = (grid.sheet.mode as usize, grid.sheet.sign.as_str());
            for (k, q) in grid.points.iter().enumerate() {
                let head = [mode.into(), sign.into(), (k / grid.columns).into()];
                table.push(&[&head[..], &point(q)].concat())?;
            }
        }
        Ok(table)
    }

    fn fold_table(&self) -> Result<Table> {
        let mut columns = vec![Column::integers("number", "number of the fold curve")];
        columns.extend(point_columns());
        let mut table = Table::new("folds", columns);
        for fold in &self.folds {
            let mirrored: Vec<GridPoint> =
                fold.points.iter().rev().map(GridPoint::mirrored).collect();
            for q in mirrored.iter().chain(&fold.points) {
                table.push(&[&[fold.number.into()][..], &point(q)].concat())?;
            }
        }
        Ok(table)
    }

    fn stable_table(&self) -> Result<Table> {
        let mut table = Table::new(
            "stable",
            vec![
                Column::reals("x", "", "position of the end along the clamp's tangent"),
                Column::reals("y", "", "position of the end across it"),
                Column::integers("stable", "number of stable equilibria"),
                Column::reals("lowest", "", "elastic energy of the lowest of them"),
                Column::reals("second", "", "elastic energy of the second lowest"),
            ],
        );
        let Some(map) = &self.stable else {
            return Ok(table);
        };
        for (m, (count, energies)) in map.counts.iter().zip(&map.lowest).enumerate() {
            let [x, y] = place(map.points, m).map(Cell::Real);
            let [lowest, second] = energies.map(Cell::Real);
            table.push(&[x, y, (*count).into(), lowest, second])?;
        }
        Ok(table)
    }
}
