//! Scenes of bodies in space that hit obstacles and each other, on rods and without: events, tables, messages.

use crate::impacts::{data, near, number};
use crate::obstacle_scenes::{of_kind, ran, reals};
use snaprod::scene::Scene;
use snaprod::study::run::Prepared;

const BALL_ON_SLOPE: &str = include_str!("../../scenes/ball_on_slope.toml");
const ROCKING_BLOCK: &str = include_str!("../../scenes/rocking_block.toml");

/// The strip of scenes/bounce_on_floor.toml in space: stiff against bending out of the plane, and against twist.
const BOUNCE_IN_SPACE: &str = r#"
[rod]
model = "cosserat"
length = 1.0
[rod.section]
bending = [1.0, 20.0]
torsion = 20.0
shear = "rigid"
axial = "rigid"
[clamp]
tangent = [1.0, 0.0, 0.0]
normal = [0.0, 0.0, 1.0]
[body]
mass = 1.0
joint = "ball"
[start]
equilibrium = { force = [-1.7384253477131657, -0.22926621465356542, 0.0] }
[loads]
dead = [-6.0, -3.0, 0.0]
[contact]
friction = 0.15
[[obstacle]]
name = "floor"
plane = { point = [0.0, -0.3, 0.0], normal = [0.0, 1.0, 0.0] }
restitution = 0.5
[run]
duration = 0.8
tolerance = 1e-11
samples = 41
"#;

/// Catches contact forces, impacts or friction that act otherwise in space than in the plane: the given case with
/// friction, from another program.
#[test]
fn a_strip_in_space_bounces_as_in_the_plane() {
    let told = ran(BOUNCE_IN_SPACE);
    let case = &data("bounce_given.json")[1];
    let given = case["impacts"].as_array().expect("impacts");
    for (hit, given) in of_kind(&told, "impact").iter().zip(given).take(6) {
        near(number(hit, "t"), number(given, "t"), 1e-9);
        near(number(hit, "lost"), number(given, "lost"), 1e-8);
        let along = hit["impulse"][0].as_f64().expect("J");
        near(along, number(given, "Jt"), 1e-8);
    }
    let stick = of_kind(&told, "stick");
    near(number(stick[0], "t"), number(&case["phases"][2], "t"), 1e-7);
    let contact = &told.summary["contact"];
    assert!(number(contact, "min_gap") > -1e-11);
    assert!(number(contact, "max_cone") < 1e-11);
    let total = reals(&told.tables, "trajectory", "total");
    assert!(total.iter().all(|x| (x - total[0]).abs() < 1e-9));
    let (lost, rubbed) = (
        reals(&told.tables, "trajectory", "impact_lost"),
        reals(&told.tables, "trajectory", "friction_lost"),
    );
    let dissipated = reals(&told.tables, "trajectory", "dissipated");
    let last = lost.len() - 1;
    near(lost[last] + rubbed[last], dissipated[last], 1e-12);
}

/// Catches a body on a rod that is turned wrongly by friction, or whose ledger opens, in the bundled scene.
#[test]
fn a_ball_on_a_wire_spins_up() {
    let told = ran(BALL_ON_SLOPE);
    let hits = of_kind(&told, "impact");
    assert!(hits.len() >= 3);
    // The slope lets the ball through nowhere, and friction is within its cone.
    let contact = &told.summary["contact"];
    assert!(number(contact, "min_gap") > -1e-9);
    for hit in &hits {
        let vector = |key: &str| -> Vec<f64> {
            let all = hit[key].as_array().expect("a vector");
            all.iter().map(|x| x.as_f64().expect("a number")).collect()
        };
        let (impulse, normal) = (vector("impulse"), vector("normal"));
        let along: f64 = impulse.iter().zip(&normal).map(|(a, b)| a * b).sum();
        let size = impulse.iter().map(|x| x * x).sum::<f64>();
        assert!(along > 0.0 && (size - along * along).sqrt() <= 0.3 * along * (1.0 + 1e-9));
    }
    let total = reals(&told.tables, "trajectory", "total");
    let largest = reals(&told.tables, "trajectory", "dissipated");
    let scale = largest.iter().fold(0.0_f64, |most, x| most.max(*x));
    assert!(total.iter().all(|x| (x - total[0]).abs() < 1e-6 * scale));
}

/// Catches bodies without rods that are not seen: landings of Housner's block, given in closed form.
#[test]
fn a_block_without_rods_rocks() {
    let told = ran(ROCKING_BLOCK);
    let case = &data("bodies_given.json")["rocking"][0];
    let mut times: Vec<f64> = of_kind(&told, "impact")
        .iter()
        .map(|hit| number(hit, "t"))
        .collect();
    times.dedup();
    near(times[0], number(case, "first_landing"), 1e-9);
    for (time, given) in times.iter().zip(case["then"].as_array().expect("landings")) {
        near(*time, number(given, "landing_t"), 1e-8);
    }
    assert!(times.len() >= 4);
}

/// A ball that falls on a floor and rolls.
const BALL: &str = r#"
[[body]]
name = "ball"
solid = { ball = 0.2, density = 1000.0 }
shape = "solid"
position = [0.0, 0.0, 0.1]
velocity = [1.0, 0.0, 0.0]
[loads]
gravity = [0.0, 0.0, -9.81]
[[obstacle]]
name = "floor"
plane = { normal = [0.0, 0.0, 1.0] }
friction = 0.2
[run]
duration = 0.3
tolerance = 1e-12
samples = 4
"#;

/// Catches a free body whose friction does not turn it: a ball that slides begins to roll at 2 v/(7 mu g), with 5/7 of
/// its speed.
#[test]
fn a_ball_without_rods_begins_to_roll() {
    let told = ran(BALL);
    let case = &data("bodies_given.json")["roll"][0];
    let stick = of_kind(&told, "stick");
    near(number(stick[0], "t"), number(case, "t_roll"), 1e-10);
    let speed = reals(&told.tables, "trajectory", "ball.vx");
    near(speed[3], number(case, "v_roll"), 1e-10);
}

/// Catches an obstacle that turns about another place, or the other way: a plane that turns about its point with the
/// rate 1 meets a body at rest at the angle of the body, and throws it.
#[test]
fn a_plane_that_turns_hits_a_body_at_rest() {
    let told = ran(r#"
        [[body]]
        name = "m"
        mass = 1.0
        position = [3.0, 0.5, 0.0]
        [[obstacle]]
        name = "door"
        plane = { point = [2.0, 0.0, 0.0], normal = [0.0, 1.0, 0.0] }
        motion = { turn = { axis = [0.0, 0.0, 1.0], rate = 1.0 } }
        restitution = 0.5
        [run]
        duration = 1.0
        "#);
    let hits = of_kind(&told, "impact");
    near(number(hits[0], "t"), 0.5_f64.atan(), 1e-11);
    let lever = 1.25_f64.sqrt();
    // The body leaves with (1 + e) times the speed of the plane at the place.
    let after = hits[0]["after"].as_array().expect("a velocity");
    let normal = hits[0]["normal"].as_array().expect("a normal");
    let relative: f64 = (after.iter().zip(normal))
        .map(|(a, n)| a.as_f64().unwrap_or(f64::NAN) * n.as_f64().unwrap_or(f64::NAN))
        .sum();
    near(relative, 0.5 * lever, 1e-10);
    let work = number(&told.summary["contact"], "obstacle_work");
    near(work, 1.5 * lever * lever, 1e-10);
}

/// Two balls on rods, between which a third one flies.
const CRADLE: &str = r#"
[[rod]]
name = "left"
model = "cosserat"
length = 1.0
section = { bending = [1.0, 1.0], torsion = 1.0, axial = 400.0, shear = "rigid" }
from = { position = [0.0, 0.0, 0.0], tangent = [0.0, 0.0, -1.0] }
to = { body = "a" }
[[body]]
name = "a"
solid = { ball = 0.2, density = 240.0 }
shape = "solid"
velocity = [0.5, 0.0, 0.0]
[[body]]
name = "b"
solid = { ball = 0.2, density = 240.0 }
shape = "solid"
position = [0.3, 0.01, -1.0]
[contact]
restitution = 0.9
pairs = [{ between = ["b", "a"], friction = 0.1 }]
[[obstacle]]
name = "wall"
plane = { point = [0.6, 0.0, 0.0], normal = [-1.0, 0.0, 0.0] }
touches = ["b"]
[run]
duration = 1.0
samples = 21
"#;

/// Catches contacts of two bodies that act on one of them alone, pairs that keep the common surface, and obstacles that
/// touch what they do not name.
#[test]
fn a_ball_on_a_rod_hits_a_free_one() {
    let told = ran(CRADLE);
    let hits = of_kind(&told, "impact");
    assert_eq!((&hits[0]["a"], &hits[0]["b"]), (&"a".into(), &"b".into()));
    assert_eq!(
        (&hits[1]["a"], &hits[1]["b"]),
        (&"b".into(), &"wall".into())
    );
    // Friction of the pair turns the free ball.
    let spin = reals(&told.tables, "trajectory", "b.wz");
    assert!(spin[spin.len() - 1].abs() > 1e-4);
    let total = reals(&told.tables, "trajectory", "total");
    assert!(total.iter().all(|x| (x - total[0]).abs() < 1e-8));
}

/// Catches a resolved scene that is another one.
#[test]
fn scenes_in_space_are_written_and_read_again() {
    for text in [BALL_ON_SLOPE, ROCKING_BLOCK, BALL, CRADLE, BOUNCE_IN_SPACE] {
        let scene = Scene::parse(text).unwrap_or_else(|faults| panic!("{faults}"));
        let value = serde_json::to_value(&scene).expect("JSON");
        let again = toml::to_string(&value).expect("TOML");
        assert_eq!(
            Scene::parse(&again).unwrap_or_else(|faults| panic!("{faults}\n{again}")),
            scene
        );
    }
}

/// Catches bad input that is accepted, and messages without advice.
#[test]
fn faults_in_space_have_words() {
    let faults = |text: &str, set: &str| match Scene::parse_with(text, &[set]) {
        Ok(_) => panic!("{set} is accepted"),
        Err(faults) => faults.to_string(),
    };
    for (text, set, words) in [
        (
            BOUNCE_IN_SPACE,
            "body.shape={ box = [0.1, 0.1, 0.1] }",
            "of a point mass a point or a ball",
        ),
        (
            BOUNCE_IN_SPACE,
            "body.shape={ ball = 0.1 }",
            "friction would turn a ball",
        ),
        (
            BOUNCE_IN_SPACE,
            "run.method=\"symmetric\"",
            "impacts are not reversible",
        ),
        (
            BOUNCE_IN_SPACE,
            "run.method=\"implicit\"",
            "steps of elastic rods among obstacles are explicit",
        ),
        (
            BOUNCE_IN_SPACE,
            "run.landing=\"all\"",
            "follows one landing",
        ),
        (
            BOUNCE_IN_SPACE,
            "obstacle[0].touches=[\"wheel\"]",
            "which is not there",
        ),
        (
            BALL_ON_SLOPE,
            "body.shape={ ball = 0.1, box = [0.1, 0.1, 0.1] }",
            "keep one of them",
        ),
        (
            BALL,
            "body[0].shape={ box = [0.1, 0.0, 0.0] }",
            "one of them may be 0",
        ),
        (BALL, "body[0].shape=\"cube\"", "ball = 0.04"),
        (
            BALL,
            "contact.pairs=[{ between = [\"ball\", \"wall\"] }]",
            "are no such pair",
        ),
        (
            BALL,
            "contact.pairs=[{ between = [\"ball\"] }]",
            "two names",
        ),
        (
            CRADLE,
            "body[0].position=[0.0, 0.0, 0.0]",
            "left out of a body that a rod holds",
        ),
    ] {
        let told = faults(text, set);
        assert!(told.contains(words), "{set}: {told}");
    }
    let start = |text: &str, set: &[&str]| {
        let scene = Scene::parse_with(text, set).unwrap_or_else(|faults| panic!("{faults}"));
        let start = Prepared::new(&scene).and_then(|prepared| prepared.start().map(drop));
        start.expect_err("refused").to_string()
    };
    let told = start(BALL, &["body[0].position=[0.0, 0.0, 0.05]"]);
    assert!(
        told.contains("body \"ball\" starts inside \"floor\" by"),
        "{told}"
    );
    let bar = "obstacle[0]={ name = \"bar\", capsule = { from = [0.5, -0.06, -1.0], to = [0.5, -0.06, 1.0], radius = 0.05 } }";
    let told = start(BOUNCE_IN_SPACE, &[bar]);
    assert!(told.contains("the rod starts"), "{told}");
    let rises = "obstacle[0].motion={ translate = [[0.0, 0.0, 0.0, 0.0], [0.5, 0.0, 0.5, 0.0]] }";
    let told = start(BOUNCE_IN_SPACE, &[rises]);
    assert!(
        told.contains("moves over the place on the ground"),
        "{told}"
    );
}

/// Catches a rod that passes through an obstacle unseen: it falls over a bar before its mass reaches the floor. In the
/// plane, where friction at the rod is not followed, the run ends at the same time.
#[test]
fn a_rod_that_touches_an_obstacle_ends_the_run() {
    let bar = "obstacle[0]={ name = \"bar\", capsule = { from = [0.5, -0.14, -1.0], to = [0.5, -0.14, 1.0], radius = 0.01 } }";
    let scene =
        Scene::parse_with(BOUNCE_IN_SPACE, &[bar]).unwrap_or_else(|faults| panic!("{faults}"));
    let planar = "obstacle[0]={ name = \"bar\", disc = { centre = [0.5, -0.14], radius = 0.01 }, friction = 0.1 }";
    let flat = include_str!("../../scenes/bounce_on_floor.toml");
    let flat = Scene::parse_with(flat, &[planar]).unwrap_or_else(|faults| panic!("{faults}"));
    let ended = |scene: &Scene| {
        let prepared = Prepared::new(scene).expect("a scene");
        let fields = snaprod::study::run::Fields::None;
        let mut silent = snaprod::study::Silent;
        let mut tables: Vec<snaprod::study::Table> = Vec::new();
        let record = snaprod::study::run::run(&prepared, fields, &mut tables, &mut silent);
        let events = record.expect("a run").events();
        let touch = events.iter().find(|event| event["kind"] == "rod_touch");
        let touch = touch.expect("a touch");
        (number(touch, "t"), number(touch, "s"))
    };
    let (space, plane) = (ended(&scene), ended(&flat));
    near(space.0, plane.0, 1e-6);
    near(space.1, plane.1, 1e-3);
}
