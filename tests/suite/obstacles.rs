//! Scenes of rods among obstacles: the program's equilibria and branches against the library, refusals, files.

use snaprod::scene::Scene;
use snaprod::study::{self, Silent};

const PEG: &str = include_str!("../../scenes/peg.toml");

fn parsed(text: &str) -> Scene {
    Scene::parse(text).unwrap_or_else(|faults| panic!("{faults}\n{text}"))
}

fn faults(text: &str) -> String {
    Scene::parse(text)
        .expect_err("a scene with faults")
        .to_string()
}

/// Catches an obstacle in other units than the rod: the contact lies on the peg, its reaction balances the forces at
/// both ends, and the couple at the base has both levers.
#[test]
fn a_peg_carries_its_part_of_the_load() {
    let record = study::equilibrium(&parsed(PEG)).expect("an equilibrium");
    let contacts = record.contacts.as_ref().expect("contacts");
    let [contact] = contacts.each.as_slice() else {
        panic!("{contacts:?}");
    };
    assert_eq!(contact.obstacle, "peg");
    let touch = &contact.touch;
    let from_axis = (touch.position - nalgebra::Vector3::new(0.5, 0.0, -0.1)).norm();
    assert!((from_axis - 0.06).abs() < 1e-12, "{from_axis}");
    let (couple, force) = snaprod::math::se3::halves(&record.found.base);
    let push = touch.normal * touch.reaction;
    let load = nalgebra::Vector3::new(0.0, 0.0, -1.0);
    assert!((force - load - push).norm() < 1e-12);
    let end = record.found.end.position;
    let levers = end.cross(&load) + touch.position.cross(&push);
    assert!((couple - levers).norm() < 1e-11, "{couple} {levers}");
    assert_eq!(record.found.index, 0);
    // The same in other units: lengths in centimetres, stiffness in those units.
    let scaled = PEG
        .replace("length = 1.0", "length = 100.0")
        .replace("0.02", "2.0")
        .replace("[1.0, 1.0]", "[1e4, 1e4]")
        .replace("torsion = 0.8", "torsion = 8e3")
        .replace("[0.5, 0.0, -0.1]", "[50.0, 0.0, -10.0]")
        .replace("radius = 0.05", "radius = 5.0");
    let scaled = study::equilibrium(&parsed(&scaled)).expect("an equilibrium");
    let other = scaled.contacts.expect("contacts").each[0].touch.reaction;
    assert!(
        (other / touch.reaction - 1.0).abs() < 1e-9,
        "{other} {}",
        touch.reaction
    );
}

/// Catches a line that is shown as a point, a weight that the floor does not carry, and an index that is claimed where
/// none is computed: a pipe is lifted off the floor. Numbers of the given data, for the height 0.5.
#[test]
fn a_pipe_lies_on_the_floor() {
    let text = include_str!("../../scenes/pipe.toml");
    let record = study::equilibrium(&parsed(text)).expect("an equilibrium");
    let contacts = record.contacts.as_ref().expect("contacts");
    let line = contacts.each[0].touch.line.expect("a line");
    assert!((6.0 - line.length - 1.9020875861890323).abs() < 1e-9);
    assert!((line.at_end - 0.9226537848043062).abs() < 1e-9);
    assert!((contacts.normal_total() + record.found.end.force.z - 6.0).abs() < 1e-9);
    assert!(!record.indexed && record.summary()["stable"].is_null());
    let table = contacts
        .table(snaprod::scene::Units::Dimensionless)
        .expect("a table");
    assert!(table.columns.iter().any(|column| column.name == "s_to"));
    // In centimetres, with the stiffness in those units.
    let scaled = text
        .replace("length = 6.0", "length = 600.0")
        .replace("mass = 6.0", "mass = 6.0e4")
        .replace("[1.0, 1.0]", "[1e8, 1e8]")
        .replace("torsion = 0.8", "torsion = 0.8e8")
        .replace("0.0, 0.5]", "0.0, 50.0]");
    let scaled = study::equilibrium(&parsed(&scaled)).expect("an equilibrium");
    let other = scaled.contacts.expect("contacts").each[0]
        .touch
        .line
        .expect("a line");
    assert!(
        (other.length / line.length - 100.0).abs() < 1e-6,
        "{}",
        other.length
    );
}

/// Catches a branch that misses a contact, or an event without its obstacle: the branch ends at the equilibrium.
#[test]
fn a_branch_goes_through_contact() {
    let scene = parsed(PEG);
    let record = study::branch(&scene, &mut Silent).expect("a branch");
    let special = &record.branches.specials[0];
    assert_eq!(
        (special.label.as_str(), special.kind_name().as_str()),
        ("TC1", "touch")
    );
    assert_eq!(special.contact.as_ref().expect("a contact").obstacle, "peg");
    assert!(record.is_complete());
    // Just before the touch the rod alone has the least gap 0.
    let text = PEG.replace(
        "force = [0.0, 0.0, -1.0]",
        &format!("force = [0.0, 0.0, {}]", -special.parameter),
    );
    let touching = study::equilibrium(&parsed(&text)).expect("an equilibrium");
    let contacts = touching.contacts.expect("contacts");
    assert!(
        contacts.normal_total() < 1e-6,
        "{}",
        contacts.normal_total()
    );
    let points = &record.branches.points;
    let totals = points.reals("normal_total");
    let last = points.rows() - 1;
    let text = PEG.replace("force = [0.0, 0.0, -1.0]", "force = [0.0, 0.0, -20.0]");
    let there = study::equilibrium(&parsed(&text)).expect("an equilibrium");
    let total = there.contacts.expect("contacts").normal_total();
    assert!(
        (totals[last] / total - 1.0).abs() < 1e-8,
        "{} {total}",
        totals[last]
    );
}

/// Catches a point of a branch in another plane: where the ball's centre lies on the axis of the wire, the data have
/// many planes of symmetry.
#[test]
fn a_branch_stays_in_its_plane() {
    let scene = parsed(include_str!("../../scenes/ball_on_wire.toml"));
    let record = study::branch(&scene, &mut Silent).expect("a branch");
    let points = &record.branches.points;
    let (across, aside) = (points.reals("base_fx"), points.reals("base_fy"));
    let last = points.rows() - 1;
    assert_eq!(points.reals("parameter")[last], 0.0);
    assert!(
        across[last] < across[last - 1] && across[last] < -10.0,
        "{across:?}"
    );
    assert!(aside.iter().all(|force| force.abs() < 1e-9), "{aside:?}");
}

/// Catches a faulty obstacle without a message, and a command that ignores obstacles in silence.
#[test]
fn faults_of_obstacles_are_named() {
    let with = |obstacle: &str| PEG.replace("cylinder = {", &format!("{obstacle} # {{"));
    for (obstacle, words) in [
        (
            "sphere = { radius = -1.0 }",
            "obstacle[0].sphere.radius = -1.0: must be a finite number > 0",
        ),
        (
            "plane = { normal = [0.0, 0.0, 0.0] }",
            "obstacle[0].plane.normal",
        ),
        (
            "plane = { normal = [0.0, 1.0] }",
            "obstacle[0].plane.normal",
        ),
        (
            "capsule = { radius = 0.1 }",
            "obstacle[0].capsule.to: missing",
        ),
        ("cube = { radius = 0.1 }", "obstacle[0].cube: unknown"),
        (
            "",
            "obstacle[0].plane: missing; must be one of plane, cylinder, sphere, capsule and box",
        ),
        (
            "box = { sides = [1.0, 0.0, 1.0] }",
            "obstacle[0].box.sides[1] = 0.0",
        ),
    ] {
        let found = faults(&with(obstacle));
        assert!(found.contains(words), "{obstacle}: {found}");
    }
    // Motions of rods with mass to first order do not follow obstacles.
    let motion = "[rod]\nmodel = \"cosserat\"\nlength = 1.0\nmass = 0.1\ninertia = \"first-order\"\n[rod.section]\nbending = [1.0, 1.0]\ntorsion = 1.0\n[body]\nmass = 1.0\n\
                  joint = \"ball\"\n[start]\nequilibrium = { force = [0.3, 0.0, -0.2] }\n[run]\nduration = 3.0\n[[obstacle]]\nplane = { normal = [0.0, 1.0, 0.0] }";
    assert!(faults(motion).contains("obstacle"), "{}", faults(motion));
    let scene = parsed(PEG);
    let refused = study::all_equilibria(&scene, 60.0, &mut Silent).expect_err("a refusal");
    assert!(
        refused.to_string().contains("does not look for contact"),
        "{refused}"
    );
    // A clamp inside an obstacle.
    let inside = PEG.replace("[0.5, 0.0, -0.1]", "[0.0, 0.0, -0.02]");
    let refused = study::equilibrium(&parsed(&inside)).expect_err("a refusal");
    assert!(refused.to_string().contains("clamp"), "{refused}");
}
