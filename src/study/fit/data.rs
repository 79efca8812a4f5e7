//! Measured data: columns of numbers, some of them missing.

use crate::error::{Error, Result};
use crate::study::sweep::fields;

/// A table of measured numbers.
#[derive(Debug, Clone, PartialEq)]
pub struct Data {
    /// Names of the columns, in order.
    pub names: Vec<String>,
    /// Rows of as many numbers; NaN where nothing was measured.
    pub rows: Vec<Vec<f64>>,
}

impl Data {
    /// Data with these columns and rows; NaN where nothing was measured.
    ///
    /// # Errors
    /// An empty or repeated name; a row of another length; no rows; an infinite number.
    pub fn new(names: Vec<String>, rows: Vec<Vec<f64>>) -> Result<Self> {
        let refuse = |why: String| Err(Error::domain(why));
        for (i, name) in names.iter().enumerate() {
            if name.is_empty() {
                return refuse(format!("column {} of the data has no name", i + 1));
            }
            if names[..i].contains(name) {
                return refuse(format!("the data have two columns {name}"));
            }
        }
        if let Some(i) = rows.iter().position(|row| row.len() != names.len()) {
            return refuse(format!(
                "row {} of the data has {} numbers for {} columns",
                i + 1,
                rows[i].len(),
                names.len()
            ));
        }
        let infinite = |row: &Vec<f64>| row.iter().position(|x| x.is_infinite());
        if let Some((i, k)) =
            (rows.iter().enumerate()).find_map(|(i, row)| Some((i, infinite(row)?)))
        {
            return refuse(format!(
                "row {} of the data, {} = {}: must be finite; give nan where nothing was measured",
                i + 1,
                names[k],
                rows[i][k]
            ));
        }
        if rows.is_empty() {
            return refuse("the data have names and no rows".to_owned());
        }
        Ok(Self { names, rows })
    }

    /// Reads CSV: a line of names, then a line of numbers for each row. An empty cell, or `nan`, is a missing value.
    /// Empty lines and lines that begin with # are skipped.
    ///
    /// # Errors
    /// No names; an empty or repeated name; a row of another length; a cell that is no number; no rows.
    pub fn parse(text: &str) -> Result<Self> {
        let refuse = |why: String| Err(Error::domain(why));
        let text = text.strip_prefix('\u{feff}').unwrap_or(text);
        let lines = text.lines().enumerate();
        let mut lines = lines
            .map(|(i, line)| (i + 1, line.trim()))
            .filter(|(_, line)| !line.is_empty() && !line.starts_with('#'));
        let Some((_, head)) = lines.next() else {
            return refuse(
                "the data are empty: a line of names comes first, as in t,x,y".to_owned(),
            );
        };
        let words = |line: &str| -> Vec<String> {
            let cells = fields(line).into_iter();
            cells.map(|cell| cell.trim().to_owned()).collect()
        };
        let names = words(head);
        if names.iter().all(|name| name.parse::<f64>().is_ok()) {
            return refuse(format!(
                "the data begin with numbers ({head}): a line of names comes first, as in t,x,y"
            ));
        }
        let mut rows = Vec::new();
        for (at, line) in lines {
            let cells = words(line);
            if cells.len() != names.len() {
                return refuse(format!(
                    "line {at} of the data has {} cells, the line of names {}",
                    cells.len(),
                    names.len()
                ));
            }
            let number = |(cell, name): (&String, &String)| match cell.as_str() {
                "" => Ok(f64::NAN),
                _ => match cell.parse::<f64>() {
                    Ok(x) if !x.is_infinite() => Ok(x),
                    _ => Err(Error::domain(format!(
                        "line {at} of the data, {name} = {cell}: not a number; leave the cell empty where nothing was measured"
                    ))),
                },
            };
            let row: Result<Vec<f64>> = cells.iter().zip(&names).map(number).collect();
            rows.push(row?);
        }
        Self::new(names, rows)
    }

    /// Index of the column with this name.
    pub fn place(&self, name: &str) -> Option<usize> {
        self.names.iter().position(|own| own == name)
    }

    /// Numbers of a column.
    pub fn column(&self, place: usize) -> impl Iterator<Item = f64> + Clone {
        self.rows.iter().map(move |row| row[place])
    }
}
