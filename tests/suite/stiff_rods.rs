//! Implicit steps of bodies on stiff rods in space: linear theory, explicit steps, and cases without implicit steps.

use crate::support::worst;
use nalgebra::{Isometry3, Matrix3, Vector3, Vector6};
use snaprod::assembly::{Assembly, Attachment, Body, BodyMotion, Configuration, Joint, Link};
use snaprod::body::{PointMass, RigidBody};
use snaprod::motion::assembly::{AssemblyRun, AssemblySample};
use snaprod::motion::{Event, Motion, Options, Outcome};
use snaprod::rod::Rod;
use snaprod::section::Linear;
use snaprod::solve::cost::Cost;
use snaprod::solve::integrator::Method;

/// A mass of 1 that hangs by a ball joint under its weight `pull` on a rod of length and bending stiffness 1, at rest.
fn hanging(stiffness: f64, pull: f64) -> (Assembly, Configuration) {
    let law = Linear::diagonal([1.0, 1.3], 0.8)
        .and_then(|law| {
            law.with_shear([stiffness, stiffness])?
                .with_axial(stiffness)
        })
        .expect("a law");
    let mass = PointMass::new(1.0)
        .and_then(|body| body.with_gravity(Vector3::z() * pull))
        .expect("a mass");
    let here = Isometry3::identity();
    let link = Link::new(
        Rod::new(1.0, law).expect("a rod"),
        Attachment::ground(here),
        Attachment::body(0, here),
        Joint::Ball,
    );
    let mut q = Vector6::zeros();
    q[5] = pull / link.units()[5];
    let low = Isometry3::translation(0.0, 0.0, 1.0 + pull / stiffness);
    let now = Configuration {
        bodies: vec![BodyMotion::at_rest(low)],
        charts: vec![q],
        spins: Vec::new(),
    };
    let assembly = Assembly::new(vec![Body::point(mass)], vec![link]).expect("an assembly");
    (assembly, now)
}

fn ended(
    assembly: &Assembly,
    start: &Configuration,
    (duration, tolerance): (f64, f64),
    method: Method,
    mut look: impl FnMut(&mut AssemblyRun, f64, f64),
) -> (AssemblySample, Cost) {
    let options = Options::new(duration)
        .and_then(|o| o.with_tolerance(tolerance))
        .expect("options")
        .with_method(method);
    let mut run = AssemblyRun::new(assembly.clone(), start, options).expect("a run");
    while let Some(event) = run.advance() {
        match event {
            Event::Step { from, to } => look(&mut run, from, to),
            Event::Stop(outcome) => assert_eq!(outcome, Outcome::EndOfTime),
            other => panic!("{other:?}"),
        }
    }
    (run.sample_now(), run.cost())
}

fn no_look(_: &mut AssemblyRun, _: f64, _: f64) {}

/// Distance of two states, in poses and in velocities.
fn apart(a: &AssemblySample, b: &AssemblySample) -> f64 {
    let pairs = a.at.now.bodies.iter().zip(&b.at.now.bodies);
    let each = pairs.map(|(a, b)| {
        let shift = (a.pose.translation.vector - b.pose.translation.vector).norm();
        let turn = a.pose.rotation.angle_to(&b.pose.rotation);
        worst([shift, turn, (a.twist - b.twist).norm()])
    });
    worst(each)
}

/// Catches steps limited by the fast stretch mode, and inaccurate slow motion with long steps: small swings are those
/// of the slowest mode, at the steps' ends and inside. Explicit steps would take some 60000 slopes.
#[test]
fn a_small_swing_on_a_stiff_rod_takes_few_steps() {
    let (assembly, mut start) = hanging(1e8, 20.0);
    let modes = assembly.modes(&start, 1e-10).expect("modes");
    let speed = 3e-3;
    start.bodies[0].twist = Vector6::new(0.0, 0.0, 0.0, 0.0, speed, 0.0);
    // The softer direction is across d2 or d1, as the mode shows.
    let along = |k: usize| modes.shapes[(1, k)].abs() > 0.9 * modes.shapes.column(k).amax();
    let slow = (0..2).find(|k| along(*k)).expect("a mode along y");
    let omega = modes.frequencies[slow];
    for method in [Method::Implicit, Method::Auto] {
        let mut off = 0.0_f64;
        let (end, cost) = ended(&assembly, &start, (3.0, 1e-7), method, |run, from, to| {
            for x in [0.3, 0.8, 1.0] {
                let t = from + x * (to - from);
                let state = run.state_at(t).expect("a state");
                let body = &state.at.now.bodies[0];
                let want = speed / omega * (omega * t).sin();
                let away = (body.pose.translation.y - want).abs();
                let faster = (body.twist[4] - speed * (omega * t).cos()).abs();
                off = worst([off, away, faster]);
            }
        });
        let error = worst([end.drift(), off]);
        assert!(error < 1e-7, "{method:?}: {error:e}");
        assert!(cost.evaluations < 4000, "{method:?}: {cost:?}");
        assert!(cost.implicit_steps > 3, "{method:?}: {cost:?}");
    }
}

/// Catches steps over a ringing mode: released below its rest, the mass oscillates as the mode of stretch.
#[test]
fn a_stretch_that_rings_is_followed() {
    let (assembly, mut start) = hanging(1e6, 20.0);
    let modes = assembly.modes(&start, 1e-10).expect("modes");
    let (amplitude, omega) = (1e-6, modes.frequencies[2]);
    assert!((omega / 1e3 - 1.0).abs() < 1e-3, "{omega}");
    start.bodies[0].pose.translation.z += amplitude;
    start.charts[0][5] += 1e6 * amplitude / assembly.links()[0].units()[5];
    let rest = 1.0 + 20.0 / 1e6;
    for method in [Method::Auto, Method::Explicit] {
        let (end, cost) = ended(&assembly, &start, (0.1, 1e-9), method, no_look);
        let body = &end.at.now.bodies[0];
        let (sin, cos) = (0.1 * omega).sin_cos();
        let off = body.pose.translation.z - rest - amplitude * cos;
        assert!(off.abs() < 1e-8, "{method:?}: {off:e}");
        let off = body.twist[5] + amplitude * omega * sin;
        assert!(off.abs() < 1e-5, "{method:?}: {off:e}");
        assert!(cost.steps > 100, "{method:?}: {cost:?}");
    }
}

/// Catches errors in the coupling of bodies, rods and rotations, and in the chart of a taut rod: implicit steps,
/// requested without stiffness, agree with explicit ones.
#[test]
fn implicit_steps_agree_with_explicit_ones() {
    let law = Linear::diagonal([1.0, 1.3], 0.8)
        .and_then(|law| law.with_shear([120.0, 120.0])?.with_axial(300.0))
        .and_then(|law| law.with_rest([0.3, 0.1], 0.2))
        .expect("a law");
    let body = RigidBody::new(1.0, Matrix3::from_diagonal(&Vector3::new(0.3, 0.2, 0.25)))
        .and_then(|body| body.with_centre(Vector3::new(0.05, 0.0, 0.1)))
        .and_then(|body| body.with_gravity(Vector3::new(0.3, 0.0, -0.5)))
        .expect("a body");
    let rod = Rod::new(1.0, law).expect("a rod");
    let here = Isometry3::identity();
    let lever = Isometry3::translation(0.0, 0.1, 0.05);
    let links = [
        (Attachment::ground(here), 0),
        (Attachment::body(0, lever), 1),
    ]
    .map(|(from, to)| Link::new(rod.clone(), from, Attachment::body(to, here), Joint::Weld));
    let end = links[0].end(&Vector6::zeros(), 1e-14).expect("an end").pose;
    let moving = Vector6::new(0.4, -0.6, 0.5, 0.3, 0.5, 0.1);
    let first = BodyMotion {
        pose: end,
        twist: moving,
    };
    let start = Configuration {
        bodies: vec![first, BodyMotion::at_rest(end * lever * end)],
        charts: vec![Vector6::zeros(); 2],
        spins: Vec::new(),
    };
    let carriers = vec![Body::rigid(body); 2];
    let two = Assembly::new(carriers, links.to_vec()).expect("an assembly");
    let (wire, mut swung) = hanging(1e6, 2000.0);
    swung.bodies[0].twist[3] = 5.0;
    swung.bodies[0].twist[4] = 3.0;
    for (assembly, start, duration, tolerance) in
        [(two, start, 0.5, 1e-9), (wire, swung, 0.01, 1e-8)]
    {
        let goal = (duration, tolerance);
        let [(explicit, _), (implicit, cost)] = [Method::Explicit, Method::Implicit]
            .map(|method| ended(&assembly, &start, goal, method, no_look));
        let off = apart(&explicit, &implicit);
        assert!(off < 10.0 * tolerance, "{off:e} at {tolerance:e}");
        assert!(2 * cost.implicit_steps > cost.steps, "{cost:?}");
        assert!(implicit.drift() < tolerance, "{:e}", implicit.drift());
    }
}
