//! A body on a light planar rod that hits obstacles: impacts, accumulation, sliding, friction, moving obstacles.

use crate::impacts::{near, number};
use nalgebra::{UnitQuaternion, Vector2, Vector3};
use serde_json::Value;
use snaprod::body::{History, Mass, PointMass, Support};
use snaprod::contact::{MovingObstacle, Obstacle, Shape, SurfacePair};
use snaprod::elastica::{Elastica, Equilibrium};
use snaprod::math::gauss::Rule;
use snaprod::motion::contact::{Bodies, ContactEvent, ImpactRecord};
use snaprod::motion::{AmongObstacles, Event, Options, Outcome, Run};

/// The case of this friction in tests/data/contact/bounce_given.json.
fn case(friction: f64) -> Value {
    let all = crate::impacts::data("bounce_given.json");
    let mut all = all.as_array().expect("cases").iter();
    let case = all.find(|case| case["friction"] == friction);
    case.expect("a case of this friction").clone()
}

fn floor(height: f64) -> Obstacle {
    Obstacle::plane(Vector3::new(0.0, height, 0.0), Vector3::y()).expect("a plane")
}

/// A body of mass 1 and the shape `shape` with one obstacle.
fn among(obstacle: impl Into<MovingObstacle>, shape: Shape, surface: [f64; 2]) -> Bodies {
    let [restitution, friction] = surface;
    let mut bodies = Bodies::new(SurfacePair::new(restitution, friction).expect("a surface"));
    let mass = Mass::Point(PointMass::new(1.0).expect("a mass"));
    bodies.add_body(mass, shape).expect("a body");
    bodies.add_obstacle(obstacle);
    bodies
}

fn pressed(force: [f64; 2]) -> PointMass<2> {
    let mass = PointMass::new(1.0).expect("a mass");
    mass.with_dead_force(force.into()).expect("a force")
}

fn obstacles(bodies: &Bodies, resting_speed: f64) -> AmongObstacles<'_> {
    AmongObstacles {
        bodies,
        resting_speed,
        max_impacts: 1000,
        rod_touches: true,
    }
}

/// The start of the given cases, the chart point (p, w).
const START: [f64; 2] = [-0.25, 1.3];
/// Their load.
const LOAD: [f64; 2] = [-6.0, -3.0];

fn run<'a>(
    body: &'a PointMass<2>,
    among: AmongObstacles<'a>,
    duration: f64,
    tolerance: f64,
) -> snaprod::Result<Run<'a, Elastica, 2>> {
    let options = Options::new(duration)?.with_tolerance(tolerance)?;
    let start = Run::new(&Elastica, body, START.into(), Vector2::zeros(), options)?;
    start.among_obstacles(among)
}

/// Events and samples of a run.
struct Told {
    events: Vec<ContactEvent>,
    snaps: usize,
    outcome: Outcome,
    /// Largest change of the ledger, and the least gap, at and within steps.
    drift: f64,
    least_gap: f64,
    /// Largest |T| - mu N.
    beyond_cone: f64,
}

fn follow(run: &mut Run<'_, Elastica, 2>) -> Told {
    let total = run.now().ledger.total();
    let mut told = Told {
        events: Vec::new(),
        snaps: 0,
        outcome: Outcome::Interrupted,
        drift: 0.0,
        least_gap: f64::INFINITY,
        beyond_cone: f64::NEG_INFINITY,
    };
    while let Some(event) = run.next() {
        let mut states = vec![run.now()];
        if let Event::Step { from, to } = event {
            let places = [0.0, 0.31, 0.62, 0.93];
            let inside = places.iter().map(|x| from + x * (to - from));
            states.extend(inside.filter_map(|t| run.sample(t)));
        }
        for (number, state) in states.iter().enumerate() {
            let drift = (state.ledger.total() - total).abs();
            assert!(drift >= 0.0);
            told.drift = told.drift.max(drift);
            let contact = state.contact.as_ref().expect("a scene with obstacles");
            told.least_gap = told.least_gap.min(contact.least_gap);
            // At the end of a step the force may already be that behind an edge.
            for at in contact.contacts.iter().filter(|_| number > 0) {
                let beyond = at.friction.norm() - at.coefficient * at.normal_force;
                told.beyond_cone = told.beyond_cone.max(beyond);
            }
        }
        match event {
            Event::Contact(event) => told.events.push(event),
            Event::Snap(_) => told.snaps += 1,
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

fn time_of(told: &Told, key: &str) -> f64 {
    let found = told.events.iter().find(|event| event.key() == key);
    found.unwrap_or_else(|| panic!("no {key}")).time()
}

/// Catches impacts that are missed, late or of a wrong size, an accumulation that is not seen, and a contact that does
/// not last: the given case without friction, from another program.
#[test]
fn a_mass_on_a_strip_bounces_and_slides() {
    let case = case(0.0);
    let (body, bodies) = (pressed(LOAD), among(floor(-0.3), Shape::Point, [0.5, 0.0]));
    let mut run = run(&body, obstacles(&bodies, 1e-6), 2.0, 1e-13).expect("a run");
    let told = follow(&mut run);
    assert_eq!(told.outcome, Outcome::EndOfTime);
    let hits = impacts(&told);
    let given = case["impacts"].as_array().expect("impacts");
    assert!(hits.len() >= 20);
    for (hit, given) in hits.iter().zip(given).take(6) {
        near(hit.t, number(given, "t"), 1e-11);
        near(hit.point.x, number(given, "x"), 1e-11);
        near(
            hit.before.y,
            given["v_before"][1].as_f64().expect("v"),
            1e-10,
        );
        near(hit.after.y, given["v_after"][1].as_f64().expect("v"), 1e-10);
        near(hit.lost, number(given, "lost"), 1e-10);
    }
    let end = &case["phases"][0];
    near(time_of(&told, "accumulation"), number(end, "t"), 1e-9);
    let last = run.now();
    near(last.pose.x, case["end"]["r"][0].as_f64().expect("r"), 1e-10);
    near(
        last.phase.v.x,
        case["end"]["v"][0].as_f64().expect("v"),
        1e-9,
    );
    let contact = last.contact.expect("contact");
    near(contact.impact_lost, number(&case, "lost"), 1e-10);
    assert!(told.drift < 1e-11, "{:e}", told.drift);
    assert!(told.least_gap > -1e-11, "{:e}", told.least_gap);
    let pressed = contact.contacts[0];
    let sample = case["contact_samples"].as_array().expect("samples");
    near(
        pressed.normal_force,
        number(sample.last().expect("a sample"), "N"),
        1e-9,
    );
}

/// Times at which the mass slides back and sticks, by tools/ref_bounce_end.py.
const SLIDES_BACK: f64 = 0.523_616_377_927;
const STICKS: f64 = 0.669_792_469_240;

/// Catches friction that creeps, leaves its cone or lasts too long, and impulses of bounces that are summed up wrongly.
/// The given times of the end are off by 1.2e-8, since they leave out the impulse of the last bounces. Here the times
/// do not depend on how many bounces are summed up.
#[test]
fn a_mass_on_a_strip_slides_back_and_sticks() {
    let case = case(0.15);
    let (body, bodies) = (pressed(LOAD), among(floor(-0.3), Shape::Point, [0.5, 0.15]));
    let mut times = Vec::new();
    for resting_speed in [1e-5, 1e-6, 1e-7] {
        let mut run = run(&body, obstacles(&bodies, resting_speed), 1.0, 1e-13).expect("a run");
        let told = follow(&mut run);
        let given = case["impacts"].as_array().expect("impacts");
        for (hit, given) in impacts(&told).iter().zip(given).take(6) {
            near(hit.t, number(given, "t"), 1e-11);
            near(hit.impulse.x, number(given, "Jt"), 1e-10);
        }
        let phases = case["phases"].as_array().expect("phases");
        for (key, phase) in ["accumulation", "reverse", "stick"].iter().zip(phases) {
            near(time_of(&told, key), number(phase, "t"), 2e-8);
        }
        near(time_of(&told, "reverse"), SLIDES_BACK, 2e-11);
        near(time_of(&told, "stick"), STICKS, 2e-11);
        assert!(told.drift < 1e-12, "{:e}", told.drift);
        assert!(told.beyond_cone < 1e-12, "{:e}", told.beyond_cone);
        let last = run.now();
        assert_eq!(last.phase.v.norm(), 0.0);
        let contact = last.contact.expect("contact");
        assert!(contact.friction_lost > 0.0 && contact.impact_lost > contact.friction_lost);
        near(
            contact.friction_lost + contact.impact_lost,
            number(&case, "lost"),
            1e-8,
        );
        times.push([time_of(&told, "reverse"), time_of(&told, "stick")]);
    }
    for later in &times[1..] {
        near(later[0], times[0][0], 1e-12);
        near(later[1], times[0][1], 1e-12);
    }
}

/// Catches a touch that hides between samples, and a graze that counts as an impact: a floor just above, and just
/// below, the lowest place of the free motion.
#[test]
fn grazes_pass_and_shallow_touches_hit() {
    let body = pressed(LOAD);
    let far = among(floor(-10.0), Shape::Point, [0.5, 0.0]);
    let options = Options::new(1.0)
        .expect("options")
        .with_tolerance(1e-13)
        .expect("options");
    let mut free = run(&body, obstacles(&far, 1e-6), 1.0, 1e-13).expect("a run");
    let mut plain =
        Run::new(&Elastica, &body, START.into(), Vector2::zeros(), options).expect("run");
    let mut lowest = f64::INFINITY;
    loop {
        // Obstacles out of reach change no digit.
        assert_eq!(free.now().phase, plain.now().phase);
        let (Some(event), Some(_)) = (free.next(), plain.next()) else {
            break;
        };
        let Event::Step { from, to } = event else {
            continue;
        };
        // The lowest place within the step, by golden sections.
        let mut height = |t: f64| free.sample(t).map_or(f64::NAN, |state| state.pose.y);
        let (mut a, mut b) = (from, to);
        for _ in 0..60 {
            let part = 0.381_966 * (b - a);
            if height(a + part) < height(b - part) {
                b -= part;
            } else {
                a += part;
            }
        }
        lowest = lowest.min(height(0.5 * (a + b)));
    }
    for (depth, hits) in [(1e-9, true), (-1e-9, false)] {
        let bodies = among(floor(lowest + depth), Shape::Point, [1.0, 0.0]);
        let mut run = run(&body, obstacles(&bodies, 1e-6), 1.0, 1e-13).expect("a run");
        assert_eq!(!impacts(&follow(&mut run)).is_empty(), hits);
    }
}

/// Catches an obstacle whose motion does no work, and a shape that is taken for a point: a ball on a floor that goes up
/// smoothly and comes to rest. All of the work is in the ledger.
#[test]
fn a_floor_lifts_a_ball() {
    let rise = |rows: &[[f64; 2]]| History::smooth(rows).expect("a table");
    let support = Support::<3>::new(Vector3::zeros(), &UnitQuaternion::identity())
        .and_then(|support| {
            let rows = [[0.0, 0.0], [0.5, 0.05], [1.0, 0.1]];
            support.with_translation(Vector3::y(), rise(&rows))
        })
        .expect("a support");
    let lifts = MovingObstacle::carried(floor(-0.34), support);
    let shape = Shape::ball(0.02).expect("a ball");
    let (body, bodies) = (
        pressed(LOAD).with_drag(0.3).expect("drag"),
        among(lifts, shape, [0.0, 0.0]),
    );
    let mut run = run(&body, obstacles(&bodies, 1e-6), 1.5, 1e-12).expect("a run");
    let told = follow(&mut run);
    assert_eq!(told.outcome, Outcome::EndOfTime);
    let last = run.now();
    near(last.pose.y, -0.34 + 0.1 + 0.02, 1e-11);
    assert!(told.drift < 1e-10, "{:e}", told.drift);
    assert!(told.least_gap > -1e-11, "{:e}", told.least_gap);
    assert!(last.contact.expect("contact").obstacle_work > 0.01);
}

/// Catches friction that keeps the direction in which a slip began: a mass slides round in a hole by more than half a
/// turn. The work of friction is that of the normal force along the way, by Gauss rules on the samples.
#[test]
fn a_mass_slides_round_a_hole() {
    let start = Equilibrium::new(-0.6, 1.4).expect("an equilibrium");
    let end = Vector2::new(start.x, start.y);
    let (radius, mu) = (0.1, 0.05);
    let hole = Obstacle::disc(end + Vector2::new(0.0, radius), radius, true).expect("a hole");
    let bodies = among(hole, Shape::Point, [0.0, mu]);
    let body = PointMass::new(1.0).expect("a mass");
    let options = Options::new(0.4)
        .and_then(|o| o.with_tolerance(1e-12))
        .expect("options");
    let q = Vector2::new(start.p, start.w);
    let run = Run::new(&Elastica, &body, q, Vector2::new(4.0, 0.0), options).expect("a run");
    let quiet = AmongObstacles {
        rod_touches: false,
        ..obstacles(&bodies, 1e-6)
    };
    let mut run = run.among_obstacles(quiet).expect("a run");
    let total = run.now().ledger.total();
    let rule = Rule::new(8);
    let (mut work, mut turned) = (0.0, 0.0);
    while let Some(event) = run.next() {
        let Event::Step { from, to } = event else {
            continue;
        };
        for (x, weight) in rule.nodes.iter().zip(&rule.weights) {
            let Some(state) = run.sample(from + x * (to - from)) else {
                continue;
            };
            for at in state.contact.expect("contact").contacts {
                let speed = at.slip.norm();
                work += mu * at.normal_force * speed * weight * (to - from);
                turned += speed / radius * weight * (to - from);
                assert!(at.friction.dot(&at.slip) <= 0.0);
            }
        }
    }
    let last = run.now();
    assert!(turned > std::f64::consts::PI, "{turned}");
    near(last.contact.expect("contact").friction_lost, work, 1e-9);
    near(last.ledger.total(), total, 1e-10);
}

/// Catches a rod that passes through an obstacle in silence, and a start inside an obstacle that is accepted.
#[test]
fn rods_that_touch_end_the_run_and_bad_starts_are_refused() {
    let body = pressed(LOAD);
    let start = Equilibrium::new(START[0], START[1]).expect("an equilibrium");
    let middle = start.section(0.5).expect("a section");
    let (sin, cos) = middle.theta.sin_cos();
    let disc = |gap: f64| {
        let centre = Vector2::new(middle.x, middle.y) - Vector2::new(-sin, cos) * (0.05 + gap);
        Obstacle::disc(centre, 0.05, false).expect("a disc")
    };
    let bodies = among(disc(1e-3), Shape::Point, [0.5, 0.0]);
    let mut touching = run(&body, obstacles(&bodies, 1e-6), 1.0, 1e-10).expect("a run");
    let Outcome::RodTouch(touch) = follow(&mut touching).outcome else {
        panic!("the rod passed through");
    };
    assert!(0.3 < touch.s && touch.s < 0.7 && touch.gap.abs() < 2e-9);
    // The rod alone may pass on request.
    let through = AmongObstacles {
        rod_touches: false,
        ..obstacles(&bodies, 1e-6)
    };
    let mut through = run(&body, through, 1.0, 1e-10).expect("a run");
    assert_eq!(follow(&mut through).outcome, Outcome::EndOfTime);

    let inside = among(disc(-1e-3), Shape::Point, [0.5, 0.0]);
    let words = run(&body, obstacles(&inside, 1e-6), 1.0, 1e-10)
        .err()
        .expect("refused");
    assert!(
        words.to_string().contains("the rod starts 0.001 inside"),
        "{words}"
    );
    let above = among(floor(-0.2), Shape::Point, [0.5, 0.0]);
    let words = run(&body, obstacles(&above, 1e-6), 1.0, 1e-10)
        .err()
        .expect("refused");
    assert!(
        words.to_string().contains("inside obstacle 0 by 3.207e-2"),
        "{words}"
    );
}

/// Numbers in [0, 1) that look drawn at random, the same at every run.
struct Draws(u64);

impl Draws {
    fn next(&mut self) -> f64 {
        self.0 = self
            .0
            .wrapping_mul(6_364_136_223_846_793_005)
            .wrapping_add(1_442_695_040_888_963_407);
        (self.0 >> 11) as f64 / (1_u64 << 53) as f64
    }

    fn between(&mut self, from: f64, to: f64) -> f64 {
        from + (to - from) * self.next()
    }
}

/// An obstacle near the end of a rod at `end`.
fn drawn(draws: &mut Draws, end: Vector2<f64>) -> Obstacle {
    let angle = draws.between(0.0, std::f64::consts::TAU);
    let normal = Vector2::new(angle.cos(), angle.sin());
    let gap = draws.between(0.0, 0.1);
    let size = draws.between(0.02, 0.3);
    let below = end - normal * gap;
    match (draws.next() * 5.0) as usize {
        0 => Obstacle::plane(below.push(0.0), normal.push(0.0)),
        1 => Obstacle::disc(below - normal * size, size, false),
        2 => Obstacle::disc(end + normal * gap, 2.0 * gap + size, true),
        3 => {
            let along = Vector2::new(-normal.y, normal.x) * size;
            let middle = below - normal * 0.1 * size;
            Obstacle::capsule(
                (middle - along).push(0.0),
                (middle + along).push(0.0),
                0.1 * size,
            )
        }
        _ => {
            let along = Vector2::new(-normal.y, normal.x) * size;
            Obstacle::polygon(&[below + along, below - along, below - normal * size])
        }
    }
    .expect("an obstacle")
}

/// Follows motions among obstacles drawn at random, and returns how many of them were followed to the end of time, and
/// how many events there were.
fn follow_drawn(count: usize, seed: u64) -> [usize; 2] {
    let mut draws = Draws(seed);
    let (mut whole, mut events, mut wedged) = (0, 0, 0);
    for number in 0..count {
        let q = Vector2::new(draws.between(-1.5, 1.5), draws.between(0.2, 3.0));
        let v = Vector2::new(draws.between(-1.0, 1.0), draws.between(-1.0, 1.0));
        let load = [draws.between(-8.0, 8.0), draws.between(-8.0, 8.0)];
        let friction = if draws.next() < 0.5 {
            0.0
        } else {
            draws.next()
        };
        let restitution = if draws.next() < 0.3 {
            0.0
        } else {
            draws.next()
        };
        let start = Equilibrium::new(q.x, q.y).expect("an equilibrium");
        let end = Vector2::new(start.x, start.y);
        let surface = SurfacePair::new(restitution, friction).expect("a surface");
        let mut bodies = Bodies::new(surface);
        let mass = Mass::Point(PointMass::new(1.0).expect("a mass"));
        bodies.add_body(mass, Shape::Point).expect("a body");
        bodies.add_obstacle(drawn(&mut draws, end));
        if draws.next() < 0.5 {
            bodies.add_obstacle(drawn(&mut draws, end));
        }
        let body = pressed(load);
        let options = Options::new(0.7)
            .and_then(|o| o.with_tolerance(1e-10))
            .expect("options");
        let among = AmongObstacles {
            rod_touches: draws.next() < 0.5,
            ..obstacles(&bodies, 1e-6)
        };
        let begun = Run::new(&Elastica, &body, q, v, options).expect("a start");
        // The rod may start inside an obstacle, which is refused.
        let Ok(mut run) = begun.among_obstacles(among) else {
            continue;
        };
        let size = 1.0 + run.now().ledger.largest();
        let told = follow(&mut run);
        let last = told.events.iter().rev().take(6).rev();
        let last: Vec<_> = last.map(|event| (event.key(), event.time())).collect();
        let case = format!(
            "{number}: friction {friction}, {:?}, {} events, the last {last:?}, {} snaps",
            told.outcome,
            told.events.len(),
            told.snaps
        );
        assert!(
            told.drift < 1e-7 * (size + run.now().ledger.largest()),
            "{case}, drift {:e}",
            told.drift
        );
        assert!(told.least_gap > -1e-9, "{case}, gap {:e}", told.least_gap);
        assert!(
            told.beyond_cone < 1e-9,
            "{case}, cone {:e}",
            told.beyond_cone
        );
        match told.outcome {
            Outcome::EndOfTime => whole += 1,
            Outcome::RodTouch(_) | Outcome::ImpactLimit => {}
            // Two surfaces that close in on the body may wedge the body.
            Outcome::Stuck(stuck) if stuck.to_string().contains("wedging") => wedged += 1,
            other => panic!("{case}: {other:?}"),
        }
        events += told.events.len();
    }
    assert!(wedged <= count / 50, "{wedged} of {count} wedged");
    [whole, events]
}

/// Catches hangs, gaps below zero, friction beyond its cone and energy from nowhere, in scenes that nobody has chosen.
#[test]
fn motions_among_obstacles_drawn_at_random() {
    let [whole, events] = follow_drawn(25, 1);
    assert!(whole > 8 && events > 30, "{whole}, {events}");
}

/// Catches what the short test of motions drawn at random catches, in many more scenes.
#[test]
#[ignore = "second tier: 20 s"]
fn many_motions_among_obstacles_drawn_at_random() {
    let [whole, events] = follow_drawn(400, 2);
    assert!(whole > 120 && events > 800, "{whole}, {events}");
}
