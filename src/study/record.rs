//! Tables: what every study returns and every file and figure is made from.

use crate::{Error, Result};
use serde::Serialize;
use serde_json::Value;
use std::borrow::Cow;
use std::fmt::Write as _;
use std::io::Write;

/// A table: columns of equal length. A sink is given it without rows.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct Table {
    /// What it is called: the name of its file without the ending.
    pub name: String,
    /// Its columns, in order.
    pub columns: Vec<Column>,
}

/// A column: what it holds, and in which unit.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct Column {
    /// A short name without spaces: "base_mx".
    pub name: Cow<'static, str>,
    /// The unit of its values: "N m"; empty for numbers without one.
    pub unit: Cow<'static, str>,
    /// What it is, in a sentence's half: "couple at the base, along x".
    pub meaning: Cow<'static, str>,
    /// One value a row.
    pub values: Values,
}

/// The values of a column; all have one type, and any may be missing.
#[derive(Debug, Clone, PartialEq, Serialize)]
#[serde(untagged)]
pub enum Values {
    /// Real numbers; NaN where there is none.
    Reals(Vec<f64>),
    /// Whole numbers, such as a Morse index.
    Integers(Vec<Option<i64>>),
    /// Words, such as the label of a special point; empty where there is none.
    Words(Vec<Cow<'static, str>>),
}

/// One value of a row.
#[derive(Debug, Clone, PartialEq)]
pub enum Cell {
    /// Of a column of reals.
    Real(f64),
    /// Of a column of integers.
    Integer(i64),
    /// Of a column of words.
    Word(Cow<'static, str>),
    /// No value; any column takes it.
    Missing,
}

impl From<f64> for Cell {
    fn from(x: f64) -> Self {
        Self::Real(x)
    }
}

impl From<usize> for Cell {
    fn from(n: usize) -> Self {
        // No count of ours comes near 2^63.
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

/// Where rows go while a study works: into memory (`Vec<Table>`), or into files as [`Csv`].
pub trait Sink {
    /// Begins a table, given without rows, and returns the number by which its rows name it.
    ///
    /// # Errors
    /// If it cannot be written.
    fn begin(&mut self, table: Table) -> Result<usize>;

    /// Adds a row to the table of this number: one cell for each column, in order.
    ///
    /// # Errors
    /// If it cannot be written, or does not fit the columns.
    fn row(&mut self, table: usize, cells: &[Cell]) -> Result<()>;
}

/// Rows that nobody reads.
pub(in crate::study) struct Nowhere;

impl Sink for Nowhere {
    fn begin(&mut self, _table: Table) -> Result<usize> {
        Ok(0)
    }

    fn row(&mut self, _table: usize, _cells: &[Cell]) -> Result<()> {
        Ok(())
    }
}

/// In memory.
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

    /// True if the cell is of its type.
    fn takes(&self, cell: &Cell) -> bool {
        match cell {
            Cell::Real(_) => matches!(self.values, Values::Reals(_)),
            Cell::Integer(_) => matches!(self.values, Values::Integers(_)),
            Cell::Word(_) => matches!(self.values, Values::Words(_)),
            Cell::Missing => true,
        }
    }

    /// Adds a value; one of another type is missing.
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

    /// The value in this row; missing beyond the last.
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

    /// How many rows it has.
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
    /// If the cells do not fit the columns; nothing is added then.
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

    /// The values of a column of reals; none if there is no such column.
    pub fn reals(&self, name: &str) -> &[f64] {
        match self.column(name).map(|column| &column.values) {
            Some(Values::Reals(list)) => list,
            _ => &[],
        }
    }

    /// The values of a column of integers; none if there is no such column.
    pub fn integers(&self, name: &str) -> &[Option<i64>] {
        match self.column(name).map(|column| &column.values) {
            Some(Values::Integers(list)) => list,
            _ => &[],
        }
    }

    /// The values of a column of words; none if there is no such column.
    pub fn words(&self, name: &str) -> &[Cow<'static, str>] {
        match self.column(name).map(|column| &column.values) {
            Some(Values::Words(list)) => list,
            _ => &[],
        }
    }

    /// The column of this name.
    pub fn column(&self, name: &str) -> Option<&Column> {
        self.columns.iter().find(|column| column.name == name)
    }

    /// The table as CSV: see [`Csv`].
    pub fn csv(&self) -> String {
        let mut text = Vec::new();
        // Nothing fails in memory.
        if let Ok(mut csv) = Csv::new(&mut text, self) {
            for row in 0..self.rows() {
                let cells: Vec<Cell> = self.columns.iter().map(|c| c.cell(row)).collect();
                let _ = csv.row(&cells);
            }
        }
        String::from_utf8(text).unwrap_or_default()
    }
}

/// A table being written as CSV (RFC 4180, with line feeds): a line of names, then one for each row; numbers as by
/// [`exact`], nothing where a value is missing.
#[derive(Debug)]
pub struct Csv<W> {
    writer: W,
    /// The line being made.
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

    /// Rows that go on below others.
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
                // Nothing fails in memory.
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

    /// Hands the writer back.
    ///
    /// # Errors
    /// If what it buffers cannot be written.
    pub fn finish(mut self) -> std::io::Result<W> {
        self.writer.flush()?;
        Ok(self.writer)
    }
}

/// A number in full precision, the shortest decimal that is read back as the same double: with an exponent where its digits
/// would be many zeros, and no minus before a zero.
pub fn exact(x: f64) -> String {
    format!("{:?}", unsigned(x))
}

/// The number without a minus before a zero: -0.0 + 0.0 is 0.0.
fn unsigned(x: f64) -> f64 {
    x + 0.0
}

/// JSON text; no number in it is -0.0.
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
