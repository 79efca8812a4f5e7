//! Small motions of a point mass on a planar elastica: M = m, K in closed form.

use super::found::{Coordinates, FoundMode, FoundMotions};
use super::{INTERVALS, NUDGE, RelaxationRates, SmallMotions, Station, ToSceneUnits};
use crate::elastica::chart::ChartPoint;
use crate::elastica::stiffness::{
    EndStiffness, force_by_chart, straight_index, transverse_stiffness,
};
use crate::elastica::straight_beam::EULER;
use crate::elastica::{Equilibrium, equilibrium_under_load, folds};
use crate::error::Result;
use crate::math::small_sort::sort_eigenvalues;
use crate::motion::viscoelastic::small_in_plane;
use crate::scene::{ElasticPlane, InitialShape, MotionModel, Scene, Straight, StrainName};
use crate::study::neglected_mass::PlanarRodMass;
use crate::viscoelastic::material::Material;
use nalgebra::{Complex, Matrix3, Vector1, Vector2, Vector3, Vector6};

/// Load across the rod, relative to the load and EI/L^2, below which it counts as zero. A deflection y changes the
/// frequency by about y^2 and makes the rod 1/y^2 as stiff in its own direction.
const ACROSS: f64 = 1e-6;
/// Bound of 1 - x for a slightly bent rod, and relative deviation of its squared transverse frequency from that of
/// the straight rod.
const SLIGHT: f64 = 1e-10;
const ALIKE: f64 = 1e-3;
/// Relative rotation of the load towards the side to which an imperfect rod is to buckle.
const TURNED: f64 = 1e-9;
/// Newton steps at most.
const STEPS: usize = 8;

/// Small motions of a planar scene on a fixed clamp; `creeping` is the same scene with the friction of the rod.
pub(super) fn modes(scene: &Scene, creeping: &Scene) -> Result<(SmallMotions, bool)> {
    let (scales, plain) = (scene.scales()?, scene.dimensionless()?);
    // The straight rod is a possible start under any load.
    let mut straight = scene.clone();
    (straight.start.place, straight.start.imperfection) = (
        InitialShape::Rest {
            rest: Straight::Straight,
        },
        0.0,
    );
    let model = ElasticPlane::new(&straight)?;
    let load = model.body.load(0.0);
    let start = match scene.start.place {
        // Curvatures of a rod with friction are no equilibrium.
        InitialShape::Curvature { .. } => None,
        _ => Some(ElasticPlane::new(scene)?.start).filter(|at| balanced(at.as_ref(), &load)),
    };
    let of_start = start.is_some();
    let at = match start {
        Some(at) => at,
        None => {
            // A column buckles to the side of its imperfection.
            let side = scene.start.imperfection;
            let aside = Vector2::new(-load.y, load.x) * (-side.signum() * TURNED);
            let turned = load + aside;
            let load = match (is_along(&load), load.x < -EULER) {
                (true, false) => Vector2::new(load.x, 0.0),
                (true, true) if side != 0.0 => turned,
                _ => load,
            };
            equilibrium_under_load(&load).map_err(|why| {
                why.context("[start] is no equilibrium under the loads at t = 0, and of theirs")
            })?
        }
    };
    let at = at.map(|at| polished(at, &load));
    let mut clamp = model.clamp(0.0).pose();
    clamp.translation.vector *= scales.length;
    let outward = ToSceneUnits {
        clamp,
        scales: &scales,
    };
    let (index, rigid, rod, found) = match &at {
        None => straight_rod(load.x),
        Some(at) if at.one_minus_x < SLIGHT => slightly_bent(at),
        Some(at) => bent(at)?,
    };
    let drag = plain.loads.drag;
    let damped = match creeping.rod.damping {
        None => None,
        Some(_) => {
            let law = creeping.viscoelastic()?.law_in_units(scales.measures());
            let material = Material::new(law, [StrainName::U1 as usize])?;
            let strains = |places: &[f64]| -> Result<Vec<_>> {
                let strain = |s: &f64| match &at {
                    None => Ok(Vector1::zeros()),
                    Some(at) => at
                        .section(*s)
                        .map(|section| Vector1::new(section.curvature)),
                };
                places.iter().map(strain).collect()
            };
            Some(small_in_plane(material, &model.body, &strains)?)
        }
    };
    let motions = FoundMotions {
        coordinates: Coordinates::in_plane(),
        index,
        conservative: true,
        followed: false,
        held_stable: true,
        neutral: 0.0,
        rigid,
        change: 0.0,
        creep: damped
            .as_ref()
            .map(|damped| RelaxationRates::new(damped, &scales)),
        eigenvalues: match damped {
            Some(damped) => Some(damped.rates.body),
            None => (drag > 0.0).then(|| {
                let pairs = found.iter().flat_map(|mode| roots(drag, mode.square));
                let mut all: Vec<_> = pairs.collect();
                sort_eigenvalues(&mut all);
                all
            }),
        },
        modes: found,
        rods: vec![rod],
    };
    let mut motions = motions.described(&outward);
    let light = PlanarRodMass::new(creeping, &scales, load)?.filter(|_| motions.stable);
    motions.mass = light.map(|light| light.about(at.as_ref()));
    Ok((motions, of_start))
}

/// True if the load holds the rod straight, up to a deflection without effect on the frequencies.
fn is_along(load: &Vector2<f64>) -> bool {
    load.y.abs() <= ACROSS * (1.0 + load.norm())
}

/// True if the rod's force on the body balances the load.
fn balanced(at: Option<&Equilibrium>, load: &Vector2<f64>) -> bool {
    match at {
        None => is_along(load),
        Some(at) => {
            let force = Vector2::from(at.force);
            (force + load).norm() <= super::BALANCED * (force.norm() + load.norm())
        }
    }
}

/// Newton's method for the force: improves an approximate equilibrium under this load.
fn polished(mut at: Equilibrium, load: &Vector2<f64>) -> Equilibrium {
    let left = |at: &Equilibrium| Vector2::from(at.force) + load;
    for _ in 0..STEPS {
        let jacobian = force_by_chart(&ChartPoint::new(at.p, at.w));
        let Some(step) = jacobian.try_inverse().map(|inverse| inverse * left(&at)) else {
            break;
        };
        match Equilibrium::new(at.p - step.x, at.w - step.y) {
            Ok(next) if left(&next).norm() < left(&at).norm() => at = next,
            _ => break,
        }
    }
    at
}

/// Index, rigid directions, shape and modes.
type ModesAboutEquilibrium = (usize, usize, Vec<Station>, Vec<FoundMode>);

/// Modes of the straight rod under a pull: free transversally, rigid axially.
fn straight_rod(pull: f64) -> ModesAboutEquilibrium {
    let bent_by = |y: f64| -> Vec<Station> {
        let at = (0..=INTERVALS).map(fraction);
        at.map(|s| station(s, y * deflection(pull, s))).collect()
    };
    let found = FoundMode {
        square: transverse_stiffness(pull),
        twists: vec![shifted(&Vector2::y())],
        rods: [vec![bent_by(0.0)], vec![bent_by(1.0)]],
        apart: 1.0,
    };
    (straight_index(pull), 1, bent_by(0.0), vec![found])
}

/// Modes of a slightly bent rod. Its axial stiffness leaves no digits for the transverse frequency, which equals the
/// straight rod's up to 1 - x. A rod straight to rounding counts as straight.
fn slightly_bent(at: &Equilibrium) -> ModesAboutEquilibrium {
    let pull = -at.force[0];
    let Ok((index, rigid, rods, mut found)) = bent(at) else {
        return straight_rod(pull);
    };
    let wanted = transverse_stiffness(pull);
    for mode in &mut found {
        if (mode.square - wanted).abs() <= ALIKE * wanted.abs() {
            mode.square = wanted;
        }
    }
    (index, rigid, rods, found)
}

fn bent(at: &Equilibrium) -> Result<ModesAboutEquilibrium> {
    let stiffness = EndStiffness::at(at.p, at.w)?;
    let mut found = Vec::new();
    for (square, shape) in stiffness.principal() {
        let dq = stiffness.chart * shape;
        let step = NUDGE * (1.0f64).min(at.w) / dq.norm();
        let moved = |by: f64| {
            let q = Vector2::new(at.p, at.w) + dq * by;
            Equilibrium::new(q.x, q.y).and_then(|at| Ok(vec![stations(&at)?]))
        };
        found.push(FoundMode {
            square,
            twists: vec![shifted(&shape)],
            rods: [moved(-step)?, moved(step)?],
            apart: 2.0 * step,
        });
    }
    let negative = found.iter().filter(|mode| mode.square < 0.0).count();
    let index = folds::index(at.p, at.w)? + negative;
    Ok((index, 0, stations(at)?, found))
}

/// Twist of a point.
fn shifted(by: &Vector2<f64>) -> Vector6<f64> {
    Vector6::new(0.0, 0.0, 0.0, by.x, by.y, 0.0)
}

fn fraction(i: usize) -> f64 {
    i as f64 / INTERVALS as f64
}

fn station(x: f64, y: f64) -> Station {
    Station {
        position: Vector3::new(x, y, 0.0),
        directors: Matrix3::zeros(),
    }
}

fn stations(at: &Equilibrium) -> Result<Vec<Station>> {
    let one = |i: usize| {
        let section = at.section(fraction(i))?;
        Ok(station(section.x, section.y))
    };
    (0..=INTERVALS).map(one).collect()
}

/// Deflection of the straight rod under the pull N for unit deflection of the end: the beam y'''' = N y'' with a
/// transverse end force.
fn deflection(pull: f64, s: f64) -> f64 {
    let b = pull.abs().sqrt();
    if b < 1e-2 {
        return 0.5 * s * s * (3.0 - s);
    }
    let shape = |s: f64| {
        if pull > 0.0 {
            let sinh = |x: f64| (x - b).exp() - (-x - b).exp();
            s - (sinh(b) - sinh(b * (1.0 - s))) / (b * (1.0 + (-2.0 * b).exp()))
        } else {
            b * s * b.cos() - b.sin() + (b * (1.0 - s)).sin()
        }
    };
    shape(s) / shape(1.0)
}

/// Roots s of s^2 + drag s + square = 0 with Im s >= 0.
fn roots(drag: f64, square: f64) -> Vec<Complex<f64>> {
    let half = 0.5 * drag;
    let inner = half * half - square;
    if inner < 0.0 {
        return vec![Complex::new(-half, (-inner).sqrt())];
    }
    // The smaller root by the product of both, against cancellation.
    let large = -half - inner.sqrt();
    vec![
        Complex::from(large),
        Complex::from(if large == 0.0 { 0.0 } else { square / large }),
    ]
}
