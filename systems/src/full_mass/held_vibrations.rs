//! Vibrations of a light rod with its ends held (theory 2.9, 3.9).
//!
//! About an equilibrium, let the strains q at the nodes be the coordinates and M = J^T N J. K is the stiffness under
//! the wrench that holds the end (and a dead load along the rod), and E are the motions of the end that its
//! attachment prevents:
//! ```text
//! K x = omega^2 M x,     E x = 0.
//! ```
//! At a weld E are rotations and translations of the end, at a ball joint its translations. A rod between two ball
//! joints turns about its base too, and has no angular momentum about its chord, since the spin about the chord is
//! free.

use super::frames::Curve;
use super::law::Law;
use super::rod::{HeavyRod, RodDescription, RodSupport};
use super::vibration::slowest;
use crate::assembly::{Joint, Link, LinkPoint};
use crate::body::PointMass;
use crate::elastica::FoldNormalForm;
use crate::error::{Error, Result};
use crate::math::se3::{halves, join};
use crate::rod::{Rod, RodSection, SectionMass, Wrench};
use crate::section::rate::RateLaw;
use crate::section::{MassAlong, Strain};
use crate::solve::difference_step::Steps;
use crate::viscoelastic::grid::{Grid, more};
use nalgebra::{DMatrix, DVector, Matrix3, Rotation3, Vector3, Vector6};
use std::sync::Arc;

/// A rod of known mass: section law, free strains, friction if any, and mass properties.
#[derive(Debug, Clone)]
pub struct Massive {
    /// The law, along the rod.
    law: Law,
    /// Mass, and inertia of the sections; 0 for sections without rotary inertia.
    pub sections: SectionMass,
    /// Variation of both along the rod.
    along: Option<MassAlong>,
}

/// A vibration of a rod whose ends are held.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct HeldMode {
    /// Square of the angular frequency; negative if the held rod is unstable.
    pub square: f64,
    /// Decay rate of the amplitude by the friction of the law; 0 without friction.
    pub decay: f64,
    /// Decay rate by a friction proportional to the stiffness, per Kelvin-Voigt time.
    pub proportional: f64,
}

/// Nodes of an element to begin with, largest number of coordinates, and relative change of the slowest square at
/// which the nodes suffice.
const FIRST: usize = 12;
const MOST: usize = 300;
const CONVERGED: f64 = 1e-9;
/// Ratio of the slowest square to the next one below which the slowest counts as zero.
const FOLDED: f64 = 1e-3;
/// Tolerance of the shape.
const ALONG: f64 = 1e-13;
/// Relative change at which results of fourth-order differences count as converged.
const DIFFERENCES: f64 = 1e-7;
/// Steps of derivatives along a motion, the first over its scale.
const STEPS: Steps = Steps {
    first: 2e-3,
    most: 8,
    same: 1e-9,
};
/// Relative size below which a motion of the end counts as none: a straight rod without stretch does not move along
/// itself.
const IDLE: f64 = 1e-10;
/// Largest residual of the balance, relative to 1 and the wrench, at which the strains are those of an equilibrium.
const BALANCED: f64 = 1e-5;

impl Massive {
    /// A rod of the library, with friction if it has any.
    ///
    /// # Errors
    /// As [`Law::new`].
    pub fn new(
        rod: &Rod,
        friction: Option<Arc<dyn RateLaw>>,
        sections: SectionMass,
    ) -> Result<Self> {
        let elastic = rod.law().clone();
        let rigid = elastic.rigid();
        let active: Vec<usize> = (0..6).filter(|k| !rigid[*k]).collect();
        Ok(Self {
            law: Law::new(elastic, friction, &active)?.along(rod.length()),
            sections,
            along: rod.mass_along().cloned(),
        })
    }

    /// Mass and rotary inertia of the section at s in [0, 1], per length over that of the rod.
    fn inertia_at(&self, s: f64) -> (f64, Vector3<f64>) {
        let SectionMass { mass, rotary } = self.sections;
        let rotary = rotary * self.law.length();
        match &self.along {
            None => (mass, rotary),
            Some(along) => (
                mass * along.density().at(s),
                along.rotary(s).component_mul(&rotary),
            ),
        }
    }
}

impl HeldMode {
    /// Angular frequency; None for an unstable rod.
    pub fn frequency(&self) -> Option<f64> {
        (self.square > 0.0).then(|| self.square.sqrt())
    }
}

/// The `count` slowest vibrations, by rising square of the frequency, of the rod `massive` in equilibrium between its
/// attachments: `link` at the chart point `q` and at `point`. The slowest is resolved to 1e-9, relative.
///
/// # Errors
/// As [`Link::shape`]; a chart point that is none of this section law; a rod that is not resolved.
pub fn held_modes(
    massive: &Massive,
    link: &Link,
    q: &Wrench,
    point: &LinkPoint,
    count: usize,
) -> Result<Vec<HeldMode>> {
    let back = point.base.pose.rotation.inverse();
    let rotary = massive.sections.rotary;
    let given = RodDescription {
        law: massive.law.clone(),
        curve: Curve::Space,
        mass: massive.sections.mass,
        rotary: (rotary.norm() > 0.0).then(|| Matrix3::from_diagonal(&rotary)),
        along: massive.along.clone(),
        grain: PointMass::new(1.0)?,
        distributed: link.distributed().map(|load| load.mapped(|f| back * f)),
        turning: None,
        body: None,
        diameter: None,
    };
    let [_, on_tip] = point.wrenches();
    let (couple, force) = halves(&on_tip);
    let end = -join(&(back * couple), &(back * force));
    let breaks = given.breaks();
    let mut nodes = FIRST;
    let mut last: Option<Vec<f64>> = None;
    loop {
        let grid = Grid::new(&breaks, &vec![nodes; breaks.len() + 1]);
        let size = grid.len() * given.law.active().len();
        let strains = strains(link, q, point, grid.nodes())?;
        let (found, left) = at_nodes(&given, grid, &strains, &end, link.joints(), count)?;
        let squares: Vec<f64> = found.iter().map(|mode| mode.square).collect();
        if last.as_ref().is_some_and(|last| alike(last, &squares)) {
            if !(left <= BALANCED * (1.0 + end.norm())) {
                return Err(Error::domain(format!(
                    "the held rod is in no equilibrium: a couple of {left:.1e} is left"
                )));
            }
            return Ok(found);
        }
        nodes = more(nodes);
        if size > MOST {
            return Err(Error::ill_conditioned(
                "the vibrations of the held rod are not resolved",
            ));
        }
        last = Some(squares);
    }
}

/// Strains at points in [0, 1], in growing order.
fn strains(link: &Link, q: &Wrench, point: &LinkPoint, places: &[f64]) -> Result<Vec<Strain>> {
    let seen = link.with_base_rotation(&point.base.pose.rotation);
    let length = link.rod().length();
    let at: Vec<f64> = places.iter().map(|s| s * length).collect();
    let sections = seen.shape(q, &point.held(), &at, ALONG)?;
    Ok(sections.iter().map(|section| section.strain).collect())
}

/// A motion of a rod through its equilibria: its sections, at points in [0, 1] in growing order, as a function of the
/// amplitude.
pub type Way<'a> = &'a dyn Fn(f64, &[f64]) -> Result<Vec<RodSection>>;

/// A motion of a rod through equilibria, and the step of derivatives along the motion.
pub struct Sweep<'a> {
    way: Way<'a>,
    step: f64,
}

impl<'a> Sweep<'a> {
    /// Chooses the longest step that agrees with the next shorter one, or the one closest to agreement. `scale` is
    /// the amplitude of a relative change of 1.
    ///
    /// # Errors
    /// Those of the motion.
    pub fn new(way: Way<'a>, scale: f64) -> Result<Self> {
        let places = [0.2, 0.4, 0.6, 0.8, 1.0];
        let here = way(0.0, &places)?;
        let rates = |step: f64| Self { way, step }.rates(&here, &places);
        let apart = |a: &Vec<Swept>, b: &Vec<Swept>| {
            let off: f64 = a.iter().zip(b).map(|(a, b)| a.off(b)).sum();
            let size: f64 = b.iter().map(|rate| rate.off(&Swept::default())).sum();
            off / size
        };
        let steps = Steps {
            first: STEPS.first * scale,
            ..STEPS
        };
        let (step, _) = steps.best_step(rates, apart)?.ok_or_else(|| {
            Error::ill_conditioned("derivatives along the motion of the rod are not resolved")
        })?;
        Ok(Self { way, step })
    }

    /// Rates of force and position at the end.
    ///
    /// # Errors
    /// Those of the motion.
    pub fn end(&self) -> Result<[Vector3<f64>; 2]> {
        let here = (self.way)(0.0, &[1.0])?;
        let end = self.rates(&here, &[1.0])?[0];
        Ok([end.force, end.velocity])
    }

    /// Derivatives by differences of the fourth order.
    fn rates(&self, here: &[RodSection], places: &[f64]) -> Result<Vec<Swept>> {
        let step = self.step;
        let at = |part: f64| (self.way)(part * step, places);
        let [after, before, far, back] = [at(1.0)?, at(-1.0)?, at(2.0)?, at(-2.0)?];
        let each = (0..places.len()).map(|i| {
            let all = [&after[i], &before[i], &far[i], &back[i]];
            let rate = |of: fn(&RodSection) -> Vector3<f64>| {
                let [a, b, c, d] = all.map(of);
                ((a - b) * 8.0 - (c - d)) / (12.0 * step)
            };
            let [a, b, c, d] = all.map(|section| section.strain);
            let strain = ((a - b) * 8.0 - (c - d)) / (12.0 * step);
            let [a, b, c, d] = all.map(|section| section.directors);
            let turned = here[i].directors.tr_mul(&((a - b) * 8.0 - (c - d))) / (12.0 * step);
            let spin = Vector3::new(
                turned[(2, 1)] - turned[(1, 2)],
                turned[(0, 2)] - turned[(2, 0)],
                turned[(1, 0)] - turned[(0, 1)],
            ) * 0.5;
            Swept {
                velocity: rate(|section| section.position),
                force: rate(|section| section.force),
                spin,
                strain,
            }
        });
        Ok(each.collect())
    }
}

/// Inertia and friction of a motion z of a rod, paired with a motion y.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Resistance {
    /// y^T N z, by the mass of the rod.
    pub mass: f64,
    /// y^T R z by a friction in proportion to the stiffness, per Kelvin-Voigt time.
    pub proportional: f64,
    /// y^T R z by the friction of the law.
    pub friction: f64,
}

/// Inertia and friction of motions z and y of the rod, from its present state; y = z by default. If there is a free
/// spin about `chord` (a point and a direction), its angular momentum is zero.
///
/// # Errors
/// Those of the sweeps; strains outside the section law; a rod that is not resolved.
pub fn resistance(
    massive: &Massive,
    z: &Sweep,
    y: Option<&Sweep>,
    chord: Option<&[Vector3<f64>; 2]>,
) -> Result<Resistance> {
    let outside = || Error::domain("the strains of the rod are outside its section law");
    let law = &massive.law;
    let breaks = law.breaks();
    let mut nodes = FIRST;
    let mut last = [f64::INFINITY; 2];
    while nodes <= MOST {
        let grid = Grid::new(&breaks, &vec![nodes; breaks.len() + 1]);
        let places = grid.nodes();
        let here = (z.way)(0.0, places)?;
        let along = z.rates(&here, places)?;
        let against = y.map(|y| y.rates(&here, places)).transpose()?;
        let against = against.as_ref().unwrap_or(&along);
        let kinetic = |s: f64, a: &Swept, b: &Swept| {
            let (mass, rotary) = massive.inertia_at(s);
            mass * a.velocity.dot(&b.velocity) + a.spin.dot(&rotary.component_mul(&b.spin))
        };
        // Pairs (y, z), (y, spin), (spin, z), (spin, spin).
        let mut masses = [0.0; 4];
        let [mut proportional, mut friction] = [0.0; 2];
        for (i, (s, weight)) in places.iter().zip(grid.weights()).enumerate() {
            let (y, z) = (&against[i], &along[i]);
            let section = law.stiffness(*s, &here[i].strain, &Strain::zeros());
            let section = section.ok_or_else(outside)?;
            let weighted = y.strain * (weight * law.length());
            proportional += weighted.dot(&(section.by_strain * z.strain));
            friction += weighted.dot(&(section.by_rate * z.strain));
            let spun = chord.map_or_else(Swept::default, |[place, along]| Swept {
                velocity: along.cross(&(here[i].position - place)),
                spin: here[i].directors.tr_mul(along),
                ..Swept::default()
            });
            let pairs = [(y, z), (y, &spun), (&spun, z), (&spun, &spun)];
            for (sum, (a, b)) in masses.iter_mut().zip(pairs) {
                *sum += weight * kinetic(*s, a, b);
            }
        }
        let spinning = if masses[3] > IDLE * masses[0].abs() {
            masses[1] * masses[2] / masses[3]
        } else {
            0.0
        };
        let found = [masses[0] - spinning, proportional];
        let alike = |k: usize| (found[k] - last[k]).abs() <= DIFFERENCES * found[k].abs();
        if alike(0) && alike(1) {
            return Ok(Resistance {
                mass: found[0],
                proportional,
                friction,
            });
        }
        last = found;
        nodes = more(nodes);
    }
    Err(Error::ill_conditioned(
        "the motion of the rod is not resolved",
    ))
}

/// Rates of a section in a motion: velocity and rate of the force in the frame of the sections, spin and strain rates
/// along the section's directors.
#[derive(Debug, Clone, Copy, Default)]
struct Swept {
    velocity: Vector3<f64>,
    spin: Vector3<f64>,
    strain: Strain,
    force: Vector3<f64>,
}

impl Swept {
    /// Distance of two rates: sum of the differences of velocity, spin and strain rate.
    fn off(&self, other: &Self) -> f64 {
        let [a, b] = [self.velocity - other.velocity, self.spin - other.spin];
        a.norm() + b.norm() + (self.strain - other.strain).norm()
    }
}

/// Normal form of the rod's present fold, for the attachments' motion in `point` (theory 2.8, 3.9). With it the
/// Kelvin-Voigt time that is equivalent to the friction of the law there, along the critical direction.
///
/// # Errors
/// As [`Link::fold`] and [`resistance`].
pub fn fold_form(
    massive: &Massive,
    link: &Link,
    q: &Wrench,
    point: &LinkPoint,
) -> Result<(FoldNormalForm, f64)> {
    let fold = link.fold(q, point, ALONG)?;
    let seen = link.with_base_rotation(&point.base.pose.rotation);
    let (held, length) = (point.held(), link.rod().length());
    let chord = point.end.pose.translation.vector;
    let pins = link.is_pinned();
    let along = |far: f64, at: &[f64]| {
        let at = at.iter().map(|s| s * length);
        let at: Vec<f64> = at.chain(pins.then_some(length)).collect();
        let mut sections = seen.shape(&(fold.at + fold.along * far), &held, &at, ALONG)?;
        // The base between two ball joints turns with the chord.
        if pins
            && let Some(end) = sections.pop()
            && let Some(turn) = Rotation3::rotation_between(&end.position, &chord)
        {
            for section in &mut sections {
                section.position = turn * section.position;
                section.couple = turn * section.couple;
                section.force = turn * section.force;
                section.directors = turn.matrix() * section.directors;
            }
        }
        Ok(sections)
    };
    let along = Sweep::new(&along, 1.0 + fold.at.norm())?;
    let ends = pins.then(|| [Vector3::zeros(), chord.normalize()]);
    let against = resistance(massive, &along, None, ends.as_ref())?;
    let form = FoldNormalForm {
        drive: fold.drive,
        bend: fold.bend,
        mass: against.mass / massive.sections.mass,
        // Per Kelvin-Voigt time.
        friction: against.proportional,
        ahead: 0.0,
    };
    Ok((form, against.friction / against.proportional))
}

/// True if the squares of the slowest frequencies agree; next to a fold, where the first vanishes, relative to the
/// second.
fn alike(a: &[f64], b: &[f64]) -> bool {
    let ([a, ..], [b, rest @ ..]) = (a, b) else {
        return false;
    };
    let size = rest.first().map_or(0.0, |second| FOLDED * second.abs());
    (a - b).abs() <= CONVERGED * b.abs().max(size)
}

/// Vibrations at these nodes, and the residual of the balance.
fn at_nodes(
    given: &RodDescription,
    grid: Grid,
    strains: &[Strain],
    end: &Vector6<f64>,
    joints: [Joint; 2],
    count: usize,
) -> Result<(Vec<HeldMode>, f64)> {
    let outside = || Error::domain("the strains of the held rod are outside its section law");
    let rod = HeavyRod::new(given.clone(), grid)?;
    let m = rod.size();
    let still = vec![0.0; m];
    let at = rod
        .moving(&rod.coordinates(strains), &still)
        .ok_or_else(outside)?;
    let held = RodSupport {
        end: *end,
        ..RodSupport::default()
    };
    let balance = rod
        .balance_held(0.0, &at, &still, &held)
        .ok_or_else(outside)?;
    let weights = rod.norm_weights();
    let left = balance.residual.component_mul(&weights).norm();
    let found = rod.derivatives(0.0, &at, &balance).ok_or_else(outside)?;
    // The base is fixed, or turns on its ball joint.
    let free = if joints[0].turns() { m + 3 } else { m };
    let scale = DVector::from_fn(free, |i, _| if i < m { weights[i] } else { 1.0 });
    let scaled = |matrix: &DMatrix<f64>| {
        DMatrix::from_fn(free, free, |i, j| matrix[(i, j)] * scale[i] * scale[j])
    };
    let stiffness = scaled(&found.by_strain);
    let mass = scaled(&found.mass);
    let mut section = DMatrix::zeros(found.mass.nrows(), found.mass.nrows());
    let mut friction = section.clone();
    rod.add_section(&at, &mut section, &mut friction)
        .ok_or_else(outside)?;
    let [section, friction] = [scaled(&section), scaled(&friction)];
    let motions = &found.end[2];
    let mut prevented: Vec<DVector<f64>> = joints[1]
        .held()
        .map(|k| DVector::from_fn(free, |i, _| motions[(k, i)] * scale[i]))
        .collect();
    if joints[0].turns() {
        let chord = at.shape.end().translation.vector.normalize();
        let spin = DVector::from_fn(free, |i, _| if i < m { 0.0 } else { chord[i - m] });
        let momentum = &mass * &spin;
        let spins = momentum.dot(&spin) > IDLE * given.mass;
        prevented.push(if spins { momentum.normalize() } else { spin });
    }
    let basis = complement(&prevented);
    let reduced = |matrix: &DMatrix<f64>| basis.transpose() * matrix * &basis;
    let [stiffness, mass, section, friction] =
        [&stiffness, &mass, &section, &friction].map(reduced);
    let modes = slowest([&stiffness, &friction, &mass], count)?;
    let modes = modes.iter().map(|mode| HeldMode {
        square: mode.square,
        decay: mode.decay,
        proportional: 0.5 * mode.shape.dot(&(&section * &mode.shape)),
    });
    Ok((modes.collect(), left))
}

/// An orthonormal basis of the orthogonal complement of these vectors.
fn complement(prevented: &[DVector<f64>]) -> DMatrix<f64> {
    let rows = DMatrix::from_columns(prevented);
    let n = rows.nrows();
    let svd = rows.svd(true, false);
    let largest = svd.singular_values.amax();
    let directions = svd.u.unwrap_or_default();
    let kept: Vec<usize> = (0..directions.ncols())
        .filter(|k| svd.singular_values[*k] > IDLE * largest)
        .collect();
    let count = kept.len();
    // Householder's reflections applied to the remaining unit vectors.
    let mut basis = DMatrix::identity(n, n);
    directions.select_columns(&kept).qr().q_tr_mul(&mut basis);
    basis.rows(count, n - count).transpose()
}
