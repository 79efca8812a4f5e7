//! Assemblies at rest: static equilibrium, and the effect of the rods' mass there.

use crate::assembly::{AssemblyEquilibrium, AssemblyRoute, Configuration, FreeMotion};
use crate::error::Result;
use crate::math::se3::halves;
use crate::motion::RodCurve;
use crate::rod::RodSection;
use crate::scene::{AssemblySetup, Scene, Units};
use crate::study::neglected_mass::{MassEffect, RodsAtRest};
use crate::study::space::upward;
use crate::study::stations::{self, StationValues};
use crate::study::tendons::TendonsRecord;
use crate::study::{Cell, Column, Solid, Table};
use nalgebra::{Isometry3, UnitQuaternion, Vector3, Vector6};
use serde_json::{Map, Value, json};

/// Sections of the shape of a rod, less one.
const SECTIONS: usize = 100;
/// Tolerance of the integration along the rods.
const ALONG: f64 = 1e-13;

/// An equilibrium of an assembly, in the scene's units.
#[derive(Debug, Clone)]
pub struct AssemblyEquilibriumRecord {
    /// The units of every quantity.
    pub units: Units,
    /// Bodies: name, and pose of the frame in the world.
    pub bodies: Vec<(String, Isometry3<f64>)>,
    /// The bodies as figures show them.
    pub solids: Vec<Solid>,
    /// Rods: name, and wrench (couple, force) at the base in the world; rods with a free end last.
    pub rods: Vec<(String, Vector6<f64>)>,
    /// Names of the rods with a free end.
    pub free: Vec<String>,
    /// Stored energy plus potential of gravity and constant forces; couples have no potential.
    pub energy: f64,
    /// Energy stored in the rods alone, without loads and tendons.
    pub elastic: f64,
    /// Tendons of the rods that have some, by the name of the rod.
    pub tendons: Vec<(String, TendonsRecord)>,
    /// Morse index with the bodies free; 0 is stable.
    pub index: usize,
    /// True if the loads have a potential: only then the index decides stability.
    pub conservative: bool,
    /// False for loads along rods without a potential: the index has no meaning.
    pub indexed: bool,
    /// Motions that cost nothing by a symmetry of the scene, in words. The index leaves these motions out.
    pub zero_modes: Vec<String>,
    /// Largest residual of the equations, in the units of the rods.
    pub residual: f64,
    /// True if the equilibrium was found near the guess of the scene; `None` without a guess.
    pub from_guess: Option<bool>,
    /// True for the state at rest after a fall of all rods from their unloaded shapes.
    pub fallen: bool,
    /// Name of an inextensible, unshearable rod shorter than the distance of its ends in the guess.
    pub overdrawn: Option<String>,
    /// Values at the stations of the scene, by their names.
    pub stations: Vec<(String, Option<StationValues>)>,
    /// Every rod, those with a free end last.
    pub shapes: Vec<RodCurve>,
    /// The equilibrium, in units of the rods.
    pub(in crate::study) found: AssemblyEquilibrium,
}

/// Solves the scene of an assembly and describes its equilibrium.
///
/// ```
/// use snaprod::scene::Scene;
/// use snaprod::study::assembly::equilibrium;
/// // A mass that hangs between two rods, free to turn on it.
/// let scene = Scene::parse(
///     r#"
///     [[rod]]
///     name = "left"
///     model = "cosserat"
///     length = 1.0
///     section = { bending = [1.0, 1.0], torsion = 1.0 }
///     from = { position = [-0.8, 0.0, 0.0], rotation = { axis = [0.0, 1.0, 0.0], angle_degrees = 90.0 } }
///     to = { body = "m", joint = "ball" }
///     [[rod]]
///     name = "right"
///     model = "cosserat"
///     length = 1.0
///     section = { bending = [1.0, 1.0], torsion = 1.0 }
///     from = { position = [0.8, 0.0, 0.0], rotation = { axis = [0.0, 1.0, 0.0], angle_degrees = -90.0 } }
///     to = { body = "m", joint = "ball" }
///     [[body]]
///     name = "m"
///     mass = 1.0
///     force = [0.0, 0.0, -1.0]
///     guess = { position = [0.0, 0.0, -0.4] }
///     "#,
/// )?;
/// let found = equilibrium(&scene)?;
/// let lift: f64 = found.rods.iter().map(|(_, wrench)| wrench[5]).sum();
/// assert!((lift + 1.0).abs() < 1e-9); // the rods pull their bases down by the load
/// # Ok::<(), Box<dyn std::error::Error>>(())
/// ```
///
/// # Errors
/// A scene of one rod; no equilibrium found.
pub fn equilibrium(scene: &Scene) -> Result<AssemblyEquilibriumRecord> {
    scene.refuse_functions("an equilibrium")?;
    scene.has_no_obstacles()?;
    let in_units = |e| scene.in_own_units(e);
    let setup = AssemblySetup::new(scene).map_err(in_units)?;
    let found = setup.equilibrium().map_err(in_units)?;
    described(scene, &setup, found)
}

/// The record of an equilibrium of the scene.
pub(in crate::study) fn described(
    scene: &Scene,
    setup: &AssemblySetup,
    found: AssemblyEquilibrium,
) -> Result<AssemblyEquilibriumRecord> {
    let (given, k) = (scene.assembly(), &setup.scales);
    let bodies = given.iter().flat_map(|given| &given.bodies);
    let bodies = bodies.zip(&found.now.bodies).map(|(body, place)| {
        let mut pose = place.pose;
        pose.translation.vector *= k.length;
        (body.name.clone(), pose)
    });
    let solids = given.iter().flat_map(|given| &given.bodies).map(Solid::of);
    let rods = given.iter().flat_map(|given| &given.rods);
    let free = given.iter().flat_map(|given| &given.free);
    let near = found.route.is_near_guess();
    let guess = given.is_some_and(|given| given.bodies.iter().any(|body| body.guess.is_some()));
    let rods = rods.zip(setup.base_wrenches(&found.now)?);
    let stations = stations::in_assembly(scene, setup, &found.now)?;
    let tendons = tendons(scene, setup, &found.now)?;
    let pulled: f64 = tendons.iter().map(|(_, rod)| rod.potential()).sum();
    Ok(AssemblyEquilibriumRecord {
        units: scene.units,
        bodies: bodies.collect(),
        rods: rods
            .map(|(rod, w)| (rod.name.clone(), w))
            .chain(free.clone().map(|rod| (rod.name.clone(), Vector6::zeros())))
            .collect(),
        free: free.map(|rod| rod.name.clone()).collect(),
        energy: found.energy * k.energy,
        elastic: found.stored * k.energy - pulled,
        tendons,
        index: found.index,
        conservative: setup.assembly.is_conservative(0.0),
        indexed: !setup.assembly.has_turning(),
        zero_modes: zero_modes(setup, &found.now)?,
        residual: found.residual,
        from_guess: guess.then_some(near),
        fallen: found.route == AssemblyRoute::Fallen,
        solids: solids.collect(),
        overdrawn: setup.too_short_rod()?.map(str::to_owned),
        stations,
        shapes: setup.shapes(0.0, &found.now, SECTIONS)?,
        found,
    })
}

/// Motions of an equilibrium that cost nothing by a symmetry of the scene, in words.
pub(in crate::study) fn zero_modes(
    setup: &AssemblySetup,
    now: &Configuration,
) -> Result<Vec<String>> {
    let assembly = &setup.assembly;
    let listed = |v: Vector3<f64>| {
        let [x, y, z] = v.map(|x| (1e9 * x).round() / 1e9 + 0.0).into();
        format!("({x}, {y}, {z})")
    };
    let modes = assembly.zero_modes(now, ALONG)?.into_iter();
    let words = modes.map(|mode| match mode {
        FreeMotion::Spin(rod) => {
            let name = assembly.rod_name(rod);
            format!("{name} spins about its own centreline for nothing")
        }
        FreeMotion::Turn { axis, through } => format!(
            "the assembly turns for nothing about the axis {} through {}",
            listed(axis),
            listed(through * setup.scales.length)
        ),
        FreeMotion::Slide(along) => {
            format!("the assembly moves for nothing along {}", listed(along))
        }
    });
    Ok(words.collect())
}

/// Tendons of the rods between attachments that have some, by the name of the rod.
fn tendons(
    scene: &Scene,
    setup: &AssemblySetup,
    now: &Configuration,
) -> Result<Vec<(String, TendonsRecord)>> {
    let rods = scene.assembly().into_iter().flat_map(|given| &given.rods);
    let mut found = Vec::new();
    for (number, rod) in rods.enumerate() {
        let Some(law) = rod.rod.tendon_law()? else {
            continue;
        };
        let length = rod.rod.length;
        let sections = |places: &[f64]| -> Result<Vec<RodSection>> {
            let reversed = setup.is_reversed(number);
            let values = stations::from_base(reversed, places, |places| {
                let sections = setup.sections(now, number, places)?;
                let values = |section| StationValues::at_rest(section).outward(&setup.scales);
                Ok(sections.iter().map(values).collect())
            })?;
            let sections = values.iter().zip(places);
            Ok(sections.map(|(at, x)| at.section(x * length)).collect())
        };
        let record = TendonsRecord::of(&law, length, sections)?;
        found.push((rod.name.clone(), record));
    }
    Ok(found)
}

impl AssemblyEquilibriumRecord {
    /// All but the shapes, as JSON.
    pub fn summary(&self) -> Value {
        let bodies = self
            .bodies
            .iter()
            .map(|(name, pose)| (name.clone(), pose_json(pose)));
        let rods = self.rods.iter().zip(&self.shapes).map(|((name, w), shape)| {
            let (couple, force) = halves(w);
            let turn = shape.first().map_or_else(UnitQuaternion::identity, |(_, pose)| pose.rotation);
            let wrench = |m: Vector3<f64>, n: Vector3<f64>| json!({ "couple": m.as_slice(), "force": n.as_slice() });
            let end = shape.last().map(|(_, pose)| pose_json(pose));
            let mut described = json!({
                "base_wrench": wrench(couple, force),
                "base_wrench_in_directors": wrench(turn.inverse() * couple, turn.inverse() * force),
                "end": end,
            });
            let own = self.tendons.iter().find(|(rod, _)| rod == name);
            if let Some((_, tendons)) = own {
                let [couple, force] = tendons.base;
                described["tendons"] = json!(tendons.each);
                described["backbone_base_wrench"] = wrench(couple, force);
            }
            (name.clone(), described)
        });
        let mut summary = json!({
            "bodies": bodies.collect::<Map<_, _>>(),
            "rods": rods.collect::<Map<_, _>>(),
            "energy": self.energy,
            "elastic_energy": self.elastic,
            "index": self.indexed.then_some(self.index),
            "zero_modes": self.zero_modes,
            "stable": self.conservative.then_some(self.index == 0),
            "conservative": self.conservative,
            "residual": self.residual,
            "from_guess": self.from_guess,
        });
        if !self.stations.is_empty() {
            summary["stations"] = stations::json(&self.stations);
        }
        summary
    }

    /// The shapes of all rods: a row for each section.
    ///
    /// # Errors
    /// None that is known of.
    pub fn shape(&self) -> Result<Table> {
        let length = self.units.length();
        let place = |name: &'static str| Column::reals(name, length, "position of the centreline");
        let part = |name: &'static str| Column::reals(name, "", "unit quaternion of the directors");
        let columns = vec![
            Column::words("rod", "the rod"),
            Column::reals("s", length, "arclength of the unloaded rod from its base"),
            place("x"),
            place("y"),
            place("z"),
            part("qw"),
            part("qx"),
            part("qy"),
            part("qz"),
        ];
        let mut table = Table::new("shape", columns);
        for ((name, _), sections) in self.rods.iter().zip(&self.shapes) {
            for (s, pose) in sections {
                let (r, q) = (pose.translation.vector, upward(&pose.rotation));
                let numbers = [*s].into_iter().chain(r.iter().copied()).chain(q);
                let row: Vec<Cell> = std::iter::once(name.clone().into())
                    .chain(numbers.map(Cell::Real))
                    .collect();
                table.push(&row)?;
            }
        }
        Ok(table)
    }
}

/// Position and quaternion.
pub(super) fn pose_json(pose: &Isometry3<f64>) -> Value {
    json!({
        "position": pose.translation.vector.as_slice(),
        "quaternion": upward(&pose.rotation),
    })
}

/// Effect of the mass of the rods at the equilibrium under the loads at t = 0. `None` where no mass is known or all
/// of it is followed, and where no equilibrium is found.
///
/// # Errors
/// Errors of the setup.
pub fn small_mass(scene: &Scene) -> Result<Option<MassEffect>> {
    let setup = AssemblySetup::new(scene).map_err(|e| scene.in_own_units(e))?;
    if setup.is_heavy() {
        return Ok(None);
    }
    Ok(RodsAtRest::assembly(scene, &setup).map(|resting| resting.mass))
}
