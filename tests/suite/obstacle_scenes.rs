//! Scenes of planar rods whose bodies hit obstacles: events, tables, units, refusals.

use crate::impacts::{data, near, number};
use serde_json::Value;
use snaprod::scene::Scene;
use snaprod::study::run::{Fields, Prepared, run};
use snaprod::study::{Cell, Silent, Table};

const BOUNCE: &str = include_str!("../../scenes/bounce_on_floor.toml");

/// The scene in other units: lengths in cm, masses in g, times in ms, with the clamp elsewhere and turned.
const ELSEWHERE: &str = r#"
[rod]
model = "elastica"
length = 100.0
bending_stiffness = 1e3             # g cm^3/ms^2
[body]
mass = 1e3
[clamp]
position = [10.0, 20.0]
angle = 1.5707963267948966
[start]
lambda = 1.3241896270224394
p = -0.25
[loads]
dead = [0.3, -0.6]
[[obstacle]]
plane = { point = [40.0, 0.0], normal = [-2.0, 0.0] }
[contact]
restitution = 0.5
friction = 0.15
[run]
duration = 800.0
tolerance = 1e-12
samples = 81
"#;

pub struct Ran {
    pub events: Vec<Value>,
    pub summary: Value,
    pub tables: Vec<Table>,
}

pub fn ran(text: &str) -> Ran {
    let scene = Scene::parse(text).unwrap_or_else(|faults| panic!("{faults}"));
    let prepared = Prepared::new(&scene).expect("a scene");
    let mut tables: Vec<Table> = Vec::new();
    let record = run(&prepared, Fields::None, &mut tables, &mut Silent).expect("a run");
    assert_eq!(record.reason(), None);
    Ran {
        events: record.events(),
        summary: record.summary(),
        tables,
    }
}

pub fn reals(tables: &[Table], table: &str, column: &str) -> Vec<f64> {
    let table = tables
        .iter()
        .find(|each| each.name == table)
        .expect("a table");
    let column = table.column(column).expect("a column");
    let rows = (0..table.rows()).map(|row| match column.cell(row) {
        Cell::Real(x) => x,
        other => panic!("{other:?}"),
    });
    rows.collect()
}

pub fn of_kind<'e>(ran: &'e Ran, kind: &str) -> Vec<&'e Value> {
    ran.events
        .iter()
        .filter(|event| event["kind"] == kind)
        .collect()
}

/// Catches a scene whose obstacles do nothing, events that are not written, and columns that do not add up.
#[test]
fn a_bouncing_mass_is_written() {
    let told = ran(BOUNCE);
    let case = &data("bounce_given.json")[0];
    let hits = of_kind(&told, "impact");
    for (hit, given) in hits
        .iter()
        .zip(case["impacts"].as_array().expect("impacts"))
        .take(6)
    {
        near(number(hit, "t"), number(given, "t"), 1e-11);
        near(number(hit, "lost"), number(given, "lost"), 1e-10);
        near(
            hit["place"][0].as_f64().expect("x"),
            number(given, "x"),
            1e-11,
        );
        assert_eq!((&hit["a"], &hit["b"]), (&"body".into(), &"floor".into()));
    }
    assert_eq!(of_kind(&told, "accumulation").len(), 1);
    let contact = &told.summary["contact"];
    assert_eq!(contact["counts"]["impact"], hits.len());
    near(number(contact, "impact_lost"), number(case, "lost"), 1e-10);
    assert!(number(contact, "min_gap") > -1e-11);
    // The contact lasts to the end, and its force is that of the given program at the last time.
    let (times, forces) = (
        reals(&told.tables, "contacts", "t"),
        reals(&told.tables, "contacts", "normal"),
    );
    assert_eq!(times.last(), Some(&2.0));
    assert!(times[0] > 0.53 && forces.iter().all(|force| *force > 0.0));
    near(forces[forces.len() - 1], 1.027_622_758_970_459_6, 1e-9);
    let lost = reals(&told.tables, "trajectory", "impact_lost");
    assert!(lost[0] == 0.0 && lost.windows(2).all(|pair| pair[0] <= pair[1]));
    let dissipated = reals(&told.tables, "trajectory", "dissipated");
    near(
        lost[lost.len() - 1],
        dissipated[dissipated.len() - 1],
        1e-15,
    );
}

/// Catches a number of an obstacle, a contact or an event in wrong units, and a clamp elsewhere that is taken for the
/// origin. The scene is the given one with friction, turned by a right angle: x here is -y there.
#[test]
fn units_and_clamps_change_nothing() {
    let told = ran(ELSEWHERE);
    let case = &data("bounce_given.json")[1];
    // Units of time and energy: sqrt(m L^3/EI) = 1e3, EI/L = 10.
    for (hit, given) in of_kind(&told, "impact")
        .iter()
        .zip(case["impacts"].as_array().expect("impacts"))
        .take(6)
    {
        near(number(hit, "t"), 1e3 * number(given, "t"), 1e-9);
        near(number(hit, "lost"), 10.0 * number(given, "lost"), 1e-9);
        let place = hit["place"][1].as_f64().expect("y");
        near(place, 20.0 + 100.0 * number(given, "x"), 1e-9);
        let along = hit["impulse"][1].as_f64().expect("J");
        near(along, 100.0 * number(given, "Jt"), 1e-8);
    }
    let stick = of_kind(&told, "stick");
    near(
        number(stick[0], "t"),
        1e3 * number(&case["phases"][2], "t"),
        2e-8,
    );
    let contact = &told.summary["contact"];
    let lost = number(contact, "impact_lost") + number(contact, "friction_lost");
    near(lost, 10.0 * number(case, "lost"), 1e-7);
    assert!(number(contact, "max_cone") < 1e-12);
}

/// The scene strip_at_wall.toml in other units, as [`ELSEWHERE`], with the clamp elsewhere and turned.
const WALL_ELSEWHERE: &str = r#"
[rod]
model = "elastica"
length = 100.0
bending_stiffness = 1e3
[body]
mass = 1e3
[clamp]
position = [10.0, 20.0]
angle = 1.5707963267948966
[start]
position = [10.0, 117.5]
sheet = { mode = 1, sign = "+", near = 4.5 }
velocity = [-0.005, -0.08]
[[obstacle]]
name = "wall"
plane = { point = [0.0, 5.0], normal = [3.0, 0.0] }
[run]
duration = 50.0
tolerance = 1e-12
samples = 101
"#;

/// Catches touches of a rod that are not written, or written in wrong units, and a clamp that is taken for the origin.
/// The given motion is that of tools/ref_rod_touch.py.
#[test]
fn a_rod_that_touches_a_wall_is_written() {
    let given = data("rod_touch.json");
    let told = ran(WALL_ELSEWHERE);
    let contact = &told.summary["contact"];
    for (kind, row) in ["touch", "release"]
        .into_iter()
        .zip(given["events"].as_array().expect("events"))
    {
        let events = of_kind(&told, kind);
        assert_eq!((events.len(), &contact["rod_counts"][kind]), (1, &1.into()));
        near(number(events[0], "t"), 1e3 * number(row, "t"), 1e-8);
        near(number(events[0], "s"), 100.0 * number(row, "s"), 1e-8);
        near(events[0]["place"][0].as_f64().expect("x"), 0.0, 1e-9);
        near(events[0]["normal"][0].as_f64().expect("nx"), 1.0, 1e-12);
        assert_eq!(
            (&events[0]["a"], &events[0]["b"]),
            (&"rod".into(), &"wall".into())
        );
    }
    let end = &given["end"]["state"];
    let last = |column: &str| {
        *reals(&told.tables, "trajectory", column)
            .last()
            .expect("rows")
    };
    near(last("y") - 20.0, 100.0 * end[0].as_f64().expect("x"), 1e-9);
    near(10.0 - last("x"), 100.0 * end[1].as_f64().expect("y"), 1e-9);
    let times = reals(&told.tables, "contacts", "t");
    let [touch, release] = [0, 1].map(|k| 1e3 * number(&given["events"][k], "t"));
    assert!(times.iter().all(|t| touch <= *t && *t <= release) && times.len() > 40);
    let forces = reals(&told.tables, "contacts", "normal");
    assert!(forces.iter().all(|force| *force > 0.0));
    let total = reals(&told.tables, "trajectory", "total");
    near(total[0], total[total.len() - 1], 1e-10);
}

/// Catches a resolved scene that is another one.
#[test]
fn scenes_with_obstacles_are_written_and_read_again() {
    let text = format!(
        "{BOUNCE}\n[[obstacle]]\npolygon = [[2.0, 0.0], [3.0, 0.0], [3.0, 1.0]]\nfriction = 0.2\n\
         motion = {{ translate = [[0.0, 0.0, 0.0], [1.0, 0.1, 0.0]] }}\n\
         [[obstacle]]\nsegment = {{ from = [0.0, 2.0], to = [1.0, 2.0], radius = 0.1 }}\n\
         [[obstacle]]\ndisc = {{ centre = [0.0, -2.0], radius = 0.5, inside = false }}\n\
         [contact]\nlaw = \"poisson\"\nrods = \"none\"\nsettle_speed = 1e-5\n"
    )
    .replace("mass = 1.0", "mass = 1.0\nshape = \"point\"");
    let scene = Scene::parse(&text).unwrap_or_else(|faults| panic!("{faults}"));
    let value = serde_json::to_value(&scene).expect("JSON");
    let again = toml::to_string(&value).expect("TOML");
    assert_eq!(
        Scene::parse(&again).unwrap_or_else(|faults| panic!("{faults}\n{again}")),
        scene
    );
}

/// Catches bad input that is accepted, and messages that do not say which values are allowed.
#[test]
fn faults_of_obstacles_have_words() {
    let faults = |set: &[&str]| match Scene::parse_with(BOUNCE, set) {
        Ok(_) => panic!("{set:?} is accepted"),
        Err(faults) => faults.to_string(),
    };
    for (set, words) in [
        ("obstacle[0].restitution=1.5", "must be a number in [0, 1]"),
        ("obstacle[0].restitution=nan", "must be a number in [0, 1]"),
        ("obstacle[0].friction=-0.1", "must be a finite number >= 0"),
        ("obstacle[0].friction=nan", "must be a finite number >= 0"),
        (
            "obstacle[0].plane.normal=[0.0, 0.0]",
            "obstacle[0].plane.normal",
        ),
        (
            "obstacle[0].plane.normal=[0.0, 0.0, 1.0]",
            "two finite numbers",
        ),
        ("obstacle[0].disc={ radius = 0.1 }", "one shape"),
        ("obstacle[0].sphere={ radius = 0.1 }", "sphere"),
        (
            "obstacle[0]={ disc = { radius = -1.0 } }",
            "must be a finite number > 0",
        ),
        (
            "obstacle[0]={ polygon = [[0.0, 0.0], [1.0, 0.0], [0.2, 0.1], [0.0, 1.0]] }",
            "not convex",
        ),
        (
            "obstacle[0]={ name = \"floor\" }",
            "one of plane, disc, segment and polygon",
        ),
        ("contact.law=\"hertz\"", "stronge"),
        ("contact.settle_speed=0.0", "must be a finite number > 0"),
        ("body.shape=\"cube\"", "ball = 0.04"),
        ("body.shape={ ball = 0.0 }", "must be a finite number > 0"),
        (
            "clamp.motion={ translate = [[0.0, 0.0, 0.0], [1.0, 0.0, 0.1]] }",
            "left out where the clamp moves",
        ),
        ("run.method=\"symmetric\"", "impacts are not reversible"),
        ("loads.distributed=[0.0, -0.1]", "load along it"),
    ] {
        let told = faults(&[set]);
        assert!(told.contains(words), "{set}: {told}");
    }
    let told = faults(&["body.shape={ ball = 0.04 }", "contact.friction=0.1"]);
    assert!(told.contains("friction would turn a ball"), "{told}");
    let told = faults(&["rod.mass=0.1", "rod.inertia=\"first-order\""]);
    assert!(told.contains("obstacles are looked for"), "{told}");

    let start = |set: &[&str]| {
        let scene = Scene::parse_with(BOUNCE, set).unwrap_or_else(|faults| panic!("{faults}"));
        let prepared = Prepared::new(&scene).expect("a scene");
        prepared.start().err().expect("refused").to_string()
    };
    for damping in ["rod.damping=0.0", "rod.damping=0.1"] {
        let told = start(&[damping, "obstacle[0].plane.point=[0.0, -0.2]"]);
        assert!(
            told.contains("the body starts inside \"floor\" by"),
            "{told}"
        );
        let disc = "obstacle[0]={ disc = { centre = [0.5, -0.06], radius = 0.05 } }";
        let told = start(&[damping, disc]);
        assert!(told.contains("the rod starts"), "{told}");
    }
}
