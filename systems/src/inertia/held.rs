//! The vibrations of a rod of small mass while its ends are held where they are (theory 2.9, 3.9).
//!
//! About an equilibrium of the light rod, with the strains q at the nodes as coordinates, K the stiffness under the wrench that holds the end
//! (and a dead load along the rod), M = J^T N J and E the motions of the end that its attachment prevents,
//! ```text
//! K x = omega^2 M x,     E x = 0.
//! ```
//! At a weld E are turns and moves of the end, at a ball joint its moves. A rod between two ball joints turns about its base too, and has no
//! momentum of spin about its chord, since nothing holds that.

use super::frames::Curve;
use super::law::Law;
use super::rod::{Given, HeavyRod, Held};
use super::statics::slowest;
use crate::assembly::{Joint, Link, LinkPoint};
use crate::body::Body;
use crate::creep::grid::{Grid, more};
use crate::elastica::Passage;
use crate::error::{Error, Result};
use crate::math::se3::{halves, joined};
use crate::rod::{Rod, SectionMass, Wrench};
use crate::section::Strain;
use crate::section::rate::RateLaw;
use nalgebra::{DMatrix, DVector, Matrix3, Vector6};
use std::sync::Arc;

/// A rod whose mass is known: its section law, with the strains that can change and its friction if it has any, and its mass.
#[derive(Debug, Clone)]
pub struct Massive {
    /// The law, along the rod.
    law: Law,
    /// Its mass, and the inertia of its sections; 0 where they turn at no cost.
    pub sections: SectionMass,
}

/// A vibration of a rod whose ends are held.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct HeldMode {
    /// The square of its angular frequency; negative where the held rod is unstable.
    pub square: f64,
    /// The rate at which the friction of the law makes its amplitude decay; 0 without friction.
    pub decay: f64,
    /// That rate by a friction proportional to the stiffness, per Kelvin-Voigt time.
    pub proportional: f64,
}

/// Nodes of an element to begin with, coordinates beyond which no more are taken, and the relative change of the slowest vibration at which
/// there are enough.
const FIRST: usize = 12;
const MOST: usize = 300;
const CONVERGED: f64 = 1e-9;
/// The slowest frequency counts as none where its square is below this part of the next one's.
const FOLDED: f64 = 1e-3;
/// Tolerance of the shape.
const ALONG: f64 = 1e-13;
/// The step of derivatives along a chart, relative to 1 + its point.
const ASIDE: f64 = 1e-3;
/// Motions of the end smaller than this part of the largest are none: a straight rod without stretch does not move along itself.
const IDLE: f64 = 1e-10;
/// What the strains leave of a balance is that of no equilibrium, relative to 1 and the wrench.
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
        let active: Vec<usize> = (0..6).filter(|k| *k < 3 || !rigid[*k - 3]).collect();
        Ok(Self {
            law: Law::new(elastic, friction, &active)?.along(rod.length()),
            sections,
        })
    }
}

impl HeldMode {
    /// The angular frequency; None of an unstable rod.
    pub fn frequency(&self) -> Option<f64> {
        (self.square > 0.0).then(|| self.square.sqrt())
    }
}

/// The `count` slowest vibrations, by rising square of the frequency, of the rod `massive` that is in equilibrium between its attachments as
/// `link` under the chart point `q` at `point`. The slowest is resolved to 1e-9, relative.
///
/// # Errors
/// As [`Link::shape`]; a chart point that is none of this section law; a rod that is not resolved.
pub fn held_modes(
    massive: &Massive,
    (link, q, point): (&Link, &Wrench, &LinkPoint),
    count: usize,
) -> Result<Vec<HeldMode>> {
    let back = point.base.pose.rotation.inverse();
    let rotary = massive.sections.rotary;
    let given = Given {
        law: massive.law.clone(),
        curve: Curve::Space,
        mass: massive.sections.mass,
        rotary: (rotary.norm() > 0.0).then(|| Matrix3::from_diagonal(&rotary)),
        grain: Body::new(1.0)?,
        distributed: link.distributed().map(|load| load.mapped(|f| back * f)),
        body: None,
        diameter: None,
    };
    let [_, on_tip] = point.wrenches();
    let (couple, force) = halves(&on_tip);
    let end = -joined(&(back * couple), &(back * force));
    let breaks = given.breaks();
    let mut nodes = FIRST;
    let mut last: Option<Vec<f64>> = None;
    loop {
        let grid = Grid::new(&breaks, &vec![nodes; breaks.len() + 1]);
        let size = grid.len() * given.law.active().len();
        let strains = strains((link, q, point), grid.nodes())?;
        let (found, left) = at_nodes(&given, grid, &strains, (&end, link.joint()), count)?;
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

/// The strains at places in [0, 1], in growing order.
fn strains((link, q, point): (&Link, &Wrench, &LinkPoint), places: &[f64]) -> Result<Vec<Strain>> {
    let seen = link.facing(&point.base.pose.rotation);
    let length = link.rod().length();
    let at: Vec<f64> = places.iter().map(|s| s * length).collect();
    let sections = seen.shape(q, &point.held(), &at, ALONG)?;
    Ok(sections.iter().map(|section| section.strain).collect())
}

/// (M0, D0) of a motion of the rod along its equilibria, its chart point changing at the rate `z` and its base standing: twice its kinetic energy,
/// per unit of its mass, and the power that friction in proportion to the stiffness takes, per Kelvin-Voigt time. Whatever the end does is
/// allowed, so that it serves at folds of held and of free ends.
///
/// # Errors
/// As [`Link::shape`]; a chart point that is none of this section law; a rod that is not resolved.
pub fn resistance(
    massive: &Massive,
    (link, q, point): (&Link, &Wrench, &LinkPoint),
    z: &Wrench,
) -> Result<[f64; 2]> {
    let outside = || Error::domain("the strains of the rod are outside its section law");
    let standing = [(Vector6::zeros(), *z)];
    let mass = link
        .metric(&massive.sections, (q, point), &standing, ALONG)
        .ok_or_else(outside)?[(0, 0)];
    let step = ASIDE * (1.0 + q.norm()) / z.norm();
    let breaks = massive.law.breaks();
    let mut nodes = FIRST;
    let mut last = f64::INFINITY;
    while nodes <= MOST {
        let grid = Grid::new(&breaks, &vec![nodes; breaks.len() + 1]);
        let at = |part: f64| strains((link, &(q + z * (part * step)), point), grid.nodes());
        let [here, after, before, far, back] = [0.0, 1.0, -1.0, 2.0, -2.0].map(at);
        let (here, after, before, far, back) = (here?, after?, before?, far?, back?);
        let mut friction = 0.0;
        for (i, (s, weight)) in grid.nodes().iter().zip(grid.weights()).enumerate() {
            let rate = ((after[i] - before[i]) * 8.0 - (far[i] - back[i])) / (12.0 * step);
            let section = massive.law.stiffness(*s, &here[i], &Strain::zeros());
            let section = section.ok_or_else(outside)?;
            friction += weight * rate.dot(&(section.by_strain * rate));
        }
        if (friction - last).abs() <= CONVERGED * friction {
            return Ok([mass / massive.sections.mass, friction]);
        }
        last = friction;
        nodes = more(nodes);
    }
    Err(Error::ill_conditioned(
        "the strains of the rod are not resolved",
    ))
}

/// The normal form of the fold that the rod is at, its attachments moving as `point` says (theory 2.8, 3.9), and the Kelvin-Voigt time whose
/// friction is that of its law there. At a fold the slowest vibration is the critical shape: K z = 0, and its decay is z^T R z/(2 z^T N z).
///
/// # Errors
/// As [`held_modes`]; a fold without a normal form ([`Link::normal_form`]).
pub fn fold_form(
    massive: &Massive,
    (link, q, point): (&Link, &Wrench, &LinkPoint),
) -> Result<(Passage, f64)> {
    let sections = &massive.sections;
    let [drive, bend, mass] = link
        .normal_form(sections, (q, point), ALONG)
        .ok_or_else(|| Error::domain("the fold has no normal form"))?;
    let modes = held_modes(massive, (link, q, point), 2)?;
    let critical = modes
        .iter()
        .min_by(|a, b| a.square.abs().total_cmp(&b.square.abs()))
        .ok_or_else(|| Error::domain("the rod has no strain that can change"))?;
    let mass = mass / sections.mass;
    let form = Passage {
        drive,
        bend,
        mass,
        // Friction in proportion to the stiffness, per Kelvin-Voigt time.
        friction: 2.0 * critical.proportional * mass * sections.mass,
        ahead: 0.0,
    };
    Ok((form, critical.decay / critical.proportional))
}

/// True if the squares of the slowest frequencies are the same; next to a fold, where the first has none, relative to the second.
fn alike(a: &[f64], b: &[f64]) -> bool {
    let ([a, ..], [b, rest @ ..]) = (a, b) else {
        return false;
    };
    let size = rest.first().map_or(0.0, |second| FOLDED * second.abs());
    (a - b).abs() <= CONVERGED * b.abs().max(size)
}

/// The vibrations at these nodes, and what is left of the balance.
fn at_nodes(
    given: &Given,
    grid: Grid,
    strains: &[Strain],
    (end, joint): (&Vector6<f64>, Joint),
    count: usize,
) -> Result<(Vec<HeldMode>, f64)> {
    let outside = || Error::domain("the strains of the held rod are outside its section law");
    let rod = HeavyRod::new(given.clone(), grid)?;
    let m = rod.size();
    let still = vec![0.0; m];
    let at = rod
        .moving(&rod.coordinates(strains), &still)
        .ok_or_else(outside)?;
    let held = Held {
        end: *end,
        ..Held::default()
    };
    let balance = rod
        .balance_held(0.0, &at, &still, &held)
        .ok_or_else(outside)?;
    let weights = rod.norm_weights();
    let left = balance.residual.component_mul(&weights).norm();
    let found = rod.derivatives(0.0, &at, &balance).ok_or_else(outside)?;
    // The base stands, or turns on its ball joint.
    let (free, first) = match joint {
        Joint::Weld => (m, 0),
        Joint::Ball => (m, 3),
        Joint::Pins => (m + 3, 3),
    };
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
    let mut prevented: Vec<DVector<f64>> = (first..6)
        .map(|k| DVector::from_fn(free, |i, _| motions[(k, i)] * scale[i]))
        .collect();
    if joint == Joint::Pins {
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

/// An orthonormal basis of what is orthogonal to these vectors.
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
