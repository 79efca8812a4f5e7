//! Bodies on rods in space that hit obstacles, followed as assemblies.

use crate::impacts::{near, number};
use nalgebra::{Isometry3, Matrix3, UnitQuaternion, Vector2, Vector3, Vector6};
use snaprod::assembly::{Assembly, Attachment, Body, BodyMotion, Configuration, Joint, Link};
use snaprod::body::{Mass, PointMass, RigidBody};
use snaprod::contact::{Obstacle, RigidMotion, Shape, SurfacePair};
use snaprod::elastica::{Elastica, Equilibrium};
use snaprod::manifold::EquilibriumManifold;
use snaprod::motion::assembly::AssemblyRun;
use snaprod::motion::contact::{
    Bodies, BodyMotion as FreeMotion, BodyOptions, ContactEvent, ImpactRecord,
};
use snaprod::motion::{AmongObstacles, Event, Motion, Options, Outcome};
use snaprod::rod::Rod;
use snaprod::section::Linear;

fn among(bodies: &Bodies) -> AmongObstacles<'_> {
    AmongObstacles {
        bodies,
        resting_speed: 1e-6,
        max_impacts: 1000,
        rod_touches: false,
    }
}

/// Events and extremes of a run.
struct Told {
    events: Vec<ContactEvent>,
    outcome: Outcome,
    /// Largest change of the ledger, relative to its largest term.
    drift: f64,
    least_gap: f64,
}

fn follow(run: &mut dyn Motion<'_>) -> Told {
    let total = run.now().ledger().total();
    let mut told = Told {
        events: Vec::new(),
        outcome: Outcome::Interrupted,
        drift: 0.0,
        least_gap: f64::INFINITY,
    };
    while let Some(event) = run.advance() {
        let mut look = |state: &dyn snaprod::motion::State| {
            let drift = (state.ledger().total() - total).abs() / (1.0 + total.abs());
            assert!(drift >= 0.0);
            told.drift = told.drift.max(drift);
            let gap = state.contact().expect("obstacles").least_gap;
            told.least_gap = told.least_gap.min(gap);
        };
        look(&*run.now());
        if let Event::Step { from, to } = event {
            for x in [0.31, 0.93] {
                if let Some(state) = run.sample(from + x * (to - from)) {
                    look(&*state);
                }
            }
        }
        match event {
            Event::Contact(event) => told.events.push(event),
            Event::Stop(outcome) => told.outcome = outcome,
            _ => {}
        }
    }
    told
}

fn impacts(told: &Told) -> Vec<ImpactRecord> {
    let hits = told.events.iter().filter_map(|event| match event {
        ContactEvent::Impact(hit) => Some(*hit),
        _ => None,
    });
    hits.collect()
}

/// The strip of the planar cases in space: x of the plane is z here, y is x. It is stiff against bending out of the
/// plane and against twist.
fn strip<'a>(mass: PointMass<3>, bodies: &'a Bodies, duration: f64) -> AssemblyRun<'a> {
    let start = Equilibrium::new(-0.25, 1.3).expect("an equilibrium");
    let lifted = |v: Vector2<f64>| Vector3::new(v.y, 0.0, v.x);
    let at = Elastica.point(&[start.p, start.w].into());
    let at = at.expect("in the chart");
    let law = Linear::diagonal([20.0, 1.0], 20.0).and_then(|law| law.rigid([true; 3]));
    let rod = Rod::new(1.0, law.expect("a law")).expect("a rod");
    let bent = start.section(0.0).expect("a section").curvature;
    let n = lifted(-at.force);
    let ground = Attachment::ground(Isometry3::identity());
    let to = Attachment::body(0, Isometry3::identity());
    let link = Link::new(rod, ground, to, Joint::Ball);
    let chart = Vector6::new(0.0, bent, 0.0, n.x, n.y, n.z).component_div(&link.units());
    let begun = Configuration {
        bodies: vec![BodyMotion::at_rest(Isometry3::from_parts(
            lifted(at.pose).into(),
            Default::default(),
        ))],
        charts: vec![chart],
        spins: Vec::new(),
    };
    let assembly = Assembly::new(vec![Body::point(mass)], vec![link]).expect("an assembly");
    let options = Options::new(duration).and_then(|o| o.with_tolerance(1e-12));
    let run = AssemblyRun::new(assembly, &begun, options.expect("options")).expect("a run");
    run.among_obstacles(among(bodies)).expect("obstacles")
}

/// Catches contact forces, impacts and friction that act otherwise in space than in the plane: the given cases, from
/// another program.
#[test]
fn a_mass_in_space_bounces_as_in_the_plane() {
    for friction in [0.0, 0.15] {
        let all = crate::impacts::data("bounce_given.json");
        let mut all = all.as_array().expect("cases").iter();
        let case = all
            .find(|case| case["friction"] == friction)
            .expect("a case");
        let load = Vector3::new(-3.0, 0.0, -6.0);
        let mass = || {
            PointMass::new(1.0)
                .and_then(|m| m.with_dead_force(load))
                .expect("m")
        };
        let mut bodies = Bodies::new(SurfacePair::new(0.5, friction).expect("a surface"));
        bodies
            .add_body(Mass::Point(mass()), Shape::Point)
            .expect("a body");
        let floor = Obstacle::plane(Vector3::new(-0.3, 0.0, 0.0), Vector3::x());
        bodies.add_obstacle(floor.expect("a plane"));
        let mut run = strip(mass(), &bodies, 2.0);
        let told = follow(&mut run);
        assert_eq!(told.outcome, Outcome::EndOfTime);
        assert!(told.drift < 1e-9 && told.least_gap > -1e-11);
        let hits = impacts(&told);
        let given = case["impacts"].as_array().expect("impacts");
        for (hit, given) in hits.iter().zip(given).take(6) {
            near(hit.t, number(given, "t"), 1e-10);
            near(hit.point.z, number(given, "x"), 1e-10);
            near(hit.lost, number(given, "lost"), 1e-9);
        }
        let last = run.sample_now();
        let place = last.at.now.bodies[0].pose.translation.vector;
        // The given end leaves out the impulse of the last bounces.
        near(place.z, case["end"]["r"][0].as_f64().expect("r"), 1e-7);
        let contact = last.contact.expect("obstacles");
        let lost = contact.impact_lost + contact.friction_lost;
        near(lost, number(case, "lost"), 1e-7);
        near(last.ledger.dissipated, lost, 1e-12);
    }
}

/// A body with the moments of inertia of a box.
fn block(sides: Vector3<f64>) -> RigidBody {
    let [a, b, c] = [sides.x, sides.y, sides.z].map(|s| s * s / 12.0);
    let inertia = Matrix3::from_diagonal(&Vector3::new(b + c, a + c, a + b));
    let gravity = Vector3::new(0.0, 0.0, -2.0);
    let body = RigidBody::new(1.0, inertia).expect("a body");
    body.with_gravity(gravity).expect("gravity")
}

/// Catches contact forces at a wrong lever or with a wrong inertia, and events that are lost beside the rods. A rod
/// that is too weak to do anything leaves the motion of a free body, which other tests compare with given data.
#[test]
fn bodies_on_weak_rods_move_as_free_ones() {
    let sides = Vector3::new(0.3, 0.2, 0.1);
    let shapes = [
        Shape::ball(0.1),
        Shape::capsule(0.3, 0.05),
        Shape::cylinder(0.2, 0.06),
        Shape::cuboid(sides),
    ];
    for shape in shapes.map(|shape| shape.expect("a shape")) {
        let turn = UnitQuaternion::from_euler_angles(0.4, 0.3, 0.2);
        let pose = Isometry3::from_parts(Vector3::new(0.1, 0.05, 0.5).into(), turn);
        let twist = Vector6::new(0.3, -0.5, 0.8, 0.4, 0.1, 0.0);
        let mass = block(sides);
        let mut bodies = Bodies::new(SurfacePair::new(0.4, 0.4).expect("a surface"));
        let added = bodies.add_body(Mass::Rigid(mass.clone()), shape);
        added.expect("a body");
        let floor = Obstacle::plane(Vector3::zeros(), Vector3::z());
        bodies.add_obstacle(floor.expect("a plane"));
        let start = RigidMotion::new(pose, &twist);
        let options = BodyOptions::new(DURATION).and_then(|o| o.with_tolerance(1e-12));
        let free = FreeMotion::new(&bodies, &[start], options.expect("options"));
        let mut free = free.expect("a motion");
        let mut expected = Vec::new();
        while let Some(event) = free.advance() {
            if let Event::Contact(event) = event {
                expected.push(event);
            }
        }
        let law = Linear::diagonal([WEAK; 2], WEAK).and_then(|law| law.rigid([true; 3]));
        // Longer than any way of the body: a taut rod is stiff, and steps among obstacles are explicit.
        let rod = Rod::new(2.0, law.expect("a law")).expect("a rod");
        let lever = Isometry3::translation(0.0, 0.0, 0.2);
        let end = pose * lever;
        let bent = Isometry3::rotation(Vector3::new(0.3, 0.2, 0.1));
        let base = end * bent * Isometry3::translation(0.1, 0.0, -0.8);
        let to = Attachment::body(0, lever);
        let link = Link::new(rod, Attachment::ground(base), to, Joint::Weld);
        let assembly = Assembly::new(vec![Body::rigid(mass)], vec![link]).expect("an assembly");
        let held = assembly.held(vec![BodyMotion { pose, twist }], 1e-12);
        let options = Options::new(DURATION).and_then(|o| o.with_tolerance(1e-11));
        let run = AssemblyRun::new(assembly, &held, options.expect("options"));
        let run = run.and_then(|run| run.among_obstacles(among(&bodies)));
        let mut run = run.expect("a run");
        let told = follow(&mut run);
        assert_eq!(told.outcome, Outcome::EndOfTime, "{shape:?}");
        assert!(told.drift < 1e-9 && told.least_gap > -1e-9, "{shape:?}");
        let keys = |events: &[ContactEvent]| -> Vec<&str> {
            events.iter().map(ContactEvent::key).collect()
        };
        assert_eq!(keys(&told.events), keys(&expected), "{shape:?}");
        for (event, expected) in told.events.iter().zip(&expected) {
            near(event.time(), expected.time(), 1e-6);
        }
        let (seen, other) = (run.sample_now().at.now.bodies[0], free.now().motions[0]);
        let way = seen.pose.translation.vector - other.pose.translation.vector;
        let turn = seen.pose.rotation.angle_to(&other.pose.rotation);
        assert!(way.norm() < 1e-5 && turn < 1e-4, "{shape:?}: {way} {turn}");
    }
}

/// Stiffness of a rod that does nothing, and the duration.
const WEAK: f64 = 1e-10;
const DURATION: f64 = 0.9;
