//! Branches of an assembly.

use super::follow::TYPICAL_WRENCH;
use super::subject::{BranchState, INDEX, LoadClass, Subject, VariedScene};
use crate::assembly::{Assembly, AssemblyFamily, CriticalMotion};
use crate::error::{Error, Result};
use crate::full_mass::held_vibrations::{Massive, Sweep, resistance};
use crate::math::se3::halves;
use crate::rod::{RodSection, SectionMass};
use crate::scene::{AssemblySetup, Continue, Parameter, Scene};
use crate::solve::arclength::Point;
use crate::solve::parametrised_problem::Family;
use crate::study::Column;
use crate::study::assembly::zero_modes;
use crate::study::neglected_mass::{FoldAtRest, MassEffect, MassOrigin, RodsAtRest};
use crate::study::space::upward;
use crate::study::stations;
use nalgebra::{DVector, Isometry3};

/// Sections of each rod of a shape, less one.
const SECTIONS: usize = 100;
/// Finest tolerance of the integration along the rods, and its ratio to the tolerance of the points.
const FINEST: f64 = 1e-14;
const INTEGRATION_TOLERANCE_RATIO: f64 = 0.01;
/// Size of rotations (rad) and displacements (mean rod lengths) of the first guesses of deflation.
const MOVED: f64 = 1.0;

type Maker = Box<dyn Fn(f64) -> Result<Assembly>>;

/// An assembly; the unknowns are counted from the equilibrium at the start of the branch.
pub struct Assembled<'a> {
    scene: &'a Scene,
    from_start: AssemblyFamily<Maker>,
    /// Degrees of freedom of each body, and number of rods.
    freedoms: Vec<usize>,
    rods: usize,
    /// Unknowns that vanish in a planar assembly.
    out_of_plane: Vec<usize>,
}

/// Maps a value of `parameter` to the assembly of the scene.
fn assemblies_over(scene: &Scene, parameter: Parameter) -> Maker {
    let scene = scene.clone();
    Box::new(move |p| Ok(AssemblySetup::new(&scene.with(&parameter, p))?.assembly))
}

/// Tolerance of the integration along the rods: [`INTEGRATION_TOLERANCE_RATIO`] of that of the points, at least
/// [`FINEST`].
fn tolerance(scene: &Scene) -> f64 {
    along(scene.solve.tolerance)
}

/// Tolerance of the integration along the rods for points of this tolerance.
fn along(tolerance: f64) -> f64 {
    (INTEGRATION_TOLERANCE_RATIO * tolerance).max(FINEST)
}

impl<'a> Assembled<'a> {
    /// The assembly of a scene, and the unknowns of the equilibrium at the start of its branch.
    ///
    /// # Errors
    /// No equilibrium there.
    pub fn new(scene: &'a Scene, wanted: &Continue) -> Result<(Self, DVector<f64>)> {
        let first = AssemblySetup::new(&scene.with(&wanted.parameter, wanted.from))?;
        let start = first.start_equilibrium()?.now;
        let from_start = AssemblyFamily::new(
            assemblies_over(scene, wanted.parameter),
            &start,
            wanted.from,
            false,
            wanted.to - wanted.from,
            tolerance(scene),
        )?
        .with_logarithmic_charts();
        let x = from_start.unknowns(&start, wanted.from)?;
        let carriers = first.assembly.carriers().iter();
        let this = Self {
            scene,
            from_start,
            freedoms: carriers.map(|carrier| carrier.freedoms()).collect(),
            rods: first.assembly.links().len(),
            out_of_plane: first.assembly.out_of_plane(),
        };
        Ok((this, x))
    }

    /// The assembly with every parameter of the scene fixed, as a family of one member.
    fn fixed_family(
        &self,
        setup: &AssemblySetup,
    ) -> AssemblyFamily<impl Fn(f64) -> Result<Assembly>> {
        let assembly = setup.assembly.clone();
        let at = move |_| Ok(assembly.clone());
        self.from_start.over(at, false, 1.0, tolerance(self.scene))
    }
}

/// Position and quaternion of a pose.
fn placed(pose: &Isometry3<f64>) -> impl Iterator<Item = f64> {
    let r: [f64; 3] = pose.translation.vector.into();
    r.into_iter().chain(upward(&pose.rotation))
}

impl Subject for Assembled<'_> {
    fn family<'s>(&'s self, scenes: VariedScene<'s>, span: f64) -> Box<dyn Family + 's> {
        let along = along(scenes.tolerance);
        let changes_rods = scenes.changes_rods;
        let at = move |p: f64| Ok(AssemblySetup::new(&(scenes.at)(p)?)?.assembly);
        Box::new(self.from_start.over(at, changes_rods, span, along))
    }

    fn finest(&self) -> f64 {
        FINEST / INTEGRATION_TOLERANCE_RATIO
    }

    fn state(&self, scene: &Scene, x: &DVector<f64>, error: f64) -> Result<BranchState> {
        let setup = AssemblySetup::new(scene)?;
        self.from_start.warm(&setup.assembly);
        let state = self.fixed_family(&setup).state(x, 0.0)?;
        let k = &setup.scales;
        let mut numbers = Vec::new();
        // Nodes of joints come last, and are not told.
        let bodies = scene.assembly().map_or(0, |given| given.bodies.len());
        for place in &state.now.bodies[..bodies] {
            let mut pose = place.pose;
            pose.translation.vector *= k.length;
            numbers.extend(placed(&pose));
        }
        for wrench in setup.base_wrenches(&state.now)? {
            let (couple, force) = halves(&wrench);
            numbers.extend(force.iter().chain(couple.iter()));
        }
        for end in setup.free_ends(0.0, &state.now)? {
            numbers.extend(placed(&end));
        }
        numbers.push(state.energy * k.energy);
        let stations = stations::in_assembly(scene, &setup, &state.now)?;
        numbers.extend(stations::numbers(&stations));
        Ok(BranchState {
            numbers,
            left_over: error,
            left: false,
        })
    }

    fn mass(&self, scene: &Scene, x: &DVector<f64>) -> Option<MassEffect> {
        let setup = AssemblySetup::new(scene)
            .ok()
            .filter(|setup| !setup.is_heavy())?;
        let now = self.fixed_family(&setup).state(x, 0.0).ok()?.now;
        let resting = RodsAtRest::new(scene, setup.assembly, now, &setup.scales).ok()?;
        Some(resting.mass).filter(|mass| !mass.rods.is_empty())
    }

    /// Normal form of a fold, including the mass of bodies and rods; `None` if no rod has a known mass.
    fn fold(&self, scene: &Scene, wanted: &Continue, at: &Point) -> Result<Option<FoldAtRest>> {
        let setup = AssemblySetup::new(&scene.with(&wanted.parameter, at.p))?;
        let (assembly, k) = (&setup.assembly, &setup.scales);
        let rods = 0..assembly.links().len();
        let massive = rods.map(|i| scene.rod_of(i).massive(assembly.links()[i].rod(), k));
        let massive: Vec<Option<Massive>> = massive.collect::<Result<_>>()?;
        if massive.iter().all(Option::is_none) {
            return Ok(None);
        }
        let of = assemblies_over(scene, wanted.parameter);
        let span = wanted.to - wanted.from;
        let fold = self
            .from_start
            .over(of, false, span, FINEST)
            .fold(&at.x, at.p)?;
        let [mut mass, mut friction] = [fold.mass, 0.0];
        for (i, (link, massive)) in assembly.links().iter().zip(massive).enumerate() {
            let massive = match massive {
                Some(massive) => massive,
                None => Massive::new(link.rod(), None, SectionMass::NONE)?,
            };
            let moved = |motion: &CriticalMotion, far: f64, at: &[f64]| {
                let at: Vec<f64> = at.iter().map(|s| s * link.rod().length()).collect();
                assembly.sections(0.0, &motion.at(assembly, far), i, &at, FINEST)
            };
            let along = |far: f64, at: &[f64]| moved(&fold.along, far, at);
            let back = fold.against.as_ref();
            let against = |far: f64, at: &[f64]| moved(back.unwrap_or(&fold.along), far, at);
            let other = back.map(|y| Sweep::new(&against, y.scale)).transpose()?;
            let chord = if link.is_pinned() {
                let ends = along(0.0, &[0.0, 1.0])?;
                let chord = ends[1].position - ends[0].position;
                Some([ends[0].position, chord.normalize()])
            } else {
                None
            };
            let z = Sweep::new(&along, fold.along.scale)?;
            let found = resistance(&massive, &z, other.as_ref(), chord.as_ref())?;
            mass += found.mass;
            friction += found.proportional;
        }
        let form = [fold.drive, fold.bend].map(|x| x * k.energy);
        let resistances = [mass * k.energy * k.time * k.time, friction * k.energy];
        FoldAtRest::new(form, resistances, MassOrigin::Everything)
            .map(Some)
            .ok_or_else(|| Error::domain("friction would feed the motion out of it"))
    }

    fn zero_modes(&self, scene: &Scene, x: &DVector<f64>) -> Result<Vec<String>> {
        let setup = AssemblySetup::new(scene)?;
        let now = self.fixed_family(&setup).state(x, 0.0)?.now;
        zero_modes(&setup, &now)
    }

    fn columns(&self) -> (Vec<Column>, Column) {
        let units = self.scene.units;
        let mut columns = Vec::new();
        let given = self.scene.assembly().into_iter();
        let pose = |name: &str, of: &str| {
            let place = ["x", "y", "z"].map(|k| {
                let meaning = format!("position of {of} along {k}");
                Column::reals(format!("{name}{k}"), units.length(), meaning)
            });
            let turn = ["qw", "qx", "qy", "qz"].map(|k| {
                let meaning = format!("unit quaternion of {of}, qw >= 0");
                Column::reals(format!("{name}{k}"), "", meaning)
            });
            place.into_iter().chain(turn)
        };
        for body in given.clone().flat_map(|given| &given.bodies) {
            let name = &body.name;
            columns.extend(pose(&format!("{name}."), &format!("the frame of {name}")));
        }
        for rod in given.clone().flat_map(|given| &given.rods) {
            let name = &rod.name;
            let parts = [
                ("f", units.force(), "force"),
                ("m", units.couple(), "couple"),
            ];
            for (letter, unit, what) in parts {
                columns.extend(["x", "y", "z"].map(|k| {
                    let meaning = format!("{what} at the base of {name} along {k} of the world");
                    Column::reals(format!("{name}.base_{letter}{k}"), unit, meaning)
                }));
            }
        }
        for rod in given.flat_map(|given| &given.free) {
            let name = &rod.name;
            let of = format!("the free end of {name}");
            columns.extend(pose(&format!("{name}.end_"), &of));
        }
        let meaning = "stored energy and potential of gravity and constant forces";
        columns.push(Column::reals("energy", units.energy(), meaning));
        let placed = stations::placed(self.scene);
        columns.extend(stations::columns(&placed, units, false));
        let meaning = "estimated distance from the branch, in units of the rods";
        (columns, Column::reals("error", "", meaning))
    }

    fn index(&self) -> Column {
        Column::integers("index", INDEX)
    }

    fn shown(&self) -> usize {
        8
    }

    fn loads(&self, scene: &Scene) -> Result<LoadClass> {
        let assembly = AssemblySetup::new(scene)?.assembly;
        Ok(LoadClass::new(
            assembly.is_conservative(0.0),
            assembly.is_followed(0.0),
        ))
    }

    fn shapes(&self, scene: &Scene, x: &DVector<f64>) -> Result<Vec<Vec<RodSection>>> {
        let setup = AssemblySetup::new(scene)?;
        let now = self.fixed_family(&setup).state(x, 0.0)?.now;
        let length = setup.scales.length;
        let rods = setup
            .assembly
            .shapes(0.0, &now, SECTIONS, tolerance(self.scene))?;
        let measured = |section: RodSection| RodSection {
            s: section.s * length,
            position: section.position * length,
            ..section
        };
        let rods = rods.into_iter();
        Ok(rods
            .map(|sections| sections.into_iter().map(measured).collect())
            .collect())
    }

    fn guesses(&self) -> Vec<DVector<f64>> {
        guesses(&self.freedoms, self.rods, &self.out_of_plane)
    }

    fn search_description(&self, size: f64) -> String {
        format!(
            "turns and displacements of the bodies up to {size:.0} (in radians and mean lengths of the rods) and base wrenches of the \
             rods up to {:.0} (in B/L and B/L^2)",
            self.from_start.reach(size)
        )
    }

    fn out_of_reach(&self, wanted: &Continue) -> Option<String> {
        let (low, high) = wanted.range();
        [wanted.to, low, high].into_iter().find_map(|p| {
            let there = self.scene.with(&wanted.parameter, p);
            let setup = AssemblySetup::new(&there).ok()?;
            let why = there.in_own_units(setup.assembly.within_reach().err()?);
            Some(format!("{} = {p} is out of reach: {why}", wanted.name))
        })
    }

    fn start(&self) -> &'static str {
        "another `guess` of the bodies"
    }
}

/// Guesses in both directions: all bodies moved or turned along one axis, or all rods bent, twisted or pulled
/// along one. Each guess comes also with the sign of every second body or rod reversed. Coordinates out of the plane of
/// a planar assembly stay 0. The number of guesses does not depend on the size of the assembly.
pub(in crate::study) fn guesses(
    freedoms: &[usize],
    rods: usize,
    out_of_plane: &[usize],
) -> Vec<DVector<f64>> {
    let bodies: usize = freedoms.iter().sum();
    let size = bodies + 6 * rods;
    let mut guesses = Vec::new();
    let mut add = |of: &dyn Fn(usize) -> Option<(usize, usize)>, by: f64| {
        for component in 0..6 {
            for [way, other] in [[1.0, 1.0], [-1.0, -1.0], [1.0, -1.0], [-1.0, 1.0]] {
                let guess = DVector::from_fn(size, |i, _| match of(i) {
                    Some((number, k)) if k == component => {
                        by * if number % 2 == 0 { way } else { other }
                    }
                    _ => 0.0,
                });
                let in_plane = out_of_plane.iter().all(|i| guess[*i] == 0.0);
                if in_plane && guess.norm() > 0.0 && !guesses.contains(&guess) {
                    guesses.push(guess);
                }
            }
        }
    };
    let rod = |i: usize| Some((i.checked_sub(bodies)? / 6, (i - bodies) % 6));
    add(&rod, TYPICAL_WRENCH);
    let body = |i: usize| {
        let mut start = 0;
        freedoms.iter().enumerate().find_map(|(number, size)| {
            let k = i.checked_sub(start).filter(|k| k < size);
            start += size;
            Some((number, k?))
        })
    };
    add(&body, MOVED);
    guesses
}
