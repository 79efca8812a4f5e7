//! Motion of bodies with shapes that hit obstacles and each other.

use super::impacts::{data, near, number};
use nalgebra::{Isometry3, Matrix3, Rotation3, UnitQuaternion, Vector3};
use snaprod::body::{History, Mass, PointMass, RigidBody, Support};
use snaprod::contact::{
    ContactPair, ImpactLaw, MovingObstacle, Obstacle, PlacedShape, RigidMotion, Shape, SurfacePair,
};
use snaprod::math::elliptic::complete_k;
use snaprod::motion::contact::{
    Bodies, BodyMotion, BodyOptions, ContactEvent, ImpactRecord, Partner, RuleOfImpact,
};
use snaprod::motion::{Event, Outcome};

fn v(x: f64, y: f64, z: f64) -> Vector3<f64> {
    Vector3::new(x, y, z)
}

fn at(place: Vector3<f64>, velocity: Vector3<f64>) -> RigidMotion {
    RigidMotion {
        velocity,
        ..RigidMotion::at_rest(Isometry3::translation(place.x, place.y, place.z))
    }
}

fn point(gravity: Vector3<f64>) -> Mass {
    let mass = PointMass::new(1.0).and_then(|mass| mass.with_gravity(gravity));
    Mass::Point(mass.expect("a mass"))
}

/// A body of mass 1 with these moments of inertia.
fn rigid(moments: Vector3<f64>, gravity: Vector3<f64>) -> Mass {
    let body = RigidBody::new(1.0, Matrix3::from_diagonal(&moments));
    Mass::Rigid(body.and_then(|b| b.with_gravity(gravity)).expect("a body"))
}

fn ball(radius: f64, gravity: Vector3<f64>) -> Mass {
    rigid(Vector3::repeat(0.4 * radius * radius), gravity)
}

fn floor() -> Obstacle {
    Obstacle::plane(Vector3::zeros(), Vector3::z()).expect("a plane")
}

fn surface(restitution: f64, friction: f64) -> SurfacePair {
    SurfacePair::new(restitution, friction).expect("a surface")
}

fn options(duration: f64) -> BodyOptions {
    BodyOptions::new(duration).expect("options")
}

/// The motion of one body over obstacles.
fn alone(
    mass: Mass,
    shape: Shape,
    obstacle: impl Into<MovingObstacle>,
    pair: SurfacePair,
) -> Bodies {
    let mut bodies = Bodies::new(pair);
    bodies.add_body(mass, shape).expect("a body");
    bodies.add_obstacle(obstacle);
    bodies
}

/// Runs to the end. Checks that the ledger closes to `tolerance`, that nothing overlaps, that friction stays in its
/// cone, and that losses grow.
fn run(motion: &mut BodyMotion<'_>, tolerance: f64) -> Vec<ContactEvent> {
    let start = motion.now().ledger;
    let (mut events, mut lost) = (Vec::new(), 0.0);
    while let Some(event) = motion.advance() {
        match event {
            Event::Contact(event) => events.push(event),
            Event::Stop(outcome) => assert_eq!(outcome, Outcome::EndOfTime),
            _ => {}
        }
        let now = motion.now();
        let error = (now.ledger.total() - start.total()).abs();
        assert!(
            error <= tolerance * (1.0 + now.ledger.largest()),
            "ledger {error:e}"
        );
        assert!(now.least_gap >= -1e-11, "gap {:e}", now.least_gap);
        assert!(now.ledger.friction_loss >= lost - 1e-14);
        lost = now.ledger.friction_loss;
        for contact in &now.contacts {
            assert!(contact.normal_force >= -1e-9, "{contact:?}");
        }
    }
    events
}

fn impacts(events: &[ContactEvent]) -> Vec<ImpactRecord> {
    let records = events.iter().filter_map(|event| match event {
        ContactEvent::Impact(record) => Some(*record),
        _ => None,
    });
    records.collect()
}

fn keys(events: &[ContactEvent]) -> Vec<&'static str> {
    events.iter().map(ContactEvent::key).collect()
}

/// Catches bounces that drift, that are missed, or that cost many steps each: a ball bounces a thousand times.
#[test]
fn a_thousand_bounces() {
    let bodies = alone(
        point(v(0.0, 0.0, -2.0)),
        Shape::ball(0.1).unwrap(),
        floor(),
        surface(1.0, 0.0),
    );
    let start = [at(v(0.0, 0.0, 1.1), v(0.3, 0.0, 0.0))];
    let mut motion = BodyMotion::new(&bodies, &start, options(2000.0)).unwrap();
    let events = impacts(&run(&mut motion, 1e-10));
    assert_eq!(events.len(), 1000);
    near(events[999].t, 1999.0, 1e-11);
    near(motion.now().motions[0].pose.translation.z, 1.1, 1e-9);
    assert!(motion.cost().steps < 1100, "{:?}", motion.cost());
}

/// Catches impacts of two pairs at one moment of which one is lost, or taken late.
#[test]
fn two_bodies_hit_at_one_moment() {
    let mut bodies = Bodies::new(surface(1.0, 0.0));
    for _ in 0..2 {
        bodies
            .add_body(point(v(0.0, 0.0, -2.0)), Shape::ball(0.1).unwrap())
            .unwrap();
    }
    bodies.add_obstacle(floor());
    let start = [-1.0, 1.0].map(|x| at(v(x, 0.0, 1.1), Vector3::zeros()));
    let mut motion = BodyMotion::new(&bodies, &start, options(20.0)).unwrap();
    let hits = impacts(&run(&mut motion, 1e-11));
    assert_eq!(hits.len(), 20);
    for (k, hit) in hits.iter().enumerate() {
        near(hit.t, 1.0 + 2.0 * (k / 2) as f64, 1e-12);
    }
}

/// Catches a wrong time of accumulation, an endless list of impacts, and a ball that falls through the floor after it.
#[test]
fn bounces_accumulate() {
    for (e, friction) in [(0.5, 0.0), (0.9, 0.0), (0.5, 0.2)] {
        let bodies = alone(
            ball(0.1, v(0.0, 0.0, -2.0)),
            Shape::ball(0.1).unwrap(),
            floor(),
            surface(e, friction),
        );
        let start = [at(v(0.0, 0.0, 1.1), v(0.3, 0.0, 0.0))];
        let end = 1.0 + 2.0 * e / (1.0 - e);
        let mut motion = BodyMotion::new(&bodies, &start, options(end + 1.0)).unwrap();
        let events = run(&mut motion, 1e-11);
        let closes = events
            .iter()
            .find(|e| e.key() == "accumulation")
            .expect("it closes");
        near(closes.time(), end, 1e-9);
        assert!(impacts(&events).len() < 200);
        let now = motion.now();
        near(now.motions[0].pose.translation.z, 0.1, 1e-14);
        near(now.contacts[0].normal_force, 2.0, 1e-13);
        // With friction the ball rolls after the first impacts: 5/7 of its speed.
        near(
            now.motions[0].velocity.x,
            if friction > 0.0 { 0.3 * 5.0 / 7.0 } else { 0.3 },
            1e-12,
        );
    }
}

/// Catches an accumulation whose friction is lost: a slow slide over many bounces loses friction times the normal
/// impulse, whatever the bounces.
#[test]
fn friction_while_bounces_accumulate() {
    let bodies = alone(
        point(v(0.0, 0.0, -2.0)),
        Shape::Point,
        floor(),
        surface(0.8, 0.1),
    );
    let start = [at(v(0.0, 0.0, 0.01), v(5.0, 0.0, 0.0))];
    let mut motion = BodyMotion::new(&bodies, &start, options(2.0)).unwrap();
    run(&mut motion, 1e-11);
    // Until the end the floor has given the impulse 2 t in all.
    near(
        motion.now().motions[0].velocity.x,
        5.0 - 0.1 * 2.0 * 2.0,
        1e-12,
    );
}

/// Catches a wrong time of stop, a wrong choice between stick and reversal, and a wrong friction: a point thrown up a
/// slope.
#[test]
fn slide_stick_and_reverse() {
    for case in data("small_given.json")["point_coulomb"]
        .as_array()
        .unwrap()
    {
        let (g, angle) = (number(case, "g"), number(case, "angle"));
        let weight = v(-g * angle.sin(), 0.0, -g * angle.cos());
        let bodies = alone(
            point(weight),
            Shape::Point,
            floor(),
            surface(0.3, number(case, "mu")),
        );
        let start = [at(Vector3::zeros(), v(number(case, "v0"), 0.0, 0.0))];
        let mut motion = BodyMotion::new(&bodies, &start, options(1.0)).unwrap();
        let events = run(&mut motion, 1e-13);
        let sticks = case["sticks"].as_bool().unwrap();
        assert_eq!(keys(&events), [if sticks { "stick" } else { "reverse" }]);
        let stop = number(case, "stop_time");
        near(events[0].time(), stop, 1e-13);
        let back = case["slide_back_acceleration"].as_f64().unwrap_or(0.0);
        let rest = 1.0 - stop;
        near(motion.now().motions[0].velocity.x, -back * rest, 1e-13);
        let place = number(case, "stop_distance") - 0.5 * back * rest * rest;
        near(motion.now().motions[0].pose.translation.x, place, 1e-13);
    }
}

/// Catches a sphere that does not begin to roll in time, or rolls with friction.
#[test]
fn a_sphere_slides_then_rolls() {
    let case = &data("bodies_given.json")["roll"][0];
    let radius = number(case, "radius");
    let mass = ball(radius, v(0.0, 0.0, -number(case, "g")));
    let bodies = alone(
        mass,
        Shape::ball(radius).unwrap(),
        floor(),
        surface(0.0, number(case, "mu")),
    );
    let start = [at(v(0.0, 0.0, radius), v(number(case, "v0"), 0.0, 0.0))];
    let mut motion = BodyMotion::new(&bodies, &start, options(0.5)).unwrap();
    let events = run(&mut motion, 1e-13);
    assert_eq!(keys(&events), ["stick"]);
    near(events[0].time(), number(case, "t_roll"), 1e-13);
    let now = motion.now();
    near(now.motions[0].velocity.x, number(case, "v_roll"), 1e-13);
    near(now.motions[0].spin.y, number(case, "spin"), 1e-13);
    let place = number(case, "distance") + number(case, "v_roll") * (0.5 - number(case, "t_roll"));
    near(now.motions[0].pose.translation.x, place, 1e-13);
    near(
        2.0 * now.ledger.friction_loss,
        number(case, "dissipated_fraction"),
        1e-13,
    );
}

/// Catches a wrong coupling of spin and slip at a ball's contact, and a wrong loss.
#[test]
fn spheres_hit_a_plane_and_each_other() {
    for case in data("bodies_given.json")["sphere_plane"]
        .as_array()
        .unwrap()
    {
        let radius = 0.3;
        let pair = surface(number(case, "e"), number(case, "mu"));
        let bodies = alone(
            ball(radius, Vector3::zeros()),
            Shape::ball(radius).unwrap(),
            floor(),
            pair,
        );
        let mut start = at(
            v(0.0, 0.0, radius + 1.0),
            v(number(case, "vt"), 0.0, -number(case, "vn")),
        );
        start.spin.y = -number(case, "spin_R") / radius;
        let mut motion = BodyMotion::new(&bodies, &[start], options(1.0)).unwrap();
        let hits = impacts(&run(&mut motion, 1e-13));
        let after = motion.now().motions[0];
        near(after.velocity.z, number(case, "vn_after"), 1e-13);
        near(after.velocity.x, number(case, "vt_after"), 1e-13);
        near(-after.spin.y * radius, number(case, "spin_R_after"), 1e-13);
        near(hits[0].lost, number(case, "lost_per_mass"), 1e-13);
        assert_eq!(hits[0].sticks, case["sticks"].as_bool().unwrap());
        assert_eq!(hits[0].rule, RuleOfImpact::Law(ImpactLaw::Stronge));
    }
    let case = &data("bodies_given.json")["spheres"][0];
    let mut bodies = Bodies::new(surface(number(case, "e"), 0.0));
    for mass in ["m1", "m2"] {
        let mass = PointMass::new(number(case, mass)).unwrap();
        bodies
            .add_body(Mass::Point(mass), Shape::ball(0.5).unwrap())
            .unwrap();
    }
    let angle = number(case, "impact_angle");
    let velocity = v(angle.cos(), angle.sin(), 0.0);
    let start = [
        at(-v(1.0, 0.0, 0.0) - velocity, velocity),
        at(Vector3::zeros(), Vector3::zeros()),
    ];
    let mut motion = BodyMotion::new(&bodies, &start, options(2.0)).unwrap();
    let hits = impacts(&run(&mut motion, 1e-13));
    near(hits[0].t, 1.0, 1e-13);
    near(hits[0].lost, number(case, "lost"), 1e-13);
    for (body, key) in ["v1_after", "v2_after"].into_iter().enumerate() {
        let velocity = motion.now().motions[body].velocity;
        near(velocity.x, case[key][0].as_f64().unwrap(), 1e-13);
        near(velocity.y, case[key][1].as_f64().unwrap(), 1e-13);
    }
}

/// Catches a wrong lever of a capsule's end: a rod dropped at an angle.
#[test]
fn a_rod_dropped_at_an_angle() {
    let case = &data("bodies_given.json")["rod_drop"][0];
    let length = number(case, "length");
    let moment = length * length / 12.0;
    let bodies = alone(
        rigid(v(moment, moment, 1e-3), Vector3::zeros()),
        Shape::capsule(length, 0.01).unwrap(),
        floor(),
        surface(number(case, "e"), 0.0),
    );
    let tilt = UnitQuaternion::from_axis_angle(
        &Vector3::y_axis(),
        std::f64::consts::FRAC_PI_2 - number(case, "angle"),
    );
    let mut start = at(v(0.0, 0.0, 1.0), v(0.0, 0.0, -number(case, "v")));
    start.pose.rotation = tilt;
    let mut motion = BodyMotion::new(&bodies, &[start], options(1.0)).unwrap();
    let hits = impacts(&run(&mut motion, 1e-12));
    let after = motion.now().motions[0];
    near(hits[0].impulse.z, number(case, "impulse"), 1e-13);
    near(after.velocity.z, number(case, "v_after"), 1e-13);
    near(after.spin.norm(), number(case, "spin_after"), 1e-13);
    near(hits[0].lost, number(case, "lost"), 1e-13);
}

/// Catches landings on two corners at once that chatter, or that keep the old corner down: Housner's rocking block.
#[test]
fn a_block_rocks() {
    let case = &data("bodies_given.json")["rocking"][0];
    let (w, h) = (number(case, "width"), number(case, "height"));
    let moments = v(h * h, w * w, w * w + h * h) / 12.0;
    let plane = Obstacle::plane(Vector3::zeros(), Vector3::y()).unwrap();
    let block = rigid(moments, v(0.0, -number(case, "g"), 0.0));
    let bodies = alone(
        block,
        Shape::cuboid(v(w, h, 0.0)).unwrap(),
        plane,
        surface(0.0, 1.0),
    );
    let turn = UnitQuaternion::from_axis_angle(&Vector3::z_axis(), -number(case, "start_angle"));
    let centre = turn * v(-0.5 * w, 0.5 * h, 0.0);
    let start = RigidMotion::at_rest(Isometry3::from_parts(centre.into(), turn));
    let mut motion = BodyMotion::new(&bodies, &[start], options(2.3)).unwrap();
    let mut peaks = Vec::new();
    let mut hits = Vec::new();
    let (mut spin, mut before) = (0.0, motion.now());
    let angle = |motion: &RigidMotion| motion.pose.rotation.scaled_axis().z;
    let total = before.ledger.total();
    while let Some(event) = motion.advance() {
        match event {
            Event::Contact(ContactEvent::Impact(hit)) => {
                hits.push((hit, motion.now().motions[0].spin.z / spin));
            }
            Event::Contact(event) => assert_eq!(event.key(), "release"),
            Event::Step { from, to } => {
                let now = motion.now();
                if before.motions[0].spin.z * now.motions[0].spin.z < 0.0
                    && before.motions[0].spin.z.abs() < 0.6
                {
                    // The peak lies where the spin changes its sign.
                    let (mut low, mut high) = (from, to);
                    for _ in 0..60 {
                        let middle = 0.5 * (low + high);
                        let there = motion.sample(middle).expect("inside the step");
                        if there.motions[0].spin.z * before.motions[0].spin.z > 0.0 {
                            low = middle;
                        } else {
                            high = middle;
                        }
                    }
                    let there = motion.sample(high).expect("inside the step");
                    peaks.push((high, angle(&there.motions[0]).abs()));
                }
                spin = motion
                    .sample(to.next_down().max(from))
                    .map_or(spin, |s| s.motions[0].spin.z);
                before = now;
            }
            _ => {}
        }
        near(motion.now().ledger.total(), total, 1e-11);
    }
    near(hits[0].0.t, number(case, "first_landing"), 1e-11);
    let then = case["then"].as_array().unwrap();
    assert_eq!(hits.len(), 4);
    for ((hit, ratio), given) in hits.iter().zip(then) {
        near(hit.t, number(given, "landing_t"), 1e-10);
        assert_eq!(hit.rule, RuleOfImpact::Simultaneous);
        near(*ratio, number(case, "spin_ratio"), 1e-9);
    }
    assert_eq!(peaks.len(), 4, "{peaks:?}");
    for ((t, peak), given) in peaks.iter().zip(then) {
        near(*t, number(given, "peak_t"), 1e-9);
        near(*peak, number(given, "peak_angle"), 1e-10);
    }
}

/// Catches a touch that hides inside a long step, and a pass that is taken for a touch: a point passes a thin capsule.
#[test]
fn thin_obstacles_are_not_missed() {
    for (offset, touches) in [(1e-3 - 1e-9, true), (1e-3 + 1e-9, false), (0.0, true)] {
        let wire = Obstacle::capsule(v(3.3, offset, -1.0), v(3.3, offset, 1.0), 1e-3).unwrap();
        let bodies = alone(
            point(Vector3::zeros()),
            Shape::Point,
            wire,
            surface(1.0, 0.0),
        );
        let start = [at(Vector3::zeros(), v(1.0, 0.0, 0.0))];
        let mut motion = BodyMotion::new(&bodies, &start, options(10.0)).unwrap();
        let hits = impacts(&run(&mut motion, 1e-13));
        assert_eq!(hits.len(), usize::from(touches), "{offset}");
    }
}

/// Catches a wrong normal force on a curved surface, and a wrong release: a point slides off a sphere where its height
/// has fallen by a third.
#[test]
fn a_point_leaves_a_sphere() {
    let sphere = Obstacle::sphere(Vector3::zeros(), 1.0, false).unwrap();
    let bodies = alone(
        point(v(0.0, 0.0, -1.0)),
        Shape::Point,
        sphere,
        surface(0.5, 0.0),
    );
    let speed = 0.1;
    let start = [at(Vector3::z(), v(speed, 0.0, 0.0))];
    let mut motion = BodyMotion::new(&bodies, &start, options(4.0)).unwrap();
    let events = run(&mut motion, 1e-11);
    let ContactEvent::Release(release) = events[0] else {
        panic!("{:?}", events[0]);
    };
    near(release.point.z, (2.0 + speed * speed) / 3.0, 1e-11);
    assert_eq!(keys(&events), ["release"]);
}

/// Catches a point that a sharp edge turns, stops or loses energy: the point slides to the edge of a table and falls.
/// The edge has no radius, so that the curvature of the surface has no bound there. Friction slows the point before.
#[test]
fn a_point_slides_over_a_sharp_edge() {
    let corner = |x: f64, y: f64| nalgebra::Vector2::new(x, y);
    let table = [
        corner(-2.0, -1.0),
        corner(1.0, -1.0),
        corner(1.0, 0.0),
        corner(-2.0, 0.0),
    ];
    for (friction, tolerance) in [(0.0, 1e-8), (0.0, 1e-12), (0.2, 1e-10), (0.2, 1e-13)] {
        let (weight, speed) = (2.0, 1.5);
        let bodies = alone(
            point(v(0.0, -weight, 0.0)),
            Shape::Point,
            Obstacle::polygon(&table).expect("a table"),
            surface(0.5, friction),
        );
        let options = options(1.2).with_tolerance(tolerance).expect("a tolerance");
        let start = [at(v(0.1, 0.0, 0.0), v(speed, 0.0, 0.0))];
        let mut motion = BodyMotion::new(&bodies, &start, options).expect("a start");
        let events = run(&mut motion, 1e-9);
        assert_eq!(keys(&events), ["release"]);
        // 0.9 = speed t - friction weight t^2/2.
        let slows = friction * weight;
        let left = (speed * speed - 2.0 * slows * 0.9).sqrt();
        let t = 2.0 * 0.9 / (speed + left);
        near(events[0].time(), t, 1e-9);
        let (end, falls) = (motion.now(), 1.2 - t);
        let place = end.motions[0].pose.translation.vector;
        near(place.x, 1.0 + left * falls, 1e-8);
        near(place.y, -0.5 * weight * falls * falls, 1e-8);
    }
}

/// Catches a gap of a hollow surface with the wrong sign, and a slow pendulum: a ball slides in a tube without friction
/// as a pendulum of length R - a, given by the energy integral.
#[test]
fn a_ball_in_a_tube_is_a_pendulum() {
    let tube = Obstacle::cylinder(Vector3::zeros(), Vector3::y(), 1.1, true).unwrap();
    let bodies = alone(
        point(v(0.0, 0.0, -1.0)),
        Shape::ball(0.1).unwrap(),
        tube,
        surface(0.0, 0.0),
    );
    let angle: f64 = 1.0;
    let start = [at(v(angle.sin(), 0.0, -angle.cos()), Vector3::zeros())];
    // A quarter of the period is K of the modulus sin(angle/2).
    let quarter = complete_k((0.5 * angle).cos()).expect("a modulus below 1");
    let mut motion = BodyMotion::new(&bodies, &start, options(quarter)).unwrap();
    let events = run(&mut motion, 1e-11);
    assert!(events.is_empty());
    let now = motion.now();
    near(now.motions[0].pose.translation.x, 0.0, 1e-10);
    near(now.contacts[0].normal_force, 3.0 - 2.0 * angle.cos(), 1e-10);
}

/// Catches a moving obstacle that does no work, or whose acceleration is left out: a point on a plate that shakes
/// leaves where the plate falls faster than the weight.
#[test]
fn a_shaking_plate_throws_a_point() {
    let (amplitude, frequency) = (0.5, 2.0);
    let support = Support::<3>::new(Vector3::zeros(), &UnitQuaternion::identity()).unwrap();
    let support = support
        .with_translation(Vector3::z(), History::sine(amplitude, frequency, 0.0))
        .unwrap();
    let plate = MovingObstacle::carried(floor(), support);
    let bodies = alone(
        point(v(0.0, 0.0, -1.0)),
        Shape::Point,
        plate,
        surface(0.0, 0.3),
    );
    let start = [at(Vector3::zeros(), v(0.0, 0.0, amplitude * frequency))];
    let mut motion = BodyMotion::new(&bodies, &start, options(6.0)).unwrap();
    let events = run(&mut motion, 1e-11);
    let leaves = (1.0 / (amplitude * frequency * frequency)).asin() / frequency;
    assert_eq!(events[0].key(), "release");
    near(events[0].time(), leaves, 1e-11);
    // The flight ends at a root of the parabola over the sine.
    let (z, w) = (
        amplitude * (frequency * leaves).sin(),
        amplitude * frequency * (frequency * leaves).cos(),
    );
    let gap = |t: f64| {
        let s = t - leaves;
        z + w * s - 0.5 * s * s - amplitude * (frequency * t).sin()
    };
    let landing = impacts(&events)[0];
    near(gap(landing.t), 0.0, 1e-12);
    assert!(motion.now().ledger.obstacle_work.abs() > 0.1);
}

/// Catches contacts that depend on each other: a box lands flat on four corners, slides, and stops where its friction
/// says. The equations of the cube are singular to the last digit.
#[test]
fn boxes_land_flat_and_slide() {
    let plate = (v(5.0, 10.0, 13.0) / 12.0, v(3.0, 2.0, 0.2));
    let cube = (Vector3::repeat(0.01), Vector3::repeat(0.2));
    for (moments, sides) in [plate, cube] {
        let mass = rigid(moments, v(0.0, 0.0, -1.0));
        let shape = Shape::cuboid(sides).unwrap();
        let bodies = alone(mass, shape, floor(), surface(0.0, 0.25));
        let start = [at(v(0.0, 0.0, 0.6), v(1.0, 0.0, 0.0))];
        let mut motion = BodyMotion::new(&bodies, &start, options(6.0)).unwrap();
        let events = run(&mut motion, 1e-12);
        let hits = impacts(&events);
        assert_eq!(hits.len(), 4);
        let total: Vector3<f64> = hits.iter().map(|hit| hit.impulse).sum();
        near(total.z, 1.0, 1e-12);
        near(total.x, -0.25, 1e-12);
        // Speed 3/4 after the landing at time 1, slowed down by 1/4.
        let last = events.last().unwrap();
        assert_eq!(last.key(), "stick");
        near(last.time(), 4.0, 1e-11);
        let end = motion.now().motions[0];
        near(end.pose.translation.x, 1.0 + 0.5 * 0.75 * 3.0, 1e-11);
        near(end.velocity.norm(), 0.0, 1e-12);
        near(end.spin.norm(), 0.0, 1e-12);
    }
}

/// Catches a rim whose lowest point does not move as it should: a cylinder rolls down a slope with 2/3 of the
/// acceleration without friction.
#[test]
fn a_cylinder_rolls_down() {
    let weight = v(0.3, 0.0, -1.0);
    let (radius, length) = (0.2, 1.0);
    let across = radius * radius / 4.0 + length * length / 12.0;
    let mass = rigid(v(across, across, 0.5 * radius * radius), weight);
    let bodies = alone(
        mass,
        Shape::cylinder(length, radius).unwrap(),
        floor(),
        surface(0.0, 0.5),
    );
    let mut start = at(v(0.0, 0.0, radius), Vector3::zeros());
    start.pose.rotation =
        UnitQuaternion::from_axis_angle(&Vector3::x_axis(), std::f64::consts::FRAC_PI_2);
    let mut motion = BodyMotion::new(&bodies, &[start], options(2.0)).unwrap();
    assert!(run(&mut motion, 1e-11).is_empty());
    near(
        motion.now().motions[0].velocity.x,
        0.3 * 2.0 / 3.0 * 2.0,
        1e-11,
    );
    near(motion.now().motions[0].spin.y, 0.4 / radius, 1e-11);
}

/// Catches an answer for Newton's cradle that depends on the order of the contacts: the law for several contacts at
/// once is symmetric, and it is named.
#[test]
fn balls_in_a_row_hit_at_once() {
    let mut bodies = Bodies::new(surface(1.0, 0.0));
    for _ in 0..3 {
        let mass = Mass::Point(PointMass::new(1.0).unwrap());
        bodies.add_body(mass, Shape::ball(0.5).unwrap()).unwrap();
    }
    let start = [
        at(v(-3.0, 0.0, 0.0), v(1.0, 0.0, 0.0)),
        at(Vector3::zeros(), Vector3::zeros()),
        at(v(3.0, 0.0, 0.0), v(-1.0, 0.0, 0.0)),
    ];
    let mut motion = BodyMotion::new(&bodies, &start, options(3.0)).unwrap();
    let hits = impacts(&run(&mut motion, 1e-13));
    assert_eq!(hits.len(), 2);
    assert!(
        hits.iter()
            .all(|hit| hit.rule == RuleOfImpact::Simultaneous)
    );
    for (body, speed) in [-1.0, 0.0, 1.0].into_iter().enumerate() {
        near(motion.now().motions[body].velocity.x, speed, 1e-13);
    }
}

/// Catches a rate of a gap, of a normal or of a place that is not the derivative of these, for each kind of pair.
#[test]
fn rates_of_contacts_agree_with_differences() {
    let shapes = [
        Shape::Point,
        Shape::ball(0.2).unwrap(),
        Shape::capsule(0.6, 0.15).unwrap(),
        Shape::cylinder(0.5, 0.2).unwrap(),
        Shape::cuboid(v(0.4, 0.5, 0.3)).unwrap(),
    ];
    let obstacles = [
        Obstacle::plane(v(0.1, 0.0, -0.4), v(0.2, -0.3, 1.0)).unwrap(),
        Obstacle::sphere(v(1.2, 0.3, 0.2), 0.4, false).unwrap(),
        Obstacle::sphere(v(0.2, 0.3, 0.2), 3.0, true).unwrap(),
        Obstacle::cylinder(v(1.2, 0.3, 0.2), v(0.2, 1.0, 0.3), 0.4, false).unwrap(),
        Obstacle::cylinder(v(0.2, 0.3, 0.2), v(0.2, 1.0, 0.3), 2.0, true).unwrap(),
        Obstacle::capsule(v(1.2, 0.3, -0.6), v(1.0, 0.4, 0.7), 0.1).unwrap(),
        Obstacle::cuboid(v(1.5, 0.3, 0.0), v(0.5, 0.6, 0.7), Rotation3::identity()).unwrap(),
    ];
    let moved = |start: &RigidMotion, t: f64| {
        let turn = UnitQuaternion::from_scaled_axis(start.spin * t) * start.pose.rotation;
        let place = start.pose.translation.vector + start.velocity * t;
        RigidMotion {
            pose: Isometry3::from_parts(place.into(), turn),
            ..*start
        }
    };
    let mut b = at(v(0.05, -0.1, 0.02), v(0.2, 0.4, -0.3));
    (b.spin, b.pose.rotation) = (
        v(0.5, -0.2, 0.3),
        UnitQuaternion::from_euler_angles(0.1, 0.2, -0.1),
    );
    let mut a = at(v(0.1, 0.2, 0.3), v(-0.6, 0.5, 0.4));
    (a.spin, a.pose.rotation) = (
        v(-0.7, 0.6, 0.9),
        UnitQuaternion::from_euler_angles(0.5, 0.3, -0.8),
    );
    let place = Isometry3::from_parts(
        v(0.05, 0.02, -0.04).into(),
        UnitQuaternion::from_euler_angles(0.2, 0.9, 0.4),
    );
    let mut pairs = Vec::new();
    let mut refused = 0;
    for shape in shapes {
        let shape = PlacedShape { shape, place };
        for obstacle in &obstacles {
            match ContactPair::of_obstacle(&shape, obstacle) {
                Ok(found) => pairs.extend(found),
                Err(why) => {
                    refused += 1;
                    assert!(why.to_string().contains(obstacle.name()), "{why}");
                }
            }
        }
        for other in shapes {
            let place = Isometry3::translation(1.3, 0.2, -0.3);
            let other = PlacedShape {
                shape: other,
                place,
            };
            pairs.extend(ContactPair::of_bodies(&shape, &other).unwrap_or_default());
        }
    }
    assert_eq!((pairs.len(), refused), (62, 10));
    let h = 1e-5;
    for pair in &pairs {
        let touch = |t: f64| pair.touch(&moved(&a, t), &moved(&b, t));
        let (now, before, after) = (touch(0.0), touch(-h), touch(h));
        let slip = now.slip(&a, &b);
        let rate = (after.gap - before.gap) / (2.0 * h);
        assert!((rate - now.normal.dot(&slip)).abs() < 1e-8, "{pair:?}");
        for (rate, from, to) in [
            (now.normal_rate, before.normal, after.normal),
            (now.point_rate, before.point, after.point),
        ] {
            assert!((rate - (to - from) / (2.0 * h)).norm() < 1e-7, "{pair:?}");
        }
    }
}

/// Catches a case that is not covered and runs all the same: each message says what is wrong.
#[test]
fn refusals_have_words() {
    let words = |bodies: &Bodies, start: &[RigidMotion]| {
        let refused = BodyMotion::new(bodies, start, options(1.0)).err();
        refused.expect("refused").to_string()
    };
    let one = |place: Vector3<f64>| [at(place, Vector3::zeros())];
    let still = || point(Vector3::zeros());
    let deep = alone(
        still(),
        Shape::ball(0.1).unwrap(),
        floor(),
        surface(0.0, 0.0),
    );
    let said = words(&deep, &one(v(0.0, 0.0, 0.05)));
    assert!(
        said.contains("inside") && said.contains("5.000e-2"),
        "{said}"
    );
    assert!(words(&deep, &[]).contains("0 poses"));
    assert!(words(&deep, &one(v(f64::NAN, 0.0, 1.0))).contains("finite"));

    let cube = Shape::cuboid(Vector3::repeat(1.0)).unwrap();
    let mut boxes = Bodies::new(surface(0.0, 0.0));
    for _ in 0..2 {
        boxes
            .add_body(rigid(Vector3::repeat(1.0), Vector3::zeros()), cube)
            .unwrap();
    }
    let apart = [
        at(Vector3::zeros(), Vector3::zeros()),
        at(v(5.0, 0.0, 0.0), Vector3::zeros()),
    ];
    let said = words(&boxes, &apart);
    assert!(
        said.contains("body 0 and body 1") && said.contains("box with a box"),
        "{said}"
    );
    boxes.leave_out(1, Partner::Body(0)).unwrap();
    assert!(BodyMotion::new(&boxes, &apart, options(1.0)).is_ok());
    assert!(boxes.leave_out(0, Partner::Obstacle(3)).is_err());

    let upright = alone(
        still(),
        Shape::cylinder(1.0, 0.2).unwrap(),
        floor(),
        surface(0.0, 0.0),
    );
    let said = words(&upright, &one(v(0.0, 0.0, 0.5)));
    assert!(said.contains("rim of its flat end"), "{said}");

    // A box on five corners' worth of contacts: with a ball on top there is one too many.
    let mut loaded = Bodies::new(surface(0.0, 0.3));
    let weight = v(0.0, 0.0, -1.0);
    loaded
        .add_body(rigid(Vector3::repeat(1.0), weight), cube)
        .unwrap();
    loaded
        .add_body(ball(0.2, weight), Shape::ball(0.2).unwrap())
        .unwrap();
    loaded.add_obstacle(floor());
    let stacked = [
        at(v(0.0, 0.0, 0.5), Vector3::zeros()),
        at(v(0.0, 0.0, 1.2), Vector3::zeros()),
    ];
    let said = words(&loaded, &stacked);
    assert!(
        said.contains("5 contacts") && said.contains("at most 4"),
        "{said}"
    );

    let endless = alone(
        point(v(0.0, 0.0, -2.0)),
        Shape::Point,
        floor(),
        surface(1.0, 0.0),
    );
    let few = BodyOptions {
        max_impacts: 10,
        ..options(1e3)
    };
    let mut motion = BodyMotion::new(&endless, &one(v(0.0, 0.0, 1.0)), few).unwrap();
    let last = std::iter::from_fn(|| motion.advance()).last();
    assert_eq!(last, Some(Event::Stop(Outcome::ImpactLimit)));
}
