//! The module `snaprod._core`: studies as functions that take text and numbers, and return plain Python values with
//! NumPy arrays.
//!
//! The public interface, with types and documentation, is Python code in `python/snaprod`. Nothing is computed in this
//! crate: every function calls one of `snaprod::study`.

mod convert;
mod fit;
mod hooks;
mod loads;
mod simulation;
mod sweep;

use convert::{fault, refused, table, value};
use hooks::{Watch, aside};
use loads::{GivenLoad, Raised};
use numpy::{PyArray1, PyArrayMethods, PyReadonlyArray1};
use pyo3::prelude::*;
use pyo3::types::PyDict;
use snaprod::elastica::Equilibrium;
use snaprod::manifold::{Sheet, Sign};
use snaprod::scene::{ScalarField, Scene, SceneText};
use snaprod::study::run::Fields;
use snaprod::study::{self, FirstOrder, Table, dispatch};

/// A scene from Python: text, overrides, name (None for a dict), and functions as loads.
pub(crate) type Given = (String, Vec<String>, Option<String>, Vec<GivenLoad>);

/// Positions of rods: names, numbers of sections at each time, all coordinates.
type Positions<'py> = (Vec<String>, Vec<Vec<usize>>, Bound<'py, PyArray1<f64>>);

fn read(py: Python<'_>, given: &Given) -> PyResult<Scene> {
    Ok(read_with_loads(py, given)?.0)
}

/// A scene under its functions, with the slot for an exception of theirs.
fn read_with_loads(py: Python<'_>, given: &Given) -> PyResult<(Scene, Raised)> {
    let (text, set, name, _) = given;
    let set: Vec<&str> = set.iter().map(String::as_str).collect();
    let scene = Scene::parse_with(text, &set);
    let mut scene = scene.map_err(|faults| fault(py, &faults, name.as_deref()))?;
    let raised = loads::act(py, &mut scene, given)?;
    Ok((scene, raised))
}

/// A value of Python as TOML, a dict as an inline table. Messages name the field.
#[pyfunction]
fn toml(field: &str, value: &Bound<'_, PyAny>) -> PyResult<String> {
    convert::toml(field, value)
}

/// The path of a field, if valid: start.velocity[1] or start.velocity.1.
#[pyfunction]
fn path(path: &str) -> PyResult<String> {
    if path.trim().is_empty() || path.contains(['=', '\n']) {
        return Err(refused(&snaprod::Error::domain(format!(
            "{path:?}: must be the path of a field, names with dots as in start.velocity.1"
        ))));
    }
    Ok(path.trim().to_owned())
}

/// Reads and sets up a scene: the scene with its defaults, and the effects of a planar rod's mass.
#[pyfunction]
fn check<'py>(py: Python<'py>, given: Given) -> PyResult<Bound<'py, PyDict>> {
    let scene = read(py, &given)?;
    let (found, scene) = aside(py, move || {
        let found = dispatch::check(&scene)?;
        let mass = found.map_or(serde_json::Value::Null, |mass| mass.json());
        Ok::<_, snaprod::Error>((mass, scene))
    })?;
    let out = PyDict::new(py);
    let whole = serde_json::to_value(&scene).unwrap_or_default();
    out.set_item("scene", value(py, &whole)?)?;
    out.set_item("mass", value(py, &found)?)?;
    Ok(out)
}

/// Runs a scene of motion; `strain`: "none", "some" or "all"; `state`: a saved state in JSON from which it goes on;
/// `hears`: functions called with samples and with events.
#[pyfunction]
#[pyo3(signature = (given, strain, progress, state, hears, by))]
fn run<'py>(
    py: Python<'py>,
    given: Given,
    strain: &str,
    progress: Option<Py<PyAny>>,
    state: Option<&str>,
    hears: (Option<Py<PyAny>>, Option<Py<PyAny>>),
    by: Vec<String>,
) -> PyResult<Bound<'py, PyDict>> {
    let (scene, raised) = read_with_loads(py, &given)?;
    let by = fields(&given, &by)?;
    let derivatives = if by.is_empty() {
        None
    } else {
        let found = py.detach(|| study::run::derivatives(&scene, &by));
        Some(found.map_err(|e| refused(&e))?)
    };
    let fields = match strain {
        "none" => Fields::None,
        "all" => Fields::All,
        _ => Fields::Some,
    };
    let mut tables: Vec<Table> = Vec::new();
    let mut watch = Watch::new(progress).hearing(hears.0, hears.1).under(raised);
    let state = state.map(simulation::read_state).transpose()?;
    let found = py.detach(|| match &state {
        Some(state) => dispatch::motion_from(&scene, state, fields, &mut tables, &mut watch),
        None => dispatch::motion(&scene, fields, &mut tables, &mut watch),
    });
    // What was computed goes with the exception.
    let raised = watch.finish().err();
    let found = match (found, &raised) {
        (Ok(found), _) => found,
        (Err(_), Some(raised)) => return Err(raised.clone_ref(py)),
        (Err(e), None) => return Err(refused(&e)),
    };
    let reason = match &raised {
        Some(raised) => Some(format!("it was ended by an exception: {raised}")),
        None => found.reason,
    };
    let mut summary = found.summary;
    if let Some(derivatives) = derivatives {
        derivatives.put_into(&mut summary);
        tables.push(derivatives.table().map_err(|e| refused(&e))?);
    }
    let out = pieces(py, &tables, &summary)?;
    out.set_item("events", value(py, &found.events.into())?)?;
    out.set_item("reason", reason)?;
    out.set_item("warning", found.warning)?;
    let state = found.state.as_ref();
    out.set_item("state", state.ok().map(|state| state.json().to_string()))?;
    out.set_item("unsaved", state.err())?;
    out.set_item("raised", raised.map(|raised| raised.into_value(py)))?;
    Ok(out)
}

/// Positions of the sections of each rod at the given times, in sequence.
#[pyfunction]
fn shapes<'py>(
    py: Python<'py>,
    given: Given,
    times: PyReadonlyArray1<'py, f64>,
    points: usize,
) -> PyResult<Positions<'py>> {
    let (scene, raised) = read_with_loads(py, &given)?;
    let times = times.as_array().to_vec();
    let mut watch = Watch::new(None).under(raised);
    let found = py.detach(|| dispatch::shapes(&scene, &times, points, &mut watch));
    watch.finish()?;
    let (names, found) = found.map_err(|e| refused(&e))?;
    let counts = found.iter().map(|rods| rods.iter().map(Vec::len).collect());
    let counts: Vec<Vec<usize>> = counts.collect();
    let all = found.iter().flatten().flatten();
    let numbers: Vec<f64> = all
        .flat_map(|(_, pose)| pose.translation.vector.data.0[0])
        .collect();
    Ok((names, counts, PyArray1::from_vec(py, numbers)))
}

/// The trajectory at the given times.
#[pyfunction]
fn samples<'py>(
    py: Python<'py>,
    given: Given,
    times: PyReadonlyArray1<'py, f64>,
) -> PyResult<Bound<'py, PyDict>> {
    let (scene, raised) = read_with_loads(py, &given)?;
    let times = times.as_array().to_vec();
    let mut watch = Watch::new(None).under(raised);
    let found = py.detach(|| dispatch::samples(&scene, &times, &mut watch));
    watch.finish()?;
    table(py, &found.map_err(|e| refused(&e))?)
}

/// Runs the program with these words, the first of them its name, and returns its exit code. The program handles
/// Ctrl-C for the whole process: call this function in a process of its own.
#[pyfunction]
fn program(py: Python<'_>, words: Vec<std::ffi::OsString>) -> u8 {
    py.detach(|| snaprod::cli::main_of(words))
}

/// A figure of the program as PNG, each of its pixels `scale` pixels, or as PDF.
#[pyfunction]
fn picture(svg: &str, kind: &str, scale: f32) -> PyResult<Vec<u8>> {
    let made = match kind {
        "png" => snaprod::plot::png(svg, scale),
        _ => snaprod::plot::pdf(svg),
    };
    made.map_err(|e| refused(&e))
}

/// The fields of a scene at these paths.
pub(crate) fn fields((text, set, ..): &Given, paths: &[String]) -> PyResult<Vec<ScalarField>> {
    let text = SceneText::new(text, set);
    let fields = paths.iter().map(|path| text.field(path));
    let fields: snaprod::Result<Vec<_>> = fields.collect();
    fields.map_err(|e| refused(&e.context("by")))
}

/// The equilibrium of a scene of statics, with its derivatives by fields and, if asked for, its stiffness and
/// compliance.
#[pyfunction]
fn equilibrium<'py>(
    py: Python<'py>,
    given: Given,
    by: Vec<String>,
    responses: bool,
) -> PyResult<Bound<'py, PyDict>> {
    let scene = read(py, &given)?;
    let by = fields(&given, &by)?;
    let asked = FirstOrder { by, responses };
    let (summary, shape) = aside(py, move || dispatch::rest(&scene, &asked))?;
    pieces(py, &[shape], &summary)
}

/// The branch of a scene with [continue], with derivatives of its special points by fields.
#[pyfunction]
fn branch<'py>(
    py: Python<'py>,
    given: Given,
    by: Vec<String>,
    progress: Option<Py<PyAny>>,
) -> PyResult<Bound<'py, PyDict>> {
    let scene = read(py, &given)?;
    let by = fields(&given, &by)?;
    let mut watch = Watch::new(progress);
    let found = py.detach(|| study::branch::branch_by(&scene, &by, &mut watch));
    watch.finish()?;
    let record = found.map_err(|e| refused(&e))?;
    let mut tables = vec![record.branches.points.clone()];
    tables.extend(record.fold_curves.as_ref().map(|f| f.curves.points.clone()));
    let out = pieces(py, &tables, &record.summary())?;
    let shapes = record.shapes.iter().map(|shape| {
        let points = shape.sections.iter();
        let numbers = points.flat_map(|section| section.position.data.0[0]);
        let numbers = PyArray1::from_vec(py, numbers.collect());
        Ok((
            shape.parameter,
            shape.unstable,
            numbers.reshape([shape.sections.len(), 3])?,
        ))
    });
    out.set_item("shapes", shapes.collect::<PyResult<Vec<_>>>()?)?;
    Ok(out)
}

/// Small motions about the equilibrium of a scene, with derivatives of the frequencies by fields.
#[pyfunction]
fn modes<'py>(py: Python<'py>, given: Given, by: Vec<String>) -> PyResult<Bound<'py, PyDict>> {
    let scene = read(py, &given)?;
    let by = fields(&given, &by)?;
    let (summary, table) = aside(py, move || {
        let record = study::modes(&scene)?;
        let mut summary = record.summary();
        if !by.is_empty() {
            study::modes::derivatives(&scene, &by)?.put_into(&mut summary);
        }
        Ok::<_, snaprod::Error>((summary, record.table()?))
    })?;
    pieces(py, &[table], &summary)
}

/// Small motions of the end of a viscoelastic rod at `points` times, over the given range or one chosen for the rod.
#[pyfunction]
fn memory<'py>(
    py: Python<'py>,
    given: Given,
    span: (Option<f64>, Option<f64>),
    points: usize,
) -> PyResult<Bound<'py, PyDict>> {
    let scene = read(py, &given)?;
    let (summary, table) = aside(py, move || {
        let record = study::memory(&scene)?;
        let [from, to] = record.decades();
        let span = [span.0.unwrap_or(from), span.1.unwrap_or(to)];
        let times = study::memory::times(span, points)?;
        let entries = study::memory::entries(&record, &times);
        let table = study::memory::table(&record, &times, &entries);
        Ok::<_, snaprod::Error>((record.summary(), table))
    })?;
    pieces(py, &[table], &summary)
}

/// An equilibrium of the elastica by the given labels, with its sections at the given arclengths.
#[pyfunction]
#[pyo3(signature = (at, lam, kappa, p, sheet))]
fn elastica<'py>(
    py: Python<'py>,
    at: Vec<f64>,
    lam: f64,
    kappa: Option<f64>,
    p: Option<f64>,
    sheet: Option<(u32, bool, f64, f64)>,
) -> PyResult<Bound<'py, PyDict>> {
    // For an elastica of few sections and folds, starting a thread takes longer than the work.
    let mode = sheet.map_or(0, |(mode, ..)| mode);
    let is_short = at.len() <= 1000 && lam <= 1000.0 && mode <= 1000;
    let work = move || {
        let found = match (kappa, p, sheet) {
            (_, _, Some((mode, plus, k, beta))) => {
                let sign = if plus { Sign::Plus } else { Sign::Minus };
                Equilibrium::from_sheet(Sheet { mode, sign }, k, beta)
            }
            (Some(kappa), ..) => Equilibrium::from_lambda_kappa(lam, kappa),
            (None, p, None) => Equilibrium::from_lambda_p(lam, p.unwrap_or(f64::NAN)),
        };
        let record = study::elastica(found?, &at)?;
        let mut summary = record.summary();
        if let Some(object) = summary.as_object_mut() {
            object.remove("sections");
        }
        Ok((summary, record.shape()?))
    };
    let (summary, shape) = if is_short {
        py.detach(work).map_err(|e| refused(&e))?
    } else {
        aside(py, work)?
    };
    pieces(py, &[shape], &summary)
}

/// All equilibria with the end at each given point: one table, with the number of the point in the first column.
#[pyfunction]
fn equilibria<'py>(
    py: Python<'py>,
    x: PyReadonlyArray1<'py, f64>,
    y: PyReadonlyArray1<'py, f64>,
    lambda_max: f64,
    progress: Option<Py<PyAny>>,
) -> PyResult<(Vec<usize>, Bound<'py, PyDict>)> {
    let points: Vec<[f64; 2]> = (x.as_array().iter())
        .zip(y.as_array())
        .map(|(x, y)| [*x, *y])
        .collect();
    let mut watch = Watch::new(progress);
    let found = py.detach(|| all_equilibria(&points, lambda_max, &mut watch));
    watch.finish()?;
    let (counts, found) = found.map_err(|e| refused(&e))?;
    Ok((counts, table(py, &found)?))
}

/// Number of equilibria at each point, and a table of all of them.
fn all_equilibria(
    points: &[[f64; 2]],
    lambda_max: f64,
    hooks: &mut dyn study::Hooks,
) -> snaprod::Result<(Vec<usize>, Table)> {
    // The point (1, 0) has no equilibrium, but gives the columns.
    let mut all = study::equilibria([1.0, 0.0], lambda_max)?.table()?;
    let mut counts = Vec::with_capacity(points.len());
    for (i, at) in points.iter().enumerate() {
        let before = all.rows();
        match study::equilibria(*at, lambda_max) {
            Ok(record) => {
                let here = record.table()?;
                for row in 0..here.rows() {
                    let cells: Vec<_> = here.columns.iter().map(|c| c.cell(row)).collect();
                    all.push(&cells)?;
                }
            }
            // An unreachable point has no equilibrium; the other points of the array keep theirs.
            Err(e) if e.is_unreachable() => {}
            Err(e) => return Err(e),
        }
        counts.push(all.rows() - before);
        hooks.progress((i + 1) as f64 / points.len() as f64, i as f64);
        if hooks.interrupted() {
            break;
        }
    }
    Ok((counts, all))
}

/// The first fold curves.
#[pyfunction]
fn folds<'py>(py: Python<'py>, count: usize) -> PyResult<Bound<'py, PyDict>> {
    let mut watch = Watch::new(None);
    let found = py.detach(|| study::folds(count, &mut watch));
    watch.finish()?;
    table(py, &found.map_err(|e| refused(&e))?)
}

/// Tables and summary of a record.
pub(crate) fn pieces<'py>(
    py: Python<'py>,
    tables: &[Table],
    summary: &serde_json::Value,
) -> PyResult<Bound<'py, PyDict>> {
    let out = PyDict::new(py);
    let tables = tables.iter().map(|one| table(py, one));
    out.set_item("tables", tables.collect::<PyResult<Vec<_>>>()?)?;
    out.set_item("summary", value(py, summary)?)?;
    Ok(out)
}

#[pymodule]
fn _core(module: &Bound<'_, PyModule>) -> PyResult<()> {
    // The first array looks up NumPy's functions, which panics if Ctrl-C is pending. None can be pending here, and the
    // functions are known later.
    module.py().check_signals()?;
    PyArray1::<f64>::zeros(module.py(), 0, false);
    module.add("__version__", env!("CARGO_PKG_VERSION"))?;
    module.add_class::<loads::State>()?;
    module.add_class::<simulation::Simulation>()?;
    module.add_class::<sweep::Sweep>()?;
    module.add_function(wrap_pyfunction!(toml, module)?)?;
    module.add_function(wrap_pyfunction!(path, module)?)?;
    module.add_function(wrap_pyfunction!(check, module)?)?;
    module.add_function(wrap_pyfunction!(run, module)?)?;
    module.add_function(wrap_pyfunction!(samples, module)?)?;
    module.add_function(wrap_pyfunction!(shapes, module)?)?;
    module.add_function(wrap_pyfunction!(program, module)?)?;
    module.add_function(wrap_pyfunction!(picture, module)?)?;
    module.add_function(wrap_pyfunction!(equilibrium, module)?)?;
    module.add_function(wrap_pyfunction!(branch, module)?)?;
    module.add_function(wrap_pyfunction!(modes, module)?)?;
    module.add_function(wrap_pyfunction!(memory, module)?)?;
    module.add_function(wrap_pyfunction!(elastica, module)?)?;
    module.add_function(wrap_pyfunction!(equilibria, module)?)?;
    module.add_function(wrap_pyfunction!(folds, module)?)?;
    module.add_function(wrap_pyfunction!(fit::fit, module)?)?;
    module.add_function(wrap_pyfunction!(fit::data, module)?)?;
    Ok(())
}
