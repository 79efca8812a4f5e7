//! Functions of Python as loads on bodies.

use crate::Given;
use crate::convert::refused;
use numpy::PyArray1;
use pyo3::exceptions::{PyAttributeError, PyKeyError, PyTypeError, PyValueError};
use pyo3::prelude::*;
use snaprod::body::{BodyState, BodyWrench, LoadFunction};
use snaprod::scene::Scene;
use std::sync::{Arc, Mutex, PoisonError};

/// A function from Python: the body, "force" or "couple", the function, and the times of its jumps.
pub type GivenLoad = (String, String, Py<PyAny>, Vec<f64>);

/// The exception that a function has raised, shared by all functions of a scene. Once there is one, no function is
/// called: each load is NaN, which ends the motion.
#[derive(Clone, Default)]
pub struct Raised(Arc<Mutex<Option<PyErr>>>);

impl Raised {
    fn slot(&self) -> std::sync::MutexGuard<'_, Option<PyErr>> {
        self.0.lock().unwrap_or_else(PoisonError::into_inner)
    }

    /// True if a function has raised.
    pub fn is_there(&self) -> bool {
        self.slot().is_some()
    }

    /// The exception. Functions are called again from now on.
    pub fn take(&self) -> Option<PyErr> {
        self.slot().take()
    }

    /// A result of work, unless a function has raised.
    pub fn or<T>(&self, result: PyResult<T>) -> PyResult<T> {
        match self.take() {
            Some(raised) => Err(raised),
            None => result,
        }
    }
}

/// Lets the functions of a scene act on its bodies.
pub fn act(py: Python<'_>, scene: &mut Scene, given: &Given) -> PyResult<Raised> {
    let raised = Raised::default();
    for (body, kind, function, jumps) in &given.3 {
        let couple = kind == "couple";
        let turns = scene.turns(body).map_err(|e| refused(&e))?;
        let name = match body.as_str() {
            "" => format!("loads[{kind:?}]"),
            body => format!("loads[{body:?}][{kind:?}]"),
        };
        if couple && !turns {
            let why = format!("{name}: a point mass bears no couple; give the body an inertia");
            return Err(refused(&snaprod::Error::domain(why)));
        }
        let planar = scene.is_planar() && !scene.is_assembly();
        let called = Called {
            function: function.clone_ref(py),
            couple,
            planar,
            turns,
            name: name.clone(),
            raised: raised.clone(),
        };
        let load = LoadFunction::piecewise(move |now| called.at(now), jumps.clone());
        let load = load.map_err(|e| refused(&e.context(name)))?;
        scene.act(body, load).map_err(|e| refused(&e))?;
    }
    Ok(raised)
}

/// A function of Python on a body.
struct Called {
    function: Py<PyAny>,
    /// True for a couple, false for a force.
    couple: bool,
    planar: bool,
    turns: bool,
    /// Name for messages.
    name: String,
    raised: Raised,
}

impl Called {
    fn at(&self, now: &BodyState) -> BodyWrench {
        let mut vector = [f64::NAN; 3];
        if !self.raised.is_there() {
            match Python::attach(|py| self.call(py, now)) {
                Ok(found) => vector = found,
                Err(e) => *self.raised.slot() = Some(e),
            }
        }
        let mut load = BodyWrench::default();
        if self.couple {
            load.couple = vector.into();
        } else {
            load.force = vector.into();
        }
        load
    }

    fn call(&self, py: Python<'_>, now: &BodyState) -> PyResult<[f64; 3]> {
        let state = State {
            now: *now,
            planar: self.planar,
            turns: self.turns,
        };
        let found = self.function.bind(py).call1((now.t, state))?;
        let wanted = if self.planar { "2" } else { "3" };
        let numbers: Vec<f64> = found.extract().map_err(|_| {
            let name = &self.name;
            PyTypeError::new_err(format!("{name} returned {found}: must be {wanted} numbers"))
        })?;
        let given: [f64; 3] = match numbers.as_slice() {
            [x, y] if self.planar => [*x, *y, 0.0],
            [x, y, z] if !self.planar || *z == 0.0 => [*x, *y, *z],
            _ => [f64::NAN; 3],
        };
        if given.iter().all(|x| x.is_finite()) {
            return Ok(given);
        }
        Err(PyValueError::new_err(format!(
            "{} returned {found} at t = {}: must be {wanted} finite numbers",
            self.name, now.t
        )))
    }
}

/// A body at one moment inside a step, in the world and in the units of the scene.
#[pyclass(frozen, name = "BodyState", module = "snaprod")]
pub struct State {
    now: BodyState,
    planar: bool,
    turns: bool,
}

impl State {
    fn array<'py>(&self, py: Python<'py>, v: &[f64]) -> Bound<'py, PyArray1<f64>> {
        PyArray1::from_slice(py, &v[..if self.planar { 2 } else { 3 }])
    }

    /// A number by its name in the trajectory.
    fn number(&self, name: &str) -> Option<f64> {
        let (now, q) = (&self.now, self.now.pose.rotation);
        let [position, spin] = [&now.pose.translation.vector, &now.angular_velocity];
        let sign = if q.w < 0.0 { -1.0 } else { 1.0 };
        Some(match name {
            "t" => now.t,
            "x" => position.x,
            "y" => position.y,
            "vx" => now.velocity.x,
            "vy" => now.velocity.y,
            "z" if !self.planar => position.z,
            "vz" if !self.planar => now.velocity.z,
            "qw" if self.turns => sign * q.w,
            "qx" if self.turns => sign * q.i,
            "qy" if self.turns => sign * q.j,
            "qz" if self.turns => sign * q.k,
            "wx" if self.turns => spin.x,
            "wy" if self.turns => spin.y,
            "wz" if self.turns => spin.z,
            _ => return None,
        })
    }

    fn names(&self) -> Vec<&'static str> {
        let all = [
            "t", "x", "y", "z", "qw", "qx", "qy", "qz", "vx", "vy", "vz", "wx", "wy", "wz",
        ];
        let there = all.into_iter().filter(|name| self.number(name).is_some());
        there.collect()
    }
}

#[pymethods]
impl State {
    /// Place of the origin of the body's frame: the end of the rod.
    #[getter]
    fn position<'py>(&self, py: Python<'py>) -> Bound<'py, PyArray1<f64>> {
        self.array(py, self.now.pose.translation.vector.as_slice())
    }

    /// Velocity of the origin of the body's frame.
    #[getter]
    fn velocity<'py>(&self, py: Python<'py>) -> Bound<'py, PyArray1<f64>> {
        self.array(py, self.now.velocity.as_slice())
    }

    /// Angular velocity; 0 for a point mass.
    #[getter]
    fn angular_velocity<'py>(&self, py: Python<'py>) -> Bound<'py, PyArray1<f64>> {
        PyArray1::from_slice(py, self.now.angular_velocity.as_slice())
    }

    /// Unit quaternion (w, x, y, z) of the body's frame, w >= 0; of a point mass that of no turn.
    #[getter]
    fn quaternion<'py>(&self, py: Python<'py>) -> Bound<'py, PyArray1<f64>> {
        let q = self.now.pose.rotation;
        let sign = if q.w < 0.0 { -1.0 } else { 1.0 };
        PyArray1::from_slice(py, &[q.w, q.i, q.j, q.k].map(|x| sign * x))
    }

    /// Components that every body has are attributes of their own, which are faster than those by name.
    #[getter]
    fn x(&self) -> f64 {
        self.now.pose.translation.x
    }

    #[getter]
    fn y(&self) -> f64 {
        self.now.pose.translation.y
    }

    #[getter]
    fn vx(&self) -> f64 {
        self.now.velocity.x
    }

    #[getter]
    fn vy(&self) -> f64 {
        self.now.velocity.y
    }

    /// Names of the numbers.
    fn keys(&self) -> Vec<&'static str> {
        self.names()
    }

    fn __getitem__(&self, name: &str) -> PyResult<f64> {
        self.number(name).ok_or_else(|| {
            let names = self.names().join(", ");
            PyKeyError::new_err(format!("{name:?}: the numbers of a body are {names}"))
        })
    }

    fn __getattr__(&self, name: &str) -> PyResult<f64> {
        self.number(name).ok_or_else(|| {
            let names = self.names().join(", ");
            PyAttributeError::new_err(format!(
                "{name:?}: a BodyState has position, velocity, quaternion, angular_velocity and the numbers {names}"
            ))
        })
    }

    fn __repr__(&self) -> String {
        let numbers = self.names().into_iter();
        let numbers = numbers.filter_map(|name| Some(format!("{name} = {}", self.number(name)?)));
        format!("<BodyState: {}>", numbers.collect::<Vec<_>>().join(", "))
    }
}
