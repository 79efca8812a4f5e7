//! Several rods and bodies.

mod heavy_assembly;

use super::clamp::moving;
use super::first_order_mass::light;
use super::loads::{acting_on, point_mass};
use super::rod::rotation;
use crate::assembly::{
    Assembly, AssemblyEquilibrium, Attachment, BodyMotion, Configuration, FreeRod, HeavyBody,
    Joint, Link,
};
use crate::body::RigidBody;
use crate::error::{Error, Quantity, Result};
use crate::full_mass::assembly::HeavyAssembly;
use crate::math::se3::{halves, joined};
use crate::motion::assembly::AssemblyRun;
use crate::motion::{LightInSpace, Motion, RodCurve};
use crate::rod::{Distributed, RodSection, Wrench};
use crate::scene::{
    AssemblyBody, AssemblyRod, AssemblyScene, LoadAlong, Place as Shape, Scales, Scene, Site,
};
use nalgebra::{Isometry3, Matrix3, Rotation3, UnitQuaternion, Vector3, Vector6};
use std::f64::consts::PI;

/// The finest tolerance of equilibria.
const FINEST: f64 = 1e-13;
/// Tolerance of the rods of a guess, and of those that are drawn.
const FINE: f64 = 1e-10;
/// Unloaded rods that close a loop fit together up to so many radians or lengths.
const FITS: f64 = 1e-6;
/// What is left of a balance, relative to it, when all is turned together under loads that do not mind.
const TURNED: f64 = 1e-9;

/// An assembly made from a scene, in the units of its first rod and its first body, with the way back.
#[derive(Debug, Clone)]
pub struct AssemblySetup {
    /// Bodies and rods, in the order of the scene.
    pub assembly: Assembly,
    /// The way back to the scene's units.
    pub scales: Scales,
    /// True of a rod that begins at its `to` in the library, for its `from` is a ball joint; of all rods, those with a free end last.
    reversed: Vec<bool>,
    guess: Option<Vec<BodyMotion>>,
    /// (angular velocity, velocity) of the bodies at the start of a motion.
    twists: Vec<Vector6<f64>>,
    unloaded: bool,
    /// True of rods with all of their mass that nothing holds: they settle as they fall, where weight strains nothing.
    falls: bool,
    tolerance: f64,
    /// The same with the mass of the rods, where that counts in full.
    heavy: Option<HeavyAssembly>,
}

impl AssemblySetup {
    /// Scales everything.
    ///
    /// # Errors
    /// A scene of one rod; what [`Scene::parse`] cannot see from the numbers alone.
    pub fn new(scene: &Scene) -> Result<Self> {
        let given = scene.assembly.as_ref().ok_or_else(|| {
            Error::domain("this scene has one rod, [rod]; an assembly has [[rod]] and [[body]]")
        })?;
        let scales = scene.scales()?;
        let carriers = |gravity: [f64; 3]| {
            let bodies = given.bodies.iter().map(|body| {
                carrier(body, &scales, gravity)
                    .map(|carrier| carrier.named(body.name.clone()))
                    .map_err(|why| why.context(format!("the body {:?}", body.name)))
            });
            bodies.collect::<Result<Vec<HeavyBody>>>()
        };
        let gravity = scene.loads.gravity;
        let heavy = heavy_assembly::heavy(scene, given, &scales, &carriers(gravity)?)?;
        let falls = heavy.is_some() && given.floats();
        let unloaded = matches!(scene.start.place, Shape::Rest { .. });
        let (mut links, mut reversed) = (Vec::new(), Vec::new());
        let mut masses = Vec::new();
        for rod in &given.rods {
            let own = rod.rod.unclamped()?.measured(scales.measures());
            let named = |why: Error| why.context(format!("the rod {:?}", rod.name));
            let from = attachment(given, &rod.from, &scales).map_err(named)?;
            let to = attachment(given, &rod.to, &scales).map_err(named)?;
            let joints = (rod.from.joint, rod.to.joint);
            // A rod with a ball joint at its base alone begins at its other end.
            let turned = joints == (Joint::Ball, Joint::Weld);
            let link = match joints {
                (Joint::Ball, Joint::Ball) => Link::pinned(own, from, to),
                (Joint::Weld, joint) => Link::new(own, from, to, joint),
                _ => Link::reversed(&own, from, to, Joint::Ball).map_err(named)?,
            };
            let thickness = rod.rod.thickness().unwrap_or(0.0);
            let link = link.with_diameter(scales.inward(Quantity::Length, thickness));
            let borne = joints == (Joint::Ball, Joint::Ball) || unloaded || falls;
            let load = match heavy.is_some() && borne {
                // With mass it is borne in motion, and where the bodies settle.
                true => None,
                false => along(rod, gravity, &scales)?,
            };
            links.push(match load {
                None => link,
                Some(load) if turned => link.with_distributed(load.reversed()).map_err(named)?,
                Some(load) => link.with_distributed(load).map_err(named)?,
            });
            reversed.push(turned);
            masses.push(light(&rod.rod, &scales).map_err(named)?);
        }
        let free = given.free.iter().map(|rod| {
            let named = |why: Error| why.context(format!("the rod {:?}", rod.name));
            let weight = LoadAlong::default().with_weight(&rod.rod, gravity)?;
            if weight.is_some() && heavy.is_none() {
                return Err(named(Error::domain(
                    "a rod with a free end has no weight: leave out its mass (a material by E and nu, without a density), or put a small body at \
                     its end",
                )));
            }
            let own = rod.rod.unclamped()?.measured(scales.measures());
            let from = attachment(given, &rod.from, &scales).map_err(named)?;
            Ok(FreeRod::new(own, from))
        });
        let free = free.collect::<Result<Vec<FreeRod>>>()?;
        // Nothing is reversed in a rod that begins where it is held.
        reversed.extend(free.iter().map(|_| false));
        let guess = given.bodies.iter().map(|body| {
            let guess = body.guess.as_ref()?;
            let turn = match body.extent {
                Some(_) => rotation(&guess.orientation),
                None => UnitQuaternion::identity(),
            };
            Some(BodyMotion::at_rest(Isometry3::from_parts(
                vector(&scales, Quantity::Length, &guess.position).into(),
                turn,
            )))
        });
        let twists = given.bodies.iter().map(|body| {
            joined(
                &vector(&scales, Quantity::AngularVelocity, &body.angular_velocity),
                &vector(&scales, Quantity::Velocity, &body.velocity),
            )
        });
        Ok(Self {
            assembly: Assembly::new(carriers(if falls { [0.0; 3] } else { gravity })?, links)?
                .with_names(given.rods.iter().map(|rod| rod.name.clone()).collect())
                .with_free(free)?
                .with_light_rods(masses)?,
            scales,
            reversed,
            guess: guess.collect(),
            twists: twists.collect(),
            unloaded,
            falls,
            // Equilibria are solved a digit better than asked for.
            tolerance: (0.1 * scene.solve.tolerance).max(FINEST),
            heavy,
        })
    }

    /// The equilibrium under the loads: near the guess, or, without one or where none is found near it, from the unloaded rods;
    /// [`AssemblyEquilibrium::route`] tells which.
    ///
    /// # Errors
    /// As [`Assembly::equilibrium`].
    pub fn equilibrium(&self) -> Result<AssemblyEquilibrium> {
        match self.falls {
            false => self.found(),
            true => self.found().and_then(|found| self.put_back(found)).map_err(|why| {
                why.context(
                    "nothing holds the bodies on the ground, so that they are in equilibrium only where their loads balance each other (weight \
                     apart: what nothing holds falls)",
                )
            }),
        }
    }

    /// What nothing holds, carried as one to where the first body stands by its guess, or else in the origin; turned, too, unless the loads mind.
    fn put_back(&self, mut found: AssemblyEquilibrium) -> Result<AssemblyEquilibrium> {
        let origin = Isometry3::identity();
        let wanted = self.guess.as_ref().map_or(origin, |guess| guess[0].pose);
        let charts = &found.now.charts;
        let carried = |by: Isometry3<f64>| -> Result<(Vec<BodyMotion>, f64)> {
            let bodies = self.assembly.carriers().iter().zip(&found.now.bodies);
            let places = bodies.map(|(carrier, place)| {
                let mut pose = by * place.pose;
                if !carrier.turns() {
                    pose.rotation = UnitQuaternion::identity();
                }
                BodyMotion::at_rest(pose)
            });
            let places: Vec<BodyMotion> = places.collect();
            let points = self.assembly.points(0.0, &places, charts, self.tolerance)?;
            let forces = points.iter().flat_map(crate::assembly::LinkPoint::wrenches);
            let most = forces.fold(0.0, |most: f64, wrench| most.max(wrench.amax()));
            let left = self.assembly.balance(0.0, &places, &points).amax();
            Ok((places, left / (1.0 + most)))
        };
        let there = found.now.bodies[0].pose;
        let (turned, left) = carried(wanted * there.inverse())?;
        found.now.bodies = match left <= TURNED {
            true => turned,
            false => {
                let shift = wanted.translation.vector - there.translation.vector;
                carried(Isometry3::from_parts(
                    shift.into(),
                    UnitQuaternion::identity(),
                ))?
                .0
            }
        };
        Ok(found)
    }

    fn found(&self) -> Result<AssemblyEquilibrium> {
        let Some(bodies) = &self.guess else {
            return self.assembly.equilibrium(None, self.tolerance);
        };
        // Before the rods are looked for one by one, in vain.
        self.assembly.within_reach()?;
        let guess = self.assembly.held(bodies.clone(), FINE);
        let near = self.assembly.equilibrium(Some(&guess), self.tolerance);
        near.or_else(|why| {
            let unloaded = self.assembly.equilibrium(None, self.tolerance);
            unloaded.map_err(|_| why)
        })
    }

    /// The name of the first rod that is too short for the guess.
    ///
    /// # Errors
    /// Those of the rods.
    pub fn overdrawn(&self) -> Result<Option<&str>> {
        let Some(bodies) = &self.guess else {
            return Ok(None);
        };
        let rod = self.assembly.overdrawn(bodies)?;
        Ok(rod.and_then(|rod| self.assembly.name_of_rod(rod)))
    }

    /// The equilibrium that a motion begins at, or that small motions are about: near the guess, if there is one.
    ///
    /// # Errors
    /// As [`AssemblySetup::equilibrium`]; none near the guess.
    pub fn meant(&self) -> Result<AssemblyEquilibrium> {
        let found = self.equilibrium()?;
        match self.guess.is_some() && !found.route.is_near_guess() {
            false => Ok(found),
            true => Err(Error::no_convergence(
                "no equilibrium is found near the guess of the bodies, and a motion should not be about another one: give a nearer \
                 guess, or leave it out for that which the unloaded rods lead to (snaprod equilibrium)",
            )),
        }
    }

    /// Where a motion starts, and the index of the equilibrium there if it was found as one.
    ///
    /// # Errors
    /// As [`AssemblySetup::equilibrium`].
    pub fn start(&self) -> Result<(Configuration, Option<usize>)> {
        let (mut now, index) = match self.unloaded {
            true => {
                let origin = vec![BodyMotion::at_rest(Isometry3::identity()); self.twists.len()];
                let bodies = self.guess.as_ref().unwrap_or(&origin);
                let start = self.assembly.let_go(bodies, FINEST)?;
                self.fits(&start)?;
                (start, None)
            }
            false => {
                let found = self.meant()?;
                let decides = self.assembly.is_conservative(0.0);
                (found.now, Some(found.index).filter(|_| decides))
            }
        };
        for (place, twist) in now.bodies.iter_mut().zip(&self.twists) {
            place.twist = *twist;
        }
        Ok((now, index))
    }

    /// An error unless unloaded rods are at rest, and meet their attachments where they close loops.
    fn fits(&self, start: &Configuration) -> Result<()> {
        let points = self
            .assembly
            .points(0.0, &start.bodies, &start.charts, FINEST)?;
        for (k, (link, point)) in self.assembly.links().iter().zip(&points).enumerate() {
            let rod = self.assembly.rod_name(k);
            if link.distributed().is_some() {
                return Err(Error::domain(format!(
                    "rest = \"straight\" in [start]: {rod} is elastic and does not rest straight under its weight, or another load along it; leave \
                     rest out, and the bodies start at equilibrium; or give the rods inertia = \"full\", or leave out the load or the mass"
                )));
            }
            let gap = point.gap(link.joint()).amax();
            if !(gap <= FITS) {
                return Err(Error::domain(format!(
                    "rest = \"straight\" in [start]: the unloaded rods do not fit together, an end of {rod} is {gap:.1e} (radians or lengths) away \
                     from its attachment; leave rest out, and the bodies start at equilibrium"
                )));
            }
        }
        Ok(())
    }

    /// The motion from there, and that index.
    ///
    /// # Errors
    /// A scene of statics; a start from which it cannot go.
    pub fn motion(&self, scene: &Scene) -> Result<(Box<dyn Motion<'static>>, Option<usize>)> {
        let options = super::options(scene.run()?, &self.scales)?;
        let (start, index) = self.start()?;
        if let Some(heavy) = &self.heavy {
            let run = self.heavy_motion(heavy, &start, scene, options)?;
            return Ok((Box::new(run), None));
        }
        let run = AssemblyRun::new(self.assembly.clone(), &start, options)?;
        Ok((Box::new(run), index))
    }

    /// The same with the mass of the rods, where that counts in full.
    pub fn heavy(&self) -> Option<&HeavyAssembly> {
        self.heavy.as_ref()
    }

    /// True if the mass of the rods counts in full.
    pub fn is_heavy(&self) -> bool {
        self.heavy.is_some()
    }

    /// The light rods beside those with all of their mass, which bear nothing along them; none beside a rod that bears more than its weight, nor beside
    /// one with Maxwell branches.
    pub fn light_rods(&self, scene: &Scene) -> Vec<LightInSpace> {
        let given = scene.assembly.iter().flat_map(|given| &given.rods);
        let links = self.assembly.links().iter().zip(&self.reversed);
        let all = given.zip(links).enumerate();
        all.filter(|(_, (given, _))| self.is_heavy() && given.distributed.is_zero())
            .filter(|(_, (given, _))| given.rod.relaxation.is_empty())
            .map(|(k, (_, (link, reversed)))| LightInSpace::in_assembly(k, link, *reversed))
            .collect()
    }

    /// The wrench (couple, force) at the base of every rod, `from`, in the world and the scene's units.
    ///
    /// # Errors
    /// As [`Assembly::points`].
    pub fn base_wrenches(&self, now: &Configuration) -> Result<Vec<Vector6<f64>>> {
        let points = self
            .assembly
            .points(0.0, &now.bodies, &now.charts, self.tolerance)?;
        let k = &self.scales;
        let each = points.iter().zip(&self.reversed);
        let each = each.map(|(point, reversed)| {
            let [base, tip] = point.wrenches();
            let mut wrench = if *reversed { tip } else { base };
            wrench.fixed_rows_mut::<3>(0).scale_mut(k.energy);
            wrench.fixed_rows_mut::<3>(3).scale_mut(k.force);
            wrench
        });
        Ok(each.collect())
    }

    /// The wrench (couple, force) at the base of rod `rod`, its `from`, under the chart point `q` of the library, whose base is turned so: along the
    /// directors at `from`, in the scene's units.
    ///
    /// # Errors
    /// As [`Link::end`].
    pub fn base_wrench(
        &self,
        rod: usize,
        q: &Wrench,
        base: &UnitQuaternion<f64>,
    ) -> Result<Vector6<f64>> {
        self.wrench_of(rod, &self.assembly.links()[rod].with_base_rotation(base), q)
    }

    /// The same of the light rod beside rod `rod` ([`AssemblySetup::light_rods`]).
    ///
    /// # Errors
    /// As there.
    pub fn light_wrench(&self, rod: usize, q: &Wrench) -> Result<Vector6<f64>> {
        self.wrench_of(rod, &self.assembly.links()[rod].alone(), q)
    }

    fn wrench_of(&self, rod: usize, link: &Link, q: &Wrench) -> Result<Vector6<f64>> {
        let end = link.end(q, FINE)?;
        let (m, n) = match self.reversed[rod] {
            false => halves(&q.component_mul(&link.units())),
            true => {
                let half = UnitQuaternion::from_axis_angle(&Vector3::x_axis(), PI);
                let back = (end.pose.rotation * half).inverse();
                (back * -end.couple, back * -end.tip_force())
            }
        };
        Ok(joined(&(m * self.scales.energy), &(n * self.scales.force)))
    }

    /// The poses of the free ends of the rods that have one, in the world and the scene's units.
    ///
    /// # Errors
    /// As [`FreeRod::shape`].
    pub fn free_ends(&self, t: f64, now: &Configuration) -> Result<Vec<Isometry3<f64>>> {
        let end = |rod: &FreeRod| -> Result<Isometry3<f64>> {
            let sections = rod.shape(t, &now.bodies, 1, FINE)?;
            // Two sections: at the base and at the end.
            let mut end = sections[1].pose();
            end.translation.vector *= self.scales.length;
            Ok(end)
        };
        self.assembly.free().iter().map(end).collect()
    }

    /// An arclength of the rod of this number, counted from its `from` in the scene's units.
    pub fn arclength(&self, rod: usize, s: f64) -> f64 {
        let whole = self.assembly.links()[rod].rod().length();
        // With all of its mass a rod begins at its `from` as it is.
        let reversed = self.reversed[rod] && self.heavy.is_none();
        let s = if reversed { whole - s } else { s };
        s * self.scales.length
    }

    /// Every rod at time `t` from `from` to `to`, those with a free end last: sections at `count` + 1 arclengths, each by arclength and pose in the world and the scene's
    /// units.
    ///
    /// # Errors
    /// As [`Assembly::shapes`].
    pub fn shapes(&self, t: f64, now: &Configuration, count: usize) -> Result<Vec<RodCurve>> {
        let length = self.scales.length;
        let shapes = self.assembly.shapes(t, now, count, FINE)?;
        let scaled = shapes
            .iter()
            .zip(&self.reversed)
            .map(|(sections, reversed)| {
                let whole = sections.last().map_or(0.0, |section| section.s);
                let placed = sections.iter().map(|section| {
                    let (s, turn) = oriented(section, whole, *reversed);
                    let position = section.position * length;
                    (s * length, Isometry3::from_parts(position.into(), turn))
                });
                let mut placed: Vec<_> = placed.collect();
                if *reversed {
                    placed.reverse();
                }
                placed
            });
        Ok(scaled.collect())
    }
}

/// Arclength from `from`, and the directors: those of a reversed rod are turned by pi about d1.
fn oriented(section: &RodSection, whole: f64, reversed: bool) -> (f64, UnitQuaternion<f64>) {
    let mut directors = section.directors;
    if reversed {
        directors.column_mut(1).neg_mut();
        directors.column_mut(2).neg_mut();
    }
    let turn = UnitQuaternion::from_rotation_matrix(&Rotation3::from_matrix_unchecked(directors));
    let s = if reversed {
        whole - section.s
    } else {
        section.s
    };
    (s, turn)
}

/// The dead load along a rod, its weight included, in the units of the library.
fn along(rod: &AssemblyRod, gravity: [f64; 3], scales: &Scales) -> Result<Option<Distributed>> {
    let load = rod.distributed.with_weight(&rod.rod, gravity)?;
    let unit = scales.inward(Quantity::Distributed, 1.0);
    Ok(load.map(|load| load.mapped(|f| f * unit)))
}

fn vector(scales: &Scales, of: Quantity, x: &[f64; 3]) -> Vector3<f64> {
    Vector3::from(x.map(|x| scales.inward(of, x)))
}

fn attachment(given: &AssemblyScene, site: &Site, scales: &Scales) -> Result<Attachment> {
    let place = Isometry3::from_parts(
        vector(scales, Quantity::Length, &site.position).into(),
        rotation(&site.orientation),
    );
    Ok(match (given.holder(site), &site.motion) {
        (Some(body), _) => Attachment::body(body, place),
        (None, None) => Attachment::ground(place),
        (None, Some(motion)) => {
            Attachment::support(moving(&place, &scales.motion(motion.clone()))?)
        }
    })
}

fn carrier(body: &AssemblyBody, scales: &Scales, gravity: [f64; 3]) -> Result<HeavyBody> {
    let free = free_carrier(body, scales, gravity)?;
    Ok(match &body.groove {
        Some(groove) => free.in_groove(groove.curve(scales.length)?),
        None => free,
    })
}

fn free_carrier(body: &AssemblyBody, scales: &Scales, gravity: [f64; 3]) -> Result<HeavyBody> {
    let mass = body.mass / scales.mass;
    let loads = scales.loads(body.loads(gravity));
    let Some(extent) = &body.extent else {
        return point_mass(mass, &loads, Vector3::from, None).map(HeavyBody::point);
    };
    let inertia = Matrix3::from_fn(|i, j| scales.inward(Quantity::Inertia, extent.inertia[i][j]));
    let rigid = RigidBody::new(mass, inertia)?
        .with_centre(vector(scales, Quantity::Length, &extent.offset))?
        .with_rotor(vector(scales, Quantity::RotationalDrag, &extent.rotor))?;
    acting_on(rigid, &loads, Vector3::from).map(HeavyBody::rigid)
}
