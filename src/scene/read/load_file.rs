//! Reader of numbers from a file in columns, separated by commas, semicolons or blanks: forces in time, points.

use super::fields::PLANE;
use super::table::{Absent, Table};
use crate::scene::{FaultKind, Force, History};
use toml::Spanned;
use toml::de::DeValue;

/// Longest file that is read, in bytes.
const LONGEST: u64 = 100_000_000;
/// Names of the columns by default: the time, and the components along the axes of the world or of the body.
const NAMES: [&str; 4] = ["t", "x", "y", "z"];

/// Reads the forces of `file`: one along each axis, of the same times.
pub(super) fn from_file(table: &Table, follower: bool) -> Option<Vec<Force>> {
    let size = if table.reader.kind.get() == PLANE {
        3
    } else {
        4
    };
    let names = &NAMES[..size];
    let words = format!("{size} columns: of the time, then of the components");
    let columns = columns(table, names, &words)?;
    let kind = Columns {
        names: &columns,
        grow: true,
    };
    table.read("file", "a name in quotes", Absent::Fault, |field, value| {
        rows(table, field, value, &kind).map(|rows| {
            let along = |axis: usize| Force {
                direction: std::array::from_fn(|i| f64::from(u8::from(i == axis))),
                size: History::Table(rows.iter().map(|row| [row[0], row[1 + axis]]).collect()),
                follower,
            };
            (0..size - 1).map(along).collect()
        })
    })
}

/// Columns of a file.
pub(super) struct Columns<'a> {
    pub names: &'a [String],
    /// True if the numbers of the first column grow: times.
    pub grow: bool,
}

/// Names of the columns to read, by default `names`.
pub(super) fn columns(table: &Table, names: &[&str], what: &str) -> Option<Vec<String>> {
    let size = names.len();
    let words = format!("the names of {what}, such as {names:?}");
    let given = Absent::Or(names.iter().map(|name| (*name).to_owned()).collect());
    table.read("columns", &words, given, |field, value| {
        let reader = table.reader;
        let name = |field: &str, value: &Spanned<DeValue>| {
            let name = value.get_ref().as_str().map(str::to_owned);
            if name.is_none() {
                reader.wrong_type(field, value, "a name in quotes", None);
            }
            name
        };
        let all = reader.all(field, value, &words, &name)?;
        if all.len() != size {
            let hint = format!("it has {} elements", all.len());
            return reader.refuse(FaultKind::Value, field, value, words.as_str(), hint);
        }
        Some(all)
    })
}

/// The numbers of a file, row by row.
pub(super) fn rows(
    table: &Table,
    field: &str,
    value: &Spanned<DeValue>,
    columns: &Columns,
) -> Option<Vec<Vec<f64>>> {
    let reader = table.reader;
    let Some(name) = value.get_ref().as_str() else {
        reader.wrong_type(field, value, "the name of a file, in quotes", None);
        return None;
    };
    let refuse = |hint: String| {
        let times = if columns.grow {
            ", of growing times"
        } else {
            ""
        };
        let words = format!(
            "a file with the columns {}{times}",
            columns.names.join(", ")
        );
        reader.refuse(FaultKind::Value, field, value, words, hint)
    };
    let path = reader.beside(name);
    let shown = path.display();
    match std::fs::metadata(&path) {
        Ok(about) if !about.is_file() => return refuse(format!("{shown} is no file")),
        Ok(about) if about.len() > LONGEST => {
            return refuse(format!("{shown} is longer than {LONGEST} bytes"));
        }
        Ok(_) => {}
        Err(why) => {
            return refuse(format!(
                "{shown} cannot be read: {why}; the name counts from the directory of the scene's file, or, of a scene that is not a file, from the \
                 working directory"
            ));
        }
    }
    let text = match std::fs::read_to_string(&path) {
        Ok(text) => text,
        Err(why) => return refuse(format!("{shown} cannot be read: {why}")),
    };
    match numbers(&text, columns) {
        Ok(rows) => Some(rows),
        Err(why) => refuse(format!("{shown}, {why}")),
    }
}

/// The numbers of the named columns, row by row. A first line without numbers names the columns; without it they stand
/// in the order of `names`. Empty lines and those that begin with # are left out.
fn numbers(text: &str, columns: &Columns) -> Result<Vec<Vec<f64>>, String> {
    let names = columns.names;
    let lines = text.trim_start_matches('\u{feff}').lines().enumerate();
    let mut lines = lines
        .map(|(k, line)| (k + 1, line.trim()))
        .filter(|(_, line)| !(line.is_empty() || line.starts_with('#')))
        .peekable();
    let cells = |line: &'_ str| -> Vec<String> {
        let separator = [',', ';', '\t'].into_iter().find(|c| line.contains(*c));
        let cells: Vec<&str> = match separator {
            Some(separator) => line.split(separator).collect(),
            None => line.split_whitespace().collect(),
        };
        let plain = |cell: &str| cell.trim().trim_matches('"').trim().to_owned();
        cells.into_iter().map(plain).collect()
    };
    let Some(&(first, line)) = lines.peek() else {
        return Err("line 1: the file is empty".to_owned());
    };
    let header = cells(line);
    let mut places: Vec<usize> = (0..names.len()).collect();
    if header.iter().all(|cell| cell.parse::<f64>().is_err()) {
        lines.next();
        for (place, name) in places.iter_mut().zip(names) {
            *place = header.iter().position(|cell| cell == name).ok_or_else(|| {
                format!(
                    "line {first}: it has no column {name:?}, but {}; name them by `columns`",
                    header.join(", ")
                )
            })?;
        }
    }
    let mut rows: Vec<Vec<f64>> = Vec::new();
    for (k, line) in lines {
        let cells = cells(line);
        let number = |(place, name): (&usize, &String)| -> Result<f64, String> {
            let Some(cell) = cells.get(*place) else {
                return Err(format!("line {k}: column {name:?} is missing"));
            };
            let number = cell.parse().ok().filter(|x: &f64| x.is_finite());
            number
                .ok_or_else(|| format!("line {k}: {cell:?} in column {name:?} is no finite number"))
        };
        let row: Vec<f64> = places
            .iter()
            .zip(names)
            .map(number)
            .collect::<Result<_, _>>()?;
        if let Some(last) = rows.last()
            && columns.grow
            && !(row[0] > last[0])
        {
            return Err(format!(
                "line {k}: the time {} does not grow from {}",
                row[0], last[0]
            ));
        }
        rows.push(row);
    }
    if rows.is_empty() {
        return Err(format!("line {first}: there is no row of numbers after it"));
    }
    Ok(rows)
}
