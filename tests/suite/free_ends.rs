//! Rods of assemblies with a free end, `to = "free"`: carried along without effect on other parts.

use nalgebra::{Isometry3, UnitQuaternion, Vector3};
use serde_json::Value;
use snaprod::scene::Scene;
use snaprod::study::assembly::equilibrium;
use snaprod::study::modes::modes;
use snaprod::study::run::{Fields, Prepared, RunRecord, run};
use snaprod::study::{Silent, Table, branch};

use crate::support::{quaternion, vector3};

const ROD: &str = "model = \"cosserat\"\nlength = 1.5\nsection = { bending = [1.0, 1.3], torsion = 0.9, shear = [90.0, 80.0], axial = 200.0 }\n";
const HOLDER: &str = "[[rod]]\nname = \"holder\"\nmodel = \"cosserat\"\nlength = 1.0\n\
     section = { bending = [1.0, 1.2], torsion = 0.8, shear = [100.0, 120.0], axial = 300.0 }\n";
const SHAKEN: &str =
    ", motion = { translate = { direction = [3.0, 4.0, 0.0], amplitude = 0.05, frequency = 1.3 } }";
const BODY: &str = "[[body]]\nname = \"mast\"\nmass = 1.0\ninertia = [0.1, 0.12, 0.15]\noffset = [0.05, 0.0, 0.1]\n";
const FREE: &str =
    "position = [0.1, -0.2, 0.3], rotation = { axis = [1.0, 0.5, 0.2], angle = 0.7 }";

/// A mast on a rod; optionally with rods that have a free end, one on the mast and one on the ground.
fn scene(free: bool, shaken: bool, rest: &str) -> String {
    let motion = if shaken { SHAKEN } else { "" };
    let mut text = format!(
        "{HOLDER}from = {{ position = [0.4, 0.0, 0.0]{motion} }}\nto = {{ body = \"mast\" }}\n"
    );
    if free {
        text += &format!(
            "[[rod]]\nname = \"antenna\"\n{ROD}rest = {{ curvature = [0.8, 0.0] }}\nfrom = {{ body = \"mast\", {FREE} }}\nto = \"free\"\n\
             [[rod]]\nname = \"post\"\n{ROD}from = {{ {FREE}{motion} }}\nto = \"free\"\n"
        );
    }
    text + BODY + "[loads]\ngravity = [0.0, 0.0, -1.0]\n" + rest
}

fn parsed(text: &str) -> Scene {
    Scene::parse(text).unwrap_or_else(|faults| panic!("{faults}\n{text}"))
}

/// Poses of the bases of the two rods, on the mast and on the ground.
fn base() -> Isometry3<f64> {
    let axis = Vector3::new(1.0, 0.5, 0.2).normalize();
    let turn = UnitQuaternion::from_scaled_axis(axis * 0.7);
    Isometry3::from_parts(Vector3::new(0.1, -0.2, 0.3).into(), turn)
}

/// The end of the antenna from its base: an arc of curvature 0.8 about d1.
fn arc() -> Isometry3<f64> {
    let (k, angle) = (0.8, 0.8 * 1.5_f64);
    let position = Vector3::new(0.0, (angle.cos() - 1.0) / k, angle.sin() / k);
    let turn = UnitQuaternion::from_scaled_axis(Vector3::x() * angle);
    Isometry3::from_parts(position.into(), turn)
}

fn assert_end(found: &Value, want: &Isometry3<f64>, what: &str) {
    let off = (vector3(found, "position") - want.translation.vector).norm();
    assert!(off <= 1e-9, "{what}: the end is {off:e} off");
    let off = quaternion(found, "quaternion").angle_to(&want.rotation);
    assert!(off <= 1e-7, "{what}: the end is turned {off:e} too far");
}

/// Would catch a rod with a free end that loads its base, stores energy, counts in the index, or is detached from its
/// base.
#[test]
fn at_rest_a_free_rod_rides_and_bears_nothing() {
    let (with, without) = (
        parsed(&scene(true, false, "")),
        parsed(&scene(false, false, "")),
    );
    let (with, without) = (
        equilibrium(&with).expect("with"),
        equilibrium(&without).expect("without"),
    );
    assert_eq!(with.bodies, without.bodies);
    assert_eq!((with.energy, with.index), (without.energy, without.index));
    assert_eq!(with.rods[0], without.rods[0]);
    let summary = with.summary();
    let mast = with.bodies[0].1;
    for (name, want) in [
        ("antenna", mast * base() * arc()),
        ("post", base() * Isometry3::translation(0.0, 0.0, 1.5)),
    ] {
        let rod = &summary["rods"][name];
        assert_end(&rod["end"], &want, name);
        assert_eq!(vector3(&rod["base_wrench"], "couple"), Vector3::zeros());
        assert_eq!(vector3(&rod["base_wrench"], "force"), Vector3::zeros());
    }
    let shape = with.shape().expect("a table");
    let rods = with.shapes.len();
    assert_eq!((rods, shape.rows()), (3, 3 * 101));
}

fn ran(text: &str) -> (RunRecord, Table) {
    let prepared = Prepared::new(&parsed(text)).expect("a motion");
    let mut tables: Vec<Table> = Vec::new();
    let record = run(&prepared, Fields::None, &mut tables, &mut Silent).expect("a run");
    assert_eq!(record.reason(), None);
    (record, tables.swap_remove(0))
}

/// Would catch a rod with a free end that changes a motion, or lags behind its body or moving ground.
#[test]
fn in_motion_a_free_rod_rides_and_changes_nothing() {
    let time = "[run]\nduration = 1.0\ntolerance = 1e-8\nsamples = 11\n";
    let (with, moved) = ran(&scene(true, true, time));
    let (_, alone) = ran(&scene(false, true, time));
    // The columns of the free ends come last.
    for (moved, alone) in moved.csv().lines().zip(alone.csv().lines()) {
        let moved = moved.strip_prefix(alone).expect("the same motion");
        assert!(moved.starts_with(','), "{moved}");
    }
    assert_eq!(moved.rows(), alone.rows());
    let summary = with.summary();
    let mast = with.last().last.bodies[0].pose;
    let swing = (2.0 * std::f64::consts::PI * 1.3_f64).sin();
    let shift = Isometry3::translation(0.03 * swing, 0.04 * swing, 0.0);
    for (name, want) in [
        ("antenna", mast * base() * arc()),
        (
            "post",
            shift * base() * Isometry3::translation(0.0, 0.0, 1.5),
        ),
    ] {
        assert_end(&summary["end"]["free_ends"][name], &want, name);
    }
    assert_eq!(with.last().shapes[1].rods.len(), 3);
}

/// Would catch a rod with a free end that stiffens a body, or is lost from modes and branches.
#[test]
fn modes_and_branches_carry_free_rods_along() {
    let time = "[run]\nduration = 1.0\n";
    let [with, without] =
        [true, false].map(|free| modes(&parsed(&scene(free, false, time))).expect("modes"));
    let omegas = |found: &snaprod::study::modes::ModesRecord| -> Vec<f64> {
        let modes = found.motions.modes.iter();
        modes.map(|mode| mode.angular_frequency).collect()
    };
    assert_eq!(omegas(&with), omegas(&without));
    assert_eq!(
        (with.motions.rods.len(), with.motions.modes[0].rods.len()),
        (3, 3)
    );
    let follow = "[continue]\nparameter = \"body.mast.force[0]\"\nfrom = 0.0\nto = 0.4\n";
    let scene =
        parsed(&scene(true, false, follow).replace("offset", "force = [0.0, 0.0, 0.0]\noffset"));
    let record = branch(&scene, &mut Silent).expect("a branch");
    let table = &record.branches.points;
    let last = table.rows() - 1;
    let at = |column: &str| table.reals(column)[last];
    let pose = |of: &str| {
        let part = |name: &str| at(&format!("{of}{name}"));
        let turn = nalgebra::Quaternion::new(part("qw"), part("qx"), part("qy"), part("qz"));
        Isometry3::from_parts(
            Vector3::new(part("x"), part("y"), part("z")).into(),
            UnitQuaternion::from_quaternion(turn),
        )
    };
    let want = pose("mast.") * base() * arc();
    let off = (pose("antenna.end_").translation.vector - want.translation.vector).norm();
    assert!(off <= 1e-9, "the end of the antenna is {off:e} off");
}

/// Would catch a scene with free ends that is written otherwise than read, and an accepted load or joint on a free
/// end.
#[test]
fn scenes_with_free_ends_are_read_and_refused() {
    let good = scene(true, false, "");
    let whole = parsed(&good);
    assert_eq!(parsed(&toml::to_string(&whole).expect("TOML")), whole);
    let antenna = format!("from = {{ body = \"mast\", {FREE} }}");
    let after = good
        .find("[[rod]]\nname = \"antenna\"")
        .expect("the antenna");
    let end = good.find("[[body]]").expect("the body");
    let first = format!("{}{}{}", &good[after..end], &good[..after], &good[end..]);
    for (text, field, words) in [
        (
            good.replace(
                &antenna,
                &antenna.replace(", pos", ", joint = \"ball\", pos"),
            ),
            "rod[1].from.joint",
            "turn as it likes",
        ),
        (
            good.replacen("length = 1.5", "contact_diameter = 0.1\nlength = 1.5", 1),
            "rod[1].contact_diameter",
            "load the free end",
        ),
        (
            good.replacen("\"free\"", "\"ground\"", 1),
            "rod[1].to",
            "the ground is",
        ),
        (
            good.replace(
                "inertia = [0.1, 0.12, 0.15]\noffset = [0.05, 0.0, 0.1]\n",
                "",
            ),
            "rod[1].from.body",
            "point mass",
        ),
        (first, "rod[0].to", "move this [[rod]] below"),
        (
            good.clone() + "[end]\nforce = [0.0, 0.0, 1.0]\n",
            "end",
            "end",
        ),
    ] {
        let faults = Scene::parse(&text).expect_err("faults");
        let told = faults
            .into_iter()
            .any(|fault| fault.field == field && fault.to_string().contains(words));
        assert!(
            told,
            "{field}: {}",
            Scene::parse(&text).expect_err("faults")
        );
    }
}
