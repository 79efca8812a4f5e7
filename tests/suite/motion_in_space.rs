//! Invariants of the motion of bodies on elastic rods in space: momenta kept by symmetry, free rotation,
//! reversibility, order of integration, and the ledger of random assemblies.

use nalgebra::{Isometry3, Matrix3, UnitQuaternion, Vector3, Vector6};
use proptest::prelude::*;
use proptest::test_runner::{RngAlgorithm, TestRng, TestRunner};
use snaprod::assembly::{Assembly, Attachment, Body, BodyMotion, Configuration, Joint, Link};
use snaprod::body::{PointMass, RigidBody};
use snaprod::motion::assembly::{AssemblyRun, AssemblySample};
use snaprod::motion::{Event, Motion, Options, Outcome, State};
use snaprod::rod::{EndConditions, Problem, Rod};
use snaprod::section::Linear;

fn twist(a: Vector3<f64>, b: Vector3<f64>) -> Vector6<f64> {
    Vector6::new(a.x, a.y, a.z, b.x, b.y, b.z)
}

/// A rod that shears and stretches, bent and twisted at rest by `rest`.
fn rod(bending: [f64; 2], rest: Vector3<f64>) -> Rod {
    let law = Linear::diagonal(bending, 0.8)
        .and_then(|law| law.with_shear([120.0, 120.0])?.with_axial(300.0))
        .and_then(|law| law.with_rest([rest.x, rest.y], rest.z))
        .expect("a law");
    Rod::new(1.0, law).expect("a rod")
}

/// The motion of `assembly` from `start` to the time `end`: the states in the middle and at the end of every step,
/// and how many snaps there were.
fn states(
    assembly: Assembly,
    start: &Configuration,
    end: f64,
    tolerance: f64,
) -> (Vec<AssemblySample>, usize) {
    let options = Options::new(end)
        .and_then(|o| o.with_tolerance(tolerance))
        .expect("options");
    let mut run = AssemblyRun::new(assembly, start, options).expect("a run");
    let (mut states, mut snaps) = (vec![run.sample_now()], 0);
    while let Some(event) = run.advance() {
        match event {
            Event::Step { from, to } => {
                states.extend(run.state_at(0.5 * (from + to)));
                states.push(run.sample_now());
            }
            Event::Snap(_) => snaps += 1,
            Event::Stop(outcome) => assert_eq!(outcome, Outcome::EndOfTime),
            other => panic!("{other:?}"),
        }
    }
    (states, snaps)
}

/// Momentum, and angular momentum about the origin, both in the world.
fn momenta(body: &RigidBody, place: &BodyMotion) -> (Vector3<f64>, Vector3<f64>) {
    let spin = place.twist.fixed_rows::<3>(0).into_owned();
    let v = place.twist.fixed_rows::<3>(3).into_owned();
    let turn = place.pose.rotation;
    let arm = turn * body.offset();
    let linear = body.mass() * (v + spin.cross(&arm));
    let own = turn * (body.inertia() * (turn.inverse() * spin) + body.rotor());
    (
        linear,
        (place.pose.translation.vector + arm).cross(&linear) + own,
    )
}

fn solid(inertia: [f64; 3]) -> RigidBody {
    RigidBody::new(1.0, Matrix3::from_diagonal(&inertia.into())).expect("a body")
}

/// Two bodies on one rod without support keep momentum and angular momentum. Would catch unequal wrenches at the two
/// ends, a wrong lever arm, a rotor that turns with the wrong frame.
#[test]
fn bodies_that_hold_only_each_other_keep_their_momenta() {
    let bodies = [
        solid([0.2, 0.3, 0.25])
            .with_centre(Vector3::new(0.1, -0.05, 0.2))
            .expect("a body"),
        solid([0.15, 0.1, 0.2])
            .with_rotor(Vector3::new(0.05, -0.1, 0.3))
            .expect("a body"),
    ];
    let site = Isometry3::from_parts(
        Vector3::new(0.1, 0.2, -0.1).into(),
        UnitQuaternion::from_scaled_axis(Vector3::new(0.4, 0.1, -0.3)),
    );
    let link = Link::new(
        rod([1.0, 1.4], Vector3::new(0.5, 0.2, 0.4)),
        Attachment::body(0, site),
        Attachment::body(1, Isometry3::identity()),
        Joint::Weld,
    );
    let end = link.end(&Vector6::zeros(), 1e-14).expect("an end").pose;
    let carriers = bodies.iter().cloned().map(Body::rigid).collect();
    let start = Configuration {
        bodies: vec![
            BodyMotion {
                pose: Isometry3::identity(),
                twist: Vector6::new(0.6, -0.4, 0.3, 0.1, 0.2, -0.3),
            },
            BodyMotion {
                pose: site * end,
                twist: Vector6::new(-0.5, 0.7, 0.2, 0.4, -0.1, 0.2),
            },
        ],
        charts: vec![Vector6::zeros()],
        spins: Vec::new(),
    };
    let assembly = Assembly::new(carriers, vec![link]).expect("an assembly");
    let (states, _) = states(assembly, &start, 3.0, 1e-11);
    let total = |sample: &AssemblySample| {
        let all = bodies
            .iter()
            .zip(sample.bodies())
            .map(|(body, place)| momenta(body, place));
        all.fold((Vector3::zeros(), Vector3::zeros()), |sum, one| {
            (sum.0 + one.0, sum.1 + one.1)
        })
    };
    let first = total(&states[0]);
    for state in &states {
        let now = total(state);
        let off = (now.0 - first.0).norm().max((now.1 - first.1).norm());
        assert!(
            off < 1e-9,
            "t = {}: the momenta are {off:e} off",
            state.time()
        );
    }
    assert!(
        (states[0].at.now.charts[0] - states.last().expect("states").at.now.charts[0]).norm() > 0.1,
        "nothing moved"
    );
}

/// A straight rod with equal bending and a body of revolution. Symmetry: turning everything about the clamp's axis and
/// back about the body's axis changes nothing. Hence the difference of the angular momenta about the two axes is
/// constant, under gravity along the clamp too. Would catch a couple about a wrong axis or point.
#[test]
fn a_body_of_revolution_on_a_round_rod_keeps_a_momentum() {
    let body = solid([0.3, 0.3, 0.1])
        .with_centre(Vector3::new(0.0, 0.0, 0.15))
        .and_then(|b| b.with_rotor(Vector3::new(0.0, 0.0, 0.4)))
        .and_then(|b| b.with_gravity(Vector3::new(0.0, 0.0, -0.8)))
        .expect("a body");
    let link = Link::new(
        rod([1.0, 1.0], Vector3::zeros()),
        Attachment::ground(Isometry3::identity()),
        Attachment::body(0, Isometry3::identity()),
        Joint::Weld,
    );
    let start = Configuration {
        bodies: vec![BodyMotion {
            pose: Isometry3::translation(0.0, 0.0, 1.0),
            twist: Vector6::new(0.9, -1.2, 1.5, 0.5, 0.4, 0.1),
        }],
        charts: vec![Vector6::zeros()],
        spins: Vec::new(),
    };
    let assembly = Assembly::new(vec![Body::rigid(body.clone())], vec![link]).expect("an assembly");
    let (states, _) = states(assembly, &start, 3.0, 1e-11);
    let kept = |sample: &AssemblySample| {
        let place = &sample.bodies()[0];
        let spin = place.pose.rotation.inverse() * place.twist.fixed_rows::<3>(0).into_owned();
        momenta(&body, place).1.z - (body.inertia() * spin + body.rotor()).z
    };
    let first = kept(&states[0]);
    let mut couple: f64 = 0.0;
    for state in &states {
        let off = kept(state) - first;
        assert!(
            off.abs() < 1e-9,
            "t = {}: the momentum is {off:e} off",
            state.time()
        );
        couple = couple.max(state.at.points[0].end.couple.norm());
    }
    assert!(couple > 0.5, "the rod bore no couple: {couple}");
}

/// A body on a ball joint at its centre of mass rotates freely, tumbling about its intermediate axis (Dzhanibekov).
/// Its angular velocity is an elliptic function of time, with period T; after T/2 the components along the axes of
/// least and intermediate inertia have changed their signs (Landau, Lifshitz, Mechanics, Sec. 37). Would catch wrong
/// gyroscopic terms, and a ball joint that bears a couple.
#[test]
fn a_body_on_a_ball_joint_at_its_centre_turns_freely() {
    let inertia = [0.1, 0.25, 0.32];
    let body = solid(inertia);
    let spin = Vector3::new(0.02, 3.0, 0.03);
    let link = Link::new(
        rod([1.0, 1.3], Vector3::new(0.3, 0.1, 0.0)),
        Attachment::ground(Isometry3::identity()),
        Attachment::body(0, Isometry3::identity()),
        Joint::Ball,
    );
    let pose = link.end(&Vector6::zeros(), 1e-14).expect("an end").pose;
    let start = Configuration {
        bodies: vec![BodyMotion {
            pose,
            twist: twist(pose.rotation * spin, Vector3::new(0.2, -0.1, 0.1)),
        }],
        charts: vec![Vector6::zeros()],
        spins: Vec::new(),
    };
    let [i1, i2, i3] = inertia;
    let twice_energy: f64 = inertia
        .iter()
        .zip(spin.iter())
        .map(|(i, w)| i * w * w)
        .sum();
    let square: f64 = inertia
        .iter()
        .zip(spin.iter())
        .map(|(i, w)| (i * w).powi(2))
        .sum();
    assert!(
        square > twice_energy * i2,
        "the other case of the closed form"
    );
    let m = (i2 - i1) * (twice_energy * i3 - square) / ((i3 - i2) * (square - twice_energy * i1));
    let rate = ((i3 - i2) * (square - twice_energy * i1) / (i1 * i2 * i3)).sqrt();
    let period = 4.0 * ellip::ellipk(m).expect("a modulus in range") / rate;
    let assembly = Assembly::new(vec![Body::rigid(body)], vec![link]).expect("an assembly");
    for (part, signs) in [(0.5, [-1.0, -1.0, 1.0]), (1.0, [1.0; 3])] {
        let (states, _) = states(assembly.clone(), &start, part * period, 1e-12);
        let place = &states.last().expect("states").bodies()[0];
        let now = place.pose.rotation.inverse() * place.twist.fixed_rows::<3>(0).into_owned();
        let off = (now - spin.component_mul(&Vector3::from(signs))).norm();
        assert!(
            off < 1e-8,
            "after {part} periods the angular velocity is {off:e} off: {now}"
        );
    }
}

/// A pendulum on an inextensible rod with wide swings near folds, where time is slowed, again and again. Would catch
/// states inside a step computed under another clock than the step's.
#[test]
fn the_ledger_of_a_wide_swing_closes_inside_the_steps() {
    let law = Linear::diagonal([1.0, 1.0], 0.77)
        .and_then(|law| law.rigid([true; 3]))
        .expect("a law");
    let rod = Rod::new(1.0, law).expect("a rod");
    let mass = PointMass::<3>::new(1.0)
        .and_then(|m| m.with_gravity(Vector3::new(0.0, 0.0, 3.2)))
        .expect("a mass");
    let link = Link::new(
        rod,
        Attachment::ground(Isometry3::identity()),
        Attachment::body(0, Isometry3::identity()),
        Joint::Ball,
    );
    // Held out to the side by a force: m(1) = 0.
    let held = Problem::new(
        link.rod().clone(),
        EndConditions::load(Vector3::new(3.9, 0.0, 3.2), Vector3::zeros()),
        1e-12,
    )
    .and_then(|problem| problem.solve(None))
    .expect("an equilibrium");
    let end = held.end.position;
    let start = Configuration {
        bodies: vec![BodyMotion {
            pose: Isometry3::translation(end.x, end.y, end.z),
            twist: twist(Vector3::zeros(), Vector3::new(0.0, 1.0, 0.0)),
        }],
        charts: vec![held.base.component_div(&link.units())],
        spins: Vec::new(),
    };
    let assembly = Assembly::new(vec![Body::point(mass)], vec![link]).expect("an assembly");
    let (states, _) = states(assembly, &start, 12.0, 1e-9);
    let total = states[0].ledger().total();
    for state in &states {
        let open = (state.ledger().total() - total).abs();
        assert!(open < 1e-7, "t = {}: open by {open:e}", state.time());
    }
}

/// A body on a bent rod, kicked: a motion without snaps.
fn kicked() -> (Assembly, Configuration) {
    let body = solid([0.3, 0.2, 0.25])
        .with_centre(Vector3::new(0.05, 0.0, 0.1))
        .and_then(|b| b.with_gravity(Vector3::new(0.3, 0.0, -0.5)))
        .expect("a body");
    let link = Link::new(
        rod([1.0, 1.3], Vector3::new(0.3, 0.1, 0.2)),
        Attachment::ground(Isometry3::identity()),
        Attachment::body(0, Isometry3::identity()),
        Joint::Weld,
    );
    let start = Configuration {
        bodies: vec![BodyMotion {
            pose: link.end(&Vector6::zeros(), 1e-14).expect("an end").pose,
            twist: Vector6::new(0.4, -0.6, 0.5, 0.3, 0.5, 0.1),
        }],
        charts: vec![Vector6::zeros()],
        spins: Vec::new(),
    };
    (
        Assembly::new(vec![Body::rigid(body)], vec![link]).expect("an assembly"),
        start,
    )
}

/// Would catch an unphysical dependence of the force on velocity, or an error not bounded by the tolerance.
#[test]
fn a_motion_turned_round_goes_back() {
    let (assembly, start) = kicked();
    let (there, snaps) = states(assembly.clone(), &start, 2.0, 1e-11);
    assert_eq!(snaps, 0);
    let mut turned = there.last().expect("states").at.now.clone();
    turned.bodies[0].twist = -turned.bodies[0].twist;
    let (back, _) = states(assembly, &turned, 2.0, 1e-11);
    let last = &back.last().expect("states").at.now.bodies[0];
    let first = &start.bodies[0];
    let off = (last.pose.translation.vector - first.pose.translation.vector)
        .norm()
        .max(last.pose.rotation.angle_to(&first.pose.rotation))
        .max((last.twist + first.twist).norm());
    assert!(off < 1e-8, "it comes back {off:e} beside its start");
}

/// Would catch steps of a lower order (slopes not smooth along the rod, charts corrected to their poses too roughly),
/// and an error not bounded by the tolerance.
#[test]
fn the_error_falls_with_the_eighth_power_of_the_steps() {
    let end = 2.0;
    let at = |tolerance: f64| {
        let (assembly, start) = kicked();
        let options = Options::new(end)
            .and_then(|o| o.with_tolerance(tolerance))
            .expect("options");
        let mut run = AssemblyRun::new(assembly, &start, options).expect("a run");
        while run.advance().is_some() {}
        let place = run.sample_now().at.now.bodies[0];
        (place, run.cost().steps)
    };
    let (exact, _) = at(1e-13);
    let rows = [1e-6, 1e-8, 1e-10].map(|tolerance| {
        let (place, steps) = at(tolerance);
        let off = (place.pose.translation.vector - exact.pose.translation.vector)
            .norm()
            .max(place.pose.rotation.angle_to(&exact.pose.rotation))
            .max((place.twist - exact.twist).norm());
        assert!(
            off < 20.0 * tolerance,
            "tolerance {tolerance:e}: {off:e} off"
        );
        (off, steps as f64)
    });
    let order = -(rows[2].0 / rows[1].0).ln() / (rows[2].1 / rows[1].1).ln();
    assert!((7.0..9.5).contains(&order), "order {order}: {rows:?}");
}

/// Would catch spurious energy in assemblies of any shape: two rods that hold one body, at random.
#[test]
fn the_ledger_of_assemblies_drawn_at_random_closes() {
    let mut runner = TestRunner::new_with_rng(
        ProptestConfig {
            cases: 12,
            failure_persistence: None,
            ..ProptestConfig::default()
        },
        TestRng::deterministic_rng(RngAlgorithm::ChaCha),
    );
    let numbers = |most: f64, count: usize| prop::collection::vec(-most..most, count);
    let drawn = (
        numbers(1.0, 6),
        numbers(0.4, 6),
        numbers(0.8, 6),
        0.5f64..2.0,
    );
    let result = runner.run(&drawn, |(rest, site, kick, stiff)| {
        let at = |x: &[f64]| {
            Isometry3::from_parts(
                Vector3::new(x[0], x[1], x[2]).into(),
                UnitQuaternion::from_scaled_axis(Vector3::new(x[3], x[4], x[5])),
            )
        };
        let first = rod([1.0, stiff], Vector3::new(rest[0], rest[1], rest[2]));
        let second = rod([stiff, 1.2], Vector3::new(rest[3], rest[4], rest[5]));
        let body = solid([0.2, 0.3, 0.25])
            .with_centre(Vector3::new(0.1, 0.0, -0.05))
            .and_then(|b| b.with_gravity(Vector3::new(0.0, 0.4, -0.6)))
            .expect("a body");
        let clamp = Attachment::ground(Isometry3::identity());
        let one = Link::new(
            first,
            clamp,
            Attachment::body(0, Isometry3::identity()),
            Joint::Weld,
        );
        let pose = one.end(&Vector6::zeros(), 1e-14).expect("an end").pose;
        // The second rod leaves the body at an arbitrary pose and is fixed at its unloaded end.
        let loose = Link::new(
            second.clone(),
            Attachment::body(0, at(&site)),
            Attachment::ground(Isometry3::identity()),
            Joint::Weld,
        );
        let foot = pose * at(&site) * loose.end(&Vector6::zeros(), 1e-14).expect("an end").pose;
        let two = Link::new(
            second,
            Attachment::body(0, at(&site)),
            Attachment::ground(foot),
            Joint::Weld,
        );
        let start = Configuration {
            bodies: vec![BodyMotion {
                pose,
                twist: Vector6::from_column_slice(&kick),
            }],
            charts: vec![Vector6::zeros(); 2],
            spins: Vec::new(),
        };
        let assembly = Assembly::new(vec![Body::rigid(body)], vec![one, two]).expect("an assembly");
        let (states, _) = states(assembly, &start, 0.6, 1e-10);
        let total = states[0].ledger().total();
        for state in &states {
            let open = (state.ledger().total() - total).abs();
            prop_assert!(open < 1e-9, "t = {}: open by {open:e}", state.time());
        }
        Ok(())
    });
    result.unwrap();
}
