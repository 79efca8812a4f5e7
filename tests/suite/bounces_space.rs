//! Bounces of taut rods in space and in assemblies: comparison with the planar rod and closed forms of the bent ends.

use nalgebra::{Isometry3, Matrix3, Rotation3, UnitQuaternion, Vector2, Vector3, Vector6};
use snaprod::assembly::{Assembly, Attachment, Body, BodyMotion, Configuration, Joint, Link};
use snaprod::body::{PointMass, RigidBody};
use snaprod::elastica::{Elastica, Equilibrium};
use snaprod::manifold::EquilibriumManifold;
use snaprod::math::se3::join;
use snaprod::motion::assembly::AssemblyRun;
use snaprod::motion::{Bounce, Event, Motion, Options, Outcome, Run};
use snaprod::rod::{Rod, Tip};
use snaprod::section::Linear;

fn close(what: &str, found: f64, wanted: f64, bound: f64) {
    let off = (found / wanted - 1.0).abs();
    assert!(
        off <= bound,
        "{what}: {found} and {wanted}, {off:.1e} > {bound:.0e}"
    );
}

fn options(duration: f64) -> Options {
    Options::new(duration)
        .and_then(|o| o.with_tolerance(1e-10))
        .unwrap()
}

/// The bounces of a run, each with the state at the rod's end on the body: stored energy, force on the rod along the
/// base's directors, position.
fn bounces(
    assembly: Assembly,
    start: &Configuration,
    duration: f64,
) -> Vec<(Bounce, f64, Vector3<f64>, Isometry3<f64>)> {
    let mut run = AssemblyRun::new(assembly, start, options(duration)).unwrap();
    let mut found = Vec::new();
    while let Some(event) = run.advance() {
        match event {
            Event::Bounce(bounce) => {
                let there = run.sample(bounce.t).expect("within the last step");
                let force = -there.action().fixed_rows::<3>(3).into_owned();
                let shown = (there.ledger().elastic, force, there.pose());
                drop(there);
                found.push((bounce, shown.0, shown.1, shown.2));
            }
            Event::Stop(outcome) => assert_eq!(outcome, Outcome::EndOfTime),
            _ => {}
        }
    }
    found
}

/// A planar start in space, the rod stiffer out of its plane. Would catch a bounce whose definition differs from the
/// plane's, a bounce missed or counted twice, and a wrong unit of stiffness.
#[test]
fn a_planar_bounce_is_the_same_in_space() {
    let start = Equilibrium::from_lambda_kappa(2.0, 0.3).unwrap();
    let q = Vector2::new(start.p, start.w);
    let velocity = Vector2::new(1.0, 2.0);
    let body = PointMass::<2>::new(1.0).unwrap();
    let mut run = Run::new(&Elastica, &body, q, velocity, options(2.0)).unwrap();
    let plane = run.find_map(|event| match event {
        Event::Bounce(bounce) => Some(bounce),
        _ => None,
    });
    let plane = plane.expect("a bounce");

    // The clamp's axis x of the plane is z in space, y is x; a couple along y bends z towards x.
    let lifted = |v: Vector2<f64>| Vector3::new(v.y, 0.0, v.x);
    let law = Linear::diagonal([3.0, 1.0], 1.0).unwrap();
    let rod = Rod::new(1.0, law).unwrap();
    let [clamp, end] = [Attachment::ground, |at| Attachment::body(0, at)]
        .map(|on: fn(_) -> _| on(Isometry3::identity()));
    let link = Link::new(rod, clamp, end, Joint::Ball);
    let at = Elastica.point(&q).unwrap();
    let couple = Vector3::new(0.0, start.section(0.0).unwrap().curvature, 0.0);
    let now = Configuration {
        bodies: vec![BodyMotion {
            pose: Isometry3::from_parts(lifted(at.pose).into(), UnitQuaternion::identity()),
            twist: join(&Vector3::zeros(), &lifted(velocity)),
        }],
        charts: vec![join(&couple, &lifted(-at.force)).component_div(&link.units())],
        spins: Vec::new(),
    };
    let mass = Body::point(PointMass::new(1.0).unwrap());
    let assembly = Assembly::new(vec![mass], vec![link]).unwrap();
    let all = bounces(assembly, &now, plane.t + 0.005);
    assert_eq!(all.len(), 1);
    let space = &all[0].0;
    close("time", space.t, plane.t, 1e-6);
    close("tension", space.tension, plane.tension, 1e-5);
    close("energy", space.elastic, plane.elastic, 1e-6);
    close("mass", space.mass, 1.0, 1e-12);
    close(
        "number",
        space.inertia(0.01, 1.0),
        plane.inertia(0.01, 1.0),
        1e-5,
    );
    close("friction", space.viscosity(), plane.viscosity(), 1e-5);
    // sqrt(eps) v/(4 S^2) of theory 2.8, S of the pull.
    let s2 = (0.25 * plane.pose[1].atan2(plane.pose[0])).sin().powi(2);
    let leading = 0.1 * plane.speed() / (4.0 * s2);
    close("leading order", plane.inertia(0.01, 1.0), leading, 0.2);
}

/// A rod between the ground and a body, pulled with sqrt(n) = 30 and welded to both, its base bent about d1 and its
/// end about d2. The body moves off along the pull at `speed`; a dead force bears the part `borne` of the pull.
fn thrown(law: Linear, speed: f64, borne: f64) -> (Assembly, Configuration) {
    let n = Vector3::new(0.0, 1.2_f64.sin(), 1.2_f64.cos()) * 900.0;
    let middle = Rotation3::from_axis_angle(&Vector3::x_axis(), -1.2);
    let tip = middle * Rotation3::from_axis_angle(&Vector3::y_axis(), 0.8);
    let rod = Rod::new(1.0, law).unwrap();
    let base = join(&Vector3::zeros(), &n);
    let taut = rod.taut(&base, &Tip::Turned(*tip.matrix()), None, 1e-12);
    let taut = taut.unwrap();
    let arm = Vector3::new(0.1, 0.05, 0.02);
    let turn = UnitQuaternion::from_rotation_matrix(&tip);
    let to = Attachment::body(
        0,
        Isometry3::from_parts(arm.into(), UnitQuaternion::identity()),
    );
    let link = Link::new(
        rod,
        Attachment::ground(Isometry3::identity()),
        to,
        Joint::Weld,
    );
    let now = Configuration {
        bodies: vec![BodyMotion {
            pose: Isometry3::from_parts((taut.end.position - turn * arm).into(), turn),
            twist: join(&Vector3::zeros(), &(n.normalize() * speed)),
        }],
        charts: vec![taut.base.component_div(&link.units())],
        spins: Vec::new(),
    };
    let body = RigidBody::new(1.0, inertia())
        .and_then(|body| body.with_dead_force(n * borne))
        .unwrap();
    let assembly = Assembly::new(vec![Body::rigid(body)], vec![link]).unwrap();
    (assembly, now)
}

fn inertia() -> Matrix3<f64> {
    Matrix3::from_diagonal(&Vector3::new(0.5, 0.4, 0.6))
}

/// Both ends welded and bent in perpendicular planes with two stiffnesses. Each end shortens the reach by 4
/// sin^2(gam/4) sqrt(B/n) (theory 2.8), the stored energy is n times that, and the body resists with its mass and
/// inertia. Would catch a missing stiffness, end or lever, and a radial energy other than the stored one.
#[test]
fn a_bounce_of_a_rod_welded_at_both_ends() {
    let (assembly, now) = thrown(Linear::diagonal([2.0, 1.0], 0.8).unwrap(), 4.0, 0.0);
    let all = bounces(assembly, &now, 0.012);
    assert_eq!(all.len(), 1);
    let (bounce, stored, n, end) = &all[0];
    let along = n.normalize();
    let of = |tangent: Vector3<f64>| (0.25 * tangent.angle(&along)).sin().powi(2);
    let bent = of(Vector3::z()) * 2_f64.sqrt() + of(end.rotation * Vector3::z());
    let elastic = 4.0 * bent * n.norm().sqrt();
    close("tension", bounce.tension, n.norm(), 1e-9);
    close("lambda", bounce.lambda, (n.norm() * 0.75).sqrt(), 1e-9);
    close("bent ends", bounce.elastic, elastic, 1e-3);
    close("stored", bounce.elastic, *stored, 1e-3);
    assert!(bounce.velocity.dot(n).abs() < 1e-6 * n.norm());
    let arm = Vector3::new(0.1, 0.05, 0.02);
    let lever = arm.cross(&(end.rotation.inverse() * along));
    let give = 1.0 + lever.dot(&(inertia().try_inverse().unwrap() * lever));
    close("mass", bounce.mass, 1.0 / give, 1e-9);
    // sqrt(2 eps/d).
    let number = (2.0 * 1e-3 * n.norm() / (bounce.mass * elastic)).sqrt();
    close("number", bounce.inertia(1e-3, 1.0), number, 1e-3);
    // The energy of separation is stored: (1 + (lever x n)^2) times the inertia reverses the motion from v = 4
    // (leading order in 1/lambda).
    let before = 4.0 * (2_f64.sqrt() * 0.3_f64.sin().powi(2) + 0.2_f64.sin().powi(2)) * 30.0;
    close("energy", bounce.elastic, before + 8.0 / give, 0.05);
}

/// Would catch false bounces: of a body that vibrates slowly along a taut rod under a load, and of an extensible rod.
#[test]
fn what_shakes_under_a_load_or_stretches_does_not_bounce() {
    let law = || Linear::diagonal([2.0, 1.0], 0.8).unwrap();
    let soft = law().with_axial(1e6).unwrap();
    for (law, speed, borne) in [(law(), 0.3, 1.0), (soft, 4.0, 0.0)] {
        let (assembly, now) = thrown(law, speed, borne);
        let all = bounces(assembly, &now, 0.02);
        assert!(all.is_empty(), "{:?}", all[0].0);
    }
}

/// Two bodies that fly apart, joined by a rod: each recoils. Would catch a base body left out, or a wrong order of
/// ends.
#[test]
fn two_bodies_bounce_with_their_reduced_mass() {
    let (single, mut now) = thrown(Linear::diagonal([2.0, 1.0], 0.8).unwrap(), 2.0, 0.0);
    let [ground, body] = [single.links()[0].from(), single.links()[0].to()];
    let from = Attachment::body(1, ground.place);
    let link = Link::new(
        single.links()[0].rod().clone(),
        from,
        body.clone(),
        Joint::Weld,
    );
    let carrier = |mass| Body::rigid(RigidBody::new(mass, inertia() * 1e6).unwrap());
    now.bodies.push(BodyMotion {
        pose: Isometry3::identity(),
        twist: Vector6::zeros() - now.bodies[0].twist,
    });
    let assembly = Assembly::new(vec![carrier(1.0), carrier(3.0)], vec![link]).unwrap();
    let all = bounces(assembly, &now, 0.012);
    assert_eq!(all.len(), 1);
    close("mass", all[0].0.mass, 0.75, 1e-6);
}

/// A scene of one rod in units of its own. Would catch a scale, name or mass lost between the run and its files.
#[cfg(feature = "scene")]
#[test]
fn an_assembly_tells_its_bounces() {
    use snaprod::scene::Scene;
    use snaprod::study::run::{Fields, Prepared, run};
    use snaprod::study::{Silent, Table};
    let scene = Scene::parse(
        r#"
        units = "si"
        [[rod]]
        name = "tether"
        model = "cosserat"
        length = 0.5
        section = { bending = [2.0, 1.0], torsion = 0.8 }
        mass = 0.002
        inertia = "none"
        from = {}
        to = { body = "stone", joint = "ball" }
        [[body]]
        name = "stone"
        mass = 2.0
        force = [8.0, 0.0, 2.0]
        velocity = [2.0, 0.0, 2.0]
        [run]
        duration = 0.006
        tolerance = 1e-7
        samples = 3
        "#,
    )
    .unwrap_or_else(|faults| panic!("{faults}"));
    let prepared = Prepared::new(&scene).unwrap();
    let mut tables: Vec<Table> = Vec::new();
    let record = run(&prepared, Fields::None, &mut tables, &mut Silent).unwrap();
    let summary = record.summary();
    assert_eq!(summary["bounces"]["count"], 1);
    let told = &summary["bounces"]["hardest"];
    let passed = &summary["validity"]["bounces"][0];
    assert_eq!(
        (&told["rod"], &passed["rod"]),
        (&"tether".into(), &"tether".into())
    );
    let number = |key: &str| told[key].as_f64().unwrap();
    let (tension, elastic) = (number("tension"), number("elastic"));
    // The base alone is bent, in the plane of the softer stiffness, B = 1. All of the pull's work on the mass is
    // stored in the base: n d = 4 S^2 sqrt(n).
    let s2 = 0.25 * elastic / tension.sqrt();
    assert!((0.01..0.2).contains(&s2), "S^2 = {s2}");
    let inertia = passed["inertia_number"].as_f64().unwrap();
    close(
        "number",
        inertia,
        (2.0 * 0.001 * 0.5 * tension / elastic).sqrt(),
        1e-9,
    );
    // m v/((16/15) n), m v^2/2 = n d.
    let time = (2.0 * 2.0 * elastic).sqrt() / (16.0 / 15.0 * tension);
    close("friction", number("friction_time"), time, 1e-9);
    assert!(
        record
            .bounces()
            .is_some_and(|text| text.starts_with("1 bounce at full reach"))
    );
}
