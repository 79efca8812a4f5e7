//! Tables: results of every study, from which files and figures are made.

use crate::{Error, Result};
use serde::Serialize;
use serde_json::Value;
use std::borrow::Cow;
use std::fmt::Write as _;
use std::io::Write;

/// A table: columns of equal length. Sinks receive it without rows.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct Table {
    /// Name of the table, and of its file without extension.
    pub name: String,
    /// Columns, in order.
    pub columns: Vec<Column>,
}

/// A column of values with unit and meaning.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct Column {
    /// A short name without spaces: "base_mx".
    pub name: Cow<'static, str>,
    /// The unit of its values: "N m"; empty for numbers without one.
    pub unit: Cow<'static, str>,
    /// Meaning as a phrase: "couple at the base, along x".
    pub meaning: Cow<'static, str>,
    /// One value a row.
    pub values: Values,
}

/// The values of a column; all have one type, and any may be missing.
#[derive(Debug, Clone, PartialEq, Serialize)]
#[serde(untagged)]
pub enum Values {
    /// Real numbers; NaN if missing.
    Reals(Vec<f64>),
    /// Whole numbers, such as a Morse index.
    Integers(Vec<Option<i64>>),
    /// Words, such as the label of a special point; empty if missing.
    Words(Vec<Cow<'static, str>>),
}

/// One value of a row.
#[derive(Debug, Clone, PartialEq)]
pub enum Cell {
    /// In a column of reals.
    Real(f64),
    /// In a column of integers.
    Integer(i64),
    /// In a column of words.
    Word(Cow<'static, str>),
    /// No value, in a column of any type.
    Missing,
}

impl From<f64> for Cell {
    fn from(x: f64) -> Self {
        Self::Real(x)
    }
}

impl From<usize> for Cell {
    fn from(n: usize) -> Self {
        // Counts stay far below 2^63.
        Self::Integer(n as i64)
    }
}

impl From<&'static str> for Cell {
    fn from(word: &'static str) -> Self {
        Self::Word(word.into())
    }
}

impl From<String> for Cell {
    fn from(word: String) -> Self {
        Self::Word(word.into())
    }
}

impl<T: Into<Cell>> From<Option<T>> for Cell {
    fn from(value: Option<T>) -> Self {
        value.map_or(Self::Missing, Into::into)
    }
}

/// Receiver of rows during a study: memory (`Vec<Table>`), or files as [`Csv`].
pub trait Sink {
    /// Begins a table, given without rows; returns the number that identifies it in [`Sink::row`].
    ///
    /// # Errors
    /// If it cannot be written.
    fn begin(&mut self, table: Table) -> Result<usize>;

    /// Adds a row to table `table`: one cell for each column, in order.
    ///
    /// # Errors
    /// If it cannot be written, or does not fit the columns.
    fn row(&mut self, table: usize, cells: &[Cell]) -> Result<()>;
}

/// A sink that discards rows.
pub(in crate::study) struct DiscardRows;

impl Sink for DiscardRows {
    fn begin(&mut self, _table: Table) -> Result<usize> {
        Ok(0)
    }

    fn row(&mut self, _table: usize, _cells: &[Cell]) -> Result<()> {
        Ok(())
    }
}

/// Tables kept in memory.
impl Sink for Vec<Table> {
    fn begin(&mut self, table: Table) -> Result<usize> {
        self.push(table);
        Ok(self.len() - 1)
    }

    fn row(&mut self, table: usize, cells: &[Cell]) -> Result<()> {
        match self.get_mut(table) {
            Some(table) => table.push(cells),
            None => Err(Error::domain(format!("there is no table {table}"))),
        }
    }
}

impl Column {
    /// A column of reals, without rows.
    pub fn reals(
        name: impl Into<Cow<'static, str>>,
        unit: impl Into<Cow<'static, str>>,
        meaning: impl Into<Cow<'static, str>>,
    ) -> Self {
        Self {
            name: name.into(),
            unit: unit.into(),
            meaning: meaning.into(),
            values: Values::Reals(Vec::new()),
        }
    }

    /// A column of integers, without rows.
    pub fn integers(
        name: impl Into<Cow<'static, str>>,
        meaning: impl Into<Cow<'static, str>>,
    ) -> Self {
        Self {
            values: Values::Integers(Vec::new()),
            ..Self::reals(name, "", meaning)
        }
    }

    /// A column of words, without rows.
    pub fn words(
        name: impl Into<Cow<'static, str>>,
        meaning: impl Into<Cow<'static, str>>,
    ) -> Self {
        Self {
            values: Values::Words(Vec::new()),
            ..Self::reals(name, "", meaning)
        }
    }

    /// An empty column with the name and unit of the column.
    pub fn without_rows(&self) -> Self {
        Self {
            values: match self.values {
                Values::Reals(_) => Values::Reals(Vec::new()),
                Values::Integers(_) => Values::Integers(Vec::new()),
                Values::Words(_) => Values::Words(Vec::new()),
            },
            name: self.name.clone(),
            unit: self.unit.clone(),
            meaning: self.meaning.clone(),
        }
    }

    /// True if the type of the cell fits.
    fn takes(&self, cell: &Cell) -> bool {
        match cell {
            Cell::Real(_) => matches!(self.values, Values::Reals(_)),
            Cell::Integer(_) => matches!(self.values, Values::Integers(_)),
            Cell::Word(_) => matches!(self.values, Values::Words(_)),
            Cell::Missing => true,
        }
    }

    /// Appends a value; one of another type counts as missing.
    fn push(&mut self, cell: &Cell) {
        match &mut self.values {
            Values::Reals(list) => list.push(match cell {
                Cell::Real(x) => *x,
                _ => f64::NAN,
            }),
            Values::Integers(list) => list.push(match cell {
                Cell::Integer(n) => Some(*n),
                _ => None,
            }),
            Values::Words(list) => list.push(match cell {
                Cell::Word(word) => word.clone(),
                _ => "".into(),
            }),
        }
    }

    /// Value in this row; missing beyond the last.
    pub fn cell(&self, row: usize) -> Cell {
        match &self.values {
            Values::Reals(list) => list.get(row).copied().filter(|x| !x.is_nan()).into(),
            Values::Integers(list) => list
                .get(row)
                .copied()
                .flatten()
                .map_or(Cell::Missing, Cell::Integer),
            Values::Words(list) => list.get(row).cloned().map_or(Cell::Missing, Cell::Word),
        }
    }
}

impl Table {
    /// A table without rows.
    pub fn new(name: impl Into<String>, columns: Vec<Column>) -> Self {
        Self {
            name: name.into(),
            columns,
        }
    }

    /// Number of rows.
    pub fn rows(&self) -> usize {
        self.columns
            .first()
            .map_or(0, |column| match &column.values {
                Values::Reals(list) => list.len(),
                Values::Integers(list) => list.len(),
                Values::Words(list) => list.len(),
            })
    }

    /// Adds a row: one cell for each column, in order.
    ///
    /// # Errors
    /// If the cells do not fit the columns; the table is then unchanged.
    pub fn push(&mut self, cells: &[Cell]) -> Result<()> {
        if cells.len() != self.columns.len() {
            return Err(Error::domain(format!(
                "a row of {} cells does not fit the {} columns of {}",
                cells.len(),
                self.columns.len(),
                self.name
            )));
        }
        let mut both = self.columns.iter().zip(cells);
        if let Some((column, cell)) = both.find(|(column, cell)| !column.takes(cell)) {
            return Err(Error::domain(format!(
                "{cell:?} is not of the type of the column {}",
                column.name
            )));
        }
        let both = self.columns.iter_mut().zip(cells);
        both.for_each(|(column, cell)| column.push(cell));
        Ok(())
    }

    /// Values of a column of reals; empty if absent.
    pub fn reals(&self, name: &str) -> &[f64] {
        match self.column(name).map(|column| &column.values) {
            Some(Values::Reals(list)) => list,
            _ => &[],
        }
    }

    /// Values of a column of integers; empty if absent.
    pub fn integers(&self, name: &str) -> &[Option<i64>] {
        match self.column(name).map(|column| &column.values) {
            Some(Values::Integers(list)) => list,
            _ => &[],
        }
    }

    /// Values of a column of words; empty if absent.
    pub fn words(&self, name: &str) -> &[Cow<'static, str>] {
        match self.column(name).map(|column| &column.values) {
            Some(Values::Words(list)) => list,
            _ => &[],
        }
    }

    /// The column with this name.
    pub fn column(&self, name: &str) -> Option<&Column> {
        self.columns.iter().find(|column| column.name == name)
    }

    /// The table as CSV: see [`Csv`].
    pub fn csv(&self) -> String {
        let mut text = Vec::new();
        // Tables in memory do not fail.
        if let Ok(mut csv) = Csv::new(&mut text, self) {
            for row in 0..self.rows() {
                let cells: Vec<Cell> = self.columns.iter().map(|c| c.cell(row)).collect();
                let _ = csv.row(&cells);
            }
        }
        String::from_utf8(text).unwrap_or_default()
    }
}

/// A CSV writer (RFC 4180, with line feeds): a line of names, then one for each row; numbers as by [`exact`], nothing
/// for a missing value.
#[derive(Debug)]
pub struct Csv<W> {
    writer: W,
    /// Buffer of the current line.
    line: String,
}

impl<W: Write> Csv<W> {
    /// Writes the names of the table's columns.
    ///
    /// # Errors
    /// If they cannot be written.
    pub fn new(writer: W, table: &Table) -> std::io::Result<Self> {
        let mut csv = Self::without_names(writer);
        let names = table.columns.iter().map(|column| &column.name);
        let names: Vec<Cell> = names.map(|name| Cell::Word(name.clone())).collect();
        csv.row(&names)?;
        Ok(csv)
    }

    /// A writer of further rows, without the line of names.
    pub fn without_names(writer: W) -> Self {
        Self {
            writer,
            line: String::new(),
        }
    }

    /// Writes a row.
    ///
    /// # Errors
    /// If it cannot be written.
    pub fn row(&mut self, cells: &[Cell]) -> std::io::Result<()> {
        self.line.clear();
        for (k, cell) in cells.iter().enumerate() {
            if k > 0 {
                self.line.push(',');
            }
            match cell {
                Cell::Real(x) if x.is_nan() => {}
                // Strings in memory do not fail.
                Cell::Real(x) => drop(write!(self.line, "{:?}", unsigned(*x))),
                Cell::Integer(n) => drop(write!(self.line, "{n}")),
                Cell::Word(word) if word.contains([',', '"', '\n', '\r']) => {
                    let doubled = word.replace('"', "\"\"");
                    self.line.extend(["\"", &doubled, "\""]);
                }
                Cell::Word(word) => self.line.push_str(word),
                Cell::Missing => {}
            }
        }
        self.line.push('\n');
        self.writer.write_all(self.line.as_bytes())
    }

    /// Flushes and returns the writer.
    ///
    /// # Errors
    /// If the buffered text cannot be written.
    pub fn finish(mut self) -> std::io::Result<W> {
        self.writer.flush()?;
        Ok(self.writer)
    }
}

/// Shortest decimal that reads back as the same double, with an exponent instead of many zeros, and without a
/// negative zero.
pub fn exact(x: f64) -> String {
    format!("{:?}", unsigned(x))
}

/// Turns -0.0 into 0.0, by adding 0.0.
fn unsigned(x: f64) -> f64 {
    x + 0.0
}

/// JSON text without negative zeros.
pub fn json_text(mut value: Value) -> String {
    unsign_zeros(&mut value);
    format!("{value:#}\n")
}

fn unsign_zeros(value: &mut Value) {
    match value {
        Value::Array(list) => list.iter_mut().for_each(unsign_zeros),
        Value::Object(map) => map.values_mut().for_each(unsign_zeros),
        Value::Number(n) if n.is_f64() && n.as_f64() == Some(0.0) => *value = 0.0.into(),
        _ => {}
    }
}
