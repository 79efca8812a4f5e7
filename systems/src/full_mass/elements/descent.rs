//! Rest by descent: a stable equilibrium to which the light rods and the bodies of an assembly fall.
//!
//! The energy of all rods in elements and of all loads is minimised. Each step solves (K + shift M) x = f: K is the
//! stiffness, f the force, and M a matrix of weights. The shift grows until K + shift M is positive definite and the
//! energy falls, and goes to 0 near the equilibrium: Newton's method with a trust region. Strains that the section law
//! holds rigid are held by springs, soft at first and stiff at last, so that the rods find their places before they
//! have their lengths. The result is a guess for [`crate::assembly::Assembly::equilibrium`], which needs nothing of
//! what holds here approximately.

use super::system::{INTEGRALS, PLACE, TWIST};
use super::{ElementAssembly, ElementMoment, Freedoms, Mesh};
use crate::assembly::{
    Assembly, AssemblyEquilibrium, AssemblyRoute, Attachment, BodyMotion, Configuration, Guide,
    Link,
};
use crate::body::PointMass;
use crate::error::{Error, Result};
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
/// Fewest and most elements of a rod.
const FEWEST: usize = 6;
const MOST: usize = 400;
/// Elements per lam = sqrt(force L^2/B): an element is as long as the layer at a clamp.
const PER_LAM: f64 = 1.0;
/// Turn of the unloaded rod per element, in radians.
const TURN: f64 = 0.25;
/// Springs of rigid strains, over those of a motion, stage by stage.
const STAGES: [f64; 5] = [1e-6, 1e-5, 1e-4, 1e-2, 1.0];
/// Bow of the rods at the start, over their length, in two generic directions.
const BOW: [f64; 2] = [1e-2, 1e-6];
/// First shift, and the shift that counts as none.
const SHIFT: f64 = 10.0;
const LEAST: f64 = 1e-9;
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
/// Gyration radius of the sections of the weights M, over the length of the rod.
const GYRATION: f64 = 0.1;

/// The equilibrium of an assembly without a guess. Under a load along a rod it is sought by descent first; without
/// such a load along paths from the unloaded rods ([`Assembly::equilibrium`]), then by descent if they lead to none
/// that is stable.
///
/// # Errors
/// As [`Assembly::equilibrium`].
pub fn equilibrium(assembly: &Assembly, tolerance: f64) -> Result<AssemblyEquilibrium> {
    let below = || {
        let guess = descended(assembly)?;
        let found = assembly.equilibrium(Some(&guess), tolerance).ok()?;
        (found.index == 0).then_some(AssemblyEquilibrium {
            route: AssemblyRoute::Fallen,
            ..found
        })
    };
    let borne = assembly
        .links()
        .iter()
        .any(|link| link.distributed().is_some());
    if borne && let Some(found) = below() {
        return Ok(found);
    }
    let led = assembly.equilibrium(None, tolerance);
    match &led {
        Ok(found) if found.index == 0 || borne => led,
        Err(_) if borne => led,
        _ => below().map_or(led, Ok),
    }
}

/// The configuration at rest to which an assembly falls from its unloaded rods. `None` if no descent can be made, and
/// if the descent does not end in a stable equilibrium. Joints with axes, grooves, forces at points of rods, and loads
/// without a potential allow no descent.
pub fn descended(assembly: &Assembly) -> Option<Configuration> {
    let movable = assembly
        .carriers()
        .iter()
        .all(|body| body.groove().is_none() && body.guide().is_none_or(Guide::is_plane));
    let at_points = |link: &Link| {
        link.distributed()
            .is_some_and(|load| load.points().next().is_some())
    };
    if assembly.links().iter().any(at_points) {
        return None;
    }
    if !movable || !assembly.is_conservative(0.0) || !assembly.is_held() {
        return None;
    }
    Descent::new(assembly)?.rest()
}

/// An assembly in elements, with the size of its wrenches.
struct Descent<'a> {
    assembly: &'a Assembly,
    model: ElementAssembly,
    start: DVector<f64>,
    /// Mean length of the rods.
    length: f64,
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

/// Number of elements of a rod under a force, for each interval between its breaks.
fn counts(link: &Link, given: &RodDescription, force: f64) -> Result<Vec<usize>> {
    let length = link.rod().length();
    let stiffness = link.units()[0] * length;
    let lam = (force * length * length / stiffness).sqrt();
    let breaks = given.breaks();
    let ends: Vec<f64> = [0.0].iter().chain(&breaks).chain(&[1.0]).copied().collect();
    let mut counts = Vec::new();
    for pair in ends.windows(2) {
        let rest = given.law.unloaded(0.5 * (pair[0] + pair[1]))?;
        let turn = rest.fixed_rows::<3>(0).norm() * length;
        let wanted = (PER_LAM * lam).max(turn / TURN).max(FEWEST as f64);
        let part = wanted.min(MOST as f64) * (pair[1] - pair[0]);
        counts.push(part.ceil().max(1.0) as usize);
    }
    Ok(counts)
}

impl<'a> Descent<'a> {
    fn new(assembly: &'a Assembly) -> Option<Self> {
        Self::made(assembly).ok()
    }

    fn made(assembly: &'a Assembly) -> Result<Self> {
        let mut links = Vec::new();
        let mut elements = Vec::new();
        for link in assembly.links() {
            let rod = link.rod();
            let rigid = rod.law().rigid();
            let active: Vec<usize> = (0..6).filter(|k| !rigid[*k]).collect();
            let length = rod.length();
            let force = force_on(assembly, link);
            let given = RodDescription {
                law: Law::new(rod.law().clone(), None, &active)?.along(length),
                curve: Curve::Space,
                mass: (link.units()[3] + force) / length,
                rotary: None,
                along: None,
                grain: PointMass::new(1.0)?,
                distributed: link.distributed().cloned(),
                body: None,
                diameter: None,
            };
            let rotary = given.mass / length * (GYRATION * length).powi(2);
            let given = RodDescription {
                rotary: Some(Matrix3::identity() * rotary),
                ..given
            };
            elements.push(counts(link, &given, force)?);
            let [base, end] = link.joints();
            let tie = |on: &Attachment, joint| Tie {
                on: on.clone(),
                joint,
            };
            links.push(HeavyLink {
                rod: HeavyRod::coarse(given)?,
                from: tie(link.from(), base),
                to: Some(tie(link.to(), end)),
            });
        }
        let bodies = assembly.carriers().iter();
        let bodies = bodies.map(|body| body.clone().standing_at(0.0)).collect();
        let mesh = Mesh {
            elements,
            degree: DEGREE,
        };
        let mut model = ElementAssembly::new(&HeavyAssembly::new(bodies, links)?, mesh)?;
        if let Some(axis) = plane_of(assembly)? {
            model = model.with_freedoms(Freedoms::Plane(axis));
        }
        let count = assembly.links().len() as f64;
        let length = assembly.links().iter().map(|link| link.rod().length());
        Ok(Self {
            start: start(assembly, &model)?,
            length: length.sum::<f64>() / count,
            assembly,
            model,
        })
    }

    /// Falls with softer and then with stiff springs; None unless the end is stable.
    fn rest(mut self) -> Option<Configuration> {
        let mut y = self.start.clone();
        let springs: Vec<Vec<(usize, f64)>> = self
            .model
            .rods
            .iter()
            .map(|rod| rod.springs.clone())
            .collect();
        // A rod gives way by its load over the stiffness of its springs, not by more than in a motion.
        let loads: Vec<f64> = self
            .assembly
            .links()
            .iter()
            .map(|link| 1.0 + force_on(self.assembly, link) / link.units()[3])
            .collect();
        for (k, stage) in STAGES.iter().enumerate() {
            for ((rod, springs), load) in self.model.rods.iter_mut().zip(&springs).zip(&loads) {
                rod.springs = springs
                    .iter()
                    .map(|(i, spring)| (*i, spring * stage * load))
                    .collect();
            }
            let last = k + 1 == STAGES.len();
            y = self.fallen(y, if last { CONVERGED } else { LOOSE }, last)?;
            if springs.iter().all(Vec::is_empty) && last {
                break;
            }
        }
        self.configuration(&y)
    }

    fn energy(&self, at: &ElementMoment) -> f64 {
        let [_, _, elastic, potential] = self.model.energies(at);
        elastic + potential
    }

    /// State after a descent whose last step is at most `until`.
    fn fallen(&self, mut y: DVector<f64>, until: f64, last: bool) -> Option<DVector<f64>> {
        let model = &self.model;
        let speeds = PLACE * model.sites();
        let mut at = model.moment(&y)?;
        let mut energy = self.energy(&at);
        let mut shift = SHIFT;
        let mut slope = DVector::zeros(y.len());
        for _ in 0..STEPS {
            let linear = model.linearised(&y)?;
            model.slope(&y, &mut slope)?;
            let moved = loop {
                if shift > 1e12 {
                    // Rounding hides any further fall.
                    return (!last).then_some(y);
                }
                let factor = linear.shifted(f64::sqrt(shift));
                let Some(factor) = factor.filter(super::ElementFactor::is_positive) else {
                    shift *= 4.0;
                    continue;
                };
                let mut step = slope.clone();
                if !factor.solve(&mut step) {
                    shift *= 4.0;
                    continue;
                }
                let far = self.far(&step);
                if far > LONGEST {
                    shift *= 4.0;
                    continue;
                }
                let mut next = &y + &step;
                next.rows_mut(speeds, TWIST * model.sites()).fill(0.0);
                next.rows_mut(model.time(), INTEGRALS).fill(0.0);
                for i in 0..model.sites() {
                    let mut turn = next.fixed_rows_mut::<4>(PLACE * i + 3);
                    let norm = turn.norm();
                    turn /= norm;
                }
                let Some(there) = model.moment(&next) else {
                    shift *= 4.0;
                    continue;
                };
                let new = self.energy(&there);
                let fall = self.predicted(&at, &step, shift);
                let rounding = 1e-12 * (1.0 + energy.abs() + at.elastic);
                if energy - new < ENOUGH * fall - rounding {
                    shift *= 4.0;
                    continue;
                }
                let good = energy - new > 0.5 * fall - rounding;
                (y, at, energy) = (next, there, new);
                if good {
                    shift = (shift * 0.1).max(LEAST);
                }
                break far;
            };
            if moved <= until && shift <= LEAST.max(1e-6 * until.log10().abs()) {
                return Some(y);
            }
        }
        (!last).then_some(y)
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

    /// Poses of the bodies and charts of the rods.
    fn configuration(&self, y: &DVector<f64>) -> Option<Configuration> {
        let at = self.model.moment(y)?;
        let bodies = self.model.motions(&at);
        let spanning = self.assembly.links().iter().any(Link::is_pinned);
        let held = spanning.then(|| self.assembly.held(bodies.clone(), 1e-6));
        let links = self.assembly.links().iter().enumerate();
        let charts = links.map(|(k, link)| match &held {
            Some(held) if link.is_pinned() => held.charts[k],
            _ => self.chart(&at, k, link),
        });
        Some(Configuration {
            charts: charts.collect(),
            bodies,
            spins: Vec::new(),
        })
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

/// Axis of the world normal to the plane of an assembly in a plane.
///
/// # Errors
/// A plane that is not normal to an axis of the world.
fn plane_of(assembly: &Assembly) -> Result<Option<usize>> {
    let mut axis = None;
    for body in assembly.carriers() {
        let Some(guide) = body.guide() else {
            continue;
        };
        let normal = guide.normal();
        let most = normal.iamax();
        if (normal[most].abs() - 1.0).abs() > 1e-12 {
            return Err(Error::domain(
                "the descent has planes normal to axes of the world",
            ));
        }
        axis = Some(most);
    }
    Ok(axis)
}

/// State of the unloaded rods, with the gap at their ends spread along them, and a bow.
fn start(assembly: &Assembly, model: &ElementAssembly) -> Result<DVector<f64>> {
    let unloaded = assembly.unloaded(SHAPE)?;
    let bodies = &unloaded.bodies;
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
        let turn = if link.joint().turns() {
            Vector3::zeros()
        } else {
            (tip.rotation * end.rotation.inverse()).scaled_axis()
        };
        let across = [base.rotation * Vector3::x(), base.rotation * Vector3::y()];
        let motions = places.iter().zip(&poses).map(|(s, pose)| {
            let bow = length * (std::f64::consts::PI * s).sin().powi(2);
            let aside = shift * *s + (across[0] * BOW[0] + across[1] * BOW[1]) * bow;
            let rotation = UnitQuaternion::from_scaled_axis(turn * *s) * pose.rotation;
            BodyMotion::at_rest(Isometry3::from_parts(
                Translation3::from(pose.translation.vector + aside),
                rotation,
            ))
        });
        rods.push(motions.collect());
    }
    Ok(model.state(bodies, &rods))
}
