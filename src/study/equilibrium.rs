//! Static equilibrium of a scene of one rod.

use super::contact::{self, ContactsRecord};
use super::record::{Cell, Column, Table};
use super::space::quaternion;
use super::stations::{self, StationValues};
use super::tendons::{Pulled, TendonsRecord, equilibrium_with_tendons};
use crate::error::Result;
use crate::math::se3::halves;
use crate::rod::{Equilibrium, RodSection, ZeroMode};
use crate::scene::{Scene, Units};
use crate::section::Centreline;
use nalgebra::Vector3;
use serde_json::{Value, json};

/// An equilibrium with its shape.
#[derive(Debug, Clone, PartialEq)]
pub struct EquilibriumRecord {
    /// The units of every quantity.
    pub units: Units,
    /// Length of the rod.
    pub length: f64,
    /// Reference bending stiffness B, the unit B/L of couples and B/L^2 of forces.
    pub stiffness: f64,
    /// Total force of the load along the rod, if any.
    pub weight: Option<Vector3<f64>>,
    /// Base wrench, end, index and solution path.
    pub found: Equilibrium,
    /// Neutral motions by a symmetry of the scene: they leave the energy as it is. The index leaves these motions out.
    pub zero_modes: Vec<ZeroMode>,
    /// True if the loads have a potential: only then the index decides stability.
    pub conservative: bool,
    /// True if the equilibrium has an index. There is none where a load turns with the rod beside a dead one, or along
    /// the rod, and none where the rod lies along an obstacle.
    pub indexed: bool,
    /// True if the inverse of a linear, uniform section law was formed only once.
    pub uniform: bool,
    /// Evenly spaced sections, from the clamp to the end.
    pub sections: Vec<RodSection>,
    /// Values at the stations of the scene, by their names.
    pub stations: Vec<(String, Option<StationValues>)>,
    /// Tendons of the rod, if any. Couples and forces of the equilibrium are then totals of rod and tendons.
    pub tendons: Option<TendonsRecord>,
    /// Contacts with the obstacles of the scene; `None` without obstacles.
    pub contacts: Option<ContactsRecord>,
    /// The curve through points that is the rest shape, if any.
    pub centreline: Option<Centreline>,
}

/// Sections of the shape.
const SECTIONS: usize = 201;

/// Solves the scene and describes its equilibrium.
///
/// # Errors
/// Data without a well-posed problem; no equilibrium found.
pub fn equilibrium(scene: &Scene) -> Result<EquilibriumRecord> {
    if scene.obstacles.is_empty() {
        return described(equilibrium_with_tendons(scene)?);
    }
    let (pulled, among, at) = contact::touched(scene)?;
    let record = described_by(pulled, &|places| among.sections(&at, places))?;
    Ok(EquilibriumRecord {
        contacts: Some(ContactsRecord::new(scene, &at)),
        indexed: record.indexed && at.index.is_some(),
        // An obstacle holds what a symmetry of the rod alone would set free.
        zero_modes: Vec::new(),
        ..record
    })
}

/// The record of an equilibrium of a scene.
pub(in crate::study) fn described(pulled: Pulled) -> Result<EquilibriumRecord> {
    let (problem, base) = (pulled.problem.clone(), pulled.found.base);
    described_by(pulled, &|places| problem.sections(&base, places))
}

/// The record of an equilibrium whose sections at places s/length are given.
pub(in crate::study) fn described_by(
    pulled: Pulled,
    along: &dyn Fn(&[f64]) -> Result<Vec<RodSection>>,
) -> Result<EquilibriumRecord> {
    let Pulled {
        scene,
        problem,
        mut found,
        tendons,
    } = pulled;
    let last = SECTIONS - 1;
    let places: Vec<f64> = (0..=last).map(|i| i as f64 / last as f64).collect();
    let sections = along(&places)?;
    let stations = stations::at_rest(&scene, |_, places| {
        let sections = along(places)?;
        Ok(sections.iter().map(StationValues::at_rest).collect())
    })?;
    let law = scene.rod.tendon_law()?;
    let tendons = tendons.zip(law);
    let tendons = tendons.map(|(tendons, law)| tendons.along(&law, scene.rod.length, &sections));
    if let Some(tendons) = &tendons {
        // The law of a rod with tendons stores their potential as well.
        found.end.energy -= tendons.potential();
    }
    Ok(EquilibriumRecord {
        units: scene.units,
        length: scene.rod.length,
        stiffness: problem.rod().reference_stiffness(),
        weight: if scene.is_loaded_along() {
            Some(scene.load_along()?.total(scene.rod.length))
        } else {
            None
        },
        zero_modes: problem.zero_modes(&found.base),
        conservative: problem.is_conservative(),
        indexed: !problem.is_mixed(),
        uniform: problem.rod().hoists_inverse(),
        sections,
        stations,
        tendons,
        contacts: None,
        centreline: scene.rod.centreline.clone(),
        found,
    })
}

/// Couple and force along the directors.
pub fn resultants(section: &RodSection) -> (Vector3<f64>, Vector3<f64>) {
    let back = section.directors.transpose();
    (back * section.couple, back * section.force)
}

impl EquilibriumRecord {
    /// JSON form without the shape.
    pub fn summary(&self) -> Value {
        let (found, route) = (&self.found, &self.found.route);
        let (base_couple, base_force) = halves(&found.base);
        let mut summary = json!({
            "position": found.end.position.as_slice(),
            "quaternion": self.quaternion(),
            "base_force": base_force.as_slice(),
            "base_couple": base_couple.as_slice(),
            "tip_force": found.end.force.as_slice(),
            "tip_couple": found.end.couple.as_slice(),
            "energy": found.end.energy,
            "index": self.indexed.then_some(found.index),
            "zero_modes": self.zero_modes.iter().map(ZeroMode::to_string).collect::<Vec<_>>(),
            "stable": (self.conservative && self.indexed).then_some(found.index == 0),
            "conservative": self.conservative,
            "residual": found.residual,
            "path": {
                "kind": found.taken.path.as_str(),
                "why": found.taken.why,
                "uniform": self.uniform,
                "from_guess": route.from_guess,
                "continuation_steps": route.steps,
                "bent_start": route.imperfect,
                "newton_steps": route.iterations,
                "evaluations": route.evaluations,
                "smallest_damping": route.damping,
            },
        });
        if let Some(tendons) = &self.tendons {
            let [couple, force] = tendons.base;
            summary["tendons"] = json!(tendons.each);
            summary["backbone_base_force"] = json!(force.as_slice());
            summary["backbone_base_couple"] = json!(couple.as_slice());
        }
        if !self.stations.is_empty() {
            summary["stations"] = stations::json(&self.stations);
        }
        if let Some(contacts) = &self.contacts {
            summary["contacts"] = contacts.json();
        }
        if let Some(centreline) = &self.centreline {
            summary["centreline"] = json!(centreline);
        }
        if let Some(weight) = &self.weight {
            summary["weight"] = json!(weight.as_slice());
            summary["potential"] = json!(found.potential);
        }
        summary
    }

    /// Quaternion [w, x, y, z] of the directors at the end, w >= 0.
    pub fn quaternion(&self) -> [f64; 4] {
        quaternion(&self.found.end)
    }

    /// The shape: a row for each section.
    ///
    /// # Errors
    /// None that is known of.
    pub fn shape(&self) -> Result<Table> {
        let units = self.units;
        let (length, curvature) = (units.length(), units.curvature());
        let (couple, force) = (units.couple(), units.force());
        let mut columns = vec![Column::reals("s", length, "arclength of the unloaded rod")];
        let mut three = |names: [&'static str; 3], unit: &'static str, meaning: &'static str| {
            columns.extend(names.map(|name| Column::reals(name, unit, meaning)));
        };
        three(["x", "y", "z"], length, "position of the centreline");
        three(["d1x", "d1y", "d1z"], "", "director d1");
        three(["d2x", "d2y", "d2z"], "", "director d2");
        three(["d3x", "d3y", "d3z"], "", "director d3, across the section");
        three(
            ["u1", "u2", "u3"],
            curvature,
            "curvature, or twist, about the director",
        );
        three(
            ["v1", "v2", "v3"],
            "",
            "shear, or stretch, along the director",
        );
        three(["m1", "m2", "m3"], couple, "couple about the director");
        three(["n1", "n2", "n3"], force, "force along the director");
        let mut energy = "energy stored between the clamp and here";
        if self.tendons.is_some() {
            energy = "energy stored between the clamp and here, with tension times length of the tendons";
            let alone = ["couple in the rod alone", "force in the rod alone"];
            three(["rod_m1", "rod_m2", "rod_m3"], couple, alone[0]);
            three(["rod_n1", "rod_n2", "rod_n3"], force, alone[1]);
        }
        columns.push(Column::reals("energy", units.energy(), energy));
        let mut table = Table::new("shape", columns);
        let alone = self.tendons.iter().flat_map(|tendons| &tendons.along);
        let mut alone = alone.map(|w| w.iter().copied());
        for section in &self.sections {
            let (m, n) = resultants(section);
            let row: Vec<Cell> = std::iter::once(section.s)
                .chain(section.position.iter().copied())
                .chain(section.directors.iter().copied())
                .chain(section.strain.iter().copied())
                .chain(m.iter().copied())
                .chain(n.iter().copied())
                .chain(alone.next().into_iter().flatten())
                .chain([section.energy])
                .map(Cell::Real)
                .collect();
            table.push(&row)?;
        }
        Ok(table)
    }
}
