//! Stations: places on rods whose motion, strains and resultants are written beside those of bodies.

use serde::Serialize;

/// A place on a rod that the tables of a scene follow.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct Station {
    /// Name before the columns; `station1`, `station2`, ... in the order of the list unless given.
    pub name: String,
    /// Name of the rod in an assembly.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub rod: Option<String>,
    /// Arclength of the unloaded rod.
    pub s: f64,
}

impl super::Scene {
    /// Number of a station's rod, as tables of shapes count rods, and the place s/length on the rod.
    pub(crate) fn place_of(&self, station: &Station) -> (usize, f64) {
        let (number, length) = match (self.assembly(), &station.rod) {
            (Some(assembly), Some(name)) => {
                let held = assembly.rods.iter().map(|rod| (&rod.name, &rod.rod));
                let free = assembly.free.iter().map(|rod| (&rod.name, &rod.rod));
                let mut rods = held.chain(free).enumerate();
                let found = rods.find(|(_, (given, _))| *given == name);
                found.map_or((0, self.rod.length), |(k, (_, rod))| (k, rod.length))
            }
            _ => (0, self.rod.length),
        };
        (number, station.s / length)
    }
}
