//! Rods with mass against independent solutions (tests/data/mass): frequencies and full motions.

use crate::heavy_assemblies::{alone, energy, moving};
use crate::support::{decimal, mass_data, worst};
use nalgebra::{DVector, Matrix3, Matrix6, Vector3, Vector6};
use serde_json::Value;
use snaprod::body::{Mass, PointMass, RigidBody};
use snaprod::full_mass::assembly::{HeavyAssembly, INTEGRALS};
use snaprod::full_mass::frames::Curve;
use snaprod::full_mass::law::Law;
use snaprod::full_mass::rod::{HeavyRod, RodDescription};
use snaprod::rod::DistributedLoad;
use snaprod::section::Linear;
use snaprod::section::rate::{KelvinVoigt, Maxwell, RateLaw, Viscosity};
use snaprod::solve::integrator::{Integrator, Method};
use snaprod::solve::system::{Factor, Linearised, System};
use snaprod::viscoelastic::grid::Grid;
use std::sync::Arc;

fn numbers(value: &Value) -> Vec<f64> {
    value.as_array().unwrap().iter().map(decimal).collect()
}

/// A planar rod of unit length, stiffness and body mass.
fn planar(mass: f64, eta: f64, gravity: Vector3<f64>, body: Mass) -> RodDescription {
    let elastic = Arc::new(Linear::diagonal([1.0; 2], 1.0).unwrap());
    let friction = (eta > 0.0).then(|| {
        let law: Arc<dyn RateLaw> =
            Arc::new(KelvinVoigt::proportional(elastic.clone(), eta).unwrap());
        law
    });
    RodDescription {
        law: Law::new(elastic, friction, &[0]).unwrap(),
        curve: Curve::Plane,
        mass,
        rotary: None,
        along: None,
        grain: PointMass::new(1.0).unwrap().with_gravity(gravity).unwrap(),
        distributed: None,
        turning: None,
        body: Some(body),
        diameter: None,
    }
}

/// The body of a case of the file, with its offset along the tangent and a load at its centre.
fn body(case: &Value, gravity: Vector3<f64>, force: Vector3<f64>) -> Mass {
    let [offset, inertia] = ["offset", "rotary_inertia"].map(|name| decimal(&case[name]));
    if offset == 0.0 && inertia == 0.0 {
        let point = PointMass::new(1.0).unwrap().with_gravity(gravity).unwrap();
        return Mass::Point(point.with_dead_force(force).unwrap());
    }
    let rigid = RigidBody::new(1.0, Matrix3::from_diagonal_element(inertia)).unwrap();
    let rigid = rigid.with_centre(Vector3::z() * offset).unwrap();
    let rigid = rigid.with_gravity(gravity).unwrap();
    Mass::Rigid(rigid.with_dead_force(force).unwrap())
}

fn frequencies(rod: &HeavyAssembly, y: &DVector<f64>) -> Vec<f64> {
    let found = rod.vibrations(y, 4).unwrap();
    found.iter().map(|mode| mode.square.sqrt()).collect()
}

/// Catches a wrong mass matrix, and a body without its offset or rotary inertia: closed forms of the beam.
#[test]
fn straight_frequencies() {
    for case in mass_data("frequencies")["straight"].as_array().unwrap() {
        let none = Vector3::zeros();
        let given = planar(
            decimal(&case["rod_mass"]),
            0.0,
            none,
            body(case, none, none),
        );
        let rod = alone(given, 20);
        let found = frequencies(&rod, &still(&rod, |_| 0.0));
        for (found, wanted) in found.iter().zip(numbers(&case["omega"])) {
            assert!((found / wanted - 1.0).abs() < 1e-9, "{found} {wanted}");
        }
    }
}

/// Catches a stiffness without the load, and a weight without the rod's: frequencies about bent equilibria.
#[test]
fn bent_frequencies() {
    for case in mass_data("frequencies")["bent"].as_array().unwrap() {
        let vector = |name: &str| {
            let v = numbers(&case[name]);
            Vector3::new(v[0], v[1], 0.0)
        };
        let (gravity, force) = (vector("gravity"), vector("dead_force_at_centroid"));
        let mass = decimal(&case["rod_mass"]);
        let given = planar(mass, 0.0, gravity, body(case, gravity, force));
        let rod = alone(given, 28);
        // Start on the side to which the load bends the rod.
        let y = rod.settled(&still(&rod, |_| -0.5)).unwrap();
        let weights = rod.links[0].rod.sections.grid.weights();
        let pairs = rod.strains(&y, 0).iter().zip(weights);
        let turned: f64 = pairs.map(|(u, w)| u * w).sum();
        assert!(
            (turned - decimal(&case["theta_tip"])).abs() < 1e-10,
            "{turned}"
        );
        for (found, wanted) in frequencies(&rod, &y).iter().zip(numbers(&case["omega"])) {
            assert!((found / wanted - 1.0).abs() < 1e-8, "{found} {wanted}");
        }
    }
}

/// Catches any wrong term of the linearisation that Newton's iteration runs on, in the plane and in space with every
/// strain, rotary inertia, an offset body and a turning clamp.
#[test]
fn derivatives_are_those_of_the_balance() {
    let gravity = Vector3::new(0.3, -0.7, 0.2);
    let point = || Mass::Point(PointMass::new(1.0).unwrap().with_gravity(gravity).unwrap());
    let mut rods = vec![planar(0.1, 0.05, gravity, point())];
    let elastic = Linear::diagonal([1.0, 1.3], 0.8).unwrap();
    let elastic = elastic
        .with_shear([40.0, 50.0])
        .unwrap()
        .with_axial(90.0)
        .unwrap();
    let elastic = Arc::new(elastic);
    let friction: Arc<dyn RateLaw> =
        Arc::new(KelvinVoigt::proportional(elastic.clone(), 0.02).unwrap());
    let support =
        snaprod::body::Support::<3>::new(Vector3::zeros(), &nalgebra::UnitQuaternion::identity())
            .unwrap()
            .with_turning(
                &Vector3::new(0.2, 1.0, -0.4),
                snaprod::body::History::sine(0.4, 2.0, 0.3),
            )
            .unwrap();
    let weld = RigidBody::new(
        1.0,
        Matrix3::new(0.03, 0.002, 0.0, 0.002, 0.02, 0.001, 0.0, 0.001, 0.04),
    )
    .unwrap();
    let weld = weld.with_centre(Vector3::new(0.02, -0.03, 0.1)).unwrap();
    let weld = weld.with_gravity(gravity).unwrap().with_drag(0.3).unwrap();
    rods.push(RodDescription {
        law: Law::new(elastic, Some(friction), &[0, 1, 2, 3, 4, 5]).unwrap(),
        curve: Curve::Space,
        mass: 0.2,
        rotary: Some(Matrix3::from_diagonal(&Vector3::new(1e-3, 2e-3, 3e-3))),
        along: None,
        grain: PointMass::new(1.0)
            .unwrap()
            .with_gravity(gravity)
            .unwrap()
            .with_support(support.clone()),
        distributed: DistributedLoad::polynomial(vec![
            Vector3::new(0.0, 0.1, 0.0),
            Vector3::new(0.2, 0.0, 0.0),
        ])
        .ok(),
        turning: None,
        body: Some(Mass::Rigid(weld.with_support(support))),
        diameter: None,
    });
    let rods = rods
        .into_iter()
        .flat_map(|given| [(given.clone(), 12), (given, 5)]);
    for (given, nodes) in rods {
        let rod = HeavyRod::new(given, Grid::uniform(nodes)).unwrap();
        let rod = rod.clamped();
        let s = rod.sections.grid.nodes();
        let count = rod.given.law.active().len();
        // Fields that few nodes do not resolve at all.
        let field = |phase: f64, size: f64| -> Vec<f64> {
            let each = |i: usize, k: usize| {
                let size = if k < 3 { size } else { 0.1 * size };
                let rest = if k == 5 && phase == 0.0 { 1.0 } else { 0.0 };
                let size = if nodes < 10 && i.is_multiple_of(2) {
                    -size
                } else {
                    size
                };
                rest + size * (phase + 1.1 * k as f64 + (1.0 + 0.2 * k as f64) * s[i]).sin()
            };
            (0..s.len())
                .flat_map(|i| (0..count).map(move |k| (i, k)))
                .map(|(i, k)| each(i, k))
                .collect()
        };
        let (q, w, a) = (field(0.0, 1.0), field(0.7, 1.5), field(1.9, 3.0));
        let residual = |q: &[f64], w: &[f64], a: &[f64]| {
            let at = rod.moving(q, w).unwrap();
            rod.balance(0.2, &at, a).unwrap().residual
        };
        let at = rod.moving(&q, &w).unwrap();
        let balance = rod.balance(0.2, &at, &a).unwrap();
        let found = rod.derivatives(0.2, &at, &balance).unwrap();
        let step = 1e-4;
        let direction = field(2.6, 1.0);
        let moved = |x: &[f64], h: f64| -> Vec<f64> {
            x.iter().zip(&direction).map(|(x, d)| x + h * d).collect()
        };
        let slope = |f: &dyn Fn(f64) -> DVector<f64>| {
            let near = (f(step) - f(-step)) / (2.0 * step);
            let far = (f(2.0 * step) - f(-2.0 * step)) / (4.0 * step);
            near * (4.0 / 3.0) - far / 3.0
        };
        let direction_vector = DVector::from_column_slice(&direction);
        for (by, matrix) in [
            (
                slope(&|h| residual(&moved(&q, h), &w, &a)),
                &found.by_strain,
            ),
            (slope(&|h| residual(&q, &moved(&w, h), &a)), &found.by_rate),
            (slope(&|h| residual(&q, &w, &moved(&a, h))), &found.mass),
        ] {
            let error = (&by - matrix * &direction_vector).amax();
            assert!(
                error < 1e-9 * (1.0 + by.amax()),
                "{error:e} of {}",
                by.amax()
            );
        }
    }
}

/// Catches a wrong term in the elimination of Maxwell branches for implicit steps. By differences, the solution
/// reproduces the right-hand sides sigma y - y' and those of the balance. At rest as well, where the branches alone
/// differ from other rods.
#[test]
fn implicit_steps_eliminate_the_branches() {
    let elastic = Linear::diagonal([1.0, 1.3], 0.8).unwrap();
    let elastic = elastic.with_shear([40.0, 50.0]).unwrap();
    let elastic = Arc::new(elastic.with_axial(90.0).unwrap());
    let friction = Arc::new(KelvinVoigt::proportional(elastic.clone(), 0.02).unwrap());
    let spring = |part: f64, time: f64| {
        let diagonal = Vector6::new(1.0, 0.7, 0.9, 30.0, 40.0, 60.0) * part;
        let mut modulus = Matrix6::from_diagonal(&diagonal);
        (modulus[(0, 1)], modulus[(1, 0)]) = (0.3 * part, 0.3 * part);
        Maxwell::new(modulus, time).unwrap()
    };
    let law = Law::new(elastic, Some(friction), &[0, 1, 2, 3, 4, 5]).unwrap();
    let given = RodDescription {
        law: law.with_branches(vec![spring(1.0, 0.3), spring(0.5, 0.02)]),
        curve: Curve::Space,
        mass: 0.2,
        rotary: Some(Matrix3::from_diagonal(&Vector3::new(1e-3, 2e-3, 3e-3))),
        along: None,
        grain: PointMass::new(1.0).unwrap(),
        distributed: None,
        turning: None,
        body: Some(Mass::Point(PointMass::new(1.0).unwrap())),
        diameter: None,
    };
    let rod = alone(given, 5);
    let time = rod.time();
    let mut y = still(&rod, |i| f64::from(u8::from(i % 6 == 5)));
    rod.settle(&mut y).unwrap();
    let integral = |i: usize| (time..time + INTEGRALS).contains(&i);
    let along = DVector::from_fn(y.len(), |i, _| {
        if integral(i) {
            0.0
        } else {
            (0.3 + 1.7 * i as f64).sin()
        }
    });
    let at = |h: f64| {
        let mut out = DVector::zeros(y.len());
        System::balance(&rod, &(&y + &along * h), &mut out).unwrap();
        out
    };
    let h = 1e-3;
    let slope = ((at(h) - at(-h)) * 8.0 - (at(2.0 * h) - at(-2.0 * h))) / (12.0 * h);
    let linear = rod.linearised(&y).unwrap();
    for sigma in [0.5, 5.0, 100.0] {
        let mut b = DVector::from_fn(y.len(), |i, _| match i {
            i if integral(i) => 0.0,
            i if i < time => sigma * along[i] - slope[i],
            i => -slope[i],
        });
        assert!(linear.shifted::<f64>(sigma).unwrap().solve(&mut b));
        let off = worst((0..y.len()).map(|i| (b[i] - along[i]).abs()));
        assert!(off < 1e-7 * (1.0 + sigma), "sigma = {sigma}: {off:e}");
    }
}

/// Catches a wrong time scale of strain rates in the shortest wave of the grid on a straight uniform rod, k = pi n/L.
/// By energy a rate corresponds to a strain times 1/omega: omega^2 = K k^4/(mu + J k^2) of bending, K k^2/J of
/// torsion, K k^2/mu of shear and stretch. By response it makes a strain times 1/(omega + omega^2 D/K). The time scale
/// is the root of the product.
#[test]
fn delays_are_those_of_waves_and_of_friction() {
    let (length, mass, nodes) = (2.0, 0.3, 6);
    let stiffness = [1.0, 1.3, 0.8, 40.0, 50.0, 90.0];
    let viscosity = [0.02, 0.05, 0.03, 0.7, 2.0, 0.4];
    let rotary = [1e-3, 2e-3, 3e-3];
    let [k1, k2, k3, k4, k5, k6] = stiffness;
    let elastic = Linear::diagonal([k1, k2], k3).unwrap();
    let elastic = elastic.with_shear([k4, k5]).unwrap();
    let elastic = Arc::new(elastic.with_axial(k6).unwrap());
    let [d1, d2, d3, d4, d5, d6] = viscosity;
    let friction = Viscosity::diagonal([d1, d2], d3).unwrap();
    let friction = friction.with_shear([d4, d5]).unwrap();
    let friction = KelvinVoigt::new(friction.with_axial(d6).unwrap());
    let law = Law::new(elastic, Some(Arc::new(friction)), &[0, 1, 2, 3, 4, 5]).unwrap();
    let given = RodDescription {
        law: law.along(length),
        curve: Curve::Space,
        mass,
        rotary: Some(Matrix3::from_diagonal(&rotary.into())),
        along: None,
        grain: PointMass::new(1.0).unwrap(),
        distributed: None,
        turning: None,
        body: None,
        diameter: None,
    };
    let rod = HeavyRod::new(given, Grid::uniform(nodes)).unwrap();
    let straight: Vec<f64> = (0..rod.size())
        .map(|i| f64::from(u8::from(i % 6 == 5)))
        .collect();
    let at = rod.moving(&straight, &vec![0.0; rod.size()]).unwrap();
    let found = rod.delays(&at).unwrap();
    let k = std::f64::consts::PI * nodes as f64 / length;
    let mu = mass / length;
    for a in 0..6 {
        let square = match a {
            0 | 1 => stiffness[a] * k.powi(4) / (mu + rotary[a] * k * k),
            2 => stiffness[a] * k * k / rotary[a],
            _ => stiffness[a] * k * k / mu,
        };
        let (swing, friction) = (1.0 / square.sqrt(), viscosity[a] / stiffness[a]);
        let expected = [(swing * swing * swing / (swing + friction)).sqrt(), swing];
        for (found, expected) in found.iter().zip(expected) {
            assert!((found[a] / expected - 1.0).abs() < 1e-12, "{a}: {found}");
        }
    }
}

/// State at rest of a single rod with these coordinates.
fn still(rod: &HeavyAssembly, q: impl Fn(usize) -> f64) -> DVector<f64> {
    let size = rod.links[0].rod.size();
    moving(rod, &(0..size).map(q).collect::<Vec<_>>(), &vec![0.0; size])
}

/// Steps a rod with fixed nodes from a state to the time `t`.
fn stepped(rod: &HeavyAssembly, y: DVector<f64>, t: f64, tolerance: f64) -> DVector<f64> {
    let mut steps = Integrator::new(rod, y, tolerance, Method::Auto, None).unwrap();
    while t - steps.state()[rod.time()] > 1e-13 {
        let left = t - steps.state()[rod.time()];
        steps.step(rod, left).unwrap();
    }
    steps.state().clone()
}

/// Catches a wrong kinematic term in space that planar motions hide: the same motion in the plane, whose rotations are
/// an integral, and in space, where they are not.
#[test]
fn a_planar_motion_in_space() {
    let turn = |v: Vector3<f64>| Vector3::new(0.0, -v.y, v.x);
    let inertia = Matrix3::from_diagonal(&Vector3::new(2e-4, 3e-4, 5e-4));
    let gravity = Vector3::new(-0.5, -2.0, 0.0);
    let weld = |gravity: Vector3<f64>| {
        let body = RigidBody::new(1.0, Matrix3::from_diagonal_element(0.02)).unwrap();
        let body = body.with_centre(Vector3::z() * 0.1).unwrap();
        Mass::Rigid(body.with_gravity(gravity).unwrap())
    };
    let flat = RodDescription {
        rotary: Some(inertia),
        along: None,
        ..planar(0.1, 0.03, gravity, weld(gravity))
    };
    let elastic = Arc::new(Linear::diagonal([1.0, 1.4], 0.8).unwrap());
    let friction: Arc<dyn RateLaw> =
        Arc::new(KelvinVoigt::proportional(elastic.clone(), 0.03).unwrap());
    let spatial = RodDescription {
        law: Law::new(elastic, Some(friction), &[0, 1, 2]).unwrap(),
        curve: Curve::Space,
        grain: PointMass::new(1.0)
            .unwrap()
            .with_gravity(turn(gravity))
            .unwrap(),
        body: Some(weld(turn(gravity))),
        ..flat.clone()
    };
    let ends = [flat, spatial].map(|given| {
        let rod = alone(given, 16);
        let count = rod.links[0].rod.given.law.active().len();
        let nodes = rod.links[0].rod.sections.grid.nodes();
        let y = still(&rod, |i| match i % count {
            0 => 1.2 - 0.9 * nodes[i / count],
            _ => 0.0,
        });
        let before = energy(&rod, &y);
        let y = stepped(&rod, y, 0.4, 1e-10);
        assert!((energy(&rod, &y) - before).abs() < 1e-9);
        rod.at(&y).unwrap().rods[0].end().pose.translation.vector
    });
    let error = (turn(ends[0]) - ends[1]).amax();
    assert!(error < 1e-9, "{error:e}");
}

/// Catches velocities that are not those of the poses. Without friction the discrete energy of a rod in space is
/// conserved, however coarse the nodes are for its waves; only the steps change it.
#[test]
fn energy_is_kept_whatever_the_nodes_resolve() {
    let elastic = Linear::diagonal([1.0, 1.3], 0.8).unwrap();
    let elastic = elastic.with_shear([40.0, 50.0]).unwrap();
    let elastic = Arc::new(elastic.with_axial(90.0).unwrap());
    let gravity = Vector3::new(0.3, -0.7, 0.2);
    let weld = RigidBody::new(1.0, Matrix3::from_diagonal_element(0.03)).unwrap();
    let weld = weld.with_centre(Vector3::new(0.02, -0.03, 0.1)).unwrap();
    let given = RodDescription {
        law: Law::new(elastic, None, &[0, 1, 2, 3, 4, 5]).unwrap(),
        curve: Curve::Space,
        mass: 0.2,
        rotary: Some(Matrix3::from_diagonal(&Vector3::new(1e-3, 2e-3, 3e-3))),
        along: None,
        grain: PointMass::new(1.0).unwrap().with_gravity(gravity).unwrap(),
        distributed: None,
        turning: None,
        body: Some(Mass::Rigid(weld.with_gravity(gravity).unwrap())),
        diameter: None,
    };
    let rod = alone(given, 5);
    let field = |size: f64, rest: f64| -> Vec<f64> {
        let each = |i: usize| match i % 6 {
            5 => rest + 0.1 * size * (1.3 * i as f64).sin(),
            _ => size * (0.7 * i as f64).cos(),
        };
        (0..rod.links[0].rod.size()).map(each).collect()
    };
    let y = moving(&rod, &field(0.5, 1.0), &field(0.8, 0.0));
    let had = energy(&rod, &y);
    let y = stepped(&rod, y, 0.2, 1e-11);
    let lost = energy(&rod, &y) - had;
    assert!(lost.abs() < 1e-9 * (1.0 + had.abs()), "{lost:e} of {had}");
}

/// Mass of the round rod.
const MASS: f64 = 0.05;

/// Catches a wrong or missing gyroscopic term: a round rod with a round body under gravity along its clamp, in a
/// motion in space. By rotational symmetry the angular momentum about the clamp's axis, without that of the sections
/// about their own, is constant, and so is the energy.
#[test]
fn a_round_rod_keeps_its_momentum() {
    let gravity = Vector3::new(0.0, 0.0, -1.5);
    let (section, body) = (
        Vector3::new(1e-3, 1e-3, 2e-3),
        Vector3::new(0.03, 0.03, 0.05),
    );
    let weld = |force: Vector3<f64>| {
        let weld = RigidBody::new(1.0, Matrix3::from_diagonal(&body)).unwrap();
        let weld = weld.with_centre(Vector3::z() * 0.1).unwrap();
        let weld = weld.with_gravity(gravity).unwrap();
        Mass::Rigid(weld.with_dead_force(force).unwrap())
    };
    let given = RodDescription {
        law: Law::new(
            Arc::new(Linear::diagonal([1.0, 1.0], 0.8).unwrap()),
            None,
            &[0, 1, 2],
        )
        .unwrap(),
        curve: Curve::Space,
        mass: MASS,
        rotary: Some(Matrix3::from_diagonal(&section)),
        along: None,
        grain: PointMass::new(1.0).unwrap().with_gravity(gravity).unwrap(),
        distributed: None,
        turning: None,
        body: Some(weld(Vector3::new(0.0, -1.5, 0.0))),
        diameter: None,
    };
    // Starts from an equilibrium whose load is released, with admissible rates.
    let nodes = 10;
    let loaded = alone(given.clone(), nodes);
    let y = loaded.settled(&still(&loaded, |_| 0.0)).unwrap();
    let twist = Vector6::new(0.1, 0.05, 0.6, 0.8, 0.0, 0.0);
    let y = loaded.following(&y, &[twist]).unwrap();
    let released = RodDescription {
        body: Some(weld(Vector3::zeros())),
        ..given
    };
    let rod = alone(released, nodes);
    let momentum = |y: &DVector<f64>| {
        let at = &rod.at(y).unwrap().rods[0];
        let of = |i: usize, mass: f64, inertia: &Vector3<f64>, offset: f64| {
            let r = at.shape.directors[i];
            let omega = at.flow.spins[i];
            let arm = r.column(2) * offset;
            let (place, v) = (
                at.shape.positions[i] + arm,
                at.flow.velocities[i] + omega.cross(&arm),
            );
            let own = r * inertia.component_mul(&r.tr_mul(&omega));
            mass * place.cross(&v).z + own.z - inertia.z * r.column(2).dot(&omega)
        };
        let weights = rod.links[0].rod.sections.grid.weights();
        let pieces = weights.iter().enumerate();
        let pieces: f64 = pieces
            .map(|(i, w)| of(i, MASS * w, &(section * *w), 0.0))
            .sum();
        pieces + of(weights.len(), 1.0, &body, 0.1)
    };
    let before = (momentum(&y), energy(&rod, &y));
    let y = stepped(&rod, y, 0.05, 1e-9);
    assert!(before.0.abs() > 0.1);
    let changed = (momentum(&y) - before.0).abs();
    assert!(changed < 1e-7, "{changed:e} of {}", before.0);
    let changed = (energy(&rod, &y) - before.1).abs();
    assert!(changed < 1e-7, "{changed:e} of {}", before.1);
}
