//! A simulation that is stepped from Python.

use crate::convert::{cell, refused, table, value};
use crate::hooks::Watch;
use crate::loads::Raised;
use crate::{Given, read, read_with_loads};
use numpy::{PyArray1, PyArrayMethods};
use pyo3::prelude::*;
use pyo3::types::{PyDict, PyList};
use serde_json::Value;
use snaprod::study::run::{Simulation as Stepped, SimulationState};

/// A simulation. It stays with the thread that made it, since its motion borrows from its scene.
#[pyclass(unsendable)]
pub struct Simulation {
    motion: Stepped,
    raised: Raised,
}

/// A state from its JSON.
pub fn read_state(text: &str) -> PyResult<SimulationState> {
    let value: Value = serde_json::from_str(text).map_err(|e| {
        refused(&snaprod::Error::domain(format!(
            "the state is no JSON: {e}"
        )))
    })?;
    SimulationState::from_json(&value).map_err(|e| refused(&e))
}

#[pymethods]
impl Simulation {
    /// `pushed`: names of the bodies whose forces can be steered.
    #[new]
    fn new(py: Python<'_>, given: Given, pushed: Vec<String>) -> PyResult<Self> {
        let (scene, raised) = read_with_loads(py, &given)?;
        let bodies: Vec<&str> = pushed.iter().map(String::as_str).collect();
        let motion = raised.or(Stepped::pushed(&scene, &bodies).map_err(|e| refused(&e)))?;
        Ok(Self { motion, raised })
    }

    /// Time now.
    #[getter]
    fn t(&self) -> f64 {
        self.motion.t()
    }

    /// End of time.
    #[getter]
    fn duration(&self) -> f64 {
        self.motion.duration()
    }

    /// Reason why the motion ended.
    #[getter]
    fn ended(&self) -> Option<String> {
        self.motion.ended()
    }

    /// Advances to a time.
    fn advance(&mut self, t: f64) -> PyResult<()> {
        let mut watch = Watch::new(None).under(self.raised.clone());
        let advanced = self.motion.advance_with(t, &mut watch);
        watch.raised()?;
        advanced.map_err(|e| refused(&e))
    }

    /// Takes one step; false at the end.
    fn step(&mut self) -> PyResult<bool> {
        let stepped = self.motion.step();
        self.raised.or(stepped.map_err(|e| refused(&e)))
    }

    /// The trajectory without rows.
    fn columns<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyDict>> {
        table(py, &self.motion.columns())
    }

    /// The present state as a row of the trajectory.
    fn row<'py>(&mut self, py: Python<'py>) -> PyResult<Bound<'py, PyList>> {
        let row = self.motion.row();
        let row = self.raised.or(row.map_err(|e| refused(&e)))?;
        let cells = row.iter().map(|one| cell(py, one));
        PyList::new(py, cells.collect::<PyResult<Vec<_>>>()?)
    }

    /// Names of the rods, and positions of their sections.
    fn shapes<'py>(&mut self, py: Python<'py>, points: usize) -> PyResult<Bound<'py, PyDict>> {
        let names = self.motion.rods();
        let rods = self.motion.shapes(points);
        let rods = self.raised.or(rods.map_err(|e| refused(&e)))?;
        let out = PyDict::new(py);
        for (name, rod) in names.into_iter().zip(rods) {
            let sections = rod.len();
            let places = rod.into_iter();
            let numbers = places.flat_map(|(_, pose)| pose.translation.vector.data.0[0]);
            let numbers = PyArray1::from_vec(py, numbers.collect());
            out.set_item(name, numbers.reshape([sections, 3])?)?;
        }
        Ok(out)
    }

    /// Events so far.
    fn events<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyAny>> {
        let events = self.motion.events().map_err(|e| refused(&e))?;
        value(py, &events.into())
    }

    /// Steers the force on a body, by its number in the list.
    fn push(&mut self, body: usize, force: [f64; 3]) -> PyResult<()> {
        let pushed = self.motion.push(body, force);
        self.raised.or(pushed.map_err(|e| refused(&e)))
    }

    /// Everything from which the motion goes on, as JSON.
    fn state(&mut self) -> PyResult<String> {
        let state = self.motion.state();
        let state = self.raised.or(state.map_err(|e| refused(&e)))?;
        Ok(state.json().to_string())
    }

    /// Goes on from a state in JSON.
    fn restore(&mut self, state: &str) -> PyResult<()> {
        let state = read_state(state)?;
        let restored = self.motion.restore(&state);
        self.raised.or(restored.map_err(|e| refused(&e)))
    }

    /// Goes back to the start.
    fn reset(&mut self) -> PyResult<()> {
        let reset = self.motion.reset();
        self.raised.or(reset.map_err(|e| refused(&e)))
    }

    /// Goes on under another scene.
    fn change(&mut self, py: Python<'_>, given: Given) -> PyResult<()> {
        let scene = read(py, &given)?;
        let changed = self.motion.change(&scene);
        self.raised.or(changed.map_err(|e| refused(&e)))
    }

    /// A simulation of its own in the same state.
    fn copy(&mut self) -> PyResult<Self> {
        let motion = self.motion.copy();
        let motion = self.raised.or(motion.map_err(|e| refused(&e)))?;
        let raised = self.raised.clone();
        Ok(Self { motion, raised })
    }
}
