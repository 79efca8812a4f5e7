//! Saved states of simulations, with their JSON.

use super::super::prepared::Prepared;
use crate::error::{Error, Result};
use crate::motion::{Motion, SavedState};
use serde_json::{Value, json};

/// A saved state of a simulation.
#[derive(Debug, Clone, PartialEq)]
pub struct SimulationState {
    /// Time in the units of the scene.
    pub t: f64,
    /// State of the motion, in units of the rod. Its method is [`SimulationState::START`] before the first step, and
    /// [`SimulationState::REPLAY`] where the motion saves no state.
    pub motion: SavedState,
    /// Steered forces, in the units of the scene.
    pub pushes: Vec<[f64; 3]>,
}

/// A change of a steered force.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) struct Push {
    /// Time, in units of the motion.
    pub t: f64,
    /// Number of the force.
    pub k: usize,
    /// The force from then on, in the units of the scene.
    pub force: [f64; 3],
}

impl SimulationState {
    /// Name of the method of a state before the first step.
    pub const START: &str = "start";
    /// Name of the method of a state that is reached by following the motion once more from the start. The steered
    /// forces on the way are in the parts "times", "numbers" and "forces".
    pub const REPLAY: &str = "replay";

    /// The last state of a motion without steered forces.
    pub(in crate::study::run) fn of(
        prepared: &Prepared,
        motion: &mut dyn Motion<'_>,
    ) -> Result<Self> {
        let t = motion.now().time();
        Ok(Self {
            t: prepared.time(t),
            motion: motion.save(t)?,
            pushes: Vec::new(),
        })
    }

    /// The state as JSON.
    pub fn json(&self) -> Value {
        json!({
            "snaprod": env!("CARGO_PKG_VERSION"),
            "t": self.t,
            "time": self.motion.t,
            "method": self.motion.method,
            "parts": self.motion.parts,
            "pushes": self.pushes,
        })
    }

    /// A state from [`SimulationState::json`].
    ///
    /// # Errors
    /// JSON that is none of a state; the message names the entry.
    pub fn from_json(value: &Value) -> Result<Self> {
        let wrong = |name: &str| Error::domain(format!("the state has no sound entry {name:?}"));
        let number = |name: &str| value[name].as_f64().ok_or_else(|| wrong(name));
        let parts = value["parts"].as_object().ok_or_else(|| wrong("parts"))?;
        let list = |name: &str, list: &Value| -> Result<Vec<f64>> {
            let items = list.as_array().ok_or_else(|| wrong(name))?.iter();
            items
                .map(|x| x.as_f64().ok_or_else(|| wrong(name)))
                .collect()
        };
        let parts = parts
            .iter()
            .map(|(name, numbers)| Ok((name.clone(), list(name, numbers)?)));
        let pushes = value["pushes"].as_array().ok_or_else(|| wrong("pushes"))?;
        let push = |push: &Value| -> Result<[f64; 3]> {
            let found = list("pushes", push)?;
            found.try_into().map_err(|_| wrong("pushes"))
        };
        Ok(Self {
            t: number("t")?,
            motion: SavedState {
                method: value["method"]
                    .as_str()
                    .ok_or_else(|| wrong("method"))?
                    .to_owned(),
                t: number("time")?,
                parts: parts.collect::<Result<_>>()?,
            },
            pushes: pushes.iter().map(push).collect::<Result<_>>()?,
        })
    }
}

/// The state at the time `t` by a replay under these forces.
pub(super) fn replay(t: f64, log: &[Push]) -> SavedState {
    let parts = [
        ("times", log.iter().map(|push| push.t).collect()),
        ("numbers", log.iter().map(|push| push.k as f64).collect()),
        ("forces", log.iter().flat_map(|push| push.force).collect()),
    ];
    SavedState {
        method: SimulationState::REPLAY.to_owned(),
        t,
        parts: parts.map(|(name, list)| (name.to_owned(), list)).into(),
    }
}

/// The forces of a replay.
pub(super) fn pushes_of(saved: &SavedState) -> Result<Vec<Push>> {
    let part = |name: &str| saved.parts.get(name).map_or(&[][..], Vec::as_slice);
    let (times, numbers, forces) = (part("times"), part("numbers"), part("forces"));
    if numbers.len() != times.len() || forces.len() != 3 * times.len() {
        return Err(Error::domain(
            "the parts times, numbers and forces of the state must be of one length",
        ));
    }
    let each = times.iter().zip(numbers).zip(forces.chunks(3));
    Ok(each
        .map(|((t, k), force)| Push {
            t: *t,
            k: *k as usize,
            force: [force[0], force[1], force[2]],
        })
        .collect())
}
