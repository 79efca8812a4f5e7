//! Records to Python, and values of Python to TOML.

use numpy::PyArray1;
use pyo3::IntoPyObjectExt;
use pyo3::exceptions::{PyOSError, PyTypeError};
use pyo3::prelude::*;
use pyo3::types::{PyBool, PyDict, PyFloat, PyInt, PyList, PyMapping, PyString};
use serde_json::{Value, json};
use snaprod::scene::{Fault, Faults};
use snaprod::study::{Cell, Column, Table, Values, exact};

/// JSON as plain values of Python.
pub fn value<'py>(py: Python<'py>, json: &Value) -> PyResult<Bound<'py, PyAny>> {
    match json {
        Value::Null => Ok(py.None().into_bound(py)),
        Value::Bool(flag) => flag.into_bound_py_any(py),
        Value::Number(number) => match number.as_i64() {
            Some(whole) => whole.into_bound_py_any(py),
            None => number.as_f64().into_bound_py_any(py),
        },
        Value::String(text) => text.into_bound_py_any(py),
        Value::Array(items) => {
            let items = items.iter().map(|item| value(py, item));
            PyList::new(py, items.collect::<PyResult<Vec<_>>>()?)?.into_bound_py_any(py)
        }
        Value::Object(fields) => {
            let out = PyDict::new(py);
            for (name, field) in fields {
                out.set_item(name, value(py, field)?)?;
            }
            out.into_bound_py_any(py)
        }
    }
}

/// A table as its name and, for each column, name, unit, meaning and values.
pub fn table<'py>(py: Python<'py>, table: &Table) -> PyResult<Bound<'py, PyDict>> {
    let out = PyDict::new(py);
    out.set_item("name", &table.name)?;
    let columns = table.columns.iter().map(|column| {
        let parts = (&column.name, &column.unit, &column.meaning);
        (parts.0, parts.1, parts.2, values(py, column)?).into_bound_py_any(py)
    });
    out.set_item("columns", columns.collect::<PyResult<Vec<_>>>()?)?;
    Ok(out)
}

/// A cell; None for a missing one.
pub fn cell<'py>(py: Python<'py>, cell: &Cell) -> PyResult<Bound<'py, PyAny>> {
    match cell {
        Cell::Real(x) => x.into_bound_py_any(py),
        Cell::Integer(n) => n.into_bound_py_any(py),
        Cell::Word(word) => word.into_bound_py_any(py),
        Cell::Missing => Ok(py.None().into_bound(py)),
    }
}

/// A column as an array. Integers with gaps become reals with NaN, words a list.
fn values<'py>(py: Python<'py>, column: &Column) -> PyResult<Bound<'py, PyAny>> {
    match &column.values {
        Values::Reals(list) => PyArray1::from_slice(py, list).into_bound_py_any(py),
        Values::Integers(list) => match list.iter().copied().collect::<Option<Vec<i64>>>() {
            Some(list) => PyArray1::from_vec(py, list).into_bound_py_any(py),
            None => {
                let reals = list.iter().map(|n| n.map_or(f64::NAN, |n| n as f64));
                PyArray1::from_iter(py, reals).into_bound_py_any(py)
            }
        },
        Values::Words(list) => PyList::new(py, list)?.into_bound_py_any(py),
    }
}

/// An exception of the package: one of `snaprod._errors`, with these arguments.
fn raised(
    py: Python<'_>,
    class: &str,
    arguments: impl for<'p> FnOnce(&Bound<'p, PyAny>) -> PyResult<Bound<'p, PyAny>>,
) -> PyErr {
    let made = py
        .import("snaprod._errors")
        .and_then(|module| module.getattr(class))
        .and_then(|class| arguments(&class));
    made.map_or_else(|e| e, PyErr::from_value)
}

/// All faults of a scene as one exception; a dict has no line numbers.
pub fn fault(py: Python<'_>, faults: &Faults, name: Option<&str>) -> PyErr {
    let faults = faults.into_iter().map(|fault| match name {
        None => fault.without_lines(),
        Some(_) => fault.clone(),
    });
    let faults: Vec<Fault> = faults.collect();
    let said: Vec<String> = (faults.iter())
        .map(|fault| match (name, &fault.set) {
            (None, _) | (_, Some(_)) => fault.without_place().to_string(),
            (Some(""), None) => fault.to_string(),
            (Some(name), None) => format!("{name}:{fault}"),
        })
        .collect();
    let list = serde_json::to_value(&faults).unwrap_or_default();
    raised(py, "SceneError", |class| {
        class.call1((said, value(class.py(), &list)?, name.is_some()))
    })
}

/// An error of the library: bad values are ValueError, files OSError, failed computations ComputationError.
pub fn refused(error: &snaprod::Error) -> PyErr {
    Python::attach(|py| {
        let text = error.to_string();
        match (error.is_domain(), error.is_io()) {
            (true, _) => raised(py, "SceneError", |class| {
                class.call1((vec![text], Vec::<u8>::new(), false))
            }),
            (_, true) => PyOSError::new_err(text),
            _ => raised(py, "ComputationError", |class| class.call1((text,))),
        }
    })
}

/// Deepest nesting of sequences and dicts, equal to that of the TOML reader. A list that contains itself ends at this
/// limit.
const DEEPEST: usize = 80;

/// A value as TOML; numbers are read back as the same double. Messages call the value `field`.
///
/// # Errors
///
/// A value that scenes do not have, or one nested deeper than [`DEEPEST`].
pub fn toml(field: &str, value: &Bound<'_, PyAny>) -> PyResult<String> {
    written(field, value, DEEPEST)
}

/// A value as TOML that may contain at most `levels` nested levels.
fn written(field: &str, value: &Bound<'_, PyAny>, levels: usize) -> PyResult<String> {
    if let Ok(flag) = value.cast::<PyBool>() {
        return Ok(flag.is_true().to_string());
    }
    if let Ok(text) = value.cast::<PyString>() {
        return Ok(quoted(text.to_str()?));
    }
    if value.is_instance_of::<PyInt>() {
        return Ok(value.str()?.to_str()?.to_owned());
    }
    if value.is_instance_of::<PyFloat>() {
        return Ok(number(value.extract()?));
    }
    let inner = |item: &Bound<'_, PyAny>| match levels.checked_sub(1) {
        Some(levels) => written(field, item, levels),
        None => Err(too_deep(value.py(), field)),
    };
    if let Ok(table) = value.cast::<PyMapping>() {
        let mut fields = Vec::new();
        for pair in table.items()?.iter() {
            let (name, field): (String, Bound<'_, PyAny>) = pair.extract()?;
            if !field.is_none() {
                fields.push(format!("{} = {}", quoted(&name), inner(&field)?));
            }
        }
        return Ok(format!("{{ {} }}", fields.join(", ")));
    }
    // NumPy scalars become Python's by tolist(), arrays lists. Scalars longer than a double are unchanged by tolist();
    // the nearest double is taken.
    if let Ok(plain) = value.call_method0("tolist") {
        if !plain.get_type().is(value.get_type()) {
            return inner(&plain);
        }
        let kind = value.getattr("dtype").and_then(|of| of.getattr("kind"));
        if kind.is_ok_and(|kind| kind.eq("f").unwrap_or(false)) {
            return Ok(number(value.extract()?));
        }
    }
    if let Ok(items) = value.try_iter() {
        let items = items.map(|item| inner(&item?));
        return Ok(format!(
            "[{}]",
            items.collect::<PyResult<Vec<_>>>()?.join(", ")
        ));
    }
    if let Ok(path) = value.call_method0("__fspath__") {
        return Ok(quoted(&path.extract::<String>()?));
    }
    Err(PyTypeError::new_err(format!(
        "{field}: {} is no value of a scene: give a number, True or False, text, a sequence or a dict",
        value.repr()?
    )))
}

fn too_deep(py: Python<'_>, field: &str) -> PyErr {
    let allowed = format!("sequences and dicts that are nested at most {DEEPEST} deep");
    let hint = "a list or a dict that holds itself has no end";
    let text = format!("{field}: must be {allowed}; {hint}");
    let fault = json!([{
        "kind": "value", "field": field, "value": null, "allowed": allowed, "hint": hint, "line": 0, "column": 0,
    }]);
    raised(py, "SceneError", |class| {
        class.call1((vec![text], value(class.py(), &fault)?, false))
    })
}

fn number(x: f64) -> String {
    match x {
        x if x.is_nan() => "nan".to_owned(),
        x if x.is_infinite() => if x > 0.0 { "inf" } else { "-inf" }.to_owned(),
        x => exact(x),
    }
}

/// A string in quotes: the escapes of JSON are those of TOML.
fn quoted(text: &str) -> String {
    Value::from(text).to_string()
}
