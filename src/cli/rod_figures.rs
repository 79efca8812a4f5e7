//! Conversion of records of rods in space to data of figures.

use nalgebra::{Isometry3, Vector3};
use snaprod::assembly::Joint;
use snaprod::motion::Ledger;
use snaprod::plot::{AxisUnits, Energies, Ground, RodState, SpaceBody, SpaceRod};
use snaprod::rod::RodSection;
use snaprod::scene::{Component, Scales, Scene, Units};
use snaprod::study::{EquilibriumRecord, Solid, equilibrium::resultants};

/// Data of a drawn rod.
pub fn drawn(sections: &[RodSection], value: Option<f64>, unstable: bool) -> SpaceRod {
    SpaceRod {
        points: sections.iter().map(|s| s.position.into()).collect(),
        directors: sections
            .iter()
            .map(|s| std::array::from_fn(|j| s.directors.column(j).into_owned().into()))
            .collect(),
        value,
        unstable,
        ..SpaceRod::default()
    }
}

/// Data of a drawn rod with sections in these poses.
pub fn posed<'a>(
    sections: impl Iterator<Item = &'a Isometry3<f64>> + Clone,
    ground: &[Option<Joint>; 2],
) -> SpaceRod {
    let directors = |pose: &Isometry3<f64>| {
        let turn = pose.rotation.to_rotation_matrix();
        std::array::from_fn(|j| turn.matrix().column(j).into_owned().into())
    };
    let points = sections.clone().map(|pose| pose.translation.vector.into());
    SpaceRod {
        points: points.collect(),
        directors: sections.map(directors).collect(),
        ground: self::ground(ground),
        ..SpaceRod::default()
    }
}

/// Data of a drawn body in this pose.
pub fn body(
    solid: &Solid,
    pose: &Isometry3<f64>,
    value: Option<f64>,
    colour: Option<usize>,
) -> SpaceBody {
    let edges = pose.rotation.to_rotation_matrix().matrix() * solid.half_edges;
    SpaceBody {
        centre: solid.centre(pose).into(),
        half_edges: std::array::from_fn(|j| edges.column(j).into_owned().into()),
        value,
        colour,
    }
}

/// The rod with its supports: the clamp, and the joint of a held end.
pub fn on_ground(rod: SpaceRod, scene: &Scene) -> SpaceRod {
    let end = scene.end().ok();
    let end = end.filter(|end| !end.position.contains(&Component::Free));
    let end = end.map(|end| match end.orientation {
        Some(_) => Ground::Clamp,
        None => Ground::Ball,
    });
    SpaceRod {
        ground: [Some(Ground::Clamp), end],
        ..rod
    }
}

/// Drawn supports of the base and the end of a rod on the ground.
pub fn ground(joints: &[Option<Joint>; 2]) -> [Option<Ground>; 2] {
    let held = |joint: Joint| match joint {
        Joint::Weld => Ground::Clamp,
        Joint::Ball => Ground::Ball,
    };
    joints.map(|joint| joint.map(held))
}

/// Energy ledger over time; `states` are in order of time. The work of loads is shown if `driven`, or not 0.
pub fn energies(
    states: &[(f64, &Ledger)],
    driven: bool,
    snaps: Vec<f64>,
    units: AxisUnits,
) -> Energies {
    let first = states.first().map_or(0.0, |(_, ledger)| ledger.total());
    let column = |f: &dyn Fn(&Ledger) -> f64| states.iter().map(|(_, l)| f(l)).collect();
    // A term that is zero throughout is left out.
    let or_none = |f: &dyn Fn(&Ledger) -> f64| {
        let used = states.iter().any(|(_, l)| f(l) != 0.0);
        if used { column(f) } else { Vec::new() }
    };
    Energies {
        time: states.iter().map(|(t, _)| *t).collect(),
        kinetic: column(&|l| l.kinetic),
        rod_kinetic: or_none(&|l| l.rod_kinetic),
        elastic: column(&|l| l.elastic),
        potential: or_none(&|l| l.potential),
        dissipated: or_none(&|l| l.dissipated),
        work: if driven {
            column(&|l| l.work)
        } else {
            or_none(&|l| l.work)
        },
        total: column(&|l| l.kinetic + l.rod_kinetic + l.elastic + l.potential),
        error: column(&|l| l.total() - first),
        snaps,
        units,
        ..Energies::default()
    }
}

/// Units of figures of a motion with these scales. A dimensionless rod of unit length, stiffness and mass has natural
/// units; other dimensionless quantities have none.
pub fn scaled(units: Units, scales: &Scales) -> AxisUnits {
    match units {
        Units::Si => AxisUnits::si(scales.length),
        Units::Dimensionless if scales.are_one() => AxisUnits::default(),
        Units::Dimensionless => AxisUnits::unnamed(scales.length),
    }
}

/// Units of figures in statics.
pub fn units(units: Units) -> AxisUnits {
    match units {
        Units::Si => AxisUnits::si(1.0),
        // In an arbitrary consistent system of units no symbol is right.
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
        tendons: (record.tendons.iter().flat_map(|tendons| &tendons.paths))
            .map(|path| path.iter().map(|p| (*p).into()).collect())
            .collect(),
        obstacles: (record.contacts.iter())
            .flat_map(|contacts| {
                let points: Vec<Vector3<f64>> = sections.iter().map(|s| s.position).collect();
                contacts.outlines(&points)
            })
            .collect(),
        contacts: (record.contacts.iter().flat_map(|contacts| &contacts.each))
            .map(|contact| [contact.touch.position.into(), contact.touch.normal.into()])
            .collect(),
        stiffness: record.stiffness,
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
