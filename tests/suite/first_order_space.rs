//! First-order mass of rods in space, between bodies (theory 3.9).

use crate::support::assert_close;
use nalgebra::{Isometry3, Matrix3, Vector2, Vector3, Vector6};
use snaprod::assembly::{
    Assembly, Attachment, Body, BodyMotion, Configuration, Integrals, Joint, LightRod, Link,
    RodMomentum,
};
use snaprod::body::{Mass, PointMass, RigidBody};
use snaprod::elastica::{self, Equilibrium, RodInertia};
use snaprod::math::gauss::Rule;
use snaprod::math::se3::{halves, join};
use snaprod::motion::assembly::AssemblyRun;
use snaprod::motion::{Event, Motion, Options, on_elastica};
use snaprod::rod::{DistributedLoad, EndConditions, Problem, Rod, SectionMass};
use snaprod::section::Linear;
use std::sync::Arc;

pub fn light(mass: f64, rotary: [f64; 3]) -> Vec<Option<LightRod>> {
    vec![Some(LightRod {
        sections: SectionMass {
            mass,
            rotary: rotary.into(),
        },
        followed: false,
    })]
}

pub fn options(duration: f64) -> Options {
    let options = Options::new(duration).unwrap();
    options.with_tolerance(1e-10).unwrap()
}

fn weighed(assembly: &Assembly, now: &Configuration) -> RodMomentum {
    let state = assembly.state(now, &Integrals::default());
    let at = assembly.evaluated(&state, 1e-13).unwrap();
    assembly.weighed(0, &at, 1e-13).unwrap()
}

/// Twice the kinetic energy of the rod as a form in the twists of its bodies, by polarisation.
fn form(assembly: &Assembly, now: &Configuration, a: &[Vector6<f64>], b: &[Vector6<f64>]) -> f64 {
    let energy = |sign: f64| {
        let mut now = now.clone();
        let twists = a.iter().zip(b).map(|(a, b)| a + b * sign);
        (now.bodies.iter_mut().zip(twists)).for_each(|(body, twist)| body.twist = twist);
        weighed(assembly, &now).kinetic
    };
    0.5 * (energy(1.0) - energy(-1.0))
}

/// A cube; `offset` leads from the reference point to the centre of mass.
pub fn block(mass: f64, offset: [f64; 3]) -> Body {
    let inertia = Matrix3::from_diagonal(&Vector3::new(0.1, 0.2, 0.15));
    let body = RigidBody::new(mass, inertia).unwrap();
    Body::rigid(body.with_centre(offset.into()).unwrap())
}

/// Catches a wrong field, length or unit: the mass matrix of a straight beam between two clamps is that of cubic
/// Hermite polynomials, of stretch and torsion that of linear ones.
#[test]
fn a_straight_rod_has_the_hermite_matrix() {
    let (length, mass, polar) = (1.7, 0.6, 0.02);
    let law = Linear::diagonal([3.0, 3.0], 2.0).unwrap();
    let rod = Rod::new(length, law.with_axial(500.0).unwrap()).unwrap();
    let here = Isometry3::identity();
    let [from, to] = [0, 1].map(|body| Attachment::body(body, here));
    let link = Link::new(rod, from, to, Joint::Weld);
    let bodies = vec![block(1.0, [0.0; 3]), block(1.0, [0.0; 3])];
    let assembly = Assembly::new(bodies, vec![link]).unwrap();
    let assembly = assembly
        .with_light_rods(light(mass, [0.0, 0.0, polar]))
        .unwrap();
    let poses = [here, Isometry3::translation(0.0, 0.0, length)];
    let now = Configuration {
        bodies: assembly.at_rest(&poses),
        charts: vec![Vector6::zeros()],
        spins: Vec::new(),
    };
    let unit = |body: usize, k: usize, sign: f64| {
        let mut twists = [Vector6::zeros(); 2];
        twists[body][k] = sign;
        twists
    };
    let matrix = |axes: &[[Vector6<f64>; 2]], expected: &[&[f64]], scale: f64| {
        for (a, row) in axes.iter().zip(expected) {
            for (b, entry) in axes.iter().zip(*row) {
                let found = form(&assembly, &now, a, b);
                assert_close(found, entry * scale, 1e-10, scale, "entry");
            }
        }
    };
    let l = length;
    let hermite: [&[f64]; 4] = [
        &[156.0, 22.0 * l, 54.0, -13.0 * l],
        &[22.0 * l, 4.0 * l * l, 13.0 * l, -3.0 * l * l],
        &[54.0, 13.0 * l, 156.0, -22.0 * l],
        &[-13.0 * l, -3.0 * l * l, -22.0 * l, 4.0 * l * l],
    ];
    // A turn about y leads to slopes dx/dz, one about x to -dy/dz.
    for (shift, turn, sign) in [(3, 1, 1.0), (4, 0, -1.0)] {
        let axes = [0, 1].map(|body| [unit(body, shift, 1.0), unit(body, turn, sign)]);
        matrix(&axes.concat(), &hermite, mass / 420.0);
    }
    let linear: [&[f64]; 2] = [&[2.0, 1.0], &[1.0, 2.0]];
    matrix(&[0, 1].map(|b| unit(b, 5, 1.0)), &linear, mass / 6.0);
    matrix(&[0, 1].map(|b| unit(b, 2, 1.0)), &linear, polar * l / 6.0);
}

/// A planar elastica in space, x of its plane along d3 and y along d1, with a point mass at its end.
fn in_space(at: &Equilibrium, eps: f64, gravity: [f64; 2]) -> (Assembly, Configuration) {
    let rod = Rod::new(1.0, Linear::diagonal([1.0; 2], 1.0).unwrap()).unwrap();
    let force = Vector3::new(at.alpha.sin(), 0.0, at.alpha.cos()) * -at.lambda.powi(2);
    let end = Vector3::new(at.y, 0.0, at.x);
    let here = Isometry3::identity();
    let (from, to) = (Attachment::ground(here), Attachment::body(0, here));
    let link = Link::new(rod, from, to, Joint::Ball);
    let gravity = [gravity[1], 0.0, gravity[0]];
    let body = PointMass::new(1.0)
        .unwrap()
        .with_gravity(gravity.into())
        .unwrap();
    let assembly = Assembly::new(vec![Body::point(body)], vec![link]).unwrap();
    let now = Configuration {
        bodies: vec![BodyMotion::at_rest(Isometry3::translation(
            end.x, end.y, end.z,
        ))],
        charts: vec![join(&end.cross(&force), &force)],
        spins: Vec::new(),
    };
    let light = light(eps, [0.0; 3]);
    (assembly.with_light_rods(light).unwrap(), now)
}

fn across(v: [f64; 2]) -> Vector6<f64> {
    Vector6::new(0.0, 0.0, 0.0, v[1], 0.0, v[0])
}

/// Catches a wrong velocity field of a bent rod: the mass at its end is that of the closed form.
#[test]
fn a_bent_planar_rod_weighs_what_the_elastica_does() {
    for (lambda, kappa) in [(1.4, -0.92), (4.0, 0.7), (5.9, 0.5)] {
        let at = Equilibrium::from_lambda_kappa(lambda, kappa).unwrap();
        let (assembly, now) = in_space(&at, 1.0, [0.0; 2]);
        let zero = Vector2::zeros();
        let expected = RodInertia::new(at.p, at.w).unwrap();
        let expected = expected.added(&zero, &zero).unwrap().mass;
        for i in 0..2 {
            for j in 0..2 {
                let [a, b] = [i, j].map(|k| [across([[1.0, 0.0], [0.0, 1.0]][k])]);
                let found = form(&assembly, &now, &a, &b);
                assert_close(found, expected[(i, j)], 1e-10, expected.amax(), "mass");
            }
        }
    }
}

/// Final position of the mass on the planar rod, and the times without the rod's mass.
fn planar(at: &Equilibrium, eps: f64, gravity: [f64; 2], v: [f64; 2], t: f64) -> [f64; 2] {
    let gravity = Vector2::from(gravity);
    // Gravity acts on the body alone: the planar rod bears its weight in another way, with another second order.
    let rod = elastica::LightRod {
        mass: eps,
        gravity: Vector2::zeros(),
    };
    let body = PointMass::new(1.0).unwrap().with_gravity(gravity).unwrap();
    let body = body.with_rod(Arc::new(rod));
    let start = Some(Vector2::new(at.p, at.w));
    let mut run = on_elastica(&body, start, v.into(), None, options(t)).unwrap();
    while run.advance().is_some() {}
    let end = run.now().pose().translation.vector;
    [end.x, end.y]
}

/// Catches a wrong bias, against the closed form in the plane. With a snap, catches a wrong moment of switching the
/// mass off or on: the normal form of the fold is computed differently there (the field's derivatives, not the null
/// vector of J).
#[test]
fn planar_motions_are_those_of_the_plane() {
    // Without and with a snap; tolerances: the mass is switched off between steps, and the steps differ.
    let cases = [
        ((1.4, -0.9232), [0.3, -1.0], [0.0, 0.3], 0.05, 0.3, 1e-10),
        ((6.3, 0.6), [0.0, 0.0], [0.0, -0.5], 1e-4, 0.1, 1e-4),
    ];
    for ((lambda, kappa), gravity, v, eps, duration, tolerance) in cases {
        let at = Equilibrium::from_lambda_kappa(lambda, kappa).unwrap();
        let expected = planar(&at, eps, gravity, v, duration);
        let (assembly, mut now) = in_space(&at, eps, gravity);
        now.bodies[0].twist = across(v);
        let mut run = AssemblyRun::new(assembly, &now, options(duration)).unwrap();
        let first = run.now().ledger().total();
        let (mut snaps, mut felt) = (0, vec![run.now().ledger().rod_kinetic > 0.0]);
        while let Some(event) = run.advance() {
            snaps += usize::from(matches!(event, Event::Snap(_)));
            felt.push(run.now().ledger().rod_kinetic > 0.0);
        }
        let last = run.now();
        let end = last.bodies()[0].pose.translation.vector;
        for (found, expected) in [end.z, end.x].into_iter().zip(expected) {
            assert!((found - expected).abs() < tolerance, "{found} {expected}");
        }
        assert!((last.ledger().total() - first).abs() < 1e-9);
        felt.dedup();
        match snaps {
            0 => assert_eq!(felt, [true]),
            _ => assert_eq!(felt, [true, false, true]),
        }
    }
}

/// A crooked rod between two free bodies, at rest, welded to them or between two ball joints.
pub fn pair(load: Vector3<f64>, joint: Joint) -> (Assembly, Configuration) {
    let law = Linear::diagonal([1.0, 2.0], 0.8).unwrap();
    let law = law
        .with_shear([40.0, 50.0])
        .unwrap()
        .with_axial(100.0)
        .unwrap();
    let rod = Rod::new(1.2, law.with_rest([0.4, -0.3], 0.5).unwrap()).unwrap();
    let a = Isometry3::new(Vector3::new(0.1, 0.2, -0.1), Vector3::new(0.3, 0.1, 0.2));
    let b = Isometry3::new(Vector3::new(0.1, 0.05, -0.02), Vector3::new(0.1, -0.4, 0.2));
    let load = DistributedLoad::constant(load).unwrap();
    let clamped = rod.clone().with_clamp(a.translation.vector, a.rotation);
    let free = EndConditions::load(Vector3::zeros(), Vector3::zeros());
    let hanging = Problem::new(clamped, free, 1e-13)
        .unwrap()
        .with_distributed(&load);
    let end = hanging.sections(&Vector6::zeros(), &[1.0]).unwrap()[0].pose();
    let (from, to) = (Attachment::body(0, a), Attachment::body(1, b));
    let link = match joint {
        Joint::Ball => Link::pinned(rod, from, to),
        Joint::Weld => {
            let link = Link::new(rod, from, to, joint);
            link.with_distributed(load).unwrap()
        }
    };
    let bodies = [(1.0, [0.1, -0.05, 0.07]), (2.0, [-0.1, 0.0, 0.2])];
    let bodies = bodies.map(|(mass, offset)| block(mass, offset));
    let assembly = Assembly::new(bodies.into(), vec![link]).unwrap();
    let light = light(0.2, [1e-3, 2e-3, 3e-3]);
    let assembly = assembly.with_light_rods(light).unwrap();
    let mut now = Configuration {
        bodies: assembly.at_rest(&[Isometry3::identity(), end * b.inverse()]),
        charts: vec![Vector6::zeros()],
        spins: Vec::new(),
    };
    now.bodies[0].twist = Vector6::new(0.3, -0.5, 0.8, 0.2, 0.3, -0.1);
    now.bodies[1].twist = Vector6::new(-0.6, -0.2, 0.4, -0.2, 0.1, 0.3);
    (assembly, now)
}

/// (angular momentum, momentum) of rod and bodies.
pub fn momentum(assembly: &Assembly, now: &Configuration) -> Vector6<f64> {
    let state = assembly.state(now, &Integrals::default());
    let base = assembly.evaluated(&state, 1e-13).unwrap().points[0].base;
    let about = |x: Vector3<f64>, l: Vector3<f64>, p: Vector3<f64>| join(&(l + x.cross(&p)), &p);
    let (l, p) = halves(&weighed(assembly, now).momentum);
    let rod = about(base.pose.translation.vector, l, p);
    let bodies = assembly.carriers().iter().zip(&now.bodies);
    bodies.fold(rod, |sum, (carrier, place)| {
        let Mass::Rigid(body) = carrier.mass() else {
            panic!("a point");
        };
        let turn = place.pose.rotation;
        let (omega, v) = halves(&place.twist);
        let arm = turn * body.offset();
        let l = turn * (body.inertia() * (turn.inverse() * omega));
        let p = (v + omega.cross(&arm)) * body.mass();
        sum + about(place.pose.translation.vector + arm, l, p)
    })
}

/// Catches a bias that is not the derivative of the mass matrix, or omits the turning of base, end, levers or load.
/// Energy is constant, the momentum grows by the load, and without a load the angular momentum is constant, too.
/// Between two ball joints: catches a spin about the chord that is not free, or does not act on the bodies.
#[test]
fn a_free_pair_keeps_energy_and_momenta() {
    let load = Vector3::new(0.3, -0.2, 0.5);
    for (load, joint) in [
        (Vector3::zeros(), Joint::Weld),
        (load, Joint::Weld),
        (Vector3::zeros(), Joint::Ball),
    ] {
        let (assembly, now) = pair(load, joint);
        let mut run = AssemblyRun::new(assembly.clone(), &now, options(1.0)).unwrap();
        let first = run.now().ledger();
        let before = momentum(&assembly, run.now().configuration().unwrap());
        while run.advance().is_some() {}
        let last = run.now().ledger();
        assert!(
            last.rod_kinetic > 1e-3 && (last.rod_kinetic / first.rod_kinetic - 1.0).abs() > 0.1
        );
        let error = last.total() - first.total();
        assert!(error.abs() < 1e-11, "{error:e}");
        let now = run.now().configuration().unwrap().clone();
        let mut change = momentum(&assembly, &now) - before;
        for i in 0..3 {
            change[3 + i] -= load[i] * 1.2;
        }
        if load != Vector3::zeros() {
            change.fixed_rows_mut::<3>(0).fill(0.0);
        }
        assert!(change.amax() < 1e-11, "{change:e}");
    }
}

/// Catches a wrong kinetic energy: sections followed in time, with velocities and spins by differences.
#[test]
fn kinetic_energy_is_that_of_the_sections_in_time() {
    const H: f64 = 2e-3;
    for (load, joint) in [
        (Vector3::new(0.3, -0.2, 0.5), Joint::Weld),
        (Vector3::zeros(), Joint::Ball),
    ] {
        let (assembly, now) = pair(load, joint);
        let mut run = AssemblyRun::new(assembly.clone(), &now, options(0.3)).unwrap();
        // A step with enough time around its middle.
        let middle = loop {
            match run.advance() {
                Some(Event::Step { from, to }) if from > 0.1 && to - from > 7.0 * H => {
                    break 0.5 * (from + to);
                }
                Some(_) => {}
                None => panic!("no long step"),
            }
        };
        let rule = Rule::new(12);
        let mut poses = |t: f64| -> Vec<Isometry3<f64>> {
            let at = run.state_at(t).unwrap();
            let base = at.at.points[0].base.pose;
            let sections = at.rod_sections(0, &rule.nodes);
            sections
                .iter()
                .map(|section| base * section.pose())
                .collect()
        };
        let times = [-3.0, -2.0, -1.0, 1.0, 2.0, 3.0].map(|k| poses(middle + k * H));
        let here = poses(middle);
        let weights = [-1.0, 9.0, -45.0, 45.0, -9.0, 1.0].map(|w| w / (60.0 * H));
        let rotary = Vector3::new(1e-3, 2e-3, 3e-3);
        let mut energy = 0.0;
        for (k, weight) in rule.weights.iter().enumerate() {
            let (mut v, mut spin) = (Vector3::zeros(), Vector3::zeros());
            for (poses, w) in times.iter().zip(weights) {
                v += poses[k].translation.vector * w;
                // Along the directors.
                spin += (here[k].rotation.inverse() * poses[k].rotation).scaled_axis() * w;
            }
            let turning = spin.component_mul(&spin).dot(&rotary) * 1.2;
            energy += 0.5 * weight * (0.2 * v.norm_squared() + turning);
        }
        let found = run.state_at(middle).unwrap().ledger.rod_kinetic;
        assert_close(found, energy, 1e-8, 0.0, "kinetic energy of the rod");
    }
}
