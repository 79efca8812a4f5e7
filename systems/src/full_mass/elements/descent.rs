//! Rest by descent: a stable equilibrium to which the light rods and the bodies of an assembly fall.
//!
//! The energy of all rods in elements and of all loads is minimised. Each step solves (K + shift M) x = f: K is the
//! stiffness, f the force, and M a matrix of weights. The shift grows until K + shift M is positive definite and the
//! energy falls, and goes to 0 near the equilibrium: Newton's method with a trust region. Strains that the section law
//! holds rigid are held by springs, soft at first and stiff at last, so that the rods find their places before they
//! have their lengths. The result is a guess for [`crate::assembly::Assembly::equilibrium`], which needs nothing of
//! what holds here approximately.

use super::hold::{Confinement, Hold};
use super::system::{INTEGRALS, PLACE, TWIST};
use super::{Carrier, ElementAssembly, ElementLinear, ElementMoment, Freedoms, GIVE, Mesh};
use crate::assembly::{
    Assembly, AssemblyEquilibrium, AssemblyRoute, Attachment, Body, BodyMotion, Configuration,
    Joint, Link,
};
use crate::body::{Mass, PointMass, RigidBody};
use crate::error::Result;
use crate::full_mass::assembly::{HeavyAssembly, HeavyLink, Tie};
use crate::full_mass::frames::Curve;
use crate::full_mass::law::Law;
use crate::full_mass::rod::{HeavyRod, RodDescription};
use crate::math::se3::{halves, join};
use crate::rod::Wrench;
use crate::solve::system::{Factor, Linearised, System};
use nalgebra::{DVector, Isometry3, Matrix3, Translation3, UnitQuaternion, Vector3, Vector6};

/// Degree of the elements.
const DEGREE: usize = 4;
/// Fewest elements of a rod, and the most of the first mesh and of the second. The first mesh does not resolve the
/// layers of a heavy rod, but places the bodies and joints where the rods that are solved one by one lead on.
const FEWEST: usize = 6;
const COARSE: usize = 24;
const FINE: usize = 400;
/// Elements per lam = sqrt(force L^2/B): an element is half as long as the layer at a clamp.
const PER_LAM: f64 = 2.0;
/// Turn of the unloaded rod per element, in radians.
const TURN: f64 = 0.25;
/// Springs of rigid strains, over those of a motion, stage by stage. Soft springs lead to the deepest sag, but let an
/// upright rod sink through itself; the second descent has stiffer springs.
const DESCENTS: [&[f64]; 2] = [&[1e-6, 1e-5, 1e-4, 1e-2, 1.0], &[1e-4, 1e-2, 1.0]];
/// Largest give of a rigid strain at rest: a rod that has sunk through itself gives more.
const SUNK: f64 = 0.1;
/// Bow of the rods at the start, over their length: in the plane, or in two generic directions in space.
const BOW: [f64; 2] = [1e-2, 1e-6];
/// First, least and largest shift; the growth of a shift that fails, its fall after a good step, and the shift that
/// counts as none.
const SHIFT: f64 = 10.0;
const LEAST: f64 = 1e-9;
const LARGEST: f64 = 1e12;
const GROWTH: f64 = 4.0;
const FALL: f64 = 0.1;
const NONE: f64 = 1e-5;
/// Longest step, in radians and mean rod lengths; the step at which a stage ends, and the last one.
const LONGEST: f64 = 0.3;
const LOOSE: f64 = 1e-3;
const CONVERGED: f64 = 1e-7;
/// Most steps of a stage.
const STEPS: usize = 300;
/// Least part of the predicted fall of energy that a step must reach.
const ENOUGH: f64 = 1e-4;
/// Tolerance of the unloaded shapes.
const SHAPE: f64 = 1e-9;
/// Tolerance of rods between two ball joints, whose charts are found from the bodies alone.
const SPANNING: f64 = 1e-6;
/// Distance of the normal of a plane from an axis of the world.
const AXIS: f64 = 1e-12;
/// Least step in the share of loads without a potential.
const LEAST_SHARE: f64 = 1.0 / 128.0;
/// Mass and radius of gyration of the site of a joint, over the values of the rod.
const LIGHT: f64 = 1e-2;
/// Least stage of the springs that stand for constraints.
const HELD: f64 = 1e-2;
/// Mass that carries a force at a place of a rod, over the mass of the rod.
const BEARER: f64 = 1e-6;
/// Rounding of energies.
const ROUNDING: f64 = 1e-12;
/// Gyration radius of the sections of the weights M, over the length of the rod.
const GYRATION: f64 = 0.1;

/// The equilibrium of an assembly without a guess. Under a load along a rod it is sought by descent first; without
/// such a load along paths from the unloaded rods ([`Assembly::equilibrium`]), then by descent if they lead to none
/// that is stable.
///
/// # Errors
/// As [`Assembly::equilibrium`].
pub fn equilibrium(assembly: &Assembly, tolerance: f64) -> Result<AssemblyEquilibrium> {
    // A fall needs a potential.
    if assembly.has_turning() {
        return assembly.equilibrium(None, tolerance);
    }
    let fallen = || {
        if assembly.is_conservative(0.0) {
            at_rest(assembly, tolerance)
        } else {
            driven(assembly, tolerance)
        }
    };
    let mut links = assembly.links().iter();
    let is_loaded = links.any(|link| link.distributed().is_some());
    if is_loaded && let Some(found) = fallen() {
        return Ok(found);
    }
    let led = assembly.equilibrium(None, tolerance);
    if is_loaded || led.as_ref().is_ok_and(|found| found.index == 0) {
        return led;
    }
    fallen().map_or(led, Ok)
}

/// The stable equilibrium to which an assembly falls under loads with a potential.
fn at_rest(assembly: &Assembly, tolerance: f64) -> Option<AssemblyEquilibrium> {
    if assembly.carriers().is_empty() {
        // Nothing moves but the rods: each of them falls alone.
        let alone = assembly.held(Vec::new(), SHAPE);
        let found = assembly.equilibrium_beside(&alone, tolerance);
        if let Some(found) = found.filter(|found| found.index == 0) {
            return Some(AssemblyEquilibrium {
                route: AssemblyRoute::Fallen,
                ..found
            });
        }
    }
    let coarse = Descent::new(assembly, COARSE).ok()??;
    let fine = Descent::new(assembly, FINE).ok()??;
    let is_resolved = coarse.start.len() == fine.start.len();
    let first = (!is_resolved).then_some((coarse, &DESCENTS[..1]));
    let mut meshes = first.into_iter().chain([(fine, &DESCENTS[..])]);
    meshes.find_map(|(mut descent, all)| {
        let mut stages = all.iter();
        stages.find_map(|stages| fall(assembly, &mut descent, stages, tolerance))
    })
}

/// The stable equilibrium to which a descent leads.
fn fall(
    assembly: &Assembly,
    descent: &mut Descent<'_>,
    stages: &[f64],
    tolerance: f64,
) -> Option<AssemblyEquilibrium> {
    let guess = descent.rest(stages)?;
    let beside = |guess: &Configuration| assembly.equilibrium_beside(guess, tolerance);
    // Base wrenches of the elements may be too rough for a heavy rod: the rods are then solved one by one.
    let found = beside(&guess)
        .or_else(|| beside(&assembly.held(guess.bodies.clone(), SHAPE)))
        .or_else(|| assembly.equilibrium(Some(&guess), tolerance).ok())?;
    (found.index == 0).then_some(AssemblyEquilibrium {
        route: AssemblyRoute::Fallen,
        ..found
    })
}

/// The equilibrium under loads of which some have no potential: the assembly falls without these, which then grow.
fn driven(assembly: &Assembly, tolerance: f64) -> Option<AssemblyEquilibrium> {
    let quiet = assembly.with_share_of_driving(0.0, 0.0).ok()?;
    let mut last = at_rest(&quiet, tolerance)?;
    let (mut share, mut step) = (0.0, 1.0);
    while share < 1.0 {
        let next = f64::min(share + step, 1.0);
        let loaded = assembly.with_share_of_driving(0.0, next).ok()?;
        match loaded.equilibrium_beside(&last.now, tolerance) {
            Some(found) => {
                (last, share, step) = (found, next, 2.0 * step);
            }
            None if step > LEAST_SHARE => step *= 0.5,
            None => return None,
        }
    }
    Some(AssemblyEquilibrium {
        route: AssemblyRoute::Fallen,
        ..last
    })
}

/// An assembly in elements.
struct Descent<'a> {
    assembly: &'a Assembly,
    model: ElementAssembly,
    start: DVector<f64>,
    /// Mean length of the rods.
    length: f64,
}

/// A state that lies lower.
struct Lower {
    y: DVector<f64>,
    at: ElementMoment,
    energy: f64,
    /// Length of the step to the state.
    far: f64,
    /// True if the energy fell by half the predicted fall at least.
    good: bool,
}

/// Force of all loads on a rod and on all bodies.
fn force_on(assembly: &Assembly, link: &Link) -> f64 {
    let bodies = assembly.carriers().iter();
    let on_bodies: f64 = bodies
        .map(|body| halves(&body.load(0.0, &Isometry3::identity())).1.norm())
        .sum();
    let along = link.distributed();
    on_bodies + along.map_or(0.0, |load| load.total(link.rod().length()).norm())
}

/// Number of elements of a rod under a force, at most `most`, for each interval between its breaks. Both meshes resolve
/// the turns of the unloaded rod.
fn counts(link: &Link, given: &RodDescription, force: f64, most: usize) -> Result<Vec<usize>> {
    let length = link.rod().length();
    // The reference stiffness is the harmonic mean of both bending stiffnesses; out of the plane a rod is nearly rigid.
    let bent = if link.bending_director().is_some() {
        0.5
    } else {
        1.0
    };
    let stiffness = bent * link.units()[0] * length;
    let lam = (force * length * length / stiffness).sqrt();
    let breaks = given.breaks();
    let ends: Vec<f64> = [0.0].iter().chain(&breaks).chain(&[1.0]).copied().collect();
    let mut counts = Vec::new();
    for pair in ends.windows(2) {
        let rest = given.law.unloaded(0.5 * (pair[0] + pair[1]))?;
        let turn = rest.fixed_rows::<3>(0).norm() * length;
        let turned = (turn / TURN).max(FEWEST as f64);
        let wanted = (PER_LAM * lam).min(most as f64).max(turned);
        let part = wanted.min(FINE as f64) * (pair[1] - pair[0]);
        counts.push(part.ceil().max(1.0) as usize);
    }
    Ok(counts)
}

/// Joints of the descent. A ball joint has no site; every other joint has one.
struct Joints {
    /// Site of each carrier; `None` for nodes of ball joints.
    sites: Vec<Option<usize>>,
    /// Joints with a site, by the number of their carrier.
    nodes: Vec<usize>,
}

impl Joints {
    fn new(assembly: &Assembly) -> Self {
        let solids = assembly.solids().len();
        let mut sites: Vec<Option<usize>> = (0..solids).map(Some).collect();
        let mut nodes = Vec::new();
        for (node, carrier) in assembly.carriers().iter().enumerate().skip(solids) {
            let on_node = |link: &&Link| {
                [link.from(), link.to()]
                    .iter()
                    .any(|on| on.carried_by() == Some(node))
            };
            let mut links = assembly.links().iter().filter(on_node);
            let turns_freely = |link: &Link| {
                let in_plane = link.bending_director().is_some();
                carrier
                    .joint()
                    .is_some_and(|joint| joint.turns_freely(in_plane))
            };
            let is_ball = links.all(turns_freely);
            sites.push((!is_ball).then_some(solids + nodes.len()));
            if !is_ball {
                nodes.push(node);
            }
        }
        Self { sites, nodes }
    }

    /// Tie of a rod's end.
    fn tie(&self, assembly: &Assembly, on: &Attachment, joint: Joint) -> Tie {
        let Some(node) = on.carried_by() else {
            return Tie::new(on.clone(), joint);
        };
        match (self.sites[node], assembly.carriers()[node].joint()) {
            (None, Some(ball)) => Tie::new(ball.on().clone(), Joint::Ball),
            (site, _) => {
                let site = site.unwrap_or(node);
                Tie::new(Attachment::body(site, on.place), joint)
            }
        }
    }

    /// Springs that stand for joints with axes, for grooves, and for the plane of bodies if asked for.
    fn holds(&self, assembly: &Assembly, planes: bool) -> Vec<Hold> {
        let (couple, force) = (1.0, 1.0);
        let mut holds = Vec::new();
        for (carrier, site) in assembly.carriers().iter().zip(&self.sites) {
            let Some(site) = *site else { continue };
            let hold = |by| Hold {
                site,
                by,
                couple,
                force,
            };
            if let Some(groove) = carrier.groove() {
                holds.push(hold(Confinement::Groove(groove.clone())));
            }
            if let Some(guide) = carrier.guide()
                && (planes || !guide.is_plane())
            {
                holds.push(hold(Confinement::Guide(guide.clone())));
            }
        }
        holds
    }
}

impl<'a> Descent<'a> {
    /// The assembly in elements, at most `most` for the layers of a rod. `None` for loads without a potential, and for
    /// bodies that nothing holds.
    fn new(assembly: &'a Assembly, most: usize) -> Result<Option<Self>> {
        if !assembly.is_conservative(0.0) || !assembly.is_held() {
            return Ok(None);
        }
        let joints = Joints::new(assembly);
        let mut links = Vec::new();
        let mut elements = Vec::new();
        for link in assembly.links() {
            let rod = link.rod();
            let rigid = rod.law().rigid();
            let active: Vec<usize> = (0..6).filter(|k| !rigid[*k]).collect();
            let length = rod.length();
            let force = force_on(assembly, link);
            let mass = (link.units()[3] + force) / length;
            let given = RodDescription {
                law: Law::new(rod.law().clone(), None, &active)?.along(length),
                curve: Curve::Space,
                mass,
                rotary: Some(Matrix3::identity() * (mass * length * GYRATION.powi(2))),
                along: None,
                grain: PointMass::new(1.0)?,
                distributed: link.distributed().cloned(),
                turning: None,
                body: None,
                diameter: None,
            };
            elements.push(counts(link, &given, force, most)?);
            let [base, end] = link.joints();
            let from = joints.tie(assembly, link.from(), base);
            let to = joints.tie(assembly, link.to(), end);
            links.push(HeavyLink {
                rod: HeavyRod::coarse(given)?,
                from,
                to: Some(to),
            });
        }
        let solids = assembly.solids().iter();
        let mut bodies: Vec<Body> = solids.map(free_of_constraints).collect();
        let mass: f64 = links.iter().map(|link| link.rod.given.mass).sum::<f64>() * LIGHT;
        let size = GYRATION
            * assembly
                .links()
                .iter()
                .map(|link| link.rod().length())
                .fold(0.0, f64::max);
        for _ in &joints.nodes {
            let inertia = Matrix3::identity() * (mass * size * size);
            bodies.push(Body::rigid(RigidBody::new(mass, inertia)?));
        }
        let mesh = Mesh {
            elements,
            degree: DEGREE,
        };
        let mut model = ElementAssembly::new(&HeavyAssembly::new(bodies, links)?, mesh)?;
        bear_points(assembly, &mut model)?;
        let unloaded = assembly.unloaded(SHAPE)?.bodies;
        let normal = normal(assembly, &unloaded);
        let axis = normal
            .map(|normal| normal.iamax())
            .filter(|axis| normal.is_some_and(|normal| (normal[*axis].abs() - 1.0).abs() <= AXIS));
        if let Some(axis) = axis {
            model = model.with_freedoms(Freedoms::Plane(axis));
        }
        let holds = joints.holds(assembly, axis.is_none());
        model = model.with_holds(holds);
        let sites = (0..unloaded.len()).filter(|node| joints.sites[*node].is_some());
        let sites: Vec<BodyMotion> = sites.map(|node| unloaded[node]).collect();
        let count = assembly.links().len() as f64;
        let length = assembly.links().iter().map(|link| link.rod().length());
        Ok(Some(Self {
            start: start(assembly, &model, &unloaded, &sites, normal)?,
            length: length.sum::<f64>() / count,
            assembly,
            model,
        }))
    }

    /// Falls with springs of rigid strains that grow stage by stage. `None` unless the end is stable and the rigid
    /// strains are near their values in the unloaded rod.
    fn rest(&mut self, stages: &[f64]) -> Option<Configuration> {
        let mut y = self.start.clone();
        let is_rigid = self.model.rods.iter().any(|rod| !rod.springs.is_empty());
        for (k, stage) in stages.iter().enumerate() {
            let is_last = k + 1 == stages.len();
            if !(is_rigid || is_last) {
                continue;
            }
            let (mut most_couple, mut most_force) = (0.0_f64, 0.0_f64);
            for (rod, link) in self.model.rods.iter_mut().zip(self.assembly.links()) {
                // Springs are stiffened with the load, so that the rigid strains of all rods give way alike.
                let load = 1.0 + force_on(self.assembly, link) / link.units()[3];
                let couple = link.units()[0] * link.rod().length() * load / GIVE;
                let force = couple / link.rod().length().powi(2);
                (most_couple, most_force) = (most_couple.max(couple), most_force.max(force));
                let (couple, force) = (couple * stage, force * stage);
                for (k, spring) in &mut rod.springs {
                    *spring = if *k < 3 { couple } else { force };
                }
            }
            for hold in &mut self.model.holds {
                (hold.couple, hold.force) =
                    (most_couple * stage.max(HELD), most_force * stage.max(HELD));
            }
            y = self.fallen(y, if is_last { CONVERGED } else { LOOSE }, is_last)?;
        }
        let at = self.model.moment(&y)?;
        (!self.has_sunk(&at)?).then(|| self.configuration(&at))
    }

    /// True if a rigid strain is far from its value in the unloaded rod.
    fn has_sunk(&self, at: &ElementMoment) -> Option<bool> {
        for (k, rod) in self.model.rods.iter().enumerate() {
            for element in &rod.elements {
                let s = 0.5 * (element.from + element.to);
                let rest = rod.law().unloaded(s).ok()?;
                let strain = self.model.strains(at, k, &[s])[0];
                if rod
                    .springs
                    .iter()
                    .any(|(i, _)| (strain[*i] - rest[*i]).abs() > SUNK)
                {
                    return Some(true);
                }
            }
        }
        Some(false)
    }

    fn energy(&self, at: &ElementMoment) -> f64 {
        let [_, _, elastic, potential] = self.model.energies(at);
        elastic + potential
    }

    /// State after a descent whose last step is at most `until`. The last stage must end with such a step.
    fn fallen(&self, mut y: DVector<f64>, until: f64, is_last: bool) -> Option<DVector<f64>> {
        let model = &self.model;
        let mut at = model.moment(&y)?;
        let mut energy = self.energy(&at);
        let mut shift = SHIFT;
        let mut slope = DVector::zeros(y.len());
        for _ in 0..STEPS {
            let linear = model.linearised(&y)?;
            model.slope(&y, &mut slope)?;
            let lower = loop {
                match self.lower(&y, &at, energy, &linear, &slope, shift) {
                    None if shift < LARGEST => shift *= GROWTH,
                    lower => break lower,
                }
            };
            let Some(lower) = lower else {
                // Rounding hides any further fall.
                break;
            };
            (y, at, energy) = (lower.y, lower.at, lower.energy);
            if lower.good {
                shift = (shift * FALL).max(LEAST);
            }
            if lower.far <= until && shift <= NONE {
                return Some(y);
            }
        }
        (!is_last).then_some(y)
    }

    /// The state one step on, with a shift; `None` if the energy is not convex with the shift, or does not fall.
    fn lower(
        &self,
        y: &DVector<f64>,
        at: &ElementMoment,
        energy: f64,
        linear: &ElementLinear,
        slope: &DVector<f64>,
        shift: f64,
    ) -> Option<Lower> {
        let model = &self.model;
        let factor = linear.shifted(shift.sqrt())?;
        let mut step = slope.clone();
        if !factor.is_positive() || !factor.solve(&mut step) {
            return None;
        }
        let far = self.far(&step);
        let mut next = y + &step;
        next.rows_mut(PLACE * model.sites(), TWIST * model.sites())
            .fill(0.0);
        next.rows_mut(model.time(), INTEGRALS).fill(0.0);
        for i in 0..model.sites() {
            let mut turn = next.fixed_rows_mut::<4>(PLACE * i + 3);
            let norm = turn.norm();
            turn /= norm;
        }
        let there = model.moment(&next).filter(|_| far <= LONGEST)?;
        let new = self.energy(&there);
        let fall = self.predicted(at, &step, shift);
        let rounding = ROUNDING * (1.0 + energy.abs() + at.elastic);
        (energy - new >= ENOUGH * fall - rounding).then_some(Lower {
            good: energy - new > 0.5 * fall - rounding,
            y: next,
            at: there,
            energy: new,
            far,
        })
    }

    /// Length of a step, in radians and mean rod lengths.
    fn far(&self, step: &DVector<f64>) -> f64 {
        let sites = (0..self.model.sites()).map(|i| {
            let place = step.fixed_rows::<3>(PLACE * i).norm() / self.length;
            place.max(2.0 * step.fixed_rows::<4>(PLACE * i + 3).norm())
        });
        sites.fold(0.0, f64::max)
    }

    /// Half the work of the forces on a step: the fall that a quadratic energy would have at least.
    fn predicted(&self, at: &ElementMoment, step: &DVector<f64>, shift: f64) -> f64 {
        let (model, none) = (&self.model, Vector6::zeros());
        let speeds = PLACE * model.sites();
        let works = model.sites.iter().enumerate().map(|(i, site)| {
            // The factors give the velocities root(shift) x along with the step x.
            let moved = step.fixed_rows::<6>(speeds + TWIST * i) / shift.sqrt();
            let (pose, twist) = (at.sites[i].pose(), at.sites[i].twist());
            let needed = site.masses.iter();
            let needed = needed.filter_map(|mass| mass.wrench(at.t, &pose, &twist, &none));
            let force = needed.fold(at.on_sites[i], |force, needed| force - needed);
            model.freed(i, force).dot(&moved)
        });
        0.5 * works.sum::<f64>()
    }

    /// Poses of the bodies and joints, and charts of the rods.
    fn configuration(&self, at: &ElementMoment) -> Configuration {
        let mut bodies = self.model.motions(at);
        bodies.truncate(self.assembly.solids().len());
        let none = BodyMotion::at_rest(Isometry3::identity());
        bodies.resize(self.assembly.carriers().len(), none);
        let solids = self.assembly.solids().len();
        for (link, nodes) in self.assembly.links().iter().zip(&at.nodes) {
            let ends = [(link.from(), nodes.first()), (link.to(), nodes.last())];
            for (on, node) in ends {
                if let (Some(joint), Some(node)) = (on.carried_by(), node)
                    && joint >= solids
                {
                    bodies[joint] = node.motion();
                }
            }
        }
        self.assembly.confined(&mut bodies);
        let spanning = self.assembly.links().iter().any(Link::is_pinned);
        let held = spanning.then(|| self.assembly.held(bodies.clone(), SPANNING));
        let links = self.assembly.links().iter().enumerate();
        let charts = links.map(|(k, link)| match &held {
            Some(held) if link.is_pinned() => held.charts[k],
            _ => self.chart(at, k, link),
        });
        Configuration {
            charts: charts.collect(),
            bodies,
            spins: Vec::new(),
        }
    }

    /// Base wrench of a rod, along its directors, in its units: the pull of the strains on the first node, and the
    /// load there.
    fn chart(&self, at: &ElementMoment, k: usize, link: &Link) -> Wrench {
        let rod = &self.model.rods[k];
        let first = &rod.elements[0];
        let (_, weights) = crate::math::gauss::lobatto(DEGREE + 1);
        let weight = weights[0] * (first.to - first.from) * link.rod().length();
        let load = link.distributed();
        let load = load.map_or(Vector3::zeros(), |load| load.density(0.0)) * weight;
        let (couple, force) = halves(&at.forces[k][0]);
        let back = at.nodes[k][0].motion().pose.rotation.inverse();
        join(&(back * couple), &(back * (force + load))).component_div(&link.units())
    }
}

/// Normal of the plane of a planar assembly, in the world.
fn normal(assembly: &Assembly, bodies: &[BodyMotion]) -> Option<Vector3<f64>> {
    let mut links = assembly.links().iter();
    links.find_map(|link| {
        let director = Vector3::ith(link.bending_director()?, 1.0);
        Some(link.from().at(0.0, bodies).pose.rotation * director)
    })
}

/// A body at rest without a groove or plane.
fn free_of_constraints(body: &Body) -> Body {
    Body::new(body.mass().clone()).standing_at(0.0)
}

/// Puts the forces at single places of rods on the nodes there.
fn bear_points(assembly: &Assembly, model: &mut ElementAssembly) -> Result<()> {
    for (k, link) in assembly.links().iter().enumerate() {
        let Some(load) = link.distributed() else {
            continue;
        };
        let length = link.rod().length();
        for (x, force) in load.points() {
            let places = model.places(k).iter();
            let nearest = places
                .enumerate()
                .min_by(|a, b| (a.1 - x).abs().total_cmp(&(b.1 - x).abs()));
            let Some((node, _)) = nearest else { continue };
            if let Carrier::Site(site) = model.rods[k].nodes[node].shift {
                let bearer = PointMass::new(BEARER * model.rods[k].given.mass)?;
                let bearer = bearer.with_dead_force(force * length)?;
                model.sites[site].masses.push(Mass::Point(bearer));
            }
        }
    }
    Ok(())
}

/// A state of rods with a small bow, in their unloaded shapes but for the gaps at their ends. Each gap is spread along
/// its rod. The bow lies in the plane of a planar assembly.
fn start(
    assembly: &Assembly,
    model: &ElementAssembly,
    bodies: &[BodyMotion],
    sites: &[BodyMotion],
    normal: Option<Vector3<f64>>,
) -> Result<DVector<f64>> {
    let mut rods = Vec::new();
    for (k, link) in assembly.links().iter().enumerate() {
        let length = link.rod().length();
        let places = model.places(k);
        let at: Vec<f64> = places.iter().map(|s| s * length).collect();
        let base = link.from().at(0.0, bodies).pose;
        let tip = link.to().at(0.0, bodies).pose;
        let free = link
            .rod()
            .clone()
            .with_clamp(Vector3::zeros(), UnitQuaternion::identity());
        let sections = free.shape(&Wrench::zeros(), &at, SHAPE)?;
        let poses: Vec<Isometry3<f64>> = sections.iter().map(|s| base * s.pose()).collect();
        let Some(end) = poses.last() else {
            continue;
        };
        let shift = tip.translation.vector - end.translation.vector;
        let turn = if model.turns_at_end(k) {
            Vector3::zeros()
        } else {
            (tip.rotation * end.rotation.inverse()).scaled_axis()
        };
        let [first, second, tangent] = [0, 1, 2].map(|k| base.rotation * Vector3::ith(k, 1.0));
        let across = normal.map_or(first * BOW[0] + second * BOW[1], |normal| {
            normal.cross(&tangent) * BOW[0]
        });
        let motions = places.iter().zip(&poses).map(|(s, pose)| {
            let bow = length * (std::f64::consts::PI * s).sin().powi(2);
            let aside = shift * *s + across * bow;
            let rotation = UnitQuaternion::from_scaled_axis(turn * *s) * pose.rotation;
            BodyMotion::at_rest(Isometry3::from_parts(
                Translation3::from(pose.translation.vector + aside),
                rotation,
            ))
        });
        rods.push(motions.collect());
    }
    Ok(model.state(sites, &rods))
}
