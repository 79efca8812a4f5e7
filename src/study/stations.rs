//! Stations: pose, velocity, strains and resultants at places on rods, as columns and as JSON.

use super::equilibrium::resultants;
use super::record::Column;
use super::space::upward;
use crate::assembly::Configuration;
use crate::error::{Quantity, Result};
use crate::math::se3::{halves, join};
use crate::motion::SectionState;
use crate::rod::RodSection;
use crate::scene::{AssemblySetup, Scales, Scene, Units};
use nalgebra::{Isometry3, UnitQuaternion, Vector3, Vector6};
use serde_json::{Map, Value, json};
use std::f64::consts::PI;

/// A place on a rod of a scene.
#[derive(Debug, Clone, PartialEq)]
pub struct PlacedStation {
    /// Name before the columns.
    pub name: String,
    /// Number of the rod, those with a free end last.
    pub rod: usize,
    /// Place in the unloaded rod, s over the length.
    pub place: f64,
}

/// Values at a station, in the world and the scene's units.
#[derive(Debug, Clone, PartialEq)]
pub struct StationValues {
    /// Pose.
    pub pose: Isometry3<f64>,
    /// (angular velocity, velocity); `None` at rest, NaN where it is infinite.
    pub twist: Option<Vector6<f64>>,
    /// The six strains.
    pub strain: Vector6<f64>,
    /// (couple, force) along the directors.
    pub resultants: Vector6<f64>,
}

/// Stations of a scene.
pub(super) fn placed(scene: &Scene) -> Vec<PlacedStation> {
    let station = |station| {
        let (rod, place) = scene.place_of(station);
        PlacedStation {
            name: station.name.clone(),
            rod,
            place,
        }
    };
    scene.stations.iter().map(station).collect()
}

/// Stations of a scene in motion, with one more at the free end of each rod of an assembly that has one.
pub(super) fn placed_in_motion(scene: &Scene) -> Vec<PlacedStation> {
    let mut stations = placed(scene);
    if let Some(assembly) = scene.assembly() {
        let held = assembly.rods.len();
        let ends = assembly.free.iter().enumerate();
        stations.extend(ends.map(|(k, rod)| PlacedStation {
            name: format!("{}.end", rod.name),
            rod: held + k,
            place: 1.0,
        }));
    }
    stations
}

/// Columns of the stations; those of velocities only for a motion.
pub(super) fn columns(stations: &[PlacedStation], u: Units, moves: bool) -> Vec<Column> {
    let spin = match u.time() {
        "" => "",
        _ => "rad/s",
    };
    let groups = [
        (&["x", "y", "z"][..], u.length(), "position", true),
        (
            &["qw", "qx", "qy", "qz"],
            "",
            "quaternion of the directors",
            true,
        ),
        (&["vx", "vy", "vz"], u.velocity(), "velocity", moves),
        (
            &["wx", "wy", "wz"],
            spin,
            "angular velocity of the directors",
            moves,
        ),
        (
            &["u1", "u2", "u3"],
            u.curvature(),
            "curvature, or twist, about the director",
            true,
        ),
        (
            &["v1", "v2", "v3"],
            "",
            "shear, or stretch, along the director",
            true,
        ),
        (
            &["m1", "m2", "m3"],
            u.couple(),
            "couple about the director",
            true,
        ),
        (
            &["n1", "n2", "n3"],
            u.force(),
            "force along the director",
            true,
        ),
    ];
    let mut columns = Vec::new();
    for station in stations {
        let name = &station.name;
        for (parts, unit, what, _) in groups.iter().filter(|(_, _, _, there)| *there) {
            columns.extend(parts.iter().map(|part| {
                Column::reals(
                    format!("{name}.{part}"),
                    *unit,
                    format!("{what}, at {name}"),
                )
            }));
        }
    }
    columns
}

/// Values at the stations of a scene. `sections` gives the sections of a rod at ascending places; a station without
/// a section has `None`.
pub(super) fn values(
    stations: &[PlacedStation],
    mut sections: impl FnMut(usize, &[f64]) -> Result<Vec<StationValues>>,
) -> Result<Vec<Option<StationValues>>> {
    let mut values = vec![None; stations.len()];
    let mut order: Vec<usize> = (0..stations.len()).collect();
    order.sort_by(|i, j| {
        let [a, b] = [&stations[*i], &stations[*j]];
        a.rod.cmp(&b.rod).then(a.place.total_cmp(&b.place))
    });
    for of_rod in order.chunk_by(|i, j| stations[*i].rod == stations[*j].rod) {
        let places: Vec<f64> = of_rod.iter().map(|i| stations[*i].place).collect();
        let found = sections(stations[of_rod[0]].rod, &places)?;
        for (i, found) in of_rod.iter().zip(found) {
            values[*i] = Some(found);
        }
    }
    Ok(values)
}

/// Values at the stations of a scene at rest, by their names. `sections` gives the sections of a rod at ascending
/// places in [0, 1].
pub(super) fn at_rest(
    scene: &Scene,
    mut sections: impl FnMut(usize, &[f64]) -> Result<Vec<StationValues>>,
) -> Result<Vec<(String, Option<StationValues>)>> {
    let stations = placed(scene);
    let values = values(&stations, &mut sections)?;
    let names = stations.into_iter().map(|station| station.name);
    Ok(names.zip(values).collect())
}

/// Values at the stations of an assembly at rest, in the units of the scene.
pub(super) fn in_assembly(
    scene: &Scene,
    setup: &AssemblySetup,
    now: &Configuration,
) -> Result<Vec<(String, Option<StationValues>)>> {
    at_rest(scene, |rod, places| {
        from_base(setup.is_reversed(rod), places, |places| {
            let sections = setup.sections(now, rod, places)?;
            let values = |section| StationValues::at_rest(section).outward(&setup.scales);
            Ok(sections.iter().map(values).collect())
        })
    })
}

/// Numbers of the columns of stations at rest.
pub(super) fn numbers(
    stations: &[(String, Option<StationValues>)],
) -> impl Iterator<Item = f64> + '_ {
    let each = stations.iter();
    each.flat_map(|(_, values)| StationValues::numbers(values.as_ref(), false))
}

/// Sections at ascending places of a rod from `sections`. If `reversed`, these count from the rod's other end, with
/// directors turned by pi about d1.
pub(super) fn from_base(
    reversed: bool,
    places: &[f64],
    sections: impl FnOnce(&[f64]) -> Result<Vec<StationValues>>,
) -> Result<Vec<StationValues>> {
    if !reversed {
        return sections(places);
    }
    let from_end: Vec<f64> = places.iter().rev().map(|place| 1.0 - place).collect();
    let found = sections(&from_end)?;
    Ok(found.into_iter().rev().map(StationValues::turned).collect())
}

impl StationValues {
    /// Number of columns of a station at rest and in motion.
    const COUNT: [usize; 2] = [19, 25];

    /// Values of [`columns`]; NaN without a section.
    pub(super) fn numbers(values: Option<&Self>, moves: bool) -> Vec<f64> {
        let Some(at) = values else {
            return vec![f64::NAN; Self::COUNT[usize::from(moves)]];
        };
        let mut numbers = at.pose.translation.vector.as_slice().to_vec();
        numbers.extend(upward(&at.pose.rotation));
        if let Some(twist) = &at.twist {
            let (spin, velocity) = halves(twist);
            numbers.extend(join(&velocity, &spin).iter());
        }
        numbers.extend(at.strain.iter());
        numbers.extend(at.resultants.iter());
        numbers
    }

    /// Values at a section at rest, in its units.
    pub(super) fn at_rest(section: &RodSection) -> Self {
        let (couple, force) = resultants(section);
        Self {
            pose: section.pose(),
            twist: None,
            strain: section.strain,
            resultants: join(&couple, &force),
        }
    }

    /// Values at a section in motion, in its units, with pose and twist in the world.
    pub(super) fn in_motion(
        state: &SectionState,
        pose: Isometry3<f64>,
        twist: Vector6<f64>,
    ) -> Self {
        Self {
            pose,
            twist: Some(twist),
            strain: state.strain,
            resultants: state.resultants,
        }
    }

    /// Values for the rod that runs the other way: d2 and d3 change sign, resultants and strains change sign in the
    /// world.
    fn turned(mut self) -> Self {
        let half = UnitQuaternion::from_axis_angle(&Vector3::x_axis(), PI);
        self.pose.rotation *= half;
        for k in [0, 3] {
            self.strain[k] = -self.strain[k];
            self.resultants[k] = -self.resultants[k];
        }
        self
    }

    /// Values in the units of the scene.
    #[must_use]
    pub(super) fn outward(mut self, k: &Scales) -> Self {
        use Quantity::{AngularVelocity, Couple, Curvature, Force, Length, Ratio, Velocity};
        let both = |of: [Quantity; 2], x: &Vector6<f64>| {
            let (first, second) = halves(x);
            join(&k.outward(of[0], first), &k.outward(of[1], second))
        };
        let place = &mut self.pose.translation.vector;
        *place = k.outward(Length, *place);
        Self {
            pose: self.pose,
            twist: self
                .twist
                .map(|twist| both([AngularVelocity, Velocity], &twist)),
            strain: both([Curvature, Ratio], &self.strain),
            resultants: both([Couple, Force], &self.resultants),
        }
    }

    /// The section at arclength `s` with these values, at rest; the energy is unknown and set to 0.
    pub(super) fn section(&self, s: f64) -> RodSection {
        let (couple, force) = halves(&self.resultants);
        let turn = self.pose.rotation;
        RodSection {
            s,
            position: self.pose.translation.vector,
            directors: *turn.to_rotation_matrix().matrix(),
            couple: turn * couple,
            force: turn * force,
            strain: self.strain,
            energy: 0.0,
        }
    }

    /// Values of a station at rest as JSON, by the names of the columns.
    pub(super) fn json(&self) -> Value {
        let (couple, force) = halves(&self.resultants);
        json!({
            "position": self.pose.translation.vector.as_slice(),
            "quaternion": upward(&self.pose.rotation),
            "strain": self.strain.as_slice(),
            "couple": couple.as_slice(),
            "force": force.as_slice(),
        })
    }
}

/// Stations at rest by their names, as JSON.
pub(super) fn json(named: &[(String, Option<StationValues>)]) -> Value {
    let each = named.iter().map(|(name, values)| {
        let value = values.as_ref().map_or(Value::Null, StationValues::json);
        (name.clone(), value)
    });
    Value::Object(each.collect::<Map<_, _>>())
}
