//! Data of a list of equilibria for a page: numbers, and the shapes of the rods.

use super::numbers::{quantized, units};
use nalgebra::Vector3;
use serde_json::{Value, json};
use snaprod::study::all_equilibria::{AllEquilibriaRecord, StateKind, StateRecord};

/// Bounds on the number of sections of a rod, and on the number of sections of all equilibria together.
const SECTIONS: usize = 41;
const FEWEST: usize = 9;
const IN_ALL: usize = 8_000;

/// A section of a rod: place and d1.
type Section = (Vector3<f64>, Vector3<f64>);

/// Data of the page of a list of equilibria, in the order of the list.
pub fn equilibria_data(record: &AllEquilibriaRecord) -> Value {
    let rods = record.states.iter().map(|state| shapes(state).len());
    let count = (IN_ALL / rods.sum::<usize>().max(1)).clamp(FEWEST, SECTIONS);
    let state = |state: &StateRecord| {
        let rods = shapes(state).into_iter().filter(|rod| rod.len() > 1);
        let bodies = match &state.kind {
            StateKind::Rod(_) => Vec::new(),
            StateKind::Assembly(record) => {
                let bodies = record.bodies.iter();
                let places = bodies.map(|(_, pose)| pose.translation.vector.data.0[0]);
                places.collect()
            }
        };
        json!({
            "energy": state.energy,
            "index": record.indexed.then_some(state.index),
            "flat": state.index_in_plane,
            "neutral": state.neutral,
            "how": state.how,
            "rods": rods.map(|rod| drawn(&rod, count)).collect::<Vec<_>>(),
            "bodies": bodies,
        })
    };
    json!({
        "kind": "equilibria",
        "units": { "length": record.units.length(), "energy": record.units.energy() },
        "conservative": record.conservative,
        "sought": record.sought,
        "proven": record.proven,
        "states": record.states.iter().map(state).collect::<Vec<_>>(),
    })
}

/// The rods of an equilibrium.
fn shapes(state: &StateRecord) -> Vec<Vec<Section>> {
    match &state.kind {
        StateKind::Rod(record) => {
            let sections = record.sections.iter();
            vec![
                sections
                    .map(|at| (at.position, at.directors.column(0).into_owned()))
                    .collect(),
            ]
        }
        StateKind::Assembly(record) => {
            let rod = |rod: &Vec<(f64, nalgebra::Isometry3<f64>)>| {
                let sections = rod.iter();
                sections
                    .map(|(_, pose)| (pose.translation.vector, pose.rotation * Vector3::x()))
                    .collect()
            };
            record.shapes.iter().map(rod).collect()
        }
    }
}

/// A rod at `count` sections.
fn drawn(rod: &[Section], count: usize) -> Value {
    let last = rod.len() - 1;
    let chosen: Vec<&Section> = (0..count).map(|i| &rod[i * last / (count - 1)]).collect();
    let places = chosen.iter().flat_map(|(place, _)| place.data.0[0]);
    json!({
        "sections": count,
        "at": quantized(&places.collect::<Vec<f64>>()),
        "d1": units(chosen.iter().flat_map(|(_, d1)| d1.data.0[0])),
    })
}
