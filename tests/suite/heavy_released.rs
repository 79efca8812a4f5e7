//! Rods of their own mass let go from where people bend them, with default options: bent up to a free end, pushed by a
//! sudden force in the plane and in space, with a section's shape, up to a contact of the rod with itself.

use snaprod::scene::Scene;
use snaprod::study::{Silent, Table, run};

fn scene(rod: &str, rest: &str) -> Scene {
    let text = format!("[rod]\nlength = 1.0\ninertia = \"full\"\n{rod}\n{rest}");
    Scene::parse(&text).unwrap_or_else(|faults| panic!("{faults}\n{text}"))
}

fn ran(scene: &Scene) -> run::RunRecord {
    let prepared = run::Prepared::new(scene).expect("a scene that runs");
    let mut tables: Vec<Table> = Vec::new();
    run::run(&prepared, run::Fields::None, &mut tables, &mut Silent).expect("a record")
}

const WIRE: &str =
    "model = \"cosserat\"\nmass = 1.0\nsection = { bending = [1.0, 1.0], torsion = 1.0 }";
const STRIP: &str = "model = \"elastica\"\nmass = 1.0\nbending_stiffness = 1.0";

fn end(record: &run::RunRecord, key: &str) -> f64 {
    record.summary()["end"][key].as_f64().expect(key)
}

/// Catches a mesh that gains energy where elements are halved (0.87 of the largest energy), and errors of Newton's
/// iteration that add up over short steps: the couple of the bent rod jumps to 0 at the free end, and waves of every
/// length run through the rod.
#[test]
fn a_bent_rod_let_go_keeps_its_energy() {
    let rest = "[start]\nstrain = { u2 = [1.0] }\n[run]\nduration = 0.05\ntolerance = 1e-3";
    let record = ran(&scene(WIRE, rest));
    let summary = record.summary();
    assert_eq!(summary["outcome"], "end_of_time", "{:?}", record.reason());
    let open = summary["energy_error"]["relative"]
        .as_f64()
        .expect("an error");
    assert!(open < 1e-3, "{open}");
    assert!(
        summary["nodes"]["most"].as_u64() > Some(13),
        "no element was halved"
    );
}

/// Catches a rod in the plane without the method that follows waves: the same motion in the plane and in space, at the
/// default tolerance.
#[test]
fn a_sudden_force_moves_a_strip_as_a_wire() {
    let run = "[start]\nrest = \"straight\"\n[run]\nduration = 0.5\n[loads]\n";
    let strip = scene(STRIP, &format!("{run}dead = [0.0, 1.0]"));
    assert_eq!(strip.run().expect("a run").tolerance, 1e-4);
    let (strip, wire) = (
        ran(&strip),
        ran(&scene(WIRE, &format!("{run}dead = [1.0, 0.0, 0.0]"))),
    );
    assert_eq!(strip.outcome(), "end_of_time", "{:?}", strip.reason());
    for (flat, spatial) in [("x", "z"), ("y", "x"), ("elastic", "elastic")] {
        let (a, b) = (end(&strip, flat), end(&wire, spatial));
        assert!((a - b).abs() < 1e-8, "{flat}: {a}, {b}");
    }
    assert!(end(&strip, "y") > 0.01);
}

/// Catches rods with a shape that are left to strains at nodes, where a run never ends, because contact is looked for.
#[test]
fn a_rod_with_a_shape_moves_as_without_thickness() {
    let cord = "model = \"cosserat\"\nmaterial = { E = 1e7, nu = 0.4, density = 1000.0 }\nsection = { circle = { diameter = 0.01 } }";
    let rest =
        "[start.equilibrium]\nforce = [0.005, 0.0, 0.0]\n[run]\nduration = 0.5\ntolerance = 1e-3";
    let thick = ran(&scene(cord, rest));
    let thin = ran(&scene(&format!("contact_diameter = 0.0\n{cord}"), rest));
    for key in ["x", "z", "vx"] {
        assert_eq!(end(&thick, key), end(&thin, key), "{key}");
    }
}

/// Catches a contact in elements that is missed or late: the time is that of strains at nodes at a fine tolerance.
#[test]
fn a_coil_touches_itself_when_strains_at_nodes_say_so() {
    let coil = "contact_diameter = 0.02\ndamping = { proportional = 0.02 }\nrest = { curvature = [0.0, 8.0] }";
    let touch = |tolerance: f64| {
        let rest = format!(
            "[start]\nstrain = {{ u2 = [5.5] }}\n[contact]\nrods = \"obstacles\"\n\
             [run]\nduration = 0.5\ntolerance = {tolerance:e}"
        );
        let record = ran(&scene(&format!("{coil}\n{WIRE}"), &rest));
        assert_eq!(record.outcome(), "self_contact", "{:?}", record.reason());
        record.events()[0]["t"].as_f64().expect("a time")
    };
    let (elements, nodes) = (touch(1e-4), touch(1e-6));
    assert!(
        (elements - nodes).abs() < 1e-5 * nodes.max(1.0),
        "{elements} {nodes}"
    );
}
