//! Rods in space as figures want them, from records.

use nalgebra::Vector3;
use snaprod::plot::{AxisUnits, RodState, SpaceRod};
use snaprod::rod::RodSection;
use snaprod::scene::Units;
use snaprod::study::{EquilibriumRecord, equilibrium::resultants};

/// The rod as the figures want it.
pub fn drawn(sections: &[RodSection], value: Option<f64>, unstable: bool) -> SpaceRod {
    SpaceRod {
        name: String::new(),
        points: sections.iter().map(|s| s.position.into()).collect(),
        directors: sections
            .iter()
            .map(|s| std::array::from_fn(|j| s.directors.column(j).into_owned().into()))
            .collect(),
        value,
        unstable,
        colour: None,
    }
}

/// The units of figures.
pub fn units(units: Units) -> AxisUnits {
    match units {
        Units::Si => AxisUnits::si(1.0),
        // Any consistent system: no symbol is right but those of the scene's own numbers.
        Units::Dimensionless => AxisUnits::unnamed(1.0),
    }
}

/// An equilibrium: shape, loads, resultants and strains.
pub fn state(record: &EquilibriumRecord) -> RodState {
    let (sections, found) = (&record.sections, &record.found);
    let along = |pick: fn(&RodSection) -> Vector3<f64>| -> Vec<[f64; 3]> {
        sections.iter().map(|s| pick(s).into()).collect()
    };
    RodState {
        rod: drawn(sections, None, found.index > 0),
        ribbon: 0.03 * record.length,
        end_force: Some(found.end.force.into()),
        end_couple: Some(found.end.couple.into()),
        s: sections.iter().map(|s| s.s).collect(),
        couples: along(|s| resultants(s).0),
        forces: along(|s| resultants(s).1),
        curvatures: along(|s| s.strain.fixed_rows::<3>(0).into_owned()),
        stretches: along(|s| s.strain.fixed_rows::<3>(3).into_owned()),
        units: units(record.units),
        ..RodState::default()
    }
}
