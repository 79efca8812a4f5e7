//! Conversion of a scene of several rods and bodies to an assembly.

mod heavy_assembly;

use super::clamp::moving_support;
use super::equilibrium_tolerance;
use super::first_order_mass::first_order_rod;
use super::in_space::turning_in_units;
use super::loads::{acting_on, point_mass};
use super::obstacles::{HittingBody, Obstacles, of_heavy_rods};
use super::rod::rotation;
use crate::assembly::{
    Assembly, AssemblyEquilibrium, Attachment, Body, BodyMotion, Configuration, FreeRod, Guide,
    Joint, JointLaw, Link,
};
use crate::body::RigidBody;
use crate::error::{Error, Quantity, Result};
use crate::full_mass::assembly::HeavyAssembly;
use crate::full_mass::elements;
use crate::math::se3::{halves, join};
use crate::motion::assembly::AssemblyRun;
use crate::motion::{LightInSpace, Motion, RodCurve};
use crate::rod::{DistributedLoad, LoadsWithoutPotential, RodSection, Wrench};
use crate::scene::read::normal_director;
use crate::scene::{
    AssemblyBody, AssemblyRod, AssemblyScene, InitialShape as Shape, LoadAlong, Parameter, Scales,
    Scene, SceneKind, Site, SiteJoint, TurnAxis,
};
use nalgebra::{Isometry3, Matrix3, Rotation3, UnitQuaternion, UnitVector3, Vector3, Vector6};
use std::f64::consts::PI;

/// Lower bound on the tolerance of equilibria.
const LEAST_TOLERANCE: f64 = 1e-13;
/// Tolerance of rods for the initial guess, and of drawn rods.
const GUESS_TOLERANCE: f64 = 1e-10;
/// Gap, in radians or lengths, up to which unloaded rods in a loop count as fitting.
const LOOP_GAP: f64 = 1e-6;
/// Relative residual of the balance up to which the loads count as invariant under a rotation of the whole assembly.
const ROTATED_RESIDUAL: f64 = 1e-9;

/// A joint with axes at an end of a rod.
#[derive(Debug, Clone)]
pub struct PlacedJoint {
    /// Name: that of the rod, and "from" or "to".
    pub name: String,
    /// Number of the rod, those with a free end last.
    pub rod: usize,
    /// Place on the rod, from `from`: 0 or 1.
    pub place: f64,
    /// The joint, in the library's units.
    pub guide: Guide,
}

/// An assembly made from a scene, in units of its first rod and its first body, with the conversion to the scene's
/// units.
#[derive(Debug, Clone)]
pub struct AssemblySetup {
    /// Bodies and rods, in the order of the scene.
    pub assembly: Assembly,
    /// Conversion to the scene's units.
    pub scales: Scales,
    /// True for a rod that begins at its `to` in the library, because its `from` is a ball joint. All rods, those with
    /// a free end last.
    reversed: Vec<bool>,
    guess: Option<Vec<BodyMotion>>,
    /// Twists (angular velocity, velocity) of the bodies at the start of a motion.
    twists: Vec<Vector6<f64>>,
    unloaded: bool,
    /// True for heavy rods that nothing holds. They settle in free fall, where weight causes no strain.
    falls: bool,
    tolerance: f64,
    /// The assembly with the full mass of its rods; `None` if no mass counts in full.
    heavy: Option<HeavyAssembly>,
    /// Obstacles, and bodies that hit obstacles and each other.
    obstacles: Option<Obstacles>,
    /// Bodies without rods, if there are some.
    flying: Option<Flying>,
}

/// Bodies without rods, which come after the bodies of rods.
#[derive(Debug, Clone)]
struct Flying {
    /// The assembly without these bodies, which says the start of the others; `None` if it has no rod.
    held: Option<Box<AssemblySetup>>,
    /// Poses of the bodies at the start.
    places: Vec<BodyMotion>,
}

impl AssemblySetup {
    /// Converts a scene to the library's units.
    ///
    /// # Errors
    /// A scene of one rod; faults that [`Scene::parse`] cannot see from the numbers alone.
    pub fn new(scene: &Scene) -> Result<Self> {
        let given = scene.assembly().ok_or_else(|| {
            Error::domain("this scene has one rod, [rod]; an assembly has [[rod]] and [[body]]")
        })?;
        let scales = scene.scales()?;
        let normal = given
            .plane
            .map(|n| UnitVector3::new_normalize(Vector3::from(n)));
        let mut ground = given.rods.iter().flat_map(|rod| [&rod.from, &rod.to]);
        let level = ground.find(|site| site.body.is_none());
        let level = level.map_or(Vector3::zeros(), |site| {
            vector(&scales, Quantity::Length, &site.position)
        });
        let carriers = |gravity: [f64; 3]| {
            let bodies = given.bodies.iter().map(|body| {
                carrier(body, &scales, gravity)
                    .map(|carrier| match normal {
                        Some(n) => {
                            let turns = carrier.turns();
                            carrier.guided(Guide::plane(n, n.into_inner() * n.dot(&level), turns))
                        }
                        None => carrier,
                    })
                    .map(|carrier| carrier.named(body.name.clone()))
                    .map_err(|why| why.context(format!("the body {:?}", body.name)))
            });
            bodies.collect::<Result<Vec<Body>>>()
        };
        let gravity = scene.loads.gravity;
        let pull = gravity.map(|g| scales.inward(Quantity::Acceleration, g));
        let heavy = heavy_assembly::heavy(scene, given, &scales, &carriers(pull)?)?;
        let heavy = match (heavy, of_heavy_rods(scene, &Isometry3::identity())?) {
            (Some(heavy), Some(obstacles)) => Some(heavy.among(obstacles)),
            (heavy, _) => heavy,
        };
        let falls = heavy.is_some() && given.floats();
        let unloaded = matches!(scene.start.place, Shape::Rest { .. });
        let (mut links, mut reversed) = (Vec::new(), Vec::new());
        let mut masses = Vec::new();
        let mut nodes: Vec<Body> = Vec::new();
        for rod in &given.rods {
            let named = |why: Error| why.context(format!("the rod {:?}", rod.name));
            let bent_about = given.plane.and_then(|n| normal_director(&rod.from, n));
            let own = match bent_about {
                Some((k, _)) => rod.rod.in_plane(k).map_err(named)?,
                None => rod.rod.unclamped()?,
            };
            let own = own.measured(scales.measures());
            let own = own.with_mass_along(rod.rod.mass_along());
            let in_time = rod.rod.law_in_time(scales.measures()).map_err(named)?;
            // At rest the base of a rod between two ball joints is welded to a node that turns freely. The rod then
            // bears loads along it, and stands between places on the ground.
            let sites = [&rod.from, &rod.to];
            let loaded = sites.iter().all(|site| site.body.is_none())
                || load_along(rod, gravity, &scales)?.is_some()
                || turning_loads(scene, rod, &scales)?.is_some();
            let turned_base = scene.run.is_none()
                && sites.iter().all(|site| site.joint == SiteJoint::Ball)
                && (loaded || given.plane.is_some());
            let mut placed = |site: &Site, end: &str| -> Result<Attachment> {
                let on = attachment(given, site, &scales).map_err(named)?;
                let guide = match (turned_base && end == "base", normal) {
                    (true, Some(normal)) => {
                        let axis = rotation(&site.orientation).inverse() * normal;
                        Some(Guide::new(
                            on.clone(),
                            vec![axis],
                            Vec::new(),
                            vec![JointLaw::default()],
                        )?)
                    }
                    (true, None) => Some(Guide::ball(on.clone())),
                    (false, _) => guide(&site.joint, on.clone(), &scales).map_err(named)?,
                };
                let Some(guide) = guide else {
                    return Ok(on);
                };
                let name = format!(
                    "the {} at the {end} of rod {:?}",
                    site.joint.word(),
                    rod.name
                );
                nodes.push(Body::node(Some(guide))?.named(name));
                let number = given.bodies.len() + nodes.len() - 1;
                Ok(Attachment::body(number, Isometry3::identity()))
            };
            let (from, to) = (placed(&rod.from, "base")?, placed(&rod.to, "end")?);
            let base = if turned_base {
                Joint::Weld
            } else {
                rod.from.joint.of_rod()
            };
            let joints = (base, rod.to.joint.of_rod());
            // A rod with a ball joint only at its base is reversed in the library.
            let turned = joints == (Joint::Ball, Joint::Weld);
            let link = match joints {
                (Joint::Ball, Joint::Ball) => Link::pinned(own, from, to),
                (Joint::Weld, joint) => Link::new(own, from, to, joint),
                _ => Link::reversed(&own, from, to, Joint::Ball).map_err(named)?,
            };
            let thickness = rod.rod.thickness().unwrap_or(0.0);
            let link = match in_time {
                Some(law) if turned => link.with_law_in_time(law.reversed()),
                Some(law) => link.with_law_in_time(law),
                None => link,
            };
            let link = link.bent_about(bent_about.map(|(k, _)| k));
            let link = link.with_diameter(scales.inward(Quantity::Length, thickness));
            let borne = joints == (Joint::Ball, Joint::Ball) || unloaded || falls;
            let load = if heavy.is_some() && borne {
                None
            } else {
                load_along(rod, gravity, &scales)?
            };
            let link = match load {
                None => link,
                Some(load) if turned => link.with_distributed(load.reversed()).map_err(named)?,
                Some(load) => link.with_distributed(load).map_err(named)?,
            };
            links.push(match turning_loads(scene, rod, &scales)? {
                None => link,
                Some(loads) if turned => link.with_turning(&from_end(&loads)).map_err(named)?,
                Some(loads) => link.with_turning(&loads).map_err(named)?,
            });
            reversed.push(turned);
            masses.push(first_order_rod(&rod.rod, &scales).map_err(named)?);
        }
        let free = given.free.iter().map(|rod| {
            let named = |why: Error| why.context(format!("the rod {:?}", rod.name));
            let weight = LoadAlong::default().with_weight(&rod.rod, gravity)?;
            if weight.is_some() && heavy.is_none() {
                return Err(named(Error::domain(
                    "a rod with a free end has no weight: leave out its mass (a material by E and nu, without a density), or put a small body at \
                     its end (at rest a [[body]] with a name alone is enough)",
                )));
            }
            let own = rod.rod.unclamped()?.measured(scales.measures());
            let from = attachment(given, &rod.from, &scales).map_err(named)?;
            Ok(FreeRod::new(own, from))
        });
        let free = free.collect::<Result<Vec<FreeRod>>>()?;
        // A rod with a free end begins at its held end and is never reversed.
        reversed.extend(free.iter().map(|_| false));
        let bodies = given.bodies.iter().map(|body| scales.body(body));
        let bodies: Vec<AssemblyBody> = bodies.collect();
        let guess = bodies.iter().map(|body| {
            let guess = body.guess.as_ref()?;
            let turn = match body.extent {
                Some(_) => rotation(&guess.orientation),
                None => UnitQuaternion::identity(),
            };
            Some(BodyMotion::at_rest(Isometry3::from_parts(
                Vector3::from(guess.position).into(),
                turn,
            )))
        });
        let mut guess: Option<Vec<BodyMotion>> = guess.collect();
        guess = guess.filter(|guess| !guess.is_empty());
        if let Some(guess) = &mut guess {
            for joint in nodes.iter().filter_map(Body::joint) {
                guess.push(BodyMotion::at_rest(joint.unturned(guess)));
            }
        }
        let twists = bodies
            .iter()
            .map(|body| join(&body.angular_velocity.into(), &body.velocity.into()));
        let mut carried = carriers(if falls { [0.0; 3] } else { pull })?;
        carried.extend(nodes);
        let light = match &heavy {
            Some(_) => Assembly::of_heavy_rods(carried, links)?,
            None => {
                let free = given.bodies.iter().filter(|body| body.place.is_some());
                Assembly::with_free_bodies(carried, links, free.count())?
            }
        };
        let placed = bodies.iter().filter_map(|body| {
            let place = body.place.as_ref()?;
            let turn = match body.extent {
                Some(_) => rotation(&place.orientation),
                None => UnitQuaternion::identity(),
            };
            let position = Vector3::from(place.position);
            Some(BodyMotion::at_rest(Isometry3::from_parts(
                position.into(),
                turn,
            )))
        });
        let places: Vec<BodyMotion> = placed.collect();
        let flying = if places.is_empty() {
            None
        } else {
            let held = if given.rods.is_empty() {
                None
            } else {
                let mut scene = scene.clone();
                scene.kind = SceneKind::Assembly(given.without_free_bodies());
                scene.obstacles.clear();
                Some(Box::new(Self::new(&scene)?))
            };
            Some(Flying { held, places })
        };
        let hitting = light.solids().iter().zip(&given.bodies);
        let hitting = hitting.map(|(carrier, body)| HittingBody {
            mass: carrier.mass().clone(),
            shape: body.shape,
            name: format!("body {:?}", body.name),
        });
        let obstacles = if scene.is_motion() && scene.has_contact() && heavy.is_none() {
            Some(Obstacles::new(scene, hitting)?)
        } else {
            None
        };
        Ok(Self {
            obstacles,
            flying,
            assembly: light
                .with_names(given.rods.iter().map(|rod| rod.name.clone()).collect())
                .with_free(free)?
                .with_light_rods(masses)?,
            scales,
            reversed,
            guess,
            twists: twists.collect(),
            unloaded,
            falls,
            tolerance: equilibrium_tolerance(scene).max(LEAST_TOLERANCE),
            heavy,
        })
    }

    /// The equilibrium under the loads: near the guess; or, without a guess or without success near it, from the
    /// unloaded rods. [`AssemblyEquilibrium::route`] tells which.
    ///
    /// # Errors
    /// As [`Assembly::equilibrium`].
    pub fn equilibrium(&self) -> Result<AssemblyEquilibrium> {
        if !self.falls {
            self.search_equilibrium()
        } else {
            self.search_equilibrium().and_then(|found| self.move_to_guess(found)).map_err(|why| {
            why.context(
                "nothing holds the bodies on the ground, so that they are in equilibrium only where their loads balance each other (weight \
                 apart: what nothing holds falls)",
            )
        })
        }
    }

    /// Tolerance of equilibria.
    pub fn equilibrium_tolerance(&self) -> f64 {
        self.tolerance
    }

    /// Moves a floating assembly rigidly so that its first body has the pose of its guess, or lies at the origin. The
    /// rotation is left out if it disturbs the balance of the loads.
    fn move_to_guess(&self, mut found: AssemblyEquilibrium) -> Result<AssemblyEquilibrium> {
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
        found.now.bodies = if left <= ROTATED_RESIDUAL {
            turned
        } else {
            let shift = wanted.translation.vector - there.translation.vector;
            carried(Isometry3::from_parts(
                shift.into(),
                UnitQuaternion::identity(),
            ))?
            .0
        };
        Ok(found)
    }

    fn search_equilibrium(&self) -> Result<AssemblyEquilibrium> {
        let Some(bodies) = &self.guess else {
            return elements::equilibrium(&self.assembly, self.tolerance);
        };
        // Out of reach is a cheap test, before a vain search rod by rod.
        self.assembly.within_reach()?;
        let guess = self.assembly.held(bodies.clone(), GUESS_TOLERANCE);
        let near = self.assembly.equilibrium(Some(&guess), self.tolerance);
        near.or_else(|why| {
            let unloaded = elements::equilibrium(&self.assembly, self.tolerance);
            unloaded.map_err(|_| why)
        })
    }

    /// Name of the first rod that is too short for the guess.
    ///
    /// # Errors
    /// Errors of the rods.
    pub fn too_short_rod(&self) -> Result<Option<&str>> {
        let Some(bodies) = &self.guess else {
            return Ok(None);
        };
        let rod = self.assembly.overdrawn(bodies)?;
        Ok(rod.and_then(|rod| self.assembly.name_of_rod(rod)))
    }

    /// The equilibrium at which a motion begins, or about which small motions are computed. It must lie near the guess,
    /// if there is a guess.
    ///
    /// # Errors
    /// As [`AssemblySetup::equilibrium`]; no equilibrium near the guess.
    pub fn start_equilibrium(&self) -> Result<AssemblyEquilibrium> {
        let found = self.equilibrium()?;
        if self.guess.is_none() || found.route.is_near_guess() {
            Ok(found)
        } else {
            Err(Error::no_convergence(
                "no equilibrium is found near the guess of the bodies, and a motion should not be about another one: give a nearer \
             guess, or leave it out for that which the unloaded rods lead to (snaprod equilibrium)",
            ))
        }
    }

    /// Configuration at the start of a motion, and its Morse index if it is an equilibrium under conservative loads.
    ///
    /// # Errors
    /// As [`AssemblySetup::equilibrium`].
    pub fn start(&self) -> Result<(Configuration, Option<usize>)> {
        let (mut now, index) = if let Some(flying) = &self.flying {
            let (mut now, index) = match &flying.held {
                Some(held) => held.start()?,
                None => (Configuration::default(), None),
            };
            let next = self.assembly.solids().len() - flying.places.len();
            now.bodies.splice(next..next, flying.places.iter().copied());
            (now, index)
        } else if self.unloaded {
            let origin = vec![BodyMotion::at_rest(Isometry3::identity()); self.twists.len()];
            let bodies = self.guess.as_ref().unwrap_or(&origin);
            let start = self.assembly.let_go(bodies, LEAST_TOLERANCE)?;
            self.check_loops_close(&start)?;
            (start, None)
        } else {
            let found = self.start_equilibrium()?;
            let decides = self.assembly.is_conservative(0.0);
            (found.now, Some(found.index).filter(|_| decides))
        };
        for (place, twist) in now.bodies.iter_mut().zip(&self.twists) {
            place.twist = *twist;
        }
        Ok((now, index))
    }

    /// Refuses rods that bear loads along the rod, and gaps between rod ends and attachments in loops.
    fn check_loops_close(&self, start: &Configuration) -> Result<()> {
        let points = self
            .assembly
            .points(0.0, &start.bodies, &start.charts, LEAST_TOLERANCE)?;
        for (k, (link, point)) in self.assembly.links().iter().zip(&points).enumerate() {
            let rod = self.assembly.rod_name(k);
            if link.is_loaded() {
                return Err(Error::domain(format!(
                    "rest = \"straight\" in [start]: {rod} is elastic and does not rest straight under its weight, or another load along it; leave \
                     rest out, and the bodies start at equilibrium; or give the rods inertia = \"full\", or leave out the load or the mass"
                )));
            }
            let gap = point.gap().amax();
            if !(gap <= LOOP_GAP) {
                return Err(Error::domain(format!(
                    "rest = \"straight\" in [start]: the unloaded rods do not fit together, an end of {rod} is {gap:.1e} (radians or lengths) away \
                     from its attachment; leave rest out, and the bodies start at equilibrium"
                )));
            }
        }
        Ok(())
    }

    /// The motion from [`AssemblySetup::start`], and the Morse index found there.
    ///
    /// # Errors
    /// A scene of statics; a start from which no motion is possible.
    pub fn motion<'a>(
        &'a self,
        scene: &Scene,
    ) -> Result<(Box<dyn Motion<'a> + 'a>, Option<usize>)> {
        let options = super::options(scene.run()?, &self.scales)?;
        let (start, index) = self.start()?;
        if let Some(heavy) = &self.heavy {
            let run = self.heavy_motion(heavy, &start, scene, options)?;
            return Ok((run, None));
        }
        let mut run = AssemblyRun::new(self.assembly.clone(), &start, options)?;
        if let Some(obstacles) = &self.obstacles {
            run = run.among_obstacles(obstacles.among())?;
        }
        Ok((Box::new(run), index))
    }

    /// Joints with axes, those of rods with a free end last.
    ///
    /// # Errors
    /// As [`Guide::new`].
    pub fn joints(&self, scene: &Scene) -> Result<Vec<PlacedJoint>> {
        let given = scene.assembly().into_iter();
        let mut found = Vec::new();
        for given in given {
            let held = given.rods.iter();
            let held = held.map(|rod| (&rod.name, vec![(0.0, &rod.from), (1.0, &rod.to)]));
            let free = given.free.iter();
            let free = free.map(|rod| (&rod.name, vec![(0.0, &rod.from)]));
            for (rod, (name, sites)) in held.chain(free).enumerate() {
                for (place, site) in sites {
                    let on = attachment(given, site, &self.scales)?;
                    if let Some(guide) = guide(&site.joint, on, &self.scales)? {
                        let end = if place == 0.0 { "from" } else { "to" };
                        let name = format!("{name}.{end}");
                        found.push(PlacedJoint {
                            name,
                            rod,
                            place,
                            guide,
                        });
                    }
                }
            }
        }
        Ok(found)
    }

    /// The assembly with the full mass of its rods; `None` if no mass counts in full.
    pub fn heavy(&self) -> Option<&HeavyAssembly> {
        self.heavy.as_ref()
    }

    /// True if the mass of the rods counts in full.
    pub fn is_heavy(&self) -> bool {
        self.heavy.is_some()
    }

    /// Light rods for comparison with the heavy ones, without load along them. Heavy rods with a distributed load
    /// besides their weight, or with Maxwell branches, have none.
    pub fn light_rods(&self, scene: &Scene) -> Vec<LightInSpace> {
        let given = scene.assembly().into_iter().flat_map(|given| &given.rods);
        let links = self.assembly.links().iter().zip(&self.reversed);
        let all = given.zip(links).enumerate();
        all.filter(|(_, (given, _))| {
            self.is_heavy() && given.distributed.is_zero() && given.rod.loads.is_empty()
        })
        .filter(|(k, (given, _))| given.rod.relaxation.is_empty() && !self.assembly.is_jointed(*k))
        .filter(|(_, (given, _))| given.rod.field_in_time().is_none())
        .map(|(k, (_, (link, reversed)))| LightInSpace::in_assembly(k, link, *reversed))
        .collect()
    }

    /// Wrench (couple, force) at the base, `from`, of every rod, in the world and the scene's units.
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

    /// Wrench (couple, force) at the base, `from`, of rod `rod` in the scene's units, along the directors there. `q` is
    /// the library's chart point, `base` the rotation of the rod's base at time `t`.
    ///
    /// # Errors
    /// As [`Link::end`].
    pub fn base_wrench(
        &self,
        rod: usize,
        q: &Wrench,
        (t, base): (f64, &UnitQuaternion<f64>),
    ) -> Result<Vector6<f64>> {
        let seen = self.assembly.links()[rod].seen_at(t, base)?;
        self.wrench_of(rod, &seen, q)
    }

    /// Wrench at the base of the light rod ([`AssemblySetup::light_rods`]) that corresponds to rod `rod`, as
    /// [`AssemblySetup::base_wrench`].
    ///
    /// # Errors
    /// As [`AssemblySetup::base_wrench`].
    pub fn light_wrench(&self, rod: usize, q: &Wrench) -> Result<Vector6<f64>> {
        self.wrench_of(rod, &self.assembly.links()[rod].alone(), q)
    }

    fn wrench_of(&self, rod: usize, link: &Link, q: &Wrench) -> Result<Vector6<f64>> {
        let end = link.end(q, GUESS_TOLERANCE)?;
        let (m, n) = if !self.reversed[rod] {
            halves(&q.component_mul(&link.units()))
        } else {
            let half = UnitQuaternion::from_axis_angle(&Vector3::x_axis(), PI);
            let back = (end.pose.rotation * half).inverse();
            (back * -end.couple, back * -end.tip_force())
        };
        let k = &self.scales;
        Ok(join(
            &k.outward(Quantity::Couple, m),
            &k.outward(Quantity::Force, n),
        ))
    }

    /// Poses of the free ends of rods, in the world and the scene's units.
    ///
    /// # Errors
    /// As [`FreeRod::shape`].
    pub fn free_ends(&self, t: f64, now: &Configuration) -> Result<Vec<Isometry3<f64>>> {
        let end = |rod: &FreeRod| -> Result<Isometry3<f64>> {
            let sections = rod.shape(t, &now.bodies, 1, GUESS_TOLERANCE)?;
            // The two sections are at the base and at the end.
            let mut end = sections[1].pose();
            end.translation.vector *= self.scales.length;
            Ok(end)
        };
        self.assembly.free().iter().map(end).collect()
    }

    /// Arclength `s` of rod `rod`, converted to the scene's units and counted from `from`.
    pub fn arclength(&self, rod: usize, s: f64) -> f64 {
        let whole = self.assembly.links()[rod].rod().length();
        let s = if self.moves_reversed(rod) {
            whole - s
        } else {
            s
        };
        self.scales.outward(Quantity::Length, s)
    }

    /// True if rod `rod` begins at its `to` in the light assembly. Rods with a free end come last.
    pub fn is_reversed(&self, rod: usize) -> bool {
        self.reversed[rod]
    }

    /// True if rod `rod` begins at its `to` in a motion. Rods with full mass begin at `from`.
    pub fn moves_reversed(&self, rod: usize) -> bool {
        self.reversed[rod] && self.heavy.is_none()
    }

    /// Sections of rod `rod` in the light assembly at places in [0, 1] from its beginning, in growing order; in the
    /// world and the library's units.
    ///
    /// # Errors
    /// As [`Assembly::sections`].
    pub fn sections(
        &self,
        now: &Configuration,
        rod: usize,
        places: &[f64],
    ) -> Result<Vec<RodSection>> {
        let links = self.assembly.links();
        let length = match links.get(rod) {
            Some(link) => link.rod().length(),
            None => self.assembly.free()[rod - links.len()].rod().length(),
        };
        let at: Vec<f64> = places.iter().map(|place| place * length).collect();
        self.assembly.sections(0.0, now, rod, &at, GUESS_TOLERANCE)
    }

    /// Shapes of all rods at time `t`, from `from` to `to`, those with a free end last. A shape has sections at `count`
    /// + 1 arclengths, each an arclength and a pose in the world and the scene's units.
    ///
    /// # Errors
    /// As [`Assembly::shapes`].
    pub fn shapes(&self, t: f64, now: &Configuration, count: usize) -> Result<Vec<RodCurve>> {
        let length = self.scales.length;
        let shapes = self.assembly.shapes(t, now, count, GUESS_TOLERANCE)?;
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

/// Arclength from `from`, and the directors: the directors of a reversed rod are turned by pi about d1.
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

/// Dead load along a rod, its weight included, in the library's units.
fn load_along(
    rod: &AssemblyRod,
    gravity: [f64; 3],
    scales: &Scales,
) -> Result<Option<DistributedLoad>> {
    let load = rod.distributed.with_weight(&rod.rod, gravity)?;
    let unit = scales.inward(Quantity::Distributed, 1.0);
    Ok(load.map(|load| load.mapped(|f| f * unit)))
}

/// Loads along a rod without a potential, in the library's units; `None` without any. A couple counts that a branch may
/// vary from 0.
fn turning_loads(
    scene: &Scene,
    rod: &AssemblyRod,
    scales: &Scales,
) -> Result<Option<LoadsWithoutPotential>> {
    let any = rod.rod.has_turning_loads() || scene.varies(Parameter::is_listed_couple);
    if !any || scene.run.is_some() && rod.rod.is_heavy() {
        return Ok(None);
    }
    let given = rod.rod.turning_loads()?;
    Ok(Some(turning_in_units(&given, scales, |couple| couple)))
}

/// Loads on the rod as seen from the other end, where the directors are turned by pi about d1.
fn from_end(loads: &LoadsWithoutPotential) -> LoadsWithoutPotential {
    let turned = |load: &DistributedLoad| {
        let load = load.reversed();
        load.mapped(|x| Vector3::new(x.x, -x.y, -x.z))
    };
    LoadsWithoutPotential {
        follower_force: turned(&loads.follower_force),
        couple: loads.couple.reversed(),
        follower_couple: turned(&loads.follower_couple),
    }
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
            Attachment::support(moving_support(&place, &scales.motion(motion.clone()))?)
        }
    })
}

/// The guide of a joint at its attachment, in the library's units; `None` for a weld or ball joint.
fn guide(joint: &SiteJoint, on: Attachment, scales: &Scales) -> Result<Option<Guide>> {
    let pace = scales.inward(Quantity::Time, 1.0);
    let turn = |of: &TurnAxis| JointLaw {
        couple: scales.inward(Quantity::Couple, of.couple),
        stiffness: scales.inward(Quantity::Couple, of.stiffness),
        rest: of.rest,
        damping: scales.inward(Quantity::Couple, of.damping) * pace,
    };
    let unit = |axis: &[f64; 3]| UnitVector3::new_normalize(Vector3::from(*axis));
    let slide = |of: &TurnAxis| -> (Vec<UnitVector3<f64>>, Vec<JointLaw>) {
        let slides: Vec<_> = of.slide.iter().map(unit).collect();
        let laws = vec![JointLaw::default(); slides.len()];
        (slides, laws)
    };
    Ok(Some(match joint {
        SiteJoint::Weld | SiteJoint::Ball => return Ok(None),
        SiteJoint::Hinge(of) => {
            let (slides, mut laws) = slide(of);
            laws.insert(0, turn(of));
            Guide::new(on, vec![unit(&of.axis)], slides, laws)?
        }
        SiteJoint::Universal { first, second_axis } => {
            let second = JointLaw {
                couple: 0.0,
                ..turn(first)
            };
            // Rounding of the scene's numbers must not make the axes oblique.
            let a = unit(&first.axis);
            let b = Vector3::from(*second_axis);
            let b = UnitVector3::new_normalize(b - a.into_inner() * a.dot(&b));
            let (slides, mut laws) = slide(first);
            laws.splice(0..0, [turn(first), second]);
            Guide::new(on, vec![a, b], slides, laws)?
        }
        SiteJoint::Slider(of) | SiteJoint::Roller(of) => {
            let law = JointLaw {
                couple: scales.inward(Quantity::Force, of.force),
                stiffness: scales.inward(Quantity::Distributed, of.stiffness),
                rest: scales.inward(Quantity::Length, of.rest),
                damping: scales.inward(Quantity::Distributed, of.damping) * pace,
            };
            Guide::new(on, Vec::new(), vec![unit(&of.axis)], vec![law])?
        }
    }))
}

/// A body in the library's units.
fn carrier(body: &AssemblyBody, scales: &Scales, gravity: [f64; 3]) -> Result<Body> {
    let body = scales.body(body);
    let free = free_carrier(&body, gravity)?;
    Ok(match &body.groove {
        Some(groove) => free.in_groove(groove.curve()?),
        None => free,
    })
}

fn free_carrier(body: &AssemblyBody, gravity: [f64; 3]) -> Result<Body> {
    let (loads, world) = (body.loads(gravity), Isometry3::identity());
    if body.is_massless() {
        let loads = body.loads([0.0; 3]);
        let node = RigidBody::new(1.0, Matrix3::identity())?;
        return acting_on(node, &loads, Vector3::from, &world).map(Body::loaded_node);
    }
    let Some(extent) = &body.extent else {
        return point_mass(body.mass, &loads, Vector3::from, &world, None).map(Body::point);
    };
    let rigid = RigidBody::new(body.mass, Matrix3::from_fn(|i, j| extent.inertia[i][j]))?
        .with_centre(extent.offset.into())?
        .with_rotor(extent.rotor.into())?;
    acting_on(rigid, &loads, Vector3::from, &world).map(Body::rigid)
}
