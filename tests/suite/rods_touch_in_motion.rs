//! Planar elastic rods that touch obstacles while their body moves: sheets with touches, events, ledger, refusals.

use crate::impacts::{data, near};
use nalgebra::{Isometry3, Matrix2, Matrix3, Rotation3, Vector2, Vector3, Vector6};
use serde_json::Value;
use snaprod::body::{Mass, PointMass};
use snaprod::contact::{MovingObstacle, Obstacle, Shape, SurfacePair};
use snaprod::elastica::{Elastica, Equilibrium};
use snaprod::manifold::{EquilibriumManifold, Multivalued, invert_near};
use snaprod::motion::contact::{Bodies, RodContactEvent};
use snaprod::motion::{AmongObstacles, Event, Motion, Options, Outcome, RodBound, on_elastica};
use snaprod::rod::contact::{ContactGuess, ElasticaAmong, GuessedTouch, Surface, TouchedSheet};
use std::sync::Arc;

/// The clamp at the origin along x, as rods in the plane have it.
fn clamp() -> Isometry3<f64> {
    let directors = Matrix3::new(0.0, 0.0, 1.0, 0.0, -1.0, 0.0, 1.0, 0.0, 0.0);
    let turn = Rotation3::from_matrix_unchecked(directors);
    Isometry3::from_parts(Vector3::zeros().into(), turn.into())
}

/// The half-plane y <= h is free.
fn wall(h: f64) -> Obstacle {
    Obstacle::plane(Vector3::new(0.0, h, 0.0), -Vector3::y()).expect("a plane")
}

fn real(value: &Value) -> f64 {
    value.as_f64().expect("a number")
}

fn pair(row: &Value) -> Vector2<f64> {
    Vector2::new(real(&row[0]), real(&row[1]))
}

/// The sheet of the given rod at the wall about its first touch.
fn sheet_at_touch(among: &Arc<ElasticaAmong>, touch: &Value) -> TouchedSheet {
    let (force, x) = (pair(&touch["force_on_mass"]), real(&touch["X"]));
    let base = Vector6::new(0.0, 0.0, -x * force.y, -force.x, -force.y, 0.0);
    let guess = ContactGuess {
        base,
        touches: vec![GuessedTouch {
            surface: 0,
            s: Some(real(&touch["s_contact"])),
            reaction: 0.0,
            length: 0.0,
        }],
    };
    TouchedSheet::new(Arc::clone(among), &guess, &Vector2::new(x, 0.0)).expect("a sheet")
}

/// Catches a wrong equation of a touch, a wrong force on the body or energy, and wrong derivatives of a chart. Five
/// states of a rod at a wall are from another program, derivatives from differences.
#[test]
fn a_sheet_with_a_touch_has_the_given_states() {
    let given = data("tip_wall_given.json");
    let surface = Surface::new(wall(0.1), 0.0).expect("a surface");
    let among = Arc::new(ElasticaAmong::new(&clamp(), vec![surface]).expect("a rod"));
    let mut sheet = sheet_at_touch(&among, &given["touch"]);
    let centre = Vector2::zeros();
    let rates = sheet.reaction_rates(&centre, &-Vector2::x());
    assert!(rates.expect("rates")[0] > 0.0, "the reaction grows inwards");
    for row in given["point_contact"].as_array().expect("rows") {
        let from = sheet.point(&centre).expect("a point").pose;
        let to = Vector2::new(real(&row["x"]), 0.0);
        for k in 1..=10 {
            let pose = from + (to - from) * (f64::from(k) / 10.0);
            let guess = sheet.guess(&centre).expect("a guess");
            sheet = TouchedSheet::new(Arc::clone(&among), &guess, &pose).expect("a sheet");
        }
        let at = sheet.point(&centre).expect("a point");
        let touch = sheet.touches(&centre).expect("touches")[0];
        near(
            (at.force - pair(&row["force_on_mass"])).norm() / at.force.norm(),
            0.0,
            1e-11,
        );
        near(touch.reaction, real(&row["reaction"]), 1e-11);
        near(touch.s, real(&row["sc"]), 1e-11);
        near(at.energy, real(&row["energy"]), 1e-11);
        assert_eq!(sheet.index(&centre).expect("an index"), 0);
        // Height, slope and curvature at the touch.
        near(touch.position.y, 0.1, 1e-12);
        near(touch.relative_curvature, -real(&row["curv_contact"]), 1e-9);

        let (q, h) = (Vector2::new(0.05, -0.03), 1e-4);
        let at = sheet.point(&q).expect("a point");
        let beside = |k: usize| {
            let step = Vector2::ith(k, h);
            [q + step, q - step].map(|q| sheet.point(&q).expect("a point beside"))
        };
        let mut by = Matrix2::zeros();
        for k in 0..2 {
            let [after, before] = beside(k);
            by.set_column(k, &((after.pose - before.pose) / (2.0 * h)));
            let rate = (after.energy - before.energy) / (2.0 * h);
            near(rate, -at.force.dot(&at.jacobian.column(k)), 1e-6);
        }
        assert!(
            (by - at.jacobian).norm() < 1e-6 * by.norm(),
            "{by} {}",
            at.jacobian
        );
    }
}

/// A body of mass 1 with obstacles, without friction.
fn among(obstacles: Vec<MovingObstacle>, friction: f64) -> Bodies {
    let mut bodies = Bodies::new(SurfacePair::new(1.0, friction).expect("a surface"));
    let mass = Mass::Point(PointMass::new(1.0).expect("a mass"));
    bodies.add_body(mass, Shape::Point).expect("a body");
    for obstacle in obstacles {
        bodies.add_obstacle(obstacle);
    }
    bodies
}

fn obstacles(bodies: &Bodies) -> AmongObstacles<'_> {
    AmongObstacles {
        bodies,
        resting_speed: 1e-6,
        max_impacts: 100,
        rod_touches: true,
    }
}

/// The equilibrium near the given touch whose end is at `pose`.
fn start(pose: Vector2<f64>) -> Vector2<f64> {
    let touch = &data("tip_wall_given.json")["touch"];
    let mut q = Vector2::new(real(&touch["kap"]).atanh(), real(&touch["w"]));
    let from = Vector2::new(real(&touch["X"]), 0.0);
    for k in 1..=10 {
        let pose = from + (pose - from) * (f64::from(k) / 10.0);
        q = invert_near(&Elastica, &pose, &q, 1e-15).expect("a start").q;
    }
    q
}

/// Events and invariants of a run.
struct Told {
    events: Vec<RodContactEvent>,
    outcome: Outcome,
    /// Largest change of the ledger.
    drift: f64,
    /// Largest jump of the force on the body over a touch or release.
    jump: f64,
    /// Least distance of the rod from the obstacles, and least reaction.
    least_gap: f64,
    least_reaction: f64,
    steps: u64,
}

fn follow(motion: &mut dyn Motion<'_>, bodies: &[Obstacle]) -> Told {
    let total = motion.now().ledger().total();
    let mut told = Told {
        events: Vec::new(),
        outcome: Outcome::Interrupted,
        drift: 0.0,
        jump: 0.0,
        least_gap: f64::INFINITY,
        least_reaction: f64::INFINITY,
        steps: 0,
    };
    let mut force = motion.now().action();
    while let Some(event) = motion.advance() {
        let now = motion.now();
        let drift = (now.ledger().total() - total).abs();
        assert!(drift >= 0.0);
        told.drift = told.drift.max(drift);
        for (_, at) in now.sections(41) {
            for obstacle in bodies {
                told.least_gap = told
                    .least_gap
                    .min(obstacle.gap(&at.translation.vector).value);
            }
        }
        for at in now.contact().expect("obstacles").rods.iter() {
            told.least_reaction = told.least_reaction.min(at.normal_force);
        }
        match event {
            Event::RodContact(event) => {
                told.jump = told.jump.max((now.action() - force).norm());
                told.events.push(event);
            }
            Event::Stop(outcome) => told.outcome = outcome,
            _ => {}
        }
        force = now.action();
    }
    told.steps = motion.cost().steps;
    told
}

fn options(duration: f64, tolerance: f64) -> Options {
    let options = Options::new(duration).expect("a duration");
    options.with_tolerance(tolerance).expect("a tolerance")
}

/// Catches a touch or a release that is missed, late or at a wrong place, and a force that jumps there. The ledger must
/// close. Times and states are from another program (tools/ref_rod_touch.py).
#[test]
fn a_rod_touches_a_wall_and_leaves_it() {
    let given = data("rod_touch.json");
    let mass = PointMass::new(1.0).expect("a mass");
    let bodies = among(vec![wall(real(&given["wall"])).into()], 0.0);
    let q = start(pair(&given["start"]["pose"]));
    let v = pair(&given["start"]["velocity"]);
    let end = &given["end"];
    let mut errors = Vec::new();
    for tolerance in [1e-7, 1e-12] {
        let options = options(real(&end["t"]), tolerance);
        let among = Some(obstacles(&bodies));
        let mut motion = on_elastica(&mass, Some(q), v, among, options).expect("a run");
        let told = follow(&mut *motion, &[wall(0.1)]);
        assert_eq!(told.outcome, Outcome::EndOfTime);
        let keys: Vec<_> = told.events.iter().map(RodContactEvent::key).collect();
        assert_eq!(keys, ["touch", "release"]);
        let times = told
            .events
            .iter()
            .zip(given["events"].as_array().expect("events"));
        let off = |a: f64, b: &Value| (a - real(b)).abs();
        let error = times.map(|(own, row)| off(own.t, &row["t"]).max(off(own.at.s, &row["s"])));
        let now = motion.now();
        let (place, twist) = (now.pose().translation.vector, now.twist());
        let state = [place.x, place.y, twist[3], twist[4]];
        let rows = end["state"].as_array().expect("a state");
        let error = error.chain(state.iter().zip(rows).map(|(own, row)| off(*own, row)));
        errors.push(error.fold(0.0, f64::max));
        // Where a touch begins or ends, rounding of its place makes a reaction of 1e4 times its size.
        let least = [told.least_gap, told.least_reaction];
        assert!(least[0] > -1e-9 && least[1] > -1e-7, "{least:?}");
        assert!(told.drift < 1e2 * tolerance.max(1e-13), "{:e}", told.drift);
        if tolerance < 1e-11 {
            assert!(told.jump < 1e-8, "the force jumps by {:e}", told.jump);
        }
    }
    assert!(errors[1] < 1e-9, "{errors:?}");
    assert!(errors[0] < 1e-4, "{errors:?}");
}

/// Catches an obstacle's curvature that is left out, several touches that are mixed up, and a bound that is passed in
/// silence: discs at random beside a moving rod. The rod never enters one, reactions never pull, and the energy stays.
#[test]
fn rods_among_discs_at_random_enter_none_and_keep_their_energy() {
    let mass = PointMass::new(1.0).expect("a mass");
    let mass = mass.with_dead_force([3.0, -4.0].into()).expect("a force");
    let q = Vector2::new(-0.25, 1.3);
    let rod = Equilibrium::new(q[0], q[1]).expect("a rod");
    let (mut touches, mut complete) = (0, 0);
    for draw in 0..6 {
        let x = |k: i32| (f64::from(draw * 7 + k) * 0.618_033_988_749_895).fract();
        let disc = |k: i32, side: f64| {
            let at = rod
                .section(0.25 + 0.3 * f64::from(k) + 0.15 * x(k))
                .expect("a section");
            let (radius, gap) = (0.04 + 0.1 * x(k + 2), 0.002 + 0.02 * x(k + 4));
            let (sin, cos) = at.theta.sin_cos();
            let centre = Vector2::new(at.x, at.y) + Vector2::new(-sin, cos) * side * (radius + gap);
            Obstacle::disc(centre, radius, false).expect("a disc")
        };
        let discs = [
            disc(0, 1.0),
            disc(1, if draw % 2 == 0 { 1.0 } else { -1.0 }),
        ];
        let bodies = among(discs.iter().cloned().map(Into::into).collect(), 0.0);
        let v = Vector2::new(-0.6, 0.9) * (1.0 - 2.0 * f64::from(draw % 2));
        let among = Some(obstacles(&bodies));
        let motion = on_elastica(&mass, Some(q), v, among, options(0.4, 1e-9));
        let mut motion = motion.expect("a run");
        let told = follow(&mut *motion, &discs);
        touches += told.events.len();
        assert!(told.least_gap > -1e-9, "draw {draw}: {:e}", told.least_gap);
        assert!(
            told.least_reaction > -1e-6,
            "draw {draw}: {:e}",
            told.least_reaction
        );
        assert!(told.drift < 1e-7, "draw {draw}: {:e}", told.drift);
        match &told.outcome {
            Outcome::EndOfTime => complete += 1,
            Outcome::RodTouch(touch) => assert!(
                !matches!(touch.bound, RodBound::Touch | RodBound::Release),
                "draw {draw}: {touch:?}"
            ),
            Outcome::Stuck(stuck) => {
                let why = stuck.to_string();
                let named = ["and would snap", "is pulled taut over an obstacle"];
                assert!(
                    named.iter().any(|name| why.contains(name)),
                    "draw {draw}: {why}"
                );
            }
            other => panic!("draw {draw}: {other:?}"),
        }
    }
    assert!(
        touches >= 6 && complete >= 3,
        "{touches} events, {complete} to the end"
    );
}

/// Catches a rod that passes through what it cannot follow: obstacles that move, have friction or sharp edges end the
/// run by name.
#[test]
fn touches_that_are_not_followed_end_the_run_by_name() {
    let given = data("rod_touch.json");
    let mass = PointMass::new(1.0).expect("a mass");
    let q = start(pair(&given["start"]["pose"]));
    let v = pair(&given["start"]["velocity"]);
    let edge = [[0.55, 0.1], [0.65, 0.1], [0.6, 0.2]].map(Vector2::from);
    let edge = Obstacle::polygon(&edge).expect("a polygon");
    for (what, bodies) in [
        ("friction", among(vec![wall(0.1).into()], 0.2)),
        ("edge", among(vec![edge.into()], 0.0)),
    ] {
        let among = Some(obstacles(&bodies));
        let motion = on_elastica(&mass, Some(q), v, among, options(0.05, 1e-9));
        let mut motion = motion.expect("a run");
        let outcome = loop {
            match motion.advance() {
                Some(Event::Stop(outcome)) => break outcome,
                Some(_) => {}
                None => panic!("no outcome"),
            }
        };
        let Outcome::RodTouch(touch) = &outcome else {
            panic!("{what}: {outcome:?}");
        };
        assert_eq!(touch.bound, RodBound::Touch, "{what}");
        let words = outcome.to_string();
        assert!(
            words.contains("without friction and without sharp edges"),
            "{words}"
        );
    }
}

/// Catches one sharp obstacle that ends the touches of all others.
#[test]
fn unfollowed_obstacles_elsewhere_change_no_touch() {
    let given = data("rod_touch.json");
    let mass = PointMass::new(1.0).expect("a mass");
    let q = start(pair(&given["start"]["pose"]));
    let v = pair(&given["start"]["velocity"]);
    let edge = [[0.3, 0.25], [0.32, 0.3], [0.28, 0.3]].map(Vector2::from);
    let edge = Obstacle::polygon(&edge).expect("a polygon");
    let bodies = among(vec![wall(0.1).into(), edge.into()], 0.0);
    let among = Some(obstacles(&bodies));
    let motion = on_elastica(&mass, Some(q), v, among, options(0.05, 1e-9));
    let mut motion = motion.expect("a run");
    let told = follow(&mut *motion, &[wall(0.1)]);
    assert_eq!(told.outcome, Outcome::EndOfTime);
    let keys: Vec<_> = told.events.iter().map(RodContactEvent::key).collect();
    assert_eq!(keys, ["touch", "release"]);
    near(told.events[0].t, real(&given["events"][0]["t"]), 1e-5);
}

/// Catches a name of a sheet that differs from the name of the free rod at the touch.
#[test]
fn a_sheet_keeps_the_name_of_the_free_rod_at_the_touch() {
    let given = data("tip_wall_given.json");
    let touch = &given["touch"];
    let surface = Surface::new(wall(0.1), 0.0).expect("a surface");
    let among = Arc::new(ElasticaAmong::new(&clamp(), vec![surface]).expect("a rod"));
    let sheet = sheet_at_touch(&among, touch);
    let free = Vector2::new(real(&touch["kap"]).atanh(), real(&touch["w"]));
    assert_eq!(sheet.sheet(&Vector2::zeros()), Elastica.sheet(&free));
}
